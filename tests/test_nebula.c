/* Particles of nebulae: where they are, what they are, and that they are fog like any other. */
#include <nebel/particles.h>

#include <math.h>
#include <string.h>

#include "fog_help.h"

enum { COUNT = 20000 };

static nebel_particle particles[COUNT], again[COUNT];

static const double violet[2][3] = {{1, 0, 0}, {0, 0, 1}};

static nebel_nebula_desc a_nebula(void)
{
    return (nebel_nebula_desc){.shape = {.type = NEBEL_SHAPE_SPHERE, .center = {1e3, 5, -7}, .radius = 10},
                               .count = COUNT,
                               .seed = 11,
                               .radius_range = {.1, .8},
                               .absorption = {.1, .2, .3},
                               .emission = {1, 1, 1},
                               .colors = violet,
                               .color_count = 2};
}

static double distance(const nebel_particle *p, const double center[3])
{
    return sqrt(pow(p->center[0] - center[0], 2) + pow(p->center[1] - center[1], 2) + pow(p->center[2] - center[2], 2));
}

static void test_fills_its_shape_evenly(void **unused)
{
    (void)unused;
    const nebel_nebula_desc desc = a_nebula();
    assert_int_equal(nebel_generate_nebula(&desc, particles), NEBEL_OK);
    int within_half = 0, in_lower_octave[3] = {0};
    for (int i = 0; i < COUNT; i++) {
        const double r = distance(&particles[i], desc.shape.center);
        assert_true(r <= 10);
        within_half += r < 5;
        assert_true(particles[i].radius >= .1 && particles[i].radius <= .8);
        in_lower_octave[particles[i].radius < .2 ? 0 : particles[i].radius < .4 ? 1 : 2]++;
        for (int c = 0; c < 3; c++) assert_true(particles[i].extinction[c] == desc.absorption[c]);
        assert_true(fabs(particles[i].emission[0] + particles[i].emission[2] - 1) < 1e-12);
        assert_true(particles[i].emission[1] == 0);
    }
    /* an eighth of the volume, a third of the octaves; five standard deviations */
    assert_true(fabs(within_half - COUNT / 8.0) < 5 * sqrt(COUNT * 7 / 64.0));
    for (int i = 0; i < 3; i++) assert_true(fabs(in_lower_octave[i] - COUNT / 3.0) < 5 * sqrt(COUNT * 2 / 9.0));
}

/* Points take the place of the shape, and are stirred and coloured like distributed places. */
static void test_starts_at_points(void **unused)
{
    (void)unused;
    nebel_nebula_desc desc = a_nebula();
    desc.turbulence_scale = 5;
    assert_int_equal(nebel_generate_nebula(&desc, particles), NEBEL_OK);
    static double points[COUNT][3];
    for (int i = 0; i < COUNT; i++) memcpy(points[i], particles[i].center, sizeof points[i]);
    desc.points = (const double(*)[3])points;
    desc.shape.radius = -1;
    assert_int_equal(nebel_generate_nebula(&desc, again), NEBEL_OK);
    for (int i = 0; i < COUNT; i++) {
        assert_memory_equal(again[i].center, particles[i].center, sizeof again->center);
        assert_memory_equal(again[i].emission, particles[i].emission, sizeof again->emission);
        assert_true(again[i].radius == particles[i].radius);
    }
    desc.turbulence = 1;
    assert_int_equal(nebel_generate_nebula(&desc, again), NEBEL_OK);
    int moved = 0;
    for (int i = 0; i < COUNT; i++) moved += distance(&again[i], points[i]) > .01;
    assert_true(moved > COUNT / 2);
    desc.turbulence_scale = 0;
    for (int i = 0; i < COUNT; i++) memset(points[i], 0, sizeof points[i]);
    assert_int_equal(nebel_generate_nebula(&desc, again), NEBEL_OK);
    assert_true(isfinite(again[COUNT - 1].center[0]));
    points[7][1] = HUGE_VAL;
    assert_int_equal(nebel_generate_nebula(&desc, again), NEBEL_ERROR_VALUE);
}

