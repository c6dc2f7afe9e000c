/* One number at a time: float, or double with NB_DOUBLE. See prelude.h. */
#ifndef NB_PRELUDE_C_H
#define NB_PRELUDE_C_H

/* One line for each word of the vocabulary, to be read as a table. */
/* clang-format off */

#include <float.h>
#include <math.h>
#include <stdint.h>
#include <string.h>

#ifdef NB_QUAD
#include "quad.h"
#endif

#define NB_FUNCTION static inline
#define NB_WIDTH 1

/* ---- types and literals ---------------------------------------------------------------------- */

#ifdef NB_DOUBLE
typedef double nb_scalar;
typedef uint64_t nb_bits;
#define NB_F(x) x
#define NB_EPSILON 1.1102230246251565e-16
#else
typedef float nb_scalar;
typedef uint32_t nb_bits;
#define NB_F(x) x##f
#define NB_EPSILON 5.9604644775390625e-8f
#endif

#if defined(NB_FAST)
typedef nb_scalar nb_wscalar;
#define NB_W(x) NB_F(x)
#define NB_WEPSILON NB_EPSILON
#define NB_WTINY_SQUARE NB_WTINY
#elif defined(NB_QUAD)
typedef nb_quad nb_wscalar;
#define NB_W(x) ((nb_quad)x##L)
#define NB_WEPSILON (NB_QUAD_EPSILON / 2)
#elif defined(NB_DOUBLE)
typedef long double nb_wscalar;
#define NB_W(x) x##L
#define NB_WEPSILON (LDBL_EPSILON / 2)
#else
typedef double nb_wscalar;
#define NB_W(x) x
#define NB_WEPSILON 1.1102230246251565e-16
#endif
#if !defined(NB_FAST)
#define NB_WTINY_SQUARE NB_W(1e-60)
#endif

typedef nb_scalar nb_real;
typedef nb_wscalar nb_wide;
typedef int nb_mask;
typedef int nb_wmask;

/* ---- one lane -------------------------------------------------------------------------------- */

#define nb_lane(v, i) ((void)(i), (v))

static inline nb_real nb_splat(nb_scalar x) { return x; }
static inline nb_wide nb_wsplat(double x) { return (nb_wide)x; }
static inline nb_real nb_load_lanes(const nb_scalar *from) { return *from; }
static inline nb_wide nb_wload_lanes(const double *from) { return (nb_wide)*from; }
static inline void nb_store_lanes(nb_scalar *to, nb_real x) { *to = x; }
static inline void nb_wstore_lanes(double *to, nb_wide x) { *to = (double)x; }

static inline nb_wide nb_widen(nb_real x) { return (nb_wide)x; }
static inline nb_real nb_narrow(nb_wide x) { return (nb_real)x; }
static inline nb_wmask nb_widen_mask(nb_mask m) { return m; }
static inline nb_mask nb_narrow_mask(nb_wmask m) { return m; }

#if !defined(NB_DOUBLE)
static inline nb_real nb_gather(const float *from, nb_wide index) { return from[(size_t)index]; }

static inline nb_real nb_gather_pairs(const uint16_t *from, nb_wide index, nb_real *behind)
{
    *behind = (nb_real)from[(size_t)index + 1];
    return (nb_real)from[(size_t)index];
}
#endif
#if !defined(NB_DOUBLE) && !defined(NB_FAST)
static inline nb_bits nb_wto_bits32(nb_wide x) { return (nb_bits)(int32_t)x; }
static inline nb_real nb_gather_bytes(const uint8_t *from, nb_wide index) { return (nb_real)from[(size_t)index]; }
static inline nb_real nb_gather_shorts(const uint16_t *from, nb_wide index) { return (nb_real)from[(size_t)index]; }

static inline nb_real nb_gather_byte_pairs(const uint8_t *from, nb_wide index, nb_real *behind)
{
    *behind = (nb_real)from[(size_t)index + 1];
    return (nb_real)from[(size_t)index];
}
#endif

