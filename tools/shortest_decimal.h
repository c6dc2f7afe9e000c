/* The shortest decimal text that reads back as the same number. */
#ifndef NB_TOOLS_SHORTEST_DECIMAL_H
#define NB_TOOLS_SHORTEST_DECIMAL_H

#include <stddef.h>

/* Room for any number, the ending zero byte included. */
#define NB_SHORTEST_SIZE 32

/* Prepares the table of powers of ten. Before the first text, in one thread. */
void nb_shortest_prepare(void);

/* Writes the number as %.17g (double) or %.9g (float) would, with as few digits as tell it from its neighbors, of those
 * the nearest to it; no zero byte. Returns the length. Infinities are "inf", what is no number "nan". Any thread. */
size_t nb_shortest_write_double(double number, char *text);
size_t nb_shortest_write_float(float number, char *text);

#endif
