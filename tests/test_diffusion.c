/* Multiple scattering by diffusion: layers beside published numbers, energy, furnaces, contracts. With the argument
 * "table" it prints rows of docs/multiple-scattering.md. */
#include "fog_help.h"
#include "random_fog.h"

static uint64_t random_count;
static const double pi = 3.14159265358979323846;

/* ---- fog ------------------------------------------------------------------------------------- */

typedef struct light {
    nebel_phase phase;
    double albedo, cosine; /* of the sun's zenith angle */
} light;

static nebel_volume_desc volume_of(const light *l, double extinction)
{
    return (nebel_volume_desc){.extinction = {extinction, extinction, extinction},
                               .albedo = {l->albedo, l->albedo, l->albedo},
                               .phase = l->phase};
}

static nebel_lighting_desc lights_of(const light *l, const nebel_diffusion_desc *diffusion)
{
    return (nebel_lighting_desc){
        .sun = {.direction = {-sqrt(1 - l->cosine * l->cosine), l->cosine, 0}, .irradiance = {1, 1, 1}},
        .diffusion = diffusion};
}

static nebel_lighting *commit(const light *l, const nebel_volume_desc *volume, const nebel_diffusion_desc *diffusion)
{
    const nebel_lighting_desc lights = lights_of(l, diffusion);
    return fog_light(&lights, volume, 1);
}

/* From 0 to 1 m, without an end to the sides. */
static nebel_volume_desc layer_of(const light *l, double depth)
{
    static const nebel_plane planes[] = {{{0, 1, 0}, 1}, {{0, -1, 0}, 0}};
    nebel_volume_desc volume = volume_of(l, depth);
    volume.shape = (nebel_shape){.type = NEBEL_SHAPE_CONVEX, .planes = planes, .plane_count = 2};
    return volume;
}

/* ---- flux ------------------------------------------------------------------------------------ */

enum { COSINES = 24, TURNS = 48 };

/* Gauss's rule on 0 to 1, by Newton's method on the Legendre polynomial. */
static void find_rule(double nodes[COSINES], double weights[COSINES])
{
    for (int i = 0; i < COSINES; i++) {
        double x = cos(pi * (i + .75) / (COSINES + .5)), slope = 1;
        for (int k = 0; k < 30; k++) {
            double value = 1, before = 0;
            for (int j = 0; j < COSINES; j++) {
                const double next = ((2 * j + 1) * x * value - j * before) / (j + 1);
                before = value;
                value = next;
            }
            slope = COSINES * (x * value - before) / (x * x - 1);
            x -= value / slope;
        }
        nodes[i] = (1 + x) / 2;
        weights[i] = 1 / ((1 - x * x) * slope * slope);
    }
}

/* What leaves a layer upwards at `height`, or downwards, of the sun's flux there. Light is the same on both sides of the
 * plane that the sun is in. */
static double flux_at(const nebel_lighting *lighting, const light *l, double height, int down)
{
    double nodes[COSINES], weights[COSINES], sum = 0;
    find_rule(nodes, weights);
    for (int i = 0; i < COSINES; i++) {
        nebel_ray rays[TURNS];
        nebel_transfer out[TURNS];
        const double sine = sqrt(1 - nodes[i] * nodes[i]);
        for (int k = 0; k < TURNS; k++) {
            const double angle = pi * (k + .5) / TURNS;
            rays[k] = (nebel_ray){
                {0, height, 0}, {sine * cos(angle), down ? nodes[i] : -nodes[i], sine * sin(angle)}, HUGE_VAL};
        }
        const nebel_trace_desc desc = {.precision = NEBEL_PRECISION_FLOAT, .tolerance = 1e-4};
        fog_trace(lighting, desc, TURNS, rays, out);
        for (int k = 0; k < TURNS; k++)
            sum += weights[i] * nodes[i] * 2 * pi / TURNS * out[k].in_scattering[1] / l->cosine;
    }
    return sum;
}

/* ---- layers ---------------------------------------------------------------------------------- */

typedef struct layer {
    const char *phase;
    light light;
    double depth, reflected, transmitted; /* of the sun's flux, the latter without what comes through unscattered */
} layer;

#define ISOTROPIC                                                                                                      \
    {                                                                                                                  \
        .type = NEBEL_PHASE_ISOTROPIC                                                                                  \
    }
#define RAYLEIGH                                                                                                       \
    {                                                                                                                  \
        .type = NEBEL_PHASE_RAYLEIGH                                                                                   \
    }
#define FORWARD(number)                                                                                                \
    {                                                                                                                  \
        .type = NEBEL_PHASE_HENYEY_GREENSTEIN, .g = number                                                             \
    }

