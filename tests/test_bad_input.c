/* What is not legal is refused: the right code, a message that names the thing and the rule, and nothing has changed.
 */
#include <math.h>

#include "fog_help.h"

#define NOT_A_NUMBER ((double)NAN)
#define ENDLESS HUGE_VAL
#define VALUE NEBEL_ERROR_VALUE
#define ARGUMENT NEBEL_ERROR_ARGUMENT
#define LIMIT NEBEL_ERROR_LIMIT

static nebel_fog *make_fog(fog_memory *memory, fog_messages *messages)
{
    nebel_fog *fog = NULL;
    const nebel_fog_desc desc = {
        .host = {.allocator = fog_memory_allocator(memory), .log = fog_messages_log(messages)}};
    assert_int_equal(nebel_create_fog(&desc, &fog), NEBEL_OK);
    return fog;
}

/* ---- volumes --------------------------------------------------------------------------------- */

typedef struct bad_volume {
    nebel_volume_desc desc;
    nebel_result result;
    const char *thing, *rule; /* words of the message */
} bad_volume;

#define SHAPE(kind, ...) .shape = {.type = NEBEL_SHAPE_##kind, __VA_ARGS__}
#define DENSITY(kind, ...) .density = {.type = NEBEL_DENSITY_##kind, __VA_ARGS__}
#define TURNED(...) SHAPE(SPHERE, .radius = 1, .transform = {__VA_ARGS__})

static const nebel_plane planes_without_normal[] = {{{0, 0, 0}, 1}};
static const nebel_plane planes_not_finite[] = {{{1, 0, 0}, 1}, {{0, 1, 0}, (double)INFINITY}};
static const nebel_plane planes_of_no_number[] = {{{1, (double)NAN, 0}, 1}};
static const nebel_plane planes_apart[] = {{{1, 0, 0}, -1}, {{-1, 0, 0}, -1}};
static const nebel_plane planes_flat[] = {{{1, 0, 0}, 1}, {{-1, 0, 0}, -1}};
static const nebel_plane planes_too_far[] = {{{1, 0, 0}, 2e15}};
static const nebel_shape part_without_radius[] = {{.type = NEBEL_SHAPE_SPHERE, .radius = 1},
                                                  {.type = NEBEL_SHAPE_SPHERE}};
static const nebel_shape part_unknown[] = {{.type = (nebel_shape_type)77}};

