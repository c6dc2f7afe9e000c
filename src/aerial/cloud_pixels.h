/* Clouds through the pixels of a picture: a quarter of them have rays, others the mean of two beside them where all around are alike, else
 * rays of their own. By levels,
 *
 *     0 2 1 2 0 2 1 2
 *     1 2 0 2 1 2 0 2
 *
 * those of 0 have rays; those of 1 lie between four that are two columns or one row away, those of 2 between the columns of both. */
#ifndef NB_AERIAL_CLOUD_PIXELS_H
#define NB_AERIAL_CLOUD_PIXELS_H

#include <nebel/planet.h>

#include <math.h>

/* Pixels of a block share with each other: blocks begin at the picture's first row and column. */
enum {
    NB_CLOUD_PIXELS_COLUMNS = 64,
    NB_CLOUD_PIXELS_ROWS = 4,
    NB_CLOUD_SHARE = NB_CLOUD_PIXELS_COLUMNS * NB_CLOUD_PIXELS_ROWS,
    NB_CLOUD_PIXELS_LEVELS = 3,
    NB_CLOUD_PIXELS_AROUND = 6
};

/* Its pixels row by row. */
typedef struct nb_cloud_pixel_block {
    int is_wanted[NB_CLOUD_SHARE]; /* they need clouds */
    int is_open[NB_CLOUD_SHARE];   /* and end at no surface: in the sky, or on the planet's ground */
    float ground[NB_CLOUD_SHARE];  /* m, of the planet with clouds, through their middles; 0: they do not meet it */
    nebel_cloud_transfer *nodes[NB_CLOUD_SHARE]; /* and keep them here */
    int level[NB_CLOUD_SHARE];                   /* by nb_cloud_pixels_block_begin */
} nb_cloud_pixel_block;

/* How far apart transmittances around a pixel are at most, as a part of the largest or of LEAST_LEFT where that is more; and light, of
 * the brightest, or of that part of what it would be without gaps: the sky behind is bright as well. */
#define NB_MIN_CLOUD_LEFT 0.5f
#define NB_MIN_CLOUD_LIGHT 0.2f
static const float nb_cloud_pixels_alike[NB_CLOUD_PIXELS_LEVELS] = {0, 0.05f, 0.07f};

/* Where more than that comes through hardly any cloud is. */
#define NB_CLOUD_HARDLY 0.9f

/* ---- what is alike --------------------------------------------------------------------------- */

/* Of clouds up to t: what they leave, and the light of each colour. */
static inline void nb_cloud_pixels_up_to(const nebel_cloud_transfer *nodes, float t, float of[4])
{
    uint32_t k = 0;
    while (k < nodes->count && nodes->t[k] <= t) k++;
    const uint32_t a = k > 0 ? k - 1 : 0, b = k < nodes->count ? k : a;
    const float part = b > a ? (t - nodes->t[a]) / (nodes->t[b] - nodes->t[a]) : 0;
    of[0] = k > 0 ? (1 - part) * nodes->transmittance[a] + part * nodes->transmittance[b] : 1;
    for (int c = 0; c < 3; c++)
        of[c + 1] = k > 0 ? (1 - part) * nodes->in_scattering[a][c] + part * nodes->in_scattering[b][c] : 0;
}

/* The least and the largest of all that is left behind clouds, and of light. */
static inline void nb_cloud_pixels_bounds(const nebel_cloud_transfer *const around[NB_CLOUD_PIXELS_AROUND], int count,
                                          float low[4], float high[4])
{
    for (int i = 0; i < count; i++) {
        float of[4];
        nb_cloud_pixels_up_to(around[i], HUGE_VALF, of);
        for (int c = 0; c < 4; c++) {
            low[c] = i > 0 ? fminf(low[c], of[c]) : of[c];
            high[c] = i > 0 ? fmaxf(high[c], of[c]) : of[c];
        }
    }
}

