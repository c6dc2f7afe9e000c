/* Which numbers the keys of a scene file take: one table of limits, those of the core. */
#ifndef NB_KEYS_KEY_RANGE_H
#define NB_KEYS_KEY_RANGE_H

#include <stdbool.h>

/* What a number is times or by: the unit of a file changes its limits there. */
typedef enum nb_key_unit {
    NB_PURE,
    NB_LENGTH,    /* low and high are in metres */
    NB_PER_LENGTH /* and here per metre */
} nb_key_unit;

typedef struct nb_range {
    double low, high;
    bool open;     /* without its ends */
    bool or_zero;  /* 0 is good, too */
    bool mirrored; /* so is what is good times -1 */
    nb_key_unit dimension;
    const char *text; /* in messages: all of it where it is pure, else "a length", behind which the limits stand */
} nb_range;

extern const nb_range nb_range_any, nb_range_positive, nb_range_fraction;
extern const nb_range nb_range_light;     /* radiance and what comes of it, and settings of engines, >= 0 */
extern const nb_range nb_range_factor;    /* of a scale; not 0 */
extern const nb_range nb_range_place;     /* one coordinate of it */
extern const nb_range nb_range_extent;    /* a length > 0 */
extern const nb_range nb_range_end;       /* the radius of one end of a cone: 0, too */
extern const nb_range nb_range_distance;  /* a length >= 0 */
extern const nb_range nb_range_amount;    /* extinction, emission, >= 0 */
extern const nb_range nb_range_density;   /* the same of a fog factor, > 0 */
extern const nb_range nb_range_frame;     /* of an animation */
extern const nb_range nb_range_asymmetry; /* the mean cosine g of a phase function */

/* Whether a number of a file whose unit is `unit` metres is in the range. */
bool nb_range_holds(const nb_range *range, double unit, double number);

/* What the range is, in the numbers of such a file: "a length from 1e-15 to 1e15 m". */
#define NB_RANGE_TEXT 240
const char *nb_range_describe(const nb_range *range, double unit, char text[NB_RANGE_TEXT]);

#endif
