#include "lit_oracle.h"

#include <float.h>
#include <math.h>
#include <string.h>

/* ---- light ----------------------------------------------------------------------------------- */

/* Which light is integrated: a point light by its number, or one of these. OWN is what needs no way to a light:
 * emission, sources and ambient light. */
enum { SUN = -1, OWN = -2 };

static const double degree = 3.141592653589793 / 180;

static double smoothed(double cosine, double outer, double inner)
{
    const double s = inner > outer ? fmin(fmax((cosine - outer) / (inner - outer), 0), 1) : cosine > outer;
    return s * s * (3 - 2 * s);
}

static double radius_of(const nebel_light *light)
{
    return light->radius > 0 ? light->radius : 1e-3;
}

/* What arrives of a point light without fog, at a place from which it is seen in the direction `towards`. */
static double fluence_of(const nebel_light *light, double distance, const double towards[3])
{
    const double radius = radius_of(light), square = fmax(distance * distance, radius * radius);
    const double fluence = 2 / (square * (1 + sqrt(fmax(0, 1 - radius * radius / square))));
    if (light->type != NEBEL_LIGHT_SPOT) return fluence;
    const double cosine = -lit_dot(towards, light->direction) / sqrt(lit_dot(light->direction, light->direction));
    return fluence * smoothed(cosine, cos(light->outer_angle * degree), cos(light->inner_angle * degree));
}

/* What arrives of a light at t, and from where. */
static void look_at_light(const lit_fog *fog, int light, const lit_line *l, double t, double arriving[3],
                          double towards[3])
{
    lit_line way;
    double depth[3], end = HUGE_VAL, fluence = 1;
    const nebel_light *point_light = light >= 0 ? &fog->scene->lights[light] : NULL;
    for (int k = 0; k < 3; k++) {
        way.o[k] = l->o[k] + t * l->d[k];
        way.d[k] = point_light != NULL ? point_light->position[k] - way.o[k] : fog->scene->sun.direction[k];
    }
    const double length = sqrt(lit_dot(way.d, way.d));
    for (int k = 0; k < 3; k++) towards[k] = way.d[k] = way.d[k] / length;
    if (point_light != NULL) fluence = fluence_of(point_light, length, towards);
    if (point_light != NULL) end = fmax(length - point_light->radius, 0);
    const double *power = point_light != NULL ? point_light->intensity : fog->scene->sun.irradiance;
    memset(arriving, 0, 3 * sizeof arriving[0]);
    if (!(fluence > 0)) return;
    lit_fog_depth(fog, &way, end, depth);
    for (int c = 0; c < 3; c++) arriving[c] = fluence * exp(-depth[c]) * power[c];
}

/* ---- along the ray --------------------------------------------------------------------------- */

/* A piece of the ray with the same fog all along. */
typedef struct walk {
    const lit_fog *fog;
    const lit_line *ray;
    int light;
    lit_effort effort;
    double ray_length;
    lit_marks there;
    double start, end, depth[3]; /* of the piece; up to there */
    double sum[3], off;
    long nodes;
} walk;

/* Behind so much fog there is nothing to see: of light 1e-20. */
enum { MAX_DEPTH = 46 };

static int is_hidden(const double depth[3])
{
    return fmin(fmin(depth[0], depth[1]), depth[2]) > MAX_DEPTH;
}

static void add_own(const walk *w, const nebel_volume_desc *v, double density, double glow[3])
{
    for (int c = 0; c < 3; c++)
        glow[c] +=
            density * (v->emission[c] + v->extinction[c] * (v->source[c] + v->albedo[c] * w->fog->scene->ambient[c]));
}

/* Not so near to an end of the piece that rounding may take the place out of the fog: where light runs along a face, it is
 * full there and all but gone within. */
static double place_within(const walk *w, double t)
{
    const double margin = 64 * DBL_EPSILON * (1 + w->end);
    return w->end - w->start > 2 * margin ? fmin(fmax(t, w->start + margin), w->end - margin) : t;
}