static const bad_volume bad_volumes[] = {
    /* boxes */
    {{SHAPE(BOX, .min = {0, 0, 0}, .max = {1, 1, 0})}, VALUE, "box", "less than max"},
    {{SHAPE(BOX, .min = {0, 2, 0}, .max = {1, 1, 1})}, VALUE, "box", "less than max"},
    {{SHAPE(BOX, .min = {NOT_A_NUMBER, 0, 0}, .max = {1, 1, 1})}, VALUE, "box", "finite"},
    {{SHAPE(BOX, .min = {0, 0, 0}, .max = {1, ENDLESS, 1})}, VALUE, "box", "finite"},
    {{SHAPE(BOX, .min = {-1.1e15, 0, 0}, .max = {1, 1, 1})}, VALUE, "box", "1e15"},
    /* balls */
    {{SHAPE(SPHERE, .radius = 0)}, VALUE, "sphere radius", "1e-15"},
    {{SHAPE(SPHERE, .radius = -1)}, VALUE, "sphere radius", "1e-15"},
    {{SHAPE(SPHERE, .radius = NOT_A_NUMBER)}, VALUE, "sphere radius", "1e-15"},
    {{SHAPE(SPHERE, .radius = ENDLESS)}, VALUE, "sphere radius", "1e15"},
    {{SHAPE(SPHERE, .radius = 1e-16)}, VALUE, "sphere radius", "1e-15"},
    {{SHAPE(SPHERE, .radius = 1, .center = {0, NOT_A_NUMBER, 0})}, VALUE, "center", "finite"},
    {{SHAPE(SPHERE, .radius = 1, .center = {0, 0, -ENDLESS})}, VALUE, "center", "finite"},
    {{SHAPE(ELLIPSOID, .radii = {1, 0, 1})}, VALUE, "ellipsoid radii", "1e-15"},
    {{SHAPE(ELLIPSOID, .radii = {1, 1, NOT_A_NUMBER})}, VALUE, "ellipsoid radii", "1e-15"},
    {{SHAPE(ELLIPSOID, .radii = {-1, 1, 1})}, VALUE, "ellipsoid radii", "1e-15"},
    /* bodies around an axis */
    {{SHAPE(CYLINDER, .to = {0, 1, 0})}, VALUE, "cylinder radius", "1e-15"},
    {{SHAPE(CYLINDER, .from = {1, 2, 3}, .to = {1, 2, 3}, .radius = 1)}, VALUE, "from and to", "apart"},
    {{SHAPE(CYLINDER, .to = {0, NOT_A_NUMBER, 0}, .radius = 1)}, VALUE, "from and to", "finite"},
    {{SHAPE(CAPSULE, .to = {0, 1, 0}, .radius = -2)}, VALUE, "capsule radius", "1e-15"},
    {{SHAPE(CAPSULE, .to = {0, 1e-20, 0}, .radius = 1)}, VALUE, "capsule axis", "1e-15"},
    {{SHAPE(CONE, .to = {0, 1, 0})}, VALUE, "cone radii", "both be 0"},
    {{SHAPE(CONE, .to = {0, 1, 0}, .radius_from = -1, .radius_to = 2)}, VALUE, "cone radii", "0 or"},
    {{SHAPE(CONE, .to = {0, 1, 0}, .radius_to = NOT_A_NUMBER)}, VALUE, "cone radii", "0 or"},
    {{SHAPE(CONE, .radius_from = 1)}, VALUE, "from and to", "apart"},
    /* planes */
    {{SHAPE(HALF_SPACE, .point = {0, 0, 0})}, VALUE, "half space normal", "not all zero"},
    {{SHAPE(HALF_SPACE, .normal = {0, NOT_A_NUMBER, 0})}, VALUE, "half space normal", "finite"},
    {{SHAPE(HALF_SPACE, .normal = {0, ENDLESS, 0})}, VALUE, "half space normal", "finite"},
    {{SHAPE(HALF_SPACE, .normal = {0, 1, 0}, .point = {0, ENDLESS, 0})}, VALUE, "half space point", "finite"},
    {{SHAPE(CONVEX, .planes = NULL)}, ARGUMENT, "convex", "at least one plane"},
    {{SHAPE(CONVEX, .planes = NULL, .plane_count = 4)}, ARGUMENT, "convex", "at least one plane"},
    {{SHAPE(CONVEX, .planes = planes_apart)}, ARGUMENT, "convex", "at least one plane"},
    {{SHAPE(CONVEX, .planes = planes_apart, .plane_count = NEBEL_MAX_SHAPE_PLANES + 1)},
     LIMIT,
     "1025 planes",
     "at most 1024"},
    {{SHAPE(CONVEX, .planes = planes_apart, .plane_count = SIZE_MAX)}, LIMIT, "planes", "at most 1024"},
    {{SHAPE(CONVEX, .planes = planes_without_normal, .plane_count = 1)}, VALUE, "plane normal", "not all zero"},
    {{SHAPE(CONVEX, .planes = planes_of_no_number, .plane_count = 1)}, VALUE, "plane normal", "finite"},
    {{SHAPE(CONVEX, .planes = planes_not_finite, .plane_count = 2)}, VALUE, "plane distance", "finite"},
    {{SHAPE(CONVEX, .planes = planes_too_far, .plane_count = 1)}, VALUE, "plane distance", "1e15"},
    {{SHAPE(CONVEX, .planes = planes_apart, .plane_count = 2)}, VALUE, "convex", "empty"},
    {{SHAPE(CONVEX, .planes = planes_flat, .plane_count = 2)}, VALUE, "convex", "empty"},
    /* groups */
    {{SHAPE(UNION, .parts = NULL)}, ARGUMENT, "union", "at least one part"},
    {{SHAPE(INTERSECTION, .parts = NULL, .part_count = 2)}, ARGUMENT, "intersection", "at least one part"},
    {{SHAPE(UNION, .parts = part_without_radius, .part_count = 2)}, VALUE, "sphere radius", "1e-15"},
    {{SHAPE(UNION, .parts = part_unknown, .part_count = 1)}, ARGUMENT, "shape", "77 is unknown"},
    /* transforms */
    {{TURNED(.position = {0, NOT_A_NUMBER, 0})}, VALUE, "transform position", "finite"},
    {{TURNED(.position = {ENDLESS, 0, 0})}, VALUE, "transform position", "finite"},
    {{TURNED(.rotation = {0, 0, 0, NOT_A_NUMBER})}, VALUE, "transform rotation", "quaternion"},
    {{TURNED(.rotation = {ENDLESS, 0, 0, 1})}, VALUE, "transform rotation", "quaternion"},
    {{TURNED(.scale = {1, 0, 1})}, VALUE, "transform scale", "singular"},
    {{TURNED(.scale = {1, 1, 1e-10})}, VALUE, "transform scale", "1e-9"},
    {{TURNED(.scale = {1, 1e-300, 1})}, VALUE, "transform scale", "singular"},
    {{TURNED(.scale = {1, 1, 1e10})}, VALUE, "transform scale", "1e9"},
    {{TURNED(.scale = {1, NOT_A_NUMBER, 1})}, VALUE, "transform scale", "singular"},
    /* densities */
    {{DENSITY(HEIGHT, .base = 1)}, VALUE, "scale height", "1e-15"},
    {{DENSITY(HEIGHT, .scale_height = -3)}, VALUE, "scale height", "1e-15"},
    {{DENSITY(HEIGHT, .scale_height = ENDLESS)}, VALUE, "scale height", "1e15"},
    {{DENSITY(HEIGHT, .scale_height = 3, .base = NOT_A_NUMBER)}, VALUE, "height base", "finite"},
    {{DENSITY(HEIGHT, .scale_height = 3, .below = (nebel_below)2)}, ARGUMENT, "below", "2 is unknown"},
    {{DENSITY(LINEAR, .from = {1, 1, 1}, .to = {1, 1, 1})}, VALUE, "linear from and to", "apart"},
    {{DENSITY(LINEAR, .from = {1, NOT_A_NUMBER, 1})}, VALUE, "linear from and to", "finite"},
    {{SHAPE(BOX, .max = {1, 1, 1}), DENSITY(RADIAL, .power = 1)}, VALUE, "radial", "sphere"},
    {{SHAPE(SPHERE, .radius = 1), DENSITY(RADIAL, .power = 0)}, VALUE, "radial power", "1, 2 or 3"},
    {{SHAPE(SPHERE, .radius = 1), DENSITY(RADIAL, .power = 4)}, VALUE, "radial power", "1, 2 or 3"},
    {{DENSITY(GAUSSIAN, .center = {0, 0, 0})}, VALUE, "sigma", "1e-15"},
    {{DENSITY(GAUSSIAN, .sigma = NOT_A_NUMBER)}, VALUE, "sigma", "1e-15"},
    {{DENSITY(GAUSSIAN, .sigma = 1, .center = {ENDLESS, 0, 0})}, VALUE, "gaussian center", "finite"},
    {{DENSITY(SOFT_EDGE, .edge_width = 1)}, VALUE, "soft edge", "surface"},
    {{SHAPE(BOX, .max = {1, 1, 1}), DENSITY(SOFT_EDGE, .edge_width = 0)}, VALUE, "soft edge distance", "1e-15"},
    /* light */
    {{.extinction = {.1, -.1, .1}}, VALUE, "extinction", "-0.1"},
    {{.extinction = {.1, NOT_A_NUMBER, .1}}, VALUE, "extinction", "nan"},
    {{.extinction = {ENDLESS, 0, 0}}, VALUE, "extinction", "inf"},
    {{.extinction = {0, 0, 1.1e9}}, VALUE, "extinction", "1e+09"},
    {{.source = {0, 0, -1}}, VALUE, "source", "-1"},
    {{.source = {NOT_A_NUMBER, 0, 0}}, VALUE, "source", "nan"},
    {{.albedo = {1.0001, 0, 0}}, VALUE, "albedo", "0 and 1"},
    {{.albedo = {0, -.5, 0}}, VALUE, "albedo", "0 and 1"},
    {{.emission = {0, ENDLESS, 0}}, VALUE, "emission", "inf"},
    {{.emission = {0, -1e-300, 0}}, VALUE, "emission", "-1e-300"},
    {{.source = {1, 0, 0}, .albedo = {0, 0, 1}}, VALUE, "source and albedo", "one or the other"},
    /* numbers that name nothing */
    {{.shape = {.type = NEBEL_SHAPE_COUNT}}, ARGUMENT, "shape", "unknown"},
    {{.shape = {.type = (nebel_shape_type)-1}}, ARGUMENT, "shape", "-1 is unknown"},
    {{.density = {.type = NEBEL_DENSITY_COUNT}}, ARGUMENT, "density", "unknown"},
    {{.operation = NEBEL_OPERATION_COUNT}, ARGUMENT, "operation", "3 is unknown"},
};

