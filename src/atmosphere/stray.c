#include "stray.h"

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

nb_stray nb_stray_plan(const nb_air_components *airs, const nb_scattering_table *layout, const nb_gauss_rule *slopes,
                       int turns)
{
    nb_stray stray = {.heights = layout->heights, .suns = layout->suns, .turns = turns, .slopes = *slopes};
    for (int k = 0; k < airs->count && nb_airs_are_hazy(airs); k++)
        if (airs->airs[k].peak > 0) stray.airs[stray.count++] = k;
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
    int count, turns;
    double zenith[MAX_WAYS], weight[MAX_WAYS];
    double share[MAX_WAYS][MAX_WAYS][NB_STRAY_TURNS];
    double all[MAX_WAYS];                   /* of light that comes evenly */
    double poles[MAX_WAYS][NB_STRAY_TURNS]; /* sine^-order: towards zenith and nadir light knows no turn */
} nb_kernel;

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
    for (int m = 0; m < kernel->turns; m++) share[m] = 0;
    for (int k = 0; k < TURNS_OF_KERNEL; k++) {
        const double cosine = cos(PI * (k + 0.5) / TURNS_OF_KERNEL);
        const double of = orders_behind(air, orders, fmax(-1, fmin(1, a * b + side * cosine)));
        double term = 1, before = cosine;
        for (int m = 0; m < kernel->turns; m++) {
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
    kernel->turns = stray->turns;
    for (int i = 0; i < kernel->count; i++)
        kernel->zenith[i] =
            nb_stray_zenith(stray, horizon, i / stray->slopes.count, i % stray->slopes.count, &kernel->weight[i]);
    for (int i = 0; i < kernel->count; i++)
        for (int j = 0; j <= i; j++) set_share(air, orders, kernel, i, j);
    for (int i = 0; i < kernel->count; i++) {
        const double sine = sqrt(1 - kernel->zenith[i] * kernel->zenith[i]);
        for (int m = 0; m < kernel->turns; m++) kernel->poles[i][m] = m > 0 ? kernel->poles[i][m - 1] / sine : 1;
        kernel->all[i] = 0;
        for (int j = 0; j < kernel->count; j++) kernel->all[i] += kernel->weight[j] * kernel->share[i][j][0];
    }
}

/* Light of one slope over turns to that of cosines of their multiples. */
static void order_turns(int turns, const double *radiance, int c, double orders[])
{
    for (int m = 0; m < turns; m++) {
        orders[m] = 0;
        for (int k = 0; k < turns; k++) orders[m] += radiance[3 * k + c] * cos(PI * m * (k + 0.5) / turns);
        orders[m] *= (m > 0 ? 2.0 : 1.0) / turns;
    }
}

/* What evenly comes from all sides does not stray: of what a rule of few slopes misses nothing is left. */
static void fill_entry(const nb_kernel *kernel, double self, const double *radiance, const double of[3], float *parts)
{
    double orders[MAX_WAYS][NB_STRAY_TURNS];
    for (int c = 0; c < 3; c++) {
        for (int i = 0; i < kernel->count; i++)
            order_turns(kernel->turns, radiance + (size_t)(3 * kernel->turns * i), c, orders[i]);
        for (int i = 0; i < kernel->count; i++)
            for (int m = 0; m < kernel->turns; m++) {
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
    size_t offset[8];
    double weights[8], turns[NB_STRAY_TURNS];
} nb_place;

/* Of cosines of multiples of the turn, times sine^order of the zenith's angle: the real part of (x + i y)^order. */
static void find_turns(const nb_stray *stray, double zenith, double sun, double along, double turns[])
{
    const double square = fmax(0, 1 - zenith * zenith), aside = sqrt(fmax(0, 1 - sun * sun));
    const double level = sqrt(square), x = aside > 1e-9 ? fmax(-level, fmin(level, (along - zenith * sun) / aside)) : 0;
    turns[0] = 1;
    turns[1] = x;
    for (int m = 2; m < stray->turns; m++) turns[m] = 2 * x * turns[m - 1] - square * turns[m - 2];
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
        place.offset[i] = entry * nb_stray_entry(stray) + (size_t)(NB_STRAY_SIZE * (way.first + n));
        place.weights[i] = weight * (n ? way.part : 1 - way.part);
    }
    find_turns(stray, aspect.zenith, aspect.height_of_sun, aspect.sun, place.turns);
    return place;
}

static void look_up(const nb_stray *stray, const nb_place *place, int air, double sum[3])
{
    const float *parts = stray->parts + nb_stray_entry(stray) * (size_t)(air * stray->heights * stray->suns);
    float mean[NB_STRAY_SIZE] = {0};
    for (int i = 0; i < 8; i++) {
        const float *from = parts + place->offset[i], weight = (float)place->weights[i];
        for (int k = 0; k < NB_STRAY_SIZE; k++) mean[k] += weight * from[k];
    }
    for (int c = 0; c < 3; c++) {
        sum[c] = 0;
        for (int m = 0; m < stray->turns; m++) sum[c] += place->turns[m] * (double)mean[3 * m + c];
    }
}

/* Sunlight that peaks turn is to go as far as if it came straight. What comes from around the sun instead is what comes from there of
 * light that they turned once; from the sun's own direction that is t times what smooth air lets through, where they turn it t times. */
static void fill_one_sun(const nb_stray *stray, const nb_air_components *airs, const nb_air_components *smooth,
                         double radius, double cosine, const double around[3], nb_stray_sun *sun)
{
    const double above = fmax(cosine, nb_stray_horizon(airs, radius) + 1e-9);
    double straight[3], ahead[3];
    nb_atmosphere_ray_sunlight(airs, (nb_atmosphere_ray){radius, radius * above}, straight);
    nb_atmosphere_ray_sunlight(smooth, (nb_atmosphere_ray){radius, radius * above}, ahead);
    for (int c = 0; c < 3; c++) {
        const double t = log(fmax(ahead[c], 1e-300) / fmax(straight[c], 1e-300));
        sun->straight[c] = exp(-t);
        sun->around[c] = log(fmax(1e-30, around[c] / airs->airs[stray->airs[0]].peak));
    }
}

void nb_stray_fill_sun(nb_stray *stray, const nb_air_components *airs, const nb_air_components *smooth, int orders,
                       int height, double radius, const double suns[], const double *radiance)
{
    const double horizon = nb_stray_horizon(airs, radius), ones[3] = {1, 1, 1};
    const nb_air_component *air = &airs->airs[stray->airs[0]];
    nb_kernel kernel;
    set_kernel(stray, air, orders, horizon, &kernel);
    for (int i = 0; i < stray->suns; i++) {
        float parts[MAX_WAYS * NB_STRAY_SIZE] = {0};
        fill_entry(&kernel, air->peak, radiance + 3 * nb_stray_ways(stray) * (size_t)i, ones, parts);
        nb_stray_ray way = find_way(stray, horizon, suns[i]);
        double turns[NB_STRAY_TURNS], around[3] = {0};
        find_turns(stray, suns[i], suns[i], 1, turns);
        for (int m = 0; m < stray->turns; m++)
            for (int c = 0; c < 3; c++) {
                const float *part = parts + NB_STRAY_SIZE * way.first + 3 * m + c;
                around[c] += turns[m] * ((1 - way.part) * (double)part[0] + way.part * (double)part[NB_STRAY_SIZE]);
            }
        fill_one_sun(stray, airs, smooth, radius, suns[i], around, &stray->sun[height * stray->suns + i]);
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

/* Of node i: sunlight that comes straight, or through smooth air, becomes what comes there of it. */
static void add_sun(const nb_stray *stray, const nb_corner *corner, const nb_gather_job *job, int i, int is_straight,
                    nb_node_light *light)
{
    const nb_ray_nodes *path = job->path;
    const int at = job->first + i;
    double straight[3] = {0}, around[3] = {0};
    for (int k = 0; k < 4; k++) {
        double weight;
        const nb_stray_sun *of = &stray->sun[corner_at(stray, corner, k, &weight)];
        for (int c = 0; c < 3; c++) {
            straight[c] += weight * of->straight[c];
            around[c] += weight * of->around[c];
        }
    }
    for (int c = 0; c < 3; c++)
        light->lit[c][i] = light->sun[c][i] * (is_straight ? 1 : straight[c]) +
                           path->weight[at] * path->transmittance[c][at] * nb_exp(around[c]);
}

void nb_stray_add_sun(const nb_stray *stray, const nb_scattering_table *scatter, const nb_gather_job *job,
                      nb_node_light *light)
{
    for (int i = 0; i < job->count; i++) {
        const double radius = job->path->radius[job->first + i];
        const nb_corner corner =
            find_corner(stray, scatter, job->airs, radius, aspect_at(job, job->first + i).height_of_sun);
        add_sun(stray, &corner, job, i, 0, light);
    }
}

/* What is off of light that peaks turn: of it all, and of what thin air above haze gets from there. Found by random views of haze of
 * depth 1, of which tests/check_air_truth.py has some. */
#define STRAY_OFF 0.05
#define STRAY_OFF_ABOVE 0.8

static double off_at(double density)
{
    return STRAY_OFF + STRAY_OFF_ABOVE * fmax(0, 1 - 10 * density);
}

void nb_stray_add(const nb_stray *stray, const nb_gather_job *job, nb_node_light *light)
{
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
        add_sun(stray, &corner, job, i, 1, light);
    }
}
