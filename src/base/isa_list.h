/* The instruction sets that this build has kernels for. */
#ifndef NB_BASE_ISA_LIST_H
#define NB_BASE_ISA_LIST_H

#if defined(NB_HAVE_NEON)
#define NB_ISA_LIST_NEON(X) X(NEON, neon)
#else
#define NB_ISA_LIST_NEON(X)
#endif

#if defined(NB_HAVE_SSE2)
#define NB_ISA_LIST_SSE2(X) X(SSE2, sse2)
#else
#define NB_ISA_LIST_SSE2(X)
#endif

#if defined(NB_HAVE_AVX2)
#define NB_ISA_LIST_AVX2(X) X(AVX2, avx2)
#else
#define NB_ISA_LIST_AVX2(X)
#endif

#if defined(NB_HAVE_AVX512)
#define NB_ISA_LIST_AVX512(X) X(AVX512, avx512)
#else
#define NB_ISA_LIST_AVX512(X)
#endif

/* X(NAME, suffix) for each: C first, then ascending. */
#define NB_ISA_LIST(X)                                                                                                 \
    X(SCALAR, scalar) NB_ISA_LIST_NEON(X) NB_ISA_LIST_SSE2(X) NB_ISA_LIST_AVX2(X) NB_ISA_LIST_AVX512(X)

/* What a kernel calls its symbol in the level that it is compiled for: NB_SUFFIXED(nb_trace_) is nb_trace_avx2. The build defines
 * NB_SUFFIX. */
#define NB_JOIN(prefix, suffix) prefix##suffix
#define NB_JOIN_VALUES(prefix, suffix) NB_JOIN(prefix, suffix)
#define NB_SUFFIXED(prefix) NB_JOIN_VALUES(prefix, NB_SUFFIX)

#endif
