// The controls of planets: their air, clouds and shells. C++: behind panel.h only.
#ifndef NB_TOOLS_VIEWER_PLANET_PANEL_H
#define NB_TOOLS_VIEWER_PLANET_PANEL_H

#include "panel.h"

void draw_planets(nb_panel *panel);

#endif
