/* Random fog and rays as extreme as the rules allow: whatever comes, the numbers stay numbers.
 *
 * test_extremes [SCENES [REACH]]: 0 scenes are as many as are tried without an argument; with REACH, lengths are within 10^-REACH and 10^REACH only, and the answers in double
 * and in float must agree within the errors that they state. */
#include <float.h>
#include <limits.h>
#include <math.h>

#include "dice.h"
#include "fog_help.h"

enum { MOST_VOLUMES = 6, PARTS = 3, PLANES = 10, RAYS = 16 };

#if defined(__SANITIZE_ADDRESS__)
enum { SCENES = 700, SCENES_WITHIN_REACH = 300 };
#else
enum { SCENES = 7000, SCENES_WITHIN_REACH = 3000 };
#endif
static size_t scene_count;
static double reach = 15;
static int compares_precisions;

typedef struct scene {
    uint64_t state;
    double size; /* most lengths are near this one, so that shapes meet rays */
    double ambient[3];
    size_t count;
    nebel_volume_desc volumes[MOST_VOLUMES];
    nebel_shape parts[MOST_VOLUMES][PARTS];
    nebel_plane planes[MOST_VOLUMES * (PARTS + 1)][PLANES];
    size_t plane_sets;
} scene;

static int one_in(scene *s, int n)
{
    return dice_below(&s->state, n) == 0;
}

static double within(double x, double low, double high)
{
    return fmin(fmax(x, low), high);
}

/* > 0 */
static double extent(scene *s)
{
    if (one_in(s, 12)) return pow(10, one_in(s, 2) ? -reach : reach);
    const double usual = log10(s->size) + dice(&s->state, -1, 1);
    const double magnitude = one_in(s, 8) ? dice(&s->state, -reach, reach) : usual;
    return within(pow(10, magnitude), 1e-15, 1e15);
}

static double coordinate(scene *s)
{
    if (one_in(s, 6)) return one_in(s, 2) ? 0.0 : -0.0;
    return one_in(s, 2) ? extent(s) : -extent(s);
}

static void place(scene *s, double v[3])
{
    for (int k = 0; k < 3; k++) v[k] = coordinate(s);
}

static double amount(scene *s, double largest)
{
    if (one_in(s, 4)) return 0;
    if (one_in(s, 20)) return one_in(s, 2) ? largest : DBL_TRUE_MIN;
    const double usual = one_in(s, 3) ? pow(10, dice(&s->state, -300, 9)) : dice(&s->state, 0, 4) / s->size;
    return within(usual, 0, largest);
}

static void amounts(scene *s, double v[3], double largest)
{
    const double grey = amount(s, largest);
    const int colored = one_in(s, 2);
    for (int c = 0; c < 3; c++) v[c] = colored ? amount(s, largest) : grey;
}

static void turn(scene *s, nebel_transform *t)
{
    if (one_in(s, 2)) return;
    place(s, t->position);
    if (one_in(s, 2))
        for (int k = 0; k < 4; k++) t->rotation[k] = dice(&s->state, -1, 1) * pow(10, dice(&s->state, -3, 3));
    if (one_in(s, 2)) return;
    const double same = pow(10, dice(&s->state, -9, 9));
    const int even = one_in(s, 2), wild = one_in(s, 4);
    for (int k = 0; k < 3; k++) {
        const double own = wild ? pow(10, dice(&s->state, -9, 9)) : dice(&s->state, .5, 2);
        t->scale[k] = within(even ? same : own, 1e-9, 1e9) * (one_in(s, 4) ? -1 : 1);
    }
}

static void make_planes(scene *s, nebel_shape *shape)
{
    nebel_plane *const planes = s->planes[s->plane_sets++];
    shape->planes = planes;
    shape->plane_count = (size_t)(1 + dice_below(&s->state, PLANES));
    for (size_t i = 0; i < shape->plane_count; i++) {
        const double stretch = one_in(s, 3) ? pow(10, dice(&s->state, -140, 130)) : 1;
        for (int k = 0; k < 3; k++) planes[i].normal[k] = stretch * dice(&s->state, -1, 1);
        planes[i].distance = .5 * stretch * fabs(coordinate(s));
    }
}