static void test_is_distributed_as_its_density_says(void **unused)
{
    (void)unused;
    nebel_nebula_desc desc = a_nebula();
    desc.density = (nebel_density){.type = NEBEL_DENSITY_RADIAL, .power = 1};
    assert_int_equal(nebel_generate_nebula(&desc, particles), NEBEL_OK);
    int within_half = 0;
    for (int i = 0; i < COUNT; i++) within_half += distance(&particles[i], desc.shape.center) < 5;
    const double share = (1 / 24.0 - 1 / 160.0) / (1 / 3.0 - 1 / 5.0); /* of the integral of (1 - r^2) r^2 */
    assert_true(fabs(within_half - COUNT * share) < 5 * sqrt(COUNT * share * (1 - share)));
}

/* Half by number and half by amount: (1 - r^2)^2 is 1 - r^2 twice. */
static void test_fades_as_its_density_says(void **unused)
{
    (void)unused;
    nebel_nebula_desc desc = a_nebula();
    desc.density = (nebel_density){.type = NEBEL_DENSITY_RADIAL, .power = 1};
    assert_int_equal(nebel_generate_nebula(&desc, particles), NEBEL_OK);
    desc.density.power = 2;
    desc.dimming = .5;
    assert_int_equal(nebel_generate_nebula(&desc, again), NEBEL_OK);
    for (int i = 0; i < COUNT; i++) {
        const double r = distance(&again[i], desc.shape.center) / 10, share = 1 - r * r;
        assert_true(distance(&again[i], particles[i].center) < 1e-9);
        assert_true(fabs(again[i].extinction[1] - share * desc.absorption[1]) < 1e-9);
        for (int c = 0; c < 3; c++) assert_true(fabs(again[i].emission[c] - share * particles[i].emission[c]) < 1e-9);
    }
    desc.dimming = 1.5;
    assert_int_equal(nebel_generate_nebula(&desc, again), NEBEL_ERROR_VALUE);
}

static void test_every_shape_holds_its_particles(void **unused)
{
    (void)unused;
    const nebel_shape parts[2] = {{.type = NEBEL_SHAPE_BOX, .min = {-9, -1, -1}, .max = {9, 1, 1}},
                                  {.type = NEBEL_SHAPE_SPHERE, .radius = 4}};
    const nebel_plane planes[4] = {{{1, 1, 1}, 2}, {{-1, 0, 0}, 1}, {{0, -1, 0}, 1}, {{0, 0, -1}, 1}};
    const nebel_transform turned = {.position = {3, 4, 5}, .rotation = {.1, .5, .2, .8}, .scale = {1, 2, .5}};
    const nebel_shape shapes[] = {
        {.type = NEBEL_SHAPE_BOX, .min = {-1, -2, -3}, .max = {4, 5, 6}, .transform = turned},
        {.type = NEBEL_SHAPE_ELLIPSOID, .radii = {3, 2, 1}, .transform = turned},
        {.type = NEBEL_SHAPE_CYLINDER, .from = {1, 2, 3}, .to = {4, 4, 4}, .radius = 2},
        {.type = NEBEL_SHAPE_CAPSULE, .from = {1, 2, 3}, .to = {4, 4, 4}, .radius = 2, .transform = turned},
        {.type = NEBEL_SHAPE_CONE, .from = {1, 2, 3}, .to = {4, 4, 9}, .radius_from = 2, .radius_to = .5},
        {.type = NEBEL_SHAPE_CONVEX, .planes = planes, .plane_count = 4, .transform = turned},
        {.type = NEBEL_SHAPE_UNION, .parts = parts, .part_count = 2},
        {.type = NEBEL_SHAPE_INTERSECTION, .parts = parts, .part_count = 2, .transform = turned},
    };
    for (size_t s = 0; s < sizeof shapes / sizeof *shapes; s++) {
        nebel_nebula_desc desc = {.shape = shapes[s], .count = 500, .seed = s};
        assert_int_equal(nebel_generate_nebula(&desc, particles), NEBEL_OK);
        const nebel_volume_desc body = {.shape = shapes[s], .extinction = {1e4, 1e4, 1e4}};
        nebel_snapshot *fog = fog_commit(&(nebel_fog_desc){0}, &body, 1);
        for (size_t i = 0; i < desc.count; i++) { /* the march must find fog where a particle is */
            nebel_ray ray = {.direction = {0, 0, 1}, .t_max = 2e-3};
            for (int c = 0; c < 3; c++) ray.origin[c] = particles[i].center[c];
            ray.origin[2] -= 1e-3;
            nebel_transfer transfer;
            assert_int_equal(nebel_trace(fog, &(nebel_trace_desc){0}, 1, &ray, sizeof ray, &transfer, sizeof transfer),
                             NEBEL_OK);
            assert_true(transfer.transmittance[0] < .9999);
        }
        nebel_release_snapshot(fog);
    }
}

