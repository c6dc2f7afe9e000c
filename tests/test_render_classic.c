/* Classic fog on the surfaces of the CPU renderer: fog at vertices, added fog, fog factors. */
#include "test_render_scene.h"

#include "near.h"

#include <nebel/classic.h>

static const nebel_volume_desc bank = {.shape = {.type = NEBEL_SHAPE_BOX, .min = {-3, 0, -9}, .max = {9, 2, 9}},
                                       .extinction = {.1, .2, .3},
                                       .source = {1, .5, .25}};

static nebel_result render_by(const nebel_scene_data *scene, nebel_lighting *fog, nebel_method method,
                              const nebel_method_desc *numbers, int threads, const nebel_camera *camera,
                              test_picture *picture)
{
    nebel_renderer *renderer = NULL;
    const nebel_cpu_renderer_desc desc = {.thread_count = threads};
    const nebel_frame_desc frame = {
        .camera = *camera, .width = picture->width, .height = picture->height, .samples = 1};
    assert_int_equal(nebel_create_cpu_renderer(scene, fog, &desc, &renderer), NEBEL_OK);
    assert_int_equal(nebel_set_renderer_method(renderer, method, numbers), NEBEL_OK);
    const nebel_result result = nebel_render_frame(renderer, &frame, &picture->planes);
    nebel_destroy_renderer(renderer);
    return result;
}

static nebel_result render(const nebel_scene_data *scene, nebel_lighting *fog, nebel_method method,
                           const nebel_factor_desc *factor, int threads, const nebel_camera *camera,
                           test_picture *picture)
{
    return render_by(scene, fog, method, &(nebel_method_desc){.factor = factor}, threads, camera, picture);
}

/* The exact fog of the way to a corner. */
static nebel_transfer trace_corner(const nebel_lighting *fog, const nebel_camera *camera, size_t v)
{
    nebel_ray ray = {.t_max = 0};
    nebel_transfer transfer;
    double square = 0;
    for (size_t i = 0; i < 3; i++) {
        ray.origin[i] = camera->position[i];
        ray.direction[i] = (double)test_ground_positions[3 * v + i] - camera->position[i];
        square += ray.direction[i] * ray.direction[i];
    }
    ray.t_max = sqrt(square);
    fog_trace(fog, (nebel_trace_desc){0}, 1, &ray, &transfer);
    return transfer;
}

/* ---- fog at vertices ------------------------------------------------------------------------- */

static void test_vertices_are_exact_and_linear_between(void **state)
{
    (void)state;
    const nebel_mesh mesh = test_ground();
    const nebel_scene_data scene = {.meshes = &mesh, .mesh_count = 1, .ambient = {1, 1, 1}, .background = {.1, .2, .3}};
    const nebel_camera camera = test_camera_down();
    nebel_lighting *fog = test_fog(1, &bank);
    test_picture picture = test_picture_make(40, 30);
    double hidden[4], red[4], farthest = 0;
    for (size_t v = 0; v < 4; v++) {
        const nebel_transfer transfer = trace_corner(fog, &camera, v);
        hidden[v] = 1 - transfer.transmittance[0];
        red[v] = transfer.in_scattering[0];
        farthest = fmax(farthest, hidden[v]);
    }
    assert_true(farthest > .1);
    for (int parts = 1; parts < 4; parts++) {
        assert_int_equal(render(&scene, fog, NEBEL_METHOD_VERTEX, NULL, parts, &camera, &picture), NEBEL_OK);
        for (uint32_t y = 0; y < 30; y++)
            for (uint32_t x = 0; x < 40; x++) {
                double place[3];
                if (!test_find_ground(&camera, &picture, x, y, place)) continue;
                const double through = 1 - test_interpolate_ground(hidden, place),
                             added = test_interpolate_ground(red, place);
                for (size_t c = 0; c < 3; c++)
                    assert_near((double)test_transmittance(&picture, x, y)[c], through, 1e-5);
                assert_near((double)test_in_scattering(&picture, x, y)[0], added, 1e-5);
                assert_near((double)test_color(&picture, x, y)[0], .5 * through + added, 1e-5);
            }
    }
    nebel_release_lighting(fog);
    test_picture_free(&picture);
}

