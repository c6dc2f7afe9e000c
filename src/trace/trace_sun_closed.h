/* Sunlight in closed form, where the whole depth, that up to t and that from there to the sun, is linear in the optical
 * depth along the ray: between the flat faces of constant densities, and in height fog, where both are multiples of
 * differences of densities (T16 of the collected physics is the layer). Included by trace_sun.h. */

static int has_closed_steps(const sunlight *sun)
{
    return sun->lighting->sun_depth_method == NB_SUN_DEPTH_FLAT ||
           sun->lighting->sun_depth_method == NB_SUN_DEPTH_HEIGHT;
}

/* By how much the whole depth changes over a length of `length` at density 1. In height fog that is known without the
 * difference, also where its densities are beyond all numbers: the way to the sun loses direction.y / sun.y of what
 * the ray gains. */
static nb_real change_of_depth(const sunlight *sun, const packet_state *m, const medium_hit *k, int c, nb_real length,
                               nb_real difference)
{
    if (sun->lighting->sun_depth_method != NB_SUN_DEPTH_HEIGHT) return nb_abs(difference);
    const nb_real kept = NB_F(1.0) - nb_narrow(m->rays.direction.y / sun->direction.y);
    return nb_abs(k->extinction[c] * kept) * length;
}

/* What an error of the depth at one end does to the light, relative to it: less where the depth rises by `rise`
 * towards that end, so that most light comes from elsewhere. */
static nb_real doubt_of_end(nb_real error, nb_real rise)
{
    return nb_min(error * nb_min(NB_F(2.0) / nb_max(rise, NB_TINY), NB_F(1.0)), NB_F(1.0));
}

/* A place on each ray: optical depth up to it, and from there to the sun. */
typedef struct sun_place {
    nb_wide t;
    nb_real depth[3], error[3];
    light_depth to_sun;
} sun_place;

/* Between two places: optical depth, the longest of extinction 1, and what full sunlight would add. */
typedef struct sun_interval {
    nb_real depth[3], depth_error[3], light[3], light_error[3], length;
} sun_interval;

static sun_interval stretch_between(const packet_state *m, nb_wide start, nb_wide end)
{
    const nb_real zero = NB_F(0.0), h = nb_narrow(end - start);
    sun_interval s = {{zero, zero, zero}, {zero, zero, zero}, {zero, zero, zero}, {zero, zero, zero}, zero};
    for (size_t i = m->present_first; i < m->present_end; i++) {
        const medium_hit *k = present(m, i);
        const nb_estimate along = contact_integral(k, start, end, h);
        const nb_real value = nb_select(k->inside, along.value, zero), error = nb_select(k->inside, along.error, zero);
        s.length = nb_max(s.length, value);
        for (int c = 0; c < 3; c++) {
            s.depth[c] = s.depth[c] + k->extinction[c] * value;
            s.depth_error[c] = s.depth_error[c] + k->extinction[c] * error;
            s.light[c] = s.light[c] + k->glow[c] * value;
            s.light_error[c] = s.light_error[c] + k->glow[c] * error;
        }
    }
    return s;
}

/* Where the depth to the sun is looked at for an end of a stretch: beside it, as at a body's face itself the way to the
 * sun may run along it. */
static nb_wide beside(nb_wide t, nb_wide other)
{
    const nb_wide most = WIDE(MOST_MARGIN);
    return t + nb_wmin(nb_wmax((other - t) * WIDE(STEP_MARGIN), -most), most);
}

/* At both ends of a stretch, along which it is linear, from the depths beside them. */
static void extend_to_ends(light_depth *first, light_depth *last, nb_wide start, nb_wide end)
{
    const nb_wide margin = beside(start, end) - start, between = (end - start) - NB_W(2.0) * margin;
    const nb_real share = nb_narrow(margin / nb_wmax(between, NB_WTINY));
    for (int c = 0; c < 3; c++) {
        const nb_real more = (last->depth[c] - first->depth[c]) * share;
        first->depth[c] = nb_max(first->depth[c] - more, NB_F(0.0));
        last->depth[c] = nb_max(last->depth[c] + more, NB_F(0.0));
    }
}

static sun_place first_place(const ray_segment *p, const gathered_light *g)
{
    sun_place place = {.t = p->start};
    for (int c = 0; c < 3; c++) {
        place.depth[c] = g->depth[c];
        place.error[c] = g->depth_error[c];
    }
    return place;
}

static sun_place next_place(const sun_place *from, const sun_interval *s, nb_wide t)
{
    sun_place place = {.t = t};
    for (int c = 0; c < 3; c++) {
        place.depth[c] = from->depth[c] + s->depth[c];
        place.error[c] = from->error[c] + s->depth_error[c] + place.depth[c] * NB_EPSILON;
    }
    return place;
}

