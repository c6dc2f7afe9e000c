/* Pictures that are written a few rows at a time, and the records of what pictures and films were made from. */
#define _GNU_SOURCE
#include "dice.h"
#include "scarce_memory.h"
#include "scene_help.h"

#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

enum { WIDTH = 333, HEIGHT = 250 };

static char folder[] = "/tmp/nebel_record_XXXXXX";
static const char record[] = "nebel 9.9.9 0123456789abcdef";
static const char *const names[] = {"R", "G", "B", "depth.Z"};
static const char *const endings[] = {"png", "exr"};
static float *samples;

static const char *in_folder(const char *name)
{
    static char path[8][200];
    static int next;
    next = (next + 1) % 8;
    snprintf(path[next], sizeof path[next], "%s/%s", folder, name);
    return path[next];
}

static const char *numbered(const char *stem, size_t i)
{
    char name[40];
    snprintf(name, sizeof name, "%s.%s", stem, endings[i]);
    return in_folder(name);
}

/* More than a writer keeps back, and nothing that compresses. */
static int make_samples(void **state)
{
    uint64_t seed = 5;
    (void)state;
    samples = malloc(sizeof(float) * WIDTH * HEIGHT * 4);
    for (size_t i = 0; i < (size_t)WIDTH * HEIGHT * 4; i++) samples[i] = (float)dice(&seed, 0, 1);
    return mkdtemp(folder) == NULL;
}

static int remove_folder(void **state)
{
    (void)state;
    free(samples);
    return rmdir(folder); /* which must be empty */
}

static unsigned char *read_file(const char *path, size_t *size)
{
    struct stat status;
    assert_int_equal(stat(path, &status), 0);
    *size = (size_t)status.st_size;
    unsigned char *bytes = malloc(*size + 1);
    FILE *file = fopen(path, "rb");
    assert_non_null(file);
    assert_int_equal(fread(bytes, 1, *size, file), *size);
    fclose(file);
    return bytes;
}

static void assert_same_files(const char *a, const char *b)
{
    size_t sizes[2];
    unsigned char *bytes[2] = {read_file(a, &sizes[0]), read_file(b, &sizes[1])};
    assert_int_equal(sizes[0], sizes[1]);
    assert_memory_equal(bytes[0], bytes[1], sizes[0]);
    free(bytes[0]);
    free(bytes[1]);
}

static nebel_image_desc desc_of(const char *with)
{
    return (nebel_image_desc){
        .width = WIDTH, .height = HEIGHT, .channel_count = 4, .channel_names = names, .record = with};
}

static nebel_result write_rows(const char *path, const nebel_image_desc *desc, uint32_t step)
{
    nebel_image_writer *writer = NULL;
    nebel_result result = nebel_create_image_writer(path, desc, &writer);
    for (uint32_t y = 0; y < HEIGHT && result == NEBEL_OK; y += step)
        result = nebel_add_image_rows(writer, y + step <= HEIGHT ? step : HEIGHT - y, samples + (size_t)y * WIDTH * 4);
    if (result == NEBEL_OK) result = nebel_finish_image(writer);
    nebel_destroy_image_writer(writer);
    return result;
}

/* ---- rows ------------------------------------------------------------------------------------ */

static void test_rows_make_the_same_file(void **state)
{
    (void)state;
    const nebel_image image = {WIDTH, HEIGHT, 4, names, samples};
    for (size_t i = 0; i < 2; i++) {
        const char *whole = numbered("whole", i), *rows = numbered("rows", i);
        assert_int_equal(nebel_write_image(whole, &(nebel_host){0}, &image), NEBEL_OK);
        for (uint32_t step = 64; step <= 256; step += 64) {
            const nebel_image_desc desc = desc_of(NULL);
            assert_int_equal(write_rows(rows, &desc, step), NEBEL_OK);
            assert_same_files(whole, rows);
        }
        nebel_image back;
        assert_int_equal(nebel_read_image(rows, &(nebel_host){0}, &back), NEBEL_OK);
        assert_int_equal(back.height, HEIGHT);
        if (i == 1) assert_memory_equal(back.samples, samples, sizeof(float) * WIDTH * HEIGHT * 4);
        nebel_free_image(&(nebel_host){0}, &back);
        assert_int_equal(remove(whole), 0);
        assert_int_equal(remove(rows), 0);
    }
}

