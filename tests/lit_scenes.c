#include "lit_scenes.h"

#include "dice.h"

#include <math.h>
#include <string.h>

const char *const lit_kind_names[LIT_KIND_COUNT] = {"box",         "sphere", "ellipsoid",  "cylinder", "capsule",
                                                    "cone",        "convex", "half space", "world",    "soft edges",
                                                    "altitude",    "parts",  "several",    "excluded", "closed form",
                                                    "small crowd", "crowd",  "voxels"};

static const nebel_shape_type shapes[] = {NEBEL_SHAPE_BOX,      NEBEL_SHAPE_SPHERE,     NEBEL_SHAPE_ELLIPSOID,
                                          NEBEL_SHAPE_CYLINDER, NEBEL_SHAPE_CAPSULE,    NEBEL_SHAPE_CONE,
                                          NEBEL_SHAPE_CONVEX,   NEBEL_SHAPE_HALF_SPACE, NEBEL_SHAPE_WORLD};

static double power_of_ten(uint64_t *dices, double from, double to)
{
    return pow(10, dice(dices, from, to));
}

static int one_of(uint64_t *dices, int n)
{
    return dice_below(dices, n) == 0;
}

/* ---- light ----------------------------------------------------------------------------------- */

static nebel_phase draw_phase(uint64_t *dices)
{
    nebel_phase phase = {.type = (nebel_phase_type)dice_below(dices, NEBEL_PHASE_COUNT)};
    phase.g = dice(dices, -0.9, 0.9);
    phase.alpha = dice(dices, 0, 2);
    phase.diameter = power_of_ten(dices, -1, log10(NEBEL_MAX_DROPLET_DIAMETER));
    return phase;
}

/* Extinction of an optical depth over ten metres, from nearly nothing to a wall. Among mixed lights some volumes emit, too,
 * and some have a source instead of an albedo. */
static void light_volume(uint64_t *dices, nebel_volume_desc *v, double depth, const nebel_phase *phase, int is_mixed)
{
    v->start = v->cutoff = 0;
    if (v->operation == NEBEL_OPERATION_EXCLUDE) return;
    const int is_colored = one_of(dices, 3), shines = is_mixed && one_of(dices, 2);
    const int has_source = is_mixed && one_of(dices, 3);
    for (int c = 0; c < 3; c++) {
        v->extinction[c] = 0.1 * depth * (is_colored ? dice(dices, 0.2, 1) : 1);
        v->emission[c] = shines ? v->extinction[c] * dice(dices, 0, 0.5) : 0;
        v->source[c] = has_source ? dice(dices, 0, 1) : 0;
        v->albedo[c] = has_source ? 0 : is_colored ? dice(dices, 0.3, 1) : 0.9;
    }
    v->phase = *phase;
}

static void draw_sun(uint64_t *dices, nebel_sun *sun)
{
    for (int k = 0; k < 3; k++) sun->direction[k] = dice(dices, -1, 1);
    if (one_of(dices, 5)) sun->direction[dice_below(dices, 3)] = 0;
    if (one_of(dices, 6))
        for (int k = 0; k < 3; k++) sun->direction[k] = k == 1;
    for (int c = 0; c < 3; c++) sun->irradiance[c] = 3 - c;
}

static void draw_point_light(uint64_t *dices, nebel_light *point_light)
{
    *point_light = (nebel_light){.type = one_of(dices, 3) ? NEBEL_LIGHT_SPOT : NEBEL_LIGHT_POINT,
                                 .radius = one_of(dices, 2) ? 0 : dice(dices, 0.01, 1)};
    point_light->outer_angle = dice(dices, 5, one_of(dices, 4) ? 180 : 80);
    point_light->inner_angle = point_light->outer_angle * (one_of(dices, 4) ? 1 : dice(dices, 0, 1));
    for (int k = 0; k < 3; k++) {
        point_light->position[k] = dice(dices, -20, 20);
        point_light->direction[k] = dice(dices, -1, 1) - point_light->position[k] * 0.05;
        point_light->intensity[k] = 300 - 50 * k;
    }
}

