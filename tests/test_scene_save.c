/* Numbers written back into scene files: what changes, and that nothing else does. */
#define _POSIX_C_SOURCE 200809L

#include "scene_draft.h"

#include <math.h>

/* ---- in place -------------------------------------------------------------------------------- */

static void test_only_what_changes_is_written(void **state)
{
    (void)state;
    static const char before[] = SCENE("// a remark\n \"fog\": [ {" BOX ",\t\"visibility\" : 1e1 /* thick */ ,\n"
                                       " \"source\": \"#fff\"} ]"),
                      after[] = SCENE("// a remark\n \"fog\": [ {\"shape\": {\"type\": \"box\", \"min\": [-1, -2, -3], "
                                      "\"max\": [1, 2.75, 3]},\t\"visibility\" : 20 /* thick */ ,\n"
                                      " \"source\": [0.5, 0.25, 1]} ]");
    draft d = open_draft(before);
    check_saved(&d, before);
    d = open_draft(before);
    d.volumes[0].shape.max[1] = 2.75;
    for (int c = 0; c < 3; c++) d.volumes[0].extinction[c] = nebel_extinction_from_visibility(20, 0);
    d.volumes[0].source[0] = .5;
    d.volumes[0].source[1] = .25;
    check_saved(&d, after);
}

static void test_amounts_keep_their_word(void **state)
{
    (void)state;
    draft d = open_draft(SCENE("\"fog\": [{" BOX ", \"extinction\": 0.1}, {" BOX
                               ", \"mean_free_path\": [1, 2, 4]}, {" BOX ", \"contrast\": 0.02, \"visibility\": 5}]"));
    for (int c = 0; c < 3; c++) d.volumes[0].extinction[c] = .2;
    d.volumes[1].extinction[2] = .125;
    d.volumes[2].extinction[1] = nebel_extinction_from_visibility(50, .02);
    check_saved(&d, SCENE("\"fog\": [{" BOX ", \"extinction\": 0.2}, {" BOX ", \"mean_free_path\": [1, 2, 8]}, {" BOX
                          ", \"contrast\": 0.02, \"visibility\": [5, 50, 5]}]"));
}

static void test_shapes_and_densities(void **state)
{
    (void)state;
    draft d = open_draft(SCENE("\"fog\": [{\"shape\": {\"type\": \"sphere\", \"center\": [0, 0, 0], \"radius\": 2, "
                               "\"transform\": {\"scale\": 2}},"
                               " \"density\": {\"type\": \"radial\", \"power\": 1}, \"extinction\": 1},"
                               " {\"shape\": {\"type\": \"world\"}, \"density\": {\"type\": \"height\", "
                               "\"scale_height\": 4, \"below\": \"grow\"},"
                               " \"priority\": 1, \"extinction\": 1}]"));
    d.volumes[0].shape.radius = 3;
    d.volumes[0].shape.transform.scale[2] = 4;
    d.volumes[0].shape.transform.position[0] = 7;
    d.volumes[0].density.power = 3;
    d.volumes[1].density.base = -.1;
    d.volumes[1].density.below = NEBEL_BELOW_CONSTANT;
    d.volumes[1].priority = 5;
    check_saved(&d, SCENE("\"fog\": [{\"shape\": {\"type\": \"sphere\", \"center\": [0, 0, 0], \"radius\": 3, "
                          "\"transform\": {\"scale\": "
                          "[2, 2, 4], \"position\": [7, 0, 0]}},"
                          " \"density\": {\"type\": \"radial\", \"power\": 3}, \"extinction\": 1},"
                          " {\"shape\": {\"type\": \"world\"}, \"density\": {\"type\": \"height\", \"scale_height\": "
                          "4, \"below\": \"constant\","
                          " \"base\": -0.1},"
                          " \"priority\": 5, \"extinction\": 1}]"));
}

/* ---- in addition ----------------------------------------------------------------------------- */

static void test_keys_are_added_as_their_neighbours_stand(void **state)
{
    (void)state;
    draft d = open_draft(SCENE("\"fog\": [\n    {\n      " BOX ",\n      \"extinction\": 0.1 // thin\n    }\n  ]"));
    d.volumes[0].source[1] = 1;
    d.volumes[0].emission[0] = d.volumes[0].emission[1] = d.volumes[0].emission[2] = .5;
    d.data.ambient[2] = .75;
    d.data.camera.position[1] = 2;
    check_saved(&d, SCENE("\"fog\": [\n    {\n      " BOX ",\n      \"extinction\": 0.1, // thin\n"
                          "      \"source\": [0, 1, 0],\n      \"emission\": 0.5\n    }\n  ],\n"
                          "  \"camera\": { \"position\": [0, 2, 0], \"look_at\": [0, 1.7, -1] },\n"
                          "  \"ambient\": [0, 0, 0.75]"));
}

static void test_a_transform_is_added(void **state)
{
    (void)state;
    draft d = open_draft(SCENE("\"fog\": [{" BOX ", \"extinction\": 1}]"));
    d.volumes[0].shape.transform.position[2] = 1.5;
    check_saved(&d, SCENE("\"fog\": [{\"shape\": {\"type\": \"box\", \"min\": [-1, -2, -3], \"max\": [1, 2.50, 3], "
                          "\"transform\": { \"position\": [0, 0, 1.5] }}, \"extinction\": 1}]"));
}

/* ---- camera and light ------------------------------------------------------------------------ */

static void test_camera_and_light(void **state)
{
    (void)state;
    draft d = open_draft(SCENE("\"camera\": {\"position\": [0, 1, 2]}, \"background\": \"#000\", \"ambient\": 1,\n"
                               "  \"sun\": {\"direction\": [0, 2, 0], \"irradiance\": [1, 2, 3]}, \"fog\": []"));
    d.data.camera.position[0] = 5;
    d.data.camera.vertical_fov = 60;
    d.data.background[0] = d.data.background[1] = d.data.background[2] = .5;
    d.data.ambient[0] = 2;
    d.data.sun_direction[0] = .6, d.data.sun_direction[1] = .8;
    d.data.sun_irradiance[2] = 4;
    check_saved(&d, SCENE("\"camera\": {\"position\": [5, 1, 2], \"look_at\": [0, 1, 1], \"vertical_fov\": 60}, "
                          "\"background\": 0.5, \"ambient\": [2, 1, 1],\n"
                          "  \"sun\": {\"direction\": [0.6, 0.8, 0], \"irradiance\": [1, 2, 4]}, \"fog\": []"));
}

