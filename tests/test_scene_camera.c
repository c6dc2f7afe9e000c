/* Cameras that move. */
#include "scene_help.h"

#include <math.h>

static const double pi = 3.14159265358979323846;

static nebel_scene *with_camera(const char *members)
{
    char text[1000];
    snprintf(text, sizeof text, "{\"nebel\": 1, \"fog\": [], \"camera\": {%s}}", members);
    return parse_good(text);
}

static void assert_near(double got, double wanted)
{
    if (!(fabs(got - wanted) <= 1e-12)) fail_msg("%.17g should be %.17g", got, wanted);
}

static double distance(const double a[3], const double b[3])
{
    return sqrt(pow(a[0] - b[0], 2) + pow(a[1] - b[1], 2) + pow(a[2] - b[2], 2));
}

static void test_a_standing_camera_stands(void **state)
{
    (void)state;
    nebel_scene *scene = with_camera("\"position\": [1, 2, 3]");
    const nebel_camera camera = nebel_get_scene_camera(scene, 17.5);
    assert_memory_equal(&camera, &nebel_get_scene_data(scene)->camera, sizeof camera);
    nebel_destroy_scene(scene);
}

static void test_a_turntable_keeps_its_distance_and_comes_back(void **state)
{
    (void)state;
    nebel_scene *scene = with_camera("\"position\": [3, 5, 8], \"look_at\": [1, 2, 3], \"turntable\": {\"frames\": 8}");
    const nebel_camera start = nebel_get_scene_data(scene)->camera;
    for (int i = 0; i < 16; i++) {
        const nebel_camera now = nebel_get_scene_camera(scene, i);
        const double angle = atan2(now.position[0] - 1, now.position[2] - 3) - atan2(2, 5);
        assert_near(distance(now.position, now.look_at), distance(start.position, start.look_at));
        assert_near(now.position[1], 5);
        assert_near(fabs(remainder(angle - 2 * pi * i / 8, 2 * pi)), 0);
    }
    assert_memory_equal(nebel_get_scene_camera(scene, 24).position, start.position, sizeof start.position);
    assert_memory_equal(nebel_get_scene_camera(scene, (double)NAN).position, start.position, sizeof start.position);
    nebel_destroy_scene(scene);
}

#define KEYS                                                                                                           \
    "\"vertical_fov\": 40, \"keys\": [{\"frame\": 10, \"position\": [0, 0, 0]}, {\"frame\": 20, \"position\": [1, 0, " \
    "0], "                                                                                                             \
    "\"vertical_fov\": 41}, {\"frame\": 50, \"position\": [2, 5, 0], \"vertical_fov\": 170}, {\"frame\": 51, "         \
    "\"position\": "                                                                                                   \
    "[2, 5, 9], \"vertical_fov\": 171}]"

static void test_keys_are_met_and_the_ends_are_still(void **state)
{
    (void)state;
    nebel_scene *scene = with_camera(KEYS);
    const nebel_scene_data *data = nebel_get_scene_data(scene);
    assert_int_equal(data->camera_key_count, 4);
    for (size_t i = 0; i < 4; i++) {
        const nebel_camera now = nebel_get_scene_camera(scene, data->camera_keys[i].frame);
        assert_near(distance(now.position, data->camera_keys[i].camera.position), 0);
        assert_near(now.vertical_fov, data->camera_keys[i].camera.vertical_fov);
    }
    assert_near(nebel_get_scene_camera(scene, -1e9).position[0], 0);
    assert_near(nebel_get_scene_camera(scene, (double)NAN).position[0], 0);
    assert_near(nebel_get_scene_camera(scene, (double)INFINITY).position[2], 9);
    assert_near(nebel_get_scene_camera(scene, 10).vertical_fov, 40);
    nebel_destroy_scene(scene);
}

/* No corner anywhere: the slopes on both sides of each key agree, also where the frames lie unevenly and at the ends.
 */
