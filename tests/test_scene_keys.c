/* Fog that moves from key to key. */
#include "near.h"
#include "scene_help.h"

#include <math.h>

#define FOG(members) "{\"nebel\": 1, \"fog\": [{" members "}]}"
#define BALL "\"shape\": {\"type\": \"sphere\", \"center\": [0, 0, 0], \"radius\": 2}"

/* ---- between keys ---------------------------------------------------------------------------- */

static void test_what_a_key_leaves_out_it_takes_from_the_volume(void **state)
{
    (void)state;
    nebel_scene *scene = parse_good(FOG(
        BALL ", \"visibility\": 30, \"source\": [1, 2, 3], \"density\": {\"type\": \"height\", \"scale_height\": 4},"
             "\"keys\": [{\"frame\": 10, \"shape\": {\"radius\": 4}}, {\"frame\": 20, \"source\": \"#fff\", "
             "\"visibility\": 15, "
             "\"density\": {\"base\": 7}, \"shape\": {\"transform\": {\"scale\": 3}}}]"));
    assert_int_equal(nebel_get_scene_data(scene)->animated_volume_count, 1);
    assert_int_equal(nebel_get_volume_origin(scene, 0), NEBEL_VOLUME_ANIMATED);
    const nebel_volume_desc first = nebel_get_scene_volume(scene, 0, 10), last = nebel_get_scene_volume(scene, 0, 20);
    assert_number(first.shape.radius, 4);
    assert_vector(first.source, 1, 2, 3);
    assert_number(first.extinction[1], -log(.05) / 30);
    assert_number(last.shape.radius, 2);
    assert_vector(last.source, 1, 1, 1);
    assert_number(last.extinction[1], -log(.05) / 15);
    assert_number(last.density.base, 7);
    assert_number(last.density.scale_height, 4);
    assert_vector(last.shape.transform.scale, 3, 3, 3);
    const nebel_volume_desc before = nebel_get_scene_volume(scene, 0, -1e9),
                            after = nebel_get_scene_volume(scene, 0, HUGE_VAL);
    assert_number(before.shape.radius, 4);
    assert_number(after.shape.radius, 2);
    assert_number(nebel_get_scene_volume(scene, 0, (double)NAN).shape.radius, 4);
    assert_number(nebel_get_scene_data(scene)->volumes[0].shape.radius, 4);
    const nebel_volume_desc middle = nebel_get_scene_volume(scene, 0, 15);
    assert_number(middle.shape.radius, 3);
    assert_vector(middle.source, 1, 1.5, 2);
    nebel_destroy_scene(scene);
}

/* The slope at the middle key is the parabola's, 0.2 per frame; at the first and the last it is 0. */
static void test_places_follow_a_cubic(void **state)
{
    (void)state;
    nebel_scene *scene = parse_good(
        FOG(BALL ", \"extinction\": 1, \"keys\": [{\"frame\": 0}, {\"frame\": 10, \"shape\": {\"center\": [1, 0, 0]}}, "
                 "{\"frame\": 20, \"shape\": {\"center\": [4, 0, 0]}}]"));
    assert_vector(nebel_get_scene_volume(scene, 0, 5).shape.center, .25, 0, 0);
    assert_vector(nebel_get_scene_volume(scene, 0, 10).shape.center, 1, 0, 0);
    assert_vector(nebel_get_scene_volume(scene, 0, 15).shape.center, 2.75, 0, 0);
    nebel_destroy_scene(scene);
}

static void test_amounts_stay_within_their_keys(void **state)
{
    (void)state;
    nebel_scene *scene = parse_good(
        FOG(BALL
            ", \"extinction\": 0, \"emission\": 1, \"keys\": [{\"frame\": 0, \"extinction\": 0.1}, {\"frame\": 1, "
            "\"extinction\": 5},"
            "{\"frame\": 9, \"extinction\": 0, \"shape\": {\"radius\": 1e-3}}, {\"frame\": 10, \"extinction\": 0.2}]"));
    const double keys[4][2] = {{0, .1}, {1, 5}, {9, 0}, {10, .2}};
    for (int k = 0; k < 3; k++)
        for (int i = 0; i <= 1000; i++) {
            const double frame = keys[k][0] + (keys[k + 1][0] - keys[k][0]) * i / 1000;
            const nebel_volume_desc volume = nebel_get_scene_volume(scene, 0, frame);
            assert_true(volume.extinction[0] >= fmin(keys[k][1], keys[k + 1][1]));
            assert_true(volume.extinction[0] <= fmax(keys[k][1], keys[k + 1][1]));
            assert_true(volume.shape.radius >= 1e-3 && volume.shape.radius <= 2);
        }
    nebel_destroy_scene(scene);
}

