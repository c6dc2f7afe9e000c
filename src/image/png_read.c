/* PNG in. libpng leaves on an error by longjmp, so all that must be released lives in `decoder`, outside the jump. */
#include "image_codec.h"

#include <png.h>
#include <stdio.h>
#include <string.h>

typedef enum nb_png_target {
    TARGET_IMAGE,
    TARGET_TEXTURE,
    TARGET_HEIGHTS,
    TARGET_STORED,
    TARGET_STORED_COLOR
} nb_png_target;

typedef struct nb_png_decoder {
    const nb_codec *codec;
    const nb_bytes *bytes;
    size_t at;
    nb_png_target target;
    png_structp png;
    png_infop info;
    png_uint_32 width, height;
    int bits, channel_count;
    size_t row_size;
    const char *what; /* heights */
    unsigned char *pixels;
    bool out_of_memory; /* libpng was refused some: then that is why it fails */
    nebel_result result;
    char message[200];
} nb_png_decoder;

bool nb_png_is(const nb_bytes *bytes)
{
    return bytes->size >= 8 && memcmp(bytes->data, "\x89PNG\r\n\x1a\n", 8) == 0;
}

/* ---- libpng's callbacks ---------------------------------------------------------------------- */

static void on_png_read_error(png_structp png, png_const_charp message)
{
    nb_png_decoder *in = png_get_error_ptr(png);
    if (in->result == NEBEL_OK) in->result = in->out_of_memory ? NEBEL_ERROR_MEMORY : NEBEL_ERROR_FORMAT;
    snprintf(in->message, sizeof in->message, "%s", message);
    png_longjmp(png, 1);
}

static void on_png_read_warning(png_structp png, png_const_charp message)
{
    (void)png;
    (void)message;
}

static png_voidp on_png_read_allocate(png_structp png, png_alloc_size_t size)
{
    nb_png_decoder *in = png_get_mem_ptr(png);
    void *memory = nb_allocate(&in->codec->allocator, size, 1);
    if (memory == NULL) in->out_of_memory = true;
    return memory;
}

static void on_png_read_release(png_structp png, png_voidp memory)
{
    const nb_png_decoder *in = png_get_mem_ptr(png);
    nb_release(&in->codec->allocator, memory);
}

static void on_png_read(png_structp png, png_bytep target_bytes, size_t size)
{
    nb_png_decoder *in = png_get_io_ptr(png);
    if (size > in->bytes->size - in->at) png_error(png, "the file ends too early");
    memcpy(target_bytes, in->bytes->data + in->at, size);
    in->at += size;
}

/* ---- decoding -------------------------------------------------------------------------------- */

static void stop(nb_png_decoder *in, nebel_result result, const char *message)
{
    in->result = result;
    png_error(in->png, message);
}

/* Of bits that are no samples of a photograph nor of depth. */
static void choose_stored(nb_png_decoder *in, int type)
{
    const int bits = png_get_bit_depth(in->png, in->info);
    if (bits == 1 || (bits < 8 && type != PNG_COLOR_TYPE_PALETTE))
        stop(in, NEBEL_ERROR_UNSUPPORTED, "it has less than 8 bits a sample; convert it to 8 or 16");
    if (nb_codec_is_little_endian()) png_set_swap(in->png);
    if (in->target == TARGET_STORED_COLOR) png_set_gray_to_rgb(in->png);
}

static void choose_transforms(nb_png_decoder *in)
{
    const int type = png_get_color_type(in->png, in->info);
    if (in->target == TARGET_HEIGHTS && type != PNG_COLOR_TYPE_GRAY) {
        char message[100];
        snprintf(message, sizeof message, "%s must be grey, 8 or 16 bit, without alpha; convert it", in->what);
        stop(in, NEBEL_ERROR_FORMAT, message);
    }
    if (in->target == TARGET_STORED || in->target == TARGET_STORED_COLOR) choose_stored(in, type);
    png_set_expand(in->png);
    if (in->target != TARGET_TEXTURE) return;
    png_set_scale_16(in->png);
    png_set_gray_to_rgb(in->png);
    png_set_add_alpha(in->png, 0xFF, PNG_FILLER_AFTER);
}

static void read_header(nb_png_decoder *in)
{
    png_read_info(in->png, in->info);
    in->width = png_get_image_width(in->png, in->info);
    in->height = png_get_image_height(in->png, in->info);
    in->result = nb_codec_check_size(in->codec, in->width, in->height, 4);
    if (in->result != NEBEL_OK) png_longjmp(in->png, 1);
    choose_transforms(in);
}

/* Of what is made of the pixels, and of them where both are there at once. */
static uint64_t kept_row_size(const nb_png_decoder *in)
{
    const uint64_t read = in->row_size, width = in->width;
    if (in->target != TARGET_IMAGE && in->target != TARGET_HEIGHTS) return read;
    return in->target == TARGET_HEIGHTS ? read + width * sizeof(uint16_t)
                                        : read + width * (unsigned)in->channel_count * sizeof(float);
}

static void read_pixels(nb_png_decoder *in)
{
    const int passes = png_set_interlace_handling(in->png);
    png_read_update_info(in->png, in->info);
    in->row_size = png_get_rowbytes(in->png, in->info);
    in->bits = png_get_bit_depth(in->png, in->info);
    in->channel_count = png_get_channels(in->png, in->info);
    in->result = nb_codec_check_room(in->codec, in->height * kept_row_size(in));
    if (in->result != NEBEL_OK) png_longjmp(in->png, 1);
    in->pixels = nb_allocate(&in->codec->allocator, in->height, in->row_size);
    if (in->pixels == NULL) stop(in, NEBEL_ERROR_MEMORY, "out of memory");
    for (int pass = 0; pass < passes; pass++)
        for (png_uint_32 y = 0; y < in->height; y++) png_read_row(in->png, in->pixels + y * in->row_size, NULL);
    png_read_end(in->png, NULL);
}

