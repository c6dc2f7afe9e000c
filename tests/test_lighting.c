/* The lighting of a snapshot as an object: what it refuses, who owns it, what it tells, and that what serves again from
 * one before gives the same bits. */
#include "fog_help.h"

#include <nebel/classic.h>
#include <nebel/shader.h>

enum { RAYS = 16 };

static const nebel_sun noon = {{.2, 1, .3}, {3, 2, 1}};
static const nebel_environment dusk = {
    .type = NEBEL_ENVIRONMENT_GRADIENT, .zenith = {.2, .3, .4}, .horizon = {.4, .3, .2}, .ground = {.1, .1, .1}};
static const nebel_light point_lights[2] = {{.position = {1, 5, -3}, .intensity = {30, 20, 10}, .radius = .1},
                                            {.type = NEBEL_LIGHT_SPOT,
                                             .position = {-3, 6, -9},
                                             .intensity = {10, 20, 30},
                                             .direction = {.3, -1, .1},
                                             .inner_angle = 20,
                                             .outer_angle = 50}};
static const nebel_diffusion_desc few_cells = {.max_cells = 600, .has_ground = 1, .ground_albedo = {.1, .2, .3}};

static const nebel_volume_desc ball = {.shape = {.type = NEBEL_SHAPE_SPHERE, .center = {0, 2, -8}, .radius = 6},
                                       .extinction = {.1, .15, .2},
                                       .albedo = {.9, .8, .7},
                                       .phase = {.type = NEBEL_PHASE_HENYEY_GREENSTEIN, .g = .4}};

static nebel_environment_map *make_map(nebel_allocator allocator)
{
    enum { HEIGHT = 8, NUMBERS = 2 * HEIGHT * HEIGHT * 3 };
    float pixels[NUMBERS];
    nebel_environment_map *map = NULL;
    for (int i = 0; i < NUMBERS; i++) pixels[i] = (float)(i % 13) * .1f;
    const nebel_environment_map_desc desc = {
        .host.allocator = allocator, .width = 2 * HEIGHT, .height = HEIGHT, .pixels = pixels};
    assert_int_equal(nebel_create_environment_map(&desc, &map), NEBEL_OK);
    return map;
}

static nebel_grid *make_grid(nebel_allocator allocator, uint64_t seed)
{
    enum { SIDE = 6 };
    float voxels[SIDE * SIDE * SIDE];
    nebel_grid *grid = NULL;
    for (int i = 0; i < SIDE * SIDE * SIDE; i++) voxels[i] = (float)dice(&seed, 0, 1);
    const nebel_grid_desc desc = {
        .host.allocator = allocator, .size = {SIDE, SIDE, SIDE}, .voxels = voxels, .filter = NEBEL_GRID_FILTER_LINEAR};
    assert_int_equal(nebel_create_grid(&desc, &grid), NEBEL_OK);
    return grid;
}

static nebel_volume_desc cloud_of(nebel_grid *grid)
{
    return (nebel_volume_desc){.shape = {.type = NEBEL_SHAPE_BOX, .min = {-5, -1, -13}, .max = {5, 6, -4}},
                               .density = {.type = NEBEL_DENSITY_GRID, .grid = grid},
                               .extinction = {.3, .4, .5},
                               .albedo = {.9, .8, .7}};
}

typedef struct answers {
    nebel_transfer exact[RAYS], fast[RAYS];
} answers;

static answers ask(const nebel_lighting *lighting)
{
    answers all;
    nebel_ray rays[RAYS];
    memset(&all, 0, sizeof all);
    for (int i = 0; i < RAYS; i++)
        rays[i] = (nebel_ray){{0, 2, 4}, {-.9 + .12 * i, .02 * (i % 5) - .04, -1}, i % 3 == 0 ? 10 : HUGE_VAL};
    fog_trace(lighting, (nebel_trace_desc){0}, RAYS, rays, all.exact);
    fog_trace(lighting, (nebel_trace_desc){.precision = NEBEL_PRECISION_FLOAT}, RAYS, rays, all.fast);
    return all;
}

static void assert_same(const answers *a, const answers *b)
{
    assert_memory_equal(a, b, sizeof *a);
}

/* ---- what is refused ------------------------------------------------------------------------- */

typedef struct refusal {
    nebel_lighting_desc desc;
    nebel_result result;
    const char *word; /* of the message: the member */
} refusal;

static void expect_refused(nebel_snapshot *snapshot, const fog_messages *messages, const refusal *r)
{
    const size_t count = messages->count;
    nebel_lighting *made = (nebel_lighting *)&made;
    assert_int_equal(nebel_create_lighting(snapshot, &r->desc, &made), r->result);
    assert_null(made);
    assert_int_equal(messages->count, count + 1);
    assert_int_equal(messages->result, r->result);
    if (strstr(messages->text, r->word) == NULL) fail_msg("\"%s\" does not name %s", messages->text, r->word);
}

