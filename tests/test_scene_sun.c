/* The sun on its way from key to key, and what it lights. */
#include "near.h"
#include "scene_help.h"

#include <math.h>

#define SCENE(keys, more)                                                                                              \
    "{\"nebel\": 1, \"sun\": {\"direction\": [0, 3, 0], \"irradiance\": [4, 3, 2]" keys "}" more "}"
#define EMPTY ", \"fog\": []"
#define TOY ", \"planet\": {\"model\": \"physical\", \"preset\": \"toy\"}"
#define TWO ", \"keys\": [{\"frame\": 10}, {\"frame\": 30, \"direction\": [2, 0, 0], \"irradiance\": [0, 3, 6]}]"

static void test_what_a_key_leaves_out_it_takes_from_the_sun(void **state)
{
    (void)state;
    nebel_scene *scene = parse_good(SCENE(TWO, EMPTY));
    const nebel_scene_data *data = nebel_get_scene_data(scene);
    assert_int_equal(data->sun_key_count, 2);
    assert_vector(data->sun_direction, 0, 1, 0);
    const nebel_sun first = nebel_get_scene_sun(scene, -1e9), middle = nebel_get_scene_sun(scene, 20),
                    last = nebel_get_scene_sun(scene, HUGE_VAL);
    assert_vector(first.direction, 0, 1, 0);
    assert_vector(first.irradiance, 4, 3, 2);
    assert_vector(middle.direction, sqrt(.5), sqrt(.5), 0);
    assert_vector(middle.irradiance, 2, 3, 4);
    assert_vector(last.direction, 1, 0, 0);
    assert_vector(last.irradiance, 0, 3, 6);
    nebel_destroy_scene(scene);
}

static void test_it_is_somewhere_at_every_frame(void **state)
{
    (void)state;
    nebel_scene *scene = parse_good(SCENE(
        ", \"keys\": [{\"frame\": 0}, {\"frame\": 1, \"direction\": [0, -1, 0], \"irradiance\": 0}, {\"frame\": 2, "
        "\"direction\": [0, 0, 1]}, {\"frame\": 9, \"direction\": [1e-9, 0, -1]}]",
        EMPTY));
    for (int i = -10; i <= 100; i++) {
        const nebel_sun sun = nebel_get_scene_sun(scene, i / 10.);
        assert_near(sqrt(pow(sun.direction[0], 2) + pow(sun.direction[1], 2) + pow(sun.direction[2], 2)), 1, 1e-12);
        assert_true(sun.irradiance[0] >= 0 && sun.irradiance[0] <= 4);
    }
    nebel_destroy_scene(scene);
    /* Halfway between opposite directions there is none: it stands where it stood. */
    scene = parse_good(SCENE(", \"keys\": [{\"frame\": 0}, {\"frame\": 2, \"direction\": [0, -1, 0]}]", EMPTY));
    assert_vector(nebel_get_scene_sun(scene, 0.5).direction, 0, 1, 0);
    assert_true(fabs(nebel_get_scene_sun(scene, 1).direction[1]) == 1);
    assert_vector(nebel_get_scene_sun(scene, 1.5).direction, 0, -1, 0);
    nebel_destroy_scene(scene);
    scene = parse_good("{\"nebel\": 1, \"fog\": []}");
    assert_vector(nebel_get_scene_sun(scene, 3).irradiance, 0, 0, 0);
    assert_int_equal(nebel_set_scene_frame(scene, 3), NEBEL_OK);
    assert_int_equal(nebel_get_scene_data(scene)->has_sun, 0);
    assert_int_equal(nebel_set_scene_frame(NULL, 3), NEBEL_ERROR_ARGUMENT);
    nebel_destroy_scene(scene);
}

