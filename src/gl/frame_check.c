#include "frame_check.h"

#include "fog_context.h"

#include "method.h"
#include "gl_panorama.h"

#include <math.h>

enum { MOST_SIDE = 32768, MOST_SAMPLES = 4096 };

static nebel_result check_frame_size(const nebel_gl_renderer *r, const nebel_gl_frame_desc *desc)
{
    GLint viewport[2] = {0, 0};
    glGetIntegerv(GL_MAX_VIEWPORT_DIMS, viewport);
    uint32_t most = r->context.widest < MOST_SIDE ? r->context.widest : MOST_SIDE;
    for (int i = 0; i < 2; i++) most = (uint32_t)viewport[i] < most ? (uint32_t)viewport[i] : most;
    if (desc->width < 1 || desc->height < 1) {
        return nb_fail(&r->log, NEBEL_ERROR_VALUE, "frame: %u x %u pixels; 1 to %u are possible", (unsigned)desc->width,
                       (unsigned)desc->height, (unsigned)most);
    }
    if (desc->width > most || desc->height > most) {
        return nb_fail(
            &r->log, NEBEL_ERROR_LIMIT,
            "frame: %u x %u pixels; this OpenGL draws at most %u either way. The CPU renders larger pictures",
            (unsigned)desc->width, (unsigned)desc->height, (unsigned)most);
    }
    return NEBEL_OK;
}

static nebel_result check_frame_samples(const nebel_gl_renderer *r, uint32_t samples)
{
    if (samples > MOST_SAMPLES) {
        return nb_fail(&r->log, NEBEL_ERROR_VALUE, "frame: %u samples; 1 to 4096 are possible", (unsigned)samples);
    }
    if (samples > 1 && r->context.es && !epoxy_has_gl_extension("GL_EXT_float_blend")) {
        return nb_fail(
            &r->log, NEBEL_ERROR_UNSUPPORTED,
            "frame: OpenGL ES without GL_EXT_float_blend cannot add samples; ask for one sample, or use OpenGL");
    }
    return NEBEL_OK;
}

static nebel_result check_method(const nebel_gl_renderer *r, const nebel_gl_frame_desc *desc)
{
    if ((unsigned)desc->method >= NEBEL_GL_METHOD_COUNT) {
        return nb_fail(&r->log, NEBEL_ERROR_ARGUMENT, "frame: there is no method %d", (int)desc->method);
    }
    if (nb_method_takes_cells(desc->method) && desc->cells == NULL)
        return nb_fail(&r->log, NEBEL_ERROR_ARGUMENT, "frame: this method needs cells; they are NULL");
    const nebel_depth_taps taps = desc->taps != NULL ? *desc->taps : nebel_gl_default_taps();
    if (taps.offset >= 0 && taps.edge_threshold >= 0 && taps.brightness >= 0 &&
        isfinite(taps.offset + taps.background_depth + taps.edge_threshold + taps.depth_margin + taps.brightness)) {
        return NEBEL_OK;
    }
    return nb_fail(&r->log, NEBEL_ERROR_VALUE,
                   "frame: taps must be finite numbers; offset, edge and brightness 0 or more");
}

static nebel_result refuse_frame(const nebel_log *log, const char *what)
{
    return nb_fail(log, NEBEL_ERROR_UNSUPPORTED,
                   "frame: OpenGL cannot draw %s yet; the CPU can (nebel render --device cpu)", what);
}

static nebel_result check_layers(const nebel_gl_renderer *r)
{
    if (!r->context.es || epoxy_has_gl_extension("GL_EXT_float_blend")) return NEBEL_OK;
    return nb_fail(&r->log, NEBEL_ERROR_UNSUPPORTED,
                   "frame: OpenGL ES without GL_EXT_float_blend cannot lay the shells of a planet over each other; use "
                   "OpenGL, or the CPU renderer");
}

static nebel_result check_air(const nebel_gl_renderer *r, const nebel_gl_frame_desc *desc)
{
    if (desc->camera.projection == NEBEL_PROJECTION_ORTHOGRAPHIC)
        return nb_fail(&r->log, NEBEL_ERROR_UNSUPPORTED,
                       "frame: orthographic cameras see no planets; take a perspective one or a panorama");
    return r->particles.count > 0 ? refuse_frame(&r->log, "particles in the air of a planet") : NEBEL_OK;
}

