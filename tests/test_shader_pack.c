/* Packed fog without a graphics interface: limits, numbers, determinism, texts. */
#include "random_fog.h"

#include "shader/texel_layout.h"
#include <nebel/shader.h>

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "fog_help.h"

static random_fog fog;

static nebel_texel_f32 *pack(const nebel_lighting *lighting, const double eye[3], size_t *count)
{
    assert_int_equal(nebel_pack_fog(lighting, eye, NULL, 0, count), NEBEL_OK);
    nebel_texel_f32 *words = malloc(*count * sizeof *words);
    assert_non_null(words);
    memset(words, 0xff, *count * sizeof *words); /* NaN wherever nothing is written */
    assert_int_equal(nebel_pack_fog(lighting, eye, words, *count, count), NEBEL_OK);
    return words;
}

static void assert_numbers(const nebel_texel_f32 *words, size_t count)
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
            nebel_lighting *lighting = fog_light(NULL, fog.volumes, fog.count);
            const double eye[3] = {fog.shift[0] + 3, fog.shift[1], fog.shift[2] - 7};
            size_t count;
            nebel_texel_f32 *words = pack(lighting, eye, &count);
            assert_numbers(words, count);
            assert_int_equal((size_t)words[0].v[0], nebel_get_volume_count(nebel_get_lighting_snapshot(lighting)));
            free(words);
            nebel_release_lighting(lighting);
        }
}

