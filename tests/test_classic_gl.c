/* Fog factors against the fixed pipeline of a real OpenGL: fog is black, surfaces are white, so that a pixel is the
 * factor, read as floats and as bytes.
 *
 * Mesa 22 departs from the specification in three places, which are left out: glFogCoord of a number below 0 fogs as
 * its absolute value; the sum of the primary and the secondary colour is not clamped before fog; the radial distance of
 * GL_NV_fog_distance is found per vertex and interpolated, so that it is asked at vertices alone. LINEAR fog with
 * start == end has no value in OpenGL. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "fog_help.h"
#include "pass_help.h"

#include <epoxy/gl.h>
#include <nebel/classic.h>

enum { SIZE = 32, PIXELS = SIZE * SIZE };

static const double float_tolerance = 1e-5;
/* Half a step, and what the float before it may be off. */
static const double byte_tolerance = .5 + 255 * 1e-5;

/* ---- the target ------------------------------------------------------------------------------ */

/* One picture in two formats. */
typedef struct stage {
    nb_gl context;
    unsigned textures[2], framebuffers[2]; /* RGBA32F, RGBA8 */
} stage;

static unsigned make_target(GLenum internal, unsigned *texture)
{
    glGenTextures(1, texture);
    glBindTexture(GL_TEXTURE_2D, *texture);
    glTexImage2D(GL_TEXTURE_2D, 0, (GLint)internal, SIZE, SIZE, 0, GL_RGBA, GL_FLOAT, NULL);
    glBindTexture(GL_TEXTURE_2D, 0);
    return pass_framebuffer(*texture, 0);
}

/* 90 degrees wide: the eye sees x and y from z to -z. Where there is no OpenGL the test is left out, but in CI. */
static void open_stage(stage *s)
{
    if (!nb_gl_open(&s->context, NB_GL_COMPATIBILITY)) {
        if (getenv("CI") != NULL) fail_msg("%s", s->context.fault);
        print_message("left out: no OpenGL with a compatibility profile: %s\n", s->context.fault);
        skip();
    }
    nb_gl_close(&s->context);
    pass_open(&s->context, NB_GL_COMPATIBILITY);
    s->framebuffers[0] = make_target(GL_RGBA32F, &s->textures[0]);
    s->framebuffers[1] = make_target(GL_RGBA8, &s->textures[1]);
    glViewport(0, 0, SIZE, SIZE);
    glMatrixMode(GL_PROJECTION);
    glFrustum(-.01, .01, -.01, .01, .01, 1000);
    glMatrixMode(GL_MODELVIEW);
    glDisable(GL_DITHER);
    glEnable(GL_FOG);
    glFogfv(GL_FOG_COLOR, (const GLfloat[4]){0, 0, 0, 1});
    glColor4f(1, 1, 1, .25f);
}

static void close_stage(stage *s)
{
    for (int i = 0; i < 2; i++) {
        pass_delete_framebuffer(s->framebuffers[i]);
        pass_delete_texture(s->textures[i]);
    }
    pass_close(&s->context);
}

/* ---- states and places ----------------------------------------------------------------------- */

static void set_fog(const nebel_factor_desc *d)
{
    const GLint modes[NEBEL_FACTOR_COUNT] = {
        [NEBEL_FACTOR_EXP] = GL_EXP, [NEBEL_FACTOR_EXP2] = GL_EXP2, [NEBEL_FACTOR_LINEAR] = GL_LINEAR};
    glFogi(GL_FOG_MODE, modes[d->mode]);
    glFogf(GL_FOG_START, (GLfloat)d->start);
    glFogf(GL_FOG_END, (GLfloat)d->end);
    glFogf(GL_FOG_DENSITY, (GLfloat)d->density);
}

/* Of floats, which is what OpenGL takes. Fog that thins with the distance among them. */
static nebel_factor_desc random_desc(uint64_t *seed, nebel_factor_mode mode, nebel_factor_coordinate coordinate)
{
    nebel_factor_desc d = {.mode = mode, .coordinate = coordinate};
    d.start = (double)(float)dice(seed, -2, 12);
    d.end = (double)(float)(d.start + (dice_below(seed, 2) ? dice(seed, 1, 20) : dice(seed, -20, -1)));
    d.density = (double)(float)dice(seed, .02, .4);
    assert_int_equal(nebel_resolve_factor(&d, &d), NEBEL_OK);
    return d;
}

/* A place for each pixel, which its middle shows, and a number that goes with it. */
typedef struct points {
    float place[PIXELS][3], user[PIXELS];
} points;

