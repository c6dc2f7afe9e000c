#define _DEFAULT_SOURCE
#include "model_receive.h"

#include <errno.h>
#include <math.h>
#include <poll.h>
#include <string.h>
#include <sys/mman.h>
#include <time.h>
#include <unistd.h>

/* Paths and messages, which are short. */
enum { TEXT_SIZE = NB_WIRE_MAX_PATH };

/* ---- memory ---------------------------------------------------------------------------------- */

#if defined(MADV_HUGEPAGE)
/* Asks for large pages where an array holds several: otherwise every 4096 bytes are given by the system one by one, which
 * takes longer than reading them. A hint, whoever's allocator it was. */
static void hint_large(void *memory, size_t size)
{
    const uintptr_t page = (uintptr_t)1 << 21, begin = ((uintptr_t)memory + page - 1) & ~(page - 1);
    const uintptr_t end = ((uintptr_t)memory + size) & ~(page - 1);
    if (memory != NULL && size >= 2 * page && begin < end) (void)madvise((void *)begin, end - begin, MADV_HUGEPAGE);
}
#else
static void hint_large(void *memory, size_t size)
{
    (void)memory, (void)size;
}
#endif

/* ---- bytes ----------------------------------------------------------------------------------- */

/* Until there is something to read, or the time is over. */
static nb_receipt await(const nb_receiver *in)
{
    for (;;) {
        const double left = in->start + nb_budget_wall_seconds(in->budget) - nb_budget_now();
        struct pollfd wanted = {.fd = in->file, .events = POLLIN};
        if (!(left > 0)) return NB_RECEIPT_LATE;
        const int count = poll(&wanted, 1, left < 1e6 ? (int)(left * 1000) + 1 : 1000000);
        if (count > 0) return NB_RECEIPT_WHOLE;
        if (count < 0 && errno != EINTR) return NB_RECEIPT_CUT;
    }
}

static nb_receipt take_bytes(const nb_receiver *in, void *bytes, size_t size)
{
    unsigned char *at = bytes;
    while (size > 0) {
        const nb_receipt ready = await(in);
        if (ready != NB_RECEIPT_WHOLE) return ready;
        const ssize_t count = read(in->file, at, size);
        if (count == 0 || (count < 0 && errno != EINTR && errno != EAGAIN)) return NB_RECEIPT_CUT;
        if (count < 0) continue;
        at += count;
        size -= (size_t)count;
    }
    return NB_RECEIPT_WHOLE;
}

/* Of what is kept, before it is asked for. */
static bool fits(nb_receiver *in, uint64_t size)
{
    if (size > nb_budget_memory(in->budget) - in->taken) return false;
    in->taken += size;
    return true;
}

/* What reading may give. */
static bool is_result(int32_t code)
{
    static const nebel_result results[] = {NEBEL_OK,         NEBEL_ERROR_MEMORY, NEBEL_ERROR_LIMIT,
                                           NEBEL_ERROR_FILE, NEBEL_ERROR_FORMAT, NEBEL_ERROR_UNSUPPORTED};
    for (size_t i = 0; i < sizeof results / sizeof *results; i++)
        if (code == (int32_t)results[i]) return true;
    return false;
}

/* ---- texts ----------------------------------------------------------------------------------- */

/* What is no text becomes question marks: a terminal obeys some bytes. */
static nb_receipt take_text(const nb_receiver *in, const nb_wire_frame *frame, size_t limit, char text[TEXT_SIZE])
{
    if (frame->size >= limit || frame->size >= TEXT_SIZE) return NB_RECEIPT_BAD;
    const nb_receipt receipt = take_bytes(in, text, (size_t)frame->size);
    text[frame->size] = '\0';
    return receipt;
}

