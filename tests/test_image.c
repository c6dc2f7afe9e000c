/* Pictures out and in again, and pictures that are none. */
#define _GNU_SOURCE
#include "scene_help.h"

#include <errno.h>
#include <fcntl.h>
#include <math.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include <openexr.h>
#include <png.h>

static char folder[] = "/tmp/nebel_image_XXXXXX";

static const char *in_folder(const char *name)
{
    static char path[8][200];
    static int next;
    next = (next + 1) % 8;
    snprintf(path[next], sizeof path[next], "%s/%s", folder, name);
    return path[next];
}

static uint64_t seed = 1;

static float random_float(void)
{
    seed = seed * 6364136223846793005u + 1442695040888963407u;
    return (float)(seed >> 40) * 0x1p-24f;
}

static const char *const rgb_names[] = {"R", "G", "B"};

static nebel_image make_image(uint32_t width, uint32_t height, uint32_t channel_count, const char *const *names)
{
    nebel_image image = {width, height, channel_count, names, NULL};
    image.samples = malloc(sizeof(float) * width * height * channel_count);
    for (size_t i = 0; i < (size_t)width * height * channel_count; i++) image.samples[i] = random_float();
    return image;
}

static size_t file_count(void)
{
    char command[200];
    snprintf(command, sizeof command, "ls -A %s | wc -l", folder);
    FILE *pipe = popen(command, "r");
    size_t count = 0;
    assert_int_equal(fscanf(pipe, "%zu", &count), 1);
    pclose(pipe);
    return count;
}

static nebel_result write_image(const char *path, const nebel_image *image, journal *kept)
{
    meter m;
    const nebel_host host = metered_host(&m, kept);
    const nebel_result result = nebel_write_image(path, &host, image);
    assert_int_equal(m.live, 0);
    return result;
}

/* The same from the question that is asked before the work, after which nothing has changed. */
static nebel_result check_path(const char *path, journal *kept)
{
    meter m;
    const size_t files = file_count();
    const nebel_host host = metered_host(&m, kept);
    const nebel_result result = nebel_check_image_path(path, &host);
    assert_int_equal(m.live, 0);
    assert_int_equal(file_count(), files);
    assert_int_equal(kept->count, result != NEBEL_OK);
    return result;
}

static nebel_result read_image(const char *path, nebel_image *image, journal *kept)
{
    *kept = (journal){0};
    return nebel_read_image(path, &(nebel_host){.log = {remember, kept}}, image);
}

static void free_image(nebel_image *image)
{
    nebel_free_image(&(nebel_host){0}, image);
}

static void write_bytes(const char *path, const void *data, size_t size)
{
    FILE *file = fopen(path, "wb");
    assert_int_equal(fwrite(data, 1, size, file), size);
    fclose(file);
}

static unsigned char *read_bytes(const char *path, size_t *size)
{
    FILE *file = fopen(path, "rb");
    unsigned char *data = malloc(1 << 20);
    *size = fread(data, 1, 1 << 20, file);
    fclose(file);
    return data;
}

/* ---- round trips ----------------------------------------------------------------------------- */

static void test_exr_keeps_every_float(void **state)
{
    (void)state;
    const char *const names[] = {
        "transmittance.R", "B", "depth.Z", "R", "a name that is a good deal longer than thirty-one", "G", "A"};
    const char *const sorted[] = {
        "R", "G", "B", "A", "a name that is a good deal longer than thirty-one", "depth.Z", "transmittance.R"};
    const int from[] = {3, 5, 1, 6, 4, 2, 0};
    const uint32_t sizes[][2] = {{1, 1}, {37, 41}, {16, 16}, {3, 200}, {300, 2}};
    for (size_t s = 0; s < 5; s++) {
        journal kept;
        nebel_image image = make_image(sizes[s][0], sizes[s][1], 7, names), back;
        image.samples[0] = INFINITY;
        image.samples[6] = -1e-42f;
        assert_int_equal(write_image(in_folder("a.exr"), &image, &kept), NEBEL_OK);
        if (read_image(in_folder("a.exr"), &back, &kept) != NEBEL_OK) fail_msg("%s", kept.last);
        assert_int_equal(back.width, image.width);
        assert_int_equal(back.height, image.height);
        assert_int_equal(back.channel_count, 7);
        for (int c = 0; c < 7; c++) assert_string_equal(back.channel_names[c], sorted[c]);
        for (size_t i = 0; i < (size_t)image.width * image.height; i++)
            for (size_t c = 0; c < 7; c++)
                assert_memory_equal(&back.samples[7 * i + c], &image.samples[7 * i + (size_t)from[c]], sizeof(float));
        free_image(&back);
        free(image.samples);
    }
    unlink(in_folder("a.exr"));
}

