/* Sunlit and lamplit fog of all shapes and profiles, from thin to opaque, against brute force: the error that is told is
 * never too small. Prints how many rays were tried of each kind of fog and light.
 *
 *     test_lit_truth [SEED [RAYS]]
 */
#include "unit.h"

#include "dice.h"
#include "fog_help.h"
#include "lit_oracle.h"
#include "random_fog.h"

#include <stdio.h>
#include <stdlib.h>

static uint64_t first_seed = 1;
static size_t ray_count;

enum { FEW_PANELS = 16, MANY_PANELS = 400 };

enum { RAYS_EACH = 10, CROWD = 80, SIDE = 7, MOST_LAMPS = 2 };

typedef enum fog_kind {
    KIND_BOX,
    KIND_SPHERE,
    KIND_ELLIPSOID,
    KIND_CYLINDER,
    KIND_CAPSULE,
    KIND_CONE,
    KIND_CONVEX,
    KIND_HALF_SPACE,
    KIND_WORLD,
    KIND_PARTS,
    KIND_SEVERAL,
    KIND_EXCLUDED,
    KIND_CLOSED, /* flat and even, or height alone: closed forms */
    KIND_CROWD,
    KIND_LARGE_CROWD,
    KIND_VOXELS,
    KIND_COUNT
} fog_kind;

static const char *const kind_names[] = {"box",    "sphere",     "ellipsoid",   "cylinder", "capsule", "cone",
                                         "convex", "half space", "world",       "parts",    "several", "excluded",
                                         "closed", "crowd",      "large crowd", "voxels"};
static const nebel_shape_type kind_shapes[] = {NEBEL_SHAPE_BOX,      NEBEL_SHAPE_SPHERE,     NEBEL_SHAPE_ELLIPSOID,
                                               NEBEL_SHAPE_CYLINDER, NEBEL_SHAPE_CAPSULE,    NEBEL_SHAPE_CONE,
                                               NEBEL_SHAPE_CONVEX,   NEBEL_SHAPE_HALF_SPACE, NEBEL_SHAPE_WORLD};

typedef enum way_to_ask { ASK_DOUBLE, ASK_FINE, ASK_FLOAT, ASK_COUNT } way_to_ask;

typedef struct tally {
    size_t rays, wrong;
    double worst; /* as a multiple of what may be */
} tally;

static tally tallies[KIND_COUNT][2][ASK_COUNT];

/* ---- scenes ---------------------------------------------------------------------------------- */

typedef struct lit_fog {
    random_fog random;
    nebel_volume_desc volumes[CROWD];
    size_t count;
    nebel_sun sun;
    nebel_lamp lamps[MOST_LAMPS];
    size_t lamp_count;
    float voxels[SIDE * SIDE * SIDE];
    nebel_grid *grid;
    int is_nearest;
} lit_fog;

static lit_fog fog;

static double chosen(uint64_t *dices, double from, double to)
{
    return pow(10, dice(dices, from, to));
}

/* Soft edges are the oracle's of boxes and balls alone. */
static void simplify(nebel_volume_desc *v)
{
    const int is_round = v->shape.type == NEBEL_SHAPE_SPHERE, is_box = v->shape.type == NEBEL_SHAPE_BOX;
    if (v->density.type == NEBEL_DENSITY_SOFT_EDGE && !is_round && !is_box)
        v->density = (nebel_density){.type = NEBEL_DENSITY_CONSTANT};
    v->start = v->cutoff = 0;
}

/* Of one optical depth over ten metres, from nearly nothing to a wall. */
static void light_volume(uint64_t *dices, nebel_volume_desc *v, double depth, const nebel_phase *phase)
{
    if (v->operation == NEBEL_OPERATION_EXCLUDE) return;
    const int is_colored = dice_below(dices, 3) == 0;
    for (int c = 0; c < 3; c++) {
        v->source[c] = v->emission[c] = 0;
        v->extinction[c] = 0.1 * depth * (is_colored ? dice(dices, 0.2, 1) : 1);
        v->albedo[c] = is_colored ? dice(dices, 0.3, 1) : 0.9;
    }
    v->phase = *phase;
}

