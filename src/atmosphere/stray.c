#include "stray.h"

#include "forward_peaks.h"

#include <math.h>
#include <string.h>

#define NB_DOUBLE
#include "formulas/prelude.h"

#include "formulas/elementary.inc"

#include "radiance_moments_lanes.h"

#define PI 3.14159265358979323846

/* Smooth air (nb_air_components_smooth) solves dI/ds = -(e - f s) I + J, with the extinction e, the scattering s, the peak f and J of the orders that
 * are kept: what peaks turn, s f, is not lost, as if it came from where it goes. That is right for the means that J is made of, not for
 * one ray that passes a thin bright layer of air, as level ones do. Of it dI/ds = -e I + J + s P, with P the mean of the light around, by the
 * peak: a phase function of moments f up to the orders that are kept, and those of air behind. P is found from light in smooth air, in
 * the directions from which that was gathered; where all light is alike it is f I. */

/* Sunlight that steeper peaks turn (nb_peak_ratio) comes from too few of the slopes, and is taken to come straight. In haze
 * of g 0.95 a table of it is off by twice as much. */
#define STEEPEST_BENT 0.92

nb_stray nb_stray_plan(const nb_air_components *airs, int orders, const nb_scattering_table *layout,
                       const nb_gauss_rule *slopes)
{
    nb_stray stray = {.heights = layout->heights, .suns = layout->suns, .slopes = *slopes};
    for (int k = 0; k < airs->count && nb_airs_are_hazy(airs); k++)
        if (airs->airs[k].peak > 0) stray.airs[stray.count++] = k;
    if (stray.count > 0)
        stray.strays =
            nb_peak_ratio(&airs->airs[stray.airs[0]], orders) > STEEPEST_BENT ? NB_STRAYS : NB_STRAYS_AND_BENDS;
    return stray;
}

double nb_stray_zenith(const nb_stray *stray, double horizon, int side, int slope, double *weight)
{
    const double part = 0.5 * (1 + stray->slopes.nodes[slope]), room = side ? 1 - horizon : -1 - horizon;
    *weight = fabs(room) * part * stray->slopes.weights[slope];
    return horizon + room * part * part;
}

/* ---- filling --------------------------------------------------------------------------------- */

enum { MAX_WAYS = NB_STRAY_SIDES * NB_MAX_RULE, TURNS_OF_KERNEL = 32 };

/* Of one height and kind of air: what comes from one slope to another, by the order of the turn. */
typedef struct nb_kernel {
    int count;
    double zenith[MAX_WAYS], weight[MAX_WAYS];
    double share[MAX_WAYS][MAX_WAYS][NB_STRAY_TURNS];
    double all[MAX_WAYS];                           /* of light that comes evenly */
    double poles[MAX_WAYS][NB_STRAY_TURNS];         /* sine^-order: towards zenith and nadir light knows no turn */
    double cosines[NB_STRAY_TURNS][NB_STRAY_TURNS]; /* [order][turn] */
} nb_kernel;

static void set_cosines(double cosines[NB_STRAY_TURNS][NB_STRAY_TURNS])
{
    for (int m = 0; m < NB_STRAY_TURNS; m++)
        for (int k = 0; k < NB_STRAY_TURNS; k++) cosines[m][k] = cos(PI * m * (k + 0.5) / NB_STRAY_TURNS);
}

/* The peak: the moments of those orders that are kept are all the part that it has, those of others are the air's. */
static double orders_behind(const nb_air_component *air, int orders, double cosine)
{
    double kept = 0, p = 1, before = 0;
    for (int l = 0; l < orders; l++) {
        const double after = ((2 * l + 1) * cosine * p - l * before) / (l + 1);
        kept += (2 * l + 1) * (air->moments[l] - air->peak) * p;
        before = p;
        p = after;
    }
    return nb_phase_at(&air->phase, cosine) - kept / NB_FOUR_PI;
}

