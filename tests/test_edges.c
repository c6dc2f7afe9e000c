/* Soft edges of every shape: what they are by hand, and that the place and the ray know the same. */
#include "random_fog.h"

#include "medium/density.h"
#include "medium/volume.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#include "fog_help.h"

#define SOFT(depth) .density = {.type = NEBEL_DENSITY_SOFT_EDGE, .edge_width = (depth)}, .extinction = {.2, .2, .2}

static double depth_along(const nebel_volume_desc *volume, const nebel_ray *ray)
{
    nebel_snapshot *const fog = fog_commit(&(nebel_fog_desc){0}, volume, 1);
    nebel_transfer transfer;
    assert_int_equal(nebel_trace(fog, &(nebel_trace_desc){0}, 1, ray, sizeof *ray, &transfer, sizeof transfer),
                     NEBEL_OK);
    nebel_release_snapshot(fog);
    return -log(transfer.transmittance[0]) / .2;
}

static void assert_near(double a, double b)
{
    if (!(fabs(a - b) < 1e-12)) print_message("%.17g is not %.17g\n", a, b);
    assert_true(fabs(a - b) < 1e-12);
}

/* 1 - x^2 in terms of the radius, times g until it is 1: from x = 1 to x = 1 - f it integrates to g (f^2 - f^3 / 3). */
static double flank(double radius, double edge)
{
    const double f = fmin(edge / radius, 1), g = 1 / (1 - (1 - f) * (1 - f));
    return radius * g * (f * f - f * f * f / 3);
}

static void test_rays_through_the_middle_of_round_bodies(void **unused)
{
    (void)unused;
    const double edges[] = {.25, 1, 2.9, 3, 7};
    const nebel_ray across = {{-9, 0, 0}, {1, 0, 0}, 20};
    for (int i = 0; i < 5; i++) {
        const double plateau = 2 * fmax(3 - edges[i], 0), all = plateau + 2 * flank(3, edges[i]);
        const nebel_volume_desc bodies[] = {
            {.shape = {.type = NEBEL_SHAPE_SPHERE, .radius = 3}, SOFT(edges[i])},
            {.shape = {.type = NEBEL_SHAPE_ELLIPSOID, .radii = {3, 4, 5}}, SOFT(edges[i])},
            {.shape = {.type = NEBEL_SHAPE_CAPSULE, .from = {0, -2, 0}, .to = {0, 5, 0}, .radius = 3}, SOFT(edges[i])},
            {.shape = {.type = NEBEL_SHAPE_CAPSULE, .radius = 3}, SOFT(edges[i])},
            {.shape = {.type = NEBEL_SHAPE_CYLINDER, .from = {0, -50, 0}, .to = {0, 50, 0}, .radius = 3},
             SOFT(edges[i])}};
        for (int k = 0; k < 5; k++) assert_near(depth_along(&bodies[k], &across), all);
    }
}

static void test_rays_along_the_axis(void **unused)
{
    (void)unused;
    const nebel_ray along = {{0, -20, 0}, {0, 1, 0}, 60};
    nebel_volume_desc body = {.shape = {.type = NEBEL_SHAPE_CYLINDER, .to = {0, 10, 0}, .radius = 1}, SOFT(1.5)};
    assert_near(depth_along(&body, &along), 10 - 1.5);
    body.density.edge_width = 8; /* where the ends are nearer than that, 5 / 8 in the middle */
    assert_near(depth_along(&body, &along), 10 * 5. / 8 / 2);
    body = (nebel_volume_desc){.shape = {.type = NEBEL_SHAPE_CAPSULE, .to = {0, 10, 0}, .radius = 2}, SOFT(1)};
    assert_near(depth_along(&body, &along), 10 + 2 * 1 + 2 * flank(2, 1));
    /* w = z / 4 up to 10; g = 1 / .75, so that the middle is full from z with z^2 / 16 = .75 * 6.25 on */
    body = (nebel_volume_desc){.shape = {.type = NEBEL_SHAPE_CONE, .to = {0, 10, 0}, .radius_to = 2.5}, SOFT(1.25)};
    const double full = 10 * sqrt(.75);
    double expected = 10 - 1.25 / 2 - full;
    const double ends_at = 1.25; /* before that the near end's edge counts, too */
    expected += (full * full * full - ends_at * ends_at * ends_at) / 3 / 75;
    expected += ends_at * ends_at * ends_at / 4 / 75;
    assert_near(depth_along(&body, &along), expected);
}

