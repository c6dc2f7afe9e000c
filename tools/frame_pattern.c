#include "frame_pattern.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { WIDEST = 20 };

static int is_digit(char c)
{
    return c >= '0' && c <= '9';
}

/* The characters of the conversion at `at`, which points to a '%': %%, %d or %0Nd; 0: another one. */
static size_t conversion_size(const char *at, int *width)
{
    *width = 0;
    if (at[1] == '%' || at[1] == 'd') return 2;
    if (at[1] != '0') return 0;
    size_t size = 2;
    for (; is_digit(at[size]) && size < 4; size++) *width = *width * 10 + (at[size] - '0');
    const int good = at[size] == 'd' && *width >= 1 && *width <= WIDEST;
    return good ? size + 1 : 0;
}

const char *nb_pattern_find_fault(const char *pattern)
{
    int numbers = 0;
    for (const char *at = strchr(pattern, '%'); at != NULL; at = strchr(at, '%')) {
        int width;
        const size_t size = conversion_size(at, &width);
        if (size == 0) return "has a % that is not %d, %0Nd (such as %04d) or %%";
        numbers += at[1] != '%';
        at += size;
    }
    if (numbers == 0) return "has no place for the frame number; write %04d where it belongs";
    return numbers > 1 ? "has more than one place for the frame number; leave one %04d" : NULL;
}

char *nb_pattern_expand(const char *pattern, uint32_t frame)
{
    char *const name = malloc(strlen(pattern) + WIDEST + 1);
    if (name == NULL) return NULL;
    size_t size = 0;
    while (*pattern != '\0') {
        int width;
        if (*pattern != '%') {
            name[size++] = *pattern++;
            continue;
        }
        if (pattern[1] == '%') name[size++] = '%';
        const size_t read = conversion_size(pattern, &width);
        if (pattern[1] != '%') {
            size += (size_t)snprintf(name + size, WIDEST + 1, "%0*lu", width > 0 ? width : 1, (unsigned long)frame);
        }
        pattern += read;
    }
    name[size] = '\0';
    return name;
}
