/* Batches of rays: 16 x 16 points of the picture, in blocks of 4 x 4, a block for a packet of Embree. */
#ifndef NB_CPU_LANES_H
#define NB_CPU_LANES_H

#include <stdint.h>

enum {
    NB_PACKET = 16,                    /* rays in a packet */
    NB_BLOCK = 4,                      /* width and height of a packet in pixels */
    NB_TILE = 16,                      /* width and height of a batch in pixels */
    NB_BATCH = NB_TILE * NB_TILE,      /* rays in a batch */
    NB_PACKETS = NB_BATCH / NB_PACKET, /* packets in a batch */
    NB_REGION = 64,                    /* width and height of what a thread renders at a time */
    NB_CLUSTER = 16,                   /* neighbouring triangles that are rasterized together */
    NB_GROUP = 16                      /* neighbouring clusters that are looked at together */
};

#define NB_NONE UINT32_MAX

/* Embree takes coordinates up to 1.8e18 and may stop the program at larger ones, also in rays that are not to be
 * traced. */
static inline float nb_clamp_coordinate(float x)
{
    const float low = x > -1e18f ? x : -1e18f;
    return low < 1e18f ? low : 1e18f;
}

/* Loops over whole batches are compiled for several instruction sets; the loader takes the best one. All give the same
 * bits, because nothing is contracted or reordered. For static functions only: clang 14 gives the symbols of others a
 * wrong name. */
#if defined(__x86_64__) && defined(__linux__) && !defined(__SANITIZE_ADDRESS__)
#define NB_CLONES __attribute__((target_clones("avx512f", "avx2", "default")))
#else
#define NB_CLONES
#endif

/* The next loop has no dependence between its rounds. clang finds out by itself, and warns of the pragma where it does
 * not. */
#if defined(__clang__)
#define NB_SIMD
#else
#define NB_SIMD _Pragma("omp simd")
#endif

/* Column and row of lane `i` in its batch. */
static inline uint32_t nb_lane_x(uint32_t i)
{
    return i / NB_PACKET % (NB_TILE / NB_BLOCK) * NB_BLOCK + i % NB_BLOCK;
}

static inline uint32_t nb_lane_y(uint32_t i)
{
    return i / NB_PACKET / (NB_TILE / NB_BLOCK) * NB_BLOCK + i % NB_PACKET / NB_BLOCK;
}

#endif
