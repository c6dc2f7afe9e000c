/* OpenEXR in: one part, scan lines or tiles of level 0, every channel as float. The picture is the display
 * window; where the data window does not reach it is 0. */
#include "image_codec.h"

#include <openexr.h>
#include <stdio.h>
#include <string.h>

typedef struct nb_exr_decoder {
    const nb_codec *codec;
    const nb_bytes *bytes;
    exr_context_t exr;
    exr_attr_box2i_t data, display;
    const exr_attr_chlist_t *channels; /* by name, as OpenEXR keeps them */
    nebel_image *image;
    int *order; /* of the file's channel i: its place in the picture */
    float *block;
    size_t block_capacity;
    exr_decode_pipeline_t pipeline;
    bool pipeline_ready;
    exr_result_t failure; /* the first one; success: none */
    char message[200];
} nb_exr_decoder;

bool nb_exr_is(const nb_bytes *bytes)
{
    return bytes->size >= 4 && memcmp(bytes->data, "\x76\x2f\x31\x01", 4) == 0;
}

/* ---- OpenEXR's callbacks --------------------------------------------------------------------- */

static void on_exr_read_error(exr_const_context_t exr, exr_result_t code, const char *message)
{
    void *user = NULL;
    (void)code;
    if (exr == NULL || exr_get_user_data(exr, &user) != EXR_ERR_SUCCESS || user == NULL) return;
    nb_exr_decoder *in = user;
    if (in->message[0] == '\0') snprintf(in->message, sizeof in->message, "%s", message);
}

static int64_t on_size(exr_const_context_t exr, void *user)
{
    const nb_exr_decoder *in = user;
    (void)exr;
    return (int64_t)in->bytes->size;
}

static int64_t on_exr_read(exr_const_context_t exr, void *user, void *buffer, uint64_t size, uint64_t offset,
                           exr_stream_error_func_ptr_t error)
{
    const nb_exr_decoder *in = user;
    (void)exr;
    (void)error;
    if (offset >= in->bytes->size) return 0;
    const uint64_t left = in->bytes->size - offset, count = size < left ? size : left;
    memcpy(buffer, in->bytes->data + offset, (size_t)count);
    return (int64_t)count;
}

/* ---- the header ------------------------------------------------------------------------------ */

static nebel_result fail_unsupported(const nb_exr_decoder *in, const char *what);

/* Whether a call of OpenEXR succeeded; keeps why it did not. */
static bool has_succeeded(nb_exr_decoder *in, exr_result_t result)
{
    if (result == EXR_ERR_SUCCESS) return true;
    if (in->failure == EXR_ERR_SUCCESS) in->failure = result;
    return false;
}

static nebel_result fail_format(nb_exr_decoder *in)
{
    if (in->failure == EXR_ERR_OUT_OF_MEMORY)
        return nb_fail(&in->codec->log, NEBEL_ERROR_MEMORY, "%s: out of memory", in->codec->name);
    if (in->failure == EXR_ERR_FEATURE_NOT_IMPLEMENTED)
        return fail_unsupported(in, "that are compressed in this way (DWAA, DWAB)");
    return nb_fail(&in->codec->log, NEBEL_ERROR_FORMAT, "%s: not a good OpenEXR picture: %s", in->codec->name,
                   in->message[0] != '\0' ? in->message : "it breaks the format");
}

static nebel_result fail_unsupported(const nb_exr_decoder *in, const char *what)
{
    return nb_fail(&in->codec->log, NEBEL_ERROR_UNSUPPORTED, "%s: OpenEXR pictures %s are not read; convert it",
                   in->codec->name, what);
}

static uint64_t window_width(const exr_attr_box2i_t *window)
{
    return (uint64_t)((int64_t)window->max.x - window->min.x + 1);
}

static uint64_t window_height(const exr_attr_box2i_t *window)
{
    return (uint64_t)((int64_t)window->max.y - window->min.y + 1);
}

static bool is_empty(const exr_attr_box2i_t *window)
{
    return window->max.x < window->min.x || window->max.y < window->min.y;
}

