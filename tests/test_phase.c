/* Phase functions: T22 to T24 of the collected physics, and each against its own integral. */
#include <nebel/nebel.h>

#include <math.h>

#include "unit.h"

#define PI 3.14159265358979323846

static const double tolerance = 1e-12;

static void expect_near(const char *what, double got, double wanted, double relative)
{
    if (!(fabs(got - wanted) <= relative * fmax(fabs(wanted), 1e-3)))
        fail_msg("%s: %.16g; it should be %.16g", what, got, wanted);
}

static const nebel_phase all[] = {{.type = NEBEL_PHASE_ISOTROPIC},
                                  {.type = NEBEL_PHASE_RAYLEIGH},
                                  {.type = NEBEL_PHASE_HENYEY_GREENSTEIN, .g = 0.8},
                                  {.type = NEBEL_PHASE_HENYEY_GREENSTEIN, .g = -0.3},
                                  {.type = NEBEL_PHASE_HENYEY_GREENSTEIN, .g = 1e-3},
                                  {.type = NEBEL_PHASE_HENYEY_GREENSTEIN, .g = NEBEL_MAX_G},
                                  {.type = NEBEL_PHASE_CORNETTE_SHANKS, .g = 0.8},
                                  {.type = NEBEL_PHASE_CORNETTE_SHANKS, .g = -0.95},
                                  {.type = NEBEL_PHASE_DRAINE, .g = 0.5, .alpha = 25},
                                  {.type = NEBEL_PHASE_DRAINE, .g = 0.09, .alpha = 250},
                                  {.type = NEBEL_PHASE_DRAINE, .g = -0.11, .alpha = 2},
                                  {.type = NEBEL_PHASE_DROPLETS, .diameter = 0.01},
                                  {.type = NEBEL_PHASE_DROPLETS, .diameter = 0.5},
                                  {.type = NEBEL_PHASE_DROPLETS, .diameter = 2},
                                  {.type = NEBEL_PHASE_DROPLETS, .diameter = 10},
                                  {.type = NEBEL_PHASE_DROPLETS, .diameter = 50}};

enum { COUNT = sizeof all / sizeof all[0] };

static void values_are_those_of_T22(void **state)
{
    static const struct {
        nebel_phase phase;
        double at_0, at_30, at_90, at_180, mean;
    } rows[] = {{{.type = NEBEL_PHASE_ISOTROPIC},
                 0.07957747154594767,
                 0.07957747154594767,
                 0.07957747154594767,
                 0.07957747154594767,
                 0},
                {{.type = NEBEL_PHASE_RAYLEIGH},
                 0.1193662073189215,
                 0.1044454314040563,
                 0.05968310365946075,
                 0.1193662073189215,
                 0},
                {{.type = NEBEL_PHASE_HENYEY_GREENSTEIN, .g = 0.8},
                 3.580986219567645,
                 0.2233166307528356,
                 0.01364039241905212,
                 0.004912189601601708,
                 0.8},
                {{.type = NEBEL_PHASE_HENYEY_GREENSTEIN, .g = -0.3},
                 0.03296108288885406,
                 0.03546079063119866,
                 0.0636343747723979,
                 0.2111239041014938,
                 -0.3},
                {{.type = NEBEL_PHASE_CORNETTE_SHANKS, .g = 0.8},
                 4.06930252223596,
                 0.2220477862599218,
                 0.007750222965370524,
                 0.005582033638183759,
                 0.8436363636363636},
                {{.type = NEBEL_PHASE_DRAINE, .g = 0.5, .alpha = 25},
                 0.9195618934198397,
                 0.366970363677292,
                 0.00316338908185412,
                 0.03405784790443851,
                 0.6851851851851852}};
    (void)state;
    for (size_t i = 0; i < sizeof rows / sizeof rows[0]; i++) {
        expect_near("ahead", nebel_evaluate_phase(&rows[i].phase, 1), rows[i].at_0, tolerance);
        expect_near("30 degrees", nebel_evaluate_phase(&rows[i].phase, cos(PI / 6)), rows[i].at_30, tolerance);
        expect_near("90 degrees", nebel_evaluate_phase(&rows[i].phase, 0), rows[i].at_90, tolerance);
        expect_near("back", nebel_evaluate_phase(&rows[i].phase, -1), rows[i].at_180, tolerance);
        expect_near("mean", nebel_phase_mean_cosine(&rows[i].phase), rows[i].mean, tolerance);
    }
}

