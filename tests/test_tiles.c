/* Volumes per tile against rays: whatever a ray of a pixel meets must stand in the list of the pixel's tile. */
#include <nebel/shader.h>

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "fog_help.h"
#include "random_fog.h"

enum { WIDTH = 323, HEIGHT = 171, RAYS = 1500 };

/* ---- views, column-major --------------------------------------------------------------------- */

static void multiply(const double a[16], const double b[16], double out[16])
{
    for (int i = 0; i < 16; i++) {
        out[i] = 0;
        for (int k = 0; k < 4; k++) out[i] += a[4 * k + i % 4] * b[4 * (i / 4) + k];
    }
}

static void frustum(double left, double right, double bottom, double top, double near, double far, double m[16])
{
    memset(m, 0, 16 * sizeof *m);
    m[0] = 2 * near / (right - left);
    m[5] = 2 * near / (top - bottom);
    m[8] = (right + left) / (right - left);
    m[9] = (top + bottom) / (top - bottom);
    m[10] = -(far + near) / (far - near);
    m[11] = -1;
    m[14] = -2 * far * near / (far - near);
}

static void perspective(double m[16])
{
    frustum(-.19, .19, -.1, .1, .1, 500, m);
}

static void off_axis(double m[16])
{
    frustum(.05, .4, -.2, -.03, .1, 500, m);
}

static void reversed_infinite(double m[16])
{
    perspective(m);
    m[10] = 0;
    m[14] = .1;
}

static void oblique(double m[16])
{
    perspective(m);
    const double plane[4] = {.1, .3, -.9, -2};
    for (int i = 0; i < 4; i++) m[4 * i + 2] = plane[i] - m[4 * i + 3];
}

static void orthographic(double m[16])
{
    memset(m, 0, 16 * sizeof *m);
    m[0] = .06;
    m[5] = .1;
    m[10] = -.01;
    m[13] = .2;
    m[15] = 1;
}

static const struct {
    const char *name;
    void (*make)(double m[16]);
} projections[] = {{"perspective", perspective},
                   {"off-axis", off_axis},
                   {"reversed infinite", reversed_infinite},
                   {"oblique", oblique},
                   {"orthographic", orthographic}};
enum { PROJECTIONS = sizeof projections / sizeof *projections };

/* A camera at `eye` that looks at `target`, rolled by chance. */
static void look(const double eye[3], const double target[3], uint64_t *state, double m[16])
{
    double z[3], x[3], y[3], up[3], length = 0, across = 0;
    for (int i = 0; i < 3; i++) {
        z[i] = eye[i] - target[i];
        up[i] = dice(state, -1, 1);
        length += z[i] * z[i];
    }
    for (int i = 0; i < 3; i++) z[i] /= sqrt(length);
    for (int i = 0; i < 3; i++) x[i] = up[(i + 1) % 3] * z[(i + 2) % 3] - up[(i + 2) % 3] * z[(i + 1) % 3];
    for (int i = 0; i < 3; i++) across += x[i] * x[i];
    for (int i = 0; i < 3; i++) x[i] /= sqrt(across);
    for (int i = 0; i < 3; i++) y[i] = z[(i + 1) % 3] * x[(i + 2) % 3] - z[(i + 2) % 3] * x[(i + 1) % 3];
    const double turn[16] = {x[0], y[0], z[0], 0, x[1], y[1], z[1], 0, x[2], y[2], z[2], 0, 0, 0, 0, 1};
    const double move[16] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, -eye[0], -eye[1], -eye[2], 1};
    multiply(turn, move, m);
}

static nebel_ray ray_of_pixel(const nebel_rays *rays, const double pixel[2])
{
    nebel_ray ray = {.t_max = HUGE_VAL};
    for (int i = 0; i < 3; i++) {
        const double o[3] = {(double)rays->texels[0].v[i], (double)rays->texels[1].v[i], (double)rays->texels[2].v[i]};
        const double d[3] = {(double)rays->texels[3].v[i], (double)rays->texels[4].v[i], (double)rays->texels[5].v[i]};
        ray.origin[i] = rays->eye[i] + o[0] + pixel[0] * o[1] + pixel[1] * o[2];
        ray.direction[i] = d[0] + pixel[0] * d[1] + pixel[1] * d[2];
    }
    return ray;
}

/* ---- brute force ----------------------------------------------------------------------------- */

static uint32_t *tile(const nebel_snapshot *snapshot, const nebel_view *view, uint32_t size, size_t *count)
{
    assert_int_equal(nebel_bin_volumes(snapshot, view, size, NULL, 0, count), NEBEL_OK);
    uint32_t *entries = malloc(*count * sizeof *entries);
    assert_non_null(entries);
    assert_int_equal(nebel_bin_volumes(snapshot, view, size, entries, *count, count), NEBEL_OK);
    return entries;
}

