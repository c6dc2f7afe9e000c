#include "atmosphere/atmosphere.h"
#include "cloud_density.h"

#include "base/isa.h"
#include "math/hash.h"
#include "base/isa_list.h"
#include "base/stride.h"
#include "math/vector.h"

#include <math.h>
#include <string.h>

#define NB_DOUBLE
#include "formulas/prelude.h"

#include "formulas/elementary.inc"

#define PI 3.14159265358979323846

/* A pixel hides no more along a ray than a way through a ball of cloud that is so high, in parts of the layer, and so wide, in
 * sizes of cumulus cells: of cumulus cells, of sheets. Beyond it the ray meets other cloud. As thin rays find,
 * straight down to 9 degrees flat (test_clouds). */
static const float hidden_heights[] = {0.37f, 0.75f}, hidden_widths[] = {0.42f, 0.55f};

/* ---- places ---------------------------------------------------------------------------------- */

nb_cloud_rotation nb_cloud_pose_at(const nb_cloud_layer *layer, double time)
{
    const double angle = -fmod(layer->per_time * time, 2 * PI), c = cos(angle), s = sin(angle);
    const double *a = layer->axis;
    const double skew[3][3] = {{0, -a[2], a[1]}, {a[2], 0, -a[0]}, {-a[1], a[0], 0}};
    nb_cloud_rotation pose;
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++) pose.turn[i][j] = (i == j ? c : 0) + (1 - c) * a[i] * a[j] + s * skew[i][j];
    return pose;
}

static void turn(const double by[3][3], const double v[3], double out[3])
{
    for (int i = 0; i < 3; i++) out[i] = nb_vector_dot(by[i], v);
}

static float step_up(float x)
{
    const float u = nb_smaller(1, nb_larger(0, x));
    return u * u * (3 - 2 * u);
}

/* ---- columns --------------------------------------------------------------------------------- */

/* The part of an octave that is seen where pixels are `width` wide: none where four pixels go into three waves, each two
 * cells long. It fades over three octaves of widths: cumulus cells would end at a line across pictures from orbit. */
static float share_of(float width, float cell)
{
    return 1 - step_up((width / cell - 0.2f) / 1.4f);
}

static float octave_at(const nb_cloud_noise *noise, const nb_cloud_octave *octave, const double place[3])
{
    double at[3];
    turn(octave->turn, place, at);
    for (int i = 0; i < 3; i++) at[i] += octave->shift[i];
    return nb_gradient_noise(noise, at);
}

/* Places of wisps are drawn together along the wind, so that noise of them is as many times longer that way, and no slope larger. A
 * quarter of the planet on, where that way is up, wisps are as wide as long. */
static void draw_out(const nb_cloud_layer *layer, double place[3])
{
    if (layer->kind != NEBEL_CLOUD_CIRRUS) return;
    const double wind[3] = {-layer->axis[2], 0, layer->axis[0]};
    const double shift = (1.0 / NB_WISPS_DRAWN_OUT - 1) * nb_vector_dot(place, wind);
    for (int i = 0; i < 3; i++) place[i] += shift * wind[i];
}

/* Wisps: places are shoved about by noise of their own. */
static void bend(const nb_cloud_noise *noise, const nb_cloud_layer *layer, double place[3])
{
    const nb_cloud_octave *octave = &layer->octaves[2];
    double from[3], shove[3];
    for (int i = 0; i < 3; i++) from[i] = 0.55 * place[i];
    for (int i = 0; i < 3; i++) {
        from[i] += 7.3 * (double)octave->cell;
        shove[i] = (double)octave_at(noise, octave, from);
    }
    for (int i = 0; i < 3; i++) place[i] += 2.2 * (double)octave->cell * shove[i];
}

