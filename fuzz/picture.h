/* What the fuzzers of picture formats share. */
#ifndef NB_FUZZ_PICTURE_H
#define NB_FUZZ_PICTURE_H

#include "image/image_codec.h"

#include "witness.h"

#include <stdint.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

/* Larger pictures would be fuzzing of memset. */
enum { MOST_PIXELS = 1 << 20 };

static inline nb_codec witness_codec(witness *seen)
{
    return (nb_codec){.allocator = {witness_allocate, witness_release, seen},
                      .log = {witness_message, seen},
                      .name = "fuzz",
                      .most_pixels = MOST_PIXELS};
}

static inline void check_end(const witness *seen, nebel_result result)
{
    demand((result == NEBEL_OK) == (seen->messages == 0));
    demand(seen->allocations == 0);
}

static inline void check_image(nebel_result (*read)(const nb_codec *, const nb_bytes *, nebel_image *),
                               const nb_bytes *bytes)
{
    witness seen = {0};
    nebel_image image = {0};
    const nb_codec codec = witness_codec(&seen);
    const nebel_result result = read(&codec, bytes, &image);
    demand((result == NEBEL_OK) == (image.samples != NULL));
    if (result == NEBEL_OK) {
        demand((uint64_t)image.width * image.height <= MOST_PIXELS && image.channel_count > 0);
        for (uint32_t i = 0; i < image.channel_count; i++)
            demand(nb_image_channel(&image, image.channel_names[i]) >= 0);
        /* The last sample is there. */
        volatile float last = image.samples[(size_t)image.width * image.height * image.channel_count - 1];
        (void)last;
    }
    nb_image_release(&codec.allocator, &image);
    check_end(&seen, result);
}

static inline void check_texture(nebel_result (*read)(const nb_codec *, const nb_bytes *, nebel_texture *),
                                 const nb_bytes *bytes)
{
    witness seen = {0};
    nebel_texture texture = {0};
    const nb_codec codec = witness_codec(&seen);
    const nebel_result result = read(&codec, bytes, &texture);
    demand((result == NEBEL_OK) == (texture.rgba != NULL));
    if (result == NEBEL_OK) {
        volatile unsigned char last = texture.rgba[4 * (size_t)texture.width * texture.height - 1];
        (void)last;
    }
    nb_release(&codec.allocator, (void *)texture.rgba);
    check_end(&seen, result);
}

static inline void check_heights(const nb_bytes *bytes)
{
    witness seen = {0};
    nb_heights heights = {0};
    const nb_codec codec = witness_codec(&seen);
    const nebel_result result = nb_png_read_heights(&codec, bytes, "heights", &heights);
    demand((result == NEBEL_OK) == (heights.values != NULL));
    for (size_t i = 0; result == NEBEL_OK && i < (size_t)heights.width * heights.height; i++)
        demand(heights.values[i] <= heights.max);
    nb_release(&codec.allocator, heights.values);
    check_end(&seen, result);
}

#endif
