/* Light of air that clouds shade, piece by piece of a ray. */
#ifndef NB_AERIAL_SHADOWED_AIR_H
#define NB_AERIAL_SHADOWED_AIR_H

#include <nebel/planet.h>

enum { NB_SHADED_PIECES = NEBEL_MAX_AIR_SHADOW_SEGMENTS + 1 };

/* From t on light up to a place is `rest` and `part` of that of clear air. The last piece is behind all shade. */
typedef struct nb_shadowed_segment {
    float t, part[3], rest[3];
} nb_shadowed_segment;

/* clear: light of clear air up to shade->t. Returns how many pieces there are; 0: no shade. */
static inline uint32_t nb_shadowed_air_set(const nebel_air_shadow *shade, float (*const clear)[NB_SHADED_PIECES],
                                           nb_shadowed_segment pieces[NB_SHADED_PIECES])
{
    if (shade->count == 0) return 0;
    for (int c = 0; c < 3; c++) {
        float light = clear[c][0];
        for (uint32_t k = 0; k <= shade->count; k++) {
            const float part = k < shade->count ? shade->transmittance[k][c] : 1;
            pieces[k].t = shade->t[k];
            pieces[k].part[c] = part;
            pieces[k].rest[c] = light - part * clear[c][k];
            if (k < shade->count) light += part * (clear[c][k + 1] - clear[c][k]);
        }
    }
    return shade->count + 1;
}

/* Of one colour, up to t; clear: that of clear air. */
static inline float nb_shadowed_air_light(const nb_shadowed_segment *pieces, uint32_t count, int c, float t,
                                          float clear)
{
    if (count == 0 || !(t > pieces[0].t)) return clear;
    uint32_t k = count - 1;
    while (k > 0 && !(t > pieces[k].t)) k--;
    return pieces[k].rest[c] + pieces[k].part[c] * clear;
}

#endif
