/* Clouds along a ray: Simpson's rule on pieces that are halved or doubled by what it may miss, as far as the clouds
 * before let it be seen. Where no cloud can be nothing is read: the sum that says where clouds are has a largest slope.
 *
 * Where a walk looks next hangs on what it saw last. So that places can be looked at many at once, many walks go on together:
 * each says what it asks, and waits for it. */
#include "cloud_nodes.h"
#include "cloud_density.h"
#include "cloud_lighting.h"

#include "base/stride.h"
#include "math/vector.h"

#include <math.h>
#include <string.h>

#define NB_DOUBLE
#include "formulas/prelude.h"

#include "formulas/elementary.inc"

/* Where so little is left rays end; from FADING on what is seen fades to nothing there, so that no ray that just ends differs from one
 * that just goes on to bright cloud far behind. */
#define UNSEEN 0.03
#define FADING 0.12

/* Of what a piece may miss: that of many pieces together is less than their number of it, since signs differ. */
#define PIECES 1.5

/* Optical depth of a piece; and of a stretch of them, whose light is that of its middle. Both grow as less is seen. */
#define MOST_DEPTH 1
#define STRETCH_DEPTH 0.31

/* Halves of a piece whose parts of its depth differ by less than twice that count as one. */
#define EVEN 0.03

/* Stretches end sooner where there is less cloud than their layer's extinction would make: for each unit of optical depth that there
 * is less, by so much of them, times what is seen of them. Light of two clouds would come from between them. */
#define LOSS 1

/* Stretches of which so little is seen have no light: a hundredth of a grey level of the brightest cloud. */
#define FAINT 6e-5

/* Nor has what is so far apart one light, in first steps. */
#define WIDE_GAP 16

/* The first step from a piece towards the sun: optical depth in the middle of clouds; half of the least piece at most. */
#define FIRST_DEPTH 0.3

/* Where there may be cloud and is none, of a sixteenth of the smallest cumulus cells: near, where wisps are many
 * pixels wide, and where a pixel is half a step. */
#define LEAST_STEP 0.2
#define FAR_STEP 0.7

/* Where less than that is left steps in search of cloud are as much longer, up to so many times. */
#define DIM 0.3
#define MOST_TIMES 3

/* The first piece of who stands within cloud, of the same: small noise is shorter, and three values of a longer piece
 * may lie on a line by chance. Later ones have grown from pieces that were smooth. */
#define FIRST_STEP 0.1

/* Pixels may be wider than a layer is high: parts of the ray's stay in it that steps, and the least pieces, do not exceed. */
#define STAY_STEP 0.16
#define STAY_PIECE 0.0625

/* Nodes of depths up, down and away from the sun, in parts of the layer's height: cumulus cells between wider ones
 * share the depths of their middle, and are half as bright (test_clouds). */
#define NODES_PART 0.08

/* Across a pixel cumulus cells rise by so many times what they do in the mean, which is their height by their size: no
 * less than the pixel is wide where they are as high as the usual ones. */
#define STEEPNESS 1.5

/* Pixels so wide beside a layer's height, times the square of how much wider they are than what they hide of it, hold nodes so far
 * apart that light has a contour at each: a place has ways of its own then, in part from the first on, all from the second on. */
#define NODES_GOOD 0.2
#define NODES_BAD 0.3

/* Noise hardly ever rises by a seventh of its largest slope all the way to the next cloud. */
#define SLOPE_PART 0.15

/* Behind a surface the way to the sun is found as finely as in that part of all layers' height. */
#define REST_PART 1e-3

/* WALKS: so many go on together. */
enum { MOST_PIECES = 4096, WALKS = 32 };

/* Pieces one behind the other that have the same light. */
typedef struct nb_cloud_segment {
    double end, most;        /* most: how deep it gets */
    double spent;            /* part of it that it has come to */
    double seen, seen_apart; /* of all scattering, and of what leads away */
    double passed;           /* optical depth of what light that goes on along the ray is scattered by */
    double weight, moment;   /* of places by what is seen */
} nb_cloud_segment;

/* A ray in a layer's axes. */
typedef struct nb_scattered_part {
    double from[3], direction[3];
} nb_scattered_part;

/* A place of the ray in a layer's axes, and a part of its height. */
typedef struct nb_cloud_sample {
    double place[3], radius;
    float height, width, climb; /* climb: cosine to straight up */
} nb_cloud_sample;

/* Where a ray is in a layer. */
typedef struct nb_empty_interval {
    int layer;
    double begin, end;
} nb_empty_interval;

/* What a walk waits for. */
typedef enum nb_pending_light {
    NB_WAIT_NOTHING,
    NB_WAIT_ENTRY,
    NB_WAIT_STEP,
    NB_WAIT_PIECE,
    NB_WAIT_LIGHT
} nb_pending_light;

