#include "raster.h"

#include <math.h>

/* Triangles grow by this many pixels on every side: more than the rounding errors of their edge functions in float,
 * which leave a gap where many triangles meet in one point of the picture; far less than anybody sees. */
static const double growth = 0x1p-14;

/* Rectangles grow by more. */
static const double slack = 0x1p-12;

int nb_raster_is_apt(const nb_geometry *geometry, nebel_projection projection, uint32_t width, uint32_t height)
{
    if (projection == NEBEL_PROJECTION_PANORAMA || geometry->scene == NULL) return 0;
    return geometry->cluster_count * NB_CLUSTER <= (size_t)width * height;
}

/* ---- the view -------------------------------------------------------------------------------------------------------
 */

static void cross(const double a[3], const double b[3], double out[3])
{
    out[0] = a[1] * b[2] - a[2] * b[1];
    out[1] = a[2] * b[0] - a[0] * b[2];
    out[2] = a[0] * b[1] - a[1] * b[0];
}

static double dot(const double a[3], const double b[3])
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

/* The inverse of the matrix with the columns a, b, c: what gives the weights of a, b and c in a point. */
static void invert(const double a[3], const double b[3], const double c[3], double rows[3][3])
{
    cross(b, c, rows[0]);
    cross(c, a, rows[1]);
    cross(a, b, rows[2]);
    const double determinant = dot(a, rows[0]);
    for (int i = 0; i < 3; i++) {
        for (int k = 0; k < 3; k++) rows[i][k] /= determinant;
    }
}

/* Perspective: point - camera = w (corner + x / w step_x + y / w step_y).
 * Orthographic: point - camera = corner + x step_x + y step_y + depth forward. */
static void set_rows(nb_raster *raster, const nb_view *view)
{
    raster->orthographic = view->projection == NEBEL_PROJECTION_ORTHOGRAPHIC;
    invert(view->step_x, view->step_y, raster->orthographic ? view->forward : view->corner, raster->rows);
    for (int i = 0; i < 3; i++) {
        raster->shift[i] = -view->start[i] - (raster->orthographic ? view->corner[i] : 0);
    }
}

static void project_corners(const nb_raster *raster, const nb_cluster *cluster, double corners[8][3])
{
    for (int corner = 0; corner < 8; corner++) {
        double p[3];
        for (int i = 0; i < 3; i++) {
            p[i] = (double)(corner >> i & 1 ? cluster->high[i] : cluster->low[i]) + raster->shift[i];
        }
        for (int i = 0; i < 3; i++) corners[corner][i] = dot(raster->rows[i], p);
    }
}

static double least(double a, double b)
{
    return a < b ? a : b;
}

static double most(double a, double b)
{
    return a > b ? a : b;
}

static void set_rectangle(const nb_raster *raster, nb_cluster *cluster)
{
    double corners[8][3], nearest = HUGE_VAL, farthest = -HUGE_VAL;
    double low[2] = {HUGE_VAL, HUGE_VAL}, high[2] = {-HUGE_VAL, -HUGE_VAL};
    project_corners(raster, cluster, corners);
    for (int corner = 0; corner < 8; corner++) {
        const double depth = corners[corner][2], scale = raster->orthographic ? 1 : 1 / depth;
        nearest = least(nearest, depth);
        farthest = most(farthest, depth);
        for (int i = 0; i < 2; i++) {
            low[i] = least(low[i], corners[corner][i] * scale);
            high[i] = most(high[i], corners[corner][i] * scale);
        }
    }
    const int crosses = !raster->orthographic && !(nearest > 0);
    const double limits[2] = {raster->width, raster->height};
    for (int i = 0; i < 2; i++) {
        cluster->from[i] = crosses ? 0 : (float)most(0, least(low[i] - 1, limits[i]));
        cluster->to[i] = crosses ? (float)limits[i] : (float)most(0, least(high[i] + 1, limits[i]));
    }
    if (farthest < 0) cluster->to[0] = -1;
}

static void set_group(nb_geometry *geometry, size_t number)
{
    nb_group *group = &geometry->groups[number];
    *group = (nb_group){{INFINITY, INFINITY}, {-1, -1}};
    for (size_t i = number * NB_GROUP; i < (number + 1) * NB_GROUP && i < geometry->cluster_count; i++) {
        const nb_cluster *cluster = &geometry->clusters[i];
        for (int k = 0; k < 2; k++) {
            group->from[k] = fminf(group->from[k], cluster->from[k]);
            group->to[k] = fmaxf(group->to[k], cluster->to[k]);
        }
    }
}

