/* What a scene file says, and what it leaves to its defaults. */
#include "near.h"
#include "scene_help.h"

#include <math.h>

static const char contract[] =
    "{ \"nebel\": 1, // the version\n"
    "  \"camera\": { \"position\": [0,2,8], \"look_at\": [0,1,0], \"up\": [0,1,0], \"vertical_fov\": 40, "
    "\"projection\": \"orthographic\", \"view_height\": 4 },\n"
    "  \"background\": [0.5,0.6,0.7], /* radiance */ \"ambient\": 0.25, /**/ /*/ \"ambient\": 7, /*/\n"
    "  \"sun\": { \"direction\": [0,3,4], \"irradiance\": [3,2.9,2.7] },\n"
    "  \"models\": [ { \"file\": \"house.glb\", \"position\": [0,0,0], \"rotation\": [0,0,0,1], \"scale\": 1 } ],\n"
    "  \"fog\": [ { \"name\": \"d\\u00fcnn \\ud83c\\udf2b\", \"shape\": { \"type\": \"box\", \"min\": [-100,0,-100], "
    "\"max\": "
    "[100,10,100] },\n"
    "    \"density\": { \"type\": \"height\", \"base\": 1, \"scale_height\": 4, \"below\": \"constant\" }, "
    "\"visibility\": 60, "
    "\"source\": [0.7,0.7,0.5] } ] } // the end";

static void test_the_example_of_the_contract(void **state)
{
    (void)state;
    nebel_scene *scene = parse_good(contract);
    const nebel_scene_data *data = nebel_get_scene_data(scene);
    assert_vector(data->camera.position, 0, 2, 8);
    assert_vector(data->camera.look_at, 0, 1, 0);
    assert_number(data->camera.vertical_fov, 40);
    assert_number(data->camera.view_height, 4);
    assert_int_equal(data->camera.projection, NEBEL_PROJECTION_ORTHOGRAPHIC);
    assert_vector(data->background, .5, .6, .7);
    assert_vector(data->ambient, .25, .25, .25);
    assert_int_equal(data->has_sun, 1);
    assert_vector(data->sun_direction, 0, .6, .8);
    assert_vector(data->sun_irradiance, 3, 2.9, 2.7);
    assert_int_equal(data->volume_count, 1);
    assert_string_equal(data->volume_names[0], "d\xC3\xBCnn \xF0\x9F\x8C\xAB");
    const nebel_volume_desc *volume = &data->volumes[0];
    assert_int_equal(volume->shape.type, NEBEL_SHAPE_BOX);
    assert_vector(volume->shape.min, -100, 0, -100);
    assert_vector(volume->shape.max, 100, 10, 100);
    assert_int_equal(volume->density.type, NEBEL_DENSITY_HEIGHT);
    assert_int_equal(volume->density.below, NEBEL_BELOW_CONSTANT);
    assert_number(volume->density.base, 1);
    assert_number(volume->density.scale_height, 4);
    assert_vector(volume->source, .7, .7, .5);
    for (int c = 0; c < 3; c++) assert_number(volume->extinction[c], -log(.05) / 60);
    nebel_destroy_scene(scene);
}

static void test_what_is_absent_has_its_default(void **state)
{
    (void)state;
    nebel_scene *scene =
        parse_good("{\"fog\": [{\"shape\": {\"type\": \"world\"}, \"extinction\": 0}], \"nebel\": 1.0e0}");
    const nebel_scene_data *data = nebel_get_scene_data(scene);
    assert_vector(data->camera.position, 0, 1.7, 0);
    assert_vector(data->camera.look_at, 0, 1.7, -1);
    assert_vector(data->camera.up, 0, 1, 0);
    assert_number(data->camera.vertical_fov, 50);
    assert_number(data->camera.view_height, 10);
    assert_int_equal(data->camera.projection, NEBEL_PROJECTION_PERSPECTIVE);
    assert_int_equal(data->camera_key_count + data->turntable_frames, 0);
    assert_vector(data->background, 0, 0, 0);
    assert_vector(data->ambient, 0, 0, 0);
    assert_int_equal(data->has_sun, 0);
    assert_int_equal(data->mesh_count + data->texture_count, 0);
    assert_string_equal(data->volume_names[0], "");
    const nebel_volume_desc *volume = &data->volumes[0];
    assert_int_equal(volume->operation, NEBEL_OPERATION_ADD);
    assert_int_equal(volume->density.type, NEBEL_DENSITY_CONSTANT);
    assert_vector(volume->shape.transform.scale, 1, 1, 1);
    assert_number(volume->shape.transform.rotation[3], 1);
    assert_vector(volume->source, 0, 0, 0);
    assert_vector(volume->albedo, 0, 0, 0);
    assert_vector(volume->emission, 0, 0, 0);
    assert_int_equal(nebel_load_scene_models(scene), NEBEL_OK);
    nebel_destroy_scene(scene);
}

