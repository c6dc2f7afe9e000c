#include "shadow_tree.h"

#include "base/vector.h"

#include <math.h>
#include <string.h>

typedef struct nb_key {
    uint32_t code, number;
} nb_key;

/* What is needed while a tree is built. */
typedef struct nb_making {
    int is_for_lamps;
    size_t count;
    nb_caster *triangles;
    uint32_t *numbers; /* of their sheets, see nb_shadow_tree */
    nb_key *keys, *other_keys;
    float low[3], scale; /* corner of all triangles; steps of codes per metre */
} nb_making;

/* ---- triangles ------------------------------------------------------------------------------- */

static void set_axes(const double sun[3], double axes[3][3])
{
    const int steep = fabs(sun[1]) > 0.5;
    const double other[3] = {steep ? 1 : 0, steep ? 0 : 1, 0};
    for (int i = 0; i < 3; i++) axes[2][i] = -sun[i];
    nb_vector_cross(other, axes[2], axes[0]);
    nb_vector_make_unit(axes[0]);
    nb_vector_cross(axes[2], axes[0], axes[1]);
}

static void turn(const double axes[3][3], const float *position, float corner[3])
{
    const double p[3] = {(double)position[0], (double)position[1], (double)position[2]};
    for (int i = 0; i < 3; i++) corner[i] = (float)nb_vector_dot(axes[i], p);
}

/* Twice the area that the sun sees; > 0 where the corners go round to the left. */
static double seen_area(const nb_caster *t)
{
    const double bx = (double)t->corner[1][0] - (double)t->corner[0][0];
    const double by = (double)t->corner[1][1] - (double)t->corner[0][1];
    const double cx = (double)t->corner[2][0] - (double)t->corner[0][0];
    const double cy = (double)t->corner[2][1] - (double)t->corner[0][1];
    return bx * cy - by * cx;
}

/* The gradient of texture coordinates in the plane of the corners: of all that change along two edges as they do, the one
 * that does not change across the plane. Seen by the sun corners lie at one height. */
static nb_sheet make_sheet(const nb_surface *surface, const uint32_t *index, const nb_caster *t, int is_for_lamps)
{
    nb_sheet sheet = {.mask = surface->mask};
    double edge[2][3], normal[3], across[2][3], texels[3][2];
    for (int k = 0; k < 3; k++) {
        const float *uv = surface->mesh->uvs + 2 * (size_t)index[k];
        texels[k][0] = isfinite(uv[0]) ? (double)uv[0] * surface->mask->width : 0;
        texels[k][1] = isfinite(uv[1]) ? (double)uv[1] * surface->mask->height : 0;
    }
    for (int i = 0; i < 3; i++) {
        const int counts = i < 2 || is_for_lamps;
        sheet.place[i] = counts ? (double)t->corner[0][i] : 0;
        for (int k = 0; k < 2; k++) edge[k][i] = counts ? (double)t->corner[k + 1][i] - (double)t->corner[0][i] : 0;
    }
    nb_vector_cross(edge[0], edge[1], normal);
    nb_vector_cross(edge[1], normal, across[0]);
    nb_vector_cross(normal, edge[0], across[1]);
    const double square = nb_vector_dot(normal, normal);
    for (int c = 0; c < 2; c++) {
        sheet.at[c] = texels[0][c];
        for (int i = 0; i < 3 && square > 0; i++)
            sheet.slope[c][i] =
                ((texels[1][c] - texels[0][c]) * across[0][i] + (texels[2][c] - texels[0][c]) * across[1][i]) / square;
    }
    return sheet;
}

/* Triangles that cast a shadow: those that are level with the sun's way do not, nor do those without a place. Which are
 * level with a lamp's way each lamp finds out. */
