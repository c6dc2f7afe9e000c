#include "multiple_scattering.h"

#include "in_scattering.h"
#include "scattering_orders.h"
#include "stray.h"

#include <math.h>
#include <string.h>

#define NB_DOUBLE
#include "formulas/prelude.h"

#include "formulas/elementary.inc"

#include "radiance_moments_lanes.h"

#define PI 3.14159265358979323846

/* ---- looking up ------------------------------------------------------------------------------ */

/* Entries are denser near the ground, and where the sun is near the horizon. */
static double height_at(const nb_scattering_table *scatter, const nb_air_components *airs, int i)
{
    const double part = (double)i / (scatter->heights - 1);
    return (airs->top - airs->radius) * part * part;
}

/* The sine of the angle at which the horizon lies, seen from the top of the air. */
static double dip(const nb_air_components *airs)
{
    const double ratio = airs->radius / airs->top;
    return sqrt((1 - ratio) * (1 + ratio));
}

/* Entries over the sun's height lie evenly over this: dense at the horizon, and near the zenith as even as angles. */
static double spread(double sun, double scale)
{
    return copysign(log(1 + 2 * fabs(sun) / (1 + sqrt(fmax(0, 1 - fabs(sun)))) / scale), sun);
}

static double sun_at(const nb_scattering_table *scatter, int i)
{
    const double part = (double)i / (scatter->suns - 1);
    const double place = scatter->first_sun + part * (scatter->last_sun - scatter->first_sun);
    const double left = fmax(0, 1 - 0.5 * scatter->sun_scale * (exp(fabs(place)) - 1));
    return copysign(1 - left * left, place);
}

nb_radiance_moments nb_scattering_table_look_up(const nb_scattering_table *scatter, const nb_air_components *airs,
                                                double radius, double sun)
{
    const nb_moment_samples spots = nb_spots_of(scatter, airs, radius, sun);
    nb_radiance_moments field;
    for (int c = 0; c < 3; c++) {
        const double all = nb_exp(nb_moment_at(&spots, 0, c));
        for (int m = 0; m < scatter->orders * (scatter->orders + 1) / 2; m++)
            field.moments[m][c] = m == 0 ? all : all * nb_moment_at(&spots, m, c);
    }
    return field;
}

void nb_scattering_table_look_up_ground(const nb_scattering_table *scatter, double sun, double irradiance[3])
{
    const nb_moment_interval s = nb_between_suns(scatter, sun);
    const double *a = scatter->ground[(int)s.first], *b = a + 3;
    for (int c = 0; c < 3; c++) irradiance[c] = nb_exp(a[c] + s.part * (b[c] - a[c]));
}

/* Light falls by powers of ten where the sun sets. */
static double to_power(double light)
{
    return log(fmax(light, 1e-30));
}

/* Tables that are looked up have so many times as many entries over the sun's height: between those that are made light is not
 * linear. */
enum { FINE = 4, MOST_SUNS = 40 };

/* Between the second and the third of four numbers, by the cubic through all; not beyond them. */
static double between(const double numbers[4], double part)
{
    const double a = part + 1, b = part, c = part - 1, d = part - 2;
    const double cubic = -b * c * d / 6 * numbers[0] + a * c * d / 2 * numbers[1] - a * b * d / 2 * numbers[2] +
                         a * b * c / 6 * numbers[3];
    const double most = fmax(fmax(numbers[0], numbers[1]), fmax(numbers[2], numbers[3]));
    const double least = fmin(fmin(numbers[0], numbers[1]), fmin(numbers[2], numbers[3]));
    return fmax(least, fmin(most, cubic));
}

