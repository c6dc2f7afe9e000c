/* What the tests of fog in shaders share: a tracer that asks the text for many rays at once, and the comparison with nebel_trace in
 * double. */
#ifndef SHADER_HELP_H
#define SHADER_HELP_H

#include "gl_harness.h"
#include "random_fog.h"

#include <nebel/shader.h>

#include <epoxy/gl.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

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
static nebel_transfer transfers[RAYS];

/* ---- words to the shader --------------------------------------------------------------------- */

typedef enum word_store { BLOCK, TEXTURE } word_store;

typedef struct tracer {
    nb_gl gl;
    word_store store;
    unsigned program, buffer, texture, voxels;
} tracer;

static const char trace_body[] = "nebel_transfer l = nebel_trace(in0.xyz, in1.xyz, in0.w);\n"
                                 "out0 = vec4(l.transmittance, 0.0); out1 = vec4(l.in_scattering, 0.0);\n";

static inline void open_tracer(tracer *t, nb_gl_language language, word_store store, const char *defines,
                               const char *body)
{
    *t = (tracer){.store = store};
    if (!nb_gl_open(&t->gl, language)) fail_msg("%s", t->gl.fault);
    const nebel_shader_dialect dialect = language == NB_GL_330 ? NEBEL_DIALECT_GLSL_330 : NEBEL_DIALECT_GLSL_300_ES;
    const char *const texts[] = {store == TEXTURE ? "#define NEBEL_FOG_TEXTURE\n" : "", defines,
                                 nebel_get_shader_source(dialect), NULL};
    t->program = nb_gl_compile_texts(&t->gl, texts, body, 2, 2);
    if (!t->program) fail_msg("%s", t->gl.fault);
    glGenBuffers(1, &t->buffer);
    glGenTextures(1, &t->texture);
    glGenTextures(1, &t->voxels);
}

/* Whole rows of texels of 16 bytes. */
static inline void fill_texture(unsigned name, GLint internal, GLenum format, GLenum type, const void *texels,
                                size_t count)
{
    const size_t rows = (count + NEBEL_TEXTURE_WIDTH - 1) / NEBEL_TEXTURE_WIDTH;
    char *padded = calloc(rows * NEBEL_TEXTURE_WIDTH, 16);
    assert_non_null(padded);
    memcpy(padded, texels, count * 16);
    glBindTexture(GL_TEXTURE_2D, name);
    glTexImage2D(GL_TEXTURE_2D, 0, internal, NEBEL_TEXTURE_WIDTH, (GLsizei)rows, 0, format, type, padded);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_NEAREST);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, GL_NEAREST);
    free(padded);
}

static inline void upload_voxels(tracer *t, const nebel_lighting *lighting)
{
    size_t count = 0;
    assert_int_equal(nebel_pack_voxels(lighting, NULL, 0, &count), NEBEL_OK);
    nebel_texel_u32 *texels = calloc(count, sizeof *texels);
    assert_non_null(texels);
    assert_int_equal(nebel_pack_voxels(lighting, texels, count, &count), NEBEL_OK);
    glActiveTexture(GL_TEXTURE1);
    fill_texture(t->voxels, GL_RGBA32UI, GL_RGBA_INTEGER, GL_UNSIGNED_INT, texels, count);
    glActiveTexture(GL_TEXTURE0);
    glUseProgram(t->program);
    glUniform1i(glGetUniformLocation(t->program, "nebel_voxel_texture"), 1);
    free(texels);
}

static inline void upload(tracer *t, const nebel_texel_f32 *words, size_t count)
{
    if (t->store == BLOCK) {
        assert_true(count <= NEBEL_BLOCK_TEXELS);
        glBindBuffer(GL_UNIFORM_BUFFER, t->buffer);
        glBufferData(GL_UNIFORM_BUFFER, NEBEL_BLOCK_TEXELS * sizeof *words, NULL, GL_STATIC_DRAW);
        glBufferSubData(GL_UNIFORM_BUFFER, 0, (GLsizeiptr)(count * sizeof *words), words);
        glBindBufferBase(GL_UNIFORM_BUFFER, 0, t->buffer);
        glUniformBlockBinding(t->program, glGetUniformBlockIndex(t->program, "nebel_fog_block"), 0);
        return;
    }
    fill_texture(t->texture, GL_RGBA32F, GL_RGBA, GL_FLOAT, words, count);
}

