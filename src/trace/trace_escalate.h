/* Rays that touch a surface, or run level with it, to the last digits of a precision have no good answer in it. But
 * they are exact numbers, so that more digits give one.
 *
 * Float keeps its light, whose bits depend on nothing else, and learns from double how good it is. Double takes the
 * answer with more digits instead of its own, whatever is asked of the ray, so that its bits, too, depend on nothing
 * else. Included by trace_kernel.c. */

#if !defined(ASKS_QUAD)

static nb_mask in_doubt(const nb_trace_job *job, nb_real error)
{
    return nb_not(error <= REAL(job->promised));
}

#endif

#if !defined(NB_DOUBLE) || defined(ASKS_QUAD)

static const uint32_t *boundaries_of(const nb_trace_job *job, size_t i)
{
    return job->first_boundary != NULL ? job->first_boundary + i : NULL;
}

#endif

#if !defined(NB_DOUBLE)

static double settle_lane(const nb_trace_job *job, size_t i, const nebel_ray *ray, const nebel_transfer *transfer)
{
    nebel_transfer truth;
    nb_trace_job one = {.snapshot = job->snapshot,
                        .lighting = job->lighting,
                        .max_opacity = job->max_opacity,
                        .budget = job->budget,
                        .promised = job->promised,
                        .transmittance_only = job->transmittance_only,
                        .ignore_distances = job->ignore_distances,
                        .wants_error = 1,
                        .first_boundary = boundaries_of(job, i),
                        .boundaries = job->boundaries,
                        .light_visibility = job->light_visibility,
                        .first_visibility = job->first_visibility + i,
                        .count = 1,
                        .rays = ray,
                        .ray_stride = sizeof *ray,
                        .transfers = &truth,
                        .transfer_stride = sizeof truth};
    if (nb_trace_double(&one) != NEBEL_OK) return transfer->error;
    double apart = 0;
    for (int c = 0; c < 3; c++) {
        apart = fmax(apart, fabs(transfer->transmittance[c] - truth.transmittance[c]));
        if (!job->transmittance_only) apart = fmax(apart, fabs(transfer->in_scattering[c] - truth.in_scattering[c]));
    }
    const double bound = (apart + truth.error) * (1 + 2 * (double)FLT_EPSILON); /* it will be rounded to float */
    return bound < transfer->error ? bound : transfer->error;
}

/* The error where the lanes in doubt are settled; `rays` are those of the packet that was answered last. */
static nb_real settle_doubts(const nb_trace_job *job, const gathered_light *g, nb_real error, const nebel_ray *rays,
                             size_t stride, size_t count)
{
    const nb_mask doubtful = in_doubt(job, error);
    if (!nb_any(doubtful)) return error;
    nb_scalar lane[NB_WIDTH];
    nb_store_lanes(lane, error);
    for (size_t i = 0; i < count; i++) {
        if (!nb_lane(doubtful, i)) continue;
        nebel_transfer transfer = {.error = (double)lane[i]};
        for (int c = 0; c < 3; c++) {
            transfer.transmittance[c] = (double)nb_lane(g->transmittance[c], i);
            transfer.in_scattering[c] = (double)nb_lane(g->radiance[c], i);
        }
        lane[i] = (nb_scalar)settle_lane(job, job->failed + i, nb_stride_from(rays, stride, i), &transfer);
    }
    return nb_load_lanes(lane);
}

#elif defined(ASKS_QUAD)

/* What the ends may do to light of that radiance, or densities that hardly change along endless rays, is far
 * less than double promises, so that it does not show who was asked. */
static int is_clear(const packet_state *m, nb_real radiance)
{
    const nb_real behind = largest(m->all_ends.depth) * nb_max(radiance, NB_F(1.0));
    return behind + largest(m->all_ends.light) + m->drift <= 1e-10;
}

static nebel_result ask_again(nb_trace_job *job, size_t i)
{
    nb_trace_job one = *job;
    one.count = 1;
    one.first_boundary = boundaries_of(job, i);
    one.first_visibility = job->first_visibility + i;
    one.rays = nb_stride_from(job->rays, job->ray_stride, i);
    one.transfers = nb_stride_to(job->transfers, job->transfer_stride, i);
    job->failed = i;
    return nb_trace_quad(&one);
}

#else

enum { MOST_MARCHES = 8 };

/* Ends 1e15 m away are in doubt by millimetres even here. The same light, marched again with its radiance known, has a
 * smaller error, from which the next march learns. */
static nb_real weigh_ends(nb_trace_job *job, workspace *w, const allowance *may, const gathered_light *g, nb_real error)
{
    if (job->transmittance_only || w->m.sun != NULL) return error;
    known_interval total = {{g->radiance[0], g->radiance[1], g->radiance[2]}, error};
    w->m.total = &total;
    for (int i = 0; i < MOST_MARCHES && in_doubt(job, total.error); i++) {
        gathered_light again;
        if (answer_packet(job, w, may, job->failed, 1, &again) != NEBEL_OK) break;
        for (int c = 0; c < 3; c++) again.depth_error[c] = again.depth_error[c] + again.ends_depth[c];
        const nb_real less = reported_error(job, &w->m, &again);
        if (!(less < total.error)) break;
        total.error = less;
    }
    w->m.total = NULL;
    return total.error;
}

#endif