void nb_raster_set(nb_raster *raster, nb_geometry *geometry, const nb_view *view, uint32_t width, uint32_t height,
                   int threads)
{
    raster->geometry = geometry;
    raster->width = width;
    raster->height = height;
    set_rows(raster, view);
    const size_t group_count = (geometry->cluster_count + NB_GROUP - 1) / NB_GROUP;
#pragma omp parallel for schedule(static) num_threads(threads)
    for (size_t g = 0; g < group_count; g++) {
        for (size_t i = g * NB_GROUP; i < (g + 1) * NB_GROUP && i < geometry->cluster_count; i++) {
            set_rectangle(raster, &geometry->clusters[i]);
        }
        set_group(geometry, g);
    }
}

/* ---- triangles of a cluster
 * ------------------------------------------------------------------------------------------- */

typedef struct nb_projected {
    float corner[3][3][NB_CLUSTER];
    double point[3][4][NB_CLUSTER]; /* per corner: x, y, w and what is linear in depth */
    int x0[NB_CLUSTER], x1[NB_CLUSTER], y0[NB_CLUSTER], y1[NB_CLUSTER]; /* pixels of the region, ends included */
} nb_projected;

typedef struct nb_window {
    double x0, y0, x1, y1; /* first and last pixel of a region */
    double low, high;      /* where in a pixel the points lie */
} nb_window;

static inline void gather_corner(const float *p, float (*corner)[NB_CLUSTER], uint32_t k)
{
    corner[0][k] = p[0];
    corner[1][k] = p[1];
    corner[2][k] = p[2];
}

static void gather(const nb_geometry *geometry, const nb_cluster *cluster, nb_projected *projected)
{
    const nb_surface *surface = &geometry->surfaces[cluster->surface];
    const uint32_t *index = surface->mesh->indices + 3 * (size_t)cluster->first;
    for (uint32_t k = 0; k < cluster->count; k++) {
        gather_corner(surface->positions + 3 * (size_t)index[3 * k], projected->corner[0], k);
        gather_corner(surface->positions + 3 * (size_t)index[3 * k + 1], projected->corner[1], k);
        gather_corner(surface->positions + 3 * (size_t)index[3 * k + 2], projected->corner[2], k);
    }
    for (uint32_t k = cluster->count; k < NB_CLUSTER; k++) {
        const float origin[3] = {0, 0, 0};
        for (int v = 0; v < 3; v++) gather_corner(origin, projected->corner[v], k);
    }
}

NB_CLONES static void project(const nb_raster *raster, nb_projected *projected)
{
    const int orthographic = raster->orthographic;
    const double sx = raster->shift[0], sy = raster->shift[1], sz = raster->shift[2];
    for (int v = 0; v < 3; v++) {
        const float *restrict x = projected->corner[v][0], *restrict y = projected->corner[v][1];
        const float *restrict z = projected->corner[v][2];
        for (int i = 0; i < 3; i++) {
            const double rx = raster->rows[i][0], ry = raster->rows[i][1], rz = raster->rows[i][2];
            double *restrict out = projected->point[v][i];
            NB_SIMD
            for (int k = 0; k < NB_CLUSTER; k++) {
                out[k] = rx * ((double)x[k] + sx) + ry * ((double)y[k] + sy) + rz * ((double)z[k] + sz);
            }
        }
        double *restrict depth = projected->point[v][3], *restrict w = projected->point[v][2];
        NB_SIMD
        for (int k = 0; k < NB_CLUSTER; k++) {
            depth[k] = orthographic ? -w[k] : 1;
            w[k] = orthographic ? 1 : w[k];
        }
    }
}

/* Which pixels of the window have points of the triangles' rectangles; all of them where a triangle crosses the
 * camera's plane or is no number. */
NB_CLONES static void set_ranges(const nb_window *window, nb_projected *projected)
{
    for (int axis = 0; axis < 2; axis++) {
        const double first = axis == 0 ? window->x0 : window->y0, size = (axis == 0 ? window->x1 : window->y1) - first;
        const double low = first + window->low, high = first + window->high;
        int *restrict from = axis == 0 ? projected->x0 : projected->y0;
        int *restrict to = axis == 0 ? projected->x1 : projected->y1;
        NB_SIMD
        for (int k = 0; k < NB_CLUSTER; k++) {
            const double w0 = projected->point[0][2][k], w1 = projected->point[1][2][k], w2 = projected->point[2][2][k];
            const double p0 = projected->point[0][axis][k] / w0, p1 = projected->point[1][axis][k] / w1;
            const double p2 = projected->point[2][axis][k] / w2;
            const int before = least(least(w0, w1), w2) > 0, behind = most(most(w0, w1), w2) <= 0;
            const double start = least(least(p0, p1), p2) - slack - high, end = most(most(p0, p1), p2) + slack - low;
            const double begin = before && start > -1 ? least(start, size + 1) : -1;
            const double finish = before && end < size ? most(end, -1) : size;
            from[k] = (int)(begin + 2) - 1; /* rounds up, or one more, which `slack` allows */
            to[k] = behind ? -1 : (int)(finish + 1) - 1;
        }
    }
}

