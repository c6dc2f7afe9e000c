/* The light of fog by groups: each is that of its light alone, they add up to the whole, asking for them changes no bit
 * of it, and lost memory is told and leaks nothing. */
#include "fog_help.h"
#include "random_fog.h"

enum { RAYS = 16, STRIDE = 3, GROUPS = NEBEL_LIGHT_GROUP_COUNT };
_Static_assert((int)GROUPS == NEBEL_TRANSFER_GROUPS, "planes have room for all groups");

static const nebel_sun suns[2] = {{{.3, .8, .2}, {1, 2, 3}}, {{.3, .8, .2}, {4, 5, 6}}};

static const nebel_environment sky = {
    .type = NEBEL_ENVIRONMENT_GRADIENT, .zenith = {.2, .3, .4}, .horizon = {.4, .3, .2}, .ground = {.1, .1, .1}};

static const nebel_light point_lights[2] = {{.position = {1, 5, -3}, .intensity = {30, 20, 10}, .radius = .1},
                                            {.type = NEBEL_LIGHT_SPOT,
                                             .position = {-3, 6, -9},
                                             .intensity = {10, 20, 30},
                                             .direction = {.3, -1, .1},
                                             .inner_angle = 20,
                                             .outer_angle = 50}};

static const nebel_diffusion_desc few_cells = {.max_cells = 1000};

/* Scattering fog, fog that shines, fog with a source of its own. */
static const nebel_volume_desc volumes[] = {{.shape = {.type = NEBEL_SHAPE_SPHERE, .center = {0, 2, -8}, .radius = 6},
                                             .extinction = {.1, .15, .2},
                                             .albedo = {.9, .8, .7},
                                             .phase = {.type = NEBEL_PHASE_HENYEY_GREENSTEIN, .g = .4}},
                                            {.shape = {.type = NEBEL_SHAPE_BOX, .min = {-4, 0, -12}, .max = {4, 3, -5}},
                                             .extinction = {.05, .05, .05},
                                             .emission = {.01, .02, .03}},
                                            {.shape = {.type = NEBEL_SHAPE_BOX, .min = {-9, 0, -9}, .max = {-5, 4, -5}},
                                             .extinction = {.1, .1, .1},
                                             .source = {.3, .2, .1}}};

static nebel_lighting_desc all_lights(void)
{
    return (nebel_lighting_desc){.sun = suns[0], .environment = sky, .lights = point_lights, .light_count = 2};
}

/* ---- rays in planes, light by groups --------------------------------------------------------- */

typedef struct ray_planes {
    float offset[3][RAYS], way[3][RAYS], t_max[RAYS];
} ray_planes;

static void set_rays(ray_planes *p, const nebel_ray rays[RAYS])
{
    for (int i = 0; i < RAYS; i++) {
        double largest = 0; /* directions may be of any length */
        for (int c = 0; c < 3; c++) largest = fmax(largest, fabs(rays[i].direction[c]));
        for (int c = 0; c < 3; c++) {
            p->offset[c][i] = (float)rays[i].origin[c];
            p->way[c][i] = (float)(rays[i].direction[c] / largest);
        }
        p->t_max[i] = (float)fmin(rays[i].t_max, 1e30);
    }
}

static void aim_at_volumes(ray_planes *p)
{
    nebel_ray rays[RAYS];
    for (int i = 0; i < RAYS; i++)
        rays[i] = (nebel_ray){{0, 2, 4}, {-.9 + .115 * i, .02 * (i % 5) - .04, -1}, i % 3 == 0 ? 10 : 1e3};
    set_rays(p, rays);
}

static nebel_ray_planes from_planes(const ray_planes *p)
{
    nebel_ray_planes from = {.t_max = p->t_max};
    for (int c = 0; c < 3; c++) {
        from.offset[c] = p->offset[c];
        from.direction_float[c] = p->way[c];
    }
    return from;
}

static const float untouched = -7;

/* Elements are `stride` apart. */
typedef struct light {
    size_t stride;
    float transmittance[3][STRIDE * RAYS], whole[3][STRIDE * RAYS], group[GROUPS][3][STRIDE * RAYS];
    float error[STRIDE * RAYS];
} light;

