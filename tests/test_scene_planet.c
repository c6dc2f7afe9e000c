/* The section "planet" of scene files: what it becomes, what its air does to the scene's light, and what is wrong. */
#include "near.h"
#include "scene_help.h"

#include <stdio.h>

#define SCENE(top, members) "{\"nebel\": 1, " top "\"fog\": [], \"planet\": " members "}"
#define EARTH "{\"model\": \"physical\"}"
#define MOON_AT(y) "{\"model\": \"physical\", \"preset\": \"moon\", \"center\": [0, " y ", 0]}"
#define SUN "\"sun\": {\"direction\": [1, 1, 0], \"irradiance\": [4, 3, 2]}, "

static void test_defaults(void **state)
{
    (void)state;
    nebel_scene *scene = parse_good("{\"nebel\": 1, \"fog\": []}");
    assert_int_equal(nebel_get_scene_data(scene)->planet_count, 0);
    assert_int_equal(nebel_load_scene_planets(scene), NEBEL_OK);
    nebel_destroy_scene(scene);
    scene = parse_good(SCENE("", "{\"model\": \"physical\"}"));
    assert_int_equal(nebel_get_scene_data(scene)->planet_count, 1);
    const nebel_planet *planet = nebel_get_scene_data(scene)->planets;
    assert_int_equal(planet->model, NEBEL_PLANET_PHYSICAL);
    assert_number(planet->atmosphere_desc.radius, 6.36e6);
    assert_number(planet->atmosphere_desc.ground_point[1], 0);
    assert_int_equal(planet->atmosphere_desc.component_count, 3);
    assert_int_equal(planet->atmosphere_desc.quality, NEBEL_ATMOSPHERE_FAST);
    assert_near(planet->sun_angular_diameter, .533, 1e-3);
    assert_null(planet->atmosphere);
    nebel_destroy_scene(scene);
    scene = parse_good(SCENE("", "{\"model\": \"physical\", \"preset\": \"mars\"}"));
    assert_number(nebel_get_scene_data(scene)->planets[0].atmosphere_desc.radius, 3.3895e6);
    nebel_destroy_scene(scene);
}

static void test_everything_it_may_say(void **state)
{
    (void)state;
    nebel_scene *scene = parse_good(SCENE(
        "\"up\": \"z\", \"unit\": 1000, ",
        "{\"model\": \"physical\", \"preset\": \"toy\", \"center\": [1, 2, -30], \"radius\": 20, \"thickness\": 5, "
        "\"ground_albedo\": [0.1, 0.2, 0.3], \"quality\": \"precise\", \"sun_angular_diameter\": 2, \"components\": "
        "[{\"type\": "
        "\"exponential\", \"scattering\": [1, 2, 3], \"phase\": {\"type\": \"henyey_greenstein\", \"g\": 0.5}, "
        "\"scale_height\": 0.5}, {\"type\": \"tent\", \"absorption\": 4, \"center_height\": 3, \"half_width\": 1}]}"));
    const nebel_planet *planet = nebel_get_scene_data(scene)->planets;
    const nebel_atmosphere_component *air = planet->atmosphere_desc.components;
    assert_number(planet->atmosphere_desc.ground_point[0], 1000);
    assert_number(planet->atmosphere_desc.ground_point[1], -30000 + 20000);
    assert_number(planet->atmosphere_desc.ground_point[2], -2000);
    assert_number(planet->atmosphere_desc.radius, 20000);
    assert_number(planet->atmosphere_desc.thickness, 5000);
    assert_number(planet->atmosphere_desc.ground_albedo[2], .3);
    assert_int_equal(planet->atmosphere_desc.quality, NEBEL_ATMOSPHERE_PRECISE);
    assert_number(planet->sun_angular_diameter, 2);
    assert_int_equal(planet->atmosphere_desc.component_count, 2);
    assert_int_equal(air[0].profile, NEBEL_COMPONENT_EXPONENTIAL);
    assert_number(air[0].scattering[2], 3e-3);
    assert_number(air[0].absorption[2], 0);
    assert_number(air[0].phase.g, .5);
    assert_number(air[0].scale_height, 500);
    assert_int_equal(air[1].profile, NEBEL_COMPONENT_TENT);
    assert_number(air[1].absorption[0], 4e-3);
    assert_number(air[1].center_height, 3000);
    assert_number(air[1].half_width, 1000);
    nebel_destroy_scene(scene);
}

