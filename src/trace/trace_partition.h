/* The partition of the rays: from event to event, which media are there, and what they do to the light. */

/* Light gathered so far, and what may be wrong with it. */
typedef struct gathered_light {
    nb_real depth[3];         /* optical depth from the camera */
    nb_real transmittance[3]; /* exp(-depth) */
    nb_real radiance[3];
    nb_real depth_error[3];
    nb_real ends_depth[3];  /* that of ends which were weighed against what lies behind them */
    nb_real least_depth[3]; /* what the optical depth is at least, in spite of ends farther on, */
    nb_real clear_depth[3]; /* and up to where no end is in large doubt */
    nb_real radiance_error; /* rounding, ends and the bound of adaptive integration; the worst channel of each piece */
} gathered_light;

/* A piece between two neighbouring events. */
typedef struct ray_segment {
    nb_wide start, end;
    nb_real length;
    nb_mask lanes; /* that have this piece */
} ray_segment;

/* What the media of a piece add up to. */
typedef struct piece_sum {
    nb_real depth[3], light[3]; /* optical depth; radiance it would add if nothing attenuated it */
    nb_real depth_error[3], light_error[3];
    nb_real relative_error; /* of the worst integral, 1 at most */
    nb_mask present;        /* some medium is there */
    nb_mask mixed;          /* the quotient of light and extinction changes along the piece: no closed form */
    nb_mask even;           /* all media there give the same light per extinction */
} piece_sum;

/* The next event after t, NB_WFAR * 2 where there is none: the sentinel must lie beyond an endless ray's end. */
static nb_wide next_event(const packet_state *m, nb_wide t)
{
    nb_wide next = NB_W(2.0) * NB_WFAR;
    for (size_t i = 0; i < m->window_count; i++) {
        const medium_hit *k = in_window(m, i);
        for (size_t j = 0; j < k->medium->body.leaf_count; j++) {
            const leaf_span *span = &m->spans[k->first_span + j];
            const nb_wmask some = span->enter < span->leave;
            next = nb_wselect(nb_wand(some, nb_wand(span->enter > t, span->enter < next)), span->enter, next);
            next = nb_wselect(nb_wand(some, nb_wand(span->leave > t, span->leave < next)), span->leave, next);
        }
    }
    return m->overlap_set.is_walking ? nb_wmin(next, next_in_overlap_set(&m->overlap_set)) : next;
}

/* ANY or ALL of a body's program: the two topmost masks become one. Returns the new height. */
static int fold_step(nb_shape_op step, nb_mask *stack, int top)
{
    const nb_mask a = stack[top - 2], b = stack[top - 1];
    stack[top - 2] = step == NB_OP_UNION ? nb_or(a, b) : nb_and(a, b);
    return top - 1;
}

/* The next piece of each lane that is in `lanes`; those whose next event lies beyond the window wait for it to move.
 * Returns 0 when no lane has a piece left. */
static int next_piece(packet_state *m, nb_wide t, nb_wmask lanes, ray_segment *p)
{
    if (m->overlap_set.is_walking) advance_overlap_set(m, t);
    for (;;) {
        const nb_wide next = next_event(m, t);
        const nb_wmask within = nb_wand(lanes, nb_wand(next <= NB_WFAR, next <= WIDE(m->window_end)));
        if (nb_wany(within)) {
            *p = (ray_segment){t, next, nb_narrow(next - t), nb_narrow_mask(within)};
            return 1;
        }
        if (m->entered == m->stretch_count || !nb_wany(lanes)) return 0;
        move_window(m, earliest(t, lanes));
    }
}

/* Membership of a leaf needs no midpoint: between neighbouring events a span is either all there or not at all. */
static nb_mask is_inside(const packet_state *m, const medium_hit *k, nb_wide start)
{
    const nb_volume *body = &k->medium->body;
    nb_mask stack[NB_STEP_STACK];
    int top = 0;
    size_t leaf = k->first_span;
    for (size_t i = 0; i < body->step_count; i++) {
        if (body->steps[i] == NB_OP_LEAF) {
            const leaf_span *span = &m->spans[leaf++];
            stack[top++] = nb_narrow_mask(nb_wand(span->enter <= start, span->leave > start));
            continue;
        }
        top = fold_step(body->steps[i], stack, top);
    }
    return stack[0];
}

