/* The air of planets: T12, T13, T30, T31, T40 and T41 of the collected physics, the furnace, and bad input. */
#include <nebel/planet.h>

#include "atmosphere/atmosphere.h"
#include "atmosphere/ray_quadrature.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#define NB_DOUBLE
#include "formulas/prelude.h"

#include "formulas/elementary.inc"
#include "formulas/atmosphere.inc"

#include "scarce_memory.h"
#include "unit.h"

#define PI 3.14159265358979323846
#define DEGREES (PI / 180)

static void expect_near(const char *what, double got, double wanted, double relative)
{
    if (!(fabs(got - wanted) <= relative * fabs(wanted))) fail_msg("%s: %.12g; it should be %.12g", what, got, wanted);
}

/* ---- optical depth --------------------------------------------------------------------------- */

/* One kind of air that takes 1/m at the ground. */
static nb_air_components make_airs(double radius, double top, double scale)
{
    return (nb_air_components){
        .radius = radius, .top = top, .airs = {{.extinction = {1, 1, 1}, .scale = scale}}, .count = 1};
}

static nb_atmosphere_ray track_from(double radius, double zenith)
{
    return (nb_atmosphere_ray){radius, radius * cos(zenith * DEGREES)};
}

/* Chapman's function at X: e^-height over a planet whose radius is X scale heights. Below the horizon T12 counts as if
 * the air went on into the ground. */
static double chapman(double x, double angle)
{
    const double cosine = cos(angle * DEGREES), lowest = x * sin(angle * DEGREES);
    if (cosine >= 0) return nb_air_length(x, x * cosine, 1, 1e12);
    return 2 * exp(x - lowest) * nb_air_length(lowest, 0, 1, 1e12) - nb_air_length(x, -x * cosine, 1, 1e12);
}

static void chapman_is_that_of_T12(void **state)
{
    (void)state;
    static const double angles[] = {0, 30, 60, 75, 85, 90, 92};
    static const struct {
        double x, values[7];
    } rows[] = {{50,
                 {1, 1.147557389503968, 1.901410753767386, 3.228210295964845, 5.82441153461427, 8.92832792794078,
                  10.98253507520586}},
                {200,
                 {1, 1.152813475785078, 1.97164833800908, 3.639793369877136, 8.27681695528619, 17.75772031700074,
                  27.62785973729099}},
                {795,
                 {1, 1.154218805988315, 1.992564113614203, 3.799511552787073, 10.13831325324861, 35.35478740004325,
                  96.07018359541071}},
                {1000,
                 {1, 1.154317169140512, 1.994070666833737, 3.812137613526903, 10.35179932774321, 39.64813081296021,
                  126.1046023107734}},
                {5300,
                 {1, 1.154627970454929, 1.998870478574592, 3.853634264529489, 11.20971931867749, 91.24910192149449,
                  4580.251729695695}}};
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++)
        for (int k = 0; k < 7; k++) expect_near("Chapman", chapman(rows[i].x, angles[k]), rows[i].values[k], 4e-9);
}

static void lengths_are_those_of_T13(void **state)
{
    (void)state;
    static const double rows[][5] = {
        {8, 0, 0, 100, 7.999970186774623},
        {8, 0, 60, 195.5592129305035, 15.94045603926011},
        {8, 0, 85, 706.3480964018881, 81.10635762834525},
        {8, 0, 90, 1132.254388377453, 282.8381350729285},
        {8, 10, 95, 129.8267670070311, 76.1184334348113},
        {8, 1, 91, 1243.093940244648, 388.0146601597486},
        {1.2, 0, 0, 100, 1.2},
        {1.2, 0, 60, 195.5592129305035, 2.398644574289511},
        {1.2, 0, 85, 706.3480964018881, 13.45166318241299},
        {1.2, 0, 90, 1132.254388377453, 109.4989223057934},
        {1.2, 10, 95, 129.8267670070311, 17.26555231138646},
        {1.2, 1, 91, 1243.093940244648, 191.629293746838},
    };
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        const double *row = rows[i];
        const nb_air_components airs = make_airs(6360, 6460, row[0]);
        const nb_atmosphere_ray track = track_from(6360 + row[1], row[2]);
        const double end = fmin(nb_atmosphere_ray_enter(track, airs.radius), nb_atmosphere_ray_leave(track, airs.top));
        double depth[3];
        nb_atmosphere_ray_depth(&airs, track, end, depth);
        expect_near("way", end, row[3], 1e-10);
        expect_near("length", depth[0], row[4], 4e-9);
    }
}

/* Any piece of a ray is what both of its halves are. */
static void pieces_add_up(void **state)
{
    (void)state;
    nb_air_components airs = make_airs(6360, 6460, 8);
    airs.airs[1] = (nb_air_component){.extinction = {2, 0, 1}, .center = 25, .width = 15};
    airs.count = 2;
    for (int i = 0; i < 1000; i++) {
        const nb_atmosphere_ray track = track_from(6361 + 97.0 * (i % 17) / 17, 93.0 * (i % 31) / 31);
        const double end = fmin(nb_atmosphere_ray_enter(track, airs.radius), nb_atmosphere_ray_leave(track, airs.top));
        const double cut = end * (i % 13) / 13;
        double whole[3], first[3], rest[3];
        nb_atmosphere_ray_depth(&airs, track, end, whole);
        nb_atmosphere_ray_depth(&airs, track, cut, first);
        nb_atmosphere_ray_depth(&airs, nb_atmosphere_ray_ahead(track, cut), end - cut, rest);
        for (int c = 0; c < 3; c++)
            if (whole[c] > 0) expect_near("sum", first[c] + rest[c], whole[c], c == 1 ? 4e-9 : 2e-5);
    }
}

static nebel_atmosphere *make(const nebel_atmosphere_desc *desc)
{
    nebel_atmosphere *atmosphere = NULL;
    assert_int_equal(nebel_create_atmosphere(desc, &atmosphere), NEBEL_OK);
    return atmosphere;
}

