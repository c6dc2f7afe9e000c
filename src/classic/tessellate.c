/* Triangles halved at their longest edges until a proven bound of the interpolated fog's error is met. A triangle that
 * has a halved edge is halved, too, at its own longest edge first, until none has: Rivara's refinement, which ends,
 * because what it asks of neighbours goes to longer edges only, and keeps angles (M.-C. Rivara, "Algorithms for
 * refining triangular grids", 1984).
 *
 * Vertices at one place are one point: edges join points, so that triangles on both sides of a seam know the same edge.
 * What lies in its middle is one vertex for each pair of vertices that triangles have there. */
#include <nebel/classic.h>

#include "vertex_error_bound.h"

#include <math.h>
#include <string.h>

#define NONE UINT32_MAX

typedef struct mesh_edge {
    uint32_t ends[2];   /* points, ascending */
    uint32_t halves[2]; /* edges; NONE: it is whole */
    double square;      /* of its length; 0 also where floats have no place between its ends */
} mesh_edge;

/* A vertex in the middle of an edge. */
typedef struct edge_middle {
    uint32_t vertex, next;
} edge_middle;

typedef struct nb_split_triangle {
    uint32_t corners[3]; /* vertices */
    uint32_t edges[3];   /* from a corner to the next */
    float error;         /* its bound; below 0: not asked for yet */
    unsigned depth;
} nb_split_triangle;

typedef struct mesh {
    nebel_tessellation made; /* first: what the caller sees */
    nebel_allocator allocator;
    const nebel_snapshot *snapshot;
    nebel_tessellation_desc desc;
    double from_eye[3]; /* where positions count from */
    float (*positions)[3];
    uint32_t *points; /* of each vertex: the first vertex at its place */
    uint32_t (*parents)[2];
    mesh_edge *edges;
    uint32_t *middle_of; /* of each edge: the first of the vertices in its middle; NONE: it is whole */
    edge_middle *middles;
    nb_split_triangle *triangles;
    uint32_t *indices;
    nb_fog_bound *bound;
    uint32_t *queue; /* triangles that may have to be halved, the oldest first */
    size_t vertex_count, edge_count, middle_count, triangle_count, queue_count;
    size_t vertex_room, point_room, parent_room, edge_room, middle_of_room, middle_room, triangle_room, queue_room;
} mesh;

/* ---- rooms ----------------------------------------------------------------------------------- */

#define GROW(m, array, count, room)                                                                                    \
    nb_grow(&(m)->allocator, (void **)&(m)->array, sizeof *(m)->array, (m)->count, &(m)->room, (m)->count + 1)

static nebel_result grow_vertices(mesh *m)
{
    const size_t added = m->vertex_count - m->made.input_vertex_count;
    if (m->vertex_count >= NONE) return NEBEL_ERROR_LIMIT;
    if (!GROW(m, positions, vertex_count, vertex_room) || !GROW(m, points, vertex_count, point_room) ||
        !nb_grow(&m->allocator, (void **)&m->parents, sizeof *m->parents, added, &m->parent_room, added + 1))
        return NEBEL_ERROR_MEMORY;
    return NEBEL_OK;
}

static nebel_result add_edge(mesh *m, uint32_t a, uint32_t b, uint32_t *number)
{
    if (m->edge_count >= NONE) return NEBEL_ERROR_LIMIT;
    if (!GROW(m, edges, edge_count, edge_room) || !GROW(m, middle_of, edge_count, middle_of_room))
        return NEBEL_ERROR_MEMORY;
    m->middle_of[m->edge_count] = NONE;
    mesh_edge *const e = &m->edges[m->edge_count];
    *e = (mesh_edge){{a < b ? a : b, a < b ? b : a}, {NONE, NONE}, 0};
    const float *const p = m->positions[e->ends[0]], *const q = m->positions[e->ends[1]];
    int is_between = 0;
    for (int i = 0; i < 3; i++) {
        const double way = (double)q[i] - (double)p[i];
        const float half = (float)(.5 * ((double)p[i] + (double)q[i]));
        e->square += way * way;
        is_between |= half != p[i] && half != q[i];
    }
    if (!is_between) e->square = 0;
    *number = (uint32_t)m->edge_count++;
    return NEBEL_OK;
}