static void make_leaf(scene *s, nebel_shape *shape, nebel_shape_type type)
{
    *shape = (nebel_shape){.type = type};
    turn(s, &shape->transform);
    place(s, shape->min);
    for (int k = 0; k < 3; k++) {
        shape->max[k] = within(shape->min[k] + extent(s), -1e15, 1e15);
        if (!(shape->min[k] < shape->max[k])) shape->min[k] = nextafter(shape->max[k], -1e16);
        shape->min[k] = within(shape->min[k], -1e15, 1e15);
        if (!(shape->min[k] < shape->max[k])) shape->max[k] = 0;
        shape->radii[k] = extent(s);
        shape->normal[k] = dice(&s->state, -1, 1);
    }
    place(s, shape->center);
    place(s, shape->from);
    place(s, shape->to);
    place(s, shape->point);
    shape->radius = extent(s);
    shape->radius_from = one_in(s, 3) ? 0 : extent(s);
    shape->radius_to = extent(s);
    if (type == NEBEL_SHAPE_CONVEX) make_planes(s, shape);
}

static void make_shape(scene *s, size_t i, nebel_shape *shape)
{
    const int type = dice_below(&s->state, NEBEL_SHAPE_COUNT);
    if (type != NEBEL_SHAPE_UNION && type != NEBEL_SHAPE_INTERSECTION) {
        make_leaf(s, shape, (nebel_shape_type)type);
        return;
    }
    *shape = (nebel_shape){.type = (nebel_shape_type)type, .parts = s->parts[i], .part_count = PARTS};
    turn(s, &shape->transform);
    for (int k = 0; k < PARTS; k++)
        make_leaf(s, &s->parts[i][k], (nebel_shape_type)dice_below(&s->state, NEBEL_SHAPE_UNION));
}

static void make_density(scene *s, const nebel_shape *shape, nebel_density *d)
{
    const int round = shape->type == NEBEL_SHAPE_SPHERE || shape->type == NEBEL_SHAPE_ELLIPSOID;
    const int has_edge = shape->type != NEBEL_SHAPE_WORLD && shape->type < NEBEL_SHAPE_UNION;
    do {
        d->type = (nebel_density_type)dice_below(&s->state, NEBEL_DENSITY_GRID);
    } while ((d->type == NEBEL_DENSITY_RADIAL && !round) || (d->type == NEBEL_DENSITY_SOFT_EDGE && !has_edge));
    d->below = one_in(s, 2) ? NEBEL_BELOW_GROW : NEBEL_BELOW_CONSTANT;
    d->base = coordinate(s);
    d->scale_height = extent(s);
    place(s, d->from);
    place(s, d->to);
    d->power = 1 + dice_below(&s->state, 3);
    place(s, d->center);
    d->sigma = extent(s);
    d->edge_width = extent(s);
}

static void make_volume(scene *s, size_t i)
{
    nebel_volume_desc *const v = &s->volumes[i];
    *v = (nebel_volume_desc){.operation = one_in(s, 5) ? (nebel_operation)dice_below(&s->state, NEBEL_OPERATION_COUNT)
                                                       : NEBEL_OPERATION_ADD,
                             .priority = one_in(s, 5) ? (one_in(s, 2) ? INT_MAX : INT_MIN) : 0};
    if (one_in(s, 10)) v->start = extent(s);
    if (one_in(s, 10)) v->cutoff = v->start + extent(s);
    if (!(v->cutoff > v->start && v->cutoff <= 1e15)) v->cutoff = 0;
    make_shape(s, i, &v->shape);
    make_density(s, &v->shape, &v->density);
    amounts(s, v->extinction, 1e9);
    if (one_in(s, 2))
        amounts(s, v->source, 1e9);
    else
        amounts(s, v->albedo, 1);
    if (one_in(s, 4)) amounts(s, v->emission, 1e9);
}

static void make_scene(scene *s, uint64_t seed)
{
    *s = (scene){.state = seed};
    s->size = one_in(s, 2) ? 1 : pow(10, dice(&s->state, -reach, reach));
    amounts(s, s->ambient, 1e9);
    s->count = (size_t)(1 + dice_below(&s->state, MOST_VOLUMES));
    for (size_t i = 0; i < s->count; i++) make_volume(s, i);
}

