/* The layers of a picture, in the order of an EXR's channels. */
#ifndef NB_TOOLS_AOV_H
#define NB_TOOLS_AOV_H

#include <nebel/render.h>

typedef enum nb_aov {
    NB_LAYER_COLOR,
    NB_LAYER_TRANSMITTANCE,
    NB_LAYER_IN_SCATTERING,
    NB_LAYER_DEPTH,
    NB_LAYER_NORMAL,
    NB_LAYER_ERROR,
    NB_LAYER_STANDARD_ERROR,
    NB_LAYER_COUNT
} nb_aov;

enum { NB_MAX_LAYER_CHANNELS = 16 }; /* that one picture has */

typedef struct nb_layer_kind {
    const char *names[3]; /* of its channels */
    uint32_t channels;
} nb_layer_kind;

extern const nb_layer_kind nb_layer_kinds[NB_LAYER_COUNT];

/* Whether a method knows this layer. Neither OpenGL nor classic fog knows a bound of its error. */
int nb_layer_is_known(nb_aov layer, int is_gl, nebel_method method);

/* Puts a layer of so many pixels into every pixel of `of` channels, from channel `first` on. */
void nb_layer_interleave(nb_aov layer, const float *samples, size_t pixels, uint32_t first, uint32_t of, float *out);

#endif
