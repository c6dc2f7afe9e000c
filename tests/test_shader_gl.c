/* Fog in shaders against nebel_trace in double: GLSL 3.30 and GLSL ES 3.00, words from the block and from the texture.
 */
#include "gl_harness.h"
#include "random_fog.h"

#include <nebel/shader.h>

#include <epoxy/gl.h>
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <cmocka.h>

#include "fog_help.h"

enum { RAYS = 2048 };

typedef struct item {
    float origin[3], t_max, direction[3], unused;
} item;

typedef struct answer {
    float transmittance[4], in_scattering[4];
} answer;

static item items[RAYS];
static answer answers[RAYS];
static nebel_ray rays[RAYS];
static nebel_light lights[RAYS];

/* ---- words to the shader
 * ------------------------------------------------------------------------------------------------- */

typedef enum word_store { BLOCK, TEXTURE } word_store;

typedef struct tracer {
    nb_gl gl;
    word_store store;
    unsigned program, buffer, texture;
} tracer;

static const char trace_body[] = "nebel_light l = nebel_trace(in0.xyz, in1.xyz, in0.w);\n"
                                 "out0 = vec4(l.transmittance, 0.0); out1 = vec4(l.in_scattering, 0.0);\n";

static void open_tracer(tracer *t, nb_gl_language language, word_store store, const char *defines, const char *body)
{
    *t = (tracer){.store = store};
    if (!nb_gl_open(&t->gl, language)) fail_msg("%s", t->gl.fault);
    const nebel_dialect dialect = language == NB_GL_330 ? NEBEL_DIALECT_GLSL_330 : NEBEL_DIALECT_GLSL_300_ES;
    const char *const texts[] = {store == TEXTURE ? "#define NEBEL_TEXTURE\n" : "", defines, nebel_shader_text(dialect),
                                 NULL};
    t->program = nb_gl_compile_texts(&t->gl, texts, body, 2, 2);
    if (!t->program) fail_msg("%s", t->gl.fault);
    glGenBuffers(1, &t->buffer);
    glGenTextures(1, &t->texture);
}

static void upload(tracer *t, const nebel_word *words, size_t count)
{
    if (t->store == BLOCK) {
        assert_true(count <= NEBEL_BLOCK_WORDS);
        glBindBuffer(GL_UNIFORM_BUFFER, t->buffer);
        glBufferData(GL_UNIFORM_BUFFER, NEBEL_BLOCK_WORDS * sizeof *words, NULL, GL_STATIC_DRAW);
        glBufferSubData(GL_UNIFORM_BUFFER, 0, (GLsizeiptr)(count * sizeof *words), words);
        glBindBufferBase(GL_UNIFORM_BUFFER, 0, t->buffer);
        glUniformBlockBinding(t->program, glGetUniformBlockIndex(t->program, "nebel_fog_block"), 0);
        return;
    }
    const size_t rows = (count + NEBEL_TEXTURE_WIDTH - 1) / NEBEL_TEXTURE_WIDTH;
    nebel_word *padded = calloc(rows * NEBEL_TEXTURE_WIDTH, sizeof *padded);
    assert_non_null(padded);
    memcpy(padded, words, count * sizeof *words);
    glBindTexture(GL_TEXTURE_2D, t->texture);
    glTexImage2D(GL_TEXTURE_2D, 0, GL_RGBA32F, NEBEL_TEXTURE_WIDTH, (GLsizei)rows, 0, GL_RGBA, GL_FLOAT, padded);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_NEAREST);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, GL_NEAREST);
    free(padded);
}

static void pack_and_upload(tracer *t, const nebel_snapshot *snapshot, const double eye[3])
{
    size_t count = 0;
    assert_int_equal(nebel_pack_fog(snapshot, eye, NULL, 0, &count), NEBEL_OK);
    nebel_word *words = malloc(count * sizeof *words);
    assert_non_null(words);
    assert_int_equal(nebel_pack_fog(snapshot, eye, words, count, &count), NEBEL_OK);
    upload(t, words, count);
    free(words);
}

/* ---- rays of a camera
 * ----------------------------------------------------------------------------------------------------- */

static void camera_rays(const double eye[3], const double middle[3], uint64_t seed)
{
    uint64_t state = seed;
    for (int i = 0; i < RAYS; i++) {
        double d[3], square = 0;
        for (int k = 0; k < 3; k++) {
            d[k] = middle[k] + dice(&state, -14, 14) - eye[k];
            square += d[k] * d[k];
        }
        items[i] = (item){.t_max = dice_below(&state, 4) == 0 ? 1e18f : (float)dice(&state, 5, 80)};
        for (int k = 0; k < 3; k++) items[i].direction[k] = (float)(d[k] / sqrt(square));
        for (int k = 0; k < 3; k++) {
            rays[i].origin[k] = eye[k] + (double)items[i].origin[k];
            rays[i].direction[k] = (double)items[i].direction[k];
        }
        rays[i].t_max = (double)items[i].t_max;
    }
}

