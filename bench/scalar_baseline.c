/* Compiled without vectorization (bench/CMakeLists.txt). */
#include "scalar_baseline.h"

#include <math.h>

/* Both ends beyond the same side. */
static int is_rejected(const nb_old_box *box, const nb_old_vector *a, const nb_old_vector *b)
{
    if (a->x < box->low.x && b->x < box->low.x) return 1;
    if (a->x > box->high.x && b->x > box->high.x) return 1;
    if (a->y < box->low.y && b->y < box->low.y) return 1;
    if (a->y > box->high.y && b->y > box->high.y) return 1;
    if (a->z < box->low.z && b->z < box->low.z) return 1;
    if (a->z > box->high.z && b->z > box->high.z) return 1;
    return 0;
}

/* Narrows [in, out] to one slab; 0 when nothing is left. A parallel ray misses only from outside. */
static int clip_slab(float low, float high, float origin, float direction, float *in, float *out)
{
    if (direction == 0) return origin >= low && origin <= high;
    float first = (low - origin) / direction, last = (high - origin) / direction;
    if (first > last) {
        const float swapped = first;
        first = last;
        last = swapped;
    }
    if (first > *in) *in = first;
    if (last < *out) *out = last;
    return *in <= *out;
}

static int intersect_box(const nb_old_box *box, const nb_old_vector *origin, const nb_old_vector *direction, float *in,
                         float *out)
{
    *in = -1e30f;
    *out = 1e30f;
    return clip_slab(box->low.x, box->high.x, origin->x, direction->x, in, out) &&
           clip_slab(box->low.y, box->high.y, origin->y, direction->y, in, out) &&
           clip_slab(box->low.z, box->high.z, origin->z, direction->z, in, out);
}

/* How much of the way to the vertex is inside, when the ray is inside from `in` to `out`. */
static float distance_in_fog(float in, float out, float vertex)
{
    if (out <= 0) return 0;                      /* fog behind the camera */
    if (in >= vertex) return 0;                  /* fog behind the vertex */
    if (in <= 0 && out >= vertex) return vertex; /* both inside */
    if (in <= 0) return out;                     /* camera inside */
    if (out >= vertex) return vertex - in;       /* vertex inside */
    return out - in;
}

static float depth_of_vertex(const nb_old_camera *camera, const nb_old_box *boxes, size_t box_count,
                             const nb_old_vector *p)
{
    const nb_old_vector *o = &camera->position;
    const nb_old_vector way = {p->x - o->x, p->y - o->y, p->z - o->z};
    const float length = sqrtf(way.x * way.x + way.y * way.y + way.z * way.z);
    if (length == 0) return 0;
    const nb_old_vector direction = {way.x / length, way.y / length, way.z / length};
    float depth = 0;
    for (size_t i = 0; i < box_count; i++) {
        float in, out;
        if (is_rejected(&boxes[i], o, p) || !intersect_box(&boxes[i], o, &direction, &in, &out)) continue;
        depth += boxes[i].extinction * distance_in_fog(in, out, length);
    }
    return depth;
}

void nb_magazine_fog(const nb_old_camera *camera, const nb_old_box *boxes, size_t box_count, nb_old_vertex *vertices,
                     size_t vertex_count)
{
    for (size_t i = 0; i < vertex_count; i++) {
        vertices[i].transmittance = expf(-depth_of_vertex(camera, boxes, box_count, &vertices[i].position));
    }
}

void nb_magazine_color(const nb_old_camera *camera, const nb_old_box *boxes, size_t box_count, const float color[3],
                       nb_old_colored_vertex *vertices, size_t vertex_count)
{
    for (size_t i = 0; i < vertex_count; i++) {
        const float amount = 1 - expf(-depth_of_vertex(camera, boxes, box_count, &vertices[i].position));
        for (int c = 0; c < 3; c++) vertices[i].color[c] = (unsigned char)(255 * amount * color[c] + .5f);
        vertices[i].color[3] = (unsigned char)(255 * amount + .5f);
    }
}