/* Half of it: heights of the preset's air twice as large, none that are given. */
static void test_gravity_stretches_presets(void **state)
{
    (void)state;
    const nebel_atmosphere_desc *earth = nebel_lookup_atmosphere("earth");
    nebel_scene *scene = parse_good(SCENE("", "{\"model\": \"physical\", \"gravity\": 4.91}"));
    const nebel_atmosphere_desc *air = &nebel_get_scene_data(scene)->planets[0].atmosphere_desc;
    assert_number(air->thickness, 2 * earth->thickness);
    assert_number(air->components[0].scale_height, 2 * earth->components[0].scale_height);
    assert_number(air->components[1].scale_height, 2 * earth->components[1].scale_height);
    assert_number(air->components[2].center_height, 2 * earth->components[2].center_height);
    assert_number(air->components[2].half_width, 2 * earth->components[2].half_width);
    assert_number(air->components[0].scattering[2], earth->components[0].scattering[2]);
    assert_number(air->radius, earth->radius);
    nebel_destroy_scene(scene);
    scene =
        parse_good(SCENE("", "{\"model\": \"physical\", \"preset\": \"mars\", \"gravity\": 1.865, \"thickness\": 2e5, "
                             "\"components\": [{\"type\": \"exponential\", \"scale_height\": 8000}]}"));
    air = &nebel_get_scene_data(scene)->planets[0].atmosphere_desc;
    assert_number(air->thickness, 2e5);
    assert_number(air->components[0].scale_height, 8000);
    nebel_destroy_scene(scene);
}

static const char lit_fog[] =
    "{\"nebel\": 1, " SUN
    "%s \"planet\": {\"model\": \"physical\", \"preset\": \"toy\"}, \"fog\": [{\"shape\": {\"type\": "
    "\"sphere\", \"center\": [0, 10, 0], \"radius\": 5}, \"extinction\": 0.1, \"albedo\": 1}]}";

/* What a ray through the ball sees. */
static nebel_transfer light_of(const nebel_scene *scene)
{
    nebel_transfer transfer;
    const nebel_ray ray = {{0, 10, 9}, {0, 0, -1}, 20};
    scene_trace(scene, 0, (nebel_trace_desc){0}, 1, &ray, &transfer);
    return transfer;
}

/* With ambient light of its own, 0, fog is lit by what the air leaves of the sun; without, by the sky as well. */
static void test_air_lights_fog(void **state)
{
    (void)state;
    char text[600];
    nebel_transfer dimmed = {.error = 0};
    for (int with_sky = 0; with_sky < 2; with_sky++) {
        (void)snprintf(text, sizeof text, lit_fog, with_sky ? "" : "\"ambient\": 0,");
        nebel_scene *scene = parse_good(text);
        const nebel_scene_data *data = nebel_get_scene_data(scene);
        const nebel_transfer clear = light_of(scene);
        assert_int_equal(nebel_load_scene_planets(scene), NEBEL_OK);
        assert_int_equal(nebel_load_scene_planets(scene), NEBEL_OK);
        const nebel_transfer transfer = light_of(scene);
        assert_non_null(data->planets[0].atmosphere);
        assert_number(data->sun_irradiance[0], 4);
        assert_int_equal(data->environment.type, with_sky ? NEBEL_ENVIRONMENT_MAP : NEBEL_ENVIRONMENT_CONSTANT);
        for (int c = 0; c < 3; c++) {
            const double left = data->planets[0].sun_left[c];
            assert_true(left > .3 && left < 1);
            if (!with_sky) assert_near(transfer.in_scattering[c], clear.in_scattering[c] * left, 1e-6);
            if (with_sky) assert_true(transfer.in_scattering[c] > 1.02 * dimmed.in_scattering[c]);
        }
        dimmed = transfer;
        nebel_destroy_scene(scene);
    }
    assert_int_equal(nebel_load_scene_planets(NULL), NEBEL_ERROR_ARGUMENT);
}

