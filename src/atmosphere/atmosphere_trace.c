/* Light along rays through air, and at places. */
#include "atmosphere.h"

#include "forward_peaks.h"

#include "base/stride.h"
#include "math/vector.h"

#include <math.h>
#include <string.h>

#define NB_DOUBLE
#include "formulas/prelude.h"

#include "formulas/elementary.inc"

#define PI 3.14159265358979323846

/* ---- along a ray ----------------------------------------------------------------------------- */

/* The shadow is a cylinder behind the planet: |p + s d|^2 - ((p + s d) sun)^2 is the square of the radius. */
void nb_find_shadow(const nb_air_components *airs, nb_atmosphere_ray track, nb_moment_basis aspect, double cuts[2])
{
    const double up = track.radius * aspect.height_of_sun;
    const double a = 1 - aspect.sun * aspect.sun, b = track.rise - up * aspect.sun;
    const double c = (track.radius - airs->radius) * (track.radius + airs->radius) - up * up;
    const double square = b * b - a * c, q = -(b + copysign(sqrt(fmax(0, square)), b));
    cuts[0] = cuts[1] = -1;
    if (!(a > 0 && square > 0 && q != 0)) return;
    cuts[0] = q / a;
    cuts[1] = c / q;
}

/* Nodes of a path whose light is at hand, and what phase functions give of it. */
typedef struct nb_gathering {
    const nebel_atmosphere *atmosphere;
    nb_gather_job job;
    nb_node_light light;
    nb_peaks peaks;
} nb_gathering;

static int smaller(int a, int b)
{
    return a < b ? a : b;
}

/* Adds the light of any nodes that are not before those at hand. */
static void gather_nodes(nb_gathering *gathering, int from, int to, nb_peak_sums *sums)
{
    nb_gather_job *job = &gathering->job;
    while (from < to) {
        if (from == job->first + job->count) {
            job->first = from;
            job->count = smaller(NB_GATHER_NODES, job->path->count + 1 - from);
            gathering->atmosphere->gather(job, &gathering->light);
            if (job->strays) nb_stray_add(&gathering->atmosphere->stray, job, &gathering->light);
        }
        const int next = smaller(to, job->first + job->count);
        nb_peaks_add(&gathering->peaks, job, &gathering->light, from, next, sums);
        from = next;
    }
}

/* Of a node that is at hand. */
static void radiance_at(const nb_gathering *gathering, int node, double radiance[3])
{
    for (int c = 0; c < 3; c++) radiance[c] = gathering->light.radiance[c][node - gathering->job.first];
}

/* The first node from `from` on that is not before `end`. */
static int node_at(const nb_ray_nodes *path, int from, double end)
{
    while (from < path->count && path->s[from] < end) from++;
    return from;
}

/* ---- light from behind an end ---------------------------------------------------------------- */

/* Light that peaks turn before an end comes from behind it, from directions around the ray's. What is there may not be air: a hill, or
 * clouds. So it is taken from the field in front of the end, which is as smooth: with the light of the very direction the horizon and a dusk
 * would be seen through hills and clouds. `error` tells how far the light of the air behind is from that. */
typedef struct nb_behind {
    double turned[3];   /* of light from there, the part that peaks turn; at the start per meter */
    double smooth[3];   /* transmittance of smooth air up to there */
    double radiance[3]; /* of the field */
} nb_behind;

/* Of the ground, if the path ends there and not where it leaves the air, what comes to the start through smooth air. */
static void find_ground(const nebel_atmosphere *atmosphere, nb_atmosphere_ray track, nb_moment_basis aspect,
                        const nb_ray_nodes *path, double way, double light[3])
{
    const nb_air_components *airs = &atmosphere->airs;
    for (int c = 0; c < 3; c++) light[c] = 0;
    if (nb_atmosphere_ray_ahead(track, way).radius > 0.5 * (airs->radius + airs->top)) return;
    const double sun = fmax(-1, fmin(1, (track.radius * aspect.height_of_sun + way * aspect.sun) / airs->radius));
    double sky[3], straight[3];
    nb_scattering_table_look_up_ground(&atmosphere->scatter, sun, sky);
    nb_atmosphere_ray_sunlight(airs, (nb_atmosphere_ray){airs->radius, airs->radius * sun}, straight);
    for (int c = 0; c < 3; c++)
        light[c] = path->end_smooth[c][path->ends - 1] * atmosphere->ground_albedo[c] / PI *
                   (sky[c] + fmax(0, sun) * straight[c]);
}

