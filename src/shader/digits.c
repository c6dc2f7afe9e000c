/* How well floats hold fog in a view.
 *
 * A shader finds where a ray meets a body from the eye. Directions, bodies and the places that come of them are rounded to 2^-24 each,
 * which moves a face by up to
 *
 *     off = 2^-23 reach
 *
 * across a ray, where `reach` is how far from the eye the ray meets it. Of fog of optical depth x between faces that are w apart that
 * changes x by x off / w, and transmittance by x exp(-x) off / w <= off / (e w). Beside an outline, and a pixel's width p from it, depth
 * is at least in proportion to the way from the outline: there that is off / (e p). So the bound is off / e (1 / w + 1 / p), and less
 * in fog that never has an optical depth of 1. A density that falls to a share of 1 / e within a length is as a body of that width.
 *
 * Between flat faces `reach` is smaller: each is met at its distance from the eye over the cosine of the ray, which has an absolute error.
 * So it is that distance, and the way through fog as far as light comes through, two mean free paths.
 *
 * A surface in fog ends a ray at a distance that is off by a 2^-22 of it: a 2^-23 each for its place and for the ray. That changes
 * transmittance by 2^-22 s d exp(-x), with s the extinction there and x the optical depth up to the surface: by no more than 2^-22 s d, with d the
 * distance at which fog begins. */
#include "fog/snapshot.h"
#include "view_rays.h"

#include "math/vector.h"
#include "medium/grid.h"

#include <math.h>

#define ROUNDING 0x1p-23
#define MOST_OF_DEPTH 0.36787944117144232 /* the largest x exp(-x) */

/* A view as bodies are asked about in it. */
typedef struct sight {
    const nebel_view *view;
    double eye[3];
    int parallel;
    double pixel; /* [m], of parallel rays; [radians] */
    double wide;  /* how far from the eye parallel rays begin [m] */
} sight;

/* The widest that `reach` gets for what is narrow, by how narrow that is. */
typedef struct narrowness {
    double ratio, reach, width;
} narrowness;

static void note(narrowness *n, double reach, double width)
{
    if (!(reach / width > n->ratio)) return;
    *n = (narrowness){reach / width, reach, width};
}

static void set_sight(sight *s, const nebel_view *view, const double eye[3])
{
    const double *const clip = view->clip_from_eye;
    const double up[3] = {clip[1], clip[5], clip[9]}, right[3] = {clip[0], clip[4], clip[8]};
    const double ahead[3] = {clip[3], clip[7], clip[11]};
    const double w = nb_vector_length(ahead);
    *s = (sight){.view = view, .parallel = !(w > 0)};
    for (int i = 0; i < 3; i++) s->eye[i] = eye[i];
    const double height = 2 * (s->parallel ? clip[15] : w) / nb_vector_length(up);
    s->pixel = height / view->height;
    if (s->parallel) s->wide = hypot(0.5 * height, clip[15] / nb_vector_length(right));
}

/* ---- where bodies are ------------------------------------------------------------------------ */

static double diagonal_of(const nb_volume *body)
{
    double square = 0;
    for (int i = 0; i < 3; i++) square += (body->high[i] - body->low[i]) * (body->high[i] - body->low[i]);
    return sqrt(square);
}

static double farthest_of(const sight *s, const nb_volume *body)
{
    double square = 0;
    for (int i = 0; i < 3; i++) {
        const double far = fmax(fabs(body->low[i] - s->eye[i]), fabs(body->high[i] - s->eye[i]));
        square += far * far;
    }
    return sqrt(square);
}

static void corner_of(const nb_volume *body, int number, double corner[3])
{
    for (int i = 0; i < 3; i++) corner[i] = number >> i & 1 ? body->high[i] : body->low[i];
}

static void transform_point(const double matrix[16], const double p[4], double out[4])
{
    for (int row = 0; row < 4; row++)
        out[row] = matrix[row] * p[0] + matrix[4 + row] * p[1] + matrix[8 + row] * p[2] + matrix[12 + row] * p[3];
}