/* The map holds what nebel_trace_atmosphere sees, and the ground below. */
static void test_sky_is_that_of_the_air(void **state)
{
    (void)state;
    nebel_scene *scene = parse_good(
        SCENE(SUN, "{\"model\": \"physical\", \"ground_albedo\": 0.5, \"components\": [{\"type\": \"exponential\", "
                   "\"scattering\": 2e-5, \"phase\": {\"type\": \"rayleigh\"}, \"scale_height\": 8000}]}"));
    const nebel_scene_data *data = nebel_get_scene_data(scene);
    assert_int_equal(nebel_load_scene_planets(scene), NEBEL_OK);
    nebel_sun sun = {.irradiance = {4, 3, 2}};
    memcpy(sun.direction, data->sun_direction, sizeof sun.direction);
    static const double ways[][3] = {{0, 1, 0}, {1, 1, 0}, {-1, .5, .3}, {0, .3, -1}, {.2, .6, 1}};
    for (int i = 0; i < 5; i++) {
        const nebel_ray ray = {{0, 0, 0}, {ways[i][0], ways[i][1], ways[i][2]}, (double)INFINITY};
        nebel_transfer transfer;
        double seen[3];
        assert_int_equal(nebel_trace_atmosphere(data->planets[0].atmosphere, &sun, 1, &ray, 0, &transfer, 0), NEBEL_OK);
        nebel_evaluate_environment(&data->environment, ways[i], seen);
        for (int c = 0; c < 3; c++) assert_near(seen[c] / transfer.in_scattering[c], 1, .03);
    }
    static const double origin[1][3] = {{0, 0, 0}}, down[3] = {0, -1, 0};
    nebel_irradiance arrives;
    double ground[3];
    assert_int_equal(nebel_compute_atmosphere_irradiance(data->planets[0].atmosphere, &sun, 1, origin, 0, &arrives, 0),
                     NEBEL_OK);
    nebel_evaluate_environment(&data->environment, down, ground);
    for (int c = 0; c < 3; c++)
        assert_near(ground[c], .5 / acos(-1) * (sqrt(.5) * arrives.sun[c] + arrives.sky[c]), 2e-3);
    nebel_destroy_scene(scene);
}

