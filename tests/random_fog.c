#include "random_fog.h"

#include "dice.h"

#include "math/vector.h"

#include <math.h>
#include <string.h>

/* ---- numbers and vectors --------------------------------------------------------------------- */

static int chance(uint64_t *state, double probability)
{
    return dice(state, 0, 1) < probability;
}

static double power_of_ten(uint64_t *state, double from, double to)
{
    return pow(10, dice(state, from, to));
}

/* Every fifth number is round, so that faces coincide and rays run in them. */
static double place(uint64_t *state, double from, double to)
{
    const double x = dice(state, from, to);
    return chance(state, .2) ? floor(x) : x;
}

static void places(uint64_t *state, double from, double to, double v[3])
{
    for (int k = 0; k < 3; k++) v[k] = place(state, from, to);
}

static void random_unit(uint64_t *state, double v[3])
{
    double length;
    do {
        for (int k = 0; k < 3; k++) v[k] = dice(state, -1, 1);
        length = nb_vector_length(v);
    } while (length > 1 || length < .01);
    for (int k = 0; k < 3; k++) v[k] /= length;
}

/* ---- shapes ---------------------------------------------------------------------------------- */

static const nebel_shape_type leaves[] = {NEBEL_SHAPE_BOX,      NEBEL_SHAPE_SPHERE,     NEBEL_SHAPE_ELLIPSOID,
                                          NEBEL_SHAPE_CYLINDER, NEBEL_SHAPE_CAPSULE,    NEBEL_SHAPE_CONE,
                                          NEBEL_SHAPE_CONVEX,   NEBEL_SHAPE_HALF_SPACE, NEBEL_SHAPE_WORLD};
enum { BOUNDED = 7, LEAVES = 9 };

static void add_transform(uint64_t *state, nebel_transform *t)
{
    places(state, -3, 3, t->position);
    if (chance(state, .8))
        for (int k = 0; k < 4; k++) t->rotation[k] = dice(state, -1, 1);
    const int style = dice_below(state, 3);
    const double same = dice(state, .6, 1.6);
    for (int k = 0; k < 3; k++) t->scale[k] = style == 0 ? 0 : style == 1 ? same : dice(state, .6, 1.6);
    if (style == 2 && chance(state, .3)) t->scale[dice_below(state, 3)] *= -1;
}

static void make_planes(random_fog *fog, uint64_t *state, const double center[3], nebel_shape *shape)
{
    nebel_plane *const planes = &fog->planes[fog->plane_count];
    shape->planes = planes;
    shape->plane_count = (size_t)(6 + dice_below(state, RANDOM_FOG_PLANES - 5));
    fog->plane_count += shape->plane_count;
    for (size_t i = 0; i < shape->plane_count; i++) {
        random_unit(state, planes[i].normal);
        const double stretch = chance(state, .2) ? power_of_ten(state, -2, 2) : 1;
        for (int k = 0; k < 3; k++) planes[i].normal[k] *= stretch;
        planes[i].distance = nb_vector_dot(planes[i].normal, center) + stretch * dice(state, 2, 7);
    }
}

static void make_leaf(random_fog *fog, uint64_t *state, nebel_shape_type type, nebel_shape *s)
{
    *s = (nebel_shape){.type = type};
    double center[3], half[3];
    places(state, -12, 12, center);
    for (int k = 0; k < 3; k++) half[k] = floor(dice(state, 2, 16)) / 2;
    for (int k = 0; k < 3; k++) {
        s->center[k] = s->from[k] = center[k];
        s->min[k] = center[k] - half[k];
        s->max[k] = center[k] + half[k];
        s->radii[k] = dice(state, 1.5, 9);
    }
    places(state, -12, 12, s->to);
    s->radius = type == NEBEL_SHAPE_SPHERE ? place(state, 2, 9) : place(state, 1, 6);
    s->radius_from = chance(state, .3) ? 0 : place(state, 1, 5);
    s->radius_to = chance(state, .2) ? s->radius_from + 1 : place(state, 1, 6);
    places(state, -3, 3, s->point);
    random_unit(state, s->normal);
    if (type == NEBEL_SHAPE_CONVEX) make_planes(fog, state, center, s);
    if (nb_vector_length((const double[3]){s->to[0] - s->from[0], s->to[1] - s->from[1], s->to[2] - s->from[2]}) < .1)
        s->to[1] += 5;
    if (type != NEBEL_SHAPE_WORLD && chance(state, .3)) add_transform(state, &s->transform);
}