static int is_listed(const uint32_t *entries, size_t k, uint32_t volume)
{
    for (uint32_t i = 0; i < entries[2 * k + 1]; i++)
        if (entries[entries[2 * k] + i] == volume) return 1;
    return 0;
}

static void assert_well_formed(const uint32_t *entries, size_t tiles, size_t count, size_t volumes)
{
    size_t next = 2 * tiles;
    for (size_t k = 0; k < tiles; k++) {
        assert_int_equal(entries[2 * k], next);
        next += entries[2 * k + 1];
        for (uint32_t i = entries[2 * k]; i < next; i++) {
            assert_true(entries[i] < volumes);
            if (i > entries[2 * k]) assert_true(entries[i] > entries[i - 1]);
        }
    }
    assert_int_equal(next, count);
}

static random_fog fog;
static nebel_snapshot *alone[RANDOM_FOG_VOLUMES];

/* Volumes whose canonical order is known: by extinction, and one exclusion behind them. `alone` are their bodies as
 * fog. */
static nebel_snapshot *make_fog(random_fog_kind kind, uint64_t seed)
{
    random_fog_make(&fog, kind, seed);
    for (size_t i = 0; i < fog.count; i++) {
        nebel_volume_desc *v = &fog.volumes[i];
        v->operation = NEBEL_OPERATION_ADD;
        v->density = (nebel_density){0};
        for (int c = 0; c < 3; c++) v->extinction[c] = 1 + (double)i;
        memset(v->emission, 0, sizeof v->emission);
        alone[i] = fog_commit(&(nebel_fog_desc){0}, v, 1);
    }
    if (seed % 2 == 1) fog.volumes[fog.count - 1].operation = NEBEL_OPERATION_EXCLUDE;
    return fog_commit(&(nebel_fog_desc){0}, fog.volumes, fog.count);
}

typedef struct tally {
    size_t listed, met;
} tally;

static void try_view(const nebel_snapshot *snapshot, const nebel_view *view, uint64_t *state, tally *sum)
{
    static const uint32_t sizes[] = {4, 16, 64, 256};
    const uint32_t size = sizes[dice_below(state, 4)];
    const uint32_t columns = (view->width + size - 1) / size, rows = (view->height + size - 1) / size;
    nebel_rays rays;
    size_t count;
    assert_int_equal(nebel_compute_view_rays(view, NULL, &rays), NEBEL_OK);
    uint32_t *entries = tile(snapshot, view, size, &count);
    const size_t volumes = nebel_get_volume_count(snapshot);
    assert_well_formed(entries, (size_t)columns * rows, count, volumes);
    for (int i = 0; i < RAYS; i++) {
        const double pixel[2] = {dice(state, 0, view->width), dice(state, 0, view->height)};
        const nebel_ray ray = ray_of_pixel(&rays, pixel);
        const size_t k = (size_t)(pixel[1] / size) * columns + (size_t)(pixel[0] / size);
        sum->listed += entries[2 * k + 1];
        for (size_t v = 0; v < fog.count; v++) {
            nebel_transfer transfer;
            const nebel_trace_desc desc = {.transmittance_only = 1};
            assert_int_equal(nebel_trace(alone[v], &desc, 1, &ray, sizeof ray, &transfer, sizeof transfer), NEBEL_OK);
            if (!(transfer.transmittance[0] < 1)) continue;
            sum->met++;
            if (!is_listed(entries, k, (uint32_t)v))
                fail_msg("tile %zu of %u pixels misses volume %zu (%g %g)", k, size, v, pixel[0], pixel[1]);
        }
    }
    free(entries);
}

static void test_never_misses(void **state)
{
    (void)state;
    uint64_t dices = 7;
    for (int p = 0; p < PROJECTIONS; p++) {
        tally sum = {0, 0};
        for (uint64_t seed = 0; seed < 12; seed++) {
            const random_fog_kind kinds[] = {RANDOM_FOG_EXCLUDE, RANDOM_FOG_PARTS, RANDOM_FOG_FAR, RANDOM_FOG_MANY};
            nebel_snapshot *snapshot = make_fog(kinds[seed % 4], seed);
            /* a body without a point would shift the order */
            for (int i = 0; i < 2 && nebel_get_volume_count(snapshot) == fog.count; i++) {
                nebel_view view = {.width = WIDTH, .height = HEIGHT};
                double eye[3], target[3];
                for (int k = 0; k < 3; k++) {
                    eye[k] = fog.shift[k] + dice(&dices, -20, 20);
                    target[k] = fog.shift[k] + dice(&dices, -9, 9);
                }
                look(eye, target, &dices, view.eye_from_world);
                projections[p].make(view.clip_from_eye);
                try_view(snapshot, &view, &dices, &sum);
            }
            nebel_release_snapshot(snapshot);
            for (size_t v = 0; v < fog.count; v++) nebel_release_snapshot(alone[v]);
        }
        print_message("%s: %.2f volumes listed where %.2f are met\n", projections[p].name,
                      (double)sum.listed / (12 * 2 * RAYS), (double)sum.met / (12 * 2 * RAYS));
        assert_true(sum.met > 1000);
    }
}

