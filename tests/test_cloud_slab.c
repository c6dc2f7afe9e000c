/* Even layers of clouds against plane-parallel slabs of the same drops and depth: what comes through, what is seen of them from
 * above, below and aslant, and that all light goes up or down. Numbers are of slabs in 64 streams (adding and doubling, delta-M, exact single
 * scattering) in NumPy, apart from this code, with Mie's phase function at 550 nm; paths of light
 * through the thinnest, the only ones tried, agree within 1.5 standard errors. */
#include "even_layer.h"
#include "near.h"

static void test_share_of_sun(void **state)
{
    (void)state;
    static const struct {
        double depth, cosine, share;
    } rows[] = {{2, .342, .6215}, {1, .2, .6029},   {.5, .1, .5609}, {16, .1, .1691},  {1, 1, .9569},
                {4, 1, .8160},    {16, 1, .4588},   {64, 1, .1614},  {4, .5, .5952},   {16, .5, .3103},
                {64, .5, .1091},  {16, .2, .2088},  {1, .05, .4036}, {.25, .1, .6754}, {.1, .05, .6818},
                {.1, .03, .5755}, {.3, .03, .4595}, {1, .03, .3689}, {.05, .03, .6924}};
    print_message("share of sun through even layers\n depth  cosine    truth    nebel\n");
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        even e;
        even_make(rows[i].depth / column(rows[i].cosine), rows[i].cosine, &e);
        const double share = share_of_sun(&e);
        print_message("%6g  %6g  %7.4f  %7.4f\n", rows[i].depth, rows[i].cosine, rows[i].share, share);
        assert_near(share, rows[i].share, rows[i].cosine < .07 ? .02 : .005);
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
        {.5, 60, .9724, {.00601, .07777, .00444, .01727, .00686, .01246}},
        {.5, 20, .8500, {.00170, .00559, .00555, .00854, .05597, .01385}},
        {2, 60, .8823, {.02454, .20200, .02896, .07146, .04185, .04681}},
        {2, 20, .6215, {.00967, .02287, .02732, .03545, .13283, .04105}},
        {8, 60, .6059, {.09964, .21325, .10489, .13210, .12400, .12393}},
        {8, 20, .3758, {.03294, .04510, .05491, .03595, .16779, .06807}},
        {32, 60, .2603, {.21928, .09173, .18788, .06199, .20706, .20688}},
        {32, 20, .1603, {.06237, .02231, .07534, .01508, .18825, .08850}},
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