static void assert_refused(nebel_fog *fog, nebel_volume_id id, fog_messages *messages, const bad_volume *bad, size_t i)
{
    const size_t before = messages->count;
    nebel_volume_id unchanged = 42;
    const nebel_result result =
        id == 0 ? nebel_add_volume(fog, &bad->desc, &unchanged) : nebel_update_volume(fog, id, &bad->desc);
    const int said = strstr(messages->text, bad->thing) != NULL && strstr(messages->text, bad->rule) != NULL;
    if (result != bad->result || !said) print_message("volume %zu: %d \"%s\"\n", i, (int)result, messages->text);
    assert_int_equal(result, bad->result);
    assert_true(said);
    assert_int_equal(messages->result, result);
    assert_int_equal(messages->count, before + 1);
    assert_true(unchanged == 42);
}

static size_t count_of(nebel_fog *fog)
{
    nebel_snapshot *snapshot = NULL;
    assert_int_equal(nebel_commit_fog(fog, &snapshot), NEBEL_OK);
    const size_t count = nebel_get_volume_count(snapshot);
    nebel_release_snapshot(snapshot);
    return count;
}

static void test_wrong_volumes_are_refused_by_name_and_rule(void **unused)
{
    (void)unused;
    fog_memory memory = {0};
    fog_messages messages = {0};
    nebel_fog *const fog = make_fog(&memory, &messages);
    nebel_volume_id good = 0;
    assert_int_equal(nebel_add_volume(fog, &(nebel_volume_desc){.extinction = {1, 1, 1}}, &good), NEBEL_OK);
    const size_t live = memory.live;
    for (size_t i = 0; i < sizeof bad_volumes / sizeof bad_volumes[0]; i++) {
        assert_refused(fog, 0, &messages, &bad_volumes[i], i);
        assert_refused(fog, good, &messages, &bad_volumes[i], i);
        assert_int_equal(memory.live, live);
    }
    assert_int_equal(count_of(fog), 1);
    nebel_destroy_fog(fog);
    assert_int_equal(memory.live, 0);
}

static void test_wrong_volumes_are_refused_without_a_log_too(void **unused)
{
    (void)unused;
    nebel_fog *fog = NULL;
    assert_int_equal(nebel_create_fog(&(nebel_fog_desc){0}, &fog), NEBEL_OK);
    for (size_t i = 0; i < sizeof bad_volumes / sizeof bad_volumes[0]; i++)
        assert_int_equal(nebel_add_volume(fog, &bad_volumes[i].desc, NULL), bad_volumes[i].result);
    nebel_destroy_fog(fog);
}

/* An exclusion has a shape only: whatever else stands there is not read. */
static void test_exclusions_read_their_shape_only(void **unused)
{
    (void)unused;
    fog_memory memory = {0};
    fog_messages messages = {0};
    nebel_fog *const fog = make_fog(&memory, &messages);
    for (size_t i = 0; i < sizeof bad_volumes / sizeof bad_volumes[0]; i++) {
        nebel_volume_desc desc = bad_volumes[i].desc;
        if (desc.operation != NEBEL_OPERATION_ADD) continue;
        desc.operation = NEBEL_OPERATION_EXCLUDE;
        desc.shape = (nebel_shape){.type = NEBEL_SHAPE_SPHERE, .radius = 1, .radii = {-1, NOT_A_NUMBER, 0}};
        assert_int_equal(nebel_add_volume(fog, &desc, NULL), NEBEL_OK);
    }
    assert_int_equal(messages.count, 0);
    nebel_destroy_fog(fog);
}

/* ---- the limits themselves are legal, one more is not ---------------------------------------- */