/* ---- halving --------------------------------------------------------------------------------- */

static int is_halved(const mesh *m, uint32_t e)
{
    return m->middle_of[e] != NONE;
}

/* The longest of a triangle's edges that can be halved; 3: there is none. Of equal ones the first of the mesh, for all
 * triangles. */
static int find_longest(const mesh *m, const nb_split_triangle *t)
{
    int longest = 3;
    double square = 0;
    for (int i = 0; i < 3; i++) {
        const double other = m->edges[t->edges[i]].square;
        if (other > square || (other == square && other > 0 && t->edges[i] < t->edges[longest])) longest = i;
        square = other > square ? other : square;
    }
    return longest;
}

static nebel_result add_vertex(mesh *m, uint32_t a, uint32_t b, uint32_t *vertex)
{
    const nebel_result result = grow_vertices(m);
    if (result != NEBEL_OK) return result;
    const uint32_t made = (uint32_t)m->vertex_count;
    const size_t added = m->vertex_count - m->made.input_vertex_count;
    for (int i = 0; i < 3; i++)
        m->positions[made][i] = (float)(.5 * ((double)m->positions[a][i] + (double)m->positions[b][i]));
    m->parents[added][0] = a < b ? a : b;
    m->parents[added][1] = a < b ? b : a;
    m->points[made] = made;
    m->vertex_count++;
    *vertex = made;
    return NEBEL_OK;
}

static int has_parents(const mesh *m, uint32_t vertex, uint32_t a, uint32_t b)
{
    const uint32_t *const parents = m->parents[vertex - m->made.input_vertex_count];
    return parents[0] == (a < b ? a : b) && parents[1] == (a < b ? b : a);
}

/* The vertex between two that are at the ends of an edge; the edge is halved where it was whole. */
static nebel_result find_middle(mesh *m, uint32_t number, uint32_t a, uint32_t b, uint32_t *vertex)
{
    const uint32_t first = m->middle_of[number];
    for (uint32_t i = first; i != NONE; i = m->middles[i].next) {
        *vertex = m->middles[i].vertex;
        if (has_parents(m, *vertex, a, b)) return NEBEL_OK;
    }
    nebel_result result = add_vertex(m, a, b, vertex);
    if (result != NEBEL_OK) return result;
    if (!GROW(m, middles, middle_count, middle_room)) return NEBEL_ERROR_MEMORY;
    for (int i = 0; i < 2 && first == NONE && result == NEBEL_OK; i++) {
        uint32_t half;
        result = add_edge(m, m->edges[number].ends[i], *vertex, &half);
        if (result == NEBEL_OK) m->edges[number].halves[i] = half;
    }
    if (result != NEBEL_OK) return result;
    if (first != NONE) m->points[*vertex] = m->points[m->middles[first].vertex];
    m->middles[m->middle_count] = (edge_middle){*vertex, first};
    m->middle_of[number] = (uint32_t)m->middle_count++;
    return NEBEL_OK;
}

/* The half of an edge at a point. */
static uint32_t half_at(const mesh *m, uint32_t number, uint32_t point)
{
    const mesh_edge *const e = &m->edges[number];
    return e->halves[e->ends[0] == point ? 0 : 1];
}

static void set_error(const mesh *m, nb_split_triangle *t)
{
    double ways[3][3];
    for (int c = 0; c < 3; c++)
        for (int i = 0; i < 3; i++) ways[c][i] = m->from_eye[i] + (double)m->positions[t->corners[c]][i];
    const double error = nb_bound_fog(m->bound, (const double(*)[3])ways);
    t->error = fminf(nextafterf((float)error, 2), 1); /* two numbers from 0 to 1 are no farther apart */
}

