/* Fog in cells with portals: what a query answers. */
#include "cell_world.h"
#include "near.h"

static nebel_cell_fog ask_at(const nebel_cells *cells, const nebel_cell_view *view, double x, double y, double z)
{
    const nebel_cell_point point = {.position = {x, y, z}};
    nebel_cell_fog fog;
    assert_int_equal(nebel_compute_cell_fog(cells, view, 1, &point, 0, &fog, 0), NEBEL_OK);
    return fog;
}

static double alpha_at(const nebel_cells *cells, const nebel_cell_view *view, double x, double y, double z)
{
    return ask_at(cells, view, x, y, z).alpha;
}

static size_t layers_at(const nebel_cells *cells, const nebel_cell_view *view, double x, double y, double z,
                        nebel_cell_segment layers[4])
{
    size_t count = 0;
    const nebel_cell_point point = {.position = {x, y, z}};
    assert_int_equal(nebel_compute_cell_segments(cells, view, &point, 4, layers, &count), NEBEL_OK);
    return count;
}

/* Three rooms in a row along x; the eye is in the first. */
static const nebel_cell clear_then_fog[] = {BOX(0, 4, 0, 0, 0, 0), BOX(4, 9, .1, 1, .5, .25), BOX(9, 20, 0, 0, 0, 0)};
static const nebel_cell_view along_x = {.eye = {1, 0, 0}, .forward = {2, 0, 0}};

/* ---- the printed formula and what is wrong with it ------------------------------------------- */

/* View space is the world's with Z = -z. A leaning portal lies in Z = 8 + x; the eye is before it, fog behind. */
static const nebel_plane before_portal[] = {{{-1, 0, -1}, 8}, {{0, 0, 1}, 5}, {{1, 0, 0}, 40},
                                            {{-1, 0, 0}, 40}, {{0, 1, 0}, 3}, {{0, -1, 0}, 3}};
static const nebel_plane behind_portal[] = {{{1, 0, 1}, -8},  {{0, 0, -1}, 60}, {{1, 0, 0}, 40},
                                            {{-1, 0, 0}, 40}, {{0, 1, 0}, 3},   {{0, -1, 0}, 3}};
static const nebel_cell leaning[] = {
    {.shape = {.type = NEBEL_SHAPE_CONVEX, .planes = before_portal, .plane_count = 6}},
    {.shape = {.type = NEBEL_SHAPE_CONVEX, .planes = behind_portal, .plane_count = 6},
     .density = .04,
     .color = {1, 1, 1}},
};
static const nebel_cell_view into_leaning = {.eye = {0, 0, 0}, .forward = {0, 0, -1}};

/* The vertex (13, 0, Z 25). Printed: Zmin = 8 + 13 = 21. The ray (13 t, 25 t) is in the portal where 25 t = 8 + 13 t, t
 * = 2/3, Zmin = 50/3. */
static void test_the_erratum(void **state)
{
    (void)state;
    static const double wanted[NEBEL_SPAN_COUNT] = {
        [NEBEL_SPAN_RAY] = 28.178005607210741 / 3, [NEBEL_SPAN_DEPTH] = 25. / 3, [NEBEL_SPAN_PRINTED] = 4};
    for (int span = 0; span < NEBEL_SPAN_COUNT; span++) {
        nebel_cells *cells =
            create(&(nebel_cells_desc){.cells = leaning, .cell_count = 2, .span = (nebel_cell_span)span});
        nebel_cell_segment layer[4];
        assert_int_equal(layers_at(cells, &into_leaning, 13, 0, -25, layer), 1);
        assert_near(layer[0].to - layer[0].from, wanted[span], 1e-12);
        assert_near(layer[0].intensity, .04 * wanted[span], 1e-13);
        assert_near(alpha_at(cells, &into_leaning, 13, 0, -25), .04 * wanted[span], 1e-13);
        if (span != NEBEL_SPAN_RAY) assert_near(layer[0].to, 25, 1e-13);
        assert_int_equal(layer[0].first_cell, 1);
        assert_int_equal(layer[0].last_cell, 1);
        nebel_destroy_cells(cells);
    }
}

