/* What the kernels of clouds share, behind the prelude. */
#ifndef NB_CLOUDS_CLOUD_KERNEL_PRELUDE_H
#define NB_CLOUDS_CLOUD_KERNEL_PRELUDE_H

#include "base/isa_list.h"

/* nb_level_of, as a whole number and a part of the next. */
typedef struct nb_halvings {
    nb_real whole, part;
} nb_halvings;

static inline nb_halvings nb_halve(nb_real times)
{
    const nb_bits bits = nb_to_bits(nb_max(NB_F(1.0), times));
    return (nb_halvings){nb_from_bits(bits >> NB_SHIFT | NB_INTEGER_BITS) - (NB_INTEGER + NB_BIAS),
                         nb_from_bits((bits & NB_FRACTION_BITS) | NB_ONE_BITS) - NB_F(1.0)};
}

#endif