static nb_behind behind_end(const nb_ray_nodes *path, double end, const double radiance[3])
{
    nb_behind behind;
    int i = 0;
    while (i < path->ends - 1 && path->end[i] < end) i++;
    for (int c = 0; c < 3; c++) {
        behind.smooth[c] = path->end_smooth[c][i];
        behind.turned[c] = path->end_smooth[c][i] - path->end_left[c][i];
        behind.radiance[c] = radiance[c];
    }
    return behind;
}

static nb_behind behind_start(const nb_gathering *gathering)
{
    const nb_ray_nodes *path = gathering->job.path;
    nb_behind behind = {.smooth = {1, 1, 1}};
    for (int k = 0; k < gathering->peaks.air_count; k++)
        for (int c = 0; c < 3; c++)
            behind.turned[c] +=
                gathering->peaks.peak[k] * gathering->job.airs->airs[k].scattering[c] * path->density[k][path->count];
    radiance_at(gathering, path->count, behind.radiance);
    return behind;
}

/* ---- along a path ---------------------------------------------------------------------------- */

static void subtract(const nb_peak_sums *from, const nb_peak_sums *sums, nb_peak_sums *rest)
{
    const double *a = (const double *)from, *b = (const double *)sums;
    for (size_t i = 0; i < sizeof *rest / sizeof(double); i++) ((double *)rest)[i] = a[i] - b[i];
}

static nb_in_scattered finish(const nb_gathering *gathering, const nb_peak_sums *before)
{
    const nb_peak_light light = nb_peaks_before(&gathering->peaks, before);
    nb_in_scattered gathered;
    for (int k = 0; k < NEBEL_MAX_COMPONENTS; k++)
        for (int c = 0; c < 3; c++) gathered.once[k][c] = before->powers[k][c][0];
    memcpy(gathered.often, light.light, sizeof gathered.often);
    memcpy(gathered.missing, light.missing, sizeof gathered.missing);
    return gathered;
}

/* Adds what peaks turn of light from behind an end. `sums` are those of the nodes there. */
static void add_behind(const nb_gathering *gathering, const nb_behind *behind, const nb_peak_sums *sums,
                       const double ground[3], nb_in_scattered *gathered)
{
    double light[3];
    nb_peaks_behind(&gathering->peaks, sums, ground, light);
    for (int c = 0; c < 3; c++) {
        const double radiance = behind->smooth[c] > 0 ? light[c] / behind->smooth[c] : 0;
        gathered->often[c] += behind->turned[c] * behind->radiance[c];
        gathered->missing[c] += behind->turned[c] * fabs(radiance - behind->radiance[c]);
    }
}

/* Of what peaks turn of the ground's light, what may come from beside it. */
#define GROUND_OFF 0.2

/* Adds what peaks turn of the ground's light. */
static void add_ground(const nb_ray_nodes *path, const double ground[3], nb_in_scattered *gathered)
{
    for (int c = 0; c < 3; c++) {
        const double smooth = path->end_smooth[c][path->ends - 1], left = path->end_left[c][path->ends - 1];
        const double turned = smooth > 0 ? (1 - left / smooth) * ground[c] : 0;
        gathered->often[c] += turned;
        gathered->missing[c] += GROUND_OFF * turned;
    }
}

/* Sums up to each end. `radiance` is that of the field in front of each. */
static void sum_nodes(nb_gathering *gathering, int count, const double ends[], nb_peak_sums sums[],
                      double radiance[][3])
{
    const nb_ray_nodes *path = gathering->job.path;
    memset(&sums[0], 0, sizeof sums[0]);
    memset(radiance[0], 0, sizeof radiance[0]);
    for (int k = 0, i = 0; k < count; k++) {
        const int to = k + 1 == count ? path->count : node_at(path, i, ends[k]);
        if (k > 0) {
            sums[k] = sums[k - 1];
            memcpy(radiance[k], radiance[k - 1], sizeof radiance[k]);
        }
        gather_nodes(gathering, i, to, &sums[k]);
        if (to > i) radiance_at(gathering, to - 1, radiance[k]);
        i = to;
    }
}

