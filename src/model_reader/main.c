#define _POSIX_C_SOURCE 200809L
/* nebel-read-model: reads one model for a program that uses nebel_scene, and hands its meshes back. What reads models
 * trusts its input, and may crash, hang or swell; here it does so alone. Not to be called by hand. */
#include "model/model.h"
#include "model/model_wire.h"
#include "confine.h"
#include "gltf_unpack.h"

#include <assimp/cimport.h>

#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

/* Points in one frame. */
enum { POINTS_TOGETHER = 1 << 16 };

/* Complaints of Assimp that are kept. */
enum { MAX_HEARD = 3, HEARD_SIZE = 200 };

typedef struct answer {
    nb_budget budget;
    nb_wire_end counts;
    unsigned messages;
    char heard[MAX_HEARD][HEARD_SIZE];
    unsigned heard_count;
} answer;

/* ---- writing --------------------------------------------------------------------------------- */

/* Where nobody listens any more there is nothing left to do. */
static void write_all(const void *bytes, size_t size)
{
    const char *at = bytes;
    while (size > 0) {
        const ssize_t count = write(STDOUT_FILENO, at, size);
        if (count < 0 && errno == EINTR) continue;
        if (count <= 0) _exit(EXIT_FAILURE);
        at += count;
        size -= (size_t)count;
    }
}

/* What waits to be written: each write may wake the program that reads. */
static char waiting[1 << 16];
static size_t waiting_size;

static void flush(void)
{
    write_all(waiting, waiting_size);
    waiting_size = 0;
}

static void put(const void *bytes, size_t size)
{
    if (size > sizeof waiting - waiting_size) flush();
    if (size > sizeof waiting) {
        write_all(bytes, size);
    } else if (size > 0) {
        memcpy(waiting + waiting_size, bytes, size);
        waiting_size += size;
    }
}

static void put_frame(nb_wire_type type, int32_t code, uint64_t size)
{
    const nb_wire_frame frame = {(uint32_t)type, code, size};
    put(&frame, sizeof frame);
}

static void put_message(nebel_log_level level, nebel_result result, const char *message, void *user)
{
    answer *out = user;
    const size_t size = strlen(message);
    (void)level; /* errors have a result, and all else is a note */
    if (out->messages++ >= NB_WIRE_MAX_MESSAGES) return;
    put_frame(NB_WIRE_MESSAGE, (int32_t)result, size);
    put(message, size);
}

static void put_texture(void *user, const nebel_texture *texture)
{
    answer *out = user;
    const nb_wire_texture head = {texture->width, texture->height};
    const size_t size = 4 * (size_t)texture->width * texture->height;
    put_frame(NB_WIRE_TEXTURE, 0, sizeof head + size);
    put(&head, sizeof head);
    put(texture->rgba, size);
    out->counts.textures++;
}

static void put_mesh(void *user, const nebel_mesh *mesh)
{
    answer *out = user;
    const nb_wire_mesh head = {.vertex_count = mesh->vertex_count,
                               .triangle_count = mesh->triangle_count,
                               .has_uvs = mesh->uvs != NULL,
                               .texture = mesh->texture,
                               .mask = mesh->mask,
                               .base_color = {mesh->base_color[0], mesh->base_color[1], mesh->base_color[2]},
                               .alpha_cutoff = mesh->alpha_cutoff};
    const size_t triple = 3 * sizeof(float) * (size_t)mesh->vertex_count,
                 pair = mesh->uvs != NULL ? 2 * sizeof(float) * (size_t)mesh->vertex_count : 0,
                 corners = 3 * sizeof(uint32_t) * (size_t)mesh->triangle_count;
    put_frame(NB_WIRE_MESH, 0, sizeof head + 2 * triple + pair + corners);
    put(&head, sizeof head);
    put(mesh->positions, triple);
    put(mesh->normals, triple);
    put(mesh->uvs, pair);
    put(mesh->indices, corners);
    out->counts.meshes++;
}

static void put_points(answer *out, const nb_point_set *points)
{
    for (size_t i = 0; i < points->count; i += POINTS_TOGETHER) {
        const size_t left = points->count - i, count = left < POINTS_TOGETHER ? left : POINTS_TOGETHER;
        put_frame(NB_WIRE_PLACES, 0, count * sizeof *points->places);
        put(points->places[i], count * sizeof *points->places);
    }
    out->counts.points = points->count;
}

/* A file that is read allows more memory and time: here, and in the program that waits. */
static void note_file(void *user, const char *path, const struct stat *status)
{
    answer *out = user;
    const size_t size = strlen(path), before = out->budget.file_count;
    nb_budget_add(&out->budget, status);
    if (out->budget.file_count == before) return;
    nb_confine_budget(&out->budget);
    if (size >= NB_WIRE_MAX_PATH) return;
    put_frame(NB_WIRE_FILE, 0, size);
    put(path, size);
    flush(); /* more time is given from now on */
}

/* ---- what Assimp says ------------------------------------------------------------------------ */

/* What else a file has is left out anyway. */
static bool concerns_meshes(const char *text)
{
    static const char *const others[] = {"material",  "track", "normal layer",      "tangent",
                                         "one index", "chunk", "No object detected"};
    for (size_t i = 0; i < sizeof others / sizeof *others; i++)
        if (strstr(text, others[i]) != NULL) return false;
    return true;
}

