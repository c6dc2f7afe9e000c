/* Layers of clouds, ready for evaluation: see docs/clouds.md for the formula. */
#ifndef NB_CLOUDS_CLOUDS_H
#define NB_CLOUDS_CLOUDS_H

#include "cloud_noise.h"
#include "cloud_slab.h"
#include "planet/planet_map.h"

#include <nebel/planet.h>

enum {
    NB_CLOUD_OCTAVES = 5,       /* of where cumulus cells are */
    NB_CLOUD_WORLEY_SCALES = 3, /* scales of Worley noise */
    NB_CLOUD_RANKS = 257,       /* of the octaves' sum */
    NB_CLOUD_GRIDS = 32,        /* on which columns are kept */
};

/* Each scale of Worley noise is so much smaller than the one before. */
#define NB_WORLEY_RATIO 6.1f
static const float nb_worley_weights[NB_CLOUD_WORLEY_SCALES] = {0.68f, 0.24f, 0.08f};

/* Wisps are so many times longer along the wind than across; Worley noise in them. */
#define NB_WISPS_DRAWN_OUT 4
#define NB_WORLEY_STRETCH 10

/* Octaves of noise have their lattices turned against each other, so that no axis shows. */
typedef struct nb_cloud_octave {
    double turn[3][3], shift[3]; /* from m to the lattice */
    float cell, weight;          /* m */
} nb_cloud_octave;

/* Each is twice as wide as the one before. */
typedef struct nb_cloud_grid {
    double spacing, per_spacing; /* between columns, on faces of a cube; one by it */
    float width;                 /* m, of what a column hides */
} nb_cloud_grid;

typedef struct nb_cloud_layer {
    nebel_cloud_type kind;
    double low, high;    /* m from the planet's centre */
    float per_thickness; /* 1/m */
    float extinction, detail, softness;
    float size;                        /* m, of cumulus cells */
    float hidden_height, hidden_width; /* m, of what is hidden at most */
    double axis[3], per_time;          /* the shell turns by that angle in a unit of time */
    nb_cloud_octave octaves[NB_CLOUD_OCTAVES];
    double worley_shift[3], per_worley[NB_CLOUD_WORLEY_SCALES]; /* 1/m, of the largest first */
    float last_worley;                                          /* 1/m, numbers in the table of the smallest */
    float worley_slopes[NB_CLOUD_WORLEY_SCALES];                /* of ranks, at most, per m */
    float ranks[NB_CLOUD_RANKS]; /* of the octaves' sum over the planet: what a part of it is below of */
    float slope, most;           /* of that sum, at most, per m; the sum itself */
    float grid;                  /* m, between columns that are kept */
    nb_cloud_grid grids[NB_CLOUD_GRIDS];
    float coverage;
    nb_planet_map weather; /* level_count 0: none */
    float apart;           /* what part of scattering leads away */
    float shallow; /* optical depth up to which a place counts as one of a level slab, however the way to the sun is */
    /* Of layers whose clouds end aside (cloud_scattering.c), all 0 where they are closed: how little a cloud is like a level slab, to 1; what
     * part of light leaves it aside per unit of optical depth; what part of light that a slab would send up goes down there. */
    float broken, loss, spill;
    nb_slab *slab; /* light in slabs of such cloud */
    nb_cloud_phase phase;
} nb_cloud_layer;

/* How densities are found: see cloud_density.h. */
typedef struct nb_cloud_kernel nb_cloud_kernel;

struct nebel_clouds {
    nebel_allocator allocator;
    const nb_cloud_kernel *kernel; /* for those who ask for density alone */
    const nebel_atmosphere *atmosphere;
    nb_cloud_noise noise;
    nb_cloud_layer layers[NEBEL_MAX_CLOUD_LAYERS];
    int layer_count;
};

/* From the planet's axes to those of a layer at a time. */
typedef struct nb_cloud_rotation {
    double turn[3][3];
} nb_cloud_rotation;

nb_cloud_rotation nb_cloud_pose_at(const nb_cloud_layer *layer, double time);

/* How much cloud is about a column: 0 is its border, 1 the middle of a cumulus cell. */
typedef struct nb_cloud_column {
    float rank, scale,
        variance; /* rank: in units of cumulus cells; scale: what the sum's are worth; of what a width hides */
} nb_cloud_column;

/* `unit` is from the planet's centre in the layer's axes. */
nb_cloud_column nb_cloud_column_at(const nb_cloud_noise *noise, const nb_cloud_layer *layer, const double unit[3],
                                   float width);

/* ---- shapes ---------------------------------------------------------------------------------- */

/* Sheets are thickest in the middle of their height. */
static inline float nb_cloud_sheet_bulge(nebel_cloud_type kind)
{
    return kind == NEBEL_CLOUD_STRATUS ? 0.5f : 0.7f;
}

/* Clouds are thin at both ends of a layer: extinction is 3 x^2 - 2 x^3 of it, or less, where the part of the layer's height to that
 * end, times so much, is x below 1. */
#define NB_CLOUD_TOP_THINS 10.0f
static inline float nb_cloud_base_thins(nebel_cloud_type kind)
{
    return kind == NEBEL_CLOUD_CUMULUS ? 16.0f : 6.0f;
}

/* Where rank is less there is no cloud at a part of the layer's height; a width is counted by the column's variance.
 * Cumulus cells are domes:
 * where their rank falls as a parabola from the middle, its root is a half ball. */
#define NB_CLOUD_RANK_SLOPE 2.8f /* of it over height, at most */
static inline float nb_cloud_least_rank(nebel_cloud_type kind, float height)
{
    const float from_middle = 2 * height - 1;
    if (kind == NEBEL_CLOUD_CUMULUS) return height * height;
    return nb_cloud_sheet_bulge(kind) * from_middle * from_middle;
}

/* ---- drops ----------------------------------------------------------------------------------- */

/* How much of extinction is seen: of all; of that part of scattering which leads away; of all where light comes through. */
typedef struct nb_cloud_filter {
    float whole, apart, passed;
} nb_cloud_filter;

/* Places that are asked at once (cloud_density.h). */
typedef struct nb_cloud_density_query nb_cloud_density_query;

/* Puts a place from the planet's centre behind those whose mean is asked. */
void nb_cloud_ask(nb_cloud_density_query *looks, const nb_cloud_rotation *pose, const double place[3], float width);
/* Finds drops; no column next to the places is asked, so that none is kept. */
void nb_cloud_density_alone(const nb_cloud_kernel *kernel, const nb_cloud_noise *noise, const nb_cloud_layer *layer,
                            nb_cloud_density_query *looks);
/* Mean extinction at all places that were asked; begins anew. */
void nb_cloud_find_means(const nebel_clouds *clouds, int layer, nb_cloud_density_query *looks,
                         float extinction[/* NB_CLOUD_LANES */]);

#endif