static nebel_result halve(mesh *m, size_t number, int at)
{
    if (!GROW(m, triangles, triangle_count, triangle_room)) return NEBEL_ERROR_MEMORY;
    const nb_split_triangle was = m->triangles[number];
    const int next = (at + 1) % 3, last = (at + 2) % 3;
    const uint32_t a = was.corners[at], b = was.corners[next], c = was.corners[last];
    uint32_t vertex, between;
    nebel_result result = find_middle(m, was.edges[at], a, b, &vertex);
    if (result == NEBEL_OK) result = add_edge(m, m->points[vertex], m->points[c], &between);
    if (result != NEBEL_OK) return result;
    nb_split_triangle *const left = &m->triangles[number], *const right = &m->triangles[m->triangle_count++];
    const uint32_t left_half = half_at(m, was.edges[at], m->points[a]);
    const uint32_t right_half = half_at(m, was.edges[at], m->points[b]);
    *left = (nb_split_triangle){{a, vertex, c}, {left_half, between, was.edges[last]}, -1, was.depth + 1};
    *right = (nb_split_triangle){{vertex, b, c}, {right_half, was.edges[next], between}, -1, was.depth + 1};
    return NEBEL_OK;
}

/* ---- refinement ------------------------------------------------------------------------------ */

static int has_halved_edge(const mesh *m, const nb_split_triangle *t)
{
    return is_halved(m, t->edges[0]) || is_halved(m, t->edges[1]) || is_halved(m, t->edges[2]);
}

/* The edge at which a triangle is to be halved; 3: it stays. What neighbours have halved needs no bound. */
static int choose_edge(const mesh *m, nb_split_triangle *t)
{
    if (has_halved_edge(m, t)) return find_longest(m, t);
    if (t->error < 0) set_error(m, t);
    const int is_over = (double)t->error > m->desc.max_error && t->depth < m->desc.max_depth &&
                        m->triangle_count < m->desc.max_triangles;
    return is_over ? find_longest(m, t) : 3;
}

static nebel_result enqueue(mesh *m, size_t number)
{
    if (number >= NONE) return NEBEL_ERROR_LIMIT;
    if (!GROW(m, queue, queue_count, queue_room)) return NEBEL_ERROR_MEMORY;
    m->queue[m->queue_count++] = (uint32_t)number;
    return NEBEL_OK;
}

/* Halves what is in the queue, and the halves in their turn. */
static nebel_result work_off(mesh *m)
{
    nebel_result result = NEBEL_OK;
    for (size_t i = 0; i < m->queue_count && result == NEBEL_OK; i++) {
        const size_t number = m->queue[i];
        const int at = choose_edge(m, &m->triangles[number]);
        if (at == 3) continue;
        result = halve(m, number, at);
        if (result == NEBEL_OK) result = enqueue(m, number);
        if (result == NEBEL_OK) result = enqueue(m, m->triangle_count - 1);
    }
    m->queue_count = 0;
    return result;
}

/* First for the error; then for neighbours, until no triangle has a halved edge. */
static nebel_result refine(mesh *m)
{
    nebel_result result = NEBEL_OK;
    for (size_t i = 0; i < m->triangle_count && result == NEBEL_OK; i++) result = enqueue(m, i);
    while (m->queue_count > 0 && result == NEBEL_OK) {
        result = work_off(m);
        for (size_t i = 0; i < m->triangle_count && result == NEBEL_OK; i++)
            if (has_halved_edge(m, &m->triangles[i])) result = enqueue(m, i);
    }
    return result;
}

/* ---- the mesh as it is given ------------------------------------------------------------------ */

/* Numbers by what they stand for; a power of two of places, NONE where there is none. */
typedef struct table {
    uint32_t *numbers;
    size_t mask;
} table;

static int make_table(const mesh *m, size_t count, table *made)
{
    size_t size = 16;
    while (size < 2 * count) size *= 2;
    made->numbers = nb_allocate(&m->allocator, size, sizeof *made->numbers);
    made->mask = size - 1;
    if (made->numbers != NULL) memset(made->numbers, 0xff, size * sizeof *made->numbers);
    return made->numbers != NULL;
}

