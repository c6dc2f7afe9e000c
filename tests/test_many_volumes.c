/* Very many volumes: a million of them in the world, thousands of them on one ray. test_many_volumes [VOLUMES] */
#include <math.h>
#include <time.h>

#include "fog_help.h"

#if defined(__SANITIZE_ADDRESS__)
enum { VOLUMES = 50000 };
#elif SIZE_MAX == UINT32_MAX
enum { VOLUMES = 200000 }; /* programs of 32 bits have 2 GiB of Windows */
#else
enum { VOLUMES = 1000000 };
#endif
static size_t volume_count;

enum { RAYS = 24, CROWD = 3000 };

static double seconds(void)
{
    return (double)clock() / CLOCKS_PER_SEC;
}

typedef struct ball {
    double center[3], radius, extinction;
} ball;

static nebel_volume_desc describe(const ball *b)
{
    return (nebel_volume_desc){.shape = {.type = NEBEL_SHAPE_SPHERE,
                                         .center = {b->center[0], b->center[1], b->center[2]},
                                         .radius = b->radius},
                               .extinction = {b->extinction, 2 * b->extinction, 0},
                               .source = {1, 2, 3}};
}

/* How long a ray with a direction of unit length is inside. */
static double chord(const ball *b, const nebel_ray *ray)
{
    double along = 0, square = 0;
    for (int k = 0; k < 3; k++) along += (b->center[k] - ray->origin[k]) * ray->direction[k];
    for (int k = 0; k < 3; k++) {
        const double off = ray->origin[k] + along * ray->direction[k] - b->center[k];
        square += off * off;
    }
    const double half = sqrt(fmax(b->radius * b->radius - square, 0));
    return fmax(fmin(along + half, ray->t_max) - fmax(along - half, 0), 0);
}

static nebel_ray random_ray(uint64_t *state, double size)
{
    nebel_ray ray = {.t_max = dice(state, 0, 2) < 1 ? HUGE_VAL : dice(state, 0, size)};
    double square = 0;
    for (int k = 0; k < 3; k++) {
        ray.origin[k] = dice(state, 0, size);
        ray.direction[k] = dice(state, 0, size) - ray.origin[k];
        square += ray.direction[k] * ray.direction[k];
    }
    for (int k = 0; k < 3; k++) ray.direction[k] /= sqrt(square);
    return ray;
}

/* ---- a million in the world ------------------------------------------------------------------ */

static void assert_right(const nebel_snapshot *snapshot, const ball *balls, size_t n, const nebel_ray *ray, size_t *met)
{
    double depth = 0;
    for (size_t i = 0; i < n; i++) {
        const double length = chord(&balls[i], ray);
        depth += length * balls[i].extinction;
        *met += length > 0 ? 1 : 0;
    }
    for (int precision = 0; precision < 2; precision++) {
        nebel_transfer transfer;
        const nebel_trace_desc desc = {.precision = (nebel_precision)precision};
        assert_int_equal(nebel_trace(snapshot, &desc, 1, ray, sizeof *ray, &transfer, sizeof transfer), NEBEL_OK);
        const double slack = precision == 0 ? 1e-12 : 1e-6 + transfer.error;
        for (int c = 0; c < 2; c++) {
            const double T = exp(-(c + 1) * depth);
            assert_true(fabs(transfer.transmittance[c] - T) <= slack);
            assert_true(fabs(transfer.in_scattering[c] - (c + 1) * (1 - T)) <= 4 * slack);
        }
        assert_true(transfer.transmittance[2] == 1 && transfer.in_scattering[2] == 0);
    }
}

static ball *make_balls(uint64_t *state, double size)
{
    ball *const balls = calloc(volume_count, sizeof *balls);
    assert_non_null(balls);
    for (size_t i = 0; i < volume_count; i++) {
        for (int k = 0; k < 3; k++) balls[i].center[k] = dice(state, 0, size);
        balls[i].radius = dice(state, .05, .2);
        balls[i].extinction = dice(state, 0, 1);
    }
    return balls;
}

