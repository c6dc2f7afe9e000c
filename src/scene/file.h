/* Whole files in and out. */
#ifndef NB_SCENE_FILE_H
#define NB_SCENE_FILE_H

#include "base/base.h"

#include <stdbool.h>

typedef struct nb_bytes {
    unsigned char *data;
    size_t size, capacity;
} nb_bytes;

/* Reads a regular file to its end, at most `limit` bytes; nothing else is waited for. `what` names it in messages ("scene"); where they
 * begin with a place, `where` says it, otherwise NULL. Free bytes->data with nb_release. Errors: FILE, LIMIT, MEMORY.
 */
nebel_result nb_file_read(const nebel_allocator *allocator, const nebel_log *log, const char *where, const char *what,
                          const char *path, size_t limit, nb_bytes *bytes);

/* The same of a pipe or device, too, which is read until its end. */
nebel_result nb_file_read_stream(const nebel_allocator *allocator, const nebel_log *log, const char *what,
                                 const char *path, size_t limit, nb_bytes *bytes);

/* The same of a file that is open, and stays so. */
nebel_result nb_file_read_open(const nebel_allocator *allocator, const nebel_log *log, const char *where,
                               const char *what, const char *path, int file, size_t limit, nb_bytes *bytes);

/* Whether `path` is a regular file that may be read: other libraries open it by name, and a pipe would hold them up for
 * ever. Errors: FILE. */
nebel_result nb_file_check(const nebel_log *log, const char *where, const char *what, const char *path);

/* Writes bytes to a file. A regular file, or one that does not exist, is replaced as a whole or not at all: a temporary
 * file in the same folder takes its name when everything is on the disk. A symbolic link stays, what it points to is
 * replaced. Devices, pipes and sockets are written directly. Errors: FILE, MEMORY. */
nebel_result nb_file_write(const nebel_allocator *allocator, const nebel_log *log, const char *path,
                           const nb_bytes *bytes);

/* Whether nb_file_write is likely to do it: whether a file can be made in the folder, which is tried, or the device is
 * open to writing. What is at the path does not change. Errors: FILE, MEMORY. */
nebel_result nb_file_try(const nebel_allocator *allocator, const nebel_log *log, const char *path);

/* The same, and whether there is room for so many bytes. */
nebel_result nb_file_try_room(const nebel_allocator *allocator, const nebel_log *log, const char *path, size_t size);

/* Whether nb_file_write writes there directly: a device, a pipe, a socket, or what is open already. */
bool nb_file_is_direct(const char *path);

/* Appends, growing; false when memory is out. */
int nb_bytes_write(const nebel_allocator *allocator, nb_bytes *bytes, size_t offset, const void *data, size_t size);

#endif
