/* Layers of clouds, ready for evaluation: see docs/planet.md for the formula. */
#ifndef NB_PLANET_CLOUDS_H
#define NB_PLANET_CLOUDS_H

#include "atmosphere.h"
#include "cloud_noise.h"
#include "layer_map.h"

#include <nebel/clouds.h>

enum {
    NB_CLOUD_OCTAVES = 5, /* of where heaps are */
    NB_CLOUD_BILLOWS = 3, /* scales of billows */
    NB_CLOUD_RANKS = 257, /* of the octaves' sum */
    NB_CLOUD_GRIDS = 32,  /* on which columns are kept */
};

/* Octaves of noise have their lattices turned against each other, so that no axis shows. */
typedef struct nb_cloud_octave {
    double turn[3][3], shift[3]; /* from m to the lattice */
    float cell, weight;          /* m */
} nb_cloud_octave;

/* Each is twice as wide as the one before. */
typedef struct nb_cloud_grid {
    double spacing, per_spacing; /* between columns, on faces of a cube */
    float width;                 /* m, of what a column hides */
} nb_cloud_grid;

typedef struct nb_cloud_layer {
    nebel_cloud_kind kind;
    double low, high;    /* m from the planet's centre */
    float per_thickness; /* 1/m */
    float extinction, detail, softness;
    float size;                        /* m, of heaps */
    float hidden_height, hidden_width; /* m, of what is hidden at most */
    double axis[3], per_time;          /* the shell turns by that angle in a unit of time */
    nb_cloud_octave octaves[NB_CLOUD_OCTAVES];
    double billow_shift[3], per_billow[NB_CLOUD_BILLOWS]; /* 1/m, of the largest first */
    float last_billow;                                    /* 1/m, numbers in the table of the smallest */
    float billow_slopes[NB_CLOUD_BILLOWS];                /* of ranks, at most, per m */
    float ranks[NB_CLOUD_RANKS]; /* of the octaves' sum over the planet: what a part of it is below of */
    float slope;                 /* of that sum, at most, per m */
    float grid;                  /* m, between columns that are kept */
    nb_cloud_grid grids[NB_CLOUD_GRIDS];
    float coverage;
    nb_layer_map weather; /* level_count 0: none */
    nb_phase phase;
    double mean_cosine;
} nb_cloud_layer;

struct nebel_clouds {
    nebel_allocator allocator;
    const nebel_atmosphere *atmosphere;
    nb_cloud_noise noise;
    nb_cloud_layer layers[NEBEL_MAX_CLOUD_LAYERS];
    int layer_count;
};

/* From the planet's axes to those of a layer at a time. */
typedef struct nb_cloud_pose {
    double turn[3][3];
} nb_cloud_pose;

nb_cloud_pose nb_cloud_pose_at(const nb_cloud_layer *layer, double time);

/* How much cloud is about a column: 0 is its border, 1 the middle of a heap. */
typedef struct nb_cloud_column {
    float rank, scale, variance; /* rank: in units of heaps; scale: what the sum's are worth; of what a width hides */
} nb_cloud_column;

/* `unit` is from the planet's centre in the layer's axes. */
nb_cloud_column nb_cloud_column_at(const nb_cloud_noise *noise, const nb_cloud_layer *layer, const double unit[3],
                                   float width);

/* Where rank is less there is no cloud at a part of the layer's height; `width` is counted by the column's variance. */
#define NB_CLOUD_RANK_SLOPE 2.8f /* of it over height, at most */
float nb_cloud_least_rank(const nb_cloud_layer *layer, float height);

/* Drops at a place: extinction is `most` times `part` held within 0 and 1; where a width hides some of it, all within
 * `spread` of `part` is as likely. */
typedef struct nb_cloud_drops {
    float most, part, spread;
} nb_cloud_drops;

/* Drops at `place` (from the centre, in the layer's axes) in its column, at a part of the layer's height. Returns whether
 * there are any: if not, missing[n] is by how much the rank is at least too low, whatever billows behind the first n
 * scales do. */
int nb_cloud_in_column(const nb_cloud_noise *noise, const nb_cloud_layer *layer, const nb_cloud_column *column,
                       const double place[3], float height, float width, float missing[NB_CLOUD_BILLOWS + 1],
                       nb_cloud_drops *drops);

/* Their mean extinction. */
float nb_cloud_mean(const nb_cloud_drops *drops);

/* What extinction lets as much through as the mean of all that is hidden, which is as long along a ray as `length`; apart:
 * of that part of extinction. Where half of it is cloud half of the light comes through, however thick that is. */
typedef struct nb_cloud_seen {
    float whole, apart;
} nb_cloud_seen;

nb_cloud_seen nb_cloud_through(const nb_cloud_drops *drops, float length, float apart);

/* What a width hides along a ray that climbs so much a metre, as a length of it. */
float nb_cloud_hidden_length(const nb_cloud_layer *layer, float width, float climb);

/* Mean extinction over a width, 0 outside the layer. */
float nb_cloud_at(const nb_cloud_noise *noise, const nb_cloud_layer *layer, const nb_cloud_pose *pose,
                  const double place[3], float width);

#endif
