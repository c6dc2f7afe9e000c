/* Optical depths of clouds along ways from a place: to the sun, away from it, up and down.
 *
 * Neighbours share what is far: it is kept on lattices, whose nodes are the closer the nearer it is, and is linear between them. */
#include "cloud_density.h"
#include "cloud_lighting.h"

#include "math/hash.h"
#include "math/vector.h"

#include <math.h>
#include <string.h>

#define NB_DOUBLE
#include "formulas/prelude.h"

#include "formulas/elementary.inc"

/* How near the line of a ray comes to the planet's middle; along: how far behind that place the ray begins. */
static double pass(const double from[3], const double unit[3], double *along)
{
    double aside[3];
    *along = nb_vector_dot(from, unit);
    for (int c = 0; c < 3; c++) aside[c] = from[c] - *along * unit[c];
    return nb_vector_length(aside);
}

int nb_cloud_pieces(double low, double high, const double from[3], const double unit[3], double t_max,
                    double pieces[2][2])
{
    double along;
    const double near = pass(from, unit, &along);
    if (!(near < high)) return 0;
    const double outer = sqrt((high - near) * (high + near));
    const double inner = near < low ? sqrt((low - near) * (low + near)) : -1;
    const double ends[2][2] = {{-along - outer, inner >= 0 ? -along - inner : -along + outer},
                               {-along + inner, -along + outer}};
    int count = 0;
    for (int i = 0; i < (inner >= 0 ? 2 : 1); i++) {
        const double a = nb_max(0, ends[i][0]), b = nb_min(t_max, ends[i][1]);
        if (!(a < b)) continue;
        pieces[count][0] = a;
        pieces[count++][1] = b;
    }
    return count;
}

double nb_cloud_to_ground(double radius, const double from[3], const double unit[3])
{
    double along;
    const double near = pass(from, unit, &along);
    if (!(along < 0 && near < radius)) return HUGE_VAL;
    return fmax(0, -along - sqrt((radius - near) * (radius + near)));
}

/* ---- ways ------------------------------------------------------------------------------------ */

/* Steps along a way: how long the first is, how much longer each is than the one before, and how many there are at most, of which
 * the last one goes to the way's end. What is narrower than a width is seen as a mean. */
typedef struct nb_cloud_steps {
    float first, growth, width;
    int most;
} nb_cloud_steps;

enum { OWN_STEPS = 7, MOST_STEPS = 128 };

/* Of a ray's ways to the sun; of those to the sun that a lattice keeps for all around; of all others. What is far away throws softer
 * shadows the more steps grow. */
#define GROWTH 1.3f
#define SHARED_GROWTH 1.05f
#define OTHER_GROWTH 1.5f

/* A ray's ways to the sun are its own for OWN_STEPS: then the next is so much longer than the first. What is behind them comes
 * from the lattice, whose nodes are half of that step apart. */
#define OWN_GROWTH 6.2748517f /* GROWTH to the power of OWN_STEPS */
#define NODES_STEP 0.5f

/* Who looks from within a cumulus cell sees no gaps of it. */
#define HEAP_PART 0.45f

/* A way from a place, and its optical depth. */
typedef struct nb_depth_ray {
    double from[3], unit[3], reach;
    nb_cloud_steps steps;
    double depth;
} nb_depth_ray;

/* The pieces of a way in a layer. Just below the horizon it may leave the layer over the planet's bulge and enter it again
 * behind; but not through the ground: who looks down from below a layer sees none of its clouds, not those on the planet's other
 * side. */
static int stays_of(const nebel_cloud_lighting *view, int k, const nb_depth_ray *way, double pieces[2][2])
{
    const nb_cloud_layer *layer = &view->clouds->layers[k];
    const int count = nb_cloud_pieces(layer->low, layer->high, way->from, way->unit, way->reach, pieces);
    if (count == 0 || !(pieces[count - 1][0] > 0)) return count;
    const double ground = nb_cloud_to_ground(view->clouds->atmosphere->airs.radius, way->from, way->unit);
    return pieces[count - 1][0] > ground ? count - 1 : count;
}

