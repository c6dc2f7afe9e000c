/* Fog in the shade of clouds by its own place, in pictures of the CPU: against many short pieces of each ray, each in the light
 * that comes through clouds to it. */
#include "planet_help.h"
#include "test_render_scene.h"

#include "math/vector.h"

#include <nebel/planet.h>

enum { WIDTH = 32, HEIGHT = 20 };

static const double irradiance[3] = {5, 4, 3};

typedef struct world {
    nebel_atmosphere *atmosphere;
    nebel_clouds *clouds;
    nebel_environment_map *map;
    nebel_planet planet;
    nebel_scene_data scene;
    nebel_cloud_lighting *view;
    nebel_cloud_workspace *workspace;
} world;

/* The air of planets that lie where the Earth does: made once. */
static nebel_atmosphere *usual;

static nebel_atmosphere *make_atmosphere(const nebel_atmosphere_desc *air)
{
    const nebel_atmosphere_desc *const earth = nebel_lookup_atmosphere("earth");
    const int is_there = memcmp(air->ground_point, earth->ground_point, sizeof air->ground_point) == 0;
    nebel_atmosphere *made = is_there ? usual : NULL;
    if (made == NULL) assert_int_equal(nebel_create_atmosphere(air, &made), NEBEL_OK);
    if (is_there) usual = made;
    return made;
}

static void free_atmosphere(nebel_atmosphere *atmosphere)
{
    if (atmosphere != usual) nebel_destroy_atmosphere(atmosphere);
}

static int free_usual(void **state)
{
    (void)state;
    nebel_destroy_atmosphere(usual);
    return 0;
}

/* What comes of the planet and of the scene's sun. */
static void make_air(world *w)
{
    w->atmosphere = make_atmosphere(&w->planet.atmosphere_desc);
    const nebel_clouds_desc desc = {
        .atmosphere = w->atmosphere, .layers = {w->planet.cloud_layers[0]}, .layer_count = 1};
    assert_int_equal(nebel_create_clouds(&desc, &w->clouds), NEBEL_OK);
    w->planet.atmosphere = w->atmosphere;
    w->planet.clouds = w->clouds;
    nebel_cloud_lighting_desc view = {.clouds = w->clouds, .sun = {.irradiance = {5, 4, 3}}};
    memcpy(view.sun.direction, w->scene.sun_direction, sizeof view.sun.direction);
    assert_int_equal(nebel_create_cloud_lighting(&view, &w->view), NEBEL_OK);
    assert_int_equal(nebel_create_cloud_workspace(w->view, &w->workspace), NEBEL_OK);
}

/* Air so thin that it hardly counts, and a sky of its own. */
static void make_world(const nebel_cloud_layer *layer, const double sun[3], world *w)
{
    *w = (world){.planet = {.atmosphere_desc = *nebel_lookup_atmosphere("earth"),
                            .sun_left = {1, 1, 1},
                            .cloud_layer_count = 1,
                            .cloud_layers = {*layer}}};
    for (uint32_t k = 0; k < w->planet.atmosphere_desc.component_count; k++)
        for (int c = 0; c < 3; c++) {
            w->planet.atmosphere_desc.components[k].scattering[c] *= 1e-4;
            w->planet.atmosphere_desc.components[k].absorption[c] *= 1e-4;
        }
    w->scene = (nebel_scene_data){.has_sun = 1,
                                  .sun_irradiance = {irradiance[0], irradiance[1], irradiance[2]},
                                  .planet_count = 1,
                                  .planets = &w->planet};
    w->map = planet_even_sky(&w->scene);
    memcpy(w->scene.sun_direction, sun, sizeof w->scene.sun_direction);
    assert_true(nb_vector_make_unit(w->scene.sun_direction));
    make_air(w);
}

static void free_world(world *w)
{
    nebel_destroy_cloud_workspace(w->workspace);
    nebel_destroy_cloud_lighting(w->view);
    nebel_destroy_clouds(w->clouds);
    nebel_release_environment_map(w->map);
    free_atmosphere(w->atmosphere);
}

static double sun_at(const world *w, const double place[3])
{
    float part;
    assert_int_equal(
        nebel_compute_cloud_sun_transmittance(w->workspace, 0, 1, (const double(*)[3])(const void *)place, 0, &part),
        NEBEL_OK);
    return (double)part;
}

static double sky_at(const world *w, const double place[3])
{
    float part;
    assert_int_equal(
        nebel_compute_cloud_sky_transmittance(w->workspace, 0, 1, (const double(*)[3])(const void *)place, 0, &part),
        NEBEL_OK);
    return (double)part;
}