/* By adding and doubling, good to the last digit: two programs, by that and by discrete ordinates, agree. */
static const layer layers[] = {
    {"isotropic", {ISOTROPIC, 1, .5}, .1, .09104, .09023},      {"isotropic", {ISOTROPIC, 1, .5}, 1, .49838, .36629},
    {"isotropic", {ISOTROPIC, 1, 1}, 1, .34133, .29079},        {"isotropic", {ISOTROPIC, 1, .5}, 10, .89825, .10175},
    {"isotropic", {ISOTROPIC, .9, .5}, 1, .39366, .27950},      {"isotropic", {ISOTROPIC, .9, 1}, 1, .26741, .22375},
    {"Rayleigh", {RAYLEIGH, 1, .6}, .5, .29645, .26895},        {"Rayleigh", {RAYLEIGH, 1, .2}, 1, .64920, .34406},
    {"Rayleigh", {RAYLEIGH, 1, 1}, 1, .34047, .29165},          {"HG .75", {FORWARD(.75), .9, 1}, 2, .09739, .52562},
    {"HG .75", {FORWARD(.75), 1, 1}, 1, .07874, .55338},        {"HG .75", {FORWARD(.75), 1, 1}, 8, .50641, .49325},
    {"HG .85", {FORWARD(.85), 1, .5}, 1, .16488, .69979},       {"HG .85", {FORWARD(.85), 1, .5}, 10, .60403, .39597},
    {"HG .85", {FORWARD(.85), 1, .8660254}, 30, .73760, .26240}};

enum { LAYERS = sizeof layers / sizeof *layers };

typedef struct fluxes {
    double reflected, transmitted;
} fluxes;

static fluxes measure(const layer *l, const nebel_diffusion_desc *diffusion)
{
    const nebel_volume_desc volume = layer_of(&l->light, l->depth);
    nebel_lighting *lighting = commit(&l->light, &volume, diffusion);
    const fluxes found = {flux_at(lighting, &l->light, 1.5, 0), flux_at(lighting, &l->light, -.5, 1)};
    nebel_release_lighting(lighting);
    return found;
}

static nebel_diffusion_desc by_default;

static void print_layers(void)
{
    printf("| phase | albedo | optical depth | cosine of the sun's zenith | R | one scattering | diffusion | T | one "
           "scattering | diffusion |\n|---|---|---|---|---|---|---|---|---|---|\n");
    for (int i = 0; i < LAYERS; i++) {
        const layer *l = &layers[i];
        const fluxes once = measure(l, NULL), all = measure(l, &by_default);
        printf("| %s | %g | %g | %.3g | %.3f | %+.3f | %+.3f | %.3f | %+.3f | %+.3f |\n", l->phase, l->light.albedo,
               l->depth, l->light.cosine, l->reflected, once.reflected - l->reflected, all.reflected - l->reflected,
               l->transmitted, once.transmitted - l->transmitted, all.transmitted - l->transmitted);
    }
}

/* The model's errors, as measured, and little room: up to .037 of the sun's flux, .014 rms. One scattering is off by up to
 * .7. */
#define MOST_OFF .04
#define MOST_RMS .02

static void test_layers_are_near_published_ones(void **unused)
{
    (void)unused;
    double square = 0, once = 0;
    for (int i = 0; i < LAYERS; i++) {
        const layer *l = &layers[i];
        const fluxes all = measure(l, &by_default), single = measure(l, NULL);
        const double off[2] = {all.reflected - l->reflected, all.transmitted - l->transmitted};
        for (int k = 0; k < 2; k++) {
            assert_true(fabs(off[k]) < MOST_OFF);
            square += off[k] * off[k] / (2 * LAYERS);
        }
        once += (single.reflected - l->reflected) * (single.reflected - l->reflected) / LAYERS;
    }
    assert_true(sqrt(square) < MOST_RMS);
    assert_true(sqrt(once) > .25);
}

static void test_white_layers_keep_the_suns_light(void **unused)
{
    (void)unused;
    for (int i = 0; i < LAYERS; i++) {
        const layer *l = &layers[i];
        if (l->light.albedo < 1) continue;
        const fluxes all = measure(l, &by_default);
        assert_true(fabs(all.reflected + all.transmitted + exp(-l->depth / l->light.cosine) - 1) < MOST_OFF);
    }
}

/* Chandrasekhar's half spaces: what comes back of the sun's flux, 1 - H sqrt(1 - albedo). */
static const struct {
    double albedo, cosine, reflected;
} spaces[] = {{.5, .5, .160144},  {.9, .5, .507939},  {.9, 1, .414947},
              {.99, .5, .815140}, {.999, 1, .912835}, {1, 1, 1}};

/* ---- ambient light --------------------------------------------------------------------------- */

static nebel_lighting *commit_under(const nebel_environment *sky, const nebel_volume_desc *volume,
                                    const nebel_diffusion_desc *diffusion)
{
    return fog_light(&(nebel_lighting_desc){.environment = *sky, .diffusion = diffusion}, volume, 1);
}

/* In-scattering of a ray down through a layer that is lit from everywhere alike. */
static double seen_in_even_light(const layer *l, const nebel_diffusion_desc *diffusion)
{
    static const nebel_environment even = {.radiance = {1, 1, 1}};
    const nebel_volume_desc volume = layer_of(&l->light, l->depth);
    nebel_lighting *lighting = commit_under(&even, &volume, diffusion);
    const nebel_ray ray = {{0, 2, 0}, {sqrt(1 - l->light.cosine * l->light.cosine), -l->light.cosine, 0}, HUGE_VAL};
    const nebel_transfer out = fog_along(lighting, &ray);
    nebel_release_lighting(lighting);
    return out.in_scattering[0];
}

