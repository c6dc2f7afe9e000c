/* Air, surfaces and fog under clouds: what they leave of the light there. Sunlight and the sky's light are alike in that both come
 * through clouds above; sunlight aslant, the sky's from above. */
#include "cloud_lighting.h"

#include "base/stride.h"
#include "math/vector.h"

#include <math.h>
#include <string.h>

/* Pieces of rays end so far from where they come under clouds, in heights of the lowest layer's top; the last one has no end. */
static const double ends[NEBEL_MAX_AIR_SHADOW_SEGMENTS - 1] = {0.75, 2.2, 6, 15, 40};

/* A mean over that part of a piece's length; finer than this part of the clouds' height is too fine. */
#define WIDTH_PART 0.7
#define LEAST_WIDTH 0.06

/* Of the way to the eye: from space the air under clouds is a veil, which a few pixels share. */
#define FAR_PART 0.01

#define PI_F 3.14159265f

/* The lowest layer whose top is above a radius; -1: none. */
static int layer_over(const nebel_clouds *clouds, double radius)
{
    int lowest = -1;
    for (int k = 0; k < clouds->layer_count; k++)
        if (clouds->layers[k].high > radius && (lowest < 0 || clouds->layers[k].high < clouds->layers[lowest].high))
            lowest = k;
    return lowest;
}

/* Under a layer: light enters it from where the way to the sun meets its base; the sky's from as wide a place as is far above. */
static nb_cloud_cover_transmittance roof_under(nebel_cloud_workspace *workspace, int k, const double place[3],
                                               double radius, float width)
{
    const double *sun = workspace->view->sun.direction, low = workspace->view->clouds->layers[k].low;
    const double along = nb_vector_dot(place, sun), below = low - radius;
    const double way = sqrt(along * along + below * (low + radius)) - along;
    double entry[3];
    for (int c = 0; c < 3; c++) entry[c] = place[c] + way * sun[c];
    return (nb_cloud_cover_transmittance){nb_cloud_roof_at(workspace, k, entry, width).sun,
                                          nb_cloud_roof_at(workspace, k, place, nb_larger(width, (float)below)).up};
}

/* Within a layer light fades evenly from its top to its base. */
static nb_cloud_cover_transmittance roof_over(nebel_cloud_workspace *workspace, int k, const double place[3],
                                              double radius, float width)
{
    const nebel_clouds *clouds = workspace->view->clouds;
    const nb_cloud_layer *layer = &clouds->layers[k];
    if (radius <= layer->low) return roof_under(workspace, k, place, radius, width);
    const int next = layer_over(clouds, layer->high);
    const float part = (float)(layer->high - radius) * layer->per_thickness;
    nb_cloud_cover_transmittance roof = nb_cloud_roof_at(workspace, k, place, width), above = {1, 1};
    if (next >= 0) above = roof_under(workspace, next, place, radius, width);
    roof.sun = above.sun + part * (roof.sun - above.sun);
    roof.up = above.up + part * (roof.up - above.up);
    return roof;
}

/* Sunlight and the sky's light count as what a drop of air has of them from all sides. */
static void find_parts(nebel_cloud_workspace *workspace, const double place[3], float width, float part[3])
{
    const nebel_cloud_lighting *view = workspace->view;
    const double radius = nb_vector_length(place);
    const int k = layer_over(view->clouds, radius);
    part[0] = part[1] = part[2] = 1;
    if (k < 0) return;
    const nb_cloud_cover_transmittance roof = roof_over(workspace, k, place, radius, width);
    if (!(roof.sun < 1 || roof.up < 1)) return;
    const nb_cloud_light light = nb_cloud_clear_light(view, place, radius);
    for (int c = 0; c < 3; c++) {
        const float around = 2 * PI_F * (light.above[c] + light.below[c]), all = light.sun[c] + around;
        if (all > 0) part[c] = (light.sun[c] * roof.sun + around * roof.up) / all;
    }
}

/* Where a ray is above the ground and no higher than clouds; places count from the planet's middle. */
typedef struct nb_under {
    double from[3], unit[3], begin, end;
    double scale; /* m, how high the lowest layer's top is */
} nb_under;

