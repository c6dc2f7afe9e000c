/* An allocator whose user, an int, says how many more calls succeed. */
#ifndef SCARCE_MEMORY_H
#define SCARCE_MEMORY_H

#include <stdlib.h>

static inline void *scarce_allocate(size_t size, void *user)
{
    int *left = user;
    return (*left)-- > 0 ? malloc(size) : NULL;
}

static inline void scarce_release(void *memory, void *user)
{
    (void)user;
    free(memory);
}

#endif