static nebel_result add_nested(nebel_fog *fog, int depth)
{
    enum { MOST = NEBEL_MAX_SHAPE_NESTING + 4 };
    nebel_shape shapes[MOST + 1] = {{.type = NEBEL_SHAPE_SPHERE, .radius = 1}};
    for (int i = 1; i <= depth; i++)
        shapes[i] = (nebel_shape){
            .type = i % 2 ? NEBEL_SHAPE_UNION : NEBEL_SHAPE_INTERSECTION, .parts = &shapes[i - 1], .part_count = 1};
    const nebel_volume_desc desc = {.shape = shapes[depth], .extinction = {1, 1, 1}};
    return nebel_add_volume(fog, &desc, NULL);
}

/* Right-leaning, so that evaluating it takes the deepest stack. */
static nebel_result add_staircase(nebel_fog *fog, int depth)
{
    nebel_shape pairs[NEBEL_MAX_SHAPE_NESTING][2];
    const nebel_shape ball = {.type = NEBEL_SHAPE_SPHERE, .radius = 1};
    for (int i = 0; i < depth; i++) {
        pairs[i][0] = ball;
        pairs[i][1] = i == 0 ? ball : (nebel_shape){.type = NEBEL_SHAPE_UNION, .parts = pairs[i - 1], .part_count = 2};
    }
    const nebel_volume_desc desc = {
        .shape = {.type = NEBEL_SHAPE_INTERSECTION, .parts = pairs[depth - 1], .part_count = 2},
        .extinction = {1, 1, 1}};
    return nebel_add_volume(fog, &desc, NULL);
}

static nebel_result add_wide(nebel_fog *fog, size_t leaves)
{
    static nebel_shape parts[NEBEL_MAX_SHAPE_LEAVES + 2];
    for (size_t i = 0; i < leaves; i++) parts[i] = (nebel_shape){.type = NEBEL_SHAPE_SPHERE, .radius = 1};
    const nebel_volume_desc desc = {.shape = {.type = NEBEL_SHAPE_UNION, .parts = parts, .part_count = leaves},
                                    .extinction = {1, 1, 1}};
    return nebel_add_volume(fog, &desc, NULL);
}

static nebel_result add_cut(nebel_fog *fog, size_t count)
{
    static nebel_plane planes[NEBEL_MAX_SHAPE_PLANES + 1];
    for (size_t i = 0; i < count; i++) {
        const double a = 2.399963229728653 * (double)i, z = 1 - (2 * (double)i + 1) / (double)count,
                     r = sqrt(1 - z * z);
        planes[i] = (nebel_plane){{r * cos(a), r * sin(a), z}, 1};
    }
    const nebel_volume_desc desc = {.shape = {.type = NEBEL_SHAPE_CONVEX, .planes = planes, .plane_count = count},
                                    .extinction = {1, 1, 1}};
    return nebel_add_volume(fog, &desc, NULL);
}

static void test_limits_are_legal_and_one_more_is_not(void **unused)
{
    (void)unused;
    fog_memory memory = {0};
    fog_messages messages = {0};
    nebel_fog *const fog = make_fog(&memory, &messages);
    assert_int_equal(add_nested(fog, NEBEL_MAX_SHAPE_NESTING), NEBEL_OK);
    assert_int_equal(add_staircase(fog, NEBEL_MAX_SHAPE_NESTING), NEBEL_OK);
    assert_int_equal(add_wide(fog, NEBEL_MAX_SHAPE_LEAVES), NEBEL_OK);
    assert_int_equal(add_cut(fog, NEBEL_MAX_SHAPE_PLANES), NEBEL_OK);
    nebel_snapshot *snapshot = NULL;
    assert_int_equal(nebel_commit_fog(fog, &snapshot), NEBEL_OK);
    const nebel_ray ray = {{-3, 0, 0}, {1, 0, 0}, 9};
    nebel_transfer transfer;
    assert_int_equal(nebel_trace(snapshot, &(nebel_trace_desc){0}, 1, &ray, sizeof ray, &transfer, sizeof transfer),
                     NEBEL_OK);
    /* three balls of diameter 2, each counted once, and a body of planes around such a ball */
    assert_true(transfer.transmittance[0] < exp(-8) && transfer.transmittance[0] > exp(-8.05));
    nebel_release_snapshot(snapshot);

    assert_int_equal(messages.count, 0);
    assert_int_equal(add_nested(fog, NEBEL_MAX_SHAPE_NESTING + 1), NEBEL_ERROR_LIMIT);
    assert_non_null(strstr(messages.text, "16"));
    assert_int_equal(add_wide(fog, NEBEL_MAX_SHAPE_LEAVES + 1), NEBEL_ERROR_LIMIT);
    assert_non_null(strstr(messages.text, "1024"));
    assert_int_equal(add_cut(fog, NEBEL_MAX_SHAPE_PLANES + 1), NEBEL_ERROR_LIMIT);
    assert_int_equal(messages.count, 3);
    nebel_destroy_fog(fog);
    assert_int_equal(memory.live, 0);
}

static void test_the_smallest_and_largest_sizes_are_legal(void **unused)
{
    (void)unused;
    static const nebel_volume_desc volumes[] = {
        {SHAPE(SPHERE, .radius = 1e-15), .extinction = {1e9, 0, 0}},
        {SHAPE(SPHERE, .radius = 1e15), .extinction = {0, 1e-15, 0}},
        {SHAPE(BOX, .min = {-1e15, -1e15, -1e15}, .max = {1e15, 1e15, 1e15}), .extinction = {0, 0, 1e-15}},
        {TURNED(.scale = {1e9, 1e9, 1e9})},
        {TURNED(.scale = {-1e-9, 1e-9, 1e9}, .rotation = {1e-100, 0, 0, 1e-100})},
        {SHAPE(HALF_SPACE, .normal = {0, 1e-150, 0})},
        {SHAPE(HALF_SPACE, .normal = {1e149, 1e149, 0})},
        {.extinction = {0, 0, 0}, .albedo = {1, 1, 1}},
    };
    nebel_snapshot *const snapshot = fog_commit(&(nebel_fog_desc){0}, volumes, sizeof volumes / sizeof volumes[0]);
    const nebel_ray ray = {{-1e15, 0, 0}, {1, 0, 0}, ENDLESS};
    nebel_transfer transfer;
    assert_int_equal(nebel_trace(snapshot, &(nebel_trace_desc){0}, 1, &ray, sizeof ray, &transfer, sizeof transfer),
                     NEBEL_OK);
    assert_true(fabs(transfer.transmittance[0] - exp(-2e-6)) <= transfer.error); /* its chord is lost 1e15 m away */
    assert_true(fabs(transfer.transmittance[1] - exp(-2)) < 1e-12);
    assert_true(fabs(transfer.transmittance[2] - exp(-2)) < 1e-12);
    nebel_release_snapshot(snapshot);
}

