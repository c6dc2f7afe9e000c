#define _POSIX_C_SOURCE 200809L
#include "number.h"
#include "utf8.h"

#include <float.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

typedef struct nb_json_decimal {
    uint64_t digits; /* all digits as one number */
    int digit_count; /* significant ones */
    int exponent;    /* of ten */
    bool negative;
} nb_json_decimal;

static const char *read_digits(const char *at, const char *end, nb_json_decimal *number, int exponent_step)
{
    for (; at < end && nb_text_is_digit(*at); at++) {
        if (number->digits != 0 || *at != '0') number->digit_count++;
        if (number->digit_count <= 18) number->digits = number->digits * 10 + (uint64_t)(*at - '0');
        number->exponent += exponent_step;
    }
    return at;
}

static int read_exponent(const char *at, const char *end)
{
    if (at == end) return 0;
    at++;
    const bool negative = at < end && *at == '-';
    if (at < end && (*at == '-' || *at == '+')) at++;
    int exponent = 0;
    for (; at < end && exponent < 100000; at++) exponent = exponent * 10 + (*at - '0');
    return negative ? -exponent : exponent;
}

static nb_json_decimal read_decimal(const char *text, size_t size)
{
    nb_json_decimal number = {0};
    const char *at = text, *end = text + size;
    number.negative = at < end && *at == '-';
    if (number.negative) at++;
    at = read_digits(at, end, &number, 0);
    if (at < end && *at == '.') at = read_digits(at + 1, end, &number, -1);
    number.exponent += read_exponent(at, end);
    return number;
}

/* W. Clinger, How to read floating point numbers accurately (1990): up to 15 digits and a power of ten up to 22 are
 * doubles exactly, so that one multiplication or division rounds correctly. Needs arithmetic in double, not wider. */
static bool convert_exactly(const nb_json_decimal *number, double *value)
{
    static const double powers[] = {1e0,  1e1,  1e2,  1e3,  1e4,  1e5,  1e6,  1e7,  1e8,  1e9,  1e10, 1e11,
                                    1e12, 1e13, 1e14, 1e15, 1e16, 1e17, 1e18, 1e19, 1e20, 1e21, 1e22};
    if (FLT_EVAL_METHOD != 0 || number->digit_count > 15) return false;
    if (number->exponent < -22 || number->exponent > 22) return false;
    const double digits = (double)number->digits;
    const double size = number->exponent < 0 ? digits / powers[-number->exponent] : digits * powers[number->exponent];
    *value = number->negative ? -size : size;
    return true;
}

bool nb_number_parse(const char *text, size_t size, locale_t c_locale, double *value)
{
    if (size > NB_NUMBER_LENGTH) return false;
    const nb_json_decimal number = read_decimal(text, size);
    if (convert_exactly(&number, value)) return true;
    char copy[NB_NUMBER_LENGTH + 1];
    memcpy(copy, text, size);
    copy[size] = '\0';
    const locale_t before = uselocale(c_locale);
    *value = strtod(copy, NULL);
    uselocale(before);
    return true;
}