static void clear(light *l, size_t stride)
{
    float *numbers = l->transmittance[0];
    l->stride = stride;
    for (size_t i = 0; i < (sizeof *l - offsetof(light, transmittance)) / sizeof(float); i++) numbers[i] = untouched;
}

/* Bits of `mask` are channels of groups: 1 << (3 * group + channel). */
enum { NO_GROUP = 0, ALL_GROUPS = 511 };

static nebel_result try_groups(const nebel_lighting *lighting, nebel_trace_desc desc, const ray_planes *rays,
                               size_t count, int mask, int wants_whole, int wants_error, light *l)
{
    const nebel_ray_planes from = from_planes(rays);
    nebel_transfer_planes to = {.error = wants_error ? l->error : NULL};
    to.transmittance_stride = to.in_scattering_stride = to.error_stride = l->stride * sizeof(float);
    for (int c = 0; c < 3; c++) {
        to.transmittance[c] = l->transmittance[c];
        to.in_scattering[c] = wants_whole ? l->whole[c] : NULL;
        for (int g = 0; g < GROUPS; g++) to.group[g].in_scattering[c] = mask >> (3 * g + c) & 1 ? l->group[g][c] : NULL;
    }
    desc.lighting = lighting;
    return nebel_trace_planes(nebel_get_lighting_snapshot(lighting), &desc, count, &from, &to);
}

static void ask(const nebel_lighting *lighting, nebel_trace_desc desc, const ray_planes *rays, int mask, light *l)
{
    clear(l, 1);
    assert_int_equal(try_groups(lighting, desc, rays, RAYS, mask, 1, 1, l), NEBEL_OK);
}

/* By structures, in double. */
static void look(const nebel_lighting *lighting, nebel_trace_desc desc, const ray_planes *p, nebel_transfer *transfers)
{
    nebel_ray rays[RAYS];
    for (int i = 0; i < RAYS; i++)
        for (int c = 0; c < 3; c++) {
            rays[i].origin[c] = (double)p->offset[c][i];
            rays[i].direction[c] = (double)p->way[c][i];
            rays[i].t_max = (double)p->t_max[i];
        }
    desc.precision = NEBEL_PRECISION_DOUBLE;
    fog_trace(lighting, desc, RAYS, rays, transfers);
}

/* ---- judgement ------------------------------------------------------------------------------- */

static double sum_of_groups(const light *l, int c, size_t i)
{
    double sum = 0;
    for (int g = 0; g < GROUPS; g++) sum += (double)l->group[g][c][l->stride * i];
    return sum;
}

/* But for rounding of the parts, and of numbers that are next to nothing. */
static void assert_sum(const light *l)
{
    for (size_t i = 0; i < RAYS; i++)
        for (int c = 0; c < 3; c++) {
            const double whole = (double)l->whole[c][l->stride * i];
            for (int g = 0; g < GROUPS; g++) assert_true(l->group[g][c][l->stride * i] >= 0);
            if (!(fabs(sum_of_groups(l, c, i) - whole) <= 1e-6 * whole + 1e-30))
                fail_msg("ray %zu, channel %d: groups add up to %.9g, not %.9g", i, c, sum_of_groups(l, c, i), whole);
        }
}

