/* The light of fog apart: the same volumes, lit by one light each. */
#include "fog.h"
#include "snapshot.h"

#include "medium/medium_check.h"

#include <math.h>
#include <string.h>

/* What lights a part. */
typedef struct selection {
    const nebel_sun *sun; /* NULL: none */
    int sky, own;         /* own: of lamps, and what the fog itself gives */
    double max_opacity;
} selection;

static void keep(const nebel_snapshot *snapshot, selection kept, nb_fog_slot *slots)
{
    for (size_t i = 0; i < snapshot->medium_count; i++) {
        slots[i] = (nb_fog_slot){
            .volume = snapshot->media[i].body, .used = 1, .lattice = nb_sun_lattice_retain(snapshot->media[i].lattice)};
        for (int c = 0; c < 3 && !kept.own; c++) slots[i].volume.source[c] = slots[i].volume.emission[c] = 0;
    }
}

/* A fog that borrows all but its slots from the snapshot. */
static nebel_result make_part(const nebel_snapshot *snapshot, selection kept, nebel_snapshot **part)
{
    nb_fog_slot *slots = nb_allocate_zero(&snapshot->allocator, snapshot->medium_count, sizeof *slots);
    if (slots == NULL)
        return nb_fail(&snapshot->log, NEBEL_ERROR_MEMORY, "snapshot: out of memory for its light apart");
    nebel_fog fog = {.allocator = snapshot->allocator,
                     .log = snapshot->log,
                     .max_opacity = kept.max_opacity,
                     .diffusion = snapshot->diffusing,
                     .slots = slots,
                     .slot_count = snapshot->medium_count};
    if (kept.sky) fog.sky = snapshot->sky;
    if (kept.sun != NULL) fog.sun = *kept.sun;
    if (kept.own) {
        fog.lamps = snapshot->lamps;
        fog.lamp_count = snapshot->lamp_count;
    }
    keep(snapshot, kept, slots);
    const nebel_result result = nebel_commit_fog(&fog, part);
    for (size_t i = 0; i < snapshot->medium_count; i++) nb_sun_lattice_release(slots[i].lattice);
    nb_release(&snapshot->allocator, slots);
    return result;
}

static int is_light(const double rgb[3])
{
    return rgb[0] > 0 || rgb[1] > 0 || rgb[2] > 0;
}

static int has_own(const nebel_snapshot *snapshot)
{
    for (size_t i = 0; i < snapshot->medium_count; i++) {
        const nb_volume *body = &snapshot->media[i].body;
        if (is_light(body->emission) || (!body->lit && is_light(body->source))) return 1;
    }
    return snapshot->is_lamplit;
}

/* Level fog without end bends with no ground. */
static int is_local(const nb_volume *body)
{
    return body->density.type != NEBEL_DENSITY_ALTITUDE &&
           (isinf(body->low[0]) || isinf(body->high[0]) || isinf(body->low[2]) || isinf(body->high[2]));
}

static int find_box(const nebel_snapshot *snapshot, int with_local, double min[3], double max[3])
{
    int any = 0;
    if (snapshot == NULL || min == NULL || max == NULL) return 0;
    for (size_t i = 0; i < snapshot->medium_count; i++) {
        const nb_volume *body = &snapshot->media[i].body;
        if (!body->lit || !is_light(body->albedo) || (!with_local && is_local(body))) continue;
        for (int c = 0; c < 3; c++) {
            min[c] = any ? fmin(min[c], body->low[c]) : body->low[c];
            max[c] = any ? fmax(max[c], body->high[c]) : body->high[c];
        }
        any = 1;
    }
    return any;
}

int nebel_snapshot_skylit_fog(const nebel_snapshot *snapshot, double min[3], double max[3])
{
    return find_box(snapshot, 1, min, max);
}

int nebel_snapshot_scattering_fog(const nebel_snapshot *snapshot, double min[3], double max[3])
{
    return find_box(snapshot, 0, min, max);
}

nebel_result nebel_split_light(const nebel_snapshot *snapshot, const nebel_sun *sun, nebel_split_fog *split)
{
    if (split != NULL) memset(split, 0, sizeof *split);
    if (snapshot == NULL || sun == NULL || split == NULL) return NEBEL_ERROR_ARGUMENT;
    nebel_result result = nb_check_sun(&snapshot->log, sun);
    if (result == NEBEL_OK) result = make_part(snapshot, (selection){.sun = sun, .max_opacity = 1}, &split->sun);
    if (result == NEBEL_OK) result = make_part(snapshot, (selection){.sky = 1, .max_opacity = 1}, &split->sky);
    if (result == NEBEL_OK && has_own(snapshot))
        result = make_part(snapshot, (selection){.own = 1, .max_opacity = 1}, &split->own);
    if (result != NEBEL_OK)
        nebel_release_split_light(split);
    else
        split->max_opacity = snapshot->max_opacity;
    return result;
}

nebel_result nebel_relight(const nebel_snapshot *snapshot, const nebel_sun *sun, nebel_snapshot **lit)
{
    if (lit != NULL) *lit = NULL;
    if (snapshot == NULL || sun == NULL || lit == NULL) return NEBEL_ERROR_ARGUMENT;
    const selection all = {.sun = sun, .sky = 1, .own = 1, .max_opacity = snapshot->max_opacity};
    const nebel_result result = nb_check_sun(&snapshot->log, sun);
    return result == NEBEL_OK ? make_part(snapshot, all, lit) : result;
}

void nebel_release_split_light(nebel_split_fog *split)
{
    if (split == NULL) return;
    nebel_release_snapshot(split->sun);
    nebel_release_snapshot(split->sky);
    nebel_release_snapshot(split->own);
    memset(split, 0, sizeof *split);
}
