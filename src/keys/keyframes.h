/* Numbers on their way between key frames: cubics through the keys, at rest at the first and the last. */
#ifndef NB_KEYS_KEYFRAMES_H
#define NB_KEYS_KEYFRAMES_H

#include <stdbool.h>
#include <stddef.h>

/* The interval that a frame is in, and the keys beside it. */
typedef struct nb_keyframes {
    size_t keys[4]; /* numbers of the key before the interval, those around it, and the one after; where there is none,
                       its neighbour */
    double frames[4];
    bool has_before, has_after;
    double s; /* 0 to 1: where in the interval */
} nb_keyframes;

/* Finds the interval among `count` ascending frames, `stride` bytes apart. False where the frame is not between the
 * first and the last of them: then keys[1] is the one that holds. */
bool nb_keyframes_find(const double *frames, size_t stride, size_t count, double frame, nb_keyframes *around);

/* The key nearer to the frame. */
size_t nb_keyframes_nearer(const nb_keyframes *around);

/* A number from its values at the four keys. Limited: never outside the range of the two around it. */
double nb_keyframes_between(const nb_keyframes *around, bool limited, const double values[4]);

#endif
