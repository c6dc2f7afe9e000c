/* Pictures as they are stored, in and out. */
#include <nebel/photograph.h>

#include "image/image_writer.h"

#include <math.h>

/* ---- kinds of numbers ------------------------------------------------------------------------ */

/* The type of whole numbers; COUNT: there is none. */
static nebel_pixel_type type_of(const nb_stored *stored)
{
    if (stored->channel_count == 3) return stored->bits == 8 ? NEBEL_PIXEL_RGB8 : NEBEL_PIXEL_RGB16;
    if (stored->channel_count == 4) return stored->bits == 8 ? NEBEL_PIXEL_RGBA8 : NEBEL_PIXEL_RGBA16;
    return NEBEL_PIXEL_COUNT;
}

static bool is_float(nebel_pixel_type type)
{
    return type == NEBEL_PIXEL_RGB_FLOAT || type == NEBEL_PIXEL_RGBA_FLOAT;
}

static bool is_stored(nebel_pixel_type type, nb_stored *stored)
{
    for (stored->bits = 8; stored->bits <= 16; stored->bits += 8)
        for (stored->channel_count = 3; stored->channel_count <= 4; stored->channel_count++)
            if (type_of(stored) == type) return true;
    return false;
}

/* ---- reading --------------------------------------------------------------------------------- */

static nebel_result take_stored(const nb_stored *stored, nebel_photograph *photograph)
{
    *photograph = (nebel_photograph){stored->width, stored->height, type_of(stored), stored->pixels};
    return NEBEL_OK;
}

/* R, G and B, or one gray for all; `places` of up to four channels among the picture's. */
static size_t find_colors(const nebel_image *image, int places[4])
{
    static const char *const names[] = {"R", "G", "B", "A"};
    for (int c = 0; c < 4; c++) places[c] = nb_image_channel(image, names[c]);
    const int gray = nb_image_channel(image, "Y");
    if (places[0] < 0 && places[1] < 0 && places[2] < 0 && gray >= 0)
        for (int c = 0; c < 3; c++) places[c] = gray;
    if (places[0] < 0 || places[1] < 0 || places[2] < 0) return 0;
    return places[3] < 0 ? 3 : 4;
}

static nebel_result take_image(const nb_codec *codec, const nebel_image *image, nebel_photograph *photograph)
{
    int places[4];
    const size_t channels = find_colors(image, places), count = (size_t)image->width * image->height;
    if (channels == 0)
        return nb_fail(&codec->log, NEBEL_ERROR_FORMAT, "%s: it has no channels R, G and B, nor Y", codec->name);
    float *pixels = nb_allocate(&codec->allocator, count, channels * sizeof *pixels);
    if (pixels == NULL) return nb_fail(&codec->log, NEBEL_ERROR_MEMORY, "%s: out of memory", codec->name);
    for (size_t i = 0; i < count; i++)
        for (size_t c = 0; c < channels; c++)
            pixels[i * channels + c] = image->samples[i * image->channel_count + (size_t)places[c]];
    *photograph = (nebel_photograph){image->width, image->height,
                                     channels == 3 ? NEBEL_PIXEL_RGB_FLOAT : NEBEL_PIXEL_RGBA_FLOAT, pixels};
    return NEBEL_OK;
}

static nebel_result decode_exr(const nb_codec *codec, const nb_bytes *bytes, nebel_photograph *photograph)
{
    nebel_image image;
    nebel_result result = nb_exr_read_image(codec, bytes, &image);
    if (result != NEBEL_OK) return result;
    result = take_image(codec, &image, photograph);
    nb_image_release(&codec->allocator, &image);
    return result;
}

static nebel_result decode(const nb_codec *codec, const nb_bytes *bytes, nebel_photograph *photograph)
{
    nb_stored stored;
    nebel_result result;
    if (nb_exr_is(bytes)) return decode_exr(codec, bytes, photograph);
    if (nb_png_is(bytes))
        result = nb_png_read_stored(codec, bytes, true, &stored);
    else if (nb_jpeg_is(bytes))
        result = nb_jpeg_read_stored(codec, bytes, &stored);
    else
        return nb_fail(&codec->log, NEBEL_ERROR_FORMAT, "%s: neither a PNG, a JPEG nor an OpenEXR picture",
                       codec->name);
    return result == NEBEL_OK ? take_stored(&stored, photograph) : result;
}

nebel_result nebel_read_photograph(const char *path, const nebel_host *host, nebel_photograph *photograph)
{
    nb_codec codec;
    nb_bytes bytes;
    if (photograph != NULL) *photograph = (nebel_photograph){0};
    if (path == NULL || host == NULL || photograph == NULL) return NEBEL_ERROR_ARGUMENT;
    nebel_result result = nb_codec_prepare(host, path, &codec);
    if (result == NEBEL_OK)
        result = nb_file_read(&codec.allocator, &codec.log, NULL, "picture", path, NB_FILE_LIMIT, &bytes);
    if (result != NEBEL_OK) return result;
    result = decode(&codec, &bytes, photograph);
    nb_release(&codec.allocator, bytes.data);
    return result;
}

