/* Fog by name and fog as it is measured: T25 to T27 of the collected physics, and Mie's theory of the same droplets. */
#include <nebel/nebel.h>

#include <complex.h>
#include <math.h>
#include <string.h>

#include "unit.h"

#define PI 3.14159265358979323846

static void expect_near(const char *what, double got, double wanted, double relative)
{
    if (!(fabs(got - wanted) <= relative * fabs(wanted))) fail_msg("%s: %.16g; it should be %.16g", what, got, wanted);
}

static void visibility_is_that_of_T25(void **state)
{
    (void)state;
    static const double rows[][3] = {
        {50, 0.07824046010856292, 0.05991464547107982},       {200, 0.01956011502714073, 0.01497866136776995},
        {500, 0.007824046010856293, 0.005991464547107982},    {1000, 0.003912023005428146, 0.002995732273553991},
        {5000, 0.0007824046010856292, 0.0005991464547107981}, {23000, 0.0001700879567577455, 0.0001302492292849561}};
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        expect_near("2 %", nebel_extinction_from_visibility(rows[i][0], .02), rows[i][1], 1e-12);
        expect_near("5 %", nebel_extinction_from_visibility(rows[i][0], 0), rows[i][2], 1e-12);
        expect_near("back, 2 %", nebel_visibility_from_extinction(rows[i][1], .02), rows[i][0], 1e-12);
        expect_near("back, 5 %", nebel_visibility_from_extinction(rows[i][2], 0), rows[i][0], 1e-12);
    }
    assert_true(isnan(nebel_visibility_from_extinction(0, 0)) && isnan(nebel_visibility_from_extinction(1, 1)));
    assert_true(isnan(nebel_visibility_from_extinction(-1, 0)) &&
                isnan(nebel_visibility_from_extinction((double)NAN, 0)));
}

static void water_is_that_of_T26(void **state)
{
    (void)state;
    static const double rows[][3] = {{0.01, 2.514597799200346, 1555.725136907456},
                                     {0.05, 10.36482884439808, 377.4324751674499},
                                     {0.1, 19.07517500691121, 205.0845145069843},
                                     {0.5, 78.6252673037603, 49.75529037395147}};
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        const double extinction = nebel_extinction_from_water(rows[i][0]);
        expect_near("extinction", 1e3 * extinction, rows[i][1], 1e-6);
        expect_near("visibility", nebel_visibility_from_extinction(extinction, .02), rows[i][2], 1e-6);
        expect_near("water", nebel_water_from_extinction(extinction), rows[i][0], 1e-12);
    }
    assert_true(nebel_extinction_from_water(0) == 0 && nebel_water_from_extinction(0) == 0);
    assert_true(isnan(nebel_extinction_from_water(-1)) && isnan(nebel_water_from_extinction((double)NAN)));
}

/* What T27 has of each model, with extinctions to the kilometre, of its droplets' area and of Mie. */
static const struct {
    const char *name;
    double number, radius, water, twice_the_area, mie, g, albedo[3];
} models[] = {{"heavy_advection",
               20,
               20,
               0.3723369070921236,
               27.92526803190927,
               28.7481716151589,
               0.8722176179008874,
               {0.9999942271573977, 0.99999917733208, 0.9999994996382383}},
              {"moderate_advection",
               20.0006162962963,
               16,
               0.1906423708595018,
               17.87272226807829,
               18.48427659471417,
               0.869723431530789,
               {0.9999946401658746, 0.999999308022615, 0.9999995680702513}},
              {"heavy_radiation",
               100.0001316872428,
               6,
               0.06255268276527153,
               15.63817069131788,
               16.63850808693061,
               0.8535770536242687,
               {0.999998109473124, 0.9999997279700237, 0.9999998326595863}},
              {"moderate_radiation",
               200,
               3,
               0.01563815009786919,
               7.819075048934597,
               8.633616438845857,
               0.8313763079910109,
               {0.9999990246696546, 0.9999998560811721, 0.9999999139054156}}};

enum { MODELS = sizeof models / sizeof *models };

static void droplets_are_those_of_T27(void **state)
{
    (void)state;
    for (int i = 0; i < MODELS; i++) {
        nebel_droplet_properties sums;
        assert_int_equal(nebel_compute_droplet_properties(&nebel_lookup_fog_preset(models[i].name)->droplets, &sums),
                         NEBEL_OK);
        expect_near("number", sums.number_density, models[i].number, 1e-10);
        expect_near("radius", sums.effective_radius, models[i].radius, 1e-10);
        expect_near("water", sums.water, models[i].water, 1e-10);
        expect_near("extinction", 1e3 * sums.extinction, models[i].twice_the_area, 1e-10);
        expect_near("of water and radius", nebel_extinction_from_droplets(sums.water, sums.effective_radius),
                    sums.extinction, 1e-12);
    }
}