/* Marks which media's fog is there. Returns whether any is. From the highest rank down: what covers takes away what
 * ranks below it. */
static int mark_inside(packet_state *m, const ray_segment *p)
{
    nb_mask covered = nb_not(p->lanes), covered_below = covered, overlap_set_covered = covered;
    int64_t rank = INT64_MAX;
    size_t first = m->window_count;
    for (size_t i = m->window_count; i-- > 0;) {
        medium_hit *k = in_window(m, i);
        const nb_volume *body = &k->medium->body;
        if (body->rank < rank) covered = covered_below;
        rank = body->rank;
        k->inside = is_inside(m, k, p->start);
        if (nb_volume_covers(body)) covered_below = nb_or(covered_below, k->inside);
        if (rank > m->overlap_set.rank) overlap_set_covered = covered_below;
        if (!nb_volume_has_fog(body)) continue;
        k->inside = nb_and(k->inside, nb_not(covered));
        if (nb_any(k->inside)) m->present[--first] = m->window[i];
    }
    m->present_first = first;
    m->present_end = m->window_count;
    if (m->overlap_set.is_walking && mark_overlap_set(m, nb_not(overlap_set_covered)))
        m->present[m->present_end++] = (uint32_t)m->contact_count;
    return first < m->present_end;
}

/* A number for each leaf, which hardly any other sum of them has. */
static double number_of_leaf(const nb_medium *medium, size_t leaf)
{
    const uint32_t hash = (uint32_t)(medium->slot * 131 + leaf + 1) * 2654435761u;
    return 1 + (hash >> 8) * 0x1p-24;
}

/* The signature of a way says in which leaves it is from piece to piece. Where it changes from place to place along a ray, the
 * optical depth of the ways may have a kink or begin to rise like a root: as they pass where surfaces of two leaves cross. */
static void sign_piece(packet_state *m, nb_wide start, nb_mask lanes)
{
    nb_real sum = NB_F(0.0);
    for (size_t i = 0; i < m->window_count; i++) {
        const medium_hit *k = in_window(m, i);
        for (size_t j = 0; j < k->medium->body.leaf_count; j++) {
            const leaf_span *span = &m->spans[k->first_span + j];
            const nb_mask inside = nb_narrow_mask(nb_wand(span->enter <= start, span->leave > start));
            sum = sum + nb_select(inside, REAL(number_of_leaf(k->medium, j)), NB_F(0.0));
        }
    }
    m->signature = nb_select(lanes, m->signature * NB_F(0.75) + sum, m->signature);
}

static nb_real largest(const nb_real v[3])
{
    return nb_max(nb_max(v[0], v[1]), v[2]);
}

/* Adds one medium's optical depth and light to the sum, where its density has this integral. */
static void add_estimate(piece_sum *sum, const medium_hit *k, const nb_estimate *along)
{
    const nb_real length = nb_select(k->inside, along->value, NB_F(0.0));
    const nb_real error = nb_select(k->inside, along->error, NB_F(0.0));
    for (int c = 0; c < 3; c++) {
        sum->depth[c] = sum->depth[c] + k->extinction[c] * length;
        sum->light[c] = sum->light[c] + k->light[c] * length;
        sum->depth_error[c] = sum->depth_error[c] + k->extinction[c] * error;
        sum->light_error[c] = sum->light_error[c] + k->light[c] * error;
    }
    sum->relative_error = nb_max(sum->relative_error, nb_min(error / nb_max(length, NB_TINY), NB_F(1.0)));
}

/* From `start` to `end`, h metres. */
static void add_contact(piece_sum *sum, const medium_hit *k, nb_wide start, nb_wide end, nb_real h)
{
    const nb_estimate along = contact_integral(k, start, end, h);
    add_estimate(sum, k, &along);
}

static piece_sum no_sum(void)
{
    const nb_real zero = NB_F(0.0);
    return (piece_sum){{zero, zero, zero}, {zero, zero, zero}, {zero, zero, zero}, {zero, zero, zero}, zero,
                       nb_mask_false,      nb_mask_false,      nb_mask_false};
}

