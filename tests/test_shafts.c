/* Shadows of surfaces in fog that the sun or point lights light: ends against Embree's visibility, light against
 * closed forms and fine steps. */
#include "test_shadows.h"

#include "cpu/cpu_renderer.h"
#include "dice.h"

/* ---- ends of shadows ------------------------------------------------------------------------- */

enum { TRIANGLES = 700, PLACES = 40 };

/* Triangles of all sizes, long ones and needles among them. */
static void draw_triangles(uint64_t *numbers, float (*positions)[3])
{
    for (int t = 0; t < TRIANGLES; t++) {
        const double size = pow(10, dice(numbers, -2, 0.6));
        double center[3];
        for (int i = 0; i < 3; i++) center[i] = dice(numbers, -10, 10);
        for (int k = 0; k < 3; k++)
            for (int i = 0; i < 3; i++) positions[3 * t + k][i] = (float)(center[i] + size * dice(numbers, -1, 1));
    }
}

/* Large ones, all over each other: no cell of them is worth dividing. */
static void pile_triangles(uint64_t *numbers, float (*positions)[3])
{
    for (int i = 0; i < 3 * TRIANGLES; i++)
        for (int c = 0; c < 3; c++) positions[i][c] = (float)dice(numbers, -6, 6);
}

enum { WIDE = 16, HIGH = 12 };

/* Triangles with numbers of their own, every other time with holes: a texture of random alpha, up to four of which lie
 * across a triangle. Points into itself. */
typedef struct holed {
    float uvs[3 * TRIANGLES][2];
    uint8_t texels[HIGH * WIDE][4];
    uint32_t indices[3 * TRIANGLES];
    nebel_texture texture;
    nebel_mesh mesh;
    nebel_scene_data scene;
} holed;

static void set_holed(holed *h, uint64_t seed, float (*positions)[3])
{
    uint64_t numbers = 41 * seed + 3;
    for (uint32_t i = 0; i < 3 * TRIANGLES; i++) {
        h->indices[i] = i;
        for (int k = 0; k < 2; k++) h->uvs[i][k] = (float)dice(&numbers, -2, 2);
    }
    for (int i = 0; i < HIGH * WIDE; i++) h->texels[i][3] = (uint8_t)dice(&numbers, 0, 256);
    h->uvs[8][0] = NAN;
    h->texture = (nebel_texture){WIDE, HIGH, h->texels[0]};
    h->mesh = (nebel_mesh){.positions = positions[0],
                           .uvs = h->uvs[0],
                           .indices = h->indices,
                           .vertex_count = 3 * TRIANGLES,
                           .triangle_count = TRIANGLES,
                           .texture = -1,
                           .alpha_cutoff = seed % 2 == 1 ? 0.4f : 0};
    h->scene = (nebel_scene_data){.mesh_count = 1, .meshes = &h->mesh, .texture_count = 1, .textures = &h->texture};
}

typedef struct trial {
    nb_sun_cells cells;
    nb_shadow_tree tree;
    nb_sun_shafts shafts;
    nb_ray_batch rays;
    nb_view view;
    float distance[NB_BATCH];
    nb_eye_visibility eye;
    size_t boundaries, shadows, wrong;
} trial;

/* Whether a place t m from the fog's start is in shadow; NAN where an end is too near to say. */
static float shadow_at(const nebel_ray_visibility *lit, int ray, float t)
{
    float dark = 0;
    for (uint32_t i = lit->offsets[ray]; i < lit->offsets[ray + 1]; i++) {
        if (fabsf(lit->boundaries[i] - t) < 2e-4f + 1e-5f * t) return NAN;
        if (lit->boundaries[i] <= t) dark = 1 - dark;
    }
    return dark;
}

/* `point_light` NULL: the sun. */
static void compare_places(trial *run, const nb_geometry *geometry, const nebel_ray_visibility *lit,
                           const double sun[3], const nebel_light *light, int ray, uint64_t *numbers)
{
    const float skipped = (float)run->view.advance * run->rays.length[ray],
                far = fminf(run->distance[ray], skipped + 60);
    for (int k = 0; k < PLACES && skipped < far; k++) {
        const float t = (float)dice(numbers, (double)skipped, (double)far), expected = shadow_at(lit, ray, t);
        float place[3];
        if (isnan(expected)) continue;
        for (int i = 0; i < 3; i++) place[i] = run->rays.start[i][ray] + (t - skipped) * run->rays.unit[i][ray];
        const int dark =
            light != NULL ? is_in_shadow_of_light(geometry, place, light) : is_in_shadow(geometry, place, sun);
        run->shadows += (size_t)dark;
        run->wrong += dark != (expected > 0);
    }
}

static void expect_rising(const nebel_ray_visibility *lit, int ray)
{
    for (uint32_t k = lit->offsets[ray] + 1; k < lit->offsets[ray + 1]; k++)
        assert_true(lit->boundaries[k] >= lit->boundaries[k - 1]);
}

