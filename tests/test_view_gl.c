/* Rays and lengths that shaders compute with nebel_see, against points brought back through the inverse of the whole
 * matrix in long double: every projection times every convention of depth, in GLSL 3.30 and GLSL ES 3.00. */
#include "gl_harness.h"

#include <epoxy/gl.h>
#include <math.h>
#include <nebel/shader.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <cmocka.h>

enum { WIDTH = 640, HEIGHT = 400, COUNT = 512, INPUTS = 4, OUTPUTS = 8 };

/* ---- matrices, column-major ---------------------------------------------------------------------------------------
 */

typedef struct matrix {
    double m[16];
} matrix;

static matrix multiply(matrix a, matrix b)
{
    matrix out = {{0}};
    for (int i = 0; i < 64; i++) out.m[i / 16 * 4 + i % 4] += a.m[i / 4 % 4 * 4 + i % 4] * b.m[i / 16 * 4 + i / 4 % 4];
    return out;
}

/* Solves matrix x = right by elimination with pivots. */
static void solve(matrix a, const double right[4], long double x[4])
{
    long double r[4][5];
    for (int i = 0; i < 4; i++) {
        for (int k = 0; k < 4; k++) r[i][k] = (long double)a.m[4 * k + i];
        r[i][4] = (long double)right[i];
    }
    for (int k = 0; k < 4; k++) {
        int best = k;
        for (int i = k; i < 4; i++) best = fabsl(r[i][k]) > fabsl(r[best][k]) ? i : best;
        for (int c = 0; c < 5; c++) {
            const long double swapped = r[k][c];
            r[k][c] = r[best][c];
            r[best][c] = swapped;
        }
        for (int i = 0; i < 4; i++) {
            const long double factor = i == k ? 0 : r[i][k] / r[k][k];
            for (int c = k; c < 5; c++) r[i][c] -= factor * r[k][c];
        }
    }
    for (int i = 0; i < 4; i++) x[i] = r[i][4] / r[i][i];
}

/* Turned, and far from the origin of the world. */
static matrix view_matrix(void)
{
    const double a = .7, b = -.3;
    const matrix yaw = {{cos(a), 0, -sin(a), 0, 0, 1, 0, 0, sin(a), 0, cos(a), 0, 0, 0, 0, 1}};
    const matrix pitch = {{1, 0, 0, 0, 0, cos(b), sin(b), 0, 0, -sin(b), cos(b), 0, 0, 0, 0, 1}};
    const matrix move = {{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, -4e6, 100, 7e6, 1}};
    return multiply(pitch, multiply(yaw, move));
}

/* ---- projections: each gives clip z from `low` to 1, which falls along the ray where reversed -----------------------
 */

typedef struct range {
    double low;
    int reversed;
} range;

static double z_near(range r)
{
    return r.reversed ? 1 : r.low;
}

static double z_far(range r)
{
    return r.reversed ? r.low : 1;
}

/* The third row of a projection whose normalized depth is z_near at `near` and z_far at `far` metres along -z; far may
 * be infinite. */
static void set_depth_row(matrix *p, range r, double near, double far)
{
    const double ratio = near / far;
    p->m[10] = isinf(far) ? -z_far(r) : -(z_far(r) - z_near(r) * ratio) / (1 - ratio);
    p->m[14] = near * (z_near(r) + p->m[10]);
}

static matrix frustum(range r, double left, double right, double bottom, double top, double near, double far)
{
    matrix p = {{0}};
    p.m[0] = 2 / (right - left);
    p.m[5] = 2 / (top - bottom);
    p.m[8] = (right + left) / (right - left);
    p.m[9] = (top + bottom) / (top - bottom);
    p.m[11] = -1;
    set_depth_row(&p, r, near, far);
    return p;
}

static matrix perspective(range r)
{
    return frustum(r, -.8, .8, -.5, .5, .1, 1000);
}

static matrix infinite(range r)
{
    return frustum(r, -.8, .8, -.5, .5, .1, INFINITY);
}

static matrix off_axis_tile(range r)
{
    return frustum(r, 1.5, 1.6, -.7, -.64, .1, 1000);
}

static matrix orthographic(range r)
{
    matrix p = {{1. / 40, 0, 0, 0, 0, 1. / 25, 0, 0, 0, 0, 0, 0, .3, -.2, 0, 1}};
    const double near = 1, far = 300;
    p.m[10] = (z_near(r) - z_far(r)) / (far - near);
    p.m[14] = z_near(r) + p.m[10] * near;
    return p;
}