static void what_is_no_lighting_is_refused(void **state)
{
    (void)state;
    const double nan = (double)NAN;
    static const nebel_light no_light[] = {{.intensity = {1, 1, 1}}, {.intensity = {-1, 0, 0}}};
    static const nebel_diffusion_desc few = {.max_cells = 1}, high = {.has_ground = 1, .ground_height = HUGE_VAL},
                                      white = {.has_ground = 1, .ground_albedo = {0, 0, 1.5}};
    fog_messages messages = {0};
    fog_memory memory = {0};
    const nebel_allocator whole = fog_memory_allocator(&memory);
    nebel_environment_map *map = make_map((nebel_allocator){0});
    const refusal wrong[] = {
        {{.host.allocator = {.allocate = whole.allocate}}, NEBEL_ERROR_ARGUMENT, "allocator"},
        {{.host.allocator = {.release = whole.release}}, NEBEL_ERROR_ARGUMENT, "allocator"},
        {{.light_count = 1}, NEBEL_ERROR_ARGUMENT, "lights"},
        {{.sun = {.irradiance = {1, 1, 1}}}, NEBEL_ERROR_VALUE, "sun direction"},
        {{.sun = {{0, nan, 0}, {1, 1, 1}}}, NEBEL_ERROR_VALUE, "sun direction"},
        {{.sun = {{0, HUGE_VAL, 0}, {1, 1, 1}}}, NEBEL_ERROR_VALUE, "sun direction"},
        {{.sun = {{0, 1, 0}, {1, -1, 1}}}, NEBEL_ERROR_VALUE, "sun irradiance"},
        {{.sun = {{0, 1, 0}, {1, 2e9, 1}}}, NEBEL_ERROR_VALUE, "sun irradiance"},
        {{.sun = {{0, 1, 0}, {1, 1, nan}}}, NEBEL_ERROR_VALUE, "sun irradiance"},
        {{.environment = {.radiance = {0, -1, 0}}}, NEBEL_ERROR_VALUE, "environment"},
        {{.environment = {.radiance = {0, 0, nan}}}, NEBEL_ERROR_VALUE, "environment"},
        {{.environment = {.radiance = {HUGE_VAL, 0, 0}}}, NEBEL_ERROR_VALUE, "environment"},
        {{.environment = {.type = NEBEL_ENVIRONMENT_GRADIENT, .zenith = {0, 2e9, 0}}},
         NEBEL_ERROR_VALUE,
         "environment"},
        {{.environment = {.type = NEBEL_ENVIRONMENT_MAP}}, NEBEL_ERROR_ARGUMENT, "environment"},
        {{.environment = {.type = NEBEL_ENVIRONMENT_MAP, .map = map, .rotation = nan}}, NEBEL_ERROR_VALUE, "rotation"},
        {{.environment = {.type = NEBEL_ENVIRONMENT_MAP, .map = map, .intensity = -1}}, NEBEL_ERROR_VALUE, "intensity"},
        {{.environment = {.type = NEBEL_ENVIRONMENT_COUNT}}, NEBEL_ERROR_ARGUMENT, "environment"},
        {{.lights = no_light, .light_count = 2}, NEBEL_ERROR_VALUE, "1: intensity"},
        {{.diffusion = &few}, NEBEL_ERROR_VALUE, "diffusion: max_cells"},
        {{.diffusion = &high}, NEBEL_ERROR_VALUE, "diffusion: ground_height"},
        {{.diffusion = &white}, NEBEL_ERROR_VALUE, "diffusion: ground_albedo"},
    };
    nebel_snapshot *snapshot = fog_commit(&(nebel_fog_desc){.host.log = fog_messages_log(&messages)}, &ball, 1);
    for (size_t i = 0; i < sizeof wrong / sizeof *wrong; i++) expect_refused(snapshot, &messages, &wrong[i]);
    assert_int_equal(memory.calls, 0);
    nebel_release_snapshot(snapshot);
    nebel_release_environment_map(map);
}

static void without_a_place_or_a_snapshot_there_is_none(void **state)
{
    (void)state;
    fog_messages messages = {0};
    nebel_lighting *made = (nebel_lighting *)&messages;
    nebel_snapshot *snapshot = fog_commit(&(nebel_fog_desc){.host.log = fog_messages_log(&messages)}, &ball, 1);
    assert_int_equal(nebel_create_lighting(NULL, NULL, &made), NEBEL_ERROR_ARGUMENT);
    assert_null(made);
    assert_int_equal(nebel_create_lighting(NULL, NULL, NULL), NEBEL_ERROR_ARGUMENT);
    assert_int_equal(messages.count, 0);
    assert_int_equal(nebel_create_lighting(snapshot, NULL, NULL), NEBEL_ERROR_ARGUMENT);
    assert_int_equal(messages.count, 1);
    nebel_release_lighting(NULL);
    assert_null(nebel_retain_lighting(NULL));
    nebel_release_snapshot(snapshot);
}

