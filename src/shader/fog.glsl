/* The march in shading languages: what src/march does, for one ray, from the words of layout.h.
 *
 * Transmittance is a plain sum over media, and so is light where one medium or one radiance is met: most rays end there
 * (nb_sum_media). Where light of different colour mixes, or one medium takes away another's fog, nb_walk goes from event to event with a few slots
 * as memory; rays that meet more volumes than there are slots walk in windows, and through places where more overlap than that
 * they read everything again for each step: slower, never wrong.
 *
 * Everything is written for GLSL ES 3.00 and HLSL alike. Constant conditions on NB_HAS() leave out what NEBEL_FEATURES says that
 * the fog does not have. */
#ifndef NEBEL_FEATURES
#define NEBEL_FEATURES NB_HAS_ALL
#endif
#ifndef NEBEL_MOST_LIGHT
#define NEBEL_MOST_LIGHT 65504.0
#endif
#define NB_HAS(feature) ((NEBEL_FEATURES & (feature)) != 0)

struct nebel_light {
    nb_vec3 transmittance;
    nb_vec3 in_scattering;
};

struct nb_ray {
    nb_vec3 origin;
    nb_vec3 direction;
    float t_max;
    bool from_eye; /* distances along it count */
};

nb_vec3 nb_splat3(float x) { return nb_vec3(x, x, x); }
nb_vec3 nb_exp3(nb_vec3 v) { return nb_vec3(nb_exp(v.x), nb_exp(v.y), nb_exp(v.z)); }
nb_vec3 nb_exp_ratio3(nb_vec3 v) { return nb_vec3(nb_exp_ratio(v.x), nb_exp_ratio(v.y), nb_exp_ratio(v.z)); }
float nb_largest(nb_vec3 v) { return max(max(v.x, v.y), v.z); }
float nb_smallest(nb_vec3 v) { return min(min(v.x, v.y), v.z); }

/* ---- shapes ------------------------------------------------------------------------------------------------------------ */

/* The ray in a leaf's frame, without the way to the frame's origin. */
nb_ray nb_turned_ray(int leaf, bool turned, nb_ray ray)
{
    nb_ray local = ray;
    if (NB_HAS(NB_HAS_TURNED) && turned) {
        nb_vec3 x = NEBEL_WORD(leaf + 3).xyz;
        nb_vec3 y = NEBEL_WORD(leaf + 4).xyz;
        nb_vec3 z = NEBEL_WORD(leaf + 5).xyz;
        local.origin = nb_vec3(dot(x, ray.origin), dot(y, ray.origin), dot(z, ray.origin));
        local.direction = nb_vec3(dot(x, ray.direction), dot(y, ray.direction), dot(z, ray.direction));
    }
    return local;
}

/* See nb_face in src/media/volume.h: whose ray it is that lies in a face. */
float nb_face_tie(nb_vec3 normal)
{
    return normal.x != 0.0 ? normal.x : normal.y != 0.0 ? normal.y : normal.z;
}

nb_interval nb_planes_interval(int first, int count, nb_ray ray)
{
    nb_interval span = nb_interval_all();
    for (int i = 0; i < count; i++) {
        nb_vec4 face = NEBEL_WORD(first + i);
        span = nb_interval_meet(span, nb_interval_half_space(ray.origin, ray.direction, face.xyz, face.w,
                                                             nb_face_tie(face.xyz), 0.0, 8.0 * NB_EPSILON));
    }
    return span;
}

/* Makes the noise in the formulas of curved shapes 0: the ends as float has them, none widened by what it may have lost. */
#define NB_NO_REACH (-NB_WEPSILON)

