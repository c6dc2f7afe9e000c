/* Tessellation: the bound that it proves, against dense sampling; no T-junctions; limits; bad input. */
#include <nebel/classic.h>

#include "classic/vertex_error_bound.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "fog_help.h"

enum { SIDE = 6 };

/* A wavy ground of 12 x 12 m. */
typedef struct ground {
    float positions[(SIDE + 1) * (SIDE + 1)][3];
    uint32_t indices[6 * SIDE * SIDE];
} ground;

static void make_ground(ground *g, double height)
{
    for (uint32_t z = 0; z <= SIDE; z++)
        for (uint32_t x = 0; x <= SIDE; x++) {
            float *p = g->positions[z * (SIDE + 1) + x];
            p[0] = 2 * (float)x - 6;
            p[1] = (float)(height * sin(x * 1.3) * cos(z * .9));
            p[2] = 2 * (float)z - 6;
        }
    uint32_t *i = g->indices;
    for (uint32_t z = 0; z < SIDE; z++)
        for (uint32_t x = 0; x < SIDE; x++, i += 6) {
            const uint32_t a = z * (SIDE + 1) + x, b = a + SIDE + 1;
            const uint32_t quad[6] = {a, b, b + 1, a, b + 1, a + 1};
            memcpy(i, quad, sizeof quad);
        }
}

static nebel_triangles triangles_of(const ground *g)
{
    return (nebel_triangles){.positions = g->positions,
                             .vertex_count = (SIDE + 1) * (SIDE + 1),
                             .indices = g->indices,
                             .triangle_count = 2 * SIDE * SIDE};
}

static nebel_snapshot *commit_limited(size_t count, const nebel_volume_desc *volumes, double max_opacity)
{
    return fog_commit(&(nebel_fog_desc){.max_opacity = max_opacity}, volumes, count);
}

static nebel_snapshot *commit(size_t count, const nebel_volume_desc *volumes)
{
    return commit_limited(count, volumes, 0);
}

static double exact_factor(const nebel_snapshot *fog, const double eye[3], const double place[3])
{
    nebel_ray ray = {.t_max = 0};
    nebel_transfer transfer;
    double square = 0;
    for (int i = 0; i < 3; i++) {
        ray.origin[i] = eye[i];
        ray.direction[i] = place[i] - eye[i];
        square += ray.direction[i] * ray.direction[i];
    }
    ray.t_max = sqrt(square);
    assert_int_equal(
        nebel_trace(fog, &(nebel_trace_desc){.tolerance = 1e-7}, 1, &ray, sizeof ray, &transfer, sizeof transfer),
        NEBEL_OK);
    return transfer.transmittance[0];
}

static double uniform(void)
{
    static uint64_t state = 88172645463325252u;
    state ^= state << 13;
    state ^= state >> 7;
    state ^= state << 17;
    return (double)(state >> 11) * 0x1p-53;
}

/* The largest |f - L| found at so many places of a triangle, also on its edges and near its corners. */
static double find_error(const nebel_snapshot *fog, const double eye[3], const nebel_tessellation *t, size_t triangle,
                         int places)
{
    double corners[3][3], factors[3], worst = 0;
    for (size_t c = 0; c < 3; c++) {
        for (size_t i = 0; i < 3; i++) corners[c][i] = (double)t->positions[t->indices[3 * triangle + c]][i];
        factors[c] = exact_factor(fog, eye, corners[c]);
    }
    for (int n = 0; n < places; n++) {
        double w[3] = {uniform(), uniform(), uniform()};
        if (n % 3 == 0) w[n % 9 / 3] = 0;
        const double sum = w[0] + w[1] + w[2];
        double place[3] = {0, 0, 0}, linear = 0;
        for (int c = 0; c < 3; c++) {
            linear += w[c] / sum * factors[c];
            for (int i = 0; i < 3; i++) place[i] += w[c] / sum * corners[c][i];
        }
        worst = fmax(worst, fabs(exact_factor(fog, eye, place) - linear));
    }
    return worst;
}

static double area_of(const nebel_tessellation *t)
{
    double sum = 0;
    for (size_t i = 0; i < t->triangle_count; i++) {
        double u[3], v[3];
        for (int k = 0; k < 3; k++) {
            const double a = (double)t->positions[t->indices[3 * i]][k];
            u[k] = (double)t->positions[t->indices[3 * i + 1]][k] - a;
            v[k] = (double)t->positions[t->indices[3 * i + 2]][k] - a;
        }
        sum += .5 * (u[2] * v[0] - u[0] * v[2]); /* as seen from above, with its sign */
    }
    return sum;
}

static nebel_tessellation *tessellate(const nebel_snapshot *fog, const nebel_tessellation_desc *desc,
                                      const nebel_triangles *triangles)
{
    nebel_tessellation *t = NULL;
    assert_int_equal(nebel_tessellate(fog, desc, triangles, &t), NEBEL_OK);
    assert_non_null(t);
    return t;
}

/* ---- the bound ------------------------------------------------------------------------------- */

