/* Example scenes with shafts, point lights and voxels, the exact method at its default tolerance against the reference
 * at one bounce: the root of the mean square of their difference as it is shown. Two pictures of the reference, of
 * other chances, stand in for one without noise: the mean product of the differences from each is that square, without
 * bias. The first argument says how many times more samples than in passing, at most 4096 in all. */
#include "unit.h"

#include <nebel/render.h>
#include <nebel/scene.h>

#include <math.h>
#include <stdlib.h>

enum { WIDTH = 32, HEIGHT = 18, PIXELS = WIDTH * HEIGHT, VALUES = 3 * PIXELS };

static uint32_t samples = 64;

typedef struct picture {
    float values[VALUES];
} picture;

/* As it is shown, 0 to 1. */
static void take(nebel_renderer *renderer, const nebel_scene *scene, nebel_method method, uint32_t seed, picture *shown)
{
    const nebel_frame_desc frame = {.camera = nebel_get_scene_camera(scene, 0),
                                    .width = WIDTH,
                                    .height = HEIGHT,
                                    .samples = samples,
                                    .bounces = 1,
                                    .seed = seed};
    assert_int_equal(nebel_set_renderer_method(renderer, method, NULL), NEBEL_OK);
    assert_int_equal(nebel_render_frame(renderer, &frame, &(nebel_frame){.color = shown->values}), NEBEL_OK);
    nebel_tone_map(PIXELS, shown->values, 0, shown->values);
}

static double mean_product(const picture *exact, const picture *a, const picture *b)
{
    double sum = 0;
    for (size_t i = 0; i < VALUES; i++)
        sum += (double)(exact->values[i] - a->values[i]) * (double)(exact->values[i] - b->values[i]);
    return sum / VALUES;
}

static void compare(const char *name, const char *path)
{
    static picture exact, paths[2];
    nebel_scene *scene = NULL;
    nebel_snapshot *fog = NULL;
    nebel_lighting *lighting = NULL;
    nebel_renderer *renderer = NULL;
    assert_int_equal(nebel_load_scene(path, &(nebel_scene_desc){.host.log = {0}}, &scene), NEBEL_OK);
    assert_int_equal(nebel_load_scene_models(scene), NEBEL_OK);
    assert_int_equal(nebel_commit_scene_fog(scene, &fog), NEBEL_OK);
    assert_int_equal(nebel_create_scene_lighting(scene, fog, 0, NULL, &lighting), NEBEL_OK);
    assert_int_equal(nebel_create_cpu_renderer(nebel_get_scene_data(scene), lighting,
                                               &(nebel_cpu_renderer_desc){.thread_count = 0}, &renderer),
                     NEBEL_OK);
    take(renderer, scene, NEBEL_METHOD_EXACT, 0, &exact);
    for (uint32_t i = 0; i < 2; i++) take(renderer, scene, NEBEL_METHOD_PATH, i + 1, &paths[i]);
    const double noise = mean_product(&paths[0], &paths[1], &paths[1]) / 2;
    const double square = mean_product(&exact, &paths[0], &paths[1]);
    const double deviation = noise / sqrt(PIXELS); /* its channels are made by the same paths */
    print_message("%-12s off by %.2f of 255, known to %.2f\n", name, 255 * copysign(sqrt(fabs(square)), square),
                  255 * sqrt(4 * deviation));
    nebel_destroy_renderer(renderer);
    nebel_release_lighting(lighting);
    nebel_release_snapshot(fog);
    nebel_destroy_scene(scene);
    assert_true(square <= 1 / (255. * 255) + 4 * deviation);
}

#define EXAMPLE(function, name)                                                                                        \
    static void function##_are_those_of_the_reference(void **state)                                                    \
    {                                                                                                                  \
        (void)state;                                                                                                   \
        compare(name, NEBEL_SOURCE "/examples/scenes/" name ".json");                                                  \
    }

EXAMPLE(shafts, "sun-shafts")
EXAMPLE(leaves, "foliage")
EXAMPLE(lights, "street-lamps")
EXAMPLE(voxels, "smoke")
EXAMPLE(wisps, "wisps")

int main(int count, char **words)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(shafts_are_those_of_the_reference), cmocka_unit_test(leaves_are_those_of_the_reference),
        cmocka_unit_test(lights_are_those_of_the_reference), cmocka_unit_test(voxels_are_those_of_the_reference),
        cmocka_unit_test(wisps_are_those_of_the_reference),
    };
    if (count > 1) samples *= (uint32_t)strtoul(words[1], NULL, 10);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
