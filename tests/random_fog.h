/* Random fog and rays chosen to hurt, the same for the same seed everywhere. */
#ifndef RANDOM_FOG_H
#define RANDOM_FOG_H

#include <nebel/light.h>

#include <stdio.h>

typedef enum random_fog_kind {
    RANDOM_FOG_SINGLE,   /* one even volume of any shape */
    RANDOM_FOG_OVERLAP,  /* six even volumes, one of them the world */
    RANDOM_FOG_PROFILES, /* five volumes of any profile */
    RANDOM_FOG_EXCLUDE,  /* profiles with exclusions, half of them with priorities, fog that replaces, and distances */
    RANDOM_FOG_MANY,     /* forty volumes of any shape and profile */
    RANDOM_FOG_PARTS,    /* unions and intersections of shapes and of each other */
    RANDOM_FOG_FAR,      /* any of the above, 1e7 m away */
    RANDOM_FOG_OPAQUE,   /* extinctions from 1e-7 to 1e4 */
    RANDOM_FOG_LEVEL,    /* height and linear fog, rays nearly level */
    RANDOM_FOG_KIND_COUNT
} random_fog_kind;

enum { RANDOM_FOG_VOLUMES = 40, RANDOM_FOG_PLANES = 14, RANDOM_FOG_PARTS_EACH = 4 };

/* The volumes point into the struct: fill it where it stays, do not copy it. */
typedef struct random_fog {
    random_fog_kind kind;
    uint64_t seed;
    double ambient[3];
    double max_opacity; /* of one of four; 0: no limit. For those who ask for it */
    double shift[3];    /* of everything */
    size_t count;
    nebel_volume_desc volumes[RANDOM_FOG_VOLUMES];
    size_t part_count, plane_count;
    nebel_shape parts[RANDOM_FOG_VOLUMES * RANDOM_FOG_PARTS_EACH * (RANDOM_FOG_PARTS_EACH + 1)];
    nebel_plane planes[RANDOM_FOG_VOLUMES * RANDOM_FOG_PARTS_EACH * RANDOM_FOG_PARTS_EACH * RANDOM_FOG_PLANES];
} random_fog;

void random_fog_make(random_fog *fog, random_fog_kind kind, uint64_t seed);

/* Two of three volumes scatter light in place of their source. Goes on in `numbers`. */
void random_fog_light(random_fog *fog, uint64_t *numbers);

/* Its limit. */
nebel_fog_desc random_fog_desc(const random_fog *fog);

/* Its ambient light. */
nebel_lighting_desc random_fog_lights(const random_fog *fog);

/* Past, through and from inside the volumes; along axes; in faces; tangent to spheres, cylinders and cones to 1e-3 ..
 * 1e-15 of their size; through corners and along axes of shapes; t_max zero, tiny, ending on a surface, long, infinite;
 * directions of any length. */
nebel_ray random_fog_ray(const random_fog *fog, uint64_t seed);

/* By a quaternion of any length; one of zeros turns nothing. */
void random_fog_rotate(const double q[4], double p[3]);

/* The fog as a scene file and the ray as a line of `nebel trace`, every number exact. */
void random_fog_print(FILE *to, const random_fog *fog, const nebel_ray *ray);

#endif