/* The log of the description, where it has one, hears of it. */
static void what_diffusion_cannot_do_is_said_to_the_lightings_log(void **state)
{
    (void)state;
    fog_messages of_fog = {0}, of_lights = {0};
    const nebel_fog_desc desc = {.host.log = fog_messages_log(&of_fog), .max_opacity = .5};
    const refusal r = {{.host.log = fog_messages_log(&of_lights), .sun = noon, .diffusion = &few_cells},
                       NEBEL_ERROR_UNSUPPORTED,
                       "max_opacity"};
    nebel_snapshot *snapshot = fog_commit(&desc, &ball, 1);
    expect_refused(snapshot, &of_lights, &r);
    assert_int_equal(of_fog.count, 0);
    nebel_release_snapshot(snapshot);
}

/* A lighting is asked with its own snapshot, even where another one has the same fog. */
static void a_lighting_of_another_snapshot_is_refused(void **state)
{
    (void)state;
    fog_messages messages = {0};
    const nebel_fog_desc desc = {.host.log = fog_messages_log(&messages)};
    const nebel_lighting_desc lights = {.sun = noon, .environment = dusk};
    nebel_snapshot *snapshot = fog_commit(&desc, &ball, 1), *twin = fog_commit(&desc, &ball, 1);
    nebel_lighting *lighting = light_fog(twin, &lights);
    const nebel_ray ray = {{0, 2, 4}, {0, 0, -1}, 9};
    const nebel_trace_desc asked = {.lighting = lighting};
    nebel_transfer transfer;
    float number[3] = {0, 0, -1}, color[4];
    uint8_t pixel[4] = {0};
    const nebel_ray_planes rays = {.direction = {0, 0, -1}, .t_max = &(float){9}};
    const nebel_transfer_planes planes = {.transmittance = {&number[0], &number[1], &number[2]}};
    const nebel_pixels pixels = {.lighting = lighting,
                                 .corner = {0, 0, -1},
                                 .width = 1,
                                 .height = 1,
                                 .depth = &(float){9},
                                 .color = pixel,
                                 .output = pixel};
    const nebel_vertex_desc at_vertices = {.lighting = lighting};
    const nebel_vertices vertices = {.positions = number};
    const nebel_vertex_output output = {.format = NEBEL_VERTEX_RGBA_FLOAT, .data = color};
    assert_int_equal(nebel_trace(snapshot, &asked, 1, &ray, 0, &transfer, 0), NEBEL_ERROR_ARGUMENT);
    assert_int_equal(nebel_trace_planes(snapshot, &asked, 1, &rays, &planes), NEBEL_ERROR_ARGUMENT);
    assert_int_equal(nebel_apply_fog_to_pixels(snapshot, NEBEL_ISA_DEFAULT, &pixels), NEBEL_ERROR_ARGUMENT);
    assert_int_equal(nebel_compute_vertex_fog(snapshot, &at_vertices, 1, &vertices, &output, 0), NEBEL_ERROR_ARGUMENT);
    assert_int_equal(messages.count, 4);
    assert_non_null(strstr(messages.text, "lighting"));
    assert_int_equal(nebel_trace(twin, &asked, 1, &ray, 0, &transfer, 0), NEBEL_OK);
    assert_int_equal(nebel_apply_fog_to_pixels(twin, NEBEL_ISA_DEFAULT, &pixels), NEBEL_OK);
    nebel_release_snapshot(snapshot);
    nebel_release_snapshot(twin);
    nebel_release_lighting(lighting);
}

/* ---- owners ---------------------------------------------------------------------------------- */

