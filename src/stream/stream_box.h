/* A box of constant density, as the stream kernels take it. */
#ifndef NB_STREAM_STREAM_BOX_H
#define NB_STREAM_STREAM_BOX_H

typedef struct nb_fog_box {
    float low[3], high[3]; /* relative to the origin of the stream */
    float extinction;      /* 1/m */
} nb_fog_box;

/* The most boxes that a kernel takes; more are better asked through the tree. */
enum { NB_FOG_BOXES = 64 };

#endif
