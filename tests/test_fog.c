/* Fog that is edited, and memory that fails: after an error everything is as it was. */
#include "base/base.h"

#include <math.h>

#include "fog_help.h"

/* ---- one volume of every kind ---------------------------------------------------------------- */

static const nebel_plane octahedron[] = {{{1, 1, 1}, 2},  {{1, 1, -1}, 2},  {{1, -1, 1}, 2},  {{1, -1, -1}, 2},
                                         {{-1, 1, 1}, 2}, {{-1, 1, -1}, 2}, {{-1, -1, 1}, 2}, {{-1, -1, -1}, 2}};

static const nebel_shape two_balls[] = {{.type = NEBEL_SHAPE_SPHERE, .center = {-1, 0, 0}, .radius = 2},
                                        {.type = NEBEL_SHAPE_SPHERE, .center = {1, 0, 0}, .radius = 2}};

static const nebel_shape nested[] = {
    {.type = NEBEL_SHAPE_INTERSECTION, .parts = two_balls, .part_count = 2},
    {.type = NEBEL_SHAPE_CONVEX, .planes = octahedron, .plane_count = 8, .transform = {.position = {3, 0, 0}}}};

#define LIGHT .extinction = {.1, .2, .3}, .source = {.5, .6, .7}

static const nebel_volume_desc kinds[] = {
    {.shape = {.type = NEBEL_SHAPE_WORLD}, LIGHT, .density = {.type = NEBEL_DENSITY_HEIGHT, .scale_height = 8}},
    {.shape = {.type = NEBEL_SHAPE_HALF_SPACE, .normal = {0, 1, 0}}, LIGHT},
    {.shape = {.type = NEBEL_SHAPE_BOX, .min = {-2, -1, -3}, .max = {1, 2, 3}},
     .density = {.type = NEBEL_DENSITY_SOFT_EDGE, .edge_width = .5},
     LIGHT},
    {.shape = {.type = NEBEL_SHAPE_SPHERE, .radius = 3}, .density = {.type = NEBEL_DENSITY_RADIAL, .power = 2}, LIGHT},
    {.shape = {.type = NEBEL_SHAPE_ELLIPSOID, .radii = {1, 2, 3}}, LIGHT, .emission = {.1, .1, .1}},
    {.shape = {.type = NEBEL_SHAPE_CYLINDER, .from = {0, -1, 0}, .to = {0, 1, 0}, .radius = 1}, LIGHT},
    {.shape = {.type = NEBEL_SHAPE_CAPSULE, .from = {0, -1, 0}, .to = {0, 1, 0}, .radius = 1},
     .density = {.type = NEBEL_DENSITY_GAUSSIAN, .sigma = 2},
     LIGHT},
    {.shape = {.type = NEBEL_SHAPE_CONE, .from = {0, -1, 0}, .to = {0, 1, 0}, .radius_from = 2}, LIGHT},
    {.shape = {.type = NEBEL_SHAPE_CONVEX, .planes = octahedron, .plane_count = 8}, LIGHT},
    {.shape = {.type = NEBEL_SHAPE_UNION, .parts = nested, .part_count = 2}, LIGHT},
    {.shape = {.type = NEBEL_SHAPE_INTERSECTION, .parts = two_balls, .part_count = 2},
     .density = {.type = NEBEL_DENSITY_LINEAR, .to = {0, 3, 0}},
     LIGHT},
    {.operation = NEBEL_OPERATION_EXCLUDE, .shape = {.type = NEBEL_SHAPE_SPHERE, .center = {4, 0, 0}, .radius = 1}},
};
enum { KINDS = sizeof kinds / sizeof kinds[0] };

/* ---- what a fog is, as its queries see it ---------------------------------------------------- */

enum { PROBES = 5 };

typedef struct fingerprint {
    size_t count;
    nebel_transfer transfers[PROBES];
} fingerprint;

