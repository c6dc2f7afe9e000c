#include "sun_cells.h"

#include "math/vector.h"

#include <math.h>
#include <string.h>

enum { ENOUGH = 48 }; /* triangles of a cell that is not divided */

/* What is needed while cells are made. */
typedef struct nb_division {
    nb_sun_cells *cells;
    const nebel_allocator *allocator;
    nb_occluders casters;
    nb_sun_cell *bounds; /* of each triangle */
    uint32_t *prism_of;  /* of each triangle; UINT32_MAX: none yet */
    uint32_t *list;      /* numbers of triangles, those of a cell after those of the cells that it is part of */
    size_t list_count, list_capacity;
    nb_sun_cell all; /* of the plane */
} nb_division;

/* A cell that is to be a child, and where its triangles are in the list. */
typedef struct nb_sun_cell_part {
    nb_sun_cell cell;
    size_t first, count;
    float reach[2]; /* sum of what they take of both sides of the cell */
    int is_whole;   /* dividing it helps no more */
} nb_sun_cell_part;

/* ---- prisms ---------------------------------------------------------------------------------- */

static void make_prism(const nb_occluder *t, double side, nb_prism *prism)
{
    double corner[3][3], way[3][3];
    for (int k = 0; k < 3; k++)
        for (int i = 0; i < 3; i++) corner[k][i] = (double)t->corner[k][i];
    for (int k = 0; k < 3; k++) {
        for (int i = 0; i < 3; i++) way[k][i] = corner[(k + 1) % 3][i] - corner[k][i];
        const double n[3] = {-way[k][1] * side, way[k][0] * side, 0};
        nb_shadow_plane(n, corner[k], prism->planes[k]);
    }
    double normal[3];
    nb_vector_cross(way[0], way[1], normal);
    for (int i = 0; i < 3; i++) normal[i] *= side;
    nb_shadow_plane(normal, corner[0], prism->planes[3]);
}

/* Returns 0 when memory is out. */
static int add_prism(nb_division *d, uint32_t triangle)
{
    nb_sun_cells *cells = d->cells;
    const nb_occluder *t = &d->casters.triangles[triangle];
    const size_t count = cells->prism_count, wanted = count + 1;
    void *prisms = cells->prisms, *numbers = cells->numbers;
    const int grown = nb_grow(d->allocator, &prisms, sizeof *cells->prisms, count, &cells->prism_capacity, wanted) &&
                      (d->casters.numbers == NULL ||
                       nb_grow(d->allocator, &numbers, sizeof *cells->numbers, count, &cells->number_capacity, wanted));
    cells->prisms = prisms;
    cells->numbers = numbers;
    if (!grown) return 0;
    if (numbers != NULL) cells->numbers[count] = d->casters.numbers[triangle];
    make_prism(t, nb_caster_area(t) < 0 ? -1 : 1, &cells->prisms[count]);
    d->prism_of[triangle] = (uint32_t)count;
    cells->prism_count = wanted;
    return 1;
}

/* Returns 0 when memory is out. */
static int prism_of(nb_division *d, uint32_t triangle, uint32_t *number)
{
    if (d->prism_of[triangle] == UINT32_MAX && !add_prism(d, triangle)) return 0;
    *number = d->prism_of[triangle];
    return 1;
}

/* ---- nodes ----------------------------------------------------------------------------------- */

/* An empty one. Returns 0 when memory is out. */
static int add_node(nb_division *d, uint32_t *number)
{
    nb_sun_cells *cells = d->cells;
    void *nodes = cells->nodes;
    if (!nb_grow(d->allocator, &nodes, sizeof *cells->nodes, cells->node_count, &cells->node_capacity,
                 cells->node_count + 1))
        return 0;
    cells->nodes = nodes;
    nb_cell_node *node = &cells->nodes[cells->node_count];
    memset(node, 0, sizeof *node);
    for (int k = 0; k < NB_CELL_FAN; k++) node->nearest[k] = node->covered[k] = INFINITY;
    *number = (uint32_t)cells->node_count++;
    return 1;
}

