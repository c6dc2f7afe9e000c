/* Light of point lights in fog: airlight and spots of the collected physics (T17, T19), brute force, the contracts of
 * every query, and the error that is told. */
#include "unit.h"

#include "fog_help.h"
#include "random_fog.h"

#include <math.h>

static nebel_transfer ask(const nebel_lighting *lighting, nebel_trace_desc desc, nebel_ray ray)
{
    nebel_transfer transfer;
    fog_trace(lighting, desc, 1, &ray, &transfer);
    return transfer;
}

/* ---- even fog -------------------------------------------------------------------------------- */

static nebel_lighting *make_airlight(double extinction, const nebel_light *point_light)
{
    const nebel_volume_desc volume = {.extinction = {extinction, extinction, extinction}, .albedo = {1, 1, 1}};
    const nebel_lighting_desc lights = {.lights = point_light, .light_count = 1};
    return fog_light(&lights, &volume, 1);
}

/* Both precisions, and the error that they tell. */
static void expect_light(const nebel_lighting *lighting, nebel_ray ray, double wanted)
{
    for (int precision = NEBEL_PRECISION_DOUBLE; precision <= NEBEL_PRECISION_FLOAT; precision++) {
        const double tolerance = precision == NEBEL_PRECISION_DOUBLE ? 1e-9 : 1e-6;
        const nebel_trace_desc desc = {.precision = (nebel_precision)precision, .tolerance = tolerance};
        const nebel_transfer transfer = ask(lighting, desc, ray);
        for (int c = 0; c < 3; c++) {
            const double off = fabs(transfer.in_scattering[c] - wanted), rounding = 1e-6 * wanted;
            assert_true(off <= tolerance + rounding);
            assert_true(off <=
                        transfer.error + rounding); /* of the wanted number: it is that of a point light without size */
        }
    }
}

static void airlight_is_that_of_T17(void **state)
{
    static const struct {
        double extinction, distance, angle, length, light;
    } cases[] = {{0.02, 20, 15, 60, 0.04807873504574867}, {0.02, 20, 15, 1000, 0.04823971552254724},
                 {0.1, 10, 90, 50, 0.01538266635057253},  {0.005, 50, 2, 200, 0.05355965729017184},
                 {0.1, 10, 150, 30, 0.00866229562076126}, {1e-6, 20, 15, 60, 4.232468970711786e-06}};
    (void)state;
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        const double angle = cases[i].angle * 3.14159265358979323846 / 180;
        const nebel_light point_light = {
            .position = {cases[i].distance * cos(angle), 0, cases[i].distance * sin(angle)},
            .intensity = {100, 100, 100}};
        nebel_lighting *lighting = make_airlight(cases[i].extinction, &point_light);
        expect_light(lighting, (nebel_ray){{0, 0, 0}, {1, 0, 0}, cases[i].length}, cases[i].light);
        nebel_release_lighting(lighting);
    }
}

static void spots_are_those_of_T19(void **state)
{
    nebel_light point_light = {.type = NEBEL_LIGHT_SPOT,
                               .position = {10, 5, 0},
                               .intensity = {100, 100, 100},
                               .direction = {0, -2, 0},
                               .inner_angle = 30,
                               .outer_angle = 30};
    const nebel_ray ray = {{0, 0, 0}, {1, 0, 0}, HUGE_VAL};
    (void)state;
    nebel_lighting *lighting = make_airlight(0.02, &point_light);
    expect_light(lighting, ray, 0.02458581030636606);
    expect_light(lighting, (nebel_ray){{0, 0, 0}, {1, 0, 0}, 7.1132}, 0);
    nebel_release_lighting(lighting);
    point_light.inner_angle = point_light.outer_angle = 180; /* a point */
    lighting = make_airlight(0.02, &point_light);
    const nebel_trace_desc fine = {.tolerance = 1e-9};
    const nebel_transfer spot = ask(lighting, fine, ray);
    nebel_release_lighting(lighting);
    point_light.type = NEBEL_LIGHT_POINT;
    lighting = make_airlight(0.02, &point_light);
    const nebel_transfer point = ask(lighting, fine, ray);
    assert_true(fog_difference(&spot, &point) < 2e-9);
    nebel_release_lighting(lighting);
}