static const nebel_plane wedge[] = {
    {{0, -1, 0}, .2}, {{1, 1, .3}, 2}, {{-1, .5, 0}, 3}, {{0, .2, 1}, 4}, {{0, 1, -1}, 4}};

static const nebel_shape parts[] = {
    {.type = NEBEL_SHAPE_BOX, .min = {-2, -1, -3}, .max = {1, 1, 2}},
    {.type = NEBEL_SHAPE_SPHERE, .center = {1, .5, 0}, .radius = 2},
    {.type = NEBEL_SHAPE_CAPSULE, .from = {-3, 0, 1}, .to = {3, 1, 0}, .radius = .8},
};

static nebel_shape random_shape(nebel_shape_type type)
{
    const double x = 6 * uniform() - 3, y = 2 * uniform() - .5, z = 6 * uniform() - 3, radius = .5 + 2 * uniform();
    nebel_shape shape = {
        .type = type, .center = {x, y, z}, .radius = radius, .from = {x, y - 1, z}, .to = {z, y + 1.5, x}};
    switch (type) {
    case NEBEL_SHAPE_HALF_SPACE:
        shape.point[1] = .6 * uniform() - .3;
        shape.normal[0] = uniform() - .5;
        shape.normal[1] = 1;
        break;
    case NEBEL_SHAPE_BOX:
        for (int i = 0; i < 3; i++) {
            shape.min[i] = shape.center[i] - 1 - 2 * uniform();
            shape.max[i] = shape.center[i] + 1 + 2 * uniform();
        }
        break;
    case NEBEL_SHAPE_ELLIPSOID:
        shape.radii[0] = 1 + uniform(), shape.radii[1] = 3, shape.radii[2] = 2;
        shape.transform.rotation[1] = uniform();
        shape.transform.rotation[3] = 1;
        break;
    case NEBEL_SHAPE_CONE:
        shape.radius_from = uniform() < .3 ? 0 : radius;
        shape.radius_to = 3 * uniform();
        break;
    case NEBEL_SHAPE_CONVEX:
        shape.planes = wedge, shape.plane_count = 5;
        break;
    case NEBEL_SHAPE_UNION:
    case NEBEL_SHAPE_INTERSECTION:
        shape.parts = parts, shape.part_count = 3;
        shape.transform.position[0] = x;
        break;
    default:
        break;
    }
    return shape;
}

static nebel_density random_density(nebel_density_type type)
{
    nebel_density density = {.type = type, .power = 1 + (int)(3 * uniform()), .edge_width = .2 + 2 * uniform()};
    density.below = uniform() < .5 ? NEBEL_BELOW_GROW : NEBEL_BELOW_CONSTANT;
    density.base = 2 * uniform() - 1;
    density.scale_height = .3 + uniform();
    density.sigma = .5 + 2 * uniform();
    for (int i = 0; i < 3; i++) {
        density.center[i] = density.from[i] = 4 * uniform() - 2;
        density.to[i] = 4 * uniform() - 2;
    }
    return density;
}

static int has_soft_edge(nebel_shape_type type)
{
    return type == NEBEL_SHAPE_HALF_SPACE || type == NEBEL_SHAPE_BOX || type == NEBEL_SHAPE_SPHERE ||
           type == NEBEL_SHAPE_ELLIPSOID || type == NEBEL_SHAPE_CONVEX;
}

/* Every shape in turn, and every density that it may have. */
static nebel_volume_desc volume_of(int which)
{
    const nebel_shape_type type = (nebel_shape_type)(which % NEBEL_SHAPE_COUNT);
    nebel_density_type density = (nebel_density_type)(which / NEBEL_SHAPE_COUNT % NEBEL_DENSITY_GRID);
    const int is_ball = type == NEBEL_SHAPE_SPHERE || type == NEBEL_SHAPE_ELLIPSOID;
    if (density == NEBEL_DENSITY_RADIAL && !is_ball) density = NEBEL_DENSITY_CONSTANT;
    if (density == NEBEL_DENSITY_SOFT_EDGE && !has_soft_edge(type)) density = NEBEL_DENSITY_GAUSSIAN;
    nebel_volume_desc v = {.extinction = {.02 + .4 * uniform(), 0, 0}};
    v.shape = random_shape(type);
    v.density = random_density(density);
    if (type == NEBEL_SHAPE_WORLD) v.extinction[0] *= .2;
    if (type != NEBEL_SHAPE_UNION && type != NEBEL_SHAPE_INTERSECTION && uniform() < .3)
        v.shape.transform = (nebel_transform){
            .position = {.3, -.2, uniform()}, .rotation = {.1, uniform(), .2, 1}, .scale = {1.2, 1, .8}};
    if (uniform() < .15) v.start = 6 * uniform();
    if (uniform() < .15) v.cutoff = v.start + 6 * uniform() + .1;
    return v;
}

enum { KINDS = (int)NEBEL_SHAPE_COUNT * (int)NEBEL_DENSITY_GRID };

