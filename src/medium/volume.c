#include "volume.h"

#include "affine_quad.h"
#include "base/precision.h"
#include "medium_check.h"
#include "grid.h"
#include "leaf.h"

#include <math.h>
#include <string.h>

typedef struct nb_counts {
    size_t leaves, faces, steps;
} nb_counts;

static int is_group(const nebel_shape *shape)
{
    return shape->type == NEBEL_SHAPE_UNION || shape->type == NEBEL_SHAPE_INTERSECTION;
}

static void count_shape(const nebel_shape *shape, nb_counts *counts)
{
    if (is_group(shape)) {
        for (size_t i = 0; i < shape->part_count; i++) count_shape(&shape->parts[i], counts);
        counts->steps += shape->part_count - 1;
        return;
    }
    counts->leaves++;
    counts->steps++;
    if (shape->type == NEBEL_SHAPE_HALF_SPACE) counts->faces++;
    if (shape->type == NEBEL_SHAPE_CONVEX) counts->faces += shape->plane_count;
}

/* One allocation, leaves first: they ask for the strictest alignment. */
static int allocate_arrays(const nebel_allocator *allocator, nb_volume *volume)
{
    const size_t leaves = volume->leaf_count * sizeof(nb_leaf), faces = volume->face_count * sizeof(nb_face);
    char *memory = nb_allocate_zero(allocator, leaves + faces + volume->step_count * sizeof(nb_shape_op), 1);
    if (memory == NULL) return 0;
    volume->leaves = (nb_leaf *)(void *)memory;
    volume->faces = (nb_face *)(void *)(memory + leaves);
    volume->steps = (nb_shape_op *)(void *)(memory + leaves + faces);
    return 1;
}

/* How far resolving has come, and where messages go. */
typedef struct nb_volume_builder {
    const nebel_log *log;
    nb_volume *volume;
    nb_counts used;
} nb_volume_builder;

static nebel_result add_shape(nb_volume_builder *b, const nebel_shape *shape, const nb_affine_quad *above,
                              double low[3], double high[3]);

static nebel_result add_leaf(nb_volume_builder *b, const nebel_shape *shape, const nb_affine_quad *world, double low[3],
                             double high[3])
{
    nb_leaf *leaf = &b->volume->leaves[b->used.leaves++];
    const nebel_result result =
        nb_leaf_resolve(b->log, shape, world, &b->volume->faces[b->used.faces], b->used.faces, leaf, low, high);
    b->used.faces += leaf->face_count;
    b->volume->steps[b->used.steps++] = NB_OP_LEAF;
    return result;
}

static nebel_result add_group(nb_volume_builder *b, const nebel_shape *shape, const nb_affine_quad *world,
                              double low[3], double high[3])
{
    const int any = shape->type == NEBEL_SHAPE_UNION;
    for (size_t i = 0; i < shape->part_count; i++) {
        double l[3], h[3];
        const nebel_result result = add_shape(b, &shape->parts[i], world, l, h);
        if (result != NEBEL_OK) return result;
        if (i > 0) b->volume->steps[b->used.steps++] = any ? NB_OP_UNION : NB_OP_INTERSECTION;
        for (int k = 0; k < 3; k++) {
            low[k] = i == 0 ? l[k] : any ? fmin(low[k], l[k]) : fmax(low[k], l[k]);
            high[k] = i == 0 ? h[k] : any ? fmax(high[k], h[k]) : fmin(high[k], h[k]);
        }
    }
    return NEBEL_OK;
}

static int is_moved(const nebel_transform *t)
{
    for (int i = 0; i < 3; i++)
        if (t->position[i] != 0 || t->rotation[i] != 0 || t->scale[i] != 0) return 1;
    return t->rotation[3] != 0;
}

static nebel_result add_shape(nb_volume_builder *b, const nebel_shape *shape, const nb_affine_quad *above,
                              double low[3], double high[3])
{
    nb_affine_quad world = *above;
    if (is_moved(&shape->transform)) {
        const nb_affine_quad own = nb_affine_from_transform(&shape->transform);
        world = nb_affine_compose(above, &own);
    }
    return is_group(shape) ? add_group(b, shape, &world, low, high) : add_leaf(b, shape, &world, low, high);
}

