#include "cloud_phase.h"

#include <math.h>
#include <string.h>

#define PI 3.14159265358979323846

enum { DIAMETERS = NB_CLOUD_PHASE_DIAMETERS, ANGLES = NB_CLOUD_PHASE_ANGLES, STEPS = NB_CLOUD_PHASE_STEPS };

#define LEAST_DIAMETER 4
#define MOST_DIAMETER 50
#define LOGS_SCALE 2048

/* From 0 straight ahead to 1 straight back, dense at both ends, where the corona and the glory are, and denser behind than before.
 * As place_of of scripts/make_droplets.py. */
static double place_of(double cosine)
{
    const double ahead = sqrt(fmax(0, 0.5 - 0.5 * cosine)), back = sqrt(fmax(0, 0.5 + 0.5 * cosine));
    return 0.2 * 1.02 * ahead / (ahead + 0.02) + 0.15 * (1 - 1.03 * back / (back + 0.03)) + 0.65 * (1 - back);
}

static double angle_at(double place)
{
    double low = 0, high = PI;
    for (int i = 0; i < 50; i++) {
        const double middle = 0.5 * (low + high);
        *(place_of(cos(middle)) < place ? &low : &high) = middle;
    }
    return 0.5 * (low + high);
}

/* ---- the table ------------------------------------------------------------------------------- */

/* Logarithms for a diameter, by the cubic through the four nearest: next to each end once more the angle on its other side. */
static void find_logs(int color, double diameter, double logs[ANGLES + 2])
{
    const double bounded = fmin(MOST_DIAMETER, fmax(LEAST_DIAMETER, diameter));
    const double place = (DIAMETERS - 1) * log(bounded / LEAST_DIAMETER) / log((double)MOST_DIAMETER / LEAST_DIAMETER);
    const int first = (int)fmin(DIAMETERS - 4, fmax(0, floor(place) - 1));
    memset(logs, 0, (ANGLES + 2) * sizeof *logs);
    for (int k = 0; k < 4; k++) {
        double weight = 1.0 / LOGS_SCALE;
        for (int j = 0; j < 4; j++)
            if (j != k) weight *= (place - first - j) / (k - j);
        for (int i = 0; i < ANGLES; i++) logs[i + 1] += weight * nb_cloud_phase_table[color][first + k][i];
    }
    logs[0] = logs[2];
    logs[ANGLES + 1] = logs[ANGLES - 1];
}

/* Catmull and Rom, A Class of Local Interpolating Splines, 1974: between the second and the third. */
static double between(const double at[4], double part)
{
    const double second = 2 * at[0] - 5 * at[1] + 4 * at[2] - at[3], third = 3 * (at[1] - at[2]) + at[3] - at[0];
    return at[1] + 0.5 * part * (at[2] - at[0] + part * (second + part * third));
}

static void set_drops(double diameter, nb_cloud_phase *phase)
{
    double logs[ANGLES + 2];
    for (int c = 0; c < 3; c++) {
        find_logs(c, diameter, logs);
        for (int i = 0; i <= STEPS; i++) {
            const int low = i < STEPS ? i / NB_CLOUD_PHASE_FINER : ANGLES - 2;
            const double part = (double)i / NB_CLOUD_PHASE_FINER - low;
            phase->values[i][c] = (float)exp(between(&logs[low], part));
        }
    }
}

static void set_ice(double diameter, nb_cloud_phase *phase)
{
    const nebel_phase desc = {.type = NEBEL_PHASE_DROPLETS, .diameter = diameter};
    const nb_phase fit = nb_phase_resolve(&desc);
    for (int i = 0; i <= STEPS; i++)
        for (int c = 0; c < 3; c++) phase->values[i][c] = (float)nb_phase_at(&fit, cos(angle_at((double)i / STEPS)));
}

/* ---- integrals ------------------------------------------------------------------------------- */

/* Over the sphere, of Legendre's polynomials times each color; angles are third powers of evenly spread numbers. */
static void integrate(const nb_cloud_phase *phase, double sums[3][NB_CLOUD_PHASE_MOMENTS])
{
    enum { PIECES = 4096 };
    memset(sums, 0, 3 * sizeof *sums);
    for (int i = 0; i < PIECES; i++) {
        const double part = (i + 0.5) / PIECES, angle = PI * part * part * part, cosine = cos(angle);
        const double wide = 2 * PI * sin(angle) * 3 * PI * part * part / PIECES;
        double before = 0, legendre = 1;
        float values[4];
        nb_cloud_phase_at(phase, cosine, values);
        for (int l = 0; l < NB_CLOUD_PHASE_MOMENTS; l++) {
            for (int c = 0; c < 3; c++) sums[c][l] += wide * legendre * (double)values[c];
            const double next = ((2 * l + 1) * cosine * legendre - l * before) / (l + 1);
            before = legendre;
            legendre = next;
        }
    }
}

void nb_cloud_phase_make(nebel_cloud_type kind, double diameter, nb_cloud_phase *phase)
{
    double sums[3][NB_CLOUD_PHASE_MOMENTS];
    if (kind == NEBEL_CLOUD_CIRRUS)
        set_ice(diameter, phase);
    else
        set_drops(diameter, phase);
    for (int i = 0; i <= STEPS; i++) phase->values[i][3] = 0;
    integrate(phase, sums);
    for (int i = 0; i <= STEPS; i++)
        for (int c = 0; c < 3; c++) {
            phase->values[i][c] /= (float)sums[c][0];
            phase->values[i][3] += phase->values[i][c] / 3;
        }
    for (int l = 0; l < NB_CLOUD_PHASE_MOMENTS; l++)
        phase->moments[l] = (sums[0][l] / sums[0][0] + sums[1][l] / sums[1][0] + sums[2][l] / sums[2][0]) / 3;
}

/* ---- lookup ---------------------------------------------------------------------------------- */

void nb_cloud_phase_at(const nb_cloud_phase *phase, double cosine, float values[4])
{
    const double place = STEPS * place_of(cosine);
    const int low = place < STEPS - 1 ? (int)place : STEPS - 1;
    const float part = (float)(place - low);
    for (int c = 0; c < 4; c++)
        values[c] = phase->values[low][c] + part * (phase->values[low + 1][c] - phase->values[low][c]);
}
