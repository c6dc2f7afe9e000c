/* Which tiles of the screen see a volume: the convex hull of its world bounds, projected.
 *
 * All is done in clip coordinates, where a vertex is (x, y, w) and what lies behind the eye has w < 0. Bounds that
 * reach behind it are cut off at w = 0; the cut's corners are seen at infinity, in the direction (x, y). Within a row
 * of tiles the hull's ends are those of its edges clipped to the row, which needs no division until the end. */
#include "fog/snapshot.h"
#include "view_rays.h"

#include <nebel/shader.h>

#include <math.h>
#include <stdint.h>

#define MOST_ENTRIES ((size_t)INT32_MAX) /* shaders count with int */

/* What rounding in the shader may move a ray by, in pixels; a ray is half a pixel from its tile's border. */
#define MARGIN (1.0 / 64)

enum { BOX_CORNERS = 8, CUTS = 12, VERTICES = BOX_CORNERS + CUTS };

typedef struct vertex {
    double x, y, w; /* in pixels times w */
} vertex;

/* Corners in front of the eye first, then those of the cut. */
typedef struct hull {
    vertex vertices[VERTICES];
    int count, first_cut;
    int edges[2 * (CUTS + CUTS * (CUTS - 1) / 2)], edge_count;
} hull;

typedef struct nb_tile_range {
    double low, high;
} nb_tile_range;

/* Columns of tiles in one row, first to last. */
typedef struct nb_tile_span {
    uint16_t first, last;
} nb_tile_span;

/* A volume's spans, one for each row from `row`; a row without any has first > last. */
typedef struct footprint {
    size_t spans;
    uint32_t row, row_count;
} footprint;

typedef struct screen {
    double matrix[3][4]; /* from the world to (x, y, w) in pixels */
    double size;         /* of a tile */
    uint32_t width, height, columns, rows;
} screen;

/* ---- hulls ----------------------------------------------------------------------------------- */

static double transform_row(const double row[4], const double p[3])
{
    return ((row[0] * p[0] + row[1] * p[1]) + row[2] * p[2]) + row[3];
}

/* Below this the sign of w is a matter of rounding, and counts as 0. */
static double doubt_of(const double row[4], const double p[3])
{
    return 8e-16 * (fabs(row[0] * p[0]) + fabs(row[1] * p[1]) + fabs(row[2] * p[2]) + fabs(row[3]));
}

static vertex project(const screen *s, const double p[3])
{
    const double w = transform_row(s->matrix[2], p);
    return (vertex){transform_row(s->matrix[0], p), transform_row(s->matrix[1], p),
                    fabs(w) <= doubt_of(s->matrix[2], p) ? 0 : w};
}

static void add_edge(hull *h, int a, int b)
{
    h->edges[2 * h->edge_count] = a;
    h->edges[2 * h->edge_count++ + 1] = b;
}

/* Where the edge from `front` to `back` meets w = 0. */
static vertex cut(const vertex *front, const vertex *back)
{
    const double t = front->w / (front->w - back->w);
    return (vertex){front->x + t * (back->x - front->x), front->y + t * (back->y - front->y), 0};
}

static void project_corners(const screen *s, const double low[3], const double high[3], vertex corners[BOX_CORNERS])
{
    for (int i = 0; i < BOX_CORNERS; i++) {
        const double p[3] = {i & 1 ? high[0] : low[0], i & 2 ? high[1] : low[1], i & 4 ? high[2] : low[2]};
        corners[i] = project(s, p);
    }
}

/* A corner with w = 0 is a cut's corner already. */
static void place_corners(hull *h, const vertex corners[BOX_CORNERS], int place[BOX_CORNERS])
{
    for (int pass = 0; pass < 2; pass++) {
        for (int i = 0; i < BOX_CORNERS; i++) {
            if (pass == 0) place[i] = -1;
            if (pass == 0 ? corners[i].w > 0 : corners[i].w == 0) {
                place[i] = h->count;
                h->vertices[h->count++] = corners[i];
            }
        }
        if (pass == 0) h->first_cut = h->count;
    }
}

