/* Small scenes in memory for the tests of the renderer. */
#ifndef TEST_RENDER_SCENE_H
#define TEST_RENDER_SCENE_H

#include <nebel/render.h>

#include <math.h>

#include "fog_help.h"

static const double test_pi = 3.14159265358979323846;

/* A plane picture of everything that the renderer can give. */
typedef struct test_picture {
    uint32_t width, height;
    nebel_frame planes;
} test_picture;

static inline test_picture test_picture_make(uint32_t width, uint32_t height)
{
    const size_t pixels = (size_t)width * height;
    test_picture picture = {.width = width, .height = height};
    picture.planes.color = malloc(pixels * 3 * sizeof(float));
    picture.planes.transmittance = malloc(pixels * 3 * sizeof(float));
    picture.planes.in_scattering = malloc(pixels * 3 * sizeof(float));
    picture.planes.depth = malloc(pixels * sizeof(float));
    picture.planes.normal = malloc(pixels * 3 * sizeof(float));
    picture.planes.error = malloc(pixels * sizeof(float));
    return picture;
}

static inline void test_picture_free(test_picture *picture)
{
    free(picture->planes.color);
    free(picture->planes.transmittance);
    free(picture->planes.in_scattering);
    free(picture->planes.depth);
    free(picture->planes.normal);
    free(picture->planes.error);
}

static inline const float *test_color(const test_picture *picture, uint32_t x, uint32_t y)
{
    return picture->planes.color + 3 * ((size_t)y * picture->width + x);
}

static inline const float *test_transmittance(const test_picture *picture, uint32_t x, uint32_t y)
{
    return picture->planes.transmittance + 3 * ((size_t)y * picture->width + x);
}

static inline const float *test_in_scattering(const test_picture *picture, uint32_t x, uint32_t y)
{
    return picture->planes.in_scattering + 3 * ((size_t)y * picture->width + x);
}

static inline float test_depth(const test_picture *picture, uint32_t x, uint32_t y)
{
    return picture->planes.depth[(size_t)y * picture->width + x];
}

static inline nebel_camera test_camera(double x, double y, double z, double to_x, double to_y, double to_z)
{
    return (nebel_camera){
        .position = {x, y, z}, .look_at = {to_x, to_y, to_z}, .up = {0, 1, 0}, .vertical_fov = 50, .view_height = 10};
}

/* Some volumes, without lights. */
static inline nebel_lighting *test_fog(size_t count, const nebel_volume_desc *volumes)
{
    return fog_commit_lit(&(nebel_fog_desc){0}, volumes, count, NULL);
}

/* Fog everywhere. */
static inline nebel_lighting *test_world_fog(double extinction, double source)
{
    const nebel_volume_desc volume = {.extinction = {extinction, 2 * extinction, .5 * extinction},
                                      .source = {source, .5 * source, 2 * source}};
    return test_fog(1, &volume);
}

/* Renders with a renderer of its own. */
static inline void test_render(const nebel_scene_data *scene, nebel_lighting *fog, const nebel_cpu_renderer_desc *desc,
                               const nebel_camera *camera, uint32_t samples, test_picture *picture)
{
    nebel_renderer *renderer = NULL;
    assert_int_equal(nebel_create_cpu_renderer(scene, fog, desc, &renderer), NEBEL_OK);
    const nebel_frame_desc frame = {
        .camera = *camera, .width = picture->width, .height = picture->height, .samples = samples};
    assert_int_equal(nebel_render_frame(renderer, &frame, &picture->planes), NEBEL_OK);
    nebel_destroy_renderer(renderer);
}

/* ---- meshes ---------------------------------------------------------------------------------- */

/* A square of side 2 around (0, height, 0), facing up. */
static const float test_square_positions[12] = {-1, 0, -1, -1, 0, 1, 1, 0, 1, 1, 0, -1};
static const float test_square_uvs[8] = {0, 0, 0, 1, 1, 1, 1, 0};
static const uint32_t test_square_indices[6] = {0, 1, 2, 0, 2, 3};

static inline nebel_mesh test_square(void)
{
    return (nebel_mesh){.positions = test_square_positions,
                        .indices = test_square_indices,
                        .vertex_count = 4,
                        .triangle_count = 2,
                        .base_color = {.5f, .25f, .75f},
                        .texture = -1};
}

