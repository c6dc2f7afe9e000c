#include "formula_inputs.h"

#include <float.h>
#include <math.h>
#include <string.h>

/* ---- numbers --------------------------------------------------------------------------------- */

static unsigned long long bits(nb_formula_dice *dice)
{
    dice->state = dice->state * 6364136223846793005u + 1442695040888963407u;
    const unsigned long long mixed = (dice->state ^ (dice->state >> 29)) * 0x9fb21c651e98df25u;
    return (mixed ^ (mixed >> 32)) >> 11;
}

long double nb_formula_between(nb_formula_dice *dice, long double low, long double high)
{
    const long double unit = (long double)bits(dice) * 0x1p-53L + (long double)bits(dice) * 0x1p-106L;
    return low + (high - low) * unit;
}

int nb_formula_pick(nb_formula_dice *dice, int count)
{
    return (int)(bits(dice) % (unsigned)count);
}

static long double between(nb_formula_dice *dice, long double low, long double high)
{
    return nb_formula_between(dice, low, high);
}

/* 10^low to 10^high, each decade as likely */
static long double decade(nb_formula_dice *dice, long double low, long double high)
{
    return powl(10, between(dice, low, high));
}

static long double either_sign(nb_formula_dice *dice, long double x)
{
    return nb_formula_pick(dice, 2) ? x : -x;
}

long double nb_formula_unit(nb_formula_digits digits)
{
    const long double units[] = {(long double)FLT_EPSILON / 2, (long double)DBL_EPSILON / 2, LDBL_EPSILON / 2};
    return units[digits];
}

long double nb_formula_round(nb_formula_digits digits, long double x)
{
    if (digits == NB_DIGITS_FLOAT) return (long double)(float)x;
    if (digits == NB_DIGITS_DOUBLE) return (long double)(double)x;
    return x;
}

/* ---- vectors --------------------------------------------------------------------------------- */

static long double dot(const long double *a, const long double *b)
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static void random_unit(nb_formula_dice *dice, long double v[3])
{
    long double length;
    do {
        for (int i = 0; i < 3; ++i) v[i] = between(dice, -1, 1);
        length = sqrtl(dot(v, v));
    } while (length < 0.01L || length > 1);
    for (int i = 0; i < 3; ++i) v[i] /= length;
}

/* A direction at right angles to n. */
static void random_tangent(nb_formula_dice *dice, const long double n[3], long double v[3])
{
    random_unit(dice, v);
    const long double along = dot(v, n);
    for (int i = 0; i < 3; ++i) v[i] -= along * n[i];
}

/* ---- shapes ---------------------------------------------------------------------------------- */

static void draw_box(nb_formula_dice *dice, long double *in)
{
    for (int i = 0; i < 3; ++i) {
        in[6 + i] = between(dice, -2, 1);
        in[9 + i] = in[6 + i] + decade(dice, -3, 0.5L);
    }
}

static void draw_half_space(nb_formula_dice *dice, long double *in)
{
    random_unit(dice, in + 6);
    if (!nb_formula_pick(dice, 4)) in[6] = 0, in[7] = 1, in[8] = 0;
    in[9] = nb_formula_pick(dice, 4) ? between(dice, -3, 3) : 0;
    in[10] = either_sign(dice, 1);
}

/* The larger radius is 1, the smaller from 0 to 1. */
static void draw_cone(nb_formula_dice *dice, long double *in)
{
    const long double lesser = nb_formula_pick(dice, 3) ? between(dice, 0, 1) : 0;
    const int widens = nb_formula_pick(dice, 2);
    in[6] = widens ? lesser : 1;
    in[7] = widens ? 1 - lesser : lesser - 1;
}

static void draw_shape(nb_formula_dice *dice, nb_formula formula, long double *in)
{
    switch (formula) {
    case NB_FORMULA_box:
        draw_box(dice, in);
        break;
    case NB_FORMULA_half_space:
        draw_half_space(dice, in);
        break;
    case NB_FORMULA_ball:
        in[6] = nb_formula_pick(dice, 2) ? 1 : decade(dice, -2, 2);
        break;
    case NB_FORMULA_cone:
        draw_cone(dice, in);
        break;
    case NB_FORMULA_capsule:
        in[6] = nb_formula_pick(dice, 4) ? decade(dice, -2, 1.5L) : 0;
        break;
    default:
        break;
    }
}

