/* Which instruction sets this build, this processor and its operating system allow. */
#ifndef NB_BASE_ISA_H
#define NB_BASE_ISA_H

#include <nebel/nebel.h>

/* The instruction set to run: `isa`, or for DEFAULT the best one; NEBEL_ISA_COUNT where this build or this processor
 * has not got it. */
nebel_isa nb_isa_select(nebel_isa isa);

#endif