static fingerprint look_at(const nebel_snapshot *snapshot, const nebel_lighting *lighting)
{
    static const nebel_ray rays[PROBES] = {{{-9, .3, .2}, {1, 0, 0}, 20},
                                           {{0, 9, .1}, {.1, -1, 0}, 30},
                                           {{5, 5, 5}, {-1, -1, -1}, HUGE_VAL},
                                           {{.1, .2, .3}, {0, 0, 1}, 2},
                                           {{-8, -.5, 0}, {2, .1, 0}, 100}};
    fingerprint print;
    memset(&print, 0, sizeof print);
    print.count = nebel_get_volume_count(snapshot);
    assert_int_equal(nebel_trace(snapshot, &(nebel_trace_desc){.lighting = lighting}, PROBES, rays, sizeof rays[0],
                                 print.transfers, sizeof print.transfers[0]),
                     NEBEL_OK);
    return print;
}

static fingerprint look_at_fog(nebel_fog *fog)
{
    nebel_snapshot *snapshot = NULL;
    assert_int_equal(nebel_commit_fog(fog, &snapshot), NEBEL_OK);
    const fingerprint print = look_at(snapshot, NULL);
    nebel_release_snapshot(snapshot);
    return print;
}

static void assert_same(const fingerprint *a, const fingerprint *b)
{
    assert_memory_equal(a, b, sizeof *a);
}

static void assert_different(const fingerprint *a, const fingerprint *b)
{
    assert_memory_not_equal(a, b, sizeof *a);
}

/* ---- every allocation fails once, alone and with all that follow ----------------------------- */

typedef struct bench {
    fog_memory memory;
    fog_messages messages;
    nebel_fog *fog;
    nebel_snapshot *snapshot;
    nebel_volume_id id; /* of some volume in the fog */
    const nebel_volume_desc *desc;
    size_t ray_count;
} bench;

static nebel_fog *make_fog(bench *b)
{
    const nebel_fog_desc desc = {
        .host = {.allocator = fog_memory_allocator(&b->memory), .log = fog_messages_log(&b->messages)}};
    nebel_fog *fog = NULL;
    assert_int_equal(nebel_create_fog(&desc, &fog), NEBEL_OK);
    return fog;
}

typedef nebel_result act(bench *b);

/* Runs the act with its k-th allocation failing, for all k. Returns how many there were. */
static size_t fail_each(bench *b, act *perform, size_t in_a_row)
{
    for (size_t k = 1;; k++) {
        const size_t live = b->memory.live, messages = b->messages.count;
        fingerprint before;
        if (b->fog != NULL) before = look_at_fog(b->fog);
        b->memory.fail_first = k;
        b->memory.fail_count = in_a_row;
        const nebel_result result = perform(b);
        const int used = b->memory.fail_first == 0 || b->memory.fail_count < in_a_row;
        b->memory.fail_first = 0;
        if (!used) {
            assert_int_equal(result, NEBEL_OK);
            return k - 1;
        }
        assert_int_equal(result, NEBEL_ERROR_MEMORY);
        assert_int_equal(b->messages.result, NEBEL_ERROR_MEMORY);
        assert_int_equal(b->messages.count, messages + 1);
        assert_int_equal(b->memory.live, live);
        if (b->fog == NULL) continue;
        const fingerprint after = look_at_fog(b->fog);
        assert_same(&before, &after);
    }
}

/* As a whole, with a fog of every kind of volume. */
static size_t fail_each_in_fog(act *perform, act *undo, const nebel_volume_desc *desc, size_t volumes)
{
    size_t least = SIZE_MAX;
    for (size_t in_a_row = 1; in_a_row <= 1000; in_a_row *= 1000) {
        bench b = {.desc = desc};
        b.fog = make_fog(&b);
        for (size_t i = 0; i < volumes; i++)
            assert_int_equal(nebel_add_volume(b.fog, &kinds[i % KINDS], &b.id), NEBEL_OK);
        const size_t count = fail_each(&b, perform, in_a_row);
        least = count < least ? count : least;
        if (undo != NULL) assert_int_equal(undo(&b), NEBEL_OK);
        nebel_destroy_fog(b.fog);
        assert_int_equal(b.memory.live, 0);
    }
    return least;
}