/* A piece is mixed where some density varies and not all media give the same light per extinction. */
static piece_sum sum_piece(const packet_state *m, const ray_segment *p)
{
    piece_sum sum = no_sum();
    nb_mask seen = nb_mask_false, uneven = nb_mask_false, emits = nb_mask_false, varies = nb_mask_false;
    nb_real first[3] = {NB_F(0.0), NB_F(0.0), NB_F(0.0)};
    for (size_t i = m->present_first; i < m->present_end; i++) {
        const medium_hit *k = present(m, i);
        if (m->whole != NULL)
            add_estimate(&sum, k, m->whole);
        else
            add_contact(&sum, k, p->start, p->end, p->length);
        const nb_mask again = nb_and(k->inside, seen);
        nb_mask differs = k->medium->emits ? nb_mask_true : emits;
        for (int c = 0; c < 3; c++) {
            differs = nb_or(differs, nb_not(k->radiance[c] == first[c]));
            first[c] = nb_select(nb_and(k->inside, nb_not(seen)), k->radiance[c], first[c]);
        }
        uneven = nb_or(uneven, nb_and(again, differs));
        emits = k->medium->emits ? nb_or(emits, k->inside) : emits;
        seen = nb_or(seen, k->inside);
        if (k->medium->body.density.type != NEBEL_DENSITY_CONSTANT) varies = nb_or(varies, k->inside);
    }
    sum.present = seen;
    sum.mixed = nb_and(uneven, varies);
    sum.even = nb_not(uneven);
    return sum;
}

/* By what factor the light of a piece may be off through the optical depth before it and in it; where all is opaque
 * only the relative error of the latter counts. */
static nb_real attenuation_error(const gathered_light *g, const piece_sum *sum, int c)
{
    return nb_min(g->depth_error[c] + nb_min(sum->depth_error[c], sum->relative_error), NB_F(1.0)) +
           NB_F(32.0) * NB_EPSILON;
}

/* Where light is radiance times extinction a piece adds radiance (1 - e^-depth), which does not change where all is
 * opaque; e^-y <= 1 / (1 + y + y^2 / 2). */
static nb_real even_error(const gathered_light *g, const piece_sum *sum, int c)
{
    const nb_real radiance = sum->light[c] / nb_max(sum->depth[c], NB_TINY);
    const nb_real least = nb_max(sum->depth[c] - sum->depth_error[c], NB_F(0.0));
    const nb_real attenuation = NB_F(1.0) + least * (NB_F(1.0) + NB_F(0.5) * least);
    return g->transmittance[c] * radiance * nb_min(sum->depth_error[c], NB_F(1.0)) / attenuation;
}

/* The closed form: light (1 - e^-depth) / depth, seen through what lies before. */
static void gather_closed(gathered_light *g, const piece_sum *sum, nb_mask lanes)
{
    const nb_mask loose = nb_and(nb_and(lanes, sum->even), sum->relative_error > NB_F(1024.0) * NB_EPSILON);
    nb_real most = NB_F(0.0);
    for (int c = 0; c < 3; c++) {
        const nb_real ratio = nb_select(lanes, g->transmittance[c] * nb_exp_ratio(sum->depth[c]), NB_F(0.0));
        const nb_real light = ratio * sum->light[c];
        g->radiance[c] = g->radiance[c] + light;
        nb_real error = ratio * sum->light_error[c] + light * attenuation_error(g, sum, c);
        if (nb_any(loose)) {
            const nb_real before = nb_min(g->depth_error[c], NB_F(1.0)) + NB_F(32.0) * NB_EPSILON;
            const nb_real even = even_error(g, sum, c) + light * before;
            error = nb_select(nb_and(loose, sum->depth[c] > NB_TINY), nb_min(error, even), error);
        }
        most = nb_max(most, error);
    }
    g->radiance_error = g->radiance_error + most;
}

/* The density of fog that grows without bound ends to grow at 1e18: see nb_height_density. Where a piece of fog so
 * dense lets light through, nothing is known of the light: it may be beyond all numbers. */
