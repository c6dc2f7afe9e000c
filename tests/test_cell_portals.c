/* Fog in cells with portals: portals given and derived, walls, and descriptions that are none. */
#include "cell_world.h"
#include "near.h"

static const nebel_cell rooms[] = {BOX(0, 4, 0, 1, 1, 1), BOX(4, 9, .1, 1, 1, 1), BOX(9, 20, 0, 1, 1, 1)};
static const double door[4][3] = {{4, -1, -1}, {4, 1, -1}, {4, 1, 1}, {4, -1, 1}};
static const double turned_door[4][3] = {{4, -1, 1}, {4, 1, 1}, {4, 1, -1}, {4, -1, -1}};
static const double hatch[3][3] = {{9, 0, -2}, {9, 0, 2}, {9, 2, 0}};

static nebel_cell_fog ask_from(nebel_cell_view view, const nebel_cells *cells, const double eye[3], const double x[3])
{
    nebel_cell_point point = {.position = {x[0], x[1], x[2]}};
    nebel_cell_fog fog;
    memcpy(view.eye, eye, sizeof view.eye);
    assert_int_equal(nebel_compute_cell_fog(cells, &view, 1, &point, 0, &fog, 0), NEBEL_OK);
    return fog;
}

static nebel_cell_fog ask(const nebel_cells *cells, const double eye[3], const double x[3])
{
    return ask_from((nebel_cell_view){.forward = {1, 0, 0}}, cells, eye, x);
}

/* ---- walls ----------------------------------------------------------------------------------- */

static void test_fog_is_seen_through_portals_alone(void **state)
{
    (void)state;
    for (int turned = 0; turned < 2; turned++) {
        const nebel_portal portals[] = {{{(size_t)turned, (size_t)!turned}, turned ? turned_door : door, 4},
                                        {{2, 1}, hatch, 3}};
        nebel_cells *cells =
            create(&(nebel_cells_desc){.cells = rooms, .cell_count = 3, .portals = portals, .portal_count = 2});
        assert_int_equal(nebel_get_cell_portal_count(cells), 2);
        static const double eye[3] = {2, 0, 0};
        assert_near(ask(cells, eye, (const double[3]){8, 0, 0}).alpha, .4, 1e-15);
        /* Through the door's rim, and past it, where the wall hides the fog. */
        assert_near(ask(cells, eye, (const double[3]){6, 1.99, 0}).alpha, .1 * hypot(2, .995), 1e-15);
        assert_near(ask(cells, eye, (const double[3]){5, 1.8, 0}).alpha, 0, 0);
        /* A vertex there is fogged for the rest of its polygon. */
        const nebel_cell_view of_vertices = {.ignore_walls = 1};
        assert_near(ask_from(of_vertices, cells, eye, (const double[3]){5, 1.8, 0}).alpha, .1 * hypot(1, .6), 1e-15);
        assert_near(ask_from(of_vertices, cells, (const double[3]){30, 0, 0}, (const double[3]){7, 0, 0}).alpha, .2,
                    1e-15);
        /* Back through the hatch, and past it, to a place in fog and to one behind it. */
        static const double far[3] = {11, .5, 0};
        assert_near(ask(cells, far, (const double[3]){7, .5, 0}).alpha, .2, 1e-15);
        assert_near(ask(cells, far, (const double[3]){7, -.6, 0}).alpha, 0, 0);
        nebel_destroy_cells(cells);
    }
}

/* Of two portals that share an edge one is open to a ray through that edge. */
static void test_no_wall_between_portals_that_touch(void **state)
{
    (void)state;
    static const double halves[2][3][3] = {{{4, -1.3, -1.1}, {4, 1.7, .9}, {4, -1.3, .9}},
                                           {{4, -1.3, -1.1}, {4, 1.7, -1.1}, {4, 1.7, .9}}};
    const nebel_portal portals[] = {{{0, 1}, halves[0], 3}, {{0, 1}, halves[1], 3}};
    nebel_cells *cells =
        create(&(nebel_cells_desc){.cells = rooms, .cell_count = 3, .portals = portals, .portal_count = 2});
    uint64_t d = 23;
    for (int i = 0; i < 1000; i++) {
        const double t = dice(&d, 0, 1), eye[3] = {dice(&d, 0, 4), dice(&d, -2, 2), dice(&d, -2, 2)};
        const double on_edge[3] = {4, -1.3 + 3 * t, -1.1 + 2 * t};
        double x[3];
        for (int k = 0; k < 3; k++) x[k] = eye[k] + 1.01 * (on_edge[k] - eye[k]);
        assert_true(ask(cells, eye, x).alpha > 0);
    }
    nebel_destroy_cells(cells);
}

