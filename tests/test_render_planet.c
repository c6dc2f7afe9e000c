/* Planets in pictures of the CPU: the sky, the ground and models through air are what nebel_trace_atmosphere says, and air and fog along one ray are
 * what many short pieces give. */
#include "planet_help.h"
#include "test_render_scene.h"

#include "cpu/cpu_irradiance.h"

enum { WIDTH = 40, HEIGHT = 24 };

/* A planet without a file. */
typedef struct world {
    nebel_atmosphere *atmosphere;
    nebel_planet planet;
    nebel_scene_data scene;
} world;

/* Made once for all tests. */
static struct {
    const char *name;
    nebel_atmosphere *atmosphere;
} kept[4] = {{"earth", NULL}, {"mars", NULL}, {"toy", NULL}, {"moon", NULL}};

static nebel_atmosphere *keep_air(const char *name)
{
    int k = 0;
    while (strcmp(kept[k].name, name) != 0) k++;
    if (kept[k].atmosphere == NULL)
        assert_int_equal(nebel_create_atmosphere(nebel_lookup_atmosphere(name), &kept[k].atmosphere), NEBEL_OK);
    return kept[k].atmosphere;
}

static int free_air(void **state)
{
    (void)state;
    for (int k = 0; k < 4; k++) nebel_destroy_atmosphere(kept[k].atmosphere);
    return 0;
}

static void make_world(const char *name, const double sun[3], world *w)
{
    static const double origin[1][3] = {{0, 0, 0}};
    const nebel_sun white = {.direction = {sun[0], sun[1], sun[2]}, .irradiance = {1, 1, 1}};
    nebel_irradiance light;
    *w = (world){.planet = {.atmosphere_desc = *nebel_lookup_atmosphere(name)}};
    w->atmosphere = keep_air(name);
    assert_int_equal(nebel_compute_atmosphere_irradiance(w->atmosphere, &white, 1, origin, 0, &light, 0), NEBEL_OK);
    w->planet.atmosphere = w->atmosphere;
    memcpy(w->planet.sun_left, light.sun, sizeof light.sun);
    w->scene = (nebel_scene_data){.has_sun = 1, .sun_irradiance = {5, 4, 3}, .planet_count = 1, .planets = &w->planet};
    memcpy(w->scene.sun_direction, sun, sizeof w->scene.sun_direction);
}

static nebel_sun sun_of(const world *w)
{
    nebel_sun sun;
    memcpy(sun.direction, w->scene.sun_direction, sizeof sun.direction);
    memcpy(sun.irradiance, w->scene.sun_irradiance, sizeof sun.irradiance);
    return sun;
}

static test_picture render(const world *w, nebel_lighting *fog, const nebel_camera *camera, nebel_isa isa, int threads,
                           uint32_t samples)
{
    nebel_renderer *renderer;
    const test_picture picture = test_picture_make(WIDTH, HEIGHT);
    assert_int_equal(nebel_create_cpu_renderer(
                         &w->scene, fog, &(nebel_cpu_renderer_desc){.isa = isa, .thread_count = threads}, &renderer),
                     NEBEL_OK);
    const nebel_frame_desc desc = {.camera = *camera, .width = WIDTH, .height = HEIGHT, .samples = samples};
    assert_int_equal(nebel_render_frame(renderer, &desc, &picture.planes), NEBEL_OK);
    nebel_destroy_renderer(renderer);
    return picture;
}

/* Lambert's ground where the ray ends, before the air. */
static void light_ground(const world *w, const nebel_ray *ray, const nebel_sun *sun, double light[3], double *way)
{
    const double radius = w->planet.atmosphere_desc.radius;
    double unit[3], from[3], b = 0, c0 = -radius * radius;
    const double length = sqrt(pow(ray->direction[0], 2) + pow(ray->direction[1], 2) + pow(ray->direction[2], 2));
    for (int c = 0; c < 3; c++) {
        unit[c] = ray->direction[c] / length;
        from[c] = ray->origin[c] + (c == 1 ? radius : 0);
        b += unit[c] * from[c];
        c0 += from[c] * from[c];
    }
    *way = b < 0 && b * b > c0 ? c0 / (sqrt(b * b - c0) - b) : HUGE_VAL;
    memset(light, 0, 3 * sizeof *light);
    if (!(*way < HUGE_VAL)) return;
    double place[1][3], cosine = 0;
    nebel_irradiance arrives;
    for (int c = 0; c < 3; c++) {
        place[0][c] = ray->origin[c] + *way * unit[c];
        cosine += (from[c] + *way * unit[c]) / radius * sun->direction[c];
    }
    assert_int_equal(
        nebel_compute_atmosphere_irradiance(w->atmosphere, sun, 1, (const double(*)[3])place, 0, &arrives, 0),
        NEBEL_OK);
    for (int c = 0; c < 3; c++)
        light[c] =
            w->planet.atmosphere_desc.ground_albedo[c] / test_pi * (fmax(0, cosine) * arrives.sun[c] + arrives.sky[c]);
}

