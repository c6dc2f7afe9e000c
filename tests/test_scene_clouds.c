/* The clouds of a planet in scene files: what they become, and what is wrong. */
#include "near.h"
#include "scene_help.h"

#include <nebel/planet.h>

#include <math.h>

#define PLANET(top, clouds)                                                                                            \
    "{\"nebel\": 1, " top "\"fog\": [], \"planet\": {\"model\": \"physical\", \"clouds\": " clouds "}}"

static void test_an_empty_layer_is_a_good_one(void **state)
{
    (void)state;
    nebel_cloud_layer layer;
    nebel_scene *scene = parse_good(PLANET("", "[{}, {\"type\": \"cirrus\"}]"));
    const nebel_planet *planet = nebel_get_scene_data(scene)->planets;
    assert_int_equal(planet->cloud_layer_count, 2);
    assert_int_equal(planet->cloud_layers[1].type, NEBEL_CLOUD_CIRRUS);
    assert_int_equal(planet->cloud_layers[1].seed, 2);
    assert_int_equal(
        nebel_resolve_cloud_layer(planet->atmosphere_desc.thickness, &planet->cloud_layers[0], NULL, &layer), NEBEL_OK);
    assert_number(layer.base, 900);
    assert_number(layer.top, 2700);
    assert_number(layer.coverage, .4);
    /* On small planets they shrink. */
    assert_int_equal(nebel_resolve_cloud_layer(1e4, &planet->cloud_layers[0], NULL, &layer), NEBEL_OK);
    assert_number(layer.top, 270);
    assert_number(layer.extinction, .5);
    assert_number(layer.cell_size, 220);
    /* But not below the height of a layer that is given. */
    const nebel_cloud_layer high = {.base = 100, .top = 1000};
    assert_int_equal(nebel_resolve_cloud_layer(1e4, &high, NULL, &layer), NEBEL_OK);
    assert_number(layer.extinction, .1);
    assert_number(layer.cell_size, 1100);
    assert_null(planet->clouds);
    assert_int_equal(nebel_load_scene_planets(scene), NEBEL_OK);
    assert_non_null(planet->clouds);
    const nebel_clouds *clouds = planet->clouds;
    assert_int_equal(nebel_load_scene_planets(scene), NEBEL_OK);
    assert_ptr_equal(planet->clouds, clouds);
    nebel_destroy_scene(scene);
}

static void test_everything_they_may_say(void **state)
{
    (void)state;
    nebel_scene *scene = parse_good(PLANET(
        "\"up\": \"z\", \"unit\": 1000, ",
        "[{\"type\": \"stratus\", \"base\": 1, \"top\": 2, \"coverage\": 0.25, \"extinction\": 5, \"cell_size\": 3, "
        "\"erosion\": 0, \"patchiness\": 1, \"droplet_diameter\": 12, \"seed\": 7, \"wind\": [2, 3]}, {\"coverage\": "
        "0}]"));
    const nebel_planet *planet = nebel_get_scene_data(scene)->planets;
    const nebel_cloud_layer *layer = planet->cloud_layers;
    assert_int_equal(planet->cloud_layer_count, 1);
    assert_int_equal(layer->type, NEBEL_CLOUD_STRATUS);
    assert_number(layer->base, 1000);
    assert_number(layer->top, 2000);
    assert_number(layer->coverage, .25);
    assert_number(layer->extinction, 5e-3);
    assert_number(layer->cell_size, 3000);
    assert_number(layer->erosion, NEBEL_ZERO);
    assert_number(layer->patchiness, 1);
    assert_number(layer->droplet_diameter, 12);
    assert_int_equal(layer->seed, 7);
    assert_number(layer->wind[0], 2000);
    assert_number(layer->wind[1], -3000);
    nebel_destroy_scene(scene);
}

#define AIRLESS(key) "{\"nebel\": 1, \"fog\": [], \"planet\": {\"model\": \"physical\", " key ", \"clouds\": `[{}]}}"
#define ONE(members) PLANET("", "[{" members "}]")

