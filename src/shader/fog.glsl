/* The march in shading languages: what src/march does, for one ray, from the words of layout.h.
 *
 * Transmittance is a plain sum over media, and so is light where one medium or one radiance is met: most rays end there
 * (nb_sum_media). Where light of different colour mixes, or one medium takes away another's fog, nb_walk goes from event to event
 * with a few slots as memory; rays that meet more volumes than there are slots walk in windows, and through places where more
 * overlap than that they read everything again for each step: slower, never wrong. Fog that the sun lights is always walked: from turn
 * to turn, see sun.glsl. */

/* ---- sums over media ------------------------------------------------------------------------- */

/* The word of the medium that stands at `i` of all media, or of the host's list. */
int nb_medium_at(int i, bool listed)
{
#ifdef NEBEL_INDEX
    int index = i;
    if (listed) index = NEBEL_INDEX(i);
    return NB_HEADER_WORDS + NB_MEDIUM_WORDS * index;
#else
    return NB_HEADER_WORDS + NB_MEDIUM_WORDS * i;
#endif
}

/* What the media on a ray add up to if none covers another. */
struct nb_media_sum {
    nb_vec3 depth;
    nb_vec3 light;
    nb_vec3 radiance; /* of the first */
    bool met, emits;
    bool mixed; /* more than one quotient of light and extinction */
    bool covers; /* one that covers is met, and another */
    bool scatters; /* light of sun or lamps */
};

nb_media_sum nb_sum_media(nb_ray ray, int first, int count, bool listed)
{
    nb_media_sum sum;
    sum.depth = nb_splat3(0.0);
    sum.light = nb_splat3(0.0);
    sum.radiance = nb_splat3(0.0);
    sum.met = false;
    sum.emits = false;
    sum.mixed = false;
    sum.covers = false;
    sum.scatters = false;
    bool any = false;
    bool covering = false;
    int most = NB_HAS(NB_HAS_SEVERAL) ? count : 1; /* with one, all places in the words are constants */
    for (int i = 0; i < most; i++) {
        if (i >= count) break;
        int at = nb_medium_at(first + i, listed);
        nb_vec4 extinction = NEBEL_WORD(at);
        nb_vec4 radiance = NEBEL_WORD(at + 2);
        int kind = int(extinction.w);
        int leaves = int(radiance.w);
        float length = 0.0;
        float from = 0.0;
        for (int part = 0; part < (NB_HAS(NB_HAS_GROUP) ? leaves : 1); part++) {
            nb_stretch s = nb_next_stretch(at, leaves, ray, from);
            if (!(s.enter < s.leave)) break;
            length += nb_integral(nb_profile_of(at, kind, ray, s.enter), s.leave - s.enter);
            from = s.leave;
        }
        if (!(length > 0.0)) continue;
        nb_vec4 light = NEBEL_WORD(at + 1);
        int flags = int(light.w);
        if (NB_HAS(NB_HAS_COVER)) {
            sum.covers = sum.covers || (any && (covering || (flags & NB_LIGHT_COVERS) != 0));
            covering = covering || (flags & NB_LIGHT_COVERS) != 0;
            any = true;
        }
        if (!NB_HAS(NB_HAS_COVER) || kind != NB_KIND_EXCLUDE) {
            bool emits = (flags & NB_LIGHT_EMITS) != 0;
            bool other = radiance.x != sum.radiance.x || radiance.y != sum.radiance.y || radiance.z != sum.radiance.z;
            sum.mixed = sum.mixed || (sum.met && (other || emits || sum.emits));
            sum.emits = sum.emits || emits;
            sum.met = true;
            if (NB_HAS(NB_HAS_SUN | NB_HAS_LAMPS)) sum.scatters = sum.scatters || NEBEL_WORD(at + NB_MEDIUM_SCATTERING).w > 0.0;
            sum.radiance = radiance.xyz;
            sum.depth += extinction.xyz * length;
            sum.light += light.xyz * length;
        }
    }
    return sum;
}

/* ---- the walk -------------------------------------------------------------------------------- */

/* Stretches that the walk keeps at hand, the next ones of their media: enter, leave, the medium's word. The mask keeps drivers from
 * unrolling every loop over them to the array's length. */
#ifndef NEBEL_SLOTS
#define NEBEL_SLOTS 32
#endif
NB_GLOBAL nb_vec3 nb_slots[NEBEL_SLOTS];

nb_vec3 nb_slot(int k) { return nb_slots[k & (NEBEL_SLOTS - 1)]; }
void nb_set_slot(int k, int medium, nb_stretch s) { nb_slots[k & (NEBEL_SLOTS - 1)] = nb_vec3(s.enter, s.leave, float(medium)); }
bool nb_is_inside(nb_vec3 slot, float t) { return slot.x <= t && slot.y > t; }

