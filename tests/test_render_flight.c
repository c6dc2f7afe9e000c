/* A flight from 2 m to 20,000 km: pictures of neighbouring heights, and neighbouring pixels, are off what nebel_trace_atmosphere says by the
 * same, so that nothing flickers and no seam shows; and fog of a metre's size stands still wherever on a planet it is. */
#include "near.h"
#include "planet_help.h"
#include "test_render_scene.h"

#include "math/vector.h"

enum { WIDTH = 4, HEIGHT = 64, HEIGHTS = 71 };

typedef struct world {
    nebel_atmosphere *atmosphere;
    nebel_planet planet;
    nebel_scene_data scene;
    nebel_sun sun;
} world;

static void make_world(const double ground[3], const double to_sun[3], world *w)
{
    *w = (world){.planet = {.atmosphere_desc = *nebel_lookup_atmosphere("earth")}, .sun = {.irradiance = {9, 9, 9}}};
    memcpy(w->planet.atmosphere_desc.ground_point, ground, sizeof w->planet.atmosphere_desc.ground_point);
    memcpy(w->sun.direction, to_sun, sizeof w->sun.direction);
    assert_true(nb_vector_make_unit(w->sun.direction));
    assert_int_equal(nebel_create_atmosphere(&w->planet.atmosphere_desc, &w->atmosphere), NEBEL_OK);
    w->planet.atmosphere = w->atmosphere;
    w->scene = (nebel_scene_data){.has_sun = 1, .sun_irradiance = {9, 9, 9}, .planet_count = 1, .planets = &w->planet};
    memcpy(w->scene.sun_direction, to_sun, sizeof w->scene.sun_direction);
}

static nebel_renderer *create_renderer(const world *w, nebel_lighting *fog)
{
    nebel_renderer *renderer;
    assert_int_equal(
        nebel_create_cpu_renderer(&w->scene, fog, &(nebel_cpu_renderer_desc){.thread_count = 2}, &renderer), NEBEL_OK);
    return renderer;
}

static void render(nebel_renderer *renderer, const nebel_camera *camera, const test_picture *picture)
{
    const nebel_frame_desc desc = {.camera = *camera, .width = picture->width, .height = picture->height, .samples = 1};
    assert_int_equal(nebel_render_frame(renderer, &desc, &picture->planes), NEBEL_OK);
}

/* Air, and Lambert's ground behind it. Returns whether there is any. */
static int look(const world *w, const nebel_ray *ray, double depth, double light[3])
{
    const double radius = w->planet.atmosphere_desc.radius;
    double place[1][3], cosine = 0;
    nebel_transfer air;
    nebel_irradiance arrives;
    assert_int_equal(nebel_trace_atmosphere(w->atmosphere, &w->sun, 1, ray, 0, &air, 0), NEBEL_OK);
    memcpy(light, air.in_scattering, 3 * sizeof *light);
    if (!(depth < HUGE_VAL)) return 0;
    double square = 0;
    for (int c = 0; c < 3; c++) square += pow(ray->direction[c], 2);
    for (int c = 0; c < 3; c++) {
        place[0][c] = ray->origin[c] + depth * ray->direction[c] / sqrt(square);
        cosine += (place[0][c] + (c == 1 ? radius : 0)) / radius * w->sun.direction[c];
    }
    assert_int_equal(
        nebel_compute_atmosphere_irradiance(w->atmosphere, &w->sun, 1, (const double(*)[3])place, 0, &arrives, 0),
        NEBEL_OK);
    for (int c = 0; c < 3; c++)
        light[c] += air.transmittance[c] * w->planet.atmosphere_desc.ground_albedo[c] / test_pi *
                    (fmax(0, cosine) * arrives.sun[c] + arrives.sky[c]);
    return 1;
}

/* As eyes see it: 255 for the brightest light, with the curve of sRGB. */
static double shown(double light, double brightest)
{
    const double part = fmax(0, fmin(1, light / brightest));
    return 255 * (part < .0031308 ? 12.92 * part : 1.055 * pow(part, 1 / 2.4) - .055);
}

typedef struct column {
    int is_ground[HEIGHT];
    double off[HEIGHT][3]; /* of 255 */
} column;

static void fly_past(const world *w, nebel_renderer *renderer, double height, const test_picture *picture, column *seen)
{
    const double radius = w->planet.atmosphere_desc.radius, dip = acos(radius / (radius + height));
    const double pitch = -dip - .12 * (test_pi / 2 - dip);
    const nebel_camera camera = planet_camera(height, pitch);
    double light[HEIGHT][3], brightest = 0;
    render(renderer, &camera, picture);
    for (uint32_t y = 0; y < HEIGHT; y++) {
        const nebel_ray ray = planet_ray(&camera, pitch, WIDTH / 2, y, WIDTH, HEIGHT);
        seen->is_ground[y] = look(w, &ray, (double)test_depth(picture, WIDTH / 2, y), light[y]);
        for (int c = 0; c < 3; c++) brightest = fmax(brightest, light[y][c]);
    }
    for (uint32_t y = 0; y < HEIGHT; y++)
        for (int c = 0; c < 3; c++)
            seen->off[y][c] =
                shown((double)test_color(picture, WIDTH / 2, y)[c], brightest) - shown(light[y][c], brightest);
}

static double apart(const column *a, int y, const column *b, int v)
{
    double most = 0;
    for (int c = 0; c < 3 && a->is_ground[y] == b->is_ground[v]; c++)
        most = fmax(most, fabs(a->off[y][c] - b->off[v][c]));
    return most;
}

static int ascending(const void *a, const void *b)
{
    return (*(const double *)a > *(const double *)b) - (*(const double *)a < *(const double *)b);
}