typedef struct nb_cloud_ray_group nb_cloud_ray_group;

typedef struct nb_cloud_walk {
    const nebel_cloud_lighting *view;
    nebel_cloud_workspace *workspace;
    nb_cloud_ray_group *party;
    double from[3], unit[3], spread; /* from the planet's centre */
    double t_max;                    /* up to a surface; HUGE_VAL: to none */
    nb_cloud_ray ray;
    nb_scattered_part turned[NEBEL_MAX_CLOUD_LAYERS];
    nb_empty_interval stays[2 * NEBEL_MAX_CLOUD_LAYERS];
    int stay, stay_count;

    /* In a stay. A piece lies from t to t + length. */
    double least; /* m, of pieces that are not yet known to be smooth */
    double t, length;
    int pieces, has_far;
    nb_cloud_filter here, middle, far; /* at its beginning; far: has_far */

    /* In search of cloud. clear: there is none ahead, as far as slopes of noise say. unknown: up to where blocks of columns do not
     * say whether there is, by size; they are not asked again before that. */
    int is_searching;
    double clear, unknown[3];
    nb_cloud_sample spot;

    nb_pending_light wait;
    int unanswered;
    uint32_t looks; /* with questions */

    double missed;
    nb_cloud_segment stretch;
    nb_cloud_node_builder tally;
    nebel_cloud_transfer *nodes;
} nb_cloud_walk;

static double radius_at(const nb_cloud_walk *walk, double t, double place[3])
{
    for (int c = 0; c < 3; c++) place[c] = walk->from[c] + t * walk->unit[c];
    return nb_vector_length(place);
}

static nb_cloud_sample spot_at(const nb_cloud_walk *walk, int k, double t)
{
    const nb_cloud_layer *layer = &walk->view->clouds->layers[k];
    const nb_scattered_part *turned = &walk->turned[k];
    nb_cloud_sample spot = {.width = (float)(walk->spread * t)};
    for (int i = 0; i < 3; i++) spot.place[i] = turned->from[i] + t * turned->direction[i];
    spot.radius = nb_vector_length(spot.place);
    spot.height = (float)(spot.radius - layer->low) * layer->per_thickness;
    spot.climb = (float)(nb_vector_dot(spot.place, turned->direction) / spot.radius);
    return spot;
}

/* How much of the way through a layer a pixel hides, of a way so long from base to top: as much as cumulus cells rise
 * across it, but no less than their softness. */
static double hidden_way(const nb_cloud_layer *layer, double length, double width)
{
    const double soft = (double)(layer->softness / NB_CLOUD_RANK_SLOPE);
    return nb_min(width, length * nb_max(soft, STEEPNESS * width / (double)layer->size));
}

static double hidden_of_stay(const nb_cloud_walk *walk, const nb_empty_interval *stay)
{
    const nb_cloud_layer *layer = &walk->view->clouds->layers[stay->layer];
    return hidden_way(layer, nb_max(layer->high - layer->low, stay->end - stay->begin), walk->spread * walk->t);
}

/* ---- looking --------------------------------------------------------------------------------- */

/* Places of many walks that are looked at together. What is seen goes to where *seen is. */
typedef struct nb_queue {
    nb_cloud_density_query looks;
    nb_cloud_walk *walks[NB_CLOUD_LANES];
    nb_cloud_filter *seen[NB_CLOUD_LANES];
} nb_queue;

static void ask(nb_queue *queue, nb_cloud_walk *walk, int k, double t, nb_cloud_filter *seen)
{
    const int i = queue->looks.count++;
    const nb_scattered_part *turned = &walk->turned[k];
    for (int c = 0; c < 3; c++) {
        queue->looks.place[c][i] = turned->from[c] + t * turned->direction[c];
        queue->looks.way[c][i] = turned->direction[c];
    }
    queue->looks.width[i] = (float)(walk->spread * t);
    queue->walks[i] = walk;
    queue->seen[i] = seen;
    walk->unanswered++;
}

static void see(const nb_queue *queue, int i)
{
    const nb_cloud_density_query *looks = &queue->looks;
    nb_cloud_walk *walk = queue->walks[i];
    *queue->seen[i] = (nb_cloud_filter){looks->whole[i], looks->apart[i], looks->passed[i]};
    walk->unanswered--;
    if (walk->wait != NB_WAIT_STEP || looks->whole[i] > 0) return;
    walk->spot = (nb_cloud_sample){
        .radius = looks->radius[i], .height = looks->height[i], .width = looks->width[i], .climb = looks->climb[i]};
    for (int c = 0; c < 3; c++) walk->spot.place[c] = looks->place[c][i];
    walk->clear = (double)looks->clear[i];
}

/* ---- where no cloud is ----------------------------------------------------------------------- */

