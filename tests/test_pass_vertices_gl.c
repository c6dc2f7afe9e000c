/* Scenes in OpenGL with fog at the vertices of their surfaces: interpolated as old hardware does, and nearer to the
 * exact picture the finer the triangles are. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "fog_help.h"
#include "pass_help.h"

#include <nebel/classic.h>
#include <nebel/gl.h>

enum { WIDTH = 64, HEIGHT = 48, PIXELS = WIDTH * HEIGHT, FINEST = 96 };

/* ---- a scene --------------------------------------------------------------------------------- */

/* Far out, so that positions must count from the mesh's origin. */
static const double middle[3] = {3e6, -2e5, 7e6};

static nebel_camera camera_at(double x, double y, double z)
{
    nebel_camera camera = {.up = {0, 1, 0}, .vertical_fov = 70};
    const double from[3] = {x, y, z}, to[3] = {0, -1, -12};
    for (int k = 0; k < 3; k++) {
        camera.position[k] = middle[k] + from[k];
        camera.look_at[k] = middle[k] + to[k];
    }
    return camera;
}

/* A floor of `count` quads either way, beyond the lower edge of the picture; nothing above. */
typedef struct floor_mesh {
    float positions[(FINEST + 1) * (FINEST + 1)][3];
    uint32_t indices[6 * FINEST * FINEST];
    nebel_mesh mesh;
    nebel_scene_data scene;
} floor_mesh;

static void make_floor(floor_mesh *f, uint32_t count)
{
    uint32_t *index = f->indices;
    const uint32_t side = count + 1;
    for (uint32_t i = 0; i < side * side; i++) {
        f->positions[i][0] = 60 * ((float)(i % side) / (float)count - .5f);
        f->positions[i][1] = -3;
        f->positions[i][2] = 6 - 50 * (float)(i / side) / (float)count;
    }
    for (uint32_t i = 0; i < count * count; i++) {
        const uint32_t corner = i / count * side + i % count, above = corner + side;
        const uint32_t corners[6] = {corner, corner + 1, above, above, corner + 1, above + 1};
        for (int k = 0; k < 6; k++) *index++ = corners[k];
    }
    f->mesh = (nebel_mesh){.origin = {middle[0], middle[1], middle[2]},
                           .positions = f->positions[0],
                           .indices = f->indices,
                           .vertex_count = side * side,
                           .triangle_count = 2 * count * count,
                           .base_color = {.8f, .7f, .6f},
                           .texture = -1};
    f->scene =
        (nebel_scene_data){.background = {.1, .2, .3}, .ambient = {1, 1, 1}, .mesh_count = 1, .meshes = &f->mesh};
}

/* Two colours of light; grey, so that red's transmittance is all. */
static nebel_lighting *commit_mist(void)
{
    const nebel_volume_desc volumes[] = {
        {.shape = {.type = NEBEL_SHAPE_WORLD},
         .density = {.type = NEBEL_DENSITY_HEIGHT, .base = middle[1] - 3, .scale_height = 2},
         .extinction = {.05, .05, .05},
         .source = {.5, .6, .7}},
        {.shape = {.type = NEBEL_SHAPE_SPHERE, .center = {middle[0] + 2, middle[1] - 1, middle[2] - 14}, .radius = 5},
         .density = {.type = NEBEL_DENSITY_RADIAL, .power = 3},
         .extinction = {.2, .2, .2},
         .source = {.9, .4, .2}},
    };
    return fog_light(NULL, volumes, 2);
}

/* ---- pictures -------------------------------------------------------------------------------- */

typedef struct planes {
    float color[PIXELS][3], transmittance[PIXELS][3], in_scattering[PIXELS][3], depth[PIXELS];
} planes;

