/* The section "planet" of the model "textured": what it becomes, its maps, and what is wrong. */
#define _POSIX_C_SOURCE 200809L
#include "near.h"
#include "scene_help.h"

#include <math.h>
#include <sys/stat.h>
#include <stdio.h>
#include <stdlib.h>
#include <unistd.h>

#define SCENE(top, members) "{\"nebel\": 1, " top "\"fog\": [], \"planet\": " members "}"
#define LAYERS(members) SCENE("", "{\"model\": \"textured\", " members "}")

static void test_defaults(void **state)
{
    (void)state;
    nebel_scene *scene = parse_good(SCENE("", "{\"model\": \"textured\"}"));
    const nebel_planet *planet = nebel_get_scene_data(scene)->planets;
    assert_int_equal(planet->model, NEBEL_PLANET_TEXTURED);
    assert_number(planet->textured_desc.radius, 6.36e6);
    assert_number(planet->textured_desc.center[1], -6.36e6);
    assert_int_equal(planet->textured_desc.cloud_shell_count, 0);
    assert_false(nebel_get_scene_data(scene)->has_endless_motion);
    assert_number(planet->sun_left[1], 1);
    assert_null(planet->textured);
    assert_int_equal(nebel_load_scene_planets(scene), NEBEL_OK);
    assert_non_null(planet->textured);
    assert_null(planet->atmosphere);
    const nebel_textured_planet *layers = planet->textured;
    assert_int_equal(nebel_load_scene_planets(scene), NEBEL_OK);
    assert_ptr_equal(planet->textured, layers);
    nebel_destroy_scene(scene);
}

static void test_everything_it_may_say(void **state)
{
    (void)state;
    nebel_scene *scene = parse_good(SCENE("\"up\": \"z\", \"unit\": 1000, ",
                                          "{\"model\": \"textured\", \"center\": [1, 2, 3], \"radius\": 20, "
                                          "\"rotation\": [0, 0, 1, 0], \"rotation_period\": 5, "
                                          "\"land_coverage\": 0.25, \"seed\": 9, \"clouds\": [{\"height\": 2, "
                                          "\"rotation_period\": -7, \"color\": [0.1, 0.2, 0.3], "
                                          "\"uv_tiling\": [1, -2, 3], \"gain\": 4, \"coverage\": 0.75, \"seed\": 11}, "
                                          "{}], \"atmosphere\": {\"height\": 3, "
                                          "\"brightness\": 2, \"ramp\": [[0, 0, 0], [0.5, 0.25, 1]]}}"));
    const nebel_textured_planet_desc *desc = &nebel_get_scene_data(scene)->planets[0].textured_desc;
    assert_number(desc->center[0], 1000);
    assert_number(desc->center[1], 3000);
    assert_number(desc->center[2], -2000);
    assert_number(desc->radius, 20000);
    assert_number(desc->rotation[1], 1);
    assert_number(desc->rotation_period, 5);
    assert_number(desc->land_coverage, .25);
    assert_int_equal(desc->seed, 9);
    assert_int_equal(desc->cloud_shell_count, 2);
    assert_number(desc->cloud_shells[0].height, 2000);
    assert_number(desc->cloud_shells[0].rotation_period, -7);
    assert_true(nebel_get_scene_data(scene)->has_endless_motion);
    assert_number(desc->cloud_shells[0].color[2], .3);
    assert_number(desc->cloud_shells[0].uv_tiling[1], -2);
    assert_number(desc->cloud_shells[0].gain, 4);
    assert_number(desc->cloud_shells[0].coverage, .75);
    assert_int_equal(desc->cloud_shells[0].seed, 11);
    assert_number(desc->atmosphere.height, 3000);
    assert_number(desc->atmosphere.brightness, 2);
    assert_int_equal(desc->atmosphere.ramp_count, 2);
    assert_number(desc->atmosphere.ramp[1][1], .25);
    assert_int_equal(desc->atmosphere.is_disabled, 0);
    nebel_destroy_scene(scene);
    scene = parse_good(LAYERS("\"atmosphere\": {\"brightness\": 0}"));
    assert_int_equal(nebel_get_scene_data(scene)->planets[0].textured_desc.atmosphere.is_disabled, 1);
    nebel_destroy_scene(scene);
}

