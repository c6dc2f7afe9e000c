/* Light of point lights that fog scatters towards the eye, once: steps as in trace_sun.h, of equal angles as the point
 * light sees them (formulas/point_light.inc), from turn to turn, where a ray enters or leaves a point light's cone or
 * the point light itself. Included by trace_kernel.c. */

/* What point lights that are left out may give, of what all point lights' steps may be off by. */
#define FAINT_SHARE 0.05

/* A point light that is passed by a packet of rays. */
typedef struct light_pass {
    const nb_light *point_light;
    nb_wvec3 foot;          /* from the point light to the place closest to it on the line of a ray */
    nb_wide closest;        /* where that is, m along the ray */
    nb_wide aside2, aside;  /* its distance squared; its distance, at least the point light's radius */
    sun_attenuation *shade; /* NULL: no surface keeps its light away */
    double share;           /* what its steps may add to the error */
    nb_real scatter;        /* radiance per irradiance that fog of the piece gives at most, where it is opaque */
} light_pass;

/* ---- a point light ---------------------------------------------------------------------------------- */

/* The cone (v.axis)^2 = cosine^2 v.v about foot + x direction; its mirror image does no harm. */
static void note_cone(sunlight *sun, const light_pass *pass, nb_wvec3 direction, double cosine)
{
    const nb_wvec3 axis = wide_vector(pass->point_light->axis);
    const nb_wide square = WIDE(cosine * cosine), f = nb_wdot3(pass->foot, axis), d = nb_wdot3(direction, axis);
    note_roots(sun, pass->closest, d * d - square, f * d, f * f - square * pass->aside2);
}

/* Turns of the point light itself: its surface and its cones; and where a ray passes through it the place closest to
 * its centre, beyond which light comes from behind. */
static void note_light(sunlight *sun, const packet_state *m, const light_pass *pass)
{
    const nb_light *point_light = pass->point_light;
    note_turn(sun, pass->closest, pass->aside2 < WIDE(point_light->radius2));
    note_roots(sun, pass->closest, NB_W(1.0), NB_W(0.0), pass->aside2 - WIDE(point_light->radius2));
    if (!point_light->is_spot) return;
    note_cone(sun, pass, m->rays.direction, point_light->edge);
    note_cone(sun, pass, m->rays.direction, point_light->inner);
}

/* Those of the media, too. */
static void find_light_breakpoints(sunlight *sun, const packet_state *m, const light_pass *pass)
{
    if (find_turns(sun, &m->rays, pass->point_light)) note_light(sun, m, pass);
}

static light_pass pass_light(const packet_state *m, const nb_light *point_light)
{
    const nb_wvec3 apart = nb_wsub3(m->rays.origin, wide_vector(point_light->place)), d = m->rays.direction;
    light_pass pass = {.point_light = point_light, .closest = -nb_wdot3(apart, d)};
    pass.foot = nb_wadd3(apart, nb_wscale3(d, pass.closest));
    pass.aside2 = nb_wdot3(pass.foot, pass.foot);
    pass.aside = nb_wsqrt(nb_wmax(pass.aside2, WIDE(point_light->radius2)));
    return pass;
}

/* The most irradiance between two places. */
static nb_real most_fluence(const light_pass *pass, nb_wide start, nb_wide end)
{
    const nb_wide nearest = nb_wmax(nb_wmin(pass->closest, end), start) - pass->closest;
    const nb_real fluence =
        nb_narrow(nb_light_fluence(pass->aside2 + nearest * nearest, WIDE(pass->point_light->radius2)));
    const double *intensity = pass->point_light->intensity;
    return fluence * REAL(fmax(fmax(intensity[0], intensity[1]), intensity[2]));
}

/* Radiance of the brightest fog between two places, opaque and with nothing before the point light. */
static nb_real max_of_light(const light_pass *pass, nb_wide start, nb_wide end)
{
    return most_fluence(pass, start, end) * pass->scatter;
}

/* The most irradiance of all point lights anywhere on the rays. */
static nb_real max_of_lights(const packet_state *m)
{
    const nebel_lighting *lighting = m->sun->lighting;
    nb_real most = NB_F(0.0);
    for (size_t i = 0; i < lighting->light_count; i++) {
        const light_pass pass = pass_light(m, &lighting->lights[i]);
        most = most + most_fluence(&pass, NB_W(0.0), m->rays.t_max);
    }
    return most;
}

