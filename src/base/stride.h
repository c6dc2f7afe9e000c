/* Elements of arrays as callers hand them over, so many bytes apart. On the public face 0 means packed everywhere. */
#ifndef NB_BASE_STRIDE_H
#define NB_BASE_STRIDE_H

#include <stddef.h>

/* The stride that a caller means. */
static inline size_t nb_stride_of(size_t stride, size_t element)
{
    return stride != 0 ? stride : element;
}

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
