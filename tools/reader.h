/* How scenes are read: where the program that reads models is, and within which limit. */
#ifndef NB_READER_H
#define NB_READER_H

#include <stdint.h>

/* The path of nebel-read-model beside this program, or NULL where it is not there: the library looks where it was
 * installed then. Lives as long as the program; from one thread. */
const char *nb_reader_path(void);

/* How much memory scenes of this program may take, in bytes; 0, as it is at first: the library's default. */
void nb_reader_limit(uint64_t bytes);
uint64_t nb_reader_memory(void);

#endif