/* Every mesh and block of vertices has its own: many small triangles come near to the exact picture. */
static void test_fine_meshes_come_near_to_exact(void **state)
{
    (void)state;
    static test_ball ball;
    test_ball_make(&ball, (const double[3]){0, 1, 0});
    const nebel_camera camera = test_camera(0, 3, 5, 0, 0, 0);
    nebel_lighting *fog = test_world_fog(.1, 1);
    test_picture exact = test_picture_make(70, 50), vertex = test_picture_make(70, 50);
    ball.scene.mesh_count = 1; /* without the floor, of large triangles */
    assert_int_equal(render(&ball.scene, fog, NEBEL_METHOD_EXACT, NULL, 2, &camera, &exact), NEBEL_OK);
    assert_int_equal(render(&ball.scene, fog, NEBEL_METHOD_VERTEX, NULL, 2, &camera, &vertex), NEBEL_OK);
    int met = 0;
    for (size_t i = 0; i < 70 * 50; i++) {
        if (!isfinite(exact.planes.depth[i])) continue;
        assert_near((double)vertex.planes.color[3 * i], (double)exact.planes.color[3 * i], .001);
        met++;
    }
    assert_true(met > 100);
    nebel_release_lighting(fog);
    test_picture_free(&exact);
    test_picture_free(&vertex);
}

static void test_orthographic_rays_begin_beside_the_camera(void **state)
{
    (void)state;
    const nebel_mesh mesh = test_ground();
    const nebel_scene_data scene = {.meshes = &mesh, .mesh_count = 1, .ambient = {1, 1, 1}};
    const nebel_volume_desc layer = {.shape = {.type = NEBEL_SHAPE_BOX, .min = {-9, 0, -9}, .max = {9, 2, 9}},
                                     .extinction = {.3, .3, .3}};
    nebel_camera camera = test_camera_down();
    camera.projection = NEBEL_PROJECTION_ORTHOGRAPHIC;
    camera.view_height = 4;
    nebel_lighting *fog = test_fog(1, &layer);
    test_picture picture = test_picture_make(16, 16);
    assert_int_equal(render(&scene, fog, NEBEL_METHOD_VERTEX, NULL, 1, &camera, &picture), NEBEL_OK);
    for (uint32_t y = 0; y < 16; y++)
        for (uint32_t x = 0; x < 16; x++) assert_near((double)test_transmittance(&picture, x, y)[1], exp(-.6), 1e-6);
    nebel_release_lighting(fog);
    test_picture_free(&picture);
}

/* Weights of corners come to 1 but for rounding. */
static void test_opaque_fog_has_no_negative_light(void **state)
{
    (void)state;
    const nebel_mesh mesh = test_ground();
    const nebel_scene_data scene = {.meshes = &mesh, .mesh_count = 1, .ambient = {1, 1, 1}};
    const nebel_camera camera = test_camera_down();
    nebel_lighting *fog = test_world_fog(1e3, 0);
    test_picture picture = test_picture_make(80, 60);
    assert_int_equal(render(&scene, fog, NEBEL_METHOD_VERTEX, NULL, 1, &camera, &picture), NEBEL_OK);
    for (size_t i = 0; i < 3 * 80 * 60; i++)
        assert_true(picture.planes.color[i] >= 0 && picture.planes.transmittance[i] >= 0 &&
                    picture.planes.transmittance[i] <= 1);
    nebel_release_lighting(fog);
    test_picture_free(&picture);
}

/* ---- added fog ------------------------------------------------------------------------------- */