static void test_a_picture_is_whole_or_not_there(void **state)
{
    (void)state;
    for (size_t i = 0; i < 2; i++) {
        const char *path = numbered("part", i);
        const nebel_image_desc desc = desc_of(record);
        nebel_image_writer *writer = NULL;
        assert_int_equal(nebel_create_image_writer(path, &desc, &writer), NEBEL_OK);
        assert_int_equal(nebel_add_image_rows(writer, 63, samples), NEBEL_ERROR_ARGUMENT);
        assert_int_equal(nebel_add_image_rows(writer, 0, samples), NEBEL_ERROR_ARGUMENT);
        assert_int_equal(nebel_add_image_rows(writer, 512, samples), NEBEL_ERROR_ARGUMENT);
        assert_int_equal(nebel_add_image_rows(writer, 64, samples), NEBEL_OK);
        assert_int_equal(nebel_finish_image(writer), NEBEL_ERROR_ARGUMENT);
        nebel_destroy_image_writer(writer);
        assert_int_equal(access(path, F_OK), -1);
        assert_int_equal(nebel_create_image_writer(path, &desc, &writer), NEBEL_OK);
        assert_int_equal(nebel_add_image_rows(writer, HEIGHT, samples), NEBEL_OK);
        assert_int_equal(nebel_add_image_rows(writer, 64, samples), NEBEL_ERROR_ARGUMENT);
        assert_int_equal(nebel_finish_image(writer), NEBEL_OK);
        assert_int_equal(nebel_finish_image(writer), NEBEL_ERROR_ARGUMENT);
        nebel_destroy_image_writer(writer);
        assert_int_equal(remove(path), 0);
    }
}

static void test_memory_that_is_out(void **state)
{
    (void)state;
    for (size_t i = 0; i < 2; i++) {
        const char *path = numbered("scarce", i);
        nebel_result result = NEBEL_ERROR_MEMORY;
        for (int most = 0; result != NEBEL_OK; most++) {
            int left = most;
            nebel_image_desc desc = desc_of(record);
            desc.host.allocator = (nebel_allocator){scarce_allocate, scarce_release, &left};
            result = write_rows(path, &desc, 128);
            if (result != NEBEL_OK) assert_int_equal(result, NEBEL_ERROR_MEMORY);
            assert_true(most < 1000);
        }
        assert_int_equal(remove(path), 0);
    }
}

/* ---- records --------------------------------------------------------------------------------- */

static void test_records_come_back(void **state)
{
    (void)state;
    char longest[NEBEL_MAX_RECORD + 1], found[NEBEL_MAX_RECORD + 1];
    memset(longest, '~', NEBEL_MAX_RECORD);
    longest[NEBEL_MAX_RECORD] = '\0';
    const char *const records[] = {record, "x", longest, NULL};
    for (size_t i = 0; i < 2; i++)
        for (size_t k = 0; k < sizeof records / sizeof *records; k++) {
            const nebel_image_desc desc = desc_of(records[k]);
            const char *path = numbered("record", i);
            assert_int_equal(write_rows(path, &desc, 64), NEBEL_OK);
            assert_int_equal(nebel_read_record(path, found), NEBEL_OK);
            assert_string_equal(found, records[k] != NULL ? records[k] : "");
            assert_int_equal(remove(path), 0);
        }
}

static void test_bad_records_are_refused(void **state)
{
    (void)state;
    char too_long[NEBEL_MAX_RECORD + 2];
    memset(too_long, 'a', sizeof too_long);
    too_long[NEBEL_MAX_RECORD + 1] = '\0';
    const char *const records[] = {"", "a\nb", "\x7f", "\xc3\xa4", too_long};
    for (size_t k = 0; k < sizeof records / sizeof *records; k++) {
        const nebel_image_desc desc = desc_of(records[k]);
        assert_int_equal(write_rows(in_folder("bad.png"), &desc, 64), NEBEL_ERROR_ARGUMENT);
    }
}

