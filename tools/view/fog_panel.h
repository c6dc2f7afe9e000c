// The controls of fog: volumes, their shapes and densities, nebulae, cells. C++: behind panel.h only.
#ifndef NB_FOG_PANEL_H
#define NB_FOG_PANEL_H

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

// `place` is where a new kind of density starts.
bool draw_density(nebel_density *density, const double place[3], double reach);

#endif
