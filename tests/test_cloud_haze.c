/* Clouds and air along a ray: what is told of the means between nodes. */
#include "aerial/cloud_compose.h"

#include "dice.h"
#include "unit.h"

enum { STEPS = 240, EVERY = 16, KNOTS = STEPS / EVERY + 1 };

/* Two media along a ray, in short steps: what each leaves, and its light as if it were alone. */
typedef struct along {
    double left[2][STEPS + 1], light[2][STEPS + 1];
} along;

/* Most steps are empty, so that media lie anywhere between nodes. */
static along throw_media(uint64_t *numbers)
{
    along media;
    for (int m = 0; m < 2; m++) {
        media.left[m][0] = 1;
        media.light[m][0] = 0;
        for (int i = 1; i <= STEPS; i++) {
            const double depth = dice(numbers, 0, 1) < .05 ? dice(numbers, 0, .8) : 0;
            media.left[m][i] = media.left[m][i - 1] * exp(-depth);
            media.light[m][i] = media.light[m][i - 1] + dice(numbers, 0, 2) * (media.left[m][i - 1] - media.left[m][i]);
        }
    }
    return media;
}

/* In steps so short that it does not matter which of the two is before the other. */
static double light_of(const along *media)
{
    double sum = 0;
    for (int i = 1; i <= STEPS; i++)
        for (int m = 0; m < 2; m++)
            sum += .5 * (media->left[1 - m][i - 1] + media->left[1 - m][i]) *
                   (media->light[m][i] - media->light[m][i - 1]);
    return sum;
}

/* Clouds are 0, air is 1. */
static void sample(const along *media, nebel_cloud_transfer *nodes, nb_aerial_nodes *haze)
{
    nodes->count = KNOTS;
    for (int k = 0; k < KNOTS; k++) {
        nodes->t[k] = (float)k;
        nodes->transmittance[k] = (float)media->left[0][k * EVERY];
        for (int c = 0; c < 3; c++) {
            nodes->in_scattering[k][c] = (float)media->light[0][k * EVERY];
            haze->left[c][k] = (float)media->left[1][k * EVERY];
            haze->light[c][k] = (float)media->light[1][k * EVERY];
        }
    }
}

static void test_what_means_miss_is_told(void **state)
{
    (void)state;
    enum { TIMES = 2000 };
    uint64_t numbers = 5;
    double most = 0;
    for (int i = 0; i < TIMES; i++) {
        const along media = throw_media(&numbers);
        nebel_cloud_transfer nodes;
        nb_aerial_nodes haze;
        float over[NEBEL_MAX_CLOUD_NODES];
        sample(&media, &nodes, &haze);
        nb_cloud_compose_sum(&nodes, 0, &haze, over);
        const double told = (double)nb_cloud_compose_missed(&nodes, &haze);
        const double sum = (double)over[KNOTS - 1] + media.left[0][STEPS] * media.light[1][STEPS];
        const double off = fabs(sum - light_of(&media));
        assert_true(off <= told + 1e-5);
        most = fmax(most, off / fmax(told, 1e-3));
    }
    print_message("means between nodes are off by %.2g of what is told at most\n", most);
    assert_true(most > .5);
}

/* All air where the cloud begins, or where it ends. */
static void test_the_bound_is_met(void **state)
{
    (void)state;
    nebel_cloud_transfer nodes = {.count = 2, .t = {1, 2}, .transmittance = {1, .25f}};
    nb_aerial_nodes haze;
    float over[NEBEL_MAX_CLOUD_NODES];
    for (int c = 0; c < 3; c++)
        for (int k = 0; k < 2; k++) {
            haze.left[c][k] = 1;
            haze.light[c][k] = .5f * (float)k;
        }
    nb_cloud_compose_sum(&nodes, 0, &haze, over);
    const float sum = over[1] + .25f * .5f, told = nb_cloud_compose_missed(&nodes, &haze);
    assert_float_equal(sum + told, .5f, 1e-6);
    assert_float_equal(sum - told, .25f * .5f, 1e-6);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_what_means_miss_is_told),
        cmocka_unit_test(test_the_bound_is_met),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