static nb_geometry place_triangles(const nebel_scene_data *scene, const nebel_camera *camera, nb_view *view)
{
    nb_geometry geometry = {.allocator = nb_resolve_allocator(&(nebel_allocator){0})};
    assert_int_equal(nb_geometry_make(&geometry, scene, NEBEL_ISA_DEFAULT, 1), NEBEL_OK);
    assert_int_equal(nb_geometry_place(&geometry, camera->position), NEBEL_OK);
    assert_int_equal(nb_view_set(view, camera, 64, 64, &(nebel_log){0}), NEBEL_OK);
    nb_view_place(view, geometry.origin, geometry.bounds_min, geometry.bounds_max);
    return geometry;
}

/* From all sides, from near and far. */
static nebel_camera trial_camera(uint64_t seed)
{
    static const nebel_projection projections[] = {NEBEL_PROJECTION_PERSPECTIVE, NEBEL_PROJECTION_ORTHOGRAPHIC,
                                                   NEBEL_PROJECTION_PANORAMA};
    nebel_camera camera = test_camera(3, 2, seed % 4 == 3 ? 900 : 22, 0, 0, 0);
    camera.projection = projections[seed % 3];
    camera.vertical_fov = seed % 4 == 3 ? 2 : 50;
    camera.view_height = 25;
    return camera;
}

static void report_trial(const trial *run)
{
    print_message("%zu ends, %zu places in shadow, %zu wrong\n", run->boundaries, run->shadows, run->wrong);
    assert_true(run->boundaries > 10000 && run->shadows > 10000);
    assert_true(run->wrong <= run->shadows / 10000);
}

/* Up to the surfaces that the rays meet. */
static void end_at_surfaces(const nb_geometry *geometry, trial *run)
{
    for (int i = 0; i < NB_BATCH; i++) {
        struct RTCIntersectContext context;
        struct RTCRayHit ray = {.ray = {.tfar = INFINITY, .mask = UINT32_MAX}, .hit = {.geomID = NB_NONE}};
        ray.ray.org_x = run->rays.start[0][i];
        ray.ray.org_y = run->rays.start[1][i];
        ray.ray.org_z = run->rays.start[2][i];
        ray.ray.dir_x = run->rays.unit[0][i];
        ray.ray.dir_y = run->rays.unit[1][i];
        ray.ray.dir_z = run->rays.unit[2][i];
        rtcInitIntersectContext(&context);
        rtcIntersect1(geometry->scene, &context, &ray);
        run->distance[i] = (float)run->view.advance * run->rays.length[i] + ray.ray.tfar;
    }
}

/* With the sun from different sides, level and straight above among them. `is_seen` asks for what the eye sees only. */
static void try_scene(const nebel_scene_data *scene, uint64_t seed, uint64_t numbers, int is_seen, trial *run)
{
    double sun[3] = {dice(&numbers, -1, 1), seed == 3 ? 0 : dice(&numbers, 0, 1), seed == 4 ? 0 : 1};
    if (seed == 5) sun[0] = sun[1] = 0;
    nb_vector_make_unit(sun);
    const nebel_camera camera = trial_camera(seed);
    nb_geometry geometry = place_triangles(scene, &camera, &run->view);
    assert_int_equal(nb_sun_cells_set(&run->cells, &geometry, sun), NEBEL_OK);
    run->eye = is_seen ? nb_sun_shafts_eye(&run->cells, &geometry, &run->view) : NB_EYE_UNKNOWN;
    nb_region_points points;
    nb_sample_region(0, 1, &points);
    for (int first = 0; first < NB_PIXELS; first += 4 * NB_BATCH) {
        const nb_lit_box box = {{-12, -12, -12}, {12, seed == 2 ? 3 : 12, 12}};
        nb_view_rays(&run->view, 0, 0, points.x + first, points.y + first, &run->rays);
        for (int i = 0; i < NB_BATCH; i++) run->distance[i] = i % 5 == 0 ? 20 : INFINITY;
        if (is_seen) end_at_surfaces(&geometry, run);
        const nb_lit_box all = {{-INFINITY, -INFINITY, -INFINITY}, {INFINITY, INFINITY, INFINITY}};
        assert_int_equal(nb_sun_shafts_find(&run->shafts, &geometry.allocator, &run->cells, seed == 2 ? &box : &all,
                                            &run->rays, run->view.advance, run->distance, run->eye),
                         NEBEL_OK);
        run->boundaries += run->shafts.boundary_count;
        const nebel_ray_visibility lit = {run->shafts.first, run->shafts.boundaries};
        for (int i = 0; i < NB_BATCH; i++) {
            expect_rising(&lit, i);
            if (seed != 2) compare_places(run, &geometry, &lit, sun, NULL, i, &numbers);
        }
    }
    nb_geometry_free(&geometry);
}