/* Asking for groups, all or some of them, with the error or without it, changes no bit; all instruction sets agree. */
static void assert_bits(const nebel_lighting *lighting, nebel_trace_desc desc, const ray_planes *rays)
{
    static const int masks[] = {ALL_GROUPS, 7, 7 << 3, 7 << 6, 0x92, 0x109};
    static light plain, all, found;
    for (int wants_error = 0; wants_error < 2; wants_error++) {
        desc.isa = NEBEL_ISA_SCALAR;
        clear(&plain, 1);
        clear(&all, 1);
        assert_int_equal(try_groups(lighting, desc, rays, RAYS, NO_GROUP, 1, wants_error, &plain), NEBEL_OK);
        assert_int_equal(try_groups(lighting, desc, rays, RAYS, ALL_GROUPS, 1, wants_error, &all), NEBEL_OK);
        for (desc.isa = NEBEL_ISA_DEFAULT; desc.isa < NEBEL_ISA_COUNT; desc.isa++) {
            /* With the error one instruction set will do: it takes the longest, and test_kernels compares them all. */
            if (!nebel_isa_available(desc.isa) || (wants_error && desc.isa != NEBEL_ISA_DEFAULT)) continue;
            for (size_t m = (size_t)desc.isa % 2; m < sizeof masks / sizeof *masks; m += 2) {
                clear(&found, 1);
                assert_int_equal(try_groups(lighting, desc, rays, RAYS, masks[m], 1, wants_error, &found), NEBEL_OK);
                assert_memory_equal(found.transmittance, plain.transmittance, sizeof plain.transmittance);
                assert_memory_equal(found.whole, plain.whole, sizeof plain.whole);
                assert_memory_equal(found.error, plain.error, sizeof plain.error);
                for (int g = 0; g < GROUPS; g++)
                    for (int c = 0; c < 3; c++) {
                        const int is_asked = masks[m] >> (3 * g + c) & 1;
                        const light *wanted = is_asked ? &all : &plain;
                        assert_memory_equal(found.group[g][c], wanted->group[g][c], sizeof found.group[g][c]);
                    }
            }
        }
    }
}

/* The lights of one group alone. */
static nebel_lighting_desc lights_of(const nebel_lighting_desc *all, int group)
{
    nebel_lighting_desc one = {.diffusion = all->diffusion};
    if (group == NEBEL_LIGHT_GROUP_SUN) one.sun = all->sun;
    if (group == NEBEL_LIGHT_GROUP_ENVIRONMENT) one.environment = all->environment;
    if (group == NEBEL_LIGHT_GROUP_LOCAL) {
        one.lights = all->lights;
        one.light_count = all->light_count;
    }
    return one;
}

/* The largest difference, that beyond the errors that are told, and the most light of each group. */
typedef struct verdict {
    double off, beyond, brightest[GROUPS];
} verdict;

/* Each group beside a lighting of its lights alone, in double, less what fog gives in the dark. */
static verdict compare_groups(const nebel_lighting *all, const nebel_lighting_desc *lights, nebel_trace_desc desc,
                              const ray_planes *rays, light *found)
{
    nebel_snapshot *snapshot = nebel_get_lighting_snapshot(all);
    verdict v = {.off = 0};
    const nebel_lighting_desc none = {.diffusion = lights->diffusion};
    nebel_lighting *dark = light_fog(snapshot, &none);
    nebel_transfer own[RAYS], alone[RAYS];
    ask(all, desc, rays, ALL_GROUPS, found);
    const nebel_ray_visibility *by_lights = desc.light_visibility;
    desc.light_visibility = NULL;
    look(dark, desc, rays, own);
    for (int g = 0; g < GROUPS; g++) {
        const nebel_lighting_desc one = lights_of(lights, g);
        nebel_lighting *lit = light_fog(snapshot, &one);
        desc.light_visibility = g == NEBEL_LIGHT_GROUP_LOCAL ? by_lights : NULL;
        look(lit, desc, rays, alone);
        for (int i = 0; i < RAYS; i++)
            for (int c = 0; c < 3; c++) {
                const double less = g == NEBEL_LIGHT_GROUP_LOCAL ? 0 : own[i].in_scattering[c];
                const double wanted = alone[i].in_scattering[c] - less;
                const double told = (double)found->error[i] + alone[i].error + own[i].error;
                const double off = fabs((double)found->group[g][c][i] - wanted);
                v.off = fmax(v.off, off);
                v.beyond = fmax(v.beyond, off - told);
                v.brightest[g] = fmax(v.brightest[g], wanted);
                assert_true(fabs((double)found->transmittance[c][i] - alone[i].transmittance[c]) <= told);
            }
        nebel_release_lighting(lit);
    }
    nebel_release_lighting(dark);
    return v;
}

