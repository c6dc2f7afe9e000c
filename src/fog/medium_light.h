/* What the media of a snapshot give as light: by themselves, and under the lights of a lighting. */
#ifndef NB_FOG_MEDIUM_LIGHT_H
#define NB_FOG_MEDIUM_LIGHT_H

#include "medium/volume.h"

#include <nebel/light.h>

#include <stdatomic.h>

struct nb_diffusion;
struct nb_environment_light;
struct nb_light;
struct nb_light_lattices;
struct nb_medium;
struct nb_sun_lattice;
struct nb_trace_job;

typedef struct nb_medium_light {
    double
        radiance[3]; /* of opaque fog: source, or albedo times ambient; the most of it under a filtered environment */
    double light[3]; /* radiance * extinction + emission: radiance per metre at density 1 */
    const struct nb_environment_light *environment; /* what lights it instead, by the ray's direction; NULL: nothing */
    double brightest;                               /* the most light of any channel anywhere */
    double shine[3]; /* albedo times the sun's irradiance: of opaque fog, if the phase function were 1 */
    struct nb_sun_lattice *sun_lattice; /* of linear voxels whose depth to the sun is a term of a sum; else NULL */
    int scatters_sun, scatters_lights;  /* of point and spot lights */
    size_t phase;                       /* of media that scatter lights: see phase_count of the lighting */
    int joins; /* its density is constant and its body convex, so that sums can stand for it among many of its kind */
} nb_medium_light;

/* How the optical depth from a place to the sun is had. */
typedef enum nb_sun_depth_method {
    NB_SUN_DEPTH_MARCHED = 0, /* by a march of its own */
    NB_SUN_DEPTH_ADDED,       /* convex bodies of constant density that add: what they cut out of the way, summed */
    NB_SUN_DEPTH_SUMMED,      /* the same of other densities, voxels included */
    NB_SUN_DEPTH_FLAT,        /* few of them, where all faces are flat: along any ray it is linear between turns */
    NB_SUN_DEPTH_HEIGHT,      /* one height fog without an end, and a sun above: a multiple of the density */
    NB_SUN_DEPTH_ALTITUDE,    /* one fog of an altitude without an end: its integral from the place on */
    NB_SUN_DEPTH_GRID         /* one box of voxels: they are walked through from the place on */
} nb_sun_depth_method;

/* Whether lights are gathered in steps that all media have in common: see trace_common_steps.h. */
typedef enum nb_common_steps {
    NB_COMMON_STEPS_NEVER = 0,
    NB_COMMON_STEPS_IN_FLOAT, /* voxels among them, which are marched through in double */
    NB_COMMON_STEPS_ALWAYS
} nb_common_steps;

/* Immutable once it is made. A snapshot has one of its own, without lights, which owns nothing but `media`. */
struct nebel_lighting {
    nebel_allocator allocator;
    nebel_log log;
    atomic_size_t owners;
    nebel_snapshot *snapshot; /* one owner of it, but for the snapshot's own */
    nb_medium_light *media;   /* of each medium of the snapshot */
    double largest_radiance;  /* of all media and channels */

    int scatters_sun;     /* whether any medium does */
    double to_sun[3];     /* of length 1; not read where nothing scatters the sun */
    double irradiance[3]; /* of the sun */
    nb_sun_depth_method sun_depth_method;

    int scatters_lights; /* whether any medium does */
    size_t phase_count;  /* phase functions of the media that do; each has a number */
    size_t light_count;
    struct nb_light *lights;
    nebel_light *described_lights; /* the same as they were given */
    nb_common_steps common_steps;
    _Atomic(struct nb_light_lattices *) light_lattices; /* made when they are asked for: see nb_light_lattices_of */

    nebel_environment environment;                   /* one owner of its map */
    size_t environment_light_count;                  /* one for each phase function that scatters it, if not constant */
    struct nb_environment_light *environment_lights; /* each an owner of its filter */

    const struct nb_medium *joining; /* one that joins; NULL where none does */
    size_t joining_count;            /* how many do; they are of one rank */

    nebel_diffusion_desc diffusion_desc;  /* cells 0: off */
    struct nb_diffusion *diffusion;       /* light of sun and sky that is scattered more than once; NULL: left out */
    struct nb_diffusion *local_diffusion; /* the same of lights, and of what fog emits */
    /* Adds both to a job that is done, where there is any: of the room diffusion, which knows the march. */
    nebel_result (*add_diffusion)(const nebel_lighting *lighting, const struct nb_trace_job *job);
};

/* Fills `media`, which has room for all, and what is read of all of them together, under an ambient light of this radiance
 * at most, and a sun of this irradiance. */
void nb_light_media(nebel_lighting *lighting, const double ambient[3], const double irradiance[3]);

/* Of the media that may join, those of the rank that has most of them do. After all else is known of their light. */
void nb_join_media(nebel_lighting *lighting);

/* The lighting that a query asks for: the snapshot's own where it names none; NULL, with a message, where it is of another
 * snapshot. */
const nebel_lighting *nb_lighting_of(const nebel_snapshot *snapshot, const nebel_lighting *lighting);

#endif
