/* Drops in clouds at many places whose columns are known, compiled once per instruction set: NB_WIDTH at a time. No place's numbers
 * hang on another's, so that all instruction sets agree. */
#define NB_FAST

/* Tables are read lane by lane, whatever the instruction: sixteen lanes gain nothing where five are asked, as often. */
#if defined(NB_ISA_AVX512)
#undef NB_ISA_AVX512
#define NB_ISA_AVX2 1
#endif

#include "cloud_density.h"

#include "formulas/prelude.h"

#include "formulas/elementary.inc"

#include "cloud_kernel_prelude.h"

/* ---- Worley noise --------------------------------------------------------------------------------- */

static inline nb_real load(const float from[], int p)
{
    return nb_load_lanes(from + p);
}

static inline nb_real mix(nb_real a, nb_real b, nb_real part)
{
    return a + part * (b - a);
}

/* How often tables are halved, and the part of the next: levels blend over the last quarter before it. */
typedef struct nb_table {
    nb_real level, low, next;
} nb_table;

static inline nb_table choose_table(nb_real numbers)
{
    const nb_halvings halvings = nb_halve(numbers);
    nb_table table;
    table.level = halvings.whole + halvings.part;
    table.low = nb_min(halvings.whole, nb_splat(NB_WORLEY_LEVELS - 2));
    table.next = nb_clamp(NB_F(4.0) * (table.level - table.low) - NB_F(3.0), NB_F(0.0), NB_F(1.0));
    return table;
}

static inline nb_real read_pair(const nb_cloud_noise *noise, nb_real index, nb_real part)
{
    nb_real behind;
    const nb_real number = nb_gather_pairs(noise->worley, index, &behind);
    return mix(number, behind, part);
}

/* Linear between the eight numbers around a place. */
static inline nb_real read_level(const nb_cloud_noise *noise, const nb_real parts[3], nb_real level)
{
    const nb_real size = nb_scale_pow2(nb_splat(NB_WORLEY_SIZE), -level), row = size + NB_F(2.0);
    nb_real at[3], low[3];
    for (int c = 0; c < 3; c++) {
        const nb_real place = parts[c] * size + NB_F(0.5); /* numbers stand for the middles of their cells */
        low[c] = nb_floor(place);
        at[c] = place - low[c];
    }
    /* Tables have less than 2^24 numbers all together, so that floats count them. */
    const nb_real near = (low[2] * row + low[1]) * row + low[0] + nb_gather(noise->worley_starts, level);
    const nb_real far = near + row * row;
    const nb_real a = read_pair(noise, near, at[0]), b = read_pair(noise, near + row, at[0]);
    const nb_real c = read_pair(noise, far, at[0]), d = read_pair(noise, far + row, at[0]);
    return mix(mix(a, b, at[1]), mix(c, d, at[1]), at[2]);
}

/* 0 to 1, 1 at a feature point. Where they are halved too often all is their mean. */
static inline nb_real read_worley(const nb_cloud_noise *noise, const nb_real parts[3], const nb_table *table)
{
    const nb_mask is_mean = table->level >= nb_splat(NB_WORLEY_LEVELS - 1);
    if (nb_all(is_mean)) return nb_splat(noise->worley_mean);
    nb_real worley = read_level(noise, parts, table->low);
    if (nb_any(table->next > NB_F(0.0)))
        worley = mix(worley, read_level(noise, parts, table->low + NB_F(1.0)), table->next);
    return nb_select(is_mean, nb_splat(noise->worley_mean), worley * nb_splat(1.0f / NB_MAX_WORLEY));
}

