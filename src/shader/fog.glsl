/* The march in shading languages: what src/march does, for one ray, from the words of layout.h; trace.glsl puts it together.
 *
 * Transmittance is a plain sum over media, and so is light where one medium or one radiance is met: most rays end there
 * (nb_sum_media). Where light of different colour mixes, or one medium takes away another's fog, nb_walk goes from event to event
 * with a few slots as memory; rays that meet more volumes than there are slots walk in windows, and through places where more
 * overlap than that they read everything again for each step: slower, never wrong. Fog that the sun lights is always walked: from turn
 * to turn, see sun.glsl. */

/* ---- sums over media ------------------------------------------------------------------------- */

/* What the media on a ray add up to if none covers another. */
struct nb_media_sum {
    nb_vec3 depth;
    nb_vec3 light;
    nb_vec3 radiance; /* of the first */
    bool met, emits;
    bool mixed; /* more than one quotient of light and extinction */
    bool covers; /* one that covers is met, and another */
    bool scatters; /* light of sun or point lights */
    float last; /* where the last body ends, as far as bodies end at all */
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
    sum.last = 0.0;
    bool any = false;
    bool covering = false;
    int most = NB_HAS(NB_HAS_SEVERAL) ? count : 1; /* with one, all places in the words are constants */
    for (int i = 0; i < most; i++) {
        if (i >= count) break;
        int at = nb_medium_at(first + i, listed);
        nb_vec4 extinction = NEBEL_FOG_TEXEL(at);
        int kind = int(extinction.w);
        int leaves = int(NEBEL_FOG_TEXEL(at + 2).w);
        float length = 0.0;
        float from = 0.0;
        for (int part = 0; part < (NB_HAS(NB_HAS_GROUP) ? leaves : 1); part++) {
            nb_stretch s = nb_next_stretch(at, leaves, ray, from);
            if (!(s.enter < s.leave)) break;
            length += nb_integral(nb_profile_of(at, kind, ray, s.enter), s.leave - s.enter);
            from = s.leave;
        }
        if (from < ray.t_max) sum.last = max(sum.last, from);
        if (!(from > 0.0)) continue;
        int flags = int(NEBEL_FOG_TEXEL(at + 1).w);
        if (NB_HAS(NB_HAS_OVERRIDE)) { /* without density, too */
            sum.covers = sum.covers || (any && (covering || (flags & NB_LIGHT_COVERS) != 0));
            covering = covering || (flags & NB_LIGHT_COVERS) != 0;
            any = true;
        }
        if (length > 0.0 && (!NB_HAS(NB_HAS_OVERRIDE) || kind != NB_KIND_EXCLUDE)) {
            nb_vec3 radiance = nb_opaque_radiance(at, ray.direction);
            bool emits = (flags & NB_LIGHT_EMITS) != 0;
            bool other = radiance.x != sum.radiance.x || radiance.y != sum.radiance.y || radiance.z != sum.radiance.z;
            sum.mixed = sum.mixed || (sum.met && (other || emits || sum.emits));
            sum.emits = sum.emits || emits;
            sum.met = true;
            if (NB_HAS(NB_HAS_SUN | NB_HAS_LIGHTS)) sum.scatters = sum.scatters || NEBEL_FOG_TEXEL(at + NB_MEDIUM_SCATTERING).w > 0.0;
            sum.radiance = radiance;
            sum.depth += extinction.xyz * length;
            sum.light += nb_light_per_metre(at, radiance) * length;
        }
    }
    return sum;
}

/* ---- the walk -------------------------------------------------------------------------------- */

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

/* Fog that thins out with the altitude counts up to so many scale heights above its base; from the other level on down most of it
 * is, so that neither piece of a level way takes too many legs. */
#define NB_ALTITUDE_COUNTS 20.0
#define NB_ALTITUDE_THICK 8.0

float nb_nearer_end(nb_chord chord, float near, float kink)
{
    if (chord.enter > near) kink = min(kink, chord.enter);
    if (chord.leave > near) kink = min(kink, chord.leave);
    return kink;
}

