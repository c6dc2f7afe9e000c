/* The section "classic" of scene files: what it becomes, and what is wrong with it. */
#include "near.h"
#include "scene_help.h"

#include <stdio.h>

#define SCENE(top, members) "{\"nebel\": 1, " top "\"fog\": [], \"classic\": " members "}"

static void test_everything_it_may_say(void **state)
{
    (void)state;
    nebel_scene *scene =
        parse_good(SCENE("\"unit\": 0.5, ", "{\"start\": -2, \"end\": 40, \"density\": 0.25, \"color\": [1, 2, 0.5], "
                                            "\"coordinate\": \"radial\", \"stage\": \"pixel\"}"));
    const nebel_factor_desc *factor = nebel_get_scene_data(scene)->classic;
    assert_number(factor->start, -1);
    assert_number(factor->end, 20);
    assert_number(factor->density, .5);
    assert_number(factor->color[1], 2);
    assert_int_equal(factor->coordinate, NEBEL_COORDINATE_RADIAL);
    assert_int_equal(factor->stage, NEBEL_STAGE_PIXEL);
    nebel_destroy_scene(scene);
}

static void test_defaults(void **state)
{
    (void)state;
    nebel_scene *scene = parse_good(SCENE("\"unit\": 0.01, ", "{}"));
    const nebel_factor_desc *factor = nebel_get_scene_data(scene)->classic;
    assert_number(factor->start, 0);
    assert_number(factor->end, 1);
    assert_number(factor->density, 1);
    assert_number(factor->color[0], 0);
    assert_int_equal(factor->coordinate, NEBEL_COORDINATE_PLANE);
    assert_int_equal(factor->stage, NEBEL_STAGE_VERTEX);
    nebel_destroy_scene(scene);
    scene = parse_good("{\"nebel\": 1, \"fog\": []}");
    assert_null(nebel_get_scene_data(scene)->classic);
    nebel_destroy_scene(scene);
}

static void test_curves(void **state)
{
    (void)state;
    static const struct {
        const char *name;
        nebel_curve_type curve;
    } curves[] = {{"physical", NEBEL_CURVE_PHYSICAL},
                  {"linear", NEBEL_CURVE_LINEAR},
                  {"exp", NEBEL_CURVE_EXP},
                  {"exp2", NEBEL_CURVE_EXP2}};
    char text[128];
    for (size_t i = 0; i < 4; i++) {
        snprintf(text, sizeof text, SCENE("", "{\"curve\": \"%s\"}"), curves[i].name);
        nebel_scene *scene = parse_good(text);
        assert_int_equal(nebel_get_scene_data(scene)->classic_curve, curves[i].curve);
        nebel_destroy_scene(scene);
    }
    nebel_scene *scene = parse_good(SCENE("", "{\"table\": [1, 0, 0.5, 1]}"));
    const float *table = nebel_get_scene_data(scene)->classic_table;
    assert_int_equal(nebel_get_scene_data(scene)->classic_curve, NEBEL_CURVE_TABLE);
    for (int i = 0; i < NEBEL_CURVE_ENTRIES; i++) {
        const double at = i / 85., wanted = at < 1 ? 1 - at : (at - 1) / 2;
        assert_near((double)table[i], wanted, 1e-7);
    }
    nebel_destroy_scene(scene);
}

static void test_device(void **state)
{
    (void)state;
    nebel_scene *scene = parse_good(SCENE("\"unit\": 0.5, ", "{\"d3d9\": {}}"));
    const nebel_d3d9_fog *d3d9 = nebel_get_scene_data(scene)->classic_d3d9;
    nebel_d3d9_fog wanted;
    nebel_reset_d3d9_fog(&wanted);
    wanted.fog_enable = 1;
    assert_memory_equal(d3d9, &wanted, sizeof wanted);
    nebel_destroy_scene(scene);
    scene =
        parse_good(SCENE("\"unit\": 0.5, ",
                         "{\"d3d9\": {\"fog_vertex_mode\": \"exp2\", \"fog_table_mode\": \"linear\", \"fog_start\": 4, "
                         "\"fog_end\": 10, \"fog_density\": 0.25, \"fog_color\": [1, 0.5, 0.2], \"range_fog_enable\": "
                         "true}, \"coordinate\": \"user\", \"end\": 100}"));
    d3d9 = nebel_get_scene_data(scene)->classic_d3d9;
    wanted = (nebel_d3d9_fog){1, 0xff8033, NEBEL_D3DFOG_LINEAR, NEBEL_D3DFOG_EXP2, 2, 5, .5f, 1};
    assert_memory_equal(d3d9, &wanted, sizeof wanted);
    assert_number(nebel_get_scene_data(scene)->classic_z_near, 0);
    assert_number(nebel_get_scene_data(scene)->classic_z_far, 1000);
    /* Coordinates of one's own have no unit. */
    assert_number(nebel_get_scene_data(scene)->classic->end, 100);
    nebel_destroy_scene(scene);
    scene =
        parse_good(SCENE("\"unit\": 0.5, ", "{\"d3d9\": {\"fog_color\": \"#12b4c0\", \"z_near\": 4, \"z_far\": 20}}"));
    assert_int_equal(nebel_get_scene_data(scene)->classic_d3d9->fog_color, 0x12b4c0); /* bytes are stored as they are */
    assert_number(nebel_get_scene_data(scene)->classic_z_near, 2);
    assert_number(nebel_get_scene_data(scene)->classic_z_far, 10);
    nebel_destroy_scene(scene);
    /* Device depth has no unit. */
    scene = parse_good(SCENE("\"unit\": 0.5, \"camera\": {\"projection\": \"orthographic\"}, ",
                             "{\"d3d9\": {\"fog_table_mode\": \"exp\", \"fog_end\": 0.75, \"fog_density\": 3}}"));
    assert_number((double)nebel_get_scene_data(scene)->classic_d3d9->fog_end, .75);
    assert_number((double)nebel_get_scene_data(scene)->classic_d3d9->fog_density, 3);
    nebel_destroy_scene(scene);
    scene = parse_good(SCENE("", "{}"));
    assert_null(nebel_get_scene_data(scene)->classic_d3d9);
    nebel_destroy_scene(scene);
}

