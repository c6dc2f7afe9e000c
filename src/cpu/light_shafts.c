#include "light_shafts.h"

#include "masked_triangle.h"

#include "math/vector.h"

#include <nebel/light.h>

#include <math.h>

/* What keeps a point light's light off a ray meets the flat triangle between both. Those of a packet, relative to the
 * point light;
 * normals have length 1, or 0 where the ray passes through the point light, and point out of the triangle's sides. */
typedef struct nb_flats {
    float low[3][NB_PACKET], high[3][NB_PACKET];
    float across[3][NB_PACKET]; /* normal of the triangle */
    float near[3][NB_PACKET], far[3][NB_PACKET], beyond[3][NB_PACKET];
    float height[NB_PACKET]; /* m, of the ray from the point light */
} nb_flats;

typedef struct nb_light_place {
    double place[3]; /* relative to the origin of the geometry */
    double radius;
} nb_light_place;

/* ---- rays ------------------------------------------------------------------------------------ */

NB_CLONES static void move_rays(const nb_light_place *light, const nb_ray_batch *rays, int first, nb_shaft_rays *packet)
{
    for (int c = 0; c < 3; c++) {
        const double place = light->place[c];
        NB_SIMD
        for (int i = 0; i < NB_PACKET; i++) {
            packet->start[c][i] = (float)((double)rays->start[c][first + i] - place);
            packet->way[c][i] = rays->unit[c][first + i];
        }
    }
}

NB_ALWAYS_INLINE double inverse_length(double x, double y, double z)
{
    const double square = x * x + y * y + z * z;
    return 1 / sqrt(square > 1e-60 ? square : 1e-60);
}

NB_ALWAYS_INLINE float least_below_zero(double x, double y)
{
    const double least = x < y ? x : y;
    return (float)(least < 0 ? least : 0);
}

NB_ALWAYS_INLINE float most_above_zero(double x, double y)
{
    const double most = x > y ? x : y;
    return (float)(most > 0 ? most : 0);
}

/* Rays of which nothing is asked get a box that meets none. The foot of the point light on the ray keeps digits that a
 * product of places far from the point light would lose. */
NB_CLONES static void set_flats(const nb_shaft_rays *rays, nb_flats *flats)
{
    NB_SIMD
    for (int i = 0; i < NB_PACKET; i++) {
        const double x = (double)rays->start[0][i], y = (double)rays->start[1][i], z = (double)rays->start[2][i];
        const double dx = (double)rays->way[0][i], dy = (double)rays->way[1][i], dz = (double)rays->way[2][i];
        const double from = (double)rays->from[i], to = (double)rays->to[i];
        const double closest = (x * dx + y * dy + z * dz) / (dx * dx + dy * dy + dz * dz);
        const double fx = x - closest * dx, fy = y - closest * dy, fz = z - closest * dz;
        const double by_foot = inverse_length(fx, fy, fz), height = (fx * fx + fy * fy + fz * fz) * by_foot;
        const double known = height > 1e-9 * ((x < 0 ? -x : x) + (y < 0 ? -y : y) + (z < 0 ? -z : z)) ? 1 : 0;
        const double bx = fx * by_foot * known, by = fy * by_foot * known, bz = fz * by_foot * known;
        const double nx = by * dz - bz * dy, ny = bz * dx - bx * dz, nz = bx * dy - by * dx;
        const double px = x + from * dx, py = y + from * dy, pz = z + from * dz;
        const double qx = x + to * dx, qy = y + to * dy, qz = z + to * dz;
        const double p = inverse_length(px, py, pz), q = inverse_length(qx, qy, qz);
        const int some = rays->from[i] < rays->to[i];
        flats->low[0][i] = some ? least_below_zero(px, qx) : HUGE_VALF;
        flats->low[1][i] = some ? least_below_zero(py, qy) : HUGE_VALF;
        flats->low[2][i] = some ? least_below_zero(pz, qz) : HUGE_VALF;
        flats->high[0][i] = some ? most_above_zero(px, qx) : -HUGE_VALF;
        flats->high[1][i] = some ? most_above_zero(py, qy) : -HUGE_VALF;
        flats->high[2][i] = some ? most_above_zero(pz, qz) : -HUGE_VALF;
        flats->across[0][i] = (float)nx;
        flats->across[1][i] = (float)ny;
        flats->across[2][i] = (float)nz;
        flats->near[0][i] = (float)((py * nz - pz * ny) * p);
        flats->near[1][i] = (float)((pz * nx - px * nz) * p);
        flats->near[2][i] = (float)((px * ny - py * nx) * p);
        flats->far[0][i] = (float)((ny * qz - nz * qy) * q);
        flats->far[1][i] = (float)((nz * qx - nx * qz) * q);
        flats->far[2][i] = (float)((nx * qy - ny * qx) * q);
        flats->beyond[0][i] = (float)bx;
        flats->beyond[1][i] = (float)by;
        flats->beyond[2][i] = (float)bz;
        flats->height[i] = (float)height;
    }
}