/* A point of the surface and the normal there. Often close to the rim, where two parts of a body meet. */
static void surface_of_round(nb_formula_dice *dice, nb_formula formula, const long double *in, long double x[3],
                             long double n[3])
{
    const long double turn = between(dice, -4, 4);
    const long double length = formula == NB_FORMULA_capsule ? in[6] : 1;
    const long double rim = decade(dice, -18, -1) * length;
    const int side = nb_formula_pick(dice, 4);
    const long double z = side == 0 ? rim : side == 1 ? length - rim : between(dice, 0, length);
    const int is_cone = formula == NB_FORMULA_cone;
    const long double radius = is_cone ? in[6] + in[7] * z : 1;
    const long double steep = is_cone ? -in[7] : 0;
    const long double size = sqrtl(1 + steep * steep);
    x[0] = radius * cosl(turn), x[1] = radius * sinl(turn), x[2] = z;
    n[0] = cosl(turn) / size, n[1] = sinl(turn) / size, n[2] = steep / size;
}

static void surface_of(nb_formula_dice *dice, nb_formula formula, const long double *in, long double x[3],
                       long double n[3])
{
    random_unit(dice, n);
    if (formula == NB_FORMULA_box) {
        for (int i = 0; i < 3; ++i) {
            const int face = nb_formula_pick(dice, 3);
            x[i] = face == 0 ? in[6 + i] : face == 1 ? in[9 + i] : between(dice, in[6 + i], in[9 + i]);
        }
    } else if (formula == NB_FORMULA_half_space) {
        for (int i = 0; i < 3; ++i) n[i] = in[6 + i], x[i] = n[i] * in[9];
    } else if (formula == NB_FORMULA_ball) {
        for (int i = 0; i < 3; ++i) x[i] = n[i] * in[6];
    } else if (formula == NB_FORMULA_capsule && nb_formula_pick(dice, 2)) {
        for (int i = 0; i < 3; ++i) x[i] = n[i];
        if (n[2] > 0) x[2] += in[6];
    } else {
        surface_of_round(dice, formula, in, x, n);
    }
}

static void step_back(long double *in, long double distance)
{
    for (int i = 0; i < 3; ++i) in[i] -= in[3 + i] * distance;
}

/* Touches the surface but for a distance of 1e-18 to 1e-2. */
static void aim_to_graze(nb_formula_dice *dice, nb_formula formula, long double *in)
{
    long double x[3], n[3];
    surface_of(dice, formula, in, x, n);
    random_tangent(dice, n, in + 3);
    const long double height = either_sign(dice, nb_formula_pick(dice, 8) ? decade(dice, -18, -2) : 0);
    for (int i = 0; i < 3; ++i) in[i] = x[i] + n[i] * height;
    step_back(in, nb_formula_pick(dice, 4) ? decade(dice, -1, 3) : 0);
}

/* Nearly or exactly along the z axis of the shape. */
static void aim_along_axis(nb_formula_dice *dice, long double *in)
{
    const int exact = nb_formula_pick(dice, 2);
    for (int i = 0; i < 2; ++i) {
        in[i] = between(dice, -1.2L, 1.2L);
        in[3 + i] = either_sign(dice, exact ? 0 : decade(dice, -12, -1));
    }
    in[2] = between(dice, -5, 5);
    in[5] = either_sign(dice, 1);
}

/* Parallel to a side of the cone but for a little, so that the square term vanishes. */
static void aim_along_side(nb_formula_dice *dice, nb_formula formula, long double *in)
{
    long double x[3], n[3];
    surface_of_round(dice, formula, in, x, n);
    const long double slope = formula == NB_FORMULA_cone ? in[7] : 0;
    const long double turn = atan2l(n[1], n[0]);
    const long double tilt = nb_formula_pick(dice, 2) ? 0 : either_sign(dice, decade(dice, -17, -2));
    in[3] = slope * cosl(turn) + tilt, in[4] = slope * sinl(turn), in[5] = 1;
    for (int i = 0; i < 3; ++i) in[i] = x[i] + between(dice, -0.7L, 0.7L);
    step_back(in, between(dice, -2, 4));
}

/* Through the tip where there is one. */
static void aim_at_apex(nb_formula_dice *dice, nb_formula formula, long double *in)
{
    const long double miss = nb_formula_pick(dice, 2) ? 0 : decade(dice, -18, -3);
    random_unit(dice, in + 3);
    in[0] = either_sign(dice, miss), in[1] = either_sign(dice, miss);
    in[2] = formula == NB_FORMULA_cone && in[7] != 0 ? -in[6] / in[7] : 0;
    step_back(in, nb_formula_pick(dice, 4) ? decade(dice, -1, 2) : 0);
}

