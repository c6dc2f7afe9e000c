#include "air.h"

#include <math.h>

#define NB_DOUBLE
#include "formulas/prelude.h"

#include "formulas/elementary.inc"
#include "formulas/planet.inc"

double nb_air_density(const nb_air *air, double height)
{
    if (air->scale > 0) return nb_exp(-height / air->scale);
    return fmax(0, 1 - fabs(height - air->center) / air->width);
}

/* ---- shells ---------------------------------------------------------------------------------- */

/* Not where there is one close by. */
static void add_shell(nb_airs *airs, double height)
{
    if (!(height > 0 && height < airs->top - airs->radius)) return;
    for (int i = 0; i < airs->shell_count; i++)
        if (fabs(airs->shells[i] - airs->radius - height) < 0.3 * height) return;
    airs->shells[airs->shell_count++] = airs->radius + height;
}

/* The edges of layers; else shells are thin near the ground, where the air changes most. */
int nb_airs_are_empty(const nb_airs *airs)
{
    for (int k = 0; k < airs->count; k++)
        for (int c = 0; c < 3; c++)
            if (airs->airs[k].extinction[c] > 0) return 0;
    return 1;
}

void nb_airs_cut(nb_airs *airs)
{
    airs->shell_count = 0;
    for (int i = 0; i < airs->count; i++) {
        const nb_air *air = &airs->airs[i];
        if (air->scale > 0) continue;
        for (int k = -1; k <= 1; k++) add_shell(airs, air->center + k * air->width);
    }
    for (int i = 1; i < 4; i++) add_shell(airs, (airs->top - airs->radius) * (i * i * i) / 64);
}

/* ---- where rays go --------------------------------------------------------------------------- */

nb_track nb_track_ahead(nb_track track, double length)
{
    return (nb_track){sqrt(fmax(0, track.radius * track.radius + length * (2 * track.rise + length))),
                      track.rise + length};
}

/* The square of half the chord that a sphere cuts off the ray's line; below 0 where they do not meet. */
static double half_chord_square(nb_track track, double sphere)
{
    return (sphere - track.radius) * (sphere + track.radius) + track.rise * track.rise;
}

double nb_track_leave(nb_track track, double sphere)
{
    return fmax(0, sqrt(fmax(0, half_chord_square(track, sphere))) - track.rise);
}

double nb_track_enter(nb_track track, double sphere)
{
    const double square = half_chord_square(track, sphere);
    if (!(track.rise < 0 && square > 0)) return HUGE_VAL;
    return fmax(0, (track.radius - sphere) * (track.radius + sphere) / (sqrt(square) - track.rise));
}

/* ---- optical depth --------------------------------------------------------------------------- */

/* How far a ray that goes up has come when it is `height` above its start. */
static double reach_height(nb_track track, double height)
{
    const double climb = fmax(0, height) * (2 * track.radius + height);
    return climb > 0 ? climb / (track.rise + sqrt(track.rise * track.rise + climb)) : 0;
}

/* The density of a layer integrated from a to b, between which it has no edge: it is nearly a parabola of the way. */
static double layer_piece(const nb_air *air, nb_track track, double height, double a, double b)
{
    static const double nodes[] = {0.2386191860831969, 0.6612093864662645, 0.9324695142031521};
    static const double weights[] = {0.4679139345726910, 0.3607615730481386, 0.1713244923791704};
    const double half = 0.5 * (b - a);
    double sum = 0;
    for (int i = 0; i < 6; i++) {
        const double s = a + half * (1 + (i % 2 ? nodes[i / 2] : -nodes[i / 2]));
        sum += weights[i / 2] * nb_air_density(air, height + nb_air_height(track.radius, track.rise, s));
    }
    return half * sum;
}

static double layer_length(const nb_air *air, nb_track track, double height, double length)
{
    const double edges[] = {air->center - air->width, air->center, air->center + air->width};
    double from = fmin(reach_height(track, edges[0] - height), length), sum = 0;
    for (int i = 1; i < 3; i++) {
        const double to = fmin(reach_height(track, edges[i] - height), length);
        if (to > from) sum += layer_piece(air, track, height, from, to);
        from = fmax(from, to);
    }
    return sum;
}

/* Adds the depth of `length` m of a ray that goes up. */
static void add_rising(const nb_airs *airs, nb_track track, double length, double depth[3])
{
    const double height = track.radius - airs->radius;
    for (int i = 0; i < airs->count; i++) {
        const nb_air *air = &airs->airs[i];
        const double dense =
            air->scale > 0 ? nb_air_density(air, height) * nb_air_length(track.radius, track.rise, air->scale, length)
                           : layer_length(air, track, height, length);
        for (int c = 0; c < 3; c++) depth[c] += air->extinction[c] * dense;
    }
}

/* From the lowest place on, up on both sides. */
void nb_track_depth(const nb_airs *airs, nb_track track, double length, double depth[3])
{
    for (int c = 0; c < 3; c++) depth[c] = 0;
    if (track.rise >= 0) {
        add_rising(airs, track, length, depth);
    } else if (length <= -track.rise) {
        const nb_track end = nb_track_ahead(track, length);
        add_rising(airs, (nb_track){end.radius, -end.rise}, length, depth);
    } else {
        const nb_track lowest = {nb_track_ahead(track, -track.rise).radius, 0};
        add_rising(airs, lowest, -track.rise, depth);
        add_rising(airs, lowest, length + track.rise, depth);
    }
}

void nb_track_sunlight(const nb_airs *airs, nb_track track, double light[3])
{
    if (nb_track_enter(track, airs->radius) < HUGE_VAL) {
        light[0] = light[1] = light[2] = 0;
        return;
    }
    double depth[3];
    nb_track_depth(airs, track, nb_track_leave(track, airs->top), depth);
    for (int c = 0; c < 3; c++) light[c] = nb_exp(-depth[c]);
}