static float sum_octaves(const nb_cloud_noise *noise, const nb_cloud_layer *layer, const double unit[3], float width,
                         float *variance)
{
    double place[3];
    float sum = 0;
    *variance = 0;
    for (int i = 0; i < 3; i++) place[i] = unit[i] * layer->low;
    draw_out(layer, place);
    if (layer->kind == NEBEL_CLOUD_CIRRUS && share_of(width, layer->octaves[2].cell) > 0) bend(noise, layer, place);
    for (int k = 0; k < NB_CLOUD_OCTAVES; k++) {
        const nb_cloud_octave *octave = &layer->octaves[k];
        const float share = share_of(width, octave->cell), weight = octave->weight;
        if (!(weight > 0)) continue;
        *variance += weight * weight * NB_GRADIENT_VARIANCE * (1 - share * share);
        if (share > 0) sum += share * weight * octave_at(noise, octave, place);
    }
    return sum;
}

static float weather_at(const nb_cloud_layer *layer, const double unit[3], float width)
{
    double value;
    if (layer->weather.level_count == 0) return layer->coverage;
    const double u = atan2(unit[2], -unit[0]) / (2 * PI), v = acos(fmax(-1, fmin(1, unit[1]))) / PI;
    const double texel = PI * layer->low / (double)layer->weather.height[0];
    nb_planet_map_read(&layer->weather, u, v, log2(fmax(1, (double)width / texel)), 0, &value);
    return layer->coverage * (float)value;
}

static float rank_of(const nb_cloud_layer *layer, float part)
{
    const float place = nb_smaller(1, nb_larger(0, part)) * (NB_CLOUD_RANKS - 1);
    const int low = place < NB_CLOUD_RANKS - 2 ? (int)place : NB_CLOUD_RANKS - 2;
    return layer->ranks[low] + (place - (float)low) * (layer->ranks[low + 1] - layer->ranks[low]);
}

/* Worley noise cuts into cumulus cells, but into sheets on one side and fills them on the other, so that as much of
 * the planet is under them as is asked for. Where nearly all is, they close: gaps are filled, and what is left of noise
 * makes thick and thin. */
static float fill_of(const nb_cloud_noise *noise, const nb_cloud_layer *layer, float coverage)
{
    if (layer->kind == NEBEL_CLOUD_CUMULUS) return 0;
    return layer->detail * (1 - noise->worley_mean) + 0.5f * layer->softness * step_up(10 * (coverage - 0.9f));
}

/* Where less is under clouds, their ranks are not drawn apart further, but lowered: columns are mixed with those next to them, which must
 * not be thousands of times as far above or below all cloud. */
#define LEAST_COVERAGE 0.015625f

/* The middle of a cumulus cell is where a twentieth of all cloud is more so. */
nb_cloud_column nb_cloud_column_at(const nb_cloud_noise *noise, const nb_cloud_layer *layer, const double unit[3],
                                   float width)
{
    const float coverage = weather_at(layer, unit, width), bounded = nb_larger(coverage, LEAST_COVERAGE);
    const float border = rank_of(layer, 1 - bounded), middle = rank_of(layer, 1 - 0.05f * bounded);
    const float fill = fill_of(noise, layer, bounded);
    nb_cloud_column column = {.scale = 1 / (middle - border)};
    const float sum = sum_octaves(noise, layer, unit, width, &column.variance);
    const float highest = (layer->most - border + sqrtf(3 * column.variance)) * column.scale + fill;
    column.rank = (sum - border) * column.scale + fill - highest * (bounded - coverage) / LEAST_COVERAGE;
    column.variance *= column.scale * column.scale;
    return column;
}

/* ---- places that are asked at once ----------------------------------------------------------- */

#define KERNEL(NAME, suffix) [NEBEL_ISA_##NAME] = {nb_cloud_find_places_##suffix, nb_cloud_find_drops_##suffix},
static const nb_cloud_kernel kernels[NEBEL_ISA_COUNT] = {NB_ISA_LIST(KERNEL)};

const nb_cloud_kernel *nb_cloud_kernel_choose(nebel_isa isa)
{
    const nebel_isa chosen = nb_isa_select(isa);
    return chosen != NEBEL_ISA_COUNT ? &kernels[chosen] : NULL;
}

