/* The target a formula file is compiled for.
 *
 * A C file that uses formulas includes this header, then the .inc files it needs in the order of the file ORDER:
 *
 *     #include "formulas/prelude.h"
 *     #include "formulas/elementary.inc"
 *
 * Macros of the compiler call choose the target:
 *     (none)                       one float, one double as wide
 *     NB_DOUBLE                    one double, one long double as wide: the reference
 *     NB_DOUBLE and NB_QUAD        one double, one of 113 bits as wide: for rays that the reference cannot decide
 *     NB_ISA_SSE2 | NB_ISA_NEON    2 floats, 2 doubles as wide
 *     NB_ISA_AVX2                  4 floats, 4 doubles as wide
 *     NB_ISA_AVX512                8 floats, 8 doubles as wide (needs -mavx512f -mavx512vl -mavx512dq)
 *     NB_ISA_... and NB_DOUBLE     2, 4, 8 doubles, wide is real
 *     NB_FAST with any of these    wide is real, and twice as many lanes (4, 8, 16; still one without NB_ISA_...)
 *
 * Always with -ffp-contract=off -fno-math-errno: then a lane has the same bits in every target of the same precision
 * (a NaN is a NaN everywhere, but its sign and payload may differ).
 */
#ifndef NB_PRELUDE_H
#define NB_PRELUDE_H

#if defined(NB_ISA_SSE2) || defined(NB_ISA_AVX2) || defined(NB_ISA_AVX512) || defined(NB_ISA_NEON)
#ifdef NB_DOUBLE
#include "prelude_double.h"
#else
#include "prelude_simd.h"
#endif
#else
#include "prelude_c.h"
#endif

#endif
