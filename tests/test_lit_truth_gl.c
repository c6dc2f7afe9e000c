/* The random lit fog of test_lit_truth in shaders, against brute force: off by no more than docs/shaders.md says. Prints how
 * many rays were tried of each kind of fog and light.
 *
 *     test_lit_truth_gl [SEED [SEEDS [KIND]]]
 */
#include "lit_oracle.h"
#include "lit_scenes.h"
#include "shader_help.h"

typedef struct tally {
    size_t rays, wrong, cut, ill; /* ill: the ray's own rounding matters as much */
    double worst;
    double off[1 << 14];
} tally;

static tally tallies[LIT_KIND_COUNT][LIT_SOURCE_COUNT];
static uint64_t first_seed = 1;
static size_t seed_count;
static int only_kind = -1;
static lit_draw draw;

/* Mesa's llvmpipe ends loops after 65,535 turns, those of all rays of a vector together: a vector has one ray alone. Rays that
 * take more turns than docs/shaders.md calls right for it may be cut off. */
enum { VECTOR = 16, MAX_TURNS = 24000 };

static const char counted_body[] =
    "nb_progress progress = nb_open_progress();\n"
    "nb_media media = nb_media_of(0, int(NEBEL_FOG_TEXEL(0).x), false);\n"
    "nebel_transfer l = nb_trace_further(progress, nb_ray_up_to(in0.xyz, in1.xyz, in0.w, true), media, true, true);\n"
    "out0 = vec4(l.transmittance, float(progress.turns)); out1 = vec4(l.in_scattering, 0.0);\n";

/* The most extinction that a ray meets before nothing is seen, at places of each piece of it. */
static double densest_fog(const lit_fog *lit, const nebel_ray *ray)
{
    enum { PLACES = 32 };
    static lit_map m;
    lit_marks there;
    lit_line l;
    double most = 0, depth[3] = {0, 0, 0};
    memcpy(l.o, ray->origin, sizeof l.o);
    memcpy(l.d, ray->direction, sizeof l.d);
    lit_fog_map(lit, &l, ray->t_max, &m);
    for (size_t i = 0; i + 1 < m.event_count; i++) {
        const double a = m.events[i], b = m.events[i + 1];
        if (!(b > a)) continue;
        lit_fog_mark(lit, &m, 0.5 * (a + b), &there);
        for (int k = 0; k < PLACES && depth[0] < 20; k++) {
            const double from = a + (b - a) * k / PLACES, to = a + (b - a) * (k + 1) / PLACES;
            double extinction = 0;
            for (size_t v = 0; v < there.count; v++)
                extinction += lit->scene->volumes[there.volumes[v]].extinction[0] *
                              lit_fog_density(lit, there.volumes[v], &l, from);
            most = fmax(most, extinction);
            lit_fog_add_depth(lit, &l, &there, from, to, depth);
        }
    }
    return most;
}

/* Floats round places. Where that changes depths by as much as a grey level, they do not tell the places apart from which light
 * comes. */
static int is_grained(const lit_fog *lit, const nebel_ray *ray)
{
    double farthest = 0;
    for (int k = 0; k < 3; k++) farthest = fmax(farthest, fabs(ray->origin[k]));
    return densest_fog(lit, ray) * 2 * farthest * ldexp(1, -24) > 1. / 255;
}

static void judge(const lit_fog *lit, lit_kind kind, lit_source source, uint64_t seed, const nebel_lighting *lighting,
                  int i, const lit_truth *is)
{
    static const double origin[3];
    tally *t = &tallies[kind][source];
    nebel_transfer truth = {.error = 0};
    memcpy(truth.transmittance, is->transmittance, sizeof truth.transmittance);
    memcpy(truth.in_scattering, is->in_scattering, sizeof truth.in_scattering);
    const double scale = fmax(1, fmax(fmax(is->in_scattering[0], is->in_scattering[1]), is->in_scattering[2]));
    if (answers[VECTOR * i].transmittance[3] > MAX_TURNS) {
        t->cut++;
        return;
    }
    const double off = worst_of(&answers[VECTOR * i], &truth, scale);
    if (t->rays < 1 << 14) t->off[t->rays] = off;
    t->rays++;
    if (off > 1. / 255 && (is_grained(lit, &rays[VECTOR * i]) ||
                           off < 2 * conditioning(lighting, &precise, &rays[VECTOR * i], origin, scale))) {
        t->ill++;
        return;
    }
    t->worst = fmax(t->worst, off);
    if (off <= 1. / 255) return;
    t->wrong++;
    print_message("%s, %s, seed %llu, ray %d: %.6g %.6g %.6g, not %.6g %.6g %.6g; T %.6g, not %.6g\n",
                  lit_kind_names[kind], source == LIT_BY_LIGHTS ? "lights" : "sun", (unsigned long long)seed, i,
                  (double)answers[VECTOR * i].in_scattering[0], (double)answers[VECTOR * i].in_scattering[1],
                  (double)answers[VECTOR * i].in_scattering[2], is->in_scattering[0], is->in_scattering[1],
                  is->in_scattering[2], (double)answers[VECTOR * i].transmittance[0], is->transmittance[0]);
}