static void droplets_of_one_size_are_counted(void **state)
{
    (void)state;
    /* 50 to the cm^3, 8 um: their water and twice their area by hand */
    const double volume = 4 * PI / 3 * 8 * 8 * 8 * 1e-18, area = PI * 8 * 8 * 1e-12, count = 50e6;
    const double radius = nebel_droplet_radius(1e6 * volume * count, 50);
    expect_near("radius", radius, 8, 1e-12);
    expect_near("extinction", nebel_extinction_from_droplets(1e6 * volume * count, radius), 2 * area * count, 1e-12);
    assert_true(isnan(nebel_droplet_radius(0, 50)) && isnan(nebel_droplet_radius(1, 0)));
    assert_true(isnan(nebel_extinction_from_droplets(1, 0)) && isnan(nebel_extinction_from_droplets(-1, 1)));
    assert_true(nebel_extinction_from_droplets(0, 1) == 0);
}

static void sums_that_are_none_are_refused(void **state)
{
    (void)state;
    static const nebel_droplet_distribution bad[] = {{0, 3, 1, 1}, {1, -1, 1, 1},          {1, 3, 0, 1},
                                                     {1, 3, 1, 0}, {1, (double)NAN, 1, 1}, {1, 1e9, 1, 1}};
    nebel_droplet_properties sums = {.number_density = 7};
    for (size_t i = 0; i < sizeof bad / sizeof *bad; i++)
        assert_int_equal(nebel_compute_droplet_properties(&bad[i], &sums), NEBEL_ERROR_VALUE);
    assert_int_equal(nebel_compute_droplet_properties(NULL, &sums), NEBEL_ERROR_ARGUMENT);
    assert_int_equal(nebel_compute_droplet_properties(&bad[0], NULL), NEBEL_ERROR_ARGUMENT);
    assert_true(sums.number_density == 7);
}

/* ---- Mie ------------------------------------------------------------------------------------- */

enum { MOST_TERMS = 2000, MOST_DERIVATIVES = 3000 };

/* Efficiency of extinction and its product with the mean cosine, of a ball of real index m and size x. Source: Bohren
 * and Huffman 1983, with the downward recurrence begun far enough above for large balls. */
static void compute_mie(double m, double x, double *extinction, double *forward)
{
    static double logarithmic[MOST_DERIVATIVES];
    const int terms = (int)(x + 4 * cbrt(x) + 2), start = (int)(1.2 * m * x) + 60;
    assert_true(terms < MOST_TERMS && start < MOST_DERIVATIVES);
    logarithmic[start] = 0;
    for (int n = start; n > 0; n--) logarithmic[n - 1] = n / (m * x) - 1 / (logarithmic[n] + n / (m * x));
    double psi_before = cos(x), psi = sin(x), chi_before = -sin(x), chi = cos(x);
    const double complex i = (double complex)I;
    double complex a_before = 0, b_before = 0;
    *extinction = *forward = 0;
    for (int n = 1; n <= terms; n++) {
        const double psi_next = (2 * n - 1) * psi / x - psi_before, chi_next = (2 * n - 1) * chi / x - chi_before;
        const double complex xi = psi - i * chi, xi_next = psi_next - i * chi_next;
        const double p = logarithmic[n] / m + n / x, q = logarithmic[n] * m + n / x;
        const double complex a = (p * psi_next - psi) / (p * xi_next - xi),
                             b = (q * psi_next - psi) / (q * xi_next - xi);
        *extinction += 2 / (x * x) * (2 * n + 1) * creal(a + b);
        *forward += 4 / (x * x) * (2 * n + 1) / (n * (n + 1.)) * creal(a * conj(b));
        *forward += 4 / (x * x) * (n - 1) * (n + 1.) / n * creal(a_before * conj(a) + b_before * conj(b));
        psi_before = psi, psi = psi_next, chi_before = chi, chi = chi_next, a_before = a, b_before = b;
    }
}