static void test_a_camera_without_look_at_looks_along_minus_z(void **state)
{
    (void)state;
    nebel_scene *scene = parse_good("{\"nebel\": 1, \"fog\": [], \"camera\": {\"position\": [3, 4, 5]}}");
    assert_vector(nebel_get_scene_data(scene)->camera.look_at, 3, 4, 4);
    nebel_destroy_scene(scene);
}

/* The numbers: IEC 61966-2-1 in 40 decimal digits. */
static void test_colors_with_a_hash_are_srgb(void **state)
{
    (void)state;
    nebel_scene *scene = parse_good("{\"nebel\": 1, \"background\": \"#0A0b80\", \"ambient\": \"#fc8\", \"fog\": [{"
                                    "\"shape\": {\"type\": \"world\"}, \"extinction\": 1, \"albedo\": \"#ffffff\","
                                    "\"emission\": \"#00F\"}]}");
    const nebel_scene_data *data = nebel_get_scene_data(scene);
    assert_vector(data->background, 0.0030352698354883750, 0.0033465357638991605, 0.21586050011389923);
    assert_vector(data->ambient, 1, 0.60382733885533748, 0.24620132670783545);
    assert_vector(data->volumes[0].albedo, 1, 1, 1);
    assert_vector(data->volumes[0].emission, 0, 0, 1);
    nebel_destroy_scene(scene);
}

#define VOLUME(members) "{\"nebel\": 1, \"fog\": [{\"extinction\": 1, " members "}]}"

/* One volume; the scene goes to *scene, to be destroyed. */
static const nebel_volume_desc *one(const char *text, nebel_scene **scene)
{
    *scene = parse_good(text);
    return nebel_get_scene_data(*scene)->volumes;
}

static void test_all_simple_shapes(void **state)
{
    (void)state;
    nebel_scene *s[7];
    const nebel_shape *half =
        &one(VOLUME("\"shape\": {\"type\": \"half_space\", \"point\": [1, 2, 3], \"normal\": [0, 2, 0]}"), &s[0])
             ->shape;
    assert_int_equal(half->type, NEBEL_SHAPE_HALF_SPACE);
    assert_vector(half->point, 1, 2, 3);
    assert_vector(half->normal, 0, 2, 0);
    const nebel_shape *ball =
        &one(VOLUME("\"shape\": {\"type\": \"sphere\", \"center\": [1, 2, 3], \"radius\": 4}"), &s[1])->shape;
    assert_int_equal(ball->type, NEBEL_SHAPE_SPHERE);
    assert_vector(ball->center, 1, 2, 3);
    assert_number(ball->radius, 4);
    const nebel_shape *egg =
        &one(VOLUME("\"shape\": {\"type\": \"ellipsoid\", \"center\": [1, 2, 3], \"radii\": [4, 5, 6]}"), &s[2])->shape;
    assert_int_equal(egg->type, NEBEL_SHAPE_ELLIPSOID);
    assert_vector(egg->radii, 4, 5, 6);
    const nebel_shape *tube =
        &one(VOLUME("\"shape\": {\"type\": \"cylinder\", \"from\": [1, 2, 3], \"to\": [4, 5, 6], \"radius\": 7}"),
             &s[3])
             ->shape;
    assert_int_equal(tube->type, NEBEL_SHAPE_CYLINDER);
    assert_vector(tube->from, 1, 2, 3);
    assert_vector(tube->to, 4, 5, 6);
    const nebel_shape *pill =
        &one(VOLUME("\"shape\": {\"type\": \"capsule\", \"from\": [1, 2, 3], \"to\": [1, 2, 3], \"radius\": 7}"), &s[4])
             ->shape;
    assert_int_equal(pill->type, NEBEL_SHAPE_CAPSULE);
    const nebel_shape *cone = &one(VOLUME("\"shape\": {\"type\": \"cone\", \"from\": [1, 2, 3], \"to\": [4, 2, 3], "
                                          "\"radius_from\": 0, \"radius_to\": 2}"),
                                   &s[5])
                                   ->shape;
    assert_int_equal(cone->type, NEBEL_SHAPE_CONE);
    assert_number(cone->radius_to, 2);
    const nebel_shape *body =
        &one(VOLUME("\"shape\": {\"type\": \"convex\", \"planes\": [[1, 0, 0, 2], [-1, 0, 0, 3]]}"), &s[6])->shape;
    assert_int_equal(body->type, NEBEL_SHAPE_CONVEX);
    assert_int_equal(body->plane_count, 2);
    assert_vector(body->planes[1].normal, -1, 0, 0);
    assert_number(body->planes[1].distance, 3);
    for (int i = 0; i < 7; i++) nebel_destroy_scene(s[i]);
}