/* Snapshot, grid and two owners of the lighting; then snapshot, map and one: given back in every order. */
static void give_back(int order, int with_map)
{
    fog_memory memory = {0}, of_lights = {0};
    const nebel_allocator allocator = fog_memory_allocator(&memory);
    nebel_environment_map *map = with_map ? make_map(allocator) : NULL;
    nebel_grid *grid = with_map ? NULL : make_grid(allocator, 1);
    const nebel_volume_desc cloud = cloud_of(grid);
    nebel_lighting_desc lights = {.host.allocator = fog_memory_allocator(&of_lights),
                                  .sun = noon,
                                  .environment = dusk,
                                  .lights = point_lights,
                                  .light_count = 2};
    if (with_map) lights.environment = (nebel_environment){.type = NEBEL_ENVIRONMENT_MAP, .map = map};
    nebel_snapshot *snapshot = fog_commit(&(nebel_fog_desc){.host.allocator = allocator}, with_map ? &ball : &cloud, 1);
    nebel_lighting *lighting = light_fog(snapshot, &lights);
    const answers before = ask(lighting);
    int left[] = {0, 1, 2, 3}, lightings = with_map ? 1 : 2;
    assert_true(of_lights.live > 0);
    if (!with_map) assert_ptr_equal(nebel_retain_lighting(lighting), lighting);
    for (int count = 2 + lightings; count > 0; count--) {
        const int k = order % count, owner = left[k];
        order /= count;
        left[k] = left[count - 1];
        if (owner == 0) nebel_release_snapshot(snapshot);
        if (owner == 1) nebel_release_grid(grid);
        if (owner == 1) nebel_release_environment_map(map);
        if (owner >= 2) nebel_release_lighting(lighting);
        lightings -= owner >= 2;
        if (lightings == 0) continue;
        const answers after = ask(lighting);
        assert_same(&before, &after);
    }
    assert_int_equal(memory.live, 0);
    assert_int_equal(of_lights.live, 0);
}

static void owners_may_go_in_any_order(void **state)
{
    (void)state;
    for (int order = 0; order < 24; order++) give_back(order, 0);
    for (int order = 0; order < 6; order++) give_back(order, 1);
}

/* What serves again outlives the lighting that it is from. */
static void what_serves_again_lives_on(void **state)
{
    (void)state;
    fog_memory memory = {0};
    const nebel_allocator allocator = fog_memory_allocator(&memory);
    nebel_grid *grid = make_grid(allocator, 1);
    const nebel_volume_desc cloud = cloud_of(grid);
    nebel_snapshot *snapshot = fog_commit(&(nebel_fog_desc){.host.allocator = allocator}, &cloud, 1);
    nebel_lighting_desc lights = {.sun = noon, .environment = dusk};
    nebel_lighting *first = light_fog(snapshot, &lights);
    const answers before = ask(first);
    lights.previous = first;
    for (int i = 0; i < 5; i++) {
        nebel_lighting *next = light_fog(snapshot, &lights);
        nebel_release_lighting((nebel_lighting *)lights.previous);
        lights.previous = next;
    }
    nebel_release_snapshot(snapshot);
    nebel_release_grid(grid);
    const answers after = ask(lights.previous);
    assert_same(&before, &after);
    nebel_release_lighting((nebel_lighting *)lights.previous);
    assert_int_equal(memory.live, 0);
}

/* ---- lost memory ----------------------------------------------------------------------------- */

static size_t fail_each(nebel_snapshot *snapshot, nebel_lighting_desc lights, fog_memory *memory, size_t in_a_row)
{
    const size_t live = memory->live;
    nebel_result result = NEBEL_ERROR_MEMORY;
    size_t k = 0;
    while (result != NEBEL_OK) {
        nebel_lighting *made = (nebel_lighting *)memory;
        memory->fail_first = ++k;
        memory->fail_count = in_a_row;
        result = nebel_create_lighting(snapshot, &lights, &made);
        memory->fail_first = 0;
        if (result == NEBEL_OK) {
            nebel_release_lighting(made);
        } else {
            assert_int_equal(result, NEBEL_ERROR_MEMORY);
            assert_null(made);
        }
        assert_int_equal(memory->live, live);
    }
    return k - 1;
}

/* With an allocator of its own, and with that of the snapshot. The map keeps what it was asked for. */
static void lost_memory_is_survived(void **state)
{
    (void)state;
    for (int way = 0; way < 5; way++) {
        fog_memory memory = {0}, own = {0};
        fog_messages messages = {0};
        const nebel_allocator allocator = fog_memory_allocator(&memory);
        const int has_own = way & 1, is_cloud = way & 2, is_diffuse = way == 4;
        nebel_environment_map *map = make_map((nebel_allocator){0});
        nebel_grid *grid = make_grid((nebel_allocator){0}, 1);
        const nebel_volume_desc cloud = cloud_of(grid);
        nebel_lighting_desc lights = {
            .sun = noon,
            .environment = is_cloud ? dusk : (nebel_environment){.type = NEBEL_ENVIRONMENT_MAP, .map = map},
            .lights = point_lights,
            .light_count = 2,
            .diffusion = is_diffuse ? &few_cells : NULL};
        const nebel_fog_desc desc = {.host = {.allocator = allocator, .log = fog_messages_log(&messages)}};
        if (is_diffuse) lights.light_count = 0; /* test_diffusion.c has lights */
        if (has_own) lights.host.allocator = fog_memory_allocator(&own);
        nebel_snapshot *snapshot = fog_commit(&desc, is_cloud ? &cloud : &ball, 1);
        const size_t one = fail_each(snapshot, lights, has_own ? &own : &memory, 1);
        const size_t all = is_diffuse ? 0 : fail_each(snapshot, lights, has_own ? &own : &memory, 1000);
        assert_true(one >= (is_diffuse ? 12 : 4));
        assert_int_equal(messages.count, one + all);
        assert_int_equal(messages.result, NEBEL_ERROR_MEMORY);
        nebel_release_snapshot(snapshot);
        nebel_release_grid(grid);
        nebel_release_environment_map(map);
        assert_int_equal(memory.live + own.live, 0);
    }
}