static void expect_groups(const nebel_volume_desc *given, size_t count, const nebel_lighting_desc *lights,
                          nebel_trace_desc desc, const ray_planes *rays)
{
    nebel_lighting *lighting = fog_light(lights, given, count);
    static light found;
    const verdict v = compare_groups(lighting, lights, desc, rays, &found);
    const double most = fmax(1e-6, .1 * desc.tolerance);
    print_message("groups of %g, %g and %g are off by %.1e\n", v.brightest[0], v.brightest[1], v.brightest[2], v.off);
    for (int g = 0; g < GROUPS; g++) assert_true(v.brightest[g] > .01);
    assert_true(v.beyond <= 0 && v.off <= most);
    assert_sum(&found);
    desc.tolerance = 0;
    assert_bits(lighting, desc, rays);
    nebel_release_lighting(lighting);
}

/* ---- fog of every kind ----------------------------------------------------------------------- */

static const nebel_trace_desc fine = {.tolerance = 1e-5};

static void groups_are_those_of_lights_apart(void **state)
{
    (void)state;
    ray_planes rays;
    nebel_lighting_desc lights = all_lights();
    aim_at_volumes(&rays);
    expect_groups(volumes, 3, &lights, fine, &rays);
    lights.environment = (nebel_environment){.radiance = {.2, .3, .4}};
    expect_groups(volumes, 3, &lights, fine, &rays);
    expect_groups(volumes, 1, &lights, fine, &rays); /* without emission and source */
    lights.diffusion = &few_cells;
    expect_groups(volumes, 3, &lights, fine, &rays);
    lights.environment = sky;
    expect_groups(volumes, 3, &lights, fine, &rays);
}

/* Diffusion dims light of the environment a little farther than a body reaches: here where other fog shines. */
/* Beside a body fog may take more from ambient light than there is in a ray: then that group is 0, and only then the sum is larger. */
static void diffused_groups_add_up_beside_bodies(void **state)
{
    (void)state;
    static light found;
    ray_planes rays;
    nebel_ray beside[RAYS];
    const nebel_lighting_desc lights = {.environment = {.radiance = {.2, .3, .4}}, .diffusion = &few_cells};
    nebel_lighting *lighting = fog_light(&lights, volumes, 3);
    for (int i = 0; i < RAYS; i++) beside[i] = (nebel_ray){{0, 2, 4}, {-.7 + .02 * i, .04, -1}, 1e3};
    set_rays(&rays, beside);
    ask(lighting, fine, &rays, ALL_GROUPS, &found);
    int exact = 0;
    for (size_t i = 0; i < RAYS; i++)
        for (int c = 0; c < 3; c++) {
            const double whole = (double)found.whole[c][i], sum = sum_of_groups(&found, c, i);
            const int is_taken_whole = found.group[NEBEL_LIGHT_GROUP_ENVIRONMENT][c][i] == 0;
            assert_true(sum >= whole * (1 - 1e-6));
            assert_true(is_taken_whole || sum <= whole * (1 + 1e-6));
            exact += !is_taken_whole;
        }
    assert_true(exact > RAYS);
    nebel_release_lighting(lighting);
}

/* Voxels alone, whose sun has a lattice, and voxels beside fog that shines. */
static void groups_of_voxels(void **state)
{
    (void)state;
    enum { SIDE = 8 };
    static float voxels[SIDE * SIDE * SIDE];
    uint64_t numbers = 5;
    nebel_grid *grid = NULL;
    ray_planes rays;
    for (int i = 0; i < SIDE * SIDE * SIDE; i++) voxels[i] = (float)dice(&numbers, 0, 1);
    const nebel_grid_desc desc = {.size = {SIDE, SIDE, SIDE}, .voxels = voxels, .filter = NEBEL_GRID_FILTER_LINEAR};
    assert_int_equal(nebel_create_grid(&desc, &grid), NEBEL_OK);
    const nebel_volume_desc cloud = {.shape = {.type = NEBEL_SHAPE_BOX, .min = {-5, -1, -13}, .max = {5, 6, -4}},
                                     .density = {.type = NEBEL_DENSITY_GRID, .grid = grid},
                                     .extinction = {.3, .4, .5},
                                     .albedo = {.9, .8, .7}};
    nebel_lighting_desc lights = all_lights();
    aim_at_volumes(&rays);
    expect_groups(&cloud, 1, &lights, fine, &rays);
    expect_groups((nebel_volume_desc[]){cloud, volumes[1], volumes[2]}, 3, &lights, fine, &rays);
    lights.diffusion = &few_cells;
    expect_groups(&cloud, 1, &lights, fine, &rays);
    nebel_release_grid(grid);
}

