/* Elements of arrays as callers hand them over, so many bytes apart; 0: all are the same one. */
#ifndef NB_BASE_STRIDE_H
#define NB_BASE_STRIDE_H

#include <stddef.h>

/* To read. */
static inline const void *nb_stride_from(const void *first, size_t stride, size_t i)
{
    return (const char *)first + i * stride;
}

/* To write. */
static inline void *nb_stride_to(void *first, size_t stride, size_t i)
{
    return (char *)first + i * stride;
}

#endif
