/* What must hold whatever the answer is: the order of submission, cuts through volumes and rays, instruction sets and
 * the way rays are grouped change nothing, nor does moving everything by 1e7 m. */
#include "random_fog.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#include "fog_help.h"

enum { RAYS = 37 }; /* no multiple of any number of lanes */

static const nebel_precision precisions[] = {NEBEL_PRECISION_DOUBLE, NEBEL_PRECISION_FLOAT};

static nebel_lighting *commit(const double ambient[3], const nebel_volume_desc *volumes, size_t n)
{
    const nebel_lighting_desc lights = {.environment = {.radiance = {ambient[0], ambient[1], ambient[2]}}};
    return fog_light(&lights, volumes, n);
}

static void trace(const nebel_lighting *lighting, const nebel_trace_desc *desc, size_t n, const nebel_ray *rays,
                  nebel_transfer *transfers)
{
    memset(transfers, 0, n * sizeof *transfers);
    fog_trace(lighting, *desc, n, rays, transfers);
}

static void trace_as(const nebel_trace_desc *desc, const random_fog *fog, const nebel_volume_desc *volumes, size_t n,
                     const nebel_ray rays[RAYS], nebel_transfer transfers[RAYS])
{
    nebel_lighting *const lighting = commit(fog->ambient, volumes, n);
    trace(lighting, desc, RAYS, rays, transfers);
    nebel_release_lighting(lighting);
}

static void trace_volumes(const random_fog *fog, const nebel_volume_desc *volumes, size_t n, nebel_precision precision,
                          const nebel_ray rays[RAYS], nebel_transfer transfers[RAYS])
{
    trace_as(&(nebel_trace_desc){.precision = precision, .tolerance = 1e-5}, fog, volumes, n, rays, transfers);
}

static void make(random_fog *fog, random_fog_kind kind, uint64_t seed, nebel_ray rays[RAYS])
{
    random_fog_make(fog, kind, seed);
    for (uint64_t r = 0; r < RAYS; r++) rays[r] = random_fog_ray(fog, r);
}

/* Says what differs, so that it can be seen again. */
static void report(const char *what, const random_fog *fog, const nebel_ray *ray, const nebel_transfer *a,
                   const nebel_transfer *b)
{
    printf("\n%s: kind %d, seed %zu: differs by %g\n", what, (int)fog->kind, (size_t)fog->seed, fog_difference(a, b));
    random_fog_print(stdout, fog, ray);
    for (int i = 0; i < 2; i++) {
        const nebel_transfer *const l = i == 0 ? a : b;
        printf("T %.17g %.17g %.17g S %.17g %.17g %.17g error %g\n", l->transmittance[0], l->transmittance[1],
               l->transmittance[2], l->in_scattering[0], l->in_scattering[1], l->in_scattering[2], l->error);
    }
}

static void assert_same_bits(const char *what, const random_fog *fog, const nebel_ray *rays, const nebel_transfer *a,
                             const nebel_transfer *b)
{
    for (int i = 0; i < RAYS; i++) {
        if (memcmp(&a[i], &b[i], sizeof a[i]) != 0) report(what, fog, &rays[i], &a[i], &b[i]);
        assert_memory_equal(&a[i], &b[i], sizeof a[i]);
    }
}

/* The volumes in another order. */
static void shuffle(const random_fog *fog, uint64_t seed, nebel_volume_desc *volumes)
{
    memcpy(volumes, fog->volumes, fog->count * sizeof *volumes);
    for (size_t i = fog->count; i > 1; i--) {
        seed = seed * 6364136223846793005u + 1442695040888963407u;
        const size_t j = (size_t)(seed >> 33) % i;
        const nebel_volume_desc swap = volumes[i - 1];
        volumes[i - 1] = volumes[j];
        volumes[j] = swap;
    }
}

static random_fog fog; /* large, and points into itself */

