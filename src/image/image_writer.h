/* Pictures to files from the top down, a few rows at a time. */
#ifndef NB_IMAGE_IMAGE_WRITER_H
#define NB_IMAGE_IMAGE_WRITER_H

#include "image_codec.h"

/* What a picture will be. */
typedef struct nb_picture_plan {
    uint32_t width, height, channel_count;
    const char *const *channel_names;
    const char *record; /* NULL: none */
} nb_picture_plan;

/* The name of the record in files: key of PNG's text, attribute of OpenEXR. */
#define NB_RECORD_KEY "nebel_record"

/* Whether a record is printable and not too long, so that every format can keep it. NULL is fine. Errors: ARGUMENT. */
nebel_result nb_record_check(const nb_codec *codec, const char *record);

/* Rows that come at once: all but the last time a multiple of this, so that no compressed block of OpenEXR is cut. */
enum { NB_WRITER_ROWS = 64 };

/* The same for each format. What `begin` gives, also after an error, free with nb_NAME_write_free; `codec` and `sink`
 * stay until then. FILE without a message: the sink has failed. Errors: ARGUMENT, FILE, LIMIT, MEMORY. */
typedef struct nb_png_encoder nb_png_encoder;
nebel_result nb_png_write_begin(const nb_codec *codec, const nb_picture_plan *plan, nb_sink *sink,
                                nb_png_encoder **encoder);
nebel_result nb_png_write_rows(nb_png_encoder *encoder, const nebel_image *rows);
nebel_result nb_png_write_end(nb_png_encoder *encoder);
void nb_png_write_free(nb_png_encoder *encoder); /* NULL is fine */

/* All of a picture as it is stored: color is sRGB, grey is linear. `record` may be NULL. */
nebel_result nb_png_write_stored(const nb_codec *codec, const nb_stored *stored, const char *record, nb_sink *sink);

typedef struct nb_exr_encoder nb_exr_encoder;
nebel_result nb_exr_write_begin(const nb_codec *codec, const nb_picture_plan *plan, nb_sink *sink,
                                nb_exr_encoder **encoder);
nebel_result nb_exr_write_rows(nb_exr_encoder *encoder, const nebel_image *rows);
nebel_result nb_exr_write_end(nb_exr_encoder *encoder);
void nb_exr_write_free(nb_exr_encoder *encoder);

#endif