/* ---- fog ------------------------------------------------------------------------------------- */

static void draw_crowd(uint64_t *dices, size_t count, lit_draw *draw)
{
    draw->count = count;
    for (size_t i = 0; i < count; i++) {
        nebel_volume_desc *v = &draw->volumes[i];
        *v = (nebel_volume_desc){.shape = {.type = NEBEL_SHAPE_SPHERE, .radius = power_of_ten(dices, -0.3, 0.7)}};
        if (one_of(dices, 4)) v->shape.type = NEBEL_SHAPE_BOX;
        for (int k = 0; k < 3; k++) {
            v->shape.center[k] = dice(dices, -10, 10);
            v->shape.min[k] = v->shape.center[k] - v->shape.radius;
            v->shape.max[k] = v->shape.center[k] + v->shape.radius * dice(dices, 0.2, 1);
        }
        if (v->shape.type == NEBEL_SHAPE_SPHERE && one_of(dices, 3))
            v->density = (nebel_density){.type = NEBEL_DENSITY_RADIAL, .power = 1 + dice_below(dices, 3)};
    }
}

static void draw_voxels(uint64_t *dices, lit_draw *draw)
{
    nebel_volume_desc *v = &draw->volumes[0];
    const int is_sparse = one_of(dices, 2);
    for (int i = 0; i < LIT_SIDE * LIT_SIDE * LIT_SIDE; i++)
        draw->voxels[i] = is_sparse && one_of(dices, 2) ? 0 : (float)dice(dices, 0, 1);
    draw->scene.is_nearest = one_of(dices, 3);
    const nebel_grid_desc desc = {.size = {LIT_SIDE, LIT_SIDE, LIT_SIDE},
                                  .voxels = draw->voxels,
                                  .filter =
                                      draw->scene.is_nearest ? NEBEL_GRID_FILTER_NEAREST : NEBEL_GRID_FILTER_LINEAR};
    nebel_create_grid(&desc, &draw->grid);
    *v = (nebel_volume_desc){.shape = {.type = NEBEL_SHAPE_BOX},
                             .density = {.type = NEBEL_DENSITY_GRID, .grid = draw->grid}};
    for (int k = 0; k < 3; k++) {
        v->shape.min[k] = -dice(dices, 1, 9);
        v->shape.max[k] = dice(dices, 1, 9);
    }
    draw->count = 1;
}

/* A volume of a shape from random fog. Its planes are those of the last such fog alone. */
static void draw_shape(uint64_t *dices, nebel_shape_type type, lit_draw *draw, nebel_volume_desc *v)
{
    for (;;) {
        const random_fog_kind kind = one_of(dices, 3) ? RANDOM_FOG_SINGLE : RANDOM_FOG_PROFILES;
        random_fog_make(&draw->random, kind, dice_next(dices));
        for (size_t i = 0; i < draw->random.count; i++) {
            if (draw->random.volumes[i].shape.type != type) continue;
            *v = draw->random.volumes[i];
            return;
        }
    }
}

static void draw_soft_edges(uint64_t *dices, lit_draw *draw)
{
    nebel_volume_desc *v = &draw->volumes[0];
    draw_shape(dices, shapes[dice_below(dices, LIT_KIND_WORLD)], draw, v);
    v->density = (nebel_density){.type = NEBEL_DENSITY_SOFT_EDGE, .edge_width = power_of_ten(dices, -1.5, 0.8)};
    draw->count = 1;
}