static void test_added_fog_hides_nothing(void **state)
{
    (void)state;
    const nebel_mesh mesh = test_ground();
    const nebel_scene_data scene = {.meshes = &mesh, .mesh_count = 1, .ambient = {1, 1, 1}, .background = {.1, .2, 7}};
    const nebel_camera camera = test_camera_down();
    nebel_lighting *fog = test_fog(1, &bank);
    test_picture blended = test_picture_make(40, 30), added = test_picture_make(40, 30);
    assert_int_equal(render(&scene, fog, NEBEL_METHOD_VERTEX, NULL, 2, &camera, &blended), NEBEL_OK);
    assert_int_equal(render(&scene, fog, NEBEL_METHOD_ADDITIVE, NULL, 2, &camera, &added), NEBEL_OK);
    int fogged = 0;
    for (size_t i = 0; i < 3 * 40 * 30; i++) {
        const int met = isfinite(added.planes.depth[i / 3]);
        const double light = (double)added.planes.in_scattering[i];
        assert_near(light, (double)blended.planes.in_scattering[i], 0);
        assert_near((double)added.planes.transmittance[i], 1, 0);
        const double before = met ? (double)mesh.base_color[i % 3] : scene.background[i % 3];
        assert_near((double)added.planes.color[i], before + light, 1e-6);
        fogged += met && light > .1;
    }
    assert_true(fogged > 50);
    nebel_release_lighting(fog);
    test_picture_free(&blended);
    test_picture_free(&added);
}

/* ---- factors --------------------------------------------------------------------------------- */

/* IEC 61966-2-1, from 0 to 1: what frame buffers store. */
static double stored(double linear)
{
    const double x = fmin(fmax(linear, 0), 1);
    return x <= .0031308 ? 12.92 * x : 1.055 * pow(x, 1 / 2.4) - .055;
}

static double restored(double x)
{
    return x <= .04045 ? x / 12.92 : pow((x + .055) / 1.055, 2.4);
}

static double factor_at(nebel_method method, const nebel_factor_desc *factor, const nebel_camera *camera,
                        const double place[3])
{
    const double aside[3] = {place[0] - camera->position[0], camera->position[1], place[2] - camera->position[2]};
    const double c = factor->coordinate == NEBEL_COORDINATE_RADIAL
                         ? sqrt(aside[0] * aside[0] + aside[1] * aside[1] + aside[2] * aside[2])
                         : aside[1];
    const double x = factor->density * c;
    if (method == NEBEL_METHOD_EXP) return exp(-x);
    if (method == NEBEL_METHOD_EXP2) return exp(-x * x);
    return fmin(fmax((factor->end - c) / (factor->end - factor->start), 0), 1);
}

static void test_factors(void **state)
{
    (void)state;
    const nebel_mesh mesh = test_ground();
    const nebel_scene_data scene = {.meshes = &mesh, .mesh_count = 1, .ambient = {1, 1, 1}, .background = {.1, .2, .3}};
    const nebel_camera camera = test_camera_down();
    nebel_lighting *fog = test_world_fog(.2, 1); /* is not drawn */
    test_picture picture = test_picture_make(40, 30);
    for (int method = NEBEL_METHOD_LINEAR; method <= NEBEL_METHOD_EXP2; method++)
        for (int way = 0; way < 4; way++) {
            const nebel_factor_desc factor = {.coordinate = (nebel_factor_coordinate)(way & 1),
                                              .stage = (nebel_factor_stage)(way >> 1),
                                              .start = 4,
                                              .end = 13,
                                              .density = .08,
                                              .color = {.9, .6, .3}};
            double corners[4];
            for (size_t v = 0; v < 4; v++) {
                const float *p = test_ground_positions + 3 * v;
                corners[v] = factor_at((nebel_method)method, &factor, &camera,
                                       (const double[3]){(double)p[0], (double)p[1], (double)p[2]});
            }
            assert_int_equal(render(&scene, fog, (nebel_method)method, &factor, 2, &camera, &picture), NEBEL_OK);
            for (uint32_t y = 0; y < 30; y++)
                for (uint32_t x = 0; x < 40; x++) {
                    double place[3];
                    if (!test_find_ground(&camera, &picture, x, y, place)) continue;
                    const double f = factor.stage == NEBEL_STAGE_VERTEX
                                         ? test_interpolate_ground(corners, place)
                                         : factor_at((nebel_method)method, &factor, &camera, place);
                    assert_near((double)test_transmittance(&picture, x, y)[1], f, 1e-5);
                    assert_near((double)test_color(&picture, x, y)[2], restored(f * stored(.75) + (1 - f) * stored(.3)),
                                1e-5);
                }
        }
    nebel_release_lighting(fog);
    test_picture_free(&picture);
}

