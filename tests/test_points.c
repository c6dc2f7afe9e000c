/* Nebulae of points: the vertices of a model file become particles. */
#include "scene_help.h"

#include <math.h>

#define FILE_NAME "test_points.ply"

static void write_points(const char *format, const char *body)
{
    FILE *stream = fopen(FILE_NAME, "wb");
    assert_non_null(stream);
    fprintf(stream, "ply\nformat ascii 1.0\nelement vertex %sproperty float x\nproperty float y\nproperty float z\n%s",
            format, body);
    fclose(stream);
}

#define SCENE(points)                                                                                                  \
    "{\"nebel\": 1, \"fog\": [], \"nebula\": [{\"points\": {\"file\": \"" FILE_NAME "\"" points                        \
    "}, \"absorption\": 1}]}"

static nebel_particle *make(const char *text, nebel_scene **scene)
{
    nebel_particle *particles = NULL;
    *scene = parse_good(text);
    assert_int_equal(nebel_generate_scene_particles(*scene, &particles), NEBEL_OK);
    return particles;
}

static void assert_at(const nebel_particle *particle, double x, double y, double z)
{
    const double wanted[3] = {x, y, z};
    for (int i = 0; i < 3; i++)
        if (!(fabs(particle->center[i] - wanted[i]) <= 1e-12))
            fail_msg("%.17g, not %.17g", particle->center[i], wanted[i]);
}

static void test_each_vertex_is_a_particle(void **state)
{
    (void)state;
    nebel_scene *scene;
    write_points("3\n", "end_header\n1 2 3\n4 5 6\n-1 0 2.5\n");
    nebel_particle *particles =
        make(SCENE(", \"position\": [10, 0, 0], \"rotation\": [0, 0, 1, 1], \"scale\": [1, 2, 1]"), &scene);
    assert_int_equal(nebel_get_scene_data(scene)->particle_count, 3);
    assert_at(&particles[0], 10 - 4, 1, 3);
    assert_at(&particles[1], 10 - 10, 4, 6);
    assert_at(&particles[2], 10, -1, 2.5);
    assert_true(particles[0].radius >= .05 && particles[0].radius <= .2);
    nebel_free_scene_particles(scene, particles);
    nebel_destroy_scene(scene);
    particles = make(SCENE(", \"up\": \"z\", \"unit\": 0.5"), &scene);
    assert_at(&particles[0], .5, 1.5, -1);
    nebel_free_scene_particles(scene, particles);
    nebel_destroy_scene(scene);
}

static void test_vertices_at_one_place_count_once(void **state)
{
    (void)state;
    nebel_scene *scene;
    write_points("5\n", "element face 1\nproperty list uchar int vertex_indices\nend_header\n"
                        "0 0 0\n1 0 0\n0 1 0\n1 0 0\n7 7 7\n3 0 1 2\n");
    nebel_particle *particles = make(SCENE(""), &scene);
    assert_int_equal(nebel_get_scene_data(scene)->particle_count, 4);
    assert_at(&particles[3], 7, 7, 7);
    nebel_free_scene_particles(scene, particles);
    nebel_destroy_scene(scene);
}

static void assert_broken(const char *text, nebel_result wanted, const char *message)
{
    meter m;
    journal kept;
    nebel_scene *scene = NULL;
    const nebel_scene_desc desc = metered_desc(&m, &kept);
    assert_int_equal(nebel_parse_scene(text, strlen(text), "a.json", &desc, &scene), wanted);
    if (strstr(kept.last, message) == NULL) fail_msg("%s", kept.last);
    assert_non_null(strstr(kept.last, "a.json:1:56: nebula[0].points.file: "));
    assert_null(scene);
    assert_int_equal(m.live, 0);
}

static void test_what_has_no_points(void **state)
{
    (void)state;
    write_points("0\n", "end_header\n");
    assert_broken(SCENE(""), NEBEL_ERROR_FORMAT, FILE_NAME);
    write_points("3\n", "");
    assert_broken(SCENE(""), NEBEL_ERROR_FORMAT, "its header does not end");
    FILE *stream = fopen(FILE_NAME, "wb");
    fprintf(stream, "ply\nformat ascii 1.0\nelement vertex 1000001\nproperty float x\nproperty float y\nproperty float "
                    "z\nend_header\n");
    for (int i = 0; i <= 1000000; i++) fprintf(stream, "%d 0 0\n", i);
    fclose(stream);
    assert_broken(SCENE(""), NEBEL_ERROR_LIMIT, "has more than 1000000 vertices");
}

static void test_every_failing_allocation_is_survived(void **state)
{
    (void)state;
    write_points("3\n", "end_header\n1 2 3\n4 5 6\n-1 0 2.5\n");
    parse_without_memory(SCENE(""));
}

static int clean_up(void **state)
{
    (void)state;
    remove(FILE_NAME);
    return 0;
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_each_vertex_is_a_particle),
        cmocka_unit_test(test_vertices_at_one_place_count_once),
        cmocka_unit_test(test_what_has_no_points),
        cmocka_unit_test(test_every_failing_allocation_is_survived),
    };
    return cmocka_run_group_tests(tests, NULL, clean_up);
}
