#include "keyframes.h"

#include <math.h>

static double frame_at(const double *frames, size_t stride, size_t i)
{
    return *(const double *)((const char *)frames + i * stride);
}

/* The last key at or before the frame, which lies between the first and the last. */
static size_t find_last_key(const double *frames, size_t stride, size_t count, double frame)
{
    size_t low = 0, high = count - 1;
    while (high - low > 1) {
        const size_t middle = low + (high - low) / 2;
        if (frame_at(frames, stride, middle) <= frame)
            low = middle;
        else
            high = middle;
    }
    return low;
}

bool nb_keyframes_find(const double *frames, size_t stride, size_t count, double frame, nb_keyframes *around)
{
    const bool before = !(frame > frame_at(frames, stride, 0));
    const bool after = !before && frame >= frame_at(frames, stride, count - 1);
    *around = (nb_keyframes){.keys = {0, after ? count - 1 : 0}};
    if (before || after) return false;
    const size_t at = find_last_key(frames, stride, count, frame);
    around->has_before = at > 0;
    around->has_after = at + 2 < count;
    const size_t keys[4] = {around->has_before ? at - 1 : at, at, at + 1, around->has_after ? at + 2 : at + 1};
    for (int i = 0; i < 4; i++) {
        around->keys[i] = keys[i];
        around->frames[i] = frame_at(frames, stride, keys[i]);
    }
    const double s = (frame - around->frames[1]) / (around->frames[2] - around->frames[1]);
    around->s = s > 0 ? fmin(s, 1) : 0; /* also of a host's keys that do not ascend, or are no numbers */
    return true;
}

size_t nb_keyframes_nearer(const nb_keyframes *around)
{
    return around->keys[around->s < .5 ? 1 : 2];
}

/* The slope at a key between two intervals of lengths h0, h1 and mean slopes d0, d1: that of the parabola through the
 * three keys (Catmull and Rom, for unequal distances). */
static double smooth_slope(double h0, double d0, double h1, double d1)
{
    return (d0 * h1 + d1 * h0) / (h0 + h1);
}

/* The same without leaving the keys' range: the weighted harmonic mean of F. Fritsch and J. Butland (1984). */
static double limited_slope(double h0, double d0, double h1, double d1)
{
    if (d0 * d1 <= 0) return 0;
    const double w0 = 2 * h1 + h0, w1 = h1 + 2 * h0;
    return (w0 + w1) / (w0 / d0 + w1 / d1);
}

/* At the second of three keys. */
static double find_slope(const double *frames, const double *values, bool limited)
{
    const double h0 = frames[1] - frames[0], h1 = frames[2] - frames[1];
    const double d0 = (values[1] - values[0]) / h0, d1 = (values[2] - values[1]) / h1;
    return limited ? limited_slope(h0, d0, h1, d1) : smooth_slope(h0, d0, h1, d1);
}

/* Cubic Hermite basis on 0..1; h is the interval's length. */
static double interpolate(double s, double h, double p0, double m0, double p1, double m1)
{
    const double r = 1 - s;
    return r * r * (1 + 2 * s) * p0 + s * s * (3 - 2 * s) * p1 + s * r * h * (r * m0 - s * m1);
}

double nb_keyframes_between(const nb_keyframes *around, bool limited, const double values[4])
{
    const double m0 = around->has_before ? find_slope(around->frames, values, limited) : 0;
    const double m1 = around->has_after ? find_slope(around->frames + 1, values + 1, limited) : 0;
    const double h = around->frames[2] - around->frames[1];
    double value = interpolate(around->s, h, values[1], m0, values[2], m1);
    /* Keys that all but coincide may have slopes beyond all numbers. */
    if (!isfinite(value)) value = around->s < .5 ? values[1] : values[2];
    if (!limited) return value;
    const double low = values[1] < values[2] ? values[1] : values[2],
                 high = values[1] < values[2] ? values[2] : values[1];
    return value < low ? low : value > high ? high : value;
}
