/* Fog in shaders against nebel_trace in double: GLSL 3.30 and GLSL ES 3.00, words from the block and from the texture.
 */
#include "gl_harness.h"
#include "random_fog.h"

#include <nebel/shader.h>

#include <epoxy/gl.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "shader_help.h"

/* All that NEBEL_FEATURES may name but what lights fog and voxels, which take drivers most of a minute to compile: the random
 * fog here has none of them. test_shader_grid_gl tries the whole text. */
#define UNLIT "#define NEBEL_FEATURES_LITERAL\n#define NEBEL_FEATURES 17301503\n"

/* And but bodies of several leaves, which take half of the rest. */
#define UNGROUPED "#define NEBEL_FEATURES_LITERAL\n#define NEBEL_FEATURES 17301375\n"

/* ---- random scenes --------------------------------------------------------------------------- */

static nebel_lighting *commit_random_fog(random_fog_kind kind, uint64_t seed)
{
    random_fog_make(&fog, kind, seed);
    return commit_fog();
}

static const char *const kinds[] = {"single", "overlap", "profiles", "exclude", "many",
                                    "parts",  "far",     "opaque",   "level"};

static void try_camera(tracer *t, random_fog_kind kind, uint64_t seed)
{
    random_fog_make(&fog, kind, seed);
    try_fog(t, kinds[kind], seed);
}

