// OpenVDB files. The library is the only one that reads them; it trusts what it reads.
#include "openvdb_read.h"

#include <exception>
#include <new>
#include <openvdb/openvdb.h>
#include <openvdb/tools/Dense.h>
#include <stdio.h>

struct nb_openvdb {
    openvdb::FloatGrid::ConstPtr floats;
    openvdb::DoubleGrid::ConstPtr doubles;
    openvdb::CoordBBox box;
};

namespace
{

void say(char *message, size_t size, const char *text, const char *more)
{
    (void)snprintf(message, size, "%s%.150s", text, more);
}

bool is_number(const openvdb::GridBase &grid)
{
    return grid.isType<openvdb::FloatGrid>() || grid.isType<openvdb::DoubleGrid>();
}

// The name of the grid that is meant, which the file has; false after a message.
bool find_name(openvdb::io::File &file, const char *wanted, openvdb::Name *name, char *message, size_t size)
{
    for (openvdb::io::File::NameIterator at = file.beginName(); at != file.endName(); ++at) {
        if (wanted != nullptr ? *at != wanted : !is_number(*file.readGridMetadata(*at))) continue;
        *name = *at;
        return true;
    }
    if (wanted != nullptr)
        say(message, size, "holds no grid of the name ", wanted);
    else
        say(message, size, "holds no grid of float or double", "");
    return false;
}

nb_openvdb_answer take_grid(const openvdb::GridBase::Ptr &grid, nb_openvdb *taken, char *message, size_t size)
{
    if (!is_number(*grid)) {
        say(message, size, "its voxels are of the type ", grid->valueType().c_str());
        return NB_OPENVDB_UNSUPPORTED;
    }
    if (grid->getGridClass() == openvdb::GRID_LEVEL_SET) {
        say(message, size, "is a level set, which holds distances; make a fog volume of it (vdb_tool -ls2fog)", "");
        return NB_OPENVDB_UNSUPPORTED;
    }
    taken->floats = openvdb::gridPtrCast<openvdb::FloatGrid>(grid);
    taken->doubles = openvdb::gridPtrCast<openvdb::DoubleGrid>(grid);
    taken->box = grid->evalActiveVoxelBoundingBox();
    if (!taken->box.empty()) return NB_OPENVDB_OK;
    say(message, size, "has no active voxels", "");
    return NB_OPENVDB_DAMAGED;
}

unsigned long long count_between(long long first, long long last)
{
    return static_cast<unsigned long long>(last - first) + 1;
}

nb_openvdb_answer open(const char *path, const char *name, nb_openvdb *grid, char *message, size_t size)
{
    openvdb::initialize();
    openvdb::io::File file(path);
    openvdb::Name found;
    file.open(false); // without delayed loading, which reads the file later and by another name
    if (!find_name(file, name, &found, message, size)) return NB_OPENVDB_DAMAGED;
    return take_grid(file.readGrid(found), grid, message, size);
}

template <typename Grid> void copy(const Grid &grid, const openvdb::CoordBBox &box, float *voxels)
{
    openvdb::tools::Dense<float, openvdb::tools::LayoutXYZ> dense(box, voxels);
    openvdb::tools::copyToDense(grid, dense, true);
}

} // namespace

nb_openvdb_answer nb_openvdb_open(const char *path, const char *name, nb_openvdb **grid, unsigned long long size[3],
                                  char *message, size_t message_size)
{
    nb_openvdb_answer answer = NB_OPENVDB_MEMORY;
    *grid = nullptr;
    try {
        nb_openvdb *const made = new nb_openvdb;
        *grid = made;
        answer = open(path, name, made, message, message_size);
        for (int i = 0; i < 3 && answer == NB_OPENVDB_OK; i++)
            size[i] = count_between(made->box.min().asPointer()[i], made->box.max().asPointer()[i]);
    } catch (const std::bad_alloc &) {
        answer = NB_OPENVDB_MEMORY;
    } catch (const std::exception &error) {
        say(message, message_size, "OpenVDB cannot read it: ", error.what());
        answer = NB_OPENVDB_DAMAGED;
    } catch (...) {
        say(message, message_size, "OpenVDB cannot read it", "");
        answer = NB_OPENVDB_DAMAGED;
    }
    if (answer != NB_OPENVDB_OK) {
        nb_openvdb_close(*grid);
        *grid = nullptr;
    }
    return answer;
}

nb_openvdb_answer nb_openvdb_copy(const nb_openvdb *grid, float *voxels)
{
    try {
        if (grid->floats)
            copy(*grid->floats, grid->box, voxels);
        else
            copy(*grid->doubles, grid->box, voxels);
    } catch (...) {
        return NB_OPENVDB_MEMORY;
    }
    return NB_OPENVDB_OK;
}

void nb_openvdb_close(nb_openvdb *grid)
{
    delete grid;
}
