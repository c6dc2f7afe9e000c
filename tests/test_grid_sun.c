/* Sunlight in voxels that are cut off at the faces of their box, where the way to the sun ends at one face here and at
 * another one there: the error that is told against light by brute force, and among other fog against light in double; and
 * what lattices of depths say of themselves against exact integrals. A number as argument tries so many grids. */
#include "dice.h"
#include "fog_help.h"

#include "base/base.h"
#include "light/light_lattice.h"
#include "light/lighting.h"
#include "light/sun_lattice.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static int grid_count = 40;

enum { MOST_SIDE = 40, RAYS = 12, PLACES = 400, PARTS = 1500 };

/* Voxels in a box that is moved but not turned, and a sun that is low in half of them. */
typedef struct cloud {
    int size[3];
    double low[3], high[3], rate[3]; /* cells per metre */
    double sun[3];                   /* of length 1 */
    double extinction;
    nebel_grid *grid;
} cloud;

/* Waves above a level, in some rough, in some with holes; dense up to the faces. */
static void fill_voxels(uint64_t *state, const cloud *c, float *voxel)
{
    double wave[3][3], phase[3];
    const double level = dice(state, -.5, 1.5), rough = dice_below(state, 2) ? 0 : dice(state, 0, .3);
    const int has_holes = dice_below(state, 4) == 0;
    for (int i = 0; i < 9; i++) wave[i / 3][i % 3] = dice(state, -.8, .8);
    for (int i = 0; i < 3; i++) phase[i] = dice(state, 0, 6);
    for (int z = 0; z < c->size[2]; z++)
        for (int y = 0; y < c->size[1]; y++)
            for (int x = 0; x < c->size[0]; x++) {
                double sum = level + dice(state, -1, 1) * rough;
                for (int i = 0; i < 3; i++)
                    sum += .5 * sin(phase[i] + wave[i][0] * x + wave[i][1] * y + wave[i][2] * z);
                const double hole = dice_below(state, 2) ? 0 : dice(state, 0, 1);
                *voxel++ = (float)(has_holes ? hole : fmax(sum, 0));
            }
}

static cloud random_cloud(uint64_t *state)
{
    static float voxels[MOST_SIDE * MOST_SIDE * MOST_SIDE];
    cloud c = {.extinction = exp(dice(state, log(.1), log(10)))};
    const double lowness = dice_below(state, 2) ? dice(state, 0, .1) : 1;
    double square = 0;
    for (int i = 0; i < 3; i++) {
        c.size[i] = 6 + dice_below(state, MOST_SIDE - 6);
        c.low[i] = -dice(state, .5, 3);
        c.high[i] = dice(state, .5, 3);
        c.rate[i] = c.size[i] / (c.high[i] - c.low[i]);
        c.sun[i] = dice(state, -1, 1) * (i == 1 ? lowness : 1);
        square += c.sun[i] * c.sun[i];
    }
    for (int i = 0; i < 3; i++) c.sun[i] /= sqrt(square);
    fill_voxels(state, &c, voxels);
    const nebel_grid_desc desc = {
        .size = {(size_t)c.size[0], (size_t)c.size[1], (size_t)c.size[2]}, .type = NEBEL_VOXEL_FLOAT, .voxels = voxels};
    assert_int_equal(nebel_create_grid(&desc, &c.grid), NEBEL_OK);
    return c;
}

static nebel_volume_desc fog_volume(const cloud *c, nebel_lighting_desc *lights)
{
    nebel_volume_desc v = {.shape = {.type = NEBEL_SHAPE_BOX},
                           .density = {.type = NEBEL_DENSITY_GRID, .grid = c->grid}};
    *lights = (nebel_lighting_desc){.sun = {{0}, {0}}};
    memcpy(lights->sun.direction, c->sun, sizeof c->sun);
    for (int i = 0; i < 3; i++) {
        v.shape.min[i] = c->low[i];
        v.shape.max[i] = c->high[i];
        v.extinction[i] = c->extinction;
        v.albedo[i] = 1;
        lights->sun.irradiance[i] = 4 * acos(-1); /* opaque fog that is lit from all around has a radiance of 1 */
    }
    return v;
}

