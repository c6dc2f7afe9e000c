#include "sun_cell_occlusion.h"

#include <math.h>
#include <string.h>

/* Depth rises by so much along both axes of the plane; infinite where the sun passes along the triangle. */
static void slope_of(const nb_occluder *t, double slope[2])
{
    double a[3], b[3];
    for (int i = 0; i < 3; i++) {
        a[i] = (double)t->corner[1][i] - (double)t->corner[0][i];
        b[i] = (double)t->corner[2][i] - (double)t->corner[0][i];
    }
    const double area = a[0] * b[1] - a[1] * b[0];
    slope[0] = (a[2] * b[1] - a[1] * b[2]) / area;
    slope[1] = (a[0] * b[2] - a[2] * b[0]) / area;
}

static int is_within(const nb_sun_cell *a, const nb_sun_cell *b)
{
    return (a->low[0] >= b->low[0]) & (a->high[0] <= b->high[0]) & (a->low[1] >= b->low[1]) &
           (a->high[1] <= b->high[1]);
}

nb_occlusion_depths nb_depths_in(const nb_occluder *t, const nb_sun_cell *bounds, const nb_sun_cell *cell)
{
    const float a = t->corner[0][2], b = t->corner[1][2], c = t->corner[2][2];
    const float least = nb_least(nb_least(a, b), c), most = nb_most(nb_most(a, b), c);
    double slope[2], middle = (double)a, reach = 0;
    if (is_within(bounds, cell)) return (nb_occlusion_depths){least, most};
    slope_of(t, slope);
    for (int i = 0; i < 2; i++) {
        const double low = (double)nb_most(bounds->low[i], cell->low[i]);
        const double high = (double)nb_least(bounds->high[i], cell->high[i]);
        middle += slope[i] * (0.5 * (low + high) - (double)t->corner[0][i]);
        reach += fabs(slope[i]) * 0.5 * (high - low);
    }
    const double rounding = 1e-6 * (fabs(middle) + reach);
    if (!(reach < 1e30)) return (nb_occlusion_depths){least, most};
    const float near = nb_most(least, (float)(middle - reach - rounding));
    const float far = nb_least(most, (float)(middle + reach + rounding));
    return near < far ? (nb_occlusion_depths){near, far} : (nb_occlusion_depths){far, near};
}

/* ---- edges ----------------------------------------------------------------------------------- */

/* Steele, Lea and Flood, Fast Splittable Pseudorandom Number Generators, 2014: every bit of the input reaches every bit
 * of the result. */
static uint64_t mixed(uint64_t bits)
{
    bits = (bits ^ bits >> 30) * 0xbf58476d1ce4e5b9u;
    bits = (bits ^ bits >> 27) * 0x94d049bb133111ebu;
    return bits ^ bits >> 31;
}

static uint64_t hash_of(const float corner[3], uint64_t seed)
{
    for (int i = 0; i < 3; i++) {
        const float x = corner[i] + 0.0f; /* one zero of both */
        uint32_t bits;
        memcpy(&bits, &x, sizeof bits);
        seed = mixed(seed + 0x9e3779b97f4a7c15u + bits);
    }
    return seed;
}

/* An edge as it lies to a cell. */
typedef struct nb_passage {
    int touches, is_left; /* the place is to the left of the way along the edge */
} nb_passage;

/* The same for both ways along it, but that the place is to the left of one of them. `reach` has half the sides of the
 * cell, `place` is its middle. */
static nb_passage pass_edge(const float a[3], const float b[3], const double place[2], const double reach[2])
{
    const int forward = nb_comes_first(a, b);
    const float *p = forward ? a : b, *q = forward ? b : a;
    const double x = (double)q[0] - (double)p[0], y = (double)q[1] - (double)p[1];
    const double to_x = place[0] - (double)p[0], to_y = place[1] - (double)p[1];
    const double off = x * to_y - y * to_x, most = (fabs(x) * reach[1] + fabs(y) * reach[0]) * (1 + 1e-9);
    const int beside = (fabs(2 * to_x - x) > fabs(x) + 2 * reach[0]) | (fabs(2 * to_y - y) > fabs(y) + 2 * reach[1]);
    return (nb_passage){!beside & (fabs(off) <= most), (off >= 0) == forward};
}

/* ---- layers ---------------------------------------------------------------------------------- */

typedef struct nb_occlusion_layer {
    float farthest;
    int passes;     /* how often it passes over a place of the cell */
    uint64_t edges; /* what is left of them */
} nb_occlusion_layer;

static void add_occluder(const nb_occluder *t, const double place[2], const double reach[2], nb_occlusion_layer *layer)
{
    int left = 0;
    for (int k = 0; k < 3; k++) {
        const float *a = t->corner[k], *b = t->corner[(k + 1) % 3];
        const nb_passage edge = pass_edge(a, b, place, reach);
        left += edge.is_left;
        if (!edge.touches) continue;
        const int forward = nb_comes_first(a, b);
        const uint64_t hash = forward ? hash_of(b, hash_of(a, 0)) : hash_of(a, hash_of(b, 0));
        layer->edges += forward ? hash : 0 - hash;
    }
    layer->passes += (left == 3) - (left == 0);
}

static void sort_by_depth(const nb_occlusion_depths *depths, size_t count, uint8_t *order)
{
    for (size_t i = 0; i < count; i++) {
        size_t k = i;
        for (; k > 0 && depths[order[k - 1]].nearest > depths[i].nearest; k--) order[k] = order[k - 1];
        order[k] = (uint8_t)i;
    }
}

float nb_covered_from(const nb_occluders *casters, const uint32_t *list, const nb_occlusion_depths *depths,
                      size_t count, const nb_sun_cell *cell)
{
    uint8_t order[NB_MAX_COVER];
    double place[2], reach[2];
    if (count > NB_MAX_COVER) return INFINITY;
    sort_by_depth(depths, count, order);
    for (int i = 0; i < 2; i++) {
        place[i] = 0.5 * ((double)cell->low[i] + (double)cell->high[i]);
        reach[i] = 0.5 * ((double)cell->high[i] - (double)cell->low[i]);
    }
    nb_occlusion_layer layer = {-INFINITY, 0, 0};
    for (size_t i = 0; i < count; i++) {
        const nb_occlusion_depths *next = &depths[order[i]];
        if (nb_has_holes(casters, list[order[i]])) continue;
        if (next->nearest > layer.farthest) {
            if (layer.passes != 0 && layer.edges == 0) return layer.farthest;
            layer = (nb_occlusion_layer){-INFINITY, 0, 0};
        }
        add_occluder(&casters->triangles[list[order[i]]], place, reach, &layer);
        layer.farthest = nb_most(layer.farthest, next->farthest);
    }
    return layer.passes != 0 && layer.edges == 0 ? layer.farthest : INFINITY;
}