/* The least rank on the way between two places: curves of rays sag below the line between their heights. */
static float least_between(const nb_cloud_walk *walk, int k, const nb_cloud_sample *a, double way)
{
    const nb_cloud_layer *layer = &walk->view->clouds->layers[k];
    const double sag = way * way / a->radius;
    const float end = a->height + a->climb * (float)way * layer->per_thickness;
    const float low = nb_smaller(a->height, end) - (float)sag * layer->per_thickness;
    const float high = nb_larger(a->height, end) + (float)sag * layer->per_thickness;
    if (layer->kind == NEBEL_CLOUD_CUMULUS) return nb_cloud_least_rank(layer->kind, nb_larger(0, low));
    return low < 0.5f && high > 0.5f ? 0 : nb_cloud_least_rank(layer->kind, high <= 0.5f ? high : low);
}

/* How far ahead there is no cloud for sure; 0 where that is not known. */
static double clear_way(nb_cloud_walk *walk, int k)
{
    const nb_cloud_sample *spot = &walk->spot;
    nb_cloud_column_cursor out =
        nb_cloud_density_out(walk->workspace, k, spot->place, walk->turned[k].direction, spot->width);
    for (int size = 2; size >= 0; size--) {
        if (walk->t < walk->unknown[size]) continue;
        const double way = nb_cloud_way_in_block(walk->workspace, &out, size) + 1e-3 * walk->least;
        if (!nb_cloud_is_block_above(walk->workspace, &out, size, least_between(walk, k, spot, way))) return way;
        walk->unknown[size] = walk->t + way;
    }
    return 0;
}

/* What pixels hide makes the least step longer, but no more than a part of the stay. */
static double least_step(const nb_cloud_walk *walk, const nb_empty_interval *stay)
{
    const double width = hidden_of_stay(walk, stay),
                 near = nb_max(LEAST_STEP * walk->least, nb_min(2 * width, FAR_STEP * walk->least));
    const double times = nb_min(MOST_TIMES, nb_max(1, DIM / walk->tally.left));
    return times * nb_min(STAY_STEP * (stay->end - stay->begin), nb_max(near, width));
}

/* A layer's clouds thin out to nothing where it ends: who goes there in one step would see nothing at either end of it. */
static double step_before_end(double left, double step, double least)
{
    return step < left ? step : left > least ? nb_max(least, 0.5 * left) : left;
}

/* Goes on until there may be cloud, by as much as there can be none, or by the least step. Returns 0 at the stay's end, else 1 and
 * the step is from t as long as length. */
static int find_step(nb_cloud_walk *walk, const nb_empty_interval *stay)
{
    const int k = stay->layer;
    while (walk->t < stay->end) {
        const double least = least_step(walk, stay);
        if (walk->t >= walk->unknown[0]) {
            const double way = clear_way(walk, k);
            if (way > 0) {
                walk->t += way;
                walk->spot = spot_at(walk, k, walk->t);
                walk->clear = 0;
                continue;
            }
        }
        const double left = stay->end - walk->t;
        if (walk->clear >= left) return 0;
        walk->length = step_before_end(left, nb_max(walk->clear / SLOPE_PART, least), least);
        return 1;
    }
    return 0;
}

/* ---- light ----------------------------------------------------------------------------------- */

/* Stretches whose light is found together. */
typedef struct nb_lights {
    int count;
    nb_cloud_walk *walks[NB_CLOUD_ASKED];
    int layers[NB_CLOUD_ASKED];
    nb_cloud_segment stretches[NB_CLOUD_ASKED];
    double radius[NB_CLOUD_ASKED];
    float prefiltered[NB_CLOUD_ASKED]; /* part of a mean of the layer */
    float entered[NB_CLOUD_ASKED];     /* of that: part of its height where the ray came into it */
    nb_cloud_depth_query asked[NB_CLOUD_ASKED];
} nb_lights;

/* Walks, those of them that have something to ask or are at their end, and what they ask: of each layer, and of light. */
struct nb_cloud_ray_group {
    nb_cloud_walk walks[WALKS], *ready[WALKS];
    int ready_count;
    nb_queue queues[NEBEL_MAX_CLOUD_LAYERS];
    nb_lights lights;
};