static nebel_lighting *fog_of(const cloud *c)
{
    nebel_lighting_desc lights;
    const nebel_volume_desc v = fog_volume(c, &lights);
    return fog_light(&lights, &v, 1);
}

/* To a place inside the box; some of them are hardly off a face all along. */
static nebel_ray random_ray(uint64_t *state, const cloud *c)
{
    nebel_ray ray = {.t_max = 30};
    const int along = dice_below(state, 5) < 2 ? dice_below(state, 3) : -1;
    double square = 0;
    for (int i = 0; i < 3; i++) {
        ray.direction[i] = dice(state, -1, 1) * (i == along ? .02 : 1);
        square += ray.direction[i] * ray.direction[i];
    }
    for (int i = 0; i < 3; i++) {
        const double face = dice_below(state, 2) ? c->low[i] : c->high[i];
        ray.direction[i] /= sqrt(square);
        ray.origin[i] = (i == along ? face * dice(state, .6, 1) : dice(state, c->low[i], c->high[i]));
        ray.origin[i] -= 8 * ray.direction[i];
    }
    return ray;
}

/* A line in cells, up to where it leaves the box. */
static nb_grid_line in_cells(const cloud *c, const double origin[3], const double direction[3], double from,
                             double *length)
{
    nb_grid_line line;
    *length = 1e9;
    for (int i = 0; i < 3; i++) {
        line.slope[i] = direction[i] * c->rate[i];
        line.from[i] = (origin[i] - c->low[i]) * c->rate[i] + .5 + line.slope[i] * from;
        const double face = line.slope[i] > 0 ? c->size[i] + .5 : .5;
        if (line.slope[i] != 0) *length = fmin(*length, fmax((face - line.from[i]) / line.slope[i], 0));
    }
    return line;
}

static double depth_to_sun(const cloud *c, const double place[3])
{
    double length;
    const nb_grid_line line = in_cells(c, place, c->sun, 0, &length);
    return c->extinction * nb_grid_integral(c->grid, &line, length, 0, HUGE_VAL).value;
}

/* By the rule of rectangles, each as bright as in its middle. They are narrow near the faces of the box, where a low sun
 * reaches thin layers alone. */
static double brute_light(const cloud *c, const nebel_ray *ray, int parts)
{
    double enter = 0, length, depth = 0, light = 0, start = 0;
    for (int i = 0; i < 3; i++) {
        const double face = ray->direction[i] > 0 ? c->low[i] : c->high[i];
        if (ray->direction[i] != 0) enter = fmax(enter, (face - ray->origin[i]) / ray->direction[i]);
    }
    (void)in_cells(c, ray->origin, ray->direction, enter, &length);
    for (int n = 1; n <= parts && depth < 30; n++) {
        const double share = (double)n / parts, end = length * share * share * (3 - 2 * share);
        double place[3], left;
        for (int i = 0; i < 3; i++) place[i] = ray->origin[i] + ray->direction[i] * (enter + .5 * (start + end));
        const nb_grid_line line = in_cells(c, ray->origin, ray->direction, enter + start, &left);
        const double part = nb_grid_integral(c->grid, &line, end - start, 0, HUGE_VAL).value * c->extinction;
        if (part > 0) light += exp(-depth - depth_to_sun(c, place)) * -expm1(-part);
        depth += part;
        start = end;
    }
    return light;
}

static void check_rays(uint64_t seed, double tolerance)
{
    uint64_t state = seed;
    const cloud c = random_cloud(&state);
    nebel_lighting *fog = fog_of(&c);
    const nebel_trace_desc desc = {.precision = NEBEL_PRECISION_FLOAT, .tolerance = tolerance};
    for (int i = 0; i < RAYS; i++) {
        const nebel_ray ray = random_ray(&state, &c);
        nebel_transfer transfer;
        fog_trace(fog, desc, 1, &ray, &transfer);
        if (transfer.transmittance[0] == 1) continue;
        const double off = fabs(transfer.in_scattering[0] - brute_light(&c, &ray, PARTS));
        if (off <= transfer.error) continue;
        const double truth = brute_light(&c, &ray, 8 * PARTS), rough = brute_light(&c, &ray, 4 * PARTS);
        const double still = fabs(transfer.in_scattering[0] - truth), doubt = fabs(truth - rough) + 1e-6;
        if (!(still <= transfer.error + doubt))
            fail_msg("seed %d ray %d: off by %g, said %g", (int)seed, i, still, transfer.error);
    }
    nebel_release_lighting(fog);
    nebel_release_grid(c.grid);
}