static void draw(nebel_gl_renderer *renderer, const nebel_camera *camera, nebel_gl_method method, planes *p)
{
    const nebel_gl_frame_desc desc = {
        .camera = *camera, .width = WIDTH, .height = HEIGHT, .samples = 1, .method = method};
    const nebel_gl_planes wanted = {.color = p->color[0],
                                    .transmittance = p->transmittance[0],
                                    .in_scattering = p->in_scattering[0],
                                    .depth = p->depth};
    assert_int_equal(nebel_gl_render_frame(renderer, &desc), NEBEL_OK);
    assert_int_equal(nebel_gl_read_planes(renderer, &wanted), NEBEL_OK);
}

static nebel_gl_renderer *create(const floor_mesh *floor, nebel_lighting *fog)
{
    nebel_gl_renderer *renderer = NULL;
    assert_int_equal(nebel_create_gl_renderer(&floor->scene, fog, &(nebel_gl_renderer_desc){0}, &renderer), NEBEL_OK);
    return renderer;
}

static void draw_alone(const floor_mesh *floor, nebel_lighting *fog, const nebel_camera *camera, nebel_gl_method method,
                       planes *p)
{
    nebel_gl_renderer *const renderer = create(floor, fog);
    draw(renderer, camera, method, p);
    nebel_destroy_gl_renderer(renderer);
}

static double largest_difference(const planes *a, const planes *b)
{
    double largest = 0;
    for (int i = 0; i < PIXELS; i++) {
        if (!isfinite(a->depth[i])) continue;
        for (int c = 0; c < 3; c++) {
            largest = fmax(largest, fabs((double)(a->transmittance[i][c] - b->transmittance[i][c])));
            largest = fmax(largest, fabs((double)(a->in_scattering[i][c] - b->in_scattering[i][c])));
        }
    }
    return largest;
}

/* ---- one triangle ---------------------------------------------------------------------------- */

static void make_triangle(floor_mesh *f)
{
    static const float corners[3][3] = {{-20, -3, 4}, {25, -3, -1}, {-4, -3, -40}};
    make_floor(f, 1);
    memcpy(f->positions, corners, sizeof corners);
    f->indices[0] = 0, f->indices[1] = 1, f->indices[2] = 2;
    f->mesh.vertex_count = 3;
    f->mesh.triangle_count = 1;
}

/* Weights of the corners at a place of the triangle, which is level. */
static void find_weights(const floor_mesh *f, const double place[3], double weights[3])
{
    const float(*const p)[3] = f->positions;
    for (int i = 0; i < 3; i++) {
        const float *const a = p[(i + 1) % 3], *const b = p[(i + 2) % 3], *const own = p[i];
        const double bx = (double)b[0] - (double)a[0], bz = (double)b[2] - (double)a[2];
        const double area = bx * ((double)own[2] - (double)a[2]) - bz * ((double)own[0] - (double)a[0]);
        weights[i] = (bx * (place[2] - (double)a[2]) - bz * (place[0] - (double)a[0])) / area;
    }
}

/* The light that fog adds, and its amount, interpolated where the pixel's ray meets the floor. */
static void interpolate(const floor_mesh *f, float corners[3][4], const nebel_view *view, int pixel, double wanted[4])
{
    const line ray = line_of(view, pixel % WIDTH + .5, HEIGHT - 1 - pixel / WIDTH + .5);
    const long double t = ((long double)middle[1] - 3 - ray.origin[1]) / ray.direction[1];
    double place[3], weights[3];
    for (int k = 0; k < 3; k++) place[k] = (double)(ray.origin[k] + t * ray.direction[k] - (long double)middle[k]);
    find_weights(f, place, weights);
    for (int k = 0; k < 4; k++) {
        wanted[k] = 0;
        for (int i = 0; i < 3; i++) wanted[k] += weights[i] * (double)corners[i][k];
    }
}