static void sky_and_ground_are_those_of_the_air(void **state)
{
    (void)state;
    static const struct {
        const char *name;
        double height, pitch, sun[3];
    } views[] = {{"earth", 1.7, .2, {.8, .6, 0}},      {"earth", 1.7, -.1, {0, .0348994967, -.9993908270}},
                 {"earth", 1e4, -.2, {.6, 0, -.8}},    {"earth", 4e5, -.5, {.96, .28, 0}},
                 {"earth", 2e7, -1.5, {.96, 0, -.28}}, {"mars", 2, 0, {0, .28, .96}},
                 {"toy", 30, -.3, {-.6, .48, .64}}};
    for (size_t v = 0; v < sizeof views / sizeof *views; v++) {
        world w;
        make_world(views[v].name, views[v].sun, &w);
        const nebel_camera camera = planet_camera(views[v].height, views[v].pitch);
        const nebel_sun sun = sun_of(&w);
        test_picture picture = render(&w, NULL, &camera, NEBEL_ISA_DEFAULT, 2, 1);
        double brightest = 0, worst = 0;
        int ground = 0, untold = 0;
        for (uint32_t i = 0; i < WIDTH * HEIGHT; i++) {
            const nebel_ray ray = planet_ray(&camera, views[v].pitch, i % WIDTH, i / WIDTH, WIDTH, HEIGHT);
            nebel_transfer transfer;
            double behind[3], way;
            assert_int_equal(nebel_trace_atmosphere(w.atmosphere, &sun, 1, &ray, 0, &transfer, 0), NEBEL_OK);
            light_ground(&w, &ray, &sun, behind, &way);
            const double depth = (double)picture.planes.depth[i];
            if (fabs(way) < HUGE_VAL) assert_true(fabs(depth - way) <= 1e-5 * way + 1e-3);
            if (!(way < HUGE_VAL)) assert_true(!(depth < HUGE_VAL));
            ground += way < HUGE_VAL;
            double off = 0;
            for (int c = 0; c < 3; c++) {
                const double exact = transfer.in_scattering[c] + transfer.transmittance[c] * behind[c];
                off = fmax(off, fabs((double)picture.planes.color[3 * i + (uint32_t)c] - exact));
                brightest = fmax(brightest, exact);
            }
            worst = fmax(worst, off);
            untold += off > (double)picture.planes.error[i] * 2 + 1e-5; /* of light and of what dims the ground */
        }
        print_message("%s from %g m: %.1e of the brightest, %d of %d told too little\n", views[v].name, views[v].height,
                      worst / brightest, untold, WIDTH * HEIGHT);
        assert_true(brightest > .05 && worst <= .02 * brightest && untold <= WIDTH * HEIGHT / 200);
        assert_true(ground > 0 && ground < WIDTH * HEIGHT);
        test_picture_free(&picture);
    }
}

static const float quad[4][3] = {{-40, -40, 0}, {40, -40, 0}, {40, 40, 0}, {-40, 40, 0}};
static const uint32_t quad_indices[6] = {0, 1, 2, 0, 2, 3};

/* A white wall 2 km away that faces the camera. */
static nebel_mesh wall_at(double distance)
{
    return (nebel_mesh){.origin = {0, 20, -distance},
                        .positions = quad[0],
                        .indices = quad_indices,
                        .vertex_count = 4,
                        .triangle_count = 2,
                        .base_color = {1, 1, 1},
                        .texture = -1};
}

static void models_are_seen_through_air(void **state)
{
    (void)state;
    const double to_sun[3] = {0, .6, .8};
    const nebel_mesh wall = wall_at(2000);
    world w;
    make_world("earth", to_sun, &w);
    w.scene.mesh_count = 1;
    w.scene.meshes = &wall;
    nebel_camera camera = planet_camera(20, 0);
    camera.vertical_fov = 1.5;
    const nebel_sun sun = sun_of(&w);
    test_picture picture = render(&w, NULL, &camera, NEBEL_ISA_DEFAULT, 1, 1);
    const uint32_t middle = HEIGHT / 2 * WIDTH + WIDTH / 2;
    const nebel_ray ray = {{0, 20, 0}, {0, 0, -1}, 2000};
    nebel_transfer transfer;
    assert_int_equal(nebel_trace_atmosphere(w.atmosphere, &sun, 1, &ray, 0, &transfer, 0), NEBEL_OK);
    assert_true(fabs((double)picture.planes.depth[middle] - 2000) < 1);
    for (int c = 0; c < 3; c++) {
        const double lit = w.planet.sun_left[c] * sun.irradiance[c] * .8 / test_pi;
        const double exact = transfer.transmittance[c] * lit + transfer.in_scattering[c];
        assert_true(transfer.in_scattering[c] > .004 && transfer.transmittance[c] < .995);
        assert_true(fabs((double)picture.planes.color[3 * middle + (uint32_t)c] - exact) <
                    fmin(.01 * exact, (double)picture.planes.error[middle] * 2 + 1e-4));
    }
    test_picture_free(&picture);
}

