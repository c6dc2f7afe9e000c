/* Every question here is one linear program: how far does the body reach along `objective`?
 *
 *     primal: maximise objective . x, where a_i . x <= d_i
 *     dual:   minimise sum y_i d_i, where sum y_i a_i = objective and y >= 0
 *
 * in three dimensions for the bounds and in four, with rows (n_i, 1), for the largest ball. It is solved on the dual
 * side by the revised simplex method: a basis of as many planes as dimensions, one pass over all planes to find the
 * most violated, one exchange. A cube around everything gives the first basis and makes the program bounded.
 *
 * What makes this robust: any y >= 0 bounds the answer from above (weak duality), whatever happened on the way, so
 * rounding and a premature end cost tightness and never truth.
 *
 * Source: Dantzig, Linear Programming and Extensions (1963), chapters 6 and 9; Bland, New finite pivoting rules (1977).
 */
#include "convex.h"

#include <float.h>
#include <math.h>
#include <string.h>

enum { DIMENSION = 4, CUBE_FACES = 6 };

/* Largest violation enters at first, which needs few steps; after that the smallest index, which cannot cycle. */
enum { GREEDY_STEPS = 60, STEPS = 400 };

/* The cube's half edge, in units of the largest distance: three attempts, each only if the last one ran into the cube.
 */
static const double cube_factors[] = {8, 8.0 * 65536, 8.0 * 65536 * 65536};
enum { ATTEMPTS = 3 };

/* Weights up to this are rounding of zero; what is lost by dropping them goes into the slack. */
static const double weight_rounding = 1e-14;

typedef struct linear_program {
    const double (*planes)[4];
    size_t count;
    int dimension;
    double cube;
    double objective[DIMENSION];
} linear_program;

typedef struct plane_row {
    double a[DIMENSION];
    double d;
} plane_row;

typedef struct plane_basis {
    size_t member[DIMENSION];
    double weight[DIMENSION];
} plane_basis;

/* What a basis proves: objective . x <= value + slack . |x|. */
typedef struct proof {
    double value;     /* sum of y d */
    double magnitude; /* sum of y |d|: rounding of value is relative to it */
    double slack[3];
    int leans_on_cube;
} proof;

/* Rows: the planes, the faces of the cube, and in four dimensions a lid on the radius. */
static size_t row_count(const linear_program *p)
{
    return p->count + CUBE_FACES + (p->dimension == DIMENSION ? 1 : 0);
}

static plane_row row_at(const linear_program *p, size_t index)
{
    plane_row r = {{0}, p->cube};
    if (index < p->count) {
        memcpy(r.a, p->planes[index], 3 * sizeof(double));
        r.a[3] = 1;
        r.d = p->planes[index][3];
    } else if (index < p->count + CUBE_FACES) {
        const size_t face = index - p->count;
        r.a[face / 2] = face % 2 == 0 ? 1 : -1;
    } else {
        r.a[3] = 1;
    }
    return r;
}

/* Solves matrix * x = right with row exchange; the answer replaces `right`. 0 when singular. */
static int solve(int n, double matrix[DIMENSION][DIMENSION], double right[DIMENSION])
{
    for (int k = 0; k < n; k++) {
        int best = k;
        for (int i = k + 1; i < n; i++)
            if (fabs(matrix[i][k]) > fabs(matrix[best][k])) best = i;
        if (!(fabs(matrix[best][k]) > 0)) return 0;
        for (int j = 0; j < n; j++) {
            const double swap = matrix[k][j];
            matrix[k][j] = matrix[best][j];
            matrix[best][j] = swap;
        }
        const double swap = right[k];
        right[k] = right[best];
        right[best] = swap;
        for (int i = k + 1; i < n; i++) {
            const double factor = matrix[i][k] / matrix[k][k];
            for (int j = k; j < n; j++) matrix[i][j] -= factor * matrix[k][j];
            right[i] -= factor * right[k];
        }
    }
    for (int k = n - 1; k >= 0; k--) {
        for (int j = k + 1; j < n; j++) right[k] -= matrix[k][j] * right[j];
        right[k] /= matrix[k][k];
    }
    return 1;
}

/* The corner where the planes of the basis meet. */
static int find_corner(const linear_program *p, const plane_basis *b, double corner[DIMENSION])
{
    double matrix[DIMENSION][DIMENSION];
    for (int i = 0; i < p->dimension; i++) {
        const plane_row r = row_at(p, b->member[i]);
        memcpy(matrix[i], r.a, sizeof r.a);
        corner[i] = r.d;
    }
    return solve(p->dimension, matrix, corner);
}