static void set_share(const nb_air_component *air, int orders, nb_kernel *kernel, int i, int j)
{
    const double a = kernel->zenith[i], b = kernel->zenith[j], side = sqrt(fmax(0, (1 - a * a) * (1 - b * b)));
    double *share = kernel->share[i][j];
    for (int m = 0; m < NB_STRAY_TURNS; m++) share[m] = 0;
    for (int k = 0; k < TURNS_OF_KERNEL; k++) {
        const double cosine = cos(PI * (k + 0.5) / TURNS_OF_KERNEL);
        const double of = orders_behind(air, orders, fmax(-1, fmin(1, a * b + side * cosine)));
        double term = 1, before = cosine;
        for (int m = 0; m < NB_STRAY_TURNS; m++) {
            const double after = 2 * cosine * term - before;
            share[m] += 2 * PI / TURNS_OF_KERNEL * of * term;
            before = term;
            term = after;
        }
    }
    memcpy(kernel->share[j][i], share, sizeof kernel->share[j][i]);
}

static void set_kernel(const nb_stray *stray, const nb_air_component *air, int orders, double horizon,
                       nb_kernel *kernel)
{
    kernel->count = NB_STRAY_SIDES * stray->slopes.count;
    set_cosines(kernel->cosines);
    for (int i = 0; i < kernel->count; i++)
        kernel->zenith[i] =
            nb_stray_zenith(stray, horizon, i / stray->slopes.count, i % stray->slopes.count, &kernel->weight[i]);
    for (int i = 0; i < kernel->count; i++)
        for (int j = 0; j <= i; j++) set_share(air, orders, kernel, i, j);
    for (int i = 0; i < kernel->count; i++) {
        const double sine = sqrt(1 - kernel->zenith[i] * kernel->zenith[i]);
        for (int m = 0; m < NB_STRAY_TURNS; m++) kernel->poles[i][m] = m > 0 ? kernel->poles[i][m - 1] / sine : 1;
        kernel->all[i] = 0;
        for (int j = 0; j < kernel->count; j++) kernel->all[i] += kernel->weight[j] * kernel->share[i][j][0];
    }
}

/* Light of one slope over turns to that of cosines of their multiples. */
static void order_turns(const double cosines[NB_STRAY_TURNS][NB_STRAY_TURNS], const double *radiance, int c,
                        double orders[NB_STRAY_TURNS])
{
    for (int m = 0; m < NB_STRAY_TURNS; m++) {
        orders[m] = 0;
        for (int k = 0; k < NB_STRAY_TURNS; k++) orders[m] += radiance[3 * k + c] * cosines[m][k];
        orders[m] *= (m > 0 ? 2.0 : 1.0) / NB_STRAY_TURNS;
    }
}

/* What evenly comes from all sides does not stray: of what a rule of few slopes misses nothing is left. */
static void fill_entry(const nb_kernel *kernel, double self, const double *radiance, const double of[3], float *parts)
{
    double orders[MAX_WAYS][NB_STRAY_TURNS];
    for (int c = 0; c < 3; c++) {
        for (int i = 0; i < kernel->count; i++)
            order_turns(kernel->cosines, radiance + (size_t)(3 * NB_STRAY_TURNS * i), c, orders[i]);
        for (int i = 0; i < kernel->count; i++)
            for (int m = 0; m < NB_STRAY_TURNS; m++) {
                double sum = (self - kernel->all[i]) * orders[i][m];
                for (int j = 0; j < kernel->count; j++)
                    sum += kernel->weight[j] * kernel->share[i][j][m] * orders[j][m];
                parts[NB_STRAY_SIZE * i + 3 * m + c] = (float)(sum * kernel->poles[i][m] / of[c]);
            }
    }
}

