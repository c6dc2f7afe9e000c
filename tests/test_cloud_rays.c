/* Rays from the ground through clouds: transmittance against steps of a metre through the density. */
#include "cloud_help.h"
#include "dice.h"

typedef struct sky_case {
    nebel_cloud_layer layer;
    double low, high;       /* m, of the layer */
    int rays, least;        /* `least` of them see it through some */
    double most, most_mean; /* what they may be off by */
    int most_untold;
} sky_case;

/* Of places within 20 km, which is flat enough for where steps begin and end. */
static nebel_ray draw_ray(uint64_t *numbers)
{
    const double x = dice(numbers, 0, 2e4), z = dice(numbers, 0, 2e4);
    const double turn = dice(numbers, 0, 2 * PI), up = dice(numbers, .15, 1), level = sqrt(1 - up * up);
    return (nebel_ray){{x, 2, z}, {level * cos(turn), up, level * sin(turn)}, HUGE_VAL};
}

static void check_rays(const sky_case *is)
{
    nebel_clouds *clouds = make(1, &is->layer);
    nebel_cloud_workspace *workspace;
    nebel_cloud_lighting *view = view_of(clouds, 0, &workspace);
    uint64_t numbers = 11;
    double worst = 0, sum = 0, beyond = 0;
    int between = 0, untold = 0;
    for (int i = 0; i < is->rays; i++) {
        const nebel_ray ray = draw_ray(&numbers);
        nebel_cloud_transfer nodes;
        assert_int_equal(nebel_trace_clouds(workspace, 1, &ray, 0, 0, NULL, &nodes, 0), NEBEL_OK);
        const double up = ray.direction[1], left = nodes.count > 0 ? (double)nodes.transmittance[nodes.count - 1] : 1;
        const double truth = brute_force(clouds, &ray, .5 * is->low / up, (is->high + 20) / up, 1);
        const double off = fabs(left - truth), more = off - (double)nodes.error;
        worst = fmax(worst, off);
        sum += off / is->rays;
        between += truth > .02 && truth < .98;
        untold += more > 2e-3;
        beyond = fmax(beyond, more);
    }
    print_message("%d rays, %d within clouds: off by %.2g at most, %.2g in the mean; %d untold, by %.2g at most\n",
                  is->rays, between, worst, sum, untold, beyond);
    assert_true(between > is->least && worst < is->most && sum < is->most_mean && untold <= is->most_untold);
    nebel_destroy_cloud_workspace(workspace);
    nebel_destroy_cloud_lighting(view);
    nebel_destroy_clouds(clouds);
}

static void test_transmittance_is_that_of_the_density(void **state)
{
    (void)state;
    static const sky_case cases[] = {{{.extinction = .005, .coverage = .6}, 900, 2700, 60, 12, 2e-2, 2e-3, 2},
                                     {{.type = NEBEL_CLOUD_CUMULUS}, 900, 2700, 500, 20, 8e-2, 2e-3, 20},
                                     {{.type = NEBEL_CLOUD_STRATUS}, 300, 800, 500, 30, 3e-2, 2e-3, 10},
                                     {{.type = NEBEL_CLOUD_CIRRUS}, 8000, 9500, 500, 120, 3e-2, 2e-3, 10}};
    for (size_t k = 0; k < sizeof cases / sizeof *cases; k++) check_rays(&cases[k]);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_transmittance_is_that_of_the_density)};
    return cmocka_run_group_tests(tests, make_air, free_air);
}