/* Two rows of each of the four fits. */
static void droplets_are_those_of_T23(void **state)
{
    static const double rows[][6] = {
        {0.05, 0.1304867946368817, 0.05957003636248147, 0.08800244823835442, 0.1089357507333833, 0.03737662412345894},
        {0.5, 3.016495299076112, 0.008498879798048376, 0.006852637144147187, 0.007569211687774176, 0.8179995525794636},
        {1, 6.141724867054281, 0.006825750650679704, 0.008597067669379845, 0.01061660318505282, 0.8240532110918062},
        {2, 13.6268086814741, 0.006746941246211922, 0.01691764943022067, 0.02281358581599555, 0.7688568201503804},
        {4, 57.22240308019691, 0.003447563224495127, 0.01156886182546165, 0.01578470279332837, 0.834577905151841},
        {5, 101.1314380199335, 0.002882143771811026, 0.01079688853890985, 0.01478163099198498, 0.8434240725985456},
        {20, 2742.50915530512, 0.001147175361079772, 0.007837241958768467, 0.01091395179189859, 0.8793103943006771},
        {50, 18673.39533093181, 0.0008001142491066311, 0.006786352417154547, 0.009483069320915081, 0.8911936354037309}};
    (void)state;
    for (size_t i = 0; i < sizeof rows / sizeof rows[0]; i++) {
        const nebel_phase phase = {.type = NEBEL_PHASE_DROPLETS, .diameter = rows[i][0]};
        expect_near("ahead", nebel_evaluate_phase(&phase, 1), rows[i][1], 1e-11);
        expect_near("90 degrees", nebel_evaluate_phase(&phase, 0), rows[i][2], 1e-11);
        expect_near("140 degrees", nebel_evaluate_phase(&phase, cos(140 * PI / 180)), rows[i][3], 1e-11);
        expect_near("back", nebel_evaluate_phase(&phase, -1), rows[i][4], 1e-11);
        expect_near("mean", nebel_phase_mean_cosine(&phase), rows[i][5], 1e-11);
    }
}

static void samples_are_those_of_T24(void **state)
{
    static const double rows[][3] = {{0.8, 0.1, 0.4},
                                     {0.8, 0.5, 0.944},
                                     {0.8, 0.9, 0.994883997620464},
                                     {-0.3, 0.1, -0.9190556711758585},
                                     {-0.3, 0.5, -0.4365},
                                     {-0.3, 0.9, 0.5728185595567867},
                                     {0.001, 0.1, -0.7994594236037349},
                                     {0.001, 0.5, 0.0014999995},
                                     {0.001, 0.9, 0.8005394243957352}};
    static const double rayleigh[][2] = {{0.1, -0.8569187426909767}, {0.5, 0}, {0.9, 0.8569187426909767}};
    (void)state;
    for (size_t i = 0; i < sizeof rows / sizeof rows[0]; i++) {
        const nebel_phase phase = {.type = NEBEL_PHASE_HENYEY_GREENSTEIN, .g = rows[i][0]};
        expect_near("henyey_greenstein", nebel_sample_phase(&phase, rows[i][1]), rows[i][2], tolerance);
    }
    for (size_t i = 0; i < 3; i++)
        expect_near("rayleigh", nebel_sample_phase(&(nebel_phase){.type = NEBEL_PHASE_RAYLEIGH}, rayleigh[i][0]),
                    rayleigh[i][1], tolerance);
}

/* The integral of value and value * cosine from -1 to `end`, in pieces that halve towards both ends, where the peaks
 * are; three nodes of Gauss's rule in each of 16 parts of them. */