static void make_parts(random_fog *fog, uint64_t *state, int level, nebel_shape *s)
{
    *s = (nebel_shape){.type = chance(state, .5) ? NEBEL_SHAPE_UNION : NEBEL_SHAPE_INTERSECTION};
    s->part_count = (size_t)(2 + dice_below(state, RANDOM_FOG_PARTS_EACH - 1));
    nebel_shape *const parts = &fog->parts[fog->part_count];
    fog->part_count += s->part_count;
    s->parts = parts;
    for (size_t i = 0; i < s->part_count; i++) {
        if (level == 0 && chance(state, .3))
            make_parts(fog, state, 1, &parts[i]);
        else
            make_leaf(fog, state, leaves[dice_below(state, LEAVES)], &parts[i]);
    }
    if (chance(state, .3)) add_transform(state, &s->transform);
}

/* ---- profiles and light ---------------------------------------------------------------------- */

static void make_density(uint64_t *state, const nebel_shape *shape, nebel_density *d)
{
    const int round = shape->type == NEBEL_SHAPE_SPHERE || shape->type == NEBEL_SHAPE_ELLIPSOID;
    const nebel_density_type any[] = {NEBEL_DENSITY_HEIGHT, NEBEL_DENSITY_LINEAR, NEBEL_DENSITY_GAUSSIAN};
    d->type = any[dice_below(state, 3)];
    if (round && chance(state, .6)) d->type = NEBEL_DENSITY_RADIAL;
    if (shape->type == NEBEL_SHAPE_BOX && chance(state, .6)) d->type = NEBEL_DENSITY_SOFT_EDGE;
    d->below = chance(state, .5) ? NEBEL_BELOW_CONSTANT : NEBEL_BELOW_GROW;
    d->base = place(state, -5, 5);
    d->scale_height = place(state, 2, 12);
    places(state, -8, 8, d->from);
    places(state, -8, 8, d->to);
    if (d->from[1] == d->to[1]) d->to[1] += 1;
    places(state, -8, 8, d->center);
    d->power = 1 + dice_below(state, 3);
    d->sigma = dice(state, 1.5, 6);
    d->edge_width = dice(state, .3, 4);
    /* by digits that are there already, so that other numbers stay what they were */
    const int has_surface = shape->type != NEBEL_SHAPE_WORLD && shape->type < NEBEL_SHAPE_UNION;
    if (has_surface && d->type != NEBEL_DENSITY_RADIAL && fmod(d->sigma * 1e3, 1) < .4)
        d->type = NEBEL_DENSITY_SOFT_EDGE;
}

static void make_light(uint64_t *state, random_fog_kind kind, nebel_volume_desc *v)
{
    const double grey = dice(state, .005, .2), factor = kind == RANDOM_FOG_OPAQUE ? power_of_ten(state, -5, 5) : 1;
    const int colored = chance(state, .5), lit = chance(state, .25), shines = chance(state, .2);
    for (int c = 0; c < 3; c++) {
        v->extinction[c] = factor * (colored ? dice(state, .005, .15) : grey);
        v->source[c] = lit ? 0 : dice(state, 0, 2);
        v->albedo[c] = lit ? dice(state, .2, 1) : 0;
        v->emission[c] = shines ? dice(state, 0, .05) : 0;
    }
    /* A channel without extinction must not shine, or an endless ray has no answer. */
    if (!shines && chance(state, .1)) v->extinction[dice_below(state, 3)] = 0;
}

static void make_level_density(uint64_t *state, nebel_density *d)
{
    d->type = chance(state, .8) ? NEBEL_DENSITY_HEIGHT : NEBEL_DENSITY_LINEAR;
    d->scale_height = power_of_ten(state, 0, 3);
    places(state, -8, 8, d->from);
    double way[3] = {0, 1, 0};
    if (chance(state, .3)) random_unit(state, way);
    const double length = power_of_ten(state, -1, 3) * (chance(state, .5) ? 1 : -1);
    for (int k = 0; k < 3; k++) d->to[k] = d->from[k] + length * way[k];
}