/* Steps of several ways in a layer whose places are asked at once, and whose depths they are. */
typedef struct nb_depth_step {
    nebel_cloud_workspace *workspace;
    int layer, is_alone;
    nb_cloud_density_query looks;
    double lengths[NB_CLOUD_LANES], *depths[NB_CLOUD_LANES];
} nb_depth_step;

/* Begins anew. */
static void stride(nb_depth_step *steps)
{
    const nebel_cloud_lighting *view = steps->workspace->view;
    nb_cloud_density_query *looks = &steps->looks;
    if (looks->count == 0) return;
    if (steps->is_alone)
        nb_cloud_density_alone(view->kernel, &view->clouds->noise, &view->clouds->layers[steps->layer], looks);
    else
        nb_cloud_density(steps->workspace, steps->layer, looks);
    for (int i = 0; i < looks->count; i++) *steps->depths[i] += steps->lengths[i] * (double)looks->whole[i];
    looks->count = 0;
}

/* Each step takes the mean over its length. */
static void march(nb_depth_ray *way, nb_depth_step *steps)
{
    const nebel_cloud_lighting *view = steps->workspace->view;
    const nb_cloud_layer *layer = &view->clouds->layers[steps->layer];
    const float most_hidden = nb_smaller(layer->hidden_height, layer->hidden_width);
    double pieces[2][2], own[3], unit[3], step = (double)way->steps.first;
    const int count = stays_of(view, steps->layer, way, pieces);
    nb_cloud_density_query *looks = &steps->looks;
    int left = way->steps.most;
    for (int c = 0; c < 3; c++) {
        own[c] = nb_vector_dot(view->poses[steps->layer].turn[c], way->from);
        unit[c] = nb_vector_dot(view->poses[steps->layer].turn[c], way->unit);
    }
    for (int i = 0; i < count; i++) {
        const double end = pieces[i][1];
        double t = pieces[i][0];
        step = nb_max(step, 0.02 * t);
        for (; t < end; left--) {
            const double length = left <= 1 ? end - t : nb_min(step, end - t);
            const int at = looks->count++;
            for (int c = 0; c < 3; c++) looks->place[c][at] = own[c] + (t + 0.5 * length) * unit[c];
            looks->width[at] = nb_larger(way->steps.width, 0.7f * (float)length);
            looks->hidden[at] = nb_smaller(most_hidden, looks->width[at] - HEAP_PART * layer->size);
            steps->lengths[at] = length;
            steps->depths[at] = &way->depth;
            if (looks->count == NB_CLOUD_LANES) stride(steps);
            t = left <= 1 ? end : t + length;
            step *= (double)way->steps.growth;
        }
    }
}

/* Depths of all layers along ways. is_alone: of places that have no neighbours. */
static void find_ways(nebel_cloud_workspace *workspace, int is_alone, int n, nb_depth_ray *ways)
{
    nb_depth_step steps;
    steps.workspace = workspace;
    steps.is_alone = is_alone;
    steps.looks.count = steps.looks.are_of_rays = 0;
    for (steps.layer = 0; steps.layer < workspace->view->clouds->layer_count; steps.layer++) {
        for (int i = 0; i < n; i++) march(&ways[i], &steps);
        stride(&steps);
    }
    for (int i = 0; i < n; i++) ways[i].depth = nb_min(ways[i].depth, 1e6);
}

static nb_depth_ray way_of(const double from[3], const double unit[3], const nb_cloud_steps *steps)
{
    nb_depth_ray way = {.reach = HUGE_VAL, .steps = *steps};
    memcpy(way.from, from, sizeof way.from);
    memcpy(way.unit, unit, sizeof way.unit);
    return way;
}

