/* What pixels of a width see of clouds, against thin rays within them: how much comes through, and what light. */
#include "clouds/cloud_lighting.h"

#include "cloud_help.h"
#include "dice.h"
#include "near.h"
#include "unit.h"

#include "math/vector.h"

#include <math.h>

/* As many pixels as are tried of `full`: a quarter at least, for means of fewer would be off by chance. */
static int pixels_of(int full)
{
    const int count = (int)nb_test_count((size_t)full);
    return count > full / 4 ? count : full / 4;
}

/* From afar a cloud is the mean of what is seen near. */
static void test_wide_pixels_see_means(void **state)
{
    (void)state;
    nebel_clouds *clouds = make(1, (const nebel_cloud_layer[]){{.coverage = .5}});
    double near = 0, far = 0;
    enum { COUNT = 40000 };
    uint64_t numbers = 3;
    for (int i = 0; i < COUNT; i++) {
        const double x = dice(&numbers, -3e5, 3e5), z = dice(&numbers, -3e5, 3e5);
        near += (double)above(clouds, 1300, x, RADIUS, z, 0) / COUNT;
        far += (double)above(clouds, 1300, x, RADIUS, z, 3000) / COUNT;
    }
    print_message("mean extinction %.4g, of wide pixels %.4g\n", near, far);
    assert_near(far, near, .25 * near);
    nebel_destroy_clouds(clouds);
}

/* Through pixels that hide heaps as much comes as through many thin rays within them: in the mean over 300 pixels from
 * 400 km above the ground, whose rays lead so far aside for each metre down, or 0.6 more or less. */
static void compare_wide_pixels(const nebel_cloud_layer *layer, double aside, size_t turn)
{
    enum { RAYS = 24 };
    const int pixels = pixels_of(300);
    static const double spreads[] = {4e-4, 1.3e-3, 5e-3};
    nebel_clouds *clouds = make(1, layer);
    const nb_cloud_layer *made = &clouds->layers[0];
    nebel_cloud_workspace *workspace;
    nebel_cloud_lighting *view = view_of(clouds, 0, &workspace);
    uint64_t numbers = 23;
    for (size_t s = 0; s < sizeof spreads / sizeof *spreads; s++) {
        double seen = 0, truth = 0;
        if (!nb_test_tries((s + turn) % 3, 3)) continue;
        for (int i = 0; i < pixels; i++) {
            const double x = aside + dice(&numbers, -.6, .6), z = dice(&numbers, -.6, .6);
            const nebel_ray ray = {{0, 4e5, 0}, {x, -1, z}, HUGE_VAL};
            const double length = sqrt(1 + x * x + z * z);
            nebel_cloud_transfer nodes;
            assert_int_equal(nebel_trace_clouds(workspace, 1, &ray, 0, spreads[s], NULL, &nodes, 0), NEBEL_OK);
            seen += (nodes.count > 0 ? (double)nodes.transmittance[nodes.count - 1] : 1) / pixels;
            for (int k = 0; k < RAYS; k++) {
                const double half = .5 * spreads[s] * length, a = x + dice(&numbers, -half, half);
                const double b = z + dice(&numbers, -half, half), down = sqrt(1 + a * a + b * b);
                const nebel_ray thin = {{0, 4e5, 0}, {a / down, -1 / down, b / down}, HUGE_VAL};
                double pieces[2][2];
                assert_int_equal(nb_cloud_pieces(made->low, made->high, (const double[3]){0, RADIUS + 4e5, 0},
                                                 thin.direction, 3e6, pieces),
                                 1);
                truth += brute_force(clouds, &thin, pieces[0][0], pieces[0][1], 20) / (pixels * RAYS);
            }
        }
        print_message("pixels of %.0f m, %.1f aside: %.3f of the light comes through, %.3f through thin rays\n",
                      4e5 * spreads[s] * sqrt(1 + aside * aside), aside, seen, truth);
        assert_near(seen, truth, .05);
    }
    nebel_destroy_cloud_workspace(workspace);
    nebel_destroy_cloud_lighting(view);
    nebel_destroy_clouds(clouds);
}

