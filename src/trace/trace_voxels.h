/* Voxels crossed by all rays of a packet at once, in float: each lane goes from cell to cell, past bricks without fog
 * in one step. Places are wide, so that rays that come from far away keep the digits of their cells. Included by
 * trace_density.h in float kernels. */

/* The rays in cells. */
typedef struct voxel_rays {
    const nebel_grid *grid;
    nb_wide from[3], slope[3], inverse[3]; /* of the slope; 0 where a ray is level */
    nb_wmask forward[3], level[3];
} voxel_rays;

/* Slopes below this cross no face along any ray. */
#define LEAST_VOXEL_SLOPE NB_W(1e-250)

static voxel_rays voxel_rays_of(const medium_hit *k)
{
    voxel_rays r = {.grid = k->medium->body.density.grid,
                    .from = {k->offset.x, k->offset.y, k->offset.z},
                    .slope = {k->slope.x, k->slope.y, k->slope.z}};
    for (int i = 0; i < 3; i++) {
        r.forward[i] = r.slope[i] > NB_W(0.0);
        r.level[i] = nb_wabs(r.slope[i]) < LEAST_VOXEL_SLOPE;
        r.inverse[i] = nb_wselect(r.level[i], NB_W(0.0), NB_W(1.0) / nb_wselect(r.level[i], NB_W(1.0), r.slope[i]));
    }
    return r;
}

/* Of |x| below 2^51. */
static inline nb_wide whole_below(nb_wide x)
{
    const nb_wide shifter = NB_W(6755399441055744.0);
    const nb_wide nearest = (x + shifter) - shifter;
    return nb_wselect(nearest > x, nearest - NB_W(1.0), nearest);
}

static inline nb_wide clamp_wide(nb_wide x, nb_wide low, nb_wide high)
{
    return nb_wmin(nb_wmax(x, low), high);
}

static inline nb_wide cell_at(const voxel_rays *r, int axis, nb_wide t)
{
    const nb_wide last = WIDE(r->grid->cells[axis] - 1);
    return whole_below(clamp_wide(r->from[axis] + r->slope[axis] * t, NB_W(0.0), last));
}

/* Where the lanes have come to. */
typedef struct voxel_walk {
    nb_wide t, cell[3];
    nb_real clear; /* of the cell's brick: see nebel_grid */
} voxel_walk;

static inline nb_real clearance_of(const voxel_rays *r, const nb_wide cell[3])
{
    nb_wide block[3];
    for (int i = 0; i < 3; i++) block[i] = whole_below(cell[i] * NB_W(0.125));
    const nb_wide row = block[2] * WIDE(r->grid->bricks[1]) + block[1];
    return nb_gather_bytes(r->grid->clear, row * WIDE(r->grid->bricks[0]) + block[0]);
}

static voxel_walk begin_voxels(const voxel_rays *r, nb_wide start)
{
    voxel_walk w = {.t = start};
    for (int i = 0; i < 3; i++) w.cell[i] = cell_at(r, i, start);
    w.clear = clearance_of(r, w.cell);
    return w;
}

/* Where a ray leaves what lies between two faces of an axis; never by the faces of the grid, where its part ends. */
static inline nb_wide leave_at(const voxel_rays *r, int axis, nb_wide low, nb_wide high)
{
    const nb_wide face = nb_wselect(r->forward[axis], high, low);
    const nb_wmask rim =
        nb_wselect(r->forward[axis], face, WIDE(r->grid->cells[axis]) - face) >= WIDE(r->grid->cells[axis]);
    const nb_wide crossing = (face - r->from[axis]) * r->inverse[axis];
    return nb_wselect(nb_wor(rim, r->level[axis]), NB_WFAR, crossing);
}

/* The nearest of three crossings; the mask says whether it is that axis's, one for each lane. */
static inline nb_wide nearest_of(const nb_wide crossing[3], nb_wmask is_axis[3])
{
    const nb_wide nearest = nb_wmin(nb_wmin(crossing[0], crossing[1]), crossing[2]);
    is_axis[0] = crossing[0] <= nearest;
    is_axis[1] = nb_wand(crossing[1] <= nearest, nb_wnot(is_axis[0]));
    is_axis[2] = nb_wnot(nb_wor(is_axis[0], is_axis[1]));
    return nearest;
}

