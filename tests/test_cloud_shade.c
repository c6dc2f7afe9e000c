/* The shade of clouds: on the ground, of the sky, on air and on fog. */
#include "clouds/cloud_lighting.h"

#include "cloud_help.h"
#include "near.h"
#include "unit.h"

#include <math.h>
#include <string.h>

static void test_shadows(void **state)
{
    (void)state;
    nebel_clouds *clouds = make(1, (const nebel_cloud_layer[]){{.coverage = .5}});
    nebel_cloud_workspace *workspace;
    nebel_cloud_lighting *view = view_of(clouds, 0, &workspace);
    const double high[1][3] = {{0, 5000, 0}};
    double least = 1, sum = 0;
    float part;
    assert_int_equal(nebel_compute_cloud_sun_transmittance(workspace, 1, 1, high, 0, &part), NEBEL_OK);
    assert_true(part == 1);
    for (int i = 0; i < 400; i++) {
        const double place[1][3] = {{400. * (i % 20), 0, 400. * (i / 20.)}};
        assert_int_equal(nebel_compute_cloud_sun_transmittance(workspace, 1, 1, place, 0, &part), NEBEL_OK);
        assert_true(part >= 0 && part <= 1);
        least = fmin(least, (double)part);
        sum += (double)part / 400;
    }
    /* Light that leaves clouds aside is in their shadows, too. */
    assert_true(least < .3 && sum > .3 && sum < .95);
    nebel_destroy_cloud_workspace(workspace);
    nebel_destroy_cloud_lighting(view);
    nebel_destroy_clouds(clouds);
}

/* The sky's light: all of it above clouds and where there are none, and no steps along the ground, up through clouds and from layer
 * to layer. Against the mean of columns that are asked one by one. */
static void test_sky_in_the_shade(void **state)
{
    (void)state;
    enum { PLACES = 3000, HEIGHTS = 1100 };
    static const float none = 0;
    nebel_clouds *clouds = make(2, (const nebel_cloud_layer[]){{.coverage = .8}, {.type = NEBEL_CLOUD_CIRRUS}});
    nebel_clouds *clear = make(1, (const nebel_cloud_layer[]){{.weather_map = {1, 1, 1, &none}}});
    nebel_cloud_workspace *workspace, *over_none;
    nebel_cloud_lighting *view = view_of(clouds, 0, &workspace), *clear_view = view_of(clear, 0, &over_none);
    double last = 0, along = 0, upward = 0, least = 1, most = 0;
    float part;
    for (int i = 0; i < PLACES; i++, last = (double)part) {
        const double place[1][3] = {{10. * i, 0, 5. * i}};
        assert_int_equal(nebel_compute_cloud_sky_transmittance(over_none, 1, 1, place, 0, &part), NEBEL_OK);
        assert_true(part == 1);
        assert_int_equal(nebel_compute_cloud_sky_transmittance(workspace, 1, 1, place, 0, &part), NEBEL_OK);
        if (i > 0) along = fmax(along, fabs((double)part - last));
        least = fmin(least, (double)part);
        most = fmax(most, (double)part);
    }
    for (int i = 0; i < HEIGHTS; i++, last = (double)part) {
        const double place[1][3] = {{300, 10. * i, 0}};
        assert_int_equal(nebel_compute_cloud_sky_transmittance(workspace, 1, 1, place, 0, &part), NEBEL_OK);
        if (i > 0) upward = fmax(upward, fabs((double)part - last));
    }
    print_message("the ground has %.3f to %.3f of the sky; steps of 11 m: %.4f at most, upward: %.4f\n", least, most,
                  along, upward);
    assert_true(part == 1 && least < .6 && most > least + .1 && most <= 1);
    assert_true(along < .01 && upward < .02);
    assert_int_equal(nebel_compute_cloud_sky_transmittance(NULL, 1, 0, NULL, 0, NULL), NEBEL_ERROR_ARGUMENT);
    assert_int_equal(nebel_compute_cloud_sky_transmittance(workspace, 1, 1, NULL, 0, &part), NEBEL_ERROR_ARGUMENT);
    assert_int_equal(nebel_compute_cloud_sky_transmittance(workspace, -1, 0, NULL, 0, NULL), NEBEL_ERROR_ARGUMENT);
    assert_int_equal(
        nebel_compute_cloud_sky_transmittance(workspace, 1, 1, (const double[1][3]){{(double)NAN, 0, 0}}, 0, &part),
        NEBEL_ERROR_ARGUMENT);
    nebel_destroy_cloud_workspace(workspace);
    nebel_destroy_cloud_workspace(over_none);
    nebel_destroy_cloud_lighting(view);
    nebel_destroy_cloud_lighting(clear_view);
    nebel_destroy_clouds(clouds);
    nebel_destroy_clouds(clear);
}

