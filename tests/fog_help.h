/* What the tests of the core's public face share: memory that keeps accounts, messages that can be read, fog in one
 * call, numbers. */
#ifndef FOG_HELP_H
#define FOG_HELP_H

#include "unit.h"
#include "dice.h"

#include <nebel/light.h>

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* ---- memory that counts, fails when told to, and poisons what it takes back ------------------ */

enum { FOG_MEMORY_HEADER = 64, FOG_MEMORY_FRESH = 0xa5, FOG_MEMORY_STALE = 0xdd };

typedef struct fog_memory {
    size_t calls, live;
    size_t bytes, most_bytes; /* held now, and at the worst */
    size_t fail_first;        /* 1 for the next call, 2 for the one after it, ...; 0: none fails */
    size_t fail_count;        /* how many in a row */
} fog_memory;

static inline void *fog_memory_allocate(size_t size, void *user)
{
    fog_memory *const memory = user;
    memory->calls++;
    if (memory->fail_first > 1) {
        memory->fail_first--;
    } else if (memory->fail_first == 1) {
        if (--memory->fail_count == 0) memory->fail_first = 0;
        return NULL;
    }
    assert_true(size > 0);
    assert_true(size <= SIZE_MAX - FOG_MEMORY_HEADER);
    char *const block = malloc(FOG_MEMORY_HEADER + size);
    if (block == NULL) return NULL;
    memcpy(block, &size, sizeof size);
    memset(block + FOG_MEMORY_HEADER, FOG_MEMORY_FRESH, size);
    memory->live++;
    memory->bytes += size;
    if (memory->bytes > memory->most_bytes) memory->most_bytes = memory->bytes;
    return block + FOG_MEMORY_HEADER;
}

static inline void fog_memory_release(void *block, void *user)
{
    fog_memory *const memory = user;
    assert_non_null(block);
    char *const start = (char *)block - FOG_MEMORY_HEADER;
    size_t size;
    memcpy(&size, start, sizeof size);
    memory->live--;
    memory->bytes -= size;
    memset(block, FOG_MEMORY_STALE, size);
    free(start);
}

static inline nebel_allocator fog_memory_allocator(fog_memory *memory)
{
    return (nebel_allocator){fog_memory_allocate, fog_memory_release, memory};
}

/* ---- messages -------------------------------------------------------------------------------- */

typedef struct fog_messages {
    size_t count;
    nebel_result result; /* of the last one */
    char text[512];
} fog_messages;

static inline void fog_messages_write(nebel_log_level level, nebel_result result, const char *message, void *user)
{
    fog_messages *const messages = user;
    assert_true((level == NEBEL_LOG_ERROR) == (result != NEBEL_OK));
    assert_non_null(message);
    assert_true(message[0] != 0);
    assert_null(strchr(message, '\n'));
    messages->count++;
    messages->result = result;
    snprintf(messages->text, sizeof messages->text, "%s", message);
}

static inline nebel_log fog_messages_log(fog_messages *messages)
{
    return (nebel_log){fog_messages_write, messages};
}

/* ---- fog in one call ------------------------------------------------------------------------- */

static inline nebel_snapshot *fog_commit(const nebel_fog_desc *desc, const nebel_volume_desc *volumes, size_t n)
{
    nebel_fog *fog = NULL;
    nebel_snapshot *snapshot = NULL;
    assert_int_equal(nebel_create_fog(desc, &fog), NEBEL_OK);
    for (size_t i = 0; i < n; i++) assert_int_equal(nebel_add_volume(fog, &volumes[i], NULL), NEBEL_OK);
    assert_int_equal(nebel_commit_fog(fog, &snapshot), NEBEL_OK);
    nebel_destroy_fog(fog);
    return snapshot;
}

/* The lights of a snapshot; desc NULL: none. */
static inline nebel_lighting *light_fog(nebel_snapshot *snapshot, const nebel_lighting_desc *desc)
{
    nebel_lighting *made = NULL;
    assert_int_equal(nebel_create_lighting(snapshot, desc, &made), NEBEL_OK);
    return made;
}

/* Fog and its lights, which are the only owner of its snapshot. */
static inline nebel_lighting *fog_commit_lit(const nebel_fog_desc *desc, const nebel_volume_desc *volumes, size_t n,
                                             const nebel_lighting_desc *lights)
{
    nebel_snapshot *snapshot = fog_commit(desc, volumes, n);
    nebel_lighting *lighting = light_fog(snapshot, lights);
    nebel_release_snapshot(snapshot);
    return lighting;
}

/* The same of volumes alone. */
static inline nebel_lighting *fog_light(const nebel_lighting_desc *lights, const nebel_volume_desc *volumes, size_t n)
{
    return fog_commit_lit(&(nebel_fog_desc){0}, volumes, n, lights);
}

/* Along rays, in these lights. */
static inline void fog_trace(const nebel_lighting *lighting, nebel_trace_desc desc, size_t n, const nebel_ray *rays,
                             nebel_transfer *transfers)
{
    desc.lighting = lighting;
    assert_int_equal(
        nebel_trace(nebel_get_lighting_snapshot(lighting), &desc, n, rays, sizeof *rays, transfers, sizeof *transfers),
        NEBEL_OK);
}

/* Along one ray, in double. */
static inline nebel_transfer fog_along(const nebel_lighting *lighting, const nebel_ray *ray)
{
    const nebel_trace_desc desc = {.lighting = lighting};
    nebel_transfer transfer;
    assert_int_equal(nebel_trace(nebel_get_lighting_snapshot(lighting), &desc, 1, ray, 0, &transfer, 0), NEBEL_OK);
    return transfer;
}

/* The largest difference of two numbers; infinite where one is a NaN. */
static inline double fog_difference(const nebel_transfer *a, const nebel_transfer *b)
{
    double most = 0;
    for (int c = 0; c < 3; c++) {
        const double off[2] = {fabs(a->transmittance[c] - b->transmittance[c]),
                               fabs(a->in_scattering[c] - b->in_scattering[c])};
        for (int i = 0; i < 2; i++) most = fmax(most, isnan(off[i]) ? HUGE_VAL : off[i]);
    }
    return most;
}

#endif