/* Along one axis or in one plane of the frame, with zeros of both signs. */
static void aim_along_frame(nb_formula_dice *dice, long double *in)
{
    for (int i = 0; i < 3; ++i) in[3 + i] = either_sign(dice, nb_formula_pick(dice, 2) ? 0 : 1);
    in[3 + nb_formula_pick(dice, 3)] = either_sign(dice, 1);
    for (int i = 0; i < 3; ++i) in[i] = between(dice, -1.2L, 1.2L) - 3 * in[3 + i];
}

static void aim_anywhere(nb_formula_dice *dice, nb_formula formula, long double *in)
{
    long double x[3], n[3];
    surface_of(dice, formula, in, x, n);
    random_unit(dice, in + 3);
    for (int i = 0; i < 3; ++i) in[i] = x[i] * between(dice, 0, 1.1L);
    const int from = nb_formula_pick(dice, 3);
    step_back(in, from == 0 ? 0 : from == 1 ? between(dice, -5, 5) : decade(dice, 0, 7));
}

static void aim(nb_formula_dice *dice, nb_formula formula, long double *in)
{
    switch (nb_formula_pick(dice, 8)) {
    case 0:
    case 1:
        aim_to_graze(dice, formula, in);
        break;
    case 2:
        aim_along_axis(dice, in);
        break;
    case 3:
        aim_along_side(dice, formula, in);
        break;
    case 4:
        aim_at_apex(dice, formula, in);
        break;
    case 5:
        aim_along_frame(dice, in);
        break;
    default:
        aim_anywhere(dice, formula, in);
        break;
    }
    const long double stretch = nb_formula_pick(dice, 2) ? 1 : decade(dice, -1, 1);
    for (int i = 3; i < 6; ++i) in[i] *= stretch;
}

/* As the march computes it: (distance + size) * 8 roundings, times 3 for the product with a normal, and what follows
 * for a half space: the noise of n.d, and of the height of a level ray. */
static void add_reach(nb_formula formula, nb_formula_digits digits, long double *in)
{
    const long double unit = nb_formula_unit(digits);
    long double size = 1;
    if (formula == NB_FORMULA_box)
        for (int i = 6; i < 12; ++i) size += fabsl(in[i]);
    if (formula == NB_FORMULA_ball || formula == NB_FORMULA_capsule || formula == NB_FORMULA_cone) size += in[6];
    const long double reach = (fabsl(in[0]) + fabsl(in[1]) + fabsl(in[2]) + size) * 8 * unit;
    in[12] = reach;
    if (formula == NB_FORMULA_half_space) {
        in[11] = 3 * reach + fabsl(in[9]) * 4 * unit;
        in[12] = 0;
        for (int i = 0; i < 3; ++i) in[12] += 16 * unit * fabsl(in[3 + i] * in[6 + i]);
        in[13] = in[11];
    }
}

static void draw_slab(nb_formula_dice *dice, long double *in)
{
    in[0] = either_sign(dice, decade(dice, -2, 4));
    in[1] = either_sign(dice, nb_formula_pick(dice, 6) ? decade(dice, -8, 0) : 0);
    in[2] = between(dice, -2, 1);
    in[3] = in[2] + decade(dice, -3, 2);
    in[4] = 0;
}

/* An interval, its slacks; some missed. */
static void draw_interval(nb_formula_dice *dice, long double *in)
{
    in[0] = between(dice, -4, 4);
    in[1] = in[0] + between(dice, -1, 4);
    in[2] = decade(dice, -12, -1);
    in[3] = decade(dice, -12, -1);
    if (!nb_formula_pick(dice, 8)) in[0] = 1e18L, in[1] = -1e18L, in[2] = in[3] = 0;
}

static void draw_around(nb_formula_dice *dice, long double *in)
{
    in[0] = either_sign(dice, decade(dice, -2, 5));
    in[1] = either_sign(dice, decade(dice, -9, 2));
    in[2] = decade(dice, -16, -6);
    in[3] = decade(dice, -16, -6);
}

static void draw_ray(nb_formula_dice *dice, nb_formula formula, nb_formula_digits digits, long double *in)
{
    draw_shape(dice, formula, in);
    aim(dice, formula, in);
    for (int i = 0; i < NB_FORMULA_INPUTS; ++i) in[i] = nb_formula_round(digits, in[i]);
    add_reach(formula, digits, in);
}

/* ---- profiles -------------------------------------------------------------------------------- */

