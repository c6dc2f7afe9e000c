/* Light in clouds.
 *
 * Scattered once: the sun's light through the air and the optical depth of the way to the sun.
 *
 * Scattered often: what goes on nearly straight, a part g^2 of all, counts as not scattered (Joseph, Wiscombe and
 * Weinman, The Delta-Eddington Approximation for Radiative Flux Transfer, 1976). The place is taken for one in a slab of
 * cloud that absorbs nothing, whose flux F and mean radiance J along its depth x follow
 *
 *     dF/dx = E e^(-x/m)      dJ/dx = -3/(4 pi) ((1 - g') F - g' m E e^(-x/m))
 *
 * with g' = g / (1 + g) and m the cosine at which sunlight enters; nothing else enters on either side. The slab lies
 * across the sunlight where the way up is no shorter, and level where it is. */
#include "cloud_looks.h"
#include "cloud_view.h"

#include "base/hash.h"
#include "base/vector.h"

#include <math.h>
#include <string.h>

#define NB_DOUBLE
#include "formulas/prelude.h"

#include "formulas/elementary.inc"

#define PI_F 3.14159265f

static float falling(float depth)
{
    return (float)nb_exp(-(double)depth);
}

/* ---- clear air ------------------------------------------------------------------------------- */

static nb_cloud_light clear_light(const nebel_cloud_view *view, double radius, double sun)
{
    const nebel_atmosphere *atmosphere = view->clouds->atmosphere;
    const nb_field field = nb_scatter_look_up(&atmosphere->scatter, &atmosphere->airs, radius, sun);
    nb_cloud_light light;
    double direct[3];
    nb_track_sunlight(&atmosphere->airs, (nb_track){radius, radius * sun}, direct);
    for (int c = 0; c < 3; c++) {
        const double mean = field.moments[0][c] / (4 * 3.14159265358979323846);
        const double side = field.moments[1][c] / (2 * 3.14159265358979323846), e = view->sun.irradiance[c];
        light.sun[c] = (float)(e * direct[c]);
        light.above[c] = (float)(e * fmax(0, mean + side));
        light.below[c] = (float)(e * fmax(0, mean - side));
    }
    return light;
}

nebel_result nb_cloud_light_make(nebel_cloud_view *view)
{
    view->lights = nb_allocate(&view->allocator, NB_CLOUD_HEIGHTS, sizeof *view->lights);
    if (view->lights == NULL) return NEBEL_ERROR_MEMORY;
    for (int i = 0; i < NB_CLOUD_HEIGHTS; i++)
        for (int k = 0; k < NB_CLOUD_SUNS; k++)
            view->lights[i][k] = clear_light(view, view->low + (view->high - view->low) * i / (NB_CLOUD_HEIGHTS - 1.0),
                                             view->lowest_sun + (1 - view->lowest_sun) * k / (NB_CLOUD_SUNS - 1.0));
    return NEBEL_OK;
}

typedef struct nb_between {
    int low;
    float part;
} nb_between;

static nb_between between(double place, int count)
{
    const double bounded = fmax(0, fmin(count - 1, place));
    const int low = bounded < count - 2 ? (int)bounded : count - 2;
    return (nb_between){low, (float)(bounded - low)};
}

nb_cloud_light nb_cloud_clear_light(const nebel_cloud_view *view, const double place[3], double radius)
{
    enum { NUMBERS = sizeof(nb_cloud_light) / sizeof(float) };
    const double sun = nb_vector_dot(place, view->sun.direction) / radius;
    const nb_between h =
        between((radius - view->low) / (view->high - view->low) * (NB_CLOUD_HEIGHTS - 1), NB_CLOUD_HEIGHTS);
    const nb_between s =
        between((sun - view->lowest_sun) / (1 - view->lowest_sun) * (NB_CLOUD_SUNS - 1), NB_CLOUD_SUNS);
    float sum[NUMBERS], corner[NUMBERS];
    memset(sum, 0, sizeof sum);
    for (int k = 0; k < 4; k++) {
        const float weight = (k & 1 ? h.part : 1 - h.part) * (k & 2 ? s.part : 1 - s.part);
        memcpy(corner, &view->lights[h.low + (k & 1)][s.low + (k >> 1)], sizeof corner);
        for (int i = 0; i < NUMBERS; i++) sum[i] += weight * corner[i];
    }
    nb_cloud_light light;
    memcpy(&light, sum, sizeof light);
    return light;
}

/* ---- optical depths -------------------------------------------------------------------------- */

