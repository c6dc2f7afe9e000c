/* Clouds with volume among air and fog along a ray, from node to node: between two of them transmittances count as their mean. */
#ifndef NB_AERIAL_CLOUD_COMPOSE_H
#define NB_AERIAL_CLOUD_COMPOSE_H

#include <nebel/planet.h>

#include <math.h>

/* What air and fog do up to each node. */
typedef struct nb_aerial_nodes {
    float left[3][NEBEL_MAX_CLOUD_NODES], light[3][NEBEL_MAX_CLOUD_NODES];
} nb_aerial_nodes;

/* What is asked of the air of a ray: many rays in one direction, up to nodes->t. */
typedef struct nb_cloud_air_rays {
    double along[3][NEBEL_MAX_CLOUD_NODES];
    const double *direction[3];
    nebel_transfer_planes transfers; /* of the haze */
} nb_cloud_air_rays;

static inline void nb_cloud_compose_ask(const nebel_cloud_transfer *nodes, const double direction[3],
                                        nb_aerial_nodes *haze, nb_cloud_air_rays *rays)
{
    rays->transfers = (nebel_transfer_planes){.error = NULL};
    for (int c = 0; c < 3; c++) {
        for (uint32_t k = 0; k < nodes->count; k++) rays->along[c][k] = direction[c];
        rays->direction[c] = rays->along[c];
        rays->transfers.transmittance[c] = haze->left[c];
        rays->transfers.in_scattering[c] = haze->light[c];
    }
}

/* What fog and air do up to some of the nodes: the first, the last, and those between them where it matters. */
typedef struct nb_cloud_fog_nodes {
    int is_set[NEBEL_MAX_CLOUD_NODES];
    nb_aerial_nodes haze;
} nb_cloud_fog_nodes;

/* Of one colour: what fog leaves up to node k, where that is known. */
static inline float nb_cloud_fog_left(const nb_cloud_fog_nodes *marks, const nb_aerial_nodes *air, int c, uint32_t k)
{
    return air->left[c][k] > 0 ? marks->haze.left[c][k] / air->left[c][k] : 0;
}

/* Of one colour, what fog adds to light from node a to node b, less what it takes of the air's behind it. */
static inline float nb_cloud_fog_light(const nb_cloud_fog_nodes *marks, const nb_aerial_nodes *air, int c, uint32_t a,
                                       uint32_t b)
{
    return marks->haze.light[c][b] - marks->haze.light[c][a] -
           nb_cloud_fog_left(marks, air, c, a) * (air->light[c][b] - air->light[c][a]);
}

/* How far off light up to the last node may be, as nothing is known of where fog lies between nodes a and b: it counts as spread
 * evenly. Let T and S be transmittance and light of clouds (c), air (a) and fog (f). What fog adds is the integral of T_a dS_f, at
 * most what is found of it and what is found to be missing of the air's, (T_f(a) - T_f(b)) dS_a; all of either lies somewhere between
 * T_c(a) and T_c(b). What fog takes of clouds is within (T_f(a) - T_f(b)) T_a dS_c. */
static inline float nb_cloud_compose_doubt(const nebel_cloud_transfer *nodes, const nb_cloud_fog_nodes *marks,
                                           const nb_aerial_nodes *air, uint32_t a, uint32_t b)
{
    const float fallen = nodes->transmittance[a] - nodes->transmittance[b];
    float most = 0;
    for (int c = 0; c < 3; c++) {
        const float gone = fabsf(nb_cloud_fog_left(marks, air, c, a) - nb_cloud_fog_left(marks, air, c, b));
        const float haze =
            fabsf(nb_cloud_fog_light(marks, air, c, a, b)) + 2 * gone * fabsf(air->light[c][b] - air->light[c][a]);
        const float cloud = gone * air->left[c][a] * fabsf(nodes->in_scattering[b][c] - nodes->in_scattering[a][c]);
        most = fmaxf(most, fallen * haze + cloud);
    }
    return most;
}

