/* Ambient light in scene files: what is read, what is refused, what is written, and pictures of it. */
#define _POSIX_C_SOURCE 200809L

#include "scene_help.h"

#include <nebel/render.h>

#include <math.h>
#include <unistd.h>

enum { WIDTH = 32, HEIGHT = 16 };

static char folder[] = "/tmp/nebel_environment_XXXXXX";

static const char *path_of(const char *name)
{
    static char path[128];
    snprintf(path, sizeof path, "%s/%s", folder, name);
    return path;
}

static void write_text(const char *name, const char *text)
{
    FILE *file = fopen(path_of(name), "wb");
    assert_non_null(file);
    assert_int_equal(fwrite(text, 1, strlen(text), file), strlen(text));
    fclose(file);
}

/* A picture of these channels, all samples the same but one. */
static void write_picture(const char *name, uint32_t width, uint32_t height, uint32_t count,
                          const char *const *channels, float one)
{
    const size_t size = (size_t)width * height * count;
    float *samples = malloc(size * sizeof *samples);
    assert_non_null(samples);
    for (size_t i = 0; i < size; i++) samples[i] = (float)(i % count + 1) / 8;
    samples[size / 2] = one;
    const nebel_image image = {width, height, count, channels, samples};
    assert_int_equal(nebel_write_image(path_of(name), &(nebel_host){0}, &image), NEBEL_OK);
    free(samples);
}

static const char *const colors[] = {"R", "G", "B", "A"};

#define SCENE(ambient) "{\"nebel\": 1, \"ambient\": " ambient ", \"fog\": []}"
#define MAP(file, rest) SCENE("{\"type\": \"environment\", \"file\": \"" file "\"" rest "}")

static nebel_result load(const char *text, journal *kept, nebel_scene **scene)
{
    *kept = (journal){0};
    write_text("scene.json", text);
    return nebel_load_scene(path_of("scene.json"), &(nebel_scene_desc){.host.log = {remember, kept}}, scene);
}

static nebel_scene *load_good(const char *text)
{
    journal kept;
    nebel_scene *scene = NULL;
    if (load(text, &kept, &scene) != NEBEL_OK) fail_msg("%s", kept.last);
    return scene;
}

static void expect_refused(const char *text, nebel_result result, const char *words)
{
    journal kept;
    nebel_scene *scene = NULL;
    if (load(text, &kept, &scene) != result || strstr(kept.last, words) == NULL || kept.count != 1)
        fail_msg("%s\n  gives: %s\n  wanted: %s", text, kept.last, words);
    assert_null(scene);
}

/* ---- what is read ---------------------------------------------------------------------------- */

static void a_gradient_is_read(void **state)
{
    (void)state;
    nebel_scene *scene =
        load_good("{\"nebel\": 1, \"fog\": [], \"background\": \"ambient\", \"ambient\": {\"ground\": 0, "
                  "\"type\": \"gradient\", \"zenith\": [1, 2, 3], \"horizon\": 0.5}}");
    const nebel_scene_data *data = nebel_get_scene_data(scene);
    assert_int_equal(data->environment.type, NEBEL_ENVIRONMENT_GRADIENT);
    assert_true(data->environment.zenith[1] == 2 && data->environment.horizon[2] == 0.5);
    assert_int_equal(data->shows_ambient, 1);
    assert_null(data->environment_path);
    nebel_destroy_scene(scene);
}

static void a_map_is_read(void **state)
{
    (void)state;
    write_picture("four.exr", WIDTH, HEIGHT, 4, colors, 0.5F);
    nebel_scene *scene = load_good(MAP("four.exr", ", \"rotation\": 90, \"intensity\": 2"));
    const nebel_scene_data *data = nebel_get_scene_data(scene);
    double radiance[3];
    assert_int_equal(data->environment.type, NEBEL_ENVIRONMENT_MAP);
    assert_string_equal(data->environment_path, path_of("four.exr"));
    assert_int_equal(data->path_count, 1);
    nebel_evaluate_environment(&data->environment, (const double[3]){0, 1, 0}, radiance);
    for (int c = 0; c < 3; c++) assert_true(fabs(radiance[c] - (c + 1) / 4.0) < 1e-6);
    nebel_destroy_scene(scene);
}

/* ---- what is refused ------------------------------------------------------------------------- */

