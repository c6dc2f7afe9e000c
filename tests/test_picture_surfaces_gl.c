/* Light on surfaces is that of the CPU: thin cards, round and flat surfaces, under a sun and among point lights, with
 * what they shade. The argument `all` tries more. (The demo scenes are in test_picture_gl.c.) */
#include <math.h>
#include <stdio.h>
#include <string.h>

#include "frame/camera_axes.h"
#include "dice.h"
#include "fog_help.h"
#include "pass_help.h"
#include "picture_help.h"

enum {
    WIDTH = 128,
    HEIGHT = 96,
    CARDS = 20,
    BALLS = 3,
    BALL_RINGS = 12,
    BALL_SIDES = 16,
    BALL_VERTICES = (BALL_RINGS + 1) * (BALL_SIDES + 1),
    BALL_TRIANGLES = 2 * BALL_RINGS * BALL_SIDES,
    MESHES = CARDS + BALLS + 1
};

static const double pi = 3.14159265358979323846;
static int random_scenes = 12;

static picture_light compare(const char *name, const picture_pair *pair)
{
    const picture_light d = picture_compare_light(pair);
    print_message("%s: of %zu pixels %zu apart; off borders of %zu %zu apart, worst %.2f/255 at %u, %u\n", name, d.seen,
                  d.apart, d.inner, d.inner_apart, 255 * d.largest, (unsigned)d.x, (unsigned)d.y);
    return d;
}

static picture_light render(const char *name, const nebel_scene_data *scene, nebel_lighting *fog,
                            const nebel_camera *camera, nb_gl_language language)
{
    nb_gl context;
    picture_pair pair = picture_make(WIDTH, HEIGHT);
    pass_open(&context, language);
    picture_render(scene, fog, camera, 1, &pair);
    pass_close(&context);
    const picture_light d = compare(name, &pair);
    picture_free(&pair);
    return d;
}

/* ---- one card -------------------------------------------------------------------------------- */

static const uint32_t card_indices[6] = {0, 1, 2, 0, 2, 3};

static nebel_mesh card_of(float positions[4][3], float normals[4][3])
{
    return (nebel_mesh){.positions = positions[0],
                        .normals = normals != NULL ? normals[0] : NULL,
                        .indices = card_indices,
                        .vertex_count = 4,
                        .triangle_count = 2,
                        .base_color = {.5f, .5f, .5f},
                        .texture = -1};
}

/* The sun stands behind it, but not behind the surface that its normals stand for: it shades itself. */
static void test_a_card_is_dark_where_the_sun_is_behind_it(void **state)
{
    (void)state;
    static float positions[4][3] = {{-1, 0, 0}, {1, 0, 0}, {1, 2, 0}, {-1, 2, 0}};
    static float normals[4][3] = {{0, .98f, .2f}, {0, .98f, .2f}, {0, .98f, .2f}, {0, .98f, .2f}};
    const nebel_mesh card = card_of(positions, normals);
    for (int i = 0; i < 3; i++) {
        const nebel_scene_data scene = {.ambient = {.1, .1, .1},
                                        .mesh_count = 1,
                                        .meshes = &card,
                                        .has_sun = 1,
                                        .sun_direction = {.3, .5, i == 1 ? .3 : -.3},
                                        .sun_irradiance = {3, 3, 3}};
        const nebel_camera camera = {.position = {0, 1, 5},
                                     .look_at = {0, 1, 0},
                                     .up = {0, 1, 0},
                                     .vertical_fov = 40,
                                     .projection = i == 2 ? NEBEL_PROJECTION_PANORAMA : NEBEL_PROJECTION_PERSPECTIVE};
        const picture_light d = render("card", &scene, NULL, &camera, i == 1 ? NB_GL_300ES : NB_GL_330);
        assert_true(d.seen > 60);
        assert_int_equal(d.apart, 0);
    }
}

/* ---- crests ---------------------------------------------------------------------------------- */

/* A roof whose ridge goes up and down past the middles of a row of pixels by parts of what rasterizers move corners by. The
 * slope behind it may not be seen. */
enum { RIDGE = 32 };