float nb_cloud_depth_along(nebel_cloud_workspace *workspace, const double from[3], const double unit[3], float first,
                           float width, int is_alone)
{
    nb_depth_ray way = way_of(from, unit, &(nb_cloud_steps){first, OTHER_GROWTH, width, MOST_STEPS});
    find_ways(workspace, is_alone, 1, &way);
    return (float)way.depth;
}

/* ---- lattices -------------------------------------------------------------------------------- */

/* Columns next to each other in a layer are as good as one so wide, in sizes of cumulus cells. Wider ones would count
 * what comes through gaps and what scatters through cumulus cells as if all were as thick as their mean: of those, some
 * across are asked. */
#define COLUMN_PART 0.2f
enum { MOST_COLUMNS = 4 };

static void find_roof(nebel_cloud_workspace *workspace, int k, const double place[3], float width, float parts[3])
{
    const nb_cloud_layer *layer = &workspace->view->clouds->layers[k];
    const float fine = nb_smaller(width, COLUMN_PART * layer->size),
                first = nb_smaller(fine, 0.1f / layer->per_thickness);
    const int count = width > 2 * fine ? MOST_COLUMNS : width > fine ? 2 : 1;
    double across[2][3];
    nb_vector_perpendicular(place, across[0]);
    nb_vector_cross(place, across[0], across[1]);
    nb_vector_make_unit(across[1]);
    const int is_alone = width > MOST_COLUMNS * layer->size;
    const nb_cloud_steps to_sun = {first, is_alone ? OTHER_GROWTH : SHARED_GROWTH, fine, MOST_STEPS};
    const nb_cloud_steps to_up = {first, OTHER_GROWTH, fine, MOST_STEPS};
    parts[0] = parts[1] = parts[2] = 0;
    for (int i = 0; i < count * count; i++) {
        const double u = ((i % count + 0.5) / count - 0.5) * (double)width,
                     v = ((i / count + 0.5) / count - 0.5) * (double)width;
        double up[3], base[3];
        for (int c = 0; c < 3; c++) up[c] = place[c] + u * across[0][c] + v * across[1][c];
        nb_vector_make_unit(up);
        for (int c = 0; c < 3; c++) base[c] = layer->low * up[c];
        const double cosines[2] = {nb_vector_dot(up, workspace->view->sun.direction), 1};
        nb_depth_ray ways[2] = {way_of(base, workspace->view->sun.direction, &to_sun), way_of(base, up, &to_up)};
        find_ways(workspace, is_alone, 2, ways);
        for (int w = 0; w < 2; w++)
            parts[w] += nb_cloud_part_through(layer, (float)ways[w].depth, cosines[w]) / (float)(count * count);
    }
}

/* Away from the sun, up and down. */
static void set_around(const nebel_cloud_workspace *workspace, const double place[3], const nb_cloud_steps *steps,
                       nb_depth_ray ways[3])
{
    const double radius = nb_max(1, nb_vector_length(place));
    double away[3], up[3], down[3];
    for (int i = 0; i < 3; i++) {
        away[i] = -workspace->view->sun.direction[i];
        up[i] = place[i] / radius;
        down[i] = -up[i];
    }
    ways[0] = way_of(place, away, steps);
    ways[1] = way_of(place, up, steps);
    ways[2] = way_of(place, down, steps);
}

static void find_around(nebel_cloud_workspace *workspace, const double place[3], float width, float depth[3])
{
    nb_depth_ray ways[3];
    set_around(workspace, place, &(nb_cloud_steps){width, OTHER_GROWTH, width, MOST_STEPS}, ways);
    find_ways(workspace, 0, 3, ways);
    for (int i = 0; i < 3; i++) depth[i] = (float)ways[i].depth;
}

