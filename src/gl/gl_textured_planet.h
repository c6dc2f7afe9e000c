/* A textured planet in OpenGL: its maps, what its shells are drawn into, and by which programs. */
#ifndef NB_GL_GL_TEXTURED_PLANET_H
#define NB_GL_GL_TEXTURED_PLANET_H

#include "gl_caps.h"

#include <nebel/scene.h>

/* A texture that holds all levels: the first one, and over it the others in a row. Drivers choose mipmaps for several pixels at
 * once, even where texels are fetched by number. */
typedef struct nb_gl_map {
    unsigned name; /* 0: there is none */
    int width, height, levels;
} nb_gl_map;

enum { NB_SHELL_GROUND, NB_SHELL_CLOUDS, NB_SHELL_AIR, NB_SHELL_PROGRAMS };

typedef struct nb_gl_shells {
    const nebel_textured_planet *of; /* whose maps are here; NULL: nobody's */
    nb_gl_map ground, clouds[NEBEL_MAX_CLOUD_SHELLS], details[NEBEL_MAX_CLOUD_SHELLS];
    unsigned programs[2][NB_SHELL_PROGRAMS]; /* the second of panoramas */
    uint32_t width, height;                  /* of the targets; 0: there are none */
    unsigned place, depth;                   /* of one shell: as those of surfaces */
    unsigned seen;                           /* of it: radiance, of which it covers the alpha */
    unsigned over;                           /* all of them: radiance, of the rest the alpha is left */
    unsigned shell_buffer, over_buffer;
} nb_gl_shells;

/* The planet of a scene that has layers; NULL: there is none. */
const nebel_textured_planet *nb_gl_textured_planet(const nebel_scene_data *scene);

/* Makes what is not there yet, or is of another planet or size. Changes the active unit's TEXTURE_2D, the draw framebuffer and
 * the program; wants the usual unpacking. MEMORY, LIMIT (a map larger than textures), UNSUPPORTED. */
nebel_result nb_gl_textured_set(nb_gl_shells *shells, const nb_context *context, const nebel_log *log,
                                const nebel_textured_planet *layers, uint32_t width, uint32_t height, int panorama);

/* In OpenGL. */
void nb_gl_textured_delete(nb_gl_shells *shells);

#endif
