/* Light of clouds that pixels hide: of a pixel as wide as cumulus cells are, one place knows nothing of lit and shaded
 * sides, nor of which of them are seen. What it shows of a layer is the mean over places in its clouds all around the
 * planet, by how much of each is seen that way, which hangs on the height of the sun, on how steep the ray is and on
 * how far aside of the sun it leads: a table of three, whose entries are found when they are asked for. Of heights it
 * knows nothing: the mean of clouds lets a pixel see deeper into a layer than thin rays do, which end on the first
 * cloud.
 *
 * The places stay with the clouds, so that the table is the same at all times, and it is the same for all rays, so that
 * such pixels have no grain. */
#include "cloud_density.h"
#include "cloud_lighting.h"

#include "math/vector.h"

#include <math.h>
#include <string.h>

#define NB_DOUBLE
#include "formulas/prelude.h"

#include "formulas/elementary.inc"

#define PI 3.14159265358979323846

/* Of cumulus cells, wide: what is found finely, and the least width and the one beyond twice of which only the table
 * counts. */
#define FINE_PART 0.005f
#define NEAR_PART 0.03f
#define FAR_PART 0.15f

/* Of the layer's height, wide: ways up, down and away from the sun, as smooth as between nodes. */
#define AROUND_PART 0.13

/* Cosine to straight up of the flattest views of the table. */
#define FLATTEST 0.025f

enum { TRIES = 24576 };

/* Rays' cosines to straight up. From above clouds show what the sun lights, from below what is in their shadow, however flat the
 * ray: between the two in the middle nothing is linear (nb_cloud_prefilter_at). */
static const float views[NB_PREFILTER_VIEWS] = {-1,       -.82f, -.66f, -.5f, -.28f, -.09f, -FLATTEST,
                                                FLATTEST, .09f,  .28f,  .5f,  .66f,  .82f,  1};
static const float suns[NB_PREFILTER_SUNS] = {-.15f, -.05f, 0, .05f, .1f, .2f, .3f, .43f, .55f, .68f, .84f, 1};
static const float turns[NB_PREFILTER_TURNS] = {-1, 0,
                                                1}; /* cosines between ray and sun, both seen from straight above */

/* ---- places ---------------------------------------------------------------------------------- */

/* Evenly over the planet and the layer's height, and each with a direction along the ground. Roberts, The Unreasonable
 * Effectiveness of Quasirandom Sequences, 2018. */
static void spread(int i, double unit[3], double *height, double *turn)
{
    double parts[4];
    static const double steps[4] = {0.8566748838545029, 0.7338918566271260, 0.6287067210378087, 0.5385972572236101};
    for (int k = 0; k < 4; k++) parts[k] = 0.5 + i * steps[k] - floor(0.5 + i * steps[k]);
    const double y = 1 - 2 * parts[0], level = sqrt(1 - y * y);
    unit[0] = level * cos(2 * PI * parts[1]);
    unit[1] = y;
    unit[2] = level * sin(2 * PI * parts[1]);
    *height = parts[2];
    *turn = 2 * PI * parts[3];
}

static void find_places(const nebel_cloud_lighting *view, int k, nb_cloud_prefilter *prefilter)
{
    const nb_cloud_layer *layer = &view->clouds->layers[k];
    const nb_cloud_rotation *pose = &view->poses[k];
    nb_cloud_density_query looks = {.count = 0, .are_of_rays = 0};
    for (int first = 0; first < TRIES && prefilter->count < NB_PREFILTER_PLACES; first += NB_CLOUD_LANES) {
        nb_prefilter_point places[NB_CLOUD_LANES];
        float extinction[NB_CLOUD_LANES];
        for (int i = 0; i < NB_CLOUD_LANES; i++) {
            double own[3], height;
            spread(first + i, own, &height, &places[i].turn);
            for (int c = 0; c < 3; c++)
                places[i].from[c] = (layer->low + height * (layer->high - layer->low)) *
                                    (pose->turn[0][c] * own[0] + pose->turn[1][c] * own[1] + pose->turn[2][c] * own[2]);
            nb_cloud_ask(&looks, pose, places[i].from, FINE_PART * layer->size);
        }
        nb_cloud_find_means(view->clouds, k, &looks, extinction);
        for (int i = 0; i < NB_CLOUD_LANES && prefilter->count < NB_PREFILTER_PLACES; i++) {
            places[i].extinction = extinction[i];
            if (extinction[i] > 0) prefilter->places[prefilter->count++] = places[i];
        }
    }
}

