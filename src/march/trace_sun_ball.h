/* Sunlight in one ball, or ellipsoid, of constant density that is the only fog. With q + t q' a place of the ray and v the
 * direction to the sun, both in the frame of the body, and R its radius there, the way from the place to its surface is
 *
 *     (sqrt(h^2 + v.v c) - h) / v.v,   h = (q + t q').v,   c = R^2 - (q + t q')^2:
 *
 * a line and a parabola along the ray, found once a step, and a root at each node. Within the body both are smooth: there
 * are no turns. Included by trace_sun.h. */

/* From where a step begins. */
typedef struct ball_ways {
    nb_wide h, h_rate, c, c_rate, c_curve;
    nb_real square, inverse; /* v.v, and 1 by it */
    nb_real h_noise, c_noise;
} ball_ways;

static ball_ways find_ball_ways(const sunlight *sun, const march *m, nb_wide t)
{
    const nb_leaf *leaf = &sun->snapshot->media[0].body.leaves[0];
    const local_ray local = localize(&m->rays, leaf);
    const nb_wvec3 q = nb_wadd3(local.p, nb_wscale3(local.d, t)), v = in_frame(leaf, sun->direction);
    const nb_wide radius = WIDE(FRAME(leaf, radius)), square = nb_wdot3(v, v);
    const nb_real reach = nb_narrow(local.reach), size = nb_narrow(radius + local.reach);
    return (ball_ways){.h = nb_wdot3(q, v),
                       .h_rate = nb_wdot3(local.d, v),
                       .c = radius * radius - nb_wdot3(q, q),
                       .c_rate = NB_W(-2.0) * nb_wdot3(q, local.d),
                       .c_curve = -nb_wdot3(local.d, local.d),
                       .square = nb_narrow(square),
                       .inverse = nb_narrow(NB_W(1.0) / square),
                       .h_noise = NB_F(4.0) * reach * nb_narrow(nb_wsqrt(square)),
                       .c_noise = NB_F(8.0) * size * reach};
}

/* The length of the way from a place x m into the step, and by how much it may be off where that is asked. Of both roots of the quadratic the
 * one that loses no digits. */
static nb_real ball_way(const ball_ways *b, nb_wide x, nb_real *error)
{
    const nb_real zero = NB_F(0.0);
    const nb_real h = nb_narrow(b->h + x * b->h_rate);
    const nb_real c = nb_max(nb_narrow(b->c + x * (b->c_rate + x * b->c_curve)), zero);
    const nb_real root = nb_sqrt(h * h + b->square * c);
    const nb_real length = nb_select(h > zero, c / nb_max(h + root, NB_TINY), (root - h) * b->inverse);
    if (error == NULL) return length;
    const nb_real least = nb_sqrt(b->square * b->c_noise);
    *error = b->c_noise / nb_max(root + least, NB_TINY) + b->h_noise * b->inverse + length * (NB_F(8.0) * NB_EPSILON);
    return length;
}

/* What both rules make of one channel. The doubt of the depth is the largest of all nodes. */
typedef struct ball_sum {
    nb_real light, three;
} ball_sum;

static ball_sum sum_ball(const nb_real depth[SUN_NODES])
{
    ball_sum sum = {NB_F(0.0), NB_F(0.0)};
    for (int n = 0; n < SUN_NODES; n++) {
        const nb_real seen = nb_exp(-depth[n]);
        sum.light = sum.light + REAL(sun_weights[n]) * seen;
        if (sun_weights_of_three[n] > 0) sum.three = sum.three + REAL(sun_weights_of_three[n]) * seen;
    }
    return sum;
}

static sun_step try_ball_step(sunlight *sun, const march *m, const piece *p, const gathered *g, const sun_walk *w,
                              nb_real length, nb_wide end)
{
    const contact *k = present(m, m->present_first);
    const ball_ways b = find_ball_ways(sun, m, w->t);
    nb_real before[3], error[3], way[SUN_NODES], depth[SUN_NODES], worst = NB_F(0.0);
    sun_step s = {.start = w->t, .length = length, .amount = NB_W(0.0), .amount_error = NB_F(0.0)};
    depth_until(m, p, g, end, before, error);
    map_channels(sun->snapshot, transmitted, before, s.behind);
    depth_until(m, p, g, w->t, before, error);
    for (int n = 0; n < SUN_NODES; n++) {
        nb_real off = NB_F(0.0);
        const nb_real x = length * REAL(sun_nodes[n]);
        way[n] = x + ball_way(&b, nb_widen(x), m->wants_error ? &off : NULL);
        worst = nb_max(worst, off);
    }
    s.error = s.rounding = NB_F(0.0);
    ball_sum sum = {NB_F(0.0), NB_F(0.0)};
    for (int c = 0; c < 3; c++) {
        nb_real most = NB_F(0.0);
        for (int n = 0; n < SUN_NODES; n++) {
            depth[n] = before[c] + k->extinction[c] * way[n];
            most = nb_max(most, depth[n]);
        }
        if (c == 0 || !sun->snapshot->is_gray) sum = sum_ball(depth);
        const nb_real full = k->glow[c] * length;
        const nb_real doubt = nb_min(error[c] + k->extinction[c] * worst, NB_F(1.0));
        s.light[c] = full * sum.light;
        s.taken[c] = w->before[c] - s.behind[c]; /* the rule cannot miss where light is lost: it is lost evenly */
        s.error = nb_max(s.error, full * nb_abs(sum.light - sum.three));
        s.rounding = nb_max(s.rounding, s.light[c] * (doubt + (most + NB_F(16.0)) * (NB_F(2.0) * NB_EPSILON)));
    }
    return s;
}