int nb_cloud_pieces(double low, double high, const double from[3], const double unit[3], double t_max,
                    double pieces[2][2])
{
    const double along = nb_vector_dot(from, unit);
    double aside[3];
    for (int c = 0; c < 3; c++) aside[c] = from[c] - along * unit[c];
    const double near = sqrt(nb_vector_dot(aside, aside));
    if (!(near < high)) return 0;
    const double outer = sqrt((high - near) * (high + near));
    const double inner = near < low ? sqrt((low - near) * (low + near)) : -1;
    const double ends[2][2] = {{-along - outer, inner >= 0 ? -along - inner : -along + outer},
                               {-along + inner, -along + outer}};
    int count = 0;
    for (int i = 0; i < (inner >= 0 ? 2 : 1); i++) {
        const double a = fmax(0, ends[i][0]), b = fmin(t_max, ends[i][1]);
        if (!(a < b)) continue;
        pieces[count][0] = a;
        pieces[count++][1] = b;
    }
    return count;
}

/* Steps along a way: how long the first is, how much longer each is than the one before, and what is narrower than a width is
 * seen as a mean. is_alone: of a place that has no neighbours. */
typedef struct nb_steps {
    float first, growth, width;
    int is_alone;
} nb_steps;

/* At most so many, of which the last one goes to the layer's end. */
enum { MOST_STEPS = 64 };

/* Of ways that others do not share, and of those to the sun that a lattice keeps for all around. What is far away throws softer
 * shadows the more steps grow. */
#define GROWTH 1.5f
#define SHARED_GROWTH 1.2f

/* A ray's ways to the sun are its own for five steps: then the next is so much longer than the first. What is behind them comes
 * from the lattice, whose nodes are half of that step apart. */
#define OWN_GROWTH (GROWTH * GROWTH * GROWTH * GROWTH * GROWTH)
#define NODES_STEP 0.5f

/* The pieces of a way in a layer. Just below the horizon it may leave the layer over the planet's bulge and enter it again
 * behind; but not through the ground. */
static int stays_of(const nebel_cloud_view *view, int k, const double from[3], const double unit[3],
                    double pieces[2][2])
{
    const nb_cloud_layer *layer = &view->clouds->layers[k];
    const int count = nb_cloud_pieces(layer->low, layer->high, from, unit, HUGE_VAL, pieces);
    const double ground = nb_cloud_to_ground(view->clouds->atmosphere->airs.radius, from, unit);
    return count == 2 && ground < pieces[1][0] ? 1 : count;
}

/* Who looks from within a heap sees no gaps of it. */
#define HEAP_PART 0.45f

/* Steps whose places are asked at once. */
typedef struct nb_stride {
    nb_cloud_looks looks;
    double lengths[NB_CLOUD_LANES];
} nb_stride;

/* Optical depth of all that were asked; begins anew. */
static double stride(nebel_cloud_workspace *workspace, int k, int is_alone, nb_stride *steps)
{
    const nebel_cloud_view *view = workspace->view;
    const nb_cloud_layer *layer = &view->clouds->layers[k];
    nb_cloud_looks *looks = &steps->looks;
    double sum = 0;
    if (looks->count == 0) return 0;
    if (is_alone)
        nb_cloud_look_alone(view->kernel, &view->clouds->noise, layer, looks);
    else
        nb_cloud_look(workspace, k, looks);
    for (int i = 0; i < looks->count; i++) sum += steps->lengths[i] * (double)looks->whole[i];
    looks->count = 0;
    return sum;
}

/* Optical depth of a layer from a place on, as far as `reach`. Each step takes the mean over its length. */
static double march(nebel_cloud_workspace *workspace, int k, const double from[3], const double unit[3], double reach,
                    const nb_steps *steps)
{
    const nb_cloud_layer *layer = &workspace->view->clouds->layers[k];
    const float most_hidden = nb_smaller(layer->hidden_height, layer->hidden_width);
    double pieces[2][2], own[3], way[3], step = (double)steps->first, sum = 0;
    const int count = stays_of(workspace->view, k, from, unit, pieces);
    int taken = 0;
    nb_stride some;
    nb_cloud_looks *looks = &some.looks;
    looks->count = looks->are_of_rays = 0;
    for (int c = 0; c < 3; c++) {
        own[c] = nb_vector_dot(workspace->view->poses[k].turn[c], from);
        way[c] = nb_vector_dot(workspace->view->poses[k].turn[c], unit);
    }
    for (int i = 0; i < count; i++) {
        const double end = nb_min(reach, pieces[i][1]);
        double t = pieces[i][0];
        step = nb_max(step, 0.02 * t);
        for (; t < end; taken++) {
            const double length = taken >= MOST_STEPS - 1 ? end - t : nb_min(step, end - t);
            const int at = looks->count++;
            for (int c = 0; c < 3; c++) looks->place[c][at] = own[c] + (t + 0.5 * length) * way[c];
            looks->width[at] = nb_larger(steps->width, 0.7f * (float)length);
            looks->hidden[at] = nb_smaller(most_hidden, looks->width[at] - HEAP_PART * layer->size);
            some.lengths[at] = length;
            if (looks->count == NB_CLOUD_LANES) sum += stride(workspace, k, steps->is_alone, &some);
            t += length;
            step *= (double)steps->growth;
        }
    }
    return sum + stride(workspace, k, steps->is_alone, &some);
}

