/* Tables of air from one place: how far they are from nebel_trace_atmosphere, and whether they say so. */
#include <nebel/planet.h>

#include "atmosphere/sky_view.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "scarce_memory.h"
#include "unit.h"

enum { RAYS = 1000 };

typedef struct bundle {
    double direction[3][RAYS];
    float t_max[RAYS];
    float transmittance[3][RAYS], in_scattering[3][RAYS], error[RAYS];
    nebel_transfer exact[RAYS];
} bundle;

/* 0 to 1; the same in every run. */
static double draw(uint32_t *state)
{
    *state = *state * 1664525u + 1013904223u;
    return (*state >> 8) / 16777216.0;
}

static nebel_atmosphere *make(const char *name)
{
    nebel_atmosphere *atmosphere = NULL;
    assert_int_equal(nebel_create_atmosphere(nebel_lookup_atmosphere(name), &atmosphere), NEBEL_OK);
    return atmosphere;
}

/* A part of the way through the air, of a ray that meets it, and somewhat beyond. */
static double end_within(const nebel_atmosphere_desc *desc, double height, double up, double part)
{
    const double r = desc->radius + height, top = desc->radius + desc->thickness, b = -r * up;
    const double in_air = b * b - (r * r - top * top), in_ground = b * b - (r * r - desc->radius * desc->radius);
    if (!(in_air > 0)) return 1;
    const double end = in_ground > 0 && b > 0 ? b - sqrt(in_ground) : b + sqrt(in_air);
    const double start = height > desc->thickness ? b - sqrt(in_air) : 0;
    return start + (end - start) * 1.1 * part;
}

/* From a height over the ground, half of the rays near the horizon or, from space, at the rim of the planet; half of them end
 * somewhere within the air, others anywhere. */
static void aim(bundle *rays, const nebel_atmosphere_desc *desc, double height, uint32_t *state)
{
    const double r = desc->radius + height, horizon = -sqrt(1 - pow(desc->radius / r, 2));
    for (int i = 0; i < RAYS; i++) {
        const double turn = 2 * acos(-1) * draw(state), side = draw(state) < 0.5 ? -1 : 1;
        double up = i % 2 ? 2 * draw(state) - 1 : horizon + 0.3 * side * pow(draw(state), 3);
        if (height > desc->thickness) {
            const double aside =
                i % 2 ? desc->radius + desc->thickness * draw(state) : desc->radius * sqrt(draw(state));
            up = -sqrt(1 - pow(aside / r, 2));
        }
        up = fmax(-1, fmin(1, up));
        const double level = sqrt(1 - up * up);
        rays->direction[0][i] = 3 * level * cos(turn);
        rays->direction[1][i] = 3 * up;
        rays->direction[2][i] = 3 * level * sin(turn);
        const double part = draw(state);
        rays->t_max[i] =
            (float)(i % 4 < 2 ? desc->thickness * pow(10, 6 * part - 5) : end_within(desc, height, up, part));
    }
}

static void trace_both(bundle *rays, const nebel_sky_view_desc *desc, const nebel_sky_view *view)
{
    const double *const direction[3] = {rays->direction[0], rays->direction[1], rays->direction[2]};
    const nebel_transfer_planes transfers = {
        .transmittance = {rays->transmittance[0], rays->transmittance[1], rays->transmittance[2]},
        .in_scattering = {rays->in_scattering[0], rays->in_scattering[1], rays->in_scattering[2]},
        .error = rays->error};
    assert_int_equal(nebel_trace_sky_view(view, RAYS, direction, desc->has_ray_ends ? rays->t_max : NULL, &transfers),
                     NEBEL_OK);
    for (int i = 0; i < RAYS; i++) {
        nebel_ray ray = {.t_max = desc->has_ray_ends ? (double)rays->t_max[i] : HUGE_VAL};
        memcpy(ray.origin, desc->position, sizeof ray.origin);
        for (int c = 0; c < 3; c++) ray.direction[c] = rays->direction[c][i];
        assert_int_equal(nebel_trace_atmosphere(desc->atmosphere, &desc->sun, 1, &ray, 0, &rays->exact[i], 0),
                         NEBEL_OK);
    }
}

/* What is off, as a part of the brightest ray. */
typedef struct tally {
    double off[6 * RAYS];
    double worst_clear; /* of transmittance */
    int count, untold;
} tally;

