/* Fog at pixels that the processor finds, from the distances that were drawn. */
#ifndef NB_GL_GL_PIXEL_FOG_H
#define NB_GL_GL_PIXEL_FOG_H

#include "gl_targets.h"
#include "gl_vertex_fog.h"

#include <nebel/shader.h>

/* Fills the textures of transmittance and in-scattering for the surfaces that these rays see. Changes the bindings of
 * READ_FRAMEBUFFER and of TEXTURE_2D on the active unit. Errors: MEMORY, and those of the source. */
nebel_result nb_pixel_fog_set(const nb_targets *targets, const nebel_allocator *allocator, const nebel_log *log,
                              const nebel_rays *rays, const nb_vertex_source *source);

#endif