/* Summits in the sun that has set below them, and plains that the night has reached. */
static void models_take_the_light_of_their_place(void **state)
{
    (void)state;
    static const double cases[][2] = {{5, 3e4}, {5000, 3e4}, {2e4, 3e4}, {40, 2e5}}; /* m: height, distance */
    double lit_below = 0;
    for (size_t k = 0; k < sizeof cases / sizeof *cases; k++) {
        world w;
        const double to_sun[3] = {0, -.02, sqrt(1 - .02 * .02)}, height = cases[k][0], distance = cases[k][1];
        const nebel_mesh wall = wall_at(distance);
        nebel_mesh high = wall;
        high.origin[1] = height;
        make_world("earth", to_sun, &w);
        w.scene.mesh_count = 1;
        w.scene.meshes = &high;
        nebel_camera camera = planet_camera(height, 0);
        camera.vertical_fov = .01;
        camera.position[2] = 20 - distance;
        camera.look_at[2] = -distance;
        const nebel_sun sun = sun_of(&w);
        test_picture picture = render(&w, NULL, &camera, NEBEL_ISA_DEFAULT, 1, 1);
        const uint32_t middle = HEIGHT / 2 * WIDTH + WIDTH / 2;
        const nebel_ray ray = {{0, height, 20 - distance}, {0, 0, -1}, 20};
        const double place[1][3] = {{0, height, -distance}};
        nebel_transfer transfer;
        nebel_irradiance there;
        assert_int_equal(nebel_trace_atmosphere(w.atmosphere, &sun, 1, &ray, 0, &transfer, 0), NEBEL_OK);
        assert_int_equal(nebel_compute_atmosphere_irradiance(w.atmosphere, &sun, 1, place, 0, &there, 0), NEBEL_OK);
        for (int c = 0; c < 3; c++) {
            const double exact =
                transfer.transmittance[c] * there.sun[c] * to_sun[2] / test_pi + transfer.in_scattering[c];
            print_message("%g m up, %g m off: %.4g of %.4g\n", height, distance,
                          (double)picture.planes.color[3 * middle + (uint32_t)c], exact);
            assert_true(fabs((double)picture.planes.color[3 * middle + (uint32_t)c] - exact) < .01 * exact + 1e-5);
        }
        assert_true(w.planet.sun_left[0] == 0);
        lit_below += height < 100 ? there.sun[0] : 0;
        test_picture_free(&picture);
    }
    assert_true(lit_below == 0);
}

/* What the tables of daylight say is what the air says of the same places. */
static void daylight_is_that_of_the_air(void **state)
{
    (void)state;
    static const char *const names[] = {"earth", "mars", "toy"};
    static const double to_sun[3] = {.48, .6, .64}, origin[1][3] = {{0, 0, 0}};
    static nb_irradiance_table daylight;
    for (int n = 0; n < 3; n++) {
        world w;
        make_world(names[n], to_sun, &w);
        const double radius = w.planet.atmosphere_desc.radius, top = w.planet.atmosphere_desc.thickness;
        const nebel_sun white = {.direction = {to_sun[0], to_sun[1], to_sun[2]}, .irradiance = {1, 1, 1}};
        nebel_irradiance at_origin, there;
        double worst_sun = 0, worst_sky = 0;
        nb_irradiance_set(&daylight, &w.planet, &w.planet, to_sun);
        assert_int_equal(nebel_compute_atmosphere_irradiance(w.atmosphere, &white, 1, origin, 0, &at_origin, 0),
                         NEBEL_OK);
        for (int i = 0; i < 2000; i++) {
            const double y = 1 - 2 * (i + .5) / 2000, turn = 2.4 * i, height = 1.2 * top * pow(i % 37 / 36., 2);
            const double level = sqrt(1 - y * y);
            const double place[1][3] = {{(radius + height) * level * cos(turn), (radius + height) * y - radius,
                                         (radius + height) * level * sin(turn)}};
            double sun[3], sky[3];
            assert_int_equal(nebel_compute_atmosphere_irradiance(w.atmosphere, &white, 1, place, 0, &there, 0),
                             NEBEL_OK);
            nb_irradiance_at(&daylight, NB_IRRADIANCE_OF_SURFACES, place[0], sun, sky);
            for (int c = 0; c < 3; c++) {
                worst_sun = fmax(worst_sun, fabs(sun[c] - there.sun[c]));
                worst_sky = fmax(worst_sky, fabs(sky[c] * at_origin.sky[c] - there.sky[c]) / at_origin.sky[c]);
            }
        }
        print_message("%s: sun off by %.1e, sky by %.1e of that at the origin\n", names[n], worst_sun, worst_sky);
        assert_true(worst_sun <= 2e-3 && worst_sky <= 6e-3);
    }
}

