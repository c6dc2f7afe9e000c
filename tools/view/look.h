/* What of a scene the window shows, and how. */
#ifndef NB_LOOK_H
#define NB_LOOK_H

typedef enum nb_look_plane {
    NB_LOOK_COLOR = 0,
    NB_LOOK_TRANSMITTANCE,
    NB_LOOK_IN_SCATTERING,
    NB_LOOK_DEPTH,
    NB_LOOK_PLANES
} nb_look_plane;

typedef enum nb_look_compare {
    NB_LOOK_GL_ALONE = 0,
    NB_LOOK_SPLIT,      /* the CPU's picture left of the line, that of OpenGL right of it */
    NB_LOOK_DIFFERENCE, /* of what the screen would show of both */
    NB_LOOK_COMPARES
} nb_look_compare;

typedef struct nb_look {
    nb_look_plane plane;
    nb_look_compare compare;
    double exposure; /* stops */
    double split;    /* 0 to 1, from the left */
    double gain;     /* of the difference */
    double range;    /* m: the depth that is shown as middle grey */
    int samples;     /* of each pixel, once everything stands still */
} nb_look;

#endif
