/* Air and clouds of planets in the reference renderer: against fluxes of layers from the literature, light scattered once by
 * quadrature, sums along rays, and furnaces, which know nothing of each other. */
#include "test_render_scene.h"

#include "cpu/cpu_renderer.h"
#include "dice.h"

#include <nebel/planet.h>

#include <string.h>

/* How many times more paths than in passing: the first argument. */
static uint32_t effort = 1;

/* ---- planets --------------------------------------------------------------------------------- */

typedef struct globe {
    nebel_planet planet;
    nebel_scene_data scene;
    nebel_atmosphere *atmosphere;
    nebel_clouds *clouds;
} globe;

static void set_rgb(double rgb[3], double value)
{
    for (int c = 0; c < 3; c++) rgb[c] = value;
}

static void start(globe *g, const nebel_atmosphere_desc *air, const nebel_cloud_layer *layer)
{
    memset(g, 0, sizeof *g);
    assert_int_equal(nebel_resolve_atmosphere(air, &g->planet.atmosphere_desc), NEBEL_OK);
    assert_int_equal(nebel_create_atmosphere(air, &g->atmosphere), NEBEL_OK);
    g->planet.atmosphere = g->atmosphere;
    if (layer != NULL) {
        const nebel_clouds_desc desc = {.atmosphere = g->atmosphere, .layers = {*layer}, .layer_count = 1};
        g->planet.cloud_layers[0] = *layer; /* with zeros, as scenes have them */
        g->planet.cloud_layer_count = 1;
        assert_int_equal(nebel_create_clouds(&desc, &g->clouds), NEBEL_OK);
        g->planet.clouds = g->clouds;
    }
    g->scene = (nebel_scene_data){.planet_count = 1, .planets = &g->planet};
}

static void shine(globe *g, double elevation, double irradiance)
{
    g->scene.has_sun = 1;
    g->scene.sun_direction[0] = cos(elevation * test_pi / 180);
    g->scene.sun_direction[1] = sin(elevation * test_pi / 180);
    set_rgb(g->scene.sun_irradiance, irradiance);
}

static void end(globe *g)
{
    nebel_destroy_clouds(g->clouds);
    nebel_destroy_atmosphere(g->atmosphere);
}

/* ---- pictures -------------------------------------------------------------------------------- */

enum { SIDE = 16, PIXELS = SIDE * SIDE };

/* Means over a picture. */
typedef struct estimate {
    double color[3], error[3], transmittance[3];
} estimate;

static nebel_ray ray_of(double height, double elevation, double azimuth)
{
    const double e = elevation * test_pi / 180, a = azimuth * test_pi / 180;
    return (nebel_ray){{0, height, 0}, {cos(e) * cos(a), sin(e), cos(e) * sin(a)}, HUGE_VAL};
}

static nebel_camera camera_of(const nebel_ray *ray)
{
    nebel_camera camera = {.vertical_fov = .01};
    camera.up[fabs(ray->direction[1]) > .9 ? 0 : 1] = 1;
    for (int c = 0; c < 3; c++) {
        camera.position[c] = ray->origin[c];
        camera.look_at[c] = ray->origin[c] + ray->direction[c];
    }
    return camera;
}

static nebel_result render(const globe *g, nebel_lighting *fog, const nebel_frame_desc *desc, const nebel_frame *planes)
{
    nebel_renderer *renderer = NULL;
    assert_int_equal(
        nebel_create_cpu_renderer(&g->scene, fog, &(nebel_cpu_renderer_desc){.thread_count = 2}, &renderer), NEBEL_OK);
    assert_int_equal(nebel_set_renderer_method(renderer, NEBEL_METHOD_PATH, NULL), NEBEL_OK);
    const nebel_result result = nebel_render_frame(renderer, desc, planes);
    nebel_destroy_renderer(renderer);
    return result;
}

/* All paths along one ray. */
static estimate look(const globe *g, nebel_lighting *fog, const nebel_ray *ray, uint32_t samples, uint32_t bounces)
{
    static float color[3 * PIXELS], error[3 * PIXELS], transmittance[3 * PIXELS];
    const nebel_frame planes = {.color = color, .transmittance = transmittance, .standard_error = error};
    const nebel_frame_desc desc = {
        .camera = camera_of(ray), .width = SIDE, .height = SIDE, .samples = samples * effort, .bounces = bounces};
    estimate e;
    memset(&e, 0, sizeof e);
    assert_int_equal(render(g, fog, &desc, &planes), NEBEL_OK);
    for (int i = 0; i < 3 * PIXELS; i++) {
        e.color[i % 3] += (double)color[i] / PIXELS;
        e.transmittance[i % 3] += (double)transmittance[i] / PIXELS;
        e.error[i % 3] += pow((double)error[i] / PIXELS, 2);
    }
    for (int c = 0; c < 3; c++) e.error[c] = sqrt(e.error[c]);
    return e;
}

