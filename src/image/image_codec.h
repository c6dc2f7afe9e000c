/* Picture formats: bytes in memory to pixels and back. Each format lives in one file. */
#ifndef NB_IMAGE_IMAGE_CODEC_H
#define NB_IMAGE_IMAGE_CODEC_H

#include <nebel/scene.h>

#include "file/file.h"

#include <stdbool.h>
#include <string.h>

/* Who asks: whose memory, whose log, and the name of the picture in messages. */
typedef struct nb_codec {
    nebel_allocator allocator;
    nebel_log log;
    const char *name;
    uint64_t most_pixels; /* 0: NB_MAX_PIXELS */
    uint64_t room;        /* bytes that samples or voxels may take; 0: any */
    bool *is_full;        /* set where they would take more; NULL: nobody asks */
} nb_codec;

/* Larger pictures are refused before memory is asked for: pixels, and samples of all channels. */
#define NB_MAX_PIXELS ((uint64_t)1 << 28)
#define NB_MAX_SAMPLES ((uint64_t)1 << 30)
#define NB_MAX_CHANNELS 1024

/* A grey picture as whole numbers 0..max, top row first. */
typedef struct nb_heights {
    uint32_t width, height, max;
    uint16_t *values;
} nb_heights;

/* A picture as it is stored: 1 to 4 samples a pixel, of 8 bits, or of 16 in the machine's order. */
typedef struct nb_stored {
    uint32_t width, height;
    int bits, channel_count;
    unsigned char *pixels;
} nb_stored;

static inline bool nb_codec_is_little_endian(void)
{
    const uint16_t one = 1;
    unsigned char first;
    memcpy(&first, &one, 1);
    return first == 1;
}

/* FORMAT: the name has no ending that is known. */
nebel_result nb_codec_fail_ending(const nb_codec *codec);

/* Files are told apart by their first bytes. */
bool nb_png_is(const nb_bytes *bytes);
bool nb_exr_is(const nb_bytes *bytes);
bool nb_jpeg_is(const nb_bytes *bytes);

/* Errors: FORMAT, LIMIT, MEMORY, UNSUPPORTED; on an error the target is empty. `what` names heights in messages: "a
 * height map". What is stored has at least 8 bits; as a color it has 3 or 4 samples. */
nebel_result nb_png_read_image(const nb_codec *codec, const nb_bytes *bytes, nebel_image *image);
nebel_result nb_png_read_texture(const nb_codec *codec, const nb_bytes *bytes, nebel_texture *texture);
nebel_result nb_png_read_heights(const nb_codec *codec, const nb_bytes *bytes, const char *what, nb_heights *heights);
nebel_result nb_png_read_stored(const nb_codec *codec, const nb_bytes *bytes, bool as_color, nb_stored *stored);
nebel_result nb_jpeg_read_stored(const nb_codec *codec, const nb_bytes *bytes, nb_stored *stored);
nebel_result nb_jpeg_read_texture(const nb_codec *codec, const nb_bytes *bytes, nebel_texture *texture);
nebel_result nb_exr_read_image(const nb_codec *codec, const nb_bytes *bytes, nebel_image *image);

/* The picture in the regular file codec->name, whichever it is. Errors: FILE, FORMAT, LIMIT, MEMORY, UNSUPPORTED; it is empty then. */
nebel_result nb_image_read(const nb_codec *codec, nebel_image *image);

/* Gives the image memory for its samples, cleared, and copies of the names. Checks the limits. */
nebel_result nb_image_allocate(const nb_codec *codec, uint64_t width, uint64_t height, size_t channel_count,
                               const char *const *names, nebel_image *image);
void nb_image_release(const nebel_allocator *allocator, nebel_image *image);

/* Whether a name ends so, in capitals or not. */
bool nb_image_ends_in(const char *path, const char *ending);

/* Whether a picture of the caller's can be written. Errors: ARGUMENT, LIMIT. */
nebel_result nb_image_check(const nb_codec *codec, const nebel_image *image);

/* The index of a channel, or -1. */
int nb_image_channel(const nebel_image *image, const char *name);

/* Who asks, of the caller's own; the allocator has both functions or none. Errors: ARGUMENT. */
nebel_result nb_codec_prepare(const nebel_host *host, const char *name, nb_codec *codec);

/* The largest picture file: 8 GiB where sizes have 64 bits. */
#define NB_FILE_LIMIT (SIZE_MAX >> 31)

/* Errors: LIMIT. */
nebel_result nb_codec_check_room(const nb_codec *codec, uint64_t bytes);
nebel_result nb_codec_check_size(const nb_codec *codec, uint64_t width, uint64_t height, uint64_t channel_count);

#endif
