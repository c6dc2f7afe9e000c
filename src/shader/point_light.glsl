/* Light of point lights that fog scatters towards the eye, once, as src/trace/trace_point_light.h has it: steps of
 * equal angles as the point light sees them (formulas/point_light.inc), Kronrod's seven nodes compared with the three
 * of Gauss's rule among them, a step made shorter until they agree.
 *
 * What surfaces keep away is the host's to say, by a function that it defines before this text:
 *
 *     #define NEBEL_LIGHT_VISIBILITY(light, origin, direction, t, end)
 *
 * is a vec2: the share of the light of point light number `point_light` that reaches the ray from t on, and up to
 * where along the ray that holds, at most `end`. */
#ifndef NEBEL_LIGHT_VISIBILITY
#define NEBEL_LIGHT_VISIBILITY(point_light, origin, direction, t, end) nb_vec2(1.0, end)
#endif

/* How far along a ray light of point lights has been found. */
struct nb_light_state {
    float reached;
    float most; /* metres that a piece may take; 0: any number */
    nb_vec3 before; /* depth up to there */
    nb_vec3 light;
};

nb_light_state nb_start_lights()
{
    nb_light_state l;
    l.reached = 0.0;
    l.most = 0.0;
    l.before = nb_splat3(0.0);
    l.light = nb_splat3(0.0);
    return l;
}

#if NB_DECLARES(NB_HAS_LIGHTS)

/* A point light that is passed by a ray. */
struct nb_light_pass {
    int number;
    nb_vec3 intensity, axis;
    float radius2, clear, edge, inner, rise;
    nb_vec3 foot;   /* from the point light to the place closest to it on the line of the ray */
    float closest;  /* where that is, m along the ray */
    float aside2;   /* its distance squared */
    float aside;    /* its distance, at least the point light's radius */
};

nb_light_pass nb_pass_light(nb_ray ray, int number)
{
    int at = int(NEBEL_FOG_TEXEL(NB_HEADER_LIGHTS).w) + NB_LIGHT_TEXELS * number;
    nb_vec4 place = NEBEL_FOG_TEXEL(at);
    nb_vec4 intensity = NEBEL_FOG_TEXEL(at + 1);
    nb_vec4 axis = NEBEL_FOG_TEXEL(at + 2);
    nb_vec4 cone = NEBEL_FOG_TEXEL(at + 3);
    nb_vec3 apart = ray.origin - place.xyz;
    nb_light_pass by;
    by.number = number;
    by.intensity = intensity.xyz;
    by.axis = axis.xyz;
    by.radius2 = place.w;
    by.clear = intensity.w;
    by.edge = axis.w;
    by.inner = cone.y;
    by.rise = cone.x;
    by.closest = -dot(apart, ray.direction);
    by.foot = apart + ray.direction * by.closest;
    by.aside2 = dot(by.foot, by.foot);
    by.aside = sqrt(max(by.aside2, by.radius2));
    return by;
}

/* The most irradiance between two places, times the length over which it may last: an angle over a distance. */
float nb_most_fluence(nb_light_pass by, float start, float end)
{
    float nearest = clamp(by.closest, start, end) - by.closest;
    return nb_light_fluence(by.aside2 + nearest * nearest, by.radius2) * nb_largest(by.intensity);
}

/* The first root of a u^2 + 2 b u + c behind t, u from the closest place on, or `end`. */
float nb_root_behind(float closest, float t, float end, float a, float b, float c)
{
    float square = b * b - a * c;
    float next = end;
    if (square >= 0.0) {
        float root = sqrt(square);
        float sum = -(b + (b < 0.0 ? -root : root));
        float one = closest + sum * nb_rcp_bounded(a);
        float other = closest + c * nb_rcp_bounded(sum);
        if (one > t) next = min(next, one);
        if (other > t) next = min(next, other);
    }
    return next;
}

