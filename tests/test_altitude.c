/* Fog that thins out with the altitude above a ball: against quadrature in long double of the formula of its density,
 * along rays of any length and slope, over balls from pebbles to planets. */
#include "fog_help.h"
#include "gauss_rule.h"

#include <float.h>

#define EARTH 6.36e6

/* ---- the truth ------------------------------------------------------------------------------- */

/* A ray, and the fog on it as the description says. */
typedef struct sight {
    const nebel_density *density;
    long double origin[3], direction[3];
} sight;

static sight sight_of(const nebel_density *density, const nebel_ray *ray)
{
    sight s = {.density = density};
    long double square = 0;
    for (int i = 0; i < 3; i++) square += (long double)ray->direction[i] * (long double)ray->direction[i];
    for (int i = 0; i < 3; i++) {
        s.origin[i] = (long double)ray->origin[i] - (long double)density->center[i];
        s.direction[i] = (long double)ray->direction[i] / sqrtl(square);
    }
    return s;
}

static long double dot(const long double a[3], const long double b[3])
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static long double density_at(const sight *s, long double t)
{
    long double place[3];
    for (int i = 0; i < 3; i++) place[i] = s->origin[i] + t * s->direction[i];
    const long double base = (long double)s->density->radius + (long double)s->density->base;
    const long double u = (sqrtl(dot(place, place)) - base) / (long double)s->density->scale_height;
    if (s->density->below == NEBEL_BELOW_CONSTANT && u < 0) return 1;
    return expl(-u);
}

/* Where the ray crosses the ball of a radius, as far from its lowest place; 0 where it does not. */
static long double crossing(const sight *s, long double radius)
{
    const long double rise = dot(s->origin, s->direction);
    const long double square = rise * rise - dot(s->origin, s->origin) + radius * radius;
    return radius > 0 && square > 0 ? sqrtl(square) : 0;
}

static long double between(long double x, long double low, long double high)
{
    return fminl(fmaxl(x, low), high);
}

static long double rule(const sight *s, long double from, long double to)
{
    long double sum = 0;
    for (int n = 0; n < RULE_POINTS; n++)
        sum += rule_weights[n] * density_at(s, (from + to + (to - from) * rule_nodes[n]) / 2);
    return sum * (to - from) / 2;
}

/* Halved until the halves come to the same. */
static long double integrate(const sight *s, long double from, long double to, long double whole, int depth)
{
    const long double middle = (from + to) / 2, left = rule(s, from, middle), right = rule(s, middle, to);
    if (depth == 0 || fabsl(left + right - whole) <= 1e-14L * fabsl(whole)) return left + right;
    return integrate(s, from, middle, left, depth - 1) + integrate(s, middle, to, right, depth - 1);
}

/* One side of the lowest place, from `near` to `far` metres off it: pieces of half a scale height each, 60 of them. */
static long double integrate_side(const sight *s, long double side, long double near, long double far)
{
    const long double scale = (long double)s->density->scale_height, lowest = -dot(s->origin, s->direction);
    const long double square = dot(s->origin, s->origin) - lowest * lowest + near * near;
    const long double level = sqrtl(fmaxl(square, 0));
    long double sum = 0, from = near;
    for (int i = 0; i < 120 && from < far; i++) {
        const long double to = fminl(crossing(s, level + scale * (i + 1) / 2), far);
        const long double a = lowest + side * from, b = lowest + side * to;
        sum += side * integrate(s, a, b, rule(s, a, b), 3);
        from = to;
    }
    return sum;
}

/* The integral of the density up to `end` [m]. */
static long double integral_until(const sight *s, long double end)
{
    const long double lowest = -dot(s->origin, s->direction);
    const long double base = (long double)s->density->radius + (long double)s->density->base;
    const long double deep = s->density->below == NEBEL_BELOW_CONSTANT ? crossing(s, base) : 0;
    const long double first = between(lowest - deep, 0, end), last = between(lowest + deep, 0, end);
    return integrate_side(s, -1, lowest - first, lowest) + (last - first) +
           integrate_side(s, 1, last - lowest, end - lowest);
}

/* ---- fog and rays ---------------------------------------------------------------------------- */

