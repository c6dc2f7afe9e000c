/* Fog in a node of a model: the shapes it may name, and its way into the world. */
#include "scene_data.h"

#include <math.h>

/* As large as the empties of a modelling program: 1 from the centre to a face or the surface, along y from -1 to 1. */
static const nebel_shape unit_shapes[] = {
    {.type = NEBEL_SHAPE_BOX, .min = {-1, -1, -1}, .max = {1, 1, 1}},
    {.type = NEBEL_SHAPE_SPHERE, .radius = 1},
    {.type = NEBEL_SHAPE_CYLINDER, .from = {0, -1, 0}, .to = {0, 1, 0}, .radius = 1},
    {.type = NEBEL_SHAPE_CONE, .from = {0, -1, 0}, .to = {0, 1, 0}, .radius_from = 1},
    {.type = NEBEL_SHAPE_WORLD},
};

bool nb_keys_read_node_shape(nb_scene_reader *in, const nb_json_node *node, nebel_shape *shape)
{
    static const char *const names[] = {"box", "sphere", "cylinder", "cone", "world"};
    static const nebel_transform still = {.rotation = {0, 0, 0, 1}, .scale = {1, 1, 1}};
    if (node != NULL && node->type != NB_JSON_STRING) return nb_keys_read_shape(in, node, shape);
    const int choice = node != NULL ? nb_key_value_choice(in->json, node, names, sizeof names / sizeof *names) : 0;
    if (choice < 0) return false;
    *shape = unit_shapes[choice];
    shape->transform = still;
    return true;
}

/* ---- into the world -------------------------------------------------------------------------- */

/* A ramp is level across: what counts is the gradient, which turns by the inverse of the transpose. g is that of the
 * density, 1 from `from` to `to`; afterwards `to` lies g / |g|^2 away. */
static void place_ramp(const nb_affine *map, const nebel_transform *transform, nebel_density *density)
{
    nebel_transform inverse = {.scale = {1, 1, 1}};
    double along[3], square = 0, gradient[3] = {0}, turned[3];
    for (int i = 0; i < 3; i++) along[i] = density->to[i] - density->from[i];
    for (int i = 0; i < 3; i++) square += along[i] * along[i];
    for (int i = 0; i < 4; i++) inverse.rotation[i] = transform->rotation[i];
    const nb_affine rotation = nb_affine_from_transform(&inverse);
    for (int i = 0; i < 3; i++) gradient[i] = along[i] / square / transform->scale[i];
    nb_affine_apply(&rotation, gradient, turned);
    nb_affine_apply(map, density->from, density->from);
    square = turned[0] * turned[0] + turned[1] * turned[1] + turned[2] * turned[2];
    for (int i = 0; i < 3; i++) density->to[i] = density->from[i] + turned[i] / square;
}

static bool place_gaussian(nb_scene_reader *in, const nb_json_node *node, const nb_affine *map,
                           const nebel_transform *transform, nebel_density *density)
{
    const double *scale = transform->scale;
    const double size = fabs(scale[0]);
    if (fabs(fabs(scale[1]) - size) > 1e-4 * size || fabs(fabs(scale[2]) - size) > 1e-4 * size)
        return nb_json_fail(in->json, NEBEL_ERROR_FORMAT, node,
                            "has a gaussian density, but another scale along each axis; make the scales equal");
    nb_affine_apply(map, density->center, density->center);
    density->sigma *= size;
    return true;
}

/* Height stays in metres along the world's y, but counts from the node; ramps and gaussians move with it. */
static bool place_density(nb_scene_reader *in, const nb_json_node *node, const nebel_transform *transform,
                          nebel_density *density)
{
    const nb_affine *map = &in->node->place;
    if (density->type == NEBEL_DENSITY_HEIGHT) density->base += map->m[1][3];
    if (density->type == NEBEL_DENSITY_LINEAR) place_ramp(map, transform, density);
    return density->type != NEBEL_DENSITY_GAUSSIAN || place_gaussian(in, node, map, transform, density);
}

bool nb_keys_read_place_volume(nb_scene_reader *in, const nb_json_node *node, nebel_volume_desc *volume)
{
    const nb_affine own = nb_affine_from_transform(&volume->shape.transform);
    const nb_affine whole = nb_affine_compose(&in->node->place, &own);
    nebel_transform transform;
    if (!nb_affine_to_transform(&in->node->place, &transform) ||
        !nb_affine_to_transform(&whole, &volume->shape.transform))
        return nb_json_fail(in->json, NEBEL_ERROR_FORMAT, node,
                            "is flat or sheared, by a scale of 0 or by different scales above a rotation; apply the "
                            "scales of what it hangs on");
    return place_density(in, node, &transform, &volume->density);
}
