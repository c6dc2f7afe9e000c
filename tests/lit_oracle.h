/* What the sun, point lights, ambient light and fog itself should add along rays, by brute force in double. No code
 * and no formula file of the library is used but for phase functions, which have tests of their own. */
#ifndef LIT_ORACLE_H
#define LIT_ORACLE_H

#include "lit_fog.h"

/* How closely each stretch of a ray is looked at before it is refined: many panels make it unlikely that two rules agree by
 * chance. */
typedef enum lit_effort { LIT_QUICK, LIT_CLOSE } lit_effort;

typedef struct lit_truth {
    double transmittance[3], in_scattering[3];
    double uncertainty; /* an estimate of how far off in_scattering may be */
} lit_truth;

/* Along a ray of finite t_max. Returns 0 where that takes too long, or doubles do not hold it. */
int lit_oracle_trace(const lit_fog *fog, const nebel_ray *ray, lit_effort effort, lit_truth *truth);

#endif
