/* Normals for models that have none. */
#include "assimp_builder.h"

#include <math.h>
#include <string.h>

/* Triangles that turn away from each other by more than 60 degrees meet in a sharp edge. Where all around a place are
 * within 30 degrees of their sum, no two are further apart than that. */
static const float smoothing_cosine = 0.5f, half_cosine = 0.8660254f;

/* The tip of a sharp fan with more triangles than this gets the normals of its triangles: comparing each with each
 * would take their number squared. */
enum { MOST_AROUND = 1024 };

typedef struct smoother {
    nb_weld_mesh *draft;
    uint32_t *place;          /* of each given vertex: the first vertex there */
    struct aiVector3D *faces; /* unit normals of triangles; 0 without an area */
    bool *sharp;              /* places with a sharp edge */
    uint32_t *ends;           /* where the corners around a place end; those of the place before end where it begins */
    uint32_t *around;         /* corners at sharp places, place after place */
} smoother;

static float dot(const struct aiVector3D *a, const struct aiVector3D *b)
{
    return a->x * b->x + a->y * b->y + a->z * b->z;
}

static void add_vector(struct aiVector3D *sum, const struct aiVector3D *v)
{
    sum->x += v->x;
    sum->y += v->y;
    sum->z += v->z;
}

/* In double neither the squares of floats nor their sums overflow or vanish. */
static struct aiVector3D unit(double x, double y, double z)
{
    const double length = sqrt(x * x + y * y + z * z), scale = length > 0 ? 1 / length : 0;
    return (struct aiVector3D){(float)(x * scale), (float)(y * scale), (float)(z * scale)};
}

static struct aiVector3D face_normal(const nb_weld_mesh *draft, const uint32_t *corner)
{
    const struct aiVector3D *a = &draft->positions[corner[0]], *b = &draft->positions[corner[1]],
                            *c = &draft->positions[corner[2]];
    const double ux = (double)b->x - (double)a->x, uy = (double)b->y - (double)a->y, uz = (double)b->z - (double)a->z;
    const double vx = (double)c->x - (double)a->x, vy = (double)c->y - (double)a->y, vz = (double)c->z - (double)a->z;
    return unit(uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx);
}

/* As if no edge were sharp. */
static void smooth_all(const smoother *in)
{
    const nb_weld_mesh *draft = in->draft;
    struct aiVector3D *normals = draft->made_normals;
    memset(normals, 0, draft->given_count * sizeof *normals);
    for (size_t i = 0; i < draft->triangle_count; i++) {
        const uint32_t *corner = draft->corners + 3 * i;
        in->faces[i] = face_normal(draft, corner);
        for (int k = 0; k < 3; k++) add_vector(&normals[in->place[corner[k]]], &in->faces[i]);
    }
    for (uint32_t i = 0; i < draft->given_count; i++) {
        const struct aiVector3D *sum = &normals[i];
        normals[i] = in->place[i] < i ? normals[in->place[i]] : unit((double)sum->x, (double)sum->y, (double)sum->z);
    }
}

/* A triangle without an area has no direction, and makes no edge. */
static void find_sharp_places(const smoother *in)
{
    const nb_weld_mesh *draft = in->draft;
    memset(in->sharp, 0, draft->given_count * sizeof *in->sharp);
    for (size_t i = 0; i < 3 * (size_t)draft->triangle_count; i++) {
        const struct aiVector3D *face = &in->faces[i / 3];
        if ((face->x != 0 || face->y != 0 || face->z != 0) &&
            dot(face, &draft->made_normals[draft->corners[i]]) < half_cosine)
            in->sharp[in->place[draft->corners[i]]] = true;
    }
}

/* Counts the corners of each sharp place into where those of the next begin. */
static uint32_t count_around(const smoother *in)
{
    const nb_weld_mesh *draft = in->draft;
    uint32_t sum = 0;
    memset(in->ends, 0, draft->given_count * sizeof *in->ends);
    for (size_t i = 0; i < 3 * (size_t)draft->triangle_count; i++) {
        const uint32_t place = in->place[draft->corners[i]];
        in->ends[place] += in->sharp[place] ? 1 : 0;
    }
    for (uint32_t i = 0; i < draft->given_count; i++) {
        const uint32_t count = in->ends[i];
        in->ends[i] = sum;
        sum += count;
    }
    return sum;
}

