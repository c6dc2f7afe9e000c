/* The picture that examples/d3d9_specular.c writes shows at the vertices what nebel_trace says in double. */
#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stddef.h>
#include <stdint.h>
#include <stdio.h>
#include <cmocka.h>

int example_main(int argc, char **argv);
#define main example_main
#include "../../examples/d3d9_specular.c"
#undef main

static const char *path = "specular.ppm"; /* or the program's argument */
static unsigned char picture[HEIGHT][WIDTH][3];
static engine scene;
static double eye[3], colors[VERTICES][3]; /* what vertices should look like, 0 to 255 */

static void read_picture(void)
{
    int width = 0, height = 0, largest = 0;
    FILE *const file = fopen(path, "rb");
    assert_non_null(file);
    assert_int_equal(fscanf(file, "P6 %d %d %d", &width, &height, &largest), 3);
    assert_true(width == WIDTH && height == HEIGHT && largest == 255);
    fgetc(file);
    assert_int_equal(fread(picture, sizeof picture, 1, file), 1);
    fclose(file);
}

/* How much of the surface is left at each vertex, and what that makes of its colour. */
static int predict_colors(void)
{
    nebel_snapshot *const fog = make_fog();
    int foggy = 0;
    for (int i = 0; i < VERTICES; i++) {
        const engine_vertex *v = &scene.vertices[i];
        nebel_ray ray = {.origin = {eye[0], eye[1], eye[2]}};
        for (int k = 0; k < 3; k++) ray.direction[k] = (double)v->place[k] - eye[k];
        ray.t_max = sqrt(ray.direction[0] * ray.direction[0] + ray.direction[1] * ray.direction[1] +
                         ray.direction[2] * ray.direction[2]);
        nebel_transfer transfer;
        assert_int_equal(nebel_trace(fog, &(nebel_trace_desc){0}, 1, &ray, sizeof ray, &transfer, sizeof transfer),
                         NEBEL_OK);
        const double f = transfer.transmittance[0];
        for (int c = 0; c < 3; c++)
            colors[i][c] = f * (v->diffuse >> (16 - 8 * c) & 255) + (1 - f) * (fog_color >> (16 - 8 * c) & 255);
        foggy += f < .5;
    }
    nebel_release_snapshot(fog);
    return foggy;
}

/* Whether the way from the eye stays above the landscape, by more than the triangles differ from the hills, but for the
 * last 0.1 m. That also leaves out slopes which are seen nearly edge on. */
static int is_visible(const float place[3])
{
    double way[3], square = 0;
    for (int k = 0; k < 3; k++) {
        way[k] = (double)place[k] - eye[k];
        square += way[k] * way[k];
    }
    const double last = 1 - .1 / sqrt(square);
    for (int i = 1; i <= 400; i++) {
        const double s = last * i / 400;
        if (eye[1] + s * way[1] < engine_height(eye[0] + s * way[0], eye[2] + s * way[2]) + .01) return 0;
    }
    return 1;
}

/* In pixels, with centres at whole numbers as Direct3D 9 has them; 0 where it is not in the picture. */
static int project(const float place[3], double pixel[2])
{
    double v[3];
    for (int k = 0; k < 3; k++) {
        v[k] = scene.view[12 + k];
        for (int i = 0; i < 3; i++) v[k] += (double)place[i] * scene.view[4 * i + k];
    }
    pixel[0] = ((double)scene.projection[0] * v[0] / v[2] + 1) * WIDTH / 2;
    pixel[1] = (1 - (double)scene.projection[5] * v[1] / v[2]) * HEIGHT / 2;
    return v[2] > 1 && pixel[0] > 1 && pixel[0] < WIDTH - 2 && pixel[1] > 1 && pixel[1] < HEIGHT - 2;
}

/* The largest difference to the eight neighbours. */
static double roughness(int i, int c)
{
    double most = 0;
    for (int k = 0; k < 9; k++) {
        const int neighbour = i + (k / 3 - 1) * SIDE + k % 3 - 1;
        most = fmax(most, fabs(colors[neighbour][c] - colors[i][c]));
    }
    return most;
}

/* Pixels within a twentieth of a vertex's place: a byte of alpha and one of colour, each rounded, and a tenth of what
 * differs from vertex to vertex, which are at least half a pixel apart where the landscape is seen. */
static void test_the_picture_shows_the_fog_of_nebel(void **state)
{
    (void)state;
    char program[] = "d3d9_specular", file[260];
    snprintf(file, sizeof file, "%s", path);
    char *arguments[] = {program, file, NULL};
    assert_int_equal(example_main(2, arguments), 0);
    read_picture();
    engine_make_landscape(&scene);
    engine_turn(&scene, FIRST_ANGLE);
    assert_int_equal(nebel_compute_object_eye(scene.view, eye), NEBEL_OK);
    const int foggy = predict_colors();
    int compared = 0;
    double worst = 0;
    for (int i = 0; i < VERTICES; i++) {
        double pixel[2];
        if (i % SIDE % (SIDE - 1) == 0 || i / SIDE % (SIDE - 1) == 0 || !project(scene.vertices[i].place, pixel))
            continue;
        const double x = floor(pixel[0] + .5), y = floor(pixel[1] + .5);
        if (hypot(x - pixel[0], y - pixel[1]) > .05 || !is_visible(scene.vertices[i].place)) continue;
        for (int c = 0; c < 3; c++) {
            const double off = fabs(picture[(int)y][(int)x][c] - colors[i][c]);
            if (!(off <= 1 + .1 * roughness(i, c)))
                fail_msg("vertex %d, channel %d: %d drawn, %.2f wanted\n", i, c, picture[(int)y][(int)x][c],
                         colors[i][c]);
            worst = fmax(worst, off);
        }
        compared++;
    }
    print_message("%d vertices compared, %d of all in thick fog, at most %.2f of a byte\n", compared, foggy, worst);
    assert_true(compared > 50 && foggy > VERTICES / 20);
}

int main(int argc, char **argv)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_the_picture_shows_the_fog_of_nebel)};
    if (argc > 1) path = argv[1];
    return cmocka_run_group_tests(tests, NULL, NULL);
}