static void test_it_lights_fog(void **state)
{
    (void)state;
    nebel_scene *scene =
        parse_good(SCENE(TWO, ", \"fog\": [{\"shape\": {\"type\": \"sphere\", \"center\": [0, 0, 0], \"radius\": 1}, "
                              "\"extinction\": 1, \"albedo\": 1}]"));
    for (int i = 0; i < 3; i++) {
        const nebel_sun sun = nebel_get_scene_sun(scene, 10 + 10 * i);
        char text[400];
        (void)snprintf(text, sizeof text,
                       "{\"nebel\": 1, \"sun\": {\"direction\": [%.17g, %.17g, 0], \"irradiance\": [%.17g, 3, %.17g]}, "
                       "\"fog\": [{\"shape\": {\"type\": \"sphere\", \"center\": [0, 0, 0], \"radius\": 1}, "
                       "\"extinction\": 1, \"albedo\": 1}]}",
                       sun.direction[0], sun.direction[1], sun.irradiance[0], sun.irradiance[2]);
        nebel_scene *other = parse_good(text);
        assert_int_equal(nebel_set_scene_frame(scene, 10 + 10 * i), NEBEL_OK);
        const nebel_ray ray = {{.3, 0, 5}, {0, .05, -1}, (double)INFINITY};
        nebel_transfer a, b;
        scene_trace(scene, 0, (nebel_trace_desc){0}, 1, &ray, &a);
        scene_trace(other, 0, (nebel_trace_desc){0}, 1, &ray, &b);
        assert_true(b.in_scattering[2] > 0);
        for (int c = 0; c < 3; c++) assert_near(a.in_scattering[c], b.in_scattering[c], 1e-9);
        nebel_destroy_scene(other);
    }
    nebel_destroy_scene(scene);
}

/* The sky that a snapshot was lit by outlives the next one. */
static void test_it_lights_the_air_of_a_planet(void **state)
{
    (void)state;
    nebel_scene *scene = parse_good(SCENE(TWO, EMPTY TOY)),
                *low = parse_good("{\"nebel\": 1, \"fog\": [], \"sun\": {\"direction\": [1, 0, 0], \"irradiance\": [0, "
                                  "3, 6]}" TOY "}");
    const double up[3] = {0, 1, 0};
    double noon[3], dusk[3], wanted[3];
    nebel_lighting *before;
    assert_int_equal(nebel_set_scene_frame(scene, 10), NEBEL_OK);
    assert_int_equal(nebel_load_scene_planets(scene), NEBEL_OK);
    assert_int_equal(nebel_load_scene_planets(low), NEBEL_OK);
    const nebel_scene_data *data = nebel_get_scene_data(scene);
    const double left = data->planets[0].sun_left[2];
    nebel_evaluate_environment(&data->environment, up, noon);
    before = scene_light(scene, 0);
    assert_int_equal(nebel_set_scene_frame(scene, 30), NEBEL_OK);
    nebel_evaluate_environment(&data->environment, up, dusk);
    nebel_evaluate_environment(&nebel_get_scene_data(low)->environment, up, wanted);
    assert_true(data->planets[0].sun_left[2] < .5 * left);
    for (int c = 0; c < 3; c++) {
        assert_near(data->planets[0].sun_left[c], nebel_get_scene_data(low)->planets[0].sun_left[c], 1e-12);
        assert_near(dusk[c], wanted[c], 1e-12);
    }
    assert_true(fabs(dusk[1] - noon[1]) > .1 * noon[1]);
    nebel_release_lighting(before);
    nebel_destroy_scene(low);
    nebel_destroy_scene(scene);
}

/* As a file that has that sun; without one, as a file that has none. */
static void test_any_sun_lights_a_planet(void **state)
{
    (void)state;
    const double up[3] = {0, 1, 0};
    static const char *const suns[] = {", \"sun\": {\"direction\": [3, 4, 0], \"irradiance\": [1, 2, 3]}", ""};
    static const nebel_sun bright = {{3, 4, 0}, {1, 2, 3}};
    for (int i = 0; i < 2; i++) {
        char text[400];
        (void)snprintf(text, sizeof text, "{\"nebel\": 1, \"fog\": []%s%s}", suns[i], TOY);
        nebel_scene *const wanted = parse_good(text);
        (void)snprintf(text, sizeof text, "{\"nebel\": 1, \"fog\": []%s%s}", suns[1 - i], TOY);
        nebel_scene *const scene = parse_good(text);
        assert_int_equal(nebel_load_scene_planets(wanted), NEBEL_OK);
        assert_int_equal(nebel_load_scene_planets(scene), NEBEL_OK);
        assert_int_equal(nebel_set_scene_sun(scene, i == 0 ? &bright : NULL), NEBEL_OK);
        const nebel_scene_data *const a = nebel_get_scene_data(wanted), *const b = nebel_get_scene_data(scene);
        double sky[2][3];
        nebel_evaluate_environment(&a->environment, up, sky[0]);
        nebel_evaluate_environment(&b->environment, up, sky[1]);
        assert_int_equal(b->has_sun, i == 0);
        assert_true((sky[0][2] > 0) == (i == 0));
        for (int c = 0; c < 3; c++) {
            assert_near(sky[0][c], sky[1][c], 1e-12);
            if (i == 0) assert_near(a->planets[0].sun_left[c], b->planets[0].sun_left[c], 1e-12);
        }
        nebel_destroy_scene(wanted);
        nebel_destroy_scene(scene);
    }
}