/* On the axis x = y = 0 both are the same. */
static void test_the_printed_form_is_right_on_the_axis(void **state)
{
    (void)state;
    nebel_cells *cells = create(&(nebel_cells_desc){.cells = leaning, .cell_count = 2, .span = NEBEL_SPAN_PRINTED});
    assert_near(alpha_at(cells, &into_leaning, 0, 0, -25), .04 * 17, 1e-13);
    nebel_destroy_cells(cells);
}

/* Zmax is that of the polygon's plane at the point's x and y; where C = 0 the point's own. */
static void test_zmax_comes_from_the_polygon(void **state)
{
    (void)state;
    nebel_cells *cells = create(&(nebel_cells_desc){.cells = leaning, .cell_count = 2, .span = NEBEL_SPAN_PRINTED});
    static const struct {
        nebel_plane surface;
        double span;
    } cases[] = {
        {{{0, 0, 0}, 0}, 17}, {{{0, 0, 1}, -27}, 19}, {{{0, 0, -2}, 54}, 19}, {{{0, 1, 0}, 0}, 17},
        {{{1, 0, 0}, 7}, 17}, {{{0, 0, 1}, 3}, 0},    {{{1, 0, 1}, -30}, 22}, {{{1, 0, 1e-14}, 7}, 17},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        const nebel_cell_point point = {{0, 0, -25}, cases[i].surface};
        nebel_cell_fog fog;
        assert_int_equal(nebel_compute_cell_fog(cells, &into_leaning, 1, &point, 0, &fog, 0), NEBEL_OK);
        assert_near(fog.alpha, .04 * cases[i].span, 1e-13);
    }
    nebel_destroy_cells(cells);
}

/* The portal at x = 4 is seen along its plane: C = 0 exactly, and by a hair not. */
static void test_an_edge_on_portal_is_met_on_the_ray(void **state)
{
    (void)state;
    static const double hairs[] = {0, 1e-16, -1e-16, 1e-14, -1e-14};
    for (size_t i = 0; i < sizeof hairs / sizeof *hairs; i++) {
        const nebel_cell_view view = {.eye = {1, 0, -1.5}, .forward = {hairs[i], 0, 1}};
        for (int span = NEBEL_SPAN_DEPTH; span < NEBEL_SPAN_COUNT; span++) {
            nebel_cells *cells =
                create(&(nebel_cells_desc){.cells = clear_then_fog, .cell_count = 3, .span = (nebel_cell_span)span});
            assert_near(alpha_at(cells, &view, 7, 0, 1.5), .1 * 1.5, 1e-12);
            nebel_destroy_cells(cells);
        }
    }
}

/* Z = -5 of the portal at x = -13 is behind the eye, and counts as the eye. A plane that leans the other way is left
 * before a vertex at x = 13, Z 10, where it has Z = 22, and counts as the vertex. */
static void test_printed_depths_stay_between_eye_and_surface(void **state)
{
    (void)state;
    static const nebel_plane sides[] = {{{2, 0, 1}, 4},   {{0, 0, 1}, 1}, {{0, 0, -1}, 60},
                                        {{-1, 0, 0}, 40}, {{0, 1, 0}, 3}, {{0, -1, 0}, 3}};
    const nebel_cell leaving = {.shape = {.type = NEBEL_SHAPE_CONVEX, .planes = sides, .plane_count = 6},
                                .density = .01};
    nebel_cells *in = create(&(nebel_cells_desc){.cells = leaning, .cell_count = 2, .span = NEBEL_SPAN_PRINTED});
    nebel_cells *out = create(&(nebel_cells_desc){.cells = &leaving, .cell_count = 1, .span = NEBEL_SPAN_PRINTED});
    nebel_cell_segment layer[4];
    assert_int_equal(layers_at(in, &into_leaning, -13, 0, -25, layer), 1);
    assert_near(layer[0].from, 0, 0);
    assert_near(layer[0].to, 25, 1e-13);
    assert_int_equal(layers_at(out, &into_leaning, 13, 0, -10, layer), 1);
    assert_near(layer[0].from, 0, 0);
    assert_near(layer[0].to, 10, 1e-13);
    nebel_destroy_cells(in);
    nebel_destroy_cells(out);
}

/* ---- hand-computed --------------------------------------------------------------------------- */