/* Now and then what takes the fog of others away. */
static void make_cover(nebel_volume_desc *volume)
{
    const nebel_shape_type simple[] = {NEBEL_SHAPE_BOX, NEBEL_SHAPE_SPHERE, NEBEL_SHAPE_CAPSULE, NEBEL_SHAPE_CONE};
    const double chance = uniform();
    if (chance > .4) return;
    volume->shape = random_shape(simple[(int)(4 * uniform())]);
    volume->density = random_density(NEBEL_DENSITY_HEIGHT);
    volume->operation = chance < .2 ? NEBEL_OPERATION_EXCLUDE : NEBEL_OPERATION_REPLACE;
    volume->priority = 1;
}

/* The error found on no triangle is above what is proven, whatever the fog and wherever the eye, and the proof is not
 * much worse than the truth where fog is smooth. */
static void test_the_bound_holds_everywhere(void **state)
{
    (void)state;
    ground g;
    double worst_share = 0;
    for (int round = 0; round < 2 * KINDS; round++) {
        nebel_volume_desc volumes[3];
        const size_t count = 1 + (size_t)(round % 3);
        for (size_t i = 0; i < count; i++) volumes[i] = volume_of(round + (int)i * (1 + round % 5));
        if (count > 1) make_cover(&volumes[1]);
        make_ground(&g, round % 4 == 0 ? 0 : uniform());
        nebel_snapshot *fog = commit_limited(count, volumes, round % 8 == 5 ? .6 : 0);
        /* In the volumes, above, far away, and in the planes of a box's faces, where fog is not continuous. */
        nebel_tessellation_desc desc = {.eye = {8 * uniform() - 4, .1 + 3 * uniform(), 12 * uniform() - 4},
                                        .max_error = 1. / 255,
                                        .max_depth = 1 + (unsigned)(round % 9)};
        if (round % 7 == 0) desc.eye[1] = 300, desc.eye[0] = -200;
        for (int k = 0; k < 3 && round % 5 == 0; k++)
            if (volumes[0].shape.max[k] != 0 && uniform() < .5) desc.eye[k] = volumes[0].shape.max[k];
        const nebel_triangles triangles = triangles_of(&g);
        nebel_tessellation *t = tessellate(fog, &desc, &triangles);
        const size_t step = t->triangle_count / 60 + 1;
        for (size_t i = (size_t)round % step; i < t->triangle_count; i += step) {
            const double found = find_error(fog, desc.eye, t, i, 24);
            if (found > t->error) fail_msg("round %d: %.9g found, %.9g proven", round, found, t->error);
            worst_share = fmax(worst_share, found / t->error);
        }
        nebel_destroy_tessellation(t);
        nebel_release_snapshot(fog);
    }
    assert_true(worst_share > .2);
}

/* The steps of the proof: f is in its interval, and between two places on a line along an edge it changes by as much as
 * its derivatives may. */
static void assert_enclosed(const nebel_snapshot *fog, const double eye[3], double ways[3][3], int round)
{
    const nebel_allocator allocator = nb_resolve_allocator(&(nebel_allocator){.user = NULL});
    nb_fog_bound *bound = NULL;
    double range[2], slopes[3][2];
    assert_int_equal(nb_make_fog_bound(&allocator, fog, eye, 0, &bound), NEBEL_OK);
    nb_enclose_fog(bound, (const double(*)[3])ways, range, slopes);
    nb_free_fog_bound(bound);
    for (int n = 0; n < 12; n++) {
        const int from = n % 3, to = (from + 1) % 3, third = (from + 2) % 3;
        const double rest = uniform(), first = (1 - rest) * uniform(), last = first + (1 - rest - first) * uniform();
        double places[2][3], f[2];
        for (int i = 0; i < 3; i++) {
            const double base = eye[i] + rest * ways[third][i] + (1 - rest) * ways[from][i];
            places[0][i] = base + first * (ways[to][i] - ways[from][i]);
            places[1][i] = base + last * (ways[to][i] - ways[from][i]);
        }
        for (int i = 0; i < 2; i++) f[i] = exact_factor(fog, eye, places[i]);
        const double change = f[1] - f[0], by = last - first;
        if (f[0] < range[0] - 1e-6 || f[0] > range[1] + 1e-6)
            fail_msg("round %d: %.9g is not in %.9g to %.9g", round, f[0], range[0], range[1]);
        if (change < by * slopes[from][0] - 1e-6 || change > by * slopes[from][1] + 1e-6)
            fail_msg("round %d: changes by %.9g, not by %.9g to %.9g", round, change, by * slopes[from][0],
                     by * slopes[from][1]);
    }
}

