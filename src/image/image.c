/* Pictures: which format, which file. */
#include "image_codec.h"

#include <string.h>
#include <strings.h>

/* Channel names of EXR end at 255 bytes. */
enum { MAX_NAME = 255 };

/* ---- reading --------------------------------------------------------------------------------- */

nebel_result nb_codec_prepare(const nebel_host *host, const char *name, nb_codec *codec)
{
    if (!nb_allocator_is_valid(&host->allocator))
        return nb_fail(&host->log, NEBEL_ERROR_ARGUMENT, "an allocator needs both its functions; one is NULL");
    *codec = (nb_codec){.allocator = nb_resolve_allocator(&host->allocator), .log = host->log, .name = name};
    return NEBEL_OK;
}

static nebel_result decode_image(const nb_codec *codec, const nb_bytes *bytes, nebel_image *image)
{
    if (nb_png_is(bytes)) return nb_png_read_image(codec, bytes, image);
    if (nb_exr_is(bytes)) return nb_exr_read_image(codec, bytes, image);
    return nb_fail(&codec->log, NEBEL_ERROR_FORMAT, "%s: neither a PNG nor an OpenEXR picture", codec->name);
}

static nebel_result read_image(const nb_codec *codec, nebel_image *image)
{
    nb_bytes bytes;
    nebel_result result =
        nb_file_read(&codec->allocator, &codec->log, NULL, "picture", codec->name, NB_FILE_LIMIT, &bytes);
    if (result != NEBEL_OK) return result;
    result = decode_image(codec, &bytes, image);
    nb_release(&codec->allocator, bytes.data);
    return result;
}

nebel_result nb_image_read(const nb_codec *codec, nebel_image *image)
{
    *image = (nebel_image){0};
    return read_image(codec, image);
}

nebel_result nebel_read_image(const char *path, const nebel_host *host, nebel_image *image)
{
    if (image != NULL) *image = (nebel_image){0};
    if (path == NULL || host == NULL || image == NULL) return NEBEL_ERROR_ARGUMENT;
    nb_codec codec;
    const nebel_result result = nb_codec_prepare(host, path, &codec);
    if (result != NEBEL_OK) return result;
    return read_image(&codec, image);
}

void nebel_free_image(const nebel_host *host, nebel_image *image)
{
    if (host == NULL || image == NULL || !nb_allocator_is_valid(&host->allocator)) return;
    const nebel_allocator allocator = nb_resolve_allocator(&host->allocator);
    nb_image_release(&allocator, image);
}

/* ---- writing --------------------------------------------------------------------------------- */

bool nb_image_ends_in(const char *path, const char *ending)
{
    const size_t size = strlen(path), length = strlen(ending);
    return size > length && strcasecmp(path + size - length, ending) == 0;
}

nebel_image_format nebel_get_image_format(const char *path)
{
    if (path == NULL) return NEBEL_IMAGE_NONE;
    if (nb_image_ends_in(path, ".png")) return NEBEL_IMAGE_PNG;
    if (nb_image_ends_in(path, ".exr")) return NEBEL_IMAGE_EXR;
    return nb_file_is_special(path) ? NEBEL_IMAGE_PNG : NEBEL_IMAGE_NONE;
}

static const char *find_fault(const nebel_image *image)
{
    if (image->width == 0 || image->height == 0 || image->channel_count == 0) return "it has no samples";
    if (image->samples == NULL || image->channel_names == NULL) return "its samples or channel_names are NULL";
    if (image->channel_count > NB_MAX_CHANNELS) return "it has more than 1024 channels";
    for (uint32_t i = 0; i < image->channel_count; i++) {
        const char *name = image->channel_names[i];
        if (name == NULL || name[0] == '\0') return "a channel has no name";
        if (strlen(name) > MAX_NAME) return "the name of a channel is longer than 255 bytes";
        if (nb_image_channel(image, name) != (int)i) return "two channels have the same name";
    }
    return NULL;
}

nebel_result nb_image_check(const nb_codec *codec, const nebel_image *image)
{
    const char *fault = find_fault(image);
    if (fault != NULL)
        return nb_fail(&codec->log, NEBEL_ERROR_ARGUMENT, "%s: the picture cannot be written: %s", codec->name, fault);
    return nb_codec_check_size(codec, image->width, image->height, image->channel_count);
}

nebel_result nb_codec_fail_ending(const nb_codec *codec)
{
    return nb_fail(&codec->log, NEBEL_ERROR_FORMAT, "%s: unknown picture format; the name must end in .png or .exr",
                   codec->name);
}

nebel_result nebel_check_image_path(const char *path, const nebel_host *host)
{
    if (path == NULL || host == NULL) return NEBEL_ERROR_ARGUMENT;
    nb_codec codec;
    const nebel_result result = nb_codec_prepare(host, path, &codec);
    if (result != NEBEL_OK) return result;
    if (nebel_get_image_format(path) == NEBEL_IMAGE_NONE) return nb_codec_fail_ending(&codec);
    return nb_file_try(&codec.allocator, &codec.log, path);
}
