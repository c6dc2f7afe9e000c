/* Phase functions of clouds against Mie's theory, worked out here in another way than the table was: for each sphere the
 * functions of Riccati and Bessel come from their ratios by downward recurrence, and sizes are those of quantiles. */
#include "clouds/cloud_phase.h"

#include "cloud_help.h"
#include "dice.h"
#include "near.h"

#include <complex.h>

/* I is of floats in some C libraries. */
#define IMAGINARY ((double complex)I)

enum { MOST_ORDERS = 1800, DIRECTIONS = 24 };

/* ---- spheres --------------------------------------------------------------------------------- */

/* Coefficients of a sphere (van de Hulst, Light Scattering by Small Particles, 1957, 9.3). */
typedef struct mie {
    int orders;
    double complex a[MOST_ORDERS], b[MOST_ORDERS];
} mie;

static void solve_sphere(double x, double complex m, mie *s)
{
    static double ratio[MOST_ORDERS + 64]; /* psi_n by psi_n-1 of x */
    static double complex slope[MOST_ORDERS + 64];
    const double complex y = m * x;
    s->orders = (int)(x + 4.05 * cbrt(x) + 8);
    assert_true(s->orders < MOST_ORDERS);
    const int last = (int)fmax(s->orders, cabs(y)) + 50;
    assert_true(last < MOST_ORDERS + 64);
    ratio[last] = 0;
    slope[last] = 0;
    for (int n = last - 1; n >= 1; n--) {
        ratio[n] = 1 / ((2 * n + 1) / x - ratio[n + 1]);
        slope[n] = (n + 1) / y - 1 / (slope[n + 1] + (n + 1) / y);
    }
    double psi = sin(x), chi = cos(x), chi_before = -sin(x);
    for (int n = 1; n <= s->orders; n++) {
        const double next = (2 * n - 1) * chi / x - chi_before, before = psi, chi_last = chi;
        chi_before = chi;
        chi = next;
        psi *= ratio[n];
        const double complex xi = psi - IMAGINARY * chi, xi_before = before - IMAGINARY * chi_last;
        const double complex p = slope[n] / m + n / x, q = slope[n] * m + n / x;
        s->a[n - 1] = (p * psi - before) / (p * xi - xi_before);
        s->b[n - 1] = (q * psi - before) / (q * xi - xi_before);
    }
}

/* By x^2. */
static double efficiency_of(const mie *s)
{
    double sum = 0;
    for (int n = 1; n <= s->orders; n++)
        sum += 2 * (2 * n + 1) * (pow(cabs(s->a[n - 1]), 2) + pow(cabs(s->b[n - 1]), 2));
    return sum;
}

/* The mean cosine times that. */
static double forward_of(const mie *s)
{
    double sum = 0;
    for (int n = 1; n <= s->orders; n++) {
        const double complex a = s->a[n - 1], b = s->b[n - 1];
        sum += (2 * n + 1.) / (n * (n + 1.)) * creal(a * conj(b));
        if (n < s->orders) sum += n * (n + 2.) / (n + 1.) * creal(a * conj(s->a[n]) + b * conj(s->b[n]));
    }
    return 4 * sum;
}

static double light_of(const mie *s, double cosine)
{
    double before = 0, pi = 1;
    double complex first = 0, second = 0;
    for (int n = 1; n <= s->orders; n++) {
        const double tau = n * cosine * pi - (n + 1) * before, weight = (2 * n + 1.) / (n * (n + 1.));
        first += weight * (s->a[n - 1] * pi + s->b[n - 1] * tau);
        second += weight * (s->a[n - 1] * tau + s->b[n - 1] * pi);
        const double next = ((2 * n + 1) * cosine * pi - (n + 1) * before) / n;
        before = pi;
        pi = next;
    }
    return .5 * (pow(cabs(first), 2) + pow(cabs(second), 2));
}

/* Wiscombe, Mie Scattering Calculations: Advances in Technique and Fast, Vector-Speed Computer Codes, NCAR/TN-140+STR, 1979. */
static void test_spheres_of_the_literature(void **state)
{
    (void)state;
    static const struct {
        double x;
        double complex m;
        double efficiency, mean;
    } rows[] = {{10, 1.5, 2.881999, .742913}, {100, 1.5, 2.0944, .818246}, {1000, 1.5, 2.0139, .827882}};
    static mie s;
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        solve_sphere(rows[i].x, rows[i].m, &s);
        const double efficiency = efficiency_of(&s) / (rows[i].x * rows[i].x);
        assert_near(efficiency, rows[i].efficiency, 1e-4);
        assert_near(forward_of(&s) / efficiency_of(&s), rows[i].mean, 1e-6);
    }
}

