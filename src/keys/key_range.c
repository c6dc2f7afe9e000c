#include "key_range.h"

#include "base/base.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define FACTORS "a factor from " NB_TEXT(NEBEL_MIN_SCALE) " to " NB_TEXT(NEBEL_MAX_SCALE) ", or the negative of one"

/* Digits, sign, point and exponent of any double, as texts of numbers have them. */
enum { NUMBER_TEXT = 40 };

/* Distances of frames stay finite, and far from each other in digits. */
#define MOST_FRAME 1e9

const nb_range nb_range_any = {.low = -HUGE_VAL, .high = HUGE_VAL, .text = "a number"};
const nb_range nb_range_positive = {.low = 0, .high = HUGE_VAL, .open = true, .text = "a number > 0"};
const nb_range nb_range_fraction = {.low = 0, .high = 1, .text = "a number from 0 to 1"};
const nb_range nb_range_light = {
    .low = 0, .high = NEBEL_MAX_AMOUNT, .text = "a number from 0 to " NB_TEXT(NEBEL_MAX_AMOUNT)};
const nb_range nb_range_factor = {.low = NEBEL_MIN_SCALE, .high = NEBEL_MAX_SCALE, .mirrored = true, .text = FACTORS};
const nb_range nb_range_place = {
    .low = -NEBEL_MAX_LENGTH, .high = NEBEL_MAX_LENGTH, .dimension = NB_LENGTH, .text = "a coordinate"};
const nb_range nb_range_extent = {
    .low = NEBEL_MIN_LENGTH, .high = NEBEL_MAX_LENGTH, .dimension = NB_LENGTH, .text = "a length"};
const nb_range nb_range_end = {
    .low = NEBEL_MIN_LENGTH, .high = NEBEL_MAX_LENGTH, .or_zero = true, .dimension = NB_LENGTH, .text = "a length"};
const nb_range nb_range_distance = {.low = 0, .high = NEBEL_MAX_LENGTH, .dimension = NB_LENGTH, .text = "a distance"};
const nb_range nb_range_amount = {.low = 0, .high = NEBEL_MAX_AMOUNT, .dimension = NB_PER_LENGTH, .text = "an amount"};
const nb_range nb_range_density = {
    .low = 0, .high = NEBEL_MAX_AMOUNT, .open = true, .dimension = NB_PER_LENGTH, .text = "an amount"};
const nb_range nb_range_asymmetry = {
    .low = -NEBEL_MAX_G, .high = NEBEL_MAX_G, .text = "a number within -0.9999 and 0.9999"};
const nb_range nb_range_frame = {
    .low = -MOST_FRAME, .high = MOST_FRAME, .text = "a number from -" NB_TEXT(MOST_FRAME) " to " NB_TEXT(MOST_FRAME)};

bool nb_range_holds(const nb_range *range, double unit, double number)
{
    double value = number;
    if (range->dimension == NB_LENGTH) value *= unit;
    if (range->dimension == NB_PER_LENGTH) value /= unit;
    if (range->mirrored) value = fabs(value);
    if (range->or_zero && number == 0) return true;
    if (range->low >= 0 && !range->mirrored && number < 0) return false; /* also one that is 0 in metres */
    return range->open ? value > range->low && value < range->high : value >= range->low && value <= range->high;
}

/* As it is written by hand: 1e15, not 1e+15. */
static void write_digits(int digits, double number, char text[NUMBER_TEXT])
{
    snprintf(text, NUMBER_TEXT, "%.*g", digits, number);
    char *at = strchr(text, 'e');
    if (at == NULL) return;
    char *exponent = at + 1;
    if (*exponent == '-') at++;
    exponent += strspn(exponent, "+-0");
    memmove(at + 1, exponent, strlen(exponent) + 1);
}

/* And 1e9, not 1000000000. */
static void write_number(double number, char text[NUMBER_TEXT])
{
    int zeros = 0;
    for (double rest = number; zeros < 22 && rest != 0 && fmod(rest, 10) == 0; rest /= 10) zeros++;
    if (zeros >= 6)
        snprintf(text, NUMBER_TEXT, "%.15ge%d", number / pow(10, zeros), zeros);
    else
        write_digits(15, number, text);
}

/* A limit in the numbers of a file, which is in the range as it is written. `inwards` is a little more than 1 for the
 * low one, less for the high one. */
static void write_limit(const nb_range *range, double unit, double limit, double inwards, char text[NUMBER_TEXT])
{
    double number = limit;
    if (range->dimension == NB_LENGTH) number /= unit;
    if (range->dimension == NB_PER_LENGTH) number *= unit;
    write_number(number, text);
    if (range->open || nb_range_holds(range, unit, strtod(text, NULL))) return;
    write_digits(9, number * (limit < 0 ? 2 - inwards : inwards), text);
}

static void describe_limits(const nb_range *range, double unit, char text[96])
{
    char low[NUMBER_TEXT], high[NUMBER_TEXT];
    write_limit(range, unit, range->low, 1.000001, low);
    write_limit(range, unit, range->high, 0.999999, high);
    if (isinf(range->high))
        snprintf(text, 96, "of at least %s", low);
    else if (range->open)
        snprintf(text, 96, "> %s and < %s", low, high);
    else
        snprintf(text, 96, "from %s to %s", low, high);
}

const char *nb_range_describe(const nb_range *range, double unit, char text[NB_RANGE_TEXT])
{
    char limits[96], metres[64], size[NUMBER_TEXT];
    const bool per = range->dimension == NB_PER_LENGTH;
    if (range->dimension == NB_PURE) return range->text;
    describe_limits(range, unit, limits);
    write_number(unit, size);
    if (unit == 1)
        snprintf(metres, sizeof metres, per ? "per metre" : "m");
    else
        snprintf(metres, sizeof metres, per ? "per unit of %s m" : "units of %s m", size);
    snprintf(text, NB_RANGE_TEXT, "%s%s %s %s", range->or_zero ? "0 or " : "", range->text, limits, metres);
    return text;
}
