/* Where the way from a ray to a light begins or ends to meet a body, or passes one of its edges: its *turns*. Over the
 * ray the ways are the lines b + t b' + u (v + t v'): to the sun from a place that moves, v' = 0; to a point light
 * from the point light, b' = 0. Turns are then roots of polynomials of the second degree. Included by trace_sun.h. */

static void note_turn(sunlight *sun, nb_wide t, nb_wmask real)
{
    if (!nb_wany(real)) return;
    if (sun->turn_count == sun->turn_capacity) {
        void *grown = grow_aligned(&sun->snapshot->allocator, sun->turns, sun->turn_count, sizeof *sun->turns,
                                   &sun->turn_capacity, sun->turn_count + 1, &sun->turn_memory);
        sun->out_of_memory = sun->out_of_memory || grown == NULL;
        if (grown == NULL) return;
        sun->turns = grown;
    }
    sun->turns[sun->turn_count++] = nb_wselect(real, t, NB_W(2.0) * NB_WFAR);
}

/* a t^2 + 2 b t + c = 0, t from `start` on. */
static void note_roots(sunlight *sun, nb_wide start, nb_wide a, nb_wide b, nb_wide c)
{
    const nb_wide square = b * b - a * c;
    const nb_wmask real = square >= NB_W(0.0);
    const nb_wide root = nb_wsqrt(nb_wmax(square, NB_W(0.0)));
    const nb_wide sum = -(b + nb_wselect(b < NB_W(0.0), -root, root));
    note_turn(sun, start + sum * nb_wrcp_bounded(a), real);
    note_turn(sun, start + c * nb_wrcp_bounded(sum), real);
}

/* ---- ways ------------------------------------------------------------------------------------ */

/* In a leaf's frame. */
typedef struct breakpoint_lines {
    nb_wvec3 base, base_rate;   /* b, b' */
    nb_wvec3 along, along_rate; /* v, v' */
} breakpoint_lines;

/* Where the ways touch the ball of a radius about `center`: |(b - center) x v| = radius |v|. */
static void note_ball(sunlight *sun, const breakpoint_lines *s, nb_wvec3 center, nb_wide radius)
{
    const nb_wvec3 apart = nb_wsub3(s->base, center), moment = nb_wcross3(apart, s->along);
    const nb_wvec3 rate = nb_wadd3(nb_wcross3(s->base_rate, s->along), nb_wcross3(apart, s->along_rate));
    const nb_wide r2 = radius * radius;
    note_roots(sun, NB_W(0.0), nb_wdot3(rate, rate) - r2 * nb_wdot3(s->along_rate, s->along_rate),
               nb_wdot3(moment, rate) - r2 * nb_wdot3(s->along, s->along_rate),
               nb_wdot3(moment, moment) - r2 * nb_wdot3(s->along, s->along));
}

/* x x + y y - w w, w the radius of the mantle. */
static nb_wide mantle_form(nb_wvec3 a, nb_wide wa, nb_wvec3 b, nb_wide wb)
{
    return a.x * b.x + a.y * b.y - wa * wb;
}

/* The mantle x^2 + y^2 = (radius + slope z)^2 without end: where the quadratic in u has a double root. */
static void note_mantle(sunlight *sun, const breakpoint_lines *s, nb_wide radius, nb_wide slope)
{
    const nb_wvec3 b = s->base, db = s->base_rate, v = s->along, dv = s->along_rate;
    const nb_wide wb = radius + slope * b.z, wdb = slope * db.z, wv = slope * v.z, wdv = slope * dv.z;
    const nb_wide bv = mantle_form(b, wb, v, wv), rate = mantle_form(db, wdb, v, wv) + mantle_form(b, wb, dv, wdv);
    const nb_wide vv = mantle_form(v, wv, v, wv), vdv = mantle_form(v, wv, dv, wdv), bb = mantle_form(b, wb, b, wb);
    const nb_wide bdb = mantle_form(b, wb, db, wdb), dbdb = mantle_form(db, wdb, db, wdb);
    const nb_wide dvdv = mantle_form(dv, wdv, dv, wdv);
    note_roots(sun, NB_W(0.0), rate * rate - vv * dbdb - dvdv * bb, bv * rate - vv * bdb - vdv * bb, bv * bv - vv * bb);
}

/* The rim where the mantle ends at this z, which ways meet at u = (z - b.z) / v.z: multiplied by v.z. */
static void note_rim(sunlight *sun, const breakpoint_lines *s, nb_wide z, nb_wide radius)
{
    const nb_wvec3 b = s->base, db = s->base_rate, v = s->along, dv = s->along_rate;
    const nb_wide up = z - b.z;
    const nb_wide x = b.x * v.z + up * v.x, dx = db.x * v.z + b.x * dv.z - db.z * v.x + up * dv.x;
    const nb_wide y = b.y * v.z + up * v.y, dy = db.y * v.z + b.y * dv.z - db.z * v.y + up * dv.y;
    const nb_wide r2 = radius * radius;
    note_roots(sun, NB_W(0.0), dx * dx + dy * dy - r2 * dv.z * dv.z, x * dx + y * dy - r2 * v.z * dv.z,
               x * x + y * y - r2 * v.z * v.z);
}

