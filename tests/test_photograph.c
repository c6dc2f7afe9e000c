/* Photographs, depth and cameras in files: round trips, memory that is out, damaged files. What formats mean is for
 * check_fog.py. */
#define _POSIX_C_SOURCE 200809L
#include "scene_help.h"

#include <nebel/photograph.h>

#include <math.h>
#include <unistd.h>

enum { WIDTH = 23, HEIGHT = 17, COUNT = WIDTH * HEIGHT };

static uint64_t state_of_dice = 20;

static uint32_t roll(uint32_t below)
{
    state_of_dice = state_of_dice * 6364136223846793005u + 1442695040888963407u;
    return (uint32_t)((state_of_dice >> 32) * below >> 32);
}

static char folder[] = "/tmp/nebel-photograph-XXXXXX";

static const char *in_folder(const char *name)
{
    static char paths[16][128];
    static unsigned next;
    char *const path = paths[next++ % 16];
    (void)snprintf(path, sizeof paths[0], "%s/%s", folder, name);
    return path;
}

static void write_bytes(const char *path, const void *bytes, size_t size)
{
    FILE *const file = fopen(path, "wb");
    assert_non_null(file);
    assert_int_equal(fwrite(bytes, 1, size, file), size);
    assert_int_equal(fclose(file), 0);
}

static size_t read_bytes(const char *path, unsigned char *bytes, size_t room)
{
    FILE *const file = fopen(path, "rb");
    assert_non_null(file);
    const size_t size = fread(bytes, 1, room, file);
    assert_true(size < room);
    (void)fclose(file);
    return size;
}

/* ---- files of every kind --------------------------------------------------------------------- */

typedef enum content { PICTURE, DEPTH, CAMERA } content;

static const struct {
    const char *name;
    content content;
    const char *format;
} files[] = {{"rgb8.png", PICTURE, NULL}, {"rgba16.png", PICTURE, NULL}, {"rgb.exr", PICTURE, NULL},
             {"d.png", DEPTH, "kitti"},   {"d.exr", DEPTH, "metric"},    {"f4.npy", DEPTH, "hypersim"},
             {"u2.npy", DEPTH, "tum"},    {"d.pfm", DEPTH, "metric"},    {"city.json", CAMERA, NULL},
             {"calib.txt", CAMERA, NULL}, {"cv.yml", CAMERA, NULL},      {"plain.txt", CAMERA, NULL}};

enum { FILES = sizeof files / sizeof *files };

static const char city[] =
    "{\"intrinsic\": {\"fx\": 9.5, \"fy\": 8, \"u0\": 7, \"v0\": 6}, \"extrinsic\": {\"baseline\": 0.5}}";
static const char kitti[] = "P2: 9.5 0 7 4.75 0 8 6 0 0 0 1 0\nP3: 9.5 0 7 0 0 8 6 0 0 0 1 0\n";
static const char yaml[] = "camera_matrix: !!opencv-matrix\n  data: [ 9.5, 0, 7, 0, 8, 6, 0, 0, 1 ]\n";
static const char plain[] = "9.5 8 7 6 0.5\n";

static void write_npy(const char *path, const char *type, size_t size, const void *numbers)
{
    unsigned char bytes[128 + 4 * COUNT] = "\x93NUMPY\x01\0\x76\0";
    (void)snprintf((char *)bytes + 10, 118, "{'descr': '%s', 'fortran_order': False, 'shape': (%d, %d), }", type,
                   HEIGHT, WIDTH);
    for (size_t i = 10; i < 128; i++)
        if (bytes[i] == 0) bytes[i] = ' ';
    memcpy(bytes + 128, numbers, size * COUNT);
    write_bytes(path, bytes, 128 + size * COUNT);
}

static void write_depth_files(const nebel_host *host)
{
    static const char *const z[] = {"Z"};
    static float floats[COUNT];
    static uint16_t shorts[COUNT];
    unsigned char pfm[32 + 4 * COUNT];
    for (int i = 0; i < COUNT; i++) {
        floats[i] = (float)(roll(60000) + 1) / 65535;
        shorts[i] = (uint16_t)(roll(65535) + 1);
    }
    const int head = snprintf((char *)pfm, 32, "Pf\n%d %d\n-1\n", WIDTH, HEIGHT);
    memcpy(pfm + head, floats, sizeof floats);
    write_bytes(in_folder("d.pfm"), pfm, (size_t)head + sizeof floats);
    write_npy(in_folder("f4.npy"), "<f4", 4, floats);
    write_npy(in_folder("u2.npy"), "<u2", 2, shorts);
    assert_int_equal(nebel_write_gray(in_folder("d.png"), host, WIDTH, HEIGHT, floats, NULL), NEBEL_OK);
    const nebel_image image = {WIDTH, HEIGHT, 1, z, floats};
    assert_int_equal(nebel_write_image(in_folder("d.exr"), host, &image), NEBEL_OK);
}

