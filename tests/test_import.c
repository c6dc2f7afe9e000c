/* Fog in the words of game engines becomes the volumes that docs/engines.md promises. */
#include "near.h"
#include "scene_help.h"

#include <math.h>

#define FOG(entry) "{\"nebel\": 1, \"up\": \"z\", \"unit\": 0.01, \"fog\": [{" entry "}]}"
#define IMPORT(members) FOG("\"import\": {" members "}")

static void assert_grey(const double *got, double wanted)
{
    assert_vector(got, wanted, wanted, wanted);
}

static nebel_transfer light_along(const nebel_scene *scene, const nebel_ray *ray)
{
    nebel_transfer transfer;
    scene_trace(scene, 0, (nebel_trace_desc){0}, 1, ray, &transfer);
    return transfer;
}

static const nebel_volume_desc *import(const char *text, size_t count, nebel_scene **scene)
{
    *scene = parse_good(text);
    assert_int_equal(nebel_get_scene_data(*scene)->volume_count, count);
    return nebel_get_scene_data(*scene)->volumes;
}

/* ---- Unreal ---------------------------------------------------------------------------------- */

static void test_unreal_height_fog(void **state)
{
    (void)state;
    nebel_scene *scene;
    const nebel_volume_desc *fog = import(
        FOG("\"name\": \"haze\", \"import\": {\"type\": \"unreal_height_fog\", \"FogDensity\": 0.05, "
            "\"FogHeightFalloff\": 0.4, "
            "\"FogInscatteringLuminance\": [0.1, 0.2, 0.3], \"RelativeLocation\": [7, 8, 250], \"StartDistance\": 0, "
            "\"FogMaxOpacity\": 1, \"SecondFogData\": {\"FogDensity\": 0.01, \"FogHeightFalloff\": 0, "
            "\"FogHeightOffset\": -300}}"),
        2, &scene);
    const double ln2 = log(2);
    assert_int_equal(fog[0].shape.type, NEBEL_SHAPE_WORLD);
    assert_grey(fog[0].extinction, ln2 * ln2 * 0.005);
    assert_int_equal(fog[0].density.type, NEBEL_DENSITY_HEIGHT);
    assert_int_equal(fog[0].density.below, NEBEL_BELOW_GROW);
    assert_number(fog[0].density.base, 2.5);
    assert_number(fog[0].density.scale_height, 1 / (0.04 * ln2));
    assert_vector(fog[0].source, .1, .2, .3);
    assert_grey(fog[1].extinction, ln2 * ln2 * 0.001);
    assert_int_equal(fog[1].density.type, NEBEL_DENSITY_CONSTANT);
    assert_vector(fog[1].source, .1, .2, .3);
    assert_string_equal(nebel_get_scene_data(scene)->volume_names[0], "haze");
    assert_string_equal(nebel_get_scene_data(scene)->volume_names[1], "haze");
    nebel_destroy_scene(scene);
    fog = import(IMPORT("\"type\": \"unreal_height_fog\""), 1, &scene);
    assert_grey(fog->extinction, ln2 * ln2 * 0.002);
    assert_number(fog->density.scale_height, 1 / (0.02 * ln2));
    nebel_destroy_scene(scene);
    (void)import(IMPORT("\"type\": \"unreal_height_fog\", \"FogDensity\": 0"), 0, &scene);
    nebel_destroy_scene(scene);
}

/* HeightFogCommon.ush in its own units, for a ray in the plane of x and z that is not level. */
static double unreal_transmittance(const double from[2], const double to[2], double start, double max_opacity)
{
    const double length = hypot(to[0] - from[0], to[1] - from[1]);
    const double excluded = start / length, density = 0.3 / 1000, falloff = 0.5 / 1000, height = 100;
    const double z = from[1] + excluded * (to[1] - from[1]), rise = to[1] - z;
    const double integral = density * exp2(-falloff * (z - height)) * (1 - exp2(-falloff * rise)) / (falloff * rise);
    return fmax(exp2(-integral * (1 - excluded) * length), 1 - max_opacity);
}