static void test_the_order_of_submission_changes_no_bit(void **unused)
{
    (void)unused;
    for (int trial = 0; trial < RANDOM_FOG_KIND_COUNT * 12; trial++) {
        nebel_ray rays[RAYS];
        nebel_transfer transfers[RAYS], again[RAYS];
        nebel_volume_desc shuffled[RANDOM_FOG_VOLUMES];
        make(&fog, (random_fog_kind)(trial % RANDOM_FOG_KIND_COUNT), 1000 + (uint64_t)trial, rays);
        for (int p = 0; p < 2; p++) {
            trace_volumes(&fog, fog.volumes, fog.count, precisions[p], rays, transfers);
            for (uint64_t order = 0; order < 3; order++) {
                shuffle(&fog, order + (uint64_t)trial * 3, shuffled);
                trace_volumes(&fog, shuffled, fog.count, precisions[p], rays, again);
                assert_same_bits("another order", &fog, rays, transfers, again);
            }
        }
    }
}

static void test_instruction_sets_and_grouping_change_no_bit(void **unused)
{
    (void)unused;
    for (int trial = 0; trial < RANDOM_FOG_KIND_COUNT * 12; trial++) {
        nebel_ray rays[RAYS];
        nebel_transfer transfers[RAYS], again[RAYS];
        make(&fog, (random_fog_kind)(trial % RANDOM_FOG_KIND_COUNT), 2000 + (uint64_t)trial, rays);
        nebel_lighting *const lighting = commit(fog.ambient, fog.volumes, fog.count);
        for (int isa = NEBEL_ISA_SCALAR; isa < NEBEL_ISA_COUNT; isa++) {
            if (!nebel_isa_available((nebel_isa)isa)) continue;
            const nebel_trace_desc desc = {
                .precision = NEBEL_PRECISION_FLOAT, .isa = (nebel_isa)isa, .tolerance = 1e-5};
            trace(lighting, &desc, RAYS, rays, isa == NEBEL_ISA_SCALAR ? transfers : again);
            if (isa != NEBEL_ISA_SCALAR) assert_same_bits(nebel_isa_name((nebel_isa)isa), &fog, rays, transfers, again);
            for (int i = 0; i < RAYS; i++) trace(lighting, &desc, 1, &rays[i], &again[i]);
            assert_same_bits("one by one", &fog, rays, transfers, again);
        }
        nebel_release_lighting(lighting);
    }
}

/* ---- a volume in two halves that touch ------------------------------------------------------- */

/* The volume's shape and a half space on one side of a plane. */
static void halve(const nebel_volume_desc *whole, const double point[3], const double normal[3],
                  nebel_shape parts[2][2], nebel_volume_desc halves[2])
{
    for (int side = 0; side < 2; side++) {
        parts[side][0] = whole->shape;
        parts[side][1] = (nebel_shape){.type = NEBEL_SHAPE_HALF_SPACE};
        for (int k = 0; k < 3; k++) {
            parts[side][1].point[k] = point[k];
            parts[side][1].normal[k] = side == 0 ? normal[k] : -normal[k];
        }
        halves[side] = *whole;
        halves[side].shape = (nebel_shape){.type = NEBEL_SHAPE_INTERSECTION, .parts = parts[side], .part_count = 2};
    }
}

/* A box is also two boxes. */
static void halve_box(const nebel_volume_desc *whole, int axis, double where, nebel_volume_desc halves[2])
{
    halves[0] = halves[1] = *whole;
    halves[0].shape.max[axis] = where;
    halves[1].shape.min[axis] = where;
}

static int can_be_halved(const nebel_volume_desc *v)
{
    return v->density.type != NEBEL_DENSITY_RADIAL && v->density.type != NEBEL_DENSITY_SOFT_EDGE;
}

/* Some rays run in the plane of the cut, exactly where it is across an axis. */
static void run_in_plane(const double point[3], int axis, nebel_ray rays[RAYS])
{
    for (int i = 0; i < RAYS; i += 3) {
        rays[i].origin[axis] = point[axis];
        rays[i].direction[axis] = 0;
        if (i % 2 == 0)
            for (int k = 0; k < 3; k++) rays[i].direction[k] = k == (axis + 1) % 3 ? 1 : 0;
        if (!(fabs(rays[i].direction[0]) + fabs(rays[i].direction[1]) + fabs(rays[i].direction[2]) > 0))
            rays[i].direction[(axis + 2) % 3] = -1;
    }
}

