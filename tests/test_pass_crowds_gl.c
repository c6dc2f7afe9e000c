/* Crowds in OpenGL and on the CPU: many volumes in one place, one of which excludes or replaces others, in sunlight, and
 * among point lights. On Mesa's llvmpipe their rays take many times the turns of loops that a fragment has there. */
#include <math.h>
#include <stdio.h>

#include "crowd_help.h"

#include <epoxy/gl.h>

enum { WIDTH = 24, HEIGHT = 16, PIXELS = WIDTH * HEIGHT };

typedef struct split {
    float in_scattering[4 * PIXELS], transmittance[4 * PIXELS];
} split;

/* Returns how many messages there were. The picture may be smaller. */
static size_t draw(nebel_lighting *fog, const pass_picture *picture, nb_gl_language language, split *out)
{
    fog_messages messages = {.count = 0};
    nb_gl context;
    nebel_gl *gl = NULL;
    const int width = (int)picture->view.width, height = (int)picture->view.height;
    pass_open(&context, language);
    const int objects = pass_count_objects();
    assert_int_equal(nebel_create_gl(&(nebel_gl_desc){.host.log = fog_messages_log(&messages)}, &gl), NEBEL_OK);
    const unsigned depth = pass_depth_texture(width, height, picture->stored);
    const unsigned targets[] = {pass_color_texture(width, height, 4, NULL), pass_color_texture(width, height, 4, NULL)};
    const unsigned framebuffer = pass_framebuffer(targets[0], targets[1]);
    assert_int_equal(nebel_gl_set_fog(gl, fog, &picture->view), NEBEL_OK);
    assert_int_equal(nebel_gl_draw_fog(gl, &(nebel_gl_pass){.output = NEBEL_GL_OUTPUT_SPLIT, .depth_texture = depth}),
                     NEBEL_OK);
    pass_read(targets[0], width, height, out->in_scattering);
    pass_read(targets[1], width, height, out->transmittance);
    pass_delete_framebuffer(framebuffer);
    for (int i = 0; i < 2; i++) pass_delete_texture(targets[i]);
    pass_delete_texture(depth);
    nebel_destroy_gl(gl);
    assert_int_equal(pass_count_objects(), objects);
    pass_close(&context);
    return messages.count;
}

/* At most 3/255 anywhere, 1/255 on 999 of 1,000 pixels that have fog, of transmittance and of light; no message. The picture is
 * a `share` as wide and high. */
static void check(const crowd *c, const char *what, nb_gl_language language, int share)
{
    static split got;
    static pass_picture picture;
    const int width = WIDTH / share, height = HEIGHT / share;
    nebel_lighting *const fog = crowd_commit(c);
    pass_difference light = {0}, transmittance = {0};
    picture = (pass_picture){.view = pass_view(0, (range){-1, 0}, 0, 0), .clip = {-1, 0}};
    picture.view.width = (uint32_t)width;
    picture.view.height = (uint32_t)height;
    pass_fill(&picture);
    const size_t messages = draw(fog, &picture, language, &got);
    for (int i = 0; i < width * height; i++) {
        const nebel_transfer wanted = pass_trace(fog, &picture, i % width, i / width);
        const int fogged = wanted.transmittance[0] < 1;
        pass_note(&light, &got.in_scattering[4 * i], wanted.in_scattering, fogged);
        pass_note(&transmittance, &got.transmittance[4 * i], wanted.transmittance, fogged);
    }
    print_message("%zu %s: transmittance %.2g/255 off, light %.2g/255 (%zu and %zu of %zu pixels beyond 1/255)\n",
                  c->count, what, 255 * transmittance.largest, 255 * light.largest, transmittance.beyond_step,
                  light.beyond_step, light.fogged);
    assert_true(light.fogged > (size_t)(width * height / 2));
    assert_true(light.largest <= 3. / 255 && transmittance.largest <= 3. / 255);
    assert_true(light.beyond_step * 1000 <= light.fogged && transmittance.beyond_step * 1000 <= transmittance.fogged);
    assert_int_equal(messages, 0);
    nebel_release_lighting(fog);
}