/* Moves the ends from where the corners of a place begin to where they end. */
static void collect_around(const smoother *in)
{
    const nb_weld_mesh *draft = in->draft;
    for (size_t i = 0; i < 3 * (size_t)draft->triangle_count; i++) {
        const uint32_t place = in->place[draft->corners[i]];
        if (in->sharp[place]) in->around[in->ends[place]++] = (uint32_t)i;
    }
}

/* The normal of corner `own` among those of its place. */
static struct aiVector3D smooth_corner(const smoother *in, uint32_t first, uint32_t end, uint32_t own)
{
    const struct aiVector3D *face = &in->faces[in->around[own] / 3];
    if (end - first > MOST_AROUND) return *face;
    struct aiVector3D sum = {0, 0, 0};
    for (uint32_t i = first; i < end; i++) {
        const struct aiVector3D *other = &in->faces[in->around[i] / 3];
        if (i == own || dot(face, other) >= smoothing_cosine) add_vector(&sum, other);
    }
    return unit((double)sum.x, (double)sum.y, (double)sum.z);
}

/* Every corner at a sharp place becomes a vertex of its own. */
static void split_sharp_places(const smoother *in)
{
    nb_weld_mesh *draft = in->draft;
    uint32_t first = 0;
    for (uint32_t place = 0; place < draft->given_count; place++) {
        const uint32_t end = in->ends[place];
        for (uint32_t i = first; i < end; i++) {
            uint32_t *corner = &draft->corners[in->around[i]];
            draft->made_normals[draft->given_count + i] = smooth_corner(in, first, end, i);
            draft->copied[i] = *corner;
            *corner = draft->given_count + i;
        }
        first = end;
    }
}

static bool reserve_copies(smoother *in, uint32_t copy_count)
{
    nb_weld_mesh *draft = in->draft;
    const nebel_allocator *allocator = &draft->allocator;
    const size_t count = (size_t)draft->given_count + copy_count;
    struct aiVector3D *normals = nb_allocate(allocator, count, sizeof *normals);
    in->around = nb_allocate(allocator, copy_count, sizeof *in->around);
    draft->copied = nb_allocate(allocator, copy_count, sizeof *draft->copied);
    if (normals == NULL || in->around == NULL || draft->copied == NULL) {
        nb_release(allocator, normals);
        return false;
    }
    memcpy(normals, draft->made_normals, draft->given_count * sizeof *normals);
    nb_release(allocator, draft->made_normals);
    draft->made_normals = normals;
    draft->copy_count = copy_count;
    return true;
}

static bool smooth(smoother *in)
{
    if (!nb_draft_find_like(in->draft, NB_LIKE_POSITION, 0, in->draft->given_count, in->place)) return false;
    smooth_all(in);
    find_sharp_places(in);
    const uint32_t copy_count = count_around(in);
    if (copy_count == 0) return true;
    if (!reserve_copies(in, copy_count)) return false;
    collect_around(in);
    split_sharp_places(in);
    return true;
}

bool nb_draft_smooth(nb_weld_mesh *draft)
{
    const nebel_allocator *allocator = &draft->allocator;
    const uint32_t count = draft->given_count;
    draft->made_normals = nb_allocate(allocator, count, sizeof *draft->made_normals);
    smoother in = {.draft = draft,
                   .place = nb_allocate(allocator, count, sizeof *in.place),
                   .faces = nb_allocate(allocator, draft->triangle_count, sizeof *in.faces),
                   .sharp = nb_allocate(allocator, count, sizeof *in.sharp),
                   .ends = nb_allocate(allocator, count, sizeof *in.ends)};
    const bool good = draft->made_normals != NULL && in.place != NULL && in.faces != NULL && in.sharp != NULL &&
                      in.ends != NULL && smooth(&in);
    draft->normals = draft->made_normals;
    nb_release(allocator, in.around);
    nb_release(allocator, in.ends);
    nb_release(allocator, in.sharp);
    nb_release(allocator, in.faces);
    nb_release(allocator, in.place);
    return good;
}