/* Within four standard errors and `least`; and those are less than `part` of it. */
static void expect(const char *what, const estimate *e, int channel, double expected, double least, double part)
{
    const double off = fabs(e->color[channel] - expected), error = e->error[channel];
    if (off > 4 * error + least || error > part * expected)
        fail_msg("%s, channel %d: %g (%g), expected %g", what, channel, e->color[channel], error, expected);
}

/* ---- furnaces -------------------------------------------------------------------------------- */

static const nebel_atmosphere_desc white_air = {
    .components = {{.scattering = {5e-5, 1e-5, 1e-4},
                    .phase = {.type = NEBEL_PHASE_HENYEY_GREENSTEIN, .g = .8},
                    .scale_height = 8000},
                   {.scattering = {1e-5, 1e-5, 4e-5},
                    .phase = {.type = NEBEL_PHASE_RAYLEIGH},
                    .profile = NEBEL_COMPONENT_TENT,
                    .center_height = 25000,
                    .half_width = 15000}},
    .component_count = 2,
    .ground_albedo = {1, 1, 1}};

/* Light that nothing absorbs is the same everywhere: along the ground, down on it, past it and from within clouds and fog. */
static void furnace(const nebel_cloud_layer *layer, nebel_lighting *fog, uint32_t samples)
{
    static const double views[][2] = {{2, 5}, {500, 40}, {3e4, -10}, {4e5, -90}, {4e5, -19.5}};
    globe g;
    start(&g, &white_air, layer);
    set_rgb(g.scene.background, 1);
    set_rgb(g.scene.ambient, 1);
    for (size_t i = 0; i < sizeof views / sizeof *views; i++) {
        const nebel_ray ray = ray_of(views[i][0], views[i][1], 30);
        const estimate e = look(&g, fog, &ray, samples, 0);
        for (int c = 0; c < 3; c++) expect("furnace", &e, c, 1, 1e-6, .02);
    }
    end(&g);
}

static void white_air_over_white_ground_is_white(void **state)
{
    (void)state;
    furnace(NULL, NULL, 20);
}

static void white_clouds_and_fog_are_white(void **state)
{
    (void)state;
    const nebel_cloud_layer stratus = {.type = NEBEL_CLOUD_STRATUS, .coverage = .6, .extinction = .01};
    const nebel_volume_desc ball = {.shape = {.type = NEBEL_SHAPE_SPHERE, .center = {0, 400, 0}, .radius = 300},
                                    .extinction = {.001, .004, .002},
                                    .albedo = {1, 1, 1}};
    nebel_lighting *fog = fog_commit_lit(&(nebel_fog_desc){0}, &ball, 1, NULL);
    furnace(&stratus, fog, 4);
    nebel_release_lighting(fog);
}

/* ---- layers ---------------------------------------------------------------------------------- */

/* So large a planet that its air is a flat layer. */
static nebel_atmosphere_desc flat_air(const nebel_phase *phase, double albedo, double depth)
{
    nebel_atmosphere_desc desc = {.radius = 1e10, .thickness = 1e5, .component_count = 1};
    const double extinction = depth / (1e4 * -expm1(-10));
    desc.components[0].phase = *phase;
    desc.components[0].scale_height = 1e4;
    set_rgb(desc.components[0].scattering, albedo * extinction);
    set_rgb(desc.components[0].absorption, (1 - albedo) * extinction);
    return desc;
}

typedef struct layer {
    nebel_phase phase;
    double albedo, depth, sun, reflected, transmitted; /* parts of the flux, without what is not scattered */
} layer;

/* As test_reference.c has them for fog: T33 and T35 of the collected physics, and problems 1 to 3 of the tests of DISORT 4.0.99. */
static const layer layers[] = {
    {{.type = NEBEL_PHASE_ISOTROPIC}, 1, 1, .5, .49837551665841334, .3662891804842135},
    {{.type = NEBEL_PHASE_ISOTROPIC}, .99, .03125, .1, .133177238762015, .13232983047261493},
    {{.type = NEBEL_PHASE_RAYLEIGH}, .5, .2, .080442, .21172485980785638, .1748171171358726},
    {{.type = NEBEL_PHASE_RAYLEIGH}, 1, 1, 1, .340471116762554, .29164945752102833},
    {{.type = NEBEL_PHASE_HENYEY_GREENSTEIN, .g = .75}, .9, 2, 1, .09739463522734067, .5256224282415307},
    {{.type = NEBEL_PHASE_HENYEY_GREENSTEIN, .g = .75}, 1, 1, 1, .07874427858775765, .5533784355688574},
};

