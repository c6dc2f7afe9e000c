/* Several planets in one picture of the CPU: each ray through the air of all in the order of their distances, to the
 * nearest ground, against nebel_trace_atmosphere planet by planet; eclipses against rays to all of the sun's disc. */
#include "near.h"
#include "planet_help.h"
#include "test_render_scene.h"
#include "worlds_help.h"

#include "aerial/eclipse.h"

#include <nebel/planet.h>

enum { WIDTH = 40, HEIGHT = 24 };

static test_picture render(const worlds *s, const nebel_camera *camera, int threads, uint32_t samples)
{
    nebel_renderer *renderer;
    const test_picture picture = test_picture_make(WIDTH, HEIGHT);
    assert_int_equal(
        nebel_create_cpu_renderer(&s->scene, NULL, &(nebel_cpu_renderer_desc){.thread_count = threads}, &renderer),
        NEBEL_OK);
    const nebel_frame_desc desc = {.camera = *camera, .width = WIDTH, .height = HEIGHT, .samples = samples};
    assert_int_equal(nebel_render_frame(renderer, &desc, &picture.planes), NEBEL_OK);
    nebel_destroy_renderer(renderer);
    return picture;
}

static void center_of(const nebel_planet *planet, double center[3])
{
    memcpy(center, planet->atmosphere_desc.ground_point, 3 * sizeof *center);
    center[1] -= planet->atmosphere_desc.radius;
}

/* From where to where a ray is within a ball; HUGE_VAL where never. Its direction has the length 1. */
static void cross_ball(const double origin[3], const double unit[3], const double center[3], double radius,
                       double at[2])
{
    double from[3], aside[3];
    for (int c = 0; c < 3; c++) from[c] = origin[c] - center[c];
    const double along = nb_vector_dot(from, unit);
    for (int c = 0; c < 3; c++) aside[c] = from[c] - along * unit[c];
    const double far = nb_vector_length(aside), square = (radius - far) * (radius + far);
    at[0] = at[1] = HUGE_VAL;
    if (!(square > 0) || !(-along + sqrt(square) > 0)) return;
    at[0] = -along - sqrt(square);
    at[1] = -along + sqrt(square);
}

/* The part of rays to a disc of suns that meet no planet but one. */
static double count_suns(const worlds *s, size_t but, const double place[3])
{
    enum { ACROSS = 60 };
    const double radius = .5 * s->planets[0].sun_angular_diameter * test_pi / 180;
    const double axis[3] = {fabs(s->sun.direction[0]) < .5, 0, !(fabs(s->sun.direction[0]) < .5)};
    double side[3], up[3];
    int all = 0, seen = 0;
    nb_vector_cross(s->sun.direction, axis, side);
    assert_true(nb_vector_make_unit(side));
    nb_vector_cross(s->sun.direction, side, up);
    for (int i = 0; i < ACROSS * ACROSS; i++) {
        const double x = 2 * (i % ACROSS + .5) / ACROSS - 1, y = 2 * (i / ACROSS + .5) / ACROSS - 1;
        const double out = hypot(x, y), angle = radius * out;
        double to[3];
        int hidden = 0;
        if (!(out < 1)) continue;
        for (int c = 0; c < 3; c++)
            to[c] = cos(angle) * s->sun.direction[c] + sin(angle) * (x / out * side[c] + y / out * up[c]);
        for (size_t k = 0; k < s->count; k++) {
            double center[3], at[2];
            center_of(&s->planets[k], center);
            cross_ball(place, to, center, s->planets[k].atmosphere_desc.radius, at);
            hidden |= k != but && at[1] < HUGE_VAL;
        }
        all++;
        seen += !hidden;
    }
    return (double)seen / all;
}

