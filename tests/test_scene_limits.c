/* Limits of numbers where the file's unit, a contrast, a key or the settings of an engine come between them and the
 * core. That the limits themselves are those of docs/scene.schema.json is checked by check_scene_limits.py. */
#include "scene_help.h"

#define FILE_IN(unit, rest) "{\"nebel\": 1, \"unit\": " unit ", " rest "}"
#define FOG(volume) "\"fog\": [{" volume "}]"
#define WORLD "\"shape\": {\"type\": \"world\"}"
#define BALL(radius) "\"shape\": {\"type\": \"sphere\", \"center\": [0, 0, 0], \"radius\": " radius "}"

static void test_what_is_just_good_in_other_units(void **state)
{
    (void)state;
    static const char *const texts[] = {
        FILE_IN("0.01", FOG(BALL("1e17") ", \"extinction\": 1e7")),
        FILE_IN("0.01", FOG(BALL("1e-13") ", \"emission\": 1e7, \"extinction\": 0")),
        FILE_IN("0.01", FOG(WORLD ", \"mean_free_path\": 1e-7")),
        FILE_IN("0.01", FOG(WORLD ", \"visibility\": 2.99573527e-7")),
        FILE_IN("0.3048", FOG(WORLD ", \"visibility\": 9.8286e-9")),
        FILE_IN("1e-9", FOG(WORLD ", \"extinction\": 1, \"start\": 1e23, \"cutoff\": 1e24")),
        FILE_IN("1e-9", FOG("\"extinction\": 1, \"shape\": {\"type\": \"convex\", \"planes\": [[2, 0, 0, 2e24]]}")),
        FILE_IN("1e18", FOG(BALL("1e-3") ", \"extinction\": 1e27")),
        FILE_IN("1", FOG(WORLD ", \"visibility\": 1, \"contrast\": 4e-320")),
        FILE_IN("1", FOG(WORLD ", \"visibility\": 1.2e-25, \"contrast\": 0.9999999999999999")),
    };
    for (size_t i = 0; i < sizeof texts / sizeof *texts; i++) nebel_destroy_scene(parse_good(texts[i]));
}

static void test_what_is_too_much_in_other_units(void **state)
{
    (void)state;
    const rule rules[] = {
        {FORMAT, FILE_IN("0.01", FOG(BALL("`1.0000001e17") ", \"extinction\": 1")),
         "fog[0].shape.radius: is 1.0000001e+17; must be a length from 1e-13 to 1e17 units of 0.01 m"},
        {FORMAT, FILE_IN("0.01", FOG(BALL("`9.999e-14") ", \"extinction\": 1")), "fog[0].shape.radius: is 9.999e-14;"},
        {FORMAT, FILE_IN("0.01", FOG(WORLD ", \"extinction\": [1, `1.0000001e7, 1]")),
         "fog[0].extinction[1]: is 10000001; must be an amount from 0 to 1e7 per unit of 0.01 m"},
        {FORMAT, FILE_IN("0.01", FOG(WORLD ", \"extinction\": 1, \"emission\": `1.0000001e7")), "fog[0].emission: is"},
        {FORMAT, FILE_IN("0.01", FOG(WORLD ", \"mean_free_path\": `9.99e-8")),
         "fog[0].mean_free_path: is 9.99e-08; must be a length of at least 1e-7 units of 0.01 m"},
        {FORMAT, FILE_IN("0.01", FOG(WORLD ", \"visibility\": `2.995e-7")),
         "fog[0].visibility: is 2.995e-07; must be a length of at least 2.99573527e-7 units of 0.01 m"},
        {FORMAT, FILE_IN("1", FOG(WORLD ", \"contrast\": 0.5, \"visibility\": [1, 1, `6.9e-10]")),
         "fog[0].visibility[2]: is 6.9e-10; must be a length of at least 6.93147874e-10 m"},
        {FORMAT, FILE_IN("1e-9", FOG(WORLD ", \"extinction\": 1, \"cutoff\": `1.1e24")), "fog[0].cutoff: is 1.1e+24;"},
        {FORMAT,
         FILE_IN("1e-9", FOG("\"extinction\": 1, \"shape\": {\"type\": \"convex\", \"planes\": [`[2, 0, 0, 3e24]]}")),
         "fog[0].shape.planes[0]: lies 1.5e+15 m from the origin"},
        {FORMAT,
         FILE_IN("1e18", FOG("\"extinction\": 1, \"shape\": {\"type\": \"box\", \"min\": [0, 0, `-1.1e-3], \"max\": "
                             "[1, 1, 1]}")),
         "fog[0].shape.min[2]: is -0.0011; must be a coordinate from -0.001 to 0.001 units of 1e18 m"},
        {FORMAT,
         FILE_IN("2",
                 FOG("\"extinction\": 1, \"shape\": {\"type\": \"capsule\", \"radius\": 1, \"from\": [4e14, 0, 0], "
                     "\"to\": `[-4e14, 0, 0]}")),
         "fog[0].shape.to: lies 1.6e+15 m from \"from\"; between them must be a length from 1e-15 to 1e15 m"},
        {FORMAT,
         FILE_IN("0.01",
                 FOG(WORLD ", \"extinction\": 1, \"density\": {\"type\": \"linear\", \"from\": [0, 0, 0], \"to\": "
                           "`[0, 1e-14, 0]}")),
         "fog[0].density.to: lies 1e-16 m from \"from\""},
    };
    CHECK(rules);
}

