/* Animated WebP out: the only place that knows libwebp, which a build may lack. */
#include "movie.h"
#include "ordered_dither.h"

#if defined(NEBEL_HAVE_WEBP)

#include <stdint.h>
#include <string.h>
#include <webp/encode.h>
#include <webp/mux.h>

struct nb_webp {
    const nb_codec *codec;
    WebPConfig config;
    WebPPicture picture;
    WebPAnimEncoder *encoder;
    WebPData file;
    unsigned char *row;
};

bool nb_webp_is_built(void)
{
    return true;
}

static nebel_result fail_memory(const nb_codec *codec)
{
    return nb_fail(&codec->log, NEBEL_ERROR_MEMORY, "%s: out of memory for the film", codec->name);
}

/* What libwebp says is a constant of its own, and nearly always memory. */
static nebel_result fail_encoder(nb_webp *film)
{
    const nb_codec *codec = film->codec;
    const WebPEncodingError error = film->picture.error_code;
    if (error == VP8_ENC_ERROR_OUT_OF_MEMORY || error == VP8_ENC_ERROR_BITSTREAM_OUT_OF_MEMORY)
        return fail_memory(codec);
    return nb_fail(&codec->log, NEBEL_ERROR_MEMORY, "%s: libwebp cannot make the film: %s", codec->name,
                   WebPAnimEncoderGetError(film->encoder));
}

/* Without loss 70 is the effort, of which more brings hardly any bytes. */
static bool configure(nb_webp *film, int quality)
{
    WebPConfig *config = &film->config;
    if (!WebPConfigInit(config)) return false;
    config->lossless = quality == 100;
    config->quality = config->lossless ? 70 : (float)quality;
    config->exact = 1;
    return WebPValidateConfig(config) != 0;
}

/* Every picture is whole: where one is made of the one before, what has hardly changed is left as it was, so that
 * slow fog moves in patches. Without loss nothing is left that has changed. */
static bool open_webp_encoder(nb_webp *film, uint32_t width, uint32_t height)
{
    WebPAnimEncoderOptions options;
    if (!WebPAnimEncoderOptionsInit(&options)) return false;
    if (!film->config.lossless) options.kmax = 1;
    film->encoder = WebPAnimEncoderNew((int)width, (int)height, &options);
    if (film->encoder == NULL || !WebPPictureInit(&film->picture)) return false;
    film->picture.use_argb = 1;
    film->picture.width = (int)width;
    film->picture.height = (int)height;
    return WebPPictureAlloc(&film->picture) != 0;
}

nebel_result nb_webp_begin(const nb_codec *codec, uint32_t width, uint32_t height, int quality, nb_webp **film)
{
    *film = NULL;
    if (width > WEBP_MAX_DIMENSION || height > WEBP_MAX_DIMENSION)
        return nb_fail(&codec->log, NEBEL_ERROR_LIMIT, "%s: a picture of %u x %u pixels; a WebP has at most %d x %d",
                       codec->name, (unsigned)width, (unsigned)height, WEBP_MAX_DIMENSION, WEBP_MAX_DIMENSION);
    nb_webp *made = nb_allocate_zero(&codec->allocator, 1, sizeof *made);
    if (made == NULL) return fail_memory(codec);
    made->codec = codec;
    made->row = nb_allocate(&codec->allocator, width, 3);
    *film = made;
    if (made->row != NULL && configure(made, quality) && open_webp_encoder(made, width, height)) return NEBEL_OK;
    nb_webp_free(made);
    *film = NULL;
    return fail_memory(codec);
}

nebel_result nb_webp_add(nb_webp *film, const nebel_image *image, int start)
{
    int channels[3];
    const nebel_result result = nb_rounding_find_channels(film->codec, image, "a WebP", channels);
    if (result != NEBEL_OK) return result;
    /* The encoder hands out the pixels of subsampled colours in the same picture. */
    film->picture.use_argb = 1;
    for (uint32_t y = 0; y < image->height; y++) {
        uint32_t *to = film->picture.argb + (size_t)y * (size_t)film->picture.argb_stride;
        nb_rounding_fill_row(image, channels, y, y, film->row);
        for (uint32_t x = 0; x < image->width; x++) {
            const unsigned char *from = film->row + 3 * (size_t)x;
            to[x] = UINT32_C(0xff000000) | (uint32_t)from[0] << 16 | (uint32_t)from[1] << 8 | from[2];
        }
    }
    return WebPAnimEncoderAdd(film->encoder, &film->picture, start, &film->config) ? NEBEL_OK : fail_encoder(film);
}

nebel_result nb_webp_end(nb_webp *film, int end, nb_bytes *bytes)
{
    *bytes = (nb_bytes){0};
    WebPDataClear(&film->file);
    if (!WebPAnimEncoderAdd(film->encoder, NULL, end, NULL) || !WebPAnimEncoderAssemble(film->encoder, &film->file))
        return fail_encoder(film);
    *bytes = (nb_bytes){.data = (unsigned char *)film->file.bytes, .size = film->file.size};
    return NEBEL_OK;
}

void nb_webp_free(nb_webp *film)
{
    if (film == NULL) return;
    WebPDataClear(&film->file);
    WebPPictureFree(&film->picture);
    WebPAnimEncoderDelete(film->encoder);
    nb_release(&film->codec->allocator, film->row);
    nb_release(&film->codec->allocator, film);
}

#else

bool nb_webp_is_built(void)
{
    return false;
}

nebel_result nb_webp_begin(const nb_codec *codec, uint32_t width, uint32_t height, int quality, nb_webp **film)
{
    (void)codec, (void)width, (void)height, (void)quality;
    *film = NULL;
    return NEBEL_ERROR_UNSUPPORTED;
}

nebel_result nb_webp_add(nb_webp *film, const nebel_image *image, int start)
{
    (void)film, (void)image, (void)start;
    return NEBEL_ERROR_UNSUPPORTED;
}

nebel_result nb_webp_end(nb_webp *film, int end, nb_bytes *bytes)
{
    (void)film, (void)end;
    *bytes = (nb_bytes){0};
    return NEBEL_ERROR_UNSUPPORTED;
}

void nb_webp_free(nb_webp *film)
{
    (void)film;
}

#endif