static nebel_result create(bench *b)
{
    const nebel_fog_desc desc = {
        .host = {.allocator = fog_memory_allocator(&b->memory), .log = fog_messages_log(&b->messages)}};
    nebel_fog *fog = (nebel_fog *)&desc;
    const nebel_result result = nebel_create_fog(&desc, &fog);
    if (result != NEBEL_OK) assert_null(fog);
    nebel_destroy_fog(fog);
    return result;
}

static void test_creation_survives_lost_memory(void **unused)
{
    (void)unused;
    bench b = {.desc = NULL};
    assert_true(fail_each(&b, create, 1) >= 1);
    assert_int_equal(b.memory.live, 0);
}

static nebel_result add(bench *b)
{
    return nebel_add_volume(b->fog, b->desc, NULL);
}

static void test_adding_survives_lost_memory(void **unused)
{
    (void)unused;
    for (size_t kind = 0; kind < KINDS; kind++) {
        assert_true(fail_each_in_fog(add, NULL, &kinds[kind], 0) >= 2); /* the volume and its slot */
        assert_true(fail_each_in_fog(add, NULL, &kinds[kind], 3) >= 1);
        assert_true(fail_each_in_fog(add, NULL, &kinds[kind], 8) >= 2); /* the slots grow */
    }
}

static nebel_result change(bench *b)
{
    return nebel_update_volume(b->fog, b->id, b->desc);
}

static void test_changing_survives_lost_memory(void **unused)
{
    (void)unused;
    for (size_t kind = 0; kind < KINDS; kind++) assert_true(fail_each_in_fog(change, NULL, &kinds[kind], KINDS) >= 1);
}

static nebel_result remove_last(bench *b)
{
    return nebel_remove_volume(b->fog, b->id);
}

static void test_removing_needs_no_memory(void **unused)
{
    (void)unused;
    assert_int_equal(fail_each_in_fog(remove_last, NULL, NULL, KINDS), 0);
}

static nebel_result commit(bench *b)
{
    b->snapshot = (nebel_snapshot *)b;
    const nebel_result result = nebel_commit_fog(b->fog, &b->snapshot);
    if (result != NEBEL_OK) assert_null(b->snapshot);
    return result;
}

static nebel_result release(bench *b)
{
    nebel_release_snapshot(b->snapshot);
    return NEBEL_OK;
}

static void test_committing_survives_lost_memory(void **unused)
{
    (void)unused;
    assert_true(fail_each_in_fog(commit, release, NULL, 0) >= 1);
    assert_true(fail_each_in_fog(commit, release, NULL, 40) >= 40);
}

/* ---- the same for queries -------------------------------------------------------------------- */

enum { RAYS = 11, CROWD = 300 };

/* `crowd` balls of fog that all rays run through, some of them of another kind, so that no box kernel takes them. */
static void open_crowd(bench *b, size_t crowd)
{
    b->fog = make_fog(b);
    for (size_t i = 0; i < crowd; i++) {
        const nebel_shape ball = {.type = NEBEL_SHAPE_SPHERE, .center = {(double)i * .01, 0, 0}, .radius = 5};
        const nebel_volume_desc desc = {.shape = i % 5 == 0 ? kinds[i / 5 % KINDS].shape : ball, LIGHT};
        assert_int_equal(nebel_add_volume(b->fog, &desc, NULL), NEBEL_OK);
    }
    assert_int_equal(nebel_commit_fog(b->fog, &b->snapshot), NEBEL_OK);
    nebel_destroy_fog(b->fog);
    b->fog = NULL;
}

static void make_rays(nebel_ray rays[RAYS])
{
    for (int i = 0; i < RAYS; i++) rays[i] = (nebel_ray){{-9, .1 * i, .05 * i}, {1, -.01 * i, 0}, 30};
}

static nebel_result trace(bench *b, nebel_precision precision)
{
    nebel_ray rays[RAYS];
    nebel_transfer transfers[RAYS];
    size_t failed = RAYS;
    make_rays(rays);
    const nebel_trace_desc desc = {.precision = precision, .failed_ray = &failed};
    const nebel_result result =
        nebel_trace(b->snapshot, &desc, b->ray_count, rays, sizeof rays[0], transfers, sizeof transfers[0]);
    assert_true((result == NEBEL_OK) == (failed == RAYS));
    return result;
}