/* ---- maps ------------------------------------------------------------------------------------ */

static char folder[] = "/tmp/nebel-test-XXXXXX";

static const char *in_folder(const char *name)
{
    static char path[64];
    (void)snprintf(path, sizeof path, "%s/%s", folder, name);
    return path;
}

static void write_picture(const char *name, uint32_t channels, float value)
{
    static const char *const colors[] = {"R", "G", "B"}, *const grey[] = {"Y"};
    float samples[2 * 3];
    for (int i = 0; i < 6; i++) samples[i] = value;
    const nebel_image image = {2, 1, channels, channels == 1 ? grey : colors, samples};
    assert_int_equal(nebel_write_image(in_folder(name), &(nebel_host){.log = {0}}, &image), NEBEL_OK);
}

static nebel_result load(const char *members, nebel_scene **scene)
{
    FILE *file = fopen(in_folder("scene.json"), "w");
    assert_non_null(file);
    (void)fprintf(file, "{\"nebel\": 1, \"fog\": [], \"planet\": {\"model\": \"textured\", %s}}", members);
    assert_int_equal(fclose(file), 0);
    return nebel_load_scene(in_folder("scene.json"), &(nebel_scene_desc){.host.log = {0}}, scene);
}

static void test_maps_come_from_pictures(void **state)
{
    (void)state;
    nebel_scene *scene = NULL;
    assert_non_null(mkdtemp(folder));
    write_picture("colors.png", 3, .5F);
    write_picture("colors.exr", 3, .5F);
    write_picture("grey.exr", 1, .5F);
    write_picture("bright.exr", 3, 2);
    assert_int_equal(load("\"color_map\": \"colors.png\", \"clouds\": [{\"coverage_map\": \"grey.exr\", "
                          "\"detail_map\": \"colors.exr\"}]",
                          &scene),
                     NEBEL_OK);
    const nebel_textured_planet_desc *desc = &nebel_get_scene_data(scene)->planets[0].textured_desc;
    assert_int_equal(desc->color_map.width, 2);
    assert_int_equal(desc->color_map.channels, 3);
    assert_true(fabs((double)desc->color_map.texels[5] - .2159) < 2e-3); /* sRGB */
    assert_int_equal(desc->cloud_shells[0].coverage_map.channels, 1);
    assert_true(fabs((double)desc->cloud_shells[0].coverage_map.texels[1] - .5) < 3e-3);
    assert_true(fabs((double)desc->cloud_shells[0].detail_map.texels[1] - .5) < 1e-3);
    assert_int_equal(nebel_load_scene_planets(scene), NEBEL_OK);
    assert_int_equal(nebel_get_scene_data(scene)->path_count, 3);
    nebel_destroy_scene(scene);
    assert_int_equal(load("\"color_map\": \"grey.exr\"", &scene), NEBEL_OK);
    desc = &nebel_get_scene_data(scene)->planets[0].textured_desc;
    assert_int_equal(desc->color_map.channels, 3);
    for (int i = 0; i < 6; i++) assert_true(fabs((double)desc->color_map.texels[i] - .5) < 1e-3);
    nebel_destroy_scene(scene);
    assert_int_equal(mkfifo(in_folder("pipe.png"), 0600), 0);
    assert_int_equal(load("\"color_map\": \"pipe.png\"", &scene), NEBEL_ERROR_FILE);
    assert_int_equal(load("\"color_map\": \"bright.exr\"", &scene), NEBEL_ERROR_FORMAT);
    assert_int_equal(load("\"color_map\": \"none.png\"", &scene), NEBEL_ERROR_FILE);
    assert_int_equal(load("\"color_map\": \"scene.json\"", &scene), NEBEL_ERROR_FORMAT);
    static const char *const names[] = {"colors.png", "colors.exr", "grey.exr", "bright.exr", "scene.json", "pipe.png"};
    for (size_t i = 0; i < sizeof names / sizeof *names; i++) (void)remove(in_folder(names[i]));
    (void)rmdir(folder);
}

