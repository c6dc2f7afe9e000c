/* Affine maps: x goes to m[.][0..2] x + m[.][3]. */
#ifndef NB_MATH_AFFINE_H
#define NB_MATH_AFFINE_H

#include <nebel/nebel.h>

#include <stdbool.h>

typedef struct nb_affine {
    double m[3][4];
} nb_affine;

/* What the inner map does first and the outer then. */
nb_affine nb_affine_compose(const nb_affine *outer, const nb_affine *inner);

/* Scale, then rotation (a unit quaternion), then position. */
nb_affine nb_affine_from_transform(const nebel_transform *transform);

/* The way back. False where the map is flat, or sheared by more than the rounding of floats. */
bool nb_affine_to_transform(const nb_affine *map, nebel_transform *transform);

void nb_affine_apply(const nb_affine *map, const double place[3], double result[3]);

/* Makes the vector of `count` numbers a unit one, whatever its length. */
void nb_vector_normalize(double *vector, size_t count);

#endif
