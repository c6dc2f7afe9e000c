/* The model of light in clouds: slabs, and ways to the sun. */
#include "clouds/cloud_lighting.h"

#include "cloud_help.h"
#include "dice.h"
#include "near.h"
#include "slab_paths.h"

/* What a slab of drops sends up against the sun's light, as paths say: the part of the light that comes back, sunlight at a cosine. */
static double reflected_by_paths(double depth, double cosine, const double turns[SLAB_PARTS + 1], int paths,
                                 uint64_t *numbers)
{
    int back = 0;
    for (int i = 0; i < paths; i++) {
        double out;
        back += slab_path(depth, cosine, turns, numbers, &out) < 0;
    }
    return (double)back / paths;
}

/* The same of the model: its light integrated over the eyes above, in a slab that is seen under a cosine; or below, where what comes
 * through straight or hardly turned is told apart. */
static double sent_by_model(const nebel_cloud_lighting *view, double depth, double cosine, int is_above)
{
    enum { EYES = 24, TURNS = 96, STEPS = 400 };
    const nb_cloud_light white = {.sun = {1, 1, 1}};
    double sum = 0;
    for (int i = 0; i < EYES * TURNS; i++) {
        const double out = (i % EYES + .5) / EYES, level = sqrt(1 - out * out), turn = PI * (i / EYES + .5) / TURNS;
        const double sine = sqrt(1 - cosine * cosine);
        /* The sun's place is in the x-y plane. */
        const double direction[3] = {level * cos(turn), is_above ? -out : out, level * sin(turn)};
        nb_cloud_ray ray = nb_cloud_ray_make(view, direction, 0);
        ray.sun = sine * direction[0] + cosine * direction[1];
        const nb_cloud_layer *layer = &view->clouds->layers[0];
        ray.phase[0][1] = (float)slab_phase(&layer->phase, ray.sun);
        ray.ahead_phase[0][1] = ray.ahead = 0;
        ray.wide_phase[0][1] = nb_smaller(layer->slab->cap[1], ray.phase[0][1]);
        const nb_cloud_sight sight = {(float)cosine, (float)direction[1], (float)ray.sun};
        double radiance = 0;
        const double step = depth / out / STEPS, apart = (double)ray.apart[0];
        for (int k = 0; k < STEPS; k++) {
            const double way = (k + .5) * step, x = is_above ? way * out : depth - way * out;
            const nb_cloud_depths depths = {(float)(x / cosine), (float)((depth - x) / cosine), (float)x,
                                            (float)(depth - x)};
            const nb_cloud_irradiance parts = nb_cloud_parts_of(layer, &depths, &sight);
            const nb_cloud_source s = nb_cloud_source_of(&ray, 0, &parts, &white);
            radiance += step * exp(-apart * way) * (double)s.often[1];
            if (is_above) radiance += step * exp(-way) * (double)s.once[1];
        }
        sum += radiance * out * 2 * PI / (EYES * TURNS);
    }
    return sum / cosine;
}

static void test_light_of_slabs(void **state)
{
    (void)state;
    static const struct {
        double depth, cosine;
    } slabs[] = {{1, 1}, {4, 1}, {16, 1}, {64, 1}, {2, .342}, {4, .5}, {16, .5}, {64, .5}, {16, .2}};
    nebel_clouds *clouds = make(
        1,
        (const nebel_cloud_layer[]){{.type = NEBEL_CLOUD_STRATUS, .coverage = 1, .droplet_diameter = 20, .seed = 1}});
    nebel_cloud_workspace *workspace;
    nebel_cloud_lighting *view = view_of(clouds, 0, &workspace);
    const double apart = (double)clouds->layers[0].apart;
    double turns[SLAB_PARTS + 1];
    uint64_t numbers = 5;
    slab_invert(&clouds->layers[0].phase, turns);
    print_message("light of slabs\n depth  cosine  up by paths       up  through  down\n");
    for (size_t i = 0; i < sizeof slabs / sizeof *slabs; i++) {
        enum { PATHS = 40000 };
        const double depth = slabs[i].depth, cosine = slabs[i].cosine;
        const double truth = reflected_by_paths(depth, cosine, turns, PATHS, &numbers);
        const double deviation = sqrt(truth * (1 - truth) / PATHS);
        const double up = sent_by_model(view, depth, cosine, 1),
                     down = sent_by_model(view, depth, cosine, 0) + exp(-apart * depth / cosine);
        const double through = (double)nb_cloud_part_through(&clouds->layers[0], (float)(depth / cosine), cosine);
        print_message("%6g  %6g  %11.4f  %7.4f  %7.4f  %.4f\n", depth, cosine, truth, up, through, down);
        assert_near(up, truth, .01 + 3 * deviation);
        assert_near(through, 1 - truth, .005 + 3 * deviation);
        assert_near(up + down, 1, .01);
    }
    nebel_destroy_cloud_workspace(workspace);
    nebel_destroy_cloud_lighting(view);
    nebel_destroy_clouds(clouds);
}