static void set_places(nebel_cloud_workspace *workspace, int k, nb_cloud_prefilter *prefilter)
{
    const float wide = (float)(AROUND_PART / (double)workspace->view->clouds->layers[k].per_thickness);
    find_places(workspace->view, k, prefilter);
    for (int i = 0; i < prefilter->count; i++) {
        nb_prefilter_point *place = &prefilter->places[i];
        double up[3], down[3];
        const double radius = nb_vector_length(place->from);
        for (int c = 0; c < 3; c++) up[c] = place->from[c] / radius, down[c] = -up[c];
        place->up = nb_cloud_depth_along(workspace, place->from, up, wide, wide, 1);
        place->down = nb_cloud_depth_along(workspace, place->from, down, wide, wide, 1);
    }
    prefilter->is_set = 1;
}

/* ---- entries --------------------------------------------------------------------------------- */

/* A direction of such a cosine to straight up, turned so far about it. */
static void direct(const nb_prefilter_point *place, double cosine, double turn, double direction[3])
{
    double up[3], east[3], north[3];
    const double radius = nb_vector_length(place->from), sine = sqrt(1 - cosine * cosine);
    for (int c = 0; c < 3; c++) up[c] = place->from[c] / radius;
    nb_vector_perpendicular(up, east);
    nb_vector_cross(up, east, north);
    for (int c = 0; c < 3; c++) direction[c] = cosine * up[c] + sine * (cos(turn) * east[c] + sin(turn) * north[c]);
}

typedef struct nb_fine {
    float width, first;
} nb_fine;

static nb_fine fine_of(const nb_cloud_layer *layer)
{
    const float width = FINE_PART * layer->size, first = nb_smaller(2 * width, 0.1f / layer->per_thickness);
    return (nb_fine){width, first};
}

static const nb_cloud_depths *depths_under(nebel_cloud_workspace *workspace, int k, nb_cloud_prefilter *prefilter,
                                           int sun)
{
    const nb_cloud_layer *layer = &workspace->view->clouds->layers[k];
    const nb_fine fine = fine_of(layer);
    const float wide = (float)(AROUND_PART / (double)layer->per_thickness);
    if (prefilter->has_depths[sun]) return prefilter->depths[sun];
    for (int i = 0; i < prefilter->count; i++) {
        const nb_prefilter_point *place = &prefilter->places[i];
        double to[3], away[3];
        direct(place, (double)suns[sun], place->turn, to);
        for (int c = 0; c < 3; c++) away[c] = -to[c];
        prefilter->depths[sun][i] = (nb_cloud_depths){
            .sun = nb_cloud_depth_along(workspace, place->from, to, fine.first, fine.width, 1),
            .away = nb_cloud_depth_along(workspace, place->from, away, wide, wide, 1),
            .up = place->up,
            .down = place->down,
        };
    }
    prefilter->has_depths[sun] = 1;
    return prefilter->depths[sun];
}

/* No ray from below a layer is flatter than one that just passes its base. */
#define PAST_BASE 1.02

static double steepness_of(const nb_cloud_layer *layer, const nb_prefilter_point *place, int view)
{
    const double part = layer->low / nb_vector_length(place->from), least = sqrt(fmax(0, 1 - part * part));
    return views[view] < 0 ? (double)views[view] : fmin(1, fmax((double)views[view], PAST_BASE * least));
}

/* What counts is how places differ: where none is seen, too, some are seen more than others. */
static const nb_prefilter_weight *seen_by(nebel_cloud_workspace *workspace, int k, nb_cloud_prefilter *prefilter,
                                          int view, int turn)
{
    const nb_cloud_layer *layer = &workspace->view->clouds->layers[k];
    const nb_fine fine = fine_of(layer);
    const float apart = layer->apart;
    nb_prefilter_weight *seen = prefilter->seen[view][turn];
    float least = HUGE_VALF;
    if (prefilter->has_seen[view][turn]) return seen;
    for (int i = 0; i < prefilter->count; i++) {
        const nb_prefilter_point *place = &prefilter->places[i];
        double ray[3];
        direct(place, steepness_of(layer, place, view), place->turn + acos((double)turns[turn]), ray);
        for (int c = 0; c < 3; c++) ray[c] = -ray[c];
        seen[i].whole = nb_cloud_depth_along(workspace, place->from, ray, fine.first, fine.width, 1);
        least = nb_smaller(least, seen[i].whole);
    }
    for (int i = 0; i < prefilter->count; i++) {
        const double depth = (double)(seen[i].whole - least);
        seen[i].whole = prefilter->places[i].extinction * (float)nb_exp(-depth);
        seen[i].apart = prefilter->places[i].extinction * (float)nb_exp(-(double)apart * depth);
    }
    prefilter->has_seen[view][turn] = 1;
    return seen;
}

static void add_parts(nb_cloud_irradiance *sum, const nb_cloud_irradiance *parts, float whole, float apart)
{
    sum->left += whole * parts->left;
    sum->above += whole * parts->above;
    sum->below += whole * parts->below;
    sum->left_wide += apart * parts->left_wide;
    sum->often += apart * parts->often;
}