/* ---- brute force ----------------------------------------------------------------------------- */

static double square_to(const double a[3], const double b[3])
{
    return (a[0] - b[0]) * (a[0] - b[0]) + (a[1] - b[1]) * (a[1] - b[1]) + (a[2] - b[2]) * (a[2] - b[2]);
}

/* Smooth from the inner angle to the outer one, by cosines. */
static double cone_of(const nebel_light *point_light, const double towards[3])
{
    if (point_light->type != NEBEL_LIGHT_SPOT) return 1;
    const double degree = 3.14159265358979323846 / 180;
    const double inner = cos(point_light->inner_angle * degree), outer = cos(point_light->outer_angle * degree);
    double dot = 0, square = 0;
    for (int i = 0; i < 3; i++) {
        dot -= towards[i] * point_light->direction[i];
        square += point_light->direction[i] * point_light->direction[i];
    }
    const double s = fmin(fmax((dot / sqrt(square) - outer) / (inner - outer), 0), 1);
    return s * s * (3 - 2 * s);
}

/* What balls of fog give there per metre towards -view, in red. */
static double glow_at(const nebel_volume_desc *balls, size_t count, const nebel_light *point_light,
                      const double view[3], const double place[3], double *reach, double towards[3])
{
    const double square = square_to(place, point_light->position), distance = sqrt(square),
                 r2 = point_light->radius * point_light->radius;
    double cosine = 0, glow = 0;
    for (int i = 0; i < 3; i++) {
        towards[i] = (point_light->position[i] - place[i]) / distance;
        cosine += towards[i] * view[i];
    }
    *reach = fmax(distance - point_light->radius, 0);
    const double seen = 2 * 3.14159265358979323846 * (1 - sqrt(1 - r2 / fmax(square, r2)));
    const double irradiance =
        point_light->intensity[0] / (3.14159265358979323846 * r2) * seen * cone_of(point_light, towards);
    for (size_t k = 0; k < count; k++)
        if (square_to(place, balls[k].shape.center) < balls[k].shape.radius * balls[k].shape.radius)
            glow += balls[k].extinction[0] * balls[k].albedo[0] * nebel_evaluate_phase(&balls[k].phase, cosine);
    return glow * irradiance;
}

enum { STEPS = 40000 };

static double brute_force(const nebel_lighting *lighting, const nebel_volume_desc *balls, size_t count,
                          const nebel_light *point_light, const nebel_ray *ray)
{
    static nebel_ray rays[2 * STEPS];
    static nebel_transfer transfers[2 * STEPS];
    static double glow[STEPS];
    const double h = ray->t_max / STEPS;
    for (int i = 0; i < STEPS; i++) {
        const double t = (i + 0.5) * h;
        double place[3], towards[3], reach;
        for (int k = 0; k < 3; k++) place[k] = ray->origin[k] + t * ray->direction[k];
        glow[i] = glow_at(balls, count, point_light, ray->direction, place, &reach, towards);
        rays[2 * i] = *ray;
        rays[2 * i].t_max = t;
        rays[2 * i + 1] = (nebel_ray){{place[0], place[1], place[2]}, {towards[0], towards[1], towards[2]}, reach};
    }
    fog_trace(lighting, (nebel_trace_desc){.transmittance_only = 1}, 2 * (size_t)STEPS, rays, transfers);
    double sum = 0;
    for (int i = 0; i < STEPS; i++)
        sum += glow[i] * h * transfers[2 * i].transmittance[0] * transfers[2 * i + 1].transmittance[0];
    return sum;
}