static void test_shapes_are_made_of_shapes(void **state)
{
    (void)state;
    nebel_scene *scene;
    const nebel_shape *shape =
        &one(VOLUME("\"shape\": {\"type\": \"union\", \"transform\": {\"position\": [1, 2, 3], \"rotation\": "
                    "[0, 0, 3, 4], \"scale\": -2}, \"shapes\": [{\"type\": \"world\"}, {\"type\": \"intersection\", "
                    "\"shapes\": [{\"type\": \"world\", \"transform\": {\"scale\": [1, 2, 3]}}]}]}"),
             &scene)
             ->shape;
    assert_int_equal(shape->type, NEBEL_SHAPE_UNION);
    assert_int_equal(shape->part_count, 2);
    assert_vector(shape->transform.position, 1, 2, 3);
    assert_vector(shape->transform.scale, -2, -2, -2);
    assert_number(shape->transform.rotation[2], .375); /* no digit of 3 and 4 is lost: the core makes it a unit one */
    assert_number(shape->transform.rotation[3], .5);
    assert_int_equal(shape->parts[0].type, NEBEL_SHAPE_WORLD);
    assert_int_equal(shape->parts[1].type, NEBEL_SHAPE_INTERSECTION);
    assert_vector(shape->parts[1].parts[0].transform.scale, 1, 2, 3);
    nebel_destroy_scene(scene);
}

static void test_all_densities(void **state)
{
    (void)state;
    nebel_scene *s[4];
    const nebel_density *linear = &one(VOLUME("\"shape\": {\"type\": \"world\"}, \"density\": {\"type\": \"linear\", "
                                              "\"from\": [1, 2, 3], \"to\": [4, 5, 6]}"),
                                       &s[0])
                                       ->density;
    assert_int_equal(linear->type, NEBEL_DENSITY_LINEAR);
    assert_vector(linear->to, 4, 5, 6);
    const nebel_density *radial = &one(VOLUME("\"shape\": {\"type\": \"sphere\", \"center\": [0, 0, 0], \"radius\": "
                                              "1}, \"density\": {\"type\": \"radial\"}"),
                                       &s[1])
                                       ->density;
    assert_int_equal(radial->type, NEBEL_DENSITY_RADIAL);
    assert_int_equal(radial->power, 1);
    const nebel_density *gaussian = &one(VOLUME("\"shape\": {\"type\": \"world\"}, \"density\": {\"type\": "
                                                "\"gaussian\", \"center\": [1, 2, 3], \"sigma\": 4}"),
                                         &s[2])
                                         ->density;
    assert_int_equal(gaussian->type, NEBEL_DENSITY_GAUSSIAN);
    assert_vector(gaussian->center, 1, 2, 3);
    assert_number(gaussian->sigma, 4);
    const nebel_density *soft = &one(VOLUME("\"shape\": {\"type\": \"box\", \"min\": [0, 0, 0], \"max\": [1, 1, 1]}, "
                                            "\"density\": {\"type\": \"soft_edge\", \"distance\": 0.25}"),
                                     &s[3])
                                     ->density;
    assert_int_equal(soft->type, NEBEL_DENSITY_SOFT_EDGE);
    assert_number(soft->edge_width, .25);
    for (int i = 0; i < 4; i++) nebel_destroy_scene(s[i]);
}

