/* What the tests of scenes share: a log that remembers, an allocator that counts and fails, a marker for places in a
 * text. */
#ifndef NB_TESTS_SCENE_HELP_H
#define NB_TESTS_SCENE_HELP_H

#include "unit.h"

#include <nebel/scene.h>

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

typedef struct journal {
    int count;
    nebel_result result;
    char last[1024];
} journal;

static inline void remember(nebel_log_level level, nebel_result result, const char *message, void *user)
{
    journal *kept = user;
    assert_true((level == NEBEL_LOG_ERROR) == (result != NEBEL_OK));
    kept->count++;
    kept->result = result;
    snprintf(kept->last, sizeof kept->last, "%s", message);
}

/* Every allocation is counted; number `fail_at` (from 0) and all later ones fail. */
typedef struct meter {
    long live, made, fail_at;
} meter;

static inline void *metered_allocate(size_t size, void *user)
{
    meter *m = user;
    void *memory = m->made++ < m->fail_at ? malloc(size) : NULL;
    m->live += memory != NULL;
    return memory;
}

static inline void metered_release(void *memory, void *user)
{
    meter *m = user;
    m->live--;
    free(memory);
}

static inline nebel_host metered_host(meter *m, journal *kept)
{
    *m = (meter){.fail_at = 1L << 40};
    *kept = (journal){0};
    return (nebel_host){.allocator = {metered_allocate, metered_release, m}, .log = {remember, kept}};
}

static inline nebel_scene_desc metered_desc(meter *m, journal *kept)
{
    return (nebel_scene_desc){.host = metered_host(m, kept)};
}

/* Takes the mark ` out of a text; its line and column go to `place` as "LINE:COLUMN", "" where there is none. */
static inline char *unmark(const char *marked, char place[32])
{
    char *text = malloc(strlen(marked) + 1), *at = text;
    int line = 1, column = 1;
    place[0] = '\0';
    for (; *marked != '\0'; marked++) {
        if (*marked == '`') {
            snprintf(place, 32, "%d:%d", line, column);
            continue;
        }
        if (*marked == '\n')
            line++, column = 1;
        else if (((unsigned char)*marked & 0xC0) != 0x80)
            column++;
        *at++ = *marked;
    }
    *at = '\0';
    return text;
}

/* The scene may have something to say as long as it lives. */
static inline nebel_scene *parse_good(const char *text)
{
    static journal kept;
    nebel_scene *scene = NULL;
    const nebel_scene_desc desc = {.host.log = {remember, &kept}};
    if (nebel_parse_scene(text, strlen(text), "test.json", &desc, &scene) != NEBEL_OK) fail_msg("%s", kept.last);
    return scene;
}

/* Every allocation fails once, with all that come after it. */
static inline void parse_without_memory(const char *text)
{
    nebel_result result = NEBEL_ERROR_MEMORY;
    for (long k = 0; result != NEBEL_OK; k++) {
        meter m;
        journal kept;
        nebel_scene *scene = NULL;
        const nebel_scene_desc desc = metered_desc(&m, &kept);
        m.fail_at = k;
        result = nebel_parse_scene(text, strlen(text), "s.json", &desc, &scene);
        if (result != NEBEL_OK) assert_int_equal(result, NEBEL_ERROR_MEMORY);
        nebel_destroy_scene(scene);
        assert_int_equal(m.live, 0);
        assert_true(k < 2000);
    }
}

/* A text with a mark ` where the message must point. */
typedef struct rule {
    nebel_result result;
    const char *text;
    const char *message; /* what must stand after the place */
} rule;

static inline void check_rules(const rule *rules, size_t count)
{
    for (size_t i = 0; i < count; i++) {
        char place[32], expected[1024];
        char *text = unmark(rules[i].text, place);
        meter m;
        journal kept;
        const nebel_scene_desc desc = metered_desc(&m, &kept);
        nebel_scene *scene = (nebel_scene *)&m;
        const nebel_result result = nebel_parse_scene(text, strlen(text), "dir/a.json", &desc, &scene);
        snprintf(expected, sizeof expected, "dir/a.json:%s: %s", place, rules[i].message);
        if (result != rules[i].result || strncmp(kept.last, expected, strlen(expected)) != 0)
            fail_msg("%s\n gave %d: %s\n wanted %d: %s", text, result, kept.last, rules[i].result, expected);
        assert_int_equal(kept.count, 1);
        assert_int_equal(kept.result, result);
        assert_null(scene);
        assert_int_equal(m.live, 0);
        free(text);
    }
}

#define CHECK(rules) check_rules(rules, sizeof rules / sizeof *rules)
#define FORMAT NEBEL_ERROR_FORMAT
#define UNSUPPORTED NEBEL_ERROR_UNSUPPORTED
#define LIMIT NEBEL_ERROR_LIMIT

/* The scene's fog at a frame in its lights, which are the one owner of the snapshot. */
static inline nebel_lighting *scene_light(const nebel_scene *scene, double frame)
{
    nebel_snapshot *fog = NULL;
    nebel_lighting *lighting = NULL;
    assert_int_equal(nebel_commit_scene_fog_at(scene, frame, &fog), NEBEL_OK);
    assert_int_equal(nebel_create_scene_lighting(scene, fog, frame, NULL, &lighting), NEBEL_OK);
    nebel_release_snapshot(fog);
    return lighting;
}

/* That fog along rays. */
static inline void scene_trace(const nebel_scene *scene, double frame, nebel_trace_desc desc, size_t n,
                               const nebel_ray *rays, nebel_transfer *transfers)
{
    nebel_lighting *lighting = scene_light(scene, frame);
    desc.lighting = lighting;
    assert_int_equal(
        nebel_trace(nebel_get_lighting_snapshot(lighting), &desc, n, rays, sizeof *rays, transfers, sizeof *transfers),
        NEBEL_OK);
    nebel_release_lighting(lighting);
}

#endif
