/* Voxels: optical depth against the sum over every cell in long double, light against fine quadrature, instruction sets
 * and company against each other, and what is refused. */
#include "dice.h"
#include "fog_help.h"
#include "near.h"

#include <nebel/shader.h>

/* ---- truth: every face that the ray crosses, sorted; between them polynomials ---------------- */

enum { MOST_SIDE = 20, MOST_CUTS = 512 };

/* Voxels as the truth sees them, in a box that is moved but not turned: coordinates in voxels are rate (p - low). */
typedef struct block {
    int size[3];
    nebel_grid_filter filter;
    double low[3], high[3];
    float voxels[MOST_SIDE * MOST_SIDE * MOST_SIDE];
    nebel_grid *grid;
} block;

static int clamped(int i, int count)
{
    return i < 0 ? 0 : i < count ? i : count - 1;
}

static long double voxel_at(const block *b, int x, int y, int z)
{
    const int i = clamped(x, b->size[0]), j = clamped(y, b->size[1]), k = clamped(z, b->size[2]);
    return (long double)b->voxels[(k * b->size[1] + j) * b->size[0] + i];
}

static long double in_voxels(const block *b, const long double p[3], int axis)
{
    return (p[axis] - (long double)b->low[axis]) * b->size[axis] /
           ((long double)b->high[axis] - (long double)b->low[axis]);
}

static long double density_of_block(const block *b, const long double p[3])
{
    int cell[3];
    long double share[3], sum = 0;
    const int linear = b->filter == NEBEL_GRID_FILTER_LINEAR;
    for (int i = 0; i < 3; i++) {
        const long double at = in_voxels(b, p, i) - (linear ? .5L : 0);
        if (in_voxels(b, p, i) < 0 || in_voxels(b, p, i) > b->size[i]) return 0;
        cell[i] = (int)floorl(at);
        share[i] = at - cell[i];
    }
    if (!linear) return voxel_at(b, cell[0], cell[1], cell[2]);
    for (int corner = 0; corner < 8; corner++) {
        long double weight = 1;
        for (int i = 0; i < 3; i++) weight *= corner >> i & 1 ? share[i] : 1 - share[i];
        sum += weight * voxel_at(b, cell[0] + (corner & 1), cell[1] + (corner >> 1 & 1), cell[2] + (corner >> 2));
    }
    return sum;
}

typedef struct line {
    long double o[3], d[3], length;
} line;

static line line_of_ray(const nebel_ray *ray)
{
    line l = {.length = (long double)ray->t_max};
    long double square = 0;
    for (int i = 0; i < 3; i++) square += (long double)ray->direction[i] * (long double)ray->direction[i];
    for (int i = 0; i < 3; i++) {
        l.o[i] = (long double)ray->origin[i];
        l.d[i] = (long double)ray->direction[i] / sqrtl(square);
    }
    return l;
}

static int compare_cuts(const void *a, const void *b)
{
    const long double x = *(const long double *)a, y = *(const long double *)b;
    return (x > y) - (x < y);
}

typedef struct cuts {
    size_t count;
    long double t[MOST_CUTS];
} cuts;

static void cut(cuts *c, const line *l, long double t)
{
    if (!(t > 0 && t < l->length)) return;
    assert_true(c->count < MOST_CUTS);
    c->t[c->count++] = t;
}

/* Faces of the box, of voxels and of the cubes between their middles. */
static void cut_block(cuts *c, const line *l, const block *b)
{
    for (int i = 0; i < 3; i++) {
        if (l->d[i] == 0) continue;
        for (int half = 0; half <= 2 * b->size[i]; half++) {
            const long double low = (long double)b->low[i], high = (long double)b->high[i];
            cut(c, l, (low + (high - low) * half / (2 * b->size[i]) - l->o[i]) / l->d[i]);
        }
    }
}

static cuts cut_all(const line *l, const block *const *blocks, size_t n)
{
    cuts c = {.count = 0};
    c.t[c.count++] = 0;
    for (size_t i = 0; i < n; i++) cut_block(&c, l, blocks[i]);
    c.t[c.count++] = l->length;
    qsort(c.t, c.count, sizeof c.t[0], compare_cuts);
    return c;
}

static long double density_on(const block *b, const line *l, long double t)
{
    const long double p[3] = {l->o[0] + l->d[0] * t, l->o[1] + l->d[1] * t, l->o[2] + l->d[2] * t};
    return density_of_block(b, p);
}

/* Exact for a cubic. */
static long double integral_on(const block *b, const line *l, long double start, long double end)
{
    const long double middle = (start + end) / 2, half = (end - start) / 2, node = half / sqrtl(3);
    return half * (density_on(b, l, middle - node) + density_on(b, l, middle + node));
}

static long double depth_of(const block *b, const line *l)
{
    const cuts c = cut_all(l, &b, 1);
    long double sum = 0;
    for (size_t i = 1; i < c.count; i++) sum += integral_on(b, l, c.t[i - 1], c.t[i]);
    return sum;
}

/* Light of blocks that each have an extinction and a source: between cuts eight pieces with five points each, the depth
 * up to each exact. */
