/* As much of cmocka's face as the core's tests use, for processors and systems that Debian has no cmocka for. A failed
 * assertion ends its test and the program goes on with the next, as there. */
#ifndef NB_TESTS_CROSS_CMOCKA_H
#define NB_TESTS_CROSS_CMOCKA_H

#include <math.h>
#include <setjmp.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>

struct CMUnitTest {
    const char *name;
    void (*run)(void **state);
};

typedef int (*CMFixtureFunction)(void **state);

static jmp_buf cross_end_of_test;

static inline void cross_require(int holds, const char *what, const char *file, int line)
{
    if (holds) return;
    printf("%s:%d: %s\n", file, line, what);
    longjmp(cross_end_of_test, 1);
}

static inline void cross_skip(void)
{
    longjmp(cross_end_of_test, 2);
}

static inline int cross_run_group(const struct CMUnitTest *tests, size_t count, CMFixtureFunction setup,
                                  CMFixtureFunction teardown)
{
    void *group = NULL;
    if (setup != NULL && setup(&group) != 0) {
        printf("FAILED  before the first test\n");
        return 1;
    }
    volatile int failed = 0;
    volatile size_t skipped = 0;
    for (volatile size_t i = 0; i < count; i++) {
        void *state = NULL;
        const int end = setjmp(cross_end_of_test);
        if (end == 0) tests[i].run(&state);
        if (end == 1) failed++;
        if (end == 2) skipped++;
        printf("%s %s\n", end == 0 ? "passed " : end == 1 ? "FAILED " : "skipped", tests[i].name);
    }
    if (teardown != NULL && teardown(&group) != 0) failed++;
    printf("%zu tests, %d failed, %zu skipped\n", count, failed, skipped);
    return failed;
}

/* As cmocka compares: a NaN is near nothing. */
static inline int cross_is_near(float a, float b, float epsilon)
{
    return fabsf(a - b) <= epsilon;
}

#define CROSS_REQUIRE(condition, what) cross_require((condition) ? 1 : 0, what, __FILE__, __LINE__)

#define cmocka_unit_test(function)                                                                                     \
    {                                                                                                                  \
#function, function                                                                                            \
    }
#define cmocka_run_group_tests(tests, setup, teardown)                                                                 \
    cross_run_group(tests, sizeof tests / sizeof tests[0], setup, teardown)
#define skip() cross_skip()
#define print_message(...) printf(__VA_ARGS__)
#define print_error(...) printf(__VA_ARGS__)
#define fail() CROSS_REQUIRE(0, "fail()")
#define fail_msg(...) (printf(__VA_ARGS__), CROSS_REQUIRE(0, "fail_msg()"))
#define assert_true(c) CROSS_REQUIRE(c, #c)
#define assert_false(c) CROSS_REQUIRE(!(c), "not " #c)
#define assert_non_null(p) CROSS_REQUIRE((p) != NULL, #p " is not NULL")
#define assert_null(p) CROSS_REQUIRE((p) == NULL, #p " is NULL")
#define assert_int_equal(a, b) CROSS_REQUIRE((a) == (b), #a " == " #b)
#define assert_int_not_equal(a, b) CROSS_REQUIRE((a) != (b), #a " != " #b)
#define assert_ptr_equal(a, b) CROSS_REQUIRE((a) == (b), #a " == " #b)
#define assert_in_range(a, low, high) CROSS_REQUIRE((a) >= (low) && (a) <= (high), #a " in " #low " to " #high)
#define assert_string_equal(a, b) CROSS_REQUIRE(strcmp(a, b) == 0, #a " == " #b)
#define assert_string_not_equal(a, b) CROSS_REQUIRE(strcmp(a, b) != 0, #a " is not " #b)
#define assert_memory_equal(a, b, size) CROSS_REQUIRE(memcmp(a, b, size) == 0, #a " equals " #b)
#define assert_memory_not_equal(a, b, size) CROSS_REQUIRE(memcmp(a, b, size) != 0, #a " differs from " #b)
#define assert_float_equal(a, b, epsilon)                                                                              \
    CROSS_REQUIRE(cross_is_near((float)(a), (float)(b), (float)(epsilon)), #a " is near " #b)

#endif
