/* The fog of embed_glfw.c, embed_sdl.c and embed_vertex_colors.c. */
#ifndef FOG_H
#define FOG_H

#include "host.h"

/* Fog that gives light of its own needs no lights. */
static inline nebel_lighting *light_fog(nebel_snapshot *snapshot)
{
    nebel_lighting *lighting = NULL;
    if (snapshot != NULL) nebel_create_lighting(snapshot, NULL, &lighting);
    return lighting;
}

/* Mist on the ground, and a ball of other fog within it. */
static inline nebel_snapshot *make_fog(nebel_fog **fog)
{
    const nebel_volume_desc mist = {.shape = {.type = NEBEL_SHAPE_WORLD},
                                    .density = {.type = NEBEL_DENSITY_HEIGHT, .scale_height = .6},
                                    .extinction = {.25, .25, .25},
                                    .source = {.5, .6, .7}};
    const nebel_volume_desc ball = {.shape = {.type = NEBEL_SHAPE_SPHERE, .center = {-1, 1.2, 2}, .radius = 1.5},
                                    .density = {.type = NEBEL_DENSITY_RADIAL, .power = 2},
                                    .extinction = {.4, .8, 1.2},
                                    .emission = {.7, .35, .1}};
    nebel_snapshot *snapshot = NULL;
    if (nebel_create_fog(&(nebel_fog_desc){.host.log = host_log}, fog) == NEBEL_OK &&
        nebel_add_volume(*fog, &mist, NULL) == NEBEL_OK && nebel_add_volume(*fog, &ball, NULL) == NEBEL_OK)
        nebel_commit_fog(*fog, &snapshot);
    return snapshot;
}

#endif
