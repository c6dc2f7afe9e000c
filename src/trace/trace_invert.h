/* Visibility: where along a ray the optical depth reaches a value. Included by the double kernels only.
 *
 * Optical depth never falls along a ray, and is exact at every point, so the piece that holds the place is found by the
 * march and the place in it by Newton's method, kept inside a shrinking bracket. */

/* Optical depth of one channel over h metres of a marked piece, and the extinction at its end. */
static nb_real depth_within(const packet_state *m, int channel, nb_wide start, nb_real h, nb_real *extinction)
{
    nb_real depth = NB_F(0.0);
    *extinction = NB_F(0.0);
    for (size_t i = m->present_first; i < m->present_end; i++) {
        const medium_hit *k = present(m, i);
        depth = depth + k->extinction[channel] * contact_integral(k, start, start + nb_widen(h), h).value;
        *extinction = *extinction + k->extinction[channel] * contact_density(k, start + nb_widen(h));
    }
    return depth;
}

/* Between bounds many magnitudes apart the middle that halves the search is the geometric one. */
static nb_real middle_of(nb_real low, nb_real high)
{
    if (low > 0 && high > NB_F(4.0) * low) return nb_sqrt(low * high);
    const nb_real middle = NB_F(0.5) * (low + high);
    return low == 0 && high > NB_F(1.0) ? nb_min(NB_F(1.0), middle) : middle;
}

/* The h within `length` at which the depth is `wanted`. A step of Newton's that is not half the one before would come
 * too late: down an exponential it moves by one scale height each time. */
static nb_real find_in_piece(const packet_state *m, int channel, nb_wide start, nb_real length, nb_real wanted)
{
    nb_real low = NB_F(0.0), high = length, h = NB_F(0.5) * length, last = length;
    for (int i = 0; i < 400 && high - low > NB_F(2.0) * NB_EPSILON * high; i++) {
        nb_real extinction;
        const nb_real excess = depth_within(m, channel, start, h, &extinction) - wanted;
        if (excess == 0) return h;
        if (excess > 0)
            high = h;
        else
            low = h;
        const nb_real newton = h - excess / extinction;
        const int trusted = newton > low && newton < high && nb_abs(newton - h) <= NB_F(0.5) * last;
        const int close = nb_abs(excess) <= NB_F(1e-3) * wanted;
        if (trusted && close && nb_abs(newton - h) <= NB_EPSILON * h) return newton;
        const nb_real next = trusted ? newton : middle_of(low, high);
        last = nb_abs(next - h);
        h = next;
    }
    return h;
}

static double find_depth(packet_state *m, int channel, nb_real wanted)
{
    nb_real depth = NB_F(0.0);
    nb_wide t = NB_W(0.0);
    ray_segment p;
    m->overlap_set.is_walking = nb_any(m->overlap_set.lanes);
    open_window(m, nb_any(ends_matter(m)));
    while (next_piece(m, t, m->rays.t_max > t, &p)) {
        if (mark_inside(m, &p)) {
            nb_real extinction;
            const nb_real within = depth_within(m, channel, t, p.length, &extinction);
            if (depth + within >= wanted)
                return (double)(t + nb_widen(find_in_piece(m, channel, t, p.length, wanted - depth)));
            depth = depth + within;
        }
        t = p.end;
    }
    return HUGE_VAL;
}

nebel_result NB_SUFFIXED(nb_invert_)(nb_invert_job *job)
{
    workspace w;
    open_workspace(&w);
    w.m.wants_error = 1;
    w.m.ignores_distances = 0;
    nebel_result result = NEBEL_OK;
    for (size_t i = 0; i < job->count && result == NEBEL_OK; i++) {
        const nebel_ray *ray = nb_stride_from(job->rays, job->ray_stride, i);
        w.m.rays = load_packet(ray, job->ray_stride, 1);
        if (!meet_fog(&w, &job->snapshot->unlit)) {
            result = NEBEL_ERROR_MEMORY;
#if defined(ASKS_QUAD)
        } else if (!is_clear(&w.m, NB_F(0.0))) {
            nb_invert_job one = {job->snapshot, job->depth, job->channel, 1, ray, job->ray_stride, &job->distances[i]};
            result = nb_invert_quad(&one);
#endif
        } else {
            job->distances[i] = find_depth(&w.m, job->channel, job->depth);
        }
    }
    close_workspace(&w, &job->snapshot->allocator);
    return result;
}
