/* Grids of voxels: which kind of file, numbers one after the other, and slices that are pictures. */
#include "grid_file.h"

#include "file/path.h"

#include <stdio.h>
#include <string.h>
#include <strings.h>

/* The largest file: 8 GiB where sizes have 64 bits. */
#define FILE_LIMIT (SIZE_MAX >> 31)

static size_t size_of_voxel(nebel_voxel_type type)
{
    return type == NEBEL_VOXEL_UINT8 ? 1 : type == NEBEL_VOXEL_UINT16 ? 2 : sizeof(float);
}

static nebel_result count_voxels(const nb_codec *codec, const nb_voxels *voxels, size_t *voxel_count)
{
    size_t count = 1;
    const size_t *size = voxels->size;
    for (int i = 0; i < 3; i++) {
        if (size[i] < 1 || size[i] > NEBEL_MAX_GRID_SIZE)
            return nb_fail(&codec->log, NEBEL_ERROR_LIMIT, "%s: %zu x %zu x %zu voxels; must be 1 to %d on each axis",
                           codec->name, size[0], size[1], size[2], NEBEL_MAX_GRID_SIZE);
        if (count > NEBEL_MAX_GRID_VOXELS / size[i])
            return nb_fail(&codec->log, NEBEL_ERROR_LIMIT, "%s: %zu x %zu x %zu voxels; at most %d in all", codec->name,
                           size[0], size[1], size[2], NEBEL_MAX_GRID_VOXELS);
        count *= size[i];
    }
    *voxel_count = count;
    return nb_codec_check_room(codec, (uint64_t)count * size_of_voxel(voxels->type));
}

nebel_result nb_voxels_allocate(const nb_codec *codec, nb_voxels *voxels)
{
    size_t count = 0;
    voxels->data = NULL;
    const nebel_result result = count_voxels(codec, voxels, &count);
    if (result != NEBEL_OK) return result;
    voxels->data = nb_allocate_zero(&codec->allocator, count, size_of_voxel(voxels->type));
    return voxels->data != NULL ? NEBEL_OK : nb_fail(&codec->log, NEBEL_ERROR_MEMORY, "%s: out of memory", codec->name);
}

static nebel_result read_file(const nb_codec *codec, const char *path, nb_bytes *bytes)
{
    return nb_file_read(&codec->allocator, &codec->log, NULL, "grid", path, FILE_LIMIT, bytes);
}

/* ---- numbers --------------------------------------------------------------------------------- */

static nebel_result take_numbers(const nb_codec *codec, const nb_bytes *bytes, nb_voxels *voxels)
{
    const size_t *size = voxels->size;
    const nebel_result result = nb_voxels_allocate(codec, voxels);
    if (result != NEBEL_OK) return result;
    const size_t wanted = size[0] * size[1] * size[2] * size_of_voxel(voxels->type);
    if (bytes->size != wanted)
        return nb_fail(&codec->log, NEBEL_ERROR_FORMAT,
                       "%s: holds %zu bytes; %zu x %zu x %zu voxels of %zu bytes are %zu", codec->name, bytes->size,
                       size[0], size[1], size[2], size_of_voxel(voxels->type), wanted);
    memcpy(voxels->data, bytes->data, wanted);
    return NEBEL_OK;
}

static nebel_result read_numbers(const nb_codec *codec, const nebel_grid_file *file, nb_voxels *voxels)
{
    nb_bytes bytes;
    voxels->type = file->type;
    memcpy(voxels->size, file->size, sizeof voxels->size);
    size_t count = 0;
    nebel_result result = count_voxels(codec, voxels, &count);
    if (result == NEBEL_OK) result = read_file(codec, file->path, &bytes);
    if (result != NEBEL_OK) return result;
    result = take_numbers(codec, &bytes, voxels);
    nb_release(&codec->allocator, bytes.data);
    return result;
}

static nebel_result read_nanovdb(const nb_codec *codec, const nebel_grid_file *file, nb_voxels *voxels)
{
    nb_bytes bytes;
    nebel_result result = read_file(codec, file->path, &bytes);
    if (result != NEBEL_OK) return result;
    result = nb_nanovdb_read(codec, &bytes, file->grid_name, voxels);
    nb_release(&codec->allocator, bytes.data);
    return result;
}

/* ---- slices ---------------------------------------------------------------------------------- */

enum { MOST_DIGITS = 9, PATH_SIZE = 4096 };