static void test_factor_and_derivatives_are_enclosed(void **state)
{
    (void)state;
    for (int round = 0; round < 60 * KINDS; round++) {
        nebel_volume_desc volumes[2] = {volume_of(round), volume_of(round / 2)};
        const size_t count = 1 + (size_t)(round % 4 == 0);
        double eye[3] = {8 * uniform() - 4, .1 + 3 * uniform(), 12 * uniform() - 4}, ways[3][3];
        if (count > 1) make_cover(&volumes[1]);
        for (int k = 0; k < 3 && round % 5 == 0; k++)
            if (volumes[0].shape.max[k] != 0 && uniform() < .5) eye[k] = volumes[0].shape.max[k];
        nebel_snapshot *fog = commit_limited(count, volumes, round % 8 == 5 ? .6 : 0);
        for (int i = 0; i < 3; i++) {
            const double target = round % 10 == 5 && eye[i] == volumes[0].shape.max[i] ? eye[i] : 10 * uniform() - 5;
            const double size = pow(.1, 1 + round % 3);
            for (int c = 0; c < 3; c++) ways[c][i] = target - eye[i] + size * (2 * uniform() - 1);
        }
        assert_enclosed(fog, eye, ways, round);
        nebel_release_snapshot(fog);
    }
}

/* Not of the worst triangle alone: alone in a mesh, each of a mesh's triangles has its own bound. */
static void test_each_triangle_has_its_own_bound(void **state)
{
    (void)state;
    ground g;
    double most = 0;
    make_ground(&g, .7);
    for (int round = 0; round < KINDS; round++) {
        const nebel_volume_desc volume = volume_of(round);
        nebel_snapshot *fog = commit(1, &volume);
        const nebel_tessellation_desc desc = {.eye = {6 * uniform() - 3, 2 * uniform(), 8 * uniform()}, .max_error = 2};
        for (size_t i = 0; i < 2 * SIDE * SIDE; i += 3) {
            nebel_triangles one = triangles_of(&g);
            one.indices += 3 * i;
            one.triangle_count = 1;
            nebel_tessellation *t = tessellate(fog, &desc, &one);
            assert_int_equal(t->triangle_count, 1);
            const double found = find_error(fog, desc.eye, t, 0, 40);
            if (found > t->error) fail_msg("round %d: %.9g found, %.9g proven", round, found, t->error);
            assert_true(t->error <= 1);
            most = fmax(most, t->error);
            nebel_destroy_tessellation(t);
        }
        nebel_release_snapshot(fog);
    }
    assert_true(most == 1); /* thick fog with an edge: nothing is proven */
}

static void test_the_bound_is_met_in_smooth_fog(void **state)
{
    (void)state;
    ground g;
    make_ground(&g, .5);
    const nebel_volume_desc world = {.extinction = {.1, .1, .1}};
    nebel_snapshot *fog = commit(1, &world);
    const nebel_triangles triangles = triangles_of(&g);
    size_t before = 0;
    for (double bound = .02; bound > 1e-4; bound /= 4) {
        nebel_tessellation *t =
            tessellate(fog, &(nebel_tessellation_desc){.eye = {1, 3, 9}, .max_error = bound}, &triangles);
        assert_int_equal(t->unresolved_count, 0);
        assert_true(t->error <= bound);
        assert_int_equal(t->added_triangles, t->triangle_count - triangles.triangle_count);
        if (before > 0) assert_true(t->triangle_count <= 6 * before); /* four times as many, about */
        before = t->triangle_count;
        nebel_destroy_tessellation(t);
    }
    assert_true(before > 500 && before < 60000);
    nebel_release_snapshot(fog);
}

/* Fog without sharp edges is met as fog everywhere is, also at the silhouette of a ball. */
static void test_the_bound_is_met_in_soft_fog(void **state)
{
    (void)state;
    ground g;
    make_ground(&g, .5);
    const nebel_shape ball = {.type = NEBEL_SHAPE_SPHERE, .center = {0, .5, 0}, .radius = 3};
    const nebel_shape block = {.type = NEBEL_SHAPE_BOX, .min = {-4, -2, -3}, .max = {3, 2, 4}};
    const nebel_shape wall = {.type = NEBEL_SHAPE_HALF_SPACE, .point = {0, 1, 0}, .normal = {0, 1, .2}};
    const nebel_volume_desc volumes[] = {
        {.density = {.type = NEBEL_DENSITY_HEIGHT, .scale_height = 1}},
        {.density = {.type = NEBEL_DENSITY_HEIGHT, .scale_height = .5, .base = .1, .below = NEBEL_BELOW_CONSTANT}},
        {.density = {.type = NEBEL_DENSITY_LINEAR, .from = {0, 2, 0}, .to = {0, -1, 1}}},
        {.density = {.type = NEBEL_DENSITY_GAUSSIAN, .center = {1, 0, 1}, .sigma = 1.5}},
        {.shape = ball, .density = {.type = NEBEL_DENSITY_RADIAL, .power = 1}},
        {.shape = ball, .density = {.type = NEBEL_DENSITY_RADIAL, .power = 3}},
        {.shape = ball, .density = {.type = NEBEL_DENSITY_SOFT_EDGE, .edge_width = 1}},
        {.shape = block, .density = {.type = NEBEL_DENSITY_SOFT_EDGE, .edge_width = 1}},
        {.shape = {.type = NEBEL_SHAPE_CONVEX, .planes = wedge, .plane_count = 5},
         .density = {.type = NEBEL_DENSITY_SOFT_EDGE, .edge_width = 1}},
        {.shape = wall, .density = {.type = NEBEL_DENSITY_SOFT_EDGE, .edge_width = 1}},
        {.shape = wall},
        {.shape = {.type = NEBEL_SHAPE_CAPSULE, .from = {-9, 1, 0}, .to = {9, 1, 1}, .radius = 8}},
        {.shape = {.type = NEBEL_SHAPE_CONE, .from = {0, -9, 0}, .to = {0, 8, 0}, .radius_from = 20, .radius_to = 1}},
        {.start = 4, .cutoff = 11},
    };
    const nebel_triangles triangles = triangles_of(&g);
    for (size_t i = 0; i < sizeof volumes / sizeof *volumes; i++) {
        nebel_volume_desc volume = volumes[i];
        volume.extinction[0] = .3;
        nebel_snapshot *fog = commit(1, &volume);
        nebel_tessellation *t = tessellate(fog, &(nebel_tessellation_desc){.eye = {1, 3, 9}}, &triangles);
        if (t->unresolved_count > 0 || t->triangle_count > 60000)
            fail_msg("fog %zu: %zu of %zu triangles above the bound", i, t->unresolved_count, t->triangle_count);
        nebel_destroy_tessellation(t);
        nebel_release_snapshot(fog);
    }
}

