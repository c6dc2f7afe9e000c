/* Clouds with volume: their density, what quadrature makes of it, and bad input. */
#include "clouds/cloud_density.h"
#include "clouds/cloud_lighting.h"

#include "math/vector.h"

#include "cloud_help.h"
#include "dice.h"
#include "near.h"
#include "scarce_memory.h"
#include "unit.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

/* ---- density --------------------------------------------------------------------------------- */

/* In the middle of a layer's height. */
static int is_cloud(const nebel_clouds *clouds, const nb_cloud_layer *layer, const double unit[3])
{
    nb_cloud_density_query looks = {.count = 1};
    for (int c = 0; c < 3; c++) looks.place[c][0] = (layer->low + layer->high) / 2 * unit[c];
    nb_cloud_density_alone(clouds->kernel, &clouds->noise, layer, &looks);
    return looks.whole[0] > 0;
}

static void test_noise_is_what_its_constants_say(void **state)
{
    (void)state;
    enum { COUNT = 200000 };
    nebel_clouds *clouds =
        make(3, (const nebel_cloud_layer[]){{.seed = 5}, {.type = NEBEL_CLOUD_STRATUS}, {.type = NEBEL_CLOUD_CIRRUS}});
    uint64_t numbers = 1;
    double square = 0, steepest = 0;
    for (int i = 0; i < COUNT; i++) {
        double place[3], slope = 0;
        for (int k = 0; k < 3; k++) place[k] = dice(&numbers, -100, 100);
        const double here = (double)nb_gradient_noise(&clouds->noise, place);
        for (int k = 0; k < 3; k++) {
            double near[3] = {place[0], place[1], place[2]};
            near[k] += 1e-3;
            slope += pow(((double)nb_gradient_noise(&clouds->noise, near) - here) / 1e-3, 2);
        }
        square += here * here;
        steepest = fmax(steepest, sqrt(slope));
    }
    assert_near(square / COUNT, (double)NB_GRADIENT_VARIANCE, 5e-4);
    assert_true(steepest > 2);
    /* A part of the planet is above the rank that a part of it is above of; under sheets with all their detail. */
    for (int k = 0; k < 3; k++) {
        const nb_cloud_layer *layer = &clouds->layers[k];
        int under = 0;
        for (int i = 0; i < COUNT / 10; i++) {
            double unit[3];
            do {
                for (int c = 0; c < 3; c++) unit[c] = dice(&numbers, -1, 1);
                square = unit[0] * unit[0] + unit[1] * unit[1] + unit[2] * unit[2];
            } while (!(square > .1 && square < 1));
            for (int c = 0; c < 3; c++) unit[c] /= sqrt(square);
            const nb_cloud_column column = nb_cloud_column_at(&clouds->noise, layer, unit, 0);
            under += k == 0 ? column.rank > 0 : is_cloud(clouds, layer, unit);
        }
        assert_near(under / (COUNT / 10.), (double)layer->coverage, .03);
    }
    nebel_destroy_clouds(clouds);
}

/* Where they cover all, sheets have no gaps, however thin they are there. */
static void test_closed_sheets_have_no_gaps(void **state)
{
    (void)state;
    nebel_clouds *clouds = make(2, (const nebel_cloud_layer[]){{.type = NEBEL_CLOUD_STRATUS, .coverage = 1},
                                                               {.type = NEBEL_CLOUD_CIRRUS, .coverage = 1}});
    uint64_t numbers = 9;
    for (int k = 0; k < 2; k++) {
        const double height = k == 0 ? 550 : 8750, most = (double)clouds->layers[k].extinction;
        double least = HUGE_VAL, largest = 0;
        for (int i = 0; i < 20000; i++) {
            const double x = dice(&numbers, -1, 1), y = dice(&numbers, -1, 1), z = dice(&numbers, -1, 1);
            const double here = (double)above(clouds, height, x, y, z, 0) / most;
            least = fmin(least, here);
            largest = fmax(largest, here);
        }
        print_message("closed sheet %d: within %.2f and %.2f of its extinction\n", k, least, largest);
        assert_true(least > .3 && largest > .95);
    }
    nebel_destroy_clouds(clouds);
}

/* The date line (x < 0, z = 0) and the poles are places like others: over a centimetre density changes as little. */
static void test_there_is_no_seam_and_no_pole(void **state)
{
    (void)state;
    nebel_clouds *clouds = make(1, (const nebel_cloud_layer[]){{.coverage = .8}});
    uint64_t numbers = 7;
    double worst[2] = {0, 0};
    int cloudy[2] = {0, 0};
    for (int i = 0; i < 20000; i++) {
        const double latitude = dice(&numbers, -.5, .5) * PI, height = dice(&numbers, 950, 2600), step = 1e-2 / RADIUS;
        const int is_seam = i % 2;
        const double longitude = is_seam ? PI : dice(&numbers, 0, 2 * PI), pole = is_seam && i % 4 == 1 ? 1 : 0;
        const double y = pole > 0 ? copysign(1, latitude) : sin(latitude), level = pole > 0 ? 0 : cos(latitude);
        const double x = level * cos(longitude), z = level * sin(longitude);
        const double a = (double)above(clouds, height, x, y, z - step, 0),
                     b = (double)above(clouds, height, x, y, z + step, 0);
        worst[is_seam] = fmax(worst[is_seam], fabs(a - b));
        cloudy[is_seam] += a > 0;
        assert_true(a >= 0 && a <= .05 * (1 + 1e-6));
    }
    assert_true(cloudy[0] > 500 && cloudy[1] > 500);
    assert_true(worst[1] < 2 * worst[0] && worst[0] < 5e-4);
    assert_true(extinction_at(clouds, 0, 0, 0, 899, 0) == 0 && extinction_at(clouds, 0, 0, 0, 2701, 0) == 0);
    nebel_destroy_clouds(clouds);
}