/* ---- barrel ---------------------------------------------------------------------------------- */

/* A round column around the y axis, of radius 1 and without ends, of few sides: normals make it round. */
enum { TEST_BARREL_SIDES = 8, TEST_BARREL_VERTICES = 2 * TEST_BARREL_SIDES };

typedef struct test_barrel {
    float positions[TEST_BARREL_VERTICES][3], normals[TEST_BARREL_VERTICES][3];
    uint32_t indices[TEST_BARREL_SIDES][6];
    nebel_mesh mesh;
    nebel_scene_data scene; /* under a sun that stands above a face's edge */
} test_barrel;

static inline void test_barrel_make(test_barrel *b)
{
    for (int i = 0; i < TEST_BARREL_VERTICES; i++) {
        const double angle = 2 * test_pi * (i / 2) / TEST_BARREL_SIDES;
        const float x = (float)cos(angle), z = (float)sin(angle);
        memcpy(b->normals[i], (const float[3]){x, 0, z}, sizeof b->normals[i]);
        memcpy(b->positions[i], (const float[3]){x, i % 2 ? 2 : -2, z}, sizeof b->positions[i]);
    }
    for (uint32_t i = 0; i < TEST_BARREL_SIDES; i++) {
        const uint32_t a = 2 * i, c = (2 * i + 2) % TEST_BARREL_VERTICES;
        memcpy(b->indices[i], (const uint32_t[6]){a, a + 1, c, c, a + 1, c + 1}, sizeof b->indices[i]);
    }
    b->mesh = (nebel_mesh){.positions = b->positions[0],
                           .normals = b->normals[0],
                           .indices = b->indices[0],
                           .vertex_count = TEST_BARREL_VERTICES,
                           .triangle_count = 2 * TEST_BARREL_SIDES,
                           .base_color = {.5f, .25f, .75f},
                           .texture = -1};
    b->scene = (nebel_scene_data){.mesh_count = 1,
                                  .meshes = &b->mesh,
                                  .has_sun = 1,
                                  .sun_direction = {cos(.3), 0, -sin(.3)},
                                  .sun_irradiance = {3, 3, 3}};
}

/* The largest difference from Lambert's law for the shading normals of a picture of the barrel. */
static inline double test_barrel_error(const test_barrel *b, const float *color, const float *normal, size_t pixels)
{
    double most = 0;
    for (size_t i = 0; i < pixels; i++) {
        double cosine = 0;
        for (size_t k = 0; k < 3; k++) cosine += (double)normal[3 * i + k] * b->scene.sun_direction[k];
        for (size_t k = 0; k < 3; k++) {
            const double light = (double)b->mesh.base_color[k] * b->scene.sun_irradiance[k] / test_pi * fmax(cosine, 0);
            most = fmax(most, fabs((double)color[3 * i + k] - light));
        }
    }
    return most;
}

/* ---- ground ---------------------------------------------------------------------------------- */

/* A square of 10 m in y = 0, its vertices far apart. Its diagonal goes from (-5, -5) to (5, 5). */
static const float test_ground_positions[12] = {-5, 0, -5, -5, 0, 5, 5, 0, 5, 5, 0, -5};

static inline nebel_mesh test_ground(void)
{
    nebel_mesh mesh = test_square();
    mesh.positions = test_ground_positions;
    return mesh;
}

/* Over the ground, looking straight down but aside of its middle. */
static inline nebel_camera test_camera_down(void)
{
    nebel_camera camera = test_camera(1, 7, 2, 1, 0, 2);
    camera.up[1] = 0;
    camera.up[2] = -1;
    camera.vertical_fov = 80;
    return camera;
}

/* What the middle of a pixel of that camera sees of the ground; 0 where it sees none of it, or its edge. */
static inline int test_find_ground(const nebel_camera *camera, const test_picture *picture, uint32_t x, uint32_t y,
                                   double place[3])
{
    const double high = 2 * tan(camera->vertical_fov * test_pi / 360) * camera->position[1];
    place[0] = camera->position[0] + (x + .5 - .5 * picture->width) / picture->height * high;
    place[1] = 0;
    place[2] = camera->position[2] + (y + .5 - .5 * picture->height) / picture->height * high;
    return fabs(place[0]) < 4.9 && fabs(place[2]) < 4.9;
}