/* Two balls that overlap, of different light; point lights outside, within, in both, and a ray through the point
 * light. */
static void light_is_that_of_brute_force(void **state)
{
    const nebel_volume_desc balls[] = {{.shape = {.type = NEBEL_SHAPE_SPHERE, .center = {0, 0, 0}, .radius = 2},
                                        .extinction = {0.5, 0.5, 0.5},
                                        .albedo = {0.9, 0.9, 0.9},
                                        .phase = {.type = NEBEL_PHASE_HENYEY_GREENSTEIN, .g = 0.7}},
                                       {.shape = {.type = NEBEL_SHAPE_SPHERE, .center = {1.5, 0.3, 0}, .radius = 1},
                                        .extinction = {1, 1, 1},
                                        .albedo = {0.4, 0.4, 0.4},
                                        .phase = {.type = NEBEL_PHASE_RAYLEIGH}}};
    const nebel_light point_lights[] = {{.position = {0, 3, 1}, .intensity = {10, 10, 10}, .radius = 0.1},
                                        {.position = {1.2, 0.2, 0.1}, .intensity = {1, 1, 1}, .radius = 0.25},
                                        {.position = {-0.5, 0.1, 0.5}, .intensity = {3, 3, 3}, .radius = 0.01},
                                        {.type = NEBEL_LIGHT_SPOT,
                                         .position = {0, 2.5, 0},
                                         .intensity = {9, 9, 9},
                                         .radius = 0.05,
                                         .direction = {0.1, -1, 0.05},
                                         .inner_angle = 5,
                                         .outer_angle = 20}};
    enum { RAY_KINDS = 3 };
    const nebel_ray rays[RAY_KINDS] = {
        {{-4, 0.1, 0.2}, {1, 0, 0}, 9}, {{-4, 0.2, 0.1}, {1, 0, 0}, 9}, {{0, 0, 0}, {0, 0.6, 0.8}, 1}};
    (void)state;
    double worst = 0;
    for (size_t l = 0; l < sizeof point_lights / sizeof point_lights[0]; l++) {
        const nebel_lighting_desc lights = {.lights = &point_lights[l], .light_count = 1};
        nebel_lighting *lighting = fog_light(&lights, balls, 2);
        for (size_t r = 0; r < nb_test_count(RAY_KINDS); r++) {
            const nebel_ray *const ray = &rays[(l + r) % RAY_KINDS];
            const nebel_transfer transfer = ask(lighting, (nebel_trace_desc){.tolerance = 1e-6}, *ray);
            const double sum = brute_force(lighting, balls, 2, &point_lights[l], ray);
            worst = fmax(worst, fabs(transfer.in_scattering[0] - sum) / sum);
            assert_true(transfer.error <= 1.1e-6);
        }
        nebel_release_lighting(lighting);
    }
    print_message("off by at most %.1e\n", worst);
    assert_true(worst < 3e-4); /* steps that an edge falls into */
}

/* ---- random fog ------------------------------------------------------------------------------ */

/* Sanitizers make it ten times as slow. */
#if defined(__SANITIZE_ADDRESS__)
enum { SEEDS = 1 };
#else
enum { SEEDS = 3 };
#endif

enum { RAYS = 16, LIGHTS = 3 };

static random_fog fog;
static nebel_lighting_desc sky;
static nebel_light point_lights[LIGHTS];