static void test_the_way_through_the_keys_is_smooth(void **state)
{
    (void)state;
    nebel_scene *scene = with_camera(KEYS);
    const double h = 1e-5;
    for (size_t k = 0; k < 4; k++) {
        const double frame = nebel_get_scene_data(scene)->camera_keys[k].frame;
        const nebel_camera before = nebel_get_scene_camera(scene, frame - h), at = nebel_get_scene_camera(scene, frame),
                           after = nebel_get_scene_camera(scene, frame + h);
        for (int i = 0; i < 3; i++)
            assert_true(fabs((after.position[i] - at.position[i]) - (at.position[i] - before.position[i])) / h < 1e-3);
        assert_true(fabs((after.vertical_fov - at.vertical_fov) - (at.vertical_fov - before.vertical_fov)) / h < 1e-2);
    }
    nebel_destroy_scene(scene);
}

static void test_evenly_spaced_keys_on_a_line_give_even_motion(void **state)
{
    (void)state;
    nebel_scene *scene =
        with_camera("\"keys\": [{\"frame\": 0, \"position\": [0, 0, 0]}, {\"frame\": 1, \"position\": [1, 0, 0]}, "
                    "{\"frame\": 4, \"position\": [4, 0, 0]}, {\"frame\": 5, \"position\": [5, 0, 0]}]");
    for (double frame = 1; frame <= 4; frame += .125)
        assert_near(nebel_get_scene_camera(scene, frame).position[0], frame);
    nebel_destroy_scene(scene);
}

static void test_the_field_of_view_never_leaves_the_range_of_its_keys(void **state)
{
    (void)state;
    nebel_scene *scene = with_camera(KEYS);
    double last = 0;
    for (double frame = 9; frame < 52; frame += .01) {
        const double fov = nebel_get_scene_camera(scene, frame).vertical_fov;
        assert_true(fov >= 40 && fov <= 171 && fov >= last - 1e-12);
        last = fov;
    }
    nebel_destroy_scene(scene);
}

static void test_keys_inherit_from_the_camera(void **state)
{
    (void)state;
    nebel_scene *scene =
        with_camera("\"position\": [7, 7, 7], \"look_at\": [0, 1, 0], \"up\": [1, 0, 0], \"projection\": \"panorama\", "
                    "\"view_height\": 3, \"keys\": [{\"frame\": 1}, {\"frame\": 2, \"position\": [4, 4, 4]}]");
    const nebel_camera_key *keys = nebel_get_scene_data(scene)->camera_keys;
    assert_near(keys[0].camera.position[1], 7);
    assert_near(keys[1].camera.look_at[1], 1);
    assert_near(keys[1].camera.up[0], 1);
    assert_near(keys[1].camera.view_height, 3);
    assert_int_equal(nebel_get_scene_camera(scene, 1.5).projection, NEBEL_PROJECTION_PANORAMA);
    nebel_destroy_scene(scene);
    scene = with_camera("\"position\": [7, 7, 7], \"keys\": [{\"frame\": 2, \"position\": [4, 4, 4]}]");
    assert_near(nebel_get_scene_data(scene)->camera_keys[0].camera.look_at[2], 3);
    nebel_destroy_scene(scene);
}

/* Halfway between these two keys the straight way has look_at on the position. */
static void test_there_is_a_view_between_opposite_keys(void **state)
{
    (void)state;
    nebel_scene *scene = with_camera("\"keys\": [{\"frame\": 0, \"position\": [0, 0, 0], \"look_at\": [0, 0, -1]}, "
                                     "{\"frame\": 1, \"position\": [0, 0, 0], \"look_at\": [0, 0, 1]}]");
    for (double frame = 0; frame <= 1; frame += .0625) {
        const nebel_camera now = nebel_get_scene_camera(scene, frame);
        assert_true(distance(now.position, now.look_at) > 0);
    }
    nebel_destroy_scene(scene);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_a_standing_camera_stands),
        cmocka_unit_test(test_a_turntable_keeps_its_distance_and_comes_back),
        cmocka_unit_test(test_keys_are_met_and_the_ends_are_still),
        cmocka_unit_test(test_the_way_through_the_keys_is_smooth),
        cmocka_unit_test(test_evenly_spaced_keys_on_a_line_give_even_motion),
        cmocka_unit_test(test_the_field_of_view_never_leaves_the_range_of_its_keys),
        cmocka_unit_test(test_keys_inherit_from_the_camera),
        cmocka_unit_test(test_there_is_a_view_between_opposite_keys),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
