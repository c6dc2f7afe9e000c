/* Panoramas in OpenGL, and what each way of fogging looks like through each kind of camera, beside the CPU. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "fog_help.h"
#include "pass_help.h"
#include "picture_help.h"
#include "test_render_scene.h"

#include <nebel/classic.h>

enum { WIDTH = 192, HEIGHT = 96, MANY = 60, PARTICLES = 40 };

static const nb_gl_language languages[] = {NB_GL_330, NB_GL_300ES};

static void set_stage(test_stage *s, const double center[3])
{
    test_stage_set(s, center, (const double[3]){1.2, .3, 1.1});
    s->camera.projection = NEBEL_PROJECTION_PANORAMA;
}

static picture_difference tell(const picture_pair *pair)
{
    const picture_difference d = picture_compare(pair, 1);
    print_message("%zu pixels with fog, %zu beyond 1/255, worst %.2g/255, color %.2g\n", d.fogged, d.beyond_step,
                  255 * d.largest, d.color);
    return d;
}

/* ---- panoramas ------------------------------------------------------------------------------- */

/* Seams and poles fall onto the ball and onto the floor in turn; far out, too, and in pictures of few pixels. */
static void test_all_around_is_as_on_the_cpu(void **state)
{
    (void)state;
    static test_stage s;
    static const double centers[2][3] = {{0, 0, 0}, {1e7, -3e6, 5e6}};
    static const double ways[5][3] = {{-1, 0, -1}, {1, .2, 1.3}, {0, 1, 0}, {.01, -1, 0}, {-1, -.3, .5}};
    static const uint32_t sizes[5][2] = {{WIDTH, HEIGHT}, {WIDTH, HEIGHT}, {64, 200}, {37, 19}, {5, 3}};
    for (int i = 0; i < 10; i++) {
        nb_gl context;
        picture_pair pair = picture_make(sizes[i % 5][0], sizes[i % 5][1]);
        set_stage(&s, centers[i % 2]);
        for (int k = 0; k < 3; k++) s.camera.look_at[k] = s.camera.position[k] + ways[i % 5][k];
        s.camera.up[2] = i % 3;
        pass_open(&context, languages[i / 5]);
        picture_render(&s.ball.scene, s.fog, &s.camera, 2, &pair);
        pass_close(&context);
        const picture_difference d = tell(&pair);
        assert_int_equal(d.fogged, pair.width * pair.height);
        assert_true((double)d.beyond_step <= 1e-3 * (double)d.fogged);
        assert_true(d.largest < .2 / 255);
        assert_true(d.color < .02);
        picture_free(&pair);
        nebel_release_lighting(s.fog);
    }
}

/* Walls beside the eye, which lie in its plane, around it, and through its poles and seam. */
static void test_triangles_around_the_eye(void **state)
{
    (void)state;
    enum { SHEETS = 24 };
    static float corners[SHEETS][3][3];
    static uint32_t indices[SHEETS][3];
    static const nebel_volume_desc mist = {.extinction = {.1, .1, .1}, .source = {.5, .6, .7}};
    uint64_t dice_state = 5;
    for (uint32_t i = 0; i < SHEETS; i++) {
        for (uint32_t k = 0; k < 3; k++) {
            indices[i][k] = 3 * i + k;
            for (int c = 0; c < 3; c++) corners[i][k][c] = (float)dice(&dice_state, -8, 8);
            if (i % 4 == 0) corners[i][k][1] = i % 8 == 0 ? 0 : -2; /* in the plane of the eye, or below it */
            if (i % 4 == 1 && k == 0) corners[i][k][0] = corners[i][k][2] = 0; /* at a pole */
        }
    }
    nebel_mesh mesh = {.positions = corners[0][0],
                       .indices = indices[0],
                       .vertex_count = 3 * SHEETS,
                       .triangle_count = SHEETS,
                       .base_color = {.5f, .6f, .7f},
                       .texture = -1};
    const nebel_scene_data scene = {.ambient = {1, 1, 1}, .mesh_count = 1, .meshes = &mesh};
    nebel_lighting *const fog = test_fog(1, &mist);
    for (int i = 0; i < 6; i++) {
        nb_gl context;
        picture_pair pair = picture_make(WIDTH, HEIGHT);
        nebel_camera camera = test_camera(0, 0, 0, i < 3 ? -1 : i, i % 2, i - 2);
        camera.projection = NEBEL_PROJECTION_PANORAMA;
        pass_open(&context, languages[i % 2]);
        picture_render(&scene, fog, &camera, 1, &pair);
        pass_close(&context);
        const picture_difference d = tell(&pair);
        assert_true((double)d.beyond_step <= 1e-3 * (double)d.fogged);
        assert_true(d.largest < 3. / 255);
        picture_free(&pair);
    }
    nebel_release_lighting(fog);
}

