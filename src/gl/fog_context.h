/* What a nebel_gl holds. */
#ifndef NB_GL_FOG_CONTEXT_H
#define NB_GL_FOG_CONTEXT_H

#include "gl_environment.h"
#include "fog_program.h"
#include "fog_multi_pass.h"

#include <nebel/scene.h>

struct nebel_gl {
    nebel_allocator allocator;
    nebel_log log;
    nebel_gl_storage storage;
    nb_context context;
    nebel_lighting *empty; /* what is seen where there is no fog */

    /* Names in OpenGL; 0: not made yet. The sampler fetches single texels, whatever the host's textures ask for. */
    unsigned vertex_array, sampler, block, texture, voxels, nodes, tiles, framebuffer;
    uint32_t texture_rows, voxel_rows, node_rows, tile_rows; /* allocated */
    nb_environment environment;
    nb_programs programs;
    nb_fog_passes steps;

    const nebel_gl *lender;    /* set earlier in a frame: its voxels serve where they are the same; NULL: none */
    int dims_alone;            /* the fog is asked for transmittance alone: nothing of it is mixed */
    int has_warned;            /* of the turns of loops */
    int may_tire;              /* rays may take more of them than this driver has */
    int overlaps_much;         /* some will */
    int has_fog;               /* what follows is of the last nebel_gl_set_fog, and that went well */
    nebel_lighting *packed;    /* what words and tiles are made of, as `view` sees it; NULL: of nothing */
    nebel_lighting *voxels_of; /* what the texture of voxels is made of; NULL: of nothing */
    nebel_lighting *nodes_of;  /* the same of the lattice of multiple scattering */
    nebel_view views[6];       /* one, or six of a panorama */
    int view_count;
    int face_first[6]; /* entry of the first tile of each */
    nebel_gl_fog_resources fog;
    nebel_texel_f32 *words;
    size_t word_capacity;
    uint32_t *entries;
    size_t entry_capacity;
};

/* How many volumes there are in the fog of a lighting, which may be NULL. */
static inline size_t nb_gl_count_volumes(const nebel_lighting *lighting)
{
    return nebel_get_volume_count(nebel_get_lighting_snapshot(lighting));
}

/* nebel_gl_set_fog for a panorama of so many pixels. */
nebel_result nb_gl_set_fog_around(nebel_gl *gl, nebel_lighting *lighting, const double eye[3], uint32_t width,
                                  uint32_t height);

/* What keeps light away from fog, as the fog's text asks for it (NEBEL_LIGHT_VISIBILITY). `set` sets the uniforms of a program
 * that is current. */
typedef struct nb_gl_visibility {
    const char *texts[2]; /* before that of the fog; they live for ever. NULL: none */
    void (*set)(const void *of, unsigned program);
    const void *of;
} nb_gl_visibility;

/* What a pass is drawn along: rays of another view, or panorama, than the fog was set for, whose pixels lie within
 * those of that. */
typedef struct nb_fog_pass_input {
    nebel_rays rays; /* of a panorama: its words */
    uint32_t width, height;
    int panorama;
    nb_gl_visibility shade;
    const struct nb_gl_air *air;      /* on NB_UNIT_AIR, for the same eye; one sample a pixel. NULL: none */
    const nebel_scene_data *daylight; /* whose sun lights fog in that air, by its place; NULL: the fog's own sun does */
    float even_shade;                 /* part of that sun that clouds leave */
    const struct nb_gl_cloud_shade *cloud_shade; /* of clouds; NULL: there are none */
    int is_turned; /* behind its distances the depth texture has the directions of rays; with cloud_shade only */
    const struct nb_shaft_maps *shafts; /* where surfaces shade fog; NULL: nowhere. Changes their units */
} nb_fog_pass_input;

/* nebel_gl_draw_fog along these. */
nebel_result nb_gl_draw_fog(nebel_gl *gl, const nebel_gl_pass *pass, const nb_fog_pass_input *picture);

/* Tells once, of many volumes that overlap, what this driver leaves out of its light, and `why`. */
void nb_gl_warn_of_turns(nebel_gl *gl, const char *why);

/* The number of a tile's pixels in a row is 2 to this. */
enum { NB_GL_TILE_SHIFT = 4 };

#endif
