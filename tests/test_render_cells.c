/* Fog in cells on the surfaces of the CPU renderer. */
#include "test_render_scene.h"

#include "near.h"

#include <stdio.h>

/* Two rooms of fog in a row along z under clear air, around the ground. */
static const nebel_cell rooms[] = {
    {.shape = {.type = NEBEL_SHAPE_BOX, .min = {-8, 0, 0}, .max = {8, 2, 8}}, .density = .1, .color = {1, .5, .25}},
    {.shape = {.type = NEBEL_SHAPE_BOX, .min = {-8, 0, -8}, .max = {8, 2, 0}}, .density = .1, .color = {1, .5, .25}},
    {.shape = {.type = NEBEL_SHAPE_BOX, .min = {-8, 2, -8}, .max = {8, 9, 8}}},
};

static nebel_cells *create_rooms(nebel_cell_span span)
{
    nebel_cells *cells = NULL;
    const nebel_cells_desc desc = {.cells = rooms, .cell_count = 3, .span = span};
    assert_int_equal(nebel_create_cells(&desc, &cells), NEBEL_OK);
    return cells;
}

static void render_cells(const nebel_scene_data *scene, const nebel_cells *cells, nebel_cell_stage stage, int threads,
                         const nebel_camera *camera, test_picture *picture)
{
    nebel_renderer *renderer = NULL;
    const nebel_cpu_renderer_desc desc = {.thread_count = threads};
    const nebel_frame_desc frame = {
        .camera = *camera, .width = picture->width, .height = picture->height, .samples = 1};
    assert_int_equal(nebel_create_cpu_renderer(scene, NULL, &desc, &renderer), NEBEL_OK);
    assert_int_equal(nebel_set_renderer_cells(renderer, cells, stage), NEBEL_OK);
    assert_int_equal(nebel_render_frame(renderer, &frame, &picture->planes), NEBEL_OK);
    nebel_destroy_renderer(renderer);
}

/* The eye sees the near room alone, through a hatch under it. */
static nebel_cells *create_walled_rooms(void)
{
    static const double hatch[4][3] = {{-4, 2, .5}, {4, 2, .5}, {4, 2, 4}, {-4, 2, 4}};
    static const nebel_portal portal = {{0, 2}, hatch, 4};
    nebel_cells *cells = NULL;
    const nebel_cells_desc desc = {.cells = rooms, .cell_count = 3, .portals = &portal, .portal_count = 1};
    assert_int_equal(nebel_create_cells(&desc, &cells), NEBEL_OK);
    return cells;
}

static nebel_cell_fog ask(const nebel_cells *cells, const nebel_camera *camera, const double place[3])
{
    nebel_cell_view view;
    const nebel_cell_point point = {.position = {place[0], place[1], place[2]}};
    nebel_cell_fog fog;
    for (int i = 0; i < 3; i++) {
        view.eye[i] = camera->position[i];
        view.forward[i] = camera->look_at[i] - camera->position[i];
    }
    assert_int_equal(nebel_compute_cell_fog(cells, &view, 1, &point, 0, &fog, 0), NEBEL_OK);
    return fog;
}

/* ---- what is drawn --------------------------------------------------------------------------- */

static void test_pixels_are_what_the_cells_say(void **state)
{
    (void)state;
    const nebel_mesh mesh = test_ground();
    const nebel_scene_data scene = {.meshes = &mesh, .mesh_count = 1, .ambient = {1, 1, 1}, .background = {.1, .2, .3}};
    const nebel_camera camera = test_camera_down();
    test_picture picture = test_picture_make(40, 30);
    for (int span = 0; span < NEBEL_SPAN_COUNT; span++) {
        nebel_cells *cells = create_rooms((nebel_cell_span)span);
        int met = 0;
        render_cells(&scene, cells, NEBEL_CELLS_PER_PIXEL, 2, &camera, &picture);
        for (uint32_t y = 0; y < 30; y++)
            for (uint32_t x = 0; x < 40; x++) {
                double place[3];
                if (!test_find_ground(&camera, &picture, x, y, place)) continue;
                const nebel_cell_fog fog = ask(cells, &camera, place);
                const double red = .5 * (1 - fog.alpha) + fog.color[0];
                assert_near((double)test_transmittance(&picture, x, y)[1], 1 - fog.alpha, 1e-5);
                assert_near((double)test_in_scattering(&picture, x, y)[2], fog.color[2], 1e-5);
                assert_near((double)test_color(&picture, x, y)[0], red, 1e-5);
                met++;
            }
        assert_true(met > 500);
        nebel_destroy_cells(cells);
    }
    test_picture_free(&picture);
}