/* Numbers over the sun's height to those of a finer table, which are `stride` apart. */
static void refine(int count, const double from[], double *to, size_t stride)
{
    for (int i = 0; i < FINE * (count - 1) + 1; i++) {
        const int first = i / FINE < count - 1 ? i / FINE : count - 2;
        const double numbers[4] = {first > 0 ? from[first - 1] : 2 * from[0] - from[1], from[first], from[first + 1],
                                   first < count - 2 ? from[first + 2] : 2 * from[count - 1] - from[count - 2]};
        to[stride * (size_t)i] = between(numbers, (double)(i - FINE * first) / FINE);
    }
}

/* Of one height and colour: logarithms of the first moment, and parts of it. */
static void seal_row(const nb_scattering_table *table, int height, int c, nb_scattering_table *sealed)
{
    const nb_radiance_moments *fields = table->fields + height * table->suns;
    nb_radiance_moments *to = sealed->fields + height * sealed->suns;
    double numbers[MOST_SUNS];
    for (int m = 0; m < table->orders * (table->orders + 1) / 2; m++) {
        for (int i = 0; i < table->suns; i++) {
            const double all = fmax(fields[i].moments[0][c], 1e-30);
            numbers[i] = m == 0 ? to_power(all) : fields[i].moments[m][c] / all;
        }
        refine(table->suns, numbers, &to->moments[m][c], sizeof *to / sizeof(double));
    }
}

/* Makes a table of moments one that can be looked up. */
static void seal(const nb_scattering_table *table, nb_scattering_table *sealed)
{
    double numbers[MOST_SUNS];
    for (int c = 0; c < 3; c++) {
        for (int h = 0; h < table->heights; h++) seal_row(table, h, c, sealed);
        for (int i = 0; i < table->suns; i++) numbers[i] = to_power(table->ground[i][c]);
        refine(table->suns, numbers, &sealed->ground[0][c], 3);
    }
}

/* The table of no air, which can be looked up. */
static void darken(nb_scattering_table *sealed)
{
    for (int c = 0; c < 3; c++) {
        for (size_t i = 0; i < nb_scattering_table_entries(sealed); i++) sealed->fields[i].moments[0][c] = to_power(0);
        for (int i = 0; i < sealed->suns; i++) sealed->ground[i][c] = to_power(0);
    }
}

/* ---- making ---------------------------------------------------------------------------------- */

enum { MOST_TURNS = 16 };

/* Air deeper than HOPELESS would need hundreds of rounds. */
enum { MOST_HEIGHTS = 48, MOST_ROUNDS = 32, FEW_ROUNDS = 16 };
#define HOPELESS 12

/* Light changes with the slope, near the horizon, far more than with the turn, so that turns are as few as moments bear.
 * Numbers of a quality: entries of the table, directions up and down and around, nodes of a piece of a
 * ray, how often light is scattered before what follows is guessed, and by how many moments it is kept; what part of it may be missing. */
typedef struct nb_table_resolution {
    int heights, suns, slopes, turns, nodes, orders, moments;
    double most_missing;
} nb_table_resolution;

static const nb_table_resolution efforts[NEBEL_ATMOSPHERE_QUALITY_COUNT] = {
    [NEBEL_ATMOSPHERE_FAST] = {12, 32, 8, 3, 3, 4, NB_FEW_MOMENTS, 1e-2},
    [NEBEL_ATMOSPHERE_PRECISE] = {20, 40, 8, 5, 4, 5, NB_MOMENTS, 2e-3},
};

/* Of haze by few moments half of all light would be in peaks. */
static const nb_table_resolution fast_of_haze = {9, 22, 8, 5, 3, 4, NB_MOMENTS, 1e-2};

static const nb_table_resolution *effort_of(const nb_air_components *airs, nebel_atmosphere_quality quality)
{
    return quality == NEBEL_ATMOSPHERE_FAST && nb_airs_are_hazy(airs) ? &fast_of_haze : &efforts[quality];
}

int nb_scatter_orders(const nb_air_components *airs, nebel_atmosphere_quality quality)
{
    return effort_of(airs, quality)->moments;
}

