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

#endif