/* ---- a node ---------------------------------------------------------------------------------- */

/* Optical depth from t to the point light. */
static light_depth way_to_light(sunlight *sun, const packet_state *m, const light_pass *pass, nb_wide t, nb_wmask lanes)
{
    const nb_wvec3 apart = nb_wadd3(pass->foot, nb_wscale3(m->rays.direction, t - pass->closest));
    const nb_wide distance = nb_wsqrt(nb_wdot3(apart, apart));
    const nb_wvec3 towards = nb_wscale3(apart, -nb_wrcp_bounded(distance));
    const nb_wide clear = nb_wmax(distance - WIDE(pass->point_light->clear), NB_W(0.0));
    const nb_wide reach = nb_wselect(lanes, clear, NB_W(0.0));
    return sun->snapshot->adds_depths ? depth_of_bodies(sun, m, t, towards, reach, 0)
                                      : depth_by_march(sun, m, t, towards, reach);
}

/* What part of its light a spot sends away from the direction in which it is seen. At the edge of a hard cone the rounding
 * of a float cosine would decide, so that the difference is taken before. */
static nb_real part_in_cone(const nb_light *point_light, nb_wvec3 towards)
{
    const nb_wide within = -nb_wdot3(towards, wide_vector(point_light->axis)) - WIDE(point_light->edge);
    return nb_light_cone(nb_narrow(within), NB_F(0.0), REAL(point_light->rise));
}

/* What fog at t makes of the point light's irradiance there. */
static lit_fog point_lit_fog(const packet_state *m, const light_pass *pass, nb_wide t)
{
    const nb_light *point_light = pass->point_light;
    const nb_real zero = NB_F(0.0);
    const nb_wvec3 apart = nb_wadd3(pass->foot, nb_wscale3(m->rays.direction, t - pass->closest));
    const nb_wide square = nb_wdot3(apart, apart);
    const nb_wvec3 towards = nb_wscale3(apart, -nb_wrcp_bounded(nb_wsqrt(square)));
    const nb_turn turn = nb_turn_between(m->rays.direction, towards);
    nb_real fluence = nb_narrow(nb_light_fluence(square, WIDE(point_light->radius2)));
    if (point_light->is_spot) fluence = fluence * part_in_cone(point_light, towards);
    lit_fog fog = {{zero, zero, zero}, {zero, zero, zero}, zero};
    for (size_t i = m->present_first; i < m->present_end; i++) {
        const medium_hit *k = present(m, i);
        const nb_volume *body = &k->medium->body;
        const nb_real density = nb_select(k->inside, contact_density(k, t), zero);
        const nb_real value = k->lit->scatters_lights ? scattered(&body->phase, turn) * fluence : zero;
        for (int c = 0; c < 3; c++) {
            const nb_real radiance = REAL(body->albedo[c]) * (value * REAL(point_light->intensity[c]));
            fog.extinction[c] = fog.extinction[c] + k->extinction[c] * density;
            fog.glow[c] = fog.glow[c] + k->extinction[c] * density * radiance;
            fog.most = nb_select(k->inside, nb_max(fog.most, radiance), fog.most);
        }
    }
    return fog;
}

/* How many metres node n stands for. */
static nb_real length_past_light(const sun_step *s, nb_wide t, int n)
{
    const nb_real at = REAL(sun_nodes[n]);
    const nb_wide w = nb_widen(s->length * scaled_place(s, at)), from = t - s->point_light->closest;
    return nb_narrow((s->point_light->aside * s->point_light->aside + from * from) * nb_swing_rate(s->swing, w) *
                     nb_widen(s->length * scaled_speed(s, at)));
}

/* ---- steps ----------------------------------------------------------------------------------- */

/* As limit_step, by the most that the point light brings to the step. */
static void limit_light_step(const light_pass *pass, const nb_real before[3], nb_wide end, sun_step *s)
{
    const nb_real most = max_of_light(pass, s->start, end);
    limit_light(before, (nb_real[3]){most, most, most}, s);
}