/* The largest and smallest that a description may hold. */
static void test_extremes(void **state)
{
    (void)state;
    const nebel_volume_desc volumes[] = {
        {.shape = {.type = NEBEL_SHAPE_BOX, .min = {-1e15, -1e15, -1e15}, .max = {1e15, 1e15, 1e15}},
         .density = {.type = NEBEL_DENSITY_SOFT_EDGE, .edge_width = 1e-15},
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
    nebel_lighting *lighting = fog_light(NULL, volumes, sizeof volumes / sizeof *volumes);
    size_t count;
    nebel_texel_f32 *words = pack(lighting, eye, &count);
    assert_numbers(words, count);
    free(words);
    nebel_release_lighting(lighting);
}

/* A block of 16 KiB holds a hundred boxes; what stands where is what layout.h says. */
static void test_layout(void **state)
{
    (void)state;
    const nebel_volume_desc box = {.shape = {.type = NEBEL_SHAPE_BOX, .min = {1, 2, 3}, .max = {4, 5, 6}},
                                   .extinction = {.1, .2, .3},
                                   .source = {.5, .5, .5},
                                   .emission = {0, 0, 1}};
    nebel_lighting *lighting = fog_light(NULL, &box, 1);
    const double eye[3] = {1e7, -1e7, 2};
    size_t count;
    nebel_texel_f32 *words = pack(lighting, eye, &count);
    assert_int_equal(count, NB_HEADER_TEXELS + NB_MEDIUM_TEXELS);
    assert_true((NEBEL_BLOCK_TEXELS - NB_HEADER_TEXELS) / NB_MEDIUM_TEXELS >= 100);
    const float *m = words[NB_HEADER_TEXELS].v, *leaf = words[NB_HEADER_TEXELS + NB_MEDIUM_LEAF].v;
    const float expected[] = {.1f, .2f, .3f, NB_KIND_CONSTANT, .05f, .1f, 1.15f, 1, .5f, .5f, .5f, 1};
    for (int i = 0; i < 12; i++) assert_float_equal(m[i], expected[i], 1e-6f);
    const float place[] = {NB_TYPE_BOX, 0, 0, 1, 1 - 1e7f, 2 + 1e7f, 1, 0, 4 - 1e7f, 5 + 1e7f, 4, 1e18f};
    for (int i = 0; i < 12; i++) assert_float_equal(leaf[i], place[i], 0);
    free(words);
    nebel_release_lighting(lighting);
}

/* A block whose x, y and z become y, z and x: faces are packed in the world's axes. */
static void test_faces_of_a_turned_body(void **state)
{
    (void)state;
    nebel_plane planes[6];
    for (int i = 0; i < 6; i++) {
        planes[i] = (nebel_plane){.distance = i + 1};
        planes[i].normal[i / 2] = i % 2 ? -1 : 1;
    }
    const nebel_volume_desc body = {.shape = {.type = NEBEL_SHAPE_CONVEX,
                                              .planes = planes,
                                              .plane_count = 6,
                                              .transform = {.rotation = {.5, .5, .5, .5}, .scale = {1, 1, 1}}},
                                    .extinction = {1, 1, 1}};
    nebel_lighting *lighting = fog_light(NULL, &body, 1);
    size_t count;
    nebel_texel_f32 *words = pack(lighting, (const double[3]){0, 0, 0}, &count);
    const float *leaf = words[NB_HEADER_TEXELS + NB_MEDIUM_LEAF].v;
    unsigned found = 0;
    assert_int_equal((int)leaf[1], 6);
    for (size_t i = 0; i < 6; i++) {
        const float *v = words[(size_t)leaf[2] + i].v;
        for (int k = 0; k < 6; k++) {
            const int axis = (k / 2 + 1) % 3;
            const float along = (float)(k % 2 ? -v[axis] : v[axis]),
                        aside = fabsf(v[0]) + fabsf(v[1]) + fabsf(v[2]) - along;
            if (along > 0 && aside < 1e-6f * along && fabsf(v[3] - along * (float)(k + 1)) < 1e-6f) found |= 1u << k;
        }
    }
    assert_int_equal(found, 63);
    free(words);
    nebel_release_lighting(lighting);
}

static void test_order_and_repetition(void **state)
{
    (void)state;
    random_fog_make(&fog, RANDOM_FOG_MANY, 1);
    static nebel_volume_desc reversed[RANDOM_FOG_VOLUMES];
    for (size_t i = 0; i < fog.count; i++) reversed[i] = fog.volumes[fog.count - 1 - i];
    nebel_lighting *one = fog_light(NULL, fog.volumes, fog.count);
    nebel_lighting *two = fog_light(NULL, reversed, fog.count);
    const double eye[3] = {1, 2, 3};
    size_t n, m;
    nebel_texel_f32 *a = pack(one, eye, &n), *b = pack(two, eye, &m);
    assert_int_equal(n, m);
    assert_memory_equal(a, b, n * sizeof *a);
    free(a);
    free(b);
    nebel_release_lighting(one);
    nebel_release_lighting(two);
}

static void test_bad_input(void **state)
{
    (void)state;
    fog_memory memory = {0};
    fog_messages messages = {0};
    const nebel_fog_desc desc = {
        .host = {.allocator = fog_memory_allocator(&memory), .log = fog_messages_log(&messages)}};
    random_fog_make(&fog, RANDOM_FOG_PARTS, 1);
    nebel_lighting *lighting = fog_commit_lit(&desc, fog.volumes, fog.count, NULL);
    const double eye[3] = {0, 0, 0}, nowhere[3] = {0, (double)NAN, 0}, far[3] = {2e15, 0, 0};
    static nebel_texel_f32 words[4096];
    size_t count = 0;
    const size_t calls = memory.calls;
    assert_int_equal(nebel_pack_fog(NULL, eye, words, 4096, &count), NEBEL_ERROR_ARGUMENT);
    assert_int_equal(nebel_pack_fog(lighting, NULL, words, 4096, &count), NEBEL_ERROR_ARGUMENT);
    assert_int_equal(nebel_pack_fog(lighting, eye, words, 4096, NULL), NEBEL_ERROR_ARGUMENT);
    assert_int_equal(nebel_pack_fog(lighting, eye, NULL, 1, &count), NEBEL_ERROR_ARGUMENT);
    assert_int_equal(nebel_pack_fog(lighting, nowhere, words, 4096, &count), NEBEL_ERROR_ARGUMENT);
    assert_int_equal(nebel_pack_fog(lighting, far, words, 4096, &count), NEBEL_ERROR_ARGUMENT);
    assert_int_equal(nebel_pack_fog(lighting, eye, NULL, 0, &count), NEBEL_OK);
    words[count - 1].v[0] = 77;
    assert_int_equal(nebel_pack_fog(lighting, eye, words, count - 1, &count), NEBEL_ERROR_LIMIT);
    assert_non_null(strstr(messages.text, "room for"));
    assert_float_equal(words[count - 1].v[0], 77, 0);
    assert_int_equal(nebel_pack_fog(lighting, eye, words, count, &count), NEBEL_OK);
    assert_int_equal(memory.calls, calls); /* packing takes no memory */
    nebel_release_lighting(lighting);
}

/* ---- voxels ---------------------------------------------------------------------------------- */

static nebel_grid *grid_of(const uint8_t *voxels, size_t x, size_t y, size_t z, nebel_grid_filter filter)
{
    nebel_grid *grid = NULL;
    const nebel_grid_desc desc = {
        .size = {x, y, z}, .type = NEBEL_VOXEL_UINT8, .voxels = voxels, .filter = filter, .scale = 2, .offset = 1};
    assert_int_equal(nebel_create_grid(&desc, &grid), NEBEL_OK);
    return grid;
}

/* A box for each grid, one behind the other. */
static nebel_lighting *boxes_of(nebel_grid *const *grids, size_t count, nebel_log log)
{
    nebel_volume_desc v[8];
    for (size_t i = 0; i < count; i++)
        v[i] = (nebel_volume_desc){.shape = {.type = NEBEL_SHAPE_BOX, .max = {1 + (double)i, 1, 1}},
                                   .density = {.type = NEBEL_DENSITY_GRID, .grid = grids[i]},
                                   .extinction = {1, 1, 1}};
    return fog_commit_lit(&(nebel_fog_desc){.host.log = log}, v, count, NULL);
}

static float float_of(uint32_t bits)
{
    float x;
    memcpy(&x, &bits, sizeof x);
    return x;
}

/* 9 x 1 x 1 voxels in cells: two bricks, of which the second one is even. */
static void test_texels(void **state)
{
    (void)state;
    const uint8_t voxels[9] = {0, 255, 51, 0, 0, 0, 0, 51, 51};
    nebel_grid *grid = grid_of(voxels, 9, 1, 1, NEBEL_GRID_FILTER_LINEAR);
    nebel_lighting *lighting = boxes_of(&grid, 1, (nebel_log){0});
    nebel_texel_u32 texels[3 + 512];
    size_t count = 0;
    assert_int_equal(nebel_pack_voxels(lighting, NULL, 0, &count), NEBEL_OK);
    assert_int_equal(count, 3 + 512);
    assert_int_equal(nebel_pack_voxels(lighting, texels, count, &count), NEBEL_OK);
    assert_memory_equal(texels[0].v, ((uint32_t[]){2, 1, 1, 1}), sizeof texels[0].v);
    assert_float_equal(float_of(texels[1].v[0]), 1, 0);
    assert_float_equal(float_of(texels[1].v[1]) * 65535, 2, 1e-6);
    assert_int_equal(texels[1].v[2], 3);
    assert_float_equal(float_of(texels[2].v[0]), 1.4, 1e-6);
    assert_int_equal(texels[2].v[2], 0);
    for (int i = 0; i < 4; i++) { /* level across, and outwards from the outermost middles */
        assert_int_equal(texels[3].v[i], 0);
        assert_int_equal(texels[4].v[i], 65535u << 16);
        assert_int_equal(texels[5].v[i], 65535u | 13107u << 16);
    }
    nebel_release_lighting(lighting);
    nebel_release_grid(grid);
}

static void test_shared_and_same_voxels(void **state)
{
    (void)state;
    const uint8_t voxels[8] = {1, 2, 3, 4, 5, 6, 7, 8}, even[8] = {0};
    nebel_grid *one = grid_of(voxels, 2, 2, 2, NEBEL_GRID_FILTER_NEAREST),
               *twin = grid_of(voxels, 2, 2, 2, NEBEL_GRID_FILTER_NEAREST);
    nebel_grid *other = grid_of(even, 2, 2, 2, NEBEL_GRID_FILTER_NEAREST);
    nebel_lighting *const alone = boxes_of(&one, 1, (nebel_log){0}), *const again = boxes_of(&twin, 1, (nebel_log){0});
    nebel_lighting *const shared = boxes_of((nebel_grid *[]){one, one, one}, 3, (nebel_log){0});
    nebel_lighting *const both = boxes_of((nebel_grid *[]){one, other}, 2, (nebel_log){0});
    nebel_lighting *const none = fog_light(NULL, NULL, 0);
    size_t count = 0;
    assert_int_equal(nebel_pack_voxels(shared, NULL, 0, &count), NEBEL_OK);
    assert_int_equal(count, 2 + 512);
    assert_int_equal(nebel_pack_voxels(both, NULL, 0, &count), NEBEL_OK);
    assert_int_equal(count, 2 + 512 + 2);
    assert_int_equal(nebel_pack_voxels(none, NULL, 0, &count), NEBEL_OK);
    assert_int_equal(count, 0);
    assert_true(nebel_is_same_voxels(alone, shared) && nebel_is_same_voxels(alone, again) &&
                nebel_is_same_voxels(none, none));
    assert_false(nebel_is_same_voxels(alone, both) || nebel_is_same_voxels(both, alone) ||
                 nebel_is_same_voxels(none, alone));
    nebel_release_lighting(alone);
    nebel_release_lighting(again);
    nebel_release_lighting(shared);
    nebel_release_lighting(both);
    nebel_release_lighting(none);
    nebel_release_grid(one);
    nebel_release_grid(twin);
    nebel_release_grid(other);
}

static void test_voxels_that_cannot_be_packed(void **state)
{
    (void)state;
    enum { SIDE = 256, LAYERS = 257 };
    const size_t voxels = (size_t)SIDE * SIDE * LAYERS;
    const double eye[3] = {0, 0, 0};
    fog_messages messages = {0};
    nebel_texel_u32 texel = {{77, 0, 0, 0}};
    size_t count = 0;
    uint8_t *const many = malloc(voxels);
    assert_non_null(many);
    for (size_t i = 0; i < voxels; i++) many[i] = (uint8_t)i;
    nebel_grid *small = grid_of(many, 2, 2, 2, NEBEL_GRID_FILTER_LINEAR),
               *large = grid_of(many, SIDE, SIDE, LAYERS, NEBEL_GRID_FILTER_LINEAR);
    nebel_lighting *const fog_of_small = boxes_of(&small, 1, fog_messages_log(&messages));
    nebel_lighting *const fog_of_large = boxes_of(&large, 1, fog_messages_log(&messages));
    assert_int_equal(nebel_pack_voxels(NULL, NULL, 0, &count), NEBEL_ERROR_ARGUMENT);
    assert_int_equal(nebel_pack_voxels(fog_of_small, NULL, 0, NULL), NEBEL_ERROR_ARGUMENT);
    assert_int_equal(nebel_pack_voxels(fog_of_small, NULL, 1, &count), NEBEL_ERROR_ARGUMENT);
    assert_int_equal(nebel_pack_voxels(fog_of_small, &texel, 1, &count), NEBEL_ERROR_LIMIT);
    assert_non_null(strstr(messages.text, "room for 1"));
    assert_int_equal(texel.v[0], 77);
    assert_int_equal(nebel_pack_voxels(fog_of_large, NULL, 0, &count), NEBEL_ERROR_LIMIT);
    assert_non_null(strstr(messages.text, "too large for shaders"));
    assert_int_equal(nebel_pack_fog(fog_of_large, eye, NULL, 0, &count), NEBEL_ERROR_LIMIT);
    nebel_release_lighting(fog_of_small);
    nebel_release_lighting(fog_of_large);
    nebel_release_grid(small);
    nebel_release_grid(large);
    free(many);
}

static void test_features(void **state)
{
    (void)state;
    const nebel_volume_desc box = {.shape = {.type = NEBEL_SHAPE_BOX, .max = {1, 1, 1}}, .extinction = {1, 1, 1}};
    const nebel_volume_desc others[] = {
        box, {.shape = {.type = NEBEL_SHAPE_WORLD}, .extinction = {1, 1, 1}, .source = {1, 1, 1}}};
    nebel_lighting *one = fog_light(NULL, &box, 1), *two = fog_light(NULL, others, 2);
    assert_int_equal(nebel_pack_features(one), NB_HAS_BOX);
    assert_int_equal(nebel_pack_features(two), NB_HAS_BOX | NB_HAS_SEVERAL | NB_HAS_MIXED);
    assert_int_equal(nebel_pack_features(NULL), NB_HAS_ALL);
    nebel_release_lighting(one);
    nebel_release_lighting(two);
}

/* No #version, nothing that another compiler would take for its own. */
static void test_texts(void **state)
{
    (void)state;
    for (int dialect = 0; dialect < NEBEL_DIALECT_COUNT; dialect++) {
        const char *text = nebel_get_shader_source((nebel_shader_dialect)dialect);
        assert_non_null(text);
        assert_null(strstr(text, "#version"));
        assert_null(strstr(text, "#include"));
        assert_non_null(strstr(text, "#define nebel_trace("));
        assert_int_equal(strstr(text, "nebel_fog_block") != NULL, dialect <= NEBEL_DIALECT_GLSL_300_ES);
        for (const char *c = text; *c != 0; c++) assert_true(*c == '\n' || (*c >= ' ' && *c <= '~'));
    }
    assert_null(nebel_get_shader_source(NEBEL_DIALECT_COUNT));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_words_are_numbers),
        cmocka_unit_test(test_extremes),
        cmocka_unit_test(test_layout),
        cmocka_unit_test(test_faces_of_a_turned_body),
        cmocka_unit_test(test_order_and_repetition),
        cmocka_unit_test(test_bad_input),
        cmocka_unit_test(test_texels),
        cmocka_unit_test(test_shared_and_same_voxels),
        cmocka_unit_test(test_voxels_that_cannot_be_packed),
        cmocka_unit_test(test_features),
        cmocka_unit_test(test_texts),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
