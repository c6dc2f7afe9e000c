/* NB_WIDTH doubles at a time, in GNU vector types, as prelude_simd.h has floats; wide is real. */
#ifndef NB_PRELUDE_DOUBLE_H
#define NB_PRELUDE_DOUBLE_H

/* One line for each word of the vocabulary, to be read as a table. */
/* clang-format off */

#include <stdint.h>
#include <string.h>

#if defined(NB_ISA_NEON)
#include <arm_neon.h>
#else
#include <immintrin.h>
#endif

#define NB_FUNCTION static inline

/* ---- the instruction sets -------------------------------------------------------------------- */

#if defined(NB_ISA_SSE2)
#define NB_WIDTH 2
#define NB_REAL_OP(name) _mm_##name##_pd
#define NB_REAL_SELECT(m, a, b) ((nb_real)(((nb_mask)(a) & (m)) | ((nb_mask)(b) & ~(m))))
#define NB_REAL_SIGNS(m) ((unsigned)_mm_movemask_pd((__m128d)(m)))
#elif defined(NB_ISA_AVX2)
#define NB_WIDTH 4
#define NB_REAL_OP(name) _mm256_##name##_pd
#define NB_REAL_SELECT(m, a, b) _mm256_blendv_pd(b, a, (__m256d)(m))
#define NB_REAL_SIGNS(m) ((unsigned)_mm256_movemask_pd((__m256d)(m)))
#define NB_REAL_PICK(from, index) _mm256_i32gather_pd(from, _mm256_cvttpd_epi32(index), 8)
#elif defined(NB_ISA_AVX512)
#define NB_WIDTH 8
#define NB_REAL_OP(name) _mm512_##name##_pd
#define NB_REAL_SELECT(m, a, b)                                                                                        \
    ((nb_real)_mm512_ternarylogic_epi64((__m512i)(m), (__m512i)(a), (__m512i)(b), 0xca)) /* of m ? a : b */
#define NB_REAL_SIGNS(m) ((unsigned)_mm512_movepi64_mask((__m512i)(m)))
#define NB_REAL_PICK(from, index) _mm512_i32gather_pd(_mm512_cvttpd_epi32(index), from, 8)
#elif defined(NB_ISA_NEON)
#define NB_WIDTH 2
#define NB_REAL_SQRT(x) vsqrtq_f64(x)
#define NB_REAL_MIN(a, b) nb_select(a < b, a, b)
#define NB_REAL_MAX(a, b) nb_select(a > b, a, b)
#define NB_REAL_FLOOR(x) vrndmq_f64(x)
#define NB_REAL_SELECT(m, a, b) vbslq_f64((uint64x2_t)(m), a, b)
#define NB_REAL_SIGNS(m) ((unsigned)((m)[0] & 1) | (unsigned)((m)[1] & 2))
#endif

#if !defined(NB_ISA_NEON)
#define NB_REAL_SQRT(x) NB_REAL_OP(sqrt)(x)
#define NB_REAL_MIN(a, b) NB_REAL_OP(min)(a, b)
#define NB_REAL_MAX(a, b) NB_REAL_OP(max)(a, b)
#endif

/* ---- types and literals ---------------------------------------------------------------------- */

typedef double nb_scalar;
typedef double nb_real __attribute__((vector_size(8 * NB_WIDTH)));
typedef int64_t nb_mask __attribute__((vector_size(8 * NB_WIDTH)));
typedef uint64_t nb_bits __attribute__((vector_size(8 * NB_WIDTH)));

#define NB_EPSILON NB_F(1.1102230246251565e-16)
#define NB_F(x) nb_splat(x)

/* Subtracting 0 spreads x without changing it, -0 included; compilers see a broadcast. */
static inline nb_real nb_splat(double x) { return x - (nb_real){0}; }

static inline nb_bits nb_to_bits(nb_real x) { return (nb_bits)x; }
static inline nb_real nb_from_bits(nb_bits bits) { return (nb_real)bits; }

/* ---- real ------------------------------------------------------------------------------------ */

#define nb_lane(v, i) ((v)[i])
#define nb_mask_true (~(nb_mask){0})
#define nb_mask_false ((nb_mask){0})

