/* The commands of the program; main.c lists them. */
#ifndef NB_COMMANDS_H
#define NB_COMMANDS_H

#include "options.h"

extern const nb_command nb_commands_render;
extern const nb_command nb_commands_fog;
extern const nb_command nb_commands_trace;
extern const nb_command nb_commands_view;
extern const nb_command nb_commands_info;
extern const nb_command nb_commands_compare;
#if defined(NEBEL_HAVE_BENCH)
extern const nb_command nb_commands_bench;
#endif

#endif
