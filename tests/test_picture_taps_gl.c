/* Particles by the comparison of five depths, as the scene renderer draws them, against a rendition on the CPU that
 * shares nothing with it: what the technique says, in doubles, with nebel_trace for the light of one particle. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "fog_help.h"
#include "pass_help.h"
#include "test_render_scene.h"

#include <nebel/gl.h>
#include <nebel/particles.h>

enum { WIDTH = 160, HEIGHT = 120, PIXELS = WIDTH * HEIGHT, PARTICLES = 60 };

typedef struct planes {
    float transmittance[3 * PIXELS], in_scattering[3 * PIXELS], depth[PIXELS];
} planes;

/* ---- the scene: particles around a ball, some through the floor ------------------------------ */

static const double eye[3] = {3, 2, 5};

static void make_particles(nebel_particle particles[PARTICLES], int grey)
{
    uint64_t state = 3;
    for (int i = 0; i < PARTICLES; i++) {
        nebel_particle *const p = &particles[i];
        *p = (nebel_particle){.radius = dice(&state, .1, .5),
                              .profile = (nebel_particle_profile)(i % NEBEL_PARTICLE_PROFILE_COUNT)};
        for (int k = 0; k < 3; k++) {
            p->center[k] = dice(&state, k == 1 ? -1.1 : -1.8, k == 1 ? 1 : 1.8);
            p->extinction[k] = grey ? 1.5 : dice(&state, .2, 3);
            p->emission[k] = dice(&state, 0, 1);
        }
    }
}

static nebel_camera camera_of(nebel_projection projection)
{
    const double near = projection == NEBEL_PROJECTION_PANORAMA ? .25 : 1;
    nebel_camera camera = test_camera(near * eye[0], near * eye[1], near * eye[2], 0, 0, 0);
    camera.projection = projection;
    camera.view_height = 4.5;
    return camera;
}

static void draw(nb_gl_language language, const nebel_camera *camera, const nebel_particle *particles,
                 const nebel_depth_taps *taps, planes *out)
{
    static test_ball ball;
    nb_gl context;
    nebel_gl_renderer *renderer = NULL;
    const nebel_gl_frame_desc desc = {.camera = *camera,
                                      .width = WIDTH,
                                      .height = HEIGHT,
                                      .samples = 1,
                                      .method = NEBEL_GL_METHOD_FIVE_TAP,
                                      .taps = taps};
    const nebel_gl_planes wanted = {
        .transmittance = out->transmittance, .in_scattering = out->in_scattering, .depth = out->depth};
    test_ball_make(&ball, (double[3]){0, 0, 0});
    pass_open(&context, language);
    assert_int_equal(nebel_create_gl_renderer(&ball.scene, NULL, &(nebel_gl_renderer_desc){0}, &renderer), NEBEL_OK);
    assert_int_equal(nebel_set_gl_renderer_particles(renderer, particles, PARTICLES), NEBEL_OK);
    assert_int_equal(nebel_gl_render_frame(renderer, &desc), NEBEL_OK);
    assert_int_equal(nebel_gl_read_planes(renderer, &wanted), NEBEL_OK);
    nebel_destroy_gl_renderer(renderer);
    pass_close(&context);
}

/* ---- the rendition --------------------------------------------------------------------------- */

/* How far the ray through a pixel's middle goes forward, to the right and up. */
static void find_way(const nebel_camera *camera, double x, double y, double way[3])
{
    const double pi = 3.14159265358979323846;
    const int parallel = camera->projection == NEBEL_PROJECTION_ORTHOGRAPHIC;
    const double half = parallel ? .5 * camera->view_height : tan(camera->vertical_fov * pi / 360);
    way[0] = 1, way[1] = half * (2 * x - WIDTH) / HEIGHT, way[2] = half * (HEIGHT - 2 * y) / HEIGHT;
    if (camera->projection != NEBEL_PROJECTION_PANORAMA) return;
    const double longitude = 2 * pi * (x / WIDTH - .5), latitude = pi * (.5 - y / HEIGHT);
    way[0] = cos(latitude) * cos(longitude), way[1] = cos(latitude) * sin(longitude), way[2] = sin(latitude);
}

/* The ray through a pixel's middle, counted from the upper left corner, and its cosine with the camera's axis: of a
 * panorama each ray is its own. */