static void wrong_words_are_refused(void **state)
{
    (void)state;
    expect_refused(SCENE("{\"type\": \"sky\"}"), NEBEL_ERROR_FORMAT, "1:34: ambient.type: unknown; must be one of");
    expect_refused(SCENE("{\"zenith\": 1}"), NEBEL_ERROR_FORMAT, "ambient: the key \"type\" is missing");
    expect_refused(SCENE("{\"type\": \"gradient\", \"zenith\": 1, \"ground\": 1}"), NEBEL_ERROR_FORMAT,
                   "ambient: the key \"horizon\" is missing");
    expect_refused(SCENE("{\"type\": \"gradient\", \"zenith\": -1, \"horizon\": 1, \"ground\": 1}"), NEBEL_ERROR_FORMAT,
                   "ambient.zenith: is -1; must be");
    expect_refused(MAP("sky.png", ""), NEBEL_ERROR_FORMAT, "ambient.file: is \"sky.png\"; must be");
    expect_refused(MAP("", ""), NEBEL_ERROR_FORMAT, "ambient.file: is \"\"; must be");
    expect_refused(MAP("good.exr", ", \"rotation\": 2e6"), NEBEL_ERROR_FORMAT, "ambient.rotation: is 2000000; must be");
    expect_refused(MAP("good.exr", ", \"intensity\": 0"), NEBEL_ERROR_FORMAT, "ambient.intensity: is 0; must be");
    expect_refused(MAP("good.exr", ", \"intensity\": 9e8"), NEBEL_ERROR_FORMAT,
                   "ambient.intensity: environment: intensity times the brightest pixel");
    expect_refused(MAP("good.exr", ", \"zenith\": 1"), NEBEL_ERROR_FORMAT, "ambient.zenith: unknown key");
    expect_refused("{\"nebel\": 1, \"fog\": [], \"background\": \"ambiant\"}", NEBEL_ERROR_FORMAT, "is no color");
}

static void wrong_pictures_are_refused(void **state)
{
    static const float wrong[] = {-1, NAN, INFINITY, 2e9F};
    (void)state;
    expect_refused(MAP("missing.exr", ""), NEBEL_ERROR_FILE, "ambient.file: ");
    for (size_t i = 0; i < sizeof wrong / sizeof *wrong; i++) {
        write_picture("wrong.exr", WIDTH, HEIGHT, 3, colors, wrong[i]);
        expect_refused(MAP("wrong.exr", ""), NEBEL_ERROR_VALUE, "wrong.exr: environment map: pixel");
    }
    write_picture("wrong.exr", WIDTH, HEIGHT, 2, colors, 1);
    expect_refused(MAP("wrong.exr", ""), NEBEL_ERROR_FORMAT, "has no channels R, G and B");
    write_picture("wrong.exr", WIDTH, WIDTH, 3, colors, 1);
    expect_refused(MAP("wrong.exr", ""), NEBEL_ERROR_VALUE, "must be twice as wide as high");
    write_picture("wrong.exr", NEBEL_MAX_ENVIRONMENT_WIDTH + 2, 1, 3, colors, 1);
    expect_refused(MAP("wrong.exr", ""), NEBEL_ERROR_LIMIT, "pixels wide; must be 2 to 4096");
    write_picture("wrong.exr", 8192, 2048, 1, colors, 1);
    expect_refused(MAP("wrong.exr", ""), NEBEL_ERROR_LIMIT, "at most 2^23 pixels");
    write_text("wrong.exr", "no picture");
    expect_refused(MAP("wrong.exr", ""), NEBEL_ERROR_FORMAT, "neither a PNG nor an OpenEXR picture");
}

/* Cut off anywhere: refused, but where what is missing is nothing. */
static void pictures_that_are_cut_off_are_refused(void **state)
{
    static char bytes[1 << 16];
    (void)state;
    write_picture("whole.exr", WIDTH, HEIGHT, 3, colors, 1);
    FILE *whole = fopen(path_of("whole.exr"), "rb");
    const size_t size = fread(bytes, 1, sizeof bytes, whole);
    fclose(whole);
    assert_true(size > 100 && size < sizeof bytes);
    for (size_t cut = 0; cut < size; cut += cut < 64 ? 7 : size / 20) {
        journal kept;
        nebel_scene *scene = NULL;
        FILE *part = fopen(path_of("part.exr"), "wb");
        assert_int_equal(fwrite(bytes, 1, cut, part), cut);
        fclose(part);
        assert_int_not_equal(load(MAP("part.exr", ""), &kept, &scene), NEBEL_OK);
        assert_int_equal(kept.count, 1);
        assert_non_null(strstr(kept.last, "scene.json:1:"));
    }
}

/* ---- what is written ------------------------------------------------------------------------- */

