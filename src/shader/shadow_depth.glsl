/* What the light of sun and point lights needs: what phase functions scatter, and the optical depth on its way. */

/* What part of the light that comes from `towards` a medium's phase function sends back along the ray, per steradian. */
float nb_scattered(int scattering, nb_vec3 direction, nb_vec3 towards)
{
    nb_turn turn = nb_turn_between(direction, towards);
    float value = 0.0;
    int lobes = int(NEBEL_FOG_TEXEL(scattering).w);
    for (int i = 1; i <= lobes; i++) {
        nb_vec4 lobe = NEBEL_FOG_TEXEL(scattering + i);
        value += nb_phase_lobe(lobe.x, lobe.y, lobe.z, lobe.w, turn);
    }
    return value;
}

/* ---- depth ----------------------------------------------------------------------------------- */

/* Turns of loops that a stretch took: a few events, at each the leaves and folds. */
int nb_stretch_turns(int leaves, nb_stretch s) { return NB_HAS(NB_HAS_GROUP) && leaves > 1 && s.enter < s.leave ? 8 * leaves : 1; }

nb_vec3 nb_depth_within(int at, nb_ray ray, nb_stretch s)
{
    nb_vec4 extinction = NEBEL_FOG_TEXEL(at);
    return extinction.xyz * min(nb_integral(nb_profile_of(at, int(extinction.w), ray, s.enter), s.leave - s.enter), NB_FAR);
}

/* Voxels on the way to the sun are not walked through. */
nb_vec3 nb_depth_to_light_within(int at, nb_ray ray, nb_stretch s, bool to_sun)
{
    nb_vec4 extinction = NEBEL_FOG_TEXEL(at);
    nb_vec3 depth = nb_splat3(0.0);
    bool walked = true;
#if NB_DECLARES(NB_HAS_GRID) && NB_DECLARES(NB_HAS_SUN)
    walked = !(NB_HAS(NB_HAS_GRID) && NB_HAS(NB_HAS_SUN) && to_sun && int(extinction.w) == NB_KIND_GRID);
    if (!walked) depth = extinction.xyz * nb_amount_to_sun(at, ray, s);
#endif
    if (walked) depth = nb_depth_within(at, ray, s);
    return depth;
}

/* A place on a ray, `from` metres behind `start`, that keeps digits which its coordinates have lost. */
struct nb_spot {
    nb_ray ray;
    float start, from;
};

nb_spot nb_spot_on(nb_ray ray, float start, float from)
{
    nb_spot spot;
    spot.ray = ray;
    spot.start = start;
    spot.from = from;
    return spot;
}

/* ---- ways out ---------------------------------------------------------------------------------
 *
 * The way from a place on a ray to where it leaves the body around it, below 0 where the place is outside. In fog so dense that light reaches
 * a skin alone that is thinner than what places are told apart by, so that a place knows how deep it is from where the ray entered: depths
 * are polynomials along the ray, from the spot's start, where they are 0 if floats do not tell them from that. */

/* Distances to planes, `there` at the origin of the spot's ray, that grow by `rate` along it; `near` is what floats lose of them. */
nb_vec3 nb_spot_heights(nb_spot spot, nb_vec3 there, nb_vec3 rate, float near)
{
    nb_vec3 height = there + rate * spot.start;
    return height * step(nb_splat3(near), abs(height)) + rate * spot.from;
}

#if NB_DECLARES(NB_HAS_BOX)
float nb_box_way(int leaf, nb_spot spot, nb_ray local, nb_vec3 v, float near)
{
    nb_vec3 inverse = nb_vec3(nb_rcp_bounded(v.x), nb_rcp_bounded(v.y), nb_rcp_bounded(v.z));
    nb_vec3 low = nb_spot_heights(spot, NEBEL_FOG_TEXEL(leaf + 1).xyz - local.origin, -local.direction, near);
    nb_vec3 high = nb_spot_heights(spot, NEBEL_FOG_TEXEL(leaf + 2).xyz - local.origin, -local.direction, near);
    return nb_largest(max(low, -high)) > 0.0 ? -1.0 : nb_smallest(max(low * inverse, high * inverse));
}
#endif

#if NB_DECLARES(NB_HAS_PLANES)
float nb_planes_way_out(int first, int count, nb_spot spot, nb_vec3 v, float near)
{
    float way = NB_FAR;
    for (int i = 0; i < count; i++) {
        nb_vec4 face = NEBEL_FOG_TEXEL(first + i);
        float there = face.w - dot(face.xyz, spot.ray.origin);
        float noise = near * dot(abs(face.xyz), nb_splat3(1.0));
        float height = nb_spot_heights(spot, nb_splat3(there), nb_splat3(-dot(face.xyz, spot.ray.direction)), noise).x;
        float rise = dot(face.xyz, v);
        if (height < 0.0) return -1.0;
        if (rise > 0.0) way = min(way, height * nb_rcp_bounded(rise));
    }
    return way;
}
#endif

