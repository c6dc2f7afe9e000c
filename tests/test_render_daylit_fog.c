/* Fog on planets in the light of its own place: a ball of it far from the origin is the one at the origin of the scene turned
 * about the planet's middle, and mist that bends with the ground is what many short pieces give, each in the light there. */
#include "planet_help.h"
#include "test_render_scene.h"

#include "math/vector.h"
#include "cpu/cpu_irradiance.h"

enum { WIDTH = 32, HEIGHT = 20 };

typedef struct world {
    nebel_atmosphere *atmosphere;
    nebel_planet planet;
    nebel_scene_data scene;
    nebel_sun sun;
} world;

/* The Earth's, for all tests. */
static nebel_atmosphere *earth;

static int make_air(void **state)
{
    (void)state;
    return nebel_create_atmosphere(nebel_lookup_atmosphere("earth"), &earth) == NEBEL_OK ? 0 : -1;
}

static int free_air(void **state)
{
    (void)state;
    nebel_destroy_atmosphere(earth);
    return 0;
}

static void make_world(const double to_sun[3], world *w)
{
    *w = (world){.planet = {.atmosphere_desc = *nebel_lookup_atmosphere("earth")}, .sun = {.irradiance = {5, 4, 3}}};
    memcpy(w->sun.direction, to_sun, sizeof w->sun.direction);
    assert_true(nb_vector_make_unit(w->sun.direction));
    w->atmosphere = earth;
    w->planet.atmosphere = w->atmosphere;
    w->scene = (nebel_scene_data){.has_sun = 1, .sun_irradiance = {5, 4, 3}, .planet_count = 1, .planets = &w->planet};
    memcpy(w->scene.sun_direction, w->sun.direction, sizeof w->scene.sun_direction);
}

static nebel_irradiance light_at(const world *w, const double place[3])
{
    nebel_irradiance light;
    assert_int_equal(nebel_compute_atmosphere_irradiance(w->atmosphere, &w->sun, 1,
                                                         (const double(*)[3])(const void *)place, 0, &light, 0),
                     NEBEL_OK);
    return light;
}

/* `sun`: its irradiance there. */
static nebel_lighting *make_fog(const world *w, const nebel_volume_desc *volume, const double sun[3],
                                const nebel_environment *sky)
{
    nebel_lighting_desc lights = {.sun = w->sun, .environment = *sky};
    memcpy(lights.sun.irradiance, sun, sizeof lights.sun.irradiance);
    return fog_commit_lit(&(nebel_fog_desc){0}, volume, 1, &lights);
}

static test_picture render(const world *w, nebel_lighting *fog, const nebel_camera *camera, nebel_isa isa, int threads)
{
    nebel_renderer *renderer;
    const test_picture picture = test_picture_make(WIDTH, HEIGHT);
    const nebel_frame_desc desc = {.camera = *camera, .width = WIDTH, .height = HEIGHT, .samples = 1};
    assert_int_equal(nebel_create_cpu_renderer(
                         &w->scene, fog, &(nebel_cpu_renderer_desc){.isa = isa, .thread_count = threads}, &renderer),
                     NEBEL_OK);
    assert_int_equal(nebel_render_frame(renderer, &desc, &picture.planes), NEBEL_OK);
    nebel_destroy_renderer(renderer);
    return picture;
}

/* ---- one scene, told in two ways ------------------------------------------------------------- */

/* About the planet's middle, along the meridian of x = 0. */
static void turn(const double radius, double angle, double place[3])
{
    const double up = place[1] + radius, ahead = -place[2];
    place[1] = up * cos(angle) - ahead * sin(angle) - radius;
    place[2] = -(up * sin(angle) + ahead * cos(angle));
}

static void turn_direction(double angle, double direction[3])
{
    turn(0, angle, direction);
}