/* Multiplications and shifts that let every bit of the input reach every bit of the result. */
static size_t stir(uint32_t a, uint32_t b, uint32_t c)
{
    uint64_t bits =
        a * UINT64_C(0x9e3779b97f4a7c15) ^ b * UINT64_C(0xc2b2ae3d27d4eb4f) ^ c * UINT64_C(0x165667b19e3779f9);
    bits = (bits ^ bits >> 32) * UINT64_C(0xd6e8feb86659fd93);
    return (size_t)(bits ^ bits >> 32);
}

static uint32_t bits_of(float x)
{
    const float no_sign_of_zero = x + 0.f;
    uint32_t bits;
    memcpy(&bits, &no_sign_of_zero, sizeof bits);
    return bits;
}

static void join_points(mesh *m, const table *seen)
{
    for (uint32_t v = 0; v < m->vertex_count; v++) {
        const float *const p = m->positions[v];
        m->points[v] = v;
        if (isnan(p[0]) || isnan(p[1]) || isnan(p[2])) continue; /* equals nothing */
        size_t at = stir(bits_of(p[0]), bits_of(p[1]), bits_of(p[2])) & seen->mask;
        while (seen->numbers[at] != NONE) {
            const float *const other = m->positions[seen->numbers[at]];
            if (other[0] == p[0] && other[1] == p[1] && other[2] == p[2]) break;
            at = (at + 1) & seen->mask;
        }
        if (seen->numbers[at] == NONE) seen->numbers[at] = v;
        m->points[v] = seen->numbers[at];
    }
}

static nebel_result join_edge(mesh *m, const table *seen, uint32_t a, uint32_t b, uint32_t *number)
{
    const uint32_t low = a < b ? a : b, high = a < b ? b : a;
    size_t at = stir(low, high, 0) & seen->mask;
    while (seen->numbers[at] != NONE) {
        const mesh_edge *const e = &m->edges[seen->numbers[at]];
        if (e->ends[0] == low && e->ends[1] == high) break;
        at = (at + 1) & seen->mask;
    }
    *number = seen->numbers[at];
    if (*number != NONE) return NEBEL_OK;
    const nebel_result result = add_edge(m, a, b, number);
    if (result == NEBEL_OK) seen->numbers[at] = *number;
    return result;
}

static nebel_result join_edges(mesh *m, const table *seen)
{
    nebel_result result = NEBEL_OK;
    for (size_t i = 0; i < m->triangle_count && result == NEBEL_OK; i++) {
        nb_split_triangle *const t = &m->triangles[i];
        for (int k = 0; k < 3 && result == NEBEL_OK; k++)
            result = join_edge(m, seen, m->points[t->corners[k]], m->points[t->corners[(k + 1) % 3]], &t->edges[k]);
    }
    return result;
}

static void copy_positions(mesh *m, const nebel_triangles *given)
{
    const size_t size = sizeof *m->positions, stride = given->position_stride != 0 ? given->position_stride : size;
    for (size_t v = 0; v < given->vertex_count; v++)
        memcpy(m->positions[v], (const unsigned char *)given->positions + v * stride, size);
    for (size_t i = 0; i < given->triangle_count; i++)
        m->triangles[i] = (nb_split_triangle){
            .corners = {given->indices[3 * i], given->indices[3 * i + 1], given->indices[3 * i + 2]}, .error = -1};
}

static int make_rooms(mesh *m, const nebel_triangles *given)
{
    m->vertex_count = m->made.input_vertex_count = given->vertex_count;
    m->triangle_count = given->triangle_count;
    m->vertex_room = m->point_room = given->vertex_count;
    m->triangle_room = given->triangle_count;
    m->positions = nb_allocate(&m->allocator, given->vertex_count, sizeof *m->positions);
    m->points = nb_allocate(&m->allocator, given->vertex_count, sizeof *m->points);
    m->triangles = nb_allocate(&m->allocator, given->triangle_count, sizeof *m->triangles);
    return m->positions != NULL && m->points != NULL && m->triangles != NULL;
}

