/* A packet of rays and the fog on it: intervals of a leaf. Included by trace_kernel.c once the vocabulary of
 * formulas/prelude.h is there. */

/* The double reference keeps the digits that resolving had. */
#if defined(NB_QUAD)
#define FRAME(leaf, member) ((leaf)->quad_##member)
#define ORIGIN_ERROR(leaf) ((leaf)->resolved_error)
#elif defined(NB_DOUBLE)
#define FRAME(leaf, member) ((leaf)->exact_##member)
#define ORIGIN_ERROR(leaf) ((leaf)->resolved_error)
#else
#define FRAME(leaf, member) ((leaf)->member)
#define ORIGIN_ERROR(leaf) ((leaf)->origin_error)
#endif
#if defined(NB_DOUBLE)
#define WIDE(x) ((nb_wide)(x))
#define REAL(x) ((nb_real)(x))
#else
#define WIDE(x) nb_wsplat((double)(x))
#define REAL(x) nb_splat((float)(x))
#endif

typedef struct packet {
    nb_wvec3 origin, direction; /* the direction has unit length */
    nb_wide t_max;              /* NB_WFAR at most; 0 in lanes without a ray */
} packet;

typedef struct leaf_span {
    nb_wide enter, leave;             /* clipped to where the medium acts; enter >= leave where there is nothing */
    nb_real enter_slack, leave_slack; /* by how much they may be off */
} leaf_span;

/* A medium as the packet meets it. */
typedef struct medium_hit {
    const nb_medium *medium;
    const nb_medium_light *lit;
    size_t first_span;
    nb_wide hull_enter, hull_leave; /* from the first entry to the last exit */
    nb_real extinction[3], light[3], radiance[3];
    nb_real glow[3];        /* radiance per metre that full sunlight adds where the density is 1 */
    nb_real point_lights;   /* radiance that opaque fog has of all point lights, at most */
    double least_slack;     /* the length over which the medium's extinction and light come to 1 */
    nb_wvec3 offset, slope; /* affine profile coordinates: offset + slope t */
    nb_wvec3 size;          /* soft edge: half widths of a box; `ends` of a round body */
    nb_real level;          /* gaussian: m; radial: c */
    nb_real noise;          /* of the density, from the rounding of the frame; height, altitude: relative to it */
    nb_real drift;          /* linear: what the density may be off by per metre of the ray, besides */
    nb_mask inside;         /* within the current piece of the ray */
    nb_wvec3 side;          /* soft edge of a round body */
    double steepest;        /* soft edge: density per metre at most */
    nb_arc arc;             /* altitude; slope.x is the most that its coordinate changes by per metre */
    nb_chord deep;          /* the same: where the density is at its most */
} medium_hit;

/* What ends that may be off can do to optical depth and to radiance. */
typedef struct interval_ends {
    nb_real depth[3], light[3];
} interval_ends;

/* See trace_overlap_set.h. */
typedef struct overlap_event overlap_event;
typedef struct overlap_sum overlap_sum;

typedef struct overlap_set {
    nb_mask lanes;                                             /* with such a set */
    int is_walking;                                            /* whether the walk is that of these lanes */
    int64_t rank;                                              /* of all its media */
    nb_mask is_even;                                           /* all have one radiance, */
    nb_real radiance[3];                                       /* this one */
    size_t seats;                                              /* of each lane, a power of two */
    overlap_event *events;                                     /* 2 seats for each lane, sorted */
    overlap_sum *sums;                                         /* 2 seats for each lane: [1] is the root */
    size_t count[NB_WIDTH], next[NB_WIDTH], present[NB_WIDTH]; /* events, those passed, media that are there */
    void *memory;
    size_t capacity; /* seats that there is memory for */
} overlap_set;

/* The light of the whole ray, as a march has found it before. */
typedef struct known_interval {
    nb_real radiance[3], error;
} known_interval;