static void test_the_same_seed_gives_the_same_particles(void **unused)
{
    (void)unused;
    nebel_nebula_desc desc = a_nebula();
    desc.turbulence = 2;
    assert_int_equal(nebel_generate_nebula(&desc, particles), NEBEL_OK);
    assert_int_equal(nebel_generate_nebula(&desc, again), NEBEL_OK);
    assert_memory_equal(particles, again, sizeof particles);
    desc.count = 10; /* a particle does not depend on how many there are */
    assert_int_equal(nebel_generate_nebula(&desc, again), NEBEL_OK);
    assert_memory_equal(particles, again, 10 * sizeof *particles);
    desc.seed++;
    assert_int_equal(nebel_generate_nebula(&desc, again), NEBEL_OK);
    for (int i = 0; i < 10; i++) assert_true(particles[i].center[0] != again[i].center[0]);
}

static void test_eddies_carry_no_farther_than_told(void **unused)
{
    (void)unused;
    nebel_nebula_desc desc = a_nebula();
    assert_int_equal(nebel_generate_nebula(&desc, particles), NEBEL_OK);
    desc.turbulence = 3;
    assert_int_equal(nebel_generate_nebula(&desc, again), NEBEL_OK);
    double farthest = 0;
    for (int i = 0; i < COUNT; i++)
        for (int c = 0; c < 3; c++) farthest = fmax(farthest, fabs(again[i].center[c] - particles[i].center[c]));
    assert_true(farthest <= 3);
    assert_true(farthest > 1);
}

/* Through the centre: 16/15 of the radius for (1 - r^2)^2, the whole chord for a ball, erf for a Gaussian. */
static void test_a_particle_is_exact_fog(void **unused)
{
    (void)unused;
    const double chords[NEBEL_PARTICLE_PROFILE_COUNT] = {16 / 15.0, sqrt(2 * acos(-1)) / 3 * erf(3 / sqrt(2)), 2};
    for (int p = 0; p < NEBEL_PARTICLE_PROFILE_COUNT; p++) {
        const nebel_particle particle = {{1, 2, 3}, .5, {.7, .8, .9}, {2, 3, 4}, (nebel_particle_profile)p};
        const nebel_volume_desc volume = nebel_volume_from_particle(&particle);
        nebel_snapshot *fog = fog_commit(&(nebel_fog_desc){0}, &volume, 1);
        const nebel_ray ray = {{1, 2, -3}, {0, 0, 1}, HUGE_VAL};
        nebel_transfer transfer;
        assert_int_equal(nebel_trace(fog, &(nebel_trace_desc){0}, 1, &ray, sizeof ray, &transfer, sizeof transfer),
                         NEBEL_OK);
        for (int c = 0; c < 3; c++) {
            const double depth = particle.extinction[c] * particle.radius * chords[p];
            assert_true(fabs(transfer.transmittance[c] - exp(-depth)) < 1e-12);
            assert_true(fabs(transfer.in_scattering[c] +
                             particle.emission[c] / particle.extinction[c] * expm1(-depth)) < 1e-12);
        }
        nebel_release_snapshot(fog);
    }
}

enum { CROWD = 6000, CROWD_RAYS = 37 };

static nebel_snapshot *crowd(nebel_particle_profile profile)
{
    nebel_nebula_desc desc = a_nebula();
    desc.count = CROWD;
    desc.profile = profile;
    assert_int_equal(nebel_generate_nebula(&desc, particles), NEBEL_OK);
    nebel_fog *fog = NULL;
    nebel_snapshot *snapshot = NULL;
    assert_int_equal(nebel_create_fog(&(nebel_fog_desc){0}, &fog), NEBEL_OK);
    for (int i = 0; i < CROWD; i++) {
        const nebel_volume_desc volume = nebel_volume_from_particle(&particles[i]);
        assert_int_equal(nebel_add_volume(fog, &volume, NULL), NEBEL_OK);
    }
    assert_int_equal(nebel_commit_fog(fog, &snapshot), NEBEL_OK);
    nebel_destroy_fog(fog);
    return snapshot;
}