/* Light goes the same ways back: what a layer scatters to the eye of light from everywhere is what it scatters anywhere of
 * light that comes from the eye, both fluxes of the published numbers. */
static void test_layers_in_even_light_are_near_published_ones(void **unused)
{
    (void)unused;
    for (int i = 0; i < LAYERS; i++) {
        const layer *l = &layers[i];
        const double truth = l->reflected + l->transmitted;
        const double off = seen_in_even_light(l, &by_default) - truth, undimmed = seen_in_even_light(l, NULL) - truth;
        /* White ones are exact but for the numbers' last digit. */
        assert_true(fabs(off) < (l->light.albedo < 1 ? .025 : 2e-4));
        assert_true(l->light.albedo == 1 || undimmed > .07);
    }
}

/* The half spaces above in even light, which they show by what comes back of the sun's; undimmed they show their albedo. */
static void test_endless_depth_in_even_light(void **unused)
{
    (void)unused;
    static const nebel_environment even = {.radiance = {1, 1, 1}};
    for (size_t i = 0; i < sizeof spaces / sizeof *spaces; i++) {
        const light l = {.albedo = spaces[i].albedo, .cosine = spaces[i].cosine};
        nebel_volume_desc volume = volume_of(&l, .3);
        volume.shape = (nebel_shape){.type = NEBEL_SHAPE_HALF_SPACE, .point = {3, 20, 4}, .normal = {0, 1, 0}};
        nebel_lighting *lighting = commit_under(&even, &volume, &by_default);
        const nebel_ray ray = {{0, 21, 0}, {sqrt(1 - l.cosine * l.cosine), -l.cosine, 0}, HUGE_VAL};
        const nebel_transfer out = fog_along(lighting, &ray);
        nebel_release_lighting(lighting);
        assert_true(fabs(out.in_scattering[0] - spaces[i].reflected) < .02);
    }
}

/* ---- height fog ------------------------------------------------------------------------------ */

/* Level fog knows optical depth alone: height fog above black ground reflects as a layer of that depth does. */
static void test_height_fog_reflects_as_a_layer(void **unused)
{
    (void)unused;
    for (int i = 0; i < LAYERS; i += 3) {
        const layer *l = &layers[i];
        nebel_volume_desc volume = volume_of(&l->light, l->depth / 50);
        volume.density = (nebel_density){.type = NEBEL_DENSITY_HEIGHT, .base = 7, .scale_height = 50};
        const nebel_diffusion_desc on_ground = {.has_ground = 1, .ground_height = 7};
        nebel_lighting *lighting = commit(&l->light, &volume, &on_ground);
        /* Fog below the ground would add to what rays see; they end there, as at a surface. */
        double nodes[COSINES], weights[COSINES], sum = 0;
        find_rule(nodes, weights);
        for (int k = 0; k < COSINES * TURNS; k++) {
            const double cosine = nodes[k / TURNS], sine = sqrt(1 - cosine * cosine),
                         angle = pi * (k % TURNS + .5) / TURNS;
            const nebel_ray ray = {{0, 2000, 0}, {sine * cos(angle), -cosine, sine * sin(angle)}, 1993 / cosine};
            nebel_transfer out;
            const nebel_trace_desc desc = {.precision = NEBEL_PRECISION_FLOAT};
            fog_trace(lighting, desc, 1, &ray, &out);
            sum += weights[k / TURNS] * cosine * 2 * pi / TURNS * out.in_scattering[0] / l->light.cosine;
        }
        nebel_release_lighting(lighting);
        assert_true(fabs(sum - l->reflected) < MOST_OFF);
    }
}

static void test_endless_depth(void **unused)
{
    (void)unused;
    for (size_t i = 0; i < sizeof spaces / sizeof *spaces; i++) {
        const light l = {.albedo = spaces[i].albedo, .cosine = spaces[i].cosine};
        nebel_volume_desc volume = volume_of(&l, .3);
        volume.shape = (nebel_shape){.type = NEBEL_SHAPE_HALF_SPACE, .point = {3, 20, 4}, .normal = {0, 1, 0}};
        nebel_lighting *lighting = commit(&l, &volume, &by_default);
        const double off = flux_at(lighting, &l, 21, 0) - spaces[i].reflected;
        nebel_release_lighting(lighting);
        assert_true(fabs(off) < MOST_OFF);
    }
}