/* Boxes that jump about, flip their proportions, and are thin. */
static void test_a_box_never_turns_inside_out(void **state)
{
    (void)state;
    nebel_scene *scene = parse_good(
        FOG("\"shape\": {\"type\": \"box\", \"min\": [0, 0, 0], \"max\": [1, 1, 1]}, \"extinction\": 1, \"keys\": ["
            "{\"frame\": 0, \"shape\": {\"min\": [-1e-6, 0, 0], \"max\": [0, 100, 1]}},"
            "{\"frame\": 1, \"shape\": {\"min\": [100, 0, 0], \"max\": [100.000001, 1e-3, 1]}},"
            "{\"frame\": 3, \"shape\": {\"min\": [-100, 50, 0], \"max\": [-99, 50.001, 1]}}, {\"frame\": 4}]"));
    for (int i = 0; i <= 4000; i++) {
        const nebel_volume_desc volume = nebel_get_scene_volume(scene, 0, i / 1000.0);
        for (int k = 0; k < 3; k++) assert_true(volume.shape.min[k] < volume.shape.max[k]);
    }
    assert_vector(nebel_get_scene_volume(scene, 0, 1).shape.max, 100.000001, 1e-3, 1);
    nebel_destroy_scene(scene);
}

static double half_angle(const nebel_volume_desc *volume)
{
    const double *q = volume->shape.transform.rotation;
    return atan2(q[1], q[3]);
}

static void test_rotations_go_the_shorter_way(void **state)
{
    (void)state;
    nebel_scene *scene = parse_good(FOG(
        BALL ", \"extinction\": 1, \"keys\": [{\"frame\": 0, \"shape\": {\"transform\": {\"rotation\": [0, 0, 0, 1]}}},"
             "{\"frame\": 2, \"shape\": {\"transform\": {\"rotation\": [0, -0.5, 0, -0.8660254037844386]}}},"
             "{\"frame\": 3, \"shape\": {\"transform\": {\"rotation\": [0, 0.5, 0, 0.8660254037844386]}}}]"));
    const nebel_volume_desc middle = nebel_get_scene_volume(scene, 0, 1), still = nebel_get_scene_volume(scene, 0, 2.5);
    const double angle = half_angle(&middle);
    assert_true(angle > .2 && angle < .35);
    const double *q = still.shape.transform.rotation;
    assert_true(fabs(fabs(q[1] / q[3]) - tan(3.14159265358979 / 6)) < .02);
    nebel_destroy_scene(scene);
}

/* Half way the cubic has no direction, or both ends at one place. */
static void test_what_would_vanish_keeps_the_nearer_key(void **state)
{
    (void)state;
    nebel_scene *scene = parse_good(
        "{\"nebel\": 1, \"fog\": [{\"extinction\": 1, \"shape\": {\"type\": \"half_space\", \"point\": [0, 0, 0], "
        "\"normal\": [0, 5, 0]}, "
        "\"keys\": [{\"frame\": 0}, {\"frame\": 2, \"shape\": {\"normal\": [0, -0.1, 0]}}]},"
        "{\"extinction\": 1, \"shape\": {\"type\": \"cylinder\", \"from\": [-1, 0, 0], \"to\": [1, 0, 0], \"radius\": "
        "1}, \"keys\": ["
        "{\"frame\": 0}, {\"frame\": 2, \"shape\": {\"from\": [1, 0, 0], \"to\": [-1, 0, 0]}}]},"
        "{\"extinction\": 1, \"shape\": {\"type\": \"world\"}, \"density\": {\"type\": \"linear\", \"from\": [-1, 0, "
        "0], \"to\": [1, 0, 0]}, "
        "\"keys\": [{\"frame\": 0}, {\"frame\": 2, \"density\": {\"from\": [1, 0, 0], \"to\": [-1, 0, 0]}}]}]}");
    assert_vector(nebel_get_scene_volume(scene, 0, 1).shape.normal, 0, -.1, 0);
    const nebel_volume_desc tube = nebel_get_scene_volume(scene, 1, 1), ramp = nebel_get_scene_volume(scene, 2, 1);
    assert_vector(tube.shape.from, 0, 0, 0);
    assert_vector(tube.shape.to, -2, 0, 0);
    assert_vector(ramp.density.to, -2, 0, 0);
    nebel_snapshot *fog = NULL;
    assert_int_equal(nebel_commit_scene_fog_at(scene, 1, &fog), NEBEL_OK);
    nebel_release_snapshot(fog);
    assert_int_equal(nebel_commit_scene_fog_at(scene, (double)NAN, &fog), NEBEL_ERROR_VALUE);
    assert_int_equal(nebel_commit_scene_volumes_at(scene, HUGE_VAL, &fog), NEBEL_ERROR_VALUE);
    assert_null(fog);
    nebel_destroy_scene(scene);
}

