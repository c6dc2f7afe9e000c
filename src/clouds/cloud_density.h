/* The density of a layer's clouds at several places at once, one kernel per instruction set: see docs/clouds.md for the formula. */
#ifndef NB_CLOUDS_CLOUD_DENSITY_H
#define NB_CLOUDS_CLOUD_DENSITY_H

#include "clouds.h"

#include "math/hash.h"

enum { NB_CLOUD_LANES = 16 };

/* A grid of columns on a face of the cube: level 0 is as it is; each next one twice as wide. Never 0. */
static inline uint32_t nb_cloud_grid_key(int layer, int level, int face)
{
    return UINT32_C(0x80000000) | (uint32_t)(level * NEBEL_MAX_CLOUD_LAYERS + layer) << 3 | (uint32_t)face;
}

/* Where a table has a point, cell or block of a grid: 4 x 4 neighbours lie one behind the other, and share lines of the processor's
 * cache. */
static inline uint32_t nb_cloud_grid_hash(uint32_t key, int32_t x, int32_t y)
{
    const uint32_t tile_x = (uint32_t)x >> 2, tile_y = (uint32_t)y >> 2;
    const uint32_t tile = nb_mix_bits(key + tile_x * UINT32_C(0x9e3779b1) + tile_y * UINT32_C(0x85ebca77));
    return tile << 4 | ((uint32_t)y & 3) << 2 | ((uint32_t)x & 3);
}

/* The first grid of two for a width, and how far to the next; numbers are held to the last grid but one. */
static inline float nb_cloud_grid_level(float grid, float width)
{
    return nb_level_of(nb_smaller(2 * width / grid, (float)(1U << (NB_CLOUD_GRIDS - 2))));
}

/* Grids blend over the last quarter of the way to the next one; from grid 4 on, a third of a cumulus cell wide, where
 * cumulus cells fade, over all of it: they would end at a line across pictures. */
enum { NB_CLOUD_FADING = 4 };

/* The next grid's part. */
static inline float nb_cloud_next_part(float level, int32_t low)
{
    const float times = low < NB_CLOUD_FADING ? 4 : 1;
    return nb_larger(0, 1 - times * (1 - (level - (float)low)));
}

/* Cells of grids. */
typedef struct nb_cloud_cells {
    uint32_t key[NB_CLOUD_LANES], hash[NB_CLOUD_LANES];
    int32_t x[NB_CLOUD_LANES], y[NB_CLOUD_LANES];
    float u[NB_CLOUD_LANES], v[NB_CLOUD_LANES]; /* parts of the way to the next point */
} nb_cloud_cells;

/* Places, and what is there; behind `count` are places that do not matter. */
struct nb_cloud_density_query {
    int count;
    int are_of_rays;                 /* then `way` is asked, too, and `hidden` is found */
    double place[3][NB_CLOUD_LANES]; /* from the planet's centre, in the layer's axes */
    double way[3][NB_CLOUD_LANES];   /* a ray's direction there */
    float width[NB_CLOUD_LANES];     /* m: what is narrower is seen as a mean */
    float hidden[NB_CLOUD_LANES];    /* m: how long that is along a ray; up to 0: not at all */

    /* By find_places. */
    double radius[NB_CLOUD_LANES];
    float height[NB_CLOUD_LANES]; /* part of the layer's: cloud may be where it is within 0 and 1 */
    float climb[NB_CLOUD_LANES];  /* of rays: cosine to straight up */
    nb_cloud_cells cells[2];      /* in the grid below a width, and in the next where that counts */
    float next[NB_CLOUD_LANES];   /* the part of that */
    float parts[NB_CLOUD_WORLEY_SCALES][3][NB_CLOUD_LANES]; /* of a period of each scale of Worley noise */

    /* The places' columns: asked of whoever keeps them. */
    float rank[NB_CLOUD_LANES], scale[NB_CLOUD_LANES], variance[NB_CLOUD_LANES];

    /* By find_drops, 1/m: what extinction lets as much through as the mean of all that is hidden; 0 where no cloud is. Where half
     * of it is cloud half of the light comes through, however thick that is. */
    float whole[NB_CLOUD_LANES];
    /* Of rays: the same of what leads away; the mean of extinction, weighted by what it lets through; where no cloud is, how far there
     * is none ahead as far as slopes of noise say, m. */
    float apart[NB_CLOUD_LANES], passed[NB_CLOUD_LANES], clear[NB_CLOUD_LANES];
};

/* In this order, with the columns between; number: of the layer. The same bits for every instruction set, and for every place
 * whatever the others are. */
typedef void nb_cloud_places_fn(const nb_cloud_layer *layer, int number, nb_cloud_density_query *looks);
typedef void nb_cloud_drops_fn(const nb_cloud_noise *noise, const nb_cloud_layer *layer, nb_cloud_density_query *looks);

nb_cloud_places_fn nb_cloud_find_places_scalar, nb_cloud_find_places_sse2, nb_cloud_find_places_avx2,
    nb_cloud_find_places_avx512, nb_cloud_find_places_neon;
nb_cloud_drops_fn nb_cloud_find_drops_scalar, nb_cloud_find_drops_sse2, nb_cloud_find_drops_avx2,
    nb_cloud_find_drops_avx512, nb_cloud_find_drops_neon;

struct nb_cloud_kernel {
    nb_cloud_places_fn *find_places;
    nb_cloud_drops_fn *find_drops;
};

/* NULL: this build or processor has not got it. */
const nb_cloud_kernel *nb_cloud_kernel_choose(nebel_isa isa);

/* Makes places behind `count` like the first, so that all are places. */
static inline void nb_cloud_fill_lanes(nb_cloud_density_query *looks)
{
    for (int i = looks->count; i < NB_CLOUD_LANES; i++) {
        for (int c = 0; c < 3; c++) looks->place[c][i] = looks->place[c][0];
        for (int c = 0; c < 3 && looks->are_of_rays; c++) looks->way[c][i] = looks->way[c][0];
        looks->width[i] = looks->width[0];
        if (!looks->are_of_rays) looks->hidden[i] = looks->hidden[0];
    }
}

/* Outside of a layer there is no cloud. */
static inline int nb_cloud_is_in_layer(const nb_cloud_density_query *looks, int lane)
{
    return looks->height[lane] > 0 && looks->height[lane] < 1;
}

/* What counts where no column is asked: no cloud. */
static inline void nb_cloud_set_no_columns(nb_cloud_density_query *looks)
{
    for (int i = 0; i < NB_CLOUD_LANES; i++) {
        looks->rank[i] = -1;
        looks->scale[i] = looks->variance[i] = 0;
    }
}

#endif
