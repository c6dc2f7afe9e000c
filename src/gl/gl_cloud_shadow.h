/* Clouds' shade on air, and on fog by its place, in the fog pass: what the processor found along the ray through the middle of each
 * pixel, as a texture. */
#ifndef NB_GL_GL_CLOUD_SHADOW_H
#define NB_GL_GL_CLOUD_SHADOW_H

#include "gl_caps.h"

#include "aerial/shadowed_air.h"
#include "aerial/fog_shadow.h"

enum {
    NB_AIR_SHADE_LAYERS = 1 + NB_SHADED_PIECES,                                      /* the head, air */
    NB_CLOUD_SHADE_LAYERS = NB_AIR_SHADE_LAYERS + NEBEL_MAX_FOG_SHADOW_SEGMENTS + 1, /* fog, and that over clouds */
    NB_CLOUD_SHADE_TEXELS = 2                                                        /* of a texel */
};

typedef struct nb_gl_cloud_shade {
    unsigned texture; /* in OpenGL; 0: not made yet */
    float clear_sky;  /* of fog that is shaded by its place; 0: none is */
} nb_gl_cloud_shade;

/* The texels of a pixel, `stride` texels from one to the next: how many pieces of air and of fog there are, and where those of fog
 * begin; where each piece of air begins, and what part of its light it has; where each piece of fog ends, and what there is of the
 * sun and, as part of clear_sky, of the sky. fog NULL: it has none. Returns how many texels. */
uint32_t nb_gl_cloud_shade_write(const nb_shadowed_segment *air, uint32_t air_count, const nb_fog_shadow *fog,
                                 uint32_t *words, size_t stride);

/* Layers of texels, the lowest row first, to the texture on the active unit, which is NB_UNIT_SHADE; wants the usual unpacking.
 * MEMORY. */
nebel_result nb_gl_cloud_shade_upload(nb_gl_cloud_shade *shade, const nebel_log *log, uint32_t width, uint32_t height,
                                      uint32_t layers, const uint32_t *words);

/* Binds it for the current program, and sets the uniforms of the texts. Changes the active unit. */
void nb_gl_cloud_shade_set(const nb_gl_cloud_shade *shade, unsigned program);

/* For nb_air_aerial_text: pass_air; and pass_shade, of fog by its place. */
extern const char nb_cloud_shade_text[], nb_fog_shadow_text[];

#endif
