/* Slabs of cloud by adding and doubling (van de Hulst, A New Look at Multiple Scattering, 1963; Grant and Hunt, Discrete Space
 * Theory of Radiative Transfer, 1969): what a slab sends back and lets through is found from that of its halves, beginning
 * with one so thin that it scatters once. Directions are those of Gauss's rule on each half of the sphere; around the normal
 * light is a sum of cosines, each with slabs of its own. */
#include "cloud_slab.h"

#include "math/gauss_rule.h"

#include <math.h>
#include <string.h>

#define PI 3.14159265358979323846

enum { STREAMS = 8, SUNS = NB_SLAB_SUNS, ORDERS = NB_SLAB_ORDERS, DEPTHS = NB_SLAB_DEPTHS };

/* Of what comes through: under a low sun a peak of fewer moments is so wide that half of it leads out of a thin slab. */
enum { THROUGH_ORDERS = 16 };

/* Scaled depths of the table begin here, and from the second on double. */
#define FIRST_DEPTH 0.0625

/* And those of what comes through. */
#define FIRST_THROUGH 0x1p-8

/* Down to 0 what is scattered rises by so many times the mean first. */
#define FIRST_RISE 1.6f

/* The thinnest slab: so many times half of that. */
enum { HALVINGS = 22 };

/* Cosines of suns: squares of evenly spread numbers. */
#define FIRST_ROOT 0.14142136

static double root_of(int i, int count)
{
    return FIRST_ROOT + i * (1 - FIRST_ROOT) / (count - 1);
}

/* ---- phase function -------------------------------------------------------------------------- */

/* The integral over the sphere of a color of the phase function held below a cap, by angles that are finer ahead. */
static double capped(const nb_cloud_phase *phase, int color, double cap)
{
    enum { CAP_ANGLES = 512 };
    double sum = 0;
    for (int i = 0; i < CAP_ANGLES; i++) {
        const double part = (i + 0.5) / CAP_ANGLES, angle = PI * part * part, wide = 2 * PI * part / CAP_ANGLES;
        float values[4];
        nb_cloud_phase_at(phase, cos(angle), values);
        sum += 2 * PI * sin(angle) * wide * fmin(cap, (double)values[color]);
    }
    return sum;
}

static double find_cap(const nb_cloud_phase *phase, int color, double part)
{
    double low = 0, high = (double)phase->values[0][color];
    for (int i = 0; i < 30; i++) {
        const double middle = low > 0 ? sqrt(low * high) : 0.25 * high;
        *(capped(phase, color, middle) > part ? &high : &low) = middle;
    }
    return high;
}

/* ---- slabs ----------------------------------------------------------------------------------- */

/* By streams; or by streams and suns, of which there are as many, so that one product serves both. */
typedef struct nb_square {
    double at[STREAMS][STREAMS];
} nb_square;
_Static_assert((int)STREAMS == (int)SUNS, "squares");
_Static_assert((int)THROUGH_ORDERS < (int)NB_CLOUD_PHASE_MOMENTS, "moments");

/* Of a slab and one cosine around the normal: what comes back and goes on by streams, and what the sun's light sends up and
 * down. A slab of even cloud is the same from both sides. */
typedef struct nb_slab_layer {
    nb_square back, on, up, down;
} nb_slab_layer;

/* What all slabs have in common. */
typedef struct nb_slab_solver {
    int orders;
    double moments[THROUGH_ORDERS]; /* of the scaled phase function, so many */
    double cosines[STREAMS], weights[STREAMS], suns[SUNS];
    /* Of the order m of a cosine around the normal: Legendre's functions of streams up, and of sunlight, which goes down; the latter
     * without the m-th power of the sine. */
    double stream[THROUGH_ORDERS][STREAMS], sun[THROUGH_ORDERS][SUNS];
    nb_slab_layer layers[DEPTHS];
} nb_slab_solver;

/* Legendre's functions of the degrees m to orders - 1 at x; the square of each has the mean 1 / (2 l + 1) over the sphere, where
 * `power` is the m-th power of the sine. */