/* How finely light is found: in sheets it changes within less of their height than in cumulus. */
static nb_cloud_resolution grain_of(const nb_cloud_walk *walk, int k, double width)
{
    const nb_cloud_layer *layer = &walk->view->clouds->layers[k];
    const double thickness = 1 / (double)layer->per_thickness, hidden = hidden_way(layer, thickness, width),
                 flatness = hidden > 0 ? width / hidden : 1, nodes = NODES_PART * thickness;
    return (nb_cloud_resolution){
        .width = (float)width,
        .first =
            (float)nb_max(nb_min((layer->kind == NEBEL_CLOUD_CUMULUS ? 0.03 : 0.02) * thickness, 2 * hidden),
                          nb_min(0.1 * thickness, nb_min(0.5 * walk->least, FIRST_DEPTH / (double)layer->extinction))),
        /* Wider lattices than the layer is high would show through it, also where cells are far wider than that. */
        .wide = (float)nb_max(nb_min(20 * width, nb_min(nb_max(2 * width, nodes), 0.8 * thickness)),
                              nb_min(0.08 * walk->least, nodes)),
        .own = (float)nb_max(
            0, nb_min(1, (flatness * flatness * width / thickness - NODES_GOOD) / (NODES_BAD - NODES_GOOD))),
    };
}

static void light_stretch(nb_lights *lights, int i)
{
    nb_cloud_walk *walk = lights->walks[i];
    const int k = lights->layers[i];
    const nb_cloud_depth_query *asked = &lights->asked[i];
    const nb_cloud_layer *layer = &walk->view->clouds->layers[k];
    const float part = lights->prefiltered[i];
    const nb_cloud_depths depths = nb_cloud_bound_depths(walk->view, k, lights->radius[i], &asked->depths);
    double up[3];
    for (int c = 0; c < 3; c++) up[c] = asked->place[c] / lights->radius[i];
    const nb_cloud_sight sight = {(float)nb_vector_dot(up, walk->view->sun.direction),
                                  (float)nb_vector_dot(up, walk->unit), (float)walk->ray.sun};
    nb_cloud_irradiance parts = nb_cloud_parts_of(layer, &depths, &sight);
    if (part > 0) {
        const nb_cloud_irradiance mean = nb_cloud_prefilter_at(walk->workspace, k, up, walk->unit, lights->entered[i]);
        const float left = parts.left + part * (1 - walk->ray.own) * (mean.left - parts.left);
        parts = nb_cloud_mix_parts(&parts, &mean, part);
        parts.left = left;
    }
    const nb_cloud_light light = nb_cloud_clear_light(walk->view, asked->place, lights->radius[i]);
    const nb_cloud_source source = nb_cloud_source_of(&walk->ray, k, &parts, &light);
    const nb_cloud_segment *stretch = &lights->stretches[i];
    double sent[3], ahead[3];
    for (int c = 0; c < 3; c++) {
        sent[c] = stretch->seen * (double)(source.once[c] + source.ambient[c]) +
                  stretch->seen_apart * (double)source.often[c];
        ahead[c] = stretch->passed * (double)source.ahead[c];
    }
    nb_cloud_nodes_light(&walk->tally, sent, ahead);
}

/* A walk that waited for its last light is ready. */
static void find_lights(nb_cloud_ray_group *party)
{
    nb_lights *lights = &party->lights;
    nb_cloud_find_depths(lights->walks[0]->workspace, lights->count, lights->asked);
    for (int i = 0; i < lights->count; i++) {
        nb_cloud_walk *walk = lights->walks[i];
        light_stretch(lights, i);
        if (walk->wait != NB_WAIT_LIGHT || walk->tally.lit < walk->tally.asked) continue;
        walk->wait = NB_WAIT_NOTHING;
        party->ready[party->ready_count++] = walk;
    }
    lights->count = 0;
}

/* Part of a layer's height where the ray came into it, or began. */
static float height_entered(const nb_cloud_walk *walk, int k)
{
    const nb_cloud_layer *layer = &walk->view->clouds->layers[k];
    double place[3];
    const double height = radius_at(walk, walk->stays[walk->stay].begin, place) - layer->low;
    return (float)nb_max(0, nb_min(1, height * (double)layer->per_thickness));
}

/* Light of a stretch as of its middle, weighted by how much of it is seen: that is right where it changes evenly. */
static void add_light(nb_cloud_walk *walk, int k)
{
    nb_lights *lights = &walk->party->lights;
    const nb_cloud_segment stretch = walk->stretch;
    walk->stretch = (nb_cloud_segment){.weight = 0};
    if (!(stretch.weight > FAINT)) return;
    const double t = stretch.moment / stretch.weight;
    const int i = lights->count++;
    lights->walks[i] = walk;
    lights->layers[i] = k;
    lights->stretches[i] = stretch;
    lights->radius[i] = radius_at(walk, t, lights->asked[i].place);
    lights->asked[i].grain = grain_of(walk, k, walk->spread * t);
    lights->prefiltered[i] = nb_cloud_prefilter_part(walk->workspace, k, lights->asked[i].grain.width);
    lights->entered[i] = lights->prefiltered[i] > 0 ? height_entered(walk, k) : 0;
    lights->asked[i].is_alike = lights->prefiltered[i] >= 1 && !(walk->ray.own > 0);
    walk->tally.asked++;
    if (lights->count == NB_CLOUD_ASKED) find_lights(walk->party);
}

