/* Which media the walk along the rays looks at: where very many lie on them, only those about the place where it is,
 * and the overlap set (trace_overlap_set.h) as a whole. Included by trace_kernel.c after that.
 *
 * Media are sorted by where the packet first enters one. All lanes walk up to the first entry that the window does not
 * hold, then the window moves on: it lets go of what they have left behind and takes in what comes next. A lane's
 * events and sums are those it would have without windows, because what a window leaves out adds nothing there. */

/* Below this many media it is quicker to look at all. */
#define FEW_CONTACTS 16

/* How many the window takes in at a time. */
#define WINDOW_STEP 8

/* Where any lane is within a medium: not inside (first, last) of the whole packet. */
typedef struct active_interval {
    double first, last;
    uint32_t contact;
} active_interval;

static medium_hit *in_window(const packet_state *m, size_t i)
{
    return &m->contacts[m->window[i]];
}

static medium_hit *present(const packet_state *m, size_t i)
{
    return &m->contacts[m->present[i]];
}

static active_interval stretch_of(const packet_state *m, uint32_t index)
{
    const medium_hit *k = &m->contacts[index];
    double enter[NB_WIDTH], leave[NB_WIDTH];
    nb_wstore_lanes(enter, k->hull_enter);
    nb_wstore_lanes(leave, k->hull_leave);
    active_interval r = {enter[0], leave[0], index};
    for (int i = 1; i < NB_WIDTH; i++) {
        r.first = enter[i] < r.first ? enter[i] : r.first;
        r.last = leave[i] > r.last ? leave[i] : r.last;
    }
    r.first *= 1 - 0x1p-52; /* storing may have rounded */
    r.last *= 1 + 0x1p-52;
    return r;
}

static int compare_stretches(const void *a, const void *b)
{
    const active_interval *x = a, *y = b;
    if (x->first != y->first) return x->first < y->first ? -1 : 1;
    return (x->contact > y->contact) - (x->contact < y->contact);
}

/* All media at once: where there are few of them, or where ends of one may lie beyond its reach. */
static void look_at_all(packet_state *m)
{
    m->window_count = 0;
    for (uint32_t i = 0; i < m->contact_count; i++)
        if (!is_in_overlap_set(m, i)) m->window[m->window_count++] = i;
    m->stretch_count = m->entered = m->window_count;
    m->window_end = HUGE_VAL;
}

/* Takes the next media in, and lets go of those that end before `behind`. */
static void move_window(packet_state *m, double behind)
{
    size_t kept = 0;
    for (size_t i = 0; i < m->window_count; i++)
        if (m->lasts[m->window[i]] > behind) m->window[kept++] = m->window[i];
    const size_t stop = m->entered + WINDOW_STEP < m->stretch_count ? m->entered + WINDOW_STEP : m->stretch_count;
    for (; m->entered < stop; m->entered++) { /* ascending by index: the canonical order */
        const uint32_t index = m->stretches[m->entered].contact;
        size_t place = kept++;
        for (; place > 0 && m->window[place - 1] > index; place--) m->window[place] = m->window[place - 1];
        m->window[place] = index;
    }
    m->window_count = kept;
    m->window_end = m->entered < m->stretch_count ? m->stretches[m->entered].first : HUGE_VAL;
}

static void open_window(packet_state *m, int at_all)
{
    if (at_all || m->contact_count <= FEW_CONTACTS) {
        look_at_all(m);
        return;
    }
    m->stretch_count = 0;
    for (uint32_t i = 0; i < m->contact_count; i++) {
        if (is_in_overlap_set(m, i)) continue;
        const active_interval s = stretch_of(m, i);
        m->stretches[m->stretch_count++] = s;
        m->lasts[i] = s.last;
    }
    qsort(m->stretches, m->stretch_count, sizeof *m->stretches, compare_stretches);
    m->window_count = 0;
    m->entered = 0;
    move_window(m, 0);
}

/* The earliest place of the lanes. */
static double earliest(nb_wide t, nb_wmask lanes)
{
    double place[NB_WIDTH];
    nb_wstore_lanes(place, nb_wselect(lanes, t, NB_WFAR));
    double first = place[0];
    for (int i = 1; i < NB_WIDTH; i++) first = place[i] < first ? place[i] : first;
    return first * (1 - 0x1p-52);
}