static void test_the_sun_comes_and_goes(void **state)
{
    (void)state;
    draft d = open_draft(SCENE("\"up\": \"z\", \"fog\": []"));
    d.data.has_sun = 1;
    d.data.sun_direction[1] = 1;
    d.data.sun_irradiance[0] = 3;
    check_saved(&d,
                SCENE("\"up\": \"z\", \"fog\": [], \"sun\": { \"direction\": [0, 0, 1], \"irradiance\": [3, 0, 0] }"));
    static const char sun[] = "\"sun\": {\"direction\": [0, 1, 0], \"irradiance\": 1}", comma[] = ", \"fog\": []";
    char before[256];
    (void)snprintf(before, sizeof before, SCENE("%s%s"), sun, comma);
    d = open_draft(before);
    d.data.has_sun = 0;
    d.data.max_opacity = .5;
    check_saved(&d, "{ \"nebel\": 1, \"fog\": [], \"max_opacity\": 0.5\n}\n");
    (void)snprintf(before, sizeof before, SCENE("\"fog\": [] /* none */, %s"), sun);
    d = open_draft(before);
    d.data.has_sun = 0;
    d.data.ambient[0] = d.data.ambient[1] = d.data.ambient[2] = 2;
    check_saved(&d, SCENE("\"fog\": [],\n  \"ambient\": 2 /* none */"));
}

static void test_the_projection(void **state)
{
    (void)state;
    draft d = open_draft(SCENE("\"fog\": []"));
    d.data.camera.projection = NEBEL_PROJECTION_ORTHOGRAPHIC;
    d.data.camera.view_height = 4;
    check_saved(&d, SCENE("\"fog\": [],\n  \"camera\": { \"projection\": \"orthographic\", \"look_at\": [0, 1.7, -1], "
                          "\"view_height\": 4 }"));
    d = open_draft(SCENE("\"camera\": {\"look_at\": [0, 0, -9], \"projection\": \"panorama\"}, \"fog\": []"));
    d.data.camera.projection = NEBEL_PROJECTION_PERSPECTIVE;
    check_saved(&d, SCENE("\"camera\": {\"look_at\": [0, 0, -9], \"projection\": \"perspective\"}, \"fog\": []"));
}

static void test_how_the_camera_moves(void **state)
{
    (void)state;
    static const char turning[] =
        SCENE("\"camera\": {\"turntable\": {\"frames\": 9}, \"look_at\": [0, 0, -9]}, \"fog\": []"),
                      still[] = SCENE("\"camera\": {\"look_at\": [0, 0, -9]}, \"fog\": []"),
                      moving[] =
                          SCENE("\"unit\": 0.5, \"camera\": {\"keys\": [{\"frame\": 2}, {\"frame\": 4, \"position\": "
                                "[2, 0, 0]}]}, \"fog\": []");
    nebel_camera_key keys[2] = {{.frame = 1}, {.frame = 3}};
    draft d = open_draft(turning);
    d.data.turntable_frames = 12;
    check_saved(&d, SCENE("\"camera\": {\"turntable\": { \"frames\": 12 }, \"look_at\": [0, 0, -9]}, \"fog\": []"));
    d = open_draft(turning);
    d.data.turntable_frames = 0;
    check_saved(&d, still);
    d = open_draft(SCENE("\"fog\": []"));
    d.data.turntable_frames = 5;
    check_saved(&d, SCENE("\"fog\": [],\n  \"camera\": { \"turntable\": { \"frames\": 5 } }"));
    d = open_draft(turning);
    keys[0].camera = keys[1].camera = d.data.camera;
    keys[1].camera.vertical_fov = 20;
    d.data.turntable_frames = 0;
    d.data.camera_keys = keys;
    d.data.camera_key_count = 2;
#define VIEW "\"position\": [0, 1.7, 0], \"look_at\": [0, 0, -9], \"up\": [0, 1, 0], "
    check_saved(&d, SCENE("\"camera\": {\"look_at\": [0, 0, -9], \"keys\": [{ \"frame\": 1, " VIEW
                          "\"vertical_fov\": 50, \"view_height\": 10 }, { \"frame\": 3, " VIEW
                          "\"vertical_fov\": 20, \"view_height\": 10 }]}, \"fog\": []"));
    d = open_draft(moving);
    check_saved(&d, moving);
    d = open_draft(moving);
    d.data.camera_keys = NULL;
    d.data.camera_key_count = 0;
    d.data.camera.view_height = 4;
    check_saved(&d, SCENE("\"unit\": 0.5, \"camera\": { \"look_at\": [0, 3.4, -2], \"view_height\": 8 }, \"fog\": []"));
}

/* What a key leaves out it takes from the camera: it stays as it was where that changes. */
static void test_keys_stay_where_their_camera_moves(void **state)
{
    (void)state;
    draft d = open_draft(SCENE("\"camera\": {\"keys\": [{\"frame\": 2, \"vertical_fov\": 9}]}, \"fog\": []"));
    d.data.camera.position[0] = 5;
    check_saved(&d,
                SCENE("\"camera\": { \"position\": [5, 1.7, 0], \"look_at\": [0, 1.7, -1], \"keys\": [{ \"frame\": 2, "
                      "\"position\": [0, 1.7, 0], \"look_at\": [0, 1.7, -1], \"up\": [0, 1, 0], \"vertical_fov\": 9, "
                      "\"view_height\": 10 }] }, \"fog\": []"));
}

