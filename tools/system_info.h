/* What the program was made by and runs on. */
#ifndef NB_TOOLS_SYSTEM_INFO_H
#define NB_TOOLS_SYSTEM_INFO_H

#include <stddef.h>

/* "gcc 12.2.0". */
const char *nb_machine_compiler(void);

/* The name that Linux gives the processor; "unknown" elsewhere. */
void nb_machine_read_processor(char *name, size_t size);

#endif
