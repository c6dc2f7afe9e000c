/* Pictures whose pixels are known. */
#include "test_render_scene.h"

#include "cpu/cpu_renderer.h"

static const nebel_cpu_renderer_desc plain = {.thread_count = 1};

/* Everything that is drawn must come from this formula. */
static void assert_pixel(const float *color, const double surface[3], const double transmittance[3],
                         const double source[3], double tolerance)
{
    for (int c = 0; c < 3; c++) {
        const double expected = transmittance[c] * surface[c] + source[c] * (1 - transmittance[c]);
        assert_true(fabs((double)color[c] - expected) <= tolerance * fmax(1, expected));
    }
}

/* ---- surfaces in fog ------------------------------------------------------------------------- */

static void test_wall_in_constant_fog(void **state)
{
    (void)state;
    /* The floor square, seen from above, 1000 times as large: the view is full of it. */
    float positions[12];
    for (int i = 0; i < 12; i++) positions[i] = 1000 * test_square_positions[i];
    nebel_mesh wall = test_square();
    wall.positions = positions;
    const nebel_scene_data scene = {.mesh_count = 1, .meshes = &wall, .ambient = {.4, .5, .6}};
    nebel_camera camera = test_camera(3, 10, -2, 3, 0, -2);
    const double extinction = .05, source = .7;
    nebel_lighting *fog = test_world_fog(extinction, source);
    test_picture picture = test_picture_make(37, 21);
    test_render(&scene, fog, &plain, &camera, 1, &picture);
    const double edge = tan(25 * test_pi / 180) / 21;
    for (uint32_t y = 0; y < 21; y++) {
        for (uint32_t x = 0; x < 37; x++) {
            const double right = edge * (2 * x + 1 - 37.0), up = edge * (21.0 - 2 * y - 1);
            const double distance = 10 * sqrt(1 + right * right + up * up);
            const double transmittance[3] = {exp(-extinction * distance), exp(-2 * extinction * distance),
                                             exp(-.5 * extinction * distance)};
            const double surface[3] = {.5 * .4, .25 * .5, .75 * .6}, sources[3] = {source, .5 * source, 2 * source};
            assert_pixel(test_color(&picture, x, y), surface, transmittance, sources, 3e-6);
            assert_true(fabs((double)test_depth(&picture, x, y) - distance) < 3e-6 * distance);
        }
    }
    test_picture_free(&picture);
    nebel_release_lighting(fog);
}

static void test_sun_through_fog_onto_ground(void **state)
{
    (void)state;
    nebel_mesh ground = test_square();
    const nebel_scene_data scene = {
        .mesh_count = 1, .meshes = &ground, .has_sun = 1, .sun_direction = {.6, .8, 0}, .sun_irradiance = {3, 2, 1}};
    /* A layer from the ground to 5 m: 5 m of it on the way to the camera, 5 / 0.8 m on the way to the sun. */
    const nebel_volume_desc layer = {.shape = {.type = NEBEL_SHAPE_BOX, .min = {-100, -1, -100}, .max = {100, 5, 100}},
                                     .extinction = {.1, .2, .3},
                                     .source = {.6, .5, .4}};
    nebel_lighting *fog = test_fog(1, &layer);
    nebel_camera camera = test_camera(0, 10, 0, 0, 0, 0);
    camera.projection = NEBEL_PROJECTION_ORTHOGRAPHIC;
    camera.view_height = 1;
    test_picture picture = test_picture_make(5, 5);
    test_render(&scene, fog, &plain, &camera, 1, &picture);
    const double base[3] = {.5, .25, .75};
    double surface[3], transmittance[3];
    for (int c = 0; c < 3; c++) {
        surface[c] = base[c] / test_pi * scene.sun_irradiance[c] * exp(-layer.extinction[c] * 5 / .8) * .8;
        transmittance[c] = exp(-layer.extinction[c] * 5);
    }
    assert_pixel(test_color(&picture, 2, 2), surface, transmittance, layer.source, 3e-6);
    assert_pixel(test_color(&picture, 0, 4), surface, transmittance, layer.source, 3e-6);
    test_picture_free(&picture);
    nebel_release_lighting(fog);
}