static void check_triangle(nb_gl_language language)
{
    static floor_mesh f;
    static planes p;
    float corners[3][4];
    double largest = 0;
    int seen = 0;
    nb_gl context;
    nebel_view view;
    nebel_lighting *const fog = commit_mist();
    const nebel_camera camera = camera_at(1, 1.5, 5);
    make_triangle(&f);
    nebel_vertices points = {.positions = f.positions};
    memcpy(points.origin, middle, sizeof points.origin);
    memcpy(points.eye, camera.position, sizeof points.eye);
    const nebel_vertex_output output = {NEBEL_VERTEX_RGBA_FLOAT, corners, 0};
    const nebel_snapshot *const snapshot = nebel_get_lighting_snapshot(fog);
    assert_int_equal(nebel_compute_vertex_fog(snapshot, NULL, 3, &points, &output, 1), NEBEL_OK);
    assert_int_equal(nebel_view_from_camera(&camera, WIDTH, HEIGHT, NULL, &view), NEBEL_OK);
    pass_open(&context, language);
    draw_alone(&f, fog, &camera, NEBEL_GL_METHOD_VERTEX, &p);
    for (int i = 0; i < PIXELS; i++) {
        double wanted[4] = {0};
        if (isfinite(p.depth[i])) interpolate(&f, corners, &view, i, wanted);
        seen += isfinite(p.depth[i]) != 0;
        for (int c = 0; c < 3; c++) {
            largest = fmax(largest, fabs((double)p.transmittance[i][c] - (1 - wanted[3])));
            largest = fmax(largest, fabs((double)p.in_scattering[i][c] - wanted[c]));
        }
    }
    print_message("one triangle: %d pixels, off by at most %.1e\n", seen, largest);
    assert_true(seen > PIXELS / 4 && seen < PIXELS);
    assert_true(largest <= 1e-5);
    pass_close(&context);
    nebel_release_lighting(fog);
}

static void test_fog_is_that_of_the_corners_interpolated(void **state)
{
    (void)state;
    check_triangle(NB_GL_330);
    check_triangle(NB_GL_300ES);
}

/* ---- many ------------------------------------------------------------------------------------ */

/* The error of interpolation falls with the square of the size of triangles that are small beside the fog. */
static void test_fine_triangles_are_nearly_exact(void **state)
{
    (void)state;
    static floor_mesh f;
    static planes exact, p;
    double last = 1;
    nb_gl context;
    nebel_lighting *const fog = commit_mist();
    const nebel_camera camera = camera_at(1, 1.5, 5);
    pass_open(&context, NB_GL_330);
    for (uint32_t count = 6; count <= FINEST; count *= 4) {
        make_floor(&f, count);
        draw_alone(&f, fog, &camera, NEBEL_GL_METHOD_EXACT, &exact);
        draw_alone(&f, fog, &camera, NEBEL_GL_METHOD_VERTEX, &p);
        const double largest = largest_difference(&exact, &p);
        print_message("%u x %u quads: %.1f/255 from the exact fog\n", (unsigned)count, (unsigned)count, 255 * largest);
        assert_true(largest < last / 3);
        last = largest;
    }
    assert_true(last < 1. / 255);
    pass_close(&context);
    nebel_release_lighting(fog);
}

static void test_additive_fog_hides_nothing(void **state)
{
    (void)state;
    static floor_mesh f;
    static planes vertex, additive;
    nb_gl context;
    nebel_lighting *const fog = commit_mist();
    const nebel_camera camera = camera_at(1, 1.5, 5);
    make_floor(&f, 12);
    pass_open(&context, NB_GL_330);
    draw_alone(&f, fog, &camera, NEBEL_GL_METHOD_VERTEX, &vertex);
    draw_alone(&f, fog, &camera, NEBEL_GL_METHOD_ADDITIVE, &additive);
    assert_memory_equal(vertex.in_scattering, additive.in_scattering, sizeof vertex.in_scattering);
    for (int i = 0; i < PIXELS; i++) {
        const int hit = isfinite(vertex.depth[i]) != 0;
        for (int c = 0; c < 3; c++) {
            const double surface = hit ? (double)f.mesh.base_color[c] : f.scene.background[c];
            assert_true(additive.transmittance[i][c] == 1);
            assert_true(fabs((double)additive.color[i][c] - surface - (double)additive.in_scattering[i][c]) < 1e-3);
            assert_true(hit || vertex.transmittance[i][c] == 1);
        }
    }
    pass_close(&context);
    nebel_release_lighting(fog);
}

