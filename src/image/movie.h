/* What makes a file of a film's pictures. */
#ifndef NB_IMAGE_MOVIE_H
#define NB_IMAGE_MOVIE_H

#include "image_codec.h"

typedef struct nb_webp nb_webp;

/* The chunk of a film's record, the last one. Readers of WebP pass over chunks that they do not know. */
#define NB_FILM_RECORD "NBLR"

/* Whether libwebp is in this build; without it the rest answers UNSUPPORTED. */
bool nb_webp_is_built(void);

/* `codec` stays until nb_webp_free. The quality is from 1 to 100, which is lossless. libwebp's memory is its own, not
 * the allocator's. Errors: LIMIT, MEMORY, UNSUPPORTED. */
nebel_result nb_webp_begin(const nb_codec *codec, uint32_t width, uint32_t height, int quality, nb_webp **film);

/* A picture of the film's size, from this millisecond on. Errors: ARGUMENT, MEMORY. */
nebel_result nb_webp_add(nb_webp *film, const nebel_image *image, int start);

/* The whole file, whose last picture ends at this millisecond; it is the film's. Errors: MEMORY. */
nebel_result nb_webp_end(nb_webp *film, int end, nb_bytes *bytes);

/* NULL is fine. */
void nb_webp_free(nb_webp *film);

#endif
