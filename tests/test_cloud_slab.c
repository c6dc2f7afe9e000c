/* Even layers of clouds against plane-parallel slabs of the same drops and depth: what comes through, what is seen of them from
 * above, below and aslant, and that all light goes up or down. Numbers are of discrete ordinates (64 streams, delta-M, exact single
 * scattering) in NumPy, apart from this code, within a standard error of paths of light; and of paths that are followed here. */
#include "planet/cloud_view.h"

#include "cloud_help.h"
#include "dice.h"
#include "near.h"

/* ---- layers ---------------------------------------------------------------------------------- */

/* As even as the parameters allow: heaps are far wider than all that is seen, on a ball that is as good as flat. */
#define FLAT_RADIUS 6.36e9
#define BASE 1000.0
#define TOP 2000.0
#define DIAMETER 14

typedef struct even {
    nebel_atmosphere *air;
    nebel_clouds *clouds;
    nebel_cloud_view *view;
    nebel_cloud_workspace *workspace;
} even;

static void even_free(even *e)
{
    nebel_destroy_cloud_workspace(e->workspace);
    nebel_destroy_cloud_view(e->view);
    nebel_destroy_clouds(e->clouds);
    nebel_destroy_atmosphere(e->air);
}

static void even_make(double extinction, double sun_cosine, even *e)
{
    /* Air that does nothing over a black ground. */
    const nebel_atmosphere_desc bare = {.radius = FLAT_RADIUS,
                                       .thickness = 1e5,
                                       .air_count = 1,
                                       .airs = {{.absorption = {1e-20, 1e-20, 1e-20}, .scale_height = 1e5}}};
    assert_int_equal(nebel_create_atmosphere(&bare, &e->air), NEBEL_OK);
    const nebel_clouds_desc desc = {.atmosphere = e->air,
                                    .layer_count = 1,
                                    .layers = {{.kind = NEBEL_CLOUD_STRATUS,
                                                .base = BASE,
                                                .top = TOP,
                                                .coverage = 1,
                                                .extinction = extinction,
                                                .size = 1e5,
                                                .detail = NEBEL_CLOUD_NONE,
                                                .variation = NEBEL_CLOUD_NONE,
                                                .diameter = DIAMETER,
                                                .seed = 1}}};
    assert_int_equal(nebel_create_clouds(&desc, &e->clouds), NEBEL_OK);
    const nebel_cloud_view_desc view = {.clouds = e->clouds,
                                        .sun = {.direction = {sqrt(1 - sun_cosine * sun_cosine), sun_cosine, 0},
                                                .irradiance = {1, 1, 1}},
                                        .tolerance = 1e-4};
    assert_int_equal(nebel_create_cloud_view(&view, &e->view), NEBEL_OK);
    assert_int_equal(nebel_create_cloud_workspace(e->view, &e->workspace), NEBEL_OK);
}

/* m of full extinction that a level layer would have up, by what the way from the origin to a sun has. */
static double column(double sun_cosine)
{
    enum { STEPS = 400 };
    even e;
    const double aside = sqrt(1 - sun_cosine * sun_cosine) / sun_cosine;
    double sum = 0;
    even_make(.01, 1, &e);
    for (int i = 0; i < STEPS; i++) {
        const double step = (TOP - BASE) / STEPS, height = BASE + (i + .5) * step;
        sum += step * (double)extinction_at(e.clouds, 0, 0, aside * height, height, 0) / .01;
    }
    even_free(&e);
    return sum;
}

static double share_of_sun(const even *e)
{
    float part;
    assert_int_equal(
        nebel_shade_clouds(e->workspace, 100, 1, (const double(*)[3])(const double[1][3]){{0, 10, 0}}, 0, &part),
        NEBEL_OK);
    return (double)part;
}

/* Through the middle of the layer over the origin; down: cosine of the ray to straight down; around: of its way along the ground
 * to that of the sun. */
static double radiance(const even *e, double down, double around)
{
    const double level = sqrt(1 - down * down), side = sqrt(1 - around * around), middle = .5 * (BASE + TOP);
    const double height = down > 0 ? TOP + 500 : BASE - 500, way = (height - middle) / down, spread = 1e-4;
    const nebel_ray ray = {{-way * level * around, height, -way * level * side},
                           {level * around, -down, level * side},
                           HUGE_VAL};
    nebel_cloud_knots knots;
    assert_int_equal(nebel_trace_clouds(e->workspace, 1, &ray, 0, &spread, 0, &knots, 0), NEBEL_OK);
    assert_true(knots.count > 0);
    return (double)knots.in_scattering[knots.count - 1][1];
}

/* ---- numbers --------------------------------------------------------------------------------- */

static void test_share_of_sun(void **state)
{
    (void)state;
    static const struct {
        double depth, cosine, share;
    } rows[] = {{2, .342, .6360}, {1, .2, .6123},  {.5, .1, .5670}, {16, .1, .1801}, {1, 1, .9631},  {4, 1, .8379},
                {16, 1, .4900},   {64, 1, .1773},  {4, .5, .6157},  {16, .5, .3318}, {64, .5, .1199}, {16, .2, .2227}};
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
    print_message("radiance of even layers by that of slabs, seen straight down, straight up, at 60 degrees to straight down and\n"
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
