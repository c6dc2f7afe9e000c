/* Whole files in and out. */
#ifndef NB_FILE_FILE_H
#define NB_FILE_FILE_H

#include "base/bytes.h"

#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>

/* Reads a regular file to its end, at most `limit` bytes; nothing else is waited for. `what` names it in messages ("scene"); where they
 * begin with a place, `where` says it, otherwise NULL. Free bytes->data with nb_release. Errors: FILE, LIMIT, MEMORY.
 */
nebel_result nb_file_read(const nebel_allocator *allocator, const nebel_log *log, const char *where, const char *what,
                          const char *path, size_t limit, nb_bytes *bytes);

/* The same, and of what is open already by its name, /dev/stdin or /dev/fd/3, whatever it is, until its end. */
nebel_result nb_file_read_stream(const nebel_allocator *allocator, const nebel_log *log, const char *what,
                                 const char *path, size_t limit, nb_bytes *bytes);

/* The same of a file that is open, and stays so. */
nebel_result nb_file_read_open(const nebel_allocator *allocator, const nebel_log *log, const char *where,
                               const char *what, const char *path, int file, size_t limit, nb_bytes *bytes);

/* Opens a regular file for reading; whatever else is at the path is not opened. Errors: FILE. */
nebel_result nb_file_open(const nebel_log *log, const char *where, const char *what, const char *path, int *file);

/* The same as a stream; NULL after an error. */
FILE *nb_file_open_stream(const nebel_log *log, const char *where, const char *what, const char *path);

/* The open file that a path names, /dev/stdin or /dev/fd/3 or /proc/self/fd/3; -1: none. */
int nb_file_descriptor(const char *path);

/* Whether `path` is a regular file that may be read: other libraries open it by name, and a pipe would hold them up for
 * ever. Errors: FILE. */
nebel_result nb_file_check(const nebel_log *log, const char *where, const char *what, const char *path);

/* Writes bytes to a file. A regular file, or one that does not exist, is replaced as a whole or not at all: a temporary
 * file in the same folder takes its name when everything is on the disk. A symbolic link stays, what it points to is
 * replaced. /dev/null and what is open already are written directly, other devices, pipes and sockets are refused: a
 * pipe may wait for ever, and a device does what nobody expects of a picture. Errors: FILE, MEMORY. */
nebel_result nb_file_write(const nebel_allocator *allocator, const nebel_log *log, const char *path,
                           const nb_bytes *bytes);

/* The same of bytes that come one after the other, in little memory. */
typedef struct nb_sink nb_sink;
nebel_result nb_sink_open(const nebel_allocator *allocator, const nebel_log *log, const char *path, nb_sink **sink);

/* Writes bytes behind those that are there, or over some of them. False when that failed, as do all later ones; nb_sink_finish says
 * why. */
bool nb_sink_write(nb_sink *sink, uint64_t offset, const void *data, size_t size);
bool nb_sink_has_failed(const nb_sink *sink);
uint64_t nb_sink_size(const nb_sink *sink); /* bytes so far */

/* Gives the file its name, once. Errors: as nb_file_write. */
nebel_result nb_sink_finish(nb_sink *sink);

/* Removes what was not finished. NULL is fine. */
void nb_sink_close(nb_sink *sink);

/* Whether nb_file_write is likely to do it: whether a file can be made in the folder, which is tried, or the device is
 * open to writing. What is at the path does not change. Errors: FILE, MEMORY. */
nebel_result nb_file_try(const nebel_allocator *allocator, const nebel_log *log, const char *path);

/* The same, and whether there is room for so many bytes. */
nebel_result nb_file_try_room(const nebel_allocator *allocator, const nebel_log *log, const char *path, size_t size);

/* Whether there is a device, a pipe, a socket or what is open already. */
bool nb_file_is_special(const char *path);

#endif