typedef struct packet_state {
    packet rays;
    int wants_error;                 /* 0: media that no ray comes near may be left out */
    const known_interval *total;     /* NULL the first time */
    struct sunlight *sun;            /* NULL where sunlight is not asked for, or none is there */
    nb_real point_lights;            /* irradiance of all point lights on the rays, at most */
    int wants_sky;                   /* 0: light is not asked for, and the sky's may be taken for its most */
    const nb_environment_light *sky; /* the last that a medium had, NULL: none yet, */
    nb_real sky_light[3];            /* and what comes of it along the rays */
    int ignores_distances;
    int wants_signature;
    nb_real signature; /* see sign_piece */
    size_t contact_count, span_count;
    medium_hit *contacts;
    leaf_span *spans;
    nb_real event_count;        /* two for every leaf that the lane's ray meets, whatever its company meets */
    interval_ends all_ends;     /* what the ends may do if nothing attenuates it, */
    interval_ends grazing_ends; /* and those of them that are no events */
    nb_real revealed[3];        /* optical depth that covers may take away which are no events */
    nb_wide doubt_from; /* from here on fog may be or not, more than a first order tells; NB_WFAR * 2: nowhere */
    nb_real doubtful_radiance[3]; /* of the brightest medium whose ends have slack */
    nb_real drift;                /* what drift of densities along planes may do to optical depth and to radiance */

    uint32_t *window; /* the contacts that the walk looks at, ascending; see trace_active_set.h */
    size_t window_count;
    uint32_t *
        present; /* the contacts within the current piece in any lane: of the window from present_first on, the overlap set */
    size_t present_first, present_end;
    double window_end;                 /* up to here they are all there are */
    struct active_interval *stretches; /* of all contacts, by their first places */
    double *lasts;                     /* of all contacts */
    size_t stretch_count;
    size_t entered; /* how many of the stretches the window has had */
    overlap_set overlap_set;
    const nb_estimate
        *whole; /* the integral of the density of the only medium of the piece at hand, where it is known */
} packet_state;

/* What the rounding of a dot product is relative to. */
static nb_wide products(nb_wvec3 a, nb_wvec3 b)
{
    return nb_wabs(a.x * b.x) + nb_wabs(a.y * b.y) + nb_wabs(a.z * b.z);
}

static nb_wvec3 wide_vector(const double v[3])
{
    return nb_wvec3(WIDE(v[0]), WIDE(v[1]), WIDE(v[2]));
}

/* The ray in a leaf's frame, and the rounding noise of its coordinates near the shape: that of the difference from the
 * frame's origin and that of the direction over the way there. */
typedef struct local_ray {
    nb_wvec3 p, d;
    nb_wide reach;
} local_ray;

static nb_wvec3 from_origin(const packet *rays, const nb_leaf *leaf)
{
#if defined(NB_QUAD)
    return nb_wsub3(rays->origin, nb_wvec3(leaf->quad_origin[0], leaf->quad_origin[1], leaf->quad_origin[2]));
#elif defined(NB_DOUBLE)
    const nb_wvec3 origin = nb_wvec3(leaf->exact_origin[0], leaf->exact_origin[1], leaf->exact_origin[2]);
    const nb_wvec3 rest = nb_wvec3(leaf->exact_rest[0], leaf->exact_rest[1], leaf->exact_rest[2]);
    return nb_wsub3(nb_wsub3(rays->origin, origin), rest);
#else
    return nb_wsub3(nb_wsub3(rays->origin, wide_vector(leaf->origin)), wide_vector(leaf->origin_rest));
#endif
}

static nb_wvec3 in_frame(const nb_leaf *leaf, nb_wvec3 v)
{
    nb_wvec3 row[3];
    if (leaf->aligned) return v;
    for (int i = 0; i < 3; i++)
        row[i] = nb_wvec3(WIDE(FRAME(leaf, matrix)[3 * i]), WIDE(FRAME(leaf, matrix)[3 * i + 1]),
                          WIDE(FRAME(leaf, matrix)[3 * i + 2]));
    return nb_wvec3(nb_wdot3(row[0], v), nb_wdot3(row[1], v), nb_wdot3(row[2], v));
}