static void note_overflow(const packet_state *m, const ray_segment *p, gathered_light *g)
{
    for (size_t i = m->present_first; i < m->present_end; i++) {
        const medium_hit *k = present(m, i);
        if (!grows_without_bound(&k->medium->body.density)) continue;
        const nb_real lowest = lowest_coordinate(k, p->start, p->end);
        const nb_mask overflows = nb_and(nb_and(p->lanes, k->inside), lowest < NB_F(-41.0));
        if (!nb_any(overflows)) continue;
        const nb_real length = contact_integral(k, p->start, p->end, p->length).value;
        for (int c = 0; c < 3; c++) {
            const nb_mask clear = nb_and(overflows, g->depth[c] + k->extinction[c] * length < OPAQUE_DEPTH);
            const nb_mask absorbs = nb_and(clear, k->extinction[c] > NB_F(0.0));
            const nb_mask shines = nb_and(clear, k->light[c] > NB_F(0.0));
            g->depth_error[c] = nb_select(absorbs, NB_HUGE, g->depth_error[c]);
            g->radiance_error = nb_select(shines, NB_HUGE, g->radiance_error);
        }
    }
}

/* Moves behind the piece. */
static void pass_piece(gathered_light *g, const piece_sum *sum)
{
    for (int c = 0; c < 3; c++) {
        g->depth[c] = g->depth[c] + sum->depth[c];
        g->transmittance[c] = nb_exp(-g->depth[c]);
        const nb_real rounding = sum->depth_error[c] + g->depth[c] * (NB_F(2.0) * NB_EPSILON);
        g->depth_error[c] = g->depth_error[c] + nb_select(sum->present, rounding, NB_F(0.0));
    }
}

/* Lanes in which the ends may matter: there they are counted where they are, seen through the fog before them;
 * elsewhere their plain sum is small enough to report. */
static nb_mask ends_matter(const packet_state *m)
{
    return largest(m->all_ends.depth) + largest(m->all_ends.light) > NB_F(16.0) * NB_EPSILON;
}

/* Within slack of t, whatever ends with slack of their own do: where the body may be somewhere, and where it is
 * everywhere. */
typedef struct active_mask {
    nb_mask may, must;
} active_mask;

/* The leaf `which` may be or not; NO_LEAF: none. */
#define NO_LEAF SIZE_MAX

static active_mask body_near(const packet_state *m, const medium_hit *k, size_t which, nb_wide t, nb_wide slack)
{
    const nb_volume *body = &k->medium->body;
    const nb_wide from = nb_wmax(t - slack, NB_W(0.0)), to = nb_wmin(t + slack, m->rays.t_max);
    nb_mask most[NB_STEP_STACK], least[NB_STEP_STACK];
    int top = 0;
    size_t leaf = 0;
    for (size_t i = 0; i < body->step_count; i++) {
        if (body->steps[i] != NB_OP_LEAF) {
            fold_step(body->steps[i], most, top);
            top = fold_step(body->steps[i], least, top);
            continue;
        }
        const leaf_span *span = &m->spans[k->first_span + leaf];
        const nb_wide enter = place_on_ray(m, span->enter), leave = place_on_ray(m, span->leave);
        const nb_wide enter_slack = nb_widen(span->enter_slack), leave_slack = nb_widen(span->leave_slack);
        const nb_wmask may = nb_wand(enter - enter_slack <= to, leave + leave_slack >= from);
        const nb_wmask must = nb_wand(enter + enter_slack <= from, leave - leave_slack >= to);
        most[top] = leaf == which ? nb_mask_true : nb_narrow_mask(may);
        least[top] = leaf == which ? nb_mask_false : nb_narrow_mask(must);
        top++;
        leaf++;
    }
    return (active_mask){most[0], least[0]};
}

/* Whether an end of a leaf within slack of t may be an end of the body: not where other leaves hold the body together
 * there, or leave it out. */
static nb_mask may_end_body(const packet_state *m, const medium_hit *k, size_t which, nb_wide t, nb_wide slack)
{
    const active_mask near = body_near(m, k, which, t, slack);
    return nb_and(near.may, nb_not(near.must));
}

