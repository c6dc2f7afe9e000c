/* NB_WIDTH numbers at a time, in GNU vector types: + - * / and comparisons are written as for one number. See
 * prelude.h.
 *
 * Each instruction set names its registers and the few operations for which plain vector code is poor; everything
 * else follows from them. nb_min and nb_max are a < b ? a : b and a > b ? a : b to the bit, which is what minps and
 * maxps do.
 */
#ifndef NB_PRELUDE_SIMD_H
#define NB_PRELUDE_SIMD_H

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

/* NB_STORAGE floats in a register, of which NB_WIDTH count. SSE2 keeps two floats beside two doubles in the lower half
 * of a register of four, because compilers treat registers of two floats badly. */
#if defined(NB_ISA_SSE2)
#define NB_STORAGE 4
#define NB_REAL_OP(name) _mm_##name##_ps
#define NB_REAL_SELECT(m, a, b) NB_BITWISE_SELECT(nb_mask, nb_real, m, a, b)
#define NB_REAL_SIGNS(m) ((unsigned)_mm_movemask_ps((__m128)(m)))
#define NB_WIDE_OP(name) _mm_##name##_pd
#define NB_WIDE_SELECT(m, a, b) NB_BITWISE_SELECT(nb_wmask, nb_wide, m, a, b)
#define NB_WIDE_SIGNS(m) ((unsigned)_mm_movemask_pd((__m128d)(m)))
#define NB_TO_WIDE(x) _mm_cvtps_pd(x)
#define NB_TO_REAL(x) _mm_cvtpd_ps(x)
#define NB_TO_WMASK(m) ((nb_wmask)_mm_unpacklo_epi32((__m128i)(m), (__m128i)(m)))
#define NB_TO_MASK(m) ((nb_mask)_mm_shuffle_epi32((__m128i)(m), _MM_SHUFFLE(2, 0, 2, 0)))
#if defined(NB_FAST)
#define NB_WIDTH 4
#else
#define NB_WIDTH 2
#define NB_REAL_LOAD(from) ((nb_real)_mm_loadl_epi64((const __m128i *)(const void *)(from)))
#define NB_REAL_STORE(to, x) _mm_storel_epi64((__m128i *)(void *)(to), (__m128i)(x))
#endif

#elif defined(NB_ISA_AVX2)
#define NB_WIDE_OP(name) _mm256_##name##_pd
#define NB_WIDE_SELECT(m, a, b) _mm256_blendv_pd(b, a, (__m256d)(m))
#define NB_WIDE_SIGNS(m) ((unsigned)_mm256_movemask_pd((__m256d)(m)))
#define NB_TO_WIDE(x) _mm256_cvtps_pd(x)
#define NB_TO_REAL(x) _mm256_cvtpd_ps(x)
#define NB_TO_WMASK(m) ((nb_wmask)_mm256_cvtepi32_epi64((__m128i)(m)))
#define NB_TO_MASK(m)                                                                                                  \
    ((nb_mask)_mm_shuffle_ps(_mm256_castps256_ps128((__m256)(m)), _mm256_extractf128_ps((__m256)(m), 1),               \
                             _MM_SHUFFLE(2, 0, 2, 0)))
#if defined(NB_FAST)
#define NB_WIDTH 8
#define NB_REAL_OP(name) _mm256_##name##_ps
#define NB_REAL_SELECT(m, a, b) _mm256_blendv_ps(b, a, (__m256)(m))
#define NB_REAL_SIGNS(m) ((unsigned)_mm256_movemask_ps((__m256)(m)))
#else
#define NB_WIDTH 4
#define NB_REAL_OP(name) _mm_##name##_ps
#define NB_REAL_SELECT(m, a, b) _mm_blendv_ps(b, a, (__m128)(m))
#define NB_REAL_SIGNS(m) ((unsigned)_mm_movemask_ps((__m128)(m)))
#endif

#elif defined(NB_ISA_AVX512)
#define NB_TERNARY_SELECT 0xca /* the truth table of m ? a : b */
#define NB_WIDE_OP(name) _mm512_##name##_pd
#define NB_WIDE_SELECT(m, a, b)                                                                                        \
    ((nb_wide)_mm512_ternarylogic_epi64((__m512i)(m), (__m512i)(a), (__m512i)(b), NB_TERNARY_SELECT))
