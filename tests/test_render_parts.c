/* Parts of a picture, windows and samples: the same pixels as in the whole, and no others. */
#include "test_render_scene.h"

enum { WIDTH = 200, HEIGHT = 150, PLANES = 7 };

/* Beyond the last pixel of a plane, which nobody may write. */
static const float guard = -12345;

static const size_t channels[PLANES] = {3, 3, 3, 1, 3, 1, 3};

typedef struct test_planes {
    uint32_t width, height;
    float *planes[PLANES];
} test_planes;

static test_planes make_planes(uint32_t width, uint32_t height)
{
    test_planes made = {width, height, {NULL}};
    for (size_t p = 0; p < PLANES; p++) {
        const size_t count = (size_t)width * height * channels[p];
        made.planes[p] = calloc(count + 1, sizeof(float));
        assert_non_null(made.planes[p]);
        made.planes[p][count] = guard;
    }
    return made;
}

static void free_planes(test_planes *planes)
{
    for (size_t p = 0; p < PLANES; p++) {
        assert_true(planes->planes[p][(size_t)planes->width * planes->height * channels[p]] == guard);
        free(planes->planes[p]);
    }
}

static nebel_frame_desc frame_of(const nebel_camera *camera, uint32_t samples)
{
    return (nebel_frame_desc){.camera = *camera, .width = WIDTH, .height = HEIGHT, .samples = samples, .seed = 3};
}

static nebel_result render_desc(nebel_renderer *renderer, const nebel_frame_desc *desc, const test_planes *to)
{
    const nebel_frame frame = {to->planes[0], to->planes[1], to->planes[2], to->planes[3],
                               to->planes[4], to->planes[5], to->planes[6]};
    return nebel_render_frame(renderer, desc, &frame);
}

static nebel_result render(nebel_renderer *renderer, const nebel_camera *camera, uint32_t samples,
                           const nebel_window *window, const test_planes *to)
{
    nebel_frame_desc desc = frame_of(camera, samples);
    desc.window = *window;
    return render_desc(renderer, &desc, to);
}

static void compare(const test_planes *whole, const test_planes *part, const nebel_window *window)
{
    for (size_t p = 0; p < PLANES; p++)
        for (uint32_t y = 0; y < window->height; y++) {
            const float *row = whole->planes[p] + ((size_t)(window->top + y) * WIDTH + window->left) * channels[p];
            const size_t count = window->width * channels[p];
            assert_memory_equal(row, part->planes[p] + y * count, count * sizeof(float));
        }
}

static void compare_windows(nebel_renderer *renderer, const nebel_camera *camera, uint32_t samples)
{
    static const nebel_window windows[] = {{0, 0, WIDTH, 64},    {0, 64, WIDTH, 64},   {0, 128, WIDTH, HEIGHT - 128},
                                           {64, 64, 64, 64},     {128, 0, 72, HEIGHT}, {192, 128, 8, 22},
                                           {0, 0, WIDTH, HEIGHT}};
    test_planes whole = make_planes(WIDTH, HEIGHT);
    assert_int_equal(render(renderer, camera, samples, &(nebel_window){0}, &whole), NEBEL_OK);
    for (size_t i = 0; i < sizeof windows / sizeof *windows; i++) {
        test_planes part = make_planes(windows[i].width, windows[i].height);
        assert_int_equal(render(renderer, camera, samples, &windows[i], &part), NEBEL_OK);
        compare(&whole, &part, &windows[i]);
        free_planes(&part);
    }
    free_planes(&whole);
}

/* A barrel in a ball of sunlit fog, and fog of a color. */
static nebel_lighting *make_fog(void)
{
    const nebel_volume_desc volumes[] = {
        {.shape = {.type = NEBEL_SHAPE_SPHERE, .radius = 2.5}, .extinction = {.4, .4, .4}, .albedo = {.9, .9, .9}},
        {.extinction = {.02, .03, .05}, .source = {.2, .3, .4}}};
    const nebel_lighting_desc lights = {.sun = {.direction = {cos(.3), 0, -sin(.3)}, .irradiance = {3, 3, 3}}};
    return fog_commit_lit(&(nebel_fog_desc){0}, volumes, 2, &lights);
}

static void test_windows_have_the_pixels_of_the_whole(void **state)
{
    static const nebel_projection projections[] = {NEBEL_PROJECTION_PERSPECTIVE, NEBEL_PROJECTION_ORTHOGRAPHIC,
                                                   NEBEL_PROJECTION_PANORAMA};
    static const nebel_method methods[] = {NEBEL_METHOD_EXACT, NEBEL_METHOD_VERTEX, NEBEL_METHOD_PATH};
    (void)state;
    test_barrel barrel;
    test_barrel_make(&barrel);
    nebel_lighting *fog = make_fog();
    nebel_renderer *renderer = NULL;
    assert_int_equal(nebel_create_cpu_renderer(&barrel.scene, fog, &(nebel_cpu_renderer_desc){0}, &renderer), NEBEL_OK);
    for (size_t m = 0; m < sizeof methods / sizeof *methods; m++) {
        assert_int_equal(nebel_set_renderer_method(renderer, methods[m], NULL), NEBEL_OK);
        for (size_t i = 0; i < sizeof projections / sizeof *projections; i++) {
            nebel_camera camera = test_camera(.5, 1, 6, 0, 0, 0);
            camera.projection = projections[i];
            if (methods[m] != NEBEL_METHOD_PATH || i == 0) compare_windows(renderer, &camera, 2);
        }
    }
    nebel_destroy_renderer(renderer);
    nebel_release_lighting(fog);
}