/* Random fog under a sun and point lights within and beside it. */
static void make_lit(random_fog_kind kind, uint64_t seed)
{
    uint64_t numbers = seed * 1481 + (uint64_t)kind;
    random_fog_make(&fog, kind, seed);
    random_fog_light(&fog, &numbers);
    for (int i = 0; i < LIGHTS; i++) {
        nebel_light *point_light = &point_lights[i];
        *point_light = (nebel_light){.type = i == 1 ? NEBEL_LIGHT_SPOT : NEBEL_LIGHT_POINT,
                                     .direction = {dice(&numbers, -1, 1), -1, dice(&numbers, -1, 1)},
                                     .inner_angle = 10,
                                     .outer_angle = dice(&numbers, 15, 100),
                                     .radius = i == 2 ? dice(&numbers, 0.01, 0.5) : 0};
        for (int c = 0; c < 3; c++) {
            point_light->position[c] = dice(&numbers, -4, 4);
            point_light->intensity[c] = dice(&numbers, 0, 20);
        }
    }
    sky = (nebel_lighting_desc){.sun = {.direction = {dice(&numbers, -1, 1), dice(&numbers, 0.2, 1), 0.3}}};
    if (seed % 2 == 0) sky.sun.irradiance[0] = sky.sun.irradiance[1] = sky.sun.irradiance[2] = 4;
    memcpy(sky.environment.radiance, fog.ambient, sizeof fog.ambient);
    sky.lights = point_lights;
    sky.light_count = LIGHTS;
}

static nebel_lighting *commit_lit(void)
{
    return fog_light(&sky, fog.volumes, fog.count);
}

static void trace_some(const nebel_lighting *lighting, const nebel_trace_desc *desc, size_t count,
                       const nebel_ray rays[RAYS], nebel_transfer transfers[RAYS])
{
    fog_trace(lighting, *desc, count, rays, transfers);
}

static void trace(const nebel_lighting *lighting, const nebel_trace_desc *desc, const nebel_ray rays[RAYS],
                  nebel_transfer transfers[RAYS])
{
    trace_some(lighting, desc, RAYS, rays, transfers);
}

static void draw_rays(nebel_ray rays[RAYS])
{
    for (uint64_t i = 0; i < RAYS; i++) rays[i] = random_fog_ray(&fog, i);
}

/* Lights from faint to bright, of which some are left out: against the sum of all that are alone in the fog. Nine volumes and more of
 * one phase function are lit along the ray as a whole, others from piece to piece. */
static void many_lights_are_the_sum_of_each_alone(void **state)
{
    enum { MANY = 20, SOME = 2 };
    static const size_t volume_counts[] = {1, 2, 12};
    double worst = 0;
    (void)state;
    for (uint64_t seed = 0; seed < 6; seed++) {
        uint64_t numbers = 7 * seed + 5;
        nebel_light many[MANY];
        nebel_volume_desc volumes[12];
        nebel_ray rays[SOME];
        nebel_transfer all[2][SOME], alone;
        double sum[SOME] = {0}, off[SOME] = {0};
        const size_t volume_count = volume_counts[seed % 3];
        for (size_t i = 0; i < volume_count; i++) {
            volumes[i] = (nebel_volume_desc){.extinction = {.02, .02, .02}, .albedo = {.8, .8, .8}};
            volumes[i].shape = (nebel_shape){.type = NEBEL_SHAPE_SPHERE, .radius = dice(&numbers, 4, 30)};
            for (int c = 0; c < 3; c++) volumes[i].shape.center[c] = dice(&numbers, -9, 9);
        }
        for (int i = 0; i < MANY; i++) {
            const double power = pow(10, dice(&numbers, -6, 2));
            many[i] = (nebel_light){.intensity = {power, power, power}, .direction = {0, -1, 0}, .outer_angle = 60};
            many[i].type = i % 5 == 0 ? NEBEL_LIGHT_SPOT : NEBEL_LIGHT_POINT;
            for (int c = 0; c < 3; c++) many[i].position[c] = dice(&numbers, -30, 30);
        }
        for (int i = 0; i < SOME; i++) {
            rays[i] = (nebel_ray){.t_max = 60};
            for (int c = 0; c < 3; c++) rays[i].origin[c] = dice(&numbers, -20, 20);
            for (int c = 0; c < 3; c++) rays[i].direction[c] = dice(&numbers, -9, 9) - rays[i].origin[c];
        }
        nebel_lighting *lighting =
            fog_light(&(nebel_lighting_desc){.lights = many, .light_count = MANY}, volumes, volume_count);
        const nebel_trace_desc descs[2] = {{.tolerance = 1e-3}, {.precision = NEBEL_PRECISION_FLOAT}};
        for (int way = 0; way < 2; way++) fog_trace(lighting, descs[way], SOME, rays, all[way]);
        nebel_release_lighting(lighting);
        for (int l = 0; l < MANY; l++) {
            lighting = fog_light(&(nebel_lighting_desc){.lights = &many[l], .light_count = 1}, volumes, volume_count);
            for (int i = 0; i < SOME; i++) {
                fog_trace(lighting, (nebel_trace_desc){.tolerance = 1e-5}, 1, &rays[i], &alone);
                sum[i] += alone.in_scattering[0];
                off[i] += alone.error;
            }
            nebel_release_lighting(lighting);
        }
        for (int way = 0; way < 2; way++)
            for (int i = 0; i < SOME; i++) {
                const double told = all[way][i].error + off[i];
                const double ratio = fabs(all[way][i].in_scattering[0] - sum[i]) / told;
                worst = fmax(worst, ratio);
                if (!(ratio <= 1)) fail_msg("seed %d ray %d: off by %g of what is told", (int)seed, i, ratio);
            }
    }
    print_message("many lights: off by %.2f of what is told at most\n", worst);
}

