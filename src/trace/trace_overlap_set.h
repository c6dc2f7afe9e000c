/* Very many media over each other: where n of them overlap, asking each one at each of the 2 n ends is n squared.
 *
 * Between two ends media of constant density are as one, whose extinction and light are their sums. So those that may
 * (nb_medium.joins) form an overlap set: their ends are sorted, and a binary tree has the sums, in which a medium that
 * begins or ends changes one leaf and the log n nodes above it. To the walk the overlap set is one contact more.
 *
 * A sum depends on which media are there and on nothing else: neither on how it came about, as it would with running
 * sums, nor on a lane's company, because every lane has its own events and a tree over the media that it meets itself.
 * For the same reason each lane decides by itself whether it has one: the walk is walked once for those that are and
 * once for the others. Included by trace_kernel.c after trace_active_set.h. */

/* A place on the ray of one lane, with all its digits. */
#if NB_WIDTH == 1
typedef nb_wide lane_place;
#else
typedef double lane_place;
#endif

struct overlap_event {
    lane_place t, reach; /* where the medium begins or ends; the least place where this end or one behind it may be */
    uint32_t contact, seat;
    int enters;
};

/* What one medium, or all below a node, gives. */
struct overlap_sum {
    nb_scalar extinction[3], light[3];
};

static nb_wide load_places(const lane_place lane[NB_WIDTH])
{
#if NB_WIDTH == 1
    return lane[0];
#else
    return nb_wload_lanes(lane);
#endif
}

static nb_mask one_lane(int lane)
{
    nb_scalar chosen[NB_WIDTH] = {0};
    chosen[lane] = 1;
    return nb_load_lanes(chosen) > NB_F(0.0);
}

static nb_mask is_met(const medium_hit *k)
{
    return nb_narrow_mask(k->hull_enter < k->hull_leave);
}

/* ---- the events of a lane -------------------------------------------------------------------- */

static int compare_events(const void *a, const void *b)
{
    const overlap_event *x = a, *y = b;
    return (x->t > y->t) - (x->t < y->t);
}

static void list_events(const packet_state *m, overlap_set *c, int lane)
{
    overlap_event *const events = &c->events[2 * c->seats * (size_t)lane];
    size_t seats = 0;
    for (uint32_t i = 0; i < m->contact_count; i++) {
        const medium_hit *k = &m->contacts[i];
        if (!k->lit->joins || !nb_lane(is_met(k), lane)) continue;
        const leaf_span *span = &m->spans[k->first_span];
        const lane_place enter = nb_lane(span->enter, lane), leave = nb_lane(span->leave, lane);
        events[2 * seats] = (overlap_event){enter, enter, i, (uint32_t)seats, 1};
        events[2 * seats + 1] =
            (overlap_event){leave, leave - (lane_place)nb_lane(span->leave_slack, lane), i, (uint32_t)seats, 0};
        seats++;
    }
    c->count[lane] = 2 * seats;
    qsort(events, c->count[lane], sizeof *events, compare_events);
    for (size_t i = c->count[lane]; i-- > 1;)
        if (events[i].reach < events[i - 1].reach) events[i - 1].reach = events[i].reach;
}

/* ---- the overlap set ------------------------------------------------------------------------ */

/* Light per extinction, exactly where all in the overlap set have the same. */
static void find_common_radiance(const packet_state *m, overlap_set *c)
{
    nb_mask seen = nb_mask_false;
    c->is_even = nb_mask_true;
    for (size_t i = 0; i < m->contact_count; i++) {
        const medium_hit *k = &m->contacts[i];
        if (!k->lit->joins) continue;
        const nb_mask met = is_met(k);
        for (int channel = 0; channel < 3; channel++) {
            nb_real *common = &c->radiance[channel];
            const nb_mask differs = nb_and(nb_and(met, seen), nb_not(k->radiance[channel] == *common));
            c->is_even = nb_and(c->is_even, nb_not(differs));
            *common = nb_select(nb_and(met, nb_not(seen)), k->radiance[channel], *common);
        }
        seen = nb_or(seen, met);
    }
}

/* How many of the overlap set each lane meets; the most of all lanes. */
static size_t count_overlap_set(const packet_state *m, nb_scalar lane[NB_WIDTH])
{
    nb_real met = NB_F(0.0);
    for (size_t i = 0; i < m->contact_count; i++)
        if (m->contacts[i].lit->joins) met = met + nb_select(is_met(&m->contacts[i]), NB_F(1.0), NB_F(0.0));
    nb_store_lanes(lane, met);
    size_t most = 0;
    for (int i = 0; i < NB_WIDTH; i++) most = (size_t)lane[i] > most ? (size_t)lane[i] : most;
    return most;
}

/* Of the tree over so many. */
static int height_of(size_t count)
{
    int height = 0;
    while ((size_t)1 << height < count) height++;
    return height;
}

/* Room for an overlap set of `most` in each lane, whose sums are 0. 0 when memory is out. */
static int reserve_overlap_set(overlap_set *c, const nebel_allocator *allocator, size_t most)
{
    c->seats = (size_t)1 << height_of(most);
    const size_t places = 2 * c->seats * NB_WIDTH;
    if (c->seats > c->capacity) {
        nb_release(allocator, c->memory);
        c->capacity = 0;
        c->memory = nb_allocate(allocator, places, sizeof *c->events + sizeof *c->sums);
        if (c->memory == NULL) return 0;
        c->capacity = c->seats;
    }
    c->events = c->memory;
    c->sums = (overlap_sum *)(void *)(c->events + places);
    memset(c->sums, 0, places * sizeof *c->sums);
    return 1;
}