/* Blocks that hardly compress: some come out at exactly the size they had. */
static void test_exr_keeps_blocks_that_compress_to_their_own_size(void **state)
{
    (void)state;
    const char *const names[] = {"Z"};
    nebel_image image = make_image(20, 1, 1, names), back;
    for (int i = 0; i < 400; i++) {
        journal kept;
        for (size_t x = 0; x < 20; x++) image.samples[x] = (float)(int)(random_float() * (float)(200 + 40 * i));
        assert_int_equal(write_image(in_folder("a.exr"), &image, &kept), NEBEL_OK);
        assert_int_equal(read_image(in_folder("a.exr"), &back, &kept), NEBEL_OK);
        assert_memory_equal(back.samples, image.samples, 20 * sizeof(float));
        free_image(&back);
    }
    free(image.samples);
    unlink(in_folder("a.exr"));
}

static void test_png_keeps_every_byte(void **state)
{
    (void)state;
    journal kept;
    nebel_image image = make_image(256, 33, 3, rgb_names), back, again;
    for (size_t i = 0; i < 256 * 33 * 3; i++) image.samples[i] = (float)(i * 7 % 256) / 255.0f;
    assert_int_equal(write_image(in_folder("a.png"), &image, &kept), NEBEL_OK);
    assert_int_equal(read_image(in_folder("a.png"), &back, &kept), NEBEL_OK);
    assert_int_equal(back.channel_count, 3);
    assert_string_equal(back.channel_names[1], "G");
    assert_memory_equal(back.samples, image.samples, 256 * 33 * 3 * sizeof(float));
    assert_int_equal(write_image(in_folder("b.PNG"), &back, &kept), NEBEL_OK);
    assert_int_equal(read_image(in_folder("b.PNG"), &again, &kept), NEBEL_OK);
    assert_memory_equal(again.samples, image.samples, 256 * 33 * 3 * sizeof(float));
    free_image(&back);
    free_image(&again);
    free(image.samples);
    unlink(in_folder("a.png"));
    unlink(in_folder("b.PNG"));
}

static void test_png_rounds_without_bands_and_without_chance(void **state)
{
    (void)state;
    journal kept;
    size_t size[2];
    unsigned char *bytes[2];
    nebel_image image = make_image(64, 64, 3, rgb_names), back;
    const float flat = 100.3f / 255.0f;
    for (size_t i = 0; i < 64 * 64 * 3; i++) image.samples[i] = flat;
    for (int i = 0; i < 2; i++) {
        assert_int_equal(write_image(in_folder("a.png"), &image, &kept), NEBEL_OK);
        bytes[i] = read_bytes(in_folder("a.png"), &size[i]);
    }
    assert_int_equal(size[0], size[1]);
    assert_memory_equal(bytes[0], bytes[1], size[0]);
    assert_int_equal(read_image(in_folder("a.png"), &back, &kept), NEBEL_OK);
    double sum = 0;
    for (size_t i = 0; i < 64 * 64 * 3; i++) {
        sum += (double)back.samples[i];
        assert_true(fabsf(back.samples[i] - flat) < 1.0f / 255.0f);
    }
    assert_true(fabs(sum / (64 * 64 * 3) - (double)flat) < .01 / 255);
    free(bytes[0]);
    free(bytes[1]);
    free(image.samples);
    free_image(&back);
    unlink(in_folder("a.png"));
}

static void test_png_takes_any_number(void **state)
{
    (void)state;
    journal kept;
    const float strange[] = {NAN, -INFINITY, INFINITY, -1, 2, 1e30f, -0.0f, 0.9999999f, 1e-30f};
    const unsigned wanted[] = {0, 0, 255, 0, 255, 255, 0, 255, 0};
    nebel_image image = make_image(3, 1, 3, rgb_names), back;
    memcpy(image.samples, strange, sizeof strange);
    assert_int_equal(write_image(in_folder("a.png"), &image, &kept), NEBEL_OK);
    assert_int_equal(read_image(in_folder("a.png"), &back, &kept), NEBEL_OK);
    for (size_t i = 0; i < 9; i++) assert_int_equal((unsigned)lrintf(back.samples[i] * 255), wanted[i]);
    free_image(&back);
    free(image.samples);
    unlink(in_folder("a.png"));
}

/* ---- PNG of other kinds ---------------------------------------------------------------------- */

static void write_png(const char *path, uint32_t width, uint32_t height, png_uint_32 format, const void *pixels)
{
    png_image image = {.version = PNG_IMAGE_VERSION, .width = width, .height = height, .format = format};
    assert_true(png_image_write_to_file(&image, path, 0, pixels, 0, NULL));
}

