/* Bytes in memory that grow. */
#ifndef NB_BASE_BYTES_H
#define NB_BASE_BYTES_H

#include "base.h"

typedef struct nb_bytes {
    unsigned char *data;
    size_t size, capacity;
} nb_bytes;

/* Appends, growing; false when memory is out. */
int nb_bytes_write(const nebel_allocator *allocator, nb_bytes *bytes, size_t offset, const void *data, size_t size);

#endif
