#include <nebel/particles.h>

#include "base/base.h"
#include "base/precision.h"
#include "turbulence.h"
#include "medium/medium_check.h"
#include "medium/density.h"

#include <math.h>
#include <string.h>

#define NB_DOUBLE
#include "formulas/prelude.h"

#include "formulas/elementary.inc"

/* What is drawn for a particle, each from a sequence of its own. */
enum { STREAM_PLACE, STREAM_SIZE, STREAM_COLOR, STREAM_COLOR_FIELD, STREAM_EDDIES };

/* Shapes that fill less of their bounding box than one part in this have no place for us. */
#define MOST_TRIES 100000

/* How much of a particle's place in the colours is its own; the rest belongs to where it is. */
#define OWN_COLOR 0.3

typedef struct nb_nebula_state {
    const nebel_nebula_desc *desc;
    nebel_allocator allocator;
    nb_volume volume; /* unless there are points */
    double size[2];
    double eddy; /* m */
} nb_nebula_state;

nebel_volume_desc nebel_volume_from_particle(const nebel_particle *particle)
{
    if (particle == NULL) return (nebel_volume_desc){.priority = 0};
    nebel_volume_desc volume = {.shape = {.type = NEBEL_SHAPE_SPHERE, .radius = particle->radius}};
    if (particle->profile == NEBEL_PARTICLE_SOFT) {
        volume.density = (nebel_density){.type = NEBEL_DENSITY_RADIAL, .power = 2};
    } else if (particle->profile == NEBEL_PARTICLE_GAUSSIAN) {
        volume.density = (nebel_density){.type = NEBEL_DENSITY_GAUSSIAN, .sigma = particle->radius / 3};
    }
    for (int c = 0; c < 3; c++) {
        volume.shape.center[c] = volume.density.center[c] = particle->center[c];
        volume.extinction[c] = particle->extinction[c];
        volume.emission[c] = particle->emission[c];
    }
    return volume;
}

/* ---- checks ---------------------------------------------------------------------------------- */

/* What each particle has of it must be what a volume may have. */
static nebel_result check_amounts(const nebel_nebula_desc *desc)
{
    const nebel_result result =
        nb_check_color(&desc->host.log, "nebula: absorption", desc->absorption, NEBEL_MAX_AMOUNT);
    if (result != NEBEL_OK) return result;
    for (size_t i = 0; i < desc->color_count; i++)
        for (int c = 0; c < 3; c++)
            if (!(desc->colors[i][c] >= 0 && desc->colors[i][c] * desc->emission[c] <= NEBEL_MAX_AMOUNT))
                return nb_fail(&desc->host.log, NEBEL_ERROR_VALUE,
                               "nebula: color %zu must not be negative, and emission times it at most %g", i,
                               NEBEL_MAX_AMOUNT);
    return nb_check_color(&desc->host.log, "nebula: emission", desc->emission, NEBEL_MAX_AMOUNT);
}

/* That of a gaussian is a third of the radius. */
static int is_radius(const nebel_nebula_desc *desc, double radius)
{
    const double least = desc->profile == NEBEL_PARTICLE_GAUSSIAN ? 3 * NEBEL_MIN_LENGTH : NEBEL_MIN_LENGTH;
    return radius >= least && radius <= NEBEL_MAX_LENGTH;
}

static nebel_result check_lengths(const nebel_nebula_desc *desc)
{
    const int default_size = desc->radius_range[0] == 0 && desc->radius_range[1] == 0;
    if (!default_size && !(is_radius(desc, desc->radius_range[0]) && is_radius(desc, desc->radius_range[1])))
        return nb_fail(&desc->host.log, NEBEL_ERROR_VALUE,
                       "nebula: sizes are %g to %g m; they must be from %g (a gaussian: 3 times that) to %g m",
                       desc->radius_range[0], desc->radius_range[1], NEBEL_MIN_LENGTH, NEBEL_MAX_LENGTH);
    if (!(desc->radius_range[0] <= desc->radius_range[1]))
        return nb_fail(&desc->host.log, NEBEL_ERROR_VALUE, "nebula: sizes are %g to %g m; the smaller must come first",
                       desc->radius_range[0], desc->radius_range[1]);
    if (!(desc->dimming >= 0 && desc->dimming <= 1))
        return nb_fail(&desc->host.log, NEBEL_ERROR_VALUE, "nebula: dimming is %g; it must be from 0 to 1",
                       desc->dimming);
    if (!(desc->turbulence >= 0 && desc->turbulence <= NEBEL_MAX_LENGTH))
        return nb_fail(&desc->host.log, NEBEL_ERROR_VALUE, "nebula: turbulence is %g m; it must be from 0 to %g",
                       desc->turbulence, NEBEL_MAX_LENGTH);
    const double eddy = desc->turbulence_scale;
    if (!(eddy == 0 || (eddy >= NEBEL_MIN_LENGTH && eddy <= NEBEL_MAX_LENGTH)))
        return nb_fail(&desc->host.log, NEBEL_ERROR_VALUE,
                       "nebula: turbulence_scale is %g m; it must be 0, or from %g to %g", eddy, NEBEL_MIN_LENGTH,
                       NEBEL_MAX_LENGTH);
    return NEBEL_OK;
}

