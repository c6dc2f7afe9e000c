/* Fog at places and bounds of it along rays: what stochastic renderers ask. */
#include "medium_sampling.h"

#include "base/stride.h"
#include "math/vector.h"
#include "medium/density.h"

#include <nebel/nebel.h>

#include <math.h>

/* Bounds are this part higher than computed: densities and their bounds are rounded differently. */
#define ROUNDING 1e-9

/* ---- the media near a place or a ray --------------------------------------------------------- */

/* A walk over the endless media, then over those whose boxes the ray touches. */
typedef struct nb_majorant_walk {
    const nebel_snapshot *snapshot;
    size_t next_endless;
    nb_bvh_cursor cursor;
} nb_majorant_walk;

static void begin_walk(nb_majorant_walk *w, const nebel_snapshot *snapshot, const double origin[3],
                       const double direction[3], double t_max)
{
    double inverse[3];
    for (int i = 0; i < 3; i++) inverse[i] = fabs(direction[i]) > 1e-100 ? 1 / direction[i] : 1e100;
    w->snapshot = snapshot;
    w->next_endless = 0;
    nb_bvh_begin_ray(&w->cursor, &snapshot->bvh, origin, inverse, t_max);
}

/* NULL: there are no more. */
static const nb_medium *walk_on(nb_majorant_walk *w)
{
    const nebel_snapshot *s = w->snapshot;
    uint32_t box;
    if (w->next_endless < s->endless_count) return &s->media[s->endless[w->next_endless++]];
    return nb_bvh_next(&w->cursor, &box) ? &s->media[s->bounded[box]] : NULL;
}

static void begin_at(nb_majorant_walk *w, const nebel_snapshot *snapshot, const double place[3])
{
    static const double anywhere[3] = {1, 0, 0};
    begin_walk(w, snapshot, place, anywhere, 0);
}

/* ---- at a place ------------------------------------------------------------------------------ */

static int is_at(const nb_volume *body, const nebel_sample_point *place)
{
    if (place->distance >= 0 && !(body->start <= place->distance && place->distance < body->cutoff)) return 0;
    return nb_volume_holds(body, place->position);
}

/* The highest rank of what covers the place: fog below it is not there. */
static int64_t find_cover(const nebel_snapshot *snapshot, const nebel_sample_point *place)
{
    int64_t rank = INT64_MIN;
    nb_majorant_walk w;
    if (snapshot->covering_count == 0) return rank;
    begin_at(&w, snapshot, place->position);
    for (const nb_medium *medium; (medium = walk_on(&w)) != NULL;) {
        const nb_volume *body = &medium->body;
        if (nb_volume_covers(body) && body->rank > rank && is_at(body, place)) rank = body->rank;
    }
    return rank;
}

static int shows_at(const nb_medium *medium, const nebel_sample_point *place, int64_t cover)
{
    const nb_volume *body = &medium->body;
    return nb_volume_has_fog(body) && body->rank >= cover && is_at(body, place);
}

static void sample(const nebel_snapshot *snapshot, const nebel_sample_point *place, nebel_medium_properties *matter)
{
    const int64_t cover = find_cover(snapshot, place);
    nb_majorant_walk w;
    *matter = (nebel_medium_properties){{0}, {0}, {0}};
    begin_at(&w, snapshot, place->position);
    for (const nb_medium *medium; (medium = walk_on(&w)) != NULL;) {
        const nb_volume *body = &medium->body;
        if (!shows_at(medium, place, cover)) continue;
        const double density = nb_density_within(body, place->position);
        for (int c = 0; c < 3; c++) {
            matter->extinction[c] += density * body->extinction[c];
            matter->scattering[c] += density * body->extinction[c] * body->albedo[c];
            matter->emission[c] += density * nb_volume_glow(body, c);
        }
    }
}

void nb_sample_medium_transport(const nebel_snapshot *snapshot, const double position[3], nb_medium_transport *sum)
{
    const nebel_sample_point place = {{position[0], position[1], position[2]}, -1};
    const int64_t cover = find_cover(snapshot, &place);
    nb_majorant_walk w;
    begin_at(&w, snapshot, position);
    for (const nb_medium *medium; (medium = walk_on(&w)) != NULL;) {
        const nb_volume *body = &medium->body;
        if (!shows_at(medium, &place, cover)) continue;
        const double density = nb_density_within(body, position);
        for (int c = 0; c < 3; c++) {
            const double extinction = density * body->extinction[c], scattering = extinction * body->albedo[c];
            const double turned = scattering * (1 - medium->ahead);
            sum->extinction[c] += extinction;
            sum->scattering[c] += scattering;
            sum->turned[c] += turned;
            sum->forward[c] += turned * medium->turned_cosine;
            sum->emission[c] += density * nb_volume_glow(body, c);
        }
    }
}

