/* Numbers of planets, back into the file: in their place, in the file's unit, and nothing else. */
#define _POSIX_C_SOURCE 200809L

#include "scene_draft.h"

#define PLANET(words) SCENE("\"unit\": 10, \"planet\": " words ", \"fog\": []")
#define CLOUDS(words) PLANET("{\"model\": \"physical\", \"clouds\": [" words "]}")

static nebel_planet planets[2];

/* With planets that may be written to. */
static draft open_planets(const char *text)
{
    draft d = open_draft(text);
    for (size_t i = 0; i < d.data.planet_count; i++) planets[i] = d.data.planets[i];
    d.data.planets = planets;
    return d;
}

static void test_layers_of_no_coverage_are_passed_over(void **state)
{
    (void)state;
    draft d = open_planets(CLOUDS("{\"coverage\": 0}, {\"top\": 300}, {\"type\": \"cirrus\", \"coverage\": 0}, "
                                  "{ /* thin */ \"type\": \"cirrus\" }"));
    assert_int_equal(planets[0].cloud_layer_count, 2);
    planets[0].cloud_layers[0].top = 2500;
    planets[0].cloud_layers[1].erosion = NEBEL_ZERO;
    planets[0].cloud_layers[1].extinction = .002;
    check_saved(&d, CLOUDS("{\"coverage\": 0}, {\"top\": 250}, {\"type\": \"cirrus\", \"coverage\": 0}, "
                           "{ /* thin */ \"type\": \"cirrus\", \"extinction\": 0.02, \"erosion\": 0 }"));
}

/* What a kind stands for is not written, whoever writes it out. */
static void test_an_empty_layer(void **state)
{
    (void)state;
    draft d = open_planets(CLOUDS("{}"));
    assert_int_equal(nebel_resolve_cloud_layer(planets[0].atmosphere_desc.thickness, planets[0].cloud_layers, NULL,
                                               planets[0].cloud_layers),
                     NEBEL_OK);
    check_saved(&d, CLOUDS("{}"));
    d = open_planets(CLOUDS("{}"));
    planets[0].cloud_layers[0].coverage = .25;
    planets[0].cloud_layers[0].wind[1] = 20;
    check_saved(&d, CLOUDS("{ \"coverage\": 0.25, \"wind\": [0, 2] }"));
}

/* The preset's airs are written out, the file's own are changed in their place. */
static void test_airs(void **state)
{
    (void)state;
    draft d = open_planets(PLANET("{\"model\": \"physical\", \"preset\": \"moon\", \"ground_albedo\": 0.5}"));
    planets[0].atmosphere_desc.components[0].scattering[1] = .001;
    planets[0].atmosphere_desc.components[0].scale_height = 3000;
    check_saved(&d, PLANET("{\"model\": \"physical\", \"preset\": \"moon\", \"ground_albedo\": 0.5, \"components\": [{ "
                           "\"type\": \"exponential\", \"phase\": { \"type\": \"isotropic\" }, \"scattering\": [0, "
                           "0.01, 0], \"absorption\": 0, \"scale_height\": 300 }]}"));
    d = open_planets(
        PLANET("{\"model\": \"physical\", \"components\": [ {\"type\": \"exponential\", \"scale_height\": 800} ]}"));
    planets[0].atmosphere_desc.components[0].phase = (nebel_phase){.type = NEBEL_PHASE_RAYLEIGH};
    planets[0].atmosphere_desc.ground_albedo[0] = planets[0].atmosphere_desc.ground_albedo[1] =
        planets[0].atmosphere_desc.ground_albedo[2] = 1;
    check_saved(&d,
                PLANET("{\"model\": \"physical\", \"components\": [ {\"type\": \"exponential\", \"scale_height\": 800, "
                       "\"phase\": { \"type\": \"rayleigh\" }} ], \"ground_albedo\": 1}"));
}

/* The file is what it was after every error. */
static void check_refused(const char *now, draft *d, nebel_result wanted, const char *message)
{
    journal kept;
    write_file(now);
    assert_int_equal(save(d, &kept), wanted);
    if (strstr(kept.last, message) == NULL) fail_msg("%s", kept.last);
    assert_string_equal(read_file(), now);
}

static void test_what_is_refused(void **state)
{
    (void)state;
    static const char
        one[] = CLOUDS("{}"),
        *const others[] = {
            PLANET("[{\"model\": \"physical\", \"clouds\": [{}]}, {\"model\": \"physical\", \"preset\": \"moon\", "
                   "\"center\": [0, 1e8, 0]}]"),
            CLOUDS(""), PLANET("{\"model\": \"textured\"}"), SCENE("\"fog\": []"),
            PLANET("{\"model\": \"physical\", \"components\": [{\"type\": \"exponential\", \"scale_height\": 8000, "
                   "\"scattering\": 1e-6}], \"clouds\": [{}]}")};
    for (size_t i = 0; i < sizeof others / sizeof *others; i++) {
        draft d = open_planets(one);
        check_refused(others[i], &d, NEBEL_ERROR_ARGUMENT, "the file has changed, load it again");
    }
    draft d = open_planets(one);
    d.data.planet_count = 0;
    check_refused(one, &d, NEBEL_ERROR_ARGUMENT, "other planets");
    d = open_planets(one);
    planets[0].cloud_layers[0].base = 99000;
    check_refused(one, &d, NEBEL_ERROR_FORMAT, "planet.clouds[0]");
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_layers_of_no_coverage_are_passed_over),
        cmocka_unit_test(test_an_empty_layer),
        cmocka_unit_test(test_airs),
        cmocka_unit_test(test_what_is_refused),
    };
    return cmocka_run_group_tests(tests, make_folder, remove_folder);
}
