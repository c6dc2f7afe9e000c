/* Fog at places and bounds of it along rays, against what nebel_trace says of very short rays. */
#include "unit.h"

#include "fog_help.h"
#include "random_fog.h"

#include <math.h>

enum { SEEDS = 8, RAYS = 12, PLACES = 8, MOST_PIECES = 4000 };

static random_fog fog;

static nebel_snapshot *make_fog(random_fog_kind kind, uint64_t seed)
{
    random_fog_make(&fog, kind, seed);
    nebel_fog_desc desc = random_fog_desc(&fog);
    desc.max_opacity = 0;
    return fog_commit(&desc, fog.volumes, fog.count);
}

static void unit_direction(const nebel_ray *ray, double d[3])
{
    const double size = fmax(fabs(ray->direction[0]), fmax(fabs(ray->direction[1]), fabs(ray->direction[2])));
    double square = 0;
    for (int i = 0; i < 3; i++) {
        d[i] = ray->direction[i] / size;
        square += d[i] * d[i];
    }
    for (int i = 0; i < 3; i++) d[i] /= sqrt(square);
}

static nebel_sample_point place_on(const nebel_ray *ray, double t)
{
    double d[3];
    unit_direction(ray, d);
    nebel_sample_point place = {.distance = t};
    for (int i = 0; i < 3; i++) place.position[i] = ray->origin[i] + t * d[i];
    return place;
}

static nebel_medium_properties matter_at(const nebel_snapshot *snapshot, nebel_sample_point place)
{
    nebel_medium_properties matter;
    assert_int_equal(nebel_sample_medium(snapshot, 1, &place, sizeof place, &matter, sizeof matter), NEBEL_OK);
    return matter;
}

/* ---- what is at a place ---------------------------------------------------------------------- */

static double most_of(const double rgb[3])
{
    return fmax(rgb[0], fmax(rgb[1], rgb[2]));
}

static int is_near(double a, double b)
{
    return fabs(a - b) <= 2e-3 * fmax(fabs(a), fabs(b));
}

static int are_alike(const nebel_medium_properties *a, const nebel_medium_properties *b)
{
    int alike = 1;
    for (int c = 0; c < 3; c++)
        alike &= is_near(a->extinction[c], b->extinction[c]) && is_near(a->scattering[c], b->scattering[c]) &&
                 is_near(a->emission[c], b->emission[c]);
    return alike;
}

/* 1 where a short ray could tell: the fog is the same all along it. */
static int compare_with_ray(const nebel_lighting *lighting, nebel_sample_point place, const double d[3])
{
    const nebel_snapshot *snapshot = nebel_get_lighting_snapshot(lighting);
    place.distance = -1;
    const nebel_medium_properties here = matter_at(snapshot, place);
    const double densest = most_of(here.extinction), far = fabs(place.position[0]) + fabs(place.position[2]);
    if (!(densest < 1e9)) return 0;
    const double h = fmin(1e-4 / fmax(densest, 1e-30), 1e-4 + 1e-9 * far);
    if (h < 1e-10 * far) return 0;
    for (int k = 1; k <= 16; k++) {
        nebel_sample_point along = place;
        for (int i = 0; i < 3; i++) along.position[i] += h * k / 16 * d[i];
        const nebel_medium_properties there = matter_at(snapshot, along);
        if (!are_alike(&here, &there)) return 0;
    }
    const nebel_ray ray = {{place.position[0], place.position[1], place.position[2]}, {d[0], d[1], d[2]}, h};
    nebel_transfer transfer;
    const nebel_trace_desc exact = {.tolerance = 1e-9, .ignore_distances = 1};
    fog_trace(lighting, exact, 1, &ray, &transfer);
    for (int c = 0; c < 3; c++) {
        const double depth = h * here.extinction[c];
        const double shone = h * (here.emission[c] + here.scattering[c] * fog.ambient[c]) * (1 - depth / 2);
        assert_true(fabs(1 - transfer.transmittance[c] - depth) <= 5e-3 * depth + 1e-12);
        assert_true(fabs(transfer.in_scattering[c] - shone) <= 5e-3 * shone + 1e-11);
    }
    return densest > 0;
}