static void light_of(const block *const *blocks, const double *extinction, const double *source, size_t n,
                     const line *l, long double *transmittance, long double *radiance)
{
    static const long double nodes[5] = {.046910077030668003601L, .23076534494715845448L, .5L, .76923465505284154552L,
                                         .9530899229693319964L};
    static const long double weights[5] = {.11846344252809454376L, .23931433524968323402L, .28444444444444444444L,
                                           .23931433524968323402L, .11846344252809454376L};
    const cuts c = cut_all(l, blocks, n);
    long double depth = 0;
    *radiance = 0;
    for (size_t i = 1; i < c.count; i++)
        for (int part = 0; part < 8; part++) {
            const long double h = (c.t[i] - c.t[i - 1]) / 8, start = c.t[i - 1] + h * part;
            for (int k = 0; k < 5; k++) {
                long double before = depth, light = 0;
                for (size_t j = 0; j < n; j++) {
                    before += (long double)extinction[j] * integral_on(blocks[j], l, start, start + h * nodes[k]);
                    light += (long double)(extinction[j] * source[j]) * density_on(blocks[j], l, start + h * nodes[k]);
                }
                *radiance += weights[k] * h * light * expl(-before);
            }
            for (size_t j = 0; j < n; j++)
                depth += (long double)extinction[j] * integral_on(blocks[j], l, start, start + h);
        }
    *transmittance = expl(-depth);
}

/* ---- blocks ---------------------------------------------------------------------------------- */

static nebel_grid *make_grid(const int size[3], nebel_voxel_type type, nebel_grid_filter filter, const void *voxels)
{
    nebel_grid *grid = NULL;
    const nebel_grid_desc desc = {
        .size = {(size_t)size[0], (size_t)size[1], (size_t)size[2]}, .type = type, .voxels = voxels, .filter = filter};
    assert_int_equal(nebel_create_grid(&desc, &grid), NEBEL_OK);
    return grid;
}

/* A third of the voxels is empty, so that bricks are, too; dice decide how many hang together. */
static void fill_block(uint64_t *state, block *b, nebel_grid_filter filter)
{
    b->filter = filter;
    const int hollow = dice_below(state, 3);
    for (int i = 0; i < 3; i++) {
        b->size[i] = 1 + dice_below(state, MOST_SIDE);
        b->low[i] = dice(state, -3, 0);
        b->high[i] = b->low[i] + dice(state, .5, 4);
    }
    const int count = b->size[0] * b->size[1] * b->size[2];
    for (int i = 0; i < count; i++) {
        const int empty = hollow == 1 ? dice_below(state, 3) == 0 : hollow == 2 && i % b->size[0] < 9;
        b->voxels[i] = empty ? 0 : (float)dice(state, 0, 2);
    }
    b->grid = make_grid(b->size, NEBEL_VOXEL_FLOAT, filter, b->voxels);
}

static nebel_volume_desc volume_of(const block *b, double extinction, double source)
{
    nebel_volume_desc v = {.shape = {.type = NEBEL_SHAPE_BOX},
                           .density = {.type = NEBEL_DENSITY_GRID, .grid = b->grid},
                           .extinction = {extinction, extinction, extinction},
                           .source = {source, source, source}};
    memcpy(v.shape.min, b->low, sizeof b->low);
    memcpy(v.shape.max, b->high, sizeof b->high);
    return v;
}

/* Some run along an axis, some end within. */
static nebel_ray random_ray(uint64_t *state)
{
    nebel_ray ray = {.t_max = dice(state, 2, 12)};
    const int level = dice_below(state, 8);
    for (int i = 0; i < 3; i++) {
        ray.origin[i] = dice(state, -4, 4);
        const double to = dice(state, -2, 2);
        ray.direction[i] = level == i ? 0 : to - ray.origin[i];
    }
    return ray;
}

static nebel_transfer trace(const nebel_lighting *fog, nebel_precision digits, double tolerance, const nebel_ray *ray)
{
    nebel_transfer transfer;
    const nebel_trace_desc desc = {.precision = digits, .tolerance = tolerance};
    fog_trace(fog, desc, 1, ray, &transfer);
    return transfer;
}

/* ---- tests ----------------------------------------------------------------------------------- */

/* Voxel values at integer index: the box begins half a voxel before the first. */
static void depth_is_that_of_T39(void **state)
{
    (void)state;
    const int size[3] = {4, 4, 4};
    float voxels[64];
    for (int k = 0; k < 4; k++)
        for (int j = 0; j < 4; j++)
            for (int i = 0; i < 4; i++)
                voxels[(k * 4 + j) * 4 + i] = (float)((7 * i * i + 3 * j + 5 * k * k * i + 2 * i * j * k) % 11);
    nebel_volume_desc v = {.shape = {.type = NEBEL_SHAPE_BOX, .min = {-.5, -.5, -.5}, .max = {3.5, 3.5, 3.5}},
                           .density = {.type = NEBEL_DENSITY_GRID},
                           .extinction = {.1, .1, .1}};
    v.density.grid = make_grid(size, NEBEL_VOXEL_FLOAT, NEBEL_GRID_FILTER_LINEAR, voxels);
    nebel_lighting *fog = fog_light(NULL, &v, 1);
    nebel_release_grid(v.density.grid);
    const nebel_ray ray = {.origin = {0, .4, 2.7}, .direction = {3, 2.2, -2.4}, .t_max = 4.427188724235731};
    const nebel_transfer exact = trace(fog, NEBEL_PRECISION_DOUBLE, 0, &ray);
    assert_near(-log(exact.transmittance[0]), 1.805295396947395, 1e-12 * 1.8);
    assert_true(exact.error < 1e-12);
    const nebel_transfer fast = trace(fog, NEBEL_PRECISION_FLOAT, 0, &ray);
    assert_near(-log(fast.transmittance[0]), 1.805295396947395, 3e-6);
    nebel_release_lighting(fog);
}

