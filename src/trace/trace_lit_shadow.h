/* The shadows of many bodies on rays: between which places of a ray the ways to a light may meet a body, and how deep a way
 * is through all of them. Included by trace_common_steps.h. */

/* Where the ways from a ray to a light may meet a body: nowhere else on the ray; nowhere where first > last. */
typedef struct lit_shadow {
    nb_wide first, last;
    nb_real amount;            /* the most optical depth in it */
    nb_real at_start, at_last; /* integral of the density on the way from where the step starts; from its last place */
    const nb_medium *medium;
    double cells; /* of voxels, in a metre along the axis that has most; 0: of others */
    size_t next;  /* of the shadows that lie on the step at hand */
} lit_shadow;

/* More than these take memory once. */
#define STACK_SHADOWS 32

static int is_endless(const nb_volume *body)
{
    int endless = 0;
    for (int c = 0; c < 3; c++) endless = endless || !isfinite(body->low[c]) || !isfinite(body->high[c]);
    return endless;
}

/* The radius of a ball about the middle of a body's bounds that holds it. */
static double radius_around(const nb_volume *body)
{
    const double x = body->high[0] - body->low[0], y = body->high[1] - body->low[1], z = body->high[2] - body->low[2];
    const int is_ball = body->leaves[0].type == NB_LEAF_SPHERE && body->leaves[0].aligned;
    return 0.5 * (is_ball ? fmax(fmax(x, y), z) : sqrt(x * x + y * y + z * z));
}

static double most_extinction(const nb_medium *medium)
{
    const double *extinction = medium->body.extinction;
    return fmax(fmax(extinction[0], extinction[1]), extinction[2]) * fmax(medium->peak, 1);
}

/* No way through the body is deeper. */
static nb_real most_depth(const nb_medium *medium)
{
    const nb_volume *body = &medium->body;
    return is_endless(body) ? NB_HUGE : REAL(fmin(2 * most_extinction(medium) * radius_around(body), 1e18));
}

/* Where a t^2 + 2 b t + c <= 0; where a is not above `least` that may be anywhere. The plane of the ways cuts a disc out of a
 * ball, whose shadow is no narrower than it: no way through it is longer. */
static void set_between_roots(lit_shadow *s, nb_wide a, nb_wide b, nb_wide c, nb_wide least)
{
    const nb_wide square = b * b - a * c, inverse = nb_wrcp_bounded(nb_wmax(a, least));
    const nb_wide root = nb_wsqrt(nb_wmax(square, NB_W(0.0)));
    const nb_wmask curved = a > least, some = square >= NB_W(0.0);
    s->first = nb_wselect(curved, nb_wselect(some, (-b - root) * inverse, NB_WFAR), NB_W(0.0));
    s->last = nb_wselect(curved, nb_wselect(some, (root - b) * inverse, -NB_WFAR), NB_WFAR);
    const nb_real width = nb_narrow(nb_wclamp(s->last - s->first, NB_W(0.0), NB_WFAR));
    s->amount = nb_min(s->amount, REAL(most_extinction(s->medium)) * width);
}

/* Of a ball in the sun, its centre from where the rays start. */
static void set_sun_shadow(lit_shadow *s, const packet *rays, nb_wvec3 sun, nb_wvec3 center, nb_wide radius)
{
    const nb_wvec3 moment = nb_wcross3(center, sun), rate = nb_wcross3(rays->direction, sun);
    const nb_wide beside = nb_wdot3(moment, moment) - radius * radius, level = NB_W(1e-12);
    set_between_roots(s, nb_wdot3(rate, rate), -nb_wdot3(moment, rate), beside, level);
    /* and ahead of the way, not behind it */
    const nb_wide along = nb_wdot3(rays->direction, sun), ahead = nb_wdot3(center, sun) + radius;
    const nb_wide passed = ahead * nb_wrcp_bounded(along);
    s->last = nb_wselect(along > level, nb_wmin(s->last, passed), s->last);
    s->first = nb_wselect(along < -level, nb_wmax(s->first, passed), s->first);
}

