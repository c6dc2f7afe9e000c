/* Clouds at a moment under a sun. */
#ifndef NB_CLOUDS_CLOUD_LIGHTING_H
#define NB_CLOUDS_CLOUD_LIGHTING_H

#include "atmosphere/atmosphere.h"
#include "clouds.h"

enum {
    NB_CLOUD_HEIGHTS = 6, /* of light without clouds */
    NB_CLOUD_SUNS = 1024, /* and heights of the sun, as evenly spread cosines */
    NB_CLOUD_NODES = 1 << 17,
    NB_CLOUD_CELLS = 1 << 14,
    NB_CLOUD_POINTS = 1 << 18,
    NB_CLOUD_PATCHES = 1 << 14,
    NB_CLOUD_BLOCKS = 1 << 15,
};

/* Numbers that are counted together. */
typedef float nb_four __attribute__((vector_size(16)));
typedef double nb_two __attribute__((vector_size(16)));

/* Light of three colours at a place in clear air: of the sun on what faces it, and the mean radiance of each half of the sky. */
typedef struct nb_cloud_light {
    nb_four sun, above, below;
} nb_cloud_light;

struct nebel_cloud_lighting {
    nebel_allocator allocator;
    nebel_log log;
    const nebel_clouds *clouds;
    const nb_cloud_kernel *kernel;
    nebel_sun sun;
    double tolerance;
    nb_cloud_rotation poses[NEBEL_MAX_CLOUD_LAYERS];
    double low, high;                        /* of all layers, m from the centre */
    double lowest_sun;                       /* cosine to the zenith */
    nb_cloud_light (*lights)[NB_CLOUD_SUNS]; /* [height][sun] */
};

/* A node of the lattice on which optical depths are kept: towards the sun; or away from it, up and down. */
typedef struct nb_cloud_lattice_node {
    int32_t at[3];
    int16_t level; /* nodes are 2^level m apart */
    int16_t is_set;
    float depth[3]; /* of a roof: not depths but parts of light */
} nb_cloud_lattice_node;

/* The eight nodes around a cell of that lattice: of each depth those at its low x, and those at its high x; y first. */
typedef struct nb_cloud_cell {
    int32_t low[3];
    int16_t level, is_set;
    nb_four depth[3][2];
} nb_cloud_cell;

/* Which ways a lattice is of: to the sun; away from it, up and down; or through a roof to the sun, and up. */
typedef enum nb_cloud_depth_axis {
    NB_CLOUD_TO_SUN,
    NB_CLOUD_AROUND,
    NB_CLOUD_ROOFS, /* and so on: of each layer */
    NB_CLOUD_WAYS = NB_CLOUD_ROOFS + NEBEL_MAX_CLOUD_LAYERS
} nb_cloud_depth_axis;

typedef struct nb_cloud_lattice {
    nb_cloud_lattice_node *nodes;
    nb_cloud_cell *cells;
} nb_cloud_lattice;

/* A point of the grid on which columns are kept. */
typedef struct nb_cloud_point {
    uint32_t key; /* 0: none; else face, layer and level */
    int32_t at[2];
    nb_cloud_column column;
} nb_cloud_point;

/* The four columns around a cell of that grid, x first; of each rank, scale, variance and nothing. */
typedef struct nb_cloud_patch {
    uint32_t key;
    int32_t at[2];
    nb_four columns[4];
} nb_cloud_patch;

/* Ranks, with all that a width hides, of a block of that grid: one that there is, and what none is above, as far as they are known. */
typedef struct nb_cloud_column_block {
    uint32_t key;
    int32_t at[2];
    float above, highest;
} nb_cloud_column_block;

/* What a place has of light: of the sun's, what was not scattered, or hardly turned, and what scattering more often sends towards the
 * eye; of the sky's two halves. */
typedef struct nb_cloud_irradiance {
    float left, left_wide, often, above, below;
} nb_cloud_irradiance;

/* Optical depths at a place. */
typedef struct nb_cloud_depths {
    float sun, away, up, down;
} nb_cloud_depths;

/* How a place is seen: cosines of the sun and of the ray to straight up, and between both. */
typedef struct nb_cloud_sight {
    float sun, rise, ahead;
} nb_cloud_sight;

