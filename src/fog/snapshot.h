/* The immutable fog that queries read: volumes in canonical order, what they give as light, and where they are. */
#ifndef NB_FOG_SNAPSHOT_H
#define NB_FOG_SNAPSHOT_H

#include "bvh.h"
#include "light/sun_lattice.h"
#include "light/point_light.h"
#include "light/environment.h"
#include "medium/volume.h"

#include <nebel/light.h>

#include <stdatomic.h>

/* A volume and what the integrator wants to know of it at once. */
typedef struct nb_medium {
    nb_volume body;
    double radiance[3]; /* of opaque fog: source, or albedo times ambient; the most of it where there is a skylight */
    double light[3];    /* radiance * extinction + emission: radiance per metre at density 1 */
    const nb_environment_light *sky; /* what lights it instead, by the direction of the ray; NULL: nothing */
    double densest;                  /* largest extinction of any channel anywhere */
    double brightest;                /* the same of light */
    double proportion; /* of the body's extent to the least of its leaves' sizes where their frames scale, at least 1;
                           for margins */
    int emits;
    int is_sunlit;
    int is_lamplit;
    double shine[3]; /* albedo times the sun's irradiance: of opaque fog, if the phase function were 1 */
    double ahead;    /* of what it scatters, for many scatterings: the part taken to go straight on */
    double
        turned_cosine; /* and the mean cosine of the rest. Both are the least that have its phase function's two first
                             moments: Joseph, Wiscombe and Weinman 1976 */
    size_t slot;       /* of the fog that it is from */
    nb_sun_lattice *lattice; /* of linear voxels that the sun lights, alone; else NULL */
    int joins; /* its density is constant and its body convex, so that sums can stand for it among many of its kind */
} nb_medium;

/* How the optical depth from a place to the sun is had. */
typedef enum nb_sun_depth_method {
    NB_SUN_DEPTH_MARCHED = 0, /* by a march of its own */
    NB_SUN_DEPTH_ADDED,       /* convex bodies of constant density that add: what they cut out of the way, summed */
    NB_SUN_DEPTH_FLAT,        /* few of them, where all faces are flat: along any ray it is linear between turns */
    NB_SUN_DEPTH_HEIGHT,      /* one height fog without an end, and a sun above: a multiple of the density */
    NB_SUN_DEPTH_ALTITUDE,    /* one fog of an altitude without an end: its integral from the place on */
    NB_SUN_DEPTH_GRID         /* one box of voxels: they are walked through from the place on */
} nb_sun_depth_method;

/* Bodies of more faces have very many edges, and nearly smooth shadows: their turns are not looked for. */
#define NB_MAX_EDGED_FACES 16

/* From so many such media on one ray on, they are summed in a tree. */
#define NB_MIN_OVERLAP_SET 64

struct nebel_snapshot {
    nebel_allocator allocator;
    nebel_log log;
    atomic_size_t owners;
    size_t medium_count;
    nb_medium *media;               /* in the order of nb_volume_compare: ranks ascend */
    double largest_radiance;        /* of all volumes and channels */
    double max_opacity;             /* 1 where there is no limit */
    int is_sunlit;                  /* whether any medium is */
    double to_sun[3];               /* of length 1; not read where nothing is sunlit */
    double irradiance[3];           /* of the sun */
    int is_gray;                    /* no fog has a colour in its extinction */
    nb_sun_depth_method way_to_sun; /* the same */
    int is_added;     /* all media are convex bodies of constant density that add: any way's depth is a sum over them */
    int is_lit_crowd; /* many media whose depths add are lit: see trace_lit_overlap_set.h */
    int is_lamplit;   /* whether any medium is */
    int has_parts;    /* some body has parts, or takes fog away from others */
    size_t lamp_count;
    nb_light *lamps;
    nebel_environment sky;           /* one owner of its map */
    size_t skylight_count;           /* one for each phase function that scatters it, where it is not constant */
    nb_environment_light *skylights; /* each an owner of its filter */
    const nb_medium *joining;        /* one that joins; NULL where none does */
    size_t joining_count;            /* how many do; they are of one rank */
    size_t covering_count;           /* media that cover others */
    size_t endless_count;            /* media without finite bounds, by index: every ray may meet them */
    uint32_t *endless;
    nebel_diffusion_desc diffusing;     /* of the fog; cells 0: off */
    struct nb_diffusion *diffusion;     /* light that is scattered more than once, of sun and sky; NULL: left out */
    struct nb_diffusion *own_diffusion; /* the same of lamps, and of what fog emits and scatters */
    nb_bvh bvh;                         /* over the others */
    uint32_t *bounded;                  /* the media that the tree's boxes stand for */
    size_t bounded_count;
};

/* Cells per metre of the way to the sun through the voxels that are the body's density. */
void nb_way_in_cells(const nebel_snapshot *snapshot, const nb_volume *body, double way[3]);

#endif