/* ---- snapshots ------------------------------------------------------------------------------- */

static nebel_transfer trace(const nebel_scene *scene, double frame)
{
    const nebel_ray ray = {{-9, .25, .5}, {1, .1, -.05}, 30};
    nebel_transfer transfer;
    scene_trace(scene, frame, (nebel_trace_desc){0}, 1, &ray, &transfer);
    return transfer;
}

static void test_a_snapshot_is_that_of_its_frame(void **state)
{
    (void)state;
    nebel_scene *moving =
        parse_good(FOG(BALL ", \"extinction\": 1, \"source\": 1, \"keys\": [{\"frame\": 4, \"extinction\": 0.25}, "
                            "{\"frame\": 8, \"shape\": {\"center\": [0, 1, 0], \"radius\": 3}}]"));
    nebel_scene *early = parse_good(FOG(BALL ", \"extinction\": 0.25, \"source\": 1"));
    nebel_scene *late = parse_good(FOG(
        "\"extinction\": 1, \"source\": 1, \"shape\": {\"type\": \"sphere\", \"center\": [0, 1, 0], \"radius\": 3}"));
    nebel_scene *middle = parse_good(FOG("\"extinction\": 0.625, \"source\": 1, \"shape\": {\"type\": \"sphere\", "
                                         "\"center\": [0, 0.5, 0], \"radius\": 2.5}"));
    const nebel_scene *still[4] = {early, early, middle, late};
    const double frames[4] = {0, 4, 6, 8};
    for (int i = 0; i < 4; i++) {
        const nebel_transfer got = trace(moving, frames[i]), wanted = trace(still[i], 0);
        assert_true(wanted.transmittance[0] < .9);
        for (int c = 0; c < 3; c++) assert_true(got.transmittance[c] == wanted.transmittance[c]);
        for (int c = 0; c < 3; c++) assert_true(got.in_scattering[c] == wanted.in_scattering[c]);
    }
    nebel_destroy_scene(moving);
    nebel_destroy_scene(early);
    nebel_destroy_scene(late);
    nebel_destroy_scene(middle);
}

static void test_keys_are_in_the_units_of_the_file(void **state)
{
    (void)state;
    nebel_scene *scene = parse_good(
        "{\"nebel\": 1, \"up\": \"z\", \"unit\": 0.5, \"fog\": [{\"extinction\": 1, \"shape\": {\"type\": "
        "\"intersection\", \"shapes\": ["
        "{\"type\": \"convex\", \"planes\": [[0, 0, 2, 6]]}, {\"type\": \"sphere\", \"center\": [1, 2, 3], \"radius\": "
        "8}]}, \"keys\": ["
        "{\"frame\": 0, \"shape\": {\"transform\": {\"position\": [1, 2, 3]}}}, {\"frame\": 1, \"extinction\": 3}]}]}");
    for (int frame = 0; frame < 2; frame++) {
        const nebel_volume_desc volume = nebel_get_scene_volume(scene, 0, frame);
        assert_vector(volume.shape.parts[0].planes[0].normal, 0, 2, 0);
        assert_number(volume.shape.parts[0].planes[0].distance, 3);
        assert_vector(volume.shape.parts[1].center, .5, 1.5, -1);
        assert_number(volume.extinction[0], frame == 0 ? 2 : 6);
        if (frame == 0) assert_vector(volume.shape.transform.position, .5, 1.5, -1);
    }
    nebel_destroy_scene(scene);
}