/* How often a line of 800 km in the middle of a layer enters or leaves clouds, over many lines; x or z is along it. */
static int count_borders(const nebel_clouds *clouds, double height, int is_along_z)
{
    enum { LINES = 20, STEPS = 4000 };
    int count = 0;
    for (int line = 0; line < LINES; line++) {
        int was_cloud = 0;
        for (int i = 0; i < STEPS; i++) {
            const double along = 200. * (i - STEPS / 2), aside = 4e4 * (line - LINES / 2);
            const int is = above(clouds, height, is_along_z ? aside : along, RADIUS, is_along_z ? along : aside, 0) > 0;
            count += i > 0 && is != was_cloud;
            was_cloud = is;
        }
    }
    return count;
}

/* Wisps are as many times longer as they are seldom met; without wind along z. Heaps know no wind. */
static void test_wisps_lie_along_the_wind(void **state)
{
    (void)state;
    const nebel_cloud_layer layers[] = {
        {.type = NEBEL_CLOUD_CIRRUS}, {.type = NEBEL_CLOUD_CIRRUS, .wind = {-10, 0}}, {0}};
    static const double heights[] = {8750, 8750, 1200};
    double ratios[3];
    for (int k = 0; k < 3; k++) {
        nebel_clouds *const clouds = make(1, &layers[k]);
        ratios[k] = (double)count_borders(clouds, heights[k], 0) / count_borders(clouds, heights[k], 1);
        nebel_destroy_clouds(clouds);
    }
    print_message("borders across to along z: %.2f, in wind along x %.2f, of heaps %.2f\n", ratios[0], ratios[1],
                  ratios[2]);
    assert_true(ratios[0] > 3 && ratios[1] < 1. / 3 && fabs(log(ratios[2])) < .1);
}

/* A millimetre is far more than the last digit of a place on the Earth: density follows a line without steps. */
static void test_details_stand_still_at_the_size_of_a_planet(void **state)
{
    (void)state;
    nebel_clouds *clouds = make(1, (const nebel_cloud_layer[]){{.coverage = .8}});
    double bend = 0, change = 0, last[2] = {0, 0}, x = 0;
    /* A border of a cloud. */
    for (float here = 0; !(here > .002f && here < .02f) && x < 1e5; x += 1)
        here = extinction_at(clouds, 0, 0, x, 1300, -700);
    for (int i = 0; i < 10000; i++) {
        const double here = (double)extinction_at(clouds, 0, 0, x - 5 + 1e-3 * i, 1300, -700);
        if (i > 1) bend = fmax(bend, fabs(here - 2 * last[0] + last[1]));
        if (i > 0) change = fmax(change, fabs(here - last[0]));
        last[1] = last[0];
        last[0] = here;
    }
    assert_true(change > 1e-8 && change < 2e-5);
    assert_true(bend < 5e-6);
    nebel_destroy_clouds(clouds);
}

/* The wind carries what is over the origin along, as on a turning ball. */
static void test_wind_turns_the_shell(void **state)
{
    (void)state;
    nebel_clouds *clouds = make(1, (const nebel_cloud_layer[]){{.coverage = 1, .wind = {30, -40}}});
    int cloudy = 0;
    for (int i = 0; i < 200; i++) {
        const double height = 950 + 8 * i, x = 35. * i, radius = RADIUS + height;
        const double angle = 50 * 100. / (RADIUS + 900), way[2] = {.6, -.8};
        /* Split into along the wind and across it. */
        const double along = x * way[0], across = -x * way[1], y = sqrt(radius * radius - x * x);
        const double turned = along * cos(angle) + y * sin(angle), up = y * cos(angle) - along * sin(angle);
        const double before = (double)extinction_at(clouds, 0, 0, x, y - RADIUS, 0);
        const double after = (double)extinction_at(clouds, 100, 0, turned * way[0] - across * way[1], up - RADIUS,
                                                   turned * way[1] + across * way[0]);
        assert_near(before, after, 1e-5);
        cloudy += before > 0;
    }
    assert_true(cloudy > 20);
    nebel_destroy_clouds(clouds);
}

/* ---- along rays ------------------------------------------------------------------------------ */

/* Thin cloud around the eye: what a ray's transmittance is off by its neighbour's is off by, too. It is not where a long step is
 * taken for exact whose three values lie on a line by chance, or goes over a wisp: then lines and terraces are seen. */