/* So many volumes that there are lists for tiles, before which particles are, of grey and of colour. */
static void test_particles_among_many_volumes(void **state)
{
    (void)state;
    static test_stage s;
    static nebel_particle particles[PARTICLES];
    static nebel_volume_desc volumes[MANY + PARTICLES];
    uint64_t dice_state = 9;
    set_stage(&s, (double[3]){0, 0, 0});
    for (int i = 0; i < MANY + PARTICLES; i++) {
        const int grey = i % 2;
        double center[3];
        for (int k = 0; k < 3; k++) center[k] = dice(&dice_state, -6, 6);
        volumes[i] = (nebel_volume_desc){.extinction = {.1, .1, .1}, .source = {.5, .6, .7}};
        volumes[i].shape = (nebel_shape){.type = NEBEL_SHAPE_SPHERE, .radius = dice(&dice_state, .3, 1.5)};
        memcpy(volumes[i].shape.center, center, sizeof center);
        if (i < MANY) continue;
        nebel_particle *const p = &particles[i - MANY];
        *p = (nebel_particle){.radius = .3 + .01 * (i - MANY),
                              .extinction = {1, grey ? 1 : 2, grey ? 1 : .3},
                              .emission = {.1, .2, .3},
                              .profile = (nebel_particle_profile)(i % NEBEL_PARTICLE_PROFILE_COUNT)};
        /* Apart from each other; the first holds the eye. */
        const int at = i - MANY;
        for (int k = 0; k < 3; k++)
            p->center[k] = at == 0 ? s.camera.position[k]
                                   : (k == 0   ? at % 5
                                      : k == 1 ? at / 5 % 3
                                               : at / 15) *
                                             2.2 -
                                         4.4;
        volumes[i] = nebel_volume_from_particle(p);
    }
    for (int i = 0; i < 2; i++) {
        nb_gl context;
        nebel_lighting *const all = test_fog(MANY + PARTICLES, volumes), *const others = test_fog(MANY, volumes);
        const picture_particles drawn = {.list = particles, .count = PARTICLES, .others = others};
        picture_pair pair = picture_make(WIDTH, HEIGHT);
        pass_open(&context, languages[i]);
        picture_render_particles(&s.ball.scene, all, &drawn, &s.camera, 1, &pair);
        pass_close(&context);
        const picture_difference d = tell(&pair);
        assert_true(d.fogged > WIDTH * HEIGHT / 2);
        assert_true((double)d.beyond_step <= 1e-3 * (double)d.fogged);
        assert_true(d.largest < 3. / 255);
        assert_true(d.color < .02);
        picture_free(&pair);
        nebel_release_lighting(all);
        nebel_release_lighting(others);
    }
    nebel_release_lighting(s.fog);
}

/* Frames of one renderer, flat ones and panoramas in turn, are those of new ones; nothing is left behind. */
static void test_kinds_of_frames_take_turns(void **state)
{
    (void)state;
    static test_stage s;
    static float first[3][3 * WIDTH * HEIGHT], again[3 * WIDTH * HEIGHT];
    static const nebel_gl_method methods[3] = {NEBEL_GL_METHOD_EXACT, NEBEL_GL_METHOD_EXACT, NEBEL_GL_METHOD_VERTEX};
    nb_gl context;
    nebel_gl_renderer *renderer = NULL;
    set_stage(&s, (double[3]){0, 0, 0});
    pass_open(&context, NB_GL_330);
    const int objects = pass_count_objects();
    assert_int_equal(nebel_create_gl_renderer(&s.ball.scene, s.fog, &(nebel_gl_renderer_desc){0}, &renderer), NEBEL_OK);
    for (int i = 0; i < 9; i++) {
        nebel_gl_frame_desc desc = {
            .camera = s.camera, .width = WIDTH, .height = HEIGHT, .samples = 2, .method = methods[i % 3]};
        if (i % 3 == 0) desc.camera.projection = NEBEL_PROJECTION_PERSPECTIVE;
        assert_int_equal(nebel_gl_render_frame(renderer, &desc), NEBEL_OK);
        assert_int_equal(nebel_gl_read_planes(renderer, &(nebel_gl_planes){.color = i < 3 ? first[i] : again}),
                         NEBEL_OK);
        if (i >= 3) assert_memory_equal(first[i % 3], again, sizeof again);
    }
    assert_memory_not_equal(first[1], first[2], sizeof again);
    nebel_destroy_gl_renderer(renderer);
    assert_int_equal(pass_count_objects(), objects);
    pass_close(&context);
    nebel_release_lighting(s.fog);
}

/* ---- methods --------------------------------------------------------------------------------- */