/* The exponential model along the ray is the exact fog of the same cells. */
static void test_exponential_pixels_are_exact(void **state)
{
    (void)state;
    const nebel_mesh mesh = test_ground();
    const nebel_scene_data scene = {.meshes = &mesh, .mesh_count = 1, .ambient = {1, 1, 1}};
    const nebel_camera camera = test_camera(-3, 5, 6, 1, 0, -1);
    const nebel_volume_desc volumes[] = {nebel_volume_from_cell(&rooms[0]), nebel_volume_from_cell(&rooms[1])};
    const nebel_cells_desc desc = {.cells = rooms, .cell_count = 3, .model = NEBEL_CELL_EXPONENTIAL, .ungrouped = 1};
    nebel_cells *cells = NULL;
    nebel_lighting *fog = test_fog(2, volumes);
    test_picture classic = test_picture_make(40, 30), exact = test_picture_make(40, 30);
    int fogged = 0;
    assert_int_equal(nebel_create_cells(&desc, &cells), NEBEL_OK);
    render_cells(&scene, cells, NEBEL_CELLS_PER_PIXEL, 2, &camera, &classic);
    test_render(&scene, fog, &(nebel_cpu_renderer_desc){0}, &camera, 1, &exact);
    for (size_t i = 0; i < 40 * 30; i++) {
        if (!isfinite(classic.planes.depth[i])) continue; /* classic fog is on surfaces alone */
        for (size_t c = 3 * i; c < 3 * i + 3; c++)
            assert_near((double)classic.planes.color[c], (double)exact.planes.color[c], 2e-6);
        fogged += classic.planes.transmittance[3 * i] < .9f;
    }
    assert_true(fogged > 300);
    nebel_release_lighting(fog);
    nebel_destroy_cells(cells);
    test_picture_free(&classic);
    test_picture_free(&exact);
}

/* Gouraud: linear over the triangle in the world, which is not linear in the picture. The square's diagonal goes from
 * (-5, -5) to (5, 5). */
static void test_between_vertices_alpha_is_linear_in_the_world(void **state)
{
    (void)state;
    const nebel_mesh mesh = test_ground();
    const nebel_scene_data scene = {.meshes = &mesh, .mesh_count = 1, .ambient = {1, 1, 1}};
    const nebel_camera camera = test_camera_down();
    nebel_cells *cells = create_rooms(NEBEL_SPAN_RAY);
    test_picture picture = test_picture_make(40, 30);
    double corners[4], farthest = 0;
    for (size_t v = 0; v < 4; v++) {
        const float *p = test_ground_positions + 3 * v;
        corners[v] = ask(cells, &camera, (const double[3]){(double)p[0], (double)p[1], (double)p[2]}).alpha;
    }
    render_cells(&scene, cells, NEBEL_CELLS_PER_VERTEX, 2, &camera, &picture);
    for (uint32_t y = 0; y < 30; y++)
        for (uint32_t x = 0; x < 40; x++) {
            double place[3];
            if (!test_find_ground(&camera, &picture, x, y, place)) continue;
            const double linear = test_interpolate_ground(corners, place);
            assert_near((double)test_transmittance(&picture, x, y)[0], 1 - linear, 1e-5);
            farthest = fmax(farthest, fabs(linear - ask(cells, &camera, place).alpha));
        }
    assert_true(farthest > .05); /* so large a triangle is wrong inside, as it was then */
    nebel_destroy_cells(cells);
    test_picture_free(&picture);
}

