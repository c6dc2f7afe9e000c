/* OpenEXR out: one part of scan lines, every channel as float, ZIP compressed. */
#include "image_writer.h"

#include <openexr.h>
#include <stdio.h>
#include <string.h>

/* Names longer than this need a flag in the file. */
enum { SHORT_NAME = 31 };

struct nb_exr_encoder {
    const nb_codec *codec;
    nb_sink *sink;
    const nebel_image *rows; /* that are written now */
    exr_context_t exr;
    exr_encode_pipeline_t pipeline;
    bool pipeline_ready;
    uint32_t row_number;                                       /* of the first of `rows` in the picture */
    exr_result_t (*compress)(exr_encode_pipeline_t *pipeline); /* OpenEXR's own */
    char message[200];
};

/* ---- OpenEXR's callbacks --------------------------------------------------------------------- */

static void on_exr_write_error(exr_const_context_t exr, exr_result_t code, const char *message)
{
    void *user = NULL;
    (void)code;
    if (exr == NULL || exr_get_user_data(exr, &user) != EXR_ERR_SUCCESS || user == NULL) return;
    nb_exr_encoder *out = user;
    if (out->message[0] == '\0') snprintf(out->message, sizeof out->message, "%s", message);
}

/* `error` must not be called: OpenEXR 3.1 holds the lock that it would take. */
static int64_t on_exr_write(exr_const_context_t exr, void *user, const void *data, uint64_t size, uint64_t offset,
                            exr_stream_error_func_ptr_t error)
{
    const nb_exr_encoder *out = user;
    (void)exr;
    (void)error;
    return nb_sink_write(out->sink, offset, data, (size_t)size) ? (int64_t)size : -1;
}

/* ---- encoding -------------------------------------------------------------------------------- */

static bool write_exr_header(nb_exr_encoder *out, const nb_picture_plan *plan)
{
    int part;
    bool good = exr_add_part(out->exr, NULL, EXR_STORAGE_SCANLINE, &part) == EXR_ERR_SUCCESS &&
                exr_initialize_required_attr_simple(out->exr, part, (int32_t)plan->width, (int32_t)plan->height,
                                                    EXR_COMPRESSION_ZIP) == EXR_ERR_SUCCESS;
    for (uint32_t i = 0; i < plan->channel_count && good; i++) {
        const char *name = plan->channel_names[i];
        if (strlen(name) > SHORT_NAME) exr_set_longname_support(out->exr, 1);
        good = exr_add_channel(out->exr, part, name, EXR_PIXEL_FLOAT, EXR_PERCEPTUALLY_LOGARITHMIC, 1, 1) ==
               EXR_ERR_SUCCESS;
    }
    if (good && plan->record != NULL)
        good = exr_attr_set_string(out->exr, part, NB_RECORD_KEY, plan->record) == EXR_ERR_SUCCESS;
    return good && exr_write_header(out->exr) == EXR_ERR_SUCCESS;
}

/* The file's channels are sorted by name; the picture's are not. */
static void aim_write_channels(nb_exr_encoder *out, size_t y)
{
    const nebel_image *image = out->rows;
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
    const nb_exr_encoder *out = pipeline->encoding_user_data;
    const exr_result_t result = out->compress(pipeline);
    if (result == EXR_ERR_SUCCESS && pipeline->compressed_bytes == pipeline->packed_bytes)
        memcpy(pipeline->compressed_buffer, pipeline->packed_buffer, pipeline->packed_bytes);
    return result;
}

static bool start_pipeline(nb_exr_encoder *out)
{
    if (exr_encoding_choose_default_routines(out->exr, 0, &out->pipeline) != EXR_ERR_SUCCESS) return false;
    out->compress = out->pipeline.compress_fn;
    out->pipeline.compress_fn = compress_smaller;
    out->pipeline.encoding_user_data = out;
    out->pipeline_ready = true;
    return true;
}