static void check_depth(uint64_t seed, nebel_grid_filter filter)
{
    uint64_t state = seed;
    block b;
    fill_block(&state, &b, filter);
    const nebel_volume_desc v = volume_of(&b, .4, 1);
    nebel_lighting *fog = fog_light(NULL, &v, 1);
    nebel_release_grid(b.grid);
    for (int i = 0; i < 40; i++) {
        const nebel_ray ray = random_ray(&state);
        const line l = line_of_ray(&ray);
        const long double transmittance = expl(-.4L * depth_of(&b, &l));
        for (int p = 0; p < 2; p++) {
            const nebel_transfer transfer = trace(fog, (nebel_precision)p, 0, &ray);
            const double off = fabs((double)((long double)transfer.transmittance[1] - transmittance));
            const double dark = fabs((double)((long double)transfer.in_scattering[1] - (1 - transmittance)));
            assert_true(transfer.error <= (p == 0 ? 1e-11 : 1e-5));
            if (!(off <= transfer.error && dark <= transfer.error && off <= (p == 0 ? 1e-12 : 1e-6)))
                fail_msg("seed %d ray %d precision %d: off by %g and %g, said %g", (int)seed, i, p, off, dark,
                         transfer.error);
        }
    }
    nebel_release_lighting(fog);
}

static void depth_is_the_sum_over_cells(void **state)
{
    (void)state;
    for (uint64_t seed = 0; seed < 200; seed++) check_depth(seed, NEBEL_GRID_FILTER_LINEAR);
}

static void depth_is_the_sum_over_voxels(void **state)
{
    (void)state;
    for (uint64_t seed = 0; seed < 200; seed++) check_depth(seed, NEBEL_GRID_FILTER_NEAREST);
}

/* Two grids of different light over each other. */
static void check_light(uint64_t seed, nebel_grid_filter filter, double tolerance)
{
    uint64_t state = seed;
    static block a, b;
    fill_block(&state, &a, filter);
    fill_block(&state, &b, NEBEL_GRID_FILTER_LINEAR);
    const double extinction[2] = {dice(&state, .1, 3), dice(&state, .1, 3)}, source[2] = {.2, 1};
    const nebel_volume_desc v[2] = {volume_of(&a, extinction[0], source[0]), volume_of(&b, extinction[1], source[1])};
    const nebel_volume_desc turned[2] = {v[1], v[0]};
    nebel_lighting *fog = fog_light(NULL, v, 2), *other = fog_light(NULL, turned, 2);
    nebel_release_grid(a.grid);
    nebel_release_grid(b.grid);
    const block *const blocks[2] = {&a, &b};
    for (int i = 0; i < 8; i++) {
        long double transmittance, radiance;
        const nebel_ray ray = random_ray(&state);
        const line l = line_of_ray(&ray);
        light_of(blocks, extinction, source, 2, &l, &transmittance, &radiance);
        for (int p = 0; p < 2; p++) {
            const nebel_transfer transfer = trace(fog, (nebel_precision)p, tolerance, &ray);
            const nebel_transfer same = trace(other, (nebel_precision)p, tolerance, &ray);
            const double off = fmax(fabs((double)((long double)transfer.transmittance[0] - transmittance)),
                                    fabs((double)((long double)transfer.in_scattering[0] - radiance)));
            assert_true(transfer.error <= tolerance + (p == 0 ? 1e-8 : 1e-4));
            if (!(off <= transfer.error))
                fail_msg("seed %d ray %d precision %d: off by %g, said %g", (int)seed, i, p, off, transfer.error);
            assert_memory_equal(&transfer, &same, sizeof transfer);
        }
    }
    nebel_release_lighting(fog);
    nebel_release_lighting(other);
}

static void errors_admit_the_truth(void **state)
{
    (void)state;
    for (uint64_t seed = 0; seed < 60; seed++) {
        check_light(seed, NEBEL_GRID_FILTER_LINEAR, seed % 2 == 0 ? 2e-3 : 1e-7);
        check_light(seed, NEBEL_GRID_FILTER_NEAREST, seed % 2 == 0 ? 2e-3 : 1e-7);
    }
}

/* ---- sunlight in voxels alone ---------------------------------------------------------------- */

static const double lone_extinction = 1.5, lone_glow = .8; /* the second: of opaque fog, were it lit from all around */