static void list_triangles(const nb_geometry *geometry, const double axes[3][3], nb_sheet *sheets, nb_making *making)
{
    uint32_t sheet_count = 0;
    making->count = 0;
    for (size_t s = 0; s < geometry->surface_count; s++) {
        const nb_surface *surface = &geometry->surfaces[s];
        for (size_t t = 0; t < surface->mesh->triangle_count; t++) {
            const uint32_t *index = surface->mesh->indices + 3 * t;
            nb_caster *triangle = &making->triangles[making->count];
            for (int k = 0; k < 3; k++) turn(axes, surface->positions + 3 * (size_t)index[k], triangle->corner[k]);
            const double area = seen_area(triangle);
            const float depth = triangle->corner[0][2] + triangle->corner[1][2] + triangle->corner[2][2];
            if ((area == 0 && !making->is_for_lamps) || !isfinite(area) || !isfinite(depth)) continue;
            if (surface->mask != NULL) sheets[sheet_count] = make_sheet(surface, index, triangle, making->is_for_lamps);
            if (making->numbers != NULL)
                making->numbers[making->count] = surface->mask != NULL ? sheet_count++ : NB_NONE;
            making->count++;
        }
    }
}

static void set_scale(nb_making *making)
{
    float high[3] = {-INFINITY, -INFINITY, -INFINITY}, largest = 0;
    for (int i = 0; i < 3; i++) making->low[i] = INFINITY;
    for (size_t t = 0; t < making->count; t++)
        for (int k = 0; k < 3; k++)
            for (int i = 0; i < 3; i++) {
                making->low[i] = fminf(making->low[i], making->triangles[t].corner[k][i]);
                high[i] = fmaxf(high[i], making->triangles[t].corner[k][i]);
            }
    for (int i = 0; i < 3 && making->count > 0; i++) largest = fmaxf(largest, high[i] - making->low[i]);
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

static uint32_t code_of(const nb_making *making, const nb_caster *t)
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
static void sort_digit(const nb_key *from, size_t count, int shift, nb_key *to)
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
    for (size_t i = 0; i < making->count; i++)
        making->keys[i] = (nb_key){code_of(making, &making->triangles[i]), (uint32_t)i};
    for (int d = 0; d < DIGITS; d++) {
        sort_digit(making->keys, making->count, d * DIGIT, making->other_keys);
        nb_key *const sorted = making->other_keys;
        making->other_keys = making->keys;
        making->keys = sorted;
    }
}

/* ---- prisms ---------------------------------------------------------------------------------- */

void nb_shadow_plane(const double normal[3], const double point[3], float plane[4])
{
    const double *n = normal, largest = fmax(fmax(fabs(n[0]), fabs(n[1])), fabs(n[2]));
    const double scale = largest > 0 ? 1 / largest : 0;
    for (int i = 0; i < 3; i++) plane[i] = (float)(n[i] * scale);
    plane[3] = (float)-(nb_vector_dot(n, point) * scale);
}

static void make_prism(const nb_caster *t, nb_prism *prism)
{
    const double side = seen_area(t) < 0 ? -1 : 1;
    double corner[3][3], way[3][3];
    for (int k = 0; k < 3; k++)
        for (int i = 0; i < 3; i++) corner[k][i] = (double)t->corner[k][i];
    for (int k = 0; k < 3; k++) {
        for (int i = 0; i < 3; i++) way[k][i] = corner[(k + 1) % 3][i] - corner[k][i];
        const double n[3] = {-way[k][1] * side, way[k][0] * side, 0};
        nb_shadow_plane(n, corner[k], prism->planes[k]);
    }
    double normal[3];
    nb_vector_cross(way[0], way[1], normal);
    for (int i = 0; i < 3; i++) normal[i] *= side;
    nb_shadow_plane(normal, corner[0], prism->planes[3]);
}

static void enlarge(nb_shadow_node *node, int child, const float low[3], const float high[3])
{
    for (int i = 0; i < 3; i++) {
        node->low[i][child] = fminf(node->low[i][child], low[i]);
        node->high[i][child] = fmaxf(node->high[i][child], high[i]);
    }
}