/* Of numbers at the ground's vertices, linear over each triangle. */
static inline double test_interpolate_ground(const double corners[4], const double place[3])
{
    const double right = (place[0] + 5) / 10, down = (place[2] + 5) / 10;
    const double other = down > right ? (down - right) * corners[1] : (right - down) * corners[3];
    return fmin(right, down) * corners[2] + (1 - fmax(right, down)) * corners[0] + other;
}

/* ---- a ball ---------------------------------------------------------------------------------- */

enum { TEST_RINGS = 24, TEST_SECTORS = 48 };

/* A sphere with smooth normals, and under it a floor at -1; the memory is the caller's. */
typedef struct test_ball {
    float positions[(TEST_RINGS + 1) * (TEST_SECTORS + 1)][3], normals[(TEST_RINGS + 1) * (TEST_SECTORS + 1)][3];
    uint32_t indices[TEST_RINGS * TEST_SECTORS * 2][3];
    float floor[4][3];
    nebel_mesh meshes[2];
    nebel_scene_data scene;
} test_ball;

static inline void test_ball_set_vertices(test_ball *ball, float radius)
{
    for (uint32_t r = 0; r <= TEST_RINGS; r++) {
        for (uint32_t s = 0; s <= TEST_SECTORS; s++) {
            const double polar = test_pi * r / TEST_RINGS, azimuth = 2 * test_pi * (s % TEST_SECTORS) / TEST_SECTORS;
            const double n[3] = {sin(polar) * cos(azimuth), cos(polar), sin(polar) * sin(azimuth)};
            for (int i = 0; i < 3; i++) {
                ball->normals[r * (TEST_SECTORS + 1) + s][i] = (float)n[i];
                ball->positions[r * (TEST_SECTORS + 1) + s][i] = radius * (float)n[i];
            }
        }
    }
}

static inline void test_ball_set_indices(test_ball *ball)
{
    for (uint32_t r = 0; r < TEST_RINGS; r++) {
        for (uint32_t s = 0; s < TEST_SECTORS; s++) {
            const uint32_t a = r * (TEST_SECTORS + 1) + s, b = a + TEST_SECTORS + 1, t = 2 * (r * TEST_SECTORS + s);
            const uint32_t corners[6] = {a, a + 1, b, b, a + 1, b + 1};
            memcpy(ball->indices[t], corners, sizeof corners);
        }
    }
}

/* Everything stands around `center`. */
static inline void test_ball_make(test_ball *ball, const double center[3])
{
    memset(ball, 0, sizeof *ball);
    test_ball_set_vertices(ball, 1);
    test_ball_set_indices(ball);
    ball->meshes[0] = (nebel_mesh){.positions = ball->positions[0],
                                   .normals = ball->normals[0],
                                   .indices = ball->indices[0],
                                   .vertex_count = (TEST_RINGS + 1) * (TEST_SECTORS + 1),
                                   .triangle_count = TEST_RINGS * TEST_SECTORS * 2,
                                   .base_color = {.8f, .3f, .2f},
                                   .texture = -1};
    for (int v = 0; v < 4; v++) {
        for (int i = 0; i < 3; i++) ball->floor[v][i] = i == 1 ? -1 : 20 * test_square_positions[3 * v + i];
    }
    ball->meshes[1] = test_square();
    ball->meshes[1].positions = ball->floor[0];
    for (int m = 0; m < 2; m++) memcpy(ball->meshes[m].origin, center, 3 * sizeof(double));
    ball->scene = (nebel_scene_data){.background = {.5, .6, .7},
                                     .has_sun = 1,
                                     .sun_direction = {.36, .8, .48},
                                     .sun_irradiance = {3, 2.9, 2.7},
                                     .ambient = {.2, .25, .3},
                                     .mesh_count = 2,
                                     .meshes = ball->meshes};
}

/* ---- a card with holes over a floor ---------------------------------------------------------- */

enum { TEST_CARD_WIDTH = 8, TEST_CARD_HEIGHT = 6 };

/* A square of 4 m at y = 2 with a texture of random alpha, over a square of 20 m at y = 0. Points into itself. */
typedef struct test_card {
    float positions[2][12], uvs[8];
    uint8_t texels[4 * TEST_CARD_WIDTH * TEST_CARD_HEIGHT];
    nebel_texture texture;
    nebel_mesh meshes[2];
    nebel_scene_data scene;
} test_card;