/* ---- what is wrong --------------------------------------------------------------------------- */

static void test_what_is_wrong(void **state)
{
    (void)state;
    const rule rules[] = {
        {FORMAT, LAYERS("`\"preset\": \"earth\""), "planet.preset: unknown key; a textured planet has: model, center"},
        {FORMAT, LAYERS("\"radius\": `0"), "planet.radius: is 0; must be a length from 1 to 1e12 m"},
        {FORMAT, LAYERS("\"rotation_period\": `2e12"), "planet.rotation_period: is 2000000000000; must be"},
        {FORMAT, LAYERS("\"rotation\": `[0, 0, 0, 0]"), "planet.rotation: "},
        {FORMAT, LAYERS("\"land_coverage\": `1"), "planet.land_coverage: is 1; must be a number between 0 and 1"},
        {FORMAT, LAYERS("\"seed\": `0.5"), "planet.seed: is 0.5"},
        {FORMAT, LAYERS("\"color_map\": `\"a.obj\""), "planet.color_map: is \"a.obj\"; must be the path of a picture"},
        {FORMAT, LAYERS("\"clouds\": `{}"), "planet.clouds: is an object; must be an array"},
        {FORMAT, LAYERS("\"clouds\": [{\"height\": `0}]"), "planet.clouds[0].height: is 0"},
        {FORMAT, LAYERS("\"clouds\": [{\"gain\": `0}]"), "planet.clouds[0].gain: is 0"},
        {FORMAT, LAYERS("\"clouds\": [{\"uv_tiling\": [1, 2, `2000]}]"), "planet.clouds[0].uv_tiling[2]: is 2000"},
        {LIMIT, LAYERS("\"clouds\": [{},{},{},{},{},{},{},{},`{}]"), "planet.clouds[8]: is one too many"},
        {FORMAT, LAYERS("\"atmosphere\": {\"ramp\": `[]}"), "planet.atmosphere.ramp: is empty"},
        {FORMAT, LAYERS("\"atmosphere\": {\"ramp\": [`2]}"), "planet.atmosphere.ramp[0]: is 2"},
        {FORMAT, LAYERS("\"atmosphere\": {\"brightness\": `-1}"), "planet.atmosphere.brightness: is -1"},
    };
    CHECK(rules);
}

static void test_without_memory(void **state)
{
    (void)state;
    const char *text = LAYERS("\"atmosphere\": {\"ramp\": [0, 1]}");
    parse_without_memory(text);
    for (long calls = 0;; calls++) {
        meter m;
        journal kept;
        nebel_scene *scene = NULL;
        const nebel_scene_desc desc = metered_desc(&m, &kept);
        assert_int_equal(nebel_parse_scene(text, strlen(text), "-", &desc, &scene), NEBEL_OK);
        m.fail_at = m.made + calls;
        const nebel_result result = nebel_load_scene_planets(scene);
        assert_true(result == NEBEL_OK || nebel_get_scene_data(scene)->planets[0].textured == NULL);
        nebel_destroy_scene(scene);
        assert_int_equal(m.live, 0);
        if (result == NEBEL_OK) break;
        assert_int_equal(result, NEBEL_ERROR_MEMORY);
        assert_true(calls < 20);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_defaults),
        cmocka_unit_test(test_everything_it_may_say),
        cmocka_unit_test(test_maps_come_from_pictures),
        cmocka_unit_test(test_what_is_wrong),
        cmocka_unit_test(test_without_memory),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