static void test_wide_pixels_let_as_much_through(void **state)
{
    (void)state;
    for (int i = 0; i < 2; i++) {
        const nebel_cloud_layer layers[] = {
            {.coverage = .4}, {.type = NEBEL_CLOUD_STRATUS, .coverage = .6}, {.type = NEBEL_CLOUD_CIRRUS}};
        for (size_t k = 0; k < 3; k++)
            if (nb_test_tries((k + (size_t)i) % 2, 2)) compare_wide_pixels(&layers[k], 1.6 * i, k);
    }
}

/* The light of pixels that do not hide heaps is that of thin rays within them: in the mean over some from 200 km, straight down, and
 * aslant towards the sun and away from it. */
static void compare_light_of_pixels(const nebel_cloud_layer *layer)
{
    enum { RAYS = 6 };
    const int pixels = pixels_of(600);
    static const double widths[] = {10, 40, 100}, directions[][3] = {{0, -1, 0}, {.7, -.7, .1}, {-.8, -.3, -.5}};
    const double far = 2e5;
    nebel_clouds *clouds = make(1, layer);
    nebel_cloud_workspace *workspace;
    nebel_cloud_lighting *view = view_of(clouds, 0, &workspace);
    uint64_t numbers = 5;
    for (int i = 0; i < 9; i++) {
        const double *unit = directions[i / 3], width = widths[i % 3];
        if (!nb_test_tries((size_t)(i % 3 + i / 3) % 3, 3)) continue;
        double seen = 0, truth = 0, middle[2] = {0, 0};
        for (int k = 0; k < pixels * RAYS; k++) {
            const int is_first = k % RAYS == 0;
            for (int c = 0; c < 2 && is_first; c++) middle[c] = dice(&numbers, -2e4, 2e4);
            const double x = middle[0] + dice(&numbers, -.5, .5) * width,
                         z = middle[1] + dice(&numbers, -.5, .5) * width;
            const nebel_ray pixel = {{middle[0] - far * unit[0], 1500 - far * unit[1], middle[1] - far * unit[2]},
                                     {unit[0], unit[1], unit[2]},
                                     HUGE_VAL};
            const nebel_ray thin = {
                {x - far * unit[0], 1500 - far * unit[1], z - far * unit[2]}, {unit[0], unit[1], unit[2]}, HUGE_VAL};
            nebel_cloud_transfer nodes;
            assert_int_equal(nebel_trace_clouds(workspace, 1, &thin, 0, 1 / far, NULL, &nodes, 0), NEBEL_OK);
            if (nodes.count > 0) truth += (double)nodes.in_scattering[nodes.count - 1][1] / (pixels * RAYS);
            if (!is_first) continue;
            assert_int_equal(nebel_trace_clouds(workspace, 1, &pixel, 0, width / far, NULL, &nodes, 0), NEBEL_OK);
            if (nodes.count > 0) seen += (double)nodes.in_scattering[nodes.count - 1][1] / pixels;
        }
        print_message("pixels of %.0f m: light of %.4f, of thin rays %.4f\n", width, seen, truth);
        assert_near(seen, truth, .1 * truth);
    }
    nebel_destroy_cloud_workspace(workspace);
    nebel_destroy_cloud_lighting(view);
    nebel_destroy_clouds(clouds);
}

static void test_light_of_pixels(void **state)
{
    (void)state;
    compare_light_of_pixels(&(nebel_cloud_layer){.coverage = .5});
    compare_light_of_pixels(&(nebel_cloud_layer){.type = NEBEL_CLOUD_STRATUS});
}

typedef struct nb_shown {
    double mean, deviation; /* of light */
} nb_shown;

/* Light of pixels of a width anywhere in 200 x 200 km. */
static nb_shown show_pixels(nebel_cloud_workspace *workspace, const double unit[3], double width, int count,
                            uint64_t *numbers)
{
    const double far = 2e5;
    double sum = 0, squares = 0;
    for (int i = 0; i < count; i++) {
        const double x = dice(numbers, -1e5, 1e5), z = dice(numbers, -1e5, 1e5);
        const nebel_ray ray = {
            {x - far * unit[0], 1500 - far * unit[1], z - far * unit[2]}, {unit[0], unit[1], unit[2]}, HUGE_VAL};
        nebel_cloud_transfer nodes;
        assert_int_equal(nebel_trace_clouds(workspace, 1, &ray, 0, width / far, NULL, &nodes, 0), NEBEL_OK);
        const double light = nodes.count > 0 ? (double)nodes.in_scattering[nodes.count - 1][1] : 0;
        sum += light / count;
        squares += light * light / count;
    }
    return (nb_shown){sum, sqrt(fmax(0, squares - sum * sum))};
}