static void test_classic_fog(void **state)
{
    (void)state;
    static const nebel_factor_desc factor = {
        .start = 2, .end = 8, .density = .5, .color = {.25, .25, .25}, .coordinate = NEBEL_COORDINATE_RADIAL};
    static const char section[] = SCENE("\"unit\": 0.5, \"fog\": [], \"classic\": { \"start\": 4, \"end\": 16, "
                                        "\"density\": 0.25, \"color\": 0.25, \"coordinate\": \"radial\", \"stage\": "
                                        "\"vertex\" }");
    draft d = open_draft(SCENE("\"unit\": 0.5, \"fog\": []"));
    d.data.classic = &factor;
    check_saved(&d, section);
    d = open_draft(section);
    nebel_factor_desc other = *d.data.classic;
    other.end = 6;
    other.stage = NEBEL_STAGE_PIXEL;
    d.data.classic = &other;
    check_saved(&d, SCENE("\"unit\": 0.5, \"fog\": [], \"classic\": { \"start\": 4, \"end\": 12, \"density\": 0.25, "
                          "\"color\": 0.25, \"coordinate\": \"radial\", \"stage\": \"pixel\" }"));
    d = open_draft(section);
    d.data.classic = NULL;
    check_saved(&d, SCENE("\"unit\": 0.5, \"fog\": []"));
}

#define CLASSIC(members) SCENE("\"unit\": 0.5, \"fog\": [], \"classic\": " members)
#define DEVICE                                                                                                         \
    "\"d3d9\": { \"fog_vertex_mode\": \"none\", \"fog_table_mode\": \"exp\", \"fog_start\": 0, \"fog_end\": 8, "       \
    "\"fog_density\": 0.5, \"fog_color\": [1, 0.2, 0], \"range_fog_enable\": false }"

static void test_curves_and_devices(void **state)
{
    (void)state;
    static const nebel_d3d9_fog device = {1, 0xff3300, NEBEL_D3DFOG_EXP, NEBEL_D3DFOG_NONE, 0, 4, 1, 0};
    draft d = open_draft(CLASSIC("{ \"color\": 1 }"));
    d.data.classic_curve = NEBEL_CURVE_EXP;
    d.data.classic_d3d9 = &device;
    check_saved(&d, CLASSIC("{ \"color\": 1, \"curve\": \"exp\", " DEVICE " }"));
    d = open_draft(CLASSIC("{ \"d3d9\": {}, \"table\": [0, 1] }"));
    d.data.classic_curve = NEBEL_CURVE_PHYSICAL;
    d.data.classic_d3d9 = &device;
    check_saved(&d, CLASSIC("{ " DEVICE ", \"curve\": \"physical\" }"));
    d = open_draft(CLASSIC("{ \"d3d9\": {}, \"curve\": \"exp\" }"));
    d.data.classic_d3d9 = NULL;
    check_saved(&d, CLASSIC("{ \"curve\": \"exp\" }"));
    d = open_draft(SCENE("\"unit\": 0.5, \"fog\": []"));
    d.data.classic = &(nebel_factor_desc){.end = 1, .density = 1};
    d.data.classic_curve = NEBEL_CURVE_EXP2;
    d.data.classic_d3d9 = &device;
    check_saved(&d, CLASSIC("{ \"start\": 0, \"end\": 2, \"density\": 0.5, \"color\": 0, \"coordinate\": \"plane\", "
                            "\"stage\": \"vertex\", \"curve\": \"exp2\", " DEVICE " }"));
}

/* Where the section is empty it is written as a whole. */
static void test_a_table_comes(void **state)
{
    (void)state;
    static float table[256];
    static const nebel_factor_desc factor = {.end = 1, .density = 1};
    journal kept;
    nebel_scene *scene = NULL;
    for (int i = 0; i < 256; i++) table[i] = (float)(i % 5) / 8;
    draft d = open_draft(CLASSIC("{}"));
    d.data.classic = &factor;
    d.data.classic_curve = NEBEL_CURVE_TABLE;
    d.data.classic_table = table;
    assert_int_equal(save(&d, &kept), NEBEL_OK);
    assert_int_equal(nebel_load_scene(file_path(), &(nebel_scene_desc){.host.log = {remember, &kept}}, &scene),
                     NEBEL_OK);
    const nebel_scene_data *data = nebel_get_scene_data(scene);
    assert_int_equal(data->classic_curve, NEBEL_CURVE_TABLE);
    assert_memory_equal(data->classic_table, table, sizeof table);
    assert_true(data->classic->end == 1 && data->classic->density == 1);
    nebel_destroy_scene(scene);
}

static void test_models(void **state)
{
    (void)state;
    draft d =
        open_draft(SCENE("\"unit\": 2, \"models\": [ {\"file\": \"a.obj\"}, {\"file\": \"b.obj\", \"color\": 1, "
                         "\"scale\": [1, 2, 3]}, {\"position\": [1, 2, 3], \"heightfield\": {\"file\": \"c.png\", "
                         "\"size\": [4, 5], \"height\": 6}} ], \"fog\": []"));
    nebel_scene_model models[2] = {d.data.models[1], d.data.models[2]};
    assert_int_equal(d.data.model_count, 3);
    assert_string_equal(strrchr(models[0].path, '/'), "/b.obj");
    models[0].has_color = 0;
    models[0].position[1] = 3;
    models[0].scale[2] = 4;
    models[0].rotation[0] = 1, models[0].rotation[3] = 0;
    models[1].has_color = 1;
    models[1].height = 10;
    models[1].size[0] = 6;
    models[1].position[0] = 8;
    d.data.models = models;
    d.data.model_count = 2;
    check_saved(
        &d, SCENE("\"unit\": 2, \"models\": [ {\"file\": \"b.obj\", \"scale\": [1, 2, 4], \"position\": [0, 1.5, 0], "
                  "\"rotation\": [1, 0, 0, 0]}, {\"position\": [4, 2, 3], \"heightfield\": {\"file\": \"c.png\", "
                  "\"size\": [3, 5], \"height\": 5}, \"color\": 0} ], \"fog\": []"));
}

/* ---- what volumes have beside their numbers -------------------------------------------------- */