static void integrate(const nebel_phase *phase, double end, double *light, double *moment)
{
    static const double nodes[] = {-0.7745966692414834, 0, 0.7745966692414834};
    static const double weights[] = {5.0 / 9, 8.0 / 9, 5.0 / 9};
    enum { HALVINGS = 60, PARTS = 256 };
    *light = *moment = 0;
    for (int piece = 0; piece < 2 * HALVINGS; piece++) {
        const int k = piece < HALVINGS ? piece : 2 * HALVINGS - 1 - piece;
        const double outer = ldexp(1, -k), inner = k == HALVINGS - 1 ? 0 : ldexp(1, -k - 1);
        const double low = piece < HALVINGS ? -1 + inner : 1 - outer;
        const double high = piece < HALVINGS ? -1 + outer : 1 - inner;
        const double from = fmin(low, end), to = fmin(high, end), half = (to - from) / (2 * PARTS);
        for (int i = 0; i < 3 * PARTS && half > 0; i++) {
            const double c = from + half * (2 * (i / 3) + 1 + nodes[i % 3]);
            const double value = 2 * PI * half * weights[i % 3] * nebel_evaluate_phase(phase, c);
            *light += value;
            *moment += value * c;
        }
    }
}

static void all_light_goes_somewhere(void **state)
{
    (void)state;
    for (int i = 0; i < COUNT; i++) {
        double light, moment;
        integrate(&all[i], 1, &light, &moment);
        expect_near("whole", light, 1, 1e-8);
        expect_near("mean cosine", moment, nebel_phase_mean_cosine(&all[i]), 1e-8);
    }
}

static void samples_invert_the_integral(void **state)
{
    static const double parts[] = {1e-3, 0.2, 0.5, 0.77, 0.999};
    (void)state;
    for (int i = 0; i < COUNT; i++) {
        assert_true(nebel_sample_phase(&all[i], 0) < -1 + 1e-9 && nebel_sample_phase(&all[i], 1) > 1 - 1e-9);
        for (size_t k = 0; k < sizeof parts / sizeof parts[0]; k++) {
            double light, moment;
            integrate(&all[i], nebel_sample_phase(&all[i], parts[k]), &light, &moment);
            expect_near("part", light, parts[k], 1e-7);
        }
    }
}

static void what_is_out_of_range_is_not_a_number(void **state)
{
    static const nebel_phase wrong[] = {{.type = NEBEL_PHASE_COUNT},
                                        {.type = NEBEL_PHASE_HENYEY_GREENSTEIN, .g = 1},
                                        {.type = NEBEL_PHASE_HENYEY_GREENSTEIN, .g = (double)NAN},
                                        {.type = NEBEL_PHASE_CORNETTE_SHANKS, .g = -1},
                                        {.type = NEBEL_PHASE_DRAINE, .g = 0.5, .alpha = -1},
                                        {.type = NEBEL_PHASE_DRAINE, .g = 0.5, .alpha = HUGE_VAL},
                                        {.type = NEBEL_PHASE_DROPLETS},
                                        {.type = NEBEL_PHASE_DROPLETS, .diameter = 51}};
    (void)state;
    for (size_t i = 0; i < sizeof wrong / sizeof wrong[0]; i++) {
        assert_true(isnan(nebel_evaluate_phase(&wrong[i], 0.5)));
        assert_true(isnan(nebel_phase_mean_cosine(&wrong[i])));
        assert_true(isnan(nebel_sample_phase(&wrong[i], 0.5)));
    }
    const nebel_phase even = {.type = NEBEL_PHASE_ISOTROPIC};
    assert_true(isnan(nebel_evaluate_phase(&even, 1.1)) && isnan(nebel_evaluate_phase(&even, (double)NAN)));
    assert_true(isnan(nebel_sample_phase(&even, -0.1)) && isnan(nebel_sample_phase(&even, (double)NAN)));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(values_are_those_of_T22),     cmocka_unit_test(droplets_are_those_of_T23),
        cmocka_unit_test(samples_are_those_of_T24),    cmocka_unit_test(all_light_goes_somewhere),
        cmocka_unit_test(samples_invert_the_integral), cmocka_unit_test(what_is_out_of_range_is_not_a_number),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
