#define _GNU_SOURCE
/* Models, multiple scattering and pictures are counted within the memory of the whole scene: each of them is within its limits, all of
 * them together are not. */
#include "model_help.h"
#include "model/model_budget.h"

#include <png.h>

#define MEGABYTE ((uint64_t)1 << 20)

static void write_gray(const char *name, uint32_t side)
{
    png_image image = {.version = PNG_IMAGE_VERSION, .width = side, .height = side, .format = PNG_FORMAT_GRAY};
    uint8_t *pixels = calloc(side, side);
    assert_int_not_equal(png_image_write_to_file(&image, in_folder(name), 0, pixels, 0, NULL), 0);
    free(pixels);
}

static nebel_scene *open_scene(const char *text, uint64_t memory, int in_process, journal *kept)
{
    nebel_scene *scene = NULL;
    const nebel_scene_desc desc = {.host.log = {remember, kept}, .memory = memory, .models_in_process = in_process};
    *kept = (journal){0};
    if (nebel_parse_scene(text, strlen(text), in_folder("scene.json"), &desc, &scene) != NEBEL_OK)
        fail_msg("%s", kept->last);
    return scene;
}

/* 2 * 255 * 255 triangles and 256 * 256 vertices: 33 MB, and a model at last. */
static nebel_scene *open_terrains(int count, const char *last, uint64_t memory, int in_process, journal *kept)
{
    char text[4000];
    size_t size = (size_t)snprintf(text, sizeof text, "{\"nebel\": 1, \"fog\": [], \"models\": [");
    for (int i = 0; i < count; i++)
        size += (size_t)snprintf(text + size, sizeof text - size,
                                 "{\"heightfield\": {\"file\": \"h.png\", \"size\": [9, 9], \"height\": 1}}, ");
    snprintf(text + size, sizeof text - size, "{\"file\": \"%s\"}]}", last);
    return open_scene(text, memory, in_process, kept);
}

static void assert_too_much(nebel_scene *scene, const journal *kept, const char *model, const char *what)
{
    assert_int_equal(nebel_load_scene_models(scene), NEBEL_ERROR_LIMIT);
    if (kept->count != 1 || strstr(kept->last, model) == NULL || strstr(kept->last, what) == NULL)
        fail_msg("%d: %s", kept->count, kept->last);
    assert_int_equal(nebel_get_scene_data(scene)->mesh_count, 0);
    nebel_destroy_scene(scene);
}

static void test_models_share_the_memory(void **state)
{
    (void)state;
    journal kept;
    for (int in_process = 0; in_process < 2; in_process++) {
        nebel_scene *scene = open_terrains(6, "skin.obj", 256 * MEGABYTE, in_process, &kept);
        if (nebel_load_scene_models(scene) != NEBEL_OK) fail_msg("%s", kept.last);
        assert_int_equal(nebel_get_scene_data(scene)->texture_count, 1);
        nebel_destroy_scene(scene);
        scene = open_terrains(8, "skin.obj", 256 * MEGABYTE, in_process, &kept);
        assert_too_much(scene, &kept, "models[7].heightfield",
                        "brings the scene to 266 MB of memory; 256 MB is the most");
        /* Here it is the texture: it is not left out, as one would be that cannot be read. */
        scene = open_terrains(7, "skin.obj", 248 * MEGABYTE, in_process, &kept);
        assert_too_much(scene, &kept, "models[7].file", "skin.png: takes 16 MB; 15 MB are left");
        scene = open_terrains(7, "many.obj", 234 * MEGABYTE, in_process, &kept);
        assert_too_much(scene, &kept, "models[7].file", "many.obj\" brings the scene to 236 MB");
    }
}

static void test_what_was_read_before_counts(void **state)
{
    (void)state;
    journal kept;
    nebel_scene *scene = open_scene(
        "{\"nebel\": 1, \"fog\": [], \"multiple_scattering\": {\"model\": \"diffusion\", \"max_cells\": 22000}, "
        "\"models\": [{\"heightfield\": {\"file\": \"h.png\", \"size\": [9, 9], \"height\": 1}}]}",
        50 * MEGABYTE, 0, &kept);
    assert_too_much(scene, &kept, "models[0]", "brings the scene to 52 MB of memory");
}

