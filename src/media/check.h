/* What a description may hold. */
#ifndef NB_MEDIA_CHECK_H
#define NB_MEDIA_CHECK_H

#include "base/base.h"

#include <nebel/nebel.h>

/* Beyond these the single-precision arithmetic would overflow; no fog comes near. */
#define NB_LARGEST_AMOUNT 1e9
#define NB_LARGEST_LENGTH 1e15

nebel_result nb_check_volume(const nebel_log *log, const nebel_volume_desc *desc);
nebel_result nb_check_color(const nebel_log *log, const char *what, const double color[3], double largest);

#endif