static void clear(nb_shadow_node *node)
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
    clear(node);
    for (size_t k = 0; k < NB_SHADOW_FAN * NB_SHADOW_FAN; k++) {
        const size_t place = number * NB_SHADOW_FAN * NB_SHADOW_FAN + k;
        if (place >= making->count) break;
        const nb_caster *t = &making->triangles[making->keys[place].number];
        if (making->is_for_lamps)
            tree->casters[place] = *t;
        else
            make_prism(t, &tree->prisms[place]);
        if (making->numbers != NULL) tree->numbers[place] = making->numbers[making->keys[place].number];
        for (int c = 0; c < 3; c++) enlarge(node, (int)(k / NB_SHADOW_FAN), t->corner[c], t->corner[c]);
    }
}

static void set_node(nb_shadow_tree *tree, int level, size_t number)
{
    nb_shadow_node *node = &tree->levels[level][number];
    clear(node);
    for (size_t k = 0; k < NB_SHADOW_FAN; k++) {
        const size_t child = number * NB_SHADOW_FAN + k;
        if (child >= tree->node_counts[level - 1]) break;
        const nb_shadow_node *below = &tree->levels[level - 1][child];
        for (int i = 0; i < NB_SHADOW_FAN; i++) {
            const float low[3] = {below->low[0][i], below->low[1][i], below->low[2][i]};
            const float high[3] = {below->high[0][i], below->high[1][i], below->high[2][i]};
            enlarge(node, (int)k, low, high);
        }
    }
}

static void fill_tree(nb_shadow_tree *tree, const nb_making *making, int threads)
{
#pragma omp parallel for schedule(static) num_threads(threads)
    for (size_t i = 0; i < tree->node_counts[0]; i++) set_leaves(tree, making, i);
    for (int level = 1; level < tree->level_count; level++)
        for (size_t i = 0; i < tree->node_counts[level]; i++) set_node(tree, level, i);
    for (int level = 0; level < tree->level_count; level++)
        for (size_t i = 0; i < tree->node_counts[level]; i++) finish(&tree->levels[level][i]);
}

static size_t divide_up(size_t a, size_t b)
{
    return (a + b - 1) / b;
}

static int allocate_tree(nb_shadow_tree *tree, const nebel_allocator *allocator, const nb_making *making)
{
    const size_t count = making->count;
    size_t all = 0;
    tree->level_count = 0;
    for (size_t nodes = divide_up(count, NB_SHADOW_FAN * NB_SHADOW_FAN);; nodes = divide_up(nodes, NB_SHADOW_FAN)) {
        tree->node_counts[tree->level_count++] = nodes;
        all += nodes;
        if (nodes <= 1) break;
    }
    tree->count = count;
    if (count == 0) return 1;
    if (making->is_for_lamps)
        tree->casters = nb_allocate(allocator, count, sizeof *tree->casters);
    else
        tree->prisms = nb_allocate(allocator, count, sizeof *tree->prisms);
    tree->nodes = nb_allocate(allocator, all, sizeof(nb_shadow_node));
    if (making->numbers != NULL) tree->numbers = nb_allocate(allocator, count, sizeof *tree->numbers);
    if (making->numbers != NULL && tree->numbers == NULL) return 0;
    if ((tree->prisms == NULL && tree->casters == NULL) || tree->nodes == NULL) return 0;
    nb_shadow_node *nodes = tree->nodes;
    for (int level = 0; level < tree->level_count; level++) {
        tree->levels[level] = nodes;
        nodes += tree->node_counts[level];
    }
    return 1;
}