typedef struct nb_table_builder {
    const nb_air_components *airs, *all; /* airs: those of nb_air_components_smooth */
    nb_scattering_table *sealed;         /* of the light to be scattered; in the end of all */
    nb_scattering_table *next;
    const double *albedo;
    const nb_table_resolution *effort;
    nb_gauss_rule slopes, nodes;
    int turns; /* around */
    double turn_cosines[MOST_TURNS];
    const nb_stray *stray; /* the layout of what follows */
    double *radiance;      /* NULL, or to which light is added: [height][sun][side][slope][turn][colour] */
    int first;             /* the light to be scattered is the sun's */
    int peaks;             /* of that, what peaks turn alone */
    nb_gather_fn *gather;
} nb_table_builder;

/* What is shared by all that comes to one height from directions of one slope. */
typedef struct nb_direction_fan {
    const nb_table_builder *maker;
    nb_atmosphere_ray track;
    double end;
    int hits_ground;
    nb_ray_nodes path;
} nb_direction_fan;

/* Of sunlight the field is Legendre's polynomials of one angle, which is the same along the whole ray: what a kind of
 * air gives of it, as its phase function up to the orders that are kept. */
static void phases_of(const nb_air_components *airs, int orders, double sun, double phases[])
{
    for (int k = 0; k < airs->count; k++) {
        double p = 1, before = 0, sum = 0;
        for (int l = 0; l < orders; l++) {
            sum += (2 * l + 1) * airs->airs[k].moments[l] * p;
            const double next = ((2 * l + 1) * sun * p - l * before) / (l + 1);
            before = p;
            p = next;
        }
        phases[k] = sum / (4 * PI);
    }
}

/* Adds sunlight from `count` nodes, the first of which is `first` of the path. */
static void add_sunlight(const nb_direction_fan *fan, const double phases[], const nb_node_light *nodes, int first,
                         int count, double light[3])
{
    const nb_air_components *airs = fan->maker->airs;
    for (int c = 0; c < 3; c++)
        for (int i = 0; i < count; i++) {
            double scattered = 0;
            for (int k = 0; k < airs->count; k++)
                scattered += airs->airs[k].scattering[c] * fan->path.density[k][first + i] * phases[k];
            light[c] += (fan->maker->stray->count > 0 ? nodes->lit : nodes->sun)[c][i] * scattered;
        }
}

static void add_last(const nb_node_light *nodes, int count, double light[3])
{
    for (int i = 0; i < count; i++)
        for (int c = 0; c < 3; c++) light[c] += nodes->often[c][i];
}

static void gather_air(const nb_direction_fan *fan, nb_moment_basis aspect, double light[3])
{
    const nb_table_builder *maker = fan->maker;
    nb_gather_job job = {.airs = maker->airs,
                         .scatter = maker->first ? NULL : maker->sealed,
                         .wants_sun = maker->first,
                         .track = fan->track,
                         .aspect = aspect,
                         .path = &fan->path};
    double phases[NEBEL_MAX_COMPONENTS];
    if (maker->first) phases_of(maker->airs, maker->effort->moments, aspect.sun, phases);
    for (; job.first < fan->path.count; job.first += NB_GATHER_NODES) {
        nb_node_light nodes;
        const int left = fan->path.count - job.first;
        job.count = left < NB_GATHER_NODES ? left : NB_GATHER_NODES;
        maker->gather(&job, &nodes);
        if (maker->first && maker->stray->count > 0) nb_stray_add_sun(maker->stray, maker->sealed, &job, &nodes);
        if (maker->first)
            add_sunlight(fan, phases, &nodes, job.first, job.count, light);
        else
            add_last(&nodes, job.count, light);
    }
}

