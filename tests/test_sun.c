/* Sunlight in fog: layers of the collected physics (T16), the contracts of every query, and the error that is told. */
#include "unit.h"

#include "fog_help.h"
#include "random_fog.h"

#include <math.h>

/* ---- layers ---------------------------------------------------------------------------------- */

typedef struct layer {
    double depth, view, sun; /* vertical optical depth, cosines of the ways of view and of the sun */
    double reflected, transmitted;
} layer;

static const layer layers[] = {{0.1, 1, 0.5, 0.006875010222976228, 0.006852150680609921},
                               {0.1, 0.5, 0.5, 0.01311754857793413, 0.01303050464137108},
                               {0.1, 0.3, 0.8, 0.02127834094789953, 0.02113139548135406},
                               {1, 1, 0.5, 0.02520518084318261, 0.01850527611123527},
                               {1, 0.5, 0.5, 0.03905997965671679, 0.02153927930184863},
                               {1, 0.3, 0.8, 0.05728300254168366, 0.03193676980703678},
                               {5, 1, 0.5, 0.02652581573433815, 0.0005325759739789651}};

/* Fog between y = 0 and 10, even or denser below, of that optical depth. */
static nebel_lighting *make_layer(const layer *l, int is_even)
{
    const nebel_plane planes[] = {{{0, -1, 0}, 0}, {{0, 1, 0}, 10}};
    const double scale = 3, thick = is_even ? 10 : scale * (1 - exp(-10 / scale)), s = l->depth / thick;
    const nebel_volume_desc volume = {
        .shape = {.type = NEBEL_SHAPE_CONVEX, .planes = planes, .plane_count = 2},
        .density = {.type = is_even ? NEBEL_DENSITY_CONSTANT : NEBEL_DENSITY_HEIGHT, .scale_height = scale},
        .extinction = {s, s, s},
        .albedo = {1, 1, 1}};
    const nebel_lighting_desc desc = {
        .sun = {.direction = {sqrt(1 - l->sun * l->sun), l->sun, 0}, .irradiance = {1, 1, 1}}};
    return fog_light(&desc, &volume, 1);
}

/* From above the light that comes back, from below what comes through. */
static void layers_are_those_of_T16(void **state)
{
    (void)state;
    for (size_t i = 0; i < 2 * sizeof layers / sizeof layers[0]; i++) {
        const layer *l = &layers[i / 2];
        nebel_lighting *lighting = make_layer(l, i % 2 == 0);
        const double across = sqrt(1 - l->view * l->view);
        const nebel_ray rays[] = {{{0, 20, 0}, {0, -l->view, across}, HUGE_VAL},
                                  {{0, -5, 0}, {0, l->view, across}, HUGE_VAL}};
        for (int precision = NEBEL_PRECISION_DOUBLE; precision <= NEBEL_PRECISION_FLOAT; precision++) {
            nebel_transfer transfers[2];
            const nebel_trace_desc desc = {.precision = (nebel_precision)precision,
                                           .tolerance = precision == NEBEL_PRECISION_DOUBLE ? 1e-9 : 1e-5};
            fog_trace(lighting, desc, 2, rays, transfers);
            const double may = precision == NEBEL_PRECISION_DOUBLE ? 1e-10 : 1e-6;
            assert_true(fabs(transfers[0].in_scattering[0] - l->reflected) < may);
            assert_true(fabs(transfers[1].in_scattering[1] - l->transmitted) < may);
            assert_true(transfers[0].error >= fabs(transfers[0].in_scattering[0] - l->reflected));
            assert_true(transfers[1].error >= fabs(transfers[1].in_scattering[0] - l->transmitted));
        }
        nebel_release_lighting(lighting);
    }
}

/* ---- random fog ------------------------------------------------------------------------------ */

/* Sanitizers make it ten times as slow. */
#if defined(__SANITIZE_ADDRESS__)
enum { SEEDS = 2 };
#else
enum { SEEDS = 6 };
#endif

enum { RAYS = 24 };

static random_fog fog;
static nebel_lighting_desc sky;

/* Random fog under a sun. */
static void make_sunlit(random_fog_kind kind, uint64_t seed)
{
    uint64_t numbers = seed * 977 + (uint64_t)kind;
    random_fog_make(&fog, kind, seed);
    random_fog_light(&fog, &numbers);
    sky = (nebel_lighting_desc){
        .sun = {.direction = {dice(&numbers, -1, 1), dice(&numbers, 0.2, 1), 0.3}, .irradiance = {5, 4, 3}}};
    memcpy(sky.environment.radiance, fog.ambient, sizeof fog.ambient);
}

static void trace_some(const nebel_lighting *lighting, const nebel_trace_desc *desc, size_t count, nebel_ray rays[RAYS],
                       nebel_transfer transfers[RAYS])
{
    fog_trace(lighting, *desc, count, rays, transfers);
}

static void trace(const nebel_lighting *lighting, const nebel_trace_desc *desc, nebel_ray rays[RAYS],
                  nebel_transfer transfers[RAYS])
{
    trace_some(lighting, desc, RAYS, rays, transfers);
}

