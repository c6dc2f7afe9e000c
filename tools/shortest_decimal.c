/* The method is Raffaello Giulietti's Schubfach ("The Schubfach way to render doubles", 2021): of the decimals within
 * the interval that rounds to the number, at most one is a multiple of 10^(k+1) and at most four are multiples of 10^k
 * for the right k. Their bounds need the number times a power of ten, for which 128 bits of the power, rounded up, are
 * proven to be enough when the product is rounded to odd. */
#include "shortest_decimal.h"

#include <math.h>
#include <stdint.h>
#include <string.h>

/* 10^e for these e occurs for doubles; floats need fewer. */
enum { LOWEST_POWER = -292, HIGHEST_POWER = 324, POWERS = HIGHEST_POWER - LOWEST_POWER + 1 };

/* The 128 leading bits of a power of ten, rounded up. */
typedef struct nb_decimal_power {
    uint64_t high, low;
} nb_decimal_power;

static nb_decimal_power powers[POWERS];

/* ---- the table ------------------------------------------------------------------------------- */

/* A natural number of up to 1280 bits, least significant word first. */
enum { WORDS = 40 };

typedef struct big {
    uint32_t word[WORDS];
} big;

static void multiply_by_ten(big *number)
{
    uint64_t carry = 0;
    for (int i = 0; i < WORDS; i++) {
        const uint64_t product = (uint64_t)number->word[i] * 10 + carry;
        number->word[i] = (uint32_t)product;
        carry = product >> 32;
    }
}

/* Rounds down; what is lost is lost in every later division in the same way: floor(floor(x / 10) / 10) = floor(x /
 * 100). */
static void divide_by_ten(big *number)
{
    uint64_t rest = 0;
    for (int i = WORDS - 1; i >= 0; i--) {
        const uint64_t part = rest << 32 | number->word[i];
        number->word[i] = (uint32_t)(part / 10);
        rest = part % 10;
    }
}

static int highest_bit(const big *number)
{
    int bit = 32 * WORDS - 1;
    while (bit > 0 && (number->word[bit / 32] >> bit % 32 & 1) == 0) bit--;
    return bit;
}

/* Bits first .. first + 63, those below bit 0 being 0. */
static uint64_t bits_from(const big *number, int first)
{
    uint64_t bits = 0;
    for (int i = 63; i >= 0; i--) {
        const int bit = first + i;
        bits = bits << 1 | (bit < 0 ? 0 : number->word[bit / 32] >> bit % 32 & 1);
    }
    return bits;
}

static int is_zero_below(const big *number, int bit)
{
    for (int i = 0; i < bit; i++) {
        if (number->word[i / 32] >> i % 32 & 1) return 0;
    }
    return 1;
}

/* `exact`: the number is the power times a power of two, not its floor. */
static nb_decimal_power leading_bits(const big *number, int exact)
{
    const int top = highest_bit(number);
    nb_decimal_power leading = {bits_from(number, top - 63), bits_from(number, top - 127)};
    if (!exact || !is_zero_below(number, top - 127)) {
        leading.low++;
        leading.high += leading.low == 0;
    }
    return leading;
}

void nb_shortest_prepare(void)
{
    big number = {{1}};
    for (int e = 0; e <= HIGHEST_POWER; e++) {
        powers[e - LOWEST_POWER] = leading_bits(&number, 1);
        multiply_by_ten(&number);
    }
    /* 10^292 < 2^971, so that 2^1184 / 10^292 has more than 128 bits. */
    number = (big){{0}};
    number.word[37] = 1;
    for (int e = -1; e >= LOWEST_POWER; e--) {
        divide_by_ten(&number);
        powers[e - LOWEST_POWER] = leading_bits(&number, 0);
    }
}

/* ---- the digits ------------------------------------------------------------------------------ */

typedef struct nb_shortest_decimal {
    uint64_t digits;
    int exponent;
} nb_shortest_decimal;

/* fraction * 2^exponent; `narrow`: the number below is only half as far as the number above. */
typedef struct binary {
    uint64_t fraction;
    int exponent;
    int narrow;
} binary;

static uint64_t multiply_high(uint64_t a, uint64_t b)
{
    const uint64_t a0 = (uint32_t)a, a1 = a >> 32, b0 = (uint32_t)b, b1 = b >> 32;
    const uint64_t middle = a1 * b0 + (a0 * b0 >> 32);
    const uint64_t other = a0 * b1 + (uint32_t)middle;
    return a1 * b1 + (middle >> 32) + (other >> 32);
}

/* p * factor / 2^128, rounded to odd: the last bit says whether anything was cut off. */
static uint64_t multiply_to_odd(nb_decimal_power p, uint64_t factor)
{
    const uint64_t carry = multiply_high(p.low, factor);
    const uint64_t low = p.high * factor + carry;
    const uint64_t high = multiply_high(p.high, factor) + (low < carry);
    return high | (low > 1);
}

/* Arithmetic on floors: right for every exponent of a double. */
static int floor_divide_power(int value, int bits)
{
    return value >= 0 ? value >> bits : -(int)(((unsigned)-value + (1u << bits) - 1) >> bits);
}

static int floor_log2_of_power_of_ten(int e)
{
    return floor_divide_power(e * 1741647, 19);
}