#define NB_WIDE_SIGNS(m) ((unsigned)_mm512_movepi64_mask((__m512i)(m)))
#define NB_TO_WIDE(x) _mm512_cvtps_pd(x)
#define NB_TO_REAL(x) _mm512_cvtpd_ps(x)
#define NB_TO_WMASK(m) ((nb_wmask)_mm512_cvtepi32_epi64((__m256i)(m)))
#define NB_TO_MASK(m) ((nb_mask)_mm512_cvtepi64_epi32((__m512i)(m)))
#if defined(NB_FAST)
#define NB_WIDTH 16
#define NB_REAL_OP(name) _mm512_##name##_ps
#define NB_REAL_SELECT(m, a, b)                                                                                        \
    ((nb_real)_mm512_ternarylogic_epi32((__m512i)(m), (__m512i)(a), (__m512i)(b), NB_TERNARY_SELECT))
#define NB_REAL_SIGNS(m) ((unsigned)_mm512_movepi32_mask((__m512i)(m)))
#else
#define NB_WIDTH 8
#define NB_REAL_OP(name) _mm256_##name##_ps
#define NB_REAL_SELECT(m, a, b)                                                                                        \
    ((nb_real)_mm256_ternarylogic_epi32((__m256i)(m), (__m256i)(a), (__m256i)(b), NB_TERNARY_SELECT))
#define NB_REAL_SIGNS(m) ((unsigned)_mm256_movemask_ps((__m256)(m)))
#endif

#elif defined(NB_ISA_NEON)
#define NB_WIDE_SQRT(x) vsqrtq_f64(x)
#define NB_WIDE_SELECT(m, a, b) vbslq_f64((uint64x2_t)(m), a, b)
#define NB_WIDE_SIGNS(m) NB_TWO_SIGNS(m)
#define NB_TO_WIDE(x) vcvt_f64_f32(x)
#define NB_TO_REAL(x) vcvt_f32_f64(x)
/* Each lane twice, not vmovl_s32: gcc 12 takes such an extension out where only its first lane was extended before
 * (its pass -free). */
#define NB_TO_WMASK(m)                                                                                                 \
    ((nb_wmask)vcombine_s32(vzip1_s32((int32x2_t)(m), (int32x2_t)(m)), vzip2_s32((int32x2_t)(m), (int32x2_t)(m))))
#define NB_TO_MASK(m) ((nb_mask)vmovn_s64((int64x2_t)(m)))
#define NB_TWO_SIGNS(m) ((unsigned)((m)[0] & 1) | (unsigned)((m)[1] & 2))
#if defined(NB_FAST)
#define NB_WIDTH 4
#define NB_REAL_SQRT(x) vsqrtq_f32(x)
#define NB_REAL_FLOOR(x) vrndmq_f32(x)
#define NB_REAL_SELECT(m, a, b) vbslq_f32((uint32x4_t)(m), a, b)
#define NB_REAL_SIGNS(m) (NB_TWO_SIGNS(m) | (unsigned)((m)[2] & 4) | (unsigned)((m)[3] & 8))
#else
#define NB_WIDTH 2
#define NB_REAL_SQRT(x) vsqrt_f32(x)
#define NB_REAL_FLOOR(x) vrndm_f32(x)
#define NB_REAL_SELECT(m, a, b) vbsl_f32((uint32x2_t)(m), a, b)
#define NB_REAL_SIGNS(m) NB_TWO_SIGNS(m)
#endif
#endif

#ifndef NB_STORAGE
#define NB_STORAGE NB_WIDTH
#endif
#define NB_ALL_LANES ((1u << NB_WIDTH) - 1u)
#define NB_BITWISE_SELECT(mask_type, type, m, a, b) ((type)(((mask_type)(a) & (m)) | ((mask_type)(b) & ~(m))))

#if defined(NB_ISA_AVX2) || defined(NB_ISA_AVX512)
#define NB_REAL_FLOOR(x) NB_REAL_OP(floor)(x)
#endif