static nebel_lighting *make_limited_fog(const world *w, const nebel_volume_desc *volume, double sun, double sky,
                                        double max_opacity)
{
    nebel_lighting_desc lights = {.sun = {.direction = {0, 1, 0}}};
    memcpy(lights.sun.direction, w->scene.sun_direction, sizeof lights.sun.direction);
    for (int c = 0; c < 3; c++) lights.sun.irradiance[c] = sun * irradiance[c];
    if (sky > 0) lights.environment = w->scene.environment;
    lights.environment.intensity = sky;
    return fog_commit_lit(&(nebel_fog_desc){.max_opacity = max_opacity}, volume, 1, &lights);
}

static nebel_lighting *make_fog(const world *w, const nebel_volume_desc *volume, double sun, double sky)
{
    return make_limited_fog(w, volume, sun, sky, 0);
}

static test_picture render(const world *w, nebel_lighting *fog, const nebel_camera *camera, int threads)
{
    nebel_renderer *renderer;
    const test_picture picture = test_picture_make(WIDTH, HEIGHT);
    const nebel_frame_desc desc = {.camera = *camera, .width = WIDTH, .height = HEIGHT, .samples = 1};
    assert_int_equal(
        nebel_create_cpu_renderer(&w->scene, fog, &(nebel_cpu_renderer_desc){.thread_count = threads}, &renderer),
        NEBEL_OK);
    assert_int_equal(nebel_render_frame(renderer, &desc, &picture.planes), NEBEL_OK);
    nebel_destroy_renderer(renderer);
    return picture;
}

/* All fog in the light that it was made with, which is the origin's. */
static test_picture render_evenly(const world *w, nebel_lighting *fog, const nebel_camera *camera)
{
    world clear = *w;
    clear.planet.clouds = NULL;
    clear.scene.planets = &clear.planet;
    return render(&clear, fog, camera, 2);
}

/* Of a ray of unit length from above it. */
static double to_ground(const world *w, const nebel_ray *ray)
{
    const double radius = w->planet.atmosphere_desc.radius, height = ray->origin[1];
    const double along = (radius + height) * ray->direction[1];
    return -along - sqrt(along * along - height * (2 * radius + height));
}

/* The light of fog along a ray of unit length that ends on the ground, in many short pieces. */
static void step_along(const world *w, const nebel_lighting *by_sun, const nebel_lighting *by_sky, nebel_ray ray,
                       double end, double light[3])
{
    enum { STEPS = 600 };
    const nebel_ray whole = ray;
    double left[3] = {1, 1, 1};
    memset(light, 0, 3 * sizeof *light);
    for (int i = 0; i < STEPS; i++) {
        /* Shorter near the eye. */
        const double from = end * i * i / (double)(STEPS * STEPS),
                     to = end * (i + 1) * (i + 1) / (double)(STEPS * STEPS);
        double middle[3];
        nebel_transfer sun, sky;
        for (int c = 0; c < 3; c++) {
            ray.origin[c] = whole.origin[c] + from * whole.direction[c];
            middle[c] = whole.origin[c] + .5 * (from + to) * whole.direction[c];
        }
        ray.t_max = to - from;
        fog_trace(by_sun, (nebel_trace_desc){0}, 1, &ray, &sun);
        fog_trace(by_sky, (nebel_trace_desc){0}, 1, &ray, &sky);
        if (!(sun.transmittance[0] < 1)) continue;
        const double of_sun = sun_at(w, middle), of_sky = sky_at(w, middle);
        for (int c = 0; c < 3; c++) {
            light[c] += left[c] * (sun.in_scattering[c] * of_sun + sky.in_scattering[c] * of_sky);
            left[c] *= sun.transmittance[c];
        }
    }
}

typedef struct off {
    double most, mean, beyond, by_origin; /* beyond: what is told; by_origin: most, in the origin's light */
    int count;
} off;

