/* Lit fog of all shapes and profiles, from thin to opaque, against brute force: the error that is stated is never too
 * small, and rays have the same bits alone, shuffled, split over calls and with every instruction set. Prints how many rays
 * were tried of each kind of fog and light.
 *
 *     test_lit_truth [SEED [RAYS]]
 */
#include "lit_oracle.h"
#include "lit_scenes.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "unit.h"

enum { RAYS = LIT_RAYS_EACH, CLOSE_EVERY = 24 };

#define FIRST_SEED 1
static uint64_t first_seed = FIRST_SEED;
static size_t ray_count;

typedef enum way_to_ask { ASK_DOUBLE, ASK_FINE, ASK_FLOAT, ASK_COUNT } way_to_ask;
static const char *const way_names[ASK_COUNT] = {"double", "double, 1e-5", "float"};

typedef struct tally {
    size_t rays, wrong;
    double worst; /* as a multiple of what may be */
} tally;

static tally tallies[LIT_KIND_COUNT][LIT_SOURCE_COUNT][ASK_COUNT];
static tally bits[LIT_KIND_COUNT][LIT_SOURCE_COUNT]; /* of rays asked again, and those with other bits */
static tally oracle; /* of rays that were looked at twice, and those that were not the same */
static size_t undecided;

/* ---- the same bits --------------------------------------------------------------------------- */

static void ask(const nebel_lighting *lighting, way_to_ask way, nebel_isa isa, size_t n, const nebel_ray *rays,
                nebel_transfer *transfers)
{
    const nebel_snapshot *snapshot = nebel_get_lighting_snapshot(lighting);
    const nebel_trace_desc desc = {.lighting = lighting,
                                   .precision = way == ASK_FLOAT ? NEBEL_PRECISION_FLOAT : NEBEL_PRECISION_DOUBLE,
                                   .isa = isa,
                                   .tolerance = way == ASK_FINE ? 1e-5 : 0};
    assert_int_equal(nebel_trace(snapshot, &desc, n, rays, sizeof *rays, transfers, sizeof *transfers), NEBEL_OK);
}

static void compare_bits(tally *t, const char *how, const nebel_transfer *a, const nebel_transfer *b)
{
    t->rays++;
    if (memcmp(a, b, sizeof *a) == 0) return;
    t->wrong++;
    print_message("%s: %.9g %.9g, error %.9g; not %.9g %.9g, error %.9g\n", how, b->transmittance[0],
                  b->in_scattering[0], b->error, a->transmittance[0], a->in_scattering[0], a->error);
}

static void compare_orders(const nebel_lighting *lighting, int n, const nebel_ray *rays,
                           const nebel_transfer *transfers, tally *t)
{
    const size_t count = (size_t)n, some = count / 3;
    nebel_ray shuffled[RAYS];
    nebel_transfer again[RAYS];
    for (int i = 0; i < n; i++) shuffled[i * 7 % n] = rays[i];
    ask(lighting, ASK_FLOAT, NEBEL_ISA_DEFAULT, count, shuffled, again);
    for (int i = 0; i < n; i++) compare_bits(t, "shuffled", &transfers[i], &again[i * 7 % n]);
    for (int i = 0; i < n; i++) ask(lighting, ASK_FLOAT, NEBEL_ISA_DEFAULT, 1, &rays[i], &again[i]);
    for (int i = 0; i < n; i++) compare_bits(t, "alone", &transfers[i], &again[i]);
    ask(lighting, ASK_FLOAT, NEBEL_ISA_DEFAULT, some, rays, again);
    ask(lighting, ASK_FLOAT, NEBEL_ISA_DEFAULT, count - some, rays + some, again + some);
    for (int i = 0; i < n; i++) compare_bits(t, "split", &transfers[i], &again[i]);
}

static void compare_all_bits(const nebel_lighting *lighting, int n, const nebel_ray *rays,
                             const nebel_transfer *transfers, tally *t)
{
    nebel_transfer again[RAYS];
    compare_orders(lighting, n, rays, transfers, t);
    for (int isa = NEBEL_ISA_SCALAR; isa < NEBEL_ISA_COUNT; isa++) {
        if (!nebel_isa_available((nebel_isa)isa)) continue;
        ask(lighting, ASK_FLOAT, (nebel_isa)isa, (size_t)n, rays, again);
        for (int i = 0; i < n; i++) compare_bits(t, nebel_isa_name((nebel_isa)isa), &transfers[i], &again[i]);
    }
}

/* ---- against the oracle ---------------------------------------------------------------------- */