nb_in_scattered nb_gather_path(const nebel_atmosphere *atmosphere, nb_atmosphere_ray track, nb_moment_basis aspect,
                               const nb_ray_nodes *path, int count, const double ends[], nb_in_scattered gathered[])
{
    nb_gathering gathering;
    nb_peak_sums sums[NB_PATH_CUTS + 1], start;
    double radiance[NB_PATH_CUTS + 1][3], ground[3];
    gathering.atmosphere = atmosphere;
    gathering.job = (nb_gather_job){.airs = &atmosphere->airs,
                                    .smooth = nb_atmosphere_smooth(atmosphere),
                                    .scatter = &atmosphere->scatter,
                                    .wants_sun = 1,
                                    .strays = atmosphere->stray.strays,
                                    .track = track,
                                    .aspect = aspect,
                                    .path = path};
    nb_gather_aim(&gathering.job);
    gathering.peaks = nb_peaks_aim(&gathering.job);
    sum_nodes(&gathering, count, ends, sums, radiance);
    memset(&start, 0, sizeof start);
    gather_nodes(&gathering, path->count, path->count + 1, &start);
    nb_in_scattered first = finish(&gathering, &start);
    for (int k = 0; k < count; k++) gathered[k] = finish(&gathering, &sums[k]);
    if (gathering.job.smooth == NULL || gathering.job.strays || path->ends == 0) return first;
    find_ground(atmosphere, track, aspect, path, ends[count - 1], ground);
    for (int k = 0; k + 1 < count; k++) {
        const nb_behind behind = behind_end(path, ends[k], radiance[k]);
        nb_peak_sums rest;
        subtract(&sums[count - 1], &sums[k], &rest);
        add_behind(&gathering, &behind, &rest, ground, &gathered[k]);
    }
    add_ground(path, ground, &gathered[count - 1]);
    const nb_behind behind = behind_start(&gathering);
    add_behind(&gathering, &behind, &sums[count - 1], ground, &first);
    return first;
}

nb_in_scattered nb_gather(const nebel_atmosphere *atmosphere, const nb_gauss_rule *rule, nb_atmosphere_ray track,
                          nb_moment_basis aspect, int count, const double ends[], nb_in_scattered gathered[])
{
    double cuts[NB_PATH_CUTS];
    nb_ray_nodes path;
    nb_find_shadow(&atmosphere->airs, track, aspect, cuts);
    memcpy(cuts + 2, ends, (size_t)count * sizeof *ends);
    nb_ray_nodes_lay(&atmosphere->airs, nb_atmosphere_smooth(atmosphere), rule, track, ends[count - 1], 2 + count, cuts,
                     &path);
    return nb_gather_path(atmosphere, track, aspect, &path, count, ends, gathered);
}

void nb_gathered_once(const nebel_atmosphere *atmosphere, const nb_in_scattered *gathered, double sun, double once[3])
{
    for (int c = 0; c < 3; c++) once[c] = 0;
    for (int k = 0; k < atmosphere->airs.count; k++) {
        const double phase = nb_phase_at(&atmosphere->airs.airs[k].phase, sun);
        for (int c = 0; c < 3; c++) once[c] += phase * gathered->once[k][c];
    }
}

double nb_gathered_off(const nebel_atmosphere *atmosphere, const nb_in_scattered *gathered, const double once[3], int c)
{
    return NB_ONCE_OFF * once[c] + atmosphere->share_off * gathered->often[c] + gathered->missing[c];
}

/* ---- places and directions ------------------------------------------------------------------- */

const char nb_air_sun_fault[] =
    "sun: each irradiance must be within 0 and 1e9, and a sun that shines needs a direction that is not 0";

int nb_air_resolve_sun(const nebel_sun *sun, nebel_sun *resolved)
{
    static const nebel_sun none = {.direction = {0, 1, 0}};
    *resolved = sun == NULL ? none : *sun;
    int shines = 0;
    for (int c = 0; c < 3; c++) {
        if (!(resolved->irradiance[c] >= 0 && resolved->irradiance[c] <= 1e9)) return 0;
        shines |= resolved->irradiance[c] > 0;
    }
    if (nb_vector_make_unit(resolved->direction)) return 1;
    *resolved = none;
    return !shines;
}