static nebel_phase draw_phase(uint64_t *dices)
{
    nebel_phase phase = {.type = (nebel_phase_type)dice_below(dices, NEBEL_PHASE_DROPLETS)};
    phase.g = dice(dices, -0.9, 0.9);
    phase.alpha = dice(dices, 0, 2);
    return phase;
}

static void draw_lights(uint64_t *dices, int by_lamp)
{
    fog.lamp_count = 0;
    fog.sun = (nebel_sun){{0, 1, 0}, {0, 0, 0}};
    if (!by_lamp) {
        for (int k = 0; k < 3; k++) fog.sun.direction[k] = dice(dices, -1, 1);
        if (dice_below(dices, 5) == 0) fog.sun.direction[dice_below(dices, 3)] = 0;
        if (dice_below(dices, 6) == 0)
            for (int k = 0; k < 3; k++) fog.sun.direction[k] = k == 1;
        for (int c = 0; c < 3; c++) fog.sun.irradiance[c] = 3 - c;
        return;
    }
    fog.lamp_count = dice_below(dices, 4) == 0 ? 2 : 1;
    for (size_t i = 0; i < fog.lamp_count; i++) {
        nebel_lamp *lamp = &fog.lamps[i];
        *lamp = (nebel_lamp){.type = dice_below(dices, 4) == 0 ? NEBEL_LAMP_SPOT : NEBEL_LAMP_POINT,
                             .radius = dice_below(dices, 2) ? 0 : dice(dices, 0.01, 1),
                             .inner_angle = 20,
                             .outer_angle = 50};
        for (int k = 0; k < 3; k++) {
            lamp->position[k] = dice(dices, -20, 20);
            lamp->direction[k] = dice(dices, -1, 1) - lamp->position[k] * 0.05;
            lamp->intensity[k] = 300 - 50 * k;
        }
    }
}

static void draw_crowd(uint64_t *dices, size_t count, double depth, const nebel_phase *phase)
{
    fog.count = count;
    for (size_t i = 0; i < count; i++) {
        nebel_volume_desc *v = &fog.volumes[i];
        *v = (nebel_volume_desc){.shape = {.type = NEBEL_SHAPE_SPHERE, .radius = chosen(dices, -0.3, 0.7)}};
        if (dice_below(dices, 4) == 0) v->shape.type = NEBEL_SHAPE_BOX;
        for (int k = 0; k < 3; k++) {
            v->shape.center[k] = dice(dices, -10, 10);
            v->shape.min[k] = v->shape.center[k] - v->shape.radius;
            v->shape.max[k] = v->shape.center[k] + v->shape.radius * dice(dices, 0.2, 1);
        }
        if (v->shape.type == NEBEL_SHAPE_SPHERE && dice_below(dices, 3) == 0)
            v->density = (nebel_density){.type = NEBEL_DENSITY_RADIAL, .power = 1 + dice_below(dices, 3)};
        light_volume(dices, v, depth, phase);
    }
}

static void draw_voxels(uint64_t *dices)
{
    nebel_volume_desc *v = &fog.volumes[0];
    const int is_sparse = dice_below(dices, 2);
    for (int i = 0; i < SIDE * SIDE * SIDE; i++)
        fog.voxels[i] = is_sparse && dice_below(dices, 2) ? 0 : (float)dice(dices, 0, 1);
    fog.is_nearest = dice_below(dices, 3) == 0;
    const nebel_grid_desc desc = {.size = {SIDE, SIDE, SIDE},
                                  .voxels = fog.voxels,
                                  .filter = fog.is_nearest ? NEBEL_FILTER_NEAREST : NEBEL_FILTER_LINEAR};
    assert_int_equal(nebel_create_grid(&desc, &fog.grid), NEBEL_OK);
    *v = (nebel_volume_desc){.shape = {.type = NEBEL_SHAPE_BOX},
                             .density = {.type = NEBEL_DENSITY_GRID, .grid = fog.grid}};
    for (int k = 0; k < 3; k++) {
        v->shape.min[k] = -dice(dices, 1, 9);
        v->shape.max[k] = dice(dices, 1, 9);
    }
    fog.count = 1;
}

