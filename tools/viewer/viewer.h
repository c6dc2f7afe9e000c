/* nebel view: a window on a scene. */
#ifndef NB_TOOLS_VIEWER_VIEWER_H
#define NB_TOOLS_VIEWER_VIEWER_H

#include <stdint.h>

typedef struct nb_viewer_options {
    const char *scene;
    uint32_t width, height;
    double exposure; /* stops */
    double frame;
    double scale;           /* of the controls; 0: what the screen says */
    const char *screenshot; /* NULL: none; else the finished picture goes there, and the window closes */
    const char *controls;   /* NULL: none; else a file that says where the controls are */
} nb_viewer_options;

/* Opens the window and stays until it is closed. Returns an exit status; what went wrong was said. */
int nb_view_run(const nb_viewer_options *settings);

#endif