/* What peaks turn n times on a bent way, of t times in the mean, has t^(n - 1) / n! of the sunlight that comes straight: peaks.h. */
static void add_turned_once(const nb_direction_fan *fan, const nb_node_light *nodes, int first, int count,
                            double light[3])
{
    const nb_air_components *airs = fan->maker->all;
    for (int c = 0; c < 3; c++)
        for (int i = 0; i < count; i++) {
            const double t = nodes->turns[c][i];
            double turned = 0;
            for (int k = 0; k < airs->count; k++)
                turned += airs->airs[k].peak * airs->airs[k].scattering[c] * fan->path.density[k][first + i];
            light[c] += turned * nodes->ahead[c][i] * (t > 1e-6 ? (1 - nb_exp(-t)) / t : 1);
        }
}

static void gather_turned(const nb_direction_fan *fan, nb_moment_basis aspect, double light[3])
{
    const nb_table_builder *maker = fan->maker;
    nb_gather_job job = {.airs = maker->all,
                         .smooth = maker->airs,
                         .wants_sun = 1,
                         .track = fan->track,
                         .aspect = aspect,
                         .path = &fan->path};
    for (; job.first < fan->path.count; job.first += NB_GATHER_NODES) {
        nb_node_light nodes;
        const int left = fan->path.count - job.first;
        job.count = left < NB_GATHER_NODES ? left : NB_GATHER_NODES;
        maker->gather(&job, &nodes);
        add_turned_once(fan, &nodes, job.first, job.count, light);
    }
}

static void gather_ground(const nb_direction_fan *fan, nb_moment_basis aspect, double light[3])
{
    const nb_table_builder *maker = fan->maker;
    const nb_air_components *airs = maker->airs;
    const double sun = (fan->track.radius * aspect.height_of_sun + fan->end * aspect.sun) / airs->radius;
    double irradiance[3];
    if (maker->first) {
        nb_atmosphere_ray_sunlight(airs, (nb_atmosphere_ray){airs->radius, airs->radius * sun}, irradiance);
        for (int c = 0; c < 3; c++) irradiance[c] *= fmax(0, sun);
    } else {
        nb_scattering_table_look_up_ground(maker->sealed, sun, irradiance);
    }
    for (int c = 0; c < 3; c++) light[c] += fan->path.left[c] * maker->albedo[c] / PI * irradiance[c];
}

/* What arrives at a place from one direction, of light scattered once more. */
static void gather(const nb_direction_fan *fan, nb_moment_basis aspect, double light[3])
{
    for (int c = 0; c < 3; c++) light[c] = 0;
    if (fan->maker->peaks) {
        gather_turned(fan, aspect, light);
        return;
    }
    gather_air(fan, aspect, light);
    if (fan->hits_ground) gather_ground(fan, aspect, light);
}

static void keep(const nb_table_builder *maker, int entry, int side, int slope, int turn, const double light[3])
{
    const nb_stray *stray = maker->stray;
    const size_t way = (size_t)((side * stray->slopes.count + slope) * NB_STRAY_TURNS + turn);
    if (maker->radiance == NULL) return;
    double *to = maker->radiance + 3 * ((size_t)entry * nb_stray_ways(stray) + way);
    for (int c = 0; c < 3; c++) to[c] += light[c];
}