/* Only what the type reads, so that equal densities are equal bytes to nb_volume_compare. */
static nebel_density resolve_density(const nebel_density *from)
{
    nebel_density to = {.type = from->type};
    switch (from->type) {
    case NEBEL_DENSITY_ALTITUDE:
        memcpy(to.center, from->center, sizeof to.center);
        to.radius = from->radius;
        /* fall through */
    case NEBEL_DENSITY_HEIGHT:
        to.below = from->below;
        to.base = from->base;
        to.scale_height = from->scale_height;
        break;
    case NEBEL_DENSITY_LINEAR:
        memcpy(to.from, from->from, sizeof to.from);
        memcpy(to.to, from->to, sizeof to.to);
        break;
    case NEBEL_DENSITY_RADIAL:
        to.power = from->power;
        break;
    case NEBEL_DENSITY_GAUSSIAN:
        memcpy(to.center, from->center, sizeof to.center);
        to.sigma = from->sigma;
        break;
    case NEBEL_DENSITY_SOFT_EDGE:
        to.edge_width = from->edge_width;
        break;
    case NEBEL_DENSITY_GRID:
        to.grid = nebel_retain_grid(from->grid);
        break;
    default:
        break;
    }
    return to;
}

/* Of places whose distance is_extent: squares stay finite. hypot's last digit hangs on the C library. */
static double distance_between(const double a[3], const double b[3])
{
    const double x = a[0] - b[0], y = a[1] - b[1], z = a[2] - b[2];
    return sqrt(x * x + y * y + z * z);
}

static nb_soft_edge resolve_edge(const nebel_shape *shape, double distance)
{
    double radius = shape->radius;
    if (shape->type == NEBEL_SHAPE_ELLIPSOID) radius = fmin(fmin(shape->radii[0], shape->radii[1]), shape->radii[2]);
    if (shape->type == NEBEL_SHAPE_CONE) radius = fmax(shape->radius_from, shape->radius_to);
    const double depth = fmin(distance / radius, 1);
    return (nb_soft_edge){1 / (depth * (2 - depth)), distance_between(shape->from, shape->to) / distance, 1 - depth};
}

static int is_round(const nebel_shape *shape)
{
    return shape->type == NEBEL_SHAPE_SPHERE || shape->type == NEBEL_SHAPE_ELLIPSOID ||
           shape->type == NEBEL_SHAPE_CYLINDER || shape->type == NEBEL_SHAPE_CAPSULE || shape->type == NEBEL_SHAPE_CONE;
}

static void resolve_light(const nebel_volume_desc *desc, nb_volume *volume)
{
    volume->phase = nb_phase_resolve(&desc->phase);
    volume->described_phase = desc->phase;
    for (int i = 0; i < 3; i++) {
        volume->extinction[i] = desc->extinction[i];
        volume->source[i] = desc->source[i];
        volume->albedo[i] = desc->albedo[i];
        volume->emission[i] = desc->emission[i];
        volume->lit = volume->lit || desc->albedo[i] > 0;
    }
}

/* An exclusion stands above the fog of its priority, and below that of the next. */
static int64_t rank_of(const nebel_volume_desc *desc)
{
    return 2 * (int64_t)desc->priority + (desc->operation == NEBEL_OPERATION_EXCLUDE);
}

nebel_result nb_volume_resolve(const nebel_allocator *allocator, const nebel_log *log, const nebel_volume_desc *desc,
                               nb_volume *volume)
{
    const nebel_result valid = nb_check_volume(log, desc);
    if (valid != NEBEL_OK) return valid;
    nb_counts counts = {0, 0, 0};
    count_shape(&desc->shape, &counts);
    *volume = (nb_volume){.operation = desc->operation,
                          .rank = rank_of(desc),
                          .leaf_count = counts.leaves,
                          .face_count = counts.faces,
                          .step_count = counts.steps,
                          .start = desc->start,
                          .cutoff = desc->cutoff > 0 ? desc->cutoff : HUGE_VAL};
    if (!allocate_arrays(allocator, volume)) return nb_fail(log, NEBEL_ERROR_MEMORY, "volume: out of memory");
    if (nb_volume_has_fog(volume)) {
        volume->density = resolve_density(&desc->density);
        if (desc->density.type == NEBEL_DENSITY_SOFT_EDGE && is_round(&desc->shape))
            volume->edge = resolve_edge(&desc->shape, desc->density.edge_width);
        resolve_light(desc, volume);
    }
    nb_volume_builder b = {log, volume, {0, 0, 0}};
    const nb_affine_quad world = nb_affine_identity();
    const unsigned precision = nb_full_precision();
    const nebel_result result = add_shape(&b, &desc->shape, &world, volume->low, volume->high);
    nb_restore_precision(precision);
    if (result != NEBEL_OK) nb_volume_free(allocator, volume);
    return result;
}

int nb_volume_copy(const nebel_allocator *allocator, const nb_volume *from, nb_volume *to)
{
    *to = *from;
    if (!allocate_arrays(allocator, to)) return 0;
    nebel_retain_grid(to->density.grid);
    memcpy(to->leaves, from->leaves, from->leaf_count * sizeof *from->leaves);
    if (from->face_count > 0) memcpy(to->faces, from->faces, from->face_count * sizeof *from->faces);
    memcpy(to->steps, from->steps, from->step_count * sizeof *from->steps);
    return 1;
}

