/* The optical depth along one ray, as every query sees it. */
#ifndef DEPTH_HELP_H
#define DEPTH_HELP_H

#include "fog_help.h"

#include <math.h>

/* A slab across x, as wide as the world for rays along x. */
static inline nebel_volume_desc slab(nebel_operation operation, int priority, double from, double to, double extinction)
{
    return (nebel_volume_desc){.operation = operation,
                               .priority = priority,
                               .shape = {.type = NEBEL_SHAPE_BOX, .min = {from, -10, -10}, .max = {to, 10, 10}},
                               .extinction = {extinction, extinction, extinction}};
}

enum { DEPTH_RAY_LENGTH = 10 };

static const nebel_ray along = {{0, .5, .25}, {1, 0, 0}, DEPTH_RAY_LENGTH};

static inline double depth_in(const nebel_snapshot *fog, nebel_precision precision, int ignore)
{
    nebel_transfer transfer;
    const nebel_trace_desc desc = {.precision = precision, .ignore_distances = ignore};
    assert_int_equal(nebel_trace(fog, &desc, 1, &along, sizeof along, &transfer, sizeof transfer), NEBEL_OK);
    return -log(transfer.transmittance[1]);
}

static inline double depth_in_planes(const nebel_snapshot *fog, int ignore)
{
    const nebel_ray_planes rays = {.origin = {0, .5, .25}, .direction = {1, 0, 0}, .t_max = &(float){DEPTH_RAY_LENGTH}};
    float transmittance;
    const nebel_transfer_planes light = {.transmittance = {NULL, &transmittance, NULL}};
    const nebel_trace_desc desc = {.ignore_distances = ignore};
    assert_int_equal(nebel_trace_planes(fog, &desc, 1, &rays, &light), NEBEL_OK);
    return -log((double)transmittance);
}

static inline double depth_of_segment(const nebel_snapshot *fog, int ignore)
{
    const float from[3] = {0, .5f, .25f}, to[3] = {DEPTH_RAY_LENGTH, .5f, .25f};
    float transmittance;
    const nebel_segments segments = {.from = from, .to = to, .ignore_distances = ignore};
    assert_int_equal(nebel_compute_segment_transmittance(fog, NEBEL_ISA_DEFAULT, 1, 1, &segments, &transmittance, 0),
                     NEBEL_OK);
    return -log((double)transmittance);
}

static inline double depth_of_pixel(const nebel_snapshot *fog)
{
    const float depth = DEPTH_RAY_LENGTH;
    const uint8_t white[4] = {255, 255, 255, 255};
    uint8_t out[4];
    const nebel_pixels pixels = {.eye = {0, .5, .25},
                                 .corner = {1, 0, 0},
                                 .width = 1,
                                 .height = 1,
                                 .depth = &depth,
                                 .color = white,
                                 .output = out};
    assert_int_equal(nebel_apply_fog_to_pixels(fog, NEBEL_ISA_DEFAULT, &pixels), NEBEL_OK);
    return -log(out[1] / 255.0);
}

/* Every query that can be told to sees the same optical depth along x, distances ignored or not. */
static inline void assert_depth_of(const nebel_snapshot *fog, int ignore, double depth)
{
    assert_true(fabs(depth_in(fog, NEBEL_PRECISION_DOUBLE, ignore) - depth) < 1e-12);
    assert_true(fabs(depth_in(fog, NEBEL_PRECISION_FLOAT, ignore) - depth) < 1e-5);
    assert_true(fabs(depth_in_planes(fog, ignore) - depth) < 1e-5);
    assert_true(fabs(depth_of_segment(fog, ignore) - depth) < 1e-5);
}

/* The depth is reached within the ray, and no fog lies behind. */
static inline void assert_found(const nebel_snapshot *fog, double depth)
{
    double distance;
    const double all = exp(-depth), nearly = exp(-depth * (1 - 1e-9));
    nebel_ray far = along;
    far.t_max = 1e3;
    assert_int_equal(nebel_invert_transmittance(fog, all * (1 - 1e-9), 1, 1, &far, sizeof far, &distance), NEBEL_OK);
    assert_true(distance == HUGE_VAL);
    assert_int_equal(nebel_invert_transmittance(fog, nearly, 1, 1, &far, sizeof far, &distance), NEBEL_OK);
    assert_true(distance <= DEPTH_RAY_LENGTH);
}

/* Every query sees the same optical depth along x, and no fog lies behind. */
static inline void assert_depth(const nebel_volume_desc *volumes, size_t n, double depth)
{
    nebel_snapshot *const fog = fog_commit(&(nebel_fog_desc){0}, volumes, n);
    assert_depth_of(fog, 0, depth);
    assert_true(fabs(exp(-depth_of_pixel(fog)) - exp(-depth)) < .51 / 255);
    if (depth > 0) assert_found(fog, depth);
    nebel_release_snapshot(fog);
}

#endif
