#include "in_scattering.h"

#include "forward_peaks.h"

#include "base/isa.h"
#include "base/isa_list.h"

#include <math.h>

/* The sum of orders is about right for hazy air around the sun (docs/planet.md): others may be worse. */
#define REST_SAFETY 2

/* Phase functions fall from order to order by about the same ratio, and light that was scattered once has it, too. No less than the first
 * order that is left out counts, as others may come from any side. Peaks have their own light: what is left out is not missing. */
static double rest_of(const nb_air_component *air, int orders, double cosine)
{
    const double ratio = nb_peak_ratio(air, orders), next = air->moments[orders];
    return (next > 0 ? 1 - air->peak / next : 1) *
           fmax(2 * orders + 1, REST_SAFETY * fabs(nb_peak_rest(ratio * ratio, orders, cosine)));
}

void nb_gather_aim(nb_gather_job *job)
{
    for (int k = 0; k < job->airs->count; k++)
        job->rest[k] = rest_of(&job->airs->airs[k], job->scatter->orders, job->aspect.sun);
}

#define GATHER_KERNEL(NAME, suffix) [NEBEL_ISA_##NAME] = nb_gather_##suffix,
static nb_gather_fn *const gather_kernels[NEBEL_ISA_COUNT + 1] = {NB_ISA_LIST(GATHER_KERNEL)};

nb_gather_fn *nb_gather_choose(nebel_isa isa)
{
    return gather_kernels[nb_isa_select(isa)];
}
