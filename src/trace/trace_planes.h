/* Rays and light in planes of floats. Included by the float kernels only.
 *
 * A packet is loaded, asked and stored in registers. Where the whole fog is one convex body of constant density, and
 * nobody asks for the error, its packets go a straight way: no contacts, no events, no slack, and no division for rays
 * that miss the body's bounds. It is made of the formulas that the march uses, in their order, and gives the bits that
 * the march would give. */

#define FORCE_INLINE static inline __attribute__((always_inline))
#define NEVER_INLINE static __attribute__((noinline))

/* ---- planes ---------------------------------------------------------------------------------- */

/* Of `count` numbers the lanes beyond repeat the first. */
NEVER_INLINE nb_real gather_floats(const float *plane, size_t stride, size_t first, size_t count)
{
    float lane[NB_WIDTH];
    for (size_t i = 0; i < NB_WIDTH; i++)
        lane[i] = *(const float *)nb_stride_from(plane, stride, first + (i < count ? i : 0));
    return nb_load_lanes(lane);
}

NEVER_INLINE nb_wide gather_doubles(const double *plane, size_t stride, size_t first, size_t count)
{
    double lane[NB_WIDTH];
    for (size_t i = 0; i < NB_WIDTH; i++)
        lane[i] = *(const double *)nb_stride_from(plane, stride, first + (i < count ? i : 0));
    return nb_wload_lanes(lane);
}

NEVER_INLINE void scatter_floats(float *plane, size_t stride, size_t first, size_t count, nb_real x)
{
    float lane[NB_WIDTH];
    nb_store_lanes(lane, x);
    for (size_t i = 0; i < count; i++) *(float *)nb_stride_to(plane, stride, first + i) = lane[i];
}

FORCE_INLINE nb_real load_floats(const float *plane, size_t stride, size_t first, size_t count)
{
    if (stride == sizeof *plane && count == NB_WIDTH) return nb_load_lanes(plane + first);
    return gather_floats(plane, stride, first, count);
}

FORCE_INLINE nb_wide load_doubles(const double *plane, size_t stride, size_t first, size_t count)
{
    if (stride == sizeof *plane && count == NB_WIDTH) return nb_wload_lanes(plane + first);
    return gather_doubles(plane, stride, first, count);
}

FORCE_INLINE nb_wvec3 load_float_vectors(const float *const plane[3], size_t stride, size_t first, size_t count)
{
    return nb_wvec3(nb_widen(load_floats(plane[0], stride, first, count)),
                    nb_widen(load_floats(plane[1], stride, first, count)),
                    nb_widen(load_floats(plane[2], stride, first, count)));
}

FORCE_INLINE nb_wvec3 load_double_vectors(const double *const plane[3], size_t stride, size_t first, size_t count)
{
    return nb_wvec3(load_doubles(plane[0], stride, first, count), load_doubles(plane[1], stride, first, count),
                    load_doubles(plane[2], stride, first, count));
}

/* A plane of NULL is not wanted. */
FORCE_INLINE void store_floats(float *plane, size_t stride, size_t first, size_t count, nb_real x)
{
    if (plane == NULL) return;
    if (stride == sizeof *plane && count == NB_WIDTH)
        nb_store_lanes(plane + first, x);
    else
        scatter_floats(plane, stride, first, count, x);
}

FORCE_INLINE void store_colors(float *const plane[3], size_t stride, size_t first, size_t count, const nb_real color[3])
{
    store_floats(plane[0], stride, first, count, color[0]);
    store_floats(plane[1], stride, first, count, color[1]);
    store_floats(plane[2], stride, first, count, color[2]);
}

/* ---- rays ------------------------------------------------------------------------------------ */

/* What the rays of a call share. */
typedef struct stream {
    const nebel_ray_planes *rays;
    const nebel_transfer_planes *transfers;
    nb_wvec3 origin;
    nb_wvec3 direction; /* of unit length; any where rays have their own */
    int has_offsets, has_directions;
} stream;