/* Slopes between them are beyond all numbers. */
static void test_keys_may_all_but_coincide(void **state)
{
    (void)state;
    nebel_scene *scene = parse_good(
        FOG(BALL ", \"extinction\": 1, \"keys\": [{\"frame\": 0}, {\"frame\": 1e-307, \"extinction\": 1e9, \"shape\": "
                 "{\"center\": [1e15, 0, 0]}}, {\"frame\": 2e-307, \"extinction\": 0}, {\"frame\": 3e-307, \"shape\": "
                 "{\"center\": [-1e15, 0, 0]}}, {\"frame\": 1, \"extinction\": 2}]"));
    for (int i = -1; i <= 40; i++) {
        const nebel_volume_desc volume = nebel_get_scene_volume(scene, 0, i * 1e-308);
        assert_true(volume.extinction[0] >= 0 && volume.extinction[0] <= 1e9);
        assert_true(isfinite(volume.shape.center[0]));
    }
    nebel_destroy_scene(scene);
}

/* What a host may hand over. */
static void test_frames_that_are_none(void **state)
{
    (void)state;
    const double odd[] = {(double)NAN, (double)INFINITY, -(double)INFINITY, -1e300, 1e300, 0, 0, -3, 7};
    enum { COUNT = sizeof odd / sizeof *odd };
    nebel_scene *scene = parse_good(FOG(BALL ", \"extinction\": 1"));
    const nebel_volume_desc volume = nebel_get_scene_volume(scene, 0, 0);
    for (int shift = 0; shift < COUNT; shift++) {
        nebel_camera_key cameras[COUNT];
        nebel_sun_key suns[COUNT];
        nebel_volume_key volumes[COUNT];
        for (int i = 0; i < COUNT; i++) {
            const double frame = odd[(i * 4 + shift) % COUNT];
            cameras[i] = (nebel_camera_key){.frame = frame, .camera = nebel_get_scene_data(scene)->camera};
            cameras[i].camera.position[0] = i;
            suns[i] = (nebel_sun_key){.frame = frame, .sun = {.direction = {1, i, 0}, .irradiance = {i, 1, 1}}};
            volumes[i] = (nebel_volume_key){.frame = frame, .volume = volume};
            volumes[i].volume.extinction[0] = i;
        }
        for (int i = 0; i < COUNT; i++) {
            const nebel_camera camera = nebel_interpolate_camera(cameras, COUNT, odd[i]);
            const nebel_sun sun = nebel_interpolate_sun(suns, COUNT, odd[i]);
            const double extinction = nebel_interpolate_volume(volumes, COUNT, odd[i]).extinction[0];
            assert_true(isfinite(camera.position[0]) && isfinite(sun.direction[0]) && isfinite(sun.irradiance[0]));
            assert_true(extinction >= 0 && extinction <= COUNT);
        }
    }
    nebel_destroy_scene(scene);
}