void nb_cloud_ask(nb_cloud_density_query *looks, const nb_cloud_rotation *pose, const double place[3], float width)
{
    const int i = looks->count++;
    for (int c = 0; c < 3; c++) looks->place[c][i] = nb_vector_dot(pose->turn[c], place);
    looks->width[i] = width;
    looks->hidden[i] = 0;
}

void nb_cloud_density_alone(const nb_cloud_kernel *kernel, const nb_cloud_noise *noise, const nb_cloud_layer *layer,
                            nb_cloud_density_query *looks)
{
    nb_cloud_fill_lanes(looks);
    kernel->find_places(layer, 0, looks);
    nb_cloud_set_no_columns(looks);
    for (int i = 0; i < looks->count; i++) {
        double unit[3];
        if (!nb_cloud_is_in_layer(looks, i)) continue;
        for (int c = 0; c < 3; c++) unit[c] = looks->place[c][i] / looks->radius[i];
        const nb_cloud_column column = nb_cloud_column_at(noise, layer, unit, looks->width[i]);
        looks->rank[i] = column.rank;
        looks->scale[i] = column.scale;
        looks->variance[i] = column.variance;
    }
    kernel->find_drops(noise, layer, looks);
}

void nb_cloud_find_means(const nebel_clouds *clouds, int layer, nb_cloud_density_query *looks, float extinction[])
{
    nb_cloud_density_alone(clouds->kernel, &clouds->noise, &clouds->layers[layer], looks);
    memcpy(extinction, looks->whole, (size_t)looks->count * sizeof *extinction);
    looks->count = 0;
}

/* ---- descriptions ---------------------------------------------------------------------------- */

static const struct {
    double base, top, coverage, extinction, size, detail, variation, diameter;
    float softness;
} kinds[NEBEL_CLOUD_TYPE_COUNT] = {
    [NEBEL_CLOUD_CUMULUS] = {900, 2700, 0.4, 0.05, 2200, 0.8, 0.3, 20, 0.07f},
    [NEBEL_CLOUD_STRATUS] = {300, 800, 0.85, 0.03, 2600, 0.35, 0.2, 14, 0.5f},
    [NEBEL_CLOUD_CIRRUS] = {8000, 9500, 0.5, 4e-4, 6000, 0.9, 0.4, 40, 1.2f},
};

static void set_default(double *number, double value)
{
    if (*number == 0) *number = value;
}

/* In little air cumulus cells are as small as it is, or as the layer is that was asked for. */
static nebel_cloud_layer resolve(double thickness, const nebel_cloud_layer *desc)
{
    const double scale = fmin(1, thickness / 1e5), depth = kinds[desc->type].top - kinds[desc->type].base;
    nebel_cloud_layer whole = *desc;
    set_default(&whole.base, scale * kinds[desc->type].base);
    set_default(&whole.top, whole.base + scale * depth);
    const double wide = fmin(1, fmax(scale, (whole.top - whole.base) / depth));
    set_default(&whole.coverage, kinds[desc->type].coverage);
    set_default(&whole.extinction, fmin(NEBEL_MAX_COMPONENT_EXTINCTION, kinds[desc->type].extinction / wide));
    set_default(&whole.cell_size, wide * kinds[desc->type].size);
    set_default(&whole.erosion, kinds[desc->type].detail);
    set_default(&whole.patchiness, kinds[desc->type].variation);
    set_default(&whole.droplet_diameter, kinds[desc->type].diameter);
    return whole;
}

static int is_part(double number)
{
    return number == NEBEL_ZERO || (number >= 0 && number <= 1);
}

static nebel_result refuse(const nebel_log *log, const char *what, double number, const char *unit, const char *wanted)
{
    return nb_fail(log, NEBEL_ERROR_VALUE, "cloud layer: %s: is %g%s; must be %s", what, number, unit, wanted);
}