static nebel_result trace_double(bench *b)
{
    return trace(b, NEBEL_PRECISION_DOUBLE);
}

static nebel_result trace_float(bench *b)
{
    return trace(b, NEBEL_PRECISION_FLOAT);
}

static nebel_result find(bench *b)
{
    nebel_ray rays[RAYS];
    double distances[RAYS];
    make_rays(rays);
    return nebel_invert_transmittance(b->snapshot, .5, 1, b->ray_count, rays, sizeof rays[0], distances);
}

static nebel_result transmit(bench *b)
{
    float to[RAYS][3], out[RAYS];
    for (int i = 0; i < RAYS; i++) {
        to[i][0] = 18;
        to[i][1] = .1f * (float)i;
        to[i][2] = 0;
    }
    const nebel_segments segments = {.origin = {-9, 0, 0}, .to = &to[0][0], .to_stride = sizeof to[0]};
    return nebel_compute_segment_transmittance(b->snapshot, NEBEL_ISA_DEFAULT, 0, b->ray_count, &segments, out, 0);
}

static size_t fail_each_in_query(act *query, size_t crowd, size_t ray_count)
{
    bench b = {.ray_count = ray_count};
    open_crowd(&b, crowd);
    const fingerprint before = look_at(b.snapshot, NULL);
    const size_t count = fail_each(&b, query, 1);
    assert_int_equal(fail_each(&b, query, 1000), count);
    const fingerprint after = look_at(b.snapshot, NULL);
    assert_same(&before, &after);
    nebel_release_snapshot(b.snapshot);
    assert_int_equal(b.memory.live, 0);
    return count;
}

static void test_queries_survive_lost_memory(void **unused)
{
    (void)unused;
    act *const queries[] = {trace_double, trace_float, find, transmit};
    for (size_t i = 0; i < sizeof queries / sizeof queries[0]; i++) {
        assert_int_equal(fail_each_in_query(queries[i], 0, RAYS), 0);
        assert_int_equal(fail_each_in_query(queries[i], 4, RAYS), 0);
        assert_true(fail_each_in_query(queries[i], CROWD, 1) >= 3); /* what is found, contacts, intervals */
        assert_true(fail_each_in_query(queries[i], CROWD, RAYS) >= 3);
    }
}

/* ---- editing --------------------------------------------------------------------------------- */

static nebel_fog *plain_fog(void)
{
    nebel_fog *fog = NULL;
    assert_int_equal(nebel_create_fog(&(nebel_fog_desc){0}, &fog), NEBEL_OK);
    return fog;
}

static nebel_volume_id must_add(nebel_fog *fog, const nebel_volume_desc *desc)
{
    nebel_volume_id id = 0;
    assert_int_equal(nebel_add_volume(fog, desc, &id), NEBEL_OK);
    assert_true(id != 0);
    return id;
}

static void test_ids_are_never_used_again_and_stale_ones_are_refused(void **unused)
{
    (void)unused;
    enum { ROUNDS = 200 };
    static nebel_volume_id ids[ROUNDS];
    nebel_fog *const fog = plain_fog();
    const nebel_volume_id first = must_add(fog, &kinds[0]);
    for (int i = 0; i < ROUNDS; i++) {
        ids[i] = must_add(fog, &kinds[i % KINDS]);
        for (int j = 0; j < i; j++) assert_true(ids[j] != ids[i]);
        if (i % 3 != 0) assert_int_equal(nebel_remove_volume(fog, ids[i]), NEBEL_OK);
    }
    const fingerprint before = look_at_fog(fog);
    for (int i = 0; i < ROUNDS; i++) {
        if (i % 3 == 0) continue;
        assert_int_equal(nebel_remove_volume(fog, ids[i]), NEBEL_ERROR_ARGUMENT);
        assert_int_equal(nebel_update_volume(fog, ids[i], &kinds[1]), NEBEL_ERROR_ARGUMENT);
    }
    const nebel_volume_id unknown[] = {0, 1, UINT64_MAX, first + 1000000, first ^ (nebel_volume_id)7 << 32};
    for (size_t i = 0; i < sizeof unknown / sizeof unknown[0]; i++) {
        if (unknown[i] == first) continue;
        assert_int_equal(nebel_remove_volume(fog, unknown[i]), NEBEL_ERROR_ARGUMENT);
        assert_int_equal(nebel_update_volume(fog, unknown[i], &kinds[1]), NEBEL_ERROR_ARGUMENT);
    }
    const fingerprint after = look_at_fog(fog);
    assert_same(&before, &after);
    assert_int_equal(after.count, 1 + (ROUNDS + 2) / 3);
    nebel_destroy_fog(fog);
}