static void draw_rays(nebel_ray rays[RAYS])
{
    for (uint64_t i = 0; i < RAYS; i++) rays[i] = random_fog_ray(&fog, i);
}

static double apart(const nebel_transfer *a, const nebel_transfer *b)
{
    double most = 0;
    for (int c = 0; c < 3; c++) {
        most = fmax(most, fabs(a->transmittance[c] - b->transmittance[c]));
        most = fmax(most, fabs(a->in_scattering[c] - b->in_scattering[c]));
    }
    return most;
}

/* What the tolerance is relative to. */
static double brightest(void)
{
    double most = 1;
    for (size_t i = 0; i < fog.count; i++)
        for (int c = 0; c < 3; c++)
            most = fmax(most, fmax(fog.volumes[i].source[c], fog.volumes[i].albedo[c] * sky.environment.radiance[c]));
    return most;
}

/* Against the same light within a thousandth of the tolerance. */
static void errors_are_told(void **state)
{
    const size_t count = nb_test_count(RAYS);
    (void)state;
    for (int kind = 0; kind < RANDOM_FOG_KIND_COUNT; kind++) {
        double worst = 0, slack = 0;
        for (uint64_t seed = 0; seed < SEEDS; seed++) {
            nebel_ray rays[RAYS];
            nebel_transfer fine[RAYS], transfer[RAYS];
            make_sunlit((random_fog_kind)kind, seed);
            nebel_lighting *lighting = fog_light(&sky, fog.volumes, fog.count);
            draw_rays(rays);
            trace_some(lighting, &(nebel_trace_desc){.tolerance = 2e-6}, count, rays, fine);
            for (int precision = NEBEL_PRECISION_DOUBLE; precision <= NEBEL_PRECISION_FLOAT; precision++) {
                trace_some(lighting, &(nebel_trace_desc){.precision = (nebel_precision)precision}, count, rays,
                           transfer);
                for (size_t i = 0; i < count; i++) {
                    const double off = apart(&transfer[i], &fine[i]);
                    worst = fmax(worst, (off - fine[i].error) / transfer[i].error);
                    slack = fmax(slack, transfer[i].error);
                    if (precision == NEBEL_PRECISION_DOUBLE)
                        assert_true(transfer[i].error <= 0.002 * brightest() + 1e-8);
                }
            }
            nebel_release_lighting(lighting);
        }
        print_message("kind %d: off by at most %.3f of the error told; at most %.1e told\n", kind, worst, slack);
        assert_true(worst <= 1);
    }
}

static void light_is_the_same_in_any_order_and_set(void **state)
{
    (void)state;
    for (int kind = 0; kind < RANDOM_FOG_KIND_COUNT; kind++) {
        nebel_ray rays[RAYS];
        nebel_transfer first[RAYS], other[RAYS];
        make_sunlit((random_fog_kind)kind, 3);
        nebel_lighting *lighting = fog_light(&sky, fog.volumes, fog.count);
        draw_rays(rays);
        for (size_t i = 0; i < fog.count / 2; i++) {
            const nebel_volume_desc swapped = fog.volumes[i];
            fog.volumes[i] = fog.volumes[fog.count - 1 - i];
            fog.volumes[fog.count - 1 - i] = swapped;
        }
        nebel_lighting *turned = fog_light(&sky, fog.volumes, fog.count);
        trace(lighting, &(nebel_trace_desc){.precision = NEBEL_PRECISION_FLOAT, .isa = NEBEL_ISA_SCALAR}, rays, first);
        for (int isa = NEBEL_ISA_DEFAULT; isa < NEBEL_ISA_COUNT; isa++) {
            if (!nebel_isa_available((nebel_isa)isa)) continue;
            const nebel_trace_desc desc = {.precision = NEBEL_PRECISION_FLOAT, .isa = (nebel_isa)isa};
            trace(turned, &desc, rays, other);
            assert_memory_equal(first, other, sizeof first);
            for (size_t i = 0; i < nb_test_count(RAYS); i++) fog_trace(lighting, desc, 1, &rays[i], &other[i]);
            assert_memory_equal(first, other, sizeof first);
        }
        nebel_release_lighting(lighting);
        nebel_release_lighting(turned);
    }
}

/* ---- lit pieces ------------------------------------------------------------------------------ */

/* A box of even fog under a sun at right angles to the ray: the depth to the sun is the same all along. */
static nebel_lighting *make_slab(void)
{
    const nebel_plane planes[] = {{{0, -1, 0}, 0}, {{0, 1, 0}, 10}};
    const nebel_volume_desc volume = {.shape = {.type = NEBEL_SHAPE_CONVEX, .planes = planes, .plane_count = 2},
                                      .extinction = {0.1, 0.2, 0.3},
                                      .albedo = {1, 0.5, 1}};
    const nebel_lighting_desc desc = {.sun = {.direction = {0, 1, 0}, .irradiance = {1, 2, 3}}};
    return fog_light(&desc, &volume, 1);
}

/* What the ray (0, 4, 0) + t (1, 0, 0) gathers from a to b in the slab: albedo irradiance / 4 pi, e^-6s for the way to
 * the sun, and e^-sa - e^-sb. */