/* What cannot be drawn with a planet is refused, not left out. */
static nebel_result check_planet(const nebel_gl_renderer *r, const nebel_gl_frame_desc *desc)
{
    const int has_air = nb_gl_planets_planet(r->scene) != NULL, has_layers = nb_gl_textured_planet(r->scene) != NULL;
    if (has_air && r->scene->planets[0].cloud_layer_count > 0 && !desc->clouds_by_processor)
        return refuse_frame(&r->log, "clouds with volume by itself");
    if ((has_air || has_layers) && desc->method != NEBEL_GL_METHOD_EXACT)
        return nb_fail(&r->log, NEBEL_ERROR_UNSUPPORTED,
                       "planets are drawn by the method exact alone: ask for no other method, or leave the planet out");
    if (has_layers) return check_layers(r);
    return has_air ? check_air(r, desc) : NEBEL_OK;
}

/* Floats of corners have 24 bits: what is longer leaves none for a picture that shows a part of it, and rasterizers lose it. */
#define LONGEST_EDGE 3e8
#define MOST_PICTURES 1e7

/* How many pictures high a mesh's longest edge is where the mesh is nearest; of one around the camera, at a sixteenth of that
 * edge. */
static double pictures_across(const nb_mesh *mesh, const nebel_camera *camera)
{
    if (camera->projection == NEBEL_PROJECTION_PANORAMA) return 0;
    if (camera->projection == NEBEL_PROJECTION_ORTHOGRAPHIC) return mesh->longest / camera->view_height;
    const double distance = fmax(nb_meshes_distance(mesh, camera->position), mesh->longest / 16);
    return mesh->longest / (2 * distance * tan(camera->vertical_fov * (3.14159265358979323846 / 360)));
}

/* How far the planes of large triangles may lie off for floats, over the camera's distance from them. */
#define MOST_OFF 1e-3

/* Whether the place of a triangle that is askew loses itself among the digits of its corners, for a camera near it. */
static int is_lost(const nb_mesh *mesh, const nb_large_plane *plane, const double camera[3])
{
    double height = -plane->height, off = 0, square = 0;
    for (int i = 0; i < 3; i++) {
        const double at = camera[i] - mesh->origin[i];
        const double extent = fmax(fabs((double)mesh->low[i]), fabs((double)mesh->high[i]));
        height += plane->normal[i] * at;
        square += (at - plane->middle[i]) * (at - plane->middle[i]);
        off += 0x1p-24 * fabs(plane->normal[i]) * (fabs(at) + extent);
    }
    return sqrt(square) < plane->radius && off > MOST_OFF * fabs(height);
}

static nebel_result check_large(const nebel_gl_renderer *r, const nebel_gl_frame_desc *desc, size_t i)
{
    const nb_mesh *const mesh = &r->meshes.list[i];
    int is_good = 1;
    for (size_t k = 0; k < mesh->large_count && is_good; k++)
        is_good = !is_lost(mesh, &mesh->large[k], desc->camera.position);
    if (is_good) return NEBEL_OK;
    return nb_fail(&r->log, NEBEL_ERROR_LIMIT,
                   "mesh %zu: a triangle of %g m or more lies askew, and so near to the camera that OpenGL would draw "
                   "it more than a thousandth of its distance off: split it, or use the CPU's renderer (--device cpu)",
                   i, NB_LARGE_EDGE);
}

static nebel_result check_frame_mesh(const nebel_gl_renderer *r, const nebel_gl_frame_desc *desc, size_t i)
{
    const nb_mesh *const mesh = &r->meshes.list[i];
    const int is_parallel = desc->camera.projection == NEBEL_PROJECTION_ORTHOGRAPHIC;
    if (mesh->longest > LONGEST_EDGE && !is_parallel)
        return nb_fail(&r->log, NEBEL_ERROR_LIMIT,
                       "mesh %zu: an edge is %g m long; OpenGL draws triangles of at most %g m: split it, or use the "
                       "CPU's renderer (--device cpu)",
                       i, mesh->longest, LONGEST_EDGE);
    if (!(pictures_across(mesh, &desc->camera) > MOST_PICTURES)) return NEBEL_OK;
    return nb_fail(&r->log, NEBEL_ERROR_LIMIT,
                   "camera: %s is %g %s, and an edge of mesh %zu is %g m long; OpenGL draws triangles that are at most "
                   "%g pictures high: split the mesh, or use the CPU's renderer (--device cpu)",
                   is_parallel ? "view_height" : "vertical_fov",
                   is_parallel ? desc->camera.view_height : desc->camera.vertical_fov, is_parallel ? "m" : "degrees", i,
                   mesh->longest, MOST_PICTURES);
}

static nebel_result check_meshes(const nebel_gl_renderer *r, const nebel_gl_frame_desc *desc)
{
    nebel_result result = NEBEL_OK;
    for (size_t i = 0; i < r->meshes.count && result == NEBEL_OK; i++) {
        result = check_frame_mesh(r, desc, i);
        if (result == NEBEL_OK) result = check_large(r, desc, i);
    }
    return result;
}