void nb_stray_fill(nb_stray *stray, const nb_air_components *airs, int orders, int height, double radius,
                   const double *radiance, const nb_radiance_moments *fields)
{
    const size_t ways = 3 * nb_stray_ways(stray);
    for (int k = 0; k < stray->count; k++) {
        const nb_air_component *air = &airs->airs[stray->airs[k]];
        nb_kernel kernel;
        set_kernel(stray, air, orders, nb_stray_horizon(airs, radius), &kernel);
        for (int i = 0; i < stray->suns; i++) {
            double of[3];
            for (int c = 0; c < 3; c++) of[c] = fmax(fields[i].moments[0][c], 1e-30);
            fill_entry(&kernel, air->peak, radiance + ways * (size_t)i, of,
                       stray->parts +
                           nb_stray_entry(stray) * (size_t)((k * stray->heights + height) * stray->suns + i));
        }
    }
}

/* ---- filling: bent sunlight ------------------------------------------------------------------ */

/* Sunlight that peaks turn once comes from a direction w as P(w, sun) F(w). P is the peak; F depends on the air and on the
 * sunlight there. The phase function p then scatters towards v the integral of p(v, w) P(w, sun) F(w). If F is the same
 * everywhere, the closed form (forward_peaks.h) gives this integral, better than a sum over few directions. So F is split
 * into its mean, by weights that resemble both factors, and the rest, which is summed. A mean at the sun alone is wrong near
 * the horizon and on the edge of the night, where F changes within a few degrees. */

/* Turns over which sums go, the middles of even parts of half a circle; a convolution over turns is a product of orders. */
enum { BENT_SUMS = 16, BENT_NUMBERS = 8 };

/* Of one height: orders of weights, and of the phase function, from one slope to another. */
typedef struct nb_bent_kernel {
    int count;
    double zenith[MAX_WAYS], level[MAX_WAYS], weight[MAX_WAYS];
    double near[MAX_WAYS][MAX_WAYS][BENT_SUMS], phase[MAX_WAYS][MAX_WAYS][BENT_SUMS];
    double turns[NB_STRAY_TURNS][NB_STRAY_TURNS], cosines[BENT_SUMS][BENT_SUMS]; /* [order][turn] */
} nb_bent_kernel;

/* Henyey and Greenstein's function, but for a factor. */
static double nearness(double g, double cosine)
{
    const double square = 1 + g * g - 2 * g * cosine;
    return (1 - g * g) / (square * sqrt(square));
}

static void set_bent_share(const nb_air_component *air, double g, nb_bent_kernel *kernel, int i, int j)
{
    const double same = kernel->zenith[i] * kernel->zenith[j], side = kernel->level[i] * kernel->level[j];
    double *near = kernel->near[i][j], *phase = kernel->phase[i][j];
    for (int m = 0; m < BENT_SUMS; m++) near[m] = phase[m] = 0;
    for (int k = 0; k <= BENT_SUMS; k++) {
        const double cosine = fmax(-1, fmin(1, same + side * cos(PI * k / BENT_SUMS)));
        const double times = (k % BENT_SUMS > 0 ? 2 : 1) * kernel->weight[j];
        const double near_of = times * nearness(g, cosine), phase_of = times * nb_phase_at(&air->phase, cosine);
        for (int m = 0; m < BENT_SUMS; m++) {
            near[m] += near_of * cos(PI * m * k / BENT_SUMS);
            phase[m] += phase_of * cos(PI * m * k / BENT_SUMS);
        }
    }
}

static void set_bent_kernel(const nb_stray *stray, const nb_air_component *air, double g, double horizon,
                            nb_bent_kernel *kernel)
{
    kernel->count = NB_STRAY_SIDES * stray->slopes.count;
    for (int i = 0; i < kernel->count; i++) {
        kernel->zenith[i] =
            nb_stray_zenith(stray, horizon, i / stray->slopes.count, i % stray->slopes.count, &kernel->weight[i]);
        kernel->level[i] = sqrt(1 - kernel->zenith[i] * kernel->zenith[i]);
    }
    for (int i = 0; i < kernel->count; i++)
        for (int j = 0; j < kernel->count; j++) set_bent_share(air, g, kernel, i, j);
    set_cosines(kernel->turns);
    for (int m = 0; m < BENT_SUMS; m++)
        for (int k = 0; k < BENT_SUMS; k++) kernel->cosines[m][k] = cos(PI * m * (k + 0.5) / BENT_SUMS);
}