/* So is that of pixels that hide heaps, which is that of a table, but for places that the table has by chance; and pixels wider
 * than all heaps have no grain. */
static void compare_light_of_crowds(const nebel_cloud_layer *layer, double even, int turn)
{
    static const double widths[] = {440, 2000, 20000}, directions[][3] = {{0, -1, 0}, {.7, -.7, .1}, {-.8, -.3, -.5}};
    nebel_clouds *clouds = make(1, layer);
    nebel_cloud_workspace *workspace;
    nebel_cloud_lighting *view = view_of(clouds, 0, &workspace);
    uint64_t numbers = 29;
    for (int i = 0; i < 3; i++) {
        if (!nb_test_tries((size_t)(i + turn) % 3, 3)) continue;
        const double truth = show_pixels(workspace, directions[i], 10, pixels_of(3600), &numbers).mean;
        for (int k = 0; k < 3; k++) {
            const nb_shown seen = show_pixels(workspace, directions[i], widths[k], pixels_of(3000), &numbers);
            print_message("pixels of %.0f m: light of %.4f, grain of %.4f; of thin rays %.4f\n", widths[k], seen.mean,
                          seen.deviation, truth);
            assert_near(seen.mean, truth, .15 * truth);
            assert_true(widths[k] < 1e4 || seen.deviation < even * truth);
        }
    }
    nebel_destroy_cloud_workspace(workspace);
    nebel_destroy_cloud_lighting(view);
    nebel_destroy_clouds(clouds);
}

static void test_light_of_pixels_that_hide_heaps(void **state)
{
    (void)state;
    compare_light_of_crowds(&(nebel_cloud_layer){.coverage = .5}, .15, 0);
    compare_light_of_crowds(&(nebel_cloud_layer){.type = NEBEL_CLOUD_STRATUS}, .05, 1);
    compare_light_of_crowds(&(nebel_cloud_layer){.type = NEBEL_CLOUD_STRATUS, .coverage = 1}, .02, 2);
}

/* With the sun ten degrees high, along flat rays towards it and away from it: thin rays end on the first cloud, of whose
 * lit rims and tops the mean of all clouds at a height knows nothing. */
static void test_light_under_a_low_sun(void **state)
{
    (void)state;
    static const double directions[][3] = {{.95, -.25, .1}, {-.95, -.25, .1}};
    for (int kind = 0; kind < 2; kind++) {
        nebel_clouds *clouds =
            make(1, &(nebel_cloud_layer){.type = kind == 0 ? NEBEL_CLOUD_CUMULUS : NEBEL_CLOUD_STRATUS});
        nebel_cloud_workspace *workspace;
        nebel_cloud_lighting *view;
        uint64_t numbers = 31;
        const nebel_cloud_lighting_desc desc = {.clouds = clouds,
                                                .sun = {.direction = {.985, .174, 0}, .irradiance = {5, 4, 3}}};
        assert_int_equal(nebel_create_cloud_lighting(&desc, &view), NEBEL_OK);
        assert_int_equal(nebel_create_cloud_workspace(view, &workspace), NEBEL_OK);
        for (int i = 0; i < 2; i++) {
            if (!nb_test_tries((size_t)(i + kind) % 2, 2)) continue;
            const double truth = show_pixels(workspace, directions[i], 10, pixels_of(1200), &numbers).mean;
            const double seen = show_pixels(workspace, directions[i], 20000, pixels_of(1200), &numbers).mean;
            print_message("low sun, pixels of 20 km: light of %.4f, of thin rays %.4f\n", seen, truth);
            assert_near(seen, truth, .15 * truth);
        }
        nebel_destroy_cloud_workspace(workspace);
        nebel_destroy_cloud_lighting(view);
        nebel_destroy_clouds(clouds);
    }
}

