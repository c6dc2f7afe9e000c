/* Rays and lengths that shaders compute with nebel_make_view_ray, against points brought back through the inverse of the whole
 * matrix in long double: every projection times every convention of depth, in GLSL 3.30 and GLSL ES 3.00. */
#include "gl_harness.h"
#include "projections.h"
#include "unit.h"

#include <epoxy/gl.h>
#include <math.h>
#include <nebel/shader.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { WIDTH = 640, HEIGHT = 400, COUNT = 512, INPUTS = 4, OUTPUTS = 8 };

/* ---- evaluation ------------------------------------------------------------------------------ */

static unsigned compile(nb_gl *gl)
{
    const int es = gl->language == NB_GL_300ES;
    const char *const texts[] = {
        "#define NEBEL_VIEW\n", nebel_get_shader_source(es ? NEBEL_DIALECT_GLSL_300_ES : NEBEL_DIALECT_GLSL_330), NULL};
    const unsigned program = nb_gl_compile_texts(gl, texts,
                                                 "nebel_view_ray s = nebel_make_view_ray(in0.xy, in0.z);\n"
                                                 "out0 = vec4(s.origin, s.t_max); out1 = vec4(s.direction, 0.0);\n",
                                                 1, 2);
    if (program == 0) fail_msg("%s", gl->fault);
    return program;
}

static float inputs[COUNT][INPUTS], outputs[COUNT][OUTPUTS];

static void see(nb_gl *gl, unsigned program, const nebel_rays *rays)
{
    glUseProgram(program);
    glUniform4fv(glGetUniformLocation(program, "nebel_rays"), NEBEL_RAY_TEXELS, rays->texels[0].v);
    if (!nb_gl_evaluate(gl, program, COUNT, &inputs[0][0], &outputs[0][0])) fail_msg("%s", gl->fault);
}

static double random_number(double from, double to)
{
    static uint64_t state = 1;
    state = state * 6364136223846793005u + 1442695040888963407u;
    return from + (to - from) * (double)(state >> 11) * 0x1p-53;
}

/* What errors are relative to at least [m]: parallel rays start anywhere in the picture. */
static double least_of(int projection)
{
    return projection == ORTHOGRAPHIC ? 40 : 0;
}

/* Errors of the point that was hit, across the ray and along it, relative to its distance from the eye, or to `least`
 * metres: parallel rays start anywhere in the picture. */
typedef struct miss {
    double across, along, distance;
} miss;

static miss miss_of(const nebel_rays *rays, int i, const long double point[3], double least)
{
    double to[3], length = 0, along = 0, square = 0, beside = 0;
    for (int k = 0; k < 3; k++) {
        to[k] = (double)(point[k] - (long double)rays->eye[k]);
        length += to[k] * to[k];
        to[k] -= (double)outputs[i][k];
        along += to[k] * (double)outputs[i][4 + k];
        square += (double)outputs[i][4 + k] * (double)outputs[i][4 + k];
    }
    for (int k = 0; k < 3; k++) beside += pow(to[k] - along * (double)outputs[i][4 + k], 2);
    assert_true(fabs(sqrt(square) - 1) < 3e-7);
    length = fmax(sqrt(length), least);
    return (miss){sqrt(beside) / length, fabs((double)outputs[i][3] - along) / length, length};
}

/* ---- tests ----------------------------------------------------------------------------------- */

/* Turned, and far from the origin of the world. */
static const double eye_place[3] = {4e6, -100, -7e6};

static nebel_view make_view(int kind, range r)
{
    nebel_view view = {.width = WIDTH, .height = HEIGHT};
    memcpy(view.clip_from_eye, projections[kind].make(r).m, sizeof view.clip_from_eye);
    memcpy(view.eye_from_world, look(eye_place, .7, -.3).m, sizeof view.eye_from_world);
    return view;
}

/* Stored depths of points 2 to 200 m away, through the matrix and the depth range, as floats. */
static void fill_window(const nebel_view *view, range r, double first, double last)
{
    for (int i = 0; i < COUNT;) {
        double point[3], place[2], n;
        const line ray = line_of(view, random_number(0, WIDTH), random_number(0, HEIGHT));
        const long double away = (long double)(2 * pow(100, random_number(0, 1)));
        for (int k = 0; k < 3; k++) point[k] = (double)(ray.origin[k] + away * ray.direction[k]);
        if (!project(view, r, point, place, &n)) continue;
        inputs[i][0] = (float)place[0];
        inputs[i][1] = (float)place[1];
        inputs[i++][2] = (float)stored(r, first, last, n);
    }
}

