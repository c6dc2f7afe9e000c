/* Films: where they go, and when each picture is seen. */
#include "movie.h"
#include "image_writer.h"

#include <limits.h>
#include <math.h>
#include <string.h>

/* The film is in memory until it is finished; hours of work are not begun, and not gone on with, where there is no room for the
 * file of the fewest pictures, and then of a part of what there are. */
enum { LEAST_ROOM = 1 << 14, PICTURE_ROOM = 1 << 12 };

struct nebel_movie {
    nb_codec codec;
    char *path;
    double rate;
    int quality;
    uint32_t width, height; /* of the first picture */
    uint64_t count;
    nb_webp *webp; /* NULL before the first picture */
    bool is_finished;
    char record[NEBEL_MAX_RECORD + 1]; /* "": none */
};

int nebel_is_movie_path(const char *path)
{
    return path != NULL && nb_image_ends_in(path, ".webp");
}

static nebel_result check_desc(const nb_codec *codec, const nebel_movie_desc *desc)
{
    const double rate = desc->frames_per_second;
    if (!nb_allocator_is_valid(&desc->host.allocator))
        return nb_fail(&desc->host.log, NEBEL_ERROR_ARGUMENT, "an allocator needs both its functions; one is NULL");
    if (rate != 0 && !(rate >= 1 && rate <= NEBEL_MAX_MOVIE_RATE))
        return nb_fail(&desc->host.log, NEBEL_ERROR_VALUE, "%s: %g pictures a second; must be 1 to %d", codec->name,
                       rate, NEBEL_MAX_MOVIE_RATE);
    if (desc->quality < 0 || desc->quality > 100)
        return nb_fail(&desc->host.log, NEBEL_ERROR_VALUE, "%s: a quality of %d; must be 1 to 100", codec->name,
                       desc->quality);
    if (!nebel_is_movie_path(codec->name))
        return nb_fail(&desc->host.log, NEBEL_ERROR_FORMAT, "%s: unknown film format; the name must end in .webp",
                       codec->name);
    if (!nb_webp_is_built())
        return nb_fail(&desc->host.log, NEBEL_ERROR_UNSUPPORTED,
                       "%s: this nebel was built without WebP; build it with libwebp (Debian: libwebp-dev), or write "
                       "numbered PNG pictures",
                       codec->name);
    return NEBEL_OK;
}

nebel_result nebel_create_movie(const char *path, const nebel_movie_desc *desc, nebel_movie **film)
{
    if (film != NULL) *film = NULL;
    if (path == NULL || desc == NULL || film == NULL) return NEBEL_ERROR_ARGUMENT;
    const nb_codec codec = {
        .allocator = nb_resolve_allocator(&desc->host.allocator), .log = desc->host.log, .name = path};
    nebel_result result = check_desc(&codec, desc);
    if (result == NEBEL_OK) result = nb_file_try_room(&codec.allocator, &codec.log, path, LEAST_ROOM);
    if (result != NEBEL_OK) return result;
    nebel_movie *made = nb_allocate_zero(&codec.allocator, 1, sizeof *made + strlen(path) + 1);
    if (made == NULL) return nb_fail(&desc->host.log, NEBEL_ERROR_MEMORY, "%s: out of memory", path);
    made->path = strcpy((char *)(made + 1), path);
    made->codec = codec;
    made->codec.name = made->path;
    made->rate = desc->frames_per_second == 0 ? NEBEL_DEFAULT_MOVIE_RATE : desc->frames_per_second;
    made->quality = desc->quality == 0 ? NEBEL_DEFAULT_MOVIE_QUALITY : desc->quality;
    *film = made;
    return NEBEL_OK;
}

/* Milliseconds are whole in the file; rounded so, pictures do not drift from their time. */
static double start_of(const nebel_movie *film, uint64_t number)
{
    return floor(1000 * (double)number / film->rate + 0.5);
}