/* ---- scenes ---------------------------------------------------------------------------------- */

static void make_priority(uint64_t *state, nebel_volume_desc *v)
{
    v->priority = dice_below(state, 3) - 1;
    if (v->operation == NEBEL_OPERATION_ADD && chance(state, .4)) v->operation = NEBEL_OPERATION_REPLACE;
    if (chance(state, .2)) v->start = place(state, 0, 30);
    if (chance(state, .2)) v->cutoff = v->start + dice(state, 1, 30);
}

static void make_volume(random_fog *fog, uint64_t *state, random_fog_kind kind, size_t i)
{
    nebel_volume_desc *const v = &fog->volumes[i];
    *v = (nebel_volume_desc){.operation = NEBEL_OPERATION_ADD};
    const int endless = kind == RANDOM_FOG_SINGLE || kind == RANDOM_FOG_LEVEL || chance(state, .1);
    nebel_shape_type type = leaves[dice_below(state, endless ? LEAVES : BOUNDED)];
    if (i == 0 && (kind == RANDOM_FOG_OVERLAP || (kind == RANDOM_FOG_LEVEL && chance(state, .7))))
        type = NEBEL_SHAPE_WORLD;
    if (kind == RANDOM_FOG_PARTS && chance(state, .8))
        make_parts(fog, state, 0, &v->shape);
    else
        make_leaf(fog, state, type, &v->shape);
    const int even = kind == RANDOM_FOG_SINGLE || kind == RANDOM_FOG_OVERLAP || chance(state, .3);
    if (!even) make_density(state, &v->shape, &v->density);
    if (kind == RANDOM_FOG_LEVEL) make_level_density(state, &v->density);
    if (kind == RANDOM_FOG_EXCLUDE && (i == 2 || i == 4)) v->operation = NEBEL_OPERATION_EXCLUDE;
    if (kind == RANDOM_FOG_EXCLUDE && fog->seed % 2 == 1) make_priority(state, v);
    if (v->operation == NEBEL_OPERATION_EXCLUDE)
        v->density = (nebel_density){.type = NEBEL_DENSITY_CONSTANT};
    else
        make_light(state, kind, v);
}

static void add(double v[3], const double by[3])
{
    for (int k = 0; k < 3; k++) v[k] += by[k];
}

static int is_moved(const nebel_transform *t)
{
    for (int k = 0; k < 3; k++)
        if (t->position[k] != 0 || t->rotation[k] != 0 || t->scale[k] != 0) return 1;
    return 0;
}

/* By its numbers where it has no transform, or by giving it one. */
static void shift_shape(random_fog *fog, uint64_t *state, const double by[3], nebel_shape *s)
{
    if (is_moved(&s->transform) || s->part_count > 0 || chance(state, .3)) {
        add(s->transform.position, by);
        return;
    }
    add(s->min, by);
    add(s->max, by);
    add(s->center, by);
    add(s->from, by);
    add(s->to, by);
    add(s->point, by);
    nebel_plane *const planes = s->plane_count > 0 ? &fog->planes[s->planes - fog->planes] : NULL;
    for (size_t i = 0; i < s->plane_count; i++) planes[i].distance += nb_vector_dot(planes[i].normal, by);
}

static void shift_fog(random_fog *fog, uint64_t *state)
{
    for (int k = 0; k < 3; k++) fog->shift[k] = 1e7 * (dice_below(state, 3) - 1);
    if (nb_vector_length(fog->shift) < 1) fog->shift[0] = 1e7;
    for (size_t i = 0; i < fog->count; i++) {
        nebel_volume_desc *const v = &fog->volumes[i];
        shift_shape(fog, state, fog->shift, &v->shape);
        add(v->density.from, fog->shift);
        add(v->density.to, fog->shift);
        add(v->density.center, fog->shift);
        v->density.base += fog->shift[1];
    }
}