#if defined(NB_ISA_NEON)
#define NB_REAL_MIN(a, b) nb_select(a < b, a, b)
#define NB_REAL_MAX(a, b) nb_select(a > b, a, b)
#define NB_WIDE_MIN(a, b) nb_wselect(a < b, a, b)
#define NB_WIDE_MAX(a, b) nb_wselect(a > b, a, b)
#else
#define NB_REAL_SQRT(x) NB_REAL_OP(sqrt)(x)
#define NB_REAL_MIN(a, b) NB_REAL_OP(min)(a, b)
#define NB_REAL_MAX(a, b) NB_REAL_OP(max)(a, b)
#define NB_WIDE_SQRT(x) NB_WIDE_OP(sqrt)(x)
#define NB_WIDE_MIN(a, b) NB_WIDE_OP(min)(a, b)
#define NB_WIDE_MAX(a, b) NB_WIDE_OP(max)(a, b)
#endif

/* ---- types and literals ---------------------------------------------------------------------- */

typedef float nb_scalar;
typedef float nb_real __attribute__((vector_size(4 * NB_STORAGE)));
typedef int32_t nb_mask __attribute__((vector_size(4 * NB_STORAGE)));
typedef uint32_t nb_bits __attribute__((vector_size(4 * NB_STORAGE)));

#define NB_EPSILON NB_F(5.9604644775390625e-8)
#define NB_F(x) nb_splat(x##f)

/* Subtracting 0 spreads x without changing it, -0 included; compilers see a broadcast. */
static inline nb_real nb_splat(float x) { return x - (nb_real){0}; }

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
static inline int nb_any(nb_mask m) { return (NB_REAL_SIGNS(m) & NB_ALL_LANES) != 0; }
static inline int nb_all(nb_mask m) { return (NB_REAL_SIGNS(m) & NB_ALL_LANES) == NB_ALL_LANES; }
static inline nb_real nb_select(nb_mask m, nb_real a, nb_real b) { return NB_REAL_SELECT(m, a, b); }

static inline nb_real nb_min(nb_real a, nb_real b) { return NB_REAL_MIN(a, b); }
static inline nb_real nb_max(nb_real a, nb_real b) { return NB_REAL_MAX(a, b); }
static inline nb_real nb_sqrt(nb_real x) { return NB_REAL_SQRT(x); }

#ifdef NB_REAL_LOAD
static inline nb_real nb_load_lanes(const float *from) { return NB_REAL_LOAD(from); }
static inline void nb_store_lanes(float *to, nb_real x) { NB_REAL_STORE(to, x); }
#else
static inline nb_real nb_load_lanes(const float *from)
{
    nb_real x;
    memcpy(&x, from, sizeof x);
    return x;
}

static inline void nb_store_lanes(float *to, nb_real x) { memcpy(to, &x, sizeof x); }
#endif

/* ---- wide ------------------------------------------------------------------------------------ */

#if defined(NB_FAST)

typedef nb_real nb_wide;
typedef nb_mask nb_wmask;

#define NB_W(x) NB_F(x)
#define NB_WEPSILON NB_EPSILON
#define NB_WTINY_SQUARE NB_WTINY

static inline nb_wide nb_wsplat(double x) { return nb_splat((float)x); }
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

static inline nb_wide nb_wload_lanes(const double *from)
{
    nb_wide x;
    for (int i = 0; i < NB_WIDTH; ++i) x[i] = (float)from[i];
    return x;
}

static inline void nb_wstore_lanes(double *to, nb_wide x)
{
    for (int i = 0; i < NB_WIDTH; ++i) to[i] = (double)x[i];
}

#define NB_WIDE_SIGN_BIT NB_SIGN_BIT
typedef nb_bits nb_wbits;

/* Numbers of an array, one for each lane: what lies at whole numbers below 2^24; of shorts, with the one behind. */
#if defined(NB_ISA_AVX512) || defined(NB_ISA_AVX2)
#if defined(NB_ISA_AVX512)
#define NB_INDEX(index) _mm512_cvttps_epi32(index)
#define NB_GATHER_REAL(from, at) _mm512_i32gather_ps(at, from, 4)
#define NB_GATHER_BITS(from, at) (nb_bits)_mm512_i32gather_epi32(at, (const int *)(const void *)(from), 2)
#define NB_TO_NUMBERS(bits) _mm512_cvtepi32_ps((__m512i)(bits))
#else
#define NB_INDEX(index) _mm256_cvttps_epi32(index)
#define NB_GATHER_REAL(from, at) _mm256_i32gather_ps(from, at, 4)
#define NB_GATHER_BITS(from, at) (nb_bits)_mm256_i32gather_epi32((const int *)(const void *)(from), at, 2)
#define NB_TO_NUMBERS(bits) _mm256_cvtepi32_ps((__m256i)(bits))
#endif
static inline nb_real nb_gather(const float *from, nb_wide index) { return NB_GATHER_REAL(from, NB_INDEX(index)); }