/* Where the ray next enters or leaves the point light, or the light of its cone changes otherwise. */
float nb_light_turn(nb_light_pass by, nb_ray ray, float t, float end)
{
    float near = t + nb_nearest(t);
    float next = nb_root_behind(by.closest, near, end, 1.0, 0.0, by.aside2 - by.radius2);
    if (by.edge > -1.0) {
        float f = dot(by.foot, by.axis);
        float d = dot(ray.direction, by.axis);
        float edge2 = by.edge * by.edge;
        float inner2 = by.inner * by.inner;
        next = nb_root_behind(by.closest, near, next, d * d - edge2, f * d, f * f - edge2 * by.aside2);
        next = nb_root_behind(by.closest, near, next, d * d - inner2, f * d, f * f - inner2 * by.aside2);
    }
    return next;
}

/* ---- media ----------------------------------------------------------------------------------- */

/* A piece of the ray on which the same media are there, at and behind `start`. */
struct nb_light_segment {
    float start, end;
    int floor;        /* what ranks lower is covered */
    int media;        /* how many to ask: those in slots, or in an overflow all */
    bool overflow;
    bool scatters;
    nb_vec3 depth;    /* of all of it */
    float scatter;    /* radiance per irradiance that opaque fog of it gives at most */
    float ahead, back; /* how wide the sharpest peaks of phase functions are, tangents of half an angle */
};

/* Of all lobes at their peaks, of either side. */
float nb_most_scattered(int scattering)
{
    nb_vec4 albedo = NEBEL_FOG_TEXEL(scattering);
    float most = 0.0;
    for (int i = 1; i <= int(albedo.w); i++) {
        nb_vec4 lobe = NEBEL_FOG_TEXEL(scattering + i);
        most += lobe.x * (1.0 + lobe.y) / (lobe.z * sqrt(lobe.z));
    }
    return most * nb_largest(albedo.xyz);
}

/* A lobe is (peak + slope (1 - cosine))^-1.5, of which the cosine is (1 - u u) / (1 + u u), u the tangent of half the angle from its peak:
 * up to u = width it hardly falls. */
void nb_narrow_peaks(int scattering, inout nb_light_segment piece)
{
    int lobes = int(NEBEL_FOG_TEXEL(scattering).w);
    for (int i = 1; i <= lobes; i++) {
        nb_vec4 lobe = NEBEL_FOG_TEXEL(scattering + i);
        float width = sqrt(lobe.z / (lobe.z + 2.0 * abs(lobe.w)));
        if (lobe.w > 0.0) piece.ahead = min(piece.ahead, width);
        if (lobe.w < 0.0) piece.back = min(piece.back, width);
    }
}

/* Word of the medium number `i` of a piece; where they are more than there are slots each is asked whether it is there, 0: it is not. */
int nb_light_medium(nb_ray ray, int first, bool listed, nb_light_segment piece, int i, inout int turns)
{
    int at = 0;
    if (!piece.overflow) {
        at = int(nb_fog_slot(i).z);
    } else {
        int asked = nb_medium_at(first + i, listed);
        int leaves = int(NEBEL_FOG_TEXEL(asked + 2).w);
        nb_stretch s = nb_next_stretch(asked, leaves, ray, piece.start);
        turns += nb_stretch_turns(leaves, s);
        if (s.enter <= piece.start && s.leave > piece.start) at = asked;
        if (int(NEBEL_FOG_TEXEL(asked).w) == NB_KIND_EXCLUDE || nb_is_covered(asked, piece.floor)) at = 0;
    }
    return at;
}

/* Keeps what is not covered. */
int nb_drop_covered(int used, int floor)
{
    int kept = 0;
    for (int i = 0; i < used; i++) {
        nb_vec3 slot = nb_fog_slot(i);
        int at = int(slot.z);
        if (nb_is_covered(at, floor) || int(NEBEL_FOG_TEXEL(at).w) == NB_KIND_EXCLUDE) continue;
        nb_set_slot(kept, at, nb_stretch_of(slot.x, slot.y));
        kept++;
    }
    return kept;
}