typedef struct method_pair {
    nebel_method cpu;
    nebel_gl_method gl;
} method_pair;

static const method_pair methods[] = {{NEBEL_METHOD_VERTEX, NEBEL_GL_METHOD_VERTEX},
                                      {NEBEL_METHOD_ADDITIVE, NEBEL_GL_METHOD_ADDITIVE},
                                      {NEBEL_METHOD_CELLS, NEBEL_GL_METHOD_CELLS}};

static void render_cpu(const test_stage *s, const nebel_cells *cells, const nebel_camera *camera, nebel_method method,
                       picture_pair *pair)
{
    nebel_renderer *renderer = NULL;
    const nebel_frame_desc frame = {.camera = *camera, .width = WIDTH, .height = HEIGHT, .samples = 1};
    assert_int_equal(nebel_create_cpu_renderer(&s->ball.scene, s->fog, &(nebel_cpu_renderer_desc){0}, &renderer),
                     NEBEL_OK);
    if (method == NEBEL_METHOD_CELLS) {
        assert_int_equal(nebel_set_renderer_cells(renderer, cells, NEBEL_CELLS_PER_VERTEX), NEBEL_OK);
    } else {
        assert_int_equal(nebel_set_renderer_method(renderer, method, NULL), NEBEL_OK);
    }
    assert_int_equal(nebel_render_frame(renderer, &frame, &pair->cpu), NEBEL_OK);
    nebel_destroy_renderer(renderer);
}

static void render_gl(const test_stage *s, const nebel_cells *cells, const nebel_camera *camera, nebel_gl_method method,
                      picture_pair *pair)
{
    nebel_gl_renderer *renderer = NULL;
    const nebel_gl_frame_desc frame = {
        .camera = *camera, .width = WIDTH, .height = HEIGHT, .samples = 1, .method = method, .cells = cells};
    const nebel_gl_planes planes = {pair->gl.color, pair->gl.transmittance, pair->gl.in_scattering, pair->gl.depth,
                                    pair->gl.normal};
    assert_int_equal(nebel_create_gl_renderer(&s->ball.scene, s->fog, &(nebel_gl_renderer_desc){0}, &renderer),
                     NEBEL_OK);
    assert_int_equal(nebel_gl_render_frame(renderer, &frame), NEBEL_OK);
    assert_int_equal(nebel_gl_read_planes(renderer, &planes), NEBEL_OK);
    nebel_destroy_gl_renderer(renderer);
}

/* Linear cells count depth along the camera's axis, from the plane across it. */
static void test_methods_are_those_of_the_cpu(void **state)
{
    (void)state;
    static test_stage s;
    static const nebel_cell rooms[] = {{.shape = {.type = NEBEL_SHAPE_BOX, .min = {-9, -3, -9}, .max = {9, 0, 9}},
                                        .density = .2,
                                        .color = {.9, .4, .2}},
                                       {.shape = {.type = NEBEL_SHAPE_BOX, .min = {-9, 0, -9}, .max = {9, 4, 9}},
                                        .density = .04,
                                        .color = {.5, .6, .7}}};
    static const nebel_projection views[] = {NEBEL_PROJECTION_PERSPECTIVE, NEBEL_PROJECTION_ORTHOGRAPHIC,
                                             NEBEL_PROJECTION_PANORAMA};
    nebel_cells *cells = NULL;
    assert_int_equal(nebel_create_cells(&(nebel_cells_desc){.cells = rooms, .cell_count = 2}, &cells), NEBEL_OK);
    set_stage(&s, (double[3]){0, 0, 0});
    s.ball.scene.has_sun = 0;
    for (int i = 0; i < 9; i++) {
        const method_pair *const method = &methods[i / 3];
        nb_gl context;
        picture_pair pair = picture_make(WIDTH, HEIGHT);
        nebel_camera camera = s.camera;
        camera.projection = views[i % 3];
        camera.view_height = 4;
        render_cpu(&s, cells, &camera, method->cpu, &pair);
        pass_open(&context, languages[i % 2]);
        render_gl(&s, cells, &camera, method->gl, &pair);
        pass_close(&context);
        const picture_difference d = tell(&pair);
        assert_true(d.fogged > WIDTH * HEIGHT / 8);
        assert_true((double)d.beyond_step <= 1e-3 * (double)d.fogged);
        assert_true(d.largest < .2 / 255);
        picture_free(&pair);
    }
    nebel_destroy_cells(cells);
    nebel_release_lighting(s.fog);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_all_around_is_as_on_the_cpu),  cmocka_unit_test(test_triangles_around_the_eye),
        cmocka_unit_test(test_particles_among_many_volumes), cmocka_unit_test(test_kinds_of_frames_take_turns),
        cmocka_unit_test(test_methods_are_those_of_the_cpu),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