/* The ways to a point light are in the plane of point light and ray: those that meet a ball are between two of them,
 * on its side of the point light where it does not hold the point light, and as long as the way there. */
static void set_light_shadow(lit_shadow *s, const packet *rays, nb_wvec3 point_light, nb_wvec3 center, nb_wide radius)
{
    const nb_wvec3 from = nb_wsub3(nb_wvec3(NB_W(0.0), NB_W(0.0), NB_W(0.0)), point_light),
                   apart = nb_wsub3(center, point_light);
    const nb_wvec3 moment = nb_wcross3(apart, from), rate = nb_wcross3(apart, rays->direction);
    const nb_wide r2 = radius * radius, along = nb_wdot3(apart, rays->direction), least = r2 * NB_W(1e-6);
    set_between_roots(s, nb_wdot3(rate, rate) - r2, nb_wdot3(moment, rate) - r2 * nb_wdot3(from, rays->direction),
                      nb_wdot3(moment, moment) - r2 * nb_wdot3(from, from), least);
    const nb_wide clear = nb_wsqrt(nb_wdot3(apart, apart)) - radius;
    const nb_wmask beside = clear > radius * NB_W(1e-3);
    const nb_wide passed = -nb_wdot3(apart, from) * nb_wrcp_bounded(along), level = radius * NB_W(1e-6);
    s->first = nb_wselect(nb_wand(beside, along > level), nb_wmax(s->first, passed), s->first);
    s->last = nb_wselect(nb_wand(beside, along < -level), nb_wmin(s->last, passed), s->last);
    /* nearer to the point light than the ball is */
    const nb_wide closest = -nb_wdot3(from, rays->direction);
    const nb_wide square = clear * clear - (nb_wdot3(from, from) - closest * closest);
    const nb_wide reach = nb_wsqrt(nb_wmax(square, NB_W(0.0)));
    const nb_wmask some = nb_wand(beside, square > NB_W(0.0));
    const nb_wide in = closest - reach, out = closest + reach, first = s->first, last = s->last;
    s->first = nb_wselect(nb_wand(some, nb_wand(first > in, first < out)), out, first);
    s->last = nb_wselect(nb_wand(some, nb_wand(last > in, last < out)), in, last);
}

/* Up to where along the rays a t <= c; `worst` is of what rounding leaves of differences that should be 0. */
static void cut_shadow(lit_shadow *s, nb_wide a, nb_wide c, nb_wide worst)
{
    const nb_wmask ahead = a > worst, back = a < -worst;
    const nb_wide t = c / nb_wselect(nb_wor(ahead, back), a, NB_W(1.0));
    s->last = nb_wselect(ahead, nb_wmin(s->last, t), s->last);
    s->first = nb_wselect(back, nb_wmax(s->first, t), s->first);
}

/* The flat faces n.x <= level that hold a body, as bounds a t + b u <= c of the ways that meet it, and one of the end of the
 * way. Of the sun u is the length of the way; of a point light t and u are such that (point light u + place at 0 -
 * point light + direction t) / u is on the way, with u >= 1. */
typedef struct flat_bounds {
    nb_wvec3 place, direction, light;
    nb_wide margin;
    int is_light;
    size_t count;
    nb_wide a[NB_MAX_EDGED_FACES + 1], b[NB_MAX_EDGED_FACES + 1], c[NB_MAX_EDGED_FACES + 1];
} flat_bounds;

static flat_bounds no_bounds(const packet *rays, nb_wvec3 light, int is_light, const nb_leaf *leaf)
{
    const local_ray local = localize(rays, leaf);
    const packet from_light = {is_light ? light : rays->origin, light, rays->t_max};
    const local_ray other = localize(&from_light, leaf);
    flat_bounds f = {.direction = local.d, .margin = NB_W(4.0) * (local.reach + other.reach), .is_light = is_light};
    f.light = is_light ? other.p : other.d;
    f.place = is_light ? nb_wsub3(local.p, f.light) : local.p;
    f.a[0] = NB_W(0.0);
    f.b[0] = NB_W(-1.0);
    f.c[0] = is_light ? NB_W(-1.0) : NB_W(0.0);
    f.count = 1;
    return f;
}