/* Light along a ray, planet by planet as it enters their air. */
static double look(const worlds *s, const nebel_ray *camera_ray, double light[3])
{
    double unit[3], entry[WORLDS_MOST], end = HUGE_VAL, left[3] = {1, 1, 1};
    size_t order[WORLDS_MOST], ground = 0;
    memcpy(unit, camera_ray->direction, sizeof unit);
    assert_true(nb_vector_make_unit(unit));
    for (size_t k = 0; k < s->count; k++) {
        double center[3], air[2], ball[2];
        size_t place = k;
        center_of(&s->planets[k], center);
        cross_ball(camera_ray->origin, unit, center,
                   s->planets[k].atmosphere_desc.radius + s->planets[k].atmosphere_desc.thickness, air);
        cross_ball(camera_ray->origin, unit, center, s->planets[k].atmosphere_desc.radius, ball);
        entry[k] = air[0];
        if (ball[0] > 0 && ball[0] < end) {
            end = ball[0];
            ground = k;
        }
        for (; place > 0 && entry[order[place - 1]] > entry[k]; place--) order[place] = order[place - 1];
        order[place] = k;
    }
    memset(light, 0, 3 * sizeof *light);
    for (size_t k = 0; k < s->count; k++) {
        nebel_ray ray = *camera_ray;
        nebel_transfer part;
        ray.t_max = end;
        assert_int_equal(nebel_trace_atmosphere(s->atmospheres[order[k]], &s->sun, 1, &ray, 0, &part, 0), NEBEL_OK);
        for (int c = 0; c < 3; c++) {
            light[c] += left[c] * part.in_scattering[c];
            left[c] *= part.transmittance[c];
        }
    }
    if (!(end < HUGE_VAL)) return end;
    double place[1][3], center[3], cosine = 0;
    nebel_irradiance arrives;
    center_of(&s->planets[ground], center);
    for (int c = 0; c < 3; c++) {
        place[0][c] = camera_ray->origin[c] + end * unit[c];
        cosine += (place[0][c] - center[c]) / s->planets[ground].atmosphere_desc.radius * s->sun.direction[c];
    }
    assert_int_equal(nebel_compute_atmosphere_irradiance(s->atmospheres[ground], &s->sun, 1, (const double(*)[3])place,
                                                         0, &arrives, 0),
                     NEBEL_OK);
    const double seen = count_suns(s, ground, place[0]);
    for (int c = 0; c < 3; c++)
        light[c] += left[c] * s->planets[ground].atmosphere_desc.ground_albedo[c] / test_pi *
                    (fmax(0, cosine) * seen * arrives.sun[c] + arrives.sky[c]);
    return end;
}

static void worlds_are_seen_one_behind_the_other(void **state)
{
    (void)state;
    for (size_t v = 0; v < WORLDS_VIEWS; v++) {
        worlds s;
        worlds_make(worlds_views[v].count, worlds_views[v].bodies, worlds_views[v].sun, worlds_views[v].diameter, &s);
        const nebel_camera camera = planet_camera(worlds_views[v].height, worlds_views[v].pitch);
        test_picture picture = render(&s, &camera, 2, 1);
        double brightest = 0, worst = 0, least = 1;
        int untold = 0, grounds = 0;
        for (uint32_t i = 0; i < WIDTH * HEIGHT; i++) {
            const nebel_ray ray = planet_ray(&camera, worlds_views[v].pitch, i % WIDTH, i / WIDTH, WIDTH, HEIGHT);
            double light[3], off = 0;
            const double way = look(&s, &ray, light), depth = (double)picture.planes.depth[i];
            if (way < HUGE_VAL) assert_true(fabs(depth - way) <= 1e-5 * way + 1e-3);
            if (!(way < HUGE_VAL)) assert_true(!(depth < HUGE_VAL));
            for (int c = 0; c < 3; c++) {
                off = fmax(off, fabs((double)picture.planes.color[3 * i + (uint32_t)c] - light[c]));
                brightest = fmax(brightest, light[c]);
                least = fmin(least, light[c]);
            }
            grounds += way < HUGE_VAL;
            worst = fmax(worst, off);
            untold += off > (double)picture.planes.error[i] * 2 + 2e-3 * brightest; /* of the suns, too */
        }
        print_message("%s: %.1e of the brightest, %d of %d told too little\n", worlds_views[v].text, worst / brightest,
                      untold, WIDTH * HEIGHT);
        assert_true(brightest > .05 && worst <= .02 * brightest && untold <= WIDTH * HEIGHT / 200);
        assert_true(grounds > 40 && grounds < WIDTH * HEIGHT);
        test_picture_free(&picture);
        worlds_free(&s);
    }
}