nb_interval nb_leaf_interval(int leaf, nb_ray ray)
{
    nb_vec4 head = NEBEL_WORD(leaf);
    int type = int(head.x);
    bool turned = type >= NB_TYPE_TURNED;
    if (turned) type -= NB_TYPE_TURNED;
    nb_interval span = nb_interval_all();
    if (NB_HAS(NB_HAS_PLANES) && type == NB_TYPE_PLANES) {
        span = nb_planes_interval(int(head.z), int(head.y), ray);
    } else if (type != NB_TYPE_WORLD) {
        nb_ray local = nb_turned_ray(leaf, turned, ray);
        nb_vec3 d = local.direction;
        nb_vec3 place = NEBEL_WORD(leaf + 1).xyz;
        nb_vec3 p = local.origin + place;
        if (NB_HAS(NB_HAS_BOX) && type == NB_TYPE_BOX)
            span = nb_interval_box(local.origin, d, place, NEBEL_WORD(leaf + 2).xyz, 0.0);
        else if (NB_HAS(NB_HAS_BALL) && type == NB_TYPE_BALL)
            span = nb_interval_ball(p, d, head.y, NB_NO_REACH);
        else if (NB_HAS(NB_HAS_TUBE) && type == NB_TYPE_TUBE)
            span = nb_interval_tube(p, d, NB_NO_REACH);
        else if (NB_HAS(NB_HAS_CONE) && type == NB_TYPE_CONE)
            span = nb_interval_cone(p, d, head.y, head.z, NB_NO_REACH);
        else if (NB_HAS(NB_HAS_CAPSULE) && type == NB_TYPE_CAPSULE)
            span = nb_interval_capsule(p, d, head.y, NB_NO_REACH);
    }
    return span;
}

/* A stretch of the ray on which it is inside a body; none where not enter < leave. */
struct nb_stretch {
    float enter, leave;
};

nb_stretch nb_stretch_of(float enter, float leave)
{
    nb_stretch s;
    s.enter = enter;
    s.leave = leave;
    return s;
}

/* Where a body of several leaves, the first at `leaf`, next has the ray inside at or behind `from`: from event to event of its
 * leaves. The program's stack is the bits of an int. */
nb_stretch nb_group_stretch(int leaf, int count, nb_ray ray, float from)
{
    float begin = -1.0;
    float t = from;
    while (t < ray.t_max) {
        float next = ray.t_max;
        int stack = 0;
        for (int i = 0; i < count; i++) {
            int at = leaf + NB_LEAF_WORDS * i;
            nb_interval span = nb_leaf_interval(at, ray);
            bool some = span.enter < span.leave;
            if (some && span.enter > t) next = min(next, span.enter);
            if (some && span.leave > t) next = min(next, span.leave);
            stack = (stack << 1) | (span.enter <= t && span.leave > t ? 1 : 0);
            for (int folds = int(NEBEL_WORD(at).w); folds > 1; folds >>= 1) {
                int top = stack & 1;
                stack >>= 1;
                stack = (folds & 1) != 0 ? stack & (top | ~1) : stack | top;
            }
        }
        bool inside = (stack & 1) != 0;
        if (inside && begin < 0.0) begin = t;
        if (!inside && begin >= 0.0) return nb_stretch_of(begin, t);
        t = next;
    }
    return nb_stretch_of(begin < 0.0 ? ray.t_max : begin, ray.t_max);
}

/* Where the body of a medium next has the ray inside, at or behind `from`. */
nb_stretch nb_next_stretch(int medium, int leaves, nb_ray ray, float from)
{
    int at = medium + NB_MEDIUM_LEAF;
    nb_stretch s;
    if (NB_HAS(NB_HAS_DISTANCES) && ray.from_eye) {
        from = max(from, NEBEL_WORD(medium + NB_MEDIUM_START).w);
        ray.t_max = min(ray.t_max, NEBEL_WORD(medium + NB_MEDIUM_CUTOFF).w);
    }
    if (NB_HAS(NB_HAS_GROUP) && leaves > 1) {
        nb_vec4 low = NEBEL_WORD(at);
        nb_interval bounds = nb_interval_box(ray.origin, ray.direction, low.xyz, NEBEL_WORD(at + 1).xyz, 0.0);
        s = nb_stretch_of(from, from);
        if (max(bounds.enter, from) < min(bounds.leave, ray.t_max)) s = nb_group_stretch(int(low.w), leaves, ray, from);
    } else {
        nb_interval span = nb_leaf_interval(at, ray);
        s = nb_stretch_of(max(span.enter, from), min(span.leave, ray.t_max));
    }
    return s;
}

/* ---- profiles ---------------------------------------------------------------------------------------------------------- */

/* A medium's density in coordinates along the ray, offset + slope s, s metres behind where it was asked for. */
struct nb_profile {
    int kind;
    nb_vec3 offset;
    nb_vec3 slope;
    nb_vec3 size;  /* soft edge: half widths */
    float level;   /* gaussian: m; radial: c */
};

/* Distance, in units of `scale`, from the closest approach of p + t d to the origin: coordinates along and square across. */
nb_profile nb_round_profile(nb_profile profile, nb_vec3 p, nb_vec3 d, float scale, float start)
{
    float square = dot(d, d);
    float closest = -dot(p, d) / max(square, NB_TINY);
    nb_vec3 q = (p + d * closest) * scale;
    profile.slope.x = sqrt(square) * scale;
    profile.offset.x = (start - closest) * profile.slope.x;
    profile.level = min(dot(q, q), 1e9);
    return profile;
}

