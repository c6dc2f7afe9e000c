/* Two ways to the first hit: triangle by triangle and ray by ray. */
#include "test_render_scene.h"

#include "cpu/cpu_renderer.h"

enum { SIDE = NB_REGION, PIXELS = SIDE * SIDE };

/* Both answers for a region. */
typedef struct test_both {
    nb_region_points points[NB_TOGETHER];
    nb_region_hits seen[NB_TOGETHER];
    nb_ray_batch rays;
    nb_packets packets;
    nb_hits raster, ray;
    int hits, differences, misses;
    float largest;
} test_both;

static test_both *make_both(void)
{
    test_both *both = aligned_alloc(64, (sizeof *both + 63) / 64 * 64);
    assert_non_null(both);
    memset(both, 0, sizeof *both);
    return both;
}

/* Of the angle at which a ray meets the face: the flatter, the farther apart the same noise of the ray puts the hits.
 */
static float cosine(const test_both *both, int i)
{
    float along = 0, square = 0;
    for (int k = 0; k < 3; k++) {
        along += both->ray.normal[k][i] * both->rays.unit[k][i];
        square += both->ray.normal[k][i] * both->ray.normal[k][i];
    }
    return fabsf(along) / sqrtf(square);
}

static void compare_batch(test_both *both)
{
    for (int i = 0; i < NB_BATCH; i++) {
        const int seen = both->raster.surface[i] != NB_NONE, met = both->ray.surface[i] != NB_NONE;
        both->hits += seen;
        both->misses += !seen;
        both->differences += seen != met;
        if (!seen || !met) continue;
        const float error = fabsf(both->raster.t[i] - both->ray.t[i]) / both->ray.t[i];
        if (both->raster.triangle[i] != both->ray.triangle[i]) {
            both->differences += error > 1e-3f;
            continue;
        }
        both->largest = fmaxf(both->largest, error);
        const float noise = 1e-4f / cosine(both, i);
        assert_float_equal(both->raster.u[i], both->ray.u[i], noise);
        assert_float_equal(both->raster.v[i], both->ray.v[i], noise);
    }
}

static void compare_sample(const nb_geometry *geometry, const nb_view *view, uint32_t left, uint32_t top,
                           uint32_t sample, test_both *both)
{
    static _Alignas(64) int active[NB_BATCH];
    for (int i = 0; i < NB_BATCH; i++) active[i] = -1;
    const nb_region_points *points = &both->points[sample];
    for (uint32_t first = 0; first < PIXELS; first += NB_BATCH) {
        nb_view_rays(view, left, top, points->x + first, points->y + first, &both->rays);
        nb_raster_hits(geometry, both->seen[sample].triangle + first, &both->rays, &both->raster);
        nb_hits_trace(geometry->scene, &both->rays, active, &both->packets, &both->ray);
        compare_batch(both);
    }
}

/* All whole regions of a picture, at most NB_TOGETHER samples. */
static void compare_picture(nebel_renderer *renderer, const nebel_camera *camera, uint32_t width, uint32_t height,
                            uint32_t samples, test_both *both)
{
    nb_view view;
    nb_raster raster;
    nb_geometry *geometry = &renderer->geometry;
    assert_int_equal(nb_view_set(&view, camera, width, height, &renderer->log), NEBEL_OK);
    assert_int_equal(nb_geometry_place(geometry, view.position), NEBEL_OK);
    nb_view_place(&view, geometry->origin, geometry->bounds_min, geometry->bounds_max);
    nb_raster_set(&raster, geometry, &view, &(nb_raster_target){width, height, nb_sample_range_of(samples)}, 1);
    for (uint32_t top = 0; top + SIDE <= height; top += SIDE) {
        for (uint32_t left = 0; left + SIDE <= width; left += SIDE) {
            for (uint32_t s = 0; s < samples; s++) nb_sample_region(s, samples, &both->points[s]);
            nb_raster_region(&raster, left, top, samples, both->points, both->seen);
            for (uint32_t s = 0; s < samples; s++) compare_sample(geometry, &view, left, top, s, both);
        }
    }
}

static void compare_region(nebel_renderer *renderer, const nebel_camera *camera, uint32_t samples, test_both *both)
{
    compare_picture(renderer, camera, SIDE, SIDE, samples, both);
}

static double random_within(uint32_t *seed, double low, double high)
{
    *seed = *seed * 1664525u + 1013904223u;
    return low + (high - low) * (*seed >> 8) / 0x1p24;
}

