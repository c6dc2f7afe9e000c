/* What one medium is along a ray, from the words of layout.h: where its shape is, and its density there. Written for GLSL ES 3.00
 * and HLSL alike; fog.glsl follows. Constant conditions on NB_HAS() leave out what NEBEL_FEATURES says that the fog does not have. */
#ifndef NEBEL_FEATURES
#define NEBEL_FEATURES NB_HAS_ALL
#endif
/* Compilers put functions into each other before they leave out what no condition lets through: that takes most of the time and memory of a
 * small program. What is large stands between #if NB_DECLARES(...) as well; but not every preprocessor can reckon with 123u. */
#ifdef NEBEL_FEATURES_LITERAL
#define NB_DECLARED NEBEL_FEATURES
#else
#define NB_DECLARED NB_HAS_ALL
#endif
#define NB_DECLARES(features) ((NB_DECLARED & (features)) != 0)
#ifndef NEBEL_MAX_RADIANCE
#define NEBEL_MAX_RADIANCE 65504.0
#endif
#define NB_HAS(feature) ((int(NEBEL_FEATURES) & (feature)) != 0) /* a host may write 123 or 123u */

struct nebel_transfer {
    nb_vec3 transmittance;
    nb_vec3 in_scattering;
};

struct nb_ray {
    nb_vec3 origin;
    nb_vec3 direction;
    float t_max;
    bool from_eye; /* distances along it count */
};

nb_vec3 nb_exp3(nb_vec3 v) { return nb_vec3(nb_exp(v.x), nb_exp(v.y), nb_exp(v.z)); }
/* By its bits: compilers take comparisons for granted that a NaN would fail. */
bool nb_is_number(float x) { return (nb_to_bits(x) & 0x7fffffff) <= 0x7f800000; }
float nb_largest(nb_vec3 v) { return max(max(v.x, v.y), v.z); }
float nb_smallest(nb_vec3 v) { return min(min(v.x, v.y), v.z); }

/* ---- attenuation ----------------------------------------------------------------------------- */

/* What is left behind optical depth x, e^-x, and the mean on the way, (1 - e^-x) / x: nb_exp and nb_exp_ratio at the price of one. */
struct nb_attenuation {
    nb_vec3 left;
    nb_vec3 mean;
};

/* e^-x and 1 - e^-x, which keeps its digits where x is small. */
nb_vec2 nb_lose(float x)
{
    float y = max(-x, NB_EXP_MIN);
    float n = nb_exp_steps(y);
    float r = nb_exp_rest(y, n);
    float s = nb_scale_pow2(1.0, n);
    float q = r + (r * r) * nb_exp_tail(r);
    return nb_vec2(s + s * q, (1.0 - s) - s * q);
}

nb_vec2 nb_attenuate1(float x)
{
    nb_vec2 lost = nb_lose(x);
    return nb_vec2(lost.x, x > NB_TINY ? lost.y / x : 1.0);
}

nb_attenuation nb_attenuate(nb_vec3 depth)
{
    nb_vec2 x = nb_attenuate1(depth.x);
    nb_vec2 y = nb_attenuate1(depth.y);
    nb_vec2 z = nb_attenuate1(depth.z);
    nb_attenuation a;
    a.left = nb_vec3(x.x, y.x, z.x);
    a.mean = nb_vec3(x.y, y.y, z.y);
    return a;
}

/* How far behind a place on a ray the next one is that floats tell from it. */
float nb_nearest(float t) { return max(abs(t) * (8.0 * NB_EPSILON), NEBEL_FOG_TEXEL(NB_HEADER_LATTICE).z); }

/* ---- shapes ---------------------------------------------------------------------------------- */