/* Whether its bounds are not all on one side of the picture, or behind the eye. */
static int is_seen(const sight *s, const nb_volume *body)
{
    int beside[5] = {0};
    if (nb_volume_is_endless(body)) return 1;
    for (int number = 0; number < 8; number++) {
        double place[4] = {0, 0, 0, 1}, in_eye[4], clip[4];
        corner_of(body, number, place);
        transform_point(s->view->eye_from_world, place, in_eye);
        transform_point(s->view->clip_from_eye, in_eye, clip);
        for (int i = 0; i < 2; i++) beside[2 * i] += clip[i] > clip[3], beside[2 * i + 1] += clip[i] < -clip[3];
        beside[4] += s->parallel ? in_eye[2] > 0 : clip[3] < 0;
    }
    for (int i = 0; i < 5; i++)
        if (beside[i] == 8) return 0;
    return 1;
}

/* ---- how narrow they are --------------------------------------------------------------------- */

/* How far light comes through it, and no farther than it goes. */
static double way_through(const nb_volume *body)
{
    double least = HUGE_VAL;
    for (int c = 0; c < 3; c++)
        if (body->extinction[c] > 0) least = fmin(least, body->extinction[c]);
    const double diagonal = diagonal_of(body), seen = fmin(diagonal, 2 / least);
    return isfinite(least) ? seen : isfinite(diagonal) ? diagonal : 0;
}

static void bring_to_frame(const double from[3], const nb_leaf *leaf, double place[3])
{
    double way[3];
    for (int i = 0; i < 3; i++) way[i] = (from[i] - leaf->origin[i]) - leaf->origin_rest[i];
    for (int i = 0; i < 3; i++) place[i] = nb_vector_dot(&leaf->matrix[3 * i], way);
}

static void note_box(const sight *s, const nb_leaf *leaf, double through, narrowness *n)
{
    double place[3];
    bring_to_frame(s->eye, leaf, place);
    for (int i = 0; i < 3; i++) {
        const double scale = nb_vector_length(&leaf->matrix[3 * i]);
        const double width = (leaf->high[i] - leaf->low[i]) / scale;
        const double near = fmax(fabs(leaf->low[i] - place[i]), fabs(leaf->high[i] - place[i])) / scale;
        if (isfinite(width)) note(n, near + through + s->wide, width);
    }
}

/* Of a face: its normal in the world, of length 1, and how far within it the eye and a place in the body are. */
typedef struct side {
    double normal[3], eye, place;
} side;

static side side_of(const nb_leaf *leaf, const nb_face *face, const double eye[3], const double place[3])
{
    side f = {.eye = face->distance - nb_vector_dot(face->normal, eye),
              .place = face->distance - nb_vector_dot(face->normal, place)};
    for (int i = 0; i < 3; i++)
        for (int k = 0; k < 3; k++) f.normal[k] += leaf->matrix[3 * i + k] * face->normal[i];
    const double length = nb_vector_length(f.normal);
    for (int k = 0; k < 3; k++) f.normal[k] /= length;
    f.eye /= length;
    f.place /= length;
    return f;
}

/* Faces that look away from each other. Others meet in an edge, which is an outline. */
static void note_planes(const sight *s, const nb_volume *body, const nb_leaf *leaf, double through, narrowness *n)
{
    double middle[3], eye[3], place[3];
    for (int i = 0; i < 3; i++)
        middle[i] = nb_volume_is_endless(body) ? s->eye[i] : 0.5 * (body->low[i] + body->high[i]);
    bring_to_frame(s->eye, leaf, eye);
    bring_to_frame(middle, leaf, place);
    for (size_t i = 0; i < leaf->face_count; i++) {
        const side a = side_of(leaf, &body->faces[leaf->first_face + i], eye, place);
        for (size_t k = 0; k < i; k++) {
            const side b = side_of(leaf, &body->faces[leaf->first_face + k], eye, place);
            const double width = a.place + b.place;
            if (nb_vector_dot(a.normal, b.normal) > -0.99 || !(width > 0)) continue;
            note(n, fmax(fabs(a.eye), fabs(b.eye)) + through + s->wide, width);
        }
    }
}

static double distance_to(const sight *s, const double place[3])
{
    double way[3];
    for (int i = 0; i < 3; i++) way[i] = place[i] - s->eye[i];
    return nb_vector_length(way);
}