static nebel_density altitude(double radius, double base, double scale_height, nebel_below below)
{
    return (nebel_density){.type = NEBEL_DENSITY_ALTITUDE,
                           .below = below,
                           .base = base,
                           .scale_height = scale_height,
                           .center = {0, -radius, 0},
                           .radius = radius};
}

static double power_of_ten(uint64_t *state, double low, double high)
{
    return pow(10, dice(state, low, high));
}

/* Along the surface, up, down, from within the ball and from far away. */
static nebel_ray random_ray(uint64_t *state, const nebel_density *density)
{
    const double reach = dice(state, 0, 1) < .5 ? density->scale_height : density->radius;
    nebel_ray ray = {.t_max = dice(state, 0, 1) < .3 ? HUGE_VAL : reach * power_of_ten(state, -2, 2)};
    const double down = dice(state, 0, 1) < .3 ? fmin(density->scale_height * 3, density->radius * .9) : 0;
    for (int i = 0; i < 3; i++) ray.direction[i] = dice(state, -1, 1);
    if (dice(state, 0, 1) < .5) ray.direction[1] *= 1e-3;
    ray.origin[0] = dice(state, -1, 1) * reach * power_of_ten(state, -3, 1);
    ray.origin[2] = dice(state, -1, 1) * density->scale_height;
    ray.origin[1] =
        dice(state, -1, 1) < 0 ? -dice(state, 0, 1) * down : density->scale_height * power_of_ten(state, -2, 1);
    return ray;
}

static nebel_volume_desc fog_of(const nebel_density *density, double extinction, double source)
{
    return (nebel_volume_desc){
        .density = *density, .extinction = {extinction, extinction, extinction}, .source = {source, source, source}};
}

static nebel_transfer trace(const nebel_snapshot *fog, nebel_precision precision, const nebel_ray *ray)
{
    nebel_transfer transfer;
    const nebel_trace_desc desc = {.precision = precision};
    assert_int_equal(nebel_trace(fog, &desc, 1, ray, sizeof *ray, &transfer, sizeof transfer), NEBEL_OK);
    return transfer;
}

static void print_ray(const nebel_density *d, const nebel_ray *r)
{
    printf("radius %.17g base %.17g scale height %.17g below %d; %.17g %.17g %.17g  %.17g %.17g %.17g  %.17g\n",
           d->radius, d->base, d->scale_height, (int)d->below, r->origin[0], r->origin[1], r->origin[2],
           r->direction[0], r->direction[1], r->direction[2], r->t_max);
}

/* ---- optical depth --------------------------------------------------------------------------- */

/* The sanitizers make every ray ten times as dear. */
#if defined(__SANITIZE_ADDRESS__)
enum { RAYS = 1500 };
#else
enum { RAYS = 10000 };
#endif

static nebel_density random_density(uint64_t *state)
{
    const double radius = power_of_ten(state, 0, 8);
    const nebel_below below = dice(state, 0, 1) < .5 ? NEBEL_BELOW_GROW : NEBEL_BELOW_CONSTANT;
    const double scale = radius * power_of_ten(state, -6, log10(.0195));
    return altitude(radius, dice(state, -1, 1) * scale, scale, below);
}

/* What the nodes of Chapman's function miss is 4e-9 of the depth, in float as much as its digits lose. */
static void expect_depths(nebel_precision precision, uint64_t seed, double most_error)
{
    uint64_t state = seed;
    double worst = 0, largest_error = 0;
    size_t thick = 0;
    const size_t count = nb_test_count(RAYS);
    for (size_t i = 0; i < count; i++) {
        const nebel_density density = random_density(&state);
        const nebel_ray ray = random_ray(&state, &density);
        const sight s = sight_of(&density, &ray);
        const long double integral = integral_until(&s, fminl((long double)ray.t_max, 1e18L));
        const long double scales = integral / (long double)density.scale_height;
        if (!(scales > 1e-30L && scales < 1e14L && integral < 1e17L)) continue; /* neither clear nor limited */
        const double extinction = (double)(dice(&state, .1, 3) / (double)integral);
        if (!(extinction < NEBEL_MAX_AMOUNT)) continue;
        const nebel_volume_desc volume = fog_of(&density, extinction, 1);
        nebel_snapshot *const fog = fog_commit(&(nebel_fog_desc){0}, &volume, 1);
        const nebel_transfer transfer = trace(fog, precision, &ray);
        const double off = fabs(transfer.transmittance[0] - (double)expl(-(long double)extinction * integral));
        const double dim = fabs(transfer.transmittance[0] + transfer.in_scattering[0] - 1);
        thick++;
        worst = fmax(worst, off / transfer.error);
        largest_error = fmax(largest_error, transfer.error);
        if (off > transfer.error || dim > transfer.error || transfer.error > most_error) {
            print_ray(&density, &ray);
            printf("off %g, source %g, error %g of %g\n", off, dim, transfer.error, transfer.transmittance[0]);
            fail();
        }
        nebel_release_snapshot(fog);
    }
    printf("%zu rays: at most %.2g of the error that is told, which is at most %.2g\n", thick, worst, largest_error);
    assert_in_range(thick, count / 2, count);
}

