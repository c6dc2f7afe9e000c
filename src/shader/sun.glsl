/* The way from places on a ray to the sun, as src/trace/trace_sun.h and trace_breakpoints.h have it: the optical depth there, and the
 * *turns*, where that way begins or ends to meet a body or passes one of its edges. Between turns the depth is smooth along the ray.
 *
 * What surfaces keep away is the host's to say, by a function that it defines before this text:
 *
 *     #define NEBEL_SUN_VISIBILITY(origin, direction, t, end)
 *
 * is a vec2: the share of sunlight that reaches the ray from t on, and up to where along the ray that holds, at most `end`. */
#ifndef NEBEL_SUN_VISIBILITY
#define NEBEL_SUN_VISIBILITY(origin, direction, t, end) nb_vec2(1.0, end)
#endif

/* Where that has loops: how many turns of them it has taken in this shader so far, for NEBEL_MAX_ITERATIONS. */
#ifndef NEBEL_SUN_VISIBILITY_ITERATIONS
#define NEBEL_SUN_VISIBILITY_ITERATIONS 0
#endif

/* As many times as bright is the sun; it is the same all along the ray that is asked. environment.glsl has NEBEL_ENVIRONMENT_SCALE. */
#ifndef NEBEL_SUN_SCALE
#define NEBEL_SUN_SCALE nb_splat3(1.0)
#endif

nb_vec3 nb_to_sun() { return NEBEL_FOG_TEXEL(NB_HEADER_SUN).xyz; }

/* Whether the sun lights any fog. */
bool nb_is_day() { return NB_HAS(NB_HAS_SUN) && nb_largest(abs(nb_to_sun())) > 0.0; }

/* Whether light along a ray has a closed form between turns: the whole depth is linear in that along the ray. */
bool nb_sun_is_closed() { return NEBEL_FOG_TEXEL(NB_HEADER_SUN).w > 0.0; }

/* Radiance of opaque fog of this medium in full sunlight; 0 where it scatters none. */
nb_vec3 nb_sunlit_radiance(int medium, nb_vec3 direction)
{
    int scattering = int(NEBEL_FOG_TEXEL(medium + NB_MEDIUM_SCATTERING).w);
    nb_vec3 radiance = nb_splat3(0.0);
    if (scattering > 0) {
        float phase = nb_scattered(scattering, direction, nb_to_sun());
        radiance = NEBEL_FOG_TEXEL(scattering).xyz * NEBEL_FOG_TEXEL(NB_HEADER_SUN + 1).xyz * NEBEL_SUN_SCALE * phase;
    }
    return radiance;
}

nb_vec3 nb_depth_to_sun(nb_spot spot)
{
#if NB_DECLARES(NB_HAS_SUN)
    int turns = 0; /* nb_turns_to_sun counts them */
    return nb_depth_to_light(spot, nb_to_sun(), NB_FAR, true, turns);
#else
    return nb_splat3(0.0);
#endif
}

/* ---- turns ----------------------------------------------------------------------------------- */

/* Kept by the search: the next turn behind t, and whether light changes there as a root does, as behind the silhouette of what is
 * round. */
struct nb_turning {
    float t;    /* turns up to here are behind */
    float next;
    bool curved;
};

void nb_note_turn(inout nb_turning turning, float t, bool curved)
{
    if (t > turning.t && t < turning.next) {
        turning.next = t;
        turning.curved = curved;
    }
}

/* a t^2 + 2 b t + c = 0 */
void nb_note_roots(inout nb_turning turning, float a, float b, float c, bool curved)
{
    float square = b * b - a * c;
    if (!(square >= 0.0)) return;
    float root = sqrt(square);
    float sum = -(b + (b < 0.0 ? -root : root));
    nb_note_turn(turning, sum * nb_rcp_bounded(a), curved);
    nb_note_turn(turning, c * nb_rcp_bounded(sum), curved);
}

/* The places p + t d, from which ways go along v; `p` counts from the ball's centre. */
void nb_note_sphere(inout nb_turning turning, nb_vec3 p, nb_vec3 d, nb_vec3 v, float radius)
{
    nb_vec3 moment = cross(p, v);
    nb_vec3 rate = cross(d, v);
    nb_note_roots(turning, dot(rate, rate), dot(moment, rate), dot(moment, moment) - radius * radius * dot(v, v), true);
}