/* ---- boxes ----------------------------------------------------------------------------------- */

/* A child's box relative to a point light. */
typedef struct nb_light_box {
    float low[3], high[3], middle[3], half[3];
    float slack; /* what rounding may do to its distance from a plane */
} nb_light_box;

NB_ALWAYS_INLINE nb_light_box node_box_of(const nb_shadow_node *node, int child, const nb_light_place *light)
{
    nb_light_box box = {.slack = 0};
    for (int c = 0; c < 3; c++) {
        const float low = node->low[c][child], high = node->high[c][child], place = (float)light->place[c];
        const float margin = 1e-6f * (fabsf(low) + fabsf(high) + fabsf(place));
        box.low[c] = low - place - margin;
        box.high[c] = high - place + margin;
        box.middle[c] = 0.5f * (box.low[c] + box.high[c]);
        box.half[c] = 0.5f * (box.high[c] - box.low[c]);
        box.slack += 1e-6f * (fabsf(box.middle[c]) + box.half[c]);
    }
    return box;
}

NB_ALWAYS_INLINE float size_of(float x)
{
    return x < 0 ? -x : x;
}

/* How far a place relative to the point light is before a plane through that. */
NB_ALWAYS_INLINE float before_plane(const float place[3], const float (*normal)[NB_PACKET], int i)
{
    return place[0] * normal[0][i] + place[1] * normal[1][i] + place[2] * normal[2][i];
}

/* How far the box reaches to either side of such a plane through its middle. */
NB_ALWAYS_INLINE float reach_along(const nb_light_box *box, const float (*normal)[NB_PACKET], int i)
{
    return box->half[0] * size_of(normal[0][i]) + box->half[1] * size_of(normal[1][i]) +
           box->half[2] * size_of(normal[2][i]) + box->slack;
}

/* Whether the box may meet any of the flat triangles: no plane of a few likely ones has them on different sides. */
NB_ALWAYS_INLINE int meets_flats(const nb_light_box *box, const nb_flats *flats)
{
    const float(*across)[NB_PACKET] = flats->across, (*near)[NB_PACKET] = flats->near, (*far)[NB_PACKET] = flats->far,
          (*beyond)[NB_PACKET] = flats->beyond;
    int some[NB_PACKET], any = 0;
    NB_SIMD
    for (int i = 0; i < NB_PACKET; i++) {
        const int over_x = (box->low[0] <= flats->high[0][i]) & (box->high[0] >= flats->low[0][i]);
        const int over_y = (box->low[1] <= flats->high[1][i]) & (box->high[1] >= flats->low[1][i]);
        const int over_z = (box->low[2] <= flats->high[2][i]) & (box->high[2] >= flats->low[2][i]);
        const int aside = size_of(before_plane(box->middle, across, i)) > reach_along(box, across, i);
        const int before = before_plane(box->middle, near, i) > reach_along(box, near, i);
        const int after = before_plane(box->middle, far, i) > reach_along(box, far, i);
        const int behind =
            before_plane(box->middle, beyond, i) - flats->height[i] * 1.000001f > reach_along(box, beyond, i);
        some[i] = over_x & over_y & over_z & !(aside | before | after | behind);
    }
    for (int i = 0; i < NB_PACKET; i++) any |= some[i];
    return any;
}