static int find_under(const nebel_cloud_lighting *view, const nebel_ray *ray, const double unit[3], nb_under *under)
{
    const nebel_atmosphere *atmosphere = view->clouds->atmosphere;
    const double ground = atmosphere->airs.radius;
    const int lowest = layer_over(view->clouds, 0);
    double pieces[2][2];
    memcpy(under->unit, unit, sizeof under->unit);
    nb_air_from_center(atmosphere, ray->origin, under->from);
    nb_air_raise(ground, under->from);
    const double end = fmin(ray->t_max, nb_cloud_to_ground(ground, under->from, unit));
    if (lowest < 0 || !nb_cloud_pieces(0, view->high, under->from, unit, end, pieces)) return 0;
    under->begin = pieces[0][0];
    under->end = pieces[0][1];
    under->scale = view->clouds->layers[lowest].high - ground;
    return 1;
}

static void find_middle(const nb_under *under, double t, double next, double place[3])
{
    for (int c = 0; c < 3; c++) place[c] = under->from[c] + 0.5 * (t + next) * under->unit[c];
}

static void shade(nebel_cloud_workspace *workspace, const nebel_ray *ray, const double unit[3], nebel_air_shadow *shade)
{
    nb_under under;
    int is_shaded = 0;
    shade->count = 0;
    if (!find_under(workspace->view, ray, unit, &under)) return;
    const double begin = under.begin, far = under.end, scale = under.scale;
    double t = begin;
    shade->t[0] = (float)begin;
    for (int i = 0; i < NEBEL_MAX_AIR_SHADOW_SEGMENTS && t < far; i++) {
        const double next = i < NEBEL_MAX_AIR_SHADOW_SEGMENTS - 1 ? fmin(far, begin + ends[i] * scale) : far;
        const double width = fmax(LEAST_WIDTH * scale, fmax(WIDTH_PART * (next - t), FAR_PART * t));
        double place[3];
        find_middle(&under, t, next, place);
        find_parts(workspace, place, (float)width, shade->transmittance[i]);
        for (int c = 0; c < 3; c++) is_shaded |= shade->transmittance[i][c] < 1;
        shade->t[i + 1] = (float)next;
        shade->count++;
        t = next;
    }
    if (!is_shaded) shade->count = 0;
}

nebel_result nebel_trace_cloud_shadow_on_air(nebel_cloud_workspace *workspace, size_t n, const nebel_ray *rays,
                                             size_t ray_stride, nebel_air_shadow *shades, size_t shade_stride)
{
    if (workspace == NULL || (n > 0 && (rays == NULL || shades == NULL))) return NEBEL_ERROR_ARGUMENT;
    ray_stride = nb_stride_of(ray_stride, sizeof *rays);
    shade_stride = nb_stride_of(shade_stride, sizeof *shades);
    for (size_t i = 0; i < n; i++) {
        const nebel_ray *ray = nb_stride_from(rays, ray_stride, i);
        double unit[3];
        if (!nb_air_is_ray(ray, unit)) return NEBEL_ERROR_ARGUMENT;
        shade(workspace, ray, unit, nb_stride_to(shades, shade_stride, i));
    }
    return NEBEL_OK;
}

/* Below clouds their shadow is that of the place where the way to the sun enters them. */
nebel_result nebel_compute_cloud_sun_transmittance(nebel_cloud_workspace *workspace, double width, size_t n,
                                                   const double (*places)[3], size_t place_stride, float *parts)
{
    if (workspace == NULL || (n > 0 && (places == NULL || parts == NULL)) || !(width >= 0 && width <= NEBEL_MAX_LENGTH))
        return NEBEL_ERROR_ARGUMENT;
    const nebel_cloud_lighting *view = workspace->view;
    const nebel_clouds *clouds = view->clouds;
    const double *sun = view->sun.direction, least = fmax(width, 1e-3 * (view->high - view->low));
    place_stride = nb_stride_of(place_stride, sizeof *places);
    for (size_t i = 0; i < n; i++) {
        const double *place = nb_stride_from(places, place_stride, i);
        double from[3], pieces[2][2];
        parts[i] = 1;
        if (!nb_air_is_place(place)) return NEBEL_ERROR_ARGUMENT;
        nb_air_from_center(clouds->atmosphere, place, from);
        if (!nb_cloud_pieces(view->low, view->high, from, sun, HUGE_VAL, pieces)) continue;
        for (int c = 0; c < 3; c++) from[c] += pieces[0][0] * sun[c];
        const float depth = nb_cloud_sun_depth_at(workspace, from, (float)fmax(least, 0.005 * pieces[0][0]));
        const double cosine = nb_vector_dot(from, sun) / nb_vector_length(from);
        if (depth > 0) parts[i] = nb_cloud_part_through(&clouds->layers[0], depth, cosine);
    }
    return NEBEL_OK;
}