/* ---- how tight ------------------------------------------------------------------------------- */

static nebel_volume_desc box_of(double x, double y, double z, double half)
{
    return (nebel_volume_desc){.shape = {.type = NEBEL_SHAPE_BOX,
                                         .min = {x - half, y - half, z - half},
                                         .max = {x + half, y + half, z + half}},
                               .extinction = {.1, .1, .1}};
}

static nebel_view straight_view(uint32_t width, uint32_t height)
{
    nebel_view view = {.width = width, .height = height};
    for (int i = 0; i < 4; i++) view.eye_from_world[5 * i] = 1;
    perspective(view.clip_from_eye);
    return view;
}

/* How many entries the 80 x 45 tiles of 1280 x 720 pixels have for volumes. */
static size_t count_listed(const nebel_snapshot *snapshot, const nebel_view *view, const char *what)
{
    size_t count;
    uint32_t *entries = tile(snapshot, view, 16, &count);
    const size_t listed = count - 2 * 80 * 45;
    free(entries);
    print_message("%s: %zu of 3600 tiles\n", what, listed);
    return listed;
}

static void test_tight(void **state)
{
    (void)state;
    /* 1280 x 720 pixels see 38 x 20 m at 10 m: a box of 2 m is about 71 pixels wide there, on 6 by 6 tiles at most */
    const nebel_volume_desc volumes[] = {box_of(0, 0, -11, 1), box_of(0, 0, 30, 5), box_of(500, 0, -11, 1)};
    nebel_snapshot *snapshot = fog_commit(&(nebel_fog_desc){0}, volumes, 3);
    const nebel_view view = straight_view(1280, 720);
    assert_in_range(count_listed(snapshot, &view, "one box of 71 pixels"), 25, 36);
    nebel_release_snapshot(snapshot);
}

/* A long box across the picture: a rectangle around it would list it in most tiles. */
static void test_tight_rows(void **state)
{
    (void)state;
    const nebel_volume_desc ground = {
        .shape = {.type = NEBEL_SHAPE_BOX, .min = {-1000, -3, -1000}, .max = {-2, -2.9, 1000}},
        .extinction = {.1, .1, .1}};
    nebel_snapshot *snapshot = fog_commit(&(nebel_fog_desc){0}, &ground, 1);
    const nebel_view view = straight_view(1280, 720);
    assert_in_range(count_listed(snapshot, &view, "the ground left of the camera"), 100, 1000);
    nebel_release_snapshot(snapshot);
}

/* A bar from corner to corner, rising and falling: each row of tiles lists it where it passes, not from one of its ends. */
static void test_tight_diagonals(void **state)
{
    (void)state;
    const nebel_volume_desc bar = {
        .shape = {.type = NEBEL_SHAPE_BOX, .min = {-100, -.05, -11}, .max = {100, .05, -10.9}},
        .extinction = {.1, .1, .1}};
    nebel_snapshot *snapshot = fog_commit(&(nebel_fog_desc){0}, &bar, 1);
    for (int side = -1; side <= 1; side += 2) {
        nebel_view view = straight_view(1280, 720);
        view.eye_from_world[0] = view.eye_from_world[5] = .8;
        view.eye_from_world[1] = .6 * side;
        view.eye_from_world[4] = -.6 * side;
        assert_in_range(count_listed(snapshot, &view, "a bar from corner to corner"), 60, 240);
    }
    nebel_release_snapshot(snapshot);
}

static void test_endless_everywhere_behind_nowhere(void **state)
{
    (void)state;
    const nebel_volume_desc volumes[] = {{.shape = {.type = NEBEL_SHAPE_WORLD}, .extinction = {.1, .1, .1}},
                                         box_of(0, 0, 20, 3)};
    nebel_snapshot *snapshot = fog_commit(&(nebel_fog_desc){0}, volumes, 2);
    const nebel_view view = straight_view(100, 60);
    size_t count;
    uint32_t *entries = tile(snapshot, &view, 16, &count);
    assert_int_equal(count, 3 * 7 * 4);
    free(entries);
    nebel_release_snapshot(snapshot);
}