static nebel_transfer trace(const nebel_atmosphere *atmosphere, const nebel_sun *sun, nebel_ray ray)
{
    nebel_transfer transfer;
    assert_int_equal(nebel_trace_atmosphere(atmosphere, sun, 1, &ray, 0, &transfer, 0), NEBEL_OK);
    return transfer;
}

static void transmittance_is_that_of_T30(void **state)
{
    (void)state;
    static const struct {
        double height, zenith, left[3];
    } rows[] = {{0, 0, {0.940358750533824, 0.8676155338551916, 0.7623099761372377}},
                {0, 60, {0.8847836305216896, 0.753857873568479, 0.5822823929955865}},
                {0, 80, {0.7129408349046308, 0.45937850094540184, 0.22162743186558614}},
                {0, 85, {0.5436440049996943, 0.24946636541070918, 0.06362829520185741}},
                {0, 89, {0.22617603357496321, 0.03923721879735659, 0.0010945432827706909}},
                {0, 90, {0.10642949387218092, 0.00957975569921481, 5.207093553721818e-05}},
                {10, 90, {0.5337529126605932, 0.21129856810545702, 0.06686940936695239}},
                {10, 92, {0.2419706064641268, 0.03397747215487229, 0.0006590211656675128}},
                {2, 45, {0.9359246538814264, 0.8517230142965991, 0.7449021300051336}}};
    nebel_atmosphere *earth = make(nebel_lookup_atmosphere("earth"));
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        const double angle = rows[i].zenith * DEGREES;
        const nebel_ray ray = {{0, 1e3 * rows[i].height, 0}, {sin(angle), cos(angle), 0}, (double)INFINITY};
        const nebel_transfer transfer = trace(earth, NULL, ray);
        for (int c = 0; c < 3; c++) {
            expect_near("transmittance", transfer.transmittance[c], rows[i].left[c], 1e-6);
            assert_true(transfer.in_scattering[c] == 0);
        }
    }
    nebel_destroy_atmosphere(earth);
}

/* The part of light, scattered alike to all sides, that is scattered again before it leaves or meets the ground. */
static void gain_is_that_of_T31(void **state)
{
    (void)state;
    static const double rows[][4] = {{10, 0.08184176779694083, 0.14650410522771493, 0.25042832065092446},
                                     {1000, 0.09391954466598366, 0.16878565493378345, 0.296771255787103},
                                     {10000, 0.09454518608437013, 0.17501879121877703, 0.32030411574217416},
                                     {50000, 0.06237947042135505, 0.10835963614682466, 0.21987139072115106}};
    nebel_atmosphere *earth = make(nebel_lookup_atmosphere("earth"));
    const nb_air_components *airs = &earth->airs;
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        const double radius = airs->radius + rows[i][0], horizon = -sqrt(1 - pow(airs->radius / radius, 2));
        double sum[3] = {0, 0, 0};
        for (int k = 0; k < 2 * 8 * 16; k++) { /* from the horizon up and down, denser near it */
            const nb_gauss_rule *rule = &earth->rule;
            const double part = (k / 16 + 0.5 * (1 + rule->nodes[k % 8])) / 16,
                         span = k % 16 < 8 ? 1 - horizon : -1 - horizon;
            const double weight = 0.5 / 16 * rule->weights[k % 8] * 3 * part * part * fabs(span);
            const nb_atmosphere_ray track = {radius, radius * (horizon + span * part * part * part)};
            nb_ray_nodes path;
            nb_ray_nodes_lay(
                airs, NULL, rule, track,
                fmin(nb_atmosphere_ray_enter(track, airs->radius), nb_atmosphere_ray_leave(track, airs->top)), 0, NULL,
                &path);
            for (int n = 0; n < path.count; n++)
                for (int c = 0; c < 3; c++) {
                    const double scattering = airs->airs[0].scattering[c] * path.density[0][n] +
                                              airs->airs[1].scattering[c] * path.density[1][n];
                    sum[c] += 0.5 * weight * path.weight[n] * path.transmittance[c][n] * scattering;
                }
        }
        for (int c = 0; c < 3; c++) expect_near("gain", sum[c], rows[i][1 + c], 1e-4);
    }
    nebel_destroy_atmosphere(earth);
}

/* ---- scattered light ------------------------------------------------------------------------- */

/* Scattered once, of green (1) or another colour. */
static double gather(const nebel_atmosphere *atmosphere, double height, double zenith, double sun, int c)
{
    const nb_atmosphere_ray track = track_from(atmosphere->airs.radius + height, zenith);
    const double end = fmin(nb_atmosphere_ray_enter(track, atmosphere->airs.radius),
                            nb_atmosphere_ray_leave(track, atmosphere->airs.top));
    const nb_moment_basis aspect = {cos(zenith * DEGREES), cos((zenith - sun) * DEGREES), cos(sun * DEGREES)};
    nb_in_scattered gathered;
    double once[3];
    nb_gather(atmosphere, &atmosphere->rule, track, aspect, 1, &end, &gathered);
    nb_gathered_once(atmosphere, &gathered, aspect.sun, once);
    return once[c];
}