static nebel_result check_header(nb_exr_decoder *in)
{
    exr_storage_t storage;
    exr_compression_t compression;
    if (!has_succeeded(in, exr_get_storage(in->exr, 0, &storage)) ||
        !has_succeeded(in, exr_get_compression(in->exr, 0, &compression)) ||
        !has_succeeded(in, exr_get_data_window(in->exr, 0, &in->data)) ||
        !has_succeeded(in, exr_get_display_window(in->exr, 0, &in->display)) ||
        !has_succeeded(in, exr_get_channels(in->exr, 0, &in->channels)) || is_empty(&in->data) ||
        is_empty(&in->display) || in->channels->num_channels < 1)
        return fail_format(in);
    /* OpenEXR 3.1.5 decodes them, without an error, to other numbers than were written. */
    if (compression == EXR_COMPRESSION_B44 || compression == EXR_COMPRESSION_B44A)
        return fail_unsupported(in, "that are compressed in this way (B44, B44A)");
    if (storage != EXR_STORAGE_SCANLINE && storage != EXR_STORAGE_TILED) return fail_unsupported(in, "with deep data");
    for (int i = 0; i < in->channels->num_channels; i++)
        if (in->channels->entries[i].x_sampling != 1 || in->channels->entries[i].y_sampling != 1)
            return fail_unsupported(in, "with subsampled channels");
    return nb_codec_check_size(in->codec, window_width(&in->data), window_height(&in->data),
                               (uint64_t)in->channels->num_channels);
}

/* R, G, B and A first, then the others as they come. */
static void order_channels(const exr_attr_chlist_t *channels, int *order, const char **names)
{
    static const char *const first[] = {"R", "G", "B", "A"};
    int next = 0;
    for (int i = 0; i < channels->num_channels; i++) order[i] = -1;
    for (int k = 0; k < 4; k++)
        for (int i = 0; i < channels->num_channels; i++)
            if (order[i] < 0 && strcmp(channels->entries[i].name.str, first[k]) == 0) order[i] = next++;
    for (int i = 0; i < channels->num_channels; i++) {
        if (order[i] < 0) order[i] = next++;
        names[order[i]] = channels->entries[i].name.str;
    }
}

static nebel_result allocate_image(nb_exr_decoder *in)
{
    const size_t count = (size_t)in->channels->num_channels;
    const char **names = nb_allocate(&in->codec->allocator, count, sizeof *names);
    in->order = nb_allocate(&in->codec->allocator, count, sizeof *in->order);
    nebel_result result = NEBEL_ERROR_MEMORY;
    if (names != NULL && in->order != NULL) {
        order_channels(in->channels, in->order, names);
        result = nb_image_allocate(in->codec, window_width(&in->display), window_height(&in->display), count, names,
                                   in->image);
    } else {
        nb_fail(&in->codec->log, result, "%s: out of memory", in->codec->name);
    }
    nb_release(&in->codec->allocator, (void *)names);
    return result;
}

/* ---- the pixels ------------------------------------------------------------------------------ */

/* Copies a decoded block, one plane after the other, to where it lies in the display window. */
static void place_block(const nb_exr_decoder *in, int64_t x0, int64_t y0, const exr_chunk_info_t *chunk)
{
    const nebel_image *image = in->image;
    const int64_t left = x0 - in->display.min.x, top = y0 - in->display.min.y;
    for (int c = 0; c < in->channels->num_channels; c++) {
        const float *plane = in->block + (size_t)c * (size_t)chunk->width * (size_t)chunk->height;
        for (int64_t y = 0; y < chunk->height; y++) {
            if (top + y < 0 || top + y >= image->height) continue;
            float *row = image->samples + (size_t)(top + y) * image->width * image->channel_count + in->order[c];
            for (int64_t x = 0; x < chunk->width; x++)
                if (left + x >= 0 && left + x < image->width)
                    row[(size_t)(left + x) * image->channel_count] = plane[y * chunk->width + x];
        }
    }
}

static bool grow_block(nb_exr_decoder *in, const exr_chunk_info_t *chunk)
{
    void *block = in->block;
    if (chunk->width <= 0 || chunk->height <= 0) return false;
    const uint64_t wanted = (uint64_t)chunk->width * (uint64_t)chunk->height * (uint64_t)in->channels->num_channels;
    if (wanted > NB_MAX_SAMPLES) return false;
    const bool grown = nb_grow(&in->codec->allocator, &block, sizeof(float), 0, &in->block_capacity, (size_t)wanted);
    in->block = block;
    return grown || has_succeeded(in, EXR_ERR_OUT_OF_MEMORY);
}

static void aim_read_channels(nb_exr_decoder *in, const exr_chunk_info_t *chunk)
{
    const size_t plane = (size_t)chunk->width * (size_t)chunk->height;
    for (int c = 0; c < in->pipeline.channel_count; c++) {
        exr_coding_channel_info_t *channel = &in->pipeline.channels[c];
        channel->user_data_type = EXR_PIXEL_FLOAT;
        channel->user_bytes_per_element = 4;
        channel->user_pixel_stride = 4;
        channel->user_line_stride = chunk->width * 4;
        channel->decode_to_ptr = (uint8_t *)(in->block + (size_t)c * plane);
    }
}