static double make_ray(const nebel_camera *camera, double x, double y, nebel_ray *ray)
{
    double forward[3], right[3], size = 0, cosine = 0;
    for (int i = 0; i < 3; i++) size += pow(camera->look_at[i] - camera->position[i], 2);
    for (int i = 0; i < 3; i++) forward[i] = (camera->look_at[i] - camera->position[i]) / sqrt(size);
    const double across = hypot(forward[0], forward[2]);
    right[0] = -forward[2] / across, right[1] = 0, right[2] = forward[0] / across;
    const double up[3] = {right[1] * forward[2] - right[2] * forward[1], right[2] * forward[0] - right[0] * forward[2],
                          right[0] * forward[1] - right[1] * forward[0]};
    const int parallel = camera->projection == NEBEL_PROJECTION_ORTHOGRAPHIC;
    double way[3];
    find_way(camera, x, y, way);
    size = 0;
    for (int i = 0; i < 3; i++) {
        const double side = way[1] * right[i] + way[2] * up[i];
        ray->origin[i] = camera->position[i] + (parallel ? side : 0);
        ray->direction[i] = way[0] * forward[i] + (parallel ? 0 : side);
        size += ray->direction[i] * ray->direction[i];
    }
    for (int i = 0; i < 3; i++) ray->direction[i] /= sqrt(size);
    for (int i = 0; i < 3; i++) cosine += ray->direction[i] * forward[i];
    ray->t_max = HUGE_VAL;
    return camera->projection == NEBEL_PROJECTION_PANORAMA ? 1 : cosine;
}

/* Distance along the axis of what is seen at a place of the picture, 0 to 1; the nearest pixel. Below 0: nothing. */
static double opaque_at(const nebel_camera *camera, const float *depth, double u, double v)
{
    nebel_ray ray;
    const int x = (int)fmin(fmax(floor(u * WIDTH), 0), WIDTH - 1),
              y = (int)fmin(fmax(floor(v * HEIGHT), 0), HEIGHT - 1);
    const double t = (double)depth[y * WIDTH + x];
    return isinf(t) ? -1 : t * make_ray(camera, x + .5, y + .5, &ray);
}

static int is_drawn(const nebel_camera *camera, const float *depth, int x, int y, double along,
                    const nebel_depth_taps *taps)
{
    static const double steps[5][2] = {{0, 0}, {-1, -1}, {1, -1}, {-1, 1}, {1, 1}};
    double low = HUGE_VAL, high = -HUGE_VAL;
    for (int k = 0; k < 5; k++) {
        const double u = (x + .5) / WIDTH + steps[k][0] * taps->offset,
                     v = (y + .5) / HEIGHT + steps[k][1] * taps->offset;
        double there = opaque_at(camera, depth, u, v);
        if (there < 0) there = taps->background_depth;
        low = fmin(low, there);
        high = fmax(high, there);
    }
    return high - low > taps->edge_threshold || !(low < along - taps->depth_margin);
}

typedef struct place {
    double along, order; /* distances: along the axis, and that by which they are drawn */
    nebel_lighting *alone;
} place;

static place places[PARTICLES];

static int compare_orders(const void *a, const void *b)
{
    const double x = ((const place *)a)->order, y = ((const place *)b)->order;
    return (x < y) - (x > y);
}

/* From the farthest to the nearest. */
static void place_particles(const nebel_camera *camera, const nebel_particle *particles)
{
    nebel_ray axis;
    make_ray(camera, WIDTH / 2., HEIGHT / 2., &axis);
    for (int i = 0; i < PARTICLES; i++) {
        const nebel_volume_desc volume = nebel_volume_from_particle(&particles[i]);
        double square = 0;
        places[i].alone = fog_light(NULL, &volume, 1);
        places[i].along = 0;
        for (int k = 0; k < 3; k++) {
            const double way = particles[i].center[k] - camera->position[k];
            places[i].along += way * axis.direction[k];
            square += way * way;
        }
        if (camera->projection == NEBEL_PROJECTION_PANORAMA) places[i].along = sqrt(square);
        places[i].order = camera->projection == NEBEL_PROJECTION_ORTHOGRAPHIC ? places[i].along : sqrt(square);
    }
    qsort(places, PARTICLES, sizeof *places, compare_orders);
}

/* Returns how many particles are hidden that the ray meets. */
static int render_pixel(const nebel_camera *camera, const float *depth, int x, int y, const nebel_depth_taps *taps,
                        nebel_transfer *transfer)
{
    nebel_ray ray;
    int hidden = 0;
    *transfer = (nebel_transfer){.transmittance = {1, 1, 1}, .in_scattering = {0, 0, 0}};
    make_ray(camera, x + .5, y + .5, &ray);
    for (int i = 0; i < PARTICLES; i++) {
        nebel_transfer l;
        fog_trace(places[i].alone, (nebel_trace_desc){.tolerance = 1e-6}, 1, &ray, &l);
        if (l.transmittance[0] == 1 && l.transmittance[1] == 1 && l.transmittance[2] == 1) continue;
        if (!is_drawn(camera, depth, x, y, places[i].along, taps)) {
            hidden++;
            continue;
        }
        for (int c = 0; c < 3; c++) {
            transfer->in_scattering[c] =
                taps->brightness * l.in_scattering[c] + l.transmittance[c] * transfer->in_scattering[c];
            transfer->transmittance[c] *= l.transmittance[c];
        }
    }
    return hidden;
}

