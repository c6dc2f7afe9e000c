/* What the renderer says to input that is wrong, and that nothing is lost on the way out. */
#include "test_render_scene.h"

#include <nebel/planet.h>

typedef struct test_log {
    int messages;
    nebel_result result;
    char text[256];
} test_log;

static void write_log(nebel_log_level level, nebel_result result, const char *message, void *user)
{
    test_log *log = user;
    (void)level;
    log->messages++;
    log->result = result;
    strncpy(log->text, message, sizeof log->text - 1);
}

/* ---- descriptions ---------------------------------------------------------------------------- */

static void assert_not_created(const nebel_scene_data *scene, const nebel_cpu_renderer_desc *desc,
                               nebel_result expected)
{
    test_log log = {0};
    nebel_cpu_renderer_desc logged = *desc;
    logged.host.log = (nebel_log){write_log, &log};
    nebel_renderer *renderer = (nebel_renderer *)&log;
    assert_int_equal(nebel_create_cpu_renderer(scene, NULL, &logged, &renderer), expected);
    assert_null(renderer);
    assert_int_equal(log.messages, 1);
    assert_int_equal(log.result, expected);
}

static void *no_memory(size_t size, void *user)
{
    (void)size;
    (void)user;
    return NULL;
}

static void test_bad_renderer_descriptions(void **state)
{
    (void)state;
    const nebel_scene_data scene = {0};
    nebel_renderer *renderer = NULL;
    assert_int_equal(nebel_create_cpu_renderer(&scene, NULL, NULL, &renderer), NEBEL_ERROR_ARGUMENT);
    assert_int_equal(nebel_create_cpu_renderer(&scene, NULL, &(nebel_cpu_renderer_desc){0}, NULL),
                     NEBEL_ERROR_ARGUMENT);
    assert_not_created(NULL, &(nebel_cpu_renderer_desc){0}, NEBEL_ERROR_ARGUMENT);
    assert_not_created(&scene, &(nebel_cpu_renderer_desc){.thread_count = -1}, NEBEL_ERROR_ARGUMENT);
    assert_not_created(&scene, &(nebel_cpu_renderer_desc){.thread_count = 1000000}, NEBEL_ERROR_ARGUMENT);
    assert_not_created(&scene, &(nebel_cpu_renderer_desc){.isa = (nebel_isa)99}, NEBEL_ERROR_UNSUPPORTED);
    assert_not_created(&scene, &(nebel_cpu_renderer_desc){.host.allocator = {.allocate = no_memory}},
                       NEBEL_ERROR_ARGUMENT);
    nebel_destroy_renderer(NULL);
}

static void assert_bad_mesh(const nebel_mesh *mesh, nebel_result expected)
{
    const nebel_scene_data scene = {.mesh_count = 1, .meshes = mesh};
    assert_not_created(&scene, &(nebel_cpu_renderer_desc){.thread_count = 1}, expected);
}

static void test_bad_meshes(void **state)
{
    (void)state;
    nebel_mesh mesh = test_square();
    mesh.positions = NULL;
    assert_bad_mesh(&mesh, NEBEL_ERROR_ARGUMENT);
    mesh = test_square();
    mesh.indices = NULL;
    assert_bad_mesh(&mesh, NEBEL_ERROR_ARGUMENT);
    mesh = test_square();
    mesh.vertex_count = 3;
    assert_bad_mesh(&mesh, NEBEL_ERROR_ARGUMENT);
    mesh = test_square();
    mesh.texture = 0;
    assert_bad_mesh(&mesh, NEBEL_ERROR_ARGUMENT);
    mesh = test_square();
    mesh.origin[1] = (double)NAN;
    assert_bad_mesh(&mesh, NEBEL_ERROR_VALUE);
    mesh = test_square();
    mesh.base_color[2] = INFINITY;
    assert_bad_mesh(&mesh, NEBEL_ERROR_VALUE);
    const nebel_texture texture = {.width = 1, .height = 0};
    const nebel_scene_data scene = {.texture_count = 1, .textures = &texture};
    assert_not_created(&scene, &(nebel_cpu_renderer_desc){.thread_count = 1}, NEBEL_ERROR_ARGUMENT);
}

static nebel_frame_desc good_frame(void)
{
    return (nebel_frame_desc){.camera = test_camera(0, 2, 5, 0, 0, 0), .width = 8, .height = 8, .samples = 1};
}

static void assert_bad_frame(const nebel_scene_data *scene, const nebel_frame_desc *frame)
{
    test_log log = {0};
    nebel_renderer *renderer = NULL;
    const nebel_cpu_renderer_desc desc = {.thread_count = 1, .host.log = {write_log, &log}};
    assert_int_equal(nebel_create_cpu_renderer(scene, NULL, &desc, &renderer), NEBEL_OK);
    assert_int_equal(nebel_render_frame(renderer, frame, &(nebel_frame){0}), NEBEL_ERROR_VALUE);
    assert_int_equal(log.messages, 1);
    nebel_destroy_renderer(renderer);
}