void random_fog_make(random_fog *fog, random_fog_kind kind, uint64_t seed)
{
    static const size_t counts[] = {1, 6, 5, 6, RANDOM_FOG_VOLUMES, 3, 5, 4, 3};
    uint64_t state = seed * RANDOM_FOG_KIND_COUNT + (uint64_t)kind;
    *fog = (random_fog){.kind = kind, .seed = seed, .count = counts[kind]};
    for (int c = 0; c < 3; c++) fog->ambient[c] = dice(&state, 0, 1);
    const random_fog_kind near = kind == RANDOM_FOG_FAR ? (random_fog_kind)dice_below(&state, RANDOM_FOG_FAR) : kind;
    for (size_t i = 0; i < fog->count; i++) make_volume(fog, &state, near, i);
    if (kind == RANDOM_FOG_FAR) shift_fog(fog, &state);
    if (seed % 4 == 3) fog->max_opacity = dice(&state, .05, 1);
}

void random_fog_light(random_fog *fog, uint64_t *numbers)
{
    for (size_t i = 0; i < fog->count; i++) {
        nebel_volume_desc *volume = &fog->volumes[i];
        const double peak = dice(numbers, -0.7, 0.9);
        if (volume->operation == NEBEL_OPERATION_EXCLUDE || i % 3 == 2) continue;
        for (int c = 0; c < 3; c++) {
            volume->source[c] = 0;
            volume->albedo[c] = dice(numbers, 0.3, 1);
        }
        volume->phase = (nebel_phase){.type = (nebel_phase_type)(i % NEBEL_PHASE_DROPLETS), .g = peak, .alpha = 3};
    }
}

nebel_fog_desc random_fog_desc(const random_fog *fog)
{
    return (nebel_fog_desc){.max_opacity = fog->max_opacity};
}

nebel_lighting_desc random_fog_lights(const random_fog *fog)
{
    nebel_lighting_desc lights = {.environment = {.type = NEBEL_ENVIRONMENT_CONSTANT}};
    memcpy(lights.environment.radiance, fog->ambient, sizeof fog->ambient);
    return lights;
}

void random_fog_rotate(const double q[4], double p[3])
{
    const double n = q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3];
    if (!(n > 0)) return;
    const double a[3] = {q[1] * p[2] - q[2] * p[1] + q[3] * p[0], q[2] * p[0] - q[0] * p[2] + q[3] * p[1],
                         q[0] * p[1] - q[1] * p[0] + q[3] * p[2]};
    const double b[3] = {q[1] * a[2] - q[2] * a[1], q[2] * a[0] - q[0] * a[2], q[0] * a[1] - q[1] * a[0]};
    for (int k = 0; k < 3; k++) p[k] += 2 * b[k] / n;
}

/* ---- rays ------------------------------------------------------------------------------------ */

/* A shape that is no union or intersection, and the way from its coordinates to the world's. */
typedef struct target {
    const nebel_shape *shape;
    const nebel_transform *chain[4];
    int depth;
} target;

static target choose_target(const random_fog *fog, uint64_t *state)
{
    target t = {.shape = &fog->volumes[dice_below(state, (int)fog->count)].shape};
    t.chain[t.depth++] = &t.shape->transform;
    while (t.shape->type == NEBEL_SHAPE_UNION || t.shape->type == NEBEL_SHAPE_INTERSECTION) {
        t.shape = &t.shape->parts[dice_below(state, (int)t.shape->part_count)];
        t.chain[t.depth++] = &t.shape->transform;
    }
    return t;
}

static void to_world(const target *t, double p[3], int is_point)
{
    for (int i = t->depth; i-- > 0;) {
        const nebel_transform *const f = t->chain[i];
        for (int k = 0; k < 3; k++)
            if (f->scale[k] != 0) p[k] *= f->scale[k];
        random_fog_rotate(f->rotation, p);
        if (is_point) add(p, f->position);
    }
}

static void remove_along(const double axis[3], double v[3])
{
    const double share = nb_vector_dot(v, axis) / nb_vector_dot(axis, axis);
    for (int k = 0; k < 3; k++) v[k] -= share * axis[k];
}

static int has_axis(const nebel_shape *s)
{
    return s->type == NEBEL_SHAPE_CONE || s->type == NEBEL_SHAPE_CYLINDER || s->type == NEBEL_SHAPE_CAPSULE;
}