/* The same walk once more, from portal to portal, as an engine does it. */
static int lies_in_polygon(const nebel_portal *portal, const double x[3])
{
    double around = 0;
    for (size_t i = 0; i < portal->vertex_count; i++) {
        const double *a = portal->vertices[i], *b = portal->vertices[(i + 1) % portal->vertex_count];
        double u[3], v[3], lengths[2] = {0, 0}, cosine = 0;
        for (int k = 0; k < 3; k++) {
            u[k] = a[k] - x[k];
            v[k] = b[k] - x[k];
            lengths[0] += u[k] * u[k];
            lengths[1] += v[k] * v[k];
            cosine += u[k] * v[k];
        }
        around += acos(fmin(fmax(cosine / sqrt(lengths[0] * lengths[1]), -1), 1));
    }
    return around > 2 * 3.14159265358979 - 1e-5;
}

static double find_exit(const nebel_cell *cell, const double eye[3], const double x[3])
{
    double out = 1;
    for (size_t i = 0; i < cell->shape.plane_count; i++) {
        const double from = world_outside(&cell->shape.planes[i], eye), to = world_outside(&cell->shape.planes[i], x);
        if (to > from) out = fmin(out, -from / (to - from));
    }
    return out;
}

static size_t find_next(size_t none, const nebel_portal *portals, size_t count, size_t cell, const double exit[3])
{
    for (size_t i = 0; i < count; i++) {
        const int second = portals[i].cells[1] == cell;
        if (portals[i].cells[second] == cell && lies_in_polygon(&portals[i], exit)) return portals[i].cells[!second];
    }
    return none;
}

static double walk(const cell_world *world, const nebel_portal *portals, size_t portal_count, const double eye[3],
                   const double x[3])
{
    double t = 0, clear = 1, run = 0, exit[3];
    const double length = hypot(hypot(x[0] - eye[0], x[1] - eye[1]), x[2] - eye[2]);
    const nebel_cell *before = NULL;
    size_t cell = world_find(world, eye);
    while (cell < world->count) {
        const nebel_cell *here = &world->cells[cell];
        const double out = find_exit(here, eye, x);
        if (before != NULL && (before->density != here->density || before->color[0] != here->color[0])) {
            clear *= 1 - fmin(run, 1);
            run = 0;
        }
        if (out < t - 1e-9) break; /* back into the cell that it came from */
        run += here->density * (out - t) * length;
        t = out;
        before = here;
        for (int i = 0; i < 3; i++) exit[i] = eye[i] + t * (x[i] - eye[i]);
        cell = t < 1 ? find_next(world->count, portals, portal_count, cell, exit) : world->count;
    }
    return 1 - clear * (1 - fmin(run, 1));
}

/* Portals are those between the cells, shrunk towards their first vertex, some left out. */
static void test_random_worlds_of_portals(void **state)
{
    (void)state;
    uint64_t d = 21;
    size_t fogged = 0;
    for (int round = 0; round < 60; round++) {
        cell_world world;
        nebel_portal portals[100];
        static double vertices[100][32][3];
        size_t count = 0;
        world_make(&world, WORLD_CELLS, &d);
        nebel_cells *open = create(&(nebel_cells_desc){.cells = world.cells, .cell_count = world.count});
        for (size_t i = 0; i < nebel_get_cell_portal_count(open); i++) {
            const nebel_portal whole = nebel_get_cell_portal(open, i);
            const double share = dice(&d, .3, 1);
            if (dice_below(&d, 4) == 0 || count == 100 || whole.vertex_count > 32) continue;
            for (size_t v = 0; v < whole.vertex_count; v++)
                for (int k = 0; k < 3; k++)
                    vertices[count][v][k] =
                        whole.vertices[0][k] + share * (whole.vertices[v][k] - whole.vertices[0][k]);
            portals[count] = (nebel_portal){
                {whole.cells[0], whole.cells[1]}, (const double(*)[3])vertices[count], whole.vertex_count};
            count++;
        }
        nebel_destroy_cells(open);
        nebel_cells *cells = create(&(nebel_cells_desc){
            .cells = world.cells, .cell_count = world.count, .portals = portals, .portal_count = count});
        for (int i = 0; i < 300; i++) {
            double eye[3], x[3];
            world_place(&d, eye);
            world_place(&d, x);
            const double wanted = walk(&world, portals, count, eye, x);
            assert_near(ask(cells, eye, x).alpha, wanted, 1e-11);
            fogged += wanted > 0;
        }
        nebel_destroy_cells(cells);
    }
    assert_true(fogged > 5000);
}