static void test_unreal_start_and_largest_opacity(void **state)
{
    (void)state;
    nebel_scene *scene;
    const nebel_volume_desc *fog =
        import(IMPORT("\"type\": \"unreal_height_fog\", \"FogDensity\": 0.3, \"FogHeightFalloff\": 0.5, "
                      "\"RelativeLocation\": [0, 0, 100], \"StartDistance\": 700, \"FogMaxOpacity\": 0.8, "
                      "\"FogInscatteringLuminance\": [1, 2, 3]"),
               1, &scene);
    assert_number(fog->start, 7);
    assert_number(nebel_get_scene_data(scene)->max_opacity, .8);
    const double places[][2] = {{2000, 170}, {2000, 900}, {9000, -300}, {60000, 4000}};
    for (int i = 0; i < 4; i++) {
        const double x = places[i][0] / 100, y = (places[i][1] - 150) / 100;
        const double transmittance = unreal_transmittance((const double[]){0, 150}, places[i], 700, .8);
        const nebel_transfer transfer = light_along(scene, &(nebel_ray){{0, 1.5, 0}, {x, y, 0}, hypot(x, y)});
        assert_near(transfer.transmittance[0], transmittance, 1e-14);
        for (int c = 0; c < 3; c++) assert_near(transfer.in_scattering[c], (c + 1) * (1 - transmittance), 1e-14);
    }
    nebel_destroy_scene(scene);
    (void)import(IMPORT("\"type\": \"unreal_height_fog\", \"FogMaxOpacity\": 0"), 0, &scene);
    nebel_destroy_scene(scene);
    (void)import("{\"nebel\": 1, \"fog\": [{\"import\": {\"type\": \"unreal_height_fog\", \"FogMaxOpacity\": 0.5}}], "
                 "\"max_opacity\": 0.25}",
                 1, &scene);
    assert_number(nebel_get_scene_data(scene)->max_opacity, .25);
    nebel_destroy_scene(scene);
}

static void test_unreal_local_fog_volume(void **state)
{
    (void)state;
    nebel_scene *scene;
    const nebel_volume_desc *fog =
        import(IMPORT("\"type\": \"unreal_local_fog_volume\", \"RadialFogExtinction\": 3, \"FogAlbedo\": [1, 0.5, 0], "
                      "\"RelativeLocation\": [100, 200, 300], \"RelativeScale3D\": [1, -2, 1.5]"),
               1, &scene);
    assert_int_equal(fog->shape.type, NEBEL_SHAPE_SPHERE);
    assert_vector(fog->shape.center, 1, 3, 2);
    assert_number(fog->shape.radius, 10);
    assert_grey(fog->extinction, .3);
    assert_int_equal(fog->density.type, NEBEL_DENSITY_RADIAL);
    assert_vector(fog->albedo, 1, .5, 0);
    nebel_destroy_scene(scene);
}

/* ---- Godot ----------------------------------------------------------------------------------- */

static void test_godot_fog(void **state)
{
    (void)state;
    nebel_scene *scene;
    const nebel_volume_desc *fog = import(IMPORT("\"type\": \"godot_fog\", \"fog_density\": 0.03, \"fog_light_color\": "
                                                 "[0.5, 1, 0, 1], \"fog_light_energy\": 2"),
                                          1, &scene);
    assert_int_equal(fog->shape.type, NEBEL_SHAPE_WORLD);
    assert_grey(fog->extinction, .03);
    assert_vector(fog->source, 2 * pow((0.5 + 0.055) / 1.055, 2.4), 2, 0);
    nebel_destroy_scene(scene);
    fog = import(IMPORT("\"type\": \"godot_volumetric_fog\", \"volumetric_fog_density\": 0.02, "
                        "\"volumetric_fog_albedo\": \"#fff\", "
                        "\"volumetric_fog_emission\": [1, 0, 0], \"volumetric_fog_emission_energy\": 3"),
                 1, &scene);
    assert_grey(fog->extinction, .02);
    assert_grey(fog->albedo, 1);
    assert_vector(fog->emission, .06, 0, 0);
    nebel_destroy_scene(scene);
}