/* What places in floats may change of the light of fog. */
#define MOST_FOG_ERROR (1. / 255)

/* The same for models in it: more, because only surfaces within a mean free path of where fog begins are that far off. */
#define MOST_SURFACE_ERROR (4. / 255)

static nebel_view_error find_fog_error(const nebel_gl_renderer *r, const nebel_gl_frame_desc *desc)
{
    const nebel_log silent = {0};
    nebel_view views[6];
    nebel_view_error worst = {.error = 0}, error;
    const int is_panorama = desc->camera.projection == NEBEL_PROJECTION_PANORAMA;
    if (nb_camera_look(&desc->camera, desc->width, desc->height, &silent, views) != NEBEL_OK) return worst;
    if (is_panorama) nb_panorama_faces(desc->camera.position, desc->width, desc->height, views);
    for (int i = 0; i < (is_panorama ? 6 : 1); i++)
        if (nebel_find_view_error(nebel_get_lighting_snapshot(r->fog), &views[i], &error) == NEBEL_OK) {
            const double by_surface = fmax(worst.by_surface, error.by_surface);
            if (!(error.error <= worst.error)) worst = error;
            worst.by_surface = by_surface;
        }
    return worst;
}

/* How to see as much with pixels of `wider` times the width. */
static nebel_result refuse_pixels(const nebel_gl_renderer *r, const nebel_gl_frame_desc *desc,
                                  const nebel_view_error *error, double wider)
{
    const int is_parallel = desc->camera.projection == NEBEL_PROJECTION_ORTHOGRAPHIC;
    const double size = is_parallel ? desc->camera.view_height : desc->camera.vertical_fov;
    return nb_fail(&r->log, NEBEL_ERROR_LIMIT,
                   "camera: %s is %g %s, and pixels are %.3g m wide at fog that is %.4g m away; OpenGL draws its "
                   "outlines with pixels of at least %.3g m: make %s at least %.3g, draw at most %u rows, or use the "
                   "CPU's renderer (--device cpu)",
                   is_parallel ? "view_height" : "vertical_fov", size, is_parallel ? "m" : "degrees", error->pixel,
                   error->distance, error->pixel * wider, is_parallel ? "view_height" : "vertical_fov", size * wider,
                   (unsigned)(desc->height / wider));
}

static nebel_result check_fog(const nebel_gl_renderer *r, const nebel_gl_frame_desc *desc)
{
    const int is_exact = desc->method == NEBEL_GL_METHOD_EXACT || desc->method == NEBEL_GL_METHOD_FIVE_TAP;
    if (!is_exact || nb_gl_count_volumes(r->fog) == 0) return NEBEL_OK;
    const nebel_view_error error = find_fog_error(r, desc);
    if (r->meshes.count > 0 && error.by_surface > MOST_SURFACE_ERROR)
        return nb_fail(
            &r->log, NEBEL_ERROR_LIMIT,
            "camera: fog is so dense for its distance that OpenGL would draw models in it up to %.2g off: go "
            "nearer, to a %.2g of the distance, or use the CPU's renderer (--device cpu)",
            fmin(error.by_surface, 1), MOST_SURFACE_ERROR / error.by_surface);
    if (error.error <= MOST_FOG_ERROR) return NEBEL_OK;
    if (error.by_pixel > error.by_width && error.by_width < MOST_FOG_ERROR)
        return refuse_pixels(r, desc, &error, error.by_pixel / (MOST_FOG_ERROR - error.by_width));
    return nb_fail(&r->log, NEBEL_ERROR_LIMIT,
                   "camera: fog, or the height over which it thins out, is only %.4g m wide and %.4g m away; OpenGL "
                   "would draw it up to %.2g off: go nearer than %.3g m, or use the CPU's renderer (--device cpu)",
                   error.width, error.distance, error.error, error.distance * MOST_FOG_ERROR / error.error);
}

nebel_result nb_gl_frame_check(const nebel_gl_renderer *r, const nebel_gl_frame_desc *desc, uint32_t samples)
{
    if (!(fabs(desc->time) <= 1e12))
        return nb_fail(&r->log, NEBEL_ERROR_VALUE, "frame: time is %g; must be within -1e12 and 1e12", desc->time);
    nebel_result result = check_frame_size(r, desc);
    if (result == NEBEL_OK) result = check_frame_samples(r, samples);
    if (result == NEBEL_OK) result = check_planet(r, desc);
    if (result == NEBEL_OK) result = check_meshes(r, desc);
    if (result == NEBEL_OK) result = check_fog(r, desc);
    return result == NEBEL_OK ? check_method(r, desc) : result;
}