static void test_png_of_16_bit_and_with_alpha(void **state)
{
    (void)state;
    journal kept;
    nebel_image image;
    const uint8_t grey[4] = {0, 51, 102, 255}, rgba[8] = {1, 2, 3, 255, 40, 50, 60, 128};
    write_png(in_folder("g.png"), 2, 2, PNG_FORMAT_GRAY, grey);
    assert_int_equal(read_image(in_folder("g.png"), &image, &kept), NEBEL_OK);
    assert_int_equal(image.channel_count, 1);
    assert_string_equal(image.channel_names[0], "Y");
    assert_true(fabsf(image.samples[1] - .2f) < 1e-6f);
    free_image(&image);
    write_png(in_folder("g.png"), 2, 1, PNG_FORMAT_RGBA, rgba);
    assert_int_equal(read_image(in_folder("g.png"), &image, &kept), NEBEL_OK);
    assert_int_equal(image.channel_count, 4);
    assert_string_equal(image.channel_names[3], "A");
    assert_true(fabsf(image.samples[7] - 128.0f / 255) < 1e-6f);
    free_image(&image);
    const uint16_t linear[2] = {65535, 0x1234};
    write_png(in_folder("g.png"), 2, 1, PNG_FORMAT_LINEAR_Y, linear);
    assert_int_equal(read_image(in_folder("g.png"), &image, &kept), NEBEL_OK);
    assert_true(fabsf(image.samples[1] - (float)0x1234 / 65535) < 1e-6f);
    free_image(&image);
    unlink(in_folder("g.png"));
}

/* ---- OpenEXR of other kinds ------------------------------------------------------------------ */

static void put_exr_header(exr_context_t exr, exr_storage_t storage, exr_pixel_type_t type,
                           const exr_attr_box2i_t *data, const exr_attr_box2i_t *display)
{
    int part;
    const exr_attr_v2f_t center = {0};
    assert_int_equal(exr_add_part(exr, "", storage, &part), EXR_ERR_SUCCESS);
    assert_int_equal(exr_initialize_required_attr(exr, part, display, data, 1, &center, 1, EXR_LINEORDER_INCREASING_Y,
                                                  EXR_COMPRESSION_NONE),
                     EXR_ERR_SUCCESS);
    if (storage == EXR_STORAGE_TILED)
        assert_int_equal(exr_set_tile_descriptor(exr, part, 8, 4, EXR_TILE_ONE_LEVEL, EXR_TILE_ROUND_DOWN),
                         EXR_ERR_SUCCESS);
    assert_int_equal(exr_add_channel(exr, part, "Z", type, EXR_PERCEPTUALLY_LOGARITHMIC, 1, 1), EXR_ERR_SUCCESS);
    assert_int_equal(exr_write_header(exr), EXR_ERR_SUCCESS);
}

static void put_exr_chunk(exr_context_t exr, const exr_chunk_info_t *chunk, const uint8_t *pixels, int bytes, int row)
{
    exr_encode_pipeline_t pipeline = EXR_ENCODE_PIPELINE_INITIALIZER;
    assert_int_equal(exr_encoding_initialize(exr, 0, chunk, &pipeline), EXR_ERR_SUCCESS);
    pipeline.channels[0].user_pixel_stride = bytes;
    pipeline.channels[0].user_line_stride = row;
    pipeline.channels[0].encode_from_ptr = pixels;
    assert_int_equal(exr_encoding_choose_default_routines(exr, 0, &pipeline), EXR_ERR_SUCCESS);
    assert_int_equal(exr_encoding_run(exr, 0, &pipeline), EXR_ERR_SUCCESS);
    exr_encoding_destroy(exr, &pipeline);
}

/* Writes a one-channel picture whose data window is 20 x 10. */
static void write_exr(const char *path, exr_storage_t storage, exr_pixel_type_t type, int32_t x, int32_t y,
                      const exr_attr_box2i_t *display, const void *pixels)
{
    exr_context_t exr;
    exr_chunk_info_t chunk;
    const int bytes = type == EXR_PIXEL_HALF ? 2 : 4;
    const exr_attr_box2i_t data = {.min = {.x = x, .y = y}, .max = {.x = x + 19, .y = y + 9}};
    assert_int_equal(exr_start_write(&exr, path, EXR_WRITE_FILE_DIRECTLY, NULL), EXR_ERR_SUCCESS);
    put_exr_header(exr, storage, type, &data, display);
    for (int i = 0; i < 10 && storage == EXR_STORAGE_SCANLINE; i++) {
        assert_int_equal(exr_write_scanline_chunk_info(exr, 0, y + i, &chunk), EXR_ERR_SUCCESS);
        put_exr_chunk(exr, &chunk, (const uint8_t *)pixels + i * 20 * bytes, bytes, 20 * bytes);
    }
    for (int i = 0; i < 9 && storage == EXR_STORAGE_TILED; i++) {
        assert_int_equal(exr_write_tile_chunk_info(exr, 0, i % 3, i / 3, 0, 0, &chunk), EXR_ERR_SUCCESS);
        put_exr_chunk(exr, &chunk, (const uint8_t *)pixels + (i / 3 * 4 * 20 + i % 3 * 8) * bytes, bytes, 20 * bytes);
    }
    assert_int_equal(exr_finish(&exr), EXR_ERR_SUCCESS);
}