/* Worlds in another order, and threads, make the same picture. */
static void order_does_not_matter(void **state)
{
    (void)state;
    const worlds_body other[] = {worlds_near[0], worlds_near[2], worlds_near[1]};
    const double sun[3] = {.8, .6, .2};
    const nebel_camera camera = planet_camera(2, .35);
    test_picture pictures[2];
    for (int i = 0; i < 2; i++) {
        worlds s;
        worlds_make(3, i ? other : worlds_near, sun, .53, &s);
        pictures[i] = render(&s, &camera, 1 + i, 4);
        worlds_free(&s);
    }
    assert_memory_equal(pictures[0].planes.color, pictures[1].planes.color, WIDTH * HEIGHT * 3 * sizeof(float));
    for (int i = 0; i < 2; i++) test_picture_free(&pictures[i]);
}

/* A moon of four fifths of a pixel at a corner of four, where no middle of a pixel meets it: Lambert's ball, which has of the
 * light of a disc that faces the sun 2 / 3 (sin a + (pi - a) cos a) / pi. At a = 0 it would be in the other one's shadow. */
static void moons_of_less_than_a_pixel_are_seen(void **state)
{
    (void)state;
    const double pixel = 2 * tan(30 * test_pi / 180) / HEIGHT, pitch = .8, far = 1e8, a = .3;
    const double sun[3] = {sin(a), -sin(pitch) * cos(a), cos(pitch) * cos(a)};
    const worlds_body bodies[] = {
        {.name = "moon"},
        {.name = "moon", .center = {0, 2 + far * sin(pitch), -far * cos(pitch)}, .radius = .4 * pixel * far}};
    worlds s;
    worlds_make(2, bodies, sun, .53, &s);
    const nebel_camera camera = planet_camera(2, pitch);
    test_picture picture = render(&s, &camera, 1, 64);
    double sum = 0;
    for (uint32_t i = 0; i < WIDTH * HEIGHT; i++) sum += (double)picture.planes.color[3 * i];
    const double phase = 2. / 3 * (sin(a) + (test_pi - a) * cos(a)) / test_pi;
    const double expected = .11 / test_pi * 5 * phase * test_pi * .4 * .4;
    print_message("%.4g of %.4g\n", sum, expected);
    assert_near(sum / expected, 1, .05); /* by about 32 samples of 256 */
    test_picture_free(&picture);
    worlds_free(&s);
}

/* The disc that is left: by area, at all sizes and distances. */
static void eclipses_are_areas_of_discs(void **state)
{
    (void)state;
    for (int i = 0; i < 400; i++) {
        if (!nb_test_tries((size_t)(i + i / 10) % 400, 400)) continue;
        const double sun = .004 * (1 + i % 5), ball = .002 * (1 + i / 5 % 8), apart = (sun + ball) * (i / 40) / 9;
        enum { ACROSS = 400 };
        int all = 0, seen = 0;
        for (int k = 0; k < ACROSS * ACROSS; k++) {
            const double x = sun * (2 * (k % ACROSS + .5) / ACROSS - 1), y = sun * (2 * (k / ACROSS + .5) / ACROSS - 1);
            if (!(hypot(x, y) < sun)) continue;
            all++;
            seen += hypot(x - apart, y) > ball;
        }
        /* Cells that the edges cut are at most 4 ACROSS of some .785 ACROSS^2. */
        assert_near(nb_eclipse_discs(sun, ball, apart), (double)seen / all, 4. / ACROSS);
    }
    assert_true(nb_eclipse_discs(0, .01, .02) == 1 && nb_eclipse_discs(0, .01, .005) == 0);
    const double inside[3] = {0, 0, 0}, to_sun[3] = {0, 1, 0};
    assert_true(nb_eclipse_left(inside, inside, 1, to_sun, .01) == 0);
}

static const float quad[4][3] = {{-40, 0, -40}, {-40, 0, 40}, {40, 0, 40}, {40, 0, -40}};
static const uint32_t quad_indices[6] = {0, 1, 2, 0, 2, 3};