static nebel_result check_picture(nebel_movie *film, const nebel_image *image)
{
    const nb_codec *codec = &film->codec;
    if (film->is_finished)
        return nb_fail(&codec->log, NEBEL_ERROR_ARGUMENT, "%s: the film is finished already", codec->name);
    const nebel_result result = nb_image_check(codec, image);
    if (result != NEBEL_OK) return result;
    if (film->count > 0 && (image->width != film->width || image->height != film->height))
        return nb_fail(&codec->log, NEBEL_ERROR_ARGUMENT,
                       "%s: a picture of %u x %u pixels; those before it have %u x %u", codec->name,
                       (unsigned)image->width, (unsigned)image->height, (unsigned)film->width, (unsigned)film->height);
    if (start_of(film, film->count + 1) > INT_MAX)
        return nb_fail(&codec->log, NEBEL_ERROR_LIMIT, "%s: a WebP lasts at most %d ms", codec->name, INT_MAX);
    return NEBEL_OK;
}

nebel_result nebel_add_movie_frame(nebel_movie *film, const nebel_image *image)
{
    if (film == NULL || image == NULL) return NEBEL_ERROR_ARGUMENT;
    nebel_result result = check_picture(film, image);
    if (result == NEBEL_OK)
        result = nb_file_try_room(&film->codec.allocator, &film->codec.log, film->path,
                                  LEAST_ROOM + PICTURE_ROOM * (size_t)film->count);
    if (result == NEBEL_OK && film->webp == NULL) {
        film->width = image->width;
        film->height = image->height;
        result = nb_webp_begin(&film->codec, image->width, image->height, film->quality, &film->webp);
    }
    if (result == NEBEL_OK) result = nb_webp_add(film->webp, image, (int)start_of(film, film->count));
    if (result == NEBEL_OK) film->count++;
    return result;
}

nebel_result nebel_set_movie_record(nebel_movie *film, const char *record)
{
    if (film == NULL || record == NULL) return NEBEL_ERROR_ARGUMENT;
    const nebel_result result = nb_record_check(&film->codec, record);
    if (result == NEBEL_OK) memcpy(film->record, record, strlen(record) + 1);
    return result;
}

static void put_number(uint32_t number, unsigned char bytes[4])
{
    for (int i = 0; i < 4; i++) bytes[i] = (unsigned char)(number >> 8 * i);
}

/* The size in the first header counts all that follows it. */
static void write_record(const nebel_movie *film, nb_sink *sink)
{
    unsigned char chunk[8 + NEBEL_MAX_RECORD + 1] = NB_FILM_RECORD, size[4];
    const size_t length = strlen(film->record);
    put_number((uint32_t)length, chunk + 4);
    memcpy(chunk + 8, film->record, length);
    nb_sink_write(sink, nb_sink_size(sink), chunk, 8 + length + length % 2);
    put_number((uint32_t)(nb_sink_size(sink) - 8), size);
    nb_sink_write(sink, 4, size, sizeof size);
}

static nebel_result write_film(const nebel_movie *film, const nb_bytes *bytes)
{
    const nb_codec *codec = &film->codec;
    nb_sink *sink;
    nebel_result result = nb_sink_open(&codec->allocator, &codec->log, film->path, &sink);
    if (result != NEBEL_OK) return result;
    nb_sink_write(sink, 0, bytes->data, bytes->size);
    if (film->record[0] != '\0') write_record(film, sink);
    result = nb_sink_finish(sink);
    nb_sink_close(sink);
    return result;
}

nebel_result nebel_finish_movie(nebel_movie *film)
{
    nb_bytes bytes;
    if (film == NULL) return NEBEL_ERROR_ARGUMENT;
    const nb_codec *codec = &film->codec;
    if (film->count == 0 || film->is_finished)
        return nb_fail(&codec->log, NEBEL_ERROR_ARGUMENT, "%s: the film %s", codec->name,
                       film->is_finished ? "is finished already" : "has no pictures");
    film->is_finished = true;
    const nebel_result result = nb_webp_end(film->webp, (int)start_of(film, film->count), &bytes);
    return result == NEBEL_OK ? write_film(film, &bytes) : result;
}

void nebel_destroy_movie(nebel_movie *film)
{
    if (film == NULL) return;
    const nebel_allocator allocator = film->codec.allocator;
    nb_webp_free(film->webp);
    nb_release(&allocator, film);
}