static void fill_points(points *p, uint64_t *seed)
{
    for (int i = 0; i < PIXELS; i++) {
        const double depth = dice(seed, .05, 40);
        p->place[i][0] = (float)(depth * (2 * (i % SIZE + .5) / SIZE - 1));
        p->place[i][1] = (float)(depth * (2 * (i / SIZE + .5) / SIZE - 1));
        p->place[i][2] = (float)-depth;
        p->user[i] = (float)dice(seed, 0, 30);
    }
}

static void draw_points(const points *p)
{
    glBegin(GL_POINTS);
    for (int i = 0; i < PIXELS; i++) {
        glFogCoordf(p->user[i]);
        glVertex3fv(p->place[i]);
    }
    glEnd();
}

/* ---- comparison ------------------------------------------------------------------------------ */

typedef struct difference {
    double as_float, as_byte; /* the largest; bytes in steps */
    size_t between;           /* factors that are neither 0 nor 1 */
} difference;

/* What has been drawn last, in both targets, against factors. */
static void compare(const stage *s, const double *wanted, difference *d)
{
    static float floats[PIXELS][4];
    static uint8_t bytes[PIXELS][4];
    glBindFramebuffer(GL_FRAMEBUFFER, s->framebuffers[0]);
    glReadPixels(0, 0, SIZE, SIZE, GL_RGBA, GL_FLOAT, floats);
    glBindFramebuffer(GL_FRAMEBUFFER, s->framebuffers[1]);
    glReadPixels(0, 0, SIZE, SIZE, GL_RGBA, GL_UNSIGNED_BYTE, bytes);
    for (int i = 0; i < PIXELS; i++) {
        d->as_float = fmax(d->as_float, fabs((double)floats[i][0] - wanted[i]));
        d->as_byte = fmax(d->as_byte, fabs(bytes[i][0] - 255 * wanted[i]));
        d->between += wanted[i] > 0 && wanted[i] < 1;
        assert_true(floats[i][3] == .25f && !isnan(floats[i][0]));
    }
}

static void expect_close(const difference *d, const char *what)
{
    print_message("%s: off by at most %.1e as float, %.4f of a step as byte; %zu factors between 0 and 1\n", what,
                  d->as_float, d->as_byte, d->between);
    assert_true(d->between > 1000);
    assert_true(d->as_float <= float_tolerance);
    assert_true(d->as_byte <= byte_tolerance);
}

static void draw_points_twice(const stage *s, const points *p)
{
    for (int i = 0; i < 2; i++) {
        glBindFramebuffer(GL_FRAMEBUFFER, s->framebuffers[i]);
        glClear(GL_COLOR_BUFFER_BIT);
        draw_points(p);
    }
}

/* ---- tests ----------------------------------------------------------------------------------- */

/* What the driver is told to take for c, and what that is in nebel. */
typedef enum distance_kind { PLANE, PLANE_SIGNED, RADIAL, FOG_COORD, DISTANCES } distance_kind;

static double coordinate_of(const nebel_factor_desc *d, distance_kind kind, const points *p, int i)
{
    const double place[3] = {(double)p->place[i][0], (double)p->place[i][1], (double)p->place[i][2]};
    return nebel_compute_fog_coordinate(d, place, kind == PLANE_SIGNED ? place[2] : (double)p->user[i]);
}

static void choose_distance(distance_kind kind)
{
    const GLint modes[DISTANCES] = {GL_EYE_PLANE_ABSOLUTE_NV, GL_EYE_PLANE, GL_EYE_RADIAL_NV, GL_EYE_PLANE_ABSOLUTE_NV};
    glFogi(GL_FOG_COORDINATE_SOURCE, kind == FOG_COORD ? GL_FOG_COORDINATE : GL_FRAGMENT_DEPTH);
    if (epoxy_has_gl_extension("GL_NV_fog_distance")) glFogi(GL_FOG_DISTANCE_MODE_NV, modes[kind]);
}

static void check_factors(const stage *s, nebel_factor_mode mode, distance_kind kind, const char *what)
{
    static const nebel_factor_coordinate coordinates[DISTANCES] = {NEBEL_COORDINATE_PLANE, NEBEL_COORDINATE_USER,
                                                                   NEBEL_COORDINATE_RADIAL, NEBEL_COORDINATE_USER};
    static points p;
    static double wanted[PIXELS];
    uint64_t seed = 11 + (uint64_t)mode;
    difference d = {0};
    choose_distance(kind);
    for (int turn = 0; turn < 12; turn++) {
        const nebel_factor_desc desc = random_desc(&seed, mode, coordinates[kind]);
        fill_points(&p, &seed);
        set_fog(&desc);
        draw_points_twice(s, &p);
        for (int i = 0; i < PIXELS; i++) wanted[i] = nebel_compute_fog_factor(&desc, coordinate_of(&desc, kind, &p, i));
        compare(s, wanted, &d);
    }
    expect_close(&d, what);
}