/* What goes up through the top of the air or down to the ground: paths from there as often as the cosine, so that their mean is
 * the flux over pi. */
static estimate measure_flux(const globe *g, const layer *l, int above, uint32_t paths)
{
    static nb_single_ray lone;
    static nb_planet_medium medium;
    static const nb_geometry nothing;
    nb_planet_medium_set(&medium, &g->planet, 0);
    const nb_path_scene world = {.media = {.planets = &medium, .planet_count = 1},
                                 .scene = &g->scene,
                                 .geometry = &nothing,
                                 .to_sun = {sqrt(1 - l->sun * l->sun), l->sun, 0},
                                 .sun = {1 / l->sun, 0, 0},
                                 .has_sun = 1,
                                 .is_grey = 1,
                                 .bounces = 10000};
    uint64_t numbers = 3;
    estimate e;
    memset(&e, 0, sizeof e);
    for (uint32_t i = 0; i < paths; i++) {
        const double angle = dice(&numbers, 0, 2 * test_pi), up = sqrt(dice(&numbers, 0, 1)), level = sqrt(1 - up * up);
        nb_path_eye eye = {
            .ray = {{0, above ? 1.5e5 : 1, 0}, {level * cos(angle), above ? -up : up, level * sin(angle)}, HUGE_VAL},
            .first.t = HUGE_VAL};
        nb_path_light light;
        nb_meeting_end_at_ground(&world, &eye.ray, &eye.first);
        assert_int_equal(nb_path_trace(&world, &eye, (const uint32_t[4]){i}, &lone, &light), NEBEL_OK);
        e.color[0] += test_pi * light.color[0] / paths;
        e.error[0] += pow(test_pi * light.color[0], 2) / paths;
    }
    e.error[0] = sqrt((e.error[0] - e.color[0] * e.color[0]) / paths);
    return e;
}

static void flat_air_sends_up_and_down_what_layers_do(void **state)
{
    (void)state;
    for (size_t i = 0; i < sizeof layers / sizeof *layers; i++) {
        const layer *l = &layers[i];
        const nebel_atmosphere_desc air = flat_air(&l->phase, l->albedo, l->depth);
        globe g;
        start(&g, &air, NULL);
        for (int above = 0; above < 2; above++) {
            const double expected = above ? l->reflected : l->transmitted;
            const estimate e = measure_flux(&g, l, above, 12000 * effort);
            expect(above ? "up" : "down", &e, 0, expected, 1e-3 * expected, .04);
        }
        end(&g);
    }
}

/* ---- scattered once -------------------------------------------------------------------------- */

/* Of this part of its scattering air absorbs the rest, so that what was scattered twice is as much less again. */
#define DIM 1e-4

/* nebel_trace_atmosphere, whose light scattered once is right to 1e-4, and a sun that makes up for the dimming. */
static void once_is_what_quadrature_says(void **state)
{
    (void)state;
    static const struct {
        const char *name;
        double height, elevation, azimuth, sun, part;
    } views[] = {{"earth", 2, 30, 20, 60, .02}, {"earth", 2, 2, 150, 5, .02},      {"earth", 1e4, -40, 70, 10, .02},
                 {"earth", 2, 20, 10, -4, .1},  {"earth", 4e5, -15.5, 0, 30, .02}, {"mars", 2, 10, 5, 8, .02},
                 {"toy", 1, 25, 90, 40, .02},   {"toy", 300, -60, 90, 20, .02}};
    for (size_t i = 0; i < sizeof views / sizeof *views; i++) {
        nebel_atmosphere_desc air = *nebel_lookup_atmosphere(views[i].name);
        for (uint32_t k = 0; k < air.component_count; k++)
            for (int c = 0; c < 3; c++) {
                air.components[k].absorption[c] += (1 - DIM) * air.components[k].scattering[c];
                air.components[k].scattering[c] *= DIM;
            }
        memset(air.ground_albedo, 0, sizeof air.ground_albedo);
        globe g;
        start(&g, &air, NULL);
        shine(&g, views[i].sun, 1 / DIM);
        const nebel_ray ray = ray_of(views[i].height, views[i].elevation, views[i].azimuth);
        nebel_sun sun = {.irradiance = {1 / DIM, 1 / DIM, 1 / DIM}};
        nebel_transfer transfer;
        memcpy(sun.direction, g.scene.sun_direction, sizeof sun.direction);
        assert_int_equal(nebel_trace_atmosphere(g.atmosphere, &sun, 1, &ray, 0, &transfer, 0), NEBEL_OK);
        const estimate e = look(&g, NULL, &ray, 40, 1);
        for (int c = 0; c < 3; c++) {
            const double expected = (double)transfer.in_scattering[c];
            expect(views[i].name, &e, c, expected, 1e-3 * expected, views[i].part);
            assert_true(fabs(e.transmittance[c] - (double)transfer.transmittance[c]) < 1e-6);
        }
        end(&g);
    }
}