int nb_farthest_slot(int used)
{
    int farthest = 0;
    float most = nb_slot(0).x;
    for (int k = 1; k < used; k++) {
        float enter = nb_slot(k).x;
        if (enter > most) {
            most = enter;
            farthest = k;
        }
    }
    return farthest;
}

/* Some drivers end loops after so many turns, all loops of a shader together, without a word. Where the host says how many, the walk
 * counts its own and stops before; neighbours of a pixel run along with it, which the host's number has to allow for. */
#ifdef NEBEL_MOST_TURNS
bool nb_is_tired(int turns) { return turns >= NEBEL_MOST_TURNS; }
#else
bool nb_is_tired(int turns) { return false; }
#endif

/* What the slots hold: `used` of them, of the media before `rest` in the list, right until `end`. */
struct nb_window {
    int used;
    int rest;
    float end;
    int turns; /* it took */
};

/* Stretches behind t. The nearest of all media; or in a crowd, where more begin at t than there are slots, those of the media
 * from `begin` on until the slots are full. A stretch of a body of several leaves ends the window: another may follow. Without a
 * crowd, a window that ends at t says that there is one. */
nb_window nb_fill_slots(nb_ray ray, int first, int count, bool listed, int begin, float t, bool crowd)
{
    nb_window window;
    window.used = 0;
    window.rest = count;
    window.end = ray.t_max;
    window.turns = 0;
    int farthest = 0;
    for (int i = begin; i < count; i++) {
        if (window.end <= t || nb_is_tired(window.turns)) break;
        if (crowd && window.used == NEBEL_SLOTS) {
            window.rest = i;
            break;
        }
        int at = nb_medium_at(first + i, listed);
        int leaves = int(NEBEL_WORD(at + 2).w);
        nb_stretch s = nb_next_stretch(at, leaves, ray, t);
        window.turns += NB_HAS(NB_HAS_GROUP) && leaves > 1 ? (2 * leaves + 1) * (2 * leaves + 1) : 1; /* events, leaves, folds */
        if (!(s.enter < s.leave)) continue;
        if (NB_HAS(NB_HAS_GROUP) && leaves > 1) window.end = min(window.end, s.leave);
        if (window.used < NEBEL_SLOTS) {
            nb_set_slot(window.used, at, s);
            window.used++;
            if (window.used == NEBEL_SLOTS) farthest = nb_farthest_slot(window.used);
            continue;
        }
        float dropped = max(s.enter, nb_slot(farthest).x);
        window.end = min(window.end, dropped);
        if (s.enter < dropped) {
            nb_set_slot(farthest, at, s);
            farthest = nb_farthest_slot(window.used);
            window.turns += NEBEL_SLOTS;
        }
    }
    return window;
}

/* Nodes of the Gauss-Lobatto rule of five points on [0, 1], exact for degree 7, and its weights. Source: Abramowitz and Stegun,
 * table 25.6. */
#define NB_NODES 5

float nb_node(int j)
{
    return j == 0 ? 0.0 : j == 1 ? 0.17267316464601142810 : j == 2 ? 0.5 : j == 3 ? 0.82732683535398857190 : 1.0;
}

float nb_weight(int j)
{
    return j == 2 ? 0.35555555555555555556 : j == 1 || j == 3 ? 0.27222222222222222222 : 0.05;
}

/* The same of Gauss's rule of four points, exact for degree 7, which looks at no end: behind the silhouette of what is round the way to
 * the sun is steep there. The fifth is the end alone. Source: Abramowitz and Stegun, table 25.4. */
float nb_sun_node(int j)
{
    return j == 0 ? 0.06943184420297371239 : j == 1 ? 0.33000947820757186760 : j == 2 ? 0.66999052179242813240 : j == 3 ? 0.93056815579702628761 : 1.0;
}

float nb_sun_weight(int j)
{
    return j == 4 ? 0.0 : j == 1 || j == 2 ? 0.32607257743127307131 : 0.17392742256872692869;
}

/* How fast the logarithm of the density changes along the ray [1/m], for the profiles that are no polynomials, as fast as a step of
 * the rule above can bear: it takes 3 of an exponential, 1.2 units of a bell curve. */
float nb_profile_rate(nb_profile profile)
{
    float slope = abs(profile.slope.x);
    float rate = 0.0;
    if (NB_HAS(NB_HAS_SLOPE) && (profile.kind == NB_KIND_HEIGHT || profile.kind == NB_KIND_HEIGHT_CAPPED))
        rate = slope;
    else if (NB_HAS(NB_HAS_GAUSSIAN) && profile.kind == NB_KIND_GAUSSIAN)
        rate = 2.5 * slope;
    else if (NB_HAS(NB_HAS_RADIAL) && profile.kind >= NB_KIND_RADIAL)
        rate = slope;
    return rate;
}