static void end_trial(trial *run)
{
    const nebel_allocator allocator = nb_resolve_allocator(&(nebel_allocator){0});
    nb_sun_shafts_free(&run->shafts, &allocator);
    report_trial(run);
}

static void try_triangles(int is_seen, trial *run)
{
    static float positions[3 * TRIANGLES][3];
    static holed h;
    const nebel_allocator allocator = nb_resolve_allocator(&(nebel_allocator){0});
    for (uint64_t seed = 0; seed < 12; seed++) {
        uint64_t numbers = 31 * seed + 7;
        if (seed == 8)
            pile_triangles(&numbers, positions);
        else
            draw_triangles(&numbers, positions);
        positions[5][1] = NAN;
        set_holed(&h, seed, positions);
        try_scene(&h.scene, seed, numbers, is_seen, run);
        nb_sun_cells_free(&run->cells, &allocator);
    }
}

/* One in 10,000 places may be within rounding of a needle. */
static void ends_are_those_of_visibility(void **state)
{
    static trial run;
    (void)state;
    try_triangles(0, &run);
    assert_int_equal(run.shafts.by_walls, 0);
    end_trial(&run);
}

static void report_walls(const trial *run)
{
    print_message("%zu packets by walls, %zu by prisms\n", run->shafts.by_walls, run->shafts.by_prisms);
}

/* Triangles through each other, of which some pictures have holes, and some no eye. */
static void ends_before_surfaces_are_those_of_visibility(void **state)
{
    static trial run;
    (void)state;
    try_triangles(1, &run);
    report_walls(&run);
    assert_true(run.shafts.by_walls > 100);
    end_trial(&run);
}

enum { FIELDS = 48, FIELD_POINTS = (FIELDS + 1) * (FIELDS + 1) };

/* Steep hills, whose slopes hide each other; with holes, and triangles whose corners go round the wrong way, where
 * `is_torn`. Returns how many indices there are. */
static uint32_t draw_hills(uint64_t *numbers, int is_torn, float (*positions)[3], uint32_t *indices)
{
    uint32_t count = 0;
    for (uint32_t i = 0; i < FIELD_POINTS; i++) {
        const double x = (double)(i % (FIELDS + 1)) / FIELDS, z = (double)(i / (FIELDS + 1)) / FIELDS;
        positions[i][0] = (float)(20 * x - 10);
        positions[i][1] = (float)(2 * sin(17 * x) * sin(11 * z) + dice(numbers, -0.4, 0.4));
        positions[i][2] = (float)(20 * z - 10);
    }
    for (uint32_t i = 0; i < FIELDS * FIELDS; i++) {
        const uint32_t a = i / FIELDS * (FIELDS + 1) + i % FIELDS, c = a + FIELDS + 1;
        const uint32_t corners[2][6] = {{a, c, c + 1, a, c + 1, a + 1}, {a, c + 1, c, a, c + 1, a + 1}};
        const double fate = is_torn ? dice(numbers, 0, 1) : 1;
        if (fate < 0.05) continue;
        memcpy(indices + count, corners[fate < 0.1], sizeof corners[0]);
        count += 6;
    }
    return count;
}

static size_t count_covered(const nb_sun_cells *cells)
{
    size_t count = 0;
    for (size_t i = 0; i < cells->node_count; i++)
        for (int k = 0; k < NB_CELL_FAN; k++) count += isfinite(cells->nodes[i].covered[k]) ? 1 : 0;
    return count;
}

/* Returns how many cells are covered. */
static size_t try_hills(int is_seen, trial *run)
{
    static float positions[FIELD_POINTS][3];
    static uint32_t indices[6 * FIELDS * FIELDS];
    static holed h;
    size_t covered = 0;
    const nebel_allocator allocator = nb_resolve_allocator(&(nebel_allocator){0});
    for (uint64_t seed = 0; seed < 12; seed++) {
        uint64_t numbers = 41 * seed + 3;
        const uint32_t count = draw_hills(&numbers, seed % 2 == 1, positions, indices);
        set_holed(&h, seed, positions);
        h.mesh = (nebel_mesh){.positions = positions[0],
                              .uvs = &positions[0][0], /* any */
                              .indices = indices,
                              .vertex_count = FIELD_POINTS,
                              .triangle_count = count / 3,
                              .texture = -1,
                              .alpha_cutoff = seed % 4 == 2 ? 0.4f : 0};
        try_scene(&h.scene, seed, numbers, is_seen, run);
        covered += count_covered(&run->cells);
        nb_sun_cells_free(&run->cells, &allocator);
    }
    return covered;
}

/* Where a landscape covers cells, and where it does not quite. */
static void ends_behind_hills_are_those_of_visibility(void **state)
{
    static trial run;
    (void)state;
    const size_t covered = try_hills(0, &run);
    print_message("%zu cells are covered\n", covered);
    assert_true(covered > 1000);
    end_trial(&run);
}