static bool write_block(nb_exr_encoder *out, uint32_t y)
{
    exr_chunk_info_t chunk;
    if (exr_write_scanline_chunk_info(out->exr, 0, (int)(out->row_number + y), &chunk) != EXR_ERR_SUCCESS) return false;
    const exr_result_t prepared = out->pipeline_ready ? exr_encoding_update(out->exr, 0, &chunk, &out->pipeline)
                                                      : exr_encoding_initialize(out->exr, 0, &chunk, &out->pipeline);
    if (prepared != EXR_ERR_SUCCESS) return false;
    aim_write_channels(out, y);
    if (!out->pipeline_ready && !start_pipeline(out)) return false;
    return exr_encoding_run(out->exr, 0, &out->pipeline) == EXR_ERR_SUCCESS;
}

static bool write_blocks(nb_exr_encoder *out)
{
    int32_t step = 0;
    if (exr_get_scanlines_per_chunk(out->exr, 0, &step) != EXR_ERR_SUCCESS || step < 1) return false;
    for (uint32_t y = 0; y < out->rows->height; y += (uint32_t)step)
        if (!write_block(out, y)) return false;
    return true;
}

/* What the sink has to say it says when it is finished. */
static nebel_result exr_finding(const nb_exr_encoder *out, bool good)
{
    if (good) return NEBEL_OK;
    if (nb_sink_has_failed(out->sink)) return NEBEL_ERROR_FILE;
    return nb_fail(&out->codec->log, NEBEL_ERROR_MEMORY, "%s: the OpenEXR picture cannot be made: %s", out->codec->name,
                   out->message[0] != '\0' ? out->message : "out of memory");
}

nebel_result nb_exr_write_begin(const nb_codec *codec, const nb_picture_plan *plan, nb_sink *sink,
                                nb_exr_encoder **encoder)
{
    nb_exr_encoder *out = nb_allocate_zero(&codec->allocator, 1, sizeof *out);
    exr_context_initializer_t start = EXR_DEFAULT_CONTEXT_INITIALIZER;
    *encoder = out;
    if (out == NULL)
        return nb_fail(&codec->log, NEBEL_ERROR_MEMORY, "%s: the OpenEXR picture cannot be made: out of memory",
                       codec->name);
    *out = (nb_exr_encoder){.codec = codec, .sink = sink};
    start.error_handler_fn = on_exr_write_error;
    start.user_data = out;
    start.write_fn = on_exr_write;
    if ((uint64_t)plan->width * plan->channel_count > INT32_MAX / 4)
        return nb_fail(&codec->log, NEBEL_ERROR_LIMIT, "%s: a row of %llu samples; at most %d", codec->name,
                       (unsigned long long)plan->width * plan->channel_count, INT32_MAX / 4);
    const bool good = exr_start_write(&out->exr, codec->name, EXR_WRITE_FILE_DIRECTLY, &start) == EXR_ERR_SUCCESS;
    return exr_finding(out, good && write_exr_header(out, plan));
}

nebel_result nb_exr_write_rows(nb_exr_encoder *encoder, const nebel_image *rows)
{
    encoder->rows = rows;
    const nebel_result result = exr_finding(encoder, write_blocks(encoder));
    encoder->row_number += rows->height;
    return result;
}

/* OpenEXR closes what it began in any case. */
static bool finish(nb_exr_encoder *encoder)
{
    if (encoder->exr == NULL) return false;
    exr_encoding_destroy(encoder->exr, &encoder->pipeline);
    const exr_result_t finished = exr_finish(&encoder->exr);
    encoder->exr = NULL;
    return finished == EXR_ERR_SUCCESS;
}

nebel_result nb_exr_write_end(nb_exr_encoder *encoder)
{
    return exr_finding(encoder, finish(encoder));
}

void nb_exr_write_free(nb_exr_encoder *encoder)
{
    if (encoder == NULL) return;
    const nebel_allocator allocator = encoder->codec->allocator;
    (void)finish(encoder);
    nb_release(&allocator, encoder);
}