static void legendre(int m, int orders, double x, double power, double values[THROUGH_ORDERS])
{
    for (int k = 1; k <= m; k++) power *= sqrt((2 * k - 1.0) / (2 * k));
    for (int l = 0; l < m; l++) values[l] = 0;
    values[m] = power;
    if (m + 1 < orders) values[m + 1] = sqrt(2 * m + 1.0) * x * power;
    for (int l = m + 2; l < orders; l++)
        values[l] = ((2 * l - 1) * x * values[l - 1] - sqrt((l - 1.0) * (l - 1) - m * m) * values[l - 2]) /
                    sqrt((double)l * l - m * m);
}

static void set_functions(int m, nb_slab_solver *solver)
{
    double values[THROUGH_ORDERS];
    for (int i = 0; i < STREAMS; i++) {
        const double x = solver->cosines[i];
        legendre(m, solver->orders, x, pow(1 - x * x, 0.5 * m), values);
        for (int l = 0; l < solver->orders; l++) solver->stream[l][i] = values[l];
    }
    for (int k = 0; k < SUNS; k++) {
        legendre(m, solver->orders, -solver->suns[k], 1, values);
        for (int l = 0; l < solver->orders; l++) solver->sun[l][k] = values[l];
    }
}

/* What a function's sign becomes from up to down. */
static double turned(int l, int m)
{
    return (l - m) % 2 ? -1 : 1;
}

static void set_thin(const nb_slab_solver *solver, int m, double depth, nb_slab_layer *thin)
{
    memset(thin, 0, sizeof *thin);
    for (int i = 0; i < STREAMS; i++) {
        const double way = depth / solver->cosines[i];
        for (int l = m; l < solver->orders; l++) {
            const double sent = way * (2 * l + 1) * solver->moments[l] * solver->stream[l][i], sign = turned(l, m);
            for (int j = 0; j < STREAMS; j++) {
                const double part = 0.5 * sent * solver->stream[l][j] * solver->weights[j];
                thin->on.at[i][j] += part;
                thin->back.at[i][j] += sign * part;
            }
            for (int k = 0; k < SUNS; k++) {
                const double part = (m == 0 ? 1 : 2) / (4 * PI) * sent * solver->sun[l][k];
                thin->up.at[i][k] += part;
                thin->down.at[i][k] += sign * part;
            }
        }
        thin->on.at[i][i] += 1 - way;
    }
}

static void add_product(const nb_square *a, const nb_square *b, nb_square *sum)
{
    for (int i = 0; i < STREAMS; i++)
        for (int k = 0; k < STREAMS; k++)
            for (int j = 0; j < STREAMS; j++) sum->at[i][j] += a->at[i][k] * b->at[k][j];
}

/* a becomes 1 / (1 - a), by Gauss and Jordan. No pivots: light that goes to and fro between two slabs becomes less. */
static void sum_powers(nb_square *a)
{
    nb_square left;
    for (int i = 0; i < STREAMS; i++)
        for (int j = 0; j < STREAMS; j++) {
            left.at[i][j] = (i == j) - a->at[i][j];
            a->at[i][j] = i == j;
        }
    for (int k = 0; k < STREAMS; k++) {
        const double pivot = 1 / left.at[k][k];
        for (int j = 0; j < STREAMS; j++) {
            left.at[k][j] *= pivot;
            a->at[k][j] *= pivot;
        }
        for (int i = 0; i < STREAMS; i++) {
            const double times = left.at[i][k];
            if (i == k) continue;
            for (int j = 0; j < STREAMS; j++) {
                left.at[i][j] -= times * left.at[k][j];
                a->at[i][j] -= times * a->at[k][j];
            }
        }
    }
}

/* What sunlight has left behind a depth. */
static nb_square dimmed(const nb_slab_solver *solver, const nb_square *light, double depth)
{
    nb_square left;
    for (int k = 0; k < SUNS; k++) {
        const double part = exp(-depth / solver->suns[k]);
        for (int i = 0; i < STREAMS; i++) left.at[i][k] = light->at[i][k] * part;
    }
    return left;
}

