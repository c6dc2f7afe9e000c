/* What the window shows, as a file. */
#ifndef NB_TOOLS_VIEWER_SCREENSHOT_H
#define NB_TOOLS_VIEWER_SCREENSHOT_H

#include <nebel/scene.h>

/* Writes the framebuffer that is being drawn, before it is shown. Returns an exit status; the log has said why. */
int nb_picture_write(const char *path, uint32_t width, uint32_t height, const nebel_log *log);

/* The first of nebel-1.png, nebel-2.png, ... that is no file yet. 0, or -1 where all are taken. */
int nb_picture_name(char *name, size_t size);

#endif