/* Bruneton's cases that have closed forms, on his small planet; without the phase function. */
static void light_is_that_of_T40(void **state)
{
    (void)state;
    nebel_atmosphere_desc desc = {
        .radius = 1e6,
        .thickness = 5e5,
        .components = {{.scattering = {1e-6, 1e-6, 1e-6}, .scale_height = 6e4},
                       {.scattering = {0, 1.5e-6, 0}, .absorption = {0, 0.5e-6, 2e-6}, .scale_height = 3e4}},
        .component_count = 2};
    nebel_atmosphere *small = make(&desc);
    const nb_atmosphere_ray level = {1.4e6, 0}, up = {1.4e6, 1.4e6};
    double depth[3];
    expect_near("up", nb_atmosphere_ray_leave(up, small->airs.top), 1e5, 1e-12);
    expect_near("level", nb_atmosphere_ray_leave(level, small->airs.top), 538516.4807134504, 1e-12);
    nb_atmosphere_ray_depth(&small->airs, up, 1e5, depth);
    expect_near("length", depth[0] / 1e-6, 61.93585949521763, 1e-8);
    expect_near("both", 4 * PI * gather(small, 0, 0, 0, 1), 0.05320320237142445 + 0.039911993097991726, 1e-6);
    expect_near("Rayleigh", 4 * PI * gather(small, 0, 0, 0, 2), 0.05320320237142445, 1e-6);
    expect_near("from above", 4 * PI * gather(small, 5e5, 180, 0, 0), 0.05652699014088097, 1e-6);
    nebel_destroy_atmosphere(small);
    desc.components[0] = (nebel_atmosphere_component){
        .absorption = {1.2e-6}, .profile = NEBEL_COMPONENT_TENT, .center_height = 2.5e5, .half_width = 2.5e5};
    desc.components[1] = (nebel_atmosphere_component){.scattering = {0, 1e-6, 0}, .scale_height = 1e15};
    nebel_atmosphere *odd = make(&desc);
    nb_atmosphere_ray_depth(&odd->airs, (nb_atmosphere_ray){1e6, 1e6}, 5e5, depth);
    expect_near("layer", exp(-depth[0]), 0.7408182206817179, 1e-9);
    nb_atmosphere_ray_depth(&odd->airs, level, 538516.4807134504, depth);
    expect_near("even", exp(-depth[1]), 0.5836134122275815, 1e-8);
    nebel_destroy_atmosphere(odd);
}

static const nebel_atmosphere_desc measured = {.radius = 6.36e6,
                                               .thickness = 6e4,
                                               .components = {{.scattering = {5.80234e-6, 13.55776e-6, 33.10001e-6},
                                                               .phase = {.type = NEBEL_PHASE_RAYLEIGH},
                                                               .scale_height = 8000},
                                                              {.scattering = {3.996e-6, 3.996e-6, 3.996e-6},
                                                               .absorption = {0.444e-6, 0.444e-6, 0.444e-6},
                                                               .phase = {.type = NEBEL_PHASE_CORNETTE_SHANKS, .g = 0.8},
                                                               .scale_height = 1200},
                                                              {.absorption = {0.6497166e-6, 1.8809e-6, 0.08501668e-6},
                                                               .profile = NEBEL_COMPONENT_TENT,
                                                               .center_height = 25000,
                                                               .half_width = 15000}},
                                               .component_count = 3,
                                               .ground_albedo = {0.1, 0.1, 0.1}};

/* View's zenith, azimuth from the sun, the sun's zenith, height [km]; once and all orders for red, green and blue. */
static const double skies[][10] = {
    {0, 0, 30, 0, 5.5267e-3, 1.06077e-2, 2.1428e-2, 6.408e-3, 1.3134e-2, 3.032e-2},
    {0, 0, 80, 0, 2.3556e-3, 4.0925e-3, 7.1744e-3, 2.753e-3, 5.289e-3, 1.1524e-2},
    {60, 180, 60, 0, 6.1458e-3, 1.21793e-2, 2.2922e-2, 7.551e-3, 1.6392e-2, 3.743e-2},
    {60, 0, 45, 0, 1.90861e-2, 2.8106e-2, 4.5262e-2, 2.0808e-2, 3.3053e-2, 6.185e-2},
    {85, 90, 85, 0, 1.5207e-2, 1.5720e-2, 9.4888e-3, 1.8496e-2, 2.2052e-2, 2.0703e-2},
    {80, 180, 88, 0, 1.4227e-2, 1.2390e-2, 8.602e-3, 1.5889e-2, 1.5019e-2, 1.3690e-2},
    {0, 0, 60, 10, 9.540e-4, 2.1004e-3, 5.0336e-3, 1.1192e-3, 2.6177e-3, 7.176e-3},
    {120, 90, 45, 30, 2.3913e-2, 2.5179e-2, 3.1942e-2, 2.6427e-2, 3.1098e-2, 4.9953e-2},
};

/* Where a ray meets the ground the truth has the ground's light, too: once of the sun, else of the sky as well. */
static void add_ground(const nebel_atmosphere *atmosphere, const nebel_sun *sun, const nebel_ray *ray,
                       const nebel_transfer *transfer, double once[3], double all[3])
{
    const double radius = atmosphere->airs.radius, height = ray->origin[1];
    const nb_atmosphere_ray track = {radius + height, (radius + height) * ray->direction[1]};
    const double way = nb_atmosphere_ray_enter(track, radius);
    if (!(way < HUGE_VAL)) return;
    double place[3], up[3], cosine = 0;
    for (int c = 0; c < 3; c++) {
        place[c] = ray->origin[c] + way * ray->direction[c];
        up[c] = (place[c] + (c == 1 ? radius : 0)) / radius;
        cosine += up[c] * sun->direction[c];
    }
    nebel_irradiance arrives;
    assert_int_equal(nebel_compute_atmosphere_irradiance(atmosphere, sun, 1, (const double(*)[3])place, 0, &arrives, 0),
                     NEBEL_OK);
    for (int c = 0; c < 3; c++) {
        once[c] += transfer->transmittance[c] * 0.1 / PI * cosine * arrives.sun[c];
        all[c] += transfer->transmittance[c] * 0.1 / PI * (cosine * arrives.sun[c] + arrives.sky[c]);
    }
}