static void find_to_sun(nebel_cloud_workspace *workspace, const double place[3], float width, float depth[1])
{
    nb_depth_ray way =
        way_of(place, workspace->view->sun.direction, &(nb_cloud_steps){width, SHARED_GROWTH, width, MOST_STEPS});
    find_ways(workspace, 0, 1, &way);
    depth[0] = (float)way.depth;
}

static void find_node(nebel_cloud_workspace *workspace, nb_cloud_depth_axis ways, const int32_t at[3], int level,
                      float depth[3])
{
    const float width = (float)ldexp(1, level);
    double place[3];
    for (int i = 0; i < 3; i++) place[i] = ldexp((double)at[i], level);
    if (ways == NB_CLOUD_TO_SUN)
        find_to_sun(workspace, place, width, depth);
    else if (ways == NB_CLOUD_AROUND)
        find_around(workspace, place, width, depth);
    else
        find_roof(workspace, (int)ways - NB_CLOUD_ROOFS, place, width, depth);
}

/* Tables hold 2 x 2 x 2 neighbours one behind the other, which share lines of the processor's cache. */
static uint32_t hash_of(const int32_t at[3], int level)
{
    const uint32_t x = (uint32_t)at[0], y = (uint32_t)at[1], z = (uint32_t)at[2];
    const uint32_t tile = nb_mix_bits((x >> 1) * UINT32_C(0x9e3779b1) + (y >> 1) * UINT32_C(0x85ebca77) +
                                      (z >> 1) * UINT32_C(0xc2b2ae3d) + (uint32_t)level);
    return tile << 3 | (z & 1) << 2 | (y & 1) << 1 | (x & 1);
}

/* What is found on the way may take the node's place. */
static void read_node(nebel_cloud_workspace *workspace, nb_cloud_depth_axis ways, const int32_t at[3], int level,
                      float depth[3])
{
    nb_cloud_lattice_node *node = &workspace->lattices[ways].nodes[hash_of(at, level) & (NB_CLOUD_NODES - 1)];
    if (!(node->is_set && node->level == level && memcmp(node->at, at, sizeof node->at) == 0)) {
        nb_cloud_lattice_node found = {.at = {at[0], at[1], at[2]}, .level = (int16_t)level, .is_set = 1};
        find_node(workspace, ways, at, level, found.depth);
        *node = found;
    }
    memcpy(depth, node->depth, sizeof node->depth);
}

/* A cell around a place, how far the place is in it, and how much it counts. */
typedef struct nb_in_cell {
    int32_t low[3];
    uint32_t hash;
    int level;
    float part[3], weight;
} nb_in_cell;

/* The cells around a place of up to two levels. */
typedef struct nb_in_lattice {
    nb_cloud_depth_axis ways;
    int count;
    nb_in_cell cells[2];
} nb_in_lattice;

static const nb_cloud_cell *cell_at(nebel_cloud_workspace *workspace, nb_cloud_depth_axis ways, const nb_in_cell *in)
{
    nb_cloud_cell *cell = &workspace->lattices[ways].cells[in->hash];
    if (cell->is_set && cell->level == in->level && memcmp(cell->low, in->low, sizeof cell->low) == 0) return cell;
    nb_cloud_cell found = {.low = {in->low[0], in->low[1], in->low[2]}, .level = (int16_t)in->level, .is_set = 1};
    for (int k = 0; k < 8; k++) {
        const int32_t at[3] = {in->low[0] + (k & 1), in->low[1] + (k >> 1 & 1), in->low[2] + (k >> 2)};
        float depth[3];
        read_node(workspace, ways, at, in->level, depth);
        for (int i = 0; i < 3; i++) found.depth[i][k & 1][k >> 1] = depth[i];
    }
    *cell = found;
    return cell;
}