/* An eye beside the origin of eye space, as stereo projections have it, and a mirrored picture. */
static matrix stereo(range r)
{
    const matrix aside = {{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, .032, 0, 0, 1}};
    const matrix mirror = {{1, 0, 0, 0, 0, -1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1}};
    return multiply(mirror, multiply(frustum(r, -.75, .85, -.5, .5, .1, 500), aside));
}

/* Left-handed, looking along +z. */
static matrix left_handed(range r)
{
    matrix p = perspective(r);
    for (int i = 8; i < 12; i++) p.m[i] = -p.m[i];
    return p;
}

/* The near plane is n.p + d = 0 in eye space: the third row is made such that it is met at z_near there. */
static matrix oblique(range r)
{
    const double plane[4] = {.1, .7, -.9, -2};
    matrix p = perspective(r);
    const double grow = z_far(r) - z_near(r);
    for (int i = 0; i < 4; i++) p.m[4 * i + 2] = grow * .8 * plane[i] + z_near(r) * p.m[4 * i + 3];
    return p;
}

/* `coarse`: floats of depth have few steps where points are far beside how far depth could reach, or near. */
static const struct {
    const char *name;
    matrix (*make)(range r);
    int coarse;
} projections[] = {
    {"perspective", perspective, 0},     {"infinite", infinite, 0},
    {"off-axis tile", off_axis_tile, 0}, {"stereo", stereo, 0},
    {"left-handed", left_handed, 0},     {"orthographic", orthographic, 1},
    {"oblique near plane", oblique, 1},
};
enum { PROJECTIONS = sizeof projections / sizeof *projections };
enum { PERSPECTIVE = 0, ORTHOGRAPHIC = 5, OBLIQUE = 6 };

/* ---- evaluation ----------------------------------------------------------------------------------------------------
 */

static unsigned compile(nb_gl *gl)
{
    const int es = gl->language == NB_GL_300ES;
    const char *const texts[] = {
        "#define NEBEL_VIEW\n", nebel_shader_text(es ? NEBEL_DIALECT_GLSL_300_ES : NEBEL_DIALECT_GLSL_330), NULL};
    const unsigned program = nb_gl_compile_texts(gl, texts,
                                                 "nebel_sight s = nebel_see(in0.xy, in0.z);\n"
                                                 "out0 = vec4(s.origin, s.t_max); out1 = vec4(s.direction, 0.0);\n",
                                                 1, 2);
    if (program == 0) fail_msg("%s", gl->fault);
    return program;
}

static float inputs[COUNT][INPUTS], outputs[COUNT][OUTPUTS];

static void see(nb_gl *gl, unsigned program, const nebel_rays *rays)
{
    glUseProgram(program);
    glUniform4fv(glGetUniformLocation(program, "nebel_rays"), NEBEL_RAY_WORDS, rays->words[0].v);
    if (!nb_gl_evaluate(gl, program, COUNT, &inputs[0][0], &outputs[0][0])) fail_msg("%s", gl->fault);
}

static double random_number(double from, double to)
{
    static uint64_t state = 1;
    state = state * 6364136223846793005u + 1442695040888963407u;
    return from + (to - from) * (double)(state >> 11) * 0x1p-53;
}

/* The point of the world at normalized depth n behind a pixel. */
static void unproject(const nebel_view *view, const float pixel[2], double n, long double point[3])
{
    const double device[4] = {2 * (double)pixel[0] / view->width - 1, 2 * (double)pixel[1] / view->height - 1, n, 1};
    matrix clip, eye;
    memcpy(clip.m, view->clip_from_eye, sizeof clip.m);
    memcpy(eye.m, view->eye_from_world, sizeof eye.m);
    long double in_eye[4], in_world[4];
    solve(clip, device, in_eye);
    double middle[4];
    for (int i = 0; i < 4; i++) middle[i] = (double)(in_eye[i] / in_eye[3]);
    solve(eye, middle, in_world);
    for (int i = 0; i < 3; i++) point[i] = in_world[i];
}

/* Errors of the point that was hit, across the ray and along it, relative to its distance from the eye. */
typedef struct miss {
    double across, along, distance;
} miss;

static miss miss_of(const nebel_rays *rays, int i, const long double point[3])
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
    length = sqrt(length);
    return (miss){sqrt(beside) / length, fabs((double)outputs[i][3] - along) / length, length};
}