/* Of a turn or an order: the weights, and the weights times F of each colour; then the same of P. */
typedef double nb_bent_sums[BENT_NUMBERS];

/* Numbers over turns to those of orders, and back. */
static void order_sums(const nb_bent_kernel *kernel, nb_bent_sums from[], nb_bent_sums orders[])
{
    for (int m = 0; m < BENT_SUMS; m++) {
        for (int n = 0; n < BENT_NUMBERS; n++) orders[m][n] = 0;
        for (int k = 0; k < BENT_SUMS; k++)
            for (int n = 0; n < BENT_NUMBERS; n++)
                orders[m][n] += (m > 0 ? 2.0 : 1.0) / BENT_SUMS * kernel->cosines[m][k] * from[k][n];
    }
}

static void turn_sums(const nb_bent_kernel *kernel, nb_bent_sums orders[], nb_bent_sums to[])
{
    for (int k = 0; k < BENT_SUMS; k++) {
        for (int n = 0; n < BENT_NUMBERS; n++) to[k][n] = 0;
        for (int m = 0; m < BENT_SUMS; m++)
            for (int n = 0; n < BENT_NUMBERS; n++) to[k][n] += kernel->cosines[m][k] * orders[m][n];
    }
}

/* Sums over all directions, by weights and by P. */
typedef struct nb_bent_around {
    double weights[2], sums[2][3];
} nb_bent_around;

/* What comes from slope j: orders of weights and of P, alone and times the light. */
static void order_bent(const nb_bent_kernel *kernel, const nb_air_component *air, int kept, double g, double sun, int j,
                       const double *radiance, nb_bent_sums orders[], nb_bent_around *around)
{
    const double side = kernel->level[j] * sqrt(fmax(0, 1 - sun * sun));
    double light[3][NB_STRAY_TURNS];
    nb_bent_sums from[BENT_SUMS];
    for (int c = 0; c < 3; c++) order_turns(kernel->turns, radiance, c, light[c]);
    for (int k = 0; k < BENT_SUMS; k++) {
        const double cosine = fmax(-1, fmin(1, kernel->zenith[j] * sun + side * kernel->cosines[1][k]));
        const double near = nearness(g, cosine), peak = orders_behind(air, kept, cosine);
        from[k][0] = near;
        from[k][4] = peak;
        around->weights[0] += kernel->weight[j] * near;
        around->weights[1] += kernel->weight[j] * peak;
        for (int c = 0; c < 3; c++) {
            double of = 0;
            for (int m = 0; m < NB_STRAY_TURNS; m++) of += light[c][m] * kernel->cosines[m][k];
            of = fmax(0, of);
            from[k][1 + c] = near * of;
            from[k][5 + c] = peak * of;
            around->sums[0][c] += kernel->weight[j] * near * of;
            around->sums[1][c] += kernel->weight[j] * peak * of;
        }
    }
    order_sums(kernel, from, orders);
}