typedef struct roof {
    float places[RIDGE + 1][3][3]; /* front, ridge, back */
    uint32_t indices[12 * RIDGE];
} roof;

static void make_roof(roof *r, double pixel)
{
    uint64_t numbers = 5;
    for (uint32_t i = 0; i <= RIDGE; i++)
        for (int k = 0; k < 3; k++) {
            const double height = k == 1 ? pixel * (.5 + dice(&numbers, -.005, .004)) : -10;
            const float place[3] = {(float)(.37 * i - .5 * .37 * RIDGE), (float)height, (float)(-5 - 5 * k)};
            memcpy(r->places[i][k], place, sizeof place);
        }
    for (uint32_t i = 0; i < RIDGE; i++) {
        const uint32_t first = 3 * i, corners[12] = {0, 3, 4, 0, 4, 1, 1, 4, 5, 1, 5, 2};
        for (int k = 0; k < 12; k++) r->indices[12 * i + (uint32_t)k] = first + corners[k];
    }
}

static void test_a_crest_is_not_seen_from_behind(void **state)
{
    (void)state;
    static roof r;
    make_roof(&r, 2 * tan(20 * pi / 180) * 10 / HEIGHT);
    const nebel_mesh mesh = {.positions = r.places[0][0],
                             .indices = r.indices,
                             .vertex_count = 3 * (RIDGE + 1),
                             .triangle_count = 4 * RIDGE,
                             .base_color = {.5f, .5f, .5f},
                             .texture = -1};
    const nebel_scene_data scene = {.mesh_count = 1,
                                    .meshes = &mesh,
                                    .background = {1, 1, 1},
                                    .has_sun = 1,
                                    .sun_direction = {0, .3, .95},
                                    .sun_irradiance = {6, 6, 6}};
    const nebel_camera camera = {.look_at = {0, 0, -1}, .up = {0, 1, 0}, .vertical_fov = 40};
    nb_gl context;
    picture_pair pair = picture_make(WIDTH, HEIGHT);
    pass_open(&context, NB_GL_330);
    picture_render(&scene, NULL, &camera, 1, &pair);
    pass_close(&context);
    size_t turned = 0; /* towards the eye, and less bright */
    for (size_t i = 0; i < WIDTH * HEIGHT; i++) turned += !(pair.gl.color[3 * i] > .9f);
    assert_int_equal(turned, 0);
    picture_free(&pair);
}

/* ---- small scenes ---------------------------------------------------------------------------- */

/* Sunlit fog with round, flat and soft edges, and a card in it, `size` metres wide. */
static void try_size(double size)
{
    float positions[4][3];
    for (int i = 0; i < 4; i++) {
        const float corner[3] = {i == 1 || i == 2 ? 1 : -1, i >= 2 ? 1 : -1, .2f};
        for (int k = 0; k < 3; k++) positions[i][k] = (float)(size * (double)corner[k]);
    }
    const double e = 1 / size;
    const nebel_volume_desc volumes[] = {
        {.shape = {.type = NEBEL_SHAPE_SPHERE, .center = {.3 * size, 0, 0}, .radius = size},
         .extinction = {e, e, e},
         .albedo = {.9, .9, .9}},
        {.shape = {.type = NEBEL_SHAPE_BOX, .min = {-size, -size, -size}, .max = {0, size, size}},
         .density = {.type = NEBEL_DENSITY_SOFT_EDGE, .edge_width = .3 * size},
         .extinction = {e, e, e},
         .source = {.2, .4, .6}},
    };
    const nebel_lighting_desc lights = {.sun = {.direction = {.3, .8, .5}, .irradiance = {3, 3, 3}}};
    nebel_lighting *const fog = fog_light(&lights, volumes, 2);
    const nebel_mesh card = card_of(positions, NULL);
    const nebel_scene_data scene = {.mesh_count = 1,
                                    .meshes = &card,
                                    .background = {.2, .2, .2},
                                    .has_sun = 1,
                                    .sun_direction = {.303046, .808122, .505076},
                                    .sun_irradiance = {3, 3, 3}};
    const nebel_camera camera = {.position = {.3 * size, .5 * size, 4 * size}, .up = {0, 1, 0}, .vertical_fov = 40};
    nb_gl context;
    picture_pair pair = picture_make(32, 24);
    pass_open(&context, NB_GL_330);
    picture_render(&scene, fog, &camera, 1, &pair);
    pass_close(&context);
    const picture_difference d = picture_compare(&pair, 1);
    print_message("%g m: of %zu pixels in fog %zu more than 1/255 apart, largest %g\n", size, d.fogged, d.beyond_step,
                  d.largest);
    assert_true(d.fogged > 200);
    assert_int_equal(d.beyond_step, 0);
    picture_free(&pair);
    nebel_release_lighting(fog);
}