/* Sends for the cell, which caches seldom have. */
static nb_in_cell find_cell(const nebel_cloud_workspace *workspace, nb_cloud_depth_axis ways, const double place[3],
                            int level, float weight)
{
    const double per = nb_scale_pow2(1, -level);
    nb_in_cell in = {.level = level, .weight = weight};
    for (int i = 0; i < 3; i++) {
        const double scaled = place[i] * per;
        const int32_t toward_zero = (int32_t)scaled;
        in.low[i] = toward_zero - ((double)toward_zero > scaled);
        in.part[i] = (float)(scaled - (double)in.low[i]);
    }
    in.hash = hash_of(in.low, level) & (NB_CLOUD_CELLS - 1);
    const char *const cell = (const char *)&workspace->lattices[ways].cells[in.hash];
    __builtin_prefetch(cell);
    __builtin_prefetch(cell + 64);
    return in;
}

/* Levels blend over so much before the next, in parts of it: a place between two has nodes of both filled. What roofs let through
 * lies on smooth ground and air. */
#define BLEND 0.125
#define ROOFS_BLEND 0.25

static nb_in_lattice find_in_lattice(const nebel_cloud_workspace *workspace, nb_cloud_depth_axis ways,
                                     const double place[3], float width)
{
    int level;
    /* Numbers of nodes must be whole. */
    const double least = workspace->view->high * 0x1p-29, mantissa = frexp(nb_max((double)width, least), &level);
    const double blend = ways < NB_CLOUD_ROOFS ? BLEND : ROOFS_BLEND;
    const float part = (float)nb_max(0, (mantissa - (1 - blend)) / blend);
    nb_in_lattice in = {.ways = ways};
    if (part < 1) in.cells[in.count++] = find_cell(workspace, ways, place, level - 1, 1 - part);
    if (part > 0) in.cells[in.count++] = find_cell(workspace, ways, place, level, part);
    return in;
}

/* Linear between the eight nodes around a place. */
static void read_lattice(nebel_cloud_workspace *workspace, const nb_in_lattice *in, float depth[3])
{
    depth[0] = depth[1] = depth[2] = 0;
    for (int n = 0; n < in->count; n++) {
        const float *part = in->cells[n].part;
        const nb_cloud_cell *cell = cell_at(workspace, in->ways, &in->cells[n]);
        for (int i = 0; i < (in->ways == NB_CLOUD_TO_SUN ? 1 : 3); i++) {
            const nb_four low = cell->depth[i][0], row = low + part[0] * (cell->depth[i][1] - low);
            const float near = row[0] + part[1] * (row[1] - row[0]), far = row[2] + part[1] * (row[3] - row[2]);
            depth[i] += in->cells[n].weight * (near + part[2] * (far - near));
        }
    }
}

float nb_cloud_sun_depth_at(nebel_cloud_workspace *workspace, const double place[3], float width)
{
    float depth[3];
    const nb_in_lattice in = find_in_lattice(workspace, NB_CLOUD_TO_SUN, place, width);
    read_lattice(workspace, &in, depth);
    return depth[0];
}

/* Nodes farther apart than that would lie deep in the planet. */
#define WIDEST_ROOF 0.125f

nb_cloud_cover_transmittance nb_cloud_roof_at(nebel_cloud_workspace *workspace, int layer, const double place[3],
                                              float width)
{
    float parts[3];
    const nb_in_lattice in =
        find_in_lattice(workspace, (nb_cloud_depth_axis)(NB_CLOUD_ROOFS + layer), place,
                        nb_smaller(width, WIDEST_ROOF * (float)workspace->view->clouds->layers[layer].low));
    read_lattice(workspace, &in, parts);
    return (nb_cloud_cover_transmittance){parts[0], parts[1]};
}

/* ---- places ---------------------------------------------------------------------------------- */

/* What is behind a place's own steps towards the sun. */
static nb_in_lattice find_behind(const nebel_cloud_workspace *workspace, const nb_depth_ray *own)
{
    const double *sun = workspace->view->sun.direction;
    const float width = NODES_STEP * OWN_GROWTH * own->steps.first;
    double far[3];
    for (int c = 0; c < 3; c++) far[c] = own->from[c] + own->reach * sun[c];
    /* Nodes just above all layers share cells with others below. */
    if (nb_vector_length(far) > workspace->view->high + (double)width && nb_vector_dot(far, sun) > 0)
        return (nb_in_lattice){.count = 0};
    return find_in_lattice(workspace, NB_CLOUD_TO_SUN, far, width);
}