/* Adds what comes to all entries of one height from directions of one slope. */
static void add_slope(const nb_table_builder *maker, int height, int side, int slope)
{
    const nb_air_components *airs = maker->airs;
    const nb_table_resolution *effort = maker->effort;
    const double radius = airs->radius + height_at(maker->next, airs, height);
    double weight;
    const double zenith = nb_stray_zenith(maker->stray, nb_stray_horizon(airs, radius), side, slope, &weight);
    nb_direction_fan fan;
    fan.maker = maker;
    fan.track = (nb_atmosphere_ray){radius, radius * zenith};
    const double ground = nb_atmosphere_ray_enter(fan.track, airs->radius), level = sqrt(fmax(0, 1 - zenith * zenith));
    fan.hits_ground = ground < HUGE_VAL;
    fan.end = fan.hits_ground ? ground : nb_atmosphere_ray_leave(fan.track, airs->top);
    nb_ray_nodes_lay(maker->peaks ? maker->all : airs, maker->peaks ? airs : NULL, &maker->nodes, fan.track, fan.end, 0,
                     NULL, &fan.path);
    for (int i = 0; i < effort->suns; i++) {
        const double sun = sun_at(maker->next, i), aside = sqrt(fmax(0, 1 - sun * sun));
        for (int k = 0; k < maker->turns; k++) {
            const double x = level * maker->turn_cosines[k];
            const nb_moment_basis aspect = {zenith, x * aside + zenith * sun, sun};
            double light[3];
            gather(&fan, aspect, light);
            keep(maker, height * effort->suns + i, side, slope, k, light);
            for (int c = 0; c < 3; c++) light[c] *= weight * 2 * PI / maker->turns;
            nb_radiance_moments_add(&maker->next->fields[height * effort->suns + i], effort->moments, aspect, light);
            if (height == 0 && zenith > 0)
                for (int c = 0; c < 3; c++) maker->next->ground[i][c] += zenith * light[c];
        }
    }
}

/* All entries of one height. From both sides of the horizon directions are denser near it, where light changes most. */
static void add_height(void *data, size_t height)
{
    const nb_table_builder *maker = data;
    for (int k = 0; k < maker->slopes.count; k++)
        for (int side = NB_STRAY_SIDES - 1; side >= 0; side--) add_slope(maker, (int)height, side, k);
}

/* Of all air straight up, of the colour of which it is the most. */
static double deepest(const nb_air_components *airs)
{
    double depth[3] = {0, 0, 0};
    nb_atmosphere_ray_depth(airs, (nb_atmosphere_ray){airs->radius, airs->radius}, airs->top - airs->radius, depth);
    return fmax(depth[0], fmax(depth[1], depth[2]));
}

/* Light changes within an optical depth or two: deep air has more entries over its height. */
static int count_heights(const nb_air_components *airs, const nb_table_resolution *effort)
{
    return (int)fmin(MOST_HEIGHTS, effort->heights * fmax(1, sqrt(2 * deepest(airs))));
}

static void extinction_at(const nb_air_components *airs, double height, double extinction[3])
{
    for (int c = 0; c < 3; c++) {
        extinction[c] = 0;
        for (int k = 0; k < airs->count; k++)
            extinction[c] += nb_air_density(&airs->airs[k], height) * airs->airs[k].extinction[c];
    }
}

/* Between entries light is not known where air is not what lies evenly between that of both: by so much of its optical depth, so much
 * of the light may be missing. Of layers and thin air of a depth of 0.5 up to 40 % was (test_dense_air). */
#define UNRESOLVED 1.2

static double find_unresolved(const nb_air_components *airs, const nb_scattering_table *scatter)
{
    double off[3] = {0, 0, 0}, whole[3] = {0, 0, 0}, most = 0;
    for (int i = 1; i < scatter->heights; i++) {
        const double low = height_at(scatter, airs, i - 1), high = height_at(scatter, airs, i);
        double depth[3], ends[2][3];
        nb_atmosphere_ray_depth(airs, (nb_atmosphere_ray){airs->radius + low, airs->radius + low}, high - low, depth);
        extinction_at(airs, low, ends[0]);
        extinction_at(airs, high, ends[1]);
        for (int c = 0; c < 3; c++) {
            whole[c] += depth[c];
            off[c] += fabs(depth[c] - 0.5 * (high - low) * (ends[0][c] + ends[1][c]));
        }
    }
    for (int c = 0; c < 3; c++) most = fmax(most, fmin(off[c], whole[c]));
    return UNRESOLVED * most;
}

static nb_scattering_table layout_of(const nb_air_components *airs, const nb_table_resolution *effort)
{
    nb_scattering_table scatter = {
        .heights = count_heights(airs, effort), .suns = effort->suns, .orders = effort->moments};
    scatter.sun_scale = 0.25 * dip(airs);
    scatter.first_sun = spread(-fmin(1, 2.5 * dip(airs)), scatter.sun_scale);
    scatter.last_sun = spread(1, scatter.sun_scale);
    return scatter;
}