static void test_small_scenes(void **state)
{
    (void)state;
    try_size(1e-6);
    try_size(2e-9);
}

/* ---- large triangles ------------------------------------------------------------------------- */

static void ray_of_pixel(const nebel_camera *camera, uint32_t x, uint32_t y, double origin[3], double direction[3])
{
    nb_camera_axes axes;
    const double u = 2 * (x + .5) / 32 - 1, v = 1 - 2 * (y + .5) / 24, h = tan(camera->vertical_fov * pi / 360);
    assert_int_equal(nb_camera_find_axes(camera, NULL, &axes), NEBEL_OK);
    for (int i = 0; i < 3; i++) {
        const double across = u * 32 / 24 * axes.right[i] + v * axes.up[i], turn = u * pi, rise = v * pi / 2;
        origin[i] = camera->position[i];
        direction[i] = axes.forward[i];
        if (camera->projection == NEBEL_PROJECTION_PERSPECTIVE) direction[i] += h * across;
        if (camera->projection == NEBEL_PROJECTION_ORTHOGRAPHIC) origin[i] += camera->view_height / 2 * across;
        if (camera->projection == NEBEL_PROJECTION_PANORAMA)
            direction[i] =
                cos(rise) * (cos(turn) * axes.forward[i] + sin(turn) * axes.right[i]) + sin(rise) * axes.up[i];
    }
    (void)nb_vector_make_unit(direction);
}

/* How far along the ray of a pixel the plane of the first triangle is, in double. */
static double depth_of_plane(float positions[4][3], const nebel_camera *camera, uint32_t x, uint32_t y)
{
    double a[3], b[3], normal[3], origin[3], direction[3], height = 0, rise = 0;
    for (int i = 0; i < 3; i++) {
        a[i] = (double)positions[1][i] - (double)positions[0][i];
        b[i] = (double)positions[2][i] - (double)positions[0][i];
    }
    nb_vector_cross(a, b, normal);
    ray_of_pixel(camera, x, y, origin, direction);
    for (int i = 0; i < 3; i++) {
        height += normal[i] * ((double)positions[0][i] - origin[i]);
        rise += normal[i] * direction[i];
    }
    return height / rise;
}

/* A square that is turned about two axes. */
static void set_corners(float positions[4][3], double half_width, double tilt)
{
    const double c = cos(tilt), s = sin(tilt);
    for (int k = 0; k < 4; k++) {
        const double x = k == 1 || k == 2 ? half_width : -half_width, z = k < 2 ? half_width : -half_width;
        positions[k][0] = (float)(c * x);
        positions[k][1] = (float)(c * s * x + s * z);
        positions[k][2] = (float)(c * z - s * s * x);
    }
}

/* OpenGL refuses it. */
static void render_alone(const nebel_scene_data *scene, const nebel_camera *camera, nebel_frame *cpu)
{
    nebel_renderer *renderer = NULL;
    nebel_gl_renderer *refusing = NULL;
    const nebel_frame_desc desc = {.camera = *camera, .width = 32, .height = 24, .samples = 1};
    const nebel_gl_frame_desc refused = {.camera = *camera, .width = 32, .height = 24, .samples = 1};
    assert_int_equal(nebel_create_cpu_renderer(scene, NULL, &(nebel_cpu_renderer_desc){0}, &renderer), NEBEL_OK);
    assert_int_equal(nebel_render_frame(renderer, &desc, cpu), NEBEL_OK);
    nebel_destroy_renderer(renderer);
    assert_int_equal(nebel_create_gl_renderer(scene, NULL, &(nebel_gl_renderer_desc){0}, &refusing), NEBEL_OK);
    assert_int_equal(nebel_gl_render_frame(refusing, &refused), NEBEL_ERROR_LIMIT);
    nebel_destroy_gl_renderer(refusing);
}