static double depth_until(nebel_cloud_workspace *workspace, const double from[3], const double unit[3], double reach,
                          const nb_steps *steps)
{
    double sum = 0;
    for (int k = 0; k < workspace->view->clouds->layer_count; k++) sum += march(workspace, k, from, unit, reach, steps);
    return nb_min(sum, 1e6);
}

float nb_cloud_depth_along(nebel_cloud_workspace *workspace, const double from[3], const double unit[3], float first,
                           float width, int is_alone)
{
    const nb_steps steps = {first, GROWTH, width, is_alone};
    return (float)depth_until(workspace, from, unit, HUGE_VAL, &steps);
}

/* Columns next to each other in a layer are as good as one so wide, in sizes of heaps. Wider ones would count what comes through
 * gaps and what scatters through heaps as if all were as thick as their mean: of those, some across are asked. */
#define COLUMN_PART 0.2f
enum { MOST_COLUMNS = 4 };

static void find_roof(nebel_cloud_workspace *workspace, int k, const double place[3], float width, float parts[3])
{
    const nb_cloud_layer *layer = &workspace->view->clouds->layers[k];
    const float fine = nb_smaller(width, COLUMN_PART * layer->size),
                first = nb_smaller(fine, 0.1f / layer->per_thickness);
    const float cosine = (float)layer->mean_cosine;
    const int count = width > 2 * fine ? MOST_COLUMNS : width > fine ? 2 : 1;
    const double axis[3] = {fabs(place[0]) < fabs(place[1]), !(fabs(place[0]) < fabs(place[1])), 0};
    double across[2][3];
    nb_vector_cross(place, axis, across[0]);
    nb_vector_make_unit(across[0]);
    nb_vector_cross(place, across[0], across[1]);
    nb_vector_make_unit(across[1]);
    const int is_alone = width > MOST_COLUMNS * layer->size;
    const nb_steps to_sun = {first, is_alone ? GROWTH : SHARED_GROWTH, fine, is_alone};
    parts[0] = parts[1] = parts[2] = 0;
    for (int i = 0; i < count * count; i++) {
        const double u = ((i % count + 0.5) / count - 0.5) * (double)width,
                     v = ((i / count + 0.5) / count - 0.5) * (double)width;
        double up[3], base[3];
        for (int c = 0; c < 3; c++) up[c] = place[c] + u * across[0][c] + v * across[1][c];
        nb_vector_make_unit(up);
        for (int c = 0; c < 3; c++) base[c] = layer->low * up[c];
        const float sun = (float)depth_until(workspace, base, workspace->view->sun.direction, HUGE_VAL, &to_sun);
        parts[0] += nb_cloud_part_through(sun, cosine) / (float)(count * count);
        parts[1] += nb_cloud_part_through(nb_cloud_depth_along(workspace, base, up, first, fine, is_alone), cosine) /
                    (float)(count * count);
    }
}