static void test_no_lines_in_thin_clouds(void **state)
{
    (void)state;
    enum { WIDE = 160, HIGH = 40 };
    nebel_clouds *clouds = make(1, (const nebel_cloud_layer[]){{.seed = 1, .coverage = .7}});
    nebel_cloud_workspace *workspace;
    nebel_cloud_lighting *view = view_of(clouds, 0, &workspace);
    double worst = 0, sum = 0, last = 0;
    int between = 0;
    for (int i = 0; i < WIDE * HIGH; i++) {
        if (!nb_test_tries((size_t)i / WIDE, HIGH)) continue;
        const double x = -.25 + .7 * (i % WIDE) / WIDE, y = .2 + .35 * (double)(i / WIDE) / HIGH;
        const double length = sqrt(x * x + y * y + 1);
        const nebel_ray ray = {{0, 1359.375, 0}, {x / length, y / length, -1 / length}, 300};
        nebel_cloud_transfer nodes;
        assert_int_equal(nebel_trace_clouds(workspace, 1, &ray, 0, 0, NULL, &nodes, 0), NEBEL_OK);
        const double left = nodes.count > 0 ? (double)nodes.transmittance[nodes.count - 1] : 1;
        const double truth = brute_force(clouds, &ray, 0, 300, 1), step = fabs(left - truth - last);
        last = left - truth;
        between += truth > .02 && truth < .98;
        if (i % WIDE == 0) continue;
        worst = fmax(worst, step);
        sum += step / (WIDE * HIGH);
    }
    print_message("thin clouds around the eye, %d of %d rays within: neighbours off by %.2g more or less at most, %.2g "
                  "in the mean\n",
                  between, WIDE * HIGH, worst, sum);
    /* Ten times what all of a ray may be off by: the pieces of one place are a few, each within that. */
    assert_true(between > WIDE * (int)nb_test_count(HIGH) / 2 && worst < 10 * NEBEL_DEFAULT_TOLERANCE);
    nebel_destroy_cloud_workspace(workspace);
    nebel_destroy_cloud_lighting(view);
    nebel_destroy_clouds(clouds);
}

/* Rows of pixels, seen from a place. */
typedef struct window {
    double eye[3], forward[3], right[3], up[3]; /* forward: through the first pixel; the others from pixel to pixel */
} window;

enum { SIDE = 48 };

static nebel_ray pixel_ray(const window *w, int x, int y)
{
    nebel_ray ray = {.t_max = HUGE_VAL};
    for (int c = 0; c < 3; c++) {
        ray.origin[c] = w->eye[c];
        ray.direction[c] = w->forward[c] + x * w->right[c] - y * w->up[c];
    }
    return ray;
}

/* How much pixels' light differs from the mean of their neighbours, as a part of it, root of the mean square; *most at most. */
static double find_grain(const nebel_cloud_layer *layer, const nebel_sun *sun, const window *w, double *most)
{
    enum { COUNT = SIDE * SIDE };
    static nebel_cloud_transfer nodes[COUNT];
    nebel_clouds *clouds = make(1, layer);
    const nebel_cloud_lighting_desc desc = {.clouds = clouds, .sun = *sun};
    const double pixel = sqrt(nb_vector_dot(w->right, w->right));
    nebel_cloud_lighting *view;
    nebel_cloud_workspace *workspace;
    double square = 0;
    *most = 0;
    assert_int_equal(nebel_create_cloud_lighting(&desc, &view), NEBEL_OK);
    assert_int_equal(nebel_create_cloud_workspace(view, &workspace), NEBEL_OK);
    for (int i = 0; i < COUNT; i++) {
        const nebel_ray ray = pixel_ray(w, i % SIDE, i / SIDE);
        assert_int_equal(nebel_trace_clouds(workspace, 1, &ray, 0, pixel, NULL, &nodes[i], 0), NEBEL_OK);
        assert_true(nodes[i].count > 0);
    }
    for (int i = SIDE; i < COUNT - SIDE; i++) {
        double light[5];
        const int at[5] = {i, i - 1, i + 1, i - SIDE, i + SIDE};
        if (i % SIDE == 0 || i % SIDE == SIDE - 1) continue;
        for (int k = 0; k < 5; k++) light[k] = (double)nodes[at[k]].in_scattering[nodes[at[k]].count - 1][0];
        const double off = 4 * light[0] / (light[1] + light[2] + light[3] + light[4]) - 1;
        square += off * off;
        *most = fmax(*most, fabs(off));
    }
    nebel_destroy_cloud_workspace(workspace);
    nebel_destroy_cloud_lighting(view);
    nebel_destroy_clouds(clouds);
    return sqrt(square / COUNT);
}

/* A closed sheet against a low sun. Where places of light hung on where pieces of a ray ended, which are halves and doubles of each
 * other, it was 1.9e-3 and looked like grain. */
static void test_neighbours_have_light_of_neighbouring_places(void **state)
{
    (void)state;
    const double pixel = 2 / sqrt(3) / 360;
    const nebel_cloud_layer sheet = {.type = NEBEL_CLOUD_STRATUS, .coverage = 0.9};
    const nebel_sun sun = {.direction = {.3, .12, -1}, .irradiance = {5, 5, 5}};
    const window w = {{0, 2, 0}, {-180 * pixel, 110 * pixel, -1}, {pixel, 0, 0}, {0, pixel, 0}};
    double most;
    const double grain = find_grain(&sheet, &sun, &w, &most);
    print_message("sheet against a low sun: pixels off the mean of neighbours by %.2g, %.2g at most\n", grain, most);
    assert_true(grain < 1.2e-3 && most < 7e-3);
}

/* A sheet with thin places before a low sun: where the light of a piece came from its middle, wherever its cloud was, pixels were 1.1e-3 off
 * the mean of their neighbours, 7.7e-3 at most. */
static void test_sunset_under_a_sheet_has_little_grain(void **state)
{
    (void)state;
    const double pixel = 2 * tan(25 * 3.14159265358979323846 / 180) / 216, up[3] = {0, .92848, .37139};
    const nebel_cloud_layer sheet = {.type = NEBEL_CLOUD_STRATUS};
    const nebel_sun sun = {.direction = {.3, .1, -1}, .irradiance = {20, 20, 20}};
    const window w = {{0, 2, 0},
                      {-30 * pixel, .37139 + 30 * pixel * up[1], -.92848 + 30 * pixel * up[2]},
                      {pixel, 0, 0},
                      {0, pixel * up[1], pixel * up[2]}};
    double most;
    const double grain = find_grain(&sheet, &sun, &w, &most);
    print_message("sunset under a sheet: pixels off the mean of neighbours by %.2g, %.2g at most\n", grain, most);
    assert_true(grain < 9e-4 && most < 6.5e-3);
}