static void set_child(nb_division *d, uint32_t number, int k, const nb_sun_cell *cell, nb_occlusion_depths depths,
                      uint32_t child)
{
    nb_cell_node *node = &d->cells->nodes[number];
    for (int i = 0; i < 2; i++) {
        node->low[i][k] = cell->low[i];
        node->high[i][k] = cell->high[i];
    }
    node->nearest[k] = depths.nearest;
    node->covered[k] = depths.farthest;
    node->child[k] = child;
}

/* What both have of the plane. */
static inline nb_sun_cell common(const nb_sun_cell *a, const nb_sun_cell *b)
{
    nb_sun_cell both;
    for (int i = 0; i < 2; i++) {
        both.low[i] = a->low[i] > b->low[i] ? a->low[i] : b->low[i];
        both.high[i] = a->high[i] < b->high[i] ? a->high[i] : b->high[i];
    }
    return both;
}

/* A node of triangles, or of nodes of as many as there are for each. */
static int add_cell_leaf(nb_division *d, const nb_sun_cell *cell, const uint32_t *list,
                         const nb_occlusion_depths *depths, size_t count, uint32_t *number)
{
    size_t each = 1;
    while (each * NB_CELL_FAN < count) each *= NB_CELL_FAN;
    if (!add_node(d, number)) return 0;
    for (size_t first = 0, k = 0; first < count; first += each, k++) {
        const size_t here = count - first < each ? count - first : each;
        const nb_sun_cell bounds = each == 1 ? common(&d->bounds[list[first]], cell) : *cell;
        nb_occlusion_depths below = {INFINITY, INFINITY};
        uint32_t child;
        for (size_t i = first; i < first + here; i++) below.nearest = nb_least(below.nearest, depths[i].nearest);
        const int made = each == 1 ? prism_of(d, list[first], &child)
                                   : add_cell_leaf(d, cell, list + first, depths + first, here, &child);
        if (!made) return 0;
        set_child(d, *number, (int)k, &bounds, below, each == 1 ? NB_IS_PRISM | child : child);
    }
    return 1;
}

/* ---- cells ----------------------------------------------------------------------------------- */

/* Drops triangles that are behind the cover of the cell: their shadows add nothing to it. `child` has where shadows
 * begin, and from where on all is shadow. */
static int finish_cell(nb_division *d, const nb_sun_cell_part *part, nb_occlusion_depths *child, uint32_t *number)
{
    uint32_t *list = d->list + part->first;
    nb_occlusion_depths *depths = nb_allocate(d->allocator, part->count, sizeof *depths);
    size_t kept = 0;
    if (depths == NULL) return 0;
    for (size_t i = 0; i < part->count; i++)
        depths[i] = nb_depths_in(&d->casters.triangles[list[i]], &d->bounds[list[i]], &part->cell);
    *child = (nb_occlusion_depths){INFINITY, nb_covered_from(&d->casters, list, depths, part->count, &part->cell)};
    for (size_t i = 0; i < part->count; i++) {
        if (depths[i].nearest > child->farthest) continue;
        child->nearest = nb_least(child->nearest, depths[i].nearest);
        depths[kept] = depths[i];
        list[kept++] = list[i];
    }
    const int added =
        add_cell_leaf(d, &part->cell, list, depths, kept, number) &&
        nb_shadow_boundaries_add(&d->cells->walls, d->allocator, &d->casters, list, kept, &part->cell, &d->all);
    nb_release(d->allocator, depths);
    return added;
}