static const nb_cloud_irradiance *entry_of(nebel_cloud_workspace *workspace, int k, const int at[3])
{
    const nb_cloud_layer *layer = &workspace->view->clouds->layers[k];
    nb_cloud_prefilter *prefilter = &workspace->prefilters[k];
    nb_cloud_irradiance *mean = &prefilter->means[at[0]][at[1]][at[2]];
    if (prefilter->has_mean[at[0]][at[1]][at[2]]) return mean;
    const nb_cloud_depths *depths = depths_under(workspace, k, prefilter, at[2]);
    const nb_prefilter_weight *seen = seen_by(workspace, k, prefilter, at[0], at[1]);
    nb_prefilter_weight sum = {0, 0};
    for (int i = 0; i < prefilter->count; i++)
        sum = (nb_prefilter_weight){sum.whole + seen[i].whole, sum.apart + seen[i].apart};
    for (int i = 0; i < prefilter->count; i++) {
        const float sun = suns[at[2]], rise = (float)steepness_of(layer, &prefilter->places[i], at[0]);
        const float ahead = sun * rise + turns[at[1]] * sqrtf((1 - sun * sun) * (1 - rise * rise));
        const nb_cloud_irradiance parts = nb_cloud_parts_of(layer, &depths[i], &(nb_cloud_sight){sun, rise, ahead});
        add_parts(mean, &parts, seen[i].whole / sum.whole, seen[i].apart / sum.apart);
    }
    prefilter->has_mean[at[0]][at[1]][at[2]] = 1;
    return mean;
}

/* ---- lookup ---------------------------------------------------------------------------------- */

/* *low and the part of the way to the next node. */
static float place_among(const float *nodes, int count, float x, int *low)
{
    int i = 0;
    while (i < count - 2 && x > nodes[i + 1]) i++;
    *low = i;
    return nb_larger(0, nb_smaller(1, (x - nodes[i]) / (nodes[i + 1] - nodes[i])));
}

float nb_cloud_prefilter_part(nebel_cloud_workspace *workspace, int k, float width)
{
    const float size = workspace->view->clouds->layers[k].size;
    const float part = nb_larger(0, nb_smaller(1, (width / size - NEAR_PART) / (FAR_PART - NEAR_PART)));
    nb_cloud_prefilter *prefilter = &workspace->prefilters[k];
    if (part > 0 && !prefilter->is_set) set_places(workspace, k, prefilter);
    return prefilter->count > 0 ? part : 0;
}

/* The part of what is seen from below between the flattest views: a ray keeps the side on which it came into the layer up to
 * where it is steep; from within, it has the more of a side the nearer to that it begins. */
static float part_below(float view, float entered)
{
    const float steep = nb_larger(-1, nb_smaller(1, view / FLATTEST)), below = 1 - 2 * entered;
    return nb_larger(0, nb_smaller(1, 0.5f + 0.5f * steep + below * (1 - fabsf(steep))));
}

nb_cloud_irradiance nb_cloud_prefilter_at(nebel_cloud_workspace *workspace, int k, const double up[3],
                                          const double ray[3], float entered)
{
    const double *to_sun = workspace->view->sun.direction;
    const double sun = nb_vector_dot(up, to_sun), view = nb_vector_dot(up, ray);
    const double across = sqrt(fmax(0, (1 - sun * sun) * (1 - view * view)));
    const double turn = across > 1e-6 ? (nb_vector_dot(ray, to_sun) - sun * view) / across : 0;
    int low[3];
    float part[3] = {place_among(views, NB_PREFILTER_VIEWS, (float)view, &low[0]),
                     place_among(turns, NB_PREFILTER_TURNS, (float)turn, &low[1]),
                     place_among(suns, NB_PREFILTER_SUNS, (float)sun, &low[2])};
    if (low[0] == NB_PREFILTER_VIEWS / 2 - 1) part[0] = part_below((float)view, entered);
    nb_cloud_irradiance sum = {0, 0, 0, 0, 0};
    for (int corner = 0; corner < 8; corner++) {
        float weight = 1;
        int at[3];
        for (int i = 0; i < 3; i++) {
            at[i] = low[i] + (corner >> i & 1);
            weight *= corner >> i & 1 ? part[i] : 1 - part[i];
        }
        if (weight > 0) add_parts(&sum, entry_of(workspace, k, at), weight, weight);
    }
    return sum;
}

nb_cloud_irradiance nb_cloud_mix_parts(const nb_cloud_irradiance *a, const nb_cloud_irradiance *b, float part)
{
    nb_cloud_irradiance sum = {0, 0, 0, 0, 0};
    add_parts(&sum, a, 1 - part, 1 - part);
    add_parts(&sum, b, part, part);
    return sum;
}