/* ---- triangles that a region may show
 * ----------------------------------------------------------------------------------- */

enum { PENDING = 64, STRIP = 8 };

/* Each function is n[0] x + n[1] y + n[2] with x and y from the region's first pixel: made in double, good in float. */
typedef struct nb_pending {
    int count;
    double point[3][4][PENDING];
    float edge[3][3][PENDING]; /* >= 0 inside */
    float nearness[3][PENDING];
    int x0[PENDING], x1[PENDING], y0[PENDING], y1[PENDING];
    uint32_t id[PENDING];
} nb_pending;

static inline void copy_point(const double (*from)[NB_CLUSTER], uint32_t k, double (*to)[PENDING], int place)
{
    to[0][place] = from[0][k];
    to[1][place] = from[1][k];
    to[2][place] = from[2][k];
    to[3][place] = from[3][k];
}

static void keep_visible(const nb_projected *projected, uint32_t count, uint32_t first_id, nb_pending *pending)
{
    for (uint32_t k = 0; k < count; k++) {
        if (projected->x0[k] > projected->x1[k] || projected->y0[k] > projected->y1[k]) continue;
        const int place = pending->count++;
        copy_point(projected->point[0], k, pending->point[0], place);
        copy_point(projected->point[1], k, pending->point[1], place);
        copy_point(projected->point[2], k, pending->point[2], place);
        pending->x0[place] = projected->x0[k] > 0 ? projected->x0[k] : 0;
        pending->y0[place] = projected->y0[k] > 0 ? projected->y0[k] : 0;
        pending->x1[place] = projected->x1[k];
        pending->y1[place] = projected->y1[k];
        pending->id[place] = first_id + k;
    }
}

typedef struct nb_plane {
    double x, y, c;
} nb_plane;

static inline nb_plane cross_points(double (*a)[PENDING], double (*b)[PENDING], int k)
{
    return (nb_plane){a[1][k] * b[2][k] - a[2][k] * b[1][k], a[2][k] * b[0][k] - a[0][k] * b[2][k],
                      a[0][k] * b[1][k] - a[1][k] * b[0][k]};
}

/* Stores n * sign, seen from the region's first pixel and scaled so that one is about a pixel. Both signs of n give the
 * same bits but for the sign, before the growth. */
static inline void store_edge(const nb_window *window, nb_plane n, double sign, float (*edge)[PENDING], int k)
{
    const double steepness = (n.x < 0 ? -n.x : n.x) + (n.y < 0 ? -n.y : n.y);
    const double scale = sign / (steepness > 0 ? steepness : 1);
    const double x = n.x * scale, y = n.y * scale;
    edge[0][k] = (float)x;
    edge[1][k] = (float)y;
    edge[2][k] = (float)(n.c * scale + (x * window->x0 + y * window->y0) + growth);
}

NB_CLONES static void set_functions(const nb_window *window, nb_pending *pending)
{
    double(*a)[PENDING] = pending->point[0], (*b)[PENDING] = pending->point[1], (*c)[PENDING] = pending->point[2];
    NB_SIMD
    for (int k = 0; k < pending->count; k++) {
        const nb_plane n0 = cross_points(b, c, k), n1 = cross_points(c, a, k), n2 = cross_points(a, b, k);
        const double determinant = a[0][k] * n0.x + a[1][k] * n0.y + a[2][k] * n0.c;
        const double inverse = 1 / determinant, sign = determinant < 0 ? -1 : 1;
        const double d0 = a[3][k] * inverse, d1 = b[3][k] * inverse, d2 = c[3][k] * inverse;
        const double x = n0.x * d0 + n1.x * d1 + n2.x * d2, y = n0.y * d0 + n1.y * d1 + n2.y * d2;
        pending->nearness[0][k] = (float)x;
        pending->nearness[1][k] = (float)y;
        pending->nearness[2][k] = (float)(n0.c * d0 + n1.c * d1 + n2.c * d2 + x * window->x0 + y * window->y0);
        store_edge(window, n0, sign, pending->edge[0], k);
        store_edge(window, n1, sign, pending->edge[1], k);
        store_edge(window, n2, sign, pending->edge[2], k);
    }
}