static off compare(const world *w, const nebel_volume_desc *mist, const nebel_camera *camera, double pitch)
{
    static const double origin[3] = {0, 0, 0};
    nebel_lighting *const fog = make_fog(w, mist, sun_at(w, origin), sky_at(w, origin));
    nebel_lighting *const by_sun = make_fog(w, mist, 1, 0), *const by_sky = make_fog(w, mist, 0, 1);
    test_picture picture = render(w, fog, camera, 2), even = render_evenly(w, fog, camera);
    off is = {.beyond = -1};
    for (uint32_t i = 5; i < WIDTH * HEIGHT; i += 7) {
        if (!nb_test_tries(i / 7 % 2, 2)) continue;
        nebel_ray ray = planet_ray(camera, pitch, i % WIDTH, i / WIDTH, WIDTH, HEIGHT);
        double light[3];
        assert_true(nb_vector_make_unit(ray.direction));
        if (ray.direction[1] > -.03) continue;
        step_along(w, by_sun, by_sky, ray, to_ground(w, &ray), light);
        for (int c = 0; c < 3; c++) {
            const size_t k = 3 * i + (size_t)c;
            const double far = fabs((double)picture.planes.in_scattering[k] - light[c]);
            is.most = fmax(is.most, far);
            is.mean += far;
            is.beyond = fmax(is.beyond, far - (double)picture.planes.error[i]);
            is.by_origin = fmax(is.by_origin, fabs((double)even.planes.in_scattering[k] - light[c]));
            is.count++;
        }
    }
    is.mean /= is.count;
    test_picture_free(&picture);
    test_picture_free(&even);
    nebel_release_lighting(fog);
    nebel_release_lighting(by_sun);
    nebel_release_lighting(by_sky);
    return is;
}

static void mist_has_the_shadows_of_clouds(void **state)
{
    (void)state;
    static const struct {
        const char *name;
        double height, pitch, sun[3], extinction, size, top;
    } views[] = {{"seen from above", 700, -.6, {.3, .8, -.2}, 2e-3, 6000, 60},
                 {"seen from far", 500, -.15, {.3, .8, -.2}, 1e-3, 9000, 60},
                 {"in a low sun", 200, -.1, {.2, .15, -1}, 1e-3, 9000, 100},
                 {"without end", 300, -.3, {.3, .8, .2}, 2e-3, 0, 0}};
    for (size_t v = 0; v < sizeof views / sizeof *views; v++) {
        world w;
        make_world(&(nebel_cloud_layer){.coverage = .5}, views[v].sun, &w);
        const double size = views[v].size, e = views[v].extinction;
        nebel_volume_desc mist = {
            .shape = {.type = NEBEL_SHAPE_BOX, .min = {-size, -5, -size}, .max = {size, views[v].top, size}},
            .extinction = {e, e, e},
            .albedo = {.97, .97, .97},
            .phase = {.type = NEBEL_PHASE_HENYEY_GREENSTEIN, .g = .3}};
        if (!(size > 0)) {
            mist.shape = (nebel_shape){.type = NEBEL_SHAPE_WORLD};
            mist.density = (nebel_density){.type = NEBEL_DENSITY_HEIGHT, .scale_height = 30};
        }
        const nebel_camera camera = planet_camera(views[v].height, views[v].pitch);
        const off is = compare(&w, &mist, &camera, views[v].pitch);
        print_message(
            "mist %s: off by %.2g at most, %.2g in the mean, %.2g beyond what is told; in the origin's light it "
            "would be off by %.2g\n",
            views[v].name, is.most, is.mean, is.beyond, is.by_origin);
        /* A step of a picture of 255 is .009 of light where it is bright; beyond what is told, half of one. */
        assert_true(is.most < .015 && is.mean < 3e-3 && is.beyond < 4.5e-3 && is.by_origin > 5 * is.most);
        free_world(&w);
    }
}

/* Where on a line the sun comes through worst, 0, or best, 1. */
static double find_place(const world *w, int best, double z)
{
    double found = 0, extreme = best ? 0 : 1;
    for (int i = -20; i <= 20; i++) {
        const double place[3] = {300. * i, 0, z}, part = sun_at(w, place);
        if (best ? part > extreme : part < extreme) {
            found = place[0];
            extreme = part;
        }
    }
    return found;
}

/* Banks of mist far smaller than clouds: each has the light of its place, whatever the origin has. */
static void a_bank_has_the_light_of_its_place(void **state)
{
    (void)state;
    static const double sun[3] = {.3, .8, -.2}, origin[3] = {0, 0, 0};
    world w;
    make_world(&(nebel_cloud_layer){.coverage = .7}, sun, &w);
    for (int best = 0; best < 2; best++) {
        nebel_camera camera = planet_camera(300, -.15);
        const double x = find_place(&w, best, -1800), place[3] = {x, 0, -1800};
        const nebel_volume_desc bank = {
            .shape = {.type = NEBEL_SHAPE_BOX, .min = {x - 300, 0, -2100}, .max = {x + 300, 60, -1500}},
            .extinction = {3e-3, 3e-3, 3e-3},
            .albedo = {.97, .97, .97}};
        camera.position[0] += x;
        camera.look_at[0] += x;
        const off is = compare(&w, &bank, &camera, -.15);
        const double here = sun_at(&w, place), there = sun_at(&w, origin);
        print_message(
            "a bank with %.2f of the sun, the origin has %.2f: off by %.2g at most, %.2g beyond what is told; in "
            "the origin's light by %.2g\n",
            here, there, is.most, is.beyond, is.by_origin);
        assert_true(best ? here > .95 : here < .5);
        assert_true(is.most < .015 && is.beyond < 4.5e-3);
        assert_true(fabs(here - there) < .3 || is.by_origin > 5 * is.most);
    }
    free_world(&w);
}

