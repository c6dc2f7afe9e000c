/* What memory allows: reading and writing the bytes of a job with next to no arithmetic. */
#ifndef NB_BENCH_MEMORY_FLOOR_H
#define NB_BENCH_MEMORY_FLOOR_H

#include <stddef.h>
#include <stdint.h>

/* Reads three arrays of n numbers that lie one after the other in `in`, writes n: 12 bytes in and 4 out for each. */
void nb_stream_three_to_one(const float *in, float *out, size_t n);

/* Reads a and b, writes out: 8 bytes in and 4 out for each. */
void nb_stream_two_to_one(const uint32_t *a, const uint32_t *b, uint32_t *out, size_t n);

#endif