static void run_png_decoder(nb_png_decoder *in)
{
    if (setjmp(png_jmpbuf(in->png)) != 0) return;
    png_set_user_limits(in->png, PNG_UINT_31_MAX, PNG_UINT_31_MAX);
    png_set_read_fn(in->png, in, on_png_read);
    read_header(in);
    read_pixels(in);
}

/* The pixels in in->pixels, to be released by the caller. */
static nebel_result decode_png(nb_png_decoder *in)
{
    in->png = png_create_read_struct_2(PNG_LIBPNG_VER_STRING, in, on_png_read_error, on_png_read_warning, in,
                                       on_png_read_allocate, on_png_read_release);
    in->info = in->png != NULL ? png_create_info_struct(in->png) : NULL;
    if (in->info != NULL)
        run_png_decoder(in);
    else
        in->result = NEBEL_ERROR_MEMORY;
    png_destroy_read_struct(&in->png, &in->info, NULL);
    if (in->result == NEBEL_OK) return NEBEL_OK;
    nb_release(&in->codec->allocator, in->pixels);
    in->pixels = NULL;
    if (in->result == NEBEL_ERROR_LIMIT) return in->result;
    const char *message = in->message[0] != '\0' ? in->message : "out of memory";
    if (in->result == NEBEL_ERROR_UNSUPPORTED)
        return nb_fail(&in->codec->log, in->result, "%s: %s", in->codec->name, message);
    return nb_fail(&in->codec->log, in->result, "%s: not a good PNG picture: %s", in->codec->name, message);
}

/* ---- what becomes of the pixels -------------------------------------------------------------- */

/* PNG stores the high byte first. */
static uint16_t read_16(const unsigned char *at)
{
    return (uint16_t)(at[0] << 8 | at[1]);
}

static void convert_row(const nb_png_decoder *in, const unsigned char *row, float *samples)
{
    const size_t count = (size_t)in->width * (size_t)in->channel_count;
    for (size_t i = 0; i < count; i++)
        samples[i] = in->bits == 16 ? (float)read_16(row + 2 * i) / 65535.0f : (float)row[i] / 255.0f;
}

nebel_result nb_png_read_image(const nb_codec *codec, const nb_bytes *bytes, nebel_image *image)
{
    static const char *const names[4][4] = {{"Y"}, {"Y", "A"}, {"R", "G", "B"}, {"R", "G", "B", "A"}};
    nb_png_decoder in = {.codec = codec, .bytes = bytes, .target = TARGET_IMAGE};
    *image = (nebel_image){0};
    nebel_result result = decode_png(&in);
    if (result != NEBEL_OK) return result;
    const size_t channel_count = (size_t)in.channel_count;
    result = nb_image_allocate(codec, in.width, in.height, channel_count, names[channel_count - 1], image);
    for (size_t y = 0; result == NEBEL_OK && y < in.height; y++)
        convert_row(&in, in.pixels + y * in.row_size, image->samples + y * in.width * channel_count);
    nb_release(&codec->allocator, in.pixels);
    return result;
}

nebel_result nb_png_read_texture(const nb_codec *codec, const nb_bytes *bytes, nebel_texture *texture)
{
    nb_png_decoder in = {.codec = codec, .bytes = bytes, .target = TARGET_TEXTURE};
    *texture = (nebel_texture){0};
    const nebel_result result = decode_png(&in);
    if (result == NEBEL_OK) *texture = (nebel_texture){in.width, in.height, in.pixels};
    return result;
}

nebel_result nb_png_read_stored(const nb_codec *codec, const nb_bytes *bytes, bool as_color, nb_stored *stored)
{
    nb_png_decoder in = {.codec = codec, .bytes = bytes, .target = as_color ? TARGET_STORED_COLOR : TARGET_STORED};
    *stored = (nb_stored){0};
    const nebel_result result = decode_png(&in);
    if (result == NEBEL_OK) *stored = (nb_stored){in.width, in.height, in.bits, in.channel_count, in.pixels};
    return result;
}

nebel_result nb_png_read_heights(const nb_codec *codec, const nb_bytes *bytes, const char *what, nb_heights *heights)
{
    nb_png_decoder in = {.codec = codec, .bytes = bytes, .target = TARGET_HEIGHTS, .what = what};
    *heights = (nb_heights){0};
    const nebel_result result = decode_png(&in);
    if (result != NEBEL_OK) return result;
    const size_t count = (size_t)in.width * in.height;
    uint16_t *values = nb_allocate(&codec->allocator, count, sizeof *values);
    for (size_t i = 0; values != NULL && i < count; i++)
        values[i] = in.bits == 16 ? read_16(in.pixels + 2 * i) : in.pixels[i];
    nb_release(&codec->allocator, in.pixels);
    if (values == NULL) return nb_fail(&codec->log, NEBEL_ERROR_MEMORY, "%s: out of memory", codec->name);
    *heights = (nb_heights){in.width, in.height, in.bits == 16 ? 65535 : 255, values};
    return NEBEL_OK;
}
