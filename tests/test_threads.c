/* One lighting and its snapshot, four threads: the same bits as from one, and the last owner frees it. By hand under
 * -fsanitize=thread. */
#include "random_fog.h"

#include <math.h>
#include <pthread.h>
#include <stdatomic.h>

#include "fog_help.h"

enum { THREADS = 4, ROUNDS = 20, RAYS = 53 };

typedef struct answers {
    nebel_transfer exact[RAYS], transfers[RAYS];
    double distances[RAYS];
    float transmittances[RAYS];
    size_t failures;
} answers;

typedef struct question {
    nebel_lighting *lighting; /* the thread owns one share of it */
    nebel_ray rays[RAYS];
    float to[RAYS][3];
    int rounds;
    answers *results;
} question;

static void ask(const nebel_lighting *lighting, const question *q, answers *a)
{
    const nebel_snapshot *snapshot = nebel_get_lighting_snapshot(lighting);
    const nebel_segments segments = {.to = &q->to[0][0], .to_stride = sizeof q->to[0]};
    const nebel_trace_desc in_double = {.lighting = lighting};
    const nebel_trace_desc in_float = {.lighting = lighting, .precision = NEBEL_PRECISION_FLOAT};
    const nebel_result results[] = {
        nebel_trace(snapshot, &in_double, RAYS, q->rays, sizeof(nebel_ray), a->exact, sizeof(nebel_transfer)),
        nebel_trace(snapshot, &in_float, RAYS, q->rays, sizeof(nebel_ray), a->transfers, sizeof(nebel_transfer)),
        nebel_invert_transmittance(snapshot, .5, 1, RAYS, q->rays, sizeof(nebel_ray), a->distances),
        nebel_compute_segment_transmittance(snapshot, NEBEL_ISA_DEFAULT, 2, RAYS, &segments, a->transmittances, 0)};
    for (size_t i = 0; i < sizeof results / sizeof results[0]; i++) a->failures += results[i] != NEBEL_OK;
}

/* Asks, takes and gives back shares, and gives back the own one last. */
static void *work(void *user)
{
    question *const q = user;
    for (int round = 0; round < q->rounds; round++) {
        nebel_lighting *const again = nebel_retain_lighting(q->lighting);
        nebel_snapshot *const snapshot = nebel_retain_snapshot(nebel_get_lighting_snapshot(again));
        ask(again, q, q->results);
        nebel_release_lighting(again);
        nebel_release_snapshot(snapshot);
    }
    nebel_release_lighting(q->lighting);
    return NULL;
}

/* ---- memory that threads may use at once, as nebel calls it from the thread that calls nebel ---- */

static atomic_size_t live;

static void *allocate(size_t size, void *user)
{
    (void)user;
    atomic_fetch_add(&live, 1);
    return malloc(size);
}

static void release(void *memory, void *user)
{
    (void)user;
    atomic_fetch_sub(&live, 1);
    free(memory);
}

static question make_question(const random_fog *fog)
{
    question q = {.rounds = ROUNDS};
    for (int i = 0; i < RAYS; i++) {
        q.rays[i] = random_fog_ray(fog, (uint64_t)i);
        for (int k = 0; k < 3; k++) q.to[i][k] = (float)(20 * sin(1 + i * (k + 1.3)));
    }
    return q;
}

/* One lighting is asked by this thread alone, another one of the same by threads, what it prepares when it is asked included. */
static void query_with_threads(const question *q, const nebel_volume_desc *volumes, size_t count,
                               const nebel_lighting_desc *lights)
{
    static answers alone, results[THREADS];
    question questions[THREADS];
    pthread_t threads[THREADS];
    const nebel_fog_desc desc = {.host.allocator = {allocate, release, NULL}};
    nebel_lighting *const first = fog_commit_lit(&desc, volumes, count, lights);
    nebel_lighting *const lighting = fog_commit_lit(&desc, volumes, count, lights);
    memset(&alone, 0, sizeof alone);
    ask(first, q, &alone);
    nebel_release_lighting(first);
    assert_int_equal(alone.failures, 0);
    for (int i = 0; i < THREADS; i++) {
        memset(&results[i], 0, sizeof results[i]);
        questions[i] = *q;
        questions[i].lighting = nebel_retain_lighting(lighting);
        questions[i].results = &results[i];
    }
    for (int i = 0; i < THREADS; i++) assert_int_equal(pthread_create(&threads[i], NULL, work, &questions[i]), 0);
    nebel_release_lighting(lighting); /* some thread is the last owner */
    for (int i = 0; i < THREADS; i++) assert_int_equal(pthread_join(threads[i], NULL), 0);
    for (int i = 0; i < THREADS; i++) assert_memory_equal(&alone, &results[i], sizeof alone);
}