/* ---- drops ----------------------------------------------------------------------------------- */

static const double wavelengths[3] = {.68, .55, .44}, refraction[3] = {1.331, 1.333, 1.3374};
static const double absorption[3] = {2.45e-8, 1.96e-9, 1.13e-9};

/* Drops of an effective variance of a tenth, of radii at random within even steps. */
static double drops(int color, double diameter, int sizes, uint64_t *numbers, const double cosines[DIRECTIONS],
                    double phases[DIRECTIONS])
{
    static mie s;
    double whole = 0, forward = 0;
    memset(phases, 0, DIRECTIONS * sizeof *phases);
    for (int i = 0; i < sizes; i++) {
        const double radius = 4 * (i + dice(numbers, 0, 1)) / sizes, number = pow(radius, 7) * exp(-10 * radius);
        if (radius < .02) continue;
        solve_sphere(PI * diameter * radius / wavelengths[color], refraction[color] + IMAGINARY * absorption[color],
                     &s);
        whole += number * efficiency_of(&s) * PI;
        forward += number * forward_of(&s) * PI;
        for (int k = 0; k < DIRECTIONS; k++) phases[k] += number * light_of(&s, cosines[k]);
    }
    for (int k = 0; k < DIRECTIONS; k++) phases[k] /= whole;
    return forward / whole;
}

/* The mean cosine; all light is 1. */
static double mean_cosine(const nebel_clouds *clouds, int color)
{
    enum { PIECES = 20000 };
    double sum = 0, whole = 0;
    for (int i = 0; i < PIECES; i++) {
        const double part = (i + .5) / PIECES, angle = PI * part * part * part, cosine = cos(angle);
        const double wide = 2 * PI * sin(angle) * 3 * PI * part * part / PIECES;
        double values[3];
        assert_int_equal(nebel_cloud_phase(clouds, 0, 1, &cosine, &values), NEBEL_OK);
        whole += wide * values[color];
        sum += wide * values[color] * cosine;
    }
    assert_near(whole, 1, 1e-5);
    return sum;
}

static void test_drops_against_spheres(void **state)
{
    (void)state;
    enum { SIZES = 3000 };
    const size_t count = nb_test_count(12);
    uint64_t numbers = 11;
    double squares = 0, most = 0, most_ahead = 0, most_mean = 0;
    print_message("color  diameter  mean cosine by spheres  nebel    off: root of mean square, at most, ahead\n");
    for (size_t i = 0; i < count; i++) {
        const int color = (int)(i % 3);
        const double diameter = exp(dice(&numbers, log(4), log(50)));
        double cosines[DIRECTIONS], truth[DIRECTIONS], own = 0, own_most = 0, ahead = 0;
        /* The first four within a degree of straight ahead, the last four within ten of straight back. */
        for (int k = 0; k < DIRECTIONS; k++) {
            const double low = k < 4                ? 0
                               : k < DIRECTIONS - 4 ? 1
                                                    : 170,
                         high = k < 4                ? 1
                                : k < DIRECTIONS - 4 ? 170
                                                     : 180;
            cosines[k] = cos(dice(&numbers, low, high) * PI / 180);
        }
        nebel_clouds *clouds = make(1, &(nebel_cloud_layer){.droplet_diameter = diameter});
        const double mean_truth = drops(color, diameter, SIZES, &numbers, cosines, truth);
        const double mean = mean_cosine(clouds, color);
        for (int k = 0; k < DIRECTIONS; k++) {
            double values[3];
            assert_int_equal(nebel_cloud_phase(clouds, 0, 1, &cosines[k], &values), NEBEL_OK);
            const double off = fabs(values[color] / truth[k] - 1);
            if (k < 4) ahead = fmax(ahead, off);
            if (k >= 4) own_most = fmax(own_most, off), own += off * off / (DIRECTIONS - 4);
        }
        print_message("%5d  %8.2f  %22.5f  %.5f  %.4f %.4f %.4f\n", color, diameter, mean_truth, mean, sqrt(own),
                      own_most, ahead);
        squares += own / (double)count;
        most = fmax(most, own_most);
        most_ahead = fmax(most_ahead, ahead);
        most_mean = fmax(most_mean, fabs(mean - mean_truth));
        nebel_destroy_clouds(clouds);
    }
    print_message(
        "off by %.4f (root of the mean square), at most %.4f; within a degree of straight ahead %.4f; mean cosines by "
        "%.1e\n",
        sqrt(squares), most, most_ahead, most_mean);
    assert_true(sqrt(squares) < .01 && most < .05 && most_ahead < .02 && most_mean < 5e-4);
}