static nebel_ray make_ray(scene *s)
{
    nebel_ray ray = {.t_max = extent(s)};
    const double lengths[] = {1, 1, 1, 1e300, 1e-300, DBL_TRUE_MIN, 1e-20, DBL_MAX};
    const double length = lengths[dice_below(&s->state, 8)];
    place(s, ray.origin);
    const int axis = dice_below(&s->state, 3);
    for (int k = 0; k < 3; k++) ray.direction[k] = one_in(s, 4) ? 0 : dice(&s->state, -1, 1) * length;
    if (one_in(s, 3))
        for (int k = 0; k < 3; k++) ray.direction[k] = -ray.origin[k];
    if (ray.direction[0] == 0 && ray.direction[1] == 0 && ray.direction[2] == 0) ray.direction[axis] = length;
    if (one_in(s, 3)) ray.t_max = HUGE_VAL;
    if (one_in(s, 12)) ray.t_max = one_in(s, 2) ? 0 : DBL_MAX;
    return ray;
}

/* ---- what must hold -------------------------------------------------------------------------- */

static nebel_lighting *commit(const scene *s, size_t *refused)
{
    nebel_fog *fog = NULL;
    nebel_snapshot *snapshot = NULL;
    const nebel_lighting_desc lights = {.environment = {.radiance = {s->ambient[0], s->ambient[1], s->ambient[2]}}};
    assert_int_equal(nebel_create_fog(&(nebel_fog_desc){0}, &fog), NEBEL_OK);
    for (size_t i = 0; i < s->count; i++) {
        const nebel_result result = nebel_add_volume(fog, &s->volumes[i], NULL);
        assert_true(result == NEBEL_OK || result == NEBEL_ERROR_VALUE);
        *refused += result == NEBEL_ERROR_VALUE;
    }
    assert_int_equal(nebel_commit_fog(fog, &snapshot), NEBEL_OK);
    nebel_destroy_fog(fog);
    nebel_lighting *lighting = light_fog(snapshot, &lights);
    nebel_release_snapshot(snapshot);
    return lighting;
}

static int is_light(const nebel_transfer *transfer)
{
    int good = transfer->error >= 0 && isfinite(transfer->error);
    for (int c = 0; c < 3; c++) {
        const double T = transfer->transmittance[c], S = transfer->in_scattering[c];
        good = good && T >= 0 && T <= 1 && S >= 0 && isfinite(S);
    }
    return good;
}

static void say(uint64_t seed, const char *what, const nebel_ray *ray, const nebel_transfer *transfer)
{
    print_message("scene %llu, %s: ray %g %g %g  %g %g %g  %g\n", (unsigned long long)seed, what, ray->origin[0],
                  ray->origin[1], ray->origin[2], ray->direction[0], ray->direction[1], ray->direction[2], ray->t_max);
    print_message("    T %g %g %g S %g %g %g error %g\n", transfer->transmittance[0], transfer->transmittance[1],
                  transfer->transmittance[2], transfer->in_scattering[0], transfer->in_scattering[1],
                  transfer->in_scattering[2], transfer->error);
}

static int may_be_unbounded(const scene *s, const nebel_ray *ray)
{
    if (ray->t_max < 1e17) return 0;
    for (size_t i = 0; i < s->count; i++)
        for (int c = 0; c < 3; c++)
            if (s->volumes[i].emission[c] > 0 && s->volumes[i].operation != NEBEL_OPERATION_EXCLUDE) return 1;
    return 0;
}

typedef struct tally {
    size_t rays, unbounded, refused, wrong;
} tally;

/* One ray; on OK the light in *light. */
static int try_ray(const scene *s, uint64_t seed, const nebel_lighting *lighting, nebel_precision precision,
                   const nebel_ray *ray, nebel_transfer *transfer, tally *sum)
{
    static const char *const names[] = {"double", "float"};
    size_t failed = 99;
    const double tolerances[] = {0, 1e-5, 10};
    const nebel_trace_desc desc = {
        .lighting = lighting, .precision = precision, .tolerance = tolerances[seed % 3], .failed_ray = &failed};
    const nebel_snapshot *snapshot = nebel_get_lighting_snapshot(lighting);
    const nebel_result result = nebel_trace(snapshot, &desc, 1, ray, sizeof *ray, transfer, sizeof *transfer);
    if (result == NEBEL_ERROR_UNBOUNDED) {
        sum->unbounded++;
        assert_int_equal(failed, 0);
        assert_true(may_be_unbounded(s, ray));
        return 0;
    }
    assert_int_equal(result, NEBEL_OK);
    sum->rays++;
    if (is_light(transfer)) return 1;
    sum->wrong++;
    say(seed, names[precision], ray, transfer);
    return 0;
}