static double slab_light(int c, double a, double b)
{
    static const double s[] = {0.1, 0.2, 0.3}, shine[] = {1, 1, 3};
    return shine[c] / 12.566370614359172 * exp(-6 * s[c]) * (exp(-s[c] * a) - exp(-s[c] * b));
}

enum { MANY = 5121 };

static void pieces_are_those_of_the_closed_form(void **state)
{
    static float comb[MANY];
    static const float boundaries[] = {2, 3, 0, 0, 5, 1, 1, 4, 50, HUGE_VALF, 7};
    static const uint32_t first[] = {0, 2, 3, 5, 10, 10, 11};
    static const struct {
        size_t count;
        double ends[4];
    } lit[] = {{2, {0, 2, 3, 20}}, {0, {0}}, {1, {5, 20}}, {1, {0, 4}}, {1, {0, 20}}, {1, {0, 7}}};
    enum { CASES = sizeof lit / sizeof lit[0] };
    const nebel_ray_visibility pieces = {first, boundaries};
    nebel_lighting *lighting = make_slab();
    nebel_ray rays[CASES];
    (void)state;
    for (int i = 0; i < CASES; i++) rays[i] = (nebel_ray){{0, 4, 0}, {1, 0, 0}, 20};
    for (int precision = NEBEL_PRECISION_DOUBLE; precision <= NEBEL_PRECISION_FLOAT; precision++) {
        nebel_transfer transfers[CASES];
        const nebel_trace_desc desc = {
            .precision = (nebel_precision)precision, .tolerance = 1e-7, .sun_visibility = &pieces};
        fog_trace(lighting, desc, CASES, rays, transfers);
        for (int i = 0; i < CASES; i++)
            for (int c = 0; c < 3; c++) {
                double sum = 0;
                for (size_t k = 0; k < lit[i].count; k++)
                    sum += slab_light(c, lit[i].ends[2 * k], i == 2 ? 20 : lit[i].ends[2 * k + 1]);
                assert_true(fabs(transfers[i].in_scattering[c] - sum) < 2e-7);
                assert_true(transfers[i].transmittance[c] == transfers[4].transmittance[c]);
            }
    }
    for (int i = 0; i < MANY; i++) comb[i] = (float)i * 0.00390625f; /* to the end of the ray, and no rounding */
    double sum = 0;
    for (int i = 1; i < MANY; i += 2) sum += slab_light(0, (double)comb[i], (double)comb[i + 1]);
    const nebel_ray_visibility thin = {(const uint32_t[]){0, MANY}, comb};
    nebel_transfer transfer;
    fog_trace(lighting, (nebel_trace_desc){.sun_visibility = &thin}, 1, rays, &transfer);
    assert_true(fabs(transfer.in_scattering[0] - sum) < 1e-6);
    nebel_release_lighting(lighting);
}

static void pieces_that_are_none_are_refused(void **state)
{
    static const float ascends[] = {1, 2, 3}, descends[] = {1, 3, 2}, below[] = {1, -1e-9f, 3}, none[] = {1, NAN, 3};
    static const uint32_t first[] = {0, 1, 3}, back[] = {0, 3, 1};
    const nebel_ray_visibility wrong[] = {{first, descends}, {first, below},  {first, none},
                                          {back, ascends},   {NULL, ascends}, {first, NULL}};
    const nebel_ray rays[2] = {{{0, 4, 0}, {1, 0, 0}, 20}, {{0, 4, 0}, {1, 0, 0}, 20}};
    nebel_lighting *lighting = make_slab();
    (void)state;
    for (size_t i = 0; i < sizeof wrong / sizeof wrong[0]; i++) {
        nebel_transfer transfers[2];
        size_t failed = 9;
        const nebel_snapshot *snapshot = nebel_get_lighting_snapshot(lighting);
        const nebel_trace_desc desc = {.lighting = lighting, .sun_visibility = &wrong[i], .failed_ray = &failed};
        assert_int_equal(nebel_trace(snapshot, &desc, 2, rays, sizeof *rays, transfers, sizeof *transfers),
                         NEBEL_ERROR_ARGUMENT);
        assert_int_equal(failed, i < 4 ? 1 : i == 4 ? 9 : 0);
    }
    nebel_release_lighting(lighting);
}