#define NB_HAS_ROUND (NB_HAS_SPHERE | NB_HAS_CYLINDER | NB_HAS_CONE | NB_HAS_CAPSULE)
#if NB_DECLARES(NB_HAS_ROUND)
/* What is round is where x x + y y + ball z z - w w < 0, w its radius at z: of a place p at the spot's start, d along the ray and v along the
 * way, each with what it adds to w. The first number is that form at the spot. The other is where the way leaves: of both roots of
 *
 *     curve s^2 + 2 rise s + level = 0,   level <= 0,
 *
 * the one ahead, such that no digits are lost, as in src/trace/trace_sun_sphere.h; along the nappe of a cone there may be none. */
nb_vec2 nb_round_way(nb_spot spot, nb_vec4 p, nb_vec4 d, nb_vec4 v, float ball, float near)
{
    nb_vec4 signs = nb_vec4(1.0, 1.0, ball, -1.0);
    float level = dot(p * signs, p);
    if (abs(level) <= 2.0 * p.w * near) level = 0.0;
    level += spot.from * (2.0 * dot(p * signs, d) + spot.from * dot(d * signs, d));
    float rise = dot((p + d * spot.from) * signs, v);
    float curve = dot(v * signs, v);
    float root = sqrt(max(rise * rise - curve * level, 0.0));
    float way = NB_FAR;
    if (rise > 0.0 && rise * rise >= curve * level)
        way = -level / max(rise + root, NB_TINY);
    else if (rise <= 0.0 && curve > 0.0)
        way = (root - rise) * nb_rcp_bounded(curve);
    return nb_vec2(level, way);
}

float nb_round_way_out(int leaf, int type, nb_spot spot, nb_ray local, nb_vec3 v, float near)
{
    nb_vec4 head = NEBEL_FOG_TEXEL(leaf);
    float ball = type == NB_TYPE_SPHERE ? 1.0 : 0.0;
    float radius = type == NB_TYPE_SPHERE || type == NB_TYPE_CONE ? head.y : 1.0;
    float slope = type == NB_TYPE_CONE ? head.z : 0.0;
    near += 8.0 * NB_EPSILON * radius;
    nb_vec3 d = local.direction;
    nb_vec3 origin = local.origin + NEBEL_FOG_TEXEL(leaf + 1).xyz;
    nb_vec4 p = nb_vec4(origin + d * spot.start, 0.0);
    p.w = radius + slope * p.z;
    nb_vec4 along = nb_vec4(d, slope * d.z);
    nb_vec4 to = nb_vec4(v, slope * v.z);
    nb_vec2 side = nb_round_way(spot, p, along, to, ball, near);
    float way = side.x > 0.0 ? -1.0 : side.y;
#if NB_DECLARES(NB_HAS_CYLINDER | NB_HAS_CONE | NB_HAS_CAPSULE)
    if (type != NB_TYPE_SPHERE) {
        float length = type == NB_TYPE_CAPSULE ? head.y : 1.0;
        nb_vec2 ends = nb_spot_heights(spot, nb_vec3(-origin.z, length - origin.z, 0.0), nb_splat3(-d.z), near).xy;
        bool between = ends.x <= 0.0 && ends.y >= 0.0;
        float inverse = nb_rcp_bounded(v.z);
        if (type != NB_TYPE_CAPSULE) {
            way = between ? min(way, max(ends.x * inverse, ends.y * inverse)) : -1.0;
#if NB_DECLARES(NB_HAS_CAPSULE)
        } else {
            nb_vec4 shift = nb_vec4(0.0, 0.0, length, 0.0);
            nb_vec2 start = nb_round_way(spot, p, along, to, 1.0, near);
            nb_vec2 end = nb_round_way(spot, p - shift, along, to, 1.0, near);
            bool inside = (between && side.x <= 0.0) || start.x <= 0.0 || end.x <= 0.0;
            if (side.y * v.z < ends.x) side.y = start.y;
            else if (side.y * v.z > ends.y) side.y = end.y;
            way = inside ? side.y : -1.0;
#endif
        }
    }
#endif
    return way;
}
#endif

float nb_way_out(int leaf, nb_spot spot, nb_vec3 v)
{
    int type = int(NEBEL_FOG_TEXEL(leaf).x);
    bool turned = type >= NB_TYPE_ROTATED;
    if (turned) type -= NB_TYPE_ROTATED;
    nb_ray to = spot.ray;
    to.direction = v;
    nb_ray local = nb_turned_ray(leaf, turned, spot.ray);
    to = nb_turned_ray(leaf, turned, to);
    float near = 8.0 * NB_EPSILON * spot.start * sqrt(dot(local.direction, local.direction));
    float way = -1.0;
#if NB_DECLARES(NB_HAS_ROUND)
    if (NB_HAS(NB_HAS_ROUND) && type >= NB_TYPE_SPHERE) way = nb_round_way_out(leaf, type, spot, local, to.direction, near);
#endif
#if NB_DECLARES(NB_HAS_BOX)
    if (NB_HAS(NB_HAS_BOX) && type == NB_TYPE_BOX) way = nb_box_way(leaf, spot, local, to.direction, near);
#endif
#if NB_DECLARES(NB_HAS_PLANES)
    nb_vec4 head = NEBEL_FOG_TEXEL(leaf);
    if (NB_HAS(NB_HAS_PLANES) && type == NB_TYPE_PLANES) way = nb_planes_way_out(int(head.z), int(head.y), spot, v, near);
#endif
    return way;
}

