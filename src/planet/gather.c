#include "gather.h"

#include "base/cpu.h"
#include "base/levels.h"

#include <math.h>

#define NB_FOUR_PI 12.566370614359172

/* The sum of orders is about right for hazy air around the sun (docs/planet.md): others may be worse. */
#define REST_SAFETY 2

/* The orders behind those that are kept of a function of Henyey and Greenstein, in units of the first of them. */
static double sum_rest(double x, int orders, double cosine)
{
    const double square = 1 + x * x - 2 * x * cosine;
    double sum = (1 - x * x) / (square * sqrt(square)), power = 1, p = 1, before = 0;
    for (int l = 0; l < orders; l++) {
        const double after = ((2 * l + 1) * cosine * p - l * before) / (l + 1);
        sum -= (2 * l + 1) * power * p;
        before = p;
        p = after;
        power *= x;
    }
    return power > 1e-9 ? sum / power : 0;
}

static double ratio_of(const nb_air *air, int orders)
{
    const double last = air->moments[orders - 1], next = air->moments[orders];
    return fabs(last) > fabs(next) ? next / last : 0;
}

/* Phase functions fall from order to order by about the same ratio, and light that was scattered once has it, too. No less than the first
 * order that is left out counts, as others may come from any side. Peaks have their own light: what is left out is not missing. */
static double rest_of(const nb_air *air, int orders, double cosine)
{
    if (nb_air_peak(air, orders) > 0) return 0;
    const double ratio = ratio_of(air, orders);
    return fmax(2 * orders + 1, REST_SAFETY * fabs(sum_rest(ratio * ratio, orders, cosine)));
}

/* The smooth part of a phase function, and its peak after several scatterings: moments of 1 up to the orders that are kept, behind
 * which they fall, with each scattering by as much again. */
static void aim_peaks(const nb_air *air, int orders, double cosine, double *smooth, double peaks[NB_GATHER_TURNS])
{
    const double peak = nb_air_peak(air, orders), ratio = ratio_of(air, orders);
    double low = 0, kept = 0, p = 1, before = 0, power = ratio;
    for (int l = 0; l < orders; l++) {
        const double after = ((2 * l + 1) * cosine * p - l * before) / (l + 1);
        low += (2 * l + 1) * p;
        kept += (2 * l + 1) * air->moments[l] * p;
        before = p;
        p = after;
    }
    *smooth = (kept - peak * low) / NB_FOUR_PI;
    for (int n = 0; n < NB_GATHER_TURNS; n++) {
        power *= ratio;
        peaks[n] = peak * (low + sum_rest(power, orders, cosine)) / NB_FOUR_PI;
    }
}

void nb_gather_aim(nb_gather_job *job)
{
    for (int k = 0; k < job->airs->count; k++) {
        job->rest[k] = rest_of(&job->airs->airs[k], job->scatter->orders, job->aspect.sun);
        aim_peaks(&job->airs->airs[k], job->scatter->orders, job->aspect.sun, &job->smooth_phase[k],
                  job->peak_phase[k]);
    }
}

#define KERNEL(NAME, suffix) [NEBEL_ISA_##NAME] = nb_gather_##suffix,
static nb_gather_fn *const kernels[NEBEL_ISA_COUNT + 1] = {NB_LEVELS(KERNEL)};

nb_gather_fn *nb_gather_choose(nebel_isa isa)
{
    return kernels[nb_cpu_choose(isa)];
}