/* Whether numbers of the shape are numbers of the world. */
static int is_in_place(const target *t)
{
    return t->depth == 1 && !is_moved(t->chain[0]);
}

/* A point of the surface in the shape's coordinates, and the normal there; also on edges of a box where rays along the
 * axes can lie in them exactly. */
static void surface_point(uint64_t *state, const nebel_shape *s, int edges, double p[3], double n[3])
{
    random_unit(state, n);
    double axis[3];
    for (int k = 0; k < 3; k++) axis[k] = s->to[k] - s->from[k];
    const double where = chance(state, .2) ? dice_below(state, 2) : dice(state, 0, 1), length = nb_vector_length(axis);
    const int side = dice_below(state, 3);
    switch (s->type) {
    case NEBEL_SHAPE_SPHERE:
        for (int k = 0; k < 3; k++) p[k] = s->center[k] + s->radius * n[k];
        break;
    case NEBEL_SHAPE_ELLIPSOID:
        for (int k = 0; k < 3; k++) {
            p[k] = s->center[k] + s->radii[k] * n[k];
            n[k] /= s->radii[k];
        }
        break;
    case NEBEL_SHAPE_CYLINDER:
    case NEBEL_SHAPE_CAPSULE:
    case NEBEL_SHAPE_CONE: {
        const int cone = s->type == NEBEL_SHAPE_CONE;
        const double slope = cone ? (s->radius_to - s->radius_from) / length : 0;
        const double radius = cone ? s->radius_from + where * length * slope : s->radius;
        remove_along(axis, n);
        const double size = nb_vector_length(n);
        for (int k = 0; k < 3; k++) {
            n[k] /= size;
            p[k] = s->from[k] + where * axis[k] + radius * n[k];
            n[k] -= slope * axis[k] / length;
        }
        break;
    }
    case NEBEL_SHAPE_CONVEX: {
        const nebel_plane *const plane = &s->planes[dice_below(state, (int)s->plane_count)];
        memcpy(n, plane->normal, sizeof plane->normal);
        for (int k = 0; k < 3; k++) p[k] = dice(state, -5, 5);
        const double move = (plane->distance - nb_vector_dot(n, p)) / nb_vector_dot(n, n);
        for (int k = 0; k < 3; k++) p[k] += move * n[k];
        break;
    }
    case NEBEL_SHAPE_HALF_SPACE:
        memcpy(n, s->normal, sizeof s->normal);
        memcpy(p, s->point, sizeof s->point);
        break;
    default: {
        for (int k = 0; k < 3; k++) {
            const double share = edges && chance(state, .2) ? dice_below(state, 2) : dice(state, 0, 1);
            p[k] = s->min[k] + share * (s->max[k] - s->min[k]);
            n[k] = k == side;
        }
        p[side] = chance(state, .5) ? s->min[side] : s->max[side];
    }
    }
}

/* From behind the point at a distance of about `back`, in a direction. */
static void set_ray(nebel_ray *ray, const double through[3], const double direction[3], double back)
{
    for (int k = 0; k < 3; k++) {
        ray->direction[k] = direction[k];
        ray->origin[k] = through[k] - back * direction[k];
    }
}

/* How far beside a surface. A ray can be parallel to a plane only to 1e-16, so that closer than that times some metres
 * the last bits decide where it crosses, and float has no answer: that is rare. Rays along the axes lie exactly in the
 * faces of a box. Curved surfaces are touched to the last digit. */
static double choose_offset(uint64_t *state, const target *t, int along_axis)
{
    const nebel_shape_type type = t->shape->type;
    const int flat = type == NEBEL_SHAPE_CONVEX || type == NEBEL_SHAPE_HALF_SPACE || type == NEBEL_SHAPE_BOX;
    const int closest = chance(state, .03);
    const double off = power_of_ten(state, !flat ? -14 : closest ? -18 : -11, -2) * (chance(state, .5) ? 1 : -1);
    const int exact = along_axis && is_in_place(t);
    return exact || (flat ? closest && chance(state, .5) : chance(state, .2)) ? 0 : off;
}