static nebel_renderer *make_renderer(const nebel_scene_data *scene)
{
    nebel_renderer *renderer = NULL;
    assert_int_equal(nebel_create_cpu_renderer(scene, NULL, &(nebel_cpu_renderer_desc){.thread_count = 1}, &renderer),
                     NEBEL_OK);
    return renderer;
}

/* Cameras around, above, below and inside the ball, where triangles cross the camera's plane. */
static void test_raster_and_rays_agree(void **state)
{
    (void)state;
    static test_ball ball;
    test_ball_make(&ball, (const double[3]){0, 0, 0});
    nebel_renderer *renderer = make_renderer(&ball.scene);
    test_both *both = make_both();
    uint32_t seed = 11;
    for (int i = 0; i < 200; i++) {
        nebel_camera camera =
            test_camera(random_within(&seed, -3, 3), random_within(&seed, -3, 3), random_within(&seed, -3, 3),
                        random_within(&seed, -1, 1), random_within(&seed, -1, 1), random_within(&seed, -1, 1));
        camera.vertical_fov = random_within(&seed, 5, 150);
        camera.view_height = random_within(&seed, .1, 30);
        camera.projection = i % 2 ? NEBEL_PROJECTION_ORTHOGRAPHIC : NEBEL_PROJECTION_PERSPECTIVE;
        compare_region(renderer, &camera, i % 3 ? 1 : 4, both);
    }
    assert_true(both->hits > 200 * PIXELS / 2);
    assert_in_range(both->differences, 0, 20); /* points on an outline */
    assert_true(both->largest < 1e-3f);
    free(both);
    nebel_destroy_renderer(renderer);
}

static void test_scale_does_not_matter(void **state)
{
    (void)state;
    static test_ball ball;
    test_both *both = make_both();
    int hits = 0;
    for (int power = -5; power <= 9; power += 7) {
        const double scale = pow(10, power);
        test_ball_make(&ball, (const double[3]){0, 0, 0});
        test_ball_set_vertices(&ball, (float)scale);
        ball.scene.mesh_count = 1;
        nebel_renderer *renderer = make_renderer(&ball.scene);
        const nebel_camera camera = test_camera(scale, 2 * scale, 2 * scale, 0, 0, 0);
        both->hits = 0;
        compare_region(renderer, &camera, 1, both);
        if (power == -5) hits = both->hits;
        assert_in_range(both->hits, hits - 2, hits + 2);
        nebel_destroy_renderer(renderer);
    }
    assert_in_range(both->differences, 0, 4);
    assert_true(hits > PIXELS / 8);
    free(both);
}

static void test_nothing_slips_through_a_closed_ball(void **state)
{
    (void)state;
    static test_ball ball;
    test_ball_make(&ball, (const double[3]){0, 0, 0});
    ball.scene.mesh_count = 1;
    nebel_renderer *renderer = make_renderer(&ball.scene);
    test_both *both = make_both();
    uint32_t seed = 5;
    for (int i = 0; i < 100; i++) {
        nebel_camera camera = test_camera(random_within(&seed, -.3, .3), random_within(&seed, -.3, .3),
                                          random_within(&seed, -.3, .3), 0, i % 2 ? 1 : -1, 0);
        camera.up[1] = 0;
        camera.up[2] = 1;
        camera.vertical_fov = random_within(&seed, 1, 170);
        compare_region(renderer, &camera, i % 3 ? 1 : 4, both);
    }
    assert_int_equal(both->misses, 0);
    free(both);
    nebel_destroy_renderer(renderer);
}

enum { GRID = 2 * SIDE };

/* A hilly grid with a spacing of one pixel, turned about the view. */
static void set_grid(float (*positions)[3], double angle)
{
    for (uint32_t i = 0; i < GRID * GRID; i++) {
        const double x = .1 * (i % GRID + .5 - SIDE), z = .1 * (i / GRID + .5 - SIDE);
        positions[i][0] = (float)(x * cos(angle) - z * sin(angle));
        positions[i][1] = .01f * (float)(i * 7 % 13);
        positions[i][2] = (float)(x * sin(angle) + z * cos(angle));
    }
}

static void set_grid_indices(uint32_t (*indices)[6])
{
    for (uint32_t i = 0; i < (GRID - 1) * (GRID - 1); i++) {
        const uint32_t a = i / (GRID - 1) * GRID + i % (GRID - 1);
        const uint32_t corners[6] = {a, a + GRID, a + 1, a + 1, a + GRID, a + GRID + 1};
        memcpy(indices[i], corners, sizeof corners);
    }
}

static float grid_positions[GRID * GRID][3];
static uint32_t grid_indices[(GRID - 1) * (GRID - 1)][6];