/* The path of a slice, its number in the place of the last run of #. False where there is none, or it is too long. */
static bool name_slice(const char *pattern, size_t slice, char path[PATH_SIZE])
{
    const char *end = strrchr(nb_path_name(pattern), '#');
    if (end == NULL) return false;
    const char *first = end;
    while (first > pattern && first[-1] == '#') first--;
    const int digits = (int)(end + 1 - first);
    if (digits > MOST_DIGITS) return false;
    const int size = snprintf(path, PATH_SIZE, "%.*s%0*zu%s", (int)(first - pattern), pattern, digits, slice, end + 1);
    return size > 0 && size < PATH_SIZE;
}

/* Rows go downwards, y upwards. */
static void put_slice(const nb_heights *picture, size_t slice, nb_voxels *voxels)
{
    const size_t width = voxels->size[0], height = voxels->size[1];
    for (size_t y = 0; y < height; y++)
        for (size_t x = 0; x < width; x++) {
            const uint16_t value = picture->values[(height - 1 - y) * width + x];
            const size_t at = (slice * height + y) * width + x;
            if (voxels->type == NEBEL_VOXEL_UINT8)
                ((uint8_t *)voxels->data)[at] = (uint8_t)value;
            else
                ((uint16_t *)voxels->data)[at] = value;
        }
}

/* The first slice says what the others must be. */
static nebel_result take_slice(const nb_codec *codec, const nb_heights *picture, size_t slice, nb_voxels *voxels)
{
    const nebel_voxel_type type = picture->max == UINT8_MAX ? NEBEL_VOXEL_UINT8 : NEBEL_VOXEL_UINT16;
    if (slice == 0) {
        voxels->type = type;
        voxels->size[0] = picture->width;
        voxels->size[1] = picture->height;
        const nebel_result result = nb_voxels_allocate(codec, voxels);
        if (result != NEBEL_OK) return result;
    }
    if (picture->width != voxels->size[0] || picture->height != voxels->size[1] || type != voxels->type)
        return nb_fail(&codec->log, NEBEL_ERROR_FORMAT,
                       "%s: is %lu x %lu pixels of %d bits; the first slice is %zu x %zu of %d", codec->name,
                       (unsigned long)picture->width, (unsigned long)picture->height,
                       type == NEBEL_VOXEL_UINT8 ? 8 : 16, voxels->size[0], voxels->size[1],
                       voxels->type == NEBEL_VOXEL_UINT8 ? 8 : 16);
    put_slice(picture, slice, voxels);
    return NEBEL_OK;
}

static nebel_result read_slice(const nb_codec *codec, size_t slice, nb_voxels *voxels)
{
    nb_bytes bytes;
    nb_heights picture = {0};
    nebel_result result = read_file(codec, codec->name, &bytes);
    if (result != NEBEL_OK) return result;
    if (!nb_png_is(&bytes))
        result = nb_fail(&codec->log, NEBEL_ERROR_FORMAT, "%s: is not a PNG picture", codec->name);
    else
        result = nb_png_read_heights(codec, &bytes, "a slice of voxels", &picture);
    if (result == NEBEL_OK) result = take_slice(codec, &picture, slice, voxels);
    nb_release(&codec->allocator, picture.values);
    nb_release(&codec->allocator, bytes.data);
    return result;
}

static nebel_result read_slices(const nb_codec *codec, const nebel_grid_file *file, nb_voxels *voxels)
{
    char path[PATH_SIZE];
    const nb_codec of_slice = {.allocator = codec->allocator, .log = codec->log, .name = path, .room = codec->room};
    nebel_result result = NEBEL_OK;
    if (file->slice_count < 1 || file->slice_count > NEBEL_MAX_GRID_SIZE)
        return nb_fail(&codec->log, NEBEL_ERROR_LIMIT, "%s: %zu slices; must be 1 to %d", codec->name,
                       file->slice_count, NEBEL_MAX_GRID_SIZE);
    voxels->size[2] = file->slice_count;
    for (size_t i = 0; i < file->slice_count && result == NEBEL_OK; i++) {
        if (!name_slice(file->path, i, path))
            return nb_fail(&codec->log, NEBEL_ERROR_FORMAT,
                           "%s: the name of slices needs a run of 1 to %d #, for their numbers", codec->name,
                           MOST_DIGITS);
        result = read_slice(&of_slice, i, voxels);
    }
    return result;
}

/* ---- axes ------------------------------------------------------------------------------------ */

