// The controls of what stands around the fog: time, models, point lights, light, classic fog, camera. C++: behind
// panel.h only.
#ifndef NB_TOOLS_VIEWER_SCENE_PANEL_H
#define NB_TOOLS_VIEWER_SCENE_PANEL_H

#include "panel.h"

// `reach` is how far away what is looked at is [m]: what steps are measured by.
void draw_time(nb_panel *panel);
void draw_models(nb_panel *panel, double reach);
void draw_point_lights(nb_panel *panel, double reach);
void draw_point_lights(nb_panel *panel);
void draw_classic(nb_panel *panel, double reach);
void draw_camera(nb_panel *panel, double reach);

#endif