static void open_stream(stream *s, const nb_trace_job *job)
{
    s->rays = job->ray_planes;
    s->transfers = job->light_planes;
    s->origin = wide_vector(s->rays->origin);
    s->has_offsets = s->rays->offset[0] != NULL;
    s->has_directions = s->rays->direction_float[0] != NULL || s->rays->direction_double[0] != NULL;
    const double any[3] = {1, 0, 0};
    s->direction = unit_vector(wide_vector(s->has_directions ? any : s->rays->direction));
}

/* Of any length. */
FORCE_INLINE nb_wvec3 load_ways(const stream *s, size_t first, size_t count)
{
    const nebel_ray_planes *rays = s->rays;
    if (rays->direction_float[0] == NULL)
        return load_double_vectors(rays->direction_double, rays->direction_stride, first, count);
    return load_float_vectors(rays->direction_float, rays->direction_stride, first, count);
}

/* NB_WFAR at most; 0 in lanes beyond `count`. */
FORCE_INLINE nb_wide load_ends(const stream *s, size_t first, size_t count)
{
    nb_wide t_max = NB_WFAR;
    if (s->rays->t_max != NULL)
        t_max = nb_wmin(NB_WFAR, nb_widen(load_floats(s->rays->t_max, s->rays->t_max_stride, first, count)));
    if (count == NB_WIDTH) return t_max;
    double lane[NB_WIDTH];
    nb_wstore_lanes(lane, t_max);
    for (size_t i = count; i < NB_WIDTH; i++) lane[i] = 0;
    return nb_wload_lanes(lane);
}

/* A packet as it was loaded; its ways are not of unit length unless all rays share one. */
typedef struct loaded {
    nb_wvec3 start, way;
    nb_wide t_max;
    nb_wide square; /* of the way's length */
} loaded;

FORCE_INLINE nb_wmask are_near(nb_wvec3 p)
{
    const nb_wide most = NB_W(NEBEL_MAX_LENGTH);
    return nb_wand(nb_wand(nb_wabs(p.x) <= most, nb_wabs(p.y) <= most), nb_wabs(p.z) <= most);
}

FORCE_INLINE nb_wmask are_moderate(nb_wide square)
{
    return nb_wand(square > NB_W(1e-200), square < NB_W(1e200));
}

/* A way whose square overflows or vanishes is right, too, but for 0; and a ray of no length may be anything. */
NEVER_INLINE nebel_result mend_rays(nb_trace_job *job, const stream *s, loaded *p, size_t first, size_t count)
{
    job->failed = nb_trace_first_fault(job->ray_planes, first, count);
    if (job->failed < first + count) return NEBEL_ERROR_ARGUMENT;
    const nb_wmask asked = p->t_max > NB_W(0.0);
    const double any[3] = {1, 0, 0};
    p->start = nb_wselect3(asked, p->start, s->origin);
    if (!s->has_directions) return NEBEL_OK;
    p->way = tamed(nb_wselect3(asked, p->way, wide_vector(any)));
    p->square = nb_wdot3(p->way, p->way);
    return NEBEL_OK;
}

FORCE_INLINE nebel_result load_rays(nb_trace_job *job, const stream *s, size_t first, size_t count, loaded *p)
{
    p->start = s->origin;
    p->way = s->direction;
    p->square = NB_W(1.0);
    p->t_max = load_ends(s, first, count);
    nb_wmask sound = p->t_max >= NB_W(0.0);
    if (s->has_offsets) {
        p->start = nb_wadd3(s->origin, load_float_vectors(s->rays->offset, s->rays->offset_stride, first, count));
        sound = nb_wand(sound, are_near(p->start));
    }
    if (s->has_directions) {
        p->way = load_ways(s, first, count);
        p->square = nb_wdot3(p->way, p->way);
        sound = nb_wand(sound, are_moderate(p->square));
    }
    if (nb_wall(sound)) return NEBEL_OK;
    loaded mended = *p; /* whose address keeps it out of registers */
    const nebel_result result = mend_rays(job, s, &mended, first, count);
    *p = mended;
    return result;
}

