/* Which fog is where along lines, how dense it is, and its optical depth, by brute force in double: the medium of the oracle
 * of lit fog. */
#ifndef LIT_FOG_H
#define LIT_FOG_H

#include "lit_shape.h"

#include <nebel/light.h>

enum { LIT_MAX_VOLUMES = 128, LIT_MAX_LEAVES = 1024, LIT_MAX_EVENTS = 2 * LIT_MAX_LEAVES + 8, LIT_MAX_CUTS = 16384 };

typedef struct lit_scene {
    const nebel_volume_desc *volumes; /* no `start`, no `cutoff` */
    size_t volume_count;
    double ambient[3];
    nebel_sun sun; /* irradiance 0: none */
    const nebel_light *lights;
    size_t light_count;
    const float *voxels; /* of all grids, x fastest */
    int size[3], is_nearest;
} lit_scene;

/* A scene that is ready for lines. */
typedef struct lit_fog {
    const lit_scene *scene;
    int is_sum; /* no volume excludes or replaces others, or has parts */
    size_t leaf_count, first_leaf[LIT_MAX_VOLUMES + 1];
    lit_leaf leaves[LIT_MAX_LEAVES];
} lit_fog;

/* Of a line: the spans of all leaves, where they begin and end, and the volumes that it may meet. */
typedef struct lit_map {
    lit_span leaves[LIT_MAX_LEAVES];
    size_t event_count, active_count;
    double events[LIT_MAX_EVENTS];
    size_t active[LIT_MAX_VOLUMES];
} lit_map;

typedef struct lit_marks {
    size_t count, volumes[LIT_MAX_VOLUMES];
} lit_marks;

typedef struct lit_cuts {
    size_t count;
    double at[LIT_MAX_CUTS];
} lit_cuts;

void lit_fog_prepare(const lit_scene *scene, lit_fog *fog);

/* Up to `end`, which may be infinite. */
void lit_fog_map(const lit_fog *fog, const lit_line *l, double end, lit_map *m);

/* The volumes whose fog is there at t. */
void lit_fog_mark(const lit_fog *fog, const lit_map *m, double t, lit_marks *marks);

/* Of a volume at a place inside its shape. */
double lit_fog_density(const lit_fog *fog, size_t volume, const lit_line *l, double t);

/* The integral of a volume's density from a to b along a line of unit speed. */
double lit_fog_amount(const lit_fog *fog, size_t volume, const lit_line *l, double a, double b);

/* Adds places between a and b where a volume's density is not smooth, or changes on its own scale. */
void lit_fog_cut(const lit_fog *fog, size_t volume, const lit_line *l, double a, double b, lit_cuts *cuts);

void lit_add_cut(lit_cuts *cuts, double t);
void lit_sort(double *numbers, size_t count);

/* Adds the optical depth of the marked volumes from a to b. */
void lit_fog_add_depth(const lit_fog *fog, const lit_line *l, const lit_marks *marks, double a, double b,
                       double depth[3]);

/* The optical depth of all fog from 0 to `end`; a part of it where that lets nothing through. */
void lit_fog_depth(const lit_fog *fog, const lit_line *l, double end, double depth[3]);

#endif