static void print_case(lit_kind kind, lit_source source, uint64_t seed, int i, way_to_ask way,
                       const nebel_transfer *transfer, const lit_truth *is)
{
    print_message("%s, %s, seed %llu, ray %d, %s: %.9g %.9g %.9g, not %.9g %.9g %.9g (+- %.1e); T %.9g, not %.9g; "
                  "error %.3g\n",
                  lit_kind_names[kind], source == LIT_BY_LIGHTS ? "lights" : "sun", (unsigned long long)seed, i,
                  way_names[way], transfer->in_scattering[0], transfer->in_scattering[1], transfer->in_scattering[2],
                  is->in_scattering[0], is->in_scattering[1], is->in_scattering[2], is->uncertainty,
                  transfer->transmittance[0], is->transmittance[0], transfer->error);
}

static double largest(const double v[3])
{
    return fmax(fmax(v[0], v[1]), v[2]);
}

/* What the oracle's own arithmetic may be off by: its depths are sums and differences of doubles. */
static double slack_of(const lit_truth *is)
{
    return is->uncertainty + 2e-7 * largest(is->in_scattering) + 1e-12;
}

static double apart(const double a[3], const double b[3])
{
    double most = 0;
    for (int c = 0; c < 3; c++) most = fmax(most, isnan(a[c]) ? HUGE_VAL : fabs(a[c] - b[c]));
    return most;
}

/* As a multiple of what may be: more than 1 is a violation. */
static double violation(const nebel_transfer *transfer, const lit_truth *is)
{
    const double light_off = apart(transfer->in_scattering, is->in_scattering) / (transfer->error + slack_of(is));
    const double way_off = apart(transfer->transmittance, is->transmittance) / (transfer->error + 1e-9);
    return isnan(transfer->error) ? HUGE_VAL : fmax(light_off, way_off);
}

static int all_hold(nebel_transfer transfers[ASK_COUNT][RAYS], int i, const lit_truth *is)
{
    int hold = 1;
    for (int way = 0; way < ASK_COUNT; way++) hold = hold && violation(&transfers[way][i], is) <= 1;
    return hold;
}

/* The light of a sliver that the quick look may miss. A fault of nebel that is less would pass with it. */
#define OVERLOOKED 1e-11

/* Where it seems wrong the oracle looks again, more closely. So it does at some of the rays in any case, and must then see
 * what it saw before. Returns 0 where it does not know. */
static int find_truth(const lit_fog *fog, const nebel_ray *ray, nebel_transfer transfers[ASK_COUNT][RAYS], int i,
                      lit_truth *is)
{
    static size_t asked;
    if (!lit_oracle_trace(fog, ray, LIT_QUICK, is)) return 0;
    const int holds = all_hold(transfers, i, is);
    if (holds && asked++ % CLOSE_EVERY != 0) return 1;
    const lit_truth quick = *is;
    if (!lit_oracle_trace(fog, ray, LIT_CLOSE, is)) return 0;
    const double slack = slack_of(&quick) + slack_of(is) + OVERLOOKED;
    const double off = apart(quick.in_scattering, is->in_scattering) / slack;
    oracle.rays++;
    oracle.worst = fmax(oracle.worst, off);
    oracle.wrong += !(off <= 1);
    if (!(off <= 1))
        print_message("the oracle saw %.9g (+- %.1e), and then %.9g (+- %.1e)\n", quick.in_scattering[0],
                      quick.uncertainty, is->in_scattering[0], is->uncertainty);
    return 1;
}

static void judge(lit_kind kind, lit_source source, uint64_t seed, int i, nebel_transfer transfers[ASK_COUNT][RAYS],
                  const lit_truth *is)
{
    for (int way = 0; way < ASK_COUNT; way++) {
        tally *t = &tallies[kind][source][way];
        const double off = violation(&transfers[way][i], is);
        t->rays++;
        t->worst = fmax(t->worst, off);
        if (off <= 1) continue;
        t->wrong++;
        print_case(kind, source, seed, i, (way_to_ask)way, &transfers[way][i], is);
    }
}

static void try_fog(lit_kind kind, lit_source source, uint64_t seed)
{
    static lit_draw draw;
    static lit_fog fog;
    nebel_ray rays[RAYS];
    nebel_transfer transfers[ASK_COUNT][RAYS];
    const int n = lit_ray_count(kind);
    lit_draw_fog(&draw, kind, source, seed);
    lit_draw_rays(seed, rays);
    nebel_lighting *lighting = lit_draw_commit(&draw);
    assert_non_null(lighting);
    lit_fog_prepare(&draw.scene, &fog);
    for (int way = 0; way < ASK_COUNT; way++)
        ask(lighting, (way_to_ask)way, NEBEL_ISA_DEFAULT, (size_t)n, rays, transfers[way]);
    compare_all_bits(lighting, n, rays, transfers[ASK_FLOAT], &bits[kind][source]);
    for (int i = 0; i < n; i++) {
        lit_truth is;
        if (find_truth(&fog, &rays[i], transfers, i, &is))
            judge(kind, source, seed, i, transfers, &is);
        else
            undecided++;
    }
    nebel_release_lighting(lighting);
    lit_draw_free(&draw);
}