/* ---- looks ----------------------------------------------------------------------------------- */

static double value_at(const nebel_clouds *clouds, int color, double degrees)
{
    const double cosine = cos(degrees * PI / 180);
    double values[3];
    assert_int_equal(nebel_cloud_phase(clouds, 0, 1, &cosine, &values), NEBEL_OK);
    return values[color];
}

/* Between two angles, in degrees. */
static double brightest(const nebel_clouds *clouds, int color, double from, double to)
{
    double best = from;
    for (double angle = from; angle <= to; angle += .05)
        if (value_at(clouds, color, angle) > value_at(clouds, color, best)) best = angle;
    return best;
}

/* A bow whose red is outside, and around the antisolar point rings whose red is outside. */
static void test_bows_and_glories(void **state)
{
    (void)state;
    for (double diameter = 10; diameter <= 50; diameter += 10) {
        nebel_clouds *clouds = make(1, &(nebel_cloud_layer){.droplet_diameter = diameter});
        double bow[3], ring[3];
        for (int c = 0; c < 3; c++) {
            bow[c] = 180 - brightest(clouds, c, 130, 160);
            ring[c] = 180 - brightest(clouds, c, 170, 179.4);
            assert_true(value_at(clouds, c, 180 - bow[c]) > 3 * value_at(clouds, c, 100));
        }
        print_message("drops of %g um: bow %.1f %.1f %.1f degrees wide, ring of the glory %.2f %.2f %.2f\n", diameter,
                      bow[0], bow[1], bow[2], ring[0], ring[1], ring[2]);
        assert_true(bow[0] > 30 && bow[0] < 43);
        nebel_destroy_clouds(clouds);
    }
}

static void test_ice_has_the_fit(void **state)
{
    (void)state;
    const nebel_phase fit = {.type = NEBEL_PHASE_DROPLETS, .diameter = 40};
    nebel_clouds *clouds = make(1, &(nebel_cloud_layer){.type = NEBEL_CLOUD_CIRRUS});
    for (double angle = 0; angle <= 180; angle += .25)
        for (int c = 0; c < 3; c++) {
            const double truth = nebel_evaluate_phase(&fit, cos(angle * PI / 180));
            assert_near(value_at(clouds, c, angle), truth, 3e-3 * truth);
        }
    nebel_destroy_clouds(clouds);
}

static void test_arguments(void **state)
{
    (void)state;
    nebel_clouds *clouds = make(1, &(nebel_cloud_layer){.seed = 1});
    double values[2][3], cosines[2] = {.5, 1.5};
    assert_int_equal(nebel_cloud_phase(clouds, 0, 0, NULL, NULL), NEBEL_OK);
    assert_int_equal(nebel_cloud_phase(NULL, 0, 1, cosines, values), NEBEL_ERROR_ARGUMENT);
    assert_int_equal(nebel_cloud_phase(clouds, 1, 1, cosines, values), NEBEL_ERROR_ARGUMENT);
    assert_int_equal(nebel_cloud_phase(clouds, 0, 1, NULL, values), NEBEL_ERROR_ARGUMENT);
    assert_int_equal(nebel_cloud_phase(clouds, 0, 1, cosines, NULL), NEBEL_ERROR_ARGUMENT);
    assert_int_equal(nebel_cloud_phase(clouds, 0, 2, cosines, values), NEBEL_ERROR_ARGUMENT);
    nebel_destroy_clouds(clouds);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_spheres_of_the_literature),
        cmocka_unit_test(test_drops_against_spheres),
        cmocka_unit_test(test_bows_and_glories),
        cmocka_unit_test(test_ice_has_the_fit),
        cmocka_unit_test(test_arguments),
    };
    return cmocka_run_group_tests(tests, make_air, free_air);
}