/* The surface of a planet near the origin, with fog everywhere or in some body. */
static void draw_altitude(uint64_t *dices, lit_draw *draw)
{
    nebel_volume_desc *v = &draw->volumes[0];
    const double scale_height = power_of_ten(dices, -0.5, 1);
    const double radius = fmax(power_of_ten(dices, 1.5, 6.8), 1.5 * NEBEL_MIN_ALTITUDE_RATIO * scale_height);
    draw_shape(dices, one_of(dices, 2) ? NEBEL_SHAPE_WORLD : shapes[dice_below(dices, LIT_KIND_WORLD)], draw, v);
    v->density = (nebel_density){.type = NEBEL_DENSITY_ALTITUDE,
                                 .below = one_of(dices, 2) ? NEBEL_BELOW_GROW : NEBEL_BELOW_CONSTANT,
                                 .base = dice(dices, -5, 5),
                                 .scale_height = scale_height,
                                 .radius = radius};
    double way[3], length;
    do {
        for (int k = 0; k < 3; k++) way[k] = dice(dices, -1, 1);
        length = sqrt(lit_dot(way, way));
    } while (length > 1 || length < 0.1);
    for (int k = 0; k < 3; k++) v->density.center[k] = way[k] * (radius / length) + dice(dices, -5, 5);
    draw->count = 1;
}

static void draw_closed_form(uint64_t *dices, lit_draw *draw)
{
    static const nebel_shape_type flat[] = {NEBEL_SHAPE_BOX, NEBEL_SHAPE_HALF_SPACE};
    draw->count = (size_t)(1 + dice_below(dices, 4));
    if (one_of(dices, 3)) {
        draw->count = 1;
        draw->volumes[0] = (nebel_volume_desc){
            .shape = {.type = NEBEL_SHAPE_WORLD},
            .density = {.type = NEBEL_DENSITY_HEIGHT, .scale_height = power_of_ten(dices, -0.5, 1)}};
        return;
    }
    for (size_t i = 0; i < draw->count; i++) {
        const nebel_shape_type last = one_of(dices, 2) ? NEBEL_SHAPE_CONVEX : flat[dice_below(dices, 2)];
        do draw_shape(dices, i + 1 < draw->count ? flat[dice_below(dices, 2)] : last, draw, &draw->volumes[i]);
        while (draw->volumes[i].operation != NEBEL_OPERATION_ADD);
        draw->volumes[i].density = (nebel_density){.type = NEBEL_DENSITY_CONSTANT};
    }
}

static void draw_random(uint64_t *dices, random_fog_kind kind, lit_draw *draw)
{
    random_fog_make(&draw->random, kind, dice_next(dices));
    draw->count = kind == RANDOM_FOG_PARTS ? 1 : draw->random.count;
    memcpy(draw->volumes, draw->random.volumes, draw->count * sizeof draw->volumes[0]);
}

static void draw_bodies(uint64_t *dices, lit_kind kind, lit_draw *draw)
{
    draw->count = 1;
    switch (kind) {
    case LIT_KIND_SOFT_EDGES:
        draw_soft_edges(dices, draw);
        return;
    case LIT_KIND_ALTITUDE:
        draw_altitude(dices, draw);
        return;
    case LIT_KIND_PARTS:
        draw_random(dices, RANDOM_FOG_PARTS, draw);
        return;
    case LIT_KIND_SEVERAL:
        draw_random(dices, RANDOM_FOG_PROFILES, draw);
        return;
    case LIT_KIND_EXCLUDED:
        draw_random(dices, RANDOM_FOG_EXCLUDE, draw);
        return;
    case LIT_KIND_CLOSED_FORM:
        draw_closed_form(dices, draw);
        return;
    case LIT_KIND_SMALL_CROWD:
    case LIT_KIND_CROWD:
        draw_crowd(dices, kind == LIT_KIND_CROWD ? LIT_CROWD : 12, draw);
        return;
    case LIT_KIND_VOXELS:
        draw_voxels(dices, draw);
        if (one_of(dices, 2))
            draw_shape(dices, shapes[dice_below(dices, LIT_KIND_WORLD)], draw, &draw->volumes[draw->count++]);
        return;
    default:
        draw_shape(dices, shapes[kind], draw, &draw->volumes[0]);
    }
}