static const char *fault_of_place(const nebel_sample_point *place)
{
    for (int i = 0; i < 3; i++)
        if (!(fabs(place->position[i]) <= NEBEL_MAX_LENGTH)) return "position must be finite and at most 1e15 m away";
    return isnan(place->distance) ? "distance must be a number" : NULL;
}

nebel_result nebel_sample_medium(const nebel_snapshot *snapshot, size_t n, const nebel_sample_point *places,
                                 size_t place_stride, nebel_medium_properties *matter, size_t matter_stride)
{
    if (snapshot == NULL) return NEBEL_ERROR_ARGUMENT;
    if (n > 0 && (places == NULL || matter == NULL))
        return nb_fail(&snapshot->log, NEBEL_ERROR_ARGUMENT, "places and matter: must not be NULL");
    place_stride = nb_stride_of(place_stride, sizeof *places);
    matter_stride = nb_stride_of(matter_stride, sizeof *matter);
    for (size_t i = 0; i < n; i++) {
        const nebel_sample_point *place = nb_stride_from(places, place_stride, i);
        const char *fault = fault_of_place(place);
        if (fault != NULL) return nb_fail(&snapshot->log, NEBEL_ERROR_ARGUMENT, "place %zu: %s", i, fault);
        sample(snapshot, place, nb_stride_to(matter, matter_stride, i));
    }
    return NEBEL_OK;
}

/* ---- what scatters --------------------------------------------------------------------------- */

/* Of a channel, or of all together. */
static double scattering_at(const nb_volume *body, const double position[3], int channel, double scattering[3])
{
    const double density = nb_density_within(body, position);
    for (int c = 0; c < 3; c++) scattering[c] = density * body->extinction[c] * body->albedo[c];
    return channel >= 0 ? scattering[channel] : scattering[0] + scattering[1] + scattering[2];
}

/* Takes the first volume with which the sum exceeds `wanted`; rounding may leave it to the last. Returns the sum. */
static double choose(const nebel_snapshot *snapshot, const nebel_sample_point *place, int channel, int64_t cover,
                     double wanted, nebel_scatterer *scatterer)
{
    double sum = 0;
    nb_majorant_walk w;
    begin_at(&w, snapshot, place->position);
    for (const nb_medium *medium; (medium = walk_on(&w)) != NULL && sum <= wanted;) {
        double scattering[3];
        if (!medium->body.lit || !shows_at(medium, place, cover)) continue;
        const double part = scattering_at(&medium->body, place->position, channel, scattering);
        if (!(part > 0)) continue;
        sum += part;
        *scatterer =
            (nebel_scatterer){medium->body.described_phase, {scattering[0], scattering[1], scattering[2]}, part};
    }
    return sum;
}

nebel_result nebel_sample_scatterer(const nebel_snapshot *snapshot, const nebel_sample_point *place, int channel,
                                    double chance, nebel_scatterer *scatterer)
{
    if (snapshot == NULL) return NEBEL_ERROR_ARGUMENT;
    if (place == NULL || scatterer == NULL)
        return nb_fail(&snapshot->log, NEBEL_ERROR_ARGUMENT, "place and scatterer: must not be NULL");
    const char *fault = fault_of_place(place);
    if (fault != NULL) return nb_fail(&snapshot->log, NEBEL_ERROR_ARGUMENT, "place: %s", fault);
    if (channel < -1 || channel > 2)
        return nb_fail(&snapshot->log, NEBEL_ERROR_ARGUMENT, "channel: must be 0, 1, 2 or, for all, -1");
    if (!(chance >= 0 && chance < 1))
        return nb_fail(&snapshot->log, NEBEL_ERROR_ARGUMENT, "chance: is %g; must be at least 0 and below 1", chance);
    const int64_t cover = find_cover(snapshot, place);
    *scatterer = (nebel_scatterer){.probability = 0};
    const double all = choose(snapshot, place, channel, cover, HUGE_VAL, scatterer);
    if (!(all > 0)) return NEBEL_OK;
    choose(snapshot, place, channel, cover, chance * all, scatterer);
    scatterer->probability /= all;
    return NEBEL_OK;
}

/* ---- along a ray ----------------------------------------------------------------------------- */

/* The ray from a place on, as all questions of one piece ask. */
typedef struct asked {
    const nebel_snapshot *snapshot;
    nb_line line;
    double start[3]; /* where the piece begins */
    double from;
    int ignore_distances;
} asked;

static void begin_on(nb_majorant_walk *w, const asked *a)
{
    begin_walk(w, a->snapshot, a->start, a->line.direction, HUGE_VAL);
}

static nb_overlap presence_of(const asked *a, const nb_volume *body, double to)
{
    if (!a->ignore_distances && (to <= body->start || a->from >= body->cutoff)) return NB_ABSENT;
    return nb_volume_presence(body, &a->line, a->from, to);
}

static double next_change_of(const asked *a, const nb_volume *body)
{
    double next = nb_volume_next_change(body, &a->line, a->from);
    if (a->ignore_distances) return next;
    if (body->start > a->from) next = fmin(next, body->start);
    return body->cutoff > a->from ? fmin(next, body->cutoff) : next;
}