/* One volume of a shape from random fog. */
static void draw_shape(uint64_t *dices, nebel_shape_type type)
{
    for (;;) {
        random_fog_make(&fog.random, dice_below(dices, 3) ? RANDOM_FOG_PROFILES : RANDOM_FOG_SINGLE, dice_next(dices));
        for (size_t i = 0; i < fog.random.count; i++) {
            if (fog.random.volumes[i].shape.type != type) continue;
            fog.volumes[0] = fog.random.volumes[i];
            fog.count = 1;
            return;
        }
    }
}

static void draw_closed(uint64_t *dices)
{
    const int is_height = dice_below(dices, 3) == 0;
    fog.count = is_height ? 1 : (size_t)(1 + dice_below(dices, 4));
    for (size_t i = 0; i < fog.count; i++) {
        const nebel_shape_type types[] = {NEBEL_SHAPE_BOX, NEBEL_SHAPE_CONVEX, NEBEL_SHAPE_HALF_SPACE};
        if (is_height) {
            fog.volumes[i] =
                (nebel_volume_desc){.shape = {.type = NEBEL_SHAPE_WORLD},
                                    .density = {.type = NEBEL_DENSITY_HEIGHT, .scale_height = chosen(dices, -0.5, 1)}};
            continue;
        }
        random_fog_make(&fog.random, RANDOM_FOG_SINGLE, 0);
        do {
            const nebel_volume_desc before = fog.volumes[0];
            draw_shape(dices, types[dice_below(dices, i == 0 ? 3 : 1)]);
            const nebel_volume_desc drawn = fog.volumes[0];
            if (i > 0) fog.volumes[0] = before;
            fog.volumes[i] = drawn;
        } while (fog.volumes[i].operation != NEBEL_OPERATION_ADD);
        fog.volumes[i].density = (nebel_density){.type = NEBEL_DENSITY_CONSTANT};
        fog.count = i + 1;
    }
}

static void draw_fog(fog_kind kind, int by_lamp, uint64_t seed)
{
    uint64_t dices = seed * 7919 + (uint64_t)kind * 104729 + (uint64_t)by_lamp;
    const double depth = chosen(&dices, -3, 6);
    const nebel_phase phase = draw_phase(&dices);
    fog.grid = NULL;
    if (kind <= KIND_WORLD)
        draw_shape(&dices, kind_shapes[kind]);
    else if (kind == KIND_CLOSED)
        draw_closed(&dices);
    else if (kind == KIND_CROWD || kind == KIND_LARGE_CROWD)
        draw_crowd(&dices, kind == KIND_CROWD ? 12 : CROWD, depth, &phase);
    else if (kind == KIND_VOXELS)
        draw_voxels(&dices);
    else {
        random_fog_make(&fog.random,
                        kind == KIND_PARTS     ? RANDOM_FOG_PARTS
                        : kind == KIND_SEVERAL ? RANDOM_FOG_PROFILES
                                               : RANDOM_FOG_EXCLUDE,
                        dice_next(&dices));
        fog.count = kind == KIND_PARTS ? 1 : fog.random.count;
        memcpy(fog.volumes, fog.random.volumes, fog.count * sizeof fog.volumes[0]);
    }
    for (size_t i = 0; i < fog.count; i++) {
        simplify(&fog.volumes[i]);
        if (kind != KIND_CROWD && kind != KIND_LARGE_CROWD)
            light_volume(&dices, &fog.volumes[i], depth * (i > 0 ? chosen(&dices, -2, 1) : 1), &phase);
    }
    draw_lights(&dices, by_lamp);
}

