/* The meshes of a scene in one Embree scene, in float relative to an origin near the camera. */
#ifndef NB_CPU_GEOMETRY_H
#define NB_CPU_GEOMETRY_H

#include "base/base.h"
#include "lanes.h"

#include <nebel/scene.h>

#include <embree3/rtcore.h>

/* A mesh with its positions relative to the origin of the geometry. */
typedef struct nb_surface {
    const nebel_mesh *mesh;
    float *positions;      /* 3 per vertex, and one float more: Embree loads four */
    float low[3], high[3]; /* corners of the mesh around its own origin */
    float longest_edge;
} nb_surface;

/* Up to NB_CLUSTER triangles of a mesh that follow each other. */
typedef struct nb_cluster {
    uint32_t surface, first, count;
    float low[3], high[3]; /* relative to the origin of the geometry */
    float from[2], to[2];  /* in pixels of the picture that is being rasterized; empty where to[0] < 0 */
} nb_cluster;

/* NB_GROUP clusters that follow each other, the last group fewer. */
typedef struct nb_group {
    float from[2], to[2]; /* around those of the clusters */
} nb_group;

typedef struct nb_geometry {
    nebel_allocator allocator;
    nebel_log log;
    RTCDevice device;
    RTCScene scene; /* NULL until there is a place, and where no triangle is finite */
    double origin[3];
    float bounds_min[3], bounds_max[3]; /* relative to origin; 0 where there are no triangles */
    double largest_radius;              /* of a mesh around its own origin */
    size_t surface_count;
    size_t cluster_count;
    nb_cluster *clusters;
    nb_group *groups;
    nb_surface *surfaces; /* the number of a surface is its geometry ID in Embree */
} nb_geometry;

/* Checks the meshes and makes the device; builds nothing yet. On an error the geometry is to be freed all the same.
 * Errors: ARGUMENT, VALUE, MEMORY, UNSUPPORTED. */
nebel_result nb_geometry_make(nb_geometry *geometry, const nebel_scene_data *scene, nebel_isa isa, int threads);

/* Builds for a camera at this place, or keeps what is built where that is good for it. Errors: MEMORY. */
nebel_result nb_geometry_place(nb_geometry *geometry, const double camera[3]);

void nb_geometry_free(nb_geometry *geometry);

#endif