/* Along the mantle of a body with an axis, or in one of its ends. */
static void run_along(uint64_t *state, const nebel_shape *s, const double n[3], double d[3])
{
    double axis[3];
    for (int k = 0; k < 3; k++) axis[k] = s->to[k] - s->from[k];
    if (chance(state, .3)) {
        remove_along(axis, d);
        return;
    }
    memcpy(d, axis, sizeof axis);
    remove_along(n, d);
}

/* In a face, or tangent. */
static void graze(const random_fog *fog, uint64_t *state, nebel_ray *ray)
{
    const target t = choose_target(fog, state);
    double p[3], n[3], d[3];
    surface_point(state, t.shape, is_in_place(&t), p, n);
    random_unit(state, d);
    const int along_axis = t.shape->type == NEBEL_SHAPE_BOX && chance(state, .5), axis = dice_below(state, 3);
    for (int k = 0; k < 3 && along_axis; k++) d[k] = k == axis ? 1 : 0;
    remove_along(n, d);
    if (has_axis(t.shape) && chance(state, .05)) run_along(state, t.shape, n, d);
    if (!(nb_vector_length(d) > 1e-3)) random_unit(state, d);
    const double off = choose_offset(state, &t, along_axis);
    const double size = nb_vector_length(n);
    for (int k = 0; k < 3; k++) n[k] *= off / size;
    to_world(&t, p, 1);
    to_world(&t, d, 0);
    to_world(&t, n, 0);
    add(p, n);
    set_ray(ray, p, d, dice(state, -5, 30) / nb_vector_length(d));
}

/* Through a corner, an apex, the middle; or along the axis. */
static void aim(const random_fog *fog, uint64_t *state, nebel_ray *ray)
{
    const target t = choose_target(fog, state);
    const nebel_shape *const s = t.shape;
    const int spindle = has_axis(s);
    const int box = s->type == NEBEL_SHAPE_BOX, end = dice_below(state, 2), along = chance(state, .3);
    double p[3], d[3];
    random_unit(state, d);
    for (int k = 0; k < 3; k++) {
        p[k] = box ? (dice_below(state, 2) ? s->min[k] : s->max[k]) : spindle && end ? s->to[k] : s->center[k];
        if (along && spindle) d[k] = s->to[k] - s->from[k];
        if (along && box) d[k] = s->max[k] - s->min[k];
    }
    to_world(&t, p, 1);
    to_world(&t, d, 0);
    set_ray(ray, p, d, dice(state, -5, 30) / nb_vector_length(d));
}

static void cross(const random_fog *fog, uint64_t *state, nebel_ray *ray)
{
    double to[3];
    const int inside = chance(state, .2);
    for (int k = 0; k < 3; k++) {
        ray->origin[k] = fog->shift[k] + (inside ? dice(state, -6, 6) : dice(state, -25, 25));
        to[k] = fog->shift[k] + dice(state, -12, 12);
        ray->direction[k] = to[k] - ray->origin[k];
    }
}

static void cross_along_axis(const random_fog *fog, uint64_t *state, nebel_ray *ray)
{
    const int axis = dice_below(state, 3), forward = dice_below(state, 2);
    for (int k = 0; k < 3; k++) {
        const double x = dice(state, -12, 12);
        ray->direction[k] = k != axis ? 0 : forward ? 1 : -1;
        ray->origin[k] = fog->shift[k] + (chance(state, .5) ? floor(2 * x) / 2 : x);
    }
}

/* Nearly level, so that the height, or the place in one volume's linear density, hardly changes over the ray. */
static double run_level(const random_fog *fog, uint64_t *state, nebel_ray *ray)
{
    cross(fog, state, ray);
    const nebel_density *const d = &fog->volumes[dice_below(state, (int)fog->count)].density;
    const int linear = d->type == NEBEL_DENSITY_LINEAR;
    double up[3] = {0, 1, 0};
    for (int k = 0; k < 3 && linear; k++) up[k] = d->to[k] - d->from[k];
    const double steepness = chance(state, .1) ? 0 : power_of_ten(state, -18, -1);
    const double rise =
        steepness * nb_vector_length(ray->direction) / nb_vector_length(up) * (chance(state, .5) ? 1 : -1);
    remove_along(up, ray->direction);
    for (int k = 0; k < 3; k++) ray->direction[k] += rise * up[k];
    return up[0] == 0 ? steepness : fmax(steepness, 1e-17); /* which is as level as rounding lets it be */
}