/* Whether the triangle, relative to the point light, may meet any of the flat triangles: the same of its corners. It
 * costs far less than to cut out the shadow. */
NB_ALWAYS_INLINE int may_meet(const float (*corner)[3], float slack, const nb_flats *flats)
{
    int some[NB_PACKET], any = 0;
    NB_SIMD
    for (int i = 0; i < NB_PACKET; i++) {
        const float height = flats->height[i] * 1.000001f + slack;
        int left = 1, right = 1, before = 1, after = 1, behind = 1;
        for (int k = 0; k < 3; k++) {
            const float *c = corner[k];
            const float across = before_plane(c, flats->across, i);
            left &= across < -slack;
            right &= across > slack;
            before &= before_plane(c, flats->near, i) > slack;
            after &= before_plane(c, flats->far, i) > slack;
            behind &= before_plane(c, flats->beyond, i) > height;
        }
        some[i] = !(left | right | before | after | behind);
    }
    for (int i = 0; i < NB_PACKET; i++) any |= some[i];
    return any;
}

/* ---- shadows --------------------------------------------------------------------------------- */

/* Where a triangle's plane, of this unit normal and so far from a point light, is within the point light's radius, its
 * shadow has a hole: places p with distance |p| < radius (normal . p), a cone. Of the line that is an interval, or what
 * is beyond its ends, of which only one is on the shadow's side of the plane. */
typedef struct nb_hole {
    double normal[3], distance2, radius2;
} nb_hole;

/* What a shadow keeps before the hole stays in `found`, what it keeps behind goes to `rest`. */
static void cut_hole(const nb_hole *hole, const nb_shaft_rays *rays, int i, nb_shaft_interval *found,
                     nb_shaft_interval *rest)
{
    const double p[3] = {(double)rays->start[0][i], (double)rays->start[1][i], (double)rays->start[2][i]};
    const double d[3] = {(double)rays->way[0][i], (double)rays->way[1][i], (double)rays->way[2][i]};
    const double at = nb_vector_dot(hole->normal, p), rise = nb_vector_dot(hole->normal, d);
    const double square = hole->distance2 * nb_vector_dot(d, d) - hole->radius2 * rise * rise;
    const double a = square != 0 ? square : 1e-300;
    const double b = hole->distance2 * nb_vector_dot(p, d) - hole->radius2 * at * rise;
    const double c = hole->distance2 * nb_vector_dot(p, p) - hole->radius2 * at * at;
    const double discriminant = b * b - a * c;
    rest->enter[i] = HUGE_VALF;
    rest->leave[i] = -HUGE_VALF;
    if (!(discriminant > 0)) return;
    const double root = sqrt(discriminant), sum = b < 0 ? root - b : -root - b;
    const double low = fmin(sum / a, c / sum), high = fmax(sum / a, c / sum);
    double enter = low, leave = high;
    if (a < 0) {
        enter = rise > 0 ? high : -HUGE_VAL;
        leave = rise > 0 ? HUGE_VAL : low;
    }
    rest->enter[i] = fmaxf((float)leave, found->enter[i]);
    rest->leave[i] = found->leave[i];
    found->leave[i] = fminf((float)enter, found->leave[i]);
}

NB_ALWAYS_INLINE int add_interval(nb_sun_shafts *shafts, const nebel_allocator *allocator,
                                  const nb_masked_occluder *sheet, const nb_masked_triangle_light *light,
                                  const nb_shaft_interval *found, nb_shaft_rays *rays)
{
    int fresh[NB_PACKET];
    if (sheet != NULL) return nb_masked_triangle_cast(sheet, light, shafts, allocator, found, rays);
    return !nb_extend(found, rays, fresh) || nb_replace(shafts, allocator, found, fresh, rays);
}

/* What of a triangle a point light sees: the planes through its edges, and its own. */
typedef struct nb_seen_caster {
    nb_prism pyramid;
    nb_hole hole;
} nb_seen_caster;

/* Returns 0 where the point light is in the triangle's plane. Triangles with a common edge get the same plane there,
 * to the bit. */
