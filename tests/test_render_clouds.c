/* Clouds in pictures of the CPU: among the air along a ray, behind and before surfaces, on any number of threads. */
#include "planet_help.h"
#include "test_render_scene.h"

enum { WIDTH = 48, HEIGHT = 27 };

typedef struct world {
    nebel_atmosphere *atmosphere;
    nebel_clouds *clouds;
    nebel_planet planet;
    nebel_scene_data scene;
} world;

static void make_world(const nebel_cloud_layer *layer, world *w)
{
    static const double sun[3] = {.6, .64, .48};
    *w = (world){.planet = {.air = *nebel_find_atmosphere("earth"), .sun_left = {1, 1, 1}, .cloud_layer_count = 1}};
    assert_int_equal(nebel_create_atmosphere(&w->planet.air, &w->atmosphere), NEBEL_OK);
    nebel_clouds_desc desc = {.atmosphere = w->atmosphere, .layer_count = 1};
    desc.layers[0] = *layer;
    assert_int_equal(nebel_create_clouds(&desc, &w->clouds), NEBEL_OK);
    w->planet.atmosphere = w->atmosphere;
    w->planet.clouds = w->clouds;
    w->scene = (nebel_scene_data){.has_sun = 1, .sun_irradiance = {5, 4, 3}, .planet_count = 1, .planets = &w->planet};
    memcpy(w->scene.sun_direction, sun, sizeof sun);
}

static void free_world(world *w)
{
    nebel_destroy_clouds(w->clouds);
    nebel_destroy_atmosphere(w->atmosphere);
}

static test_picture render(const world *w, const nebel_camera *camera, int threads, uint32_t samples, double time)
{
    nebel_renderer *renderer;
    const test_picture picture = test_picture_make(WIDTH, HEIGHT);
    assert_int_equal(nebel_create_renderer(&w->scene, NULL, &(nebel_renderer_desc){.threads = threads}, &renderer),
                     NEBEL_OK);
    const nebel_frame_desc desc = {
        .camera = *camera, .width = WIDTH, .height = HEIGHT, .samples = samples, .time = time};
    assert_int_equal(nebel_render_frame(renderer, &desc, &picture.planes), NEBEL_OK);
    nebel_destroy_renderer(renderer);
    return picture;
}

static nebel_light air_to(const world *w, const nebel_sun *sun, nebel_ray ray, double t)
{
    nebel_light light;
    ray.t_max = t;
    assert_int_equal(nebel_trace_air(w->atmosphere, sun, 1, &ray, 0, &light, 0), NEBEL_OK);
    return light;
}

/* Air up to t in the shade of clouds. */
static nebel_light shaded_to(const world *w, const nebel_sun *sun, const nebel_ray *ray, const nebel_air_shade *shade,
                             double t)
{
    nebel_light light = air_to(w, sun, *ray, t);
    for (uint32_t k = 0; k < shade->count && (double)shade->t[k] < t; k++) {
        const nebel_light a = air_to(w, sun, *ray, (double)shade->t[k]),
                          b = air_to(w, sun, *ray, fmin(t, (double)shade->t[k + 1]));
        for (int c = 0; c < 3; c++)
            light.in_scattering[c] -= (1 - (double)shade->part[k][c]) * (b.in_scattering[c] - a.in_scattering[c]);
    }
    return light;
}

/* The table of air in pictures is off by up to 2.7e-2 for rays that end in it. Clouds and air in short pieces: sum of T_air dS_cloud + T_cloud dS_air, with clouds as a straight line between knots. */
static void compose(const world *w, const nebel_sun *sun, const nebel_ray *ray, const nebel_cloud_knots *knots,
                    const nebel_air_shade *shade, double light[3])
{
    enum { STEPS = 24 };
    const nebel_light all = shaded_to(w, sun, ray, shade, HUGE_VAL);
    const uint32_t last = knots->count - 1;
    nebel_light before = shaded_to(w, sun, ray, shade, knots->count > 0 ? (double)knots->t[0] : 0);
    for (int c = 0; c < 3; c++) light[c] = knots->count > 0 ? before.in_scattering[c] : 0;
    for (uint32_t k = 1; k < knots->count; k++)
        for (int i = 1; i <= STEPS; i++) {
            const double part = (double)i / STEPS,
                         t = (double)knots->t[k - 1] * (1 - part) + (double)knots->t[k] * part;
            const double left = (double)knots->transmittance[k - 1] +
                                (part - .5 / STEPS) * (double)(knots->transmittance[k] - knots->transmittance[k - 1]);
            const nebel_light here = shaded_to(w, sun, ray, shade, t);
            for (int c = 0; c < 3; c++)
                light[c] += left * (here.in_scattering[c] - before.in_scattering[c]) +
                            .5 * (here.transmittance[c] + before.transmittance[c]) / STEPS *
                                (double)(knots->in_scattering[k][c] - knots->in_scattering[k - 1][c]);
            before = here;
        }
    for (int c = 0; c < 3; c++)
        light[c] += (knots->count > 0 ? (double)knots->transmittance[last] : 1) *
                    (all.in_scattering[c] - (knots->count > 0 ? before.in_scattering[c] : 0));
}

