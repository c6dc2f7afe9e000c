/* Rays through a table of air, and the ground that they meet, compiled once per instruction set. A ray is a lane, and does
 * not depend on the others. */
#define NB_FAST
#define NB_DOUBLE

#include "sky_view_lookup.h"

#include "base/isa_list.h"

#include <math.h>

#include "formulas/prelude.h"

#include "formulas/elementary.inc"
#include "formulas/phase.inc"
#include "formulas/atmosphere.inc"

#include "atmosphere.h"
#include "radiance_moments_lanes.h"

/* ---- lanes ----------------------------------------------------------------------------------- */

/* Lanes of a job: `count` rays from `first` on, which the last one fills up. */
typedef struct nb_sky_view_part {
    size_t first, count;
} nb_sky_view_part;

static inline nb_sky_view_part part_from(const nb_sky_view_job *job, size_t first)
{
    const size_t left = job->count - first;
    return (nb_sky_view_part){first, left < NB_WIDTH ? left : NB_WIDTH};
}

static inline nb_real load_doubles(nb_sky_view_part part, const double *from)
{
    if (part.count == NB_WIDTH) return nb_load_lanes(from + part.first);
    double lanes[NB_WIDTH];
    for (size_t i = 0; i < NB_WIDTH; i++) lanes[i] = from[part.first + (i < part.count ? i : part.count - 1)];
    return nb_load_lanes(lanes);
}

static inline nb_real load_floats(nb_sky_view_part part, const float *from)
{
    if (part.count == NB_WIDTH) return nb_load_floats(from + part.first);
    float lanes[NB_WIDTH];
    for (size_t i = 0; i < NB_WIDTH; i++) lanes[i] = from[part.first + (i < part.count ? i : part.count - 1)];
    return nb_load_floats(lanes);
}

/* NULL: not wanted. */
static inline void store_floats(nb_sky_view_part part, nb_real x, float *to)
{
    if (to == NULL) return;
    if (part.count == NB_WIDTH) {
        nb_store_floats(to + part.first, x);
        return;
    }
    float lanes[NB_WIDTH];
    nb_store_floats(lanes, x);
    for (size_t i = 0; i < part.count; i++) to[part.first + i] = lanes[i];
}

/* ---- directions ------------------------------------------------------------------------------ */

/* Directions as the view's place has them, of length 1; those that are none are level. */
typedef struct nb_bearings {
    nb_mask is_direction;
    nb_real up, ahead, aside, level; /* level: what is not up */
} nb_bearings;

static inline nb_real along(const double axis[3], const nb_real direction[3])
{
    return direction[0] * nb_splat(axis[0]) + direction[1] * nb_splat(axis[1]) + direction[2] * nb_splat(axis[2]);
}

static inline nb_bearings bearings_of(const nb_sky_view_job *job, nb_sky_view_part part)
{
    const nb_sky_view_table *table = job->table;
    nb_real d[3], square = NB_F(0.0);
    nb_bearings b;
    for (int c = 0; c < 3; c++) {
        d[c] = load_doubles(part, job->direction[c]);
        square = square + d[c] * d[c];
    }
    b.is_direction = nb_and(square > NB_F(0.0), square <= NB_F(1.7976931348623157e308));
    const nb_real per = NB_F(1.0) / nb_sqrt(nb_select(b.is_direction, square, NB_F(1.0)));
    for (int c = 0; c < 3; c++) d[c] = nb_select(b.is_direction, per * d[c], nb_splat(table->ahead[c]));
    b.up = along(table->up, d);
    b.ahead = along(table->ahead, d);
    b.aside = along(table->aside, d);
    b.level = nb_sqrt(b.ahead * b.ahead + b.aside * b.aside);
    return b;
}

static inline nb_real bound_cosine(nb_real x)
{
    return nb_clamp(x, NB_F(-1.0), NB_F(1.0));
}

/* The cosine of the angle between a direction and the sun. */
static inline nb_real sun_along(const nb_sky_view_table *table, const nb_bearings *b)
{
    return bound_cosine(b->up * nb_splat(table->sun_cosine) + b->ahead * nb_splat(table->sun_sine));
}

