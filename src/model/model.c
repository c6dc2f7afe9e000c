#include "model.h"

#include <stdio.h>
#include <string.h>

#define MEGABYTE 1048576.0

nebel_result nb_model_fail(const nb_model_load *load, nebel_result result, const char *format, ...)
{
    char message[768];
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(message, sizeof message, format, arguments);
    va_end(arguments);
    if (load->source->where == NULL) return nb_fail(&load->log, result, "%s", message);
    return nb_fail(&load->log, result, "%s: %s", load->source->where, message);
}

void nb_model_note(const nb_model_load *load, const char *format, ...)
{
    char message[768];
    const char *where = load->source->where;
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(message, sizeof message, format, arguments);
    va_end(arguments);
    nb_log_message(&load->log, NEBEL_LOG_INFO, NEBEL_OK, "%s%s%s", where != NULL ? where : "",
                   where != NULL ? ": " : "", message);
}

static void keep_note(nebel_log_level level, nebel_result result, const char *message, void *user)
{
    nb_note *note = user;
    (void)level, (void)result;
    snprintf(note->text, sizeof note->text, "%s", message);
}

nebel_log nb_note_log(nb_note *note)
{
    return (nebel_log){keep_note, note};
}

nb_affine nb_model_place(const nb_model_source *model)
{
    nb_affine own = {0};
    nebel_transform transform;
    for (int j = 0; j < 3; j++) {
        double axis[3] = {0};
        axis[j] = 1;
        nb_file_units_convert_place(&model->space, axis);
        for (int i = 0; i < 3; i++) own.m[i][j] = axis[i];
    }
    memcpy(transform.position, model->position, sizeof transform.position);
    memcpy(transform.rotation, model->rotation, sizeof transform.rotation);
    memcpy(transform.scale, model->scale, sizeof transform.scale);
    const nb_affine placed = nb_affine_from_transform(&transform);
    return nb_affine_compose(&placed, &own);
}

/* ---- meshes ---------------------------------------------------------------------------------- */

bool nb_mesh_allocate_vertices(const nebel_allocator *allocator, uint32_t count, bool has_uvs, nebel_mesh *mesh)
{
    mesh->vertex_count = count;
    mesh->positions = nb_allocate(allocator, count, 3 * sizeof(float));
    mesh->normals = nb_allocate(allocator, count, 3 * sizeof(float));
    mesh->uvs = has_uvs ? nb_allocate(allocator, count, 2 * sizeof(float)) : NULL;
    return mesh->positions != NULL && mesh->normals != NULL && (!has_uvs || mesh->uvs != NULL);
}

void nb_mesh_release(const nebel_allocator *allocator, nebel_mesh *mesh)
{
    nb_release(allocator, (void *)mesh->positions);
    nb_release(allocator, (void *)mesh->normals);
    nb_release(allocator, (void *)mesh->uvs);
    nb_release(allocator, (void *)mesh->indices);
    *mesh = (nebel_mesh){0};
}

nebel_result nb_model_refuse_triangles(const nb_model_load *load)
{
    return nb_model_fail(load, NEBEL_ERROR_LIMIT, "the models have more than %llu triangles together",
                         (unsigned long long)NB_MAX_TRIANGLES);
}

double nb_mesh_bytes(uint64_t vertices, bool has_uvs, uint64_t triangles)
{
    return (double)vertices * (has_uvs ? 32 : 24) + (double)triangles * NB_TRIANGLE_BYTES;
}

nebel_result nb_model_check_room(const nb_model_load *load, double bytes)
{
    if (load->most_bytes == 0 || load->set->bytes + bytes <= load->most_bytes) return NEBEL_OK;
    return nb_model_fail(load, NEBEL_ERROR_LIMIT,
                         "the model \"%s\" brings the scene to %.0f MB of memory; %.0f MB is the most it may take "
                         "(nebel: --memory)",
                         load->source->file, (load->set->bytes + bytes) / MEGABYTE, load->most_bytes / MEGABYTE);
}

uint64_t nb_model_room(const nb_model_load *load)
{
    if (load->most_bytes == 0 || load->set == NULL) return 0;
    const double left = load->most_bytes - load->set->bytes;
    return left > 1 ? (uint64_t)left : 1;
}

nebel_result nb_model_add_mesh(const nb_model_load *load, nebel_mesh *mesh)
{
    nb_model_set *set = load->set;
    void *meshes = set->meshes;
    const double bytes = nb_mesh_bytes(mesh->vertex_count, mesh->uvs != NULL, mesh->triangle_count);
    nebel_result result = nb_model_check_room(load, bytes);
    if (result != NEBEL_OK) {
        nb_mesh_release(&load->allocator, mesh);
        return result;
    }
    if (set->triangle_count + mesh->triangle_count > NB_MAX_TRIANGLES)
        result = nb_model_refuse_triangles(load);
    else if (load->sink != NULL)
        load->sink->mesh(load->sink->user, mesh);
    else if (!nb_grow(&load->allocator, &meshes, sizeof *mesh, set->mesh_count, &set->mesh_capacity,
                      set->mesh_count + 1))
        result = nb_model_fail(load, NEBEL_ERROR_MEMORY, "out of memory");
    if (result == NEBEL_OK) set->triangle_count += mesh->triangle_count;
    if (result == NEBEL_OK) set->bytes += bytes;
    if (result != NEBEL_OK || load->sink != NULL) {
        nb_mesh_release(&load->allocator, mesh);
        return result;
    }
    set->meshes = meshes;
    set->meshes[set->mesh_count++] = *mesh;
    return NEBEL_OK;
}

static double texel_bytes(const nebel_texture *texture)
{
    return 4.0 * texture->width * texture->height;
}

/* Its room has been checked before it was read. */
nebel_result nb_model_add_texture(const nb_model_load *load, const nebel_texture *texture, int32_t *index)
{
    nb_model_set *set = load->set;
    void *textures = set->textures;
    const size_t count = set->texture_count;
    set->bytes += texel_bytes(texture);
    if (load->sink != NULL && count < INT32_MAX) {
        load->sink->texture(load->sink->user, texture);
        nb_release(&load->allocator, (void *)texture->rgba);
        *index = (int32_t)set->texture_count++;
        return NEBEL_OK;
    }
    if (count >= INT32_MAX ||
        !nb_grow(&load->allocator, &textures, sizeof *texture, count, &set->texture_capacity, count + 1)) {
        nb_release(&load->allocator, (void *)texture->rgba);
        return nb_model_fail(load, NEBEL_ERROR_MEMORY, "out of memory");
    }
    set->textures = textures;
    set->textures[count] = *texture;
    set->texture_count++;
    *index = (int32_t)count;
    return NEBEL_OK;
}