static void add_bound(flat_bounds *f, nb_wvec3 normal, nb_wide level)
{
    const nb_wide zero = NB_W(0.0), rest = f->is_light ? zero : level;
    f->a[f->count] = nb_wdot3(normal, f->direction);
    f->b[f->count] = nb_wdot3(normal, f->light) - (level - rest);
    f->c[f->count++] = rest - nb_wdot3(normal, f->place);
}

/* A box of the leaf's frame that holds it. Returns 0 where the ball around it is no larger. */
static int box_around_leaf(const nb_leaf *leaf, double low[3], double high[3])
{
    double side = 1, first = 0, last = 1;
    if (leaf->type == NB_LEAF_WORLD || (leaf->type == NB_LEAF_SPHERE && leaf->aligned)) return 0;
    if (leaf->type == NB_LEAF_SPHERE) side = last = leaf->radius, first = -leaf->radius;
    if (leaf->type == NB_LEAF_CONE) side = fmax(leaf->radius, leaf->radius + leaf->slope);
    if (leaf->type == NB_LEAF_CAPSULE) first = -1, last = leaf->length + 1;
    for (int i = 0; i < 3; i++) {
        const int is_box = leaf->type == NB_LEAF_BOX;
        low[i] = is_box ? leaf->low[i] : i < 2 ? -side : first;
        high[i] = is_box ? leaf->high[i] : i < 2 ? side : last;
    }
    return 1;
}

static void bound_by_box(flat_bounds *f, const double low[3], const double high[3])
{
    for (int i = 0; i < 3; i++) {
        const nb_wide margin = f->margin + WIDE((fabs(low[i]) + fabs(high[i])) * SCENE_MARGIN);
        const nb_wvec3 n = nb_wvec3(WIDE(i == 0), WIDE(i == 1), WIDE(i == 2));
        add_bound(f, n, WIDE(high[i]) + margin);
        add_bound(f, nb_wscale3(n, NB_W(-1.0)), margin - WIDE(low[i]));
    }
}

static void bound_by_planes(flat_bounds *f, const nb_volume *body, const nb_leaf *leaf)
{
    for (size_t i = 0; i < leaf->face_count; i++) {
        const nb_face *face = &body->faces[leaf->first_face + i];
        const nb_wide margin = f->margin + WIDE(fabs(face->distance) * SCENE_MARGIN);
        add_bound(f, wide_vector(face->normal), WIDE(face->distance) + margin);
    }
}

/* All pairs of lower and upper bounds of u say for which t there is one (Fourier and Motzkin). A body may be far narrower than
 * the ball around it. */
static void set_flat_shadow(lit_shadow *s, const flat_bounds *f)
{
    const nb_wide zero = NB_W(0.0), blur = NB_W(64.0) * NB_WEPSILON;
    for (size_t i = 1; i < f->count; i++) {
        const nb_wmask alone = nb_wand(f->b[i] <= zero, f->b[i] >= zero), upper = f->b[i] > zero;
        if (nb_wany(alone)) cut_shadow(s, nb_wselect(alone, f->a[i], zero), f->c[i], zero);
        if (!nb_wany(upper)) continue;
        for (size_t j = 0; j < f->count; j++) {
            const nb_wmask pair = nb_wand(upper, f->b[j] < zero);
            if (!nb_wany(pair)) continue;
            const nb_wide x = f->b[i] * f->a[j], y = f->b[j] * f->a[i];
            const nb_wide rise = nb_wselect(pair, x - y, zero);
            cut_shadow(s, rise, f->b[i] * f->c[j] - f->b[j] * f->c[i], (nb_wabs(x) + nb_wabs(y)) * blur);
        }
    }
}