/* On the ground where the sun is so high: of the sky by 48 x 48 directions, the same on both sides of the sun, and of the ground. */
static void look_around(const world *w, const double to_sun[3], double height_of_sun, double place[3], double light[3])
{
    enum { SLOPES = 48, TURNS = 48 };
    static nebel_ray rays[SLOPES * TURNS];
    static nebel_transfer found[SLOPES * TURNS];
    const nebel_sun white = {.direction = {to_sun[0], to_sun[1], to_sun[2]}, .irradiance = {1, 1, 1}};
    const double level = sqrt(1 - height_of_sun * height_of_sun), radius = w->planet.atmosphere_desc.radius;
    double other[3] = {to_sun[1], -to_sun[0], 0}, up[3], ahead[3], across[3];
    assert_true(nb_vector_make_unit(other));
    for (int c = 0; c < 3; c++) {
        up[c] = height_of_sun * to_sun[c] + level * other[c];
        ahead[c] = level * to_sun[c] - height_of_sun * other[c];
        place[c] = radius * up[c] - (c == 1 ? radius : 0);
    }
    nb_vector_cross(up, ahead, across);
    for (int i = 0; i < SLOPES * TURNS; i++) {
        const double slope = (i / TURNS + .5) / SLOPES, flat = sqrt(1 - slope * slope),
                     turn = test_pi * (i % TURNS + .5) / TURNS;
        rays[i].t_max = HUGE_VAL;
        memcpy(rays[i].origin, place, sizeof rays[i].origin);
        for (int c = 0; c < 3; c++)
            rays[i].direction[c] = slope * up[c] + flat * (cos(turn) * ahead[c] + sin(turn) * across[c]);
    }
    nebel_irradiance there;
    assert_int_equal(
        nebel_compute_atmosphere_irradiance(w->atmosphere, &white, 1, (const double(*)[3])place, 0, &there, 0),
        NEBEL_OK);
    assert_int_equal(
        nebel_trace_atmosphere(w->atmosphere, &white, SLOPES * TURNS, rays, sizeof *rays, found, sizeof *found),
        NEBEL_OK);
    for (int c = 0; c < 3; c++) {
        light[c] =
            2 * w->planet.atmosphere_desc.ground_albedo[c] * (there.sky[c] + fmax(0, height_of_sun) * there.sun[c]);
        for (int i = 0; i < SLOPES * TURNS; i++)
            light[c] += 2 * test_pi / (SLOPES * TURNS) * (double)found[i].in_scattering[c];
    }
}

/* By the shape of the sky, too: the irradiance of level ground changes eight times as much from noon to dusk. */
static void fog_has_the_sky_from_all_sides(void **state)
{
    (void)state;
    static const char *const names[] = {"earth", "mars"};
    static const double to_sun[3] = {.48, .6, .64};
    static const double heights[] = {.999, .7, .3, .1, .03, 0, -.03, -.1, -.3};
    static nb_irradiance_table daylight;
    for (int n = 0; n < 2; n++) {
        world w;
        make_world(names[n], to_sun, &w);
        double place[3], there[3], at_origin[3], worst = 0, by_level = 0;
        const nebel_sun white = {.direction = {to_sun[0], to_sun[1], to_sun[2]}, .irradiance = {1, 1, 1}};
        nebel_irradiance level, level_at_origin;
        nb_irradiance_set(&daylight, &w.planet, &w.planet, to_sun);
        look_around(&w, to_sun, to_sun[1], place, at_origin);
        assert_int_equal(nebel_compute_atmosphere_irradiance(w.atmosphere, &white, 1, (const double(*)[3])place, 0,
                                                             &level_at_origin, 0),
                         NEBEL_OK);
        for (size_t i = 0; i < sizeof heights / sizeof *heights; i++) {
            double sun[3], sky[3];
            look_around(&w, to_sun, heights[i], place, there);
            nb_irradiance_at(&daylight, NB_IRRADIANCE_OF_FOG, place, sun, sky);
            assert_int_equal(
                nebel_compute_atmosphere_irradiance(w.atmosphere, &white, 1, (const double(*)[3])place, 0, &level, 0),
                NEBEL_OK);
            for (int c = 0; c < 3; c++) {
                const double off = fabs(log(sky[c] * at_origin[c] / there[c]));
                assert_true(heights[i] > -.15 ||
                            off < .25); /* of a sky that is all at the horizon, a millionth as bright */
                if (heights[i] > -.15) worst = fmax(worst, off);
                by_level = fmax(by_level, fabs(log(level.sky[c] / level_at_origin.sky[c] * at_origin[c] / there[c])));
            }
        }
        print_message("%s: off by %.2g; by level ground it would be by %.2g\n", names[n], worst, by_level);
        assert_true(worst < .08 && by_level > 4 * worst);
    }
}

/* Many short pieces, each of air and of fog for itself: what is left is of their length. */
static void step_along(const world *w, const nebel_lighting *fog, nebel_ray ray, double end, double light[3])
{
    enum { STEPS = 3000 };
    const nebel_sun sun = sun_of(w);
    double unit[3], left[3] = {1, 1, 1}, at = 0;
    const double length = sqrt(pow(ray.direction[0], 2) + pow(ray.direction[1], 2) + pow(ray.direction[2], 2));
    const nebel_ray whole = ray;
    for (int c = 0; c < 3; c++) {
        unit[c] = ray.direction[c] / length;
        light[c] = 0;
    }
    for (int i = 0; i < STEPS; i++) {
        const double next = end * pow((i + 1.0) / STEPS, 3);
        nebel_transfer air, of_fog;
        ray.t_max = next - at;
        for (int c = 0; c < 3; c++) ray.origin[c] = whole.origin[c] + at * unit[c];
        assert_int_equal(nebel_trace_atmosphere(w->atmosphere, &sun, 1, &ray, 0, &air, 0), NEBEL_OK);
        fog_trace(fog, (nebel_trace_desc){0}, 1, &ray, &of_fog);
        for (int c = 0; c < 3; c++) {
            light[c] += left[c] * (0.5 * (1 + of_fog.transmittance[c]) * air.in_scattering[c] +
                                   0.5 * (1 + air.transmittance[c]) * of_fog.in_scattering[c]);
            left[c] *= air.transmittance[c] * of_fog.transmittance[c];
        }
        at = next;
    }
}

