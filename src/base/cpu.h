/* Which instruction sets this processor and its operating system allow. */
#ifndef NB_BASE_CPU_H
#define NB_BASE_CPU_H

#include <nebel/nebel.h>

/* 1 when the processor can run `isa`; says nothing of what the build holds. DEFAULT and SCALAR always can. */
int nb_cpu_supports(nebel_isa isa);

#endif
