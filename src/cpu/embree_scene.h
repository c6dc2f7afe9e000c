/* The meshes of a scene in one Embree scene, in float relative to an origin near the camera. */
#ifndef NB_CPU_EMBREE_SCENE_H
#define NB_CPU_EMBREE_SCENE_H

#include "base/base.h"
#include "batch_layout.h"
#include "alpha_mask.h"

#include <nebel/scene.h>

#include <embree3/rtcore.h>

enum {
    NB_FAN = 16,           /* children of a node of the tree of rectangles */
    NB_MAX_TREE_LEVELS = 8 /* of this tree at most: 16^8 triangles */
};

/* Pixels around each of the NB_FAN triangles or nodes below a node as -x0, -y0, x1, y1, ends included: around two of
 * them these are the larger numbers. INT16_MIN four times around what shows nothing. */
typedef struct nb_node {
    int16_t ends[4 * NB_FAN];
} nb_node;

/* A mesh with its positions relative to the origin of the geometry. */
typedef struct nb_batch_surface {
    const nebel_mesh *mesh;
    const nb_alpha_mask *mask; /* NULL: no holes */
    float *positions;          /* 3 per vertex, and one float more: Embree loads four */
    int16_t *ends;             /* 4 per vertex: like those of a node, in the picture that is being rasterized */
    float low[3], high[3];     /* corners of the mesh around its own origin */
    double shift[3];           /* what its positions have been moved by */
    float longest_edge;
    int is_coarse;       /* it has triangles nearly as large as itself: see nb_surface_distance */
    size_t first_vertex; /* among the vertices of all surfaces */
    uint32_t first_id;   /* of its triangles in the geometry, a multiple of NB_FAN */
} nb_batch_surface;

typedef struct nb_geometry {
    nebel_allocator allocator;
    nebel_log log;
    RTCDevice device;
    RTCScene scene; /* NULL until there is a place, and where no triangle is finite */
    double origin[3];
    float bounds_min[3], bounds_max[3]; /* relative to origin; 0 where there are no triangles */
    double largest_radius;              /* of a mesh around its own origin */
    size_t surface_count;
    size_t vertex_count;        /* of all surfaces */
    nb_batch_surface *surfaces; /* the number of a surface is its geometry ID in Embree */
    nb_alpha_mask *masks;       /* each pair of a texture and a cutoff once */
    size_t mask_count;
    uint32_t *owners; /* the surface of NB_FAN triangles whose IDs follow each other */
    void *nodes;
    int level_count;
    nb_node *levels
        [NB_MAX_TREE_LEVELS]; /* of the tree: parts of `nodes`, leaves first; a node is on two lines of the cache */
    size_t node_counts[NB_MAX_TREE_LEVELS];
} nb_geometry;

/* Of an edge, over the way to its triangle: from here on the rounding of corners may be some 1e-5 of that way. */
#define NB_LONG_EDGE 64.0f

/* How far the plane of a triangle is from a place of the geometry along a direction of length 1, found in double: Embree
 * tells that from differences of floats as large as the triangle. `cosine` of the angle to the normal, if not NULL. */
double nb_surface_distance(const nb_batch_surface *surface, uint32_t triangle, const float start[3],
                           const float unit[3], double *cosine);

/* The surface of the triangle with the given ID. */
static inline uint32_t nb_owner_of(const nb_geometry *geometry, uint32_t id)
{
    return geometry->owners[id / NB_FAN];
}

/* Checks the meshes and makes the device; builds nothing yet. On an error the geometry is to be freed all the same.
 * Errors: ARGUMENT, VALUE, MEMORY, UNSUPPORTED. */
nebel_result nb_geometry_make(nb_geometry *geometry, const nebel_scene_data *scene, nebel_isa isa, int threads);

/* Builds for a camera at this place, or keeps what is built where that is good for it. Errors: MEMORY. */
nebel_result nb_geometry_place(nb_geometry *geometry, const double camera[3]);

void nb_geometry_free(nb_geometry *geometry);

#endif
