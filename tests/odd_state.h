/* State of OpenGL: all that glGet tells, and values of it that nobody expects. The list is of what OpenGL has, not of
 * what nebel touches. */
#ifndef ODD_STATE_H
#define ODD_STATE_H

enum { ODD_UNITS = 16, ODD_MOST = 2048 };

typedef struct odd_snapshot {
    double values[ODD_MOST];
    char labels[ODD_MOST][24];
    int count;
} odd_snapshot;

void odd_take(odd_snapshot *s, int desktop);

/* Fails with the first difference. */
void odd_expect_same(const odd_snapshot *before, const odd_snapshot *after);

typedef struct odd {
    unsigned array, buffers[4], samplers[ODD_UNITS], textures[ODD_UNITS][5], program, pipeline;
} odd;

/* Sets everything to odd values, with the switches on or off, but what belongs to the host's target. */
void odd_set(odd *o, int desktop, int on);

/* One odd thing alone, in OpenGL: which it is, "" behind the last. First odd_prepare: what the switches ask for is odd
 * then, and the switches are as in a new context. */
void odd_prepare(void);
const char *odd_set_alone(int which, int on);

/* Pixels are read into memory as usual again. */
void odd_plain_reading(int desktop);

/* Deletes the objects; the state stays. */
void odd_delete(odd *o);

#endif
