/* JPEG in. libjpeg leaves on an error by longjmp, so what must be released lives outside the jump. */
#include "image_codec.h"

#include <setjmp.h>
#include <stdio.h>
#include <jpeglib.h>
/* after it */
#include <jerror.h>

typedef struct nb_jpeg_decoder {
    struct jpeg_decompress_struct jpeg;
    struct jpeg_error_mgr errors;
    jmp_buf leave;
    const nb_codec *codec;
    size_t channel_count; /* wanted: 3, or 4 with opaque alpha */
    unsigned char *pixels;
    nebel_result result;
    char message[JMSG_LENGTH_MAX];
} nb_jpeg_decoder;

bool nb_jpeg_is(const nb_bytes *bytes)
{
    return bytes->size >= 3 && bytes->data[0] == 0xFF && bytes->data[1] == 0xD8 && bytes->data[2] == 0xFF;
}

/* What is in order, but not for libjpeg, is not broken. */
static nebel_result result_of(int code)
{
    switch (code) {
    case JERR_OUT_OF_MEMORY:
        return NEBEL_ERROR_MEMORY;
    case JERR_ARITH_NOTIMPL:
    case JERR_BAD_PRECISION:
    case JERR_CONVERSION_NOTIMPL:
    case JERR_NOT_COMPILED:
    case JERR_SOF_UNSUPPORTED:
        return NEBEL_ERROR_UNSUPPORTED;
    default:
        return NEBEL_ERROR_FORMAT;
    }
}

static void on_jpeg_error(j_common_ptr jpeg)
{
    nb_jpeg_decoder *in = jpeg->client_data;
    if (in->result == NEBEL_OK) in->result = result_of(jpeg->err->msg_code);
    jpeg->err->format_message(jpeg, in->message);
    longjmp(in->leave, 1);
}

/* A warning (level -1) means that data were corrupt and guessed at: for us the picture is broken. */
static void on_message(j_common_ptr jpeg, int level)
{
    if (level < 0) on_jpeg_error(jpeg);
}

static void read_rows(nb_jpeg_decoder *in)
{
    struct jpeg_decompress_struct *jpeg = &in->jpeg;
    const size_t row_size = jpeg->output_width * in->channel_count;
    while (jpeg->output_scanline < jpeg->output_height) {
        JSAMPROW row = in->pixels + jpeg->output_scanline * row_size;
        jpeg_read_scanlines(jpeg, &row, 1);
    }
    jpeg_finish_decompress(jpeg);
}

static void run_jpeg_decoder(nb_jpeg_decoder *in, const nb_bytes *bytes)
{
    if (setjmp(in->leave) != 0) return;
    jpeg_create_decompress(&in->jpeg);
    in->jpeg.client_data = in;
    jpeg_mem_src(&in->jpeg, bytes->data, bytes->size);
    jpeg_read_header(&in->jpeg, TRUE);
    in->result = nb_codec_check_size(in->codec, in->jpeg.image_width, in->jpeg.image_height, 4);
    if (in->result == NEBEL_OK)
        in->result = nb_codec_check_room(in->codec, 4 * (uint64_t)in->jpeg.image_width * in->jpeg.image_height);
    if (in->result != NEBEL_OK) return;
    in->jpeg.out_color_space = in->channel_count == 3 ? JCS_RGB : JCS_EXT_RGBA;
    jpeg_start_decompress(&in->jpeg);
    in->pixels =
        nb_allocate(&in->codec->allocator, (size_t)in->jpeg.output_width * in->jpeg.output_height, in->channel_count);
    if (in->pixels == NULL)
        in->result = NEBEL_ERROR_MEMORY;
    else
        read_rows(in);
}

/* The pixels in in->pixels, to be released by the caller. */
static nebel_result decode_jpeg(nb_jpeg_decoder *in, const nb_bytes *bytes)
{
    in->jpeg.err = jpeg_std_error(&in->errors);
    in->jpeg.client_data = in;
    in->errors.error_exit = on_jpeg_error;
    in->errors.emit_message = on_message;
    run_jpeg_decoder(in, bytes);
    jpeg_destroy_decompress(&in->jpeg);
    if (in->result == NEBEL_OK || in->result == NEBEL_ERROR_LIMIT) return in->result;
    const nb_codec *codec = in->codec;
    nb_release(&codec->allocator, in->pixels);
    if (in->result == NEBEL_ERROR_UNSUPPORTED)
        return nb_fail(&codec->log, in->result, "%s: JPEG pictures of this kind are not read (%s); make it one in RGB",
                       codec->name, in->message);
    if (in->result == NEBEL_ERROR_MEMORY) return nb_fail(&codec->log, in->result, "%s: out of memory", codec->name);
    return nb_fail(&codec->log, in->result, "%s: not a good JPEG picture: %s", codec->name, in->message);
}

nebel_result nb_jpeg_read_texture(const nb_codec *codec, const nb_bytes *bytes, nebel_texture *texture)
{
    nb_jpeg_decoder in = {.codec = codec, .channel_count = 4, .message = "out of memory"};
    *texture = (nebel_texture){0};
    const nebel_result result = decode_jpeg(&in, bytes);
    if (result == NEBEL_OK) *texture = (nebel_texture){in.jpeg.output_width, in.jpeg.output_height, in.pixels};
    return result;
}

nebel_result nb_jpeg_read_stored(const nb_codec *codec, const nb_bytes *bytes, nb_stored *stored)
{
    nb_jpeg_decoder in = {.codec = codec, .channel_count = 3, .message = "out of memory"};
    *stored = (nb_stored){0};
    const nebel_result result = decode_jpeg(&in, bytes);
    if (result == NEBEL_OK) *stored = (nb_stored){in.jpeg.output_width, in.jpeg.output_height, 8, 3, in.pixels};
    return result;
}
