/* Densities along lines and their integrals, by brute force in double: the profiles of the oracle of lit fog. */
#ifndef LIT_DENSITY_H
#define LIT_DENSITY_H

#include "lit_fog.h"

/* The density of a volume along a line. */
typedef struct lit_medium {
    const lit_scene *scene;
    const nebel_volume_desc *volume;
    const lit_line *world;
    lit_line local;           /* in the coordinates of the shape, where the density follows it */
    double nearest, distance; /* of altitudes: where the line is next to the center, and how far from it there */
} lit_medium;

lit_medium lit_medium_on(const lit_fog *fog, size_t volume, const lit_line *l);

double lit_density_at(const lit_medium *m, double t);
double lit_density_amount(const lit_medium *m, double a, double b);
void lit_density_cut(const lit_medium *m, double a, double b, lit_cuts *cuts);

#endif
