/* What fuzzers share: a log and an allocator that are counted. */
#ifndef NB_FUZZ_WITNESS_H
#define NB_FUZZ_WITNESS_H

#include <nebel/nebel.h>

#include <stdlib.h>

/* What asks for more bytes takes longer than a fuzzer should spend on one input. */
#define WITNESS_MAX_BYTES ((size_t)1 << 26)

typedef struct witness {
    size_t messages, allocations;
    size_t max_bytes; /* of one allocation; 0: WITNESS_MAX_BYTES */
} witness;

static inline void demand(int holds)
{
    if (!holds) abort();
}

static inline void witness_message(nebel_log_level level, nebel_result result, const char *message, void *user)
{
    witness *seen = user;
    demand(level == NEBEL_LOG_ERROR && result != NEBEL_OK && message[0] != '\0');
    seen->messages++;
}

static inline void *witness_allocate(size_t size, void *user)
{
    witness *seen = user;
    void *memory = size < (seen->max_bytes > 0 ? seen->max_bytes : WITNESS_MAX_BYTES) ? malloc(size) : NULL;
    seen->allocations += memory != NULL;
    return memory;
}

static inline void witness_release(void *memory, void *user)
{
    witness *seen = user;
    if (memory != NULL) seen->allocations--;
    free(memory);
}

#endif