static void test_fog_that_begins_beyond_the_ground_still_dims_the_sun(void **state)
{
    (void)state;
    nebel_mesh ground = test_square();
    const nebel_scene_data scene = {
        .mesh_count = 1, .meshes = &ground, .has_sun = 1, .sun_direction = {.6, .8, 0}, .sun_irradiance = {3, 2, 1}};
    const nebel_volume_desc layer = {.shape = {.type = NEBEL_SHAPE_BOX, .min = {-100, -1, -100}, .max = {100, 5, 100}},
                                     .extinction = {.1, .2, .3},
                                     .source = {.6, .5, .4},
                                     .start = 20};
    nebel_lighting *fog = test_fog(1, &layer);
    const nebel_camera camera = test_camera(0, 10, .1, 0, 0, 0);
    test_picture picture = test_picture_make(5, 5);
    test_render(&scene, fog, &plain, &camera, 1, &picture);
    const double base[3] = {.5, .25, .75}, all[3] = {1, 1, 1};
    double surface[3];
    for (int c = 0; c < 3; c++)
        surface[c] = base[c] / test_pi * scene.sun_irradiance[c] * exp(-layer.extinction[c] * 5 / .8) * .8;
    assert_pixel(test_color(&picture, 2, 2), surface, all, layer.source, 3e-6);
    test_picture_free(&picture);
    nebel_release_lighting(fog);
}

static void test_shadow_leaves_the_ambient_light(void **state)
{
    (void)state;
    nebel_mesh meshes[2] = {test_square(), test_square()};
    meshes[1].origin[0] = .5; /* from x = -0.5 to 1.5, one metre above the ground */
    meshes[1].origin[1] = 1;
    const nebel_scene_data scene = {.mesh_count = 2,
                                    .meshes = meshes,
                                    .has_sun = 1,
                                    .sun_direction = {sqrt(.5), sqrt(.5), 0},
                                    .sun_irradiance = {1, 1, 1},
                                    .ambient = {.1, .1, .1}};
    /* From below the upper square, so that it does not hide the ground: its shadow reaches from x = -1.5 to 0.5. */
    nebel_camera camera = test_camera(0, .5, 0, 0, 0, 0);
    camera.projection = NEBEL_PROJECTION_ORTHOGRAPHIC;
    camera.up[1] = 0;
    camera.up[2] = -1;
    camera.view_height = 1.9;
    test_picture picture = test_picture_make(19, 19);
    test_render(&scene, NULL, &plain, &camera, 1, &picture);
    const float lit = .5f * ((float)(sqrt(.5) / test_pi) + .1f), shaded = .5f * .1f;
    for (uint32_t x = 0; x < 19; x++) {
        const double place = .1 * x - .9;
        if (fabs(place - .5) < .01) continue;
        const float expected = place > .5 ? lit : shaded;
        assert_float_equal(test_color(&picture, x, 9)[0], expected, 1e-6);
    }
    test_picture_free(&picture);
}

static void test_surfaces_have_two_sides(void **state)
{
    (void)state;
    nebel_mesh square = test_square();
    const nebel_scene_data scene = {
        .mesh_count = 1, .meshes = &square, .has_sun = 1, .sun_direction = {0, 1, 0}, .sun_irradiance = {1, 1, 1}};
    const float lit = .5f / (float)test_pi;
    test_picture picture = test_picture_make(1, 1);
    const nebel_camera above = test_camera(0, 3, 0, 0, 0, 0), below = test_camera(0, -3, 0, 0, 0, 0);
    for (int turned = 0; turned < 2; turned++) {
        const uint32_t other_way[6] = {2, 1, 0, 3, 2, 0};
        if (turned) square.indices = other_way;
        test_render(&scene, NULL, &plain, &above, 1, &picture);
        assert_float_equal(picture.planes.color[0], lit, 1e-6);
        assert_float_equal(picture.planes.normal[1], 1, 1e-6);
        test_render(&scene, NULL, &plain, &below, 1, &picture);
        assert_float_equal(picture.planes.color[0], 0, 0);
        assert_float_equal(picture.planes.normal[1], -1, 1e-6);
    }
    test_picture_free(&picture);
}

static void test_smooth_normals_are_interpolated(void **state)
{
    (void)state;
    nebel_mesh square = test_square();
    const float tilted[12] = {-.6f, .8f, 0, -.6f, .8f, 0, .6f, .8f, 0, .6f, .8f, 0};
    square.normals = tilted;
    const nebel_scene_data scene = {.mesh_count = 1, .meshes = &square};
    nebel_camera camera = test_camera(.5, 3, .25, .5, 0, .25);
    test_picture picture = test_picture_make(1, 1);
    test_render(&scene, NULL, &plain, &camera, 1, &picture);
    const float length = sqrtf(.3f * .3f + .8f * .8f);
    assert_float_equal(picture.planes.normal[0], .3f / length, 1e-6);
    assert_float_equal(picture.planes.normal[1], .8f / length, 1e-6);
    assert_float_equal(picture.planes.normal[2], 0, 1e-6);
    test_picture_free(&picture);
}

