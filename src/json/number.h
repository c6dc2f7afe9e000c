/* Decimal text to double, whatever the locale. */
#ifndef NB_JSON_NUMBER_H
#define NB_JSON_NUMBER_H

#include <locale.h>
#include <stdbool.h>
#include <stddef.h>

/* Longest number read; 770 digits decide every double. */
#define NB_NUMBER_LENGTH 1000

/* Reads a JSON number, correctly rounded. `c_locale` is the locale "C". False where it is longer than NB_NUMBER_LENGTH.
 * Numbers beyond the largest double give an infinity. */
bool nb_number_parse(const char *text, size_t size, locale_t c_locale, double *value);

#endif
