/* The controls of the window, by Dear ImGui. The C++ of the project is behind this. */
#ifndef NB_TOOLS_VIEWER_PANEL_H
#define NB_TOOLS_VIEWER_PANEL_H

#include "document_state.h"
#include "display.h"

#include <nebel/scene.h>

#ifdef __cplusplus
extern "C" {
#endif

/* Noise that follows its control once that is let go: its voxels take time. */
typedef struct nb_deferred_noise {
    unsigned owner; /* whose it is, by Dear ImGui's numbers; 0: nobody's */
    nebel_scene_noise noise;
    double seconds; /* that the last one took to be made */
} nb_deferred_noise;

/* What the panel shows, and what was done with it. */
typedef struct nb_panel {
    const char *scene;                  /* the file's name */
    const char *driver;                 /* of OpenGL */
    nebel_scene_data *data;             /* the camera is changed in place */
    nb_document_state *now;             /* fog and light, changed in place */
    const nebel_volume_origin *origins; /* of the volumes */
    const char *const *cell_names;
    const nebel_scene_model *models; /* of the file: their names */
    const nebel_scene *loaded;       /* that makes noise */
    nb_deferred_noise held_noise;
    nb_display *look;
    const char *note;    /* why the picture is not what was chosen; "": it is */
    const char *reason;  /* ... in the words of OpenGL; "": none */
    double *frame;       /* of what moves */
    double frames[2];    /* the first and the last at which anything moves; the same: nothing does */
    int plays;           /* the frame goes on by itself */
    int camera_is_keyed; /* the camera moves by its keys, or turns */
    int saves_camera;
    const char *message; /* "": none */
    int is_fault;        /* the message says what went wrong */
    const char *picture; /* what of the picture is done */
    double seconds;      /* that OpenGL took for the last one */
    unsigned samples;    /* ... with so many for each pixel; 0: it draws none */
    double cpu_seconds;  /* ... the CPU; 0: there is none */
    int has_past, has_future;
    int is_changed;        /* something is not as the file says */
    int file_is_newer;     /* ... and the file has changed, too */
    int shown, help_shown; /* the controls, the list of keys */

    /* Answers of the last nb_panel_draw. */
    int fog_changed, camera_changed, frame_changed, look_changed;
    int wants_save, wants_reload, wants_home, wants_undo, wants_redo, wants_picture;
    int steps;            /* frames, on or back */
    int is_held;          /* a control is being changed: more will follow */
    int is_out_of_memory; /* something could not be added */
    int has_read_message; /* it may go */
} nb_panel;

/* `window` is a GLFWwindow whose context of OpenGL is current; its callbacks are chained to. `scale` is the size of the
 * controls, 1 on a screen of 96 pixels per inch. 0, or -1 where memory is out. */
int nb_panel_open(void *window, double scale);
void nb_panel_close(void);

/* Draws over the picture and fills in the answers. `controls` is NULL, or takes a line "x y width height name", in
 * pixels, for each control; the name of the first is "(typing)" while keys go into one, "(notice)" and "(keys)" are
 * the windows with messages and with the list of keys, and the last is "(list N)", which counts drawings. */
void nb_panel_draw(nb_panel *panel, const char *controls);

/* Tells of a key, or a button of the mouse, that went down, by GLFW's numbers: it, or Ctrl, may have come up before the
 * panel is drawn again, which Dear ImGui would not notice. */
void nb_panel_press_key(int key, int modifiers);
void nb_panel_press_button(int modifiers);

/* Whether a press of the mouse, or of a key, is the panel's; x and y in the window's coordinates. */
int nb_panel_has_place(double x, double y);
int nb_panel_has_keys(void);

#ifdef __cplusplus
}
#endif
#endif
