/* OpenEXR out: one part of scan lines, every channel as float, ZIP compressed. */
#include "scene/codec.h"

#include <openexr.h>
#include <stdio.h>
#include <string.h>

/* Names longer than this need a flag in the file. */
enum { SHORT_NAME = 31 };

typedef struct encoder {
    const nb_codec *codec;
    const nebel_image *image;
    nb_bytes *bytes;
    exr_context_t exr;
    exr_encode_pipeline_t pipeline;
    bool pipeline_ready;
    exr_result_t (*compress)(exr_encode_pipeline_t *pipeline); /* OpenEXR's own */
    char message[200];
} encoder;

/* ---- OpenEXR's callbacks --------------------------------------------------------------------- */

static void on_error(exr_const_context_t exr, exr_result_t code, const char *message)
{
    void *user = NULL;
    (void)code;
    if (exr == NULL || exr_get_user_data(exr, &user) != EXR_ERR_SUCCESS || user == NULL) return;
    encoder *out = user;
    if (out->message[0] == '\0') snprintf(out->message, sizeof out->message, "%s", message);
}

/* `error` must not be called: OpenEXR 3.1 holds the lock that it would take. */
static int64_t on_write(exr_const_context_t exr, void *user, const void *data, uint64_t size, uint64_t offset,
                        exr_stream_error_func_ptr_t error)
{
    const encoder *out = user;
    (void)exr;
    (void)error;
    if (!nb_bytes_write(&out->codec->allocator, out->bytes, (size_t)offset, data, (size_t)size)) return -1;
    return (int64_t)size;
}

/* ---- encoding -------------------------------------------------------------------------------- */

static bool write_header(encoder *out)
{
    const nebel_image *image = out->image;
    int part;
    bool good = exr_add_part(out->exr, NULL, EXR_STORAGE_SCANLINE, &part) == EXR_ERR_SUCCESS &&
                exr_initialize_required_attr_simple(out->exr, part, (int32_t)image->width, (int32_t)image->height,
                                                    EXR_COMPRESSION_ZIP) == EXR_ERR_SUCCESS;
    for (uint32_t i = 0; i < image->channel_count && good; i++) {
        const char *name = image->channel_names[i];
        if (strlen(name) > SHORT_NAME) exr_set_longname_support(out->exr, 1);
        good = exr_add_channel(out->exr, part, name, EXR_PIXEL_FLOAT, EXR_PERCEPTUALLY_LOGARITHMIC, 1, 1) ==
               EXR_ERR_SUCCESS;
    }
    return good && exr_write_header(out->exr) == EXR_ERR_SUCCESS;
}

/* The file's channels are sorted by name; the picture's are not. */
static void aim_channels(encoder *out, size_t y)
{
    const nebel_image *image = out->image;
    const float *row = image->samples + y * image->width * image->channel_count;
    for (int i = 0; i < out->pipeline.channel_count; i++) {
        exr_coding_channel_info_t *channel = &out->pipeline.channels[i];
        channel->user_data_type = EXR_PIXEL_FLOAT;
        channel->user_bytes_per_element = 4;
        channel->user_pixel_stride = (int32_t)(image->channel_count * 4);
        channel->user_line_stride = (int32_t)(image->width * image->channel_count * 4);
        channel->encode_from_ptr = (const uint8_t *)(row + nb_image_channel(image, channel->channel_name));
    }
}

/* OpenEXR 3.1 takes a block that compresses to exactly its own size as compressed when it writes, as stored when it
 * reads. Such a block is stored here. */
static exr_result_t compress_smaller(exr_encode_pipeline_t *pipeline)
{
    const encoder *out = pipeline->encoding_user_data;
    const exr_result_t result = out->compress(pipeline);
    if (result == EXR_ERR_SUCCESS && pipeline->compressed_bytes == pipeline->packed_bytes)
        memcpy(pipeline->compressed_buffer, pipeline->packed_buffer, pipeline->packed_bytes);
    return result;
}

static bool start_pipeline(encoder *out)
{
    if (exr_encoding_choose_default_routines(out->exr, 0, &out->pipeline) != EXR_ERR_SUCCESS) return false;
    out->compress = out->pipeline.compress_fn;
    out->pipeline.compress_fn = compress_smaller;
    out->pipeline.encoding_user_data = out;
    out->pipeline_ready = true;
    return true;
}

static bool write_block(encoder *out, uint32_t y)
{
    exr_chunk_info_t chunk;
    if (exr_write_scanline_chunk_info(out->exr, 0, (int)y, &chunk) != EXR_ERR_SUCCESS) return false;
    const exr_result_t prepared = out->pipeline_ready ? exr_encoding_update(out->exr, 0, &chunk, &out->pipeline)
                                                      : exr_encoding_initialize(out->exr, 0, &chunk, &out->pipeline);
    if (prepared != EXR_ERR_SUCCESS) return false;
    aim_channels(out, y);
    if (!out->pipeline_ready && !start_pipeline(out)) return false;
    return exr_encoding_run(out->exr, 0, &out->pipeline) == EXR_ERR_SUCCESS;
}

static bool write_blocks(encoder *out)
{
    int32_t step = 0;
    if (exr_get_scanlines_per_chunk(out->exr, 0, &step) != EXR_ERR_SUCCESS || step < 1) return false;
    for (uint32_t y = 0; y < out->image->height; y += (uint32_t)step)
        if (!write_block(out, y)) return false;
    return true;
}

nebel_result nb_exr_write_image(const nb_codec *codec, const nebel_image *image, nb_bytes *bytes)
{
    encoder out = {.codec = codec, .image = image, .bytes = bytes};
    exr_context_initializer_t start = EXR_DEFAULT_CONTEXT_INITIALIZER;
    start.error_handler_fn = on_error;
    start.user_data = &out;
    start.write_fn = on_write;
    if ((uint64_t)image->width * image->channel_count > INT32_MAX / 4)
        return nb_fail(&codec->log, NEBEL_ERROR_LIMIT, "%s: a row of %llu samples; at most %d", codec->name,
                       (unsigned long long)image->width * image->channel_count, INT32_MAX / 4);
    bool good = exr_start_write(&out.exr, codec->name, EXR_WRITE_FILE_DIRECTLY, &start) == EXR_ERR_SUCCESS;
    good = good && write_header(&out) && write_blocks(&out);
    if (out.exr != NULL) {
        exr_encoding_destroy(out.exr, &out.pipeline);
        good = exr_finish(&out.exr) == EXR_ERR_SUCCESS && good;
    }
    if (good) return NEBEL_OK;
    return nb_fail(&codec->log, NEBEL_ERROR_MEMORY, "%s: the OpenEXR picture cannot be made: %s", codec->name,
                   out.message[0] != '\0' ? out.message : "out of memory");
}