/* Of a place's ways the first steps to the sun; then, where it has its own, what is behind them and the three around. */
enum { FIRST_STEPS, BEHIND, AROUND, PLACE_WAYS = AROUND + 3 };

/* Where a place's depths come from. */
typedef struct nb_origin {
    nb_cloud_depth_query *asked;
    const nb_depth_ray *ways;
    nb_in_lattice behind, around;
} nb_origin;

/* Returns how many ways there are. */
static int set_ways(const nebel_cloud_workspace *workspace, const nb_cloud_depth_query *asked,
                    nb_depth_ray ways[PLACE_WAYS])
{
    const nb_cloud_resolution *grain = &asked->grain;
    const double *sun = workspace->view->sun.direction;
    nb_depth_ray *first = &ways[FIRST_STEPS];
    nb_cloud_steps steps = {grain->first, GROWTH, grain->width, OWN_STEPS};
    *first = way_of(asked->place, sun, &steps);
    first->reach = (double)((OWN_GROWTH - 1) / (GROWTH - 1) * grain->first);
    if (!(grain->own > 0)) return 1;
    double far[3];
    for (int c = 0; c < 3; c++) far[c] = first->from[c] + first->reach * sun[c];
    steps.most = MOST_STEPS;
    set_around(workspace, asked->place, &steps, &ways[AROUND]);
    steps.first *= OWN_GROWTH;
    ways[BEHIND] = way_of(far, sun, &steps);
    return PLACE_WAYS;
}

static void find_origin(const nebel_cloud_workspace *workspace, nb_cloud_depth_query *asked, const nb_depth_ray *ways,
                        nb_origin *origin)
{
    origin->asked = asked;
    origin->ways = ways;
    origin->behind.count = origin->around.count = 0;
    if (asked->grain.own >= 1) return;
    origin->behind = find_behind(workspace, &ways[FIRST_STEPS]);
    origin->around = find_in_lattice(workspace, NB_CLOUD_AROUND, asked->place, asked->grain.wide);
}

static void take_depths(nebel_cloud_workspace *workspace, const nb_origin *origin)
{
    const nb_depth_ray *ways = origin->ways;
    const float own = origin->asked->grain.own;
    float sun[3], around[3];
    read_lattice(workspace, &origin->behind, sun);
    read_lattice(workspace, &origin->around, around);
    if (own > 0) {
        sun[0] += own * ((float)ways[BEHIND].depth - sun[0]);
        for (int i = 0; i < 3; i++) around[i] += own * ((float)ways[AROUND + i].depth - around[i]);
    }
    origin->asked->depths = (nb_cloud_depths){(float)ways[FIRST_STEPS].depth + sun[0], around[0], around[1], around[2]};
}

void nb_cloud_find_depths(nebel_cloud_workspace *workspace, int n, nb_cloud_depth_query asked[])
{
    nb_depth_ray ways[NB_CLOUD_ASKED * PLACE_WAYS];
    nb_origin origins[NB_CLOUD_ASKED];
    int count = 0, way_count = 0;
    for (int i = 0; i < n; i++) {
        nb_depth_ray *of_place = &ways[way_count];
        asked[i].depths = (nb_cloud_depths){0, 0, 0, 0};
        if (asked[i].is_alike) continue;
        way_count += set_ways(workspace, &asked[i], of_place);
        find_origin(workspace, &asked[i], of_place, &origins[count++]);
    }
    find_ways(workspace, 0, way_count, ways);
    for (int i = 0; i < count; i++) take_depths(workspace, &origins[i]);
}
