/* A reader of models that is not as it should be, in the way that the name of the model says: for test_model_reader. */
#define _GNU_SOURCE
#include "model/model_wire.h"

#include <nebel/nebel.h>

#include <math.h>
#include <signal.h>
#include <string.h>
#include <unistd.h>

static char asked[sizeof(nb_wire_request) + NB_WIRE_MAX_REQUEST];

static void put(const void *bytes, size_t size)
{
    if (write(STDOUT_FILENO, bytes, size) != (ssize_t)size) _exit(1);
}

static void put_frame(uint32_t type, int32_t code, const void *bytes, size_t size)
{
    const nb_wire_frame frame = {type, code, size};
    put(&frame, sizeof frame);
    put(bytes, size);
}

/* A triangle with one thing changed. */
static void put_triangle(nb_wire_mesh head, const float *positions, const float *normals, const uint32_t *indices)
{
    char bytes[sizeof head + 18 * sizeof(float) + 3 * sizeof(uint32_t)];
    memcpy(bytes, &head, sizeof head);
    memcpy(bytes + sizeof head, positions, 9 * sizeof(float));
    memcpy(bytes + sizeof head + 9 * sizeof(float), normals, 9 * sizeof(float));
    memcpy(bytes + sizeof head + 18 * sizeof(float), indices, 3 * sizeof(uint32_t));
    put_frame(NB_WIRE_MESH, 0, bytes, sizeof bytes);
}

static void put_odd_mesh(const char *mode)
{
    nb_wire_mesh head = {.vertex_count = 3, .triangle_count = 1, .texture = -1, .mask = -1, .base_color = {1, 1, 1}};
    float positions[9] = {0, 0, 0, 1, 0, 0, 0, 1, 0}, normals[9] = {0, 0, 1, 0, 0, 1, 0, 0, 1};
    uint32_t indices[3] = {0, 1, 2};
    if (strcmp(mode, "index") == 0) indices[2] = 3;
    if (strcmp(mode, "place") == 0) positions[4] = NAN;
    if (strcmp(mode, "normal") == 0) normals[2] = 2;
    if (strcmp(mode, "texture") == 0) head.texture = 0;
    if (strcmp(mode, "color") == 0) head.base_color[1] = 1.5f;
    if (strcmp(mode, "cutoff") == 0) head.alpha_cutoff = .5f;
    if (strcmp(mode, "size") == 0) head.vertex_count = 4;
    if (strcmp(mode, "none") == 0) head.triangle_count = 0;
    put_triangle(head, positions, normals, indices);
}

static void put_end(nebel_result result, uint64_t meshes)
{
    const nb_wire_end end = {.meshes = meshes};
    put_frame(NB_WIRE_END, (int32_t)result, &end, sizeof end);
}

/* More than any budget, announced or sent. */
static void put_too_much(const char *mode)
{
    const nb_wire_mesh head = {.vertex_count = UINT32_MAX, .triangle_count = 1 << 28, .texture = -1, .mask = -1};
    const nb_wire_texture flat = {1 << 14, 1 << 14};
    const uint64_t size =
        6 * sizeof(float) * (uint64_t)head.vertex_count + 3 * sizeof(uint32_t) * (uint64_t)head.triangle_count;
    if (strcmp(mode, "vast") == 0) {
        put(&(nb_wire_frame){NB_WIRE_MESH, 0, sizeof head + size}, sizeof(nb_wire_frame));
        put(&head, sizeof head);
    } else {
        put(&(nb_wire_frame){NB_WIRE_TEXTURE, 0, sizeof flat + ((uint64_t)4 << 28)}, sizeof(nb_wire_frame));
        put(&flat, sizeof flat);
    }
    (void)pause();
}

static void put_messages(void)
{
    for (;;) put_frame(NB_WIRE_MESSAGE, NEBEL_OK, "a", 1);
}

/* Sanitizers catch some signals. */
static void die_by(int number)
{
    signal(number, SIG_DFL);
    raise(number);
}

/* The name of the model says what to do. */
int main(void)
{
    size_t size = 0;
    for (ssize_t count; (count = read(STDIN_FILENO, asked + size, sizeof asked - size)) > 0;) size += (size_t)count;
    const char *const file = asked + sizeof(nb_wire_request), *const mode = strrchr(file, '/') + 1;
    if (strcmp(mode, "nothing") == 0) return 0;
    if (strcmp(mode, "garbage") == 0) put(asked, 600);
    put_frame(NB_WIRE_HELLO, NB_WIRE_VERSION + (strcmp(mode, "version") == 0), NULL, 0);
    if (strcmp(mode, "hello") == 0) return 0;
    if (strcmp(mode, "crash") == 0) die_by(SIGSEGV);
    if (strcmp(mode, "abort") == 0) die_by(SIGABRT);
    if (strcmp(mode, "division") == 0) die_by(SIGFPE);
    if (strcmp(mode, "instruction") == 0) die_by(SIGILL);
    if (strcmp(mode, "closes") == 0) close(STDOUT_FILENO), (void)pause();
    if (strcmp(mode, "chatter") == 0) put_messages();
    if (strcmp(mode, "escape") == 0)
        put_frame(NB_WIRE_MESSAGE, NEBEL_ERROR_FORMAT, "\033[2J", 4), put_end(NEBEL_ERROR_FORMAT, 0);
    if (strcmp(mode, "vast") == 0 || strcmp(mode, "vast texture") == 0) put_too_much(mode);
    if (strcmp(mode, "points") == 0) put_frame(NB_WIRE_PLACES, 0, asked, 24);
    put_odd_mesh(mode);
    if (strcmp(mode, "no end") == 0) return 0;
    put_end(NEBEL_OK, strcmp(mode, "lost") == 0 ? 2 : 1);
    if (strcmp(mode, "lingers") == 0) (void)pause();
    return 0;
}
