/* File names with the number of a frame in them. */
#ifndef NB_TOOLS_FRAME_PATTERN_H
#define NB_TOOLS_FRAME_PATTERN_H

#include <stdint.h>

/* NULL when `pattern` has exactly one %d or %0Nd (N from 1 to 20) and no other % but %%; else what is wrong with it. */
const char *nb_pattern_find_fault(const char *pattern);

/* The file name of a frame; free it. NULL: memory is out. The pattern has no fault. */
char *nb_pattern_expand(const char *pattern, uint32_t frame);

#endif