/* `most`: what depths may be off by on the CPU and in OpenGL, of themselves; 0: it refuses. */
static void try_ground(double half_width, double tilt, nebel_projection projection, const double most[2])
{
    float positions[4][3];
    set_corners(positions, half_width, tilt);
    const nebel_mesh ground = card_of(positions, NULL);
    const nebel_scene_data scene = {.mesh_count = 1, .meshes = &ground};
    const nebel_camera camera = {.position = {0, 2, 0},
                                 .look_at = {1, 1, -3},
                                 .up = {0, 1, 0},
                                 .vertical_fov = 60,
                                 .view_height = 2,
                                 .projection = projection};
    nb_gl context;
    picture_pair pair = picture_make(32, 24);
    double worst[2] = {0, 0};
    size_t seen = 0;
    pass_open(&context, NB_GL_330);
    if (most[1] > 0)
        picture_render(&scene, NULL, &camera, 1, &pair);
    else
        render_alone(&scene, &camera, &pair.cpu);
    for (uint32_t i = 0; i < 32 * 24; i++) {
        const double right = depth_of_plane(positions, &camera, i % 32, i / 32), cpu = (double)pair.cpu.depth[i];
        const double gl = (double)pair.gl.depth[i];
        if (!isfinite(cpu)) continue;
        worst[0] = fmax(worst[0], fabs(cpu - right) / right);
        worst[1] = most[1] > 0 ? fmax(worst[1], fabs(gl - right) / right) : 0;
        seen++;
    }
    pass_close(&context);
    print_message("%g m, tilt %g, projection %d: %zu pixels, CPU %.1e off, OpenGL %.1e\n", half_width, tilt,
                  (int)projection, seen, worst[0], worst[1]);
    assert_true(seen > 250);
    for (int i = 0; i < 2; i++) assert_true(worst[i] <= most[i]);
    picture_free(&pair);
}

/* Interpolation between corners that are far away has few digits near the eye, and where those are askew so has what the distance of
 * their plane is made of: OpenGL refuses what would be off by more than a thousandth. */
static void test_large_triangles(void **state)
{
    (void)state;
    for (int projection = 0; projection < 3; projection++) {
        try_ground(1e6, 0, (nebel_projection)projection, (const double[2]){1e-6, 2e-5});
        if (projection != NEBEL_PROJECTION_ORTHOGRAPHIC) {
            try_ground(1e8, 0, (nebel_projection)projection, (const double[2]){1e-6, 2e-5});
            try_ground(2e8, 0, (nebel_projection)projection, (const double[2]){1e-6, 0});
        }
        try_ground(1e4, .2, (nebel_projection)projection, (const double[2]){2e-5, 1e-3});
        try_ground(1e6, .3, (nebel_projection)projection, (const double[2]){2e-5, 0});
    }
}

/* A wall beside the eye, along which rays graze, and whose edges pass the camera's plane. */
static void test_a_wall_beside_the_eye(void **state)
{
    (void)state;
    for (int projection = 0; projection < 3; projection++) {
        float corners[4][3] = {{.01f, -1e5f, 1e5f}, {.01f, 1e5f, 1e5f}, {.01f, 1e5f, -1e5f}, {.01f, -1e5f, -1e5f}};
        const nebel_mesh wall = card_of(corners, NULL);
        const nebel_scene_data scene = {.mesh_count = 1, .meshes = &wall};
        const nebel_camera camera = {.position = {0, .3, 0},
                                     .look_at = {1, 0, -3},
                                     .up = {0, 1, 0},
                                     .vertical_fov = 70,
                                     .view_height = .1,
                                     .projection = (nebel_projection)projection};
        nb_gl context;
        picture_pair pair = picture_make(96, 64);
        size_t seen = 0;
        pass_open(&context, NB_GL_330);
        picture_render(&scene, NULL, &camera, 1, &pair);
        pass_close(&context);
        for (size_t i = 0; i < 96 * 64; i++) {
            const float wanted = pair.cpu.depth[i];
            if (!isfinite(wanted)) continue;
            assert_true(fabsf(pair.gl.depth[i] - wanted) <= 1e-3f * wanted);
            seen++;
        }
        assert_true(seen > 1000);
        picture_free(&pair);
    }
}