static inline nb_real nb_gather_pairs(const uint16_t *from, nb_wide index, nb_real *behind)
{
    const nb_bits both = NB_GATHER_BITS(from, NB_INDEX(index));
    *behind = NB_TO_NUMBERS(both >> 16);
    return NB_TO_NUMBERS(both & 0xffffu);
}
#else
static inline nb_real nb_gather(const float *from, nb_wide index)
{
    float lane[NB_WIDTH];
    for (int i = 0; i < NB_WIDTH; ++i) lane[i] = from[(int)index[i]];
    return nb_load_lanes(lane);
}

static inline nb_real nb_gather_pairs(const uint16_t *from, nb_wide index, nb_real *behind)
{
    float lane[NB_WIDTH], next[NB_WIDTH];
    for (int i = 0; i < NB_WIDTH; ++i) {
        lane[i] = (float)from[(int)index[i]];
        next[i] = (float)from[(int)index[i] + 1];
    }
    *behind = nb_load_lanes(next);
    return nb_load_lanes(lane);
}
#endif

#else

typedef double nb_wide __attribute__((vector_size(8 * NB_WIDTH)));
typedef int64_t nb_wmask __attribute__((vector_size(8 * NB_WIDTH)));
typedef uint64_t nb_wbits __attribute__((vector_size(8 * NB_WIDTH)));

#define NB_W(x) nb_wsplat(x)
#define NB_WEPSILON NB_W(1.1102230246251565e-16)
#define NB_WTINY_SQUARE NB_W(1e-60)

static inline nb_wide nb_wsplat(double x) { return x - (nb_wide){0}; }
static inline int nb_wany(nb_wmask m) { return NB_WIDE_SIGNS(m) != 0; }
static inline int nb_wall(nb_wmask m) { return NB_WIDE_SIGNS(m) == NB_ALL_LANES; }
static inline nb_wide nb_wselect(nb_wmask m, nb_wide a, nb_wide b) { return NB_WIDE_SELECT(m, a, b); }
static inline nb_wide nb_wmin(nb_wide a, nb_wide b) { return NB_WIDE_MIN(a, b); }
static inline nb_wide nb_wmax(nb_wide a, nb_wide b) { return NB_WIDE_MAX(a, b); }
static inline nb_wide nb_wsqrt(nb_wide x) { return NB_WIDE_SQRT(x); }
static inline nb_wide nb_widen(nb_real x) { return NB_TO_WIDE(x); }
static inline nb_real nb_narrow(nb_wide x) { return NB_TO_REAL(x); }
static inline nb_wmask nb_widen_mask(nb_mask m) { return NB_TO_WMASK(m); }
static inline nb_mask nb_narrow_mask(nb_wmask m) { return NB_TO_MASK(m); }

static inline nb_wide nb_wload_lanes(const double *from)
{
    nb_wide x;
    memcpy(&x, from, sizeof x);
    return x;
}

static inline void nb_wstore_lanes(double *to, nb_wide x) { memcpy(to, &x, sizeof x); }

#define NB_WIDE_SIGN_BIT 0x8000000000000000u

/* Whole numbers within -2^31 and 2^31 as integers: the addition leaves them in the lowest bits. */
static inline nb_bits nb_wto_bits32(nb_wide x)
{
    return (nb_bits)nb_narrow_mask((nb_wmask)(x + NB_W(6755399441055744.0)));
}

/* Numbers of an array, one for each lane: what lies at whole numbers below 2^31. Of bytes and shorts the bytes behind
 * are read, too, three and two of them. */