/* `target` as a combination of the normals of the basis. */
static int find_combination(const linear_program *p, const plane_basis *b, const double target[DIMENSION],
                            double weights[DIMENSION])
{
    double matrix[DIMENSION][DIMENSION];
    for (int i = 0; i < p->dimension; i++) {
        const plane_row r = row_at(p, b->member[i]);
        for (int k = 0; k < p->dimension; k++) matrix[k][i] = r.a[k];
    }
    memcpy(weights, target, DIMENSION * sizeof(double));
    return solve(p->dimension, matrix, weights);
}

/* How far the corner is outside a row, beyond what rounding explains; <= 0: it is not. */
static double violation(const double a[3], double radius_share, double d, const double corner[DIMENSION])
{
    const double x = a[0] * corner[0], y = a[1] * corner[1], z = a[2] * corner[2], r = radius_share * corner[3];
    const double size = fabs(x) + fabs(y) + fabs(z) + fabs(r) + fabs(d);
    return x + y + z + r - d - 8 * DBL_EPSILON * size;
}

/* The row that shall enter the basis; row_count when none does: the basis is optimal. */
static size_t choose_entering(const linear_program *p, const double corner[DIMENSION], int greedy)
{
    const double share = p->dimension == DIMENSION ? 1 : 0;
    const size_t rows = row_count(p);
    size_t chosen = rows;
    double worst = 0;
    for (size_t i = 0; i < p->count; i++) {
        const double v = violation(p->planes[i], share, p->planes[i][3], corner);
        if (!(v > worst)) continue;
        chosen = i;
        if (!greedy) return chosen;
        worst = v;
    }
    for (size_t i = p->count; i < rows; i++) {
        const plane_row r = row_at(p, i);
        const double v = violation(r.a, r.a[3], r.d, corner);
        if (!(v > worst)) continue;
        chosen = i;
        if (!greedy) return chosen;
        worst = v;
    }
    return chosen;
}

/* The member whose weight falls to zero first as the new row comes in; -1 when none falls. Of equals the one with the
 * largest share leaves (a well conditioned basis remains), or the smallest index where cycling has to be ruled out. */
static int choose_leaving(const linear_program *p, const plane_basis *b, const double share[DIMENSION], int greedy)
{
    int chosen = -1;
    double least = HUGE_VAL;
    for (int i = 0; i < p->dimension; i++) {
        if (!(share[i] > 1e-13)) continue;
        const double ratio = fmax(b->weight[i], 0) / share[i];
        const int tie = chosen >= 0 && fabs(ratio - least) <= 1e-15 * (1 + least);
        const int preferred = tie && (greedy ? share[i] > share[chosen] : b->member[i] < b->member[chosen]);
        if (chosen < 0 || preferred || (!tie && ratio < least)) {
            chosen = i;
            least = ratio;
        }
    }
    return chosen;
}

/* The corner of the cube that lies furthest along the objective. */
static plane_basis first_basis(const linear_program *p)
{
    plane_basis b = {{0}, {0}};
    for (int k = 0; k < p->dimension; k++) {
        const size_t face = k < 3 ? 2 * (size_t)k + (p->objective[k] < 0 ? 1 : 0) : CUBE_FACES;
        b.member[k] = p->count + face;
        b.weight[k] = fabs(p->objective[k]);
    }
    return b;
}

static plane_basis optimize(const linear_program *p)
{
    plane_basis b = first_basis(p);
    for (int step = 0; step < STEPS; step++) {
        const int greedy = step < GREEDY_STEPS;
        double corner[DIMENSION] = {0}, share[DIMENSION];
        if (!find_corner(p, &b, corner)) break;
        const size_t entering = choose_entering(p, corner, greedy);
        if (entering == row_count(p)) break;
        const plane_row r = row_at(p, entering);
        if (!find_combination(p, &b, r.a, share)) break;
        const int leaving = choose_leaving(p, &b, share, greedy);
        if (leaving < 0) break;
        plane_basis next = b;
        next.member[leaving] = entering;
        if (!find_combination(p, &next, p->objective, next.weight)) break;
        b = next;
    }
    return b;
}

