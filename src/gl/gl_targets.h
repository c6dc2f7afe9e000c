/* What the renderer draws into. */
#ifndef NB_GL_GL_TARGETS_H
#define NB_GL_GL_TARGETS_H

#include "gl_caps.h"

/* Pixels of a block of the survey, either way. */
enum { NB_SURVEY_BLOCK = 8 };

/* Pictures of one size, the lowest row first. */
typedef struct nb_targets {
    uint32_t width, height; /* 0: there are none */
    unsigned depth;
    unsigned place;                        /* distance [m], 0 for none; unit normal of the triangle */
    unsigned normal, reflectance;          /* rgb */
    unsigned in_scattering, transmittance; /* of one sample */
    unsigned dimming;                      /* of the sun, by particles */
    unsigned picture[4];                   /* color, transmittance, in-scattering, surface: see nebel_gl_textures */
    unsigned survey;                       /* a texel for each block: distances of the nearest and the farthest */
    uint32_t survey_width, survey_height;
    unsigned
        veil; /* array, what particles make of the light behind them: one layer of light and transmittance, or one of
                      these two for each colour; 0: never asked for */
    int veil_layers;
    unsigned surface_buffer, fog_buffer, picture_buffer, survey_buffer, dimming_buffer, veil_buffer;
} nb_targets;

/* Makes them for a size; those of another size go. Changes the bindings of TEXTURE_2D on the active unit and of the
 * draw framebuffer. MEMORY, UNSUPPORTED. */
nebel_result nb_targets_fit(nb_targets *targets, const nebel_log *log, uint32_t width, uint32_t height);

/* Makes the veil of 1 or 3 layers where it is another. Changes the bindings of
 * TEXTURE_2D_ARRAY on the active unit and of the draw framebuffer. MEMORY, UNSUPPORTED. */
nebel_result nb_targets_fit_veil(nb_targets *targets, const nebel_log *log, int layers);

void nb_targets_delete(nb_targets *targets);

/* A new texture, read without filter and bound to the active unit. */
unsigned nb_targets_make_texture(uint32_t width, uint32_t height, unsigned internal, unsigned format, unsigned type);

/* A new draw framebuffer of colors, and depth where that is not 0; 0: the driver does not draw into them. */
int nb_targets_make_buffer(unsigned *name, const unsigned *textures, int count, unsigned depth);

/* UNSUPPORTED, with a message. */
nebel_result nb_targets_refuse(const nebel_log *log);

/* A new array of textures, read without filter and bound to the active unit; its size is the caller's. */
unsigned nb_targets_make_array(void);

#endif