static void test_a_changed_volume_keeps_its_id(void **unused)
{
    (void)unused;
    nebel_fog *const fog = plain_fog();
    const nebel_volume_id id = must_add(fog, &kinds[3]);
    const fingerprint ball = look_at_fog(fog);
    assert_int_equal(nebel_update_volume(fog, id, &kinds[9]), NEBEL_OK);
    const fingerprint parts = look_at_fog(fog);
    assert_different(&ball, &parts);
    const nebel_volume_desc wrong = {.extinction = {-1, 0, 0}};
    assert_int_equal(nebel_update_volume(fog, id, &wrong), NEBEL_ERROR_VALUE);
    const fingerprint still = look_at_fog(fog);
    assert_same(&parts, &still);
    assert_int_equal(nebel_update_volume(fog, id, &kinds[3]), NEBEL_OK);
    const fingerprint again = look_at_fog(fog);
    assert_same(&ball, &again);
    assert_int_equal(nebel_remove_volume(fog, id), NEBEL_OK);
    assert_int_equal(look_at_fog(fog).count, 0);
    nebel_destroy_fog(fog);
}

static void test_volumes_give_the_same_bits_in_any_order_and_after_any_history(void **unused)
{
    (void)unused;
    nebel_fog *const forwards = plain_fog(), *const backwards = plain_fog();
    for (int i = 0; i < KINDS; i++) must_add(forwards, &kinds[i]);
    nebel_volume_id passing[KINDS];
    for (int i = 0; i < KINDS; i++) passing[i] = must_add(backwards, &kinds[(i * 5) % KINDS]);
    for (int i = KINDS - 1; i >= 0; i--) {
        assert_int_equal(nebel_remove_volume(backwards, passing[(i * 7) % KINDS]), NEBEL_OK);
        must_add(backwards, &kinds[i]);
    }
    const fingerprint a = look_at_fog(forwards), b = look_at_fog(backwards);
    assert_int_equal(a.count, KINDS);
    assert_same(&a, &b);
    nebel_destroy_fog(forwards);
    nebel_destroy_fog(backwards);
}

static void test_a_snapshot_outlives_changes_and_the_fog(void **unused)
{
    (void)unused;
    fog_memory memory = {0};
    nebel_fog *fog = NULL;
    nebel_snapshot *snapshot = NULL;
    assert_int_equal(nebel_create_fog(&(nebel_fog_desc){.host.allocator = fog_memory_allocator(&memory)}, &fog),
                     NEBEL_OK);
    nebel_volume_id ids[KINDS];
    for (int i = 0; i < KINDS; i++) ids[i] = must_add(fog, &kinds[i]);
    assert_int_equal(nebel_commit_fog(fog, &snapshot), NEBEL_OK);
    const fingerprint before = look_at(snapshot, NULL);
    for (int i = 0; i < KINDS; i += 2) assert_int_equal(nebel_remove_volume(fog, ids[i]), NEBEL_OK);
    assert_int_equal(nebel_update_volume(fog, ids[1], &kinds[2]), NEBEL_OK);
    assert_int_equal(nebel_set_max_opacity(fog, .5), NEBEL_OK);
    const fingerprint changed = look_at(snapshot, NULL);
    nebel_destroy_fog(fog);
    const fingerprint orphan = look_at(snapshot, NULL);
    assert_same(&before, &changed);
    assert_same(&before, &orphan);

    assert_ptr_equal(nebel_retain_snapshot(snapshot), snapshot);
    nebel_release_snapshot(snapshot);
    const fingerprint retained = look_at(snapshot, NULL);
    assert_same(&before, &retained);
    assert_true(memory.live > 0);
    nebel_release_snapshot(snapshot);
    assert_int_equal(memory.live, 0);
}