#ifdef NB_DOUBLE
static inline nb_real nb_load_floats(const float *from) { return (nb_real)*from; }
static inline void nb_store_floats(float *to, nb_real x) { *to = (float)x; }
static inline nb_real nb_pick(const double *from, nb_real index) { return from[(size_t)index]; }
#endif

/* ---- masks ----------------------------------------------------------------------------------- */

#define nb_mask_true 1
#define nb_mask_false 0
#define nb_wmask_true 1
#define nb_wmask_false 0

static inline nb_mask nb_and(nb_mask m, nb_mask n) { return m & n; }
static inline nb_mask nb_or(nb_mask m, nb_mask n) { return m | n; }
static inline nb_mask nb_xor(nb_mask m, nb_mask n) { return m ^ n; }
static inline nb_mask nb_not(nb_mask m) { return !m; }
static inline nb_wmask nb_wand(nb_wmask m, nb_wmask n) { return m & n; }
static inline nb_wmask nb_wor(nb_wmask m, nb_wmask n) { return m | n; }
static inline nb_wmask nb_wxor(nb_wmask m, nb_wmask n) { return m ^ n; }
static inline nb_wmask nb_wnot(nb_wmask m) { return !m; }
static inline int nb_any(nb_mask m) { return m; }
static inline int nb_all(nb_mask m) { return m; }
static inline int nb_wany(nb_wmask m) { return m; }
static inline int nb_wall(nb_wmask m) { return m; }
static inline nb_real nb_select(nb_mask m, nb_real a, nb_real b) { return m ? a : b; }
static inline nb_wide nb_wselect(nb_wmask m, nb_wide a, nb_wide b) { return m ? a : b; }

/* ---- arithmetic the machine has -------------------------------------------------------------- */

static inline nb_real nb_min(nb_real a, nb_real b) { return a < b ? a : b; }
static inline nb_real nb_max(nb_real a, nb_real b) { return a > b ? a : b; }
static inline nb_wide nb_wmin(nb_wide a, nb_wide b) { return a < b ? a : b; }
static inline nb_wide nb_wmax(nb_wide a, nb_wide b) { return a > b ? a : b; }

#ifdef NB_DOUBLE
static inline nb_real nb_sqrt(nb_real x) { return sqrt(x); }
#else
static inline nb_real nb_sqrt(nb_real x) { return sqrtf(x); }
#endif

#if defined(NB_FAST)
static inline nb_wide nb_wsqrt(nb_wide x) { return nb_sqrt(x); }
#elif defined(NB_QUAD)
static inline nb_wide nb_wsqrt(nb_wide x) { return nb_quad_sqrt(x); }
#elif defined(NB_DOUBLE)
static inline nb_wide nb_wsqrt(nb_wide x) { return sqrtl(x); }
#else
static inline nb_wide nb_wsqrt(nb_wide x) { return sqrt(x); }
#endif

/* A select would keep the sign of -0. */
static inline nb_wide nb_wabs(nb_wide x)
{
#if defined(NB_FAST) && !defined(NB_DOUBLE)
    return fabsf(x);
#elif defined(NB_FAST) || !defined(NB_DOUBLE)
    return fabs(x);
#elif defined(NB_QUAD)
    return nb_quad_abs(x);
#else
    return fabsl(x);
#endif
}

static inline nb_wide nb_wcopy_sign(nb_wide magnitude, nb_wide sign)
{
#if defined(NB_FAST) && !defined(NB_DOUBLE)
    return copysignf(magnitude, sign);
#elif defined(NB_FAST) || !defined(NB_DOUBLE)
    return copysign(magnitude, sign);
#elif defined(NB_QUAD)
    return nb_quad_copy_sign(magnitude, sign);
#else
    return copysignl(magnitude, sign);
#endif
}

static inline nb_bits nb_to_bits(nb_real x)
{
    nb_bits bits;
    memcpy(&bits, &x, sizeof bits);
    return bits;
}

static inline nb_real nb_from_bits(nb_bits bits)
{
    nb_real x;
    memcpy(&x, &bits, sizeof x);
    return x;
}

#include "prelude_common.h"

#endif