/* Balls over each other, which scatter, shine by themselves or have a source. */
static void groups_of_crowds(void **state)
{
    (void)state;
    enum { MOST = 72 };
    static nebel_volume_desc balls[MOST];
    ray_planes rays;
    const nebel_lighting_desc lights = all_lights();
    const nebel_trace_desc desc = {.tolerance = 1e-4};
    aim_at_volumes(&rays);
    for (size_t count = 12; count <= MOST; count *= 6) {
        uint64_t numbers = count;
        for (size_t i = 0; i < count; i++) {
            balls[i] = (nebel_volume_desc){.shape = {.type = NEBEL_SHAPE_SPHERE, .radius = dice(&numbers, 2, 5)}};
            for (int c = 0; c < 3; c++) {
                balls[i].shape.center[c] = dice(&numbers, -3, 3) + (c == 2 ? -8 : 2);
                balls[i].extinction[c] = dice(&numbers, .1, 1) / (double)count;
                balls[i].albedo[c] = i % 5 < 3 ? .9 : 0;
                balls[i].source[c] = i % 5 == 3 ? .5 : 0;
                balls[i].emission[c] = i % 5 == 4 ? .02 * balls[i].extinction[c] : 0;
            }
        }
        expect_groups(balls, count, &lights, desc, &rays);
        for (size_t i = 0; i < count; i++) /* of several phase functions */
            balls[i].phase = (nebel_phase){.type = i % 2 ? NEBEL_PHASE_RAYLEIGH : NEBEL_PHASE_ISOTROPIC};
        expect_groups(balls, count, &lights, desc, &rays);
    }
}

/* Surfaces hide rays from the sun, and from one of the point lights. */
static void groups_in_shadows_of_surfaces(void **state)
{
    (void)state;
    static uint32_t first[RAYS + 1], none[RAYS + 1];
    static float boundaries[4 * RAYS];
    ray_planes rays;
    const nebel_lighting_desc lights = all_lights();
    for (uint32_t i = 0; i <= RAYS; i++) first[i] = 4 * i;
    for (int i = 0; i < RAYS; i++)
        for (int k = 0; k < 4; k++) boundaries[4 * i + k] = (float)(5 + k * (2 + .1 * i));
    const nebel_ray_visibility pieces = {first, boundaries}, by_lights[] = {pieces, {none, NULL}};
    nebel_trace_desc desc = fine;
    aim_at_volumes(&rays);
    desc.sun_visibility = &pieces;
    expect_groups(volumes, 3, &lights, desc, &rays);
    desc.light_visibility = by_lights;
    expect_groups(volumes, 3, &lights, desc, &rays);
}

/* Fog that gives only a part of all light: what is left out is 0, and the rest is all. */
static void groups_without_light_are_dark(void **state)
{
    (void)state;
    static light found;
    ray_planes rays;
    aim_at_volumes(&rays);
    for (int group = 0; group < GROUPS; group++) {
        const nebel_lighting_desc all = all_lights(), one = lights_of(&all, group);
        nebel_lighting *lighting = fog_light(&one, volumes, 1);
        ask(lighting, fine, &rays, ALL_GROUPS, &found);
        for (int g = 0; g < GROUPS; g++)
            for (int c = 0; c < 3; c++)
                for (int i = 0; i < RAYS; i++)
                    assert_true(found.group[g][c][i] == (g == group ? found.whole[c][i] : 0));
        nebel_release_lighting(lighting);
    }
    nebel_lighting *dark = fog_light(NULL, volumes, 3);
    ask(dark, fine, &rays, ALL_GROUPS, &found);
    assert_memory_equal(found.group[NEBEL_LIGHT_GROUP_LOCAL], found.whole, sizeof found.whole);
    assert_sum(&found);
    nebel_release_lighting(dark);
}

