#include "screen_bounds.h"

#include "math/vector.h"

#include <string.h>

/* Rectangles grow by this many pixels on every side: more than triangles do when they are rasterized. */
static const double slack = 0x1p-12;

/* ---- the view -------------------------------------------------------------------------------- */

/* The inverse of the matrix with the columns a, b, c: what gives the weights of a, b and c in a point. */
static void invert(const double a[3], const double b[3], const double c[3], double rows[3][3])
{
    nb_vector_cross(b, c, rows[0]);
    nb_vector_cross(c, a, rows[1]);
    nb_vector_cross(a, b, rows[2]);
    const double determinant = nb_vector_dot(a, rows[0]);
    for (int i = 0; i < 3; i++) {
        for (int k = 0; k < 3; k++) rows[i][k] /= determinant;
    }
}

/* Perspective: point - camera = w (corner + x / w step_x + y / w step_y).
 * Orthographic: point - camera = corner + x step_x + y step_y + depth forward. */
void nb_projection_set(nb_projection *projection, const nb_view *view)
{
    projection->orthographic = view->projection == NEBEL_PROJECTION_ORTHOGRAPHIC;
    invert(view->step_x, view->step_y, projection->orthographic ? view->axes.forward : view->corner, projection->rows);
    for (int i = 0; i < 3; i++) {
        projection->shift[i] = -view->start[i] - (projection->orthographic ? view->corner[i] : 0);
    }
}

/* ---- vertices -------------------------------------------------------------------------------- */

enum { PIECE = 256, EVERYWHERE = INT16_MAX };

/* The ends of some vertices. */
typedef struct nb_screen_ends {
    int x0[PIECE], y0[PIECE], x1[PIECE], y1[PIECE];
} nb_screen_ends;

static inline double limit(double x, double low, double high)
{
    const double above = x > low ? x : low;
    return above < high ? above : high;
}

/* The first pixel that a triangle with its leftmost corner at x may show. Rounds up, or one more, which `slack` allows;
 * the pixel after the last one where it shows none. */
static inline int first_pixel(double x, double last)
{
    return (int)(limit(x, -1, last + .5) + 2) - 1;
}

/* The last one where the rightmost corner is at x; -1 where it shows none. */
static inline int last_pixel(double x, double last)
{
    return (int)(limit(x, -1, last) + 1) - 1;
}

/* EVERYWHERE behind the camera's plane: a triangle that crosses it may lie anywhere. */
NB_CLONES static void project_vertices(const nb_projection *projection, const nb_raster_target *picture,
                                       const float *restrict positions, size_t count, nb_screen_ends *restrict ends)
{
    const double(*rows)[3] = projection->rows, *shift = projection->shift;
    const double ax = rows[0][0], ay = rows[0][1], az = rows[0][2], bx = rows[1][0], by = rows[1][1], bz = rows[1][2];
    const double cx = rows[2][0], cy = rows[2][1], cz = rows[2][2], sx = shift[0], sy = shift[1], sz = shift[2];
    const double right = picture->width - 1, bottom = picture->height - 1;
    const double before = slack + (double)picture->range.high, after = slack - (double)picture->range.low;
    const int orthographic = projection->orthographic;
    NB_SIMD
    for (size_t v = 0; v < count; v++) {
        const double px = (double)positions[3 * v] + sx, py = (double)positions[3 * v + 1] + sy;
        const double pz = (double)positions[3 * v + 2] + sz;
        const double depth = cx * px + cy * py + cz * pz, w = orthographic ? 1 : depth, scale = 1 / w;
        const double x = (ax * px + ay * py + az * pz) * scale, y = (bx * px + by * py + bz * pz) * scale;
        const int before_camera = w > 0;
        ends->x0[v] = before_camera ? -first_pixel(x - before, right) : EVERYWHERE;
        ends->y0[v] = before_camera ? -first_pixel(y - before, bottom) : EVERYWHERE;
        ends->x1[v] = before_camera ? last_pixel(x + after, right) : EVERYWHERE;
        ends->y1[v] = before_camera ? last_pixel(y + after, bottom) : EVERYWHERE;
    }
}

NB_CLONES static void pack_ends(const nb_screen_ends *restrict ends, size_t count, int16_t *restrict packed)
{
    NB_SIMD
    for (size_t v = 0; v < count; v++) {
        packed[4 * v] = (int16_t)ends->x0[v];
        packed[4 * v + 1] = (int16_t)ends->y0[v];
        packed[4 * v + 2] = (int16_t)ends->x1[v];
        packed[4 * v + 3] = (int16_t)ends->y1[v];
    }
}