static void test_godot_fog_volume(void **state)
{
    (void)state;
    nebel_scene *scene;
    const nebel_volume_desc *fog =
        import(IMPORT("\"type\": \"godot_fog_volume\", \"shape\": 1, \"size\": [4, 6, 2], \"density\": 0.5, "
                      "\"albedo\": [1, 0, 1], "
                      "\"emission\": [0, 1, 0], \"height_falloff\": 0.25, \"edge_fade\": 0.4, "
                      "\"transform\": [0, 0, 2, 0, 1, 0, -1, 0, 0, 10, 20, 30]"),
               1, &scene);
    assert_int_equal(fog->shape.type, NEBEL_SHAPE_CONE);
    assert_vector(fog->shape.from, 0, -3, 0);
    assert_vector(fog->shape.to, 0, 3, 0);
    assert_number(fog->shape.radius_from, 1);
    assert_number(fog->shape.radius_to, 0);
    assert_vector(fog->shape.transform.position, 10, 20, 30);
    assert_vector(fog->shape.transform.scale, 1, 1, 2);
    assert_number(fabs(fog->shape.transform.rotation[1]), sqrt(.5));
    assert_grey(fog->extinction, .5);
    assert_vector(fog->albedo, 1, 0, 1);
    assert_vector(fog->emission, 0, .5, 0);
    assert_int_equal(fog->density.below, NEBEL_BELOW_CONSTANT);
    assert_number(fog->density.base, 20);
    assert_number(fog->density.scale_height, 4 / log(2));
    nebel_destroy_scene(scene);
    static const nebel_shape_type types[5] = {NEBEL_SHAPE_ELLIPSOID, NEBEL_SHAPE_CONE, NEBEL_SHAPE_CYLINDER,
                                              NEBEL_SHAPE_BOX, NEBEL_SHAPE_WORLD};
    for (int i = 0; i < 5; i++) {
        char text[200];
        snprintf(text, sizeof text,
                 IMPORT("\"type\": \"godot_fog_volume\", \"size\": [2, 4, 6], \"edge_fade\": 0, \"shape\": %d"), i);
        fog = import(text, 1, &scene);
        assert_int_equal(fog->shape.type, types[i]);
        if (i == 0) assert_vector(fog->shape.radii, 1, 2, 3);
        if (i == 2) assert_number(fog->shape.radius, 1);
        if (i == 3) assert_vector(fog->shape.min, -1, -2, -3);
        assert_int_equal(fog->density.type, NEBEL_DENSITY_CONSTANT);
        nebel_destroy_scene(scene);
    }
}

/* fog_material.cpp along a ray through a box of 4 x 2 x 6 m: the mean of many places. */
static double godot_depth(const nebel_ray *ray, double fade)
{
    enum { PLACES = 200000 };
    const double half[3] = {2, 1, 3};
    double sum = 0;
    for (int i = 0; i < PLACES; i++) {
        double depth = 1;
        for (int k = 0; k < 3; k++)
            depth = fmin(depth, half[k] - fabs(ray->origin[k] + ray->direction[k] * ray->t_max * (i + .5) / PLACES));
        if (depth > 0) sum += pow(depth, fade);
    }
    return sum * ray->t_max / PLACES;
}

static void test_godot_edge_fade(void **state)
{
    (void)state;
    static const double fades[] = {1, .1, .5, 2};
    nebel_scene *scene;
    for (int i = 0; i < 4; i++) {
        char text[200];
        snprintf(text, sizeof text,
                 IMPORT("\"type\": \"godot_fog_volume\", \"density\": 0.5, \"size\": [4, 2, 6], \"edge_fade\": %g"),
                 fades[i]);
        (void)import(text, 1, &scene);
        /* through the middles of faces as much, and where it is linear everywhere */
        const nebel_ray rays[] = {{{.3, -4, .4}, {0, 1, 0}, 9}, {{-.3, .4, -5}, {.6, 0, .8}, 9}};
        for (int r = 0; r < (fades[i] == 1 ? 2 : 1); r++) {
            const double depth = -log(light_along(scene, &rays[r]).transmittance[0]) / .5;
            assert_true(fabs(depth - godot_depth(&rays[r], fades[i])) < 1e-3);
        }
        nebel_destroy_scene(scene);
    }
    const nebel_volume_desc *fog =
        import(IMPORT("\"type\": \"godot_fog_volume\", \"shape\": 0, \"size\": [4, 2, 6]"), 1, &scene);
    assert_int_equal(fog->density.type, NEBEL_DENSITY_SOFT_EDGE);
    assert_number(fog->density.edge_width, .2 / 1.1); /* the engine's 0.1 */
    nebel_destroy_scene(scene);
    fog = import(IMPORT("\"type\": \"godot_fog_volume\", \"shape\": 4"), 1, &scene);
    assert_int_equal(fog->density.type, NEBEL_DENSITY_CONSTANT);
    nebel_destroy_scene(scene);
}