/* How far apart transmittances are; HUGE_VALF: they or light are too far. */
static inline float nb_cloud_pixels_apart(const nebel_cloud_transfer *const around[NB_CLOUD_PIXELS_AROUND], int count,
                                          float most)
{
    float low[4], high[4], apart = 0, brightest = 0;
    nb_cloud_pixels_bounds(around, count, low, high);
    for (int c = 1; c < 4; c++) {
        apart = fmaxf(apart, high[c] - low[c]);
        brightest = fmaxf(brightest, high[c]);
    }
    const float whole = fmaxf(1, NB_MIN_CLOUD_LIGHT / fmaxf(1e-6f, 1 - low[0]));
    const int is_alike =
        high[0] - low[0] <= most * fmaxf(NB_MIN_CLOUD_LEFT, high[0]) && apart <= most * whole * brightest;
    return is_alike ? high[0] - low[0] : HUGE_VALF;
}

/* In the mean, at the nodes of that which has more, from where the first begins to where the last ends. */
static inline nebel_cloud_transfer nb_cloud_pixels_mean(const nebel_cloud_transfer *a, const nebel_cloud_transfer *b)
{
    const nebel_cloud_transfer *most = a->count < b->count ? b : a, *least = most == a ? b : a;
    const uint32_t end = most->count - 1;
    nebel_cloud_transfer mean = *most;
    mean.error = fmaxf(a->error, b->error);
    if (least->count > 0) {
        mean.t[0] = fminf(a->t[0], b->t[0]);
        mean.t[end] = fmaxf(most->t[end], least->t[least->count - 1]);
    }
    for (uint32_t k = 1; k < mean.count; k++) {
        float of[4], other[4];
        nb_cloud_pixels_up_to(most, mean.t[k], of);
        nb_cloud_pixels_up_to(least, mean.t[k], other);
        mean.transmittance[k] = 0.5f * (of[0] + other[0]);
        for (int c = 0; c < 3; c++) mean.in_scattering[k][c] = 0.5f * (of[c + 1] + other[c + 1]);
    }
    return mean;
}

/* ---- where they are -------------------------------------------------------------------------- */

static inline void nb_cloud_pixels_stretch(nebel_cloud_transfer *nodes, float times)
{
    for (uint32_t k = 0; k < nodes->count; k++) nodes->t[k] *= times;
}

/* How far from each other clouds begin and end along two rays. */
static inline float nb_cloud_pixels_shift(const nebel_cloud_transfer *a, float scale_a, const nebel_cloud_transfer *b,
                                          float scale_b)
{
    return fabsf(scale_a * a->t[0] - scale_b * b->t[0]) +
           fabsf(scale_a * a->t[a->count - 1] - scale_b * b->t[b->count - 1]);
}

/* Whether clouds of two rays that meet the ground lie at the same parts of the ways to it, rather than as far from the eye: seen
 * aslant from above a sheet is many of its heights nearer in one row than in the next, and what lies below it, fog and the ground, is as
 * well. By how far the ground is on each way, and between them. */
static inline int nb_cloud_pixels_is_by_ground(const nebel_cloud_transfer *a, float ground_a,
                                               const nebel_cloud_transfer *b, float ground_b, float ground)
{
    if (!(ground_a > 0 && ground_b > 0 && ground > 0)) return 0;
    if (a->count == 0 || b->count == 0 || a->t[a->count - 1] > ground || b->t[b->count - 1] > ground) return 1;
    return nb_cloud_pixels_shift(a, ground / ground_a, b, ground / ground_b) < nb_cloud_pixels_shift(a, 1, b, 1);
}

/* The mean of pixels a and b for pixel i, which is between them. */
static inline nebel_cloud_transfer nb_cloud_pixels_between(const nb_cloud_pixel_block *block, int i, int a, int b)
{
    nebel_cloud_transfer of_a = *block->nodes[a], of_b = *block->nodes[b];
    const float *const ground = block->ground;
    if (nb_cloud_pixels_is_by_ground(&of_a, ground[a], &of_b, ground[b], ground[i])) {
        nb_cloud_pixels_stretch(&of_a, ground[i] / ground[a]);
        nb_cloud_pixels_stretch(&of_b, ground[i] / ground[b]);
    }
    return nb_cloud_pixels_mean(&of_a, &of_b);
}

/* ---- a block --------------------------------------------------------------------------------- */

static inline int nb_cloud_pixels_level(int x, int y)
{
    return (x & 1) != 0 ? 2 : ((x >> 1) + y) & 1;
}