/* ---- tests ---------------------------------------------------------------------------------------------------------
 */

static nebel_view make_view(int projection, range r)
{
    nebel_view view = {.width = WIDTH, .height = HEIGHT};
    memcpy(view.clip_from_eye, projections[projection].make(r).m, sizeof view.clip_from_eye);
    memcpy(view.eye_from_world, view_matrix().m, sizeof view.eye_from_world);
    return view;
}

/* Stored depths of points between 2 and 200 m away, through the matrix and the depth range, as floats. */
static void fill_window(const nebel_view *view, range r, double first, double last)
{
    for (int i = 0; i < COUNT;) {
        const double away = 2 * pow(100, random_number(0, 1));
        const double z = view->clip_from_eye[11] > 0 ? away : -away, size = view->clip_from_eye[15] == 1 ? 40 : away;
        const double eye[4] = {random_number(-2, 2) * size, random_number(-2, 2) * size, z, 1};
        double clip[4] = {0};
        for (int k = 0; k < 16; k++) clip[k % 4] += view->clip_from_eye[k] * eye[k / 4];
        const double x = clip[0] / clip[3], y = clip[1] / clip[3], n = clip[2] / clip[3];
        if (fabs(x) > 1 || fabs(y) > 1 || n < r.low || n > 1) continue;
        inputs[i][0] = (float)((x + 1) / 2 * view->width);
        inputs[i][1] = (float)((y + 1) / 2 * view->height);
        inputs[i++][2] = (float)(first + (last - first) * (n - r.low) / (1 - r.low));
    }
}

static double normalized(range r, double first, double last, double stored)
{
    return r.low + (1 - r.low) * (stored - first) / (last - first);
}

/* How far the point moves, relative to its distance, with four steps of a float of depth. */
static double four_steps(const nebel_view *view, const float *input, double n, double distance)
{
    long double here[3], there[3];
    unproject(view, input, n, here);
    unproject(view, input, n - 4 * 0x1p-24, there);
    return (double)sqrtl(powl(here[0] - there[0], 2) + powl(here[1] - there[1], 2) + powl(here[2] - there[2], 2)) /
           distance;
}

