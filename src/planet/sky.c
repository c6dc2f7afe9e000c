/* Light along rays through air, and at places. */
#include "atmosphere.h"
#include "path.h"

#include "base/vector.h"

#include <math.h>
#include <string.h>

/* Behind the terminator light comes from near the horizon, and changes fast with the sun's height: where the sun is 5, 7 and
 * 10 degrees below the horizon a far finer table has up to 5, 8 and 21 % more or less of all light (`precise`: 3, 7 and 8).
 * Measured on the Earth; others may be worse. */
#define TWILIGHT_OFF 3

#define NB_DOUBLE
#include "formulas/prelude.h"

#include "formulas/elementary.inc"

/* ---- along a ray ----------------------------------------------------------------------------- */

/* Where the ray enters and leaves the shadow of the planet, a cylinder behind it: |p + s d|^2 - ((p + s d) sun)^2 is the
 * square of the radius. */
static void find_shadow(const nb_airs *airs, nb_track track, nb_aspect aspect, double cuts[2])
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

/* Adds what one kind of light gives at a node. */
static void add(double sum[3], const nb_path_node *node, const double radiance[3])
{
    for (int c = 0; c < 3; c++) sum[c] += node->weight * node->transmittance[c] * radiance[c];
}

void nb_gather_node(const nebel_atmosphere *atmosphere, nb_track track, nb_aspect aspect, const nb_path_node *node,
                    nb_gathered *gathered)
{
    const nb_airs *airs = &atmosphere->airs;
    const nb_scatter *scatter = &atmosphere->scatter;
    const double sun = (track.radius * aspect.height_of_sun + node->s * aspect.sun) / node->radius;
    const double zenith = (track.rise + node->s) / node->radius;
    const nb_field field = nb_scatter_look_up(scatter, airs, node->radius, sun);
    double sunlight[3], once[3], often[3], missing[3];
    nb_track_sunlight(airs, (nb_track){node->radius, node->radius * sun}, sunlight);
    for (int k = 0; k < airs->count; k++) {
        for (int c = 0; c < 3; c++) once[c] = sunlight[c] * airs->airs[k].scattering[c] * node->density[k];
        add(gathered->once[k], node, once);
    }
    nb_field_scatter(&field, scatter->orders, airs, node->density, (nb_aspect){zenith, aspect.sun, sun}, often);
    nb_field_missing(&field, scatter->orders, airs, node->density, missing);
    for (int c = 0; c < 3; c++) missing[c] += TWILIGHT_OFF * fmax(0, -sun) * often[c];
    add(gathered->often, node, often);
    add(gathered->missing, node, missing);
}

void nb_gather(const nebel_atmosphere *atmosphere, const nb_rule *rule, nb_track track, nb_aspect aspect, int count,
               const double ends[], nb_gathered gathered[])
{
    double cuts[NB_PATH_CUTS];
    nb_path path;
    find_shadow(&atmosphere->airs, track, aspect, cuts);
    memcpy(cuts + 2, ends, (size_t)count * sizeof *ends);
    nb_path_lay(&atmosphere->airs, rule, track, ends[count - 1], 2 + count, cuts, &path);
    nb_gathered sum;
    memset(&sum, 0, sizeof sum);
    for (int k = 0, i = 0; k < count; k++) {
        for (; i < path.count && (k + 1 == count || path.nodes[i].s < ends[k]); i++)
            nb_gather_node(atmosphere, track, aspect, &path.nodes[i], &sum);
        gathered[k] = sum;
    }
}

void nb_gathered_once(const nebel_atmosphere *atmosphere, const nb_gathered *gathered, double sun, double once[3])
{
    for (int c = 0; c < 3; c++) once[c] = 0;
    for (int k = 0; k < atmosphere->airs.count; k++) {
        const double phase = nb_phase_at(&atmosphere->airs.airs[k].phase, sun);
        for (int c = 0; c < 3; c++) once[c] += phase * gathered->once[k][c];
    }
}

double nb_gathered_off(const nebel_atmosphere *atmosphere, const nb_gathered *gathered, const double once[3], int c)
{
    return NB_ONCE_OFF * once[c] + atmosphere->share_off * gathered->often[c] + gathered->missing[c];
}

/* ---- places and directions ------------------------------------------------------------------- */

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

/* Relative to the planet's centre. What is below the ground counts as on it. */
static double place_over(const nebel_atmosphere *atmosphere, const double place[3], double relative[3])
{
    for (int c = 0; c < 3; c++) relative[c] = place[c] - atmosphere->center[c];
    return fmax(atmosphere->airs.radius, sqrt(nb_vector_dot(relative, relative)));
}

/* A piece of a ray within the air; its length is 0 where there is none. */
typedef struct nb_inside {
    nb_track track;
    double height_of_sun, length;
} nb_inside;

