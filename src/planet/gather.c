#include "gather.h"

#include "base/cpu.h"
#include "base/levels.h"

#include <math.h>

/* The sum of orders is about right for hazy air around the sun (docs/planet.md): others may be worse. */
#define REST_SAFETY 2

/* Phase functions fall from order to order by about the same ratio, and light that was scattered once has it, too: what is left out is the
 * rest of a Henyey and Greenstein function, whose first orders are taken off. In units of the first that is left out, of which no less
 * counts, as others may come from any side. */
static double rest_of(const nb_air *air, int orders, double cosine)
{
    const double last = air->moments[orders - 1], next = air->moments[orders];
    const double ratio = fabs(last) > fabs(next) ? next / last : 0, x = ratio * ratio;
    const double square = 1 + x * x - 2 * x * cosine;
    double sum = (1 - x * x) / (square * sqrt(square)), power = 1, p = 1, before = 0;
    for (int l = 0; l < orders; l++) {
        const double after = ((2 * l + 1) * cosine * p - l * before) / (l + 1);
        sum -= (2 * l + 1) * power * p;
        before = p;
        p = after;
        power *= x;
    }
    const double first = 2 * orders + 1;
    return power > 1e-9 ? fmax(first, REST_SAFETY * fabs(sum) / power) : first;
}

void nb_gather_aim(nb_gather_job *job)
{
    for (int k = 0; k < job->airs->count; k++)
        job->rest[k] = rest_of(&job->airs->airs[k], job->scatter->orders, job->aspect.sun);
}

#define KERNEL(NAME, suffix) [NEBEL_ISA_##NAME] = nb_gather_##suffix,
static nb_gather_fn *const kernels[NEBEL_ISA_COUNT + 1] = {NB_LEVELS(KERNEL)};

nb_gather_fn *nb_gather_choose(nebel_isa isa)
{
    return kernels[nb_cpu_choose(isa)];
}
