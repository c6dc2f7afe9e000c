/* Moving a camera by hand. Every function keeps it valid: apart from what it looks at, and upright. */
#ifndef NB_TOOLS_VIEWER_CAMERA_CONTROL_H
#define NB_TOOLS_VIEWER_CAMERA_CONTROL_H

#include <nebel/scene.h>

/* Turns the eye about what it looks at; `right` about the camera's up, `up` against it [radians]. */
void nb_navigate_orbit(nebel_camera *camera, double right, double up);

/* Turns the view about the eye [radians]. */
void nb_navigate_look(nebel_camera *camera, double right, double up);

/* Moves eye and aim across the view, in heights of the picture at the aim's distance. */
void nb_navigate_pan(nebel_camera *camera, double right, double up);

/* Multiplies the distance to the aim; in an orthographic view what its height shows. */
void nb_navigate_dolly(nebel_camera *camera, double factor);

/* Moves eye and aim along the camera's own axes [m]: right, up, forward. */
void nb_navigate_fly(nebel_camera *camera, const double way[3]);

double nb_navigate_distance(const nebel_camera *camera);

/* To a hundred-thousandth of the distance: nobody sees the difference, and files stay readable. */
nebel_camera nb_navigate_round(nebel_camera camera);

#endif
