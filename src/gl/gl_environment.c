#include "gl_environment.h"

#include "texel_texture.h"

#include <epoxy/gl.h>
#include <string.h>

static nebel_result fill_environment(nb_environment *e, const nebel_allocator *allocator, const nebel_log *log,
                                     const nb_context *context, const nebel_lighting *lighting, int surfaces)
{
    size_t count = 0;
    nebel_result result = nebel_pack_environment(lighting, surfaces, NULL, 0, &count);
    if (result != NEBEL_OK) return result;
    const size_t rows = (count + NEBEL_TEXTURE_WIDTH - 1) / NEBEL_TEXTURE_WIDTH;
    nebel_texel_f32 *const words = nb_allocate_zero(allocator, rows * NEBEL_TEXTURE_WIDTH, sizeof *words);
    if (words == NULL) return nb_fail(log, NEBEL_ERROR_MEMORY, "OpenGL: out of memory for the environment");
    result = nebel_pack_environment(lighting, surfaces, words, count, &count);
    if (result == NEBEL_OK)
        result = nb_texel_texture_upload(&e->name, log, context, words, rows, "the texture of the environment",
                                         "; use a smaller picture, or fewer phase functions");
    nb_release(allocator, words);
    return result;
}

nebel_result nb_environment_set(nb_environment *e, const nebel_allocator *allocator, const nebel_log *log,
                                const nb_context *context, nebel_lighting *lighting, int surfaces)
{
    if (e->of != NULL && nebel_is_same_environment(e->of, lighting)) return NEBEL_OK;
    const nebel_result result = fill_environment(e, allocator, log, context, lighting, surfaces);
    nebel_release_lighting(e->of);
    e->of = result == NEBEL_OK ? nebel_retain_lighting(lighting) : NULL;
    return result;
}

nebel_result nb_environment_show(nb_environment *e, const nebel_allocator *allocator, const nebel_log *log,
                                 const nb_context *context, const nebel_environment *light)
{
    nebel_fog *fog = NULL;
    nebel_snapshot *empty = NULL;
    nebel_lighting *lighting = NULL;
    const nebel_lighting_desc desc = {.environment = *light};
    nebel_result result = nebel_create_fog(&(nebel_fog_desc){.host = {.allocator = *allocator, .log = *log}}, &fog);
    if (result == NEBEL_OK) result = nebel_commit_fog(fog, &empty);
    if (result == NEBEL_OK) result = nebel_create_lighting(empty, &desc, &lighting);
    if (result == NEBEL_OK) result = nb_environment_set(e, allocator, log, context, lighting, 1);
    nebel_release_lighting(lighting);
    nebel_release_snapshot(empty);
    nebel_destroy_fog(fog);
    return result;
}

void nb_environment_delete(const nb_environment *e)
{
    glDeleteTextures(1, &e->name);
}