/* With a tolerance of 0, the default: what is integrated, too, differs by far less than that. */
static void assert_cut_is_invisible(const char *what, size_t index, const nebel_volume_desc halves[2],
                                    const nebel_ray rays[RAYS], double tolerance, const double allowed[2])
{
    nebel_volume_desc cut[RANDOM_FOG_VOLUMES + 1];
    nebel_transfer transfers[RAYS], again[RAYS];
    memcpy(cut, fog.volumes, fog.count * sizeof *cut);
    cut[index] = halves[0];
    cut[fog.count] = halves[1];
    for (int p = 0; p < 2; p++) {
        const nebel_trace_desc desc = {.precision = precisions[p], .tolerance = tolerance};
        trace_as(&desc, &fog, fog.volumes, fog.count, rays, transfers);
        trace_as(&desc, &fog, cut, fog.count + 1, rays, again);
        for (int i = 0; i < RAYS; i++) {
            const double apart = fog_difference(&transfers[i], &again[i]);
            if (!(apart <= allowed[p])) {
                printf("%s, %s: volume %zu\n", what, p == 0 ? "double" : "float", index);
                report("cut", &fog, &rays[i], &transfers[i], &again[i]);
            }
            assert_true(apart <= allowed[p]);
        }
    }
}

static const double closed_allowed[] = {1e-12, 1e-6}, mixed_allowed[] = {1e-6, 1e-6};

/* One even volume or several, or a single one of any profile: what has a closed form. */
static random_fog_kind closed_kind(int trial)
{
    return trial % 2 == 0 ? RANDOM_FOG_OVERLAP : RANDOM_FOG_PROFILES;
}

static void make_closed(int trial, nebel_ray rays[RAYS])
{
    make(&fog, closed_kind(trial), 3000 + (uint64_t)trial, rays);
    if (closed_kind(trial) == RANDOM_FOG_PROFILES) {
        fog.volumes[0] = fog.volumes[trial / 2 % (int)fog.count];
        fog.count = 1;
    }
}

static void test_cutting_a_volume_in_two_changes_nothing(void **unused)
{
    (void)unused;
    int cuts = 0;
    for (int trial = 0; trial < 400; trial++) {
        nebel_ray rays[RAYS];
        nebel_shape parts[2][2];
        nebel_volume_desc halves[2];
        make_closed(trial, rays);
        const size_t index = (size_t)trial / 2 % fog.count;
        if (!can_be_halved(&fog.volumes[index])) continue;
        const int axis = trial % 3, tilted = trial % 5 == 0;
        const double *const origin = rays[1].origin;
        const double point[3] = {floor(origin[0] / 3), origin[1] / 4, floor(origin[2])};
        const double normal[3] = {axis == 0 || tilted, axis == 1 || tilted ? 1 : 0, axis == 2 ? 1 : 0};
        if (!tilted) run_in_plane(point, axis, rays);
        halve(&fog.volumes[index], point, normal, parts, halves);
        assert_cut_is_invisible("half spaces", index, halves, rays, 1e-5, closed_allowed);
        cuts++;
    }
    assert_true(cuts > 200);
}

static void test_cutting_a_box_into_two_boxes_changes_nothing(void **unused)
{
    (void)unused;
    for (int trial = 0; trial < 200; trial++) {
        nebel_ray rays[RAYS];
        nebel_volume_desc halves[2];
        make_closed(2 * trial, rays);
        nebel_volume_desc *const v = &fog.volumes[1];
        v->shape = (nebel_shape){.type = NEBEL_SHAPE_BOX, .min = {-7, -4.5, -3}, .max = {6, 5.25, 8}};
        const int axis = trial % 3;
        const double where[3] = {1.1, -.3, 2};
        run_in_plane(where, axis, rays);
        halve_box(v, axis, where[axis], halves);
        assert_cut_is_invisible("boxes", 1, halves, rays, 1e-5, closed_allowed);
    }
}

