/* What scalar and SIMD share: three-vectors, and the functions made from the bits of a number. Included by
 * prelude_c.h and prelude_simd.h, which define the types, nb_to_bits and nb_from_bits. */
#ifndef NB_PRELUDE_COMMON_H
#define NB_PRELUDE_COMMON_H

/* One line for each word of the vocabulary, to be read as a table. */
/* clang-format off */

/* A structure that formulas return: NB_STRUCT(name) members NB_STRUCT_END(name). GLSL has no typedef. */
#define NB_STRUCT(name) typedef struct name {
#define NB_STRUCT_END(name)                                                                                            \
    }                                                                                                                  \
    name;

typedef struct nb_vec3 {
    nb_real x, y, z;
} nb_vec3;

typedef struct nb_wvec3 {
    nb_wide x, y, z;
} nb_wvec3;

/* A macro with arguments expands only before a parenthesis, so a type and its constructor may share the name. */
#define nb_vec3(x_, y_, z_) ((nb_vec3){(x_), (y_), (z_)})
#define nb_wvec3(x_, y_, z_) ((nb_wvec3){(x_), (y_), (z_)})

/* IEEE 754: significand bits below the leading one, exponent bias, and the numbers built from them. */
#ifdef NB_DOUBLE
#define NB_SHIFT 52
#define NB_SIGN_BIT UINT64_C(0x8000000000000000)
#define NB_FRACTION_BITS UINT64_C(0x000fffffffffffff)
#define NB_LOW_HALF_BITS UINT64_C(0x0000000007ffffff)
#define NB_ONE_BITS UINT64_C(0x3ff0000000000000)
#define NB_SQRT_HALF_BITS UINT64_C(0x3fe6a09e667f3bcd)
#define NB_INTEGER_BITS UINT64_C(0x4330000000000000)
#define NB_INTEGER NB_F(4503599627370496.0) /* 2^52: from here on every number is an integer */
#define NB_BIAS NB_F(1023.0)
#else
#define NB_SHIFT 23
#define NB_SIGN_BIT 0x80000000u
#define NB_FRACTION_BITS 0x007fffffu
#define NB_LOW_HALF_BITS 0x00000fffu
#define NB_ONE_BITS 0x3f800000u
#define NB_SQRT_HALF_BITS 0x3f3504f3u
#define NB_INTEGER_BITS 0x4b000000u
#define NB_INTEGER NB_F(8388608.0) /* 2^23 */
#define NB_BIAS NB_F(127.0)
#endif

static inline nb_real nb_copy_sign(nb_real magnitude, nb_real sign)
{
    return nb_from_bits((nb_to_bits(magnitude) & ~NB_SIGN_BIT) | (nb_to_bits(sign) & NB_SIGN_BIT));
}

static inline nb_real nb_abs(nb_real x) { return nb_from_bits(nb_to_bits(x) & ~NB_SIGN_BIT); }

/* The upper half of the significand: the square of the result is exact. */
static inline nb_real nb_truncate_half(nb_real x) { return nb_from_bits(nb_to_bits(x) & ~NB_LOW_HALF_BITS); }

/* Nearest integer, ties to even, for |x| < NB_INTEGER / 2: the addition rounds at the unit place. */
static inline nb_real nb_round(nb_real x)
{
    const nb_real shifter = NB_INTEGER * NB_F(1.5);
    return (x + shifter) - shifter;
}

#ifdef NB_REAL_FLOOR
static inline nb_real nb_floor(nb_real x) { return NB_REAL_FLOOR(x); }
#else
/* Any x: rounds |x|, corrects a step too high, and leaves what has no fraction (and NaN) alone. */
static inline nb_real nb_floor(nb_real x)
{
    const nb_real size = nb_abs(x);
    const nb_real nearest = nb_copy_sign((size + NB_INTEGER) - NB_INTEGER, x);
    const nb_real below = nearest - nb_select(nearest > x, NB_F(1.0), NB_F(0.0));
    return nb_select(size < NB_INTEGER, below, x);
}
#endif

/* x * 2^n for an integer n with a normal 2^n, -126 to 127 (float) or -1022 to 1023 (double). The addition leaves n +
 * bias in the lowest bits, the shift moves it to the exponent and everything above it out. */
static inline nb_real nb_scale_pow2(nb_real x, nb_real n)
{
    return x * nb_from_bits(nb_to_bits(n + (NB_INTEGER * NB_F(1.5) + NB_BIAS)) << NB_SHIFT);
}

/* x = significand * 2^exponent with the significand in [sqrt(1/2), sqrt(2)), for normal x > 0. The exponent is put
 * below the leading bit of NB_INTEGER, which makes it a number without a conversion. */
static inline nb_real nb_exponent(nb_real x)
{
    const nb_bits shifted = (nb_to_bits(x) + (NB_ONE_BITS - NB_SQRT_HALF_BITS)) >> NB_SHIFT;
    return nb_from_bits(shifted | NB_INTEGER_BITS) - (NB_INTEGER + NB_BIAS);
}

static inline nb_real nb_significand(nb_real x)
{
    const nb_bits shifted = nb_to_bits(x) + (NB_ONE_BITS - NB_SQRT_HALF_BITS);
    return nb_from_bits((shifted & NB_FRACTION_BITS) + NB_SQRT_HALF_BITS);
}

#endif