/* Through thin cloud around the eye that lies in shadow to a sunlit heap 140 m behind it. Where hardly any cloud between was as good as
 * none, or as cloud, some pixels had one light for both, from between them. */
static void test_two_clouds_have_light_of_two_places(void **state)
{
    (void)state;
    const nebel_cloud_layer heaps = {.seed = 3};
    const nebel_sun sun = {.direction = {.3, .5, -1}, .irradiance = {5, 5, 5}};
    const window w = {
        {2000, 1500, .37}, {-.4199, .0283, -.9089}, {1.8235e-3, 0, -7.838e-4}, {6.17e-5, 1.9785e-3, 1.435e-4}};
    double most;
    const double grain = find_grain(&heaps, &sun, &w, &most);
    print_message("two clouds: pixels off the mean of neighbours by %.2g, %.2g at most\n", grain, most);
    /* The heap's edge is far brighter than the cloud before it. With one light for both it was 0.056, 0.43 at most. */
    assert_true(grain < .04 && most < .4);
}

/* Rays without a width, to which small billows are as thick as they are: steps in search of clouds may go over some. From within, below
 * and above. */
static void test_billows_that_are_missed(void **state)
{
    (void)state;
    enum { RAYS = 450, FEW = 150 };
    const int rays = nb_test_count(RAYS) > FEW ? (int)nb_test_count(RAYS) : FEW;
    nebel_clouds *clouds = make(1, &(nebel_cloud_layer){.seed = 1});
    nebel_cloud_workspace *workspace;
    nebel_cloud_lighting *view = view_of(clouds, 0, &workspace);
    uint64_t numbers = 11;
    double sum = 0, most = 0;
    int untold = 0;
    for (int i = 0; i < rays; i++) {
        const double heights[3] = {dice(&numbers, 1000, 2600), 2, 5000}, turn = dice(&numbers, 0, 2 * PI);
        const double rise = dice(&numbers, .15, .7) * (i % 3 == 2 ? -1 : 1), height = heights[i % 3];
        const nebel_ray ray = {{dice(&numbers, -2e4, 2e4), height, dice(&numbers, -2e4, 2e4)},
                               {cos(turn) * sqrt(1 - rise * rise), rise, sin(turn) * sqrt(1 - rise * rise)},
                               i % 3 == 2 ? 4120 / -rise : HUGE_VAL};
        const double begin = i % 3 == 0 ? 0 : (i % 3 == 1 ? 800 : 2200) / fabs(rise),
                     end = (i % 3 == 2 ? 4120 : 2720 - height) / fabs(rise);
        nebel_cloud_transfer nodes;
        assert_int_equal(nebel_trace_clouds(workspace, 1, &ray, 0, 0, NULL, &nodes, 0), NEBEL_OK);
        const double left = nodes.count > 0 ? (double)nodes.transmittance[nodes.count - 1] : 1;
        const double off = fabs(left - brute_force(clouds, &ray, begin, end, 1));
        const double beyond = off - (nodes.count > 0 ? (double)nodes.error : 0);
        sum += off / rays;
        most = fmax(most, beyond);
        untold += beyond > 2e-3;
    }
    print_message("%d thin rays: off by %.2g in the mean, %d by more than 2e-3 beyond what is told, by %.2g at most\n",
                  rays, sum, untold, most);
    assert_true(sum < 2e-3 && untold <= rays / 50 && most < .06);
    nebel_destroy_cloud_workspace(workspace);
    nebel_destroy_cloud_lighting(view);
    nebel_destroy_clouds(clouds);
}

/* What is left of a ray by short steps, less what is traced. */
static double excess_of(const nebel_clouds *clouds, nebel_cloud_workspace *workspace, const nebel_ray *ray, double end)
{
    nebel_cloud_transfer nodes;
    assert_int_equal(nebel_trace_clouds(workspace, 1, ray, 0, 0, NULL, &nodes, 0), NEBEL_OK);
    const double left = nodes.count > 0 ? (double)nodes.transmittance[nodes.count - 1] : 1;
    return left - brute_force(clouds, ray, 0, end, 2);
}

/* Blocks of columns lie along planes through the planet's middle, so that cameras at x or z = 0 are on their edges. A ray from there to
 * the side of lesser numbers was taken to stay in the block of the others, and went on through all cloud: 45 of 500. */
static void test_rays_from_edges_of_blocks(void **state)
{
    (void)state;
    enum { RAYS = 120 };
    nebel_clouds *clouds = make(1, &(nebel_cloud_layer){.seed = 1});
    nebel_cloud_workspace *workspace;
    nebel_cloud_lighting *view = view_of(clouds, 0, &workspace);
    uint64_t numbers = 7;
    for (int i = 0; i < RAYS; i++) {
        const double turn = dice(&numbers, -.05, .05), up = dice(&numbers, -.2, .2), far = dice(&numbers, -2e4, 2e4);
        const double height = dice(&numbers, 1000, 2600);
        const nebel_ray along_z = {{far, height, 0}, {turn, up, -1}, 4000},
                        along_x = {{0, height, far}, {-1, up, turn}, 4000};
        assert_true(excess_of(clouds, workspace, i % 2 ? &along_z : &along_x, 4000) < .2);
    }
    nebel_destroy_cloud_workspace(workspace);
    nebel_destroy_cloud_lighting(view);
    nebel_destroy_clouds(clouds);
}

