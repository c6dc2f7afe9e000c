/* Clouds with volume in a frame, by the processor: once for the rays through the middles of pixels, among air and fog; then for
 * each sample what they do up to where its rays end, and to the sun's light there. */
#include "cloud_picture.h"
#include "gl_frame.h"
#include "fog_context.h"
#include "texel_texture.h"

#include <math.h>
#include <string.h>

static const nebel_log *log_of(const nb_gl_frame *f)
{
    return &f->renderer->log;
}

static nebel_result fail_memory(const nb_gl_frame *f, nebel_result result)
{
    return result == NEBEL_ERROR_MEMORY ? nb_fail(log_of(f), result, "frame: out of memory for clouds") : result;
}

static size_t count_pixels(const nb_gl_frame *f)
{
    return (size_t)f->view.width * f->view.height;
}

static float *make_plane(const nb_gl_frame *f)
{
    return nb_allocate(&f->renderer->allocator, 4 * count_pixels(f), sizeof(float));
}

static int has_fog(const nb_gl_frame *f)
{
    return f->renderer->fog != NULL && nb_gl_count_volumes(f->renderer->fog) > 0;
}

static nebel_result ask(void *user)
{
    return nb_gl_frame_ask(user);
}

static nb_cloud_picture picture_of(nb_gl_frame *f, const nebel_view *view, nb_pixel_position point)
{
    const nebel_scene_data *const scene = f->renderer->scene;
    nebel_sun sun = nb_surface_lighting_sun(scene);
    (void)nb_vector_make_unit(sun.direction);
    return (nb_cloud_picture){.view = view,
                              .panorama = f->panorama,
                              .pixel = nb_camera_pixel(view, f->panorama),
                              .point = point,
                              .eye = {f->eye[0], f->eye[1], f->eye[2]},
                              .worlds = f->renderer->air.worlds,
                              .world_count = f->renderer->air.count,
                              .to_sun = {sun.direction[0], sun.direction[1], sun.direction[2]},
                              .disc = nb_planets_disc(scene),
                              .has_fog = has_fog(f),
                              .ask = ask,
                              .ask_user = f};
}

static nb_cloud_picture picture_of_middles(nb_gl_frame *f)
{
    nb_cloud_picture picture = picture_of(f, &f->view, nb_pixel_sample(0, 1));
    picture.lifts = f->samples > 1;
    return picture;
}

/* The usual unpacking. A plane of 4 numbers. */
static nebel_result upload_plane(const nb_gl_frame *f, unsigned *texture, const float *texels)
{
    glActiveTexture(GL_TEXTURE0);
    nb_texel_texture_bind(texture);
    glTexImage2D(GL_TEXTURE_2D, 0, GL_RGBA32F, (GLsizei)f->view.width, (GLsizei)f->view.height, 0, GL_RGBA, GL_FLOAT,
                 texels);
    return nb_context_check_memory(log_of(f), "clouds; ask for fewer pixels");
}

static void read_back(const nb_gl_frame *f, unsigned framebuffer, int attachment, float *texels)
{
    glBindFramebuffer(GL_READ_FRAMEBUFFER, framebuffer);
    glReadBuffer((GLenum)(GL_COLOR_ATTACHMENT0 + attachment));
    glReadPixels(0, 0, (GLsizei)f->view.width, (GLsizei)f->view.height, GL_RGBA, GL_FLOAT, texels);
}

/* ---- the whole frame ------------------------------------------------------------------------- */

/* Where there are no clouds rays end at once. */
static nebel_result find_fog(nb_gl_frame *f, float *ends, float *left, float *light)
{
    nebel_gl_renderer *const r = f->renderer;
    for (size_t i = 0; i < count_pixels(f); i++) ends[4 * i] = fmaxf(ends[4 * i], 1e-30f);
    nebel_result result = upload_plane(f, &r->cloud_ends, ends);
    f->place = r->cloud_ends;
    if (result == NEBEL_OK) result = nb_gl_frame_draw_fog(f);
    if (result != NEBEL_OK) return result;
    read_back(f, r->targets.fog_buffer, 0, light);
    read_back(f, r->targets.fog_buffer, 1, left);
    return NEBEL_OK;
}

/* Planes of the frame: where fog is asked for and along which ray, and what air and fog do up to there. */
typedef struct fog_planes {
    float *places, *left, *light;
} fog_planes;

/* Fog among clouds, wherever it must be known. */
static nebel_result find_marks(nb_gl_frame *f, const nb_cloud_picture *picture, const fog_planes *fog)
{
    nebel_gl_renderer *const r = f->renderer;
    for (;;) {
        int any;
        nebel_result result = nb_cloud_picture_choose(&r->clouds, picture, fog->places, &any);
        if (result != NEBEL_OK || !any) return result;
        result = find_fog(f, fog->places, fog->left, fog->light);
        if (result != NEBEL_OK) return result;
        nb_cloud_picture_mark(&r->clouds, picture, fog->left, fog->light);
    }
}

