#include "gltf.h"
#include "keys/key_value.h"

#include <string.h>

/* Parents of nodes that have none: those that the scene begins with, and those it does not show. */
static const uint32_t scene_root = UINT32_MAX, apart = UINT32_MAX - 1;

static bool add_link(nb_json *json, nb_gltf_links *links, const nb_json_node *node, size_t parent)
{
    void *items = links->items;
    double child = 0;
    static const nb_range range = {.low = 0, .high = UINT32_MAX - 2, .text = "the number of a node"};
    if (!nb_key_value_number(json, node, &range, &child)) return false;
    if (!nb_grow(&json->desc.allocator, &items, sizeof *links->items, links->count, &links->capacity, links->count + 1))
        return nb_json_fail_memory(json, node);
    links->items = items;
    links->items[links->count++] = (nb_gltf_link){(uint32_t)parent, (uint32_t)child};
    return true;
}

static bool add_links(nb_json *json, nb_gltf_links *links, const nb_json_node *list, size_t parent)
{
    if (list == NULL) return true;
    if (!nb_key_value_is(json, list, NB_JSON_ARRAY, "an array of nodes")) return false;
    for (const nb_json_node *node = nb_json_first(json, list); node != NULL; node = nb_json_next(json, node))
        if (!add_link(json, links, node, parent)) return false;
    return true;
}

static const nb_json_node *find_member(const nb_json *json, const nb_json_node *object, const char *key)
{
    const nb_json_node *node = object->type == NB_JSON_OBJECT ? nb_json_first(json, object) : NULL;
    while (node != NULL && !nb_json_has_key(node, key)) node = nb_json_next(json, node);
    return node;
}

/* ---- nodes ----------------------------------------------------------------------------------- */

/* By columns, as glTF has it. */
static bool read_matrix(nb_json *json, const nb_json_node *node, nb_affine *place)
{
    double numbers[16];
    if (!nb_key_value_numbers(json, node, &nb_range_any, 16, numbers)) return false;
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 4; j++) place->m[i][j] = numbers[4 * j + i];
    return true;
}

static bool read_place(nb_json *json, const nb_json_node *node, nb_affine *place)
{
    nebel_transform transform = {.rotation = {0, 0, 0, 1}, .scale = {1, 1, 1}};
    const nb_json_node *matrix = find_member(json, node, "matrix");
    if (matrix != NULL) return read_matrix(json, matrix, place);
    if (!nb_key_value_numbers(json, find_member(json, node, "translation"), &nb_range_any, 3, transform.position) ||
        !nb_key_value_rotation(json, find_member(json, node, "rotation"), transform.rotation))
        return false;
    const nb_json_node *scale = find_member(json, node, "scale");
    if (scale != NULL && !nb_key_value_numbers(json, scale, &nb_range_any, 3, transform.scale)) return false;
    *place = nb_affine_from_transform(&transform);
    return true;
}

static bool take_node(nb_json *json, const nb_json_node *node, nb_gltf_tree *tree)
{
    void *places = tree->places;
    if (!nb_grow(&tree->allocator, &places, sizeof *tree->places, tree->count, &tree->capacity, tree->count + 1))
        return nb_json_fail_memory(json, node);
    tree->places = places;
    const size_t number = tree->count++;
    return read_place(json, node, &tree->places[number]) &&
           add_links(json, &tree->children, find_member(json, node, "children"), number);
}

static bool take_scenes(nb_json *json, const nb_json_node *scenes, nb_gltf_tree *tree)
{
    if (!nb_key_value_is(json, scenes, NB_JSON_ARRAY, "an array of scenes")) return false;
    for (const nb_json_node *node = nb_json_first(json, scenes); node != NULL; node = nb_json_next(json, node))
        if (!add_links(json, &tree->roots, find_member(json, node, "nodes"), node->index)) return false;
    return true;
}

/* Only nodes are streamed: their tree is no child of the root object, the others are. */
static bool take_node_value(nb_json *json, const nb_json_node *value, void *user)
{
    nb_gltf_tree *tree = user;
    const nb_json_node *parent = nb_json_parent(json, value);
    if (parent == NULL) return true;
    if (nb_json_parent(json, parent) != NULL) return take_node(json, value, tree);
    if (nb_json_has_key(value, "scene")) return nb_key_value_number(json, value, &nb_range_any, &tree->scene);
    return !nb_json_has_key(value, "scenes") || take_scenes(json, value, tree);
}

/* ---- the tree -------------------------------------------------------------------------------- */

static void hang_up(nb_gltf_tree *tree)
{
    const nb_gltf_links *children = &tree->children, *roots = &tree->roots;
    for (size_t i = 0; i < tree->count; i++) tree->parents[i] = roots->count > 0 ? apart : scene_root;
    for (size_t i = 0; i < children->count; i++)
        if (children->items[i].child < tree->count) tree->parents[children->items[i].child] = children->items[i].parent;
    for (size_t i = 0; i < roots->count; i++)
        if ((double)roots->items[i].parent == tree->scene && roots->items[i].child < tree->count)
            tree->parents[roots->items[i].child] = scene_root;
}

/* Takes the nodes of a way up from their parents' coordinates to the world's, the uppermost first. */
static void place_path(nb_gltf_tree *tree, const uint32_t *path, size_t count, bool is_shown)
{
    for (size_t i = count; i > 0; i--) {
        const uint32_t node = path[i - 1];
        if (is_shown) tree->places[node] = nb_affine_compose(&tree->places[tree->parents[node]], &tree->places[node]);
        tree->parents[node] = is_shown ? scene_root : apart;
    }
}

/* Each node is gone through once: afterwards all are placed in the world and have no parent. A way that does not end
 * goes in a circle. */
static bool place_all(nb_gltf_tree *tree)
{
    uint32_t *path = nb_allocate(&tree->allocator, tree->count, sizeof *path);
    if (path == NULL) return false;
    for (size_t i = 0; i < tree->count; i++) {
        size_t count = 0;
        uint32_t at = (uint32_t)i;
        while (tree->parents[at] != scene_root && tree->parents[at] != apart && count < tree->count) {
            path[count++] = at;
            at = tree->parents[at];
        }
        place_path(tree, path, count, tree->parents[at] == scene_root);
    }
    nb_release(&tree->allocator, path);
    return true;
}

nebel_result nb_gltf_read_tree(const nb_json_desc *desc, nb_gltf_tree *tree)
{
    static const char *const streamed[] = {"nodes", NULL};
    nb_json json;
    nb_json_desc own = *desc;
    *tree = (nb_gltf_tree){.allocator = desc->allocator};
    own.streamed = streamed;
    own.take = take_node_value;
    own.user = tree;
    const nebel_result result = nb_json_read(&json, &own);
    if (result != NEBEL_OK) return result;
    tree->parents = nb_allocate(&tree->allocator, tree->count, sizeof *tree->parents);
    if (tree->parents != NULL) hang_up(tree);
    if (tree->parents != NULL && place_all(tree)) return NEBEL_OK;
    return nb_fail(&desc->log, NEBEL_ERROR_MEMORY, "%s: out of memory", desc->name);
}

void nb_gltf_release_tree(nb_gltf_tree *tree)
{
    nb_release(&tree->allocator, tree->places);
    nb_release(&tree->allocator, tree->children.items);
    nb_release(&tree->allocator, tree->roots.items);
    nb_release(&tree->allocator, tree->parents);
}

bool nb_gltf_find_place(const nb_gltf_tree *tree, size_t node, nb_affine *place)
{
    *place = tree->places[node];
    return tree->parents[node] == scene_root;
}