static void test_contrast_and_phase(void **state)
{
    (void)state;
    draft d = open_draft(
        SCENE("\"fog\": [{" BOX ", \"visibility\": 5}, {" BOX ", \"extinction\": 1, \"albedo\": 0.5}, {" BOX
              ", \"extinction\": 1, \"albedo\": 0.5, \"phase\": {\"type\": \"rayleigh\"}}, {" BOX
              ", \"extinction\": 1, \"albedo\": 0.5, \"phase\": {\"type\": \"draine\", \"g\": 0.1, \"alpha\": 2}}]"));
    nebel_volume_track entries[4];
    for (int i = 0; i < 4; i++) entries[i] = d.data.volume_tracks[i];
    assert_int_equal(d.volumes[2].phase.type, NEBEL_PHASE_RAYLEIGH);
    assert_int_equal(d.volumes[3].phase.type, NEBEL_PHASE_DRAINE);
    assert_true(d.volumes[3].phase.g == .1 && d.volumes[3].phase.alpha == 2);
    for (int c = 0; c < 3; c++) {
        d.volumes[0].extinction[c] = nebel_extinction_from_visibility(5, .02);
        d.volumes[1].extinction[c] = nebel_extinction_from_visibility(8, .1);
    }
    entries[0].contrast = .02;
    entries[1].contrast = .1;
    d.volumes[1].phase = (nebel_phase){.type = NEBEL_PHASE_HENYEY_GREENSTEIN, .g = .75};
    d.volumes[2].phase = (nebel_phase){.type = NEBEL_PHASE_DROPLETS, .diameter = 12.5};
    d.volumes[3].phase = (nebel_phase){.type = NEBEL_PHASE_DRAINE, .g = -1. / 3, .alpha = 1e9 / 7};
    d.entries = entries;
    check_saved(
        &d, SCENE("\"fog\": [{" BOX ", \"visibility\": 5, \"contrast\": 0.02}, {" BOX
                  ", \"visibility\": 8, \"albedo\": 0.5, \"phase\": { \"type\": \"henyey_greenstein\", \"g\": 0.75 }, "
                  "\"contrast\": 0.1}, {" BOX ", \"extinction\": 1, \"albedo\": 0.5, \"phase\": { \"type\": "
                  "\"droplets\", \"diameter\": 12.5 }}, {" BOX
                  ", \"extinction\": 1, \"albedo\": 0.5, \"phase\": { \"type\": "
                  "\"draine\", \"g\": -0.333333333333333, \"alpha\": 142857142.857143 }}]"));
}

static void test_keys_come_change_and_go(void **state)
{
    (void)state;
    static const char still[] = SCENE("\"up\": \"z\", \"unit\": 0.5, \"fog\": [{" BOX ", \"extinction\": 1}]");
    static const char moving[] =
        SCENE("\"up\": \"z\", \"unit\": 0.5, \"fog\": [{" BOX ", \"extinction\": 1, \"keys\": [{ \"frame\": 0 }, { "
              "\"frame\": 24, \"shape\": { \"max\": [1, 2.5, 8], \"transform\": { \"position\": [2, 0, 0] } }, "
              "\"extinction\": 4, \"source\": 0.5 }]}]");
    nebel_volume_key keys[3];
    nebel_volume_track entry = {.contrast = .05, .keys = keys, .key_count = 2};
    draft d = open_draft(still);
    nebel_volume_desc own = d.volumes[0];
    keys[0] = (nebel_volume_key){0, own};
    keys[1] = (nebel_volume_key){24, own};
    keys[1].volume.shape.max[1] = 4;
    keys[1].volume.shape.transform.position[0] = 1;
    for (int c = 0; c < 3; c++) keys[1].volume.extinction[c] = 8, keys[1].volume.source[c] = .5;
    entry.base = &own;
    d.entries = &entry;
    check_saved(&d, moving);
    d = open_draft(moving);
    entry = d.data.volume_tracks[0];
    assert_int_equal(entry.key_count, 2);
    keys[0] = entry.keys[0];
    keys[1] = entry.keys[1];
    keys[2] = (nebel_volume_key){30.5, keys[0].volume};
    keys[2].volume.emission[0] = 2;
    keys[0].volume.extinction[1] = 3;
    entry.keys = keys;
    entry.key_count = 3;
    d.entries = &entry;
    check_saved(&d,
                SCENE("\"up\": \"z\", \"unit\": 0.5, \"fog\": [{" BOX ", \"extinction\": 1, \"keys\": [{ \"frame\": 0, "
                      "\"extinction\": [1, 1.5, 1] }, { \"frame\": 24, \"shape\": { \"max\": [1, 2.5, 8], "
                      "\"transform\": { \"position\": [2, 0, 0] } }, \"extinction\": 4, \"source\": 0.5 }, { "
                      "\"frame\": 30.5, \"emission\": [1, 0, 0] }]}]"));
    d = open_draft(moving);
    entry = (nebel_volume_track){.contrast = .05};
    d.volumes[0] = *d.data.volume_tracks[0].base;
    d.entries = &entry;
    check_saved(&d, still);
}

static void test_keys_keep_their_words_and_lines(void **state)
{
    (void)state;
    draft d = open_draft(SCENE("\"fog\": [{" BOX
                               ", \"visibility\": 30, \"keys\": [ {\"frame\": 1, \"visibility\": 20 /* thick */},\n"
                               "    {\"frame\": 2}, {\"frame\": 3, \"source\": \"#fff\"}]}]"));
    nebel_volume_key keys[3];
    nebel_volume_track entry = d.data.volume_tracks[0];
    keys[0] = entry.keys[0];
    keys[1] = entry.keys[1];
    keys[2] = entry.keys[2];
    keys[1].frame = 2.5;
    entry.keys = keys;
    d.entries = &entry;
    check_saved(&d, SCENE("\"fog\": [{" BOX
                          ", \"visibility\": 30, \"keys\": [{\"frame\": 1, \"visibility\": 20 /* thick */},\n"
                          "    { \"frame\": 2.5 },\n    {\"frame\": 3, \"source\": \"#fff\"}]}]"));
}