/* Sunlight that the block scatters along the line: between cuts `parts` pieces with two points each. */
static long double sunlight_of(const block *b, const long double to_sun[3], const line *l, int parts)
{
    const cuts c = cut_all(l, &b, 1);
    const long double k = (long double)lone_extinction;
    long double depth = 0, sum = 0;
    for (size_t i = 1; i < c.count; i++)
        for (int part = 0; part < parts; part++) {
            const long double h = (c.t[i] - c.t[i - 1]) / parts, start = c.t[i - 1] + h * part;
            for (int side = -1; side <= 1; side += 2) {
                const long double t = start + h * (.5L + (long double)side / sqrtl(12));
                const long double density = density_on(b, l, t);
                if (density <= 0) continue;
                line up = {.length = 20};
                for (int a = 0; a < 3; a++) {
                    up.o[a] = l->o[a] + l->d[a] * t;
                    up.d[a] = to_sun[a];
                }
                sum += h / 2 * density * expl(-k * (depth + integral_on(b, l, start, t) + depth_of(b, &up)));
            }
            depth += integral_on(b, l, start, start + h);
        }
    return sum * k * (long double)lone_glow;
}

/* One block alone, in some seeds with a sun level with its faces. */
static nebel_lighting *lone_fog(uint64_t *state, block *b, nebel_grid_filter filter, double sun[3])
{
    fill_block(state, b, filter);
    const int level = dice_below(state, 5);
    double square = 0;
    for (int i = 0; i < 3; i++) {
        sun[i] = level == i ? 0 : dice(state, -1, 1);
        square += sun[i] * sun[i];
    }
    for (int i = 0; i < 3; i++) sun[i] /= sqrt(square);
    nebel_volume_desc v = volume_of(b, lone_extinction, 0);
    nebel_lighting_desc desc = {.sun = {.direction = {sun[0], sun[1], sun[2]}}};
    for (int c = 0; c < 3; c++) {
        v.albedo[c] = lone_glow;
        desc.sun.irradiance[c] = 4 * acos(-1);
    }
    nebel_lighting *fog = fog_light(&desc, &v, 1);
    nebel_release_grid(b->grid);
    return fog;
}

static void check_sunlight(uint64_t seed, nebel_grid_filter filter, double tolerance)
{
    static block b;
    uint64_t state = 977 * seed + 5;
    double sun[3];
    nebel_lighting *fog = lone_fog(&state, &b, filter, sun);
    const long double to_sun[3] = {(long double)sun[0], (long double)sun[1], (long double)sun[2]};
    for (int i = 0; i < 4; i++) {
        const nebel_ray ray = random_ray(&state);
        const line l = line_of_ray(&ray);
        const long double truth = sunlight_of(&b, to_sun, &l, 12), rough = sunlight_of(&b, to_sun, &l, 5);
        const double doubt = fabs((double)(truth - rough)) + 2e-6; /* the edges of shadows lie anywhere */
        assert_true(doubt < 1e-3);
        for (int p = 0; p < 2; p++) {
            const nebel_transfer transfer = trace(fog, (nebel_precision)p, tolerance, &ray);
            const double off = fabs((double)((long double)transfer.in_scattering[0] - truth));
            assert_true(transfer.error <= tolerance + (p == 0 ? 1e-8 : 1e-4));
            if (!(off <= transfer.error + doubt))
                fail_msg("seed %d ray %d precision %d: off by %g, said %g", (int)seed, i, p, off, transfer.error);
        }
    }
    nebel_release_lighting(fog);
}

static void errors_of_sunlight_admit_the_truth(void **state)
{
    (void)state;
    for (uint64_t seed = 0; seed < 24; seed++) {
        check_sunlight(seed, NEBEL_GRID_FILTER_LINEAR, seed % 2 == 0 ? 2e-3 : 1e-4);
        check_sunlight(seed, NEBEL_GRID_FILTER_NEAREST, seed % 2 == 0 ? 2e-3 : 1e-4);
    }
}

/* What the sun lights and what surfaces keep from it is all that it would light. */
static void shadows_of_surfaces_part_the_sunlight(void **test)
{
    static const float boundaries[] = {0, .7F, 1.9F, 2.5F, 3.25F, .7F, 1.9F, 2.5F, 3.25F};
    static const uint32_t lit[] = {0, 5}, dark[] = {5, 9};
    static block b;
    (void)test;
    for (uint64_t seed = 0; seed < 40; seed++) {
        uint64_t state = seed;
        double sun[3];
        nebel_lighting *fog = lone_fog(&state, &b, (nebel_grid_filter)(seed % 2), sun);
        const nebel_ray ray = random_ray(&state);
        const nebel_ray_visibility seen[2] = {{lit, boundaries}, {dark, boundaries}};
        nebel_transfer part[2];
        const nebel_transfer all = trace(fog, NEBEL_PRECISION_FLOAT, 1e-4, &ray);
        for (int i = 0; i < 2; i++) {
            nebel_trace_desc desc = {.precision = NEBEL_PRECISION_FLOAT, .tolerance = 1e-4, .sun_visibility = &seen[i]};
            fog_trace(fog, desc, 1, &ray, &part[i]);
        }
        const double sum = part[0].in_scattering[0] + part[1].in_scattering[0];
        assert_true(fabs(sum - all.in_scattering[0]) <= part[0].error + part[1].error + all.error);
        nebel_release_lighting(fog);
    }
}

