/* Sunlight and light of point lights in many bodies over each other, of all profiles, against brute force: the
 * midpoint rule over nebel_sample_medium, with transmittances of nebel_trace, which know nothing of light. */
#include "unit.h"

#include "fog_help.h"

#include <nebel/nebel.h>

#include <math.h>

enum { BODIES = 30, RAYS = 17, FORCED = 3, PLACES = 16000 };

static const double sun_direction[3] = {0.6, 0.64, 0.48}; /* of length 1 */

static double dot(const double a[3], const double b[3])
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

/* ---- fog ------------------------------------------------------------------------------------- */

typedef struct crowd {
    nebel_volume_desc bodies[BODIES];
    size_t count;
    nebel_sun sun;
    nebel_light light;
    int has_light;
} crowd;

static void choose_shape(nebel_volume_desc *v, int kind, uint64_t *numbers)
{
    nebel_shape *s = &v->shape;
    const double radius = dice(numbers, 1, 5);
    for (int c = 0; c < 3; c++) s->center[c] = dice(numbers, -5, 5);
    if (kind % 3 < 2) {
        s->type = NEBEL_SHAPE_SPHERE;
        s->radius = radius;
        return;
    }
    s->type = NEBEL_SHAPE_BOX;
    for (int c = 0; c < 3; c++) {
        const double half = dice(numbers, 0.5, 4);
        s->min[c] = s->center[c] - half;
        s->max[c] = s->center[c] + half;
    }
}

static void choose_density(nebel_volume_desc *v, int kind, uint64_t *numbers)
{
    nebel_density *d = &v->density;
    const double size = dice(numbers, 0.5, 2);
    switch (kind) {
    case 1:
        *d = (nebel_density){.type = NEBEL_DENSITY_RADIAL, .power = 1 + (int)(size * 10) % 3};
        break;
    case 2:
        *d = (nebel_density){.type = NEBEL_DENSITY_SOFT_EDGE, .edge_width = 0.4};
        break;
    case 3:
        *d = (nebel_density){.type = NEBEL_DENSITY_GAUSSIAN, .sigma = size};
        memcpy(d->center, v->shape.center, sizeof d->center);
        break;
    case 4:
        *d = (nebel_density){.type = NEBEL_DENSITY_LINEAR, .from = {0, -2, 0}, .to = {1, 2 * size, 1}};
        break;
    case 5:
        *d = (nebel_density){
            .type = NEBEL_DENSITY_HEIGHT, .below = NEBEL_BELOW_CONSTANT, .base = -1, .scale_height = 2 * size};
        break;
    default:
        break;
    }
}

/* `mixed`: of all profiles, one without an end among them, and some with distances; together of optical depth 1 or 2. */
static void make_crowd(crowd *made, size_t count, int mixed, int light, uint64_t seed)
{
    uint64_t numbers = seed;
    *made = (crowd){.count = count, .has_light = light > 0};
    for (size_t i = 0; i < count; i++) {
        nebel_volume_desc *v = &made->bodies[i];
        *v = (nebel_volume_desc){.albedo = {1, 0.9, 0.5}};
        choose_shape(v, mixed && i % 6 != 1 ? (int)i : 0, &numbers);
        if (mixed) choose_density(v, (int)(i % 6), &numbers);
        for (int c = 0; c < 3; c++) v->extinction[c] = dice(&numbers, 0.2, 2) / (double)count;
        if (light == 0 && i % 2 == 0) v->phase = (nebel_phase){.type = NEBEL_PHASE_HENYEY_GREENSTEIN, .g = 0.5};
        if (light == 0 && i % 5 == 3) v->albedo[0] = v->albedo[1] = v->albedo[2] = 0;
    }
    if (mixed) {
        made->bodies[0] = (nebel_volume_desc){.extinction = {0.01, 0.02, 0.03},
                                              .albedo = {1, 1, 1},
                                              .density = {.type = NEBEL_DENSITY_HEIGHT, .base = -4, .scale_height = 3}};
        made->bodies[6].start = 9;
        made->bodies[7].cutoff = 11;
    }
    made->light = (nebel_light){.position = {1, 2, -1}, .intensity = {30, 20, 10}, .radius = 0.1};
    if (light == 2) {
        const nebel_light spot = {.type = NEBEL_LIGHT_SPOT,
                                  .position = {2, 6, 1},
                                  .intensity = {90, 60, 30},
                                  .radius = 0.2,
                                  .direction = {-0.2, -1, 0},
                                  .inner_angle = 10,
                                  .outer_angle = 35};
        made->light = spot;
    }
    if (light == 0) {
        made->sun = (nebel_sun){.irradiance = {3, 2, 1}};
        memcpy(made->sun.direction, sun_direction, sizeof sun_direction);
    }
}