/* Mean light of rays from below a layer, so high above the level, over a sixth of the horizon. */
static double show_horizon(nebel_cloud_workspace *workspace, double height, double degrees, double spread)
{
    enum { RAYS = 16 };
    const double rise = sin(degrees * PI / 180), level = cos(degrees * PI / 180);
    double sum = 0;
    for (int i = 0; i < RAYS; i++) {
        const double turn = PI / 3 * (i + .5 - RAYS / 2) / RAYS;
        const nebel_ray ray = {{0, height, 0}, {level * sin(turn), rise, -level * cos(turn)}, HUGE_VAL};
        nebel_cloud_transfer nodes;
        assert_int_equal(nebel_trace_clouds(workspace, 1, &ray, 0, spread, NULL, &nodes, 0), NEBEL_OK);
        assert_true(nodes.count > 0 && nodes.transmittance[nodes.count - 1] < .02f);
        sum += (double)nodes.in_scattering[nodes.count - 1][1] / RAYS;
    }
    return sum;
}

/* From below closed clouds pixels of all widths show what is in their shadow, down to the horizon: none has light of their tops. */
static void compare_horizons(const nebel_cloud_layer *layer, double height, const double degrees[2], double tolerance)
{
    static const double suns[][3] = {{.3, .5, -1}, {.1, .15, -1}, {-.3, .5, 1}}, spreads[] = {6e-4, 2e-3, 5e-3, .03};
    nebel_clouds *clouds = make(1, layer);
    for (int i = 0; i < 3; i++) {
        const nebel_cloud_lighting_desc desc = {
            .clouds = clouds, .sun = {.direction = {suns[i][0], suns[i][1], suns[i][2]}, .irradiance = {5, 4, 3}}};
        nebel_cloud_workspace *workspace;
        nebel_cloud_lighting *view;
        assert_int_equal(nebel_create_cloud_lighting(&desc, &view), NEBEL_OK);
        assert_int_equal(nebel_create_cloud_workspace(view, &workspace), NEBEL_OK);
        for (int k = 0; k < 2; k++) {
            const double thin = show_horizon(workspace, height, degrees[k], 1e-5);
            for (int s = 0; s < 4; s++) {
                const double seen = show_horizon(workspace, height, degrees[k], spreads[s]);
                print_message("sun %d, %.2f degrees: light of %.4f, of thin rays %.4f\n", i, degrees[k], seen, thin);
                assert_near(seen, thin, tolerance * thin);
            }
        }
        nebel_destroy_cloud_workspace(workspace);
        nebel_destroy_cloud_lighting(view);
    }
    nebel_destroy_clouds(clouds);
}

static void test_closed_clouds_are_dark_at_the_horizon(void **state)
{
    (void)state;
    compare_horizons(&(nebel_cloud_layer){.type = NEBEL_CLOUD_STRATUS, .coverage = 1}, 100, (double[]){0, .25}, .05);
    compare_horizons(&(nebel_cloud_layer){.type = NEBEL_CLOUD_STRATUS, .coverage = 1}, 100, (double[]){1, 3}, .05);
    compare_horizons(&(nebel_cloud_layer){.coverage = 1, .cell_size = 2e7}, 2, (double[]){.5, 2}, .1);
}

/* From below no cloud lies downwards, not that of the planet's other side. */
static void test_no_cloud_is_seen_through_the_planet(void **state)
{
    (void)state;
    nebel_clouds *clouds = make(1, &(nebel_cloud_layer){.type = NEBEL_CLOUD_STRATUS, .coverage = 1});
    nebel_cloud_workspace *workspace;
    nebel_cloud_lighting *view = view_of(clouds, 0, &workspace);
    const double from[3] = {0, RADIUS + 250, 0};
    assert_true(nb_cloud_depth_along(workspace, from, (const double[3]){0, 1, 0}, 10, 10, 1) > 5);
    assert_true(nb_cloud_depth_along(workspace, from, (const double[3]){0, -1, 0}, 10, 10, 1) == 0);
    assert_true(nb_cloud_depth_along(workspace, from, (const double[3]){.6, -.8, 0}, 10, 10, 1) == 0);
    nebel_destroy_cloud_workspace(workspace);
    nebel_destroy_cloud_lighting(view);
    nebel_destroy_clouds(clouds);
}

