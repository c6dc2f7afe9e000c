/* Depth from files: numbers, and what the format makes of them. */
#include "depth_read.h"

#include <float.h>
#include <math.h>
#include <stdio.h>

/* From here on floats are infinite: programs that render write 1e10 and the like where nothing is. */
#define ENDLESS 1e9

/* ---- numbers --------------------------------------------------------------------------------- */

nebel_result nb_depth_allocate(const nb_codec *codec, uint64_t width, uint64_t height, int files,
                               nb_depth_numbers *numbers)
{
    const nebel_result result = nb_codec_check_size(codec, width, height, 4);
    if (result != NEBEL_OK) return result;
    const size_t count = (size_t)(width * height);
    void *memory = nb_allocate(&codec->allocator, count, files == NEBEL_DEPTH_FILES_16_BIT ? 2 : 4);
    if (memory == NULL) return nb_fail(&codec->log, NEBEL_ERROR_MEMORY, "%s: out of memory", codec->name);
    numbers->width = (uint32_t)width;
    numbers->height = (uint32_t)height;
    numbers->files = files;
    if (files == NEBEL_DEPTH_FILES_16_BIT)
        numbers->shorts = memory;
    else if (files == NEBEL_DEPTH_FILES_FLOAT)
        numbers->floats = memory;
    else
        numbers->words = memory;
    return NEBEL_OK;
}

static void release_numbers(const nb_codec *codec, nb_depth_numbers *numbers)
{
    nb_release(&codec->allocator, numbers->shorts);
    nb_release(&codec->allocator, numbers->words);
    nb_release(&codec->allocator, numbers->floats);
}

static nebel_result read_png(const nb_codec *codec, const nb_bytes *bytes, nb_depth_numbers *numbers)
{
    nb_stored stored;
    nebel_result result = nb_png_read_stored(codec, bytes, false, &stored);
    if (result != NEBEL_OK) return result;
    const int channels = stored.channel_count;
    if (stored.bits == 16 && channels == 1) { /* as it is */
        *numbers = (nb_depth_numbers){
            stored.width, stored.height, NEBEL_DEPTH_FILES_16_BIT, (uint16_t *)(void *)stored.pixels, NULL, NULL};
        return NEBEL_OK;
    }
    if (stored.bits == 8 && channels != 2) {
        const int files = channels == 1 ? NEBEL_DEPTH_FILES_8_BIT : NEBEL_DEPTH_FILES_24_BIT;
        result = nb_depth_allocate(codec, stored.width, stored.height, files, numbers);
        const size_t count = result == NEBEL_OK ? (size_t)stored.width * stored.height : 0;
        for (size_t i = 0; i < count; i++) {
            const unsigned char *at = stored.pixels + i * (size_t)channels;
            numbers->words[i] = channels == 1 ? at[0] : at[0] | (uint32_t)at[1] << 8 | (uint32_t)at[2] << 16;
        }
    } else {
        result = nb_fail(&codec->log, NEBEL_ERROR_UNSUPPORTED,
                         "%s: depth in PNG is gray of 16 or 8 bits, without alpha, or RGB of 8 bits; convert it",
                         codec->name);
    }
    nb_release(&codec->allocator, stored.pixels);
    return result;
}

static nebel_result fail_channel(const nb_codec *codec, const nebel_image *image, const char *wanted)
{
    char list[256] = "";
    size_t used = 0;
    for (uint32_t i = 0; i < image->channel_count && used + 80 < sizeof list; i++)
        used += (size_t)snprintf(list + used, sizeof list - used, " %.60s", image->channel_names[i]);
    if (wanted != NULL)
        return nb_fail(&codec->log, NEBEL_ERROR_FORMAT, "%s: there is no channel %s; it has%s", codec->name, wanted,
                       list);
    return nb_fail(&codec->log, NEBEL_ERROR_FORMAT,
                   "%s: which channel is depth? None is called Z or depth.Z (nebel fog: --depth-channel); it has%s",
                   codec->name, list);
}