static nebel_lighting *commit_crowd(const crowd *of)
{
    const nebel_lighting_desc lights = {.sun = of->sun, .lights = &of->light, .light_count = (size_t)of->has_light};
    return fog_light(&lights, of->bodies, of->count);
}

static void make_rays(nebel_ray rays[RAYS], uint64_t seed)
{
    uint64_t numbers = seed;
    for (int i = 0; i < RAYS; i++) {
        const double x = dice(&numbers, -0.3, 0.3), y = dice(&numbers, -0.3, 0.3), size = sqrt(x * x + y * y + 1);
        rays[i] = (nebel_ray){.origin = {dice(&numbers, -3, 3), dice(&numbers, -3, 3), -9},
                              .direction = {x / size, y / size, 1 / size},
                              .t_max = dice(&numbers, 12, 24)};
    }
}

/* ---- brute force ----------------------------------------------------------------------------- */

/* What a light brings to a place: from where, how far, and how much of its irradiance or intensity. */
typedef struct arrival {
    double towards[3], distance, fluence;
} arrival;

static arrival light_arrives(const crowd *of, const double p[3])
{
    const nebel_light *light = &of->light;
    arrival a = {.distance = HUGE_VAL, .fluence = 1};
    memcpy(a.towards, sun_direction, sizeof sun_direction);
    if (!of->has_light) return a;
    for (int k = 0; k < 3; k++) a.towards[k] = light->position[k] - p[k];
    const double apart = sqrt(dot(a.towards, a.towards)), sine = fmin(light->radius / apart, 1);
    for (int k = 0; k < 3; k++) a.towards[k] /= apart;
    a.distance = fmax(apart - light->radius, 0);
    a.fluence = 2 * (1 - sqrt(1 - sine * sine)) / (light->radius * light->radius);
    if (light->type != NEBEL_LIGHT_SPOT) return a;
    const double degree = acos(-1) / 180, edge = cos(light->outer_angle * degree);
    const double cosine = -dot(a.towards, light->direction) / sqrt(dot(light->direction, light->direction));
    const double s = fmin(fmax((cosine - edge) / (cos(light->inner_angle * degree) - edge), 0), 1);
    a.fluence *= s * s * (3 - 2 * s);
    return a;
}

/* Henyey-Greenstein, by its published formula; 0: alike into all directions. */
static double phase_value(double g, double cosine)
{
    return (1 - g * g) / (4 * acos(-1) * pow(1 + g * g - 2 * g * cosine, 1.5));
}

/* What the lit bodies of a snapshot scatter at a place. */
static void scattering_at(const nebel_snapshot *snapshot, const nebel_ray *ray, double t, double out[3])
{
    nebel_sample_point place = {.distance = t};
    nebel_medium_properties matter;
    for (int k = 0; k < 3; k++) place.position[k] = ray->origin[k] + t * ray->direction[k];
    assert_int_equal(nebel_sample_medium(snapshot, 1, &place, 0, &matter, 0), NEBEL_OK);
    memcpy(out, matter.scattering, sizeof matter.scattering);
}

/* Transmittance of a ray to or from the eye. */
static nebel_transfer pass_through(const nebel_snapshot *snapshot, const nebel_ray *ray, int from_eye)
{
    const nebel_trace_desc asked = {.transmittance_only = 1, .ignore_distances = !from_eye};
    nebel_transfer transfer;
    assert_int_equal(nebel_trace(snapshot, &asked, 1, ray, 0, &transfer, 0), NEBEL_OK);
    return transfer;
}

typedef struct forced {
    double light[3], off[3]; /* what it may be off by where fog begins or ends within its steps */
} forced;

/* `turned`: the same bodies, those alone lit whose phase function is turned; in `snapshot` all are. */
static forced light_by_force(const crowd *of, const nebel_snapshot *snapshot, const nebel_snapshot *turned,
                             const nebel_ray *ray, const float *dark)
{
    const double step = ray->t_max / PLACES;
    double before[3] = {0, 0, 0};
    forced sum = {{0, 0, 0}, {0, 0, 0}};
    for (int i = 0; i < PLACES; i++) {
        const double t = (i + 0.5) * step;
        nebel_ray here = *ray, there = *ray;
        double all[3], some[3];
        here.t_max = t;
        for (int k = 0; k < 3; k++) there.origin[k] += t * ray->direction[k];
        const arrival from = light_arrives(of, there.origin);
        memcpy(there.direction, from.towards, sizeof there.direction);
        there.t_max = from.distance;
        scattering_at(snapshot, ray, t, all);
        scattering_at(turned, ray, t, some);
        const nebel_transfer seen = pass_through(snapshot, &here, 1), lit = pass_through(snapshot, &there, 0);
        const double forward = phase_value(0.5, dot(ray->direction, from.towards));
        const int shines = dark == NULL || t < (double)dark[0] || t >= (double)dark[1];
        for (int c = 0; c < 3; c++) {
            const double glow = (all[c] - some[c]) * phase_value(0, 0) + some[c] * forward;
            const double source = of->has_light ? of->light.intensity[c] : of->sun.irradiance[c];
            const double light = glow * shines * source * from.fluence * step;
            sum.light[c] += light * seen.transmittance[c] * lit.transmittance[c];
            sum.off[c] += 0.5 * fabs(light - before[c]) * seen.transmittance[c] * lit.transmittance[c];
            before[c] = light;
        }
    }
    return sum;
}

