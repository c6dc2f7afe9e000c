/* The section "classic" of scene files: what it becomes, and what is wrong with it. */
#include "scene_help.h"

#define SCENE(top, members) "{\"nebel\": 1, " top "\"fog\": [], \"classic\": " members "}"

static void assert_number(double got, double wanted)
{
    if (!(got == wanted)) fail_msg("%.17g should be %.17g", got, wanted);
}

static void test_everything_it_may_say(void **state)
{
    (void)state;
    nebel_scene *scene =
        parse_good(SCENE("\"unit\": 0.5, ", "{\"start\": -2, \"end\": 40, \"density\": 0.25, \"color\": [1, 2, 0.5], "
                                            "\"coordinate\": \"radial\", \"stage\": \"pixel\"}"));
    const nebel_factor_desc *factor = nebel_scene_contents(scene)->classic;
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
    const nebel_factor_desc *factor = nebel_scene_contents(scene)->classic;
    assert_number(factor->start, 0);
    assert_number(factor->end, 1);
    assert_number(factor->density, 1);
    assert_number(factor->color[0], 0);
    assert_int_equal(factor->coordinate, NEBEL_COORDINATE_PLANE);
    assert_int_equal(factor->stage, NEBEL_STAGE_VERTEX);
    nebel_destroy_scene(scene);
    scene = parse_good("{\"nebel\": 1, \"fog\": []}");
    assert_null(nebel_scene_contents(scene)->classic);
    nebel_destroy_scene(scene);
}

static void test_what_is_wrong(void **state)
{
    (void)state;
    static const rule rules[] = {
        {NEBEL_ERROR_FORMAT, SCENE("", "`[]"), "classic: is an array; must be an object"},
        {NEBEL_ERROR_FORMAT, SCENE("", "{`\"far\": 1}"),
         "classic.far: unknown key; the section \"classic\" has: start, end, density, color, coordinate, stage"},
        {NEBEL_ERROR_FORMAT, SCENE("", "{\"density\": `0}"),
         "classic.density: is 0; must be an amount > 0 and < 1e9 per metre"},
        {NEBEL_ERROR_FORMAT, SCENE("", "{\"end\": `\"far\"}"), "classic.end: is a string; must be a coordinate"},
        {NEBEL_ERROR_FORMAT, SCENE("", "{\"color\": [1, `-1, 1]}"), "classic.color"},
        {NEBEL_ERROR_FORMAT, SCENE("", "{\"coordinate\": `\"user\"}"),
         "classic.coordinate: unknown; must be one of: plane, radial"},
        {NEBEL_ERROR_FORMAT, SCENE("", "{\"stage\": `1}"), "classic.stage: is a number; must be"},
        {NEBEL_ERROR_FORMAT, "{\"nebel\": 1, \"classic\": {}, `\"unit\": 2, \"fog\": []}",
         "unit: comes after \"classic\""},
    };
    check_rules(rules, sizeof rules / sizeof *rules);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_everything_it_may_say),
        cmocka_unit_test(test_defaults),
        cmocka_unit_test(test_what_is_wrong),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