static void draw_light(uint64_t *dices, lit_kind kind, lit_draw *draw)
{
    const double depth = power_of_ten(dices, -3, 6);
    const int is_crowd = kind == LIT_KIND_SMALL_CROWD || kind == LIT_KIND_CROWD;
    const int is_mixed = one_of(dices, 4), is_alike = is_crowd || one_of(dices, 2);
    nebel_phase phase = draw_phase(dices);
    for (size_t i = 0; i < draw->count; i++) {
        if (!is_alike) phase = draw_phase(dices);
        const double share = i > 0 && !is_crowd ? power_of_ten(dices, -2, 1) : 1;
        light_volume(dices, &draw->volumes[i], depth * share, &phase, is_mixed);
    }
    for (int c = 0; c < 3 && is_mixed; c++) draw->scene.ambient[c] = dice(dices, 0, 0.5);
}

void lit_draw_fog(lit_draw *draw, lit_kind kind, lit_source source, uint64_t seed)
{
    uint64_t dices = seed * 7919 + (uint64_t)kind * 104729 + (uint64_t)source;
    draw->grid = NULL;
    draw->scene = (lit_scene){.volumes = draw->volumes,
                              .lights = draw->lights,
                              .voxels = draw->voxels,
                              .size = {LIT_SIDE, LIT_SIDE, LIT_SIDE},
                              .sun = {.direction = {0, 1, 0}}};
    draw_bodies(&dices, kind, draw);
    draw_light(&dices, kind, draw);
    draw->scene.volume_count = draw->count;
    if (source == LIT_BY_SUN) {
        draw_sun(&dices, &draw->scene.sun);
        return;
    }
    draw->scene.light_count = one_of(&dices, 4) ? 2 : 1;
    for (size_t i = 0; i < draw->scene.light_count; i++) draw_point_light(&dices, &draw->lights[i]);
}

/* ---- rays and snapshots ---------------------------------------------------------------------- */

static nebel_ray draw_ray(uint64_t *dices)
{
    nebel_ray ray;
    const double far_off = one_of(dices, 4) ? 6 : 25;
    for (int k = 0; k < 3; k++) {
        ray.origin[k] = dice(dices, -far_off, far_off);
        ray.direction[k] = dice(dices, -9, 9) - ray.origin[k];
    }
    if (one_of(dices, 8)) ray.direction[dice_below(dices, 3)] = 0;
    const double length = sqrt(lit_dot(ray.direction, ray.direction));
    for (int k = 0; k < 3; k++) ray.direction[k] /= length;
    ray.t_max = one_of(dices, 4) ? dice(dices, 1, 40) : 1000;
    return ray;
}

int lit_ray_count(lit_kind kind)
{
    return kind == LIT_KIND_CROWD ? 4 : LIT_RAYS_EACH;
}

void lit_draw_rays(uint64_t seed, nebel_ray rays[LIT_RAYS_EACH])
{
    uint64_t dices = seed * 31 + 5;
    for (int i = 0; i < LIT_RAYS_EACH; i++) rays[i] = draw_ray(&dices);
}

nebel_lighting *lit_draw_commit(const lit_draw *draw)
{
    const lit_scene *s = &draw->scene;
    nebel_lighting_desc lights = {.sun = s->sun, .lights = s->lights, .light_count = s->light_count};
    nebel_fog *fog = NULL;
    nebel_snapshot *snapshot = NULL;
    nebel_lighting *lighting = NULL;
    memcpy(lights.environment.radiance, s->ambient, sizeof s->ambient);
    nebel_result result = nebel_create_fog(&(nebel_fog_desc){0}, &fog);
    for (size_t i = 0; i < s->volume_count && result == NEBEL_OK; i++)
        result = nebel_add_volume(fog, &s->volumes[i], NULL);
    if (result == NEBEL_OK) result = nebel_commit_fog(fog, &snapshot);
    if (result == NEBEL_OK) nebel_create_lighting(snapshot, &lights, &lighting);
    nebel_destroy_fog(fog);
    nebel_release_snapshot(snapshot);
    return lighting;
}

void lit_draw_free(lit_draw *draw)
{
    nebel_release_grid(draw->grid);
    draw->grid = NULL;
}
