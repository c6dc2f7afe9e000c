/* Is the error that nebel_trace reports never smaller than the true one, and never larger than promised?
 *
 *     test_error_bound [cases [first]]        20000 from 0 unless said otherwise (a first opinion has fewer); a million take some
 * minutes */
#include "oracle.h"
#include "random_fog.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "dice.h"
#include "fog_help.h"

enum { RAYS_PER_FOG = 20, FULL_COUNT = 20000 };

static size_t case_count, first_case;

/* One way of asking, and what came of it. */
typedef struct mode {
    const char *name;
    nebel_precision precision;
    double tolerance, extra; /* error <= tolerance * radiance + extra */
    double may_exceed;       /* by this share of the cases */
    size_t cases, dishonest, excessive;
    double worst_ratio, worst_excess; /* true error / reported; error / promised */
    size_t worst_ratio_case, worst_excess_case;
} mode;

/* These fogs and rays are made to be hard: most rays graze something, a sixth of them without end, some in fog of 1e4
 * per meter. If the last bits of the ray change the answer, double keeps its promise all the same; float may fail on one of
 * a thousand: see max_excessive. */
static mode modes[] = {
    {"double 2e-3", NEBEL_PRECISION_DOUBLE, 2e-3, 1e-8, 0, 0, 0, 0, 0, 0, 0, 0},
    {"double 1e-7", NEBEL_PRECISION_DOUBLE, 1e-7, 1e-8, 0, 0, 0, 0, 0, 0, 0, 0},
    {"float  2e-3", NEBEL_PRECISION_FLOAT, 2e-3, 1e-4, 1e-3, 0, 0, 0, 0, 0, 0, 0},
    {"float  1e-7", NEBEL_PRECISION_FLOAT, 1e-7, 1e-4, 1e-3, 0, 0, 0, 0, 0, 0, 0},
};
enum { MODES = sizeof modes / sizeof modes[0] };

static size_t undecided;
static double worst_uncertainty;

/* Which fog and ray a case is: kinds in turn, some rays for each fog. */
static random_fog_kind kind_of(size_t i)
{
    return (random_fog_kind)(i / RAYS_PER_FOG % RANDOM_FOG_KIND_COUNT);
}

static uint64_t seed_of(size_t i)
{
    return i / RAYS_PER_FOG / RANDOM_FOG_KIND_COUNT;
}

static nebel_lighting *commit(const random_fog *fog)
{
    const nebel_fog_desc desc = random_fog_desc(fog);
    const nebel_lighting_desc lights = random_fog_lights(fog);
    return fog_commit_lit(&desc, fog->volumes, fog->count, &lights);
}

static double largest_radiance(const random_fog *fog)
{
    double most = 1;
    for (size_t i = 0; i < fog->count; i++)
        for (int c = 0; c < 3; c++)
            most = fmax(most, fog->volumes[i].source[c] + fog->volumes[i].albedo[c] * fog->ambient[c]);
    return most;
}

static void keep_worst(double value, size_t i, double *worst, size_t *worst_case)
{
    if (!(value > *worst)) return;
    *worst = value;
    *worst_case = i;
}

/* The largest difference in transmittance or in-scattering; a NaN counts as infinite. */
static double apart(const double T[3], const double S[3], const double T2[3], const double S2[3])
{
    double most = 0;
    for (int c = 0; c < 3; c++) {
        const double t = fabs(T[c] - T2[c]), s = fabs(S[c] - S2[c]);
        most = t <= most ? most : t;
        most = s <= most ? most : s;
    }
    return isfinite(most) ? most : HUGE_VAL;
}

typedef struct truth {
    double T[3], S[3], uncertainty;
} truth;

static void judge(mode *m, size_t i, const random_fog *fog, const nebel_transfer *transfer, const truth *is)
{
    const double wrong = apart(transfer->transmittance, transfer->in_scattering, is->T, is->S);
    const double surely = wrong - is->uncertainty, promised = m->tolerance * largest_radiance(fog) + m->extra;
    m->cases++;
    m->dishonest += !(transfer->error >= surely);
    keep_worst(surely / fmax(transfer->error, 1e-300), i, &m->worst_ratio, &m->worst_ratio_case);
    if (transfer->error <= promised) return;
    m->excessive++;
    keep_worst(isnan(transfer->error) ? HUGE_VAL : transfer->error / promised, i, &m->worst_excess,
               &m->worst_excess_case);
}