/* ---- derived --------------------------------------------------------------------------------- */

static void test_a_derived_portal_is_what_two_faces_share(void **state)
{
    (void)state;
    const nebel_cell hall[] = {
        {.shape = {.type = NEBEL_SHAPE_BOX, .min = {0, 0, 0}, .max = {4, 3, 4}}},
        {.shape = {.type = NEBEL_SHAPE_BOX, .min = {4, 1, 2}, .max = {9, 5, 9}}},
        {.shape = {.type = NEBEL_SHAPE_BOX, .min = {0, 3, 0}, .max = {4, 6, 1.5}}},
        {.shape = {.type = NEBEL_SHAPE_BOX, .min = {20, 0, 0}, .max = {24, 3, 4}}}, /* alone */
    };
    nebel_cells *cells = create(&(nebel_cells_desc){.cells = hall, .cell_count = 4});
    assert_int_equal(nebel_get_cell_portal_count(cells), 2);
    static const double low[2][3] = {{4, 1, 2}, {0, 3, 0}}, high[2][3] = {{4, 3, 4}, {4, 3, 1.5}};
    for (size_t i = 0; i < 2; i++) {
        const nebel_portal portal = nebel_get_cell_portal(cells, i);
        assert_int_equal(portal.cells[0], 0);
        assert_int_equal(portal.cells[1], i + 1);
        assert_int_equal(portal.vertex_count, 4);
        for (int k = 0; k < 3; k++) {
            double least = HUGE_VAL, most = -HUGE_VAL;
            for (int v = 0; v < 4; v++) {
                least = fmin(least, portal.vertices[v][k]);
                most = fmax(most, portal.vertices[v][k]);
            }
            assert_near(least, low[i][k], 1e-12);
            assert_near(most, high[i][k], 1e-12);
        }
    }
    nebel_destroy_cells(cells);
}

/* A prism of half the face's square: the cut goes through two of its corners. */
static void test_a_cut_through_corners_leaves_each_once(void **state)
{
    (void)state;
    static const nebel_plane prism[] = {
        {{-1, 0, 0}, -4}, {{1, 0, 0}, 7}, {{0, -1, 0}, 2}, {{0, 0, -1}, 2}, {{0, 1, 1}, 0}};
    const nebel_cell pair[] = {BOX(0, 4, .1, 1, 1, 1),
                               {.shape = {.type = NEBEL_SHAPE_CONVEX, .planes = prism, .plane_count = 5}}};
    for (int turned = 0; turned < 2; turned++) {
        const nebel_cell cells_turned[] = {pair[turned], pair[!turned]};
        nebel_cells *cells = create(&(nebel_cells_desc){.cells = cells_turned, .cell_count = 2});
        assert_int_equal(nebel_get_cell_portal_count(cells), 1);
        assert_int_equal(nebel_get_cell_portal(cells, 0).vertex_count, 3);
        nebel_destroy_cells(cells);
    }
}

/* Four boxes around an edge: those across it share no face. A strip narrower than nothing is none either. */
static void test_edges_are_no_portals(void **state)
{
    (void)state;
    nebel_cell boxes[4];
    for (int i = 0; i < 4; i++)
        boxes[i] = (nebel_cell){.shape = {.type = NEBEL_SHAPE_BOX,
                                          .min = {i % 2 ? 0 : -3, i / 2 ? 0 : -3, 0},
                                          .max = {i % 2 ? 3 : 0, i / 2 ? 3 : 0, 9}}};
    nebel_cells *cells = create(&(nebel_cells_desc){.cells = boxes, .cell_count = 4});
    assert_int_equal(nebel_get_cell_portal_count(cells), 4);
    nebel_destroy_cells(cells);
    static const double strips[] = {5e-6, 1e-3};
    for (size_t i = 0; i < 2; i++) {
        const nebel_cell pair[] = {
            {.shape = {.type = NEBEL_SHAPE_BOX, .min = {-3, 0, 0}, .max = {0, 3, 9}}},
            {.shape = {.type = NEBEL_SHAPE_BOX, .min = {0, 3 - strips[i], 0}, .max = {3, 6, 9}}}};
        cells = create(&(nebel_cells_desc){.cells = pair, .cell_count = 2});
        assert_int_equal(nebel_get_cell_portal_count(cells), i);
        nebel_destroy_cells(cells);
    }
}