/* ---- the table ------------------------------------------------------------------------------- */

static void print_tally(const tally *t)
{
    print_message(" %9zu %4zu %5.2f", t->rays, t->wrong, t->worst);
}

static size_t print_tallies(void)
{
    size_t rays = 0, wrong = 0, other_bits = 0;
    print_message("%-12s %-6s %20s %20s %20s %20s\n", "fog", "light", way_names[0], way_names[1], way_names[2],
                  "float again");
    print_message("%-12s %-6s", "", "");
    for (int i = 0; i < ASK_COUNT; i++) print_message(" %9s %4s %5s", "rays", "bad", "worst");
    print_message(" %9s %10s\n", "rays", "other bits");
    for (int kind = 0; kind < LIT_KIND_COUNT; kind++)
        for (int source = 0; source < LIT_SOURCE_COUNT; source++) {
            const tally *t = tallies[kind][source], *b = &bits[kind][source];
            print_message("%-12s %-6s", lit_kind_names[kind], source == LIT_BY_LIGHTS ? "lights" : "sun");
            for (int way = 0; way < ASK_COUNT; way++) print_tally(&t[way]);
            print_message(" %9zu %10zu\n", b->rays, b->wrong);
            rays += t[0].rays;
            for (int way = 0; way < ASK_COUNT; way++) wrong += t[way].wrong;
            other_bits += b->wrong;
        }
    print_message("rays %zu, undecided %zu, errors too small %zu, other bits %zu\n", rays, undecided, wrong,
                  other_bits);
    print_message("the oracle looked twice at %zu rays: %zu not the same, worst %.2f\n", oracle.rays, oracle.wrong,
                  oracle.worst);
    return wrong + other_bits;
}

/* How often the oracle's quick look may be off: one that hides a fault would have to be off by as much as nebel is, in the same
 * ray, and where it shows one that is not there the closer look says so. */
#define MOST_OVERSEEN 0.005

/* Fog in which an error once was too small: tried where no other seed is asked for. */
static const struct {
    lit_kind kind;
    lit_source source;
    uint64_t seed;
} found[] = {
    {LIT_KIND_ELLIPSOID, LIT_BY_SUN, 777000011}, /* null rules that fall from degree to degree by chance */
    {LIT_KIND_EXCLUDED, LIT_BY_SUN, 777000160},  /* the way to the sun passes where surfaces of two bodies cross */
    {LIT_KIND_EXCLUDED, LIT_BY_SUN, 777000693},  /* it runs along the face of a soft box */
    {LIT_KIND_EXCLUDED, LIT_BY_SUN, 20001579},   /* the way to the sun leaves a capsule where mantle and cap meet */
    {LIT_KIND_SMALL_CROWD, LIT_BY_LIGHTS, 777000485}, /* the edge of a hard cone, where a step begins */
    {LIT_KIND_CROWD, LIT_BY_LIGHTS, 365},             /* light in a fifth of a step, most of it hidden */
};

static void errors_of_lit_fog_are_never_too_small(void **state)
{
    (void)state;
    size_t each = 0;
    for (size_t i = 0; i < sizeof found / sizeof *found && first_seed == FIRST_SEED; i++)
        try_fog(found[i].kind, found[i].source, found[i].seed);
    for (int kind = 0; kind < LIT_KIND_COUNT; kind++)
        each += (size_t)(LIT_SOURCE_COUNT * lit_ray_count((lit_kind)kind));
    for (uint64_t seed = 0; seed < (ray_count + each - 1) / each; seed++)
        for (int kind = 0; kind < LIT_KIND_COUNT; kind++)
            for (int source = 0; source < LIT_SOURCE_COUNT; source++)
                try_fog((lit_kind)kind, (lit_source)source, first_seed + seed);
    assert_int_equal(print_tallies(), 0);
    assert_true((double)oracle.wrong <= 1 + MOST_OVERSEEN * (double)oracle.rays);
    assert_true(undecided <= ray_count / 1000 + RAYS); /* of one scene more: all of its rays may be too dense */
}

int main(int argc, char **argv)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(errors_of_lit_fog_are_never_too_small)};
    ray_count = nb_test_count(25000);
    if (argc > 1) first_seed = strtoull(argv[1], NULL, 10);
    if (argc > 2) ray_count = strtoull(argv[2], NULL, 10);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
