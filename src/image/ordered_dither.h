/* Samples from 0 to 1 as bytes, with an ordered rounding that keeps slow gradients of fog free of bands. */
#ifndef NB_IMAGE_ORDERED_DITHER_H
#define NB_IMAGE_ORDERED_DITHER_H

#include "image_codec.h"

/* The places of R, G and B among the channels; `what` needs them ("a PNG"). Errors: ARGUMENT. */
nebel_result nb_rounding_find_channels(const nb_codec *codec, const nebel_image *image, const char *what,
                                       int channels[3]);

/* Row y of the image, which is row `below` of the whole picture, as 3 bytes a pixel. What lies outside 0..1 is clamped, NaN is 0. */
void nb_rounding_fill_row(const nebel_image *image, const int channels[3], uint32_t y, uint32_t below,
                          unsigned char *row);

#endif