static void ends_before_hills_are_those_of_visibility(void **state)
{
    static trial run;
    (void)state;
    (void)try_hills(1, &run);
    report_walls(&run);
    assert_true(run.shafts.by_walls > 370);
    end_trial(&run);
}

enum { LEAVES = 20000 };

/* Few leaves have walls; where there are many with others over each it ends before all walls are found, and prisms are
 * cut. */
static void ends_among_leaves_are_those_of_visibility(void **state)
{
    static trial run;
    static float positions[3 * LEAVES][3];
    static uint32_t indices[3 * LEAVES];
    const nebel_allocator allocator = nb_resolve_allocator(&(nebel_allocator){0});
    uint64_t numbers = 11;
    (void)state;
    for (uint32_t i = 0; i < 3 * LEAVES; i++) {
        indices[i] = i;
        for (int c = 0; c < 3; c++)
            positions[i][c] = (float)(i % 3 == 0 ? dice(&numbers, -9, 9)
                                                 : (double)positions[i - i % 3][c] + dice(&numbers, -0.7, 0.7));
    }
    for (uint64_t turn = 0; turn < 8; turn++) {
        const uint32_t count = turn % 2 == 0 ? LEAVES / 20 : LEAVES;
        const size_t before = run.shafts.by_walls;
        nebel_mesh mesh = {.positions = positions[0],
                           .indices = indices,
                           .vertex_count = 3 * count,
                           .triangle_count = count,
                           .texture = -1};
        try_scene(&(nebel_scene_data){.mesh_count = 1, .meshes = &mesh}, turn / 2 * 3, numbers, 1, &run);
        assert_true(run.eye != NB_EYE_UNKNOWN);
        assert_int_equal(run.shafts.by_walls > before, count < LEAVES);
        nb_sun_cells_free(&run.cells, &allocator);
    }
    report_walls(&run);
    end_trial(&run);
}

enum { LIGHTS = 4 };

static nebel_lighting *point_lit_fog(const nebel_volume_desc *volume, size_t count, const nebel_light *point_lights)
{
    const nebel_lighting_desc lights = {.lights = point_lights, .light_count = count};
    return fog_commit_lit(&(nebel_fog_desc){0}, volume, 1, &lights);
}

/* Point lights among the triangles; the larger ones have some of them within their radius, wholly or in part. */
static void draw_lights(uint64_t *numbers, nebel_light *lights)
{
    for (int i = 0; i < LIGHTS; i++) {
        lights[i] = (nebel_light){.intensity = {1, 1, 1}, .radius = i > 0 ? pow(10, dice(numbers, -2, 0.5)) : 0};
        for (int c = 0; c < 3; c++) lights[i].position[c] = dice(numbers, -10, 10);
    }
}

static void ends_of_point_light_are_those_of_visibility(void **state)
{
    static float positions[3 * TRIANGLES][3];
    static holed h;
    static trial run;
    static nb_light_shafts shafts;
    (void)state;
    for (uint64_t seed = 0; seed < 12; seed++) {
        uint64_t numbers = 37 * seed + 5;
        nebel_light lights[LIGHTS];
        draw_triangles(&numbers, positions);
        draw_lights(&numbers, lights);
        positions[5][1] = NAN;
        set_holed(&h, seed, positions);
        const nebel_volume_desc volume = {.extinction = {1, 1, 1}, .albedo = {1, 1, 1}};
        nebel_lighting *fog = point_lit_fog(&volume, LIGHTS, lights);
        nebel_camera camera = trial_camera(seed);
        if (seed == 4) memcpy(camera.look_at, lights[1].position, sizeof camera.look_at);
        nb_geometry geometry = place_triangles(&h.scene, &camera, &run.view);
        assert_int_equal(nb_shadow_tree_set_lights(&run.tree, &geometry, 1), NEBEL_OK);
        nb_region_points points;
        nb_sample_region(0, 1, &points);
        for (int first = 0; first < NB_PIXELS; first += 8 * NB_BATCH) {
            const nb_lit_box all = {{-INFINITY, -INFINITY, -INFINITY}, {INFINITY, INFINITY, INFINITY}};
            nb_view_rays(&run.view, 0, 0, points.x + first, points.y + first, &run.rays);
            for (int i = 0; i < NB_BATCH; i++) run.distance[i] = i % 5 == 0 ? 20 : INFINITY;
            assert_int_equal(nb_light_shafts_find(&shafts, &geometry.allocator, &run.tree, fog, &all, &run.rays,
                                                  run.view.advance, run.distance),
                             NEBEL_OK);
            run.boundaries += shafts.shafts.boundary_count;
            for (int l = 0; l < LIGHTS; l++)
                for (int i = 0; i < NB_BATCH; i++) {
                    expect_rising(&shafts.pieces[l], i);
                    compare_places(&run, &geometry, &shafts.pieces[l], NULL, &lights[l], i, &numbers);
                }
        }
        nb_shadow_tree_free(&run.tree, &geometry.allocator);
        nb_geometry_free(&geometry);
        nebel_release_lighting(fog);
    }
    const nebel_allocator allocator = nb_resolve_allocator(&(nebel_allocator){0});
    nb_light_shafts_free(&shafts, &allocator);
    report_trial(&run);
}