/* What is derived and given back as given is as good as open. */
static void test_derived_portals_leave_no_wall(void **state)
{
    (void)state;
    uint64_t d = 22;
    for (int round = 0; round < 40; round++) {
        cell_world world;
        nebel_portal portals[200];
        world_make(&world, WORLD_CELLS, &d);
        nebel_cells *open = create(&(nebel_cells_desc){.cells = world.cells, .cell_count = world.count});
        const size_t count = nebel_get_cell_portal_count(open);
        assert_in_range(count, WORLD_CELLS - 1, 200);
        for (size_t i = 0; i < count; i++) portals[i] = nebel_get_cell_portal(open, i);
        nebel_cells *given = create(&(nebel_cells_desc){
            .cells = world.cells, .cell_count = world.count, .portals = portals, .portal_count = count});
        for (int i = 0; i < 300; i++) {
            double eye[3], x[3];
            world_place(&d, eye);
            world_place(&d, x);
            assert_near(ask(given, eye, x).alpha, ask(open, eye, x).alpha, 0);
        }
        nebel_destroy_cells(given);
        nebel_destroy_cells(open);
    }
}

/* Cells a hair apart touch, as tools that keep floats leave them. */
static void test_a_hair_between_cells_is_nothing(void **state)
{
    (void)state;
    static const double hairs[] = {1e-6, -1e-6};
    for (int i = 0; i < 2; i++) {
        const nebel_cell pair[] = {BOX(0, 4, .1, 1, 1, 1), BOX(4 + hairs[i], 9, .1, 1, 1, 1)};
        nebel_cell turned[] = {pair[0], pair[1]};
        turned[0].shape.transform.rotation[1] = turned[0].shape.transform.rotation[3] = 1;
        turned[0].shape.transform.rotation[0] = .3;
        turned[1].shape.transform = turned[0].shape.transform;
        nebel_cells *cells = create(&(nebel_cells_desc){.cells = turned, .cell_count = 2});
        assert_int_equal(nebel_get_cell_portal_count(cells), 1);
        nebel_destroy_cells(cells);
        cells = create(&(nebel_cells_desc){.cells = pair, .cell_count = 2});
        assert_int_equal(nebel_get_cell_portal_count(cells), 1);
        assert_near(ask(cells, (const double[3]){1, 0, 0}, (const double[3]){7, 0, 0}).alpha, .6, 1e-6);
        nebel_destroy_cells(cells);
    }
    const nebel_cell parted[] = {BOX(0, 4, .1, 1, 1, 1), BOX(4.001, 9, .1, 1, 1, 1)};
    nebel_cells *cells = create(&(nebel_cells_desc){.cells = parted, .cell_count = 2});
    assert_int_equal(nebel_get_cell_portal_count(cells), 0);
    nebel_destroy_cells(cells);
}

/* ---- what is no description ------------------------------------------------------------------ */

static void refuse(const nebel_cells_desc *desc, nebel_result result, size_t cell, size_t portal, const char *text)
{
    fog_messages messages = {0};
    fog_memory memory = {0};
    size_t failed_cell = 7, failed_portal = 7;
    nebel_cells_desc logged = *desc;
    nebel_cells *cells = (nebel_cells *)&messages;
    logged.host.log = fog_messages_log(&messages);
    logged.host.allocator = fog_memory_allocator(&memory);
    logged.failed_cell = &failed_cell;
    logged.failed_portal = &failed_portal;
    assert_int_equal(nebel_create_cells(&logged, &cells), result);
    assert_null(cells);
    assert_int_equal(memory.live, 0);
    assert_int_equal(messages.count, 1);
    if (strncmp(messages.text, text, strlen(text)) != 0) fail_msg("%s\nshould begin: %s", messages.text, text);
    assert_int_equal(failed_cell, cell);
    assert_int_equal(failed_portal, portal);
}

static void refuse_cell(nebel_cell cell, const char *text)
{
    const nebel_cell pair[] = {BOX(-9, -5, .1, 1, 1, 1), cell};
    refuse(&(nebel_cells_desc){.cells = pair, .cell_count = 2}, NEBEL_ERROR_VALUE, 1, SIZE_MAX, text);
}