/* Passes all bricks without fog that are as near as the lane's. */
static inline void pass_clear(const voxel_rays *r, voxel_walk *w, nb_wide end, nb_wmask lanes)
{
    const nb_wide width = NB_W(8.0), clear = nb_widen(w->clear) * width;
    nb_wide low[3], high[3], crossing[3];
    nb_wmask is_axis[3];
    for (int i = 0; i < 3; i++) {
        const nb_wide first = whole_below(w->cell[i] * NB_W(0.125)) * width;
        low[i] = first - (clear - width);
        high[i] = first + clear;
        crossing[i] = leave_at(r, i, low[i], high[i]);
    }
    const nb_wide leave = nearest_of(crossing, is_axis);
    const nb_wide t = nb_wmax(nb_wmin(leave, end), w->t);
    for (int i = 0; i < 3; i++) {
        const nb_wide there = cell_at(r, i, t);
        const nb_wide on = nb_wselect(r->forward[i], nb_wmax(there, w->cell[i]), nb_wmin(there, w->cell[i]));
        const nb_wide behind = nb_wselect(r->forward[i], high[i], low[i] - NB_W(1.0));
        const nb_wide cell = nb_wselect(nb_wand(is_axis[i], leave < end), behind, on);
        w->cell[i] = nb_wselect(lanes, cell, w->cell[i]);
    }
    w->t = nb_wselect(lanes, t, w->t);
    w->clear = clearance_of(r, w->cell);
}

/* ---- in a cell ------------------------------------------------------------------------------- */

/* A voxel, and the one behind it, which may lie behind the last. */
static inline nb_real voxels_at(const nebel_grid *grid, nb_wide index, nb_wide behind, nb_real *second)
{
    const nb_mask is_same = nb_narrow_mask(behind <= index);
    nb_real first, next;
    switch (grid->type) {
    case NEBEL_VOXEL_UINT8:
        first = nb_gather_byte_pairs(grid->voxels, index, &next);
        break;
    case NEBEL_VOXEL_UINT16:
        first = nb_gather_pairs(grid->voxels, index, &next);
        break;
    default:
        first = nb_gather(grid->voxels, index);
        next = nb_gather(grid->voxels, behind);
        break;
    }
    *second = nb_select(is_same, first, next);
    return first;
}

/* What a voxel as it is gathered is multiplied by. */
static double scale_of_voxels(const nebel_grid *grid)
{
    return grid->type == NEBEL_VOXEL_UINT8    ? grid->scale / 255
           : grid->type == NEBEL_VOXEL_UINT16 ? grid->scale / 65535
                                              : grid->scale;
}

static inline nb_real mix(nb_real a, nb_real b, nb_real share)
{
    return a + share * (b - a);
}

static inline nb_real clamp_share(nb_real x)
{
    return nb_min(nb_max(x, NB_F(0.0)), NB_F(1.0));
}

static inline nb_real within_corners(const nb_real v[8], const nb_real at[3])
{
    const nb_real near = mix(mix(v[0], v[1], at[0]), mix(v[2], v[3], at[0]), at[1]);
    const nb_real far = mix(mix(v[4], v[5], at[0]), mix(v[6], v[7], at[0]), at[1]);
    return mix(near, far, at[2]);
}

static inline void corners_of_cell(const nebel_grid *grid, const nb_wide cell[3], nb_real v[8])
{
    nb_wide low[3], high[3];
    for (int i = 0; i < 3; i++) {
        const nb_wide stride = WIDE((double)grid->stride[i]), last = WIDE(grid->size[i] - 1);
        low[i] = nb_wmax(cell[i] - NB_W(1.0), NB_W(0.0)) * stride;
        high[i] = nb_wmin(cell[i], last) * stride;
    }
    for (int n = 0; n < 4; n++) {
        const nb_wide row = (n & 1 ? high[1] : low[1]) + (n & 2 ? high[2] : low[2]);
        v[2 * n] = voxels_at(grid, row + low[0], row + high[0], &v[2 * n + 1]);
    }
}

/* Along a cell: the mean, and by how much more there is at its end than where it begins, if that were linear. */
typedef struct cell_voxels {
    nb_real mean, rise;
} cell_voxels;

/* From t to `until`, by the points of Gauss's rule, exact for the cubic that it is there. */
static inline cell_voxels voxels_of_cell(const voxel_rays *r, const voxel_walk *w, nb_wide until)
{
    const nb_wide *cell = w->cell;
    const nb_wide middle = NB_W(0.5) * (w->t + until), half = (until - w->t) * NB_W(0.28867513459481288);
    nb_real v[8], first[3], second[3];
    corners_of_cell(r->grid, cell, v);
    for (int i = 0; i < 3; i++) {
        const nb_real at = nb_narrow(r->from[i] + r->slope[i] * middle - cell[i]);
        const nb_real off = nb_narrow(r->slope[i] * half);
        first[i] = clamp_share(at - off);
        second[i] = clamp_share(at + off);
    }
    const nb_real a = within_corners(v, first), b = within_corners(v, second);
    return (cell_voxels){NB_F(0.5) * (a + b), NB_F(1.7320508075688772) * (b - a)};
}

