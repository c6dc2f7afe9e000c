#include "aov.h"

#include <string.h>

const nb_layer_kind nb_layer_kinds[NB_LAYER_COUNT] = {
    [NB_LAYER_COLOR] = {{"R", "G", "B"}, 3},
    [NB_LAYER_TRANSMITTANCE] = {{"transmittance.R", "transmittance.G", "transmittance.B"}, 3},
    [NB_LAYER_IN_SCATTERING] = {{"in_scattering.R", "in_scattering.G", "in_scattering.B"}, 3},
    [NB_LAYER_DEPTH] = {{"depth.Z"}, 1},
    [NB_LAYER_NORMAL] = {{"normal.X", "normal.Y", "normal.Z"}, 3},
    [NB_LAYER_ERROR] = {{"error"}, 1},
    [NB_LAYER_STANDARD_ERROR] = {{"standard_error.R", "standard_error.G", "standard_error.B"}, 3},
};

int nb_layer_is_known(nb_aov layer, int is_gl, nebel_method method)
{
    if (layer == NB_LAYER_ERROR) return !is_gl && method == NEBEL_METHOD_EXACT;
    return layer != NB_LAYER_STANDARD_ERROR || method == NEBEL_METHOD_PATH;
}

void nb_layer_interleave(nb_aov layer, const float *samples, size_t pixels, uint32_t first, uint32_t of, float *out)
{
    const uint32_t channels = nb_layer_kinds[layer].channels;
    for (size_t i = 0; i < pixels; i++) memcpy(out + i * of + first, samples + i * channels, channels * sizeof(float));
}