static double bound_cosine(double cosine)
{
    return fmax(-1, fmin(1, cosine));
}

void nb_air_raise(double ground, double from[3])
{
    const double far = nb_vector_length(from);
    if (far >= ground) return;
    for (int c = 0; c < 3; c++) from[c] = far > 0 ? from[c] / far * ground : c == 1 ? ground : 0;
}

/* Relative to the planet's centre; returns how far that is. What is below the ground counts as on it. */
static double place_over(const nebel_atmosphere *atmosphere, const double place[3], double relative[3])
{
    nb_air_from_center(atmosphere, place, relative);
    nb_air_raise(atmosphere->airs.radius, relative);
    return fmax(atmosphere->airs.radius, sqrt(nb_vector_dot(relative, relative)));
}

/* A piece of a ray within the air; its length is 0 where there is none. */
typedef struct nb_inside {
    nb_atmosphere_ray track;
    double height_of_sun, length;
    double end; /* of the ray in the air, however long it is */
} nb_inside;

/* Rays from outside are counted from where they pass the centre, so that their distance loses no digits. */
static nb_inside find_inside(const nebel_atmosphere *atmosphere, const double start[3], const double unit[3],
                             double t_max, const double sun[3])
{
    const nb_air_components *airs = &atmosphere->airs;
    double from[3];
    nb_inside inside = {.track = {place_over(atmosphere, start, from), 0}};
    double left = t_max;
    inside.track.rise = nb_vector_dot(from, unit);
    if (inside.track.radius > airs->top) {
        double closest[3];
        for (int c = 0; c < 3; c++) closest[c] = from[c] - inside.track.rise * unit[c];
        const double aside = sqrt(nb_vector_dot(closest, closest)), square = (airs->top - aside) * (airs->top + aside);
        if (!(square > 0 && inside.track.rise < 0)) return inside;
        const double half = sqrt(square);
        left -= -inside.track.rise - half;
        for (int c = 0; c < 3; c++) from[c] = closest[c] - half * unit[c];
        inside.track = (nb_atmosphere_ray){airs->top, -half};
    }
    inside.height_of_sun = bound_cosine(nb_vector_dot(from, sun) / inside.track.radius);
    inside.end =
        fmin(nb_atmosphere_ray_enter(inside.track, airs->radius), nb_atmosphere_ray_leave(inside.track, airs->top));
    inside.length = fmax(0, fmin(left, inside.end));
    return inside;
}

/* ---- the face -------------------------------------------------------------------------------- */

static void trace(const nebel_atmosphere *atmosphere, const nebel_sun *sun, const nebel_ray *ray, const double unit[3],
                  nebel_transfer *transfer)
{
    *transfer = (nebel_transfer){.transmittance = {1, 1, 1}};
    const nb_inside inside = find_inside(atmosphere, ray->origin, unit, ray->t_max, sun->direction);
    if (!(inside.length > 0)) return;
    double depth[3];
    nb_atmosphere_ray_depth(&atmosphere->airs, inside.track, inside.length, depth);
    for (int c = 0; c < 3; c++) transfer->transmittance[c] = nb_exp(-depth[c]);
    transfer->error = NB_LIGHT_ROUNDING;
    if (!(fmax(sun->irradiance[0], fmax(sun->irradiance[1], sun->irradiance[2])) > 0)) return;
    nb_in_scattered gathered[2];
    const double ends[2] = {inside.length, inside.end};
    const nb_moment_basis aspect = {bound_cosine(inside.track.rise / inside.track.radius),
                                    bound_cosine(nb_vector_dot(unit, sun->direction)), inside.height_of_sun};
    double once[3];
    nb_gather(atmosphere, &atmosphere->rule, inside.track, aspect, inside.length < inside.end ? 2 : 1, ends, gathered);
    nb_gathered_once(atmosphere, &gathered[0], aspect.sun, once);
    for (int c = 0; c < 3; c++) {
        transfer->in_scattering[c] = sun->irradiance[c] * fmax(0, once[c] + gathered[0].often[c]);
        const double off = nb_gathered_off(atmosphere, &gathered[0], once, c);
        transfer->error = fmax(transfer->error, sun->irradiance[c] * off + NB_LIGHT_ROUNDING);
    }
}