static void test_one_fogged_room(void **state)
{
    (void)state;
    for (int span = 0; span < NEBEL_SPAN_COUNT; span++) {
        nebel_cells *cells =
            create(&(nebel_cells_desc){.cells = clear_then_fog, .cell_count = 3, .span = (nebel_cell_span)span});
        assert_near(alpha_at(cells, &along_x, 3, 0, 0), 0, 0);
        assert_near(alpha_at(cells, &along_x, 4, 0, 0), 0, 0);
        assert_near(alpha_at(cells, &along_x, 7, 0, 0), .3, 1e-15);
        assert_near(alpha_at(cells, &along_x, 9, 0, 0), .5, 1e-15);
        assert_near(alpha_at(cells, &along_x, 15, 0, 0), .5, 1e-15);
        const nebel_cell_fog fog = ask_at(cells, &along_x, 7, 0, 0);
        assert_near(fog.color[0], .3, 1e-15);
        assert_near(fog.color[1], .15, 1e-15);
        assert_near(fog.color[2], .075, 1e-15);
        nebel_destroy_cells(cells);
    }
}

static void test_the_eye_stands_in_fog(void **state)
{
    (void)state;
    const nebel_cell_view view = {.eye = {6, 0, 0}, .forward = {1, 0, 0}};
    for (int span = 0; span < NEBEL_SPAN_COUNT; span++) {
        nebel_cells *cells =
            create(&(nebel_cells_desc){.cells = clear_then_fog, .cell_count = 3, .span = (nebel_cell_span)span});
        assert_near(alpha_at(cells, &view, 8, 0, 0), .2, 1e-15);
        assert_near(alpha_at(cells, &view, 12, 0, 0), .3, 1e-15);
        nebel_destroy_cells(cells);
    }
}

static void test_intensity_is_clamped(void **state)
{
    (void)state;
    const nebel_cell thick[] = {BOX(0, 50, .1, 2, 3, 4)};
    nebel_cells *cells = create(&(nebel_cells_desc){.cells = thick, .cell_count = 1});
    const nebel_cell_fog fog = ask_at(cells, &along_x, 40, 0, 0);
    assert_near(fog.alpha, 1, 0);
    assert_near(fog.color[2], 4, 0);
    nebel_destroy_cells(cells);
}

/* Zmax - Zmin is depth: it changes when the camera turns, the length of the ray does not. */
static void test_depth_turns_with_the_camera(void **state)
{
    (void)state;
    const nebel_cell_view turned = {.eye = {1, 0, 0}, .forward = {.8, .6, 0}};
    nebel_cells *depth =
        create(&(nebel_cells_desc){.cells = clear_then_fog, .cell_count = 3, .span = NEBEL_SPAN_DEPTH});
    nebel_cells *ray = create(&(nebel_cells_desc){.cells = clear_then_fog, .cell_count = 3});
    assert_near(alpha_at(depth, &turned, 7, 0, 0), .8 * .3, 1e-15);
    assert_near(alpha_at(ray, &turned, 7, 0, 0), .3, 1e-15);
    nebel_destroy_cells(depth);
    nebel_destroy_cells(ray);
}

/* ---- the seam -------------------------------------------------------------------------------- */

static void test_the_seam_and_its_cure(void **state)
{
    (void)state;
    const nebel_cell rooms[] = {BOX(0, 4, .1, 1, 1, 1), BOX(4, 9, .1, 1, 1, 1)};
    nebel_cells *grouped = create(&(nebel_cells_desc){.cells = rooms, .cell_count = 2});
    nebel_cells *apart = create(&(nebel_cells_desc){.cells = rooms, .cell_count = 2, .ungrouped = 1});
    assert_near(alpha_at(grouped, &along_x, 7, 0, 0), .3 + .3, 1e-15);
    assert_near(alpha_at(apart, &along_x, 7, 0, 0), .3 + .3 - .3 * .3, 1e-15);
    nebel_cell_segment layers[4];
    assert_int_equal(layers_at(grouped, &along_x, 7, 0, 0, layers), 1);
    assert_near(layers[0].from, 0, 0);
    assert_near(layers[0].to, 6, 0);
    assert_int_equal(layers[0].first_cell, 0);
    assert_int_equal(layers[0].last_cell, 1);
    assert_int_equal(layers_at(apart, &along_x, 7, 0, 0, layers), 2);
    assert_near(layers[0].to, 3, 0);
    assert_near(layers[1].from, 3, 0);
    nebel_destroy_cells(grouped);
    nebel_destroy_cells(apart);
}