/* What an older one has prepared is shared only where both use one memory: another's user may go with it. */
static void memory_of_another_user_is_not_shared(void **state)
{
    (void)state;
    fog_memory memory[2] = {{0}, {0}};
    nebel_grid *grid = make_grid((nebel_allocator){0}, 1);
    const nebel_volume_desc cloud = cloud_of(grid);
    nebel_snapshot *snapshot = fog_commit(&(nebel_fog_desc){0}, &cloud, 1);
    nebel_lighting_desc lights = {.sun = noon, .environment = dusk};
    lights.host.allocator = fog_memory_allocator(&memory[0]);
    nebel_lighting *first = light_fog(snapshot, &lights);
    lights.host.allocator = fog_memory_allocator(&memory[1]);
    lights.previous = first;
    nebel_lighting *second = light_fog(snapshot, &lights);
    nebel_release_lighting(first);
    assert_int_equal(memory[0].live, 0);
    nebel_release_lighting(second);
    assert_int_equal(memory[1].live, 0);
    nebel_release_snapshot(snapshot);
    nebel_release_grid(grid);
}

/* Depths to point lights in voxels are prepared by the query that first asks for them. */
static void memory_lost_by_a_query_is_survived(void **state)
{
    (void)state;
    fog_memory memory = {0};
    fog_messages messages = {0};
    nebel_grid *grid = make_grid((nebel_allocator){0}, 1);
    const nebel_volume_desc cloud = cloud_of(grid);
    const nebel_fog_desc desc = {.host.log = fog_messages_log(&messages)};
    nebel_snapshot *snapshot = fog_commit(&desc, &cloud, 1);
    nebel_lighting_desc lights = {.lights = point_lights, .light_count = 2};
    lights.host.allocator = fog_memory_allocator(&memory);
    nebel_lighting *lighting = light_fog(snapshot, &lights);
    const nebel_trace_desc asked = {.lighting = lighting, .precision = NEBEL_PRECISION_FLOAT};
    const nebel_ray ray = {.origin = {0, .1, 9}, .direction = {0, 0, -1}, .t_max = 20};
    const size_t live = memory.live;
    nebel_transfer transfer;
    nebel_result result = NEBEL_ERROR_MEMORY;
    size_t k = 0;
    while (result != NEBEL_OK) {
        memory.fail_first = ++k;
        memory.fail_count = 1;
        result = nebel_trace(snapshot, &asked, 1, &ray, 0, &transfer, 0);
        memory.fail_first = 0;
        if (result == NEBEL_OK) break;
        assert_int_equal(result, NEBEL_ERROR_MEMORY);
        assert_int_equal(memory.live, live);
    }
    assert_true(k > 4);
    assert_int_equal(messages.count, k - 1);
    nebel_release_lighting(lighting);
    assert_int_equal(memory.live, 0);
    nebel_release_snapshot(snapshot);
    nebel_release_grid(grid);
}

/* ---- the same bits --------------------------------------------------------------------------- */

/* A lighting made with `previous` and one made without: every answer, and what shaders get. */
static void expect_fresh(nebel_snapshot *snapshot, nebel_lighting_desc lights, const nebel_lighting *previous)
{
    lights.previous = NULL;
    nebel_lighting *fresh = light_fog(snapshot, &lights);
    lights.previous = previous;
    nebel_lighting *served = light_fog(snapshot, &lights);
    const answers a = ask(fresh), b = ask(served);
    assert_same(&a, &b);
    assert_true(nebel_is_same_voxels(fresh, served) && nebel_is_same_environment(fresh, served));
    nebel_release_lighting(fresh);
    nebel_release_lighting(served);
}