/* Light between two slabs, the upper one of which is so deep; `echo`: the sum of ways to and fro between them. */
static void find_between(const nb_slab_solver *solver, const nb_slab_layer *above, double depth,
                         const nb_slab_layer *below, const nb_square *echo, nb_square *down, nb_square *up)
{
    nb_square first = above->down;
    *up = dimmed(solver, &below->up, depth);
    add_product(&above->back, up, &first);
    *down = (nb_square){{{0}}};
    add_product(echo, &first, down);
    add_product(&below->back, down, up);
}

static nb_square find_echo(const nb_slab_layer *above, const nb_slab_layer *below)
{
    nb_square echo = {{{0}}};
    add_product(&above->back, &below->back, &echo);
    sum_powers(&echo);
    return echo;
}

/* A slab becomes one of twice the depth. */
static void double_up(const nb_slab_solver *solver, double depth, nb_slab_layer *layer)
{
    const nb_square echo = find_echo(layer, layer);
    nb_slab_layer twice = {.back = layer->back, .up = layer->up, .down = dimmed(solver, &layer->down, depth)};
    nb_square down, up, on = {{{0}}}, back = {{{0}}};
    find_between(solver, layer, depth, layer, &echo, &down, &up);
    add_product(&layer->on, &up, &twice.up);
    add_product(&layer->on, &down, &twice.down);
    add_product(&echo, &layer->on, &on);
    add_product(&layer->on, &on, &twice.on);
    add_product(&layer->back, &on, &back);
    add_product(&layer->on, &back, &twice.back);
    *layer = twice;
}

/* ---- the table ------------------------------------------------------------------------------- */

static double depth_of(int i)
{
    return i == 0 ? 0 : ldexp(FIRST_DEPTH, i - 1);
}

static void set_solver(const nb_cloud_phase *phase, int orders, nb_slab_solver *solver)
{
    const nb_gauss_rule rule = nb_gauss_rule_make(STREAMS);
    const double straight = phase->moments[orders];
    solver->orders = orders;
    for (int l = 0; l < orders; l++) solver->moments[l] = (phase->moments[l] - straight) / (1 - straight);
    for (int i = 0; i < STREAMS; i++) {
        solver->cosines[i] = 0.5 + 0.5 * rule.nodes[i];
        solver->weights[i] = 0.5 * rule.weights[i];
    }
    for (int k = 0; k < SUNS; k++) solver->suns[k] = pow(root_of(k, SUNS), 2);
}

static void set_slab_layers(int m, nb_slab_solver *solver)
{
    double depth = ldexp(FIRST_DEPTH, -HALVINGS);
    nb_slab_layer layer;
    set_thin(solver, m, 0, &solver->layers[0]);
    set_thin(solver, m, depth, &layer);
    for (int i = 1, step = 0; i < DEPTHS; step++, depth *= 2) {
        if (step >= HALVINGS) solver->layers[i++] = layer;
        double_up(solver, depth, &layer);
    }
}

/* Legendre's functions by those that nb_slab_source adds up, without the power of the sine. */
static void find_scales(int m, double scales[THROUGH_ORDERS])
{
    double before = 0, plain = 1;
    legendre(m, ORDERS, 1, 1, scales);
    for (int l = m; l < ORDERS; l++) {
        scales[l] /= plain;
        const double next = ((2 * l + 1) * plain - (l + m) * before) / (l + 1 - m);
        before = plain;
        plain = next;
    }
}

/* Coefficients of the degrees m to ORDERS - 1 lie one behind the other, those of m = 0 first. */
static void set_source(const nb_slab_solver *solver, int m, int first, nb_slab *slab)
{
    double scales[THROUGH_ORDERS];
    find_scales(m, scales);
    for (int a = 0; a < DEPTHS; a++)
        for (int b = 0; b < DEPTHS; b++) {
            const nb_slab_layer *above = &solver->layers[a], *below = &solver->layers[b];
            const nb_square echo = find_echo(above, below);
            nb_square down, up;
            find_between(solver, above, depth_of(a), below, &echo, &down, &up);
            for (int l = m; l < ORDERS; l++)
                for (int k = 0; k < SUNS; k++) {
                    double sum = 0;
                    for (int i = 0; i < STREAMS; i++)
                        sum += solver->weights[i] * solver->stream[l][i] * (up.at[i][k] + turned(l, m) * down.at[i][k]);
                    const int at = first + l - m;
                    slab->source[a][b][k][at / 4][at % 4] =
                        (float)(0.5 * (2 * l + 1) * solver->moments[l] * scales[l] * sum);
                }
        }
}