/* A ball of fog 20 m in radius and the camera before it, both `angle` from the origin. */
static test_picture see_ball(world *w, double angle, const double light[3])
{
    const nebel_environment sky = {.radiance = {.02, .03, .04}};
    nebel_camera camera = planet_camera(25, -.05);
    nebel_volume_desc ball = {.shape = {.type = NEBEL_SHAPE_SPHERE, .center = {0, 20, -70}, .radius = 20},
                              .extinction = {.02, .03, .04},
                              .albedo = {.9, .8, .7},
                              .phase = {.type = NEBEL_PHASE_HENYEY_GREENSTEIN, .g = .3}};
    turn(w->planet.atmosphere_desc.radius, angle, camera.position);
    turn(w->planet.atmosphere_desc.radius, angle, camera.look_at);
    turn_direction(angle, camera.up);
    turn(w->planet.atmosphere_desc.radius, angle, ball.shape.center);
    memcpy(w->scene.ambient, sky.radiance, sizeof w->scene.ambient);
    nebel_lighting *fog = make_fog(w, &ball, light, &sky);
    const test_picture picture = render(w, fog, &camera, NEBEL_ISA_DEFAULT, 2);
    nebel_release_lighting(fog);
    return picture;
}

static void a_ball_has_the_light_of_its_place(void **state)
{
    (void)state;
    static const double origin[3] = {0, 0, 0}, middle[3] = {0, 20, -70};
    static const double angles[] = {30, 80, 87, 100};
    static const double suns[][3] = {{0, 1, 0}, {.3, .2, -.9}};
    for (int k = 0; k < 8; k++) {
        if (!nb_test_tries((size_t)(k + k / 4) % 2, 2)) continue;
        world there, here;
        const double angle = angles[k % 4] * test_pi / 180;
        double turned[3] = {suns[k / 4][0], suns[k / 4][1], suns[k / 4][2]};
        make_world(suns[k / 4], &there);
        turn_direction(-angle, turned);
        make_world(turned, &here);
        const nebel_irradiance at_origin = light_at(&there, origin), at_ball = light_at(&here, middle);
        test_picture away = see_ball(&there, angle, at_origin.sun), home = see_ball(&here, 0, at_ball.sun);
        double worst = 0;
        int fogged = 0;
        for (int i = 0; i < WIDTH * HEIGHT * 3; i++) {
            const double left = (double)home.planes.transmittance[i];
            assert_true(fabs(left - (double)away.planes.transmittance[i]) <= 1e-6);
            worst = fmax(worst, fabs((double)home.planes.in_scattering[i] - (double)away.planes.in_scattering[i]));
            fogged += left < .5;
        }
        print_message("ball at %g degrees, sun %d: off by %.1e\n", angles[k % 4], k / 4, worst);
        /* Numbers of the far ball are rounded to 1e-9 m, its light to float. */
        assert_true(fogged > 100 && worst <= 1e-6);
        test_picture_free(&home);
        test_picture_free(&away);
    }
}

/* Of each channel the brightest that the sun makes of a ball at a height before the camera. */
static void light_ball(world *w, double height, double brightest[3])
{
    static const double origin[3] = {0, 0, 0};
    const nebel_environment none = {.type = NEBEL_ENVIRONMENT_CONSTANT};
    const nebel_irradiance light = light_at(w, origin);
    const nebel_camera camera = planet_camera(height, 0);
    test_picture pictures[2];
    for (int k = 0; k < 2; k++) {
        nebel_volume_desc ball = {.shape = {.type = NEBEL_SHAPE_SPHERE, .center = {0, height, -70}, .radius = 20},
                                  .extinction = {.03, .03, .03}};
        for (int c = 0; c < 3; c++) ball.albedo[c] = k;
        nebel_lighting *fog = make_fog(w, &ball, light.sun, &none);
        pictures[k] = render(w, fog, &camera, NEBEL_ISA_DEFAULT, 2);
        nebel_release_lighting(fog);
    }
    for (int c = 0; c < 3; c++) brightest[c] = 0;
    for (int i = 0; i < WIDTH * HEIGHT * 3; i++)
        brightest[i % 3] = fmax(brightest[i % 3], (double)pictures[1].planes.in_scattering[i] -
                                                      (double)pictures[0].planes.in_scattering[i]);
    for (int k = 0; k < 2; k++) test_picture_free(&pictures[k]);
}