/* Also where the sun is behind the triangle, but not behind the normal; from outside, and inside no normal is lit but by
 * what comes over the rim. */
static void test_light_fades_evenly_on_a_coarse_column(void **state)
{
    (void)state;
    static test_barrel barrel;
    test_barrel_make(&barrel);
    test_picture picture = test_picture_make(96, 64);
    const nebel_camera outside = test_camera(.5, .3, 3, 0, 0, 0), inside = test_camera(0, 0, 0, -1, 0, 0);
    test_render(&barrel.scene, NULL, &plain, &outside, 1, &picture);
    assert_true(test_barrel_error(&barrel, picture.planes.color, picture.planes.normal, 96 * 64) < 1e-6);
    test_render(&barrel.scene, NULL, &plain, &inside, 1, &picture);
    for (size_t i = 0; i < 96 * 64 * 3; i++) assert_float_equal(picture.planes.color[i], 0, 0);
    test_picture_free(&picture);
}

static void test_textures_are_linear_bilinear_and_repeat(void **state)
{
    (void)state;
    const uint8_t texels[2 * 1 * 4] = {255, 0, 188, 255, 0, 255, 188, 255};
    const nebel_texture texture = {2, 1, texels};
    nebel_mesh square = test_square();
    square.uvs = test_square_uvs;
    square.texture = 0;
    for (int c = 0; c < 3; c++) square.base_color[c] = 1;
    const nebel_scene_data scene = {
        .mesh_count = 1, .meshes = &square, .texture_count = 1, .textures = &texture, .ambient = {1, 1, 1}};
    /* u = (x + 1) / 2: texel centres at x = -0.5 and 0.5; halfway both between them and across the seam. */
    const double places[4] = {-.5, .5, 0, -.999999}, red[4] = {1, 0, .5, .5};
    const double grey = pow((188 / 255.0 + .055) / 1.055, 2.4);
    test_picture picture = test_picture_make(1, 1);
    for (int i = 0; i < 4; i++) {
        nebel_camera camera = test_camera(places[i], 3, .3, places[i], 0, .3);
        test_render(&scene, NULL, &plain, &camera, 1, &picture);
        assert_true(fabs((double)picture.planes.color[0] - red[i]) < 2e-6);
        assert_true(fabs((double)picture.planes.color[1] - (1 - red[i])) < 2e-6);
        assert_true(fabs((double)picture.planes.color[2] - grey) < 2e-6);
    }
    test_picture_free(&picture);
}

/* ---- cameras --------------------------------------------------------------------------------- */

static uint32_t next_random(uint32_t *seed)
{
    *seed = *seed * 1664525u + 1013904223u;
    return *seed >> 8;
}

static double random_within(uint32_t *seed, double low, double high)
{
    return low + (high - low) * next_random(seed) / 0x1p24;
}

static void test_same_segment_same_light_for_every_camera(void **state)
{
    (void)state;
    static test_ball ball;
    test_ball_make(&ball, (const double[3]){0, 0, 0});
    nebel_lighting *fog = test_world_fog(.1, .5);
    test_picture pictures[3];
    for (int p = 0; p < 3; p++) pictures[p] = test_picture_make(1, 1);
    uint32_t seed = 7;
    for (int i = 0; i < 60; i++) {
        nebel_camera camera =
            test_camera(random_within(&seed, -3, 3), random_within(&seed, 1.5, 4), random_within(&seed, -3, 3),
                        random_within(&seed, -4, 4), -1, random_within(&seed, -4, 4));
        for (int p = 0; p < 3; p++) {
            camera.projection = (nebel_projection)p;
            test_render(&ball.scene, fog, &plain, &camera, 1, &pictures[p]);
        }
        for (int p = 1; p < 3; p++) {
            for (int c = 0; c < 3; c++) {
                assert_float_equal(pictures[p].planes.color[c], pictures[0].planes.color[c], 2e-6);
            }
            assert_float_equal(pictures[p].planes.depth[0], pictures[0].planes.depth[0], 1e-5);
        }
    }
    for (int p = 0; p < 3; p++) test_picture_free(&pictures[p]);
    nebel_release_lighting(fog);
}

