/* The controls of the window, by Dear ImGui. The one C++ file of the project is behind this. */
#ifndef NB_PANEL_H
#define NB_PANEL_H

#include "look.h"

#include <nebel/scene.h>

#ifdef __cplusplus
extern "C" {
#endif

/* What the panel shows, and what was done with it. */
typedef struct nb_panel {
    const char *scene;          /* the file's name */
    const char *driver;         /* of OpenGL */
    const nebel_scene *source;  /* as it was read */
    nebel_scene_data *data;     /* camera and light are changed in place */
    nebel_volume_desc *volumes; /* changed in place: those of `data` */
    nb_look *look;
    double *frame;       /* of what moves */
    int moves;           /* whether anything does */
    int camera_is_keyed; /* ... the camera */
    int saves_camera;
    const char *message;   /* "": none */
    const char *picture;   /* what of the picture is done */
    double seconds;        /* that OpenGL took for the last one */
    int is_changed;        /* something is not as the file says */
    int file_is_newer;     /* ... and the file has changed, too */
    int shown, help_shown; /* the controls, the list of keys */

    /* Answers of the last nb_panel_draw. */
    int fog_changed, light_changed, camera_changed, frame_changed, look_changed;
    int wants_save, wants_reload, wants_home;
} nb_panel;

/* `window` is a GLFWwindow whose context of OpenGL is current; its callbacks are chained to. 0, or -1 where memory is
 * out. */
int nb_panel_open(void *window);
void nb_panel_close(void);

/* Draws over the picture and fills in the answers. `controls` is NULL, or takes a line "x y width height name", in
 * pixels, for each control. */
void nb_panel_draw(nb_panel *panel, const char *controls);

/* Whether a press of the mouse, or of a key, is the panel's; x and y in the window's coordinates. */
int nb_panel_has_place(double x, double y);
int nb_panel_has_keys(void);

#ifdef __cplusplus
}
#endif
#endif
