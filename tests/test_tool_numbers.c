/* Numbers of the command line: text to doubles and back. */
#include "decimal.h"
#include "shortest_decimal.h"
#include "unit.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static uint64_t state;

/* xorshift64*, seeded by each test. */
static uint64_t random_bits(void)
{
    state ^= state >> 12;
    state ^= state << 25;
    state ^= state >> 27;
    return state * UINT64_C(2685821657736338717);
}

static double double_of(uint64_t pattern)
{
    double number;
    memcpy(&number, &pattern, sizeof number);
    return number;
}

/* Any double: of all magnitudes, near powers of two, with few bits. */
static double random_double(void)
{
    uint64_t pattern = random_bits();
    switch (random_bits() % 4) {
    case 0:
        break;
    case 1:
        pattern = ((pattern >> 52) << 52) + random_bits() % 3 - 1;
        break;
    case 2:
        pattern &= ~UINT64_C(0) << random_bits() % 53;
        break;
    default:
        return (double)(pattern >> 11) * 0x1p-53;
    }
    return double_of(pattern);
}

static void write_double(double number, char *text)
{
    text[nb_shortest_write_double(number, text)] = '\0';
}

static void write_float(float number, char *text)
{
    text[nb_shortest_write_float(number, text)] = '\0';
}

/* The digits of a number, without zeros at either end; returns how many. */
static int copy_digits(const char *text, char *digits)
{
    int count = 0;
    for (; *text != '\0' && *text != 'e'; text++) {
        if (*text >= '0' && *text <= '9' && (count > 0 || *text != '0')) digits[count++] = *text;
    }
    while (count > 0 && digits[count - 1] == '0') count--;
    digits[count] = '\0';
    return count;
}

static void assert_round_trip(double number)
{
    char text[NB_SHORTEST_SIZE], other[64], digits[64], other_digits[64];
    write_double(number, text);
    assert_true(strtod(text, NULL) == number);
    const int count = copy_digits(text, digits);
    assert_in_range(count, 1, 17);
    if (count > 1) {
        (void)snprintf(other, sizeof other, "%.*e", count - 2, number);
        assert_false(strtod(other, NULL) == number);
    }
    /* Of the texts with as many digits, printf's is the nearest; where it reads back, it is the one. */
    (void)snprintf(other, sizeof other, "%.*e", count - 1, number);
    (void)copy_digits(other, other_digits);
    if (strtod(other, NULL) == number) assert_string_equal(digits, other_digits);
}

static void test_doubles_read_back_from_the_fewest_digits(void **context)
{
    (void)context;
    state = 20210;
    for (int i = 0; i < 200000; i++) {
        const double number = random_double();
        if (isfinite(number) && number != 0) assert_round_trip(number);
    }
}

static void test_powers_of_two_and_their_neighbors_read_back(void **context)
{
    (void)context;
    for (int exponent = -1074; exponent < 1024; exponent++) {
        const double power = ldexp(1, exponent);
        assert_round_trip(power);
        assert_round_trip(nextafter(power, (double)INFINITY));
        if (exponent > -1074) assert_round_trip(nextafter(power, 0));
    }
}

static void test_floats_read_back_from_at_most_nine_digits(void **context)
{
    (void)context;
    char text[NB_SHORTEST_SIZE], fewer[64], all[64];
    for (uint32_t pattern = 1; pattern < 0x7f800000; pattern += 12007) {
        float number;
        memcpy(&number, &pattern, sizeof number);
        write_float(number, text);
        assert_true(strtof(text, NULL) == number);
        const int digits = copy_digits(text, all);
        assert_in_range(digits, 1, 9);
        (void)snprintf(fewer, sizeof fewer, "%.*e", digits > 1 ? digits - 2 : 0, (double)number);
        if (digits > 1) assert_false(strtof(fewer, NULL) == number);
    }
}

static void test_texts_are_written_as_printf_writes_them(void **context)
{
    (void)context;
    static const struct {
        double number;
        const char *text;
    } cases[] = {
        {0, "0"},
        {1, "1"},
        {-1, "-1"},
        {0.1, "0.1"},
        {0.0001, "0.0001"},
        {1e-05, "1e-05"},
        {123456, "123456"},
        {1e16, "10000000000000000"},
        {1e17, "1e+17"},
        {1.5e300, "1.5e+300"},
        {5e-324, "5e-324"},
        {1.7976931348623157e308, "1.7976931348623157e+308"},
        {0.3, "0.3"},
        {2.0 / 3, "0.6666666666666666"},
        {9007199254740993.0, "9007199254740992"},
        {-2.5e-7, "-2.5e-07"},
    };
    char text[NB_SHORTEST_SIZE];
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        write_double(cases[i].number, text);
        assert_string_equal(text, cases[i].text);
    }
    write_double((double)INFINITY, text);
    assert_string_equal(text, "inf");
    write_double(-(double)INFINITY, text);
    assert_string_equal(text, "-inf");
    write_double((double)NAN, text);
    assert_string_equal(text, "nan");
    write_float(0.1F, text);
    assert_string_equal(text, "0.1");
    write_float(16777216.F, text);
    assert_string_equal(text, "16777216");
}