static void test_depth_in_double(void **state)
{
    (void)state;
    expect_depths(NEBEL_PRECISION_DOUBLE, 1, 1e-8);
}

static void test_depth_in_float(void **state)
{
    (void)state;
    expect_depths(NEBEL_PRECISION_FLOAT, 2, 5e-5);
}

/* ---- what it must be alike ------------------------------------------------------------------- */

/* Over so large a ball that it bends by less than 1e-9 scale heights over ten kilometres, fog is flat. */
static void test_large_balls_are_flat(void **state)
{
    (void)state;
    uint64_t dice_state = 3;
    for (size_t i = 0; i < nb_test_count(4000); i++) {
        const nebel_below below = i % 2 ? NEBEL_BELOW_CONSTANT : NEBEL_BELOW_GROW;
        const double scale = dice(&dice_state, 1, 300), base = dice(&dice_state, -20, 20);
        const nebel_density round = altitude(1e15, base, scale, below);
        nebel_density flat = {.type = NEBEL_DENSITY_HEIGHT, .below = below, .base = base, .scale_height = scale};
        const nebel_volume_desc volumes[2] = {fog_of(&round, .01, .7), fog_of(&flat, .01, .7)};
        nebel_ray ray = {{0, dice(&dice_state, -50, 300), 0}, {1, dice(&dice_state, -1, 1), .3}, 0};
        ray.t_max = dice(&dice_state, 0, 1000);
        nebel_transfer transfers[2];
        for (int k = 0; k < 2; k++) {
            nebel_snapshot *const fog = fog_commit(&(nebel_fog_desc){0}, &volumes[k], 1);
            transfers[k] = trace(fog, NEBEL_PRECISION_DOUBLE, &ray);
            nebel_release_snapshot(fog);
        }
        /* the height of 1e15 m in long double has digits of 6e-5 m */
        assert_true(fog_difference(&transfers[0], &transfers[1]) <= transfers[0].error + transfers[1].error);
        assert_true(transfers[0].error < 3e-2);
    }
}

/* A piece and the rest are the whole, a body and what touches it, too. */
static void test_parts_make_the_whole(void **state)
{
    (void)state;
    uint64_t dice_state = 4;
    const nebel_density mist = altitude(EARTH, 5, 100, NEBEL_BELOW_GROW);
    nebel_volume_desc whole = fog_of(&mist, .002, .5), halves[2] = {whole, whole};
    for (int k = 0; k < 2; k++)
        halves[k].shape = (nebel_shape){.type = NEBEL_SHAPE_HALF_SPACE, .normal = {k ? 1 : -1, 0, 0}};
    nebel_snapshot *const one = fog_commit(&(nebel_fog_desc){0}, &whole, 1);
    nebel_snapshot *const two = fog_commit(&(nebel_fog_desc){0}, halves, 2);
    const nebel_volume_desc turned[2] = {halves[1], halves[0]};
    nebel_snapshot *const again = fog_commit(&(nebel_fog_desc){0}, turned, 2);
    for (size_t i = 0; i < nb_test_count(4000); i++) {
        nebel_ray ray = random_ray(&dice_state, &mist);
        const nebel_precision precision = i % 2 ? NEBEL_PRECISION_FLOAT : NEBEL_PRECISION_DOUBLE;
        const nebel_transfer a = trace(one, precision, &ray), b = trace(two, precision, &ray),
                             c = trace(again, precision, &ray);
        assert_true(fog_difference(&a, &b) <= a.error + b.error);
        assert_memory_equal(&b, &c, sizeof b);
    }
    nebel_release_snapshot(one);
    nebel_release_snapshot(two);
    nebel_release_snapshot(again);
}

