/* What the rays of a batch meet. */
#ifndef NB_CPU_HITS_H
#define NB_CPU_HITS_H

#include "embree_scene.h"
#include "camera_rays.h"

typedef struct nb_hits {
    uint32_t surface[NB_BATCH]; /* NB_NONE: nothing is met, the other members are undefined */
    uint32_t triangle[NB_BATCH];
    float t[NB_BATCH];              /* m from the ray's start in the geometry */
    float u[NB_BATCH], v[NB_BATCH]; /* weights of the second and third vertex */
    float normal[3][NB_BATCH];      /* of the triangle, not of unit length, either side */
} nb_hits;

/* Whether any ray meets something. */
static inline int nb_hits_any(const nb_hits *hits)
{
    uint32_t met = NB_NONE;
    for (int i = 0; i < NB_BATCH; i++) met &= hits->surface[i];
    return met != NB_NONE;
}

/* Memory for the packets of a batch, aligned as Embree wants it. */
typedef struct nb_packets {
    struct RTCRayHit16 rays[NB_PACKETS];
} nb_packets;

/* The first hit of every ray with active[i] == -1 (else 0). `active` is aligned to 64 bytes. */
void nb_hits_trace(RTCScene scene, const nb_ray_batch *rays, const int *active, nb_packets *packets, nb_hits *hits);

/* Finds in double how far it is to triangles that are much larger than the way to them, of which floats lose that. */
void nb_hits_refine(const nb_geometry *geometry, const nb_ray_batch *rays, nb_hits *hits);

/* Clears active[i] where something lies between start i and infinity. All rays go in one direction. */
void nb_hits_shadow(RTCScene scene, float (*start)[NB_BATCH], const float direction[3], int *active,
                    nb_packets *packets);

/* The same between start i and start i + reach[i] direction[i]. */
void nb_hits_between(RTCScene scene, float (*start)[NB_BATCH], float (*direction)[NB_BATCH], const float *reach,
                     int *active, nb_packets *packets);

#endif