static void fill(nebel_photograph *photograph, nebel_pixel_type type, void *pixels)
{
    *photograph = (nebel_photograph){WIDTH, HEIGHT, type, pixels};
    unsigned char *bytes = pixels;
    for (size_t i = 0; i < COUNT * nebel_pixel_size(type); i++) bytes[i] = (unsigned char)roll(256);
    if (type != NEBEL_PIXEL_RGB_FLOAT && type != NEBEL_PIXEL_RGBA_FLOAT) return;
    for (size_t i = 0; i < COUNT * nebel_pixel_size(type) / 4; i++) ((float *)pixels)[i] = (float)roll(1000) / 64;
}

static int make_files(void **state)
{
    static float pixels[4 * COUNT];
    static const struct {
        const char *name;
        nebel_pixel_type type;
    } pictures[] = {
        {"rgb8.png", NEBEL_PIXEL_RGB8}, {"rgba16.png", NEBEL_PIXEL_RGBA16}, {"rgb.exr", NEBEL_PIXEL_RGB_FLOAT}};
    const nebel_host host = {.log = {.write = NULL}};
    (void)state;
    if (mkdtemp(folder) == NULL) return 1;
    for (size_t i = 0; i < 3; i++) {
        nebel_photograph photograph;
        fill(&photograph, pictures[i].type, pixels);
        assert_int_equal(nebel_write_photograph(in_folder(pictures[i].name), &host, &photograph, NULL), NEBEL_OK);
    }
    write_depth_files(&host);
    write_bytes(in_folder("city.json"), city, sizeof city - 1);
    write_bytes(in_folder("calib.txt"), kitti, sizeof kitti - 1);
    write_bytes(in_folder("cv.yml"), yaml, sizeof yaml - 1);
    write_bytes(in_folder("plain.txt"), plain, sizeof plain - 1);
    return 0;
}

static int remove_files(void **state)
{
    (void)state;
    for (size_t i = 0; i < FILES; i++) (void)unlink(in_folder(files[i].name));
    (void)unlink(in_folder("out.png"));
    (void)unlink(in_folder("out.exr"));
    (void)unlink(in_folder("damaged"));
    return rmdir(folder);
}

/* ---- reading anything ------------------------------------------------------------------------ */

static void check_depth(const nebel_depth_map *map)
{
    const size_t count = (size_t)map->width * map->height;
    size_t unknown = 0;
    for (size_t i = 0; i < count; i++) {
        unknown += isnan(map->depth[i]) != 0;
        assert_true(isnan(map->depth[i]) || map->depth[i] > 0);
    }
    assert_int_equal(unknown, map->unknown_count);
    assert_true(unknown < count);
}

/* Whatever comes is whole, and goes again; an error leaves nothing. */
static nebel_result read_file(const char *path, content what, const char *format, const nebel_host *host)
{
    nebel_photograph photograph;
    nebel_depth_map map;
    nebel_intrinsics camera;
    nebel_result result;
    if (what == PICTURE) {
        result = nebel_read_photograph(path, host, &photograph);
        assert_true((result == NEBEL_OK) == (photograph.pixels != NULL));
        nebel_free_photograph(host, &photograph);
    } else if (what == DEPTH) {
        result = nebel_read_depth(path, &(nebel_depth_source){.format = format}, host, &map);
        assert_true((result == NEBEL_OK) == (map.depth != NULL));
        if (result == NEBEL_OK) check_depth(&map);
        nebel_fill_depth(&map);
        nebel_free_depth(host, &map);
    } else {
        result = nebel_read_intrinsics(path, host, &camera);
        assert_true((result == NEBEL_OK) == (camera.fx > 0 && camera.fx < HUGE_VAL));
    }
    return result;
}