static void places_have_what_short_rays_meet(void **state)
{
    (void)state;
    uint64_t numbers = 1;
    for (int kind = 0; kind < RANDOM_FOG_KIND_COUNT; kind++) {
        int compared = 0;
        for (uint64_t seed = 0; seed < SEEDS; seed++) {
            nebel_snapshot *snapshot = make_fog((random_fog_kind)kind, seed);
            const nebel_lighting_desc lights = random_fog_lights(&fog);
            nebel_lighting *lighting = light_fog(snapshot, &lights);
            for (uint64_t i = 0; i < RAYS; i++) {
                const nebel_ray ray = random_fog_ray(&fog, i);
                double d[3];
                unit_direction(&ray, d);
                const double reach = ray.t_max < 100 ? ray.t_max : 100;
                for (int k = 0; k < PLACES; k++)
                    compared += compare_with_ray(lighting, place_on(&ray, dice(&numbers, 0, reach)), d);
            }
            nebel_release_snapshot(snapshot);
            nebel_release_lighting(lighting);
        }
        assert_true(compared > SEEDS * RAYS / 4);
    }
}

static void distances_count_from_the_start_of_a_ray(void **state)
{
    (void)state;
    const nebel_volume_desc volume = {.extinction = {1, 1, 1}, .start = 2, .cutoff = 5};
    nebel_snapshot *snapshot = fog_commit(&(nebel_fog_desc){.max_opacity = 0}, &volume, 1);
    const double distances[] = {-1, 0, 1.9, 2, 4.9, 5}, there[] = {1, 0, 0, 1, 1, 0};
    for (int i = 0; i < 6; i++)
        assert_true(matter_at(snapshot, (nebel_sample_point){.distance = distances[i]}).extinction[1] == there[i]);
    const nebel_ray ray = {.direction = {0, 0, 3}};
    const double ends[] = {2, 5, HUGE_VAL}, within[] = {0, 1, 0};
    nebel_majorant_segment bound = {.end = 0};
    for (int i = 0; i < 3; i++) {
        assert_int_equal(nebel_next_majorant(snapshot, &ray, 0, bound.end, &bound), NEBEL_OK);
        assert_true(bound.end == ends[i]);
        assert_true(fabs(bound.extinction[0] - within[i]) < 1e-8);
    }
    assert_int_equal(nebel_next_majorant(snapshot, &ray, 1, 0, &bound), NEBEL_OK);
    assert_true(isinf(bound.end) && bound.extinction[0] >= 1);
    nebel_release_snapshot(snapshot);
}

/* ---- bounds ---------------------------------------------------------------------------------- */

/* Farther places are rounded too much for rays that run level with a face to the last bits. */
static double trusted_reach(const nebel_ray *ray)
{
    return 1e3 * (1 + fabs(ray->origin[0]) + fabs(ray->origin[1]) + fabs(ray->origin[2]));
}

static void assert_bounds(const nebel_snapshot *snapshot, const nebel_ray *ray, double from,
                          const nebel_majorant_segment *bound, uint64_t *numbers)
{
    const double to = fmin(bound->end, fmin(10 * from + 100, trusted_reach(ray)));
    for (int k = 0; k < PLACES && from < to; k++) {
        const nebel_medium_properties matter = matter_at(snapshot, place_on(ray, dice(numbers, from, to)));
        for (int c = 0; c < 3; c++) {
            assert_true(matter.extinction[c] <= bound->extinction[c]);
            assert_true(matter.emission[c] <= bound->emission[c]);
        }
    }
}

static void pieces_bound_the_fog_and_come_to_an_end(void **state)
{
    (void)state;
    uint64_t numbers = 2;
    for (int kind = 0; kind < RANDOM_FOG_KIND_COUNT; kind++) {
        for (uint64_t seed = 0; seed < SEEDS; seed++) {
            nebel_snapshot *snapshot = make_fog((random_fog_kind)kind, seed);
            for (uint64_t i = 0; i < RAYS; i++) {
                const nebel_ray ray = random_fog_ray(&fog, i);
                nebel_majorant_segment bound = {.end = 0};
                for (int pieces = 0; bound.end < 1e14; pieces++) {
                    assert_true(pieces < MOST_PIECES);
                    const double from = bound.end;
                    assert_int_equal(nebel_next_majorant(snapshot, &ray, 0, from, &bound), NEBEL_OK);
                    assert_true(bound.end > from);
                    assert_bounds(snapshot, &ray, from, &bound, &numbers);
                }
            }
            nebel_release_snapshot(snapshot);
        }
    }
}

