#include "shadow_bvh.h"

#include <math.h>
#include <string.h>

typedef struct nb_bvh_key {
    uint32_t code, number;
} nb_bvh_key;

/* What is needed while a tree is built. */
typedef struct nb_making {
    nb_occluders casters;
    nb_bvh_key *keys, *other_keys;
    float low[3], scale; /* corner of all triangles; steps of codes per metre */
} nb_making;

static void set_scale(nb_making *making)
{
    float high[3] = {-INFINITY, -INFINITY, -INFINITY}, largest = 0;
    for (int i = 0; i < 3; i++) making->low[i] = INFINITY;
    for (size_t t = 0; t < making->casters.count; t++)
        for (int k = 0; k < 3; k++)
            for (int i = 0; i < 3; i++) {
                making->low[i] = fminf(making->low[i], making->casters.triangles[t].corner[k][i]);
                high[i] = fmaxf(high[i], making->casters.triangles[t].corner[k][i]);
            }
    for (int i = 0; i < 3 && making->casters.count > 0; i++) largest = fmaxf(largest, high[i] - making->low[i]);
    making->scale = largest > 0 ? 1023 / largest : 0;
}

/* ---- order: neighbours in space are neighbours in the tree (Morton 1966) ---------------------- */

/* Two zeros between each two of the ten lowest bits. */
static uint32_t spread(uint32_t x)
{
    x = (x | x << 16) & 0x030000ffu;
    x = (x | x << 8) & 0x0300f00fu;
    x = (x | x << 4) & 0x030c30c3u;
    return (x | x << 2) & 0x09249249u;
}

static uint32_t code_of(const nb_making *making, const nb_occluder *t)
{
    uint32_t code = 0;
    for (int i = 0; i < 3; i++) {
        const float middle = (t->corner[0][i] + t->corner[1][i] + t->corner[2][i]) / 3 - making->low[i];
        const float step = fminf(fmaxf(middle * making->scale, 0), 1023);
        code |= spread((uint32_t)step) << i;
    }
    return code;
}

enum { DIGIT = 10, DIGITS = 3 };

/* By one digit of the code, equal ones in the order they had. */
static void sort_digit(const nb_bvh_key *from, size_t count, int shift, nb_bvh_key *to)
{
    size_t places[1 << DIGIT] = {0}, place = 0;
    const uint32_t mask = (1u << DIGIT) - 1;
    for (size_t i = 0; i < count; i++) places[from[i].code >> shift & mask]++;
    for (size_t d = 0; d <= mask; d++) {
        const size_t held = places[d];
        places[d] = place;
        place += held;
    }
    for (size_t i = 0; i < count; i++) to[places[from[i].code >> shift & mask]++] = from[i];
}

static void sort_triangles(nb_making *making)
{
    for (size_t i = 0; i < making->casters.count; i++)
        making->keys[i] = (nb_bvh_key){code_of(making, &making->casters.triangles[i]), (uint32_t)i};
    for (int d = 0; d < DIGITS; d++) {
        sort_digit(making->keys, making->casters.count, d * DIGIT, making->other_keys);
        nb_bvh_key *const sorted = making->other_keys;
        making->other_keys = making->keys;
        making->keys = sorted;
    }
}

static void enlarge_child(nb_shadow_node *node, int child, const float low[3], const float high[3])
{
    for (int i = 0; i < 3; i++) {
        node->low[i][child] = fminf(node->low[i][child], low[i]);
        node->high[i][child] = fmaxf(node->high[i][child], high[i]);
    }
}

static void clear_node(nb_shadow_node *node)
{
    for (int k = 0; k < NB_SHADOW_FAN; k++) {
        for (int i = 0; i < 3; i++) {
            node->low[i][k] = INFINITY;
            node->high[i][k] = -INFINITY;
        }
        node->low[2][k] = 1e30f;
    }
}

/* The walk divides by no sign: what nothing is below lies at a place, and begins nowhere. */
static void finish(nb_shadow_node *node)
{
    for (int k = 0; k < NB_SHADOW_FAN; k++)
        for (int i = 0; i < 2 && node->low[2][k] >= 1e30f; i++) node->low[i][k] = node->high[i][k] = 0;
}

/* ---- the tree -------------------------------------------------------------------------------- */

static void set_leaves(nb_shadow_tree *tree, const nb_making *making, size_t number)
{
    nb_shadow_node *node = &tree->levels[0][number];
    clear_node(node);
    for (size_t k = 0; k < NB_SHADOW_FAN * NB_SHADOW_FAN; k++) {
        const size_t place = number * NB_SHADOW_FAN * NB_SHADOW_FAN + k;
        if (place >= making->casters.count) break;
        const nb_occluder *t = &making->casters.triangles[making->keys[place].number];
        tree->casters[place] = *t;
        if (tree->numbers != NULL) tree->numbers[place] = making->casters.numbers[making->keys[place].number];
        for (int c = 0; c < 3; c++) enlarge_child(node, (int)(k / NB_SHADOW_FAN), t->corner[c], t->corner[c]);
    }
}

