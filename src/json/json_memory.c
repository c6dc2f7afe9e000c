#include "json_memory.h"

#include <stdalign.h>
#include <string.h>

struct nb_json_block {
    nb_json_block *before, *after;
    size_t size;
    alignas(max_align_t) unsigned char bytes[];
};

static nb_json_block *block_of(void *bytes)
{
    return (nb_json_block *)(void *)((unsigned char *)bytes - offsetof(nb_json_block, bytes));
}

static void *allocate(void *context, size_t size)
{
    nb_json_memory *memory = context;
    nb_json_block *block =
        size < SIZE_MAX / 2 ? nb_allocate(&memory->allocator, 1, sizeof(nb_json_block) + size) : NULL;
    if (block == NULL) longjmp(memory->out_of_memory, 1);
    *block = (nb_json_block){.after = memory->blocks, .size = size};
    if (block->after != NULL) block->after->before = block;
    memory->blocks = block;
    return block->bytes;
}

static void release(void *context, void *bytes)
{
    nb_json_memory *memory = context;
    if (bytes == NULL) return;
    nb_json_block *block = block_of(bytes);
    if (block->before != NULL)
        block->before->after = block->after;
    else
        memory->blocks = block->after;
    if (block->after != NULL) block->after->before = block->before;
    nb_release(&memory->allocator, block);
}

static void *reallocate(void *context, void *bytes, size_t size)
{
    void *moved = allocate(context, size);
    if (bytes == NULL) return moved;
    const size_t before = block_of(bytes)->size;
    memcpy(moved, bytes, before < size ? before : size);
    release(context, bytes);
    return moved;
}

void nb_json_memory_start(nb_json_memory *memory, const nebel_allocator *allocator)
{
    memory->allocator = *allocator;
    memory->blocks = NULL;
    memory->functions = (yajl_alloc_funcs){.malloc = allocate, .realloc = reallocate, .free = release, .ctx = memory};
}

void nb_json_memory_release(nb_json_memory *memory)
{
    while (memory->blocks != NULL) release(memory, memory->blocks->bytes);
}
