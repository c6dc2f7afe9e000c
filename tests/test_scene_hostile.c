/* Scenes that are cut off, scenes without memory, scenes that are no files, scenes that are too large. */
#define _POSIX_C_SOURCE 200809L
#include "scene_help.h"

#include <errno.h>
#include <fcntl.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

/* Holds every kind of section and value. */
static const char rich[] =
    "{\"nebel\":1,/*c*/"
    "\"camera\":{\"position\":[0,2,8],\"keys\":[{\"frame\":0},{\"frame\":9.5,\"position\":[1e1,-2,3.25]}]},\n"
    "\"background\":[0.5,0.6,0.7],\"ambient\":0.25,\"sun\":{\"direction\":[0,3,4],\"irradiance\":[3,2.9,2.7]},"
    "\"lights\":[],\n"
    "\"models\":[{\"file\":\"a/\\u00e4.glb\",\"scale\":[1,2,3],\"rotation\":[0,0,0,1],\"color\":0.5},\n"
    "{\"heightfield\":{\"file\":\"h.png\",\"size\":[4,4],\"height\":2},\"position\":[1,2,3]}],\n"
    "\"fog\":[{\"name\":\"d\xC3\xBCnn\",\"shape\":{\"type\":\"union\",\"shapes\":[{\"type\":\"convex\",\"planes\":[[1,"
    "0,0,1],[0,1,0,2]]},\n"
    "{\"type\":\"sphere\",\"center\":[0,0,0],\"radius\":2,\"transform\":{\"position\":[1,1,1],\"scale\":2}}]},"
    "\"visibility\":[60,70,80],\n"
    "\"contrast\":0.02,\"source\":[0.7,0.7,0.5]},\n"
    "{\"operation\":\"exclude\",\"shape\":{\"type\":\"box\",\"min\":[0,0,0],\"max\":[1,1,1]}},\n"
    "{\"shape\":{\"type\":\"world\"},\"density\":{\"type\":\"height\",\"scale_height\":4},\"mean_free_path\":3,"
    "\"albedo\":0,\n"
    "\"phase\":{\"type\":\"droplets\",\"diameter\":12},\"emission\":1}]}";

static void test_every_truncation_is_an_error_with_a_place(void **state)
{
    (void)state;
    const size_t size = strlen(rich);
    for (size_t cut = 0; cut < size; cut++) {
        meter m;
        journal kept;
        nebel_scene *scene;
        const nebel_scene_desc desc = metered_desc(&m, &kept);
        char *text = malloc(cut + 1); /* of this size, so that reading beyond it is seen */
        memcpy(text, rich, cut);
        assert_int_equal(nebel_parse_scene(text, cut, "t.json", &desc, &scene), NEBEL_ERROR_FORMAT);
        assert_null(scene);
        assert_int_equal(kept.count, 1);
        assert_int_equal(strncmp(kept.last, "t.json:", 7), 0);
        assert_int_equal(m.live, 0);
        free(text);
    }
    nebel_destroy_scene(parse_good(rich));
}

/* Each byte replaced by some others: a scene or an error, and nothing is lost. */
static void test_every_garbled_byte_is_survived(void **state)
{
    (void)state;
    const unsigned char junk[] = {0, '"', '{', '[', ']', '}', ',', '-', '9', '\\', '/', 0x80, 0xFF, 'e'};
    for (size_t at = 0; at < strlen(rich); at++)
        for (size_t j = 0; j < sizeof junk; j++) {
            char text[sizeof rich];
            meter m;
            journal kept;
            nebel_scene *scene;
            const nebel_scene_desc desc = metered_desc(&m, &kept);
            memcpy(text, rich, sizeof rich);
            text[at] = (char)junk[j];
            const nebel_result result = nebel_parse_scene(text, strlen(rich), "t.json", &desc, &scene);
            assert_true((result == NEBEL_OK) == (scene != NULL));
            assert_int_equal(kept.count, result == NEBEL_OK ? 0 : 1);
            nebel_destroy_scene(scene);
            assert_int_equal(m.live, 0);
        }
}

static void test_every_failing_allocation_is_survived(void **state)
{
    (void)state;
    nebel_result result = NEBEL_ERROR_MEMORY;
    long k = 0;
    for (; result != NEBEL_OK; k++) {
        meter m;
        journal kept;
        nebel_scene *scene;
        nebel_snapshot *fog = NULL;
        nebel_lighting *lighting = NULL;
        const nebel_scene_desc desc = metered_desc(&m, &kept);
        m.fail_at = k;
        result = nebel_parse_scene(rich, strlen(rich), "t.json", &desc, &scene);
        if (result == NEBEL_OK) result = nebel_commit_scene_fog(scene, &fog);
        if (result != NEBEL_OK) assert_null(fog);
        if (result == NEBEL_OK) result = nebel_create_scene_lighting(scene, fog, 0, NULL, &lighting);
        if (result != NEBEL_OK) assert_int_equal(result, NEBEL_ERROR_MEMORY);
        if (result != NEBEL_OK) assert_null(lighting);
        nebel_release_lighting(lighting);
        nebel_release_snapshot(fog);
        nebel_destroy_scene(scene);
        assert_int_equal(m.live, 0);
        assert_true(k < 2000);
    }
    assert_true(k > 20);
}