static void trace_at(const nebel_lighting *fog, nebel_isa isa, size_t n, const nebel_ray *rays, nebel_transfer *to)
{
    const nebel_trace_desc desc = {.precision = NEBEL_PRECISION_FLOAT, .isa = isa, .tolerance = 1e-5};
    fog_trace(fog, desc, n, rays, to);
}

/* Turned boxes, mirrored ones, fog of other kinds, and the sun. */
static nebel_lighting *mixed_fog(uint64_t *state, double albedo)
{
    static block b[2];
    nebel_volume_desc v[3] = {
        {.shape = {.type = NEBEL_SHAPE_SPHERE, .radius = 2}, .extinction = {.1, .2, .3}, .source = {.4, .2, .9}}};
    for (int i = 0; i < 2; i++) {
        fill_block(state, &b[i], i == 0 ? NEBEL_GRID_FILTER_LINEAR : NEBEL_GRID_FILTER_NEAREST);
        v[i + 1] = volume_of(&b[i], .7, .5);
        v[i + 1].shape.transform = (nebel_transform){
            .position = {.1, .2, .3}, .rotation = {.1, .2 * i, .3, 1}, .scale = {1, i == 0 ? -1 : .5, 2}};
    }
    if (albedo > 0)
        for (int c = 0; c < 3; c++) {
            v[1].source[c] = 0;
            v[1].albedo[c] = albedo;
        }
    const nebel_lighting_desc desc = {.environment = {.radiance = {.1, .2, .3}}, .sun = {{.3, .8, .5}, {3, 2, 1}}};
    nebel_lighting *fog = fog_light(&desc, v, 3);
    for (int i = 0; i < 2; i++) nebel_release_grid(b[i].grid);
    return fog;
}

static void bits_do_not_depend_on_company(void **test)
{
    (void)test;
    enum { RAYS = 37 };
    for (uint64_t seed = 0; seed < 16; seed++) {
        static block lone;
        double sun[3];
        uint64_t state = seed;
        nebel_lighting *fog = seed < 12 ? mixed_fog(&state, seed % 3 == 2 ? .5 : 0)
                                        : lone_fog(&state, &lone, (nebel_grid_filter)(seed % 2), sun);
        nebel_ray rays[RAYS];
        nebel_transfer alone[RAYS], all[RAYS];
        for (int i = 0; i < RAYS; i++) rays[i] = random_ray(&state);
        for (size_t i = 0; i < RAYS; i++) trace_at(fog, NEBEL_ISA_SCALAR, 1, &rays[i], &alone[i]);
        for (int isa = 1; isa < NEBEL_ISA_COUNT; isa++) {
            if (!nebel_isa_available((nebel_isa)isa)) continue;
            trace_at(fog, (nebel_isa)isa, RAYS, rays, all);
            for (int i = 0; i < RAYS; i++) assert_memory_equal(&all[i], &alone[i], offsetof(nebel_transfer, error));
        }
        nebel_release_lighting(fog);
    }
}

/* Float is within its error of double, also in turned boxes. */
static void float_is_near_double(void **test)
{
    (void)test;
    for (uint64_t seed = 100; seed < 140; seed++) {
        uint64_t state = seed;
        nebel_lighting *fog = mixed_fog(&state, 0);
        for (int i = 0; i < 20; i++) {
            const nebel_ray ray = random_ray(&state);
            const nebel_transfer fine = trace(fog, NEBEL_PRECISION_DOUBLE, 1e-9, &ray);
            const nebel_transfer fast = trace(fog, NEBEL_PRECISION_FLOAT, 1e-5, &ray);
            assert_true(fine.error <= 1.2e-8);
            assert_true(fast.error <= 1.1e-4);
            assert_true(fog_difference(&fine, &fast) <= fine.error + fast.error);
        }
        nebel_release_lighting(fog);
    }
}

/* Voxels that are all the same are fog of a constant density; under the sun, too. */
static void equal_voxels_are_constant_density(void **test)
{
    (void)test;
    float voxels[27];
    for (int i = 0; i < 27; i++) voxels[i] = .5F;
    nebel_volume_desc v = {.shape = {.type = NEBEL_SHAPE_BOX, .min = {-2, -1, -1}, .max = {2, 2, 1}},
                           .density = {.type = NEBEL_DENSITY_GRID},
                           .extinction = {1, .5, .25},
                           .albedo = {.9, .8, .7}};
    v.density.grid = make_grid((int[]){3, 3, 3}, NEBEL_VOXEL_FLOAT, NEBEL_GRID_FILTER_LINEAR, voxels);
    nebel_volume_desc even = v;
    even.density = (nebel_density){0};
    for (int c = 0; c < 3; c++) even.extinction[c] /= 2;
    const nebel_lighting_desc desc = {.environment = {.radiance = {.1, .2, .3}}, .sun = {{.3, .8, .5}, {3, 2, 1}}};
    nebel_lighting *fog = fog_light(&desc, &v, 1), *plain = fog_light(&desc, &even, 1);
    nebel_release_grid(v.density.grid);
    uint64_t state = 7;
    for (int i = 0; i < 50; i++) {
        const nebel_ray ray = random_ray(&state);
        const nebel_transfer a = trace(fog, NEBEL_PRECISION_DOUBLE, 1e-4, &ray);
        const nebel_transfer b = trace(plain, NEBEL_PRECISION_DOUBLE, 1e-4, &ray);
        assert_true(fog_difference(&a, &b) <= a.error + b.error);
        assert_near(a.transmittance[0], b.transmittance[0], 1e-14);
    }
    nebel_release_lighting(fog);
    nebel_release_lighting(plain);
}