/* The next of the places where it begins and ends to count, where it is lowest, and where it gets no thicker. */
float nb_altitude_kink(nb_profile profile, float near)
{
    nb_arc arc = nb_profile_arc(profile);
    float kink = nb_nearer_end(nb_arc_chord(arc, NB_ALTITUDE_COUNTS * profile.size.x), near, NB_FAR);
    kink = nb_nearer_end(nb_arc_chord(arc, NB_ALTITUDE_THICK * profile.size.x), near, kink);
    kink = nb_nearer_end(nb_arc_chord(arc, -profile.size.y), near, kink);
    if (-arc.rise > near) kink = min(kink, -arc.rise);
    return kink;
}

/* The most of it on the way to the next kink; over a level way it is a bell curve. Pieces begin where the shell does in which fog
 * counts, but for what float loses of that place. */
float nb_altitude_rate(nb_profile profile)
{
    nb_arc arc = nb_profile_arc(profile);
    nb_chord counts = nb_arc_chord(arc, NB_ALTITUDE_COUNTS * profile.size.x);
    if (!(counts.enter <= profile.size.x && counts.leave > 0.0)) return 0.0;
    float lowest = max(arc.radius + nb_arc_climb(arc, -arc.rise), profile.size.x);
    float end = arc.rise + nb_altitude_kink(profile, profile.size.x);
    float slope = max(abs(arc.rise), abs(end)) / lowest;
    return (min(slope, 1.0) + sqrt(profile.size.x / lowest)) / profile.size.x;
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
#if NB_DECLARES(NB_HAS_ALTITUDE)
    else if (NB_HAS(NB_HAS_ALTITUDE) && profile.kind == NB_KIND_ALTITUDE)
        rate = nb_altitude_rate(profile);
#endif
    else if (NB_HAS(NB_HAS_RADIAL) && profile.kind >= NB_KIND_RADIAL)
        rate = slope;
    return rate;
}

/* The next place more than `near` metres behind the profile's start where it is not smooth. */
float nb_profile_kink(nb_profile profile, float near)
{
    float kink = NB_FAR;
#if NB_DECLARES(NB_HAS_SOFT_EDGE)
    if (NB_HAS(NB_HAS_SOFT_EDGE) && profile.kind == NB_KIND_SOFT_EDGE)
        kink = nb_soft_edge_kink(profile.offset, profile.slope, profile.size, near);
#endif
#if NB_DECLARES(NB_HAS_SOFT_ROUND)
    if (NB_HAS(NB_HAS_SOFT_ROUND) && profile.kind == NB_KIND_SOFT_ROUND)
        kink = nb_round_edge_kink(profile.offset, profile.slope, profile.size, profile.form, near);
#endif
#if NB_DECLARES(NB_HAS_SOFT_PLANES)
    if (NB_HAS(NB_HAS_SOFT_PLANES) && profile.kind == NB_KIND_SOFT_PLANES) kink = nb_planes_kink(profile, near);
#endif
#if NB_DECLARES(NB_HAS_GRID)
    if (NB_HAS(NB_HAS_GRID) && profile.kind == NB_KIND_GRID)
        kink = nb_grid_kink(profile.offset, profile.slope, profile.first, near);
#endif
#if NB_DECLARES(NB_HAS_ALTITUDE)
    if (NB_HAS(NB_HAS_ALTITUDE) && profile.kind == NB_KIND_ALTITUDE) kink = nb_altitude_kink(profile, near);
#endif
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
    int voxels; /* word of a grid whose cells do not end the piece, see voxels.glsl; 0: there is none */
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
    piece.voxels = 0;
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
        nb_vec3 slot = nb_fog_slot(k);
        int flags = int(NEBEL_FOG_TEXEL(int(slot.z) + 1).w);
        if ((flags & NB_LIGHT_COVERS) != 0 && nb_is_inside(slot, piece.start)) floor = max(floor, flags / NB_LIGHT_RANK);
    }
    if (floor > piece.floor) {
        float end = piece.end;
        piece = nb_open_piece(piece.start, end);
        piece.floor = floor;
    }
    return piece;
}

