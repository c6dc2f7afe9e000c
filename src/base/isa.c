#include "isa.h"

#include "isa_list.h"

#include <stddef.h>

#if defined(__x86_64__) || defined(__i386__)

static int is_supported(nebel_isa isa)
{
    __builtin_cpu_init();
    switch (isa) {
    case NEBEL_ISA_SCALAR:
        return 1;
    case NEBEL_ISA_SSE2:
        return __builtin_cpu_supports("sse2") != 0;
    case NEBEL_ISA_AVX2:
        return __builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma");
    case NEBEL_ISA_AVX512:
        return __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq") &&
               __builtin_cpu_supports("avx512bw") && __builtin_cpu_supports("avx512vl");
    default:
        return 0;
    }
}

#else

static int is_supported(nebel_isa isa)
{
#if defined(__aarch64__)
    if (isa == NEBEL_ISA_NEON) return 1; /* part of the architecture */
#endif
    return isa == NEBEL_ISA_SCALAR;
}

#endif

nebel_isa nb_isa_select(nebel_isa isa)
{
#define LEVEL(NAME, suffix) NEBEL_ISA_##NAME,
    static const nebel_isa levels[] = {NB_ISA_LIST(LEVEL)};
#undef LEVEL
    nebel_isa chosen = NEBEL_ISA_COUNT;
    for (size_t i = 0; i < sizeof levels / sizeof *levels; i++)
        if ((isa == NEBEL_ISA_DEFAULT || isa == levels[i]) && is_supported(levels[i])) chosen = levels[i];
    return chosen;
}