/* Against the same light within a hundredth of the tolerance. */
static void errors_are_told(void **state)
{
    const size_t count = nb_test_count(RAYS);
    (void)state;
    for (int kind = 0; kind < RANDOM_FOG_KIND_COUNT; kind++) {
        double worst = 0, slack = 0;
        for (uint64_t seed = 0; seed < SEEDS; seed++) {
            nebel_ray rays[RAYS];
            nebel_transfer fine[RAYS], transfer[RAYS];
            make_lit((random_fog_kind)kind, seed);
            nebel_lighting *lighting = commit_lit();
            draw_rays(rays);
            trace_some(lighting, &(nebel_trace_desc){.tolerance = 2e-5}, count, rays, fine);
            for (int precision = NEBEL_PRECISION_DOUBLE; precision <= NEBEL_PRECISION_FLOAT; precision++) {
                trace_some(lighting, &(nebel_trace_desc){.precision = (nebel_precision)precision}, count, rays,
                           transfer);
                for (size_t i = 0; i < count; i++) {
                    const double off = fog_difference(&transfer[i], &fine[i]);
                    worst = fmax(worst, (off - fine[i].error) / transfer[i].error);
                    slack = fmax(slack, transfer[i].error);
                }
            }
            nebel_release_lighting(lighting);
        }
        print_message("kind %d: off by at most %.3f of the error told; at most %.1e told\n", kind, worst, slack);
        assert_true(worst <= 1);
    }
}