/* What fog of these albedos of the ground adds to the flux upwards, above it: no more light than there is. */
static void test_ground_reflects(void **unused)
{
    (void)unused;
    const light l = {.albedo = 1, .cosine = .7};
    const nebel_volume_desc volume = layer_of(&l, 2);
    double back[3];
    for (int k = 0; k < 3; k++) {
        const double albedo = k / 2.;
        const nebel_diffusion_desc on_ground = {.has_ground = 1, .ground_albedo = {albedo, albedo, albedo}};
        nebel_lighting *lighting = commit(&l, &volume, &on_ground);
        back[k] = flux_at(lighting, &l, 2, 0);
        nebel_release_lighting(lighting);
    }
    assert_true(back[0] + .05 < back[1] && back[1] + .05 < back[2]);
    assert_true(back[2] < 1);
}

/* ---- furnaces, and what stays as it is ------------------------------------------------------- */

static const light white = {.phase = {.type = NEBEL_PHASE_HENYEY_GREENSTEIN, .g = .8}, .albedo = 1, .cosine = .6};

static nebel_volume_desc ball(const light *l, double extinction)
{
    nebel_volume_desc volume = volume_of(l, extinction);
    volume.shape = (nebel_shape){.type = NEBEL_SHAPE_SPHERE, .center = {1, 2, 3}, .radius = 2};
    return volume;
}

enum { RAYS = 150 };

static void set_rays(nebel_ray rays[RAYS])
{
    for (int i = 0; i < RAYS; i++)
        rays[i] = (nebel_ray){{9, 2 + .02 * i, -4}, {-8, .03 * i - 2, 7 + .01 * i}, i % 5 ? HUGE_VAL : .2 * i};
}

static void trace_some(const nebel_lighting *lighting, const nebel_trace_desc *desc, size_t count, nebel_transfer *to)
{
    nebel_ray rays[RAYS];
    set_rays(rays);
    fog_trace(lighting, *desc, count, rays, to);
}

static void trace(const nebel_lighting *lighting, const nebel_trace_desc *desc, nebel_transfer transfers[RAYS])
{
    trace_some(lighting, desc, RAYS, transfers);
}

static void test_white_fog_under_a_white_sky_is_white(void **unused)
{
    (void)unused;
    nebel_transfer transfers[RAYS];
    const nebel_volume_desc volume = ball(&white, 3);
    nebel_lighting *lighting = commit_under(&(nebel_environment){.radiance = {1, 1, 1}}, &volume, &by_default);
    trace(lighting, &(nebel_trace_desc){0}, transfers);
    for (int i = 0; i < RAYS; i++)
        for (int c = 0; c < 3; c++)
            assert_true(fabs(transfers[i].transmittance[c] + transfers[i].in_scattering[c] - 1) < 1e-9);
    nebel_release_lighting(lighting);
}

/* The same where the lattice is solved: nothing says beforehand that a gradient is even. White ground sends back what a sky
 * below it would. */
static void test_white_fog_over_white_ground_is_white(void **unused)
{
    (void)unused;
    static const nebel_environment sky = {
        .type = NEBEL_ENVIRONMENT_GRADIENT, .zenith = {2, 2, 2}, .horizon = {2, 2, 2}, .ground = {2, 2, 2}};
    const nebel_diffusion_desc on_ground = {.has_ground = 1, .ground_albedo = {1, 1, 1}};
    const nebel_volume_desc level = layer_of(&white, 5), body = ball(&white, 3);
    const nebel_volume_desc *volumes[] = {&level, &body};
    for (int k = 0; k < 2; k++) {
        nebel_lighting *lighting = commit_under(&sky, volumes[k], &on_ground);
        nebel_transfer transfers[RAYS];
        trace(lighting, &(nebel_trace_desc){0}, transfers);
        for (int i = 0; i < RAYS; i++)
            for (int c = 0; c < 3; c++)
                assert_true(fabs(2 * transfers[i].transmittance[c] + transfers[i].in_scattering[c] - 2) < 1e-6);
        nebel_release_lighting(lighting);
    }
}

static void test_transmittance_stays_and_light_is_added(void **unused)
{
    (void)unused;
    const nebel_volume_desc volume = ball(&white, 3);
    nebel_lighting *once = commit(&white, &volume, NULL), *all = commit(&white, &volume, &by_default);
    nebel_transfer transfers[2][RAYS];
    double more = 0;
    trace(once, &(nebel_trace_desc){0}, transfers[0]);
    trace(all, &(nebel_trace_desc){0}, transfers[1]);
    for (int i = 0; i < RAYS; i++)
        for (int c = 0; c < 3; c++) {
            assert_true(transfers[0][i].transmittance[c] == transfers[1][i].transmittance[c]);
            assert_true(transfers[0][i].in_scattering[c] <= transfers[1][i].in_scattering[c]);
            more = fmax(more, transfers[1][i].in_scattering[c] - transfers[0][i].in_scattering[c]);
        }
    assert_true(more > .03);
    nebel_release_lighting(once);
    nebel_release_lighting(all);
}

