#include "bytes.h"

#include <string.h>

int nb_bytes_write(const nebel_allocator *allocator, nb_bytes *bytes, size_t offset, const void *data, size_t size)
{
    void *grown = bytes->data;
    if (size > SIZE_MAX - offset) return 0;
    const size_t end = offset + size;
    if (!nb_grow(allocator, &grown, 1, bytes->size, &bytes->capacity, end)) return 0;
    bytes->data = grown;
    if (offset > bytes->size) memset(bytes->data + bytes->size, 0, offset - bytes->size);
    if (size > 0) memcpy(bytes->data + offset, data, size);
    if (end > bytes->size) bytes->size = end;
    return 1;
}
