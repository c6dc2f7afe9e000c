/* Clouds with volume by the processor: what they do along the ray of each pixel, and to sunlight. No OpenGL. */
#ifndef NB_GL_CLOUD_PICTURE_H
#define NB_GL_CLOUD_PICTURE_H

#include "aerial/shadowed_air.h"
#include "base/base.h"
#include "aerial/cloud_pixels.h"
#include "aerial/fog_shadow.h"
#include "frame/pixel_samples.h"
#include "aerial/planets.h"

#include <nebel/planet.h>
#include <nebel/shader.h>

/* Parts of a picture, which threads take; each keeps some 19 MB of what it found. */
enum { NB_CLOUD_PARTS = 8 };

/* Of a ray, at some place of it. */
typedef struct nb_cloud_pixel_node {
    float t, left;  /* m; transmittance of clouds */
    float light[3]; /* of clouds alone; once they are mixed with air and fog: what is added to `left` of the haze's */
    float haze_left[3], haze_light[3]; /* of air and fog, where they are marked */
    int is_marked;
} nb_cloud_pixel_node;

/* Of the pixels of a block, row by row; and of those of them that are asked together. */
typedef struct nb_cloud_bundle {
    nebel_ray rays[NB_CLOUD_SHARE], asked[NB_CLOUD_SHARE];
    double spreads[NB_CLOUD_SHARE], asked_spreads[NB_CLOUD_SHARE];
    nebel_cloud_transfer nodes[NB_CLOUD_SHARE], found[NB_CLOUD_SHARE];
} nb_cloud_bundle;

typedef struct nb_cloud_part {
    nebel_cloud_workspace *workspace;
    nb_cloud_bundle *bundle;
    nb_cloud_pixel_node *nodes, *before; /* before: while more are put between them */
    size_t count, capacity, capacity_before;
    nb_shadowed_segment *pieces;
    size_t piece_count, piece_capacity;
    uint32_t layers; /* of shade */
    nebel_result result;
} nb_cloud_part;

/* The nodes of a pixel, and its pieces of shaded air, in those of its part. */
typedef struct nb_cloud_pixel {
    uint32_t first, count, first_piece, piece_count;
    int next; /* the node to mark; -1: none */
} nb_cloud_pixel;

typedef struct nb_gl_clouds {
    nebel_allocator allocator;
    nebel_parallel parallel;
    nebel_cloud_lighting_desc of; /* what the view is made of; no clouds: of nothing */
    nebel_cloud_lighting *view;
    nb_cloud_part parts[NB_CLOUD_PARTS];
    nb_cloud_pixel *pixels; /* the lowest row first */
    size_t pixel_capacity;
} nb_gl_clouds;

/* Rays through a picture, the lowest row first. */
typedef struct nb_cloud_picture {
    const nebel_view *view; /* perspective; of a panorama its size and axes */
    int panorama;
    nb_pixel_position point; /* of a panorama: where rays pass its pixels */
    double eye[3];
    double pixel; /* width of a pixel per metre of the camera's axis, or of the way in a panorama */
    const nb_planet *worlds;
    int world_count;
    double to_sun[3], disc; /* as of nb_planets_light */
    int has_fog;
    int lifts; /* whether samples of a pixel may see the sky though its middle meets the ground */
    /* Asked after some rows, in the caller's thread, for walks take seconds: what is not OK ends them. */
    nebel_result (*ask)(void *user);
    void *ask_user;
} nb_cloud_picture;

/* Clouds at a moment under a sun. VALUE, MEMORY. */
nebel_result nb_cloud_picture_set(nb_gl_clouds *clouds, const nebel_clouds *of, const nebel_sun *sun, double time,
                                  const nebel_log *log);

/* A workspace of theirs, for the caller's thread. MEMORY. */
nebel_result nb_cloud_picture_workspace(nb_gl_clouds *clouds, nebel_cloud_workspace **workspace);

/* Finds all pixels' nodes, in clear space, and their shade on the air, which is that of the eye. MEMORY. */
nebel_result nb_cloud_picture_trace(nb_gl_clouds *clouds, const nb_cloud_picture *picture);

/* Their shade on the air, and on fog, NULL: which is the same everywhere: texels as nb_gl_cloud_shade_write has them, of
 * NB_CLOUD_SHADE_LAYERS layers of the picture, without fog NB_AIR_SHADE_LAYERS; *layers: how many of these are used. */
nebel_result nb_cloud_picture_write_shade(nb_gl_clouds *clouds, const nb_cloud_picture *picture,
                                          const nb_cloud_shadow_extent *roof, uint32_t *words, uint32_t *layers);

/* Where fog is to be known next among the clouds of each pixel, 0: nowhere, and the unit direction of the ray: 4 numbers for each.
 * *any: whether it is anywhere. MEMORY. */
nebel_result nb_cloud_picture_choose(nb_gl_clouds *clouds, const nb_cloud_picture *picture, float *places, int *any);
/* What air and fog do up to there: 4 numbers for each pixel. */
void nb_cloud_picture_mark(nb_gl_clouds *clouds, const nb_cloud_picture *picture, const float *left,
                           const float *light);

/* Mixes them with the air, which is that of the eye, and with fog, if there is any, as far as it was chosen. MEMORY. */
nebel_result nb_cloud_picture_mix(nb_gl_clouds *clouds, const nb_cloud_picture *picture);

/* For rays that end at places[4 i], 0: nowhere, what is left of haze, and added to it, 4 numbers for each; and what clouds leave of
 * the sunlight there, three times, and of the sky's light: 4 numbers, where rays end. Where a ray ends amid clouds these are found
 * anew up to there, through the middle of the pixel, and where that just meets the ground but the ray does not above the horizon; but
 * among fog. MEMORY. */
nebel_result nb_cloud_picture_end(nb_gl_clouds *clouds, const nb_cloud_picture *picture, const nb_cloud_picture *middle,
                                  const float *places, float *over, float *shade);

void nb_cloud_picture_release(nb_gl_clouds *clouds);

#endif