nebel_result nebel_compute_cloud_sky_transmittance(nebel_cloud_workspace *workspace, double width, size_t n,
                                                   const double (*places)[3], size_t place_stride, float *parts)
{
    if (workspace == NULL || (n > 0 && (places == NULL || parts == NULL)) || !(width >= 0 && width <= NEBEL_MAX_LENGTH))
        return NEBEL_ERROR_ARGUMENT;
    const nebel_clouds *clouds = workspace->view->clouds;
    place_stride = nb_stride_of(place_stride, sizeof *places);
    for (size_t i = 0; i < n; i++) {
        const double *place = nb_stride_from(places, place_stride, i);
        double from[3];
        if (!nb_air_is_place(place)) return NEBEL_ERROR_ARGUMENT;
        nb_air_from_center(clouds->atmosphere, place, from);
        const double radius = nb_vector_length(from);
        const int k = layer_over(clouds, radius);
        const double least = LEAST_WIDTH * (workspace->view->high - clouds->atmosphere->airs.radius);
        parts[i] = k < 0 ? 1 : roof_over(workspace, k, from, radius, (float)fmax(least, width)).up;
    }
    return NEBEL_OK;
}

/* ---- fog ------------------------------------------------------------------------------------- */

/* Pieces are so long where fog begins and where the ray ends, in heights of the lowest layer's top, and so much longer for the way
 * from the nearer of both: most fog is seen around the eye, or lies on the ground. */
#define FIRST_PIECE 0.06
#define PIECE_GROWTH 0.18

/* Over piece i. */
static void shade_piece(nebel_cloud_workspace *workspace, const double place[3], float width, int i,
                        nebel_fog_shadow *shade)
{
    const double radius = nb_vector_length(place);
    const int k = layer_over(workspace->view->clouds, radius);
    nb_cloud_cover_transmittance roof = {1, 1}, wide = roof;
    if (k >= 0) {
        roof = roof_over(workspace, k, place, radius, width);
        wide = roof_over(workspace, k, place, radius, 2 * width);
    }
    shade->sun_transmittance[i] = roof.sun;
    shade->sky_transmittance[i] = roof.up;
    shade->error[i] = nb_larger(fabsf(wide.sun - roof.sun), fabsf(wide.up - roof.up));
}

nebel_result nebel_trace_cloud_shadow_on_fog(nebel_cloud_workspace *workspace, const nebel_ray *ray, double begin,
                                             double spread, nebel_fog_shadow *shade)
{
    nb_under under;
    double unit[3];
    int is_shaded = 0;
    if (workspace == NULL || ray == NULL || shade == NULL || !(begin >= 0) || !(spread >= 0 && spread <= 10) ||
        !nb_air_is_ray(ray, unit))
        return NEBEL_ERROR_ARGUMENT;
    shade->count = 0;
    if (!find_under(workspace->view, ray, unit, &under)) return NEBEL_OK;
    const double first = fmax(begin, under.begin), scale = under.scale;
    double t = first;
    shade->t[0] = (float)first;
    for (int i = 0; i < NEBEL_MAX_FOG_SHADOW_SEGMENTS && t < under.end; i++) {
        const double length = FIRST_PIECE * scale + PIECE_GROWTH * fmax(0, fmin(t - first, under.end - t));
        const double next = i < NEBEL_MAX_FOG_SHADOW_SEGMENTS - 1 ? fmin(under.end, t + length) : under.end;
        const double width = fmax(LEAST_WIDTH * scale, fmax(WIDTH_PART * (next - t), spread * t));
        double place[3];
        find_middle(&under, t, next, place);
        shade_piece(workspace, place, (float)width, i, shade);
        is_shaded |= shade->sun_transmittance[i] < 1 || shade->sky_transmittance[i] < 1 || shade->error[i] > 0;
        shade->t[i + 1] = (float)next;
        shade->count++;
        t = next;
    }
    if (!is_shaded) shade->count = 0;
    return NEBEL_OK;
}