static void test_what_differs_is_not_grouped(void **state)
{
    (void)state;
    const nebel_cell worlds[2][2] = {{BOX(0, 4, .1, 1, 1, 1), BOX(4, 9, .1, 1, 1, .5)},
                                     {BOX(0, 4, .1, 1, 1, 1), BOX(4, 9, .05, 1, 1, 1)}};
    for (int i = 0; i < 2; i++) {
        nebel_cells *cells = create(&(nebel_cells_desc){.cells = worlds[i], .cell_count = 2});
        const double b = i == 0 ? .3 : .15;
        const nebel_cell_fog fog = ask_at(cells, &along_x, 7, 0, 0);
        assert_near(fog.alpha, .3 + b - .3 * b, 1e-15);
        assert_near(fog.color[2], .3 + .7 * b * worlds[i][1].color[2], 1e-15);
        nebel_destroy_cells(cells);
    }
}

/* Equal fog with a clear cell between: two fogs. */
static void test_cells_that_do_not_touch_are_not_grouped(void **state)
{
    (void)state;
    const nebel_cell rooms[] = {BOX(0, 4, .1, 1, 1, 1), BOX(4, 5, 0, 1, 1, 1), BOX(5, 9, .1, 1, 1, 1)};
    nebel_cells *cells = create(&(nebel_cells_desc){.cells = rooms, .cell_count = 3});
    assert_near(alpha_at(cells, &along_x, 7, 0, 0), .3 + .2 - .3 * .2, 1e-15);
    nebel_destroy_cells(cells);
}

/* The same with nothing at all between them. */
static void test_a_gap_is_not_grouped_over(void **state)
{
    (void)state;
    const nebel_cell rooms[] = {BOX(0, 4, .1, 1, 1, 1), BOX(5, 9, .1, 1, 1, 1)};
    nebel_cells *cells = create(&(nebel_cells_desc){.cells = rooms, .cell_count = 2});
    assert_near(alpha_at(cells, &along_x, 7, 0, 0), .3 + .2 - .3 * .2, 1e-15);
    nebel_destroy_cells(cells);
}

static nebel_cell_view random_view(uint64_t *dice_state, double reach)
{
    nebel_cell_view view;
    for (int i = 0; i < 3; i++) {
        view.eye[i] = dice(dice_state, -reach, reach);
        view.forward[i] = dice(dice_state, -1, 1);
    }
    return view;
}

/* A cube cut into cells of the same fog is the cube. */
static void test_grouping_is_one_merged_cell(void **state)
{
    (void)state;
    uint64_t d = 11;
    for (int round = 0; round < 40; round++) {
        cell_world world, whole;
        world_make(&world, 2 + (size_t)dice_below(&d, WORLD_CELLS - 1), &d);
        world_make(&whole, 1, &d);
        for (size_t i = 0; i < world.count; i++) {
            world.cells[i].density = whole.cells[0].density = .03;
            memcpy(world.cells[i].color, whole.cells[0].color, sizeof whole.cells[0].color);
        }
        for (int span = 0; span < NEBEL_SPAN_COUNT; span++) {
            nebel_cells *many = create(
                &(nebel_cells_desc){.cells = world.cells, .cell_count = world.count, .span = (nebel_cell_span)span});
            nebel_cells *one =
                create(&(nebel_cells_desc){.cells = whole.cells, .cell_count = 1, .span = (nebel_cell_span)span});
            for (int i = 0; i < 200; i++) {
                const nebel_cell_view view = random_view(&d, 14);
                const double x = dice(&d, -14, 14), y = dice(&d, -14, 14), z = dice(&d, -14, 14);
                assert_near(alpha_at(many, &view, x, y, z), alpha_at(one, &view, x, y, z), 1e-11);
            }
            nebel_destroy_cells(many);
            nebel_destroy_cells(one);
        }
    }
}

/* ---- the exponential model ------------------------------------------------------------------- */