static const char *origin_of(double given)
{
    return given == 0 ? ", as none is given" : "";
}

/* `given` may have zeros, whose numbers the layer has. */
static nebel_result check_heights(double thickness, const nebel_cloud_layer *given, const nebel_cloud_layer *layer,
                                  const nebel_log *log)
{
    const double base = layer->base, top = layer->top;
    const char *const of_base = origin_of(given->base), *const of_top = origin_of(given->top);
    if (!(base > 0)) return refuse(log, "base", base, " m", "above the ground");
    if (!(base < thickness))
        return nb_fail(log, NEBEL_ERROR_VALUE, "cloud layer: base: is %.8g m%s; must be within the air, %.8g m", base,
                       of_base, thickness);
    if (!(top > base))
        return nb_fail(log, NEBEL_ERROR_VALUE, "cloud layer: top: is %.8g m%s; must be above the base, %.8g m%s", top,
                       of_top, base, of_base);
    if (!(top <= thickness))
        return nb_fail(log, NEBEL_ERROR_VALUE, "cloud layer: top: is %.8g m%s; must be within the air, %.8g m", top,
                       of_top, thickness);
    if (!(top - base >= thickness / NEBEL_MAX_CLOUD_THICKNESS_RATIO))
        return nb_fail(
            log, NEBEL_ERROR_VALUE,
            "cloud layer: top: is %.8g m%s; must be at least %g m (a millionth of the air's thickness) above the base, "
            "%.8g m%s",
            top, of_top, thickness / NEBEL_MAX_CLOUD_THICKNESS_RATIO, base, of_base);
    return NEBEL_OK;
}

static nebel_result check_looks(const nebel_cloud_layer *layer, const nebel_log *log)
{
    static const char part[] = "within 0 and 1, or none (-1)";
    if (!(layer->coverage > 0 && layer->coverage <= 1))
        return refuse(log, "coverage", layer->coverage, "", "within 0 and 1 (0: the number of its type)");
    if (!(layer->extinction > 0 && layer->extinction <= NEBEL_MAX_COMPONENT_EXTINCTION))
        return refuse(log, "extinction", layer->extinction, " per m", "within 0 and 1e3 (0: the number of its type)");
    if (!(layer->cell_size >= 1e-3 && layer->cell_size <= 1e9))
        return refuse(log, "cell_size", layer->cell_size, " m", "within 1e-3 and 1e9");
    if (!is_part(layer->erosion)) return refuse(log, "erosion", layer->erosion, "", part);
    if (!is_part(layer->patchiness)) return refuse(log, "patchiness", layer->patchiness, "", part);
    if (!(layer->droplet_diameter >= 4 && layer->droplet_diameter <= NEBEL_MAX_DROPLET_DIAMETER))
        return refuse(log, "droplet_diameter", layer->droplet_diameter, " um", "within 4 and 50");
    for (int i = 0; i < 2; i++)
        if (!(fabs(layer->wind[i]) <= 1e12)) return refuse(log, "wind", layer->wind[i], " m", "within -1e12 and 1e12");
    const char *fault = nb_map_fault(&layer->weather_map, 1);
    return fault == NULL ? NEBEL_OK : nb_fail(log, NEBEL_ERROR_VALUE, "cloud layer: weather_map: %s", fault);
}

nebel_result nebel_resolve_cloud_layer(double thickness, const nebel_cloud_layer *desc, const nebel_log *log,
                                       nebel_cloud_layer *resolved)
{
    if (desc == NULL || resolved == NULL) return NEBEL_ERROR_ARGUMENT;
    if (!(thickness > 0))
        return nb_fail(log, NEBEL_ERROR_ARGUMENT, "cloud layer: thickness of the air: is %g; must be more than 0",
                       thickness);
    if ((int)desc->type < 0 || desc->type >= NEBEL_CLOUD_TYPE_COUNT)
        return nb_fail(log, NEBEL_ERROR_VALUE, "cloud layer: type: is unknown");
    const nebel_cloud_layer whole = resolve(thickness, desc);
    nebel_result result = check_heights(thickness, desc, &whole, log);
    if (result == NEBEL_OK) result = check_looks(&whole, log);
    if (result == NEBEL_OK) *resolved = whole;
    return result;
}