static void clouds_and_air_are_one(void **state)
{
    (void)state;
    static const struct {
        double height, pitch;
    } views[] = {{2, .4}, {1500, .1}, {9000, -.5}};
    for (size_t v = 0; v < sizeof views / sizeof *views; v++) {
        world w;
        nebel_cloud_view *view;
        nebel_cloud_workspace *workspace;
        make_world(&(nebel_cloud_layer){.coverage = .5, .extinction = .01}, &w);
        nebel_sun sun = {.irradiance = {5, 4, 3}};
        memcpy(sun.direction, w.scene.sun_direction, sizeof sun.direction);
        assert_int_equal(nebel_create_cloud_view(&(nebel_cloud_view_desc){.clouds = w.clouds, .sun = sun}, &view),
                         NEBEL_OK);
        assert_int_equal(nebel_create_cloud_workspace(view, &workspace), NEBEL_OK);
        const nebel_camera camera = planet_camera(views[v].height, views[v].pitch);
        test_picture picture = render(&w, &camera, 2, 1, 0);
        const double spread = 2 * tan(30 * test_pi / 180) / HEIGHT;
        double worst = 0;
        int cloudy = 0;
        for (uint32_t i = 0; i < WIDTH * HEIGHT; i++) {
            const nebel_ray ray = planet_ray(&camera, views[v].pitch, i % WIDTH, i / WIDTH, WIDTH, HEIGHT);
            const double length = sqrt(pow(ray.direction[0], 2) + pow(ray.direction[1], 2) + pow(ray.direction[2], 2));
            nebel_cloud_knots knots;
            nebel_air_shade shade;
            double light[3];
            assert_int_equal(nebel_shade_air(workspace, 1, &ray, 0, &shade, 0), NEBEL_OK);
            assert_int_equal(nebel_trace_clouds(workspace, 1, &ray, 0, spread / length, &knots, 0), NEBEL_OK);
            compose(&w, &sun, &ray, &knots, &shade, light);
            cloudy += knots.count > 0;
            for (int c = 0; c < 3; c++)
                worst = fmax(worst, fabs((double)picture.planes.in_scattering[3 * i + (uint32_t)c] - light[c]));
        }
        print_message("from %g m: %d pixels with clouds, off by %.2g at most\n", views[v].height, cloudy, worst);
        assert_true(cloudy > WIDTH * HEIGHT / 16 && worst < 3e-2);
        test_picture_free(&picture);
        nebel_destroy_cloud_workspace(workspace);
        nebel_destroy_cloud_view(view);
        free_world(&w);
    }
}

/* Bits are the same on any number of threads; time moves clouds that have wind, and a second sample changes little. */
static void pictures_are_still(void **state)
{
    (void)state;
    world w;
    make_world(&(nebel_cloud_layer){.wind = {300, 0}}, &w);
    const nebel_camera camera = planet_camera(2, .4);
    test_picture pictures[3] = {render(&w, &camera, 1, 1, 0), render(&w, &camera, 3, 1, 0),
                                render(&w, &camera, 2, 1, 7)};
    const size_t size = (size_t)WIDTH * HEIGHT * 3;
    double moved = 0;
    assert_memory_equal(pictures[0].planes.color, pictures[1].planes.color, size * sizeof(float));
    for (size_t i = 0; i < size; i++)
        moved = fmax(moved, fabs((double)pictures[0].planes.color[i] - (double)pictures[2].planes.color[i]));
    assert_true(moved > .1);
    for (int i = 0; i < 3; i++) test_picture_free(&pictures[i]);
    free_world(&w);
}