/* ---- tests ----------------------------------------------------------------------------------- */

static void check(nb_gl_language language, nebel_projection projection, int grey, const nebel_depth_taps *taps)
{
    static planes got;
    static nebel_particle particles[PARTICLES];
    const nebel_camera camera = camera_of(projection);
    const nebel_depth_taps used = taps != NULL ? *taps : (nebel_depth_taps){.0005, 100000, .5, .125, 1};
    double worst = 0;
    size_t fogged = 0, beyond = 0, hidden = 0;
    make_particles(particles, grey);
    draw(language, &camera, particles, taps, &got);
    place_particles(&camera, particles);
    for (int i = 0; i < PIXELS; i++) {
        nebel_transfer transfer;
        double off = 0;
        hidden += render_pixel(&camera, got.depth, i % WIDTH, i / WIDTH, &used, &transfer) > 0;
        for (int c = 0; c < 3; c++) {
            off = fmax(off, fabs((double)got.transmittance[3 * i + c] - transfer.transmittance[c]));
            off = fmax(off, fabs((double)got.in_scattering[3 * i + c] - transfer.in_scattering[c]));
        }
        fogged += transfer.transmittance[0] < 1;
        beyond += off > 2e-3;
        worst = fmax(worst, off);
    }
    for (int i = 0; i < PARTICLES; i++) nebel_release_lighting(places[i].alone);
    print_message("%zu pixels with particles, in %zu some are hidden; %zu more than 2e-3 off, worst %.1e\n", fogged,
                  hidden, beyond, worst);
    assert_true(fogged > PIXELS / 8 && hidden > PIXELS / 40);
    assert_int_equal(beyond, 0);
}

static void test_defaults_are_those_of_the_technique(void **state)
{
    (void)state;
    const nebel_depth_taps taps = nebel_gl_default_taps();
    assert_true(taps.offset == .0005 && taps.background_depth == 100000 && taps.edge_threshold == .5 &&
                taps.depth_margin == .125 && taps.brightness == 1);
    check(NB_GL_330, NEBEL_PROJECTION_PERSPECTIVE, 1, NULL);
    check(NB_GL_300ES, NEBEL_PROJECTION_ORTHOGRAPHIC, 0, NULL);
}

/* Taps several pixels away, where what lies around edges is drawn that stands behind them. */
static void test_constants_count(void **state)
{
    (void)state;
    const nebel_depth_taps wide = {
        .offset = .023, .background_depth = 3, .edge_threshold = .3, .depth_margin = .4, .brightness = .6};
    check(NB_GL_330, NEBEL_PROJECTION_PERSPECTIVE, 0, &wide);
    check(NB_GL_300ES, NEBEL_PROJECTION_PERSPECTIVE, 1, &wide);
    check(NB_GL_330, NEBEL_PROJECTION_PANORAMA, 0, &wide);
    check(NB_GL_300ES, NEBEL_PROJECTION_PANORAMA, 1, NULL);
}

static void test_what_is_refused(void **state)
{
    (void)state;
    static test_ball ball;
    nb_gl context;
    nebel_gl_renderer *renderer = NULL;
    nebel_depth_taps taps = nebel_gl_default_taps();
    nebel_gl_frame_desc desc = {
        .camera = camera_of(NEBEL_PROJECTION_PERSPECTIVE), .width = 8, .height = 8, .samples = 1, .taps = &taps};
    test_ball_make(&ball, (double[3]){0, 0, 0});
    pass_open(&context, NB_GL_330);
    assert_int_equal(nebel_create_gl_renderer(&ball.scene, NULL, &(nebel_gl_renderer_desc){0}, &renderer), NEBEL_OK);
    desc.method = NEBEL_GL_METHOD_COUNT;
    assert_int_equal(nebel_gl_render_frame(renderer, &desc), NEBEL_ERROR_ARGUMENT);
    desc.method = NEBEL_GL_METHOD_FIVE_TAP;
    taps.offset = -1;
    assert_int_equal(nebel_gl_render_frame(renderer, &desc), NEBEL_ERROR_VALUE);
    taps.offset = HUGE_VAL;
    assert_int_equal(nebel_gl_render_frame(renderer, &desc), NEBEL_ERROR_VALUE);
    taps = nebel_gl_default_taps();
    assert_int_equal(nebel_gl_render_frame(renderer, &desc), NEBEL_OK);
    nebel_destroy_gl_renderer(renderer);
    pass_close(&context);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_defaults_are_those_of_the_technique),
        cmocka_unit_test(test_constants_count),
        cmocka_unit_test(test_what_is_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