/* ---- the mesh -------------------------------------------------------------------------------- */

static int compare_edges(const void *a, const void *b)
{
    return memcmp(a, b, 6 * sizeof(float));
}

/* Every edge inside has a triangle on both sides, by its places; those of the border are on the border. */
static void assert_no_junctions(const nebel_tessellation *t)
{
    float(*edges)[6] = malloc(3 * t->triangle_count * sizeof *edges);
    size_t border = 0;
    assert_non_null(edges);
    for (size_t i = 0; i < 3 * t->triangle_count; i++) {
        const float *a = t->positions[t->indices[i]], *b = t->positions[t->indices[i % 3 == 2 ? i - 2 : i + 1]];
        const int swap = memcmp(a, b, 3 * sizeof(float)) > 0;
        memcpy(edges[i], swap ? b : a, 3 * sizeof(float));
        memcpy(edges[i] + 3, swap ? a : b, 3 * sizeof(float));
    }
    qsort(edges, 3 * t->triangle_count, sizeof *edges, compare_edges);
    for (size_t i = 0; i < 3 * t->triangle_count;) {
        size_t same = 1;
        while (i + same < 3 * t->triangle_count && compare_edges(edges[i], edges[i + same]) == 0) same++;
        const float *e = edges[i];
        const int on_border = (fabsf(e[0]) == 6 && e[0] == e[3]) || (fabsf(e[2]) == 6 && e[2] == e[5]);
        if (same != (on_border ? 1 : 2)) fail_msg("an edge with %zu triangles", same);
        border += (size_t)on_border;
        i += same;
    }
    assert_true(border >= 4 * SIDE);
    free(edges);
}

static const nebel_volume_desc box = {.shape = {.type = NEBEL_SHAPE_BOX, .min = {-3, -2, -2}, .max = {2, 1.5, 4}},
                                      .extinction = {.3, .1, .1}};

static void test_there_are_no_junctions(void **state)
{
    (void)state;
    ground g;
    make_ground(&g, .4);
    nebel_snapshot *fog = commit(1, &box);
    const nebel_triangles joined = triangles_of(&g);
    /* The same with vertices of its own for each triangle: a mesh that is all seams. */
    float loose[6 * SIDE * SIDE][3];
    uint32_t order[6 * SIDE * SIDE];
    for (uint32_t i = 0; i < 6 * SIDE * SIDE; i++) {
        memcpy(loose[i], g.positions[g.indices[i]], sizeof loose[i]);
        order[i] = i;
    }
    nebel_triangles apart = joined;
    apart.positions = loose;
    apart.indices = order;
    apart.vertex_count = 6 * SIDE * SIDE;
    const nebel_tessellation_desc desc = {.eye = {4, 3, 8}, .max_depth = 9};
    nebel_tessellation *t = tessellate(fog, &desc, &joined), *seams = tessellate(fog, &desc, &apart);
    assert_true(t->triangle_count > 500);
    assert_int_equal(t->triangle_count, seams->triangle_count);
    assert_true(t->vertex_count < seams->vertex_count);
    assert_no_junctions(t);
    assert_no_junctions(seams);
    assert_true(fabs(area_of(t) - 144) < 1e-4 && fabs(area_of(seams) - 144) < 1e-4);
    nebel_destroy_tessellation(t);
    nebel_destroy_tessellation(seams);
    nebel_release_snapshot(fog);
}