/* The bounds in front of the eye; empty where there is none. Edges among the cut's corners are all their pairs: the
 * cut's own edges and some within it. */
static void make_hull(const screen *s, const double low[3], const double high[3], hull *h)
{
    vertex corners[BOX_CORNERS];
    int place[BOX_CORNERS];
    h->count = h->edge_count = h->first_cut = 0;
    project_corners(s, low, high, corners);
    place_corners(h, corners, place);
    for (int i = 0; i < BOX_CORNERS; i++) {
        for (int bit = 1; bit < BOX_CORNERS; bit <<= 1) {
            const int j = i | bit;
            if (j == i) continue;
            const int front = corners[i].w > 0 ? i : j, back = front == i ? j : i;
            if (place[i] >= 0 && place[j] >= 0 && corners[front].w > 0) add_edge(h, place[i], place[j]);
            if (corners[front].w > 0 && corners[back].w < 0) {
                h->vertices[h->count] = cut(&corners[front], &corners[back]);
                add_edge(h, place[front], h->count++);
            }
        }
    }
    for (int i = h->first_cut; i < h->count; i++)
        for (int j = h->first_cut; j < i; j++) add_edge(h, i, j);
}

/* ---- ranges ---------------------------------------------------------------------------------- */

static nb_tile_range nothing(void)
{
    return (nb_tile_range){HUGE_VAL, -HUGE_VAL};
}

/* value / w, in all directions where both vanish */
static void include(nb_tile_range *r, double value, double w)
{
    const double low = w > 0 ? value / w : value > 0 ? HUGE_VAL : -HUGE_VAL;
    const double high = w > 0 ? value / w : value < 0 ? -HUGE_VAL : HUGE_VAL;
    r->low = fmin(r->low, low);
    r->high = fmax(r->high, high);
}

/* Clips the part of [0, 1] of an edge on which a linear function, a at 0 and b at 1, is not negative. */
static void clip(double a, double b, double *from, double *to)
{
    if (a < 0 && b < 0) *from = 2;
    if (a < 0 && b >= 0) *from = fmax(*from, a / (a - b));
    if (a >= 0 && b < 0) *to = fmin(*to, a / (a - b));
}

/* Where the hull lies between two heights, in x. */
static nb_tile_range range_between(const hull *h, double bottom, double top)
{
    nb_tile_range r = nothing();
    for (int i = 0; i < h->edge_count; i++) {
        const vertex *a = &h->vertices[h->edges[2 * i]], *b = &h->vertices[h->edges[2 * i + 1]];
        double from = 0, to = 1;
        clip(a->y - bottom * a->w, b->y - bottom * b->w, &from, &to);
        clip(top * a->w - a->y, top * b->w - b->y, &from, &to);
        if (from > to) continue;
        include(&r, a->x + from * (b->x - a->x), a->w + from * (b->w - a->w));
        include(&r, a->x + to * (b->x - a->x), a->w + to * (b->w - a->w));
    }
    return r;
}

static nb_tile_range range_of(const hull *h, int vertical)
{
    nb_tile_range r = nothing();
    for (int i = 0; i < h->count; i++) include(&r, vertical ? h->vertices[i].y : h->vertices[i].x, h->vertices[i].w);
    return r;
}

/* The tiles that a range of pixels touches. 0 where it is off the screen. */
static int tiles_in(const screen *s, const nb_tile_range *r, uint32_t pixels, uint32_t tiles, uint32_t *first,
                    uint32_t *last)
{
    const double low = r->low - MARGIN, high = r->high + MARGIN;
    if (!(high >= 0 && low <= pixels)) return 0;
    *first = low > 0 ? (uint32_t)(fmin(low, pixels) / s->size) : 0;
    *last = high < pixels ? (uint32_t)(fmax(high, 0) / s->size) : tiles - 1;
    if (*first > tiles - 1) *first = tiles - 1;
    return 1;
}

/* ---- footprints ------------------------------------------------------------------------------ */