static void set_shadow_node(nb_shadow_tree *tree, int level, size_t number)
{
    nb_shadow_node *node = &tree->levels[level][number];
    clear_node(node);
    for (size_t k = 0; k < NB_SHADOW_FAN; k++) {
        const size_t child = number * NB_SHADOW_FAN + k;
        if (child >= tree->node_counts[level - 1]) break;
        const nb_shadow_node *below = &tree->levels[level - 1][child];
        for (int i = 0; i < NB_SHADOW_FAN; i++) {
            const float low[3] = {below->low[0][i], below->low[1][i], below->low[2][i]};
            const float high[3] = {below->high[0][i], below->high[1][i], below->high[2][i]};
            enlarge_child(node, (int)k, low, high);
        }
    }
}

static void fill_tree(nb_shadow_tree *tree, const nb_making *making, int threads)
{
#pragma omp parallel for schedule(static) num_threads(threads)
    for (size_t i = 0; i < tree->node_counts[0]; i++) set_leaves(tree, making, i);
    for (int level = 1; level < tree->level_count; level++)
        for (size_t i = 0; i < tree->node_counts[level]; i++) set_shadow_node(tree, level, i);
    for (int level = 0; level < tree->level_count; level++)
        for (size_t i = 0; i < tree->node_counts[level]; i++) finish(&tree->levels[level][i]);
}

static size_t divide_up(size_t a, size_t b)
{
    return (a + b - 1) / b;
}

/* Sheets become the tree's. */
static int allocate_tree(nb_shadow_tree *tree, const nebel_allocator *allocator, nb_making *making)
{
    const size_t count = making->casters.count;
    size_t all = 0;
    tree->level_count = 0;
    for (size_t nodes = divide_up(count, NB_SHADOW_FAN * NB_SHADOW_FAN);; nodes = divide_up(nodes, NB_SHADOW_FAN)) {
        tree->node_counts[tree->level_count++] = nodes;
        all += nodes;
        if (nodes <= 1) break;
    }
    tree->count = count;
    if (count == 0) return 1;
    tree->casters = nb_allocate(allocator, count, sizeof *tree->casters);
    tree->nodes = nb_allocate(allocator, all, sizeof(nb_shadow_node));
    if (tree->casters == NULL || tree->nodes == NULL) return 0;
    if (making->casters.numbers != NULL) {
        tree->numbers = nb_allocate(allocator, count, sizeof *tree->numbers);
        if (tree->numbers == NULL) return 0;
        tree->sheets = making->casters.sheets;
        making->casters.sheets = NULL;
    }
    nb_shadow_node *nodes = tree->nodes;
    for (int level = 0; level < tree->level_count; level++) {
        tree->levels[level] = nodes;
        nodes += tree->node_counts[level];
    }
    return 1;
}

static nebel_result build_shadow_tree(nb_shadow_tree *tree, const nb_geometry *geometry, nb_making *making, int threads)
{
    static const double axes[3][3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    nb_occluders *casters = &making->casters;
    if (nb_occluders_list(geometry, axes, 0, casters) != NEBEL_OK) return NEBEL_ERROR_MEMORY;
    making->keys = nb_allocate(&geometry->allocator, casters->count + 1, sizeof *making->keys);
    making->other_keys = nb_allocate(&geometry->allocator, casters->count + 1, sizeof *making->other_keys);
    if (making->keys == NULL || making->other_keys == NULL) return NEBEL_ERROR_MEMORY;
    set_scale(making);
    sort_triangles(making);
    if (!allocate_tree(tree, &geometry->allocator, making)) return NEBEL_ERROR_MEMORY;
    if (making->casters.count > 0) fill_tree(tree, making, threads);
    return NEBEL_OK;
}

nebel_result nb_shadow_tree_set_lights(nb_shadow_tree *tree, const nb_geometry *geometry, int threads)
{
    nb_making making = {.keys = NULL};
    if (tree->is_built && memcmp(tree->origin, geometry->origin, sizeof tree->origin) == 0) return NEBEL_OK;
    nb_shadow_tree_free(tree, &geometry->allocator);
    const nebel_result result = build_shadow_tree(tree, geometry, &making, threads);
    nb_occluders_free(&making.casters, &geometry->allocator);
    nb_release(&geometry->allocator, making.keys);
    nb_release(&geometry->allocator, making.other_keys);
    if (result != NEBEL_OK) {
        nb_shadow_tree_free(tree, &geometry->allocator);
        return result;
    }
    memcpy(tree->origin, geometry->origin, sizeof tree->origin);
    tree->is_built = 1;
    return NEBEL_OK;
}

void nb_shadow_tree_free(nb_shadow_tree *tree, const nebel_allocator *allocator)
{
    nb_release(allocator, tree->casters);
    nb_release(allocator, tree->numbers);
    nb_release(allocator, tree->sheets);
    nb_release(allocator, tree->nodes);
    *tree = (nb_shadow_tree){.is_built = 0};
}