static void aim(nebel_ray rays[CROWD_RAYS])
{
    uint64_t state = 2;
    for (int i = 0; i < CROWD_RAYS; i++) {
        rays[i] = (nebel_ray){
            .origin = {1e3, 5, -30}, .direction = {dice(&state, -.3, .3), dice(&state, -.3, .3), 1}, .t_max = HUGE_VAL};
        if (i % 5 == 0) rays[i].t_max = dice(&state, 15, 35);
    }
}

static void trace(const nebel_snapshot *fog, const nebel_trace_desc *desc, size_t n, const nebel_ray *rays,
                  nebel_transfer *transfers)
{
    assert_int_equal(nebel_trace(fog, desc, n, rays, sizeof *rays, transfers, sizeof *transfers), NEBEL_OK);
}

/* A hundred particles on a ray: the march then looks at those near by alone, and no ray may see whose company it is in.
 */
static void test_a_crowd_is_integrated_as_one_particle_is(void **unused)
{
    (void)unused;
    static nebel_ray rays[CROWD_RAYS];
    static nebel_transfer truth[CROWD_RAYS], transfer[CROWD_RAYS], alone;
    aim(rays);
    for (int p = 0; p < NEBEL_PARTICLE_PROFILE_COUNT; p++) {
        nebel_snapshot *fog = crowd((nebel_particle_profile)p);
        trace(fog, &(nebel_trace_desc){.tolerance = 1e-9}, CROWD_RAYS, rays, truth);
        trace(fog, &(nebel_trace_desc){.precision = NEBEL_PRECISION_FLOAT}, CROWD_RAYS, rays, transfer);
        for (int i = 0; i < CROWD_RAYS; i++) {
            for (int c = 0; c < 3; c++) {
                assert_true(fabs(transfer[i].transmittance[c] - truth[i].transmittance[c]) <=
                            transfer[i].error + truth[i].error);
                assert_true(fabs(transfer[i].in_scattering[c] - truth[i].in_scattering[c]) <=
                            transfer[i].error + truth[i].error);
            }
            assert_true(transfer[i].error < .0021 * 10); /* the most radiant particle has 1 / 0.1 */
            trace(fog, &(nebel_trace_desc){.precision = NEBEL_PRECISION_FLOAT}, 1, &rays[i], &alone);
            assert_memory_equal(&alone, &transfer[i], sizeof alone);
        }
        nebel_release_snapshot(fog);
    }
}

/* The same light from everywhere: what the parts of a ray give must be what the whole ray gives. */
static void test_a_crowd_may_be_cut_anywhere(void **unused)
{
    (void)unused;
    static nebel_ray rays[CROWD_RAYS], parts[2 * CROWD_RAYS];
    static nebel_transfer whole[CROWD_RAYS], part[2 * CROWD_RAYS];
    nebel_snapshot *fog = crowd(NEBEL_PARTICLE_SOFT);
    aim(rays);
    for (int i = 0; i < CROWD_RAYS; i++) {
        const double length =
            sqrt(rays[i].direction[0] * rays[i].direction[0] + rays[i].direction[1] * rays[i].direction[1] + 1);
        parts[2 * i] = parts[2 * i + 1] = rays[i];
        rays[i].t_max = 60;
        parts[2 * i].t_max = 29;
        parts[2 * i + 1].t_max = 31;
        for (int c = 0; c < 3; c++) parts[2 * i + 1].origin[c] += 29 * rays[i].direction[c] / length;
    }
    const nebel_trace_desc desc = {.tolerance = 1e-9};
    trace(fog, &desc, CROWD_RAYS, rays, whole);
    trace(fog, &desc, 2 * CROWD_RAYS, parts, part);
    for (int i = 0; i < CROWD_RAYS; i++) {
        for (int c = 0; c < 3; c++) {
            const nebel_transfer *near = &part[2 * i], *far = &part[2 * i + 1];
            assert_true(fabs(near->transmittance[c] * far->transmittance[c] - whole[i].transmittance[c]) < 1e-11);
            const double sum = near->in_scattering[c] + near->transmittance[c] * far->in_scattering[c];
            assert_true(fabs(sum - whole[i].in_scattering[c]) < 4e-8);
        }
    }
    nebel_release_snapshot(fog);
}

