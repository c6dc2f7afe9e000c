/* Work that a caller may split over threads. */
#ifndef NB_BASE_PARALLEL_H
#define NB_BASE_PARALLEL_H

#include <nebel/nebel.h>

static inline void nb_parallel_for(const nebel_parallel *parts, size_t count, void (*part)(void *data, size_t i),
                                   void *data)
{
    if (parts->run != NULL) {
        parts->run(count, part, data, parts->user);
        return;
    }
    for (size_t i = 0; i < count; i++) part(data, i);
}

#endif