/* An albedo in a key needs one in the volume. */
static void test_keys_with_an_albedo(void **state)
{
    (void)state;
    draft d = open_draft(SCENE("\"fog\": [" THIN "]"));
    nebel_volume_desc own = d.volumes[0];
    nebel_volume_key key = {5, own};
    const nebel_volume_track entry = {.contrast = .05, .keys = &key, .key_count = 1, .base = &own};
    key.volume.albedo[0] = key.volume.albedo[1] = key.volume.albedo[2] = .5;
    nebel_volume_track entries[1] = {entry};
    d.entries = entries;
    check_saved(&d, SCENE("\"fog\": [{" BOX ", \"extinction\": 0.1, \"keys\": [{ \"frame\": 5, \"albedo\": 0.5 }], "
                          "\"albedo\": 0}]"));
}

/* ---- other units ----------------------------------------------------------------------------- */

static void test_the_units_of_the_file(void **state)
{
    (void)state;
    static const char before[] =
        SCENE("\"up\": \"z\", \"unit\": 0.01, \"camera\": {\"position\": [100, 200, 300], \"look_at\": [0, 0, 0]},"
              " \"fog\": [{" BOX ", \"visibility\": 500, \"emission\": 0.1}]");
    draft d = open_draft(before);
    check_saved(&d, before);
    d = open_draft(before);
    d.data.camera.position[1] = 7;
    d.volumes[0].shape.max[1] = .07;
    d.volumes[0].shape.max[2] = .04;
    for (int c = 0; c < 3; c++) d.volumes[0].extinction[c] /= 2;
    d.volumes[0].emission[0] = 20;
    check_saved(
        &d, SCENE("\"up\": \"z\", \"unit\": 0.01, \"camera\": {\"position\": [100, 200, 700], \"look_at\": [0, 0, 0]},"
                  " \"fog\": [{\"shape\": {\"type\": \"box\", \"min\": [-1, -4, -3], \"max\": [1, 2.50, 7]}, "
                  "\"visibility\": 1000, \"emission\": [0.2, 0.1, 0.1]}]"));
}

/* ---- volumes that come and go ---------------------------------------------------------------- */

static void take_out(draft *d, size_t index)
{
    static size_t sources[8];
    const size_t count = --d->data.volume_count;
    for (size_t i = 0; i < count; i++) {
        sources[i] = (d->sources != NULL ? d->sources : (const size_t[]){0, 1, 2, 3})[i + (i >= index)];
        d->volumes[i] = d->volumes[i + (i >= index)];
        d->names[i] = d->names[i + (i >= index)];
    }
    d->sources = sources;
}

static void test_volumes_leave(void **state)
{
    (void)state;
    static const char lines[] = SCENE("\"fog\": [\n    " THIN ", // first, with a comma\n    " THICK "\n  ]");
    draft d = open_draft(SCENE("\"fog\": [ " THIN ", " THICK ", " THIN " ]"));
    take_out(&d, 1);
    check_saved(&d, SCENE("\"fog\": [ " THIN ", " THIN " ]"));
    d = open_draft(SCENE("\"fog\": [ " THIN ", " THICK ", " THIN " ]"));
    take_out(&d, 2);
    take_out(&d, 0);
    check_saved(&d, SCENE("\"fog\": [ " THICK " ]"));
    d = open_draft(SCENE("\"fog\": [ " THIN ", " THICK " ]"));
    take_out(&d, 0);
    take_out(&d, 0);
    check_saved(&d, SCENE("\"fog\": [  ]"));
    d = open_draft(lines);
    take_out(&d, 1);
    check_saved(&d, SCENE("\"fog\": [\n    " THIN " // first, with a comma\n    \n  ]"));
    d = open_draft(lines);
    take_out(&d, 0);
    check_saved(&d, SCENE("\"fog\": [\n     // first, with a comma\n    " THICK "\n  ]"));
    d = open_draft(SCENE("\"fog\": [\n    " THIN " // first, and\n    /* then, */ , " THICK "\n  ]"));
    take_out(&d, 1);
    check_saved(&d, SCENE("\"fog\": [\n    " THIN " // first, and\n    /* then, */ \n  ]"));
}

/* One of each shape and density, so that every word is read again as it was written. */
static void test_volumes_come(void **state)
{
    (void)state;
    static const size_t sources[] = {NEBEL_NEW_VOLUME};
    static const char *const shapes[] = {
        "{ \"type\": \"world\" }",
        "{ \"type\": \"half_space\", \"point\": [0, 1, 0], \"normal\": [0, 1, 0] }",
        "{ \"type\": \"sphere\", \"center\": [0, 0, 2], \"radius\": 3, \"transform\": { \"position\": [1, 2, 3] } }",
        "{ \"type\": \"ellipsoid\", \"center\": [0, 0, 0], \"radii\": [1, 2, 3] }",
        "{ \"type\": \"cylinder\", \"radius\": 1, \"from\": [0, 0, 0], \"to\": [0, 1, 0] }",
        "{ \"type\": \"cone\", \"from\": [0, 0, 0], \"to\": [0, 1, 0], \"radius_from\": 0, \"radius_to\": 2 }",
        "{ \"type\": \"convex\", \"planes\": [[1, 0, 0, 2], [0, 1, 0, 0.5]] }",
        ("{ \"type\": \"union\", \"shapes\": [{ \"type\": \"sphere\", \"center\": [0, 0, 0], \"radius\": 1, "
         "\"transform\": { \"scale\": [1, 2, 1] } }, { \"type\": \"box\", \"min\": [0, 0, 0], \"max\": [1, 1, 1] }] "
         "}")};
    static const char *const others[] = {
        (", \"density\": { \"type\": \"height\", \"base\": 2, \"scale_height\": 5, \"below\": \"constant\" }, "
         "\"extinction\": 0.5, \"albedo\": [0.5, 0.25, 1], \"cutoff\": 8, \"phase\": { \"type\": \"rayleigh\" } }"),
        ", \"density\": { \"type\": \"linear\", \"from\": [0, 0, 0], \"to\": [0, 4, 0] }, \"extinction\": 0 }",
        ", \"density\": { \"type\": \"radial\", \"power\": 2 }, \"extinction\": [1, 2, 3], \"source\": 0.5 }",
        (", \"density\": { \"type\": \"gaussian\", \"center\": [0, 1, 0], \"sigma\": 2 }, \"extinction\": 1, "
         "\"emission\": 3, \"start\": 1 }"),
    };
    for (size_t i = 0; i < sizeof shapes / sizeof *shapes; i++) {
        char wanted[1024];
        const char *other = i == 2 ? others[2] : others[i % 4 == 2 ? 0 : i % 4];
        (void)snprintf(wanted, sizeof wanted, SCENE("\"fog\": [{ \"name\": \"a \\\"b\\\"\", \"shape\": %s%s]"),
                       shapes[i], other);
        draft d = open_draft(wanted);
        const nebel_scene_data made = d.data;
        write_file(SCENE("\"fog\": []"));
        draft empty = open_draft(SCENE("\"fog\": []"));
        empty.volumes[0] = made.volumes[0];
        empty.names[0] = made.volume_names[0];
        empty.data.volume_count = 1;
        empty.sources = sources;
        check_saved(&empty, wanted);
        nebel_destroy_scene(d.scene);
    }
}