/* Good files of kinds that are not read are unsupported, not broken. */
static void test_exr_of_other_kinds(void **state)
{
    (void)state;
    static const char key[] = "compression\0compression\0\1\0\0";
    const exr_attr_box2i_t display = {.max = {.x = 19, .y = 9}};
    static float pixels[200];
    journal kept;
    nebel_image image;
    write_exr(in_folder("t.exr"), EXR_STORAGE_SCANLINE, EXR_PIXEL_FLOAT, 0, 0, &display, pixels);
    size_t size, at = 0;
    unsigned char *bytes = read_bytes(in_folder("t.exr"), &size);
    while (memcmp(bytes + at, key, sizeof key) != 0) at++;
    const struct {
        int compression;
        const char *name;
    } refused[] = {{EXR_COMPRESSION_B44, "B44,"},
                   {EXR_COMPRESSION_B44A, "B44A"},
                   {EXR_COMPRESSION_DWAA, "DWAA"},
                   {EXR_COMPRESSION_DWAB, "DWAB"}};
    for (size_t i = 0; i < sizeof refused / sizeof *refused; i++) {
        bytes[at + sizeof key] = (unsigned char)refused[i].compression;
        write_bytes(in_folder("t.exr"), bytes, size);
        assert_int_equal(read_image(in_folder("t.exr"), &image, &kept), NEBEL_ERROR_UNSUPPORTED);
        assert_non_null(strstr(kept.last, refused[i].name));
    }
    bytes[5] |= 0x10; /* several parts */
    write_bytes(in_folder("t.exr"), bytes, size);
    assert_int_equal(read_image(in_folder("t.exr"), &image, &kept), NEBEL_ERROR_UNSUPPORTED);
    assert_non_null(strstr(kept.last, "of several parts"));
    free(bytes);
    unlink(in_folder("t.exr"));
}

static void test_exr_in_tiles_halves_and_whole_numbers(void **state)
{
    (void)state;
    const exr_attr_box2i_t display = {.max = {.x = 19, .y = 9}};
    const exr_storage_t storages[] = {EXR_STORAGE_SCANLINE, EXR_STORAGE_TILED};
    for (int s = 0; s < 2; s++)
        for (int t = 0; t < 3; t++) {
            journal kept;
            nebel_image image;
            uint32_t whole[200];
            float floats[200];
            uint16_t halves[200];
            for (uint32_t i = 0; i < 200; i++) {
                whole[i] = i * 100;
                floats[i] = (float)i * 100;
                halves[i] = (uint16_t)(i * 64); /* as bits */
            }
            const void *pixels = t == EXR_PIXEL_UINT   ? (const void *)whole
                                 : t == EXR_PIXEL_HALF ? (const void *)halves
                                                       : (const void *)floats;
            write_exr(in_folder("t.exr"), storages[s], (exr_pixel_type_t)t, 0, 0, &display, pixels);
            if (read_image(in_folder("t.exr"), &image, &kept) != NEBEL_OK) fail_msg("%d %d: %s", s, t, kept.last);
            assert_int_equal(image.width, 20);
            assert_int_equal(image.height, 10);
            assert_string_equal(image.channel_names[0], "Z");
            if (t == EXR_PIXEL_HALF) {
                assert_true(image.samples[190] == ldexpf(1 + (190 * 64 % 1024) / 1024.0f, 190 * 64 / 1024 - 15));
            } else {
                for (size_t i = 0; i < 200; i++)
                    if (image.samples[i] != (float)i * 100)
                        fail_msg("%d %d: %zu is %g", s, t, i, (double)image.samples[i]);
            }
            free_image(&image);
        }
    unlink(in_folder("t.exr"));
}