static void light_at(walk *w, double t, double value[3])
{
    double depth[3] = {w->depth[0], w->depth[1], w->depth[2]}, arriving[3] = {1, 1, 1}, towards[3], glow[3] = {0, 0, 0};
    lit_fog_add_depth(w->fog, w->ray, &w->there, w->start, t, depth);
    w->nodes++;
    for (int c = 0; c < 3; c++) value[c] = 0;
    if (is_hidden(depth)) return;
    if (w->light != OWN) look_at_light(w->fog, w->light, w->ray, place_within(w, t), arriving, towards);
    if (!(arriving[0] + arriving[1] + arriving[2] > 0)) return;
    const double cosine = w->light == OWN ? 0 : fmin(fmax(lit_dot(w->ray->d, towards), -1), 1);
    for (size_t i = 0; i < w->there.count; i++) {
        const nebel_volume_desc *v = &w->fog->scene->volumes[w->there.volumes[i]];
        const double density = lit_fog_density(w->fog, w->there.volumes[i], w->ray, t);
        if (w->light == OWN) add_own(w, v, density, glow);
        if (w->light == OWN || !(v->albedo[0] + v->albedo[1] + v->albedo[2] > 0)) continue;
        const double scattered = nebel_evaluate_phase(&v->phase, cosine) * density;
        for (int c = 0; c < 3; c++) glow[c] += v->extinction[c] * v->albedo[c] * scattered;
    }
    for (int c = 0; c < 3; c++) value[c] = glow[c] * exp(-depth[c]) * arriving[c];
}

typedef struct part {
    double sum[3], off;
} part;

/* Kronrod's rule of 15 nodes and Gauss's of 7 among them (Kronrod 1965), on [-1, 1]. The difference of both is far more than
 * the first is off by where light is smooth. */
enum { NODES = 8 };
static const double nodes[NODES] = {0,
                                    0.207784955007898467600689403773245,
                                    0.405845151377397166906606412076961,
                                    0.586087235467691130294144691693350,
                                    0.741531185599394439863864773280788,
                                    0.864864423359769072789712788640926,
                                    0.949107912342758524526189684047851,
                                    0.991455371120812639206854697526329};
static const double kronrod_weights[NODES] = {0.209482141084727828012999174891714, 0.204432940075298892414161999234649,
                                              0.190350578064785409913256402421014, 0.169004726639267902826583426598550,
                                              0.140653259715525918745189590510238, 0.104790010322250183839876322541518,
                                              0.063092092629978553290700663189204, 0.022935322010529224963732008058970};
static const double gauss_weights[NODES / 2] = {
    0.417959183673469387755102040816327, 0.381830050505118944950369775488975, 0.279705391489276667901467771423780,
    0.129484966168869693270611432679082};

/* What the polynomial through all nodes is at 1, from those on the side of 0 to -1 and from the others: a kink beyond the last
 * node moves what is there, and no node. */
static const double at_end[2][NODES] = {
    {-0.11292917291898148356, 0.091687296848570965774, -0.073778979644262450764, 0.057719118618911434715,
     -0.043250815978173977256, 0.030438309530367932990, -0.018451577046963430127, 0.006238528645340282776},
    {0, 0.13978343178290837655, -0.17457035156224131965, 0.22117597022489271509, -0.29141869591999060069,
     0.42004719972088290489, -0.70667399340457376908, 1.4539837311033124183}};

/* How much light may be between the last nodes and the ends that they do not show, as a part of half a panel. */
static double unseen_at_ends(walk *w, double a, double b, double first[3], double last[3])
{
    double at_a[3], at_b[3], most = 0;
    light_at(w, a, at_a);
    light_at(w, b, at_b);
    for (int c = 0; c < 3; c++) most = fmax(most, fmax(fabs(at_a[c] - first[c]), fabs(at_b[c] - last[c])));
    return most * (1 - nodes[NODES - 1]);
}

static part integrate(walk *w, double a, double b)
{
    const double middle = 0.5 * (a + b), half = 0.5 * (b - a);
    double kronrod[3] = {0, 0, 0}, gauss[3] = {0, 0, 0}, first[3] = {0, 0, 0}, last[3] = {0, 0, 0};
    part p = {.off = 0};
    for (int i = 0; i < NODES; i++)
        for (int side = i == 0 ? 1 : -1; side <= 1; side += 2) {
            double value[3];
            light_at(w, middle + side * half * nodes[i], value);
            for (int c = 0; c < 3; c++) kronrod[c] += kronrod_weights[i] * value[c];
            for (int c = 0; c < 3 && i % 2 == 0; c++) gauss[c] += gauss_weights[i / 2] * value[c];
            for (int c = 0; c < 3; c++) {
                first[c] += at_end[i > 0 && side < 0][i] * value[c];
                last[c] += at_end[i > 0 && side > 0][i] * value[c];
            }
        }
    for (int c = 0; c < 3; c++) {
        p.sum[c] = half * kronrod[c];
        p.off = fmax(p.off, half * fabs(kronrod[c] - gauss[c]));
    }
    p.off = fmax(p.off, half * unseen_at_ends(w, a, b, first, last));
    return p;
}