static bool decode_block(nb_exr_decoder *in, int64_t x0, int64_t y0, const exr_chunk_info_t *chunk)
{
    if (!grow_block(in, chunk)) return false;
    const exr_result_t prepared = in->pipeline_ready ? exr_decoding_update(in->exr, 0, chunk, &in->pipeline)
                                                     : exr_decoding_initialize(in->exr, 0, chunk, &in->pipeline);
    if (!has_succeeded(in, prepared) || in->pipeline.channel_count != in->channels->num_channels) return false;
    aim_read_channels(in, chunk);
    if (!in->pipeline_ready && !has_succeeded(in, exr_decoding_choose_default_routines(in->exr, 0, &in->pipeline)))
        return false;
    in->pipeline_ready = true;
    if (!has_succeeded(in, exr_decoding_run(in->exr, 0, &in->pipeline))) return false;
    place_block(in, x0, y0, chunk);
    return true;
}

static bool decode_lines(nb_exr_decoder *in)
{
    int32_t step = 0;
    exr_chunk_info_t chunk;
    if (!has_succeeded(in, exr_get_scanlines_per_chunk(in->exr, 0, &step)) || step < 1) return false;
    for (int64_t y = in->data.min.y; y <= in->data.max.y; y += step)
        if (!has_succeeded(in, exr_read_scanline_chunk_info(in->exr, 0, (int)y, &chunk)) ||
            !decode_block(in, in->data.min.x, y, &chunk))
            return false;
    return true;
}

static bool decode_tiles(nb_exr_decoder *in)
{
    int32_t width = 0, height = 0;
    exr_chunk_info_t chunk;
    if (!has_succeeded(in, exr_get_tile_sizes(in->exr, 0, 0, 0, &width, &height)) || width < 1 || height < 1)
        return false;
    const int64_t columns = ((int64_t)window_width(&in->data) + width - 1) / width;
    const int64_t rows = ((int64_t)window_height(&in->data) + height - 1) / height;
    for (int64_t i = 0; i < columns * rows; i++) {
        const int64_t x = i % columns, y = i / columns;
        if (!has_succeeded(in, exr_read_tile_chunk_info(in->exr, 0, (int)x, (int)y, 0, 0, &chunk)) ||
            !decode_block(in, in->data.min.x + x * width, in->data.min.y + y * height, &chunk))
            return false;
    }
    return true;
}

static nebel_result decode_pixels(nb_exr_decoder *in)
{
    exr_storage_t storage = EXR_STORAGE_SCANLINE;
    exr_get_storage(in->exr, 0, &storage);
    const bool done = storage == EXR_STORAGE_TILED ? decode_tiles(in) : decode_lines(in);
    if (done) return NEBEL_OK;
    nb_image_release(&in->codec->allocator, in->image);
    return fail_format(in);
}

/* The version's flag: https://openexr.com/en/latest/OpenEXRFileLayout.html#version-field */
static bool has_parts(const nb_bytes *bytes)
{
    return bytes->size > 5 && (bytes->data[5] & 0x10) != 0;
}

nebel_result nb_exr_read_image(const nb_codec *codec, const nb_bytes *bytes, nebel_image *image)
{
    nb_exr_decoder in = {.codec = codec, .bytes = bytes, .image = image};
    exr_context_initializer_t start = EXR_DEFAULT_CONTEXT_INITIALIZER;
    start.error_handler_fn = on_exr_read_error;
    start.user_data = &in;
    start.read_fn = on_exr_read;
    start.size_fn = on_size;
    start.flags = EXR_CONTEXT_FLAG_DISABLE_CHUNK_RECONSTRUCTION;
    *image = (nebel_image){0};
    if (has_parts(bytes)) return fail_unsupported(&in, "of several parts");
    nebel_result result = NEBEL_OK;
    if (!has_succeeded(&in, exr_start_read(&in.exr, codec->name, &start))) result = fail_format(&in);
    if (result == NEBEL_OK) result = check_header(&in);
    if (result == NEBEL_OK) result = allocate_image(&in);
    if (result == NEBEL_OK) result = decode_pixels(&in);
    if (in.exr != NULL) {
        exr_decoding_destroy(in.exr, &in.pipeline);
        exr_finish(&in.exr);
    }
    nb_release(&codec->allocator, in.order);
    nb_release(&codec->allocator, in.block);
    return result;
}