static void check_modes(distance_kind kind, const char *what)
{
    static const char *const names[NEBEL_FACTOR_COUNT] = {"EXP", "EXP2", "LINEAR"};
    stage s;
    char text[64];
    open_stage(&s);
    if (kind == PLANE_SIGNED || kind == RADIAL) assert_true(epoxy_has_gl_extension("GL_NV_fog_distance"));
    for (int mode = 0; mode < NEBEL_FACTOR_COUNT; mode++) {
        snprintf(text, sizeof text, "%s, %s", what, names[mode]);
        check_factors(&s, (nebel_factor_mode)mode, kind, text);
    }
    close_stage(&s);
}

static void test_depth(void **state)
{
    (void)state;
    check_modes(PLANE, "depth");
}

static void test_fog_coordinate(void **state)
{
    (void)state;
    check_modes(FOG_COORD, "glFogCoord");
}

static void test_radial_distance(void **state)
{
    (void)state;
    check_modes(RADIAL, "GL_EYE_RADIAL_NV");
}

/* z is negative before the eye: exponential fog is none there, and LINEAR fog may begin behind it. */
static void test_signed_plane(void **state)
{
    (void)state;
    stage s;
    open_stage(&s);
    check_factors(&s, NEBEL_FACTOR_LINEAR, PLANE_SIGNED, "GL_EYE_PLANE, LINEAR");
    close_stage(&s);
}

/* {0} of nebel is what a new context has. */
static void test_defaults(void **state)
{
    (void)state;
    stage s;
    nebel_factor_desc d;
    GLfloat density, start, end;
    GLint mode;
    assert_int_equal(nebel_resolve_factor(&(nebel_factor_desc){0}, &d), NEBEL_OK);
    open_stage(&s);
    glGetIntegerv(GL_FOG_MODE, &mode);
    glGetFloatv(GL_FOG_DENSITY, &density);
    glGetFloatv(GL_FOG_START, &start);
    glGetFloatv(GL_FOG_END, &end);
    assert_true(mode == GL_EXP && d.mode == NEBEL_FACTOR_EXP);
    assert_true((double)density == d.density && (double)start == d.start && (double)end == d.end);
    close_stage(&s);
}

/* A plane that falls away from the eye: y = slope z + height, seen through the middle of pixel i. */
static const double slope = .35, height = -3;

static double plane_depth(int i)
{
    const double y = 2 * (i / SIZE + .5) / SIZE - 1;
    return height / (y + slope);
}

static void plane_vertex(double x, double depth, double coordinate)
{
    glFogCoordf((GLfloat)coordinate);
    glVertex3d(x * depth, -slope * depth + height, -depth);
}

/* The plane from 0.5 m to 60 m before the eye, far beyond the picture's sides; 0 where a pixel is not in it. */
static void draw_plane(const stage *s, double near_coordinate, double far_coordinate)
{
    for (int i = 0; i < 2; i++) {
        glBindFramebuffer(GL_FRAMEBUFFER, s->framebuffers[i]);
        glClear(GL_COLOR_BUFFER_BIT);
        glBegin(GL_QUADS);
        plane_vertex(-20, .5, near_coordinate);
        plane_vertex(20, .5, near_coordinate);
        plane_vertex(20, 60, far_coordinate);
        plane_vertex(-20, 60, far_coordinate);
        glEnd();
    }
}

static int is_in_plane(int i)
{
    const double depth = plane_depth(i);
    return depth > .5 && depth < 60;
}

/* Within a polygon OpenGL evaluates per fragment: the factor of the place that the pixel shows. */
static void test_inside_a_polygon(void **state)
{
    (void)state;
    static double wanted[PIXELS];
    stage s;
    uint64_t seed = 3;
    difference d = {0};
    open_stage(&s);
    glClearColor(0, 0, 0, .25f);
    for (int turn = 0; turn < 9; turn++) {
        const nebel_factor_desc desc =
            random_desc(&seed, (nebel_factor_mode)(turn % NEBEL_FACTOR_COUNT), NEBEL_COORDINATE_PLANE);
        set_fog(&desc);
        draw_plane(&s, 0, 0);
        for (int i = 0; i < PIXELS; i++)
            wanted[i] = is_in_plane(i) ? nebel_compute_fog_factor(&desc, plane_depth(i)) : 0;
        compare(&s, wanted, &d);
    }
    expect_close(&d, "depth inside a polygon");
    close_stage(&s);
}