/* ---- Unity ----------------------------------------------------------------------------------- */

static void test_hdrp_fog(void **state)
{
    (void)state;
    nebel_scene *scene;
    const nebel_volume_desc *fog = import(IMPORT("\"type\": \"hdrp_fog\", \"meanFreePath\": 50, \"baseHeight\": 10, "
                                                 "\"maximumHeight\": 60, \"albedo\": [0.5, 0.6, 0.7]"),
                                          1, &scene);
    assert_grey(fog->extinction, .02);
    assert_number(fog->density.base, 10);
    assert_number(fog->density.scale_height, 50 * 0.144765);
    assert_true(fabs(exp(-50 / fog->density.scale_height) / 0.001 - 1) < 1e-4);
    assert_int_equal(fog->density.below, NEBEL_BELOW_CONSTANT);
    assert_vector(fog->albedo, .5, .6, .7);
    nebel_destroy_scene(scene);
}

#define LOCAL "\"type\": \"hdrp_local_volumetric_fog\", \"meanFreePath\": 4, "

static void test_hdrp_local_volumetric_fog(void **state)
{
    (void)state;
    nebel_scene *scene;
    const nebel_volume_desc *fog =
        import(IMPORT(LOCAL "\"size\": [10, 20, 5], \"positiveFade\": [0.1, 0.05, 0.2], \"negativeFade\": [0.1, 0.05, "
                            "0.2], \"localPosition\": "
                            "[1, 2, 3], \"localRotation\": [0.1, 0.3, 0.5, 0.8062257748298549]"),
               1, &scene);
    assert_vector(fog->shape.min, -5, -10, -2.5);
    assert_vector(fog->shape.transform.position, -1, 2, 3);
    assert_vector(fog->shape.transform.rotation, .1, -.3, -.5);
    assert_grey(fog->extinction, .25);
    assert_grey(fog->albedo, 1);
    assert_int_equal(fog->density.type, NEBEL_DENSITY_SOFT_EDGE);
    assert_number(fog->density.edge_width, 1);
    nebel_destroy_scene(scene);
    fog = import(IMPORT(LOCAL "\"size\": [10, 20, 5], \"positiveFade\": [0, 0, 0], \"negativeFade\": [0, 0, 0]"), 1,
                 &scene);
    assert_int_equal(fog->density.type, NEBEL_DENSITY_CONSTANT);
    assert_int_equal(fog->operation, NEBEL_OPERATION_ADD);
    nebel_destroy_scene(scene);
}

/* ComputeFadeFactor, for the fades below, summed along x. */
static double hdrp_depth(double y, double z)
{
    const double across = fmin((2 - fabs(y)) / .4, 1) * fmin((5 - fabs(z)) / 2, 1);
    return across * (10 - 3);
}

static void test_hdrp_fades_of_each_axis(void **state)
{
    (void)state;
    nebel_scene *scene;
    (void)import(
        IMPORT(LOCAL "\"size\": [10, 4, 10], \"positiveFade\": [0.3, 0.1, 0.2], \"negativeFade\": [0.3, 0.1, 0.2]"), 1,
        &scene);
    for (int i = 0; i < 9; i++) {
        const double y = .95 * (i % 3), z = 2.1 * (i / 3);
        const nebel_transfer transfer = light_along(scene, &(nebel_ray){{-9, y, z}, {1, 0, 0}, 20});
        assert_number(transfer.transmittance[0], exp(-hdrp_depth(y, z) / 4));
    }
    nebel_destroy_scene(scene);
    (void)import(IMPORT(LOCAL "\"size\": [10, 4, 10], \"positiveFade\": [0.3, 0, 0], \"negativeFade\": [0.3, 0, 0]"), 1,
                 &scene);
    const nebel_transfer transfer = light_along(scene, &(nebel_ray){{-9, 1.9, 4.9}, {1, 0, 0}, 20});
    assert_number(transfer.transmittance[0], exp(-7. / 4));
    nebel_destroy_scene(scene);
}

#define HARD "\"size\": [4, 4, 4], \"positiveFade\": [0, 0, 0], \"negativeFade\": [0, 0, 0]"