static void errors_hold_where_voxels_are_cut_off(void **state)
{
    (void)state;
    for (int i = 0; i < grid_count; i++) check_rays((uint64_t)i, i % 3 == 0 ? 1e-2 : 2e-3);
}

/* Haze of some profile around voxels, or a second box of the same voxels that lies over them. */
static nebel_volume_desc random_company(uint64_t *state, const cloud *c)
{
    nebel_volume_desc v = {.shape = {.type = NEBEL_SHAPE_BOX}};
    const double extinction = exp(dice(state, log(.01), log(1)));
    for (int i = 0; i < 3; i++) {
        v.shape.min[i] = c->low[i] - dice(state, -1, 9);
        v.shape.max[i] = c->high[i] + dice(state, 0, 9);
        v.extinction[i] = extinction;
        v.albedo[i] = dice(state, .2, 1);
    }
    switch (dice_below(state, 6)) {
    case 0:
        break;
    case 1:
        v.density = (nebel_density){.type = NEBEL_DENSITY_GRID, .grid = c->grid};
        break;
    case 2:
        v.density = (nebel_density){.type = NEBEL_DENSITY_SOFT_EDGE, .edge_width = dice(state, .1, 2)};
        break;
    case 3:
        v.shape = (nebel_shape){.type = NEBEL_SHAPE_SPHERE, .radius = dice(state, 1, 6)};
        v.density = (nebel_density){.type = NEBEL_DENSITY_RADIAL, .power = 2};
        break;
    case 4:
        v.shape = (nebel_shape){.type = NEBEL_SHAPE_WORLD};
        v.density = (nebel_density){.type = NEBEL_DENSITY_HEIGHT, .scale_height = dice(state, .3, 4)};
        break;
    default:
        v.density = (nebel_density){.type = NEBEL_DENSITY_HEIGHT, .scale_height = dice(state, 1, 6)};
    }
    return v;
}

/* Into the box, at its faces, or beside it; a spot now and then. */
static nebel_light random_light(uint64_t *state, const cloud *c)
{
    nebel_light light = {.radius = dice(state, .01, .2)};
    const double wide = dice_below(state, 2) ? 1 : 3;
    for (int i = 0; i < 3; i++) {
        const double middle = .5 * (c->low[i] + c->high[i]);
        light.position[i] = middle + (dice(state, c->low[i], c->high[i]) - middle) * wide;
        light.intensity[i] = exp(dice(state, log(.3), log(30)));
        light.direction[i] = dice(state, -1, 1);
    }
    if (dice_below(state, 3) == 0) {
        light.type = NEBEL_LIGHT_SPOT;
        light.outer_angle = dice(state, 20, 80);
        light.inner_angle = light.outer_angle * dice(state, 0, 1);
    }
    return light;
}

/* What has been found: rays, the largest part of what is told that one was off by, and how many were off by more. */
typedef struct tally {
    int rays, bad;
    double worst;
} tally;

static void compare_channels(const nebel_transfer *found, const nebel_transfer *truth, uint64_t seed, int ray, tally *t)
{
    double worst = 0;
    for (int k = 0; k < 3; k++) {
        const double off = fabs(found->in_scattering[k] - truth->in_scattering[k]);
        worst = fmax(worst, off / (found->error + truth->error));
        if (!(off <= found->error + truth->error) && t->bad < 10)
            print_message("seed %d ray %d: off by %g, said %g\n", (int)seed, ray, off, found->error);
    }
    t->rays++;
    t->bad += !(worst <= 1);
    t->worst = fmax(t->worst, worst);
}

