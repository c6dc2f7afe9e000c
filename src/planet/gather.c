#include "gather.h"

#include "base/cpu.h"
#include "base/levels.h"

#define KERNEL(NAME, suffix) [NEBEL_ISA_##NAME] = nb_gather_##suffix,
static nb_gather_fn *const kernels[NEBEL_ISA_COUNT + 1] = {NB_LEVELS(KERNEL)};

nb_gather_fn *nb_gather_choose(nebel_isa isa)
{
    return kernels[nb_cpu_choose(isa)];
}
