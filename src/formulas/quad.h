/* The widest numbers that the compiler has: at least 113 bits of significand wherever gcc or clang know such a type, in
 * software on x86-64. A ray that touches a surface to the last bit of double has answers here, and nowhere else. */
#ifndef NB_QUAD_H
#define NB_QUAD_H

#include <float.h>
#include <math.h>

#if defined(__SIZEOF_FLOAT128__) && LDBL_MANT_DIG < 113
#define NB_HAVE_QUAD /* wider than long double */

__extension__ typedef __float128 nb_quad;

#define NB_QUAD_EPSILON ((nb_quad)0x1p-112)

/* One step of Newton's from 64 digits. */
static inline nb_quad nb_quad_sqrt(nb_quad x)
{
    const nb_quad root = (nb_quad)sqrtl((long double)x);
    return root > 0 ? (root + x / root) / 2 : root;
}

static inline nb_quad nb_quad_abs(nb_quad x)
{
    return __builtin_fabsf128(x);
}

static inline nb_quad nb_quad_copy_sign(nb_quad magnitude, nb_quad sign)
{
    return __builtin_copysignf128(magnitude, sign);
}

#else

typedef long double nb_quad;

#define NB_QUAD_EPSILON LDBL_EPSILON

static inline nb_quad nb_quad_sqrt(nb_quad x)
{
    return sqrtl(x);
}

static inline nb_quad nb_quad_abs(nb_quad x)
{
    return fabsl(x);
}

#endif

#endif