static inline void pack_and_upload(tracer *t, const nebel_lighting *lighting, const double eye[3])
{
    size_t count = 0;
    assert_int_equal(nebel_pack_fog(lighting, eye, NULL, 0, &count), NEBEL_OK);
    nebel_texel_f32 *words = malloc(count * sizeof *words);
    assert_non_null(words);
    assert_int_equal(nebel_pack_fog(lighting, eye, words, count, &count), NEBEL_OK);
    upload(t, words, count);
    free(words);
}

/* ---- rays ------------------------------------------------------------------------------------ */

/* What the shader is asked, in the world: the very same numbers. */
static inline nebel_ray ray_of_item(const item *asked, const double eye[3])
{
    nebel_ray ray = {.t_max = (double)asked->t_max};
    for (int k = 0; k < 3; k++) {
        ray.origin[k] = eye[k] + (double)asked->origin[k];
        ray.direction[k] = (double)asked->direction[k];
    }
    return ray;
}

static inline item item_of_ray(const nebel_ray *ray, const double eye[3])
{
    const double *d = ray->direction;
    const double length = sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
    item asked = {.t_max = (float)fmin(ray->t_max, 1e18)};
    for (int k = 0; k < 3; k++) {
        asked.origin[k] = (float)(ray->origin[k] - eye[k]);
        asked.direction[k] = (float)(d[k] / length);
    }
    return asked;
}

static inline void set_ray(int i, const nebel_ray *ray, const double eye[3])
{
    items[i] = item_of_ray(ray, eye);
    rays[i] = ray_of_item(&items[i], eye);
}

/* From the eye to the neighbourhood of `middle`, and on. */
static inline void camera_rays(const double eye[3], const double middle[3], uint64_t seed)
{
    uint64_t state = seed;
    for (int i = 0; i < RAYS; i++) {
        nebel_ray ray = {.t_max = dice_below(&state, 4) == 0 ? HUGE_VAL : dice(&state, 5, 80)};
        for (int k = 0; k < 3; k++) {
            ray.origin[k] = eye[k];
            ray.direction[k] = middle[k] + dice(&state, -14, 14) - eye[k];
        }
        set_ray(i, &ray, eye);
    }
}

/* ---- comparison ------------------------------------------------------------------------------ */

static inline double worst_of(const answer *a, const nebel_transfer *transfer, double scale)
{
    double worst = 0;
    for (int c = 0; c < 3; c++) {
        const double t = fabs((double)a->transmittance[c] - transfer->transmittance[c]);
        const double s = fabs((double)a->in_scattering[c] - transfer->in_scattering[c]) / scale;
        if (!(t <= 2) || !(s <= 1e9)) return HUGE_VAL;
        worst = fmax(worst, fmax(t, s));
    }
    return worst;
}

static inline int is_foggy(const nebel_transfer *transfer)
{
    for (int c = 0; c < 3; c++)
        if (transfer->transmittance[c] < 1 || transfer->in_scattering[c] > 0) return 1;
    return 0;
}