static nebel_result fail_value(const mesh *m, const char *what, size_t number)
{
    return nb_fail(&m->snapshot->log, NEBEL_ERROR_VALUE,
                   "tessellation: %s %zu: a vertex is not finite, or is more than 5e5 m from the eye", what, number);
}

static nebel_result check_corners(const mesh *m)
{
    for (size_t i = 0; i < m->triangle_count; i++)
        for (int c = 0; c < 3; c++)
            for (int k = 0; k < 3; k++) {
                const double way = m->from_eye[k] + (double)m->positions[m->triangles[i].corners[c]][k];
                if (!(fabs(way) <= NB_FARTHEST_BOUND)) return fail_value(m, "triangle", i);
            }
    return NEBEL_OK;
}

static nebel_result take(mesh *m, const nebel_triangles *given)
{
    table points = {NULL, 0}, edges = {NULL, 0};
    if (!make_rooms(m, given)) return NEBEL_ERROR_MEMORY;
    copy_positions(m, given);
    nebel_result result = check_corners(m);
    if (result != NEBEL_OK) return result;
    if (!make_table(m, given->vertex_count, &points) || !make_table(m, 3 * given->triangle_count, &edges))
        result = NEBEL_ERROR_MEMORY;
    if (result == NEBEL_OK) {
        join_points(m, &points);
        result = join_edges(m, &edges);
    }
    nb_release(&m->allocator, points.numbers);
    nb_release(&m->allocator, edges.numbers);
    return result;
}

/* ---- the public face --------------------------------------------------------------------------- */

static const char *tessellation_fault(const nebel_tessellation_desc *desc, const nebel_triangles *given)
{
    if (!nb_allocator_is_valid(&desc->host.allocator)) return "the allocator needs both functions or neither";
    if (desc->channel < 0 || desc->channel > 2) return "channel is none of 0, 1, 2";
    if (desc->max_depth > 48) return "max_depth is more than 48";
    if (given->position_stride != 0 && given->position_stride < 12) return "position_stride is less than 12";
    if ((given->vertex_count > 0 && given->positions == NULL) || (given->triangle_count > 0 && given->indices == NULL))
        return "positions and indices must not be NULL";
    if (given->vertex_count >= NONE || given->triangle_count > NONE / 3)
        return "there are too many vertices or triangles";
    for (size_t i = 0; i < 3 * given->triangle_count; i++)
        if (given->indices[i] >= given->vertex_count) return "an index is too large";
    return NULL;
}

static int are_values(const nebel_tessellation_desc *desc, const nebel_triangles *given)
{
    for (int i = 0; i < 3; i++)
        if (!(fabs(desc->eye[i]) <= NEBEL_MAX_LENGTH) || !(fabs(given->origin[i]) <= NEBEL_MAX_LENGTH)) return 0;
    return desc->max_error >= 0 && isfinite(desc->max_error);
}

static void *finish_indices(mesh *m)
{
    m->indices = nb_allocate(&m->allocator, m->triangle_count, 3 * sizeof *m->indices);
    for (size_t i = 0; i < m->triangle_count && m->indices != NULL; i++) {
        const nb_split_triangle *const t = &m->triangles[i];
        for (size_t k = 0; k < 3; k++) m->indices[3 * i + k] = t->corners[k];
        m->made.error = fmax(m->made.error, (double)t->error);
        if ((double)t->error <= m->desc.max_error) continue;
        m->made.unresolved_count++;
        m->made.depth_limited_count += t->depth >= m->desc.max_depth;
    }
    return m->indices;
}