/* A face n.x = distance: off + t off_rate + u (rise + t rise_rate) = 0 */
typedef struct breakpoint_faces {
    nb_wide off, off_rate, rise, rise_rate;
} breakpoint_faces;

static breakpoint_faces ways_to_face(const breakpoint_lines *s, nb_wvec3 n, nb_wide distance)
{
    return (breakpoint_faces){nb_wdot3(n, s->base) - distance, nb_wdot3(n, s->base_rate), nb_wdot3(n, s->along),
                              nb_wdot3(n, s->along_rate)};
}

/* An edge: where ways meet both faces at once. */
static void note_edge(sunlight *sun, const breakpoint_faces *a, const breakpoint_faces *b)
{
    const nb_wide value = a->off * b->rise - b->off * a->rise;
    const nb_wide rate =
        a->off_rate * b->rise - b->off_rate * a->rise + (a->off * b->rise_rate - b->off * a->rise_rate);
    note_turn(sun, -value * nb_wrcp_bounded(rate), nb_wabs(rate) > NB_W(1e-30));
}

/* ---- bodies ---------------------------------------------------------------------------------- */

static void note_box(sunlight *sun, const nb_leaf *leaf, const breakpoint_lines *s)
{
    breakpoint_faces faces[3][2];
    for (int i = 0; i < 3; i++) {
        const nb_wvec3 n = nb_wvec3(WIDE(i == 0), WIDE(i == 1), WIDE(i == 2));
        faces[i][0] = ways_to_face(s, n, WIDE(leaf->low[i]));
        faces[i][1] = ways_to_face(s, n, WIDE(leaf->high[i]));
    }
    for (int i = 0; i < 3; i++)
        for (int k = 0; k < 4; k++) note_edge(sun, &faces[i][k & 1], &faces[(i + 1) % 3][k >> 1]);
}

static void note_planes(sunlight *sun, const nb_volume *body, const nb_leaf *leaf, const breakpoint_lines *s)
{
    breakpoint_faces faces[NB_MAX_EDGED_FACES];
    if (leaf->face_count > NB_MAX_EDGED_FACES) return;
    for (size_t i = 0; i < leaf->face_count; i++) {
        const nb_face *face = &body->faces[leaf->first_face + i];
        faces[i] = ways_to_face(s, wide_vector(face->normal), WIDE(face->distance));
        for (size_t k = 0; k < i; k++) note_edge(sun, &faces[i], &faces[k]);
    }
}

static void note_round(sunlight *sun, const nb_leaf *leaf, const breakpoint_lines *s)
{
    const nb_wvec3 zero = nb_wvec3(NB_W(0.0), NB_W(0.0), NB_W(0.0));
    const nb_wide one = NB_W(1.0);
    if (leaf->type == NB_LEAF_SPHERE) {
        note_ball(sun, s, zero, WIDE(FRAME(leaf, radius)));
    } else if (leaf->type == NB_LEAF_CAPSULE) {
        const nb_wide length = WIDE(FRAME(leaf, length));
        note_mantle(sun, s, one, NB_W(0.0));
        note_ball(sun, s, zero, one);
        note_ball(sun, s, nb_wvec3(NB_W(0.0), NB_W(0.0), length), one);
        note_rim(sun, s, NB_W(0.0), one); /* the curvature jumps where mantle and caps meet */
        note_rim(sun, s, length, one);
    } else {
        const int cone = leaf->type == NB_LEAF_CONE;
        const nb_wide radius = cone ? WIDE(FRAME(leaf, radius)) : one;
        const nb_wide slope = cone ? WIDE(FRAME(leaf, slope)) : NB_W(0.0);
        note_mantle(sun, s, radius, slope);
        note_rim(sun, s, NB_W(0.0), radius);
        note_rim(sun, s, one, radius + slope);
    }
}

/* ---- all of them ----------------------------------------------------------------------------- */

/* Of a ray p + t d to a light in the direction `towards`, or as far from p; all in one frame. */
static breakpoint_lines make_ways(nb_wvec3 p, nb_wvec3 d, nb_wvec3 towards, int is_light)
{
    const nb_wvec3 zero = nb_wvec3(NB_W(0.0), NB_W(0.0), NB_W(0.0));
    if (!is_light) return (breakpoint_lines){p, d, towards, zero};
    return (breakpoint_lines){nb_wadd3(p, towards), zero, nb_wsub3(zero, towards), d};
}

/* The shadow of a gaussian has no edge: its steep parts and its middle. */
static void note_gaussian(sunlight *sun, const packet *rays, const nebel_density *density, nb_wvec3 towards,
                          int is_light)
{
    const breakpoint_lines s = make_ways(rays->origin, rays->direction, towards, is_light);
    const nb_wvec3 center = wide_vector(density->center);
    note_ball(sun, &s, center, WIDE(density->sigma));
    note_ball(sun, &s, center, WIDE(4 * density->sigma));
}