static void test_what_is_too_much_in_a_key(void **state)
{
    (void)state;
#define KEY(members) FILE_IN("0.01", FOG(BALL("1") ", \"visibility\": 5, \"keys\": [{\"frame\": 1, " members "}]"))
    const rule rules[] = {
        {FORMAT, KEY("\"extinction\": `1e8"),
         "fog[0].keys[0].extinction: is 100000000; must be an amount from 0 to 1e7"},
        {FORMAT, KEY("\"visibility\": `1e-9"), "fog[0].keys[0].visibility: is 1e-09; must be a length of at least"},
        {FORMAT, KEY("\"shape\": {\"radius\": `1e18}"), "fog[0].keys[0].shape.radius: is 1e+18; must be a length"},
        {FORMAT, KEY("\"shape\": {\"transform\": {\"scale\": [1, `-1e10, 1]}}"),
         "fog[0].keys[0].shape.transform.scale[1]: is -10000000000; must be a factor from 1e-9 to 1e9, or the "
         "negative"},
        {FORMAT, KEY("\"shape\": {\"transform\": {\"position\": [1, 1, `-1e18]}}"),
         "fog[0].keys[0].shape.transform.position[2]: is -1e+18; must be a coordinate"},
    };
    CHECK(rules);
}

static void test_what_settings_of_engines_make(void **state)
{
    (void)state;
/* The unit of the file means nothing to an engine. */
#define IMPORT(members) FILE_IN("1000", FOG("\"import\": {\"type\": " members "}"))
    const rule rules[] = {
        {FORMAT, IMPORT("\"unreal_height_fog\", \"StartDistance\": `1.1e17"),
         "fog[0].import.StartDistance: is 1.1e+17; must be a distance from 0 to 1e17 units of 0.01 m"},
        {FORMAT, IMPORT("\"unreal_height_fog\", \"FogHeightFalloff\": `1e-15"),
         "fog[0].import.FogHeightFalloff: makes the scale height 1.44269504088896e+16; must be a length from 1e-15"},
        {FORMAT,
         IMPORT("\"unreal_height_fog\", \"RelativeLocation\": [0, 0, 9e16], \"SecondFogData\": {\"FogDensity\": 1, "
                "\"FogHeightOffset\": `9e16}"),
         "fog[0].import.SecondFogData.FogHeightOffset: makes the base 1.8e+15; must be a coordinate from -1e15 to 1e15 "
         "m"},
        {FORMAT, IMPORT("\"unreal_local_fog_volume\", \"RelativeScale3D\": 1e-9, \"RadialFogExtinction\": `10"),
         "fog[0].import.RadialFogExtinction: makes the extinction 2000000000; must be an amount from 0 to 1e9 per "
         "metre"},
        {FORMAT, IMPORT("\"godot_fog\", \"fog_density\": `2e9"),
         "fog[0].import.fog_density: is 2000000000; must be an amount"},
        {FORMAT, IMPORT("\"godot_fog\", \"fog_light_color\": `1e6, \"fog_light_energy\": 1e6"),
         "fog[0].import.fog_light_color: makes the source 1000000000000; must be a number from 0 to 1e9"},
        {FORMAT, IMPORT("\"godot_fog_volume\", \"size\": `[1, 1, 1e-15]"),
         "fog[0].import.size: makes the depth of the edge"},
        {FORMAT, IMPORT("\"godot_fog_volume\", \"transform\": `[1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 1e16]"),
         "fog[0].import.transform: makes a coordinate of the place 1e+16; must be a coordinate from -1e15 to 1e15 m"},
        {FORMAT, IMPORT("\"godot_fog_volume\", \"transform\": `[1e10, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0]"),
         "fog[0].import.transform: makes the scale 10000000000; must be a factor from 1e-9 to 1e9"},
        {FORMAT, IMPORT("\"hdrp_fog\", \"meanFreePath\": `1e-10"),
         "fog[0].import.meanFreePath: makes the extinction 10000000000; must be an amount from 0 to 1e9 per metre"},
        {FORMAT, IMPORT("\"bevy_fog_volume\", \"absorption\": 1e5, \"density_factor\": `1e5"),
         "fog[0].import.density_factor: makes the extinction 1000003000"},
    };
    CHECK(rules);
}

