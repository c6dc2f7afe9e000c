/* Holes in surfaces, where the alpha of a texture is below a cutoff.
 *
 * Between the centres of four texels, in a cell, alpha is bilinear, so that along a line it is a quadratic: where a line
 * enters and leaves holes is a root of that, not the border of a texel. Cells are walked one after the other; where all
 * is of one kind many are passed over at once. */
#ifndef NB_CPU_MASK_H
#define NB_CPU_MASK_H

#include "base/base.h"

#include <nebel/scene.h>

typedef struct nb_mask {
    int32_t number; /* of the texture */
    float cutoff;   /* as the meshes have it */
    uint32_t width, height;
    float threshold;     /* of alpha in bytes */
    uint8_t *alphas;     /* of each texel and, in one more column and row, of the first ones again */
    uint8_t *clearances; /* of each cell, row after row: those less than so many cells away have no edge of a hole, at
                            most 255; 0: it has one itself. Cell 0 begins at the centre of texel 0, all are periodic */
} nb_mask;

/* Errors: MEMORY. */
nebel_result nb_mask_make(nb_mask *mask, const nebel_allocator *allocator, const nebel_scene_data *scene,
                          int32_t number, float cutoff);
void nb_mask_free(nb_mask *mask, const nebel_allocator *allocator);

/* Whether there is a hole at these texture coordinates. What is no number is 0. */
int nb_mask_is_hole(const nb_mask *mask, float u, float v);

/* One axis of a line: its place at s is start + s way, in cells; never below 0. */
typedef struct nb_mask_axis {
    double start, way, inverse; /* of the way; never infinite */
    uint32_t size, lap;         /* of cells; the first of those around the mask that the line is on */
} nb_mask_axis;

/* A line over a mask, from s = 0 to 1. */
typedef struct nb_mask_walk {
    const nb_mask *mask;
    nb_mask_axis x, y;
    double at; /* how far it has been walked */
    double ends[3];
    int solid[3]; /* the pieces of the present cell that lie ahead */
    int count, next;
} nb_mask_walk;

/* Lines with more than so many texels along either axis are taken for solid. */
enum { NB_MASK_REACH = 1 << 20 };

/* Between two places in texels; 0 is the border of the first. */
nb_mask_walk nb_mask_begin(const nb_mask *mask, const double from[2], const double to[2]);

/* The next stretch of the line without holes; 0 where there is none left. */
int nb_mask_next(nb_mask_walk *walk, double *enter, double *leave);

#endif