/* A place in clouds; with a direction along the ground, and optical depths. */
typedef struct nb_prefilter_point {
    double from[3], turn;
    float extinction, up, down;
} nb_prefilter_point;

/* How much of a place is seen: of all scattering, and of what leads away. */
typedef struct nb_prefilter_weight {
    float whole, apart;
} nb_prefilter_weight;

enum {
    NB_PREFILTER_VIEWS = 14,
    NB_PREFILTER_TURNS = 3,
    NB_PREFILTER_SUNS = 12,
    NB_PREFILTER_PLACES = 768,
};

/* Places in a layer, and what they are in the mean; what was not asked for is not there. */
typedef struct nb_cloud_prefilter {
    int is_set, count;
    nb_prefilter_point places[NB_PREFILTER_PLACES];
    nb_cloud_depths depths[NB_PREFILTER_SUNS][NB_PREFILTER_PLACES];
    nb_prefilter_weight seen[NB_PREFILTER_VIEWS][NB_PREFILTER_TURNS][NB_PREFILTER_PLACES];
    nb_cloud_irradiance means[NB_PREFILTER_VIEWS][NB_PREFILTER_TURNS][NB_PREFILTER_SUNS];
    uint8_t has_depths[NB_PREFILTER_SUNS], has_seen[NB_PREFILTER_VIEWS][NB_PREFILTER_TURNS],
        has_mean[NB_PREFILTER_VIEWS][NB_PREFILTER_TURNS][NB_PREFILTER_SUNS];
} nb_cloud_prefilter;

struct nebel_cloud_workspace {
    const nebel_cloud_lighting *view;
    nb_cloud_lattice lattices[NB_CLOUD_WAYS]; /* nb_cloud_depth_axis; those of layers that are */
    nb_cloud_point *points;
    nb_cloud_patch *patches;
    nb_cloud_column_block *blocks;
    nb_cloud_prefilter *prefilters; /* of each layer */
};

/* Where a ray is within a shell: at most two pieces, before and behind what lies below it. Returns how many. */
int nb_cloud_pieces(double low, double high, const double from[3], const double unit[3], double t_max,
                    double pieces[2][2]);

/* Finds drops at places in a layer, from columns that are found once and linear between. */
void nb_cloud_density(nebel_cloud_workspace *workspace, int layer, nb_cloud_density_query *looks);

/* A place of a ray on a face of the cube, on which blocks of columns are. */
typedef struct nb_cloud_column_cursor {
    int layer, face, level;
    float part;                  /* of the next level */
    double over, rise;           /* along the face's axis: of the place, of the direction */
    nb_two at, place, direction; /* across; at: on the face */
    nb_two grows;                /* whether that does: 0, 1 */
    int block[2][2];             /* of each grid, of the size that was asked last */
} nb_cloud_column_cursor;

/* Place and direction in the layer's axes. */
nb_cloud_column_cursor nb_cloud_density_out(const nebel_cloud_workspace *workspace, int layer, const double place[3],
                                            const double direction[3], float width);
/* How far the ray stays within a block of size 0, 1 or 2, m. */
double nb_cloud_way_in_block(const nebel_cloud_workspace *workspace, nb_cloud_column_cursor *out, int size);
/* Whether the rank of any column there is above `least`, with all that a width hides. */
int nb_cloud_is_block_above(nebel_cloud_workspace *workspace, const nb_cloud_column_cursor *out, int size, float least);

nebel_result nb_cloud_light_make(nebel_cloud_lighting *view);

/* Light of clear air at a place from the centre. */
nb_cloud_light nb_cloud_clear_light(const nebel_cloud_lighting *view, const double place[3], double radius);

/* All along a way; the first step is so long, and what is narrower than a width is seen as a mean. is_alone: of a place that has
 * no neighbours. */
float nb_cloud_depth_along(nebel_cloud_workspace *workspace, const double from[3], const double unit[3], float first,
                           float width, int is_alone);

/* How finely they are found: what is narrower than a width is seen as a mean. */
typedef struct nb_cloud_resolution {
    float width, first; /* first: length of the first step towards the sun */
    float wide;         /* between nodes of the other ways */
    float own;          /* part of what lattices give that comes from ways of the place's own: 0 to 1 */
} nb_cloud_resolution;

