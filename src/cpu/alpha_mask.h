/* Holes in surfaces, where the alpha of a texture is below a cutoff.
 *
 * Between the centres of four texels, in a cell, alpha is bilinear, so that along a line it is a quadratic: where a line
 * enters and leaves holes is a root of that, not the border of a texel. Cells are walked one after the other; where all
 * is of one kind many are passed over at once. */
#ifndef NB_CPU_ALPHA_MASK_H
#define NB_CPU_ALPHA_MASK_H

#include "base/base.h"
#include "batch_layout.h"

#include <nebel/scene.h>

typedef struct nb_alpha_mask {
    int32_t number; /* of the texture */
    float cutoff;   /* as the meshes have it */
    uint32_t width, height;
    float threshold;      /* of alpha in bytes */
    uint32_t *corners;    /* alpha at the four corners of each cell, row after row: a byte each, by x, then y, from the
                             lowest one up. Cell 0 begins at the centre of texel 0, all are periodic */
    uint32_t *clearances; /* of each cell, a byte for each of the four ways of lines, as corners: the side of the square
                             of cells without an edge of a hole that begins there, at most 255; 0: it has one itself */
} nb_alpha_mask;

/* Errors: MEMORY. */
nebel_result nb_alpha_mask_make(nb_alpha_mask *mask, const nebel_allocator *allocator, const nebel_scene_data *scene,
                                int32_t number, float cutoff);
void nb_alpha_mask_free(nb_alpha_mask *mask, const nebel_allocator *allocator);

/* Whether there is a hole at these texture coordinates. What is no number is 0. */
int nb_alpha_mask_is_hole(const nb_alpha_mask *mask, float u, float v);

/* A stretch of a line without holes. */
typedef struct nb_solid {
    uint32_t line;
    double enter, leave;
} nb_solid;

/* The lines of a packet over a mask, each from s = 0 to 1. Its place at s is start + s way, in cells; never below 0. */
typedef struct nb_alpha_mask_walk {
    const nb_alpha_mask *mask;
    double start[2][NB_PACKET], way[2][NB_PACKET], inverse[2][NB_PACKET]; /* of the way; never infinite */
    uint32_t shift[NB_PACKET];                                            /* of the clearance for its way */
    double at[NB_PACKET];                                                 /* how far it has been walked */
    double since[NB_PACKET];           /* where it has come out of a hole; -1: it is in one */
    int is_over;                       /* all lines have been walked */
    nb_solid found[2 * NB_PACKET + 1]; /* by the last call */
    uint32_t count;
} nb_alpha_mask_walk;

/* Lines with more than so many texels along either axis, and those over a mask of more, are taken for solid. */
enum { NB_MASK_REACH = 1 << 20, NB_MASK_LARGEST = 1 << 30 };

/* Places between which lines run, in texels; 0 is the border of the first. */
typedef struct nb_alpha_mask_lines {
    double from[2][NB_PACKET], to[2][NB_PACKET];
    int is_asked[NB_PACKET];
} nb_alpha_mask_lines;

/* Lines that are not walked are found at once. */
void nb_alpha_mask_begin(nb_alpha_mask_walk *walk, const nb_alpha_mask *mask, const nb_alpha_mask_lines *lines);

/* Finds more stretches, those of a line one after the other; 0 where there are none left. */
int nb_alpha_mask_next(nb_alpha_mask_walk *walk);

#endif