static void test_pictures_come_back_as_they_were(void **state)
{
    (void)state;
    static float pixels[4 * COUNT];
    const nebel_host host = {.log = {.write = NULL}};
    for (nebel_pixel_type type = NEBEL_PIXEL_RGBA8; type < NEBEL_PIXEL_COUNT; type++) {
        nebel_photograph photograph, back;
        char record[NEBEL_MAX_RECORD + 1];
        const int is_float = type == NEBEL_PIXEL_RGB_FLOAT || type == NEBEL_PIXEL_RGBA_FLOAT;
        const char *const path = in_folder(is_float ? "out.exr" : "out.png");
        fill(&photograph, type, pixels);
        const nebel_result result = nebel_write_photograph(path, &host, &photograph, "nebel test");
        if (type == NEBEL_PIXEL_RGB_HALF || type == NEBEL_PIXEL_RGBA_HALF) {
            assert_int_equal(result, NEBEL_ERROR_FORMAT);
            continue;
        }
        assert_int_equal(result, NEBEL_OK);
        assert_int_equal(nebel_read_photograph(path, &host, &back), NEBEL_OK);
        assert_int_equal(back.type, type);
        assert_int_equal(nebel_read_record(path, record), NEBEL_OK);
        assert_string_equal(record, "nebel test");
        assert_memory_equal(back.pixels, pixels, COUNT * nebel_pixel_size(type));
        nebel_free_photograph(&host, &back);
    }
}

static void test_records_of_gray(void **state)
{
    (void)state;
    char record[NEBEL_MAX_RECORD + 1];
    const char *const path = in_folder("out.png");
    const nebel_host host = {.log = {.write = NULL}};
    const float half = 0.5f;
    float light[3] = {0};
    const nebel_photograph photograph = {1, 1, NEBEL_PIXEL_RGB_FLOAT, light};
    assert_int_equal(nebel_write_gray(path, &host, 1, 1, &half, "gray"), NEBEL_OK);
    assert_int_equal(nebel_write_gray(path, &host, 1, 1, &half, "of\ntwo lines"), NEBEL_ERROR_ARGUMENT);
    assert_int_equal(nebel_write_gray(path, &host, 1, 1, &half, ""), NEBEL_ERROR_ARGUMENT);
    assert_int_equal(nebel_write_photograph(in_folder("out.exr"), &host, &photograph, "\x7f"), NEBEL_ERROR_ARGUMENT);
    assert_int_equal(nebel_read_record(path, record), NEBEL_OK);
    assert_string_equal(record, "gray");
}

static void test_every_kind_of_camera_file(void **state)
{
    (void)state;
    for (size_t i = 0; i < FILES; i++) {
        nebel_intrinsics camera;
        if (files[i].content != CAMERA) continue;
        assert_int_equal(nebel_read_intrinsics(in_folder(files[i].name), &(nebel_host){.log = {NULL, NULL}}, &camera),
                         NEBEL_OK);
        assert_true(camera.fx == 9.5 && camera.fy == 8 && camera.cx == 7 && camera.cy == 6);
        assert_true(camera.baseline == (strcmp(files[i].name, "cv.yml") == 0 ? 0 : .5));
    }
}

static void test_every_failing_allocation_is_survived(void **state)
{
    (void)state;
    for (size_t i = 0; i < FILES; i++) {
        nebel_result result = NEBEL_ERROR_MEMORY;
        for (long k = 0; result != NEBEL_OK; k++) {
            meter m;
            journal kept;
            const nebel_host host = metered_host(&m, &kept);
            m.fail_at = k;
            result = read_file(in_folder(files[i].name), files[i].content, files[i].format, &host);
            if (result != NEBEL_OK) assert_int_equal(result, NEBEL_ERROR_MEMORY);
            assert_true(result == NEBEL_OK || kept.count > 0);
            assert_int_equal(m.live, 0);
            assert_true(k < 500);
        }
    }
}

static void test_damaged_files_are_errors_or_pictures(void **state)
{
    (void)state;
    static unsigned char whole[1 << 16], bytes[1 << 16];
    const size_t rounds = nb_test_count(60);
    for (size_t i = 0; i < FILES; i++) {
        const size_t size = read_bytes(in_folder(files[i].name), whole, sizeof whole);
        for (size_t round = 0; round < rounds; round++) {
            meter m;
            journal kept;
            const nebel_host host = metered_host(&m, &kept);
            const uint32_t early = (uint32_t)(size < 200 ? size : 200);
            memcpy(bytes, whole, size);
            for (uint32_t n = roll(4); n < 4; n++)
                bytes[roll(n == 0 ? (uint32_t)size : early)] = (unsigned char)roll(256);
            write_bytes(in_folder("damaged"), bytes, roll(3) == 0 ? roll((uint32_t)size) : size);
            const nebel_result result = read_file(in_folder("damaged"), files[i].content, files[i].format, &host);
            assert_true(result == NEBEL_OK || kept.count > 0);
            assert_int_equal(m.live, 0);
        }
    }
}