/* Where a pixel of each projection looks, against the light of a ray cast by itself. */
static void test_pixels_look_where_they_should(void **state)
{
    (void)state;
    const double extinction = .1;
    nebel_lighting *fog = test_fog(
        1, &(nebel_volume_desc){.shape = {.type = NEBEL_SHAPE_ELLIPSOID, .center = {4, 3, -9}, .radii = {6, 3, 5}},
                                .extinction = {extinction, extinction, extinction},
                                .source = {1, 1, 1}});
    const nebel_scene_data scene = {.background = {0, 0, 0}};
    test_picture picture = test_picture_make(24, 12);
    for (int p = 0; p < 3; p++) {
        nebel_camera camera = test_camera(0, 0, 0, 0, 0, -5);
        camera.projection = (nebel_projection)p;
        camera.view_height = 12;
        test_render(&scene, fog, &plain, &camera, 1, &picture);
        for (uint32_t i = 0; i < 24 * 12; i++) {
            const double x = i % 24 + .5 - 12, y = 6 - (i / 24 + .5);
            const double t = tan(25 * test_pi / 180) / 6, longitude = x / 12 * test_pi, latitude = y / 6 * test_pi / 2;
            const nebel_ray rays[3] = {
                {{0, 0, 0}, {t * x, t * y, -1}, HUGE_VAL},
                {{x, y, 0}, {0, 0, -1}, HUGE_VAL},
                {{0, 0, 0},
                 {cos(latitude) * sin(longitude), sin(latitude), -cos(latitude) * cos(longitude)},
                 HUGE_VAL}};
            nebel_transfer transfer;
            fog_trace(fog, (nebel_trace_desc){0}, 1, &rays[p], &transfer);
            assert_true(fabs((double)picture.planes.color[3 * i] - transfer.in_scattering[0]) < 2e-4);
        }
    }
    test_picture_free(&picture);
    nebel_release_lighting(fog);
}

static void test_camera_inside_a_closed_mesh(void **state)
{
    (void)state;
    static test_ball ball;
    test_ball_make(&ball, (const double[3]){0, 0, 0});
    ball.scene.mesh_count = 1;
    nebel_camera camera = test_camera(0, 0, 0, 0, 0, -1);
    camera.projection = NEBEL_PROJECTION_PANORAMA;
    test_picture picture = test_picture_make(64, 32);
    test_render(&ball.scene, NULL, &plain, &camera, 4, &picture);
    for (uint32_t i = 0; i < 64 * 32; i++) {
        assert_in_range((uintmax_t)(1e6f * picture.planes.depth[i]), 993000, 1000001);
        assert_float_equal(picture.planes.color[3 * i], .8f * .2f, 1e-6); /* no sun comes in */
    }
    test_picture_free(&picture);
}

/* ---- bits ------------------------------------------------------------------------------------ */

static void assert_same_bytes(const test_picture *a, const test_picture *b)
{
    const size_t pixels = (size_t)a->width * a->height;
    assert_memory_equal(a->planes.color, b->planes.color, pixels * 3 * sizeof(float));
    assert_memory_equal(a->planes.transmittance, b->planes.transmittance, pixels * 3 * sizeof(float));
    assert_memory_equal(a->planes.in_scattering, b->planes.in_scattering, pixels * 3 * sizeof(float));
    assert_memory_equal(a->planes.depth, b->planes.depth, pixels * sizeof(float));
    assert_memory_equal(a->planes.normal, b->planes.normal, pixels * 3 * sizeof(float));
    assert_memory_equal(a->planes.error, b->planes.error, pixels * sizeof(float));
}

static void test_thread_count_changes_no_byte(void **state)
{
    (void)state;
    static test_ball ball;
    test_ball_make(&ball, (const double[3]){0, 0, 0});
    nebel_lighting *fog = test_world_fog(.1, .5);
    const nebel_camera camera = test_camera(2, 2, 5, 0, 0, 0);
    test_picture one = test_picture_make(150, 93), more = test_picture_make(150, 93);
    for (int p = 0; p < 3; p++) {
        nebel_camera moved = camera;
        moved.projection = (nebel_projection)p;
        test_render(&ball.scene, fog, &(nebel_cpu_renderer_desc){.thread_count = 1}, &moved, 5, &one);
        for (int threads = 2; threads < 6; threads += 3) {
            test_render(&ball.scene, fog, &(nebel_cpu_renderer_desc){.thread_count = threads}, &moved, 5, &more);
            assert_same_bytes(&one, &more);
        }
    }
    test_picture_free(&one);
    test_picture_free(&more);
    nebel_release_lighting(fog);
}