static void test_what_is_wrong(void **state)
{
    (void)state;
    const rule rules[] = {
        {FORMAT, PLANET("", "`{}"), "planet.clouds: is an object; must be an array of layers of clouds"},
        {FORMAT, PLANET("", "[`3]"), "planet.clouds[0]: is a number"},
        {FORMAT, PLANET("", "[{}, `{}]"), "planet.clouds[1]: lies from 900 to 2700 m and overlaps another"},
        {LIMIT, PLANET("", "[{\"coverage\": 0}, {\"coverage\": 0}, {\"coverage\": 0}, {\"coverage\": 0}, `{}]"),
         "planet.clouds[4]: is one too many"},
        {LIMIT, PLANET("", "[{}, {}, {}, {}, `{}]"), "planet.clouds[4]: is one too many"},
        {FORMAT, AIRLESS("\"preset\": \"moon\""), "planet.clouds: need air, and the planet has none"},
        {FORMAT, AIRLESS("\"components\": []"), "planet.clouds: need air, and the planet has none"},
        {FORMAT, ONE("\"type\": `\"fluffy\""),
         "planet.clouds[0].type: unknown; must be one of: cumulus, stratus, cirrus"},
        {FORMAT, ONE("\"base\": `0"), "planet.clouds[0].base: is 0"},
        {FORMAT, ONE("\"base\": `-100"), "planet.clouds[0].base: is -100"},
        {FORMAT, PLANET("", "[`{\"base\": 99000}]"),
         "planet.clouds[0].top: is 100800 m, as none is given; must be within the air, 100000 m"},
        {FORMAT, ONE("\"top\": `500"),
         "planet.clouds[0].top: is 500 m; must be above the base, 900 m, as none is given"},
        {FORMAT, ONE("\"base\": 1000, \"top\": `1000"),
         "planet.clouds[0].top: is 1000 m; must be above the base, 1000 m"},
        {FORMAT, PLANET("", "[{\"base\": `1e-300}]"), "planet.clouds[0].base: is 1e-300; must be a height"},
        {FORMAT, ONE("\"cell_size\": `3e7"),
         "planet.clouds[0].cell_size: is 3e+07 m; must be at most 2.544e+07 m, which is 4 times the radius"},
        {FORMAT, ONE("\"top\": `2e5"), "planet.clouds[0].top: is 200000 m; must be within the air, 100000 m"},
        {FORMAT, ONE("\"base\": `2e5, \"top\": 3e5"),
         "planet.clouds[0].base: is 200000 m; must be within the air, 100000 m"},
        {FORMAT, ONE("\"base\": 1000, \"top\": `1000.01"),
         "planet.clouds[0].top: is 1000.01 m; must be at least 0.1 m (a millionth of the air's thickness) above the "
         "base, 1000 m"},
        {FORMAT, PLANET("\"unit\": 0.01, ", "[{\"base\": 2000, \"top\": `1000}]"),
         "planet.clouds[0].top: is 10 m; must be above the base, 20 m (in metres; the file's unit is 0.01 m)"},
        {FORMAT, PLANET("\"unit\": 0.01, ", "[{}, `{}]"),
         "planet.clouds[1]: lies from 900 to 2700 m and overlaps another, from 900 to 2700 m; give each heights of its "
         "own "
         "(in metres"},
        {FORMAT, ONE("\"coverage\": `1.5"), "planet.clouds[0].coverage: is 1.5"},
        {FORMAT, ONE("\"coverage\": `-0.1"), "planet.clouds[0].coverage: is -0.1"},
        {FORMAT, ONE("\"extinction\": `0"), "planet.clouds[0].extinction: is 0"},
        {FORMAT, ONE("\"cell_size\": `0"), "planet.clouds[0].cell_size: is 0"},
        {FORMAT, ONE("\"erosion\": `2"), "planet.clouds[0].erosion: is 2"},
        {FORMAT, ONE("\"droplet_diameter\": `100"), "planet.clouds[0].droplet_diameter: is 100"},
        {FORMAT, ONE("\"seed\": `0.5"), "planet.clouds[0].seed: is 0.5"},
        {FORMAT, ONE("\"wind\": `[1]"), "planet.clouds[0].wind: "},
        {FORMAT, ONE("\"weather_map\": `\"w.txt\""),
         "planet.clouds[0].weather_map: is \"w.txt\"; must be the path of a picture"},
        {FORMAT, ONE("`\"hight\": 3"), "planet.clouds[0].hight: unknown key"},
    };
    CHECK(rules);
}

static void test_without_memory(void **state)
{
    (void)state;
    parse_without_memory(ONE("\"seed\": 3"));
}