static void test_bad_frames(void **state)
{
    (void)state;
    const nebel_scene_data scene = {0};
    nebel_frame_desc frames[18];
    for (int i = 0; i < 18; i++) frames[i] = good_frame();
    frames[16].time = (double)NAN;
    frames[17].time = -2e12;
    frames[0].width = 0;
    frames[1].height = 32769;
    frames[2].samples = 4097;
    frames[3].tolerance = -1;
    frames[4].tolerance = (double)NAN;
    frames[5].camera.position[0] = (double)NAN;
    frames[6].camera.look_at[1] = HUGE_VAL;
    memcpy(frames[7].camera.look_at, frames[7].camera.position, sizeof frames[7].camera.look_at);
    frames[8].camera.up[1] = 0;
    frames[9].camera.vertical_fov = 0;
    frames[10].camera.vertical_fov = 180;
    frames[11].camera.vertical_fov = (double)NAN;
    frames[12].camera.projection = NEBEL_PROJECTION_ORTHOGRAPHIC;
    frames[12].camera.view_height = 0;
    frames[13].camera.projection = NEBEL_PROJECTION_ORTHOGRAPHIC;
    frames[13].camera.view_height = HUGE_VAL;
    frames[14].camera.projection = (nebel_projection)7;
    frames[15].camera.up[2] = (double)NAN;
    for (int i = 0; i < 18; i++) assert_bad_frame(&scene, &frames[i]);
    const nebel_frame_desc good = good_frame();
    assert_bad_frame(&(nebel_scene_data){.background = {-1, 0, 0}}, &good);
    assert_bad_frame(&(nebel_scene_data){.ambient = {0, (double)NAN, 0}}, &good);
    assert_bad_frame(&(nebel_scene_data){.has_sun = 1, .sun_irradiance = {1, 1, 1}}, &good);
    assert_bad_frame(&(nebel_scene_data){.has_sun = 1, .sun_irradiance = {HUGE_VAL, 1, 1}, .sun_direction = {0, 1, 0}},
                     &good);
}

/* Clouds have moved by it, shells of layers have turned. */
static void test_times_of_planets_are_numbers(void **state)
{
    (void)state;
    static const double bad[] = {(double)NAN, HUGE_VAL, -HUGE_VAL, 2e12};
    nebel_planet cloudy = {.atmosphere_desc = *nebel_lookup_atmosphere("earth")};
    nebel_planet layered = {.model = NEBEL_PLANET_TEXTURED, .textured_desc = {.cloud_shell_count = 1}};
    nebel_atmosphere *air;
    nebel_clouds *clouds;
    nebel_textured_planet *layers;
    assert_int_equal(nebel_create_atmosphere(&cloudy.atmosphere_desc, &air), NEBEL_OK);
    const nebel_clouds_desc desc = {.atmosphere = air, .layer_count = 1};
    assert_int_equal(nebel_create_clouds(&desc, &clouds), NEBEL_OK);
    assert_int_equal(nebel_create_textured_planet(&layered.textured_desc, &layers), NEBEL_OK);
    cloudy.atmosphere = air;
    cloudy.clouds = clouds;
    layered.textured = layers;
    for (int i = 0; i < 4; i++) {
        nebel_frame_desc frame = good_frame();
        frame.time = bad[i];
        assert_bad_frame(&(nebel_scene_data){.planet_count = 1, .planets = &cloudy}, &frame);
        assert_bad_frame(&(nebel_scene_data){.planet_count = 1, .planets = &layered}, &frame);
    }
    nebel_destroy_textured_planet(layers);
    nebel_destroy_clouds(clouds);
    nebel_destroy_atmosphere(air);
}

static void test_missing_arguments_of_a_frame(void **state)
{
    (void)state;
    const nebel_scene_data scene = {0};
    const nebel_frame_desc frame = good_frame();
    nebel_renderer *renderer = NULL;
    assert_int_equal(nebel_create_cpu_renderer(&scene, NULL, &(nebel_cpu_renderer_desc){0}, &renderer), NEBEL_OK);
    assert_int_equal(nebel_render_frame(NULL, &frame, &(nebel_frame){0}), NEBEL_ERROR_ARGUMENT);
    assert_int_equal(nebel_render_frame(renderer, NULL, &(nebel_frame){0}), NEBEL_ERROR_ARGUMENT);
    assert_int_equal(nebel_render_frame(renderer, &frame, NULL), NEBEL_ERROR_ARGUMENT);
    assert_int_equal(nebel_render_frame(renderer, &frame, &(nebel_frame){0}), NEBEL_OK);
    nebel_destroy_renderer(renderer);
}

/* Cameras and coordinates of any size give a picture without a NaN. */
static void test_extreme_coordinates_give_numbers(void **state)
{
    (void)state;
    static test_ball ball;
    test_ball_make(&ball, (const double[3]){0, 0, 0});
    const double distances[4] = {1e-30, 1e12, 1e25, 1e300};
    test_picture picture = test_picture_make(16, 16);
    for (int i = 0; i < 12; i++) {
        const double d = distances[i % 4];
        nebel_camera camera = test_camera(d, .5 * d, .3 * d, 0, 0, 0);
        camera.projection = (nebel_projection)(i / 4);
        camera.view_height = d;
        test_render(&ball.scene, NULL, &(nebel_cpu_renderer_desc){.thread_count = 1}, &camera, 2, &picture);
        for (int k = 0; k < 16 * 16 * 3; k++) assert_true(isfinite(picture.planes.color[k]));
    }
    test_picture_free(&picture);
}