/* A path that goes on for ever must end somewhere, or know that nothing comes. */
static void the_last_piece_knows_what_covers_it(void **state)
{
    (void)state;
    const nebel_shape halves[] = {{.type = NEBEL_SHAPE_HALF_SPACE, .point = {0, -2, 0}, .normal = {0, 1, 0}},
                                  {.type = NEBEL_SHAPE_HALF_SPACE, .point = {0, 2, 0}, .normal = {.1, -1, 0}}};
    const nebel_volume_desc volumes[] = {
        {.extinction = {1, 1, 1}},
        {.shape = {.type = NEBEL_SHAPE_UNION, .parts = halves, .part_count = 2}, .operation = NEBEL_OPERATION_EXCLUDE},
        {.shape = halves[0], .extinction = {.25, .25, .25}, .priority = 1}};
    nebel_snapshot *snapshot = fog_commit(&(nebel_fog_desc){.max_opacity = 0}, volumes, 3);
    const double slopes[] = {-1, 1}, last[] = {.25, 0};
    for (int i = 0; i < 2; i++) {
        const nebel_ray ray = {.direction = {.3, slopes[i], .1}};
        nebel_majorant_segment bound = {.end = 0};
        for (int pieces = 0; bound.end < HUGE_VAL; pieces++) {
            assert_true(pieces < 10);
            assert_int_equal(nebel_next_majorant(snapshot, &ray, 0, bound.end, &bound), NEBEL_OK);
            if (pieces == 0) assert_true(fabs(bound.extinction[0] - 1) < 1e-8);
        }
        assert_true(fabs(bound.extinction[0] - last[i]) < 1e-8);
    }
    nebel_release_snapshot(snapshot);
}

/* Bounds are worth something: in a box alone they are its fog, and in height fog less than twice what is there. */
static void bounds_are_near(void **state)
{
    (void)state;
    const nebel_volume_desc volumes[] = {
        {.shape = {.type = NEBEL_SHAPE_BOX, .min = {-1, -1, 2}, .max = {1, 1, 3}}, .extinction = {.3, .3, .3}},
        {.density = {.type = NEBEL_DENSITY_HEIGHT, .scale_height = 5}, .extinction = {.01, .01, .01}}};
    nebel_snapshot *box = fog_commit(&(nebel_fog_desc){.max_opacity = 0}, volumes, 1);
    const nebel_ray along = {.direction = {0, 0, 1}};
    double depth = 0, most = 0;
    for (nebel_majorant_segment bound = {.end = 0}; bound.end < HUGE_VAL;) {
        const double from = bound.end;
        assert_int_equal(nebel_next_majorant(box, &along, 0, from, &bound), NEBEL_OK);
        if (bound.extinction[0] > 0) depth += (bound.end - from) * bound.extinction[0];
        most = fmax(most, bound.extinction[0]);
    }
    assert_true(fabs(depth - .3) < 1e-8 && fabs(most - .3) < 1e-8);
    nebel_release_snapshot(box);
    nebel_snapshot *mist = fog_commit(&(nebel_fog_desc){.max_opacity = 0}, volumes + 1, 1);
    const nebel_ray up = {.direction = {0, 1, 1}}, down = {.origin = {0, 40, 0}, .direction = {0, -1, .5}};
    const nebel_ray *rays[] = {&up, &down};
    for (int i = 0; i < 2; i++) {
        depth = 0;
        for (nebel_majorant_segment bound = {.end = 0}; bound.end < 1e14 && depth < 50;) {
            const double from = bound.end;
            assert_int_equal(nebel_next_majorant(mist, rays[i], 0, from, &bound), NEBEL_OK);
            const nebel_ray piece = {.direction = {rays[i]->direction[0], rays[i]->direction[1], rays[i]->direction[2]},
                                     .origin = {0, place_on(rays[i], from).position[1], 0},
                                     .t_max = bound.end - from};
            nebel_transfer transfer;
            assert_int_equal(nebel_trace(mist, NULL, 1, &piece, sizeof piece, &transfer, sizeof transfer), NEBEL_OK);
            const double real = -log(transfer.transmittance[0]), bounded = bound.extinction[0] * (bound.end - from);
            if (isfinite(bounded) && isfinite(real)) assert_true(bounded <= 2 * real + 0.51);
            depth += isfinite(bounded) ? bounded : 0;
        }
        assert_true(depth > 0.05);
    }
    nebel_release_snapshot(mist);
}