static void skies_are_those_of_T41(void **state)
{
    (void)state;
    for (int quality = 0; quality < NEBEL_ATMOSPHERE_QUALITY_COUNT; quality++) {
        nebel_atmosphere_desc desc = measured;
        double worst_once = 0, worst = 0, worst_told = 0;
        desc.quality = (nebel_atmosphere_quality)quality;
        nebel_atmosphere *earth = make(&desc);
        for (size_t i = 0; i < sizeof skies / sizeof *skies; i++) {
            const double *row = skies[i];
            const double zenith = row[0] * DEGREES, azimuth = row[1] * DEGREES, low = row[2] * DEGREES;
            const nebel_sun sun = {.direction = {sin(low), cos(low), 0}, .irradiance = {1, 1, 1}};
            const nebel_ray ray = {{0, 1e3 * row[3], 0},
                                   {sin(zenith) * cos(azimuth), cos(zenith), sin(zenith) * sin(azimuth)},
                                   (double)INFINITY};
            const nebel_transfer transfer = trace(earth, &sun, ray);
            const nb_atmosphere_ray track = {earth->airs.radius + ray.origin[1],
                                             (earth->airs.radius + ray.origin[1]) * cos(zenith)};
            const double cosine = ray.direction[0] * sun.direction[0] + ray.direction[1] * sun.direction[1];
            nb_in_scattered gathered;
            const double end = fmin(nb_atmosphere_ray_enter(track, earth->airs.radius),
                                    nb_atmosphere_ray_leave(track, earth->airs.top));
            double once[3];
            nb_gather(earth, &earth->rule, track, (nb_moment_basis){cos(zenith), cosine, cos(low)}, 1, &end, &gathered);
            nb_gathered_once(earth, &gathered, cosine, once);
            double all[3];
            memcpy(all, transfer.in_scattering, sizeof all);
            add_ground(earth, &sun, &ray, &transfer, once, all);
            for (int c = 0; c < 3; c++) {
                worst_once = fmax(worst_once, fabs(once[c] / row[4 + c] - 1));
                worst = fmax(worst, fabs(all[c] / row[7 + c] - 1));
                /* Of the truth 4 standard errors of 8e-4 are not known. */
                worst_told = fmax(worst_told, (fabs(all[c] - row[7 + c]) - 3.2e-3 * row[7 + c]) / transfer.error);
            }
        }
        print_message("quality %d: once %.2e off, all orders %.2e, %.2f of the error told\n", quality, worst_once,
                      worst, worst_told);
        assert_true(worst_once <= 2e-3 && worst <= (quality == NEBEL_ATMOSPHERE_PRECISE ? 0.01 : 0.03) &&
                    worst_told <= 1);
        nebel_destroy_atmosphere(earth);
    }
}

/* Behind the terminator what counts is light from near the horizon: both qualities see the same of it. */
static void twilights_agree(void **state)
{
    (void)state;
    static const double depths[] = {3, 5, 7, 10}, most[] = {0.025, 0.05, 0.1, 0.3};
    static const double views[][2] = {{0, 0}, {60, 0}, {60, 180}, {80, 0}, {85, 0}, {80, 180}, {85, 90}, {88, 0}};
    nebel_atmosphere_desc desc = *nebel_lookup_atmosphere("earth");
    nebel_atmosphere *const fast = make(&desc);
    desc.quality = NEBEL_ATMOSPHERE_PRECISE;
    nebel_atmosphere *const precise = make(&desc);
    for (int s = 0; s < 4; s++) {
        double worst = 0;
        for (int i = 0; i < 16; i++) {
            const double zenith = views[i / 2][0] * DEGREES, turn = views[i / 2][1] * DEGREES,
                         low = (90 + depths[s]) * DEGREES;
            const nb_atmosphere_ray track = track_from(fast->airs.radius + (i % 2 ? 1e4 : 10), views[i / 2][0]);
            const double end = nb_atmosphere_ray_leave(track, fast->airs.top);
            const nb_moment_basis aspect = {cos(zenith), sin(zenith) * cos(turn) * sin(low) + cos(zenith) * cos(low),
                                            cos(low)};
            nb_in_scattered a, b;
            nb_gather(fast, &fast->rule, track, aspect, 1, &end, &a);
            nb_gather(precise, &precise->rule, track, aspect, 1, &end, &b);
            double once[3];
            nb_gathered_once(precise, &b, aspect.sun, once);
            for (int c = 0; c < 3; c++) worst = fmax(worst, fabs(a.often[c] - b.often[c]) / (once[c] + b.often[c]));
        }
        print_message("sun %g degrees below the horizon: apart by %.3f of the light\n", depths[s], worst);
        assert_true(worst <= most[s]);
    }
    nebel_destroy_atmosphere(fast);
    nebel_destroy_atmosphere(precise);
}

/* Other airs: both qualities agree within what they say of themselves. */
static void qualities_agree(void **state)
{
    (void)state;
    static const char *const names[] = {"mars", "toy"};
    for (int n = 0; n < 2; n++) {
        nebel_atmosphere_desc desc = *nebel_lookup_atmosphere(names[n]);
        nebel_atmosphere *fast = make(&desc);
        desc.quality = NEBEL_ATMOSPHERE_PRECISE;
        nebel_atmosphere *precise = make(&desc);
        double worst = 0, most = 0;
        for (int i = 0; i < 400; i++) {
            const double zenith = PI * (i % 20 + 0.5) / 20, azimuth = PI * (i % 7) / 6,
                         low = 100 * DEGREES * (i / 20) / 19;
            const nebel_sun sun = {.direction = {sin(low), cos(low), 0}, .irradiance = {1, 1, 1}};
            const nebel_ray ray = {{0, desc.thickness * (i % 3) / 5, 0},
                                   {sin(zenith) * cos(azimuth), cos(zenith), sin(zenith) * sin(azimuth)},
                                   (double)INFINITY};
            const nebel_transfer a = trace(fast, &sun, ray), b = trace(precise, &sun, ray);
            for (int c = 0; c < 3; c++) {
                worst = fmax(worst, fabs(a.in_scattering[c] - b.in_scattering[c]) / (a.error + b.error));
                most = fmax(
                    most, a.error / fmax(1e-4, fmax(fmax(a.in_scattering[0], a.in_scattering[1]), a.in_scattering[2])));
            }
        }
        print_message("%s: apart by at most %.2f of both errors told; fast tells at most %.2f of the light\n", names[n],
                      worst, most);
        assert_true(worst <= 1);
        nebel_destroy_atmosphere(fast);
        nebel_destroy_atmosphere(precise);
    }
}