static void assert_reads_as(const char *text, double expected)
{
    double number = -77;
    assert_int_equal(nb_decimal_read(text, strlen(text), &number), NB_DECIMAL_GOOD);
    assert_true(number == expected);
    assert_int_equal(signbit(number) != 0, signbit(expected) != 0);
}

static void test_random_texts_are_read_as_strtod_reads_them(void **context)
{
    (void)context;
    state = 42;
    char text[64];
    for (int i = 0; i < 200000; i++) {
        const double number = random_double();
        if (!isfinite(number)) continue;
        const int digits = (int)(random_bits() % 25);
        const int fixed = fabs(number) < 1e20 && fabs(number) > 1e-6 && random_bits() % 2 == 0;
        (void)snprintf(text, sizeof text, fixed ? "%.*f" : "%.*e", digits, number);
        if (isfinite(strtod(text, NULL))) assert_reads_as(text, strtod(text, NULL));
    }
}

static void test_all_ways_to_write_a_number_are_read(void **context)
{
    (void)context;
    assert_reads_as("1", 1);
    assert_reads_as("+1.", 1);
    assert_reads_as("-.5", -0.5);
    assert_reads_as("2E3", 2000);
    assert_reads_as("2e+03", 2000);
    assert_reads_as("-0", -0.);
    assert_reads_as("1e-999", 0);
    assert_reads_as("0e999999999999", 0);
    assert_reads_as("4.9e-324", 5e-324);
    assert_reads_as("9007199254740993", 9007199254740992.);
    assert_reads_as("0.000000000000000000000000000000000000000000001e45", 1);
    assert_reads_as("inf", (double)INFINITY);
    assert_reads_as("-Infinity", -(double)INFINITY);
}

static void test_what_is_no_number_is_rejected(void **context)
{
    (void)context;
    static const char *const texts[] = {"",     " 1",   "1 ",    "nan",   "0x10", "1e",  "1e+",
                                        "e5",   ".",    "-",     "+-1",   "1,5",  "1_0", "1f",
                                        "infi", "1..2", "1.2.3", "1e5.5", "--1",  "in",  "NaN(5)"};
    double number = 5;
    for (size_t i = 0; i < sizeof texts / sizeof *texts; i++) {
        assert_int_equal(nb_decimal_read(texts[i], strlen(texts[i]), &number), NB_DECIMAL_MALFORMED);
    }
    assert_int_equal(nb_decimal_read("1\0002", 3, &number), NB_DECIMAL_MALFORMED);
    assert_int_equal(nb_decimal_read("1e309", 5, &number), NB_DECIMAL_TOO_LARGE);
    assert_int_equal(nb_decimal_read("-1e99999999999999", 17, &number), NB_DECIMAL_TOO_LARGE);
    assert_true(number == 5);
}

static void test_whole_numbers_end_at_32_bits(void **context)
{
    (void)context;
    uint32_t number = 5;
    assert_int_equal(nb_decimal_read_whole("4294967296", 10, &number), NB_DECIMAL_TOO_LARGE);
    assert_int_equal(nb_decimal_read_whole("99999999999999999999999", 23, &number), NB_DECIMAL_TOO_LARGE);
    assert_int_equal(nb_decimal_read_whole("", 0, &number), NB_DECIMAL_MALFORMED);
    assert_int_equal(nb_decimal_read_whole("-1", 2, &number), NB_DECIMAL_MALFORMED);
    assert_int_equal(nb_decimal_read_whole("1.0", 3, &number), NB_DECIMAL_MALFORMED);
    assert_int_equal(number, 5);
    assert_int_equal(nb_decimal_read_whole("4294967295", 10, &number), NB_DECIMAL_GOOD);
    assert_true(number == UINT32_MAX);
    assert_int_equal(nb_decimal_read_whole("007", 3, &number), NB_DECIMAL_GOOD);
    assert_int_equal(number, 7);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_doubles_read_back_from_the_fewest_digits),
        cmocka_unit_test(test_powers_of_two_and_their_neighbors_read_back),
        cmocka_unit_test(test_floats_read_back_from_at_most_nine_digits),
        cmocka_unit_test(test_texts_are_written_as_printf_writes_them),
        cmocka_unit_test(test_random_texts_are_read_as_strtod_reads_them),
        cmocka_unit_test(test_all_ways_to_write_a_number_are_read),
        cmocka_unit_test(test_what_is_no_number_is_rejected),
        cmocka_unit_test(test_whole_numbers_end_at_32_bits),
    };
    nb_shortest_prepare();
    return cmocka_run_group_tests(tests, NULL, NULL);
}
