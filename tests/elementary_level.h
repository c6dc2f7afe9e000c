/* The elementary functions, compiled once per instruction set: what test_elementary.c and test_elementary_gl.c compare.
 */
#ifndef NB_ELEMENTARY_LEVEL_H
#define NB_ELEMENTARY_LEVEL_H

#include <stddef.h>

/* X(name, expression in a and b): the expression is C and GLSL at once. */
#define NB_ELEMENTARY_FUNCTIONS(X)                                                                                     \
    X(exp, nb_exp(a))                                                                                                  \
    X(expm1, nb_expm1(a))                                                                                              \
    X(one_minus_exp, nb_one_minus_exp(a))                                                                              \
    X(exp_ratio, nb_exp_ratio(a))                                                                                      \
    X(log, nb_log(a))                                                                                                  \
    X(log1p, nb_log1p(a))                                                                                              \
    X(exp_minus_square, nb_exp_minus_square(a))                                                                        \
    X(erfcx, nb_erfcx(nb_abs(a)))                                                                                      \
    X(erfc, nb_erfc(a))                                                                                                \
    X(erf, nb_erf(a))                                                                                                  \
    X(gauss_integral, nb_gauss_integral(nb_min(a, b), nb_max(a, b)))                                                   \
    X(min, nb_min(a, b))                                                                                               \
    X(max, nb_max(a, b))                                                                                               \
    X(abs, nb_abs(a))                                                                                                  \
    X(sqrt, nb_sqrt(nb_abs(a)))                                                                                        \
    X(floor, nb_floor(a))                                                                                              \
    X(round, nb_round(nb_clamp(a, NB_F(-1e6), NB_F(1e6))))                                                             \
    X(clamp, nb_clamp(a, NB_F(-1.0), b))                                                                               \
    X(sign_one, nb_sign_one(a))                                                                                        \
    X(copy_sign, nb_copy_sign(a, b))                                                                                   \
    X(rcp_bounded, nb_rcp_bounded(a))                                                                                  \
    X(truncate_half, nb_truncate_half(a))                                                                              \
    X(masks, nb_select(nb_xor(nb_and(a < b, nb_not(b <= NB_F(0.5))), nb_or(a >= b, a == -b)), a, b))                   \
    X(true_mask, nb_select(nb_and(nb_mask_true, a < b), a, nb_select(nb_mask_false, a, -b)))                           \
    X(length3, nb_length3(nb_sub3(nb_vec3(a, b, a *b), nb_scale3(nb_vec3(b, a, b), NB_F(0.5)))))                       \
    X(cross3,                                                                                                          \
      nb_dot3(nb_cross3(nb_vec3(a, b, a + b), nb_vec3(NB_F(1.0), a, b)), nb_add3(nb_vec3(b, b, a), nb_vec3(a, a, a)))) \
    X(select3,                                                                                                         \
      nb_dot3(nb_select3(a < b, nb_vec3(a, b, a), nb_vec3(b, a, a)), nb_mul3(nb_vec3(a, a, b), nb_vec3(b, a, b))))     \
    X(wide_sqrt, nb_narrow(nb_wsqrt(nb_widen(a) * nb_widen(a) + nb_wabs(nb_widen(b)))))                                \
    X(wide_bounds,                                                                                                     \
      nb_narrow(nb_wclamp(nb_widen(a), nb_wmin(nb_widen(b), NB_W(0.5)), nb_wmax(nb_widen(b), NB_W(1e9)))))             \
    X(wide_masks, nb_narrow(nb_wselect(nb_wxor(nb_wand(nb_widen(a) < nb_widen(b), nb_wnot(nb_widen(b) <= NB_W(0.5))),  \
                                               nb_wor(nb_widen(a) >= nb_widen(b), nb_widen_mask(a == -b))),            \
                                       nb_widen(a), nb_widen(b))))                                                     \
    X(wide_true, nb_narrow(nb_wselect(nb_wand(nb_wmask_true, nb_widen(a) < nb_widen(b)), nb_widen(a),                  \
                                      nb_wselect(nb_wmask_false, nb_widen(a), nb_widen(b)))))                          \
    X(narrow_mask, nb_select(nb_narrow_mask(nb_widen(a) * nb_widen(b) < NB_W(1.0)), a, b))                             \
    X(wide_rcp, nb_narrow(nb_wrcp_bounded(nb_widen(a)) * nb_wsign_one(nb_widen(b))))                                   \
    X(wide_length3, nb_narrow(nb_wlength3(                                                                             \
                        nb_wsub3(nb_widen3(nb_vec3(a, b, a)), nb_wscale3(nb_widen3(nb_vec3(b, b, a)), NB_W(0.25))))))  \
    X(wide_cross3,                                                                                                     \
      nb_narrow(nb_wdot3(                                                                                              \
          nb_wcross3(nb_wvec3(nb_widen(a), nb_widen(b), NB_W(1.0)), nb_widen3(nb_vec3(b, b, a))),                      \
          nb_wmul3(nb_widen3(nb_vec3(b, a, a)), nb_wadd3(nb_widen3(nb_vec3(b, a, a)), nb_widen3(nb_vec3(a, a, b))))))) \
    X(wide_select3, nb_length3(nb_narrow3(nb_wselect3(nb_widen(a) < nb_widen(b), nb_widen3(nb_vec3(a, b, a)),          \
                                                      nb_widen3(nb_vec3(b, a, a))))))

typedef enum nb_elementary {
#define NB_ELEMENTARY_ENUM(name, expression) NB_ELEMENTARY_##name,
    NB_ELEMENTARY_FUNCTIONS(NB_ELEMENTARY_ENUM)
#undef NB_ELEMENTARY_ENUM
        NB_ELEMENTARY_COUNT
} nb_elementary;

/* The counts below are multiples of this, so that every width divides them. */
#define NB_ELEMENTARY_BLOCK 16

/* Applies a function to `count` pairs. */
typedef void nb_elementary_float(nb_elementary function, size_t count, const float *a, const float *b, float *result);
typedef void nb_elementary_double(nb_elementary function, size_t count, const double *a, const double *b,
                                  double *result);

/* NULL, or what is wrong with the loads, lanes and mask tests of the level. */
typedef const char *nb_elementary_lanes(void);

#define NB_ELEMENTARY_LEVELS(X) X(scalar) X(sse2) X(avx2) X(avx512) X(neon)
#define NB_ELEMENTARY_DECLARE(level)                                                                                   \
    nb_elementary_float nb_elementary_##level, nb_elementary_##level##_fast;                                           \
    nb_elementary_lanes nb_elementary_lanes_##level, nb_elementary_lanes_##level##_fast;
NB_ELEMENTARY_LEVELS(NB_ELEMENTARY_DECLARE)
#undef NB_ELEMENTARY_DECLARE

nb_elementary_double nb_elementary_reference;
nb_elementary_lanes nb_elementary_lanes_reference;

#endif