static int ascending(const void *a, const void *b)
{
    const double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

static void count(const bundle *rays, tally *all)
{
    double brightest = 0;
    for (int i = 0; i < RAYS; i++)
        for (int c = 0; c < 3; c++) brightest = fmax(brightest, rays->exact[i].in_scattering[c]);
    for (int i = 0; i < RAYS; i++) {
        double off = 0, clear = 0;
        for (int c = 0; c < 3; c++) {
            off = fmax(off, fabs((double)rays->in_scattering[c][i] - rays->exact[i].in_scattering[c]));
            clear = fmax(clear, fabs((double)rays->transmittance[c][i] - rays->exact[i].transmittance[c]));
        }
        all->untold += fmax(off, clear) > (double)rays->error[i];
        all->worst_clear = fmax(all->worst_clear, clear);
        all->off[all->count++] = off / brightest;
    }
}

/* Ends that a table was measured by: of 100 rays the worst but one, and the worst of all, as parts of the brightest. */
static void check(const char *what, tally *all, double most_of_99, double most)
{
    qsort(all->off, (size_t)all->count, sizeof *all->off, ascending);
    const double of_99 = all->off[all->count * 99 / 100], worst = all->off[all->count - 1];
    print_message("%s: %.1e of 99 in 100, %.1e of all; transmittance %.1e; told too little %d of %d\n", what, of_99,
                  worst, all->worst_clear, all->untold, all->count);
    assert_true(of_99 <= most_of_99 && worst <= most && all->untold * 200 <= all->count);
}

static void tables_are_as_far_off_as_they_say(void **state)
{
    (void)state;
    static const struct {
        const char *where;
        double height; /* in thicknesses of the air */
        double most_of_99, most;
    } places[] = {{"2 m", 2e-5, 2e-3, 5e-3},  {"10 km", 0.1, 4e-3, 2e-2},     {"90 km", 0.9, 4e-3, 3e-2},
                  {"orbit", 4, 1.5e-3, 1e-2}, {"20,000 km", 200, 6e-3, 4e-2}, {"1e9 m", 1e4, 8e-3, 4e-2}};
    static const char *const names[] = {"earth", "mars", "toy"};
    static const double elevations[] = {60, 10, 0.5};
    uint32_t seed = 1;
    for (int n = 0; n < 3; n++) {
        nebel_atmosphere *air = make(names[n]);
        const nebel_atmosphere_desc *known = nebel_lookup_atmosphere(names[n]);
        for (int p = 0; p < (n == 0 ? 6 : 4); p++) {
            tally all = {.count = 0};
            for (int s = 0; s < 3; s++) {
                if (!nb_test_tries((size_t)(n + p + s) % 3, 3)) continue;
                const double angle = elevations[s] * acos(-1) / 180, height = places[p].height * known->thickness;
                const nebel_sky_view_desc desc = {.atmosphere = air,
                                                  .sun = {{cos(angle), sin(angle), 0.1}, {2, 1.9, 1.7}},
                                                  .position = {0, height, 0}};
                nebel_sky_view *view;
                bundle rays;
                assert_int_equal(nebel_create_sky_view(&desc, &view), NEBEL_OK);
                aim(&rays, known, height, &seed);
                trace_both(&rays, &desc, view);
                count(&rays, &all);
                nebel_destroy_sky_view(view);
            }
            char what[40];
            (void)snprintf(what, sizeof what, "%s from %s", names[n], places[p].where);
            check(what, &all, places[p].most_of_99, places[p].most);
        }
        nebel_destroy_atmosphere(air);
    }
}

/* The planet's shadow stands in sight in air that is deep for its radius. */
static void deep_air_has_no_stairs(void **state)
{
    (void)state;
    static const struct {
        const char *what;
        double height, sun, most_of_99, most;
    } eyes[] = {{"night in deep air", 2, -.3, 4e-3, 4e-2}, {"morning in deep air", 500, .3, 8e-3, 8e-2}};
    const nebel_atmosphere_desc deep = {
        .radius = 1e3,
        .thickness = 1e3,
        .components = {{.scattering = {1e-4, 2e-4, 4e-4}, .phase.type = NEBEL_PHASE_RAYLEIGH, .scale_height = 300}},
        .component_count = 1};
    nebel_atmosphere *air;
    uint32_t seed = 5;
    assert_int_equal(nebel_create_atmosphere(&deep, &air), NEBEL_OK);
    for (size_t i = 0; i < sizeof eyes / sizeof *eyes; i++) {
        const nebel_sky_view_desc desc = {
            .atmosphere = air, .sun = {{1, eyes[i].sun, .2}, {1, 1, 1}}, .position = {0, eyes[i].height, 0}};
        nebel_sky_view *view;
        tally all = {.count = 0};
        assert_int_equal(nebel_create_sky_view(&desc, &view), NEBEL_OK);
        for (int part = 0; part < 6; part++) {
            bundle rays;
            aim(&rays, &deep, eyes[i].height, &seed);
            trace_both(&rays, &desc, view);
            count(&rays, &all);
        }
        nebel_destroy_sky_view(view);
        check(eyes[i].what, &all, eyes[i].most_of_99, eyes[i].most);
    }
    nebel_destroy_atmosphere(air);
}

static void look_along_ends(const nebel_atmosphere_desc *desc, const double heights[], int height_count, tally *all)
{
    nebel_atmosphere *air;
    uint32_t seed = 2;
    assert_int_equal(nebel_create_atmosphere(desc, &air), NEBEL_OK);
    for (int h = 0; h < height_count; h++)
        for (int s = 0; s < 3; s++) {
            if (!nb_test_tries((size_t)(h + s) % 3, 3)) continue;
            const nebel_sky_view_desc from = {.atmosphere = air,
                                              .sun = {{0.3, 0.02 + 0.2 * s, 1}, {1, 1, 1}},
                                              .position = {0, heights[h], 0},
                                              .has_ray_ends = 1};
            nebel_sky_view *view;
            bundle rays;
            assert_int_equal(nebel_create_sky_view(&from, &view), NEBEL_OK);
            aim(&rays, desc, heights[h], &seed);
            trace_both(&rays, &from, view);
            count(&rays, all);
            nebel_destroy_sky_view(view);
        }
    nebel_destroy_atmosphere(air);
}

static void rays_may_end_within_the_air(void **state)
{
    (void)state;
    static const double low[] = {2, 1e4}, high[] = {3e4, 9e4}, above[] = {4e5, 2e7};
    const nebel_atmosphere_desc *earth = nebel_lookup_atmosphere("earth");
    tally from_low = {.count = 0}, from_high = {.count = 0}, from_above = {.count = 0};
    look_along_ends(earth, low, 2, &from_low);
    look_along_ends(earth, high, 2, &from_high);
    look_along_ends(earth, above, 2, &from_above);
    check("ends within the air, from 2 m and 10 km", &from_low, 1.5e-2, 5e-2);
    check("ends within the air, from 30 and 90 km", &from_high, 6e-3, 4e-2);
    check("ends within the air, from 400 and 20,000 km", &from_above, 4e-3, 4e-2);
    assert_true(from_high.worst_clear <= 4e-2 && from_above.worst_clear <= 4e-2);
}

/* Rows and levels are wider than this air: it is off, and says so. */
static void thin_air_from_space_is_told(void **state)
{
    (void)state;
    static const double height[] = {1e6};
    const nebel_atmosphere_desc layer = {.radius = 6.36e6,
                                         .thickness = 1e5,
                                         .components = {{.scattering = {2e-5, 4e-5, 8e-5},
                                                         .phase.type = NEBEL_PHASE_RAYLEIGH,
                                                         .profile = NEBEL_COMPONENT_TENT,
                                                         .center_height = 2.5e4,
                                                         .half_width = 3e3}},
                                         .component_count = 1},
                                thin = {.radius = 6.36e6,
                                        .thickness = 100,
                                        .components = {{.scattering = {1e-3, 2e-3, 4e-3}, .scale_height = 10}},
                                        .component_count = 1};
    tally of_layer = {.count = 0}, of_thin = {.count = 0};
    look_along_ends(&layer, height, 1, &of_layer);
    look_along_ends(&thin, height, 1, &of_thin);
    check("a layer of 6 km", &of_layer, 1, 1);
    check("100 m of air", &of_thin, 1, 1);
    assert_true(of_thin.worst_clear <= .1);
}

/* Under air that is thinner than float's digits of the way to it, rays that end at the ground pass all of it. */
static void thin_air_is_passed_up_to_the_ground(void **state)
{
    (void)state;
    enum { COUNT = 100 };
    const nebel_atmosphere_desc desc = {
        .thickness = 6.4, .components = {{.scattering = {.2, .3, .5}, .scale_height = .8}}, .component_count = 1};
    const nebel_sky_view_desc from = {
        .position = {0, 2e7, 0}, .sun = {.direction = {0, 1, 0}, .irradiance = {1, 1, 1}}, .has_ray_ends = 1};
    nebel_sky_view_desc whole = from;
    nebel_atmosphere *atmosphere;
    nebel_sky_view *view;
    double direction[3][COUNT];
    float distance[COUNT], left[2][3][COUNT], light[2][3][COUNT];
    const double *const along[3] = {direction[0], direction[1], direction[2]};
    assert_int_equal(nebel_create_atmosphere(&desc, &atmosphere), NEBEL_OK);
    whole.atmosphere = atmosphere;
    assert_int_equal(nebel_create_sky_view(&whole, &view), NEBEL_OK);
    for (int i = 0; i < COUNT; i++) {
        direction[0][i] = .0023 * i;
        direction[1][i] = -1;
        direction[2][i] = .0001 * i;
    }
    assert_int_equal(nebel_trace_ground(view, COUNT, along, &(nebel_ground_planes){.distance = distance}), NEBEL_OK);
    for (int k = 0; k < 2; k++) {
        const nebel_transfer_planes transfers = {.transmittance = {left[k][0], left[k][1], left[k][2]},
                                                 .in_scattering = {light[k][0], light[k][1], light[k][2]}};
        assert_int_equal(nebel_trace_sky_view(view, COUNT, along, k == 0 ? distance : NULL, &transfers), NEBEL_OK);
    }
    assert_true(left[1][2][0] < .9f && left[1][2][0] > .1f);
    assert_memory_equal(left[0], left[1], sizeof left[0]);
    assert_memory_equal(light[0], light[1], sizeof light[0]);
    nebel_destroy_sky_view(view);
    nebel_destroy_atmosphere(atmosphere);
}

/* The ground is a ball, lit by what nebel_compute_atmosphere_irradiance says. */
static void ground_is_lit_as_places_are(void **state)
{
    (void)state;
    const double radius = 6.36e6;
    nebel_atmosphere *air = make("earth");
    for (int h = 0; h < 3; h++) {
        const nebel_sky_view_desc desc = {.atmosphere = air,
                                          .sun = {{0.9, h == 2 ? 0.05 : 0.4, 0.2}, {3, 2, 1}},
                                          .position = {0,
                                                       h == 0   ? 2
                                                       : h == 1 ? 1e4
                                                                : 4e7,
                                                       0}};
        nebel_sky_view *view;
        bundle rays;
        float distance[RAYS], normal[3][RAYS], sun[3][RAYS], sky[3][RAYS];
        const nebel_ground_planes planes = {.distance = distance,
                                            .normal = {normal[0], normal[1], normal[2]},
                                            .sun = {sun[0], sun[1], sun[2]},
                                            .sky = {sky[0], sky[1], sky[2]}};
        uint32_t seed = 3;
        int met = 0;
        assert_int_equal(nebel_create_sky_view(&desc, &view), NEBEL_OK);
        aim(&rays, nebel_lookup_atmosphere("earth"), desc.position[1], &seed);
        const double *const direction[3] = {rays.direction[0], rays.direction[1], rays.direction[2]};
        assert_int_equal(nebel_trace_ground(view, RAYS, direction, &planes), NEBEL_OK);
        for (int i = 0; i < RAYS; i++) {
            const double length = sqrt(pow(direction[0][i], 2) + pow(direction[1][i], 2) + pow(direction[2][i], 2));
            double place[3], square = 0, closest = 0;
            for (int c = 0; c < 3; c++)
                closest -= direction[c][i] / length * (desc.position[c] + (c == 1 ? radius : 0));
            if (!((double)distance[i] < HUGE_VAL)) {
                const double r = desc.position[1] + radius;
                assert_true(closest <= 0 || r * r - closest * closest >= radius * radius * (1 - 1e-9));
                continue;
            }
            met++;
            for (int c = 0; c < 3; c++) {
                place[c] = desc.position[c] + (double)distance[i] * direction[c][i] / length;
                const double from = place[c] + (c == 1 ? radius : 0);
                square += from * from;
                assert_true(fabs((double)normal[c][i] - from / radius) <= 1e-6);
            }
            assert_true(fabs(sqrt(square) - radius) <= 1e-6 * (double)distance[i]);
            nebel_irradiance light;
            assert_int_equal(
                nebel_compute_atmosphere_irradiance(air, &desc.sun, 1, (const double(*)[3])place, 0, &light, 0),
                NEBEL_OK);
            for (int c = 0; c < 3; c++) {
                assert_true(fabs((double)sun[c][i] - light.sun[c]) <= 2e-3);
                assert_true(fabs((double)sky[c][i] - light.sky[c]) <= 1e-3 * light.sky[c] + 1e-6);
            }
        }
        assert_true(met > RAYS / 4 && met < RAYS);
        nebel_destroy_sky_view(view);
    }
    nebel_destroy_atmosphere(air);
}

/* Parts in another order. */
static void run_backwards(size_t parts, void (*part)(void *data, size_t i), void *data, void *user)
{
    (*(int *)user)++;
    while (parts > 0) part(data, --parts);
}

static void order_of_work_changes_nothing(void **state)
{
    (void)state;
    nebel_atmosphere *air = make("toy");
    int runs = 0;
    nebel_sky_view_desc desc = {
        .atmosphere = air, .sun = {{1, 1, 0}, {1, 1, 1}}, .position = {0, 3, 0}, .has_ray_ends = 1};
    nebel_sky_view *one, *other;
    static bundle a, b;
    uint32_t seed = 4;
    assert_int_equal(nebel_create_sky_view(&desc, &one), NEBEL_OK);
    desc.host.parallel.run = run_backwards;
    desc.host.parallel.user = &runs;
    assert_int_equal(nebel_create_sky_view(&desc, &other), NEBEL_OK);
    assert_true(runs > 0);
    aim(&a, nebel_lookup_atmosphere("toy"), 3, &seed);
    b = a;
    trace_both(&a, &desc, one);
    trace_both(&b, &desc, other);
    assert_memory_equal(a.transmittance, b.transmittance, sizeof a.transmittance);
    assert_memory_equal(a.in_scattering, b.in_scattering, sizeof a.in_scattering);
    assert_memory_equal(a.error, b.error, sizeof a.error);
    nebel_destroy_sky_view(one);
    nebel_destroy_sky_view(other);
    nebel_destroy_atmosphere(air);
}

/* On the ground, below it, in the centre, on the edge of the air and far away; the sun anywhere. */
static void odd_places_have_answers(void **state)
{
    (void)state;
    static const double heights[] = {0, -1, -1000, -1500, 125, 1e9, 1e15};
    static const double suns[][3] = {{0, 1, 0}, {0, -1, 0}, {1, 0, 0}};
    static const double ways[][3] = {{0, 1, 0}, {0, -1, 0}, {1, 0, 0}, {1, -1e-9, 0}, {0, 0, 0}, {(double)NAN, 0, 0}};
    nebel_atmosphere *air = make("toy");
    for (int h = 0; h < 7; h++)
        for (int s = 0; s < 3; s++)
            for (int levels = 0; levels < 2; levels++) {
                if (!nb_test_tries((size_t)(h + s + levels) % 3, 3)) continue;
                nebel_sky_view_desc desc = {.atmosphere = air,
                                            .sun = {.irradiance = {1, 1, 1}},
                                            .position = {0, heights[h], 0},
                                            .has_ray_ends = levels};
                memcpy(desc.sun.direction, suns[s], sizeof suns[s]);
                nebel_sky_view *view;
                assert_int_equal(nebel_create_sky_view(&desc, &view), NEBEL_OK);
                for (int w = 0; w < 6; w++) {
                    const double *const direction[3] = {&ways[w][0], &ways[w][1], &ways[w][2]};
                    const float reach = 10;
                    float left[3], light[3], error, distance, sun[3], sky[3];
                    const nebel_transfer_planes transfers = {.transmittance = {&left[0], &left[1], &left[2]},
                                                             .in_scattering = {&light[0], &light[1], &light[2]},
                                                             .error = &error};
                    const nebel_ground_planes ground = {
                        .distance = &distance, .sun = {&sun[0], &sun[1], &sun[2]}, .sky = {&sky[0], &sky[1], &sky[2]}};
                    assert_int_equal(nebel_trace_sky_view(view, 1, direction, levels ? &reach : NULL, &transfers),
                                     NEBEL_OK);
                    for (int c = 0; c < 3; c++)
                        assert_true(left[c] >= 0 && left[c] <= 1 && light[c] >= 0 && light[c] < 1);
                    assert_true(error >= 0 && error < 1);
                    assert_int_equal(nebel_trace_ground(view, 1, direction, &ground), NEBEL_OK);
                    assert_true(distance >= 0);
                    for (int c = 0; c < 3 && distance < HUGE_VALF; c++)
                        assert_true(sun[c] >= 0 && sun[c] <= 1 && sky[c] >= 0 && sky[c] <= 1);
                }
                nebel_destroy_sky_view(view);
            }
    nebel_destroy_atmosphere(air);
}

static void bad_calls_are_refused(void **state)
{
    (void)state;
    nebel_atmosphere *air = make("toy");
    nebel_sky_view *view = NULL;
    const nebel_sky_view_desc bad[] = {{.atmosphere = NULL},
                                       {.atmosphere = air, .sun = {{0, 0, 0}, {1, 1, 1}}},
                                       {.atmosphere = air, .sun = {{0, 1, 0}, {(double)NAN, 1, 1}}},
                                       {.atmosphere = air, .position = {0, (double)NAN, 0}},
                                       {.atmosphere = air, .position = {0, 1e16, 0}}};
    for (size_t i = 0; i < sizeof bad / sizeof *bad; i++) {
        assert_int_equal(nebel_create_sky_view(&bad[i], &view), NEBEL_ERROR_ARGUMENT);
        assert_null(view);
    }
    assert_int_equal(nebel_create_sky_view(NULL, &view), NEBEL_ERROR_ARGUMENT);
    for (int calls = 0; calls < 3; calls++) {
        int left = calls;
        const nebel_sky_view_desc desc = {.atmosphere = air,
                                          .host.allocator = {scarce_allocate, scarce_release, &left}};
        assert_int_equal(nebel_create_sky_view(&desc, &view), NEBEL_ERROR_MEMORY);
        assert_null(view);
    }
    nebel_destroy_sky_view(NULL);
    const double x[1] = {1}, *const directions[3] = {x, NULL, x};
    float distance;
    assert_int_equal(nebel_create_sky_view(&(nebel_sky_view_desc){.atmosphere = air}, &view), NEBEL_OK);
    assert_int_equal(nebel_trace_sky_view(view, 1, directions, NULL, &(nebel_transfer_planes){.error = NULL}),
                     NEBEL_ERROR_ARGUMENT);
    const double *const ahead[3] = {x, x, x};
    const nebel_transfer_planes apart = {.error = &distance, .error_stride = 8};
    assert_int_equal(nebel_trace_sky_view(view, 1, ahead, NULL, &apart), NEBEL_ERROR_ARGUMENT);
    assert_int_equal(nebel_trace_ground(view, 1, directions, &(nebel_ground_planes){.distance = &distance}),
                     NEBEL_ERROR_ARGUMENT);
    nebel_destroy_sky_view(view);
    nebel_destroy_atmosphere(air);
    nebel_atmosphere_desc whole = {.radius = 5};
    assert_int_equal(nebel_resolve_atmosphere(&(nebel_atmosphere_desc){.radius = -1}, &whole), NEBEL_ERROR_VALUE);
    assert_true(whole.radius == 5);
    assert_int_equal(nebel_resolve_atmosphere(&(nebel_atmosphere_desc){.radius = 0}, &whole), NEBEL_OK);
    assert_true(whole.radius == 6.36e6 && whole.component_count == 3);
    assert_int_equal(nebel_resolve_atmosphere(NULL, &whole), NEBEL_ERROR_ARGUMENT);
}

/* The same light as of rays that end where they begin. */
static void ends_that_are_none_count_as_zero(void **state)
{
    (void)state;
    static bundle rays;
    static float bad[3][2], zero[3][2], error[2];
    const double *const direction[3] = {rays.direction[0], rays.direction[1], rays.direction[2]};
    const nebel_transfer_planes told = {.in_scattering = {bad[0], bad[1], bad[2]}, .error = error},
                                wanted = {.in_scattering = {zero[0], zero[1], zero[2]}};
    nebel_atmosphere *earth = make("earth");
    nebel_sky_view *view;
    const nebel_sky_view_desc desc = {
        .atmosphere = earth, .sun = {{0, 1, 0}, {1, 1, 1}}, .position = {0, 1e4, 0}, .has_ray_ends = 1};
    assert_int_equal(nebel_create_sky_view(&desc, &view), NEBEL_OK);
    rays.direction[1][0] = rays.direction[0][1] = 1;
    assert_int_equal(nebel_trace_sky_view(view, 2, direction, (const float[]){NAN, -1}, &told), NEBEL_OK);
    assert_int_equal(nebel_trace_sky_view(view, 2, direction, (const float[]){0, 0}, &wanted), NEBEL_OK);
    assert_memory_equal(bad, zero, sizeof bad);
    assert_true(error[0] >= 0 && error[1] >= 0);
    nebel_destroy_sky_view(view);
    nebel_destroy_atmosphere(earth);
}

/* What the kernels of an instruction set say of rays and of the ground. */
typedef struct answers {
    float transmittance[3][RAYS], in_scattering[3][RAYS], error[RAYS];
    float distance[RAYS], normal[3][RAYS], sun[3][RAYS], sky[3][RAYS];
} answers;

static void ask(nebel_sky_view *view, nebel_isa isa, const bundle *rays, int ends, answers *a)
{
    const double *const direction[3] = {rays->direction[0], rays->direction[1], rays->direction[2]};
    nebel_transfer_planes transfers = {.error = a->error};
    nebel_ground_planes ground = {.distance = a->distance};
    memset(a, 0, sizeof *a);
    for (int c = 0; c < 3; c++) {
        transfers.transmittance[c] = a->transmittance[c];
        transfers.in_scattering[c] = a->in_scattering[c];
        ground.normal[c] = a->normal[c];
        ground.sun[c] = a->sun[c];
        ground.sky[c] = a->sky[c];
    }
    view->look = nb_sky_view_choose(isa);
    assert_int_equal(nebel_trace_sky_view(view, RAYS, direction, ends ? rays->t_max : NULL, &transfers), NEBEL_OK);
    assert_int_equal(nebel_trace_ground(view, RAYS, direction, &ground), NEBEL_OK);
}

/* Also of directions that are none, and of rays that do not fill the last lanes. */
static void all_instruction_sets_agree(void **state)
{
    (void)state;
    static const double heights[] = {0, 1.7, 3e4, 4e5};
    static bundle rays;
    static answers scalar, other;
    nebel_atmosphere *earth = make("earth");
    uint32_t chance = 5;
    for (int i = 0; i < 8; i++) {
        const nebel_sky_view_desc desc = {.atmosphere = earth,
                                          .sun = {.direction = {0.5, 0.8 - 0.15 * i, -0.4}, .irradiance = {1, 2, 3}},
                                          .position = {0, heights[i % 4], 0},
                                          .has_ray_ends = i / 4};
        nebel_sky_view *view;
        assert_int_equal(nebel_create_sky_view(&desc, &view), NEBEL_OK);
        aim(&rays, nebel_lookup_atmosphere("earth"), heights[i % 4], &chance);
        for (int c = 0; c < 3; c++) {
            rays.direction[c][3] = c == 1;
            rays.direction[c][4] = 0;
            rays.direction[c][5] = c == 1 ? -1 : 0;
            rays.direction[c][6] = HUGE_VAL;
            rays.direction[c][7] = (double)NAN;
        }
        ask(view, NEBEL_ISA_SCALAR, &rays, desc.has_ray_ends, &scalar);
        for (int isa = 0; isa < NEBEL_ISA_COUNT; isa++) {
            if (nb_sky_view_choose((nebel_isa)isa) == NULL) continue;
            ask(view, (nebel_isa)isa, &rays, desc.has_ray_ends, &other);
            assert_memory_equal(&scalar, &other, sizeof scalar);
        }
        nebel_destroy_sky_view(view);
    }
    nebel_destroy_atmosphere(earth);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(tables_are_as_far_off_as_they_say),
        cmocka_unit_test(deep_air_has_no_stairs),
        cmocka_unit_test(rays_may_end_within_the_air),
        cmocka_unit_test(thin_air_from_space_is_told),
        cmocka_unit_test(thin_air_is_passed_up_to_the_ground),
        cmocka_unit_test(ground_is_lit_as_places_are),
        cmocka_unit_test(order_of_work_changes_nothing),
        cmocka_unit_test(odd_places_have_answers),
        cmocka_unit_test(bad_calls_are_refused),
        cmocka_unit_test(ends_that_are_none_count_as_zero),
        cmocka_unit_test(all_instruction_sets_agree),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
