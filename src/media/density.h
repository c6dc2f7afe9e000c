/* The density of a volume at a place. */
#ifndef NB_MEDIA_DENSITY_H
#define NB_MEDIA_DENSITY_H

#include "volume.h"

/* What fraction of its extinction the volume has at `place` [m]: 0 outside. */
double nb_density_at(const nb_volume *volume, const double place[3]);

#endif
