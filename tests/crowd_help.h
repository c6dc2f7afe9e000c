/* Crowds for tests in OpenGL: many volumes in one place, in sunlight and among point lights. On Mesa's llvmpipe their
 * rays take many times the turns of loops that a fragment has there. */
#ifndef CROWD_HELP_H
#define CROWD_HELP_H

#include <string.h>

#include "fog_help.h"
#include "pass_help.h"

enum { CROWD_MOST = 1000 };

/* Volumes around one place before the eye, which is inside of some, and what lights them. */
typedef struct crowd {
    nebel_volume_desc volumes[CROWD_MOST + 1];
    size_t count, light_count;
    nebel_sun sun;
    nebel_light lights[2];
} crowd;

static inline nebel_volume_desc *crowd_add(crowd *c, nebel_shape shape)
{
    nebel_volume_desc *const v = &c->volumes[c->count++];
    *v = (nebel_volume_desc){.shape = shape};
    return v;
}

/* Of every colour; `depth` is that of all on a ray through the middle, about. */
static inline void crowd_add_balls(crowd *c, size_t count, double depth)
{
    uint64_t state = 9;
    for (size_t i = 0; i < count; i++) {
        nebel_shape ball = {.type = NEBEL_SHAPE_SPHERE, .radius = dice(&state, 3, 5)};
        for (int k = 0; k < 3; k++) ball.center[k] = pass_eye[k] + (k == 2 ? -6 : 0) + dice(&state, -2, 2);
        nebel_volume_desc *const v = crowd_add(c, ball);
        for (int k = 0; k < 3; k++) {
            v->extinction[k] = dice(&state, .05, .2) * depth / (double)count;
            v->source[k] = dice(&state, 0, 1);
        }
    }
}

static inline void crowd_add_boxes(crowd *c, size_t count, double depth)
{
    uint64_t state = 5;
    for (size_t i = 0; i < count; i++) {
        nebel_shape box = {.type = NEBEL_SHAPE_BOX};
        for (int k = 0; k < 3; k++) {
            const double center = pass_eye[k] + (k == 2 ? -6 : 0) + dice(&state, -2, 2), half = dice(&state, 2, 4);
            box.min[k] = center - half;
            box.max[k] = center + half;
        }
        nebel_volume_desc *const v = crowd_add(c, box);
        for (int k = 0; k < 3; k++) {
            v->extinction[k] = dice(&state, .05, .2) * depth / (double)count;
            v->source[k] = dice(&state, 0, 1);
        }
    }
}

/* What is in the middle of them is not there, or there is something else. */
static inline void crowd_add_hole(crowd *c, nebel_operation operation)
{
    nebel_shape ball = {.type = NEBEL_SHAPE_SPHERE, .radius = 1.5};
    for (int k = 0; k < 3; k++) ball.center[k] = pass_eye[k] + (k == 2 ? -7 : .3);
    nebel_volume_desc *const v = crowd_add(c, ball);
    v->operation = operation;
    v->priority = 1;
    if (operation != NEBEL_OPERATION_REPLACE) return;
    for (int k = 0; k < 3; k++) {
        v->extinction[k] = .2;
        v->source[k] = .3 * k;
    }
}

/* They scatter in place of shining. */
static inline void crowd_set_albedo(crowd *c)
{
    for (size_t i = 0; i < c->count; i++) {
        memcpy(c->volumes[i].albedo, c->volumes[i].source, sizeof c->volumes[i].albedo);
        memset(c->volumes[i].source, 0, sizeof c->volumes[i].source);
    }
}

static inline void crowd_set_sun(crowd *c)
{
    crowd_set_albedo(c);
    c->sun = (nebel_sun){{.4, .8, .3}, {3, 2.5, 2}};
}

static inline void crowd_set_lights(crowd *c)
{
    crowd_set_albedo(c);
    c->light_count = 2;
    for (int i = 0; i < 2; i++) {
        c->lights[i] = (nebel_light){.intensity = {20 - 5 * i, 15, 10 + 5 * i}, .radius = .1};
        for (int k = 0; k < 3; k++) c->lights[i].position[k] = pass_eye[k] + (k == 2 ? -4 - 5 * i : 1 - 2 * i);
    }
}

/* The only owner of its snapshot. */
static inline nebel_lighting *crowd_commit(const crowd *c)
{
    const nebel_lighting_desc lights = {.sun = c->sun, .lights = c->lights, .light_count = c->light_count};
    return fog_light(&lights, c->volumes, c->count);
}

#endif