/* ---- the renderer ---------------------------------------------------------------------------- */

/* One renderer, other eyes, other fog, other methods: each frame is that of a new one, and nothing is left behind. */
static void test_frames_do_not_depend_on_the_last(void **state)
{
    (void)state;
    static floor_mesh f;
    static planes again, fresh;
    nb_gl context;
    nebel_lighting *const mist = commit_mist(), *const nothing = fog_light(NULL, NULL, 0);
    const nebel_camera cameras[2] = {camera_at(1, 1.5, 5), camera_at(-3, .5, 2)};
    make_floor(&f, 12);
    pass_open(&context, NB_GL_330);
    const int objects = pass_count_objects();
    nebel_gl_renderer *const renderer = create(&f, NULL);
    for (int turn = 0; turn < 8; turn++) {
        nebel_lighting *const fog = turn == 7 ? NULL : turn == 3 ? nothing : mist;
        const nebel_gl_method method = turn % 3 == 2 ? NEBEL_GL_METHOD_EXACT : NEBEL_GL_METHOD_VERTEX;
        assert_int_equal(nebel_set_gl_renderer_lighting(renderer, fog), NEBEL_OK);
        draw(renderer, &cameras[turn % 2], method, &again);
        draw_alone(&f, fog, &cameras[turn % 2], method, &fresh);
        assert_memory_equal(&again, &fresh, sizeof again);
    }
    nebel_destroy_gl_renderer(renderer);
    assert_int_equal(pass_count_objects(), objects);
    pass_close(&context);
    nebel_release_lighting(mist);
    nebel_release_lighting(nothing);
}

/* ---- cells ----------------------------------------------------------------------------------- */

/* Fog on both sides of a wall with a door, far from the world's origin. */
static const nebel_cell rooms[] = {
    {.shape = {.type = NEBEL_SHAPE_BOX,
               .min = {-40, -4, -10},
               .max = {40, 9, 20},
               .transform = {.position = {3e6, -2e5, 7e6}}},
     .density = .02,
     .color = {.5, .6, .7}},
    {.shape = {.type = NEBEL_SHAPE_BOX,
               .min = {-40, -4, -60},
               .max = {40, 9, -10},
               .transform = {.position = {3e6, -2e5, 7e6}}},
     .density = .05,
     .color = {.9, .4, .2}},
};

static nebel_cells *create_rooms(void)
{
    static const double door[4][3] = {{3e6 - 1, -2e5 - 4, 7e6 - 10},
                                      {3e6 + 1, -2e5 - 4, 7e6 - 10},
                                      {3e6 + 1, -2e5, 7e6 - 10},
                                      {3e6 - 1, -2e5, 7e6 - 10}};
    static const nebel_portal portal = {{0, 1}, door, 4};
    const nebel_cells_desc desc = {
        .cells = rooms, .cell_count = 2, .portals = &portal, .portal_count = 1, .model = NEBEL_CELL_EXPONENTIAL};
    nebel_cells *cells = NULL;
    assert_int_equal(nebel_create_cells(&desc, &cells), NEBEL_OK);
    return cells;
}

