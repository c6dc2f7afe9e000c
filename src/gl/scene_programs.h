/* The programs of the scene renderer: surfaces into their properties, distances into a survey of them, surfaces
 * into shadow maps, and properties into light. */
#ifndef NB_GL_SCENE_PROGRAMS_H
#define NB_GL_SCENE_PROGRAMS_H

#include "fog_program.h"

/* Texture units of the samplers; the fog's are those of the passes. */
enum {
    NB_UNIT_PLACE = NB_UNIT_ENVIRONMENT + 1,
    NB_UNIT_NORMAL,
    NB_UNIT_REFLECTANCE,
    NB_UNIT_IN_SCATTERING,
    NB_UNIT_TRANSMITTANCE,
    NB_UNIT_SHADOWS,
    NB_UNIT_DIMMING,
    NB_UNIT_VEIL,
    NB_UNIT_LIGHTS,
    NB_UNIT_LIGHT_MAPS,
    NB_SCENE_UNIT_END,               /* at most NB_UNIT_AIR */
    NB_UNIT_SHELLS = NB_UNIT_AIR,    /* a planet has layers or air */
    NB_UNIT_SHADE = NB_UNIT_DIMMING, /* in passes, which are asked before what dims light is known */
    NB_UNIT_CLOUDS = NB_UNIT_VEIL,   /* where there are clouds there are no particles */
    NB_UNIT_MASK = NB_UNIT_NORMAL    /* while surfaces are drawn nothing reads normals */
};

enum { NB_CASCADES = 4, NB_MAX_MAPS = 8 };

/* What a program that asks fog is made for. */
typedef struct nb_composite_key {
    int of_particles; /* and the fog before them: 2 to the number of each profile that occurs; 0: of surfaces, and the
                         fog between them and the sun */
    int of_dimming;   /* of the sun by particles, for `dimmed` ones */
    int of_shells;    /* one of a planet's, and the fog before it */
    int dimmed;       /* that counts, too */
    int sunlit;       /* surfaces are */
    int lights;       /* the same */
    int five_taps;    /* particles are discs, which are there or not */
    int environment;  /* surfaces are lit by direction, and the background may be */
    int veil_layers;  /* that particles are drawn into, or surfaces are seen through; 0: there are none */
    int panorama;
    int has_surfaces; /* there are meshes */
    int in_fog;       /* that the pass, or vertices, made for all pixels */
    int has_fog;
    int shafts; /* surfaces shade fog */
    int air;    /* of so many planets, with their ground and the sun */
    int shells; /* of a textured planet, over everything */
    int clouds; /* with volume, whose shadow is what dims */
    int in_texture, tiled;
    uint32_t features;
} nb_composite_key;

typedef struct nb_composite_program {
    nb_composite_key kind;
    unsigned name;
} nb_composite_program;

typedef struct nb_scene_programs {
    unsigned surface, survey, shadow;
    unsigned vertex_fog, round_surface, round_vertex_fog; /* 0 until they are needed; round: of panoramas */
    unsigned factor, round_factor;
    unsigned ground, round_ground;
    int ground_worlds; /* that they are made for */
    unsigned light_map;
    nb_composite_program *lights;
    size_t light_count, light_capacity;
} nb_scene_programs;

/* What is drawn over the whole picture: its vertices, and the ray of a pixel. nb_texel_texture_text: scene_rays are the words of
 * nebel_compute_view_rays, or of a panorama, whose ray is another. */
extern const char nb_whole_vertex_text[], nb_texel_texture_text[], nb_ray_text[];

/* Compile and link what is not there yet, which changes the current program. UNSUPPORTED with the driver's words;
 * MEMORY. */
nebel_result nb_scene_programs_make(nb_scene_programs *shading, const nb_context *context, const nebel_log *log);
nebel_result nb_scene_programs_find_light(nb_scene_programs *shading, const nb_context *context,
                                          const nebel_allocator *allocator, const nebel_log *log,
                                          const nb_composite_key *kind, unsigned *program);

/* Fog that vertices bring, over the surfaces that are seen. */
nebel_result nb_scene_programs_make_vertex_fog(nb_scene_programs *shading, const nb_context *context,
                                               const nebel_log *log);

/* Maps around point lights. */
nebel_result nb_scene_programs_make_light_map(nb_scene_programs *shading, const nb_context *context,
                                              const nebel_log *log);

/* Fog factors of pixels. */
nebel_result nb_scene_programs_make_factor(nb_scene_programs *shading, const nb_context *context, const nebel_log *log,
                                           int panorama);

/* Surfaces of panoramas, and the fog that vertices bring to them. */
nebel_result nb_scene_programs_make_round(nb_scene_programs *shading, const nb_context *context, const nebel_log *log,
                                          int with_fog);

/* The ground of so many planets. */
nebel_result nb_scene_programs_make_ground(nb_scene_programs *shading, const nb_context *context, const nebel_log *log,
                                           int panorama, int worlds);

/* In OpenGL. */
void nb_scene_programs_delete(const nb_scene_programs *shading);

#endif