static void test_added_vertices_are_between_their_parents(void **state)
{
    (void)state;
    ground g;
    make_ground(&g, .4);
    nebel_snapshot *fog = commit(1, &box);
    const nebel_triangles triangles = triangles_of(&g);
    nebel_tessellation *t = tessellate(fog, &(nebel_tessellation_desc){.eye = {4, 3, 8}, .max_depth = 9}, &triangles);
    assert_int_equal(t->input_vertex_count, triangles.vertex_count);
    assert_memory_equal(t->positions, g.positions, sizeof g.positions);
    for (size_t v = t->input_vertex_count; v < t->vertex_count; v++) {
        const uint32_t *parents = t->parents[v - t->input_vertex_count];
        assert_true(parents[0] < v && parents[1] < v);
        for (size_t i = 0; i < 3; i++) {
            const double mean = .5 * ((double)t->positions[parents[0]][i] + (double)t->positions[parents[1]][i]);
            assert_true(t->positions[v][i] == (float)mean);
        }
    }
    for (size_t i = 0; i < 3 * t->triangle_count; i++) assert_true(t->indices[i] < t->vertex_count);
    nebel_destroy_tessellation(t);
    nebel_release_snapshot(fog);
}

static void test_strides_and_origins(void **state)
{
    (void)state;
    ground g;
    make_ground(&g, .4);
    struct {
        char before[3];
        float position[3];
        uint32_t color;
    } wide[(SIDE + 1) * (SIDE + 1)];
    for (size_t v = 0; v < (SIDE + 1) * (SIDE + 1); v++) memcpy(wide[v].position, g.positions[v], 12);
    nebel_volume_desc moved = box;
    moved.shape.transform.position[0] = 1024;
    nebel_snapshot *fog = commit(1, &box), *far_fog = commit(1, &moved);
    const nebel_triangles near = triangles_of(&g);
    nebel_triangles far = near;
    far.positions = wide[0].position;
    far.position_stride = sizeof *wide;
    far.origin[0] = 1024;
    nebel_tessellation *a = tessellate(fog, &(nebel_tessellation_desc){.eye = {4, 3, 8}, .max_depth = 7}, &near);
    nebel_tessellation *b = tessellate(far_fog, &(nebel_tessellation_desc){.eye = {1028, 3, 8}, .max_depth = 7}, &far);
    assert_int_equal(a->triangle_count, b->triangle_count);
    assert_memory_equal(a->positions, b->positions, a->vertex_count * 12);
    assert_true(fabs(a->error - b->error) < 1e-9);
    nebel_destroy_tessellation(a);
    nebel_destroy_tessellation(b);
    nebel_release_snapshot(fog);
    nebel_release_snapshot(far_fog);
}

/* ---- limits ---------------------------------------------------------------------------------- */

static void test_limits_are_told(void **state)
{
    (void)state;
    ground g;
    make_ground(&g, .4);
    nebel_snapshot *fog = commit(1, &box);
    const nebel_triangles triangles = triangles_of(&g);
    nebel_tessellation *none =
        tessellate(fog, &(nebel_tessellation_desc){.eye = {4, 3, 8}, .max_triangles = 1}, &triangles);
    nebel_tessellation *few =
        tessellate(fog, &(nebel_tessellation_desc){.eye = {4, 3, 8}, .max_triangles = 400}, &triangles);
    nebel_tessellation *flat =
        tessellate(fog, &(nebel_tessellation_desc){.eye = {4, 3, 8}, .max_depth = 2}, &triangles);
    assert_int_equal(none->added_triangles, 0);
    assert_true(none->unresolved_count > 10 && none->error > .05);
    assert_true(few->triangle_count >= 400 && few->triangle_count < 800 && few->unresolved_count > 0);
    assert_no_junctions(few);
    assert_true(flat->unresolved_count > 0 && flat->error > 1. / 255);
    assert_int_equal(none->depth_limited_count, 0);
    assert_int_equal(few->depth_limited_count, 0);
    assert_int_equal(flat->depth_limited_count, flat->unresolved_count);
    nebel_destroy_tessellation(none);
    nebel_destroy_tessellation(few);
    nebel_destroy_tessellation(flat);
    nebel_release_snapshot(fog);
}

static void test_nothing_to_do(void **state)
{
    (void)state;
    ground g;
    make_ground(&g, .4);
    nebel_snapshot *clear = commit(0, NULL), *fog = commit(1, &box);
    nebel_triangles triangles = triangles_of(&g);
    nebel_tessellation *t = tessellate(clear, &(nebel_tessellation_desc){.eye = {4, 3, 8}}, &triangles);
    assert_int_equal(t->added_triangles, 0);
    assert_true(t->error < 1.001e-6 && t->unresolved_count == 0);
    nebel_destroy_tessellation(t);
    triangles.triangle_count = 0;
    t = tessellate(fog, &(nebel_tessellation_desc){.eye = {4, 3, 8}}, &triangles);
    assert_int_equal(t->triangle_count, 0);
    assert_int_equal(t->vertex_count, triangles.vertex_count);
    assert_true(t->error == 0);
    nebel_destroy_tessellation(t);
    t = tessellate(fog, &(nebel_tessellation_desc){.channel = 2}, &(nebel_triangles){.positions = NULL});
    assert_int_equal(t->vertex_count, 0);
    nebel_destroy_tessellation(t);
    nebel_release_snapshot(clear);
    nebel_release_snapshot(fog);
}

