/* The scene renderer's rules: what it refuses, which state it leaves, what samples, textures and shadows look like. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "odd_state.h"
#include "pass_help.h"
#include "picture_help.h"
#include "test_render_scene.h"

#include <epoxy/gl.h>

enum { WIDTH = 96, HEIGHT = 64 };

static const nb_gl_language languages[] = {NB_GL_330, NB_GL_300ES};

static void set_stage(test_stage *s, const double center[3])
{
    test_stage_set(s, center, (const double[3]){3, 2, 5});
}

static nebel_gl_renderer *make_renderer(const test_stage *s)
{
    nebel_gl_renderer *renderer = NULL;
    assert_int_equal(nebel_create_gl_renderer(&s->ball.scene, s->fog, &(nebel_gl_renderer_desc){0}, &renderer),
                     NEBEL_OK);
    return renderer;
}

static nebel_gl_frame_desc frame_of(const test_stage *s, uint32_t samples)
{
    return (nebel_gl_frame_desc){.camera = s->camera, .width = WIDTH, .height = HEIGHT, .samples = samples};
}

static void draw(nebel_gl_renderer *renderer, const test_stage *s, uint32_t samples, float *color)
{
    const nebel_gl_frame_desc desc = frame_of(s, samples);
    assert_int_equal(nebel_gl_render_frame(renderer, &desc), NEBEL_OK);
    assert_int_equal(nebel_gl_read_planes(renderer, &(nebel_gl_planes){.color = color}), NEBEL_OK);
}

/* ---- tests ----------------------------------------------------------------------------------- */

/* Smooth normals, textures, shadows and fog in the sun's light, near the origin and far out. */
static void test_light_is_that_of_the_cpu(void **state)
{
    (void)state;
    static test_stage s;
    static const double centers[2][3] = {{0, 0, 0}, {1e7, -3e6, 5e6}};
    for (int i = 0; i < 2; i++) {
        nb_gl context;
        picture_pair pair = picture_make(WIDTH, HEIGHT);
        set_stage(&s, centers[i]);
        pass_open(&context, languages[i]);
        picture_render(&s.ball.scene, s.fog, &s.camera, 1, &pair);
        pass_close(&context);
        const picture_difference d = picture_compare(&pair, 1);
        print_message("%zu pixels with fog, %zu beyond 1/255, worst %.2g/255, color %.2g\n", d.fogged, d.beyond_step,
                      255 * d.largest, d.color);
        assert_int_equal(d.fogged, WIDTH * HEIGHT);
        assert_true(d.largest < .1 / 255);
        assert_true(d.color < .02);
        picture_free(&pair);
        nebel_release_lighting(s.fog);
    }
}

/* Holes and their shadows are the CPU's but for a texel's 256th and the texels of shadow maps. */
static void test_holes_are_those_of_the_cpu(void **state)
{
    (void)state;
    static test_card card;
    static const nebel_projection looks[] = {NEBEL_PROJECTION_PERSPECTIVE, NEBEL_PROJECTION_PANORAMA};
    test_card_make(&card, 1.5f);
    for (int i = 0; i < 2; i++) {
        nb_gl context;
        size_t through = 0, on = 0, other = 0, dark = 0, lit = 0, shaded = 0;
        nebel_camera camera = test_camera(1, 5, 4, 0, 1, 0);
        picture_pair pair = picture_make(WIDTH, HEIGHT);
        camera.projection = looks[i];
        pass_open(&context, languages[i]);
        picture_render(&card.scene, NULL, &camera, 1, &pair);
        pass_close(&context);
        for (size_t p = 0; p < (size_t)WIDTH * HEIGHT; p++) {
            const float wanted = pair.cpu.depth[p], got = pair.gl.depth[p];
            if (!isfinite(wanted) || !isfinite(got) || fabsf(got - wanted) > .01f * wanted) {
                other += isfinite(wanted) != 0 || isfinite(got) != 0;
                continue;
            }
            const float height = pair.cpu.normal[3 * p + 1];
            through += wanted > 6 && height > 0;
            on += wanted < 6 && height > 0;
            dark += pair.cpu.color[3 * p] == 0;
            lit += pair.cpu.color[3 * p] > 0;
            shaded += fabsf(pair.cpu.color[3 * p] - pair.gl.color[3 * p]) > .1f;
        }
        print_message("%zu pixels beyond the card, %zu on it, %zu dark, %zu lit; %zu elsewhere, %zu in other light\n",
                      through, on, dark, lit, other, shaded);
        assert_true(dark > 20 && lit > 400 && other <= 20 && shaded < dark / 4);
        picture_free(&pair);
    }
}