static nebel_result allocate(const nebel_allocator *allocator, const nb_scattering_table *layout,
                             nb_scattering_table *scatter)
{
    *scatter = *layout;
    scatter->fields = nb_allocate_zero(allocator, nb_scattering_table_entries(scatter), sizeof *scatter->fields);
    scatter->ground = nb_allocate_zero(allocator, (size_t)scatter->suns, sizeof *scatter->ground);
    return scatter->fields != NULL && scatter->ground != NULL ? NEBEL_OK : NEBEL_ERROR_MEMORY;
}

void nb_scattering_table_free(const nebel_allocator *allocator, nb_scattering_table *scatter)
{
    nb_release(allocator, scatter->fields);
    nb_release(allocator, scatter->ground);
}

static void copy(const nb_scattering_table *from, nb_scattering_table *to)
{
    memcpy(to->fields, from->fields, nb_scattering_table_entries(from) * sizeof *from->fields);
    memcpy(to->ground, from->ground, (size_t)from->suns * sizeof *from->ground);
}

static void add(const nb_scattering_table *more, nb_scattering_table *sum)
{
    for (size_t i = 0; i < nb_scattering_table_entries(sum); i++)
        for (int m = 0; m < NB_FIELD; m++)
            for (int c = 0; c < 3; c++) sum->fields[i].moments[m][c] += more->fields[i].moments[m][c];
    for (int i = 0; i < sum->suns; i++)
        for (int c = 0; c < 3; c++) sum->ground[i][c] += more->ground[i][c];
}

static void clear(nb_scattering_table *scatter)
{
    memset(scatter->fields, 0, nb_scattering_table_entries(scatter) * sizeof *scatter->fields);
    memset(scatter->ground, 0, (size_t)scatter->suns * sizeof *scatter->ground);
}

/* ---- rounds ---------------------------------------------------------------------------------- */

/* Tables of a cycle of rounds, one behind the other, the first of which is what it begins with. */
typedef struct nb_scattering_rounds {
    nb_scattering_table once, sum, tables[NB_MAX_ROUNDS + 1];
    double slowest[3]; /* by nb_orders_extrapolate */
} nb_scattering_rounds;

static void set_turns(nb_table_builder *maker, int turns)
{
    maker->turns = turns;
    for (int k = 0; k < turns; k++) maker->turn_cosines[k] = cos(PI * (k + 0.5) / turns);
}

/* What air and ground make of sunlight, or of all light of the sealed table. Light that is kept is gathered from more turns
 * than moments need. */
static void scatter_again(nb_table_builder *maker, const nebel_parallel *parts, int first, nb_scattering_table *made)
{
    maker->first = first;
    maker->next = made;
    set_turns(maker, maker->radiance != NULL ? NB_STRAY_TURNS : maker->effort->turns);
    clear(made);
    nb_parallel_for(parts, (size_t)made->heights, add_height, maker);
}

/* Rounds from the first table on, until little may be missing or so many are done. Returns how many those are. */
static int run_cycle(nb_table_builder *maker, const nebel_parallel *parts, nb_scattering_rounds *rounds, int done)
{
    const nb_table_resolution *effort = maker->effort;
    nb_scattering_table *sum = &rounds->sum;
    sum->missing = HUGE_VAL;
    for (int i = 0; i < NB_MAX_ROUNDS && sum->missing > effort->most_missing; i++, done++) {
        nb_scattering_table *next = &rounds->tables[i + 1];
        if (done > 0) {
            seal(&rounds->tables[i], maker->sealed);
            scatter_again(maker, parts, 0, next);
            add(&rounds->once, next);
        } else {
            copy(&rounds->once, next);
        }
        if (done + 1 >= effort->orders && i > 0)
            sum->missing = nb_orders_extrapolate(i + 1, rounds->tables, rounds->slowest, sum);
    }
    return done;
}

