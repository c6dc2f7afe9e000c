/* Sunlight in one ball, or ellipsoid, of constant density that is the only fog. With q + t q' a place of the ray and v the
 * direction to the sun, both in the frame of the body, and R its radius there, the way from the place to its surface is
 *
 *     (sqrt(h^2 + v.v c) - h) / v.v,   h = (q + t q').v,   c = R^2 - (q + t q')^2:
 *
 * a line and a parabola along the ray, found once a step, and a root at each node. Within the body both are smooth: there
 * are no turns. Included by trace_sun.h. */

/* From where a step begins. */
typedef struct sphere_chords {
    nb_wide h, h_rate, c, c_rate, c_curve;
    nb_real square, inverse; /* v.v, and 1 by it */
    nb_real h_noise, c_noise;
} sphere_chords;

static sphere_chords find_ball_ways(const sunlight *sun, const packet_state *m, nb_wide t)
{
    const nb_leaf *leaf = &sun->snapshot->media[0].body.leaves[0];
    const local_ray local = localize(&m->rays, leaf);
    const nb_wvec3 q = nb_wadd3(local.p, nb_wscale3(local.d, t)), v = in_frame(leaf, sun->direction);
    const nb_wide radius = WIDE(FRAME(leaf, radius)), square = nb_wdot3(v, v);
    const nb_real reach = nb_narrow(local.reach), size = nb_narrow(radius + local.reach);
    return (sphere_chords){.h = nb_wdot3(q, v),
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
static nb_real ball_way(const sphere_chords *b, nb_wide x, nb_real *error)
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

/* What the rule makes of one channel. Within the body the way to the sun is concave along the ray, so that light is
 * nowhere more than at the nodes beside. */
typedef struct sphere_sum {
    nb_real light, error, steepness;
    nb_real depth; /* mean, by light */
} sphere_sum;

static sphere_sum sum_ball(const nb_real depth[SUN_NODES])
{
    sphere_sum sum = {NB_F(0.0), NB_F(0.0), nb_abs(depth[1] - depth[0]), NB_F(0.0)};
    nb_real seen[SUN_NODES];
    for (int n = 0; n < SUN_NODES; n++) {
        seen[n] = nb_exp(-depth[n]);
        const nb_real weighted = REAL(sun_weights[n]) * seen[n];
        sum.light = sum.light + weighted;
        sum.depth = sum.depth + weighted * depth[n];
        if (n == 0) continue;
        const nb_real most = nb_max(seen[n - 1], seen[n]) * REAL(sun_nodes[n] - sun_nodes[n - 1]);
        sum.error = sum.error + most * unseen_share(nb_abs(depth[n] - depth[n - 1]));
    }
    sum.error = sum.error + error_of_rule(seen, sum.light, NB_F(0.0));
    return sum;
}

static sun_step try_ball_step(const sunlight *sun, const packet_state *m, const ray_segment *p, const gathered_light *g,
                              const sun_walk *w, nb_real length, nb_wide end)
{
    const medium_hit *k = present(m, m->present_first);
    const sphere_chords b = find_ball_ways(sun, m, w->t);
    nb_real way[SUN_NODES], depth[SUN_NODES], worst = NB_F(0.0);
    sun_step s = begin_step(w, length, nb_wmask_false);
    end_step(m, p, g, end, &s);
    for (int n = 0; n < SUN_NODES; n++) {
        nb_real off = NB_F(0.0);
        const nb_real x = length * REAL(sun_nodes[n]);
        way[n] = x + ball_way(&b, nb_widen(x), m->wants_error ? &off : NULL);
        worst = nb_max(worst, off);
    }
    s.error = s.rounding = s.noise = s.steepness = NB_F(0.0);
    sphere_sum sum = {NB_F(0.0), NB_F(0.0), NB_F(0.0), NB_F(0.0)};
    for (int c = 0; c < 3; c++) {
        if (c == 0 || !sun->snapshot->is_gray) {
            for (int n = 0; n < SUN_NODES; n++) depth[n] = s.depth_before[c] + k->extinction[c] * way[n];
            sum = sum_ball(depth);
        }
        const nb_real full = k->glow[c] * length;
        const nb_real doubt = nb_min(s.error_before[c] + k->extinction[c] * worst, NB_F(1.0));
        const nb_real noise = full * (sum.depth + NB_F(16.0) * sum.light) * (NB_F(2.0) * NB_EPSILON);
        s.light[c] = full * sum.light;
        s.error = nb_max(s.error, full * sum.error);
        s.rounding = nb_max(s.rounding, s.light[c] * doubt + noise);
        s.noise = nb_max(s.noise, noise);
        s.steepness = nb_max(s.steepness, sum.steepness);
    }
    return s;
}
