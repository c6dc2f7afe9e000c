/* Particles in shaders: the piece of a ball or a Gaussian before the opaque surface against nebel_trace in double, and
 * the comparison of depth at five places against a rendition of its own, in GLSL 3.30 and GLSL ES 3.00. */
#include "gl_harness.h"

#include <nebel/shader.h>

#include <epoxy/gl.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#include "fog_help.h"

static const char *dialect_of(nb_gl_language language)
{
    return nebel_get_shader_source(language == NB_GL_330 ? NEBEL_DIALECT_GLSL_330 : NEBEL_DIALECT_GLSL_300_ES);
}

/* ---- soft particles -------------------------------------------------------------------------- */

enum { PARTICLES = 4000, GAUSSIAN = 4, ENDLESS, PROFILES };

/* sigma counts where profile is GAUSSIAN or ENDLESS, radius where it is not ENDLESS. */
typedef struct particle {
    float origin[3], t_max, direction[3], profile, center[3], radius, extinction[3], sigma, light[4];
} particle;

typedef struct particle_light {
    float transmittance[4], in_scattering[4];
} particle_light;

static const char particle_body[] =
    "int profile = int(in1.w);\n"
    "float way = profile < 4 ? nebel_sphere_path_length(in0.xyz, in1.xyz, in0.w, in2.xyz, in2.w, profile)\n"
    "    : nebel_gaussian_path_length(in0.xyz, in1.xyz, in0.w, in2.xyz, profile == 4 ? in2.w : 1e18, in3.w);\n"
    "nebel_transfer l = nebel_medium_transfer(way, in3.xyz, in4.xyz);\n"
    "out0 = vec4(l.transmittance, 0.0); out1 = vec4(l.in_scattering, 0.0);\n";

/* A ray from anywhere near the particle, inside of it too, towards anywhere in it, to an end before, in or behind it.
 */
static particle random_particle(uint64_t *state)
{
    particle p = {.radius = (float)dice(state, .2, 5), .profile = (float)dice_below(state, PROFILES)};
    double way[3], square = 0;
    p.sigma = p.radius * (float)dice(state, .2, 1);
    const double reach = (double)p.radius * (dice_below(state, 3) == 0 ? 1.2 : 300);
    for (int i = 0; i < 3; i++) {
        p.origin[i] = (float)dice(state, -10, 10);
        p.center[i] = p.origin[i] + (float)dice(state, -reach, reach);
        way[i] = (double)p.center[i] + dice(state, -1.2, 1.2) * (double)p.radius - (double)p.origin[i];
        square += way[i] * way[i];
        p.extinction[i] = (float)(dice(state, 0, 4) / (double)p.radius);
        p.light[i] = (float)(dice(state, 0, 1) / (double)p.radius);
    }
    for (int i = 0; i < 3; i++) p.direction[i] = (float)(way[i] / sqrt(square));
    p.t_max =
        dice_below(state, 3) == 0 ? 1e18f : (float)fmax(0, sqrt(square) + dice(state, -1.5, 1.5) * (double)p.radius);
    return p;
}

static nebel_transfer trace_particle(const particle *p)
{
    nebel_volume_desc volume = {.shape = {.type = NEBEL_SHAPE_SPHERE, .radius = (double)p->radius}};
    nebel_ray ray = {.t_max = (double)p->t_max};
    nebel_transfer transfer;
    const int profile = (int)p->profile;
    if (profile == ENDLESS) volume.shape = (nebel_shape){.type = NEBEL_SHAPE_WORLD};
    if (profile >= 1) volume.density = (nebel_density){.type = NEBEL_DENSITY_RADIAL, .power = profile};
    if (profile >= GAUSSIAN)
        volume.density = (nebel_density){.type = NEBEL_DENSITY_GAUSSIAN, .sigma = (double)p->sigma};
    for (int i = 0; i < 3; i++) {
        volume.shape.center[i] = volume.density.center[i] = (double)p->center[i];
        volume.extinction[i] = (double)p->extinction[i];
        volume.emission[i] = (double)p->light[i];
        ray.origin[i] = (double)p->origin[i];
        ray.direction[i] = (double)p->direction[i];
    }
    nebel_snapshot *fog = fog_commit(&(nebel_fog_desc){0}, &volume, 1);
    const nebel_trace_desc exact = {.tolerance = 1e-9};
    assert_int_equal(nebel_trace(fog, &exact, 1, &ray, sizeof ray, &transfer, sizeof transfer), NEBEL_OK);
    nebel_release_snapshot(fog);
    return transfer;
}