static nebel_result read_exr(const nb_codec *codec, const nb_bytes *bytes, const char *wanted,
                             nb_depth_numbers *numbers)
{
    nebel_image image;
    nebel_result result = nb_exr_read_image(codec, bytes, &image);
    if (result != NEBEL_OK) return result;
    int channel = nb_image_channel(&image, wanted != NULL ? wanted : "Z");
    if (channel < 0 && wanted == NULL) channel = nb_image_channel(&image, "depth.Z");
    if (channel < 0 && wanted == NULL && image.channel_count == 1) channel = 0;
    if (channel < 0)
        result = fail_channel(codec, &image, wanted);
    else
        result = nb_depth_allocate(codec, image.width, image.height, NEBEL_DEPTH_FILES_FLOAT, numbers);
    const size_t count = result == NEBEL_OK ? (size_t)image.width * image.height : 0;
    for (size_t i = 0; i < count; i++) numbers->floats[i] = image.samples[i * image.channel_count + (size_t)channel];
    nb_image_release(&codec->allocator, &image);
    return result;
}

static nebel_result read_depth_numbers(const nb_codec *codec, const nb_bytes *bytes, const char *channel,
                                       nb_depth_numbers *numbers)
{
    if (nb_png_is(bytes)) return read_png(codec, bytes, numbers);
    if (nb_exr_is(bytes)) return read_exr(codec, bytes, channel, numbers);
    if (nb_npy_is(bytes)) return nb_npy_read(codec, bytes, numbers);
    if (nb_pfm_is(bytes)) return nb_pfm_read(codec, bytes, numbers);
    if (bytes->size >= 8 && memcmp(bytes->data, "\x89HDF\r\n\x1a\n", 8) == 0)
        return nb_fail(&codec->log, NEBEL_ERROR_UNSUPPORTED,
                       "%s: HDF5 is not read; with Python: numpy.save(\"depth.npy\", h5py.File(name)[\"dataset\"][:])",
                       codec->name);
    return nb_fail(&codec->log, NEBEL_ERROR_FORMAT, "%s: depth is a PNG, OpenEXR, NPY or PFM; this is none",
                   codec->name);
}

/* ---- meters ---------------------------------------------------------------------------------- */

/* What becomes of numbers. */
typedef struct rule {
    nebel_depth_measure measure;
    double scale, offset;
    double pull; /* of disparity: baseline times focal length */
    int64_t invalid, infinite;
} rule;

static float meters_of(const rule *r, double number)
{
    const double value = number * r->scale + r->offset;
    switch (r->measure) {
    case NEBEL_MEASURE_INVERSE:
        return value > 0 ? (float)(1 / value) : value == 0 ? INFINITY : NAN;
    case NEBEL_MEASURE_DISPARITY:
        return value > 0 ? (float)(r->pull / value) : NAN;
    default:
        return value > 0 ? (float)value : NAN;
    }
}

static float meters_of_whole(const rule *r, int64_t number)
{
    if (number == r->invalid) return NAN;
    if (number == r->infinite) return INFINITY;
    return meters_of(r, (double)number);
}

static float meters_of_float(const rule *r, float number)
{
    if (isinf(number) && number > 0)
        return r->measure == NEBEL_MEASURE_INVERSE || r->measure == NEBEL_MEASURE_DISPARITY ? NAN : INFINITY;
    const float meters = meters_of(r, (double)number);
    return (double)meters >= ENDLESS ? INFINITY : meters;
}

static nebel_result convert_depth(const nb_codec *codec, const nb_depth_numbers *numbers, const rule *r, float *depth)
{
    enum { SHORTS = 65536 };
    const size_t count = (size_t)numbers->width * numbers->height;
    for (size_t i = 0; i < count && numbers->words != NULL; i++) depth[i] = meters_of_whole(r, numbers->words[i]);
    for (size_t i = 0; i < count && numbers->floats != NULL; i++) depth[i] = meters_of_float(r, numbers->floats[i]);
    if (numbers->shorts == NULL) return NEBEL_OK;
    float *table = nb_allocate(&codec->allocator, SHORTS, sizeof *table);
    if (table == NULL) return nb_fail(&codec->log, NEBEL_ERROR_MEMORY, "%s: out of memory", codec->name);
    for (int i = 0; i < SHORTS; i++) table[i] = meters_of_whole(r, i);
    for (size_t i = 0; i < count; i++) depth[i] = table[numbers->shorts[i]];
    nb_release(&codec->allocator, table);
    return NEBEL_OK;
}

