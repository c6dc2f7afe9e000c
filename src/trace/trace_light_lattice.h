/* How much of voxels lies between places and a point light, from its lattice (light/light_lattice.h), in float. Included by
 * trace_sun.h. */

/* From a place on each of the lines of `k` that has so far to go. */
static nb_estimate amount_by_lattice(const medium_hit *k, const nb_light_lattice *l, nb_wide t, nb_real reach)
{
    const nb_wvec3 at = nb_wadd3(k->offset, nb_wscale3(k->slope, t));
    const nb_wide place[3] = {at.x, at.y, at.z};
    const nb_wide row = WIDE(l->count[0]), layer = WIDE((double)l->count[0] * l->count[1]);
    nb_wide first[3];
    nb_real v[8], share[3];
    for (int i = 0; i < 3; i++) {
        const nb_wide inner =
            clamp_wide((place[i] - WIDE(l->first)) * WIDE(l->per_cell[i]), NB_W(0.0), WIDE(l->count[i] - 1));
        first[i] = nb_wmin(whole_below(inner), WIDE(l->count[i] - 2));
        share[i] = nb_narrow(inner - first[i]);
    }
    const nb_wide corner = (first[2] * layer + first[1] * row) + first[0];
    for (int n = 0; n < 8; n++) {
        const nb_wide beside = WIDE(n % 2) + (n & 2 ? row : NB_W(0.0)) + (n & 4 ? layer : NB_W(0.0));
        v[n] = nb_gather(l->mean, corner + beside);
    }
    const nb_wide cell = (first[2] * WIDE(l->count[1] - 1) + first[1]) * WIDE(l->count[0] - 1) + first[0];
    return (nb_estimate){within_corners(v, share) * reach, nb_gather(l->deviation, cell) * reach};
}