/* Every beginning of a file but the whole of it has no record; damage may take it away, and does no harm. */
static void try_damage(const char *path)
{
    char found[NEBEL_MAX_RECORD + 1];
    uint64_t seed = 7;
    size_t size;
    unsigned char *bytes = read_file(path, &size);
    char damaged[64];
    const int memory = memfd_create("damaged", MFD_CLOEXEC);
    snprintf(damaged, sizeof damaged, "/proc/self/fd/%d", memory);
    assert_int_equal(pwrite(memory, bytes, size, 0), (ssize_t)size);
    for (size_t left = size - 1; left > 0; left = left > 200 ? left - 1 - left / 20 : left - 1) {
        assert_int_equal(ftruncate(memory, (off_t)left), 0);
        assert_int_equal(nebel_read_record(damaged, found), NEBEL_OK);
        assert_string_equal(found, "");
    }
    assert_int_equal(pwrite(memory, bytes, size, 0), (ssize_t)size);
    for (size_t i = 0; i < 2000; i++) {
        const size_t head = size < 1000 ? size : 1000, at = (size_t)(dice(&seed, 0, 1) * (double)head);
        const unsigned char changed = (unsigned char)(256 * dice(&seed, 0, 1));
        assert_int_equal(pwrite(memory, &changed, 1, (off_t)at), 1);
        assert_int_equal(nebel_read_record(damaged, found), NEBEL_OK);
        assert_true(strlen(found) <= NEBEL_MAX_RECORD);
        assert_int_equal(pwrite(memory, bytes + at, 1, (off_t)at), 1);
    }
    assert_int_equal(nebel_read_record(damaged, found), NEBEL_OK);
    assert_string_equal(found, record);
    close(memory);
    free(bytes);
}

static void test_files_that_are_not_whole_have_no_record(void **state)
{
    (void)state;
    char found[NEBEL_MAX_RECORD + 1];
    for (size_t i = 0; i < 2; i++) {
        const nebel_image_desc desc = desc_of(record);
        const char *path = numbered("cut", i);
        assert_int_equal(write_rows(path, &desc, 64), NEBEL_OK);
        try_damage(path);
        assert_int_equal(remove(path), 0);
    }
    assert_int_equal(nebel_read_record(in_folder("nothing.png"), found), NEBEL_OK);
    assert_string_equal(found, "");
    assert_int_equal(nebel_read_record(folder, found), NEBEL_OK);
    assert_string_equal(found, "");
    assert_int_equal(mkfifo(in_folder("pipe.png"), 0600), 0);
    assert_int_equal(nebel_read_record(in_folder("pipe.png"), found), NEBEL_OK);
    assert_string_equal(found, "");
    assert_int_equal(remove(in_folder("pipe.png")), 0);
}

static void write_file(const char *path, const unsigned char *bytes, size_t size)
{
    FILE *file = fopen(path, "wb");
    assert_non_null(file);
    assert_int_equal(fwrite(bytes, 1, size, file), size);
    assert_int_equal(fclose(file), 0);
}

/* A file of which a byte behind the first ones has changed has no record, or still the same picture. */
static void try_changed_bytes(const char *path, size_t first)
{
    char found[NEBEL_MAX_RECORD + 1];
    uint64_t seed = 9;
    size_t size, lost = 0;
    unsigned char *bytes = read_file(path, &size);
    nebel_image before, after;
    assert_int_equal(nebel_read_image(path, &(nebel_host){0}, &before), NEBEL_OK);
    for (int i = 0; i < 300; i++) {
        const size_t at = first + (size_t)(dice(&seed, 0, 1) * (double)(size - first));
        const unsigned char was = bytes[at];
        bytes[at] ^= (unsigned char)(1 << (int)dice(&seed, 0, 8));
        write_file(path, bytes, size);
        bytes[at] = was;
        assert_int_equal(nebel_read_record(path, found), NEBEL_OK);
        lost += strcmp(found, record) != 0;
        if (strcmp(found, record) != 0) continue;
        assert_int_equal(nebel_read_image(path, &(nebel_host){0}, &after), NEBEL_OK);
        assert_memory_equal(before.samples, after.samples,
                            sizeof(float) * before.width * before.height * before.channel_count);
        nebel_free_image(&(nebel_host){0}, &after);
    }
    assert_true(lost > 280); /* a few bits are padding */
    nebel_free_image(&(nebel_host){0}, &before);
    free(bytes);
}