/* Some of its readers put something of their own in place of what is wrong, and tell nobody but their log. */
static void hear(const char *message, char *user)
{
    static const char error[] = "Error,";
    answer *out = (answer *)(void *)user;
    const char *text = strncmp(message, error, sizeof error - 1) == 0 ? strstr(message, ": ") : NULL;
    if (text == NULL || out->heard_count == MAX_HEARD || !concerns_meshes(text)) return;
    char *kept = out->heard[out->heard_count];
    snprintf(kept, HEARD_SIZE, "%s", text + 2);
    kept[strcspn(kept, "\n")] = '\0';
    for (unsigned i = 0; i < out->heard_count; i++)
        if (strcmp(out->heard[i], kept) == 0) return;
    out->heard_count++;
}

static void tell_heard(answer *out, const char *file)
{
    char note[HEARD_SIZE + 600];
    for (unsigned i = 0; i < out->heard_count; i++) {
        snprintf(note, sizeof note, "\"%.500s\" may not be as it was meant: %s", file, out->heard[i]);
        put_message(NEBEL_LOG_INFO, NEBEL_OK, note, out);
    }
}

/* ---- the request ----------------------------------------------------------------------------- */

typedef struct wanted {
    nb_wire_request request;
    char texts[NB_WIRE_MAX_REQUEST];
    const char *file, *folder, *name;
} wanted;

static bool get(void *bytes, size_t size)
{
    char *at = bytes;
    while (size > 0) {
        const ssize_t count = read(STDIN_FILENO, at, size);
        if (count < 0 && errno == EINTR) continue;
        if (count <= 0) return false;
        at += count;
        size -= (size_t)count;
    }
    return true;
}

static const char *take_text(const char **at, uint32_t size)
{
    const char *text = *at;
    *at += size;
    return size > 0 && text[size - 1] == '\0' ? text : NULL;
}

static bool get_request(wanted *in)
{
    const nb_wire_request *request = &in->request;
    const char *at = in->texts;
    if (!get(&in->request, sizeof in->request) || memcmp(request->magic, NB_WIRE_MAGIC, sizeof request->magic) != 0 ||
        request->version != NB_WIRE_VERSION)
        return false;
    const uint64_t size = (uint64_t)request->file_size + request->folder_size + request->name_size;
    if (size > sizeof in->texts || !get(in->texts, (size_t)size)) return false;
    in->file = take_text(&at, request->file_size);
    in->folder = take_text(&at, request->folder_size);
    in->name = take_text(&at, request->name_size);
    return in->file != NULL && in->folder != NULL && in->name != NULL;
}

static nb_model_source describe(const wanted *in)
{
    const nb_wire_request *request = &in->request;
    nb_model_source source = {.file = in->file,
                              .has_fog = (request->flags & NB_WIRE_HAS_FOG) != 0,
                              .space = {(request->flags & NB_WIRE_Z_UP) != 0, request->unit},
                              .has_color = (request->flags & NB_WIRE_HAS_COLOR) != 0};
    memcpy(source.position, request->position, sizeof source.position);
    memcpy(source.rotation, request->rotation, sizeof source.rotation);
    memcpy(source.scale, request->scale, sizeof source.scale);
    memcpy(source.color, request->color, sizeof source.color);
    return source;
}

static nebel_result read_model(const wanted *in, answer *out)
{
    const nb_model_sink sink = {put_mesh, put_texture, out};
    const nb_model_source source = describe(in);
    const bool takes_points = (in->request.flags & NB_WIRE_POINTS) != 0;
    nb_model_set set = {.triangle_count = in->request.triangles,
                        .texture_count = (size_t)in->request.textures,
                        .bytes = in->request.bytes};
    nb_point_set points = {.limit = (size_t)in->request.max_points};
    const nb_model_load load = {.allocator = nb_resolve_allocator(&(nebel_allocator){NULL, NULL, NULL}),
                                .log = {put_message, out},
                                .source = &source,
                                .set = takes_points ? NULL : &set,
                                .points = takes_points ? &points : NULL,
                                .most_bytes = in->request.most_bytes,
                                .sink = &sink,
                                .folder = in->folder,
                                .name = in->name,
                                .opened = note_file,
                                .opened_user = out,
                                .unpack = nb_unpack_meshopt()};
    const struct aiLogStream log = {hear, (char *)out};
    aiAttachLogStream(&log);
    const nebel_result result = nb_assimp_load(&load);
    if (result == NEBEL_OK) tell_heard(out, in->file);
    if (result == NEBEL_OK && takes_points) put_points(out, &points);
    return result;
}

int main(int count, char **words)
{
    static wanted in;
    static answer out;
    if (count != 3) {
        (void)fputs("nebel-read-model reads models for programs that use nebel; they start it themselves.\n", stderr);
        return 2;
    }
    if (!nb_confine_to_parent(strtol(words[2], NULL, 10))) return EXIT_FAILURE;
    put_frame(NB_WIRE_HELLO, NB_WIRE_VERSION, 0);
    flush();
    if (!get_request(&in)) return EXIT_FAILURE;
    out.budget.most_memory = (uint64_t)in.request.most_bytes;
    nb_confine_resources();
    nb_confine_budget(&out.budget);
    nb_confine_files(in.file, in.folder);
    nb_confine_calls();
    const nebel_result result = read_model(&in, &out);
    put_frame(NB_WIRE_END, (int32_t)result, sizeof out.counts);
    put(&out.counts, sizeof out.counts);
    flush();
    _exit(EXIT_SUCCESS); /* the system gives back faster what is left */
}