static nebel_snapshot *commit_fog(void)
{
    nebel_fog *made = NULL;
    nebel_snapshot *snapshot = NULL;
    assert_int_equal(nebel_create_fog(&(nebel_fog_desc){.sun = fog.sun}, &made), NEBEL_OK);
    for (size_t i = 0; i < fog.count; i++) assert_int_equal(nebel_add_volume(made, &fog.volumes[i], NULL), NEBEL_OK);
    assert_int_equal(nebel_set_lamps(made, fog.lamp_count, fog.lamps), NEBEL_OK);
    assert_int_equal(nebel_commit_fog(made, &snapshot), NEBEL_OK);
    nebel_destroy_fog(made);
    return snapshot;
}

static nebel_ray draw_ray(uint64_t *dices)
{
    nebel_ray ray;
    double length = 0;
    const double far_off = dice_below(dices, 4) == 0 ? 6 : 25;
    for (int k = 0; k < 3; k++) {
        ray.origin[k] = dice(dices, -far_off, far_off);
        ray.direction[k] = dice(dices, -9, 9) - ray.origin[k];
    }
    if (dice_below(dices, 8) == 0) ray.direction[dice_below(dices, 3)] = 0;
    for (int k = 0; k < 3; k++) length += ray.direction[k] * ray.direction[k];
    for (int k = 0; k < 3; k++) ray.direction[k] /= sqrt(length);
    ray.t_max = dice_below(dices, 4) == 0 ? dice(dices, 1, 40) : 1000;
    return ray;
}

/* ---- comparisons ----------------------------------------------------------------------------- */

static void ask(const nebel_snapshot *snapshot, way_to_ask way, const nebel_ray *rays, nebel_light *lights)
{
    const nebel_trace_desc desc = {.precision = way == ASK_FLOAT ? NEBEL_PRECISION_FLOAT : NEBEL_PRECISION_DOUBLE,
                                   .tolerance = way == ASK_FINE ? 1e-5 : 0};
    assert_int_equal(nebel_trace(snapshot, &desc, RAYS_EACH, rays, sizeof *rays, lights, sizeof *lights), NEBEL_OK);
}

static void print_case(fog_kind kind, int by_lamp, uint64_t seed, int i, way_to_ask way, const nebel_light *light,
                       const double S[3], double uncertainty)
{
    static const char *const ways[] = {"double", "double, 1e-5", "float"};
    print_message("%s, %s, seed %llu, ray %d, %s: %.9g %.9g %.9g, not %.9g %.9g %.9g (+- %.1e), error %.3g\n",
                  kind_names[kind], by_lamp ? "lamp" : "sun", (unsigned long long)seed, i, ways[way],
                  light->in_scattering[0], light->in_scattering[1], light->in_scattering[2], S[0], S[1], S[2],
                  uncertainty, light->error);
}

/* What the oracle's own arithmetic may be off by: its depths are sums and differences of doubles. */
static double slack_of(const double S[3], double uncertainty)
{
    return uncertainty + 2e-7 * fmax(fmax(S[0], S[1]), S[2]) + 1e-12;
}

static double off_by(const nebel_light *light, const double S[3])
{
    double off = 0;
    for (int c = 0; c < 3; c++) off = fmax(off, fabs(light->in_scattering[c] - S[c]));
    return off;
}

static int all_hold(nebel_light lights[ASK_COUNT][RAYS_EACH], int i, const double S[3], double uncertainty)
{
    int hold = 1;
    for (int way = 0; way < ASK_COUNT; way++)
        hold = hold && off_by(&lights[way][i], S) <= lights[way][i].error + slack_of(S, uncertainty);
    return hold;
}