/* ---- what hardware is given ------------------------------------------------------------------ */

static const double pale[3] = {.9, .6, .3};

static void store(const double color[3], double out[3])
{
    for (int c = 0; c < 3; c++) out[c] = stored(color[c]);
}

/* How far the ground is seen from factors that are linear between its corners, with that colour. */
static double find_difference(const nebel_camera *camera, const test_picture *picture, const double factors[4],
                              const double color[3])
{
    double largest = 0;
    int met = 0;
    for (uint32_t y = 0; y < picture->height; y++)
        for (uint32_t x = 0; x < picture->width; x++) {
            double place[3];
            if (!test_find_ground(camera, picture, x, y, place)) continue;
            const double f = test_interpolate_ground(factors, place);
            met++;
            for (int c = 0; c < 3; c++) {
                const double through = (double)test_transmittance(picture, x, y)[c];
                largest = fmax(largest, fabs(through - f));
                largest = fmax(largest, fabs((double)test_in_scattering(picture, x, y)[c] - (1 - f) * color[c]));
            }
        }
    assert_true(met > 300);
    return largest;
}

static double curve_at(nebel_curve_type curve, double depth)
{
    switch (curve) {
    case NEBEL_CURVE_LINEAR:
        return fmin(depth, 1);
    case NEBEL_CURVE_EXP:
        return fmin(exp(depth) - 1, 1);
    case NEBEL_CURVE_EXP2:
        return fmin(exp(depth * depth) - 1, 1);
    case NEBEL_CURVE_TABLE:
        return depth < .5 ? 0 : 1;
    default:
        return 1 - exp(-depth);
    }
}

/* A coordinate is a float, alpha a byte; two passes carry light of any colour. */
static void test_streams_of_hardware(void **state)
{
    (void)state;
    const nebel_mesh mesh = test_ground();
    const nebel_scene_data scene = {.meshes = &mesh, .mesh_count = 1, .ambient = {1, 1, 1}};
    const nebel_camera camera = test_camera_down();
    nebel_lighting *fog = test_fog(1, &bank);
    test_picture picture = test_picture_make(40, 30);
    float table[NEBEL_CURVE_ENTRIES];
    for (int i = 0; i < NEBEL_CURVE_ENTRIES; i++) table[i] = i < 128 ? 0 : 1;
    for (int curve = 0; curve < NEBEL_CURVE_COUNT; curve++) {
        const nebel_vertex_desc look = {.curve = (nebel_curve_type)curve, .table = table, .color = pale};
        const nebel_method_desc numbers = {.vertex = &look};
        double factors[4], bytes[4], rounded[3], fresh[3];
        store(pale, fresh);
        for (int c = 0; c < 3; c++) rounded[c] = floor(255 * fresh[c] + .5) / 255;
        for (size_t v = 0; v < 4; v++) {
            const double depth = -log((double)trace_corner(fog, &camera, v).transmittance[0]);
            factors[v] = 1 - curve_at((nebel_curve_type)curve, depth);
            bytes[v] = 1 - floor(255 * (1 - factors[v]) + .5) / 255;
        }
        assert_int_equal(render_by(&scene, fog, NEBEL_METHOD_FOG_COORD, &numbers, 2, &camera, &picture), NEBEL_OK);
        assert_true(find_difference(&camera, &picture, factors, fresh) < 1e-5);
        assert_int_equal(render_by(&scene, fog, NEBEL_METHOD_TWO_PASS, &numbers, 2, &camera, &picture), NEBEL_OK);
        assert_true(find_difference(&camera, &picture, factors, fresh) < 1e-5);
        assert_int_equal(render_by(&scene, fog, NEBEL_METHOD_ALPHA, &numbers, 2, &camera, &picture), NEBEL_OK);
        assert_true(find_difference(&camera, &picture, bytes, rounded) < 1e-5);
    }
    nebel_release_lighting(fog);
    test_picture_free(&picture);
}