/* The next place more than `near` metres behind the profile's start where it is not smooth. */
float nb_profile_kink(nb_profile profile, float near)
{
    float kink = NB_FAR;
    if (NB_HAS(NB_HAS_SOFT_EDGE) && profile.kind == NB_KIND_SOFT_EDGE)
        kink = nb_soft_edge_kink(profile.offset, profile.slope, profile.size, near);
    if (NB_HAS(NB_HAS_SOFT_ROUND) && profile.kind == NB_KIND_SOFT_ROUND)
        kink = nb_round_edge_kink(profile.offset, profile.slope, profile.size, profile.form, near);
    if (NB_HAS(NB_HAS_SOFT_PLANES) && profile.kind == NB_KIND_SOFT_PLANES) kink = nb_planes_kink(profile, near);
    if (NB_HAS(NB_HAS_GRID) && profile.kind == NB_KIND_GRID)
        kink = nb_grid_kink(profile.offset, profile.slope, profile.first, near);
    if (NB_HAS(NB_HAS_SLOPE) && (profile.kind == NB_KIND_LINEAR || profile.kind == NB_KIND_HEIGHT_CAPPED)) {
        float inverse = nb_rcp_bounded(profile.slope.x);
        float zero = -profile.offset.x * inverse;
        float one = (1.0 - profile.offset.x) * inverse;
        if (zero > near) kink = zero;
        if (profile.kind == NB_KIND_LINEAR && one > near) kink = min(kink, one);
    }
    return kink;
}

/* What is known of the piece of the ray from `start` to the next event or kink. */
struct nb_piece {
    float start, end;
    int present; /* media */
    bool varies, emits;
    int floor;                 /* the highest rank that covers: what ranks lower is not there */
    nb_vec3 extinction, light; /* per metre, of even media */
    nb_vec3 least, most;       /* radiance */
    float rate;                /* of the fastest profile */
    bool sunlit;
};

nb_piece nb_open_piece(float start, float end)
{
    nb_piece piece;
    piece.start = start;
    piece.end = end;
    piece.present = 0;
    piece.varies = false;
    piece.emits = false;
    piece.floor = 0;
    piece.extinction = nb_splat3(0.0);
    piece.light = nb_splat3(0.0);
    piece.least = nb_splat3(NB_HUGE);
    piece.most = nb_splat3(0.0);
    piece.rate = 0.0;
    piece.sunlit = false;
    return piece;
}

/* Kinks nearer than the digits of a place on the ray are behind already. */
nb_piece nb_note_profile(nb_piece piece, nb_profile profile)
{
    piece.end = min(piece.end, piece.start + nb_profile_kink(profile, piece.start * (4.0 * NB_EPSILON)));
    piece.rate = max(piece.rate, nb_profile_rate(profile));
    piece.varies = true;
    return piece;
}

bool nb_is_covered(int medium, int floor)
{
    return NB_HAS(NB_HAS_COVER) && int(NEBEL_WORD(medium + 1).w) / NB_LIGHT_RANK < floor;
}

/* Whether a slot's medium is at t and not covered. */
bool nb_is_there(nb_vec3 slot, nb_piece piece)
{
    return nb_is_inside(slot, piece.start) && !nb_is_covered(int(slot.z), piece.floor);
}

/* Finds what covers among the slots. Media come by rank, those that cover first, so that what earlier slots added up to ranks below a
 * new floor. */
nb_piece nb_cover_piece(nb_piece piece, int used)
{
    int floor = piece.floor;
    for (int k = 0; k < used; k++) {
        nb_vec3 slot = nb_slot(k);
        int flags = int(NEBEL_WORD(int(slot.z) + 1).w);
        if ((flags & NB_LIGHT_COVERS) != 0 && nb_is_inside(slot, piece.start)) floor = max(floor, flags / NB_LIGHT_RANK);
    }
    if (floor > piece.floor) {
        float end = piece.end;
        piece = nb_open_piece(piece.start, end);
        piece.floor = floor;
    }
    return piece;
}

nb_piece nb_note_slot(nb_piece piece, nb_vec3 slot, nb_ray ray)
{
    if (slot.x > piece.start) piece.end = min(piece.end, slot.x);
    if (slot.y > piece.start) piece.end = min(piece.end, slot.y);
    if (nb_is_there(slot, piece)) {
        int at = int(slot.z);
        nb_vec4 extinction = NEBEL_WORD(at);
        nb_vec4 light = NEBEL_WORD(at + 1);
        nb_vec3 radiance = NEBEL_WORD(at + 2).xyz;
        int kind = int(extinction.w);
        if (!NB_HAS(NB_HAS_COVER) || kind != NB_KIND_EXCLUDE) {
            piece.present++;
            piece.emits = piece.emits || (int(light.w) & NB_LIGHT_EMITS) != 0;
            piece.least = min(piece.least, radiance);
            piece.most = max(piece.most, radiance);
            if (NB_HAS(NB_HAS_SUN)) piece.sunlit = piece.sunlit || NEBEL_WORD(at + NB_MEDIUM_SCATTERING).w > 0.0;
            if (NB_HAS(NB_HAS_PROFILE) && kind != NB_KIND_CONSTANT) {
                piece = nb_note_profile(piece, nb_profile_of(at, kind, ray, piece.start));
            } else {
                piece.extinction += extinction.xyz;
                piece.light += light.xyz;
            }
        }
    }
    return piece;
}