/* Suns that move, skies that change, and other fog, each after each. */
static void previous_changes_no_bit(void **state)
{
    (void)state;
    nebel_environment_map *map = make_map((nebel_allocator){0}), *other_map = make_map((nebel_allocator){0});
    nebel_grid *grids[] = {make_grid((nebel_allocator){0}, 1), make_grid((nebel_allocator){0}, 2)};
    const nebel_volume_desc clouds[] = {cloud_of(grids[0]), cloud_of(grids[1])};
    nebel_volume_desc denser = clouds[0], moved = clouds[0];
    for (int c = 0; c < 3; c++) denser.extinction[c] *= 3;
    moved.shape.max[0] += 4;
    const struct {
        const nebel_volume_desc *volumes;
        size_t count;
    } fogs[] = {{clouds, 1}, {clouds + 1, 1}, {clouds, 2}, {&denser, 1}, {&moved, 1}, {&ball, 1}, {NULL, 0}};
    const nebel_environment brighter = {.type = NEBEL_ENVIRONMENT_GRADIENT, .zenith = {1, 2, 3}};
    const nebel_lighting_desc skies[] = {
        {.sun = noon, .environment = dusk},
        {.sun = {{.4, 2, .6}, {3, 2, 1}}, .environment = dusk},
        {.sun = {{-1, .2, .3}, {3, 2, 1}}, .environment = brighter},
        {.sun = {{.2, 1, .3}, {1, 5, 9}}, .environment = {.radiance = {.1, .2, .3}}},
        {.environment = {.type = NEBEL_ENVIRONMENT_MAP, .map = map}},
        {.sun = noon, .environment = {.type = NEBEL_ENVIRONMENT_MAP, .map = map, .rotation = 30, .intensity = 2}},
        {.sun = noon, .environment = {.type = NEBEL_ENVIRONMENT_MAP, .map = other_map}},
        {.sun = noon, .lights = point_lights, .light_count = 2}};
    enum { FOGS = sizeof fogs / sizeof *fogs, SKIES = sizeof skies / sizeof *skies };
    nebel_snapshot *snapshots[FOGS];
    nebel_lighting *lightings[FOGS][SKIES];
    for (int i = 0; i < FOGS; i++) {
        snapshots[i] = fog_commit(&(nebel_fog_desc){0}, fogs[i].volumes, fogs[i].count);
        for (int k = 0; k < SKIES; k++) lightings[i][k] = light_fog(snapshots[i], &skies[k]);
    }
    for (size_t n = 0; n<FOGS * SKIES * FOGS * SKIES; n += nb_test_count(2)> 1 ? 5 : 11) {
        const size_t to = n % (FOGS * SKIES), from = n / (FOGS * SKIES);
        expect_fresh(snapshots[to / SKIES], skies[to % SKIES], lightings[from / SKIES][from % SKIES]);
    }
    for (int i = 0; i < FOGS; i++) {
        nebel_release_snapshot(snapshots[i]);
        for (int k = 0; k < SKIES; k++) nebel_release_lighting(lightings[i][k]);
    }
    for (int i = 0; i < 2; i++) nebel_release_grid(grids[i]);
    nebel_release_environment_map(map);
    nebel_release_environment_map(other_map);
}

/* The sun over one snapshot beside a snapshot of each hour's own. */
static void a_sun_moves_without_a_commit(void **state)
{
    (void)state;
    nebel_grid *grid = make_grid((nebel_allocator){0}, 3);
    const nebel_volume_desc cloud = cloud_of(grid), both[] = {ball, cloud};
    const struct {
        const nebel_volume_desc *volumes;
        size_t count;
        const nebel_diffusion_desc *diffusion;
    } fogs[] = {{&cloud, 1, NULL}, {&ball, 1, NULL}, {both, 2, NULL}, {&ball, 1, &few_cells}};
    for (size_t f = 0; f < sizeof fogs / sizeof *fogs; f++) {
        nebel_snapshot *snapshot = fog_commit(&(nebel_fog_desc){0}, fogs[f].volumes, fogs[f].count);
        nebel_lighting *moving = NULL;
        for (int hour = -2; hour <= 2; hour++) {
            nebel_lighting_desc lights = {
                .sun = {.direction = {.5 * hour, 1, .3}, .irradiance = {3, 2, 1 + hour * hour}},
                .environment = dusk,
                .diffusion = fogs[f].diffusion};
            nebel_lighting *fresh = fog_light(&lights, fogs[f].volumes, fogs[f].count);
            lights.previous = moving;
            nebel_lighting *next = light_fog(snapshot, &lights);
            const answers a = ask(fresh), b = ask(next);
            assert_same(&a, &b);
            nebel_release_lighting(fresh);
            nebel_release_lighting(moving);
            moving = next;
        }
        nebel_release_lighting(moving);
        nebel_release_snapshot(snapshot);
    }
    nebel_release_grid(grid);
}

/* ---- what is told ---------------------------------------------------------------------------- */