/* Mist a metre high, a quarter of the planet away from the origin, hardly changes while the eye moves by millimetres. */
static void test_mist_stands_still(void **state)
{
    (void)state;
    nebel_density mist = altitude(EARTH, 0, 1, NEBEL_BELOW_GROW);
    const nebel_volume_desc volume = fog_of(&mist, .05, 1);
    nebel_snapshot *const fog = fog_commit(&(nebel_fog_desc){0}, &volume, 1);
    double last = 0;
    for (int i = 0; i < 200; i++) {
        const nebel_ray ray = {{EARTH + 2 + 1e-4 * i, -EARTH, 0}, {-1, 3, 1}, 30};
        const nebel_transfer transfer = trace(fog, NEBEL_PRECISION_FLOAT, &ray);
        if (i > 0) assert_true(fabs(transfer.transmittance[0] - last) <= 1e-5);
        last = transfer.transmittance[0];
    }
    nebel_release_snapshot(fog);
}

/* ---- light ----------------------------------------------------------------------------------- */

/* The ray in pieces short enough for the midpoint rule, as Richardson extrapolates it: of each, optical depth by the
 * truth, light per metre and what is between it and the sun. */
static double sunlit(const nebel_density *density, double extinction, const double to_sun[3], double glow,
                     const nebel_ray *ray, double from, double to, int steps)
{
    const sight s = sight_of(density, ray);
    long double sum = 0;
    for (int i = 0; i < steps; i++) {
        const long double h = ((long double)to - (long double)from) / steps, t = (long double)from + h * (i + .5L);
        nebel_ray way = {.t_max = HUGE_VAL};
        for (int c = 0; c < 3; c++) {
            way.origin[c] = (double)(s.origin[c] + t * s.direction[c] + (long double)density->center[c]);
            way.direction[c] = to_sun[c];
        }
        const sight up = sight_of(density, &way);
        const long double depth = integral_until(&s, t) + integral_until(&up, 1e12L);
        sum += h * density_at(&s, t) * expl(-(long double)extinction * depth);
    }
    return glow * extinction * (double)sum;
}

static double extrapolated(const nebel_density *density, double extinction, const double to_sun[3], double glow,
                           const nebel_ray *ray, double from, double to)
{
    const double coarse = sunlit(density, extinction, to_sun, glow, ray, from, to, 500);
    const double fine = sunlit(density, extinction, to_sun, glow, ray, from, to, 1000);
    return fine + (fine - coarse) / 3;
}

static void test_sunlight(void **state)
{
    (void)state;
    /* level, up, down into the fog, and from orbit past the planet's edge */
    static const struct {
        nebel_ray ray;
        double from, to; /* where there is fog */
    } cases[] = {{{{0, 30, 0}, {1, 0, 0}, 2e5}, 0, 2e5},
                 {{{0, 2, 0}, {1, .02, 0}, HUGE_VAL}, 0, 2e5},
                 {{{0, 3000, 0}, {1, -.1, 0}, 2.9e4}, 0, 2.9e4},
                 {{{-2e6, 0, 0}, {1, 0, 0}, HUGE_VAL}, 0, 4e6}};
    const nebel_density mist = altitude(EARTH, 0, 400, NEBEL_BELOW_GROW);
    const double extinction = 2e-5, suns[2][3] = {{.6, .8, 0}, {.999, -.02, 0.04}};
    nebel_volume_desc volume = fog_of(&mist, extinction, 0);
    for (int c = 0; c < 3; c++) volume.albedo[c] = .9;
    for (size_t k = 0; k < 2; k++) {
        nebel_lighting_desc lights = {.sun = {.irradiance = {4, 4, 4}}};
        memcpy(lights.sun.direction, suns[k], sizeof lights.sun.direction);
        nebel_lighting *lighting = fog_light(&lights, &volume, 1);
        for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
            if (!nb_test_tries((i + k) % 2, 2)) continue;
            const double glow = .9 * 4 / (4 * 3.14159265358979323846);
            const double truth =
                extrapolated(&mist, extinction, suns[k], glow, &cases[i].ray, cases[i].from, cases[i].to);
            const nebel_transfer exact = fog_along(lighting, &cases[i].ray);
            const nebel_trace_desc in_float = {.precision = NEBEL_PRECISION_FLOAT};
            nebel_transfer fast;
            fog_trace(lighting, in_float, 1, &cases[i].ray, &fast);
            printf("sun %zu, ray %zu: %.9g, off %.2g in double, %.2g in float, told %.2g\n", k, i, truth,
                   fabs(exact.in_scattering[0] - truth), fabs(fast.in_scattering[0] - truth), exact.error);
            assert_true(fabs(exact.in_scattering[0] - truth) <= exact.error + 1e-6);
            assert_true(fabs(fast.in_scattering[0] - truth) <= fast.error + 1e-6);
            assert_true(exact.error <= .002 && fast.error <= .002);
        }
        nebel_release_lighting(lighting);
    }
}