/* Walls hide vertices of polygons that are seen: those are fogged as if they were seen, too. */
static void test_hidden_vertices_have_fog(void **state)
{
    (void)state;
    const nebel_mesh mesh = test_ground();
    const nebel_scene_data scene = {.meshes = &mesh, .mesh_count = 1, .ambient = {1, 1, 1}};
    const nebel_camera camera = test_camera_down();
    nebel_cells *open = create_rooms(NEBEL_SPAN_RAY), *walled = create_walled_rooms();
    test_picture wanted = test_picture_make(40, 30), got = test_picture_make(40, 30);
    render_cells(&scene, open, NEBEL_CELLS_PER_VERTEX, 1, &camera, &wanted);
    render_cells(&scene, walled, NEBEL_CELLS_PER_VERTEX, 1, &camera, &got);
    assert_memory_equal(wanted.planes.color, got.planes.color, 40 * 30 * 3 * sizeof(float));
    render_cells(&scene, walled, NEBEL_CELLS_PER_PIXEL, 1, &camera, &got);
    assert_near((double)test_transmittance(&got, 20, 2)[0], 1, 0);
    assert_true(test_transmittance(&got, 20, 15)[0] < .85f);
    nebel_destroy_cells(open);
    nebel_destroy_cells(walled);
    test_picture_free(&wanted);
    test_picture_free(&got);
}

/* No polygon, no fog; nothing dims the sun. */
static void test_what_is_not_fogged(void **state)
{
    (void)state;
    const nebel_mesh mesh = test_ground();
    const nebel_scene_data scene = {.meshes = &mesh,
                                    .mesh_count = 1,
                                    .background = {.1, .2, .3},
                                    .has_sun = 1,
                                    .sun_direction = {0, 1, 0},
                                    .sun_irradiance = {3, 3, 3}};
    const nebel_camera camera = test_camera(0, 1, 7, 0, 1, 0);
    nebel_cells *cells = create_rooms(NEBEL_SPAN_RAY);
    test_picture picture = test_picture_make(16, 16);
    for (int stage = 0; stage < NEBEL_CELL_STAGE_COUNT; stage++) {
        render_cells(&scene, cells, (nebel_cell_stage)stage, 1, &camera, &picture);
        assert_near((double)test_color(&picture, 8, 0)[1], .2, 1e-6);
        assert_near((double)test_transmittance(&picture, 8, 0)[1], 1, 0);
        assert_near((double)picture.planes.error[0], 0, 0);
        const float *t = test_transmittance(&picture, 8, 13), *s = test_in_scattering(&picture, 8, 13);
        assert_true(t[0] < .9f);
        assert_near((double)test_color(&picture, 8, 13)[0], (double)t[0] * .5 * 3 / test_pi + (double)s[0], 1e-5);
    }
    nebel_destroy_cells(cells);
    test_picture_free(&picture);
}

/* Rays of an orthographic camera begin in its plane; each ray of a panorama is an axis of its own. */
static void test_other_projections(void **state)
{
    (void)state;
    const nebel_mesh mesh = test_ground();
    const nebel_scene_data scene = {.meshes = &mesh, .mesh_count = 1, .ambient = {1, 1, 1}};
    nebel_camera camera = test_camera_down();
    test_picture picture = test_picture_make(16, 16);
    for (int span = 0; span < NEBEL_SPAN_COUNT; span++) {
        nebel_cells *cells = create_rooms((nebel_cell_span)span);
        for (int stage = 0; stage < NEBEL_CELL_STAGE_COUNT; stage++) {
            camera.projection = NEBEL_PROJECTION_ORTHOGRAPHIC;
            camera.view_height = 4;
            render_cells(&scene, cells, (nebel_cell_stage)stage, 1, &camera, &picture);
            for (uint32_t y = 0; y < 16; y++)
                for (uint32_t x = 0; x < 16; x++) assert_near((double)test_transmittance(&picture, x, y)[0], .8, 1e-5);
        }
        /* The pixel right of and below the middle is 1 / 32 of the circle off the axis both ways. */
        const double off = test_pi / 16;
        camera.projection = NEBEL_PROJECTION_PANORAMA;
        render_cells(&scene, cells, NEBEL_CELLS_PER_PIXEL, 1, &camera, &picture);
        assert_near((double)test_transmittance(&picture, 8, 8)[0], 1 - .2 / (cos(off) * cos(off / 2)), 1e-5);
        nebel_destroy_cells(cells);
    }
    test_picture_free(&picture);
}