/* ---- light ----------------------------------------------------------------------------------- */

enum { SIDE = 24 };

static const float box_corners[8][3] = {{-1, 10, -2}, {1, 10, -2}, {-1, 11, -2}, {1, 11, -2},
                                        {-1, 10, 2},  {1, 10, 2},  {-1, 11, 2},  {1, 11, 2}};
static const uint32_t box_indices[36] = {0, 1, 3, 0, 3, 2, 4, 5, 7, 4, 7, 6, 0, 1, 5, 0, 5, 4,
                                         2, 3, 7, 2, 7, 6, 0, 2, 6, 0, 6, 4, 1, 3, 7, 1, 7, 5};

static nebel_mesh box_mesh(void)
{
    return (nebel_mesh){.positions = box_corners[0],
                        .indices = box_indices,
                        .vertex_count = 8,
                        .triangle_count = 12,
                        .base_color = {.5f, .5f, .5f},
                        .texture = -1};
}

/* What level rays through a layer gather from a to b where the sun shines; the layer ends at y = 10. */
static double layer_light(double s, double albedo, double y, double rise, double a, double b)
{
    return albedo / (4 * test_pi) * exp(-s * (10 - y) / rise) * (exp(-s * a) - exp(-s * b));
}

/* A box above a layer of even fog: level rays cross its shadow, whose ends are planes. */
static void the_shadow_of_a_box_is_cut_out(void **state)
{
    const double s = 0.03, albedo = 0.9, rise = 0.8, slant = 0.6 / rise;
    const nebel_plane planes[] = {{{0, -1, 0}, 0}, {{0, 1, 0}, 10}};
    const nebel_volume_desc layer = {.shape = {.type = NEBEL_SHAPE_CONVEX, .planes = planes, .plane_count = 2},
                                     .extinction = {s, s, s},
                                     .albedo = {albedo, albedo, albedo}};
    const nebel_lighting_desc lights = {.sun = {.direction = {0.6, 0.8, 0}, .irradiance = {1, 1, 1}}};
    const nebel_mesh mesh = box_mesh();
    const nebel_scene_data scene = {.mesh_count = 1, .meshes = &mesh};
    nebel_camera camera = test_camera(-20, 5, 0, 0, 5, 0);
    nebel_lighting *fog = fog_commit_lit(&(nebel_fog_desc){0}, &layer, 1, &lights);
    test_picture picture = test_picture_make(SIDE, SIDE);
    nebel_renderer *renderer = NULL;
    int dark = 0;
    (void)state;
    camera.projection = NEBEL_PROJECTION_ORTHOGRAPHIC;
    camera.view_height = 9;
    assert_int_equal(nebel_create_cpu_renderer(&scene, fog, &(nebel_cpu_renderer_desc){0}, &renderer), NEBEL_OK);
    const nebel_frame_desc frame = {.camera = camera, .width = SIDE, .height = SIDE, .samples = 1, .tolerance = 1e-6};
    assert_int_equal(nebel_render_frame(renderer, &frame, &picture.planes), NEBEL_OK);
    for (uint32_t i = 0; i < SIDE; i++)
        for (uint32_t k = 0; k < SIDE; k++) {
            const double y = 5 + (0.5 * SIDE - 0.5 - i) / SIDE * 9, z = (k + 0.5 - 0.5 * SIDE) / SIDE * 9;
            double light = layer_light(s, albedo, y, rise, 0, HUGE_VAL);
            if (fabs(z) < 2) {
                light -= layer_light(s, albedo, y, rise, 19 - (11 - y) * slant, 21 - (10 - y) * slant);
                dark++;
            }
            assert_true(fabs((double)test_in_scattering(&picture, k, i)[1] - light) < 2e-6);
        }
    assert_true(dark > 200);
    nebel_destroy_renderer(renderer);
    nebel_release_lighting(fog);
    test_picture_free(&picture);
}

enum { STEPS = 8000 };

/* Pillars, some of them with holes, and a floor in height fog, integrated in small steps, at each of which Embree says whether the sun shines. */
static double stepped_light(const nb_geometry *geometry, const float from[3], const float way[3], double begin,
                            double end, const double sun[3])
{
    const double s = 0.05, scale = 8, h = (end - begin) / STEPS, high = (double)from[1] + geometry->origin[1];
    double sum = 0;
    for (int i = 0; i < STEPS; i++) {
        const double t = begin + (i + 0.5) * h, y = high + t * (double)way[1], slope = (double)way[1] / scale;
        const double density = s * exp(-y / scale), start = s * exp(-high / scale);
        const double depth = fabs(slope * t) < 1e-9 ? start * t : start * -expm1(-slope * t) / slope;
        float place[3];
        for (int c = 0; c < 3; c++) place[c] = from[c] + (float)t * way[c];
        if (!is_in_shadow(geometry, place, sun)) sum += density * exp(-depth - density * scale / sun[1]) * h;
    }
    return sum;
}