/* In half of the fog of unions and intersections one volume replaces others and one excludes them. */
static void make_fog(random_fog *fog, size_t i)
{
    uint64_t state = seed_of(i);
    random_fog_make(fog, kind_of(i), state);
    if (fog->kind != RANDOM_FOG_PARTS || state % 2 == 0) return;
    nebel_volume_desc *const v = fog->volumes;
    v[1].operation = NEBEL_OPERATION_REPLACE;
    v[2] = (nebel_volume_desc){.shape = v[2].shape, .operation = NEBEL_OPERATION_EXCLUDE};
    for (size_t k = 0; k < fog->count; k++) v[k].priority = dice_below(&state, 3) - 1;
}

static void try_fog(size_t from, size_t to)
{
    static random_fog fog;
    nebel_ray rays[RAYS_PER_FOG];
    nebel_transfer transfers[MODES][RAYS_PER_FOG];
    make_fog(&fog, from);
    for (size_t i = from; i < to; i++) rays[i - from] = random_fog_ray(&fog, i % RAYS_PER_FOG);
    nebel_lighting *const lighting = commit(&fog);
    const nebel_snapshot *snapshot = nebel_get_lighting_snapshot(lighting);
    for (int m = 0; m < MODES; m++) {
        const nebel_trace_desc desc = {
            .lighting = lighting, .precision = modes[m].precision, .tolerance = modes[m].tolerance};
        const nebel_result result =
            nebel_trace(snapshot, &desc, to - from, rays, sizeof *rays, transfers[m], sizeof *transfers[m]);
        if (result != NEBEL_OK) print_message("case %zu, %s: %s\n", from, modes[m].name, nebel_result_text(result));
        assert_int_equal(result, NEBEL_OK);
    }
    for (size_t i = from; i < to; i++) {
        truth is;
        oracle_trace(fog.volumes, fog.count, fog.ambient, &rays[i - from], is.T, is.S, &is.uncertainty);
        oracle_limit(fog.max_opacity, is.T, is.S, &is.uncertainty);
        if (!isfinite(is.uncertainty)) {
            undecided++;
            continue;
        }
        worst_uncertainty = fmax(worst_uncertainty, is.uncertainty);
        for (int m = 0; m < MODES; m++) judge(&modes[m], i, &fog, &transfers[m][i - from], &is);
    }
    nebel_release_lighting(lighting);
}

/* Everything that is needed to see a case again. */
static void print_case(const char *why, const mode *m, size_t i)
{
    static random_fog fog;
    make_fog(&fog, i);
    const nebel_ray ray = random_fog_ray(&fog, i % RAYS_PER_FOG);
    nebel_lighting *const lighting = commit(&fog);
    const nebel_snapshot *snapshot = nebel_get_lighting_snapshot(lighting);
    nebel_transfer transfer;
    double T[3], S[3], uncertainty;
    const nebel_trace_desc desc = {.lighting = lighting, .precision = m->precision, .tolerance = m->tolerance};
    nebel_trace(snapshot, &desc, 1, &ray, sizeof ray, &transfer, sizeof transfer);
    oracle_trace(fog.volumes, fog.count, fog.ambient, &ray, T, S, &uncertainty);
    oracle_limit(fog.max_opacity, T, S, &uncertainty);
    nebel_release_lighting(lighting);
    printf("\n%s, %s: case %zu (kind %d, seed %zu, ray %zu)\n", m->name, why, i, (int)kind_of(i), (size_t)seed_of(i),
           i % RAYS_PER_FOG);
    random_fog_print(stdout, &fog, &ray);
    printf("trace  T %.17g %.17g %.17g S %.17g %.17g %.17g error %g\n", transfer.transmittance[0],
           transfer.transmittance[1], transfer.transmittance[2], transfer.in_scattering[0], transfer.in_scattering[1],
           transfer.in_scattering[2], transfer.error);
    printf("oracle T %.17g %.17g %.17g S %.17g %.17g %.17g uncertainty %g\n", T[0], T[1], T[2], S[0], S[1], S[2],
           uncertainty);
}

