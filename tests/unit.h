/* cmocka, behind what it needs to be included before it, and how much a suite tries. */
#ifndef UNIT_H
#define UNIT_H

#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>

#include <cmocka.h>

/* `full` times the environment variable NEBEL_TEST_SCALE, which is 1 where it is unset; at least 1. `make test` sets it below 1
 * for a first opinion in minutes. */
static inline size_t nb_test_count(size_t full)
{
    const char *const scale = getenv("NEBEL_TEST_SCALE");
    const double scaled = scale ? strtod(scale, NULL) * (double)full : (double)full;
    return scaled > 1 ? (size_t)scaled : 1;
}

/* Whether row `row` of `all`, from 0, is one of nb_test_count(all) that lie evenly among them. */
static inline int nb_test_tries(size_t row, size_t all)
{
    const size_t count = nb_test_count(all);
    return row * count / all != (row + 1) * count / all;
}

#endif