/* Random pieces of random fog: every set and split gives the same bits, transmittance those without. */
static void light_is_the_same_in_any_set_and_split(void **state)
{
    (void)state;
    for (int kind = 0; kind < RANDOM_FOG_KIND_COUNT; kind++) {
        static float boundaries[RAYS * 8];
        uint32_t first[RAYS + 1] = {0};
        uint64_t numbers = (uint64_t)kind + 5;
        nebel_ray rays[RAYS];
        nebel_transfer all[RAYS], expected[RAYS], other[RAYS];
        make_lit((random_fog_kind)kind, 4);
        nebel_lighting *lighting = commit_lit();
        draw_rays(rays);
        for (uint32_t i = 0; i < RAYS; i++) {
            const uint32_t count = (uint32_t)dice(&numbers, 0, 8);
            double t = 0;
            for (uint32_t k = 0; k < count; k++) boundaries[first[i] + k] = (float)(t += dice(&numbers, 0, 4));
            first[i + 1] = first[i] + count;
        }
        const nebel_ray_visibility none = {(const uint32_t[RAYS + 1]){0}, NULL}, some = {first, boundaries};
        const nebel_ray_visibility pieces[LIGHTS] = {some, none, some};
        nebel_trace_desc desc = {.precision = NEBEL_PRECISION_FLOAT, .isa = NEBEL_ISA_SCALAR};
        trace(lighting, &desc, rays, all);
        desc.light_visibility = pieces;
        trace(lighting, &desc, rays, expected);
        for (int i = 0; i < RAYS; i++)
            assert_memory_equal(all[i].transmittance, expected[i].transmittance, sizeof all[i].transmittance);
        for (desc.isa = NEBEL_ISA_DEFAULT; desc.isa < NEBEL_ISA_COUNT; desc.isa++) {
            if (!nebel_isa_available(desc.isa)) continue;
            desc.light_visibility = pieces;
            trace(lighting, &desc, rays, other);
            assert_memory_equal(expected, other, sizeof expected);
            for (size_t i = 0; i < nb_test_count(RAYS); i++) {
                const nebel_ray_visibility one[LIGHTS] = {{first + i, boundaries}, none, {first + i, boundaries}};
                desc.light_visibility = one;
                fog_trace(lighting, desc, 1, &rays[i], &other[i]);
            }
            assert_memory_equal(expected, other, sizeof expected);
        }
        nebel_release_lighting(lighting);
    }
}

/* The pieces of one point light in even fog add up to all of its light. */
static void pieces_add_up(void **state)
{
    static const float odd[] = {2, 5, 9.5f, 10.25f, 31}, even[] = {0, 2, 5, 9.5f, 10.25f, 31};
    static const uint32_t odd_first[] = {0, 5}, even_first[] = {0, 6};
    const nebel_ray_visibility pieces[] = {{odd_first, odd}, {even_first, even}};
    const nebel_light point_light = {.position = {10, 1, 2}, .intensity = {100, 50, 20}};
    const nebel_ray ray = {{0, 0, 0}, {1, 0, 0}, 60};
    nebel_lighting *lighting = make_airlight(0.03, &point_light);
    (void)state;
    nebel_transfer transfer[3];
    for (int i = 0; i < 3; i++)
        transfer[i] =
            ask(lighting, (nebel_trace_desc){.tolerance = 1e-8, .light_visibility = i < 2 ? &pieces[i] : NULL}, ray);
    for (int c = 0; c < 3; c++) {
        const double both = transfer[0].in_scattering[c] + transfer[1].in_scattering[c];
        assert_true(transfer[1].in_scattering[c] > 0.05 * transfer[2].in_scattering[c]);
        assert_true(fabs(both - transfer[2].in_scattering[c]) < 3e-8);
    }
    nebel_release_lighting(lighting);
}

/* ---- hard cases ------------------------------------------------------------------------------ */

/* Through the point light, from it, along its axis; point lights far away, and far from the origin. */
static void hard_rays_are_answered(void **state)
{
    const double far = 1e7;
    const nebel_light point_light = {.position = {far, 5, 0}, .intensity = {100, 100, 100}};
    const nebel_ray rays[] = {{{far - 10, 5, 0}, {1, 0, 0}, HUGE_VAL},
                              {{far, 5, 0}, {1, 0, 0}, HUGE_VAL},
                              {{far, 5, 0}, {1, 0, 0}, 0},
                              {{far - 10, 5, 0}, {1, 0, 0}, 10},
                              {{far + 1e-4, 5, 0}, {0, 1, 0}, 1e-6},
                              {{0, 5, 0}, {0, 1, 0}, HUGE_VAL},
                              {{far - 20, 5, 0}, {0, 1, 0}, HUGE_VAL}};
    nebel_lighting *lighting = make_airlight(0.02, &point_light), *near;
    (void)state;
    for (size_t i = 0; i < sizeof rays / sizeof rays[0]; i++)
        for (int precision = NEBEL_PRECISION_DOUBLE; precision <= NEBEL_PRECISION_FLOAT; precision++) {
            const nebel_transfer transfer =
                ask(lighting, (nebel_trace_desc){.precision = (nebel_precision)precision}, rays[i]);
            for (int c = 0; c < 3; c++) assert_true(transfer.in_scattering[c] >= 0 && transfer.in_scattering[c] < 1e4);
            assert_true(transfer.error >= 0 && transfer.error < 0.01);
        }
    const nebel_transfer away = ask(lighting, (nebel_trace_desc){0}, rays[6]);
    near = make_airlight(0.02, &(nebel_light){.position = {0, 5, 0}, .intensity = {100, 100, 100}});
    const nebel_transfer here = ask(near, (nebel_trace_desc){0}, (nebel_ray){{-20, 5, 0}, {0, 1, 0}, HUGE_VAL});
    assert_true(fog_difference(&away, &here) < 1e-9);
    nebel_release_lighting(lighting);
    nebel_release_lighting(near);
}

