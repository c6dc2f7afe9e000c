/* Interval arithmetic of first order over a triangle. A jet encloses a number that varies over the triangle, and its
 * derivatives along the three edges; every step of a formula takes jets to jets. */
#ifndef NB_CLASSIC_INTERVAL_JETS_H
#define NB_CLASSIC_INTERVAL_JETS_H

#include <math.h>

/* Stands for infinity, but without making NaNs of zeros. */
#define NB_ENDLESS 1e60

typedef struct interval {
    double low, high;
} interval;

typedef struct jet {
    interval value, along[3]; /* along the edges from corner 0 to 1, 1 to 2, 2 to 0 */
} jet;

/* Of numbers, so that no call of fmin has to think of NaNs. */
static inline double smaller(double a, double b)
{
    return a < b ? a : b;
}

static inline double larger(double a, double b)
{
    return a > b ? a : b;
}

/* ---- intervals ------------------------------------------------------------------------------- */

static inline interval hull(interval a, interval b)
{
    return (interval){smaller(a.low, b.low), larger(a.high, b.high)};
}

static inline interval hull_of(double a, double b, double c)
{
    return hull((interval){a < b ? a : b, a < b ? b : a}, (interval){c, c});
}

static inline interval scale(double s, interval a)
{
    return s >= 0 ? (interval){s * a.low, s * a.high} : (interval){s * a.high, s * a.low};
}

static inline interval multiply(interval a, interval b)
{
    return hull(scale(a.low, b), scale(a.high, b));
}

static inline interval add(interval a, interval b)
{
    return (interval){a.low + b.low, a.high + b.high};
}

static inline interval subtract(interval a, interval b)
{
    return (interval){a.low - b.high, a.high - b.low};
}

/* ---- jets ------------------------------------------------------------------------------------ */

static const interval endless = {-NB_ENDLESS, NB_ENDLESS};

static inline jet constant(double value)
{
    return (jet){{value, value}, {{0, 0}, {0, 0}, {0, 0}}};
}

static inline jet unknown(double low, double high)
{
    return (jet){{low, high}, {endless, endless, endless}};
}

/* A linear function of the place, from its values at the corners. */
static inline jet linear(const double at[3])
{
    jet a = {.value = hull_of(at[0], at[1], at[2])};
    for (int i = 0; i < 3; i++) a.along[i].low = a.along[i].high = at[(i + 1) % 3] - at[i];
    return a;
}

static inline jet sum(jet a, jet b)
{
    a.value = add(a.value, b.value);
    for (int i = 0; i < 3; i++) a.along[i] = add(a.along[i], b.along[i]);
    return a;
}

static inline jet difference(jet a, jet b)
{
    a.value = subtract(a.value, b.value);
    for (int i = 0; i < 3; i++) a.along[i] = subtract(a.along[i], b.along[i]);
    return a;
}

static inline jet times(double s, jet a)
{
    a.value = scale(s, a.value);
    for (int i = 0; i < 3; i++) a.along[i] = scale(s, a.along[i]);
    return a;
}

static inline jet product(jet a, jet b)
{
    jet p = {.value = multiply(a.value, b.value)};
    for (int i = 0; i < 3; i++) p.along[i] = add(multiply(a.along[i], b.value), multiply(a.value, b.along[i]));
    return p;
}

/* A function of a jet by its range and the range of its derivative. */
static inline jet chain(interval value, interval slope, jet a)
{
    jet f = {.value = value};
    for (int i = 0; i < 3; i++) f.along[i] = multiply(slope, a.along[i]);
    return f;
}

static inline jet least(jet a, jet b)
{
    if (a.value.high <= b.value.low) return a;
    if (b.value.high <= a.value.low) return b;
    jet m = {.value = {smaller(a.value.low, b.value.low), smaller(a.value.high, b.value.high)}};
    for (int i = 0; i < 3; i++) m.along[i] = hull(a.along[i], b.along[i]);
    return m;
}

static inline jet greatest(jet a, jet b)
{
    if (a.value.low >= b.value.high) return a;
    if (b.value.low >= a.value.high) return b;
    jet m = {.value = {larger(a.value.low, b.value.low), larger(a.value.high, b.value.high)}};
    for (int i = 0; i < 3; i++) m.along[i] = hull(a.along[i], b.along[i]);
    return m;
}

/* a.value.low > 0 */
static inline jet reciprocal(jet a)
{
    const double steep = 1 / a.value.low, flat = 1 / a.value.high;
    return chain((interval){flat, steep}, (interval){-steep * steep, -flat * flat}, a);
}

/* Where it may come near 0 its derivative has no bound. */
static inline jet root(jet a)
{
    const double low = sqrt(larger(a.value.low, 0)), high = sqrt(larger(a.value.high, 0));
    if (low <= 1e-8 * high) return unknown(low, high);
    return chain((interval){low, high}, (interval){.5 / high, .5 / low}, a);
}

static inline jet exponential_of_minus(jet a)
{
    const interval value = {exp(-a.value.high), exp(-a.value.low)};
    return chain(value, (interval){-value.high, -value.low}, a);
}

#endif