/* Fog at the origin stands in the clouds' shadow, which moves with the wind. */
static void test_fog_has_their_shadow(void **state)
{
    (void)state;
    nebel_scene *scene = parse_good(
        "{\"nebel\": 1, \"sun\": {\"direction\": [0, 1, 0.2], \"irradiance\": 3}, \"ambient\": 0, \"planet\": "
        "{\"model\": "
        "\"physical\", \"clouds\": [{\"wind\": [500, 0]}]}, \"fog\": [{\"shape\": {\"type\": \"sphere\", \"center\": "
        "[0, 10, 0], \"radius\": 5}, \"extinction\": 0.01, \"albedo\": 1}]}");
    const nebel_ray ray = {{0, 10, 9}, {0, 0, -1}, 20};
    double darkest = HUGE_VAL, brightest = 0, per_sunlight = 0;
    assert_int_equal(nebel_load_scene_planets(scene), NEBEL_OK);
    for (int frame = 0; frame < 24; frame++) {
        nebel_transfer transfer;
        scene_trace(scene, frame, (nebel_trace_desc){0}, 1, &ray, &transfer);
        darkest = fmin(darkest, transfer.in_scattering[1]);
        brightest = fmax(brightest, transfer.in_scattering[1]);
        /* What a caller who makes fog of its own asks for. */
        nebel_sun sunlight;
        assert_int_equal(nebel_find_scene_sunlight(scene, frame, &sunlight), NEBEL_OK);
        if (frame == 0) per_sunlight = transfer.in_scattering[1] / sunlight.irradiance[1];
        assert_near(transfer.in_scattering[1], per_sunlight * sunlight.irradiance[1], 1e-6);
        assert_true(sunlight.irradiance[1] < 3 * nebel_get_scene_data(scene)->planets->sun_left[1] * (1 + 1e-12));
    }
    assert_true(darkest > 0 && brightest > 2.5 * darkest);
    nebel_sun untouched = {{1, 2, 3}, {4, 5, 6}};
    assert_int_equal(nebel_find_scene_sunlight(scene, 1e13, &untouched), NEBEL_ERROR_VALUE);
    assert_int_equal(nebel_find_scene_sunlight(NULL, 0, &untouched), NEBEL_ERROR_ARGUMENT);
    assert_int_equal(nebel_find_scene_sunlight(scene, 0, NULL), NEBEL_ERROR_ARGUMENT);
    assert_vector(untouched.irradiance, 4, 5, 6);
    nebel_destroy_scene(scene);
}

/* Fog under closed clouds has what they let through of the sky at the origin, but all of ambient light that is not the sky's. */
static void test_fog_has_less_sky(void **state)
{
    (void)state;
    static const char *const ambients[] = {"", "\"ambient\": 0.5, "};
    static const double origin[1][3] = {{0, 0, 0}};
    for (int k = 0; k < 2; k++) {
        char text[512];
        (void)snprintf(
            text, sizeof text,
            "{\"nebel\": 1, \"sun\": {\"direction\": [0, 1, 0.2], \"irradiance\": 3}, %s\"planet\": "
            "{\"model\": \"physical\", \"clouds\": [{\"type\": \"stratus\", \"coverage\": 1}]}, \"fog\": []}",
            ambients[k]);
        nebel_scene *scene = parse_good(text);
        assert_int_equal(nebel_load_scene_planets(scene), NEBEL_OK);
        const nebel_scene_data *const data = nebel_get_scene_data(scene);
        nebel_cloud_lighting *view;
        nebel_cloud_workspace *workspace;
        nebel_sun sun, same;
        nebel_environment ambient;
        float part;
        const nebel_cloud_lighting_desc desc = {.clouds = data->planets->clouds, .sun = nebel_get_scene_sun(scene, 0)};
        assert_int_equal(nebel_create_cloud_lighting(&desc, &view), NEBEL_OK);
        assert_int_equal(nebel_create_cloud_workspace(view, &workspace), NEBEL_OK);
        assert_int_equal(nebel_compute_cloud_sky_transmittance(workspace, 200, 1, origin, 0, &part), NEBEL_OK);
        assert_int_equal(nebel_find_scene_light(scene, 0, &sun, &ambient), NEBEL_OK);
        assert_int_equal(nebel_find_scene_sunlight(scene, 0, &same), NEBEL_OK);
        assert_memory_equal(&sun, &same, sizeof sun);
        assert_true(part < .7f);
        assert_near(ambient.intensity, data->environment.intensity * (k == 0 ? (double)part : 1), 1e-6);
        assert_ptr_equal(ambient.map, data->environment.map);
        assert_int_equal(nebel_find_scene_light(scene, 1e13, &sun, &ambient), NEBEL_ERROR_VALUE);
        assert_int_equal(nebel_find_scene_light(scene, 0, &sun, NULL), NEBEL_ERROR_ARGUMENT);
        nebel_destroy_cloud_workspace(workspace);
        nebel_destroy_cloud_lighting(view);
        nebel_destroy_scene(scene);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_an_empty_layer_is_a_good_one),
        cmocka_unit_test(test_everything_they_may_say),
        cmocka_unit_test(test_what_is_wrong),
        cmocka_unit_test(test_without_memory),
        cmocka_unit_test(test_fog_has_their_shadow),
        cmocka_unit_test(test_fog_has_less_sky),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