static void test_rays_into_planes(void **unused)
{
    (void)unused;
    const nebel_volume_desc half = {.shape = {.type = NEBEL_SHAPE_HALF_SPACE, .point = {2, 0, 0}, .normal = {-7, 0, 0}},
                                    SOFT(4)};
    assert_near(depth_along(&half, &(nebel_ray){{0, 0, 0}, {1, 0, 0}, 20}), 18 - 2);
    assert_near(depth_along(&half, &(nebel_ray){{0, 0, 0}, {1, 0, 0}, 3}), 1 / 8.);
    assert_near(depth_along(&half, &(nebel_ray){{3, 0, 0}, {0, 1, 0}, 8}), 8 / 4.);
    const nebel_plane planes[] = {{{2, 0, 0}, 6}, {{-1, 0, 0}, 3}, {{0, 1, 0}, 3}, {{0, -1, 0}, 3}};
    nebel_volume_desc tunnel = {.shape = {.type = NEBEL_SHAPE_CONVEX, .planes = planes, .plane_count = 4}, SOFT(1)};
    assert_near(depth_along(&tunnel, &(nebel_ray){{-9, 0, 0}, {1, 0, 0}, 20}), 6 - 1);
    assert_near(depth_along(&tunnel, &(nebel_ray){{-9, 2.5, 1}, {1, 0, 0}, 20}), .5 * (6 - 1) + .5 * .5);
    tunnel.density.edge_width = 6; /* a pyramid of half the height */
    assert_near(depth_along(&tunnel, &(nebel_ray){{-9, 0, 0}, {1, 0, 0}, 20}), 3 * .5);
}

/* Where it meets the surface or leaves the edge, some 1e15 m away, is beyond all digits; the fog is opaque long before.
 */
static void test_rays_level_with_a_plane_know_their_light(void **unused)
{
    (void)unused;
    const double normal[3] = {.4434947242990554, .87784080695980793, -.18085338579926599};
    nebel_volume_desc half = {.shape = {.type = NEBEL_SHAPE_HALF_SPACE}, SOFT(.8), .source = {1.5, 1, .5}};
    memcpy(half.shape.normal, normal, sizeof normal);
    nebel_snapshot *const fog = fog_commit(&(nebel_fog_desc){0}, &half, 1);
    for (int i = 0; i < 200; i++) {
        const double along[3] = {sin(i), cos(i), sin(3 * i)}, depth = .8 * (i + .5) / 200;
        nebel_ray ray = {.t_max = HUGE_VAL};
        nebel_transfer transfer;
        for (int k = 0; k < 3; k++) {
            const int a = (k + 1) % 3, b = (k + 2) % 3;
            ray.origin[k] = -depth * normal[k];
            ray.direction[k] = along[a] * normal[b] - along[b] * normal[a] + (i % 2 ? 1e-15 : -1e-15) * normal[k];
        }
        assert_int_equal(nebel_trace(fog, &(nebel_trace_desc){0}, 1, &ray, sizeof ray, &transfer, sizeof transfer),
                         NEBEL_OK);
        if (transfer.error > 1e-8) print_message("ray %d: error %g\n", i, transfer.error);
        assert_true(transfer.error < 1e-8);
        for (int c = 0; c < 3; c++) assert_true(fabs(transfer.in_scattering[c] - half.source[c]) <= transfer.error);
    }
    nebel_release_snapshot(fog);
}

/* Against a plain sum of what nb_density_at says of many places. */
static void test_the_ray_gathers_what_its_places_have(void **unused)
{
    (void)unused;
    static random_fog fog;
    enum { PLACES = 10000 };
    const nebel_allocator allocator = nb_resolve_allocator(&(nebel_allocator){0});
    int met = 0;
    for (uint64_t seed = 0; seed < 400; seed++) {
        random_fog_make(&fog, RANDOM_FOG_SINGLE, 100 + seed);
        nebel_volume_desc *const v = &fog.volumes[0];
        if (v->shape.type == NEBEL_SHAPE_WORLD) continue;
        v->density = (nebel_density){.type = NEBEL_DENSITY_SOFT_EDGE, .edge_width = .2 + .02 * (double)seed};
        for (int c = 0; c < 3; c++) v->extinction[c] = .2;
        nebel_ray ray = random_fog_ray(&fog, seed);
        ray.t_max = fmin(ray.t_max, 60);
        const double *const d = ray.direction, length = sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
        nb_volume volume;
        assert_int_equal(nb_volume_resolve(&allocator, &(nebel_log){0}, v, &volume), NEBEL_OK);
        double sum = 0;
        for (int i = 0; i < PLACES; i++) {
            const double t = ray.t_max * (i + .5) / PLACES / length;
            const double place[3] = {ray.origin[0] + t * ray.direction[0], ray.origin[1] + t * ray.direction[1],
                                     ray.origin[2] + t * ray.direction[2]};
            sum += nb_density_at(&volume, place) * ray.t_max / PLACES;
        }
        met += sum > 0;
        assert_true(fabs(depth_along(v, &ray) - sum) < 1e-4 * (1 + sum));
        nb_volume_free(&allocator, &volume);
    }
    assert_true(met > 100);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_rays_through_the_middle_of_round_bodies),
        cmocka_unit_test(test_rays_along_the_axis),
        cmocka_unit_test(test_rays_into_planes),
        cmocka_unit_test(test_rays_level_with_a_plane_know_their_light),
        cmocka_unit_test(test_the_ray_gathers_what_its_places_have),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