/* At pixels walls count: through the door, or not at all beyond the wall. */
static void check_pixels(nebel_gl_renderer *renderer, nebel_gl_frame_desc desc, const nebel_cells *cells)
{
    static planes p;
    const nebel_gl_planes wanted = {
        .transmittance = p.transmittance[0], .in_scattering = p.in_scattering[0], .depth = p.depth};
    nebel_view view;
    int fogged = 0;
    desc.method = NEBEL_GL_METHOD_CELLS_PIXEL;
    assert_int_equal(nebel_view_from_camera(&desc.camera, WIDTH, HEIGHT, NULL, &view), NEBEL_OK);
    assert_int_equal(nebel_gl_render_frame(renderer, &desc), NEBEL_OK);
    assert_int_equal(nebel_gl_read_planes(renderer, &wanted), NEBEL_OK);
    for (int i = 0; i < PIXELS; i++) {
        nebel_cell_fog fog = {.alpha = 0};
        nebel_cell_point point = {.position = {0, 0, 0}};
        const line ray = line_of(&view, i % WIDTH + .5, HEIGHT - 1 - i / WIDTH + .5);
        nebel_cell_view from = {.forward = {0, 0, -1}};
        for (int k = 0; k < 3; k++) {
            from.eye[k] = desc.camera.position[k];
            point.position[k] = from.eye[k] + (double)p.depth[i] * (double)ray.direction[k];
        }
        if (isfinite(p.depth[i]))
            assert_int_equal(nebel_compute_cell_fog(cells, &from, 1, &point, 0, &fog, 0), NEBEL_OK);
        for (int c = 0; c < 3; c++) {
            assert_true(fabs((double)p.transmittance[i][c] - (1 - fog.alpha)) < 1e-5);
            assert_true(fabs((double)p.in_scattering[i][c] - fog.color[c]) < 1e-5);
        }
        fogged += fog.alpha > .1;
    }
    assert_true(fogged > PIXELS / 8);
}

/* Along the ray the exponential model is that of volumes; vertices behind the wall are fogged as if they were seen. */
static void test_cells_are_drawn_like_volumes(void **state)
{
    (void)state;
    static floor_mesh f;
    static planes by_volumes, by_cells;
    const nebel_volume_desc volumes[] = {nebel_volume_from_cell(&rooms[0]), nebel_volume_from_cell(&rooms[1])};
    nebel_lighting *const fog = fog_light(NULL, volumes, 2);
    nebel_cells *const cells = create_rooms();
    nb_gl context;
    nebel_gl_frame_desc desc = {.camera = camera_at(1, 1.5, 5),
                                .width = WIDTH,
                                .height = HEIGHT,
                                .samples = 1,
                                .method = NEBEL_GL_METHOD_CELLS};
    const nebel_gl_planes wanted = {.transmittance = by_cells.transmittance[0],
                                    .in_scattering = by_cells.in_scattering[0],
                                    .depth = by_cells.depth};
    make_floor(&f, 8);
    for (int language = 0; language < 2; language++) {
        pass_open(&context, language == 0 ? NB_GL_330 : NB_GL_300ES);
        draw_alone(&f, fog, &desc.camera, NEBEL_GL_METHOD_VERTEX, &by_volumes);
        nebel_gl_renderer *const renderer = create(&f, NULL);
        desc.cells = NULL;
        assert_int_equal(nebel_gl_render_frame(renderer, &desc), NEBEL_ERROR_ARGUMENT);
        desc.cells = cells;
        assert_int_equal(nebel_gl_render_frame(renderer, &desc), NEBEL_OK);
        assert_int_equal(nebel_gl_read_planes(renderer, &wanted), NEBEL_OK);
        assert_true(largest_difference(&by_volumes, &by_cells) < 2e-5);
        assert_true(by_cells.transmittance[PIXELS / 2 + WIDTH / 2][0] < .9f);
        check_pixels(renderer, desc, cells);
        nebel_destroy_gl_renderer(renderer);
        pass_close(&context);
    }
    nebel_destroy_cells(cells);
    nebel_release_lighting(fog);
}

/* ---- factors --------------------------------------------------------------------------------- */