static proof prove(const linear_program *p, const plane_basis *b)
{
    proof result = {0};
    double sum[3] = {0}, size[3] = {0};
    for (int i = 0; i < p->dimension; i++) {
        const plane_row r = row_at(p, b->member[i]);
        const double y = b->weight[i];
        if (!(y > weight_rounding)) continue;
        result.value += y * r.d;
        result.magnitude += y * fabs(r.d);
        if (b->member[i] >= p->count) result.leans_on_cube = 1;
        for (int k = 0; k < 3; k++) {
            sum[k] += y * r.a[k];
            size[k] += fabs(y * r.a[k]);
        }
    }
    for (int k = 0; k < 3; k++) {
        const int exact = size[k] == fabs(p->objective[k]) && sum[k] == p->objective[k];
        result.slack[k] = exact ? 0 : fabs(sum[k] - p->objective[k]) + 4 * DBL_EPSILON * size[k];
    }
    return result;
}

static double largest_distance(const double (*planes)[4], size_t n)
{
    double largest = 0;
    for (size_t i = 0; i < n; i++) largest = fmax(largest, fabs(planes[i][3]));
    return largest > 0 ? largest : 1;
}

/* Grows the cube until the answer does not lean on it. `good_enough` ends the search early. */
static proof solve_program(linear_program *p, double scale, int (*good_enough)(const proof *))
{
    proof result = {0};
    for (int attempt = 0; attempt < ATTEMPTS; attempt++) {
        p->cube = cube_factors[attempt] * scale;
        const plane_basis b = optimize(p);
        result = prove(p, &b);
        if (good_enough(&result)) break;
    }
    return result;
}

static int holds_ball(const proof *result)
{
    return result->value > 16 * DBL_EPSILON * result->magnitude;
}

static int leans_on_planes_only(const proof *result)
{
    return !result->leans_on_cube;
}

/* Without a ball and against the cube: a larger cube may hold one. */
static int decides_emptiness(const proof *result)
{
    return holds_ball(result) || leans_on_planes_only(result);
}

static int has_interior(const double (*planes)[4], size_t n, double scale)
{
    linear_program p = {planes, n, DIMENSION, 0, {0, 0, 0, 1}};
    const proof result = solve_program(&p, scale, decides_emptiness);
    return holds_ball(&result);
}

static double cube_reach(const proof *result, const double extent[3])
{
    if (result->leans_on_cube) return HUGE_VAL;
    double bound = result->value + 8 * DBL_EPSILON * result->magnitude;
    for (int k = 0; k < 3; k++) {
        if (result->slack[k] > 1e-6) return HUGE_VAL;
        bound += result->slack[k] * extent[k];
    }
    return bound;
}

/* An upper bound of |coordinate| of the body per axis. The bounds without slack of their own axes, doubled: as the
 * slack is at most 1e-6, what it can still add to itself is far less than that. An endless axis ends where the program
 * ended. */
static void find_extent(const proof faces[CUBE_FACES], double cube, double extent[3])
{
    const double infinity = HUGE_VAL;
    double largest = 0;
    for (int k = 0; k < 3; k++) {
        const int endless = faces[2 * k].leans_on_cube || faces[2 * k + 1].leans_on_cube;
        extent[k] = endless ? cube : 0;
    }
    for (int face = 0; face < CUBE_FACES; face++) {
        const double bound = fabs(cube_reach(&faces[face], extent));
        if (bound < infinity) largest = fmax(largest, bound);
    }
    for (int k = 0; k < 3; k++)
        if (!(extent[k] > 0)) extent[k] = 2 * largest;
}

int nb_convex_bounds(const double (*planes)[4], size_t n, double low[3], double high[3])
{
    const double scale = largest_distance(planes, n);
    if (!has_interior(planes, n, scale)) return 0;

    proof faces[CUBE_FACES];
    for (int face = 0; face < CUBE_FACES; face++) {
        linear_program p = {planes, n, 3, 0, {0}};
        p.objective[face / 2] = face % 2 == 0 ? 1 : -1;
        faces[face] = solve_program(&p, scale, leans_on_planes_only);
    }
    double extent[3];
    find_extent(faces, cube_factors[ATTEMPTS - 1] * scale, extent);
    for (int k = 0; k < 3; k++) {
        high[k] = cube_reach(&faces[2 * k], extent);
        low[k] = -cube_reach(&faces[2 * k + 1], extent);
    }
    return 1;
}