/* Within this ball the density is the same everywhere. */
static void note_altitude(sunlight *sun, const packet *rays, const nebel_density *density, nb_wvec3 towards,
                          int is_light)
{
    const breakpoint_lines s = make_ways(rays->origin, rays->direction, towards, is_light);
    note_ball(sun, &s, wide_vector(density->center), WIDE(density->radius + density->base));
}

/* Across this plane a density has a kink. So has the depth of ways that run along it, as all of them pass it at once. */
static void note_level(sunlight *sun, const breakpoint_lines *s, nb_wvec3 n, nb_wide level)
{
    const breakpoint_faces f = ways_to_face(s, n, level);
    const nb_wide most = nb_wsqrt(nb_wdot3(n, n) * nb_wdot3(s->along, s->along)) * NB_W(1e-9);
    note_turn(sun, -f.off * nb_wrcp_bounded(f.off_rate), nb_wand(nb_wabs(f.rise) <= most, nb_wabs(f.off_rate) > most));
}

/* Soft edges of flat faces begin and end so, and those of boxes in their middle. */
static void note_soft_edges(sunlight *sun, const packet *rays, const nb_volume *body)
{
    const nb_leaf *leaf = &body->leaves[0];
    const local_ray local = localize(rays, leaf);
    const breakpoint_lines s = make_ways(local.p, local.d, in_frame(leaf, sun->direction), 0);
    const double distance = body->density.edge_width;
    for (int i = 0; i < 3 && leaf->type == NB_LEAF_BOX; i++) {
        const nb_wvec3 n = nb_wvec3(WIDE(i == 0), WIDE(i == 1), WIDE(i == 2));
        note_level(sun, &s, n, WIDE(leaf->low[i] + distance));
        note_level(sun, &s, n, WIDE(leaf->high[i] - distance));
        note_level(sun, &s, n, WIDE(0.5 * (leaf->low[i] + leaf->high[i])));
    }
    for (size_t i = 0; i < leaf->face_count && leaf->type == NB_LEAF_PLANES; i++) {
        const nb_face *face = &body->faces[leaf->first_face + i];
        note_level(sun, &s, wide_vector(face->normal), WIDE(face->distance - distance));
    }
}

/* Of a body in the sun. */
static void note_levels(sunlight *sun, const packet *rays, const nb_volume *body)
{
    const nebel_density *density = &body->density;
    const breakpoint_lines s = make_ways(rays->origin, rays->direction, sun->direction, 0);
    if (density->type == NEBEL_DENSITY_SOFT_EDGE) note_soft_edges(sun, rays, body);
    if (density->type == NEBEL_DENSITY_HEIGHT && density->below == NEBEL_BELOW_CONSTANT)
        note_level(sun, &s, nb_wvec3(NB_W(0.0), NB_W(1.0), NB_W(0.0)), WIDE(density->base));
    if (density->type != NEBEL_DENSITY_LINEAR) return;
    const nb_wvec3 from = wide_vector(density->from), to = wide_vector(density->to), n = nb_wsub3(to, from);
    note_level(sun, &s, n, nb_wdot3(n, from));
    note_level(sun, &s, n, nb_wdot3(n, to));
}

static void note_leaf(sunlight *sun, const packet *rays, const nb_volume *body, const nb_leaf *leaf, nb_wvec3 towards,
                      int is_light)
{
    if (leaf->type == NB_LEAF_WORLD) return;
    const local_ray local = localize(rays, leaf);
    const breakpoint_lines s = make_ways(local.p, local.d, in_frame(leaf, towards), is_light);
    if (leaf->type == NB_LEAF_BOX)
        note_box(sun, leaf, &s);
    else if (leaf->type == NB_LEAF_PLANES)
        note_planes(sun, body, leaf, &s);
    else
        note_round(sun, leaf, &s);
}

/* Of all media, whether the rays meet them or not: their shadows may. `point_light` NULL: in the light of the sun. */
static void note_media(sunlight *sun, const packet *rays, const nb_light *point_light)
{
    const nebel_snapshot *snapshot = sun->snapshot;
    const nb_wvec3 towards =
        point_light != NULL ? nb_wsub3(wide_vector(point_light->place), rays->origin) : sun->direction;
    if (snapshot->medium_count > MOST_TURNING_MEDIA) return;
    for (size_t i = 0; i < snapshot->medium_count; i++) {
        const nb_volume *body = &snapshot->media[i].body;
        for (size_t k = 0; k < body->leaf_count; k++)
            note_leaf(sun, rays, body, &body->leaves[k], towards, point_light != NULL);
        if (point_light == NULL) note_levels(sun, rays, body);
        if (body->density.type == NEBEL_DENSITY_GAUSSIAN)
            note_gaussian(sun, rays, &body->density, towards, point_light != NULL);
        if (body->density.type == NEBEL_DENSITY_ALTITUDE && body->density.below == NEBEL_BELOW_CONSTANT)
            note_altitude(sun, rays, &body->density, towards, point_light != NULL);
    }
}
