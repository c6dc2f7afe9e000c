/* The vocabulary of the formula files in shading languages: one float, the same float as wide. See prelude.h. Behind
 * prelude_glsl.glsl or prelude_hlsl.hlsl, which name what the languages call by different names.
 *
 * GLSL promises no infinity, no NaN and no exact -0; nb_min and nb_max are written out so that at least they choose
 * as in C where a machine does have them. */
#define NB_FUNCTION
#define NB_STRUCT(name) struct name {
#define NB_STRUCT_END(name) };
#define NB_F(x) (x)
#define NB_W(x) (x)
#define NB_EPSILON 5.9604644775390625e-8
#define NB_WEPSILON NB_EPSILON
#define NB_WTINY_SQUARE NB_WTINY

#define nb_real float
#define nb_wide float
#define nb_mask bool
#define nb_wmask bool
#define nb_wvec3 nb_vec3

#define nb_mask_true true
#define nb_mask_false false
#define nb_wmask_true true
#define nb_wmask_false false

bool nb_and(bool m, bool n) { return m && n; }
bool nb_or(bool m, bool n) { return m || n; }
bool nb_xor(bool m, bool n) { return m != n; }
bool nb_not(bool m) { return !m; }
float nb_select(bool m, float a, float b) { return m ? a : b; }
float nb_min(float a, float b) { return a < b ? a : b; }
float nb_max(float a, float b) { return a > b ? a : b; }
float nb_abs(float x) { return abs(x); }
float nb_sqrt(float x) { return sqrt(x); }
float nb_floor(float x) { return floor(x); }
float nb_round(float x) { return nb_round_even(x); }

#define nb_wand nb_and
#define nb_wor nb_or
#define nb_wxor nb_xor
#define nb_wnot nb_not
#define nb_wselect nb_select
#define nb_wmin nb_min
#define nb_wmax nb_max
#define nb_wabs nb_abs
#define nb_wsqrt nb_sqrt
#define nb_wcopy_sign nb_copy_sign
#define nb_widen(x) (x)
#define nb_narrow(x) (x)
#define nb_widen_mask(m) (m)
#define nb_narrow_mask(m) (m)
#define nb_any(m) (m)

/* The functions of prelude_common.h; 0x3f3504f3 is sqrt(1/2), 0x3f800000 is 1. */
float nb_copy_sign(float magnitude, float sign)
{
    return nb_from_bits((nb_to_bits(magnitude) & 0x7fffffff) | (nb_to_bits(sign) & int(0x80000000u)));
}

float nb_truncate_half(float x) { return nb_from_bits(nb_to_bits(x) & ~0xfff); }
float nb_scale_pow2(float x, float n) { return x * nb_from_bits((int(n) + 127) << 23); }
float nb_exponent(float x) { return float(((nb_to_bits(x) + (0x3f800000 - 0x3f3504f3)) >> 23) - 127); }

float nb_significand(float x)
{
    return nb_from_bits(((nb_to_bits(x) + (0x3f800000 - 0x3f3504f3)) & 0x7fffff) + 0x3f3504f3);
}
