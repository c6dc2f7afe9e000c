/* Fog whose rays take more turns of loops than a driver gives to one fragment: each pass goes on from where the one before
 * has come to, band after band of the picture. */
#ifndef NB_GL_FOG_MULTI_PASS_H
#define NB_GL_FOG_MULTI_PASS_H

#include "fog_program.h"

/* The end of a fragment shader that goes on with the rays of a band. */
extern const char nb_step_text[];

typedef struct nb_fog_passes {
    /* Names in OpenGL; 0: not made yet. */
    unsigned progress[2], framebuffers[2]; /* words of each pixel (nb_progress_words of trace.glsl), a layer for each */
    unsigned query, count_program, compose_programs[NEBEL_GL_OUTPUT_COUNT];
    uint32_t width, height; /* of the progress */
} nb_fog_passes;

/* Of the target. */
typedef struct nb_pass_band {
    uint32_t x, y, width, height;
} nb_pass_band;

/* How many rows of such a picture a band has. */
uint32_t nb_fog_passes_rows(uint32_t width, uint32_t height);

/* Room for bands of this size, and the programs for one output. Changes the draw framebuffer, the current program and the
 * active unit's TEXTURE_2D_ARRAY; no buffer may be bound for unpacking. MEMORY; UNSUPPORTED, told, where the driver does
 * not draw into such textures. */
nebel_result nb_fog_passes_fit(nb_fog_passes *steps, const nb_context *context, const nebel_log *log,
                               nebel_gl_output output, uint32_t width, uint32_t height);

/* Draws a band of a program of kind `step` that is current, with its uniforms. Returns whether steps did not suffice for all
 * of it, as far as that can be asked; what was left then counts as even. Changes the draw framebuffer, the viewport, and NB_UNIT_COLOR. */
int nb_fog_passes_trace(const nb_fog_passes *steps, const nb_context *context, unsigned program,
                        const nb_pass_band *band);

/* Writes what was found into the target, which is bound. Changes the program and NB_UNIT_DEPTH. */
void nb_fog_passes_compose(const nb_fog_passes *steps, nebel_gl_output output, const nb_pass_band *band);

void nb_fog_passes_delete(nb_fog_passes *steps);

#endif