/* Random pieces of random fog: every set, split and way of asking gives the same bits, transmittance those without. */
static void pieces_are_the_same_in_any_set_and_split(void **state)
{
    (void)state;
    for (int kind = 0; kind < RANDOM_FOG_KIND_COUNT; kind++) {
        static float boundaries[RAYS * 8];
        uint32_t first[RAYS + 1] = {0};
        uint64_t numbers = (uint64_t)kind + 5;
        nebel_ray rays[RAYS];
        nebel_transfer all[RAYS], expected[RAYS], other[RAYS];
        make_sunlit((random_fog_kind)kind, 4);
        nebel_lighting *lighting = fog_light(&sky, fog.volumes, fog.count);
        draw_rays(rays);
        for (uint32_t i = 0; i < RAYS; i++) {
            const uint32_t count = (uint32_t)dice(&numbers, 0, 8);
            double t = 0;
            for (uint32_t k = 0; k < count; k++) boundaries[first[i] + k] = (float)(t += dice(&numbers, 0, 4));
            first[i + 1] = first[i] + count;
        }
        const nebel_ray_visibility pieces = {first, boundaries};
        nebel_trace_desc desc = {.precision = NEBEL_PRECISION_FLOAT, .isa = NEBEL_ISA_SCALAR};
        trace(lighting, &desc, rays, all);
        desc.sun_visibility = &pieces;
        trace(lighting, &desc, rays, expected);
        for (int i = 0; i < RAYS; i++)
            assert_memory_equal(all[i].transmittance, expected[i].transmittance, sizeof all[i].transmittance);
        for (desc.isa = NEBEL_ISA_DEFAULT; desc.isa < NEBEL_ISA_COUNT; desc.isa++) {
            if (!nebel_isa_available(desc.isa)) continue;
            desc.sun_visibility = &pieces;
            trace(lighting, &desc, rays, other);
            assert_memory_equal(expected, other, sizeof expected);
            for (size_t i = 0; i < nb_test_count(RAYS); i++) {
                const nebel_ray_visibility one = {first + i, boundaries};
                desc.sun_visibility = &one;
                fog_trace(lighting, desc, 1, &rays[i], &other[i]);
            }
            assert_memory_equal(expected, other, sizeof expected);
        }
        nebel_transfer fine[RAYS], reference[RAYS];
        trace(lighting, &(nebel_trace_desc){.tolerance = 2e-6, .sun_visibility = &pieces}, rays, fine);
        trace(lighting, &(nebel_trace_desc){.sun_visibility = &pieces}, rays, reference);
        for (int i = 0; i < RAYS; i++) {
            assert_true(apart(&reference[i], &fine[i]) <= reference[i].error + fine[i].error);
            assert_true(apart(&expected[i], &fine[i]) <= expected[i].error + fine[i].error);
        }
        nebel_release_lighting(lighting);
    }
}

/* ---- closed forms ---------------------------------------------------------------------------- */

enum { BODIES = 5 };

/* One ball or ellipsoid, thin or thick. */
static nebel_volume_desc make_ball(uint64_t *numbers)
{
    nebel_volume_desc v = {.shape = {.type = NEBEL_SHAPE_ELLIPSOID, .center = {1, 1, 0}}, .albedo = {0.9, 0.8, 1}};
    const double thickness = pow(10, dice(numbers, -2, 1));
    for (int c = 0; c < 3; c++) {
        v.shape.radii[c] = dice(numbers, 0.5, 5);
        v.extinction[c] = thickness * dice(numbers, 0.1, 1);
    }
    v.shape.transform.rotation[0] = 0.4;
    v.shape.transform.rotation[3] = 0.9;
    if (dice(numbers, 0, 1) < 0.5) v.shape = (nebel_shape){.type = NEBEL_SHAPE_SPHERE, .radius = 4};
    return v;
}

/* Few bodies whose way to the sun is had in closed form: boxes (one turned), planes and the world; with balls and
 * capsules; height fog; or a ball. A body that takes away fog where there is none makes the same fog ask by marches. */
static size_t make_bodies(uint64_t *numbers, int kind, nebel_volume_desc volumes[BODIES + 1])
{
    static const nebel_plane planes[] = {{{1, 1, 0.2}, 3}, {{-1, 0.4, 1}, 2}, {{0, 1, -1}, 3}, {{0, -1, 0.1}, 2}};
    const nebel_shape box = {.type = NEBEL_SHAPE_BOX, .min = {-3, -2, -4}, .max = {2, 3, 4}};
    nebel_shape turned = {.type = NEBEL_SHAPE_BOX, .min = {-2, -2, -2}, .max = {3, 1, 2}};
    turned.transform.rotation[0] = 0.3;
    turned.transform.rotation[1] = 0.5;
    turned.transform.rotation[3] = 0.8;
    const nebel_shape shapes[BODIES] = {
        box,
        {.type = NEBEL_SHAPE_CONVEX, .planes = planes, .plane_count = 4},
        kind == 1 ? (nebel_shape){.type = NEBEL_SHAPE_SPHERE, .center = {1, 1, 0}, .radius = 3} : turned,
        kind == 1 ? (nebel_shape){.type = NEBEL_SHAPE_CAPSULE, .from = {-3, 0, 0}, .to = {2, 2, 1}, .radius = 1} : box,
        turned};
    const size_t count = kind >= 2 ? 1 : 1 + (size_t)dice(numbers, 0, BODIES);
    for (size_t i = 0; i < count; i++) {
        nebel_volume_desc *v = &volumes[i];
        *v = (nebel_volume_desc){.shape = shapes[(i + (size_t)dice(numbers, 0, BODIES)) % BODIES],
                                 .albedo = {0.9, 0.8, 1},
                                 .phase = {.type = NEBEL_PHASE_HENYEY_GREENSTEIN, .g = 0.3}};
        for (int c = 0; c < 3; c++) v->extinction[c] = dice(numbers, 0.02, 0.4);
        if (kind != 2) continue;
        v->shape = (nebel_shape){.type = NEBEL_SHAPE_WORLD};
        v->density = (nebel_density){
            .type = NEBEL_DENSITY_HEIGHT, .base = dice(numbers, -2, 2), .scale_height = dice(numbers, 0.5, 20)};
    }
    if (kind == 3) volumes[0] = make_ball(numbers);
    volumes[count] = (nebel_volume_desc){.operation = NEBEL_OPERATION_EXCLUDE,
                                         .priority = -1,
                                         .shape = {.type = NEBEL_SHAPE_SPHERE, .center = {0, -9e4, 0}, .radius = 1}};
    return count;
}