/* Above the ground at the origin, of the Earth unless the file says otherwise, in the file's own terms. */
#define ALTITUDE(scale_height)                                                                                         \
    "{\"nebel\": 1, \"fog\": [{\"extinction\": 1, \"shape\": {\"type\": \"world\"}, \"density\": {\"type\": "          \
    "\"altitude\", \"scale_height\": " #scale_height "}}]"

static void test_altitudes(void **state)
{
    (void)state;
    static const char *const texts[] = {
        "{\"nebel\": 1, \"fog\": [{\"extinction\": 1, \"shape\": {\"type\": \"world\"}, \"density\": {\"type\": "
        "\"altitude\", \"scale_height\": 40}}]}",
        "{\"nebel\": 1, \"up\": \"z\", \"unit\": 1000, \"fog\": [{\"extinction\": 1, \"shape\": {\"type\": \"world\"}, "
        "\"density\": {\"type\": \"altitude\", \"scale_height\": 0.04, \"radius\": 2, \"base\": 0.003, \"below\": "
        "\"constant\"}}]}",
        "{\"nebel\": 1, \"up\": \"z\", \"fog\": [{\"extinction\": 1, \"shape\": {\"type\": \"world\"}, \"density\": "
        "{\"type\": \"altitude\", \"scale_height\": 40, \"center\": [1, 2, 3]}}]}",
        ALTITUDE(40) ", \"planet\": {\"preset\": \"mars\", \"model\": \"physical\"}}",
        ALTITUDE(
            0.04) ", \"planet\": [{\"model\": \"physical\", \"radius\": 500, \"center\": [1, 2, -490]}, {\"model\": "
                  "\"physical\", \"preset\": \"moon\", \"center\": [0, 0, 9000]}], \"unit\": 1000, \"up\": \"z\"}",
        ALTITUDE(40) ", \"planet\": {\"model\": \"textured\", \"radius\": 3000}}"};
    const nebel_density wanted[] = {
        {.scale_height = 40, .center = {0, -6.36e6, 0}, .radius = 6.36e6},
        {.scale_height = 40, .center = {0, -2000, 0}, .radius = 2000, .base = 3, .below = NEBEL_BELOW_CONSTANT},
        {.scale_height = 40, .center = {1, 3, -2}, .radius = 6.36e6},
        {.scale_height = 40,
         .center = {0, -nebel_lookup_atmosphere("mars")->radius, 0},
         .radius = nebel_lookup_atmosphere("mars")->radius},
        {.scale_height = 40, .center = {1e3, -4.9e5, -2e3}, .radius = 5e5},
        {.scale_height = 40, .center = {0, -3000, 0}, .radius = 3000}};
    for (size_t i = 0; i < sizeof texts / sizeof *texts; i++) {
        nebel_scene *s;
        const nebel_density *density = &one(texts[i], &s)->density, *w = &wanted[i];
        assert_int_equal(density->type, NEBEL_DENSITY_ALTITUDE);
        assert_int_equal(density->below, w->below);
        assert_vector(density->center, w->center[0], w->center[1], w->center[2]);
        assert_number(density->radius, w->radius);
        assert_number(density->scale_height, w->scale_height);
        assert_number(density->base, w->base);
        nebel_destroy_scene(s);
    }
}