static void test_pictures_with_changed_bytes_have_no_record(void **state)
{
    (void)state;
    for (size_t i = 0; i < WIDTH * HEIGHT * 4; i++) samples[i] = (float)(i % 1000) / 1000; /* compresses */
    for (size_t i = 0; i < 2; i++) {
        const nebel_image_desc desc = desc_of(record);
        const char *path = numbered("changed", i);
        assert_int_equal(write_rows(path, &desc, 64), NEBEL_OK);
        try_changed_bytes(path, i == 1 ? 1000 : 0); /* OpenEXR has no checksum of its headers */
        assert_int_equal(remove(path), 0);
    }
}

/* ---- films ----------------------------------------------------------------------------------- */

static nebel_result make_film(const char *path, uint32_t count, const char *with)
{
    nebel_movie *film = NULL;
    nebel_result result = nebel_create_movie(path, &(nebel_movie_desc){.quality = 100}, &film);
    if (result == NEBEL_OK && with != NULL) result = nebel_set_movie_record(film, with);
    for (uint32_t i = 0; i < count && result == NEBEL_OK; i++) {
        const nebel_image image = {31, 17, 4, names, samples + 1000 * i};
        result = nebel_add_movie_frame(film, &image);
    }
    if (result == NEBEL_OK) result = nebel_finish_movie(film);
    nebel_destroy_movie(film);
    return result;
}

static void test_films_have_records(void **state)
{
    (void)state;
    char found[NEBEL_MAX_RECORD + 1];
    const char *plain = in_folder("plain.webp"), *path = in_folder("film.webp");
    for (uint32_t count = 1; count <= 3; count++) {
        const nebel_result result = make_film(plain, count, NULL);
        if (result == NEBEL_ERROR_UNSUPPORTED) return;
        assert_int_equal(result, NEBEL_OK);
        assert_int_equal(nebel_read_record(plain, found), NEBEL_OK);
        assert_string_equal(found, "");
        assert_int_equal(make_film(path, count, record), NEBEL_OK);
        assert_int_equal(nebel_read_record(path, found), NEBEL_OK);
        assert_string_equal(found, record);
        size_t sizes[2];
        unsigned char *bytes[2] = {read_file(plain, &sizes[0]), read_file(path, &sizes[1])};
        assert_memory_equal(bytes[0] + 8, bytes[1] + 8, sizes[0] - 8);
        assert_int_equal(sizes[1], sizes[0] + 8 + sizeof record - 1);
        free(bytes[0]);
        free(bytes[1]);
        try_damage(path);
    }
    assert_int_equal(make_film(path, 1, ""), NEBEL_ERROR_ARGUMENT);
    assert_int_equal(remove(plain), 0);
    assert_int_equal(remove(path), 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_rows_make_the_same_file),
        cmocka_unit_test(test_a_picture_is_whole_or_not_there),
        cmocka_unit_test(test_memory_that_is_out),
        cmocka_unit_test(test_records_come_back),
        cmocka_unit_test(test_bad_records_are_refused),
        cmocka_unit_test(test_files_that_are_not_whole_have_no_record),
        cmocka_unit_test(test_films_have_records),
        cmocka_unit_test(test_pictures_with_changed_bytes_have_no_record),
    };
    return cmocka_run_group_tests(tests, make_samples, remove_folder);
}
