/* Light that comes through broken clouds to the ground: nebel_compute_cloud_sun_transmittance against paths through the same clouds. */
#include "clouds/cloud_lighting.h"

#include "math/vector.h"
#include "cloud_help.h"
#include "dice.h"
#include "near.h"
#include "slab_paths.h"

#include <string.h>

static void scatter(const double turns[SLAB_PARTS + 1], uint64_t *numbers, double direction[3])
{
    const double place = dice(numbers, 0, SLAB_PARTS), around = dice(numbers, 0, 2 * PI);
    const int low = (int)place;
    const double turn = turns[low] + (place - low) * (turns[low + 1] - turns[low]),
                 sine = sqrt(fmax(0, 1 - turn * turn));
    double across[2][3];
    nb_vector_perpendicular(direction, across[0]);
    nb_vector_cross(direction, across[0], across[1]);
    for (int c = 0; c < 3; c++)
        direction[c] = turn * direction[c] + sine * (cos(around) * across[0][c] + sin(around) * across[1][c]);
    nb_vector_make_unit(direction);
}

/* From a place where sunlight enters the layer; 1: it comes out below. */
static int comes_through(const nebel_clouds *clouds, const double entry[3], const double sun[3],
                         const double turns[SLAB_PARTS + 1], uint64_t *numbers)
{
    const nb_cloud_layer *layer = &clouds->layers[0];
    double place[3] = {entry[0], entry[1], entry[2]}, direction[3] = {-sun[0], -sun[1], -sun[2]};
    for (;;) {
        const double way = -log(dice(numbers, 1e-12, 1)) / (double)layer->extinction;
        for (int c = 0; c < 3; c++) place[c] += way * direction[c];
        const double radius = nb_vector_length(place);
        if (!(radius > layer->low && radius < layer->high)) return radius < layer->high;
        if (dice(numbers, 0, (double)layer->extinction) <
            (double)extinction_at(clouds, 0, 0, place[0], place[1] - RADIUS, place[2]))
            scatter(turns, numbers, direction);
    }
}

/* Mean over places on the ground: of what comes through, and of what the model says. */
static void compare(const nebel_cloud_layer *desc, double height)
{
    enum { PATHS = 1500 };
    nebel_clouds *clouds = make(1, desc);
    const nb_cloud_layer *layer = &clouds->layers[0];
    const double sun[3] = {.6 * cos(height * PI / 180), sin(height * PI / 180), .8 * cos(height * PI / 180)};
    const nebel_cloud_lighting_desc of = {.clouds = clouds,
                                          .sun = {.irradiance = {1, 1, 1}, .direction = {sun[0], sun[1], sun[2]}}};
    nebel_cloud_lighting *view;
    nebel_cloud_workspace *workspace;
    double turns[SLAB_PARTS + 1], through = 0, model = 0, square = 0;
    uint64_t numbers = 3;
    assert_int_equal(nebel_create_cloud_lighting(&of, &view), NEBEL_OK);
    assert_int_equal(nebel_create_cloud_workspace(view, &workspace), NEBEL_OK);
    slab_invert(&layer->phase, turns);
    for (int i = 0; i < PATHS; i++) {
        const double ground[1][3] = {{dice(&numbers, -2e4, 2e4), 0, dice(&numbers, -2e4, 2e4)}};
        const double from[3] = {ground[0][0], RADIUS, ground[0][2]}, along = nb_vector_dot(from, sun);
        const double way = sqrt(along * along + layer->high * layer->high - nb_vector_dot(from, from)) - along;
        double entry[3];
        float part;
        for (int c = 0; c < 3; c++) entry[c] = from[c] + (1 - 1e-9) * way * sun[c];
        assert_int_equal(nebel_compute_cloud_sun_transmittance(workspace, 10, 1, ground, 0, &part), NEBEL_OK);
        const int is = comes_through(clouds, entry, sun, turns, &numbers);
        through += is / (double)PATHS;
        model += (double)part / PATHS;
        square += pow(is - (double)part, 2) / PATHS;
    }
    const double deviation = sqrt(square / PATHS);
    print_message("%8g  %9g  %4g  %.4f +- %.4f  %.4f\n", desc->coverage, desc->extinction, height, through, deviation,
                  model);
    assert_near(model, through, .02 + 2 * deviation);
    nebel_destroy_cloud_workspace(workspace);
    nebel_destroy_cloud_lighting(view);
    nebel_destroy_clouds(clouds);
}

static void test_shade_of_cumulus(void **state)
{
    (void)state;
    static const double heights[] = {60, 30, 10};
    print_message("coverage  extinction  sun  through by paths  nebel\n");
    for (int i = 0; i < 3; i++) {
        compare(&(nebel_cloud_layer){.coverage = .4, .extinction = .1, .seed = 5}, heights[i]);
        compare(&(nebel_cloud_layer){.coverage = .6, .extinction = .05, .seed = 6}, heights[i]);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_shade_of_cumulus)};
    return cmocka_run_group_tests(tests, make_air, free_air);
}
