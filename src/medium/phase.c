#include "phase.h"

#include <math.h>

#define NB_DOUBLE
#include "formulas/prelude.h"

#include "formulas/elementary.inc"
#include "formulas/phase.inc"

#define PI 3.14159265358979323846

const char *nb_phase_fault(const nebel_phase *phase)
{
    if (phase == NULL) return "must not be NULL";
    switch (phase->type) {
    case NEBEL_PHASE_ISOTROPIC:
    case NEBEL_PHASE_RAYLEIGH:
        return NULL;
    case NEBEL_PHASE_DRAINE:
        if (!(phase->alpha >= 0 && phase->alpha <= NEBEL_MAX_ALPHA)) return "phase alpha: must be within 0 and 1e9";
        /* fall through */
    case NEBEL_PHASE_HENYEY_GREENSTEIN:
    case NEBEL_PHASE_CORNETTE_SHANKS:
        return fabs(phase->g) <= NEBEL_MAX_G ? NULL : "phase g: must be within -0.9999 and 0.9999";
    case NEBEL_PHASE_DROPLETS:
        return phase->diameter >= 1e-6 && phase->diameter <= NEBEL_MAX_DROPLET_DIAMETER
                   ? NULL
                   : "phase diameter: must be within 1e-6 and 50 micrometres";
    default:
        return "phase: the type is unknown";
    }
}

static nb_lobe make_lobe(double weight, double g, double alpha)
{
    const double rest = 1 - fabs(g), size = 1 + alpha * (1 + 2 * g * g) / 3;
    const double factor = weight * rest * (1 + fabs(g)) / (4 * PI * size);
    return (nb_lobe){.g = g, .alpha = alpha, .weight = weight, .factor = factor, .peak = rest * rest, .slope = 2 * g};
}

/* Water droplets of one size, averaged over the colours of light. Source of the fits: Jendersie and d'Eon, An
 * Approximate Mie Scattering Function for Fog and Cloud Rendering, 2023: the main one from 5 um on, the supplement's
 * below. They do not quite meet where one ends. */
static nb_phase droplets(double d)
{
    const double l = log(d);
    double g, g_draine, alpha = 250, weight;
    if (d >= 5) {
        g = exp(-0.0990567 / (d - 1.67154));
        g_draine = exp(-2.20679 / (d + 3.91029) - 0.428934);
        alpha = exp(3.62489 - 8.29288 / (d + 5.52825));
        weight = exp(-0.599085 / (d - 0.641583) - 0.665888);
    } else if (d >= 1.5) {
        g = 0.0604931 * log(l) + 0.940256;
        g_draine = 0.500411 - 0.081287 / (-2 * l + tan(l) + 1.27551);
        alpha = 7.30354 * l + 6.31675;
        weight = 0.026914 * (l - cos(5.68947 * (log(l) - 0.0292149))) + 0.376475;
    } else if (d > 0.1) {
        g = 0.862 - 0.143 * l * l;
        const double wave = (l - 0.238604) * (l + 1.00667) / (0.507522 - 0.15677 * l);
        g_draine = 0.379685 * cos(1.19692 * cos(wave) + 1.37932 * l + 0.0625835) + 0.344213;
        weight = 0.146209 * cos(3.38707 * l + 2.11193) + 0.316072 + 0.0778917 * l;
    } else {
        g = 13.8 * d * d;
        g_draine = 1.1456 * d * sin(9.29044 * d);
        weight = 0.252977 - 312.983 * pow(d, 4.3);
    }
    return (nb_phase){{make_lobe(1 - weight, g, 0), make_lobe(weight, g_draine, alpha)}, 2};
}

nb_phase nb_phase_resolve(const nebel_phase *phase)
{
    switch (phase->type) {
    case NEBEL_PHASE_RAYLEIGH:
        return (nb_phase){{make_lobe(1, 0, 1)}, 1};
    case NEBEL_PHASE_HENYEY_GREENSTEIN:
        return (nb_phase){{make_lobe(1, phase->g, 0)}, 1};
    case NEBEL_PHASE_CORNETTE_SHANKS:
        return (nb_phase){{make_lobe(1, phase->g, 1)}, 1};
    case NEBEL_PHASE_DRAINE:
        return (nb_phase){{make_lobe(1, phase->g, phase->alpha)}, 1};
    case NEBEL_PHASE_DROPLETS:
        return droplets(phase->diameter);
    default:
        return (nb_phase){{make_lobe(1, 0, 0)}, 1};
    }
}

static int compare_numbers(double a, double b)
{
    return (a > b) - (a < b);
}

int nb_phase_compare(const nb_phase *a, const nb_phase *b)
{
    int order = a->lobe_count - b->lobe_count;
    for (int i = 0; i < a->lobe_count && order == 0; i++) {
        const nb_lobe *x = &a->lobes[i], *y = &b->lobes[i];
        order = compare_numbers(x->g, y->g);
        if (order == 0) order = compare_numbers(x->alpha, y->alpha);
        if (order == 0) order = compare_numbers(x->weight, y->weight);
    }
    return order;
}

/* ---- value and mean -------------------------------------------------------------------------- */

double nb_phase_at(const nb_phase *phase, double cosine)
{
    const nb_turn turn = {cosine, 1 - cosine, 1 + cosine};
    double sum = 0;
    for (int i = 0; i < phase->lobe_count; i++) {
        const nb_lobe *lobe = &phase->lobes[i];
        sum += nb_phase_lobe(lobe->factor, lobe->alpha, lobe->peak, lobe->slope, turn);
    }
    return sum;
}