/* The rays of a packet one by one, as they were given. */
static void unload_rays(const stream *s, const loaded *p, nebel_ray rays[NB_WIDTH])
{
    const nb_wvec3 way = s->has_directions ? p->way : wide_vector(s->rays->direction);
    const nb_wide numbers[7] = {p->start.x, p->start.y, p->start.z, way.x, way.y, way.z, p->t_max};
    double lane[7][NB_WIDTH];
    for (int k = 0; k < 7; k++) nb_wstore_lanes(lane[k], numbers[k]);
    for (size_t i = 0; i < NB_WIDTH; i++)
        rays[i] = (nebel_ray){{lane[0][i], lane[1][i], lane[2][i]}, {lane[3][i], lane[4][i], lane[5][i]}, lane[6][i]};
}

/* ---- light by groups ------------------------------------------------------------------------- */

/* `part` becomes no more than `rest`, and is taken from it. */
FORCE_INLINE void take_part(nb_real *part, nb_real *rest)
{
    *part = nb_max(nb_min(*part, *rest), NB_F(0.0));
    *rest = *rest - *part;
}

/* `radiance` before opacity was limited, `limited` after it. */
NEVER_INLINE void store_groups(const nb_trace_job *job, const workspace *w, size_t first, size_t count,
                               const nb_real radiance[3], const nb_real limited[3])
{
    const nebel_transfer_planes *to = job->light_planes;
    const nebel_transfer_group *local_planes = &to->group[NEBEL_LIGHT_GROUP_LOCAL];
    const size_t stride = to->in_scattering_stride;
    nb_real group[NEBEL_LIGHT_GROUP_COUNT][3];
    for (int c = 0; c < 3; c++) {
        const nb_real scale = limited[c] / nb_max(radiance[c], NB_TINY);
        nb_real rest = radiance[c], none = NB_F(0.0);
        nb_real sun = w->m.sun != NULL ? w->m.sun->by_sun[c] : none;
        nb_real lights = w->m.sun != NULL ? w->m.sun->by_lights[c] : none, own = none;
        if (job->rest == NB_REST_IS_LOCAL) own = rest;
        if (job->rest == NB_REST_IS_BOTH) own = load_floats(local_planes->in_scattering[c], stride, first, count);
        take_part(&sun, &rest);
        take_part(&lights, &rest);
        take_part(&own, &rest);
        group[NEBEL_LIGHT_GROUP_SUN][c] = sun * scale;
        group[NEBEL_LIGHT_GROUP_ENVIRONMENT][c] = rest * scale;
        group[NEBEL_LIGHT_GROUP_LOCAL][c] = (lights + own) * scale;
    }
    for (int i = 0; i < NEBEL_LIGHT_GROUP_COUNT; i++)
        store_colors(to->group[i].in_scattering, stride, first, count, group[i]);
}

/* ---- the march ------------------------------------------------------------------------------- */

static nebel_result march_planes(nb_trace_job *job, workspace *w, const allowance *may, const stream *s, size_t first,
                                 size_t count)
{
    loaded p;
    const nebel_result valid = load_rays(job, s, first, count, &p);
    if (valid != NEBEL_OK) return valid;
    w->m.rays = (packet){p.start, s->has_directions ? normalized(p.way) : p.way, p.t_max};
    gathered_light g;
    const nebel_result result = answer_packet(job, w, may, first, count, &g);
    if (result != NEBEL_OK) return result;
    const nb_real error = job->wants_error ? reported_error(job, &w->m, &g) : NB_F(0.0);
    const nebel_transfer_planes *to = s->transfers;
    const nb_real unlimited[3] = {g.radiance[0], g.radiance[1], g.radiance[2]};
    limit_opacity(job, g.transmittance, g.radiance);
    if (job->wants_groups) store_groups(job, w, first, count, unlimited, g.radiance);
    store_colors(to->transmittance, to->transmittance_stride, first, count, g.transmittance);
    store_colors(to->in_scattering, to->in_scattering_stride, first, count, g.radiance);
    if (!job->wants_error) return NEBEL_OK;
    nebel_ray rays[NB_WIDTH];
    if (nb_any(in_doubt(job, error))) unload_rays(s, &p, rays);
    store_floats(to->error, to->error_stride, first, count, settle_doubts(job, &g, error, rays, sizeof *rays, count));
    return NEBEL_OK;
}