/* ---- what scatters --------------------------------------------------------------------------- */

static void scatterers_are_chosen_by_what_they_scatter(void **state)
{
    (void)state;
    const nebel_volume_desc volumes[] = {
        {.extinction = {1, 2, 3}, .albedo = {.5, .5, .5}, .phase = {.type = NEBEL_PHASE_RAYLEIGH}},
        {.extinction = {2, 2, 2},
         .albedo = {.9, .6, .3},
         .phase = {.type = NEBEL_PHASE_HENYEY_GREENSTEIN, .g = .5},
         .density = {.type = NEBEL_DENSITY_HEIGHT, .scale_height = 1}},
        {.extinction = {7, 7, 7}, .source = {1, 1, 1}},
        {.extinction = {4, 4, 4}, .albedo = {1, 1, 1}, .shape = {.type = NEBEL_SHAPE_SPHERE, .radius = .5}}};
    nebel_snapshot *snapshot = fog_commit(&(nebel_fog_desc){.max_opacity = 0}, volumes, 4);
    const nebel_sample_point place = {{0, 1, 0}, -1};
    const nebel_medium_properties matter = matter_at(snapshot, place);
    enum { CHANCES = 20000 };
    double sums[3] = {0}, often[2] = {0};
    for (int i = 0; i < CHANCES; i++) {
        nebel_scatterer one;
        assert_int_equal(nebel_sample_scatterer(snapshot, &place, -1, (i + .5) / CHANCES, &one), NEBEL_OK);
        const int is_second = one.phase.type == NEBEL_PHASE_HENYEY_GREENSTEIN;
        assert_true(is_second ? one.phase.g == .5 : one.phase.type == NEBEL_PHASE_RAYLEIGH);
        assert_true(fabs(one.scattering[1] - (is_second ? 1.2 * exp(-1) : 1)) < 1e-12);
        often[is_second] += 1.0 / CHANCES;
        for (int c = 0; c < 3; c++) sums[c] += one.scattering[c] / one.probability / CHANCES;
    }
    nebel_scatterer blue;
    assert_int_equal(nebel_sample_scatterer(snapshot, &place, 2, 0, &blue), NEBEL_OK);
    assert_true(is_near(blue.scattering[2] / blue.probability, matter.scattering[2]));
    const double second = 3.6 * exp(-1);
    assert_true(fabs(often[1] - second / (second + 3)) < 1e-3);
    for (int c = 0; c < 3; c++) assert_true(is_near(sums[c], matter.scattering[c]));
    assert_true(fabs(matter.emission[0] - 7) < 1e-12);
    nebel_release_snapshot(snapshot);
}

static void where_nothing_scatters_nothing_is_chosen(void **state)
{
    (void)state;
    const nebel_volume_desc volume = {.extinction = {1, 1, 1}, .source = {1, 1, 1}};
    nebel_snapshot *snapshot = fog_commit(&(nebel_fog_desc){.max_opacity = 0}, &volume, 1);
    nebel_scatterer none;
    assert_int_equal(nebel_sample_scatterer(snapshot, &(nebel_sample_point){{0, 0, 0}, 0}, -1, 0.5, &none), NEBEL_OK);
    assert_true(none.probability == 0);
    nebel_release_snapshot(snapshot);
}

static void grey_is_what_dims_all_channels_alike(void **state)
{
    (void)state;
    const nebel_volume_desc volumes[] = {{.extinction = {1, 1, 1}, .albedo = {.1, .2, .3}}, {.extinction = {1, 1, 2}}};
    for (size_t n = 0; n <= 2; n++) {
        nebel_snapshot *snapshot = fog_commit(&(nebel_fog_desc){.max_opacity = 0}, volumes, n);
        assert_int_equal(nebel_is_extinction_gray(snapshot), n < 2);
        nebel_release_snapshot(snapshot);
    }
}