static void compare_with_trace(const nebel_cells *cells, const nebel_snapshot *snapshot, uint64_t *d)
{
    const nebel_cell_view view = random_view(d, 14);
    nebel_ray ray = {.t_max = 0};
    double to[3], square = 0;
    for (int i = 0; i < 3; i++) {
        to[i] = dice(d, -14, 14);
        ray.origin[i] = view.eye[i];
        ray.direction[i] = to[i] - view.eye[i];
        square += ray.direction[i] * ray.direction[i];
    }
    ray.t_max = sqrt(square);
    nebel_transfer transfer;
    assert_int_equal(nebel_trace(snapshot, &(nebel_trace_desc){0}, 1, &ray, sizeof ray, &transfer, sizeof transfer),
                     NEBEL_OK);
    const nebel_cell_fog fog = ask_at(cells, &view, to[0], to[1], to[2]);
    for (int c = 0; c < 3; c++) {
        assert_near(1 - fog.alpha, transfer.transmittance[c], 1e-12);
        assert_near(fog.color[c], transfer.in_scattering[c], 1e-12);
    }
}

static void test_exponential_fog_is_the_exact_one(void **state)
{
    (void)state;
    uint64_t d = 12;
    for (int round = 0; round < 60; round++) {
        cell_world world;
        nebel_volume_desc volumes[WORLD_CELLS];
        world_make(&world, 1 + (size_t)dice_below(&d, WORLD_CELLS), &d);
        if (round % 2 != 0) /* turned, shifted, of another size */
            for (size_t i = 0; i < world.count; i++)
                world.cells[i].shape.transform = (nebel_transform){{1, -2, .5}, {.5, .1, -.3, .8}, {.7, -1.1, .9}};
        for (size_t i = 0; i < world.count; i++) volumes[i] = nebel_volume_from_cell(&world.cells[i]);
        nebel_snapshot *snapshot = fog_commit(&(nebel_fog_desc){0}, volumes, world.count);
        for (int ungrouped = 0; ungrouped < 2; ungrouped++) {
            nebel_cells *cells = create(&(nebel_cells_desc){.cells = world.cells,
                                                            .cell_count = world.count,
                                                            .model = NEBEL_CELL_EXPONENTIAL,
                                                            .ungrouped = ungrouped});
            for (int i = 0; i < 200; i++) compare_with_trace(cells, snapshot, &d);
            nebel_destroy_cells(cells);
        }
        nebel_release_snapshot(snapshot);
    }
}

/* A ray in the face between two boxes is in one of them, the one that nebel_trace says. */
static void test_a_ray_in_a_face(void **state)
{
    (void)state;
    const nebel_cell rooms[] = {BOX(0, 4, .1, 1, 1, 1), BOX(4, 9, .2, .5, 0, 1)};
    const nebel_volume_desc volumes[] = {nebel_volume_from_cell(&rooms[0]), nebel_volume_from_cell(&rooms[1])};
    nebel_snapshot *snapshot = fog_commit(&(nebel_fog_desc){0}, volumes, 2);
    nebel_cells *cells = create(&(nebel_cells_desc){.cells = rooms, .cell_count = 2, .model = NEBEL_CELL_EXPONENTIAL});
    static const double xs[] = {0, 4, 9};
    for (int i = 0; i < 3; i++) {
        const nebel_cell_view view = {.eye = {xs[i], 0, -5}};
        const nebel_ray ray = {.origin = {xs[i], 0, -5}, .direction = {0, 0, 1}, .t_max = 6};
        nebel_transfer transfer;
        nebel_trace(snapshot, &(nebel_trace_desc){0}, 1, &ray, sizeof ray, &transfer, sizeof transfer);
        assert_near(1 - alpha_at(cells, &view, xs[i], 0, 1), transfer.transmittance[0], 1e-15);
    }
    nebel_destroy_cells(cells);
    nebel_release_snapshot(snapshot);
}

/* ---- order ----------------------------------------------------------------------------------- */

static void shuffle(cell_world *world, uint64_t *d)
{
    for (size_t i = world->count - 1; i > 0; i--) {
        const size_t k = (size_t)dice_below(d, (int)i + 1);
        const nebel_cell swap = world->cells[i];
        world->cells[i] = world->cells[k];
        world->cells[k] = swap;
    }
}