static void test_what_is_wrong(void **state)
{
    (void)state;
#define PHYSICAL(members) SCENE("", "{\"model\": \"physical\", " members "}")
#define AIR(members) PHYSICAL("\"components\": [{\"type\": \"exponential\", \"scale_height\": 8000, " members "}]")
    const rule rules[] = {
        {FORMAT, SCENE("", "`\"earth\""), "planet: is a string; must be an object"},
        {FORMAT, SCENE("", "`{}"), "planet: the key \"model\" is missing"},
        {FORMAT, SCENE("", "{\"model\": `\"shells\"}"), "planet.model: unknown; must be one of: physical, textured"},
        {FORMAT, PHYSICAL("\"preset\": `\"venus\""), "planet.preset: unknown; must be one of: earth, mars, toy, moon"},
        {FORMAT, PHYSICAL("`\"ozone\": 1"), "planet.ozone: unknown key; a physical planet has: model, preset"},
        {FORMAT, PHYSICAL("\"gravity\": `0"), "planet.gravity: is 0; must be a number from 0.1 to 1000, in m/s^2"},
        {FORMAT, PHYSICAL("\"radius\": `0"), "planet.radius: is 0; must be a length from 1 to 1e12 m"},
        {FORMAT, PHYSICAL("\"radius\": `-6e6"), "planet.radius: is -6000000; must be"},
        {FORMAT, PHYSICAL("\"thickness\": `0"),
         "planet.thickness: is 0; must be a length (radius / 1e6 or more) from 6.36 to 1e12 m"},
        {FORMAT, PHYSICAL("\"thickness\": `6"), "planet.thickness: is 6; must be a length"},
        {FORMAT, SCENE("\"unit\": 0.01, ", "{\"model\": \"physical\", \"thickness\": `1}"),
         "planet.thickness: is 1; must be a length (radius / 1e6 or more) from 636 to 1e14 units of 0.01 m"},
        {FORMAT, SCENE("", "`{\"model\": \"physical\", \"thickness\": 1e8}"),
         "planet.components[0].scale_height: is 8000 m; must be within 100000 m (a thousandth of the thickness) and "
         "1e+15 m; "
         "these components are the preset's"},
        {FORMAT, SCENE("", "`{\"model\": \"physical\", \"thickness\": 9000}"),
         "planet.components[2].center_height: is 25000 m; must be within 0 m and 9000 m (the thickness); these "
         "components are the "
         "preset's"},
        {FORMAT, PHYSICAL("\"components\": [{\"type\": \"exponential\", \"scale_height\": `1}]"),
         "planet.components[0].scale_height: is 1 m; must be within 100 m (a thousandth of the thickness) and 1e+15 m"},
        {FORMAT,
         SCENE("",
               "[" EARTH ", {\"model\": \"physical\", \"center\": [0, 9e7, 0], \"components\": [{\"type\": \"tent\", "
               "\"center_height\": 1, \"half_width\": 1e3}, {\"type\": \"tent\", \"center_height\": `2e5, "
               "\"half_width\": 1e3}]}]"),
         "planet[1].components[1].center_height: is 200000 m; must be within 0 m and 100000 m (the thickness)"},
        {FORMAT, PHYSICAL("\"center\": `[0, 1e15, 0]"), "planet.center: lies so high"},
        {FORMAT, PHYSICAL("\"center\": [0, `2e15, 0]"), "planet.center[1]: is 2e+15"},
        {FORMAT, PHYSICAL("\"center\": `[0, 0]"), "planet.center: has 2 elements"},
        {FORMAT, PHYSICAL("\"ground_albedo\": `1.5"), "planet.ground_albedo: is 1.5"},
        {FORMAT, PHYSICAL("\"quality\": `\"best\""), "planet.quality: unknown; must be one of: fast, precise"},
        {FORMAT, PHYSICAL("\"sun_angular_diameter\": `11"), "planet.sun_angular_diameter: is 11"},
        {FORMAT, PHYSICAL("\"components\": `{}"), "planet.components: is an object; must be an array"},
        {FORMAT, PHYSICAL("\"components\": [{\"type\": `\"vacuum\"}]"),
         "planet.components[0].type: unknown; must be one of: exponential, tent"},
        {FORMAT, AIR("\"scattering\": `2000"), "planet.components[0].scattering: is 2000"},
        {FORMAT, AIR("\"absorption\": [0, `-1, 0]"), "planet.components[0].absorption[1]: is -1"},
        {FORMAT, AIR("`\"half_width\": 5"), "planet.components[0].half_width: unknown key"},
        {FORMAT, AIR("\"phase\": {\"type\": `\"mie\"}"), "planet.components[0].phase.type: unknown"},
        {LIMIT, PHYSICAL("\"components\": [1, 2, 3, 4, `5]"),
         "planet.components[4]: is one too many; a planet has at most 4 kinds of air"},
        {LIMIT,
         PHYSICAL("\"components\": [{\"type\": \"exponential\", \"scale_height\": 8000}, {\"type\": \"exponential\", "
                  "\"scale_height\": 8000}, {\"type\": \"exponential\", \"scale_height\": 8000}, {\"type\": "
                  "\"exponential\", \"scale_height\": 8000}, `{\"type\": \"exponential\", \"scale_height\": 1}]"),
         "planet.components[4]: is one too many"},
        {FORMAT, SCENE("", "`[]"), "planet: is empty; leave it out for no planet"},
        {FORMAT, SCENE("", "`5"), "planet: is a number; must be an object {\"model\": ...}, or an array of those"},
        {FORMAT, SCENE("", "[" EARTH ", `7]"), "planet[1]: is a number"},
        {FORMAT, SCENE("", "[" EARTH ", `" EARTH "]"),
         "planet[1]: overlaps planet[0], air included; give it a \"center\" of its own"},
        {FORMAT, SCENE("", "[" EARTH ", `" MOON_AT("1.83e6") "]"), "planet[1]: overlaps planet[0]"},
        {FORMAT, SCENE("", "[" EARTH ", `{\"model\": \"textured\", \"center\": [0, 9e7, 0]}]"),
         "planet[1]: is a textured planet, which stands alone"},
        {FORMAT, SCENE("", "[" EARTH ", `{\"model\": \"physical\", \"center\": [0, 9e7, 0], \"clouds\": [{}]}]"),
         "planet[1]: has clouds; the first planet alone may"},
        {LIMIT,
         SCENE("", "[" EARTH "," MOON_AT("1e8") "," MOON_AT("2e8") "," MOON_AT("3e8") "," MOON_AT("4e8") "," MOON_AT(
                       "5e8") "," MOON_AT("6e8") "," MOON_AT("7e8") ", `" MOON_AT("8e8") "]"),
         "planet[8]: is one too many; a scene has at most 8 planets"},
        {LIMIT,
         SCENE("", "[" EARTH "," EARTH "," EARTH "," EARTH "," EARTH "," EARTH "," EARTH "," EARTH ", `" EARTH "]"),
         "planet[8]: is one too many"}};
    CHECK(rules);
}