/* However near the origin; near the ground it has that of the origin. */
static void a_ball_high_up_has_its_own_sun(void **state)
{
    (void)state;
    static const double to_sun[3] = {-1, .04, -.3}, origin[3] = {0, 0, 0}, high[3] = {0, 9000, -70};
    double by_ground[3], above[3];
    world w;
    make_world(to_sun, &w);
    light_ball(&w, 30, by_ground);
    light_ball(&w, high[1], above);
    const nebel_irradiance here = light_at(&w, origin), there = light_at(&w, high);
    for (int c = 0; c < 3; c++) {
        print_message("sun at 9 km: %.3g times that on the ground, fog %.3g times as bright\n",
                      there.sun[c] / here.sun[c], above[c] / by_ground[c]);
        assert_true(there.sun[c] > 1.5 * here.sun[c]);
        assert_true(fabs(above[c] / by_ground[c] * here.sun[c] / there.sun[c] - 1) < .02);
    }
}

/* In the shadow of a moon a ball of fog that scatters all light is black. */
static void a_ball_in_eclipse_is_black(void **state)
{
    (void)state;
    static const double to_sun[3] = {0, 1, 0}, white[3] = {1, 1, 1}, angle = .5;
    world w;
    make_world(to_sun, &w);
    nebel_planet planets[2] = {w.planet, {.atmosphere_desc = *nebel_lookup_atmosphere("moon")}};
    double place[3] = {0, 20, -70};
    turn(w.planet.atmosphere_desc.radius, angle, place);
    planets[0].sun_angular_diameter = .53;
    memcpy(planets[1].atmosphere_desc.ground_point, place, sizeof place);
    planets[1].atmosphere_desc.ground_point[1] += 4e8;
    planets[1].atmosphere_desc.radius = 3e6;
    nebel_atmosphere *moon;
    assert_int_equal(nebel_create_atmosphere(&planets[1].atmosphere_desc, &moon), NEBEL_OK);
    planets[1].atmosphere = moon;
    w.scene.planets = planets;
    test_picture pictures[3];
    for (int k = 0; k < 3; k++) {
        const nebel_environment none = {.type = NEBEL_ENVIRONMENT_CONSTANT};
        nebel_camera camera = planet_camera(25, -.05);
        nebel_volume_desc ball = {.shape = {.type = NEBEL_SHAPE_SPHERE, .radius = 20}, .extinction = {.02, .03, .04}};
        for (int c = 0; c < 3 && k != 2; c++) ball.albedo[c] = 1;
        memcpy(ball.shape.center, place, sizeof place);
        turn(w.planet.atmosphere_desc.radius, angle, camera.position);
        turn(w.planet.atmosphere_desc.radius, angle, camera.look_at);
        turn_direction(angle, camera.up);
        w.scene.planet_count = k == 0 ? 1 : 2;
        nebel_lighting *fog = make_fog(&w, &ball, white, &none);
        pictures[k] = render(&w, fog, &camera, NEBEL_ISA_DEFAULT, 2);
        nebel_release_lighting(fog);
    }
    double lit = 0;
    for (int i = 0; i < WIDTH * HEIGHT * 3; i++) {
        const double eclipsed = (double)pictures[1].planes.in_scattering[i];
        lit = fmax(lit, (double)pictures[0].planes.in_scattering[i] - eclipsed);
        assert_true(fabs(eclipsed - (double)pictures[2].planes.in_scattering[i]) <= 1e-6);
    }
    assert_true(lit > .05);
    for (int k = 0; k < 3; k++) test_picture_free(&pictures[k]);
    nebel_destroy_atmosphere(moon);
}

/* ---- mist that bends with the ground --------------------------------------------------------- */

