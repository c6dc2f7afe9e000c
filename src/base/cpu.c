#include "cpu.h"

#if defined(__x86_64__) || defined(__i386__)

int nb_cpu_supports(nebel_isa isa)
{
    __builtin_cpu_init();
    switch (isa) {
    case NEBEL_ISA_DEFAULT:
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

int nb_cpu_supports(nebel_isa isa)
{
#if defined(__aarch64__)
    if (isa == NEBEL_ISA_NEON) return 1; /* part of the architecture */
#endif
    return isa == NEBEL_ISA_DEFAULT || isa == NEBEL_ISA_SCALAR;
}

#endif