/* Heights are tried by two, one beside the other. */
static int is_tried(int i)
{
    return i >= 0 && nb_test_tries((size_t)i / 2, HEIGHTS / 2 + 1);
}

static void a_flight_has_no_seam(void **state)
{
    (void)state;
    static const double ground[3] = {0, 0, 0}, suns[][3] = {{.75, .5, .1}, {.2, .05, -1}};
    static column columns[HEIGHTS];
    static double by_height[HEIGHTS * HEIGHT], by_row[HEIGHTS * HEIGHT];
    test_picture picture = test_picture_make(WIDTH, HEIGHT);
    for (int k = 0; k < 2; k++) {
        size_t heights = 0, rows = 0;
        world w;
        make_world(ground, suns[k], &w);
        nebel_renderer *const renderer = create_renderer(&w, NULL);
        for (int i = 0; i < HEIGHTS; i++) {
            if (!is_tried(i)) continue;
            fly_past(&w, renderer, 2 * pow(1e7, i / (HEIGHTS - 1.)), &picture, &columns[i]);
            for (int y = 0; y < HEIGHT && is_tried(i - 1); y++)
                by_height[heights++] = apart(&columns[i], y, &columns[i - 1], y);
            for (int y = 1; y < HEIGHT; y++) by_row[rows++] = apart(&columns[i], y, &columns[i], y - 1);
        }
        nebel_destroy_renderer(renderer);
        qsort(by_height, heights, sizeof *by_height, ascending);
        qsort(by_row, rows, sizeof *by_row, ascending);
        print_message(
            "sun %d: from height to height 99 of 100 within %.2f of 255, all %.2f; from row to row %.2f and %.2f\n", k,
            by_height[heights / 100 * 99], by_height[heights - 1], by_row[rows / 100 * 99], by_row[rows - 1]);
        /* Of what bytes can show half a step, and all of one where most of the light lies within few rows of the table: near the
         * horizon, from below the top of the air. */
        assert_true(by_height[heights / 100 * 99] <= .5 && by_row[rows / 100 * 99] <= .5);
        assert_true(by_height[heights - 1] <= 1 && by_row[rows - 1] <= 1);
        nebel_destroy_atmosphere(w.atmosphere);
    }
    test_picture_free(&picture);
}

/* A lit bank of mist a metre high, at a place of the scene. */
static nebel_lighting *make_mist(const world *w, const double place[3])
{
    const nebel_volume_desc mist = {
        .shape = {.type = NEBEL_SHAPE_SPHERE, .center = {place[0], place[1] + 1, place[2] - 6}, .radius = 1},
        .extinction = {1, 1, 1},
        .albedo = {.9, .8, .7}};
    nebel_lighting_desc lights = {.sun = w->sun};
    nebel_irradiance light;
    const double middle[1][3] = {{place[0], place[1] + 1, place[2] - 6}};
    assert_int_equal(nebel_compute_atmosphere_irradiance(w->atmosphere, &w->sun, 1, middle, 0, &light, 0), NEBEL_OK);
    memcpy(lights.sun.irradiance, light.sun, sizeof light.sun);
    return fog_commit_lit(&(nebel_fog_desc){0}, &mist, 1, &lights);
}

/* Where numbers are 2^22 times as large as the mist, pictures are those at the origin while the camera moves by millimetres. Numbers
 * of the places are exact; those of the bank's middle are rounded to 2^-30 m, by which optical depth changes 2e-9. What is
 * left is of the tables of air, whose place is another. */
static void mist_stands_still_on_a_planet(void **state)
{
    (void)state;
    enum { WIDE = 48, HIGH = 32 };
    static const double to_sun[3] = {.6, .8, 0}, places[2][3] = {{0, 0, 0}, {0x1p22, -0x1p21, 0x1p22 + 0x1p20}};
    test_picture pictures[2];
    world worlds[2];
    double worst = 0;
    int fogged = 0;
    for (int k = 0; k < 2; k++) pictures[k] = test_picture_make(WIDE, HIGH);
    for (int k = 0; k < 2; k++) make_world(places[k], to_sun, &worlds[k]);
    for (int i = 0; i < 3; i++) {
        for (int k = 0; k < 2; k++) {
            nebel_camera camera = planet_camera(1.5, -.05);
            nebel_lighting *fog = make_mist(&worlds[k], places[k]);
            nebel_renderer *renderer = create_renderer(&worlds[k], fog);
            camera.position[0] += i * 0x1p-9;
            camera.look_at[0] += i * 0x1p-9;
            for (int c = 0; c < 3; c++) {
                camera.position[c] += places[k][c];
                camera.look_at[c] += places[k][c];
            }
            render(renderer, &camera, &pictures[k]);
            nebel_destroy_renderer(renderer);
            nebel_release_lighting(fog);
        }
        for (uint32_t p = 0; p < WIDE * HIGH * 3; p++) {
            const double left = (double)pictures[0].planes.transmittance[p];
            worst = fmax(worst, fabs(left - (double)pictures[1].planes.transmittance[p]));
            worst = fmax(
                worst, fabs((double)pictures[0].planes.in_scattering[p] - (double)pictures[1].planes.in_scattering[p]));
            fogged += left < .5;
        }
    }
    print_message("mist 6300 km from the origin: off by %.1e\n", worst);
    assert_true(fogged > 100 && worst <= 1e-5);
    for (int k = 0; k < 2; k++) {
        test_picture_free(&pictures[k]);
        nebel_destroy_atmosphere(worlds[k].atmosphere);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(a_flight_has_no_seam),
        cmocka_unit_test(mist_stands_still_on_a_planet),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