static void test_fog_in_any_instruction_set_changes_no_byte(void **state)
{
    (void)state;
    static test_ball ball;
    test_ball_make(&ball, (const double[3]){0, 0, 0});
    nebel_lighting *fog = test_world_fog(.1, .5);
    const nebel_frame_desc frame = {.camera = test_camera(2, 2, 5, 0, 0, 0), .width = 64, .height = 48, .samples = 2};
    nebel_renderer *renderer = NULL;
    assert_int_equal(nebel_create_cpu_renderer(&ball.scene, fog, &plain, &renderer), NEBEL_OK);
    test_picture scalar = test_picture_make(64, 48), other = test_picture_make(64, 48);
    renderer->fog_isa = NEBEL_ISA_SCALAR;
    assert_int_equal(nebel_render_frame(renderer, &frame, &scalar.planes), NEBEL_OK);
    for (int isa = NEBEL_ISA_SCALAR + 1; isa < NEBEL_ISA_COUNT; isa++) {
        if (!nebel_isa_available((nebel_isa)isa)) continue;
        renderer->fog_isa = (nebel_isa)isa;
        assert_int_equal(nebel_render_frame(renderer, &frame, &other.planes), NEBEL_OK);
        assert_same_bytes(&scalar, &other);
    }
    test_picture_free(&scalar);
    test_picture_free(&other);
    nebel_destroy_renderer(renderer);
    nebel_release_lighting(fog);
}

static void test_earlier_frames_change_no_byte(void **state)
{
    (void)state;
    static test_ball ball;
    test_ball_make(&ball, (const double[3]){0, 0, 0});
    ball.meshes[1].origin[0] = 5000; /* so that the scene is larger than a cell */
    const double places[3] = {5001, 0, 2500};
    nebel_renderer *renderer = NULL;
    assert_int_equal(nebel_create_cpu_renderer(&ball.scene, NULL, &plain, &renderer), NEBEL_OK);
    test_picture fresh = test_picture_make(40, 30), later = test_picture_make(40, 30);
    for (int i = 0; i < 3; i++) {
        const nebel_camera camera = test_camera(places[i], 2, 5, places[i], 0, 0);
        const nebel_frame_desc frame = {.camera = camera, .width = 40, .height = 30, .samples = 1};
        assert_int_equal(nebel_render_frame(renderer, &frame, &later.planes), NEBEL_OK);
        test_render(&ball.scene, NULL, &plain, &camera, 1, &fresh);
        assert_same_bytes(&fresh, &later);
    }
    nebel_destroy_renderer(renderer);
    test_picture_free(&fresh);
    test_picture_free(&later);
}

static void test_fog_of_a_frame_takes_the_place_of_that_before(void **state)
{
    (void)state;
    static test_ball ball;
    test_ball_make(&ball, (const double[3]){0, 0, 0});
    nebel_lighting *fogs[3] = {test_world_fog(.1, .5), NULL, test_world_fog(.3, .2)};
    const nebel_camera camera = test_camera(2, 2, 5, 0, 0, 0);
    const nebel_frame_desc frame = {.camera = camera, .width = 40, .height = 30, .samples = 1};
    nebel_renderer *renderer = NULL;
    assert_int_equal(nebel_create_cpu_renderer(&ball.scene, fogs[2], &plain, &renderer), NEBEL_OK);
    test_picture fresh = test_picture_make(40, 30), later = test_picture_make(40, 30);
    for (int i = 0; i < 3; i++) {
        assert_int_equal(nebel_set_renderer_lighting(renderer, fogs[i]), NEBEL_OK);
        assert_int_equal(nebel_set_renderer_lighting(renderer, fogs[i]), NEBEL_OK);
        assert_int_equal(nebel_render_frame(renderer, &frame, &later.planes), NEBEL_OK);
        test_render(&ball.scene, fogs[i], &plain, &camera, 1, &fresh);
        assert_same_bytes(&fresh, &later);
    }
    assert_int_equal(nebel_set_renderer_lighting(NULL, fogs[0]), NEBEL_ERROR_ARGUMENT);
    nebel_release_lighting(fogs[0]);
    nebel_release_lighting(fogs[2]);
    nebel_destroy_renderer(renderer);
    test_picture_free(&fresh);
    test_picture_free(&later);
}

/* ---- places far away ------------------------------------------------------------------------- */

/* How many pixels differ by more than a rounding error would let them. */
static size_t count_different(const test_picture *a, const test_picture *b, float tolerance)
{
    size_t different = 0;
    const size_t values = (size_t)a->width * a->height * 3;
    for (size_t i = 0; i < values; i++) different += fabsf(a->planes.color[i] - b->planes.color[i]) > tolerance;
    return different;
}

