/* The section "multiple_scattering" of scene files: what it becomes, what replaces it, and what is wrong with it. */
#include "near.h"
#include "scene_help.h"

#include <stdio.h>

#define SCENE(top, members) "{\"nebel\": 1, " top "\"fog\": [], \"multiple_scattering\": " members "}"

static void test_everything_it_may_say(void **state)
{
    (void)state;
    nebel_scene *scene = parse_good(
        SCENE("\"unit\": 0.5, ", "{\"model\": \"diffusion\", \"max_cells\": 1000, \"ground\": {\"height\": -3, "
                                 "\"albedo\": [0.1, 0.2, 0.3]}}"));
    const nebel_diffusion_desc *desc = nebel_get_scene_data(scene)->diffusion;
    assert_int_equal(desc->max_cells, 1000);
    assert_int_equal(desc->has_ground, 1);
    assert_number(desc->ground_height, -1.5);
    assert_number(desc->ground_albedo[2], .3);
    nebel_destroy_scene(scene);
}

static void test_defaults(void **state)
{
    (void)state;
    nebel_scene *scene = parse_good(SCENE("", "{\"model\": \"diffusion\"}"));
    assert_int_equal(nebel_get_scene_data(scene)->diffusion->max_cells, 0);
    assert_int_equal(nebel_get_scene_data(scene)->diffusion->has_ground, 0);
    nebel_destroy_scene(scene);
    scene = parse_good(SCENE("", "{\"model\": \"diffusion\", \"ground\": {}}"));
    assert_int_equal(nebel_get_scene_data(scene)->diffusion->has_ground, 1);
    assert_number(nebel_get_scene_data(scene)->diffusion->ground_albedo[0], 0);
    nebel_destroy_scene(scene);
    scene = parse_good("{\"nebel\": 1, \"fog\": []}");
    assert_null(nebel_get_scene_data(scene)->diffusion);
    nebel_destroy_scene(scene);
}

/* What a ray through the ball sees of the sun. */
static double light_of(const nebel_scene *scene)
{
    nebel_transfer transfer;
    const nebel_ray ray = {{0, 0, 9}, {0, 0, -1}, 20};
    scene_trace(scene, 0, (nebel_trace_desc){0}, 1, &ray, &transfer);
    return transfer.in_scattering[0];
}

static void test_a_program_may_say_otherwise(void **state)
{
    (void)state;
    nebel_scene *scene = parse_good(
        "{\"nebel\": 1, \"sun\": {\"direction\": [1, 1, 1], \"irradiance\": 3}, \"fog\": [{\"shape\": {\"type\": "
        "\"sphere\", \"center\": [0, 0, 0], \"radius\": 2}, \"extinction\": 2, \"albedo\": 1}], "
        "\"multiple_scattering\": {\"model\": \"diffusion\"}}");
    nebel_diffusion_desc desc = {.max_cells = 8000};
    const double file = light_of(scene);
    assert_int_equal(nebel_set_scene_diffusion(scene, NULL), NEBEL_OK);
    const double off = light_of(scene);
    assert_int_equal(nebel_set_scene_diffusion(scene, &desc), NEBEL_OK);
    desc.max_cells = 1; /* it has a copy */
    const double coarse = light_of(scene);
    assert_true(off * 2 < file);
    assert_true(fabs(coarse - file) < .05 * file);
    assert_int_equal(nebel_set_scene_diffusion(NULL, &desc), NEBEL_ERROR_ARGUMENT);
    nebel_destroy_scene(scene);
}

static void test_what_is_wrong(void **state)
{
    (void)state;
    const rule rules[] = {
        {FORMAT, SCENE("", "`\"diffusion\""), "multiple_scattering: is a string; must be an object"},
        {FORMAT, SCENE("", "`{}"), "multiple_scattering: "},
        {FORMAT, SCENE("", "{\"model\": `\"octaves\"}"),
         "multiple_scattering.model: unknown; must be one of: diffusion"},
        {FORMAT, SCENE("", "{\"model\": \"diffusion\", \"max_cells\": `100}"),
         "multiple_scattering.max_cells: is 100; must be"},
        {FORMAT, SCENE("", "{\"model\": \"diffusion\", \"ground\": `2}"), "multiple_scattering.ground: is a number"},
        {FORMAT, SCENE("", "{\"model\": \"diffusion\", \"ground\": {\"height\": `2e15}}"),
         "multiple_scattering.ground.height: is 2e+15"},
        {FORMAT, SCENE("", "{\"model\": \"diffusion\", \"ground\": {\"albedo\": `2}}"),
         "multiple_scattering.ground.albedo: is 2"},
        {FORMAT, SCENE("", "{\"model\": \"diffusion\", `\"lattice\": 2}"), "multiple_scattering.lattice: unknown key"}};
    CHECK(rules);
}

static void test_without_memory(void **state)
{
    (void)state;
    parse_without_memory(SCENE("", "{\"model\": \"diffusion\", \"ground\": {\"albedo\": 0.5}}"));
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_everything_it_may_say), cmocka_unit_test(test_defaults),
                                       cmocka_unit_test(test_a_program_may_say_otherwise),
                                       cmocka_unit_test(test_what_is_wrong), cmocka_unit_test(test_without_memory)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
