#include "optical_depth.h"

#include <math.h>

#define NB_DOUBLE
#include "formulas/prelude.h"

#include "formulas/elementary.inc"
#include "formulas/atmosphere.inc"

#include "optical_depth_lanes.h"

double nb_air_density(const nb_air_component *air, double height)
{
    return nb_density_of(air, height);
}

int nb_air_components_are_empty(const nb_air_components *airs)
{
    for (int k = 0; k < airs->count; k++)
        for (int c = 0; c < 3; c++)
            if (airs->airs[k].extinction[c] > 0) return 0;
    return 1;
}

/* What is scattered straight up, of the color of which it is the most. */
static double scattering_depth(const nb_air_components *airs, const nb_air_component *air)
{
    const double height = airs->top - airs->radius;
    const double met = air->scale > 0 ? air->scale * (1 - nb_exp(-height / air->scale)) : air->width;
    return met * fmax(air->scattering[0], fmax(air->scattering[1], air->scattering[2]));
}

/* In thin air light that peaks turn is seen along level ways alone, and there most of it leaves for the ground or for space. Air of this
 * depth counts half of its peak: found by paths through the Earth's air, of 0.005, where all of it gives up to 10 % too much along the
 * horizon and none of it up to 4 % too little. Hazes of 0.1 and more need it all. */
#define THIN_DEPTH 0.01

/* Of what peaks turn, as an optical depth. The Earth's dust has 0.003, that of Mars 0.2. */
#define HAZY_DEPTH 0.01

int nb_airs_are_hazy(const nb_air_components *airs)
{
    for (int k = 0; k < airs->count; k++)
        if (airs->airs[k].moments[NB_FEW_MOMENTS] * scattering_depth(airs, &airs->airs[k]) > HAZY_DEPTH) return 1;
    return 0;
}

static void set_peaks(nb_air_components *airs, int orders)
{
    for (int k = 0; k < airs->count; k++) {
        nb_air_component *air = &airs->airs[k];
        const double depth = scattering_depth(airs, air);
        air->peak = depth > 0 ? fmax(0, air->moments[orders]) * depth / (depth + THIN_DEPTH) : 0;
    }
}

void nb_air_components_smooth(nb_air_components *airs, int orders, nb_air_components *smooth)
{
    set_peaks(airs, orders);
    *smooth = *airs;
    smooth->is_smooth = 1;
    for (int k = 0; k < airs->count; k++) {
        nb_air_component *air = &smooth->airs[k];
        const double peak = airs->airs[k].peak;
        for (int c = 0; c < 3; c++) {
            air->scattering[c] = (1 - peak) * airs->airs[k].scattering[c];
            air->extinction[c] -= peak * airs->airs[k].scattering[c];
            if (peak * airs->airs[k].scattering[c] > 0) smooth->is_smooth = 0;
        }
        for (int l = 0; l <= NB_MOMENTS; l++)
            air->moments[l] = l < orders ? (airs->airs[k].moments[l] - peak) / (1 - peak) : 0;
    }
}

/* ---- shells ---------------------------------------------------------------------------------- */

static int has_shell(const nb_air_components *airs, double low, double high)
{
    for (int i = 0; i < airs->shell_count; i++) {
        const double height = airs->shells[i] - airs->radius;
        if (height > low && height < high) return 1;
    }
    return 0;
}

static void add_shell(nb_air_components *airs, double height)
{
    if (height > 0 && height < airs->top - airs->radius) airs->shells[airs->shell_count++] = airs->radius + height;
}

/* Of air that is as thick as others shells are as good. */
static void cut_exponential(nb_air_components *airs, double scale)
{
    if (!has_shell(airs, 0.5 * scale, 4 * scale)) add_shell(airs, 2 * scale);
    if (!has_shell(airs, 3 * scale, 12 * scale)) add_shell(airs, 6 * scale);
}

/* The edges of layers; else shells are thin near the ground, where the air changes most. Nodes between two of them see no layer that is
 * thin beside their distance. */
void nb_air_components_cut(nb_air_components *airs)
{
    airs->shell_count = 0;
    for (int i = 0; i < airs->count; i++) {
        const nb_air_component *air = &airs->airs[i];
        for (int k = -1; k <= 1 && !(air->scale > 0); k++) {
            const double edge = air->center + k * air->width, near = 0.01 * air->width;
            if (!has_shell(airs, edge - near, edge + near)) add_shell(airs, edge);
        }
    }
    for (int i = 1; i < 4; i++) {
        const double height = (airs->top - airs->radius) * (i * i * i) / 64;
        if (!has_shell(airs, 0.7 * height, 1.3 * height)) add_shell(airs, height);
    }
    for (int i = 0; i < airs->count; i++)
        if (airs->airs[i].scale > 0) cut_exponential(airs, airs->airs[i].scale);
}

/* ---- where rays go --------------------------------------------------------------------------- */

nb_atmosphere_ray nb_atmosphere_ray_ahead(nb_atmosphere_ray track, double length)
{
    const nb_atmosphere_ray_lanes ahead = nb_tracks_ahead((nb_atmosphere_ray_lanes){track.radius, track.rise}, length);
    return (nb_atmosphere_ray){ahead.radius, ahead.rise};
}

double nb_atmosphere_ray_leave(nb_atmosphere_ray track, double sphere)
{
    return nb_tracks_leave((nb_atmosphere_ray_lanes){track.radius, track.rise}, sphere);
}

double nb_atmosphere_ray_enter(nb_atmosphere_ray track, double sphere)
{
    const double square = nb_half_chord_square((nb_atmosphere_ray_lanes){track.radius, track.rise}, sphere);
    if (!(track.rise < 0 && square > 0)) return HUGE_VAL;
    return fmax(0, (track.radius - sphere) * (track.radius + sphere) / (sqrt(square) - track.rise));
}

/* ---- optical depth --------------------------------------------------------------------------- */

static void add_rising(const nb_air_components *airs, nb_atmosphere_ray track, double length, double depth[3])
{
    double met[NEBEL_MAX_COMPONENTS] = {0};
    nb_add_rising(airs, (nb_atmosphere_ray_lanes){track.radius, track.rise}, length, met);
    for (int c = 0; c < 3; c++) depth[c] += nb_depth_of(airs, met, c);
}

/* From the lowest place on, up on both sides. */
void nb_atmosphere_ray_depth(const nb_air_components *airs, nb_atmosphere_ray track, double length, double depth[3])
{
    for (int c = 0; c < 3; c++) depth[c] = 0;
    if (track.rise >= 0) {
        add_rising(airs, track, length, depth);
    } else if (length <= -track.rise) {
        const nb_atmosphere_ray end = nb_atmosphere_ray_ahead(track, length);
        add_rising(airs, (nb_atmosphere_ray){end.radius, -end.rise}, length, depth);
    } else {
        const nb_atmosphere_ray lowest = {nb_atmosphere_ray_ahead(track, -track.rise).radius, 0};
        add_rising(airs, lowest, -track.rise, depth);
        add_rising(airs, lowest, length + track.rise, depth);
    }
}

void nb_atmosphere_ray_sunlight(const nb_air_components *airs, nb_atmosphere_ray track, double light[3])
{
    nb_tracks_sunlight(airs, (nb_atmosphere_ray_lanes){track.radius, track.rise}, light);
}