/* Those of the triangles that touch the cell. */
static int list_part(nb_division *d, const nb_sun_cell_part *whole, nb_sun_cell_part *part)
{
    void *grown = d->list;
    if (!nb_grow(d->allocator, &grown, sizeof *d->list, d->list_count, &d->list_capacity, d->list_count + whole->count))
        return 0;
    d->list = grown;
    const uint32_t *from = d->list + whole->first;
    uint32_t *list = d->list + d->list_count;
    size_t count = 0;
    float reach[2] = {0, 0};
    for (size_t i = 0; i < whole->count; i++) {
        const nb_sun_cell both = common(&d->bounds[from[i]], &part->cell);
        const float x = both.high[0] - both.low[0], y = both.high[1] - both.low[1];
        const int touches = (x >= 0) & (y >= 0);
        list[count] = from[i];
        count += (size_t)touches;
        reach[0] += touches ? x : 0;
        reach[1] += touches ? y : 0;
    }
    part->first = d->list_count;
    part->count = count;
    for (int i = 0; i < 2; i++) part->reach[i] = reach[i];
    d->list_count += count;
    return 1;
}

/* Across the side that has more triangles beside each other. Returns 0 when memory is out. */
static int halve(nb_division *d, nb_sun_cell_part *part, nb_sun_cell_part *other)
{
    const nb_sun_cell_part whole = *part;
    const float x = whole.cell.high[0] - whole.cell.low[0], y = whole.cell.high[1] - whole.cell.low[1];
    const int axis = y * whole.reach[0] > x * whole.reach[1];
    const float middle = 0.5f * (whole.cell.low[axis] + whole.cell.high[axis]);
    *other = whole;
    part->cell.high[axis] = other->cell.low[axis] = middle;
    if (!list_part(d, &whole, part) || !list_part(d, &whole, other)) return 0;
    const int helps = 2 * (part->count + other->count) < 3 * whole.count;
    part->is_whole = other->is_whole = !helps;
    return 1;
}

/* The one with most triangles that is to be divided; -1: none is. */
static int largest_part(const nb_sun_cell_part *parts, int count)
{
    int largest = -1;
    for (int k = 0; k < count; k++)
        if (parts[k].count > ENOUGH && !parts[k].is_whole && (largest < 0 || parts[k].count > parts[largest].count))
            largest = k;
    return largest;
}

static int divide(nb_division *d, const nb_sun_cell_part *whole, int level, nb_occlusion_depths *all, uint32_t *number)
{
    nb_sun_cell_part parts[NB_CELL_FAN] = {*whole};
    const size_t used = d->list_count;
    int count = 1, k;
    if (!add_node(d, number)) return 0;
    while (count < NB_CELL_FAN && (k = largest_part(parts, count)) >= 0)
        if (!halve(d, &parts[k], &parts[count++])) return 0;
    *all = (nb_occlusion_depths){INFINITY, -INFINITY};
    for (k = 0; k < count; k++) {
        nb_occlusion_depths depths;
        uint32_t child;
        const int ends = parts[k].count <= ENOUGH || parts[k].is_whole || level + 1 == NB_CELL_LEVELS;
        if (parts[k].count == 0)
            all->farthest = INFINITY;
        else if (ends ? !finish_cell(d, &parts[k], &depths, &child) : !divide(d, &parts[k], level + 1, &depths, &child))
            return 0;
        if (parts[k].count == 0) continue;
        set_child(d, *number, k, &parts[k].cell, depths, child);
        all->nearest = nb_least(all->nearest, depths.nearest);
        all->farthest = nb_most(all->farthest, depths.farthest);
    }
    d->list_count = used;
    return 1;
}

/* ---- all of them ----------------------------------------------------------------------------- */

static void set_axes(const double sun[3], double axes[3][3])
{
    const int steep = fabs(sun[1]) > 0.5;
    const double other[3] = {steep ? 1 : 0, steep ? 0 : 1, 0};
    for (int i = 0; i < 3; i++) axes[2][i] = -sun[i];
    nb_vector_cross(other, axes[2], axes[0]);
    nb_vector_make_unit(axes[0]);
    nb_vector_cross(axes[2], axes[0], axes[1]);
}

static nb_sun_cell bounds_of(const nb_occluder *t)
{
    nb_sun_cell bounds = {{INFINITY, INFINITY}, {-INFINITY, -INFINITY}};
    for (int k = 0; k < 3; k++)
        for (int i = 0; i < 2; i++) {
            bounds.low[i] = nb_least(bounds.low[i], t->corner[k][i]);
            bounds.high[i] = nb_most(bounds.high[i], t->corner[k][i]);
        }
    return bounds;
}