/* From sums over all slopes to numbers of slope i. */
static void keep_bent(const nb_bent_kernel *kernel, nb_bent_sums orders[], double peak, int i, float *bent)
{
    nb_bent_sums at[BENT_SUMS], found[BENT_SUMS];
    turn_sums(kernel, orders, at);
    for (int k = 0; k < BENT_SUMS; k++)
        for (int c = 0; c < 3; c++) {
            const double mean = at[k][1 + c] / at[k][0];
            found[k][c] = mean;
            found[k][3 + c] = (at[k][5 + c] - mean * at[k][4]) * PI / BENT_SUMS / peak;
            found[k][6] = found[k][7] = 0;
        }
    order_sums(kernel, found, at);
    double pole = 1;
    for (int m = 0; m < NB_STRAY_TURNS; m++, pole /= kernel->level[i])
        for (int c = 0; c < 3; c++) {
            bent[3 * m + c] = (float)(at[m][c] * pole);
            bent[3 * (NB_STRAY_TURNS + m) + c] = (float)(at[m][3 + c] * pole);
        }
}

/* The mean of F by P. P is negative in places; if the directions miss its peak, the mean by weights is used. */
static void mean_around(const nb_bent_around *around, double peak, double mean[3])
{
    const int knows = around->weights[1] * 2 * PI / BENT_SUMS > 0.5 * peak;
    for (int c = 0; c < 3; c++) {
        const double near = around->sums[0][c] / around->weights[0];
        mean[c] = knows ? fmax(0.2 * near, around->sums[1][c] / around->weights[1]) : near;
    }
}

/* Of one sun. Sets the light around it. */
static void fill_bent(const nb_bent_kernel *kernel, const nb_air_component *air, int kept, double g, double sun,
                      const double *radiance, float *bent, double around[3])
{
    nb_bent_around sums = {.weights = {0}};
    nb_bent_sums from[MAX_WAYS][BENT_SUMS], to[BENT_SUMS];
    for (int j = 0; j < kernel->count; j++)
        order_bent(kernel, air, kept, g, sun, j, radiance + (size_t)(3 * NB_STRAY_TURNS * j), from[j], &sums);
    for (int i = 0; i < kernel->count; i++) {
        for (int m = 0; m < BENT_SUMS; m++) {
            for (int n = 0; n < BENT_NUMBERS; n++) to[m][n] = 0;
            for (int j = 0; j < kernel->count; j++)
                for (int n = 0; n < BENT_NUMBERS; n++)
                    to[m][n] += (n < 4 ? kernel->near : kernel->phase)[i][j][m] * from[j][m][n];
        }
        keep_bent(kernel, to, air->peak, i, bent + NB_BENT_SIZE * i);
    }
    mean_around(&sums, air->peak, around);
}

/* ---- adding ---------------------------------------------------------------------------------- */

/* Where a direction is among the slopes of its side. */
static int find_slope(const nb_stray *stray, double part, double *share)
{
    const double *nodes = stray->slopes.nodes, place = 2 * part - 1;
    int i = 0;
    while (i < stray->slopes.count - 2 && place > nodes[i + 1]) i++;
    *share = fmax(0, fmin(1, (place - nodes[i]) / (nodes[i + 1] - nodes[i])));
    return i;
}

/* Of a node: neighbours in the table, and cosines of multiples of the turn. */
typedef struct nb_place {
    size_t ways[8]; /* in numbers of slopes */
    double weights[8], turns[NB_STRAY_TURNS];
} nb_place;

/* Of cosines of multiples of the turn, times sine^order of the zenith's angle: the real part of (x + i y)^order. */
static void find_turns(double zenith, double sun, double along, double turns[NB_STRAY_TURNS])
{
    const double square = fmax(0, 1 - zenith * zenith), aside = sqrt(fmax(0, 1 - sun * sun));
    const double level = sqrt(square), x = aside > 1e-9 ? fmax(-level, fmin(level, (along - zenith * sun) / aside)) : 0;
    turns[0] = 1;
    turns[1] = x;
    for (int m = 2; m < NB_STRAY_TURNS; m++) turns[m] = 2 * x * turns[m - 1] - square * turns[m - 2];
}

/* Neighbours among heights and suns. */
typedef struct nb_corner {
    double height, sun, height_part, sun_part;
} nb_corner;

