/* Even layers of clouds against plane-parallel slabs of the same drops and depth: what comes through, what is seen of them from
 * above, below and aslant, and that all light goes up or down. Numbers are of discrete ordinates (64 streams, delta-M, exact single
 * scattering) in NumPy, apart from this code, within a standard error of paths of light. */
#include "even_layer.h"
#include "near.h"

static void test_share_of_sun(void **state)
{
    (void)state;
    static const struct {
        double depth, cosine, share;
    } rows[] = {{2, .342, .6360}, {1, .2, .6123}, {.5, .1, .5670}, {16, .1, .1801}, {1, 1, .9631},   {4, 1, .8379},
                {16, 1, .4900},   {64, 1, .1773}, {4, .5, .6157},  {16, .5, .3318}, {64, .5, .1199}, {16, .2, .2227}};
    print_message("share of sun through even layers\n depth  cosine    truth    nebel\n");
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        even e;
        even_make(rows[i].depth / column(rows[i].cosine), rows[i].cosine, &e);
        const double share = share_of_sun(&e);
        print_message("%6g  %6g  %7.4f  %7.4f\n", rows[i].depth, rows[i].cosine, rows[i].share, share);
        assert_near(share, rows[i].share, .01);
        even_free(&e);
    }
}

enum { VIEWS = 6 };

static const struct {
    double down, around;
} views[VIEWS] = {{1, 1}, {-1, 1}, {.5, 0}, {-.5, 0}, {.5, 1}, {.5, -1}};

static void test_radiance_of_even_layers(void **state)
{
    (void)state;
    static const struct {
        double depth, degrees, share, radiance[VIEWS];
    } rows[] = {
        {.5, 60, .9765, {.00488, .07939, .00525, .01552, .00562, .01023}},
        {.5, 20, .8574, {.00197, .00472, .00509, .00704, .05612, .01237}},
        {2, 60, .8968, {.02009, .20783, .02872, .06802, .03864, .03908}},
        {2, 20, .6360, {.00951, .02127, .02595, .03383, .13652, .03617}},
        {8, 60, .6353, {.08881, .22444, .10187, .13687, .11990, .11102}},
        {8, 20, .3944, {.03161, .04640, .05340, .03770, .17318, .06203}},
        {32, 60, .2828, {.21030, .09959, .18666, .06738, .20485, .19568}},
        {32, 20, .1741, {.06156, .02421, .07433, .01638, .19416, .08293}},
    };
    const double full = column(1);
    double worst = 0;
    print_message(
        "radiance of even layers by that of slabs, seen straight down, straight up, at 60 degrees to straight down "
        "and\n"
        "up aside of the sun, and at 60 degrees to straight down towards the sun and away from it\n depth  sun\n");
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        even e;
        even_make(rows[i].depth / full, sin(rows[i].degrees * PI / 180), &e);
        print_message("%6g  %3g ", rows[i].depth, rows[i].degrees);
        assert_near(share_of_sun(&e), rows[i].share, .015);
        for (int v = 0; v < VIEWS; v++) {
            const double ratio = radiance(&e, views[v].down, views[v].around) / rows[i].radiance[v];
            print_message(" %.3f", ratio);
            worst = fmax(worst, fabs(ratio - 1));
        }
        print_message("\n");
        even_free(&e);
    }
    assert_true(worst < .05);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_share_of_sun),
        cmocka_unit_test(test_radiance_of_even_layers),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
