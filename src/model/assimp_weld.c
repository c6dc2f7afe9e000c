/* Formats without indices give every triangle three vertices of its own; here equal ones become one again. Equal is
 * equal in every bit, but for the sign of zero: vertices that are merely near each other may belong to different
 * surfaces. */
#include "assimp_builder.h"

#include <string.h>

/* A free slot of the table, a vertex without a number. */
static const uint32_t no_vertex = UINT32_MAX;

/* In a table that is at most half full no run of taken slots is half as long as this, unless someone made the numbers
 * to collide; then some equal vertices stay two, and the time stays bounded. */
enum { LONGEST_SEARCH = 256 };

enum { KEY_SIZE = 9 };

/* Returns how many of the numbers are used. Adding zero makes -0 to 0. */
static size_t load_key(const nb_weld_mesh *draft, nb_weld_key likeness, uint32_t vertex, float key[KEY_SIZE])
{
    const uint32_t origin = nb_draft_origin(draft, vertex);
    const struct aiVector3D *parts[3] = {&draft->positions[origin]};
    size_t count = 1;
    if (likeness == NB_LIKE_ALL && draft->normals != NULL) parts[count++] = &draft->normals[vertex];
    if (likeness == NB_LIKE_ALL && draft->uvs != NULL) parts[count++] = &draft->uvs[origin];
    for (size_t i = 0; i < count; i++) {
        key[3 * i] = parts[i]->x + 0.0f;
        key[3 * i + 1] = parts[i]->y + 0.0f;
        key[3 * i + 2] = parts[i]->z + 0.0f;
    }
    return 3 * count;
}

/* Multiplying carries low bits up, the shift carries high bits down. */
static size_t hash_key(const float *key, size_t count)
{
    uint64_t hash = 0;
    for (size_t i = 0; i < count; i++) {
        uint32_t bits;
        memcpy(&bits, &key[i], sizeof bits);
        hash = (hash ^ bits) * 0x9e3779b97f4a7c15u;
        hash ^= hash >> 32;
    }
    return (size_t)hash;
}

typedef struct lookup {
    const nb_weld_mesh *draft;
    nb_weld_key likeness;
    uint32_t *table;
    size_t mask; /* slots - 1 */
} lookup;

/* The vertex that is like this one and came before, or this one. */
static uint32_t find_or_add(const lookup *in, uint32_t vertex)
{
    float key[KEY_SIZE], other[KEY_SIZE];
    const size_t count = load_key(in->draft, in->likeness, vertex, key);
    const size_t start = hash_key(key, count);
    for (size_t i = 0; i < LONGEST_SEARCH; i++) {
        uint32_t *slot = &in->table[(start + i) & in->mask];
        if (*slot == no_vertex) return *slot = vertex;
        (void)load_key(in->draft, in->likeness, *slot, other);
        if (memcmp(key, other, count * sizeof *key) == 0) return *slot;
    }
    return vertex;
}

bool nb_draft_find_like(const nb_weld_mesh *draft, nb_weld_key likeness, uint32_t begin, uint32_t end, uint32_t *first)
{
    size_t slots = 2;
    while (slots < 2 * (size_t)(end - begin)) slots *= 2;
    lookup in = {draft, likeness, nb_allocate(&draft->allocator, slots, sizeof *in.table), slots - 1};
    if (in.table == NULL) return false;
    memset(in.table, 0xff, slots * sizeof *in.table);
    for (uint32_t i = begin; i < end; i++) first[i] = find_or_add(&in, i);
    nb_release(&draft->allocator, in.table);
    return true;
}

/* Vertices keep their order; returns how many the triangles use. */
static uint32_t number_used(const nb_weld_mesh *draft, const uint32_t *first, uint32_t *numbers, uint32_t *kept)
{
    const uint32_t count = draft->given_count + draft->copy_count;
    uint32_t used = 0;
    memset(numbers, 0xff, count * sizeof *numbers);
    for (size_t i = 0; i < 3 * (size_t)draft->triangle_count; i++) numbers[first[draft->corners[i]]] = 0;
    for (uint32_t i = 0; i < count; i++) {
        if (numbers[i] == no_vertex) continue;
        numbers[i] = used;
        kept[used++] = i;
    }
    return used;
}

bool nb_draft_join(const nb_weld_mesh *draft, uint32_t begin, uint32_t **kept, uint32_t *kept_count)
{
    const nebel_allocator *allocator = &draft->allocator;
    const uint32_t count = draft->given_count + draft->copy_count;
    uint32_t *first = nb_allocate(allocator, count, sizeof *first);
    uint32_t *numbers = nb_allocate(allocator, count, sizeof *numbers);
    *kept = nb_allocate(allocator, count, sizeof **kept);
    const bool good = first != NULL && numbers != NULL && *kept != NULL &&
                      nb_draft_find_like(draft, NB_LIKE_ALL, begin, count, first);
    if (good) {
        for (uint32_t i = 0; i < begin; i++) first[i] = i;
        *kept_count = number_used(draft, first, numbers, *kept);
        for (size_t i = 0; i < 3 * (size_t)draft->triangle_count; i++)
            draft->corners[i] = numbers[first[draft->corners[i]]];
    } else {
        nb_release(allocator, *kept);
        *kept = NULL;
    }
    nb_release(allocator, numbers);
    nb_release(allocator, first);
    return good;
}