/* ---- the fog itself -------------------------------------------------------------------------- */

static void test_wrong_fog_is_refused(void **unused)
{
    (void)unused;
    fog_messages messages = {0};
    fog_memory memory = {0};
    const nebel_log log = fog_messages_log(&messages);
    const nebel_allocator whole = fog_memory_allocator(&memory);
    const nebel_fog_desc wrong[] = {{.host = {.log = log, .allocator = {.allocate = whole.allocate}}},
                                    {.host = {.log = log, .allocator = {.release = whole.release}}},
                                    {.host.log = log, .max_opacity = -1},
                                    {.host.log = log, .max_opacity = NOT_A_NUMBER},
                                    {.host.log = log, .max_opacity = ENDLESS}};
    for (size_t i = 0; i < sizeof wrong / sizeof wrong[0]; i++) {
        nebel_fog *fog = (nebel_fog *)&memory;
        assert_int_equal(nebel_create_fog(&wrong[i], &fog), i < 2 ? NEBEL_ERROR_ARGUMENT : NEBEL_ERROR_VALUE);
        assert_null(fog);
        assert_int_equal(messages.count, i + 1);
        assert_non_null(strstr(messages.text, i < 2 ? "allocator" : "max_opacity"));
    }
    nebel_fog *fog = (nebel_fog *)&memory;
    assert_int_equal(nebel_create_fog(NULL, &fog), NEBEL_ERROR_ARGUMENT);
    assert_null(fog);
    assert_int_equal(nebel_create_fog(&(nebel_fog_desc){0}, NULL), NEBEL_ERROR_ARGUMENT);
    assert_int_equal(memory.calls, 0);
}

/* ---- nothing where something is needed ------------------------------------------------------- */

static void test_null_arguments_are_refused(void **unused)
{
    (void)unused;
    fog_memory memory = {0};
    fog_messages messages = {0};
    nebel_fog *const fog = make_fog(&memory, &messages);
    const nebel_volume_desc desc = {0};
    nebel_volume_id id = 0;
    assert_int_equal(nebel_add_volume(fog, &desc, &id), NEBEL_OK);
    assert_int_equal(nebel_add_volume(NULL, &desc, NULL), ARGUMENT);
    assert_int_equal(nebel_update_volume(NULL, id, &desc), ARGUMENT);
    assert_int_equal(nebel_remove_volume(NULL, id), ARGUMENT);
    assert_int_equal(messages.count, 0);
    assert_int_equal(nebel_add_volume(fog, NULL, NULL), ARGUMENT);
    assert_int_equal(nebel_update_volume(fog, id, NULL), ARGUMENT);
    assert_int_equal(nebel_commit_fog(fog, NULL), ARGUMENT);
    assert_int_equal(messages.count, 3);

    nebel_snapshot *snapshot = (nebel_snapshot *)&memory;
    assert_int_equal(nebel_commit_fog(NULL, &snapshot), ARGUMENT);
    assert_null(snapshot);
    assert_int_equal(nebel_commit_fog(fog, &snapshot), NEBEL_OK);

    const nebel_ray ray = {{0, 0, 0}, {0, 0, 1}, 1};
    nebel_transfer transfer;
    double distance;
    const nebel_trace_desc trace = {0};
    assert_int_equal(nebel_trace(NULL, &trace, 1, &ray, sizeof ray, &transfer, sizeof transfer), ARGUMENT);
    assert_int_equal(nebel_trace(snapshot, NULL, 1, &ray, sizeof ray, &transfer, sizeof transfer), NEBEL_OK);
    assert_int_equal(nebel_trace(snapshot, &trace, 1, NULL, sizeof ray, &transfer, sizeof transfer), ARGUMENT);
    assert_int_equal(nebel_trace(snapshot, &trace, 1, &ray, sizeof ray, NULL, sizeof transfer), ARGUMENT);
    assert_int_equal(nebel_trace(snapshot, &trace, 0, NULL, 0, NULL, 0), NEBEL_OK);
    assert_int_equal(nebel_invert_transmittance(NULL, .5, 0, 1, &ray, sizeof ray, &distance), ARGUMENT);
    assert_int_equal(nebel_invert_transmittance(snapshot, .5, 0, 1, NULL, sizeof ray, &distance), ARGUMENT);
    assert_int_equal(nebel_invert_transmittance(snapshot, .5, 0, 1, &ray, sizeof ray, NULL), ARGUMENT);
    assert_int_equal(nebel_invert_transmittance(snapshot, .5, 0, 0, NULL, 0, NULL), NEBEL_OK);

    const float point[3] = {0, 0, 0};
    float out = 0;
    const nebel_segments segments = {.from = point, .to = point}, no_to = {.from = point};
    assert_int_equal(nebel_compute_segment_transmittance(NULL, NEBEL_ISA_DEFAULT, 0, 1, &segments, &out, 0), ARGUMENT);
    assert_int_equal(nebel_compute_segment_transmittance(snapshot, NEBEL_ISA_DEFAULT, 0, 1, NULL, &out, 0), ARGUMENT);
    assert_int_equal(nebel_compute_segment_transmittance(snapshot, NEBEL_ISA_DEFAULT, 0, 1, &no_to, &out, 0), ARGUMENT);
    assert_int_equal(nebel_compute_segment_transmittance(snapshot, NEBEL_ISA_DEFAULT, 0, 1, &segments, NULL, 0),
                     ARGUMENT);
    assert_int_equal(
        nebel_compute_segment_transmittance(snapshot, NEBEL_ISA_DEFAULT, 0, 0, &(nebel_segments){0}, NULL, 0),
        NEBEL_OK);
    assert_int_equal(messages.count, 10);

    assert_null(nebel_retain_snapshot(NULL));
    nebel_release_snapshot(NULL);
    nebel_destroy_fog(NULL);
    nebel_release_snapshot(snapshot);
    nebel_destroy_fog(fog);
    assert_int_equal(memory.live, 0);
}