static void test_cells_that_are_none(void **state)
{
    (void)state;
    static const nebel_plane inwards[6] = {{{1, 0, 0}, -1},  {{-1, 0, 0}, -1}, {{0, 1, 0}, -1},
                                           {{0, -1, 0}, -1}, {{0, 0, 1}, -1},  {{0, 0, -1}, -1}};
    static const nebel_plane empty[3] = {{{1, 0, 0}, 0}, {{-1, 0, 0}, -1}, {{0, 1, 0}, 0}};
    static const nebel_plane chimney[5] = {
        {{1, 0, 0}, 1}, {{-1, 0, 0}, 1}, {{0, -1, 0}, 1}, {{0, 0, 1}, 1}, {{0, 0, -1}, 1}};
    static const nebel_shape parts[2] = {{.type = NEBEL_SHAPE_BOX, .max = {1, 1, 1}},
                                         {.type = NEBEL_SHAPE_BOX, .min = {1, 0, 0}, .max = {2, 2, 2}}};
    const double bad[] = {-1e-300, -1, (double)NAN, HUGE_VAL};

    refuse_cell((nebel_cell){.shape = {.type = NEBEL_SHAPE_CONVEX, .planes = inwards, .plane_count = 6}},
                "cell 1: convex: no point is inside all planes; the body is empty: its normals point inwards");
    refuse_cell((nebel_cell){.shape = {.type = NEBEL_SHAPE_CONVEX, .planes = empty, .plane_count = 3}},
                "cell 1: convex: no point is inside all planes; the body is empty");
    refuse_cell((nebel_cell){.shape = {.type = NEBEL_SHAPE_CONVEX, .planes = chimney, .plane_count = 5}},
                "cell 1: has no end towards +y");
    refuse_cell((nebel_cell){.shape = {.type = NEBEL_SHAPE_BOX, .min = {1, 0, 0}, .max = {0, 1, 1}}}, "cell 1: box: ");
    refuse_cell((nebel_cell){.shape = {.type = NEBEL_SHAPE_UNION, .parts = parts, .part_count = 2}},
                "cell 1: its shape is neither a box nor a convex body of planes; split what is not convex");
    refuse_cell((nebel_cell){.shape = {.type = NEBEL_SHAPE_SPHERE, .radius = 1}}, "cell 1: its shape is neither");
    refuse_cell((nebel_cell)BOX(-7, 3, .1, 1, 1, 1), "cell 1: overlaps cell 0; cells may touch");
    for (size_t i = 0; i < sizeof bad / sizeof *bad; i++) {
        nebel_cell cell = BOX(0, 1, bad[i], 1, 1, 1);
        refuse_cell(cell, "cell 1: density is ");
        cell.density = 0;
        cell.color[1] = bad[i];
        refuse_cell(cell, "cell 1: color");
    }
}

static void refuse_portal(nebel_portal portal, const char *text)
{
    const nebel_portal portals[] = {{{0, 1}, door, 4}, portal};
    refuse(&(nebel_cells_desc){.cells = rooms, .cell_count = 3, .portals = portals, .portal_count = 2},
           NEBEL_ERROR_VALUE, SIZE_MAX, 1, text);
}

static void test_portals_that_are_none(void **state)
{
    (void)state;
    static const double off[3][3] = {{4, 0, 0}, {4, 1, 0}, {4.5, 0, 1}}, wide[3][3] = {{4, 0, 0}, {4, 1, 0}, {4, 0, 3}};
    static const double line[3][3] = {{4, 0, 0}, {4, 1, 0}, {4, 2, 0}};
    static const double dent[4][3] = {{4, -1, -1}, {4, 1, -1}, {4, -.5, -.5}, {4, -1, 1}};
    static const double loop[5][3] = {{4, 0, 1}, {4, .6, -.8}, {4, -1, .3}, {4, 1, .3}, {4, -.6, -.8}};
    static const double nan_door[3][3] = {{4, 0, 0}, {4, 1, 0}, {4, (double)NAN, 1}};
    refuse_portal((nebel_portal){{1, 1}, door, 4}, "portal 1: joins cell 1 with itself");
    refuse_portal((nebel_portal){{1, 3}, door, 4}, "portal 1: names cell 3; there are 3, counted from 0");
    refuse_portal((nebel_portal){{0, 1}, door, 2}, "portal 1: has 2 vertices; must have 3 to 64");
    refuse_portal((nebel_portal){{0, 1}, NULL, 4}, "portal 1: has 4 vertices");
    refuse_portal((nebel_portal){{0, 2}, door, 4}, "portal 1: vertex 0 is 5 m outside cell 2; a portal lies where");
    refuse_portal((nebel_portal){{0, 1}, off, 3}, "portal 1: vertex 2 is 0.5 m outside cell 0");
    refuse_portal((nebel_portal){{0, 1}, wide, 3}, "portal 1: vertex 2 is 1 m outside cell 0");
    refuse_portal((nebel_portal){{0, 1}, line, 3}, "portal 1: has no area");
    refuse_portal((nebel_portal){{0, 1}, dent, 4}, "portal 1: is not convex");
    refuse_portal((nebel_portal){{0, 1}, loop, 5}, "portal 1: is not convex");
    refuse_portal((nebel_portal){{0, 1}, nan_door, 3}, "portal 1: vertex 2 is not finite");
}

