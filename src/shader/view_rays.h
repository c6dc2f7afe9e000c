/* What the room's files share of a view. */
#ifndef NB_SHADER_VIEW_RAYS_H
#define NB_SHADER_VIEW_RAYS_H

#include <nebel/shader.h>

/* Whether its numbers are finite and its rays are those of a projection. */
int nb_view_is_valid(const nebel_view *view);

#endif