/* Pieces end where a density is not smooth, so that a first step begins with the fog, and at the faces of bricks: depths from the start
 * of a piece are sums over a few cells then. */
float nb_smooth_length(nb_ray ray, int medium, float t)
{
    int kind = int(NEBEL_FOG_TEXEL(medium).w);
    nb_profile profile = nb_profile_of(medium, kind, ray, t);
    float length = NB_FAR;
#if NB_DECLARES(NB_HAS_GRID)
    if (NB_HAS(NB_HAS_GRID) && kind == NB_KIND_GRID)
        length = nb_grid_faces(profile.offset, profile.slope, NB_BRICK, nb_nearest(t));
    else
#endif
        length = nb_profile_kink(profile, nb_nearest(t));
    return length;
}

/* `end`: it goes no farther. */
nb_light_segment nb_next_piece(nb_ray ray, int first, int count, bool listed, float t, float end, inout int turns)
{
    nb_light_segment piece;
    piece.start = t;
    piece.end = end;
    piece.floor = 0;
    piece.media = 0;
    piece.overflow = false;
    piece.scatters = false;
    piece.depth = nb_splat3(0.0);
    piece.scatter = 0.0;
    piece.ahead = 1.0;
    piece.back = 1.0;
    for (int i = 0; i < count; i++) {
        int at = nb_medium_at(first + i, listed);
        int leaves = int(NEBEL_FOG_TEXEL(at + 2).w);
        nb_stretch s = nb_next_stretch(at, leaves, ray, t);
        turns += nb_stretch_turns(leaves, s);
        if (!(s.enter < s.leave)) continue;
        piece.end = min(piece.end, s.enter > t ? s.enter : s.leave);
        if (s.enter > t) continue;
        piece.end = min(piece.end, t + nb_smooth_length(ray, at, t));
        int flags = int(NEBEL_FOG_TEXEL(at + 1).w);
        if (NB_HAS(NB_HAS_OVERRIDE) && (flags & NB_LIGHT_COVERS) != 0) piece.floor = max(piece.floor, flags / NB_LIGHT_RANK);
        if (piece.media < NEBEL_MEDIUM_SLOTS) nb_set_slot(piece.media, at, s);
        piece.media++;
    }
    piece.overflow = piece.media > NEBEL_MEDIUM_SLOTS;
    if (NB_HAS(NB_HAS_OVERRIDE) && !piece.overflow) piece.media = nb_drop_covered(piece.media, piece.floor);
    if (piece.overflow) piece.media = count;
    for (int i = 0; i < piece.media; i++) {
        int at = nb_light_medium(ray, first, listed, piece, i, turns);
        turns += 1;
        if (at == 0) continue;
        nb_vec4 extinction = NEBEL_FOG_TEXEL(at);
        int scattering = int(NEBEL_FOG_TEXEL(at + NB_MEDIUM_SCATTERING).w);
        piece.depth += extinction.xyz * nb_integral(nb_profile_of(at, int(extinction.w), ray, t), piece.end - t);
        if (scattering > 0) {
            piece.scatters = true;
            piece.scatter = max(piece.scatter, nb_most_scattered(scattering));
            nb_narrow_peaks(scattering, piece);
        }
    }
    return piece;
}

/* What media make of light at a place of the piece, `from` metres behind its start: a skin of dense fog may be thinner than what places on
 * the ray are told apart by. */
struct nb_light_place {
    nb_vec3 depth;      /* from the start of the piece */
    nb_vec3 extinction;
    nb_vec3 glow;       /* radiance per metre and irradiance that comes from `towards` */
};