static void test_descriptions_that_are_none(void **state)
{
    (void)state;
    nebel_cells *cells = NULL;
    static nebel_cell many[NEBEL_MAX_CELLS + 1];
    const nebel_portal portal = {{0, 1}, door, 4};
    const nebel_cells_desc good = {.cells = rooms, .cell_count = 3};
    assert_int_equal(nebel_create_cells(&good, NULL), NEBEL_ERROR_ARGUMENT);
    assert_int_equal(nebel_create_cells(NULL, &cells), NEBEL_ERROR_ARGUMENT);
    nebel_cells_desc desc = good;
    desc.cell_count = 0;
    refuse(&desc, NEBEL_ERROR_ARGUMENT, SIZE_MAX, SIZE_MAX, "cells: there are none");
    desc = good;
    desc.portal_count = 1;
    refuse(&desc, NEBEL_ERROR_ARGUMENT, SIZE_MAX, SIZE_MAX, "cells: portals is NULL");
    desc = good;
    desc.host.allocator = (nebel_allocator){.allocate = fog_memory_allocate};
    assert_int_equal(nebel_create_cells(&desc, &cells), NEBEL_ERROR_ARGUMENT);
    assert_null(cells);
    desc = good;
    desc.span = NEBEL_SPAN_COUNT;
    refuse(&desc, NEBEL_ERROR_ARGUMENT, SIZE_MAX, SIZE_MAX, "cells: model 0 or span 3 is none");
    refuse(&(nebel_cells_desc){.cells = many, .cell_count = NEBEL_MAX_CELLS + 1}, NEBEL_ERROR_LIMIT, SIZE_MAX, SIZE_MAX,
           "cells: there are 1025; at most 1024");
    desc = good;
    desc.portals = &portal;
    desc.portal_count = 1;
    assert_int_equal(nebel_create_cells(&desc, &cells), NEBEL_OK);
    nebel_destroy_cells(cells);
    nebel_destroy_cells(NULL);
}

static void test_memory_runs_out(void **state)
{
    (void)state;
    const nebel_portal portal = {{0, 1}, door, 4};
    for (int walls = 0; walls < 2; walls++) {
        nebel_result result = NEBEL_ERROR_MEMORY;
        for (size_t fail = 1; result != NEBEL_OK && fail < 100; fail++) {
            fog_memory memory = {.fail_first = fail, .fail_count = 1000};
            nebel_cells_desc desc = {.cells = rooms, .cell_count = 3, .host.allocator = fog_memory_allocator(&memory)};
            nebel_cells *cells = NULL;
            if (walls) {
                desc.portals = &portal;
                desc.portal_count = 1;
            }
            result = nebel_create_cells(&desc, &cells);
            if (result != NEBEL_OK) assert_int_equal(result, NEBEL_ERROR_MEMORY);
            nebel_destroy_cells(cells);
            assert_int_equal(memory.live, 0);
        }
        assert_int_equal(result, NEBEL_OK);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_fog_is_seen_through_portals_alone),
        cmocka_unit_test(test_no_wall_between_portals_that_touch),
        cmocka_unit_test(test_random_worlds_of_portals),
        cmocka_unit_test(test_a_derived_portal_is_what_two_faces_share),
        cmocka_unit_test(test_a_cut_through_corners_leaves_each_once),
        cmocka_unit_test(test_edges_are_no_portals),
        cmocka_unit_test(test_derived_portals_leave_no_wall),
        cmocka_unit_test(test_a_hair_between_cells_is_nothing),
        cmocka_unit_test(test_cells_that_are_none),
        cmocka_unit_test(test_portals_that_are_none),
        cmocka_unit_test(test_descriptions_that_are_none),
        cmocka_unit_test(test_memory_runs_out),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
