/* yajl's memory: from the caller's allocator, given back all at once. */
#ifndef NB_JSON_JSON_MEMORY_H
#define NB_JSON_JSON_MEMORY_H

#include "base/base.h"

#include <setjmp.h>
#include <yajl/yajl_common.h>

typedef struct nb_json_block nb_json_block;

typedef struct nb_json_memory {
    nebel_allocator allocator;
    nb_json_block *blocks;
    jmp_buf out_of_memory; /* yajl does not expect NULL: where memory is out we jump here, over yajl's frames */
    yajl_alloc_funcs functions;
} nb_json_memory;

/* Sets up memory->functions. memory must not move while yajl uses them. */
void nb_json_memory_start(nb_json_memory *memory, const nebel_allocator *allocator);

/* Frees whatever yajl still holds. */
void nb_json_memory_release(nb_json_memory *memory);

#endif