nb_light_place nb_place_in_piece(nb_ray ray, int first, bool listed, nb_light_segment piece, float from, nb_vec3 towards, inout int turns)
{
    nb_light_place place;
    place.depth = nb_splat3(0.0);
    place.extinction = nb_splat3(0.0);
    place.glow = nb_splat3(0.0);
    for (int i = 0; i < piece.media; i++) {
        int at = nb_light_medium(ray, first, listed, piece, i, turns);
        turns += 1;
        if (at == 0) continue;
        nb_vec4 extinction = NEBEL_FOG_TEXEL(at);
        nb_profile profile = nb_profile_of(at, int(extinction.w), ray, piece.start);
        int scattering = int(NEBEL_FOG_TEXEL(at + NB_MEDIUM_SCATTERING).w);
        nb_vec3 here = extinction.xyz * nb_density_beside(profile, from);
        place.depth += extinction.xyz * nb_integral(profile, from);
        place.extinction += here;
        if (scattering > 0) place.glow += here * NEBEL_FOG_TEXEL(scattering).xyz * nb_scattered(scattering, ray.direction, towards);
    }
    return place;
}

/* ---- steps ----------------------------------------------------------------------------------- */

/* Kronrod's extension of Gauss's rule of three nodes on [0, 1], whose nodes are the second, the middle and the last but one. Source:
 * Kronrod, Nodes and Weights of Quadrature Formulas, 1965. */
#define NB_LIGHT_NODES 7

float nb_light_node(int j)
{
    int k = j < 3 ? 3 - j : j - 3;
    float off = k == 0 ? 0.0 : k == 1 ? 0.21712187467340129 : k == 2 ? 0.38729833462074169 : 0.48024563435401014;
    return j < 3 ? 0.5 - off : 0.5 + off;
}

float nb_light_weight(int j)
{
    int k = j < 3 ? 3 - j : j - 3;
    return k == 0 ? 0.22545826932923707 : k == 1 ? 0.20069870738798111 : k == 2 ? 0.13424404493416672 : 0.052328113013233632;
}

float nb_light_weight_of_three(int j) { return j == 3 ? 8.0 / 18.0 : j == 1 || j == 5 ? 5.0 / 18.0 : 0.0; }

/* What a step's error may be of the light that is found so far. */
#define NB_LIGHT_SHARE 0.01

/* What is known of the place where a step begins, or of the one just behind it. */
struct nb_light_start {
    float from;    /* metres behind the start of the piece */
    nb_vec3 depth; /* from the eye */
    nb_vec3 way;   /* depth from there to the point light */
    bool is_known;
};

nb_light_start nb_open_start()
{
    nb_light_start start;
    start.from = 0.0;
    start.depth = nb_splat3(0.0);
    start.way = nb_splat3(0.0);
    start.is_known = false;
    return start;
}

struct nb_light_step {
    nb_vec3 light;
    float error;
    float steepness; /* by how much the logarithm of the light changes from the start to the first node */
    nb_light_start next; /* the end of the step */
};

/* From the last two nodes on to the end of a step. */
#define NB_BEHIND_NODES 0.21265858

/* What part of the light between two nodes they may not show, between which its logarithm changes so. */
float nb_unseen_share(float change)
{
    float share = min(change / 3.0, 1.0);
    return share * share * share * share * share * share;
}

/* Light of the first part of a swing, up to w = length, from `start.from` to `end` metres behind the start of the piece, of which `drop` of
 * transmittance is lost. `before` is the depth in front of the piece. Where nodes do not see that loss they have passed over what causes it, and light that changes by large factors from node to
 * node may be anywhere between them; what is between the start and the first node may be all the light there is. `start` is asked where
 * it is not known: a way to the point light may pass many voxels. */