static void expect_the_same_in_any_set(const nebel_lighting *lighting, const nebel_trace_desc *asked, size_t count,
                                       nebel_ray rays[RAYS], const nebel_transfer expected[RAYS])
{
    nebel_transfer other[RAYS];
    nebel_trace_desc desc = *asked;
    for (desc.isa = NEBEL_ISA_DEFAULT; desc.isa < NEBEL_ISA_COUNT; desc.isa++) {
        if (!nebel_isa_available(desc.isa)) continue;
        trace_some(lighting, &desc, count, rays, other);
        assert_memory_equal(expected, other, count * sizeof *other);
    }
}

/* Rays up, down, level, through, beside and within, some partly in shadow. */
static void closed_forms_are_what_marches_find(void **state)
{
    static const float boundaries[] = {1, 2.5f, 3, 6};
    uint32_t first[RAYS + 1];
    (void)state;
    for (uint32_t i = 0; i <= RAYS; i++) first[i] = i <= RAYS / 2 ? 0 : 4;
    const nebel_ray_visibility pieces = {first, boundaries};
    for (uint64_t seed = 0; seed < 4 * nb_test_count(11); seed++) {
        uint64_t numbers = 77 * seed + 1;
        nebel_volume_desc volumes[BODIES + 1];
        nebel_ray rays[RAYS];
        nebel_transfer closed[RAYS], marched[RAYS];
        const int kind = (int)(seed % 4);
        const size_t count = make_bodies(&numbers, kind, volumes);
        const nebel_lighting_desc desc = {
            .sun = {.direction = {dice(&numbers, -1, 1), dice(&numbers, 0.1, 1), dice(&numbers, -1, 1)},
                    .irradiance = {5, 4, 3}}};
        nebel_lighting *simple = fog_light(&desc, volumes, count), *other = fog_light(&desc, volumes, count + 1);
        for (int i = 0; i < RAYS; i++) {
            rays[i].t_max = i % 3 ? HUGE_VAL : dice(&numbers, 1, 20);
            for (int c = 0; c < 3; c++) {
                rays[i].origin[c] = dice(&numbers, -6, 6);
                rays[i].direction[c] = i % 7 == c ? 0 : dice(&numbers, -1, 1);
            }
            if (i % 5 == 0) memcpy(rays[i].direction, desc.sun.direction, sizeof desc.sun.direction);
        }
        for (int precision = NEBEL_PRECISION_DOUBLE; precision <= NEBEL_PRECISION_FLOAT; precision++) {
            nebel_trace_desc asked = {.tolerance = 1e-7, .sun_visibility = &pieces};
            trace(other, &asked, rays, marched);
            asked.precision = (nebel_precision)precision;
            trace(simple, &asked, rays, closed);
            if (precision == NEBEL_PRECISION_FLOAT) expect_the_same_in_any_set(simple, &asked, RAYS, rays, closed);
            for (int i = 0; i < RAYS; i++) {
                const double off = apart(&closed[i], &marched[i]);
                assert_true(off <= closed[i].error + marched[i].error);
                assert_true(off < (precision == NEBEL_PRECISION_DOUBLE ? 1e-6 : 2e-5));
            }
        }
        nebel_release_lighting(simple);
        nebel_release_lighting(other);
    }
}

/* ---- many balls ------------------------------------------------------------------------------ */

enum { MOST_BALLS = 80, BALL_RAYS = 4, HALVES = 30000 };

static const double sun_of_balls[3] = {0.6, 0.64, 0.48}; /* of length 1 */

static double dot(const double a[3], const double b[3])
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

/* The length of p + t d, t from 0 to `far`, in a ball; d of length 1. */
static double chord(const nebel_shape *ball, const double p[3], const double d[3], double far)
{
    const double q[3] = {p[0] - ball->center[0], p[1] - ball->center[1], p[2] - ball->center[2]};
    const double middle = -dot(q, d), square = ball->radius * ball->radius - (dot(q, q) - middle * middle);
    if (square <= 0) return 0;
    return fmax(fmin(middle + sqrt(square), far) - fmax(middle - sqrt(square), 0), 0);
}

/* What a light brings to a place, and from where: the direction there, how far it is, irradiance per irradiance or intensity of the
 * light. */
typedef struct arrival {
    double towards[3], distance, fluence;
} arrival;

/* The sun's where `point_light` is NULL. A point light is a ball that shines alike from everywhere: radiance 1 / (pi
 * r^2) times its solid angle. */