/* ---- the format ------------------------------------------------------------------------------ */

static nebel_result check_files(const nb_codec *codec, const nebel_depth_format *format,
                                const nebel_depth_source *source, const nb_depth_numbers *numbers)
{
    static const struct {
        int files;
        const char *name;
    } names[] = {{NEBEL_DEPTH_FILES_16_BIT, "whole numbers of 16 bits, gray"},
                 {NEBEL_DEPTH_FILES_24_BIT, "RGB of 8 bits"},
                 {NEBEL_DEPTH_FILES_FLOAT, "floats"},
                 {NEBEL_DEPTH_FILES_8_BIT, "whole numbers of 8 bits, gray"}};
    const char *has = "";
    char wants[128] = "";
    for (size_t i = 0; i < sizeof names / sizeof *names; i++) {
        const size_t size = strlen(wants);
        if (names[i].files == numbers->files) has = names[i].name;
        if (names[i].files & format->files)
            (void)snprintf(wants + size, sizeof wants - size, "%s%s", size > 0 ? " or " : "", names[i].name);
    }
    if (!(format->files & numbers->files))
        return nb_fail(&codec->log, NEBEL_ERROR_FORMAT,
                       "%s: it holds %s, but depth of %s is %s; choose another format (nebel fog: --depth-format)",
                       codec->name, has, format->name, wants);
    if (format == nebel_depth_format_at(0) && numbers->floats == NULL && !(source->scale > 0))
        return nb_fail(&codec->log, NEBEL_ERROR_VALUE,
                       "%s: it holds %s, whose size in meters nobody knows; choose a format or give the scale "
                       "(nebel fog: --depth-format, --depth-scale)",
                       codec->name, has);
    return NEBEL_OK;
}

static nebel_result check_source(const nb_codec *codec, const nebel_depth_source *source,
                                 const nebel_depth_format *format)
{
    if (format == NULL)
        return nb_fail(&codec->log, NEBEL_ERROR_ARGUMENT, "%s: there is no depth format \"%s\"", codec->name,
                       source->format);
    if (!(source->scale >= 0 && source->scale <= 1e9) || (source->scale > 0 && format != nebel_depth_format_at(0)))
        return nb_fail(&codec->log, NEBEL_ERROR_ARGUMENT,
                       "%s: a scale of depth is more than 0, at most 1e9 and of the format metric alone", codec->name);
    if (source->measure != NEBEL_MEASURE_OF_FORMAT && format->measure == NEBEL_MEASURE_DISPARITY &&
        source->measure != format->measure)
        return nb_fail(&codec->log, NEBEL_ERROR_ARGUMENT, "%s: %s is disparity and nothing else", codec->name,
                       format->name);
    return NEBEL_OK;
}

static nebel_result make_rule(const nb_codec *codec, const nebel_depth_source *source, const nebel_depth_format *format,
                              rule *r)
{
    *r = (rule){.measure = source->measure != NEBEL_MEASURE_OF_FORMAT ? source->measure : format->measure,
                .scale = source->scale > 0 ? source->scale : format->scale,
                .offset = format->offset,
                .invalid = format->invalid,
                .infinite = format->infinite};
    if (r->measure == NEBEL_MEASURE_INVERSE) r->invalid = -1;
    if (r->measure != NEBEL_MEASURE_DISPARITY) return NEBEL_OK;
    r->pull = source->camera != NULL ? source->camera->baseline * source->camera->fx : 0;
    if (r->pull > 0 && r->pull < HUGE_VAL) return NEBEL_OK;
    return nb_fail(&codec->log, NEBEL_ERROR_VALUE,
                   "%s: disparity needs the camera's focal length and the baseline of the pair, more than 0 "
                   "(nebel fog: --camera, such as Cityscapes' *_camera.json)",
                   codec->name);
}

static nebel_result count_known(const nb_codec *codec, nebel_depth_map *map)
{
    const size_t count = (size_t)map->width * map->height;
    for (size_t i = 0; i < count; i++) {
        map->unknown_count += map->depth[i] != map->depth[i];
        map->infinite_count += map->depth[i] > FLT_MAX;
    }
    if (map->unknown_count < count) return NEBEL_OK;
    return nb_fail(&codec->log, NEBEL_ERROR_VALUE,
                   "%s: the depth of no pixel is known; is it the right file and the right format?", codec->name);
}