static nebel_result check_desc(const nebel_nebula_desc *desc)
{
    if (!nb_allocator_is_valid(&desc->host.allocator))
        return nb_fail(&desc->host.log, NEBEL_ERROR_ARGUMENT,
                       "nebula: the allocator needs allocate and release, or neither");
    if (desc->profile < 0 || desc->profile >= NEBEL_PARTICLE_PROFILE_COUNT)
        return nb_fail(&desc->host.log, NEBEL_ERROR_VALUE, "nebula: %d is no profile of a particle",
                       (int)desc->profile);
    const nebel_result result = check_lengths(desc);
    return result == NEBEL_OK ? check_amounts(desc) : result;
}

static double find_extent(const double low[3], const double high[3])
{
    double extent = 0;
    for (int i = 0; i < 3; i++) extent = fmax(extent, high[i] - low[i]);
    return extent;
}

/* *extent [m] is the longest side of the shape's bounds. */
static nebel_result open_shape(nb_nebula_state *made, double *extent)
{
    const nebel_volume_desc body = {.shape = made->desc->shape, .density = made->desc->density};
    const nebel_result result = nb_volume_resolve(&made->allocator, &made->desc->host.log, &body, &made->volume);
    if (result != NEBEL_OK) return result;
    *extent = find_extent(made->volume.low, made->volume.high);
    if (isfinite(*extent)) return NEBEL_OK;
    nb_volume_free(&made->allocator, &made->volume);
    return nb_fail(&made->desc->host.log, NEBEL_ERROR_VALUE,
                   "nebula: its shape has no bounds; particles need a place to be in");
}

static nebel_result measure_points(const nebel_nebula_desc *desc, double *extent)
{
    double low[3] = {HUGE_VAL, HUGE_VAL, HUGE_VAL}, high[3] = {-HUGE_VAL, -HUGE_VAL, -HUGE_VAL};
    for (size_t i = 0; i < desc->count; i++)
        for (int k = 0; k < 3; k++) {
            if (!isfinite(desc->points[i][k]))
                return nb_fail(&desc->host.log, NEBEL_ERROR_VALUE, "nebula: point %zu is not finite", i);
            low[k] = fmin(low[k], desc->points[i][k]);
            high[k] = fmax(high[k], desc->points[i][k]);
        }
    *extent = find_extent(low, high);
    return NEBEL_OK;
}

static nebel_result open_cloud(const nebel_nebula_desc *desc, nb_nebula_state *made)
{
    double extent = 0;
    *made = (nb_nebula_state){.desc = desc,
                              .allocator = nb_resolve_allocator(&desc->host.allocator),
                              .size = {desc->radius_range[0], desc->radius_range[1]},
                              .eddy = desc->turbulence_scale};
    const nebel_result result = desc->points != NULL ? measure_points(desc, &extent) : open_shape(made, &extent);
    if (result != NEBEL_OK) return result;
    if (made->size[1] == 0) made->size[0] = 0.05, made->size[1] = 0.2;
    if (made->eddy == 0) made->eddy = extent > 0 ? extent / 4 : 1;
    return NEBEL_OK;
}

/* ---- one particle ---------------------------------------------------------------------------- */

static double chance(const nb_nebula_state *from, int stream, size_t particle, uint64_t i)
{
    const uint64_t seed = from->desc->seed + UINT64_C(0x100000001b3) * (uint64_t)stream;
    return nb_chance(seed, (uint64_t)particle * (MOST_TRIES * 4) + i);
}

/* 0 of no density, whatever the exponent. */
static double power(double density, double exponent)
{
    if (!(density > 0)) return 0;
    return exponent == 1 ? density : nb_exp(exponent * nb_log(density));
}