static nb_receipt take_message(nb_receiver *in, const nb_wire_frame *frame)
{
    char text[TEXT_SIZE];
    if (in->messages++ == NB_WIRE_MAX_MESSAGES || !is_result(frame->code)) return NB_RECEIPT_BAD;
    const nb_receipt receipt = take_text(in, frame, NB_WIRE_MAX_MESSAGE, text);
    if (receipt != NB_RECEIPT_WHOLE) return receipt;
    for (char *at = text; *at != '\0'; at++)
        if ((unsigned char)*at < 0x20 || *at == 0x7F) *at = '?';
    /* Memory there is limited, which is said in other words. */
    if (frame->code == NEBEL_OK)
        nb_model_note(in->load, "%s", text);
    else if (frame->code != NEBEL_ERROR_MEMORY)
        nb_model_fail(in->load, (nebel_result)frame->code, "%s", text);
    return NB_RECEIPT_WHOLE;
}

static nb_receipt take_path(const nb_receiver *in, const nb_wire_frame *frame)
{
    char path[TEXT_SIZE];
    struct stat status;
    const nb_receipt receipt = take_text(in, frame, TEXT_SIZE, path);
    if (receipt != NB_RECEIPT_WHOLE || stat(path, &status) != 0) return receipt;
    const size_t before = in->budget->file_count;
    nb_budget_add(in->budget, &status);
    if (in->budget->file_count > before && in->load->opened != NULL)
        in->load->opened(in->load->opened_user, path, &status);
    return receipt;
}

/* ---- textures -------------------------------------------------------------------------------- */

static nb_receipt take_texture(nb_receiver *in, const nb_wire_frame *frame)
{
    const nb_model_load *load = in->load;
    nb_wire_texture head;
    nebel_texture texture = {0};
    int32_t index;
    if (load->points != NULL || frame->size < sizeof head) return NB_RECEIPT_BAD;
    nb_receipt receipt = take_bytes(in, &head, sizeof head);
    if (receipt != NB_RECEIPT_WHOLE) return receipt;
    const uint64_t count = (uint64_t)head.width * head.height;
    if (count == 0 || count > NB_MAX_PIXELS || frame->size != sizeof head + 4 * count) return NB_RECEIPT_BAD;
    if (!fits(in, 4 * count)) return NB_RECEIPT_TOO_BIG;
    in->result = nb_model_check_room(load, 4 * (double)count);
    if (in->result != NEBEL_OK) return NB_RECEIPT_REFUSED;
    uint8_t *rgba = nb_allocate(&load->allocator, (size_t)count, 4);
    if (rgba == NULL) return NB_RECEIPT_MEMORY;
    texture = (nebel_texture){head.width, head.height, rgba};
    hint_large(rgba, 4 * (size_t)count);
    receipt = take_bytes(in, rgba, 4 * (size_t)count);
    if (receipt != NB_RECEIPT_WHOLE) {
        nb_release(&load->allocator, rgba);
        return receipt;
    }
    in->counts.textures++;
    return nb_model_add_texture(load, &texture, &index) == NEBEL_OK ? NB_RECEIPT_WHOLE : NB_RECEIPT_MEMORY;
}

/* ---- meshes ---------------------------------------------------------------------------------- */

/* A float is finite where its exponent is not the largest one. */
static bool are_finite(const float *values, size_t count)
{
    uint32_t bad = 0;
    for (size_t i = 0; i < count; i++) {
        uint32_t bits;
        memcpy(&bits, values + i, sizeof bits);
        bad |= (bits & 0x7f800000u) == 0x7f800000u;
    }
    return bad == 0;
}

static bool are_below(const uint32_t *indices, size_t count, uint32_t limit)
{
    uint32_t most = 0;
    for (size_t i = 0; i < count; i++) most = indices[i] > most ? indices[i] : most;
    return count == 0 || most < limit;
}

/* Vertices of no triangle may have a normal of 0. */
static bool are_units(const float *normals, size_t count)
{
    bool good = true;
    for (size_t i = 0; i < count; i++) {
        const float *n = normals + 3 * i;
        const float length = n[0] * n[0] + n[1] * n[1] + n[2] * n[2];
        good &= (length > 0.999f && length < 1.001f) || length == 0;
    }
    return good;
}

static bool is_texture(const nb_receiver *in, int32_t index)
{
    return index >= -1 && (index < 0 || (size_t)index < in->load->set->texture_count);
}