/* The two neighbouring marks between which most is in doubt: *a and *b. Returns all doubts. */
static inline float nb_cloud_compose_worst(const nebel_cloud_transfer *nodes, const nb_cloud_fog_nodes *marks,
                                           const nb_aerial_nodes *air, uint32_t *a, uint32_t *b)
{
    float all = 0, most = -1;
    uint32_t before = 0;
    *a = *b = 0;
    for (uint32_t k = 1; k < nodes->count; k++) {
        if (!marks->is_set[k]) continue;
        const float is = nb_cloud_compose_doubt(nodes, marks, air, before, k);
        all += is;
        if (is > most) {
            most = is;
            *a = before;
            *b = k;
        }
        before = k;
    }
    return all;
}

static inline void nb_cloud_mark(nb_cloud_fog_nodes *marks, uint32_t k, const float left[3], const float light[3])
{
    marks->is_set[k] = 1;
    for (int c = 0; c < 3; c++) {
        marks->haze.left[c][k] = left[c];
        marks->haze.light[c][k] = light[c];
    }
}

/* The next node to mark, between a and b: where no node is, one is put in the middle, where clouds are as between both and air is not
 * yet known. 0: no more can be had. */
static inline uint32_t nb_cloud_compose_cut(uint32_t a, uint32_t b, nebel_cloud_transfer *nodes,
                                            nb_cloud_fog_nodes *marks)
{
    const float middle = 0.5f * (nodes->t[a] + nodes->t[b]);
    if (b > a + 1) return (a + b) / 2;
    if (nodes->count == NEBEL_MAX_CLOUD_NODES || !(middle > nodes->t[a] && middle < nodes->t[b])) return 0;
    for (uint32_t k = nodes->count++; k > b; k--) {
        nodes->t[k] = nodes->t[k - 1];
        nodes->transmittance[k] = nodes->transmittance[k - 1];
        marks->is_set[k] = marks->is_set[k - 1];
        for (int c = 0; c < 3; c++) {
            nodes->in_scattering[k][c] = nodes->in_scattering[k - 1][c];
            marks->haze.left[c][k] = marks->haze.left[c][k - 1];
            marks->haze.light[c][k] = marks->haze.light[c][k - 1];
        }
    }
    nodes->t[b] = middle;
    nodes->transmittance[b] = 0.5f * (nodes->transmittance[a] + nodes->transmittance[b + 1]);
    for (int c = 0; c < 3; c++)
        nodes->in_scattering[b][c] = 0.5f * (nodes->in_scattering[a][c] + nodes->in_scattering[b + 1][c]);
    marks->is_set[b] = 0;
    return b;
}

/* The node to mark next: the first, the last, then others while light is in doubt by more than the tolerance, times light where that
 * is more than 1. -1: none. air need not be known up to a node that is new, which makes nodes one more. *doubt: what is left. */
static inline int nb_cloud_compose_next(nebel_cloud_transfer *nodes, nb_cloud_fog_nodes *marks,
                                        const nb_aerial_nodes *air, float tolerance, float *doubt)
{
    const uint32_t last = nodes->count - 1;
    float brightest = 1;
    uint32_t a, b;
    *doubt = 0;
    if (!marks->is_set[0]) return 0;
    if (!marks->is_set[last]) return (int)last;
    for (int c = 0; c < 3; c++) brightest = fmaxf(brightest, marks->haze.light[c][last]);
    *doubt = nb_cloud_compose_worst(nodes, marks, air, &a, &b);
    if (!(*doubt > tolerance * brightest)) return -1;
    const uint32_t next = nb_cloud_compose_cut(a, b, nodes, marks);
    return next > 0 ? (int)next : -1;
}