static void test_balls_with_a_hole(void **state)
{
    (void)state;
    static const nebel_operation operations[] = {NEBEL_OPERATION_EXCLUDE, NEBEL_OPERATION_REPLACE};
    for (int i = 0; i < 2; i++) {
        static crowd c;
        c = (crowd){.count = 0};
        crowd_add_balls(&c, 70, 8);
        crowd_add_hole(&c, operations[i]);
        check(&c, i == 0 ? "balls, one excludes" : "balls, one replaces", i == 0 ? NB_GL_330 : NB_GL_300ES, 1);
    }
}

/* What takes the place of others does so where it is empty itself: here its density begins behind all of it. */
static void test_empty_hole(void **state)
{
    (void)state;
    static crowd c;
    c = (crowd){.count = 0};
    crowd_add_balls(&c, 1, 8);
    crowd_add_hole(&c, NEBEL_OPERATION_REPLACE);
    const double *const middle = c.volumes[1].shape.center;
    c.volumes[1].density = (nebel_density){.type = NEBEL_DENSITY_LINEAR,
                                           .from = {middle[0] + 2, middle[1], middle[2]},
                                           .to = {middle[0] + 3, middle[1], middle[2]}};
    check(&c, "ball with an empty hole", NB_GL_330, 1);
}

static void test_balls_in_sunlight(void **state)
{
    (void)state;
    for (size_t count = 20; count <= 40; count += 10) {
        static crowd c;
        c = (crowd){.count = 0};
        crowd_add_balls(&c, count, 4);
        crowd_set_sun(&c);
        check(&c, "balls in sunlight", NB_GL_330, 1);
    }
}

/* A slope of height fog in other such fog, both without end. */
static void add_slopes(crowd *c)
{
    for (int i = 0; i < 2; i++) {
        nebel_volume_desc *const v = &c->volumes[c->count++];
        *v = (nebel_volume_desc){.shape = {.type = NEBEL_SHAPE_WORLD}, .extinction = {.02, .02, .03}};
        v->density =
            (nebel_density){.type = NEBEL_DENSITY_HEIGHT, .base = pass_eye[1] - 2 * i, .scale_height = 4 + 3 * i};
        v->phase = (nebel_phase){.type = NEBEL_PHASE_HENYEY_GREENSTEIN, .g = .7};
        for (int k = 0; k < 3; k++) v->source[k] = .8 - .3 * i;
    }
}

/* Few, but of profiles over which light is walked in many legs, and of two leaves. */
static void test_few_uneven_in_sunlight(void **state)
{
    (void)state;
    static crowd c;
    static nebel_shape parts[2];
    c = (crowd){.count = 0};
    add_slopes(&c);
    crowd_add_balls(&c, 5, 4);
    for (size_t i = 2; i < c.count; i++) {
        nebel_volume_desc *const v = &c.volumes[i];
        const double *const middle = v->shape.center;
        v->density = (nebel_density){
            .type = NEBEL_DENSITY_GAUSSIAN, .center = {middle[0], middle[1], middle[2]}, .sigma = 1 + .2 * (double)i};
    }
    crowd_add_hole(&c, NEBEL_OPERATION_EXCLUDE);
    nebel_shape *const hole = &c.volumes[c.count - 1].shape;
    parts[0] = parts[1] = *hole;
    parts[1].center[0] += 1;
    *hole = (nebel_shape){.type = NEBEL_SHAPE_UNION, .parts = parts, .part_count = 2};
    crowd_set_sun(&c);
    check(&c, "uneven volumes in sunlight, two leaves exclude", NB_GL_330, 1);
}

static void test_even_boxes(void **state)
{
    (void)state;
    static const size_t counts[] = {300, CROWD_MOST};
    for (int i = 0; i < 2; i++) {
        static crowd c;
        c = (crowd){.count = 0};
        crowd_add_boxes(&c, counts[i], 8);
        check(&c, "boxes", NB_GL_330, counts[i] == CROWD_MOST ? 4 : 1);
    }
}

static void test_balls_among_lights(void **state)
{
    (void)state;
    static crowd c;
    c = (crowd){.count = 0};
    crowd_add_balls(&c, 40, 4);
    crowd_set_lights(&c);
    check(&c, "balls and two point lights", NB_GL_330, 1);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_balls_with_a_hole), cmocka_unit_test(test_empty_hole),
        cmocka_unit_test(test_balls_in_sunlight), cmocka_unit_test(test_few_uneven_in_sunlight),
        cmocka_unit_test(test_even_boxes),        cmocka_unit_test(test_balls_among_lights),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