/* Also where the sun is behind the triangle, but not behind the normal; a panorama has triangles of its own. */
static void test_light_fades_evenly_on_a_coarse_column(void **state)
{
    (void)state;
    static test_barrel barrel;
    static const nebel_projection looks[] = {NEBEL_PROJECTION_PERSPECTIVE, NEBEL_PROJECTION_PANORAMA};
    test_barrel_make(&barrel);
    for (int i = 0; i < 2; i++) {
        nb_gl context;
        nebel_camera camera = test_camera(.5, .3, 3, 0, 0, 0);
        picture_pair pair = picture_make(WIDTH, HEIGHT);
        camera.projection = looks[i];
        pass_open(&context, languages[i]);
        picture_render(&barrel.scene, NULL, &camera, 1, &pair);
        pass_close(&context);
        assert_true(test_barrel_error(&barrel, pair.gl.color, pair.gl.normal, (size_t)WIDTH * HEIGHT) < 1e-3);
        picture_free(&pair);
    }
}

/* A few balls of every profile beside fog and over a floor, which some reach into; one holds the eye. They do not
 * overlap. */
static void make_particles(nebel_particle particles[9], nebel_volume_desc volumes[11], int grey)
{
    for (int i = 0; i < 9; i++) {
        const double x = i % 3 - 1., z = i / 3 - 1.;
        particles[i] = (nebel_particle){.center = {1.5 * x, -.7, 1.5 * z},
                                        .radius = .4 + .03 * i,
                                        .extinction = {1, grey ? 1 : 2.5, grey ? 1 : .2},
                                        .emission = {.4, .1 * i, .3},
                                        .profile = (nebel_particle_profile)(i % NEBEL_PARTICLE_PROFILE_COUNT)};
    }
    const double eye[3] = {3.1, 2, 5};
    memcpy(particles[4].center, eye, sizeof eye);
    for (int i = 0; i < 9; i++) volumes[2 + i] = nebel_volume_from_particle(&particles[i]);
}

static void check_particles(const test_stage *s, nb_gl_language language, int grey, nebel_projection projection)
{
    nebel_particle particles[9];
    nebel_volume_desc volumes[11] = {
        {.extinction = {.02, .03, .04}, .source = {.5, .6, .7}},
        {.shape = {.type = NEBEL_SHAPE_BOX, .min = {-9, 0, 2.5}, .max = {9, 3, 4}}, .extinction = {.1, .1, .3}}};
    nb_gl context;
    picture_pair pair = picture_make(WIDTH, HEIGHT);
    nebel_camera camera = s->camera;
    const nebel_scene_data scene = s->ball.scene; /* the first fog lets no light of the sun through */
    make_particles(particles, volumes, grey);
    camera.projection = projection;
    nebel_lighting *const all = test_fog(11, volumes), *const others = test_fog(2, volumes);
    const picture_particles drawn = {.list = particles, .count = 9, .others = others};
    pass_open(&context, language);
    picture_render_particles(&scene, all, &drawn, &camera, 1, &pair);
    pass_close(&context);
    const picture_difference d = picture_compare(&pair, 1);
    print_message("%zu pixels with fog, %zu beyond 1/255, worst %.2g/255, color %.2g\n", d.fogged, d.beyond_step,
                  255 * d.largest, d.color);
    assert_true((double)d.beyond_step <= 1e-3 * (double)d.fogged);
    assert_true(d.largest < 3. / 255);
    picture_free(&pair);
    nebel_release_lighting(all);
    nebel_release_lighting(others);
}

static void test_particles_are_fog(void **state)
{
    (void)state;
    static test_stage s;
    set_stage(&s, (double[3]){0, 0, 0});
    for (int i = 0; i < 2; i++) {
        for (int grey = 0; grey < 2; grey++) {
            check_particles(&s, languages[i], grey,
                            i == grey ? NEBEL_PROJECTION_PERSPECTIVE : NEBEL_PROJECTION_ORTHOGRAPHIC);
        }
    }
    nebel_release_lighting(s.fog);
}

