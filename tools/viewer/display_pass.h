/* Pictures to the window: tone curve, split, difference. */
#ifndef NB_TOOLS_VIEWER_DISPLAY_PASS_H
#define NB_TOOLS_VIEWER_DISPLAY_PASS_H

#include "display.h"

#include <nebel/nebel.h>

typedef struct nb_display_pass {
    unsigned program, array;
    unsigned cpu_texture;
} nb_display_pass;

nebel_result nb_screen_open(const nebel_log *log, nb_display_pass *screen);

/* Fine with zeros. */
void nb_screen_close(nb_display_pass *screen);

/* The picture of the CPU: rgb, the top row first. */
void nb_screen_set_cpu(nb_display_pass *screen, uint32_t width, uint32_t height, const float *rgb);

/* Fills the window's framebuffer. `gl_texture` has the plane of the look, lowest row first; without a picture of the
 * CPU
 * (`has_cpu` 0) that of OpenGL is everywhere. */
void nb_screen_draw(const nb_display_pass *screen, unsigned gl_texture, int has_cpu, const nb_display *look,
                    uint32_t width, uint32_t height);

#endif
