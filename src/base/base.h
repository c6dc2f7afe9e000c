/* Memory, messages and processor features: what every room may use. Knows no fog. */
#ifndef NB_BASE_H
#define NB_BASE_H

#include <nebel/nebel.h>

#include <stdarg.h>

#if defined(__MINGW32__)
/* "printf" would mean Microsoft's, which knows no %zu. */
#define NB_PRINTF(text, first) __attribute__((format(gnu_printf, text, first)))
#elif defined(__GNUC__)
#define NB_PRINTF(text, first) __attribute__((format(printf, text, first)))
#else
#define NB_PRINTF(text, first)
#endif

/* The caller's allocator, or malloc and free where both functions are NULL. */
nebel_allocator nb_resolve_allocator(const nebel_allocator *allocator);

/* 1 when both functions or neither are given. */
int nb_allocator_is_valid(const nebel_allocator *allocator);

/* count * size bytes, not cleared; NULL when the product overflows or memory is out. A size of 0 gives one byte. */
void *nb_allocate(const nebel_allocator *allocator, size_t count, size_t size);

/* The same, cleared. */
void *nb_allocate_zero(const nebel_allocator *allocator, size_t count, size_t size);

/* NULL is fine. */
void nb_release(const nebel_allocator *allocator, void *memory);

/* Makes room for `wanted` elements in an array that holds `used` of `*capacity`; doubles. 0 on failure, nothing
 * changed. */
int nb_grow(const nebel_allocator *allocator, void **array, size_t size, size_t used, size_t *capacity, size_t wanted);

/* A constant as it is written, for messages: NB_TEXT(NEBEL_MAX_LENGTH) is "1e15". */
#define NB_TEXT_OF(words) #words
#define NB_TEXT(constant) NB_TEXT_OF(constant)

/* Hands a message to the caller's log and returns `result`, so that an error path is one line. */
nebel_result nb_fail(const nebel_log *log, nebel_result result, const char *format, ...) NB_PRINTF(3, 4);

/* Any message. */
void nb_log_message(const nebel_log *log, nebel_log_level level, nebel_result result, const char *format, ...)
    NB_PRINTF(4, 5);

#endif