/* Where a lane leaves its cell, or `end`. */
typedef struct cell_exit {
    nb_wide leave, until;
    nb_wmask is_axis[3]; /* of the face by which it leaves */
} cell_exit;

static inline cell_exit exit_of_cell(const voxel_rays *r, const voxel_walk *w, nb_wide end)
{
    nb_wide crossing[3];
    cell_exit x;
    for (int i = 0; i < 3; i++) crossing[i] = leave_at(r, i, w->cell[i], w->cell[i] + NB_W(1.0));
    x.leave = nearest_of(crossing, x.is_axis);
    x.until = nb_wmax(nb_wmin(x.leave, end), w->t);
    return x;
}

/* Returns how long the way was. */
static inline nb_wide leave_cell(const voxel_rays *r, const cell_exit *x, nb_wide end, nb_wmask lanes, voxel_walk *w)
{
    const nb_wmask leaves = nb_wand(lanes, x->leave < end);
    for (int i = 0; i < 3; i++) {
        const nb_wide next = w->cell[i] + nb_wselect(r->forward[i], NB_W(1.0), NB_W(-1.0));
        w->cell[i] = nb_wselect(nb_wand(leaves, x->is_axis[i]), next, w->cell[i]);
    }
    const nb_wide length = nb_wselect(lanes, x->until - w->t, NB_W(0.0));
    w->t = nb_wselect(lanes, x->until, w->t);
    w->clear = clearance_of(r, w->cell);
    return length;
}

/* To the end of the cell, or to `end`. Always in line: a call keeps the walk of all lanes in memory. */
static inline __attribute__((always_inline)) nb_wide step_voxel(const voxel_rays *r, voxel_walk *w, nb_wide end,
                                                                nb_wmask lanes, cell_voxels *voxels)
{
    const cell_exit x = exit_of_cell(r, w, end);
    *voxels = voxels_of_cell(r, w, x.until);
    return leave_cell(r, &x, end, lanes, w);
}

/* ---- along the rays -------------------------------------------------------------------------- */

/* Sums of the steps so far. */
typedef struct voxel_sum {
    nb_wide voxels; /* as they are gathered, times metres */
    nb_wide length; /* where there is fog */
} voxel_sum;

static inline nb_wide amount_of_voxels(const nebel_grid *grid, const voxel_sum *sum)
{
    return nb_wmax(WIDE(grid->offset) * sum->length + WIDE(scale_of_voxels(grid)) * sum->voxels, NB_W(0.0));
}

/* Shares are off by rounding, and by the noise of the coordinates along each axis; the density is as steep as its range
 * per cell. */
static nb_real error_of_voxels(const medium_hit *k, nb_real amount, nb_real length)
{
    const nebel_grid *grid = k->medium->body.density.grid;
    const nb_real steep = REAL(grid->most - grid->least) * (NB_F(3.0) * k->noise + NB_F(6.0) * NB_EPSILON);
    return amount * (NB_F(16.0) * NB_EPSILON) + (steep + REAL(fabs(grid->offset)) * (NB_F(8.0) * NB_EPSILON)) * length;
}

/* Whether the packet may walk: between nearest voxels noise moves whole steps of the density. */
static int walks_voxels(const medium_hit *k)
{
    return k->medium->body.density.grid->filter == NEBEL_GRID_FILTER_LINEAR;
}

/* The lanes on, from bricks without fog to the next cell of one that has some. Returns those that were moved. */
static inline nb_wmask find_voxels(const voxel_rays *r, voxel_walk *w, nb_wide end, nb_wmask lanes)
{
    nb_wmask moved = nb_wmask_false;
    for (;;) {
        const nb_wmask clear = nb_wand(nb_wand(lanes, w->t < end), nb_widen_mask(w->clear > NB_F(0.0)));
        if (!nb_wany(clear)) return moved;
        pass_clear(r, w, end, clear);
        moved = nb_wor(moved, clear);
    }
}

static inline void add_voxel(voxel_sum *sum, nb_wide length, nb_real mean)
{
    sum->length = sum->length + length;
    sum->voxels = sum->voxels + length * nb_widen(mean);
}

static nb_estimate estimate_of_voxels(const medium_hit *k, const voxel_sum *sum)
{
    const nb_real amount = nb_narrow(amount_of_voxels(k->medium->body.density.grid, sum));
    return nb_estimate_of(amount, error_of_voxels(k, amount, nb_narrow(sum->length)));
}