/* The global fog lies under all, then volumes by their priorities. */
static void test_hdrp_overwrites_what_ranks_below(void **state)
{
    (void)state;
    nebel_scene *scene;
    const nebel_volume_desc *fog = import(
        FOG("\"import\": {\"type\": \"hdrp_fog\", \"meanFreePath\": 20, \"baseHeight\": 50}}, {\"import\": {" LOCAL HARD
            ", \"blendingMode\": 0, \"distanceFadeStart\": 30, \"distanceFadeEnd\": 30}}, {\"import\": {" LOCAL HARD
            ", \"priority\": 3, \"localPosition\": [-1, 0, 0]}"),
        3, &scene);
    assert_int_equal(fog[1].operation, NEBEL_OPERATION_REPLACE);
    assert_int_equal(fog[1].priority, 0);
    assert_number(fog[1].cutoff, 30);
    assert_int_equal(fog[2].operation, NEBEL_OPERATION_ADD);
    assert_int_equal(fog[2].priority, 3);
    /* of 10 m of global fog 4 m are overwritten; the other adds 4 m of its own */
    const nebel_transfer transfer = light_along(scene, &(nebel_ray){{-5, 0, 0}, {1, 0, 0}, 10});
    assert_number(transfer.transmittance[0], exp(-6. / 20 - 4. / 4 - 4. / 4));
    nebel_destroy_scene(scene);
}

/* ---- phase functions ------------------------------------------------------------------------- */

static void test_phases(void **state)
{
    (void)state;
#define HDRP_LOCAL                                                                                                     \
    "\"type\": \"hdrp_local_volumetric_fog\", \"size\": [1, 1, 1], \"positiveFade\": [0, 0, 0], \"negativeFade\": "    \
    "[0, 0, 0]"
    static const struct {
        const char *text;
        nebel_phase_type type;
        double g;
    } cases[] = {
        {IMPORT("\"type\": \"bevy_fog_volume\", \"scattering_asymmetry\": -0.25"), NEBEL_PHASE_HENYEY_GREENSTEIN, -.25},
        {IMPORT("\"type\": \"bevy_fog_volume\", \"scattering_asymmetry\": 0"), NEBEL_PHASE_ISOTROPIC, 0},
        {IMPORT("\"type\": \"unreal_local_fog_volume\""), NEBEL_PHASE_HENYEY_GREENSTEIN, .2},
        {IMPORT("\"type\": \"unreal_local_fog_volume\", \"FogPhaseG\": 0.6"), NEBEL_PHASE_HENYEY_GREENSTEIN, .6},
        {IMPORT("\"type\": \"godot_volumetric_fog\""), NEBEL_PHASE_HENYEY_GREENSTEIN, .2},
        {IMPORT("\"type\": \"godot_volumetric_fog\", \"volumetric_fog_anisotropy\": 0.9"),
         NEBEL_PHASE_HENYEY_GREENSTEIN, .9},
        {IMPORT("\"type\": \"godot_fog_volume\""), NEBEL_PHASE_HENYEY_GREENSTEIN, .2},
        {IMPORT("\"type\": \"hdrp_fog\""), NEBEL_PHASE_ISOTROPIC, 0},
        {IMPORT("\"type\": \"hdrp_fog\", \"anisotropy\": 0.3"), NEBEL_PHASE_CORNETTE_SHANKS, .3},
        {IMPORT(HDRP_LOCAL ", \"anisotropy\": -0.3"), NEBEL_PHASE_CORNETTE_SHANKS, -.3},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        nebel_scene *scene;
        const nebel_volume_desc *fog = import(cases[i].text, 1, &scene);
        assert_int_equal(fog->phase.type, cases[i].type);
        assert_number(fog->phase.g, cases[i].g);
        nebel_destroy_scene(scene);
    }
}

/* ---- Bevy ------------------------------------------------------------------------------------ */