nb_profile nb_leaf_profile(nb_profile profile, int leaf, float width, nb_ray ray, float start)
{
    nb_vec4 head = NEBEL_WORD(leaf);
    nb_ray local = nb_turned_ray(leaf, int(head.x) >= NB_TYPE_TURNED, ray);
    nb_vec3 place = NEBEL_WORD(leaf + 1).xyz;
    if (NB_HAS(NB_HAS_RADIAL) && profile.kind >= NB_KIND_RADIAL) {
        profile = nb_round_profile(profile, local.origin + place, local.direction, 1.0 / head.y, start);
        profile.level = 1.0 - profile.level;
    } else if (NB_HAS(NB_HAS_SOFT_EDGE)) {
        nb_vec3 high = NEBEL_WORD(leaf + 2).xyz;
        profile.offset = (local.origin + local.direction * start - (place + high) * 0.5) * width;
        profile.slope = local.direction * width;
        profile.size = (high - place) * (0.5 * width);
    }
    return profile;
}

nb_profile nb_profile_of(int medium, int kind, nb_ray ray, float start)
{
    nb_profile profile;
    profile.kind = kind;
    profile.offset = nb_splat3(0.0);
    profile.slope = nb_splat3(0.0);
    profile.size = nb_splat3(0.0);
    profile.level = 0.0;
    if (NB_HAS(NB_HAS_PROFILE) && kind != NB_KIND_CONSTANT && kind != NB_KIND_EXCLUDE) {
        nb_vec4 word = NEBEL_WORD(medium + 3);
        if (NB_HAS(NB_HAS_SLOPE) && kind <= NB_KIND_LINEAR) {
            profile.slope.x = dot(word.xyz, ray.direction);
            profile.offset.x = word.w + dot(word.xyz, ray.origin) + profile.slope.x * start;
        } else if (NB_HAS(NB_HAS_GAUSSIAN) && kind == NB_KIND_GAUSSIAN) {
            profile = nb_round_profile(profile, word.xyz + ray.origin, ray.direction, word.w, start);
        } else {
            profile = nb_leaf_profile(profile, medium + NB_MEDIUM_LEAF, word.w, ray, start);
        }
    }
    return profile;
}

float nb_density(nb_profile profile, float s)
{
    float density = 1.0;
    if (NB_HAS(NB_HAS_PROFILE)) {
        int kind = profile.kind;
        float u = profile.offset.x + profile.slope.x * s;
        if (NB_HAS(NB_HAS_SLOPE) && kind == NB_KIND_HEIGHT)
            density = nb_height_density(u);
        else if (NB_HAS(NB_HAS_SLOPE) && kind == NB_KIND_HEIGHT_CAPPED)
            density = nb_height_capped_density(u);
        else if (NB_HAS(NB_HAS_SLOPE) && kind == NB_KIND_LINEAR)
            density = nb_linear_density(u);
        else if (NB_HAS(NB_HAS_GAUSSIAN) && kind == NB_KIND_GAUSSIAN)
            density = nb_gaussian_density(profile.level, u);
        else if (NB_HAS(NB_HAS_SOFT_EDGE) && kind == NB_KIND_SOFT_EDGE)
            density = nb_soft_edge_density(profile.offset + profile.slope * s, profile.size);
        else if (NB_HAS(NB_HAS_RADIAL) && kind >= NB_KIND_RADIAL && kind < NB_KIND_EXCLUDE)
            density = nb_radial_density(profile.level, u, kind - NB_KIND_RADIAL + 1);
    }
    return density;
}

