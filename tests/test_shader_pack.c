/* Packed fog without a graphics interface: limits, numbers, determinism, texts. */
#include "random_fog.h"

#include "shader/layout.h"
#include <nebel/shader.h>

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "fog_help.h"

static random_fog fog;

static nebel_word *pack(const nebel_snapshot *snapshot, const double eye[3], size_t *count)
{
    assert_int_equal(nebel_pack_fog(snapshot, eye, NULL, 0, count), NEBEL_OK);
    nebel_word *words = malloc(*count * sizeof *words);
    assert_non_null(words);
    memset(words, 0xff, *count * sizeof *words); /* NaN wherever nothing is written */
    assert_int_equal(nebel_pack_fog(snapshot, eye, words, *count, count), NEBEL_OK);
    return words;
}

static void assert_numbers(const nebel_word *words, size_t count)
{
    for (size_t i = 0; i < count; i++)
        for (int c = 0; c < 4; c++)
            if (!isfinite(words[i].v[c])) fail_msg("word %zu, component %d is %g", i, c, (double)words[i].v[c]);
}

static void test_words_are_numbers(void **state)
{
    (void)state;
    for (int kind = 0; kind < RANDOM_FOG_KIND_COUNT; kind++)
        for (uint64_t seed = 0; seed < 20; seed++) {
            random_fog_make(&fog, (random_fog_kind)kind, seed);
            nebel_snapshot *snapshot = fog_commit(&(nebel_fog_desc){0}, fog.volumes, fog.count);
            const double eye[3] = {fog.shift[0] + 3, fog.shift[1], fog.shift[2] - 7};
            size_t count;
            nebel_word *words = pack(snapshot, eye, &count);
            assert_numbers(words, count);
            assert_int_equal((size_t)words[0].v[0], nebel_snapshot_volume_count(snapshot));
            free(words);
            nebel_release_snapshot(snapshot);
        }
}

/* The largest and smallest that a description may hold. */
static void test_extremes(void **state)
{
    (void)state;
    const nebel_volume_desc volumes[] = {
        {.shape = {.type = NEBEL_SHAPE_BOX, .min = {-1e15, -1e15, -1e15}, .max = {1e15, 1e15, 1e15}},
         .density = {.type = NEBEL_DENSITY_SOFT_EDGE, .distance = 1e-15},
         .extinction = {1e9, 1e9, 1e9},
         .source = {1e9, 1e9, 1e9},
         .emission = {1e9, 1e9, 1e9}},
        {.shape = {.type = NEBEL_SHAPE_CYLINDER, .from = {1e15, 0, 0}, .to = {1e15, 1, 0}, .radius = 1e-15},
         .extinction = {1, 1, 1}},
        {.shape = {.type = NEBEL_SHAPE_SPHERE, .center = {-1e15, 0, 0}, .radius = 1e-15},
         .density = {.type = NEBEL_DENSITY_RADIAL, .power = 3},
         .extinction = {1, 1, 1}},
        {.shape = {.type = NEBEL_SHAPE_WORLD},
         .density = {.type = NEBEL_DENSITY_HEIGHT, .base = -1e15, .scale_height = 1e-15},
         .extinction = {1, 1, 1}},
        {.shape = {.type = NEBEL_SHAPE_WORLD},
         .density = {.type = NEBEL_DENSITY_GAUSSIAN, .center = {1e15, 1e15, 1e15}, .sigma = 1e-15},
         .extinction = {1, 1, 1}},
    };
    const double eye[3] = {1e15, -1e15, 1e15};
    nebel_snapshot *snapshot = fog_commit(&(nebel_fog_desc){0}, volumes, sizeof volumes / sizeof *volumes);
    size_t count;
    nebel_word *words = pack(snapshot, eye, &count);
    assert_numbers(words, count);
    free(words);
    nebel_release_snapshot(snapshot);
}

/* A block of 16 KiB holds a hundred boxes; what stands where is what layout.h says. */
static void test_layout(void **state)
{
    (void)state;
    const nebel_volume_desc box = {.shape = {.type = NEBEL_SHAPE_BOX, .min = {1, 2, 3}, .max = {4, 5, 6}},
                                   .extinction = {.1, .2, .3},
                                   .source = {.5, .5, .5},
                                   .emission = {0, 0, 1}};
    nebel_snapshot *snapshot = fog_commit(&(nebel_fog_desc){0}, &box, 1);
    const double eye[3] = {1e7, -1e7, 2};
    size_t count;
    nebel_word *words = pack(snapshot, eye, &count);
    assert_int_equal(count, NB_HEADER_WORDS + NB_MEDIUM_WORDS);
    assert_true((NEBEL_BLOCK_WORDS - NB_HEADER_WORDS) / NB_MEDIUM_WORDS >= 100);
    const float *m = words[NB_HEADER_WORDS].v, *leaf = words[NB_HEADER_WORDS + NB_MEDIUM_LEAF].v;
    const float expected[] = {.1f, .2f, .3f, NB_KIND_CONSTANT, .05f, .1f, 1.15f, 1, .5f, .5f, .5f, 1};
    for (int i = 0; i < 12; i++) assert_float_equal(m[i], expected[i], 1e-6f);
    const float place[] = {NB_TYPE_BOX, 0, 0, 1, 1 - 1e7f, 2 + 1e7f, 1, 0, 4 - 1e7f, 5 + 1e7f, 4, 1e18f};
    for (int i = 0; i < 12; i++) assert_float_equal(leaf[i], place[i], 0);
    free(words);
    nebel_release_snapshot(snapshot);
}