/* Depths that are not powers of 2, by slabs of their own; every second sun. */
static void set_half_of_through(nb_slab_solver *solver, int half, nb_slab *slab)
{
    for (int k = 0; k < SUNS; k++) solver->suns[k] = pow(root_of(2 * k + half, NB_SLAB_THROUGH_SUNS), 2);
    set_functions(0, solver);
    for (int n = 0; n < NB_SLAB_FINER; n++) {
        double depth = FIRST_THROUGH * exp2((double)n / NB_SLAB_FINER - HALVINGS);
        nb_slab_layer layer;
        set_thin(solver, 0, depth, &layer);
        for (int i = n, step = 0; i < NB_SLAB_THROUGH; step++, depth *= 2) {
            if (step >= HALVINGS) {
                for (int k = 0; k < SUNS; k++) {
                    double sum = exp(-depth / solver->suns[k]);
                    for (int s = 0; s < STREAMS; s++)
                        sum += 2 * PI * solver->weights[s] * solver->cosines[s] * layer.down.at[s][k] / solver->suns[k];
                    slab->through[i][2 * k + half] = (float)(1 / sum);
                }
                i += NB_SLAB_FINER;
            }
            double_up(solver, depth, &layer);
        }
    }
}

nb_slab *nb_slab_make(const nebel_allocator *allocator, const nb_cloud_phase *phase)
{
    const double straight = phase->moments[ORDERS];
    nb_slab_solver *solver = nb_allocate(allocator, 1, sizeof *solver);
    nb_slab *slab = nb_allocate(allocator, 1, sizeof *slab);
    if (solver != NULL && slab != NULL) {
        slab->apart = (float)(1 - straight);
        for (int c = 0; c < 3; c++) slab->cap[c] = (float)find_cap(phase, c, 1 - straight);
        slab->through_apart = (float)(1 - phase->moments[THROUGH_ORDERS]);
        set_solver(phase, THROUGH_ORDERS, solver);
        for (int half = 0; half < 2; half++) set_half_of_through(solver, half, slab);
        set_solver(phase, ORDERS, solver);
        for (int m = 0, first = 0; m < ORDERS; first += ORDERS - m, m++) {
            set_functions(m, solver);
            set_slab_layers(m, solver);
            set_source(solver, m, first, slab);
        }
    } else {
        nb_release(allocator, slab);
        slab = NULL;
    }
    nb_release(allocator, solver);
    return slab;
}

/* ---- lookup ---------------------------------------------------------------------------------- */

typedef struct nb_slab_node {
    int low;
    float part;
} nb_slab_node;

/* Of a parabola through three suns, the first of which is the last one that is not higher: nothing jumps. */
typedef struct nb_slab_suns {
    int low;
    float weights[3];
} nb_slab_suns;

static inline nb_slab_suns find_suns(float sun, int count)
{
    const float place = (sqrtf(sun) - (float)FIRST_ROOT) * ((float)(count - 1) / (float)(1 - FIRST_ROOT));
    const float held = fmaxf(0, fminf((float)(count - 1), place));
    const int low = (int)fminf((float)(count - 3), held);
    const float x = held - (float)low;
    return (nb_slab_suns){low, {0.5f * (1 - x) * (2 - x), x * (2 - x), 0.5f * x * (x - 1)}};
}

/* Between depths what is scattered rises as their logarithm does, nearly: log2(1 + x) is x (4 - x) / 3 within 0.006. */
static nb_slab_node depth_node(float depth)
{
    const float times = fminf(depth / (float)FIRST_DEPTH, 1 << (DEPTHS - 2));
    if (!(times >= 1)) return (nb_slab_node){0, fmaxf(0, times) * (FIRST_RISE - (FIRST_RISE - 1) * times)};
    int octave;
    const float part = 2 * frexpf(times, &octave) - 1; /* times = (1 + part) 2^(octave - 1) */
    return octave > DEPTHS - 2 ? (nb_slab_node){DEPTHS - 2, 1} : (nb_slab_node){octave, part * (4 - part) * (1.f / 3)};
}

