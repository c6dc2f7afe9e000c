/* What a description may hold. */
#ifndef NB_MEDIUM_MEDIUM_CHECK_H
#define NB_MEDIUM_MEDIUM_CHECK_H

#include "base/base.h"

#include <nebel/nebel.h>

nebel_result nb_check_volume(const nebel_log *log, const nebel_volume_desc *desc);
nebel_result nb_check_color(const nebel_log *log, const char *what, const double color[3], double largest);

#endif