static void test_exr_shows_the_display_window(void **state)
{
    (void)state;
    journal kept;
    nebel_image image;
    float floats[200];
    for (uint32_t i = 0; i < 200; i++) floats[i] = (float)(i + 1);
    const exr_attr_box2i_t display = {.min = {.x = -2, .y = 3}, .max = {.x = 9, .y = 16}};
    for (int s = 0; s < 2; s++) {
        write_exr(in_folder("t.exr"), s == 0 ? EXR_STORAGE_SCANLINE : EXR_STORAGE_TILED, EXR_PIXEL_FLOAT, -5, 5,
                  &display, floats);
        if (read_image(in_folder("t.exr"), &image, &kept) != NEBEL_OK) fail_msg("%s", kept.last);
        assert_int_equal(image.width, 12);
        assert_int_equal(image.height, 14);
        for (int y = 0; y < 14; y++)
            for (int x = 0; x < 12; x++) {
                const int dx = x - 2 + 5, dy = y + 3 - 5;
                const float wanted = dx >= 0 && dx < 20 && dy >= 0 && dy < 10 ? (float)(dy * 20 + dx + 1) : 0;
                assert_true(image.samples[y * 12 + x] == wanted);
            }
        free_image(&image);
    }
    unlink(in_folder("t.exr"));
}

/* ---- broken pictures ------------------------------------------------------------------------- */

static void break_file(const char *name, int truncate_only)
{
    size_t size;
    unsigned char *good = read_bytes(in_folder(name), &size);
    for (size_t cut = 0; cut < size; cut++) {
        journal kept;
        nebel_image image;
        if (truncate_only)
            write_bytes(in_folder("broken"), good, cut);
        else {
            good[cut] ^= (unsigned char)(1 << cut % 8);
            write_bytes(in_folder("broken"), good, size);
            good[cut] ^= (unsigned char)(1 << cut % 8);
        }
        const nebel_result result = read_image(in_folder("broken"), &image, &kept);
        assert_int_equal(kept.count > 0, result != NEBEL_OK);
        if (truncate_only && result != NEBEL_ERROR_FORMAT)
            fail_msg("%s cut at %zu of %zu gave %d", name, cut, size, result);
        assert_true(result == NEBEL_OK || image.samples == NULL);
        free_image(&image);
    }
    free(good);
    unlink(in_folder("broken"));
}

static void test_broken_pictures_are_errors(void **state)
{
    (void)state;
    journal kept;
    nebel_image image = make_image(9, 7, 3, rgb_names);
    assert_int_equal(write_image(in_folder("a.png"), &image, &kept), NEBEL_OK);
    assert_int_equal(write_image(in_folder("a.exr"), &image, &kept), NEBEL_OK);
    free(image.samples);
    break_file("a.png", 1);
    break_file("a.exr", 1);
    break_file("a.png", 0);
    break_file("a.exr", 0);
    unlink(in_folder("a.png"));
    unlink(in_folder("a.exr"));
}

static void test_giant_pictures_are_refused_before_memory_is_asked_for(void **state)
{
    (void)state;
    journal kept;
    nebel_image image = make_image(2, 2, 3, rgb_names);
    assert_int_equal(write_image(in_folder("a.png"), &image, &kept), NEBEL_OK);
    free(image.samples);
    size_t size;
    unsigned char *png = read_bytes(in_folder("a.png"), &size);
    const unsigned char big[8] = {0x7F, 0xFF, 0xFF, 0xFF, 0x7F, 0xFF, 0xFF, 0xFF};
    memcpy(png + 16, big, 8);
    uint32_t crc = 0xFFFFFFFFu;
    for (size_t i = 12; i < 29; i++) {
        crc ^= png[i];
        for (int bit = 0; bit < 8; bit++) crc = crc >> 1 ^ (crc & 1 ? 0xEDB88320u : 0);
    }
    for (int i = 0; i < 4; i++) png[29 + i] = (unsigned char)(~crc >> (24 - 8 * i));
    write_bytes(in_folder("a.png"), png, size);
    free(png);
    assert_int_equal(read_image(in_folder("a.png"), &image, &kept), NEBEL_ERROR_LIMIT);
    assert_non_null(strstr(kept.last, "2147483647 x 2147483647"));
    unlink(in_folder("a.png"));
}

static void test_what_is_no_picture(void **state)
{
    (void)state;
    journal kept;
    nebel_image image;
    write_bytes(in_folder("text"), "hello", 5);
    assert_int_equal(read_image(in_folder("text"), &image, &kept), NEBEL_ERROR_FORMAT);
    assert_non_null(strstr(kept.last, "neither a PNG nor an OpenEXR picture"));
    unlink(in_folder("text"));
    assert_int_equal(read_image(in_folder("none"), &image, &kept), NEBEL_ERROR_FILE);
    const nebel_host half = {.allocator = {.allocate = metered_allocate}, .log = {remember, &kept}};
    assert_int_equal(nebel_read_image(in_folder("none"), &half, &image), NEBEL_ERROR_ARGUMENT);
    assert_string_equal(kept.last, "an allocator needs both its functions; one is NULL");
    assert_int_equal(read_image(folder, &image, &kept), NEBEL_ERROR_FILE);
}

/* ---- writing --------------------------------------------------------------------------------- */