/* But for what is blended: light, or what of it is stored. Fog of one color has that everywhere. */
static void test_two_passes_are_fog_at_vertices(void **state)
{
    (void)state;
    const nebel_mesh mesh = test_ground();
    const nebel_scene_data scene = {.meshes = &mesh, .mesh_count = 1, .ambient = {1, 1, 1}, .background = {.1, .2, .3}};
    const nebel_camera camera = test_camera_down();
    nebel_volume_desc grey = bank;
    for (int c = 0; c < 3; c++) grey.extinction[c] = .1;
    nebel_lighting *fog = test_fog(1, &grey);
    test_picture one = test_picture_make(40, 30), two = test_picture_make(40, 30);
    assert_int_equal(render_by(&scene, fog, NEBEL_METHOD_VERTEX, NULL, 2, &camera, &one), NEBEL_OK);
    assert_int_equal(render_by(&scene, fog, NEBEL_METHOD_TWO_PASS, NULL, 2, &camera, &two), NEBEL_OK);
    assert_memory_equal(one.planes.transmittance, two.planes.transmittance, sizeof(float) * 3 * 40 * 30);
    for (size_t i = 0; i < 3 * 40 * 30; i++) {
        const double left = (double)two.planes.transmittance[i], base = (double)one.planes.color[i],
                     behind = (base - (double)one.planes.in_scattering[i]) / left,
                     added = (1 - left) * stored(bank.source[i % 3]);
        assert_near((double)two.planes.in_scattering[i], added, 1e-5);
        assert_near((double)two.planes.color[i], restored(left * stored(behind) + added), 1e-5);
    }
    assert_int_equal(render_by(&scene, NULL, NEBEL_METHOD_TWO_PASS, NULL, 2, &camera, &two), NEBEL_OK);
    for (int i = 0; i < 3 * 40 * 30; i++) assert_near((double)two.planes.transmittance[i], 1, 0);
    nebel_release_lighting(fog);
    test_picture_free(&one);
    test_picture_free(&two);
}

/* 100 times the amount at vertices, linear in between; the factor there, or at pixels. */
static void test_own_coordinates(void **state)
{
    (void)state;
    const nebel_mesh mesh = test_ground();
    const nebel_scene_data scene = {.meshes = &mesh, .mesh_count = 1, .ambient = {1, 1, 1}};
    const nebel_camera camera = test_camera_down();
    nebel_lighting *fog = test_fog(1, &bank);
    test_picture picture = test_picture_make(40, 30);
    double coordinates[4], corners[4], fresh[3], largest = 0;
    nebel_factor_desc factor = {.coordinate = NEBEL_COORDINATE_USER, .density = .03, .color = {.9, .6, .3}};
    for (size_t v = 0; v < 4; v++) {
        coordinates[v] = 100 * (1 - (double)trace_corner(fog, &camera, v).transmittance[0]);
        corners[v] = exp(-.03 * coordinates[v]);
    }
    assert_int_equal(render(&scene, fog, NEBEL_METHOD_EXP, &factor, 2, &camera, &picture), NEBEL_OK);
    store(pale, fresh);
    assert_true(find_difference(&camera, &picture, corners, fresh) < 1e-5);
    factor.stage = NEBEL_STAGE_PIXEL;
    assert_int_equal(render(&scene, fog, NEBEL_METHOD_EXP, &factor, 2, &camera, &picture), NEBEL_OK);
    for (uint32_t y = 0; y < 30; y++)
        for (uint32_t x = 0; x < 40; x++) {
            double place[3];
            if (!test_find_ground(&camera, &picture, x, y, place)) continue;
            const double f = exp(-.03 * test_interpolate_ground(coordinates, place));
            assert_near((double)test_transmittance(&picture, x, y)[0], f, 1e-5);
            assert_near((double)test_in_scattering(&picture, x, y)[1], (1 - f) * fresh[1], 1e-5);
            largest = fmax(largest, fabs(f - test_interpolate_ground(corners, place)));
        }
    assert_true(largest > .01);
    /* Without fog c is 0. */
    assert_int_equal(render(&scene, NULL, NEBEL_METHOD_EXP, &factor, 2, &camera, &picture), NEBEL_OK);
    assert_near((double)test_transmittance(&picture, 20, 15)[0], 1, 0);
    nebel_release_lighting(fog);
    test_picture_free(&picture);
}