static void lights_are_checked(void **state)
{
    const double nan = (double)NAN;
    const nebel_light right = {.type = NEBEL_LIGHT_SPOT, .direction = {0, -1, 0}, .outer_angle = 40};
    nebel_light wrong[12];
    for (int i = 0; i < 12; i++) wrong[i] = right;
    wrong[0].type = (nebel_light_type)7;
    wrong[1].position[1] = nan;
    wrong[2].position[2] = 1e16;
    wrong[3].intensity[0] = -1;
    wrong[4].intensity[1] = nan;
    wrong[5].intensity[1] = 1e10;
    wrong[6].radius = -1;
    wrong[7].radius = 1e-9;
    wrong[8].direction[1] = 0;
    wrong[9].outer_angle = 0;
    wrong[10].inner_angle = 41;
    wrong[11].outer_angle = 181;
    (void)state;
    fog_messages messages = {0};
    nebel_snapshot *empty = fog_commit(&(nebel_fog_desc){.host.log = fog_messages_log(&messages)}, NULL, 0);
    nebel_lighting *made = NULL;
    for (int i = 0; i < 12; i++) {
        const nebel_light both[] = {right, wrong[i]};
        const nebel_lighting_desc desc = {.lights = both, .light_count = 2};
        assert_int_equal(nebel_create_lighting(empty, &desc, &made), NEBEL_ERROR_VALUE);
        assert_non_null(strstr(messages.text, "light 1: "));
        assert_null(made);
    }
    const nebel_lighting_desc none = {.light_count = 1}, one = {.lights = &right, .light_count = 1};
    assert_int_equal(nebel_create_lighting(empty, &none, &made), NEBEL_ERROR_ARGUMENT);
    assert_int_equal(nebel_create_lighting(NULL, &one, &made), NEBEL_ERROR_ARGUMENT);
    nebel_release_lighting(light_fog(empty, &one));
    nebel_release_lighting(light_fog(empty, &(nebel_lighting_desc){.lights = &right}));
    nebel_release_snapshot(empty);
}