/* As of a piece of a ray. */
static float sun_depth_of(nebel_cloud_workspace *workspace, const double place[3], const nb_cloud_resolution *grain)
{
    nb_cloud_depth_query asked = {.place = {place[0], place[1], place[2]}, .grain = *grain};
    nb_cloud_find_depths(workspace, 1, &asked);
    return asked.depths.sun;
}

/* What comes straight from the sun to places in clouds, by lattices, by what light of pieces of rays uses, and by steps of
 * two metres. */
static void test_ways_to_the_sun(void **state)
{
    (void)state;
    enum { PLACES = 400 };
    nebel_clouds *clouds = make(1, (const nebel_cloud_layer[]){{.extinction = .005, .coverage = .6}});
    nebel_cloud_workspace *workspace;
    nebel_cloud_lighting *view = view_of(clouds, 0, &workspace);
    const double *sun = view->sun.direction;
    const nb_cloud_resolution grain = {.width = 6, .first = 16, .wide = 100};
    uint64_t numbers = 17;
    double sum[2] = {0, 0}, bias[2] = {0, 0};
    int between = 0;
    for (int i = 0; i < PLACES; i++) {
        const double x = dice(&numbers, -5e3, 5e3), z = dice(&numbers, -5e3, 5e3), y = dice(&numbers, 1000, 2000);
        const nebel_ray ray = {{x, y, z}, {sun[0], sun[1], sun[2]}, HUGE_VAL};
        const double from[3] = {x, y + RADIUS, z};
        const double truth = brute_force(clouds, &ray, 0, (2720 - y) / sun[1], 2);
        const double left[2] = {exp(-(double)nb_cloud_sun_depth_at(workspace, from, 25)),
                                exp(-(double)sun_depth_of(workspace, from, &grain))};
        for (int k = 0; k < 2; k++) {
            sum[k] += fabs(left[k] - truth) / PLACES;
            bias[k] += (left[k] - truth) / PLACES;
        }
        between += truth > .02 && truth < .98;
    }
    for (int k = 0; k < 2; k++) {
        print_message(
            "sunlight at %d places, %d of them in part in shadow, %s: off by %.2g in the mean, all together by "
            "%.2g\n",
            PLACES, between, k == 0 ? "by lattices" : "as of pieces", sum[k], bias[k]);
        assert_true(between > PLACES / 12 && sum[k] < .006 && fabs(bias[k]) < .002);
    }
    nebel_destroy_cloud_workspace(workspace);
    nebel_destroy_cloud_lighting(view);
    nebel_destroy_clouds(clouds);
}