static void air_and_fog_share_a_ray(void **state)
{
    (void)state;
    const double to_sun[3] = {.6, .3, -.74161984870956629}, pitch = .05;
    world w;
    make_world("earth", to_sun, &w);
    nebel_lighting *snapshot = planet_fog(to_sun);
    const nebel_camera camera = planet_camera(50, pitch);
    test_picture picture = render(&w, snapshot, &camera, NEBEL_ISA_DEFAULT, 2, 1);
    double worst = 0, apart = 0;
    for (uint32_t i = 5; i < WIDTH * HEIGHT; i += 97) {
        const nebel_ray ray = planet_ray(&camera, pitch, i % WIDTH, i / WIDTH, WIDTH, HEIGHT);
        const nebel_sun sun = sun_of(&w);
        double light[3], behind[3], way;
        nebel_transfer air, alone;
        light_ground(&w, &ray, &sun, behind, &way);
        nebel_ray ending = ray;
        ending.t_max = fmin(way, 1.5e6);
        step_along(&w, snapshot, ray, ending.t_max, light);
        assert_int_equal(nebel_trace_atmosphere(w.atmosphere, &sun, 1, &ray, 0, &air, 0), NEBEL_OK);
        fog_trace(snapshot, (nebel_trace_desc){0}, 1, &ending, &alone);
        for (int c = 0; c < 3; c++) {
            const double got = (double)picture.planes.in_scattering[3 * i + (uint32_t)c];
            const double left = (double)picture.planes.transmittance[3 * i + (uint32_t)c];
            assert_true(fabs(left - air.transmittance[c] * alone.transmittance[c]) < 2e-3);
            assert_true(fabs(got - light[c]) <= (double)picture.planes.error[i] + 5e-4);
            worst = fmax(worst, fabs(got - light[c]));
            apart =
                fmax(apart, fabs(air.in_scattering[c] * alone.transmittance[c] + alone.in_scattering[c] - light[c]));
        }
    }
    print_message("air and fog: off by %.1e; fog before all air would be off by %.1e\n", worst, apart);
    assert_true(worst < 6e-3 && apart > 5 * worst);
    test_picture_free(&picture);
    nebel_release_lighting(snapshot);
}

/* A ball that glows at night. */
static nebel_lighting *glowing_ball(void)
{
    const nebel_volume_desc ball = {.shape = {.type = NEBEL_SHAPE_SPHERE, .center = {0, 3, -30}, .radius = 12},
                                    .density = {.type = NEBEL_DENSITY_GAUSSIAN, .center = {0, 3, -30}, .sigma = 5},
                                    .extinction = {.02, .02, .02},
                                    .source = {.05, .05, .05}};
    return fog_commit_lit(&(nebel_fog_desc){0}, &ball, 1, NULL);
}

/* Fog and air along a ray are composed to a tolerance; in the dark it is so much less that no ring shows where one more piece is
 * taken. */
static void fog_in_the_dark_is_as_exact(void **state)
{
    (void)state;
    static const double night[3] = {.29, -.19, -.94};
    const nebel_camera camera = planet_camera(3, -.1);
    nebel_lighting *snapshot = glowing_ball();
    nebel_renderer *renderer;
    test_picture exact = test_picture_make(WIDTH, HEIGHT);
    world w;
    make_world("earth", night, &w);
    test_picture usual = render(&w, snapshot, &camera, NEBEL_ISA_DEFAULT, 2, 1);
    assert_int_equal(
        nebel_create_cpu_renderer(&w.scene, snapshot, &(nebel_cpu_renderer_desc){.thread_count = 2}, &renderer),
        NEBEL_OK);
    const nebel_frame_desc fine = {.camera = camera, .width = WIDTH, .height = HEIGHT, .samples = 1, .tolerance = 1e-6};
    assert_int_equal(nebel_render_frame(renderer, &fine, &exact.planes), NEBEL_OK);
    nebel_destroy_renderer(renderer);
    double worst = 0;
    int lit = 0;
    for (uint32_t i = 0; i < 3 * WIDTH * HEIGHT; i++) {
        const double light = (double)exact.planes.in_scattering[i];
        lit += light > 1e-3;
        worst = fmax(worst, fabs((double)usual.planes.in_scattering[i] - light) / fmax(light, 1. / 32));
    }
    print_message("a glow at night: %d of %d are lit, off by %.1e of their light or a 32nd\n", lit, 3 * WIDTH * HEIGHT,
                  worst);
    assert_true(lit > 300 && worst <= 4e-3);
    test_picture_free(&usual);
    test_picture_free(&exact);
    nebel_release_lighting(snapshot);
}