/* The bodies whose phase function is turned are lit, the others are not. */
static nebel_lighting *commit_turned(const crowd *of)
{
    crowd only = *of;
    for (size_t i = 0; i < only.count; i++)
        if (only.bodies[i].phase.type == NEBEL_PHASE_ISOTROPIC)
            memset(only.bodies[i].albedo, 0, sizeof only.bodies[i].albedo);
    return commit_crowd(&only);
}

/* ---- tests ----------------------------------------------------------------------------------- */

/* Alone and in any company. */
static void expect_the_same_bits(const nebel_lighting *lighting, const nebel_trace_desc *asked, const nebel_ray *rays,
                                 const nebel_transfer *expected)
{
    nebel_transfer other[RAYS];
    nebel_trace_desc desc = *asked;
    for (desc.isa = NEBEL_ISA_DEFAULT; desc.isa < NEBEL_ISA_COUNT; desc.isa++) {
        if (!nebel_isa_available(desc.isa)) continue;
        fog_trace(lighting, desc, RAYS, rays, other);
        assert_memory_equal(expected, other, sizeof other);
    }
    if (asked->sun_visibility != NULL || asked->light_visibility != NULL) return;
    for (int i = 0; i < RAYS; i++) {
        fog_trace(lighting, *asked, 1, &rays[i], &other[i]);
        assert_memory_equal(&expected[i], &other[i], sizeof other[i]);
    }
}

static void expect_brute_force(size_t count, int mixed, int light, int in_shadow)
{
    float boundaries[2 * RAYS];
    static crowd of;
    uint32_t first[RAYS + 1];
    nebel_ray rays[RAYS];
    nebel_transfer transfers[RAYS];
    forced force[FORCED];
    const int forced_rays = (int)nb_test_count(FORCED);
    for (uint32_t i = 0; i <= RAYS; i++) first[i] = 2 * i;
    for (int i = 0; i < 2 * RAYS; i++) boundaries[i] = i % 2 == 0 ? 7 : 9.5f;
    const nebel_ray_visibility pieces = {first, boundaries};
    make_crowd(&of, count, mixed, light, 17 * count + (uint64_t)light);
    make_rays(rays, 5 * count + 3);
    nebel_lighting *lighting = commit_crowd(&of), *turned = commit_turned(&of);
    for (int i = 0; i < forced_rays; i++)
        force[i] = light_by_force(&of, nebel_get_lighting_snapshot(lighting), nebel_get_lighting_snapshot(turned),
                                  &rays[i], in_shadow ? boundaries : NULL);
    for (int precision = NEBEL_PRECISION_DOUBLE; precision <= NEBEL_PRECISION_FLOAT; precision++) {
        for (int fine = 0; fine < 2; fine++) {
            nebel_trace_desc asked = {.precision = (nebel_precision)precision, .tolerance = fine ? 2e-5 : 0};
            if (in_shadow && light == 0) asked.sun_visibility = &pieces;
            if (in_shadow && light > 0) asked.light_visibility = &pieces;
            fog_trace(lighting, asked, RAYS, rays, transfers);
            if (precision == NEBEL_PRECISION_FLOAT) expect_the_same_bits(lighting, &asked, rays, transfers);
            for (int i = 0; i < forced_rays; i++) {
                assert_true(transfers[i].error < (fine ? 2e-5 : 1e-3));
                for (int c = 0; c < 3; c++) {
                    assert_true(force[i].light[c] > 100 * force[i].off[c]);
                    const double off = fabs(transfers[i].in_scattering[c] - force[i].light[c]);
                    assert_true(off <= transfers[i].error + force[i].off[c]);
                }
            }
        }
    }
    nebel_release_lighting(turned);
    nebel_release_lighting(lighting);
}

static void sunlight_is_what_brute_force_finds(void **state)
{
    (void)state;
    expect_brute_force(12, 0, 0, 0);
    expect_brute_force(12, 1, 0, 0);
    expect_brute_force(BODIES, 1, 0, 1);
}

static void point_light_is_what_brute_force_finds(void **state)
{
    (void)state;
    expect_brute_force(12, 0, 1, 0);
    expect_brute_force(BODIES, 1, 1, 1);
    expect_brute_force(BODIES, 1, 2, 0);
}

