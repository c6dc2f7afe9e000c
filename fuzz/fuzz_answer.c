/* Any bytes as the answer of nebel-read-model: meshes that are what the header promises, or a refusal, and every byte of
 * memory back. */
#define _GNU_SOURCE
#include "model/model_receive.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <unistd.h>

static void drop_message(nebel_log_level level, nebel_result result, const char *message, void *user)
{
    (void)level, (void)result, (void)user;
    for (; *message != '\0'; message++)
        if ((unsigned char)*message < 0x20 || *message == 0x7F) abort();
}

static void *allocate(size_t size, void *user)
{
    size_t *allocations = user;
    void *memory = size < (size_t)1 << 24 ? malloc(size) : NULL;
    *allocations += memory != NULL;
    return memory;
}

static void release(void *memory, void *user)
{
    size_t *allocations = user;
    --*allocations;
    free(memory);
}

static void check_mesh(const nb_model_set *set, const nebel_mesh *mesh)
{
    for (size_t i = 0; i < 3 * (size_t)mesh->triangle_count; i++)
        if (mesh->indices[i] >= mesh->vertex_count) abort();
    for (size_t i = 0; i < 3 * (size_t)mesh->vertex_count; i++)
        if (!isfinite(mesh->positions[i]) || !isfinite(mesh->normals[i])) abort();
    if (mesh->texture >= (int32_t)set->texture_count || mesh->mask >= (int32_t)set->texture_count) abort();
}

static void check_set(const nebel_allocator *allocator, nb_model_set *set)
{
    for (size_t i = 0; i < set->mesh_count; i++) {
        check_mesh(set, &set->meshes[i]);
        nb_mesh_release(allocator, &set->meshes[i]);
    }
    for (size_t i = 0; i < set->texture_count; i++) nb_release(allocator, (void *)set->textures[i].rgba);
    nb_release(allocator, set->meshes);
    nb_release(allocator, set->textures);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    static nb_budget budget;
    size_t allocations = 0;
    nb_model_set set = {0};
    nb_point_set points = {.limit = 1000};
    const nb_model_source source = {.file = "fuzz.obj"};
    if (size == 0) return 0;
    const bool takes_points = (data[0] & 1) != 0;
    const nb_model_load load = {.allocator = {allocate, release, &allocations},
                                .log = {drop_message, NULL},
                                .source = &source,
                                .set = takes_points ? NULL : &set,
                                .points = takes_points ? &points : NULL};
    const int file = memfd_create("answer", MFD_CLOEXEC);
    if (file < 0 || write(file, data + 1, size - 1) != (ssize_t)(size - 1)) abort();
    lseek(file, 0, SEEK_SET);
    memset(&budget, 0, sizeof budget);
    nb_receiver receiver = {.load = &load, .file = file, .budget = &budget};
    (void)nb_model_receive(&receiver);
    close(file);
    check_set(&load.allocator, &set);
    nb_release(&load.allocator, points.places);
    if (allocations != 0) abort();
    return 0;
}