static void test_the_order_of_cells_means_nothing(void **state)
{
    (void)state;
    uint64_t d = 13;
    for (int round = 0; round < 30; round++) {
        cell_world world;
        world_make(&world, WORLD_CELLS, &d);
        const nebel_cell_model model = (nebel_cell_model)(round % NEBEL_CELL_MODEL_COUNT);
        const nebel_cell_span span = (nebel_cell_span)(round % NEBEL_SPAN_COUNT);
        nebel_cells *a =
            create(&(nebel_cells_desc){.cells = world.cells, .cell_count = world.count, .model = model, .span = span});
        shuffle(&world, &d);
        nebel_cells *b =
            create(&(nebel_cells_desc){.cells = world.cells, .cell_count = world.count, .model = model, .span = span});
        assert_int_equal(nebel_get_cell_portal_count(a), nebel_get_cell_portal_count(b));
        for (int i = 0; i < 200; i++) {
            const nebel_cell_view view = random_view(&d, 14);
            const double x = dice(&d, -14, 14), y = dice(&d, -14, 14), z = dice(&d, -14, 14);
            const nebel_cell_fog one = ask_at(a, &view, x, y, z), other = ask_at(b, &view, x, y, z);
            assert_memory_equal(&one, &other, sizeof one);
        }
        nebel_destroy_cells(a);
        nebel_destroy_cells(b);
    }
}

/* On a way within the hair that two cells share, no place is before another. */
static void test_the_order_of_cells_that_share_a_hair_means_nothing(void **state)
{
    (void)state;
    static const double hair = 4 - 5e-7, densities[2] = {.3, .2}, reds[2] = {.5, 1};
    const nebel_cell_view view = {.eye = {hair, 0, 0}, .forward = {0, 1, 0}};
    for (int i = 0; i < 4; i++) {
        const nebel_cell low = BOX(0, 4, .3, .5, 1, 1), high = BOX(4 - 1e-6, 9, densities[i / 2], reds[i % 2], 1, 1);
        const nebel_cell pair[] = {low, high, low};
        nebel_cells *a = create(&(nebel_cells_desc){.cells = pair, .cell_count = 2, .span = NEBEL_SPAN_RAY});
        nebel_cells *b = create(&(nebel_cells_desc){.cells = pair + 1, .cell_count = 2, .span = NEBEL_SPAN_RAY});
        const nebel_cell_fog one = ask_at(a, &view, hair, 1, 0), other = ask_at(b, &view, hair, 1, 0);
        assert_memory_equal(&one, &other, sizeof one);
        assert_near(one.alpha, i == 0 ? .3 : 1 - (1 - .3) * (1 - densities[i / 2]), 1e-15); /* the same fog is one */
        nebel_destroy_cells(a);
        nebel_destroy_cells(b);
    }
}

/* ---- where the eye and the point may be ------------------------------------------------------ */

static void test_an_eye_on_a_portal(void **state)
{
    (void)state;
    const nebel_cell_view there = {.eye = {4, 0, 0}, .forward = {1, 0, 0}},
                          back = {.eye = {4, 0, 0}, .forward = {-1, 0, 0}};
    static const double corners[4][3] = {{4, -1, -1}, {4, 1, -1}, {4, 1, 1}, {4, -1, 1}};
    const nebel_portal door = {{0, 1}, corners, 4};
    for (int walls = 0; walls < 2; walls++)
        for (int span = 0; span < NEBEL_SPAN_COUNT; span++) {
            nebel_cells *cells = create(&(nebel_cells_desc){.cells = clear_then_fog,
                                                            .cell_count = 3,
                                                            .portals = walls ? &door : NULL,
                                                            .portal_count = walls ? 1 : 0,
                                                            .span = (nebel_cell_span)span});
            assert_near(alpha_at(cells, &there, 7, 0, 0), .3, 1e-15);
            assert_near(alpha_at(cells, &back, 1, 0, 0), 0, 0);
            nebel_destroy_cells(cells);
        }
}

/* A hair before a leaning portal the eye is in it: no depth of the portal far from the ray has a say. */
static void test_an_eye_a_hair_before_a_portal(void **state)
{
    (void)state;
    const nebel_cell_view view = {.eye = {0, 0, -8 + 1e-7}, .forward = {0, 0, -1}};
    nebel_cells *cells = create(&(nebel_cells_desc){.cells = leaning, .cell_count = 2, .span = NEBEL_SPAN_PRINTED});
    assert_near(alpha_at(cells, &view, 13, 0, -25), .04 * 17, 1e-7);
    nebel_destroy_cells(cells);
}