/* Air and ground that take nothing, in light from everywhere: everything looks alike. */
static void check_furnace(nebel_atmosphere_quality quality)
{
    enum { RINGS = 16, TURNS = 24 };
    const nebel_atmosphere_desc desc = {.radius = 6.36e6,
                                        .thickness = 1e5,
                                        .components = {{.scattering = {5.802e-6, 13.558e-6, 33.1e-6},
                                                        .phase = {.type = NEBEL_PHASE_RAYLEIGH},
                                                        .scale_height = 8000},
                                                       {.scattering = {4e-6, 4e-6, 4e-6},
                                                        .phase = {.type = NEBEL_PHASE_HENYEY_GREENSTEIN, .g = 0.5},
                                                        .scale_height = 1200}},
                                        .component_count = 2,
                                        .ground_albedo = {1, 1, 1},
                                        .quality = quality};
    /* From near the ground, from within the air, and from space: past the planet, to its edge, straight down. */
    static const double views[][2] = {{100, 0},   {100, 60},  {100, 85},  {100, 90},    {2e4, 93},  {2e4, 120},
                                      {2e4, 180}, {1e6, 119}, {1e6, 120}, {1e6, 120.3}, {1e6, 125}, {1e6, 180}};
    nebel_atmosphere *white = make(&desc);
    for (size_t i = 0; i < sizeof views / sizeof *views; i++) {
        const double angle = views[i][1] * DEGREES, height = views[i][0];
        const nebel_ray ray = {{0, height, 0}, {sin(angle), cos(angle), 0}, (double)INFINITY};
        const nb_atmosphere_ray track = {6.36e6 + height, (6.36e6 + height) * cos(angle)};
        const double way = nb_atmosphere_ray_enter(track, 6.36e6);
        double light[3] = {0, 0, 0}, ground[3] = {0, 0, 0};
        nebel_transfer clear = {.error = 0};
        for (int k = 0; k < RINGS * TURNS; k++) {
            const double z = 2 * (k / TURNS + 0.5) / RINGS - 1, turn = 2 * PI * (k % TURNS + 0.5) / TURNS,
                         weight = 4 * PI / (RINGS * TURNS);
            const nebel_sun sun = {.direction = {sqrt(1 - z * z) * cos(turn), z, sqrt(1 - z * z) * sin(turn)},
                                   .irradiance = {weight, weight, weight}};
            clear = trace(white, &sun, ray);
            for (int c = 0; c < 3; c++) light[c] += clear.in_scattering[c];
            if (!(way < HUGE_VAL)) continue;
            nebel_irradiance arrives;
            const double place[3] = {way * ray.direction[0], height + way * ray.direction[1], 0};
            const double up[2] = {place[0] / 6.36e6, 1 + place[1] / 6.36e6};
            const double cosine = fmax(0, up[0] * sun.direction[0] + up[1] * sun.direction[1]);
            assert_int_equal(
                nebel_compute_atmosphere_irradiance(white, &sun, 1, (const double(*)[3])place, 0, &arrives, 0),
                NEBEL_OK);
            for (int c = 0; c < 3; c++) ground[c] += (cosine * arrives.sun[c] + arrives.sky[c]) / PI;
        }
        for (int c = 0; c < 3; c++) {
            const double behind = way < HUGE_VAL ? ground[c] : 1;
            expect_near("white", light[c] + clear.transmittance[c] * behind, 1, 0.01);
        }
    }
    nebel_destroy_atmosphere(white);
}

static void a_furnace_stays_white(void **state)
{
    (void)state;
    check_furnace(NEBEL_ATMOSPHERE_FAST);
    check_furnace(NEBEL_ATMOSPHERE_PRECISE);
}

/* ---- odd places and bad input ---------------------------------------------------------------- */

static void odd_rays_have_answers(void **state)
{
    (void)state;
    const nebel_sun sun = {.direction = {0.6, 0.8, 0}, .irradiance = {1, 1, 1}};
    static const char *const names[] = {"earth", "mars", "toy"};
    for (int i = 0; i < 3; i++) {
        const nebel_atmosphere_desc *desc = nebel_lookup_atmosphere(names[i]);
        nebel_atmosphere *air = make(desc);
        const double radius = desc->radius, top = desc->thickness;
        const double places[][3] = {{0, 0, 0},       {0, -radius, 0}, {0, -radius / 2, 0}, {0, top, 0},
                                    {0, 2 * top, 0}, {0, 1e15, 0},    {1e15, 1e15, -1e15}, {radius, -radius, 0}};
        const double ways[][3] = {{0, 1, 0}, {0, -1, 0}, {1, 0, 0}, {1e-300, 0, 0}, {1e300, -1e300, 0}, {-1, -1, 1}};
        const double reach[] = {0, 1e-9, 1, 1e5, (double)INFINITY};
        for (int p = 0; p < 8; p++)
            for (int w = 0; w < 6; w++)
                for (int r = 0; r < 5; r++) {
                    nebel_ray ray = {.t_max = reach[r]};
                    memcpy(ray.origin, places[p], sizeof ray.origin);
                    memcpy(ray.direction, ways[w], sizeof ray.direction);
                    const nebel_transfer transfer = trace(air, &sun, ray);
                    for (int c = 0; c < 3; c++) {
                        assert_true(transfer.transmittance[c] >= 0 && transfer.transmittance[c] <= 1);
                        assert_true(transfer.in_scattering[c] >= 0 && transfer.in_scattering[c] < 1);
                        if (reach[r] == 0)
                            assert_true(transfer.transmittance[c] == 1 && transfer.in_scattering[c] == 0);
                    }
                    assert_true(transfer.error >= 0 && transfer.error < 1);
                }
        nebel_destroy_atmosphere(air);
    }
}

