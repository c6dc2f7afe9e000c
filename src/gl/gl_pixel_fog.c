#include "gl_pixel_fog.h"

#include "gl_panorama.h"

#include <epoxy/gl.h>
#include <math.h>

/* What a picture is made in: texels of distances become texels of light. */
typedef struct nb_pixel_fog_work {
    const nb_targets *targets;
    const nebel_rays *rays;
    const nb_vertex_source *source;
    float (*texels)[4];        /* of the picture: distance first, in-scattering at last */
    float (*transmittance)[4]; /* of the picture */
    float (*places)[3];        /* of a row, from the eye */
    float (*fog)[4];           /* of a row */
} nb_pixel_fog_work;

/* As the texts of the shaders have it. */
static void find_ray(const nb_pixel_fog_work *w, double x, double y, double origin[3], double direction[3])
{
    const nebel_texel_f32 *const words = w->rays->texels;
    double length2 = 0;
    for (int i = 0; i < 3; i++) {
        origin[i] = (double)words[0].v[i] + x * (double)words[1].v[i] + y * (double)words[2].v[i];
        direction[i] = (double)words[3].v[i] + x * (double)words[4].v[i] + y * (double)words[5].v[i];
        length2 += direction[i] * direction[i];
    }
    for (int i = 0; i < 3; i++) direction[i] /= sqrt(length2);
}

static void find_pixel_place(const nb_pixel_fog_work *w, uint32_t x, uint32_t y, float t, float place[3])
{
    double origin[3] = {0, 0, 0}, direction[3];
    if (w->source->projection == NEBEL_PROJECTION_PANORAMA)
        nb_panorama_direction(w->rays, x + .5, y + .5, direction);
    else
        find_ray(w, x + .5, y + .5, origin, direction);
    for (int i = 0; i < 3; i++) place[i] = (float)(origin[i] + (double)t * direction[i]);
}

/* Where there is no surface there is no fog. */
static nebel_result set_row(const nb_pixel_fog_work *w, uint32_t y)
{
    const uint32_t width = w->targets->width;
    const size_t first = (size_t)y * width;
    nebel_vertices places = {.positions = w->places, .position_stride = sizeof *w->places};
    for (int i = 0; i < 3; i++) places.origin[i] = places.eye[i] = w->rays->eye[i];
    for (uint32_t x = 0; x < width; x++) find_pixel_place(w, x, y, w->texels[first + x][0], w->places[x]);
    const nebel_result result = nb_vertex_fog_find(w->source, width, &places, w->fog);
    for (uint32_t x = 0; x < width && result == NEBEL_OK; x++) {
        float *const light = w->texels[first + x], *const through = w->transmittance[first + x];
        const float hit = light[0] > 0 ? 1.f : 0.f;
        for (int i = 0; i < 3; i++) {
            light[i] = hit * w->fog[x][i];
            through[i] = 1 - hit * w->fog[x][3];
        }
        light[3] = through[3] = 1;
    }
    return result;
}

static void upload_texels(const nb_targets *t, unsigned texture, const float (*texels)[4])
{
    glBindTexture(GL_TEXTURE_2D, texture);
    glTexSubImage2D(GL_TEXTURE_2D, 0, 0, 0, (GLsizei)t->width, (GLsizei)t->height, GL_RGBA, GL_FLOAT, texels);
}

static nebel_result set_picture(const nb_pixel_fog_work *w)
{
    const nb_targets *const t = w->targets;
    nebel_result result = NEBEL_OK;
    glBindFramebuffer(GL_READ_FRAMEBUFFER, t->surface_buffer);
    glReadBuffer(GL_COLOR_ATTACHMENT0);
    glReadPixels(0, 0, (GLsizei)t->width, (GLsizei)t->height, GL_RGBA, GL_FLOAT, w->texels);
    for (uint32_t y = 0; y < t->height && result == NEBEL_OK; y++) result = set_row(w, y);
    if (result != NEBEL_OK) return result;
    upload_texels(t, t->in_scattering, (const float(*)[4])w->texels);
    upload_texels(t, t->transmittance, (const float(*)[4])w->transmittance);
    return result;
}

nebel_result nb_pixel_fog_set(const nb_targets *targets, const nebel_allocator *allocator, const nebel_log *log,
                              const nebel_rays *rays, const nb_vertex_source *source)
{
    nb_pixel_fog_work w = {.targets = targets, .rays = rays, .source = source};
    const size_t pixels = (size_t)targets->width * targets->height;
    w.texels = nb_allocate(allocator, pixels, sizeof *w.texels);
    w.transmittance = nb_allocate(allocator, pixels, sizeof *w.transmittance);
    w.places = nb_allocate(allocator, targets->width, sizeof *w.places);
    w.fog = nb_allocate(allocator, targets->width, sizeof *w.fog);
    const int room = w.texels != NULL && w.transmittance != NULL && w.places != NULL && w.fog != NULL;
    const nebel_result result =
        room ? set_picture(&w) : nb_fail(log, NEBEL_ERROR_MEMORY, "OpenGL renderer: out of memory for fog at pixels");
    nb_release(allocator, w.texels);
    nb_release(allocator, w.transmittance);
    nb_release(allocator, w.places);
    nb_release(allocator, w.fog);
    return result;
}
