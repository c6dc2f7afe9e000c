/* Fog over a finished picture, compiled once per instruction set.
 *
 * Per pixel 8 bytes come and 4 go; 10 operations for the ray and 9 per box to find that a packet misses it. Where it
 * does not, three divisions, a square root, 5 operations for the ray, 20 per box, and 45 for exponential and blending.
 */
#define NB_FAST

#include "pixel_kernel.h"

#include "formulas/prelude.h"

#include "formulas/elementary.inc"

#include "stream_packet.h"

#include "box_reject.h"

#include <string.h>

/* ---- light ----------------------------------------------------------------------------------- */

/* From the eye to depth 1. */
NB_INLINE nb_vec3 way_of(const float row[3], const float step[3], nb_real x)
{
    return nb_vec3(nb_splat(row[0]) + x * nb_splat(step[0]), nb_splat(row[1]) + x * nb_splat(step[1]),
                   nb_splat(row[2]) + x * nb_splat(step[2]));
}

/* Through the boxes named in `list`. */
NB_INLINE nb_real octaves_of(const nb_slabs *boxes, const unsigned char *list, size_t count, const nb_packet *packet,
                             nb_real limit)
{
    nb_real octaves = NB_F(0.0);
    for (size_t i = 0; i < count; i++) {
        const nb_slabs *box = &boxes[list[i]];
        octaves = octaves + nb_part_inside(box, packet, limit) * nb_splat(box->octaves);
    }
    return octaves;
}

/* ---- blending -------------------------------------------------------------------------------- */

/* light * color + (1 - light) * radiance. Colours have 8 more bits than the picture, light has 15: every product is
 * below 2^31, and differences may wrap around because their sum does not. Exact for a light of 0 and 1, rounded to
 * nearest otherwise, but for light's own rounding, 1 / 65536. */
typedef struct glow {
    nb_bits radiance;
    nb_bits opaque; /* the result for a light of 0, and half a step of the picture, which is 2^23 */
} glow;

static glow make_glow(uint32_t radiance)
{
    const nb_bits none = nb_to_bits(nb_splat(0));
    return (glow){none + radiance, none + (radiance * 32768u + (1u << 22))};
}

NB_INLINE nb_bits mix(nb_bits color, const glow *fog, nb_bits light)
{
    return (color - fog->radiance) * light + fog->opaque;
}

NB_INLINE nb_bits blend(nb_bits pixel, const glow fog[3], nb_real light)
{
    const nb_bits weight = nb_to_bits(light * NB_F(32768.0) + NB_INTEGER) - NB_INTEGER_BITS;
    const nb_bits red = mix((pixel << 8) & 0xff00u, &fog[0], weight);
    const nb_bits green = mix(pixel & 0xff00u, &fog[1], weight);
    const nb_bits blue = mix((pixel >> 8) & 0xff00u, &fog[2], weight);
    return (red >> 23) | ((green >> 15) & 0xff00u) | ((blue >> 7) & 0xff0000u) | (pixel & 0xff000000u);
}

/* ---- rows ------------------------------------------------------------------------------------ */

/* What stays the same for a whole call, copied so that no store to the picture can change it. */
typedef struct scene {
    nb_slabs boxes[NB_FOG_BOXES];
    nb_box_reject fences[NB_FOG_BOXES];
    size_t box_count;
    glow fog[3];
    float step[3];
} scene;

NB_INLINE nb_bits fog_packet(const scene *s, const float row[3], nb_real x, nb_real depth, nb_bits pixels,
                             int along_ray)
{
    const nb_vec3 none = nb_vec3(nb_splat(0), nb_splat(0), nb_splat(0));
    const nb_vec3 way = way_of(row, s->step, x);
    const nb_real limit = along_ray ? depth / nb_sqrt(nb_dot3(way, way)) : depth;
    const nb_vec3 end = nb_scale3(way, limit);
    unsigned char list[NB_FOG_BOXES];
    const size_t count = nb_list_boxes(s->fences, s->box_count, end, end, 1, list);
    if (count == 0) return pixels;
    const nb_packet packet = nb_make_packet(none, way);
    const nb_real octaves = octaves_of(s->boxes, list, count, &packet, limit);
    if (!nb_any(octaves < NB_F(0.0))) return pixels;
    return blend(pixels, s->fog, nb_light_after(octaves * nb_sqrt(packet.square)));
}

/* Processors fetch ahead by themselves, but begin anew in every page and only once its address is translated. */
NB_INLINE void fetch_ahead(const unsigned char *p)
{
    enum { PAGE = 4096 };
    __builtin_prefetch((const void *)((uintptr_t)p + PAGE));
}

/* `along_ray` is a constant. */
NB_INLINE void fog_row(const scene *s, const float row[3], uint32_t width, const unsigned char *depth,
                       const unsigned char *color, unsigned char *out, int along_ray)
{
    const size_t packet = 4 * NB_WIDTH;
    float lanes[NB_WIDTH];
    nb_real depths;
    nb_bits pixels;
    for (uint32_t i = 0; i < NB_WIDTH; i++) lanes[i] = (float)i;
    nb_real x = nb_load_lanes(lanes);
    uint32_t left = width;
    for (; left >= NB_WIDTH; left -= NB_WIDTH, depth += packet, color += packet, out += packet) {
        fetch_ahead(depth);
        fetch_ahead(color);
        fetch_ahead(out);
        memcpy(&depths, depth, sizeof depths);
        memcpy(&pixels, color, sizeof pixels);
        pixels = fog_packet(s, row, x, depths, pixels, along_ray);
        memcpy(out, &pixels, sizeof pixels);
        x = x + nb_splat(NB_WIDTH);
    }
    if (left == 0) return;
    memset(&depths, 0, sizeof depths);
    memset(&pixels, 0, sizeof pixels);
    memcpy(&depths, depth, 4 * (size_t)left);
    memcpy(&pixels, color, 4 * (size_t)left);
    pixels = fog_packet(s, row, x, depths, pixels, along_ray);
    memcpy(out, &pixels, 4 * (size_t)left);
}

static void set_scene(const nb_pixels_job *job, scene *s)
{
    const float zero[3] = {0, 0, 0};
    s->box_count = job->box_count;
    for (size_t i = 0; i < job->box_count; i++) {
        s->boxes[i] = nb_make_slabs(&job->boxes[i], zero);
        s->fences[i] = nb_make_fence(&s->boxes[i]);
    }
    for (int c = 0; c < 3; c++) s->fog[c] = make_glow(job->radiance[c]);
    memcpy(s->step, job->step_x, sizeof s->step);
}

void NB_SUFFIXED(nb_pixels_)(const nb_pixels_job *job)
{
    scene s;
    set_scene(job, &s);
    for (uint32_t y = job->first_row; y < job->first_row + job->row_count; y++) {
        const unsigned char *depth = job->depth + y * job->depth_pitch, *color = job->color + y * job->color_pitch;
        unsigned char *out = job->out + y * job->out_pitch;
        float row[3];
        for (int c = 0; c < 3; c++) row[c] = job->corner[c] + (float)y * job->step_y[c];
        if (job->along_ray)
            fog_row(&s, row, job->width, depth, color, out, 1);
        else
            fog_row(&s, row, job->width, depth, color, out, 0);
    }
}