/* The functions of one triangle. */
typedef struct nb_functions {
    float x0, y0, c0, x1, y1, c1, x2, y2, c2, xn, yn, cn;
    float limit; /* of nearness */
    uint32_t id;
} nb_functions;

static inline nb_functions functions_of(const nb_pending *pending, int k, int orthographic)
{
    return (nb_functions){pending->edge[0][0][k],
                          pending->edge[0][1][k],
                          pending->edge[0][2][k],
                          pending->edge[1][0][k],
                          pending->edge[1][1][k],
                          pending->edge[1][2][k],
                          pending->edge[2][0][k],
                          pending->edge[2][1][k],
                          pending->edge[2][2][k],
                          pending->nearness[0][k],
                          pending->nearness[1][k],
                          pending->nearness[2][k],
                          orthographic ? 0 : INFINITY, /* nothing before the plane of an orthographic camera */
                          pending->id[k]};
}

/* A row of STRIP pixels. Points outside the triangle fail its edges. */
static inline void fill_strip(nb_functions f, const float *restrict xs, const float *restrict ys,
                              float *restrict nearest, uint32_t *restrict shown)
{
    NB_SIMD
    for (int i = 0; i < STRIP; i++) {
        const float x = xs[i], y = ys[i];
        const float e0 = f.x0 * x + f.y0 * y + f.c0, e1 = f.x1 * x + f.y1 * y + f.c1, e2 = f.x2 * x + f.y2 * y + f.c2;
        const float nearness = f.xn * x + f.yn * y + f.cn, before = nearest[i];
        const uint32_t other = shown[i];
        const int inside = (e0 >= 0) & (e1 >= 0) & (e2 >= 0) & (nearness <= f.limit);
        const int wins = inside & ((nearness > before) | ((nearness >= before) & (f.id < other)));
        nearest[i] = wins ? nearness : before;
        shown[i] = wins ? f.id : other;
    }
}

NB_CLONES static void fill(const nb_pending *pending, int orthographic, const float *xs, const float *ys, nb_seen *seen)
{
    for (int k = 0; k < pending->count; k++) {
        const nb_functions functions = functions_of(pending, k, orthographic);
        const int first = pending->x0[k] / STRIP * STRIP, last = pending->x1[k];
        for (int row = pending->y0[k]; row <= pending->y1[k]; row++) {
            for (int i = row * NB_REGION + first; i <= row * NB_REGION + last; i += STRIP) {
                fill_strip(functions, xs + i, ys + i, seen->nearness + i, seen->triangle + i);
            }
        }
    }
}

static void flush(const nb_raster *raster, const nb_window *window, nb_pending *pending, const nb_region_points *points,
                  nb_seen *seen)
{
    set_functions(window, pending);
    fill(pending, raster->orthographic, points->x, points->y, seen);
    pending->count = 0;
}

/* ---- regions
 * ------------------------------------------------------------------------------------------------------------ */

/* The pixels of a region, as rectangles have them. */
typedef struct nb_region_rectangle {
    float left, top, right, bottom;
} nb_region_rectangle;

static inline int meets(const float from[2], const float to[2], const nb_region_rectangle *region)
{
    return from[0] <= region->right && to[0] >= region->left && from[1] <= region->bottom && to[1] >= region->top;
}

static void clear(const nb_raster *raster, nb_seen *seen)
{
    for (int i = 0; i < NB_REGION * NB_REGION; i++) {
        seen->nearness[i] = raster->orthographic ? -INFINITY : 0;
        seen->triangle[i] = NB_NONE;
    }
}

void nb_raster_region(const nb_raster *raster, uint32_t left, uint32_t top, const nb_region_points *points,
                      nb_seen *seen)
{
    const nb_geometry *geometry = raster->geometry;
    const uint32_t right = left + NB_REGION < raster->width ? left + NB_REGION : raster->width;
    const uint32_t bottom = top + NB_REGION < raster->height ? top + NB_REGION : raster->height;
    const nb_window window = {left, top, right - 1.0, bottom - 1.0, points->low, points->high};
    const nb_region_rectangle rectangle = {(float)left, (float)top, (float)right, (float)bottom};
    nb_projected projected;
    nb_pending pending = {.count = 0};
    clear(raster, seen);
    for (size_t i = 0; i < geometry->cluster_count; i++) {
        const nb_group *group = &geometry->groups[i / NB_GROUP];
        if (i % NB_GROUP == 0 && !meets(group->from, group->to, &rectangle)) {
            i += NB_GROUP - 1;
            continue;
        }
        const nb_cluster *cluster = &geometry->clusters[i];
        if (!meets(cluster->from, cluster->to, &rectangle)) continue;
        gather(geometry, cluster, &projected);
        project(raster, &projected);
        set_ranges(&window, &projected);
        keep_visible(&projected, cluster->count, (uint32_t)i * NB_CLUSTER, &pending);
        if (pending.count > PENDING - NB_CLUSTER) flush(raster, &window, &pending, points, seen);
    }
    flush(raster, &window, &pending, points, seen);
}