static nebel_mesh make_grid(void)
{
    set_grid_indices(grid_indices);
    return (nebel_mesh){.positions = grid_positions[0],
                        .indices = grid_indices[0],
                        .vertex_count = GRID * GRID,
                        .triangle_count = 2 * (GRID - 1) * (GRID - 1),
                        .texture = -1};
}

/* Every sample lies on a corner where six triangles meet, but for rounding errors. */
static void test_nothing_slips_through_corners_under_samples(void **state)
{
    (void)state;
    const nebel_mesh mesh = make_grid();
    const nebel_scene_data scene = {.mesh_count = 1, .meshes = &mesh};
    test_both *both = make_both();
    for (int i = 0; i < 10; i++) {
        const double angle = .3 * i;
        set_grid(grid_positions, angle);
        nebel_renderer *renderer = make_renderer(&scene);
        nebel_camera camera = test_camera(0, 5, 0, 0, 0, 0);
        camera.up[0] = sin(angle);
        camera.up[1] = 0;
        camera.up[2] = -cos(angle);
        camera.projection = NEBEL_PROJECTION_ORTHOGRAPHIC;
        camera.view_height = .1 * SIDE;
        compare_region(renderer, &camera, 1, both);
        nebel_destroy_renderer(renderer);
    }
    assert_int_equal(both->misses, 0);
    free(both);
}

/* 32,000 triangles: more than wait at a time, and a tree of four levels. The picture's right and lower edges are within
 * regions that are not compared, two meshes share the others. */
static void test_regions_and_samples_of_a_picture(void **state)
{
    (void)state;
    const nebel_mesh mesh = make_grid();
    nebel_mesh meshes[2] = {mesh, mesh};
    meshes[1].triangle_count = 5001;
    meshes[0].triangle_count -= 5001;
    meshes[0].indices += 3 * 5001;
    const nebel_scene_data scene = {.mesh_count = 2, .meshes = meshes};
    set_grid(grid_positions, .2);
    nebel_renderer *renderer = make_renderer(&scene);
    test_both *both = make_both();
    for (int i = 0; i < 4; i++) {
        nebel_camera camera = test_camera(.5, 6 - i, 4, .2, 0, 0);
        camera.vertical_fov = 60 + 10 * i;
        camera.view_height = 10;
        camera.projection = i % 2 ? NEBEL_PROJECTION_ORTHOGRAPHIC : NEBEL_PROJECTION_PERSPECTIVE;
        compare_picture(renderer, &camera, 3 * SIDE + 9, 2 * SIDE + 5, i < 2 ? NB_TOGETHER : 1, both);
    }
    assert_true(both->hits > 10 * 6 * PIXELS / 2);
    assert_true(both->misses > PIXELS);
    assert_in_range(both->differences, 0, 60); /* points on an outline */
    free(both);
    nebel_destroy_renderer(renderer);
}

/* The nearer of two squares wins, in whatever order they come; of equal ones the first. */
static void test_nearer_surfaces_hide_farther_ones(void **state)
{
    (void)state;
    nebel_mesh meshes[2] = {test_square(), test_square()};
    const nebel_scene_data scene = {.mesh_count = 2, .meshes = meshes};
    const double heights[3][2] = {{0, .001}, {.001, 0}, {0, 0}};
    const uint32_t expected[3] = {1, 0, 0};
    test_both *both = make_both();
    for (int i = 0; i < 6; i++) {
        meshes[0].origin[1] = heights[i / 2][0];
        meshes[1].origin[1] = heights[i / 2][1];
        nebel_renderer *renderer = make_renderer(&scene);
        nebel_camera camera = test_camera(0, 3, 0, 0, 0, 0);
        camera.vertical_fov = 20;
        camera.view_height = 1;
        camera.projection = i % 2 ? NEBEL_PROJECTION_ORTHOGRAPHIC : NEBEL_PROJECTION_PERSPECTIVE;
        compare_region(renderer, &camera, 1, both);
        for (int k = 0; k < NB_BATCH; k++) assert_int_equal(both->raster.surface[k], expected[i / 2]);
        nebel_destroy_renderer(renderer);
    }
    free(both);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_raster_and_rays_agree),
        cmocka_unit_test(test_scale_does_not_matter),
        cmocka_unit_test(test_nothing_slips_through_a_closed_ball),
        cmocka_unit_test(test_nothing_slips_through_corners_under_samples),
        cmocka_unit_test(test_regions_and_samples_of_a_picture),
        cmocka_unit_test(test_nearer_surfaces_hide_farther_ones),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
