/* Pictures over a span of time: each sample of a pixel has a time of its own, so that what moves is blurred. */
#ifndef NB_SHUTTER_H
#define NB_SHUTTER_H

#include "aov.h"

#include <stddef.h>
#include <stdint.h>

/* The time of a sample of a pixel, 0 to 1 of the span: in the middle of one of `count` equal parts, each of which has
 * one sample. Times do not follow the samples' places in the pixel. */
double nb_shutter_time(uint32_t sample, uint32_t count);

/* Sums of planes of so many pixels. */
typedef struct nb_shutter {
    float *sums[NB_LAYER_COUNT]; /* NULL: there is no such plane */
    uint16_t *hits;              /* samples that hit a surface */
    uint32_t count;              /* samples so far */
} nb_shutter;

/* Sums for the planes that are not NULL. 0: memory is out. Free in any case. */
int nb_shutter_open(nb_shutter *shutter, float *const planes[NB_LAYER_COUNT], size_t pixels);

/* Begins a picture; adds the planes of one sample of each pixel; gives what a frame of all of them has. */
void nb_shutter_begin(nb_shutter *shutter);
void nb_shutter_add(nb_shutter *shutter, float *const planes[NB_LAYER_COUNT], size_t pixels);
void nb_shutter_finish(const nb_shutter *shutter, float *const planes[NB_LAYER_COUNT], size_t pixels);

void nb_shutter_free(nb_shutter *shutter);

#endif