static void test_far_from_the_origin_is_as_good(void **state)
{
    (void)state;
    static test_ball ball;
    const double centers[2][3] = {{0, 0, 0}, {1e7, -3e6, 1e7}};
    test_picture pictures[2] = {test_picture_make(96, 64), test_picture_make(96, 64)};
    for (int i = 0; i < 2; i++) {
        const double *m = centers[i];
        test_ball_make(&ball, m);
        nebel_lighting *fog = test_fog(
            1, &(nebel_volume_desc){.shape = {.type = NEBEL_SHAPE_SPHERE, .center = {m[0], m[1], m[2]}, .radius = 3},
                                    .extinction = {.3, .3, .3},
                                    .source = {.7, .7, .7}});
        const nebel_camera camera = test_camera(m[0] + 2, m[1] + 2, m[2] + 5, m[0], m[1], m[2]);
        test_render(&ball.scene, fog, &plain, &camera, 1, &pictures[i]);
        nebel_release_lighting(fog);
    }
    assert_int_equal(count_different(&pictures[0], &pictures[1], 2e-5f), 0);
    for (int i = 0; i < 2; i++) test_picture_free(&pictures[i]);
}

/* From 10,000 km a ball of 1 m is a disc; through a long lens it has the outline that a parallel camera sees. */
static void test_telescope_sees_what_a_parallel_camera_sees(void **state)
{
    (void)state;
    static test_ball ball;
    test_ball_make(&ball, (const double[3]){0, 0, 0});
    ball.scene.mesh_count = 1;
    const double distance = 1e7;
    nebel_camera near_camera = test_camera(0, 0, 5, 0, 0, 0), far_camera = test_camera(0, 0, distance, 0, 0, 0);
    near_camera.projection = NEBEL_PROJECTION_ORTHOGRAPHIC;
    near_camera.view_height = 2.4;
    far_camera.vertical_fov = 2 * atan(1.2 / distance) * 180 / test_pi;
    test_picture near_picture = test_picture_make(96, 96), far_picture = test_picture_make(96, 96);
    test_render(&ball.scene, NULL, &plain, &near_camera, 1, &near_picture);
    test_render(&ball.scene, NULL, &plain, &far_camera, 1, &far_picture);
    assert_true(count_different(&near_picture, &far_picture, 1e-3f) < 12);
    assert_float_equal(test_depth(&far_picture, 48, 48), 9999999, 1);
    test_picture_free(&near_picture);
    test_picture_free(&far_picture);
}

/* ---- what may be missing --------------------------------------------------------------------- */

static void assert_background_only(const nebel_scene_data *scene)
{
    const nebel_camera camera = test_camera(0, 2, 5, 0, 0, 0);
    test_picture picture = test_picture_make(20, 17);
    test_render(scene, NULL, &plain, &camera, 0, &picture);
    for (uint32_t i = 0; i < 20 * 17; i++) {
        for (int c = 0; c < 3; c++) {
            assert_float_equal(picture.planes.color[3 * i + (uint32_t)c], scene->background[c], 1e-6);
            assert_float_equal(picture.planes.transmittance[3 * i + (uint32_t)c], 1, 0);
            assert_float_equal(picture.planes.normal[3 * i + (uint32_t)c], 0, 0);
        }
        assert_true(isinf(picture.planes.depth[i]));
    }
    test_picture_free(&picture);
}

static void test_nothing_to_see(void **state)
{
    (void)state;
    const float point[9] = {0}, nan_corner[9] = {-1, 0, 0, 1, 0, 0, 0, NAN, 0};
    const float line[9] = {-1, 0, 0, 0, 0, 0, 1, 0, 0}, huge[9] = {-3e38f, 0, 0, 3e38f, 0, 0, 0, 3e38f, 1};
    const float none_finite[9] = {NAN, 0, 0, INFINITY, 0, 0, NAN, 0, 0};
    const float *bodies[5] = {point, nan_corner, line, huge, none_finite};
    const uint32_t indices[3] = {0, 1, 2};
    nebel_scene_data scene = {
        .background = {.5, .6, .7}, .has_sun = 1, .sun_direction = {0, 1, 0}, .sun_irradiance = {1, 1, 1}};
    assert_background_only(&scene);
    nebel_mesh mesh = {.texture = -1};
    scene.mesh_count = 1;
    scene.meshes = &mesh;
    assert_background_only(&scene);
    for (int i = 0; i < 5; i++) {
        mesh = (nebel_mesh){
            .positions = bodies[i], .indices = indices, .vertex_count = 3, .triangle_count = 1, .texture = -1};
        assert_background_only(&scene);
    }
}