/* Of a unit radius and, but for balls, a unit length or more in its frame. */
static void note_round(const sight *s, const nb_volume *body, const nb_leaf *leaf, narrowness *n)
{
    const int is_ball = leaf->type == NB_LEAF_SPHERE;
    double least = HUGE_VAL;
    for (int i = 0; i < 3; i++) least = fmin(least, nb_vector_length(&leaf->matrix[3 * i]));
    const double extent = (is_ball ? leaf->radius : 2 + leaf->length) / least;
    const double reach = nb_volume_is_endless(body) ? distance_to(s, leaf->origin) + extent : farthest_of(s, body);
    note(n, reach + s->wide, (is_ball ? 2 * leaf->radius : 1) / leaf->scale);
}

static void note_leaf(const sight *s, const nb_volume *body, const nb_leaf *leaf, narrowness *n)
{
    const double through = way_through(body);
    if (leaf->type == NB_LEAF_WORLD) return;
    if (leaf->type == NB_LEAF_BOX)
        note_box(s, leaf, through, n);
    else if (leaf->type == NB_LEAF_PLANES)
        note_planes(s, body, leaf, through, n);
    else
        note_round(s, body, leaf, n);
}

static void note_grid(const sight *s, const nb_volume *body, narrowness *n)
{
    const nb_leaf *const leaf = &body->leaves[0];
    double rate[3];
    nb_grid_rate(body->density.grid, leaf->low, leaf->high, rate);
    for (int i = 0; i < 3; i++) note(n, farthest_of(s, body), 1 / (rate[i] * leaf->scale));
}

static void note_density(const sight *s, const nb_volume *body, narrowness *n)
{
    const nebel_density *const density = &body->density;
    const double through = way_through(body) + s->wide;
    double axis[3];
    switch (density->type) {
    case NEBEL_DENSITY_HEIGHT:
        note(n, fabs(s->eye[1] - density->base) + through, density->scale_height);
        break;
    case NEBEL_DENSITY_ALTITUDE:
        note(n, fabs(distance_to(s, density->center) - density->radius - density->base) + through,
             density->scale_height);
        break;
    case NEBEL_DENSITY_LINEAR:
        for (int i = 0; i < 3; i++) axis[i] = density->to[i] - density->from[i];
        note(n, distance_to(s, density->from) + through, nb_vector_length(axis));
        break;
    case NEBEL_DENSITY_GAUSSIAN:
        note(n, distance_to(s, density->center), density->sigma);
        break;
    case NEBEL_DENSITY_GRID:
        note_grid(s, body, n);
        break;
    default:
        break;
    }
}

/* ---- the bound ------------------------------------------------------------------------------- */

/* The most that a relative error of the depth does to light. */
static double weight_of(const nb_medium *medium)
{
    if (medium->emits) return 1;
    if (!nb_volume_has_fog(&medium->body)) return MOST_OF_DEPTH;
    return fmin(MOST_OF_DEPTH, medium->densest * diagonal_of(&medium->body));
}

static int has_outline(const nb_volume *body)
{
    return body->leaf_count > 1 || body->leaves[0].type != NB_LEAF_WORLD ||
           body->density.type != NEBEL_DENSITY_CONSTANT;
}

static nebel_view_error error_of(const sight *s, const nb_medium *medium)
{
    const nb_volume *const body = &medium->body;
    narrowness n = {0, 0, HUGE_VAL};
    for (size_t i = 0; i < body->leaf_count; i++) note_leaf(s, body, &body->leaves[i], &n);
    note_density(s, body, &n);
    const double far = nb_volume_is_endless(body) ? n.reach : farthest_of(s, body);
    const double pixel = s->parallel ? s->pixel : s->pixel * far, weight = weight_of(medium) * ROUNDING;
    if (diagonal_of(body) < pixel) return (nebel_view_error){.error = 0}; /* none of it is a pixel beside an outline */
    const double beside = !has_outline(body) ? 0 : s->parallel ? far / s->pixel : 1 / s->pixel;
    return (nebel_view_error){.by_width = weight * n.ratio,
                              .by_pixel = weight * beside,
                              .error = weight * (n.ratio + beside),
                              .distance = far,
                              .width = n.width,
                              .pixel = pixel};
}

