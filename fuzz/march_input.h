/* Fog and rays from any bytes: all shapes, profiles, operations, sources, phase functions and lights, in steps that meet each other, so that
 * faces touch and rays run along them. */
#ifndef NB_FUZZ_MARCH_INPUT_H
#define NB_FUZZ_MARCH_INPUT_H

#include "witness.h"

#include <nebel/light.h>

#include <math.h>
#include <stdint.h>
#include <string.h>

enum { MOST_WRITTEN = 5, MOST_VOLUMES = 14, MOST_RAYS = 3, MAX_LIGHTS = 2, MOST_PARTS = 3, PLANES = 8, MOST_CELLS = 4 };

typedef struct input {
    const uint8_t *data;
    size_t size;
} input;

/* The volumes point into it. */
typedef struct march_input {
    nebel_lighting_desc lighting; /* its lights are `point_lights` */
    size_t count, light_count, ray_count;
    nebel_volume_desc volumes[MOST_VOLUMES];
    nebel_light lights[MAX_LIGHTS];
    nebel_ray rays[MOST_RAYS];
    nebel_shape parts[MOST_WRITTEN][MOST_PARTS], inner[MOST_WRITTEN][MOST_PARTS];
    nebel_plane planes[MOST_WRITTEN * (1 + 2 * MOST_PARTS)][PLANES];
    size_t bodies;
    nebel_grid *grids[MOST_WRITTEN];
} march_input;

static inline unsigned take(input *in)
{
    if (in->size == 0) return 0;
    in->size--;
    return *in->data++;
}

/* -8 to 8. */
static inline double take_place(input *in)
{
    return ((int)take(in) - 128) / 16.0;
}

static inline double take_size(input *in)
{
    return (1 + take(in)) / 32.0;
}

static inline void take_places(input *in, double place[3])
{
    for (int i = 0; i < 3; i++) place[i] = take_place(in);
}

static inline void take_direction(input *in, double direction[3])
{
    take_places(in, direction);
    if (direction[0] == 0 && direction[1] == 0 && direction[2] == 0) direction[1] = 1;
}

/* ---- shapes ---------------------------------------------------------------------------------- */

static inline void take_transform(input *in, nebel_transform *transform)
{
    if (take(in) % 4 != 0) return;
    take_places(in, transform->position);
    for (int i = 0; i < 4; i++) transform->rotation[i] = take_place(in);
    for (int i = 0; i < 3; i++) transform->scale[i] = take_size(in);
}

/* Around a place, cut by planes of any direction. */
static inline void take_planes(input *in, march_input *fog, nebel_shape *shape)
{
    nebel_plane *planes = fog->planes[fog->bodies++];
    double center[3];
    take_places(in, center);
    for (int i = 0; i < PLANES; i++) {
        double *normal = planes[i].normal;
        if (i < 6)
            normal[i / 2] = i % 2 == 0 ? 1 : -1;
        else
            take_direction(in, normal);
        planes[i].distance = take_size(in);
        for (int k = 0; k < 3; k++) planes[i].distance += normal[k] * center[k];
    }
    shape->planes = planes;
    shape->plane_count = PLANES;
}

static inline void take_leaf(input *in, march_input *fog, nebel_shape *shape)
{
    static const nebel_shape_type types[] = {NEBEL_SHAPE_SPHERE,   NEBEL_SHAPE_BOX,        NEBEL_SHAPE_WORLD,
                                             NEBEL_SHAPE_CYLINDER, NEBEL_SHAPE_CAPSULE,    NEBEL_SHAPE_CONE,
                                             NEBEL_SHAPE_CONVEX,   NEBEL_SHAPE_HALF_SPACE, NEBEL_SHAPE_ELLIPSOID};
    *shape = (nebel_shape){.type = types[take(in) % (sizeof types / sizeof *types)]};
    if (shape->type == NEBEL_SHAPE_CONVEX) take_planes(in, fog, shape);
    take_places(in, shape->min);
    memcpy(shape->center, shape->min, sizeof shape->center);
    memcpy(shape->from, shape->min, sizeof shape->from);
    memcpy(shape->point, shape->min, sizeof shape->point);
    shape->radius = shape->radius_from = take_size(in);
    shape->radius_to = take(in) % 4 == 0 ? 0 : take_size(in);
    for (int i = 0; i < 3; i++) {
        shape->radii[i] = take_size(in);
        shape->max[i] = shape->min[i] + shape->radii[i];
        shape->to[i] = shape->from[i] + (i == 1 || shape->radii[i] > 4 ? shape->radii[i] : 0);
        shape->normal[i] = shape->radii[i] - 2;
    }
    if (shape->type != NEBEL_SHAPE_WORLD) take_transform(in, &shape->transform);
}