static inline nb_elevation_map outlook_of(const nb_sky_view_table *table)
{
    return (nb_elevation_map){.radius = nb_splat(table->radius),
                              .ground = nb_splat(table->ground),
                              .thickness = nb_splat(table->thickness),
                              .height = nb_splat(table->height),
                              .dip = nb_splat(table->dip),
                              .ratio = nb_splat(table->ratio),
                              .horizon = nb_splat(table->horizon),
                              .half_arc = nb_splat(table->half_arc)};
}

static inline nb_mask falls(const nb_elevation_map *outlook, const nb_bearings *b)
{
    return nb_above_horizon(*outlook, b->up, b->level) < NB_F(0.0);
}

static inline nb_reach reach_of(const nb_elevation_map *outlook, const nb_bearings *b)
{
    const nb_mask down = falls(outlook, b);
    if (nb_all(down)) return nb_falling_reach(*outlook, b->up, b->level);
    const nb_reach rising = nb_rising_reach(*outlook, b->up, b->level);
    if (!nb_any(down)) return rising;
    const nb_reach falling = nb_falling_reach(*outlook, b->up, b->level);
    return (nb_reach){.falls = down,
                      .begin = nb_select(down, falling.begin, rising.begin),
                      .span = nb_select(down, falling.span, rising.span),
                      .row = nb_select(down, falling.row, rising.row),
                      .dense = nb_select(down, falling.dense, rising.dense),
                      .soft = nb_select(down, falling.soft, rising.soft)};
}

/* ---- places in the table --------------------------------------------------------------------- */

/* Rays in the terms of the table. */
typedef struct nb_sky_view_lookups {
    nb_real along; /* m in the air; 0: none, and the rest means nothing */
    nb_real sun;   /* cosine of the angle to it */
    nb_real row, column, level, row_part, column_part, level_part;
} nb_sky_view_lookups;

static inline nb_real place_in(nb_real place, nb_real most, nb_real *part)
{
    const nb_real first = nb_min(nb_floor(nb_max(place, NB_F(0.0))), most);
    *part = place - first;
    return first;
}

/* Distances have float's digits: what they do not tell from the end, such as the ground under thin air, is there. */
static inline nb_real length_in(const nb_sky_view_job *job, nb_sky_view_part part, const nb_reach *reach)
{
    if (job->t_max == NULL) return reach->span;
    const nb_real t_max = load_floats(part, job->t_max), way = t_max - reach->begin;
    return nb_select(way > reach->span - NB_F(0x1p-22) * t_max, reach->span, way);
}

static inline nb_sky_view_lookups looks_along(const nb_sky_view_job *job, nb_sky_view_part part)
{
    const nb_sky_view_table *table = job->table;
    const nb_elevation_map outlook = outlook_of(table);
    const nb_bearings b = bearings_of(job, part);
    const nb_reach reach = reach_of(&outlook, &b);
    nb_sky_view_lookups l;
    l.along = nb_select(b.is_direction, nb_max(length_in(job, part, &reach), NB_F(0.0)), NB_F(0.0));
    l.sun = sun_along(table, &b);
    const nb_real cosine = b.ahead / nb_select(b.level > NB_F(0.0), b.level, NB_F(1.0));
    const nb_real half =
        nb_select(b.level > NB_F(0.0), nb_sqrt(nb_max(NB_F(0.0), NB_F(0.5) * (NB_F(1.0) - cosine))), NB_F(0.0));
    const nb_mask ends = l.along < reach.span;
    const nb_real share = l.along / nb_select(ends, reach.span, NB_F(1.0));
    const nb_real level = nb_select(ends, nb_level_at(reach.dense, reach.soft, share), NB_F(1.0));
    const nb_real rows = nb_select(reach.falls, nb_splat(table->falling), nb_splat(table->rising));
    l.row = place_in(reach.row * (rows - NB_F(1.0)), rows - NB_F(2.0), &l.row_part) +
            nb_select(reach.falls, NB_F(0.0), nb_splat(table->falling));
    l.column =
        place_in(nb_min(NB_F(1.0), half) * nb_splat(table->columns - 1), nb_splat(table->columns - 2), &l.column_part);
    l.level = place_in(level * nb_splat(table->levels), nb_splat(table->levels - 1), &l.level_part);
    if (table->levels == 1) return l;
    /* Near the eye means are linear. */
    const nb_real first = nb_level_end(reach.dense, reach.soft, nb_splat(1.0 / table->levels));
    l.level_part = nb_select(l.level > NB_F(0.0), l.level_part, nb_min(NB_F(1.0), share / first));
    return l;
}