/* x x + y y - w w, w the radius of the mantle. */
float nb_mantle_form(nb_vec3 a, float wa, nb_vec3 b, float wb) { return a.x * b.x + a.y * b.y - wa * wb; }

void nb_note_mantle(inout nb_turning turning, nb_vec3 p, nb_vec3 d, nb_vec3 v, float radius, float slope)
{
    float wp = radius + slope * p.z;
    float wd = slope * d.z;
    float wv = slope * v.z;
    float pv = nb_mantle_form(p, wp, v, wv);
    float dv = nb_mantle_form(d, wd, v, wv);
    float vv = nb_mantle_form(v, wv, v, wv);
    nb_note_roots(turning, dv * dv - vv * nb_mantle_form(d, wd, d, wd), pv * dv - vv * nb_mantle_form(p, wp, d, wd),
                  pv * pv - vv * nb_mantle_form(p, wp, p, wp), true);
}

/* The rim of the mantle at this z. */
void nb_note_rim(inout nb_turning turning, nb_vec3 p, nb_vec3 d, nb_vec3 v, float z, float radius)
{
    nb_vec2 at = p.xy * v.z + (z - p.z) * v.xy;
    nb_vec2 rate = d.xy * v.z - d.z * v.xy;
    float r = radius * v.z;
    nb_note_roots(turning, dot(rate, rate), dot(at, rate), dot(at, at) - r * r, true);
}

void nb_note_round(inout nb_turning turning, int leaf, int type, nb_vec3 p, nb_vec3 d, nb_vec3 v)
{
    nb_vec4 head = NEBEL_FOG_TEXEL(leaf);
    if (NB_HAS(NB_HAS_SPHERE) && type == NB_TYPE_SPHERE) {
        nb_note_sphere(turning, p, d, v, head.y);
    } else if (NB_HAS(NB_HAS_CAPSULE) && type == NB_TYPE_CAPSULE) {
        nb_note_mantle(turning, p, d, v, 1.0, 0.0);
        nb_note_sphere(turning, p, d, v, 1.0);
        nb_note_sphere(turning, p - nb_vec3(0.0, 0.0, head.y), d, v, 1.0);
    } else if (NB_HAS(NB_HAS_CYLINDER | NB_HAS_CONE)) {
        float radius = type == NB_TYPE_CONE ? head.y : 1.0;
        float slope = type == NB_TYPE_CONE ? head.z : 0.0;
        nb_note_mantle(turning, p, d, v, radius, slope);
        nb_note_rim(turning, p, d, v, 0.0, radius);
        nb_note_rim(turning, p, d, v, 1.0, radius + slope);
    }
}

/* Flat faces: the length of the way within them is the least distance to one that it leaves by, less the greatest to one that it enters
 * by, or 0. All are linear along the ray, so that it is linear from where one takes over to where the next does. A distance and how
 * fast it grows along the ray are a vec2; those to leave by have the other sign, so that the greatest counts, too. */
nb_vec2 nb_greater(nb_vec2 a, nb_vec2 b) { return b.x > a.x || (b.x == a.x && b.y > a.y) ? b : a; }

/* Where the other takes over. */
float nb_takeover(nb_vec2 a, nb_vec2 other) { return other.y > a.y ? (a.x - other.x) / (other.y - a.y) : NB_FAR; }

struct nb_way_through {
    nb_vec2 enter, leave;
};

nb_way_through nb_open_way()
{
    nb_way_through way;
    way.enter = nb_vec2(0.0, 0.0);
    way.leave = nb_vec2(-NB_FAR, 0.0);
    return way;
}

nb_way_through nb_box_way(nb_vec3 near, nb_vec3 far, nb_vec3 rate)
{
    nb_way_through way = nb_open_way();
    way.enter = nb_greater(way.enter, nb_vec2(near.x, rate.x));
    way.enter = nb_greater(way.enter, nb_vec2(near.y, rate.y));
    way.enter = nb_greater(way.enter, nb_vec2(near.z, rate.z));
    way.leave = nb_greater(nb_vec2(-far.x, -rate.x), nb_vec2(-far.y, -rate.y));
    way.leave = nb_greater(way.leave, nb_vec2(-far.z, -rate.z));
    return way;
}