/* Returns whether the error is large enough. */
static int note_ray(tally *t, const nebel_light *light, const double S[3], double uncertainty)
{
    const double off = off_by(light, S), may = light->error + slack_of(S, uncertainty);
    t->rays++;
    t->worst = fmax(t->worst, off / may);
    t->wrong += !(off <= may);
    return off <= may;
}

static void try_fog(fog_kind kind, int by_lamp, uint64_t seed)
{
    nebel_ray rays[RAYS_EACH];
    nebel_light lights[ASK_COUNT][RAYS_EACH];
    draw_fog(kind, by_lamp, seed);
    nebel_snapshot *snapshot = commit_fog();
    uint64_t dices = seed * 31 + 5;
    for (int i = 0; i < RAYS_EACH; i++) rays[i] = draw_ray(&dices);
    for (int way = 0; way < ASK_COUNT; way++) ask(snapshot, (way_to_ask)way, rays, lights[way]);
    const lit_scene scene = {.volumes = fog.volumes,
                             .volume_count = fog.count,
                             .sun = fog.sun,
                             .lamps = fog.lamps,
                             .lamp_count = fog.lamp_count,
                             .voxels = fog.voxels,
                             .size = {SIDE, SIDE, SIDE},
                             .is_nearest = fog.is_nearest};
    for (int i = 0; i < RAYS_EACH; i++) {
        double S[3], uncertainty;
        if (!lit_oracle_trace(&scene, &rays[i], FEW_PANELS, S, &uncertainty)) continue;
        /* where it seems wrong the oracle looks again, more closely */
        if (!all_hold(lights, i, S, uncertainty) && !lit_oracle_trace(&scene, &rays[i], MANY_PANELS, S, &uncertainty))
            continue;
        for (int way = 0; way < ASK_COUNT; way++) {
            const nebel_light *light = &lights[way][i];
            if (!note_ray(&tallies[kind][by_lamp][way], light, S, uncertainty))
                print_case(kind, by_lamp, seed, i, (way_to_ask)way, light, S, uncertainty);
        }
    }
    nebel_release_snapshot(snapshot);
    nebel_release_grid(fog.grid);
}

static size_t print_tallies(void)
{
    size_t rays = 0, wrong = 0;
    print_message("%-12s %-5s %21s %21s %21s\n", "fog", "light", "double", "double, 1e-5", "float");
    print_message("%-12s %-5s %21s %21s %21s\n", "", "", "rays wrong  worst", "rays wrong  worst", "rays wrong  worst");
    for (int kind = 0; kind < KIND_COUNT; kind++)
        for (int by_lamp = 0; by_lamp < 2; by_lamp++) {
            const tally *t = tallies[kind][by_lamp];
            print_message("%-12s %-5s", kind_names[kind], by_lamp ? "lamp" : "sun");
            for (int way = 0; way < ASK_COUNT; way++) {
                print_message(" %8zu %5zu %6.3f", t[way].rays, t[way].wrong, t[way].worst);
                rays += t[way].rays;
                wrong += t[way].wrong;
            }
            print_message("\n");
        }
    print_message("%zu rays, %zu errors too small\n", rays, wrong);
    return wrong;
}

static void errors_of_lit_fog_are_never_too_small(void **state)
{
    (void)state;
    const size_t each = KIND_COUNT * 2 * RAYS_EACH;
    for (uint64_t seed = 0; seed < (ray_count + each - 1) / each; seed++)
        for (int kind = 0; kind < KIND_COUNT; kind++)
            for (int by_lamp = 0; by_lamp < 2; by_lamp++) try_fog((fog_kind)kind, by_lamp, first_seed + seed);
    assert_int_equal(print_tallies(), 0);
}

int main(int argc, char **argv)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(errors_of_lit_fog_are_never_too_small)};
    ray_count = nb_test_count(5000);
    if (argc > 1) first_seed = strtoull(argv[1], NULL, 10);
    if (argc > 2) ray_count = strtoull(argv[2], NULL, 10);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