static void assert_same_bits(const nebel_lighting *lighting)
{
    nebel_transfer first[RAYS], other[RAYS];
    nebel_ray rays[RAYS];
    nebel_trace_desc desc = {.precision = NEBEL_PRECISION_FLOAT, .isa = NEBEL_ISA_SCALAR};
    const size_t count = nb_test_count(RAYS) > 34 ? nb_test_count(RAYS) : 34;
    set_rays(rays);
    trace_some(lighting, &desc, count, first);
    for (int isa = 0; isa < NEBEL_ISA_COUNT; isa++) {
        if (!nebel_isa_available((nebel_isa)isa)) continue;
        desc.isa = (nebel_isa)isa;
        trace_some(lighting, &desc, count, other);
        assert_memory_equal(first, other, count * sizeof *first);
        for (size_t i = 0; i < count; i += 7) {
            if (!nb_test_tries(i / 7, count / 7 + 1)) continue;
            const size_t n = count - i < 7 ? count - i : 7;
            fog_trace(lighting, desc, n, &rays[i], &other[i]);
        }
        assert_memory_equal(first, other, count * sizeof *first);
    }
    trace_some(lighting, &(nebel_trace_desc){0}, count, other);
    for (size_t i = 0; i < count; i++) assert_true(fog_difference(&first[i], &other[i]) < 1e-3);
}

static void test_same_bits_for_every_isa_and_split(void **unused)
{
    (void)unused;
    nebel_volume_desc volume = ball(&white, 3);
    volume.extinction[1] = 2;
    volume.albedo[2] = .9;
    nebel_lighting *lighting = commit(&white, &volume, &by_default);
    assert_same_bits(lighting);
    nebel_release_lighting(lighting);
}

/* ---- own light ------------------------------------------------------------------------------- */

/* A ball of fog that scatters all light, in the dark, with a point light or a fire in its middle. */
static nebel_lighting *commit_glowing(double g, const nebel_light *point_light, const nebel_volume_desc *fire)
{
    nebel_volume_desc volumes[2] = {{.shape = {.type = NEBEL_SHAPE_SPHERE, .radius = 1},
                                     .extinction = {5, 5, 5},
                                     .albedo = {1, 1, 1},
                                     .phase = {.type = NEBEL_PHASE_HENYEY_GREENSTEIN, .g = g}}};
    const nebel_lighting_desc lights = {
        .lights = point_light, .light_count = point_light != NULL, .diffusion = &by_default};
    if (fire != NULL) volumes[1] = *fire;
    return fog_light(&lights, volumes, fire != NULL ? 2 : 1);
}

/* What goes out along z, W/sr: radiance over the ball's area. Straight light of a point light is no fog's. */
static void find_intensity(const nebel_lighting *lighting, double intensity[3])
{
    enum { SIDE = 40, SMALL_SIDE = 20 };
    const int side = nb_test_count(SIDE) > SMALL_SIDE ? (int)nb_test_count(SIDE) : SMALL_SIDE;
    for (int c = 0; c < 3; c++) intensity[c] = 0;
    for (int i = 0; i < side * side; i++) {
        const double x = 2. * (i % side + .5) / side - 1, y = 2. * ((int)(i / side) + .5) / side - 1;
        const nebel_ray ray = {{x, y, 3}, {0, 0, -1}, 6};
        const nebel_transfer seen = fog_along(lighting, &ray);
        for (int c = 0; c < 3; c++) intensity[c] += seen.in_scattering[c] * 4 / (side * side);
    }
}

static const nebel_light green = {.intensity = {0, 2, 1}, .radius = .004};
static const nebel_volume_desc fire = {.shape = {.type = NEBEL_SHAPE_SPHERE, .radius = .3}, .emission = {3, 1, 0}};

/* White fog sends out all that begins in it; as it is around its middle, the same to everywhere. */
static void test_white_fog_keeps_own_light(void **unused)
{
    (void)unused;
    for (int k = 0; k < 4; k++) {
        if (!nb_test_tries((size_t)(k % 2 + k / 2) % 2, 2)) continue;
        const double g = k % 2 ? .85 : 0, volume = 4 * 3.14159265358979323846 / 3 * .027;
        nebel_lighting *lighting = commit_glowing(g, k < 2 ? &green : NULL, k < 2 ? NULL : &fire);
        const double straight = k < 2 ? exp(-5) : 0;
        double intensity[3];
        find_intensity(lighting, intensity);
        for (int c = 0; c < 3; c++) {
            const double all = k < 2 ? green.intensity[c] * (1 - straight) : fire.emission[c] * volume;
            assert_true(fabs(intensity[c] - all) <= .06 * all);
        }
        nebel_release_lighting(lighting);
    }
}

static void test_own_light_of_several_colours_adds(void **unused)
{
    (void)unused;
    nebel_lighting *both = commit_glowing(.85, &green, &fire);
    nebel_lighting *one = commit_glowing(.85, &green, NULL), *other = commit_glowing(.85, NULL, &fire);
    double sum[3], first[3], second[3];
    find_intensity(both, sum);
    find_intensity(one, first);
    find_intensity(other, second);
    for (int c = 0; c < 3; c++) assert_true(fabs(sum[c] - first[c] - second[c]) < .03 * sum[c]);
    assert_same_bits(both);
    nebel_lighting *const made[] = {both, one, other};
    for (int k = 0; k < 3; k++) nebel_release_lighting(made[k]);
}