/* A leg, one step of h metres, `from` metres behind the start of its piece: optical depth up to each node and light there, and
 * all its light if nothing attenuated it. Legs without mixed light and sunlight know the last node only. */
struct nb_leg {
    float from, h;
    bool mixed;
    int number; /* within its piece */
    nb_vec3 depth[NB_NODES];
    nb_vec3 density[NB_NODES];
    nb_vec3 light;
    float stop;    /* no leg goes on from before to behind it: a turn, or where sunlight ends or begins; from the start of the piece */
    float sunlight; /* share of it that surfaces let through; 0: the leg is dark */
    bool first_is_curved, last_is_curved; /* there is a turn at its start, at its stop, behind which light changes as a root does */
    nb_vec3 glow[NB_NODES]; /* what full sunlight would add at each node, and in all */
    nb_vec3 shine;
};

nb_leg nb_open_leg(float from, float h, bool mixed, int number)
{
    nb_leg leg;
    leg.from = from;
    leg.h = h;
    leg.mixed = mixed;
    leg.number = number;
    leg.light = nb_splat3(0.0);
    leg.stop = NB_FAR;
    leg.sunlight = 0.0;
    leg.first_is_curved = false;
    leg.last_is_curved = false;
    leg.shine = nb_splat3(0.0);
    for (int j = 0; j < NB_NODES; j++) {
        leg.depth[j] = nb_splat3(0.0);
        leg.density[j] = nb_splat3(0.0);
        leg.glow[j] = nb_splat3(0.0);
    }
    return leg;
}

bool nb_is_sunlit(nb_leg leg) { return NB_HAS(NB_HAS_SUN) && leg.sunlight > 0.0; }

/* Places of nodes on a leg, from 0 to 1, on a scale that is flat where light changes as a root does: x (a + x (b + x c)). */
nb_vec3 nb_leg_scale(nb_leg leg)
{
    bool last = leg.last_is_curved && !(leg.from + leg.h < leg.stop);
    if (leg.first_is_curved) return last ? nb_vec3(0.0, 3.0, -2.0) : nb_vec3(0.0, 1.0, 0.0);
    return last ? nb_vec3(2.0, -1.0, 0.0) : nb_vec3(1.0, 0.0, 0.0);
}

float nb_leg_node(nb_leg leg, int j)
{
    if (!nb_is_sunlit(leg)) return nb_node(j);
    float x = nb_sun_node(j);
    nb_vec3 scale = nb_leg_scale(leg);
    return x * (scale.x + x * (scale.y + x * scale.z));
}

float nb_leg_weight(nb_leg leg, int j)
{
    if (!nb_is_sunlit(leg)) return nb_weight(j);
    float x = nb_sun_node(j);
    nb_vec3 scale = nb_leg_scale(leg);
    return nb_sun_weight(j) * (scale.x + x * (2.0 * scale.y + x * (3.0 * scale.z)));
}

/* Whether a leg asks for its nodes, or for its end alone. */
bool nb_has_nodes(nb_leg leg) { return leg.mixed || (nb_is_sunlit(leg) && !nb_sun_is_closed()); }

/* A grid's density is one polynomial within a piece: that of the cell in its middle, `middle` metres behind the leg's start. */
void nb_add_grid(inout nb_leg leg, nb_profile profile, nb_vec3 extinction, nb_vec3 light, float middle)
{
    nb_grid_spot spot = nb_grid_spot_at(profile.first, profile.offset + profile.slope * middle);
    for (int j = leg.mixed ? 0 : NB_NODES - 1; j < NB_NODES; j++) {
        float s = leg.h * nb_node(j);
        float length = nb_grid_spot_integral(spot, profile.offset, profile.slope, s);
        leg.depth[j] += extinction * length;
        leg.density[j] += light * nb_grid_density(spot, profile.offset + profile.slope * s);
        if (j == NB_NODES - 1) leg.light += light * length;
    }
}