static bool check_received_head(const nb_receiver *in, const nb_wire_mesh *head)
{
    bool good = head->vertex_count > 0 && head->triangle_count > 0 && head->triangle_count <= NB_MAX_TRIANGLES &&
                head->has_uvs <= 1 && is_texture(in, head->texture) && is_texture(in, head->mask);
    for (int i = 0; i < 3; i++) good = good && head->base_color[i] >= 0 && head->base_color[i] <= 1;
    good = good && head->alpha_cutoff >= 0 && head->alpha_cutoff <= 1 && (head->mask < 0) == (head->alpha_cutoff == 0);
    return good && (head->has_uvs != 0) == (head->texture >= 0 || head->mask >= 0);
}

static bool check_received_mesh(const nebel_mesh *mesh)
{
    const size_t vertices = mesh->vertex_count;
    return are_finite(mesh->positions, 3 * vertices) && are_finite(mesh->normals, 3 * vertices) &&
           (mesh->uvs == NULL || are_finite(mesh->uvs, 2 * vertices)) && are_units(mesh->normals, vertices) &&
           are_below(mesh->indices, 3 * (size_t)mesh->triangle_count, mesh->vertex_count);
}

static nb_receipt take_arrays(const nb_receiver *in, nebel_mesh *mesh)
{
    const size_t vertices = mesh->vertex_count, corners = 3 * (size_t)mesh->triangle_count;
    hint_large((void *)mesh->positions, 3 * sizeof(float) * vertices);
    hint_large((void *)mesh->normals, 3 * sizeof(float) * vertices);
    if (mesh->uvs != NULL) hint_large((void *)mesh->uvs, 2 * sizeof(float) * vertices);
    hint_large((void *)mesh->indices, sizeof(uint32_t) * corners);
    nb_receipt receipt = take_bytes(in, (void *)mesh->positions, 3 * sizeof(float) * vertices);
    if (receipt == NB_RECEIPT_WHOLE) receipt = take_bytes(in, (void *)mesh->normals, 3 * sizeof(float) * vertices);
    if (receipt == NB_RECEIPT_WHOLE && mesh->uvs != NULL)
        receipt = take_bytes(in, (void *)mesh->uvs, 2 * sizeof(float) * vertices);
    if (receipt == NB_RECEIPT_WHOLE) receipt = take_bytes(in, (void *)mesh->indices, sizeof(uint32_t) * corners);
    return receipt == NB_RECEIPT_WHOLE && !check_received_mesh(mesh) ? NB_RECEIPT_BAD : receipt;
}

static nb_receipt take_received_mesh(nb_receiver *in, const nb_wire_frame *frame)
{
    const nb_model_load *load = in->load;
    const nebel_allocator *allocator = &load->allocator;
    nb_wire_mesh head;
    if (load->points != NULL || frame->size < sizeof head) return NB_RECEIPT_BAD;
    nb_receipt receipt = take_bytes(in, &head, sizeof head);
    if (receipt != NB_RECEIPT_WHOLE) return receipt;
    const uint64_t size = (head.has_uvs != 0 ? 8 : 6) * sizeof(float) * (uint64_t)head.vertex_count +
                          3 * sizeof(uint32_t) * (uint64_t)head.triangle_count;
    if (!check_received_head(in, &head) || frame->size != sizeof head + size) return NB_RECEIPT_BAD;
    if (!fits(in, size)) return NB_RECEIPT_TOO_BIG;
    in->result = nb_model_check_room(load, nb_mesh_bytes(head.vertex_count, head.has_uvs != 0, head.triangle_count));
    if (in->result != NEBEL_OK) return NB_RECEIPT_REFUSED;
    nebel_mesh mesh = {.triangle_count = head.triangle_count,
                       .texture = head.texture,
                       .mask = head.mask,
                       .alpha_cutoff = head.alpha_cutoff};
    memcpy(mesh.base_color, head.base_color, sizeof mesh.base_color);
    memcpy(mesh.origin, load->source->position, sizeof mesh.origin);
    mesh.indices = nb_allocate(allocator, mesh.triangle_count, 3 * sizeof *mesh.indices);
    const bool room =
        nb_mesh_allocate_vertices(allocator, head.vertex_count, head.has_uvs != 0, &mesh) && mesh.indices != NULL;
    receipt = room ? take_arrays(in, &mesh) : NB_RECEIPT_MEMORY;
    if (receipt != NB_RECEIPT_WHOLE) {
        nb_mesh_release(allocator, &mesh);
        return receipt;
    }
    in->counts.meshes++;
    const nebel_result result = nb_model_add_mesh(load, &mesh);
    if (result == NEBEL_ERROR_LIMIT) return NB_RECEIPT_BAD;
    return result == NEBEL_OK ? NB_RECEIPT_WHOLE : NB_RECEIPT_MEMORY;
}