static void test_bevy(void **state)
{
    (void)state;
    nebel_scene *scene;
    const nebel_volume_desc *fog =
        import(IMPORT("\"type\": \"bevy_fog_volume\", \"density_factor\": 0.5, \"absorption\": 0.1, \"scattering\": "
                      "0.3, \"fog_color\": [1, 0.5, 0], "
                      "\"translation\": [1, 2, 3], \"scale\": [10, 4, 10]"),
               1, &scene);
    assert_vector(fog->shape.min, -.5, -.5, -.5);
    assert_vector(fog->shape.transform.position, 1, 2, 3);
    assert_vector(fog->shape.transform.scale, 10, 4, 10);
    assert_grey(fog->extinction, .2);
    assert_vector(fog->albedo, .75, .375, 0);
    assert_int_equal(fog->phase.type, NEBEL_PHASE_HENYEY_GREENSTEIN);
    assert_number(fog->phase.g, .5);
    nebel_destroy_scene(scene);
    fog = import(IMPORT("\"type\": \"bevy_distance_fog\", \"color\": \"#fff\", \"density\": 0.02"), 1, &scene);
    assert_grey(fog->extinction, .02);
    assert_grey(fog->source, 1);
    nebel_destroy_scene(scene);
    fog = import(IMPORT("\"type\": \"bevy_distance_fog\", \"color\": [1, 2, 3], \"extinction\": [0.1, 0.2, 0.3], "
                        "\"inscattering\": [0.1, 0.2, 0.3]"),
                 1, &scene);
    assert_vector(fog->extinction, .1, .2, .3);
    assert_vector(fog->source, 1, 2, 3);
    nebel_destroy_scene(scene);
}

/* ---- all ------------------------------------------------------------------------------------- */

static void test_a_source_stands_for_the_lights_of_the_engine(void **state)
{
    (void)state;
    nebel_scene *scene;
    const nebel_volume_desc *fog = import(
        "{\"nebel\": 1, \"sun\": {\"direction\": [0, 1, 0], \"irradiance\": 1}, \"fog\": [{\"source\": [1, 2, 3], "
        "\"import\": {\"type\": \"hdrp_fog\"}}]}",
        1, &scene);
    assert_vector(fog->source, 1, 2, 3);
    assert_grey(fog->albedo, 0);
    nebel_destroy_scene(scene);
}

#define LIT(import)                                                                                                    \
    "{\"nebel\": 1, \"sun\": {\"direction\": [0, 1, 0], \"irradiance\": 1}, \"fog\": [{\"import\": " import "}]}"