/* ---- a sealed room --------------------------------------------------------------------------- */

/* Three axes at right angles; the world's without numbers. */
static void turn_at_random(uint64_t *numbers, double axes[3][3])
{
    double q[4] = {1, 0, 0, 0}, length = 0;
    for (int i = 0; i < 4; i++) {
        if (numbers != NULL) q[i] = dice(numbers, -1, 1);
        length += q[i] * q[i];
    }
    for (int i = 0; i < 3; i++) {
        const int j = (i + 1) % 3, k = (i + 2) % 3;
        axes[i][i] = 1 - 2 * (q[j + 1] * q[j + 1] + q[k + 1] * q[k + 1]) / length;
        axes[i][j] = 2 * (q[i + 1] * q[j + 1] + q[0] * q[k + 1]) / length;
        axes[i][k] = 2 * (q[i + 1] * q[k + 1] - q[0] * q[j + 1]) / length;
    }
}

/* How many pixels are not dark in a box of random size, turned at random, seen from a random place in it: the sun stands outside, and
 * texels of a shadow map are cut off at the edges of walls. The first room is one that had a hairline along its ceiling. */
static size_t count_bright(uint64_t seed)
{
    static const uint32_t indices[36] = {0, 1, 3, 0, 3, 2, 4, 6, 7, 4, 7, 5, 0, 4, 5, 0, 5, 1,
                                         2, 3, 7, 2, 7, 6, 0, 2, 6, 0, 6, 4, 1, 5, 7, 1, 7, 3};
    float corners[8][3];
    uint64_t numbers = seed;
    double size[3], axes[3][3], eye[3] = {0, 0, 0}, target[3] = {0, 0, 0};
    for (int k = 0; k < 3; k++) size[k] = seed == 0 ? (k == 1 ? 4 : 10) : exp(dice(&numbers, log(.5), log(50)));
    turn_at_random(seed == 0 ? NULL : &numbers, axes);
    for (int i = 0; i < 8; i++)
        for (int k = 0; k < 3; k++) {
            double at = 0;
            for (int j = 0; j < 3; j++) at += (i >> (2 - j) & 1 ? .5 : -.5) * size[j] * axes[j][k];
            corners[i][k] = (float)at;
        }
    for (int j = 0; j < 3; j++) {
        const double from = dice(&numbers, -.45, .45), to = dice(&numbers, -.5, .5);
        for (int k = 0; k < 3; k++) {
            eye[k] += from * size[j] * axes[j][k];
            target[k] += to * size[j] * axes[j][k];
        }
    }
    const nebel_mesh room = {.positions = corners[0],
                             .indices = indices,
                             .vertex_count = 8,
                             .triangle_count = 12,
                             .base_color = {.5f, .5f, .5f},
                             .texture = -1};
    nebel_scene_data scene = {.mesh_count = 1,
                              .meshes = &room,
                              .has_sun = 1,
                              .sun_direction = {dice(&numbers, -1, 1), dice(&numbers, .05, 1), dice(&numbers, -1, 1)},
                              .sun_irradiance = {3, 3, 3}};
    nebel_camera camera = {.position = {eye[0], eye[1], eye[2]},
                           .look_at = {target[0], target[1], target[2]},
                           .up = {0, 1, 0},
                           .vertical_fov = dice(&numbers, 30, 100)};
    if (seed == 0) {
        memcpy(scene.sun_direction, (const double[3]){.303046, .808122, .505076}, sizeof scene.sun_direction);
        camera = (nebel_camera){.position = {3, 0, 3}, .look_at = {-3, -1, -3}, .up = {0, 1, 0}, .vertical_fov = 80};
    }
    size_t bright = 0;
    float most = 0;
    nb_gl context;
    picture_pair pair = picture_make(WIDTH, HEIGHT);
    pass_open(&context, NB_GL_300ES);
    picture_render(&scene, NULL, &camera, 1, &pair);
    pass_close(&context);
    for (size_t i = 0; i < WIDTH * HEIGHT; i++) {
        assert_true(isfinite(pair.gl.depth[i]));
        if (pair.gl.color[3 * i] < 1e-4f) continue;
        most = fmaxf(most, pair.gl.color[3 * i]);
        bright++;
    }
    if (bright > 0) print_message("room %d: %zu pixels are up to %g\n", (int)seed, bright, (double)most);
    picture_free(&pair);
    return bright;
}