static nb_corner find_corner(const nb_stray *stray, const nb_scattering_table *scatter, const nb_air_components *airs,
                             double radius, double sun)
{
    const nb_moment_interval height = nb_between_heights(scatter, airs, radius), suns = nb_between_suns(scatter, sun);
    const double coarse = (suns.first + suns.part) * (stray->suns - 1) / (scatter->suns - 1);
    const double first = fmin(floor(coarse), stray->suns - 2);
    return (nb_corner){height.first, first, height.part, coarse - first};
}

/* Its entry i of four. */
static size_t corner_at(const nb_stray *stray, const nb_corner *corner, int i, double *weight)
{
    const int h = i & 1, s = i >> 1 & 1;
    *weight = (h ? corner->height_part : 1 - corner->height_part) * (s ? corner->sun_part : 1 - corner->sun_part);
    return (size_t)((corner->height + h) * stray->suns + corner->sun + s);
}

/* Where a direction is among those of a height: before the next one. */
typedef struct nb_stray_ray {
    int first;
    double part;
} nb_stray_ray;

static nb_stray_ray find_way(const nb_stray *stray, double horizon, double zenith)
{
    const int side = zenith > horizon;
    const double part = sqrt(fmin(1, (zenith - horizon) / (side ? 1 - horizon : -1 - horizon)));
    nb_stray_ray way;
    way.first = side * stray->slopes.count + find_slope(stray, part, &way.part);
    return way;
}

static nb_place find_place(const nb_stray *stray, const nb_air_components *airs, const nb_corner *corner,
                           nb_moment_basis aspect, double radius)
{
    const nb_stray_ray way = find_way(stray, nb_stray_horizon(airs, radius), aspect.zenith);
    nb_place place;
    for (int i = 0; i < 8; i++) {
        const int n = i >> 2;
        double weight;
        const size_t entry = corner_at(stray, corner, i, &weight);
        place.ways[i] = entry * (size_t)(NB_STRAY_SIDES * stray->slopes.count) + (size_t)(way.first + n);
        place.weights[i] = weight * (n ? way.part : 1 - way.part);
    }
    find_turns(aspect.zenith, aspect.height_of_sun, aspect.sun, place.turns);
    return place;
}

static void look_up(const nb_stray *stray, const nb_place *place, int air, double sum[3])
{
    const float *parts = stray->parts + nb_stray_entry(stray) * (size_t)(air * stray->heights * stray->suns);
    float mean[NB_STRAY_SIZE] = {0};
    for (int i = 0; i < 8; i++) {
        const float *from = parts + NB_STRAY_SIZE * place->ways[i], weight = (float)place->weights[i];
        for (int k = 0; k < NB_STRAY_SIZE; k++) mean[k] += weight * from[k];
    }
    for (int c = 0; c < 3; c++) {
        sum[c] = 0;
        for (int m = 0; m < NB_STRAY_TURNS; m++) sum[c] += place->turns[m] * (double)mean[3 * m + c];
    }
}

static void look_up_bent(const nb_stray *stray, const nb_place *place, double mean[3], double rest[3])
{
    float sums[NB_BENT_SIZE] = {0};
    for (int i = 0; i < 8; i++) {
        const float *from = stray->bent + NB_BENT_SIZE * place->ways[i], weight = (float)place->weights[i];
        for (int k = 0; k < NB_BENT_SIZE; k++) sums[k] += weight * from[k];
    }
    for (int c = 0; c < 3; c++) {
        mean[c] = rest[c] = 0;
        for (int m = 0; m < NB_STRAY_TURNS; m++) {
            mean[c] += place->turns[m] * (double)sums[3 * m + c];
            rest[c] += place->turns[m] * (double)sums[3 * (NB_STRAY_TURNS + m) + c];
        }
        mean[c] = fmax(0, mean[c]);
    }
}