static void test_what_no_import_has(void **state)
{
    (void)state;
    const rule rules[] = {
        {FORMAT, FOG("\"import\": `{}"),
         "fog[0].import: the key \"type\" is missing; must be one of: unreal_height_fog,"},
        {FORMAT, FOG("\"import\": `3"), "fog[0].import: is a number; must be an object"},
        {FORMAT, IMPORT("\"type\": `\"unreal_hight_fog\""),
         "fog[0].import.type: unknown; must be one of: unreal_height_fog, unreal_local"},
        {FORMAT, FOG("\"import\": {\"type\": \"godot_fog\"}, `\"shape\": {}"),
         "fog[0].shape: unknown key; imported fog has: name, import, source"},
        {FORMAT, IMPORT("\"type\": \"unreal_height_fog\", `\"FogDensty\": 1"),
         "fog[0].import.FogDensty: unknown key; an unreal_height_fog has: type, FogDensity,"},
        {UNSUPPORTED, IMPORT("\"type\": \"unreal_height_fog\", \"FogCutoffDistance\": `100"),
         "fog[0].import.FogCutoffDistance: is 100; behind it the engine draws no fog at all, also not what lies "
         "before, "
         "so it must be 0"},
        {UNSUPPORTED, IMPORT("\"type\": \"unreal_height_fog\", \"EndDistance\": `100"),
         "fog[0].import.EndDistance: is 100; the engine measures it along the ground"},
        {FORMAT, IMPORT("\"type\": \"unreal_height_fog\", \"FogMaxOpacity\": `1.5"),
         "fog[0].import.FogMaxOpacity: is 1.5; must be"},
        {UNSUPPORTED,
         FOG("\"import\": {\"type\": \"unreal_height_fog\", \"FogMaxOpacity\": 0.5}}, {\"import\": `{\"type\": "
             "\"unreal_height_fog\", \"FogMaxOpacity\": 0.75}"),
         "fog[1].import: has a largest opacity of 0.75, and other fog has 0.5; all fog here has one"},
        {FORMAT, IMPORT("\"type\": \"unreal_height_fog\", \"SecondFogData\": {`\"density\": 1}"),
         "fog[0].import.SecondFogData.density: unknown key; SecondFogData has: FogDensity,"},
        {FORMAT, IMPORT("\"type\": \"unreal_local_fog_volume\", `\"HeightFogExtinction\": 1"),
         "fog[0].import.HeightFogExtinction: unknown key; an unreal_local_fog_volume has"},
        {UNSUPPORTED, IMPORT("\"type\": \"godot_fog\", \"fog_height_density\": `0.1"),
         "fog[0].import.fog_height_density: is 0.1; Godot's height fog"},
        {UNSUPPORTED, IMPORT("\"type\": \"godot_fog\", \"fog_mode\": `1"),
         "fog[0].import.fog_mode: is 1; depth fog is not"},
        {FORMAT, IMPORT("\"type\": \"godot_fog_volume\", \"shape\": `5"),
         "fog[0].import.shape: is 5; must be a whole number from 0 to 4"},
        {FORMAT, IMPORT("\"type\": \"godot_fog_volume\", \"density\": `-1"),
         "fog[0].import.density: is -1; must be an amount from 0 to 1e9 per metre"},
        {FORMAT, IMPORT("\"type\": \"godot_fog_volume\", \"albedo\": [`1.5, 1, 1]"),
         "fog[0].import.albedo[0]: is 1.5; must be a number from 0 to 1"},
        {FORMAT, IMPORT("\"type\": \"godot_fog_volume\", \"transform\": `[1, 1, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0]"),
         "fog[0].import.transform: is flat or sheared"},
        {FORMAT, IMPORT("\"type\": \"hdrp_fog\", \"meanFreePath\": `0"),
         "fog[0].import.meanFreePath: is 0; must be a number > 0"},
        {UNSUPPORTED,
         IMPORT(LOCAL "\"size\": [2, 2, 4], \"positiveFade\": [0.1, 0.1, 0.1], \"negativeFade\": `[0.1, 0.25, 0.1]"),
         "fog[0].import.negativeFade: fades over 0.5 m at one face and 0.2 m at the one opposite"},
        {UNSUPPORTED, IMPORT(LOCAL HARD ", \"distanceFadeStart\": `20"),
         "fog[0].import.distanceFadeStart: fades from 20 m to 10000 m from the eye; fog here ends at one distance"},
        {UNSUPPORTED, IMPORT(LOCAL HARD ", \"invertFade\": `1"),
         "fog[0].import.invertFade: is 1; fog here is inside its shape, so it must be 0"},
        {UNSUPPORTED,
         IMPORT(LOCAL "\"size\": [2, 2, 2], \"positiveFade\": [0.1, 0.1, 0.1], \"negativeFade\": [0.1, 0.1, 0.1], "
                      "\"falloffMode\": `1"),
         "fog[0].import.falloffMode: is 1; only the linear"},
        {UNSUPPORTED,
         IMPORT(LOCAL "\"size\": [2, 2, 2], \"positiveFade\": [0.1, 0.1, 0.1], \"negativeFade\": [0.1, 0.1, 0.1], "
                      "\"blendingMode\": `3"),
         "fog[0].import.blendingMode: is 3; fog here overwrites, 0, or adds, 1"},
        {FORMAT, FOG("\"import\": `{\"type\": \"bevy_distance_fog\", \"color\": 1}"), "fog[0].import: has \"density\""},
        {UNSUPPORTED, IMPORT("\"type\": \"bevy_distance_fog\", \"extinction\": 1, \"inscattering\": `2"),
         "fog[0].import.inscattering: differs from"},
    };
    CHECK(rules);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_unreal_height_fog),
        cmocka_unit_test(test_unreal_start_and_largest_opacity),
        cmocka_unit_test(test_unreal_local_fog_volume),
        cmocka_unit_test(test_godot_fog),
        cmocka_unit_test(test_godot_fog_volume),
        cmocka_unit_test(test_godot_edge_fade),
        cmocka_unit_test(test_hdrp_fog),
        cmocka_unit_test(test_hdrp_local_volumetric_fog),
        cmocka_unit_test(test_hdrp_fades_of_each_axis),
        cmocka_unit_test(test_hdrp_overwrites_what_ranks_below),
        cmocka_unit_test(test_phases),
        cmocka_unit_test(test_bevy),
        cmocka_unit_test(test_a_source_stands_for_the_lights_of_the_engine),
        cmocka_unit_test(test_what_no_import_has),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
