/* OpenVDB is C++: this is what its only file says to the others, in terms of C. */
#ifndef NB_GRID_FILE_OPENVDB_READ_H
#define NB_GRID_FILE_OPENVDB_READ_H

#include <stddef.h>

#ifdef __cplusplus
extern "C" {
#endif

typedef struct nb_openvdb nb_openvdb;

typedef enum nb_openvdb_answer {
    NB_OPENVDB_OK,
    NB_OPENVDB_DAMAGED,     /* no such file, no such grid, or it breaks off */
    NB_OPENVDB_UNSUPPORTED, /* no fog volume of float or double */
    NB_OPENVDB_MEMORY
} nb_openvdb_answer;

/* Reads the grid of a name, NULL: the first by name that is of float or double. size: that of the box around all active
 * voxels. A message is about the file. No exception leaves these functions. */
nb_openvdb_answer nb_openvdb_open(const char *path, const char *name, nb_openvdb **grid, unsigned long long size[3],
                                  char *message, size_t message_size);

/* All voxels of that box, x fastest. Threads of its own are not used. */
nb_openvdb_answer nb_openvdb_copy(const nb_openvdb *grid, float *voxels);

/* NULL is fine. */
void nb_openvdb_close(nb_openvdb *grid);

#ifdef __cplusplus
}
#endif

#endif