static void test_ten_thousand(void **state)
{
    (void)state;
    enum { MANY = 10000 };
    nebel_volume_desc *volumes = calloc(MANY, sizeof *volumes);
    assert_non_null(volumes);
    uint64_t dices = 3;
    for (int i = 0; i < MANY; i++)
        volumes[i] =
            box_of(dice(&dices, -300, 300), dice(&dices, -60, 60), dice(&dices, -600, 20), dice(&dices, .3, 3));
    nebel_snapshot *snapshot = fog_commit(&(nebel_fog_desc){0}, volumes, MANY);
    free(volumes);
    const nebel_view view = straight_view(1280, 720);
    size_t count;
    uint32_t *entries = tile(snapshot, &view, 16, &count);
    double best = HUGE_VAL;
    for (int i = 0; i < 5; i++) {
        const clock_t start = clock();
        assert_int_equal(nebel_bin_volumes(snapshot, &view, 16, entries, count, &count), NEBEL_OK);
        best = fmin(best, (double)(clock() - start) / CLOCKS_PER_SEC);
    }
    print_message("10,000 volumes, 1280x720, tiles of 16 pixels: %.2f ms, %zu entries\n", best * 1e3, count);
    free(entries);
    nebel_release_snapshot(snapshot);
}

/* ---- bad input ------------------------------------------------------------------------------- */

static void test_bad_input(void **state)
{
    (void)state;
    fog_memory memory = {0};
    fog_messages messages = {0};
    const nebel_fog_desc desc = {
        .host = {.allocator = fog_memory_allocator(&memory), .log = fog_messages_log(&messages)}};
    const nebel_volume_desc box = box_of(0, 0, -5, 1);
    nebel_snapshot *snapshot = fog_commit(&desc, &box, 1);
    nebel_view view = straight_view(100, 60);
    uint32_t entries[200];
    size_t count = 0;
    assert_int_equal(nebel_bin_volumes(NULL, &view, 16, NULL, 0, &count), NEBEL_ERROR_ARGUMENT);
    assert_int_equal(nebel_bin_volumes(snapshot, NULL, 16, NULL, 0, &count), NEBEL_ERROR_ARGUMENT);
    assert_int_equal(nebel_bin_volumes(snapshot, &view, 16, NULL, 0, NULL), NEBEL_ERROR_ARGUMENT);
    assert_int_equal(nebel_bin_volumes(snapshot, &view, 16, NULL, 5, &count), NEBEL_ERROR_ARGUMENT);
    assert_int_equal(nebel_bin_volumes(snapshot, &view, 2, NULL, 0, &count), NEBEL_ERROR_ARGUMENT);
    assert_int_equal(nebel_bin_volumes(snapshot, &view, 24, NULL, 0, &count), NEBEL_ERROR_ARGUMENT);
    assert_int_equal(nebel_bin_volumes(snapshot, &view, 512, NULL, 0, &count), NEBEL_ERROR_ARGUMENT);
    memset(&messages, 0, sizeof messages);
    assert_int_equal(nebel_bin_volumes(snapshot, &view, 16, entries, 1, &count), NEBEL_ERROR_LIMIT);
    assert_string_equal(messages.text, ""); /* those who ask again with more room have made no mistake */
    const size_t live = memory.live;
    for (size_t fail = 1; fail <= 3; fail++) {
        memory.fail_first = fail;
        memory.fail_count = 1;
        assert_int_equal(nebel_bin_volumes(snapshot, &view, 16, entries, 200, &count), NEBEL_ERROR_MEMORY);
        assert_int_equal(memory.live, live);
    }
    view.clip_from_eye[0] = (double)NAN;
    assert_int_equal(nebel_bin_volumes(snapshot, &view, 16, NULL, 0, &count), NEBEL_ERROR_ARGUMENT);
    memset(view.clip_from_eye, 0, sizeof view.clip_from_eye);
    assert_int_equal(nebel_bin_volumes(snapshot, &view, 16, NULL, 0, &count), NEBEL_ERROR_ARGUMENT);
    view = straight_view(0, 60);
    assert_int_equal(nebel_bin_volumes(snapshot, &view, 16, NULL, 0, &count), NEBEL_ERROR_ARGUMENT);
    nebel_release_snapshot(snapshot);
    assert_int_equal(memory.live, 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_never_misses),
        cmocka_unit_test(test_tight),
        cmocka_unit_test(test_tight_rows),
        cmocka_unit_test(test_tight_diagonals),
        cmocka_unit_test(test_endless_everywhere_behind_nowhere),
        cmocka_unit_test(test_ten_thousand),
        cmocka_unit_test(test_bad_input),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