/* The ray in a leaf's frame, without the way to the frame's origin. */
nb_ray nb_turned_ray(int leaf, bool turned, nb_ray ray)
{
    nb_ray local = ray;
    if (NB_HAS(NB_HAS_ROTATED) && turned) {
        nb_vec3 x = NEBEL_FOG_TEXEL(leaf + 3).xyz;
        nb_vec3 y = NEBEL_FOG_TEXEL(leaf + 4).xyz;
        nb_vec3 z = NEBEL_FOG_TEXEL(leaf + 5).xyz;
        local.origin = nb_vec3(dot(x, ray.origin), dot(y, ray.origin), dot(z, ray.origin));
        local.direction = nb_vec3(dot(x, ray.direction), dot(y, ray.direction), dot(z, ray.direction));
    }
    return local;
}

/* See nb_face in src/medium/volume.h: whose ray it is that lies in a face. */
float nb_face_tie(nb_vec3 normal)
{
    return normal.x != 0.0 ? normal.x : normal.y != 0.0 ? normal.y : normal.z;
}

nb_interval nb_planes_interval(int first, int count, nb_ray ray)
{
    nb_interval span = nb_interval_all();
    for (int i = 0; i < count; i++) {
        nb_vec4 face = NEBEL_FOG_TEXEL(first + i);
        float lean = 2.0 * NB_EPSILON * dot(abs(face.xyz), abs(ray.direction));
        span = nb_interval_meet(span, nb_interval_half_space(ray.origin, ray.direction, face.xyz, face.w,
                                                             nb_face_tie(face.xyz), 0.0, lean, 0.0));
    }
    return span;
}

/* Makes the noise in the formulas of curved shapes of size 1 0: the ends as float has them, none widened by what it may have lost. */
#define NB_NO_REACH (-NB_WEPSILON)

