/* JPEG pictures of textures that are not read. */
#include "scene_help.h"

#include "image/image_codec.h"

#include <jpeglib.h>

/* A black JPEG picture of 8 x 8 pixels. */
static unsigned char *make_jpeg(J_COLOR_SPACE space, int components, unsigned long *size)
{
    struct jpeg_compress_struct jpeg;
    struct jpeg_error_mgr errors;
    unsigned char row[4 * 8] = {0}, *bytes = NULL;
    JSAMPROW rows = row;
    *size = 0;
    jpeg.err = jpeg_std_error(&errors);
    jpeg_create_compress(&jpeg);
    jpeg_mem_dest(&jpeg, &bytes, size);
    jpeg.image_width = jpeg.image_height = 8;
    jpeg.input_components = components;
    jpeg.in_color_space = space;
    jpeg_set_defaults(&jpeg);
    jpeg_start_compress(&jpeg, TRUE);
    for (int y = 0; y < 8; y++) jpeg_write_scanlines(&jpeg, &rows, 1);
    jpeg_finish_compress(&jpeg);
    jpeg_destroy_compress(&jpeg);
    return bytes;
}

/* Four inks are no broken picture. */
static void test_jpeg_in_four_inks(void **state)
{
    (void)state;
    unsigned long size;
    unsigned char *bytes = make_jpeg(JCS_CMYK, 4, &size);
    journal kept = {.count = 0};
    const nebel_allocator allocator = nb_resolve_allocator(&(nebel_allocator){NULL, NULL, NULL});
    const nb_codec codec = {.allocator = allocator, .log = {remember, &kept}, .name = "cmyk.jpg"};
    const nb_bytes file = {.data = bytes, .size = size};
    nebel_texture texture;
    assert_int_equal(nb_jpeg_read_texture(&codec, &file, &texture), NEBEL_ERROR_UNSUPPORTED);
    assert_non_null(strstr(kept.last, "make it one in RGB"));
    free(bytes);
}

static void test_jpeg_that_is_cut_or_without_memory(void **state)
{
    (void)state;
    unsigned long size;
    unsigned char *bytes = make_jpeg(JCS_RGB, 3, &size);
    journal kept = {.count = 0};
    meter m = {.fail_at = 0};
    const nb_codec codec = {
        .allocator = {metered_allocate, metered_release, &m}, .log = {remember, &kept}, .name = "a.jpg"};
    nb_bytes file = {.data = bytes, .size = size};
    nebel_texture texture;
    assert_int_equal(nb_jpeg_read_texture(&codec, &file, &texture), NEBEL_ERROR_MEMORY);
    assert_string_equal(kept.last, "a.jpg: out of memory");
    m = (meter){.fail_at = 1};
    file.size = 100; /* within its tables */
    assert_int_equal(nb_jpeg_read_texture(&codec, &file, &texture), NEBEL_ERROR_FORMAT);
    assert_non_null(strstr(kept.last, "a.jpg: not a good JPEG picture: "));
    assert_null(texture.rgba);
    assert_int_equal(m.live, 0);
    free(bytes);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_jpeg_in_four_inks),
        cmocka_unit_test(test_jpeg_that_is_cut_or_without_memory),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
