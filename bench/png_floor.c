#include "png_floor.h"

#include <png.h>
#include <stdio.h>
#include <stdlib.h>

static int decode_open(FILE *file, nb_png_picture *picture)
{
    png_structp png = png_create_read_struct(PNG_LIBPNG_VER_STRING, NULL, NULL, NULL);
    png_infop info = png != NULL ? png_create_info_struct(png) : NULL;
    if (info == NULL || setjmp(png_jmpbuf(png)) != 0) {
        png_destroy_read_struct(&png, &info, NULL);
        return -1;
    }
    png_init_io(png, file);
    png_read_info(png, info);
    picture->width = png_get_image_width(png, info);
    picture->height = png_get_image_height(png, info);
    picture->row_size = png_get_rowbytes(png, info);
    picture->rows = malloc(picture->row_size * picture->height);
    if (picture->rows == NULL) png_error(png, "out of memory");
    for (uint32_t y = 0; y < picture->height; y++) png_read_row(png, picture->rows + y * picture->row_size, NULL);
    png_read_end(png, NULL);
    png_destroy_read_struct(&png, &info, NULL);
    return 0;
}

static int encode_open(FILE *file, const nb_png_picture *picture)
{
    png_structp png = png_create_write_struct(PNG_LIBPNG_VER_STRING, NULL, NULL, NULL);
    png_infop info = png != NULL ? png_create_info_struct(png) : NULL;
    if (info == NULL || setjmp(png_jmpbuf(png)) != 0) {
        png_destroy_write_struct(&png, &info);
        return -1;
    }
    png_init_io(png, file);
    png_set_IHDR(png, info, picture->width, picture->height, 8, PNG_COLOR_TYPE_RGB, PNG_INTERLACE_NONE,
                 PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
    png_set_filter(png, PNG_FILTER_TYPE_BASE, PNG_FILTER_SUB);
    png_set_compression_level(png, 3);
    png_write_info(png, info);
    for (uint32_t y = 0; y < picture->height; y++) png_write_row(png, picture->rows + y * picture->row_size);
    png_write_end(png, info);
    png_destroy_write_struct(&png, &info);
    return 0;
}

int nb_png_floor_decode(const char *path, nb_png_picture *picture)
{
    FILE *const file = fopen(path, "rb");
    *picture = (nb_png_picture){0};
    if (file == NULL) return -1;
    const int status = decode_open(file, picture);
    (void)fclose(file);
    if (status != 0) free(picture->rows);
    return status;
}

int nb_png_floor_encode(const char *path, const nb_png_picture *picture)
{
    FILE *const file = fopen(path, "wb");
    if (file == NULL) return -1;
    const int status = encode_open(file, picture);
    return fclose(file) == 0 ? status : -1;
}