/* A sun just below level is seen over the planet's bulge: through the layer, under it, and through it again. */
static void test_ways_to_a_sun_below_level(void **state)
{
    (void)state;
    nebel_clouds *clouds =
        make(1, (const nebel_cloud_layer[]){
                    {.type = NEBEL_CLOUD_STRATUS, .base = 400, .top = 1000, .extinction = 4e-5, .coverage = 1}});
    const nebel_cloud_lighting_desc desc = {
        .clouds = clouds, .sun = {.direction = {1, -.015, 0}, .irradiance = {5, 4, 3}}, .tolerance = 1e-3};
    nebel_cloud_lighting *view;
    nebel_cloud_workspace *workspace;
    assert_int_equal(nebel_create_cloud_lighting(&desc, &view), NEBEL_OK);
    assert_int_equal(nebel_create_cloud_workspace(view, &workspace), NEBEL_OK);
    const double *sun = view->sun.direction;
    for (int i = 0; i < 8; i++) {
        const double z = 3e3 * i, from[3] = {0, 900 + RADIUS, z};
        const nebel_ray ray = {{0, 900, z}, {sun[0], sun[1], sun[2]}, HUGE_VAL};
        const double first = -log(brute_force(clouds, &ray, 0, 95e3, 20)),
                     truth = first - log(brute_force(clouds, &ray, 95e3, 260e3, 20));
        const double near = (double)sun_depth_of(workspace, from, &(nb_cloud_resolution){6, 16, 100, 0}),
                     far = (double)nb_cloud_sun_depth_at(workspace, from, 100);
        if (i == 0)
            print_message(
                "to a sun below level: depth %.3g, of it %.3g before the bulge; as of pieces %.3g, by lattices "
                "%.3g\n",
                truth, first, near, far);
        assert_true(truth > 1.5 * first);
        assert_near(near, truth, .03 * truth);
        assert_near(far, truth, .03 * truth);
    }
    nebel_destroy_cloud_workspace(workspace);
    nebel_destroy_cloud_lighting(view);
    nebel_destroy_clouds(clouds);
}

/* 0 where more than a twentieth is seen through clouds. */
static double light_of_opaque(nebel_cloud_workspace *workspace, const nebel_ray *ray, double spread)
{
    nebel_cloud_transfer nodes;
    assert_int_equal(nebel_trace_clouds(workspace, 1, ray, 0, spread, NULL, &nodes, 0), NEBEL_OK);
    return nodes.count > 0 && nodes.transmittance[nodes.count - 1] < .05f
               ? (double)nodes.in_scattering[nodes.count - 1][1]
               : 0;
}

/* Mean of rays thinner by far within a pixel, or 0. */
static double light_of_thin(nebel_cloud_workspace *workspace, double height, double x, double z, double spread)
{
    enum { SIDE = 4 };
    double sum = 0;
    for (int i = 0; i < SIDE * SIDE; i++) {
        const double a = x + spread * ((i % SIDE + .5) / SIDE - .5), b = z + spread * ((i / SIDE + .5) / SIDE - .5);
        const nebel_ray ray = {{0, height, 0}, {a, -1, b}, HUGE_VAL};
        const double light = light_of_opaque(workspace, &ray, 1e-5);
        if (!(light > 0)) return 0;
        sum += light / (SIDE * SIDE);
    }
    return sum;
}

/* Pixels that are narrow beside flat heaps and wide beside their height have the light of thin rays within them: nodes as far apart as
 * they are wide made contour lines. */
static void test_light_of_flat_heaps(void **state)
{
    (void)state;
    static const struct {
        nebel_cloud_layer layer;
        double height;
    } cases[] = {
        {{.cell_size = 5e4, .coverage = .6, .erosion = NEBEL_ZERO}, 1e6},
        {{.cell_size = 5e4, .coverage = .6}, 1e6},
        {{.cell_size = 1e4, .coverage = .6}, 1e5},
        {{.base = 900, .top = 1200, .extinction = .2, .coverage = .6}, 2e4},
    };
    const double spread = 3e-3;
    uint64_t numbers = 29;
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        nebel_clouds *clouds = make(1, &cases[i].layer);
        nebel_cloud_workspace *workspace;
        nebel_cloud_lighting *view = view_of(clouds, 0, &workspace);
        double sum = 0, squares = 0;
        int count = 0;
        for (int k = 0; k < 500; k++) {
            const double x = dice(&numbers, -.2, .2), z = dice(&numbers, -.2, .2);
            const nebel_ray ray = {{0, cases[i].height, 0}, {x, -1, z}, HUGE_VAL};
            const double light = light_of_opaque(workspace, &ray, spread);
            const double thin = light > 0 ? light_of_thin(workspace, cases[i].height, x, z, spread) : 0;
            if (!(thin > 0)) continue;
            sum += thin;
            squares += (light - thin) * (light - thin);
            count++;
        }
        const double off = sqrt(squares / count) * count / sum;
        print_message("%d pixels of flat heaps from %.0f km: off light of thin rays by %.3f of it\n", count,
                      1e-3 * cases[i].height, off);
        assert_true(count > 50 && off < .18);
        nebel_destroy_cloud_workspace(workspace);
        nebel_destroy_cloud_lighting(view);
        nebel_destroy_clouds(clouds);
    }
}