/* Columns and common steps are asked in float alone: double walks to the light from place to place. */
static void check_company(uint64_t seed, double tolerance, size_t light_count, tally *t)
{
    nebel_ray rays[RAYS];
    nebel_transfer found[RAYS], truth[RAYS];
    uint64_t state = seed + 1000003;
    const cloud c = random_cloud(&state);
    nebel_light all[3];
    nebel_lighting_desc lights;
    nebel_volume_desc v[2] = {fog_volume(&c, &lights), random_company(&state, &c)};
    for (size_t i = 0; i < light_count; i++) all[i] = random_light(&state, &c);
    if (light_count > 0) {
        lights = (nebel_lighting_desc){.light_count = light_count, .lights = all};
        for (int i = 0; i < 2; i++)
            if (dice_below(&state, 2))
                v[i].phase = (nebel_phase){.type = NEBEL_PHASE_HENYEY_GREENSTEIN, .g = dice(&state, -.5, .8)};
    }
    nebel_lighting *fog = fog_light(&lights, v, light_count > 0 && dice_below(&state, 2) ? 1 : 2);
    for (int i = 0; i < RAYS; i++) rays[i] = random_ray(&state, &c);
    fog_trace(fog, (nebel_trace_desc){.precision = NEBEL_PRECISION_FLOAT, .tolerance = tolerance}, RAYS, rays, found);
    fog_trace(fog, (nebel_trace_desc){.tolerance = tolerance * 1e-2}, RAYS, rays, truth);
    for (int i = 0; i < RAYS; i++) compare_channels(&found[i], &truth[i], seed, i, t);
    nebel_release_lighting(fog);
    nebel_release_grid(c.grid);
}

static void errors_hold_for_voxels_in_company(void **state)
{
    static const double tolerances[] = {1e-2, 1e-3, 1e-4};
    (void)state;
    for (size_t lights = 0; lights < 4; lights += 1 + lights) {
        tally t = {0, 0, 0};
        const size_t count =
            lights == 0 ? (size_t)grid_count : nb_test_count((size_t)grid_count); /* marches in double */
        for (size_t i = 0; i < count; i++) check_company(i, tolerances[i % 3], lights, &t);
        print_message("voxels in company, %d lights: %d rays, off by %.2f of what is told at most\n", (int)lights,
                      t.rays, t.worst);
        assert_int_equal(t.bad, 0);
    }
}

/* Steps of light end within cells, at edges of the box and at shadows; it stops where it cannot be seen. */
static void check_transmittance(uint64_t seed)
{
    enum { COUNT = 32 };
    static const float shadow[] = {6.5F, 7.25F};
    float origin[3][COUNT], direction[3][COUNT], alone[3][COUNT], with_light[3][COUNT], light[3][COUNT];
    uint32_t first[COUNT + 1];
    float boundaries[2 * COUNT];
    uint64_t state = seed;
    const cloud c = random_cloud(&state);
    nebel_lighting *fog = fog_of(&c);
    nebel_ray_planes rays = {.offset_stride = sizeof(float), .direction_stride = sizeof(float)};
    nebel_transfer_planes dark = {.transmittance_stride = sizeof(float)}, lit = dark;
    const nebel_ray_visibility pieces = {first, boundaries};
    const nebel_trace_desc desc = {
        .lighting = fog, .precision = NEBEL_PRECISION_FLOAT, .sun_visibility = seed % 2 ? NULL : &pieces};
    lit.in_scattering_stride = sizeof(float);
    for (int n = 0; n < COUNT; n++) {
        const nebel_ray ray = random_ray(&state, &c);
        first[n] = 2 * (uint32_t)n;
        memcpy(&boundaries[first[n]], shadow, sizeof shadow);
        for (int i = 0; i < 3; i++) {
            origin[i][n] = (float)ray.origin[i];
            direction[i][n] = (float)ray.direction[i];
        }
    }
    for (int i = 0; i < 3; i++) {
        rays.offset[i] = origin[i];
        rays.direction_float[i] = direction[i];
        dark.transmittance[i] = alone[i];
        lit.transmittance[i] = with_light[i];
        lit.in_scattering[i] = light[i];
    }
    first[COUNT] = 2 * COUNT;
    const nebel_snapshot *snapshot = nebel_get_lighting_snapshot(fog);
    assert_int_equal(nebel_trace_planes(snapshot, NULL, COUNT, &rays, &dark), NEBEL_OK);
    assert_int_equal(nebel_trace_planes(snapshot, &desc, COUNT, &rays, &lit), NEBEL_OK);
    assert_memory_equal(alone, with_light, sizeof alone);
    nebel_release_lighting(fog);
    nebel_release_grid(c.grid);
}