/* All triangles, and the bounds of each. */
static nb_sun_cell_part list_all(nb_division *d, size_t count)
{
    nb_sun_cell_part all = {.cell = {{INFINITY, INFINITY}, {-INFINITY, -INFINITY}}, .count = count};
    for (size_t t = 0; t < count; t++) {
        d->list[t] = (uint32_t)t;
        d->prism_of[t] = UINT32_MAX;
        d->bounds[t] = bounds_of(&d->casters.triangles[t]);
        for (int i = 0; i < 2; i++) {
            all.cell.low[i] = nb_least(all.cell.low[i], d->bounds[t].low[i]);
            all.cell.high[i] = nb_most(all.cell.high[i], d->bounds[t].high[i]);
            all.reach[i] += d->bounds[t].high[i] - d->bounds[t].low[i];
        }
    }
    d->list_count = count;
    return all;
}

static nebel_result build_sun_cells(nb_division *d, const nb_geometry *geometry, const double axes[3][3])
{
    if (nb_occluders_list(geometry, axes, 1, &d->casters) != NEBEL_OK) return NEBEL_ERROR_MEMORY;
    const size_t count = d->casters.count;
    if (count == 0) return NEBEL_OK;
    d->prism_of = nb_allocate(d->allocator, count, sizeof *d->prism_of);
    d->bounds = nb_allocate(d->allocator, count, sizeof *d->bounds);
    d->list = nb_allocate(d->allocator, count, sizeof *d->list);
    if (d->prism_of == NULL || d->bounds == NULL || d->list == NULL) return NEBEL_ERROR_MEMORY;
    d->list_capacity = count;
    d->cells->sheets = d->casters.sheets;
    d->casters.sheets = NULL;
    const nb_sun_cell_part all = list_all(d, count);
    nb_occlusion_depths depths;
    uint32_t number;
    d->all = all.cell;
    return divide(d, &all, 0, &depths, &number) && nb_shadow_boundaries_finish(&d->cells->walls, d->allocator, &d->all)
               ? NEBEL_OK
               : NEBEL_ERROR_MEMORY;
}

nebel_result nb_sun_cells_set(nb_sun_cells *cells, const nb_geometry *geometry, const double sun[3])
{
    if (cells->is_built && memcmp(cells->sun, sun, sizeof cells->sun) == 0 &&
        memcmp(cells->origin, geometry->origin, sizeof cells->origin) == 0)
        return NEBEL_OK;
    nb_division division = {.cells = cells, .allocator = &geometry->allocator};
    double axes[3][3];
    nb_sun_cells_free(cells, &geometry->allocator);
    set_axes(sun, axes);
    const nebel_result result = build_sun_cells(&division, geometry, (const double(*)[3])axes);
    nb_occluders_free(&division.casters, &geometry->allocator);
    nb_release(&geometry->allocator, division.prism_of);
    nb_release(&geometry->allocator, division.bounds);
    nb_release(&geometry->allocator, division.list);
    if (result != NEBEL_OK) {
        nb_sun_cells_free(cells, &geometry->allocator);
        return result;
    }
    memcpy(cells->sun, sun, sizeof cells->sun);
    memcpy(cells->origin, geometry->origin, sizeof cells->origin);
    for (int i = 0; i < 3; i++)
        for (int k = 0; k < 3; k++) cells->axes[i][k] = (float)axes[i][k];
    cells->is_built = 1;
    return NEBEL_OK;
}

void nb_sun_cells_free(nb_sun_cells *cells, const nebel_allocator *allocator)
{
    nb_release(allocator, cells->prisms);
    nb_release(allocator, cells->numbers);
    nb_release(allocator, cells->sheets);
    nb_release(allocator, cells->nodes);
    nb_shadow_boundaries_free(&cells->walls, allocator);
    *cells = (nb_sun_cells){.is_built = 0};
}
