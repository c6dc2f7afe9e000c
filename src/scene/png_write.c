/* PNG out: 8 bit. */
#include "scene/rounding.h"

#include <png.h>
#include <stdio.h>

typedef struct encoder {
    const nb_codec *codec;
    const nebel_image *image;
    nb_bytes *bytes;
    png_structp png;
    png_infop info;
    int channels[3];
    unsigned char *row;
    char message[200];
} encoder;

/* ---- libpng's callbacks ---------------------------------------------------------------------- */

static void on_error(png_structp png, png_const_charp message)
{
    encoder *out = png_get_error_ptr(png);
    snprintf(out->message, sizeof out->message, "%s", message);
    png_longjmp(png, 1);
}

static void on_warning(png_structp png, png_const_charp message)
{
    (void)png;
    (void)message;
}

static png_voidp on_allocate(png_structp png, png_alloc_size_t size)
{
    const encoder *out = png_get_mem_ptr(png);
    return nb_allocate(&out->codec->allocator, size, 1);
}

static void on_release(png_structp png, png_voidp memory)
{
    const encoder *out = png_get_mem_ptr(png);
    nb_release(&out->codec->allocator, memory);
}

static void on_write(png_structp png, png_bytep data, size_t size)
{
    const encoder *out = png_get_io_ptr(png);
    if (!nb_bytes_write(&out->codec->allocator, out->bytes, out->bytes->size, data, size))
        png_error(png, "out of memory");
}

static void on_flush(png_structp png)
{
    (void)png;
}

/* ---- encoding -------------------------------------------------------------------------------- */

/* One filter and a low level: against libpng's defaults 8 % more bytes in less than half the time. */
static void run(encoder *out)
{
    if (setjmp(png_jmpbuf(out->png)) != 0) return;
    png_set_user_limits(out->png, PNG_UINT_31_MAX, PNG_UINT_31_MAX);
    png_set_write_fn(out->png, out, on_write, on_flush);
    png_set_IHDR(out->png, out->info, out->image->width, out->image->height, 8, PNG_COLOR_TYPE_RGB, PNG_INTERLACE_NONE,
                 PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
    png_set_sRGB_gAMA_and_cHRM(out->png, out->info, PNG_sRGB_INTENT_PERCEPTUAL);
    png_set_filter(out->png, PNG_FILTER_TYPE_BASE, PNG_FILTER_SUB);
    png_set_compression_level(out->png, 3);
    png_write_info(out->png, out->info);
    for (uint32_t y = 0; y < out->image->height; y++) {
        nb_rounding_fill_row(out->image, out->channels, y, out->row);
        png_write_row(out->png, out->row);
    }
    png_write_end(out->png, out->info);
}

nebel_result nb_png_write_image(const nb_codec *codec, const nebel_image *image, nb_bytes *bytes)
{
    encoder out = {.codec = codec, .image = image, .bytes = bytes, .message = "out of memory"};
    const nebel_result result = nb_rounding_find_channels(codec, image, "a PNG", out.channels);
    if (result != NEBEL_OK) return result;
    out.row = nb_allocate(&codec->allocator, image->width, 3);
    if (out.row != NULL)
        out.png =
            png_create_write_struct_2(PNG_LIBPNG_VER_STRING, &out, on_error, on_warning, &out, on_allocate, on_release);
    out.info = out.png != NULL ? png_create_info_struct(out.png) : NULL;
    if (out.info != NULL) {
        out.message[0] = '\0';
        run(&out);
    }
    png_destroy_write_struct(&out.png, &out.info);
    nb_release(&codec->allocator, out.row);
    if (out.message[0] == '\0') return NEBEL_OK;
    return nb_fail(&codec->log, NEBEL_ERROR_MEMORY, "%s: the PNG picture cannot be made: %s", codec->name, out.message);
}