nb_interval nb_leaf_interval(int leaf, nb_ray ray)
{
    nb_vec4 head = NEBEL_FOG_TEXEL(leaf);
    int type = int(head.x);
    bool turned = type >= NB_TYPE_ROTATED;
    if (turned) type -= NB_TYPE_ROTATED;
    nb_interval span = nb_interval_all();
    if (NB_HAS(NB_HAS_PLANES) && type == NB_TYPE_PLANES) {
        span = nb_planes_interval(int(head.z), int(head.y), ray);
    } else if (type != NB_TYPE_WORLD) {
        nb_ray local = nb_turned_ray(leaf, turned, ray);
        nb_vec3 d = local.direction;
        nb_vec3 place = NEBEL_FOG_TEXEL(leaf + 1).xyz;
        nb_vec3 p = local.origin + place;
        if (NB_HAS(NB_HAS_BOX) && type == NB_TYPE_BOX)
            span = nb_interval_box(local.origin, d, place, NEBEL_FOG_TEXEL(leaf + 2).xyz, 0.0);
#if NB_DECLARES(NB_HAS_SPHERE)
        else if (NB_HAS(NB_HAS_SPHERE) && type == NB_TYPE_SPHERE)
            span = nb_interval_sphere(p, d, head.y, NB_NO_REACH * head.y);
#endif
#if NB_DECLARES(NB_HAS_CYLINDER)
        else if (NB_HAS(NB_HAS_CYLINDER) && type == NB_TYPE_CYLINDER)
            span = nb_interval_cylinder(p, d, NB_NO_REACH);
#endif
#if NB_DECLARES(NB_HAS_CONE)
        else if (NB_HAS(NB_HAS_CONE) && type == NB_TYPE_CONE)
            span = nb_interval_cone(p, d, head.y, head.z, NB_NO_REACH);
#endif
#if NB_DECLARES(NB_HAS_CAPSULE)
        else if (NB_HAS(NB_HAS_CAPSULE) && type == NB_TYPE_CAPSULE)
            span = nb_interval_capsule(p, d, head.y, NB_NO_REACH);
#endif
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

#if NB_DECLARES(NB_HAS_GROUP)
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
            int at = leaf + NB_LEAF_TEXELS * i;
            nb_interval span = nb_leaf_interval(at, ray);
            bool some = span.enter < span.leave;
            if (some && span.enter > t) next = min(next, span.enter);
            if (some && span.leave > t) next = min(next, span.leave);
            stack = (stack << 1) | (span.enter <= t && span.leave > t ? 1 : 0);
            for (int folds = int(NEBEL_FOG_TEXEL(at).w); folds > 1; folds >>= 1) {
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
#endif

/* Where the body of a medium next has the ray inside, at or behind `from`. */
nb_stretch nb_next_stretch(int medium, int leaves, nb_ray ray, float from)
{
    int at = medium + NB_MEDIUM_LEAF;
    if (NB_HAS(NB_HAS_DISTANCES) && ray.from_eye) {
        from = max(from, NEBEL_FOG_TEXEL(medium + NB_MEDIUM_START).w);
        ray.t_max = min(ray.t_max, NEBEL_FOG_TEXEL(medium + NB_MEDIUM_CUTOFF).w);
    }
    nb_stretch s = nb_stretch_of(from, from);
#if NB_DECLARES(NB_HAS_GROUP)
    if (NB_HAS(NB_HAS_GROUP) && leaves > 1) {
        nb_vec4 low = NEBEL_FOG_TEXEL(at);
        nb_interval bounds = nb_interval_box(ray.origin, ray.direction, low.xyz, NEBEL_FOG_TEXEL(at + 1).xyz, 0.0);
        if (max(bounds.enter, from) < min(bounds.leave, ray.t_max)) s = nb_group_stretch(int(low.w), leaves, ray, from);
    } else
#endif
    {
        nb_interval span = nb_leaf_interval(at, ray);
        s = nb_stretch_of(max(span.enter, from), min(span.leave, ray.t_max));
    }
    return s;
}

/* ---- profiles -------------------------------------------------------------------------------- */

/* A medium's density in coordinates along the ray, offset + slope s, s metres behind where it was asked for. */
struct nb_profile {
    int kind;
    nb_vec3 offset;
    nb_vec3 slope;
    nb_vec3 size;  /* soft edge: half widths */
    float level;   /* gaussian: m; radial: c; grid: the integral that is enough */
    nb_vec3 side;  /* soft edge of a round body: see nb_round_edge; of planes it has offset and slope of the ray */
    int form;
    int first;     /* planes, grid */
    int count;
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

nb_profile nb_planes_profile(nb_profile profile, int leaf, nb_ray ray, float start)
{
    nb_vec4 head = NEBEL_FOG_TEXEL(leaf);
    profile.count = int(head.y);
    profile.first = int(head.z);
    profile.offset = ray.origin + ray.direction * start;
    profile.slope = ray.direction;
    return profile;
}

nb_profile nb_round_body_profile(nb_profile profile, int leaf, nb_vec4 word, nb_ray ray, float start)
{
    nb_vec4 head = NEBEL_FOG_TEXEL(leaf);
    int type = int(head.x);
    nb_ray local = nb_turned_ray(leaf, type >= NB_TYPE_ROTATED, ray);
    if (type >= NB_TYPE_ROTATED) type -= NB_TYPE_ROTATED;
    float unit = type == NB_TYPE_SPHERE ? 1.0 / head.y : 1.0;
    float radius = type == NB_TYPE_CONE ? head.y : 1.0;
    float slope = type == NB_TYPE_CONE ? head.z : 0.0;
    float extent = type == NB_TYPE_CAPSULE ? head.y : 1.0;
    profile.form = type == NB_TYPE_SPHERE ? NB_EDGE_SPHERE : type == NB_TYPE_CAPSULE ? NB_EDGE_CAPSULE : NB_EDGE_CAPPED;
    nb_vec3 p = (local.origin + NEBEL_FOG_TEXEL(leaf + 1).xyz + local.direction * start) * unit;
    nb_round_edge edge = nb_round_edge_of(p, local.direction * unit, radius, slope, extent, word.x, word.y, word.z, profile.form);
    profile.side = edge.side;
    profile.offset = edge.q;
    profile.slope = edge.k;
    profile.size = edge.ends;
    return profile;
}

/* In cells. */
nb_profile nb_grid_profile(nb_profile profile, int leaf, nb_vec4 word, nb_ray ray, float start)
{
    nb_vec4 head = NEBEL_FOG_TEXEL(leaf);
    nb_ray local = nb_turned_ray(leaf, int(head.x) >= NB_TYPE_ROTATED, ray);
    profile.first = int(word.w);
    profile.offset = (local.origin + local.direction * start - NEBEL_FOG_TEXEL(leaf + 1).xyz) * word.xyz +
                     nb_splat3(0.5 * float(NEBEL_VOXEL_TEXEL(profile.first).w));
    profile.slope = local.direction * word.xyz;
    return profile;
}

nb_profile nb_leaf_profile(nb_profile profile, int leaf, float width, nb_ray ray, float start)
{
    nb_vec4 head = NEBEL_FOG_TEXEL(leaf);
    nb_ray local = nb_turned_ray(leaf, int(head.x) >= NB_TYPE_ROTATED, ray);
    nb_vec3 place = NEBEL_FOG_TEXEL(leaf + 1).xyz;
    if (NB_HAS(NB_HAS_RADIAL) && profile.kind >= NB_KIND_RADIAL) {
        profile = nb_round_profile(profile, local.origin + place, local.direction, 1.0 / head.y, start);
        profile.level = 1.0 - profile.level;
    } else if (NB_HAS(NB_HAS_SOFT_EDGE)) {
        nb_vec3 high = NEBEL_FOG_TEXEL(leaf + 2).xyz;
        profile.offset = (local.origin + local.direction * start - (place + high) * 0.5) * width;
        profile.slope = local.direction * width;
        profile.size = (high - place) * (0.5 * width);
    }
    return profile;
}

/* The ray over a ball, from its start on: height, radius and rise of nb_arc are the offset; the scale height, how deep and
 * how thick it gets are the size. Heights are that of the eye and what the way from there climbs. */
nb_profile nb_altitude_profile(nb_profile profile, nb_vec4 word, nb_ray ray, float start)
{
    nb_vec3 place = ray.origin + ray.direction * start;
    nb_vec4 more = NEBEL_FOG_TEXEL(int(word.w));
    nb_arc way;
    way.height = more.w;
    way.radius = sqrt(dot(word.xyz, word.xyz));
    float far = sqrt(dot(place, place));
    way.rise = dot(place, word.xyz) / max(far, NB_TINY);
    float climb = nb_arc_climb(way, far);
    profile.offset = nb_vec3(more.w + climb, way.radius + climb, dot(word.xyz + place, ray.direction));
    profile.size = more.xyz;
    return profile;
}

nb_arc nb_profile_arc(nb_profile profile)
{
    nb_arc arc;
    arc.height = profile.offset.x;
    arc.radius = profile.offset.y;
    arc.rise = profile.offset.z;
    return arc;
}

/* Nothing behind so much optical depth adds a bit to a picture. */
#define NB_ENOUGH 20.0

nb_profile nb_profile_of(int medium, int kind, nb_ray ray, float start)
{
    nb_profile profile;
    profile.kind = kind;
    profile.offset = nb_splat3(0.0);
    profile.slope = nb_splat3(0.0);
    profile.size = nb_splat3(0.0);
    profile.level = 0.0;
    profile.side = nb_splat3(0.0);
    profile.form = 0;
    profile.first = 0;
    profile.count = 0;
    if (NB_HAS(NB_HAS_PROFILE) && kind != NB_KIND_CONSTANT && kind != NB_KIND_EXCLUDE) {
        nb_vec4 word = NEBEL_FOG_TEXEL(medium + 3);
        if (NB_HAS(NB_HAS_SLOPE) && kind <= NB_KIND_LINEAR) {
            profile.slope.x = dot(word.xyz, ray.direction);
            profile.offset.x = word.w + dot(word.xyz, ray.origin) + profile.slope.x * start;
#if NB_DECLARES(NB_HAS_ALTITUDE)
        } else if (NB_HAS(NB_HAS_ALTITUDE) && kind == NB_KIND_ALTITUDE) {
            profile = nb_altitude_profile(profile, word, ray, start);
#endif
        } else if (NB_HAS(NB_HAS_GAUSSIAN) && kind == NB_KIND_GAUSSIAN) {
            profile = nb_round_profile(profile, word.xyz + ray.origin, ray.direction, word.w, start);
#if NB_DECLARES(NB_HAS_SOFT_ROUND)
        } else if (NB_HAS(NB_HAS_SOFT_ROUND) && kind == NB_KIND_SOFT_ROUND) {
            profile = nb_round_body_profile(profile, medium + NB_MEDIUM_LEAF, word, ray, start);
#endif
        } else if (NB_HAS(NB_HAS_SOFT_PLANES) && kind == NB_KIND_SOFT_PLANES) {
            profile = nb_planes_profile(profile, medium + NB_MEDIUM_LEAF, ray, start);
#if NB_DECLARES(NB_HAS_GRID)
        } else if (NB_HAS(NB_HAS_GRID) && kind == NB_KIND_GRID) {
            profile = nb_grid_profile(profile, medium + NB_MEDIUM_LEAF, word, ray, start);
            profile.level = NB_ENOUGH / max(nb_smallest(NEBEL_FOG_TEXEL(medium).xyz), NB_TINY);
#endif
        } else {
            profile = nb_leaf_profile(profile, medium + NB_MEDIUM_LEAF, word.w, ray, start);
        }
    }
    return profile;
}

/* Soft edges of planes, as in src/trace/trace_density.h: the least of the faces' depths is linear from kink to kink. */
float nb_planes_least(nb_profile profile, nb_vec3 place)
{
    float least = 1.0;
    for (int i = 0; i < profile.count; i++) {
        nb_vec4 face = NEBEL_FOG_TEXEL(profile.first + i);
        least = min(least, face.w - dot(face.xyz, place));
    }
    return least;
}

float nb_planes_density(nb_profile profile, float s)
{
    return max(nb_planes_least(profile, profile.offset + profile.slope * s), 0.0);
}

/* What float loses of a depth. */
#define NB_EDGE_NOISE 3e-5

float nb_planes_kink(nb_profile profile, float s)
{
    nb_vec3 place = profile.offset + profile.slope * s;
    float least = nb_planes_least(profile, place);
    float lowest = least + NB_EDGE_NOISE >= 1.0 ? 0.0 : NB_FAR;
    for (int i = 0; i < profile.count; i++) {
        nb_vec4 face = NEBEL_FOG_TEXEL(profile.first + i);
        if (face.w - dot(face.xyz, place) <= least + NB_EDGE_NOISE) lowest = min(lowest, -dot(face.xyz, profile.slope));
    }
    float way = lowest > 0.0 ? (1.0 - least) / lowest : NB_FAR;
    for (int i = 0; i < profile.count; i++) {
        nb_vec4 face = NEBEL_FOG_TEXEL(profile.first + i);
        float slope = -dot(face.xyz, profile.slope);
        if (slope < lowest) way = min(way, max(face.w - dot(face.xyz, place) - least, 0.0) / (lowest - slope));
    }
    return s + max(way, abs(s) * (4.0 * NB_EPSILON) + 1e-3 * NEBEL_FOG_TEXEL(NB_HEADER_LATTICE).z);
}

float nb_planes_integral(nb_profile profile, float h)
{
    float t = 0.0;
    float density = nb_planes_density(profile, 0.0);
    float integral = 0.0;
    int most = 2 * profile.count + 4;
    for (int i = 0; i < most; i++) {
        if (!(t < h)) break;
        float end = i + 1 < most ? min(nb_planes_kink(profile, t), h) : h;
        float next = nb_planes_density(profile, end);
        integral += 0.5 * (end - t) * (density + next);
        density = next;
        t = end;
    }
    return integral;
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
#if NB_DECLARES(NB_HAS_GAUSSIAN)
        else if (NB_HAS(NB_HAS_GAUSSIAN) && kind == NB_KIND_GAUSSIAN)
            density = nb_gaussian_density(profile.level, u);
#endif
#if NB_DECLARES(NB_HAS_SOFT_EDGE)
        else if (NB_HAS(NB_HAS_SOFT_EDGE) && kind == NB_KIND_SOFT_EDGE)
            density = nb_soft_edge_density(profile.offset + profile.slope * s, profile.size);
#endif
#if NB_DECLARES(NB_HAS_SOFT_ROUND)
        else if (NB_HAS(NB_HAS_SOFT_ROUND) && kind == NB_KIND_SOFT_ROUND)
            density = nb_round_edge_density(profile.side, profile.offset + profile.slope * s, profile.size.x, profile.form);
#endif
#if NB_DECLARES(NB_HAS_SOFT_PLANES)
        else if (NB_HAS(NB_HAS_SOFT_PLANES) && kind == NB_KIND_SOFT_PLANES)
            density = nb_planes_density(profile, s);
#endif
#if NB_DECLARES(NB_HAS_ALTITUDE)
        else if (NB_HAS(NB_HAS_ALTITUDE) && kind == NB_KIND_ALTITUDE)
            density = min(nb_height_density(nb_arc_height(nb_profile_arc(profile), s) / profile.size.x), profile.size.z);
#endif
#if NB_DECLARES(NB_HAS_RADIAL)
        else if (NB_HAS(NB_HAS_RADIAL) && kind >= NB_KIND_RADIAL && kind < NB_KIND_EXCLUDE)
            density = nb_radial_density(profile.level, u, kind - NB_KIND_RADIAL + 1);
#endif
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
#if NB_DECLARES(NB_HAS_GAUSSIAN)
        } else if (NB_HAS(NB_HAS_GAUSSIAN) && kind == NB_KIND_GAUSSIAN) {
            integral = nb_gaussian_integral(profile.level, u, u + slope * h, slope).value;
#endif
#if NB_DECLARES(NB_HAS_SOFT_EDGE)
        } else if (NB_HAS(NB_HAS_SOFT_EDGE) && kind == NB_KIND_SOFT_EDGE) {
            integral = nb_soft_edge_integral(profile.offset, profile.slope, profile.size, h).value;
#endif
#if NB_DECLARES(NB_HAS_SOFT_ROUND)
        } else if (NB_HAS(NB_HAS_SOFT_ROUND) && kind == NB_KIND_SOFT_ROUND) {
            integral =
                nb_round_edge_integral(profile.side, profile.offset, profile.slope, profile.size, profile.form, h).value;
#endif
#if NB_DECLARES(NB_HAS_SOFT_PLANES)
        } else if (NB_HAS(NB_HAS_SOFT_PLANES) && kind == NB_KIND_SOFT_PLANES) {
            integral = nb_planes_integral(profile, h);
#endif
#if NB_DECLARES(NB_HAS_GRID)
        } else if (NB_HAS(NB_HAS_GRID) && kind == NB_KIND_GRID) {
            integral = nb_grid_integral(profile.offset, profile.slope, profile.first, h, profile.level);
#endif
#if NB_DECLARES(NB_HAS_ALTITUDE)
        } else if (NB_HAS(NB_HAS_ALTITUDE) && kind == NB_KIND_ALTITUDE) {
            nb_arc arc = nb_profile_arc(profile);
            nb_chord deep = nb_arc_chord(arc, -profile.size.y);
            integral = nb_altitude_integral(arc, profile.size.x, deep, profile.size.z, 0.0, h).value;
#endif
#if NB_DECLARES(NB_HAS_RADIAL)
        } else if (NB_HAS(NB_HAS_RADIAL) && kind >= NB_KIND_RADIAL && kind < NB_KIND_EXCLUDE) {
            integral = nb_radial_integral(profile.level, u, slope, h, kind - NB_KIND_RADIAL + 1).value;
#endif
        }
    }
    return integral;
}
