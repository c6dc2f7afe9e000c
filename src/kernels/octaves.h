/* What the stream kernels share beyond the formulas; included after formulas/elementary.inc, for float only. */
#ifndef NB_KERNELS_OCTAVES_H
#define NB_KERNELS_OCTAVES_H

/* Packets travel in registers only inside one function. */
#define NB_INLINE static inline __attribute__((always_inline))

/* 2^x for x <= 0, 0 below -126.5 and 1 for a NaN: 2^n as an exponent times 2^f, |f| <= 1/2, by the weighted minimax polynomial that
 * scripts/fit_elementary.py finds, in Estrin's order, because packets wait for each other's results; relative error 3e-7. The lowest bits of `shifted` are n + bias, whatever else it holds is
 * shifted out. */
NB_INLINE nb_real nb_light_after(nb_real x)
{
    const nb_real shifter = NB_INTEGER * NB_F(1.5) + NB_BIAS;
    const nb_real y = nb_max(nb_min(x, NB_F(0.0)), -NB_BIAS);
    const nb_real shifted = y + shifter;
    const nb_real f = y - (shifted - shifter);
    const nb_real f2 = f * f;
    const nb_real low = NB_F(0.240222405) * f + NB_F(0.693146976), high = NB_F(0.00967161926) * f + NB_F(0.05550735);
    const nb_real p = (low + f2 * (high + f2 * NB_F(0.00132645981))) * f + NB_F(1.0);
    return nb_from_bits(nb_to_bits(shifted) << NB_SHIFT) * p;
}

#endif