/* A point of the caller's; or tries places in the bounding box, each taken with the chance that the density there says.
 * *share: what the particle has of its amounts. */
static int find_place(const nb_nebula_state *from, size_t particle, double place[3], double *share)
{
    const double *low = from->volume.low, *high = from->volume.high;
    if (from->desc->points != NULL) {
        memcpy(place, from->desc->points[particle], 3 * sizeof *place);
        *share = 1;
        return 1;
    }
    for (uint64_t n = 0; n < MOST_TRIES; n++) {
        for (uint64_t i = 0; i < 3; i++)
            place[i] = low[i] + (high[i] - low[i]) * chance(from, STREAM_PLACE, particle, 4 * n + i);
        const double density = nb_density_at(&from->volume, place);
        *share = power(density, from->desc->dimming);
        if (chance(from, STREAM_PLACE, particle, 4 * n + 3) < power(density, 1 - from->desc->dimming)) return 1;
    }
    return 0;
}

static void stir(const nb_nebula_state *from, const double place[3], double stirred[3])
{
    const double p[3] = {place[0] / from->eddy, place[1] / from->eddy, place[2] / from->eddy};
    for (int i = 0; i < 3; i++) {
        const uint64_t seed = from->desc->seed + UINT64_C(0x51) * (uint64_t)(STREAM_EDDIES + i) + 1;
        stirred[i] = place[i] + from->desc->turbulence * nb_eddies(seed, p);
    }
}

static double pick_size(const nb_nebula_state *from, size_t particle)
{
    const double octaves = nb_log(from->size[1] / from->size[0]);
    return fmin(from->size[0] * nb_exp(octaves * chance(from, STREAM_SIZE, particle, 0)), from->size[1]);
}

/* Eddies rarely reach their limits: three times their value, clamped, uses all colours. */
static void pick_color(const nb_nebula_state *from, size_t particle, const double place[3], double color[3])
{
    const nebel_nebula_desc *desc = from->desc;
    color[0] = color[1] = color[2] = 1;
    if (desc->color_count == 0) return;
    const double p[3] = {place[0] / from->eddy, place[1] / from->eddy, place[2] / from->eddy};
    const double drift = 0.5 + 1.5 * nb_eddies(desc->seed + STREAM_COLOR_FIELD, p);
    const double own = chance(from, STREAM_COLOR, particle, 0);
    const double mixed = fmin(fmax((1 - OWN_COLOR) * drift + OWN_COLOR * own, 0), 1) * (double)(desc->color_count - 1);
    const size_t first = (size_t)mixed;
    const size_t second = first + 1 < desc->color_count ? first + 1 : first;
    for (int c = 0; c < 3; c++) {
        const double a = desc->colors[first][c], b = desc->colors[second][c];
        color[c] = a + (b - a) * (mixed - (double)first);
    }
}

static int make_particle(const nb_nebula_state *from, size_t number, nebel_particle *particle)
{
    double place[3], color[3], share;
    if (!find_place(from, number, place, &share)) return 0;
    *particle = (nebel_particle){.radius = pick_size(from, number), .profile = from->desc->profile};
    pick_color(from, number, place, color);
    stir(from, place, particle->center);
    for (int c = 0; c < 3; c++) {
        particle->extinction[c] = share * from->desc->absorption[c];
        particle->emission[c] = share * from->desc->emission[c] * color[c];
    }
    return 1;
}

nebel_result nebel_generate_nebula(const nebel_nebula_desc *desc, nebel_particle *particles)
{
    if (desc == NULL || (particles == NULL && desc->count > 0) || (desc->colors == NULL && desc->color_count > 0))
        return NEBEL_ERROR_ARGUMENT;
    nb_nebula_state from;
    nebel_result result = check_desc(desc);
    if (result == NEBEL_OK) result = open_cloud(desc, &from);
    if (result != NEBEL_OK) return result;
    const unsigned precision = nb_full_precision();
    for (size_t i = 0; i < desc->count && result == NEBEL_OK; i++) {
        if (!make_particle(&from, i, &particles[i]))
            result = nb_fail(
                &desc->host.log, NEBEL_ERROR_VALUE,
                "nebula: no place for particle %zu in %d tries; its shape is empty or thin, or its density nearly 0", i,
                MOST_TRIES);
    }
    nb_restore_precision(precision);
    if (desc->points == NULL) nb_volume_free(&from.allocator, &from.volume);
    return result;
}