static void test_only_whole_pictures_are_written(void **state)
{
    (void)state;
    journal kept;
    const char *const twice[] = {"R", "R", "B"}, *const unnamed[] = {"R", "", "B"}, *const others[] = {"X", "Y", "Z"};
    nebel_image image = make_image(2, 2, 3, rgb_names);
    assert_int_equal(write_image(in_folder("a.jpg"), &image, &kept), NEBEL_ERROR_FORMAT);
    assert_non_null(strstr(kept.last, "must end in .png or .exr"));
    assert_int_equal(write_image(".png", &image, &kept), NEBEL_ERROR_FORMAT);
    image.channel_names = twice;
    assert_int_equal(write_image(in_folder("a.exr"), &image, &kept), NEBEL_ERROR_ARGUMENT);
    image.channel_names = unnamed;
    assert_int_equal(write_image(in_folder("a.exr"), &image, &kept), NEBEL_ERROR_ARGUMENT);
    image.channel_names = others;
    assert_int_equal(write_image(in_folder("a.png"), &image, &kept), NEBEL_ERROR_ARGUMENT);
    assert_non_null(strstr(kept.last, "R is absent"));
    image.channel_names = rgb_names;
    image.width = 0;
    assert_int_equal(write_image(in_folder("a.exr"), &image, &kept), NEBEL_ERROR_ARGUMENT);
    image.width = UINT32_MAX;
    image.height = UINT32_MAX;
    assert_int_equal(write_image(in_folder("a.exr"), &image, &kept), NEBEL_ERROR_LIMIT);
    assert_int_equal(file_count(), 0);
    free(image.samples);
}

static void test_a_target_is_replaced_with_its_mode_and_the_umask_holds(void **state)
{
    (void)state;
    journal kept;
    struct stat status;
    nebel_image image = make_image(2, 2, 3, rgb_names);
    const mode_t before = umask(027);
    assert_int_equal(write_image(in_folder("a.png"), &image, &kept), NEBEL_OK);
    umask(before);
    stat(in_folder("a.png"), &status);
    assert_int_equal(status.st_mode & 0777, 0640);
    chmod(in_folder("a.png"), 0604);
    assert_int_equal(write_image(in_folder("a.png"), &image, &kept), NEBEL_OK);
    stat(in_folder("a.png"), &status);
    assert_int_equal(status.st_mode & 0777, 0604);
    assert_int_equal(file_count(), 1);
    unlink(in_folder("a.png"));
    free(image.samples);
}

static void test_a_link_stays_and_its_target_is_replaced(void **state)
{
    (void)state;
    journal kept;
    struct stat status;
    nebel_image image = make_image(2, 2, 3, rgb_names), back;
    write_bytes(in_folder("target.png"), "old", 3);
    assert_int_equal(symlink("target.png", in_folder("link.png")), 0);
    assert_int_equal(symlink("link.png", in_folder("second.png")), 0);
    assert_int_equal(symlink("new.png", in_folder("dangling.png")), 0);
    assert_int_equal(symlink("loop.png", in_folder("loop.png")), 0);
    assert_int_equal(check_path(in_folder("second.png"), &kept), NEBEL_OK);
    assert_int_equal(check_path(in_folder("dangling.png"), &kept), NEBEL_OK);
    assert_int_equal(check_path(in_folder("loop.png"), &kept), NEBEL_ERROR_FILE);
    assert_int_equal(write_image(in_folder("second.png"), &image, &kept), NEBEL_OK);
    assert_int_equal(write_image(in_folder("dangling.png"), &image, &kept), NEBEL_OK);
    assert_int_equal(write_image(in_folder("loop.png"), &image, &kept), NEBEL_ERROR_FILE);
    lstat(in_folder("second.png"), &status);
    assert_true(S_ISLNK(status.st_mode));
    lstat(in_folder("link.png"), &status);
    assert_true(S_ISLNK(status.st_mode));
    const char *const names[] = {"target.png", "new.png"}, *const links[] = {"link.png", "second.png", "dangling.png",
                                                                             "loop.png"};
    for (int i = 0; i < 2; i++) {
        lstat(in_folder(names[i]), &status);
        assert_true(S_ISREG(status.st_mode));
        assert_int_equal(read_image(in_folder(names[i]), &back, &kept), NEBEL_OK);
        free_image(&back);
        unlink(in_folder(names[i]));
    }
    for (int i = 0; i < 4; i++) unlink(in_folder(links[i]));
    assert_int_equal(file_count(), 0);
    free(image.samples);
}

static void assert_refused(const char *path, const nebel_image *image)
{
    journal kept;
    for (int i = 0; i < 2; i++) {
        assert_int_equal(i == 0 ? check_path(path, &kept) : write_image(path, image, &kept), NEBEL_ERROR_FILE);
        assert_non_null(strstr(kept.last, "it is a device, a pipe or a socket"));
    }
}