/* Rays from outside are counted from where they pass the centre, so that their distance loses no digits. */
static nb_inside find_inside(const nebel_atmosphere *atmosphere, const double start[3], const double unit[3],
                             double t_max, const double sun[3])
{
    const nb_airs *airs = &atmosphere->airs;
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
        inside.track = (nb_track){airs->top, -half};
    }
    inside.height_of_sun = bound_cosine(nb_vector_dot(from, sun) / inside.track.radius);
    const double end = fmin(nb_track_enter(inside.track, airs->radius), nb_track_leave(inside.track, airs->top));
    inside.length = fmax(0, fmin(left, end));
    return inside;
}

/* ---- the face -------------------------------------------------------------------------------- */

static void trace(const nebel_atmosphere *atmosphere, const nebel_sun *sun, const nebel_ray *ray, const double unit[3],
                  nebel_light *light)
{
    *light = (nebel_light){.transmittance = {1, 1, 1}};
    const nb_inside inside = find_inside(atmosphere, ray->origin, unit, ray->t_max, sun->direction);
    if (!(inside.length > 0)) return;
    double depth[3];
    nb_track_depth(&atmosphere->airs, inside.track, inside.length, depth);
    for (int c = 0; c < 3; c++) light->transmittance[c] = nb_exp(-depth[c]);
    light->error = 1e-8;
    if (!(fmax(sun->irradiance[0], fmax(sun->irradiance[1], sun->irradiance[2])) > 0)) return;
    nb_gathered gathered;
    const nb_aspect aspect = {bound_cosine(inside.track.rise / inside.track.radius),
                              bound_cosine(nb_vector_dot(unit, sun->direction)), inside.height_of_sun};
    double once[3];
    nb_gather(atmosphere, &atmosphere->rule, inside.track, aspect, 1, &inside.length, &gathered);
    nb_gathered_once(atmosphere, &gathered, aspect.sun, once);
    for (int c = 0; c < 3; c++) {
        light->in_scattering[c] = sun->irradiance[c] * (once[c] + gathered.often[c]);
        const double off = nb_gathered_off(atmosphere, &gathered, once, c);
        light->error = fmax(light->error, sun->irradiance[c] * off + 1e-8);
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

nebel_result nebel_trace_air(const nebel_atmosphere *atmosphere, const nebel_sun *sun, size_t n, const nebel_ray *rays,
                             size_t ray_stride, nebel_light *lights, size_t light_stride)
{
    nebel_sun resolved;
    if (atmosphere == NULL || (n > 0 && (rays == NULL || lights == NULL))) return NEBEL_ERROR_ARGUMENT;
    if (!nb_air_resolve_sun(sun, &resolved)) return NEBEL_ERROR_ARGUMENT;
    for (size_t i = 0; i < n; i++) {
        const nebel_ray *ray = (const nebel_ray *)(const void *)((const char *)rays + i * ray_stride);
        double unit[3];
        if (!nb_air_is_ray(ray, unit)) return NEBEL_ERROR_ARGUMENT;
        trace(atmosphere, &resolved, ray, unit, (nebel_light *)(void *)((char *)lights + i * light_stride));
    }
    return NEBEL_OK;
}

nebel_result nebel_light_air(const nebel_atmosphere *atmosphere, const nebel_sun *sun, size_t n,
                             const double (*places)[3], size_t place_stride, nebel_air_light *lights,
                             size_t light_stride)
{
    nebel_sun resolved;
    if (atmosphere == NULL || (n > 0 && (places == NULL || lights == NULL))) return NEBEL_ERROR_ARGUMENT;
    if (!nb_air_resolve_sun(sun, &resolved)) return NEBEL_ERROR_ARGUMENT;
    for (size_t i = 0; i < n; i++) {
        const double *place = (const double *)(const void *)((const char *)places + i * place_stride);
        nebel_air_light *light = (nebel_air_light *)(void *)((char *)lights + i * light_stride);
        if (!nb_air_is_place(place)) return NEBEL_ERROR_ARGUMENT;
        const nb_inside inside = find_inside(atmosphere, place, resolved.direction, HUGE_VAL, resolved.direction);
        if (inside.track.radius > atmosphere->airs.top)
            light->sun[0] = light->sun[1] = light->sun[2] = 1;
        else
            nb_track_sunlight(&atmosphere->airs, inside.track, light->sun);
        nb_scatter_look_up_ground(&atmosphere->scatter, inside.height_of_sun, light->sky);
        for (int c = 0; c < 3; c++) {
            light->sun[c] *= resolved.irradiance[c];
            light->sky[c] *= resolved.irradiance[c];
        }
    }
    return NEBEL_OK;
}
