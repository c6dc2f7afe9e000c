/* The immutable fog that queries read: volumes in canonical order, and where they are. */
#ifndef NB_FOG_SNAPSHOT_H
#define NB_FOG_SNAPSHOT_H

#include "bvh.h"
#include "medium/volume.h"
#include "medium_light.h"

#include <stdatomic.h>

/* A volume and what the integrator wants to know of it at once. */
typedef struct nb_medium {
    nb_volume body;
    double densest;    /* largest extinction of any channel anywhere */
    double peak;       /* the density anywhere in the body is no more */
    double proportion; /* of the body's extent to the least of its leaves' sizes where their frames scale, at least 1;
                           for margins */
    int emits;
    double ahead; /* of what it scatters, for many scatterings: the part taken to go straight on */
    double
        turned_cosine; /* and the mean cosine of the rest. Both are the least that have its phase function's two first
                             moments: Joseph, Wiscombe and Weinman 1976 */
    size_t slot;       /* of the fog that it is from */
} nb_medium;

/* Bodies of more faces have very many edges, and nearly smooth shadows: their turns are not looked for. */
#define NB_MAX_EDGED_FACES 16

/* From so many such media on one ray on, they are summed in a tree. */
#define NB_MIN_OVERLAP_SET 64

struct nebel_snapshot {
    nebel_allocator allocator;
    nebel_log log;
    atomic_size_t owners;
    size_t medium_count;
    nb_medium *media;     /* in the order of nb_volume_compare: ranks ascend */
    nebel_lighting unlit; /* what they give without lights */
    double max_opacity;   /* 1 where there is no limit */
    int is_gray;          /* no fog has a colour in its extinction */
    int adds_depths; /* no medium takes fog away, has parts or steep ends: the depth of any way is a sum over media */
    int has_parts;   /* some body has parts, or takes fog away from others */
    size_t covering_count; /* media that cover others */
    size_t endless_count;  /* media without finite bounds, by index: every ray may meet them */
    uint32_t *endless;
    nb_bvh bvh;        /* over the others */
    uint32_t *bounded; /* the media that the tree's boxes stand for */
    size_t bounded_count;
};

/* A box around nothing, and one that grows by a body. */
nebel_bounds nb_no_bounds(void);
void nb_bounds_add(nebel_bounds *bounds, const nb_volume *body);

/* What is taken of a snapshot, and how. */
typedef struct nb_medium_selection {
    int is_scaled; /* what light goes straight on through is no fog, and the rest scatters and gives nothing */
    int is_level;  /* fog without an end along x or z alone */
} nb_medium_selection;

/* Whether the depth along any way is a sum over other bodies and this one, of which the density has an integral in closed
 * form, and is not so dense at its ends that their slack matters more than that of others. */
int nb_medium_adds_depth(const nb_medium *medium);

/* Another snapshot of the same fog. Errors: MEMORY. */
nebel_result nb_snapshot_select(const nebel_snapshot *from, nb_medium_selection of, nebel_snapshot **made);

#endif