enum { PILLARS = 5 };

/* Points into itself. */
typedef struct pillars {
    uint8_t texels[16][4];
    nebel_texture texture;
    nebel_mesh meshes[PILLARS + 1];
    nebel_scene_data scene;
    nebel_lighting *fog;
    nebel_camera camera;
    double sun[3];
} pillars;

static void set_pillars(pillars *p)
{
    static const float floor[] = {-60, 0, -60, -60, 0, 60, 60, 0, 60, 60, 0, -60};
    static const float corners[8][2] = {{0, 0}, {1, .2f}, {.1f, .5f}, {1, .6f}, {.9f, 1}, {2, 1}, {1, 1.5f}, {2, 1.6f}};
    const nebel_volume_desc volume = {.density = {.type = NEBEL_DENSITY_HEIGHT, .scale_height = 8},
                                      .extinction = {.05, .05, .05},
                                      .albedo = {1, 1, 1}};
    *p = (pillars){.camera = test_camera(6, 3, 24, 0, 4, 0), .sun = {-0.8, 0.35, -0.3}};
    nb_vector_make_unit(p->sun);
    const nebel_lighting_desc lights = {
        .sun = {.direction = {p->sun[0], p->sun[1], p->sun[2]}, .irradiance = {20, 10, 5}}};
    p->fog = fog_commit_lit(&(nebel_fog_desc){0}, &volume, 1, &lights);
    for (int i = 0; i < PILLARS; i++) {
        p->meshes[i] = box_mesh();
        p->meshes[i].origin[0] = 5 * i - 12;
        p->meshes[i].origin[1] = -5;
        p->meshes[i].origin[2] = i % 2 ? 4 : -3;
        p->meshes[i].uvs = corners[0];
        p->meshes[i].alpha_cutoff = i % 2 ? 0.5f : 0;
    }
    for (int i = 0; i < 16; i++) p->texels[i][3] = (uint8_t)(i * 89);
    p->texture = (nebel_texture){4, 4, p->texels[0]};
    p->meshes[PILLARS] = test_square();
    p->meshes[PILLARS].positions = floor;
    p->scene =
        (nebel_scene_data){.mesh_count = PILLARS + 1, .meshes = p->meshes, .texture_count = 1, .textures = &p->texture};
}

static void shafts_are_those_of_small_steps(void **state)
{
    pillars p;
    test_picture picture = test_picture_make(SIDE, SIDE);
    nebel_renderer *renderer = NULL;
    (void)state;
    set_pillars(&p);
    assert_int_equal(nebel_create_cpu_renderer(&p.scene, p.fog, &(nebel_cpu_renderer_desc){0}, &renderer), NEBEL_OK);
    const nebel_frame_desc frame = {.camera = p.camera, .width = SIDE, .height = SIDE, .samples = 1};
    assert_int_equal(nebel_render_frame(renderer, &frame, &picture.planes), NEBEL_OK);
    double worst = 0, square = 0;
    static nb_ray_batch rays;
    nb_view view;
    nb_region_points points;
    nb_sample_region(0, 1, &points);
    assert_int_equal(nb_view_set(&view, &p.camera, SIDE, SIDE, &(nebel_log){0}), NEBEL_OK);
    nb_view_place(&view, renderer->geometry.origin, renderer->geometry.bounds_min, renderer->geometry.bounds_max);
    assert_true(view.advance <= 0);
    for (uint32_t first = 0; first < NB_PIXELS; first += NB_BATCH) {
        nb_view_rays(&view, 0, 0, points.x + first, points.y + first, &rays);
        for (uint32_t i = 0; i < NB_BATCH; i++) {
            const uint32_t x = nb_lane_x(first + i), y = nb_lane_y(first + i);
            if (x >= SIDE || y >= SIDE || !nb_test_tries(y * SIDE + x, SIDE * SIDE)) continue;
            float from[3], way[3];
            for (int c = 0; c < 3; c++) {
                from[c] = rays.start[c][i];
                way[c] = rays.unit[c][i];
            }
            /* finer where shadows are */
            const double length = fmin((double)test_depth(&picture, x, y), 5000), near = fmin(length, 100);
            const double light = (stepped_light(&renderer->geometry, from, way, 0, near, p.sun) +
                                  stepped_light(&renderer->geometry, from, way, near, length, p.sun)) *
                                 10 / (4 * test_pi);
            const double off = fabs((double)test_in_scattering(&picture, x, y)[1] - light);
            worst = fmax(worst, off);
            square += off * off;
        }
    }
    print_message("off by at most %.5f, %.6f in the root mean square\n", worst, sqrt(square / SIDE / SIDE));
    assert_true(worst < 0.002);
    nebel_destroy_renderer(renderer);
    nebel_release_lighting(p.fog);
    test_picture_free(&picture);
}