static void test_ambient_light_is_in_its_lighting_only(void **unused)
{
    (void)unused;
    const nebel_volume_desc lit = {.extinction = {.1, .1, .1}, .albedo = {.5, .6, .7}};
    nebel_snapshot *snapshot = fog_commit(&(nebel_fog_desc){0}, &lit, 1);
    const double ambient[3] = {1, 2, 4};
    nebel_lighting_desc lights = {.environment = {.radiance = {1, 2, 4}}};
    nebel_lighting *lighting = light_fog(snapshot, &lights), *none = NULL;
    const double wrong[] = {-1, (double)NAN};
    for (int i = 0; i < 2; i++) {
        lights.environment.radiance[1] = wrong[i];
        assert_int_equal(nebel_create_lighting(snapshot, &lights, &none), NEBEL_ERROR_VALUE);
        assert_null(none);
    }
    const fingerprint bright = look_at(snapshot, lighting), dark = look_at(snapshot, NULL);
    for (int i = 0; i < PROBES; i++)
        for (int c = 0; c < 3; c++) {
            const double T = bright.transfers[i].transmittance[c];
            assert_true(dark.transfers[i].transmittance[c] == T);
            assert_true(dark.transfers[i].in_scattering[c] == 0);
            assert_true(fabs(bright.transfers[i].in_scattering[c] - lit.albedo[c] * ambient[c] * (1 - T)) < 1e-14);
        }
    nebel_release_lighting(lighting);
    nebel_release_snapshot(snapshot);
}

/* A product that wraps around must not become a little memory. */
static void test_counts_beyond_all_memory_are_refused(void **state)
{
    (void)state;
    fog_memory memory = {0};
    const nebel_allocator allocator = fog_memory_allocator(&memory);
    for (size_t size = 2; size <= 1024; size *= 2) {
        assert_null(nb_allocate(&allocator, SIZE_MAX / size + 2, size));
        assert_null(nb_allocate_zero(&allocator, SIZE_MAX / size + 2, size));
    }
    assert_int_equal(memory.calls, 0);
}

static void test_empty_descriptions_are_valid(void **unused)
{
    (void)unused;
    nebel_fog *const fog = plain_fog();
    const fingerprint nothing = look_at_fog(fog);
    assert_int_equal(nebel_add_volume(fog, &(nebel_volume_desc){0}, NULL), NEBEL_OK);
    const fingerprint clear = look_at_fog(fog);
    assert_int_equal(nothing.count, 0);
    assert_int_equal(clear.count, 1);
    for (int i = 0; i < PROBES; i++)
        for (int c = 0; c < 3; c++) {
            assert_true(nothing.transfers[i].transmittance[c] == 1 && nothing.transfers[i].in_scattering[c] == 0);
            assert_true(clear.transfers[i].transmittance[c] == 1 && clear.transfers[i].in_scattering[c] == 0);
        }
    nebel_destroy_fog(fog);
}

/* ---- names and texts ------------------------------------------------------------------------- */

static void test_the_version_is_that_of_the_header(void **unused)
{
    (void)unused;
    char expected[64];
    snprintf(expected, sizeof expected, "%d.%d.%d", NEBEL_VERSION_MAJOR, NEBEL_VERSION_MINOR, NEBEL_VERSION_PATCH);
    assert_string_equal(nebel_version(), expected);
}