/* Of one colour, what air and fog do up to each node: between two marks fog counts as spread evenly over the way. */
static inline void nb_cloud_compose_add_fog(const nebel_cloud_transfer *nodes, const nb_cloud_fog_nodes *marks, int c,
                                            const nb_aerial_nodes *air, nb_aerial_nodes *haze)
{
    haze->left[c][0] = marks->haze.left[c][0];
    haze->light[c][0] = marks->haze.light[c][0];
    for (uint32_t a = 0, b = 1; b < nodes->count; b++) {
        if (!marks->is_set[b]) continue;
        const float from = nb_cloud_fog_left(marks, air, c, a), to = nb_cloud_fog_left(marks, air, c, b);
        const float more = nb_cloud_fog_light(marks, air, c, a, b), way = nodes->t[b] - nodes->t[a];
        for (uint32_t k = a + 1; k <= b; k++) {
            const float part = way > 0 ? (nodes->t[k] - nodes->t[a]) / way : 0;
            haze->left[c][k] = air->left[c][k] * (from + part * (to - from));
            haze->light[c][k] = marks->haze.light[c][a] + from * (air->light[c][k] - air->light[c][a]) + part * more;
        }
        a = b;
    }
}

/* Of one colour, the light up to each node, without what of the haze before it clouds leave. */
static inline void nb_cloud_compose_sum(const nebel_cloud_transfer *nodes, int c, const nb_aerial_nodes *haze,
                                        float over[NEBEL_MAX_CLOUD_NODES])
{
    float sum = haze->light[c][0];
    over[0] = 0;
    for (uint32_t k = 1; k < nodes->count; k++) {
        sum += 0.5f * (haze->left[c][k] + haze->left[c][k - 1]) *
               (nodes->in_scattering[k][c] - nodes->in_scattering[k - 1][c]);
        sum += 0.5f * (nodes->transmittance[k] + nodes->transmittance[k - 1]) *
               (haze->light[c][k] - haze->light[c][k - 1]);
        over[k] = sum - nodes->transmittance[k] * haze->light[c][k];
    }
}

/* By how much light up to the last node may be off at most, of the colour that is worst, as transmittances between two nodes count as
 * their mean: both fall all the way, and light may all come from where either begins. */
static inline float nb_cloud_compose_missed(const nebel_cloud_transfer *nodes, const nb_aerial_nodes *haze)
{
    float most = 0;
    for (int c = 0; c < 3; c++) {
        float sum = 0;
        for (uint32_t k = 1; k < nodes->count; k++) {
            sum += 0.5f * fabsf(haze->left[c][k - 1] - haze->left[c][k]) *
                   fabsf(nodes->in_scattering[k][c] - nodes->in_scattering[k - 1][c]);
            sum += 0.5f * fabsf(nodes->transmittance[k - 1] - nodes->transmittance[k]) *
                   fabsf(haze->light[c][k] - haze->light[c][k - 1]);
        }
        most = fmaxf(most, sum);
    }
    return most;
}

/* How far the ray through the middle of a pixel is followed for a sample that ends on the ground: not to where that does, for
 * seen aslant from far above its ground may lie before the other's clouds, but to the ground, or as near as it comes to it. */
static inline double nb_cloud_ground_end(const double center[3], const double eye[3], const double unit[3], double end)
{
    double nearest = 0;
    for (int c = 0; c < 3; c++) nearest += (center[c] - eye[c]) * unit[c];
    return fmax(end, nearest);
}

/* Whether nodes that were found up to `reach` do for a ray that ends elsewhere: it goes no farther, and ends before clouds, behind them
 * or near where that did. Between two nodes clouds are a straight line, which shows on surfaces. */
static inline int nb_cloud_is_found(uint32_t count, float first, float last, float reach, float end)
{
    if (end > reach) return 0;
    return count == 0 || end <= first || end >= fminf(0.98f * reach, last);
}

/* The node before a surface, and the part of the way to the next one; behind the last one that. The surface is behind the
 * first. */
static inline uint32_t nb_cloud_compose_find(uint32_t count, const float *t, float end, float *part)
{
    uint32_t k = count - 1;
    *part = 0;
    if (!(end < t[k])) return k;
    while (k > 0 && t[k] > end) k--;
    *part = (end - t[k]) / (t[k + 1] - t[k]);
    return k;
}

#endif