/* Sunlight that falls through narrow slits between opaque boxes onto a slab: in closed form. */
static void expect_light_through_slits(int boxes, double slit)
{
    const double extinction = 0.3, width = 22.0 / boxes;
    static crowd of;
    double right = 0;
    of = (crowd){.count = (size_t)boxes + 1, .sun = {{0, 1, 0}, {3, 3, 3}}};
    of.bodies[boxes] =
        (nebel_volume_desc){.shape = {.type = NEBEL_SHAPE_BOX, .min = {-10, -1, -50}, .max = {10, 0, 50}},
                            .extinction = {extinction, extinction, extinction},
                            .albedo = {1, 1, 1}};
    for (int i = 0; i < boxes; i++) {
        const double from = -11 + i * width, to = from + width - slit;
        of.bodies[i] =
            (nebel_volume_desc){.shape = {.type = NEBEL_SHAPE_BOX, .min = {from, 1, -50}, .max = {to, 2, 50}},
                                .extinction = {1000, 1000, 1000}};
        if (i + 1 < boxes) right += exp(-extinction * (to + 10)) - exp(-extinction * (to + slit + 10));
    }
    right *= 3 * exp(-extinction * 0.5) * phase_value(0, 0);
    const nebel_ray ray = {{-12, -0.5, 0}, {1, 0, 0}, HUGE_VAL};
    nebel_lighting *lighting = commit_crowd(&of);
    for (int way = 0; way < 3; way++) {
        const nebel_trace_desc asked = {.precision = way == 2 ? NEBEL_PRECISION_FLOAT : NEBEL_PRECISION_DOUBLE,
                                        .tolerance = way == 1 ? 1e-5 : 0};
        nebel_transfer transfer;
        fog_trace(lighting, asked, 1, &ray, &transfer);
        assert_true(transfer.error < (way == 1 ? 1e-5 : 1e-3));
        assert_true(fabs(transfer.in_scattering[0] - right) <= transfer.error);
    }
    nebel_release_lighting(lighting);
}

static void light_falls_through_slits(void **state)
{
    (void)state;
    expect_light_through_slits(12, 0.04);
    expect_light_through_slits(12, 1e-3);
    expect_light_through_slits(3, 0.04); /* so few are no crowd */
    expect_light_through_slits(7, 0.04);
}

/* More than 64 media are no crowd where point lights light more phase functions than common steps can have: those on the way to
 * a point light are looked for in the tree. What light never passes changes nothing. */
static void bodies_far_away_change_nothing(void **state)
{
    (void)state;
    static const nebel_light light = {.position = {1, 2, -1}, .intensity = {30, 20, 10}, .radius = 0.1};
    const nebel_lighting_desc lights = {.lights = &light, .light_count = 1};
    enum { NEAR = 5, MANY = 70 };
    nebel_volume_desc bodies[MANY];
    nebel_lighting *fog[2];
    nebel_transfer transfers[2][FORCED];
    nebel_ray rays[RAYS];
    for (int i = 0; i < MANY; i++)
        bodies[i] = (nebel_volume_desc){.shape = {.type = NEBEL_SHAPE_SPHERE, .radius = 1}, .extinction = {1, 1, 1}};
    for (int i = 0; i < MANY; i++) bodies[i].shape.center[0] = i < NEAR ? .5 * i : 100 + 2 * i;
    for (int i = 0; i < 3 * NEAR; i++) bodies[i / 3].albedo[i % 3] = 0.5, bodies[i / 3].extinction[i % 3] = 0.1;
    bodies[0].shape.radius = 5;
    for (int i = 1; i < NEAR; i++) bodies[i].phase = (nebel_phase){.type = NEBEL_PHASE_HENYEY_GREENSTEIN, .g = .1 * i};
    for (int k = 0; k < 2; k++) fog[k] = fog_light(&lights, bodies, k == 0 ? NEAR : MANY);
    make_rays(rays, 11);
    for (int precision = 0; precision < 2; precision++) {
        const nebel_trace_desc asked = {.precision = (nebel_precision)precision, .tolerance = 1e-3};
        for (int k = 0; k < 2; k++) fog_trace(fog[k], asked, FORCED, rays, transfers[k]);
        for (int i = 0; i < FORCED; i++) {
            const double few = transfers[0][i].error, many = transfers[1][i].error;
            assert_true(transfers[1][i].in_scattering[0] > 1e-3);
            assert_true(fog_difference(&transfers[0][i], &transfers[1][i]) == 0);
            assert_true(many >= few && many <= 1.1 * few);
        }
    }
    for (int k = 0; k < 2; k++) nebel_release_lighting(fog[k]);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(sunlight_is_what_brute_force_finds),
        cmocka_unit_test(point_light_is_what_brute_force_finds),
        cmocka_unit_test(light_falls_through_slits),
        cmocka_unit_test(bodies_far_away_change_nothing),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