nb_light_step nb_step_past_light(nb_ray ray, int first, bool listed, nb_light_segment piece, nb_light_pass by, nb_swing swing, float length,
                               float end, nb_vec3 before, nb_vec3 seen, nb_vec3 drop, inout nb_light_start start, inout int turns)
{
    nb_vec3 seven = nb_splat3(0.0);
    nb_vec3 three = nb_splat3(0.0);
    nb_vec3 taken = nb_splat3(0.0);
    nb_vec3 steepest = nb_splat3(0.0);
    nb_vec3 last_depth = start.depth;
    nb_vec3 last_way = start.way;
    float hidden = 0.0;
    nb_light_step s;
    s.steepness = 0.0;
    s.next = nb_open_start();
    for (int j = start.is_known ? 0 : -1; j < NB_LIGHT_NODES; j++) {
        float w = length * (j < 0 ? 1e-5 : nb_light_node(j));
        float way_along = min(nb_swing_way(swing, w), end - start.from);
        float from = start.from + way_along;
        float along = swing.along + way_along;
        nb_vec3 apart = by.foot + ray.direction * along;
        float square = dot(apart, apart);
        float distance = sqrt(square);
        nb_vec3 towards = apart * -nb_rcp_bounded(distance);
        float speed = (by.aside * by.aside + along * along) * nb_swing_rate(swing, w) * length;
        float cosine = -dot(towards, by.axis);
        float fluence = nb_light_fluence(square, by.radius2) * speed * nb_light_cone(cosine, by.edge, by.rise);
        nb_light_place place = nb_place_in_piece(ray, first, listed, piece, from, towards, turns);
        nb_vec3 depth = before + place.depth;
        nb_vec3 light = nb_splat3(0.0);
        nb_vec3 way = last_way;
        if (fluence > 0.0 || j < 0) {
            way = nb_depth_to_light(nb_spot_on(ray, piece.start, from), towards, max(distance - by.clear, 0.0), false, turns);
            light = place.glow * by.intensity * fluence * nb_exp3(-(depth + way));
        }
        if (j >= 0) {
            float change = nb_largest(abs((depth - last_depth) + (way - last_way)));
            nb_vec3 lost = max(nb_exp3(-last_depth) - nb_exp3(-depth), nb_splat3(0.0));
            hidden += nb_largest(lost * nb_exp3(-min(way, last_way))) * nb_unseen_share(change);
            if (j == 0) s.steepness = 2.0 * change; /* over a tenth of the step, as src/trace/trace_sun.h has it */
            s.next.way = max(way + (way - last_way) * NB_BEHIND_NODES, nb_splat3(0.0));
            s.next.is_known = fluence > 0.0;
            seven += nb_light_weight(j) * light;
            three += nb_light_weight_of_three(j) * light;
            taken += nb_light_weight(j) * speed * place.extinction * nb_exp3(-depth);
            steepest = max(steepest, from * place.extinction * nb_exp3(-depth));
        } else {
            start.depth = depth;
            start.way = way;
            start.is_known = true;
        }
        last_depth = depth;
        last_way = way;
    }
    float most = nb_most_fluence(by, swing.start, piece.start + end) * piece.scatter;
    nb_vec3 limit = most * (drop + 8.0 * NB_EPSILON * seen); /* also what rounds to nothing may be light */
    s.light = min(seven, limit);
    nb_vec3 rounding = NB_EPSILON * (8.0 * seen + 4.0 * steepest); /* of transmittance and of places */
    float unseen = nb_largest(abs(taken - drop) - rounding);
    s.error = max(nb_largest(abs(seven - three)), most * max(unseen, hidden));
    s.error = min(s.error, nb_largest(limit));
    return s;
}

/* Behind a point light nothing of its light is left [m]; squares of squares of it are numbers. */
#define NB_LIGHT_REACH 1e8

/* The length of a first step of a few optical depths: light in dense fog comes from there. Density may begin with nothing and grow. */
float nb_first_swing(nb_ray ray, int first, bool listed, nb_light_segment piece, nb_light_pass by, inout int turns)
{
    float length = min(piece.end - piece.start, NB_LIGHT_REACH);
    float deep = nb_largest(piece.depth);
    for (int i = 0; i < 24 && deep > 4.01; i++) {
        length *= max(4.0 / deep, 0.001);
        deep = nb_largest(nb_place_in_piece(ray, first, listed, piece, length, ray.direction, turns).depth);
    }
    float along = piece.start - by.closest;
    return nb_swing_over(by.aside, piece.start, along, along + length, length).end;
}

