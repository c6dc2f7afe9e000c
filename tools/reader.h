/* Where the program that reads models is. */
#ifndef NB_READER_H
#define NB_READER_H

/* The path of nebel-read-model beside this program, or NULL where it is not there: the library looks where it was
 * installed then. Lives as long as the program; from one thread. */
const char *nb_reader_path(void);

#endif