static inline void take_group(input *in, march_input *fog, nebel_shape *parts, nebel_shape *shape)
{
    *shape = (nebel_shape){.type = take(in) % 2 == 0 ? NEBEL_SHAPE_UNION : NEBEL_SHAPE_INTERSECTION,
                           .parts = parts,
                           .part_count = 1 + take(in) % MOST_PARTS};
    for (size_t i = 0; i < shape->part_count; i++) take_leaf(in, fog, &parts[i]);
    take_transform(in, &shape->transform);
}

static inline void take_shape(input *in, march_input *fog, size_t which, nebel_shape *shape)
{
    const unsigned kind = take(in) % 8;
    if (kind > 1) {
        take_leaf(in, fog, shape);
        return;
    }
    take_group(in, fog, fog->parts[which], shape);
    if (kind == 1) take_group(in, fog, fog->inner[which], &fog->parts[which][0]);
}

/* ---- profiles -------------------------------------------------------------------------------- */

static inline void take_grid(input *in, march_input *fog, size_t which, nebel_density *density)
{
    uint8_t voxels[MOST_CELLS * MOST_CELLS * MOST_CELLS];
    nebel_grid_desc desc = {.type = NEBEL_VOXEL_UINT8, .voxels = voxels};
    for (int i = 0; i < 3; i++) desc.size[i] = 1 + take(in) % MOST_CELLS;
    desc.filter = take(in) % 2 == 0 ? NEBEL_GRID_FILTER_LINEAR : NEBEL_GRID_FILTER_NEAREST;
    for (size_t i = 0; i < sizeof voxels; i++) voxels[i] = (uint8_t)take(in);
    demand(nebel_create_grid(&desc, &fog->grids[which]) == NEBEL_OK);
    density->type = NEBEL_DENSITY_GRID;
    density->grid = fog->grids[which];
}

static inline int goes_with(nebel_density_type density, nebel_shape_type shape)
{
    const int is_group = shape == NEBEL_SHAPE_UNION || shape == NEBEL_SHAPE_INTERSECTION;
    if (density == NEBEL_DENSITY_RADIAL) return shape == NEBEL_SHAPE_SPHERE || shape == NEBEL_SHAPE_ELLIPSOID;
    if (density == NEBEL_DENSITY_SOFT_EDGE) return shape != NEBEL_SHAPE_WORLD && !is_group;
    return density != NEBEL_DENSITY_GRID;
}

static inline void take_density(input *in, march_input *fog, size_t which, nebel_volume_desc *volume)
{
    nebel_density *density = &volume->density;
    density->type = (nebel_density_type)(take(in) % NEBEL_DENSITY_COUNT);
    if (density->type == NEBEL_DENSITY_GRID && volume->shape.type == NEBEL_SHAPE_BOX)
        take_grid(in, fog, which, density);
    else if (!goes_with(density->type, volume->shape.type))
        density->type = NEBEL_DENSITY_CONSTANT;
    density->below = take(in) % 2 == 0 ? NEBEL_BELOW_CONSTANT : NEBEL_BELOW_GROW;
    density->base = take_place(in);
    density->scale_height = 8 * take_size(in);
    density->power = 1 + (int)(take(in) % 3);
    take_places(in, density->from);
    for (int i = 0; i < 3; i++) density->to[i] = density->from[i] + take_place(in);
    take_places(in, density->center);
    density->sigma = take_size(in);
    density->edge_width = take_size(in);
    density->radius = 64 + 64 * take_size(in);
    if (density->type != NEBEL_DENSITY_ALTITUDE) return;
    density->center[1] -= density->radius;
    density->scale_height /= 64;
}

/* ---- volumes --------------------------------------------------------------------------------- */