static void test_suns_that_are_none(void **state)
{
    (void)state;
    nebel_scene *const scene = parse_good(SCENE(TWO, EMPTY));
    const nebel_sun before = nebel_get_scene_sun(scene, 0);
    static const nebel_sun suns[] = {{{0, 0, 0}, {1, 1, 1}},
                                     {{0, (double)NAN, 0}, {1, 1, 1}},
                                     {{0, 1e200, 0}, {1, 1, 1}},
                                     {{0, 1, 0}, {1, -1, 1}},
                                     {{0, 1, 0}, {1, 1, (double)INFINITY}}};
    for (size_t i = 0; i < sizeof suns / sizeof *suns; i++)
        assert_int_equal(nebel_set_scene_sun(scene, &suns[i]), NEBEL_ERROR_ARGUMENT);
    assert_int_equal(nebel_set_scene_sun(NULL, NULL), NEBEL_ERROR_ARGUMENT);
    assert_memory_equal(nebel_get_scene_data(scene)->sun_direction, before.direction, sizeof before.direction);
    nebel_destroy_scene(scene);
}

static void test_what_is_wrong(void **state)
{
    (void)state;
    static const rule rules[] = {
        {FORMAT, SCENE(", \"keys\": `[]", EMPTY), "sun.keys: holds no key"},
        {FORMAT, SCENE(", \"keys\": `{}", EMPTY), "sun.keys: is an object; must be an array"},
        {FORMAT, SCENE(", \"keys\": [`{}]", EMPTY), "sun.keys[0]: the key \"frame\" is missing"},
        {FORMAT, SCENE(", \"keys\": [{\"frame\": `1e10}]", EMPTY), "sun.keys[0].frame: is 10000000000"},
        {FORMAT, SCENE(", \"keys\": [{\"frame\": 1}, `{\"frame\": 1}]", EMPTY),
         "sun.keys[1]: its frame 1 is not after"},
        {FORMAT, SCENE(", \"keys\": [{\"frame\": 1, `\"keys\": []}]", EMPTY),
         "sun.keys[0].keys: unknown key; a key of the sun"},
        {FORMAT, SCENE(", \"keys\": [{\"frame\": 1, \"direction\": `[0, 0, 0]}]", EMPTY), "sun.keys[0].direction: "},
        {FORMAT, SCENE(", \"keys\": [{\"frame\": 1, \"irradiance\": `-1}]", EMPTY), "sun.keys[0].irradiance: is -1"},
        {FORMAT, SCENE(", `\"frame\": 1", EMPTY), "sun.frame: unknown key"}};
    CHECK(rules);
}

static void test_without_memory(void **state)
{
    (void)state;
    parse_without_memory(SCENE(TWO, EMPTY));
    const char *text = SCENE(TWO, EMPTY TOY);
    meter m;
    journal kept;
    nebel_scene *scene = NULL;
    const nebel_scene_desc desc = metered_desc(&m, &kept);
    assert_int_equal(nebel_parse_scene(text, strlen(text), "-", &desc, &scene), NEBEL_OK);
    assert_int_equal(nebel_load_scene_planets(scene), NEBEL_OK);
    const nebel_environment_map *map = nebel_get_scene_data(scene)->environment.map;
    nebel_result result = NEBEL_ERROR_MEMORY;
    for (long calls = 0; result != NEBEL_OK; calls++) {
        assert_true(calls < 40);
        m.fail_at = m.made + calls;
        result = nebel_set_scene_frame(scene, 20);
        if (result == NEBEL_OK) break;
        assert_int_equal(result, NEBEL_ERROR_MEMORY);
        assert_ptr_equal(nebel_get_scene_data(scene)->environment.map, map);
    }
    nebel_destroy_scene(scene);
    assert_int_equal(m.live, 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_what_a_key_leaves_out_it_takes_from_the_sun),
        cmocka_unit_test(test_it_is_somewhere_at_every_frame),
        cmocka_unit_test(test_it_lights_fog),
        cmocka_unit_test(test_it_lights_the_air_of_a_planet),
        cmocka_unit_test(test_any_sun_lights_a_planet),
        cmocka_unit_test(test_suns_that_are_none),
        cmocka_unit_test(test_what_is_wrong),
        cmocka_unit_test(test_without_memory),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