static void test_background_behind_endless_fog(void **state)
{
    (void)state;
    const nebel_scene_data scene = {.background = {.5, .6, .7}};
    nebel_lighting *fog = test_world_fog(1e-6, .25);
    const nebel_camera camera = test_camera(0, 2, 5, 0, 0, 0);
    test_picture picture = test_picture_make(3, 3);
    test_render(&scene, fog, &plain, &camera, 2, &picture);
    for (int i = 0; i < 9; i++) {
        assert_float_equal(picture.planes.color[3 * i], .25f, 1e-6);
        assert_float_equal(picture.planes.color[3 * i + 2], .5f, 1e-6);
        assert_float_equal(picture.planes.transmittance[3 * i], 0, 0);
    }
    test_picture_free(&picture);
    nebel_release_lighting(fog);
}

/* ---- samples --------------------------------------------------------------------------------- */

static void test_samples_are_stratified(void **state)
{
    (void)state;
    static nb_region_points points;
    static uint8_t columns[NB_PIXELS][64], rows[NB_PIXELS][64], cells[NB_PIXELS][64];
    const nb_sample_range range = nb_sample_range_of(64);
    for (uint32_t s = 0; s < 64; s++) {
        nb_sample_region(s, 64, &points);
        for (uint32_t i = 0; i < NB_PIXELS; i++) {
            const float x = points.x[i] - (float)nb_lane_x(i), y = points.y[i] - (float)nb_lane_y(i);
            assert_true(x >= range.low && x <= range.high && y >= range.low && y <= range.high);
            columns[i][(int)(x * 64)]++;
            rows[i][(int)(y * 64)]++;
            cells[i][(int)(x * 8) + 8 * (int)(y * 8)]++;
        }
    }
    for (int i = 0; i < NB_PIXELS * 64; i++) {
        assert_int_equal(columns[i / 64][i % 64], 1);
        assert_int_equal(rows[i / 64][i % 64], 1);
        assert_int_equal(cells[i / 64][i % 64], 1);
    }
}

static void test_an_edge_through_a_pixel_covers_half_of_it(void **state)
{
    (void)state;
    nebel_mesh square = test_square();
    const nebel_scene_data scene = {.mesh_count = 1, .meshes = &square, .ambient = {2, 2, 2}};
    nebel_camera camera = test_camera(1, 3, .1, 1, 0, .1); /* straight down on the edge at x = 1 */
    camera.projection = NEBEL_PROJECTION_ORTHOGRAPHIC;
    camera.view_height = .1;
    camera.up[1] = 0;
    camera.up[2] = -1;
    test_picture picture = test_picture_make(1, 1);
    for (uint32_t samples = 2; samples <= 256; samples *= 2) {
        test_render(&scene, NULL, &plain, &camera, samples, &picture);
        assert_float_equal(picture.planes.color[0], .5f, 1e-6);
        assert_float_equal(picture.planes.normal[1], .5f, 1e-6);
        assert_float_equal(picture.planes.depth[0], 3, 1e-5);
    }
    test_picture_free(&picture);
}

/* How much of a row the square covers falls evenly from row to row, and never rises: steps, no noise. */
static void test_a_leaning_edge_is_even(void **state)
{
    (void)state;
    nebel_mesh square = test_square();
    const nebel_scene_data scene = {.mesh_count = 1, .meshes = &square, .ambient = {2, 2, 2}};
    nebel_camera camera = test_camera(1, 3, .1, 1, 0, .1);
    camera.projection = NEBEL_PROJECTION_ORTHOGRAPHIC;
    camera.view_height = .1;
    camera.up[0] = -.02;
    camera.up[1] = 0;
    camera.up[2] = -1;
    test_picture picture = test_picture_make(8, 64);
    for (uint32_t samples = 2; samples <= 16; samples++) {
        double above = 8, first = 0;
        test_render(&scene, NULL, &plain, &camera, samples, &picture);
        for (uint32_t y = 0; y < 64; y++) {
            double covered = 0;
            for (uint32_t x = 0; x < 8; x++) covered += (double)picture.planes.color[3 * (8 * y + x)];
            if (y == 0) first = covered;
            assert_true(covered <= above + 1e-5);
            assert_true(fabs(covered - first + .02 * y) <= 2. / samples);
            above = covered;
        }
    }
    test_picture_free(&picture);
}