static void test_devices_pipes_and_sockets_are_refused(void **state)
{
    (void)state;
    struct stat status;
    struct sockaddr_un place = {.sun_family = AF_UNIX};
    nebel_image image = make_image(2, 2, 3, rgb_names);
    assert_int_equal(symlink("/dev/full", in_folder("full.png")), 0);
    assert_int_equal(mkfifo(in_folder("pipe.exr"), 0600), 0);
    snprintf(place.sun_path, sizeof place.sun_path, "%s", in_folder("socket.png"));
    const int socket_file = socket(AF_UNIX, SOCK_STREAM, 0);
    assert_int_equal(bind(socket_file, (const struct sockaddr *)&place, sizeof place), 0);
    assert_refused(in_folder("full.png"), &image);
    assert_refused(in_folder("pipe.exr"), &image); /* without waiting for a reader */
    assert_refused(in_folder("socket.png"), &image);
    const int reader = open(in_folder("pipe.exr"), O_RDONLY | O_NONBLOCK);
    assert_refused(in_folder("pipe.exr"), &image);
    close(reader);
    close(socket_file);
    lstat(in_folder("pipe.exr"), &status);
    assert_true(S_ISFIFO(status.st_mode));
    unlink(in_folder("pipe.exr"));
    unlink(in_folder("full.png"));
    unlink(in_folder("socket.png"));
    assert_int_equal(file_count(), 0);
    free(image.samples);
}

/* A link says the format. */
static void test_nothing_and_open_pipes_are_written(void **state)
{
    (void)state;
    journal kept;
    int ends[2];
    char name[64];
    unsigned char start[4];
    nebel_image image = make_image(2, 2, 3, rgb_names);
    assert_int_equal(pipe(ends), 0);
    snprintf(name, sizeof name, "/dev/fd/%d", ends[1]);
    for (int i = 0; i < 2; i++) {
        assert_int_equal(symlink(i == 0 ? "/dev/null" : name, in_folder("open.exr")), 0);
        assert_int_equal(check_path(in_folder("open.exr"), &kept), NEBEL_OK);
        assert_int_equal(write_image(in_folder("open.exr"), &image, &kept), NEBEL_OK);
        unlink(in_folder("open.exr"));
    }
    assert_int_equal(read(ends[0], start, 4), 4);
    assert_memory_equal(start, "\x76\x2f\x31\x01", 4);
    close(ends[0]);
    close(ends[1]);
    assert_int_equal(file_count(), 0);
    free(image.samples);
}

/* What has no ending that says more. */
static void test_streams_take_png_from_where_they_stand(void **state)
{
    (void)state;
    journal kept;
    char name[64], bytes[16] = "";
    nebel_image image = make_image(2, 2, 3, rgb_names);
    const int file = open(in_folder("log"), O_RDWR | O_CREAT | O_APPEND, 0600);
    assert_int_equal(write(file, "old", 3), 3);
    snprintf(name, sizeof name, "/dev/fd/%d", file);
    assert_int_equal(nebel_get_image_format(name), NEBEL_IMAGE_PNG);
    assert_int_equal(check_path(name, &kept), NEBEL_OK);
    assert_int_equal(write_image(name, &image, &kept), NEBEL_OK);
    assert_int_equal(pread(file, bytes, 11, 0), 11);
    assert_memory_equal(bytes, "old\x89PNG\r\n\x1a\n", 11);
    close(file);
    const int closed = open(in_folder("log"), O_RDONLY);
    snprintf(name, sizeof name, "/dev/fd/%d", closed);
    assert_int_equal(check_path(name, &kept), NEBEL_ERROR_FILE);
    assert_non_null(strstr(kept.last, "not open to writing"));
    close(closed);
    assert_int_equal(nebel_get_image_format("/dev/null"), NEBEL_IMAGE_PNG);
    assert_int_equal(write_image("/dev/full", &image, &kept), NEBEL_ERROR_FILE);
    assert_int_equal(nebel_get_image_format(in_folder("log")), NEBEL_IMAGE_NONE);
    assert_int_equal(nebel_get_image_format(in_folder("none")), NEBEL_IMAGE_NONE);
    assert_int_equal(nebel_get_image_format(in_folder("")), NEBEL_IMAGE_NONE);
    unlink(in_folder("log"));
    free(image.samples);
}

