/* The boxes of fog over the terrain that streams of points are measured with. */
#ifndef NB_BENCH_BOX_FOG_SCENE_H
#define NB_BENCH_BOX_FOG_SCENE_H

#include "scalar_baseline.h"

#include <nebel/nebel.h>

enum { NB_MAX_BOXES = 16 };

typedef enum nb_setting {
    NB_FOG_BANK = 0,   /* the box of scene A: three quarters of the points are above it */
    NB_FOG_OVER_ALL,   /* one box that holds all points: nothing can be left out */
    NB_FOG_IN_PATCHES, /* sixteen boxes */
    NB_SETTINGS
} nb_setting;

extern const char *const nb_setting_names[NB_SETTINGS];

typedef struct nb_boxes {
    nb_old_box list[NB_MAX_BOXES];
    size_t count;
} nb_boxes;

void nb_boxes_set(nb_setting setting, nb_boxes *boxes);

/* Radiance of all of them where they are opaque. */
extern const double nb_boxes_color[3];

/* NULL without memory. */
nebel_snapshot *nb_boxes_commit(const nb_boxes *boxes);

#endif
