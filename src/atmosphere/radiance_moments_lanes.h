/* Light from everywhere at places, in lanes. Included after formulas/elementary.inc, of doubles. */
#ifndef NB_ATMOSPHERE_RADIANCE_MOMENTS_LANES_H
#define NB_ATMOSPHERE_RADIANCE_MOMENTS_LANES_H

#include "multiple_scattering.h"

/* Where the compiler knows how many orders there are it unrolls what follows. */
#define NB_MOMENTS_INLINE static inline __attribute__((always_inline))

#define NB_FOUR_PI 12.566370614359172

/* ---- places in the table --------------------------------------------------------------------- */

/* Places among entries 0 to count - 1. */
typedef struct nb_moment_interval {
    nb_real first, part;
} nb_moment_interval;

NB_MOMENTS_INLINE nb_moment_interval nb_between_of(nb_real place, int count)
{
    const nb_real bounded = nb_max(NB_F(0.0), nb_min(place, nb_splat(count - 1)));
    const nb_real first = nb_min(nb_floor(bounded), nb_splat(count - 2));
    return (nb_moment_interval){first, bounded - first};
}

NB_MOMENTS_INLINE nb_moment_interval nb_between_heights(const nb_scattering_table *scatter,
                                                        const nb_air_components *airs, nb_real radius)
{
    const double per = 1 / (airs->top - airs->radius);
    const nb_real part = nb_sqrt(nb_max(NB_F(0.0), (radius - nb_splat(airs->radius)) * nb_splat(per)));
    return nb_between_of(part * nb_splat(scatter->heights - 1), scatter->heights);
}

NB_MOMENTS_INLINE nb_moment_interval nb_between_suns(const nb_scattering_table *scatter, nb_real sun)
{
    const double per = 1 / scatter->sun_scale, times = (scatter->suns - 1) / (scatter->last_sun - scatter->first_sun);
    const nb_real left = nb_sqrt(nb_max(NB_F(0.0), NB_F(1.0) - nb_abs(sun)));
    const nb_real angle = NB_F(2.0) * nb_abs(sun) / (NB_F(1.0) + left);
    const nb_real spread = nb_copy_sign(nb_log(NB_F(1.0) + angle * nb_splat(per)), sun);
    return nb_between_of((spread - nb_splat(scatter->first_sun)) * nb_splat(times), scatter->suns);
}

/* Four neighbours in the table. */
typedef struct nb_moment_samples {
    const nb_scattering_table *scatter;
    nb_moment_interval heights, suns;
    nb_real index; /* of the first, in numbers */
} nb_moment_samples;

NB_MOMENTS_INLINE nb_moment_samples nb_spots_of(const nb_scattering_table *scatter, const nb_air_components *airs,
                                                nb_real radius, nb_real sun)
{
    nb_moment_samples spots = {.scatter = scatter,
                               .heights = nb_between_heights(scatter, airs, radius),
                               .suns = nb_between_suns(scatter, sun)};
    spots.index = (spots.heights.first * nb_splat(scatter->suns) + spots.suns.first) * NB_F(3.0 * NB_FIELD);
    return spots;
}

/* As the table has it: the logarithm of the first moment, and others as parts of it. */
NB_MOMENTS_INLINE nb_real nb_moment_at(const nb_moment_samples *spots, int moment, int c)
{
    const double *low = &spots->scatter->fields->moments[moment][c];
    const double *high = low + (size_t)(3 * NB_FIELD * spots->scatter->suns);
    const nb_real a = nb_pick(low, spots->index), b = nb_pick(low + 3 * NB_FIELD, spots->index);
    const nb_real d = nb_pick(high, spots->index), e = nb_pick(high + 3 * NB_FIELD, spots->index);
    const nb_real below = a + spots->suns.part * (b - a), above = d + spots->suns.part * (e - d);
    return below + spots->heights.part * (above - below);
}

/* ---- directions ------------------------------------------------------------------------------ */

/* Aspects in lanes. */
typedef struct nb_moment_basis_lanes {
    nb_real zenith, sun, height_of_sun;
} nb_moment_basis_lanes;

/* Spherical harmonics of a direction x, y, z that are even in y, as polynomials: those of one order follow each other. The
 * squares of those of one order integrate to 4 pi / (2 order + 1), and the sum of their products for two directions is
 * Legendre's polynomial of the angle between. */
NB_MOMENTS_INLINE void nb_basis(int orders, nb_real x, nb_real level2, nb_real z, nb_real values[NB_FIELD])
{
    /* The root of 2 (l - m)! / (l + m)! */
    static const double norms[NB_FIELD] = {1,
                                           1,
                                           1,
                                           1,
                                           0.57735026918962576,
                                           0.28867513459481288,
                                           1,
                                           0.40824829046386302,
                                           0.12909944487358056,
                                           0.052704627669472989,
                                           1,
                                           0.31622776601683794,
                                           0.074535599249992988,
                                           0.019920476822239894,
                                           0.0070429548091246447};
    nb_real side = NB_F(1.0), last_side = NB_F(0.0); /* (x + i y)^m, real part */
    double first = 1;                                /* (2 m - 1)!! */
    for (int m = 0; m < orders; m++) {
        nb_real p = nb_splat(first), before = NB_F(0.0);
        for (int l = m; l < orders; l++) {
            const int i = l * (l + 1) / 2 + m;
            values[i] = p * side * nb_splat(norms[i]);
            const nb_real next = (nb_splat(2 * l + 1) * z * p - nb_splat(l + m) * before) * nb_splat(1.0 / (l + 1 - m));
            before = p;
            p = next;
        }
        const nb_real next_side = m == 0 ? x : NB_F(2.0) * x * side - level2 * last_side;
        last_side = side;
        side = next_side;
        first *= 2 * m + 1;
    }
}

/* In a frame with z towards the sun and x towards the zenith, in which light changes little with the sun's height. Where the sun is in
 * the zenith all sides are alike: what tells them apart is 0. */
NB_MOMENTS_INLINE void nb_basis_of(int orders, nb_moment_basis_lanes aspect, nb_real values[NB_FIELD])
{
    const nb_real side2 = NB_F(1.0) - aspect.height_of_sun * aspect.height_of_sun;
    const nb_mask has_sides = side2 > NB_F(1e-12);
    const nb_real level2 = nb_max(NB_F(0.0), NB_F(1.0) - aspect.sun * aspect.sun), level = nb_sqrt(level2);
    const nb_real x =
        (aspect.zenith - aspect.height_of_sun * aspect.sun) / nb_sqrt(nb_select(has_sides, side2, NB_F(1.0)));
    nb_basis(orders, nb_select(has_sides, nb_clamp(x, -level, level), NB_F(0.0)),
             nb_select(has_sides, level2, NB_F(0.0)), aspect.sun, values);
}

#endif