/* Also with many volumes: arrays grow while they are full. */
static void test_growing_without_memory_is_survived(void **state)
{
    (void)state;
    char text[8000] = "{\"nebel\":1,\"fog\":[{\"name\":\"\\t\",\"extinction\":1,\"shape\":{\"type\":\"world\"}}";
    for (int i = 0; i < 40; i++) strcat(text, ",{\"name\":\"\\t\",\"extinction\":1,\"shape\":{\"type\":\"world\"}}");
    strcat(text, "]}");
    parse_without_memory(text);
}

static double seconds(void)
{
    struct timespec now;
    clock_gettime(CLOCK_MONOTONIC, &now);
    return (double)now.tv_sec + 1e-9 * (double)now.tv_nsec;
}

static char *many_volumes(size_t count)
{
    char *text = malloc(150 * count + 100), *at = text;
    at += sprintf(at, "{\"nebel\":1,\"fog\":[");
    for (size_t i = 0; i < count; i++)
        at += sprintf(at,
                      "%s\n{\"name\":\"v\\t%zu\",\"shape\":{\"type\":\"sphere\",\"center\":[%zu.5,0.1,-3],\"radius\":2}"
                      ",\"extinction\":0.1}",
                      i > 0 ? "," : "", i, i);
    sprintf(at, "]}");
    return text;
}

static double time_parse(size_t count)
{
    char *text = many_volumes(count);
    const double start = seconds();
    nebel_scene *scene = parse_good(text);
    const double spent = seconds() - start;
    assert_int_equal(nebel_get_scene_data(scene)->volume_count, count);
    assert_true(nebel_get_scene_data(scene)->volumes[count - 1].shape.center[0] == (double)count - .5);
    nebel_destroy_scene(scene);
    free(text);
    return spent;
}

/* A quadratic reader would need 64 times as long for 8 times as much. */
static void test_many_volumes_take_linear_time(void **state)
{
    (void)state;
    time_parse(5000);
    const double few = time_parse(20000), many = time_parse(160000);
    if (many > 24 * few) fail_msg("20000 volumes took %.3f s, 160000 took %.3f s", few, many);
}

static void test_an_error_far_down_is_found_at_its_line(void **state)
{
    (void)state;
    char *text = many_volumes(3000);
    strcpy(strstr(text, "[2500.5"), "[2500.5,0.1],");
    meter m;
    journal kept;
    nebel_scene *scene;
    const nebel_scene_desc desc = metered_desc(&m, &kept);
    assert_int_equal(nebel_parse_scene(text, strlen(text), "t.json", &desc, &scene), NEBEL_ERROR_FORMAT);
    assert_non_null(strstr(kept.last, "t.json:2502:"));
    free(text);
}

/* ---- files ----------------------------------------------------------------------------------- */

static nebel_result load(const char *path, journal *kept)
{
    meter m;
    nebel_scene *scene;
    const nebel_scene_desc desc = metered_desc(&m, kept);
    const nebel_result result = nebel_load_scene(path, &desc, &scene);
    nebel_destroy_scene(scene);
    assert_int_equal(m.live, 0);
    return result;
}

static void in_folder(char path[200], const char *folder, const char *name)
{
    snprintf(path, 200, "%s/%s", folder, name);
}

static void test_what_is_no_file_is_named_with_the_reason(void **state)
{
    journal kept;
    char path[200];
    assert_int_equal(load("/", &kept), NEBEL_ERROR_FILE);
    assert_string_equal(kept.last, "cannot read the scene \"/\": Is a directory");
    in_folder(path, *state, "none.json");
    assert_int_equal(load(path, &kept), NEBEL_ERROR_FILE);
    assert_non_null(strstr(kept.last, "No such file or directory"));
    assert_int_equal(load("-", &kept), NEBEL_ERROR_FILE);
    assert_int_equal(load("/dev/null", &kept), NEBEL_ERROR_FILE);
    assert_int_equal(load("", &kept), NEBEL_ERROR_FILE);
}