/* ---- airlight -------------------------------------------------------------------------------- */

typedef struct candidate {
    int dark, bright;
    size_t pixel;
} candidate;

static int compare_dark(const void *a, const void *b)
{
    const candidate *const x = a, *const y = b;
    return x->dark != y->dark ? y->dark - x->dark : x->pixel < y->pixel ? -1 : 1;
}

static int compare_bright(const void *a, const void *b)
{
    const candidate *const x = a, *const y = b;
    return x->bright != y->bright ? x->bright - y->bright : x->pixel < y->pixel ? -1 : 1;
}

static int darkest_around(const unsigned char *rgb, int width, int height, int x, int y)
{
    int least = 255;
    for (int v = y - 7; v <= y + 7; v++)
        for (int u = x - 7; u <= x + 7; u++)
            for (int c = 0; c < 3 && u >= 0 && u < width && v >= 0 && v < height; c++)
                if (rgb[3 * (v * width + u) + c] < least) least = rgb[3 * (v * width + u) + c];
    return least;
}

/* Sorted in full. */
static size_t find_airlight(const unsigned char *rgb, int width, int height, candidate *all)
{
    const size_t count = (size_t)(width * height);
    size_t chosen = count / 1000 > 1 ? count / 1000 : 1;
    for (size_t i = 0; i < count; i++)
        all[i] =
            (candidate){darkest_around(rgb, width, height, (int)i % width, (int)i / width),
                        (int)((299 * rgb[3 * i] + 587 * rgb[3 * i + 1] + 114 * rgb[3 * i + 2]) * 257 / 1000. + .5), i};
    qsort(all, count, sizeof *all, compare_dark);
    while (chosen < count && all[chosen].dark == all[chosen - 1].dark) chosen++;
    qsort(all, chosen, sizeof *all, compare_bright);
    return all[(chosen - 1) / 2].pixel;
}

static void test_airlight_of_any_size_is_found(void **state)
{
    (void)state;
    enum { MOST = 70 * 60 };
    static unsigned char rgb[3 * MOST];
    static candidate all[MOST];
    static const int sizes[][2] = {{1, 1}, {1, 9}, {15, 1}, {3, 2}, {8, 7}, {14, 16}, {70, 5}, {5, 60}, {70, 60}};
    for (size_t s = 0; s < sizeof sizes / sizeof *sizes; s++) {
        double airlight[3];
        const int width = sizes[s][0], height = sizes[s][1];
        for (int i = 0; i < 3 * width * height; i++) rgb[i] = (unsigned char)roll(i % 600 < 300 ? 256 : 90);
        const nebel_photograph photograph = {(uint32_t)width, (uint32_t)height, NEBEL_PIXEL_RGB8, rgb};
        assert_int_equal(nebel_estimate_airlight(&(nebel_host){.log = {NULL, NULL}}, &photograph, airlight), NEBEL_OK);
        const size_t wanted = find_airlight(rgb, width, height, all);
        for (size_t c = 0; c < 3; c++) assert_true(fabs(airlight[c] * 255 - rgb[3 * wanted + c]) < 1e-9);
    }
}

/* What is asked for must fit the format, and the picture must hold single numbers. */
static void test_depth_that_is_no_depth(void **state)
{
    (void)state;
    static const float values[4] = {.1f, .2f, .3f, .4f};
    static uint16_t color[12] = {1, 2, 3};
    static const struct {
        nebel_depth_source source;
        nebel_result result;
    } cases[] = {{{.format = "kitti"}, NEBEL_OK},
                 {{.scale = .5}, NEBEL_OK},
                 {{.format = "paper"}, NEBEL_ERROR_ARGUMENT},
                 {{.scale = -1}, NEBEL_ERROR_ARGUMENT},
                 {{.scale = 1e10}, NEBEL_ERROR_ARGUMENT},
                 {{.format = "kitti", .scale = 2}, NEBEL_ERROR_ARGUMENT},
                 {{.format = "cityscapes", .measure = NEBEL_MEASURE_RADIAL}, NEBEL_ERROR_ARGUMENT}};
    const nebel_host host = {.log = {NULL, NULL}};
    const char *const path = in_folder("out.png");
    nebel_depth_map map;
    assert_int_equal(nebel_write_gray(path, &host, 2, 2, values, NULL), NEBEL_OK);
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        assert_int_equal(nebel_read_depth(path, &cases[i].source, &host, &map), cases[i].result);
        nebel_free_depth(&host, &map);
    }
    const nebel_photograph photograph = {2, 2, NEBEL_PIXEL_RGB16, (unsigned char *)color};
    assert_int_equal(nebel_write_photograph(path, &host, &photograph, NULL), NEBEL_OK);
    assert_int_equal(nebel_read_depth(path, &cases[0].source, &host, &map), NEBEL_ERROR_UNSUPPORTED);
}