/* ---- bad calls ------------------------------------------------------------------------------- */

static void bad_calls_are_refused(void **state)
{
    (void)state;
    fog_messages messages = {0};
    nebel_snapshot *snapshot = fog_commit(&(nebel_fog_desc){.host.log = fog_messages_log(&messages)}, NULL, 0);
    const nebel_sample_point good = {{0, 0, 0}, 0},
                             bad[] = {{{(double)NAN, 0, 0}, 0}, {{0, 1e16, 0}, 0}, {{0, 0, 0}, (double)NAN}};
    const nebel_ray ray = {.direction = {0, 0, 1}}, still = {.direction = {0, 0, 0}},
                    away = {{0, 0, 1.1 * NEBEL_MAX_LENGTH}, {0, 0, 1}, 0};
    nebel_medium_properties matter;
    nebel_scatterer one;
    nebel_majorant_segment bound;
    size_t refused = 0;
    for (int i = 0; i < 3; i++) {
        refused +=
            nebel_sample_medium(snapshot, 1, &bad[i], sizeof *bad, &matter, sizeof matter) == NEBEL_ERROR_ARGUMENT;
        refused += nebel_sample_scatterer(snapshot, &bad[i], -1, 0, &one) == NEBEL_ERROR_ARGUMENT;
    }
    refused += nebel_sample_medium(snapshot, 1, NULL, 0, &matter, 0) == NEBEL_ERROR_ARGUMENT;
    refused += nebel_sample_medium(snapshot, 1, &good, 0, NULL, 0) == NEBEL_ERROR_ARGUMENT;
    refused += nebel_sample_scatterer(snapshot, &good, -1, 1, &one) == NEBEL_ERROR_ARGUMENT;
    refused += nebel_sample_scatterer(snapshot, &good, -1, (double)NAN, &one) == NEBEL_ERROR_ARGUMENT;
    refused += nebel_sample_scatterer(snapshot, &good, -1, 0, NULL) == NEBEL_ERROR_ARGUMENT;
    refused += nebel_sample_scatterer(snapshot, &good, 3, 0, &one) == NEBEL_ERROR_ARGUMENT;
    refused += nebel_sample_scatterer(snapshot, &good, -2, 0, &one) == NEBEL_ERROR_ARGUMENT;
    refused += nebel_next_majorant(snapshot, &ray, 0, -1, &bound) == NEBEL_ERROR_ARGUMENT;
    refused += nebel_next_majorant(snapshot, &ray, 0, HUGE_VAL, &bound) == NEBEL_ERROR_ARGUMENT;
    refused += nebel_next_majorant(snapshot, &still, 0, 0, &bound) == NEBEL_ERROR_ARGUMENT;
    refused += nebel_next_majorant(snapshot, &away, 0, 0, &bound) == NEBEL_ERROR_ARGUMENT;
    refused += nebel_next_majorant(snapshot, &ray, 0, 0, NULL) == NEBEL_ERROR_ARGUMENT;
    assert_int_equal(refused, 18);
    assert_int_equal(messages.count, refused);
    assert_int_equal(nebel_sample_medium(NULL, 0, NULL, 0, NULL, 0), NEBEL_ERROR_ARGUMENT);
    assert_int_equal(nebel_sample_medium(snapshot, 0, NULL, 0, NULL, 0), NEBEL_OK);
    assert_int_equal(nebel_next_majorant(snapshot, &ray, 0, 0, &bound), NEBEL_OK);
    assert_true(isinf(bound.end) && bound.extinction[0] == 0);
    nebel_release_snapshot(snapshot);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(places_have_what_short_rays_meet),
        cmocka_unit_test(distances_count_from_the_start_of_a_ray),
        cmocka_unit_test(pieces_bound_the_fog_and_come_to_an_end),
        cmocka_unit_test(the_last_piece_knows_what_covers_it),
        cmocka_unit_test(bounds_are_near),
        cmocka_unit_test(scatterers_are_chosen_by_what_they_scatter),
        cmocka_unit_test(where_nothing_scatters_nothing_is_chosen),
        cmocka_unit_test(grey_is_what_dims_all_channels_alike),
        cmocka_unit_test(bad_calls_are_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