static void test_all_amounts(void **state)
{
    (void)state;
    nebel_scene *s[3];
    assert_vector(one("{\"nebel\": 1, \"fog\": [{\"shape\": {\"type\": \"world\"}, \"extinction\": [1, 0, 3]}]}", &s[0])
                      ->extinction,
                  1, 0, 3);
    assert_vector(
        one("{\"nebel\": 1, \"fog\": [{\"shape\": {\"type\": \"world\"}, \"mean_free_path\": [1, 2, 4]}]}", &s[1])
            ->extinction,
        1, .5, .25);
    assert_vector(one("{\"nebel\": 1, \"fog\": [{\"shape\": {\"type\": \"world\"}, \"visibility\": [1, 2, 4], "
                      "\"contrast\": 0.02}]}",
                      &s[2])
                      ->extinction,
                  -log(.02), -log(.02) / 2, -log(.02) / 4);
    for (int i = 0; i < 3; i++) nebel_destroy_scene(s[i]);
}

static void test_albedo_takes_every_phase_function(void **state)
{
    (void)state;
    const char *const phases[] = {"\"isotropic\"", "\"henyey_greenstein\", \"g\": -0.9", "\"rayleigh\"",
                                  "\"cornette_shanks\", \"g\": 0.9", "\"droplets\", \"diameter\": 20"};
    for (size_t i = 0; i < 5; i++) {
        char text[400];
        nebel_scene *scene;
        snprintf(text, sizeof text,
                 VOLUME("\"shape\": {\"type\": \"world\"}, \"albedo\": [0.1, 0.2, 0.3], \"emission\": 2, \"phase\": "
                        "{\"type\": %s}"),
                 phases[i]);
        const nebel_volume_desc *volume = one(text, &scene);
        assert_vector(volume->albedo, .1, .2, .3);
        assert_vector(volume->emission, 2, 2, 2);
        nebel_destroy_scene(scene);
    }
}

static void test_operations_priorities_and_distances_are_read(void **state)
{
    (void)state;
    nebel_scene *scene = parse_good(
        "{\"nebel\": 1, \"unit\": 0.5, \"fog\": [{\"shape\": {\"type\": \"world\"}, \"extinction\": 0.1}, "
        "{\"operation\": \"replace\", \"start\": 4, \"cutoff\": 18, \"priority\": 3, \"extinction\": 0.2, \"shape\": "
        "{\"type\": \"sphere\", \"center\": [0, 0, 0], \"radius\": 2}}, "
        "{\"operation\": \"exclude\", \"priority\": -4, \"shape\": {\"type\": \"world\"}}]}");
    const nebel_volume_desc *const volumes = nebel_get_scene_data(scene)->volumes;
    assert_int_equal(volumes[0].operation, NEBEL_OPERATION_ADD);
    assert_int_equal(volumes[0].priority, 0);
    assert_int_equal(volumes[1].operation, NEBEL_OPERATION_REPLACE);
    assert_int_equal(volumes[1].priority, 3);
    assert_number(volumes[1].start, 2);
    assert_number(volumes[1].cutoff, 9);
    assert_number(volumes[0].start + volumes[0].cutoff, 0);
    assert_vector(volumes[1].extinction, .4, .4, .4);
    assert_int_equal(volumes[2].operation, NEBEL_OPERATION_EXCLUDE);
    assert_int_equal(volumes[2].priority, -4);
    nebel_destroy_scene(scene);
}

static void test_the_fog_of_the_scene_answers_rays(void **state)
{
    (void)state;
    nebel_scene *scene = parse_good("{\"nebel\": 1, \"ambient\": 0.5, \"fog\": [{\"shape\": {\"type\": \"world\"}, "
                                    "\"extinction\": 0.1, \"albedo\": 1}, "
                                    "{\"operation\": \"exclude\", \"name\": \"hole\", \"shape\": {\"type\": "
                                    "\"sphere\", \"center\": [0, 0, -5], \"radius\": 1}}]}");
    const nebel_ray ray = {.direction = {0, 0, -1}, .t_max = 10};
    nebel_transfer transfer;
    nebel_lighting *fog = scene_light(scene, 0);
    nebel_destroy_scene(scene);
    const nebel_snapshot *snapshot = nebel_get_lighting_snapshot(fog);
    assert_int_equal(nebel_get_volume_count(snapshot), 2);
    assert_int_equal(nebel_trace(snapshot, &(nebel_trace_desc){.lighting = fog}, 1, &ray, 0, &transfer, 0), NEBEL_OK);
    assert_true(fabs(transfer.transmittance[0] - exp(-.8)) < 1e-12);
    assert_true(fabs(transfer.in_scattering[0] - .5 * (1 - exp(-.8))) < 1e-12);
    nebel_release_lighting(fog);
}