static arrival light_arrives(const nebel_light *light, const double p[3])
{
    arrival a = {.distance = 1e9, .fluence = 1};
    memcpy(a.towards, sun_of_balls, sizeof sun_of_balls);
    if (light == NULL) return a;
    for (int k = 0; k < 3; k++) a.towards[k] = light->position[k] - p[k];
    const double apart = sqrt(dot(a.towards, a.towards)), sine = fmin(light->radius / apart, 1);
    for (int k = 0; k < 3; k++) a.towards[k] /= apart;
    a.distance = fmax(apart - light->radius, 0);
    a.fluence = 2 * (1 - sqrt(1 - sine * sine)) / (light->radius * light->radius);
    return a;
}

/* What brute force finds, and by how much it may be off where light begins or ends within a step. */
typedef struct forced {
    double light, jumps;
} forced;

/* The midpoint rule in `count` steps, every optical depth by chords: isotropic, of one channel. */
static forced light_by_force(const nebel_volume_desc *balls, size_t ball_count, const nebel_light *light,
                             const nebel_ray *ray, int c, int count)
{
    const double step = ray->t_max / count, scale = (light != NULL ? light->intensity[c] : 1) * step / (4 * acos(-1));
    double before = 0;
    forced sum = {0, 0};
    for (int i = 0; i < count; i++) {
        const double t = (i + 0.5) * step;
        double depth = 0, glow = 0, p[3];
        for (int k = 0; k < 3; k++) p[k] = ray->origin[k] + t * ray->direction[k];
        const arrival from = light_arrives(light, p);
        for (size_t k = 0; k < ball_count; k++) {
            const nebel_volume_desc *v = &balls[k];
            const nebel_shape *ball = &v->shape;
            const double apart[3] = {p[0] - ball->center[0], p[1] - ball->center[1], p[2] - ball->center[2]};
            depth += v->extinction[c] *
                     (chord(ball, ray->origin, ray->direction, t) + chord(ball, p, from.towards, from.distance));
            if (dot(apart, apart) < ball->radius * ball->radius) glow += v->extinction[c] * v->albedo[c];
        }
        sum.light += glow * from.fluence * exp(-depth) * scale;
        sum.jumps += fabs(glow - before) * from.fluence * exp(-depth) * scale;
        before = glow;
    }
    return sum;
}

/* Balls over each other, together `thick` times as dense. */
static void distribute_balls(nebel_volume_desc *balls, size_t count, double thick, uint64_t *numbers)
{
    for (size_t i = 0; i < count; i++) {
        balls[i] = (nebel_volume_desc){.shape = {.type = NEBEL_SHAPE_SPHERE, .radius = dice(numbers, 2, 6)},
                                       .albedo = {1, 0.9, 0.8}};
        for (int c = 0; c < 3; c++) {
            balls[i].shape.center[c] = dice(numbers, -5, 5);
            balls[i].extinction[c] = thick * dice(numbers, 0.1, 1) / (double)count;
        }
    }
}

/* Through balls about the origin. */
static void distribute_rays(nebel_ray *rays, int count, uint64_t *numbers)
{
    for (int i = 0; i < count; i++) {
        rays[i] = (nebel_ray){.origin = {dice(numbers, -4, 4), dice(numbers, -4, 4), -12}, .t_max = 24};
        const double lean = dice(numbers, -0.3, 0.3), size = sqrt(1 + lean * lean);
        rays[i].direction[0] = lean / size;
        rays[i].direction[2] = 1 / size;
    }
}

/* `most`: what the light may be off by at a tolerance of 1e-5. */
static void expect_brute_force(nebel_sun sun, const nebel_light *light, size_t count, double thick, double most)
{
    static nebel_volume_desc balls[MOST_BALLS];
    uint64_t numbers = 31 + count;
    nebel_ray rays[RAYS];
    nebel_transfer transfers[RAYS];
    forced fine[BALL_RAYS];
    double off[BALL_RAYS];
    const nebel_lighting_desc lights = {.sun = sun, .lights = light, .light_count = light != NULL};
    const int forced_rays = (int)nb_test_count(BALL_RAYS);
    const size_t ray_count = count > 20 ? nb_test_count(RAYS) : RAYS;
    distribute_balls(balls, count, thick, &numbers);
    distribute_rays(rays, RAYS, &numbers);
    for (int i = 0; i < forced_rays; i++) {
        fine[i] = light_by_force(balls, count, light, &rays[i], i % 3, HALVES);
        const double halved = light_by_force(balls, count, light, &rays[i], i % 3, HALVES / 2).light;
        off[i] = fabs(fine[i].light - halved) + fine[i].jumps;
        assert_true(fine[i].light > 50 * most && off[i] < most / 2);
    }
    nebel_lighting *lighting = fog_light(&lights, balls, count);
    for (int precision = NEBEL_PRECISION_DOUBLE; precision <= NEBEL_PRECISION_FLOAT; precision++) {
        const nebel_trace_desc asked = {.precision = (nebel_precision)precision, .tolerance = 1e-5};
        trace_some(lighting, &asked, ray_count, rays, transfers);
        if (precision == NEBEL_PRECISION_FLOAT)
            expect_the_same_in_any_set(lighting, &asked, ray_count, rays, transfers);
        for (int i = 0; i < forced_rays; i++) {
            const double wrong = fabs(transfers[i].in_scattering[i % 3] - fine[i].light);
            assert_true(wrong <= transfers[i].error + off[i]);
            assert_true(wrong < most);
        }
    }
    nebel_release_lighting(lighting);
}