/* Through the middle of everything, from all sides. */
static void aim_inwards(int trial, nebel_ray rays[RAYS])
{
    for (int i = 0; i < RAYS; i++) {
        for (int k = 0; k < 3; k++) {
            rays[i].origin[k] = 14 * sin(i * 3.7 + k * 2.1 + trial);
            rays[i].direction[k] = 4 * sin(i * 1.3 + k * 5.1 + trial * .37) - rays[i].origin[k];
        }
        rays[i].t_max = 20 + 20 * sin(i * 77.);
    }
}

/* Volumes of any profile and of different light have no closed form where they overlap. */
static void test_cutting_a_volume_that_overlaps_others_changes_nothing(void **unused)
{
    (void)unused;
    int cuts = 0;
    for (int trial = 0; trial < 1500; trial++) {
        nebel_ray rays[RAYS];
        nebel_shape parts[2][2];
        nebel_volume_desc halves[2];
        make(&fog, RANDOM_FOG_PROFILES, 9000 + (uint64_t)trial, rays);
        const size_t index = (size_t)trial % fog.count;
        if (!can_be_halved(&fog.volumes[index])) continue;
        aim_inwards(trial, rays);
        const int axis = trial % 3;
        const double point[3] = {floor(3 * sin(trial * 1.1)), floor(3 * sin(trial * 2.1)), floor(3 * sin(trial * 3.1))};
        const double normal[3] = {axis == 0, axis == 1, axis == 2};
        run_in_plane(point, axis, rays);
        halve(&fog.volumes[index], point, normal, parts, halves);
        assert_cut_is_invisible("overlapping", index, halves, rays, 0, mixed_allowed);
        cuts++;
    }
    assert_true(cuts > 700);
}

/* ---- a ray in two pieces --------------------------------------------------------------------- */

static void test_cutting_a_ray_in_two_changes_no_more_than_the_stated_errors(void **unused)
{
    (void)unused;
    for (int trial = 0; trial < RANDOM_FOG_KIND_COUNT * 20; trial++) {
        nebel_ray rays[RAYS], near[RAYS], far[RAYS];
        nebel_transfer whole[RAYS], first[RAYS], second[RAYS];
        make(&fog, (random_fog_kind)(trial % RANDOM_FOG_FAR), 4000 + (uint64_t)trial, rays);
        for (int i = 0; i < RAYS; i++) {
            const double *const d = rays[i].direction;
            const double length = sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]), at = fmin(rays[i].t_max, 20) * .37;
            near[i] = far[i] = rays[i];
            near[i].t_max = at;
            far[i].t_max = rays[i].t_max - at;
            for (int k = 0; k < 3; k++) far[i].origin[k] += at * d[k] / length;
        }
        nebel_lighting *const lighting = commit(fog.ambient, fog.volumes, fog.count);
        const nebel_trace_desc desc = {.tolerance = 1e-5, .ignore_distances = 1};
        trace(lighting, &desc, RAYS, rays, whole);
        trace(lighting, &desc, RAYS, near, first);
        trace(lighting, &desc, RAYS, far, second);
        nebel_release_lighting(lighting);
        for (int i = 0; i < RAYS; i++) {
            nebel_transfer joined = {.error = first[i].error + 3 * second[i].error};
            for (int c = 0; c < 3; c++) {
                const double T = first[i].transmittance[c];
                joined.transmittance[c] = T * second[i].transmittance[c];
                joined.in_scattering[c] = first[i].in_scattering[c] + T * second[i].in_scattering[c];
            }
            /* The second origin is rounded: where the ray grazes a surface, 1e-15 beside it is 1e-7 along it. */
            const double allowed = whole[i].error + joined.error + 1e-6;
            if (!(fog_difference(&whole[i], &joined) <= allowed)) report("ray cut", &fog, &rays[i], &whole[i], &joined);
            assert_true(fog_difference(&whole[i], &joined) <= allowed);
        }
    }
}

/* ---- everything 1e7 m away ------------------------------------------------------------------- */

/* Coordinates that 1e7 can be added to without rounding. */
static void snap(double v[3])
{
    for (int k = 0; k < 3; k++) v[k] = nearbyint(v[k] * 0x1p20) * 0x1p-20;
}