/* ---- pieces ---------------------------------------------------------------------------------- */

/* What counts of light that leads away and is left: all of it, but in the end nothing. */
static double visible(double left)
{
    const double faded = nb_min(1, nb_max(0, (FADING - left) / (FADING - UNSEEN)));
    return nb_max(0, left - UNSEEN * faded * faded);
}

/* How deep the next stretch gets: where nothing more is seen it has no end. */
static double deepest_stretch(const nb_cloud_walk *walk)
{
    return walk->tally.left_apart > UNSEEN ? STRETCH_DEPTH / (0.15 + walk->tally.left) : HUGE_VAL;
}

/* Optical depths of a piece: of all scattering, of what leads away, and of what light that goes on along the ray is scattered by. */
typedef struct nb_piece {
    double whole, apart, passed;
} nb_piece;

static nb_piece part_of(const nb_piece *piece, double part)
{
    return (nb_piece){part * piece->whole, part * piece->apart, part * piece->passed};
}

/* Part of a piece that lies in one stretch. */
static void take_part(nb_cloud_walk *walk, int k, double t, double length, nb_piece depth)
{
    nb_cloud_segment *stretch = &walk->stretch;
    const double apart = (double)walk->ray.apart[k], left = walk->tally.left, visibly = visible(walk->tally.left_apart);
    stretch->end = t + length;
    nb_cloud_nodes_pass(&walk->tally, t + length, depth.whole, depth.apart);
    const double seen = left - walk->tally.left, seen_apart = (visibly - visible(walk->tally.left_apart)) / apart;
    stretch->seen += seen;
    stretch->seen_apart += seen_apart;
    stretch->passed += depth.passed;
    stretch->weight += seen + seen_apart;
    stretch->moment += (seen + seen_apart) * (t + 0.5 * length);
}

/* What part of a stretch such cloud is. */
static double part_of_stretch(const nb_cloud_walk *walk, int k, double length, double depth)
{
    const nb_cloud_segment *stretch = &walk->stretch;
    const double whole = (double)walk->view->clouds->layers[k].extinction * length;
    const double seen = stretch->seen + (double)walk->ray.apart[k] * stretch->seen_apart;
    return depth / stretch->most + LOSS * seen * nb_max(0, whole - depth);
}

/* The gap before t is part of a stretch, too. */
static void take_gap(nb_cloud_walk *walk, int k, double t)
{
    nb_cloud_segment *stretch = &walk->stretch;
    if (stretch->weight > 0) stretch->spent += part_of_stretch(walk, k, t - stretch->end, 0);
    if (stretch->spent >= 1 || t - stretch->end > WIDE_GAP * walk->least) add_light(walk, k);
}

/* Stretches end where they have come to so much, wherever pieces end: neighbouring rays, whose pieces may be others, have their light
 * from neighbouring places. */
static void take_piece(nb_cloud_walk *walk, int k, double t, double length, nb_piece depth)
{
    nb_cloud_segment *stretch = &walk->stretch;
    if (!(depth.whole > 0)) return;
    take_gap(walk, k, t);
    nb_cloud_nodes_enter(&walk->tally, t);
    for (double begin = 0; begin < 1;) {
        if (!(stretch->weight > 0)) stretch->most = deepest_stretch(walk);
        const double rest = 1 - begin, whole = part_of_stretch(walk, k, rest * length, rest * depth.whole);
        const double share = (1 - stretch->spent) / whole, part = nb_min(1, share) * rest;
        take_part(walk, k, t + begin * length, part * length, part_of(&depth, part));
        if (share > 1) {
            stretch->spent += whole;
            return;
        }
        begin = nb_min(1, begin + part);
        add_light(walk, k);
        nb_cloud_nodes_leave(&walk->tally, t + begin * length);
    }
}

/* What Simpson's rule may miss of a piece's extinction, times six by its length. Where cloud begins or ends within the piece three
 * values may lie on a line by chance, and a wisp would be drawn along all places where they do. */
static double curve_of(const nb_cloud_filter *here, const nb_cloud_filter *middle, const nb_cloud_filter *far)
{
    const double a = (double)here->whole, b = (double)middle->whole, c = (double)far->whole;
    const double curve = fabs(a - 2 * b + c);
    return a > 0 && b > 0 && c > 0 ? curve : nb_max(curve, nb_max(a, nb_max(b, c)));
}

static double least_piece(const nb_cloud_walk *walk, const nb_empty_interval *stay)
{
    return nb_max(nb_min(0.5 * hidden_of_stay(walk, stay), STAY_PIECE * (stay->end - stay->begin)), 1e-3 * walk->least);
}