/* The depths to the sun from both places. */
static void look_at_sun(sunlight *sun, const packet_state *m, sun_place *from, sun_place *to, nb_wmask lanes)
{
    if (sun->lighting->sun_depth_method == NB_SUN_DEPTH_HEIGHT) {
        to->to_sun = depth_to_sun(sun, m, to->t, lanes); /* there are no faces: the depth at `from` is known */
        return;
    }
    from->to_sun = depth_to_sun(sun, m, beside(from->t, to->t), lanes);
    to->to_sun = depth_to_sun(sun, m, beside(to->t, from->t), lanes);
    extend_to_ends(&from->to_sun, &to->to_sun, from->t, to->t);
}

/* Adds what is scattered between two places. */
static void add_closed_step(const sunlight *sun, const packet_state *m, const sun_place *from, const sun_place *to,
                            const sun_interval *s, nb_mask lanes, gathered_light *g)
{
    nb_real least[3], change[3], most_seen[3], ratio[3], rounding = NB_F(0.0);
    for (int c = 0; c < 3; c++) {
        const nb_real first = from->depth[c] + from->to_sun.depth[c], last = to->depth[c] + to->to_sun.depth[c];
        least[c] = nb_min(first, last);
        change[c] = change_of_depth(sun, m, present(m, m->present_first), c, s->length, last - first);
    }
    map_channels(sun->snapshot, transmitted, least, most_seen);
    map_channels(sun->snapshot, nb_exp_ratio, change, ratio);
    for (int c = 0; c < 3; c++) {
        const nb_real first = from->depth[c] + from->to_sun.depth[c], last = to->depth[c] + to->to_sun.depth[c];
        const nb_real seen = most_seen[c] * ratio[c], light = s->light[c] * seen;
        const nb_real doubt = doubt_of_end(from->error[c] + from->to_sun.error[c], first - last) +
                              doubt_of_end(to->error[c] + to->to_sun.error[c], last - first) +
                              (least[c] + NB_F(32.0)) * (NB_F(2.0) * NB_EPSILON);
        g->radiance[c] = g->radiance[c] + nb_select(lanes, light, NB_F(0.0));
        rounding = nb_max(rounding, light * doubt + s->light_error[c] * seen);
    }
    rounding = rounding + largest(g->radiance) * NB_EPSILON;
    g->radiance_error = g->radiance_error + nb_select(lanes, rounding, NB_F(0.0));
}

/* Where constant densities let no light through any more: from deep in endless fog the way to the sun is longer than
 * NB_WFAR, where ways end, and the depth is not linear. */
static nb_wide end_of_light(const sunlight *sun, const packet_state *m, const ray_segment *p)
{
    if (sun->lighting->sun_depth_method != NB_SUN_DEPTH_FLAT) return p->end;
    const lit_fog fog = sunlit_fog(m, p->start);
    const nb_real thinnest = nb_min(nb_min(fog.extinction[0], fog.extinction[1]), fog.extinction[2]);
    return nb_wmin(p->end, p->start + nb_widen(OPAQUE_DEPTH * nb_rcp_bounded(thinnest)));
}

/* From boundary to boundary, and where the sun shines from turn to turn; all lanes go on at once, those in shadow, too. */
static void gather_in_closed_form(sunlight *sun, const packet_state *m, const ray_segment *p, nb_mask lit,
                                  gathered_light *g)
{
    const nb_wide last = end_of_light(sun, m, p);
    nb_wmask lanes = nb_wand(nb_widen_mask(lit), p->start < last);
    sun_place from = first_place(p, g);
    if (sun->lighting->sun_depth_method == NB_SUN_DEPTH_HEIGHT) from.to_sun = depth_to_sun(sun, m, from.t, lanes);
    while (nb_wany(lanes)) {
        pass_boundaries(&sun->shade, from.t, lanes);
        const nb_wmask dark = nb_wand(lanes, sun->shade.is_dark);
        const nb_wide bright = nb_wmin(sun->shade.boundary, last);
        const nb_wide turn = nb_wmin(next_turn(sun, from.t, bright), nearest_kink(m, from.t, bright));
        const nb_wide end = nb_wselect(lanes, nb_wselect(dark, bright, turn), from.t);
        const sun_interval between = stretch_between(m, from.t, end);
        sun_place to = next_place(&from, &between, end);
        look_at_sun(sun, m, &from, &to, lanes);
        const nb_mask shines = nb_narrow_mask(nb_wand(lanes, nb_wnot(dark)));
        if (nb_any(shines)) add_closed_step(sun, m, &from, &to, &between, shines, g);
        from = to;
        lanes = nb_wand(lanes, from.t < last);
    }
}
