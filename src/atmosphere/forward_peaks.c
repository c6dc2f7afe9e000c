#include "forward_peaks.h"

#include <math.h>
#include <string.h>

#define FOUR_PI 12.566370614359172

/* ---- phase functions ------------------------------------------------------------------------- */

double nb_peak_rest(double g, int orders, double cosine)
{
    const double square = 1 + g * g - 2 * g * cosine;
    double sum = (1 - g * g) / (square * sqrt(square)), power = 1, p = 1, before = 0;
    for (int l = 0; l < orders; l++) {
        const double after = ((2 * l + 1) * cosine * p - l * before) / (l + 1);
        sum -= (2 * l + 1) * power * p;
        before = p;
        p = after;
        power *= g;
    }
    return power > 1e-9 ? sum / power : 0;
}

double nb_peak_ratio(const nb_air_component *air, int orders)
{
    const double last = air->moments[orders - 1], next = air->moments[orders];
    return fabs(last) > fabs(next) ? next / last : 0;
}

/* The smooth part of a phase function, and its peak after several scatterings: moments of 1 up to the orders that are kept, behind
 * which they fall, with each scattering by as much again. Small angles add up: moments of phase functions are multiplied (Wang and
 * Guth, Physical Review 84, 1951). */
static void aim_air(const nb_air_component *air, int orders, double cosine, nb_peaks *peaks, int k)
{
    const double peak = air->peak, ratio = nb_peak_ratio(air, orders);
    double low = 0, kept = 0, p = 1, before = 0, power = ratio, share = 1;
    for (int l = 0; l < orders; l++) {
        const double after = ((2 * l + 1) * cosine * p - l * before) / (l + 1);
        low += (2 * l + 1) * p;
        kept += (2 * l + 1) * air->moments[l] * p;
        before = p;
        p = after;
    }
    peaks->peak[k] = peak;
    peaks->smooth[k] = (kept - peak * low) / FOUR_PI;
    for (int m = 1; m <= NB_PEAK_POWERS; m++) {
        power *= ratio;
        share /= m + 1;
        peaks->turned[k][m] =
            (m < NB_PEAK_POWERS ? share : 1) * peak * (low + nb_peak_rest(power, orders, cosine)) / FOUR_PI;
    }
}

nb_peaks nb_peaks_aim(const nb_gather_job *job)
{
    nb_peaks peaks = {.air_count = job->airs->count, .strays = job->strays};
    for (int k = 0; k < job->airs->count && job->smooth != NULL; k++)
        aim_air(&job->airs->airs[k], job->scatter->orders, job->aspect.sun, &peaks, k);
    return peaks;
}

/* ---- sums ------------------------------------------------------------------------------------ */

/* Below it the rest of the series is nothing. */
#define FEW_TURNS 0.5

/* The rest of (e^t - 1) / t behind the powers that are summed, for the light ahead. */
static double rest_of_series(double straight, double ahead, double t)
{
    double term = straight, rest;
    if (!(t > FEW_TURNS)) return 0;
    rest = (ahead - straight) / t - term;
    for (int m = 1; m < NB_PEAK_POWERS; m++) {
        term *= t / (m + 1);
        rest -= term;
    }
    return fmax(0, rest);
}

static void add_powers(double straight, double ahead, double t, double powers[NB_PEAK_POWERS + 1])
{
    powers[NB_PEAK_POWERS] += rest_of_series(straight, ahead, t);
    for (int m = 0; m < NB_PEAK_POWERS; m++, straight *= t) powers[m] += straight;
}

void nb_peaks_add(const nb_peaks *peaks, const nb_gather_job *job, const nb_node_light *light, int from, int to,
                  nb_peak_sums *sums)
{
    for (int c = 0; c < 3; c++) {
        for (int i = from - job->first; i < to - job->first; i++) {
            sums->often[c] += light->often[c][i];
            sums->missing[c] += light->missing[c][i];
        }
        for (int k = 0; k < peaks->air_count; k++) {
            const double scattering = job->airs->airs[k].scattering[c], *density = job->path->density[k] + job->first;
            for (int i = from - job->first; i < to - job->first && scattering > 0; i++) {
                const double scattered = scattering * density[i], straight = scattered * light->sun[c][i];
                if (job->smooth != NULL) sums->ahead[k][c] += scattered * light->lit[c][i];
                if (peaks->peak[k] > 0)
                    add_powers(straight, scattered * light->ahead[c][i], light->turns[c][i], sums->powers[k][c]);
                else
                    sums->powers[k][c][0] += straight;
            }
        }
    }
}

/* ---- light ----------------------------------------------------------------------------------- */

/* What is off of light that peaks turn. Measured on flat haze of depths 0.1 to 4 and g up to 0.9 the most is 0.65 (test_dense_air). */
#define TURNED_OFF 0.7
/* The same where it is known what strays. */
#define TURNED_OFF_IN_HAZE 0.3

nb_peak_light nb_peaks_before(const nb_peaks *peaks, const nb_peak_sums *before)
{
    const int is_bent = peaks->strays == NB_STRAYS_AND_BENDS; /* then nb_stray_add has it */
    nb_peak_light sum;
    for (int c = 0; c < 3; c++) {
        double turned = 0, size = 0;
        for (int k = 0; k < peaks->air_count; k++) {
            const double *powers = before->powers[k][c];
            const double smooth = (before->ahead[k][c] - powers[0]) * peaks->smooth[k];
            turned += smooth;
            size += fabs(smooth);
            for (int m = 1; m <= NB_PEAK_POWERS && peaks->peak[k] > 0 && !is_bent; m++) {
                turned += powers[m] * peaks->turned[k][m];
                size += fabs(powers[m] * peaks->turned[k][m]);
            }
        }
        sum.light[c] = before->often[c] + turned;
        sum.missing[c] = before->missing[c];
        if (!is_bent) sum.missing[c] += (peaks->strays ? TURNED_OFF_IN_HAZE : TURNED_OFF) * size;
    }
    return sum;
}

void nb_peaks_behind(const nb_peaks *peaks, const nb_peak_sums *behind, const double ground[3], double light[3])
{
    for (int c = 0; c < 3; c++) {
        light[c] = behind->often[c] + ground[c];
        for (int k = 0; k < peaks->air_count; k++) {
            const double *powers = behind->powers[k][c];
            light[c] += behind->ahead[k][c] * peaks->smooth[k];
            for (int m = 1; m < NB_PEAK_POWERS && peaks->peak[k] > 0; m++)
                light[c] += m * powers[m - 1] * peaks->turned[k][m];
            light[c] += powers[NB_PEAK_POWERS] * peaks->turned[k][NB_PEAK_POWERS];
        }
    }
}
