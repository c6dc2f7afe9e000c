/* Crowds that are drawn in one pass, where several would be needed: the log says so, once. */
#include <stdio.h>

#include "crowd_help.h"
#include "test_render_scene.h"

#include <epoxy/gl.h>
#include <nebel/gl.h>

#include "gl_errors.h"

enum { WIDTH = 12, HEIGHT = 8, SAMPLES = 4 };

static nebel_lighting *make_fog(void)
{
    static crowd c;
    c = (crowd){.count = 0};
    crowd_add_balls(&c, 70, 8);
    crowd_add_hole(&c, NEBEL_OPERATION_EXCLUDE);
    return crowd_commit(&c);
}

/* ---- several samples of a pixel -------------------------------------------------------------- */

/* Nothing is in it. */
static unsigned make_depth(void)
{
    unsigned name, framebuffer;
    glGenTextures(1, &name);
    glBindTexture(GL_TEXTURE_2D_MULTISAMPLE, name);
    glTexImage2DMultisample(GL_TEXTURE_2D_MULTISAMPLE, SAMPLES, GL_DEPTH_COMPONENT32F, WIDTH, HEIGHT, GL_TRUE);
    glGenFramebuffers(1, &framebuffer);
    glBindFramebuffer(GL_FRAMEBUFFER, framebuffer);
    glFramebufferTexture(GL_FRAMEBUFFER, GL_DEPTH_ATTACHMENT, name, 0);
    glClear(GL_DEPTH_BUFFER_BIT);
    pass_delete_framebuffer(framebuffer);
    return name;
}

static void test_several_samples(void **state)
{
    (void)state;
    nb_gl context;
    nebel_gl *gl = NULL;
    nebel_view view = pass_view(0, (range){-1, 0}, 0, 0);
    view.width = WIDTH;
    view.height = HEIGHT;
    pass_open(&context, NB_GL_330);
    nebel_lighting *const fog = make_fog();
    const unsigned depth = make_depth(), target = pass_color_texture(WIDTH, HEIGHT, 4, NULL),
                   second = pass_color_texture(WIDTH, HEIGHT, 4, NULL), framebuffer = pass_framebuffer(target, second);
    const nebel_gl_desc desc = {.host.log = fog_messages_log(&messages)};
    const nebel_gl_pass pass = {.output = NEBEL_GL_OUTPUT_SPLIT, .depth_texture = depth, .samples = SAMPLES};
    messages.count = 0;
    assert_int_equal(nebel_create_gl(&desc, &gl), NEBEL_OK);
    assert_int_equal(nebel_gl_set_fog(gl, fog, &view), NEBEL_OK);
    expect_message(nebel_gl_draw_fog(gl, &pass), NEBEL_OK, "several samples of a pixel");
    assert_int_equal(nebel_gl_draw_fog(gl, &pass), NEBEL_OK);
    assert_int_equal(messages.count, 0);
    nebel_destroy_gl(gl);
    pass_delete_framebuffer(framebuffer);
    pass_delete_texture(target);
    pass_delete_texture(second);
    pass_delete_texture(depth);
    nebel_release_lighting(fog);
    pass_close(&context);
}

/* ---- scenes ---------------------------------------------------------------------------------- */

/* Of two frames; `message` NULL: there is none. */
static void check_frames(const nebel_scene_data *scene, const nebel_particle *particle, const char *message)
{
    nb_gl context;
    nebel_gl_renderer *renderer = NULL;
    nebel_lighting *const fog = make_fog();
    const nebel_gl_renderer_desc desc = {.host.log = fog_messages_log(&messages)};
    const nebel_gl_frame_desc frame = {
        .camera = test_camera(pass_eye[0], pass_eye[1], pass_eye[2], pass_eye[0], pass_eye[1], pass_eye[2] - 6),
        .width = WIDTH,
        .height = HEIGHT,
        .samples = 1};
    messages.count = 0;
    pass_open(&context, NB_GL_330);
    assert_int_equal(nebel_create_gl_renderer(scene, fog, &desc, &renderer), NEBEL_OK);
    assert_int_equal(nebel_set_gl_renderer_particles(renderer, particle, particle != NULL), NEBEL_OK);
    for (int i = 0; i < 2; i++) {
        const nebel_result result = nebel_gl_render_frame(renderer, &frame);
        assert_int_equal(result, NEBEL_OK);
        if (message != NULL && i == 0) expect_message(result, NEBEL_OK, message);
        assert_int_equal(messages.count, 0);
    }
    nebel_destroy_gl_renderer(renderer);
    nebel_release_lighting(fog);
    pass_close(&context);
}

static void test_nothing_else(void **state)
{
    (void)state;
    static const nebel_scene_data scene = {.background = {.1, .2, .3}};
    check_frames(&scene, NULL, NULL);
}

static void test_particles(void **state)
{
    (void)state;
    static const nebel_scene_data scene = {.background = {.1, .2, .3}};
    const nebel_particle particle = {
        .center = {pass_eye[0], pass_eye[1], pass_eye[2] - 6}, .radius = 1, .extinction = {1, 1, 1}};
    check_frames(&scene, &particle, "particles ask in one pass");
}

static void test_air_of_a_planet(void **state)
{
    (void)state;
    nebel_atmosphere *air = NULL;
    nebel_planet planet = {
        .atmosphere_desc = *nebel_lookup_atmosphere("toy"), .sun_angular_diameter = .5, .sun_left = {1, 1, 1}};
    for (int i = 0; i < 3; i++) planet.atmosphere_desc.ground_point[i] = pass_eye[i] - (i == 1 ? 20 : 0);
    assert_int_equal(nebel_create_atmosphere(&planet.atmosphere_desc, &air), NEBEL_OK);
    planet.atmosphere = air;
    const nebel_scene_data scene = {
        .has_sun = 1, .sun_direction = {.6, .8, 0}, .sun_irradiance = {3, 3, 3}, .planet_count = 1, .planets = &planet};
    check_frames(&scene, NULL, "pieces of air");
    nebel_destroy_atmosphere(air);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_several_samples),
        cmocka_unit_test(test_nothing_else),
        cmocka_unit_test(test_particles),
        cmocka_unit_test(test_air_of_a_planet),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
