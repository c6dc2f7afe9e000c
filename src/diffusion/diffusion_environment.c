/* Ambient light for diffusion: whether fog dims it, and its moments. */
#include "diffusion.h"

#include <math.h>

#define PI 3.14159265358979323846

int nb_medium_scatters(const nb_medium *medium)
{
    int scatters = 0;
    for (int c = 0; c < 3; c++)
        scatters |= medium->body.lit && medium->body.albedo[c] > 0 && medium->body.extinction[c] > 0;
    return scatters;
}

int nb_medium_is_lit(const nb_medium *medium, const nb_medium_light *lit)
{
    int is_lit = lit->scatters_sun;
    for (int c = 0; c < 3; c++) is_lit |= medium->body.lit && lit->radiance[c] > 0 && medium->body.extinction[c] > 0;
    return is_lit;
}

int nb_environment_is_dimmed(const nebel_lighting *lighting)
{
    const nebel_snapshot *snapshot = lighting->snapshot;
    const nebel_diffusion_desc *desc = &lighting->diffusion_desc;
    double most[3];
    int is_dimmed = lighting->environment.type != NEBEL_ENVIRONMENT_CONSTANT, is_lit = 0;
    nb_environment_most(&lighting->environment, most);
    for (int c = 0; c < 3; c++) is_dimmed |= desc->has_ground && desc->ground_albedo[c] < 1;
    for (size_t i = 0; i < snapshot->medium_count; i++) {
        const nb_volume *body = &snapshot->media[i].body;
        for (int c = 0; c < 3; c++) {
            is_lit |= body->lit && body->albedo[c] * body->extinction[c] * most[c] > 0;
            is_dimmed |= body->extinction[c] > 0 && body->albedo[c] < 1;
        }
    }
    return is_dimmed && is_lit;
}

/* Lebedev's rule of 14 directions, which is exact for all polynomials of the fifth degree: the axes, the corners of a cube.
 * A white surface's radiance is a smooth picture of the sky with the same mean over all directions. */
static void add_reflected(const nebel_environment *sky, const double direction[3], double weight, double sum[3])
{
    double seen[3];
    nebel_evaluate_environment_diffuse(sky, direction, seen);
    for (int c = 0; c < 3; c++) sum[c] += weight * seen[c];
}

static void find_mean(const nebel_environment *sky, double mean[3])
{
    for (int c = 0; c < 3; c++) mean[c] = 0;
    for (int k = 0; k < 6; k++) {
        double axis[3] = {0, 0, 0};
        axis[k / 2] = k % 2 ? -1 : 1;
        add_reflected(sky, axis, 1. / 15, mean);
    }
    for (int k = 0; k < 8; k++) {
        const double corner[3] = {k & 1 ? -1 : 1, k & 2 ? -1 : 1, k & 4 ? -1 : 1};
        add_reflected(sky, corner, 3. / 40, mean);
    }
}

void nb_environment_find_moments(const nebel_environment *sky, double mean[3], nb_environment_moments moments[3])
{
    find_mean(sky, mean);
    for (int a = 0; a < 3; a++) {
        double irradiance[2][3] = {{0}, {0}};
        for (int side = 0; side < 2; side++) {
            double normal[3] = {0, 0, 0};
            normal[a] = side ? -1 : 1;
            add_reflected(sky, normal, PI, irradiance[side]);
        }
        for (int c = 0; c < 3; c++) {
            const double unit = mean[c] > 0 ? 1 / mean[c] : 0;
            moments[c].flux[a] = (irradiance[1][c] - irradiance[0][c]) * unit;
            if (a != 1) continue;
            moments[c].above = irradiance[0][c] * unit;
            moments[c].below = irradiance[1][c] * unit;
        }
    }
}

/* But for rounding. */
static int is_alike(const nb_environment_moments *a, const nb_environment_moments *b)
{
    double off = fmax(fabs(a->above - b->above), fabs(a->below - b->below));
    for (int i = 0; i < 3; i++) off = fmax(off, fabs(a->flux[i] - b->flux[i]));
    return off < 1e-9;
}

int nb_environment_has_colour(const nebel_environment *sky)
{
    double mean[3];
    nb_environment_moments moments[3];
    nb_environment_find_moments(sky, mean, moments);
    return !is_alike(&moments[0], &moments[1]) || !is_alike(&moments[0], &moments[2]);
}
