/* PNG out: floats as 8 bit, and numbers as they are stored. */
#include "scene/rounding.h"

#include <png.h>
#include <stdio.h>

typedef struct encoder {
    const nb_codec *codec;
    const nebel_image *image; /* NULL: what is stored */
    nb_stored stored;         /* of an image its size and kind */
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
static void set_header(const encoder *out)
{
    static const int types[] = {PNG_COLOR_TYPE_GRAY, PNG_COLOR_TYPE_GRAY_ALPHA, PNG_COLOR_TYPE_RGB,
                                PNG_COLOR_TYPE_RGBA};
    const nb_stored *stored = &out->stored;
    png_set_IHDR(out->png, out->info, stored->width, stored->height, stored->bits, types[stored->channel_count - 1],
                 PNG_INTERLACE_NONE, PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
    if (stored->channel_count >= 3)
        png_set_sRGB_gAMA_and_cHRM(out->png, out->info, PNG_sRGB_INTENT_PERCEPTUAL);
    else
        png_set_gAMA(out->png, out->info, 1);
    png_set_filter(out->png, PNG_FILTER_TYPE_BASE, PNG_FILTER_SUB);
    png_set_compression_level(out->png, 3);
}

static const unsigned char *row_of(const encoder *out, uint32_t y)
{
    const nb_stored *stored = &out->stored;
    if (out->image == NULL)
        return stored->pixels + y * ((size_t)stored->width * (size_t)stored->channel_count * (size_t)stored->bits / 8);
    nb_rounding_fill_row(out->image, out->channels, y, out->row);
    return out->row;
}

static void run(encoder *out)
{
    if (setjmp(png_jmpbuf(out->png)) != 0) return;
    png_set_user_limits(out->png, PNG_UINT_31_MAX, PNG_UINT_31_MAX);
    png_set_write_fn(out->png, out, on_write, on_flush);
    set_header(out);
    png_write_info(out->png, out->info);
    if (out->stored.bits == 16 && nb_codec_is_little_endian()) png_set_swap(out->png);
    for (uint32_t y = 0; y < out->stored.height; y++) png_write_row(out->png, row_of(out, y));
    png_write_end(out->png, out->info);
}

static nebel_result encode(encoder *out)
{
    out->png =
        png_create_write_struct_2(PNG_LIBPNG_VER_STRING, out, on_error, on_warning, out, on_allocate, on_release);
    out->info = out->png != NULL ? png_create_info_struct(out->png) : NULL;
    if (out->info != NULL) {
        out->message[0] = '\0';
        run(out);
    }
    png_destroy_write_struct(&out->png, &out->info);
    if (out->message[0] == '\0') return NEBEL_OK;
    return nb_fail(&out->codec->log, NEBEL_ERROR_MEMORY, "%s: the PNG picture cannot be made: %s", out->codec->name,
                   out->message);
}

nebel_result nb_png_write_stored(const nb_codec *codec, const nb_stored *stored, nb_bytes *bytes)
{
    encoder out = {.codec = codec, .stored = *stored, .bytes = bytes, .message = "out of memory"};
    return encode(&out);
}

nebel_result nb_png_write_image(const nb_codec *codec, const nebel_image *image, nb_bytes *bytes)
{
    encoder out = {.codec = codec,
                   .image = image,
                   .stored = {image->width, image->height, 8, 3, NULL},
                   .bytes = bytes,
                   .message = "out of memory"};
    nebel_result result = nb_rounding_find_channels(codec, image, "a PNG", out.channels);
    if (result != NEBEL_OK) return result;
    out.row = nb_allocate(&codec->allocator, image->width, 3);
    if (out.row == NULL)
        return nb_fail(&codec->log, NEBEL_ERROR_MEMORY, "%s: the PNG picture cannot be made: out of memory",
                       codec->name);
    result = encode(&out);
    nb_release(&codec->allocator, out.row);
    return result;
}