static void refine(walk *w, double a, double b, const part *whole, double allowed, int level)
{
    const double middle = 0.5 * (a + b);
    if (level > 0 && whole->off > allowed && middle > a && middle < b) {
        const part first = integrate(w, a, middle), last = integrate(w, middle, b);
        refine(w, a, middle, &first, allowed, level - 1);
        refine(w, middle, b, &last, allowed, level - 1);
        return;
    }
    for (int c = 0; c < 3; c++) w->sum[c] += whole->sum[c];
    w->off += whole->off;
}

/* ---- panels ---------------------------------------------------------------------------------- */

/* Where the ray crosses the cone of all directions at an angle from the point light's axis. */
static void cut_cone(const nebel_light *light, double angle, const lit_line *l, lit_cuts *cuts)
{
    double p[3];
    const double cosine = cos(angle * degree), share = cosine * cosine * lit_dot(light->direction, light->direction);
    for (int k = 0; k < 3; k++) p[k] = l->o[k] - light->position[k];
    const double x = lit_dot(p, light->direction), y = lit_dot(l->d, light->direction);
    const double a = y * y - share, b = x * y - share * lit_dot(p, l->d), c = x * x - share * lit_dot(p, p);
    const double square = b * b - a * c;
    if (!(square >= 0)) return;
    const double sum = -(b + copysign(sqrt(square), b));
    lit_add_cut(cuts, sum / a);
    lit_add_cut(cuts, c / sum);
}

static void cut_at_light(const nebel_light *light, const lit_line *l, lit_cuts *cuts)
{
    double p[3];
    for (int k = 0; k < 3; k++) p[k] = light->position[k] - l->o[k];
    const double nearest = lit_dot(p, l->d), radius = radius_of(light);
    const double square = radius * radius - (lit_dot(p, p) - nearest * nearest);
    lit_add_cut(cuts, nearest);
    if (square > 0) lit_add_cut(cuts, nearest - sqrt(square));
    if (square > 0) lit_add_cut(cuts, nearest + sqrt(square));
    if (light->type != NEBEL_LIGHT_SPOT) return;
    cut_cone(light, light->outer_angle, l, cuts);
    cut_cone(light, light->inner_angle, l, cuts);
}

/* Panels that become shorter by a factor towards an end, where light may be in a skin of any depth. */
static void add_skin(const walk *w, double from, double length, double depth, lit_cuts *cuts)
{
    const int is_close = w->effort == LIT_CLOSE;
    const double factor = is_close ? 6 : 10, least = is_close ? 1e-9 : fmax(1e-9, 1e-4 / depth);
    for (double x = least; x < 0.4; x *= factor) lit_add_cut(cuts, from + x * length);
}

static void add_panels(const walk *w, double a, double b, lit_cuts *cuts)
{
    const int count = w->effort == LIT_CLOSE ? 400 : 2 + (int)(14 * (b - a) / w->ray_length);
    for (int i = 1; i < count; i++) lit_add_cut(cuts, a + (b - a) * i / count);
}

/* A panel from a to b of a piece from `first` to `last`. Halves it where it is deep, so that light behind a layer in which
 * fog grows denser is found; what is hidden is left out. Adds to what is in front of b. */
static void cut_panel(const walk *w, double a, double b, const lit_span *piece, double seen[3], int level,
                      lit_cuts *cuts)
{
    const double middle = 0.5 * (a + b);
    double depth[3] = {0, 0, 0};
    if (is_hidden(seen)) return;
    lit_fog_add_depth(w->fog, w->ray, &w->there, a, b, depth);
    if (fmin(fmin(depth[0], depth[1]), depth[2]) > 4 && level > 0 && middle > a && middle < b) {
        cut_panel(w, a, middle, piece, seen, level - 1, cuts);
        cut_panel(w, middle, b, piece, seen, level - 1, cuts);
        return;
    }
    const double deep = depth[0] + depth[1] + depth[2];
    const int is_deep = w->effort == LIT_CLOSE && deep > 0.3;
    if (a == piece->enter || is_deep) add_skin(w, a, b - a, deep, cuts);
    if (b == piece->leave || is_deep) add_skin(w, b, a - b, deep, cuts);
    lit_add_cut(cuts, b);
    for (int c = 0; c < 3; c++) seen[c] += depth[c];
}

/* From a to b, as far as there is something to see. */
static void cut_piece(const walk *w, double a, double b, lit_cuts *cuts)
{
    static lit_cuts inner;
    inner.count = 0;
    for (size_t i = 0; i < w->there.count; i++) lit_fog_cut(w->fog, w->there.volumes[i], w->ray, a, b, &inner);
    if (w->light >= 0) cut_at_light(&w->fog->scene->lights[w->light], w->ray, &inner);
    add_panels(w, a, b, &inner);
    lit_add_cut(&inner, b);
    lit_sort(inner.at, inner.count);
    double last = a, seen[3] = {w->depth[0], w->depth[1], w->depth[2]};
    cuts->count = 0;
    lit_add_cut(cuts, a);
    for (size_t i = 0; i < inner.count; i++) {
        if (!(inner.at[i] > last && inner.at[i] <= b)) continue;
        cut_panel(w, last, inner.at[i], &(lit_span){a, b}, seen, 250, cuts);
        last = inner.at[i];
    }
    lit_sort(cuts->at, cuts->count);
}