static inline int ascending(const void *a, const void *b)
{
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

/* What a ray's own rounding may change: the largest difference among rays turned, moved, or both by a few
 * roundings in any direction. */
static inline double conditioning(const nebel_lighting *lighting, const nebel_trace_desc *desc, const nebel_ray *ray,
                                  const double eye[3], double scale)
{
    enum { NEAR = 80 };
    nebel_ray near[NEAR];
    nebel_transfer transfer[NEAR + 1];
    double far = 1;
    for (int k = 0; k < 3; k++) far = fmax(far, fabs(ray->origin[k] - eye[k]));
    for (int i = 0; i < NEAR; i++) {
        near[i] = *ray;
        for (int k = 0; k < 3; k++) {
            if (i < 72) near[i].direction[k] += i >> k & 1 ? 3e-7 : -3e-7;
            if (i >= 8) near[i].origin[k] += (i >> (k + 3) & 1 ? 3e-7 : -3e-7) * far;
        }
    }
    fog_trace(lighting, *desc, 1, ray, &transfer[NEAR]);
    fog_trace(lighting, *desc, NEAR, near, transfer);
    double most = 0;
    for (int i = 0; i < NEAR; i++)
        for (int c = 0; c < 3; c++) {
            most = fmax(most, fabs(transfer[i].transmittance[c] - transfer[NEAR].transmittance[c]));
            most = fmax(most, fabs(transfer[i].in_scattering[c] - transfer[NEAR].in_scattering[c]) / scale);
        }
    return most;
}

static const nebel_trace_desc precise = {.tolerance = 1e-5};
static double differences[RAYS];

/* 99.9 % of the foggy rays within 1/255, and 3/255 everywhere but where the ray's own rounding matters as much. */
static inline void compare(const nebel_lighting *lighting, const nebel_trace_desc *desc, const double eye[3],
                           double scale, int hostile, const char *name)
{
    fog_trace(lighting, *desc, RAYS, rays, transfers);
    size_t foggy = 0;
    double worst = 0, worst_silhouette = 0;
    for (int i = 0; i < RAYS; i++) {
        if (transfers[i].error > 1e-3 * scale) continue; /* the reference does not know either */
        const double off = worst_of(&answers[i], &transfers[i], scale);
        const int silhouette = off > .25 / 255 && off < 2 * conditioning(lighting, desc, &rays[i], eye, scale);
        if (is_foggy(&transfers[i]) && !(silhouette && hostile)) differences[foggy++] = off;
        if (silhouette) {
            worst_silhouette = fmax(worst_silhouette, off);
            continue;
        }
        worst = fmax(worst, off);
        if (off > 3. / 255)
            fail_msg("%s, ray %d (%.9g %.9g %.9g, %.9g): off by %g: transmittance %g for %g, light %g for %g", name, i,
                     rays[i].direction[0], rays[i].direction[1], rays[i].direction[2], rays[i].t_max, off,
                     (double)answers[i].transmittance[0], transfers[i].transmittance[0],
                     (double)answers[i].in_scattering[0], transfers[i].in_scattering[0]);
    }
    qsort(differences, foggy, sizeof *differences, ascending);
    const double most = foggy > 0 ? differences[(foggy - 1) * 999 / 1000] : 0;
    const double median = foggy > 0 ? differences[foggy / 2] : 0;
    print_message("%s: %zu foggy rays, median %.1e, 99.9 %% %.1e, worst %.1e, silhouettes %.1e\n", name, foggy, median,
                  most, worst, worst_silhouette);
    assert_true(most <= 1. / 255);
}

/* ---- fog ------------------------------------------------------------------------------------- */

static inline double largest_source(const random_fog *fog)
{
    double largest = 1;
    for (size_t i = 0; i < fog->count; i++)
        for (int c = 0; c < 3; c++) largest = fmax(largest, fmax(fog->volumes[i].source[c], fog->ambient[c]));
    return largest;
}

static random_fog fog;

static inline nebel_lighting *commit_fog(void)
{
    const nebel_fog_desc desc = random_fog_desc(&fog);
    const nebel_lighting_desc lights = random_fog_lights(&fog);
    return fog_commit_lit(&desc, fog.volumes, fog.count, &lights);
}

static inline void evaluate(tracer *t)
{
    if (!nb_gl_evaluate(&t->gl, t->program, RAYS, (const float *)items, (float *)answers)) fail_msg("%s", t->gl.fault);
}

/* `fog`, from an eye that hangs on the seed, every third time within it. */
static inline void trace_fog(tracer *t, uint64_t seed, const nebel_trace_desc *truth, const char *kind)
{
    nebel_lighting *lighting = commit_fog();
    uint64_t state = seed;
    double eye[3];
    char name[64];
    for (int k = 0; k < 3; k++) eye[k] = fog.shift[k] + dice(&state, -20, 20) * (seed % 3 == 0 ? .2 : 1);
    snprintf(name, sizeof name, "%s %d", kind, (int)seed);
    camera_rays(eye, fog.shift, seed);
    pack_and_upload(t, lighting, eye);
    if ((nebel_pack_features(lighting) & NEBEL_FEATURE_GRID) != 0) upload_voxels(t, lighting);
    evaluate(t);
    compare(lighting, truth, eye, largest_source(&fog), 0, name);
    nebel_release_lighting(lighting);
}

static inline void try_fog(tracer *t, const char *kind, uint64_t seed)
{
    trace_fog(t, seed, &precise, kind);
}

#endif
