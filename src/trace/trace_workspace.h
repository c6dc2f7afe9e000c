/* Memory for the media on a packet of rays. Most rays meet few: their contacts live on the stack. Beyond that the job
 * takes memory once and keeps it. Included by trace_kernel.c after trace_overlap_set.h. */
#define STACK_CONTACTS 24
#define ALIGNMENT 64

typedef struct workspace {
    medium_hit contacts[STACK_CONTACTS];
    leaf_span spans[2 * STACK_CONTACTS];
    uint32_t window[STACK_CONTACTS], present[STACK_CONTACTS];
    active_interval stretches[STACK_CONTACTS];
    double lasts[STACK_CONTACTS];
    size_t contact_capacity, span_capacity;
    void *contact_memory, *window_memory, *span_memory; /* as allocated; NULL while the stack suffices */
    uint32_t *found;                                    /* media that the packet may meet, by index */
    size_t found_count, found_capacity;
    packet_state m;
} workspace;

/* Moves `used` of an array of `size` bytes per element to a larger aligned one. NULL when memory is out. */
static void *grow_aligned(const nebel_allocator *allocator, const void *old, size_t used, size_t size, size_t *capacity,
                          size_t wanted, void **memory)
{
    size_t larger = *capacity;
    while (larger < wanted) larger *= 2;
    char *raw = nb_allocate(allocator, larger + 1, size > ALIGNMENT ? size : ALIGNMENT);
    if (raw == NULL) return NULL;
    char *aligned = raw + (ALIGNMENT - (uintptr_t)raw % ALIGNMENT) % ALIGNMENT;
    memcpy(aligned, old, used * size);
    nb_release(allocator, *memory);
    *memory = raw;
    *capacity = larger;
    return aligned;
}

/* Room for a window of `capacity` contacts, which are not known yet. 0 when memory is out. */
static int reserve_window(workspace *w, const nebel_allocator *allocator, size_t capacity)
{
    packet_state *m = &w->m;
    nb_release(allocator, w->window_memory);
    w->window_memory =
        nb_allocate(allocator, capacity, sizeof *m->stretches + sizeof *m->lasts + 2 * sizeof *m->window);
    if (w->window_memory == NULL) return 0;
    m->stretches = w->window_memory;
    m->lasts = (double *)(void *)(m->stretches + capacity);
    m->window = (uint32_t *)(void *)(m->lasts + capacity);
    m->present = m->window + capacity;
    return 1;
}

/* Room for one more contact and its leaves. 0 when memory is out. */
static int reserve(workspace *w, const nebel_allocator *allocator, size_t leaves)
{
    packet_state *m = &w->m;
    const size_t contacts = m->contact_count + 2; /* and one for the overlap set */
    if (contacts > w->contact_capacity) {
        medium_hit *moved = grow_aligned(allocator, m->contacts, m->contact_count, sizeof *moved, &w->contact_capacity,
                                         contacts, &w->contact_memory);
        if (moved == NULL) return 0;
        m->contacts = moved;
        if (!reserve_window(w, allocator, w->contact_capacity)) return 0;
    }
    if (m->span_count + leaves > w->span_capacity) {
        leaf_span *moved = grow_aligned(allocator, m->spans, m->span_count, sizeof *moved, &w->span_capacity,
                                        m->span_count + leaves, &w->span_memory);
        if (moved == NULL) return 0;
        m->spans = moved;
    }
    return 1;
}

static void open_workspace(workspace *w)
{
    w->contact_capacity = STACK_CONTACTS;
    w->span_capacity = 2 * STACK_CONTACTS;
    w->contact_memory = NULL;
    w->window_memory = NULL;
    w->span_memory = NULL;
    w->found = NULL;
    w->found_count = 0;
    w->found_capacity = 0;
    w->m.contacts = w->contacts;
    w->m.window = w->window;
    w->m.present = w->present;
    w->m.stretches = w->stretches;
    w->m.lasts = w->lasts;
    w->m.total = NULL;
    w->m.whole = NULL;
    w->m.sun = NULL;
    w->m.wants_sky = 0;
    w->m.spans = w->spans;
    w->m.overlap_set.memory = NULL;
    w->m.overlap_set.capacity = 0;
    w->m.overlap_set.rank = 0;
    w->m.overlap_set.is_walking = 0;
}

static void close_workspace(workspace *w, const nebel_allocator *allocator)
{
    nb_release(allocator, w->contact_memory);
    nb_release(allocator, w->window_memory);
    nb_release(allocator, w->span_memory);
    nb_release(allocator, w->m.overlap_set.memory);
    nb_release(allocator, w->found);
}