/* How far the colours are apart where the sun shines through particles onto the floor. */
static double compare_sunlight(const test_stage *s, nb_gl_language language, int grey, int leave_sun)
{
    nebel_particle particles[9];
    nebel_volume_desc volumes[11] = {
        {.shape = {.type = NEBEL_SHAPE_BOX, .min = {-9, -2, -9}, .max = {9, 3, 9}}, .extinction = {.02, .03, .04}},
        {.shape = {.type = NEBEL_SHAPE_BOX, .min = {-9, 0, 2.5}, .max = {9, 3, 4}}, .extinction = {.1, .1, .3}}};
    nb_gl context;
    picture_pair pair = picture_make(WIDTH, HEIGHT);
    make_particles(particles, volumes, grey);
    nebel_lighting *const all = test_fog(11, volumes), *const others = test_fog(2, volumes);
    const picture_particles drawn = {.list = particles, .count = 9, .others = others, .leave_sun = leave_sun};
    pass_open(&context, language);
    picture_render_particles(&s->ball.scene, all, &drawn, &s->camera, 1, &pair);
    pass_close(&context);
    const double color = picture_compare(&pair, 1).color;
    picture_free(&pair);
    nebel_release_lighting(all);
    nebel_release_lighting(others);
    return color;
}

static void test_particles_dim_the_sun(void **state)
{
    (void)state;
    static test_stage s;
    set_stage(&s, (double[3]){0, 0, 0});
    for (int i = 0; i < 2; i++) {
        const double dimmed = compare_sunlight(&s, languages[i], i, 0),
                     bright = compare_sunlight(&s, languages[i], i, 1);
        print_message("dimmed %.2g, not dimmed %.2g\n", dimmed, bright);
        assert_true(dimmed < .01 && dimmed < .2 * bright);
    }
    nebel_release_lighting(s.fog);
}

/* Many samples of both come close to the same mean; one sample does not. */
static void test_samples_smooth_edges(void **state)
{
    (void)state;
    static test_stage s;
    double color[2];
    nb_gl context;
    set_stage(&s, (double[3]){0, 0, 0});
    for (int i = 0; i < 2; i++) {
        static float few[3 * WIDTH * HEIGHT];
        picture_pair pair = picture_make(WIDTH, HEIGHT);
        pass_open(&context, languages[i]);
        picture_render(&s.ball.scene, s.fog, &s.camera, 64, &pair);
        nebel_gl_renderer *const renderer = make_renderer(&s);
        color[0] = picture_compare(&pair, 1).color;
        draw(renderer, &s, 1, few);
        memcpy(pair.gl.color, few, sizeof few);
        color[1] = picture_compare(&pair, 1).color;
        nebel_destroy_gl_renderer(renderer);
        pass_close(&context);
        print_message("64 samples %.2g, one %.2g\n", color[0], color[1]);
        assert_true(color[0] < .01 && color[0] < .25 * color[1]);
        picture_free(&pair);
    }
    nebel_release_lighting(s.fog);
}

/* Both look through the same points of a pixel: outlines agree, but for points that rounding puts on the other side. */
static void test_outlines_agree_sample_by_sample(void **state)
{
    (void)state;
    static test_stage s;
    nb_gl context;
    set_stage(&s, (double[3]){0, 0, 0});
    for (uint32_t samples = 3; samples <= 4; samples++) {
        picture_pair pair = picture_make(WIDTH, HEIGHT);
        pass_open(&context, NB_GL_330);
        picture_render(&s.ball.scene, s.fog, &s.camera, samples, &pair);
        pass_close(&context);
        const picture_difference difference = picture_compare(&pair, 1);
        print_message("%u samples: %zu of %zu pixels differ\n", samples, difference.beyond_step, difference.fogged);
        assert_true(difference.beyond_step <= 4);
        picture_free(&pair);
    }
    nebel_release_lighting(s.fog);
}

/* Light, and depth in metres. Large, because there Mesa 22 cuts off what goes through one viewport where others have a
 * scissor. */
enum { LARGE_WIDTH = 640, LARGE_HEIGHT = 480 };
typedef struct outcome {
    float color[2][3 * LARGE_WIDTH * LARGE_HEIGHT], depth[2][LARGE_WIDTH * LARGE_HEIGHT];
} outcome;

/* Through each kind of camera, with particles. */
static void draw_all(nebel_gl_renderer *renderer, const test_stage *s, nebel_gl_method method, outcome *out)
{
    static const nebel_particle particle = {
        .center = {.5, 0, 2}, .radius = .6, .extinction = {1, 2, 3}, .emission = {.1, .2, .3}};
    assert_int_equal(nebel_set_gl_renderer_particles(renderer, &particle, 1), NEBEL_OK);
    for (int i = 0; i < 2; i++) {
        nebel_gl_frame_desc desc = {
            .camera = s->camera, .width = LARGE_WIDTH, .height = LARGE_HEIGHT, .samples = 2, .method = method};
        const nebel_gl_planes planes = {.color = out->color[i], .depth = out->depth[i]};
        if (i == 1) desc.camera.projection = NEBEL_PROJECTION_PANORAMA;
        assert_int_equal(nebel_gl_render_frame(renderer, &desc), NEBEL_OK);
        assert_int_equal(nebel_gl_read_planes(renderer, &planes), NEBEL_OK);
    }
}