static nebel_result draw_factor(nebel_gl_renderer *renderer, const nebel_camera *camera, nebel_gl_method method,
                                const nebel_factor_desc *factor, planes *p)
{
    const nebel_gl_frame_desc desc = {
        .camera = *camera, .width = WIDTH, .height = HEIGHT, .samples = 1, .method = method, .factor = factor};
    const nebel_gl_planes wanted = {
        .transmittance = p->transmittance[0], .in_scattering = p->in_scattering[0], .depth = p->depth};
    const nebel_result result = nebel_gl_render_frame(renderer, &desc);
    return result == NEBEL_OK ? nebel_gl_read_planes(renderer, &wanted) : result;
}

static double depth_of(const nebel_view *view, const double from_eye[3])
{
    double depth = 0;
    for (int k = 0; k < 3; k++) depth -= from_eye[k] * view->eye_from_world[4 * k + 2];
    return depth;
}

/* Written anew, of a place relative to the eye. */
static double factor_of(nebel_gl_method method, const nebel_factor_desc *factor, const nebel_view *view,
                        const double from_eye[3])
{
    const double radius = sqrt(from_eye[0] * from_eye[0] + from_eye[1] * from_eye[1] + from_eye[2] * from_eye[2]);
    const double c = factor->coordinate == NEBEL_COORDINATE_RADIAL ? radius : fabs(depth_of(view, from_eye));
    if (method == NEBEL_GL_METHOD_EXP) return exp(-factor->density * c);
    if (method == NEBEL_GL_METHOD_EXP2) return exp(-factor->density * factor->density * c * c);
    return fmin(fmax((factor->end - c) / (factor->end - factor->start), 0), 1);
}

static double factor_of_pixel(nebel_gl_method method, const nebel_factor_desc *factor, const nebel_view *view,
                              int pixel, double distance)
{
    const line ray = line_of(view, pixel % WIDTH + .5, HEIGHT - 1 - pixel / WIDTH + .5);
    double from_eye[3];
    for (int k = 0; k < 3; k++) from_eye[k] = distance * (double)ray.direction[k];
    return factor_of(method, factor, view, from_eye);
}

/* IEC 61966-2-1, from 0 to 1: what frame buffers store, which methods that imitate hardware blend. */
static double encode_srgb(double linear)
{
    return linear <= .0031308 ? 12.92 * linear : 1.055 * pow(linear, 1 / 2.4) - .055;
}

static void check_factor(nebel_gl_renderer *renderer, const floor_mesh *f, const nebel_camera *camera,
                         nebel_gl_method method, const nebel_factor_desc *factor)
{
    static planes p;
    nebel_view view;
    float corners[3][4] = {{0}};
    double lowest = 1, highest = 0;
    assert_int_equal(nebel_view_from_camera(camera, WIDTH, HEIGHT, NULL, &view), NEBEL_OK);
    for (int i = 0; i < 3; i++) {
        double from_eye[3];
        for (int k = 0; k < 3; k++) from_eye[k] = middle[k] + (double)f->positions[i][k] - camera->position[k];
        corners[i][3] = (float)(1 - factor_of(method, factor, &view, from_eye));
    }
    assert_int_equal(draw_factor(renderer, camera, method, factor, &p), NEBEL_OK);
    for (int i = 0; i < PIXELS; i++) {
        double wanted = 0, of_corners[4];
        if (isfinite(p.depth[i])) {
            interpolate(f, corners, &view, i, of_corners);
            wanted = factor->stage == NEBEL_STAGE_VERTEX
                         ? of_corners[3]
                         : 1 - factor_of_pixel(method, factor, &view, i, (double)p.depth[i]);
            lowest = fmin(lowest, wanted);
            highest = fmax(highest, wanted);
        }
        for (int c = 0; c < 3; c++) {
            assert_true(fabs((double)p.transmittance[i][c] - (1 - wanted)) < 2e-5);
            assert_true(fabs((double)p.in_scattering[i][c] - wanted * encode_srgb(factor->color[c])) < 2e-5);
        }
    }
    assert_true(highest - lowest > .2);
}