/* Every kind of random fog, limited in one of four. */
static void random_mixtures_add_up(void **state)
{
    (void)state;
    static random_fog fog;
    static light found;
    double worst = 0;
    for (uint64_t seed = 0; seed < nb_test_count(3 * RANDOM_FOG_KIND_COUNT); seed++) {
        uint64_t numbers = seed;
        nebel_ray some[RAYS];
        ray_planes rays;
        random_fog_make(&fog, (random_fog_kind)(seed % RANDOM_FOG_KIND_COUNT), 100 + seed / RANDOM_FOG_KIND_COUNT);
        random_fog_light(&fog, &numbers);
        if (fog.kind == RANDOM_FOG_FAR) continue; /* too far away for floats */
        for (uint64_t i = 0; i < RAYS; i++) some[i] = random_fog_ray(&fog, i);
        set_rays(&rays, some);
        nebel_lighting_desc lights = all_lights();
        if (seed % 3 == 1) lights.light_count = 0;
        if (seed % 3 == 2) memset(&lights.sun, 0, sizeof lights.sun);
        if (seed % 5 == 2) lights.environment = random_fog_lights(&fog).environment;
        const nebel_fog_desc limited = random_fog_desc(&fog);
        nebel_lighting *lighting = fog_commit_lit(&limited, fog.volumes, fog.count, &lights);
        ask(lighting, (nebel_trace_desc){0}, &rays, ALL_GROUPS, &found);
        assert_sum(&found);
        assert_bits(lighting, (nebel_trace_desc){0}, &rays);
        const nebel_trace_desc unlimited = {.tolerance = 1e-4, .ignore_max_opacity = 1};
        worst = fmax(worst, compare_groups(lighting, &lights, unlimited, &rays, &found).beyond);
        assert_sum(&found);
        nebel_release_lighting(lighting);
    }
    print_message("off by %.1e more than is told\n", worst);
    assert_true(worst <= 0);
}

/* ---- planes ---------------------------------------------------------------------------------- */

static void limits_weaken_groups_alike(void **state)
{
    (void)state;
    static light limited, whole;
    ray_planes rays;
    const nebel_lighting_desc lights = all_lights();
    nebel_lighting *lighting = fog_commit_lit(&(nebel_fog_desc){.max_opacity = .3}, volumes, 3, &lights);
    size_t weakened = 0;
    aim_at_volumes(&rays);
    ask(lighting, (nebel_trace_desc){0}, &rays, ALL_GROUPS, &limited);
    ask(lighting, (nebel_trace_desc){.ignore_max_opacity = 1}, &rays, ALL_GROUPS, &whole);
    assert_true(nebel_get_max_opacity(nebel_get_lighting_snapshot(lighting)) == .3);
    assert_sum(&limited);
    for (int i = 0; i < RAYS; i++)
        for (int c = 0; c < 3; c++) {
            const double opacity = 1 - (double)whole.transmittance[c][i], factor = fmin(.3 / opacity, 1);
            weakened += factor < 1;
            for (int g = 0; g < GROUPS; g++) {
                const double wanted = factor * (double)whole.group[g][c][i];
                assert_true(fabs((double)limited.group[g][c][i] - wanted) <= 2e-6);
            }
        }
    assert_true(weakened > RAYS);
    nebel_release_lighting(lighting);
}

/* Elements apart, gaps as they were, no whole, no rays. */
static void planes_may_be_apart_or_missing(void **state)
{
    (void)state;
    static light packed, apart, alone, empty;
    ray_planes rays;
    for (int is_diffuse = 0; is_diffuse < 2; is_diffuse++) {
        nebel_lighting_desc lights = all_lights();
        if (is_diffuse) lights.diffusion = &few_cells;
        nebel_lighting *lighting = fog_light(&lights, volumes, 3);
        aim_at_volumes(&rays);
        ask(lighting, fine, &rays, ALL_GROUPS, &packed);
        clear(&apart, STRIDE);
        assert_int_equal(try_groups(lighting, fine, &rays, RAYS - 1, ALL_GROUPS, 1, 1, &apart), NEBEL_OK);
        clear(&alone, 1);
        assert_int_equal(try_groups(lighting, fine, &rays, RAYS, ALL_GROUPS, 0, 1, &alone), NEBEL_OK);
        assert_memory_equal(alone.group, packed.group, sizeof packed.group);
        assert_true(alone.whole[0][0] == untouched);
        for (int g = 0; g < GROUPS; g++)
            for (int c = 0; c < 3; c++)
                for (int i = 0; i < STRIDE * RAYS; i++) {
                    const int is_ray = i % STRIDE == 0 && i / STRIDE < RAYS - 1;
                    assert_true(apart.group[g][c][i] == (is_ray ? packed.group[g][c][i / STRIDE] : untouched));
                }
        clear(&empty, 1);
        assert_int_equal(try_groups(lighting, fine, &rays, 0, ALL_GROUPS, 1, 1, &empty), NEBEL_OK);
        assert_true(empty.group[0][0][0] == untouched && empty.whole[0][0] == untouched);
        nebel_release_lighting(lighting);
    }
}