/* Two fogs of different light over each other: the one case that is integrated in steps. */
static void test_mixed_light(void **state)
{
    (void)state;
    uint64_t dice_state = 6;
    double worst = 0;
    for (size_t i = 0; i < nb_test_count(300); i++) {
        const nebel_below below = i % 2 ? NEBEL_BELOW_CONSTANT : NEBEL_BELOW_GROW;
        const nebel_density low = altitude(EARTH, 0, dice(&dice_state, 20, 2000), below);
        const nebel_density high = altitude(EARTH, 500, dice(&dice_state, 20, 2000), NEBEL_BELOW_CONSTANT);
        const nebel_volume_desc volumes[2] = {fog_of(&low, 3e-5, 1), fog_of(&high, 5e-5, 3)};
        nebel_ray ray = {{0, dice(&dice_state, 1, 4000), 0}, {1, dice(&dice_state, -.02, .02), 0}, 8e4};
        const sight a = sight_of(&low, &ray), b = sight_of(&high, &ray);
        long double sum[2] = {0, 0};
        for (int round = 0; round < 2; round++) {
            const int steps = 1000 << round;
            const long double h = 8e4L / steps;
            long double depth = 0;
            for (int n = 0; n < steps; n++) {
                const long double t = h * (n + .5L), x = 3e-5L * density_at(&a, t), y = 5e-5L * density_at(&b, t);
                sum[round] += h * (x + 3 * y) * expl(-depth - h * (x + y) / 2);
                depth += h * (x + y);
            }
        }
        const double truth = (double)(sum[1] + (sum[1] - sum[0]) / 3);
        nebel_snapshot *const fog = fog_commit(&(nebel_fog_desc){0}, volumes, 2);
        for (int precision = 0; precision < 2; precision++) {
            const nebel_transfer transfer =
                trace(fog, precision ? NEBEL_PRECISION_FLOAT : NEBEL_PRECISION_DOUBLE, &ray);
            const double off = fabs(transfer.in_scattering[0] - truth);
            worst = fmax(worst, off);
            if (off > transfer.error + 2e-6) print_ray(&low, &ray);
            assert_true(off <= transfer.error + 2e-6);
            assert_true(transfer.error <= .006);
        }
        nebel_release_snapshot(fog);
    }
    printf("mixed light is off by at most %.2g\n", worst);
}

/* ---- places and bounds ----------------------------------------------------------------------- */