static void try_particles(nb_gl_language language)
{
    static particle particles[PARTICLES];
    static particle_light lights[PARTICLES];
    const char *const texts[] = {"#define NEBEL_TRANSPARENT\n", dialect_of(language), NULL};
    uint64_t state = 11;
    nb_gl gl;
    double worst[PROFILES] = {0};
    int touched = 0;
    if (!nb_gl_open(&gl, language)) fail_msg("%s", gl.fault);
    const unsigned program = nb_gl_compile_texts(&gl, texts, particle_body, 5, 2);
    if (!program) fail_msg("%s", gl.fault);
    for (int n = 0; n < PARTICLES; n++) particles[n] = random_particle(&state);
    if (!nb_gl_evaluate(&gl, program, PARTICLES, particles[0].origin, lights[0].transmittance))
        fail_msg("%s", gl.fault);
    for (int n = 0; n < PARTICLES; n++) {
        const nebel_transfer wanted = trace_particle(&particles[n]);
        double off = 0;
        for (int c = 0; c < 3; c++) {
            off = fmax(off, fabs((double)lights[n].transmittance[c] - wanted.transmittance[c]));
            off = fmax(off, fabs((double)lights[n].in_scattering[c] - wanted.in_scattering[c]));
            assert_true(isfinite(lights[n].transmittance[c]) && isfinite(lights[n].in_scattering[c]));
        }
        touched += wanted.transmittance[0] < .99;
        double *const most = &worst[(int)particles[n].profile];
        *most = fmax(*most, off);
    }
    for (int k = 0; k < PROFILES; k++) {
        print_message("profile %d: at most %.1e off\n", k, worst[k]);
        assert_true(worst[k] <= 2e-3);
    }
    assert_true(touched > PARTICLES / 3);
    nb_gl_close(&gl);
}

static void test_particles_330(void **state)
{
    (void)state;
    try_particles(NB_GL_330);
}

static void test_particles_300_es(void **state)
{
    (void)state;
    try_particles(NB_GL_300ES);
}

/* ---- five taps ------------------------------------------------------------------------------- */

enum { COLUMNS = 2048, ROWS = 1024, FRAGMENTS = 20000 };

static float opaque[ROWS][COLUMNS];

typedef struct fragment {
    float clip[4], depth, offset, nothing, edge, margin, brightness, unused[2];
} fragment;

typedef struct verdict {
    float place[2], brightness, by_defaults;
} verdict;

static const char tap_body[] = "nebel_depth_taps taps;\n"
                               "taps.offset = in1.y; taps.nothing = in1.z; taps.edge = in1.w;\n"
                               "taps.margin = in2.x; taps.brightness = in2.y;\n"
                               "vec2 place = nebel_screen_uv(in0);\n"
                               "out0 = vec4(place, nebel_five_taps(place, in1.x, taps),\n"
                               "            nebel_five_taps(place, in1.x, nebel_default_taps()));\n";

/* Slopes with steps of every height, and nothing here and there. */
static void fill_opaque(uint64_t *state)
{
    for (int y = 0; y < ROWS; y++)
        for (int x = 0; x < COLUMNS; x++) opaque[y][x] = (float)(10 + .004 * x + .3 * ((x / 5 + y / 7) % 4));
    for (int n = 0; n < 3000; n++) {
        const int x = dice_below(state, COLUMNS - 8), y = dice_below(state, ROWS - 8);
        const float depth = dice_below(state, 2) == 0 ? -1 : (float)dice(state, 5, 25);
        for (int k = 0; k < 64; k++) opaque[y + k / 8][x + k % 8] = depth;
    }
}

static double opaque_at(double u, double v)
{
    const int x = (int)floor(u * COLUMNS), y = (int)floor(v * ROWS);
    return (double)opaque[y < 0 ? 0 : y >= ROWS ? ROWS - 1 : y][x < 0 ? 0 : x >= COLUMNS ? COLUMNS - 1 : x];
}

/* The technique in its own words: an edge is drawn, and what is not behind the nearest of five. */
static double judge(const fragment *f, double u, double v)
{
    const double step[5][2] = {{0, 0}, {1, 1}, {1, -1}, {-1, 1}, {-1, -1}};
    double low = HUGE_VAL, high = -HUGE_VAL;
    for (int k = 0; k < 5; k++) {
        double depth = opaque_at(u + step[k][0] * (double)f->offset, v + step[k][1] * (double)f->offset);
        if (depth < 0) depth = (double)f->nothing;
        if (depth < low) low = depth;
        if (depth > high) high = depth;
    }
    if (high - low > (double)f->edge) return (double)f->brightness;
    if (low < (double)f->depth - (double)f->margin) return 0;
    return (double)f->brightness;
}