static void draw_in_odd_state(nb_gl_language language, nebel_gl_method method, int odd_state, outcome *out)
{
    static test_stage s;
    static odd_snapshot before, after;
    static const nebel_light light = {.position = {1, 2, 1}, .intensity = {3, 2, 1}};
    const int desktop = language == NB_GL_330;
    nb_gl context;
    odd o;
    set_stage(&s, (double[3]){0, 0, 0});
    s.ball.scene.light_count = 1;
    s.ball.scene.lights = &light;
    pass_open(&context, language);
    if (odd_state >= 0) odd_set(&o, desktop, odd_state);
    if (odd_state >= 0 && desktop) glClipControl(GL_UPPER_LEFT, GL_ZERO_TO_ONE);
    odd_take(&before, desktop);
    nebel_gl_renderer *const renderer = make_renderer(&s);
    draw_all(renderer, &s, method, out);
    nebel_destroy_gl_renderer(renderer);
    odd_take(&after, desktop);
    odd_expect_same(&before, &after);
    if (odd_state >= 0) odd_delete(&o);
    pass_close(&context);
    nebel_release_lighting(s.fog);
}

static void test_state_neither_changes_nor_matters(void **state)
{
    (void)state;
    static outcome plain, strange;
    for (int i = 0; i < 4; i++) {
        const nb_gl_language language = languages[i % 2];
        const nebel_gl_method method = i < 2 ? NEBEL_GL_METHOD_EXACT : NEBEL_GL_METHOD_VERTEX;
        draw_in_odd_state(language, method, -1, &plain);
        for (int on = 0; on < 2; on++) {
            draw_in_odd_state(language, method, on, &strange);
            assert_memory_equal(&plain, &strange, sizeof plain);
        }
    }
}

/* Grey particles, coloured ones and none have other targets and programs: what one renderer draws by turns is what
 * renderers of their own draw. A light without absorption among them, before a surface and before nothing. */
static void test_particles_of_other_colors_take_turns(void **state)
{
    (void)state;
    static test_stage s;
    static float lone[3][WIDTH * HEIGHT * 3], shared[WIDTH * HEIGHT * 3];
    nebel_particle particles[2][2] = {
        {{.radius = .5, .extinction = {1, 1, 1}, .emission = {.2, .4, .6}}, {.radius = .7, .emission = {.1, .1, .1}}}};
    set_stage(&s, (double[3]){0, 0, 0});
    for (int i = 0; i < 3; i++) {
        particles[0][0].center[i] = (3 * s.camera.look_at[i] + s.camera.position[i]) / 4;
        particles[0][1].center[i] = (s.camera.look_at[i] + s.camera.position[i]) / 2;
    }
    memcpy(particles[1], particles[0], sizeof particles[0]);
    particles[1][0].extinction[2] = 3;
    for (int l = 0; l < 2; l++) {
        nb_gl context;
        pass_open(&context, languages[l]);
        for (int kind = 0; kind < 3; kind++) {
            nebel_gl_renderer *const own = make_renderer(&s);
            assert_int_equal(nebel_set_gl_renderer_particles(own, particles[kind % 2], kind < 2 ? 2 : 0), NEBEL_OK);
            draw(own, &s, 1, lone[kind]);
            nebel_destroy_gl_renderer(own);
        }
        assert_memory_not_equal(lone[0], lone[1], sizeof shared);
        assert_memory_not_equal(lone[0], lone[2], sizeof shared);
        nebel_gl_renderer *const renderer = make_renderer(&s);
        for (int turn = 0; turn < 7; turn++) {
            const int kind = (int[]){0, 1, 0, 2, 1, 2, 0}[turn];
            assert_int_equal(nebel_set_gl_renderer_particles(renderer, particles[kind % 2], kind < 2 ? 2 : 0),
                             NEBEL_OK);
            draw(renderer, &s, 1, shared);
            assert_memory_equal(shared, lone[kind], sizeof shared);
        }
        nebel_destroy_gl_renderer(renderer);
        pass_close(&context);
    }
    nebel_release_lighting(s.fog);
}

static int stop(size_t done, size_t total, void *user)
{
    size_t *const calls = user;
    assert_int_equal(total, 4);
    assert_int_equal(done, ++*calls);
    return *calls == 2;
}