static void a_lighting_tells_what_it_was_given(void **state)
{
    (void)state;
    nebel_environment_map *map = make_map((nebel_allocator){0});
    nebel_light given[2] = {point_lights[0], point_lights[1]};
    nebel_diffusion_desc diffusion = few_cells;
    const nebel_lighting_desc lights = {
        .sun = {{0, 5, 0}, {3, 2, 1}},
        .environment = {.type = NEBEL_ENVIRONMENT_MAP, .map = map, .rotation = 12, .intensity = 2},
        .lights = given,
        .light_count = 2,
        .diffusion = &diffusion};
    nebel_snapshot *snapshot = fog_commit(&(nebel_fog_desc){0}, &ball, 1);
    nebel_lighting *lighting = light_fog(snapshot, &lights);
    memset(given, 0, sizeof given); /* what is given is copied */
    diffusion = (nebel_diffusion_desc){0};
    nebel_release_environment_map(map);
    assert_ptr_equal(nebel_get_lighting_snapshot(lighting), snapshot);
    const nebel_sun sun = nebel_get_lighting_sun(lighting);
    for (int c = 0; c < 3; c++) assert_true(sun.direction[c] == (c == 1) && sun.irradiance[c] == 3 - c);
    const nebel_environment sky = nebel_get_lighting_environment(lighting);
    assert_true(sky.type == NEBEL_ENVIRONMENT_MAP && sky.map == map && sky.rotation == 12 && sky.intensity == 2);
    const nebel_light *told = NULL;
    assert_int_equal(nebel_get_lighting_lights(lighting, &told), 2);
    assert_int_equal(nebel_get_lighting_lights(lighting, NULL), 2);
    assert_memory_equal(told, point_lights, sizeof point_lights);
    const nebel_diffusion_desc *of_light = nebel_get_lighting_diffusion(lighting);
    assert_non_null(of_light);
    assert_int_equal(of_light->max_cells, few_cells.max_cells);
    assert_true(of_light->has_ground && of_light->ground_albedo[2] == .3);
    nebel_release_snapshot(snapshot);
    nebel_release_lighting(lighting);
}

static void a_lighting_of_nothing_tells_of_nothing(void **state)
{
    (void)state;
    nebel_snapshot *snapshot = fog_commit(&(nebel_fog_desc){0}, &ball, 1);
    const nebel_lighting_desc unset = {.light_count = 0}, night = {.sun = {.direction = {0, 1, 0}}},
                              nowhere = {.sun = {.direction = {(double)NAN, HUGE_VAL, 0}}};
    nebel_lighting *const dark[] = {light_fog(snapshot, NULL), light_fog(snapshot, &unset), light_fog(snapshot, &night),
                                    light_fog(snapshot, &nowhere), NULL};
    enum { LIGHTINGS = sizeof dark / sizeof *dark };
    const nebel_sun none = {{0, 0, 0}, {0, 0, 0}};
    for (int i = 0; i < LIGHTINGS; i++) {
        const nebel_sun sun = nebel_get_lighting_sun(dark[i]);
        const nebel_environment sky = nebel_get_lighting_environment(dark[i]);
        const nebel_light *told = point_lights;
        nebel_bounds bounds;
        assert_memory_equal(&sun, &none, sizeof sun);
        assert_true(sky.type == NEBEL_ENVIRONMENT_CONSTANT && sky.radiance[0] == 0 && sky.map == NULL);
        assert_int_equal(nebel_get_lighting_lights(dark[i], &told), 0);
        assert_null(told);
        assert_null(nebel_get_lighting_diffusion(dark[i]));
        assert_ptr_equal(nebel_get_lighting_snapshot(dark[i]), dark[i] != NULL ? snapshot : NULL);
        for (int group = 0; group < NEBEL_LIGHT_GROUP_COUNT; group++)
            assert_int_equal(nebel_get_lit_bounds(dark[i], (nebel_light_group)group, &bounds), 0);
    }
    for (int k = 0; k + 1 < LIGHTINGS; k++) {
        const answers a = ask(dark[k]);
        for (int i = 0; i < RAYS; i++) assert_true(a.exact[i].in_scattering[0] == 0 && a.fast[i].in_scattering[0] == 0);
        nebel_release_lighting(dark[k]);
    }
    nebel_release_snapshot(snapshot);
}