/* ---- reading --------------------------------------------------------------------------------- */

typedef float four __attribute__((vector_size(16)));

static inline four load_four(const float *from)
{
    four x;
    memcpy(&x, from, sizeof x);
    return x;
}

/* What lanes read of the table, number by number. */
typedef struct nb_read {
    float mean[NB_VIEW_SIZE][NB_WIDTH];
    double extinction[4][NB_WIDTH];
} nb_read;

/* One ray's place in the table. */
typedef struct nb_sky_view_sample {
    size_t row, column, level;
    double row_part, column_part, level_part;
} nb_sky_view_sample;

/* Four neighbours of one level, and their weights. */
typedef struct nb_sky_view_corners {
    const float *entries[4];
    float weights[4];
} nb_sky_view_corners;

static inline nb_sky_view_corners corners_of(const nb_sky_view_table *table, const nb_sky_view_sample *spot,
                                             size_t level, double weight)
{
    const size_t next = (size_t)table->size * ((size_t)table->levels + 1), below = next * (size_t)table->columns;
    const float *entry = table->entries + spot->row * below + spot->column * next + level * (size_t)table->size;
    const double upper = weight * (1 - spot->row_part), lower = weight * spot->row_part;
    return (nb_sky_view_corners){{entry, entry + next, entry + below, entry + below + next},
                                 {(float)(upper * (1 - spot->column_part)), (float)(upper * spot->column_part),
                                  (float)(lower * (1 - spot->column_part)), (float)(lower * spot->column_part)}};
}

static inline four mix(const nb_sky_view_corners *corners, int i)
{
    four sum = corners->weights[0] * load_four(corners->entries[0] + i);
    for (int k = 1; k < 4; k++) sum += corners->weights[k] * load_four(corners->entries[k] + i);
    return sum;
}

static inline void store_mean(four mean, int i, int lane, nb_read *read)
{
    for (int j = 0; j < 4; j++) read->mean[i + j][lane] = mean[j];
}

static inline void read_light(const nb_sky_view_table *table, const nb_sky_view_sample *spot, int lane, nb_read *read)
{
    const nb_sky_view_corners far = corners_of(table, spot, spot->level + 1, spot->level_part);
    if (spot->level_part == 1) {
        for (int i = 0; i < table->size; i += 4) store_mean(mix(&far, i), i, lane, read);
        return;
    }
    const nb_sky_view_corners near = corners_of(table, spot, spot->level, 1 - spot->level_part);
    for (int i = 0; i < table->size; i += 4) store_mean(mix(&near, i) + mix(&far, i), i, lane, read);
}

static inline void read_extinction(const nb_sky_view_table *table, const nb_sky_view_sample *spot, int lane,
                                   nb_read *read)
{
    const double(*near)[4] = &table->extinction[spot->row * ((size_t)table->levels + 1) + spot->level];
    const double(*below)[4] = near + table->levels + 1, row = spot->row_part, level = spot->level_part;
    for (int c = 0; c < 4; c++) {
        const double here = near[0][c] * (1 - row) + below[0][c] * row;
        const double there = near[1][c] * (1 - row) + below[1][c] * row;
        read->extinction[c][lane] = here + level * (there - here);
    }
}