/* `by_cells`: one grid may be walked from cell to cell within the piece. */
nb_piece nb_note_slot(nb_piece piece, int k, nb_ray ray, bool by_cells)
{
    nb_vec3 slot = nb_fog_slot(k);
    if (slot.x > piece.start) piece.end = min(piece.end, slot.x);
    if (slot.y > piece.start) piece.end = min(piece.end, slot.y);
    if (nb_is_there(slot, piece)) {
        int at = int(slot.z);
        nb_vec4 extinction = NEBEL_FOG_TEXEL(at);
        nb_vec3 radiance = nb_slot_radiance(k, at);
        int kind = int(extinction.w);
        if (!NB_HAS(NB_HAS_OVERRIDE) || kind != NB_KIND_EXCLUDE) {
            piece.present++;
            piece.emits = piece.emits || (int(NEBEL_FOG_TEXEL(at + 1).w) & NB_LIGHT_EMITS) != 0;
            piece.least = min(piece.least, radiance);
            piece.most = max(piece.most, radiance);
            if (NB_HAS(NB_HAS_SUN)) piece.sunlit = piece.sunlit || NEBEL_FOG_TEXEL(at + NB_MEDIUM_SCATTERING).w > 0.0;
            if (NB_HAS(NB_HAS_GRID) && by_cells && piece.voxels == 0 && kind == NB_KIND_GRID) {
                piece.voxels = at;
            } else if (NB_HAS(NB_HAS_PROFILE) && kind != NB_KIND_CONSTANT) {
                piece = nb_note_profile(piece, nb_profile_of(at, kind, ray, piece.start));
            } else {
                piece.extinction += extinction.xyz;
                piece.light += nb_light_per_metre(at, radiance);
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
    float most;     /* metres that a leg may take in what voxels leave of sunlight */
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
    leg.most = NB_FAR;
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
void nb_add_grid(inout nb_leg leg, nb_profile profile, nb_vec3 extinction, nb_vec3 light, nb_vec3 glow, float middle)
{
    nb_grid_spot spot = nb_grid_spot_at(profile.first, profile.offset + profile.slope * middle);
    for (int j = nb_has_nodes(leg) ? 0 : NB_NODES - 1; j < NB_NODES; j++) {
        float s = leg.h * nb_leg_node(leg, j);
        float length = nb_grid_spot_integral(spot, profile.offset, profile.slope, s);
        float density = nb_grid_density(spot, profile.offset + profile.slope * s);
        leg.depth[j] += extinction * length;
        leg.density[j] += light * density;
        if (NB_HAS(NB_HAS_SUN)) leg.glow[j] += glow * density;
        if (j == NB_NODES - 1) {
            leg.light += light * length;
            if (NB_HAS(NB_HAS_SUN)) leg.shine += glow * length;
        }
    }
}

void nb_add_slot(inout nb_leg leg, nb_piece piece, int k, nb_ray ray)
{
    int at = int(nb_fog_slot(k).z);
    nb_vec4 extinction = NEBEL_FOG_TEXEL(at);
    nb_vec3 light = nb_light_per_metre(at, nb_slot_radiance(k, at));
    nb_vec3 glow = nb_splat3(0.0);
    if (nb_is_sunlit(leg)) glow = nb_sunlit_radiance(at, ray.direction) * extinction.xyz;
    bool curved = NB_HAS(NB_HAS_ALTITUDE) && int(extinction.w) == NB_KIND_ALTITUDE;
    nb_profile profile = nb_profile_of(at, int(extinction.w), ray, piece.start + (curved ? leg.from : 0.0));
    profile.offset += profile.slope * leg.from;
#if NB_DECLARES(NB_HAS_GRID)
    if (NB_HAS(NB_HAS_GRID) && profile.kind == NB_KIND_GRID) {
        nb_add_grid(leg, profile, extinction.xyz, light, glow, 0.5 * (piece.end - piece.start) - leg.from);
        return;
    }
#endif
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
    bool is_cut; /* there is more behind what it is all up to: */
    float reached;
};

nb_gathered nb_open_gathered()
{
    nb_gathered g;
    g.depth = nb_splat3(0.0);
    g.light = nb_splat3(0.0);
    g.radiance = nb_splat3(0.0);
    g.sunlight = nb_splat3(0.0);
    g.is_cut = false;
    g.reached = 0.0;
    return g;
}

void nb_keep_gathered(int count, nb_gathered g)
{
    nb_keep(count, 0, g.radiance, g.reached);
    nb_keep(count, 1, g.depth, 0.0);
    nb_keep(count, 2, g.light, 0.0);
    nb_keep(count, 3, g.sunlight, 0.0);
}

nb_gathered nb_kept_gathered(int count)
{
    nb_gathered g = nb_open_gathered();
    g.radiance = nb_kept_word(count, 0).xyz;
    g.reached = nb_kept_word(count, 0).w;
    g.depth = nb_kept_word(count, 1).xyz;
    g.light = nb_kept_word(count, 2).xyz;
    g.sunlight = nb_kept_word(count, 3).xyz;
    return g;
}

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
    nb_vec4 to_sun = NEBEL_FOG_TEXEL(NB_HEADER_SUN);
    bool height = int(to_sun.w) == NB_SUN_HEIGHT;
    /* Flat fog is asked beside the ends, as at a face itself the way to the sun may run along it, and only as far as light comes:
     * ways from deeper in endless fog end too early. */
    float within = min(40.0 / max(nb_smallest(leg.depth[NB_NODES - 1]), 1e-18), 1.0);
    float beside = 0.001 * within;
    nb_vec3 least = nb_splat3(NB_HUGE);
    nb_vec3 most = nb_splat3(0.0);
    nb_vec3 first = nb_splat3(0.0);
    nb_vec3 last = nb_splat3(0.0);
    for (int j = 0; j < (closed ? 2 : NB_NODES - 1); j++) {
        float share = !closed ? nb_leg_node(leg, j) : height ? float(j) : j == 0 ? beside : within - beside;
        nb_vec3 depth = nb_depth_to_sun(nb_spot_on(ray, piece.start, leg.from + leg.h * share));
        if (closed && j == 0) first = before + share * leg.depth[NB_NODES - 1] + depth;
        if (closed && j == 1) last = before + share * leg.depth[NB_NODES - 1] + depth;
        if (!closed) sum.light += leg.h * nb_leg_weight(leg, j) * leg.glow[j] * nb_exp3(-(before + leg.depth[j] + depth));
        least = min(least, depth);
        most = max(most, depth);
    }
    if (closed && !height) {
        nb_vec3 rise = (last - first) / (within - 2.0 * beside);
        first -= rise * beside;
        last = first + rise;
    }
    if (closed) {
        /* in height fog without a difference of depths, which may be beyond all numbers */
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
    next.most = leg.most;
    next.first_is_curved = !fits && leg.first_is_curved;
    next.last_is_curved = leg.last_is_curved;
    return next;
}

/* How far the next leg goes at most, and whether the sun lights it. `lit` is the host's last answer. */
void nb_plan_leg(inout nb_leg leg, nb_piece piece, nb_ray ray, inout nb_vec2 lit, inout int turns)
{
    float t = piece.start + leg.from;
    float near = nb_nearest(t);
    if (leg.number > 0 && leg.from < leg.stop - near) return;
    if (lit.y <= t + near) {
        turns -= NEBEL_SUN_VISIBILITY_ITERATIONS;
        lit = NEBEL_SUN_VISIBILITY(ray.origin, ray.direction, t + near, ray.t_max);
        turns += NEBEL_SUN_VISIBILITY_ITERATIONS;
        lit.y = max(lit.y, t + 2.0 * near);
    }
    leg.sunlight = lit.x;
    leg.first_is_curved = leg.number > 0 && leg.last_is_curved;
    leg.last_is_curved = false;
    leg.stop = min(piece.end, lit.y) - piece.start;
#if NB_DECLARES(NB_HAS_SUN)
    if (leg.sunlight > 0.0) {
        nb_turning turning = nb_find_turn(ray, t, piece.start + leg.stop);
        leg.stop = turning.next - piece.start;
        leg.last_is_curved = turning.curved;
#if NB_DECLARES(NB_HAS_GRID)
        if (NB_HAS(NB_HAS_GRID)) leg.most = nb_most_in_shadow(ray, 0.5 * (t + turning.next));
#endif
    }
#endif
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
#if NB_DECLARES(NB_HAS_SUN)
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
#endif
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
    int media = NB_HAS(NB_HAS_SEVERAL) ? int(NEBEL_FOG_TEXEL(0).x) : 1;
    int way = 2 + (NB_HAS(NB_HAS_GROUP) ? 16 : 0) + (NB_HAS(NB_HAS_PLANES) ? 12 : 0) + (NB_HAS(NB_HAS_SOFT) ? 8 : 0);
    int search = NB_MAX_PASSED + (NB_HAS(NB_HAS_PLANES) ? 32 : 0);
    return media * (search + (nb_sun_is_closed() ? 2 : NB_NODES - 1) * way);
}