/* What part of a piece's depth lies in its first half: by the parabola through its three values, but no more than either half can have. */
static double part_before(const nb_cloud_walk *walk, const nb_empty_interval *stay, double depth)
{
    const double most = 0.5 * walk->length * (double)walk->view->clouds->layers[stay->layer].extinction;
    const double first = walk->length / 24 * (double)(5 * walk->here.whole + 8 * walk->middle.whole - walk->far.whole);
    return nb_max(nb_max(0, depth - most), nb_min(nb_min(depth, most), first)) / depth;
}

/* Light is that of where cloud is: a piece that is thin at one end counts as two. */
static void take_halves(nb_cloud_walk *walk, const nb_empty_interval *stay, const nb_piece *depth)
{
    const double half = 0.5 * walk->length, before = depth->whole > 0 ? part_before(walk, stay, depth->whole) : 0.5;
    if (fabs(before - 0.5) < EVEN) {
        take_piece(walk, stay->layer, walk->t, walk->length, *depth);
        return;
    }
    take_piece(walk, stay->layer, walk->t, half, part_of(depth, before));
    take_piece(walk, stay->layer, walk->t + half, half, part_of(depth, 1 - before));
}

/* By Simpson's rule. */
static nb_piece piece_of(const nb_cloud_walk *walk)
{
    const nb_cloud_filter *a = &walk->here, *b = &walk->middle, *c = &walk->far;
    const double sixth = walk->length / 6;
    return (nb_piece){.whole = sixth * (double)(a->whole + 4 * b->whole + c->whole),
                      .apart = sixth * (double)(a->apart + 4 * b->apart + c->apart),
                      .passed = sixth * (double)(a->passed + 4 * b->passed + c->passed)};
}

/* Takes a piece whose three values are known, or halves it. */
static void judge_piece(nb_cloud_walk *walk, const nb_empty_interval *stay)
{
    const double tolerance = PIECES * walk->view->tolerance, length = walk->length;
    const nb_cloud_filter *here = &walk->here, *middle = &walk->middle, *far = &walk->far;
    const nb_piece depth = piece_of(walk);
    const double missed = walk->tally.left * length / 6 * curve_of(here, middle, far);
    if ((missed > tolerance || depth.whole > MOST_DEPTH / (0.15 + walk->tally.left)) &&
        length > 2 * least_piece(walk, stay)) {
        walk->length *= 0.5;
        walk->far = walk->middle;
        walk->has_far = 1;
        return;
    }
    walk->missed += nb_min(walk->tally.left, missed / PIECES);
    take_halves(walk, stay, &depth);
    walk->t += length;
    walk->here = walk->far;
    walk->has_far = 0;
    if (missed < 0.2 * tolerance) walk->length *= 1.7;
    walk->length = nb_min(walk->length, 8 * walk->least + 0.01 * walk->t);
}

/* ---- walks ----------------------------------------------------------------------------------- */

/* What a walk waits for next in a stay; nothing at its end. */
static nb_pending_light find_next(nb_cloud_walk *walk, const nb_empty_interval *stay)
{
    if (walk->is_searching) return find_step(walk, stay) ? NB_WAIT_STEP : NB_WAIT_NOTHING;
    if (walk->pieces++ >= MOST_PIECES || !(walk->t < stay->end) || walk->tally.left_apart <= UNSEEN)
        return NB_WAIT_NOTHING;
    if (!walk->has_far && walk->here.whole == 0) {
        walk->is_searching = 1;
        walk->clear = walk->unknown[0] = walk->unknown[1] = walk->unknown[2] = 0;
        walk->spot = spot_at(walk, stay->layer, walk->t);
        return find_next(walk, stay);
    }
    walk->length = nb_min(walk->length, stay->end - walk->t);
    return NB_WAIT_PIECE;
}

static void enter(nb_cloud_walk *walk, const nb_empty_interval *stay)
{
    const nb_cloud_layer *layer = &walk->view->clouds->layers[stay->layer];
    walk->least = (double)layer->octaves[NB_CLOUD_OCTAVES - 1].cell / 16;
    walk->t = stay->begin;
    walk->length = FIRST_STEP * walk->least;
    walk->pieces = walk->has_far = walk->is_searching = 0;
    walk->wait = NB_WAIT_ENTRY;
}

/* From stay to stay, as far as something is seen; layers do not overlap. At the end it waits for nothing. */
static void go_on(nb_cloud_walk *walk)
{
    walk->wait = find_next(walk, &walk->stays[walk->stay]);
    if (walk->wait != NB_WAIT_NOTHING) return;
    add_light(walk, walk->stays[walk->stay].layer);
    if (++walk->stay < walk->stay_count && walk->tally.left_apart > UNSEEN) enter(walk, &walk->stays[walk->stay]);
}