/* Whether a few roundings of places at the start of a piece change its depth: then no place in the skin can be told from another. */
static int is_too_dense(const walk *w, double a, double b)
{
    double depth[3] = {0, 0, 0};
    lit_fog_add_depth(w->fog, w->ray, &w->there, a, fmin(b, a * (1 + 1e-13)), depth);
    return fmax(fmax(depth[0], depth[1]), depth[2]) > 1e-4;
}

enum { MAX_NODES = 4000000 };

static int pass_piece(walk *w, double a, double b)
{
    static lit_cuts cuts;
    static part parts[LIT_MAX_CUTS];
    double largest = 1e-12;
    if (is_too_dense(w, a, b)) return 0;
    cut_piece(w, a, b, &cuts);
    for (size_t i = 0; i + 1 < cuts.count; i++) {
        parts[i] = integrate(w, cuts.at[i], cuts.at[i + 1]);
        for (int c = 0; c < 3; c++) largest = fmax(largest, fmax(w->sum[c], parts[i].sum[c]));
    }
    for (size_t i = 0; i + 1 < cuts.count; i++) {
        if (cuts.at[i + 1] > cuts.at[i]) refine(w, cuts.at[i], cuts.at[i + 1], &parts[i], 1e-8 * largest, 40);
        if (w->nodes > MAX_NODES) return 0;
    }
    return 1;
}

static int add_light(walk *w, const lit_map *m, lit_truth *truth)
{
    for (size_t i = 0; i + 1 < m->event_count && !is_hidden(w->depth); i++) {
        const double a = m->events[i], b = m->events[i + 1];
        if (!(b > a)) continue;
        lit_fog_mark(w->fog, m, 0.5 * (a + b), &w->there);
        if (w->there.count == 0) continue;
        w->start = a;
        w->end = b;
        if (!pass_piece(w, a, b)) return 0;
        lit_fog_add_depth(w->fog, w->ray, &w->there, a, b, w->depth);
    }
    for (int c = 0; c < 3; c++) truth->in_scattering[c] += w->sum[c];
    truth->uncertainty += w->off;
    return 1;
}

/* Where there is fog, all pieces together. */
static double foggy_length(const lit_fog *fog, const lit_map *m)
{
    lit_marks marks;
    double sum = 0;
    for (size_t i = 0; i + 1 < m->event_count; i++) {
        if (!(m->events[i + 1] > m->events[i])) continue;
        lit_fog_mark(fog, m, 0.5 * (m->events[i] + m->events[i + 1]), &marks);
        if (marks.count > 0) sum += m->events[i + 1] - m->events[i];
    }
    return sum;
}

static int has_own_light(const lit_scene *scene)
{
    double sum = 0;
    for (int c = 0; c < 3; c++) sum += scene->ambient[c];
    for (size_t i = 0; i < scene->volume_count; i++)
        for (int c = 0; c < 3; c++) sum += scene->volumes[i].emission[c] + scene->volumes[i].source[c];
    return sum > 0;
}

int lit_oracle_trace(const lit_fog *fog, const nebel_ray *ray, lit_effort effort, lit_truth *truth)
{
    static lit_map m;
    const lit_scene *scene = fog->scene;
    lit_line l;
    double depth[3];
    const double length = sqrt(lit_dot(ray->direction, ray->direction));
    for (int k = 0; k < 3; k++) {
        l.o[k] = ray->origin[k];
        l.d[k] = ray->direction[k] / length;
    }
    *truth = (lit_truth){.uncertainty = 0};
    lit_fog_map(fog, &l, ray->t_max, &m);
    const int is_sunlit = scene->sun.irradiance[0] + scene->sun.irradiance[1] + scene->sun.irradiance[2] > 0;
    for (int light = OWN; light < (int)scene->light_count; light++) {
        if ((light == OWN && !has_own_light(scene)) || (light == SUN && !is_sunlit)) continue;
        walk w = {.fog = fog, .ray = &l, .light = light, .effort = effort, .ray_length = foggy_length(fog, &m)};
        if (!add_light(&w, &m, truth)) return 0;
    }
    lit_fog_depth(fog, &l, ray->t_max, depth);
    for (int c = 0; c < 3; c++) truth->transmittance[c] = exp(-depth[c]);
    return 1;
}