/* How far from the eye a body begins, or what of its density is not thin: at least. */
static double nearest_to_eye(const sight *s, const nb_volume *body)
{
    const nebel_density *const density = &body->density;
    double square = 0, near = 0, eye[3];
    for (int i = 0; i < 3; i++) {
        const double off = fmax(fmax(body->low[i] - s->eye[i], s->eye[i] - body->high[i]), 0);
        square += off * off;
    }
    if (body->leaf_count == 1 && body->leaves[0].type == NB_LEAF_PLANES) {
        bring_to_frame(s->eye, &body->leaves[0], eye);
        for (size_t i = 0; i < body->leaves[0].face_count; i++)
            near = fmax(near, -side_of(&body->leaves[0], &body->faces[body->leaves[0].first_face + i], eye, eye).eye);
    }
    if (density->type == NEBEL_DENSITY_HEIGHT) near = fmax(near, s->eye[1] - density->base);
    if (density->type == NEBEL_DENSITY_ALTITUDE)
        near = fmax(near, distance_to(s, density->center) - density->radius - density->base);
    return fmax(near, sqrt(square));
}

/* How far ahead of the eye its bounds begin. */
static double depth_of(const sight *s, const nb_volume *body)
{
    double least = HUGE_VAL;
    if (nb_volume_is_endless(body)) return 0;
    for (int number = 0; number < 8; number++) {
        double place[4] = {0, 0, 0, 1}, in_eye[4];
        corner_of(body, number, place);
        transform_point(s->view->eye_from_world, place, in_eye);
        least = fmin(least, -in_eye[2]);
    }
    return fmax(least, 0);
}

/* Errors of volumes add where a ray meets several, but depth is divided among them: no more than of the worst if all depth were its own. */
typedef struct digit_sum {
    nebel_view_error worst;
    double error, most, by_surface;
    int emits;
} digit_sum;

/* So little that it does not matter whether the volume is seen. */
#define LITTLE 1e-4

static void add(const sight *s, const nb_medium *medium, double little, digit_sum *total)
{
    const nebel_view_error one = error_of(s, medium);
    const double by_surface = nb_volume_has_fog(&medium->body) && isfinite(medium->densest)
                                  ? 2 * ROUNDING * medium->densest * nearest_to_eye(s, &medium->body)
                                  : 0;
    if (by_surface > 0 && (by_surface <= little || is_seen(s, &medium->body))) total->by_surface += by_surface;
    if (!(one.error > 0) || (one.error > little && !is_seen(s, &medium->body))) return;
    total->error += one.error;
    total->most = fmax(total->most, one.error / weight_of(medium));
    total->emits |= medium->emits;
    if (one.error > total->worst.error) total->worst = one;
}

static nebel_view_error end(const digit_sum *total)
{
    nebel_view_error error = total->worst;
    if (!(error.error > 0)) return error;
    const double scale = fmin(total->error, total->most * (total->emits ? 1 : MOST_OF_DEPTH)) / error.error;
    error.error *= scale;
    error.by_width *= scale;
    error.by_pixel *= scale;
    return error;
}

nebel_result nebel_find_view_error(const nebel_snapshot *snapshot, const nebel_view *view, nebel_view_error *error)
{
    nebel_rays rays;
    sight s;
    digit_sum total = {.error = 0};
    if (snapshot == NULL || view == NULL || error == NULL) return NEBEL_ERROR_ARGUMENT;
    const nebel_result result = nebel_compute_view_rays(view, NULL, &rays);
    if (result != NEBEL_OK) return result;
    set_sight(&s, view, rays.eye);
    double clear = s.parallel ? HUGE_VAL : 0;
    for (size_t i = 0; i < snapshot->medium_count; i++) {
        const nb_volume *const body = &snapshot->media[i].body;
        add(&s, &snapshot->media[i], LITTLE / (double)snapshot->medium_count, &total);
        if (clear > 0) clear = nb_volume_has_distances(body) ? 0 : fmin(clear, depth_of(&s, body));
    }
    *error = end(&total);
    error->by_surface = total.by_surface;
    error->clear = clear;
    return NEBEL_OK;
}