/* LINEAR fog from 1 to 0 makes the coordinate the factor: factors of vertices, which OpenGL interpolates as a
 * perspective-correct number. The factor of a vertex is nebel's, of the stage VERTEX. */
static void test_factors_of_vertices(void **state)
{
    (void)state;
    static double wanted[PIXELS];
    stage s;
    uint64_t seed = 5;
    difference d = {0};
    open_stage(&s);
    glClearColor(0, 0, 0, .25f);
    glFogi(GL_FOG_COORDINATE_SOURCE, GL_FOG_COORDINATE);
    set_fog(&(nebel_factor_desc){.mode = NEBEL_FACTOR_LINEAR, .start = 1, .end = 0, .density = 1});
    for (int turn = 0; turn < 9; turn++) {
        nebel_factor_desc desc =
            random_desc(&seed, (nebel_factor_mode)(turn % NEBEL_FACTOR_COUNT), NEBEL_COORDINATE_PLANE);
        desc.stage = NEBEL_STAGE_VERTEX;
        const double near = nebel_compute_fog_factor(&desc, .5), far = nebel_compute_fog_factor(&desc, 60);
        draw_plane(&s, near, far);
        for (int i = 0; i < PIXELS; i++)
            wanted[i] = is_in_plane(i) ? near + (plane_depth(i) - .5) / 59.5 * (far - near) : 0;
        compare(&s, wanted, &d);
    }
    expect_close(&d, "factors of vertices");
    close_stage(&s);
}

/* Colours: the fog's alpha does not count, the surface's stays. */
static void test_blending(void **state)
{
    (void)state;
    stage s;
    uint64_t seed = 9;
    open_stage(&s);
    glBindFramebuffer(GL_FRAMEBUFFER, s.framebuffers[0]);
    for (int turn = 0; turn < 50; turn++) {
        const nebel_factor_desc desc = random_desc(&seed, NEBEL_FACTOR_EXP, NEBEL_COORDINATE_PLANE);
        float surface[4], fog[4], got[4], out[4];
        for (int c = 0; c < 4; c++) surface[c] = (float)dice(&seed, 0, 1), fog[c] = (float)dice(&seed, 0, 1);
        const double depth = dice(&seed, .1, 20);
        set_fog(&desc);
        glFogfv(GL_FOG_COLOR, fog);
        glColor4fv(surface);
        glBegin(GL_POINTS);
        glVertex3d(depth / SIZE, depth / SIZE, -depth);
        glEnd();
        glReadPixels(SIZE / 2, SIZE / 2, 1, 1, GL_RGBA, GL_FLOAT, got);
        const double factor = nebel_compute_fog_factor(&desc, (double)(float)depth);
        nebel_blend_fog_factor(factor, surface, (const double[3]){(double)fog[0], (double)fog[1], (double)fog[2]}, out);
        for (int c = 0; c < 3; c++) assert_true(fabs((double)(got[c] - out[c])) <= float_tolerance);
        assert_true(got[3] == surface[3]);
    }
    close_stage(&s);
}

/* EXP2 as it was once printed, exp((-density z)^2), grows: its factor is 1 everywhere, and no driver has it. */
static void test_printed_exp2_is_not_opengls(void **state)
{
    (void)state;
    static points p;
    static double wanted[PIXELS];
    stage s;
    uint64_t seed = 2;
    difference d = {0};
    open_stage(&s);
    const nebel_factor_desc desc = random_desc(&seed, NEBEL_FACTOR_EXP2, NEBEL_COORDINATE_PLANE);
    fill_points(&p, &seed);
    set_fog(&desc);
    draw_points_twice(&s, &p);
    for (int i = 0; i < PIXELS; i++) wanted[i] = fmin(1, exp(pow(-desc.density * (double)p.place[i][2], 2)));
    compare(&s, wanted, &d);
    assert_true(d.as_float > .9);
    close_stage(&s);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_depth),
        cmocka_unit_test(test_fog_coordinate),
        cmocka_unit_test(test_radial_distance),
        cmocka_unit_test(test_signed_plane),
        cmocka_unit_test(test_defaults),
        cmocka_unit_test(test_inside_a_polygon),
        cmocka_unit_test(test_factors_of_vertices),
        cmocka_unit_test(test_blending),
        cmocka_unit_test(test_printed_exp2_is_not_opengls),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
