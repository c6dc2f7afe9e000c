/* The cloud of scene D: fractal value noise in a ball that is flattened to a box, three quarters of it empty. */
#ifndef NB_BENCH_NOISE_CLOUD_H
#define NB_BENCH_NOISE_CLOUD_H

#include <nebel/nebel.h>

enum { NB_CLOUD_SIDE = 128 };

/* Of bytes. NULL without memory. */
nebel_grid *nb_cloud_make(void);

#endif