/* Means along a ray over pieces in order; no step from ray to ray shows. Air above all clouds has all of its light. */
static void test_air_in_the_shade(void **state)
{
    (void)state;
    nebel_clouds *clouds = make(2, (const nebel_cloud_layer[]){{.coverage = .8}, {.type = NEBEL_CLOUD_CIRRUS}});
    nebel_cloud_workspace *workspace;
    nebel_cloud_lighting *view = view_of(clouds, 0, &workspace);
    nebel_air_shadow shade;
    const nebel_ray over = {{0, 1e4, 0}, {1, .1, 0}, HUGE_VAL};
    double last = 0, step = 0, least = 1;
    assert_int_equal(nebel_trace_cloud_shadow_on_air(workspace, 1, &over, 0, &shade, 0), NEBEL_OK);
    assert_int_equal(shade.count, 0);
    for (int i = 0; i < 4000; i++) {
        const double angle = .002 + 1e-4 * i;
        const nebel_ray ray = {{0, 2, 0}, {cos(angle), sin(angle), 0}, HUGE_VAL};
        double sum = 0, all = 0;
        assert_int_equal(nebel_trace_cloud_shadow_on_air(workspace, 1, &ray, 0, &shade, 0), NEBEL_OK);
        for (uint32_t k = 0; k < shade.count; k++) {
            /* Air's light as it is near the ground. */
            const double seen = exp(-(double)shade.t[k] / 2e4) - exp(-(double)shade.t[k + 1] / 2e4);
            assert_true(shade.t[k] <= shade.t[k + 1] && shade.transmittance[k][1] >= 0 &&
                        shade.transmittance[k][1] <= 1);
            sum += (double)shade.transmittance[k][1] * seen;
            all += seen;
        }
        const double part = all > 0 ? sum / all : 1;
        if (i > 0) step = fmax(step, fabs(part - last));
        least = fmin(least, part);
        last = part;
    }
    print_message("air has %.3f of its light or more; %.4f more or less in a ray's neighbour at most\n", least, step);
    assert_true(least < .8 && step < .01);
    assert_int_equal(nebel_trace_cloud_shadow_on_air(NULL, 1, &over, 0, &shade, 0), NEBEL_ERROR_ARGUMENT);
    assert_int_equal(nebel_trace_cloud_shadow_on_air(workspace, 1, NULL, 0, &shade, 0), NEBEL_ERROR_ARGUMENT);
    assert_int_equal(nebel_trace_cloud_shadow_on_air(workspace, 1, &over, 0, NULL, 0), NEBEL_ERROR_ARGUMENT);
    const nebel_ray none = {{0, 1e4, 0}, {0, 0, 0}, HUGE_VAL};
    assert_int_equal(nebel_trace_cloud_shadow_on_air(workspace, 1, &none, 0, &shade, 0), NEBEL_ERROR_ARGUMENT);
    nebel_destroy_cloud_workspace(workspace);
    nebel_destroy_cloud_lighting(view);
    nebel_destroy_clouds(clouds);
}