void nb_add_slot(inout nb_leg leg, nb_piece piece, nb_vec3 slot, nb_ray ray)
{
    int at = int(slot.z);
    nb_vec4 extinction = NEBEL_WORD(at);
    nb_vec3 light = NEBEL_WORD(at + 1).xyz;
    nb_vec3 glow = nb_splat3(0.0);
    if (nb_is_sunlit(leg)) glow = nb_sunlit_radiance(at, ray.direction) * extinction.xyz;
    nb_profile profile = nb_profile_of(at, int(extinction.w), ray, piece.start);
    profile.offset += profile.slope * leg.from;
    if (NB_HAS(NB_HAS_GRID) && profile.kind == NB_KIND_GRID) {
        nb_add_grid(leg, profile, extinction.xyz, light, 0.5 * (piece.end - piece.start) - leg.from);
        return;
    }
    /* linear within a piece, which ends at kinks: dear to find for many faces */
    bool flat_sided = NB_HAS(NB_HAS_SOFT_PLANES) && profile.kind == NB_KIND_SOFT_PLANES;
    float first = 0.0;
    if (flat_sided) first = nb_planes_density(profile, 0.0);
    for (int j = nb_has_nodes(leg) ? 0 : NB_NODES - 1; j < NB_NODES; j++) {
        float s = leg.h * nb_leg_node(leg, j);
        float length = 0.0;
        if (flat_sided)
            length = 0.5 * s * (first + nb_planes_density(profile, s));
        else
            length = nb_integral(profile, s);
        float density = nb_density(profile, s);
        leg.depth[j] += extinction.xyz * length;
        leg.density[j] += light * density;
        if (NB_HAS(NB_HAS_SUN)) leg.glow[j] += glow * density;
        if (j == NB_NODES - 1) {
            leg.light += light * length;
            if (NB_HAS(NB_HAS_SUN)) leg.shine += glow * length;
        }
    }
}

/* What has been gathered up to a place on the ray. */
struct nb_gathered {
    nb_vec3 depth;
    nb_vec3 light; /* if nothing attenuated it */
    nb_vec3 radiance;
    nb_vec3 sunlight; /* of the radiance */
};

/* Light through what lies before it, if the quotient of light and extinction were the same all along the way. */
nb_vec3 nb_light_even(nb_vec3 light, nb_vec3 depth, nb_vec3 before)
{
    return nb_exp3(-before) * light * nb_attenuate(depth).mean;
}

/* How far nb_light_even may be off where that quotient varies within `spread`: most if all the brighter light came first. Then
 * s / 2 (1 - e^-x/2)^2 of optical depth x; and never more than half of what the way takes of its own light. */
float nb_even_error(nb_vec3 light, nb_vec3 depth, nb_vec3 before, nb_vec3 spread)
{
    nb_vec3 through = nb_exp3(-0.5 * depth);
    nb_vec3 lost = nb_splat3(1.0) - through;
    nb_vec3 taken = nb_splat3(1.0) - through * through;
    return nb_largest(nb_exp3(-before) * min(0.5 * spread * lost * lost, 0.5 * light * taken));
}

nb_vec3 nb_light_mixed(nb_leg leg, nb_vec3 before)
{
    nb_vec3 sum = nb_splat3(0.0);
    for (int j = 0; j < NB_NODES; j++) sum += nb_leg_weight(leg, j) * leg.density[j] * nb_exp3(-(before + leg.depth[j]));
    return sum * leg.h;
}

/* Sunlight of a leg, and by how much the depth to the sun varies over it as far as that matters; 0 where a step may be as long as it
 * likes. */
struct nb_sun_sum {
    nb_vec3 light;
    float strain;
};

nb_sun_sum nb_light_of_sun(nb_leg leg, nb_piece piece, nb_ray ray, nb_vec3 before, float tolerance)
{
    nb_sun_sum sum;
    sum.light = nb_splat3(0.0);
    sum.strain = 0.0;
    bool closed = nb_sun_is_closed();
    float start = piece.start + leg.from;
    nb_vec3 least = nb_splat3(NB_HUGE);
    nb_vec3 most = nb_splat3(0.0);
    nb_vec3 first = nb_splat3(0.0);
    nb_vec3 last = nb_splat3(0.0);
    for (int j = 0; j < (closed ? 2 : NB_NODES - 1); j++) {
        float share = closed ? float(j) : nb_leg_node(leg, j);
        nb_vec3 depth = nb_depth_to_sun(ray.origin + ray.direction * (start + leg.h * share));
        if (closed && j == 0) first = before + depth;
        if (closed && j == 1) last = before + leg.depth[NB_NODES - 1] + depth;
        if (!closed) sum.light += leg.h * nb_leg_weight(leg, j) * leg.glow[j] * nb_exp3(-(before + leg.depth[j] + depth));
        least = min(least, depth);
        most = max(most, depth);
    }
    if (closed) {
        /* in height fog without a difference of depths, which may be beyond all numbers */
        nb_vec4 to_sun = NEBEL_WORD(NB_HEADER_SUN);
        bool height = int(to_sun.w) == NB_SUN_HEIGHT;
        float keeps = height ? 1.0 - ray.direction.y / to_sun.y : 1.0; /* of what the ray gains, what the way to the sun does not lose */
        nb_vec3 change = height ? leg.depth[NB_NODES - 1] * abs(keeps) : abs(last - first);
        nb_vec3 nearest = height ? (keeps < 0.0 ? last : first) : min(first, last);
        sum.light = leg.shine * nb_exp3(-nearest) * nb_attenuate(change).mean;
    } else if (nb_largest(leg.shine * nb_exp3(-(before + least)) * nb_attenuate(leg.depth[NB_NODES - 1]).mean) > tolerance) {
        sum.strain = nb_largest(most - least);
    }
    sum.light *= leg.sunlight;
    return sum;
}