/* A ball of black fog 5 m over the ground, in the sun and beside a point light. */
static nebel_lighting *black_ball(const double shift[3])
{
    const nebel_volume_desc ball = {
        .shape = {.type = NEBEL_SHAPE_SPHERE, .center = {shift[0] + 1.5, shift[1] + 5, shift[2] - 12}, .radius = 3},
        .extinction = {2, 2, 2}};
    return fog_commit_lit(&(nebel_fog_desc){0}, &ball, 1, NULL);
}

/* The ball, its shadows and a planet, all of them `shift` off, before a camera that goes with them. */
static test_picture render_shadow(const double shift[3], const nebel_mesh *mesh)
{
    const double to_sun[3] = {.48, .6, -.64};
    nebel_light light = {.position = {shift[0] + 6, shift[1] + 7, shift[2] - 8}, .intensity = {300, 300, 300}};
    nebel_camera camera = planet_camera(14, -1);
    world w;
    make_world("moon", to_sun, &w);
    for (int c = 0; c < 3; c++) {
        w.planet.atmosphere_desc.ground_point[c] += shift[c];
        camera.position[c] += shift[c];
        camera.look_at[c] += shift[c];
    }
    assert_int_equal(nebel_create_atmosphere(&w.planet.atmosphere_desc, &w.atmosphere), NEBEL_OK);
    w.planet.atmosphere = w.atmosphere;
    w.scene.light_count = 1;
    w.scene.lights = &light;
    w.scene.mesh_count = mesh != NULL;
    w.scene.meshes = mesh;
    nebel_lighting *fog = black_ball(shift);
    const test_picture picture = render(&w, fog, &camera, NEBEL_ISA_DEFAULT, 1, 1);
    nebel_release_lighting(fog);
    nebel_destroy_atmosphere(w.atmosphere);
    return picture;
}

/* Places of the ground count from the camera, wherever the scene's origin is, or the nearest model. */
static void shadows_of_fog_are_the_same_everywhere(void **state)
{
    (void)state;
    static const double shifts[][3] = {{0, 0, 0}, {0, -12720000, 0}, {6360000, 3e6, -5e6}, {-2e7, 1e8, 3e7}};
    const nebel_mesh wall = wall_at(2000);
    test_picture near_by = render_shadow(shifts[0], NULL);
    double brightest = 0;
    int dark = 0;
    for (uint32_t i = 0; i < WIDTH * HEIGHT; i++) brightest = fmax(brightest, (double)near_by.planes.color[3 * i]);
    for (uint32_t i = 0; i < WIDTH * HEIGHT; i++)
        dark += near_by.planes.transmittance[3 * i] == 1 && (double)near_by.planes.color[3 * i] < .3 * brightest;
    assert_true(dark > 10);
    for (size_t k = 2; k < 2 * sizeof shifts / sizeof *shifts; k++) {
        const double *shift = shifts[k / 2];
        test_picture far_off = render_shadow(shift, k % 2 != 0 ? &wall : NULL);
        double worst = 0;
        for (uint32_t i = 0; i < 3 * WIDTH * HEIGHT; i++)
            worst = fmax(worst, fabs((double)far_off.planes.color[i] - (double)near_by.planes.color[i]));
        print_message("%g %g %g m off: %d dark pixels, %.1e of the brightest\n", shift[0], shift[1], shift[2], dark,
                      worst / brightest);
        assert_true(worst <= 1e-4 * brightest);
        test_picture_free(&far_off);
    }
    test_picture_free(&near_by);
}

/* As many pixels to a pixel, across and down, of one sample each. */
enum { TIMES = 4 };

static test_picture render_large(const world *w, const nebel_camera *camera)
{
    const test_picture large = test_picture_make(TIMES * WIDTH, TIMES * HEIGHT);
    nebel_renderer *renderer;
    assert_int_equal(
        nebel_create_cpu_renderer(&w->scene, NULL, &(nebel_cpu_renderer_desc){.thread_count = 2}, &renderer), NEBEL_OK);
    assert_int_equal(
        nebel_render_frame(
            renderer,
            &(nebel_frame_desc){.camera = *camera, .width = TIMES * WIDTH, .height = TIMES * HEIGHT, .samples = 1},
            &large.planes),
        NEBEL_OK);
    nebel_destroy_renderer(renderer);
    return large;
}

/* What they have in place of one pixel. */
typedef struct spread {
    double least, mean, most;
} spread;

static spread look_closer(const test_picture *large, int pixel, int c)
{
    spread seen = {HUGE_VAL, 0, 0};
    for (int k = 0; k < TIMES * TIMES; k++) {
        const int at = (pixel / WIDTH * TIMES + k / TIMES) * TIMES * WIDTH + pixel % WIDTH * TIMES + k % TIMES;
        const double light = (double)large->planes.color[3 * at + c];
        seen.least = fmin(seen.least, light);
        seen.mean += light / (TIMES * TIMES);
        seen.most = fmax(seen.most, light);
    }
    return seen;
}