static void check_window(nb_gl *gl, unsigned program, int projection, range r, double first, double last)
{
    const nebel_view view = make_view(projection, r);
    const nebel_depth_desc depth = {.zero_to_one = r.low == 0, .range = {first, last}};
    nebel_rays rays;
    miss worst = {0, 0, 0};
    assert_int_equal(nebel_view_rays(&view, &depth, &rays), NEBEL_OK);
    fill_window(&view, r, first, last);
    see(gl, program, &rays);
    for (int i = 0; i < COUNT; i++) {
        long double point[3];
        const double n = normalized(r, first, last, (double)inputs[i][2]);
        unproject(&view, inputs[i], n, point);
        const miss m = miss_of(&rays, i, point);
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

/* ---- depth in metres, logarithms, sky, starts ----------------------------------------------------------------------
 */

/* The same pixels with another kind of depth, made from the points that window depth gave. */
static void check_kind(nb_gl *gl, unsigned program, int projection, const nebel_depth_desc *depth)
{
    static float window[COUNT][OUTPUTS];
    const nebel_view view = make_view(projection, (range){-1, 0});
    nebel_rays rays;
    assert_int_equal(nebel_view_rays(&view, NULL, &rays), NEBEL_OK);
    fill_window(&view, (range){-1, 0}, 0, 1);
    see(gl, program, &rays);
    memcpy(window, outputs, sizeof window);
    for (int i = 0; i < COUNT; i++) {
        const double *const row = view.eye_from_world;
        double z = 0;
        for (int k = 0; k < 3; k++)
            z += row[4 * k + 2] * ((double)window[i][k] + (double)window[i][3] * (double)window[i][4 + k]);
        inputs[i][2] = depth->kind == NEBEL_DEPTH_KIND_DISTANCE ? window[i][3]
                       : depth->kind == NEBEL_DEPTH_KIND_AXIS
                           ? (float)-z
                           : (float)(log1p(depth->log_scale * -z) / log1p(depth->log_scale * depth->log_far));
    }
    assert_int_equal(nebel_view_rays(&view, depth, &rays), NEBEL_OK);
    see(gl, program, &rays);
    for (int i = 0; i < COUNT; i++) {
        double square = 0;
        for (int k = 0; k < 3; k++) square += pow((double)(window[i][k] + window[i][3] * window[i][4 + k]), 2);
        assert_true(fabs((double)(outputs[i][3] - window[i][3])) < 2e-6 * sqrt(square));
        assert_memory_equal(outputs[i] + 4, window[i] + 4, 3 * sizeof(float));
        assert_memory_equal(outputs[i], window[i], 3 * sizeof(float));
    }
}

static void check_kinds(nb_gl *gl, unsigned program)
{
    const nebel_depth_desc axis = {.kind = NEBEL_DEPTH_KIND_AXIS}, distance = {.kind = NEBEL_DEPTH_KIND_DISTANCE};
    const nebel_depth_desc logarithm = {.kind = NEBEL_DEPTH_KIND_LOGARITHM, .log_scale = .5, .log_far = 1e5};
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
    assert_int_equal(nebel_view_rays(&view, depth, &rays), NEBEL_OK);
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
    const nebel_depth_desc wall = {.sky = NEBEL_SKY_NONE}, value = {.sky = NEBEL_SKY_VALUE, .sky_depth = .5};
    const nebel_depth_desc axis = {.kind = NEBEL_DEPTH_KIND_AXIS};
    assert_true(length_at(gl, program, PERSPECTIVE, usual, &none, 1) == endless);
    assert_true(length_at(gl, program, PERSPECTIVE, usual, &none, 1 - 0x1p-24f) < 1000);
    assert_true(length_at(gl, program, PERSPECTIVE, reversed, &zero_to_one, 0) == endless);
    assert_true(length_at(gl, program, PERSPECTIVE, reversed, &zero_to_one, 1) < .1001);
    assert_true(length_at(gl, program, 1, reversed, &zero_to_one, 0) == endless);
    assert_true(fabs(length_at(gl, program, PERSPECTIVE, usual, &wall, 1) - 1000) < 1e-3);
    assert_true(length_at(gl, program, 1, usual, &wall, 1) == endless);
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
    const nebel_depth_desc near = {.start = NEBEL_START_NEAR}, eye = {0};
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
    assert_int_equal(nebel_view_rays(view, depth, &rays), NEBEL_ERROR_ARGUMENT);
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
    assert_int_equal(nebel_view_rays(&view, NULL, NULL), NEBEL_ERROR_ARGUMENT);
    assert_int_equal(nebel_view_rays(NULL, NULL, &rays), NEBEL_ERROR_ARGUMENT);
    view.width = 0;
    expect_refusal(&view, NULL);
    view.width = 65537;
    expect_refusal(&view, NULL);
    for (int i = 0; i < 16; i++) {
        refuse_view_with(1, i, NAN);
        refuse_view_with(0, i, INFINITY);
    }
    refuse_view_with(1, 0, 0);  /* no width */
    refuse_view_with(1, 11, 0); /* w is 0 everywhere */
    refuse_view_with(1, 14, 0); /* the eye has no depth */
    refuse_view_with(0, 3, .1); /* a projection in place of a view */
    refuse_view_with(0, 15, 2);
    const nebel_view zero = {.width = 8, .height = 8};
    expect_refusal(&zero, NULL);
}

static void test_what_is_no_convention_is_refused(void **state)
{
    (void)state;
    const nebel_view view = make_view(PERSPECTIVE, (range){-1, 0}), parallel = make_view(ORTHOGRAPHIC, (range){-1, 0});
    const nebel_depth_desc wrong[] = {
        {.kind = NEBEL_DEPTH_KIND_COUNT},
        {.sky = (nebel_sky)7},
        {.start = (nebel_start)-1},
        {.range = {1, 1}},
        {.range = {0, NAN}},
        {.kind = NEBEL_DEPTH_KIND_LOGARITHM},
        {.kind = NEBEL_DEPTH_KIND_LOGARITHM, .log_far = INFINITY},
        {.kind = NEBEL_DEPTH_KIND_LOGARITHM, .log_far = 10, .log_scale = -1},
    };
    const nebel_depth_desc logarithm = {.kind = NEBEL_DEPTH_KIND_LOGARITHM, .log_far = 10};
    nebel_rays rays;
    for (size_t i = 0; i < sizeof wrong / sizeof *wrong; i++) expect_refusal(&view, &wrong[i]);
    assert_int_equal(nebel_view_rays(&view, &logarithm, &rays), NEBEL_OK);
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