/* No endless rays that reach another height only after more metres than there are. */
static void choose_end(uint64_t *state, int far, double steepness, nebel_ray *ray)
{
    const int style = dice_below(state, 20);
    ray->t_max = far ? power_of_ten(state, 1, 6) : dice(state, 5, 80);
    if (style == 0) ray->t_max = 0;
    if (style == 1) ray->t_max = power_of_ten(state, -12, 0);
    if (style >= 2 && style < 6 && (steepness == 0 || steepness > 1e-9)) ray->t_max = HUGE_VAL;
    if (style == 6) ray->t_max = floor(ray->t_max);
}

nebel_ray random_fog_ray(const random_fog *fog, uint64_t seed)
{
    uint64_t state = fog->seed * 1000003 + seed;
    nebel_ray ray = {{0}, {0}, 0};
    dice_next(&state);
    const int style = dice_below(&state, 10), level = fog->kind == RANDOM_FOG_LEVEL && style < 8;
    double steepness = 1;
    if (level)
        steepness = run_level(fog, &state, &ray);
    else if (style < 4)
        cross(fog, &state, &ray);
    else if (style < 5)
        cross_along_axis(fog, &state, &ray);
    else if (style < 8)
        graze(fog, &state, &ray);
    else
        aim(fog, &state, &ray);
    if (!(nb_vector_length(ray.direction) > 0)) ray.direction[0] = 1;
    choose_end(&state, level, steepness, &ray);
    if (chance(&state, .3)) {
        const double stretch = power_of_ten(&state, -3, 3);
        for (int k = 0; k < 3; k++) ray.direction[k] *= stretch;
    }
    return ray;
}

/* ---- printing -------------------------------------------------------------------------------- */

static void print_vector(FILE *to, const char *key, const double *v, int n)
{
    fprintf(to, ", \"%s\": [", key);
    for (int k = 0; k < n; k++) fprintf(to, "%s%.17g", k > 0 ? ", " : "", v[k]);
    fprintf(to, "]");
}

static void print_number(FILE *to, const char *key, double x)
{
    fprintf(to, ", \"%s\": %.17g", key, x);
}

static void print_transform(FILE *to, const nebel_transform *t)
{
    if (!is_moved(t)) return;
    fprintf(to, ", \"transform\": {");
    fprintf(to, "\"position\": [%.17g, %.17g, %.17g]", t->position[0], t->position[1], t->position[2]);
    if (t->rotation[0] != 0 || t->rotation[1] != 0 || t->rotation[2] != 0 || t->rotation[3] != 0)
        print_vector(to, "rotation", t->rotation, 4);
    if (t->scale[0] != 0) print_vector(to, "scale", t->scale, 3);
    fprintf(to, "}");
}

static void print_shape(FILE *to, const nebel_shape *s)
{
    static const char *const names[] = {"world",   "half_space", "box",    "sphere", "ellipsoid",   "cylinder",
                                        "capsule", "cone",       "convex", "union",  "intersection"};
    fprintf(to, "{\"type\": \"%s\"", names[s->type]);
    const int ball = s->type == NEBEL_SHAPE_SPHERE, cone = s->type == NEBEL_SHAPE_CONE;
    const int tube = s->type == NEBEL_SHAPE_CYLINDER || s->type == NEBEL_SHAPE_CAPSULE;
    if (s->type == NEBEL_SHAPE_HALF_SPACE) print_vector(to, "point", s->point, 3);
    if (s->type == NEBEL_SHAPE_HALF_SPACE) print_vector(to, "normal", s->normal, 3);
    if (s->type == NEBEL_SHAPE_BOX) print_vector(to, "min", s->min, 3);
    if (s->type == NEBEL_SHAPE_BOX) print_vector(to, "max", s->max, 3);
    if (ball || s->type == NEBEL_SHAPE_ELLIPSOID) print_vector(to, "center", s->center, 3);
    if (s->type == NEBEL_SHAPE_ELLIPSOID) print_vector(to, "radii", s->radii, 3);
    if (tube || cone) print_vector(to, "from", s->from, 3);
    if (tube || cone) print_vector(to, "to", s->to, 3);
    if (tube || ball) print_number(to, "radius", s->radius);
    if (cone) print_number(to, "radius_from", s->radius_from);
    if (cone) print_number(to, "radius_to", s->radius_to);
    for (size_t i = 0; i < s->plane_count; i++)
        fprintf(to, "%s[%.17g, %.17g, %.17g, %.17g]%s", i == 0 ? ", \"planes\": [" : ", ", s->planes[i].normal[0],
                s->planes[i].normal[1], s->planes[i].normal[2], s->planes[i].distance,
                i + 1 < s->plane_count ? "" : "]");
    for (size_t i = 0; i < s->part_count; i++) {
        fprintf(to, i == 0 ? ", \"shapes\": [" : ", ");
        print_shape(to, &s->parts[i]);
        fprintf(to, i + 1 < s->part_count ? "" : "]");
    }
    print_transform(to, &s->transform);
    fprintf(to, "}");
}