static void test_the_fog_of_the_scene_hides_no_more_than_it_may(void **state)
{
    (void)state;
    nebel_scene *scene = parse_good("{\"nebel\": 1, \"max_opacity\": 0.4, \"fog\": [{\"shape\": {\"type\": \"world\"}, "
                                    "\"extinction\": 0.1, \"source\": 0.5}]}");
    assert_number(nebel_get_scene_data(scene)->max_opacity, .4);
    const nebel_ray ray = {.direction = {0, 0, -1}, .t_max = 10};
    nebel_transfer transfer;
    scene_trace(scene, 0, (nebel_trace_desc){0}, 1, &ray, &transfer);
    nebel_destroy_scene(scene);
    assert_true(fabs(transfer.transmittance[0] - .6) < 1e-12);
    assert_true(fabs(transfer.in_scattering[0] - .5 * .4) < 1e-12);
}

static void test_the_order_of_sections_does_not_matter(void **state)
{
    (void)state;
    nebel_scene *scene = parse_good("{\"fog\": [], \"ambient\": 1, \"models\": [], \"lights\": [], \"nebel\": 1}");
    assert_vector(nebel_get_scene_data(scene)->ambient, 1, 1, 1);
    nebel_destroy_scene(scene);
}

static void test_the_files_of_a_scene_are_named(void **state)
{
    (void)state;
    nebel_scene *scene = NULL;
    static const char text[] = "{\"nebel\": 1, \"fog\": [], \"models\": [{\"file\": \"a/b.obj\"}, {\"heightfield\": "
                               "{\"file\": \"/c.png\", \"size\": [1, 1], \"height\": 1}}]}";
    assert_int_equal(nebel_parse_scene(text, strlen(text), "here/scene.json", &(nebel_scene_desc){0}, &scene),
                     NEBEL_OK);
    const nebel_scene_data *data = nebel_get_scene_data(scene);
    assert_int_equal(data->path_count, 2);
    assert_string_equal(data->paths[0], "here/a/b.obj");
    assert_string_equal(data->paths[1], "/c.png");
    nebel_destroy_scene(scene);
}

/* A quaternion takes every number but 0, and keeps its digits: it is scaled by a power of two. A direction takes 0. */
static void check_number(const char *decimal)
{
    char text[400];
    int exponent;
    const double wanted = frexp(strtod(decimal, NULL), &exponent);
    const char *form = wanted == 0 ? "{\"nebel\": 1, \"fog\": [], \"camera\": {\"up\": [%s, 1, 0]}}"
                                   : "{\"nebel\": 1, \"fog\": [{\"extinction\": 1, \"shape\": {\"type\": \"world\", "
                                     "\"transform\": {\"rotation\": [%s, 0, 0, 0]}}}]}";
    snprintf(text, sizeof text, form, decimal);
    nebel_scene *scene = parse_good(text);
    const nebel_scene_data *data = nebel_get_scene_data(scene);
    const double got = wanted == 0 ? data->camera.up[0] : data->volumes[0].shape.transform.rotation[0];
    if (memcmp(&got, &wanted, sizeof got) != 0) fail_msg("%s was read as %.17g", decimal, got);
    nebel_destroy_scene(scene);
}

static void test_numbers_are_read_exactly(void **state)
{
    (void)state;
    const char *const hard[] = {"0.1",
                                "1e22",
                                "1e23",
                                "8.5e-1",
                                "123456789012345.6789",
                                "2.2250738585072011e-308",
                                "4.9e-324",
                                "2.4703282292062328e-324",
                                "1.7976931348623157e308",
                                "9007199254740993",
                                "0.000001e6",
                                "5E+0",
                                "6929495644600919.5",
                                "3.7455744005952583e15",
                                "-0.0",
                                "0.30000000000000004",
                                "1e-400",
                                "1.00000000000000011102230246251565404236316680908203125",
                                "1.00000000000000011102230246251565404236316680908203124"};
    uint64_t seed = 1;
    for (int i = 0; i < 20000; i++) {
        char number[40];
        double value;
        seed = seed * 6364136223846793005u + 1442695040888963407u;
        uint64_t bits = seed ^ seed >> 29;
        if (i % 2 == 0) bits = (bits & 0x800FFFFFFFFFFFFFu) | (uint64_t)(1023 - 40 + i % 80) << 52;
        memcpy(&value, &bits, 8);
        if (!isfinite(value)) continue;
        snprintf(number, sizeof number, "%.*g", 1 + i % 17, value);
        const char *decimal = (size_t)i < sizeof hard / sizeof *hard ? hard[i] : number;
        if (!isfinite(strtod(decimal, NULL))) continue;
        check_number(decimal);
    }
}

