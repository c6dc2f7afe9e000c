/* The elementary functions in GLSL 3.30 and GLSL ES 3.00 against the scalar C build. */
#include "elementary_level.h"
#include "gl_harness.h"
#include "unit.h"

#include <float.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

enum { COUNT = 1 << 14, VECTORS = (NB_ELEMENTARY_COUNT + 3) / 4 };

static const char *const function_names[] = {
#define NAME(name, expression) #name,
    NB_ELEMENTARY_FUNCTIONS(NAME)
#undef NAME
};

/* Function i goes to component i % 4 of vector i / 4. */
static const char *const expressions[] = {
#define TEXT(name, expression) #expression,
    NB_ELEMENTARY_FUNCTIONS(TEXT)
#undef TEXT
};

static float numbers[2][COUNT], items[COUNT][4], results[COUNT][VECTORS][4];

static uint32_t random_bits(void)
{
    static uint64_t state = 88172645463325252;
    state ^= state << 13;
    state ^= state >> 7;
    state ^= state << 17;
    return (uint32_t)(state >> 32);
}

/* Sizes from 1e-9 to 200, both signs: every branch of every function, no infinities and nothing a GPU flushes to 0. */
static float random_number(void)
{
    const double size = exp(-20.7 + 26 * random_bits() * 0x1p-32);
    return (float)(random_bits() & 1 ? size : -size);
}

static void fill_numbers(void)
{
    for (int i = 0; i < COUNT; ++i) {
        items[i][0] = numbers[0][i] = random_number();
        items[i][1] = numbers[1][i] = i % 4 ? random_number() : numbers[0][i] * (1 + random_number() * 1e-3f);
    }
}

static void write_body(char *body, size_t size)
{
    size_t used = (size_t)snprintf(body, size, "float a = in0.x, b = in0.y;\n");
    for (int i = 0; i < 4 * VECTORS; ++i)
        used += (size_t)snprintf(body + used, size - used, "out%d.%c = %s;\n", i / 4, "xyzw"[i % 4],
                                 i < NB_ELEMENTARY_COUNT ? expressions[i] : "0.0");
    assert_true(used < size);
}

/* The size of the largest terms that an expression adds: rounding is relative to them. */
static double term_size(int function, double a, double b, double wanted)
{
    const double most = fmax(fmax(fabs(a), fabs(b)), 1);
    switch (function) {
    case NB_ELEMENTARY_length3:
        return most * most;
    case NB_ELEMENTARY_wide_length3:
        return most;
    case NB_ELEMENTARY_cross3:
    case NB_ELEMENTARY_select3:
    case NB_ELEMENTARY_wide_cross3:
        return most * most * most * most;
    default:
        return fabs(wanted);
    }
}

static void compare(int function, const char *language)
{
    static float wanted[COUNT];
    double worst = 0;
    int at = 0;
    nb_elementary_scalar_fast((nb_elementary)function, COUNT, numbers[0], numbers[1], wanted);
    for (int i = 0; i < COUNT; ++i) {
        const double c = (double)wanted[i], g = (double)results[i][function / 4][function % 4];
        const double size = term_size(function, (double)numbers[0][i], (double)numbers[1][i], c);
        const double error = fabs(g - c) <= (double)FLT_MIN ? 0 : fabs(g - c) / size;
        if (error > worst || error != error) {
            worst = error;
            at = i;
        }
        if (error != error) break;
    }
    if (worst > 0 || worst != worst)
        print_message("%s %s: %.1e at (%.9g, %.9g)\n", language, function_names[function], worst,
                      (double)numbers[0][at], (double)numbers[1][at]);
    assert_true(worst <= 1e-5);
}

static void check_language(nb_gl_language language, const char *name)
{
    static char body[1 << 14];
    char description[256];
    nb_gl gl;
    if (!nb_gl_open(&gl, language)) fail_msg("%s", gl.fault);
    nb_gl_describe(description, sizeof description);
    print_message("%s\n", description);
    write_body(body, sizeof body);
    fill_numbers();
    const unsigned program = nb_gl_compile(&gl, "", body, 1, VECTORS);
    if (!program || !nb_gl_evaluate(&gl, program, COUNT, &items[0][0], &results[0][0][0])) fail_msg("%s", gl.fault);
    for (int f = 0; f < NB_ELEMENTARY_COUNT; ++f) compare(f, name);
    nb_gl_close(&gl);
}

static void glsl_330_agrees_with_c(void **state)
{
    (void)state;
    check_language(NB_GL_330, "330");
}

static void glsl_es_300_agrees_with_c(void **state)
{
    (void)state;
    check_language(NB_GL_300ES, "300 es");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(glsl_330_agrees_with_c),
        cmocka_unit_test(glsl_es_300_agrees_with_c),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