NB_ALWAYS_INLINE int see(const nb_occluder *caster, const nb_light_place *light, nb_seen_caster *seen)
{
    static const double here[3] = {0, 0, 0};
    double corner[3][3], way[2][3];
    for (int k = 0; k < 3; k++)
        for (int c = 0; c < 3; c++) corner[k][c] = (double)caster->corner[k][c] - light->place[c];
    for (int k = 0; k < 2; k++)
        for (int c = 0; c < 3; c++) way[k][c] = (double)caster->corner[k + 1][c] - (double)caster->corner[0][c];
    double *normal = seen->hole.normal;
    nb_vector_cross(way[0], way[1], normal);
    if (!nb_vector_make_unit(normal)) return 0;
    const double apart = nb_vector_dot(normal, corner[0]), side = apart < 0 ? -1 : 1;
    if (apart == 0) return 0;
    for (int k = 0; k < 3; k++) {
        double edge[3];
        nb_vector_cross(corner[k], corner[(k + 1) % 3], edge);
        for (int c = 0; c < 3; c++) edge[c] *= side;
        nb_shadow_plane(edge, here, seen->pyramid.planes[k]);
    }
    for (int c = 0; c < 3; c++) normal[c] *= side;
    nb_shadow_plane(normal, corner[0], seen->pyramid.planes[3]);
    seen->hole.distance2 = apart * apart;
    seen->hole.radius2 = light->radius * light->radius;
    return 1;
}

NB_ALWAYS_INLINE int cast(nb_sun_shafts *shafts, const nebel_allocator *allocator, const nb_shadow_tree *tree,
                          size_t number, const nb_light_place *light, const nb_flats *flats, nb_shaft_rays *rays)
{
    const nb_occluder *caster = &tree->casters[number];
    const nb_masked_occluder *sheet = nb_shadow_tree_sheet(tree, number);
    nb_seen_caster seen;
    nb_shaft_interval found, rest;
    float corner[3][3], slack = 0;
    for (int k = 0; k < 3; k++)
        for (int c = 0; c < 3; c++) {
            const float at = caster->corner[k][c], place = (float)light->place[c];
            corner[k][c] = at - place;
            slack += 1e-6f * (fabsf(at) + fabsf(place));
        }
    if (!may_meet((const float(*)[3])corner, slack, flats) || !see(caster, light, &seen)) return 1;
    const nb_masked_triangle_light view = {light->place, seen.hole.normal, sqrt(seen.hole.distance2)};
    nb_cross_prism(&seen.pyramid, rays, &found);
    if (seen.hole.distance2 >= seen.hole.radius2) return add_interval(shafts, allocator, sheet, &view, &found, rays);
    for (int i = 0; i < NB_PACKET; i++) cut_hole(&seen.hole, rays, i, &found, &rest);
    return add_interval(shafts, allocator, sheet, &view, &found, rays) &&
           add_interval(shafts, allocator, sheet, &view, &rest, rays);
}

typedef struct nb_light_visit {
    int level;
    size_t number; /* of the node; at level -1 of the leaf */
} nb_light_visit;

enum { LIGHT_VISITS = NB_SHADOW_LEVELS * NB_SHADOW_FAN };

/* Returns 0 when memory is out. */
NB_CLONES static int walk_to_light(nb_sun_shafts *shafts, const nebel_allocator *allocator, const nb_shadow_tree *tree,
                                   const nb_light_place *light, const nb_flats *flats, nb_shaft_rays *rays)
{
    nb_light_visit visits[LIGHT_VISITS];
    int count = 1;
    visits[0] = (nb_light_visit){tree->level_count - 1, 0};
    while (count > 0) {
        const nb_light_visit visit = visits[--count];
        const size_t first = visit.number * NB_SHADOW_FAN;
        for (size_t k = 0; k < NB_SHADOW_FAN && visit.level >= 0; k++) {
            const nb_light_box box = node_box_of(&tree->levels[visit.level][visit.number], (int)k, light);
            if (meets_flats(&box, flats)) visits[count++] = (nb_light_visit){visit.level - 1, first + k};
        }
        for (size_t k = first; k < first + NB_SHADOW_FAN && k < tree->count && visit.level < 0; k++)
            if (!cast(shafts, allocator, tree, k, light, flats, rays)) return 0;
    }
    return 1;
}