/* The density integrated from where the profile was asked for over h metres. */
float nb_integral(nb_profile profile, float h)
{
    float integral = h;
    if (NB_HAS(NB_HAS_PROFILE)) {
        int kind = profile.kind;
        float u = profile.offset.x;
        float slope = profile.slope.x;
        if (NB_HAS(NB_HAS_SLOPE) && kind != NB_KIND_CONSTANT && kind <= NB_KIND_HEIGHT_CAPPED) {
            /* from the dense end, where a ray comes down from so far that its start has lost the digits of the height */
            float end = u + slope * h;
            bool down = slope < 0.0 && abs(end) < abs(u);
            float from = down ? end : u;
            float rise = down ? -slope : slope;
            if (kind == NB_KIND_HEIGHT)
                integral = nb_height_integral(from, rise, h).value;
            else
                integral = nb_height_capped_integral(from, rise, h).value;
        } else if (NB_HAS(NB_HAS_SLOPE) && kind == NB_KIND_LINEAR) {
            integral = nb_linear_integral(u, slope, h).value;
        } else if (NB_HAS(NB_HAS_GAUSSIAN) && kind == NB_KIND_GAUSSIAN) {
            integral = nb_gaussian_integral(profile.level, u, u + slope * h, slope).value;
        } else if (NB_HAS(NB_HAS_SOFT_EDGE) && kind == NB_KIND_SOFT_EDGE) {
            integral = nb_soft_edge_integral(profile.offset, profile.slope, profile.size, h).value;
        } else if (NB_HAS(NB_HAS_RADIAL) && kind >= NB_KIND_RADIAL && kind < NB_KIND_EXCLUDE) {
            integral = nb_radial_integral(profile.level, u, slope, h, kind - NB_KIND_RADIAL + 1).value;
        }
    }
    return integral;
}

/* ---- sums over media --------------------------------------------------------------------------------------------------- */

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
    bool any = false;
    bool covering = false;
    for (int i = 0; i < count; i++) {
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
            sum.radiance = radiance.xyz;
            sum.depth += extinction.xyz * length;
            sum.light += light.xyz * length;
        }
    }
    return sum;
}

/* ---- the walk ---------------------------------------------------------------------------------------------------------- */

/* Stretches that the walk keeps at hand: the next ones of their media. */
#define NB_SLOTS 16
NB_GLOBAL int nb_slot_medium[NB_SLOTS];
NB_GLOBAL float nb_slot_enter[NB_SLOTS];
NB_GLOBAL float nb_slot_leave[NB_SLOTS];

void nb_set_slot(int k, int medium, nb_stretch s)
{
    nb_slot_medium[k] = medium;
    nb_slot_enter[k] = s.enter;
    nb_slot_leave[k] = s.leave;
}

int nb_farthest_slot()
{
    int farthest = 0;
    for (int k = 1; k < NB_SLOTS; k++)
        if (nb_slot_enter[k] > nb_slot_enter[farthest]) farthest = k;
    return farthest;
}

/* What the slots hold: `used` of them, of the media before `rest` in the list, right until `end`. */
struct nb_window {
    int used;
    int rest;
    float end;
};

/* Stretches behind t. The nearest of all media; or in a crowd, where more begin at t than there are slots, those of the media
 * from `begin` on until the slots are full. A stretch of a body of several leaves ends the window: another may follow. */