/* Clouds thin out to nothing where their layer ends: a step that ended there saw nothing, and one ray of 600 passed all cloud. */
static void test_bases_are_seen(void **state)
{
    (void)state;
    static const double details[] = {.1, .5};
    for (int k = 0; k < 2; k++) {
        nebel_clouds *clouds = make(1, &(nebel_cloud_layer){.seed = 2, .erosion = details[k]});
        nebel_cloud_workspace *workspace;
        nebel_cloud_lighting *view = view_of(clouds, 0, &workspace);
        const nebel_ray known = {{8113.37, 1500, -3450.79}, {-.6338, -.3746, -.6768}, HUGE_VAL};
        uint64_t numbers = 3;
        assert_true(excess_of(clouds, workspace, &known, 4e3) < .02);
        for (size_t i = 0; i < nb_test_count(300); i++) {
            const double turn = dice(&numbers, 0, 2 * PI), x = dice(&numbers, -3e4, 3e4), z = dice(&numbers, -3e4, 3e4);
            const nebel_ray ray = {{x, 1500, z}, {sin(turn), -.4, cos(turn)}, HUGE_VAL};
            assert_true(excess_of(clouds, workspace, &ray, 1500 / .4) < .1);
        }
        nebel_destroy_cloud_workspace(workspace);
        nebel_destroy_cloud_lighting(view);
        nebel_destroy_clouds(clouds);
    }
}

/* Steps are no longer than a layer is high, however large its heaps. */
static void test_thin_layers(void **state)
{
    (void)state;
    enum { RAYS = 200 };
    nebel_clouds *clouds = make(1, &(nebel_cloud_layer){.base = 900, .top = 910, .extinction = .2, .coverage = .6});
    nebel_cloud_workspace *workspace;
    nebel_cloud_lighting *view = view_of(clouds, 0, &workspace);
    int missed = 0, met = 0;
    for (int i = 0; i < RAYS; i++) {
        const double length = sqrt(1.04);
        const nebel_ray ray = {{200. * (i - .5 * RAYS), 0, 0}, {0, 1 / length, .2 / length}, HUGE_VAL};
        nebel_cloud_transfer nodes;
        assert_int_equal(nebel_trace_clouds(workspace, 1, &ray, 0, 1e-3, NULL, &nodes, 0), NEBEL_OK);
        const double truth = brute_force(clouds, &ray, 860 * length, 911 * length, .05);
        const double left = nodes.count > 0 ? (double)nodes.transmittance[nodes.count - 1] : 1;
        met += truth < .9;
        missed += fabs(left - truth) > .05;
    }
    print_message("a layer of 10 m: of %d rays %d meet it, %d are off\n", RAYS, met, missed);
    assert_true(met > 15 && missed < 3);
    nebel_destroy_cloud_workspace(workspace);
    nebel_destroy_cloud_lighting(view);
    nebel_destroy_clouds(clouds);
}

/* Where nothing behind is seen any more the last node is there, not where the ray leaves the layer, which is hundreds of kilometres
 * on for a ray that just passes over its base: a walk ends at an optical depth, which is that up to the node. */
static void test_thick_cloud_ends_where_it_is_seen(void **state)
{
    (void)state;
    nebel_clouds *clouds = make(1, &(nebel_cloud_layer){.type = NEBEL_CLOUD_STRATUS, .coverage = 1});
    const double apart = (double)clouds->layers[0].apart;
    nebel_cloud_workspace *workspace;
    nebel_cloud_lighting *view = view_of(clouds, 0, &workspace);
    for (int i = 0; i < 40; i++) {
        const double rise = -.03 + .0015 * i;
        const nebel_ray ray = {{0, 600, 0}, {cos(rise), sin(rise), 0}, HUGE_VAL};
        nebel_cloud_transfer nodes;
        assert_int_equal(nebel_trace_clouds(workspace, 1, &ray, 0, 1e-3, NULL, &nodes, 0), NEBEL_OK);
        const double end = (double)nodes.t[nodes.count - 1];
        double depth = 0;
        assert_true(end < 1e4);
        for (double t = 0; t < end; t += 100) depth -= log(brute_force(clouds, &ray, t, fmin(t + 100, end), 1));
        /* A piece of no more than 1 / 0.15 begins before three hundredths are left of what leads away. */
        assert_true(depth > 3.5 / apart - .2 && depth < 3.5 / apart + 7);
    }
    nebel_destroy_cloud_workspace(workspace);
    nebel_destroy_cloud_lighting(view);
    nebel_destroy_clouds(clouds);
}

/* As of air: however deep the eye is below the ground, clouds are where they are seen from the ground over it. */
static void test_below_the_ground_is_on_it(void **state)
{
    (void)state;
    static const double depths[] = {1, 5e3, 3e6, RADIUS};
    nebel_clouds *clouds = make(1, &(nebel_cloud_layer){.coverage = .6});
    nebel_cloud_workspace *workspace;
    nebel_cloud_lighting *view = view_of(clouds, 0, &workspace);
    for (int i = 0; i < 20; i++) {
        nebel_ray ray = {{0, 0, 0}, {.3 - .02 * i, .1 + .04 * i, 1}, HUGE_VAL};
        nebel_cloud_transfer on, below;
        assert_int_equal(nebel_trace_clouds(workspace, 1, &ray, 0, 1e-3, NULL, &on, 0), NEBEL_OK);
        for (size_t k = 0; k < sizeof depths / sizeof *depths; k++) {
            ray.origin[1] = -depths[k];
            assert_int_equal(nebel_trace_clouds(workspace, 1, &ray, 0, 1e-3, NULL, &below, 0), NEBEL_OK);
            assert_int_equal(below.count, on.count);
            if (on.count == 0) continue;
            const uint32_t last = on.count - 1;
            assert_true(below.t[last] == on.t[last]);
            assert_true(fabsf(below.transmittance[last] - on.transmittance[last]) < 1e-5f);
        }
    }
    nebel_destroy_cloud_workspace(workspace);
    nebel_destroy_cloud_lighting(view);
    nebel_destroy_clouds(clouds);
}

