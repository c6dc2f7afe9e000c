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
    if (NB_HAS(NB_HAS_GRID) && NB_HAS(NB_HAS_SUN) && to_sun && int(extinction.w) == NB_KIND_GRID)
        depth = extinction.xyz * nb_amount_to_sun(at, ray, s);
    else
        depth = nb_depth_within(at, ray, s);
    return depth;
}

/* Where no medium covers another. */
nb_vec3 nb_added_depth(nb_ray ray, int count, bool to_sun, inout int turns)
{
    nb_vec3 depth = nb_splat3(0.0);
    for (int i = 0; i < count; i++) {
        int at = NB_HEADER_WORDS + NB_MEDIUM_WORDS * i;
        int leaves = int(NEBEL_WORD(at + 2).w);
        float from = 0.0;
        for (int part = 0; part < (NB_HAS(NB_HAS_GROUP) ? leaves : 1); part++) {
            nb_stretch s = nb_next_stretch(at, leaves, ray, from);
            turns += nb_stretch_turns(leaves, s);
            if (!(s.enter < s.leave)) break;
            depth += nb_depth_to_light_within(at, ray, s, to_sun);
            from = s.leave;
        }
    }
    return depth;
}

/* Where some may: from event to event, each time first to find the next event and what covers, then to sum. Media come by rank. */
nb_vec3 nb_covered_depth(nb_ray ray, int count, bool to_sun, inout int turns)
{
    nb_vec3 depth = nb_splat3(0.0);
    float t = 0.0;
    float end = ray.t_max;
    int floor = 0;
    bool summing = false;
    while (t < ray.t_max) {
        for (int i = 0; i < count; i++) {
            int at = NB_HEADER_WORDS + NB_MEDIUM_WORDS * i;
            int leaves = int(NEBEL_WORD(at + 2).w);
            int flags = int(NEBEL_WORD(at + 1).w);
            if (summing && flags / NB_LIGHT_RANK < floor) continue;
            nb_stretch s = nb_next_stretch(at, leaves, ray, t);
            turns += nb_stretch_turns(leaves, s);
            if (!(s.enter < s.leave)) continue;
            if (!summing) {
                end = min(end, s.enter > t ? s.enter : s.leave);
                if (s.enter <= t && (flags & NB_LIGHT_COVERS) != 0) floor = max(floor, flags / NB_LIGHT_RANK);
            } else if (s.enter <= t && int(NEBEL_WORD(at).w) != NB_KIND_EXCLUDE) {
                depth += nb_depth_to_light_within(at, ray, nb_stretch_of(t, end), to_sun);
            }
        }
        if (summing) {
            t = end;
            end = ray.t_max;
            floor = 0;
        }
        summing = !summing;
    }
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
    int count = NB_HAS(NB_HAS_SEVERAL) ? int(NEBEL_WORD(0).x) : 1;
    if (NB_HAS(NB_HAS_COVER)) return nb_covered_depth(ray, count, to_sun, turns);
    return nb_added_depth(ray, count, to_sun, turns);
}