static void expect(nebel_result result, nebel_nebula_desc desc)
{
    fog_messages messages = {0};
    desc.host.log = fog_messages_log(&messages);
    assert_int_equal(nebel_generate_nebula(&desc, particles), result);
    assert_int_equal(messages.count, 1);
}

static void test_refuses_what_is_not_a_nebula(void **unused)
{
    (void)unused;
    nebel_nebula_desc desc = a_nebula();
    assert_int_equal(nebel_generate_nebula(NULL, particles), NEBEL_ERROR_ARGUMENT);
    assert_int_equal(nebel_generate_nebula(&desc, NULL), NEBEL_ERROR_ARGUMENT);
    desc.shape.type = NEBEL_SHAPE_WORLD;
    expect(NEBEL_ERROR_VALUE, desc);
    desc = a_nebula(), desc.shape.radius = -1;
    expect(NEBEL_ERROR_VALUE, desc);
    desc = a_nebula(), desc.radius_range[0] = 2, desc.radius_range[1] = 1;
    expect(NEBEL_ERROR_VALUE, desc);
    desc = a_nebula(), desc.radius_range[1] = (double)NAN;
    expect(NEBEL_ERROR_VALUE, desc);
    desc = a_nebula(), desc.turbulence = (double)INFINITY;
    expect(NEBEL_ERROR_VALUE, desc);
    desc = a_nebula(), desc.turbulence_scale = NEBEL_MIN_LENGTH / 2;
    expect(NEBEL_ERROR_VALUE, desc);
    desc = a_nebula(), desc.host.allocator.release = fog_memory_release;
    expect(NEBEL_ERROR_ARGUMENT, desc);
    desc = a_nebula(), desc.absorption[1] = -1;
    expect(NEBEL_ERROR_VALUE, desc);
    desc = a_nebula(), desc.emission[2] = (double)NAN;
    expect(NEBEL_ERROR_VALUE, desc);
    desc = a_nebula(), desc.profile = NEBEL_PARTICLE_PROFILE_COUNT;
    expect(NEBEL_ERROR_VALUE, desc);
    desc = a_nebula(); /* a Gaussian elsewhere: no particle will ever be taken */
    desc.density = (nebel_density){.type = NEBEL_DENSITY_GAUSSIAN, .center = {0, 0, 0}, .sigma = 1};
    expect(NEBEL_ERROR_VALUE, desc);
}

static void test_memory_may_fail(void **unused)
{
    (void)unused;
    for (size_t k = 1;; k++) {
        fog_memory memory = {.fail_first = k, .fail_count = 1};
        nebel_nebula_desc desc = a_nebula();
        desc.count = 3;
        desc.host.allocator = fog_memory_allocator(&memory);
        const nebel_result result = nebel_generate_nebula(&desc, particles);
        assert_int_equal(memory.live, 0);
        if (memory.fail_first > 0) {
            assert_int_equal(result, NEBEL_OK);
            return;
        }
        assert_int_equal(result, NEBEL_ERROR_MEMORY);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_fills_its_shape_evenly),
        cmocka_unit_test(test_starts_at_points),
        cmocka_unit_test(test_is_distributed_as_its_density_says),
        cmocka_unit_test(test_fades_as_its_density_says),
        cmocka_unit_test(test_every_shape_holds_its_particles),
        cmocka_unit_test(test_the_same_seed_gives_the_same_particles),
        cmocka_unit_test(test_eddies_carry_no_farther_than_told),
        cmocka_unit_test(test_a_particle_is_exact_fog),
        cmocka_unit_test(test_a_crowd_is_integrated_as_one_particle_is),
        cmocka_unit_test(test_a_crowd_may_be_cut_anywhere),
        cmocka_unit_test(test_refuses_what_is_not_a_nebula),
        cmocka_unit_test(test_memory_may_fail),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