/* Without a lighting fog gives what it gives in the dark. */
static void no_lighting_is_one_without_lights(void **state)
{
    (void)state;
    const nebel_volume_desc volumes[] = {
        ball,
        {.shape = {.type = NEBEL_SHAPE_BOX, .min = {-4, 0, -12}, .max = {4, 3, -5}}, .emission = {.1, .2, .3}},
        {.shape = {.type = NEBEL_SHAPE_BOX, .min = {-9, 0, -9}, .max = {-5, 4, -5}},
         .extinction = {.1, .1, .1},
         .source = {.3, .2, .1}}};
    nebel_lighting *dark = fog_light(NULL, volumes, 3);
    for (int precision = NEBEL_PRECISION_DOUBLE; precision <= NEBEL_PRECISION_FLOAT; precision++) {
        nebel_trace_desc desc = {.precision = (nebel_precision)precision};
        nebel_transfer transfers[2];
        const nebel_ray ray = {{0, 2, 4}, {-.1, 0, -1}, 30};
        assert_int_equal(nebel_trace(nebel_get_lighting_snapshot(dark), &desc, 1, &ray, 0, &transfers[0], 0), NEBEL_OK);
        fog_trace(dark, desc, 1, &ray, &transfers[1]);
        assert_memory_equal(&transfers[0], &transfers[1], sizeof transfers[0]);
        assert_true(transfers[0].in_scattering[0] > .1);
    }
    nebel_release_lighting(dark);
}

static int bounds_are(const nebel_lighting *lighting, nebel_light_group group, const double min[3], const double max[3])
{
    nebel_bounds b;
    if (nebel_get_lit_bounds(lighting, group, &b) != 1) return 0;
    int same = 1;
    for (int c = 0; c < 3; c++)
        same &= (b.min[c] == min[c] || fabs(b.min[c] - min[c]) < 1e-6) &&
                (b.max[c] == max[c] || fabs(b.max[c] - max[c]) < 1e-6);
    return same;
}

/* Around what is lit: not around fog with a source, and without an end where lit fog has none. */
static void bounds_are_of_fog_that_a_group_lights(void **state)
{
    (void)state;
    const double low[3] = {-6, -4, -14}, high[3] = {6, 8, -2}, endless = HUGE_VAL;
    nebel_volume_desc volumes[] = {ball, ball};
    volumes[1].shape.center[0] = 90;
    memset(volumes[1].albedo, 0, sizeof volumes[1].albedo);
    volumes[1].source[0] = 1;
    const nebel_lighting_desc lights[NEBEL_LIGHT_GROUP_COUNT] = {
        [NEBEL_LIGHT_GROUP_SUN] = {.sun = noon},
        [NEBEL_LIGHT_GROUP_ENVIRONMENT] = {.environment = dusk},
        [NEBEL_LIGHT_GROUP_LOCAL] = {.lights = point_lights, .light_count = 1}};
    for (int is_endless = 0; is_endless < 2; is_endless++) {
        if (is_endless) volumes[1] = (nebel_volume_desc){.extinction = {1, 1, 1}, .albedo = {0, 0, 1}};
        nebel_snapshot *snapshot = fog_commit(&(nebel_fog_desc){0}, volumes, 2);
        for (int lit = 0; lit < NEBEL_LIGHT_GROUP_COUNT; lit++) {
            nebel_lighting *lighting = light_fog(snapshot, &lights[lit]);
            for (int group = 0; group < NEBEL_LIGHT_GROUP_COUNT; group++) {
                nebel_bounds kept = {{1, 2, 3}, {4, 5, 6}};
                const double all[2][3] = {{-endless, -endless, -endless}, {endless, endless, endless}};
                if (group == lit)
                    assert_true(bounds_are(lighting, (nebel_light_group)group, is_endless ? all[0] : low,
                                           is_endless ? all[1] : high));
                else
                    assert_int_equal(nebel_get_lit_bounds(lighting, (nebel_light_group)group, &kept), 0);
                assert_true(kept.min[0] == 1 && kept.max[2] == 6);
            }
            assert_int_equal(nebel_get_lit_bounds(lighting, (nebel_light_group)lit, NULL), 0);
            nebel_release_lighting(lighting);
        }
        nebel_release_snapshot(snapshot);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(what_is_no_lighting_is_refused),
        cmocka_unit_test(without_a_place_or_a_snapshot_there_is_none),
        cmocka_unit_test(what_diffusion_cannot_do_is_said_to_the_lightings_log),
        cmocka_unit_test(a_lighting_of_another_snapshot_is_refused),
        cmocka_unit_test(owners_may_go_in_any_order),
        cmocka_unit_test(what_serves_again_lives_on),
        cmocka_unit_test(lost_memory_is_survived),
        cmocka_unit_test(memory_of_another_user_is_not_shared),
        cmocka_unit_test(memory_lost_by_a_query_is_survived),
        cmocka_unit_test(previous_changes_no_bit),
        cmocka_unit_test(a_sun_moves_without_a_commit),
        cmocka_unit_test(a_lighting_tells_what_it_was_given),
        cmocka_unit_test(a_lighting_of_nothing_tells_of_nothing),
        cmocka_unit_test(no_lighting_is_one_without_lights),
        cmocka_unit_test(bounds_are_of_fog_that_a_group_lights),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
