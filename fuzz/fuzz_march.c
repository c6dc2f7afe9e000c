/* Any bytes as volumes and rays: light is finite, transmittance is within 0 and 1, the bound of the error is a number; it does not
 * matter which rays are traced together nor, but for rounding, in which order volumes were added; and a ray in two pieces lets as much light
 * through as the whole one. */
#include "witness.h"

#include <math.h>
#include <stdint.h>
#include <string.h>

enum { MOST_VOLUMES = 6, MOST_RAYS = 4 };

typedef struct input {
    const uint8_t *data;
    size_t size;
} input;

static unsigned take(input *in)
{
    if (in->size == 0) return 0;
    in->size--;
    return *in->data++;
}

/* -8 to 8, in steps that meet each other: faces touch, rays run along them. */
static double take_place(input *in)
{
    return ((int)take(in) - 128) / 16.0;
}

static double take_size(input *in)
{
    return (1 + take(in)) / 32.0;
}

static void take_places(input *in, double place[3])
{
    for (int i = 0; i < 3; i++) place[i] = take_place(in);
}

static void take_shape(input *in, nebel_shape *shape)
{
    static const nebel_shape_type types[] = {NEBEL_SHAPE_SPHERE, NEBEL_SHAPE_BOX, NEBEL_SHAPE_WORLD};
    shape->type = types[take(in) % 3];
    if (shape->type == NEBEL_SHAPE_SPHERE) {
        take_places(in, shape->center);
        shape->radius = take_size(in);
    } else if (shape->type == NEBEL_SHAPE_BOX) {
        take_places(in, shape->min);
        for (int i = 0; i < 3; i++) shape->max[i] = shape->min[i] + take_size(in);
    }
}

static void take_volume(input *in, nebel_volume_desc *volume)
{
    *volume = (nebel_volume_desc){.operation = (nebel_operation)(take(in) % NEBEL_OPERATION_COUNT)};
    volume->priority = (int)(take(in) % 3);
    take_shape(in, &volume->shape);
    if (take(in) % 2 == 1) {
        volume->density.type = NEBEL_DENSITY_HEIGHT;
        volume->density.below = NEBEL_BELOW_CONSTANT;
        volume->density.base = take_place(in);
        volume->density.scale_height = take_size(in);
    }
    for (int c = 0; c < 3; c++) {
        volume->extinction[c] = ldexp(take(in), (int)(take(in) % 16) - 12);
        volume->source[c] = take(in) / 64.0;
    }
}

static int take_ray(input *in, nebel_ray *ray)
{
    *ray = (nebel_ray){.t_max = take_size(in) * 8};
    take_places(in, ray->origin);
    take_places(in, ray->direction);
    return ray->direction[0] != 0 || ray->direction[1] != 0 || ray->direction[2] != 0;
}

static nebel_snapshot *make_fog(const nebel_volume_desc *volumes, size_t count, int backwards)
{
    nebel_fog *fog = NULL;
    nebel_snapshot *snapshot = NULL;
    nebel_volume_id id;
    demand(nebel_create_fog(&(nebel_fog_desc){0}, &fog) == NEBEL_OK);
    for (size_t i = 0; i < count; i++)
        demand(nebel_add_volume(fog, &volumes[backwards ? count - 1 - i : i], &id) == NEBEL_OK);
    demand(nebel_commit_fog(fog, &snapshot) == NEBEL_OK);
    nebel_destroy_fog(fog);
    return snapshot;
}

static void check_light(const nebel_light *light)
{
    for (int c = 0; c < 3; c++) {
        demand(light->transmittance[c] >= 0 && light->transmittance[c] <= 1);
        demand(isfinite(light->in_scattering[c]) && light->in_scattering[c] >= 0);
    }
    demand(isfinite(light->error) && light->error >= 0);
}

static void trace(const nebel_snapshot *fog, nebel_precision precision, size_t n, const nebel_ray *rays,
                  nebel_light *lights)
{
    const nebel_trace_desc desc = {.precision = precision};
    demand(nebel_trace(fog, &desc, n, rays, sizeof *rays, lights, sizeof *lights) == NEBEL_OK);
    for (size_t i = 0; i < n; i++) check_light(&lights[i]);
}

/* Float results are the same bits for every way of splitting the rays into calls. */
static void check_calls(const nebel_snapshot *fog, nebel_precision precision, size_t n, const nebel_ray *rays,
                        const nebel_light *together)
{
    for (size_t i = 0; i < n; i++) {
        nebel_light alone;
        trace(fog, precision, 1, &rays[i], &alone);
        for (int c = 0; c < 3; c++)
            demand(alone.transmittance[c] == together[i].transmittance[c] &&
                   alone.in_scattering[c] == together[i].in_scattering[c]);
        demand(alone.error == together[i].error);
    }
}

static void check_near(const nebel_light *a, const nebel_light *b)
{
    for (int c = 0; c < 3; c++) {
        demand(fabs(a->transmittance[c] - b->transmittance[c]) <= a->error + b->error + 1e-9);
        demand(fabs(a->in_scattering[c] - b->in_scattering[c]) <= a->error + b->error + 1e-8);
    }
}

/* The ray in two pieces, one after the other. */
static void check_pieces(const nebel_snapshot *fog, const nebel_ray *ray, const nebel_light *whole)
{
    nebel_ray pieces[2] = {*ray, *ray};
    nebel_light lights[2], joined = {.error = 0};
    const double *d = ray->direction, length = sqrt(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]), half = ray->t_max / 2;
    pieces[0].t_max = pieces[1].t_max = half;
    for (int i = 0; i < 3; i++) pieces[1].origin[i] += d[i] / length * half;
    trace(fog, NEBEL_PRECISION_DOUBLE, 2, pieces, lights);
    for (int c = 0; c < 3; c++) {
        joined.transmittance[c] = lights[0].transmittance[c] * lights[1].transmittance[c];
        joined.in_scattering[c] = lights[0].in_scattering[c] + lights[0].transmittance[c] * lights[1].in_scattering[c];
    }
    joined.error = 5 * (lights[0].error + lights[1].error);
    /* Rays along a face may take either side of it. */
    for (int i = 0; i < 3; i++)
        if (d[i] == 0) return;
    check_near(&joined, whole);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    input in = {data, size};
    nebel_volume_desc volumes[MOST_VOLUMES];
    nebel_ray rays[MOST_RAYS];
    nebel_light lights[MOST_RAYS], others[MOST_RAYS];
    const size_t count = 1 + take(&in) % MOST_VOLUMES;
    size_t n = 0;
    for (size_t i = 0; i < count; i++) take_volume(&in, &volumes[i]);
    for (size_t i = 0; i < MOST_RAYS && in.size > 0; i++) n += (size_t)take_ray(&in, &rays[n]);
    if (n == 0) return 0;
    nebel_snapshot *fog = make_fog(volumes, count, 0), *backwards = make_fog(volumes, count, 1);
    trace(fog, NEBEL_PRECISION_FLOAT, n, rays, lights);
    check_calls(fog, NEBEL_PRECISION_FLOAT, n, rays, lights);
    trace(fog, NEBEL_PRECISION_DOUBLE, n, rays, lights);
    check_calls(fog, NEBEL_PRECISION_DOUBLE, n, rays, lights);
    trace(backwards, NEBEL_PRECISION_DOUBLE, n, rays, others);
    for (size_t i = 0; i < n; i++) {
        check_near(&lights[i], &others[i]);
        check_pieces(fog, &rays[i], &lights[i]);
    }
    nebel_release_snapshot(fog);
    nebel_release_snapshot(backwards);
    return 0;
}