/* From afar pixels are mixed of columns with cloud and without: beyond a sharp edge of the weather there is none, before it there is. */
static void test_weather_ends_where_it_ends(void **state)
{
    (void)state;
    enum { WIDE = 512, HIGH = 256, BELT = 40, ROWS = 180 };
    static float texels[HIGH][WIDE];
    for (int y = 0; y < HIGH; y++)
        for (int x = 0; x < WIDE; x++) texels[y][x] = y > HIGH / 2 - BELT && y < HIGH / 2 + BELT;
    nebel_clouds *clouds = make(1, &(const nebel_cloud_layer){.weather_map = {WIDE, HIGH, 1, texels[0]}});
    nebel_cloud_workspace *workspace;
    nebel_cloud_lighting *view = view_of(clouds, 0, &workspace);
    const double *center = clouds->atmosphere->center, radius = clouds->atmosphere->airs.radius;
    const double step = 2 * tan(25 * PI / 180) / ROWS, edge = PI / HIGH * BELT;
    size_t within = 0, beyond = 0;
    for (int i = 0; i < ROWS * ROWS; i++) {
        if (!nb_test_tries((size_t)i, ROWS * ROWS)) continue;
        const double x = step * (i % ROWS - ROWS / 2), y = step * (i / ROWS - ROWS / 2);
        const nebel_ray ray = {{center[0], center[1], center[2] + 16e6}, {x, y, -1}, HUGE_VAL};
        const double square = 1 + x * x + y * y, under = 16e6 * 16e6 - square * (16e6 * 16e6 - radius * radius);
        nebel_cloud_transfer nodes;
        if (under < 0) continue;
        const double t = (16e6 - sqrt(under)) / square, latitude = fabs(asin(y * t / radius));
        /* A texel, and what a pixel hides. */
        if (fabs(latitude - edge) < PI / HIGH + step * t / radius) continue;
        assert_int_equal(nebel_trace_clouds(workspace, 1, &ray, 0, step, NULL, &nodes, 0), NEBEL_OK);
        if (latitude < edge) within += nodes.count > 0;
        if (latitude > edge) beyond += nodes.count > 0;
    }
    assert_int_equal(beyond, 0);
    assert_true(within > 3 * nb_test_count(ROWS * ROWS) / 10);
    nebel_destroy_cloud_workspace(workspace);
    nebel_destroy_cloud_lighting(view);
    nebel_destroy_clouds(clouds);
}

/* ---- before the sun -------------------------------------------------------------------------- */

typedef struct nb_before_sun {
    nebel_clouds *clouds;
    nebel_cloud_lighting *view;
    nebel_cloud_workspace *workspace;
    double sun[3], across[2][3]; /* across: level, and up */
} nb_before_sun;

static nb_before_sun begin_before_sun(nebel_cloud_type kind, double degrees)
{
    const double rise = sin(degrees * PI / 180), level = cos(degrees * PI / 180);
    nb_before_sun scene = {.clouds = make(1, &(nebel_cloud_layer){.type = kind}),
                           .sun = {0, rise, -level},
                           .across = {{1, 0, 0}, {0, level, rise}}};
    const nebel_cloud_lighting_desc desc = {.clouds = scene.clouds,
                                            .sun = {.direction = {0, rise, -level}, .irradiance = {20, 20, 20}}};
    assert_int_equal(nebel_create_cloud_lighting(&desc, &scene.view), NEBEL_OK);
    assert_int_equal(nebel_create_cloud_workspace(scene.view, &scene.workspace), NEBEL_OK);
    return scene;
}

static void end_before_sun(nb_before_sun *scene)
{
    nebel_destroy_cloud_workspace(scene->workspace);
    nebel_destroy_cloud_lighting(scene->view);
    nebel_destroy_clouds(scene->clouds);
}

typedef struct nb_look {
    double light, left;
} nb_look;

/* From 50 m above the ground, so far beside the sun, in radians. */
static nebel_ray ray_beside_sun(const nb_before_sun *scene, const double from[2], const double aside[2])
{
    nebel_ray ray = {{from[0], 50, from[1]}, {0, 0, 0}, HUGE_VAL};
    for (int c = 0; c < 3; c++)
        ray.direction[c] = scene->sun[c] + aside[0] * scene->across[0][c] + aside[1] * scene->across[1][c];
    return ray;
}