static void test_a_failure_leaves_everything_as_it_was(void **state)
{
    (void)state;
    journal kept;
    nebel_image image = make_image(2, 2, 3, rgb_names);
    assert_int_equal(mkdir(in_folder("folder.png"), 0700), 0);
    write_bytes(in_folder("file"), "", 0);
    const struct {
        const char *path, *reason;
    } bad[] = {{in_folder("none/a.png"), "there is no folder"},
               {in_folder("folder.png"), "it is a folder; name a file in it"},
               {in_folder("file/a.png"), "Not a directory"},
               {"/proc/nebel.png", "no file can be made in \"/proc/\""}};
    for (size_t i = 0; i < sizeof bad / sizeof *bad; i++) {
        assert_int_equal(write_image(bad[i].path, &image, &kept), NEBEL_ERROR_FILE);
        assert_non_null(strstr(kept.last, bad[i].reason));
        assert_int_equal(check_path(bad[i].path, &kept), NEBEL_ERROR_FILE);
        assert_non_null(strstr(kept.last, bad[i].reason));
    }
    rmdir(in_folder("folder.png"));
    unlink(in_folder("file"));
    assert_int_equal(file_count(), 0);
    free(image.samples);
}

static void test_a_folder_without_permission_is_an_error(void **state)
{
    (void)state;
    journal kept;
    if (geteuid() == 0) skip(); /* root may write everywhere */
    nebel_image image = make_image(2, 2, 3, rgb_names);
    mkdir(in_folder("closed"), 0500);
    assert_int_equal(check_path(in_folder("closed/a.png"), &kept), NEBEL_ERROR_FILE);
    assert_int_equal(write_image(in_folder("closed/a.png"), &image, &kept), NEBEL_ERROR_FILE);
    assert_non_null(strstr(kept.last, "Permission denied"));
    rmdir(in_folder("closed"));
    free(image.samples);
}

static void test_every_failing_allocation_is_survived(void **state)
{
    (void)state;
    const char *const paths[] = {in_folder("a.png"), in_folder("a.exr")};
    nebel_image image = make_image(40, 30, 3, rgb_names), back;
    for (int i = 0; i < 2; i++) {
        nebel_result result = NEBEL_ERROR_MEMORY;
        for (long k = 0; result != NEBEL_OK; k++) {
            meter m;
            journal kept;
            const nebel_host host = metered_host(&m, &kept);
            m.fail_at = k;
            result = nebel_write_image(paths[i], &host, &image);
            if (result != NEBEL_OK) assert_int_equal(result, NEBEL_ERROR_MEMORY);
            assert_int_equal(m.live, 0);
            assert_true(k < 500);
        }
        result = NEBEL_ERROR_MEMORY;
        for (long k = 0; result != NEBEL_OK; k++) {
            meter m;
            journal kept;
            const nebel_host host = metered_host(&m, &kept);
            m.fail_at = k;
            result = nebel_read_image(paths[i], &host, &back);
            nebel_free_image(&host, &back);
            assert_int_equal(m.live, 0);
            assert_true(k < 500);
        }
        unlink(paths[i]);
    }
    assert_int_equal(file_count(), 0);
    free(image.samples);
}

static int make_folder(void **state)
{
    (void)state;
    return mkdtemp(folder) == NULL;
}

static int remove_folder(void **state)
{
    (void)state;
    return rmdir(folder);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_exr_keeps_every_float),
        cmocka_unit_test(test_exr_keeps_blocks_that_compress_to_their_own_size),
        cmocka_unit_test(test_png_keeps_every_byte),
        cmocka_unit_test(test_png_rounds_without_bands_and_without_chance),
        cmocka_unit_test(test_png_takes_any_number),
        cmocka_unit_test(test_png_of_16_bit_and_with_alpha),
        cmocka_unit_test(test_exr_of_other_kinds),
        cmocka_unit_test(test_exr_in_tiles_halves_and_whole_numbers),
        cmocka_unit_test(test_exr_shows_the_display_window),
        cmocka_unit_test(test_broken_pictures_are_errors),
        cmocka_unit_test(test_giant_pictures_are_refused_before_memory_is_asked_for),
        cmocka_unit_test(test_what_is_no_picture),
        cmocka_unit_test(test_only_whole_pictures_are_written),
        cmocka_unit_test(test_a_target_is_replaced_with_its_mode_and_the_umask_holds),
        cmocka_unit_test(test_a_link_stays_and_its_target_is_replaced),
        cmocka_unit_test(test_devices_pipes_and_sockets_are_refused),
        cmocka_unit_test(test_nothing_and_open_pipes_are_written),
        cmocka_unit_test(test_streams_take_png_from_where_they_stand),
        cmocka_unit_test(test_a_failure_leaves_everything_as_it_was),
        cmocka_unit_test(test_a_folder_without_permission_is_an_error),
        cmocka_unit_test(test_every_failing_allocation_is_survived),
    };
    return cmocka_run_group_tests(tests, make_folder, remove_folder);
}