/* Balls over each other, each in the shadow of the others: few that are asked one by one, and many that a tree finds. */
static void many_balls_are_what_brute_force_finds(void **state)
{
    nebel_sun sunny = {.irradiance = {1, 1, 1}};
    (void)state;
    memcpy(sunny.direction, sun_of_balls, sizeof sun_of_balls);
    expect_brute_force(sunny, NULL, 20, 1, 3e-5);
    expect_brute_force(sunny, NULL, 40, 1, 3e-5);
    expect_brute_force(sunny, NULL, MOST_BALLS, 1, 3e-5);
}

/* So bright and so thick that rounding of transmittance is more light than the tolerance: steps that were halved for it
 * came to thousands. */
static void many_balls_around_lights_are_what_brute_force_finds(void **state)
{
    const nebel_light dim = {.position = {3, 4, -2}, .intensity = {40, 40, 40}, .radius = 0.2};
    const nebel_light bright = {.position = {-4, 3, 3}, .intensity = {2000, 2000, 2000}, .radius = 0.2};
    (void)state;
    expect_brute_force((nebel_sun){.irradiance = {0, 0, 0}}, &dim, 20, 1, 1e-4);
    expect_brute_force((nebel_sun){.irradiance = {0, 0, 0}}, &bright, 40, 3, 4e-4);
}

/* ---- rules ----------------------------------------------------------------------------------- */

static void suns_are_checked(void **state)
{
    const double nan = (double)NAN;
    const nebel_sun wrong[] = {{.irradiance = {1, 1, 1}},
                               {.direction = {0, nan, 0}, .irradiance = {1, 1, 1}},
                               {.direction = {0, 1, 0}, .irradiance = {-1, 1, 1}},
                               {.direction = {0, 1, 0}, .irradiance = {nan, 1, 1}},
                               {.direction = {0, 1, 0}, .irradiance = {1e10, 1, 1}}};
    const nebel_sun right = {.direction = {0, 1e30, 0}, .irradiance = {1e9, 0, 0}};
    nebel_snapshot *empty = fog_commit(&(nebel_fog_desc){0}, NULL, 0);
    nebel_lighting *lighting = NULL;
    nebel_fog *made = NULL;
    (void)state;
    for (size_t i = 0; i < sizeof wrong / sizeof wrong[0]; i++) {
        const nebel_lighting_desc desc = {.sun = wrong[i]};
        assert_int_equal(nebel_create_lighting(empty, &desc, &lighting), NEBEL_ERROR_VALUE);
        assert_null(lighting);
    }
    assert_int_equal(nebel_create_lighting(empty, &(nebel_lighting_desc){.sun = right}, &lighting), NEBEL_OK);
    nebel_release_lighting(lighting);
    nebel_release_snapshot(empty);
    assert_int_equal(nebel_create_fog(&(nebel_fog_desc){0}, &made), NEBEL_OK);
    const nebel_volume_desc peaked = {.albedo = {1, 1, 1}, .phase = {.type = NEBEL_PHASE_HENYEY_GREENSTEIN, .g = 1}};
    assert_int_equal(nebel_add_volume(made, &peaked, NULL), NEBEL_ERROR_VALUE);
    nebel_destroy_fog(made);
}

/* A box around what is lit: not around fog with a source, and without end where lit fog has none. */
static void sunlit_fog_is_bounded(void **state)
{
    const nebel_lighting_desc desc = {.sun = {.direction = {0, 5, 0}, .irradiance = {5, 5, 5}}};
    nebel_volume_desc volumes[] = {{.shape = {.type = NEBEL_SHAPE_SPHERE, .center = {1, 2, 3}, .radius = 2},
                                    .extinction = {1, 1, 1},
                                    .albedo = {1, 0, 0}},
                                   {.shape = {.type = NEBEL_SHAPE_SPHERE, .center = {50, 2, 3}, .radius = 2},
                                    .extinction = {1, 1, 1},
                                    .source = {1, 1, 1}}};
    nebel_bounds lit;
    (void)state;
    nebel_lighting *lighting = fog_light(&desc, volumes, 2);
    assert_int_equal(nebel_get_lit_bounds(lighting, NEBEL_LIGHT_GROUP_SUN, &lit), 1);
    for (int c = 0; c < 3; c++) {
        assert_true(nebel_get_lighting_sun(lighting).direction[c] == (c == 1));
        assert_true(fabs(lit.min[c] - (c - 1)) < 1e-6 && fabs(lit.max[c] - (c + 3)) < 1e-6);
    }
    nebel_release_lighting(lighting);
    lighting = fog_light(&desc, &volumes[1], 1);
    assert_int_equal(nebel_get_lit_bounds(lighting, NEBEL_LIGHT_GROUP_SUN, &lit), 0);
    nebel_release_lighting(lighting);
    volumes[1] = (nebel_volume_desc){.extinction = {1, 1, 1}, .albedo = {1, 1, 1}};
    lighting = fog_light(&desc, volumes, 2);
    assert_int_equal(nebel_get_lit_bounds(lighting, NEBEL_LIGHT_GROUP_SUN, &lit), 1);
    for (int c = 0; c < 3; c++) assert_true(lit.min[c] == -HUGE_VAL && lit.max[c] == HUGE_VAL);
    nebel_release_lighting(lighting);
}

