#include "ordered_dither.h"

nebel_result nb_rounding_find_channels(const nb_codec *codec, const nebel_image *image, const char *what,
                                       int channels[3])
{
    static const char *const names[] = {"R", "G", "B"};
    for (int c = 0; c < 3; c++) {
        channels[c] = nb_image_channel(image, names[c]);
        if (channels[c] < 0)
            return nb_fail(&codec->log, NEBEL_ERROR_ARGUMENT, "%s: %s needs the channels R, G and B; %s is absent",
                           codec->name, what, names[c]);
    }
    return NEBEL_OK;
}

/* B. Bayer's matrix of 8 x 8 (1973): the bits of x ^ y and y, interleaved and reversed. Within (0, 1), so that a value
 * that is a multiple of 1/255 keeps its number. */
static float threshold(uint32_t x, uint32_t y)
{
    const uint32_t a = x ^ y;
    uint32_t rank = 0;
    for (uint32_t bit = 0; bit < 3; bit++) rank = rank << 2 | ((a >> bit & 1) << 1) | (y >> bit & 1);
    return ((float)rank + 0.5f) / 64.0f;
}

static unsigned char quantize(float value, float rounding)
{
    if (!(value > 0)) return 0;
    const float scaled = (value < 1 ? value : 1) * 255.0f + rounding;
    return (unsigned char)(scaled < 255.0f ? scaled : 255.0f);
}

void nb_rounding_fill_row(const nebel_image *image, const int channels[3], uint32_t y, uint32_t below,
                          unsigned char *row)
{
    const float *samples = image->samples + (size_t)y * image->width * image->channel_count;
    for (uint32_t x = 0; x < image->width; x++) {
        const float rounding = threshold(x, below);
        for (int c = 0; c < 3; c++) row[3 * (size_t)x + (size_t)c] = quantize(samples[channels[c]], rounding);
        samples += image->channel_count;
    }
}