static void test_devices(void **state)
{
    (void)state;
    static const double orange[3] = {1, .2, 0};
    const nebel_mesh mesh = test_ground();
    const nebel_scene_data scene = {.meshes = &mesh, .mesh_count = 1, .ambient = {1, 1, 1}};
    const nebel_camera camera = test_camera_down();
    nebel_lighting *fog = test_fog(1, &bank);
    test_picture picture = test_picture_make(40, 30);
    nebel_d3d9_fog d3d9 = {
        .fog_color = 0x12ff3300, .fog_vertex_mode = NEBEL_D3DFOG_LINEAR, .fog_start = 6, .fog_end = 15};
    const nebel_method_desc numbers = {.d3d9 = &d3d9};
    double by_depth[4], by_range[4], by_alpha[4], by_table[4];
    for (size_t v = 0; v < 4; v++) {
        const float *p = test_ground_positions + 3 * v;
        const double radius = hypot(hypot((double)p[0] - 1, 7), (double)p[2] - 2);
        by_depth[v] = 8. / 9;
        by_range[v] = (15 - radius) / 9;
        by_alpha[v] = floor(255 * (double)trace_corner(fog, &camera, v).transmittance[0] + .5) / 255;
        by_table[v] = exp(-.7);
    }
    assert_int_equal(render_by(&scene, fog, NEBEL_METHOD_D3D9, &numbers, 2, &camera, &picture), NEBEL_OK);
    assert_true(find_difference(&camera, &picture, by_depth, orange) < 1e-5);
    d3d9.range_fog_enable = 1;
    assert_int_equal(render_by(&scene, fog, NEBEL_METHOD_D3D9, &numbers, 2, &camera, &picture), NEBEL_OK);
    assert_true(find_difference(&camera, &picture, by_range, orange) < 1e-5);
    d3d9.fog_table_mode = NEBEL_D3DFOG_EXP;
    d3d9.fog_density = .1f;
    assert_int_equal(render_by(&scene, fog, NEBEL_METHOD_D3D9, &numbers, 2, &camera, &picture), NEBEL_OK);
    assert_true(find_difference(&camera, &picture, by_table, orange) < 1e-5);
    d3d9.fog_table_mode = d3d9.fog_vertex_mode = NEBEL_D3DFOG_NONE;
    assert_int_equal(render_by(&scene, fog, NEBEL_METHOD_D3D9, &numbers, 2, &camera, &picture), NEBEL_OK);
    assert_true(find_difference(&camera, &picture, by_alpha, orange) < 1e-5);
    nebel_release_lighting(fog);
    test_picture_free(&picture);
}