static void test_a_million_volumes_are_found_by_every_ray(void **unused)
{
    (void)unused;
    uint64_t state = 1;
    const double size = cbrt((double)volume_count);
    ball *const balls = make_balls(&state, size);
    fog_memory memory = {0};
    nebel_fog *fog = NULL;
    nebel_snapshot *snapshot = NULL;
    assert_int_equal(nebel_create_fog(&(nebel_fog_desc){.host.allocator = fog_memory_allocator(&memory)}, &fog),
                     NEBEL_OK);
    const double start = seconds();
    for (size_t i = 0; i < volume_count; i++) {
        const nebel_volume_desc desc = describe(&balls[i]);
        assert_int_equal(nebel_add_volume(fog, &desc, NULL), NEBEL_OK);
    }
    const double added = seconds();
    const size_t fog_bytes = memory.bytes;
    assert_int_equal(nebel_commit_fog(fog, &snapshot), NEBEL_OK);
    const double committed = seconds();
    print_message(
        "%zu volumes: added in %.2f s, committed in %.2f s; %zu MB in the fog, %zu MB in the snapshot, %zu MB at "
        "the worst\n",
        volume_count, added - start, committed - added, fog_bytes >> 20, (memory.bytes - fog_bytes) >> 20,
        memory.most_bytes >> 20);
    nebel_destroy_fog(fog);
    assert_int_equal(nebel_get_volume_count(snapshot), volume_count);
    assert_true(memory.bytes / volume_count < 3000);
    size_t met = 0;
    for (int i = 0; i < RAYS; i++) {
        const nebel_ray ray = random_ray(&state, size);
        assert_right(snapshot, balls, volume_count, &ray, &met);
    }
    assert_true(met > RAYS);
    nebel_release_snapshot(snapshot);
    assert_int_equal(memory.live, 0);
    free(balls);
}

/* ---- thousands on one ray -------------------------------------------------------------------- */

static void make_crowd(ball crowd[CROWD])
{
    uint64_t state = 2;
    for (int i = 0; i < CROWD; i++) {
        for (int k = 0; k < 3; k++) crowd[i].center[k] = dice(&state, -2, 2);
        crowd[i].radius = dice(&state, 4, 9);
        crowd[i].extinction = dice(&state, 0, 1. / CROWD);
    }
}

static nebel_snapshot *commit_crowd(const ball crowd[CROWD], int step)
{
    static nebel_volume_desc volumes[CROWD];
    for (int i = 0; i < CROWD; i++) volumes[i] = describe(&crowd[(i * step) % CROWD]);
    return fog_commit(&(nebel_fog_desc){0}, volumes, CROWD);
}

static void test_thousands_of_volumes_on_one_ray_are_exact_in_any_order(void **unused)
{
    (void)unused;
    static ball crowd[CROWD];
    make_crowd(crowd);
    nebel_snapshot *const snapshot = commit_crowd(crowd, 1), *const shuffled = commit_crowd(crowd, 1009);
    nebel_ray rays[5];
    nebel_transfer transfers[5], again[5];
    double distances[5];
    for (int i = 0; i < 5; i++) rays[i] = (nebel_ray){{-20, .3 * i, -.2 * i}, {1, 0, 0}, i % 2 ? HUGE_VAL : 20.5};
    for (int precision = 0; precision < 2; precision++) {
        const nebel_trace_desc desc = {.precision = (nebel_precision)precision};
        const double start = seconds();
        assert_int_equal(nebel_trace(snapshot, &desc, 5, rays, sizeof rays[0], transfers, sizeof transfers[0]),
                         NEBEL_OK);
        print_message("%d volumes on a ray: %.1f ms a ray in %s\n", CROWD, (seconds() - start) * 200,
                      precision == 0 ? "double" : "float");
        assert_int_equal(nebel_trace(shuffled, &desc, 5, rays, sizeof rays[0], again, sizeof again[0]), NEBEL_OK);
        assert_memory_equal(transfers, again, sizeof transfers);
        for (int i = 0; i < 5; i++) {
            double depth = 0;
            for (int k = 0; k < CROWD; k++) depth += chord(&crowd[k], &rays[i]) * crowd[k].extinction;
            assert_true(fabs(transfers[i].transmittance[0] - exp(-depth)) <= transfers[i].error);
            assert_true(fabs(transfers[i].in_scattering[1] - 2 * (1 - exp(-2 * depth))) <= transfers[i].error);
            assert_true(transfers[i].error < (precision == 0 ? 1e-10 : 5e-2));
            assert_true(depth > .5);
        }
    }
    assert_int_equal(nebel_invert_transmittance(snapshot, .9, 0, 5, rays, sizeof rays[0], distances), NEBEL_OK);
    for (int i = 0; i < 5; i++) {
        nebel_ray ray = rays[i];
        double depth = 0;
        ray.t_max = distances[i];
        for (int k = 0; k < CROWD; k++) depth += chord(&crowd[k], &ray) * crowd[k].extinction;
        assert_true(fabs(depth + log(.9)) < 1e-11);
    }
    nebel_release_snapshot(snapshot);
    nebel_release_snapshot(shuffled);
}

int main(int argc, char **argv)
{
    volume_count = argc > 1 ? (size_t)strtoull(argv[1], NULL, 10) : nb_test_count(VOLUMES);
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_a_million_volumes_are_found_by_every_ray),
        cmocka_unit_test(test_thousands_of_volumes_on_one_ray_are_exact_in_any_order),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