/* ---- rays ------------------------------------------------------------------------------------ */

typedef struct bad_ray {
    nebel_ray ray;
    const char *thing;
} bad_ray;

static const bad_ray bad_rays[] = {
    {{{NOT_A_NUMBER, 0, 0}, {0, 0, 1}, 1}, "origin"},
    {{{0, ENDLESS, 0}, {0, 0, 1}, 1}, "origin"},
    {{{0, 0, -ENDLESS}, {0, 0, 1}, 1}, "origin"},
    {{{0, 0, 1.1e15}, {0, 0, 1}, 1}, "origin"},
    {{{0, 0, 0}, {0, NOT_A_NUMBER, 1}, 1}, "direction"},
    {{{0, 0, 0}, {ENDLESS, 0, 0}, 1}, "direction"},
    {{{0, 0, 0}, {0, -ENDLESS, ENDLESS}, 1}, "direction"},
    {{{0, 0, 0}, {0, 0, 0}, 1}, "direction"},
    {{{0, 0, 0}, {-0.0, 0, -0.0}, 1}, "direction"},
    {{{0, 0, 0}, {0, 0, 1}, -1}, "t_max"},
    {{{0, 0, 0}, {0, 0, 1}, -1e-300}, "t_max"},
    {{{0, 0, 0}, {0, 0, 1}, NOT_A_NUMBER}, "t_max"},
    {{{0, 0, 0}, {0, 0, 1}, -ENDLESS}, "t_max"},
};

static void test_wrong_rays_are_refused_by_number_and_name(void **unused)
{
    (void)unused;
    enum { COUNT = 40 };
    fog_messages messages = {0};
    const nebel_fog_desc desc = {.host.log = fog_messages_log(&messages)};
    nebel_snapshot *const snapshot = fog_commit(&desc, &(nebel_volume_desc){.extinction = {1, 1, 1}}, 1);
    for (size_t i = 0; i < sizeof bad_rays / sizeof bad_rays[0]; i++)
        for (size_t place = 0; place < COUNT; place += 13) {
            nebel_ray rays[COUNT];
            nebel_transfer transfers[COUNT];
            double distances[COUNT];
            size_t failed = COUNT;
            char number[32];
            for (size_t k = 0; k < COUNT; k++) rays[k] = (nebel_ray){{0, 0, 0}, {0, 0, 1}, 1};
            rays[place] = bad_rays[i].ray;
            snprintf(number, sizeof number, "ray %zu:", place);
            const nebel_trace_desc trace = {.precision = (nebel_precision)(i % 2), .failed_ray = &failed};
            assert_int_equal(nebel_trace(snapshot, &trace, COUNT, rays, sizeof rays[0], transfers, sizeof transfers[0]),
                             ARGUMENT);
            assert_int_equal(failed, place);
            assert_non_null(strstr(messages.text, number));
            assert_non_null(strstr(messages.text, bad_rays[i].thing));
            messages.text[0] = 0;
            assert_int_equal(nebel_invert_transmittance(snapshot, .5, 0, COUNT, rays, sizeof rays[0], distances),
                             ARGUMENT);
            assert_non_null(strstr(messages.text, number));
        }
    nebel_release_snapshot(snapshot);
}

static void test_directions_of_any_length_are_the_same_direction(void **unused)
{
    (void)unused;
    static const double lengths[] = {1, 1e300, 1e-300, 5e-324, 1e-310, 8e307, 1e-20};
    static const nebel_volume_desc ball = {SHAPE(SPHERE, .radius = 1), .extinction = {.5, .5, .5}};
    nebel_snapshot *const snapshot = fog_commit(&(nebel_fog_desc){0}, &ball, 1);
    for (size_t i = 0; i < sizeof lengths / sizeof lengths[0]; i++)
        for (int precision = 0; precision < 2; precision++) {
            const nebel_ray rays[] = {{{-3, 0, 0}, {lengths[i], 0, 0}, 10},
                                      {{-3, -3, 0}, {lengths[i], lengths[i], 0}, 10}};
            nebel_transfer transfers[2];
            const nebel_trace_desc desc = {.precision = (nebel_precision)precision};
            assert_int_equal(nebel_trace(snapshot, &desc, 2, rays, sizeof rays[0], transfers, sizeof transfers[0]),
                             NEBEL_OK);
            for (int r = 0; r < 2; r++)
                assert_true(fabs(transfers[r].transmittance[0] - exp(-1)) < (precision == 0 ? 1e-15 : 1e-6));
        }
    nebel_release_snapshot(snapshot);
}

