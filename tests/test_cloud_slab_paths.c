/* Random even layers of clouds against paths of light through slabs of the same drops and depth: what comes through, and what is
 * seen of them nearly straight down and straight up. */
#include "dice.h"
#include "even_layer.h"
#include "near.h"
#include "slab_paths.h"

/* Cosines of what counts as nearly straight. */
#define NARROW .93

/* Mean over directions within that, by how much of a level square each is across. */
static double mean_radiance(const even *e, int is_down)
{
    enum { RINGS = 5, TURNS = 6 };
    double sum = 0, weights = 0;
    for (int i = 0; i < RINGS * TURNS; i++) {
        const double out = NARROW + (1 - NARROW) * (i % RINGS + .5) / RINGS, turn = PI * (i / RINGS + .5) / TURNS;
        sum += out * radiance(e, is_down ? out : -out, cos(turn));
        weights += out;
    }
    return sum / weights;
}

static void test_random_layers(void **state)
{
    (void)state;
    const size_t count = nb_test_count(24), paths = 200000;
    uint64_t numbers = 77;
    double off = 0;
    print_message(" depth  cosine  through by paths  nebel   down by paths  nebel     up by paths  nebel\n");
    for (size_t i = 0; i < count; i++) {
        const double depth = exp(dice(&numbers, log(.5), log(32))), cosine = dice(&numbers, .15, .9);
        double turns[SLAB_PARTS + 1];
        size_t through = 0, seen[2] = {0, 0};
        even e;
        even_make(depth / column(1), cosine, &e);
        slab_invert(&e.clouds->layers[0].phase, turns);
        for (size_t k = 0; k < paths; k++) {
            double out;
            const int is_through = slab_path(depth, cosine, turns, &numbers, &out) > 0;
            through += (size_t)is_through;
            seen[!is_through] += fabs(out) > NARROW;
        }
        /* Of radiance 1 the part pi (1 - cosine^2) goes so nearly straight. */
        const double all = (double)paths / cosine * PI * (1 - NARROW * NARROW);
        const double share = share_of_sun(&e), up = mean_radiance(&e, 0), down = mean_radiance(&e, 1);
        print_message("%6.3g  %6.3f  %16.4f  %.4f  %14.4f  %.4f  %14.4f  %.4f\n", depth, cosine,
                      (double)through / (double)paths, share, (double)seen[1] / all, down, (double)seen[0] / all, up);
        assert_near(share, (double)through / (double)paths, .02);
        for (int k = 0; k < 2; k++) {
            const double truth = (double)seen[k] / all, deviation = sqrt((double)seen[k]) / all;
            assert_near(k == 0 ? up : down, truth, .06 * truth + 3 * deviation);
            off += fabs((k == 0 ? up : down) / truth - 1) / (2 * (double)count);
        }
        even_free(&e);
    }
    print_message("radiance off by %.3f of it in the mean\n", off);
    assert_true(off < .04);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_random_layers),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