static void step_past_light(sunlight *sun, const packet_state *m, const light_pass *pass, const sun_piece *along,
                            sun_walk *w, gathered_light *g)
{
    const nb_mask last = w->left <= NB_F(1.0); /* the rest is one step, whatever its error */
    const nb_wide bright = pass->shade != NULL ? nb_wmin(pass->shade->boundary, along->p->end) : along->p->end;
    const nb_wide next = nb_wmin(next_turn(sun, w->t, bright), nearest_kink(m, w->t, bright));
    const nb_wide stop = nb_wselect(nb_widen_mask(last), bright, next);
    const nb_swing swing = nb_swing_between(pass->closest, pass->aside, w->t, stop);
    const nb_real rest = nb_narrow(swing.end), length = nb_select(last, rest, nb_min(w->guess, rest));
    const nb_wmask to_stop = nb_widen_mask(length >= rest);
    sun_step s = begin_step(w, length, to_stop);
    s.point_light = pass;
    s.swing = swing;
    const nb_wide within = nb_wmin(nb_swing_place(s.swing, nb_widen(s.length)), stop);
    const nb_wide end = nb_wselect(to_stop, stop, within);
    const nb_wmask turns = nb_wand(to_stop, stop < bright);
    set_scale(&s, nb_narrow_mask(w->at_turn), nb_narrow_mask(turns));
    const sun_origin from = origin_of(along, w);
    end_step(m, &from.p, &from.before, end, &s);
    sum_light_nodes(sun, m, &from.p, &from.before, w->lanes, end, &s);
    limit_light_step(pass, w->before, end, &s);
    const nb_real least = s.noise + s.noise; /* what no shorter step makes less */
    const nb_real part_of_piece = nb_narrow(end - w->t) / along->whole;
    const nb_real allowed =
        least + REAL(pass->share) *
                    (NB_F(0.5) * s.drop + NB_F(0.25) * part_of_piece / along->pieces + NB_F(0.001) / along->pieces);
    const nb_mask fits = nb_or(last, s.error <= allowed);
    take_sun_step(g, w, &s, end, turns, nb_and(fits, nb_narrow_mask(w->lanes)), allowed);
    w->left = w->left - NB_F(1.0);
}

static void walk_past_light(sunlight *sun, const packet_state *m, const light_pass *pass, const sun_piece *s,
                            nb_mask lanes, gathered_light *g)
{
    find_light_breakpoints(sun, m, pass);
    sun_walk w = begin_walk(m, s->p, &s->before, lanes);
    w.guess = nb_narrow(nb_swing_between(pass->closest, pass->aside, w.t, w.t + nb_widen(w.guess)).end);
    while (nb_wany(w.lanes)) {
        if (pass->shade != NULL) pass_boundaries(pass->shade, w.t, w.lanes);
        const nb_wmask dark = pass->shade != NULL ? nb_wand(w.lanes, pass->shade->is_dark) : nb_wmask_false;
        if (nb_wany(dark))
            pass_shadow(pass->shade, m, s, &w, dark);
        else
            step_past_light(sun, m, pass, s, &w, g);
        w.lanes = nb_wand(w.lanes, w.t < s->p->end);
    }
}

/* ---- all point lights ------------------------------------------------------------------------------- */

/* Of all lobes at their peaks, of either side. */
static double most_scattered(const nb_volume *body)
{
    double most = 0;
    for (int i = 0; i < body->phase.lobe_count; i++) {
        const nb_lobe *lobe = &body->phase.lobes[i];
        most += lobe->factor * (1 + lobe->alpha) / (lobe->peak * sqrt(lobe->peak));
    }
    return most * fmax(fmax(body->albedo[0], body->albedo[1]), body->albedo[2]);
}

/* The lanes that are inside fog which point lights light, and what it makes of their light at most. */
static nb_mask lit_lanes(const packet_state *m, const ray_segment *p, nb_real *scatter)
{
    nb_mask lit = nb_mask_false;
    *scatter = NB_F(0.0);
    for (size_t i = m->present_first; i < m->present_end; i++) {
        const medium_hit *k = present(m, i);
        if (!k->lit->scatters_lights) continue;
        lit = nb_or(lit, k->inside);
        *scatter = nb_select(k->inside, nb_max(*scatter, REAL(most_scattered(&k->medium->body))), *scatter);
    }
    return nb_and(lit, p->lanes);
}

