/* What the sun and lamps should add in fog, by brute force in double. No code and no formula file of the library is used
 * but for phase functions, which have tests of their own. */
#ifndef LIT_ORACLE_H
#define LIT_ORACLE_H

#include <nebel/nebel.h>

typedef struct lit_scene {
    const nebel_volume_desc *volumes; /* no `start`, `cutoff`, source, emission; soft edges of boxes and balls */
    size_t volume_count;
    nebel_sun sun; /* irradiance 0: none */
    const nebel_lamp *lamps;
    size_t lamp_count;
    const float *voxels; /* of all grids, x fastest */
    int size[3], is_nearest;
} lit_scene;

/* In-scattering along a ray of finite t_max, each piece of which is cut into so many panels before they are refined: many
 * of them make it unlikely that two rules agree by chance. *uncertainty is an estimate of how far off it may be. Returns
 * 0 where that takes too long. */
int lit_oracle_trace(const lit_scene *scene, const nebel_ray *ray, int panels, double S[3], double *uncertainty);

#endif
