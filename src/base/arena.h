/* Memory that is given back all at once. */
#ifndef NB_BASE_ARENA_H
#define NB_BASE_ARENA_H

#include "base.h"

typedef struct nb_arena_block nb_arena_block;

typedef struct nb_arena {
    nebel_allocator allocator;
    nb_arena_block *blocks; /* the one being filled first */
} nb_arena;

/* count * size bytes, aligned for any object, cleared; NULL when memory is out. */
void *nb_arena_allocate(nb_arena *arena, size_t count, size_t size);

/* `size` bytes of text and a zero byte; NULL when memory is out. */
char *nb_arena_copy_text(nb_arena *arena, const char *text, size_t size);

void nb_arena_release(nb_arena *arena);

#endif