static void test_wrong_queries_are_refused(void **unused)
{
    (void)unused;
    fog_messages messages = {0};
    const nebel_fog_desc fog = {.host.log = fog_messages_log(&messages)};
    nebel_snapshot *const snapshot = fog_commit(&fog, &(nebel_volume_desc){.extinction = {1, 1, 1}}, 1);
    const nebel_ray ray = {{0, 0, 0}, {0, 0, 1}, 1};
    nebel_transfer transfer;
    const double tolerances[] = {-1, -1e-300, NOT_A_NUMBER, ENDLESS};
    for (size_t i = 0; i < sizeof tolerances / sizeof tolerances[0]; i++) {
        const nebel_trace_desc desc = {.tolerance = tolerances[i]};
        assert_int_equal(nebel_trace(snapshot, &desc, 1, &ray, sizeof ray, &transfer, sizeof transfer), ARGUMENT);
        assert_non_null(strstr(messages.text, "tolerance"));
    }
    const double transmittances[] = {0, 1, -1, 2, NOT_A_NUMBER};
    double distance;
    for (size_t i = 0; i < sizeof transmittances / sizeof transmittances[0]; i++) {
        assert_int_equal(nebel_invert_transmittance(snapshot, transmittances[i], 0, 1, &ray, sizeof ray, &distance),
                         ARGUMENT);
        assert_non_null(strstr(messages.text, "transmittance"));
    }
    const int channels[] = {-1, 3, 1000};
    const float point[3] = {0, 0, 0};
    float out;
    for (size_t i = 0; i < sizeof channels / sizeof channels[0]; i++) {
        messages.text[0] = 0;
        assert_int_equal(nebel_invert_transmittance(snapshot, .5, channels[i], 1, &ray, sizeof ray, &distance),
                         ARGUMENT);
        assert_non_null(strstr(messages.text, "channel"));
        messages.text[0] = 0;
        const nebel_segments segments = {.from = point, .to = point};
        assert_int_equal(
            nebel_compute_segment_transmittance(snapshot, NEBEL_ISA_DEFAULT, channels[i], 1, &segments, &out, 0),
            ARGUMENT);
        assert_non_null(strstr(messages.text, "channel"));
    }
    nebel_release_snapshot(snapshot);
}

static void test_instruction_sets_that_are_not_here_are_unsupported(void **unused)
{
    (void)unused;
    fog_messages messages = {0};
    const nebel_fog_desc fog = {.host.log = fog_messages_log(&messages)};
    nebel_snapshot *const snapshot = fog_commit(&fog, &(nebel_volume_desc){.extinction = {1, 1, 1}}, 1);
    const nebel_ray ray = {{0, 0, 0}, {0, 0, 1}, 1};
    const float point[3] = {0, 0, 0};
    const nebel_segments segments = {.from = point, .to = point};
    size_t refused = 0;
    for (int isa = -1; isa <= NEBEL_ISA_COUNT + 1; isa++) {
        nebel_transfer transfer;
        float out;
        const nebel_result expected = nebel_isa_available((nebel_isa)isa) ? NEBEL_OK : NEBEL_ERROR_UNSUPPORTED;
        const nebel_trace_desc desc = {.precision = NEBEL_PRECISION_FLOAT, .isa = (nebel_isa)isa};
        assert_int_equal(nebel_trace(snapshot, &desc, 1, &ray, sizeof ray, &transfer, sizeof transfer), expected);
        assert_int_equal(nebel_compute_segment_transmittance(snapshot, (nebel_isa)isa, 0, 1, &segments, &out, 0),
                         expected);
        refused += expected != NEBEL_OK;
    }
    assert_true(refused >= 4); /* at the least both ends of the list, and NEON or all of x86 */
    assert_int_equal(messages.count, 2 * refused);
    nebel_release_snapshot(snapshot);
}

/* ---- light without end ----------------------------------------------------------------------- */

typedef struct endless_case {
    nebel_volume_desc volumes[2];
    nebel_ray ray;
    nebel_result result;
} endless_case;

#define AHEAD                                                                                                          \
    {                                                                                                                  \
        {0, 0, 0}, {0, 0, 1}, ENDLESS                                                                                  \
    }
#define UPWARDS                                                                                                        \
    {                                                                                                                  \
        {0, 0, 0}, {0, 1, 0}, ENDLESS                                                                                  \
    }
#define DOWNWARDS                                                                                                      \
    {                                                                                                                  \
        {0, 0, 0}, {.1, -1, 0}, ENDLESS                                                                                \
    }
#define SHINES .emission = {0, .1, 0}