enum { RAYS = 40 };

/* From within a layer and from above all. */
static void lay_rays(nebel_ray rays[RAYS])
{
    for (int i = 0; i < RAYS; i++)
        rays[i] = (nebel_ray){{0, i % 2 ? 1500 : 3e4, 0}, {.02 * i, i % 2 ? .1 : -.3, 1}, HUGE_VAL};
}

static void compare_orders(double spread)
{
    nebel_clouds *clouds = make(2, (const nebel_cloud_layer[]){{.seed = 2}, {.type = NEBEL_CLOUD_CIRRUS}});
    nebel_cloud_workspace *workspace, *other;
    nebel_cloud_lighting *view = view_of(clouds, 0, &workspace);
    nebel_cloud_transfer nodes[2][RAYS];
    nebel_ray rays[RAYS];
    memset(nodes, 0, sizeof nodes);
    assert_int_equal(nebel_create_cloud_workspace(view, &other), NEBEL_OK);
    lay_rays(rays);
    assert_int_equal(nebel_trace_clouds(workspace, RAYS, rays, 0, spread, NULL, nodes[0], 0), NEBEL_OK);
    for (int i = RAYS - 1; i >= 0; i--)
        assert_int_equal(nebel_trace_clouds(other, 1, &rays[i], 0, spread, NULL, &nodes[1][i], 0), NEBEL_OK);
    assert_memory_equal(nodes[0], nodes[1], sizeof nodes[0]);
    int some = 0;
    for (int i = 0; i < RAYS; i++) {
        const nebel_cloud_transfer *k = &nodes[0][i];
        some += k->count > 0;
        for (uint32_t n = 0; n < k->count; n++) {
            assert_true(k->transmittance[n] >= 0 && k->transmittance[n] <= 1 && k->in_scattering[n][1] >= 0);
            if (n > 0) assert_true(k->t[n] >= k->t[n - 1] && k->transmittance[n] <= k->transmittance[n - 1]);
        }
    }
    assert_true(some > RAYS / 3);
    nebel_destroy_cloud_workspace(other);
    nebel_destroy_cloud_workspace(workspace);
    nebel_destroy_cloud_lighting(view);
    nebel_destroy_clouds(clouds);
}

/* What a workspace has seen before changes nothing, whether pixels see heaps or hide them. */
static void test_order_of_rays_makes_no_difference(void **state)
{
    (void)state;
    compare_orders(1e-3);
    compare_orders(.05);
}

/* Each kind, many rays at once. */
static void test_instruction_sets_agree(void **state)
{
    (void)state;
    static nebel_cloud_transfer nodes[2][RAYS];
    nebel_ray rays[RAYS];
    int some = 0;
    lay_rays(rays);
    for (int kind = 0; kind < NEBEL_CLOUD_TYPE_COUNT; kind++) {
        nebel_clouds *clouds = make(1, &(const nebel_cloud_layer){.type = (nebel_cloud_type)kind, .seed = 3});
        memset(nodes, 0, sizeof nodes);
        for (int isa = NEBEL_ISA_SCALAR; isa < NEBEL_ISA_COUNT; isa++) {
            const nebel_cloud_lighting_desc desc = {
                .clouds = clouds, .sun = {.direction = {.6, .7, .1}, .irradiance = {5, 4, 3}}, .isa = (nebel_isa)isa};
            nebel_cloud_lighting *view;
            nebel_cloud_workspace *workspace;
            if (!nebel_isa_available((nebel_isa)isa)) {
                assert_int_equal(nebel_create_cloud_lighting(&desc, &view), NEBEL_ERROR_UNSUPPORTED);
                continue;
            }
            nebel_cloud_transfer *seen = nodes[isa != NEBEL_ISA_SCALAR];
            assert_int_equal(nebel_create_cloud_lighting(&desc, &view), NEBEL_OK);
            assert_int_equal(nebel_create_cloud_workspace(view, &workspace), NEBEL_OK);
            assert_int_equal(nebel_trace_clouds(workspace, RAYS, rays, sizeof *rays, 1e-3, NULL, seen, sizeof *seen),
                             NEBEL_OK);
            if (isa != NEBEL_ISA_SCALAR) assert_memory_equal(nodes[0], nodes[1], sizeof nodes[0]);
            nebel_destroy_cloud_workspace(workspace);
            nebel_destroy_cloud_lighting(view);
        }
        for (int i = 0; i < RAYS; i++) some += nodes[0][i].count > 0;
        nebel_destroy_clouds(clouds);
    }
    assert_true(some > RAYS);
}

/* ---- bad input ------------------------------------------------------------------------------- */

static void keep_text(nebel_log_level level, nebel_result result, const char *message, void *user)
{
    (void)level, (void)result;
    (void)snprintf(user, 200, "%s", message);
}