/* A wall that stands in clouds is seen through as much of them as a ray to it meets, also beside its edge. */
static void clouds_end_at_surfaces(void **state)
{
    (void)state;
    static const float corners[4][3] = {{-3e3f, -3e3f, 0}, {0, -3e3f, 0}, {0, 3e3f, 0}, {-3e3f, 3e3f, 0}};
    static const uint32_t indices[6] = {0, 1, 2, 0, 2, 3};
    const double height = 1500, way = 2000;
    world w;
    nebel_cloud_view *view;
    nebel_cloud_workspace *workspace;
    make_world(&(nebel_cloud_layer){.coverage = .9, .extinction = .002}, &w);
    const nebel_mesh wall = {.origin = {0, height, -way},
                             .positions = corners[0],
                             .indices = indices,
                             .vertex_count = 4,
                             .triangle_count = 2,
                             .base_color = {1, 1, 1},
                             .texture = -1};
    w.scene.mesh_count = 1;
    w.scene.meshes = &wall;
    nebel_sun sun = {.irradiance = {5, 4, 3}};
    memcpy(sun.direction, w.scene.sun_direction, sizeof sun.direction);
    assert_int_equal(nebel_create_cloud_view(&(nebel_cloud_view_desc){.clouds = w.clouds, .sun = sun}, &view),
                     NEBEL_OK);
    assert_int_equal(nebel_create_cloud_workspace(view, &workspace), NEBEL_OK);
    const nebel_camera camera = planet_camera(height, 0);
    test_picture picture = render(&w, &camera, 2, 4, 0);
    double worst = 0;
    int cloudy = 0;
    for (uint32_t i = 0; i < WIDTH * HEIGHT; i++) {
        nebel_ray ray = planet_ray(&camera, 0, i % WIDTH, i / WIDTH, WIDTH, HEIGHT);
        const double length = sqrt(pow(ray.direction[0], 2) + pow(ray.direction[1], 2) + pow(ray.direction[2], 2));
        nebel_cloud_knots knots;
        if (i % WIDTH >= WIDTH / 2) continue;
        ray.t_max = way * length / fabs(ray.direction[2]);
        assert_int_equal(
            nebel_trace_clouds(workspace, 1, &ray, 0, 2 * tan(30 * test_pi / 180) / HEIGHT / length, &knots, 0),
            NEBEL_OK);
        const double left = knots.count > 0 ? (double)knots.transmittance[knots.count - 1] : 1;
        const nebel_light air = air_to(&w, &sun, ray, ray.t_max);
        cloudy += left > .05 && left < .95;
        worst = fmax(worst, fabs((double)picture.planes.transmittance[3 * i + 1] - left * air.transmittance[1]));
    }
    print_message("a wall in clouds: %d pixels see it through some, off by %.2g at most\n", cloudy, worst);
    assert_true(cloudy > 60 && worst < 1e-2);
    test_picture_free(&picture);
    nebel_destroy_cloud_workspace(workspace);
    nebel_destroy_cloud_view(view);
    free_world(&w);
}

static void the_ground_has_shadows(void **state)
{
    (void)state;
    world w;
    make_world(&(nebel_cloud_layer){.coverage = .5}, &w);
    w.planet.air.ground_albedo[1] = .5;
    const nebel_camera camera = planet_camera(800, -.6);
    test_picture picture = render(&w, &camera, 2, 1, 0);
    double darkest = HUGE_VAL, brightest = 0;
    for (size_t i = 0; i < (size_t)WIDTH * HEIGHT; i++) {
        darkest = fmin(darkest, (double)picture.planes.color[3 * i + 1]);
        brightest = fmax(brightest, (double)picture.planes.color[3 * i + 1]);
    }
    assert_true(brightest > 2 * darkest);
    test_picture_free(&picture);
    free_world(&w);
}

/* A black wall under clouds. */
static test_picture render_wall(world *w, double way, const nebel_camera *camera)
{
    static const float corners[4][3] = {{-3e4f, -3e4f, 0}, {3e4f, -3e4f, 0}, {3e4f, 3e4f, 0}, {-3e4f, 3e4f, 0}};
    static const uint32_t indices[6] = {0, 1, 2, 0, 2, 3};
    const nebel_mesh wall = {.origin = {0, 0, -way},
                             .positions = corners[0],
                             .indices = indices,
                             .vertex_count = 4,
                             .triangle_count = 2,
                             .texture = -1};
    w->scene.mesh_count = 1;
    w->scene.meshes = &wall;
    return render(w, camera, 2, 1, 0);
}

/* Of sunlight straight down: the optical depth in short steps, and the slab of delta-Eddington's slab (Joseph, Wiscombe and Weinman 1976). */
static double let_through(const nebel_clouds *clouds, double x, double z)
{
    enum { STEPS = 200 };
    const double g = .86, wide = g / (1 + g), low = 1500, high = 2500;
    double depth = 0;
    for (int i = 0; i < STEPS; i++) {
        const double place[1][3] = {{x, low + (high - low) * (i + .5) / STEPS, z}};
        float extinction;
        assert_int_equal(nebel_cloud_extinction(clouds, 0, 0, 1, place, 0, &extinction), NEBEL_OK);
        depth += (double)extinction * (high - low) / STEPS;
    }
    const double apart = (1 - g * g) * depth;
    return (5 - exp(-apart)) / (4 + 3 * (1 - wide) * apart);
}

