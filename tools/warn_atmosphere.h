/* How deep a planet's air is, and what to say where that is too deep for light that is scattered often. */
#ifndef NB_TOOLS_WARN_ATMOSPHERE_H
#define NB_TOOLS_WARN_ATMOSPHERE_H

#include <nebel/scene.h>

/* Of more than this no light is left that a picture shows. */
#define NB_MAX_DEPTH 80.

/* Whether the planet has air that scatters or absorbs. */
int nb_has_air(const nebel_planet *planet);

/* The optical depths of red, green and blue straight up from the ground, which are infinite where no light comes through; 0 where
 * there is no air. */
void nb_find_air_depth(const nebel_planet *planet, double depth[3]);

/* What to say of air of such depths, or NULL. */
const char *nb_find_deep_air(const double depth[3]);

/* Says it of the scene's planets on standard error; no quiet hides that. `path` is the scene's. */
void nb_warn_of_deep_air(const nebel_scene_data *scene, const char *path);

#endif