static void test_an_eye_outside_all_cells(void **state)
{
    (void)state;
    const nebel_cell_view view = {.eye = {20, 0, 0}, .forward = {-1, 0, 0}};
    static const nebel_portal none = {.vertex_count = 0};
    nebel_cells *open = create(&(nebel_cells_desc){.cells = clear_then_fog, .cell_count = 2});
    nebel_cells *closed = create(&(nebel_cells_desc){.cells = clear_then_fog, .cell_count = 2, .portals = &none});
    assert_near(alpha_at(open, &view, 2, 0, 0), .5, 1e-15);
    assert_near(alpha_at(open, &view, 6, 0, 0), .3, 1e-15);
    assert_near(alpha_at(open, &view, 10, 0, 0), 0, 0);
    assert_near(alpha_at(closed, &view, 6, 0, 0), 0, 0);
    nebel_destroy_cells(open);
    nebel_destroy_cells(closed);
}

static void test_what_is_behind_the_eye(void **state)
{
    (void)state;
    const nebel_cell_view view = {.eye = {15, 0, 0}, .forward = {1, 0, 0}};
    for (int span = 0; span < NEBEL_SPAN_COUNT; span++) {
        nebel_cells *cells =
            create(&(nebel_cells_desc){.cells = clear_then_fog, .cell_count = 3, .span = (nebel_cell_span)span});
        assert_near(alpha_at(cells, &view, 19, 1, 0), 0, 0);
        /* A vertex behind the eye: the way there is fogged, but it has no depth. */
        assert_near(alpha_at(cells, &view, 4, 0, 0), span == NEBEL_SPAN_RAY ? .5 : 0, 1e-15);
        assert_near(alpha_at(cells, &view, 15, 0, 0), 0, 0);
        const nebel_cell_point point = {{4, 0, 0}, {{1, 0, 0}, 18}};
        nebel_cell_fog fog;
        assert_int_equal(nebel_compute_cell_fog(cells, &view, 1, &point, 0, &fog, 0), NEBEL_OK);
        assert_near(fog.alpha, span == NEBEL_SPAN_RAY ? .5 : 0, 1e-15);
        nebel_destroy_cells(cells);
    }
}

static void test_points_that_are_none(void **state)
{
    (void)state;
    nebel_cells *cells = create(&(nebel_cells_desc){.cells = clear_then_fog, .cell_count = 3});
    static const double bad[] = {(double)NAN, HUGE_VAL, -HUGE_VAL};
    for (int i = 0; i < 3; i++) {
        const nebel_cell_fog fog = ask_at(cells, &along_x, bad[i], 0, 0);
        assert_near(fog.alpha, 0, 0);
        assert_near(fog.color[0], 0, 0);
        const nebel_cell_view view = {.eye = {0, bad[i], 0}, .forward = {1, 0, 0}};
        const nebel_cell_point point = {.position = {7, 0, 0}};
        nebel_cell_fog out;
        assert_int_equal(nebel_compute_cell_fog(cells, &view, 1, &point, 0, &out, 0), NEBEL_ERROR_ARGUMENT);
    }
    nebel_destroy_cells(cells);
    cells = create(&(nebel_cells_desc){.cells = clear_then_fog, .cell_count = 3, .span = NEBEL_SPAN_DEPTH});
    const nebel_cell_view aimless = {.eye = {1, 0, 0}, .forward = {0, 0, 0}};
    const nebel_cell_point point = {.position = {7, 0, 0}};
    nebel_cell_fog out;
    assert_int_equal(nebel_compute_cell_fog(cells, &aimless, 1, &point, 0, &out, 0), NEBEL_ERROR_ARGUMENT);
    assert_int_equal(nebel_compute_cell_fog(NULL, &aimless, 0, NULL, 0, NULL, 0), NEBEL_ERROR_ARGUMENT);
    nebel_destroy_cells(cells);
}

