/* The method of a frame, and its numbers. */
#ifndef NB_GL_METHOD_H
#define NB_GL_METHOD_H

#include "base/device.h"

#include <nebel/gl.h>

typedef struct nb_method {
    nebel_gl_method kind;
    int replaces_fog;         /* the renderer's fog and particles neither are drawn nor dim the sun */
    int has_factor;           /* of pixels or of vertices */
    nebel_factor_desc factor; /* resolved, or the device's numbers as they stand */
    nebel_vertex_desc look;   /* of FOG_COORD, TWO_PASS and ALPHA; resolved */
    nebel_d3d9_fog d3d9;      /* switched on */
    nb_device_planes planes;  /* of D3D9 */
    int blends_stored;        /* see nebel_method_blends_stored; colors of `factor` are then as they are stored */
} nb_method;

/* The numbers of a known method. Errors: ARGUMENT (some are missing), VALUE. */
nebel_result nb_method_set(nb_method *method, const nebel_gl_frame_desc *desc);

int nb_method_takes_cells(nebel_gl_method kind);

/* Whether a factor goes by what NEBEL_VERTEX_COORDINATE gives. */
int nb_method_is_by_user(const nb_method *method);

/* Whether vertices bring the fog. */
int nb_method_is_by_vertex(const nb_method *method);

/* What hardware is given of volumes. */
nebel_vertex_format nb_method_format(const nb_method *method);

#endif
