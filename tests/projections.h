/* Cameras of every kind for the tests of views, and the way back from a pixel and its depth through the inverse of the
 * whole matrix. */
#ifndef PROJECTIONS_H
#define PROJECTIONS_H

#include <nebel/shader.h>

/* Column-major. */
typedef struct matrix {
    double m[16];
} matrix;

matrix multiply(matrix a, matrix b);

/* Clip z reaches from `low` to 1, and falls along the ray where reversed. */
typedef struct range {
    double low;
    int reversed;
} range;

/* A frustum whose normalized depth is at one end `near` metres along -z, at the other at `far`, which may be infinite.
 */
matrix frustum(range r, double left, double right, double bottom, double top, double near, double far);

enum { PERSPECTIVE, INFINITE, OFF_AXIS, STEREO, LEFT_HANDED, ORTHOGRAPHIC, OBLIQUE, PROJECTIONS };

/* `coarse`: floats of depth have few steps where points are far beside how far depth could reach, or near. */
typedef struct projection_kind {
    const char *name;
    matrix (*make)(range r);
    int coarse;
} projection_kind;

extern const projection_kind projections[PROJECTIONS];

/* From the world to an eye at `eye`, turned by yaw and pitch [rad]. */
matrix look(const double eye[3], double yaw, double pitch);

/* The point of the world at normalized depth n behind a place in the picture [pixels]. */
void unproject(const nebel_view *view, double x, double y, double n, long double point[3]);

/* The ray behind a place in the picture [pixels]: from where all rays meet, or from the plane across them through the
 * eye. */
typedef struct line {
    long double origin[3], direction[3];
} line;

line line_of(const nebel_view *view, double x, double y);

/* Where a point of the world is in the picture [pixels], and its normalized depth; 0 where it is outside. */
int project(const nebel_view *view, range r, const double point[3], double place[2], double *n);

/* Stored depth to normalized, and back, with a depth range from first to last. */
double normalized(range r, double first, double last, double stored);
double stored(range r, double first, double last, double n);

#endif
