/* Rays that come nowhere near a medium: asked before anything dear is. Included by trace_kernel.c after trace_intersect.h.
 *
 * Leaving a medium out must change no bit of the light, so its bounds are taken with a margin that covers the rounding
 * of every crossing: distances times roundings, more by its shape's proportions in a frame that scales, and by the
 * square root where a ray grazes. What slack does to the reported error is not covered. */
#define SCENE_MARGIN 1e-5

/* Whether a slab lies before the start or beyond the end of ways that go `reach` across it; both times `length`. */
static inline nb_wmask passes_slab(nb_wide reach, nb_wide nearest, nb_wide farthest, nb_wide length)
{
    return nb_wor(nb_wmax(reach, NB_W(0.0)) < nearest * length, nb_wmin(reach, NB_W(0.0)) > farthest * length);
}

/* Whether all rays miss what lies from `nearest` to `farthest` of their starts. `length` is that of `way`. */
static inline int all_pass(nb_wvec3 way, nb_wide length, nb_wide t_max, nb_wvec3 nearest, nb_wvec3 farthest)
{
    const nb_wmask x = passes_slab(way.x * t_max, nearest.x, farthest.x, length);
    const nb_wmask y = passes_slab(way.y * t_max, nearest.y, farthest.y, length);
    const nb_wmask z = passes_slab(way.z * t_max, nearest.z, farthest.z, length);
    return nb_wall(nb_wor(nb_wor(x, y), nb_wor(z, t_max == NB_W(0.0))));
}

static inline nb_wide sum_of_sizes(nb_wvec3 v)
{
    return nb_wabs(v.x) + nb_wabs(v.y) + nb_wabs(v.z);
}

/* The bounds of a medium from `start`, with their margin; without bounds on one side it is infinite on all. */
static inline void set_bounds(const nb_medium *medium, nb_wvec3 start, nb_wvec3 *nearest, nb_wvec3 *farthest)
{
    const nb_wvec3 low = nb_wsub3(wide_vector(medium->body.low), start);
    const nb_wvec3 high = nb_wsub3(wide_vector(medium->body.high), start);
    const nb_wide margin = (sum_of_sizes(low) + sum_of_sizes(high)) * WIDE(SCENE_MARGIN * medium->proportion);
    *nearest = nb_wsub3(low, nb_wvec3(margin, margin, margin));
    *farthest = nb_wadd3(high, nb_wvec3(margin, margin, margin));
}

static int all_miss(const packet *rays, const nb_medium *medium)
{
    nb_wvec3 nearest, farthest;
    set_bounds(medium, rays->origin, &nearest, &farthest);
    return all_pass(rays->direction, NB_W(1.0), rays->t_max, nearest, farthest);
}
