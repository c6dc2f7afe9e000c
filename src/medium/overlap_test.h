/* What is known of a body along a piece of a ray without dividing it: all, some or nothing of the piece lies in it. */
#ifndef NB_MEDIUM_OVERLAP_TEST_H
#define NB_MEDIUM_OVERLAP_TEST_H

#include "volume.h"

typedef enum nb_overlap { NB_ABSENT, NB_UNSURE, NB_PRESENT } nb_overlap;

/* A ray whose direction has length 1. */
typedef struct nb_line {
    double origin[3], direction[3];
} nb_line;

/* What of the body is on the open piece from `from` to `to` [m], which may be infinite. ABSENT and PRESENT hold in
 * spite of rounding. Round leaves are never PRESENT, but a piece that leaves no body any more, or never enters one, is
 * always decided. */
nb_overlap nb_volume_presence(const nb_volume *volume, const nb_line *line, double from, double to);

/* The first place behind `from` at which the answer may change; HUGE_VAL: there is none. */
double nb_volume_next_change(const nb_volume *volume, const nb_line *line, double from);

#endif