float nb_box_takeover(nb_way_through way, nb_vec3 near, nb_vec3 far, nb_vec3 rate)
{
    float next = nb_takeover(way.enter, nb_vec2(0.0, 0.0));
    next = min(next, nb_takeover(way.enter, nb_vec2(near.x, rate.x)));
    next = min(next, nb_takeover(way.enter, nb_vec2(near.y, rate.y)));
    next = min(next, nb_takeover(way.enter, nb_vec2(near.z, rate.z)));
    next = min(next, nb_takeover(way.leave, nb_vec2(-far.x, -rate.x)));
    next = min(next, nb_takeover(way.leave, nb_vec2(-far.y, -rate.y)));
    return min(next, nb_takeover(way.leave, nb_vec2(-far.z, -rate.z)));
}

/* Distance and rate to a face; whether the way enters by it. */
nb_vec3 nb_way_to_face(nb_vec4 face, nb_vec3 place, nb_vec3 d, nb_vec3 v)
{
    float rise = dot(face.xyz, v);
    float inverse = nb_rcp_bounded(rise);
    return nb_vec3((face.w - dot(face.xyz, place)) * inverse, -dot(face.xyz, d) * inverse, rise < 0.0 ? 1.0 : -1.0);
}

nb_way_through nb_planes_way(int first, int count, nb_vec3 place, nb_vec3 d, nb_vec3 v)
{
    nb_way_through way = nb_open_way();
    for (int i = 0; i < count; i++) {
        nb_vec3 to = nb_way_to_face(NEBEL_FOG_TEXEL(first + i), place, d, v);
        if (to.z > 0.0)
            way.enter = nb_greater(way.enter, to.xy);
        else
            way.leave = nb_greater(way.leave, -to.xy);
    }
    return way;
}

float nb_planes_takeover(nb_way_through way, int first, int count, nb_vec3 place, nb_vec3 d, nb_vec3 v)
{
    float next = nb_takeover(way.enter, nb_vec2(0.0, 0.0));
    for (int i = 0; i < count; i++) {
        nb_vec3 to = nb_way_to_face(NEBEL_FOG_TEXEL(first + i), place, d, v);
        if (to.z > 0.0)
            next = min(next, nb_takeover(way.enter, to.xy));
        else
            next = min(next, nb_takeover(way.leave, -to.xy));
    }
    return next;
}

/* Of faces that the way does not pass between, those that take over are passed by. */
#define NB_MAX_PASSED 6

void nb_note_faces(inout nb_turning turning, int leaf, bool box, nb_vec3 p, nb_vec3 d, nb_vec3 v)
{
    nb_vec4 head = NEBEL_FOG_TEXEL(leaf);
    nb_vec3 inverse = nb_vec3(nb_rcp_bounded(v.x), nb_rcp_bounded(v.y), nb_rcp_bounded(v.z));
    float t = turning.t;
    for (int i = 0; i < NB_MAX_PASSED; i++) {
        nb_vec3 place = p + d * t;
        nb_way_through way;
        float next = NB_FAR;
        if (NB_HAS(NB_HAS_BOX) && box) {
            nb_vec3 low = (NEBEL_FOG_TEXEL(leaf + 1).xyz - place) * inverse;
            nb_vec3 high = (NEBEL_FOG_TEXEL(leaf + 2).xyz - place) * inverse;
            way = nb_box_way(min(low, high), max(low, high), -d * inverse);
            next = nb_box_takeover(way, min(low, high), max(low, high), -d * inverse);
        } else {
            way = nb_planes_way(int(head.z), int(head.y), place, d, v);
            next = nb_planes_takeover(way, int(head.z), int(head.y), place, d, v);
        }
        nb_vec2 gap = -(way.enter + way.leave);
        if (gap.x <= 0.0 && gap.y <= 0.0) return; /* the shadow is behind */
        float zero = gap.y != 0.0 ? -gap.x / gap.y : NB_FAR;
        bool outside = gap.x <= 0.0 && next < zero;
        if (zero > 0.0) next = min(next, zero);
        if (!outside || i + 1 == NB_MAX_PASSED) {
            nb_note_turn(turning, t + next, false);
            return;
        }
        t += next * (1.0 + 8.0 * NB_EPSILON);
        if (!(t < turning.next)) return;
    }
}