/* Points, lines and an eye in the ground: whatever happens, it ends, and the bound is true. */
static void test_degenerate_triangles(void **state)
{
    (void)state;
    static const float positions[][3] = {{0, 0, 0},  {0, 0, 0},      {4, 0, 4}, {2, 0, 2},
                                         {-4, 0, 1}, {1e-38f, 0, 0}, {4, 0, -3}};
    static const uint32_t indices[] = {0, 1, 0, 0, 1, 2, 0, 2, 3, 0, 4, 5, 2, 2, 2, 0, 4, 6, 4, 0, 6};
    nebel_snapshot *fog = commit(1, &box);
    const nebel_triangles triangles = {
        .positions = positions, .vertex_count = 7, .indices = indices, .triangle_count = 7};
    for (int round = 0; round < 4; round++) {
        const nebel_tessellation_desc desc = {.eye = {round == 1 ? 1 : 0, round == 2 ? 1.5 : 0, round == 3 ? 9 : 0},
                                              .max_depth = 12};
        nebel_tessellation *t = tessellate(fog, &desc, &triangles);
        for (size_t i = 0; i < t->triangle_count; i += 1 + t->triangle_count / 500) {
            double square = 0; /* a ray needs a direction */
            for (size_t c = 0; c < 3; c++)
                for (size_t k = 0; k < 3; k++) {
                    const double way = (double)t->positions[t->indices[3 * i + c]][k] - desc.eye[k];
                    square = c == 0 && k == 0 ? way * way : square + way * way;
                }
            if (square == 0 || round == 0) continue;
            assert_true(find_error(fog, desc.eye, t, i, 12) <= t->error);
        }
        nebel_destroy_tessellation(t);
    }
    nebel_release_snapshot(fog);
}

/* ---- bad input ------------------------------------------------------------------------------- */

static void *no_memory_after(size_t size, void *user)
{
    int *left = user;
    return (*left)-- > 0 ? malloc(size) : NULL;
}

static void release(void *memory, void *user)
{
    (void)user;
    free(memory);
}

static void assert_refused(const nebel_snapshot *fog, const nebel_tessellation_desc *desc,
                           const nebel_triangles *triangles, nebel_result wanted)
{
    nebel_tessellation *t = (nebel_tessellation *)&t;
    assert_int_equal(nebel_tessellate(fog, desc, triangles, &t), wanted);
    assert_null(t);
}

static void test_bad_input(void **state)
{
    (void)state;
    ground g;
    make_ground(&g, .4);
    nebel_snapshot *fog = commit(1, &box);
    const nebel_triangles good = triangles_of(&g);
    const nebel_tessellation_desc desc = {.eye = {4, 3, 8}, .max_depth = 6};
    nebel_tessellation_desc d = desc;
    nebel_triangles t = good;
    assert_refused(NULL, &d, &t, NEBEL_ERROR_ARGUMENT);
    assert_refused(fog, NULL, &t, NEBEL_ERROR_ARGUMENT);
    assert_refused(fog, &d, NULL, NEBEL_ERROR_ARGUMENT);
    assert_int_equal(nebel_tessellate(fog, &d, &t, NULL), NEBEL_ERROR_ARGUMENT);
    nebel_destroy_tessellation(NULL);
    t.vertex_count--;
    assert_refused(fog, &d, &t, NEBEL_ERROR_ARGUMENT); /* an index out of range */
    t = good, t.position_stride = 11;
    assert_refused(fog, &d, &t, NEBEL_ERROR_ARGUMENT);
    t = good, t.positions = NULL;
    assert_refused(fog, &d, &t, NEBEL_ERROR_ARGUMENT);
    t = good, t.indices = NULL;
    assert_refused(fog, &d, &t, NEBEL_ERROR_ARGUMENT);
    t = good, t.origin[1] = (double)NAN;
    assert_refused(fog, &d, &t, NEBEL_ERROR_VALUE);
    t = good, t.origin[1] = 6e5;
    assert_refused(fog, &d, &t, NEBEL_ERROR_VALUE);
    d.channel = 3;
    assert_refused(fog, &d, &good, NEBEL_ERROR_ARGUMENT);
    d = desc, d.max_depth = 49;
    assert_refused(fog, &d, &good, NEBEL_ERROR_ARGUMENT);
    d = desc, d.max_error = -1;
    assert_refused(fog, &d, &good, NEBEL_ERROR_VALUE);
    d = desc, d.eye[0] = (double)INFINITY;
    assert_refused(fog, &d, &good, NEBEL_ERROR_VALUE);
    d = desc, d.host.allocator.allocate = no_memory_after;
    assert_refused(fog, &d, &good, NEBEL_ERROR_ARGUMENT);
    for (int k = 0; k < 3; k++) {
        const float was = g.positions[8][k];
        g.positions[8][k] = k == 0 ? NAN : k == 1 ? INFINITY : 6e5f;
        assert_refused(fog, &desc, &good, NEBEL_ERROR_VALUE);
        g.positions[8][k] = was;
    }
    nebel_release_snapshot(fog);
}