/* Light above 1 is no less than stored color; a number that is none has no light. */
static void test_airlight_of_light_is_that_of_the_haze(void **state)
{
    (void)state;
    enum { ACROSS = 48, DOWN = 32 };
    static float light[4 * ACROSS * DOWN];
    static const float haze[3] = {4.5f, 3.75f, 3.25f};
    const nebel_host host = {.log = {NULL, NULL}};
    nebel_photograph photograph = {ACROSS, DOWN, NEBEL_PIXEL_RGBA_FLOAT, (unsigned char *)light};
    double airlight[3];
    for (int i = 0; i < ACROSS * DOWN; i++)
        for (int c = 0; c < 3; c++)
            light[4 * i + c] = i % ACROSS >= 20 && i / ACROSS < 24 ? haze[c] : .01f * (float)roll(300);
    light[0] = NAN;
    assert_int_equal(nebel_estimate_airlight(&host, &photograph, airlight), NEBEL_OK);
    for (int c = 0; c < 3; c++) assert_true((float)airlight[c] == haze[c]);
    photograph.type = NEBEL_PIXEL_RGBA_HALF;
    assert_int_equal(nebel_estimate_airlight(&host, &photograph, airlight), NEBEL_ERROR_ARGUMENT);
    photograph = (nebel_photograph){ACROSS, 0, NEBEL_PIXEL_RGBA_FLOAT, (unsigned char *)light};
    assert_int_equal(nebel_estimate_airlight(&host, &photograph, airlight), NEBEL_ERROR_ARGUMENT);
}

/* ---- rays ------------------------------------------------------------------------------------ */

static void test_cameras_look_through_their_pixels(void **state)
{
    (void)state;
    const nebel_camera camera = {.position = {1, 2, 3}, .look_at = {1, 2, 13}, .up = {0, 5, 1}};
    const nebel_intrinsics view = nebel_intrinsics_of_view(90, 200, 100);
    nebel_pixels pixels = {.width = 200, .height = 100};
    assert_int_equal(nebel_aim_pixels(&pixels, &view, &camera), NEBEL_OK);
    /* Ahead is +z and up +y, so right is -x. 90 degrees go from -1/2 to 199 1/2. */
    const double left = (double)pixels.corner[0] - .5 * (double)pixels.step_x[0];
    assert_true(fabs(left - 1) < 1e-6 && fabs((double)pixels.corner[2] - 1) < 1e-6);
    assert_true(fabs((double)pixels.corner[1] - .495) < 1e-6 && fabs((double)pixels.step_y[1] + .01) < 1e-8);
    assert_true(pixels.eye[0] == 1 && pixels.eye[1] == 2 && pixels.eye[2] == 3);
    assert_int_equal(nebel_aim_pixels(&pixels, &view, NULL), NEBEL_OK);
    assert_true(pixels.corner[2] == -1 && pixels.corner[0] < 0 && pixels.corner[1] > 0);
    const nebel_intrinsics bad[] = {
        {0, 1, 1, 1, 0}, {1, -1, 1, 1, 0}, {1, 1, (double)NAN, 1, 0}, {HUGE_VAL, 1, 1, 1, 0}};
    for (size_t i = 0; i < sizeof bad / sizeof *bad; i++)
        assert_int_equal(nebel_aim_pixels(&pixels, &bad[i], NULL), NEBEL_ERROR_ARGUMENT);
    const nebel_camera blind = {.up = {0, 1, 0}};
    assert_int_equal(nebel_aim_pixels(&pixels, &view, &blind), NEBEL_ERROR_ARGUMENT);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_pictures_come_back_as_they_were),
        cmocka_unit_test(test_records_of_gray),
        cmocka_unit_test(test_every_kind_of_camera_file),
        cmocka_unit_test(test_every_failing_allocation_is_survived),
        cmocka_unit_test(test_damaged_files_are_errors_or_pictures),
        cmocka_unit_test(test_depth_that_is_no_depth),
        cmocka_unit_test(test_airlight_of_any_size_is_found),
        cmocka_unit_test(test_airlight_of_light_is_that_of_the_haze),
        cmocka_unit_test(test_cameras_look_through_their_pixels),
    };
    return cmocka_run_group_tests(tests, make_files, remove_files);
}
