/* Voxels on their way from a file to the core. */
#ifndef NB_GRID_FILE_GRID_FILE_H
#define NB_GRID_FILE_GRID_FILE_H

#include "image/image_codec.h"
#include "keys/file_units.h"

/* As nebel_grid_desc takes them. */
typedef struct nb_voxels {
    size_t size[3];
    nebel_voxel_type type;
    void *data; /* free with nb_release */
} nb_voxels;

/* Which kind of file has a name. */
typedef enum nb_voxel_file { NB_VOXELS_NUMBERS, NB_VOXELS_NANOVDB, NB_VOXELS_SLICES, NB_VOXELS_OPENVDB } nb_voxel_file;

nb_voxel_file nb_voxel_file_kind(const char *path, size_t size);

/* Checks the limits and asks for memory, cleared. Errors: LIMIT, MEMORY. */
nebel_result nb_voxels_allocate(const nb_codec *codec, nb_voxels *voxels);

/* nebel_load_grid, whose voxels lie along the axes of a file in `space`, and what they take. */
nebel_result nb_voxels_load(const nebel_grid_file *file, const nebel_scene_desc *desc, const nb_file_units *space,
                            nebel_grid **grid, uint64_t *bytes);

/* The grid named `name`, NULL: the first, of a NanoVDB file. On an error voxels->data is NULL. Errors: FORMAT, LIMIT,
 * UNSUPPORTED, MEMORY. */
nebel_result nb_nanovdb_read(const nb_codec *codec, const nb_bytes *bytes, const char *name, nb_voxels *voxels);

/* The same of the OpenVDB file codec->name; the first by name that is of float or double. A damaged file may do to
 * OpenVDB what it likes: only its exceptions are caught. Errors: FILE, too; UNSUPPORTED also in builds without OpenVDB. */
nebel_result nb_vdb_read(const nb_codec *codec, const char *name, nb_voxels *voxels);

#endif