/* ---- the straight way ------------------------------------------------------------------------ */

typedef struct straight {
    const nb_medium *medium;
    const nb_leaf *leaf;
    nb_wvec3 low, high; /* of a box */
    nb_wvec3 from_leaf; /* `origin` in the frame of an aligned leaf */
    nb_wvec3 inverse;   /* of the common direction */
    nb_wvec3 nearest,
        farthest; /* bounds relative to `origin`, with their margin; all of them finite, or nothing is left out */
    int is_box, may_miss;
    int gray, wants_light;
    nb_real extinction[3], light[3], radiance[3];
} straight;

static int is_straight(const nb_trace_job *job)
{
    const nebel_snapshot *snapshot = job->snapshot;
    if (snapshot->medium_count != 1 || job->wants_error || job->wants_groups) return 0;
    const nb_medium *medium = &snapshot->media[0];
    const nb_medium_light *lit = &job->lighting->media[0];
    const int is_lit =
        (lit->scatters_sun || lit->scatters_lights || lit->environment != NULL) && !job->transmittance_only;
    return nb_volume_has_fog(&medium->body) && medium->body.leaf_count == 1 && !medium->emits && !is_lit &&
           medium->body.density.type == NEBEL_DENSITY_CONSTANT &&
           (job->ignore_distances || !nb_volume_has_distances(&medium->body));
}

static nb_wvec3 reciprocals(nb_wvec3 d)
{
    return nb_wvec3(nb_wrcp_bounded(d.x), nb_wrcp_bounded(d.y), nb_wrcp_bounded(d.z));
}

static void open_straight(straight *way, const nb_trace_job *job, const stream *s)
{
    const nb_medium *medium = &job->snapshot->media[0];
    const nb_medium_light *lit = &job->lighting->media[0];
    const double *extinction = medium->body.extinction;
    way->medium = medium;
    way->leaf = &medium->body.leaves[0];
    way->is_box = way->leaf->type == NB_LEAF_BOX && way->leaf->aligned;
    way->low = wide_vector(way->leaf->low);
    way->high = wide_vector(way->leaf->high);
    way->gray = extinction[0] == extinction[1] && extinction[1] == extinction[2];
    way->wants_light = !job->transmittance_only;
    const packet common = {s->origin, s->direction, NB_WFAR};
    way->from_leaf = from_origin(&common, way->leaf);
    way->inverse = reciprocals(s->direction);
    for (int c = 0; c < 3; c++) {
        way->extinction[c] = REAL(extinction[c]);
        way->light[c] = REAL(lit->light[c]);
        way->radiance[c] = REAL(lit->radiance[c]);
    }
    way->may_miss = s->has_directions && !s->has_offsets;
    set_bounds(medium, s->origin, &way->nearest, &way->farthest);
}

/* leaf_interval for one caller, so that what computes slack falls away. */
__attribute__((flatten)) NEVER_INLINE void cross_leaf(const packet *rays, const nb_volume *body, nb_wide *enter,
                                                      nb_wide *leave)
{
    const nb_interval raw = leaf_interval(rays, body, &body->leaves[0]);
    *enter = raw.enter;
    *leave = raw.leave;
}

/* Where the rays are inside, clipped to them; enter >= leave where they are not. */
FORCE_INLINE void cross_body(const straight *way, const stream *s, const loaded *p, nb_wvec3 direction, nb_wide *enter,
                             nb_wide *leave)
{
    const packet rays = {p->start, direction, p->t_max};
    if (way->is_box) {
        const nb_wvec3 from = s->has_offsets ? from_origin(&rays, way->leaf) : way->from_leaf;
        const nb_wvec3 inverse = s->has_directions ? reciprocals(direction) : way->inverse;
        const nb_interval raw = nb_interval_box_across(from, inverse, way->low, way->high, NB_W(0.0));
        *enter = raw.enter;
        *leave = raw.leave;
    } else {
        cross_leaf(&rays, &way->medium->body, enter, leave);
    }
    *enter = nb_wmax(*enter, NB_W(0.0));
    *leave = nb_wmin(*leave, p->t_max);
}