static local_ray localize(const packet *rays, const nb_leaf *leaf)
{
    const nb_wvec3 p = from_origin(rays, leaf);
    local_ray local = {in_frame(leaf, p), in_frame(leaf, rays->direction), NB_W(0.0)};
    nb_wide distance = nb_wabs(p.x) + nb_wabs(p.y) + nb_wabs(p.z);
    if (!leaf->aligned) distance = distance * WIDE(leaf->scale);
    local.reach = (distance + WIDE(leaf->size)) * (NB_W(8.0) * NB_WEPSILON) + WIDE(ORIGIN_ERROR(leaf) * leaf->scale);
    return local;
}

/* Where sums and products of the numbers of ray and body are exact, so is on which side of a face a level ray runs. In
 * quad they are, but for turned bodies. */
static int is_exact(const nb_leaf *leaf)
{
#if defined(NB_QUAD)
    return leaf->aligned;
#else
    return leaf->in_place;
#endif
}

static nb_interval box_interval(const nb_leaf *leaf, const local_ray *local)
{
    double size = 0;
    for (int i = 0; i < 3; i++) size += fabs(leaf->low[i]) + fabs(leaf->high[i]);
    const nb_wide reach =
        is_exact(leaf) ? WIDE(ORIGIN_ERROR(leaf)) : local->reach + WIDE(size) * (NB_W(8.0) * NB_WEPSILON);
    return nb_interval_box(local->p, local->d, wide_vector(leaf->low), wide_vector(leaf->high), reach);
}

/* The noise of n.d. That of a turned direction is of roundings of its length, not of its components. */
static nb_wide lean_noise(const nb_leaf *leaf, nb_wvec3 n, nb_wvec3 d)
{
    const nb_wide lean = products(n, d) * (NB_W(4.0) * NB_WEPSILON);
    if (leaf->aligned) return lean;
    const nb_wide length = WIDE(leaf->scale) * (nb_wabs(n.x) + nb_wabs(n.y) + nb_wabs(n.z));
    return lean + length * (NB_W(8.0) * NB_WEPSILON);
}

/* How small a height above a face says nothing about the side of a level ray. In quad a height is 0 where the numbers
 * of ray and face say so. */
static nb_wide height_blur(const nb_face *face, nb_wide reach)
{
#if defined(NB_QUAD)
    (void)face, (void)reach;
    return NB_W(0.0);
#else
    return face->is_sharp ? NB_W(0.0) : reach;
#endif
}

static nb_interval planes_interval(const nb_volume *body, const nb_leaf *leaf, const local_ray *local)
{
    nb_interval meet = nb_interval_all();
    for (size_t i = 0; i < leaf->face_count; i++) {
        const nb_face *face = &body->faces[leaf->first_face + i];
        const nb_wvec3 normal = wide_vector(face->normal);
        const nb_wide reach = local->reach * NB_W(3.0) + WIDE(fabs(face->distance)) * (NB_W(4.0) * NB_WEPSILON);
        const nb_wide lean = lean_noise(leaf, normal, local->d);
        const nb_interval half_space = nb_interval_half_space(local->p, local->d, normal, WIDE(face->distance),
                                                              WIDE(face->tie), reach, lean, height_blur(face, reach));
        meet = nb_interval_meet(meet, half_space);
    }
    return meet;
}

static nb_interval leaf_interval(const packet *rays, const nb_volume *body, const nb_leaf *leaf)
{
    if (leaf->type == NB_LEAF_WORLD) return nb_interval_all();
    const local_ray local = localize(rays, leaf);
    switch (leaf->type) {
    case NB_LEAF_PLANES:
        return planes_interval(body, leaf, &local);
    case NB_LEAF_BOX:
        return box_interval(leaf, &local);
    case NB_LEAF_SPHERE:
        return nb_interval_sphere(local.p, local.d, WIDE(FRAME(leaf, radius)), local.reach);
    case NB_LEAF_CYLINDER:
        return nb_interval_cylinder(local.p, local.d, local.reach);
    case NB_LEAF_CONE:
        return nb_interval_cone(local.p, local.d, WIDE(FRAME(leaf, radius)), WIDE(FRAME(leaf, slope)), local.reach);
    default:
        return nb_interval_capsule(local.p, local.d, WIDE(FRAME(leaf, length)), local.reach);
    }
}