/* Of all droplets: 1/m, and the mean cosine. */
static void sum_mie(const nebel_droplet_distribution *sizes, double *extinction, double *mean)
{
    enum { STEPS = 3000 };
    const double step = 33 / sizes->rate / STEPS;
    *extinction = *mean = 0;
    for (int i = 1; i <= STEPS; i++) {
        const double r = i * step;
        const double area = PI * r * r * sizes->scale * pow(r, sizes->power) * exp(-sizes->rate * r) * step;
        double of_one, forward;
        compute_mie(1.333, 2 * PI * r / .55, &of_one, &forward);
        *extinction += 1e-6 * area * of_one;
        *mean += 1e-6 * area * forward;
    }
    *mean /= *extinction; /* water absorbs next to nothing */
}

static void fogs_are_as_Mie_has_them(void **state)
{
    (void)state;
    for (int i = 0; i < MODELS; i++) {
        const nebel_fog_preset *preset = nebel_lookup_fog_preset(models[i].name);
        double extinction, mean;
        sum_mie(&preset->droplets, &extinction, &mean);
        expect_near("T27's extinction", extinction, models[i].mie / 1e3, 1e-3);
        expect_near("T27's mean cosine", mean, models[i].g, 1e-3);
        for (int c = 0; c < 3; c++) {
            expect_near("extinction", preset->extinction[c], extinction, 1e-3);
            expect_near("light lost", 1 - preset->albedo[c], 1 - models[i].albedo[c], .5);
            assert_true(fabs(preset->albedo[c] - models[i].albedo[c]) < 1e-7);
        }
        /* The fit of the phase function has 0.01 to 0.015 more than Mie for all sizes. */
        assert_true(fabs(nebel_phase_mean_cosine(&preset->phase) - mean) < .02);
        assert_true(preset->phase.diameter == 2 * models[i].radius);
    }
}

/* ---- presets --------------------------------------------------------------------------------- */

static double exponent_of(const nebel_fog_preset *preset, int channel)
{
    static const double lengths[] = {.65, .55, .45};
    return -log(preset->extinction[channel] / preset->extinction[1]) / log(lengths[channel] / .55);
}

static void others_are_as_their_sources_say(void **state)
{
    (void)state;
    static const struct {
        const char *name;
        double visibility, exponent;
    } rows[] = {{"mist", 2000, 0}, {"haze", 5000, 1.3}, {"smoke", 1000, 1.8}, {"black_smoke", 10, 1}};
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        const nebel_fog_preset *preset = nebel_lookup_fog_preset(rows[i].name);
        expect_near("visibility", nebel_visibility_from_extinction(preset->extinction[1], 0), rows[i].visibility,
                    1e-12);
        assert_true(fabs(exponent_of(preset, 0) - rows[i].exponent) < 1e-4);
        assert_true(fabs(exponent_of(preset, 2) - rows[i].exponent) < 1e-4);
        assert_true(preset->droplets.scale == 0);
    }
}

static void each_makes_a_volume(void **state)
{
    (void)state;
    nebel_fog *fog;
    size_t count;
    const nebel_fog_preset *presets = nebel_list_fog_presets(&count);
    assert_int_equal(count, 8);
    assert_ptr_equal(nebel_list_fog_presets(NULL), presets);
    assert_int_equal(nebel_create_fog(&(nebel_fog_desc){0}, &fog), NEBEL_OK);
    for (size_t i = 0; i < count; i++) {
        nebel_volume_desc volume = {.shape = {.type = NEBEL_SHAPE_WORLD}, .phase = presets[i].phase};
        for (int c = 0; c < 3; c++) {
            volume.extinction[c] = presets[i].extinction[c];
            volume.albedo[c] = presets[i].albedo[c];
        }
        assert_int_equal(nebel_add_volume(fog, &volume, NULL), NEBEL_OK);
        assert_ptr_equal(nebel_lookup_fog_preset(presets[i].name), &presets[i]);
        assert_true(strlen(presets[i].citation) > 20);
    }
    nebel_destroy_fog(fog);
    assert_null(nebel_lookup_fog_preset("fog"));
    assert_null(nebel_lookup_fog_preset(NULL));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(visibility_is_that_of_T25),       cmocka_unit_test(water_is_that_of_T26),
        cmocka_unit_test(droplets_are_those_of_T27),       cmocka_unit_test(droplets_of_one_size_are_counted),
        cmocka_unit_test(sums_that_are_none_are_refused),  cmocka_unit_test(fogs_are_as_Mie_has_them),
        cmocka_unit_test(others_are_as_their_sources_say), cmocka_unit_test(each_makes_a_volume),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