static void test_time_is_shared_too(void **state)
{
    (void)state;
    journal kept;
    if (NB_SANITIZED) skip(); /* slower than any limit */
    /* A second of preparation for 64 MB is 3 ms for these, in which no 41 processes run. */
    char text[2000] = "{\"nebel\": 1, \"fog\": [], \"models\": [{\"file\": \"quad.obj\"}";
    for (int i = 0; i < 40; i++) strcat(text, ", {\"file\": \"quad.obj\"}");
    nebel_scene *scene = open_scene(strcat(text, "]}"), 200000, 0, &kept);
    assert_int_equal(nebel_load_scene_models(scene), NEBEL_ERROR_LIMIT);
    assert_non_null(strstr(kept.last, "quad.obj"));
    assert_non_null(strstr(kept.last, "--memory"));
    nebel_destroy_scene(scene);
}

static void test_hosts_count_what_they_ask_for(void **state)
{
    (void)state;
    journal kept;
    const nebel_diffusion_desc coarse = {.max_cells = 7000}, fine = {.max_cells = 80000},
                               absurd = {.max_cells = UINT32_MAX};
    nebel_scene *scene = open_terrains(1, "quad.obj", 100 * MEGABYTE, 0, &kept);
    assert_int_equal(nebel_load_scene_models(scene), NEBEL_OK);
    assert_int_equal(nebel_set_scene_diffusion(scene, &coarse), NEBEL_OK);
    assert_int_equal(nebel_set_scene_diffusion(scene, &fine), NEBEL_ERROR_LIMIT);
    assert_non_null(strstr(kept.last, "multiple scattering brings the scene to 102 MB of memory; 100 MB is the most"));
    assert_int_equal(nebel_get_scene_data(scene)->diffusion->max_cells, 7000);
    assert_int_equal(nebel_set_scene_diffusion(scene, &absurd), NEBEL_ERROR_LIMIT);
    /* What is given back is free for others. */
    assert_int_equal(nebel_charge_scene(scene, "--size: a picture", 66 * MEGABYTE), NEBEL_ERROR_LIMIT);
    assert_non_null(strstr(kept.last, "--size: a picture brings the scene to"));
    assert_int_equal(nebel_set_scene_diffusion(scene, NULL), NEBEL_OK);
    assert_int_equal(nebel_charge_scene(scene, "--size: a picture", 66 * MEGABYTE), NEBEL_OK);
    assert_int_equal(nebel_charge_scene(scene, "--size: a picture", 66 * MEGABYTE), NEBEL_ERROR_LIMIT);
    assert_int_equal(nebel_charge_scene(scene, "--size: a picture", UINT64_MAX), NEBEL_ERROR_LIMIT);
    nebel_destroy_scene(scene);
}

static int make_files(void **state)
{
    if (make_folder(state) != 0) return -1;
    write_gray("h.png", 256);
    write_gray("skin.png", 2048);
    write_text("skin.mtl", "newmtl a\nmap_Kd skin.png\n");
    write_text("skin.obj", "mtllib skin.mtl\nusemtl a\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nf 1/1 2/1 3/1\n");
    write_text("quad.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
    FILE *many = fopen(in_folder("many.obj"), "w");
    fputs("v 0 0 0\nv 1 0 0\nv 0 1 0\n", many);
    for (int i = 0; i < 12000; i++) fputs("f 1 2 3\n", many);
    return fclose(many);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_models_share_the_memory), cmocka_unit_test(test_what_was_read_before_counts),
        cmocka_unit_test(test_time_is_shared_too), cmocka_unit_test(test_hosts_count_what_they_ask_for)};
    return cmocka_run_group_tests(tests, make_files, remove_folder_tree);
}
