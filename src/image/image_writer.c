#include "image_writer.h"

#include <string.h>

struct nebel_image_writer {
    nb_codec codec;
    nebel_image_format format;
    nb_sink *sink;
    nb_png_encoder *png; /* one of them */
    nb_exr_encoder *exr;
    nb_picture_plan plan; /* its names are the caller's */
    uint32_t rows;        /* written */
    nebel_result failed;  /* of what was done so far */
};

static bool is_good_record(const char *record)
{
    size_t size = 0;
    for (; record[size] != '\0'; size++)
        if (size == NEBEL_MAX_RECORD || record[size] < 0x20 || record[size] > 0x7e) return false;
    return size > 0;
}

nebel_result nb_record_check(const nb_codec *codec, const char *record)
{
    if (record == NULL || is_good_record(record)) return NEBEL_OK;
    return nb_fail(&codec->log, NEBEL_ERROR_ARGUMENT, "%s: a record is 1 to %d printable characters of ASCII",
                   codec->name, NEBEL_MAX_RECORD);
}

static nebel_result begin(nebel_image_writer *writer)
{
    const nb_codec *codec = &writer->codec;
    if (writer->format == NEBEL_IMAGE_PNG) return nb_png_write_begin(codec, &writer->plan, writer->sink, &writer->png);
    return nb_exr_write_begin(codec, &writer->plan, writer->sink, &writer->exr);
}

static nebel_result write_image_rows(nebel_image_writer *writer, const nebel_image *rows)
{
    return writer->png != NULL ? nb_png_write_rows(writer->png, rows) : nb_exr_write_rows(writer->exr, rows);
}

static nebel_result end(nebel_image_writer *writer)
{
    return writer->png != NULL ? nb_png_write_end(writer->png) : nb_exr_write_end(writer->exr);
}

static nebel_result check_plan(const nb_codec *codec, const nb_picture_plan *plan)
{
    /* Samples come later: what stands for them is not looked at. */
    float none;
    const nebel_image image = {plan->width, plan->height, plan->channel_count, plan->channel_names, &none};
    const nebel_result result = nb_image_check(codec, &image);
    return result == NEBEL_OK ? nb_record_check(codec, plan->record) : result;
}

nebel_result nebel_create_image_writer(const char *path, const nebel_image_desc *desc, nebel_image_writer **writer)
{
    if (writer != NULL) *writer = NULL;
    if (path == NULL || desc == NULL || writer == NULL) return NEBEL_ERROR_ARGUMENT;
    nb_codec codec;
    nebel_result result = nb_codec_prepare(&desc->host, path, &codec);
    if (result != NEBEL_OK) return result;
    const nb_picture_plan plan = {desc->width, desc->height, desc->channel_count, desc->channel_names, desc->record};
    result = check_plan(&codec, &plan);
    if (result != NEBEL_OK) return result;
    const nebel_image_format format = nebel_get_image_format(path);
    if (format == NEBEL_IMAGE_NONE) return nb_codec_fail_ending(&codec);
    nebel_image_writer *made = nb_allocate_zero(&codec.allocator, 1, sizeof *made + strlen(path) + 1);
    if (made == NULL) return nb_fail(&desc->host.log, NEBEL_ERROR_MEMORY, "%s: out of memory", path);
    *made = (nebel_image_writer){.codec = codec, .format = format, .plan = plan};
    made->codec.name = strcpy((char *)(made + 1), path);
    result = nb_sink_open(&codec.allocator, &codec.log, path, &made->sink);
    if (result == NEBEL_OK) result = begin(made);
    if (result == NEBEL_ERROR_FILE && made->sink != NULL) result = nb_sink_finish(made->sink);
    if (result == NEBEL_OK)
        *writer = made;
    else
        nebel_destroy_image_writer(made);
    return result;
}

static nebel_result check_rows(const nebel_image_writer *writer, uint32_t rows, const float *samples)
{
    const nb_codec *codec = &writer->codec;
    const uint32_t left = writer->plan.height - writer->rows;
    if (writer->failed != NEBEL_OK || samples == NULL) return NEBEL_ERROR_ARGUMENT;
    if (rows > 0 && rows <= left && (rows == left || rows % NB_WRITER_ROWS == 0)) return NEBEL_OK;
    return nb_fail(&codec->log, NEBEL_ERROR_ARGUMENT,
                   "%s: %u rows, where %u are left; must be a multiple of %d, or all", codec->name, (unsigned)rows,
                   (unsigned)left, NB_WRITER_ROWS);
}

nebel_result nebel_add_image_rows(nebel_image_writer *writer, uint32_t rows, const float *samples)
{
    if (writer == NULL) return NEBEL_ERROR_ARGUMENT;
    const nebel_result result = check_rows(writer, rows, samples);
    if (result != NEBEL_OK) return result;
    /* The samples are only read. */
    const nebel_image image = {writer->plan.width, rows, writer->plan.channel_count, writer->plan.channel_names,
                               (float *)(uintptr_t)samples};
    writer->failed = write_image_rows(writer, &image);
    writer->rows += rows;
    if (writer->failed == NEBEL_ERROR_FILE) writer->failed = nb_sink_finish(writer->sink);
    return writer->failed;
}

nebel_result nebel_finish_image(nebel_image_writer *writer)
{
    if (writer == NULL || writer->failed != NEBEL_OK) return NEBEL_ERROR_ARGUMENT;
    if (writer->rows < writer->plan.height)
        return nb_fail(&writer->codec.log, NEBEL_ERROR_ARGUMENT, "%s: %u of %u rows are there", writer->codec.name,
                       (unsigned)writer->rows, (unsigned)writer->plan.height);
    nebel_result result = end(writer);
    if (result == NEBEL_OK || result == NEBEL_ERROR_FILE) result = nb_sink_finish(writer->sink);
    writer->failed = NEBEL_ERROR_ARGUMENT; /* there is no second time */
    return result;
}

void nebel_destroy_image_writer(nebel_image_writer *writer)
{
    if (writer == NULL) return;
    const nebel_allocator allocator = writer->codec.allocator;
    nb_png_write_free(writer->png);
    nb_exr_write_free(writer->exr);
    nb_sink_close(writer->sink);
    nb_release(&allocator, writer);
}

nebel_result nebel_write_image(const char *path, const nebel_host *host, const nebel_image *image)
{
    if (path == NULL || host == NULL || image == NULL) return NEBEL_ERROR_ARGUMENT;
    if (image->samples == NULL)
        return nb_fail(&host->log, NEBEL_ERROR_ARGUMENT, "%s: the picture cannot be written: its samples are NULL",
                       path);
    const nebel_image_desc plan = {.host = *host,
                                   .width = image->width,
                                   .height = image->height,
                                   .channel_count = image->channel_count,
                                   .channel_names = image->channel_names};
    nebel_image_writer *writer;
    nebel_result result = nebel_create_image_writer(path, &plan, &writer);
    if (result == NEBEL_OK) result = nebel_add_image_rows(writer, image->height, image->samples);
    if (result == NEBEL_OK) result = nebel_finish_image(writer);
    nebel_destroy_image_writer(writer);
    return result;
}
