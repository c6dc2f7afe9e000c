// The controls of fog: volumes, their shapes and densities, nebulae, cells. C++: behind panel.h only.
#ifndef NB_TOOLS_VIEWER_FOG_PANEL_H
#define NB_TOOLS_VIEWER_FOG_PANEL_H

#include "panel.h"

// `reach` is how far away what is looked at is [m]: what steps are measured by.
void draw_fog(nb_panel *panel, double reach);
void draw_nebulae(nb_panel *panel, double reach);
void draw_cells(nb_panel *panel, double reach);

// A shape with all its numbers, parts and planes; `may_change`: into one of another type, too. Returns whether
// something has changed.
bool draw_shape(nb_panel *panel, nebel_shape *shape, double reach, bool may_change);

// Position, rotation and scale.
bool draw_transform(nebel_transform *transform, double reach);
bool draw_rotation(double rotation[4]);

// A new kind of density starts where the camera looks. `moves`: noise may do so.
bool draw_density(nb_panel *panel, nebel_density *density, double reach, bool moves);

#endif