static void expect_saved(const char *before, const nebel_scene_data *was, const nebel_scene_data *now,
                         const char *after)
{
    static char bytes[4096];
    journal kept = {0};
    write_text("scene.json", before);
    if (nebel_save_scene(path_of("scene.json"), &(nebel_scene_desc){.host.log = {remember, &kept}}, was, now, NULL) !=
        NEBEL_OK)
        fail_msg("%s", kept.last);
    FILE *file = fopen(path_of("scene.json"), "rb");
    bytes[fread(bytes, 1, sizeof bytes - 1, file)] = '\0';
    fclose(file);
    assert_string_equal(bytes, after);
}

static void maps_are_saved(void **state)
{
    static const char before[] = MAP("good.exr", "");
    (void)state;
    nebel_scene *scene = load_good(before);
    nebel_scene_data now = *nebel_get_scene_data(scene);
    expect_saved(before, nebel_get_scene_data(scene), &now, before);
    now.environment.rotation = -45;
    now.environment.intensity = 3;
    now.shows_ambient = 1;
    expect_saved(before, nebel_get_scene_data(scene), &now,
                 "{\"nebel\": 1, \"ambient\": {\"type\": \"environment\", \"file\": \"good.exr\", \"rotation\": -45, "
                 "\"intensity\": 3}, \"fog\": [], \"background\": \"ambient\"}");
    now = *nebel_get_scene_data(scene);
    now.environment = (nebel_environment){.type = NEBEL_ENVIRONMENT_CONSTANT};
    now.ambient[1] = 1;
    expect_saved(before, nebel_get_scene_data(scene), &now, "{\"nebel\": 1, \"ambient\": [0, 1, 0], \"fog\": []}");
    nebel_destroy_scene(scene);
}

static void gradients_come_and_go(void **state)
{
    static const char before[] = "{\"nebel\": 1, \"background\": \"ambient\", \"fog\": []}";
    (void)state;
    nebel_scene *scene = load_good(before);
    nebel_scene_data now = *nebel_get_scene_data(scene);
    now.environment = (nebel_environment){.type = NEBEL_ENVIRONMENT_GRADIENT, .zenith = {1, 2, 3}, .ground = {1, 1, 1}};
    now.shows_ambient = 0;
    static const char after[] = "{\"nebel\": 1, \"background\": 0, \"fog\": [], \"ambient\": { \"type\": \"gradient\", "
                                "\"zenith\": [1, 2, 3], \"horizon\": 0, \"ground\": 1 }}";
    expect_saved(before, nebel_get_scene_data(scene), &now, after);
    nebel_destroy_scene(scene);
    scene = load_good(after);
    now = *nebel_get_scene_data(scene);
    assert_true(now.environment.zenith[2] == 3);
    now.environment.type = NEBEL_ENVIRONMENT_CONSTANT;
    expect_saved(after, nebel_get_scene_data(scene), &now,
                 "{\"nebel\": 1, \"background\": 0, \"fog\": [], \"ambient\": 0}");
    nebel_destroy_scene(scene);
}

/* What the file does not name cannot be written into it, and nothing is. */
static void new_maps_are_not_saved(void **state)
{
    static const char before[] = SCENE("1");
    journal kept = {0};
    (void)state;
    nebel_scene *scene = load_good(before);
    nebel_scene_data now = *nebel_get_scene_data(scene);
    now.environment.type = NEBEL_ENVIRONMENT_MAP;
    assert_int_equal(nebel_save_scene(path_of("scene.json"), &(nebel_scene_desc){.host.log = {remember, &kept}},
                                      nebel_get_scene_data(scene), &now, NULL),
                     NEBEL_ERROR_ARGUMENT);
    nebel_destroy_scene(scene);
}

/* ---- pictures -------------------------------------------------------------------------------- */

static void render(const char *text, float *color)
{
    nebel_scene *scene = load_good(text);
    nebel_lighting *fog = scene_light(scene, 0);
    nebel_renderer *renderer = NULL;
    assert_int_equal(nebel_create_cpu_renderer(nebel_get_scene_data(scene), fog,
                                               &(nebel_cpu_renderer_desc){.thread_count = 1}, &renderer),
                     NEBEL_OK);
    const nebel_frame_desc desc = {
        .camera = nebel_get_scene_camera(scene, 0), .width = WIDTH, .height = HEIGHT, .samples = 1};
    assert_int_equal(nebel_render_frame(renderer, &desc, &(nebel_frame){.color = color}), NEBEL_OK);
    nebel_destroy_renderer(renderer);
    nebel_release_lighting(fog);
    nebel_destroy_scene(scene);
}