/* Whether something that ranks higher takes a medium's fog away all about t, so that its ends there do nothing. */
static nb_mask is_covered_near(const packet_state *m, const medium_hit *k, nb_wide t, nb_wide slack)
{
    nb_mask covered = nb_mask_false;
    for (size_t i = m->window_count; i-- > 0;) {
        const medium_hit *other = in_window(m, i);
        if (other->medium->body.rank <= k->medium->body.rank) break;
        if (nb_volume_covers(&other->medium->body))
            covered = nb_or(covered, body_near(m, other, NO_LEAF, t, slack).must);
    }
    return covered;
}

/* Ends at t, and what those that may already lie before t may take from the fog there: where fog begins it can only be
 * more. */
typedef struct segment_pass {
    nb_wide t;
    nb_mask lanes;
    interval_ends here, less;
    nb_real weighed[3];
} segment_pass;

/* Moving an end brings light and takes as much from the light behind, which is all the same where fog begins that is
 * opaque further on. Where the radiance is known but for its error, so is what lies behind: ends are moved one by one,
 * the farthest first, and each changes the radiance by no more than |light T - depth (S - S before)|, depth times the
 * error, and what others do to that within the slack. */
static void weigh_end(const packet_state *m, const gathered_light *g, segment_pass *p, const medium_hit *k, nb_wide end,
                      nb_real slack)
{
    const nb_wide wide_slack = nb_widen(slack);
    const int adds = !nb_volume_covers(&k->medium->body);
    interval_ends others = no_ends();
    nb_real moved[3] = {NB_F(0.0), NB_F(0.0), NB_F(0.0)}, depth[3] = {NB_F(0.0), NB_F(0.0), NB_F(0.0)};
    for (size_t i = 0; i < m->contact_count; i++) {
        const medium_hit *fog = &m->contacts[i];
        if (!nb_volume_has_fog(&fog->medium->body)) continue;
        const nb_wmask near = nb_wand(end + wide_slack >= fog->hull_enter, end - wide_slack <= fog->hull_leave);
        const nb_real weight = nb_select(nb_narrow_mask(near), slack * end_density(fog, end, slack), NB_F(0.0));
        const int moves = adds ? fog == k : 1;
        for (int c = 0; c < 3; c++) {
            const nb_real light = weight * fog->light[c], dark = weight * fog->extinction[c];
            others.light[c] = others.light[c] + (adds && moves ? NB_F(0.0) : light + light);
            others.depth[c] = others.depth[c] + (adds && moves ? NB_F(0.0) : dark + dark);
            if (!moves) continue;
            const nb_real seen = light * g->transmittance[c], behind = dark * (m->total->radiance[c] - g->radiance[c]);
            moved[c] = moved[c] + nb_abs(seen - behind) + seen * g->depth_error[c];
            depth[c] = depth[c] + dark;
        }
    }
    for (int c = 0; c < 3; c++) {
        const nb_real behind = nb_abs(m->total->radiance[c] - g->radiance[c]) + m->total->error;
        const nb_real beside = others.light[c] * g->transmittance[c] + others.depth[c] * behind;
        const nb_real change = moved[c] + depth[c] * (m->total->error + NB_F(2.0) * beside);
        const nb_mask small = depth[c] + others.depth[c] < NB_F(0.125);
        p->weighed[c] = p->weighed[c] + nb_select(small, change, NB_HUGE);
    }
}

static void pass_end(const packet_state *m, const gathered_light *g, segment_pass *p, const medium_hit *k, size_t leaf,
                     nb_wide end, nb_real slack, int fog_ends)
{
    if (!nb_any(slack > NB_F(0.0))) return;
    const nb_wide wide_slack = nb_widen(slack);
    const nb_mask counts = nb_and(p->lanes, nb_not(is_covered_near(m, k, end, wide_slack)));
    const nb_mask here = nb_and(counts, nb_narrow_mask(end == p->t));
    const nb_mask may_be_before = nb_and(counts, nb_narrow_mask(nb_wand(end >= p->t, end - wide_slack <= p->t)));
    if (nb_any(here)) {
        const int whole = k->medium->body.leaf_count == 1;
        const nb_mask ends_body = whole ? here : nb_and(here, may_end_body(m, k, leaf, end, wide_slack));
        const nb_real doubt = nb_select(ends_body, slack, NB_F(0.0));
        add_end(m, &p->here, k, end, doubt);
        if (m->total != NULL && nb_any(doubt > NB_F(0.0))) weigh_end(m, g, p, k, end, doubt);
    }
    if (fog_ends && nb_any(may_be_before)) add_end(m, &p->less, k, end, nb_select(may_be_before, slack, NB_F(0.0)));
}

