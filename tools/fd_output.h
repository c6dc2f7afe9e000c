/* Bytes to file descriptors, and the state of the three standard ones. */
#ifndef NB_TOOLS_FD_OUTPUT_H
#define NB_TOOLS_FD_OUTPUT_H

#include <stddef.h>

/* Standard streams that the caller left closed are opened to nothing, so that no file of ours takes their number:
 * reading from such a stream finds the end, writing to it is an error. A closed pipe, or a file at its
 * largest size (ulimit -f), becomes an error of the write. */
void nb_output_prepare(void);

/* Writes all of it. Returns 0, or the errno of what went wrong. */
int nb_output_write(int descriptor, const void *data, size_t size);

/* The exit status after a write to standard output gave `error` (0: none). A closed pipe is no news to anybody: it
 * fails without a message. */
int nb_output_status(int error);

/* Ends a command that printed with stdio: `status`, or NB_FAILED with a message where not everything could be written.
 */
int nb_output_finish(int status);

#endif