/* So that no tap lies on the border of a texel, where the sampler may take either. */
static int is_clear(double place, double offset, int texels)
{
    for (int k = -1; k <= 1; k++) {
        const double at = (place + k * offset) * texels;
        if (fabs(at - floor(at + .5)) < .02) return 0;
    }
    return 1;
}

static fragment random_fragment(uint64_t *state)
{
    fragment f;
    double u, v;
    do {
        f = (fragment){.offset = (float)dice(state, .0002, .004),
                       .nothing = 20,
                       .edge = (float)dice(state, .1, 1),
                       .margin = (float)dice(state, 0, .5),
                       .brightness = (float)dice(state, .2, 2)};
        if (dice_below(state, 2) == 0) f.offset = .0005f;
        f.clip[2] = (float)dice(state, -3, 3); /* not what to divide by */
        f.clip[3] = (float)dice(state, .5, 30);
        for (int i = 0; i < 2; i++) f.clip[i] = f.clip[3] * (float)dice(state, -.98, .98);
        u = .5 + .5 * (double)f.clip[0] / (double)f.clip[3];
        v = .5 + .5 * (double)f.clip[1] / (double)f.clip[3];
    } while (!is_clear(u, (double)f.offset, COLUMNS) || !is_clear(v, (double)f.offset, ROWS) ||
             !is_clear(u, .0005, COLUMNS) || !is_clear(v, .0005, ROWS));
    const double there = opaque_at(u, v);
    f.depth = (float)(there < 0 ? dice(state, 5, 30) : there + dice(state, -.6, .8));
    return f;
}

static void bind_opaque(unsigned program)
{
    unsigned texture;
    glGenTextures(1, &texture);
    glBindTexture(GL_TEXTURE_2D, texture);
    glTexImage2D(GL_TEXTURE_2D, 0, GL_R32F, COLUMNS, ROWS, 0, GL_RED, GL_FLOAT, opaque);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_NEAREST);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, GL_NEAREST);
    glUseProgram(program);
    glUniform1i(glGetUniformLocation(program, "depth"), 0);
}

static void compare_taps(const fragment *f, const verdict *got, int *drawn)
{
    fragment usual = *f;
    usual.offset = .0005f, usual.nothing = 100000, usual.edge = .5f, usual.margin = .125f, usual.brightness = 1;
    const double u = .5 + .5 * (double)f->clip[0] / (double)f->clip[3];
    const double v = .5 + .5 * (double)f->clip[1] / (double)f->clip[3];
    assert_true(fabs((double)got->place[0] - u) < 1e-6 && fabs((double)got->place[1] - v) < 1e-6);
    assert_true((double)got->brightness == judge(f, u, v));
    assert_true((double)got->by_defaults == judge(&usual, u, v));
    *drawn += got->by_defaults > 0;
}

static void try_taps(nb_gl_language language)
{
    static fragment fragments[FRAGMENTS];
    static verdict verdicts[FRAGMENTS];
    const char *const texts[] = {"#define NEBEL_TRANSPARENT\n"
                                 "#define NEBEL_OPAQUE_DEPTH(at) textureLod(depth, at, 0.0).x\n"
                                 "uniform highp sampler2D depth;\n",
                                 dialect_of(language), NULL};
    uint64_t state = 5;
    nb_gl gl;
    int drawn = 0;
    if (!nb_gl_open(&gl, language)) fail_msg("%s", gl.fault);
    const unsigned program = nb_gl_compile_texts(&gl, texts, tap_body, 3, 1);
    if (!program) fail_msg("%s", gl.fault);
    fill_opaque(&state);
    bind_opaque(program);
    for (int n = 0; n < FRAGMENTS; n++) fragments[n] = random_fragment(&state);
    if (!nb_gl_evaluate(&gl, program, FRAGMENTS, fragments[0].clip, verdicts[0].place)) fail_msg("%s", gl.fault);
    for (int n = 0; n < FRAGMENTS; n++) compare_taps(&fragments[n], &verdicts[n], &drawn);
    print_message("%d of %d fragments are drawn\n", drawn, (int)FRAGMENTS);
    assert_true(drawn > FRAGMENTS / 5 && drawn < FRAGMENTS * 4 / 5);
    nb_gl_close(&gl);
}

static void test_taps_330(void **state)
{
    (void)state;
    try_taps(NB_GL_330);
}

static void test_taps_300_es(void **state)
{
    (void)state;
    try_taps(NB_GL_300ES);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_particles_330),
        cmocka_unit_test(test_particles_300_es),
        cmocka_unit_test(test_taps_330),
        cmocka_unit_test(test_taps_300_es),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
