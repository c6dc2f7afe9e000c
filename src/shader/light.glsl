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

/* The media from `first` on that a depth asks for. */
struct nb_media {
    int first, count;
    bool listed;
    bool to_sun; /* that is where the ray goes */
};

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
            nb_stretch s = nb_next_stretch(at, leaves, ray, t);
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
nb_vec3 nb_depth_to_light(nb_vec3 place, nb_vec3 direction, float reach, bool to_sun, inout int turns)
{
    nb_ray ray;
    ray.origin = place;
    ray.direction = direction;
    ray.t_max = reach;
    ray.from_eye = false;
    nb_media media;
    media.first = 0;
    media.count = NB_HAS(NB_HAS_SEVERAL) ? int(NEBEL_WORD(0).x) : 1;
    media.listed = false;
    media.to_sun = to_sun;
    return nb_depth_of(ray, media, turns);
}