/* The media from `first` on that a depth asks for. */
struct nb_media {
    int first, count;
    bool listed;
    bool to_sun; /* that is where the ray goes */
    bool is_way; /* of light, from the spot on */
    nb_spot spot;
};

/* Where a body next has a way of light inside. */
nb_stretch nb_next_way(int at, int leaves, nb_ray ray, nb_media media, float from)
{
    float way = -1.0;
    if (media.is_way && leaves == 1) way = nb_way_out(at + NB_MEDIUM_LEAF, media.spot, ray.direction);
    nb_stretch s = nb_stretch_of(from, min(way, ray.t_max));
    if (!(way >= 0.0)) s = nb_next_stretch(at, leaves, ray, from);
    return s;
}

/* From `from` to the end of the ray, of what ranks from `floor` on. */
nb_vec3 nb_added_depth(nb_ray ray, nb_media media, float from, int floor, inout int turns)
{
    nb_vec3 depth = nb_splat3(0.0);
    for (int i = 0; i < media.count; i++) {
        int at = nb_medium_at(media.first + i, media.listed);
        int leaves = int(NEBEL_FOG_TEXEL(at + 2).w);
        float t = from;
        if (NB_HAS(NB_HAS_OVERRIDE) && (nb_is_covered(at, floor) || int(NEBEL_FOG_TEXEL(at).w) == NB_KIND_EXCLUDE)) {
            turns++;
            continue;
        }
        for (int part = 0; part < (NB_HAS(NB_HAS_GROUP) ? leaves : 1); part++) {
            nb_stretch s = nb_next_way(at, leaves, ray, media, t);
            turns += nb_stretch_turns(leaves, s);
            if (!(s.enter < s.leave)) break;
            depth += nb_depth_to_light_within(at, ray, s, media.to_sun);
            t = s.leave;
        }
    }
    return depth;
}

/* The highest rank that covers at t, and up to where on the ray it is that. */
struct nb_cover {
    int floor;
    float end;
};

nb_cover nb_cover_at(nb_ray ray, nb_media media, float t, inout int turns)
{
    nb_cover cover;
    cover.floor = 0;
    cover.end = ray.t_max;
    for (int i = 0; i < media.count; i++) {
        int at = nb_medium_at(media.first + i, media.listed);
        int flags = int(NEBEL_FOG_TEXEL(at + 1).w);
        turns++;
        if ((flags & NB_LIGHT_COVERS) == 0) continue;
        int leaves = int(NEBEL_FOG_TEXEL(at + 2).w);
        nb_stretch s = nb_next_stretch(at, leaves, ray, t);
        turns += nb_stretch_turns(leaves, s);
        if (!(s.enter < s.leave)) continue;
        cover.end = min(cover.end, s.enter > t ? s.enter : s.leave);
        if (s.enter <= t) cover.floor = max(cover.floor, flags / NB_LIGHT_RANK);
    }
    return cover;
}

/* Where some may cover others: a sum between each two places where what covers changes. */
nb_vec3 nb_depth_of(nb_ray ray, nb_media media, inout int turns)
{
    nb_vec3 depth = nb_splat3(0.0);
#if NB_DECLARES(NB_HAS_OVERRIDE)
    float t = 0.0;
    nb_ray part = ray;
#ifndef NEBEL_FEATURES_LITERAL
    if (!NB_HAS(NB_HAS_OVERRIDE)) return nb_added_depth(ray, media, 0.0, 0, turns);
#endif
    while (t < ray.t_max) {
        nb_cover cover = nb_cover_at(ray, media, t, turns);
        part.t_max = cover.end;
        depth += nb_added_depth(part, media, t, cover.floor, turns);
        t = cover.end;
    }
#elif NB_DECLARES(NB_HAS_SUN | NB_HAS_LIGHTS)
    depth = nb_added_depth(ray, media, 0.0, 0, turns);
#endif
    return depth;
}

/* As far as `reach` into the direction; `start` and `cutoff` of volumes do not count. `to_sun`: that is where it goes. Adds the turns of
 * loops it took. */
nb_vec3 nb_depth_to_light(nb_spot spot, nb_vec3 direction, float reach, bool to_sun, inout int turns)
{
    nb_ray ray;
    ray.origin = spot.ray.origin + spot.ray.direction * (spot.start + spot.from);
    ray.direction = direction;
    ray.t_max = reach;
    ray.from_eye = false;
    nb_media media;
    media.first = 0;
    media.count = NB_HAS(NB_HAS_SEVERAL) ? int(NEBEL_FOG_TEXEL(0).x) : 1;
    media.listed = false;
    media.to_sun = to_sun;
    media.is_way = true;
    media.spot = spot;
    return nb_depth_of(ray, media, turns);
}
