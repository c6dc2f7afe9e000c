/* Results of `nebel fog` that would write over each other. */
#ifndef NB_FOG_TWICE_H
#define NB_FOG_TWICE_H

#include "fog_names.h"

/* NB_MISUSED after a message if two results are one file, by one name or by two that lead to one place: through links, or
 * through folders that are not there yet. NB_FAILED after a message if memory is out. */
int nb_fog_check_twice(const nb_fog_list *list);

#endif
