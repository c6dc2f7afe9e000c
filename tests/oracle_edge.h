/* The oracle's soft edges of shapes that are no boxes, taken from the words of nebel.h. */
#ifndef ORACLE_EDGE_H
#define ORACLE_EDGE_H

#include "oracle_shape.h"

enum { ORACLE_EDGE_FACES = 32, ORACLE_EDGE_CUTS = 600 };

/* A ray beside a shape, in the shape's own coordinates relative to its middle or the start of its axis. */
typedef struct oracle_edge {
    const nebel_shape *shape;
    double distance;
    oracle_real o[3], d[3];
    oracle_real axis[3], length; /* of unit length; 0 where the shape has none */
    size_t face_count;
    oracle_real depth[ORACLE_EDGE_FACES], growth[ORACLE_EDGE_FACES]; /* below each face at t = 0, and per metre */
} oracle_edge;

oracle_edge oracle_edge_of(const nebel_shape *shape, double distance, const oracle_line *ray);

/* Where the density along the ray may not be smooth. Returns how many. */
size_t oracle_edge_cuts(const oracle_edge *edge, oracle_real cuts[ORACLE_EDGE_CUTS]);

/* At t, inside the shape. */
double oracle_edge_density(const oracle_edge *edge, long double t);

/* The same far behind all cuts: 0 for shapes that end. */
double oracle_edge_final(const oracle_edge *edge);

#endif
