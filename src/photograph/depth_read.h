/* Depth in files: numbers first, whatever they mean, then meters. */
#ifndef NB_PHOTOGRAPH_DEPTH_READ_H
#define NB_PHOTOGRAPH_DEPTH_READ_H

#include <nebel/photograph.h>

#include "image/image_codec.h"

/* What a file holds, as one of NEBEL_DEPTH_FILES_: bytes of 24 bits and 8 bits are numbers of 32, too. */
typedef struct nb_depth_numbers {
    uint32_t width, height;
    int files;
    uint16_t *shorts; /* of 16 bits */
    uint32_t *words;  /* of 24 and 8 bits */
    float *floats;
} nb_depth_numbers;

bool nb_npy_is(const nb_bytes *bytes);
bool nb_pfm_is(const nb_bytes *bytes);

/* The numbers are to be released by the caller, after an error, too. Errors: FORMAT, LIMIT, UNSUPPORTED, MEMORY. */
nebel_result nb_npy_read(const nb_codec *codec, const nb_bytes *bytes, nb_depth_numbers *numbers);
nebel_result nb_pfm_read(const nb_codec *codec, const nb_bytes *bytes, nb_depth_numbers *numbers);

/* Checks the size, and gives room for numbers of that kind. Errors: LIMIT, MEMORY. */
nebel_result nb_depth_allocate(const nb_codec *codec, uint64_t width, uint64_t height, int files,
                               nb_depth_numbers *numbers);

#endif