/* Each scale's table for widths. Returns the variance that they lose by that. */
static inline nb_real choose_tables(const nb_cloud_noise *noise, const nb_cloud_layer *layer, nb_real width,
                                    nb_table tables[NB_CLOUD_WORLEY_SCALES])
{
    nb_real numbers = width * nb_splat(layer->last_worley), lost = NB_F(0.0);
    for (int k = NB_CLOUD_WORLEY_SCALES - 1; k >= 0; k--) {
        const float weight = nb_worley_weights[k] * nb_worley_weights[k];
        tables[k] = choose_table(numbers);
        lost += nb_splat(weight) * mix(nb_gather(noise->worley_variance, tables[k].low),
                                       nb_gather(noise->worley_variance + 1, tables[k].low), tables[k].next);
        numbers *= NB_F(1.0) / nb_splat(NB_WORLEY_RATIO);
    }
    return lost;
}

/* ---- drops ----------------------------------------------------------------------------------- */

static inline nb_real step_up(nb_real x)
{
    const nb_real u = nb_clamp(x, NB_F(0.0), NB_F(1.0));
    return u * u * (NB_F(3.0) - NB_F(2.0) * u);
}

/* Bases are flat, where vapour begins to condense, and thin there: drops grow on their way up. */
static inline nb_real thin_out(nebel_cloud_type kind, nb_real height)
{
    const nb_real end = step_up(nb_splat(NB_CLOUD_TOP_THINS) * (NB_F(1.0) - height)) *
                        step_up(nb_splat(nb_cloud_base_thins(kind)) * height);
    if (kind != NEBEL_CLOUD_CUMULUS) return end;
    return end * (NB_F(0.45) + NB_F(0.55) * nb_min(NB_F(1.0), NB_F(2.0) * height));
}

/* nb_cloud_least_rank. */
static inline nb_real least_rank(nebel_cloud_type kind, nb_real height)
{
    const nb_real from_middle = NB_F(2.0) * height - NB_F(1.0);
    if (kind == NEBEL_CLOUD_CUMULUS) return height * height;
    return nb_splat(nb_cloud_sheet_bulge(kind)) * from_middle * from_middle;
}

/* How deep Worley noise may cut. */
static inline nb_real deepest(const nb_cloud_layer *layer, nb_real height)
{
    const nb_real detail = nb_splat(layer->detail);
    if (layer->kind != NEBEL_CLOUD_CUMULUS) return detail;
    return detail * (NB_F(0.5) + NB_F(0.5) * nb_min(NB_F(1.0), NB_F(3.0) * height));
}

/* Extinction at a place is `most` times `part` held within 0 and 1; where a width hides some of it, all within `spread` of
 * `part` is as likely. missing[n]: by how much the rank is at least too low, whatever noise behind the first n scales
 * do; below 0 where it may not be. */
typedef struct nb_density_lanes {
    nb_real most, part, spread, missing[NB_CLOUD_WORLEY_SCALES + 1];
} nb_density_lanes;

/* Worley noise cuts one minus the weighted sum of its scales. From the largest scale on it is read only until what is
 * left of them can neither make cloud nor thin it. */
static inline nb_density_lanes drops_of(const nb_cloud_noise *noise, const nb_cloud_layer *layer,
                                        const nb_cloud_density_query *looks, int p)
{
    const nb_real height = load(looks->height, p), variance = load(looks->variance, p),
                  softness = nb_splat(layer->softness);
    const nb_real whole = load(looks->rank, p) - least_rank(layer->kind, height), deep = deepest(layer, height);
    nb_real spread = nb_sqrt(NB_F(3.0) * variance), missing = -whole - spread, most = deep, cut = NB_F(0.0);
    /* What is far within is whole. */
    nb_mask is_open = nb_and(nb_and(missing<NB_F(0.0), deep> NB_F(0.0)), whole - deep < softness + spread);
    nb_table tables[NB_CLOUD_WORLEY_SCALES];
    nb_density_lanes drops;
    for (int n = 0; n <= NB_CLOUD_WORLEY_SCALES; n++) drops.missing[n] = missing;
    if (nb_any(is_open)) {
        const nb_real lost = choose_tables(noise, layer, load(looks->width, p), tables);
        spread = nb_select(is_open, nb_sqrt(NB_F(3.0) * (variance + deep * deep * lost)), spread);
    }
    for (int k = 0; k < NB_CLOUD_WORLEY_SCALES; k++) {
        is_open = nb_and(is_open, whole - most < softness + spread);
        if (!nb_any(is_open)) break;
        const nb_real parts[3] = {load(looks->parts[k][0], p), load(looks->parts[k][1], p),
                                  load(looks->parts[k][2], p)};
        const nb_real worley = read_worley(noise, parts, &tables[k]), part = deep * nb_splat(nb_worley_weights[k]);
        cut = nb_select(is_open, cut + part * (NB_F(1.0) - worley), cut);
        most = most - part * worley;
        missing = nb_select(is_open, cut - whole - spread, missing);
        for (int n = k + 1; n <= NB_CLOUD_WORLEY_SCALES; n++) drops.missing[n] = missing;
        is_open = nb_and(is_open, missing < NB_F(0.0));
    }
    drops.most = nb_splat(layer->extinction) * thin_out(layer->kind, height);
    drops.part = (whole - cut) / softness;
    drops.spread = spread / softness;
    return drops;
}