/* Endless light is told of, and of which ray, whatever groups are asked for. */
static void faults_are_those_of_the_whole(void **state)
{
    (void)state;
    static light found;
    ray_planes rays;
    const nebel_lighting_desc lights = all_lights();
    const nebel_volume_desc glow = {.emission = {.1, .1, .1}};
    nebel_lighting *lighting = fog_light(&lights, (nebel_volume_desc[]){glow, volumes[0]}, 2);
    aim_at_volumes(&rays);
    for (int i = 0; i < RAYS; i++) rays.t_max[i] = i == 13 ? HUGE_VALF : 10;
    for (int mask = 0; mask <= ALL_GROUPS; mask += ALL_GROUPS) {
        size_t failed = 99;
        clear(&found, 1);
        assert_int_equal(
            try_groups(lighting, (nebel_trace_desc){.failed_ray = &failed}, &rays, RAYS, mask, 1, 0, &found),
            NEBEL_ERROR_UNBOUNDED);
        assert_int_equal(failed, 13);
        rays.way[0][5] = NAN;
        assert_int_equal(
            try_groups(lighting, (nebel_trace_desc){.failed_ray = &failed}, &rays, RAYS, mask, 1, 0, &found),
            NEBEL_ERROR_ARGUMENT);
        assert_int_equal(failed, 5);
        rays.way[0][5] = 0;
    }
    nebel_release_lighting(lighting);
}

static void lost_memory_is_survived(void **state)
{
    (void)state;
    static light found, wanted;
    ray_planes rays;
    const nebel_lighting_desc lights = all_lights();
    aim_at_volumes(&rays);
    for (size_t in_a_row = 1; in_a_row <= 1000; in_a_row *= 1000) {
        fog_memory memory = {.live = 0};
        const nebel_fog_desc desc = {.host.allocator = fog_memory_allocator(&memory)};
        nebel_lighting *lighting = fog_commit_lit(&desc, volumes, 3, &lights);
        const size_t live = memory.live;
        nebel_result result = NEBEL_ERROR_MEMORY;
        size_t k = 0;
        ask(lighting, fine, &rays, ALL_GROUPS & ~(7 << 6), &wanted);
        while (result != NEBEL_OK) {
            memory.fail_first = ++k;
            memory.fail_count = in_a_row;
            clear(&found, 1);
            result = try_groups(lighting, fine, &rays, RAYS, ALL_GROUPS & ~(7 << 6), 1, 1, &found);
            memory.fail_first = 0;
            assert_true(result == NEBEL_OK || result == NEBEL_ERROR_MEMORY);
            assert_int_equal(memory.live, live);
        }
        assert_true(k > 1);
        assert_memory_equal(&found, &wanted, sizeof found);
        nebel_release_lighting(lighting);
        assert_int_equal(memory.live, 0);
    }
}

/* ---- another sun, and bounds ----------------------------------------------------------------- */

