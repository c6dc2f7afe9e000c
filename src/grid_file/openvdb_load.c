/* OpenVDB files become voxels where the build has OpenVDB, and say what to do where it has not. */
#include "grid_file.h"

#if defined(NEBEL_HAVE_OPENVDB)

#include "openvdb_read.h"

static nebel_result fail_openvdb(const nb_codec *codec, nb_openvdb_answer answer, const char *message)
{
    static const nebel_result results[] = {[NB_OPENVDB_DAMAGED] = NEBEL_ERROR_FORMAT,
                                           [NB_OPENVDB_UNSUPPORTED] = NEBEL_ERROR_UNSUPPORTED,
                                           [NB_OPENVDB_MEMORY] = NEBEL_ERROR_MEMORY};
    return nb_fail(&codec->log, results[answer], "%s: %s", codec->name,
                   answer == NB_OPENVDB_MEMORY ? "out of memory, of which a damaged file may want any amount"
                                               : message);
}

static nebel_result take_voxels(const nb_codec *codec, const nb_openvdb *grid, const unsigned long long size[3],
                                nb_voxels *voxels)
{
    voxels->type = NEBEL_VOXEL_FLOAT;
    for (int i = 0; i < 3; i++)
        voxels->size[i] = size[i] <= NEBEL_MAX_GRID_SIZE ? (size_t)size[i] : NEBEL_MAX_GRID_SIZE + 1;
    const nebel_result result = nb_voxels_allocate(codec, voxels);
    if (result != NEBEL_OK) return result;
    const nb_openvdb_answer answer = nb_openvdb_copy(grid, voxels->data);
    return answer == NB_OPENVDB_OK ? NEBEL_OK : fail_openvdb(codec, answer, "");
}

nebel_result nb_vdb_read(const nb_codec *codec, const char *name, nb_voxels *voxels)
{
    nb_openvdb *grid;
    unsigned long long size[3];
    char message[256] = "";
    voxels->data = NULL;
    nebel_result result = nb_file_check(&codec->log, NULL, "grid", codec->name);
    if (result != NEBEL_OK) return result;
    const nb_openvdb_answer answer = nb_openvdb_open(codec->name, name, &grid, size, message, sizeof message);
    if (answer != NB_OPENVDB_OK) return fail_openvdb(codec, answer, message);
    result = take_voxels(codec, grid, size, voxels);
    nb_openvdb_close(grid);
    return result;
}

#else

nebel_result nb_vdb_read(const nb_codec *codec, const char *name, nb_voxels *voxels)
{
    (void)name;
    voxels->data = NULL;
    return nb_fail(&codec->log, NEBEL_ERROR_UNSUPPORTED,
                   "%s: this nebel was built without OpenVDB, which reads .vdb; build it with -DNEBEL_OPENVDB=ON "
                   "(Debian: libopenvdb-dev), or make a .nvdb of it: vdb_tool -read in.vdb -write out.nvdb (Debian: "
                   "libopenvdb-tools)",
                   codec->name);
}

#endif
