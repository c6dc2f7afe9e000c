/* What of a scene the window shows, and how. */
#ifndef NB_TOOLS_VIEWER_DISPLAY_H
#define NB_TOOLS_VIEWER_DISPLAY_H

#include <nebel/render.h>

typedef enum nb_display_plane {
    NB_LOOK_COLOR = 0,
    NB_LOOK_TRANSMITTANCE,
    NB_LOOK_IN_SCATTERING,
    NB_LOOK_DEPTH,
    NB_LOOK_PLANES
} nb_display_plane;

typedef enum nb_display_compare {
    NB_LOOK_GL_ALONE = 0,
    NB_LOOK_SPLIT,      /* the CPU's picture left of the line, that of OpenGL right of it */
    NB_LOOK_DIFFERENCE, /* of what the screen would show of both */
    NB_LOOK_CPU_ALONE,
    NB_LOOK_COMPARES
} nb_display_compare;

/* How OpenGL draws the particles of nebulae. */
typedef enum nb_display_particles {
    NB_LOOK_AS_SPHERES = 0, /* one by one, from the farthest: a closed form each, overlaps as if they were layers */
    NB_LOOK_AS_DISCS,       /* the same, cut by surfaces after the comparison of depth at five places */
    NB_LOOK_AS_FOG,         /* among the fog, exactly as the CPU does: slow */
    NB_LOOK_PARTICLES
} nb_display_particles;

typedef struct nb_display {
    nebel_method method;
    nb_display_plane plane;
    nb_display_compare compare;
    nb_display_particles particles;
    double exposure; /* stops */
    double split;    /* 0 to 1, from the left */
    double gain;     /* of the difference */
    double range;    /* m: the depth that is shown as middle grey */
    int samples;     /* of each pixel, once everything stands still */
    int rate;        /* frames in a second, where time goes on */
} nb_display;

#endif
