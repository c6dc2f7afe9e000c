/* From linear light to what a screen shows. */
#include "batch_layout.h"

#include <nebel/render.h>

#include <math.h>
#include <string.h>

/* Brighter than this differs from white by less than the last bit of a channel; keeps infinities out of the quotients.
 */
static const float brightest_tone = 65504;

/* f(x) = x (x + a) / (x^2 + b x + c), our own. Black stays 0, the limit is 1, and f rises everywhere, because b > a:
 * f' = ((b - a) x^2 + 2 c x + a c) / (x^2 + b x + c)^2. The constants follow from three wishes: middle grey 0.18 stays
 * 0.18; there contrast is 1.15 (d ln f / d ln x); the slope in black, a / c, is 0.6. White paper, 1, comes out as 0.70.
 */
static inline float curve(float x)
{
    const float a = 0.114967742f, b = 0.394193548f, c = 0.191612903f;
    return x * (x + a) / (x * (x + b) + c);
}

static inline float from_bits(uint32_t bits)
{
    float x;
    memcpy(&x, &bits, sizeof x);
    return x;
}

static inline uint32_t to_bits(float x)
{
    uint32_t bits;
    memcpy(&bits, &x, sizeof bits);
    return bits;
}

/* The third of the bits of x is a cube root within 4 %; Halley's iteration triples the correct digits, twice. */
static inline float cube_root(float x)
{
    const float guess = from_bits(0x2a555555u - 0x46000u + to_bits(x) / 3);
    const float cube = guess * guess * guess;
    const float better = guess * (cube + 2 * x) / (2 * cube + x);
    const float cube2 = better * better * better;
    return better * (cube2 + 2 * x) / (2 * cube2 + x);
}

/* IEC 61966-2-1, with x^(1 / 2.4) = x^(1/4) x^(1/6). */
static inline float encode(float x)
{
    const float base = x > 0.0031308f ? x : 0.0031308f;
    const float power = 1.055f * (sqrtf(sqrtf(base)) * sqrtf(cube_root(base))) - 0.055f;
    const float encoded = x > 0.0031308f ? power : 12.92f * x;
    return encoded < 1 ? encoded : 1;
}

NB_CLONES static void map(size_t count, const float *linear, float scale, float *srgb)
{
    NB_SIMD
    for (size_t i = 0; i < count; i++) {
        const float x = linear[i] * scale;
        const float positive = x > 0 ? x : 0;
        srgb[i] = encode(curve(positive < brightest_tone ? positive : brightest_tone));
    }
}

NB_CLONES static void encode_all(size_t count, const float *linear, float scale, float *srgb)
{
    NB_SIMD
    for (size_t i = 0; i < count; i++) {
        const float x = linear[i] * scale;
        const float positive = x > 0 ? x : 0;
        srgb[i] = encode(positive < 1 ? positive : 1);
    }
}

void nebel_encode_srgb(size_t n, const float *linear, double exposure, float *srgb)
{
    if (linear == NULL || srgb == NULL) return;
    encode_all(3 * n, linear, (float)exp2(exposure), srgb);
}

void nebel_tone_map(size_t n, const float *linear, double exposure, float *srgb)
{
    if (linear == NULL || srgb == NULL) return;
    map(3 * n, linear, (float)exp2(exposure), srgb);
}