/* The right half of the ground, which is grey, is seen in fog of half: bytes are blended. */
static void test_devices_blend_bytes(void **state)
{
    (void)state;
    const nebel_mesh mesh = test_ground();
    const nebel_scene_data scene = {.meshes = &mesh, .mesh_count = 1, .ambient = {4, .5, 0}, .background = {3, .2, 0}};
    nebel_camera camera = test_camera_down();
    test_picture picture = test_picture_make(40, 30);
    const nebel_d3d9_fog d3d9 = {
        .fog_color = 0xb4b4c0, .fog_table_mode = NEBEL_D3DFOG_LINEAR, .fog_start = 4, .fog_end = 10};
    nebel_method_desc numbers = {.d3d9 = &d3d9};
    assert_int_equal(render_by(&scene, NULL, NEBEL_METHOD_D3D9, &numbers, 2, &camera, &picture), NEBEL_OK);
    float shown[3];
    nebel_encode_srgb(1, test_color(&picture, 20, 15), 0, shown);
    for (int c = 0; c < 3; c++) {
        const double behind = 255 * stored((double)mesh.base_color[c] * scene.ambient[c]);
        assert_near(255 * (double)shown[c], .5 * behind + .5 * (c == 2 ? 0xc0 : 0xb4), .01);
    }
    /* An orthographic camera has device depth: 7 m is three quarters of the way from 1 to 9 m. */
    const nebel_d3d9_fog by_depth = {
        .fog_color = 0xffffff, .fog_table_mode = NEBEL_D3DFOG_LINEAR, .fog_start = .5f, .fog_end = 1};
    numbers = (nebel_method_desc){.d3d9 = &by_depth, .z_near = 1, .z_far = 9};
    camera.projection = NEBEL_PROJECTION_ORTHOGRAPHIC;
    camera.view_height = 4;
    assert_int_equal(render_by(&scene, NULL, NEBEL_METHOD_D3D9, &numbers, 2, &camera, &picture), NEBEL_OK);
    assert_near((double)test_transmittance(&picture, 20, 15)[0], .5, 1e-5);
    numbers.z_near = numbers.z_far = 0; /* 0 and 1000 m */
    assert_int_equal(render_by(&scene, NULL, NEBEL_METHOD_D3D9, &numbers, 2, &camera, &picture), NEBEL_OK);
    assert_near((double)test_transmittance(&picture, 20, 15)[0], 1, 0);
    test_picture_free(&picture);
}

/* ---- methods --------------------------------------------------------------------------------- */

