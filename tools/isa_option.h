/* Instruction sets by name. */
#ifndef NB_TOOLS_ISA_OPTION_H
#define NB_TOOLS_ISA_OPTION_H

#include "options.h"

#include <nebel/nebel.h>

/* The value of an option --isa; DEFAULT where it is not given. What is unknown, or what this processor or this build
 * does not have, is reported as the other options' values are. */
nebel_isa nb_isa_choose(nb_arguments *arguments, int option);

/* What DEFAULT stands for on this processor. */
nebel_isa nb_isa_best(void);

#endif