static void test_places_and_bounds(void **state)
{
    (void)state;
    uint64_t dice_state = 7;
    size_t found = 0;
    const size_t count = nb_test_count(3000);
    for (size_t i = 0; i < count; i++) {
        const nebel_density density = random_density(&dice_state);
        const nebel_volume_desc volume = fog_of(&density, .5, 0);
        nebel_snapshot *const fog = fog_commit(&(nebel_fog_desc){0}, &volume, 1);
        const nebel_ray ray = random_ray(&dice_state, &density);
        const sight s = sight_of(&density, &ray);
        nebel_majorant_segment bound;
        double from = 0;
        for (int piece = 0; piece < 20; piece++) {
            assert_int_equal(nebel_next_majorant(fog, &ray, 1, from, &bound), NEBEL_OK);
            assert_true(bound.end > from);
            const double end = fmin(bound.end, from + 1e3 * density.radius);
            for (int n = 0; n <= 8; n++) {
                const long double t = (long double)from + ((long double)end - (long double)from) * n / 8;
                nebel_sample_point place = {.distance = -1};
                nebel_medium_properties matter;
                for (int c = 0; c < 3; c++)
                    place.position[c] = (double)(s.origin[c] + t * s.direction[c] + (long double)density.center[c]);
                if (fabs(place.position[0]) > 1e14) continue;
                const double truth = (double)fminl(.5L * density_at(&s, t), 5e17L);
                const double digits = 1e-12 + 64 * DBL_EPSILON * (density.radius + (double)t) / density.scale_height;
                assert_int_equal(nebel_sample_medium(fog, 1, &place, sizeof place, &matter, sizeof matter), NEBEL_OK);
                assert_true(fabs(matter.extinction[0] - truth) <= truth * expm1(fmin(digits, 1)) + DBL_MIN);
                assert_true(matter.extinction[0] <= bound.extinction[0] * (1 + digits) || truth < 1e-300);
                found += truth > 1e-3;
            }
            from = bound.end;
            if (!(from < 1e3 * density.radius)) break;
        }
        nebel_release_snapshot(fog);
    }
    assert_in_range(found, 10 * count / 3, 1000 * count / 3);
}

/* ---- what is refused ------------------------------------------------------------------------- */

static void test_bad_numbers(void **state)
{
    (void)state;
    const nebel_density good = altitude(EARTH, 0, 100, NEBEL_BELOW_GROW);
    nebel_density bad[6] = {good, good, good, good, good, good};
    bad[0].radius = 0;
    bad[1].radius = nan("");
    bad[2].scale_height = -1;
    bad[3].base = 4999 - EARTH;
    bad[4].center[2] = HUGE_VAL;
    bad[5].below = (nebel_below)2;
    for (int i = 0; i < 6; i++) {
        fog_messages messages = {0};
        const nebel_fog_desc desc = {.host.log = fog_messages_log(&messages)};
        const nebel_volume_desc volume = fog_of(&bad[i], 1, 0);
        nebel_fog *fog = NULL;
        assert_int_equal(nebel_create_fog(&desc, &fog), NEBEL_OK);
        const nebel_result result = nebel_add_volume(fog, &volume, NULL);
        assert_int_equal(result, i == 5 ? NEBEL_ERROR_ARGUMENT : NEBEL_ERROR_VALUE);
        assert_int_equal(messages.count, 1);
        nebel_destroy_fog(fog);
    }
}

/* From the centre of the ball, and along a ray that goes through it. */
static void test_centre(void **state)
{
    (void)state;
    const nebel_density ball = altitude(2, 1, .05, NEBEL_BELOW_CONSTANT);
    const nebel_volume_desc volume = fog_of(&ball, .25, 0);
    nebel_snapshot *const fog = fog_commit(&(nebel_fog_desc){0}, &volume, 1);
    for (int precision = 0; precision < 2; precision++) {
        const nebel_precision p = precision ? NEBEL_PRECISION_FLOAT : NEBEL_PRECISION_DOUBLE;
        const nebel_ray from_it = {{0, -2, 0}, {1, 0, 0}, HUGE_VAL}, through = {{0, -100, 0}, {0, 1, 0}, HUGE_VAL};
        const nebel_transfer half = trace(fog, p, &from_it), whole = trace(fog, p, &through);
        assert_true(fabs(half.transmittance[0] - exp(-.25 * 3.05)) <= half.error);
        assert_true(fabs(whole.transmittance[0] - exp(-.25 * 6.1)) <= whole.error);
        assert_true(half.error < 1e-5 && whole.error < 1e-5);
    }
    nebel_release_snapshot(fog);
}

int main(void)
{
    make_rule();
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_depth_in_double),      cmocka_unit_test(test_depth_in_float),
        cmocka_unit_test(test_large_balls_are_flat), cmocka_unit_test(test_parts_make_the_whole),
        cmocka_unit_test(test_mist_stands_still),    cmocka_unit_test(test_sunlight),
        cmocka_unit_test(test_mixed_light),          cmocka_unit_test(test_places_and_bounds),
        cmocka_unit_test(test_bad_numbers),          cmocka_unit_test(test_centre),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
