/* Skies that need no picture, and what all skies have in common.
 *
 * A gradient is h + a y+ + b y-, y the sine of the elevation, y+ = (|y| + y) / 2 and y- = (|y| - y) / 2. What is linear
 * in y comes out of any convolution times a number. What is left is the mean of |y|: for surfaces a closed form, for a
 * phase function a table over the sine of the elevation of the ray, which all gradients share. */
#include "environment.h"

#include "medium/medium_check.h"
#include "environment_map.h"

#include "math/vector.h"

#include <math.h>
#include <string.h>

#define NB_DOUBLE
#include "formulas/prelude.h"

#include "formulas/elementary.inc"

#define PI 3.14159265358979323846

/* ---- what a sky is made of ------------------------------------------------------------------- */

static nebel_result check_map(const nebel_log *log, const nebel_environment *sky)
{
    if (sky->map == NULL) return nb_fail(log, NEBEL_ERROR_ARGUMENT, "environment: a map must not be NULL");
    if (!(fabs(sky->rotation) <= NEBEL_MAX_ENVIRONMENT_ROTATION))
        return nb_fail(log, NEBEL_ERROR_VALUE, "environment: rotation is %g; must be within -%s and %s degrees",
                       sky->rotation, NB_TEXT(NEBEL_MAX_ENVIRONMENT_ROTATION), NB_TEXT(NEBEL_MAX_ENVIRONMENT_ROTATION));
    if (!(sky->intensity >= 0 && sky->intensity <= NEBEL_MAX_AMOUNT))
        return nb_fail(log, NEBEL_ERROR_VALUE, "environment: intensity is %g; must be within 0 and %s", sky->intensity,
                       NB_TEXT(NEBEL_MAX_AMOUNT));
    double most[3];
    nb_environment_most(sky, most);
    return nb_check_color(log, "environment: intensity times the brightest pixel", most, NEBEL_MAX_AMOUNT);
}

nebel_result nb_check_sky(const nebel_log *log, const nebel_environment *sky)
{
    nebel_result result;
    switch (sky->type) {
    case NEBEL_ENVIRONMENT_CONSTANT:
        return nb_check_color(log, "environment: radiance", sky->radiance, NEBEL_MAX_AMOUNT);
    case NEBEL_ENVIRONMENT_GRADIENT:
        result = nb_check_color(log, "environment: zenith", sky->zenith, NEBEL_MAX_AMOUNT);
        if (result == NEBEL_OK) result = nb_check_color(log, "environment: horizon", sky->horizon, NEBEL_MAX_AMOUNT);
        return result == NEBEL_OK ? nb_check_color(log, "environment: ground", sky->ground, NEBEL_MAX_AMOUNT) : result;
    case NEBEL_ENVIRONMENT_MAP:
        return check_map(log, sky);
    default:
        return nb_fail(log, NEBEL_ERROR_ARGUMENT, "environment: type %d is unknown", (int)sky->type);
    }
}

static double intensity_of(const nebel_environment *sky)
{
    return sky->intensity > 0 ? sky->intensity : 1;
}

void nb_environment_most(const nebel_environment *sky, double most[3])
{
    if (sky->type == NEBEL_ENVIRONMENT_MAP) nb_environment_map_most(sky->map, most);
    for (int c = 0; c < 3; c++) {
        if (sky->type == NEBEL_ENVIRONMENT_MAP) most[c] *= intensity_of(sky);
        if (sky->type == NEBEL_ENVIRONMENT_GRADIENT)
            most[c] = fmax(fmax(sky->zenith[c], sky->ground[c]), sky->horizon[c]);
        if (sky->type == NEBEL_ENVIRONMENT_CONSTANT) most[c] = sky->radiance[c];
    }
}

/* ---- directions ------------------------------------------------------------------------------ */

static nb_environment_rotation turn_of(const nebel_environment *sky)
{
    const double angle = sky->rotation * (PI / 180);
    return (nb_environment_rotation){cos(angle), sin(angle)};
}

/* Into the map's own frame. */
static void turn_to_map(nb_environment_rotation turn, const double direction[3], double turned[3])
{
    turned[0] = direction[0] * turn.cosine - direction[2] * turn.sine;
    turned[1] = direction[1];
    turned[2] = direction[0] * turn.sine + direction[2] * turn.cosine;
}

static void scale_map(const nebel_environment *sky, double light[3])
{
    for (int c = 0; c < 3; c++) light[c] *= intensity_of(sky);
}

/* ---- gradients ------------------------------------------------------------------------------- */

/* Of the means of y and of |y|. */
static void mix_gradient(const nebel_environment *sky, double mean, double rectified, double light[3])
{
    const double above = fmax(0.5 * (rectified + mean), 0), below = fmax(0.5 * (rectified - mean), 0);
    for (int c = 0; c < 3; c++)
        light[c] = fmax(sky->horizon[c] * (1 - above - below) + sky->zenith[c] * above + sky->ground[c] * below, 0);
}