/* Adds the light of all point lights in a piece; `g` is what was gathered before it. Point lights that no one would
 * miss only add to the error. */
static void gather_point_lights(sunlight *sun, const packet_state *m, const ray_segment *p, gathered_light *g)
{
    nb_real scatter, behind[3];
    const nb_mask lit = lit_lanes(m, p, &scatter);
    if (!nb_any(lit)) return;
    const nebel_lighting *lighting = sun->lighting;
    const sun_piece s = sun_piece_of(m, p, g, lanes_in_voxels(m));
    transmittance_until(m, p, &s.before, p->end, behind);
    nb_real drop = NB_F(0.0);
    for (int c = 0; c < 3; c++) drop = nb_max(drop, s.before.transmittance[c] - behind[c]);
    for (size_t i = 0; i < lighting->light_count; i++) {
        light_pass pass = pass_light(m, &lighting->lights[i]);
        pass.shade = sun->light_shades != NULL ? &sun->light_shades[i] : NULL;
        pass.share = sun->share / (double)lighting->light_count;
        pass.scatter = scatter;
        const nb_real most = most_fluence(&pass, p->start, p->end) * scatter;
        const nb_mask faint = most <= REAL(FAINT_SHARE * pass.share);
        g->radiance_error = g->radiance_error + nb_select(nb_and(faint, lit), most * drop, NB_F(0.0));
        const nb_mask lanes = nb_and(lit, nb_not(faint));
        const nb_real faces = largest(s.before.transmittance) * most;
        g->radiance_error = g->radiance_error + doubt_at_faces(sun, m, &pass, p, faces, lanes);
        if (nb_any(lanes)) walk_past_light(sun, m, &pass, &s, lanes, g);
    }
}

/* ---- all lights ------------------------------------------------------------------------------ */

/* `sunlit`: the lanes in which the sun's light is still to be added. */
static void gather_lights(sunlight *sun, const packet_state *m, const ray_segment *p, nb_mask sunlit, gathered_light *g)
{
    nb_real before[3] = {g->radiance[0], g->radiance[1], g->radiance[2]};
    if (sun->lighting->scatters_sun) gather_sunlight(sun, m, p, sunlit, g);
    note_group(sun->by_sun, before, g);
    for (int c = 0; c < 3; c++) before[c] = g->radiance[c];
    if (sun->lighting->scatters_lights) gather_point_lights(sun, m, p, g);
    note_group(sun->by_lights, before, g);
}

/* Room for the shadows of all point lights, where there are any. 0 when memory is out. */
static int open_light_shades(sunlight *sun, const nb_trace_job *job)
{
    const nebel_lighting *lighting = sun->lighting;
    if (!lighting->scatters_lights || job->light_visibility == NULL) return 1;
    char *raw = nb_allocate(&sun->snapshot->allocator, lighting->light_count + 1,
                            sizeof(sun_attenuation) > ALIGNMENT ? sizeof(sun_attenuation) : ALIGNMENT);
    if (raw == NULL) return 0;
    sun->shade_memory = raw;
    sun->light_shades = (sun_attenuation *)(void *)(raw + (ALIGNMENT - (uintptr_t)raw % ALIGNMENT) % ALIGNMENT);
    return 1;
}

/* Before a packet of `count` rays, the first of them by the number `first`. Turns are found where they are asked for.
 */
static void begin_lights(sunlight *sun, const nb_trace_job *job, size_t first, size_t count)
{
    sun->has_turns = 0;
    for (int c = 0; c < 3; c++) sun->by_sun[c] = sun->by_lights[c] = NB_F(0.0);
    begin_shade(&sun->shade, job->first_boundary != NULL ? job->first_boundary + first : NULL, job->boundaries, count);
    for (size_t i = 0; sun->light_shades != NULL && i < sun->lighting->light_count; i++) {
        const nebel_ray_visibility *lit = &job->light_visibility[i];
        begin_shade(&sun->light_shades[i], lit->offsets + job->first_visibility + first, lit->boundaries, count);
    }
}