static void check_frames(nebel_gl_renderer *renderer, const test_stage *s)
{
    nebel_gl_textures textures;
    size_t calls = 0;
    nebel_gl_frame_desc desc = frame_of(s, 4);
    assert_int_equal(nebel_gl_get_textures(renderer, &textures), NEBEL_ERROR_ARGUMENT);
    assert_int_equal(nebel_gl_read_planes(renderer, &(nebel_gl_planes){0}), NEBEL_ERROR_ARGUMENT);
    desc.progress = stop;
    desc.progress_user = &calls;
    assert_int_equal(nebel_gl_render_frame(renderer, &desc), NEBEL_ERROR_CANCELLED);
    assert_int_equal(calls, 2);
    assert_int_equal(nebel_gl_get_textures(renderer, &textures), NEBEL_ERROR_ARGUMENT);
    desc = frame_of(s, 1);
    desc.width = 1u << 30;
    assert_int_equal(nebel_gl_render_frame(renderer, &desc), NEBEL_ERROR_LIMIT);
    desc.width = 0;
    assert_int_equal(nebel_gl_render_frame(renderer, &desc), NEBEL_ERROR_VALUE);
    desc = frame_of(s, 5000);
    assert_int_equal(nebel_gl_render_frame(renderer, &desc), NEBEL_ERROR_VALUE);
    desc = frame_of(s, 1);
    desc.camera.projection = (nebel_projection)3;
    assert_int_equal(nebel_gl_render_frame(renderer, &desc), NEBEL_ERROR_VALUE);
    desc.camera.projection = NEBEL_PROJECTION_PERSPECTIVE;
    desc.camera.vertical_fov = 180;
    assert_int_equal(nebel_gl_render_frame(renderer, &desc), NEBEL_ERROR_VALUE);
    desc = frame_of(s, 1);
    assert_int_equal(nebel_gl_render_frame(renderer, &desc), NEBEL_OK);
    assert_int_equal(nebel_gl_get_textures(renderer, &textures), NEBEL_OK);
    assert_true(glIsTexture(textures.color) && textures.width == WIDTH && textures.height == HEIGHT);
}

static void test_what_is_refused(void **state)
{
    (void)state;
    static test_stage s;
    nb_gl context;
    nebel_gl_renderer *renderer = NULL;
    const nebel_gl_renderer_desc usual = {0}, tiny = {.shadow_map_size = 1};
    set_stage(&s, (double[3]){0, 0, 0});
    assert_int_equal(nebel_create_gl_renderer(&s.ball.scene, s.fog, &usual, &renderer), NEBEL_ERROR_UNSUPPORTED);
    pass_open(&context, NB_GL_330);
    const int objects = pass_count_objects();
    assert_int_equal(nebel_create_gl_renderer(NULL, s.fog, &usual, &renderer), NEBEL_ERROR_ARGUMENT);
    assert_int_equal(nebel_create_gl_renderer(&s.ball.scene, s.fog, &tiny, &renderer), NEBEL_ERROR_ARGUMENT);
    s.ball.meshes[1].texture = 3;
    assert_int_equal(nebel_create_gl_renderer(&s.ball.scene, s.fog, &usual, &renderer), NEBEL_ERROR_ARGUMENT);
    s.ball.meshes[1].texture = 0;
    s.ball.indices[7][1] = 1u << 30;
    assert_int_equal(nebel_create_gl_renderer(&s.ball.scene, s.fog, &usual, &renderer), NEBEL_ERROR_ARGUMENT);
    assert_null(renderer);
    s.ball.indices[7][1] = 0;
    renderer = make_renderer(&s);
    check_frames(renderer, &s);
    nebel_destroy_gl_renderer(renderer);
    nebel_destroy_gl_renderer(NULL);
    assert_int_equal(pass_count_objects(), objects);
    pass_close(&context);
    nebel_release_lighting(s.fog);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_light_is_that_of_the_cpu),
        cmocka_unit_test(test_holes_are_those_of_the_cpu),
        cmocka_unit_test(test_light_fades_evenly_on_a_coarse_column),
        cmocka_unit_test(test_particles_are_fog),
        cmocka_unit_test(test_particles_dim_the_sun),
        cmocka_unit_test(test_particles_of_other_colors_take_turns),
        cmocka_unit_test(test_samples_smooth_edges),
        cmocka_unit_test(test_outlines_agree_sample_by_sample),
        cmocka_unit_test(test_state_neither_changes_nor_matters),
        cmocka_unit_test(test_what_is_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