/* ---- comparison
 * ------------------------------------------------------------------------------------------------------------ */

static double worst_of(const answer *a, const nebel_light *light, double scale)
{
    double worst = 0;
    for (int c = 0; c < 3; c++) {
        const double t = fabs((double)a->transmittance[c] - light->transmittance[c]);
        const double s = fabs((double)a->in_scattering[c] - light->in_scattering[c]) / scale;
        if (!(t <= 2) || !(s <= 1e9)) return HUGE_VAL;
        worst = fmax(worst, fmax(t, s));
    }
    return worst;
}

static int is_foggy(const nebel_light *light)
{
    for (int c = 0; c < 3; c++)
        if (light->transmittance[c] < 1 || light->in_scattering[c] > 0) return 1;
    return 0;
}

static int ascending(const void *a, const void *b)
{
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

/* What a ray's own rounding may change: the largest difference among rays turned by a few roundings. */
static double conditioning(const nebel_snapshot *snapshot, const nebel_trace_desc *desc, const nebel_ray *ray,
                           double scale)
{
    nebel_ray near[6];
    nebel_light light[7];
    for (int i = 0; i < 6; i++) {
        near[i] = *ray;
        near[i].direction[i / 2] += (i % 2 == 0 ? 1 : -1) * 3e-7;
    }
    assert_int_equal(nebel_trace(snapshot, desc, 1, ray, sizeof *ray, &light[6], sizeof *light), NEBEL_OK);
    assert_int_equal(nebel_trace(snapshot, desc, 6, near, sizeof *near, light, sizeof *light), NEBEL_OK);
    double most = 0;
    for (int i = 0; i < 6; i++)
        for (int c = 0; c < 3; c++) {
            most = fmax(most, fabs(light[i].transmittance[c] - light[6].transmittance[c]));
            most = fmax(most, fabs(light[i].in_scattering[c] - light[6].in_scattering[c]) / scale);
        }
    return most;
}

static double differences[RAYS];

/* 99.9 % of the foggy rays within 1/255, and 3/255 everywhere but where the ray's own rounding matters as much. */
static void compare(const nebel_snapshot *snapshot, const nebel_trace_desc *desc, double scale, const char *name)
{
    assert_int_equal(nebel_trace(snapshot, desc, RAYS, rays, sizeof *rays, lights, sizeof *lights), NEBEL_OK);
    size_t foggy = 0;
    double worst = 0, worst_silhouette = 0;
    for (int i = 0; i < RAYS; i++) {
        const double off = worst_of(&answers[i], &lights[i], scale);
        if (is_foggy(&lights[i])) differences[foggy++] = off;
        if (off > .25 / 255 && off < 2 * conditioning(snapshot, desc, &rays[i], scale)) {
            worst_silhouette = fmax(worst_silhouette, off);
            continue;
        }
        worst = fmax(worst, off);
        if (off > 3. / 255)
            fail_msg("%s, ray %d (%.9g %.9g %.9g, %.9g): off by %g: transmittance %g for %g, light %g for %g", name, i,
                     rays[i].direction[0], rays[i].direction[1], rays[i].direction[2], rays[i].t_max, off,
                     (double)answers[i].transmittance[0], lights[i].transmittance[0],
                     (double)answers[i].in_scattering[0], lights[i].in_scattering[0]);
    }
    qsort(differences, foggy, sizeof *differences, ascending);
    const double most = foggy > 0 ? differences[(foggy - 1) * 999 / 1000] : 0;
    const double median = foggy > 0 ? differences[foggy / 2] : 0;
    print_message("%s: %zu foggy rays, median %.1e, 99.9 %% %.1e, worst %.1e, silhouettes %.1e\n", name, foggy, median,
                  most, worst, worst_silhouette);
    assert_true(most <= 1. / 255);
}

/* ---- random scenes
 * ----------------------------------------------------------------------------------------------------------- */

static double largest_source(const random_fog *fog)
{
    double largest = 1;
    for (size_t i = 0; i < fog->count; i++)
        for (int c = 0; c < 3; c++) largest = fmax(largest, fmax(fog->volumes[i].source[c], fog->ambient[c]));
    return largest;
}

static random_fog fog;

/* `fog`, from an eye that hangs on the seed. */
static void trace_fog(tracer *t, uint64_t seed, const nebel_trace_desc *truth, const char *kind)
{
    nebel_fog_desc desc = {0};
    memcpy(desc.ambient, fog.ambient, sizeof desc.ambient);
    desc.max_opacity = fog.max_opacity;
    nebel_snapshot *snapshot = fog_commit(&desc, fog.volumes, fog.count);
    uint64_t state = seed;
    double eye[3];
    for (int k = 0; k < 3; k++) eye[k] = fog.shift[k] + dice(&state, -20, 20) * (seed % 3 == 0 ? .2 : 1);
    camera_rays(eye, fog.shift, seed);
    pack_and_upload(t, snapshot, eye);
    if (!nb_gl_evaluate(&t->gl, t->program, RAYS, (const float *)items, (float *)answers)) fail_msg("%s", t->gl.fault);
    char name[64];
    snprintf(name, sizeof name, "%s %d", kind, (int)seed);
    compare(snapshot, truth, largest_source(&fog), name);
    nebel_release_snapshot(snapshot);
}

static void try_fog(tracer *t, const char *kind, uint64_t seed)
{
    trace_fog(t, seed, &(nebel_trace_desc){.tolerance = 1e-5}, kind);
}

static void try_random_fog(tracer *t, random_fog_kind kind, uint64_t seed)
{
    static const char *const kinds[] = {"single", "overlap", "profiles", "exclude", "many",
                                        "parts",  "far",     "opaque",   "level"};
    random_fog_make(&fog, kind, seed);
    try_fog(t, kinds[kind], seed);
}

/* Priorities and fog that replaces, among so many that some places hold more than the walk's slots. */
static void rank_volumes(uint64_t seed)
{
    uint64_t state = seed;
    for (size_t i = 0; i < fog.count; i++) {
        fog.volumes[i].priority = dice_below(&state, 4);
        fog.volumes[i].operation = dice_below(&state, 5) == 0 ? NEBEL_OPERATION_REPLACE : NEBEL_OPERATION_ADD;
        if (dice_below(&state, 20) == 0) fog.volumes[i].operation = NEBEL_OPERATION_EXCLUDE;
    }
}

/* The transmittance of rays that do not begin at the eye, by the functions that say so. */
static void test_rays_to_a_light_know_no_distances(void **unused)
{
    (void)unused;
    tracer t;
    open_tracer(&t, NB_GL_300ES, TEXTURE, "",
                "out0 = vec4(nebel_transmit_light(in0.xyz, in1.xyz, in0.w), 0.0); out1 = vec4(0.0);\n");
    const nebel_trace_desc desc = {.tolerance = 1e-5, .ignore_distances = 1, .transmittance_only = 1};
    for (uint64_t seed = 1; seed < 12; seed += 2) {
        random_fog_make(&fog, RANDOM_FOG_EXCLUDE, seed);
        trace_fog(&t, seed, &desc, "to a light");
    }
    nb_gl_close(&t.gl);
}

static void test_priorities_among_many(void **unused)
{
    (void)unused;
    tracer t;
    open_tracer(&t, NB_GL_330, TEXTURE, "", trace_body);
    for (uint64_t seed = 0; seed < 8; seed++) {
        random_fog_make(&fog, seed % 2 == 0 ? RANDOM_FOG_MANY : RANDOM_FOG_PARTS, seed);
        for (size_t i = 0; i < fog.count && seed % 4 == 0; i++) fog.volumes[i].shape.transform.position[0] *= .2;
        rank_volumes(seed);
        try_fog(&t, "ranked", seed);
    }
    nb_gl_close(&t.gl);
}

static void try_language(nb_gl_language language, word_store store, int seeds)
{
    tracer t;
    open_tracer(&t, language, store, "", trace_body);
    for (int kind = 0; kind < RANDOM_FOG_KIND_COUNT; kind++)
        for (int seed = 0; seed < seeds; seed++) try_random_fog(&t, (random_fog_kind)kind, (uint64_t)seed);
    nb_gl_close(&t.gl);
}

static void test_330_texture(void **state)
{
    (void)state;
    try_language(NB_GL_330, TEXTURE, 5);
}

static void test_330_block(void **state)
{
    (void)state;
    try_language(NB_GL_330, BLOCK, 1);
}

static void test_300_es_texture(void **state)
{
    (void)state;
    try_language(NB_GL_300ES, TEXTURE, 1);
}

static void test_300_es_block(void **state)
{
    (void)state;
    try_language(NB_GL_300ES, BLOCK, 5);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_330_texture),           cmocka_unit_test(test_330_block),
        cmocka_unit_test(test_300_es_texture),        cmocka_unit_test(test_300_es_block),
        cmocka_unit_test(test_priorities_among_many), cmocka_unit_test(test_rays_to_a_light_know_no_distances),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