/* What strays of the light of the last table. */
typedef struct nb_straying {
    nb_table_builder *maker;
    const nb_air_components *airs;
    const nb_scattering_table *sum;
    nb_stray *stray;
} nb_straying;

static void stray_at_height(void *data, size_t height)
{
    const nb_straying *straying = data;
    const nb_scattering_table *sum = straying->sum;
    const size_t first = height * (size_t)sum->suns;
    const double radius = straying->airs->radius + height_at(sum, straying->airs, (int)height);
    const double *radiance = straying->maker->radiance + 3 * first * nb_stray_ways(straying->stray);
    double suns[MOST_SUNS];
    for (int i = 0; i < sum->suns; i++) suns[i] = sun_at(sum, i);
    if (straying->maker->peaks)
        nb_stray_fill_sun(straying->stray, straying->airs, straying->maker->airs, sum->orders, (int)height, radius,
                          suns, radiance);
    else
        nb_stray_fill(straying->stray, straying->airs, sum->orders, (int)height, radius, radiance, sum->fields + first);
}

/* Makes scratch of a table. */
static void bend_sunlight(nb_table_builder *maker, const nebel_parallel *parts, const nb_air_components *airs,
                          nb_scattering_table *table, nb_stray *stray)
{
    nb_straying straying = {maker, airs, table, stray};
    const size_t numbers = 3 * nb_scattering_table_entries(table) * nb_stray_ways(stray);
    maker->peaks = 1;
    scatter_again(maker, parts, 1, table);
    nb_parallel_for(parts, (size_t)table->heights, stray_at_height, &straying);
    maker->peaks = 0;
    memset(maker->radiance, 0, numbers * sizeof *maker->radiance);
}

/* Each cycle begins where the one before leads. */
static void sum_orders(nb_table_builder *maker, const nebel_parallel *parts, const nb_air_components *airs,
                       nb_scattering_rounds *rounds, nb_stray *stray)
{
    const int most = deepest(maker->airs) > HOPELESS ? FEW_ROUNDS : MOST_ROUNDS;
    double *const radiance = maker->radiance;
    if (maker->stray->count > 0) bend_sunlight(maker, parts, airs, &rounds->once, stray);
    scatter_again(maker, parts, 1, &rounds->once);
    maker->radiance = NULL;
    for (int done = 0; done < most;) {
        done = run_cycle(maker, parts, rounds, done);
        if (rounds->sum.missing <= maker->effort->most_missing) break;
        copy(&rounds->sum, &rounds->tables[0]);
    }
    seal(&rounds->sum, maker->sealed);
    maker->sealed->missing = rounds->sum.missing;
    maker->radiance = radiance;
}

static void find_stray(nb_table_builder *maker, const nebel_parallel *parts, const nb_air_components *airs,
                       nb_scattering_rounds *rounds, nb_stray *stray)
{
    nb_straying straying = {maker, airs, &rounds->sum, stray};
    scatter_again(maker, parts, 0, &rounds->tables[0]);
    nb_parallel_for(parts, (size_t)rounds->sum.heights, stray_at_height, &straying);
}

static nebel_result allocate_stray(const nebel_allocator *allocator, nb_table_builder *maker, nb_stray *stray)
{
    const size_t entries = (size_t)(stray->heights * stray->suns);
    if (stray->count == 0) return NEBEL_OK;
    stray->sun = nb_allocate_zero(allocator, entries, sizeof *stray->sun);
    stray->parts =
        nb_allocate_zero(allocator, entries * nb_stray_entry(stray) * (size_t)stray->count, sizeof *stray->parts);
    stray->bent = nb_allocate_zero(allocator, entries * nb_bent_entry(stray), sizeof *stray->bent);
    maker->radiance = nb_allocate_zero(allocator, entries * nb_stray_ways(stray), 3 * sizeof *maker->radiance);
    return stray->sun != NULL && stray->parts != NULL && stray->bent != NULL && maker->radiance != NULL
               ? NEBEL_OK
               : NEBEL_ERROR_MEMORY;
}

