#include "overlap_test.h"

#include <math.h>

/* Of the numbers that a distance from a face is made of: some thousand roundings. */
#define MARGIN 1e-12

/* Where a ray is in a convex leaf: surely nowhere outside `outer`, surely everywhere within `inner`. */
typedef struct reach {
    double outer[2], inner[2];
} reach;

static void clip(double interval[2], double over, double slope)
{
    if (slope > 0)
        interval[1] = fmin(interval[1], -over / slope);
    else
        interval[0] = fmax(interval[0], -over / slope);
}

/* Leaves what is behind a face: over + t slope <= 0. A ray that is level with it to the last bit is decided by its
 * origin, so that no piece without end is left in doubt. */
static void clip_face(reach *r, double over, double slope, double margin, int owns_face)
{
    if (slope == 0) {
        if (over > 0) r->outer[1] = -HUGE_VAL;
        if (over > 0 || (over == 0 && !owns_face)) r->inner[1] = -HUGE_VAL;
        return;
    }
    clip(r->outer, over - margin, slope);
    clip(r->inner, over + margin, slope);
}

static void clip_faces(reach *r, const nb_volume *volume, const nb_leaf *leaf, const double p[3], const double d[3],
                       double lost)
{
    for (size_t i = 0; i < leaf->face_count; i++) {
        const nb_face *face = &volume->faces[leaf->first_face + i];
        double over = -face->distance, slope = 0, size = fabs(face->distance);
        for (int k = 0; k < 3; k++) {
            over += face->normal[k] * p[k];
            slope += face->normal[k] * d[k];
            size += fabs(face->normal[k]) * (fabs(p[k]) + lost);
        }
        clip_face(r, over, slope, MARGIN * size, 1);
    }
}

/* The box around a leaf in its frame. */
static void find_box(const nb_leaf *leaf, double low[3], double high[3])
{
    const double radius = leaf->type == NB_LEAF_SPHERE ? leaf->radius
                          : leaf->type == NB_LEAF_CONE ? fmax(leaf->radius, leaf->radius + leaf->slope)
                                                       : 1;
    const double end = leaf->type == NB_LEAF_SPHERE ? radius : leaf->type == NB_LEAF_CAPSULE ? leaf->length + 1 : 1;
    const double start = leaf->type == NB_LEAF_SPHERE ? -radius : leaf->type == NB_LEAF_CAPSULE ? -1 : 0;
    for (int i = 0; i < 3; i++) {
        const int along = i == 2;
        low[i] = leaf->type == NB_LEAF_BOX ? leaf->low[i] : along ? start : -radius;
        high[i] = leaf->type == NB_LEAF_BOX ? leaf->high[i] : along ? end : radius;
    }
}

static void clip_box(reach *r, const nb_leaf *leaf, const double p[3], const double d[3], double lost)
{
    double low[3], high[3];
    find_box(leaf, low, high);
    for (int i = 0; i < 3; i++) {
        const double margin = MARGIN * (fabs(p[i]) + fabs(low[i]) + fabs(high[i]) + lost);
        clip_face(r, p[i] - high[i], d[i], margin, 0);
        clip_face(r, low[i] - p[i], -d[i], margin, 1);
    }
}

/* `lost` is what moving the origin into the frame may have cancelled. */
static double to_frame(const nb_leaf *leaf, const nb_line *line, double p[3], double d[3])
{
    double lost = 0;
    for (int i = 0; i < 3; i++) {
        p[i] = d[i] = 0;
        for (int k = 0; k < 3; k++) {
            const double m = leaf->matrix[3 * i + k];
            p[i] += m * ((line->origin[k] - leaf->origin[k]) - leaf->origin_rest[k]);
            d[i] += m * line->direction[k];
            lost = fmax(lost, fabs(m) * (fabs(line->origin[k]) + fabs(leaf->origin[k])));
        }
    }
    return lost;
}

static reach find_reach(const nb_volume *volume, const nb_leaf *leaf, const nb_line *line)
{
    reach r = {{-HUGE_VAL, HUGE_VAL}, {-HUGE_VAL, HUGE_VAL}};
    double p[3], d[3];
    if (leaf->type == NB_LEAF_WORLD) return r;
    const double lost = to_frame(leaf, line, p, d);
    if (leaf->type == NB_LEAF_PLANES)
        clip_faces(&r, volume, leaf, p, d, lost);
    else
        clip_box(&r, leaf, p, d, lost);
    if (leaf->type != NB_LEAF_PLANES && leaf->type != NB_LEAF_BOX) r.inner[1] = -HUGE_VAL;
    return r;
}

static nb_overlap presence_in(const reach *r, double from, double to)
{
    if (r->outer[0] >= r->outer[1] || to <= r->outer[0] || from >= r->outer[1]) return NB_ABSENT;
    return from >= r->inner[0] && to <= r->inner[1] ? NB_PRESENT : NB_UNSURE;
}

nb_overlap nb_volume_presence(const nb_volume *volume, const nb_line *line, double from, double to)
{
    nb_overlap stack[NB_STEP_STACK];
    int top = 0;
    size_t leaf = 0;
    for (size_t i = 0; i < volume->step_count; i++) {
        if (volume->steps[i] == NB_OP_LEAF) {
            const reach r = find_reach(volume, &volume->leaves[leaf++], line);
            stack[top++] = presence_in(&r, from, to);
            continue;
        }
        top--;
        const nb_overlap a = stack[top - 1], b = stack[top];
        stack[top - 1] = volume->steps[i] == NB_OP_UNION ? (a > b ? a : b) : (a < b ? a : b);
    }
    return stack[0];
}

double nb_volume_next_change(const nb_volume *volume, const nb_line *line, double from)
{
    double next = HUGE_VAL;
    for (size_t i = 0; i < volume->leaf_count; i++) {
        const reach r = find_reach(volume, &volume->leaves[i], line);
        if (r.outer[0] >= r.outer[1]) continue;
        const double ends[] = {r.outer[0], r.inner[0], r.inner[1], r.outer[1]};
        for (int k = 0; k < 4; k++)
            if (ends[k] > from) next = fmin(next, ends[k]);
    }
    return next;
}