/* Fog between the eye and the lattice dims what comes from there: a wall of soot. */
static void test_fog_before_the_lattice_dims(void **unused)
{
    (void)unused;
    static const nebel_volume_desc soot = {.shape = {.type = NEBEL_SHAPE_BOX, .min = {-2, -2, 2}, .max = {2, 2, 2.5}},
                                           .extinction = {2, 2, 2}};
    for (int k = 0; k < 2; k++) {
        if (!nb_test_tries((size_t)k, 2)) continue;
        nebel_lighting *clear = commit_glowing(k ? .85 : 0, &green, NULL),
                       *dimmed = commit_glowing(k ? .85 : 0, &green, &soot);
        double before[3], behind[3];
        find_intensity(clear, before);
        find_intensity(dimmed, behind);
        assert_true(fabs(behind[1] / before[1] / exp(-1) - 1) < 1e-3);
        nebel_release_lighting(clear);
        nebel_release_lighting(dimmed);
    }
}

/* A finer lattice is no other light. */
static void test_cells_do_not_matter_much(void **unused)
{
    (void)unused;
    const nebel_volume_desc volume = ball(&white, 3);
    nebel_transfer transfers[2][RAYS];
    for (int k = 0; k < 2; k++) {
        nebel_lighting *lighting = commit(&white, &volume, &(nebel_diffusion_desc){.max_cells = k ? 65536 : 8000});
        trace(lighting, &(nebel_trace_desc){0}, transfers[k]);
        nebel_release_lighting(lighting);
    }
    for (int i = 0; i < RAYS; i++) assert_true(fog_difference(&transfers[0][i], &transfers[1][i]) < .01);
}

/* Fog without an end, and a body in it. */
static void test_bodies_in_height_fog(void **unused)
{
    (void)unused;
    const nebel_diffusion_desc on_ground = {.has_ground = 1};
    const nebel_lighting_desc lights = lights_of(&white, &on_ground);
    nebel_volume_desc volumes[] = {volume_of(&white, .02), ball(&white, 1)};
    volumes[0].density = (nebel_density){.type = NEBEL_DENSITY_HEIGHT, .scale_height = 20};
    nebel_lighting *alone = fog_light(&lights, volumes, 1), *both = fog_light(&lights, volumes, 2);
    nebel_transfer transfers[2][2];
    /* One ray through the body, one far from it. */
    const nebel_ray rays[] = {{{1, 2, 40}, {0, 0, -1}, 60}, {{500, 2, 40}, {0, 0, -1}, 60}};
    fog_trace(alone, (nebel_trace_desc){0}, 2, rays, transfers[0]);
    fog_trace(both, (nebel_trace_desc){0}, 2, rays, transfers[1]);
    assert_true(transfers[1][0].in_scattering[0] > transfers[0][0].in_scattering[0] + .01);
    assert_true(fabs(transfers[1][1].in_scattering[0] / transfers[0][1].in_scattering[0] - 1) < .05);
    nebel_release_lighting(alone);
    nebel_release_lighting(both);
}

/* ---- bad input ------------------------------------------------------------------------------- */

static void test_bad_descriptions(void **unused)
{
    (void)unused;
    const nebel_volume_desc volume = ball(&white, 1);
    nebel_snapshot *snapshot = fog_commit(&(nebel_fog_desc){0}, &volume, 1);
    nebel_lighting *lighting = NULL;
    static const nebel_diffusion_desc bad[] = {{.max_cells = 1},
                                               {.max_cells = NEBEL_MAX_DIFFUSION_CELLS + 1},
                                               {.has_ground = 1, .ground_height = HUGE_VAL},
                                               {.has_ground = 1, .ground_height = -2e15},
                                               {.has_ground = 1, .ground_albedo = {0, 1.5, 0}},
                                               {.has_ground = 1, .ground_albedo = {0, 0, -.1}}};
    for (size_t i = 0; i < sizeof bad / sizeof *bad; i++) {
        const nebel_lighting_desc lights = lights_of(&white, &bad[i]);
        assert_int_equal(nebel_create_lighting(snapshot, &lights, &lighting), NEBEL_ERROR_VALUE);
        assert_null(lighting);
    }
    nebel_release_snapshot(snapshot);
}

static void assert_refused(const nebel_volume_desc *volume, double max_opacity, const char *word)
{
    fog_messages said = {0};
    const nebel_fog_desc desc = {.host.log = fog_messages_log(&said), .max_opacity = max_opacity};
    const nebel_lighting_desc lights = {.sun = {.direction = {0, 1, 0}, .irradiance = {1, 1, 1}},
                                        .diffusion = &by_default};
    nebel_snapshot *snapshot = fog_commit(&desc, volume, 1);
    nebel_lighting *lighting = NULL;
    assert_int_equal(nebel_create_lighting(snapshot, &lights, &lighting), NEBEL_ERROR_UNSUPPORTED);
    assert_null(lighting);
    assert_int_equal(said.count, 1);
    assert_non_null(strstr(said.text, word));
    nebel_release_snapshot(snapshot);
}