/* Light that peaks of phase functions turn was sunlight so far; on the ground it comes from the sky around the sun. */
static void add_turned(const nb_air_components *airs, const nb_air_components *smooth, nb_scattering_table *scatter)
{
    for (int i = 0; i < scatter->suns; i++) {
        const double sun = sun_at(scatter, i);
        const nb_atmosphere_ray track = {airs->radius, airs->radius * sun};
        double straight[3], ahead[3];
        nb_atmosphere_ray_sunlight(airs, track, straight);
        nb_atmosphere_ray_sunlight(smooth, track, ahead);
        for (int c = 0; c < 3; c++)
            scatter->ground[i][c] = to_power(exp(scatter->ground[i][c]) + fmax(0, sun) * (ahead[c] - straight[c]));
    }
}

static nebel_result allocate_rounds(const nebel_allocator *allocator, const nb_scattering_table *like,
                                    nb_scattering_rounds *rounds)
{
    nebel_result result = allocate(allocator, like, &rounds->once);
    if (result == NEBEL_OK) result = allocate(allocator, like, &rounds->sum);
    for (int i = 0; i <= NB_MAX_ROUNDS && result == NEBEL_OK; i++)
        result = allocate(allocator, like, &rounds->tables[i]);
    return result;
}

static void free_rounds(const nebel_allocator *allocator, nb_scattering_rounds *rounds)
{
    nb_scattering_table_free(allocator, &rounds->once);
    nb_scattering_table_free(allocator, &rounds->sum);
    for (int i = 0; i <= NB_MAX_ROUNDS; i++) nb_scattering_table_free(allocator, &rounds->tables[i]);
}

nebel_result nb_scattering_table_make(const nebel_allocator *allocator, const nebel_parallel *parts,
                                      const nb_air_components *airs, const nb_air_components *smooth,
                                      nebel_atmosphere_quality quality, const double albedo[3],
                                      nb_scattering_table *scatter, nb_stray *stray)
{
    const nb_table_resolution *effort = effort_of(airs, quality);
    nb_table_builder maker = {.airs = smooth,
                              .all = airs,
                              .albedo = albedo,
                              .effort = effort,
                              .sealed = scatter,
                              .slopes = nb_gauss_rule_make(effort->slopes),
                              .nodes = nb_gauss_rule_make(effort->nodes),
                              .gather = nb_gather_choose(NEBEL_ISA_DEFAULT)};
    const nb_scattering_table layout = layout_of(smooth, effort);
    nb_scattering_table fine = layout;
    nb_scattering_rounds rounds = {.once = {.heights = 0}};
    *stray = nb_stray_plan(airs, effort->moments, &layout, &maker.slopes);
    maker.stray = stray;
    fine.suns = FINE * (layout.suns - 1) + 1;
    nebel_result result = allocate(allocator, &fine, scatter);
    if (result != NEBEL_OK) return result;
    if (nb_air_components_are_empty(smooth)) {
        darken(scatter);
        return NEBEL_OK;
    }
    result = allocate_rounds(allocator, &layout, &rounds);
    if (result == NEBEL_OK) result = allocate_stray(allocator, &maker, stray);
    if (result == NEBEL_OK) sum_orders(&maker, parts, airs, &rounds, stray);
    if (result == NEBEL_OK && stray->count > 0) find_stray(&maker, parts, airs, &rounds, stray);
    if (result == NEBEL_OK && !smooth->is_smooth) add_turned(airs, smooth, scatter);
    scatter->missing += find_unresolved(smooth, scatter);
    nb_release(allocator, maker.radiance);
    free_rounds(allocator, &rounds);
    return result;
}