static const endless_case endless_cases[] = {
    {{{SHINES}}, AHEAD, NEBEL_ERROR_UNBOUNDED},
    {{{SHINES, .extinction = {1, 0, 1}}}, AHEAD, NEBEL_ERROR_UNBOUNDED},
    {{{SHINES, .extinction = {0, 1e-3, 0}}}, AHEAD, NEBEL_OK},
    {{{SHINES}, {.extinction = {0, 1e-3, 0}}}, AHEAD, NEBEL_OK},
    {{{SHINES}, {SHAPE(BOX, .min = {-1, -1, 1}, .max = {1, 1, 2}), .extinction = {9, 9, 9}}},
     AHEAD,
     NEBEL_ERROR_UNBOUNDED},
    {{{SHINES}}, {{0, 0, 0}, {0, 0, 1}, 1e15}, NEBEL_OK},
    {{{SHINES, SHAPE(SPHERE, .radius = 1e15)}}, AHEAD, NEBEL_OK},
    {{{SHINES, SHAPE(HALF_SPACE, .normal = {0, 0, -1})}}, AHEAD, NEBEL_ERROR_UNBOUNDED},
    {{{SHINES, SHAPE(HALF_SPACE, .normal = {0, 0, 1}, .point = {0, 0, 50})}}, AHEAD, NEBEL_OK},
    {{{SHINES}, {.operation = NEBEL_OPERATION_EXCLUDE, SHAPE(HALF_SPACE, .normal = {0, 0, -1}, .point = {0, 0, 50})}},
     AHEAD,
     NEBEL_OK},
    {{{SHINES, DENSITY(HEIGHT, .scale_height = 9)}}, UPWARDS, NEBEL_OK},
    {{{SHINES, DENSITY(HEIGHT, .scale_height = 9)}}, AHEAD, NEBEL_ERROR_UNBOUNDED},
    {{{SHINES, DENSITY(HEIGHT, .scale_height = 9)}}, DOWNWARDS, NEBEL_ERROR_UNBOUNDED},
    {{{SHINES, DENSITY(HEIGHT, .scale_height = 9), .extinction = {0, 1, 0}}}, DOWNWARDS, NEBEL_OK},
    {{{SHINES, DENSITY(HEIGHT, .scale_height = 9, .below = NEBEL_BELOW_CONSTANT)}}, UPWARDS, NEBEL_OK},
    {{{SHINES, DENSITY(HEIGHT, .scale_height = 9, .below = NEBEL_BELOW_CONSTANT)}}, DOWNWARDS, NEBEL_ERROR_UNBOUNDED},
    {{{SHINES, DENSITY(GAUSSIAN, .sigma = 3)}}, AHEAD, NEBEL_OK},
    {{{SHINES, DENSITY(LINEAR, .to = {0, 0, -5})}}, AHEAD, NEBEL_OK},
    {{{SHINES, DENSITY(LINEAR, .to = {0, 0, 5})}}, AHEAD, NEBEL_ERROR_UNBOUNDED},
};

static void test_light_without_end_is_an_error_of_that_ray(void **unused)
{
    (void)unused;
    for (size_t i = 0; i < sizeof endless_cases / sizeof endless_cases[0]; i++) {
        const endless_case *const c = &endless_cases[i];
        fog_messages messages = {0};
        const nebel_fog_desc fog = {.host.log = fog_messages_log(&messages)};
        nebel_snapshot *const snapshot = fog_commit(&fog, c->volumes, 2);
        for (int precision = 0; precision < 2; precision++)
            for (size_t place = 0; place < 20; place += 7) {
                nebel_ray rays[20];
                nebel_transfer transfers[20];
                size_t failed = 99;
                for (int k = 0; k < 20; k++) rays[k] = (nebel_ray){{0, 0, 0}, {0, 0, 1}, 3};
                rays[place] = c->ray;
                const nebel_trace_desc desc = {.precision = (nebel_precision)precision, .failed_ray = &failed};
                const nebel_result result =
                    nebel_trace(snapshot, &desc, 20, rays, sizeof rays[0], transfers, sizeof transfers[0]);
                if (result != c->result) print_message("endless %zu, precision %d: %d\n", i, precision, (int)result);
                assert_int_equal(result, c->result);
                assert_int_equal(failed, result == NEBEL_OK ? 99 : place);
                assert_true((messages.count > 0) == (result != NEBEL_OK));
                if (result == NEBEL_OK) assert_true(isfinite(transfers[place].in_scattering[1]));
            }
        nebel_release_snapshot(snapshot);
    }
}

/* ---- opaque fog ------------------------------------------------------------------------------ */

static void test_opaque_fog_shows_its_source(void **unused)
{
    (void)unused;
    const double extinctions[] = {1e4, 1e6, 1e9};
    for (int i = 0; i < 3; i++)
        for (int precision = 0; precision < 2; precision++) {
            const double e = extinctions[i];
            const nebel_volume_desc volumes[] = {
                {.extinction = {e, e, e}, .source = {1, 2, 3}},
                {SHAPE(SPHERE, .radius = 5), .extinction = {e, e, e}, .source = {1, 2, 3}}};
            nebel_snapshot *const snapshot = fog_commit(&(nebel_fog_desc){0}, volumes, 2);
            const double ends[] = {1, 100, 1e15, ENDLESS};
            for (int k = 0; k < 4; k++) {
                const nebel_ray ray = {{0, 0, 0}, {1, 2, 3}, ends[k]};
                nebel_transfer transfer;
                const nebel_trace_desc desc = {.precision = (nebel_precision)precision};
                assert_int_equal(nebel_trace(snapshot, &desc, 1, &ray, sizeof ray, &transfer, sizeof transfer),
                                 NEBEL_OK);
                for (int c = 0; c < 3; c++) {
                    assert_true(transfer.transmittance[c] == 0);
                    assert_true(fabs(transfer.in_scattering[c] - (c + 1)) <= transfer.error);
                }
                assert_true(transfer.error < (precision == 0 ? 1e-13 : 2e-5));
            }
            nebel_release_snapshot(snapshot);
        }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_wrong_volumes_are_refused_by_name_and_rule),
        cmocka_unit_test(test_wrong_volumes_are_refused_without_a_log_too),
        cmocka_unit_test(test_exclusions_read_their_shape_only),
        cmocka_unit_test(test_limits_are_legal_and_one_more_is_not),
        cmocka_unit_test(test_the_smallest_and_largest_sizes_are_legal),
        cmocka_unit_test(test_wrong_fog_is_refused),
        cmocka_unit_test(test_null_arguments_are_refused),
        cmocka_unit_test(test_wrong_rays_are_refused_by_number_and_name),
        cmocka_unit_test(test_directions_of_any_length_are_the_same_direction),
        cmocka_unit_test(test_wrong_queries_are_refused),
        cmocka_unit_test(test_instruction_sets_that_are_not_here_are_unsupported),
        cmocka_unit_test(test_light_without_end_is_an_error_of_that_ray),
        cmocka_unit_test(test_opaque_fog_shows_its_source),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