/* Where a ray is within the air and above the ground. */
static int cross_air(const world *w, const nebel_ray *ray, const double unit[3], double at[2])
{
    const double radius = w->planet.atmosphere_desc.radius, top = radius + w->planet.atmosphere_desc.thickness;
    const double from[3] = {ray->origin[0], ray->origin[1] + radius, ray->origin[2]};
    const double along = nb_vector_dot(from, unit), square = nb_vector_dot(from, from);
    const double outer = along * along - square + top * top, inner = along * along - square + radius * radius;
    if (!(outer > 0) || !(-along + sqrt(outer) > 0)) return 0;
    at[0] = fmax(0, -along - sqrt(outer));
    at[1] = inner > 0 && along < 0 ? -along - sqrt(inner) : -along + sqrt(outer);
    return 1;
}

typedef struct steps {
    double light[3], at_origin[3]; /* with fog in the light of its place; of the origin */
} steps;

/* Many short pieces, each of air, of fog in sunlight and of fog in the sky's light for itself. How much brighter the sky is than at the
 * origin is for test_render_planet to try. */
static steps step_along(const world *w, const nb_irradiance_table *daylight, const nebel_lighting *by_sun,
                        const nebel_lighting *by_sky, nebel_ray ray)
{
    enum { STEPS = 4000 };
    static const double origin[3] = {0, 0, 0};
    const nebel_irradiance home = light_at(w, origin);
    const double length = nb_vector_length(ray.direction);
    double unit[3], left[3] = {1, 1, 1}, ends[2];
    const nebel_ray whole = ray;
    steps sum = {.light = {0}};
    for (int c = 0; c < 3; c++) unit[c] = ray.direction[c] / length;
    if (!cross_air(w, &ray, unit, ends)) return sum;
    for (int i = 0; i < STEPS; i++) {
        const double from = ends[0] + (ends[1] - ends[0]) * i / STEPS,
                     to = ends[0] + (ends[1] - ends[0]) * (i + 1) / STEPS;
        double middle[3];
        nebel_transfer air, sun, sky;
        for (int c = 0; c < 3; c++) {
            ray.origin[c] = whole.origin[c] + from * unit[c];
            middle[c] = whole.origin[c] + .5 * (from + to) * unit[c];
        }
        ray.t_max = to - from;
        const nebel_irradiance there = light_at(w, middle);
        double sun_left[3], brighter[3];
        nb_irradiance_at(daylight, NB_IRRADIANCE_OF_FOG, middle, sun_left, brighter);
        assert_int_equal(nebel_trace_atmosphere(w->atmosphere, &w->sun, 1, &ray, 0, &air, 0), NEBEL_OK);
        fog_trace(by_sun, (nebel_trace_desc){0}, 1, &ray, &sun);
        fog_trace(by_sky, (nebel_trace_desc){0}, 1, &ray, &sky);
        for (int c = 0; c < 3; c++) {
            const double of_air = .5 * (1 + sky.transmittance[c]) * air.in_scattering[c];
            const double above = w->sun.irradiance[c], seen = .5 * (1 + air.transmittance[c]) * left[c];
            sum.light[c] += left[c] * of_air +
                            seen * (sun.in_scattering[c] * there.sun[c] / above + sky.in_scattering[c] * brighter[c]);
            sum.at_origin[c] +=
                left[c] * of_air + seen * (sun.in_scattering[c] * home.sun[c] / above + sky.in_scattering[c]);
            left[c] *= air.transmittance[c] * sky.transmittance[c];
        }
    }
    return sum;
}

static nebel_volume_desc mist_of(const world *w)
{
    return (nebel_volume_desc){.shape = {.type = NEBEL_SHAPE_WORLD},
                               .density = {.type = NEBEL_DENSITY_ALTITUDE,
                                           .scale_height = 2000,
                                           .center = {0, -w->planet.atmosphere_desc.radius, 0},
                                           .radius = w->planet.atmosphere_desc.radius},
                               .extinction = {4e-5, 4e-5, 4e-5},
                               .albedo = {.95, .9, .85}};
}