/* ---- points ---------------------------------------------------------------------------------- */

static nb_receipt take_places(nb_receiver *in, const nb_wire_frame *frame)
{
    nb_point_set *points = in->load->points;
    if (points == NULL || frame->size == 0 || frame->size % sizeof *points->places != 0) return NB_RECEIPT_BAD;
    const uint64_t count = frame->size / sizeof *points->places;
    if (count > points->limit - points->count) return NB_RECEIPT_BAD;
    if (!fits(in, frame->size)) return NB_RECEIPT_TOO_BIG;
    void *places = points->places;
    const bool room = nb_grow(&in->load->allocator, &places, sizeof *points->places, points->count, &points->capacity,
                              points->count + (size_t)count);
    points->places = places;
    if (!room) return NB_RECEIPT_MEMORY;
    double(*fresh)[3] = points->places + points->count;
    const nb_receipt receipt = take_bytes(in, fresh, (size_t)frame->size);
    if (receipt != NB_RECEIPT_WHOLE) return receipt;
    for (size_t i = 0; i < count; i++)
        if (!isfinite(fresh[i][0]) || !isfinite(fresh[i][1]) || !isfinite(fresh[i][2])) return NB_RECEIPT_BAD;
    points->count += (size_t)count;
    in->counts.points += count;
    return NB_RECEIPT_WHOLE;
}

/* ---- the answer ------------------------------------------------------------------------------ */

static nb_receipt take_end(nb_receiver *in, const nb_wire_frame *frame)
{
    nb_wire_end end;
    if (frame->size != sizeof end || !is_result(frame->code)) return NB_RECEIPT_BAD;
    const nb_receipt receipt = take_bytes(in, &end, sizeof end);
    if (receipt != NB_RECEIPT_WHOLE) return receipt;
    in->result = (nebel_result)frame->code;
    return memcmp(&end, &in->counts, sizeof end) == 0 ? NB_RECEIPT_WHOLE : NB_RECEIPT_BAD;
}

static nb_receipt take_frame(nb_receiver *in, const nb_wire_frame *frame)
{
    switch (frame->type) {
    case NB_WIRE_FILE:
        return take_path(in, frame);
    case NB_WIRE_MESSAGE:
        return take_message(in, frame);
    case NB_WIRE_TEXTURE:
        return take_texture(in, frame);
    case NB_WIRE_MESH:
        return take_received_mesh(in, frame);
    case NB_WIRE_PLACES:
        return take_places(in, frame);
    case NB_WIRE_END:
        return take_end(in, frame);
    default:
        return NB_RECEIPT_BAD;
    }
}

nb_receipt nb_model_receive(nb_receiver *in)
{
    nb_wire_frame frame;
    in->start = nb_budget_now();
    nb_receipt receipt = take_bytes(in, &frame, sizeof frame);
    if (receipt == NB_RECEIPT_WHOLE && (frame.type != NB_WIRE_HELLO || frame.size != 0)) return NB_RECEIPT_BAD;
    if (receipt == NB_RECEIPT_WHOLE && frame.code != NB_WIRE_VERSION) return NB_RECEIPT_VERSION;
    while (receipt == NB_RECEIPT_WHOLE) {
        receipt = take_bytes(in, &frame, sizeof frame);
        if (receipt == NB_RECEIPT_WHOLE) receipt = take_frame(in, &frame);
        if (receipt == NB_RECEIPT_WHOLE && frame.type == NB_WIRE_END) return receipt;
    }
    return receipt;
}
