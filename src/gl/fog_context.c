#include "fog_context.h"

#include <epoxy/gl.h>

static nebel_result make_empty_fog(nebel_gl *gl)
{
    nebel_fog *fog = NULL;
    nebel_snapshot *snapshot = NULL;
    const nebel_fog_desc desc = {.host = {.allocator = gl->allocator, .log = gl->log}};
    nebel_result result = nebel_create_fog(&desc, &fog);
    if (result == NEBEL_OK) result = nebel_commit_fog(fog, &snapshot);
    if (result == NEBEL_OK) result = nebel_create_lighting(snapshot, NULL, &gl->empty);
    nebel_release_snapshot(snapshot);
    nebel_destroy_fog(fog);
    return result;
}

/* A vertex array exists once it was bound. */
static void make_fog_objects(nebel_gl *gl)
{
    GLint bound = 0;
    glGetIntegerv(GL_VERTEX_ARRAY_BINDING, &bound);
    glGenVertexArrays(1, &gl->vertex_array);
    glBindVertexArray(gl->vertex_array);
    glBindVertexArray((GLuint)bound);
    glGenSamplers(1, &gl->sampler);
    glSamplerParameteri(gl->sampler, GL_TEXTURE_MIN_FILTER, GL_NEAREST);
    glSamplerParameteri(gl->sampler, GL_TEXTURE_MAG_FILTER, GL_NEAREST);
}

nebel_result nebel_create_gl(const nebel_gl_desc *desc, nebel_gl **gl)
{
    if (gl == NULL) return NEBEL_ERROR_ARGUMENT;
    *gl = NULL;
    if (desc == NULL) return NEBEL_ERROR_ARGUMENT;
    const nebel_log *const log = &desc->host.log;
    if (!nb_allocator_is_valid(&desc->host.allocator)) {
        return nb_fail(log, NEBEL_ERROR_ARGUMENT, "nebel_create_gl: the allocator needs both functions or neither");
    }
    if ((unsigned)desc->storage > NEBEL_GL_STORAGE_TEXTURE) {
        return nb_fail(log, NEBEL_ERROR_ARGUMENT, "nebel_create_gl: there is no storage %d", (int)desc->storage);
    }
    nb_context context;
    nebel_result result = nb_context_read(log, &context);
    if (result != NEBEL_OK) return result;
    const nebel_allocator allocator = nb_resolve_allocator(&desc->host.allocator);
    nebel_gl *const made = nb_allocate_zero(&allocator, 1, sizeof *made);
    if (made == NULL) return nb_fail(log, NEBEL_ERROR_MEMORY, "nebel_create_gl: out of memory");
    made->allocator = allocator;
    made->log = *log;
    made->storage = desc->storage;
    made->context = context;
    result = make_empty_fog(made);
    if (result != NEBEL_OK) {
        nb_release(&allocator, made);
        return result;
    }
    make_fog_objects(made);
    *gl = made;
    return NEBEL_OK;
}

/* Names of 0 are skipped by OpenGL. */
static void delete_fog_objects(nebel_gl *gl)
{
    const GLuint textures[] = {gl->texture, gl->voxels, gl->nodes, gl->tiles};
    nb_programs_delete(&gl->programs);
    nb_fog_passes_delete(&gl->steps);
    glDeleteTextures(4, textures);
    glDeleteBuffers(1, &gl->block);
    nb_environment_delete(&gl->environment);
    glDeleteFramebuffers(1, &gl->framebuffer);
    glDeleteSamplers(1, &gl->sampler);
    glDeleteVertexArrays(1, &gl->vertex_array);
}

void nebel_destroy_gl(nebel_gl *gl)
{
    if (gl == NULL) return;
    const nebel_log silent = {0};
    if (nb_context_check(&silent, gl->vertex_array) == NEBEL_OK) delete_fog_objects(gl);
    nebel_release_lighting(gl->empty);
    nebel_release_lighting(gl->packed);
    nebel_release_lighting(gl->voxels_of);
    nebel_release_lighting(gl->nodes_of);
    nebel_release_lighting(gl->environment.of);
    nb_release(&gl->allocator, gl->programs.list);
    nb_release(&gl->allocator, gl->words);
    nb_release(&gl->allocator, gl->entries);
    const nebel_allocator allocator = gl->allocator;
    nb_release(&allocator, gl);
}

nebel_result nebel_gl_get_fog_resources(const nebel_gl *gl, nebel_gl_fog_resources *fog)
{
    if (gl == NULL || fog == NULL) return NEBEL_ERROR_ARGUMENT;
    if (!gl->has_fog)
        return nb_fail(&gl->log, NEBEL_ERROR_ARGUMENT, "nebel_gl_get_fog_resources: call nebel_gl_set_fog first");
    *fog = gl->fog;
    return NEBEL_OK;
}