static void test_a_file_without_permission_is_an_error(void **state)
{
    journal kept;
    char path[200];
    in_folder(path, *state, "secret.json");
    FILE *file = fopen(path, "w");
    fclose(file);
    chmod(path, 0);
    if (geteuid() == 0) skip(); /* root may read everything */
    assert_int_equal(load(path, &kept), NEBEL_ERROR_FILE);
    assert_non_null(strstr(kept.last, "Permission denied"));
}

static void test_a_scene_may_come_through_an_open_pipe(void **state)
{
    (void)state;
    journal kept;
    char path[64];
    int ends[2];
    assert_int_equal(pipe(ends), 0);
    const pid_t child = fork();
    if (child == 0) {
        const struct timespec nap = {0, 20000000};
        for (const char *at = rich; *at != '\0'; at += strlen(at) < 300 ? strlen(at) : 300) {
            if (write(ends[1], at, strlen(at) < 300 ? strlen(at) : 300) < 0) quick_exit(1);
            nanosleep(&nap, NULL);
        }
        quick_exit(0);
    }
    close(ends[1]);
    snprintf(path, sizeof path, "/dev/fd/%d", ends[0]);
    assert_int_equal(load(path, &kept), NEBEL_OK);
    close(ends[0]);
    waitpid(child, NULL, 0);
}

static void test_a_pipe_by_its_name_is_not_waited_for(void **state)
{
    journal kept;
    char path[200];
    in_folder(path, *state, "pipe");
    assert_int_equal(mkfifo(path, 0600), 0);
    alarm(10);
    assert_int_equal(load(path, &kept), NEBEL_ERROR_FILE);
    assert_non_null(strstr(kept.last, "it is a device, a pipe or a socket; name a file"));
    assert_int_equal(load("/dev/zero", &kept), NEBEL_ERROR_FILE);
    alarm(0);
}

static void test_relative_paths_start_at_the_scene(void **state)
{
    journal kept = {0};
    char path[200], expected[300];
    in_folder(path, *state, "models.json");
    FILE *file = fopen(path, "w");
    fputs("{\"nebel\": 1, \"fog\": [],\n\"models\": [{\"file\": \"there/is.none\"}]}", file);
    fclose(file);
    nebel_scene *scene;
    const nebel_scene_desc desc = {.host.log = {remember, &kept}};
    assert_int_equal(nebel_load_scene(path, &desc, &scene), NEBEL_OK);
    assert_int_equal(nebel_load_scene_models(scene), NEBEL_ERROR_FILE);
    snprintf(expected, sizeof expected,
             "%s:2:21: models[0].file: cannot read the model \"%s/there/is.none\": No such file or directory", path,
             (char *)*state);
    assert_string_equal(kept.last, expected);
    assert_int_equal(nebel_get_scene_data(scene)->mesh_count, 0);
    nebel_destroy_scene(scene);
}

static void test_maps_start_there_too(void **state)
{
    journal kept = {0};
    char path[200], expected[300];
    in_folder(path, *state, "models.json");
    FILE *file = fopen(path, "w");
    fputs("{\"nebel\": 1, \"fog\": [],\n\"planet\": {\"model\": \"textured\", \"color_map\": \"is/none.png\"}}", file);
    fclose(file);
    snprintf(expected, sizeof expected, "planet.color_map: cannot read the picture \"%s/is/none.png\": No such file",
             (char *)*state);
    assert_int_equal(load(path, &kept), NEBEL_ERROR_FILE);
    assert_non_null(strstr(kept.last, expected));
}

static int make_folder(void **state)
{
    static char folder[] = "/tmp/nebel_test_XXXXXX";
    *state = mkdtemp(folder);
    return *state == NULL;
}

static int remove_folder(void **state)
{
    const char *const names[] = {"secret.json", "pipe", "models.json"};
    for (size_t i = 0; i < 3; i++) {
        char path[200];
        in_folder(path, *state, names[i]);
        unlink(path);
    }
    return rmdir(*state);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_every_truncation_is_an_error_with_a_place),
        cmocka_unit_test(test_every_garbled_byte_is_survived),
        cmocka_unit_test(test_every_failing_allocation_is_survived),
        cmocka_unit_test(test_growing_without_memory_is_survived),
        cmocka_unit_test(test_many_volumes_take_linear_time),
        cmocka_unit_test(test_an_error_far_down_is_found_at_its_line),
        cmocka_unit_test(test_what_is_no_file_is_named_with_the_reason),
        cmocka_unit_test(test_a_file_without_permission_is_an_error),
        cmocka_unit_test(test_a_scene_may_come_through_an_open_pipe),
        cmocka_unit_test(test_a_pipe_by_its_name_is_not_waited_for),
        cmocka_unit_test(test_relative_paths_start_at_the_scene),
        cmocka_unit_test(test_maps_start_there_too),
    };
    return cmocka_run_group_tests(tests, make_folder, remove_folder);
}