/* What of sunlight comes straight to a place; in the planet's shadow as above the horizon. */
static void fill_one_sun(const nb_air_components *airs, const nb_air_components *smooth, double radius, double cosine,
                         const double around[3], nb_stray_sun *sun)
{
    const double above = fmax(cosine, nb_stray_horizon(airs, radius) + 1e-9);
    double straight[3], ahead[3];
    nb_atmosphere_ray_sunlight(airs, (nb_atmosphere_ray){radius, radius * above}, straight);
    nb_atmosphere_ray_sunlight(smooth, (nb_atmosphere_ray){radius, radius * above}, ahead);
    for (int c = 0; c < 3; c++) {
        const double t = log(fmax(ahead[c], 1e-300) / fmax(straight[c], 1e-300));
        sun->straight[c] = exp(-t);
        sun->around[c] = log(fmax(1e-30, around[c]));
    }
}

void nb_stray_fill_sun(nb_stray *stray, const nb_air_components *airs, const nb_air_components *smooth, int orders,
                       int height, double radius, const double suns[], const double *radiance)
{
    const nb_air_component *air = &airs->airs[stray->airs[0]];
    const double g = fmin(STEEPEST_BENT, nb_peak_ratio(air, orders));
    nb_bent_kernel kernel;
    set_bent_kernel(stray, air, g, nb_stray_horizon(airs, radius), &kernel);
    for (int i = 0; i < stray->suns; i++) {
        const size_t entry = (size_t)(height * stray->suns + i);
        double around[3];
        fill_bent(&kernel, air, orders, g, suns[i], radiance + 3 * nb_stray_ways(stray) * (size_t)i,
                  stray->bent + nb_bent_entry(stray) * entry, around);
        fill_one_sun(airs, smooth, radius, suns[i], around, &stray->sun[entry]);
    }
}

/* Cosines of a node. */
static nb_moment_basis aspect_at(const nb_gather_job *job, int at)
{
    const double radius = job->path->radius[at], s = job->path->s[at];
    const double up = job->track.radius * job->aspect.height_of_sun + s * job->aspect.sun;
    return (nb_moment_basis){fmax(-1, fmin(1, (job->track.rise + s) / radius)), job->aspect.sun,
                             fmax(-1, fmin(1, up / radius))};
}

/* Sunlight of an entry between four. */
static nb_stray_sun look_up_sun(const nb_stray *stray, const nb_corner *corner)
{
    nb_stray_sun sum = {.straight = {0}};
    for (int k = 0; k < 4; k++) {
        double weight;
        const nb_stray_sun *of = &stray->sun[corner_at(stray, corner, k, &weight)];
        for (int c = 0; c < 3; c++) {
            sum.straight[c] += weight * of->straight[c];
            sum.around[c] += weight * of->around[c];
        }
    }
    return sum;
}

void nb_stray_add_sun(const nb_stray *stray, const nb_scattering_table *scatter, const nb_gather_job *job,
                      nb_node_light *light)
{
    const nb_ray_nodes *path = job->path;
    for (int i = 0; i < job->count; i++) {
        const int at = job->first + i;
        const nb_corner corner =
            find_corner(stray, scatter, job->airs, path->radius[at], aspect_at(job, at).height_of_sun);
        const nb_stray_sun sun = look_up_sun(stray, &corner);
        for (int c = 0; c < 3; c++)
            light->lit[c][i] = light->sun[c][i] * sun.straight[c] +
                               path->weight[at] * path->transmittance[c][at] * nb_exp(sun.around[c]);
    }
}

/* What is off of light that peaks turn: of it all, and of what thin air above haze gets from there. Found by random views of haze of
 * depth 1, of which tests/check_air_truth.py has some. */
#define STRAY_OFF 0.05
#define STRAY_OFF_ABOVE 0.8
/* The same of sunlight that they turn. */
#define BENT_OFF 0.3

static double off_at(double density)
{
    return STRAY_OFF + STRAY_OFF_ABOVE * fmax(0, 1 - 10 * density);
}