/* Where one sample does for a pixel, many agree: with the disc of the sun, the horizon and the limb in the picture. */
static void many_samples_are_the_mean_of_single_ones(void **state)
{
    (void)state;
    static const struct {
        const char *name;
        double height, pitch, sun[3];
    } views[] = {{"earth", 1.7, .1, {0, .1, -.99498743710662}},
                 {"earth", 1e4, -.2, {.6, 0, -.8}},
                 {"earth", 4e5, -.4, {.96, .28, 0}},
                 {"earth", 2e7, -1.5, {.96, 0, -.28}},
                 {"mars", 2, 0, {0, .28, -.96}},
                 {"toy", 30, -.3, {-.6, .48, .64}}};
    for (size_t v = 0; v < sizeof views / sizeof *views; v++) {
        world w;
        if (v > 0 && v < 4 && !nb_test_tries(v - 1, 3)) continue;
        make_world(views[v].name, views[v].sun, &w);
        w.planet.sun_angular_diameter = 2;
        nebel_camera camera = planet_camera(views[v].height, views[v].pitch);
        camera.vertical_fov = 6;
        test_picture small = render(&w, NULL, &camera, NEBEL_ISA_DEFAULT, 2, TIMES * TIMES);
        test_picture large = render_large(&w, &camera);
        double worst = 0, all[2] = {0, 0};
        int far_off = 0;
        for (int i = 0; i < WIDTH * HEIGHT; i++) {
            double off = 0, most = 1e-9;
            for (int c = 0; c < 3; c++) {
                const double mean = look_closer(&large, i, c).mean;
                all[0] += (double)small.planes.color[3 * i + c];
                all[1] += mean;
                most = fmax(most, mean);
                off = fmax(off, fabs((double)small.planes.color[3 * i + c] - mean));
            }
            worst = fmax(worst, off / most);
            far_off += off > 2e-3 * most;
        }
        print_message("%s from %g m: %d of %d pixels off by more than 2e-3, the worst by %.1e\n", views[v].name,
                      views[v].height, far_off, WIDTH * HEIGHT, worst);
        /* Samples lie elsewhere in a pixel, which shows at the horizon and the edge of the disc: three rows, of a
         * curved one, or its rim. */
        assert_true(far_off <= 3 * WIDTH && (v == 0 || worst <= 1e-2) && fabs(all[0] / all[1] - 1) <= 2e-3);
        test_picture_free(&small);
        test_picture_free(&large);
    }
}

/* Wherever in a pixel, and in the blocks that are found at once, the horizon lies: by a fourteenth of a pixel from picture to picture. */
static void the_horizon_has_no_steps(void **state)
{
    (void)state;
    enum { SHIFTS = 56 };
    static const double sun[3] = {.6, .48, .64}, degree = 0.017453292519943295;
    double off[3] = {0, 0, 0}, border[3] = {0, 0, 0}, worst = 0;
    world w;
    make_world("earth", sun, &w);
    for (int k = 0; k < SHIFTS; k++) {
        if (!nb_test_tries((size_t)k, SHIFTS)) continue;
        nebel_camera camera = planet_camera(1.7, 6. / HEIGHT * k / 14 * degree);
        camera.vertical_fov = 6;
        test_picture small = render(&w, NULL, &camera, NEBEL_ISA_DEFAULT, 2, 64);
        test_picture large = render_large(&w, &camera);
        for (int i = 0; i < WIDTH * HEIGHT; i++)
            for (int c = 0; c < 3; c++) {
                const spread seen = look_closer(&large, i, c);
                off[c] = fmax(off[c], fabs((double)small.planes.color[3 * i + c] - seen.mean));
                border[c] = fmax(border[c], seen.most - seen.least);
            }
        test_picture_free(&small);
        test_picture_free(&large);
    }
    for (int c = 0; c < 3; c++) worst = fmax(worst, off[c] / border[c]);
    print_message("pixels are off by %.2f of what the horizon parts\n", worst);
    assert_true(worst <= .2); /* samples lie elsewhere: of four rows in a pixel one may see the other side */
}

/* All its light, however few pixels it is, and no more: the picture with it less the one without. */
static void the_sun_is_a_disc(void **state)
{
    (void)state;
    static const double fields[] = {5, 60};
    const double to_sun[3] = {0, .6, -.8};
    world w;
    make_world("mars", to_sun, &w);
    for (int f = 0; f < 2; f++) {
        nebel_camera camera = planet_camera(2, asin(.6));
        camera.vertical_fov = fields[f];
        camera.look_at[0] += .001;
        double sum[3] = {0, 0, 0};
        for (int seen = 0; seen < 2; seen++) {
            w.planet.sun_angular_diameter = seen ? .35 : 0;
            test_picture picture = render(&w, NULL, &camera, NEBEL_ISA_DEFAULT, 1, 16);
            const double pixel = 2 * tan(fields[f] * test_pi / 360) / HEIGHT;
            for (uint32_t i = 0; i < WIDTH * HEIGHT; i++)
                for (int c = 0; c < 3; c++)
                    sum[c] += (seen ? 1 : -1) * pixel * pixel * (double)picture.planes.color[3 * i + (uint32_t)c];
            test_picture_free(&picture);
        }
        for (int c = 0; c < 3; c++) {
            const double arrives = w.planet.sun_left[c] * w.scene.sun_irradiance[c];
            print_message("field %g: %.3f of the sun's light\n", fields[f], sum[c] / arrives);
            assert_true(fabs(sum[c] / arrives - 1) < .1);
        }
    }
}