/* The centre is below the place at y. */
static void below_the_ground_is_on_it(void **state)
{
    (void)state;
    static const double depths[] = {1, 5e3, 3e6, 6.36e6};
    nebel_atmosphere *air;
    const nebel_sun sun = {.direction = {.3, .5, .1}, .irradiance = {1, 1, 1}};
    assert_int_equal(nebel_create_atmosphere(&(nebel_atmosphere_desc){0}, &air), NEBEL_OK);
    for (size_t k = 0; k < sizeof depths / sizeof *depths; k++) {
        const nebel_ray on = {{0, 0, 0}, {.2, 1, -.4}, HUGE_VAL};
        const nebel_ray below = {{0, -depths[k], 0}, {.2, 1, -.4}, HUGE_VAL};
        const double places[2][3] = {{0, 0, 0}, {0, -depths[k], 0}};
        nebel_transfer wanted, got;
        nebel_irradiance light[2];
        assert_int_equal(nebel_trace_atmosphere(air, &sun, 1, &on, 0, &wanted, 0), NEBEL_OK);
        assert_int_equal(nebel_trace_atmosphere(air, &sun, 1, &below, 0, &got, 0), NEBEL_OK);
        assert_int_equal(
            nebel_compute_atmosphere_irradiance(air, &sun, 2, places, sizeof *places, light, sizeof *light), NEBEL_OK);
        for (int c = 0; c < 3; c++) {
            expect_near("transmittance", got.transmittance[c], wanted.transmittance[c], 1e-9);
            expect_near("light", got.in_scattering[c], wanted.in_scattering[c], 1e-9);
            expect_near("sun", light[1].sun[c], light[0].sun[c], 1e-9);
            expect_near("sky", light[1].sky[c], light[0].sky[c], 1e-9);
        }
    }
    nebel_destroy_atmosphere(air);
}

static nebel_irradiance light_above(const nebel_atmosphere *air, const nebel_sun *sun, const double up[3],
                                    double height)
{
    nebel_irradiance light;
    double place[1][3], radius = air->airs.radius + height;
    for (int c = 0; c < 3; c++) place[0][c] = air->center[c] + radius * up[c];
    assert_int_equal(nebel_compute_atmosphere_irradiance(air, sun, 1, (const double(*)[3])place, 0, &light, 0),
                     NEBEL_OK);
    return light;
}

/* The sky is that of the ground below, whatever is between, and nothing changes suddenly where the air ends. */
static void light_goes_on_above_the_air(void **state)
{
    (void)state;
    static const char *const names[] = {"earth", "mars", "toy"};
    static const double up[3] = {.48, .6, -.64}, across[3] = {.8, 0, .6}, parts[] = {.999, 1, 1.001, 2, 1e3, 1e7};
    for (int n = 0; n < 3; n++) {
        nebel_atmosphere *air = make(nebel_lookup_atmosphere(names[n]));
        const double thickness = air->airs.top - air->airs.radius;
        double before = 0;
        for (int degrees = -20; degrees <= 90; degrees += 10) {
            const double x = cos(degrees * DEGREES), y = sin(degrees * DEGREES);
            const nebel_sun sun = {.direction = {x * across[0] + y * up[0], y * up[1], x * across[2] + y * up[2]},
                                   .irradiance = {1, 1, 1}};
            const nebel_irradiance ground = light_above(air, &sun, up, 0);
            const nebel_irradiance below = light_above(air, &sun, up, thickness * (1 - 1e-6));
            const nebel_irradiance above = light_above(air, &sun, up, thickness * (1 + 1e-6));
            for (int c = 0; c < 3; c++) {
                for (size_t k = 0; k < sizeof parts / sizeof *parts; k++)
                    expect_near("sky", light_above(air, &sun, up, parts[k] * thickness).sky[c], ground.sky[c], 1e-6);
                assert_true(fabs(above.sun[c] - below.sun[c]) <= 1e-4);
            }
            assert_true(ground.sky[1] > before);
            before = ground.sky[1];
        }
        nebel_destroy_atmosphere(air);
    }
}

/* The planet seen from 1e15 m away is the same as from close by. */
static void distance_changes_nothing(void **state)
{
    (void)state;
    nebel_atmosphere *earth = make(nebel_lookup_atmosphere("earth"));
    const nebel_sun sun = {.direction = {1, 0.2, 0}, .irradiance = {1, 1, 1}};
    for (int i = 0; i < 20; i++) {
        const double x = 6.4e6 * i / 19 + 1e4;
        const nebel_transfer near_by = trace(earth, &sun, (nebel_ray){{x, 1e6, 0}, {0, -1, 0}, (double)INFINITY});
        const nebel_transfer far_away = trace(earth, &sun, (nebel_ray){{x, 1e14, 0}, {0, -1, 0}, (double)INFINITY});
        for (int c = 0; c < 3; c++) {
            assert_true(fabs(near_by.transmittance[c] - far_away.transmittance[c]) <= 1e-5);
            assert_true(fabs(near_by.in_scattering[c] - far_away.in_scattering[c]) <= 1e-6);
        }
    }
    nebel_destroy_atmosphere(earth);
}

/* Light of a ray is that of its first part, and of the rest as the first part lets it through, but for what is told; and no horizon or
 * dusk is seen through what a ray ends at. */
