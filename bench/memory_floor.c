/* Compiled with -O3, so that the loops are vectors (bench/CMakeLists.txt). Ordinary stores, as the kernels do. */
#include "memory_floor.h"

#if defined(__x86_64__) && defined(__linux__) && !defined(__SANITIZE_ADDRESS__)
#define NB_CLONES __attribute__((target_clones("avx512f", "avx2", "default")))
#else
#define NB_CLONES
#endif

NB_CLONES static void add_three(const float *restrict a, const float *restrict b, const float *restrict c,
                                float *restrict out, size_t n)
{
    for (size_t i = 0; i < n; i++) out[i] = a[i] + b[i] + c[i];
}

NB_CLONES static void mix_two(const uint32_t *restrict a, const uint32_t *restrict b, uint32_t *restrict out, size_t n)
{
    for (size_t i = 0; i < n; i++) out[i] = a[i] ^ b[i];
}

/* A block of 1024 at a time, so that the input is read from front to back as by a kernel. */
void nb_stream_three_to_one(const float *in, float *out, size_t n)
{
    enum { BLOCK = 1024 };
    for (size_t first = 0; first < n; first += BLOCK) {
        const size_t count = n - first < BLOCK ? n - first : BLOCK;
        const float *const a = in + 3 * first;
        add_three(a, a + count, a + 2 * count, out + first, count);
    }
}

void nb_stream_two_to_one(const uint32_t *a, const uint32_t *b, uint32_t *out, size_t n)
{
    mix_two(a, b, out, n);
}