static void lost_memory_is_survived(void **state)
{
    const nebel_volume_desc volume = {.extinction = {0.1, 0.1, 0.1}, .albedo = {1, 1, 1}};
    const nebel_light point_light = {.position = {1, 2, 3}, .intensity = {1, 1, 1}};
    static const uint32_t first[] = {0, 0};
    const nebel_ray_visibility pieces = {first, NULL};
    const nebel_ray ray = {{0, 0.2, -1}, {0, 0, 1}, HUGE_VAL};
    fog_memory memory = {0};
    const nebel_fog_desc desc = {.host.allocator = fog_memory_allocator(&memory)};
    const nebel_lighting_desc lights = {.lights = &point_light, .light_count = 1};
    nebel_fog *made = NULL;
    nebel_snapshot *snapshot = NULL;
    nebel_lighting *lighting = NULL;
    (void)state;
    assert_int_equal(nebel_create_fog(&desc, &made), NEBEL_OK);
    assert_int_equal(nebel_add_volume(made, &volume, NULL), NEBEL_OK);
    nebel_result result = NEBEL_ERROR_MEMORY;
    for (size_t k = 1; result == NEBEL_ERROR_MEMORY; k++) {
        memory.fail_first = k;
        memory.fail_count = 1;
        result = nebel_commit_fog(made, &snapshot);
    }
    assert_int_equal(result, NEBEL_OK);
    result = NEBEL_ERROR_MEMORY;
    for (size_t k = 1; result == NEBEL_ERROR_MEMORY; k++) {
        memory.fail_first = k;
        memory.fail_count = 1;
        result = nebel_create_lighting(snapshot, &lights, &lighting);
    }
    assert_int_equal(result, NEBEL_OK);
    memory.fail_first = memory.fail_count = 1;
    nebel_transfer transfer;
    const nebel_trace_desc asked = {.lighting = lighting, .light_visibility = &pieces};
    assert_int_equal(nebel_trace(snapshot, &asked, 1, &ray, 0, &transfer, 0), NEBEL_ERROR_MEMORY);
    assert_int_equal(nebel_trace(snapshot, &asked, 1, &ray, 0, &transfer, 0), NEBEL_OK);
    nebel_destroy_fog(made);
    nebel_release_snapshot(snapshot);
    nebel_release_lighting(lighting);
    assert_int_equal(memory.live, 0);
}

/* What a renderer asks that casts shadows into fog. */
static void a_lighting_tells_of_its_lights(void **state)
{
    const nebel_volume_desc volumes[] = {{.shape = {.type = NEBEL_SHAPE_SPHERE, .center = {1, 2, 3}, .radius = 2},
                                          .extinction = {1, 1, 1},
                                          .albedo = {0, 1, 0}},
                                         {.extinction = {1, 1, 1}, .source = {1, 1, 1}}};
    const nebel_light given[] = {{.position = {7, 8, 9}, .intensity = {1, 1, 1}, .radius = 0.5},
                                 {.position = {-1, 0, 1}, .intensity = {1, 1, 1}}};
    const nebel_lighting_desc desc = {.lights = given, .light_count = 2};
    const nebel_light *told = NULL;
    nebel_bounds lit;
    (void)state;
    nebel_lighting *lighting = fog_light(&desc, volumes, 2);
    assert_int_equal(nebel_get_lit_bounds(lighting, NEBEL_LIGHT_GROUP_LOCAL, &lit), 1);
    for (int c = 0; c < 3; c++) assert_true(fabs(lit.min[c] - (c - 1)) < 1e-6 && fabs(lit.max[c] - (c + 3)) < 1e-6);
    assert_int_equal(nebel_get_lighting_lights(lighting, &told), 2);
    for (size_t i = 0; i < 2; i++) {
        assert_memory_equal(told[i].position, given[i].position, sizeof given[i].position);
        assert_true(told[i].radius == given[i].radius);
    }
    nebel_release_lighting(lighting);
    lighting = fog_light(&desc, &volumes[1], 1);
    assert_int_equal(nebel_get_lit_bounds(lighting, NEBEL_LIGHT_GROUP_LOCAL, &lit), 0);
    nebel_release_lighting(lighting);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(airlight_is_that_of_T17),
        cmocka_unit_test(spots_are_those_of_T19),
        cmocka_unit_test(light_is_that_of_brute_force),
        cmocka_unit_test(many_lights_are_the_sum_of_each_alone),
        cmocka_unit_test(errors_are_told),
        cmocka_unit_test(light_is_the_same_in_any_set_and_split),
        cmocka_unit_test(pieces_add_up),
        cmocka_unit_test(hard_rays_are_answered),
        cmocka_unit_test(lights_are_checked),
        cmocka_unit_test(lost_memory_is_survived),
        cmocka_unit_test(a_lighting_tells_of_its_lights),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
