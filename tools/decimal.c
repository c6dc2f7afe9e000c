#include "decimal.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* A number taken apart: digits * 10^exponent, as far as 19 digits reach. */
typedef struct decimal_parts {
    uint64_t digits;
    int significant; /* digits taken, leading zeros apart; more than 19: `digits` is not all of them */
    int exponent;
    int negative;
} decimal_parts;

static int is_digit(char c)
{
    return c >= '0' && c <= '9';
}

static void take_digit(decimal_parts *number, char c)
{
    if (number->significant == 0 && c == '0') return;
    if (number->significant < 19) number->digits = number->digits * 10 + (uint64_t)(c - '0');
    number->significant++;
}

/* Reads digits with at most one point; returns where they end, or NULL where there is no digit. */
static const char *read_mantissa(const char *at, const char *end, decimal_parts *number)
{
    int count = 0;
    int point = 0;
    for (; at < end; at++) {
        if (*at == '.' && !point) {
            point = 1;
        } else if (is_digit(*at)) {
            take_digit(number, *at);
            count++;
            number->exponent -= point;
        } else {
            break;
        }
    }
    return count > 0 ? at : NULL;
}

/* Reads what follows the e; exponents beyond any double are kept at a bound that still is. */
static const char *read_exponent(const char *at, const char *end, decimal_parts *number)
{
    const int negative = at < end && *at == '-';
    if (at < end && (*at == '-' || *at == '+')) at++;
    if (at == end || !is_digit(*at)) return NULL;
    int exponent = 0;
    for (; at < end && is_digit(*at); at++) {
        if (exponent < 100000) exponent = exponent * 10 + (*at - '0');
    }
    number->exponent += negative ? -exponent : exponent;
    return at;
}

static int is_infinity(const char *text, size_t size)
{
    static const char word[] = "infinity";
    if (size != 3 && size != 8) return 0;
    for (size_t i = 0; i < size; i++) {
        const char c = text[i] >= 'A' && text[i] <= 'Z' ? (char)(text[i] - 'A' + 'a') : text[i];
        if (c != word[i]) return 0;
    }
    return 1;
}

/* Exact where digits and power of ten both are doubles without rounding: then there is one rounding only, that of the
 * product or quotient (W. D. Clinger, How to read floating point numbers accurately, 1990). */
static int combine_exactly(const decimal_parts *number, double *value)
{
    static const double powers[] = {1e0,  1e1,  1e2,  1e3,  1e4,  1e5,  1e6,  1e7,  1e8,  1e9,  1e10, 1e11,
                                    1e12, 1e13, 1e14, 1e15, 1e16, 1e17, 1e18, 1e19, 1e20, 1e21, 1e22};
    if (FLT_EVAL_METHOD != 0 || number->significant > 19 || number->digits > (UINT64_C(1) << 53)) return 0;
    if (number->exponent < -22 || number->exponent > 22) return 0;
    const double digits = (double)number->digits;
    *value = number->exponent < 0 ? digits / powers[-number->exponent] : digits * powers[number->exponent];
    return 1;
}

/* The program never sets a locale, so that strtod reads a point. The caller has checked the syntax. */
static double combine_slowly(const char *text, size_t size)
{
    char copy[NB_DECIMAL_LONGEST + 1];
    memcpy(copy, text, size);
    copy[size] = '\0';
    return strtod(copy, NULL);
}

nb_decimal_result nb_decimal_read(const char *text, size_t size, double *value)
{
    if (size == 0 || size > NB_DECIMAL_LONGEST) return NB_DECIMAL_MALFORMED;
    const char *const end = text + size;
    decimal_parts number = {.negative = text[0] == '-'};
    const char *const start = text + (text[0] == '-' || text[0] == '+');
    double magnitude = (double)INFINITY;
    if (!is_infinity(start, (size_t)(end - start))) {
        const char *at = read_mantissa(start, end, &number);
        if (at != NULL && at < end && (*at == 'e' || *at == 'E')) at = read_exponent(at + 1, end, &number);
        if (at != end) return NB_DECIMAL_MALFORMED;
        if (!combine_exactly(&number, &magnitude)) magnitude = combine_slowly(start, (size_t)(end - start));
        if (isinf(magnitude)) return NB_DECIMAL_TOO_LARGE;
    }
    *value = number.negative ? -magnitude : magnitude;
    return NB_DECIMAL_GOOD;
}

nb_decimal_result nb_decimal_read_whole(const char *text, size_t size, uint32_t *value)
{
    if (size == 0) return NB_DECIMAL_MALFORMED;
    uint64_t number = 0;
    for (size_t i = 0; i < size; i++) {
        if (!is_digit(text[i])) return NB_DECIMAL_MALFORMED;
        if (number <= UINT32_MAX) number = number * 10 + (uint64_t)(text[i] - '0');
    }
    if (number > UINT32_MAX) return NB_DECIMAL_TOO_LARGE;
    *value = (uint32_t)number;
    return NB_DECIMAL_GOOD;
}