static void transmittance_has_the_bits_that_it_has_alone(void **state)
{
    (void)state;
    for (int i = 0; i < grid_count; i++) check_transmittance((uint64_t)i);
}

/* ---- the lattice ----------------------------------------------------------------------------- */

/* What the kernels make of its numbers in one column: see trace_sun_lattice.h. */
static double in_lattice(const nb_sun_lattice *l, const double at[3], double *deviation)
{
    int first[3];
    double share[3], sum = 0;
    for (int i = 0; i < 3; i++) {
        const double place = fmin(fmax(at[i], 0), l->count[i] - 1);
        first[i] = (int)fmin(floor(place), l->count[i] - 2);
        share[i] = place - first[i];
    }
    for (int n = 0; n < 8; n++) {
        const int u = first[0] + (n & 1), v = first[1] + (n >> 1 & 1), layer = first[2] + (n >> 2);
        const double weight = (n & 1 ? share[0] : 1 - share[0]) * (n >> 1 & 1 ? share[1] : 1 - share[1]) *
                              (n >> 2 ? share[2] : 1 - share[2]);
        sum += weight * l->amount[((size_t)layer * (size_t)l->count[1] + (size_t)v) * (size_t)l->count[0] + (size_t)u];
    }
    const int u = first[0] / NB_LATTICE_BLOCK, v = first[1] / NB_LATTICE_BLOCK, k = first[2] / NB_LATTICE_BLOCK;
    *deviation +=
        l->step * l->deviation[((size_t)k * (size_t)l->blocks[1] + (size_t)v) * (size_t)l->blocks[0] + (size_t)u];
    return l->step * sum;
}

static double by_lattice(const nb_sun_lattice *l, const double cell[3], const double leaves[3], double *deviation)
{
    double at[3] = {0, 0, cell[l->axis]};
    for (int s = 0; s < 2; s++) at[s] = (cell[l->side[s]] - l->lean[s] * cell[l->axis]) * l->per_cell - l->first[s];
    *deviation = 0;
    const double all = in_lattice(l, at, deviation);
    at[2] = leaves[l->axis];
    return l->ends_in_fog ? fmax(all - in_lattice(l, at, deviation), 0) : all;
}

/* Second differences are an estimate, which roughness between nodes may exceed. */
static void lattices_say_how_far_they_are_off(void **state)
{
    size_t over = 0, places = 0;
    (void)state;
    for (int i = 0; i < grid_count; i++) {
        uint64_t seed = (uint64_t)i;
        const cloud c = random_cloud(&seed);
        const nebel_allocator heap = nb_resolve_allocator(&(nebel_allocator){0});
        double way[3];
        for (int a = 0; a < 3; a++) way[a] = c.sun[a] * c.rate[a];
        nb_sun_lattice *l = nb_sun_lattice_make(c.grid, &heap, way, (nb_sun_lattice_limit){2, (size_t)1 << 25, 1});
        assert_non_null(l);
        for (int n = 0; n < PLACES; n++, places++) {
            double place[3], cell[3], leaves[3], length, deviation;
            for (int a = 0; a < 3; a++) place[a] = dice(&seed, c.low[a], c.high[a]);
            const nb_grid_line line = in_cells(&c, place, c.sun, 0, &length);
            for (int a = 0; a < 3; a++) {
                cell[a] = line.from[a];
                leaves[a] = line.from[a] + line.slope[a] * length;
            }
            const double truth = nb_grid_integral(c.grid, &line, length, 0, HUGE_VAL).value;
            const double off = fabs(by_lattice(l, cell, leaves, &deviation) - truth);
            over += off > deviation;
            assert_true(off <= 3 * deviation);
        }
        nb_sun_lattice_release(l);
        nebel_release_grid(c.grid);
    }
    assert_true(over * 500 <= places);
}