static nb_look look_along(const nb_before_sun *scene, const nebel_ray *ray, double spread)
{
    nebel_cloud_transfer nodes;
    assert_int_equal(nebel_trace_clouds(scene->workspace, 1, ray, 0, spread, NULL, &nodes, 0), NEBEL_OK);
    if (nodes.count == 0) return (nb_look){0, 1};
    return (nb_look){(double)nodes.in_scattering[nodes.count - 1][1], (double)nodes.transmittance[nodes.count - 1]};
}

/* Straight before the sun all light that is scattered once comes through the same cloud, wherever it was scattered: by steps of some metres. */
static double once_before_sun(const nb_before_sun *scene, const nebel_ray *ray, double step)
{
    const nb_cloud_layer *layer = &scene->clouds->layers[0];
    const double from[3] = {ray->origin[0], ray->origin[1] + RADIUS, ray->origin[2]};
    double pieces[2][2], depth = 0, light = 0;
    assert_int_equal(nb_cloud_pieces(layer->low, layer->high, from, ray->direction, HUGE_VAL, pieces), 1);
    for (double t = pieces[0][0] + .5 * step; t < pieces[0][1] && depth < 40; t += step) {
        double place[3];
        for (int c = 0; c < 3; c++) place[c] = ray->origin[c] + t * ray->direction[c];
        const double passed = step * (double)extinction_at(scene->clouds, 0, 0, place[0], place[1], place[2]);
        if (!(passed > 0)) continue;
        place[1] += RADIUS;
        depth += passed;
        light += passed * (double)nb_cloud_clear_light(scene->view, place, nb_vector_length(place)).sun[1];
    }
    float phase[4];
    nb_cloud_phase_at(&layer->phase, nb_vector_dot(ray->direction, scene->sun) / nb_vector_length(ray->direction),
                      phase);
    return light * exp(-depth) * (double)phase[1];
}

static void compare_straight_before_sun(nebel_cloud_type kind, double degrees)
{
    const int rays = pixels_of(400);
    nb_before_sun scene = begin_before_sun(kind, degrees);
    uint64_t numbers = 37;
    double sum = 0, truth = 0, most = 0;
    for (int i = 0; i < rays; i++) {
        const double from[2] = {dice(&numbers, -3e5, 3e5), dice(&numbers, -3e5, 3e5)};
        const nebel_ray ray = ray_beside_sun(&scene, from, (const double[2]){1e-3, 1e-3});
        const nb_look look = look_along(&scene, &ray, 1e-5);
        const double once = look.left < 1 ? once_before_sun(&scene, &ray, kind == NEBEL_CLOUD_CIRRUS ? 60 : 6) : 0;
        sum += look.light / rays;
        truth += once / rays;
        if (look.left < 1e-4) most = fmax(most, look.light - once);
    }
    print_message(
        "kind %d, sun %g degrees high: light of %.4g before it, %.4g scattered once; in the dark at most %.3g more\n",
        (int)kind, degrees, sum, truth, most);
    assert_near(sum, truth, .1 * truth + .5);
    assert_true(most < 6);
    end_before_sun(&scene);
}

static const double heights_of_sun[] = {2.6, 8, 26}; /* degrees */

static void test_light_straight_before_the_sun(void **state)
{
    (void)state;
    for (int kind = 0; kind < NEBEL_CLOUD_TYPE_COUNT; kind++)
        for (int i = 0; i < 3; i++)
            if (nb_test_tries((size_t)(kind + i) % 3, 3))
                compare_straight_before_sun((nebel_cloud_type)kind, heights_of_sun[i]);
}

/* Mean light of pixels, and of thin rays within them: where hardly any light comes through thin rays, and elsewhere. */
typedef struct nb_beside {
    int count;
    double seen, truth, most;
} nb_beside;

static void add_pixel(const nb_before_sun *scene, const double from[2], const double aside[2], double spread,
                      nb_beside sums[2])
{
    enum { SIDE = 3 };
    const nebel_ray middle = ray_beside_sun(scene, from, aside);
    const nb_look seen = look_along(scene, &middle, spread);
    nb_look thin = {0, 0};
    for (int k = 0; k < SIDE * SIDE; k++) {
        const double u = (k % SIDE + .5) / SIDE - .5, v = (k / SIDE + .5) / SIDE - .5;
        const nebel_ray ray =
            ray_beside_sun(scene, from, (const double[2]){aside[0] + u * spread, aside[1] + v * spread});
        const nb_look look = look_along(scene, &ray, 1e-5);
        thin.light += look.light / (SIDE * SIDE);
        thin.left += look.left / (SIDE * SIDE);
    }
    nb_beside *sum = &sums[thin.left > 1e-4];
    sum->count++;
    sum->seen += seen.light;
    sum->truth += thin.light;
    sum->most = fmax(sum->most, seen.light);
}

