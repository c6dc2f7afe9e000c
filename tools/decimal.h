/* Decimal text to numbers, the same in every locale. */
#ifndef NB_DECIMAL_H
#define NB_DECIMAL_H

#include <stddef.h>
#include <stdint.h>

typedef enum nb_decimal_result {
    NB_DECIMAL_GOOD = 0,
    NB_DECIMAL_MALFORMED, /* not a number as it is written here */
    NB_DECIMAL_TOO_LARGE  /* beyond the range of the type */
} nb_decimal_result;

/* The longest number that is read, in characters. */
#define NB_DECIMAL_LONGEST 400

/* All of text[0..size) is one number: [+-] digits [. digits] [e [+-] digits] with at least one digit before the
 * exponent, or [+-] inf or infinity in any case. Correctly rounded; too small to be told from 0 is 0. No nan, no
 * hexadecimal, no white space. *value is untouched unless the result is GOOD. */
nb_decimal_result nb_decimal_read(const char *text, size_t size, double *value);

/* All of text[0..size) is digits. */
nb_decimal_result nb_decimal_read_whole(const char *text, size_t size, uint32_t *value);

#endif