static inline void read_table(const nb_sky_view_table *table, const nb_sky_view_lookups *looks, nb_read *read)
{
    double row[NB_WIDTH], column[NB_WIDTH], level[NB_WIDTH], parts[3][NB_WIDTH];
    nb_store_lanes(row, looks->row);
    nb_store_lanes(column, looks->column);
    nb_store_lanes(level, looks->level);
    nb_store_lanes(parts[0], looks->row_part);
    nb_store_lanes(parts[1], looks->column_part);
    nb_store_lanes(parts[2], looks->level_part);
    for (int i = 0; i < NB_WIDTH; i++) {
        const nb_sky_view_sample spot = {(size_t)row[i], (size_t)column[i], (size_t)level[i],
                                         parts[0][i],    parts[1][i],       parts[2][i]};
        read_light(table, &spot, i, read);
        read_extinction(table, &spot, i, read);
    }
}

/* ---- light ----------------------------------------------------------------------------------- */

static inline nb_real phase_at(const nb_phase *phase, nb_real cosine)
{
    const nb_turn turn = {cosine, NB_F(1.0) - cosine, NB_F(1.0) + cosine};
    nb_real sum = NB_F(0.0);
    for (int i = 0; i < phase->lobe_count; i++) {
        const nb_lobe *lobe = &phase->lobes[i];
        sum = sum + nb_phase_lobe(nb_splat(lobe->factor), nb_splat(lobe->alpha), nb_splat(lobe->peak),
                                  nb_splat(lobe->slope), turn);
    }
    return sum;
}

/* Light of three colours; returns what may be wrong with it. */
static inline nb_real light_of(const nb_sky_view_table *table, const nb_sky_view_lookups *looks, const nb_read *read,
                               nb_real light[3])
{
    const int often = 3 * table->scatterer_count;
    nb_real once[3], error = NB_F(0.0), most = NB_F(0.0);
    for (int c = 0; c < 3; c++) once[c] = NB_F(0.0);
    for (int k = 0; k < table->scatterer_count; k++) {
        const nb_real phase = phase_at(table->phases[k], looks->sun);
        for (int c = 0; c < 3; c++) once[c] = once[c] + phase * nb_load_floats(read->mean[3 * k + c]);
    }
    for (int c = 0; c < 3; c++) {
        const nb_real sunlight = looks->along * nb_splat(table->irradiance[c]);
        light[c] = sunlight * nb_max(NB_F(0.0), once[c] + nb_load_floats(read->mean[often + c]));
        error = nb_max(error, sunlight * NB_F(NB_ONCE_OFF) * once[c]);
        most = nb_max(most, light[c]);
    }
    return error + looks->along * nb_load_floats(read->mean[often + 3]) + nb_load_floats(read->mean[often + 4]) * most +
           nb_splat(table->least_off);
}

static void look_along(const nb_sky_view_job *job)
{
    const nebel_transfer_planes *transfers = &job->transfers;
    for (size_t first = 0; first < job->count; first += NB_WIDTH) {
        const nb_sky_view_part part = part_from(job, first);
        const nb_sky_view_lookups looks = looks_along(job, part);
        const nb_mask has_air = looks.along > NB_F(0.0);
        nb_read read;
        nb_real light[3];
        read_table(job->table, &looks, &read);
        nb_real error = nb_select(has_air, light_of(job->table, &looks, &read, light), NB_F(0.0));
        const nb_real off = looks.along * nb_load_lanes(read.extinction[3]);
        const nb_real rounding = nb_select(has_air, NB_F(NB_LIGHT_ROUNDING), NB_F(0.0));
        for (int c = 0; c < 3; c++) {
            const nb_real left = nb_exp(-(looks.along * nb_load_lanes(read.extinction[c])));
            error = nb_max(error, off * left + rounding);
            store_floats(part, left, transfers->transmittance[c]);
            store_floats(part, nb_select(has_air, light[c], NB_F(0.0)), transfers->in_scattering[c]);
        }
        store_floats(part, error, transfers->error);
    }
}

/* ---- the ground ------------------------------------------------------------------------------ */