static double light_down(nebel_cloud_workspace *workspace, double x, double width)
{
    const nebel_ray ray = {{x, 1e5, 7e3}, {0, -1, 0}, HUGE_VAL};
    return light_of_opaque(workspace, &ray, 1e-5 * width);
}

/* Flat heaps show the light of thin rays to pixels that do not hide them, from 110 m on without lattices; it does not jump as pixels
 * grow. */
static void test_light_as_pixels_grow(void **state)
{
    (void)state;
    nebel_clouds *clouds =
        make(1, (const nebel_cloud_layer[]){{.cell_size = 5e4, .coverage = .9, .erosion = NEBEL_ZERO}});
    nebel_cloud_workspace *workspace;
    nebel_cloud_lighting *view = view_of(clouds, 0, &workspace);
    double jump = 0, off = 0;
    int count = 0;
    for (int i = 0; i < 24; i++) {
        const double x = 18.5e3 * i, thin = light_down(workspace, x, 1);
        double last = light_down(workspace, x, 30);
        if (!(thin > 0)) continue;
        count++;
        for (double width = 30; width < 1400; width *= 1.01) {
            const double light = light_down(workspace, x, width);
            jump = fmax(jump, fabs(light / last - 1));
            if (width > 110) off = fmax(off, fabs(light / thin - 1));
            last = light;
        }
    }
    print_message(
        "%d places in flat heaps: light off that of thin rays by %.3f of it at most, off that of pixels a hundredth "
        "narrower by %.3f\n",
        count, off, jump);
    assert_true(count > 12 && off < .2 && jump < .1);
    nebel_destroy_cloud_workspace(workspace);
    nebel_destroy_cloud_lighting(view);
    nebel_destroy_clouds(clouds);
}

/* Pieces of rays hide thousands of optical depths: nothing comes through, not even as the smallest number. */
static void test_light_of_dense_clouds(void **state)
{
    (void)state;
    static const double denser[] = {20, 200, 1000};
    for (int d = 0; d < 3; d++) {
        nebel_clouds *clouds =
            make(1, (const nebel_cloud_layer[]){
                        {.type = NEBEL_CLOUD_STRATUS, .base = 500, .top = 600, .extinction = denser[d]}});
        nebel_cloud_workspace *workspace;
        nebel_cloud_lighting *view = view_of(clouds, 0, &workspace);
        uint64_t numbers = 5;
        int opaque = 0;
        for (int i = 0; i < 2000; i++) {
            const double down = dice(&numbers, .01, .5), turn = dice(&numbers, -PI, PI), level = sqrt(1 - down * down);
            const nebel_ray ray = {{0, 3000, 0}, {level * sin(turn), -down, level * cos(turn)}, HUGE_VAL};
            nebel_cloud_transfer nodes;
            assert_int_equal(nebel_trace_clouds(workspace, 1, &ray, 0, .01, NULL, &nodes, 0), NEBEL_OK);
            for (uint32_t k = 0; k < nodes.count; k++)
                for (int c = 0; c < 3; c++)
                    assert_true(isfinite(nodes.in_scattering[k][c]) && nodes.in_scattering[k][c] >= 0);
            if (nodes.count == 0 || nodes.transmittance[nodes.count - 1] > .01f) continue;
            opaque++;
            assert_true(nodes.in_scattering[nodes.count - 1][1] > .05f && nodes.error < 2);
        }
        assert_true(opaque > 1000);
        nebel_destroy_cloud_workspace(workspace);
        nebel_destroy_cloud_lighting(view);
        nebel_destroy_clouds(clouds);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_light_of_slabs),
        cmocka_unit_test(test_ways_to_the_sun),
        cmocka_unit_test(test_ways_to_a_sun_below_level),
        cmocka_unit_test(test_light_of_flat_heaps),
        cmocka_unit_test(test_light_as_pixels_grow),
        cmocka_unit_test(test_light_of_dense_clouds),
    };
    return cmocka_run_group_tests(tests, make_air, free_air);
}