static void test_what_is_wrong(void **state)
{
    (void)state;
    static const rule rules[] = {
        {NEBEL_ERROR_FORMAT, SCENE("", "`[]"), "classic: is an array; must be an object"},
        {NEBEL_ERROR_FORMAT, SCENE("", "{`\"far\": 1}"),
         "classic.far: unknown key; the section \"classic\" has: start, end, density, color, coordinate, stage, curve, "
         "table, d3d9"},
        {NEBEL_ERROR_FORMAT, SCENE("", "{\"density\": `0}"),
         "classic.density: is 0; must be an amount > 0 and < 1e9 per metre"},
        {NEBEL_ERROR_FORMAT, SCENE("", "{\"end\": `\"far\"}"), "classic.end: is a string; must be a coordinate"},
        {NEBEL_ERROR_FORMAT, SCENE("", "{\"color\": [1, `-1, 1]}"), "classic.color"},
        {NEBEL_ERROR_FORMAT, SCENE("", "{\"d3d9\": {\"z_near\": `1000}}"),
         "classic.d3d9.z_near: z_near is 1000 and z_far 1000; z_near must be less"},
        {NEBEL_ERROR_FORMAT, SCENE("", "{\"coordinate\": `\"far\"}"),
         "classic.coordinate: unknown; must be one of: plane, radial, user"},
        {NEBEL_ERROR_FORMAT, SCENE("", "{\"curve\": `\"table\"}"),
         "classic.curve: unknown; must be one of: physical, linear, exp, exp2"},
        {NEBEL_ERROR_FORMAT, SCENE("", "{\"table\": `[1]}"), "classic.table: has 1 weights; 2 to 256 are possible"},
        {NEBEL_ERROR_FORMAT, SCENE("", "{\"table\": [0, `2]}"), "classic.table[1]: is 2; must be a number from 0 to 1"},
        {NEBEL_ERROR_FORMAT, SCENE("", "{\"curve\": \"exp\", \"table\": `[0, 1]}"),
         "classic.table: there is a \"curve\", too; leave one of them out"},
        {NEBEL_ERROR_FORMAT, SCENE("", "{\"d3d9\": {\"fog_vertex_mode\": `\"exp3\"}}"),
         "classic.d3d9.fog_vertex_mode: unknown; must be one of: none, exp, exp2, linear"},
        {NEBEL_ERROR_FORMAT, SCENE("", "{\"d3d9\": {\"fog_color\": `2}}"),
         "classic.d3d9.fog_color: is 2; must be a number from 0 to 1"},
        {NEBEL_ERROR_FORMAT, SCENE("", "{\"d3d9\": {\"range_fog_enable\": `1}}"),
         "classic.d3d9.range_fog_enable: is a number; must be true or false"},
        {NEBEL_ERROR_FORMAT, SCENE("", "{\"d3d9\": {\"fog_density\": `0}}"),
         "classic.d3d9.fog_density: is 0; must be an amount"},
        {NEBEL_ERROR_FORMAT, SCENE("", "{\"stage\": `1}"), "classic.stage: is a number; must be"},
    };
    check_rules(rules, sizeof rules / sizeof *rules);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_everything_it_may_say),
        cmocka_unit_test(test_defaults),
        cmocka_unit_test(test_curves),
        cmocka_unit_test(test_device),
        cmocka_unit_test(test_what_is_wrong),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