static void every_thread_and_processor_gives_the_same(void **state)
{
    (void)state;
    const double to_sun[3] = {.6, .3, -.74161984870956629};
    const nebel_mesh wall = wall_at(300);
    world w;
    make_world("toy", to_sun, &w);
    w.scene.mesh_count = 1;
    w.scene.meshes = &wall;
    w.planet.sun_angular_diameter = 3;
    const nebel_volume_desc ball = {.shape = {.type = NEBEL_SHAPE_SPHERE, .center = {0, 20, -90}, .radius = 40},
                                    .extinction = {.01, .02, .03},
                                    .source = {.5, .4, .3}};
    nebel_lighting *snapshot = fog_commit_lit(&(nebel_fog_desc){0}, &ball, 1, NULL);
    const nebel_camera camera = planet_camera(10, .1);
    test_picture one = render(&w, snapshot, &camera, NEBEL_ISA_DEFAULT, 1, 1);
    for (int isa = NEBEL_ISA_DEFAULT; isa <= (int)NEBEL_ISA_NEON; isa++) {
        if (isa != NEBEL_ISA_DEFAULT && !nebel_isa_available((nebel_isa)isa)) continue;
        test_picture other = render(&w, snapshot, &camera, (nebel_isa)isa, 3, 1);
        assert_memory_equal(one.planes.transmittance, other.planes.transmittance, WIDTH * HEIGHT * 12);
        assert_memory_equal(one.planes.in_scattering, other.planes.in_scattering, WIDTH * HEIGHT * 12);
        if (isa == NEBEL_ISA_DEFAULT) assert_memory_equal(one.planes.color, other.planes.color, WIDTH * HEIGHT * 12);
        test_picture_free(&other);
    }
    test_picture_free(&one);
    nebel_release_lighting(snapshot);
}

/* Below the ground, in the centre, far away, and what planets are not drawn with. */
static void odd_cameras(void **state)
{
    (void)state;
    static const double heights[] = {0, -1, -1000, -1999, 1e9};
    const double to_sun[3] = {.6, .8, 0};
    world w;
    make_world("toy", to_sun, &w);
    for (int h = 0; h < 5; h++) {
        const nebel_camera camera = planet_camera(heights[h], -.1);
        test_picture picture = render(&w, NULL, &camera, NEBEL_ISA_DEFAULT, 1, 1);
        for (uint32_t i = 0; i < WIDTH * HEIGHT * 3; i++)
            assert_true(picture.planes.color[i] >= 0 && picture.planes.color[i] < 1e6f);
        test_picture_free(&picture);
    }
    nebel_renderer *renderer;
    assert_int_equal(
        nebel_create_cpu_renderer(&w.scene, NULL, &(nebel_cpu_renderer_desc){.thread_count = 1}, &renderer), NEBEL_OK);
    nebel_frame_desc desc = {.camera = planet_camera(10, 0), .width = 8, .height = 8};
    desc.camera.projection = NEBEL_PROJECTION_ORTHOGRAPHIC;
    desc.camera.view_height = 10;
    assert_int_equal(nebel_render_frame(renderer, &desc, &(nebel_frame){.color = NULL}), NEBEL_ERROR_UNSUPPORTED);
    desc.camera.projection = NEBEL_PROJECTION_PANORAMA;
    assert_int_equal(nebel_render_frame(renderer, &desc, &(nebel_frame){.color = NULL}), NEBEL_OK);
    assert_int_equal(nebel_set_renderer_method(renderer, NEBEL_METHOD_ADDITIVE, NULL), NEBEL_OK);
    assert_int_equal(nebel_render_frame(renderer, &desc, &(nebel_frame){.color = NULL}), NEBEL_ERROR_UNSUPPORTED);
    nebel_destroy_renderer(renderer);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(sky_and_ground_are_those_of_the_air),
        cmocka_unit_test(models_are_seen_through_air),
        cmocka_unit_test(daylight_is_that_of_the_air),
        cmocka_unit_test(fog_has_the_sky_from_all_sides),
        cmocka_unit_test(models_take_the_light_of_their_place),
        cmocka_unit_test(air_and_fog_share_a_ray),
        cmocka_unit_test(shadows_of_fog_are_the_same_everywhere),
        cmocka_unit_test(many_samples_are_the_mean_of_single_ones),
        cmocka_unit_test(the_horizon_has_no_steps),
        cmocka_unit_test(fog_in_the_dark_is_as_exact),
        cmocka_unit_test(the_sun_is_a_disc),
        cmocka_unit_test(every_thread_and_processor_gives_the_same),
        cmocka_unit_test(odd_cameras),
    };
    return cmocka_run_group_tests(tests, NULL, free_air);
}