static const float inverse[ORDERS + 1] = {0, 1, 1.f / 2, 1.f / 3, 1.f / 4, 1.f / 5, 1.f / 6, 1.f / 7, 1.f / 8};

/* The sum of coefficients times functions of the cosine of light to the normal, by their recurrence, and of cosines of the angle
 * around that between light and sunlight, times powers of their sines: `side` is that of the first power. */
static float sum_functions(const float coefficients[NB_SLAB_COEFFICIENTS], float cosine, float side, float sines)
{
    float around = 1, around_next = side, sum = 0;
    for (int m = 0; m < ORDERS; m++) {
        float before = 0, value = 1, part = 0;
        for (int l = m; l < ORDERS; l++) {
            part += *coefficients++ * value;
            const float next = ((float)(2 * l + 1) * cosine * value - (float)(l + m) * before) * inverse[l + 1 - m];
            before = value;
            value = next;
        }
        sum += around * part;
        const float next = 2 * side * around_next - sines * around;
        around = around_next;
        around_next = next;
    }
    return sum;
}

float nb_slab_source(const nb_slab *slab, const nb_slab_place *place)
{
    const nb_slab_node above = depth_node(place->above), below = depth_node(place->below);
    const nb_slab_suns suns = find_suns(place->sun, SUNS);
    nb_slab_four sum[NB_SLAB_COEFFICIENTS / 4] = {{0}};
    float coefficients[NB_SLAB_COEFFICIENTS];
    for (int corner = 0; corner < 4; corner++) {
        const int a = corner & 1, b = corner >> 1;
        const float weight = (a ? above.part : 1 - above.part) * (b ? below.part : 1 - below.part);
        for (int k = 0; k < 3; k++) {
            const nb_slab_four *source = slab->source[above.low + a][below.low + b][suns.low + k];
            for (int i = 0; i < NB_SLAB_COEFFICIENTS / 4; i++) sum[i] += weight * suns.weights[k] * source[i];
        }
    }
    memcpy(coefficients, sum, sizeof coefficients);
    /* Light goes against the ray, and away from the sun. */
    const float side = place->ahead - place->rise * place->sun;
    const float sines = (1 - place->rise * place->rise) * (1 - place->sun * place->sun);
    return fmaxf(0, sum_functions(coefficients, -place->rise, side, fmaxf(0, sines)));
}

/* 1 by what comes through is linear between depths, and beyond the last. */
float nb_slab_through(const nb_slab *slab, float depth, float sun)
{
    static const float steps[NB_SLAB_FINER + 1] = {1, 1.18920712f, 1.41421356f, 1.68179283f, 2};
    const float times = slab->through_apart * depth / (float)FIRST_THROUGH;
    const nb_slab_suns suns = find_suns(sun, NB_SLAB_THROUGH_SUNS);
    float sum = 0, part = fmaxf(0, times);
    int octave, step = NB_SLAB_FINER - 1, low = -1;
    if (!(depth > 0)) return 1; /* to the last bit: where there is no cloud all is as without */
    if (times >= 1) {
        const float mantissa = 2 * frexpf(fminf(times, 0x1p62f), &octave);
        while (mantissa < steps[step]) step--;
        low = (octave - 1) * NB_SLAB_FINER + step;
        part = (mantissa - steps[step]) / (steps[step + 1] - steps[step]);
        if (low > NB_SLAB_THROUGH - 2) {
            const float last = ldexpf(steps[NB_SLAB_FINER - 2], NB_SLAB_OCTAVES - 1);
            low = NB_SLAB_THROUGH - 2;
            part = (times - last) / (ldexpf(steps[NB_SLAB_FINER - 1], NB_SLAB_OCTAVES - 1) - last);
        }
    }
    for (int k = 0; k < 3; k++) {
        const int at = suns.low + k;
        const float from = low < 0 ? 1 : slab->through[low][at], to = slab->through[low + 1][at];
        sum += suns.weights[k] / (from + part * (to - from));
    }
    return fmaxf(0, fminf(1, sum));
}