/* ---- what comes through ---------------------------------------------------------------------- */

/* Where less is hidden, all is as likely as the middle. */
#define LEAST_SPREAD NB_F(1e-3)

/* Integral of x held within 0 and 1. */
static inline nb_real ramp_integral(nb_real x)
{
    const nb_real held = nb_clamp(x, NB_F(0.0), NB_F(1.0));
    return NB_F(0.5) * held * held + nb_max(NB_F(0.0), x - NB_F(1.0));
}

/* The mean of x held within 0 and 1 where all within `wide` of x is as likely. */
static inline nb_real mean_ramp(nb_real x, nb_real wide)
{
    const nb_real mean = (ramp_integral(x + wide) - ramp_integral(x - wide)) / (NB_F(2.0) * nb_max(LEAST_SPREAD, wide));
    return nb_select(wide < LEAST_SPREAD, nb_clamp(x, NB_F(0.0), NB_F(1.0)), mean);
}

/* Where a part is full and another clear, between them evenly all that lies between: mean of 1 - exp(-depth x). */
static inline nb_real mean_lost(const nb_density_lanes *drops, nb_real depth)
{
    const nb_real low = drops->part - drops->spread, high = drops->part + drops->spread;
    const nb_real from = nb_clamp(low, NB_F(0.0), NB_F(1.0)), to = nb_clamp(high, NB_F(0.0), NB_F(1.0));
    const nb_real full = nb_max(NB_F(0.0), high - NB_F(1.0)) - nb_max(NB_F(0.0), low - NB_F(1.0));
    const nb_real lost = nb_one_minus_exp(depth * from);
    const nb_real between = lost + (NB_F(1.0) - lost) * (NB_F(1.0) - nb_exp_ratio(depth * (to - from)));
    return ((to - from) * between + full * nb_one_minus_exp(depth)) / (high - low);
}

/* Never more than the mean, whatever is too little for a number. */
static inline nb_real through(const nb_density_lanes *drops, nb_real depth, nb_real length, nb_real mean)
{
    return nb_clamp(-nb_log1p(-mean_lost(drops, depth)) / length, NB_F(0.0), mean);
}

/* The mean of extinction, weighted by what it lets through: of the same. Never more than what lets as much through. */
static inline nb_real passed_by(const nb_density_lanes *drops, nb_real depth, nb_real most)
{
    const nb_real low = drops->part - drops->spread, high = drops->part + drops->spread;
    const nb_real from = nb_clamp(low, NB_F(0.0), NB_F(1.0)), to = nb_clamp(high, NB_F(0.0), NB_F(1.0));
    const nb_real full = nb_max(NB_F(0.0), high - NB_F(1.0)) - nb_max(NB_F(0.0), low - NB_F(1.0));
    const nb_real clear = nb_max(NB_F(0.0), -low) - nb_max(NB_F(0.0), -high);
    const nb_real wide = depth * (to - from), ratio = nb_exp_ratio(wide), falls = nb_exp(-wide);
    const nb_mask is_narrow = wide < NB_F(0.01);
    const nb_real middle = nb_select(is_narrow, NB_F(0.5) - wide * nb_splat(1.0f / 3),
                                     (ratio - falls) / nb_select(is_narrow, NB_F(1.0), wide));
    const nb_real thin = (to - from) * nb_exp(-depth * from), thick = full * nb_exp(-depth);
    const nb_real weighted = thin * (from * ratio + (to - from) * middle) + thick, all = thin * ratio + thick + clear;
    return nb_clamp(drops->most * weighted / nb_max(all, NB_F(1e-30)), NB_F(0.0), most);
}