/* How far the point moves, relative to its distance, with four steps of a float of depth. */
static double four_steps(const nebel_view *view, const float *input, double n, double distance)
{
    long double here[3], there[3];
    unproject(view, (double)input[0], (double)input[1], n, here);
    unproject(view, (double)input[0], (double)input[1], n - 4 * 0x1p-24, there);
    return (double)sqrtl(powl(here[0] - there[0], 2) + powl(here[1] - there[1], 2) + powl(here[2] - there[2], 2)) /
           distance;
}

static void check_window(nb_gl *gl, unsigned program, int projection, range r, double first, double last)
{
    const nebel_view view = make_view(projection, r);
    const nebel_depth_desc depth = {.zero_to_one = r.low == 0, .range = {first, last}};
    nebel_rays rays;
    miss worst = {0, 0, 0};
    assert_int_equal(nebel_compute_view_rays(&view, &depth, &rays), NEBEL_OK);
    fill_window(&view, r, first, last);
    see(gl, program, &rays);
    for (int i = 0; i < COUNT; i++) {
        long double point[3];
        const double n = normalized(r, first, last, (double)inputs[i][2]);
        unproject(&view, (double)inputs[i][0], (double)inputs[i][1], n, point);
        const miss m = miss_of(&rays, i, point, least_of(projection));
        const double more = projections[projection].coarse ? four_steps(&view, inputs[i], n, m.distance) : 0;
        worst.across = fmax(worst.across, m.across);
        worst.along = fmax(worst.along, m.along);
        if (!(m.across < 1e-6 && m.along < 1e-6 + more)) {
            fail_msg("%s from %g%s, range %g..%g: at pixel %g, %g, depth %.9g: %.1e across, %.1e along",
                     projections[projection].name, r.low, r.reversed ? " reversed" : "", first, last,
                     (double)inputs[i][0], (double)inputs[i][1], (double)inputs[i][2], m.across, m.along);
        }
    }
    print_message("%s from %g%s, range %g..%g: %.1e across, %.1e along\n", projections[projection].name, r.low,
                  r.reversed ? " reversed" : "", first, last, worst.across, worst.along);
}

/* ---- depth in metres, logarithms, sky, starts ------------------------------------------------ */

/* The same pixels with another kind of depth, made from the points that window depth gave. */
static void check_kind(nb_gl *gl, unsigned program, int projection, const nebel_depth_desc *depth)
{
    static float window[COUNT][OUTPUTS];
    const nebel_view view = make_view(projection, (range){-1, 0});
    nebel_rays rays;
    assert_int_equal(nebel_compute_view_rays(&view, NULL, &rays), NEBEL_OK);
    fill_window(&view, (range){-1, 0}, 0, 1);
    see(gl, program, &rays);
    memcpy(window, outputs, sizeof window);
    for (int i = 0; i < COUNT; i++) {
        const double *const row = view.eye_from_world;
        double z = 0;
        for (int k = 0; k < 3; k++)
            z += row[4 * k + 2] * ((double)window[i][k] + (double)window[i][3] * (double)window[i][4 + k]);
        inputs[i][2] = depth->encoding == NEBEL_DEPTH_ENCODING_RADIAL ? window[i][3]
                       : depth->encoding == NEBEL_DEPTH_ENCODING_AXIAL
                           ? (float)-z
                           : (float)(log1p(depth->log_scale * -z) / log1p(depth->log_scale * depth->log_far));
    }
    assert_int_equal(nebel_compute_view_rays(&view, depth, &rays), NEBEL_OK);
    see(gl, program, &rays);
    for (int i = 0; i < COUNT; i++) {
        double square = 0;
        for (int k = 0; k < 3; k++) square += pow((double)(window[i][k] + window[i][3] * window[i][4 + k]), 2);
        assert_true(fabs((double)(outputs[i][3] - window[i][3])) < 2e-6 * fmax(sqrt(square), least_of(projection)));
        assert_memory_equal(outputs[i] + 4, window[i] + 4, 3 * sizeof(float));
        assert_memory_equal(outputs[i], window[i], 3 * sizeof(float));
    }
}

static void check_kinds(nb_gl *gl, unsigned program)
{
    const nebel_depth_desc axis = {.encoding = NEBEL_DEPTH_ENCODING_AXIAL},
                           distance = {.encoding = NEBEL_DEPTH_ENCODING_RADIAL};
    const nebel_depth_desc logarithm = {.encoding = NEBEL_DEPTH_ENCODING_LOGARITHMIC, .log_scale = .5, .log_far = 1e5};
    check_kind(gl, program, PERSPECTIVE, &axis);
    check_kind(gl, program, PERSPECTIVE, &distance);
    check_kind(gl, program, PERSPECTIVE, &logarithm);
    check_kind(gl, program, ORTHOGRAPHIC, &axis);
    check_kind(gl, program, ORTHOGRAPHIC, &distance);
}

