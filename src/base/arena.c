#include "arena.h"

#include <stdalign.h>
#include <string.h>

struct nb_arena_block {
    nb_arena_block *next;
    size_t used, size;
    alignas(max_align_t) unsigned char bytes[];
};

enum { FIRST_BLOCK = 4096, LARGEST_BLOCK = 1 << 20 };

/* Blocks double up to a mebibyte, so that little stays little and much needs few calls. */
static nb_arena_block *add_block(nb_arena *arena, size_t wanted)
{
    size_t size = arena->blocks != NULL ? arena->blocks->size * 2 : FIRST_BLOCK;
    if (size > LARGEST_BLOCK) size = LARGEST_BLOCK;
    if (size < wanted) size = wanted;
    if (size > SIZE_MAX - sizeof(nb_arena_block)) return NULL;
    nb_arena_block *block = nb_allocate(&arena->allocator, 1, sizeof(nb_arena_block) + size);
    if (block == NULL) return NULL;
    *block = (nb_arena_block){.next = arena->blocks, .size = size};
    arena->blocks = block;
    return block;
}

void *nb_arena_allocate(nb_arena *arena, size_t count, size_t size)
{
    const size_t alignment = alignof(max_align_t);
    if (size != 0 && count > (SIZE_MAX - alignment) / size) return NULL;
    const size_t bytes = (count * size + alignment - 1) / alignment * alignment;
    nb_arena_block *block = arena->blocks;
    if (block == NULL || bytes > block->size - block->used) block = add_block(arena, bytes);
    if (block == NULL) return NULL;
    void *memory = block->bytes + block->used;
    block->used += bytes;
    return memset(memory, 0, bytes);
}

char *nb_arena_copy_text(nb_arena *arena, const char *text, size_t size)
{
    char *copy = size < SIZE_MAX ? nb_arena_allocate(arena, size + 1, 1) : NULL;
    if (copy != NULL && size > 0) memcpy(copy, text, size);
    return copy;
}

void nb_arena_release(nb_arena *arena)
{
    while (arena->blocks != NULL) {
        nb_arena_block *next = arena->blocks->next;
        nb_release(&arena->allocator, arena->blocks);
        arena->blocks = next;
    }
}