static void assert_layer_fault(const nebel_cloud_layer *layer, const char *wanted)
{
    char said[200] = "";
    nebel_cloud_layer resolved;
    assert_int_equal(nebel_resolve_cloud_layer(1e5, layer, &(nebel_log){keep_text, said}, &resolved),
                     NEBEL_ERROR_VALUE);
    assert_string_equal(said, wanted);
}

static void test_what_is_said_of_bad_layers(void **state)
{
    (void)state;
    assert_layer_fault(&(nebel_cloud_layer){.base = (double)NAN},
                       "cloud layer: base: is nan m; must be above the ground");
    assert_layer_fault(&(nebel_cloud_layer){.base = -5}, "cloud layer: base: is -5 m; must be above the ground");
    assert_layer_fault(&(nebel_cloud_layer){.base = 99000},
                       "cloud layer: top: is 100800 m, as none is given; must be within the air, 100000 m");
    assert_layer_fault(&(nebel_cloud_layer){.coverage = 1.5},
                       "cloud layer: coverage: is 1.5; must be within 0 and 1 (0: the number of its type)");
    assert_layer_fault(&(nebel_cloud_layer){.erosion = -.5},
                       "cloud layer: erosion: is -0.5; must be within 0 and 1, or none (-1)");
    assert_layer_fault(&(nebel_cloud_layer){.wind = {0, 1e13}},
                       "cloud layer: wind: is 1e+13 m; must be within -1e12 and 1e12");
}

static void test_clouds_need_air(void **state)
{
    (void)state;
    nebel_atmosphere *moon;
    nebel_clouds *clouds;
    char said[200] = "";
    assert_int_equal(nebel_create_atmosphere(nebel_lookup_atmosphere("moon"), &moon), NEBEL_OK);
    nebel_clouds_desc desc = {.atmosphere = moon, .layer_count = 1, .host.log = {keep_text, said}};
    assert_int_equal(nebel_create_clouds(&desc, &clouds), NEBEL_ERROR_VALUE);
    assert_string_equal(said, "clouds: need air, and the planet has none");
    desc.layer_count = 0;
    assert_int_equal(nebel_create_clouds(&desc, &clouds), NEBEL_OK);
    nebel_destroy_clouds(clouds);
    nebel_destroy_atmosphere(moon);
}

static void test_bad_layers_are_refused(void **state)
{
    (void)state;
    const double none = (double)NAN;
    float texel = 2;
    const nebel_cloud_layer bad[] = {{.type = (nebel_cloud_type)7},
                                     {.base = -5},
                                     {.base = 2000, .top = 1000},
                                     {.base = 1000, .top = 1000},
                                     {.base = none},
                                     {.top = none},
                                     {.top = 2e5},
                                     {.coverage = 1.5},
                                     {.coverage = -.1},
                                     {.coverage = none},
                                     {.extinction = -1},
                                     {.extinction = HUGE_VAL},
                                     {.cell_size = none},
                                     {.cell_size = 1e10},
                                     {.cell_size = 4.001 * RADIUS},
                                     {.erosion = 1.1},
                                     {.erosion = -.5},
                                     {.patchiness = 2},
                                     {.droplet_diameter = 1},
                                     {.wind = {none, 0}},
                                     {.wind = {0, HUGE_VAL}},
                                     {.weather_map = {1, 1, 1, &texel}},
                                     {.weather_map = {1, 1, 3, &texel}}};
    for (size_t i = 0; i < sizeof bad / sizeof *bad; i++) {
        nebel_clouds *clouds = (nebel_clouds *)&texel;
        nebel_clouds_desc desc = {.atmosphere = air, .layers = {bad[i]}, .layer_count = 1};
        assert_int_equal(nebel_create_clouds(&desc, &clouds), NEBEL_ERROR_VALUE);
        assert_null(clouds);
    }
    nebel_clouds *clouds;
    nebel_clouds_desc desc = {
        .atmosphere = air, .layers = {{.top = 2000}, {.base = 1500, .top = 3000}}, .layer_count = 2};
    assert_int_equal(nebel_create_clouds(&desc, &clouds), NEBEL_ERROR_VALUE);
    desc.layer_count = NEBEL_MAX_CLOUD_LAYERS + 1;
    assert_int_equal(nebel_create_clouds(&desc, &clouds), NEBEL_ERROR_LIMIT);
    desc.layer_count = 0;
    assert_int_equal(nebel_create_clouds(&desc, &clouds), NEBEL_OK);
    nebel_destroy_clouds(clouds);
    desc.atmosphere = NULL;
    assert_int_equal(nebel_create_clouds(&desc, &clouds), NEBEL_ERROR_ARGUMENT);
    assert_int_equal(nebel_create_clouds(NULL, &clouds), NEBEL_ERROR_ARGUMENT);
    nebel_destroy_clouds(NULL);
}