/* A slope per metre, sometimes level. */
static long double draw_slope(nb_formula_dice *dice, long double low, long double high)
{
    return either_sign(dice, nb_formula_pick(dice, 8) ? decade(dice, low, high) : 0);
}

static void draw_height(nb_formula_dice *dice, long double *in)
{
    in[0] = nb_formula_pick(dice, 8) ? between(dice, -20, 60) : decade(dice, 1, 5);
    in[1] = draw_slope(dice, -9, 1);
    in[2] = nb_formula_pick(dice, 8) ? decade(dice, -3, 4) : 1e18L;
    const int ends_in_fog = in[0] > 0 && in[1] < 0 && nb_formula_pick(dice, 2);
    if (ends_in_fog) in[2] = (in[0] + between(dice, 0, 20)) / -in[1];
}

/* Near the ramp, exactly on its ends, and far enough away for digits to be lost. */
static void draw_linear(nb_formula_dice *dice, long double *in)
{
    const int from = nb_formula_pick(dice, 8);
    in[0] = from < 2 ? from : from == 2 ? either_sign(dice, decade(dice, 0, 5)) : between(dice, -2, 3);
    in[1] = draw_slope(dice, -6, 2);
    in[2] = decade(dice, -3, 3);
}

static void draw_gaussian(nb_formula_dice *dice, long double *in)
{
    in[0] = nb_formula_pick(dice, 4) ? decade(dice, -4, 1.7L) : 0;
    in[1] = nb_formula_pick(dice, 8) ? between(dice, -9, 9) : either_sign(dice, decade(dice, 1, 6));
    in[2] = in[1] + decade(dice, -4, 1.3L) + (nb_formula_pick(dice, 8) ? 0 : fabsl(in[1]));
    in[3] = decade(dice, -3, 2);
}

static void draw_radial(nb_formula_dice *dice, long double *in)
{
    in[0] = nb_formula_pick(dice, 2) ? between(dice, 0, 1) : decade(dice, -7, 0);
    const long double end = sqrtl(in[0]);
    in[1] = nb_formula_pick(dice, 3) ? between(dice, -end, end) : -end;
    in[2] = decade(dice, -4, 2);
    in[3] = (end - in[1]) / in[2] * (nb_formula_pick(dice, 3) ? between(dice, 0, 1) : 1);
}

/* How far a ray at q runs along k inside the box of half widths e. */
static long double way_out(const long double *q, const long double *k, const long double *e)
{
    long double way = 1e6L;
    for (int i = 0; i < 3; ++i)
        if (k[i] != 0) way = fminl(way, fmaxl((copysignl(e[i], k[i]) - q[i]) / k[i], 0));
    return way;
}

/* Boxes with and without a plateau, rays from inside, from a face, from close to an edge and a corner. */
static void draw_soft_edge(nb_formula_dice *dice, nb_formula_digits digits, long double *in)
{
    const int start = nb_formula_pick(dice, 4);
    long double d[3];
    random_unit(dice, d);
    const long double speed = decade(dice, -2, 1);
    for (int i = 0; i < 3; ++i) {
        const long double half = in[6 + i] = decade(dice, -1, 1.5L);
        const long double near = half * (1 - decade(dice, -9, -1));
        in[i] = i < start ? either_sign(dice, near) : between(dice, -half, half);
        in[3 + i] = nb_formula_pick(dice, 6) ? d[i] * speed : either_sign(dice, 0);
    }
    if (in[3] == 0 && in[4] == 0 && in[5] == 0) in[4] = speed;
    for (int i = 0; i < 9; ++i) in[i] = nb_formula_round(digits, in[i]);
    in[9] = way_out(in, in + 3, in + 6) * (nb_formula_pick(dice, 2) ? 1 : between(dice, 0, 1));
}

static void draw_integral(nb_formula_dice *dice, nb_formula formula, nb_formula_digits digits, long double *in)
{
    switch (formula) {
    case NB_FORMULA_height_integral:
    case NB_FORMULA_height_capped_integral:
        draw_height(dice, in);
        break;
    case NB_FORMULA_linear_integral:
        draw_linear(dice, in);
        break;
    case NB_FORMULA_gaussian_integral:
        draw_gaussian(dice, in);
        break;
    case NB_FORMULA_soft_edge_integral:
    case NB_FORMULA_soft_edge_density:
    case NB_FORMULA_soft_axis:
    case NB_FORMULA_soft_axis_kink:
    case NB_FORMULA_soft_edge_kink:
        draw_soft_edge(dice, digits, in);
        break;
    default:
        draw_radial(dice, in);
        break;
    }
}

