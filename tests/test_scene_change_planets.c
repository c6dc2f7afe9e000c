/* Planets of a scene that get other numbers: they become those of a file that has them, or stay as they were. */
#include "near.h"
#include "scene_help.h"

#include <math.h>

#define SUN "\"sun\": {\"direction\": [0, 1, 0.2], \"irradiance\": [4, 3, 2]}, "
#define SCENE(planet) "{\"nebel\": 1, " SUN "\"fog\": [], \"planet\": " planet "}"
#define PICTURE NEBEL_SOURCE "/docs/pictures/fog-sphere-tessellated-difference.png"
#define TOY(more) SCENE("{\"model\": \"physical\", \"preset\": \"toy\"" more "}")

static nebel_scene *load(const char *text)
{
    nebel_scene *const scene = parse_good(text);
    assert_int_equal(nebel_load_scene_planets(scene), NEBEL_OK);
    return scene;
}

static void same_light(const nebel_scene *a, const nebel_scene *b)
{
    const double up[3] = {0.6, 0.8, 0};
    double sky[2][3];
    nebel_sun sun[2];
    nebel_evaluate_environment(&nebel_get_scene_data(a)->environment, up, sky[0]);
    nebel_evaluate_environment(&nebel_get_scene_data(b)->environment, up, sky[1]);
    assert_int_equal(nebel_find_scene_sunlight(a, 3, &sun[0]), NEBEL_OK);
    assert_int_equal(nebel_find_scene_sunlight(b, 3, &sun[1]), NEBEL_OK);
    for (int c = 0; c < 3; c++) {
        assert_near(sky[0][c], sky[1][c], 1e-12);
        assert_near(sun[0].irradiance[c], sun[1].irradiance[c], 1e-12);
    }
}

/* All of it is that of a scene of such numbers. */
static void test_air_and_clouds(void **state)
{
    (void)state;
    nebel_scene *const scene = load(TOY(", \"clouds\": [{}, {\"type\": \"cirrus\"}]"));
    nebel_planet planet = nebel_get_scene_data(scene)->planets[0];
    nebel_sun before, now;
    assert_int_equal(nebel_find_scene_sunlight(scene, 3, &before), NEBEL_OK);
    nebel_scene *const other =
        load(TOY(", \"components\": [{\"type\": \"exponential\", \"scattering\": 0.001, \"absorption\": [0, 1e-4, 0], "
                 "\"phase\": "
                 "{\"type\": \"henyey_greenstein\", \"g\": 0.5}, \"scale_height\": 25}, {\"type\": \"exponential\", "
                 "\"scattering\": 0.002, \"scale_height\": 4}], \"ground_albedo\": 0.75, \"sun_angular_diameter\": 2, "
                 "\"clouds\": "
                 "[{\"coverage\": 0.9, \"cell_size\": "
                 "30, \"erosion\": 0, \"wind\": [3, 4]}, {\"type\": \"cirrus\", \"extinction\": 0.03}]"));
    const nebel_planet *const wanted = nebel_get_scene_data(other)->planets;
    assert_int_equal(planet.atmosphere_desc.component_count, wanted->atmosphere_desc.component_count);
    memcpy(planet.atmosphere_desc.components, wanted->atmosphere_desc.components,
           sizeof planet.atmosphere_desc.components);
    memcpy(planet.atmosphere_desc.ground_albedo, wanted->atmosphere_desc.ground_albedo,
           sizeof planet.atmosphere_desc.ground_albedo);
    planet.sun_angular_diameter = 2;
    memcpy(planet.cloud_layers, wanted->cloud_layers, sizeof planet.cloud_layers);
    /* What does not count stays. */
    planet.atmosphere_desc.radius = 7;
    planet.cloud_layers[0].type = NEBEL_CLOUD_STRATUS;
    planet.cloud_layers[1].seed = 77;
    assert_int_equal(nebel_update_scene_planets(scene, &planet), NEBEL_OK);
    const nebel_planet *const made = nebel_get_scene_data(scene)->planets;
    assert_non_null(made->atmosphere);
    assert_non_null(made->clouds);
    assert_number(made->atmosphere_desc.radius, wanted->atmosphere_desc.radius);
    assert_int_equal(made->cloud_layers[0].type, NEBEL_CLOUD_CUMULUS);
    assert_int_equal(made->cloud_layers[1].seed, 2);
    assert_number(made->sun_angular_diameter, 2);
    same_light(scene, other);
    assert_int_equal(nebel_find_scene_sunlight(scene, 3, &now), NEBEL_OK);
    assert_true(fabs(now.irradiance[1] - before.irradiance[1]) > 1e-3 * before.irradiance[1]);
    nebel_destroy_scene(other);
    nebel_destroy_scene(scene);
}