static void try_scene(uint64_t seed, tally *sum)
{
    static scene s;
    make_scene(&s, seed);
    nebel_lighting *const lighting = commit(&s, &sum->refused);
    for (int r = 0; r < RAYS; r++) {
        const nebel_ray ray = make_ray(&s);
        nebel_transfer exact, transfer;
        const int good = try_ray(&s, seed, lighting, NEBEL_PRECISION_DOUBLE, &ray, &exact, sum);
        if (!try_ray(&s, seed, lighting, NEBEL_PRECISION_FLOAT, &ray, &transfer, sum) || !good) continue;
        if (!compares_precisions) continue;
        if (fog_difference(&exact, &transfer) <= exact.error + transfer.error) continue;
        sum->wrong++;
        say(seed, "double and float disagree", &ray, &exact);
        say(seed, "beyond their errors", &ray, &transfer);
    }
    nebel_release_lighting(lighting);
}

static void test_extreme_but_legal_fog_gives_numbers_within_their_ranges(void **unused)
{
    (void)unused;
    tally sum = {0};
    for (uint64_t seed = 0; seed < scene_count; seed++) try_scene(seed, &sum);
    print_message("%zu rays, %zu unbounded, %zu volumes refused\n", sum.rays, sum.unbounded, sum.refused);
    assert_int_equal(sum.wrong, 0);
    assert_true(sum.refused < scene_count);
    assert_true(sum.unbounded < sum.rays / 20);
}

static void test_distances_to_a_transmittance_lie_on_the_ray(void **unused)
{
    (void)unused;
    static scene s;
    size_t refused = 0, found = 0;
    for (uint64_t seed = 0; seed < scene_count; seed++) {
        make_scene(&s, seed);
        nebel_lighting *const lighting = commit(&s, &refused);
        const nebel_snapshot *snapshot = nebel_get_lighting_snapshot(lighting);
        for (int r = 0; r < RAYS; r++) {
            const nebel_ray ray = make_ray(&s);
            const double wanted = one_in(&s, 3) ? 1e-300 : one_in(&s, 2) ? nextafter(1, 0) : .5;
            double distance = -1;
            assert_int_equal(nebel_invert_transmittance(snapshot, wanted, r % 3, 1, &ray, sizeof ray, &distance),
                             NEBEL_OK);
            const int good = distance == HUGE_VAL || (distance >= 0 && distance <= ray.t_max);
            if (!good) print_message("scene %zu ray %d: distance %g of %g\n", (size_t)seed, r, distance, ray.t_max);
            assert_true(good);
            found += distance < HUGE_VAL;
        }
        nebel_release_lighting(lighting);
    }
    assert_true(found > scene_count);
}

static void test_segments_give_transmittances(void **unused)
{
    (void)unused;
    static scene s;
    size_t refused = 0;
    for (uint64_t seed = 0; seed < scene_count; seed++) {
        make_scene(&s, seed);
        nebel_lighting *const lighting = commit(&s, &refused);
        const nebel_snapshot *snapshot = nebel_get_lighting_snapshot(lighting);
        float from[RAYS][3], to[RAYS][3], out[RAYS];
        for (int r = 0; r < RAYS; r++)
            for (int k = 0; k < 3; k++) {
                from[r][k] = (float)coordinate(&s);
                to[r][k] = (float)coordinate(&s);
            }
        const nebel_segments segments = {{0}, &from[0][0], sizeof from[0], &to[0][0], sizeof to[0], 0};
        const nebel_result result =
            nebel_compute_segment_transmittance(snapshot, NEBEL_ISA_DEFAULT, 1, RAYS, &segments, out, 0);
        assert_true(result == NEBEL_OK);
        for (int r = 0; r < RAYS; r++) assert_true(out[r] >= 0 && out[r] <= 1);
        nebel_release_lighting(lighting);
    }
}