static inline void take_amounts(input *in, nebel_volume_desc *volume)
{
    const unsigned kind = take(in) % 4;
    for (int c = 0; c < 3; c++) {
        volume->extinction[c] = ldexp(take(in), (int)(take(in) % 16) - 12);
        if (kind % 2 == 0)
            volume->source[c] = take(in) / 64.0;
        else
            volume->albedo[c] = take(in) / 255.0;
        if (kind == 3) volume->emission[c] = take(in) / 64.0;
    }
    volume->phase.type = (nebel_phase_type)(take(in) % NEBEL_PHASE_COUNT);
    volume->phase.g = ((int)take(in) - 128) / 130.0;
    volume->phase.alpha = take(in) / 64.0;
    volume->phase.diameter = 5 + take(in) / 6.0;
    if (take(in) % 8 != 0) return;
    volume->start = take_size(in);
    volume->cutoff = take(in) % 2 == 0 ? 0 : volume->start + take_size(in);
}

static inline void take_volume(input *in, march_input *fog, size_t which)
{
    nebel_volume_desc *volume = &fog->volumes[which];
    *volume = (nebel_volume_desc){.operation = (nebel_operation)(take(in) % (2 * NEBEL_OPERATION_COUNT))};
    if (volume->operation >= NEBEL_OPERATION_COUNT) volume->operation = NEBEL_OPERATION_ADD;
    volume->priority = (int)(take(in) % 3);
    take_shape(in, fog, which, &volume->shape);
    take_density(in, fog, which, volume);
    take_amounts(in, volume);
}

/* Copies of the first volume in a row, enough of them to be summed as an overlap set. */
static inline void take_overlap_set(input *in, march_input *fog)
{
    double step[3];
    if (take(in) % 4 != 0) return;
    take_places(in, step);
    for (size_t i = 1; fog->count < MOST_VOLUMES; i++) {
        nebel_volume_desc *copy = &fog->volumes[fog->count++];
        *copy = fog->volumes[0];
        for (int k = 0; k < 3; k++) copy->shape.transform.position[k] += step[k] * (double)i / 16;
    }
}

static inline void take_lights(input *in, march_input *fog)
{
    const unsigned which = take(in) % 16; /* half of them dark: light takes a hundred times as long */
    if (which >= 8) return;
    for (int c = 0; c < 3; c++) fog->lighting.environment.radiance[c] = (which & 1) != 0 ? take(in) / 64.0 : 0;
    if ((which & 2) != 0) {
        take_direction(in, fog->lighting.sun.direction);
        for (int c = 0; c < 3; c++) fog->lighting.sun.irradiance[c] = take(in) / 16.0;
    }
    fog->light_count = (which & 4) != 0 ? 1 + take(in) % MAX_LIGHTS : 0;
    for (size_t i = 0; i < fog->light_count; i++) {
        nebel_light *light = &fog->lights[i];
        *light =
            (nebel_light){.type = take(in) % 2 == 0 ? NEBEL_LIGHT_POINT : NEBEL_LIGHT_SPOT, .radius = take_size(in)};
        take_places(in, light->position);
        take_direction(in, light->direction);
        light->inner_angle = take(in) / 2.0;
        light->outer_angle = light->inner_angle + 1 + take(in) / 8.0;
        for (int c = 0; c < 3; c++) light->intensity[c] = take(in) / 16.0;
    }
    fog->lighting.lights = fog->lights;
    fog->lighting.light_count = fog->light_count;
}

static inline void take_ray(input *in, march_input *fog)
{
    nebel_ray *ray = &fog->rays[fog->ray_count];
    *ray = (nebel_ray){.t_max = take_size(in) * 8};
    take_places(in, ray->origin);
    take_places(in, ray->direction);
    fog->ray_count += ray->direction[0] != 0 || ray->direction[1] != 0 || ray->direction[2] != 0;
}

static inline void take_all(input *in, march_input *fog)
{
    memset(fog, 0, sizeof *fog);
    fog->count = 1 + take(in) % MOST_WRITTEN;
    take_lights(in, fog);
    for (size_t i = 0; i < MOST_RAYS && in->size > 0; i++) take_ray(in, fog);
    const size_t written = fog->count;
    for (size_t i = 0; i < written; i++) take_volume(in, fog, i);
    take_overlap_set(in, fog);
}

static inline void release_all(march_input *fog)
{
    for (size_t i = 0; i < MOST_WRITTEN; i++) nebel_release_grid(fog->grids[i]);
}

#endif
