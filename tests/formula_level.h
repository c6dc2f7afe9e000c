/* Shapes, profiles and media, compiled once per precision and asked by name: what test_shapes.c, test_profiles.c and
 * test_formulas_gl.c evaluate. */
#ifndef NB_FORMULA_LEVEL_H
#define NB_FORMULA_LEVEL_H

#include <stddef.h>

enum { NB_FORMULA_INPUTS = 16, NB_FORMULA_OUTPUTS = 4 };

/* X(name, expression): C and GLSL at once. a0 ... are the inputs, r0 ... the same narrowed, v0 = (a0, a1, a2) and so
 * on; of_... puts a result into the outputs: an interval as enter, leave and their slacks, an estimate as value, error.
 */
#define NB_FORMULA_INTERVALS(X)                                                                                        \
    X(all, of_interval(nb_interval_all()))                                                                             \
    X(meet, of_interval(nb_interval_meet(interval(a0, a1, a2, a3), interval(a4, a5, a6, a7))))                         \
    X(hull, of_interval(nb_interval_hull(interval(a0, a1, a2, a3), interval(a4, a5, a6, a7))))                         \
    X(slab, of_interval(nb_interval_slab(a0, a1, a2, a3, a4)))                                                         \
    X(around, of_interval(nb_interval_around(a0, a1, a2, a3)))                                                         \
    X(box, of_interval(nb_interval_box(v0, v3, v6, v9, a12)))                                                          \
    X(half_space, of_interval(nb_interval_half_space(v0, v3, v6, a9, a10, a11, a12, a13)))                             \
    X(ball, of_interval(nb_interval_sphere(v0, v3, a6, a12)))                                                          \
    X(pipe, of_interval(nb_interval_pipe(v0, v3, a12)))                                                                \
    X(tube, of_interval(nb_interval_cylinder(v0, v3, a12)))                                                            \
    X(cone, of_interval(nb_interval_cone(v0, v3, a6, a7, a12)))                                                        \
    X(capsule, of_interval(nb_interval_capsule(v0, v3, a6, a12)))

#define NB_FORMULA_INTEGRALS(X)                                                                                        \
    X(height_integral, of_estimate(nb_height_integral(r0, r1, r2)))                                                    \
    X(height_capped_integral, of_estimate(nb_height_capped_integral(r0, r1, r2)))                                      \
    X(linear_integral, of_estimate(nb_linear_integral(r0, r1, r2)))                                                    \
    X(gaussian_integral, of_estimate(nb_gaussian_integral(r0, r1, r2, r3)))                                            \
    X(radial_1_integral, of_estimate(nb_radial_integral(r0, r1, r2, r3, 1)))                                           \
    X(radial_2_integral, of_estimate(nb_radial_integral(r0, r1, r2, r3, 2)))                                           \
    X(radial_3_integral, of_estimate(nb_radial_integral(r0, r1, r2, r3, 3)))                                           \
    X(soft_edge_integral, of_estimate(nb_soft_edge_integral(v0, v3, v6, a9)))

#define NB_FORMULA_VALUES(X)                                                                                           \
    X(bounded_length, of_real(nb_bounded_length(r0)))                                                                  \
    X(height_density, of_real(nb_height_density(r0)))                                                                  \
    X(height_capped_density, of_real(nb_height_capped_density(r0)))                                                    \
    X(linear_density, of_real(nb_linear_density(r0)))                                                                  \
    X(gaussian_density, of_real(nb_gaussian_density(r0, r1)))                                                          \
    X(radial_1_density, of_real(nb_radial_density(r0, r1, 1)))                                                         \
    X(radial_2_density, of_real(nb_radial_density(r0, r1, 2)))                                                         \
    X(radial_3_density, of_real(nb_radial_density(r0, r1, 3)))                                                         \
    X(soft_edge_density, of_real(nb_soft_edge_density(v0, v6)))                                                        \
    X(soft_axis, of_wide(nb_soft_axis(a0, a6)))                                                                        \
    X(soft_axis_kink, of_wide(nb_soft_axis_kink(a0, a3, a6, a9)))                                                      \
    X(soft_edge_kink, of_wide(nb_soft_edge_kink(v0, v3, v6, a9)))                                                      \
    X(gather, of_real(nb_medium_gather(r0, r1)))                                                                       \
    X(fog_linear, of_real(nb_fog_linear(r0, r1, r2)))                                                                  \
    X(fog_exp, of_real(nb_fog_exp(r0, r1)))                                                                            \
    X(fog_exp2, of_real(nb_fog_exp2(r0, r1)))                                                                          \
    X(phase_lobe, of_real(nb_phase_lobe(r0, r1, r2, r3, nb_turn_between(v6, v9))))                                     \
    X(turn_cosine, of_real(nb_turn_between(v6, v9).cosine))                                                            \
    X(turn_ahead, of_real(nb_turn_between(v6, v9).ahead))                                                              \
    X(light_fluence, of_wide(nb_light_fluence(a0, a1)))                                                                \
    X(light_cone, of_real(nb_light_cone(r0, r1, r2)))                                                                  \
    X(swing_end, of_wide(nb_swing_between(a0, a1, a2, a3).end))                                                        \
    X(swing_place, of_wide(nb_swing_place(nb_swing_between(a0, a1, a2, a3), a4)))                                      \
    X(swing_rate, of_wide(nb_swing_rate(nb_swing_between(a0, a1, a2, a3), a4)))

#define NB_FORMULAS(X) NB_FORMULA_INTERVALS(X) NB_FORMULA_INTEGRALS(X) NB_FORMULA_VALUES(X)

typedef enum nb_formula {
#define NB_FORMULA_ENUM(name, expression) NB_FORMULA_##name,
    NB_FORMULAS(NB_FORMULA_ENUM)
#undef NB_FORMULA_ENUM
        NB_FORMULA_COUNT
} nb_formula;

/* Inputs are rounded to the wide type of the level. Outputs that a formula does not have are 0. */
typedef void nb_formula_evaluate(nb_formula formula, const long double in[NB_FORMULA_INPUTS],
                                 long double out[NB_FORMULA_OUTPUTS]);

/* float with double as wide; double with long double as wide; float alone, which is what GLSL has */
nb_formula_evaluate nb_formula_float, nb_formula_double, nb_formula_fast;

#endif
