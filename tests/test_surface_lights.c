/* Point lights on surfaces: a floor under a point light, its cone, its shadow, and the fog between, against closed
 * forms. */
#include "test_render_scene.h"

enum { SIZE = 33 };

static const float floor_positions[] = {-50, 0, -50, 50, 0, -50, 50, 0, 50, -50, 0, 50};
static const float lid_positions[] = {-1, 2, -1, 1, 2, -1, 1, 2, 1, -1, 2, 1};
static const uint32_t square[] = {0, 2, 1, 0, 3, 2};

static nebel_mesh make_square(const float *positions)
{
    return (nebel_mesh){.positions = positions,
                        .indices = square,
                        .vertex_count = 4,
                        .triangle_count = 2,
                        .base_color = {.5f, .25f, 1},
                        .texture = -1};
}

/* Straight down on the floor, 1 m to 8 pixels. */
static void render(const nebel_light *light, int has_lid, double extinction, test_picture *picture)
{
    const nebel_mesh meshes[] = {make_square(floor_positions), make_square(lid_positions)};
    const nebel_scene_data scene = {.mesh_count = has_lid ? 2 : 1, .meshes = meshes, .light_count = 1, .lights = light};
    nebel_camera camera = test_camera(0, 1, 0, 0, 0, 0);
    camera.projection = NEBEL_PROJECTION_ORTHOGRAPHIC;
    camera.up[1] = 0;
    camera.up[2] = -1;
    camera.view_height = SIZE / 8.0;
    nebel_lighting *fog = test_world_fog(extinction, 0);
    nebel_renderer *renderer = NULL;
    assert_int_equal(nebel_create_cpu_renderer(&scene, fog, &(nebel_cpu_renderer_desc){0}, &renderer), NEBEL_OK);
    const nebel_frame_desc desc = {.camera = camera, .width = SIZE, .height = SIZE, .samples = 1};
    assert_int_equal(nebel_render_frame(renderer, &desc, &picture->planes), NEBEL_OK);
    nebel_destroy_renderer(renderer);
    nebel_release_lighting(fog);
}

/* Of the pixel: metres from the middle, to the right and down. */
static double at(uint32_t pixel)
{
    return ((double)pixel - SIZE / 2) / 8;
}

/* Light is that at the start of shadow rays, 1.4e-4 m above so large a floor. */
static void a_floor_is_lit(void **state)
{
    const nebel_light light = {.position = {0.5, 3, 0.25}, .intensity = {10, 20, 5}};
    test_picture picture = test_picture_make(SIZE, SIZE);
    (void)state;
    for (int foggy = 0; foggy < 2; foggy++) {
        const double extinction = foggy ? 0.1 : 0;
        render(&light, 0, extinction, &picture);
        for (uint32_t y = 0; y < SIZE; y++)
            for (uint32_t x = 0; x < SIZE; x++) {
                const double dx = at(x) - 0.5, dz = at(y) - 0.25, d2 = dx * dx + dz * dz + 9, d = sqrt(d2);
                for (int c = 0; c < 3; c++) {
                    static const double share[] = {1, 2, .5}, color[] = {.5, .25, 1};
                    const double left = exp(-extinction * share[c] * (d + 1)); /* and to the camera */
                    const double wanted = light.intensity[c] * 3 / (d2 * d) / test_pi * color[c] * left;
                    assert_true(fabs((double)test_color(&picture, x, y)[c] - wanted) < 4e-4 * wanted + 1e-6);
                }
            }
    }
    test_picture_free(&picture);
}

/* The lid, 2 m wide at 2 m, shades 6 m of the floor about the middle; no point light shines beyond its cone. */
static void shadows_and_cones_have_edges(void **state)
{
    nebel_light light = {.position = {0, 3, 0}, .intensity = {10, 10, 10}};
    test_picture picture = test_picture_make(SIZE, SIZE);
    (void)state;
    render(&light, 1, 0, &picture);
    for (uint32_t x = 0; x < SIZE; x++) assert_true(test_color(&picture, x, SIZE / 2)[0] == 0);
    light.type = NEBEL_LIGHT_SPOT;
    light.direction[1] = -3;
    light.inner_angle = light.outer_angle = 22.5; /* of 3 m: 1.2426 m */
    render(&light, 0, 0, &picture);
    for (uint32_t x = 0; x < SIZE; x++) {
        const double away = fabs(at(x));
        assert_true((test_color(&picture, x, SIZE / 2)[0] > 0) == (away < 1.2426));
    }
    test_picture_free(&picture);
}

