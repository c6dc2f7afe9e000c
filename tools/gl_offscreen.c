#include "gl_offscreen.h"

#include "gl_fixed_function.h"

static nebel_result set_particles(const nb_gl_offscreen *painter)
{
    const nebel_scene *const scene = painter->loaded->scene;
    const size_t count = nebel_get_scene_data(scene)->particle_count;
    nebel_particle *particles = NULL;
    if (count == 0) return NEBEL_OK;
    nebel_result result = nebel_generate_scene_particles(scene, &particles);
    if (result == NEBEL_OK) result = nebel_set_gl_renderer_particles(painter->renderer, particles, count);
    nebel_free_scene_particles(scene, particles);
    return result;
}

static int is_of_fixed(nebel_method method)
{
    return method == NEBEL_METHOD_FOG_COORD || method == NEBEL_METHOD_TWO_PASS || method == NEBEL_METHOD_ALPHA;
}

/* It has neither particles nor rays that no matrix makes, and parallel ones have no eye. */
static int suits_fixed(const nebel_scene_data *scene)
{
    return scene->particle_count == 0 && scene->camera.projection == NEBEL_PROJECTION_PERSPECTIVE;
}

static void note_driver(const nb_gl_offscreen *painter, nebel_method method)
{
    nb_report_message("note: --device gl: %s", painter->context.renderer);
    if (painter->context.no_desktop[0] != '\0')
        nb_report_message("note: --device gl: OpenGL ES, because %s", painter->context.no_desktop);
    if (painter->is_fixed || !is_of_fixed(method)) return;
    nb_report_message("note: --device gl: --method %s is drawn by shaders, not by the fixed pipeline, because %s",
                      nebel_method_name(method),
                      suits_fixed(painter->scene) ? "the driver has no compatibility profile"
                                                  : "that has neither particles nor this projection");
}

int nb_gl_painter_open(nb_gl_offscreen *painter, const char *name, const nb_load_result *loaded,
                       const nebel_scene_data *scene, nebel_method method, nb_report_listener *listener)
{
    const nebel_gl_renderer_desc desc = {
        .host = {.log = nb_report_log(listener), .parallel.run = nebel_parallel_for_openmp}};
    *painter = (nb_gl_offscreen){.loaded = loaded, .scene = scene, .log = desc.host.log};
    const int fixed = is_of_fixed(method) && suits_fixed(scene);
    painter->is_fixed = fixed && nb_gl_context_open(&painter->context, NB_GL_API_FIXED) == 0;
    if (!painter->is_fixed && nb_gl_context_open_any(&painter->context) != 0) {
        return nb_report_failure("render: --device gl: %s; or say --device cpu", painter->context.fault);
    }
    nebel_result result = nebel_create_gl_renderer(scene, NULL, &desc, &painter->renderer);
    if (result == NEBEL_OK) result = set_particles(painter);
    if (result == NEBEL_OK && !listener->quiet) note_driver(painter, method);
    if (result == NEBEL_OK) return NB_DONE;
    nebel_destroy_gl_renderer(painter->renderer);
    painter->renderer = NULL;
    nb_gl_context_close(&painter->context);
    return nb_report_result(listener, name, result);
}

/* Particles are drawn in another way than other fog. */
static nebel_result set_fog(const nb_gl_offscreen *painter, double frame)
{
    const nb_load_result *loaded = painter->loaded;
    nebel_snapshot *volumes = NULL;
    nebel_lighting *lighting = NULL;
    if (nebel_get_scene_data(loaded->scene)->particle_count == 0) {
        return nebel_set_gl_renderer_lighting(painter->renderer, loaded->lighting);
    }
    nebel_result result = nebel_commit_scene_volumes_at(loaded->scene, frame, &volumes);
    if (result == NEBEL_OK)
        result = nebel_create_scene_lighting(loaded->scene, volumes, frame, loaded->lighting, &lighting);
    if (result == NEBEL_OK) result = nebel_set_gl_renderer_lighting(painter->renderer, lighting);
    nebel_release_lighting(lighting);
    nebel_release_snapshot(volumes);
    return result;
}

/* Cells are all fog there is. */
static nebel_result clear_fog(const nb_gl_offscreen *painter)
{
    const nebel_result result = nebel_set_gl_renderer_lighting(painter->renderer, NULL);
    return result == NEBEL_OK ? nebel_set_gl_renderer_particles(painter->renderer, NULL, 0) : result;
}

nebel_result nb_gl_painter_draw(nb_gl_offscreen *painter, double frame, const nebel_gl_frame_desc *desc,
                                const nebel_gl_planes *planes)
{
    const int by_cells = desc->method == NEBEL_GL_METHOD_CELLS || desc->method == NEBEL_GL_METHOD_CELLS_PIXEL;
    nebel_result result = by_cells ? clear_fog(painter) : set_fog(painter, frame);
    if (result == NEBEL_OK && painter->is_fixed) {
        const nb_gl_fixed_function by = {painter->renderer, painter->scene, painter->loaded->lighting, painter->log};
        return nb_gl_fixed_draw(&by, desc, planes);
    }
    if (result == NEBEL_OK) result = nebel_gl_render_frame(painter->renderer, desc);
    return result == NEBEL_OK ? nebel_gl_read_planes(painter->renderer, planes) : result;
}

void nb_gl_painter_close(nb_gl_offscreen *painter)
{
    if (painter->renderer == NULL) return;
    nebel_destroy_gl_renderer(painter->renderer);
    nb_gl_context_close(&painter->context);
    painter->renderer = NULL;
}
