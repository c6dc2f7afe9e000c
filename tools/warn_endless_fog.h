/* Scenes whose light reaches nothing: fog without an end on the way to the sun, planets without light. */
#ifndef NB_TOOLS_WARN_ENDLESS_FOG_H
#define NB_TOOLS_WARN_ENDLESS_FOG_H

#include <nebel/scene.h>

/* The number of the first volume, in the order of the scene, behind which there is no sunlight for any fog or model since
 * it goes on for ever towards the sun; or the count of volumes. Volumes that others cut out endlessly far count too. */
size_t nb_find_endless(const nebel_scene_data *scene);

/* What to say of it, behind its name. */
extern const char nb_endless_advice[];

/* Whether ambient light of the scene is other than black. */
int nb_has_ambient(const nebel_scene_data *scene);

/* What to say of a planet that no light is on, or NULL. Air without a sun is black whatever ambient light there is. */
const char *nb_find_dark_planet(const nebel_scene_data *scene);

/* Says both on standard error, where it is so; no quiet hides that. `path` is the scene's. */
void nb_warn_of_darkness(const nebel_scene_data *scene, const char *path);

#endif