int nb_air_is_place(const double place[3])
{
    for (int c = 0; c < 3; c++)
        if (!(fabs(place[c]) <= NEBEL_MAX_LENGTH)) return 0;
    return 1;
}

int nb_air_is_ray(const nebel_ray *ray, double unit[3])
{
    memcpy(unit, ray->direction, 3 * sizeof *unit);
    return nb_air_is_place(ray->origin) && nb_vector_make_unit(unit) && ray->t_max >= 0;
}

nebel_result nebel_trace_atmosphere(const nebel_atmosphere *atmosphere, const nebel_sun *sun, size_t n,
                                    const nebel_ray *rays, size_t ray_stride, nebel_transfer *transfers,
                                    size_t transfer_stride)
{
    nebel_sun resolved;
    if (atmosphere == NULL || (n > 0 && (rays == NULL || transfers == NULL))) return NEBEL_ERROR_ARGUMENT;
    if (!nb_air_resolve_sun(sun, &resolved)) return NEBEL_ERROR_ARGUMENT;
    double unit[3];
    ray_stride = nb_stride_of(ray_stride, sizeof *rays);
    transfer_stride = nb_stride_of(transfer_stride, sizeof *transfers);
    for (size_t i = 0; i < n; i++)
        if (!nb_air_is_ray(nb_stride_from(rays, ray_stride, i), unit)) return NEBEL_ERROR_ARGUMENT;
    for (size_t i = 0; i < n; i++) {
        const nebel_ray *ray = nb_stride_from(rays, ray_stride, i);
        (void)nb_air_is_ray(ray, unit);
        trace(atmosphere, &resolved, ray, unit, nb_stride_to(transfers, transfer_stride, i));
    }
    return NEBEL_OK;
}

/* The sky is that of the ground straight below, wherever the way to the sun comes into the air, or if it never does. */
static void light_place(const nebel_atmosphere *atmosphere, const nebel_sun *sun, const double place[3],
                        nebel_irradiance *light)
{
    double from[3];
    const double radius = place_over(atmosphere, place, from);
    const nb_inside inside = find_inside(atmosphere, place, sun->direction, HUGE_VAL, sun->direction);
    if (inside.track.radius > atmosphere->airs.top)
        light->sun[0] = light->sun[1] = light->sun[2] = 1;
    else
        nb_atmosphere_ray_sunlight(&atmosphere->airs, inside.track, light->sun);
    nb_scattering_table_look_up_ground(&atmosphere->scatter, bound_cosine(nb_vector_dot(from, sun->direction) / radius),
                                       light->sky);
    for (int c = 0; c < 3; c++) {
        light->sun[c] *= sun->irradiance[c];
        light->sky[c] *= sun->irradiance[c];
    }
}

nebel_result nebel_compute_atmosphere_irradiance(const nebel_atmosphere *atmosphere, const nebel_sun *sun, size_t n,
                                                 const double (*places)[3], size_t place_stride,
                                                 nebel_irradiance *irradiances, size_t irradiance_stride)
{
    nebel_sun resolved;
    if (atmosphere == NULL || (n > 0 && (places == NULL || irradiances == NULL))) return NEBEL_ERROR_ARGUMENT;
    if (!nb_air_resolve_sun(sun, &resolved)) return NEBEL_ERROR_ARGUMENT;
    place_stride = nb_stride_of(place_stride, sizeof *places);
    irradiance_stride = nb_stride_of(irradiance_stride, sizeof *irradiances);
    for (size_t i = 0; i < n; i++)
        if (!nb_air_is_place(nb_stride_from(places, place_stride, i))) return NEBEL_ERROR_ARGUMENT;
    for (size_t i = 0; i < n; i++)
        light_place(atmosphere, &resolved, nb_stride_from(places, place_stride, i),
                    nb_stride_to(irradiances, irradiance_stride, i));
    return NEBEL_OK;
}