/* ---- phase functions ------------------------------------------------------------------------- */

/* Peaks of all widths, on both sides, and turns from next to none to any. */
static void draw_phase(nb_formula_dice *dice, long double *in)
{
    const long double rest = decade(dice, -4, 0), g = either_sign(dice, 1 - rest);
    in[0] = rest * (2 - rest) * between(dice, 0, 1);
    in[1] = nb_formula_pick(dice, 3) ? between(dice, 0, 250) : 0;
    in[2] = rest * rest;
    in[3] = 2 * g;
    random_unit(dice, in + 6);
    random_unit(dice, in + 9);
    const long double aside = nb_formula_pick(dice, 2) ? decade(dice, -4, 0) : 1;
    for (int i = 0; i < 3; ++i) in[9 + i] = in[6 + i] + aside * (in[9 + i] - in[6 + i]);
    const long double length = sqrtl(dot(in + 9, in + 9));
    for (int i = 0; i < 3; ++i) in[9 + i] /= length;
}

/* ---- point lights ----------------------------------------------------------------------------------- */

/* Distances whose differences are exact. */
static void draw_light(nb_formula_dice *dice, nb_formula formula, long double *in)
{
    if (formula == NB_FORMULA_light_fluence) {
        in[0] = decade(dice, -8, 12);
        in[1] = decade(dice, -6, 2);
        return;
    }
    if (formula == NB_FORMULA_light_cone) {
        in[1] = between(dice, -1, 0.9L);
        in[2] = decade(dice, 0, 2);
        in[0] = between(dice, in[1], 1);
        return;
    }
    in[0] = floorl(between(dice, -4096, 4096)) / 64;
    in[1] = between(dice, 4, 50);
    in[2] = floorl(between(dice, 0, 4096)) / 64;
    in[3] = in[2] + floorl(between(dice, 1, 4096)) / 64;
    in[4] = between(dice, 0, 1);
}

/* ---- values ---------------------------------------------------------------------------------- */

static void draw_value(nb_formula_dice *dice, nb_formula formula, long double *in)
{
    for (int i = 0; i < 3; ++i) in[i] = either_sign(dice, decade(dice, -4, 1.5L));
    if (formula == NB_FORMULA_bounded_length) in[0] = decade(dice, -3, 30);
    if (formula == NB_FORMULA_radial_1_density || formula == NB_FORMULA_radial_2_density ||
        formula == NB_FORMULA_radial_3_density)
        draw_radial(dice, in);
    if (formula == NB_FORMULA_gather || formula == NB_FORMULA_gaussian_density) in[0] = fabsl(in[0]);
    if (formula == NB_FORMULA_gather) in[1] = decade(dice, -12, 3);
    if (formula == NB_FORMULA_fog_linear && !nb_formula_pick(dice, 4)) in[2] = in[1];
    if (formula == NB_FORMULA_fog_linear && !nb_formula_pick(dice, 4)) in[0] = in[nb_formula_pick(dice, 2) + 1];
}

void nb_formula_draw(nb_formula_dice *dice, nb_formula formula, nb_formula_digits digits,
                     long double in[NB_FORMULA_INPUTS])
{
    memset(in, 0, NB_FORMULA_INPUTS * sizeof in[0]);
    if (formula == NB_FORMULA_meet || formula == NB_FORMULA_hull) {
        draw_interval(dice, in);
        draw_interval(dice, in + 4);
    } else if (formula == NB_FORMULA_slab) {
        draw_slab(dice, in);
    } else if (formula == NB_FORMULA_around) {
        draw_around(dice, in);
    } else if (formula <= NB_FORMULA_capsule) {
        draw_ray(dice, formula, digits, in);
    } else if (formula <= NB_FORMULA_soft_edge_integral ||
               (formula >= NB_FORMULA_soft_edge_density && formula <= NB_FORMULA_soft_edge_kink)) {
        draw_integral(dice, formula, digits, in);
    } else if (formula >= NB_FORMULA_phase_lobe && formula <= NB_FORMULA_turn_ahead) {
        draw_phase(dice, in);
    } else if (formula >= NB_FORMULA_light_fluence && formula <= NB_FORMULA_swing_rate) {
        draw_light(dice, formula, in);
    } else {
        draw_value(dice, formula, in);
    }
    for (int i = 0; i < NB_FORMULA_INPUTS; ++i) in[i] = nb_formula_round(digits, in[i]);
}