/* The end of a step on which phase functions change smoothly. `ahead` is the tangent of half the angle by which light is turned: a step
 * goes to 2.5 times as much, and by 1.5 widths where it is in a peak. Towards peaks of light that is turned back it ends at a quarter of
 * 1 / ahead. On a ray through the point light itself what is shorter than a hundredth of its radius does not count. */
float nb_smooth_end(nb_light_pass by, nb_light_segment piece, float t, float end)
{
    float from = t - by.closest;
    float side = max(sqrt(by.aside2), 1e-6 * NEBEL_FOG_TEXEL(NB_HEADER_LATTICE).z);
    float distance = sqrt(side * side + from * from);
    float ahead = from < 0.0 ? side / (distance - from) : (distance + from) / side;
    float next = 2.5 * ahead + 1.5 * piece.ahead;
    float back = 0.25 * min(1.0 / ahead, 1.0) - 0.75 * piece.back;
    if (back > 0.0) next = min(next, 1.0 / back);
    else if (ahead > 1.0) return end;
    float place = by.closest + 0.5 * side * (next - 1.0 / next);
    return min(max(place, t + max(0.01 * by.aside, t * (8.0 * NB_EPSILON))), end);
}

/* Steps that a point light takes in a piece; the rest is one. */
#define NB_MAX_LIGHT_STEPS 96

/* The light of one point light in a piece. */
nb_vec3 nb_in_scatter_past_light(nb_ray ray, int first, bool listed, nb_light_segment piece, nb_light_pass by, nb_vec3 before,
                           float tolerance, inout int turns)
{
    nb_vec3 sum = nb_splat3(0.0);
    nb_vec3 seen = nb_exp3(-before);
    nb_vec2 lit = nb_vec2(1.0, piece.start);
    float far = min(piece.end, by.closest + NB_LIGHT_REACH);
    float guess = nb_first_swing(ray, first, listed, piece, by, turns);
    float least = 1e-7 * min(guess, 1.0); /* shorter steps are not tried */
    nb_light_start start = nb_open_start();
    for (int i = 0; i < NB_MAX_LIGHT_STEPS; i++) {
        float t = piece.start + start.from;
        if (!(start.from < far - piece.start) || nb_is_tired(turns + nb_grid_turns)) break;
        if (lit.y <= t) {
            lit = NEBEL_LIGHT_VISIBILITY(by.number, ray.origin, ray.direction, t, far);
            lit.y = min(max(lit.y, t + nb_nearest(t)), far);
        }
        bool last = i + 1 == NB_MAX_LIGHT_STEPS;
        float stop = last ? far : nb_smooth_end(by, piece, t, nb_light_turn(by, ray, t, lit.y));
        float along = (piece.start - by.closest) + start.from;
        float rest = (stop - piece.start) - start.from;
        nb_swing swing = nb_swing_over(by.aside, t, along, along + rest, rest);
        float length = lit.x > 0.0 && !last ? min(min(guess, 1.0), swing.end) : swing.end;
        float end = start.from + (length >= swing.end ? rest : min(nb_swing_way(swing, length), rest));
        nb_vec3 depth = before + nb_place_in_piece(ray, first, listed, piece, end, ray.direction, turns).depth;
        nb_vec3 behind = nb_exp3(-depth);
        turns += NB_LIGHT_NODES + 1;
        bool fits = true;
        nb_light_start next = nb_open_start();
        if (lit.x > 0.0) {
            nb_light_step taken = nb_step_past_light(ray, first, listed, piece, by, swing, length, end, before, seen, seen - behind, start, turns);
            next = taken.next;
            float allowed = tolerance + NB_LIGHT_SHARE * nb_largest(max(sum, taken.light));
            fits = last || taken.error <= allowed || length < least;
            if (fits) sum += lit.x * taken.light;
            guess = fits ? max(guess, 2.0 * length) : length * min(max(0.55 / max(taken.steepness, 0.55), 0.001), 0.5);
        }
        if (fits) {
            seen = behind;
            start = next;
            start.from = end;
            start.depth = depth;
        }
    }
    return sum;
}