/* Fog of two colours whose optical depth reaches 1 within 1e-17 m, seen through thin fog. */
static void test_a_wall_of_fog_is_seen_behind_thin_fog(void **unused)
{
    (void)unused;
    const nebel_volume_desc volumes[] = {
        {.shape = {.type = NEBEL_SHAPE_WORLD}, .extinction = {1e-6, 1e-6, 1e-6}, .source = {1.4, 1.4, 1.4}},
        {.shape = {.type = NEBEL_SHAPE_HALF_SPACE, .point = {0, -2e5, 0}, .normal = {0, 1, 0}},
         .density = {.type = NEBEL_DENSITY_HEIGHT, .scale_height = 2.3, .below = NEBEL_BELOW_GROW},
         .extinction = {.18, .18, .18},
         .source = {.3, .3, .3}}};
    const nebel_precision precisions[] = {NEBEL_PRECISION_DOUBLE, NEBEL_PRECISION_FLOAT};
    const nebel_ray down = {{3, 0, 2}, {0, -1, 0}, HUGE_VAL};
    const double through = exp(-1e-6 * 2e5), expected = 1.4 * (1 - through) + .3 * through;
    nebel_snapshot *const fog = fog_commit(&(nebel_fog_desc){0}, volumes, 2);
    for (int p = 0; p < 2; p++) {
        nebel_transfer transfer;
        const nebel_trace_desc desc = {.precision = precisions[p]};
        assert_int_equal(nebel_trace(fog, &desc, 1, &down, sizeof down, &transfer, sizeof transfer), NEBEL_OK);
        for (int c = 0; c < 3; c++) {
            assert_true(transfer.transmittance[c] <= transfer.error);
            assert_true(fabs(transfer.in_scattering[c] - expected) <= transfer.error + 1e-15);
        }
        assert_true(transfer.error < 1e-4);
    }
    nebel_release_snapshot(fog);
}

/* A density that begins on a face, a rounding beside the place where the ray meets the face: on endless rays that
 * sliver is nearly no part of the ray and of its optical depth. */
static void test_endless_rays_pass_slivers_between_a_face_and_a_density(void **unused)
{
    (void)unused;
    const nebel_volume_desc volumes[] = {
        {.shape = {.type = NEBEL_SHAPE_HALF_SPACE, .point = {0, .9, 0}, .normal = {0, 1, 0}},
         .density = {.type = NEBEL_DENSITY_LINEAR, .from = {0, .9, 0}, .to = {0, 0, 0}},
         .extinction = {.03, .03, .03},
         .source = {.55, .6, .7}},
        {.shape = {.type = NEBEL_SHAPE_WORLD},
         .density = {.type = NEBEL_DENSITY_HEIGHT, .scale_height = 30, .below = NEBEL_BELOW_GROW},
         .extinction = {.004, .004, .004},
         .source = {.42, .5, .66}}};
    nebel_snapshot *const fog = fog_commit(&(nebel_fog_desc){0}, volumes, 2);
    uint64_t dices = 34;
    for (int i = 0; i < 40; i++) {
        nebel_ray ray = {{.4, 7.6, 19}, {dice(&dices, -1, 1), dice(&dices, -2, -.2), dice(&dices, -1, 1)}, 1e6};
        nebel_transfer finite, endless;
        assert_int_equal(nebel_trace(fog, NULL, 1, &ray, sizeof ray, &finite, sizeof finite), NEBEL_OK);
        ray.t_max = HUGE_VAL;
        assert_int_equal(nebel_trace(fog, NULL, 1, &ray, sizeof ray, &endless, sizeof endless), NEBEL_OK);
        assert_true(endless.error < 1e-4);
        assert_true(fabs(endless.in_scattering[0] - finite.in_scattering[0]) <= endless.error + finite.error);
    }
    nebel_release_snapshot(fog);
}

int main(int argc, char **argv)
{
    if (argc > 1) scene_count = (size_t)strtoull(argv[1], NULL, 10);
    if (scene_count == 0) scene_count = nb_test_count(argc > 2 ? SCENES_WITHIN_REACH : SCENES);
    if (argc > 2) reach = within(strtod(argv[2], NULL), 0, 15);
    compares_precisions = argc > 2;
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_extreme_but_legal_fog_gives_numbers_within_their_ranges),
        cmocka_unit_test(test_distances_to_a_transmittance_lie_on_the_ray),
        cmocka_unit_test(test_segments_give_transmittances),
        cmocka_unit_test(test_a_wall_of_fog_is_seen_behind_thin_fog),
        cmocka_unit_test(test_endless_rays_pass_slivers_between_a_face_and_a_density),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
