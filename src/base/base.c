#include "base.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static void *heap_allocate(size_t size, void *user)
{
    (void)user;
    return malloc(size);
}

static void heap_release(void *memory, void *user)
{
    (void)user;
    free(memory);
}

int nb_allocator_is_valid(const nebel_allocator *allocator)
{
    return (allocator->allocate == NULL) == (allocator->release == NULL);
}

nebel_allocator nb_resolve_allocator(const nebel_allocator *allocator)
{
    if (allocator->allocate != NULL) return *allocator;
    return (nebel_allocator){heap_allocate, heap_release, NULL};
}

#if defined(__MINGW32__) && defined(__i386__)

/* malloc aligns to 8 bytes there, and so may callers; numbers of 128 bits need 16. The byte before aligned memory says
 * how far it was moved. */
enum { ALIGNMENT = 16 };

static void *align(void *memory)
{
    if (memory == NULL) return NULL;
    const size_t move = ALIGNMENT - (uintptr_t)memory % ALIGNMENT;
    unsigned char *const aligned = (unsigned char *)memory + move;
    aligned[-1] = (unsigned char)move;
    return aligned;
}

static void *find_start(void *memory)
{
    return (unsigned char *)memory - ((unsigned char *)memory)[-1];
}

#else

enum { ALIGNMENT = 0 };

static void *align(void *memory)
{
    return memory;
}

static void *find_start(void *memory)
{
    return memory;
}

#endif

void *nb_allocate(const nebel_allocator *allocator, size_t count, size_t size)
{
    if (size != 0 && count > (SIZE_MAX - ALIGNMENT) / size) return NULL;
    const size_t bytes = count * size;
    return align(allocator->allocate((bytes > 0 ? bytes : 1) + ALIGNMENT, allocator->user));
}

void *nb_allocate_zero(const nebel_allocator *allocator, size_t count, size_t size)
{
    void *memory = nb_allocate(allocator, count, size);
    if (memory != NULL) memset(memory, 0, count * size);
    return memory;
}

void nb_release(const nebel_allocator *allocator, void *memory)
{
    if (memory != NULL) allocator->release(find_start(memory), allocator->user);
}

int nb_grow(const nebel_allocator *allocator, void **array, size_t size, size_t used, size_t *capacity, size_t wanted)
{
    if (wanted <= *capacity) return 1;
    size_t larger = *capacity < 8 ? 8 : *capacity;
    while (larger < wanted) {
        if (larger > SIZE_MAX / 2) return 0;
        larger *= 2;
    }
    void *moved = nb_allocate(allocator, larger, size);
    if (moved == NULL) return 0;
    if (used > 0) memcpy(moved, *array, used * size);
    nb_release(allocator, *array);
    *array = moved;
    *capacity = larger;
    return 1;
}

static void write_message(const nebel_log *log, nebel_log_level level, nebel_result result, const char *format,
                          va_list arguments)
{
    if (log == NULL || log->write == NULL) return;
    char message[1024];
    vsnprintf(message, sizeof message, format, arguments);
    log->write(level, result, message, log->user);
}

nebel_result nb_fail(const nebel_log *log, nebel_result result, const char *format, ...)
{
    va_list arguments;
    va_start(arguments, format);
    write_message(log, NEBEL_LOG_ERROR, result, format, arguments);
    va_end(arguments);
    return result;
}

void nb_log_message(const nebel_log *log, nebel_log_level level, nebel_result result, const char *format, ...)
{
    va_list arguments;
    va_start(arguments, format);
    write_message(log, level, result, format, arguments);
    va_end(arguments);
}
