/* Descriptions of atmospheres: defaults filled in, rules held. */
#ifndef NB_ATMOSPHERE_ATMOSPHERE_CHECK_H
#define NB_ATMOSPHERE_ATMOSPHERE_CHECK_H

#include "base/base.h"

#include <nebel/planet.h>

/* The description with every default in its place. */
nebel_atmosphere_desc nb_atmosphere_resolve(const nebel_atmosphere_desc *desc);

/* OK, or VALUE with a message of what is wrong with a resolved one. */
nebel_result nb_atmosphere_check(const nebel_atmosphere_desc *desc);

#endif
