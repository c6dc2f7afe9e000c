/* Mouse and keys, as far as they are not the panel's: to the camera, to what is shown, and to wishes. */
#ifndef NB_TOOLS_VIEWER_INPUT_H
#define NB_TOOLS_VIEWER_INPUT_H

#include "display.h"
#include "window.h"

#include <nebel/scene.h>

typedef enum nb_drag_mode {
    NB_HANDS_FREE = 0,
    NB_HANDS_ORBIT,
    NB_HANDS_PAN,
    NB_HANDS_LOOK,
    NB_HANDS_SPLIT,
    NB_HANDS_ELSEWHERE /* a button went down where it is not ours */
} nb_drag_mode;

typedef struct nb_input {
    double x, y; /* of the cursor, in heights of the window from its upper left corner */
    nb_drag_mode grip;
    int button;         /* that took hold */
    unsigned keys_down; /* of those that fly, a bit each */

    /* Answers of the last nb_input_move. */
    int moved_camera, changed_look;
    int wants_home, wants_help, wants_panel, wants_picture, wants_window_picture, wants_save, wants_reload, wants_undo,
        wants_redo, wants_end, wants_play;
    int steps; /* 1: to the next frame, -1: to the one before */
} nb_input;

/* Takes what has happened since the last turn, and what is held down. */
void nb_input_move(nb_input *hands, nb_window *window, nebel_camera *camera, nb_display *look);

/* Whether something moves as long as nothing happens. */
int nb_input_are_busy(const nb_input *hands);

#endif
