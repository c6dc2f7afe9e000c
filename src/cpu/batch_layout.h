/* The picture is rendered in regions of 64 x 64 pixels, a region in batches of 64 x 4, a batch in blocks of 4 x 4, a
 * block for a packet of Embree. Arrays over a region go block by block, row after row: each batch is a part of them. */
#ifndef NB_CPU_BATCH_LAYOUT_H
#define NB_CPU_BATCH_LAYOUT_H

#include <stdint.h>

enum {
    NB_BLOCK = 4,                      /* width and height of a packet in pixels */
    NB_PACKET = NB_BLOCK * NB_BLOCK,   /* rays in a packet */
    NB_REGION = 64,                    /* width and height of what a thread renders at a time */
    NB_PIXELS = NB_REGION * NB_REGION, /* pixels in a region */
    NB_BATCH = NB_REGION * NB_BLOCK,   /* rays in a batch */
    NB_PACKETS = NB_REGION / NB_BLOCK, /* packets in a batch */
    NB_TOGETHER = 4,                   /* samples of a region that are rasterized together */
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
 * bits, because nothing is contracted or reordered. For static functions only, each of another name in the whole room:
 * clang 14 gives the symbols of others a wrong name, and makes public what chooses between the clones of these. */
#if defined(__x86_64__) && defined(__linux__) && !defined(__SANITIZE_ADDRESS__)
#define NB_CLONES __attribute__((target_clones("avx512f", "avx2", "default")))
#else
#define NB_CLONES
#endif

/* For what such functions call: else it is compiled for the least of the sets alone. */
#define NB_ALWAYS_INLINE static inline __attribute__((always_inline))

/* The next loop has no dependence between its rounds. clang finds out by itself, and warns of the pragma where it does
 * not. */
#if defined(__clang__)
#define NB_SIMD
#else
#define NB_SIMD _Pragma("omp simd")
#endif

static inline uint32_t nb_lesser(uint32_t a, uint32_t b)
{
    return a < b ? a : b;
}

/* Column and row of lane `i` in its region. */
static inline uint32_t nb_lane_x(uint32_t i)
{
    return i / NB_PACKET % NB_PACKETS * NB_BLOCK + i % NB_BLOCK;
}

static inline uint32_t nb_lane_y(uint32_t i)
{
    return i / NB_BATCH * NB_BLOCK + i % NB_PACKET / NB_BLOCK;
}

/* The lane of a column and row of a batch. */
static inline uint32_t nb_lane_at(uint32_t x, uint32_t y)
{
    return x / NB_BLOCK * NB_PACKET + y * NB_BLOCK + x % NB_BLOCK;
}

#endif