static void test_what_diffusion_cannot_do_is_refused(void **unused)
{
    (void)unused;
    nebel_volume_desc volume = ball(&white, 1);
    assert_refused(&volume, .5, "max_opacity");
    volume.cutoff = 9;
    assert_refused(&volume, 0, "fog[0].start, cutoff");
    volume = volume_of(&white, 1);
    volume.shape = (nebel_shape){.type = NEBEL_SHAPE_HALF_SPACE, .normal = {1, 1, 0}};
    assert_refused(&volume, 0, "fog[0]: is endless along x");
}

/* Fog that no light comes out of, or no light gets into, is no error. */
static void test_fog_without_light(void **unused)
{
    (void)unused;
    nebel_volume_desc volumes[] = {volume_of(&white, 1), ball(&white, 0), ball(&white, 1e6), ball(&white, 1e-9)};
    for (size_t i = 0; i < sizeof volumes / sizeof *volumes; i++) {
        nebel_lighting *lighting = commit(&white, &volumes[i], &by_default);
        nebel_transfer all[RAYS];
        trace(lighting, &(nebel_trace_desc){0}, all);
        for (int k = 0; k < RAYS; k++) assert_true(all[k].in_scattering[0] >= 0 && all[k].in_scattering[0] < 2);
        nebel_release_lighting(lighting);
    }
}

/* Whatever fog there is: it is refused, or light is a number. */
static void test_random_fog(void **unused)
{
    (void)unused;
    static random_fog fog;
    size_t lit = 0;
    for (uint64_t seed = 0; seed < random_count; seed++) {
        nebel_lighting *lighting = NULL;
        uint64_t numbers = seed;
        random_fog_make(&fog, (random_fog_kind)(seed % RANDOM_FOG_KIND_COUNT), seed);
        random_fog_light(&fog, &numbers);
        const nebel_diffusion_desc few = {.max_cells = 1000, .has_ground = seed % 3 == 0, .ground_albedo = {.5, .5, 1}};
        const nebel_light point_light = {
            .position = {.1, .2, .3}, .intensity = {3, 2, 1}, .radius = (double)(seed % 3)};
        const nebel_lighting_desc lights = {
            .sun = {.direction = {.3, (double)(seed % 7) / 3 - 1, -.2}, .irradiance = {3, 2, 1}},
            .lights = &point_light,
            .light_count = seed % 2 == 0,
            .diffusion = &few};
        nebel_snapshot *snapshot = fog_commit(&(nebel_fog_desc){0}, fog.volumes, fog.count);
        const nebel_result result = nebel_create_lighting(snapshot, &lights, &lighting);
        assert_true(result == NEBEL_OK || result == NEBEL_ERROR_UNSUPPORTED);
        for (uint64_t i = 0; i < 20 && result == NEBEL_OK; i++) {
            nebel_transfer out;
            const nebel_ray ray = random_fog_ray(&fog, i);
            const nebel_trace_desc in_float = {.lighting = lighting, .precision = NEBEL_PRECISION_FLOAT};
            const nebel_result traced = nebel_trace(snapshot, &in_float, 1, &ray, sizeof ray, &out, sizeof out);
            if (traced == NEBEL_ERROR_UNBOUNDED) continue;
            assert_int_equal(traced, NEBEL_OK);
            for (int c = 0; c < 3; c++) assert_true(out.in_scattering[c] >= 0 && isfinite(out.in_scattering[c]));
            lit += out.in_scattering[0] > 0;
        }
        nebel_release_snapshot(snapshot);
        nebel_release_lighting(lighting);
    }
    assert_true(lit > random_count);
}

/* Rays and fog at the limits of places. */
static void test_far_away(void **unused)
{
    (void)unused;
    nebel_volume_desc haze = volume_of(&white, 1e-15), far = ball(&white, 1e-13);
    haze.density = (nebel_density){.type = NEBEL_DENSITY_HEIGHT, .scale_height = 1e14};
    far.shape.radius = 1e14;
    const nebel_volume_desc *volumes[] = {&haze, &far};
    for (int k = 0; k < 2; k++) {
        const nebel_diffusion_desc few = {.max_cells = 1000, .has_ground = !k};
        nebel_lighting *lighting = commit(&white, volumes[k], &few);
        for (int i = 0; i < 60; i++) {
            const double at = NEBEL_MAX_LENGTH * (i % 2 ? 1 : .9999);
            const nebel_ray ray = {{i % 3 ? at : 0, i % 5 ? 2e13 : -at, i % 4 ? -at : 3},
                                   {i % 7 - 3, i % 11 ? .01 : -1, i % 13 - 6.5},
                                   HUGE_VAL};
            const nebel_transfer out = fog_along(lighting, &ray);
            assert_true(out.in_scattering[0] >= 0 && isfinite(out.in_scattering[0]));
        }
        nebel_release_lighting(lighting);
    }
}

