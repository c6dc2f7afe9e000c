/* Point lights, and maps of how far their light goes before it meets a surface. */
#ifndef NB_GL_LIGHT_MAPS_H
#define NB_GL_LIGHT_MAPS_H

#include "gl_meshes.h"

#include <nebel/scene.h>

/* Point lights of a scene; texels of each among the words; texels around a face of a map that are its neighbours'. */
enum { NB_MAX_SHADED_LIGHTS = 4096, NB_LIGHT_BORDER = 4 };
#define NB_LIGHT_MAP_TEXELS 4 /* a part of a shader's text, too */

/* What a layer of the maps shows: surfaces around a place, none nearer than the radius. */
typedef struct nb_light_map_source {
    double place[3], radius;
    int is_drawn;
} nb_light_map_source;

typedef struct nb_light_maps {
    unsigned words; /* texture of NB_LIGHT_MAP_TEXELS texels for each point light, see nb_light_text; 0: not made yet */
    uint32_t rows;
    unsigned maps, buffer;    /* array of depth: a layer for each source, six faces, three by two; 0: not made yet */
    uint32_t most_face, face; /* texels of a face's side */
    size_t layer_count;
    nb_light_map_source *sources; /* of the layers */
    float *texels;                /* of the words */
    int *layers;                  /* of the point lights, -1: none */
    size_t capacity;              /* of the two */
} nb_light_maps;

/* Makes the words of a scene's point lights, and of those of the fog (NULL: none) that are the same, as seen from an
 * eye, and chooses which of them have maps: all that shine while there is room, then those that are brightest at the
 * eye. Changes the bindings of TEXTURE_2D on the active unit. LIMIT, MEMORY. */
nebel_result nb_light_maps_set(nb_light_maps *lights, const nebel_allocator *allocator, const nebel_log *log,
                               const nebel_scene_data *scene, const nebel_lighting *fog, const double eye[3]);

/* Draws the maps that are not there yet. `program` is nb_scene_programs.light_map. Depth is tested afterwards. MEMORY.
 * */
nebel_result nb_light_maps_draw(nb_light_maps *lights, const nb_context *context, const nebel_log *log,
                                unsigned program, const nb_meshes *meshes);

/* In OpenGL; then in memory. */
void nb_light_maps_delete(const nb_light_maps *lights);
void nb_light_maps_release(const nebel_allocator *allocator, const nb_light_maps *lights);

/* The programs that make the maps, and functions that read them and the words: light_visible; light of point lights;
 * what nebel_get_shader_source asks of surfaces, to stand before it. The last two behind the first. */
extern const char nb_light_map_vertex_text[], nb_light_map_fragment_text[], nb_light_map_text[], nb_light_text[],
    nb_light_shade_text[];

#endif