/* ---- all point lights ------------------------------------------------------------------------------- */

/* Nodes of a step are far better than the three that its error is told by. */
#define NB_LIGHT_TOLERANCE 60.0
/* What point lights that are left out may give, of that. */
#define NB_FAINT_SHARE 0.05

/* Adds a piece. */
void nb_scatter_light_segment(inout nb_light_state l, nb_ray ray, int first, int count, bool listed, inout int turns)
{
    float tolerance = NEBEL_FOG_TEXEL(0).y * NB_LIGHT_TOLERANCE;
    int lights = int(NEBEL_FOG_TEXEL(0).w);
    float end = l.most > 0.0 ? min(ray.t_max, l.reached + l.most) : ray.t_max;
    nb_light_segment piece = nb_next_piece(ray, first, count, listed, l.reached, end, turns);
    nb_vec3 drop = nb_exp3(-l.before) - nb_exp3(-(l.before + piece.depth));
    for (int i = 0; i < (piece.scatters ? lights : 0); i++) {
        nb_light_pass by = nb_pass_light(ray, i);
        float most = nb_most_fluence(by, piece.start, piece.end) * piece.scatter * nb_largest(drop);
        turns += 1;
        if (most * float(lights) <= tolerance * NB_FAINT_SHARE) continue;
        l.light += nb_in_scatter_past_light(ray, first, listed, piece, by, l.before, tolerance, turns);
    }
    l.before += piece.depth;
    l.reached = piece.end;
    l.most *= 2.0;
}

void nb_store_lights(int count, nb_light_state l)
{
    nb_keep(count, 0, l.light, l.reached);
    nb_keep(count, 1, l.before, l.most);
}

nb_light_state nb_restore_lights(int count)
{
    nb_light_state l = nb_start_lights();
    l.light = nb_kept_word(count, 0).xyz;
    l.reached = nb_kept_word(count, 0).w;
    l.before = nb_kept_word(count, 1).xyz;
    l.most = nb_kept_word(count, 1).w;
    return l;
}

/* As far as turns suffice. In several passes a piece that they do not suffice for is begun again in the next one, shorter if it was the
 * first. */
void nb_surface_lights(inout nb_light_state l, nb_ray ray, int first, int count, bool listed, inout int turns)
{
    float from = l.reached;
    nb_grid_turns = 0;
    if (NB_RESUMES) nb_store_lights(count, l);
    while (l.reached < ray.t_max && nb_smallest(l.before) < NB_OPAQUE && !nb_is_tired(turns + nb_grid_turns)) {
        nb_light_state before = l;
        nb_scatter_light_segment(l, ray, first, count, listed, turns);
        if (NB_RESUMES && (nb_is_tired(turns + nb_grid_turns) || !nb_has_loops(count))) {
            if (before.reached > from) break;
            float most = before.most > 0.0 ? before.most : l.reached - from;
            l = before;
            l.most = 0.25 * (most > 0.0 ? most : 1.0); /* it may be anything where loops were ended */
            nb_store_lights(count, l);
            break;
        }
        if (NB_RESUMES) nb_store_lights(count, l);
    }
    if (NB_RESUMES) l = nb_restore_lights(count);
    turns += nb_grid_turns;
}

#else

void nb_surface_lights(inout nb_light_state l, nb_ray ray, int first, int count, bool listed, inout int turns) {}

#endif