static void print_density(FILE *to, const nebel_density *d)
{
    static const char *const names[] = {"constant", "height", "linear", "radial", "gaussian", "soft_edge"};
    fprintf(to, ", \"density\": {\"type\": \"%s\"", names[d->type]);
    switch (d->type) {
    case NEBEL_DENSITY_HEIGHT:
        print_number(to, "base", d->base);
        print_number(to, "scale_height", d->scale_height);
        fprintf(to, ", \"below\": \"%s\"", d->below == NEBEL_BELOW_GROW ? "grow" : "constant");
        break;
    case NEBEL_DENSITY_LINEAR:
        print_vector(to, "from", d->from, 3);
        print_vector(to, "to", d->to, 3);
        break;
    case NEBEL_DENSITY_RADIAL:
        print_number(to, "power", d->power);
        break;
    case NEBEL_DENSITY_GAUSSIAN:
        print_vector(to, "center", d->center, 3);
        print_number(to, "sigma", d->sigma);
        break;
    case NEBEL_DENSITY_SOFT_EDGE:
        print_number(to, "distance", d->edge_width);
        break;
    default:
        break;
    }
    fprintf(to, "}");
}

static void print_volume(FILE *to, const nebel_volume_desc *v)
{
    fprintf(to, "{\"name\": \"\", \"shape\": ");
    print_shape(to, &v->shape);
    fprintf(to, ", \"priority\": %d", v->priority);
    print_number(to, "start", v->start);
    if (v->cutoff > 0) print_number(to, "cutoff", v->cutoff);
    if (v->operation == NEBEL_OPERATION_EXCLUDE) {
        fprintf(to, ", \"operation\": \"exclude\"}");
        return;
    }
    if (v->operation == NEBEL_OPERATION_REPLACE) fprintf(to, ", \"operation\": \"replace\"");
    print_density(to, &v->density);
    print_vector(to, "extinction", v->extinction, 3);
    if (v->albedo[0] + v->albedo[1] + v->albedo[2] > 0)
        print_vector(to, "albedo", v->albedo, 3);
    else
        print_vector(to, "source", v->source, 3);
    print_vector(to, "emission", v->emission, 3);
    fprintf(to, "}");
}

void random_fog_print(FILE *to, const random_fog *fog, const nebel_ray *ray)
{
    fprintf(to, "{\"nebel\": 1");
    print_vector(to, "ambient", fog->ambient, 3);
    print_number(to, "max_opacity", fog->max_opacity);
    fprintf(to, ", \"fog\": [\n");
    for (size_t i = 0; i < fog->count; i++) {
        fprintf(to, "  ");
        print_volume(to, &fog->volumes[i]);
        fprintf(to, i + 1 < fog->count ? ",\n" : "\n");
    }
    fprintf(to, "]}\n%.17g %.17g %.17g %.17g %.17g %.17g %.17g\n", ray->origin[0], ray->origin[1], ray->origin[2],
            ray->direction[0], ray->direction[1], ray->direction[2], ray->t_max);
}