/* The mean of |u c + v cos x| over all x: of |y| over a cone about a direction of elevation sine u, at the cosine c. */
static double mean_over_cone(double c, double u)
{
    const double middle = fabs(u * c), swing = sqrt(fmax((1 - u * u) * (1 - c * c), 0));
    if (middle >= swing) return middle;
    return (2 / PI) * (middle * asin(middle / swing) + sqrt((swing - middle) * (swing + middle)));
}

/* The mean of |y| is an integral over s, the part of the light below a cosine that the lobe has without alpha. */
typedef struct lobe_integral {
    double g, alpha, u;
} lobe_integral;

/* Gauss and Legendre, 16 points: Abramowitz and Stegun, table 25.4. */
static const double gauss_nodes[8] = {0.0950125098376374, 0.2816035507792589, 0.4580167776572274, 0.6178762444026438,
                                      0.7554044083550030, 0.8656312023878318, 0.9445750230732326, 0.9894009349916499};
static const double gauss_weights[8] = {0.1894506104550685, 0.1826034150449236, 0.1691565193950025, 0.1495959888165767,
                                        0.1246289712555339, 0.0951585116824928, 0.0622535239386479, 0.0271524594117541};

/* From a to b, with s = (a + b) / 2 - (b - a) / 2 cos x, in which roots at the ends are smooth. */
static double integrate_piece(const lobe_integral *lobe, double a, double b)
{
    double sum = 0;
    for (int i = 0; i < 16; i++) {
        const double node = i % 2 ? gauss_nodes[i / 2] : -gauss_nodes[i / 2];
        const double x = 0.5 * PI * (1 + node);
        const double s = 0.5 * (a + b) - 0.5 * (b - a) * cos(x);
        const double c = fmin(fmax(nb_phase_cosine_of_part(lobe->g, 2 * s - 1), -1), 1);
        sum += gauss_weights[i / 2] * sin(x) * (1 + lobe->alpha * c * c) * mean_over_cone(c, lobe->u);
    }
    return 0.25 * PI * (b - a) * sum;
}

/* Pieces end where a cone touches the horizon, and double in length away from the back, where the cosine runs fast. */
static double integrate_lobe(const nb_lobe *lobe, double u)
{
    const lobe_integral of = {fabs(lobe->g), lobe->alpha, u};
    const double edge = sqrt(1 - u * u);
    const double kinks[3] = {0.5 + 0.5 * nb_phase_part_of_cosine(of.g, 1 + edge),
                             0.5 + 0.5 * nb_phase_part_of_cosine(of.g, u * u / (1 + edge)), 1};
    double sum = 0, at = 0, step = 1 - of.g;
    for (int i = 0; i < 3; i++) {
        for (; at + step < kinks[i]; at += step, step *= 2) sum += integrate_piece(&of, at, at + step);
        if (kinks[i] > at) sum += integrate_piece(&of, at, kinks[i]);
        at = fmax(at, fmin(kinks[i], 1));
    }
    return lobe->weight * sum / (1 + of.alpha * (1 + 2 * of.g * of.g) / 3);
}

/* Nodes are dense where |y| has its edge, as wide as the sharpest lobe: equal steps of log(1 + u / width). */
static void fill_gradient(nb_environment_filter *filter)
{
    double sharpest = 0;
    for (int i = 0; i < filter->phase.lobe_count; i++) sharpest = fmax(sharpest, fabs(filter->phase.lobes[i].g));
    filter->width = 0.5 * (1 - sharpest);
    filter->mean_cosine = nb_phase_mean_cosine(&filter->phase);
    for (int k = 0; k < NB_SKY_NODES; k++) {
        const double share = (double)k / (NB_SKY_NODES - 1);
        const double u = fmin(filter->width * expm1(share * nb_log1p(1 / filter->width)), 1);
        filter->rectified[k] = 0;
        for (int i = 0; i < filter->phase.lobe_count; i++)
            filter->rectified[k] += integrate_lobe(&filter->phase.lobes[i], u);
    }
}

/* The cubic through the four nearest nodes. */
static double rectified_at(const nb_environment_filter *filter, double u)
{
    const double place = (NB_SKY_NODES - 1) * (nb_log1p(u / filter->width) / nb_log1p(1 / filter->width));
    int first = (int)place - 1;
    first = first < 0 ? 0 : first > NB_SKY_NODES - 4 ? NB_SKY_NODES - 4 : first;
    const double x = place - first, *k = &filter->rectified[first];
    return k[0] * ((x - 1) * (x - 2) * (3 - x) / 6) + k[1] * (x * (x - 2) * (x - 3) / 2) +
           k[2] * (x * (x - 1) * (3 - x) / 2) + k[3] * (x * (x - 1) * (x - 2) / 6);
}

/* Lambert's mean of |y| about a normal; of y it is 2/3 u. From the integral of |n.w| |y| over the sphere, (8 / 3) (sin x
 * + (pi / 2 - x) cos x) at the angle x between normal and vertical. */
