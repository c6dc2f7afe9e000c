/* What nebel should answer, found the slow way.
 *
 * The description is taken at its word and every number in it as exact. Where the ray may cross a surface is solved for
 * in 113 bits; what is inside is then asked of a point in the middle of each piece; and what the fog does there is
 * integrated numerically, except where it is the same all along the piece. No code and no formula file of the library
 * is used. */
#ifndef ORACLE_H
#define ORACLE_H

#include <nebel/nebel.h>

/* Transmittance T and in-scattering S of volumes[0..n-1] along the ray. *uncertainty bounds the absolute error of all
 * six; it is INFINITY where the description leaves the answer open or there is none: the ray lies in a surface (to
 * 1e-17), or endless light is not absorbed. Allocates; ends the program when memory is out. Not for several threads
 * before its first return. */
void oracle_trace(const nebel_volume_desc *volumes, size_t n, const double ambient[3], const nebel_ray *ray,
                  double T[3], double S[3], double *uncertainty);

/* The opacity limited as nebel_set_max_opacity says, 0: not. */
void oracle_limit(double max_opacity, double T[3], double S[3], double *uncertainty);

/* The same without closed forms for pieces of even fog: the oracle's own check. */
void oracle_trace_numerically(const nebel_volume_desc *volumes, size_t n, const double ambient[3], const nebel_ray *ray,
                              double T[3], double S[3], double *uncertainty);

#endif
