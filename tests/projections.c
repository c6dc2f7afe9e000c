#include "projections.h"

#include <math.h>
#include <string.h>

matrix multiply(matrix a, matrix b)
{
    matrix out = {{0}};
    for (int i = 0; i < 64; i++) out.m[i / 16 * 4 + i % 4] += a.m[i / 4 % 4 * 4 + i % 4] * b.m[i / 16 * 4 + i / 4 % 4];
    return out;
}

/* Solves a x = right by elimination with pivots. */
static void solve(matrix a, const double right[4], long double x[4])
{
    long double r[4][5];
    for (int i = 0; i < 4; i++) {
        for (int k = 0; k < 4; k++) r[i][k] = (long double)a.m[4 * k + i];
        r[i][4] = (long double)right[i];
    }
    for (int k = 0; k < 4; k++) {
        int best = k;
        for (int i = k; i < 4; i++) best = fabsl(r[i][k]) > fabsl(r[best][k]) ? i : best;
        for (int c = 0; c < 5; c++) {
            const long double swapped = r[k][c];
            r[k][c] = r[best][c];
            r[best][c] = swapped;
        }
        for (int i = 0; i < 4; i++) {
            const long double factor = i == k ? 0 : r[i][k] / r[k][k];
            for (int c = k; c < 5; c++) r[i][c] -= factor * r[k][c];
        }
    }
    for (int i = 0; i < 4; i++) x[i] = r[i][4] / r[i][i];
}

static double z_near(range r)
{
    return r.reversed ? 1 : r.low;
}

static double z_far(range r)
{
    return r.reversed ? r.low : 1;
}

/* The third row of a projection whose normalized depth is z_near at `near` and z_far at `far` metres along -z. */
static void set_depth_row(matrix *p, range r, double near, double far)
{
    const double ratio = near / far;
    p->m[10] = isinf(far) ? -z_far(r) : -(z_far(r) - z_near(r) * ratio) / (1 - ratio);
    p->m[14] = near * (z_near(r) + p->m[10]);
}

matrix frustum(range r, double left, double right, double bottom, double top, double near, double far)
{
    matrix p = {{0}};
    p.m[0] = 2 / (right - left);
    p.m[5] = 2 / (top - bottom);
    p.m[8] = (right + left) / (right - left);
    p.m[9] = (top + bottom) / (top - bottom);
    p.m[11] = -1;
    set_depth_row(&p, r, near, far);
    return p;
}

static matrix perspective(range r)
{
    return frustum(r, -.8, .8, -.5, .5, .1, 1000);
}

static matrix infinite(range r)
{
    return frustum(r, -.8, .8, -.5, .5, .1, HUGE_VAL);
}

static matrix off_axis_tile(range r)
{
    return frustum(r, 1.5, 1.6, -.7, -.64, .1, 1000);
}

static matrix orthographic(range r)
{
    matrix p = {{1. / 40, 0, 0, 0, 0, 1. / 25, 0, 0, 0, 0, 0, 0, .3, -.2, 0, 1}};
    const double near = 1, far = 300;
    p.m[10] = (z_near(r) - z_far(r)) / (far - near);
    p.m[14] = z_near(r) + p.m[10] * near;
    return p;
}

/* An eye beside the origin of eye space, as stereo projections have it, and a mirrored picture. */
static matrix stereo(range r)
{
    const matrix aside = {{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, .032, 0, 0, 1}};
    const matrix mirror = {{1, 0, 0, 0, 0, -1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1}};
    return multiply(mirror, multiply(frustum(r, -.75, .85, -.5, .5, .1, 500), aside));
}

/* Looking along +z. */
static matrix left_handed(range r)
{
    matrix p = perspective(r);
    for (int i = 8; i < 12; i++) p.m[i] = -p.m[i];
    return p;
}

/* The near plane is n.p + d = 0 in eye space: the third row is made such that it is met at z_near there. */
static matrix oblique(range r)
{
    const double plane[4] = {.1, .7, -.9, -2};
    matrix p = perspective(r);
    const double grow = z_far(r) - z_near(r);
    for (int i = 0; i < 4; i++) p.m[4 * i + 2] = grow * .8 * plane[i] + z_near(r) * p.m[4 * i + 3];
    return p;
}