double nebel_evaluate_phase(const nebel_phase *phase, double cosine)
{
    if (nb_phase_fault(phase) != NULL || !(fabs(cosine) <= 1)) return (double)NAN;
    const nb_phase resolved = nb_phase_resolve(phase);
    return nb_phase_at(&resolved, cosine);
}

double nb_phase_mean_cosine(const nb_phase *phase)
{
    double mean = 0;
    for (int i = 0; i < phase->lobe_count; i++) {
        const nb_lobe *lobe = &phase->lobes[i];
        const double g2 = lobe->g * lobe->g, alpha = lobe->alpha;
        mean += lobe->weight * lobe->g * (1 + alpha * (3 + 2 * g2) / 5) / (1 + alpha * (1 + 2 * g2) / 3);
    }
    return mean;
}

double nebel_phase_mean_cosine(const nebel_phase *phase)
{
    if (nb_phase_fault(phase) != NULL) return (double)NAN;
    const nb_phase resolved = nb_phase_resolve(phase);
    return nb_phase_mean_cosine(&resolved);
}

/* ---- sampling -------------------------------------------------------------------------------- */

/* The lobe's form without alpha has the part (1 + s) / 2 of its light below this cosine. The inversion of Witt,
 * Multiple Scattering in Reflection Nebulae, 1977, multiplied out, so that nothing cancels where g is small. */
double nb_phase_cosine_of_part(double g, double s)
{
    const double h = 1 + g * s;
    return (s + g * (0.5 * (s * s + 3) + g * (s + 0.5 * g * (s * s - 1)))) / (h * h);
}

/* sqrt(1 + g^2 - 2 g c), g >= 0 */
static double distance_to(double g, double ahead)
{
    return sqrt((1 - g) * (1 - g) + 2 * g * ahead);
}

/* The inverse of nb_phase_cosine_of_part for g >= 0, from 1 - c, counted from the peak for the same reason. */
double nb_phase_part_of_cosine(double g, double ahead)
{
    const double q = distance_to(g, ahead);
    return ((1 - g) * (1 - g) * (2 + g) - 2 * ahead) / (q * (1 - g * g + q));
}

/* The integral of c^2 over the form without alpha, from the cosine -1 on; closed in q = sqrt(1 + g^2 - 2 g c), which
 * loses digits where g is small; there c^2 is as good as a polynomial in s. */
static double square_below(double g, double ahead)
{
    static const double nodes[] = {0.1834346424956498, 0.5255324099163290, 0.7966664774136267, 0.9602898564975363};
    static const double weights[] = {0.3626837833783620, 0.3137066458778873, 0.2223810344533745, 0.1012285362903763};
    if (g > 0.1) {
        const double q = distance_to(g, ahead), last = 1 + g, a = 1 + g * g;
        const double sum = a * a * (1 / q - 1 / last) - 2 * a * (last - q) + (last * last * last - q * q * q) / 3;
        return (1 - g * g) / (8 * g * g * g) * sum;
    }
    const double half = 0.5 * (nb_phase_part_of_cosine(g, ahead) + 1);
    double sum = 0;
    for (int i = 0; i < 8; i++) {
        const double node = i % 2 ? nodes[i / 2] : -nodes[i / 2];
        const double c = nb_phase_cosine_of_part(g, half * (1 + node) - 1);
        sum += weights[i / 2] * c * c;
    }
    return 0.5 * half * sum;
}

/* The part of a lobe's light below the cosine c, for g >= 0. */
static double lobe_below(double g, double alpha, double c)
{
    const double plain = 0.5 * (1 + nb_phase_part_of_cosine(g, 1 - c));
    const double square = alpha > 0 ? square_below(g, 1 - c) : 0;
    return (plain + alpha * square) / (1 + alpha * (1 + 2 * g * g) / 3);
}

static double light_below(const nb_phase *phase, double c)
{
    double sum = 0;
    for (int i = 0; i < phase->lobe_count; i++) {
        const nb_lobe *lobe = &phase->lobes[i];
        const double below =
            lobe->g < 0 ? 1 - lobe_below(-lobe->g, lobe->alpha, -c) : lobe_below(lobe->g, lobe->alpha, c);
        sum += lobe->weight * below;
    }
    return sum;
}

/* Newton's steps, and halving where they leave what is known to hold the root. */
static double invert_light_below(const nb_phase *phase, double part)
{
    double low = -1, high = 1, c = nb_phase_cosine_of_part(phase->lobes[0].g, 2 * part - 1);
    for (int i = 0; i < 100 && high - low > 1e-15; i++) {
        const double over = light_below(phase, c) - part;
        if (over == 0) break;
        *(over > 0 ? &high : &low) = c;
        const double next = c - over / (2 * PI * nb_phase_at(phase, c));
        const double before = c;
        c = next > low && next < high ? next : 0.5 * (low + high);
        if (c == before) break;
    }
    return c;
}

double nebel_sample_phase(const nebel_phase *phase, double part)
{
    if (nb_phase_fault(phase) != NULL || !(part >= 0 && part <= 1)) return (double)NAN;
    const nb_phase resolved = nb_phase_resolve(phase);
    double c;
    if (resolved.lobe_count == 1 && resolved.lobes[0].alpha == 0)
        c = nb_phase_cosine_of_part(resolved.lobes[0].g, 2 * part - 1);
    else
        c = invert_light_below(&resolved, part);
    return fmin(fmax(c, -1), 1);
}
