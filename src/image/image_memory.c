/* The memory of pictures, and how large they may be. */
#include "image_codec.h"

#include <math.h>
#include <string.h>

nebel_result nb_codec_check_size(const nb_codec *codec, uint64_t width, uint64_t height, uint64_t channel_count)
{
    const uint64_t most = codec->most_pixels > 0 ? codec->most_pixels : NB_MAX_PIXELS;
    const bool fits = width <= most && height <= most && width * height <= most && channel_count <= NB_MAX_CHANNELS &&
                      width * height * channel_count <= NB_MAX_SAMPLES;
    if (fits) return NEBEL_OK;
    return nb_fail(
        &codec->log, NEBEL_ERROR_LIMIT,
        "%s: a picture of %llu x %llu pixels and %llu channels; at most 2^%d pixels, 2^30 samples, %d channels",
        codec->name, (unsigned long long)width, (unsigned long long)height, (unsigned long long)channel_count,
        (int)log2((double)most), NB_MAX_CHANNELS);
}

nebel_result nb_codec_check_room(const nb_codec *codec, uint64_t bytes)
{
    if (codec->room == 0 || bytes <= codec->room) return NEBEL_OK;
    if (codec->is_full != NULL) *codec->is_full = true;
    return nb_fail(&codec->log, NEBEL_ERROR_LIMIT,
                   "%s: takes %.0f MB; %.0f MB are left of what the scene may take (nebel: --memory)", codec->name,
                   (double)bytes / 1048576, floor((double)codec->room / 1048576));
}

/* Pointers and names share one block. */
static const char *const *copy_names(const nebel_allocator *allocator, size_t count, const char *const *names)
{
    size_t size = count * sizeof *names;
    for (size_t i = 0; i < count; i++) size += strlen(names[i]) + 1;
    const char **copy = nb_allocate(allocator, size, 1);
    if (copy == NULL) return NULL;
    char *at = (char *)(copy + count);
    for (size_t i = 0; i < count; i++) {
        const size_t length = strlen(names[i]) + 1;
        copy[i] = memcpy(at, names[i], length);
        at += length;
    }
    return copy;
}

nebel_result nb_image_allocate(const nb_codec *codec, uint64_t width, uint64_t height, size_t channel_count,
                               const char *const *names, nebel_image *image)
{
    *image = (nebel_image){0};
    nebel_result result = nb_codec_check_size(codec, width, height, channel_count);
    if (result == NEBEL_OK) result = nb_codec_check_room(codec, width * height * channel_count * sizeof(float));
    if (result != NEBEL_OK) return result;
    image->width = (uint32_t)width;
    image->height = (uint32_t)height;
    image->channel_count = (uint32_t)channel_count;
    image->channel_names = copy_names(&codec->allocator, channel_count, names);
    image->samples = nb_allocate_zero(&codec->allocator, (size_t)(width * height) * channel_count, sizeof(float));
    if (image->channel_names != NULL && image->samples != NULL) return NEBEL_OK;
    nb_image_release(&codec->allocator, image);
    return nb_fail(&codec->log, NEBEL_ERROR_MEMORY, "%s: out of memory", codec->name);
}

void nb_image_release(const nebel_allocator *allocator, nebel_image *image)
{
    nb_release(allocator, (void *)image->channel_names);
    nb_release(allocator, image->samples);
    *image = (nebel_image){0};
}

int nb_image_channel(const nebel_image *image, const char *name)
{
    for (uint32_t i = 0; i < image->channel_count; i++)
        if (strcmp(image->channel_names[i], name) == 0) return (int)i;
    return -1;
}