static void test_volumes_come_behind_the_others(void **state)
{
    (void)state;
    static const size_t sources[] = {1, NEBEL_NEW_VOLUME, NEBEL_NEW_VOLUME};
    draft d = open_draft(SCENE("\"up\": \"z\", \"unit\": 0.5, \"fog\": [\n    " THIN ",\n    " THICK "\n  ]"));
    d.volumes[0] = d.volumes[1];
    d.volumes[2] = d.volumes[1];
    d.names[2] = "";
    d.volumes[1].operation = NEBEL_OPERATION_EXCLUDE;
    d.volumes[1].priority = -2;
    d.data.volume_count = 3;
    d.sources = sources;
    check_saved(&d,
                SCENE("\"up\": \"z\", \"unit\": 0.5, \"fog\": [\n    " THICK ",\n    { \"operation\": \"exclude\", "
                      "\"priority\": -2, \"shape\": { \"type\": \"box\", \"min\": [-1, -2, -3], \"max\": [1, 2.5, "
                      "3] } },\n    { \"shape\": { \"type\": \"box\", \"min\": [-1, -2, -3], \"max\": [1, 2.5, 3] }, "
                      "\"extinction\": 7 }\n  ]"));
}

static void test_another_kind_is_written_as_a_whole(void **state)
{
    (void)state;
    draft d = open_draft(SCENE("\"fog\": [ {" BOX ", /* soft */ \"visibility\": 5}, " THIN " ]"));
    d.volumes[0].shape.type = NEBEL_SHAPE_SPHERE;
    d.volumes[0].shape.radius = 2;
    for (int c = 0; c < 3; c++) d.volumes[0].extinction[c] = .5;
    d.names[1] = "thin";
    check_saved(&d, SCENE("\"fog\": [ { \"shape\": { \"type\": \"sphere\", \"center\": [0, 0, 0], \"radius\": 2 }, "
                          "\"extinction\": 0.5 }, {" BOX ", \"extinction\": 0.1, \"name\": \"thin\"} ]"));
}

static void test_keys_that_have_become_wrong_go(void **state)
{
    (void)state;
    draft d =
        open_draft(SCENE("\"fog\": [{\"cutoff\": 5, \"contrast\": 0.1, " BOX ", \"visibility\": 5}, {" BOX
                         ", \"source\": 1, \"mean_free_path\": 4, \"start\": 1, \"cutoff\": 9}, {" BOX
                         ", \"extinction\": 1, \"albedo\": 1, \"phase\": {\"type\": \"rayleigh\"}, \"priority\": 1}]"));
    d.volumes[0].cutoff = d.volumes[1].cutoff = 0;
    for (int c = 0; c < 3; c++) {
        d.volumes[0].extinction[c] = d.volumes[1].source[c] = d.volumes[2].albedo[c] = 0;
        d.volumes[1].albedo[c] = .25;
        d.volumes[2].source[c] = .5;
    }
    d.volumes[1].extinction[0] = 0;
    check_saved(&d, SCENE("\"fog\": [{" BOX ", \"extinction\": 0}, {" BOX
                          ", \"extinction\": [0, 0.25, 0.25], \"start\": 1, \"albedo\": 0.25}, {" BOX
                          ", \"extinction\": 1, \"priority\": 1, \"source\": 0.5}]"));
}

static void test_parts_and_planes(void **state)
{
    (void)state;
    draft d = open_draft(SCENE(
        "\"up\": \"z\", \"unit\": 0.1, \"fog\": [{\"shape\": {\"type\": \"union\", \"shapes\": [{\"type\": "
        "\"sphere\", \"center\": [1, 2, 3], \"radius\": 2}, {\"type\": \"convex\", \"planes\": [[1, 0, 0, 20], [0, "
        "0, 1, 5]]}]}, \"extinction\": 1}]"));
    nebel_shape parts[2] = {d.volumes[0].shape.parts[0], d.volumes[0].shape.parts[1]};
    nebel_plane planes[2] = {parts[1].planes[0], parts[1].planes[1]};
    parts[0].center[1] = .7;
    parts[0].transform.position[0] = .5;
    planes[1].normal[2] = -.5;
    planes[1].distance = 2;
    parts[1].planes = planes;
    d.volumes[0].shape.parts = parts;
    check_saved(
        &d, SCENE("\"up\": \"z\", \"unit\": 0.1, \"fog\": [{\"shape\": {\"type\": \"union\", \"shapes\": "
                  "[{\"type\": \"sphere\", \"center\": [1, 2, 7], \"radius\": 2, \"transform\": { \"position\": [5, "
                  "0, 0] }}, {\"type\": \"convex\", \"planes\": [[1, 0, 0, 20], [0, 0.5, 1, 20]]}]}, "
                  "\"extinction\": 1}]"));
}