static void test_groups_have_a_depth(void **state)
{
    (void)state;
    for (int depth = 16; depth <= 17; depth++) {
        char text[4000], wanted[40];
        journal kept = {0};
        nebel_scene *scene;
        const nebel_scene_desc desc = {.host.log = {remember, &kept}};
        char *at = text + sprintf(text, "{\"nebel\": 1, \"fog\": [{\"extinction\": 1, \"shape\": ");
        for (int i = 0; i < depth; i++) at += sprintf(at, "{\"type\": \"union\", \"shapes\": [");
        const long column = at - text + 1;
        at += sprintf(at, "{\"type\": \"world\"}");
        for (int i = 0; i < depth; i++) at += sprintf(at, "]}");
        sprintf(at, "}]}");
        assert_int_equal(nebel_parse_scene(text, strlen(text), "a", &desc, &scene), depth > 16 ? LIMIT : NEBEL_OK);
        nebel_destroy_scene(scene);
        if (depth == 16) continue;
        sprintf(wanted, "a:1:%ld: ", column);
        if (strncmp(kept.last, wanted, strlen(wanted)) != 0 ||
            strstr(kept.last, ".shapes[0]: is nested too deeply; at most 16 shapes may be around it") == NULL)
            fail_msg("%s", kept.last);
    }
}

/* ---- all of a scene ------------------------------------------------------------------------------ */

#define BOX "\"shape\": {\"type\": \"box\", \"min\": [0, 0, 0], \"max\": [1, 1, 1]}"
#define NOISE(size, octaves)                                                                                           \
    "{" BOX ", \"extinction\": 1, \"density\": {\"type\": \"noise\", \"size\": [" size "], \"octaves\": " octaves      \
    ", \"cells\": [2, 2, 2]}}"
#define SWARM(count) "{" BOX ", \"count\": " count ", \"absorption\": 1}"

/* Each of these is within the limits of its own, and none of the work is done. */
static void test_what_is_too_much_in_all(void **state)
{
    (void)state;
    static const struct {
        const char *text;
        uint64_t memory;
        const char *wanted;
    } cases[] = {
        {FILE_IN("1", "\"fog\": [" NOISE("200, 200, 200", "16") ", " NOISE("200, 200, 200", "16") "]"), 0,
         "fog[1].density: brings the scene to about 69 s of preparation; 64 s is the most with 4096 MB"},
        {FILE_IN("1", "\"fog\": [" NOISE("10, 10, 10", "1") ", " NOISE("100, 100, 100", "4") "]"), (uint64_t)64 << 20,
         "fog[1].density: brings the scene to about 1 s of preparation; 1 s is the most with 64 MB"},
        {FILE_IN("1", "\"fog\": [], \"nebula\": [" SWARM("20000") ", " SWARM("20000") "]"), (uint64_t)64 << 20,
         "nebula[1]: brings the scene to 114 MB of memory; 64 MB is the most"},
        {FILE_IN("1", "\"fog\": [], \"multiple_scattering\": {\"model\": \"diffusion\", \"max_cells\": 16777216}"),
         (uint64_t)256 << 20, "multiple_scattering: brings the scene to 14400 MB of memory; 256 MB is the most"},
        {FILE_IN("1", "\"fog\": [], \"planet\": {\"model\": \"physical\", \"quality\": \"precise\"}"),
         (uint64_t)64 << 20, "planet: brings the scene to about 2 s of preparation; 1 s is the most with 64 MB"},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        journal kept = {0};
        nebel_scene *scene = NULL;
        const nebel_scene_desc desc = {.host.log = {remember, &kept}, .memory = cases[i].memory};
        assert_int_equal(nebel_parse_scene(cases[i].text, strlen(cases[i].text), "a", &desc, &scene), LIMIT);
        if (kept.count != 1 || strstr(kept.last, cases[i].wanted) == NULL) fail_msg("%s", kept.last);
    }
}

static void test_a_larger_limit(void **state)
{
    (void)state;
    static const char text[] = FILE_IN("1", "\"fog\": [], \"nebula\": [" SWARM("20000") ", " SWARM("20000") "]");
    nebel_scene *scene = NULL;
    const nebel_scene_desc desc = {.memory = (uint64_t)256 << 20};
    assert_int_equal(nebel_parse_scene(text, strlen(text), "a", &desc, &scene), NEBEL_OK);
    nebel_destroy_scene(scene);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_what_is_just_good_in_other_units),
        cmocka_unit_test(test_what_is_too_much_in_other_units),
        cmocka_unit_test(test_what_is_too_much_in_a_key),
        cmocka_unit_test(test_what_settings_of_engines_make),
        cmocka_unit_test(test_groups_have_a_depth),
        cmocka_unit_test(test_what_is_too_much_in_all),
        cmocka_unit_test(test_a_larger_limit),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