/* Up to `enough` [m], behind which the rest may be left out: see nb_grid_integral. */
static nb_estimate voxels_integral(const medium_hit *k, nb_wide start, nb_wide end, nb_real enough)
{
    const voxel_rays rays = voxel_rays_of(k);
    const nb_wide most = nb_widen(enough);
    nb_wmask lanes = nb_widen_mask(k->inside);
    voxel_walk w = begin_voxels(&rays, start);
    voxel_sum sum = {NB_W(0.0), NB_W(0.0)};
    for (;;) {
        (void)find_voxels(&rays, &w, end, lanes);
        const nb_wmask going = nb_wand(lanes, w.t < end);
        if (!nb_wany(going)) break;
        cell_voxels voxels;
        const nb_wide length = step_voxel(&rays, &w, end, going, &voxels);
        add_voxel(&sum, length, voxels.mean);
        lanes = nb_wand(lanes, amount_of_voxels(rays.grid, &sum) < most);
    }
    nb_estimate along = estimate_of_voxels(k, &sum);
    along.error = nb_select(nb_narrow_mask(w.t < end), REAL(NB_GRID_ENDLESS), along.error);
    return along;
}

/* ---- moments --------------------------------------------------------------------------------- */

/* The means of 1, x and x^2 times the density over the way to `until`, where x goes from -1 to 1. The density is a cubic
 * along a cell: three points of Gauss's rule are exact. */
typedef struct cell_moments {
    nb_real mean, first, second;
} cell_moments;

static inline cell_moments moments_of_cell(const voxel_rays *r, const voxel_walk *w, nb_wide until)
{
    const nb_wide middle = NB_W(0.5) * (w->t + until), half = (until - w->t) * NB_W(0.3872983346207417);
    const nb_real scale = REAL(scale_of_voxels(r->grid)), offset = REAL(r->grid->offset);
    nb_real v[8], place[3][3], density[3];
    corners_of_cell(r->grid, w->cell, v);
    for (int i = 0; i < 3; i++) {
        const nb_real at = nb_narrow(r->from[i] + r->slope[i] * middle - w->cell[i]);
        const nb_real off = nb_narrow(r->slope[i] * half);
        place[0][i] = clamp_share(at - off);
        place[1][i] = clamp_share(at);
        place[2][i] = clamp_share(at + off);
    }
    for (int n = 0; n < 3; n++) density[n] = nb_max(offset + scale * within_corners(v, place[n]), NB_F(0.0));
    const nb_real ends = (density[0] + density[2]) * REAL(5.0 / 18);
    const nb_real rise = (density[2] - density[0]) * REAL(5.0 / 18 * 0.7745966692414834);
    return (cell_moments){ends + density[1] * REAL(8.0 / 18), rise, ends * NB_F(0.6)};
}

/* Of the lanes inside, from `start` to `end`; places are `first` at the start and go by `rate` a metre. */
static density_moments voxels_moments(const medium_hit *k, nb_wide start, nb_wide end, nb_mask inside, nb_real first,
                                      nb_real rate)
{
    const voxel_rays rays = voxel_rays_of(k);
    const nb_wmask lanes = nb_wand(nb_widen_mask(inside), start < end);
    voxel_walk w = begin_voxels(&rays, start);
    nb_wide amount = NB_W(0.0), filled = NB_W(0.0);
    density_moments sum = {.first = NB_F(0.0), .second = NB_F(0.0)};
    for (;;) {
        (void)find_voxels(&rays, &w, end, lanes);
        const nb_wmask going = nb_wand(lanes, w.t < end);
        if (!nb_wany(going)) break;
        const cell_exit x = exit_of_cell(&rays, &w, end);
        const cell_moments cell = moments_of_cell(&rays, &w, x.until);
        const nb_real middle = first + nb_narrow(NB_W(0.5) * (w.t + x.until) - start) * rate;
        const nb_wide length = leave_cell(&rays, &x, end, going, &w);
        const nb_real h = nb_narrow(length), half = NB_F(0.5) * h * rate;
        amount = amount + length * nb_widen(cell.mean);
        filled = filled + length;
        sum.first = sum.first + h * (middle * cell.mean + half * cell.first);
        sum.second = sum.second +
                     h * (middle * middle * cell.mean + half * (NB_F(2.0) * middle * cell.first + half * cell.second));
    }
    const nb_real value = nb_narrow(amount);
    sum.amount = nb_estimate_of(value, error_of_voxels(k, value, nb_narrow(filled)));
    return sum;
}
