/* Models with holes: what of their materials makes them. */
#define _GNU_SOURCE
#include "model_help.h"

#include <math.h>
#include <png.h>

enum { LEAF = 4 };

/* A picture of LEAF x LEAF pixels whose last bytes, alpha or grey, are 60 times the column. Returns its size. */
static size_t make_leaf(png_uint_32 format, unsigned char *file, size_t room)
{
    unsigned char pixels[LEAF * LEAF * 4];
    const size_t channels = PNG_IMAGE_SAMPLE_CHANNELS(format);
    png_image picture = {.version = PNG_IMAGE_VERSION, .width = LEAF, .height = LEAF, .format = format};
    png_alloc_size_t size = room;
    for (size_t i = 0; i < LEAF * LEAF * channels; i++)
        pixels[i] = (unsigned char)(i % channels == channels - 1 ? 60 * (i / channels % LEAF) : 90);
    assert_true(png_image_write_to_memory(&picture, file, &size, 0, pixels, 0, NULL));
    return size;
}

static void write_leaf(const char *name, png_uint_32 format)
{
    unsigned char bytes[1000];
    const size_t size = make_leaf(format, bytes, sizeof bytes);
    FILE *file = fopen(in_folder(name), "wb");
    fwrite(bytes, 1, size, file);
    fclose(file);
}

static void write_number(FILE *file, uint32_t number)
{
    for (int i = 0; i < 4; i++) fputc((int)(number >> 8 * i & 255), file);
}

/* A triangle in leaf.glb whose picture is in the file, with these members in its material and its pbrMetallicRoughness;
 * and attributes of its mesh besides the position. */
static void write_leaf_glb(const char *material, const char *base, const char *attributes)
{
    static const float numbers[15] = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 1, 1, 1, 0, 0};
    unsigned char binary[1000] = {0};
    char text[2000];
    memcpy(binary, numbers, sizeof numbers);
    const size_t picture = make_leaf(PNG_FORMAT_RGBA, binary + 60, sizeof binary - 60),
                 size = (60 + picture + 3) / 4 * 4;
    const int length =
        snprintf(text, sizeof text,
                 "{\"asset\":{\"version\":\"2.0\"},\"scene\":0,\"scenes\":[{\"nodes\":[0]}],\"nodes\":[{\"mesh\":0}],"
                 "\"meshes\":[{\"primitives\":[{\"attributes\":{\"POSITION\":0%s},\"material\":0}]}],"
                 "\"materials\":[{%s\"pbrMetallicRoughness\":{%s\"baseColorTexture\":{\"index\":0}}}],"
                 "\"textures\":[{\"source\":0}],\"images\":[{\"bufferView\":2,\"mimeType\":\"image/png\"}],"
                 "\"accessors\":[{\"bufferView\":0,\"componentType\":5126,\"count\":3,\"type\":\"VEC3\","
                 "\"min\":[0,0,0],\"max\":[1,1,0]},{\"bufferView\":1,\"componentType\":5126,\"count\":3,"
                 "\"type\":\"VEC2\"}],\"bufferViews\":[{\"buffer\":0,\"byteLength\":36},"
                 "{\"buffer\":0,\"byteOffset\":36,\"byteLength\":24},"
                 "{\"buffer\":0,\"byteOffset\":60,\"byteLength\":%zu}],\"buffers\":[{\"byteLength\":%zu}]}",
                 attributes, material, base, picture, size);
    const uint32_t padded = ((uint32_t)length + 3) / 4 * 4;
    FILE *file = fopen(in_folder("leaf.glb"), "wb");
    fputs("glTF", file);
    write_number(file, 2);
    write_number(file, 28 + padded + (uint32_t)size);
    write_number(file, padded);
    fputs("JSON", file);
    fprintf(file, "%-*s", (int)padded, text);
    write_number(file, (uint32_t)size);
    fwrite("BIN", 1, 4, file);
    fwrite(binary, 1, size, file);
    fclose(file);
}

/* Loads the model of these members: its cutoff, and how its mask and its texture are. */
static float load_cutoff(const char *members, int has_texture)
{
    nebel_scene *scene = load_good(members);
    const nebel_scene_data *data = nebel_get_scene_data(scene);
    assert_int_equal(data->mesh_count, 1);
    const nebel_mesh *mesh = &data->meshes[0];
    const float cutoff = mesh->alpha_cutoff;
    assert_int_equal(mesh->texture >= 0, has_texture);
    assert_int_equal(mesh->mask >= 0, cutoff > 0);
    if (cutoff > 0) {
        assert_non_null(mesh->uvs);
        assert_true((size_t)mesh->mask < data->texture_count);
        for (size_t i = 0; i < LEAF; i++) assert_int_equal(data->textures[mesh->mask].rgba[4 * i + 3], 60 * i);
    }
    nebel_destroy_scene(scene);
    return cutoff;
}