/* Every shape and density with every number it can move; every frame can be had. */
static void test_everything_that_moves_can_be_had(void **state)
{
    (void)state;
    static const char *const shapes[][2] = {
        {"\"type\": \"world\"", "\"transform\": {\"position\": [1, 2, 3], \"rotation\": [1, 2, 3, 4], \"scale\": 2}"},
        {"\"type\": \"half_space\", \"point\": [0, 0, 0], \"normal\": [0, 1, 0]",
         "\"point\": [1, 2, 3], \"normal\": [0, -1, 1e-9]"},
        {"\"type\": \"box\", \"min\": [0, 0, 0], \"max\": [1, 1, 1]", "\"min\": [-9, -9, -9], \"max\": [-8, 7, 100]"},
        {"\"type\": \"sphere\", \"center\": [0, 0, 0], \"radius\": 1", "\"center\": [3, 4, 5], \"radius\": 1e-9"},
        {"\"type\": \"ellipsoid\", \"center\": [0, 0, 0], \"radii\": [1, 2, 3]",
         "\"center\": [3, 4, 5], \"radii\": [3, 1e-3, 1]"},
        {"\"type\": \"cylinder\", \"from\": [0, 0, 0], \"to\": [0, 1, 0], \"radius\": 1",
         "\"from\": [0, 2, 0], \"radius\": 3"},
        {"\"type\": \"capsule\", \"from\": [0, 0, 0], \"to\": [0, 1, 0], \"radius\": 1",
         "\"from\": [0, 1, 0], \"radius\": 3"},
        {"\"type\": \"cone\", \"from\": [0, 0, 0], \"to\": [0, 1, 0], \"radius_from\": 1, \"radius_to\": 0",
         "\"radius_from\": 0, \"radius_to\": 1e-9"},
        {"\"type\": \"convex\", \"planes\": [[1, 0, 0, 1]]", "\"transform\": {\"scale\": [9, 0.1, 1]}"},
        {"\"type\": \"union\", \"shapes\": [{\"type\": \"world\"}]", "\"transform\": {\"position\": [0, 9, 0]}"},
    };
    static const char *const densities[][2] = {
        {"\"type\": \"height\", \"scale_height\": 2", "\"base\": 8, \"scale_height\": 0.01"},
        {"\"type\": \"linear\", \"from\": [0, 0, 0], \"to\": [0, 1, 0]", "\"to\": [0, -3, 0]"},
        {"\"type\": \"gaussian\", \"center\": [0, 0, 0], \"sigma\": 2", "\"center\": [1, 0, 0], \"sigma\": 0.1"},
    };
    for (size_t s = 0; s < sizeof shapes / sizeof *shapes; s++)
        for (size_t d = 0; d < sizeof densities / sizeof *densities; d++) {
            char text[1500];
            snprintf(
                text, sizeof text,
                FOG("\"shape\": {%s}, \"density\": {%s}, \"extinction\": 1, \"albedo\": 0, \"keys\": [{\"frame\": -1}, "
                    "{\"frame\": 0, \"shape\": {%s}, \"density\": {%s}, \"albedo\": 1}, {\"frame\": 7, "
                    "\"mean_free_path\": [1, 2, 3], "
                    "\"emission\": 4}]"),
                shapes[s][0], densities[d][0], shapes[s][1], densities[d][1]);
            nebel_scene *scene = parse_good(text);
            for (int i = -2; i < 60; i++) {
                nebel_release_lighting(scene_light(scene, i * .15));
            }
            nebel_destroy_scene(scene);
        }
}

/* ---- rules ----------------------------------------------------------------------------------- */

#define KEY(members) FOG(BALL ", \"extinction\": 1, \"keys\": [{\"frame\": 0}, " members "]")
#define LIT(members) FOG(BALL ", \"extinction\": 1, \"albedo\": 0.5, \"keys\": [" members "]")
#define BOXED(members)                                                                                                 \
    FOG("\"shape\": {\"type\": \"box\", \"min\": [0, 0, 0], \"max\": [1, 1, 1]}, \"extinction\": 1, \"keys\": "        \
        "[" members "]")
#define TUBE(members)                                                                                                  \
    FOG("\"shape\": {\"type\": \"cylinder\", \"from\": [0, 0, 0], \"to\": [1, 1, 1], \"radius\": 1}, \"extinction\": " \
        "1, "                                                                                                          \
        "\"density\": {\"type\": \"linear\", \"from\": [0, 0, 0], \"to\": [1, 1, 1]}, \"keys\": [" members "]")