void nebel_free_photograph(const nebel_host *host, nebel_photograph *photograph)
{
    if (host == NULL || photograph == NULL || !nb_allocator_is_valid(&host->allocator)) return;
    const nebel_allocator allocator = nb_resolve_allocator(&host->allocator);
    nb_release(&allocator, photograph->pixels);
    *photograph = (nebel_photograph){0};
}

/* ---- writing --------------------------------------------------------------------------------- */

/* Opens the file, and gives it its name when `stored` is in it. */
static nebel_result write_stored(const nb_codec *codec, const nb_stored *stored, const char *record)
{
    nb_sink *sink;
    nebel_result result = nb_sink_open(&codec->allocator, &codec->log, codec->name, &sink);
    if (result != NEBEL_OK) return result;
    result = nb_png_write_stored(codec, stored, record, sink);
    if (result == NEBEL_OK || result == NEBEL_ERROR_FILE) result = nb_sink_finish(sink);
    nb_sink_close(sink);
    return result;
}

static nebel_result write_light(const nb_codec *codec, const nebel_photograph *photograph, const char *record)
{
    static const char *const names[] = {"R", "G", "B", "A"};
    const nebel_image_desc desc = {.host = {.allocator = codec->allocator, .log = codec->log},
                                   .width = photograph->width,
                                   .height = photograph->height,
                                   .channel_count = photograph->type == NEBEL_PIXEL_RGB_FLOAT ? 3 : 4,
                                   .channel_names = names,
                                   .record = record};
    nebel_image_writer *writer;
    nebel_result result = nebel_create_image_writer(codec->name, &desc, &writer);
    if (result == NEBEL_OK) result = nebel_add_image_rows(writer, photograph->height, photograph->pixels);
    if (result == NEBEL_OK) result = nebel_finish_image(writer);
    nebel_destroy_image_writer(writer);
    return result;
}

static nebel_result write_as(const nb_codec *codec, const nebel_photograph *photograph, const char *record)
{
    const nebel_image_format format = nebel_get_image_format(codec->name);
    nb_stored stored = {.width = photograph->width, .height = photograph->height, .pixels = photograph->pixels};
    if (format == NEBEL_IMAGE_PNG && is_stored(photograph->type, &stored)) return write_stored(codec, &stored, record);
    if (format == NEBEL_IMAGE_EXR && is_float(photograph->type)) return write_light(codec, photograph, record);
    if (format == NEBEL_IMAGE_NONE)
        return nb_fail(&codec->log, NEBEL_ERROR_FORMAT, "%s: unknown picture format; the name must end in .png or .exr",
                       codec->name);
    return nb_fail(&codec->log, NEBEL_ERROR_FORMAT,
                   "%s: a picture of whole numbers is written as .png, one of floats as .exr; name it so", codec->name);
}

static nebel_result check(const nb_codec *codec, uint32_t width, uint32_t height, const void *numbers,
                          const char *record)
{
    if (numbers == NULL || width == 0 || height == 0)
        return nb_fail(&codec->log, NEBEL_ERROR_ARGUMENT, "%s: the picture has no pixels", codec->name);
    const nebel_result result = nb_codec_check_size(codec, width, height, 4);
    return result == NEBEL_OK ? nb_record_check(codec, record) : result;
}

nebel_result nebel_write_photograph(const char *path, const nebel_host *host, const nebel_photograph *photograph,
                                    const char *record)
{
    nb_codec codec;
    if (path == NULL || host == NULL || photograph == NULL) return NEBEL_ERROR_ARGUMENT;
    nebel_result result = nb_codec_prepare(host, path, &codec);
    if (result == NEBEL_OK) result = check(&codec, photograph->width, photograph->height, photograph->pixels, record);
    return result == NEBEL_OK ? write_as(&codec, photograph, record) : result;
}

/* ---- one number a pixel ---------------------------------------------------------------------- */

static nebel_result write_gray_png(const nb_codec *codec, uint32_t width, uint32_t height, const float *values,
                                   const char *record)
{
    const size_t count = (size_t)width * height;
    uint16_t *numbers = nb_allocate(&codec->allocator, count, sizeof *numbers);
    if (numbers == NULL) return nb_fail(&codec->log, NEBEL_ERROR_MEMORY, "%s: out of memory", codec->name);
    for (size_t i = 0; i < count; i++) {
        const float inside = values[i] > 0 ? (values[i] < 1 ? values[i] : 1) : 0;
        numbers[i] = (uint16_t)(inside * 65535.0f + 0.5f);
    }
    const nb_stored stored = {width, height, 16, 1, (unsigned char *)numbers};
    const nebel_result result = write_stored(codec, &stored, record);
    nb_release(&codec->allocator, numbers);
    return result;
}

nebel_result nebel_write_gray(const char *path, const nebel_host *host, uint32_t width, uint32_t height,
                              const float *values, const char *record)
{
    nb_codec codec;
    if (path == NULL || host == NULL) return NEBEL_ERROR_ARGUMENT;
    nebel_result result = nb_codec_prepare(host, path, &codec);
    if (result == NEBEL_OK) result = check(&codec, width, height, values, record);
    if (result == NEBEL_OK && nebel_get_image_format(path) != NEBEL_IMAGE_PNG)
        result = nb_fail(&codec.log, NEBEL_ERROR_FORMAT, "%s: gray is written as .png; name it so", path);
    return result == NEBEL_OK ? write_gray_png(&codec, width, height, values, record) : result;
}