/* 1/m: what the bound of a density is weighed with. An emission is worth one optical depth over its scale. */
static double strength_of(const nb_medium *medium, double scale)
{
    return medium->emits && isfinite(scale) ? fmax(medium->densest, 1 / scale) : medium->densest;
}

/* How long a piece may be for its bound to stay near the density, or for half an optical depth to fit in. */
static double find_length(const asked *a, const nb_medium *medium)
{
    const nb_volume *body = &medium->body;
    double length = nb_density_scale(body, &a->line, a->from);
    if (isinf(length) || nb_density_most(body, &a->line, a->from, HUGE_VAL) == 0) return HUGE_VAL;
    const double strength = strength_of(medium, length);
    while (length < NEBEL_MAX_LENGTH) {
        const double twice = 2 * length;
        if (nb_density_most(body, &a->line, a->from, a->from + twice) * strength * twice > 0.5) break;
        length = twice;
    }
    return length;
}

static double find_end(const asked *a)
{
    double end = HUGE_VAL;
    nb_majorant_walk w;
    begin_on(&w, a);
    for (const nb_medium *medium; (medium = walk_on(&w)) != NULL;) {
        const nb_volume *body = &medium->body;
        end = fmin(end, next_change_of(a, body));
        if (!nb_volume_has_fog(body) || isinf(nb_density_scale(body, &a->line, a->from))) continue;
        if (presence_of(a, body, nextafter(a->from, HUGE_VAL)) != NB_ABSENT)
            end = fmin(end, a->from + find_length(a, medium));
    }
    return fmax(end, nextafter(a->from, HUGE_VAL));
}

static int64_t find_cover_on(const asked *a, double end)
{
    int64_t rank = INT64_MIN;
    nb_majorant_walk w;
    if (a->snapshot->covering_count == 0) return rank;
    begin_on(&w, a);
    for (const nb_medium *medium; (medium = walk_on(&w)) != NULL;) {
        const nb_volume *body = &medium->body;
        if (nb_volume_covers(body) && body->rank > rank && presence_of(a, body, end) == NB_PRESENT) rank = body->rank;
    }
    return rank;
}

static void bound_piece(const asked *a, nebel_majorant_segment *bound)
{
    nb_majorant_walk w;
    *bound = (nebel_majorant_segment){find_end(a), {0}, {0}};
    const int64_t cover = find_cover_on(a, bound->end);
    begin_on(&w, a);
    for (const nb_medium *medium; (medium = walk_on(&w)) != NULL;) {
        const nb_volume *body = &medium->body;
        if (!nb_volume_has_fog(body) || body->rank < cover || presence_of(a, body, bound->end) == NB_ABSENT) continue;
        const double most = (1 + ROUNDING) * nb_density_most(body, &a->line, a->from, bound->end);
        for (int c = 0; c < 3; c++) {
            bound->extinction[c] += most * body->extinction[c];
            bound->emission[c] += most * nb_volume_glow(body, c);
        }
    }
}

nebel_result nebel_next_majorant(const nebel_snapshot *snapshot, const nebel_ray *ray, int ignore_distances,
                                 double from, nebel_majorant_segment *bound)
{
    if (snapshot == NULL) return NEBEL_ERROR_ARGUMENT;
    const nebel_log *log = &snapshot->log;
    if (ray == NULL || bound == NULL) return nb_fail(log, NEBEL_ERROR_ARGUMENT, "ray and bound: must not be NULL");
    if (!(from >= 0 && from < HUGE_VAL))
        return nb_fail(log, NEBEL_ERROR_ARGUMENT, "from: must be finite and 0 or more");
    asked a = {.snapshot = snapshot, .from = from, .ignore_distances = ignore_distances};
    for (int i = 0; i < 3; i++) {
        if (!(fabs(ray->origin[i]) <= NEBEL_MAX_LENGTH))
            return nb_fail(log, NEBEL_ERROR_ARGUMENT, "ray: origin must be finite and at most 1e15 m away");
        a.line.origin[i] = ray->origin[i];
        a.line.direction[i] = ray->direction[i];
    }
    if (!nb_vector_make_unit(a.line.direction))
        return nb_fail(log, NEBEL_ERROR_ARGUMENT, "ray: direction must be finite and not zero");
    for (int i = 0; i < 3; i++) a.start[i] = a.line.origin[i] + from * a.line.direction[i];
    bound_piece(&a, bound);
    return NEBEL_OK;
}

int nebel_is_extinction_gray(const nebel_snapshot *snapshot)
{
    if (snapshot == NULL) return 1;
    for (size_t i = 0; i < snapshot->medium_count; i++) {
        const double *extinction = snapshot->media[i].body.extinction;
        if (extinction[0] != extinction[1] || extinction[1] != extinction[2]) return 0;
    }
    return 1;
}