/* How many of n cases may exceed what is promised if a share of all does. Of `full` cases and more it is that share. Fewer
 * are the first of those: it is the least number that is exceeded with a probability below 1e-6 if each case exceeds with that
 * probability, and no more than of all of them. */
static size_t max_excessive(double share, size_t n, size_t full)
{
    const size_t max = (size_t)(share * (double)(n > full ? n : full));
    double term = exp((double)n * log1p(-share)), beyond = 1 - term;
    size_t count = 0;
    for (; count < max && beyond >= 1e-6; beyond -= term) {
        term *= (double)(n - count) / (double)(count + 1) * share / (1 - share);
        count++;
    }
    return n < full ? count : max;
}

/* Of a mode, some cases of which are undecided. */
static size_t max_excessive_of(const mode *m)
{
    const double share = (double)m->cases / (double)(case_count > 0 ? case_count : 1);
    return max_excessive(m->may_exceed, m->cases, (size_t)(share * FULL_COUNT));
}

static void test_bounds_of_shares_hold_for_any_count(void **unused)
{
    (void)unused;
    assert_int_equal(max_excessive(0, 600, FULL_COUNT), 0);
    assert_int_equal(max_excessive(0, FULL_COUNT, FULL_COUNT), 0);
    assert_int_equal(max_excessive(1e-3, FULL_COUNT, FULL_COUNT), 20);
    assert_int_equal(max_excessive(1e-3, 50 * FULL_COUNT, FULL_COUNT), 1000);
    assert_int_equal(max_excessive(.5, 20, FULL_COUNT), 19); /* all 20 have a probability of 2^-20, less than 1e-6 */
    assert_int_equal(max_excessive(.5, 19, FULL_COUNT), 19);
    size_t last = 0;
    for (size_t n = 0; n <= FULL_COUNT; n += 100) {
        const size_t next = max_excessive(1e-3, n, FULL_COUNT);
        assert_true(next >= last && next <= 20 && (double)next >= 1e-3 * (double)n - 1);
        last = next;
    }
}

static void print_mode(const mode *m)
{
    printf("%s: %zu cases\n", m->name, m->cases);
    printf("    error too small in %zu (worst: true error %.3g times the reported, case %zu)\n", m->dishonest,
           m->worst_ratio, m->worst_ratio_case);
    printf("    error too large in %zu, at most %zu may be (worst: %.3g times the promised, case %zu)\n", m->excessive,
           max_excessive_of(m), m->worst_excess, m->worst_excess_case);
}

static void test_reported_errors_bound_the_true_ones_and_keep_their_promise(void **unused)
{
    (void)unused;
    for (size_t i = first_case; i < first_case + case_count; i += RAYS_PER_FOG) try_fog(i, i + RAYS_PER_FOG);
    printf("%zu cases undecided; largest uncertainty of the truth %.2g\n", undecided, worst_uncertainty);
    int failed = 0;
    for (int m = 0; m < MODES; m++) print_mode(&modes[m]);
    for (int m = 0; m < MODES; m++) {
        const int excessive = modes[m].excessive > max_excessive_of(&modes[m]);
        if (modes[m].dishonest > 0) print_case("true error larger than reported", &modes[m], modes[m].worst_ratio_case);
        if (excessive) print_case("error larger than promised", &modes[m], modes[m].worst_excess_case);
        failed = failed || excessive || modes[m].dishonest > 0;
    }
    assert_false(failed);
    assert_true(undecided < case_count / 20);
}

int main(int argc, char **argv)
{
    case_count = argc > 1 ? (size_t)strtoull(argv[1], NULL, 10) : nb_test_count(FULL_COUNT);
    if (argc > 2) first_case = (size_t)strtoull(argv[2], NULL, 10) / RAYS_PER_FOG * RAYS_PER_FOG;
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_bounds_of_shares_hold_for_any_count),
        cmocka_unit_test(test_reported_errors_bound_the_true_ones_and_keep_their_promise),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