/* ---- making ---------------------------------------------------------------------------------- */

/* A turn by 86 degrees about (1, 2, 3): the quaternion (1, 2, 3, 4) in whole numbers. */
static void turn_further(const double last[3][3], double next[3][3])
{
    static const double by[3][3] = {{4, -20, 22}, {28, 10, 4}, {-10, 20, 20}};
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++) {
            double sum = 0;
            for (int k = 0; k < 3; k++) sum += by[i][k] * last[k][j];
            next[i][j] = sum / 30;
        }
}

/* From the planet's weather, over groups of clouds, to cumulus cells. */
static void set_octaves(const nebel_cloud_layer *desc, double radius, nb_cloud_layer *layer)
{
    static const double weights[NB_CLOUD_OCTAVES] = {1, 1, 1, 0.45, 0.14};
    const double cells[NB_CLOUD_OCTAVES] = {fmax(radius / 5, 60 * desc->cell_size), 9.7 * desc->cell_size,
                                            desc->cell_size, desc->cell_size / 2.1, desc->cell_size / 4.3};
    double axes[3][3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    uint32_t hash = nb_mix_bits(desc->seed + 1);
    layer->slope = layer->most = 0;
    for (int k = 0; k < NB_CLOUD_OCTAVES; k++) {
        nb_cloud_octave *octave = &layer->octaves[k];
        double next[3][3];
        turn_further((const double(*)[3])axes, next);
        memcpy(axes, next, sizeof axes);
        octave->cell = (float)cells[k];
        octave->weight = (float)(weights[k] * (k < 2 ? fmax(0, desc->patchiness) : 1));
        for (int i = 0; i < 3; i++) {
            for (int j = 0; j < 3; j++) octave->turn[i][j] = axes[i][j] / cells[k];
            hash = nb_mix_bits(hash + 1);
            octave->shift[i] = (double)hash * 0x1p-32 * NB_CLOUD_LATTICE;
        }
        layer->slope += octave->weight * NB_GRADIENT_SLOPE / octave->cell;
        layer->most += octave->weight; /* noise is within -1 and 1 */
    }
    for (int i = 0; i < 3; i++) layer->worley_shift[i] = (double)nb_mix_bits(hash + (uint32_t)i) * 0x1p-32;
    double period = 0.9 * desc->cell_size;
    for (int i = 0; i < NB_CLOUD_WORLEY_SCALES; i++, period /= (double)NB_WORLEY_RATIO) {
        layer->per_worley[i] = 1 / period;
        layer->worley_slopes[i] =
            nb_worley_weights[i] * (float)fmax(0, desc->erosion) * NB_WORLEY_SLOPE / (float)period;
    }
    layer->last_worley = NB_WORLEY_SIZE * (float)layer->per_worley[NB_CLOUD_WORLEY_SCALES - 1];
    layer->grid = layer->octaves[NB_CLOUD_OCTAVES - 1].cell / 12;
    for (int i = 0; i < NB_CLOUD_GRIDS; i++) {
        const double wide = ldexp((double)layer->grid, i);
        layer->grids[i] = (nb_cloud_grid){wide / layer->low, layer->low / wide, i == 0 ? 0 : (float)wide};
    }
    /* Wisps are bent, and that noise has a slope, too. */
    if (desc->type == NEBEL_CLOUD_CIRRUS) layer->slope *= 2;
}

static void sort(float *values, int count)
{
    for (int gap = count / 2; gap > 0; gap = gap == 2 ? 1 : gap * 5 / 11)
        for (int i = gap; i < count; i++) {
            const float value = values[i];
            int k = i;
            for (; k >= gap && values[k - gap] > value; k -= gap) values[k] = values[k - gap];
            values[k] = value;
        }
}

/* Directions spread evenly over the ball, in a spiral. */
static void set_ranks(const nb_cloud_noise *noise, nb_cloud_layer *layer)
{
    enum { LOOKS = 16 * (NB_CLOUD_RANKS - 1) };
    float sums[LOOKS], variance;
    for (int i = 0; i < LOOKS; i++) {
        const double y = 1 - (2 * i + 1.0) / LOOKS, level = sqrt(1 - y * y), turned = 2.399963229728653 * i;
        const double unit[3] = {level * cos(turned), y, level * sin(turned)};
        sums[i] = sum_octaves(noise, layer, unit, 0, &variance);
    }
    sort(sums, LOOKS);
    for (int i = 0; i < NB_CLOUD_RANKS; i++) layer->ranks[i] = sums[i < NB_CLOUD_RANKS - 1 ? 16 * i : LOOKS - 1];
}

/* Next to a layer's ends depths up are not known well from nodes, which are a twelfth of its height apart at most. */
#define LEAST_SHALLOW 0.3f
#define SHALLOW_PART 0.05f

/* How wide clouds are in sizes of cells, by (1 - coverage) to the power of 0.6, and how high in parts of the layer's height: means of level
 * and upright ways through them, of 150 and 6,000 in 13 layers each within 30 %. Worley noise cuts them so often. */
#define WIDE_PART 0.27
#define CUTS_PER_WAY 3.2
#define HIGH_PART 0.43
#define CUT_OF_HEIGHT 0.57

/* Fitted to paths (docs/clouds.md). */
#define BROKEN_FLATNESS 2.05
#define BROKEN_POWER 1.7
#define LEAST_BROKEN 1e-4
#define LOSS 6.9
#define LOSS_DEPTH 21.0
#define SPILL 0.24
#define SPILL_DEPTH 14.0

/* Of a cloud that is so many times wider than high, and so deep along. */
static void set_sides(nb_cloud_layer *layer)
{
    const double cut = layer->kind == NEBEL_CLOUD_CUMULUS ? (double)layer->detail : 0;
    const double narrow = pow(1 - (double)layer->coverage, 0.6) / WIDE_PART + CUTS_PER_WAY * cut;
    layer->broken = layer->loss = layer->spill = 0;
    if (!(narrow > 0)) return;
    const double wide = (double)layer->size / narrow, depth = wide * (double)layer->extinction;
    const double high = HIGH_PART * (1 - CUT_OF_HEIGHT * cut) / (double)layer->per_thickness;
    const double broken = 1 / (1 + pow(wide / (BROKEN_FLATNESS * high), BROKEN_POWER));
    if (broken < LEAST_BROKEN) return;
    layer->broken = (float)broken;
    layer->loss = (float)(broken * LOSS / (depth + LOSS_DEPTH));
    layer->spill = (float)(broken * SPILL * depth / (depth + SPILL_DEPTH));
}

static nebel_result set_layer(nebel_clouds *clouds, const nebel_cloud_layer *desc, nb_cloud_layer *layer)
{
    const double radius = clouds->atmosphere->airs.radius, speed = hypot(desc->wind[0], desc->wind[1]);
    layer->kind = desc->type;
    layer->low = radius + desc->base;
    layer->high = radius + desc->top;
    layer->per_thickness = (float)(1 / (desc->top - desc->base));
    layer->extinction = (float)desc->extinction;
    layer->detail = (float)fmax(0, desc->erosion);
    layer->softness = kinds[desc->type].softness;
    layer->coverage = (float)desc->coverage;
    /* Up cross the wind: by that axis the ground place over the centre moves with it. */
    layer->axis[0] = speed > 0 ? desc->wind[1] / speed : 1;
    layer->axis[2] = speed > 0 ? -desc->wind[0] / speed : 0;
    layer->per_time = speed / layer->low;
    nb_cloud_phase_make(desc->type, desc->droplet_diameter, &layer->phase);
    layer->slab = nb_slab_make(&clouds->allocator, &layer->phase);
    if (layer->slab == NULL) return NEBEL_ERROR_MEMORY;
    layer->apart = layer->slab->apart;
    layer->shallow = LEAST_SHALLOW + SHALLOW_PART * layer->extinction / layer->per_thickness;
    layer->size = (float)desc->cell_size;
    set_sides(layer);
    layer->hidden_height = hidden_heights[desc->type != NEBEL_CLOUD_CUMULUS] / layer->per_thickness;
    layer->hidden_width = hidden_widths[desc->type != NEBEL_CLOUD_CUMULUS] * (float)desc->cell_size;
    set_octaves(desc, radius, layer);
    set_ranks(&clouds->noise, layer);
    return desc->weather_map.texels != NULL
               ? nb_planet_map_make(&clouds->allocator, &desc->weather_map, &layer->weather)
               : NEBEL_OK;
}

static int overlap(const nebel_cloud_layer *a, const nebel_cloud_layer *b)
{
    return a->base < b->top && b->base < a->top;
}

/* Layers that overlap would have to be walked together; none of the kinds do. */
static nebel_result check(const nebel_clouds_desc *desc, nebel_cloud_layer *layers)
{
    const nb_air_components *airs = &desc->atmosphere->airs;
    if (desc->layer_count > NEBEL_MAX_CLOUD_LAYERS)
        return nb_fail(&desc->host.log, NEBEL_ERROR_LIMIT, "clouds: %u layers; at most %d are possible",
                       (unsigned)desc->layer_count, NEBEL_MAX_CLOUD_LAYERS);
    if (desc->layer_count > 0 && nb_air_components_are_empty(airs))
        return nb_fail(&desc->host.log, NEBEL_ERROR_VALUE, "clouds: need air, and the planet has none");
    for (uint32_t i = 0; i < desc->layer_count; i++) {
        const nebel_result result =
            nebel_resolve_cloud_layer(airs->top - airs->radius, &desc->layers[i], &desc->host.log, &layers[i]);
        if (result != NEBEL_OK) return result;
        /* Larger ones do not change over the planet but by what is left of rounding. */
        if (layers[i].cell_size > NEBEL_MAX_CLOUD_CELL_RADII * airs->radius)
            return nb_fail(&desc->host.log, NEBEL_ERROR_VALUE,
                           "clouds: layers[%u] size: is %g; must be at most %g (4 radii)", (unsigned)i,
                           layers[i].cell_size, NEBEL_MAX_CLOUD_CELL_RADII * airs->radius);
        for (uint32_t k = 0; k < i; k++)
            if (overlap(&layers[k], &layers[i]))
                return nb_fail(
                    &desc->host.log, NEBEL_ERROR_VALUE,
                    "clouds: layers[%u] (%g to %g m) and layers[%u] (%g to %g m) overlap; give each heights of its own",
                    (unsigned)k, layers[k].base, layers[k].top, (unsigned)i, layers[i].base, layers[i].top);
    }
    return NEBEL_OK;
}

nebel_result nebel_create_clouds(const nebel_clouds_desc *desc, nebel_clouds **clouds)
{
    nebel_cloud_layer layers[NEBEL_MAX_CLOUD_LAYERS];
    if (clouds == NULL) return NEBEL_ERROR_ARGUMENT;
    *clouds = NULL;
    if (desc == NULL || !nb_allocator_is_valid(&desc->host.allocator)) return NEBEL_ERROR_ARGUMENT;
    if (desc->atmosphere == NULL)
        return nb_fail(&desc->host.log, NEBEL_ERROR_ARGUMENT, "clouds: atmosphere: is NULL; make one first");
    nebel_result result = check(desc, layers);
    if (result != NEBEL_OK) return result;
    const nebel_allocator allocator = nb_resolve_allocator(&desc->host.allocator);
    nebel_clouds *made = nb_allocate_zero(&allocator, 1, sizeof *made);
    if (made == NULL) return nb_fail(&desc->host.log, NEBEL_ERROR_MEMORY, "clouds: out of memory");
    made->allocator = allocator;
    made->atmosphere = desc->atmosphere;
    made->kernel = nb_cloud_kernel_choose(NEBEL_ISA_DEFAULT);
    result = nb_cloud_noise_make(&allocator, &made->noise);
    for (uint32_t i = 0; i < desc->layer_count && result == NEBEL_OK; i++) {
        made->layer_count++;
        result = set_layer(made, &layers[i], &made->layers[i]);
    }
    if (result == NEBEL_OK) {
        *clouds = made;
        return NEBEL_OK;
    }
    nebel_destroy_clouds(made);
    return nb_fail(&desc->host.log, result, "clouds: out of memory");
}

void nebel_destroy_clouds(nebel_clouds *clouds)
{
    if (clouds == NULL) return;
    const nebel_allocator allocator = clouds->allocator;
    for (int i = 0; i < clouds->layer_count; i++) {
        nb_planet_map_free(&allocator, &clouds->layers[i].weather);
        nb_release(&allocator, clouds->layers[i].slab);
    }
    nb_cloud_noise_free(&allocator, &clouds->noise);
    nb_release(&allocator, clouds);
}

static void add_layer(const nebel_clouds *clouds, int k, double time, float width, size_t n, const double (*places)[3],
                      size_t stride, float *extinction)
{
    const nb_cloud_rotation pose = nb_cloud_pose_at(&clouds->layers[k], time);
    nb_cloud_density_query looks = {.count = 0, .are_of_rays = 0};
    for (size_t first = 0; first < n; first += NB_CLOUD_LANES) {
        const size_t count = n - first < NB_CLOUD_LANES ? n - first : NB_CLOUD_LANES;
        float means[NB_CLOUD_LANES];
        for (size_t i = 0; i < count; i++) {
            double from[3];
            nb_air_from_center(clouds->atmosphere, nb_stride_from(places, stride, first + i), from);
            nb_cloud_ask(&looks, &pose, from, width);
        }
        nb_cloud_find_means(clouds, k, &looks, means);
        for (size_t i = 0; i < count; i++) extinction[first + i] += means[i];
    }
}

nebel_result nebel_compute_cloud_extinction(const nebel_clouds *clouds, double time, double width, size_t n,
                                            const double (*places)[3], size_t place_stride, float *extinction)
{
    if (clouds == NULL || (n > 0 && (places == NULL || extinction == NULL)) || !(fabs(time) <= 1e12) ||
        !(width >= 0 && width <= NEBEL_MAX_LENGTH))
        return NEBEL_ERROR_ARGUMENT;
    place_stride = nb_stride_of(place_stride, sizeof *places);
    for (size_t i = 0; i < n; i++) {
        if (!nb_air_is_place(nb_stride_from(places, place_stride, i))) return NEBEL_ERROR_ARGUMENT;
        extinction[i] = 0;
    }
    for (int k = 0; k < clouds->layer_count; k++)
        add_layer(clouds, k, time, (float)width, n, places, place_stride, extinction);
    return NEBEL_OK;
}

nebel_result nebel_cloud_phase(const nebel_clouds *clouds, uint32_t layer, size_t n, const double *cosines,
                               double (*phases)[3])
{
    if (clouds == NULL || layer >= (uint32_t)clouds->layer_count || (n > 0 && (cosines == NULL || phases == NULL)))
        return NEBEL_ERROR_ARGUMENT;
    for (size_t i = 0; i < n; i++)
        if (!(fabs(cosines[i]) <= 1)) return NEBEL_ERROR_ARGUMENT;
    for (size_t i = 0; i < n; i++) {
        float values[4];
        nb_cloud_phase_at(&clouds->layers[layer].phase, cosines[i], values);
        for (int c = 0; c < 3; c++) phases[i][c] = (double)values[c];
    }
    return NEBEL_OK;
}