static double in_light_lattice(const nb_light_lattice *l, const double cell[3], double *deviation)
{
    size_t first[3];
    double share[3], mean = 0;
    for (int i = 0; i < 3; i++) {
        const double place = fmin(fmax((cell[i] - l->first) * l->per_cell[i], 0), l->count[i] - 1);
        first[i] = (size_t)fmin(floor(place), l->count[i] - 2);
        share[i] = place - (double)first[i];
    }
    for (size_t n = 0; n < 8; n++) {
        const size_t x = first[0] + (n & 1), y = first[1] + (n >> 1 & 1), z = first[2] + (n >> 2);
        const double weight = (n & 1 ? share[0] : 1 - share[0]) * (n >> 1 & 1 ? share[1] : 1 - share[1]) *
                              (n >> 2 ? share[2] : 1 - share[2]);
        mean += weight * (double)l->mean[(z * (size_t)l->count[1] + y) * (size_t)l->count[0] + x];
    }
    *deviation =
        (double)l->deviation[(first[2] * (size_t)(l->count[1] - 1) + first[1]) * (size_t)(l->count[0] - 1) + first[0]];
    return mean;
}

/* The same of those of point lights, in and beside the box. */
static void check_light_lattice(uint64_t seed, size_t *over, size_t *far, size_t *places)
{
    const cloud c = random_cloud(&seed);
    nebel_lighting_desc unused;
    const nebel_volume_desc v = fog_volume(&c, &unused);
    const nebel_light light = random_light(&seed, &c);
    const nebel_lighting_desc lights = {.lights = &light, .light_count = 1};
    nebel_lighting *fog = fog_light(&lights, &v, 1);
    const nb_light_lattice *l = nb_light_lattices_of(fog)->of_medium[0];
    for (int n = 0; n < PLACES; n++, ++*places) {
        double place[3], way[3], cell[3], inside, deviation, square = 0;
        for (int a = 0; a < 3; a++) {
            place[a] = dice(&seed, c.low[a], c.high[a]);
            way[a] = light.position[a] - place[a];
            square += way[a] * way[a];
        }
        const double reach = sqrt(square) - light.radius;
        if (!(reach > 0)) continue;
        for (int a = 0; a < 3; a++) way[a] /= sqrt(square);
        const nb_grid_line line = in_cells(&c, place, way, 0, &inside);
        for (int a = 0; a < 3; a++) cell[a] = line.from[a];
        const double truth = nb_grid_integral(c.grid, &line, fmin(inside, reach), 0, HUGE_VAL).value;
        const double off = fabs(in_light_lattice(l, cell, &deviation) * reach - truth);
        *over += off > deviation * reach + 1e-6;
        *far += !(off <= 4 * deviation * reach + 1e-6);
    }
    nebel_release_lighting(fog);
    nebel_release_grid(c.grid);
}

static void lattices_of_point_lights_say_how_far_they_are_off(void **state)
{
    size_t over = 0, far = 0, places = 0;
    (void)state;
    for (int i = 0; i < grid_count; i++) check_light_lattice((uint64_t)i, &over, &far, &places);
    print_message("lattices of point lights: %zu places, %zu off by more than is told, %zu by four times that\n",
                  places, over, far);
    assert_true(over * 500 <= places && far * 20000 <= places);
}

int main(int argc, char **argv)
{
    if (argc > 1) grid_count = atoi(argv[1]);
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(errors_hold_where_voxels_are_cut_off),
        cmocka_unit_test(errors_hold_for_voxels_in_company),
        cmocka_unit_test(transmittance_has_the_bits_that_it_has_alone),
        cmocka_unit_test(lattices_say_how_far_they_are_off),
        cmocka_unit_test(lattices_of_point_lights_say_how_far_they_are_off),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
