/* Random inputs of the formulas of formula_level.h, shaped so that every branch and every bad case comes up. */
#ifndef NB_FORMULA_INPUTS_H
#define NB_FORMULA_INPUTS_H

#include "formula_level.h"

typedef struct nb_formula_dice {
    unsigned long long state;
} nb_formula_dice;

long double nb_formula_between(nb_formula_dice *dice, long double low, long double high);
int nb_formula_pick(nb_formula_dice *dice, int count);

/* How many digits the wide type of a level has; its rounding unit is what NB_WEPSILON is there. */
typedef enum nb_formula_digits { NB_DIGITS_FLOAT, NB_DIGITS_DOUBLE, NB_DIGITS_LONG } nb_formula_digits;

long double nb_formula_unit(nb_formula_digits digits);
long double nb_formula_round(nb_formula_digits digits, long double x);

/* Fills in[], rounded to the wide type: rays that hit, graze, miss, start inside and 1e7 m away, run along an axis, a
 * side or through an apex; profiles level, steep, thin, endless. `reach` is what the march gives such a shape. */
void nb_formula_draw(nb_formula_dice *dice, nb_formula formula, nb_formula_digits digits,
                     long double in[NB_FORMULA_INPUTS]);

#endif
