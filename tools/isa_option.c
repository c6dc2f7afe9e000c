#include "isa_option.h"

nebel_isa nb_isa_choose(nb_arguments *arguments, int option)
{
    const char *names[NEBEL_ISA_COUNT];
    int count = 0;
    for (int isa = NEBEL_ISA_SCALAR; isa < NEBEL_ISA_COUNT; isa++) names[count++] = nebel_isa_name((nebel_isa)isa);
    names[count] = NULL;
    const nebel_isa isa = (nebel_isa)(1 + nb_options_choice(arguments, option, names, NEBEL_ISA_DEFAULT - 1));
    if (isa != NEBEL_ISA_DEFAULT && !nebel_isa_available(isa)) {
        nb_options_reject(arguments, option, "is not available here; 'nebel info' lists what is");
    }
    return isa;
}

nebel_isa nb_isa_best(void)
{
    nebel_isa best = NEBEL_ISA_DEFAULT;
    for (int isa = NEBEL_ISA_SCALAR; isa < NEBEL_ISA_COUNT; isa++) {
        if (nebel_isa_available((nebel_isa)isa)) best = (nebel_isa)isa;
    }
    return best;
}