/* What it waited for has come. */
static void take_answer(nb_cloud_walk *walk)
{
    if (walk->wait == NB_WAIT_PIECE) judge_piece(walk, &walk->stays[walk->stay]);
    if (walk->wait == NB_WAIT_STEP) {
        walk->has_far = walk->far.whole > 0;
        walk->is_searching = !walk->has_far;
        if (walk->is_searching) walk->t += walk->length;
    }
    go_on(walk);
}

static void put_questions(nb_cloud_walk *walk, nb_queue *queue)
{
    const int k = walk->stays[walk->stay].layer;
    if (walk->wait == NB_WAIT_ENTRY) {
        ask(queue, walk, k, walk->t, &walk->here);
        return;
    }
    walk->looks++;
    if (walk->wait == NB_WAIT_PIECE) ask(queue, walk, k, walk->t + 0.5 * walk->length, &walk->middle);
    if (!walk->has_far) ask(queue, walk, k, walk->t + walk->length, &walk->far);
}

static void find_stays(nb_cloud_walk *walk, double t_max)
{
    const nebel_clouds *clouds = walk->view->clouds;
    nb_empty_interval *stays = walk->stays;
    walk->stay_count = 0;
    for (int k = 0; k < clouds->layer_count; k++) {
        double pieces[2][2];
        const int found =
            nb_cloud_pieces(clouds->layers[k].low, clouds->layers[k].high, walk->from, walk->unit, t_max, pieces);
        for (int i = 0; i < found; i++) {
            const nb_empty_interval stay = {k, pieces[i][0], pieces[i][1]};
            int at = walk->stay_count++;
            for (; at > 0 && stays[at - 1].begin > stay.begin; at--) stays[at] = stays[at - 1];
            stays[at] = stay;
        }
    }
}

/* Of the sun's light what comes through all clouds on the ray and, where that ends before them, through what is behind that; it fades out as all
 * that is seen does. */
static double through_all(nb_cloud_walk *walk)
{
    const nb_cloud_node_builder *tally = &walk->tally;
    const double visibly = visible(tally->left_apart),
                 seen = visibly > 0 ? tally->left * visibly / tally->left_apart : 0;
    double end[3], pieces[2][2];
    if (!(walk->ray.ahead > 0 && seen > 0 && walk->t_max < HUGE_VAL)) return seen;
    const nebel_cloud_lighting *view = walk->view;
    (void)radius_at(walk, walk->t_max, end);
    if (nb_cloud_pieces(view->low, view->high, end, view->sun.direction, HUGE_VAL, pieces) == 0) return seen;
    for (int c = 0; c < 3; c++) end[c] += pieces[0][0] * view->sun.direction[c];
    const double width = fmax(walk->spread * walk->t_max, REST_PART * (view->high - view->low));
    return seen * nb_exp(-(double)nb_cloud_sun_depth_at(walk->workspace, end, (float)width));
}

static void begin(nebel_cloud_workspace *workspace, nb_cloud_ray_group *party, const nebel_ray *ray,
                  const double unit[3], double spread, nebel_cloud_transfer *nodes, nb_cloud_walk *walk)
{
    const nebel_atmosphere *atmosphere = workspace->view->clouds->atmosphere;
    *walk = (nb_cloud_walk){.view = workspace->view,
                            .workspace = workspace,
                            .party = party,
                            .spread = spread,
                            .nodes = nodes,
                            .tally = {.left = 1, .left_apart = 1}};
    nb_air_from_center(atmosphere, ray->origin, walk->from);
    nb_air_raise(atmosphere->airs.radius, walk->from);
    memcpy(walk->unit, unit, sizeof walk->unit);
    walk->ray = nb_cloud_ray_make(workspace->view, unit, spread);
    for (int k = 0; k < workspace->view->clouds->layer_count; k++)
        for (int i = 0; i < 3; i++) {
            const double *turn = workspace->view->poses[k].turn[i];
            walk->turned[k].from[i] = nb_vector_dot(turn, walk->from);
            walk->turned[k].direction[i] = nb_vector_dot(turn, unit);
        }
    walk->t_max = fmin(ray->t_max, nb_cloud_to_ground(atmosphere->airs.radius, walk->from, unit));
    find_stays(walk, walk->t_max);
    if (walk->stay_count > 0) enter(walk, &walk->stays[0]);
}

/* ---- many walks ------------------------------------------------------------------------------ */

typedef struct nb_cloud_rays {
    nebel_cloud_workspace *workspace;
    size_t n, next;
    const nebel_ray *rays;
    double pixel_spread;
    const double *pixel_spreads; /* of each ray; NULL: the same for all */
    nebel_cloud_transfer *nodes;
    size_t ray_stride, node_stride;
} nb_cloud_rays;

static const nebel_ray *ray_at(const nb_cloud_rays *rays, size_t i)
{
    return nb_stride_from(rays->rays, rays->ray_stride, i);
}