#define DUST "{\"shape\": {\"type\": \"sphere\", \"center\": [0, 0, 0], \"radius\": 2}"

static void test_nebulae(void **state)
{
    (void)state;
    draft d = open_draft(SCENE("\"max_opacity\": 0.5, \"unit\": 0.1, \"fog\": [], \"nebula\": [ {\"shape\": {\"type\": "
                               "\"sphere\", \"center\": [0, 0, 0], \"radius\": 20}, \"count\": 10, \"turbulence\": 3, "
                               "\"turbulence_scale\": 4, \"radius_range\": [1, 2]} ]"));
    d.data.max_opacity = .75;
    d.nebulae[0].shape.radius = 3;
    d.nebulae[0].count = 20;
    d.nebulae[0].seed = 7;
    d.nebulae[0].radius_range[1] = .5;
    d.nebulae[0].profile = NEBEL_PARTICLE_UNIFORM;
    d.nebulae[0].turbulence_scale = 0;
    for (int c = 0; c < 3; c++) d.nebulae[0].emission[c] = 10;
    check_saved(&d, SCENE("\"max_opacity\": 0.75, \"unit\": 0.1, \"fog\": [], \"nebula\": [ {\"shape\": {\"type\": "
                          "\"sphere\", \"center\": [0, 0, 0], \"radius\": 30}, \"count\": 20, \"turbulence\": 3, "
                          "\"radius_range\": [1, 5], \"emission\": 1, \"seed\": 7, \"profile\": \"uniform\"} ]"));
}

static void test_colors_of_a_nebula(void **state)
{
    (void)state;
    static const double three[3][3] = {{1, 0, 0}, {.5, .5, .5}, {0, 0, 2}}, two[2][3] = {{1, 1, 1}, {0, 1, 0}};
    draft d = open_draft(SCENE("\"fog\": [], \"nebula\": [" DUST ", \"colors\": [1, /* green */ \"#0f0\"]}, " DUST
                               "}, " DUST ", \"colors\": [2]}]"));
    d.nebulae[0].colors = two;
    d.nebulae[1].colors = three;
    d.nebulae[1].color_count = 3;
    d.nebulae[2].colors = NULL;
    d.nebulae[2].color_count = 0;
    check_saved(&d, SCENE("\"fog\": [], \"nebula\": [" DUST ", \"colors\": [1, /* green */ \"#0f0\"]}, " DUST
                          ", \"colors\": [[1, 0, 0], 0.5, [0, 0, 2]]}, " DUST "}]"));
    d = open_draft(SCENE("\"fog\": [], \"nebula\": [" DUST ", \"colors\": [\"#fff\", [0, 1, 0]]}]"));
    d.nebulae[0].colors = three;
    check_saved(&d, SCENE("\"fog\": [], \"nebula\": [" DUST ", \"colors\": [[1, 0, 0], 0.5]}]"));
    d = open_draft(SCENE("\"fog\": [], \"nebula\": [" DUST ", \"colors\": [\"#fff\"]}]"));
    d.nebulae[0].colors = three;
    d.nebulae[0].color_count = 3;
    check_saved(&d, SCENE("\"fog\": [], \"nebula\": [" DUST ", \"colors\": [[1, 0, 0], 0.5, [0, 0, 2]]}]"));
}

static void test_noise(void **state)
{
    (void)state;
#define NOISE(cells, drift)                                                                                            \
    SCENE("\"unit\": 0.5, \"fog\": [{" BOX                                                                             \
          ", \"extinction\": 1, \"density\": {\"type\": \"noise\", \"size\": [4, 4, 4], "                              \
          "\"cells\": " cells drift "}}]")
    draft d = open_draft(NOISE("[1, 1, 1]", ""));
    nebel_grid *grid = d.volumes[0].density.grid, *changed;
    nebel_scene_noise noise;
    assert_true(nebel_get_scene_noise(d.scene, grid, &noise));
    noise.desc.frequency[1] = 2;
    noise.velocity[0] = .25;
    assert_int_equal(nebel_update_scene_noise(d.scene, grid, &noise, &changed), NEBEL_OK);
    d.volumes[0].density.grid = changed;
    check_saved(&d, NOISE("[1, 2, 1]", ", \"velocity\": [0.25, 0, 0]"));
    nebel_release_grid(changed);
}

/* What somebody else has changed meanwhile stays. */
static void test_other_changes_of_the_file_stay(void **state)
{
    (void)state;
    draft d = open_draft(SCENE("\"ambient\": 1, \"fog\": [" THIN "]"));
    d.volumes[0].source[0] = 1;
    write_file(SCENE("\"ambient\": 2, \"fog\": [{" BOX ", \"extinction\": 0.3}]"));
    check_saved(&d, SCENE("\"ambient\": 2, \"fog\": [{" BOX ", \"extinction\": 0.3, \"source\": [1, 0, 0]}]"));
}

/* ---- what is not written --------------------------------------------------------------------- */

static void test_volumes_that_are_made_of_something_else_stay(void **state)
{
    (void)state;
    static const char before[] =
        SCENE("\"fog\": [{" BOX ", \"extinction\": 1, \"keys\": [{\"frame\": 3, \"extinction\": 2}]}]");
    draft d = open_draft(before);
    d.volumes[0].extinction[0] = 7;
    check_saved(&d, before);
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
    static const char visible[] = SCENE("\"fog\": [{" BOX ", \"visibility\": 5}]"), none[] = SCENE("\"fog\": []"),
                      ball[] =
                          SCENE("\"fog\": [{\"shape\": {\"type\": \"sphere\", \"center\": [0, 0, 0], \"radius\": 1}, "
                                "\"visibility\": 5}]");
    draft d = open_draft(visible);
    d.volumes[0].shape.max[0] = -5;
    check_refused(visible, &d, NEBEL_ERROR_FORMAT, "max[0]");
    d = open_draft(visible);
    check_refused(none, &d, NEBEL_ERROR_ARGUMENT, "0 volumes of fog where 1");
    d = open_draft(visible);
    d.sources = (const size_t[]){1};
    check_refused(visible, &d, NEBEL_ERROR_ARGUMENT, "must ascend");
    d = open_draft(visible);
    d.data.volume_count = 0;
    check_refused(visible, &d, NEBEL_ERROR_ARGUMENT, "must ascend");
    d = open_draft(visible);
    check_refused(ball, &d, NEBEL_ERROR_ARGUMENT, "another volume");
    d = open_draft(visible);
    check_refused("{", &d, NEBEL_ERROR_FORMAT, "scene.json:");
}