/* ---- clouds ---------------------------------------------------------------------------------- */

/* Air that does nothing, for clouds alone. */
static const nebel_atmosphere_desc bare = {.components = {{.absorption = {1e-20, 1e-20, 1e-20}, .scale_height = 1e5}},
                                           .component_count = 1};

enum { STEPS = 4000 };

/* The depth of clouds on `length` m of a ray from a place, and the extinction at each step's middle. */
static double sum_clouds(const globe *g, const double from[3], const double to[3], double length,
                         float extinction[STEPS])
{
    static double places[STEPS][3];
    double depth = 0;
    for (int i = 0; i < STEPS; i++)
        for (int c = 0; c < 3; c++) places[i][c] = from[c] + (i + .5) / STEPS * length * to[c];
    assert_int_equal(
        nebel_compute_cloud_extinction(g->clouds, 0, 0, STEPS, (const double(*)[3])places, sizeof *places, extinction),
        NEBEL_OK);
    for (int i = 0; i < STEPS; i++) depth += (double)extinction[i] * length / STEPS;
    return depth;
}

/* A ray that cloud leaves a part of. */
static nebel_ray find_cloud(const globe *g, double length, float extinction[STEPS])
{
    double azimuth = 0, depth = 0;
    nebel_ray ray = ray_of(500, 35, 0);
    for (; azimuth < 360 && !(depth > .5 && depth < 2); azimuth += 5) {
        ray = ray_of(500, 35, azimuth);
        depth = sum_clouds(g, ray.origin, ray.direction, length, extinction);
    }
    assert_true(azimuth < 360);
    return ray;
}

/* Through broken clouds: what comes through and what is scattered once, by steps of a metre through the same density. */
static void clouds_are_what_sums_of_their_density_say(void **state)
{
    (void)state;
    static float extinction[STEPS], on_the_way[STEPS];
    const nebel_cloud_layer cumulus = {.type = NEBEL_CLOUD_CUMULUS, .coverage = .7, .extinction = .003};
    const double length = 4000;
    globe g;
    start(&g, &bare, &cumulus);
    shine(&g, 75, 1);
    const nebel_ray ray = find_cloud(&g, length, extinction);
    double depth = 0, once = 0, cosine = 0, phase[3];
    for (int c = 0; c < 3; c++) cosine += ray.direction[c] * g.scene.sun_direction[c];
    assert_int_equal(nebel_cloud_phase(g.clouds, 0, 1, &cosine, &phase), NEBEL_OK);
    for (int i = 0; i < STEPS; i++) {
        const double piece = (double)extinction[i] * length / STEPS;
        double place[3];
        for (int c = 0; c < 3; c++) place[c] = ray.origin[c] + (i + .5) / STEPS * length * ray.direction[c];
        if (piece > 0) {
            const double shade = sum_clouds(&g, place, g.scene.sun_direction, length, on_the_way);
            once += piece * exp(-depth - .5 * piece - shade);
        }
        depth += piece;
    }
    const estimate e = look(&g, NULL, &ray, 64, 1);
    for (int c = 0; c < 3; c++) expect("clouds, once", &e, c, once * phase[c], 2e-3 * once * phase[c], .03);
    assert_true(fabs(e.transmittance[0] - exp(-depth)) < .01);
    end(&g);
}

/* Clouds as even as there are in light from all sides, over white ground. */
static void even_clouds_lose_nothing(void **state)
{
    (void)state;
    const nebel_cloud_layer stratus = {.type = NEBEL_CLOUD_STRATUS,
                                       .coverage = 1,
                                       .extinction = .008,
                                       .erosion = NEBEL_ZERO,
                                       .patchiness = NEBEL_ZERO};
    nebel_atmosphere_desc air = bare;
    set_rgb(air.ground_albedo, 1);
    globe g;
    start(&g, &air, &stratus);
    set_rgb(g.scene.background, 1);
    set_rgb(g.scene.ambient, 1);
    const nebel_ray down = ray_of(2000, -89, 0);
    const estimate e = look(&g, NULL, &down, 4, 0);
    expect("even clouds", &e, 0, 1, 1e-6, .02);
    end(&g);
}