static void test_every_result_has_a_text_of_its_own(void **unused)
{
    (void)unused;
    static const nebel_result results[] = {
#define RESULT_VALUE(name, value, text) NEBEL_##name,
        NEBEL_RESULTS(RESULT_VALUE)
#undef RESULT_VALUE
    };
    static const char *const texts[] = {
#define RESULT_TEXT(name, value, text) text,
        NEBEL_RESULTS(RESULT_TEXT)
#undef RESULT_TEXT
    };
    for (size_t i = 0; i < sizeof results / sizeof results[0]; i++) {
        assert_string_equal(nebel_result_text(results[i]), texts[i]);
        for (size_t j = 0; j < i; j++) assert_string_not_equal(texts[i], texts[j]);
    }
    const int unknown[] = {1, 99, -10, -1000, INT32_MAX, INT32_MIN};
    for (size_t i = 0; i < sizeof unknown / sizeof unknown[0]; i++) {
        const char *const text = nebel_result_text((nebel_result)unknown[i]);
        assert_non_null(text);
        assert_true(text[0] != 0);
        for (size_t j = 0; j < sizeof texts / sizeof texts[0]; j++) assert_string_not_equal(text, texts[j]);
    }
}

static void test_instruction_sets_have_names(void **unused)
{
    (void)unused;
    static const char *const names[] = {"default", "scalar", "sse2", "avx2", "avx512", "neon"};
    assert_int_equal(sizeof names / sizeof names[0], NEBEL_ISA_COUNT);
    for (int i = 0; i < NEBEL_ISA_COUNT; i++) assert_string_equal(nebel_isa_name((nebel_isa)i), names[i]);
    for (int i = -3; i < 100; i = i < 0 ? i + 1 : i * 2 + NEBEL_ISA_COUNT) {
        if (i >= 0 && i < NEBEL_ISA_COUNT) i = NEBEL_ISA_COUNT;
        assert_string_equal(nebel_isa_name((nebel_isa)i), "unknown");
        assert_int_equal(nebel_isa_available((nebel_isa)i), 0);
    }
    assert_int_equal(nebel_isa_available(NEBEL_ISA_DEFAULT), 1);
    assert_int_equal(nebel_isa_available(NEBEL_ISA_SCALAR), 1);
}

static void test_visibility_gives_the_extinction_that_leaves_the_contrast(void **unused)
{
    (void)unused;
    assert_true(fabs(nebel_extinction_from_visibility(1000, 0) * 1000 + log(.05)) < 1e-15 * 3);
    assert_true(fabs(nebel_extinction_from_visibility(60, .02) * 60 + log(.02)) < 1e-15 * 4);
    const double wrong[][2] = {{0, 0},  {-1, 0},   {(double)NAN, 0},  {10, 1},
                               {10, 2}, {10, -.1}, {10, (double)NAN}, {10, HUGE_VAL}};
    for (size_t i = 0; i < sizeof wrong / sizeof wrong[0]; i++)
        assert_true(isnan(nebel_extinction_from_visibility(wrong[i][0], wrong[i][1])));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_creation_survives_lost_memory),
        cmocka_unit_test(test_adding_survives_lost_memory),
        cmocka_unit_test(test_changing_survives_lost_memory),
        cmocka_unit_test(test_removing_needs_no_memory),
        cmocka_unit_test(test_committing_survives_lost_memory),
        cmocka_unit_test(test_queries_survive_lost_memory),
        cmocka_unit_test(test_ids_are_never_used_again_and_stale_ones_are_refused),
        cmocka_unit_test(test_a_changed_volume_keeps_its_id),
        cmocka_unit_test(test_volumes_give_the_same_bits_in_any_order_and_after_any_history),
        cmocka_unit_test(test_a_snapshot_outlives_changes_and_the_fog),
        cmocka_unit_test(test_ambient_light_is_in_its_lighting_only),
        cmocka_unit_test(test_counts_beyond_all_memory_are_refused),
        cmocka_unit_test(test_empty_descriptions_are_valid),
        cmocka_unit_test(test_the_version_is_that_of_the_header),
        cmocka_unit_test(test_every_result_has_a_text_of_its_own),
        cmocka_unit_test(test_instruction_sets_have_names),
        cmocka_unit_test(test_visibility_gives_the_extinction_that_leaves_the_contrast),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
