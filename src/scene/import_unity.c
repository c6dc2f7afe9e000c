/* Unity's High Definition Render Pipeline: the Fog override, local volumetric fog. Metres, y up, left-handed. */
#include "scene/import.h"

#include <math.h>

bool nb_import_hdrp_fog(nb_scene_reader *in, const nb_json_node *node, nb_import *fog)
{
    enum { TYPE, PATH, BASE, TOP, ALBEDO, COUNT };
    static const char *const names[] = {"type", "meanFreePath", "baseHeight", "maximumHeight", "albedo"};
    static const nb_keys keys = {names, COUNT, NB_BIT(COUNT) - 1, 0, "an hdrp_fog"};
    /* Fog.cs: at the maximum height 0.001 of the fog is left, with -1 / ln 0.001 cut to six digits. */
    static const double per_depth = 0.144765, least_depth = 0.01;
    const nb_json_node *found[COUNT];
    nb_json *json = in->json;
    double path = 400, base = 0, top = 50, albedo[3] = {1, 1, 1};
    if (!nb_value_members(json, node, &keys, found) || !nb_value_number(json, found[PATH], &nb_range_positive, &path) ||
        !nb_value_number(json, found[BASE], &nb_range_any, &base) ||
        !nb_value_number(json, found[TOP], &nb_range_any, &top) ||
        !nb_value_color(json, found[ALBEDO], &nb_range_fraction, albedo))
        return false;
    nebel_volume_desc *volume = &fog->volumes[0];
    *volume = nb_import_world(1 / path);
    nb_import_set_height(volume, base, per_depth * fmax(least_depth, top - base), NEBEL_BELOW_CONSTANT);
    for (int c = 0; c < 3; c++) volume->albedo[c] = albedo[c];
    fog->count = 1;
    return true;
}

/* ---- local fog
 * ------------------------------------------------------------------------------------------------------- */

/* Fades are fractions of the size. One distance, the same at every face, is the soft edge of a box: the product of both
 * faces of an axis is the nearer one's as long as the two do not meet. */
static bool read_fade(nb_json *json, const nb_json_node *const fades[2], const double size[3], double *distance)
{
    static const nb_range half = {0, .5, false, "a fraction of the size, from 0 to 0.5"};
    *distance = -1;
    for (int f = 0; f < 2; f++) {
        double fade[3] = {.1, .1, .1};
        if (!nb_value_numbers(json, fades[f], &half, 3, fade)) return false;
        for (int i = 0; i < 3; i++) {
            if (*distance < 0) *distance = fade[i] * size[i];
            if (fabs(fade[i] * size[i] - *distance) > 1e-5 * *distance)
                return nb_json_fail(json, NEBEL_ERROR_UNSUPPORTED, fades[f],
                                    "fades over %.15g m at one face and %.15g m at another; they must be the same",
                                    *distance, fade[i] * size[i]);
        }
    }
    return true;
}

/* Right-handed by turning x round, as Unity's glTF exporters do. */
static void mirror(double position[3], double rotation[4])
{
    position[0] = -position[0];
    rotation[1] = -rotation[1];
    rotation[2] = -rotation[2];
}

bool nb_import_hdrp_local_fog(nb_scene_reader *in, const nb_json_node *node, nb_import *fog)
{
    enum { TYPE, PATH, ALBEDO, SIZE, POSITIVE_FADE, NEGATIVE_FADE, FALLOFF, BLENDING, POSITION, ROTATION, COUNT };
    static const char *const names[] = {"type",          "meanFreePath", "albedo",      "size",
                                        "positiveFade",  "negativeFade", "falloffMode", "blendingMode",
                                        "localPosition", "localRotation"};
    static const nb_keys keys = {names, COUNT, NB_BIT(COUNT) - 1,
                                 NB_BIT(SIZE) | NB_BIT(POSITIVE_FADE) | NB_BIT(NEGATIVE_FADE),
                                 "an hdrp_local_volumetric_fog"};
    const nb_json_node *found[COUNT];
    nb_json *json = in->json;
    nebel_volume_desc *volume = &fog->volumes[0];
    *volume = nb_import_world(0);
    double path = 10, size[3] = {10, 10, 10}, *albedo = volume->albedo, distance;
    nebel_transform *transform = &volume->shape.transform;
    for (int c = 0; c < 3; c++) albedo[c] = 1;
    if (!nb_value_members(json, node, &keys, found) || !nb_value_number(json, found[PATH], &nb_range_positive, &path) ||
        !nb_value_color(json, found[ALBEDO], &nb_range_fraction, albedo) ||
        !nb_value_numbers(json, found[SIZE], &nb_range_positive, 3, size) ||
        !read_fade(json, &found[POSITIVE_FADE], size, &distance) ||
        !nb_import_refuse_other(json, found[FALLOFF], 0, "only the linear falloff has a closed form") ||
        !nb_import_refuse_other(json, found[BLENDING], 1, "volumes here add") ||
        !nb_value_vector(json, found[POSITION], transform->position) ||
        !nb_value_rotation(json, found[ROTATION], transform->rotation))
        return false;
    mirror(transform->position, transform->rotation);
    volume->shape.type = NEBEL_SHAPE_BOX;
    for (int i = 0; i < 3; i++) {
        volume->extinction[i] = 1 / path;
        volume->shape.max[i] = size[i] / 2;
        volume->shape.min[i] = -size[i] / 2;
    }
    if (distance > 0) volume->density = (nebel_density){.type = NEBEL_DENSITY_SOFT_EDGE, .distance = distance};
    fog->count = 1;
    return true;
}