/* t_max of one pixel in the middle. */
static double length_at(nb_gl *gl, unsigned program, int projection, range r, const nebel_depth_desc *depth,
                        float stored)
{
    const nebel_view view = make_view(projection, r);
    nebel_rays rays;
    assert_int_equal(nebel_compute_view_rays(&view, depth, &rays), NEBEL_OK);
    inputs[0][0] = WIDTH / 2.f;
    inputs[0][1] = HEIGHT / 2.f;
    inputs[0][2] = stored;
    see(gl, program, &rays);
    return (double)outputs[0][3];
}

static void check_sky(nb_gl *gl, unsigned program)
{
    const double endless = (double)1e18f;
    const range usual = {-1, 0}, reversed = {0, 1};
    const nebel_depth_desc none = {0}, zero_to_one = {.zero_to_one = 1};
    const nebel_depth_desc wall = {.background = NEBEL_BACKGROUND_DEPTH_NONE},
                           value = {.background = NEBEL_BACKGROUND_DEPTH_VALUE, .background_depth = .5};
    const nebel_depth_desc axis = {.encoding = NEBEL_DEPTH_ENCODING_AXIAL};
    assert_true(length_at(gl, program, PERSPECTIVE, usual, &none, 1) == endless);
    assert_true(length_at(gl, program, PERSPECTIVE, usual, &none, 1 - 0x1p-24f) < 1000);
    assert_true(length_at(gl, program, PERSPECTIVE, reversed, &zero_to_one, 0) == endless);
    assert_true(length_at(gl, program, PERSPECTIVE, reversed, &zero_to_one, 1) < .1001);
    assert_true(length_at(gl, program, INFINITE, reversed, &zero_to_one, 0) == endless);
    assert_true(fabs(length_at(gl, program, PERSPECTIVE, usual, &wall, 1) - 1000) < 1e-3);
    assert_true(length_at(gl, program, INFINITE, usual, &wall, 1) == endless);
    assert_true(length_at(gl, program, PERSPECTIVE, usual, &value, .5f) == endless);
    assert_true(fabs(length_at(gl, program, PERSPECTIVE, usual, &value, 1) - 1000) < 1e-3);
    assert_true(length_at(gl, program, PERSPECTIVE, usual, &axis, 0) == endless);
    assert_true(length_at(gl, program, PERSPECTIVE, usual, &axis, -1) == endless);
    assert_true(length_at(gl, program, PERSPECTIVE, usual, &axis, 2e18f) == endless);
    assert_true(length_at(gl, program, PERSPECTIVE, usual, &axis, 7) < 7.001);
}

/* The rest of the ray behind the near plane, wherever that is. */
static void check_start(nb_gl *gl, unsigned program)
{
    const range r = {-1, 0};
    const nebel_depth_desc near = {.ray_start = NEBEL_RAY_START_NEAR}, eye = {0};
    const double whole = length_at(gl, program, PERSPECTIVE, r, &eye, .999f);
    assert_true(fabs(whole - length_at(gl, program, PERSPECTIVE, r, &near, .999f) - .1) < 1e-5);
    assert_true(fabs(length_at(gl, program, ORTHOGRAPHIC, r, &eye, 0) - 1) < 1e-6);
    assert_true(fabs(length_at(gl, program, ORTHOGRAPHIC, r, &near, 0)) < 1e-6);
    assert_true(fabs(length_at(gl, program, ORTHOGRAPHIC, r, &near, .5f) - 149.5) < 1e-3);
    assert_true(fabs(length_at(gl, program, OBLIQUE, r, &near, 0)) < 1e-5);
    assert_true(fabs(length_at(gl, program, OBLIQUE, r, &eye, 0) - 2 / .9) < 1e-5);
}

static void check_language(nb_gl_language language)
{
    nb_gl gl;
    if (!nb_gl_open(&gl, language)) fail_msg("%s", gl.fault);
    const unsigned program = compile(&gl);
    for (int p = 0; p < PROJECTIONS; p++) {
        for (int k = 0; k < 4; k++) {
            const range r = {k & 1 ? 0 : -1, k >> 1};
            check_window(&gl, program, p, r, 0, 1);
        }
        check_window(&gl, program, p, (range){0, 0}, .25, .75);
        check_window(&gl, program, p, (range){-1, 0}, 1, 0);
    }
    check_kinds(&gl, program);
    check_sky(&gl, program);
    check_start(&gl, program);
    nb_gl_close(&gl);
}