/* A wall of 4 m across the view, on ground of the given half width, in 5 m of fog that takes sunlight away. */
static void render_wall(double half_width, test_picture *picture)
{
    static const float wall[12] = {0, 0, -50, 0, 0, 50, 0, 4, 50, 0, 4, -50};
    const nebel_volume_desc mist = {.shape = {.type = NEBEL_SHAPE_HALF_SPACE, .point = {0, 5, 0}, .normal = {0, 1, 0}},
                                    .extinction = {.1, .1, .1}};
    float ground[12];
    nebel_mesh meshes[2] = {test_square(), test_square()};
    for (int i = 0; i < 12; i++) ground[i] = (float)half_width * test_square_positions[i];
    meshes[0].positions = ground;
    meshes[1].positions = wall;
    const nebel_scene_data scene = {
        .mesh_count = 2, .meshes = meshes, .has_sun = 1, .sun_direction = {-.6, .8, 0}, .sun_irradiance = {3, 3, 3}};
    nebel_camera camera = test_camera(.3, 20, .2, .3, 0, .2);
    camera.projection = NEBEL_PROJECTION_ORTHOGRAPHIC;
    camera.up[1] = 0;
    camera.up[2] = -1;
    nebel_lighting *fog = test_fog(1, &mist);
    test_render(&scene, fog, &plain, &camera, 1, picture);
    nebel_release_lighting(fog);
}

/* Triangles of 1e6 m lie in their fog, and in the shadow of what stands on them, as those of 10 m do. */
static void test_large_ground_is_lit_as_small_ground(void **state)
{
    (void)state;
    test_picture small = test_picture_make(40, 40), large = test_picture_make(40, 40);
    render_wall(10, &small);
    assert_true(test_color(&small, 25, 3)[0] == 0 && test_color(&small, 5, 3)[0] > .1f);
    for (double half_width = 100; half_width < 2e7; half_width *= 10) {
        render_wall(half_width, &large);
        for (uint32_t i = 0; i < 40 * 40; i++)
            for (int c = 0; c < 3; c++)
                assert_float_equal(test_color(&large, i % 40, i / 40)[c], test_color(&small, i % 40, i / 40)[c], 1e-4);
    }
    test_picture_free(&small);
    test_picture_free(&large);
}

static void test_means_of_planes_add_up(void **state)
{
    (void)state;
    static test_ball ball;
    test_ball_make(&ball, (const double[3]){0, 0, 0});
    ball.scene.has_sun = 0;
    ball.scene.mesh_count = 1;
    ball.scene.ambient[0] = 1;
    ball.scene.background[0] =
        .8; /* ball and background are equally bright, so that T * surface is known in the mean */
    nebel_lighting *fog = test_world_fog(.1, .5);
    const nebel_camera camera = test_camera(2, 2, 5, 0, 0, 0);
    test_picture picture = test_picture_make(50, 40);
    test_render(&ball.scene, fog, &plain, &camera, 3, &picture);
    for (uint32_t i = 0; i < 50 * 40; i++) {
        const float expected = picture.planes.transmittance[3 * i] * .8f + picture.planes.in_scattering[3 * i];
        assert_float_equal(picture.planes.color[3 * i], expected, 2e-6);
        assert_true(picture.planes.error[i] >= 0 && picture.planes.error[i] < 1e-4f);
    }
    test_picture_free(&picture);
    nebel_release_lighting(fog);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_wall_in_constant_fog),
        cmocka_unit_test(test_sun_through_fog_onto_ground),
        cmocka_unit_test(test_fog_that_begins_beyond_the_ground_still_dims_the_sun),
        cmocka_unit_test(test_shadow_leaves_the_ambient_light),
        cmocka_unit_test(test_surfaces_have_two_sides),
        cmocka_unit_test(test_smooth_normals_are_interpolated),
        cmocka_unit_test(test_light_fades_evenly_on_a_coarse_column),
        cmocka_unit_test(test_textures_are_linear_bilinear_and_repeat),
        cmocka_unit_test(test_same_segment_same_light_for_every_camera),
        cmocka_unit_test(test_pixels_look_where_they_should),
        cmocka_unit_test(test_camera_inside_a_closed_mesh),
        cmocka_unit_test(test_thread_count_changes_no_byte),
        cmocka_unit_test(test_fog_in_any_instruction_set_changes_no_byte),
        cmocka_unit_test(test_earlier_frames_change_no_byte),
        cmocka_unit_test(test_fog_of_a_frame_takes_the_place_of_that_before),
        cmocka_unit_test(test_far_from_the_origin_is_as_good),
        cmocka_unit_test(test_telescope_sees_what_a_parallel_camera_sees),
        cmocka_unit_test(test_nothing_to_see),
        cmocka_unit_test(test_background_behind_endless_fog),
        cmocka_unit_test(test_samples_are_stratified),
        cmocka_unit_test(test_an_edge_through_a_pixel_covers_half_of_it),
        cmocka_unit_test(test_a_leaning_edge_is_even),
        cmocka_unit_test(test_large_ground_is_lit_as_small_ground),
        cmocka_unit_test(test_means_of_planes_add_up),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