/* From z up to y up: (x, y, z) becomes (x, z, -y), row by row. */
static nebel_result turn(const nb_codec *codec, const nb_file_units *space, nb_voxels *voxels)
{
    const size_t *const size = voxels->size, row = size[0] * size_of_voxel(voxels->type);
    nb_voxels turned = {.size = {size[0], size[2], size[1]}, .type = voxels->type};
    if (!space->z_up) return NEBEL_OK;
    const nebel_result result = nb_voxels_allocate(codec, &turned);
    if (result != NEBEL_OK) return result;
    for (size_t z = 0; z < size[2]; z++)
        for (size_t y = 0; y < size[1]; y++)
            memcpy((unsigned char *)turned.data + ((size[1] - 1 - y) * size[2] + z) * row,
                   (const unsigned char *)voxels->data + (z * size[1] + y) * row, row);
    nb_release(&codec->allocator, voxels->data);
    *voxels = turned;
    return NEBEL_OK;
}

/* ---- any file -------------------------------------------------------------------------------- */

static bool ends_in(const char *path, size_t size, const char *ending)
{
    const size_t length = strlen(ending);
    return size > length && strncasecmp(path + size - length, ending, length) == 0;
}

nb_voxel_file nb_voxel_file_kind(const char *path, size_t size)
{
    if (ends_in(path, size, ".nvdb")) return NB_VOXELS_NANOVDB;
    if (ends_in(path, size, ".vdb")) return NB_VOXELS_OPENVDB;
    return ends_in(path, size, ".png") ? NB_VOXELS_SLICES : NB_VOXELS_NUMBERS;
}

static nebel_result read_voxels(const nb_codec *codec, const nebel_grid_file *file, nb_voxels *voxels)
{
    switch (nb_voxel_file_kind(file->path, strlen(file->path))) {
    case NB_VOXELS_NANOVDB:
        return read_nanovdb(codec, file, voxels);
    case NB_VOXELS_OPENVDB:
        return nb_vdb_read(codec, file->grid_name, voxels);
    case NB_VOXELS_SLICES:
        return read_slices(codec, file, voxels);
    default:
        return read_numbers(codec, file, voxels);
    }
}

/* The core names the voxel that is wrong; the file comes from here. */
typedef struct nb_slice_owner {
    const nb_codec *codec;
} nb_slice_owner;

static void tell_file(nebel_log_level level, nebel_result result, const char *message, void *user)
{
    const nb_codec *codec = ((const nb_slice_owner *)user)->codec;
    nb_log_message(&codec->log, level, result, "%s: %s", codec->name, message);
}

static nebel_result make_grid(const nb_codec *codec, const nebel_grid_file *file, const nb_voxels *voxels,
                              nebel_grid **grid)
{
    nb_slice_owner user = {codec};
    nebel_grid_desc desc = {.host = {.allocator = codec->allocator, .log = {tell_file, &user}},
                            .type = voxels->type,
                            .voxels = voxels->data,
                            .filter = file->filter,
                            .name = file->name};
    memcpy(desc.size, voxels->size, sizeof desc.size);
    return nebel_create_grid(&desc, grid);
}

nebel_result nb_voxels_load(const nebel_grid_file *file, const nebel_scene_desc *desc, const nb_file_units *space,
                            nebel_grid **grid, uint64_t *bytes)
{
    *bytes = 0;
    if (grid != NULL) *grid = NULL;
    if (file == NULL || desc == NULL || grid == NULL || file->path == NULL) return NEBEL_ERROR_ARGUMENT;
    if (!nb_allocator_is_valid(&desc->host.allocator))
        return nb_fail(&desc->host.log, NEBEL_ERROR_ARGUMENT, "an allocator needs both its functions; one is NULL");
    const nb_codec codec = {.allocator = nb_resolve_allocator(&desc->host.allocator),
                            .log = desc->host.log,
                            .name = file->path,
                            .room = desc->memory};
    nb_voxels voxels = {.data = NULL};
    nebel_result result = read_voxels(&codec, file, &voxels);
    if (result == NEBEL_OK) result = turn(&codec, space, &voxels);
    if (result == NEBEL_OK) result = make_grid(&codec, file, &voxels, grid);
    if (result == NEBEL_OK)
        *bytes = (uint64_t)voxels.size[0] * voxels.size[1] * voxels.size[2] * size_of_voxel(voxels.type);
    nb_release(&codec.allocator, voxels.data);
    return result;
}

nebel_result nebel_load_grid(const nebel_grid_file *file, const nebel_scene_desc *desc, nebel_grid **grid)
{
    uint64_t bytes = 0;
    return nb_voxels_load(file, desc, &NB_SPACE_OURS, grid, &bytes);
}