static void snap_volume(nebel_volume_desc *v)
{
    nebel_shape *const s = &v->shape;
    double base[3] = {0, v->density.base, 0};
    snap(base);
    v->density.base = base[1];
    snap(s->transform.position);
    snap(s->min);
    snap(s->max);
    snap(s->center);
    snap(s->from);
    snap(s->to);
    snap(s->point);
    snap(v->density.from);
    snap(v->density.to);
    snap(v->density.center);
}

static void add(double v[3], const double by[3])
{
    for (int k = 0; k < 3; k++) v[k] += by[k];
}

/* Planes cannot be moved without rounding, but their transform can. */
static void shift_volume(nebel_volume_desc *v, const double by[3])
{
    nebel_shape *const s = &v->shape;
    const nebel_transform none = {{0}, {0}, {0}};
    if (s->type == NEBEL_SHAPE_CONVEX || memcmp(&s->transform, &none, sizeof none) != 0) {
        add(s->transform.position, by);
    } else {
        add(s->min, by);
        add(s->max, by);
        add(s->center, by);
        add(s->from, by);
        add(s->to, by);
        add(s->point, by);
    }
    add(v->density.from, by);
    add(v->density.to, by);
    add(v->density.center, by);
    v->density.base += by[1];
}

/* Rays through the volumes; those that only touch them have an answer of their own at every place. */
static void make_near(random_fog_kind kind, uint64_t seed, nebel_ray rays[RAYS])
{
    random_fog_make(&fog, kind, seed);
    for (size_t i = 0; i < fog.count; i++) snap_volume(&fog.volumes[i]);
    for (int i = 0; i < RAYS; i++) {
        rays[i] = random_fog_ray(&fog, (uint64_t)i);
        snap(rays[i].origin);
        for (int k = 0; k < 3; k++) rays[i].direction[k] = 2 * sin((double)(i + 1) * (k + 1.7)) - rays[i].origin[k];
        if (rays[i].t_max > 1e3) rays[i].t_max = HUGE_VAL;
    }
}

static void test_moving_everything_by_1e7_m_changes_only_rounding(void **unused)
{
    (void)unused;
    static const double shift[3] = {1e7, -1e7, 5e6};
    static const double allowed[] = {1e-9, 1e-5};
    for (int trial = 0; trial < 400; trial++) {
        nebel_ray rays[RAYS];
        nebel_transfer here[2][RAYS], there[RAYS];
        make_near((random_fog_kind)(trial % (RANDOM_FOG_EXCLUDE + 1)), 5000 + (uint64_t)trial, rays);
        for (int p = 0; p < 2; p++) trace_volumes(&fog, fog.volumes, fog.count, precisions[p], rays, here[p]);
        for (size_t i = 0; i < fog.count; i++) shift_volume(&fog.volumes[i], shift);
        for (int i = 0; i < RAYS; i++) add(rays[i].origin, shift);
        for (int p = 0; p < 2; p++) {
            trace_volumes(&fog, fog.volumes, fog.count, precisions[p], rays, there);
            for (int i = 0; i < RAYS; i++) {
                const double apart = fog_difference(&here[p][i], &there[i]);
                /* Adaptive steps may fall differently: then both are within the tolerance. */
                const double may = allowed[p] + (fog.count > 1 && fog.kind != RANDOM_FOG_OVERLAP ? 4e-5 : 0);
                if (!(apart <= may)) {
                    printf("%s\n", p == 0 ? "double" : "float");
                    report("far away", &fog, &rays[i], &here[p][i], &there[i]);
                }
                assert_true(apart <= may);
            }
        }
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_the_order_of_submission_changes_no_bit),
        cmocka_unit_test(test_instruction_sets_and_grouping_change_no_bit),
        cmocka_unit_test(test_cutting_a_volume_in_two_changes_nothing),
        cmocka_unit_test(test_cutting_a_box_into_two_boxes_changes_nothing),
        cmocka_unit_test(test_cutting_a_volume_that_overlaps_others_changes_nothing),
        cmocka_unit_test(test_cutting_a_ray_in_two_changes_no_more_than_the_stated_errors),
        cmocka_unit_test(test_moving_everything_by_1e7_m_changes_only_rounding),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