static void test_light_without_end_is_an_error(void **state)
{
    (void)state;
    const nebel_scene_data scene = {0};
    nebel_lighting *fog = test_fog(1, &(nebel_volume_desc){.emission = {1, 1, 1}});
    test_log log = {0};
    nebel_renderer *renderer = NULL;
    const nebel_cpu_renderer_desc desc = {.thread_count = 2, .host.log = {write_log, &log}};
    assert_int_equal(nebel_create_cpu_renderer(&scene, fog, &desc, &renderer), NEBEL_OK);
    const nebel_frame_desc frame = good_frame();
    assert_int_equal(nebel_render_frame(renderer, &frame, &(nebel_frame){0}), NEBEL_ERROR_UNBOUNDED);
    assert_int_equal(log.messages, 1);
    nebel_destroy_renderer(renderer);
    nebel_release_lighting(fog);
}

/* ---- progress -------------------------------------------------------------------------------- */

typedef struct test_progress {
    size_t calls, last, total, stop_at;
} test_progress;

static int follow_progress(size_t done, size_t total, void *user)
{
    test_progress *progress = user;
    assert_true(done > progress->last && done <= total);
    progress->calls++;
    progress->last = done;
    progress->total = total;
    return progress->stop_at != 0 && done >= progress->stop_at;
}

static void test_progress_rises_and_ends(void **state)
{
    (void)state;
    const nebel_scene_data scene = {0};
    nebel_renderer *renderer = NULL;
    assert_int_equal(nebel_create_cpu_renderer(&scene, NULL, &(nebel_cpu_renderer_desc){.thread_count = 3}, &renderer),
                     NEBEL_OK);
    test_progress progress = {0};
    nebel_frame_desc frame = good_frame();
    frame.width = frame.height = 1500;
    frame.progress = follow_progress;
    frame.progress_user = &progress;
    assert_int_equal(nebel_render_frame(renderer, &frame, &(nebel_frame){0}), NEBEL_OK);
    assert_int_equal(progress.last, progress.total);
    assert_in_range(progress.calls, 50, 101);
    progress = (test_progress){.stop_at = 10};
    assert_int_equal(nebel_render_frame(renderer, &frame, &(nebel_frame){0}), NEBEL_ERROR_CANCELLED);
    assert_true(progress.last < progress.total);
    nebel_destroy_renderer(renderer);
}

/* ---- memory ---------------------------------------------------------------------------------- */

typedef struct test_memory {
    int live, countdown;
} test_memory;

static void *counted_allocate(size_t size, void *user)
{
    test_memory *memory = user;
    if (memory->countdown-- == 0) return NULL;
    memory->live++;
    return malloc(size);
}

static void counted_release(void *pointer, void *user)
{
    ((test_memory *)user)->live--;
    free(pointer);
}

static void test_every_allocation_may_fail(void **state)
{
    (void)state;
    static test_ball ball;
    test_ball_make(&ball, (const double[3]){0, 0, 0});
    const nebel_frame_desc frame = good_frame();
    nebel_result result = NEBEL_ERROR_MEMORY;
    int k = 0;
    for (; result != NEBEL_OK && k < 100; k++) {
        test_memory memory = {.countdown = k};
        const nebel_cpu_renderer_desc desc = {.thread_count = 1,
                                              .host.allocator = {counted_allocate, counted_release, &memory}};
        nebel_renderer *renderer = NULL;
        result = nebel_create_cpu_renderer(&ball.scene, NULL, &desc, &renderer);
        if (result == NEBEL_OK) result = nebel_render_frame(renderer, &frame, &(nebel_frame){0});
        if (result != NEBEL_OK) assert_int_equal(result, NEBEL_ERROR_MEMORY);
        nebel_destroy_renderer(renderer);
        assert_int_equal(memory.live, 0);
    }
    assert_in_range(k, 4, 99);
}

static void test_libraries_are_named(void **state)
{
    (void)state;
    assert_non_null(strstr(nebel_cpu_libraries(), "Embree 3."));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_bad_renderer_descriptions),
        cmocka_unit_test(test_bad_meshes),
        cmocka_unit_test(test_bad_frames),
        cmocka_unit_test(test_times_of_planets_are_numbers),
        cmocka_unit_test(test_missing_arguments_of_a_frame),
        cmocka_unit_test(test_extreme_coordinates_give_numbers),
        cmocka_unit_test(test_light_without_end_is_an_error),
        cmocka_unit_test(test_progress_rises_and_ends),
        cmocka_unit_test(test_every_allocation_may_fail),
        cmocka_unit_test(test_libraries_are_named),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