static void test_no_light_comes_into_sealed_rooms(void **state)
{
    (void)state;
    size_t bright = 0;
    for (uint64_t seed = 0; seed < 24; seed++)
        if (nb_test_tries(seed, 24)) bright += count_bright(seed);
    assert_int_equal(bright, 0);
}

/* ---- random models --------------------------------------------------------------------------- */

typedef struct stage {
    float floor[4][3], cards[CARDS][4][3], card_normals[CARDS][4][3];
    float ball[BALL_VERTICES][3];
    float balls[BALLS][BALL_VERTICES][3];
    uint32_t ball_indices[3 * BALL_TRIANGLES];
    nebel_mesh meshes[MESHES];
    nebel_light lights[2];
    nebel_scene_data scene;
} stage;

static void dice_vector(uint64_t *numbers, double size, float v[3])
{
    for (int k = 0; k < 3; k++) v[k] = (float)dice(numbers, -size, size);
}

/* Normals are those of the card, none, the same at all corners or another at each. */
static void set_card(stage *s, int number, uint64_t *numbers)
{
    float middle[3], along[3], across[3], lean[3];
    dice_vector(numbers, 2, middle);
    dice_vector(numbers, .6, along);
    dice_vector(numbers, .6, across);
    dice_vector(numbers, 1, lean);
    middle[1] += 2.5f;
    for (int i = 0; i < 4; i++) {
        const float u = i == 1 || i == 2 ? 1 : -1, v = i >= 2 ? 1 : -1;
        float off[3];
        dice_vector(numbers, number % 4 == 2 ? .5 : 0, off);
        for (int k = 0; k < 3; k++) {
            s->cards[number][i][k] = middle[k] + u * along[k] + v * across[k];
            s->card_normals[number][i][k] = lean[k] + off[k];
        }
    }
    s->meshes[number] = card_of(s->cards[number], number % 4 == 0 ? NULL : s->card_normals[number]);
}

static void set_ball(stage *s)
{
    uint32_t count = 0;
    for (uint32_t i = 0; i <= BALL_RINGS; i++) {
        for (uint32_t j = 0; j <= BALL_SIDES; j++) {
            const double up = pi * i / BALL_RINGS, turn = 2 * pi * j / BALL_SIDES;
            const uint32_t a = i * (BALL_SIDES + 1) + j, b = a + BALL_SIDES + 1;
            const float v[3] = {(float)(sin(up) * cos(turn)), (float)cos(up), (float)(sin(up) * sin(turn))};
            memcpy(s->ball[a], v, sizeof v);
            if (i == BALL_RINGS || j == BALL_SIDES) continue;
            memcpy(s->ball_indices + count, (const uint32_t[6]){a, a + 1, b, b, a + 1, b + 1}, 6 * sizeof a);
            count += 6;
        }
    }
}

static nebel_mesh ball_of(stage *s, int number, uint64_t *numbers)
{
    float middle[3];
    const float radius = (float)dice(numbers, .3, .8);
    dice_vector(numbers, 1.5, middle);
    for (int v = 0; v < BALL_VERTICES; v++) {
        for (int k = 0; k < 3; k++) s->balls[number][v][k] = middle[k] + radius * s->ball[v][k];
    }
    return (nebel_mesh){.positions = s->balls[number][0],
                        .normals = number > 0 ? s->ball[0] : NULL,
                        .indices = s->ball_indices,
                        .origin = {0, 1.5, 0},
                        .vertex_count = BALL_VERTICES,
                        .triangle_count = BALL_TRIANGLES,
                        .base_color = {.8f, .5f, .3f},
                        .texture = -1};
}

