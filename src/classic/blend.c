/* Transparent surfaces in fog, in double, from the one formula text. */
#include <nebel/classic.h>

#define NB_DOUBLE
#include "formulas/prelude.h"

#include "formulas/blend.inc"

static nb_blend blend_channel(nebel_blend_mode mode, double color, double alpha, double transmittance,
                              double in_scattering)
{
    switch (mode) {
    case NEBEL_BLEND_OVER:
        return nb_blend_over(color, alpha, transmittance, in_scattering);
    case NEBEL_BLEND_PREMULTIPLIED:
        return nb_blend_premultiplied(color, alpha, transmittance, in_scattering);
    case NEBEL_BLEND_ADDITIVE:
        return nb_blend_additive(color, transmittance);
    case NEBEL_BLEND_MULTIPLY:
        return nb_blend_multiply(color, in_scattering);
    case NEBEL_BLEND_SCREEN:
        return nb_blend_screen(color, transmittance, in_scattering);
    default:
        return nb_blend_of(0, 1);
    }
}

nebel_blend nebel_blend_surface(nebel_blend_mode mode, const double color[3], double alpha, const nebel_transfer *fog)
{
    nebel_blend blend = {.factor = {1, 1, 1}}; /* leaves the pixel as it is */
    if (color == NULL || fog == NULL) return blend;
    for (int c = 0; c < 3; c++) {
        const nb_blend channel = blend_channel(mode, color[c], alpha, fog->transmittance[c], fog->in_scattering[c]);
        blend.source[c] = channel.source;
        blend.factor[c] = channel.factor;
    }
    return blend;
}