/* What one leg bears: so much of optical depth and of change of the densities' logarithm together. */
#define NB_LEG_BEARS 2.0

/* Then what is left of the piece counts as even; of a sunlit one, which has turns and shadows, as one leg. */
int nb_most_legs(nb_piece piece) { return NB_HAS(NB_HAS_SUN) && piece.sunlit ? 1000 : 32; }

/* Nothing behind adds a bit to a picture. */
#define NB_OPAQUE 17.0

/* Whether a leg counts as even. */
bool nb_is_even(nb_leg leg, nb_piece piece, nb_vec3 before, float tolerance)
{
    nb_vec3 spread = piece.emits ? nb_splat3(NB_HUGE) : piece.most - piece.least;
    return !leg.mixed || leg.number >= nb_most_legs(piece) ||
           nb_even_error(leg.light, leg.depth[NB_NODES - 1], before, spread) <= tolerance;
}

/* The leg after this one, or this one shorter where it does not fit; `rest` metres are left. Of legs that do not, first one on which
 * the densities hardly change: then optical depth is in proportion to length. */
nb_leg nb_next_leg(nb_leg leg, nb_piece piece, float rest, float strain, bool fits, bool even)
{
    float h = leg.h * min(nb_is_sunlit(leg) ? 8.0 : 2.0, 0.9 * NB_LEG_BEARS / max(strain, 1e-3));
    if (!fits && piece.rate * leg.h > 0.6 * NB_LEG_BEARS) h = 0.5 * NB_LEG_BEARS / piece.rate;
    if ((fits && even) || leg.number + 1 >= nb_most_legs(piece)) h = rest;
    nb_leg next = nb_open_leg(fits ? leg.from + leg.h : leg.from, min(h, rest), leg.mixed, leg.number + 1);
    next.stop = leg.stop;
    next.sunlight = leg.sunlight;
    next.first_is_curved = !fits && leg.first_is_curved;
    next.last_is_curved = leg.last_is_curved;
    return next;
}

/* How far the next leg goes at most, and whether the sun lights it. `lit` is the host's last answer. */
void nb_plan_leg(inout nb_leg leg, nb_piece piece, nb_ray ray, inout nb_vec2 lit)
{
    float t = piece.start + leg.from;
    float near = max(t * (8.0 * NB_EPSILON), 1e-6);
    if (leg.number > 0 && leg.from < leg.stop - near) return;
    if (lit.y <= t + near) {
        lit = NEBEL_SUN_LIT(ray.origin, ray.direction, t + near, ray.t_max);
        lit.y = max(lit.y, t + 2.0 * near);
    }
    leg.sunlight = lit.x;
    leg.first_is_curved = leg.number > 0 && leg.last_is_curved;
    leg.last_is_curved = false;
    leg.stop = min(piece.end, lit.y) - piece.start;
    if (leg.sunlight > 0.0) {
        nb_turning turning = nb_find_turn(ray, t, piece.start + leg.stop);
        leg.stop = turning.next - piece.start;
        leg.last_is_curved = turning.curved;
    }
}

/* Moves behind a leg, or makes it shorter. Returns what is left of the piece [m]. */
float nb_end_leg(inout nb_gathered g, inout nb_leg leg, nb_piece piece, nb_ray ray, float tolerance, bool lit)
{
    nb_vec3 depth = leg.depth[NB_NODES - 1];
    float strain = nb_largest(depth) + piece.rate * leg.h;
    bool even = nb_is_even(leg, piece, g.depth, tolerance);
    bool is_last = leg.number >= nb_most_legs(piece);
    bool fits = even || strain <= NB_LEG_BEARS || is_last;
    float rest = piece.end - piece.start - leg.from;
    if (nb_is_sunlit(leg) && fits) {
        bool closed = nb_sun_is_closed();
        nb_vec3 most = leg.shine * nb_exp3(-g.depth) * nb_attenuate(depth).mean;
        bool faint = nb_largest(most) <= tolerance;
        fits = closed || faint || is_last || strain <= NB_LEG_BEARS;
        if (fits) {
            nb_sun_sum sun = nb_light_of_sun(leg, piece, ray, g.depth, tolerance);
            strain += sun.strain;
            fits = sun.strain == 0.0 || faint || is_last || strain <= NB_LEG_BEARS;
            if (fits) {
                g.radiance += sun.light;
                g.sunlight += sun.light;
            }
        }
        even = even && (closed || faint);
    }
    if (fits) {
        if (lit) g.radiance += even ? nb_light_even(leg.light, depth, g.depth) : nb_light_mixed(leg, g.depth);
        g.light += leg.light;
        g.depth += depth;
        rest -= leg.h;
    }
    leg = nb_next_leg(leg, piece, rest, strain, fits, even);
    return rest;
}