const projection_kind projections[PROJECTIONS] = {
    [PERSPECTIVE] = {"perspective", perspective, 0},  [INFINITE] = {"infinite", infinite, 0},
    [OFF_AXIS] = {"off-axis tile", off_axis_tile, 0}, [STEREO] = {"stereo", stereo, 0},
    [LEFT_HANDED] = {"left-handed", left_handed, 0},  [ORTHOGRAPHIC] = {"orthographic", orthographic, 1},
    [OBLIQUE] = {"oblique near plane", oblique, 1},
};

matrix look(const double eye[3], double yaw, double pitch)
{
    const matrix turn = {{cos(yaw), 0, -sin(yaw), 0, 0, 1, 0, 0, sin(yaw), 0, cos(yaw), 0, 0, 0, 0, 1}};
    const matrix nod = {{1, 0, 0, 0, 0, cos(pitch), sin(pitch), 0, 0, -sin(pitch), cos(pitch), 0, 0, 0, 0, 1}};
    const matrix move = {{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, -eye[0], -eye[1], -eye[2], 1}};
    return multiply(nod, multiply(turn, move));
}

void unproject(const nebel_view *view, double x, double y, double n, long double point[3])
{
    const double device[4] = {2 * x / view->width - 1, 2 * y / view->height - 1, n, 1};
    matrix clip, eye;
    memcpy(clip.m, view->clip_from_eye, sizeof clip.m);
    memcpy(eye.m, view->eye_from_world, sizeof eye.m);
    long double in_eye[4], in_world[4];
    double divided[4];
    solve(clip, device, in_eye);
    for (int i = 0; i < 4; i++) divided[i] = (double)(in_eye[i] / in_eye[3]);
    solve(eye, divided, in_world);
    for (int i = 0; i < 3; i++) point[i] = in_world[i];
}

static long double row(const double m[16], int i, const long double point[3])
{
    return (long double)m[i] * point[0] + (long double)m[4 + i] * point[1] + (long double)m[8 + i] * point[2] +
           (long double)m[12 + i];
}

/* Clip w of a point of the world. */
static long double clip_w(const nebel_view *view, const long double world[3])
{
    long double eye[3];
    for (int i = 0; i < 3; i++) eye[i] = row(view->eye_from_world, i, world);
    return row(view->clip_from_eye, 3, eye);
}

/* Two points that any depths have, whichever they are, give the line; w says where it comes from. */
line line_of(const nebel_view *view, double x, double y)
{
    long double a[3], b[3], square = 0, start;
    line found;
    unproject(view, x, y, .2, a);
    unproject(view, x, y, .21, b);
    for (int i = 0; i < 3; i++) square += (b[i] - a[i]) * (b[i] - a[i]);
    for (int i = 0; i < 3; i++) found.direction[i] = (b[i] - a[i]) / sqrtl(square);
    for (int i = 0; i < 3; i++) b[i] = a[i] + found.direction[i];
    const long double w = clip_w(view, a), growth = clip_w(view, b) - w;
    if (view->clip_from_eye[15] == 1) {
        const long double fall = row(view->eye_from_world, 2, a) - row(view->eye_from_world, 2, b);
        for (int i = 0; i < 3 && fall < 0; i++) found.direction[i] = -found.direction[i];
        start = row(view->eye_from_world, 2, a) / fabsl(fall);
    } else {
        for (int i = 0; i < 3 && growth < 0; i++) found.direction[i] = -found.direction[i];
        start = -w / fabsl(growth);
    }
    for (int i = 0; i < 3; i++) found.origin[i] = a[i] + start * found.direction[i];
    return found;
}

static void transform(const double m[16], const double from[4], double to[4])
{
    memset(to, 0, 4 * sizeof *to);
    for (int i = 0; i < 16; i++) to[i % 4] += m[i] * from[i / 4];
}

int project(const nebel_view *view, range r, const double point[3], double place[2], double *n)
{
    const double world[4] = {point[0], point[1], point[2], 1};
    double eye[4], clip[4];
    transform(view->eye_from_world, world, eye);
    transform(view->clip_from_eye, eye, clip);
    const double x = clip[0] / clip[3], y = clip[1] / clip[3];
    *n = clip[2] / clip[3];
    place[0] = (x + 1) / 2 * view->width;
    place[1] = (y + 1) / 2 * view->height;
    return clip[3] > 0 && fabs(x) <= 1 && fabs(y) <= 1 && *n >= r.low && *n <= 1;
}

double normalized(range r, double first, double last, double depth)
{
    return r.low + (1 - r.low) * (depth - first) / (last - first);
}

double stored(range r, double first, double last, double n)
{
    return first + (last - first) * (n - r.low) / (1 - r.low);
}