static void find_depths(nebel_cloud_workspace *workspace, nb_cloud_ways ways, const int32_t at[3], int level,
                        float depth[3])
{
    const float width = (float)ldexp(1, level);
    double place[3], up[3], turned[3];
    for (int i = 0; i < 3; i++) place[i] = ldexp((double)at[i], level);
    if (ways == NB_CLOUD_TO_SUN) {
        const nb_steps steps = {width, SHARED_GROWTH, width, 0};
        depth[0] = (float)depth_until(workspace, place, workspace->view->sun.direction, HUGE_VAL, &steps);
        return;
    }
    if (ways >= NB_CLOUD_ROOFS) {
        find_roof(workspace, (int)ways - NB_CLOUD_ROOFS, place, width, depth);
        return;
    }
    const double radius = fmax(1, nb_vector_length(place));
    for (int i = 0; i < 3; i++) turned[i] = -workspace->view->sun.direction[i];
    depth[0] = nb_cloud_depth_along(workspace, place, turned, width, width, 0);
    for (int i = 0; i < 3; i++) up[i] = place[i] / radius;
    depth[1] = nb_cloud_depth_along(workspace, place, up, width, width, 0);
    for (int i = 0; i < 3; i++) up[i] = -up[i];
    depth[2] = nb_cloud_depth_along(workspace, place, up, width, width, 0);
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
static void read_node(nebel_cloud_workspace *workspace, nb_cloud_ways ways, const int32_t at[3], int level,
                      float depth[3])
{
    nb_cloud_node *node = &workspace->lattices[ways].nodes[hash_of(at, level) & (NB_CLOUD_NODES - 1)];
    if (!(node->is_set && node->level == level && memcmp(node->at, at, sizeof node->at) == 0)) {
        nb_cloud_node found = {.at = {at[0], at[1], at[2]}, .level = (int16_t)level, .is_set = 1};
        find_depths(workspace, ways, at, level, found.depth);
        *node = found;
    }
    memcpy(depth, node->depth, sizeof node->depth);
}

static const nb_cloud_cell *cell_at(nebel_cloud_workspace *workspace, nb_cloud_ways ways, const int32_t low[3],
                                    int level)
{
    nb_cloud_cell *cell = &workspace->lattices[ways].cells[hash_of(low, level) & (NB_CLOUD_CELLS - 1)];
    if (cell->is_set && cell->level == level && memcmp(cell->low, low, sizeof cell->low) == 0) return cell;
    nb_cloud_cell found = {.low = {low[0], low[1], low[2]}, .level = (int16_t)level, .is_set = 1};
    for (int k = 0; k < 8; k++) {
        const int32_t at[3] = {low[0] + (k & 1), low[1] + (k >> 1 & 1), low[2] + (k >> 2)};
        float depth[3];
        read_node(workspace, ways, at, level, depth);
        for (int i = 0; i < 3; i++) found.depth[i][k] = depth[i];
    }
    *cell = found;
    return cell;
}

/* Linear between the eight nodes around a place. */
static void read_level(nebel_cloud_workspace *workspace, nb_cloud_ways ways, const double place[3], int level,
                       float weight, float depth[3])
{
    const double per = ldexp(1, -level);
    int32_t low[3];
    float part[3];
    for (int i = 0; i < 3; i++) {
        const double scaled = place[i] * per, whole = floor(scaled);
        low[i] = (int32_t)whole;
        part[i] = (float)(scaled - whole);
    }
    const nb_cloud_cell *cell = cell_at(workspace, ways, low, level);
    for (int i = 0; i < (ways == NB_CLOUD_TO_SUN ? 1 : 3); i++) {
        const float *d = cell->depth[i];
        float row[4];
        for (int k = 0; k < 4; k++) row[k] = d[2 * k] + part[0] * (d[2 * k + 1] - d[2 * k]);
        const float near = row[0] + part[1] * (row[1] - row[0]), far = row[2] + part[1] * (row[3] - row[2]);
        depth[i] += weight * (near + part[2] * (far - near));
    }
}

/* Levels blend over the last quarter before the next. */
static void read_nodes(nebel_cloud_workspace *workspace, nb_cloud_ways ways, const double place[3], float width,
                       float depth[3])
{
    int level;
    /* Numbers of nodes must be whole. */
    const double least = workspace->view->high * 0x1p-29, mantissa = frexp(fmax((double)width, least), &level);
    const float part = (float)fmax(0, 4 * (mantissa - 0.75));
    depth[0] = depth[1] = depth[2] = 0;
    if (part < 1) read_level(workspace, ways, place, level - 1, 1 - part, depth);
    if (part > 0) read_level(workspace, ways, place, level, part, depth);
}

float nb_cloud_sun_depth_at(nebel_cloud_workspace *workspace, const double place[3], float width)
{
    float depth[3];
    read_nodes(workspace, NB_CLOUD_TO_SUN, place, width, depth);
    return depth[0];
}

/* Nodes farther apart than that would lie deep in the planet. */
#define WIDEST_ROOF 0.125f

nb_cloud_roof nb_cloud_roof_at(nebel_cloud_workspace *workspace, int layer, const double place[3], float width)
{
    float parts[3];
    read_nodes(workspace, (nb_cloud_ways)(NB_CLOUD_ROOFS + layer), place,
               nb_smaller(width, WIDEST_ROOF * (float)workspace->view->clouds->layers[layer].low), parts);
    return (nb_cloud_roof){parts[0], parts[1]};
}

static float find_sun_depth(nebel_cloud_workspace *workspace, const double place[3], const nb_cloud_grain *grain)
{
    const nb_steps steps = {grain->first, GROWTH, grain->width, 0};
    const float next = OWN_GROWTH * grain->first, width = NODES_STEP * next;
    const double *sun = workspace->view->sun.direction, reach = (double)((next - grain->first) / (GROWTH - 1));
    const double near = depth_until(workspace, place, sun, reach, &steps);
    double far[3];
    for (int c = 0; c < 3; c++) far[c] = place[c] + reach * sun[c];
    /* Nodes just above all layers share cells with others below. */
    if (nb_vector_length(far) > workspace->view->high + (double)width && nb_vector_dot(far, sun) > 0)
        return (float)near;
    return (float)near + nb_cloud_sun_depth_at(workspace, far, width);
}

nb_cloud_depths nb_cloud_depths_at(nebel_cloud_workspace *workspace, const double place[3], const nb_cloud_grain *grain)
{
    nb_cloud_depths depths = {.sun = find_sun_depth(workspace, place, grain)};
    float others[3];
    read_nodes(workspace, NB_CLOUD_AROUND, place, grain->wide, others);
    depths.away = others[0];
    depths.up = others[1];
    depths.down = others[2];
    return depths;
}

/* ---- the slab -------------------------------------------------------------------------------- */

float nb_cloud_part_through(float depth, float mean_cosine)
{
    const float g = mean_cosine, apart = (1 - g * g) * depth;
    return (5 - falling(apart)) / (4 + 3 * (1 - g / (1 + g)) * apart);
}

nb_cloud_ray nb_cloud_ray_make(const nebel_cloud_view *view, const double direction[3])
{
    nb_cloud_ray ray = {.sun = fmax(-1, fmin(1, nb_vector_dot(direction, view->sun.direction)))};
    memcpy(ray.direction, direction, sizeof ray.direction);
    for (int k = 0; k < view->clouds->layer_count; k++) {
        const nb_cloud_layer *layer = &view->clouds->layers[k];
        const double g = layer->mean_cosine, wide = g / (1 + g);
        const nebel_phase phase = {.type = NEBEL_PHASE_HENYEY_GREENSTEIN, .g = wide};
        const nb_phase lobe = nb_phase_resolve(&phase);
        ray.phase[k] = (float)nb_phase_at(&layer->phase, ray.sun);
        ray.wide_phase[k] = (float)nb_phase_at(&lobe, ray.sun);
        ray.apart[k] = layer->apart;
    }
    return ray;
}

nb_cloud_parts nb_cloud_parts_of(float mean_cosine, const nb_cloud_depths *depths)
{
    const float g = mean_cosine, wide = g / (1 + g), apart = 1 - g * g;
    const float m = nb_smaller(1, (depths->up + 0.3f) / (depths->sun + 0.3f));
    const float x = apart * m * depths->sun, all = x + apart * nb_smaller(m * depths->away, depths->down);
    const float here = falling(x / m), there = falling(all / m);
    const float flux = m * (0.25f * (2 + 3 * m) + 0.25f * (2 - 3 * m) * there) / (1 + 0.75f * (1 - wide) * all);
    const float side = 0.75f / PI_F * wide * (flux - m * here);
    const float over = (1 - g) * depths->up, whole = over + (1 - g) * depths->down;
    const float from_above = (0.5f + 0.75f * (whole - over)) / (1 + 0.75f * whole);
    /* Half of the ground that is seen lies in this cloud's shadow. */
    const float ground = 0.5f + 0.5f * nb_cloud_part_through(depths->up + depths->down, g);
    return (nb_cloud_parts){
        .left = falling(depths->sun),
        .left_wide = falling(apart * depths->sun),
        .mean = (0.5f * m + 0.75f * m * m - 0.5f * flux - 0.75f * ((1 - wide) * flux * x + m * m * here)) / PI_F,
        .to_sun = m * side,
        .to_up = (1 - m) * side,
        .above = from_above,
        .below = (1 - from_above) * ground,
    };
}

nb_cloud_source nb_cloud_source_of(const nb_cloud_ray *ray, int layer, const nb_cloud_parts *parts,
                                   const nb_cloud_light *light, const double up[3])
{
    const float apart = ray->apart[layer], rise = (float)nb_vector_dot(ray->direction, up);
    const float often = nb_larger(0, parts->mean + parts->to_sun * (float)ray->sun + parts->to_up * rise);
    nb_cloud_source source;
    for (int c = 0; c < 3; c++) {
        source.once[c] = light->sun[c] * parts->left * (ray->phase[layer] - apart * ray->wide_phase[layer]);
        source.often[c] = light->sun[c] * apart * (often + parts->left_wide * ray->wide_phase[layer]);
        source.ambient[c] = parts->above * light->above[c] + parts->below * light->below[c];
    }
    return source;
}