/* If peaks turn light more often than that in the mean, what arrives was turned in thinner air. */
#define MOST_BENT 1.5

/* The phase function of sunlight that peaks turned: n times with the chance of t^n / n!, once at least. */
static double bent_phase(const nb_peaks *peaks, int air, double t)
{
    double share = 1, factorial = 1, sum = 0, all = 0;
    for (int n = 1; n < NB_PEAK_POWERS; n++) {
        share *= t / n;
        factorial *= n + 1;
        all += share;
        sum += share * factorial * peaks->turned[air][n];
    }
    return all > 0 ? sum / all : 2 * peaks->turned[air][1];
}

/* Of node i: smooth air scatters sunlight that peaks turned as if it came from the sun. */
static void add_ahead(const nb_stray *stray, const nb_corner *corner, const nb_gather_job *job, int i,
                      nb_node_light *light)
{
    const int at = job->first + i;
    const nb_stray_sun sun = look_up_sun(stray, corner);
    for (int c = 0; c < 3; c++)
        light->lit[c][i] =
            light->sun[c][i] + job->path->weight[at] * job->path->transmittance[c][at] * nb_exp(sun.around[c]);
}

/* Sunlight that peaks turned before it comes to node i. Smooth air scatters it as if it came from the sun (lit); what air as
 * it is scatters beyond that is added. */
static void add_bent(const nb_stray *stray, const nb_corner *corner, const nb_place *place, const nb_peaks *peaks,
                     const nb_gather_job *job, int i, nb_node_light *light)
{
    const nb_air_components *airs = job->airs;
    const int at = job->first + i;
    const nb_stray_sun sun = look_up_sun(stray, corner);
    double mean[3], rest[3];
    look_up_bent(stray, place, mean, rest);
    for (int c = 0; c < 3; c++) {
        const double left = job->path->weight[at] * job->path->transmittance[c][at];
        const double t = fmin(MOST_BENT, -log(fmax(1e-300, sun.straight[c])));
        double turned = 0, smooth = 0;
        for (int k = 0; k < airs->count; k++)
            smooth += airs->airs[k].scattering[c] * job->path->density[k][at] * peaks->smooth[k];
        for (int k = 0; k < stray->count; k++) {
            const int air = stray->airs[k];
            turned += airs->airs[air].scattering[c] * job->path->density[air][at] *
                      (mean[c] * bent_phase(peaks, air, t) + rest[c]);
        }
        light->lit[c][i] = light->sun[c][i] + left * mean[c];
        light->often[c][i] += left * turned;
        light->missing[c][i] += BENT_OFF * left * fabs(mean[c] * smooth + turned);
    }
}

void nb_stray_add(const nb_stray *stray, const nb_gather_job *job, nb_node_light *light)
{
    const nb_peaks peaks = nb_peaks_aim(job);
    for (int i = 0; i < job->count; i++) {
        const int at = job->first + i;
        const double radius = job->path->radius[at];
        const nb_moment_basis aspect = aspect_at(job, at);
        const nb_corner corner = find_corner(stray, job->scatter, job->airs, radius, aspect.height_of_sun);
        const nb_place place = find_place(stray, job->airs, &corner, aspect, radius);
        for (int k = 0; k < stray->count; k++) {
            const double density = job->path->density[stray->airs[k]][at];
            double sum[3];
            look_up(stray, &place, k, sum);
            for (int c = 0; c < 3; c++) {
                const double scattered = light->mean[c][i] * job->airs->airs[stray->airs[k]].scattering[c] * density;
                light->often[c][i] += scattered * sum[c];
                light->missing[c][i] += off_at(density) * fabs(scattered * sum[c]);
            }
        }
        if (job->strays == NB_STRAYS_AND_BENDS)
            add_bent(stray, &corner, &place, &peaks, job, i, light);
        else
            add_ahead(stray, &corner, job, i, light);
    }
}