static double rectified_by_cosine(double u)
{
    return (4 / (3 * PI)) * (sqrt(fmax(1 - u * u, 0)) + u * asin(u));
}

/* ---- filters --------------------------------------------------------------------------------- */

nb_environment_filter *nb_environment_filter_create(const nebel_allocator *allocator, const nb_phase *phase)
{
    nb_environment_filter *filter = nb_allocate_zero(allocator, 1, sizeof *filter);
    if (filter == NULL) return NULL;
    filter->allocator = *allocator;
    filter->phase = *phase;
    atomic_init(&filter->owners, 1);
    return filter;
}

nb_environment_filter *nb_environment_filter_retain(nb_environment_filter *filter)
{
    atomic_fetch_add_explicit(&filter->owners, 1, memory_order_relaxed);
    return filter;
}

void nb_environment_filter_release(nb_environment_filter *filter)
{
    if (filter == NULL || atomic_fetch_sub_explicit(&filter->owners, 1, memory_order_acq_rel) != 1) return;
    const nebel_allocator allocator = filter->allocator;
    nb_release(&allocator, filter->table.coefficients);
    nb_release(&allocator, filter);
}

nb_environment_filter *nb_environment_filter_make(const nebel_allocator *allocator, const nebel_environment *sky,
                                                  const nb_phase *phase)
{
    if (sky->type == NEBEL_ENVIRONMENT_MAP) return nb_environment_map_filter(sky->map, phase);
    nb_environment_filter *filter = nb_environment_filter_create(allocator, phase);
    if (filter != NULL) fill_gradient(filter);
    return filter;
}

const nb_phase *nb_environment_filter_phase(const nb_environment_filter *filter)
{
    return &filter->phase;
}

nb_environment_light nb_environment_light_of(const nebel_environment *sky, nb_environment_filter *filter)
{
    return (nb_environment_light){sky, filter, turn_of(sky)};
}

void nb_environment_scattered(const nb_environment_light *light, const double direction[3], double radiance[3])
{
    const nb_environment_filter *filter = light->filter;
    if (light->sky->type == NEBEL_ENVIRONMENT_MAP) {
        double turned[3];
        turn_to_map(light->turn, direction, turned);
        nb_environment_map_scattered(&filter->table, turned, radiance);
        scale_map(light->sky, radiance);
    } else {
        const double y = fmin(fmax(direction[1], -1), 1);
        mix_gradient(light->sky, filter->mean_cosine * y, rectified_at(filter, fabs(y)), radiance);
    }
}

/* ---- the public queries ---------------------------------------------------------------------- */

/* Then there is no light. */
static int is_missing(const nebel_environment *environment, const double *direction, double *radiance)
{
    const int has_map = environment != NULL && (environment->type != NEBEL_ENVIRONMENT_MAP || environment->map != NULL);
    if (has_map && direction != NULL && radiance != NULL) return 0;
    if (radiance != NULL) memset(radiance, 0, 3 * sizeof *radiance);
    return 1;
}

void nebel_evaluate_environment(const nebel_environment *environment, const double direction[3], double radiance[3])
{
    if (is_missing(environment, direction, radiance)) return;
    double unit[3] = {direction[0], direction[1], direction[2]}, turned[3];
    if (environment->type == NEBEL_ENVIRONMENT_CONSTANT) {
        memcpy(radiance, environment->radiance, sizeof environment->radiance);
    } else if (!nb_vector_make_unit(unit)) {
        memset(radiance, 0, 3 * sizeof *radiance);
    } else if (environment->type == NEBEL_ENVIRONMENT_GRADIENT) {
        mix_gradient(environment, unit[1], fabs(unit[1]), radiance);
    } else {
        turn_to_map(turn_of(environment), unit, turned);
        nb_environment_map_radiance(environment->map, turned, radiance);
        scale_map(environment, radiance);
    }
}

void nebel_evaluate_environment_diffuse(const nebel_environment *environment, const double normal[3],
                                        double radiance[3])
{
    if (is_missing(environment, normal, radiance)) return;
    double unit[3] = {normal[0], normal[1], normal[2]}, turned[3];
    if (environment->type == NEBEL_ENVIRONMENT_CONSTANT) {
        memcpy(radiance, environment->radiance, sizeof environment->radiance);
    } else if (!nb_vector_make_unit(unit)) {
        memset(radiance, 0, 3 * sizeof *radiance);
    } else if (environment->type == NEBEL_ENVIRONMENT_GRADIENT) {
        const double y = fmin(fmax(unit[1], -1), 1);
        mix_gradient(environment, 2 * y / 3, rectified_by_cosine(fabs(y)), radiance);
    } else {
        turn_to_map(turn_of(environment), unit, turned);
        nb_environment_map_reflected(environment->map, turned, radiance);
        scale_map(environment, radiance);
    }
}