static void set_narrow_shadow(lit_shadow *s, const packet *rays, nb_wvec3 light, int is_light)
{
    const nb_volume *body = &s->medium->body;
    const nb_leaf *leaf = &body->leaves[0];
    const int is_polytope = leaf->type == NB_LEAF_PLANES && leaf->face_count <= NB_MAX_EDGED_FACES;
    double low[3], high[3];
    if (leaf->type == NB_LEAF_PLANES ? !is_polytope : !box_around_leaf(leaf, low, high)) return;
    flat_bounds f = no_bounds(rays, light, is_light, leaf);
    if (is_polytope)
        bound_by_planes(&f, body, leaf);
    else
        bound_by_box(&f, low, high);
    set_flat_shadow(s, &f);
}

static double cells_in_metre(const nb_volume *body)
{
    const nb_leaf *leaf = &body->leaves[0];
    double rate[3];
    if (body->density.type != NEBEL_DENSITY_GRID) return 0;
    nb_grid_rate(body->density.grid, leaf->low, leaf->high, rate);
    return fmin(fmax(fmax(rate[0], rate[1]), rate[2]), 1e18);
}

static lit_shadow shadow_of(const sunlight *sun, const packet *rays, const nb_light *point_light,
                            const nb_medium *medium)
{
    const nb_volume *body = &medium->body;
    lit_shadow s = {NB_W(0.0), NB_WFAR, most_depth(medium), NB_F(0.0), NB_F(0.0), medium, cells_in_metre(body), 0};
    if (is_endless(body)) return s;
    const nb_wvec3 low = nb_wsub3(wide_vector(body->low), rays->origin);
    const nb_wvec3 high = nb_wsub3(wide_vector(body->high), rays->origin);
    const nb_wide margin = (sum_of_sizes(low) + sum_of_sizes(high)) * WIDE(SCENE_MARGIN * medium->proportion);
    const nb_wide radius = WIDE(radius_around(body)) + margin;
    const nb_wvec3 center = nb_wscale3(nb_wadd3(low, high), NB_W(0.5));
    if (point_light == NULL)
        set_sun_shadow(&s, rays, sun->direction, center, radius);
    else
        set_light_shadow(&s, rays, nb_wsub3(wide_vector(point_light->place), rays->origin), center, radius);
    set_narrow_shadow(&s, rays, point_light == NULL ? sun->direction : wide_vector(point_light->place),
                      point_light != NULL);
    return s;
}

/* Those that lie on the rays; `point_light` NULL: in the sun. */
static void list_shadows(sunlight *sun, const packet *rays, const nb_light *point_light)
{
    const nebel_snapshot *snapshot = sun->snapshot;
    sun->shadow_count = 0;
    for (size_t i = 0; i < snapshot->medium_count; i++) {
        const lit_shadow s = shadow_of(sun, rays, point_light, &snapshot->media[i]);
        if (!nb_wany(nb_wand(s.first <= nb_wmin(s.last, rays->t_max), s.last >= NB_W(0.0)))) continue;
        if (sun->shadow_count == sun->shadow_capacity) {
            void *grown = grow_aligned(&snapshot->allocator, sun->shadows, sun->shadow_count, sizeof *sun->shadows,
                                       &sun->shadow_capacity, sun->shadow_count + 1, &sun->shadow_memory);
            sun->out_of_memory = sun->out_of_memory || grown == NULL;
            if (grown == NULL) return;
            sun->shadows = grown;
        }
        sun->shadows[sun->shadow_count++] = s;
    }
}

static nb_estimate length_along(const packet_state *m, const packet *way, const nb_volume *body)
{
    nb_estimate along = {length_in_body(way, body), NB_F(0.0)};
    if (m->wants_error) along.error = length_error(way, body, 0, NB_F(4.0) * NB_EPSILON);
    return along;
}

/* The way to a light from a place, and a lower bound of the optical depth between that place and the one before: from
 * the bodies that both ways meet, each of which takes a concave amount of the ways between. */
typedef struct shadowed_way {
    light_depth depth;
    nb_real before[3], here[3]; /* of the bodies that both ways meet: on the way from the place before; from here */
} shadowed_way;

/* What of voxels ways between two places pass for sure, of what both of them pass: between places more than half a cell
 * apart there may be gaps, and none of it where a whole cell lies between. */