static void project_surface(const nb_projection *projection, const nb_raster_target *picture,
                            const nb_batch_surface *surface)
{
    const size_t count = surface->mesh->vertex_count;
#pragma omp for schedule(static) nowait
    for (size_t first = 0; first < count; first += PIECE) {
        const size_t number = count - first < PIECE ? count - first : PIECE;
        nb_screen_ends ends;
        project_vertices(projection, picture, surface->positions + 3 * first, number, &ends);
        pack_ends(&ends, number, surface->ends + 4 * first);
    }
}

/* ---- rectangles ------------------------------------------------------------------------------ */

static inline void enlarge_bounds(const int16_t *restrict by, int16_t *restrict ends)
{
    NB_SIMD
    for (int i = 0; i < 4; i++) ends[i] = by[i] > ends[i] ? by[i] : ends[i];
}

static void set_nothing(int16_t *ends)
{
    for (int i = 0; i < 4; i++) ends[i] = INT16_MIN;
}

/* Around one triangle. */
static inline void set_ends(const int16_t *restrict a, const int16_t *restrict b, const int16_t *restrict c,
                            int16_t *restrict ends)
{
    static const int16_t nothing[4] = {INT16_MIN, INT16_MIN, INT16_MIN, INT16_MIN};
    int16_t around[4];
    memcpy(around, a, sizeof around);
    enlarge_bounds(b, around);
    enlarge_bounds(c, around);
    const int is_behind = (a[0] == EVERYWHERE) & (b[0] == EVERYWHERE) & (c[0] == EVERYWHERE);
    const int shows = (around[0] + around[2] >= 0) & (around[1] + around[3] >= 0) & !is_behind;
    uint64_t chosen, other; /* four ends at once */
    memcpy(&chosen, around, sizeof chosen);
    memcpy(&other, nothing, sizeof other);
    chosen = shows ? chosen : other;
    memcpy(ends, &chosen, sizeof chosen);
}

static void set_leaf(const nb_batch_surface *surface, uint32_t first, nb_node *leaf)
{
    const uint32_t left = surface->mesh->triangle_count - first, count = left < NB_FAN ? left : NB_FAN;
    const uint32_t *index = surface->mesh->indices + 3 * (size_t)first;
    const int16_t *ends = surface->ends;
    for (uint32_t k = 0; k < count; k++, index += 3) {
        set_ends(ends + 4 * (size_t)index[0], ends + 4 * (size_t)index[1], ends + 4 * (size_t)index[2],
                 leaf->ends + 4 * k);
    }
    for (uint32_t k = count; k < NB_FAN; k++) set_nothing(leaf->ends + 4 * k);
}

/* Around `count` nodes of the level below. */
static void set_screen_node(const nb_node *below, size_t count, nb_node *node)
{
    for (size_t k = 0; k < NB_FAN; k++) {
        int16_t around[4];
        set_nothing(around);
        for (size_t i = 0; i < NB_FAN && k < count; i++) enlarge_bounds(below[k].ends + 4 * i, around);
        memcpy(node->ends + 4 * k, around, sizeof around);
    }
}

static void set_level(nb_geometry *geometry, int level)
{
    const size_t count = geometry->node_counts[level], below = geometry->node_counts[level - 1];
#pragma omp for schedule(static)
    for (size_t i = 0; i < count; i++) {
        const size_t left = below - i * NB_FAN;
        set_screen_node(geometry->levels[level - 1] + i * NB_FAN, left < NB_FAN ? left : NB_FAN,
                        &geometry->levels[level][i]);
    }
}

void nb_project_geometry(const nb_projection *projection, const nb_raster_target *picture, nb_geometry *geometry,
                         int threads)
{
#pragma omp parallel num_threads(threads)
    {
        for (size_t s = 0; s < geometry->surface_count; s++) {
            project_surface(projection, picture, &geometry->surfaces[s]);
        }
#pragma omp barrier
#pragma omp for schedule(static)
        for (size_t i = 0; i < geometry->node_counts[0]; i++) {
            const nb_batch_surface *surface = &geometry->surfaces[geometry->owners[i]];
            set_leaf(surface, (uint32_t)(i * NB_FAN) - surface->first_id, &geometry->levels[0][i]);
        }
        for (int level = 1; level < geometry->level_count; level++) set_level(geometry, level);
    }
}