#if defined(NB_ISA_AVX512) || defined(NB_ISA_AVX2)
#if defined(NB_ISA_AVX512)
#define NB_INDEX(index) _mm512_cvttpd_epi32(index)
#define NB_GATHER_REAL(from, at) _mm256_i32gather_ps(from, at, 4)
#define NB_GATHER_BITS(from, at, size) (nb_bits)_mm256_i32gather_epi32((const int *)(const void *)(from), at, size)
#define NB_TO_NUMBERS(bits) _mm256_cvtepi32_ps((__m256i)(bits))
#else
#define NB_INDEX(index) _mm256_cvttpd_epi32(index)
#define NB_GATHER_REAL(from, at) _mm_i32gather_ps(from, at, 4)
#define NB_GATHER_BITS(from, at, size) (nb_bits)_mm_i32gather_epi32((const int *)(const void *)(from), at, size)
#define NB_TO_NUMBERS(bits) _mm_cvtepi32_ps((__m128i)(bits))
#endif
static inline nb_real nb_gather(const float *from, nb_wide index) { return NB_GATHER_REAL(from, NB_INDEX(index)); }

static inline nb_real nb_gather_bytes(const uint8_t *from, nb_wide index)
{
    return NB_TO_NUMBERS(NB_GATHER_BITS(from, NB_INDEX(index), 1) & 0xffu);
}

static inline nb_real nb_gather_shorts(const uint16_t *from, nb_wide index)
{
    return NB_TO_NUMBERS(NB_GATHER_BITS(from, NB_INDEX(index), 2) & 0xffffu);
}

/* And the number behind each. */
static inline nb_real nb_gather_byte_pairs(const uint8_t *from, nb_wide index, nb_real *behind)
{
    const nb_bits both = NB_GATHER_BITS(from, NB_INDEX(index), 1);
    *behind = NB_TO_NUMBERS(both >> 8 & 0xffu);
    return NB_TO_NUMBERS(both & 0xffu);
}

static inline nb_real nb_gather_pairs(const uint16_t *from, nb_wide index, nb_real *behind)
{
    const nb_bits both = NB_GATHER_BITS(from, NB_INDEX(index), 2);
    *behind = NB_TO_NUMBERS(both >> 16);
    return NB_TO_NUMBERS(both & 0xffffu);
}
#else
static inline nb_real nb_gather(const float *from, nb_wide index)
{
    float lane[NB_WIDTH];
    for (int i = 0; i < NB_WIDTH; ++i) lane[i] = from[(size_t)index[i]];
    return nb_load_lanes(lane);
}

static inline nb_real nb_gather_bytes(const uint8_t *from, nb_wide index)
{
    float lane[NB_WIDTH];
    for (int i = 0; i < NB_WIDTH; ++i) lane[i] = (float)from[(size_t)index[i]];
    return nb_load_lanes(lane);
}

static inline nb_real nb_gather_shorts(const uint16_t *from, nb_wide index)
{
    float lane[NB_WIDTH];
    for (int i = 0; i < NB_WIDTH; ++i) lane[i] = (float)from[(size_t)index[i]];
    return nb_load_lanes(lane);
}

static inline nb_real nb_gather_byte_pairs(const uint8_t *from, nb_wide index, nb_real *behind)
{
    *behind = nb_gather_bytes(from, index + 1.0);
    return nb_gather_bytes(from, index);
}

static inline nb_real nb_gather_pairs(const uint16_t *from, nb_wide index, nb_real *behind)
{
    *behind = nb_gather_shorts(from, index + 1.0);
    return nb_gather_shorts(from, index);
}
#endif

#endif

#define nb_wmask_true (~(nb_wmask){0})
#define nb_wmask_false ((nb_wmask){0})

static inline nb_wmask nb_wand(nb_wmask m, nb_wmask n) { return m & n; }
static inline nb_wmask nb_wor(nb_wmask m, nb_wmask n) { return m | n; }
static inline nb_wmask nb_wxor(nb_wmask m, nb_wmask n) { return m ^ n; }
static inline nb_wmask nb_wnot(nb_wmask m) { return ~m; }

#include "prelude_common.h"

static inline nb_wide nb_wabs(nb_wide x) { return (nb_wide)((nb_wbits)x & ~NB_WIDE_SIGN_BIT); }

static inline nb_wide nb_wcopy_sign(nb_wide magnitude, nb_wide sign)
{
    return (nb_wide)(((nb_wbits)magnitude & ~NB_WIDE_SIGN_BIT) | ((nb_wbits)sign & NB_WIDE_SIGN_BIT));
}

#endif