static nb_real sure_part(double cells, nb_wide before, nb_wide t)
{
    const nb_real apart = nb_narrow(nb_wmin((t - before) * WIDE(cells), NB_W(2.0)));
    return NB_F(1.0) - nb_clamp(apart - NB_F(0.5), NB_F(0.0), NB_F(1.0));
}

static void note_covering(shadowed_way *sum, const nb_volume *body, nb_mask near, nb_real before, nb_real here)
{
    const nb_mask both = nb_and(near, nb_and(before > NB_F(0.0), here > NB_F(0.0)));
    const nb_real first = nb_select(both, before, NB_F(0.0)), last = nb_select(both, here, NB_F(0.0));
    for (int c = 0; c < 3; c++) {
        sum->before[c] = sum->before[c] + REAL(body->extinction[c]) * first;
        sum->here[c] = sum->here[c] + REAL(body->extinction[c]) * last;
    }
}

/* From t of each ray; of the bodies in whose shadow that is, lane by lane: slack beside them depends on no company.
 * `before`: the last place that was asked. */
static shadowed_way way_through_shadows(const known_depths *known, const packet_state *m, nb_wide before, nb_wide t,
                                        nb_wvec3 direction, nb_wide reach)
{
    const sunlight *sun = known->sun;
    const packet way = {nb_wadd3(m->rays.origin, nb_wscale3(m->rays.direction, t)), direction, reach};
    const nb_real zero = NB_F(0.0);
    shadowed_way sum = {no_depth(), {zero, zero, zero}, {zero, zero, zero}};
    nb_real terms = NB_F(4.0);
    for (size_t i = sun->first_shadow; i < sun->shadow_count; i = sun->shadows[i].next) {
        lit_shadow *s = &sun->shadows[i];
        const nb_mask near = nb_narrow_mask(nb_wand(s->first <= t, s->last >= t));
        if (!nb_any(near)) continue;
        const nb_volume *body = &s->medium->body;
        const int varies = body->density.type != NEBEL_DENSITY_CONSTANT;
        const nb_estimate along = varies ? profile_along(&way, s->medium, 0, known) : length_along(m, &way, body);
        const nb_mask covers = nb_and(near, nb_narrow_mask(nb_wand(s->first <= before, s->last >= before)));
        const nb_real value = nb_select(near, along.value, zero), error = nb_select(near, along.error, zero);
        if (nb_any(covers)) {
            const nb_real sure = s->cells > 0 ? sure_part(s->cells, before, t) : NB_F(1.0);
            note_covering(&sum, body, covers, s->at_last * sure, value * sure);
        }
        for (int c = 0; c < 3; c++) {
            sum.depth.depth[c] = sum.depth.depth[c] + REAL(body->extinction[c]) * value;
            sum.depth.error[c] = sum.depth.error[c] + REAL(body->extinction[c]) * error;
        }
        terms = terms + nb_select(near, NB_F(1.0), zero);
        s->at_last = value;
    }
    for (int c = 0; c < 3; c++) sum.depth.error[c] = sum.depth.error[c] + sum.depth.depth[c] * (terms * NB_EPSILON);
    return sum;
}

/* Lists the shadows that lie on a step, at the start of which they are. */
static void list_shadows_of_step(sunlight *sun, nb_wide start, nb_wide end, nb_wmask lanes)
{
    size_t *last = &sun->first_shadow;
    for (size_t i = 0; i < sun->shadow_count; i++) {
        lit_shadow *s = &sun->shadows[i];
        if (!nb_wany(nb_wand(lanes, nb_wand(s->first <= end, s->last >= start)))) continue;
        s->at_last = s->at_start;
        *last = i;
        last = &s->next;
    }
    *last = sun->shadow_count;
}

/* The last place is where the next step starts, in these lanes. */
static void start_from_last(const sunlight *sun, nb_mask lanes)
{
    for (size_t i = sun->first_shadow; i < sun->shadow_count; i = sun->shadows[i].next) {
        lit_shadow *s = &sun->shadows[i];
        s->at_start = nb_select(lanes, s->at_last, s->at_start);
    }
}
