/* Random lit fog of every shape, profile, phase function and light, from thin to opaque, and rays through it, the same for
 * the same seed everywhere. */
#ifndef LIT_SCENES_H
#define LIT_SCENES_H

#include "lit_fog.h"
#include "random_fog.h"

#include <stdint.h>

typedef enum lit_kind {
    LIT_KIND_BOX,
    LIT_KIND_SPHERE,
    LIT_KIND_ELLIPSOID,
    LIT_KIND_CYLINDER,
    LIT_KIND_CAPSULE,
    LIT_KIND_CONE,
    LIT_KIND_CONVEX,
    LIT_KIND_HALF_SPACE,
    LIT_KIND_WORLD,
    LIT_KIND_SOFT_EDGES,
    LIT_KIND_ALTITUDE,
    LIT_KIND_PARTS,
    LIT_KIND_SEVERAL,
    LIT_KIND_EXCLUDED,
    LIT_KIND_CLOSED_FORM, /* flat and even, or height alone */
    LIT_KIND_SMALL_CROWD,
    LIT_KIND_CROWD,
    LIT_KIND_VOXELS,
    LIT_KIND_COUNT
} lit_kind;

extern const char *const lit_kind_names[LIT_KIND_COUNT];

/* What the lights of a scene are. */
typedef enum lit_source { LIT_BY_SUN, LIT_BY_LIGHTS, LIT_SOURCE_COUNT } lit_source;

enum { LIT_RAYS_EACH = 10, LIT_CROWD = 80, LIT_SIDE = 7, LIT_MAX_LIGHTS = 2 };

/* The members point into the struct: fill it where it stays, do not copy it. */
typedef struct lit_draw {
    lit_scene scene;
    random_fog random;
    nebel_volume_desc volumes[LIT_CROWD];
    size_t count;
    nebel_light lights[LIT_MAX_LIGHTS];
    float voxels[LIT_SIDE * LIT_SIDE * LIT_SIDE];
    nebel_grid *grid;
} lit_draw;

void lit_draw_fog(lit_draw *draw, lit_kind kind, lit_source source, uint64_t seed);

/* How many rays to try of a scene: fewer through crowds, in which each costs most. */
int lit_ray_count(lit_kind kind);
void lit_draw_rays(uint64_t seed, nebel_ray rays[LIT_RAYS_EACH]);

/* The only owner of its snapshot; NULL where nebel refuses the fog. */
nebel_lighting *lit_draw_commit(const lit_draw *draw);
void lit_draw_free(lit_draw *draw);

#endif