/* All types of voxels, with scale and offset, are the same density. */
static void types_agree(void **test)
{
    (void)test;
    uint8_t bytes[60];
    uint16_t words[60];
    float floats[60];
    uint64_t state = 3;
    for (int i = 0; i < 60; i++) {
        bytes[i] = (uint8_t)dice_below(&state, 256);
        words[i] = (uint16_t)(bytes[i] * 257);
        floats[i] = (float)bytes[i];
    }
    const void *const voxels[] = {floats, bytes, words};
    const double scales[] = {2. / 255, 2, 2};
    nebel_lighting *fog[3];
    for (int i = 0; i < 3; i++) {
        const nebel_grid_desc desc = {
            .size = {3, 4, 5}, .type = (nebel_voxel_type)i, .voxels = voxels[i], .scale = scales[i], .offset = .25};
        nebel_volume_desc v = {.shape = {.type = NEBEL_SHAPE_BOX, .min = {-2, -1, -1}, .max = {2, 2, 1}},
                               .density = {.type = NEBEL_DENSITY_GRID},
                               .extinction = {1, .5, .25}};
        assert_int_equal(nebel_create_grid(&desc, &v.density.grid), NEBEL_OK);
        fog[i] = fog_light(NULL, &v, 1);
        nebel_release_grid(v.density.grid);
    }
    for (int i = 0; i < 30; i++) {
        const nebel_ray ray = random_ray(&state);
        const nebel_transfer a = trace(fog[0], NEBEL_PRECISION_DOUBLE, 0, &ray);
        for (int k = 1; k < 3; k++)
            for (int isa = NEBEL_ISA_DEFAULT; isa < NEBEL_ISA_COUNT; isa++) {
                nebel_transfer b = trace(fog[k], NEBEL_PRECISION_DOUBLE, 0, &ray);
                if (isa > 0 && nebel_isa_available((nebel_isa)isa)) trace_at(fog[k], (nebel_isa)isa, 1, &ray, &b);
                assert_near(a.transmittance[0], b.transmittance[0], isa > 0 ? 1e-6 : 1e-14);
            }
    }
    for (int i = 0; i < 3; i++) nebel_release_lighting(fog[i]);
}

/* Visibility ends where the depth does. */
static void distances_are_found(void **test)
{
    (void)test;
    uint64_t state = 11;
    block b;
    fill_block(&state, &b, NEBEL_GRID_FILTER_LINEAR);
    const nebel_volume_desc v = volume_of(&b, 1, 0);
    nebel_lighting *fog = fog_light(NULL, &v, 1);
    nebel_release_grid(b.grid);
    const nebel_snapshot *snapshot = nebel_get_lighting_snapshot(fog);
    for (int i = 0; i < 50; i++) {
        nebel_ray ray = random_ray(&state);
        double distance;
        assert_int_equal(nebel_invert_transmittance(snapshot, .7, 0, 1, &ray, sizeof ray, &distance), NEBEL_OK);
        if (isfinite(distance)) {
            assert_true(distance <= ray.t_max);
            ray.t_max = distance;
            assert_near(trace(fog, NEBEL_PRECISION_DOUBLE, 0, &ray).transmittance[0], .7, 1e-11);
        } else {
            assert_true(trace(fog, NEBEL_PRECISION_DOUBLE, 0, &ray).transmittance[0] >= .7);
        }
    }
    nebel_release_lighting(fog);
}

/* Extinction at places is that of the truth, and no more than the bound of a ray that starts there. */
static void places_are_sampled_and_bounded(void **test)
{
    (void)test;
    for (uint64_t seed = 0; seed < 40; seed++) {
        uint64_t state = seed;
        block b;
        fill_block(&state, &b, seed % 2 == 0 ? NEBEL_GRID_FILTER_LINEAR : NEBEL_GRID_FILTER_NEAREST);
        const nebel_volume_desc v = volume_of(&b, .5, 1);
        nebel_snapshot *fog = fog_commit(&(nebel_fog_desc){0}, &v, 1);
        nebel_release_grid(b.grid);
        for (int i = 0; i < 30; i++) {
            long double at[3];
            nebel_sample_point place = {.distance = -1};
            nebel_ray ray = random_ray(&state);
            nebel_medium_properties matter;
            nebel_majorant_segment bound;
            for (int c = 0; c < 3; c++) {
                ray.origin[c] = place.position[c] = dice(&state, b.low[c], b.high[c]);
                at[c] = (long double)place.position[c];
            }
            assert_int_equal(nebel_sample_medium(fog, 1, &place, sizeof place, &matter, sizeof matter), NEBEL_OK);
            assert_near(matter.extinction[1], .5 * (double)density_of_block(&b, at), 1e-12);
            assert_int_equal(nebel_next_majorant(fog, &ray, 0, 0, &bound), NEBEL_OK);
            assert_true(matter.extinction[1] <= bound.extinction[1]);
        }
        nebel_release_snapshot(fog);
    }
}