static void test_bad_calls_are_refused(void **state)
{
    (void)state;
    nebel_clouds *clouds = make(1, (const nebel_cloud_layer[]){{.seed = 1}});
    nebel_cloud_workspace *workspace;
    nebel_cloud_lighting *view = view_of(clouds, 0, &workspace), *other;
    const double none = (double)NAN, place[1][3] = {{0, none, 0}};
    nebel_ray ray = {{0, 0, 0}, {0, 1, 0}, HUGE_VAL};
    nebel_cloud_transfer nodes;
    float number;
    char said[200] = "";
    const nebel_cloud_lighting_desc unknown = {.clouds = clouds, .isa = (nebel_isa)77, .host.log = {keep_text, said}};
    assert_int_equal(nebel_create_cloud_lighting(&unknown, &other), NEBEL_ERROR_UNSUPPORTED);
    assert_string_equal(said, "clouds: instruction set unknown: not available here");
    const nebel_cloud_lighting_desc no_sun = {
        .clouds = clouds, .sun.irradiance = {0, none, 0}, .host.log = {keep_text, said}};
    assert_int_equal(nebel_create_cloud_lighting(&no_sun, &other), NEBEL_ERROR_ARGUMENT);
    assert_non_null(strstr(said, "cloud lighting: sun"));
    assert_int_equal(nebel_create_cloud_lighting(&(nebel_cloud_lighting_desc){.clouds = clouds, .time = none}, &other),
                     NEBEL_ERROR_VALUE);
    assert_int_equal(
        nebel_create_cloud_lighting(&(nebel_cloud_lighting_desc){.clouds = clouds, .tolerance = -1}, &other),
        NEBEL_ERROR_VALUE);
    assert_int_equal(nebel_create_cloud_lighting(&(nebel_cloud_lighting_desc){.time = 1}, &other),
                     NEBEL_ERROR_ARGUMENT);
    nebel_destroy_cloud_workspace(workspace);
    assert_int_equal(nebel_create_cloud_workspace(NULL, &workspace), NEBEL_ERROR_ARGUMENT);
    assert_int_equal(nebel_create_cloud_workspace(view, &workspace), NEBEL_OK);
    assert_int_equal(nebel_compute_cloud_extinction(clouds, 0, 0, 1, place, 0, &number), NEBEL_ERROR_ARGUMENT);
    assert_int_equal(nebel_compute_cloud_extinction(clouds, none, 0, 0, NULL, 0, NULL), NEBEL_ERROR_ARGUMENT);
    assert_int_equal(nebel_compute_cloud_sun_transmittance(workspace, 0, 1, place, 0, &number), NEBEL_ERROR_ARGUMENT);
    assert_int_equal(nebel_trace_clouds(workspace, 1, &ray, 0, -1, NULL, &nodes, 0), NEBEL_ERROR_ARGUMENT);
    assert_int_equal(nebel_trace_clouds(workspace, 1, &ray, 0, 0, NULL, NULL, 0), NEBEL_ERROR_ARGUMENT);
    ray.t_max = none;
    assert_int_equal(nebel_trace_clouds(workspace, 1, &ray, 0, 0, NULL, &nodes, 0), NEBEL_ERROR_ARGUMENT);
    ray = (nebel_ray){{0, 0, 0}, {0, 0, 0}, 1};
    assert_int_equal(nebel_trace_clouds(workspace, 1, &ray, 0, 0, NULL, &nodes, 0), NEBEL_ERROR_ARGUMENT);
    nebel_destroy_cloud_workspace(workspace);
    nebel_destroy_cloud_workspace(NULL);
    nebel_destroy_cloud_lighting(view);
    nebel_destroy_cloud_lighting(NULL);
    nebel_destroy_clouds(clouds);
}

static void test_without_memory(void **state)
{
    (void)state;
    nebel_result result = NEBEL_ERROR_MEMORY;
    for (int k = 0; result != NEBEL_OK; k++) {
        int left = k;
        nebel_clouds *clouds = NULL;
        nebel_cloud_lighting *view = NULL;
        nebel_cloud_workspace *workspace = NULL;
        const nebel_allocator scarce = {scarce_allocate, scarce_release, &left};
        result = nebel_create_clouds(
            &(nebel_clouds_desc){.atmosphere = air, .layer_count = 1, .host.allocator = scarce}, &clouds);
        if (result == NEBEL_OK)
            result = nebel_create_cloud_lighting(
                &(nebel_cloud_lighting_desc){.clouds = clouds, .host.allocator = scarce}, &view);
        if (result == NEBEL_OK) result = nebel_create_cloud_workspace(view, &workspace);
        assert_true(result == NEBEL_OK || result == NEBEL_ERROR_MEMORY);
        nebel_destroy_cloud_workspace(workspace);
        nebel_destroy_cloud_lighting(view);
        nebel_destroy_clouds(clouds);
        assert_true(k < 24);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_noise_is_what_its_constants_say),
        cmocka_unit_test(test_closed_sheets_have_no_gaps),
        cmocka_unit_test(test_there_is_no_seam_and_no_pole),
        cmocka_unit_test(test_wisps_lie_along_the_wind),
        cmocka_unit_test(test_details_stand_still_at_the_size_of_a_planet),
        cmocka_unit_test(test_wind_turns_the_shell),
        cmocka_unit_test(test_no_lines_in_thin_clouds),
        cmocka_unit_test(test_neighbours_have_light_of_neighbouring_places),
        cmocka_unit_test(test_two_clouds_have_light_of_two_places),
        cmocka_unit_test(test_sunset_under_a_sheet_has_little_grain),
        cmocka_unit_test(test_billows_that_are_missed),
        cmocka_unit_test(test_rays_from_edges_of_blocks),
        cmocka_unit_test(test_bases_are_seen),
        cmocka_unit_test(test_thin_layers),
        cmocka_unit_test(test_thick_cloud_ends_where_it_is_seen),
        cmocka_unit_test(test_below_the_ground_is_on_it),
        cmocka_unit_test(test_order_of_rays_makes_no_difference),
        cmocka_unit_test(test_instruction_sets_agree),
        cmocka_unit_test(test_what_is_said_of_bad_layers),
        cmocka_unit_test(test_clouds_need_air),
        cmocka_unit_test(test_bad_layers_are_refused),
        cmocka_unit_test(test_bad_calls_are_refused),
        cmocka_unit_test(test_without_memory),
    };
    return cmocka_run_group_tests(tests, make_air, free_air);
}