static void test_glsl_330_sees_through_every_projection(void **state)
{
    (void)state;
    check_language(NB_GL_330);
}

static void test_glsl_es_300_sees_through_every_projection(void **state)
{
    (void)state;
    check_language(NB_GL_300ES);
}

static void expect_refusal(const nebel_view *view, const nebel_depth_desc *depth)
{
    nebel_rays rays;
    assert_int_equal(nebel_compute_view_rays(view, depth, &rays), NEBEL_ERROR_ARGUMENT);
}

static void refuse_view_with(int clip, int at, double value)
{
    nebel_view view = make_view(PERSPECTIVE, (range){-1, 0});
    (clip ? view.clip_from_eye : view.eye_from_world)[at] = value;
    expect_refusal(&view, NULL);
}

static void test_what_is_no_view_is_refused(void **state)
{
    (void)state;
    nebel_view view = make_view(PERSPECTIVE, (range){-1, 0});
    nebel_rays rays;
    assert_int_equal(nebel_compute_view_rays(&view, NULL, NULL), NEBEL_ERROR_ARGUMENT);
    assert_int_equal(nebel_compute_view_rays(NULL, NULL, &rays), NEBEL_ERROR_ARGUMENT);
    view.width = 0;
    expect_refusal(&view, NULL);
    view.width = 65537;
    expect_refusal(&view, NULL);
    for (int i = 0; i < 16; i++) {
        refuse_view_with(1, i, (double)NAN);
        refuse_view_with(0, i, HUGE_VAL);
    }
    refuse_view_with(1, 0, 0);  /* no width */
    refuse_view_with(1, 11, 0); /* w is 0 everywhere */
    refuse_view_with(1, 14, 0); /* the eye has no depth */
    refuse_view_with(0, 3, .1); /* a projection in place of a view */
    refuse_view_with(0, 15, 2);
    for (int row = 0; row < 4; row++) { /* a row that two others give, or none: no place has a depth of its own */
        view = make_view(PERSPECTIVE, (range){-1, 0});
        for (int i = 0; i < 16; i += 4)
            view.clip_from_eye[i + row] =
                .3 * view.clip_from_eye[i + (row + 1) % 4] + .7 * view.clip_from_eye[i + (row + 2) % 4];
        expect_refusal(&view, NULL);
        view = make_view(ORTHOGRAPHIC, (range){-1, 0});
        for (int i = 0; i < 16; i += 4)
            view.clip_from_eye[i + row] = row == 3 ? 0 : .3 * view.clip_from_eye[i + (row + 1) % 3];
        expect_refusal(&view, NULL);
    }
    const nebel_view zero = {.width = 8, .height = 8};
    expect_refusal(&zero, NULL);
}

static void test_what_is_no_convention_is_refused(void **state)
{
    (void)state;
    const nebel_view view = make_view(PERSPECTIVE, (range){-1, 0}), parallel = make_view(ORTHOGRAPHIC, (range){-1, 0});
    const nebel_depth_desc wrong[] = {
        {.encoding = NEBEL_DEPTH_ENCODING_COUNT},
        {.background = (nebel_background_depth)7},
        {.ray_start = (nebel_ray_start)-1},
        {.range = {1, 1}},
        {.range = {0, (double)NAN}},
        {.encoding = NEBEL_DEPTH_ENCODING_LOGARITHMIC},
        {.encoding = NEBEL_DEPTH_ENCODING_LOGARITHMIC, .log_far = HUGE_VAL},
        {.encoding = NEBEL_DEPTH_ENCODING_LOGARITHMIC, .log_far = 10, .log_scale = -1},
    };
    const nebel_depth_desc logarithm = {.encoding = NEBEL_DEPTH_ENCODING_LOGARITHMIC, .log_far = 10};
    nebel_rays rays;
    for (size_t i = 0; i < sizeof wrong / sizeof *wrong; i++) expect_refusal(&view, &wrong[i]);
    assert_int_equal(nebel_compute_view_rays(&view, &logarithm, &rays), NEBEL_OK);
    expect_refusal(&parallel, &logarithm);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_what_is_no_view_is_refused),
        cmocka_unit_test(test_what_is_no_convention_is_refused),
        cmocka_unit_test(test_glsl_330_sees_through_every_projection),
        cmocka_unit_test(test_glsl_es_300_sees_through_every_projection),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
