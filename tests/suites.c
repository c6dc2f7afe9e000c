/* The main function of a test program: runs the suite that its first argument names, with the arguments behind it.
 *
 *     nebel_test_core                            lists the suites
 *     nebel_test_core test_kernels 5000          runs one, with its own argument
 */
#include <stdio.h>
#include <string.h>

#define SUITE(name) int run_##name(void);
#define SUITE_WITH_ARGUMENTS(name) int run_##name(int argc, char **argv);
#include NB_SUITES
#undef SUITE
#undef SUITE_WITH_ARGUMENTS

typedef struct suite {
    const char *name;
    int (*run)(void);
    int (*run_with)(int argc, char **argv);
} suite;

#define SUITE(name) {#name, run_##name, NULL},
#define SUITE_WITH_ARGUMENTS(name) {#name, NULL, run_##name},
static const suite suites[] = {
#include NB_SUITES
};

int main(int argc, char **argv)
{
    const size_t count = sizeof suites / sizeof *suites;
    for (size_t i = 0; argc > 1 && i < count; i++) {
        if (strcmp(suites[i].name, argv[1]) != 0) continue;
        return suites[i].run ? suites[i].run() : suites[i].run_with(argc - 1, argv + 1);
    }
    fprintf(stderr, "usage: %s SUITE [ARGUMENT...]\nThe suites:\n", argv[0]);
    for (size_t i = 0; i < count; i++) fprintf(stderr, "    %s\n", suites[i].name);
    return 2;
}