static nebel_result find_all_fog(nb_gl_frame *f, const nb_cloud_picture *picture)
{
    nebel_gl_renderer *const r = f->renderer;
    const fog_planes fog = {.places = make_plane(f), .left = make_plane(f), .light = make_plane(f)};
    nebel_result result = fog.places != NULL && fog.left != NULL && fog.light != NULL ? NEBEL_OK : NEBEL_ERROR_MEMORY;
    if (result == NEBEL_OK) result = find_marks(f, picture, &fog);
    nb_release(&r->allocator, fog.places);
    nb_release(&r->allocator, fog.left);
    nb_release(&r->allocator, fog.light);
    return result;
}

/* All fog has that of the origin. */
static nebel_result find_shade(nb_gl_frame *f)
{
    static const double origin[1][3] = {{0, 0, 0}};
    const nebel_gl_renderer *const r = f->renderer;
    return r->daylit.lit == NULL || r->cloud_shade.clear_sky > 0
               ? NEBEL_OK
               : nebel_compute_cloud_sun_transmittance(r->clouds.parts[0].workspace, NB_FOG_SHADE_ORIGIN, 1, origin, 0,
                                                       &f->even_shade);
}

/* On air, and on fog by its place, for all samples. */
static nebel_result draw_shade(nb_gl_frame *f, const nb_cloud_picture *picture)
{
    nebel_gl_renderer *const r = f->renderer;
    const nb_cloud_shadow_extent *const roof = r->cloud_shade.clear_sky > 0 ? &r->daylit.roof : NULL;
    const size_t texels = count_pixels(f) * (roof != NULL ? NB_CLOUD_SHADE_LAYERS : NB_AIR_SHADE_LAYERS);
    uint32_t layers, *const words = nb_allocate(&r->allocator, texels, NB_CLOUD_SHADE_TEXELS * sizeof *words);
    if (words == NULL) return NEBEL_ERROR_MEMORY;
    nebel_result result = nb_cloud_picture_write_shade(&r->clouds, picture, roof, words, &layers);
    glActiveTexture(GL_TEXTURE0 + NB_UNIT_SHADE);
    if (result == NEBEL_OK)
        result = nb_gl_cloud_shade_upload(&r->cloud_shade, log_of(f), f->view.width, f->view.height, layers, words);
    glActiveTexture(GL_TEXTURE0);
    nb_release(&r->allocator, words);
    return result;
}

nebel_result nb_gl_frame_set_clouds(nb_gl_frame *f, nebel_cloud_workspace **workspace)
{
    nb_gl_clouds *const clouds = &f->renderer->clouds;
    const nebel_sun sun = nb_surface_lighting_sun(f->renderer->scene);
    nebel_result result = nb_cloud_picture_set(clouds, f->clouds, &sun, f->desc->time, log_of(f));
    if (result == NEBEL_OK) result = nb_cloud_picture_workspace(clouds, workspace);
    return fail_memory(f, result);
}

nebel_result nb_gl_frame_trace_clouds(nb_gl_frame *f)
{
    nebel_gl_renderer *const r = f->renderer;
    const nb_cloud_picture picture = picture_of_middles(f);
    nebel_result result = nb_cloud_picture_trace(&r->clouds, &picture);
    if (result == NEBEL_OK) result = find_shade(f);
    if (result == NEBEL_OK) result = draw_shade(f, &picture);
    if (result == NEBEL_OK && has_fog(f)) result = find_all_fog(f, &picture);
    if (result == NEBEL_OK) result = nb_cloud_picture_mix(&r->clouds, &picture);
    return fail_memory(f, result);
}

/* ---- samples --------------------------------------------------------------------------------- */

nebel_result nb_gl_frame_end_clouds(nb_gl_frame *f)
{
    nebel_gl_renderer *const r = f->renderer;
    const nb_cloud_picture picture = picture_of(f, f->panorama ? &f->view : &f->sample_view, f->point);
    const nb_cloud_picture middle = picture_of_middles(f);
    float *const places = make_plane(f), *const over = make_plane(f), *const shade = make_plane(f);
    nebel_result result = places != NULL && over != NULL && shade != NULL ? NEBEL_OK : NEBEL_ERROR_MEMORY;
    if (result == NEBEL_OK) {
        read_back(f, r->targets.surface_buffer, 0, places);
        result = nb_cloud_picture_end(&r->clouds, &picture, &middle, places, over, shade);
    }
    result = fail_memory(f, result);
    if (result == NEBEL_OK) result = upload_plane(f, &r->cloud_over, over);
    if (result == NEBEL_OK) result = upload_plane(f, &r->cloud_dimming, shade);
    nb_release(&r->allocator, places);
    nb_release(&r->allocator, over);
    nb_release(&r->allocator, shade);
    return result;
}

void nb_gl_frame_bind_clouds(const nb_gl_frame *f)
{
    nb_gl_frame_bind_texture(NB_UNIT_CLOUDS, GL_TEXTURE_2D, f->renderer->cloud_over);
    nb_gl_frame_bind_texture(NB_UNIT_DIMMING, GL_TEXTURE_2D, f->renderer->cloud_dimming);
}