static void pass_ends_of(const packet_state *m, const gathered_light *g, segment_pass *p, const medium_hit *k,
                         nb_mask lanes)
{
    const int covers = nb_volume_covers(&k->medium->body), has_fog = nb_volume_has_fog(&k->medium->body);
    for (size_t j = 0; j < k->medium->body.leaf_count; j++) {
        const leaf_span *span = &m->spans[k->first_span + j];
        p->lanes = nb_and(lanes, nb_narrow_mask(span->enter < span->leave));
        pass_end(m, g, p, k, j, span->enter, span->enter_slack, covers);
        pass_end(m, g, p, k, j, span->leave, span->leave_slack, has_fog);
    }
}

/* Ends of the overlap set that may be at t, of those not passed yet. */
static void pass_ends_of_overlap_set(const packet_state *m, const gathered_light *g, segment_pass *p, nb_mask lanes)
{
    const overlap_set *c = &m->overlap_set;
    for (int i = 0; i < NB_WIDTH; i++) {
        if (!nb_lane(lanes, i)) continue;
        const overlap_event *events = &c->events[2 * c->seats * (size_t)i];
        const lane_place here = nb_lane(p->t, i);
        p->lanes = one_lane(i);
        for (size_t j = c->next[i]; j < c->count[i] && events[j].reach <= here; j++) {
            const medium_hit *k = &m->contacts[events[j].contact];
            const leaf_span *span = &m->spans[k->first_span];
            if (events[j].enters)
                pass_end(m, g, p, k, 0, span->enter, span->enter_slack, 0);
            else
                pass_end(m, g, p, k, 0, span->leave, span->leave_slack, 1);
        }
    }
}

/* Window and overlap set hold all media where ends are watched. */
static void pass_ends(const packet_state *m, gathered_light *g, nb_wide t, nb_mask lanes)
{
    segment_pass p = {t, lanes, no_ends(), no_ends(), {NB_F(0.0), NB_F(0.0), NB_F(0.0)}};
    for (size_t i = 0; i < m->window_count; i++) {
        const medium_hit *k = in_window(m, i);
        pass_ends_of(m, g, &p, k, lanes);
    }
    if (m->overlap_set.is_walking) pass_ends_of_overlap_set(m, g, &p, lanes);
    nb_real most = NB_F(0.0);
    for (int c = 0; c < 3; c++) {
        const nb_real doubt = g->depth_error[c] + g->ends_depth[c] + p.less.depth[c] + m->revealed[c];
        const nb_real least = g->depth[c] - doubt;
        nb_real *depth = m->total == NULL ? &g->depth_error[c] : &g->ends_depth[c];
        g->least_depth[c] = nb_select(lanes, nb_max(g->least_depth[c], least), g->least_depth[c]);
        *depth = *depth + p.here.depth[c];
        most = nb_max(most, m->total == NULL ? p.here.light[c] * g->transmittance[c] : p.weighed[c]);
    }
    g->radiance_error = g->radiance_error + most;
}

/* Endless light: the piece has no end, something in it shines, and nothing in it absorbs. */
static nb_mask is_unbounded(const packet_state *m, const ray_segment *p, const piece_sum *sum)
{
    nb_mask endless = nb_mask_false;
    const nb_mask open = nb_and(p->lanes, p->length >= NB_F(0.5) * NB_FAR);
    for (size_t i = m->present_first; i < m->present_end && nb_any(open); i++) {
        const medium_hit *k = present(m, i);
        if (!k->medium->emits) continue;
        const nb_mask here = nb_and(
            open, nb_and(k->inside, contact_integral(k, p->start, p->end, p->length).value >= NB_F(0.5) * NB_FAR));
        for (int c = 0; c < 3; c++)
            if (k->medium->body.emission[c] > 0) endless = nb_or(endless, nb_and(here, sum->depth[c] < NB_F(1.0)));
    }
    return endless;
}