void nb_note_leaf(inout nb_turning turning, int leaf, nb_ray ray, nb_vec3 sun)
{
    int type = int(NEBEL_FOG_TEXEL(leaf).x);
    bool turned = type >= NB_TYPE_ROTATED;
    if (turned) type -= NB_TYPE_ROTATED;
    if (type == NB_TYPE_WORLD) return;
    bool flat_sided = NB_HAS(NB_HAS_PLANES | NB_HAS_BOX) && (type == NB_TYPE_PLANES || type == NB_TYPE_BOX);
    nb_ray way = ray;
    way.direction = sun;
    nb_ray local = nb_turned_ray(leaf, turned, ray);
    nb_vec3 v = nb_turned_ray(leaf, turned, way).direction;
    if (flat_sided)
        nb_note_faces(turning, leaf, type == NB_TYPE_BOX, local.origin, local.direction, v);
    else
        nb_note_round(turning, leaf, type, local.origin + NEBEL_FOG_TEXEL(leaf + 1).xyz, local.direction, v);
}

/* The first turn of all media behind t and before `end`, or `end`. */
nb_turning nb_find_turn(nb_ray ray, float t, float end)
{
    nb_turning turning;
    turning.t = t + nb_nearest(t);
    turning.next = end;
    turning.curved = false;
    nb_vec3 sun = nb_to_sun();
    int count = NB_HAS(NB_HAS_SEVERAL) ? int(NEBEL_FOG_TEXEL(0).x) : 1;
    for (int i = 0; i < count; i++) {
        int at = NB_HEADER_TEXELS + NB_MEDIUM_TEXELS * i;
        int leaves = int(NEBEL_FOG_TEXEL(at + 2).w);
        bool several = NB_HAS(NB_HAS_GROUP) && leaves > 1;
        int leaf = at + NB_MEDIUM_LEAF;
        if (several) leaf = int(NEBEL_FOG_TEXEL(leaf).w);
        for (int k = 0; k < (several ? leaves : 1); k++) nb_note_leaf(turning, leaf + NB_LEAF_TEXELS * k, ray, sun);
        if (NB_HAS(NB_HAS_GAUSSIAN) && int(NEBEL_FOG_TEXEL(at).w) == NB_KIND_GAUSSIAN) {
            nb_vec4 word = NEBEL_FOG_TEXEL(at + 3);
            float sigma = 0.70710678118654752440 / word.w;
            nb_note_sphere(turning, ray.origin + word.xyz, ray.direction, sun, sigma);
            nb_note_sphere(turning, ray.origin + word.xyz, ray.direction, sun, 4.0 * sigma);
        }
    }
    return turning;
}

/* ---- the shadow of voxels -------------------------------------------------------------------- */

/* Columns across the way to the sun that light may be seen through at once. */
#define NB_COLUMNS_AT_ONCE 2.0

/* Metres along the ray within which the way to the sun passes so many columns by. */
float nb_columns_by(nb_sun_lattice_ray to_sun)
{
    return NB_COLUMNS_AT_ONCE / max(max(abs(to_sun.slope.x), abs(to_sun.slope.y)), NB_TINY);
}

/* What a step may be where voxels lie between a place on the ray and the sun; NB_FAR where there are none. */
float nb_most_in_shadow(nb_ray ray, float t)
{
    float most = NB_FAR;
    nb_ray way = ray;
    way.origin = ray.origin + ray.direction * t;
    way.direction = nb_to_sun();
    way.t_max = NB_FAR;
    way.from_eye = false;
    int count = NB_HAS(NB_HAS_SEVERAL) ? int(NEBEL_FOG_TEXEL(0).x) : 1;
    for (int i = 0; i < count; i++) {
        int at = NB_HEADER_TEXELS + NB_MEDIUM_TEXELS * i;
        if (int(NEBEL_FOG_TEXEL(at).w) != NB_KIND_GRID) continue;
        nb_stretch s = nb_next_stretch(at, 1, way, 0.0);
        if (!(s.enter < s.leave)) continue;
        nb_profile profile = nb_profile_of(at, NB_KIND_GRID, ray, 0.0);
        most = min(most, nb_columns_by(nb_sun_lattice_ray_of(int(NEBEL_FOG_TEXEL(at + NB_MEDIUM_LEAF).y), profile.offset, profile.slope)));
    }
    return most;
}