/* Pixels around one, as many as are in its block; 0: it or one of them needs no clouds or ends at a surface, or is not in its row, or
 * one alone meets the ground. */
static inline int nb_cloud_pixels_around(const nb_cloud_pixel_block *block, int i, int around[NB_CLOUD_PIXELS_AROUND])
{
    static const int counts[NB_CLOUD_PIXELS_LEVELS] = {0, 4, 6};
    static const int steps[NB_CLOUD_PIXELS_LEVELS][NB_CLOUD_PIXELS_AROUND][2] = {
        {{0}}, {{-2, 0}, {2, 0}, {0, -1}, {0, 1}}, {{-1, 0}, {1, 0}, {-1, -1}, {1, -1}, {-1, 1}, {1, 1}}};
    const int x = i % NB_CLOUD_PIXELS_COLUMNS, y = i / NB_CLOUD_PIXELS_COLUMNS, level = nb_cloud_pixels_level(x, y);
    int count = 0;
    if (!block->is_wanted[i] || !block->is_open[i]) return 0;
    for (int k = 0; k < counts[level]; k++) {
        const int column = x + steps[level][k][0], row = y + steps[level][k][1];
        if (row < 0 || row >= NB_CLOUD_PIXELS_ROWS) continue;
        if (column < 0 || column >= NB_CLOUD_PIXELS_COLUMNS) return 0;
        const int at = row * NB_CLOUD_PIXELS_COLUMNS + column;
        if (!block->is_wanted[at] || !block->is_open[at] || (block->ground[at] > 0) != (block->ground[i] > 0)) return 0;
        around[count++] = at;
    }
    return count;
}

/* Which pixels have a level but the first: the others have rays in any case. */
static inline void nb_cloud_pixels_block_begin(nb_cloud_pixel_block *block)
{
    int around[NB_CLOUD_PIXELS_AROUND];
    for (int i = 0; i < NB_CLOUD_SHARE; i++) {
        const int level = nb_cloud_pixels_level(i % NB_CLOUD_PIXELS_COLUMNS, i / NB_CLOUD_PIXELS_COLUMNS);
        block->level[i] = nb_cloud_pixels_around(block, i, around) > 0 ? level : 0;
    }
}

/* Whether hardly any cloud is along a ray but it is not far from some: others beside it may see puffs. */
static inline int nb_cloud_pixels_is_lone(const nebel_cloud_transfer *nodes)
{
    return nodes->density_queries > 0 &&
           (nodes->count == 0 || nodes->transmittance[nodes->count - 1] > NB_CLOUD_HARDLY);
}

/* Whether a pixel has the mean of two beside it, those above and below where they are nearer than left and right. */
static inline int nb_cloud_pixels_interpolate(const nb_cloud_pixel_block *block, int i)
{
    const int level = block->level[i];
    const nebel_cloud_transfer *nodes[NB_CLOUD_PIXELS_AROUND];
    int around[NB_CLOUD_PIXELS_AROUND];
    const int count = nb_cloud_pixels_around(block, i, around), first = level == 1 && count == 4 ? 2 : 0;
    for (int k = 0; k < count; k++) {
        nodes[k] = block->nodes[around[k]];
        if (nb_cloud_pixels_is_lone(nodes[k])) return 0;
    }
    const float apart = nb_cloud_pixels_apart(nodes, count, nb_cloud_pixels_alike[level]);
    if (!(apart < HUGE_VALF)) return 0;
    *block->nodes[i] = nb_cloud_pixels_between(block, i, around[first], around[first + 1]);
    block->nodes[i]->error += apart;
    return 1;
}

/* Pixels of a level, those before being known: they have what lies between others, or need a ray. */
static inline void nb_cloud_pixels_block_ask(const nb_cloud_pixel_block *block, int level, int is_asked[NB_CLOUD_SHARE])
{
    for (int i = 0; i < NB_CLOUD_SHARE; i++) {
        const int is_next = block->is_wanted[i] && block->level[i] == level;
        is_asked[i] = is_next && (level == 0 || !nb_cloud_pixels_interpolate(block, i));
    }
}

#endif