/* ---- hits
 * ------------------------------------------------------------------------------------------------------------ */

typedef struct nb_corners {
    float corner[3][3][NB_BATCH];
} nb_corners;

static inline void gather_lane(const float *p, float (*corner)[NB_BATCH], uint32_t i)
{
    corner[0][i] = p[0];
    corner[1][i] = p[1];
    corner[2][i] = p[2];
}

static void gather_hit(const nb_geometry *geometry, uint32_t id, uint32_t i, nb_hits *hits, nb_corners *corners)
{
    const nb_cluster *cluster = &geometry->clusters[id / NB_CLUSTER];
    const nb_surface *surface = &geometry->surfaces[cluster->surface];
    const uint32_t triangle = cluster->first + id % NB_CLUSTER;
    const uint32_t *index = surface->mesh->indices + 3 * (size_t)triangle;
    hits->surface[i] = cluster->surface;
    hits->triangle[i] = triangle;
    gather_lane(surface->positions + 3 * (size_t)index[0], corners->corner[0], i);
    gather_lane(surface->positions + 3 * (size_t)index[1], corners->corner[1], i);
    gather_lane(surface->positions + 3 * (size_t)index[2], corners->corner[2], i);
}

/* Lanes that show the background get a triangle that is none. */
static void gather_corners(const nb_geometry *geometry, const nb_seen *seen, uint32_t x, uint32_t y, nb_hits *hits,
                           nb_corners *corners)
{
    static const float origin[3] = {0, 0, 0};
    for (uint32_t i = 0; i < NB_BATCH; i++) {
        const uint32_t id = seen->triangle[(y + nb_lane_y(i)) * NB_REGION + x + nb_lane_x(i)];
        if (id != NB_NONE) {
            gather_hit(geometry, id, i, hits, corners);
            continue;
        }
        hits->surface[i] = NB_NONE;
        gather_lane(origin, corners->corner[0], i);
        gather_lane(origin, corners->corner[1], i);
        gather_lane(origin, corners->corner[2], i);
    }
}

/* Where the rays meet the planes of their triangles (Moeller and Trumbore 1997), and the weights of the corners there.
 */
NB_CLONES static void intersect(const nb_corners *corners, const nb_rays *rays, nb_hits *hits)
{
    NB_SIMD
    for (int i = 0; i < NB_BATCH; i++) {
        const float ax = corners->corner[0][0][i], ay = corners->corner[0][1][i], az = corners->corner[0][2][i];
        const float bx = corners->corner[1][0][i] - ax, by = corners->corner[1][1][i] - ay,
                    bz = corners->corner[1][2][i] - az;
        const float cx = corners->corner[2][0][i] - ax, cy = corners->corner[2][1][i] - ay,
                    cz = corners->corner[2][2][i] - az;
        const float ox = rays->start[0][i] - ax, oy = rays->start[1][i] - ay, oz = rays->start[2][i] - az;
        const float dx = rays->unit[0][i], dy = rays->unit[1][i], dz = rays->unit[2][i];
        const float nx = by * cz - bz * cy, ny = bz * cx - bx * cz, nz = bx * cy - by * cx;
        const float qx = oy * dz - oz * dy, qy = oz * dx - ox * dz, qz = ox * dy - oy * dx;
        const float inverse = -1 / (nx * dx + ny * dy + nz * dz);
        const float t = (nx * ox + ny * oy + nz * oz) * inverse;
        const int valid = t < 1e30f;
        hits->t[i] = t > 0 ? t : 0;
        hits->u[i] = (cx * qx + cy * qy + cz * qz) * inverse;
        hits->v[i] = -(bx * qx + by * qy + bz * qz) * inverse;
        hits->normal[0][i] = nx;
        hits->normal[1][i] = ny;
        hits->normal[2][i] = nz;
        hits->surface[i] = valid ? hits->surface[i] : NB_NONE;
    }
}

void nb_raster_hits(const nb_geometry *geometry, const nb_seen *seen, uint32_t x, uint32_t y, const nb_rays *rays,
                    nb_hits *hits)
{
    nb_corners corners;
    gather_corners(geometry, seen, x, y, hits, &corners);
    intersect(&corners, rays, hits);
}