typedef struct bad_grid {
    nebel_grid_desc desc;
    nebel_result result;
    const char *word;
} bad_grid;

static void bad_grids_are_refused(void **test)
{
    (void)test;
    static const float good[8] = {0}, not_a_number[8] = {0, 0, 0, NAN}, negative[8] = {0, -1e-6F},
                       endless[8] = {0, 0, 0, 0, 0, INFINITY}, huge[8] = {2e9F};
    static const uint8_t bytes[8] = {0};
    const bad_grid cases[] = {
        {{.size = {2, 2, 2}}, NEBEL_ERROR_ARGUMENT, "voxels must not be NULL"},
        {{.size = {2, 0, 2}, .voxels = good}, NEBEL_ERROR_LIMIT, "2 x 0 x 2 voxels; must be 1 to 4096"},
        {{.size = {4097, 1, 1}, .voxels = good}, NEBEL_ERROR_LIMIT, "must be 1 to 4096"},
        {{.size = {4096, 4096, 4096}, .voxels = good}, NEBEL_ERROR_LIMIT, "at most 1073741824 in all"},
        {{.size = {2, 2, 2}, .voxels = good, .type = (nebel_voxel_type)9}, NEBEL_ERROR_ARGUMENT, "type 9 is unknown"},
        {{.size = {2, 2, 2}, .voxels = good, .filter = 9}, NEBEL_ERROR_ARGUMENT, "filter 9 is unknown"},
        {{.size = {2, 2, 2}, .voxels = good, .scale = HUGE_VAL}, NEBEL_ERROR_VALUE, "scale and offset"},
        {{.size = {2, 2, 2}, .voxels = good, .offset = (double)NAN}, NEBEL_ERROR_VALUE, "scale and offset"},
        {{.size = {2, 2, 2}, .voxels = not_a_number}, NEBEL_ERROR_VALUE, "voxel 1, 1, 0 has the density nan"},
        {{.size = {2, 2, 2}, .voxels = negative}, NEBEL_ERROR_VALUE, "voxel 1, 0, 0 has the density -1e-06"},
        {{.size = {2, 2, 2}, .voxels = endless}, NEBEL_ERROR_VALUE, "voxel 1, 0, 1 has the density inf"},
        {{.size = {2, 2, 2}, .voxels = huge}, NEBEL_ERROR_VALUE, "must be within 0 and 1e+09"},
        {{.size = {2, 2, 2}, .voxels = bytes, .type = NEBEL_VOXEL_UINT8, .offset = -.1}, NEBEL_ERROR_VALUE, "-0.1"},
        {{.size = {2, 2, 2}, .voxels = good, .host.allocator = {.user = NULL, .allocate = fog_memory_allocate}},
         NEBEL_ERROR_ARGUMENT,
         "both functions or neither"},
    };
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        fog_messages messages = {0};
        nebel_grid_desc desc = cases[i].desc;
        nebel_grid *grid = (nebel_grid *)&messages;
        desc.host.log = fog_messages_log(&messages);
        assert_int_equal(nebel_create_grid(&desc, &grid), cases[i].result);
        assert_null(grid);
        assert_int_equal(messages.count, 1);
        if (strstr(messages.text, cases[i].word) == NULL) fail_msg("case %zu says: %s", i, messages.text);
    }
    assert_int_equal(nebel_create_grid(NULL, NULL), NEBEL_ERROR_ARGUMENT);
    assert_int_equal(nebel_create_grid(&cases[0].desc, NULL), NEBEL_ERROR_ARGUMENT);
}

static void volumes_need_a_box_and_a_grid(void **test)
{
    (void)test;
    fog_messages messages = {0};
    nebel_fog *fog = NULL;
    const float voxel = 1;
    nebel_grid *grid = make_grid((int[]){1, 1, 1}, NEBEL_VOXEL_FLOAT, NEBEL_GRID_FILTER_LINEAR, &voxel);
    assert_int_equal(nebel_create_fog(&(nebel_fog_desc){.host.log = fog_messages_log(&messages)}, &fog), NEBEL_OK);
    nebel_volume_desc v = {.shape = {.type = NEBEL_SHAPE_BOX, .max = {1, 1, 1}},
                           .density = {.type = NEBEL_DENSITY_GRID},
                           .extinction = {1, 1, 1}};
    assert_int_equal(nebel_add_volume(fog, &v, NULL), NEBEL_ERROR_ARGUMENT);
    assert_non_null(strstr(messages.text, "grid must not be NULL"));
    v.density.grid = grid;
    assert_int_equal(nebel_add_volume(fog, &v, NULL), NEBEL_OK);
    v.shape = (nebel_shape){.type = NEBEL_SHAPE_SPHERE, .radius = 1};
    assert_int_equal(nebel_add_volume(fog, &v, NULL), NEBEL_ERROR_VALUE);
    assert_non_null(strstr(messages.text, "needs a box"));
    nebel_snapshot *snapshot = NULL;
    size_t words;
    const nebel_light light = {.intensity = {1, 1, 1}};
    nebel_lighting_desc sky = {.sun = {.direction = {0, 1, 0}, .irradiance = {1, 1, 1}}, .lights = &light};
    v.shape = (nebel_shape){.type = NEBEL_SHAPE_BOX, .max = {1, 1, 1}};
    v.albedo[0] = 1;
    assert_int_equal(nebel_add_volume(fog, &v, NULL), NEBEL_OK);
    assert_int_equal(nebel_commit_fog(fog, &snapshot), NEBEL_OK);
    for (; sky.light_count < 2; sky.light_count++) {
        nebel_lighting *lit = light_fog(snapshot, &sky);
        assert_int_equal(nebel_pack_fog(lit, (double[3]){0, 0, 0}, NULL, 0, &words), NEBEL_OK);
        nebel_release_lighting(lit);
    }
    nebel_destroy_fog(fog);
    nebel_release_snapshot(snapshot);
    nebel_release_grid(grid);
}