/* An endless world of fog lets no sun in; fog without end above, less and less of it, does. */
static void endless_fog_is_answered(void **state)
{
    const nebel_lighting_desc desc = {.sun = {.direction = {0.2, 1, 0.1}, .irradiance = {5, 5, 5}}};
    nebel_volume_desc volume = {.extinction = {0.01, 0.02, 0.03}, .albedo = {1, 1, 1}};
    const nebel_ray rays[] = {{{0, 2, 0}, {0.3, -0.1, 1}, HUGE_VAL}, {{0, 2, 0}, {0.3, 0.2, 1}, HUGE_VAL}};
    nebel_transfer transfers[2];
    (void)state;
    nebel_lighting *world = fog_light(&desc, &volume, 1);
    fog_trace(world, (nebel_trace_desc){0}, 2, rays, transfers);
    for (int c = 0; c < 3; c++) assert_true(transfers[0].in_scattering[c] <= transfers[0].error);
    nebel_release_lighting(world);
    volume.density = (nebel_density){.type = NEBEL_DENSITY_HEIGHT, .scale_height = 20};
    nebel_lighting *height = fog_light(&desc, &volume, 1);
    fog_trace(height, (nebel_trace_desc){0}, 2, rays, transfers);
    for (int c = 0; c < 3; c++) assert_true(transfers[1].in_scattering[c] > 0.05 && transfers[1].error < 0.0021);
    nebel_release_lighting(height);
}

/* More volumes than the stack has room for, and than are asked without a tree. */
enum { CROWD = 80 };

static void expect_no_loss(const nebel_volume_desc volumes[CROWD])
{
    const nebel_ray ray = {{0, 0.2, -1}, {0, 0, 1}, HUGE_VAL};
    fog_memory memory = {0};
    fog_messages messages = {0};
    const nebel_fog_desc desc = {
        .host = {.allocator = fog_memory_allocator(&memory), .log = fog_messages_log(&messages)}};
    const nebel_lighting_desc lights = {.sun = {.direction = {0.3, 1, 0.2}, .irradiance = {1, 1, 1}}};
    nebel_snapshot *snapshot = fog_commit(&desc, volumes, CROWD);
    nebel_lighting *lighting = light_fog(snapshot, &lights);
    const size_t live = memory.live;
    for (int precision = NEBEL_PRECISION_DOUBLE; precision <= NEBEL_PRECISION_FLOAT; precision++) {
        const nebel_trace_desc asked = {.lighting = lighting, .precision = (nebel_precision)precision};
        nebel_transfer transfer;
        nebel_result result = NEBEL_ERROR_MEMORY;
        size_t failed = 0;
        for (size_t k = 1; result == NEBEL_ERROR_MEMORY; k++) {
            memory.fail_first = k;
            memory.fail_count = 1;
            result = nebel_trace(snapshot, &asked, 1, &ray, 0, &transfer, 0);
            failed += result == NEBEL_ERROR_MEMORY;
            assert_int_equal(memory.live, live);
        }
        assert_int_equal(result, NEBEL_OK);
        assert_true(failed >= 2);
        assert_true(transfer.in_scattering[0] > 0);
        memory.fail_first = 0;
    }
    nebel_release_lighting(lighting);
    nebel_release_snapshot(snapshot);
    assert_int_equal(memory.live, 0);
}

/* Boxes on a line, all with edges that the way to the sun passes; balls over each other, all on that way. */
static void lost_memory_is_survived(void **state)
{
    static nebel_volume_desc boxes[CROWD], balls[CROWD];
    (void)state;
    for (int i = 0; i < CROWD; i++) {
        boxes[i] =
            (nebel_volume_desc){.shape = {.type = NEBEL_SHAPE_BOX, .min = {-1, -1, 2 * i}, .max = {1, 1, 2 * i + 1}},
                                .extinction = {0.01, 0.01, 0.01},
                                .albedo = {1, 1, 1}};
        balls[i] = boxes[i];
        balls[i].shape = (nebel_shape){.type = NEBEL_SHAPE_SPHERE, .center = {0, 0.1 * i, 5}, .radius = 4.5 + 0.05 * i};
    }
    expect_no_loss(boxes);
    expect_no_loss(balls);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(layers_are_those_of_T16),
        cmocka_unit_test(errors_are_told),
        cmocka_unit_test(light_is_the_same_in_any_order_and_set),
        cmocka_unit_test(pieces_are_those_of_the_closed_form),
        cmocka_unit_test(pieces_that_are_none_are_refused),
        cmocka_unit_test(pieces_are_the_same_in_any_set_and_split),
        cmocka_unit_test(closed_forms_are_what_marches_find),
        cmocka_unit_test(many_balls_are_what_brute_force_finds),
        cmocka_unit_test(many_balls_around_lights_are_what_brute_force_finds),
        cmocka_unit_test(suns_are_checked),
        cmocka_unit_test(sunlit_fog_is_bounded),
        cmocka_unit_test(endless_fog_is_answered),
        cmocka_unit_test(lost_memory_is_survived),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