/* What was needed only to find the result goes. */
static nebel_result finish(mesh *m, size_t triangle_count)
{
    if (finish_indices(m) == NULL) return NEBEL_ERROR_MEMORY;
    m->made.vertex_count = m->vertex_count;
    m->made.triangle_count = m->triangle_count;
    m->made.added_triangles = m->triangle_count - triangle_count;
    m->made.positions = (const float(*)[3])m->positions;
    m->made.parents = (const uint32_t(*)[2])m->parents;
    m->made.indices = m->indices;
    nb_release(&m->allocator, m->edges);
    nb_release(&m->allocator, m->middle_of);
    nb_release(&m->allocator, m->middles);
    nb_release(&m->allocator, m->triangles);
    nb_release(&m->allocator, m->points);
    nb_release(&m->allocator, m->queue);
    nb_free_fog_bound(m->bound);
    m->bound = NULL;
    m->queue = NULL;
    m->edges = NULL;
    m->middle_of = NULL;
    m->middles = NULL;
    m->triangles = NULL;
    m->points = NULL;
    return NEBEL_OK;
}

static nebel_result tessellate(mesh *m, const nebel_triangles *given)
{
    nebel_result result = nb_make_fog_bound(&m->allocator, m->snapshot, m->desc.eye, m->desc.channel, &m->bound);
    if (result == NEBEL_OK) result = take(m, given);
    if (result == NEBEL_OK) result = refine(m);
    if (result == NEBEL_OK) result = finish(m, given->triangle_count);
    if (result == NEBEL_ERROR_MEMORY || result == NEBEL_ERROR_LIMIT)
        return nb_fail(&m->snapshot->log, result, "tessellation: %zu triangles: %s", m->triangle_count,
                       nebel_result_text(result));
    return result;
}

nebel_result nebel_tessellate(const nebel_snapshot *snapshot, const nebel_tessellation_desc *desc,
                              const nebel_triangles *triangles, nebel_tessellation **tessellation)
{
    if (tessellation == NULL) return NEBEL_ERROR_ARGUMENT;
    *tessellation = NULL;
    if (snapshot == NULL || desc == NULL || triangles == NULL) return NEBEL_ERROR_ARGUMENT;
    const nebel_log *const log = &snapshot->log;
    const char *const fault = tessellation_fault(desc, triangles);
    if (fault != NULL) return nb_fail(log, NEBEL_ERROR_ARGUMENT, "tessellation: %s", fault);
    if (!are_values(desc, triangles))
        return nb_fail(log, NEBEL_ERROR_VALUE, "tessellation: bound, eye and origin must be finite, the bound >= 0");
    const nebel_allocator allocator = nb_resolve_allocator(&desc->host.allocator);
    mesh *const m = nb_allocate_zero(&allocator, 1, sizeof *m);
    if (m == NULL) return nb_fail(log, NEBEL_ERROR_MEMORY, "tessellation: out of memory");
    m->allocator = allocator;
    m->snapshot = snapshot;
    m->desc = *desc;
    if (desc->max_error == 0) m->desc.max_error = 1. / 255;
    if (desc->max_depth == 0) m->desc.max_depth = 20;
    if (desc->max_triangles == 0) m->desc.max_triangles = (size_t)1 << 18;
    for (int i = 0; i < 3; i++) m->from_eye[i] = triangles->origin[i] - desc->eye[i];
    const nebel_result result = tessellate(m, triangles);
    *tessellation = &m->made;
    if (result != NEBEL_OK) {
        nebel_destroy_tessellation(*tessellation);
        *tessellation = NULL;
    }
    return result;
}

void nebel_destroy_tessellation(nebel_tessellation *tessellation)
{
    if (tessellation == NULL) return;
    mesh *const m = (mesh *)tessellation;
    const nebel_allocator allocator = m->allocator;
    nb_release(&allocator, m->positions);
    nb_release(&allocator, m->points);
    nb_release(&allocator, m->parents);
    nb_release(&allocator, m->edges);
    nb_release(&allocator, m->middle_of);
    nb_release(&allocator, m->middles);
    nb_release(&allocator, m->triangles);
    nb_release(&allocator, m->indices);
    nb_release(&allocator, m->queue);
    nb_free_fog_bound(m->bound);
    nb_release(&allocator, m);
}