typedef struct tiler {
    screen screen;
    const nebel_snapshot *snapshot;
    footprint *footprints; /* of the bounded volumes */
    nb_tile_span *spans;
    size_t span_count, span_capacity;
    uint32_t *ends; /* of the tiles' volumes, then of those written */
} tiler;

static nb_tile_span whole_row(const screen *s)
{
    return (nb_tile_span){0, (uint16_t)(s->columns - 1)};
}

static nb_tile_span span_in_row(const screen *s, const hull *h, uint32_t row)
{
    const nb_tile_range r = range_between(h, row * s->size - MARGIN, (row + 1) * s->size + MARGIN);
    uint32_t first = 1, last = 0;
    if (!tiles_in(s, &r, s->width, s->columns, &first, &last)) return (nb_tile_span){1, 0};
    return (nb_tile_span){(uint16_t)first, (uint16_t)last};
}

/* A hull within two tiles either way gains nothing from a look at each row. */
static int add_spans(tiler *t, const hull *h, uint32_t first_row, uint32_t last_row, footprint *f)
{
    const screen *s = &t->screen;
    const nb_tile_range across = range_of(h, 0);
    uint32_t first, last;
    if (!tiles_in(s, &across, s->width, s->columns, &first, &last)) return 1;
    void *spans = t->spans;
    const size_t wanted = t->span_count + (last_row - first_row + 1);
    if (!nb_grow(&t->snapshot->allocator, &spans, sizeof *t->spans, t->span_count, &t->span_capacity, wanted)) return 0;
    t->spans = spans;
    *f = (footprint){t->span_count, first_row, last_row - first_row + 1};
    const int small = last - first <= 1 && last_row - first_row <= 1;
    for (uint32_t row = first_row; row <= last_row; row++)
        t->spans[t->span_count++] = small ? (nb_tile_span){(uint16_t)first, (uint16_t)last} : span_in_row(s, h, row);
    return 1;
}

/* 0 when memory is out. */
static int find_footprint(tiler *t, const nb_volume *body, footprint *f)
{
    hull h;
    uint32_t first_row, last_row;
    *f = (footprint){0, 0, 0};
    make_hull(&t->screen, body->low, body->high, &h);
    if (h.count == 0) return 1;
    const nb_tile_range up = range_of(&h, 1);
    if (!tiles_in(&t->screen, &up, t->screen.height, t->screen.rows, &first_row, &last_row)) return 1;
    return add_spans(t, &h, first_row, last_row, f);
}

static int find_footprints(tiler *t)
{
    for (size_t i = 0; i < t->snapshot->medium_count; i++) {
        const nb_volume *body = &t->snapshot->media[i].body;
        footprint *f = &t->footprints[i];
        if (!nb_volume_is_endless(body)) {
            if (!find_footprint(t, body, f)) return 0;
            continue;
        }
        *f = (footprint){SIZE_MAX, 0, t->screen.rows};
    }
    return 1;
}

static nb_tile_span span_at(const tiler *t, const footprint *f, uint32_t row)
{
    return f->spans == SIZE_MAX ? whole_row(&t->screen) : t->spans[f->spans + row];
}

/* ---- lists ----------------------------------------------------------------------------------- */

static size_t count_entries(tiler *t)
{
    const size_t tiles = (size_t)t->screen.columns * t->screen.rows;
    size_t total = 2 * tiles;
    for (size_t i = 0; i < t->snapshot->medium_count; i++) {
        const footprint *f = &t->footprints[i];
        for (uint32_t row = 0; row < f->row_count; row++) {
            const nb_tile_span s = span_at(t, f, row);
            uint32_t *ends = &t->ends[(size_t)(f->row + row) * t->screen.columns];
            for (uint32_t column = s.first; column <= s.last; column++) ends[column]++;
            if (s.first <= s.last) total += (size_t)s.last - s.first + 1;
        }
    }
    return total;
}