/* Under closed clouds air before a wall has that part of its light which they let through from above, where the sun is, too. */
static void air_under_clouds_is_dim(void **state)
{
    (void)state;
    enum { PLACES = 24 };
    const double way = 4000;
    world w;
    make_world(&(nebel_cloud_layer){.kind = NEBEL_CLOUD_STRATUS, .base = 1500, .top = 2500, .coverage = 1}, &w);
    memcpy(w.scene.sun_direction, (const double[3]){0, 1, 0}, sizeof w.scene.sun_direction);
    const nebel_camera camera = planet_camera(100, 0);
    test_picture under = render_wall(&w, way, &camera);
    w.planet.clouds = NULL;
    test_picture clear = render_wall(&w, way, &camera);
    w.planet.clouds = w.clouds;
    double sum[3] = {0, 0, 0}, of[3] = {0, 0, 0}, through = 0;
    int count = 0;
    for (uint32_t y = 0; y < HEIGHT; y++)
        for (uint32_t x = 0; x < WIDTH; x++) {
            const size_t i = (size_t)y * WIDTH + x;
            const nebel_ray ray = planet_ray(&camera, 0, x, y, WIDTH, HEIGHT);
            if (clear.planes.depth[i] < 3900 || ray.direction[1] > .3) continue; /* the ground; clouds */
            for (int c = 0; c < 3; c++) {
                sum[c] += (double)under.planes.in_scattering[3 * i + (size_t)c];
                of[c] += (double)clear.planes.in_scattering[3 * i + (size_t)c];
            }
            for (int k = 0; k < PLACES && y == HEIGHT / 2; k++, count++) {
                const double t = way * (k + .5) / PLACES;
                through += let_through(w.clouds, t * ray.direction[0], t * ray.direction[2]);
            }
        }
    through /= count;
    print_message("closed clouds let %.3f through; air has %.3f %.3f %.3f of its light\n", through, sum[0] / of[0],
                  sum[1] / of[1], sum[2] / of[2]);
    assert_true(count > 0 && through < .5);
    for (int c = 0; c < 3; c++) assert_true(fabs(sum[c] / of[c] / through - 1) < .1);
    test_picture_free(&under);
    test_picture_free(&clear);
    free_world(&w);
}

/* Where the weather has no clouds, all is as without them, to the last bit. */
static void no_clouds_change_nothing(void **state)
{
    (void)state;
    static const float none = 0;
    world w;
    make_world(&(nebel_cloud_layer){.weather = {1, 1, 1, &none}}, &w);
    const nebel_camera camera = planet_camera(2, .4);
    test_picture with = render_wall(&w, 4000, &camera); /* with it both have tables for rays that end in the air */
    w.planet.clouds = NULL;
    test_picture without = render_wall(&w, 4000, &camera);
    w.planet.clouds = w.clouds;
    assert_memory_equal(with.planes.color, without.planes.color, (size_t)WIDTH * HEIGHT * 3 * sizeof(float));
    test_picture_free(&with);
    test_picture_free(&without);
    free_world(&w);
}

static void bad_times_are_refused(void **state)
{
    (void)state;
    world w;
    nebel_renderer *renderer;
    make_world(&(nebel_cloud_layer){.seed = 1}, &w);
    test_picture picture = test_picture_make(WIDTH, HEIGHT);
    assert_int_equal(nebel_create_renderer(&w.scene, NULL, &(nebel_renderer_desc){.threads = 1}, &renderer), NEBEL_OK);
    nebel_frame_desc desc = {
        .camera = planet_camera(2, 0), .width = WIDTH, .height = HEIGHT, .samples = 1, .time = (double)NAN};
    assert_int_equal(nebel_render_frame(renderer, &desc, &picture.planes), NEBEL_ERROR_VALUE);
    desc.time = 0;
    assert_int_equal(nebel_render_frame(renderer, &desc, &picture.planes), NEBEL_OK);
    nebel_destroy_renderer(renderer);
    test_picture_free(&picture);
    free_world(&w);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(clouds_and_air_are_one),  cmocka_unit_test(pictures_are_still),
        cmocka_unit_test(clouds_end_at_surfaces),  cmocka_unit_test(the_ground_has_shadows),
        cmocka_unit_test(air_under_clouds_is_dim), cmocka_unit_test(no_clouds_change_nothing),
        cmocka_unit_test(bad_times_are_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