static void test_windows_that_cut_regions_are_refused(void **state)
{
    static const nebel_window bad[] = {{1, 0, 64, 64},
                                       {0, 32, 64, 64},
                                       {0, 0, 63, 64},
                                       {0, 0, WIDTH, 65},
                                       {0, 0, WIDTH, 0},
                                       {64, 0, 0, 0},
                                       {0, 0, WIDTH + 1, HEIGHT},
                                       {0, 0, 256, 64},
                                       {256, 0, 64, 64},
                                       {0, 192, WIDTH, 64},
                                       {192, 0, UINT32_MAX - 63, 64},
                                       {UINT32_MAX - 63, 0, 64, 64}};
    (void)state;
    const nebel_scene_data scene = {0};
    nebel_lighting *fog = make_fog();
    nebel_renderer *renderer = NULL;
    assert_int_equal(nebel_create_cpu_renderer(&scene, fog, &(nebel_cpu_renderer_desc){0}, &renderer), NEBEL_OK);
    const nebel_camera camera = test_camera(0, 0, 6, 0, 0, 0);
    test_planes whole = make_planes(WIDTH, HEIGHT);
    for (size_t i = 0; i < sizeof bad / sizeof *bad; i++)
        assert_int_equal(render(renderer, &camera, 1, &bad[i], &whole), NEBEL_ERROR_VALUE);
    free_planes(&whole);
    nebel_destroy_renderer(renderer);
    nebel_release_lighting(fog);
}

/* ---- samples --------------------------------------------------------------------------------- */

enum { SAMPLES = 5 };

static void add_sample(const test_planes *one, int is_first, test_planes *sum)
{
    for (size_t p = 0; p < 3; p++)
        for (size_t i = 0; i < (size_t)WIDTH * HEIGHT * 3; i++)
            sum->planes[p][i] = (is_first ? 0 : sum->planes[p][i]) + one->planes[p][i];
}

/* Each sample is what it is among all: their mean is the picture, bit for bit where the renderer adds floats as well.
 * */
static void compare_samples(nebel_renderer *renderer, const nebel_camera *camera)
{
    test_planes whole = make_planes(WIDTH, HEIGHT), one = make_planes(WIDTH, HEIGHT), sum = make_planes(WIDTH, HEIGHT);
    nebel_frame_desc desc = frame_of(camera, SAMPLES);
    assert_int_equal(render_desc(renderer, &desc, &whole), NEBEL_OK);
    desc.sample_count = 1;
    for (desc.first_sample = 0; desc.first_sample < SAMPLES; desc.first_sample++) {
        assert_int_equal(render_desc(renderer, &desc, &one), NEBEL_OK);
        add_sample(&one, desc.first_sample == 0, &sum);
    }
    for (size_t p = 0; p < 3; p++) {
        for (size_t i = 0; i < (size_t)WIDTH * HEIGHT * 3; i++) sum.planes[p][i] *= 1 / (float)SAMPLES;
        assert_memory_equal(sum.planes[p], whole.planes[p], sizeof(float) * WIDTH * HEIGHT * 3);
    }
    free_planes(&whole);
    free_planes(&one);
    free_planes(&sum);
}

static void test_samples_are_the_same_alone(void **state)
{
    (void)state;
    test_barrel barrel;
    test_barrel_make(&barrel);
    nebel_lighting *fog = make_fog();
    nebel_renderer *renderer = NULL;
    assert_int_equal(nebel_create_cpu_renderer(&barrel.scene, fog, &(nebel_cpu_renderer_desc){0}, &renderer), NEBEL_OK);
    const nebel_camera camera = test_camera(.5, 1, 6, 0, 0, 0);
    compare_samples(renderer, &camera);
    test_planes whole = make_planes(WIDTH, HEIGHT);
    static const uint32_t bad[][2] = {{0, 6}, {5, 1}, {4, 2}, {UINT32_MAX, 1}, {1, UINT32_MAX}, {1, 0}};
    for (size_t i = 0; i < sizeof bad / sizeof *bad; i++) {
        nebel_frame_desc desc = frame_of(&camera, SAMPLES);
        desc.first_sample = bad[i][0];
        desc.sample_count = bad[i][1];
        assert_int_equal(render_desc(renderer, &desc, &whole), NEBEL_ERROR_VALUE);
    }
    free_planes(&whole);
    nebel_destroy_renderer(renderer);
    nebel_release_lighting(fog);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_windows_have_the_pixels_of_the_whole),
        cmocka_unit_test(test_windows_that_cut_regions_are_refused),
        cmocka_unit_test(test_samples_are_the_same_alone),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