/* Volumes ascend because they are entered in their order. */
static void write_entries(tiler *t, uint32_t *entries)
{
    const size_t tiles = (size_t)t->screen.columns * t->screen.rows;
    uint32_t next = (uint32_t)(2 * tiles);
    for (size_t k = 0; k < tiles; k++) {
        entries[2 * k] = next;
        entries[2 * k + 1] = t->ends[k];
        next += t->ends[k];
        t->ends[k] = entries[2 * k];
    }
    for (size_t i = 0; i < t->snapshot->medium_count; i++) {
        const footprint *f = &t->footprints[i];
        for (uint32_t row = 0; row < f->row_count; row++) {
            const nb_tile_span s = span_at(t, f, row);
            uint32_t *ends = &t->ends[(size_t)(f->row + row) * t->screen.columns];
            for (uint32_t column = s.first; column <= s.last; column++) entries[ends[column]++] = (uint32_t)i;
        }
    }
}

static screen make_screen(const nebel_view *view, uint32_t tile_size)
{
    screen s = {.size = tile_size, .width = view->width, .height = view->height};
    s.columns = (view->width + tile_size - 1) / tile_size;
    s.rows = (view->height + tile_size - 1) / tile_size;
    const double half[2] = {0.5 * view->width, 0.5 * view->height};
    for (int column = 0; column < 4; column++) {
        double clip[4];
        for (int row = 0; row < 4; row++) {
            clip[row] = 0;
            for (int k = 0; k < 4; k++)
                clip[row] += view->clip_from_eye[4 * k + row] * view->eye_from_world[4 * column + k];
        }
        for (int i = 0; i < 2; i++) s.matrix[i][column] = half[i] * (clip[i] + clip[3]);
        s.matrix[2][column] = clip[3];
    }
    return s;
}

static nebel_result list_tiles(tiler *t, uint32_t *entries, size_t capacity, size_t *count)
{
    const nebel_log *log = &t->snapshot->log;
    const size_t tiles = (size_t)t->screen.columns * t->screen.rows;
    t->footprints = nb_allocate(&t->snapshot->allocator, t->snapshot->medium_count, sizeof *t->footprints);
    t->ends = nb_allocate_zero(&t->snapshot->allocator, tiles, sizeof *t->ends);
    if (t->footprints == NULL || t->ends == NULL || !find_footprints(t))
        return nb_fail(log, NEBEL_ERROR_MEMORY, "tiles: out of memory for %zu volumes", t->snapshot->medium_count);
    *count = count_entries(t);
    if (*count > MOST_ENTRIES)
        return nb_fail(log, NEBEL_ERROR_LIMIT, "tiles: %zu entries; shaders can address %zu: make tiles larger", *count,
                       MOST_ENTRIES);
    if (entries == NULL) return NEBEL_OK;
    if (capacity < *count) return NEBEL_ERROR_LIMIT; /* no message: who asks again with more room is in the right */
    write_entries(t, entries);
    return NEBEL_OK;
}

nebel_result nebel_bin_volumes(const nebel_snapshot *snapshot, const nebel_view *view, uint32_t tile_size,
                               uint32_t *entries, size_t capacity, size_t *count)
{
    if (snapshot == NULL) return NEBEL_ERROR_ARGUMENT;
    const nebel_log *log = &snapshot->log;
    if (view == NULL || count == NULL || (entries == NULL && capacity > 0))
        return nb_fail(log, NEBEL_ERROR_ARGUMENT, "tiles: view, entries and count must not be NULL");
    if (tile_size < 4 || tile_size > 256 || (tile_size & (tile_size - 1)) != 0)
        return nb_fail(log, NEBEL_ERROR_ARGUMENT, "tiles: a size of %u is no power of two from 4 to 256",
                       (unsigned)tile_size);
    if (!nb_view_is_valid(view))
        return nb_fail(log, NEBEL_ERROR_ARGUMENT, "tiles: the view is no projection of 1 to 65536 pixels");
    tiler t = {.screen = make_screen(view, tile_size), .snapshot = snapshot};
    const nebel_result result = list_tiles(&t, entries, capacity, count);
    nb_release(&snapshot->allocator, t.footprints);
    nb_release(&snapshot->allocator, t.spans);
    nb_release(&snapshot->allocator, t.ends);
    return result;
}