typedef struct alpha_case {
    const char *material, *base;
    float cutoff;
} alpha_case;

/* Alpha in the picture is 0, 60, 120 or 180 of 255. */
static void test_alpha_of_gltf_makes_holes(void **state)
{
    (void)state;
    static const char with_uv[] = ",\"TEXCOORD_0\":1";
    static const alpha_case cases[] = {
        {"\"alphaMode\":\"MASK\",", "", .5f},
        {"\"alphaMode\":\"MASK\",\"alphaCutoff\":0.25,", "", .25f},
        {"\"alphaMode\":\"MASK\",\"alphaCutoff\":0.25,", "\"baseColorFactor\":[1,1,1,0.5],", .5f},
        {"\"alphaMode\":\"MASK\",\"alphaCutoff\":0,", "", 0},
        {"\"alphaMode\":\"BLEND\",", "\"baseColorFactor\":[1,1,1,0.1],", .5f},
        {"\"alphaMode\":\"OPAQUE\",\"alphaCutoff\":0.5,", "", 0},
        {"", "", 0},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        write_leaf_glb(cases[i].material, cases[i].base, with_uv);
        assert_true(fabsf(load_cutoff("\"file\": \"leaf.glb\"", 1) - cases[i].cutoff) < 1e-6f);
        assert_true(fabsf(load_cutoff("\"file\": \"leaf.glb\", \"color\": 0.5", 0) - cases[i].cutoff) < 1e-6f);
    }
}

static void test_a_model_that_is_one_hole_is_told(void **state)
{
    (void)state;
    static const char *const materials[] = {"\"alphaMode\":\"MASK\",\"alphaCutoff\":0.75,",
                                            "\"alphaMode\":\"MASK\",\"alphaCutoff\":1e30,"};
    for (int i = 0; i < 2; i++) {
        write_leaf_glb(materials[i], "", ",\"TEXCOORD_0\":1");
        assert_broken("\"file\": \"leaf.glb\"", NEBEL_ERROR_FORMAT, "holds no triangle");
    }
}

static void assert_noted(const char *members, const char *message)
{
    journal kept;
    nebel_result result;
    nebel_scene *scene = load(members, &result, &kept);
    assert_int_equal(result, NEBEL_OK);
    assert_non_null(strstr(kept.last, message));
    assert_true(nebel_get_scene_data(scene)->meshes[0].alpha_cutoff == 0);
    nebel_destroy_scene(scene);
}

static void test_a_mask_that_cannot_be_placed_is_told(void **state)
{
    (void)state;
    write_leaf_glb("\"alphaMode\":\"MASK\",", "", "");
    assert_noted("\"file\": \"leaf.glb\"", "no texture coordinates");
}

/* A grey picture, or one with alpha. */
static void test_opacity_maps_make_holes(void **state)
{
    (void)state;
    write_text("leaf.obj", "mtllib leaf.mtl\nusemtl leaf\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 0 1\n"
                           "f 1/1 2/2 3/3\n");
    write_text("leaf.mtl", "newmtl leaf\nKd 1 1 1\nmap_d leaf.png\n");
    write_leaf("leaf.png", PNG_FORMAT_GRAY);
    assert_true(load_cutoff("\"file\": \"leaf.obj\"", 0) == .5f);
    write_leaf("leaf.png", PNG_FORMAT_RGBA);
    assert_true(load_cutoff("\"file\": \"leaf.obj\"", 0) == .5f);
    write_text("leaf.mtl", "newmtl leaf\nKd 1 1 1\nmap_Kd leaf.png\nmap_d leaf.png\n");
    assert_true(load_cutoff("\"file\": \"leaf.obj\"", 1) == .5f);
    write_text("leaf.mtl", "newmtl leaf\nKd 1 1 1\nmap_Kd leaf.png\n");
    assert_true(load_cutoff("\"file\": \"leaf.obj\"", 1) == 0);
    write_text("leaf.mtl", "newmtl leaf\nKd 1 1 1\nmap_d none.png\n");
    assert_noted("\"file\": \"leaf.obj\"", "none.png");
}

static int remove_folder(void **state)
{
    (void)state;
    static const char *const names[] = {"leaf.glb", "leaf.obj", "leaf.mtl", "leaf.png"};
    for (size_t i = 0; i < sizeof names / sizeof *names; i++) unlink(in_folder(names[i]));
    return rmdir(folder);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_alpha_of_gltf_makes_holes),
        cmocka_unit_test(test_a_model_that_is_one_hole_is_told),
        cmocka_unit_test(test_a_mask_that_cannot_be_placed_is_told),
        cmocka_unit_test(test_opacity_maps_make_holes),
    };
    return cmocka_run_group_tests(tests, make_folder, remove_folder);
}
