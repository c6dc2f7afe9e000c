/* Any bytes as key frames of a number and frames to look at: the interval holds the frame, and what lies between is a number; where it is
 * limited, one between those of the two keys around; at a key that of the key. */
#include "keys/keyframes.h"

#include "witness.h"

#include <math.h>
#include <stdint.h>
#include <string.h>

enum { MOST_KEYS = 16 };

typedef struct key {
    double frame, value;
} key;

static void check(const key *keys, size_t count, double frame)
{
    nb_keyframes around;
    const bool between = nb_keyframes_find(&keys[0].frame, sizeof *keys, count, frame, &around);
    for (int i = 0; i < 4 && between; i++) demand(around.keys[i] < count);
    if (!between) {
        demand(around.keys[1] < count);
        demand(frame <= keys[0].frame || frame >= keys[count - 1].frame);
        return;
    }
    const key *a = &keys[around.keys[1]], *b = &keys[around.keys[2]];
    double values[4];
    demand(a->frame <= frame && frame <= b->frame && around.s >= 0 && around.s <= 1);
    demand(nb_keyframes_nearer(&around) == around.keys[1] || nb_keyframes_nearer(&around) == around.keys[2]);
    for (int i = 0; i < 4; i++) values[i] = keys[around.keys[i]].value;
    demand(isfinite(nb_keyframes_between(&around, false, values)));
    const double limited = nb_keyframes_between(&around, true, values);
    demand(limited >= fmin(a->value, b->value) && limited <= fmax(a->value, b->value));
    if (around.s == 0) demand(limited == a->value);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    key keys[MOST_KEYS];
    size_t count = 0, at = 0;
    for (; at + sizeof *keys <= size && count < MOST_KEYS; at += sizeof *keys) {
        memcpy(&keys[count], data + at, sizeof *keys);
        /* As scenes may have them. */
        if (!(fabs(keys[count].frame) <= 1e9 && fabs(keys[count].value) <= 1e15)) continue;
        count += count == 0 || keys[count].frame > keys[count - 1].frame;
    }
    if (count == 0) return 0;
    for (size_t i = 0; i < count; i++) check(keys, count, keys[i].frame);
    for (size_t i = 1; i < count; i++) {
        check(keys, count, keys[i - 1].frame + (keys[i].frame - keys[i - 1].frame) * 0.37);
        check(keys, count, nextafter(keys[i].frame, (double)-INFINITY));
        check(keys, count, nextafter(keys[i - 1].frame, (double)INFINITY));
    }
    check(keys, count, keys[0].frame - 1);
    check(keys, count, keys[count - 1].frame + 1);
    return 0;
}