static void test_factors(void **state)
{
    (void)state;
    static floor_mesh f;
    static planes p;
    nb_gl context;
    nebel_lighting *const fog = commit_mist(); /* is not drawn */
    const nebel_camera camera = camera_at(1, 1.5, 5);
    const nebel_factor_desc bad = {.density = -1};
    make_triangle(&f);
    for (int language = 0; language < 2; language++) {
        pass_open(&context, language == 0 ? NB_GL_330 : NB_GL_300ES);
        const int objects = pass_count_objects();
        nebel_gl_renderer *const renderer = create(&f, fog);
        for (int way = 0; way < 12; way++) {
            const nebel_factor_desc factor = {.coordinate = (nebel_factor_coordinate)(way & 1),
                                              .stage = (nebel_factor_stage)(way >> 1 & 1),
                                              .start = 4,
                                              .end = 31,
                                              .density = .03,
                                              .color = {.9, .6, .3}};
            check_factor(renderer, &f, &camera, (nebel_gl_method)(NEBEL_GL_METHOD_LINEAR + way / 4), &factor);
        }
        assert_int_equal(draw_factor(renderer, &camera, NEBEL_GL_METHOD_EXP, NULL, &p), NEBEL_ERROR_ARGUMENT);
        for (int i = NEBEL_GL_METHOD_FOG_COORD; i <= NEBEL_GL_METHOD_D3D9; i++) {
            const nebel_result wanted = i == NEBEL_GL_METHOD_TWO_PASS ? NEBEL_OK : NEBEL_ERROR_ARGUMENT;
            assert_int_equal(draw_factor(renderer, &camera, (nebel_gl_method)i, NULL, &p), wanted);
        }
        assert_int_equal(draw_factor(renderer, &camera, NEBEL_GL_METHOD_EXP, &bad, &p), NEBEL_ERROR_VALUE);
        nebel_destroy_gl_renderer(renderer);
        assert_int_equal(pass_count_objects(), objects);
        pass_close(&context);
    }
    nebel_release_lighting(fog);
}

/* Start = end: all fog at vertices, a step at pixels. */
static void test_start_is_end(void **state)
{
    (void)state;
    static floor_mesh f;
    static planes p;
    nb_gl context;
    const nebel_camera camera = camera_at(1, 1.5, 5);
    nebel_factor_desc factor = {.coordinate = NEBEL_COORDINATE_RADIAL, .start = 15, .end = 15};
    make_floor(&f, 1);
    pass_open(&context, NB_GL_330);
    nebel_gl_renderer *const renderer = create(&f, NULL);
    for (int stage = 0; stage < 2; stage++) {
        int clear = 0, hidden = 0;
        factor.stage = (nebel_factor_stage)stage;
        assert_int_equal(draw_factor(renderer, &camera, NEBEL_GL_METHOD_LINEAR, &factor, &p), NEBEL_OK);
        for (int i = 0; i < PIXELS; i++) {
            const int is_clear = !isfinite(p.depth[i]) || (stage == 1 && p.depth[i] < 15);
            assert_true(fabs((double)p.transmittance[i][1] - is_clear) < 1e-6);
            clear += isfinite(p.depth[i]) && is_clear;
            hidden += !is_clear;
        }
        assert_true(hidden > 50 && (clear > 50) == (stage == 1));
    }
    nebel_destroy_gl_renderer(renderer);
    pass_close(&context);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_fog_is_that_of_the_corners_interpolated),
        cmocka_unit_test(test_fine_triangles_are_nearly_exact),
        cmocka_unit_test(test_additive_fog_hides_nothing),
        cmocka_unit_test(test_frames_do_not_depend_on_the_last),
        cmocka_unit_test(test_cells_are_drawn_like_volumes),
        cmocka_unit_test(test_factors),
        cmocka_unit_test(test_start_is_end),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