void nb_volume_free(const nebel_allocator *allocator, nb_volume *volume)
{
    nb_release(allocator, volume->leaves);
    nebel_release_grid(volume->density.grid);
    volume->density.grid = NULL;
    volume->leaves = NULL;
    volume->faces = NULL;
    volume->steps = NULL;
}

static int compare_numbers(const double *a, const double *b, size_t n)
{
    for (size_t i = 0; i < n; i++)
        if (a[i] != b[i]) return a[i] < b[i] ? -1 : 1;
    return 0;
}

static int compare_sizes(size_t a, size_t b)
{
    return (a > b) - (a < b);
}

static int compare_density(const nebel_density *a, const nebel_density *b)
{
    const double x[] = {(double)a->type, (double)a->below, a->base,  a->scale_height, a->from[0], a->from[1],
                        a->from[2],      a->to[0],         a->to[1], a->to[2],        a->power,   a->center[0],
                        a->center[1],    a->center[2],     a->sigma, a->edge_width};
    const double y[] = {(double)b->type, (double)b->below, b->base,  b->scale_height, b->from[0], b->from[1],
                        b->from[2],      b->to[0],         b->to[1], b->to[2],        b->power,   b->center[0],
                        b->center[1],    b->center[2],     b->sigma, b->edge_width};
    const int order = compare_numbers(x, y, sizeof x / sizeof *x);
    return order == 0 ? nb_grid_compare(a->grid, b->grid) : order;
}

static int compare_quads(const nb_quad *a, const nb_quad *b, size_t n)
{
    for (size_t i = 0; i < n; i++)
        if (a[i] != b[i]) return a[i] < b[i] ? -1 : 1;
    return 0;
}

static int compare_leaf(const nb_leaf *a, const nb_leaf *b)
{
    int order = (a->type > b->type) - (a->type < b->type);
    if (order == 0) order = compare_quads(a->quad_origin, b->quad_origin, 3);
    if (order == 0) order = compare_quads(a->quad_matrix, b->quad_matrix, 9);
    if (order == 0) order = compare_numbers(a->low, b->low, 3);
    if (order == 0) order = compare_numbers(a->high, b->high, 3);
    if (order == 0) order = compare_quads(&a->quad_radius, &b->quad_radius, 1);
    if (order == 0) order = compare_quads(&a->quad_slope, &b->quad_slope, 1);
    if (order == 0) order = compare_quads(&a->quad_length, &b->quad_length, 1);
    if (order == 0) order = compare_sizes(a->face_count, b->face_count);
    return order;
}

static int compare_body(const nb_volume *a, const nb_volume *b)
{
    int order = compare_sizes(a->leaf_count, b->leaf_count);
    if (order == 0) order = compare_sizes(a->step_count, b->step_count);
    for (size_t i = 0; i < a->step_count && order == 0; i++)
        order = (a->steps[i] > b->steps[i]) - (a->steps[i] < b->steps[i]);
    for (size_t i = 0; i < a->leaf_count && order == 0; i++) order = compare_leaf(&a->leaves[i], &b->leaves[i]);
    for (size_t i = 0; i < a->face_count && order == 0; i++) {
        order = compare_numbers(a->faces[i].normal, b->faces[i].normal, 3);
        if (order == 0) order = compare_numbers(&a->faces[i].distance, &b->faces[i].distance, 1);
    }
    return order;
}

int nb_volume_compare(const nb_volume *a, const nb_volume *b)
{
    int order = (a->rank > b->rank) - (a->rank < b->rank);
    if (order == 0) order = nb_volume_covers(b) - nb_volume_covers(a);
    if (order == 0) order = compare_numbers(a->extinction, b->extinction, 3);
    if (order == 0) order = compare_numbers(a->source, b->source, 3);
    if (order == 0) order = compare_numbers(a->albedo, b->albedo, 3);
    if (order == 0) order = compare_numbers(a->emission, b->emission, 3);
    if (order == 0) order = nb_phase_compare(&a->phase, &b->phase);
    if (order == 0) order = compare_density(&a->density, &b->density);
    if (order == 0) order = compare_numbers(&a->edge.gain, &b->edge.gain, 1);
    if (order == 0) order = compare_numbers(&a->edge.steepness, &b->edge.steepness, 1);
    if (order == 0) order = compare_numbers(&a->start, &b->start, 1);
    if (order == 0) order = compare_numbers(&a->cutoff, &b->cutoff, 1);
    return order == 0 ? compare_body(a, b) : order;
}