static void rays_end_within_hazy_air(void **state)
{
    (void)state;
    static const char *const names[] = {"earth", "mars"};
    static const double most_of[] = {5e-3, 0.2};
    for (int n = 0; n < 2; n++) {
        const nebel_atmosphere_desc *known = nebel_lookup_atmosphere(names[n]);
        nebel_atmosphere *air = make(known);
        double worst = 0, told = 0, step = 0;
        for (int i = 0; i < 400; i++) {
            const double height = known->thickness * pow((i % 23 + 0.5) / 23, 2), up = (i % 19 - 9) / 9.5;
            const double turn = 2 * PI * (i % 31) / 31, low = (10 + 80.0 * (i % 29) / 29) * DEGREES;
            const double level = sqrt(1 - up * up), part = (i % 7 + 0.5) / 7;
            const nebel_sun sun = {.direction = {cos(low), sin(low), 0}, .irradiance = {1, 1, 1}};
            const nebel_ray ray = {
                {0, height, 0}, {level * cos(turn), up, level * sin(turn)}, known->thickness * pow(10, 2 * part - 1.5)};
            nebel_ray first = ray, rest = ray, near = {{0, 2, 0}, {cos(turn), 2e-3, sin(turn)}, 5e3};
            first.t_max = part * ray.t_max;
            rest.t_max = ray.t_max - first.t_max;
            for (int c = 0; c < 3; c++) rest.origin[c] += first.t_max * ray.direction[c];
            if (hypot(hypot(rest.origin[0], rest.origin[1] + known->radius), rest.origin[2]) < known->radius) continue;
            const nebel_transfer whole = trace(air, &sun, ray), a = trace(air, &sun, first), b = trace(air, &sun, rest);
            const nebel_transfer above = trace(air, &sun, near);
            near.direction[1] = -2e-4;
            const nebel_transfer below = trace(air, &sun, near);
            for (int c = 0; c < 3; c++) {
                const double off =
                    fabs(a.in_scattering[c] + a.transmittance[c] * b.in_scattering[c] - whole.in_scattering[c]);
                worst = fmax(worst, off / fmax(whole.in_scattering[c], 1e-3));
                told = fmax(told, off / (a.error + whole.error + a.transmittance[c] * b.error));
                step = fmax(step, fabs(above.in_scattering[c] - below.in_scattering[c]) / above.in_scattering[c]);
            }
        }
        print_message(
            "%s: parts add up but for %.1e of the light, %.2f of what is told; the horizon is a step of %.1e\n",
            names[n], worst, told, step);
        assert_true(worst < most_of[n] && told < 1 && step < 1e-2);
        nebel_destroy_atmosphere(air);
    }
}

static void expect_fault(const nebel_atmosphere_desc *desc)
{
    nebel_atmosphere *none = (nebel_atmosphere *)1;
    assert_int_equal(nebel_create_atmosphere(desc, &none), NEBEL_ERROR_VALUE);
    assert_null(none);
}

static void bad_numbers_are_refused(void **state)
{
    (void)state;
    static const double bad[] = {-1, 1e300, (double)NAN, (double)INFINITY, -(double)INFINITY};
    for (int i = 0; i < 5; i++) {
        const double x = bad[i];
        expect_fault(&(nebel_atmosphere_desc){.radius = x});
        expect_fault(&(nebel_atmosphere_desc){.thickness = x});
        expect_fault(&(nebel_atmosphere_desc){.ground_albedo = {0, x, 0}});
        if (i > 0) expect_fault(&(nebel_atmosphere_desc){.ground_point = {0, x, 0}});
        expect_fault(
            &(nebel_atmosphere_desc){.components = {{.scattering = {x}, .scale_height = 1e4}}, .component_count = 1});
        expect_fault(
            &(nebel_atmosphere_desc){.components = {{.absorption = {x}, .scale_height = 1e4}}, .component_count = 1});
        expect_fault(&(nebel_atmosphere_desc){.components = {{.scale_height = x}}, .component_count = 1});
    }
    expect_fault(&(nebel_atmosphere_desc){.components = {{.scale_height = 0}}, .component_count = 1});
    expect_fault(&(nebel_atmosphere_desc){.components = {{.profile = (nebel_component_profile)2, .scale_height = 1e4}},
                                          .component_count = 1});
    expect_fault(&(nebel_atmosphere_desc){.thickness = 1, .radius = 1e7});
    expect_fault(&(nebel_atmosphere_desc){.component_count = NEBEL_MAX_COMPONENTS + 1});
    expect_fault(&(nebel_atmosphere_desc){.quality = NEBEL_ATMOSPHERE_QUALITY_COUNT});
    nebel_atmosphere *earth = make(&(nebel_atmosphere_desc){.radius = 0});
    nebel_transfer transfer;
    const nebel_ray good = {{0, 0, 0}, {0, 1, 0}, 1}, still = {{0, 0, 0}, {0, 0, 0}, 1},
                    back = {{0, 0, 0}, {0, 1, 0}, -1};
    const nebel_sun none = {.irradiance = {1}}, dark = {.direction = {0}}, negative = {{0, 1, 0}, {-1}};
    assert_int_equal(nebel_trace_atmosphere(earth, &none, 1, &good, 0, &transfer, 0), NEBEL_ERROR_ARGUMENT);
    assert_int_equal(nebel_trace_atmosphere(earth, &negative, 1, &good, 0, &transfer, 0), NEBEL_ERROR_ARGUMENT);
    assert_int_equal(nebel_trace_atmosphere(earth, &dark, 1, &still, 0, &transfer, 0), NEBEL_ERROR_ARGUMENT);
    assert_int_equal(nebel_trace_atmosphere(earth, &dark, 1, &back, 0, &transfer, 0), NEBEL_ERROR_ARGUMENT);
    assert_int_equal(nebel_trace_atmosphere(NULL, &dark, 1, &good, 0, &transfer, 0), NEBEL_ERROR_ARGUMENT);
    const nebel_ray last_is_bad[2] = {good, back};
    transfer.error = -7;
    assert_int_equal(nebel_trace_atmosphere(earth, &dark, 2, last_is_bad, sizeof good, &transfer, 0),
                     NEBEL_ERROR_ARGUMENT);
    assert_true(transfer.error == -7);
    assert_int_equal(nebel_trace_atmosphere(earth, NULL, 0, NULL, 0, NULL, 0), NEBEL_OK);
    nebel_destroy_atmosphere(earth);
    nebel_destroy_atmosphere(NULL);
    assert_null(nebel_lookup_atmosphere("venus"));
    assert_null(nebel_lookup_atmosphere(NULL));
}