static nebel_result make_map(const nb_codec *codec, const nb_depth_numbers *numbers, const rule *r,
                             nebel_depth_map *map)
{
    *map = (nebel_depth_map){.width = numbers->width,
                             .height = numbers->height,
                             .type = r->measure == NEBEL_MEASURE_RADIAL ? NEBEL_PIXEL_DEPTH_RADIAL
                                                                        : NEBEL_PIXEL_DEPTH_AXIAL};
    map->depth = nb_allocate(&codec->allocator, (size_t)map->width * map->height, sizeof *map->depth);
    if (map->depth == NULL) return nb_fail(&codec->log, NEBEL_ERROR_MEMORY, "%s: out of memory", codec->name);
    const nebel_result result = convert_depth(codec, numbers, r, map->depth);
    return result == NEBEL_OK ? count_known(codec, map) : result;
}

static nebel_result read_map(const nb_codec *codec, const nebel_depth_source *source, const nebel_depth_format *format,
                             nebel_depth_map *map)
{
    rule r;
    nb_bytes bytes;
    nb_depth_numbers numbers = {0};
    nebel_result result = make_rule(codec, source, format, &r);
    if (result == NEBEL_OK)
        result = nb_file_read(&codec->allocator, &codec->log, NULL, "depth", codec->name, NB_FILE_LIMIT, &bytes);
    if (result != NEBEL_OK) return result;
    result = read_depth_numbers(codec, &bytes, source->channel, &numbers);
    nb_release(&codec->allocator, bytes.data);
    if (result == NEBEL_OK) result = check_files(codec, format, source, &numbers);
    if (result == NEBEL_OK) result = make_map(codec, &numbers, &r, map);
    release_numbers(codec, &numbers);
    return result;
}

nebel_result nebel_read_depth(const char *path, const nebel_depth_source *source, const nebel_host *host,
                              nebel_depth_map *map)
{
    nb_codec codec;
    if (map != NULL) *map = (nebel_depth_map){0};
    if (path == NULL || source == NULL || host == NULL || map == NULL) return NEBEL_ERROR_ARGUMENT;
    const nebel_depth_format *format =
        source->format != NULL ? nebel_find_depth_format(source->format) : nebel_depth_format_at(0);
    nebel_result result = nb_codec_prepare(host, path, &codec);
    if (result == NEBEL_OK) result = check_source(&codec, source, format);
    if (result == NEBEL_OK) result = read_map(&codec, source, format, map);
    if (result != NEBEL_OK) nebel_free_depth(host, map);
    return result;
}

void nebel_free_depth(const nebel_host *host, nebel_depth_map *map)
{
    if (host == NULL || map == NULL || !nb_allocator_is_valid(&host->allocator)) return;
    const nebel_allocator allocator = nb_resolve_allocator(&host->allocator);
    nb_release(&allocator, map->depth);
    *map = (nebel_depth_map){0};
}

/* ---- what is not known ----------------------------------------------------------------------- */

static bool is_known(float depth)
{
    return depth == depth;
}

/* From `first` on, unknown neighbours `step` apart get the larger of the two known ends, or the only one. Returns how many of
 * `count` are known. */
static size_t fill_line(float *first, size_t count, size_t step)
{
    size_t known = 0;
    float before = NAN;
    for (size_t i = 0; i < count; i++) {
        if (is_known(first[i * step])) {
            before = first[i * step];
            known++;
            continue;
        }
        size_t end = i;
        while (end < count && !is_known(first[end * step])) end++;
        const float after = end < count ? first[end * step] : NAN;
        const float fill = !is_known(after) || before > after ? before : after;
        for (; i < end; i++) first[i * step] = fill;
        i--;
    }
    return known;
}

void nebel_fill_depth(nebel_depth_map *map)
{
    if (map == NULL || map->depth == NULL || map->unknown_count == 0) return;
    bool is_whole = true;
    for (size_t y = 0; y < map->height; y++)
        is_whole = fill_line(map->depth + y * map->width, map->width, 1) > 0 && is_whole;
    for (size_t x = 0; x < map->width && !is_whole; x++) fill_line(map->depth + x, map->height, map->width);
}
