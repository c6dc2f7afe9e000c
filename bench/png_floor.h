/* libpng alone: what decoding and encoding the files of a photograph costs. */
#ifndef NB_BENCH_PNG_FLOOR_H
#define NB_BENCH_PNG_FLOOR_H

#include <stddef.h>
#include <stdint.h>

typedef struct nb_png_picture {
    uint32_t width, height;
    size_t row_size;
    unsigned char *rows; /* free() */
} nb_png_picture;

/* Decodes a file of 8 or 16 bits. Returns 0, or -1. */
int nb_png_floor_decode(const char *path, nb_png_picture *picture);

/* Encodes RGB of 8 bits as nebel does: filter Sub, level 3. Returns 0, or -1. */
int nb_png_floor_encode(const char *path, const nb_png_picture *picture);

#endif