/* Point lights between the pillars in even fog; one has a bulb of triangles around it, one shines down. */
static void set_point_lit_pillars(pillars *p, nebel_light lights[2])
{
    const nebel_volume_desc volume = {.extinction = {.05, .05, .05}, .albedo = {1, 1, 1}};
    set_pillars(p);
    nebel_release_lighting(p->fog);
    lights[0] = (nebel_light){.position = {0.5, 5.2, 1}, .intensity = {50, 100, 150}, .radius = 0.3};
    lights[1] = (nebel_light){.type = NEBEL_LIGHT_SPOT,
                              .position = {-7, 8, 6},
                              .intensity = {80, 120, 20},
                              .radius = 0.2,
                              .direction = {0.3, -1, -0.6},
                              .inner_angle = 30,
                              .outer_angle = 50};
    p->fog = point_lit_fog(&volume, 2, lights);
}

/* What the point light brings to a place, of intensity 1 on its axis, in even fog; see formulas/point_light.inc. */
static double light_fluence(const nb_geometry *geometry, const float place[3], const nebel_light *light)
{
    double way[3], axis[3];
    const double distance = way_to_light(geometry, place, light, way), outside = fmax(distance, light->radius);
    const double share = light->radius / outside, clear = outside - light->radius;
    double fluence = 2 / (outside * outside * (1 + sqrt(1 - share * share))) * exp(-.05 * clear);
    if (light->type == NEBEL_LIGHT_SPOT) {
        memcpy(axis, light->direction, sizeof axis);
        nb_vector_make_unit(axis);
        const double edge = cos(light->outer_angle * test_pi / 180), inner = cos(light->inner_angle * test_pi / 180);
        const double s = fmin(fmax((-nb_vector_dot(way, axis) - edge) / (inner - edge), 0), 1);
        fluence *= s * s * (3 - 2 * s);
    }
    return is_in_shadow_of_light(geometry, place, light) ? 0 : fluence;
}

static double stepped_point_light(const nb_geometry *geometry, const float from[3], const float way[3], double begin,
                                  double end, const nebel_light *lights)
{
    const double s = 0.05, h = (end - begin) / STEPS;
    double sum = 0;
    for (int i = 0; i < STEPS; i++) {
        const double t = begin + (i + 0.5) * h;
        float place[3];
        for (int c = 0; c < 3; c++) place[c] = from[c] + (float)t * way[c];
        for (int l = 0; l < 2; l++)
            sum += light_fluence(geometry, place, &lights[l]) * lights[l].intensity[1] * s * exp(-s * t) * h;
    }
    return sum / (4 * test_pi);
}

/* Also says that shadows are there: without them a tenth of the pixels is off by far more. */
static void light_shafts_are_those_of_small_steps(void **state)
{
    pillars p;
    nebel_light lights[2];
    test_picture picture = test_picture_make(SIDE, SIDE);
    nebel_renderer *renderer = NULL;
    (void)state;
    set_point_lit_pillars(&p, lights);
    assert_int_equal(nebel_create_cpu_renderer(&p.scene, p.fog, &(nebel_cpu_renderer_desc){0}, &renderer), NEBEL_OK);
    const nebel_frame_desc frame = {.camera = p.camera, .width = SIDE, .height = SIDE, .samples = 1};
    assert_int_equal(nebel_render_frame(renderer, &frame, &picture.planes), NEBEL_OK);
    double worst = 0, square = 0;
    int shaded = 0;
    static nb_ray_batch rays;
    nb_view view;
    nb_region_points points;
    nb_sample_region(0, 1, &points);
    assert_int_equal(nb_view_set(&view, &p.camera, SIDE, SIDE, &(nebel_log){0}), NEBEL_OK);
    nb_view_place(&view, renderer->geometry.origin, renderer->geometry.bounds_min, renderer->geometry.bounds_max);
    assert_true(view.advance <= 0);
    for (uint32_t first = 0; first < NB_PIXELS; first += NB_BATCH) {
        nb_view_rays(&view, 0, 0, points.x + first, points.y + first, &rays);
        for (uint32_t i = 0; i < NB_BATCH; i++) {
            const uint32_t x = nb_lane_x(first + i), y = nb_lane_y(first + i);
            if (x >= SIDE || y >= SIDE || !nb_test_tries(y * SIDE + x, SIDE * SIDE)) continue;
            float from[3], way[3];
            for (int c = 0; c < 3; c++) {
                from[c] = rays.start[c][i];
                way[c] = rays.unit[c][i];
            }
            const double length = fmin((double)test_depth(&picture, x, y), 200);
            const double light = stepped_point_light(&renderer->geometry, from, way, 0, fmin(length, 50), lights) +
                                 stepped_point_light(&renderer->geometry, from, way, fmin(length, 50), length, lights);
            const double off = fabs((double)test_in_scattering(&picture, x, y)[1] - light);
            worst = fmax(worst, off);
            square += off * off;
        }
    }
    const nebel_scene_data nothing = {0};
    test_picture bare = test_picture_make(SIDE, SIDE);
    test_render(&nothing, p.fog, &(nebel_cpu_renderer_desc){.thread_count = 1}, &p.camera, 1, &bare);
    for (uint32_t i = 0; i < SIDE * SIDE; i++) {
        const float *seen = test_in_scattering(&picture, i % SIDE, i / SIDE);
        if (isinf(test_depth(&picture, i % SIDE, i / SIDE)))
            shaded += seen[1] < 0.95f * test_in_scattering(&bare, i % SIDE, i / SIDE)[1];
    }
    print_message("off by at most %.5f, %.6f in the root mean square; %d in shade\n", worst, sqrt(square / SIDE / SIDE),
                  shaded);
    assert_true(worst < 0.002);
    assert_true(shaded > SIDE);
    nebel_destroy_renderer(renderer);
    nebel_release_lighting(p.fog);
    test_picture_free(&picture);
    test_picture_free(&bare);
}