static void mist_is_lit_by_place(void **state)
{
    (void)state;
    static const struct {
        double height, pitch, sun[3];
    } views[] = {{1.5e6, -1, {.995, .1, 0}}, {2e4, -.1, {0, .05, -1}}, {1e5, -.2, {0, .05, 1}}, {300, 0, {.2, .03, 1}}};
    static nb_irradiance_table daylight;
    for (size_t v = 0; v < sizeof views / sizeof *views; v++) {
        world w;
        make_world(views[v].sun, &w);
        nb_irradiance_set(&daylight, &w.planet, &w.planet, w.sun.direction);
        nebel_environment_map *map = planet_even_sky(&w.scene);
        const double none[3] = {0, 0, 0}, origin[3] = {0, 0, 0};
        const nebel_environment dark = {.type = NEBEL_ENVIRONMENT_CONSTANT};
        const nebel_irradiance home = light_at(&w, origin);
        const nebel_volume_desc mist = mist_of(&w);
        nebel_lighting *fog = make_fog(&w, &mist, home.sun, &w.scene.environment);
        nebel_lighting *by_sun = make_fog(&w, &mist, w.sun.irradiance, &dark);
        nebel_lighting *by_sky = make_fog(&w, &mist, none, &w.scene.environment);
        const nebel_camera camera = planet_camera(views[v].height, views[v].pitch);
        test_picture picture = render(&w, fog, &camera, NEBEL_ISA_DEFAULT, 2);
        double worst = 0, apart = 0;
        for (uint32_t i = 7; i < WIDTH * HEIGHT; i += 83) {
            if (!nb_test_tries((i / 83 + v) % 2, 2)) continue;
            const nebel_ray ray = planet_ray(&camera, views[v].pitch, i % WIDTH, i / WIDTH, WIDTH, HEIGHT);
            const steps exact = step_along(&w, &daylight, by_sun, by_sky, ray);
            for (int c = 0; c < 3; c++) {
                const double off = fabs((double)picture.planes.in_scattering[3 * i + (uint32_t)c] - exact.light[c]);
                /* Tables of daylight: 9e-4 of fog that is at most .4 bright; and the steps. */
                assert_true(off <= (double)picture.planes.error[i] + 5e-4);
                worst = fmax(worst, off);
                apart = fmax(apart, fabs(exact.at_origin[c] - exact.light[c]));
            }
        }
        print_message("mist from %g m: off by %.1e; in the origin's light it would be off by %.1e\n", views[v].height,
                      worst, apart);
        assert_true(apart > 3 * worst);
        test_picture_free(&picture);
        nebel_release_lighting(fog);
        nebel_release_lighting(by_sun);
        nebel_release_lighting(by_sky);
        nebel_release_environment_map(map);
    }
}

static void every_thread_and_processor_gives_the_same(void **state)
{
    (void)state;
    const double to_sun[3] = {.995, .1, 0}, irradiance[3] = {2, 2, 2};
    world w;
    make_world(to_sun, &w);
    nebel_environment_map *map = planet_even_sky(&w.scene);
    const nebel_volume_desc mist = mist_of(&w);
    nebel_lighting *fog = make_fog(&w, &mist, irradiance, &w.scene.environment);
    const nebel_camera camera = planet_camera(1e5, -.2);
    test_picture one = render(&w, fog, &camera, NEBEL_ISA_SCALAR, 1);
    for (int isa = NEBEL_ISA_DEFAULT; isa <= (int)NEBEL_ISA_NEON; isa++) {
        if (isa != NEBEL_ISA_DEFAULT && !nebel_isa_available((nebel_isa)isa)) continue;
        test_picture other = render(&w, fog, &camera, (nebel_isa)isa, 3);
        assert_memory_equal(one.planes.in_scattering, other.planes.in_scattering, WIDTH * HEIGHT * 12);
        assert_memory_equal(one.planes.transmittance, other.planes.transmittance, WIDTH * HEIGHT * 12);
        test_picture_free(&other);
    }
    test_picture_free(&one);
    nebel_release_lighting(fog);
    nebel_release_environment_map(map);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_ball_has_the_light_of_its_place),
        cmocka_unit_test(a_ball_high_up_has_its_own_sun),
        cmocka_unit_test(a_ball_in_eclipse_is_black),
        cmocka_unit_test(mist_is_lit_by_place),
        cmocka_unit_test(every_thread_and_processor_gives_the_same),
    };
    return cmocka_run_group_tests(tests, make_air, free_air);
}