static void test_threads_get_the_same_bits_from_one_lighting(void **unused)
{
    (void)unused;
    static random_fog fog;
    const nebel_lighting_desc lights = {.environment = {.radiance = {.1, .2, .3}}};
    for (uint64_t seed = 0; seed < 2 * RANDOM_FOG_KIND_COUNT; seed++) {
        random_fog_make(&fog, (random_fog_kind)(seed % RANDOM_FOG_KIND_COUNT), 300 + seed);
        const question q = make_question(&fog);
        query_with_threads(&q, fog.volumes, fog.count, &lights);
        assert_int_equal(atomic_load(&live), 0);
    }
}

/* Depths to point lights in voxels are found when they are asked for, by all threads that ask. */
static void test_threads_share_what_voxels_prepare(void **unused)
{
    enum { SIDE = 16, LIGHTS = 5 };
    static unsigned char voxels[SIDE * SIDE * SIDE];
    (void)unused;
    for (unsigned i = 0; i < sizeof voxels; i++) voxels[i] = (unsigned char)(i * 2654435761U >> 24);
    const nebel_grid_desc desc = {.size = {SIDE, SIDE, SIDE}, .type = NEBEL_VOXEL_UINT8, .voxels = voxels};
    nebel_grid *grid;
    assert_int_equal(nebel_create_grid(&desc, &grid), NEBEL_OK);
    const nebel_volume_desc v = {.shape = {.type = NEBEL_SHAPE_BOX, .min = {-3, -3, -3}, .max = {3, 3, 3}},
                                 .density = {.type = NEBEL_DENSITY_GRID, .grid = grid},
                                 .extinction = {.2, .3, .4},
                                 .albedo = {.9, .8, .7}};
    nebel_light all[LIGHTS];
    question q = {.rounds = 1}; /* the first asks for what is not there yet */
    for (int i = 0; i < LIGHTS; i++)
        all[i] = (nebel_light){.position = {i - 2, sin(i), 2 * cos(i)}, .intensity = {3, 4, 5}, .radius = .1};
    for (int i = 0; i < RAYS; i++) {
        q.rays[i] = (nebel_ray){{8 * sin(i), 3 * cos(3 * i), 8 * cos(i)}, {-sin(i), .1 * sin(5 * i), -cos(i)}, 20};
        for (int k = 0; k < 3; k++) q.to[i][k] = (float)(4 * sin(1 + i * (k + 1.3)));
    }
    query_with_threads(&q, &v, 1, &(nebel_lighting_desc){.lights = all, .light_count = LIGHTS});
    nebel_release_grid(grid);
    assert_int_equal(atomic_load(&live), 0);
}

/* Fogs of different threads have nothing in common. */
static void *edit(void *user)
{
    size_t *const count = user;
    nebel_fog *fog = NULL;
    if (nebel_create_fog(&(nebel_fog_desc){.host.allocator = {allocate, release, NULL}}, &fog) != NEBEL_OK) return NULL;
    for (int i = 0; i < 300; i++) {
        const nebel_volume_desc ball = {.shape = {.type = NEBEL_SHAPE_SPHERE, .center = {i, 0, 0}, .radius = 1}};
        nebel_volume_id id;
        nebel_snapshot *snapshot = NULL;
        if (nebel_add_volume(fog, &ball, &id) != NEBEL_OK) break;
        if (i % 3 == 0 && nebel_remove_volume(fog, id) != NEBEL_OK) break;
        if (i % 20 == 0 && nebel_commit_fog(fog, &snapshot) != NEBEL_OK) break;
        if (snapshot != NULL) *count = nebel_get_volume_count(snapshot);
        nebel_release_snapshot(snapshot);
    }
    nebel_destroy_fog(fog);
    return NULL;
}

static void test_threads_edit_fogs_of_their_own(void **unused)
{
    (void)unused;
    pthread_t threads[THREADS];
    size_t counts[THREADS] = {0};
    for (int i = 0; i < THREADS; i++) assert_int_equal(pthread_create(&threads[i], NULL, edit, &counts[i]), 0);
    for (int i = 0; i < THREADS; i++) assert_int_equal(pthread_join(threads[i], NULL), 0);
    for (int i = 0; i < THREADS; i++) assert_int_equal(counts[i], 187); /* of 281 every third is gone */
    assert_int_equal(atomic_load(&live), 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_threads_get_the_same_bits_from_one_lighting),
        cmocka_unit_test(test_threads_share_what_voxels_prepare),
        cmocka_unit_test(test_threads_edit_fogs_of_their_own),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