/* What the file holds otherwise than it did when it was read. */
static void test_another_file_is_refused(void **state)
{
    (void)state;
#define LIGHT(type, more)                                                                                              \
    "\"lights\": [{\"type\": \"" type "\", \"position\": [0, 9, 0], \"intensity\": 5" more "}], \"fog\": []"
#define MODEL(name) "\"models\": [{\"file\": \"" name "\"}], \"fog\": []"
    static const struct {
        const char *before, *now, *message;
    } cases[] = {
        {SCENE(LIGHT("point", "")), SCENE(LIGHT("spot", ", \"direction\": [0, -1, 0], \"outer_angle\": 30")),
         "another light"},
        {SCENE(LIGHT("point", "")), SCENE("\"fog\": []"), "has 0 lights where 1 were"},
        {SCENE(MODEL("a.obj")), SCENE(MODEL("b.obj")), "another model"},
        {SCENE(MODEL("a.obj")), SCENE("\"fog\": []"), "has 0 models where 1 were"},
        {SCENE("\"ambient\": 1, \"fog\": []"),
         SCENE("\"ambient\": {\"type\": \"gradient\", \"zenith\": 1, \"horizon\": 2, \"ground\": 0}, \"fog\": []"),
         "has not the ambient light that it had"},
        {SCENE("\"fog\": [], \"nebula\": [" DUST "}]"), SCENE("\"fog\": [], \"nebula\": [" DUST "}, " DUST "}]"),
         "another nebula"},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        draft d = open_draft(cases[i].before);
        check_refused(cases[i].now, &d, NEBEL_ERROR_ARGUMENT, cases[i].message);
    }
}

static void test_memory_runs_out(void **state)
{
    (void)state;
    static const char before[] = SCENE("\"ambient\": 1, \"fog\": [{" BOX ", \"visibility\": 5}]");
    for (long fail_at = 0;; fail_at++) {
        draft d = open_draft(before);
        meter m;
        journal kept;
        const nebel_scene_desc desc = metered_desc(&m, &kept);
        m.fail_at = fail_at;
        d.volumes[0].shape.max[0] = 5;
        d.volumes[0].source[0] = 5;
        d.data.turntable_frames = 7;
        d.volumes[1] = d.volumes[0];
        d.names[1] = "a \"new\" one";
        const nebel_volume_desc own = d.volumes[0];
        const nebel_volume_key key = {1, own};
        const nebel_volume_track entries[2] = {d.data.volume_tracks[0],
                                               {.contrast = .02, .base = &own, .keys = &key, .key_count = 1}};
        d.data.volume_tracks = entries;
        d.data.classic = &(nebel_factor_desc){.density = 1};
        d.data.has_sun = 1;
        d.data.sun_direction[1] = 1;
        d.data.volumes = d.volumes;
        d.data.volume_names = d.names;
        d.data.volume_count = 2;
        const nebel_result result = nebel_save_scene(file_path(), &desc, nebel_get_scene_data(d.scene), &d.data,
                                                     (const size_t[]){0, NEBEL_NEW_VOLUME});
        assert_int_equal(m.live, 0);
        nebel_destroy_scene(d.scene);
        if (result == NEBEL_OK) return;
        assert_int_equal(result, NEBEL_ERROR_MEMORY);
        assert_string_equal(read_file(), before);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_only_what_changes_is_written),
        cmocka_unit_test(test_amounts_keep_their_word),
        cmocka_unit_test(test_shapes_and_densities),
        cmocka_unit_test(test_keys_are_added_as_their_neighbours_stand),
        cmocka_unit_test(test_a_transform_is_added),
        cmocka_unit_test(test_camera_and_light),
        cmocka_unit_test(test_the_sun_comes_and_goes),
        cmocka_unit_test(test_the_projection),
        cmocka_unit_test(test_how_the_camera_moves),
        cmocka_unit_test(test_keys_stay_where_their_camera_moves),
        cmocka_unit_test(test_classic_fog),
        cmocka_unit_test(test_curves_and_devices),
        cmocka_unit_test(test_a_table_comes),
        cmocka_unit_test(test_models),
        cmocka_unit_test(test_contrast_and_phase),
        cmocka_unit_test(test_keys_come_change_and_go),
        cmocka_unit_test(test_keys_keep_their_words_and_lines),
        cmocka_unit_test(test_keys_with_an_albedo),
        cmocka_unit_test(test_the_units_of_the_file),
        cmocka_unit_test(test_volumes_leave),
        cmocka_unit_test(test_volumes_come),
        cmocka_unit_test(test_volumes_come_behind_the_others),
        cmocka_unit_test(test_another_kind_is_written_as_a_whole),
        cmocka_unit_test(test_keys_that_have_become_wrong_go),
        cmocka_unit_test(test_parts_and_planes),
        cmocka_unit_test(test_nebulae),
        cmocka_unit_test(test_colors_of_a_nebula),
        cmocka_unit_test(test_noise),
        cmocka_unit_test(test_other_changes_of_the_file_stay),
        cmocka_unit_test(test_volumes_that_are_made_of_something_else_stay),
        cmocka_unit_test(test_what_is_refused),
        cmocka_unit_test(test_another_file_is_refused),
        cmocka_unit_test(test_memory_runs_out),
    };
    return cmocka_run_group_tests(tests, make_folder, remove_folder);
}