static void test_what_no_key_has(void **state)
{
    (void)state;
    const rule rules[] = {
        {FORMAT, FOG(BALL ", \"extinction\": 1, \"keys\": `{}"), "fog[0].keys: is an object; must be an array of keys"},
        {FORMAT, FOG(BALL ", \"extinction\": 1, \"keys\": `[]"), "fog[0].keys: holds no key; give one or more"},
        {FORMAT, FOG(BALL ", \"extinction\": 1, `\"frame\": 1"), "fog[0].frame: unknown key; a volume has: name"},
        {FORMAT, KEY("`{}"), "fog[0].keys[1]: the key \"frame\" is missing; a key of fog needs it"},
        {FORMAT, KEY("`{\"frame\": 0}"),
         "fog[0].keys[1]: its frame 0 is not after the key before it, 0; frames must ascend"},
        {FORMAT, KEY("`{\"frame\": -1}"),
         "fog[0].keys[1]: its frame -1 is not after the key before it, 0; frames must ascend"},
        {FORMAT, KEY("{\"frame\": `1.0000001e9}"), "fog[0].keys[1].frame: is 1000000100; must be"},
        {FORMAT, KEY("{\"frame\": `1e999}"), "fog[0].keys[1].frame: "},
        {FORMAT, KEY("{\"frame\": `NaN}"), "fog[0].keys[1].frame: "},
        {FORMAT, KEY("{\"frame\": 1, `\"name\": \"a\"}"),
         "fog[0].keys[1].name: unknown key; a key of fog has: shape, density"},
        {FORMAT, KEY("{\"frame\": 1, `\"phase\": {}}"), "fog[0].keys[1].phase: unknown key"},
        {FORMAT, KEY("{\"frame\": 1, \"extinction\": `-1}"),
         "fog[0].keys[1].extinction: is -1; must be an amount from 0 to 1e9 per metre"},
        {FORMAT, KEY("{\"frame\": 1, \"extinction\": 1, `\"visibility\": 1}"),
         "fog[0].keys[1].visibility: the amount is given twice"},
        {FORMAT, KEY("{\"frame\": 1, `\"contrast\": 0.1}"), "fog[0].keys[1].contrast: belongs to \"visibility\""},
        {FORMAT, KEY("{\"frame\": 1, `\"albedo\": 0.1}"),
         "fog[0].keys[1].albedo: moves only where the volume itself has"},
        {FORMAT, LIT("{\"frame\": 1, `\"source\": 1}"),
         "fog[0].keys[0].source: does not go with the volume's \"albedo\""},
        {FORMAT, KEY("{\"frame\": 1, \"shape\": {`\"type\": \"box\"}}"),
         "fog[0].keys[1].shape.type: unknown key; a sphere has: transform, center, radius"},
        {FORMAT, KEY("{\"frame\": 1, \"shape\": {\"radius\": `0}}"), "fog[0].keys[1].shape.radius: is 0; must be"},
        {FORMAT, KEY("{\"frame\": 1, `\"density\": {}}"),
         "fog[0].keys[1].density: does not move; a constant density has no"},
        {FORMAT, KEY("`{\"frame\": 1, \"shape\": {\"transform\": {\"scale\": [1, 1, -1]}}}"),
         "fog[0].keys[1]: its scale has another sign"},
        {FORMAT, KEY("{\"frame\": 1, \"shape\": {\"center\": [`1e16, 0, 0]}}"),
         "fog[0].keys[1].shape.center[0]: is 1e+16; must be a coordinate from -1e15 to 1e15 m"},
        {FORMAT, BOXED("{\"frame\": 1, \"shape\": {\"min\": [0, `2, 0]}}"),
         "fog[0].keys[0].shape.min[1]: is 2; must be less than max[1], which is 1"},
        {FORMAT, BOXED("{\"frame\": 1, \"shape\": {\"max\": [1, 1, `0]}}"),
         "fog[0].keys[0].shape.max[2]: is 0; must be greater than min[2]"},
        {FORMAT, TUBE("{\"frame\": 1, \"shape\": {\"from\": `[1, 1, 1]}}"),
         "fog[0].keys[0].shape.from: is the same place as \"to\""},
        {FORMAT, TUBE("{\"frame\": 1, \"density\": {\"from\": `[1, 1, 1]}}"),
         "fog[0].keys[0].density.from: is the same place as \"to\""},
        {FORMAT, TUBE("{\"frame\": 1, \"density\": {`\"type\": \"linear\"}}"),
         "fog[0].keys[0].density.type: unknown key; a linear density has: from, to"},
        {FORMAT, FOG("\"operation\": \"exclude\", " BALL ", \"keys\": [{\"frame\": 1, `\"extinction\": 1}]"),
         "fog[0].keys[0].extinction: unknown key; a key of excluded fog has: shape, frame"},
    };
    CHECK(rules);
}

static void test_every_failing_allocation_is_survived(void **state)
{
    (void)state;
    static const char text[] = KEY("{\"frame\": 1, \"extinction\": 2}");
    parse_without_memory(text);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_what_a_key_leaves_out_it_takes_from_the_volume),
        cmocka_unit_test(test_places_follow_a_cubic),
        cmocka_unit_test(test_amounts_stay_within_their_keys),
        cmocka_unit_test(test_a_box_never_turns_inside_out),
        cmocka_unit_test(test_rotations_go_the_shorter_way),
        cmocka_unit_test(test_what_would_vanish_keeps_the_nearer_key),
        cmocka_unit_test(test_a_snapshot_is_that_of_its_frame),
        cmocka_unit_test(test_keys_are_in_the_units_of_the_file),
        cmocka_unit_test(test_keys_may_all_but_coincide),
        cmocka_unit_test(test_frames_that_are_none),
        cmocka_unit_test(test_everything_that_moves_can_be_had),
        cmocka_unit_test(test_what_no_key_has),
        cmocka_unit_test(test_every_failing_allocation_is_survived),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
