/* What the air of a planet leaves of the sun, and the light of its sky, by place. */
#ifndef NB_CPU_CPU_IRRADIANCE_H
#define NB_CPU_CPU_IRRADIANCE_H

#include "aerial/irradiance_table.h"

/* What is left of the sun, 0 in the planet's shadow, and how much brighter the sky is than at the scene's origin. */
void nb_irradiance_at(const nb_irradiance_table *daylight, nb_irradiance_receiver of, const double place[3],
                      double sun[3], double sky[3]);

#endif
