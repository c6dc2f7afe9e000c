#include "gl_painter.h"

int nb_gl_painter_open(nb_gl_painter *painter, const char *name, const nb_load_result *loaded,
                       nb_report_listener *listener)
{
    const nebel_gl_renderer_desc desc = {.log = nb_report_log(listener)};
    *painter = (nb_gl_painter){.renderer = NULL};
    if (nebel_scene_contents(loaded->scene)->particle_count > 0) {
        return nb_report_failure(
            "render: --device gl: %s has a nebula, which OpenGL does not draw in this version; say "
            "--device cpu",
            name);
    }
    if (nb_gl_context_open(&painter->context, NB_GL_API_DESKTOP) != 0 &&
        nb_gl_context_open(&painter->context, NB_GL_API_ES) != 0) {
        return nb_report_failure("render: --device gl: %s; or say --device cpu", painter->context.fault);
    }
    const nebel_result result =
        nebel_create_gl_renderer(nebel_scene_contents(loaded->scene), loaded->fog, &desc, &painter->renderer);
    if (result == NEBEL_OK) return NB_DONE;
    nb_gl_context_close(&painter->context);
    return nb_report_result(listener, name, result);
}

nebel_result nb_gl_painter_draw(nb_gl_painter *painter, nebel_snapshot *fog, const nebel_gl_frame_desc *desc,
                                const nebel_gl_planes *planes)
{
    nebel_result result = nebel_set_gl_renderer_fog(painter->renderer, fog);
    if (result == NEBEL_OK) result = nebel_gl_render_frame(painter->renderer, desc);
    return result == NEBEL_OK ? nebel_gl_read_planes(painter->renderer, planes) : result;
}

void nb_gl_painter_close(nb_gl_painter *painter)
{
    if (painter->renderer == NULL) return;
    nebel_destroy_gl_renderer(painter->renderer);
    nb_gl_context_close(&painter->context);
    painter->renderer = NULL;
}