/* Stores what lets as much through as drops do. */
static inline void see_through(const nb_cloud_layer *layer, const nb_density_lanes *drops, nb_mask is_cloud, int p,
                               nb_cloud_density_query *looks)
{
    const nb_real length = load(looks->hidden, p), depth = drops->most * length, spread = drops->spread;
    const nb_real mean = nb_select(is_cloud, drops->most * mean_ramp(drops->part, drops->spread), NB_F(0.0));
    const nb_real part = nb_splat(layer->apart);
    nb_real whole = mean, apart = part * mean, passed = mean;
    /* Else the mean is right to a thousandth of what a full place has. */
    const nb_mask is_uneven = nb_and(nb_and(is_cloud, drops->part - spread < NB_F(1.0)),
                                     nb_and(spread >= LEAST_SPREAD, depth * spread * spread > NB_F(6e-3)));
    if (nb_any(is_uneven)) {
        whole = nb_select(is_uneven, through(drops, depth, length, whole), whole);
        if (looks->are_of_rays) {
            apart = nb_select(is_uneven, through(drops, part * depth, length, apart), apart);
            passed = nb_select(is_uneven, passed_by(drops, depth, whole), passed);
        }
    }
    nb_store_lanes(looks->whole + p, whole);
    if (looks->are_of_rays) {
        nb_store_lanes(looks->apart + p, apart);
        nb_store_lanes(looks->passed + p, passed);
    }
}

/* Of Worley noise, the slope of the first scales counts, whatever the others do. */
static inline nb_real clear_of(const nb_cloud_layer *layer, const nb_cloud_density_query *looks,
                               const nb_real missing[], int p)
{
    nb_real slope = nb_splat(layer->slope) * load(looks->scale, p) +
                    nb_splat(NB_CLOUD_RANK_SLOPE * layer->per_thickness) * nb_abs(load(looks->climb, p));
    nb_real clear = NB_F(0.0);
    for (int n = 0; n <= NB_CLOUD_WORLEY_SCALES; n++) {
        clear = nb_max(clear, missing[n] / slope);
        if (n < NB_CLOUD_WORLEY_SCALES) slope += nb_splat(layer->worley_slopes[n]);
    }
    return clear;
}

static inline void find_in_packet(const nb_cloud_noise *noise, const nb_cloud_layer *layer, int p,
                                  nb_cloud_density_query *looks)
{
    const nb_real height = load(looks->height, p);
    const nb_mask is_in = nb_and(height > NB_F(0.0), height < NB_F(1.0));
    const nb_density_lanes drops = drops_of(noise, layer, looks, p);
    const nb_mask is_cloud = nb_and(is_in, drops.missing[NB_CLOUD_WORLEY_SCALES] < NB_F(0.0));
    see_through(layer, &drops, is_cloud, p, looks);
    if (looks->are_of_rays)
        nb_store_lanes(looks->clear + p, nb_select(is_in, clear_of(layer, looks, drops.missing, p), NB_F(0.0)));
}

void NB_SUFFIXED(nb_cloud_find_drops_)(const nb_cloud_noise *noise, const nb_cloud_layer *layer,
                                       nb_cloud_density_query *looks)
{
    for (int p = 0; p < looks->count; p += NB_WIDTH) find_in_packet(noise, layer, p, looks);
}
