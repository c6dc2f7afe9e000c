/* Soft edges along lines, taken from the words of nebel.h: of the oracle of lit fog. */
#ifndef LIT_EDGE_H
#define LIT_EDGE_H

#include "lit_fog.h"

/* At t, within the shape; the line is in its coordinates. */
double lit_edge_at(const nebel_shape *s, double distance, const lit_line *local, double t);

/* Adds places where it may not be smooth. */
void lit_edge_cut(const nebel_shape *s, double distance, const lit_line *local, double a, double b, lit_cuts *cuts);

/* Whether the density is the least of the faces', and its integral then. */
int lit_edge_has_faces(const nebel_shape *s);
double lit_edge_amount_of_faces(const nebel_shape *s, double distance, const lit_line *local, double a, double b);

#endif