static double spread_at(const nb_cloud_rays *rays, size_t i)
{
    return rays->pixel_spreads != NULL ? rays->pixel_spreads[i] : rays->pixel_spread;
}

static void begin_next(nb_cloud_rays *rays, nb_cloud_walk *walk, nb_cloud_ray_group *party)
{
    const size_t i = rays->next++;
    double unit[3];
    (void)nb_air_is_ray(ray_at(rays, i), unit);
    nb_vector_round(unit);
    begin(rays->workspace, party, ray_at(rays, i), unit, (double)(float)spread_at(rays, i),
          nb_stride_to(rays->nodes, rays->node_stride, i), walk);
    party->ready[party->ready_count++] = walk;
}

static void look(const nb_cloud_rays *rays, int k, nb_cloud_ray_group *party)
{
    nb_queue *queue = &party->queues[k];
    nb_cloud_density(rays->workspace, k, &queue->looks);
    for (int i = 0; i < queue->looks.count; i++) see(queue, i);
    for (int i = 0; i < queue->looks.count; i++) {
        nb_cloud_walk *walk = queue->walks[i];
        if (walk->unanswered != 0 || walk->wait == NB_WAIT_NOTHING) continue;
        take_answer(walk);
        walk->unanswered = -1;
        party->ready[party->ready_count++] = walk;
    }
    queue->looks.count = 0;
}

/* The layer of which most is asked; -1: of none. */
static int find_asked(const nb_cloud_rays *rays, const nb_cloud_ray_group *party)
{
    int most = -1;
    for (int k = 0; k < rays->workspace->view->clouds->layer_count; k++)
        if (party->queues[k].looks.count > (most < 0 ? 0 : party->queues[most].looks.count)) most = k;
    return most;
}

/* A walk that is ready has questions, for which there must be room, or waits for its last light, or is at its end: then the next ray
 * takes its place. */
static void attend(nb_cloud_rays *rays, nb_cloud_walk *walk, nb_cloud_ray_group *party)
{
    if (walk->wait != NB_WAIT_NOTHING) {
        const int k = walk->stays[walk->stay].layer;
        walk->unanswered = 0;
        if (party->queues[k].looks.count > NB_CLOUD_LANES - 2) look(rays, k, party);
        put_questions(walk, &party->queues[k]);
        return;
    }
    if (walk->tally.lit < walk->tally.asked) {
        walk->wait = NB_WAIT_LIGHT;
        return;
    }
    nb_cloud_nodes_end(&walk->tally, through_all(walk), walk->nodes);
    walk->nodes->error = (float)walk->missed;
    walk->nodes->density_queries = walk->looks;
    if (rays->next < rays->n) begin_next(rays, walk, party);
}

static void trace(nb_cloud_rays *rays)
{
    nb_cloud_ray_group party;
    party.ready_count = party.lights.count = 0;
    for (int k = 0; k < NEBEL_MAX_CLOUD_LAYERS; k++) {
        party.queues[k].looks.count = 0;
        party.queues[k].looks.are_of_rays = 1;
    }
    for (int i = 0; i < WALKS && rays->next < rays->n; i++) begin_next(rays, &party.walks[i], &party);
    for (;;) {
        while (party.ready_count > 0) attend(rays, party.ready[--party.ready_count], &party);
        /* No walk is ready: what one layer is asked is answered, or, if no layer is asked anything, what light is asked. */
        const int k = find_asked(rays, &party);
        if (k >= 0)
            look(rays, k, &party);
        else if (party.lights.count > 0)
            find_lights(&party);
        else
            break;
    }
}

/* ---- the face -------------------------------------------------------------------------------- */

nebel_result nebel_trace_clouds(nebel_cloud_workspace *workspace, size_t n, const nebel_ray *rays, size_t ray_stride,
                                double pixel_spread, const double *pixel_spreads, nebel_cloud_transfer *nodes,
                                size_t node_stride)
{
    nb_cloud_rays all = {.workspace = workspace,
                         .n = n,
                         .rays = rays,
                         .pixel_spread = pixel_spread,
                         .pixel_spreads = pixel_spreads,
                         .nodes = nodes,
                         .ray_stride = nb_stride_of(ray_stride, sizeof *rays),
                         .node_stride = nb_stride_of(node_stride, sizeof *nodes)};
    double unit[3];
    if (workspace == NULL || (n > 0 && (rays == NULL || nodes == NULL))) return NEBEL_ERROR_ARGUMENT;
    for (size_t i = 0; i < n; i++)
        if (!nb_air_is_ray(ray_at(&all, i), unit) || !(spread_at(&all, i) >= 0 && spread_at(&all, i) <= 10))
            return NEBEL_ERROR_ARGUMENT;
    trace(&all);
    return NEBEL_OK;
}
