/* What an atmosphere is made of, for those who ask for its light. */
#ifndef NB_PLANET_ATMOSPHERE_H
#define NB_PLANET_ATMOSPHERE_H

#include "rule.h"
#include "scatter.h"

struct nebel_atmosphere {
    nebel_allocator allocator;
    double center[3];
    nb_airs airs;
    nb_rule rule;
    nb_scatter scatter;
    double share_off; /* how much of light that was scattered often may be wrong for want of entries and directions */
};

/* What a ray gathers for a sun of irradiance 1: scattered once; more often; and about how much of that is missing for
 * want of moments, and in twilight for want of entries. */
typedef struct nb_gathered {
    double once[3], often[3], missing[3];
} nb_gathered;

/* `aspect` is that of the ray's direction where it starts; the ray must stay within the air for `length`. */
void nb_gather(const nebel_atmosphere *atmosphere, nb_track track, nb_aspect aspect, double length,
               nb_gathered *gathered);

#endif
