/* The media that a walk along a ray has at hand. shadow_depth.glsl and fog.glsl follow. */

/* The word of the medium that stands at `i` of all media, or of the host's list. */
int nb_medium_at(int i, bool listed)
{
#ifdef NEBEL_TILE_ENTRY
    int index = i;
    if (listed) index = NEBEL_TILE_ENTRY(i);
    return NB_HEADER_TEXELS + NB_MEDIUM_TEXELS * index;
#else
    return NB_HEADER_TEXELS + NB_MEDIUM_TEXELS * i;
#endif
}

bool nb_is_covered(int medium, int floor)
{
    return NB_HAS(NB_HAS_OVERRIDE) && int(NEBEL_FOG_TEXEL(medium + 1).w) / NB_LIGHT_RANK < floor;
}

/* Stretches that the walk keeps at hand, the next ones of their media: enter, leave, the medium's word. The mask keeps drivers from
 * unrolling every loop over them to the array's length. */
#ifndef NEBEL_MEDIUM_SLOTS
#define NEBEL_MEDIUM_SLOTS 32
#endif
NB_GLOBAL nb_vec3 nb_slots[NEBEL_MEDIUM_SLOTS];

nb_vec3 nb_fog_slot(int k) { return nb_slots[k & (NEBEL_MEDIUM_SLOTS - 1)]; }
void nb_set_slot(int k, int medium, nb_stretch s) { nb_slots[k & (NEBEL_MEDIUM_SLOTS - 1)] = nb_vec3(s.enter, s.leave, float(medium)); }

/* What opaque fog of their media gives; kept where an environment lights fog, which is dear to look up. */
NB_GLOBAL nb_vec3 nb_slot_lights[NEBEL_MEDIUM_SLOTS];

void nb_light_slot(int k, int medium, nb_vec3 direction)
{
    if (NB_HAS(NB_HAS_ENVIRONMENT)) nb_slot_lights[k & (NEBEL_MEDIUM_SLOTS - 1)] = nb_opaque_radiance(medium, direction);
}

nb_vec3 nb_slot_radiance(int k, int medium)
{
    nb_vec3 radiance = NEBEL_FOG_TEXEL(medium + 2).xyz;
    if (NB_HAS(NB_HAS_ENVIRONMENT)) radiance = nb_slot_lights[k & (NEBEL_MEDIUM_SLOTS - 1)];
    return radiance;
}

bool nb_is_inside(nb_vec3 slot, float t) { return slot.x <= t && slot.y > t; }

int nb_farthest_slot(int used)
{
    int farthest = 0;
    float most = nb_fog_slot(0).x;
    for (int k = 1; k < used; k++) {
        float enter = nb_fog_slot(k).x;
        if (enter > most) {
            most = enter;
            farthest = k;
        }
    }
    return farthest;
}

/* Some drivers end loops after so many turns, all loops of a shader together, without a word. Where the host says how many, the walk
 * counts its own and stops before; neighbours of a pixel run along with it, which the host's number has to allow for. */
#ifdef NEBEL_MAX_ITERATIONS
#define NB_MAY_TIRE true
bool nb_is_tired(int turns) { return turns >= NEBEL_MAX_ITERATIONS; }
#else
#define NB_MAY_TIRE false
bool nb_is_tired(int turns) { return false; }
#endif

/* A host that draws a ray in several passes, each from where the one before has come to, defines NEBEL_RESUMABLE. What is found when the
 * driver has ended the loops is not kept then; and as variables are anything behind a loop that was ended, what is kept lies in memory:
 * in an array whose index is no constant. */
#ifdef NEBEL_RESUMABLE
#define NB_RESUMES true
/* Ended loops run once, whatever they are for. `count` is no constant, so that this one stays. */
bool nb_has_loops(int count)
{
    int turns = 0;
    for (int i = 0; i < max(2, -count); i++) turns++;
    return turns > 1;
}

NB_GLOBAL nb_vec4 nb_kept[8];

void nb_keep(int count, int i, nb_vec3 v, float last) { nb_kept[i + (count < 0 ? 4 : 0)] = nb_vec4(v, last); }
nb_vec4 nb_kept_word(int count, int i) { return nb_kept[i + (count < 0 ? 4 : 0)]; }
#else
#define NB_RESUMES false
bool nb_has_loops(int count) { return true; }
void nb_keep(int count, int i, nb_vec3 v, float last) {}
nb_vec4 nb_kept_word(int count, int i) { return nb_vec4(0.0, 0.0, 0.0, 0.0); }
#endif

/* How many sums over `count` media are made of a ray that was too much to walk. */
int nb_rest_steps(int count)
{
#ifdef NEBEL_MAX_ITERATIONS
    return clamp(NEBEL_MAX_ITERATIONS / (2 * count), 1, 64);
#else
    return 0;
#endif
}

/* What the slots hold: `used` of them, of the media before `rest` in the list, right until `end`. */
struct nb_window {
    int used;
    int rest;
    float end;
    int turns; /* it took */
};

/* Stretches behind t. The nearest of all media; or in an overflow, where more begin at t than there are slots, those
 * of the media from `begin` on until the slots are full. A stretch of a body of several leaves ends the window: another
 * may follow. Without a overflow, a window that ends at t says that there is one. */
nb_window nb_fill_slots(nb_ray ray, int first, int count, bool listed, int begin, float t, bool overflow)
{
    nb_window window;
    window.used = 0;
    window.rest = count;
    window.end = ray.t_max;
    window.turns = 0;
    int farthest = 0;
    for (int i = begin; i < count; i++) {
        if (window.end <= t || nb_is_tired(window.turns)) break;
        if (overflow && window.used == NEBEL_MEDIUM_SLOTS) {
            window.rest = i;
            break;
        }
        int at = nb_medium_at(first + i, listed);
        int leaves = int(NEBEL_FOG_TEXEL(at + 2).w);
        nb_stretch s = nb_next_stretch(at, leaves, ray, t);
        window.turns += NB_HAS(NB_HAS_GROUP) && leaves > 1 ? (2 * leaves + 1) * (2 * leaves + 1) : 1; /* events, leaves, folds */
        if (!(s.enter < s.leave)) continue;
        if (NB_HAS(NB_HAS_GROUP) && leaves > 1) window.end = min(window.end, s.leave);
        if (window.used < NEBEL_MEDIUM_SLOTS) {
            nb_set_slot(window.used, at, s);
            nb_light_slot(window.used, at, ray.direction);
            window.used++;
            if (!overflow && window.used == NEBEL_MEDIUM_SLOTS) farthest = nb_farthest_slot(window.used);
            continue;
        }
        float dropped = max(s.enter, nb_fog_slot(farthest).x);
        window.end = min(window.end, dropped);
        if (s.enter < dropped) {
            nb_set_slot(farthest, at, s);
            nb_light_slot(farthest, at, ray.direction);
            farthest = nb_farthest_slot(window.used);
            window.turns += NEBEL_MEDIUM_SLOTS;
        }
    }
    return window;
}