static void test_order_and_repetition(void **state)
{
    (void)state;
    random_fog_make(&fog, RANDOM_FOG_MANY, 1);
    static nebel_volume_desc reversed[RANDOM_FOG_VOLUMES];
    for (size_t i = 0; i < fog.count; i++) reversed[i] = fog.volumes[fog.count - 1 - i];
    nebel_snapshot *one = fog_commit(&(nebel_fog_desc){0}, fog.volumes, fog.count);
    nebel_snapshot *two = fog_commit(&(nebel_fog_desc){0}, reversed, fog.count);
    const double eye[3] = {1, 2, 3};
    size_t n, m;
    nebel_word *a = pack(one, eye, &n), *b = pack(two, eye, &m);
    assert_int_equal(n, m);
    assert_memory_equal(a, b, n * sizeof *a);
    free(a);
    free(b);
    nebel_release_snapshot(one);
    nebel_release_snapshot(two);
}

static void test_bad_input(void **state)
{
    (void)state;
    fog_memory memory = {0};
    fog_messages messages = {0};
    const nebel_fog_desc desc = {.allocator = fog_memory_allocator(&memory), .log = fog_messages_log(&messages)};
    random_fog_make(&fog, RANDOM_FOG_PARTS, 1);
    nebel_snapshot *snapshot = fog_commit(&desc, fog.volumes, fog.count);
    const double eye[3] = {0, 0, 0}, nowhere[3] = {0, (double)NAN, 0}, far[3] = {2e15, 0, 0};
    static nebel_word words[4096];
    size_t count = 0;
    const size_t calls = memory.calls;
    assert_int_equal(nebel_pack_fog(NULL, eye, words, 4096, &count), NEBEL_ERROR_ARGUMENT);
    assert_int_equal(nebel_pack_fog(snapshot, NULL, words, 4096, &count), NEBEL_ERROR_ARGUMENT);
    assert_int_equal(nebel_pack_fog(snapshot, eye, words, 4096, NULL), NEBEL_ERROR_ARGUMENT);
    assert_int_equal(nebel_pack_fog(snapshot, eye, NULL, 1, &count), NEBEL_ERROR_ARGUMENT);
    assert_int_equal(nebel_pack_fog(snapshot, nowhere, words, 4096, &count), NEBEL_ERROR_ARGUMENT);
    assert_int_equal(nebel_pack_fog(snapshot, far, words, 4096, &count), NEBEL_ERROR_ARGUMENT);
    assert_int_equal(nebel_pack_fog(snapshot, eye, NULL, 0, &count), NEBEL_OK);
    words[count - 1].v[0] = 77;
    assert_int_equal(nebel_pack_fog(snapshot, eye, words, count - 1, &count), NEBEL_ERROR_LIMIT);
    assert_non_null(strstr(messages.text, "room for"));
    assert_float_equal(words[count - 1].v[0], 77, 0);
    assert_int_equal(nebel_pack_fog(snapshot, eye, words, count, &count), NEBEL_OK);
    assert_int_equal(memory.calls, calls); /* packing takes no memory */
    nebel_release_snapshot(snapshot);
}

static void test_features(void **state)
{
    (void)state;
    const nebel_volume_desc box = {.shape = {.type = NEBEL_SHAPE_BOX, .max = {1, 1, 1}}, .extinction = {1, 1, 1}};
    const nebel_volume_desc others[] = {
        box, {.shape = {.type = NEBEL_SHAPE_WORLD}, .extinction = {1, 1, 1}, .source = {1, 1, 1}}};
    nebel_snapshot *one = fog_commit(&(nebel_fog_desc){0}, &box, 1), *two = fog_commit(&(nebel_fog_desc){0}, others, 2);
    assert_int_equal(nebel_pack_features(one), NB_HAS_BOX);
    assert_int_equal(nebel_pack_features(two), NB_HAS_BOX | NB_HAS_SEVERAL | NB_HAS_MIXED);
    assert_int_equal(nebel_pack_features(NULL), NB_HAS_ALL);
    nebel_release_snapshot(one);
    nebel_release_snapshot(two);
}

/* No #version, nothing that another compiler would take for its own. */
static void test_texts(void **state)
{
    (void)state;
    for (int dialect = 0; dialect < NEBEL_DIALECT_COUNT; dialect++) {
        const char *text = nebel_shader_text((nebel_dialect)dialect);
        assert_non_null(text);
        assert_null(strstr(text, "#version"));
        assert_null(strstr(text, "#include"));
        assert_non_null(strstr(text, "nebel_light nebel_trace("));
        assert_int_equal(strstr(text, "nebel_fog_block") != NULL, dialect <= NEBEL_DIALECT_GLSL_300_ES);
        for (const char *c = text; *c != 0; c++) assert_true(*c == '\n' || (*c >= ' ' && *c <= '~'));
    }
    assert_null(nebel_shader_text(NEBEL_DIALECT_COUNT));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_words_are_numbers),
        cmocka_unit_test(test_extremes),
        cmocka_unit_test(test_layout),
        cmocka_unit_test(test_order_and_repetition),
        cmocka_unit_test(test_bad_input),
        cmocka_unit_test(test_features),
        cmocka_unit_test(test_texts),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