static void test_several(void **state)
{
    (void)state;
    nebel_scene *scene =
        parse_good(SCENE("\"sun\": {\"direction\": [0, 1, 0], \"irradiance\": 4}, ",
                         "[" EARTH "," MOON_AT("8.3e6") ", {\"model\": \"physical\", \"preset\": \"toy\", \"center\": "
                                                        "[0, -2e7, 0], \"components\": []}]"));
    const nebel_scene_data *data = nebel_get_scene_data(scene);
    assert_int_equal(data->planet_count, 3);
    assert_number(data->planets[1].atmosphere_desc.ground_point[1], 8.3e6 + 1.7374e6);
    assert_number(data->planets[1].atmosphere_desc.ground_albedo[0], .11);
    assert_int_equal(data->planets[2].atmosphere_desc.component_count, 1);
    assert_int_equal(nebel_load_scene_planets(scene), NEBEL_OK);
    for (int i = 0; i < 3; i++) assert_non_null(data->planets[i].atmosphere);
    /* The moon in the zenith hides the sun. */
    assert_true(data->planets[0].sun_left[0] == 0);
    /* No air, no light but the sun's. */
    const nebel_sun sun = {.direction = {1, 0, 0}, .irradiance = {4, 3, 2}};
    const nebel_ray rays[2] = {{{-3e6, 8.4e6, 1e5}, {1, .1, 0}, (double)INFINITY},
                               {{0, 8.3e6 + 1.7374e6 + 50, 0}, {1, -.00001, 0}, (double)INFINITY}};
    const double places[2][3] = {{1.8e6, 8.3e6, 0}, {-1.8e6, 8.3e6, 0}};
    nebel_transfer transfer[2];
    nebel_irradiance there[2];
    assert_int_equal(
        nebel_trace_atmosphere(data->planets[1].atmosphere, &sun, 2, rays, sizeof *rays, transfer, sizeof *transfer),
        NEBEL_OK);
    assert_int_equal(nebel_compute_atmosphere_irradiance(data->planets[1].atmosphere, &sun, 2, places, sizeof *places,
                                                         there, sizeof *there),
                     NEBEL_OK);
    for (int c = 0; c < 3; c++) {
        for (int i = 0; i < 2; i++) {
            assert_true(transfer[i].transmittance[c] == 1 && transfer[i].in_scattering[c] == 0);
            assert_true(there[i].sky[c] >= 0 && there[i].sky[c] < 1e-20);
        }
        assert_number(there[0].sun[c], sun.irradiance[c]);
        assert_true(there[1].sun[c] == 0);
    }
    nebel_destroy_scene(scene);
}

static void test_without_memory(void **state)
{
    (void)state;
    parse_without_memory(SCENE("", "[" EARTH "," MOON_AT("1e8") "]"));
    parse_without_memory(
        SCENE("", "{\"model\": \"physical\", \"components\": [{\"type\": \"exponential\", \"scale_height\": "
                  "8000}]}"));
    const char *text = SCENE(SUN, "[{\"model\": \"physical\", \"preset\": \"toy\"}, " MOON_AT("1e8") "]");
    for (long calls = 0;; calls += 2) {
        meter m;
        journal kept;
        nebel_scene *scene = NULL;
        const nebel_scene_desc desc = metered_desc(&m, &kept);
        assert_int_equal(nebel_parse_scene(text, strlen(text), "-", &desc, &scene), NEBEL_OK);
        m.fail_at = m.made + calls;
        const nebel_result result = nebel_load_scene_planets(scene);
        if (result != NEBEL_OK) {
            assert_int_equal(result, NEBEL_ERROR_MEMORY);
            assert_null(nebel_get_scene_data(scene)->planets[0].atmosphere);
            assert_int_equal(nebel_get_scene_data(scene)->environment.type, NEBEL_ENVIRONMENT_CONSTANT);
        }
        nebel_destroy_scene(scene);
        assert_int_equal(m.live, 0);
        if (result == NEBEL_OK) break;
        assert_true(calls < 80);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_defaults),
        cmocka_unit_test(test_everything_it_may_say),
        cmocka_unit_test(test_gravity_stretches_presets),
        cmocka_unit_test(test_air_lights_fog),
        cmocka_unit_test(test_sky_is_that_of_the_air),
        cmocka_unit_test(test_what_is_wrong),
        cmocka_unit_test(test_several),
        cmocka_unit_test(test_without_memory),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