/* A white plate over the Earth, in the full sun, in the half shadow of a moon and behind it. */
static void models_are_in_the_shadow_of_moons(void **state)
{
    (void)state;
    static const double aside[] = {0, 1.6e6, 1.9e6, 4e6};
    const double up[3] = {0, 1, 0};
    int half = 0;
    for (int i = 0; i < 4; i++) {
        const worlds_body bodies[] = {{.name = "earth"}, {.name = "moon", .center = {aside[i], 1.2e7, 0}}};
        const nebel_mesh plate = {.origin = {0, 5e5, 0},
                                  .positions = quad[0],
                                  .indices = quad_indices,
                                  .vertex_count = 4,
                                  .triangle_count = 2,
                                  .base_color = {1, 1, 1},
                                  .texture = -1};
        worlds s;
        worlds_make(2, bodies, up, 5, &s);
        s.scene.mesh_count = 1;
        s.scene.meshes = &plate;
        const nebel_camera camera = {
            .position = {0, 500020, 0}, .look_at = {0, 5e5, 0}, .up = {0, 0, 1}, .vertical_fov = 10};
        test_picture picture = render(&s, &camera, 1, 1);
        const double place[3] = {0, 5e5, 0}, left = count_suns(&s, 0, place);
        const double got = (double)test_color(&picture, WIDTH / 2, HEIGHT / 2)[1];
        print_message("a moon %g m aside leaves %.3f of %.3f\n", aside[i], got / 4 * test_pi, left);
        assert_near(got / 4 * test_pi, left, 5e-3);
        half += left > .05 && left < .95;
        test_picture_free(&picture);
        worlds_free(&s);
    }
    assert_true(half > 0);
}

/* Closed clouds seen from a little above them. Air has no shadow, and adds what it has of light without a moon. */
static void clouds_are_in_the_shadow_of_moons(void **state)
{
    (void)state;
    static const double aside[] = {0, 1.6e6, 1.9e6};
    const double up[3] = {0, 1, 0}, place[3] = {0, 700, 0};
    const nebel_camera camera = {.position = {0, 820, 0}, .look_at = {0, 0, 0}, .up = {0, 0, 1}, .vertical_fov = 10};
    double clear[3] = {0};
    int half = 0;
    for (int i = -1; i < 3; i++) {
        const worlds_body bodies[] = {{.name = "earth"}, {.name = "moon", .center = {aside[i < 0 ? 0 : i], 1.2e7, 0}}};
        worlds s;
        worlds_make(i < 0 ? 1 : 2, bodies, up, 5, &s);
        const nebel_clouds_desc desc = {
            .atmosphere = s.atmospheres[0], .layers = {{.type = NEBEL_CLOUD_STRATUS, .coverage = 1}}, .layer_count = 1};
        nebel_clouds *clouds;
        assert_int_equal(nebel_create_clouds(&desc, &clouds), NEBEL_OK);
        s.planets[0].clouds = clouds;
        test_picture picture = render(&s, &camera, 1, 1);
        nebel_irradiance light;
        assert_int_equal(nebel_compute_atmosphere_irradiance(s.atmospheres[0], &s.sun, 1, &place, 0, &light, 0),
                         NEBEL_OK);
        const double left = i < 0 ? 1 : count_suns(&s, 0, place);
        for (int c = 0; c < 3; c++) {
            const double got = (double)test_color(&picture, WIDTH / 2, HEIGHT / 2)[c];
            const double want = (light.sky[c] + left * light.sun[c]) / (light.sky[c] + light.sun[c]);
            if (i < 0) clear[c] = got;
            print_message("%.3f of the sun leave %.4f of the light, expected %.4f\n", left, got / clear[c], want);
            assert_near(got / clear[c], want, 1e-2);
        }
        half += left > .05 && left < .95;
        test_picture_free(&picture);
        nebel_destroy_clouds(clouds);
        worlds_free(&s);
    }
    assert_true(half > 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(worlds_are_seen_one_behind_the_other), cmocka_unit_test(order_does_not_matter),
        cmocka_unit_test(moons_of_less_than_a_pixel_are_seen),  cmocka_unit_test(eclipses_are_areas_of_discs),
        cmocka_unit_test(models_are_in_the_shadow_of_moons),    cmocka_unit_test(clouds_are_in_the_shadow_of_moons),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