static inline nb_mask nb_and(nb_mask m, nb_mask n) { return m & n; }
static inline nb_mask nb_or(nb_mask m, nb_mask n) { return m | n; }
static inline nb_mask nb_xor(nb_mask m, nb_mask n) { return m ^ n; }
static inline nb_mask nb_not(nb_mask m) { return ~m; }
static inline int nb_any(nb_mask m) { return NB_REAL_SIGNS(m) != 0; }
static inline int nb_all(nb_mask m) { return NB_REAL_SIGNS(m) == (1u << NB_WIDTH) - 1u; }
static inline nb_real nb_select(nb_mask m, nb_real a, nb_real b) { return NB_REAL_SELECT(m, a, b); }

static inline nb_real nb_min(nb_real a, nb_real b) { return NB_REAL_MIN(a, b); }
static inline nb_real nb_max(nb_real a, nb_real b) { return NB_REAL_MAX(a, b); }
static inline nb_real nb_sqrt(nb_real x) { return NB_REAL_SQRT(x); }

static inline nb_real nb_load_lanes(const double *from)
{
    nb_real x;
    memcpy(&x, from, sizeof x);
    return x;
}

static inline void nb_store_lanes(double *to, nb_real x) { memcpy(to, &x, sizeof x); }

/* Neighbours of an array of floats. */
typedef float nb_floats __attribute__((vector_size(4 * NB_WIDTH)));

static inline nb_real nb_load_floats(const float *from)
{
    nb_floats x;
    memcpy(&x, from, sizeof x);
    return __builtin_convertvector(x, nb_real);
}

static inline void nb_store_floats(float *to, nb_real x)
{
    const nb_floats narrow = __builtin_convertvector(x, nb_floats);
    memcpy(to, &narrow, sizeof narrow);
}

/* Numbers of an array, one for each lane: what lies at whole numbers below 2^31. */
#ifdef NB_REAL_PICK
static inline nb_real nb_pick(const double *from, nb_real index) { return NB_REAL_PICK(from, index); }
#else
static inline nb_real nb_pick(const double *from, nb_real index)
{
    return (nb_real){from[(size_t)index[0]], from[(size_t)index[1]]};
}
#endif

/* ---- wide ------------------------------------------------------------------------------------ */

typedef nb_real nb_wide;
typedef nb_mask nb_wmask;

#define NB_W(x) NB_F(x)
#define NB_WEPSILON NB_EPSILON
#define NB_WTINY_SQUARE NB_WTINY

#define nb_wmask_true nb_mask_true
#define nb_wmask_false nb_mask_false

static inline nb_wide nb_wsplat(double x) { return nb_splat(x); }
static inline nb_wide nb_wload_lanes(const double *from) { return nb_load_lanes(from); }
static inline void nb_wstore_lanes(double *to, nb_wide x) { nb_store_lanes(to, x); }
static inline nb_wmask nb_wand(nb_wmask m, nb_wmask n) { return m & n; }
static inline nb_wmask nb_wor(nb_wmask m, nb_wmask n) { return m | n; }
static inline nb_wmask nb_wxor(nb_wmask m, nb_wmask n) { return m ^ n; }
static inline nb_wmask nb_wnot(nb_wmask m) { return ~m; }
static inline int nb_wany(nb_wmask m) { return nb_any(m); }
static inline int nb_wall(nb_wmask m) { return nb_all(m); }
static inline nb_wide nb_wselect(nb_wmask m, nb_wide a, nb_wide b) { return nb_select(m, a, b); }
static inline nb_wide nb_wmin(nb_wide a, nb_wide b) { return nb_min(a, b); }
static inline nb_wide nb_wmax(nb_wide a, nb_wide b) { return nb_max(a, b); }
static inline nb_wide nb_wsqrt(nb_wide x) { return nb_sqrt(x); }
static inline nb_wide nb_widen(nb_real x) { return x; }
static inline nb_real nb_narrow(nb_wide x) { return x; }
static inline nb_wmask nb_widen_mask(nb_mask m) { return m; }
static inline nb_mask nb_narrow_mask(nb_wmask m) { return m; }

#include "prelude_common.h"

static inline nb_wide nb_wabs(nb_wide x) { return nb_abs(x); }
static inline nb_wide nb_wcopy_sign(nb_wide magnitude, nb_wide sign) { return nb_copy_sign(magnitude, sign); }

#endif