/* A grid lives as long as anybody needs it, and the sun's lattice; whatever fails gives back what it took. */
static nebel_result live_and_die(const nebel_allocator *allocator, double albedo)
{
    const float voxels[8] = {1, 2};
    nebel_grid *grid = NULL;
    nebel_fog *fog = NULL;
    nebel_snapshot *snapshot = NULL;
    nebel_lighting *lit[2] = {NULL, NULL};
    nebel_volume_id id;
    const nebel_grid_desc desc = {.host.allocator = *allocator, .size = {2, 2, 2}, .voxels = voxels};
    nebel_result result = nebel_create_grid(&desc, &grid);
    if (result != NEBEL_OK) return result;
    nebel_volume_desc v = {.shape = {.type = NEBEL_SHAPE_BOX, .max = {1, 1, 1}},
                           .density = {.type = NEBEL_DENSITY_GRID, .grid = grid},
                           .extinction = {1, 1, 1},
                           .albedo = {albedo, albedo, albedo}};
    nebel_lighting_desc sky = {.sun = {{.2, 1, .3}, {1, 1, 1}}};
    result = nebel_create_fog(&(nebel_fog_desc){.host.allocator = *allocator}, &fog);
    if (result == NEBEL_OK) result = nebel_add_volume(fog, &v, &id);
    if (result == NEBEL_OK) result = nebel_update_volume(fog, id, &v);
    for (int i = 0; i < 2 && result == NEBEL_OK; i++) {
        nebel_release_snapshot(snapshot);
        result = nebel_commit_fog(fog, &snapshot);
        sky.previous = lit[0];
        if (result == NEBEL_OK) result = nebel_create_lighting(snapshot, &sky, &lit[i]);
    }
    nebel_release_snapshot(snapshot);
    nebel_release_lighting(lit[0]);
    if (result == NEBEL_OK) result = nebel_remove_volume(fog, id);
    nebel_release_grid(grid);
    nebel_destroy_fog(fog);
    if (result == NEBEL_OK) {
        const nebel_ray ray = {.origin = {-1, .5, .5}, .direction = {1, 0, 0}, .t_max = 9};
        assert_near(trace(lit[1], NEBEL_PRECISION_DOUBLE, 2e-3, &ray).transmittance[0], exp(-.375), 1e-15);
    }
    nebel_release_lighting(lit[1]);
    return result;
}

static void expect_no_loss(double albedo)
{
    fog_memory memory = {0};
    const nebel_allocator allocator = fog_memory_allocator(&memory);
    assert_int_equal(live_and_die(&allocator, albedo), NEBEL_OK);
    const size_t calls = memory.calls;
    assert_int_equal(memory.live, 0);
    for (size_t i = 1; i <= calls; i++) {
        memory.fail_first = i;
        memory.fail_count = 1;
        const nebel_result result = live_and_die(&allocator, albedo);
        assert_int_equal(memory.live, 0);
        if (memory.fail_first == 0) assert_int_equal(result, NEBEL_ERROR_MEMORY);
        memory.fail_first = 0;
    }
}

static void memory_may_run_out(void **test)
{
    (void)test;
    expect_no_loss(0);
    expect_no_loss(1);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(depth_is_that_of_T39),
        cmocka_unit_test(depth_is_the_sum_over_cells),
        cmocka_unit_test(depth_is_the_sum_over_voxels),
        cmocka_unit_test(errors_admit_the_truth),
        cmocka_unit_test(errors_of_sunlight_admit_the_truth),
        cmocka_unit_test(shadows_of_surfaces_part_the_sunlight),
        cmocka_unit_test(bits_do_not_depend_on_company),
        cmocka_unit_test(float_is_near_double),
        cmocka_unit_test(equal_voxels_are_constant_density),
        cmocka_unit_test(types_agree),
        cmocka_unit_test(distances_are_found),
        cmocka_unit_test(places_are_sampled_and_bounded),
        cmocka_unit_test(bad_grids_are_refused),
        cmocka_unit_test(volumes_need_a_box_and_a_grid),
        cmocka_unit_test(memory_may_run_out),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