/* Odd ones have the sun alone, and those that two divides the point lights; those that four divides have both. */
static void set_stage(stage *s, int number)
{
    static const float floor[4][3] = {{-6, -.5f, -6}, {-6, -.5f, 6}, {6, -.5f, 6}, {6, -.5f, -6}};
    uint64_t numbers = (uint64_t)number;
    set_ball(s);
    for (int i = 0; i < CARDS; i++) set_card(s, i, &numbers);
    for (int i = 0; i < BALLS; i++) s->meshes[CARDS + i] = ball_of(s, i, &numbers);
    memcpy(s->floor, floor, sizeof floor);
    s->meshes[CARDS + BALLS] = card_of(s->floor, NULL);
    for (int i = 0; i < 2; i++) {
        s->lights[i] = (nebel_light){.type = i == 0 ? NEBEL_LIGHT_POINT : NEBEL_LIGHT_SPOT,
                                     .position = {dice(&numbers, -3, 3), 4, dice(&numbers, -3, 3)},
                                     .intensity = {12, 10, 8},
                                     .direction = {0, -1, .1},
                                     .inner_angle = 30,
                                     .outer_angle = 60};
    }
    s->scene =
        (nebel_scene_data){.ambient = {.1, .12, .15},
                           .mesh_count = MESHES,
                           .meshes = s->meshes,
                           .has_sun = number % 4 != 2,
                           .sun_direction = {dice(&numbers, -1, 1), dice(&numbers, .2, 1), dice(&numbers, -1, 1)},
                           .sun_irradiance = {4, 3, 2},
                           .light_count = number % 2 == 0 ? 2 : 0,
                           .lights = s->lights};
}

static void add(picture_light *all, const picture_light *d)
{
    all->seen += d->seen;
    all->apart += d->apart;
    all->inner += d->inner;
    all->inner_apart += d->inner_apart;
    all->largest = fmax(all->largest, d->largest);
}

static void test_random_models(void **state)
{
    (void)state;
    static stage s;
    picture_light all = {.seen = 0};
    for (int i = 0; i < random_scenes; i++) {
        char name[32];
        set_stage(&s, i);
        const double turn = 2.4 * i;
        const nebel_camera camera = {.position = {6 * cos(turn), 2.5, 6 * sin(turn)},
                                     .look_at = {0, 1.5, 0},
                                     .up = {0, 1, 0},
                                     .vertical_fov = 45,
                                     .projection =
                                         i % 5 == 4 ? NEBEL_PROJECTION_PANORAMA : NEBEL_PROJECTION_PERSPECTIVE};
        snprintf(name, sizeof name, "random-%d", i);
        const picture_light d = render(name, &s.scene, NULL, &camera, i % 2 == 0 ? NB_GL_330 : NB_GL_300ES);
        add(&all, &d);
    }
    print_message("all: of %zu pixels %zu apart; off borders of %zu %zu apart\n", all.seen, all.apart, all.inner,
                  all.inner_apart);
    assert_true(all.inner > all.seen / 4);
    assert_true(all.inner_apart * 5000 <= all.inner);
    assert_true(all.apart * 50 <= all.seen);
}

int main(int argc, char **argv)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_a_card_is_dark_where_the_sun_is_behind_it),
        cmocka_unit_test(test_a_crest_is_not_seen_from_behind),
        cmocka_unit_test(test_small_scenes),
        cmocka_unit_test(test_large_triangles),
        cmocka_unit_test(test_a_wall_beside_the_eye),
        cmocka_unit_test(test_no_light_comes_into_sealed_rooms),
        cmocka_unit_test(test_random_models),
    };
    if (argc > 1 && strcmp(argv[1], "all") == 0) random_scenes = 60;
    if (argc > 2) cmocka_set_test_filter(argv[2]);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