/* About how many turns of loops a leg in sunlight takes, besides those of the slots. */
int nb_turns_to_sun()
{
    int media = NB_HAS(NB_HAS_SEVERAL) ? int(NEBEL_WORD(0).x) : 1;
    int way = 2 + (NB_HAS(NB_HAS_GROUP) ? 16 : 0) + (NB_HAS(NB_HAS_PLANES) ? 12 : 0) + (NB_HAS(NB_HAS_SOFT) ? 8 : 0);
    int search = NB_MOST_PASSED + (NB_HAS(NB_HAS_PLANES) ? 32 : 0);
    return media * (search + (nb_sun_is_closed() ? 2 : NB_NODES - 1) * way);
}

/* The first leg of a piece: all of it. */
nb_leg nb_first_leg(nb_piece piece, bool lit)
{
    bool uneven = piece.emits || nb_largest(piece.most - piece.least) > 0.0;
    return nb_open_leg(0.0, piece.end - piece.start, lit && uneven && piece.present > 1, 0);
}

void nb_pass_piece(inout nb_gathered g, nb_piece piece, bool lit)
{
    float length = piece.end - piece.start;
    nb_vec3 depth = piece.extinction * length;
    if (lit) g.radiance += nb_light_even(piece.light * length, depth, g.depth);
    g.light += piece.light * length;
    g.depth += depth;
}

/* The rest of a ray that is too much to walk, where no medium covers another: what is left of all, as if it were mixed evenly, and as
 * sunny as what lies before it. */
nb_gathered nb_pass_rest(nb_gathered g, nb_media_sum all)
{
    nb_vec3 depth = max(all.depth - g.depth, nb_splat3(0.0));
    g.radiance += nb_light_even(max(all.light - g.light, nb_splat3(0.0)), depth, g.depth);
    if (NB_HAS(NB_HAS_SUN)) {
        nb_vec3 taken = nb_attenuate(g.depth).mean * g.depth;
        g.radiance += g.sunlight * nb_exp3(-g.depth) * nb_attenuate(depth).mean * depth / max(taken, nb_splat3(1e-6));
    }
    g.depth += depth;
    return g;
}

/* Each turn of the outer loop looks once at all media on the ray: to find the end of the next piece, or to sum a leg within one of
 * varying density. So the shapes and profiles stand in the program once, not once for each purpose. */
nb_gathered nb_walk(nb_ray ray, int first, int count, bool listed, bool lit, nb_media_sum all)
{
    float tolerance = NEBEL_WORD(0).y;
    float t = 0.0;
    bool crowd = false;
    bool stepping = false;
    nb_gathered g;
    g.depth = nb_splat3(0.0);
    g.light = nb_splat3(0.0);
    g.radiance = nb_splat3(0.0);
    g.sunlight = nb_splat3(0.0);
    int turns = count; /* of the sums */
    nb_vec2 sunlit = nb_vec2(1.0, 0.0);
    nb_piece piece = nb_open_piece(0.0, 0.0);
    nb_leg leg = nb_open_leg(0.0, 0.0, false, 0);
    nb_window window;
    window.used = 0;
    window.rest = count;
    window.end = 0.0;
    window.turns = 0;
    while (t < ray.t_max && nb_smallest(g.depth) < NB_OPAQUE && !nb_is_tired(turns)) {
        bool on_leg = NB_HAS(NB_HAS_PROFILE | NB_HAS_SUN) && stepping;
        if (NB_HAS(NB_HAS_SUN) && on_leg && lit && piece.sunlit) {
            nb_plan_leg(leg, piece, ray, sunlit);
            leg.h = min(leg.h, leg.stop - leg.from);
        }
        bool stale = crowd || t >= window.end;
        if (!on_leg) piece = nb_open_piece(t, ray.t_max);
        for (int next = 0; next < count;) {
            if (stale) {
                window = nb_fill_slots(ray, first, count, listed, next, t, crowd);
                turns += window.turns;
                if (nb_is_tired(turns)) break;
            }
            turns += 1 + window.used * (on_leg ? 1 + NB_NODES : 2);
            bool over_full = !crowd && window.end <= t;
            crowd = crowd || over_full;
            if (over_full) continue;
            next = window.rest;
            piece.end = min(piece.end, window.end);
            if (NB_HAS(NB_HAS_COVER) && !on_leg) piece = nb_cover_piece(piece, window.used);
            for (int k = 0; k < window.used; k++) {
                nb_vec3 slot = nb_slot(k);
                if (!on_leg)
                    piece = nb_note_slot(piece, slot, ray);
                else if (nb_is_there(slot, piece))
                    nb_add_slot(leg, piece, slot, ray);
            }
        }
        if (nb_is_tired(turns)) break;
        bool foggy = piece.present > 0;
        bool legged = (NB_HAS(NB_HAS_PROFILE) && piece.varies) || (NB_HAS(NB_HAS_SUN) && lit && piece.sunlit);
        bool begins = foggy && !on_leg && legged;
        bool over = !begins;
        if (NB_HAS(NB_HAS_SUN) && on_leg && nb_is_sunlit(leg)) turns += nb_turns_to_sun();
        if (on_leg)
            over = nb_end_leg(g, leg, piece, ray, tolerance, lit) <= (piece.end - piece.start) * (4.0 * NB_EPSILON);
        else if (begins)
            leg = nb_first_leg(piece, lit);
        else if (foggy)
            nb_pass_piece(g, piece, lit);
        stepping = !over;
        if (over) {
            t = piece.end;
            if (crowd) window.end = t;
            crowd = false;
        }
    }
    if (lit && nb_is_tired(turns) && !all.covers) g = nb_pass_rest(g, all);
    return g;
}

