#include "isa.h"

#include "report.h"

nebel_isa nb_isa_choose(nb_arguments *arguments, int option)
{
    const char *names[NEBEL_ISA_COUNT];
    int count = 0;
    for (int isa = NEBEL_ISA_SCALAR; isa < NEBEL_ISA_COUNT; isa++) names[count++] = nebel_isa_name((nebel_isa)isa);
    names[count] = NULL;
    return (nebel_isa)(1 + nb_options_choice(arguments, option, names, NEBEL_ISA_DEFAULT - 1));
}

int nb_isa_check(const char *command, nebel_isa isa)
{
    if (isa == NEBEL_ISA_DEFAULT || nebel_isa_available(isa)) return NB_DONE;
    return nb_report_failure("%s: --isa: %s is not available here; 'nebel info' lists what is", command,
                             nebel_isa_name(isa));
}

nebel_isa nb_isa_best(void)
{
    nebel_isa best = NEBEL_ISA_DEFAULT;
    for (int isa = NEBEL_ISA_SCALAR; isa < NEBEL_ISA_COUNT; isa++) {
        if (nebel_isa_available((nebel_isa)isa)) best = (nebel_isa)isa;
    }
    return best;
}
