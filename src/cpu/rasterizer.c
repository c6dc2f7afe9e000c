#include "rasterizer.h"

#include <math.h>
#include <string.h>

/* Triangles grow by this many pixels on every side: more than the rounding errors of their edge functions in float,
 * which leave a gap where many triangles meet in one point of the picture; far less than anybody sees. */
static const double growth = 0x1p-14;

int nb_raster_is_apt(const nb_geometry *geometry, nebel_projection projection, uint32_t width, uint32_t height)
{
    if (projection == NEBEL_PROJECTION_PANORAMA || geometry->scene == NULL || geometry->mask_count > 0) return 0;
    return geometry->node_counts[0] * NB_FAN <= (size_t)width * height;
}

void nb_raster_set(nb_raster *raster, nb_geometry *geometry, const nb_view *view, const nb_raster_target *picture,
                   int threads)
{
    raster->geometry = geometry;
    nb_projection_set(&raster->projection, view);
    nb_project_geometry(&raster->projection, picture, geometry, threads);
}

/* ---- corners --------------------------------------------------------------------------------- */

/* The triangles of one surface by their IDs: neighbours mostly have the same. */
typedef struct nb_owner {
    uint32_t number, first_id, count;
    const uint32_t *indices;
    const float *positions;
} nb_owner;

static const nb_owner nobody = {NB_NONE, 0, 0, NULL, NULL};

static nb_owner find_owner(const nb_geometry *geometry, uint32_t id)
{
    const uint32_t number = nb_owner_of(geometry, id);
    const nb_batch_surface *surface = &geometry->surfaces[number];
    const nebel_mesh *mesh = surface->mesh;
    return (nb_owner){number, surface->first_id, mesh->triangle_count, mesh->indices, surface->positions};
}

static inline int owns(const nb_owner *owner, uint32_t id)
{
    return id - owner->first_id < owner->count;
}

static inline const uint32_t *indices_of(const nb_owner *owner, uint32_t id)
{
    return owner->indices + 3 * (size_t)(id - owner->first_id);
}

/* ---- triangles that a region may show -------------------------------------------------------- */

enum { PENDING = 64 };

/* The functions are n[0] x + n[1] y + n[2] with x and y from the region's corner: made in double, good in float. */
typedef struct nb_pending {
    uint32_t count;
    uint32_t id[PENDING];
    int x0[PENDING], x1[PENDING], y0[PENDING], y1[PENDING]; /* blocks of the region */
    float corner[3][3][PENDING];
    float edge[3][3][PENDING]; /* >= 0 inside */
    float nearness[3][PENDING];
} nb_pending;

static inline void gather_pending(const float *p, float (*corner)[PENDING], uint32_t k)
{
    corner[0][k] = p[0];
    corner[1][k] = p[1];
    corner[2][k] = p[2];
}

static void prefetch_positions(const nb_geometry *geometry, const nb_pending *pending)
{
    nb_owner owner = nobody;
    for (uint32_t k = 0; k < pending->count; k++) {
        const uint32_t id = pending->id[k];
        if (!owns(&owner, id)) owner = find_owner(geometry, id);
        const uint32_t *index = indices_of(&owner, id);
        for (int i = 0; i < 3; i++) __builtin_prefetch(owner.positions + 3 * (size_t)index[i]);
    }
}

static void gather_triangles(const nb_geometry *geometry, nb_pending *pending)
{
    nb_owner owner = nobody;
    for (uint32_t k = 0; k < pending->count; k++) {
        const uint32_t id = pending->id[k];
        if (!owns(&owner, id)) owner = find_owner(geometry, id);
        const uint32_t *index = indices_of(&owner, id);
        gather_pending(owner.positions + 3 * (size_t)index[0], pending->corner[0], k);
        gather_pending(owner.positions + 3 * (size_t)index[1], pending->corner[1], k);
        gather_pending(owner.positions + 3 * (size_t)index[2], pending->corner[2], k);
    }
}

typedef struct nb_vector {
    double x, y, z;
} nb_vector;

