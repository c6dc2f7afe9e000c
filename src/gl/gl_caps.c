#include "gl_caps.h"

#include <epoxy/gl.h>
#include <string.h>

enum { OLDEST = 33, OLDEST_ES = 30 };

int nb_context_has(const char *extension)
{
    return epoxy_has_gl_extension(extension) ? 1 : 0;
}

/* Mesa's llvmpipe ends all loops of a shader together after 65,535 turns, without a word. Neighbouring pixels run along
 * with each other, so that each turn of an outer loop lasts as long as the longest of theirs: that takes a half. The
 * rest of a ray that was cut takes half as many turns as the walk.
 */
static int read_most_turns(void)
{
    const char *const renderer = (const char *)glGetString(GL_RENDERER);
    return renderer != NULL && strstr(renderer, "llvmpipe") != NULL ? 24000 : 0;
}

/* Extensions give OpenGL ES what OpenGL has always had by now. */
static void read_features(nb_context *c)
{
    const int desktop = !c->es;
    c->switches_by_buffer = desktop || c->version >= 32 || nb_context_has("GL_EXT_draw_buffers_indexed") ||
                            nb_context_has("GL_OES_draw_buffers_indexed");
    c->blending_by_buffer = desktop ? c->version >= 40 : c->switches_by_buffer;
    c->viewport_arrays = desktop && c->version >= 41;
    c->pauses_feedback = !desktop || c->version >= 40 || nb_context_has("GL_ARB_transform_feedback2");
    c->sample_mask = c->tells_sizes = desktop || c->version >= 31;
    c->dual_source = desktop ? 1 : nb_context_has("GL_EXT_blend_func_extended") ? 2 : 0;
    c->depth_bounds = nb_context_has("GL_EXT_depth_bounds_test");
}

int nb_context_integer(unsigned name)
{
    GLint value = 0;
    glGetIntegerv(name, &value);
    return value;
}

nebel_result nb_context_read(const nebel_log *log, nb_context *context)
{
    const int version = epoxy_gl_version();
    if (version == 0) {
        return nb_fail(log, NEBEL_ERROR_UNSUPPORTED,
                       "OpenGL: no context is current in this thread; make one current before nebel_create_gl");
    }
    *context = (nb_context){.es = !epoxy_is_desktop_gl(), .version = version};
    if (version < (context->es ? OLDEST_ES : OLDEST)) {
        return nb_fail(
            log, NEBEL_ERROR_UNSUPPORTED,
            "OpenGL: the context is %s %d.%d, needed is OpenGL 3.3 or OpenGL ES 3.0; ask for one when creating "
            "the context, or update the driver",
            context->es ? "OpenGL ES" : "OpenGL", version / 10, version % 10);
    }
    read_features(context);
    context->most_turns = read_most_turns();
    context->widest = (uint32_t)nb_context_integer(GL_MAX_TEXTURE_SIZE);
    if (!context->es || nb_context_has("GL_EXT_clip_cull_distance"))
        context->clip_distances = nb_context_integer(GL_MAX_CLIP_DISTANCES);
    if (context->clip_distances > 32) context->clip_distances = 32;
    context->viewports = context->viewport_arrays ? (uint32_t)nb_context_integer(GL_MAX_VIEWPORTS) : 1;
    if (context->viewports > 32) context->viewports = 32;
    return NEBEL_OK;
}

nebel_result nb_context_check(const nebel_log *log, unsigned vertex_array)
{
    if (epoxy_gl_version() != 0 && glIsVertexArray(vertex_array)) return NEBEL_OK;
    return nb_fail(log, NEBEL_ERROR_UNSUPPORTED,
                   "OpenGL: the context of this nebel_gl is not current, or was lost; make it current, or destroy the "
                   "nebel_gl and "
                   "create another in the new context");
}

nebel_result nb_context_check_memory(const nebel_log *log, const char *what)
{
    if (glGetError() != GL_OUT_OF_MEMORY) return NEBEL_OK;
    return nb_fail(log, NEBEL_ERROR_MEMORY, "OpenGL: no memory for %s", what);
}