static void test_threads_change_nothing(void **state)
{
    (void)state;
    static test_ball ball;
    test_ball_make(&ball, (const double[3]){0, 1, 0});
    const nebel_camera camera = test_camera(0, 3, 5, 0, 0, 0);
    nebel_cells *cells = create_rooms(NEBEL_SPAN_PRINTED);
    test_picture one = test_picture_make(70, 50), many = test_picture_make(70, 50);
    for (int stage = 0; stage < NEBEL_CELL_STAGE_COUNT; stage++) {
        render_cells(&ball.scene, cells, (nebel_cell_stage)stage, 1, &camera, &one);
        render_cells(&ball.scene, cells, (nebel_cell_stage)stage, 3, &camera, &many);
        assert_memory_equal(one.planes.color, many.planes.color, 70 * 50 * 3 * sizeof(float));
    }
    nebel_destroy_cells(cells);
    test_picture_free(&one);
    test_picture_free(&many);
}

static void test_cells_come_and_go(void **state)
{
    (void)state;
    const nebel_mesh mesh = test_ground();
    const nebel_scene_data scene = {.meshes = &mesh, .mesh_count = 1, .ambient = {1, 1, 1}};
    const nebel_camera camera = test_camera_down();
    nebel_lighting *fog = test_world_fog(.2, 1);
    nebel_cells *cells = create_rooms(NEBEL_SPAN_RAY);
    test_picture before = test_picture_make(16, 16), after = test_picture_make(16, 16);
    nebel_renderer *renderer = NULL;
    const nebel_frame_desc frame = {.camera = camera, .width = 16, .height = 16, .samples = 1};
    assert_int_equal(nebel_create_cpu_renderer(&scene, fog, &(nebel_cpu_renderer_desc){0}, &renderer), NEBEL_OK);
    assert_int_equal(nebel_render_frame(renderer, &frame, &before.planes), NEBEL_OK);
    assert_int_equal(nebel_set_renderer_cells(renderer, cells, NEBEL_CELLS_PER_VERTEX), NEBEL_OK);
    assert_int_equal(nebel_render_frame(renderer, &frame, &after.planes), NEBEL_OK);
    assert_memory_not_equal(before.planes.color, after.planes.color, 16 * 16 * 3 * sizeof(float));
    assert_int_equal(nebel_set_renderer_cells(renderer, NULL, NEBEL_CELLS_PER_VERTEX), NEBEL_OK);
    assert_int_equal(nebel_render_frame(renderer, &frame, &after.planes), NEBEL_OK);
    assert_memory_equal(before.planes.color, after.planes.color, 16 * 16 * 3 * sizeof(float));
    assert_int_equal(nebel_set_renderer_cells(renderer, cells, NEBEL_CELL_STAGE_COUNT), NEBEL_ERROR_ARGUMENT);
    assert_int_equal(nebel_set_renderer_cells(NULL, cells, NEBEL_CELLS_PER_VERTEX), NEBEL_ERROR_ARGUMENT);
    nebel_destroy_renderer(renderer);
    nebel_destroy_cells(cells);
    nebel_release_lighting(fog);
    test_picture_free(&before);
    test_picture_free(&after);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_pixels_are_what_the_cells_say),
        cmocka_unit_test(test_exponential_pixels_are_exact),
        cmocka_unit_test(test_between_vertices_alpha_is_linear_in_the_world),
        cmocka_unit_test(test_hidden_vertices_have_fog),
        cmocka_unit_test(test_what_is_not_fogged),
        cmocka_unit_test(test_other_projections),
        cmocka_unit_test(test_threads_change_nothing),
        cmocka_unit_test(test_cells_come_and_go),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