static void test_fog_without_a_proof_is_refused(void **state)
{
    (void)state;
    ground g;
    make_ground(&g, .4);
    const nebel_triangles good = triangles_of(&g);
    const nebel_shape_type soft[] = {NEBEL_SHAPE_CYLINDER, NEBEL_SHAPE_CAPSULE, NEBEL_SHAPE_CONE};
    nebel_volume_desc volumes[4] = {box, box, box, box};
    nebel_shape many[9];
    for (int i = 0; i < 3; i++) {
        volumes[i].shape = random_shape(soft[i]);
        volumes[i].density = (nebel_density){.type = NEBEL_DENSITY_SOFT_EDGE, .edge_width = .2};
    }
    for (int i = 0; i < 9; i++) many[i] = random_shape(NEBEL_SHAPE_SPHERE);
    volumes[3].shape = (nebel_shape){.type = NEBEL_SHAPE_UNION, .parts = many, .part_count = 9};
    for (int i = 0; i < 4; i++) {
        nebel_snapshot *fog = commit(1, &volumes[i]);
        assert_refused(fog, &(nebel_tessellation_desc){.eye = {4, 3, 8}}, &good, NEBEL_ERROR_UNSUPPORTED);
        nebel_release_snapshot(fog);
        volumes[i].extinction[2] = 0; /* in a channel without fog there is nothing to prove */
        fog = commit(1, &volumes[i]);
        nebel_destroy_tessellation(tessellate(fog, &(nebel_tessellation_desc){.channel = 2}, &good));
        nebel_release_snapshot(fog);
    }
}

static void test_no_proof_of_voxels_nor_above_a_ball(void **state)
{
    (void)state;
    ground g;
    make_ground(&g, .4);
    const nebel_triangles good = triangles_of(&g);
    const nebel_noise_desc noise = {.size = {4, 4, 4}, .frequency = {1, 1, 1}};
    nebel_volume_desc volumes[2] = {box, box};
    volumes[0].density = (nebel_density){.type = NEBEL_DENSITY_GRID};
    assert_int_equal(nebel_create_noise_grid(&noise, &volumes[0].density.grid), NEBEL_OK);
    volumes[1].density = (nebel_density){.type = NEBEL_DENSITY_ALTITUDE, .radius = 100, .scale_height = 1};
    for (int i = 0; i < 2; i++) {
        fog_messages messages = {0};
        nebel_snapshot *fog = fog_commit(&(nebel_fog_desc){.host.log = fog_messages_log(&messages)}, &volumes[i], 1);
        assert_refused(fog, &(nebel_tessellation_desc){.eye = {4, 3, 8}}, &good, NEBEL_ERROR_UNSUPPORTED);
        assert_non_null(strstr(messages.text, i == 0 ? "proven of a grid" : "proven of fog above a ball"));
        nebel_release_snapshot(fog);
    }
    nebel_release_grid(volumes[0].density.grid);
}

/* An unused vertex may be anything. Memory may end at any time. */
static void test_memory_ends(void **state)
{
    (void)state;
    ground g;
    make_ground(&g, .4);
    nebel_snapshot *fog = commit(1, &box);
    nebel_triangles triangles = triangles_of(&g);
    int worked = 0;
    for (int allowed = 0; allowed < 100 && !worked; allowed++) {
        int left = allowed;
        nebel_tessellation *t = NULL;
        const nebel_tessellation_desc desc = {
            .host.allocator = {no_memory_after, release, &left}, .eye = {4, 3, 8}, .max_depth = 6};
        const nebel_result result = nebel_tessellate(fog, &desc, &triangles, &t);
        worked = result == NEBEL_OK;
        if (!worked) assert_int_equal(result, NEBEL_ERROR_MEMORY);
        assert_true(worked == (t != NULL));
        nebel_destroy_tessellation(t);
    }
    assert_true(worked);
    g.positions[0][0] = NAN;
    triangles.indices += 3 * 2;
    triangles.triangle_count = 3;
    nebel_destroy_tessellation(tessellate(fog, &(nebel_tessellation_desc){.eye = {4, 3, 8}}, &triangles));
    nebel_release_snapshot(fog);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_the_bound_holds_everywhere),
        cmocka_unit_test(test_factor_and_derivatives_are_enclosed),
        cmocka_unit_test(test_each_triangle_has_its_own_bound),
        cmocka_unit_test(test_the_bound_is_met_in_smooth_fog),
        cmocka_unit_test(test_the_bound_is_met_in_soft_fog),
        cmocka_unit_test(test_there_are_no_junctions),
        cmocka_unit_test(test_added_vertices_are_between_their_parents),
        cmocka_unit_test(test_strides_and_origins),
        cmocka_unit_test(test_limits_are_told),
        cmocka_unit_test(test_nothing_to_do),
        cmocka_unit_test(test_degenerate_triangles),
        cmocka_unit_test(test_bad_input),
        cmocka_unit_test(test_fog_without_a_proof_is_refused),
        cmocka_unit_test(test_no_proof_of_voxels_nor_above_a_ball),
        cmocka_unit_test(test_memory_ends),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