static void test_methods_come_and_go(void **state)
{
    (void)state;
    const nebel_mesh mesh = test_ground();
    const nebel_scene_data scene = {.meshes = &mesh, .mesh_count = 1, .ambient = {1, 1, 1}};
    const nebel_camera camera = test_camera_down();
    nebel_renderer *renderer = NULL;
    nebel_lighting *fog = test_fog(1, &bank);
    test_picture before = test_picture_make(16, 16), after = test_picture_make(16, 16);
    const nebel_frame_desc frame = {.camera = camera, .width = 16, .height = 16, .samples = 1};
    assert_int_equal(nebel_create_cpu_renderer(&scene, fog, &(nebel_cpu_renderer_desc){0}, &renderer), NEBEL_OK);
    assert_int_equal(nebel_render_frame(renderer, &frame, &before.planes), NEBEL_OK);
    assert_int_equal(nebel_set_renderer_method(renderer, NEBEL_METHOD_VERTEX, NULL), NEBEL_OK);
    const nebel_factor_desc bad = {.density = -1};
    const nebel_vertex_desc colorless = {.curve = NEBEL_CURVE_LINEAR};
    const nebel_d3d9_fog unknown = {.fog_table_mode = 4};
    assert_int_equal(nebel_set_renderer_method(renderer, NEBEL_METHOD_EXP, NULL), NEBEL_ERROR_ARGUMENT);
    const nebel_method_desc wrong = {.factor = &bad, .vertex = &colorless, .d3d9 = &unknown};
    assert_int_equal(nebel_set_renderer_method(renderer, NEBEL_METHOD_EXP, &wrong), NEBEL_ERROR_VALUE);
    assert_int_equal(nebel_set_renderer_method(renderer, NEBEL_METHOD_FOG_COORD, NULL), NEBEL_ERROR_ARGUMENT);
    assert_int_equal(nebel_set_renderer_method(renderer, NEBEL_METHOD_ALPHA, NULL), NEBEL_ERROR_ARGUMENT);
    assert_int_equal(nebel_set_renderer_method(renderer, NEBEL_METHOD_TWO_PASS, &wrong), NEBEL_ERROR_ARGUMENT);
    assert_int_equal(nebel_set_renderer_method(renderer, NEBEL_METHOD_D3D9, NULL), NEBEL_ERROR_ARGUMENT);
    assert_int_equal(nebel_set_renderer_method(renderer, NEBEL_METHOD_D3D9, &wrong), NEBEL_ERROR_ARGUMENT);
    assert_int_equal(nebel_set_renderer_method(renderer, NEBEL_METHOD_CELLS, NULL), NEBEL_ERROR_ARGUMENT);
    assert_int_equal(nebel_set_renderer_method(renderer, NEBEL_METHOD_FIVE_TAP, NULL), NEBEL_ERROR_ARGUMENT);
    assert_int_equal(nebel_set_renderer_method(renderer, NEBEL_METHOD_COUNT, NULL), NEBEL_ERROR_ARGUMENT);
    assert_int_equal(nebel_set_renderer_method(NULL, NEBEL_METHOD_EXACT, NULL), NEBEL_ERROR_ARGUMENT);
    assert_int_equal(nebel_render_frame(renderer, &frame, &after.planes), NEBEL_OK);
    assert_memory_not_equal(before.planes.color, after.planes.color, 16 * 16 * 3 * sizeof(float));
    assert_int_equal(nebel_set_renderer_lighting(renderer, NULL), NEBEL_OK);
    assert_int_equal(nebel_render_frame(renderer, &frame, &after.planes), NEBEL_OK);
    assert_near((double)test_transmittance(&after, 8, 8)[0], 1, 0);
    assert_int_equal(nebel_set_renderer_lighting(renderer, fog), NEBEL_OK);
    assert_int_equal(nebel_set_renderer_method(renderer, NEBEL_METHOD_EXACT, NULL), NEBEL_OK);
    assert_int_equal(nebel_render_frame(renderer, &frame, &after.planes), NEBEL_OK);
    assert_memory_equal(before.planes.color, after.planes.color, 16 * 16 * 3 * sizeof(float));
    nebel_destroy_renderer(renderer);
    nebel_release_lighting(fog);
    test_picture_free(&before);
    test_picture_free(&after);
}

static void test_words(void **state)
{
    (void)state;
    assert_string_equal(nebel_method_name(NEBEL_METHOD_EXACT), "exact");
    assert_string_equal(nebel_method_name(NEBEL_METHOD_ADDITIVE), "additive");
    assert_null(nebel_method_name(NEBEL_METHOD_COUNT));
    assert_null(nebel_method_name((nebel_method)-1));
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_vertices_are_exact_and_linear_between),
        cmocka_unit_test(test_fine_meshes_come_near_to_exact),
        cmocka_unit_test(test_orthographic_rays_begin_beside_the_camera),
        cmocka_unit_test(test_opaque_fog_has_no_negative_light),
        cmocka_unit_test(test_added_fog_hides_nothing),
        cmocka_unit_test(test_factors),
        cmocka_unit_test(test_streams_of_hardware),
        cmocka_unit_test(test_two_passes_are_fog_at_vertices),
        cmocka_unit_test(test_own_coordinates),
        cmocka_unit_test(test_devices),
        cmocka_unit_test(test_devices_blend_bytes),
        cmocka_unit_test(test_methods_come_and_go),
        cmocka_unit_test(test_words),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