/* Fog along a ray: from where it begins, in pieces that meet, each with what places within it have, and no step from ray to ray. */
static void test_fog_in_the_shade(void **state)
{
    (void)state;
    nebel_clouds *clouds = make(2, (const nebel_cloud_layer[]){{.coverage = .6}, {.type = NEBEL_CLOUD_CIRRUS}});
    nebel_cloud_workspace *workspace;
    nebel_cloud_lighting *view = view_of(clouds, 0, &workspace);
    nebel_fog_shadow shade;
    const nebel_ray over = {{0, 1.2e4, 0}, {1, .1, 0}, HUGE_VAL}, none = {{0, 1e4, 0}, {0, 0, 0}, HUGE_VAL};
    double last = 0, step = 0, least = 1;
    assert_int_equal(nebel_trace_cloud_shadow_on_fog(workspace, &over, 0, 0, &shade), NEBEL_OK);
    assert_int_equal(shade.count, 0);
    for (int i = 0; i < 4000; i++) {
        const double angle = -.4 + 1e-4 * i, begin = 300;
        const nebel_ray ray = {{0, 900, 0}, {cos(angle), sin(angle), 0}, 3e4};
        double sum = 0, all = 0;
        assert_int_equal(nebel_trace_cloud_shadow_on_fog(workspace, &ray, begin, 1e-3, &shade), NEBEL_OK);
        assert_true(shade.count > 2 && fabs((double)shade.t[0] - begin) < 1e-3);
        assert_true((double)shade.t[shade.count] <= 3e4 * (1 + 1e-6));
        for (uint32_t k = 0; k < shade.count; k++) {
            const double seen = exp(-(double)shade.t[k] / 3000) - exp(-(double)shade.t[k + 1] / 3000);
            assert_true(shade.t[k] < shade.t[k + 1] && shade.sun_transmittance[k] >= 0 &&
                        shade.sun_transmittance[k] <= 1);
            assert_true(shade.sky_transmittance[k] >= 0 && shade.sky_transmittance[k] <= 1 && shade.error[k] >= 0 &&
                        shade.error[k] <= 1);
            sum += (double)shade.sun_transmittance[k] * seen;
            all += seen;
            least = fmin(least, (double)shade.sun_transmittance[k]);
        }
        if (i > 0) step = fmax(step, fabs(sum / all - last));
        last = sum / all;
    }
    print_message("fog has %.3f of the sun or more; %.4f more or less in a ray's neighbour at most\n", least, step);
    assert_true(least < .5 && step < .01);
    /* There are not pieces enough to be as short as usual: the last one goes to the end. */
    const nebel_ray level = {{0, 900, 0}, {1, 0, 0}, 2e5};
    assert_int_equal(nebel_trace_cloud_shadow_on_fog(workspace, &level, 0, 1e-3, &shade), NEBEL_OK);
    assert_int_equal(shade.count, NEBEL_MAX_FOG_SHADOW_SEGMENTS);
    assert_float_equal(shade.t[shade.count], 2e5, .1);
    assert_int_equal(nebel_trace_cloud_shadow_on_fog(NULL, &over, 0, 0, &shade), NEBEL_ERROR_ARGUMENT);
    assert_int_equal(nebel_trace_cloud_shadow_on_fog(workspace, NULL, 0, 0, &shade), NEBEL_ERROR_ARGUMENT);
    assert_int_equal(nebel_trace_cloud_shadow_on_fog(workspace, &over, 0, 0, NULL), NEBEL_ERROR_ARGUMENT);
    assert_int_equal(nebel_trace_cloud_shadow_on_fog(workspace, &over, -1, 0, &shade), NEBEL_ERROR_ARGUMENT);
    assert_int_equal(nebel_trace_cloud_shadow_on_fog(workspace, &over, 0, (double)NAN, &shade), NEBEL_ERROR_ARGUMENT);
    assert_int_equal(nebel_trace_cloud_shadow_on_fog(workspace, &none, 0, 0, &shade), NEBEL_ERROR_ARGUMENT);
    nebel_destroy_cloud_workspace(workspace);
    nebel_destroy_cloud_lighting(view);
    nebel_destroy_clouds(clouds);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_shadows),
        cmocka_unit_test(test_sky_in_the_shade),
        cmocka_unit_test(test_air_in_the_shade),
        cmocka_unit_test(test_fog_in_the_shade),
    };
    return cmocka_run_group_tests(tests, make_air, free_air);
}