/* A place in clouds, and what is found there: nothing where all places are alike, as a pixel hides all of the layer. */
typedef struct nb_cloud_depth_query {
    double place[3];
    nb_cloud_resolution grain;
    int is_alike;
    nb_cloud_depths depths;
} nb_cloud_depth_query;

/* Of so many at most, whose first steps towards the sun fill the lanes of a look. */
enum { NB_CLOUD_ASKED = 3 };
void nb_cloud_find_depths(nebel_cloud_workspace *workspace, int n, nb_cloud_depth_query asked[]);
/* That to the sun, from nodes that are about `width` apart. */
float nb_cloud_sun_depth_at(nebel_cloud_workspace *workspace, const double place[3], float width);

/* What part of light comes through a layer and those above to its base straight over or under a place, as a mean over a width:
 * of the sun's, and from straight above. */
typedef struct nb_cloud_cover_transmittance {
    float sun, up;
} nb_cloud_cover_transmittance;

nb_cloud_cover_transmittance nb_cloud_roof_at(nebel_cloud_workspace *workspace, int layer, const double place[3],
                                              float width);

/* Where a ray meets the ground; HUGE_VAL: nowhere. */
double nb_cloud_to_ground(double radius, const double from[3], const double unit[3]);

/* What comes through a layer of sunlight whose way through it is so deep, straight or scattered; the sun's cosine to straight up. */
float nb_cloud_part_through(const nb_cloud_layer *layer, float depth, double sun);

/* Nodes of lattices are as far apart as a layer takes to become dense from its ends on, and depths that are linear between them
 * are too deep there by far: no cloud up or down is denser than its layer's. Only where no other layer lies that way. */
nb_cloud_depths nb_cloud_bound_depths(const nebel_cloud_lighting *view, int layer, double radius,
                                      const nb_cloud_depths *depths);

nb_cloud_irradiance nb_cloud_parts_of(const nb_cloud_layer *layer, const nb_cloud_depths *depths,
                                      const nb_cloud_sight *sight);

/* What a layer's drops send towards the eye, per unit of extinction. */
typedef struct nb_cloud_source {
    float once[3];    /* of sunlight, seen through all cloud between */
    float ahead[3];   /* of sunlight that goes on along the ray: what comes through all cloud on it */
    float often[3];   /* seen through what scatters it out of its way: see nb_cloud_ray's apart */
    float ambient[3]; /* of the sky and the ground; through all cloud */
} nb_cloud_source;

/* What is the same along a ray. */
typedef struct nb_cloud_ray {
    float phase[NEBEL_MAX_CLOUD_LAYERS][3],
        wide_phase[NEBEL_MAX_CLOUD_LAYERS][3]; /* towards the eye; wide: of what leads away */
    /* Of phase that part of light whose way to the sun is the rest of the ray, and how much of what a pixel sees that is; phase has the
     * other. */
    float ahead_phase[NEBEL_MAX_CLOUD_LAYERS][3], ahead;
    float
        own; /* how much what comes straight from the sun is that of a place's own way, where pixels hide cumulus cells, too */
    float apart[NEBEL_MAX_CLOUD_LAYERS]; /* what part of scattering leads away */
    double sun;                          /* cosine between ray and sun */
    double direction[3];
} nb_cloud_ray;

/* Of a pixel, so wide at a distance of 1. */
nb_cloud_ray nb_cloud_ray_make(const nebel_cloud_lighting *view, const double direction[3], double spread);

nb_cloud_source nb_cloud_source_of(const nb_cloud_ray *ray, int layer, const nb_cloud_irradiance *parts,
                                   const nb_cloud_light *light);

/* How much of light is of clouds that a pixel so wide hides: 0 to 1. Always 0 where hardly any cloud is in the layer. */
float nb_cloud_prefilter_part(nebel_cloud_workspace *workspace, int layer, float width);

/* Mean of places in a layer, by how much of each a ray sees that came into it, or began in it, at a part of its height. */
nb_cloud_irradiance nb_cloud_prefilter_at(nebel_cloud_workspace *workspace, int layer, const double up[3],
                                          const double ray[3], float entered);
nb_cloud_irradiance nb_cloud_mix_parts(const nb_cloud_irradiance *a, const nb_cloud_irradiance *b, float part);

#endif