static void try_scene(tracer *t, lit_kind kind, lit_source source, uint64_t seed)
{
    static lit_fog lit;
    static const double origin[3];
    nebel_ray drawn[LIT_RAYS_EACH];
    const int n = lit_ray_count(kind);
    lit_draw_fog(&draw, kind, source, seed);
    lit_draw_rays(seed, drawn);
    nebel_lighting *lighting = lit_draw_commit(&draw);
    assert_non_null(lighting);
    lit_fog_prepare(&draw.scene, &lit);
    for (int i = 0; i < VECTOR * n; i++) set_ray(i, &drawn[i / VECTOR], origin);
    pack_and_upload(t, lighting, origin);
    if (draw.grid != NULL) upload_voxels(t, lighting);
    if (!nb_gl_evaluate(&t->gl, t->program, (size_t)(VECTOR * n), (const float *)items, (float *)answers))
        fail_msg("%s", t->gl.fault);
    for (int i = 0; i < n; i++) {
        lit_truth is;
        if (lit_oracle_trace(&lit, &rays[VECTOR * i], LIT_QUICK, &is))
            judge(&lit, kind, source, seed, lighting, i, &is);
    }
    nebel_release_lighting(lighting);
    lit_draw_free(&draw);
}

/* What a program must have for all scenes of some kinds. */
static uint32_t features_of(lit_kind first, lit_kind last, lit_source source)
{
    uint32_t features = 0;
    for (int kind = (int)first; kind <= (int)last; kind++)
        for (uint64_t seed = 0; seed < seed_count; seed++) {
            lit_draw_fog(&draw, (lit_kind)kind, source, first_seed + seed);
            nebel_lighting *lighting = lit_draw_commit(&draw);
            assert_non_null(lighting);
            features |= (uint32_t)nebel_pack_features(lighting);
            nebel_release_lighting(lighting);
            lit_draw_free(&draw);
        }
    return features;
}

/* Compiling takes far longer than all rays: one program for all kinds from `first` to `last`. */
static void try_kinds(lit_kind first, lit_kind last, lit_source source)
{
    char defines[128];
    tracer t;
    snprintf(defines, sizeof defines,
             "#define NEBEL_FEATURES_LITERAL\n#define NEBEL_VOXELS\n#define NEBEL_FEATURES %u\n#define "
             "NEBEL_MAX_RADIANCE 1e9\n",
             (unsigned)features_of(first, last, source));
    open_tracer(&t, NB_GL_330, TEXTURE, defines, counted_body);
    for (int kind = (int)first; kind <= (int)last; kind++)
        for (uint64_t seed = 0; seed < seed_count; seed++) try_scene(&t, (lit_kind)kind, source, first_seed + seed);
    nb_gl_close(&t.gl);
}

static size_t print_tallies(void)
{
    size_t rays_in_all = 0, wrong = 0;
    print_message("%-12s %-6s %9s %5s %5s %5s %9s %9s %9s\n", "fog", "light", "rays", "bad", "ill", "cut", "median",
                  "99 %", "worst");
    for (int kind = 0; kind < LIT_KIND_COUNT; kind++)
        for (int source = 0; source < LIT_SOURCE_COUNT; source++) {
            tally *t = &tallies[kind][source];
            const size_t n = t->rays < 1 << 14 ? t->rays : 1 << 14;
            if (n == 0) continue;
            qsort(t->off, n, sizeof t->off[0], ascending);
            print_message("%-12s %-6s %9zu %5zu %5zu %5zu %9.1e %9.1e %9.1e\n", lit_kind_names[kind],
                          source == LIT_BY_LIGHTS ? "lights" : "sun", t->rays, t->wrong, t->ill, t->cut, t->off[n / 2],
                          t->off[n * 99 / 100], t->worst);
            rays_in_all += t->rays;
            wrong += t->wrong;
        }
    print_message("rays %zu, off by more than 1/255: %zu\n", rays_in_all, wrong);
    return wrong;
}

static void lit_fog_in_shaders_is_as_exact_as_the_document_says(void **state)
{
    (void)state;
    for (int source = 0; source < LIT_SOURCE_COUNT; source++) {
        if (only_kind >= 0) {
            try_kinds((lit_kind)only_kind, (lit_kind)only_kind, (lit_source)source);
            continue;
        }
        try_kinds(0, LIT_KIND_SMALL_CROWD, (lit_source)source); /* more bodies take more turns than llvmpipe has */
        try_kinds(LIT_KIND_VOXELS, LIT_KIND_VOXELS, (lit_source)source);
    }
    assert_int_equal(print_tallies(), 0);
}

int main(int argc, char **argv)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(lit_fog_in_shaders_is_as_exact_as_the_document_says)};
    seed_count = nb_test_count(30);
    if (argc > 1) first_seed = strtoull(argv[1], NULL, 10);
    if (argc > 2) seed_count = strtoull(argv[2], NULL, 10);
    if (argc > 3) only_kind = atoi(argv[3]) % LIT_KIND_COUNT;
    return cmocka_run_group_tests(tests, NULL, NULL);
}