static inline nb_vector cross(nb_vector a, nb_vector b)
{
    return (nb_vector){a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

static inline nb_vector project(const nb_projection *projection, float (*corner)[PENDING], uint32_t k)
{
    const double(*rows)[3] = projection->rows;
    const double x = (double)corner[0][k] + projection->shift[0], y = (double)corner[1][k] + projection->shift[1];
    const double z = (double)corner[2][k] + projection->shift[2];
    return (nb_vector){rows[0][0] * x + rows[0][1] * y + rows[0][2] * z,
                       rows[1][0] * x + rows[1][1] * y + rows[1][2] * z,
                       rows[2][0] * x + rows[2][1] * y + rows[2][2] * z};
}

/* Stores n * sign, seen from the region's corner and scaled so that one is about a pixel. Both signs of n give the same
 * bits but for the sign, before the growth. */
static inline void store_edge(double left, double top, nb_vector n, double sign, float (*edge)[PENDING], uint32_t k)
{
    const double steepness = (n.x < 0 ? -n.x : n.x) + (n.y < 0 ? -n.y : n.y);
    const double scale = sign / (steepness > 0 ? steepness : 1);
    const double x = n.x * scale, y = n.y * scale;
    edge[0][k] = (float)x;
    edge[1][k] = (float)y;
    edge[2][k] = (float)(n.z * scale + (x * left + y * top) + growth);
}

/* Nearness is 1 / w, or -depth for an orthographic camera, which has w = 1. */
NB_CLONES static void set_functions(const nb_projection *projection, double left, double top, nb_pending *pending)
{
    const int orthographic = projection->orthographic;
    const uint32_t count = pending->count;
    NB_SIMD
    for (uint32_t k = 0; k < count; k++) {
        nb_vector a = project(projection, pending->corner[0], k), b = project(projection, pending->corner[1], k);
        nb_vector c = project(projection, pending->corner[2], k);
        const double da = orthographic ? -a.z : 1, db = orthographic ? -b.z : 1, dc = orthographic ? -c.z : 1;
        a.z = orthographic ? 1 : a.z;
        b.z = orthographic ? 1 : b.z;
        c.z = orthographic ? 1 : c.z;
        const nb_vector n0 = cross(b, c), n1 = cross(c, a), n2 = cross(a, b);
        const double determinant = a.x * n0.x + a.y * n0.y + a.z * n0.z;
        const double inverse = 1 / determinant, sign = determinant < 0 ? -1 : 1;
        const double d0 = da * inverse, d1 = db * inverse, d2 = dc * inverse;
        const double x = n0.x * d0 + n1.x * d1 + n2.x * d2, y = n0.y * d0 + n1.y * d1 + n2.y * d2;
        pending->nearness[0][k] = (float)x;
        pending->nearness[1][k] = (float)y;
        pending->nearness[2][k] = (float)(n0.z * d0 + n1.z * d1 + n2.z * d2 + x * left + y * top);
        store_edge(left, top, n0, sign, pending->edge[0], k);
        store_edge(left, top, n1, sign, pending->edge[1], k);
        store_edge(left, top, n2, sign, pending->edge[2], k);
    }
}

/* The functions of one triangle. */
typedef struct nb_functions {
    float x0, y0, c0, x1, y1, c1, x2, y2, c2, xn, yn, cn;
    float limit; /* of nearness */
    uint32_t id;
} nb_functions;

static inline nb_functions functions_of(const nb_pending *pending, uint32_t k, int orthographic)
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

/* Points outside the triangle fail its edges. */
static inline void fill_block(nb_functions f, const float *restrict xs, const float *restrict ys,
                              float *restrict nearest, uint32_t *restrict shown)
{
    NB_SIMD
    for (int i = 0; i < NB_PACKET; i++) {
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

NB_CLONES static void fill_pixels(const nb_pending *pending, int orthographic, const float *xs, const float *ys,
                                  nb_region_hits *seen)
{
    for (uint32_t k = 0; k < pending->count; k++) {
        const nb_functions functions = functions_of(pending, k, orthographic);
        for (int y = pending->y0[k]; y <= pending->y1[k]; y++) {
            const int first = y * NB_BATCH + pending->x0[k] * NB_PACKET,
                      last = y * NB_BATCH + pending->x1[k] * NB_PACKET;
            for (int i = first; i <= last; i += NB_PACKET) {
                fill_block(functions, xs + i, ys + i, seen->nearness + i, seen->triangle + i);
            }
        }
    }
}

/* ---- regions --------------------------------------------------------------------------------- */

/* Most of the memory that a region needs is in no near cache. It is asked for before it is needed: the rectangles of
 * this many leaves, then the indices and then the positions of triangles. */
enum { LEAVES = 64 };

/* A region on its way through the tree of rectangles. */
typedef struct nb_raster_walk {
    const nb_raster *raster;
    int left, top;
    uint32_t count; /* of samples */
    const nb_region_points *points;
    nb_region_hits *seen;
    int16_t least_ends[4 * NB_FAN]; /* of rectangles that meet the region, NB_FAN times */
    nb_owner owner;                 /* of the last leaf */
    uint32_t leaf_count, leaves[LEAVES];
    nb_pending pending;
} nb_raster_walk;

static void flush(nb_raster_walk *walk)
{
    const nb_projection *projection = &walk->raster->projection;
    prefetch_positions(walk->raster->geometry, &walk->pending);
    gather_triangles(walk->raster->geometry, &walk->pending);
    set_functions(projection, walk->left, walk->top, &walk->pending);
    for (uint32_t s = 0; s < walk->count; s++) {
        fill_pixels(&walk->pending, projection->orthographic, walk->points[s].x, walk->points[s].y, &walk->seen[s]);
    }
    walk->pending.count = 0;
}

static inline int first_block(int pixel)
{
    return pixel > 0 ? pixel / NB_BLOCK : 0;
}

static inline int last_block(int pixel)
{
    return (pixel < NB_REGION ? pixel : NB_REGION - 1) / NB_BLOCK;
}

static void queue_triangle(nb_raster_walk *walk, const int16_t *ends, uint32_t id)
{
    nb_pending *pending = &walk->pending;
    const uint32_t place = pending->count++;
    pending->id[place] = id;
    pending->x0[place] = first_block(-ends[0] - walk->left);
    pending->y0[place] = first_block(-ends[1] - walk->top);
    pending->x1[place] = last_block(ends[2] - walk->left);
    pending->y1[place] = last_block(ends[3] - walk->top);
}

/* The children of a node that the region meets, in ascending order. */
static uint32_t find_children(const nb_raster_walk *walk, const nb_node *node, uint32_t *children)
{
    int16_t misses[4 * NB_FAN];
    NB_SIMD
    for (int i = 0; i < 4 * NB_FAN; i++) misses[i] = node->ends[i] < walk->least_ends[i] ? -1 : 0;
    uint32_t count = 0;
    for (uint32_t k = 0; k < NB_FAN; k++) {
        uint64_t any;
        memcpy(&any, misses + 4 * k, sizeof any);
        children[count] = k;
        count += any == 0 ? 1 : 0;
    }
    return count;
}

static void prefetch_indices(nb_raster_walk *walk, uint32_t id)
{
    if (!owns(&walk->owner, id)) walk->owner = find_owner(walk->raster->geometry, id);
    const uintptr_t address = (uintptr_t)indices_of(&walk->owner, id);
    for (uintptr_t i = 0; i < 3 * NB_FAN * sizeof(uint32_t); i += 64) __builtin_prefetch((const void *)(address + i));
}

static void visit_leaf(nb_raster_walk *walk, uint32_t number)
{
    const nb_node *leaf = &walk->raster->geometry->levels[0][number];
    uint32_t children[NB_FAN];
    const uint32_t count = find_children(walk, leaf, children);
    if (count == 0) return;
    prefetch_indices(walk, number * NB_FAN);
    for (uint32_t i = 0; i < count; i++) {
        queue_triangle(walk, leaf->ends + 4 * (size_t)children[i], number * NB_FAN + children[i]);
    }
    if (walk->pending.count > PENDING - NB_FAN) flush(walk);
}

static void visit_leaves(nb_raster_walk *walk)
{
    for (uint32_t i = 0; i < walk->leaf_count; i++) visit_leaf(walk, walk->leaves[i]);
    walk->leaf_count = 0;
}

static void queue_leaf(nb_raster_walk *walk, uint32_t number)
{
    const nb_node *leaf = &walk->raster->geometry->levels[0][number];
    __builtin_prefetch(leaf);
    __builtin_prefetch(leaf->ends + 2 * NB_FAN);
    walk->leaves[walk->leaf_count++] = number;
    if (walk->leaf_count == LEAVES) visit_leaves(walk);
}

static void visit(nb_raster_walk *walk, int level, uint32_t number)
{
    if (level == 0) {
        queue_leaf(walk, number);
        return;
    }
    uint32_t children[NB_FAN];
    const uint32_t count = find_children(walk, &walk->raster->geometry->levels[level][number], children);
    for (uint32_t i = 0; i < count; i++) visit(walk, level - 1, number * NB_FAN + children[i]);
}

static void set_least_ends(nb_raster_walk *walk)
{
    const int ends[4] = {-walk->left - NB_REGION + 1, -walk->top - NB_REGION + 1, walk->left, walk->top};
    for (int i = 0; i < 4 * NB_FAN; i++) walk->least_ends[i] = (int16_t)ends[i % 4];
}

static void clear_hits(int orthographic, nb_region_hits *seen)
{
    for (int i = 0; i < NB_PIXELS; i++) {
        seen->nearness[i] = orthographic ? -INFINITY : 0;
        seen->triangle[i] = NB_NONE;
    }
}

void nb_raster_region(const nb_raster *raster, uint32_t left, uint32_t top, uint32_t count,
                      const nb_region_points *points, nb_region_hits *seen)
{
    const nb_geometry *geometry = raster->geometry;
    nb_raster_walk walk;
    walk.raster = raster;
    walk.left = (int)left;
    walk.top = (int)top;
    walk.count = count;
    walk.points = points;
    walk.seen = seen;
    walk.owner = nobody;
    walk.leaf_count = 0;
    walk.pending.count = 0;
    set_least_ends(&walk);
    for (uint32_t s = 0; s < count; s++) clear_hits(raster->projection.orthographic, &seen[s]);
    visit(&walk, geometry->level_count - 1, 0);
    visit_leaves(&walk);
    flush(&walk);
}

/* ---- hits ------------------------------------------------------------------------------------ */

typedef struct nb_raster_corners {
    float corner[3][3][NB_BATCH];
} nb_raster_corners;

static inline void gather_lane(const float *p, float (*corner)[NB_BATCH], uint32_t i)
{
    corner[0][i] = p[0];
    corner[1][i] = p[1];
    corner[2][i] = p[2];
}

/* Lanes that show the background get a triangle that is none. */
static void gather_corners(const nb_geometry *geometry, const uint32_t *ids, nb_hits *hits, nb_raster_corners *corners)
{
    static const float origin[3] = {0, 0, 0};
    static const uint32_t point[3] = {0, 0, 0};
    nb_owner owner = nobody;
    for (uint32_t i = 0; i < NB_BATCH; i++) {
        const uint32_t id = ids[i];
        if (id != NB_NONE && !owns(&owner, id)) owner = find_owner(geometry, id);
        const uint32_t *index = id != NB_NONE ? indices_of(&owner, id) : point;
        const float *positions = id != NB_NONE ? owner.positions : origin;
        hits->surface[i] = id != NB_NONE ? owner.number : NB_NONE;
        hits->triangle[i] = id - owner.first_id;
        gather_lane(positions + 3 * (size_t)index[0], corners->corner[0], i);
        gather_lane(positions + 3 * (size_t)index[1], corners->corner[1], i);
        gather_lane(positions + 3 * (size_t)index[2], corners->corner[2], i);
    }
}

/* Where the rays meet the planes of their triangles (Moeller and Trumbore 1997), and the weights of the corners there.
 */
NB_CLONES static void intersect(const nb_raster_corners *corners, const nb_ray_batch *rays, nb_hits *hits)
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

static int shows_background(const uint32_t *ids)
{
    uint32_t common = NB_NONE;
    for (int i = 0; i < NB_BATCH; i++) common &= ids[i];
    return common == NB_NONE;
}

void nb_raster_hits(const nb_geometry *geometry, const uint32_t *ids, const nb_ray_batch *rays, nb_hits *hits)
{
    if (shows_background(ids)) {
        memset(hits->surface, 0xff, sizeof hits->surface);
        return;
    }
    nb_raster_corners corners;
    gather_corners(geometry, ids, hits, &corners);
    intersect(&corners, rays, hits);
}