/* Backwards, and how often is counted. */
static void run_backwards(size_t parts, void (*part)(void *data, size_t i), void *data, void *user)
{
    ++*(int *)user;
    for (size_t i = parts; i-- > 0;) part(data, i);
}

static void parts_may_come_in_any_order(void **state)
{
    (void)state;
    int calls = 0;
    nebel_atmosphere_desc desc = *nebel_lookup_atmosphere("mars");
    nebel_atmosphere *forwards = make(&desc);
    desc.host.parallel.run = run_backwards;
    desc.host.parallel.user = &calls;
    nebel_atmosphere *backwards = make(&desc);
    const nb_scattering_table *a = &forwards->scatter, *b = &backwards->scatter;
    assert_true(calls > 0);
    assert_memory_equal(a->fields, b->fields, (size_t)(a->heights * a->suns) * sizeof *a->fields);
    assert_memory_equal(a->ground, b->ground, (size_t)a->suns * sizeof *a->ground);
    nebel_destroy_atmosphere(forwards);
    nebel_destroy_atmosphere(backwards);
}

static void expect_same_light(int count, const nb_node_light *a, const nb_node_light *b)
{
    const size_t size = (size_t)count * sizeof(double);
    for (int c = 0; c < 3; c++) {
        assert_memory_equal(a->sun[c], b->sun[c], size);
        assert_memory_equal(a->often[c], b->often[c], size);
        assert_memory_equal(a->missing[c], b->missing[c], size);
    }
}

/* At nodes of rays up, down and level, by day and in twilight. */
static void try_kernel(const nebel_atmosphere *atmosphere, nb_gather_fn *kernel)
{
    const nb_air_components *airs = &atmosphere->airs;
    for (int i = 0; i < 60; i++) {
        const nb_atmosphere_ray track = track_from(airs->radius + 1e4 * (i % 4), 80 + i % 5 * 4);
        const double end =
            fmin(nb_atmosphere_ray_enter(track, airs->radius), nb_atmosphere_ray_leave(track, airs->top));
        nb_ray_nodes path;
        nb_node_light light, same;
        nb_ray_nodes_lay(airs, NULL, &atmosphere->rule, track, end, 0, NULL, &path);
        const nb_gather_job job = {
            .airs = airs,
            .scatter = &atmosphere->scatter,
            .wants_sun = 1,
            .track = track,
            .aspect = {track.rise / track.radius, cos(0.2 * i), i % 7 == 0 ? 1 : cos((70 + i % 11 * 3) * DEGREES)},
            .path = &path,
            .count = path.count < NB_GATHER_NODES ? path.count + 1 : NB_GATHER_NODES};
        nb_gather_choose(NEBEL_ISA_SCALAR)(&job, &light);
        kernel(&job, &same);
        expect_same_light(job.count, &light, &same);
    }
}

static void all_instruction_sets_agree(void **state)
{
    (void)state;
    for (int quality = 0; quality < NEBEL_ATMOSPHERE_QUALITY_COUNT; quality++) {
        nebel_atmosphere_desc desc = *nebel_lookup_atmosphere("earth");
        desc.quality = (nebel_atmosphere_quality)quality;
        nebel_atmosphere *earth = make(&desc);
        for (int isa = 0; isa < NEBEL_ISA_COUNT; isa++) {
            nb_gather_fn *const kernel = nb_gather_choose((nebel_isa)isa);
            if (kernel != NULL) try_kernel(earth, kernel);
        }
        nebel_destroy_atmosphere(earth);
    }
}

static void memory_may_run_out(void **state)
{
    (void)state;
    for (int calls = 0;; calls++) {
        int left = calls;
        nebel_atmosphere *atmosphere = NULL;
        const nebel_atmosphere_desc desc = {.host.allocator = {scarce_allocate, scarce_release, &left}};
        const nebel_result result = nebel_create_atmosphere(&desc, &atmosphere);
        nebel_destroy_atmosphere(atmosphere);
        if (result == NEBEL_OK) break;
        assert_int_equal(result, NEBEL_ERROR_MEMORY);
        assert_null(atmosphere);
        assert_true(calls < 100);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(chapman_is_that_of_T12),
        cmocka_unit_test(lengths_are_those_of_T13),
        cmocka_unit_test(pieces_add_up),
        cmocka_unit_test(transmittance_is_that_of_T30),
        cmocka_unit_test(gain_is_that_of_T31),
        cmocka_unit_test(light_is_that_of_T40),
        cmocka_unit_test(skies_are_those_of_T41),
        cmocka_unit_test(qualities_agree),
        cmocka_unit_test(twilights_agree),
        cmocka_unit_test(a_furnace_stays_white),
        cmocka_unit_test(odd_rays_have_answers),
        cmocka_unit_test(distance_changes_nothing),
        cmocka_unit_test(bad_numbers_are_refused),
        cmocka_unit_test(parts_may_come_in_any_order),
        cmocka_unit_test(memory_may_run_out),
        cmocka_unit_test(all_instruction_sets_agree),
        cmocka_unit_test(below_the_ground_is_on_it),
        cmocka_unit_test(light_goes_on_above_the_air),
        cmocka_unit_test(rays_end_within_hazy_air),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