nb_window nb_fill_slots(nb_ray ray, int first, int count, bool listed, int begin, float t, bool crowd)
{
    nb_window window;
    window.used = 0;
    window.rest = count;
    window.end = ray.t_max;
    for (int i = begin; i < count; i++) {
        if (crowd && window.used == NB_SLOTS) {
            window.rest = i;
            break;
        }
        int at = nb_medium_at(first + i, listed);
        int leaves = int(NEBEL_WORD(at + 2).w);
        nb_stretch s = nb_next_stretch(at, leaves, ray, t);
        if (!(s.enter < s.leave)) continue;
        if (NB_HAS(NB_HAS_GROUP) && leaves > 1) window.end = min(window.end, s.leave);
        if (window.used < NB_SLOTS) {
            nb_set_slot(window.used, at, s);
            window.used++;
            continue;
        }
        int farthest = nb_farthest_slot();
        float dropped = nb_slot_enter[farthest];
        if (s.enter < dropped)
            nb_set_slot(farthest, at, s);
        else
            dropped = s.enter;
        window.end = min(window.end, dropped);
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

bool nb_is_in_slot(int k, float t)
{
    return nb_slot_enter[k] <= t && nb_slot_leave[k] > t;
}

bool nb_is_covered(int medium, int floor)
{
    return NB_HAS(NB_HAS_COVER) && int(NEBEL_WORD(medium + 1).w) / NB_LIGHT_RANK < floor;
}

/* Finds what covers among the slots. Media come by rank, those that cover first, so that what earlier slots added up to ranks below a
 * new floor. */
nb_piece nb_cover_piece(nb_piece piece, int used)
{
    int floor = piece.floor;
    for (int k = 0; k < used; k++) {
        int flags = int(NEBEL_WORD(nb_slot_medium[k] + 1).w);
        if ((flags & NB_LIGHT_COVERS) != 0 && nb_is_in_slot(k, piece.start)) floor = max(floor, flags / NB_LIGHT_RANK);
    }
    if (floor > piece.floor) {
        float end = piece.end;
        piece = nb_open_piece(piece.start, end);
        piece.floor = floor;
    }
    return piece;
}

nb_piece nb_note_slot(nb_piece piece, int k, nb_ray ray)
{
    float enter = nb_slot_enter[k];
    float leave = nb_slot_leave[k];
    if (enter > piece.start) piece.end = min(piece.end, enter);
    if (leave > piece.start) piece.end = min(piece.end, leave);
    int at = nb_slot_medium[k];
    if (nb_is_in_slot(k, piece.start) && !nb_is_covered(at, piece.floor)) {
        nb_vec4 extinction = NEBEL_WORD(at);
        nb_vec4 light = NEBEL_WORD(at + 1);
        nb_vec3 radiance = NEBEL_WORD(at + 2).xyz;
        int kind = int(extinction.w);
        if (!NB_HAS(NB_HAS_COVER) || kind != NB_KIND_EXCLUDE) {
            piece.present++;
            piece.emits = piece.emits || (int(light.w) & NB_LIGHT_EMITS) != 0;
            piece.least = min(piece.least, radiance);
            piece.most = max(piece.most, radiance);
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

/* A leg, one step of h metres, `from` metres behind the start of its piece: optical depth up to each node and light there, and all its
 * light if nothing attenuated it. Steps without mixed light know the last node only. */
struct nb_leg {
    float from, h;
    bool mixed;
    nb_vec3 depth[NB_NODES];
    nb_vec3 density[NB_NODES];
    nb_vec3 light;
};

void nb_open_leg(inout nb_leg leg)
{
    leg.light = nb_splat3(0.0);
    for (int j = 0; j < NB_NODES; j++) {
        leg.depth[j] = nb_splat3(0.0);
        leg.density[j] = nb_splat3(0.0);
    }
}

void nb_add_slot(inout nb_leg leg, nb_piece piece, int k, nb_ray ray)
{
    int at = nb_slot_medium[k];
    nb_vec4 extinction = NEBEL_WORD(at);
    nb_vec3 light = NEBEL_WORD(at + 1).xyz;
    nb_profile profile = nb_profile_of(at, int(extinction.w), ray, piece.start);
    profile.offset += profile.slope * leg.from;
    for (int j = leg.mixed ? 0 : NB_NODES - 1; j < NB_NODES; j++) {
        float s = leg.h * nb_node(j);
        float length = nb_integral(profile, s);
        leg.depth[j] += extinction.xyz * length;
        leg.density[j] += light * nb_density(profile, s);
        if (j == NB_NODES - 1) leg.light += light * length;
    }
}

/* Light through what lies before it, if the quotient of light and extinction were the same all along the leg. */
nb_vec3 nb_step_light_even(nb_vec3 light, nb_vec3 depth, nb_vec3 before)
{
    return nb_exp3(-before) * light * nb_exp_ratio3(depth);
}

nb_vec3 nb_step_light_mixed(nb_leg leg, nb_vec3 before)
{
    nb_vec3 sum = nb_splat3(0.0);
    for (int j = 0; j < NB_NODES; j++) sum += nb_weight(j) * leg.density[j] * nb_exp3(-(before + leg.depth[j]));
    return sum * leg.h;
}

/* How far nb_step_light_even may be off where that quotient varies within `spread`: most if all the brighter light came first.
 * Then s / 2 (1 - e^-x/2)^2 of optical depth x; and never more than half of what the step takes of its own light. */
float nb_even_error(nb_vec3 light, nb_vec3 depth, nb_vec3 before, nb_vec3 spread)
{
    nb_vec3 through = nb_exp3(-0.5 * depth);
    nb_vec3 lost = nb_splat3(1.0) - through;
    nb_vec3 taken = nb_splat3(1.0) - through * through;
    return nb_largest(nb_exp3(-before) * min(0.5 * spread * lost * lost, 0.5 * light * taken));
}

/* What one step of the rule bears: so much of optical depth and of change of the densities' logarithm together. */
#define NB_STEP_BEARS 2.0
#define NB_MOST_STEPS 32
#define NB_OPAQUE 17.0

nebel_light nb_walk(nb_ray ray, int first, int count, bool listed, bool lit)
{
    nb_vec3 depth = nb_splat3(0.0);
    nb_vec3 radiance = nb_splat3(0.0);
    float tolerance = NEBEL_WORD(0).y;
    float t = 0.0;
    bool crowd = false;
    bool stepping = false; /* within a piece of varying density; else on the way to the end of a piece */
    int steps = 0;
    nb_piece piece = nb_open_piece(0.0, 0.0);
    nb_leg leg;
    leg.from = 0.0;
    leg.h = 0.0;
    leg.mixed = false;
    nb_open_leg(leg);
    nb_window window;
    window.used = 0;
    window.rest = count;
    window.end = 0.0;
    while (t < ray.t_max && nb_smallest(depth) < NB_OPAQUE) {
        if (stepping)
            nb_open_leg(leg);
        else
            piece = nb_open_piece(t, ray.t_max);
        bool stale = crowd || t >= window.end;
        int next = 0;
        while (next < count) {
            if (stale) {
                window = nb_fill_slots(ray, first, count, listed, next, t, crowd);
                if (!crowd && window.end <= t) {
                    crowd = true;
                    continue;
                }
            }
            next = window.rest;
            piece.end = min(piece.end, window.end);
            if (NB_HAS(NB_HAS_COVER) && !stepping) piece = nb_cover_piece(piece, window.used);
            for (int k = 0; k < window.used; k++) {
                if (!stepping)
                    piece = nb_note_slot(piece, k, ray);
                else if (nb_is_in_slot(k, piece.start) && !nb_is_covered(nb_slot_medium[k], piece.floor))
                    nb_add_slot(leg, piece, k, ray);
            }
        }
        float length = piece.end - piece.start;
        bool over = true;
        if (stepping) {
            nb_vec3 within = leg.depth[NB_NODES - 1];
            float rest = length - leg.from;
            nb_vec3 spread = piece.emits ? nb_splat3(NB_HUGE) : piece.most - piece.least;
            float strain = nb_largest(within) + piece.rate * leg.h;
            bool even = !leg.mixed || steps >= NB_MOST_STEPS || nb_even_error(leg.light, within, depth, spread) <= tolerance;
            bool fits = even || strain <= NB_STEP_BEARS;
            float h = leg.h;
            if (fits) {
                if (lit) radiance += even ? nb_step_light_even(leg.light, within, depth) : nb_step_light_mixed(leg, depth);
                depth += within;
                leg.from += h;
                rest -= h;
                over = rest <= length * (4.0 * NB_EPSILON);
                h = even ? rest : h * min(2.0, 0.9 * NB_STEP_BEARS / strain);
            } else {
                over = false;
                /* first so short that the densities hardly change: then optical depth is in proportion to length */
                bool steep = piece.rate * h > 0.6 * NB_STEP_BEARS;
                h = steep ? 0.5 * NB_STEP_BEARS / piece.rate : h * (0.9 * NB_STEP_BEARS / strain);
            }
            steps++;
            leg.h = steps >= NB_MOST_STEPS ? rest : min(h, rest);
        } else if (piece.present > 0) {
            if (NB_HAS(NB_HAS_PROFILE) && piece.varies) {
                over = false;
                stepping = true;
                steps = 0;
                leg.from = 0.0;
                leg.h = length;
                leg.mixed = lit && piece.present > 1 && (piece.emits || nb_largest(piece.most - piece.least) > 0.0);
            } else {
                nb_vec3 within = piece.extinction * length;
                if (lit) radiance += nb_step_light_even(piece.light * length, within, depth);
                depth += within;
            }
        }
        if (over) {
            t = piece.end;
            stepping = false;
            if (crowd) window.end = t;
            crowd = false;
        }
    }
    nebel_light light;
    light.transmittance = nb_exp3(-depth);
    light.in_scattering = radiance;
    return light;
}

/* ---- the face ---------------------------------------------------------------------------------------------------------- */

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
    if (ray.t_max > 0.0 && dot(direction, direction) > 0.0) {
        nb_media_sum sum = nb_sum_media(ray, first, count, listed);
        light.transmittance = nb_exp3(-sum.depth);
        light.in_scattering = sum.light * nb_exp_ratio3(sum.depth);
        bool covers = NB_HAS(NB_HAS_COVER) && sum.met && sum.covers;
        if (covers || (NB_HAS(NB_HAS_MIXED) && lit && sum.mixed)) {
            nebel_light walked = nb_walk(ray, first, count, listed, lit);
            light.in_scattering = walked.in_scattering;
            if (covers) light.transmittance = walked.transmittance;
        }
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