/* Whoever renders which region. */
static void threads_give_the_same_shafts(void **state)
{
    pillars p;
    nebel_light lights[2];
    test_picture one = test_picture_make(2 * NB_REGION + 5, NB_REGION + 3),
                 three = test_picture_make(one.width, one.height);
    (void)state;
    for (int point_lit = 0; point_lit < 2; point_lit++) {
        if (point_lit)
            set_point_lit_pillars(&p, lights);
        else
            set_pillars(&p);
        test_render(&p.scene, p.fog, &(nebel_cpu_renderer_desc){.thread_count = 1}, &p.camera, 2, &one);
        test_render(&p.scene, p.fog, &(nebel_cpu_renderer_desc){.thread_count = 3}, &p.camera, 2, &three);
        assert_memory_equal(one.planes.color, three.planes.color, sizeof(float) * 3 * one.width * one.height);
        nebel_release_lighting(p.fog);
    }
    test_picture_free(&one);
    test_picture_free(&three);
}

/* Returns how often memory failed before a frame was made. */
static size_t lose_memory(const pillars *p)
{
    test_picture picture = test_picture_make(SIDE, SIDE);
    fog_memory memory = {0};
    fog_messages messages = {0};
    size_t failed = 0;
    nebel_result result = NEBEL_ERROR_MEMORY;
    for (size_t k = 1; result == NEBEL_ERROR_MEMORY; k++) {
        const nebel_cpu_renderer_desc desc = {
            .host = {.allocator = fog_memory_allocator(&memory), .log = fog_messages_log(&messages)},
            .thread_count = 1};
        nebel_renderer *renderer = NULL;
        memory.fail_first = 0;
        assert_int_equal(nebel_create_cpu_renderer(&p->scene, p->fog, &desc, &renderer), NEBEL_OK);
        memory.fail_first = k;
        memory.fail_count = 1;
        const nebel_frame_desc frame = {.camera = p->camera, .width = SIDE, .height = SIDE, .samples = 1};
        result = nebel_render_frame(renderer, &frame, &picture.planes);
        failed += result == NEBEL_ERROR_MEMORY;
        nebel_destroy_renderer(renderer);
        assert_int_equal(memory.live, 0);
    }
    assert_int_equal(result, NEBEL_OK);
    test_picture_free(&picture);
    return failed;
}

static void lost_memory_is_told(void **state)
{
    pillars p;
    nebel_light lights[2];
    (void)state;
    set_pillars(&p);
    assert_true(lose_memory(&p) >= 10); /* the tree's eight, shadows, and what boundaries are made in */
    nebel_release_lighting(p.fog);
    set_point_lit_pillars(&p, lights);
    assert_true(lose_memory(&p) >= 12); /* and the point lights' pieces, and their numbers */
    nebel_release_lighting(p.fog);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(ends_are_those_of_visibility),
        cmocka_unit_test(ends_behind_hills_are_those_of_visibility),
        cmocka_unit_test(ends_before_surfaces_are_those_of_visibility),
        cmocka_unit_test(ends_before_hills_are_those_of_visibility),
        cmocka_unit_test(ends_among_leaves_are_those_of_visibility),
        cmocka_unit_test(ends_of_point_light_are_those_of_visibility),
        cmocka_unit_test(the_shadow_of_a_box_is_cut_out),
        cmocka_unit_test(shafts_are_those_of_small_steps),
        cmocka_unit_test(light_shafts_are_those_of_small_steps),
        cmocka_unit_test(threads_give_the_same_shafts),
        cmocka_unit_test(lost_memory_is_told),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
