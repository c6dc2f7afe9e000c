/* The reader of rays: any bytes are rays or an error, the same however the input is cut into pieces. */
#include "decimal.h"
#include "ray_reader.h"
#include "shortest_decimal.h"

#include <math.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>

int LLVMFuzzerInitialize(int *count, char ***words);
int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

static void demand(int holds)
{
    if (!holds) abort();
}

int LLVMFuzzerInitialize(int *count, char ***words)
{
    (void)count, (void)words;
    nb_shortest_prepare();
    return 0;
}

/* Reads the input in pieces of `piece` bytes; returns whether it is good. */
static int read_in_pieces(nb_ray_list *rays, const char *text, size_t size, size_t piece)
{
    for (size_t at = 0; at < size; at += piece) {
        if (!nb_rays_feed(rays, text + at, size - at < piece ? size - at : piece)) return 0;
    }
    return nb_rays_finish(rays);
}

static void check_text_of(double number)
{
    char text[NB_SHORTEST_SIZE];
    double back;
    const size_t size = nb_shortest_write_double(number, text);
    demand(nb_decimal_read(text, size, &back) == NB_DECIMAL_GOOD && back == number);
    if (fabs(number) > 3e38) return;
    const size_t narrow_size = nb_shortest_write_float((float)number, text);
    demand(nb_decimal_read(text, narrow_size, &back) == NB_DECIMAL_GOOD && (float)back == (float)number);
}

static void check_entry(const nb_rays_entry *entry, size_t last_line)
{
    const nebel_ray *const ray = &entry->ray;
    int directed = 0;
    for (int i = 0; i < 3; i++) {
        demand(isfinite(ray->origin[i]) && isfinite(ray->direction[i]));
        directed |= ray->direction[i] != 0;
        check_text_of(ray->origin[i]);
        check_text_of(ray->direction[i]);
    }
    demand(directed && ray->t_max >= 0);
    demand(entry->line >= 1 && entry->line <= last_line);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    if (size == 0) return 0;
    const char *const text = (const char *)data + 1;
    const size_t piece = (size_t)data[0] + 1;
    nb_ray_list whole = {0}, pieces = {0};
    const int good = read_in_pieces(&whole, text, size - 1, SIZE_MAX / 2);
    demand(good == read_in_pieces(&pieces, text, size - 1, piece));
    demand(whole.count == pieces.count && whole.line == pieces.line);
    demand(strcmp(whole.problem, pieces.problem) == 0 && (whole.problem[0] == '\0') == (good != 0));
    for (size_t i = 0; i < whole.count; i++) {
        check_entry(&whole.entries[i], whole.line);
        demand(memcmp(&whole.entries[i], &pieces.entries[i], sizeof pieces.entries[i]) == 0);
    }
    nb_rays_free(&whole);
    nb_rays_free(&pieces);
    return 0;
}