/* One body with a soft edge at a time, in haze of another colour, so that every kink matters to the light. */
static void test_soft_edges_in_haze(void **unused)
{
    (void)unused;
    tracer t;
    open_tracer(&t, NB_GL_300ES, BLOCK, UNGROUPED, trace_body);
    for (uint64_t seed = 0; seed < 60; seed++) {
        random_fog_make(&fog, RANDOM_FOG_OVERLAP, seed);
        fog.count = 2;
        fog.max_opacity = 0;
        fog.volumes[1].density =
            (nebel_density){.type = NEBEL_DENSITY_SOFT_EDGE, .edge_width = .3 + (double)(seed % 7)};
        char name[32];
        snprintf(name, sizeof name, "soft shape %d", (int)fog.volumes[1].shape.type);
        if (fog.volumes[1].shape.type != NEBEL_SHAPE_WORLD) try_fog(&t, name, seed);
    }
    nb_gl_close(&t.gl);
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

static void test_priorities_among_many(void **unused)
{
    (void)unused;
    for (int slots = 8; slots <= 32; slots *= 4) {
        char defines[128];
        snprintf(defines, sizeof defines, UNLIT "#define NEBEL_MEDIUM_SLOTS %d\n", slots);
        tracer t;
        open_tracer(&t, NB_GL_330, TEXTURE, defines, trace_body);
        for (uint64_t seed = 0; seed < 8; seed++) {
            random_fog_make(&fog, seed % 2 == 0 ? RANDOM_FOG_MANY : RANDOM_FOG_PARTS, seed);
            for (size_t i = 0; i < fog.count && seed % 4 == 0; i++) fog.volumes[i].shape.transform.position[0] *= .2;
            rank_volumes(seed);
            try_fog(&t, "ranked", seed);
        }
        nb_gl_close(&t.gl);
    }
}

/* The transmittance of rays that do not begin at the eye, by the functions that say so. */
static void test_rays_to_a_light_know_no_distances(void **unused)
{
    (void)unused;
    tracer t;
    open_tracer(&t, NB_GL_300ES, TEXTURE, UNGROUPED,
                "out0 = vec4(nebel_transmit_shadow(in0.xyz, in1.xyz, in0.w), 0.0); out1 = vec4(0.0);\n");
    const nebel_trace_desc desc = {.tolerance = 1e-5, .ignore_distances = 1, .transmittance_only = 1};
    for (uint64_t seed = 1; seed < 12; seed += 2) {
        random_fog_make(&fog, RANDOM_FOG_EXCLUDE, seed);
        trace_fog(&t, seed, &desc, "to a light");
    }
    nb_gl_close(&t.gl);
}

/* Rays that graze, lie in faces, run along axes and through corners, from everywhere, for an eye that is none of
 * theirs. */
static void try_hostile(tracer *t, random_fog_kind kind, uint64_t seed)
{
    nebel_lighting *lighting = commit_random_fog(kind, seed);
    char name[64];
    snprintf(name, sizeof name, "hostile %s %d", kinds[kind], (int)seed);
    for (int i = 0; i < RAYS; i++) {
        const nebel_ray ray = random_fog_ray(&fog, (uint64_t)i);
        set_ray(i, &ray, fog.shift);
    }
    pack_and_upload(t, lighting, fog.shift);
    evaluate(t);
    compare(lighting, &precise, fog.shift, largest_source(&fog), 1, name);
    nebel_release_lighting(lighting);
}

static void try_language(nb_gl_language language, word_store store, const char *defines, int seeds)
{
    tracer t;
    open_tracer(&t, language, store, defines, trace_body);
    for (int kind = 0; kind < RANDOM_FOG_KIND_COUNT; kind++)
        for (int seed = 0; seed < seeds; seed++) {
            try_camera(&t, (random_fog_kind)kind, (uint64_t)seed);
            try_hostile(&t, (random_fog_kind)kind, (uint64_t)seed);
        }
    nb_gl_close(&t.gl);
}

static void test_330_texture(void **state)
{
    (void)state;
    try_language(NB_GL_330, TEXTURE, UNLIT, 5);
}

static void test_330_block(void **state)
{
    (void)state;
    try_language(NB_GL_330, BLOCK, UNLIT, 1);
}

static void test_300_es_texture(void **state)
{
    (void)state;
    try_language(NB_GL_300ES, TEXTURE, UNLIT, 1);
}

static void test_300_es_block(void **state)
{
    (void)state;
    try_language(NB_GL_300ES, BLOCK, UNLIT, 1);
}

/* ---- sunlight -------------------------------------------------------------------------------- */

/* What the sun makes of `fog`, from an eye in its midst or beside it. */
static void trace_sunlit_fog(random_fog_kind kind, uint64_t seed)
{
    tracer t;
    char features[96];
    random_fog_make(&fog, kind, seed);
    uint64_t state = seed + 100;
    random_fog_light(&fog, &state);
    const nebel_fog_desc desc = random_fog_desc(&fog);
    nebel_lighting_desc lights = random_fog_lights(&fog);
    lights.sun = (nebel_sun){{dice(&state, -1, 1), dice(&state, .2, 1), .3}, {3, 2.5, 2}};
    nebel_lighting *lighting = fog_commit_lit(&desc, fog.volumes, fog.count, &lights);
    double eye[3];
    char name[64];
    for (int k = 0; k < 3; k++) eye[k] = fog.shift[k] + dice(&state, -20, 20) * (seed % 3 == 0 ? .2 : 1);
    snprintf(name, sizeof name, "sunlit %s %d", kinds[kind], (int)seed);
    camera_rays(eye, fog.shift, seed);
    snprintf(features, sizeof features, "#define NEBEL_FEATURES_LITERAL\n#define NEBEL_FEATURES %u\n",
             (unsigned)nebel_pack_features(lighting));
    open_tracer(&t, seed % 2 == 0 ? NB_GL_330 : NB_GL_300ES, TEXTURE, features, trace_body);
    pack_and_upload(&t, lighting, eye);
    evaluate(&t);
    compare(lighting, &(nebel_trace_desc){.tolerance = 1e-4}, eye, largest_source(&fog), 0, name);
    nb_gl_close(&t.gl);
    nebel_release_lighting(lighting);
}

static int all_kinds; /* an argument asks for them */

/* Never MANY, of which llvmpipe's loops see no end: see docs/shaders.md. */
static void test_sunlit_fog(void **state)
{
    (void)state;
    trace_sunlit_fog(RANDOM_FOG_PROFILES, 1);
    trace_sunlit_fog(RANDOM_FOG_EXCLUDE, 0);
    trace_sunlit_fog(RANDOM_FOG_LEVEL, 1);
    for (int kind = 0; kind < RANDOM_FOG_KIND_COUNT && all_kinds; kind++)
        if (kind != RANDOM_FOG_MANY) trace_sunlit_fog((random_fog_kind)kind, (uint64_t)(kind + 1) % 2);
}

/* ---- very many, very far --------------------------------------------------------------------- */

static nebel_volume_desc ball_of(double x, double y, double z, double radius)
{
    return (nebel_volume_desc){.shape = {.type = NEBEL_SHAPE_SPHERE, .center = {x, y, z}, .radius = radius},
                               .extinction = {.1, .2, .3},
                               .source = {1, 1, 1}};
}

static double color_of(uint64_t *state)
{
    return dice(state, 0, 2);
}

/* More volumes around the eye than the shader has slots: even ones, varying ones, with a hole and a body of parts. */
static void make_crowd(nebel_volume_desc *volumes, size_t count, int varying)
{
    static const nebel_shape parts[] = {{.type = NEBEL_SHAPE_SPHERE, .center = {3, 0, 0}, .radius = 2.5},
                                        {.type = NEBEL_SHAPE_SPHERE, .center = {-3, 0, 0}, .radius = 2.5}};
    uint64_t state = 11;
    for (size_t i = 0; i < count; i++) {
        nebel_volume_desc *v = &volumes[i];
        *v = ball_of(dice(&state, -1, 1), dice(&state, -1, 1), dice(&state, -1, 1), dice(&state, 3, 8));
        for (int c = 0; c < 3; c++) v->extinction[c] = dice(&state, .001, .01), v->source[c] = color_of(&state);
        if (!varying) continue;
        v->density = (nebel_density){.type = NEBEL_DENSITY_RADIAL, .power = 1 + (int)(i % 3)};
        if (i % 5 == 0) v->density = (nebel_density){.type = NEBEL_DENSITY_HEIGHT, .scale_height = dice(&state, 1, 9)};
        if (i % 5 == 1) v->density = (nebel_density){.type = NEBEL_DENSITY_GAUSSIAN, .sigma = dice(&state, 1, 5)};
        if (i % 7 == 2)
            for (int c = 0; c < 3; c++) v->emission[c] = dice(&state, 0, .01);
        if (i % 9 != 4) continue;
        v->shape = (nebel_shape){.type = NEBEL_SHAPE_UNION, .parts = parts, .part_count = 2};
        v->density = (nebel_density){.type = NEBEL_DENSITY_CONSTANT};
    }
    volumes[count - 1] = (nebel_volume_desc){.operation = NEBEL_OPERATION_EXCLUDE,
                                             .shape = {.type = NEBEL_SHAPE_SPHERE, .center = {4, 1, 0}, .radius = 1.5}};
}

static void try_volumes(const char *defines, const nebel_volume_desc *volumes, size_t count, const double eye[3],
                        const char *name)
{
    static const double middle[3] = {0, 0, 0};
    nebel_lighting *lighting = fog_light(NULL, volumes, count);
    char all[128];
    snprintf(all, sizeof all, "%s#define NEBEL_FEATURES_LITERAL\n#define NEBEL_FEATURES %u\n", defines,
             (unsigned)nebel_pack_features(lighting));
    tracer t;
    open_tracer(&t, NB_GL_330, TEXTURE, all, trace_body);
    camera_rays(eye, middle, count);
    pack_and_upload(&t, lighting, eye);
    evaluate(&t);
    compare(lighting, &precise, eye, 2, 0, name);
    nebel_release_lighting(lighting);
    nb_gl_close(&t.gl);
}

static const double within[3] = {.5, -.2, .1}, outside[3] = {0, 2, 40};

/* Windows while the rays come in, crowds in the middle. */
static void test_more_than_slots(void **state)
{
    (void)state;
    enum { MOST = 60 };
    static nebel_volume_desc volumes[MOST];
    for (int varying = 0; varying < 2; varying++) {
        make_crowd(volumes, 20, varying);
        try_volumes("#define NEBEL_MEDIUM_SLOTS 4\n", volumes, 20, within, "20 volumes around the eye, 4 slots");
        try_volumes("#define NEBEL_MEDIUM_SLOTS 4\n", volumes, 20, outside, "20 volumes, 4 slots");
        /* llvmpipe ends a shader's loops after 65,535 turns: fewer of the expensive ones */
        const size_t most = varying ? 40 : MOST;
        make_crowd(volumes, most, varying);
        try_volumes("", volumes, most, within,
                    varying ? "40 varying volumes around the eye" : "60 even volumes around the eye");
        try_volumes("", volumes, most, outside, varying ? "40 varying volumes" : "60 even volumes");
    }
}

static void test_thousand_volumes(void **state)
{
    (void)state;
    enum { MOST = 1000 };
    static nebel_volume_desc volumes[MOST];
    uint64_t dices = 5;
    for (size_t i = 0; i < MOST; i++) {
        volumes[i] = ball_of(dice(&dices, -14, 14), dice(&dices, -14, 14), dice(&dices, -14, 14), dice(&dices, .2, 2));
        for (int c = 0; c < 3; c++) volumes[i].source[c] = color_of(&dices);
        if (i % 2 == 0) volumes[i].density = (nebel_density){.type = NEBEL_DENSITY_RADIAL, .power = 2};
    }
    try_volumes("", volumes, 1, outside, "one volume");
    try_volumes("", volumes, 40, outside, "40 volumes");
    try_volumes("", volumes, MOST, outside, "1,000 volumes");
    try_volumes("", volumes, MOST, within, "1,000 volumes around the eye");
}

/* Balls and capsules far away, half of the rays at their silhouettes; how sharp these are is what is measured. */
static void test_silhouettes_from_afar(void **state)
{
    (void)state;
    tracer t;
    open_tracer(&t, NB_GL_330, TEXTURE, UNLIT, trace_body);
    for (int decade = 1; decade <= 5; decade++) {
        const double distance = pow(10, decade), eye[3] = {1e7, -1e7, 1e7};
        const nebel_volume_desc ball = ball_of(eye[0], eye[1], eye[2] - distance, 1);
        nebel_lighting *lighting = fog_light(NULL, &ball, 1);
        uint64_t dices = 1;
        double worst = 0, edge = 0;
        for (int i = 0; i < RAYS; i++) {
            const double r = i % 2 == 0 ? dice(&dices, 0, 1.1) : dice(&dices, .99, 1.01), a = dice(&dices, 0, 6.28);
            nebel_ray ray = {.origin = {eye[0], eye[1], eye[2]},
                             .direction = {r * cos(a), r * sin(a), -distance},
                             .t_max = HUGE_VAL};
            set_ray(i, &ray, eye);
        }
        pack_and_upload(&t, lighting, eye);
        evaluate(&t);
        const nebel_trace_desc desc = {.tolerance = 1e-5};
        fog_trace(lighting, desc, RAYS, rays, transfers);
        for (int i = 0; i < RAYS; i++) {
            const double off = worst_of(&answers[i], &transfers[i], 1);
            double *w = transfers[i].transmittance[0] > .99 ? &edge : &worst;
            *w = fmax(*w, off);
        }
        print_message("ball of 1 m at %g m: worst %.1e within, %.1e at the edge\n", distance, worst, edge);
        assert_true(worst < 1e-7 + 2e-7 * distance);
        nebel_release_lighting(lighting);
    }
    nb_gl_close(&t.gl);
}

/* ---- the same segment, asked differently ----------------------------------------------------- */

/* The answers do not depend on the eye that the fog was packed for, nor on the volumes' order. */
static void test_eyes_and_orders(void **state)
{
    (void)state;
    static nebel_volume_desc reversed[RANDOM_FOG_VOLUMES];
    static answer first[RAYS];
    tracer t;
    open_tracer(&t, NB_GL_330, TEXTURE, UNLIT, trace_body);
    nebel_lighting *lighting = commit_random_fog(RANDOM_FOG_PROFILES, 3);
    const double eye[3] = {8, 3, -11};
    camera_rays(eye, fog.shift, 3);
    pack_and_upload(&t, lighting, eye);
    evaluate(&t);
    memcpy(first, answers, sizeof first);

    const nebel_fog_desc desc = random_fog_desc(&fog);
    const nebel_lighting_desc lights = random_fog_lights(&fog);
    for (size_t i = 0; i < fog.count; i++) reversed[i] = fog.volumes[fog.count - 1 - i];
    nebel_lighting *other = fog_commit_lit(&desc, reversed, fog.count, &lights);
    pack_and_upload(&t, other, eye);
    evaluate(&t);
    assert_memory_equal(first, answers, sizeof first);

    const double beside[3] = {-20, 7, 30};
    double worst = 0;
    for (int i = 0; i < RAYS; i++)
        for (int k = 0; k < 3; k++) items[i].origin[k] = (float)(eye[k] - beside[k]);
    pack_and_upload(&t, lighting, beside);
    evaluate(&t);
    for (int i = 0; i < RAYS; i++)
        for (int c = 0; c < 3; c++) {
            worst = fmax(worst, fabs((double)(answers[i].transmittance[c] - first[i].transmittance[c])));
            worst = fmax(worst, fabs((double)(answers[i].in_scattering[c] - first[i].in_scattering[c])));
        }
    print_message("packed for another eye: worst difference %.1e\n", worst);
    assert_true(worst < 2e-5);
    nebel_release_lighting(lighting);
    nebel_release_lighting(other);
    nb_gl_close(&t.gl);
}

static const char list_body[] = "nebel_transfer l = nebel_trace_list(in0.xyz, in1.xyz, in0.w, 0, int(in1.w));\n"
                                "out0 = vec4(l.transmittance, 0.0); out1 = vec4(l.in_scattering, 0.0);\n";

/* A full ascending list is all the fog; the list of every second volume is the fog of those. */
static void test_lists(void **state)
{
    (void)state;
    static answer all[RAYS];
    static nebel_volume_desc half[RANDOM_FOG_VOLUMES];
    const double eye[3] = {8, 3, -11};
    size_t kept = 0;
    tracer t;
    open_tracer(&t, NB_GL_330, TEXTURE, UNGROUPED, trace_body);
    nebel_lighting *lighting = commit_random_fog(RANDOM_FOG_PROFILES, 3);
    for (size_t i = 0; i < fog.count; i++)
        fog.volumes[i].extinction[0] = .01 * (double)(i + 1); /* their canonical order */
    for (size_t i = 0; i < fog.count; i += 2) half[kept++] = fog.volumes[i];
    nebel_release_lighting(lighting);
    const nebel_lighting_desc lights = random_fog_lights(&fog);
    lighting = fog_light(&lights, fog.volumes, fog.count);
    nebel_lighting *halved = fog_light(&lights, half, kept);
    camera_rays(eye, fog.shift, 3);
    pack_and_upload(&t, lighting, eye);
    evaluate(&t);
    memcpy(all, answers, sizeof all);
    nb_gl_close(&t.gl);

    open_tracer(&t, NB_GL_330, TEXTURE, UNGROUPED "#define NEBEL_TILE_ENTRY(i) (i)\n", list_body);
    for (int i = 0; i < RAYS; i++) items[i].unused = (float)fog.count;
    pack_and_upload(&t, lighting, eye);
    evaluate(&t);
    assert_memory_equal(all, answers, sizeof all);
    nb_gl_close(&t.gl);

    open_tracer(&t, NB_GL_300ES, TEXTURE, UNGROUPED "#define NEBEL_TILE_ENTRY(i) (2 * (i))\n", list_body);
    for (int i = 0; i < RAYS; i++) items[i].unused = (float)kept;
    pack_and_upload(&t, lighting, eye);
    evaluate(&t);
    compare(halved, &precise, eye, largest_source(&fog), 0, "every second volume");
    nebel_release_lighting(lighting);
    nebel_release_lighting(halved);
    nb_gl_close(&t.gl);
}

/* A shader without what the fog does not have gives what the whole one gives. */
static void test_features(void **state)
{
    (void)state;
    for (int kind = 0; kind < RANDOM_FOG_KIND_COUNT; kind++) {
        nebel_lighting *lighting = commit_random_fog((random_fog_kind)kind, 1);
        const double eye[3] = {fog.shift[0] + 8, fog.shift[1] + 3, fog.shift[2] - 11};
        char defines[96], name[64];
        snprintf(defines, sizeof defines, "%s#define NEBEL_FEATURES %u\n",
                 kind % 2 ? "" : "#define NEBEL_FEATURES_LITERAL\n", (unsigned)nebel_pack_features(lighting));
        snprintf(name, sizeof name, "%s with features %u", kinds[kind], (unsigned)nebel_pack_features(lighting));
        tracer t;
        open_tracer(&t, NB_GL_330, TEXTURE, defines, trace_body);
        camera_rays(eye, fog.shift, 3);
        pack_and_upload(&t, lighting, eye);
        evaluate(&t);
        compare(lighting, &precise, eye, largest_source(&fog), 0, name);
        nebel_release_lighting(lighting);
        nb_gl_close(&t.gl);
    }
}

/* ---- the edges of the contract --------------------------------------------------------------- */

static const char transmit_body[] = "out0 = vec4(nebel_transmit(in0.xyz, in1.xyz, in0.w), 0.0);\n"
                                    "out1 = vec4(nebel_trace(in0.xyz, in1.xyz, in0.w).transmittance, 0.0);\n";

static void test_transmittance_alone(void **state)
{
    (void)state;
    tracer t;
    open_tracer(&t, NB_GL_330, TEXTURE, UNLIT, transmit_body);
    for (int kind = 0; kind < RANDOM_FOG_KIND_COUNT; kind++) {
        nebel_lighting *lighting = commit_random_fog((random_fog_kind)kind, 2);
        camera_rays(fog.shift, fog.shift, 3);
        pack_and_upload(&t, lighting, fog.shift);
        evaluate(&t);
        for (int i = 0; i < RAYS; i++)
            for (int c = 0; c < 3; c++)
                assert_true(fabs((double)(answers[i].transmittance[c] - answers[i].in_scattering[c])) <= 1e-6);
        nebel_release_lighting(lighting);
    }
    nb_gl_close(&t.gl);
}

static void test_rays_that_are_none(void **state)
{
    (void)state;
    const nebel_volume_desc world = {
        .shape = {.type = NEBEL_SHAPE_WORLD}, .extinction = {.1, .1, .1}, .source = {1, 1, 1}};
    nebel_lighting *lighting = fog_light(NULL, &world, 1);
    const double eye[3] = {0, 0, 0};
    const item none[] = {{.direction = {0, 0, 0}, .t_max = 5},   {.direction = {1, 0, 0}, .t_max = 0},
                         {.direction = {1, 0, 0}, .t_max = -1},  {.direction = {1, 0, 0}, .t_max = NAN},
                         {.direction = {NAN, 0, 0}, .t_max = 5}, {.direction = {0, 0, NAN}, .t_max = 5}};
    enum { NONE = sizeof none / sizeof *none };
    tracer t;
    open_tracer(&t, NB_GL_330, TEXTURE, UNLIT, trace_body);
    for (int i = 0; i < RAYS; i++) items[i] = i < NONE ? none[i] : (item){.direction = {1, 0, 0}, .t_max = HUGE_VALF};
    pack_and_upload(&t, lighting, eye);
    evaluate(&t);
    for (int i = 0; i < RAYS; i++)
        for (int c = 0; c < 3; c++) {
            assert_float_equal(answers[i].transmittance[c], i < NONE ? 1 : 0, 1e-30f);
            assert_float_equal(answers[i].in_scattering[c], i < NONE ? 0 : 1, 1e-6f);
        }
    nebel_release_lighting(lighting);
    nb_gl_close(&t.gl);
}

static void test_light_without_end(void **state)
{
    (void)state;
    const nebel_volume_desc volumes[] = {{.shape = {.type = NEBEL_SHAPE_WORLD}, .emission = {1, 1e9, 0}},
                                         {.shape = {.type = NEBEL_SHAPE_WORLD},
                                          .density = {.type = NEBEL_DENSITY_HEIGHT, .scale_height = 3},
                                          .extinction = {0, 0, .1},
                                          .source = {0, 0, 1}}};
    nebel_lighting *lighting = fog_light(NULL, volumes, 2);
    const double eye[3] = {0, 0, 0};
    tracer t;
    open_tracer(&t, NB_GL_330, TEXTURE, UNLIT, trace_body);
    for (int i = 0; i < RAYS; i++) items[i] = (item){.direction = {0, 1, 0}, .t_max = 1e18f};
    pack_and_upload(&t, lighting, eye);
    evaluate(&t);
    for (int i = 0; i < RAYS; i++) {
        assert_float_equal(answers[i].in_scattering[0], 65504, 0);
        assert_float_equal(answers[i].in_scattering[1], 65504, 0);
        assert_float_equal(answers[i].in_scattering[2], 1 - expf(-.3f), 1e-4f);
    }
    nebel_release_lighting(lighting);
    nb_gl_close(&t.gl);
}

/* An array of words is what the driver takes the block for. */
static void test_block_layout(void **state)
{
    (void)state;
    for (int language = NB_GL_330; language <= NB_GL_300ES; language++) {
        tracer t;
        open_tracer(&t, (nb_gl_language)language, BLOCK, UNLIT, trace_body);
        const char *name = "nebel_texels";
        GLuint index, block = glGetUniformBlockIndex(t.program, "nebel_fog_block");
        GLint offset, stride, type, length, size;
        glGetUniformIndices(t.program, 1, &name, &index);
        assert_true(index != GL_INVALID_INDEX && block != GL_INVALID_INDEX);
        glGetActiveUniformsiv(t.program, 1, &index, GL_UNIFORM_OFFSET, &offset);
        glGetActiveUniformsiv(t.program, 1, &index, GL_UNIFORM_ARRAY_STRIDE, &stride);
        glGetActiveUniformsiv(t.program, 1, &index, GL_UNIFORM_TYPE, &type);
        glGetActiveUniformsiv(t.program, 1, &index, GL_UNIFORM_SIZE, &length);
        glGetActiveUniformBlockiv(t.program, block, GL_UNIFORM_BLOCK_DATA_SIZE, &size);
        assert_int_equal(offset, 0);
        assert_int_equal(stride, sizeof(nebel_texel_f32));
        assert_int_equal(type, GL_FLOAT_VEC4);
        assert_int_equal(length, NEBEL_BLOCK_TEXELS);
        assert_int_equal(size, NEBEL_BLOCK_TEXELS * sizeof(nebel_texel_f32));
        nb_gl_close(&t.gl);
    }
}

int main(int argc, char **argv)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_330_texture),
        cmocka_unit_test(test_330_block),
        cmocka_unit_test(test_300_es_texture),
        cmocka_unit_test(test_300_es_block),
        cmocka_unit_test(test_soft_edges_in_haze),
        cmocka_unit_test(test_priorities_among_many),
        cmocka_unit_test(test_rays_to_a_light_know_no_distances),
        cmocka_unit_test(test_sunlit_fog),
        cmocka_unit_test(test_more_than_slots),
        cmocka_unit_test(test_thousand_volumes),
        cmocka_unit_test(test_silhouettes_from_afar),
        cmocka_unit_test(test_eyes_and_orders),
        cmocka_unit_test(test_lists),
        cmocka_unit_test(test_features),
        cmocka_unit_test(test_transmittance_alone),
        cmocka_unit_test(test_rays_that_are_none),
        cmocka_unit_test(test_light_without_end),
        cmocka_unit_test(test_block_layout),
    };
    all_kinds = argc > 1;
    (void)argv;
    return cmocka_run_group_tests(tests, NULL, NULL);
}