/* max_opacity weakens all light of a ray by as much as its opacity, in the shade of clouds as elsewhere. */
static void limited_opacity_keeps_the_shade(void **state)
{
    (void)state;
    static const double sun[3] = {.3, .15, -1}, limit = .4;
    world w;
    make_world(&(nebel_cloud_layer){.coverage = .5}, sun, &w);
    const nebel_volume_desc mist = {
        .shape = {.type = NEBEL_SHAPE_BOX, .min = {-9000, -5, -9000}, .max = {9000, 400, 9000}},
        .extinction = {1e-3, 2e-3, 4e-3},
        .albedo = {.97, .97, .97}};
    nebel_lighting *const fog = make_fog(&w, &mist, 1, 1), *const limited = make_limited_fog(&w, &mist, 1, 1, limit);
    const nebel_camera camera = planet_camera(300, -.1);
    test_picture all = render(&w, fog, &camera, 2), most = render(&w, limited, &camera, 2);
    double worst = 0;
    int beyond = 0;
    for (size_t i = 0; i < (size_t)WIDTH * HEIGHT * 3; i++) {
        if (i / 3 / WIDTH < HEIGHT / 2) continue; /* clouds are before the sky, and before mist near it */
        const double left = (double)all.planes.transmittance[i], light = (double)all.planes.in_scattering[i];
        const double kept = limit / fmax(limit, 1 - left);
        assert_true(fabs((double)most.planes.transmittance[i] - fmax(left, 1 - limit)) < 1e-3);
        worst = fmax(worst, fabs((double)most.planes.in_scattering[i] - kept * light));
        beyond += kept < .7;
    }
    print_message("with max_opacity %g: off by %.1e\n", limit, worst);
    assert_true(beyond > 100 && worst < 1e-3);
    test_picture_free(&all);
    test_picture_free(&most);
    nebel_release_lighting(fog);
    nebel_release_lighting(limited);
    free_world(&w);
}

static void threads_change_nothing(void **state)
{
    (void)state;
    static const double sun[3] = {.3, .8, -.2};
    world w;
    make_world(&(nebel_cloud_layer){.coverage = .5}, sun, &w);
    const nebel_volume_desc mist = {
        .shape = {.type = NEBEL_SHAPE_BOX, .min = {-6000, -5, -6000}, .max = {6000, 60, 6000}},
        .extinction = {2e-3, 2e-3, 2e-3},
        .albedo = {.97, .97, .97}};
    nebel_lighting *const fog = make_fog(&w, &mist, 1, 1);
    const nebel_camera camera = planet_camera(500, -.3);
    test_picture one = render(&w, fog, &camera, 1), three = render(&w, fog, &camera, 3);
    assert_memory_equal(one.planes.color, three.planes.color, (size_t)WIDTH * HEIGHT * 3 * sizeof(float));
    assert_memory_equal(one.planes.error, three.planes.error, (size_t)WIDTH * HEIGHT * sizeof(float));
    test_picture_free(&one);
    test_picture_free(&three);
    nebel_release_lighting(fog);
    free_world(&w);
}

/* Where no cloud is, all is as without them, to the last bit. */
static void clear_places_stay_as_they_are(void **state)
{
    (void)state;
    static const double sun[3] = {.3, .8, -.2};
    static const float none = 0;
    world w;
    make_world(&(nebel_cloud_layer){.weather_map = {1, 1, 1, &none}}, sun, &w);
    const nebel_volume_desc bank = {.shape = {.type = NEBEL_SHAPE_BOX, .min = {-600, 0, -2100}, .max = {600, 60, -900}},
                                    .extinction = {2e-3, 2e-3, 2e-3},
                                    .albedo = {.97, .97, .97}};
    nebel_lighting *const fog = make_fog(&w, &bank, 1, 1);
    const nebel_camera camera = planet_camera(500, -.3);
    test_picture with = render(&w, fog, &camera, 2);
    w.planet.clouds = NULL;
    test_picture without = render(&w, fog, &camera, 2);
    assert_memory_equal(with.planes.color, without.planes.color, (size_t)WIDTH * HEIGHT * 3 * sizeof(float));
    test_picture_free(&with);
    test_picture_free(&without);
    nebel_release_lighting(fog);
    free_world(&w);
}