/* A point light on the floor, below it, in a surface's own place, and one that is none. */
static void odd_lights_are_answered(void **state)
{
    const nebel_light lights[] = {{.position = {0, 0, 0}, .intensity = {10, 10, 10}},
                                  {.position = {0, -1, 0}, .intensity = {10, 10, 10}},
                                  {.position = {0, 0.5, 0}, .intensity = {10, 10, 10}, .radius = 1}};
    test_picture picture = test_picture_make(SIZE, SIZE);
    (void)state;
    for (size_t i = 0; i < sizeof lights / sizeof lights[0]; i++) {
        render(&lights[i], 0, 0.1, &picture);
        for (uint32_t p = 0; p < 3 * SIZE * SIZE; p++) {
            const float light = picture.planes.color[p];
            assert_true(light >= 0 && light < (i == 0 ? HUGE_VALF : 10));
            if (i == 1) assert_true(light == 0);
        }
    }
    const nebel_light wrong = {.position = {(double)NAN, 0, 0}, .intensity = {1, 1, 1}};
    const nebel_scene_data scene = {.light_count = 1, .lights = &wrong};
    nebel_renderer *renderer = NULL;
    nebel_result result = nebel_create_cpu_renderer(&scene, NULL, &(nebel_cpu_renderer_desc){0}, &renderer);
    const nebel_frame_desc desc = {.camera = test_camera(0, 1, 0, 0, 0, 0), .width = SIZE, .height = SIZE};
    if (result == NEBEL_OK) result = nebel_render_frame(renderer, &desc, &picture.planes);
    assert_int_equal(result, NEBEL_ERROR_VALUE);
    nebel_destroy_renderer(renderer);
    test_picture_free(&picture);
}

static const float wall_positions[] = {-50, -50, -3, 50, -50, -3, 50, 50, -3, -50, 50, -3};

/* Level at a wall 3 m behind the point light, through fog about it; the floor is seen from its edge. */
static void render_wall(const nebel_light *light, int has_floor, nebel_method method, test_picture *picture)
{
    static const uint32_t upright[] = {0, 1, 2, 0, 2, 3};
    nebel_mesh meshes[] = {make_square(wall_positions), make_square(floor_positions)};
    meshes[0].indices = upright;
    const nebel_scene_data scene = {
        .mesh_count = has_floor ? 2 : 1, .meshes = meshes, .light_count = 1, .lights = light};
    const nebel_volume_desc box = {.shape = {.type = NEBEL_SHAPE_BOX, .min = {-4, -4, -2.9}, .max = {4, 4, 3}},
                                   .extinction = {.1, .1, .1},
                                   .albedo = {1, 1, 1}};
    const nebel_lighting_desc lights = {.lights = light, .light_count = 1};
    nebel_lighting *fog = fog_commit_lit(&(nebel_fog_desc){0}, &box, 1, &lights);
    nebel_renderer *renderer = NULL;
    assert_int_equal(nebel_create_cpu_renderer(&scene, fog, &(nebel_cpu_renderer_desc){0}, &renderer), NEBEL_OK);
    assert_int_equal(nebel_set_renderer_method(renderer, method, NULL), NEBEL_OK);
    nebel_frame_desc desc = {.camera = test_camera(0, 2, 10, 0, 2, 0), .width = SIZE, .height = SIZE};
    desc.samples = desc.bounces = 1;
    desc.camera.projection = NEBEL_PROJECTION_ORTHOGRAPHIC;
    desc.camera.view_height = 3.9;
    assert_int_equal(nebel_render_frame(renderer, &desc, &picture->planes), NEBEL_OK);
    nebel_destroy_renderer(renderer);
    nebel_release_lighting(fog);
}

/* On a floor, in it, and deeper in it by less than 1 mm, a point light lights what is above as if there were no floor;
 * but for the last one's light that leaves the floor farther from it than that: below 5.8 degrees. */
static void floors_do_not_hide_lights_in_them(void **state)
{
    const nebel_light lights[] = {{.position = {0, 0, 0}, .intensity = {10, 10, 10}},
                                  {.position = {0.3, 0, 0.2}, .intensity = {10, 10, 10}},
                                  {.position = {0.3, -1e-4, 0.2}, .intensity = {10, 10, 10}}};
    const nebel_method methods[] = {NEBEL_METHOD_EXACT, NEBEL_METHOD_PATH};
    test_picture with = test_picture_make(SIZE, SIZE), without = test_picture_make(SIZE, SIZE);
    (void)state;
    for (size_t i = 0; i < 2 * sizeof lights / sizeof lights[0]; i++) {
        const nebel_light *light = &lights[i / 2];
        const uint32_t rows = light->position[1] < 0 ? SIZE * 3 / 4 : SIZE; /* from 1.02 m or 0.11 m up */
        uint32_t lit = 0;
        render_wall(light, 1, methods[i % 2], &with);
        render_wall(light, 0, methods[i % 2], &without);
        for (uint32_t y = 0; y < rows; y++)
            for (uint32_t x = 0; x < SIZE; x++) {
                const double seen = (double)test_color(&with, x, y)[0], all = (double)test_color(&without, x, y)[0];
                assert_true(fabs(seen - all) <= 1e-4 * all);
                lit += seen > 0;
            }
        assert_true(lit > rows * SIZE / 2); /* of the reference's paths some meet no light */
    }
    test_picture_free(&with);
    test_picture_free(&without);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_floor_is_lit),
        cmocka_unit_test(shadows_and_cones_have_edges),
        cmocka_unit_test(odd_lights_are_answered),
        cmocka_unit_test(floors_do_not_hide_lights_in_them),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