/* ---- contracts ------------------------------------------------------------------------------- */

/* The ground in other planes than the colour: where it is, and which way it faces. */
static void the_ground_has_a_distance_and_a_normal(void **state)
{
    (void)state;
    float color[3], depth, normal[3];
    globe g;
    start(&g, nebel_lookup_atmosphere("moon"), NULL);
    shine(&g, 45, 3);
    const nebel_ray ray = ray_of(1000, -90, 0);
    const nebel_frame planes = {.color = color, .depth = &depth, .normal = normal};
    const nebel_frame_desc desc = {.camera = camera_of(&ray), .width = 1, .height = 1, .samples = 1, .bounces = 1};
    assert_int_equal(render(&g, NULL, &desc, &planes), NEBEL_OK);
    assert_true(fabs((double)depth - 1000) < .01 && fabs((double)normal[1] - 1) < 1e-6);
    /* Lambert's ground of the albedo 0.11, which the sun reaches without air. */
    assert_true(fabs((double)color[0] - .11 / test_pi * 3 * sqrt(.5)) < 1e-6);
    end(&g);
}

static void the_same_for_any_number_of_threads(void **state)
{
    (void)state;
    enum { WIDE = 66, HIGH = 2 };
    static float color[2][3 * WIDE * HIGH];
    const nebel_cloud_layer cumulus = {.type = NEBEL_CLOUD_CUMULUS, .extinction = .005};
    globe g;
    start(&g, nebel_lookup_atmosphere("earth"), &cumulus);
    shine(&g, 30, 3);
    for (int i = 0; i < 2; i++) {
        nebel_renderer *renderer = NULL;
        const nebel_frame planes = {.color = color[i]};
        const nebel_frame_desc desc = {
            .camera = test_camera(0, 100, 0, 1, 100.3, 0), .width = WIDE, .height = HIGH, .samples = 2};
        assert_int_equal(
            nebel_create_cpu_renderer(&g.scene, NULL, &(nebel_cpu_renderer_desc){.thread_count = 1 + 2 * i}, &renderer),
            NEBEL_OK);
        assert_int_equal(nebel_set_renderer_method(renderer, NEBEL_METHOD_PATH, NULL), NEBEL_OK);
        assert_int_equal(nebel_render_frame(renderer, &desc, &planes), NEBEL_OK);
        nebel_destroy_renderer(renderer);
    }
    assert_memory_equal(color[0], color[1], sizeof color[0]);
    end(&g);
}

/* Below the ground, in the planet's center and far away; parallel rays are refused. */
static void odd_cameras(void **state)
{
    (void)state;
    static const double heights[] = {0, -1, -1000, -1999, 1e9};
    float color[3 * PIXELS];
    globe g;
    start(&g, nebel_lookup_atmosphere("toy"), NULL);
    shine(&g, 30, 3);
    const nebel_frame planes = {.color = color};
    nebel_frame_desc desc = {.width = SIDE, .height = SIDE, .samples = 1};
    for (int h = 0; h < 5; h++) {
        desc.camera = test_camera(0, heights[h], 0, 0, heights[h] - .1, -1);
        assert_int_equal(render(&g, NULL, &desc, &planes), NEBEL_OK);
        for (int i = 0; i < 3 * PIXELS; i++) assert_true(color[i] >= 0 && color[i] < 1e6f);
    }
    desc.camera.projection = NEBEL_PROJECTION_ORTHOGRAPHIC;
    desc.camera.view_height = 10;
    assert_int_equal(render(&g, NULL, &desc, &planes), NEBEL_ERROR_UNSUPPORTED);
    end(&g);
}

int main(int count, char **words)
{
    if (count > 1) effort = (uint32_t)strtoul(words[1], NULL, 10);
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(white_air_over_white_ground_is_white),      cmocka_unit_test(white_clouds_and_fog_are_white),
        cmocka_unit_test(flat_air_sends_up_and_down_what_layers_do), cmocka_unit_test(once_is_what_quadrature_says),
        cmocka_unit_test(clouds_are_what_sums_of_their_density_say), cmocka_unit_test(even_clouds_lose_nothing),
        cmocka_unit_test(the_ground_has_a_distance_and_a_normal),    cmocka_unit_test(odd_cameras),
        cmocka_unit_test(the_same_for_any_number_of_threads),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