/* ---- one scene, told from two origins -------------------------------------------------------- */

/* The planet's top in the scene: its middle, and all that is told of it, moves with it. */
static void move_planet(const double top[3], world *w)
{
    memcpy(w->planet.atmosphere_desc.ground_point, top, sizeof w->planet.atmosphere_desc.ground_point);
    nebel_destroy_cloud_workspace(w->workspace);
    nebel_destroy_cloud_lighting(w->view);
    nebel_destroy_clouds(w->clouds);
    free_atmosphere(w->atmosphere);
    make_air(w);
}

/* Mist or a ball of it on the top, with the sun that the origin has; ambient light is no sky, so that it is the same anywhere. */
static test_picture see_top(world *w, const double top[3], int is_ball, double sun)
{
    const double radius = w->planet.atmosphere_desc.radius;
    nebel_camera camera = planet_camera(300, -.6);
    nebel_volume_desc fog = {
        .shape = {.type = NEBEL_SHAPE_WORLD}, .extinction = {1e-3, 1e-3, 1e-3}, .albedo = {.97, .97, .97}};
    if (is_ball) {
        fog.shape =
            (nebel_shape){.type = NEBEL_SHAPE_SPHERE, .center = {top[0], top[1] + 50, top[2] - 600}, .radius = 300};
    } else {
        fog.density = (nebel_density){.type = NEBEL_DENSITY_ALTITUDE,
                                      .scale_height = 60,
                                      .center = {top[0], top[1] - radius, top[2]},
                                      .radius = radius};
    }
    for (int c = 0; c < 3; c++) {
        camera.position[c] += top[c];
        camera.look_at[c] += top[c];
    }
    move_planet(top, w);
    w->scene.environment = (nebel_environment){.type = NEBEL_ENVIRONMENT_CONSTANT, .radiance = {.1, .15, .2}};
    nebel_lighting *const snapshot = make_fog(w, &fog, sun, 1);
    const test_picture picture = render(w, snapshot, &camera, 2);
    nebel_release_lighting(snapshot);
    return picture;
}

/* Where it is night there, the fog that programs make has no sun, but the clouds over it shade it still. */
static void shade_does_not_hang_on_the_origin(void **state)
{
    (void)state;
    static const double sun[3] = {.3, .4, -1}, here[3] = {0, 0, 0};
    for (int is_ball = 0; is_ball < 2; is_ball++) {
        world w;
        make_world(&(nebel_cloud_layer){.coverage = .6}, sun, &w);
        /* The origin lies on the ground on the side away from the sun. */
        const double radius = w.planet.atmosphere_desc.radius,
                     away[3] = {radius * w.scene.sun_direction[0], radius * (w.scene.sun_direction[1] + 1),
                                radius * w.scene.sun_direction[2]};
        test_picture day = see_top(&w, here, is_ball, sun_at(&w, here)), night = see_top(&w, away, is_ball, 0);
        double worst = 0, least = 1, most = 0;
        for (int i = 0; i < WIDTH * HEIGHT * 3; i++) {
            const double left = (double)day.planes.transmittance[i], light = (double)day.planes.in_scattering[i];
            assert_true(fabs(left - (double)night.planes.transmittance[i]) <= 1e-4);
            worst = fmax(worst, fabs(light - (double)night.planes.in_scattering[i]));
            if (!(left < .8)) continue;
            least = fmin(least, light / (1 - left));
            most = fmax(most, light / (1 - left));
        }
        print_message("%s with the origin by night: off by %.1e, of light from %.2f to %.2f\n",
                      is_ball ? "a ball" : "mist", worst, least, most);
        assert_true(worst <= 1e-6 && most > 1.5 * least);
        test_picture_free(&day);
        test_picture_free(&night);
        free_world(&w);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(mist_has_the_shadows_of_clouds),  cmocka_unit_test(a_bank_has_the_light_of_its_place),
        cmocka_unit_test(limited_opacity_keeps_the_shade), cmocka_unit_test(threads_change_nothing),
        cmocka_unit_test(clear_places_stay_as_they_are),   cmocka_unit_test(shade_does_not_hang_on_the_origin),
    };
    return cmocka_run_group_tests(tests, NULL, free_usual);
}