/* The texture lies so many times on the card. */
static inline void test_card_make(test_card *c, float times)
{
    memset(c, 0, sizeof *c);
    uint32_t number = 1;
    for (size_t i = 0; i < sizeof c->texels; i++) {
        number = 1664525 * number + 1013904223; /* Numerical Recipes */
        c->texels[i] = (uint8_t)(number >> 24);
    }
    for (int i = 0; i < 12; i++) {
        c->positions[0][i] = i % 3 == 1 ? 2 : 2 * test_square_positions[i];
        c->positions[1][i] = 10 * test_square_positions[i];
    }
    for (int i = 0; i < 8; i++) c->uvs[i] = times * test_square_uvs[i];
    c->texture = (nebel_texture){TEST_CARD_WIDTH, TEST_CARD_HEIGHT, c->texels};
    for (int m = 0; m < 2; m++) {
        c->meshes[m] = test_square();
        c->meshes[m].positions = c->positions[m];
    }
    c->meshes[0].uvs = c->uvs;
    c->meshes[0].alpha_cutoff = .45f;
    c->scene = (nebel_scene_data){.has_sun = 1,
                                  .sun_direction = {.3, .9, .2},
                                  .sun_irradiance = {3, 3, 3},
                                  .mesh_count = 2,
                                  .meshes = c->meshes,
                                  .texture_count = 1,
                                  .textures = &c->texture};
}

/* Bilinear alpha less the cutoff, from -1 to 1, where a line over (x, z) crosses the card; beside it -1. */
static inline double test_card_alpha(const test_card *c, double x, double z)
{
    const double sizes[2] = {TEST_CARD_WIDTH, TEST_CARD_HEIGHT}, at[2] = {(x + 2) / 4, (z + 2) / 4};
    double alpha = 0;
    long first[2];
    double part[2];
    if (fabs(x) > 2 || fabs(z) > 2) return -1;
    for (int i = 0; i < 2; i++) {
        const double place = at[i] * (double)c->uvs[4] * sizes[i] - .5;
        first[i] = (long)floor(place);
        part[i] = place - floor(place);
    }
    for (int k = 0; k < 4; k++) {
        const long column = (first[0] + k % 2 + TEST_CARD_WIDTH) % TEST_CARD_WIDTH;
        const long row = (first[1] + k / 2 + TEST_CARD_HEIGHT) % TEST_CARD_HEIGHT;
        const double weight = (k % 2 ? part[0] : 1 - part[0]) * (k / 2 ? part[1] : 1 - part[1]);
        alpha += weight * c->texels[4 * (row * TEST_CARD_WIDTH + column) + 3] / 255;
    }
    return alpha - (double)c->meshes[0].alpha_cutoff;
}

/* ---- a ball over a textured floor, in fog ---------------------------------------------------- */

enum { TEST_TEXELS = 16 };

/* Points into itself. */
typedef struct test_stage {
    test_ball ball;
    uint8_t texels[4 * TEST_TEXELS * TEST_TEXELS];
    nebel_texture texture;
    nebel_lighting *fog;
    nebel_camera camera;
} test_stage;

/* The camera is beside the ball, `aside` of its centre. */
static inline void test_stage_set(test_stage *s, const double center[3], const double aside[3])
{
    test_ball_make(&s->ball, center);
    for (size_t i = 0; i < sizeof s->texels; i++) s->texels[i] = (uint8_t)(37 * i + i / 64 * 11);
    s->texture = (nebel_texture){TEST_TEXELS, TEST_TEXELS, s->texels};
    s->ball.meshes[1].uvs = test_square_uvs;
    s->ball.meshes[1].texture = 0;
    s->ball.scene.texture_count = 1;
    s->ball.scene.textures = &s->texture;
    const nebel_volume_desc volumes[] = {
        {.extinction = {.02, .03, .04}, .source = {.5, .6, .7}},
        {.shape = {.type = NEBEL_SHAPE_SPHERE, .center = {center[0] + 2, center[1], center[2]}, .radius = 1.5},
         .extinction = {.5, .5, .3}}};
    s->fog = test_fog(2, volumes);
    s->camera =
        test_camera(center[0] + aside[0], center[1] + aside[1], center[2] + aside[2], center[0], center[1], center[2]);
}

#endif