/* floor(log10(2^exponent)), or of 3/4 of it. */
static int floor_log10(int exponent, int narrow)
{
    return floor_divide_power(exponent * 1262611 - (narrow ? 524031 : 0), 22);
}

static nb_shortest_decimal shortest(binary number)
{
    const uint64_t odd = number.fraction & 1;
    const int k = floor_log10(number.exponent, number.narrow);
    const int shift = number.exponent + floor_log2_of_power_of_ten(-k) + 1;
    const nb_decimal_power p = powers[-k - LOWEST_POWER];
    /* Four times the number and its bounds, in units of 10^k; the bounds themselves belong to even numbers only. */
    const uint64_t middle = 4 * number.fraction;
    const uint64_t lower = multiply_to_odd(p, (middle - 2 + (uint64_t)number.narrow) << shift) + odd;
    const uint64_t value = multiply_to_odd(p, middle << shift);
    const uint64_t upper = multiply_to_odd(p, (middle + 2) << shift) - odd;
    const uint64_t s = value / 4;
    if (s >= 10) {
        const uint64_t tens = s / 10;
        const int below = lower <= 40 * tens, above = 40 * tens + 40 <= upper;
        if (below != above) return (nb_shortest_decimal){tens + (uint64_t)above, k + 1};
    }
    const int below = lower <= 4 * s, above = 4 * s + 4 <= upper;
    if (below != above) return (nb_shortest_decimal){s + (uint64_t)above, k};
    const int nearer_above = value > 4 * s + 2 || (value == 4 * s + 2 && (s & 1) != 0);
    return (nb_shortest_decimal){s + (uint64_t)nearer_above, k};
}

/* ---- the text -------------------------------------------------------------------------------- */

static size_t copy_text(char *text, const char *word)
{
    const size_t size = strlen(word);
    memcpy(text, word, size);
    return size;
}

static size_t write_fixed(char *text, const char *digits, int count, int point)
{
    size_t size = 0;
    if (point <= 0) size += copy_text(text, "0.");
    for (int i = point; i < 0; i++) text[size++] = '0';
    for (int i = 0; i < count || i < point; i++) {
        if (i == point && i > 0) text[size++] = '.';
        text[size++] = i < count ? digits[i] : '0';
    }
    return size;
}

static size_t write_scientific(char *text, const char *digits, int count, int exponent)
{
    size_t size = 0;
    text[size++] = digits[0];
    if (count > 1) text[size++] = '.';
    for (int i = 1; i < count; i++) text[size++] = digits[i];
    text[size++] = 'e';
    text[size++] = exponent < 0 ? '-' : '+';
    const int magnitude = exponent < 0 ? -exponent : exponent;
    if (magnitude >= 100) text[size++] = (char)('0' + magnitude / 100);
    text[size++] = (char)('0' + magnitude / 10 % 10);
    text[size++] = (char)('0' + magnitude % 10);
    return size;
}

/* `precision`: the digits of %g from which on it turns to an exponent. */
static size_t write_decimal(char *text, nb_shortest_decimal number, int precision)
{
    char digits[20] = "0";
    int count = 0;
    while (number.digits % 10 == 0) {
        number.digits /= 10;
        number.exponent++;
    }
    for (uint64_t rest = number.digits; rest > 0; rest /= 10) count++;
    for (int i = count - 1; i >= 0; i--) {
        digits[i] = (char)('0' + number.digits % 10);
        number.digits /= 10;
    }
    const int point = count + number.exponent;
    if (point < -3 || point > precision) return write_scientific(text, digits, count, point - 1);
    return write_fixed(text, digits, count, point);
}

/* The parts of an IEEE number of `bits` stored bits of fraction and the given bias, sign apart; not 0. */
static binary take_apart(uint64_t pattern, int bits, int bias)
{
    const uint64_t one = UINT64_C(1) << bits;
    const uint64_t stored = pattern & (one - 1);
    const int exponent = (int)(pattern >> bits);
    if (exponent == 0) return (binary){stored, 1 - bias - bits, 0};
    return (binary){stored | one, exponent - bias - bits, stored == 0 && exponent > 1};
}

static size_t write_special(double number, char *text)
{
    if (isnan(number)) return copy_text(text, "nan");
    const size_t sign = signbit(number) ? copy_text(text, "-") : 0;
    return sign + copy_text(text + sign, isinf(number) ? "inf" : "0");
}

size_t nb_shortest_write_double(double number, char *text)
{
    if (!isfinite(number) || number == 0) return write_special(number, text);
    uint64_t pattern;
    memcpy(&pattern, &number, sizeof pattern);
    const size_t sign = number < 0 ? copy_text(text, "-") : 0;
    return sign + write_decimal(text + sign, shortest(take_apart(pattern & INT64_MAX, 52, 1023)), 17);
}

size_t nb_shortest_write_float(float number, char *text)
{
    if (!isfinite(number) || number == 0) return write_special((double)number, text);
    uint32_t pattern;
    memcpy(&pattern, &number, sizeof pattern);
    const size_t sign = number < 0 ? copy_text(text, "-") : 0;
    return sign + write_decimal(text + sign, shortest(take_apart(pattern & INT32_MAX, 23, 127)), 9);
}
