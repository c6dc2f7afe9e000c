/* The picture of OpenGL: small while things move, whole when they rest, then with more samples. */
#ifndef NB_TOOLS_VIEWER_GL_PREVIEW_H
#define NB_TOOLS_VIEWER_GL_PREVIEW_H

#include "display.h"

#include <nebel/gl.h>

typedef enum nb_preview_quality {
    NB_STAGE_STALE = 0, /* nothing of what it should show */
    NB_STAGE_COARSE,    /* fewer pixels than the window */
    NB_STAGE_WHOLE,     /* one sample for each pixel */
    NB_STAGE_FINE       /* as many as wanted */
} nb_preview_quality;

typedef struct nb_gl_preview {
    nebel_gl_renderer *renderer;
    nb_preview_quality state;
    unsigned texture, target, program, array; /* the plane to be shown, RGBA32F, and what draws it */
    uint32_t width, height;                   /* of the texture */
    nb_display_plane plane;                   /* what is in it */
    double pixel_seconds;                     /* of the last coarse or whole frame */
    double seconds;                           /* of the last frame that was finished */
    uint32_t samples;                         /* of that frame */
    double time;                              /* that layers have turned by */
    const nebel_cells *cells;                 /* of the method of that name */
    const nebel_factor_desc *factor;          /* of the methods that have one */
    int was_quick;                            /* the last frame did without what takes long for a new eye */
    int was_stopped;                          /* the fine picture was given up */
    int (*is_needed)(void *user);             /* nonzero: something happens, give up the fine picture */
    void *user;
} nb_gl_preview;

/* In a current context of OpenGL 3.3 core, without fog. `scene` must outlive the stage. */
nebel_result nb_gl_preview_open(const nebel_scene_data *scene, const nebel_log *log, nb_gl_preview *stage);

/* Fine with zeros. */
void nb_gl_preview_close(nb_gl_preview *stage);

/* Draws the next better picture. `moving`: another one will follow soon, so this one has to be quick. Where the fine
 * picture was given up the one before stays. */
nebel_result nb_gl_preview_draw(nb_gl_preview *stage, const nebel_camera *camera, uint32_t width, uint32_t height,
                                const nb_display *look, int moving);

#endif