/* The contact that stands for the overlap set, behind all others. */
static medium_hit *overlap_set_contact(packet_state *m)
{
    return &m->contacts[m->contact_count];
}

/* Lists the overlap sets of all lanes that have one. 0 when memory is out. */
static int open_overlap_set(packet_state *m, const nebel_lighting *lighting)
{
    const nebel_allocator *allocator = &lighting->snapshot->allocator;
    overlap_set *c = &m->overlap_set;
    c->lanes = nb_mask_false;
    c->is_walking = 0;
    if (lighting->joining_count < NB_MIN_OVERLAP_SET || m->contact_count < NB_MIN_OVERLAP_SET) return 1;
    nb_scalar met[NB_WIDTH];
    const size_t most = count_overlap_set(m, met);
    if (most < NB_MIN_OVERLAP_SET) return 1;
    if (!reserve_overlap_set(c, allocator, most)) return 0;
    c->lanes = nb_load_lanes(met) >= nb_splat(NB_MIN_OVERLAP_SET);
    c->rank = lighting->joining->body.rank;
    for (int i = 0; i < NB_WIDTH; i++) {
        c->next[i] = c->present[i] = c->count[i] = 0;
        if (nb_lane(c->lanes, i)) list_events(m, c, i);
        met[i] = (nb_scalar)(1 + height_of((size_t)met[i]));
    }
    find_common_radiance(m, c);
    *overlap_set_contact(m) = (medium_hit){.medium = lighting->joining,
                                           .lit = &lighting->media[lighting->joining - lighting->snapshot->media],
                                           .noise = nb_load_lanes(met) * NB_EPSILON};
    return 1;
}

/* Whether the walk finds the medium in the overlap set instead of in its window. */
static int is_in_overlap_set(const packet_state *m, size_t index)
{
    return m->overlap_set.is_walking && m->contacts[index].lit->joins;
}

/* ---- the walk -------------------------------------------------------------------------------- */

static void add_sums(overlap_sum *to, const overlap_sum *a, const overlap_sum *b)
{
    for (int c = 0; c < 3; c++) {
        to->extinction[c] = a->extinction[c] + b->extinction[c];
        to->light[c] = a->light[c] + b->light[c];
    }
}

/* A medium begins or ends. */
static void pass_event(const packet_state *m, overlap_sum *sums, size_t seats, const overlap_event *event)
{
    const medium_hit *k = &m->contacts[event->contact];
    size_t node = seats + event->seat;
    sums[node] = (overlap_sum){{0, 0, 0}, {0, 0, 0}};
    for (int c = 0; c < 3 && event->enters; c++) {
        sums[node].extinction[c] = nb_lane(k->extinction[c], 0);
        sums[node].light[c] = nb_lane(k->light[c], 0);
    }
    for (node /= 2; node > 0; node /= 2) add_sums(&sums[node], &sums[2 * node], &sums[2 * node + 1]);
}

/* Passes all events up to t. */
static void advance_overlap_set(packet_state *m, nb_wide t)
{
    overlap_set *c = &m->overlap_set;
    for (int i = 0; i < NB_WIDTH; i++) {
        const overlap_event *events = &c->events[2 * c->seats * (size_t)i];
        const lane_place here = nb_lane(t, i);
        for (; c->next[i] < c->count[i] && events[c->next[i]].t <= here; c->next[i]++) {
            const overlap_event *event = &events[c->next[i]];
            pass_event(m, &c->sums[2 * c->seats * (size_t)i], c->seats, event);
            event->enters ? c->present[i]++ : c->present[i]--;
        }
    }
}

/* The next event of the overlap set; NB_WFAR * 2 where there is none. */
static nb_wide next_in_overlap_set(const overlap_set *c)
{
    lane_place lane[NB_WIDTH];
    for (int i = 0; i < NB_WIDTH; i++) {
        const overlap_event *events = &c->events[2 * c->seats * (size_t)i];
        lane[i] = c->next[i] < c->count[i] ? events[c->next[i]].t : (lane_place)2e18;
    }
    return load_places(lane);
}

/* Gives the overlap set's contact the sums of what is there now, in `lanes`. Returns whether anything is. */
static int mark_overlap_set(packet_state *m, nb_mask lanes)
{
    const overlap_set *c = &m->overlap_set;
    nb_scalar lane[7][NB_WIDTH];
    for (int i = 0; i < NB_WIDTH; i++) {
        const overlap_sum *sum = &c->sums[2 * c->seats * (size_t)i + 1];
        lane[6][i] = c->present[i] > 0;
        for (int channel = 0; channel < 3; channel++) {
            lane[channel][i] = sum->extinction[channel];
            lane[3 + channel][i] = sum->light[channel];
        }
    }
    medium_hit *k = overlap_set_contact(m);
    k->inside = nb_and(lanes, nb_load_lanes(lane[6]) > NB_F(0.0));
    if (!nb_any(k->inside)) return 0;
    for (int channel = 0; channel < 3; channel++) {
        k->extinction[channel] = nb_load_lanes(lane[channel]);
        k->light[channel] = nb_load_lanes(lane[3 + channel]);
        const nb_real quotient = k->light[channel] / nb_max(k->extinction[channel], NB_TINY);
        k->radiance[channel] = nb_select(c->is_even, c->radiance[channel], quotient);
    }
    return 1;
}