static void another_sun_takes_the_place_of_the_first(void **state)
{
    (void)state;
    static light first, other;
    ray_planes rays;
    nebel_lighting_desc lights = all_lights();
    nebel_snapshot *snapshot = fog_commit(&(nebel_fog_desc){0}, volumes, 3);
    aim_at_volumes(&rays);
    nebel_lighting *lighting = light_fog(snapshot, &lights);
    lights.sun = suns[1];
    lights.previous = lighting;
    nebel_lighting *bright = light_fog(snapshot, &lights);
    nebel_release_snapshot(snapshot); /* both live on */
    ask(lighting, fine, &rays, ALL_GROUPS, &first);
    nebel_release_lighting(lighting);
    ask(bright, fine, &rays, ALL_GROUPS, &other);
    assert_sum(&other);
    for (int i = 0; i < RAYS; i++)
        for (int c = 0; c < 3; c++) {
            const double ratio = suns[1].irradiance[c] / suns[0].irradiance[c], may = (double)other.error[i];
            const float *sun = first.group[NEBEL_LIGHT_GROUP_SUN][c], *more = other.group[NEBEL_LIGHT_GROUP_SUN][c];
            assert_true(first.transmittance[c][i] == other.transmittance[c][i]);
            assert_true(fabs((double)more[i] - ratio * (double)sun[i]) <= may + ratio * (double)first.error[i]);
            for (int g = NEBEL_LIGHT_GROUP_ENVIRONMENT; g < GROUPS; g++)
                assert_true(fabs((double)first.group[g][c][i] - (double)other.group[g][c][i]) <= may);
        }
    nebel_release_lighting(bright);
}

static void bounds_are_of_fog_that_scatters(void **state)
{
    (void)state;
    nebel_bounds b;
    nebel_snapshot *snapshot = fog_commit(&(nebel_fog_desc){0}, volumes, 3);
    const double middle[3] = {0, 2, -8};
    for (uint32_t flags = 0; flags <= NEBEL_BOUNDS_WITHOUT_LEVEL_FOG; flags++) {
        assert_int_equal(nebel_get_scattering_bounds(snapshot, flags, &b), 1);
        for (int c = 0; c < 3; c++)
            assert_true(fabs(b.min[c] - middle[c] + 6) < 1e-6 && fabs(b.max[c] - middle[c] - 6) < 1e-6);
    }
    nebel_release_snapshot(snapshot);
    snapshot = fog_commit(&(nebel_fog_desc){0}, volumes + 1, 2);
    assert_int_equal(nebel_get_scattering_bounds(snapshot, NEBEL_BOUNDS_WITHOUT_LEVEL_FOG, &b), 0);
    assert_int_equal(nebel_get_scattering_bounds(snapshot, 0, &b), 0);
    nebel_release_snapshot(snapshot);
    nebel_volume_desc level = volumes[0], bent;
    level.shape = (nebel_shape){.type = NEBEL_SHAPE_WORLD};
    bent = level;
    bent.density =
        (nebel_density){.type = NEBEL_DENSITY_ALTITUDE, .scale_height = 9, .center = {0, -1e6, 0}, .radius = 1e6};
    snapshot = fog_commit(&(nebel_fog_desc){0}, &level, 1);
    assert_int_equal(nebel_get_scattering_bounds(snapshot, NEBEL_BOUNDS_WITHOUT_LEVEL_FOG, &b), 0);
    assert_int_equal(nebel_get_scattering_bounds(snapshot, 0, &b), 1);
    assert_true(b.max[0] == HUGE_VAL && b.min[2] == -HUGE_VAL);
    nebel_release_snapshot(snapshot);
    snapshot = fog_commit(&(nebel_fog_desc){0}, &bent, 1);
    assert_int_equal(nebel_get_scattering_bounds(snapshot, NEBEL_BOUNDS_WITHOUT_LEVEL_FOG, &b), 1);
    assert_true(b.max[0] == HUGE_VAL && b.min[2] == -HUGE_VAL);
    nebel_release_snapshot(snapshot);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(groups_are_those_of_lights_apart),
        cmocka_unit_test(diffused_groups_add_up_beside_bodies),
        cmocka_unit_test(groups_of_voxels),
        cmocka_unit_test(groups_of_crowds),
        cmocka_unit_test(groups_in_shadows_of_surfaces),
        cmocka_unit_test(groups_without_light_are_dark),
        cmocka_unit_test(random_mixtures_add_up),
        cmocka_unit_test(limits_weaken_groups_alike),
        cmocka_unit_test(planes_may_be_apart_or_missing),
        cmocka_unit_test(faults_are_those_of_the_whole),
        cmocka_unit_test(lost_memory_is_survived),
        cmocka_unit_test(another_sun_takes_the_place_of_the_first),
        cmocka_unit_test(bounds_are_of_fog_that_scatters),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