static void test_the_libraries_are_named(void **state)
{
    (void)state;
    const char *text = nebel_scene_libraries();
    for (size_t i = 0; i < 5; i++)
        assert_non_null(strstr(
            text, (const char *const[]){"Assimp 5", "libpng 1.", "OpenEXR 3.", "yajl 2.", "libjpeg-turbo 2."}[i]));
}

static void test_a_nebula_is_fog(void **state)
{
    (void)state;
    nebel_scene *scene = NULL;
    nebel_snapshot *fog = NULL;
    nebel_particle *particles = NULL;
    static const char text[] =
        "{\"nebel\": 1, \"fog\": [{\"shape\": {\"type\": \"world\"}, \"extinction\": 1}], \"nebula\": [{\"name\": "
        "\"a\", "
        "\"shape\": {\"type\": \"sphere\", \"center\": [0, 0, 0], \"radius\": 2}, \"count\": 70, \"emission\": 1, "
        "\"colors\": [[1, 0, 0], [0, 0, 1]], \"profile\": \"uniform\"}, "
        "{\"shape\": {\"type\": \"box\", \"min\": [5, 5, 5], \"max\": [6, 6, 6]}, \"seed\": 3, \"count\": 30}]}";
    assert_int_equal(nebel_parse_scene(text, sizeof text - 1, "nebula", &(nebel_scene_desc){0}, &scene), NEBEL_OK);
    const nebel_scene_data *data = nebel_get_scene_data(scene);
    assert_int_equal(data->nebula_count, 2);
    assert_int_equal(data->particle_count, 100);
    assert_string_equal(data->nebula_names[0], "a");
    assert_int_equal(nebel_generate_scene_particles(scene, &particles), NEBEL_OK);
    assert_int_equal(particles[69].profile, NEBEL_PARTICLE_UNIFORM);
    assert_int_equal(particles[70].profile, NEBEL_PARTICLE_SOFT);
    assert_true(particles[70].center[0] > 5);
    nebel_free_scene_particles(scene, particles);
    assert_int_equal(nebel_commit_scene_fog(scene, &fog), NEBEL_OK);
    assert_int_equal(nebel_get_volume_count(fog), 101);
    nebel_release_snapshot(fog);
    nebel_destroy_scene(scene);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_the_example_of_the_contract),
        cmocka_unit_test(test_what_is_absent_has_its_default),
        cmocka_unit_test(test_a_camera_without_look_at_looks_along_minus_z),
        cmocka_unit_test(test_colors_with_a_hash_are_srgb),
        cmocka_unit_test(test_all_simple_shapes),
        cmocka_unit_test(test_shapes_are_made_of_shapes),
        cmocka_unit_test(test_all_densities),
        cmocka_unit_test(test_altitudes),
        cmocka_unit_test(test_all_amounts),
        cmocka_unit_test(test_albedo_takes_every_phase_function),
        cmocka_unit_test(test_operations_priorities_and_distances_are_read),
        cmocka_unit_test(test_the_fog_of_the_scene_answers_rays),
        cmocka_unit_test(test_the_fog_of_the_scene_hides_no_more_than_it_may),
        cmocka_unit_test(test_the_order_of_sections_does_not_matter),
        cmocka_unit_test(test_the_files_of_a_scene_are_named),
        cmocka_unit_test(test_numbers_are_read_exactly),
        cmocka_unit_test(test_the_libraries_are_named),
        cmocka_unit_test(test_a_nebula_is_fog),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