/* ---- the face -------------------------------------------------------------------------------- */

/* See lamp.glsl. */
nb_vec3 nb_lamplight(nb_ray ray, int first, int count, bool listed);

/* See nebel_set_max_opacity. */
nebel_light nb_limit_opacity(nebel_light light, float most)
{
    nb_vec3 opacity = nb_splat3(1.0) - light.transmittance;
    light.in_scattering *= nb_vec3(most / max(opacity.x, most), most / max(opacity.y, most), most / max(opacity.z, most));
    light.transmittance = max(light.transmittance, nb_splat3(1.0 - most));
    return light;
}

/* `lit`: in-scattering is asked for, too. `from_eye`: distances along the ray count. */
nebel_light nb_trace_media(nb_vec3 origin, nb_vec3 direction, float t_max, int first, int count, bool listed, bool lit,
                           bool from_eye)
{
    nb_ray ray;
    ray.origin = origin;
    ray.direction = direction;
    ray.t_max = min(t_max, NB_FAR);
    ray.from_eye = from_eye;
    nebel_light light;
    light.transmittance = nb_splat3(1.0);
    light.in_scattering = nb_splat3(0.0);
    float square = dot(direction, direction);
    if (t_max > 0.0 && square > 0.0 && nb_is_number(dot(origin, origin) + square + t_max)) {
        nb_media_sum sum = nb_sum_media(ray, first, count, listed);
        nb_attenuation attenuation = nb_attenuate(sum.depth);
        light.transmittance = attenuation.left;
        light.in_scattering = sum.light * attenuation.mean;
        bool covers = NB_HAS(NB_HAS_COVER) && sum.met && sum.covers;
        bool walks = (NB_HAS(NB_HAS_MIXED) && sum.mixed) || (NB_HAS(NB_HAS_SUN) && sum.scatters);
        if (covers || (lit && walks)) {
            nb_gathered walked = nb_walk(ray, first, count, listed, lit, sum);
            light.in_scattering = walked.radiance;
            if (covers) light.transmittance = nb_exp3(-walked.depth);
        }
        if (NB_HAS(NB_HAS_LAMPS) && lit && sum.scatters) light.in_scattering += nb_lamplight(ray, first, count, listed);
        if (NB_HAS(NB_HAS_MAX_OPACITY)) light = nb_limit_opacity(light, NEBEL_WORD(0).z);
        light.in_scattering = min(light.in_scattering, nb_splat3(NEBEL_MOST_LIGHT));
    }
    return light;
}

nebel_light nebel_trace(nb_vec3 origin, nb_vec3 direction, float t_max)
{
    return nb_trace_media(origin, direction, t_max, 0, int(NEBEL_WORD(0).x), false, true, true);
}

nb_vec3 nebel_transmit(nb_vec3 origin, nb_vec3 direction, float t_max)
{
    return nb_trace_media(origin, direction, t_max, 0, int(NEBEL_WORD(0).x), false, false, true).transmittance;
}

nb_vec3 nebel_transmit_light(nb_vec3 origin, nb_vec3 direction, float t_max)
{
    return nb_trace_media(origin, direction, t_max, 0, int(NEBEL_WORD(0).x), false, false, false).transmittance;
}

#ifdef NEBEL_INDEX
nebel_light nebel_trace_list(nb_vec3 origin, nb_vec3 direction, float t_max, int first, int count)
{
    return nb_trace_media(origin, direction, t_max, first, count, true, true, true);
}

nb_vec3 nebel_transmit_list(nb_vec3 origin, nb_vec3 direction, float t_max, int first, int count)
{
    return nb_trace_media(origin, direction, t_max, first, count, true, false, true).transmittance;
}

nb_vec3 nebel_transmit_light_list(nb_vec3 origin, nb_vec3 direction, float t_max, int first, int count)
{
    return nb_trace_media(origin, direction, t_max, first, count, true, false, false).transmittance;
}
#endif