static void test_streams_that_share_bytes_are_refused(void **state)
{
    (void)state;
    nebel_cells *cells = create(&(nebel_cells_desc){.cells = clear_then_fog, .cell_count = 3});
    static nebel_cell_point points[4];
    static nebel_cell_fog fog[8];
    nebel_cell_fog *const inside = (void *)((char *)points + 8);
    const size_t whole = sizeof *points, part = sizeof *fog;
    assert_int_equal(nebel_compute_cell_fog(cells, &along_x, 4, points, whole, fog, part), NEBEL_OK);
    assert_int_equal(nebel_compute_cell_fog(cells, &along_x, 4, points, whole - 8, fog, part), NEBEL_ERROR_ARGUMENT);
    assert_int_equal(nebel_compute_cell_fog(cells, &along_x, 4, points, whole, fog, part - 8), NEBEL_ERROR_ARGUMENT);
    assert_int_equal(nebel_compute_cell_fog(cells, &along_x, 4, points, whole, inside, whole), NEBEL_ERROR_ARGUMENT);
    assert_int_equal(nebel_compute_cell_fog(cells, &along_x, 4, points, whole, inside, part), NEBEL_ERROR_ARGUMENT);
    assert_int_equal(nebel_compute_cell_fog(cells, &along_x, 4, points, whole, fog, SIZE_MAX / 2),
                     NEBEL_ERROR_ARGUMENT);
    assert_int_equal(nebel_compute_cell_fog(cells, &along_x, 0, points, 1, inside, 1), NEBEL_OK);
    nebel_destroy_cells(cells);
}

static void test_strides(void **state)
{
    (void)state;
    nebel_cells *cells = create(&(nebel_cells_desc){.cells = clear_then_fog, .cell_count = 3});
    struct {
        nebel_cell_point point;
        nebel_cell_fog fog;
        double mine;
    } vertices[3] = {{.point = {{7, 0, 0}, {{0, 0, 0}, 0}}, .mine = 1},
                     {.point = {{9, 0, 0}, {{0, 0, 0}, 0}}, .mine = 2},
                     {.point = {{2, 0, 0}, {{0, 0, 0}, 0}}, .mine = 3}};
    assert_int_equal(nebel_compute_cell_fog(cells, &along_x, 3, &vertices[0].point, sizeof vertices[0],
                                            &vertices[0].fog, sizeof vertices[0]),
                     NEBEL_OK);
    static const double wanted[] = {.3, .5, 0};
    for (int i = 0; i < 3; i++) {
        assert_near(vertices[i].fog.alpha, wanted[i], 1e-15);
        assert_near(vertices[i].mine, i + 1, 0);
    }
    nebel_destroy_cells(cells);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_the_erratum),
        cmocka_unit_test(test_the_printed_form_is_right_on_the_axis),
        cmocka_unit_test(test_zmax_comes_from_the_polygon),
        cmocka_unit_test(test_an_edge_on_portal_is_met_on_the_ray),
        cmocka_unit_test(test_printed_depths_stay_between_eye_and_surface),
        cmocka_unit_test(test_one_fogged_room),
        cmocka_unit_test(test_the_eye_stands_in_fog),
        cmocka_unit_test(test_intensity_is_clamped),
        cmocka_unit_test(test_depth_turns_with_the_camera),
        cmocka_unit_test(test_the_seam_and_its_cure),
        cmocka_unit_test(test_what_differs_is_not_grouped),
        cmocka_unit_test(test_cells_that_do_not_touch_are_not_grouped),
        cmocka_unit_test(test_a_gap_is_not_grouped_over),
        cmocka_unit_test(test_grouping_is_one_merged_cell),
        cmocka_unit_test(test_exponential_fog_is_the_exact_one),
        cmocka_unit_test(test_a_ray_in_a_face),
        cmocka_unit_test(test_the_order_of_cells_means_nothing),
        cmocka_unit_test(test_the_order_of_cells_that_share_a_hair_means_nothing),
        cmocka_unit_test(test_an_eye_on_a_portal),
        cmocka_unit_test(test_an_eye_a_hair_before_a_portal),
        cmocka_unit_test(test_an_eye_outside_all_cells),
        cmocka_unit_test(test_what_is_behind_the_eye),
        cmocka_unit_test(test_points_that_are_none),
        cmocka_unit_test(test_streams_that_share_bytes_are_refused),
        cmocka_unit_test(test_strides),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