/* ---- point lights ----------------------------------------------------------------------------------- */

static int find_light_packet(nb_sun_shafts *shafts, const nebel_allocator *allocator, const nb_shadow_tree *tree,
                             const nb_light_place *light, const nb_ray_batch *rays, int first, nb_shaft_rays *packet)
{
    nb_flats flats;
    for (int i = 0; i < NB_PACKET; i++) {
        packet->enter[i] = HUGE_VALF;
        packet->leave[i] = -HUGE_VALF;
        packet->kept[i] = 0;
    }
    move_rays(light, rays, first, packet);
    set_flats(packet, &flats);
    shafts->shadow_count = 0;
    return walk_to_light(shafts, allocator, tree, light, &flats, packet);
}

static int find_light(nb_sun_shafts *shafts, const nebel_allocator *allocator, const nb_shadow_tree *tree,
                      const nb_light_place *light, const float *from, const float *to, const nb_ray_batch *rays,
                      double advance, uint32_t *numbers)
{
    for (int p = 0; p < NB_BATCH; p += NB_PACKET) {
        for (int i = 0; i < NB_PACKET; i++) numbers[p + i] = (uint32_t)shafts->boundary_count;
        if (tree->count == 0 || nb_is_empty(from + p, to + p)) continue;
        nb_shaft_rays packet;
        for (int i = 0; i < NB_PACKET; i++) {
            packet.from[i] = from[p + i];
            packet.to[i] = to[p + i];
        }
        if (!find_light_packet(shafts, allocator, tree, light, rays, p, &packet) ||
            !nb_sun_shafts_finish(shafts, allocator, &packet, rays->length + p, advance, numbers + p))
            return 0;
    }
    numbers[NB_BATCH] = (uint32_t)shafts->boundary_count;
    return 1;
}

static int reserve_pieces(nb_light_shafts *shafts, const nebel_allocator *allocator, size_t lights)
{
    void *numbers = shafts->numbers, *pieces = shafts->pieces;
    const int grown =
        nb_grow(allocator, &numbers, sizeof *shafts->numbers, 0, &shafts->number_capacity, lights * (NB_BATCH + 1)) &&
        nb_grow(allocator, &pieces, sizeof *shafts->pieces, 0, &shafts->piece_capacity, lights);
    shafts->numbers = numbers;
    shafts->pieces = pieces;
    return grown;
}

static nb_light_place place_light(const nebel_light *light, const double origin[3])
{
    nb_light_place point_light = {.radius = fmax(light->radius, NEBEL_MIN_LIGHT_RADIUS)};
    for (int c = 0; c < 3; c++) point_light.place[c] = light->position[c] - origin[c];
    return point_light;
}

nebel_result nb_light_shafts_find(nb_light_shafts *shafts, const nebel_allocator *allocator, const nb_shadow_tree *tree,
                                  const nebel_lighting *lighting, const nb_lit_box *box, const nb_ray_batch *rays,
                                  double advance, const float *distance)
{
    const nebel_light *lights;
    const size_t count = nebel_get_lighting_lights(lighting, &lights);
    float from[NB_BATCH], to[NB_BATCH];
    if (!reserve_pieces(shafts, allocator, count)) return NEBEL_ERROR_MEMORY;
    nb_sun_shafts_clip(box, rays, advance, distance, from, to);
    shafts->shafts.boundary_count = 0;
    for (size_t i = 0; i < count; i++) {
        const nb_light_place light = place_light(&lights[i], tree->origin);
        uint32_t *numbers = shafts->numbers + i * (NB_BATCH + 1);
        if (!find_light(&shafts->shafts, allocator, tree, &light, from, to, rays, advance, numbers))
            return NEBEL_ERROR_MEMORY;
        shafts->pieces[i].offsets = numbers;
    }
    for (size_t i = 0; i < count; i++) shafts->pieces[i].boundaries = shafts->shafts.boundaries;
    return NEBEL_OK;
}

void nb_light_shafts_free(nb_light_shafts *shafts, const nebel_allocator *allocator)
{
    nb_sun_shafts_free(&shafts->shafts, allocator);
    nb_release(allocator, shafts->numbers);
    nb_release(allocator, shafts->pieces);
}