#define PANORAMA(ambient, fog)                                                                                         \
    "{\"nebel\": 1, \"background\": \"ambient\", \"camera\": {\"projection\": \"panorama\"}, \"ambient\": " ambient    \
    ", \"fog\": [" fog "]}"

/* A panorama that lights a scene is seen in it as it was. */
static void a_panorama_becomes_the_sky(void **state)
{
    static const char *const names[] = {"R", "G", "B"};
    static float first[3 * WIDTH * HEIGHT], again[3 * WIDTH * HEIGHT];
    (void)state;
    render(PANORAMA("{\"type\": \"gradient\", \"zenith\": [0.1, 0.2, 1], \"horizon\": 1, \"ground\": 0}",
                    "{\"shape\": {\"type\": \"sphere\", \"center\": [3, 2, -4], \"radius\": 2}, \"extinction\": 1, "
                    "\"source\": [2, 0, 0]}"),
           first);
    const nebel_image image = {WIDTH, HEIGHT, 3, names, first};
    assert_int_equal(nebel_write_image(path_of("sky.exr"), &(nebel_host){0}, &image), NEBEL_OK);
    render(PANORAMA("{\"type\": \"environment\", \"file\": \"sky.exr\"}", ""), again);
    for (int i = 0; i < 3 * WIDTH * HEIGHT; i++) assert_true(fabsf(first[i] - again[i]) < 1e-5F);
    assert_true(first[0] < first[3 * WIDTH * HEIGHT / 2]);
    render(PANORAMA("{\"type\": \"environment\", \"file\": \"sky.exr\", \"rotation\": 90}", ""), again);
    for (int y = 0; y < HEIGHT; y++)
        for (int x = 0; x < WIDTH; x++)
            for (int c = 0; c < 3; c++) {
                const int right = (x + WIDTH / 4) % WIDTH;
                assert_true(fabsf(first[3 * (y * WIDTH + right) + c] - again[3 * (y * WIDTH + x) + c]) < 1e-5F);
            }
}

/* White fog under white light is white, whatever that light is made of. */
static void white_stays_white(void **state)
{
    static float color[3 * WIDTH * HEIGHT];
    static const char *const scenes[] = {
#define FOG                                                                                                            \
    "{\"shape\": {\"type\": \"sphere\", \"center\": [3, 2, -4], \"radius\": 3}, \"extinction\": 1, \"albedo\": 1, "    \
    "\"phase\": {\"type\": \"droplets\", \"diameter\": 12}}"
        PANORAMA("0.5", FOG),
        PANORAMA("{\"type\": \"gradient\", \"zenith\": 0.5, \"horizon\": 0.5, \"ground\": 0.5}", FOG),
        PANORAMA("{\"type\": \"environment\", \"file\": \"white.exr\"}", FOG)};
    static const char *const names[] = {"R", "G", "B"};
    float white[3 * WIDTH * HEIGHT];
    (void)state;
    for (int i = 0; i < 3 * WIDTH * HEIGHT; i++) white[i] = 0.5F;
    const nebel_image image = {WIDTH, HEIGHT, 3, names, white};
    assert_int_equal(nebel_write_image(path_of("white.exr"), &(nebel_host){0}, &image), NEBEL_OK);
    for (int i = 0; i < 3; i++) {
        render(scenes[i], color);
        for (int k = 0; k < 3 * WIDTH * HEIGHT; k++) assert_true(fabsf(color[k] - 0.5F) < 2e-6F);
    }
}

static int make_folder(void **state)
{
    (void)state;
    if (mkdtemp(folder) == NULL) return -1;
    write_picture("good.exr", WIDTH, HEIGHT, 3, colors, 2);
    return 0;
}

static int remove_folder(void **state)
{
    static const char *const names[] = {"good.exr", "four.exr", "wrong.exr", "whole.exr",
                                        "part.exr", "sky.exr",  "white.exr", "scene.json"};
    (void)state;
    for (size_t i = 0; i < sizeof names / sizeof *names; i++) (void)unlink(path_of(names[i]));
    return rmdir(folder);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_gradient_is_read),
        cmocka_unit_test(a_map_is_read),
        cmocka_unit_test(wrong_words_are_refused),
        cmocka_unit_test(wrong_pictures_are_refused),
        cmocka_unit_test(pictures_that_are_cut_off_are_refused),
        cmocka_unit_test(maps_are_saved),
        cmocka_unit_test(gradients_come_and_go),
        cmocka_unit_test(new_maps_are_not_saved),
        cmocka_unit_test(a_panorama_becomes_the_sky),
        cmocka_unit_test(white_stays_white),
    };
    return cmocka_run_group_tests(tests, make_folder, remove_folder);
}