/* Where any triangle has holes. */
static int allocate_sheets(nb_shadow_tree *tree, const nb_geometry *geometry, size_t triangles, nb_making *making)
{
    size_t holed = 0;
    for (size_t s = 0; s < geometry->surface_count; s++)
        holed += geometry->surfaces[s].mask != NULL ? geometry->surfaces[s].mesh->triangle_count : 0;
    if (holed == 0) return 1;
    tree->sheets = nb_allocate(&geometry->allocator, holed, sizeof *tree->sheets);
    making->numbers = nb_allocate(&geometry->allocator, triangles, sizeof *making->numbers);
    return tree->sheets != NULL && making->numbers != NULL;
}

static nebel_result build(nb_shadow_tree *tree, const nb_geometry *geometry, const double axes[3][3], nb_making *making,
                          int threads)
{
    size_t count = 0;
    for (size_t s = 0; s < geometry->surface_count; s++) count += geometry->surfaces[s].mesh->triangle_count;
    making->triangles = nb_allocate(&geometry->allocator, count + 1, sizeof *making->triangles);
    making->keys = nb_allocate(&geometry->allocator, count + 1, sizeof *making->keys);
    making->other_keys = nb_allocate(&geometry->allocator, count + 1, sizeof *making->other_keys);
    if (making->triangles == NULL || making->keys == NULL || making->other_keys == NULL) return NEBEL_ERROR_MEMORY;
    if (!allocate_sheets(tree, geometry, count, making)) return NEBEL_ERROR_MEMORY;
    list_triangles(geometry, axes, tree->sheets, making);
    set_scale(making);
    sort_triangles(making);
    if (!allocate_tree(tree, &geometry->allocator, making)) return NEBEL_ERROR_MEMORY;
    if (making->count > 0) fill_tree(tree, making, threads);
    return NEBEL_OK;
}

/* `sun` 0: for lamps. */
static nebel_result set(nb_shadow_tree *tree, const nb_geometry *geometry, const double sun[3], const double axes[3][3],
                        nb_making *making, int threads)
{
    if (tree->is_built && memcmp(tree->sun, sun, sizeof tree->sun) == 0 &&
        memcmp(tree->origin, geometry->origin, sizeof tree->origin) == 0)
        return NEBEL_OK;
    nb_shadow_tree_free(tree, &geometry->allocator);
    const nebel_result result = build(tree, geometry, axes, making, threads);
    nb_release(&geometry->allocator, making->triangles);
    nb_release(&geometry->allocator, making->numbers);
    nb_release(&geometry->allocator, making->keys);
    nb_release(&geometry->allocator, making->other_keys);
    if (result != NEBEL_OK) {
        nb_shadow_tree_free(tree, &geometry->allocator);
        return result;
    }
    memcpy(tree->sun, sun, sizeof tree->sun);
    memcpy(tree->origin, geometry->origin, sizeof tree->origin);
    for (int i = 0; i < 3; i++)
        for (int k = 0; k < 3; k++) tree->axes[i][k] = (float)axes[i][k];
    tree->is_built = 1;
    return NEBEL_OK;
}

nebel_result nb_shadow_tree_set_sun(nb_shadow_tree *tree, const nb_geometry *geometry, const double sun[3], int threads)
{
    nb_making making = {.is_for_lamps = 0};
    double axes[3][3];
    set_axes(sun, axes);
    return set(tree, geometry, sun, (const double(*)[3])axes, &making, threads);
}

nebel_result nb_shadow_tree_set_lamps(nb_shadow_tree *tree, const nb_geometry *geometry, int threads)
{
    static const double none[3] = {0, 0, 0}, axes[3][3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    nb_making making = {.is_for_lamps = 1};
    return set(tree, geometry, none, axes, &making, threads);
}

void nb_shadow_tree_free(nb_shadow_tree *tree, const nebel_allocator *allocator)
{
    nb_release(allocator, tree->prisms);
    nb_release(allocator, tree->casters);
    nb_release(allocator, tree->numbers);
    nb_release(allocator, tree->sheets);
    nb_release(allocator, tree->nodes);
    *tree = (nb_shadow_tree){.is_built = 0};
}