/* Point lights at the limits of places, of light and of size. */
static void test_lights_far_away(void **unused)
{
    (void)unused;
    static const nebel_light far[] = {
        {.position = {NEBEL_MAX_LENGTH, -NEBEL_MAX_LENGTH, 0}, .intensity = {1e9, 1e9, 0}, .radius = 1e6},
        {.position = {0, 1, 0}, .intensity = {1e9, 0, 0}},
        {NEBEL_LIGHT_SPOT, {3, NEBEL_MAX_LENGTH, 3}, {1, 1, 1}, .direction = {0, -1, 0}, .outer_angle = 1e-6}};
    nebel_volume_desc volumes[] = {volume_of(&white, 1e-15), volume_of(&white, .5), ball(&white, 3)};
    volumes[1].density = (nebel_density){.type = NEBEL_DENSITY_HEIGHT, .scale_height = 2};
    for (size_t i = 0; i < 3 * sizeof volumes / sizeof *volumes; i++) {
        const nebel_diffusion_desc few = {.max_cells = 1000, .has_ground = i < 3};
        nebel_lighting_desc lights = lights_of(&white, &few);
        nebel_transfer transfers[RAYS];
        lights.lights = far;
        lights.light_count = i % 3 + 1;
        nebel_lighting *lighting = fog_light(&lights, &volumes[i / 3], 1);
        trace(lighting, &(nebel_trace_desc){0}, transfers);
        for (int k = 0; k < RAYS; k++)
            for (int c = 0; c < 3; c++)
                assert_true(transfers[k].in_scattering[c] >= 0 && isfinite(transfers[k].in_scattering[c]));
        nebel_release_lighting(lighting);
    }
}

static void test_memory_runs_out(void **unused)
{
    (void)unused;
    fog_memory memory = {0};
    nebel_result result = NEBEL_ERROR_MEMORY;
    const nebel_volume_desc volume = ball(&white, 1);
    const nebel_diffusion_desc few = {.max_cells = 512};
    const nebel_lighting_desc lights = {.sun = {.direction = {0, 1, 0}, .irradiance = {1, 1, 1}},
                                        .lights = &green,
                                        .light_count = 1,
                                        .diffusion = &few};
    nebel_snapshot *snapshot =
        fog_commit(&(nebel_fog_desc){.host.allocator = fog_memory_allocator(&memory)}, &volume, 1);
    const size_t live = memory.live;
    size_t tries = 0;
    while (result == NEBEL_ERROR_MEMORY) {
        nebel_lighting *lighting = NULL;
        memory.fail_first = ++tries;
        memory.fail_count = 1;
        result = nebel_create_lighting(snapshot, &lights, &lighting);
        assert_true(result == NEBEL_ERROR_MEMORY ? lighting == NULL && memory.live == live : result == NEBEL_OK);
        nebel_release_lighting(lighting);
    }
    assert_int_equal(memory.live, live);
    assert_true(tries > 20);
    memory.fail_first = 0;
    nebel_release_snapshot(snapshot);
}

/* The first argument: another number of random fogs. */
int main(int argc, char **argv)
{
    if (argc > 1 && strcmp(argv[1], "table") == 0) {
        print_layers();
        return 0;
    }
    random_count = argc > 1 ? strtoull(argv[1], NULL, 10) : RANDOM_FOG_KIND_COUNT + nb_test_count(19) - 1;
    by_default.max_cells = nb_test_count(2) < 2 ? 8000 : 0; /* 0: as many as there are */
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_layers_are_near_published_ones),
                                       cmocka_unit_test(test_white_layers_keep_the_suns_light),
                                       cmocka_unit_test(test_height_fog_reflects_as_a_layer),
                                       cmocka_unit_test(test_endless_depth),
                                       cmocka_unit_test(test_ground_reflects),
                                       cmocka_unit_test(test_white_fog_under_a_white_sky_is_white),
                                       cmocka_unit_test(test_white_fog_over_white_ground_is_white),
                                       cmocka_unit_test(test_layers_in_even_light_are_near_published_ones),
                                       cmocka_unit_test(test_endless_depth_in_even_light),
                                       cmocka_unit_test(test_transmittance_stays_and_light_is_added),
                                       cmocka_unit_test(test_same_bits_for_every_isa_and_split),
                                       cmocka_unit_test(test_white_fog_keeps_own_light),
                                       cmocka_unit_test(test_own_light_of_several_colours_adds),
                                       cmocka_unit_test(test_fog_before_the_lattice_dims),
                                       cmocka_unit_test(test_lights_far_away),
                                       cmocka_unit_test(test_cells_do_not_matter_much),
                                       cmocka_unit_test(test_bodies_in_height_fog),
                                       cmocka_unit_test(test_bad_descriptions),
                                       cmocka_unit_test(test_what_diffusion_cannot_do_is_refused),
                                       cmocka_unit_test(test_fog_without_light),
                                       cmocka_unit_test(test_far_away),
                                       cmocka_unit_test(test_random_fog),
                                       cmocka_unit_test(test_memory_runs_out)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