/* What air leaves of the sun on the ground. */
static inline void sunlight_at(const nb_sky_view_table *table, nb_real cosine, nb_real light[3])
{
    nb_real between;
    const nb_real place = nb_sqrt(nb_max(NB_F(0.0), cosine)) * nb_splat(table->suns - 1);
    const nb_real index = place_in(place, nb_splat(table->suns - 2), &between) * NB_F(3.0);
    for (int c = 0; c < 3; c++) {
        const double *from = &table->sunlight[0][c];
        const nb_real a = nb_pick(from, index), b = nb_pick(from + 3, index);
        light[c] = nb_select(cosine > NB_F(0.0), a + between * (b - a), NB_F(0.0));
    }
}

static inline void skylight_at(const nb_sky_view_table *table, nb_real cosine, nb_real light[3])
{
    const nb_moment_interval s = nb_between_suns(table->scatter, cosine);
    for (int c = 0; c < 3; c++) {
        const double *from = &table->scatter->ground[0][c];
        const nb_real a = nb_pick(from, s.first * NB_F(3.0)), b = nb_pick(from + 3, s.first * NB_F(3.0));
        light[c] = nb_exp(a + s.part * (b - a));
    }
}

/* Rays that meet no ground leave what is there. */
static inline void store_hits(nb_sky_view_part part, nb_mask hits, nb_real x, float *to)
{
    double lanes[NB_WIDTH];
    if (to == NULL) return;
    nb_store_lanes(lanes, x);
    for (size_t i = 0; i < part.count; i++)
        if (nb_lane(hits, i)) to[part.first + i] = (float)lanes[i];
}

/* The way to the ground, HUGE_VAL where a ray does not meet it. */
static inline nb_real way_down(const nb_elevation_map *outlook, const nb_bearings *b, nb_mask down)
{
    if (!nb_any(down)) return nb_splat(HUGE_VAL);
    const nb_reach reach = nb_falling_reach(*outlook, b->up, b->level);
    return nb_select(down, reach.begin + reach.span, nb_splat(HUGE_VAL));
}

static void store_ground(const nb_sky_view_job *job, nb_sky_view_part part, const nb_bearings *b, nb_mask down,
                         nb_real way)
{
    const nb_sky_view_table *table = job->table;
    const nebel_ground_planes *planes = &job->ground;
    const nb_real per = nb_splat(1 / table->ground), r = nb_splat(table->radius);
    const nb_real up = (r + way * b->up) * per, ahead = way * b->ahead * per, aside = way * b->aside * per;
    const nb_real cosine =
        bound_cosine((nb_splat(table->radius * table->sun_cosine) + way * sun_along(table, b)) * per);
    nb_real sun[3], sky[3];
    sunlight_at(table, cosine, sun);
    skylight_at(table, cosine, sky);
    for (int c = 0; c < 3; c++) {
        const nb_real irradiance = nb_splat(table->irradiance[c]);
        const nb_real normal =
            up * nb_splat(table->up[c]) + ahead * nb_splat(table->ahead[c]) + aside * nb_splat(table->aside[c]);
        store_hits(part, down, normal, planes->normal[c]);
        store_hits(part, down, sun[c] * irradiance, planes->sun[c]);
        store_hits(part, down, sky[c] * irradiance, planes->sky[c]);
    }
}

static void look_down(const nb_sky_view_job *job)
{
    const nb_elevation_map outlook = outlook_of(job->table);
    for (size_t first = 0; first < job->count; first += NB_WIDTH) {
        const nb_sky_view_part part = part_from(job, first);
        const nb_bearings b = bearings_of(job, part);
        const nb_mask down = nb_and(b.is_direction, falls(&outlook, &b));
        const nb_real way = way_down(&outlook, &b, down);
        store_floats(part, way, job->ground.distance);
        if (nb_any(down)) store_ground(job, part, &b, down, nb_select(down, way, NB_F(0.0)));
    }
}

const nb_sky_view_kernel NB_SUFFIXED(nb_sky_view_kernel_) = {look_along, look_down};