/* gather_closed, pass_piece and limit_radiance for a first and only piece, of length 0 in lanes outside. */
FORCE_INLINE void light_channel(const straight *way, int c, nb_real length, nb_real *transmittance, nb_real *ratio)
{
    const nb_real depth = way->extinction[c] * length;
    *transmittance = nb_exp(-depth);
    if (way->wants_light) *ratio = nb_exp_ratio(depth);
}

FORCE_INLINE nb_real glow(const straight *way, int c, nb_real length, nb_real ratio)
{
    return nb_min(ratio * (way->light[c] * length), way->radiance[c]);
}

FORCE_INLINE void light_piece(const straight *way, nb_real length, nb_real transmittance[3], nb_real radiance[3])
{
    nb_real ratio[3] = {NB_F(0.0), NB_F(0.0), NB_F(0.0)};
    light_channel(way, 0, length, &transmittance[0], &ratio[0]);
    if (way->gray) {
        transmittance[1] = transmittance[2] = transmittance[0];
        ratio[1] = ratio[2] = ratio[0];
    } else {
        light_channel(way, 1, length, &transmittance[1], &ratio[1]);
        light_channel(way, 2, length, &transmittance[2], &ratio[2]);
    }
    radiance[0] = glow(way, 0, length, ratio[0]);
    radiance[1] = glow(way, 1, length, ratio[1]);
    radiance[2] = glow(way, 2, length, ratio[2]);
}

FORCE_INLINE void store_clear(const nebel_transfer_planes *to, size_t first, size_t count)
{
    const nb_real none[3] = {NB_F(0.0), NB_F(0.0), NB_F(0.0)}, all[3] = {NB_F(1.0), NB_F(1.0), NB_F(1.0)};
    store_colors(to->transmittance, to->transmittance_stride, first, count, all);
    store_colors(to->in_scattering, to->in_scattering_stride, first, count, none);
}

FORCE_INLINE nebel_result trace_straight(nb_trace_job *job, const straight *way, const stream *s, size_t first,
                                         size_t count)
{
    const nebel_transfer_planes *to = s->transfers;
    loaded p;
    const nebel_result valid = load_rays(job, s, first, count, &p);
    if (valid != NEBEL_OK) return valid;
    const nb_wide length = nb_wsqrt(p.square);
    if (way->may_miss && all_pass(p.way, length, p.t_max, way->nearest, way->farthest)) {
        store_clear(to, first, count);
        return NEBEL_OK;
    }
    nb_wide enter, leave;
    cross_body(way, s, &p, s->has_directions ? divided(p.way, length) : p.way, &enter, &leave);
    const nb_mask inside = nb_narrow_mask(enter < leave);
    if (!nb_any(inside)) {
        store_clear(to, first, count);
        return NEBEL_OK;
    }
    nb_real transmittance[3], radiance[3];
    light_piece(way, nb_select(inside, nb_narrow(leave - enter), NB_F(0.0)), transmittance, radiance);
    limit_opacity(job, transmittance, radiance);
    store_colors(to->transmittance, to->transmittance_stride, first, count, transmittance);
    store_colors(to->in_scattering, to->in_scattering_stride, first, count, radiance);
    return NEBEL_OK;
}

/* ---- all rays -------------------------------------------------------------------------------- */

static nebel_result trace_planes(nb_trace_job *job, workspace *w, const allowance *may)
{
    stream s;
    open_stream(&s, job);
    nebel_result result = NEBEL_OK;
    for (size_t i = 0; i < job->count && result == NEBEL_OK; i += NB_WIDTH)
        result = march_planes(job, w, may, &s, i, packet_size(job, i));
    return result;
}

/* Flattened, so that packets stay in registers. */
__attribute__((flatten)) NEVER_INLINE nebel_result trace_all_straight(nb_trace_job *job)
{
    stream s;
    straight way;
    open_stream(&s, job);
    open_straight(&way, job, &s);
    nebel_result result = NEBEL_OK;
    for (size_t i = 0; i < job->count && result == NEBEL_OK; i += NB_WIDTH)
        result = trace_straight(job, &way, &s, i, packet_size(job, i));
    return result;
}
