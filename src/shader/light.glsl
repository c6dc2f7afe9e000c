/* What the light of sun and lamps needs: what phase functions scatter, and the optical depth on its way. */

/* What part of the light that comes from `towards` a medium's phase function sends back along the ray, per steradian. */
float nb_scattered(int scattering, nb_vec3 direction, nb_vec3 towards)
{
    nb_turn turn = nb_turn_between(direction, towards);
    float value = 0.0;
    int lobes = int(NEBEL_WORD(scattering).w);
    for (int i = 1; i <= lobes; i++) {
        nb_vec4 lobe = NEBEL_WORD(scattering + i);
        value += nb_phase_lobe(lobe.x, lobe.y, lobe.z, lobe.w, turn);
    }
    return value;
}

/* ---- depth ----------------------------------------------------------------------------------- */

/* Turns of loops that a stretch took: a few events, at each the leaves and folds. */
int nb_stretch_turns(int leaves, nb_stretch s) { return NB_HAS(NB_HAS_GROUP) && leaves > 1 && s.enter < s.leave ? 8 * leaves : 1; }

nb_vec3 nb_depth_within(int at, nb_ray ray, nb_stretch s)
{
    nb_vec4 extinction = NEBEL_WORD(at);
    return extinction.xyz * min(nb_integral(nb_profile_of(at, int(extinction.w), ray, s.enter), s.leave - s.enter), NB_FAR);
}

/* Voxels on the way to the sun are not walked through. */
nb_vec3 nb_depth_to_light_within(int at, nb_ray ray, nb_stretch s, bool to_sun)
{
    nb_vec4 extinction = NEBEL_WORD(at);
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

#if NB_DECLARES(NB_HAS_BALL)
/* The way along v from a place on a ray to the surface of the ball, or ellipsoid, around it; below 0 where the place is outside. With q the
 * place from the center and R the radius, all in the frame of the body, it is
 *
 *     (sqrt(h^2 + v.v c) - h) / v.v,   h = q.v,   c = R^2 - q.q = d.d (t - enter) (leave - t):
 *
 * by the product a place knows how deep it is in fog so dense that light reaches a skin alone. Of both roots of the quadratic the one that
 * loses no digits, as in src/march/trace_sun_ball.h. Where a piece begins with the body that is to the last bit. */
float nb_ball_way(int leaf, nb_spot spot, nb_vec3 v)
{
    nb_vec4 head = NEBEL_WORD(leaf);
    nb_ray local = nb_turned_ray(leaf, int(head.x) >= NB_TYPE_TURNED, spot.ray);
    nb_vec3 p = local.origin + NEBEL_WORD(leaf + 1).xyz;
    float square = dot(local.direction, local.direction);
    float middle = -dot(p, local.direction) * nb_rcp_bounded(square);
    nb_vec3 closest = p + local.direction * middle;
    float half_chord = sqrt(max((head.y * head.y - dot(closest, closest)) * nb_rcp_bounded(square), 0.0));
    float gap = spot.start - (middle - half_chord);
    if (abs(gap) <= nb_nearest(abs(middle) + half_chord)) gap = 0.0;
    float entered = gap + spot.from;
    float left = 2.0 * half_chord - entered;
    if (!(entered >= 0.0 && left > 0.0)) return -1.0;
    float h = dot(closest + local.direction * (entered - half_chord), v);
    float root = sqrt(h * h + dot(v, v) * square * entered * left);
    return h > 0.0 ? square * entered * left / max(h + root, NB_TINY) : (root - h) * nb_rcp_bounded(dot(v, v));
}
#endif

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
#if NB_DECLARES(NB_HAS_BALL)
    int leaf = at + NB_MEDIUM_LEAF;
    int type = int(NEBEL_WORD(leaf).x);
    bool is_ball = leaves == 1 && (type == NB_TYPE_BALL || type == NB_TYPE_BALL + NB_TYPE_TURNED);
    if (NB_HAS(NB_HAS_BALL) && media.is_way && is_ball)
        way = nb_ball_way(leaf, media.spot, nb_turned_ray(leaf, type >= NB_TYPE_TURNED, ray).direction);
#endif
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
        int leaves = int(NEBEL_WORD(at + 2).w);
        float t = from;
        if (NB_HAS(NB_HAS_COVER) && (nb_is_covered(at, floor) || int(NEBEL_WORD(at).w) == NB_KIND_EXCLUDE)) {
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
        int flags = int(NEBEL_WORD(at + 1).w);
        turns++;
        if ((flags & NB_LIGHT_COVERS) == 0) continue;
        int leaves = int(NEBEL_WORD(at + 2).w);
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
#if NB_DECLARES(NB_HAS_COVER)
    float t = 0.0;
    nb_ray part = ray;
#ifndef NEBEL_PLAIN_FEATURES
    if (!NB_HAS(NB_HAS_COVER)) return nb_added_depth(ray, media, 0.0, 0, turns);
#endif
    while (t < ray.t_max) {
        nb_cover cover = nb_cover_at(ray, media, t, turns);
        part.t_max = cover.end;
        depth += nb_added_depth(part, media, t, cover.floor, turns);
        t = cover.end;
    }
#elif NB_DECLARES(NB_HAS_SUN | NB_HAS_LAMPS)
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
    media.count = NB_HAS(NB_HAS_SEVERAL) ? int(NEBEL_WORD(0).x) : 1;
    media.listed = false;
    media.to_sun = to_sun;
    media.is_way = true;
    media.spot = spot;
    return nb_depth_of(ray, media, turns);
}