static void compare_beside_sun(nebel_cloud_type kind, double degrees)
{
    const double spread = 6e-3;
    const int pixels = pixels_of(500);
    static const double angles[] = {.1, .5, 1.5};
    nb_before_sun scene = begin_before_sun(kind, degrees);
    for (size_t i = 0; i < sizeof angles / sizeof *angles; i++) {
        uint64_t numbers = 41;
        nb_beside sums[2] = {{0, 0, 0, 0}, {0, 0, 0, 0}};
        if (!nb_test_tries((i + (size_t)kind) % 3, 3)) continue;
        for (int k = 0; k < pixels; k++) {
            const double from[2] = {dice(&numbers, -3e5, 3e5), dice(&numbers, -3e5, 3e5)};
            const double turn = dice(&numbers, 0, PI), angle = angles[i] * PI / 180;
            add_pixel(&scene, from, (const double[2]){angle * cos(turn), angle * sin(turn)}, spread, sums);
        }
        for (int c = 0; c < 2; c++) {
            const nb_beside *sum = &sums[c];
            if (sum->count < 10) continue;
            const double seen = sum->seen / sum->count, truth = sum->truth / sum->count;
            print_message(
                "kind %d, sun %g degrees high, %.1f beside it: %d %s pixels, light of %.4g, %.4g at most; of thin rays "
                "%.4g\n",
                (int)kind, degrees, angles[i], sum->count, c == 0 ? "dark" : "other", seen, sum->most, truth);
            assert_near(seen, truth, .3 * truth);
        }
    }
    end_before_sun(&scene);
}

/* How much pixels differ falls with their width step by step: a line would be across pictures from above where it falls. */
static void test_heaps_fade_with_the_width_of_pixels(void **state)
{
    (void)state;
    static const double unit[3] = {0, -.42261826174069944, -.9063077870366499};
    nebel_clouds *clouds = make(1, (const nebel_cloud_layer[]){{.coverage = .4}});
    nebel_cloud_workspace *workspace;
    nebel_cloud_lighting *view = view_of(clouds, 0, &workspace);
    double before = 0, least = 1, last = 0;
    for (double width = 250; width < 4000; width *= 1.12) {
        uint64_t numbers = 8;
        const nb_shown shown = show_pixels(workspace, unit, width, 800, &numbers);
        last = shown.deviation / shown.mean;
        if (before > 0) least = fmin(least, last / before);
        before = last;
    }
    print_message(
        "pixels an eighth wider differ by %.2f of what others do at least, those of 4 km by %.2f of their light\n",
        least, last);
    assert_true(least > .75 && last < .6);
    nebel_destroy_cloud_workspace(workspace);
    nebel_destroy_cloud_lighting(view);
    nebel_destroy_clouds(clouds);
}

static void test_light_of_pixels_beside_the_sun(void **state)
{
    (void)state;
    for (int kind = 0; kind < NEBEL_CLOUD_TYPE_COUNT; kind++)
        for (int i = 0; i < 3; i++)
            if (nb_test_tries((size_t)(kind + i) % 3, 3)) compare_beside_sun((nebel_cloud_type)kind, heights_of_sun[i]);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_weather_ends_where_it_ends),
        cmocka_unit_test(test_wide_pixels_see_means),
        cmocka_unit_test(test_wide_pixels_let_as_much_through),
        cmocka_unit_test(test_light_of_pixels),
        cmocka_unit_test(test_heaps_fade_with_the_width_of_pixels),
        cmocka_unit_test(test_light_of_pixels_that_hide_heaps),
        cmocka_unit_test(test_light_under_a_low_sun),
        cmocka_unit_test(test_light_straight_before_the_sun),
        cmocka_unit_test(test_light_of_pixels_beside_the_sun),
        cmocka_unit_test(test_closed_clouds_are_dark_at_the_horizon),
        cmocka_unit_test(test_no_cloud_is_seen_through_the_planet),
    };
    return cmocka_run_group_tests(tests, make_air, free_air);
}