static void test_layers(void **state)
{
    (void)state;
    /* One map is made; that takes a second. */
    nebel_scene *const scene = load(SCENE("{\"model\": \"textured\", \"color_map\": \"" PICTURE
                                          "\", \"clouds\": [{\"coverage_map\": \"" PICTURE "\"}, {\"seed\": 4}]}"));
    nebel_planet planet = nebel_get_scene_data(scene)->planets[0];
    planet.textured_desc.rotation_period = 24;
    planet.textured_desc.radius = 3;
    planet.textured_desc.cloud_shells[1].gain = .25;
    planet.textured_desc.cloud_shells[1].seed = 5;
    planet.textured_desc.atmosphere.brightness = 2;
    assert_int_equal(nebel_update_scene_planets(scene, &planet), NEBEL_OK);
    const nebel_planet *const made = nebel_get_scene_data(scene)->planets;
    const nebel_textured_planet_desc *const layers = nebel_get_textured_planet_desc(made->textured);
    assert_number(layers->rotation_period, 24);
    assert_number(layers->radius, 6.36e6);
    assert_number(layers->cloud_shells[0].gain, .6);
    assert_number(layers->cloud_shells[1].gain, .25);
    assert_int_equal(layers->cloud_shells[1].seed, 4);
    assert_number(layers->atmosphere.brightness, 2);
    const nebel_textured_planet *const kept = made->textured;
    planet.textured_desc.cloud_shells[0].gain = -1;
    assert_int_equal(nebel_update_scene_planets(scene, &planet), NEBEL_ERROR_VALUE);
    assert_ptr_equal(made->textured, kept);
    assert_number(made->textured_desc.cloud_shells[0].gain, 0);
    nebel_destroy_scene(scene);
}

typedef struct wrong {
    nebel_planet planet;
    const char *message;
} wrong;

/* All stays, and the log says why. */
static void test_what_is_wrong(void **state)
{
    (void)state;
    const char *const text = TOY(", \"clouds\": [{}, {\"type\": \"cirrus\"}]");
    meter m;
    journal kept;
    nebel_scene *scene = NULL;
    const nebel_scene_desc desc = metered_desc(&m, &kept);
    assert_int_equal(nebel_parse_scene(text, strlen(text), "-", &desc, &scene), NEBEL_OK);
    const nebel_planet *const own = nebel_get_scene_data(scene)->planets;
    assert_int_equal(nebel_update_scene_planets(scene, own), NEBEL_ERROR_ARGUMENT);
    assert_int_equal(nebel_update_scene_planets(NULL, own), NEBEL_ERROR_ARGUMENT);
    assert_int_equal(nebel_load_scene_planets(scene), NEBEL_OK);
    assert_int_equal(nebel_update_scene_planets(scene, NULL), NEBEL_ERROR_ARGUMENT);
    wrong faults[] = {{*own, "planet: sun_angular_diameter"},
                      {*own, "ground_albedo"},
                      {*own, "scale_height"},
                      {*own, "top: is 50 m; must be above the base, 60 m"},
                      {*own, "overlap"},
                      {*own, "coverage"}};
    faults[0].planet.sun_angular_diameter = (double)NAN;
    faults[1].planet.atmosphere_desc.ground_albedo[1] = 1.5;
    faults[2].planet.atmosphere_desc.components[0].scale_height = -1;
    faults[3].planet.cloud_layers[0].base = 60;
    faults[3].planet.cloud_layers[0].top = 50;
    faults[4].planet.cloud_layers[0].top = own->atmosphere_desc.thickness;
    faults[5].planet.cloud_layers[1].coverage = 2;
    const nebel_planet before = *own;
    for (size_t i = 0; i < sizeof faults / sizeof *faults; i++) {
        const int said = kept.count;
        assert_int_equal(nebel_update_scene_planets(scene, &faults[i].planet), NEBEL_ERROR_VALUE);
        assert_int_equal(kept.count, said + 1);
        if (strstr(kept.last, faults[i].message) == NULL) fail_msg("%s: %s", faults[i].message, kept.last);
        assert_ptr_equal(own->atmosphere, before.atmosphere);
        assert_ptr_equal(own->clouds, before.clouds);
        assert_number(own->sun_left[0], before.sun_left[0]);
        assert_number(own->cloud_layers[0].top, before.cloud_layers[0].top);
    }
    nebel_destroy_scene(scene);
    assert_int_equal(m.live, 0);
}

/* Every seventh allocation or fewer, so that it does not take long. */
static void test_without_memory(void **state)
{
    (void)state;
    const char *const text = TOY(", \"clouds\": [{}]");
    meter m;
    journal kept;
    nebel_scene *scene = NULL;
    const nebel_scene_desc desc = metered_desc(&m, &kept);
    assert_int_equal(nebel_parse_scene(text, strlen(text), "-", &desc, &scene), NEBEL_OK);
    assert_int_equal(nebel_load_scene_planets(scene), NEBEL_OK);
    nebel_scene *const other = load(text);
    const nebel_planet *const own = nebel_get_scene_data(scene)->planets;
    nebel_planet planet = *own;
    planet.atmosphere_desc.components[1].scattering[0] *= 2;
    nebel_result result = NEBEL_ERROR_MEMORY;
    const long step = 7 * (5 - (long)nb_test_count(4));
    for (long calls = 0; result != NEBEL_OK; calls += step) {
        const nebel_atmosphere *const atmosphere = own->atmosphere;
        m.fail_at = m.made + calls;
        result = nebel_update_scene_planets(scene, &planet);
        m.fail_at = 1L << 40;
        assert_int_equal(result, result == NEBEL_OK ? NEBEL_OK : NEBEL_ERROR_MEMORY);
        if (result != NEBEL_OK) assert_ptr_equal(own->atmosphere, atmosphere);
        if (result != NEBEL_OK) same_light(scene, other);
        assert_true(calls < 200);
    }
    nebel_destroy_scene(other);
    nebel_destroy_scene(scene);
    assert_int_equal(m.live, 0);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_air_and_clouds),
        cmocka_unit_test(test_layers),
        cmocka_unit_test(test_what_is_wrong),
        cmocka_unit_test(test_without_memory),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
