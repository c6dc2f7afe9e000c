/* Unity's High Definition Render Pipeline: the Fog override, local volumetric fog. Metres, y up, left-handed. */
#include "scene/import.h"

#include <limits.h>
#include <math.h>

/* VolumeRendering.hlsl: Cornette and Shanks' phase function, and an isotropic one for 0. */
static bool read_phase(nb_json *json, const nb_json_node *node, nebel_phase *phase)
{
    if (!nb_import_phase(json, node, 0, phase)) return false;
    if (phase->g != 0) phase->type = NEBEL_PHASE_CORNETTE_SHANKS;
    return true;
}

bool nb_import_hdrp_fog(nb_scene_reader *in, const nb_json_node *node, nb_import *fog)
{
    enum { TYPE, PATH, BASE, TOP, ALBEDO, ANISOTROPY, COUNT };
    static const char *const names[] = {"type", "meanFreePath", "baseHeight", "maximumHeight", "albedo", "anisotropy"};
    static const nb_key_set keys = {names, COUNT, NB_BIT(COUNT) - 1, 0, "an hdrp_fog"};
    /* Fog.cs: at the maximum height 0.001 of the fog is left, with -1 / ln 0.001 cut to six digits. */
    static const double per_depth = 0.144765, least_depth = 0.01;
    const nb_json_node *found[COUNT];
    nb_json *json = in->json;
    double path = 400, base = 0, top = 50, albedo[3] = {1, 1, 1};
    if (!nb_key_value_members(json, node, &keys, found) ||
        !nb_key_value_number(json, found[PATH], &nb_range_positive, &path) ||
        !nb_key_value_number(json, found[BASE], &nb_range_place, &base) ||
        !nb_key_value_number(json, found[TOP], &nb_range_place, &top) ||
        !nb_key_value_color(json, found[ALBEDO], &nb_range_fraction, albedo))
        return false;
    nebel_volume_desc *volume = &fog->volumes[0];
    *volume = nb_import_world(1 / path);
    if (!read_phase(json, found[ANISOTROPY], &volume->phase)) return false;
    volume->priority = INT_MIN; /* what any local volume may overwrite */
    nb_import_set_height(volume, base, per_depth * fmax(least_depth, top - base), NEBEL_BELOW_CONSTANT);
    for (int c = 0; c < 3; c++) volume->albedo[c] = albedo[c];
    fog->causes[0] =
        (nb_import_causes){.extinction = found[PATH], .scale_height = nb_import_either(found[TOP], found[BASE])};
    fog->count = 1;
    return true;
}

/* ---- local fog ------------------------------------------------------------------------------- */

/* Fades are fractions of the size. The product of both faces of an axis is the soft edge of the nearer one as long as
 * the two do not meet. */
static bool read_fades(nb_json *json, const nb_json_node *const fades[2], const double size[3], double edges[3])
{
    static const nb_range half = {.low = 0, .high = .5, .text = "a fraction of the size, from 0 to 0.5"};
    double positive[3] = {0}, negative[3] = {0};
    if (!nb_key_value_numbers(json, fades[0], &half, 3, positive) ||
        !nb_key_value_numbers(json, fades[1], &half, 3, negative))
        return false;
    for (int i = 0; i < 3; i++) {
        edges[i] = positive[i] * size[i];
        if (fabs(positive[i] - negative[i]) > 1e-5 * positive[i])
            return nb_json_fail(json, NEBEL_ERROR_UNSUPPORTED, fades[1],
                                "fades over %.15g m at one face and %.15g m at the one opposite; they must be the same",
                                negative[i] * size[i], edges[i]);
    }
    return true;
}

/* A soft edge has one distance in the shape's coordinates, where a scale makes it the axis' own: 1. A face that does
 * not fade does so over the last millionth. */
static void set_faded_box(nebel_volume_desc *volume, const double size[3], const double edges[3])
{
    const int fades = edges[0] > 0 || edges[1] > 0 || edges[2] > 0;
    const int even = fabs(edges[1] - edges[0]) <= 1e-5 * edges[0] && fabs(edges[2] - edges[0]) <= 1e-5 * edges[0];
    volume->shape.type = NEBEL_SHAPE_BOX;
    if (fades) volume->density = (nebel_density){.type = NEBEL_DENSITY_SOFT_EDGE, .edge_width = even ? edges[0] : 1};
    for (int i = 0; i < 3; i++) {
        const double unit = even ? 1 : fmax(edges[i], 1e-6 * size[i]);
        volume->shape.transform.scale[i] = unit;
        volume->shape.max[i] = size[i] / 2 / unit;
        volume->shape.min[i] = -volume->shape.max[i];
    }
}

/* Fog may fade over distances from the eye; where both are one it ends there. Left out: nowhere. */
static bool read_distances(nb_json *json, const nb_json_node *const distances[2], double *cutoff)
{
    double start = 10000, end = 10000; /* the engine's */
    if (distances[0] == NULL && distances[1] == NULL) return true;
    if (!nb_key_value_number(json, distances[0], &nb_range_extent, &start) ||
        !nb_key_value_number(json, distances[1], &nb_range_extent, &end))
        return false;
    *cutoff = end;
    return start == end || nb_json_fail(json, NEBEL_ERROR_UNSUPPORTED, distances[distances[0] == NULL],
                                        "fades from %.15g m to %.15g m from the eye; fog here ends at one distance, so "
                                        "they must be the same",
                                        start, end);
}

/* What overwrites replaces all of lower priority, its own edges included; the rest of the modes are no sums. */
static bool read_blending(nb_json *json, const nb_json_node *mode, const nb_json_node *priority,
                          nebel_volume_desc *volume)
{
    enum { OVERWRITE, ADDITIVE, MULTIPLY, MIN, MAX };
    int blending = ADDITIVE;
    if (!nb_key_value_integer(json, mode, OVERWRITE, MAX, &blending) ||
        !nb_key_value_integer(json, priority, INT_MIN + 1, INT_MAX, &volume->priority))
        return false;
    if (blending == OVERWRITE) volume->operation = NEBEL_OPERATION_REPLACE;
    return blending <= ADDITIVE ||
           nb_json_fail(json, NEBEL_ERROR_UNSUPPORTED, mode, "is %d; fog here overwrites, 0, or adds, 1", blending);
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
    enum {
        TYPE,
        PATH,
        ALBEDO,
        ANISOTROPY,
        SIZE,
        POSITIVE_FADE,
        NEGATIVE_FADE,
        INVERT,
        FALLOFF,
        FADE_START,
        FADE_END,
        BLENDING,
        PRIORITY,
        POSITION,
        ROTATION,
        COUNT
    };
    static const char *const names[] = {"type",        "meanFreePath",      "albedo",          "anisotropy",
                                        "size",        "positiveFade",      "negativeFade",    "invertFade",
                                        "falloffMode", "distanceFadeStart", "distanceFadeEnd", "blendingMode",
                                        "priority",    "localPosition",     "localRotation"};
    static const nb_key_set keys = {names, COUNT, NB_BIT(COUNT) - 1,
                                    NB_BIT(SIZE) | NB_BIT(POSITIVE_FADE) | NB_BIT(NEGATIVE_FADE),
                                    "an hdrp_local_volumetric_fog"};
    const nb_json_node *found[COUNT];
    nb_json *json = in->json;
    nebel_volume_desc *volume = &fog->volumes[0];
    *volume = nb_import_world(0);
    double path = 10, size[3] = {10, 10, 10}, edges[3], *albedo = volume->albedo;
    nebel_transform *transform = &volume->shape.transform;
    for (int c = 0; c < 3; c++) albedo[c] = 1;
    if (!nb_key_value_members(json, node, &keys, found) ||
        !nb_key_value_number(json, found[PATH], &nb_range_positive, &path) ||
        !nb_key_value_color(json, found[ALBEDO], &nb_range_fraction, albedo) ||
        !read_phase(json, found[ANISOTROPY], &volume->phase) ||
        !nb_key_value_numbers(json, found[SIZE], &nb_range_extent, 3, size) ||
        !read_fades(json, &found[POSITIVE_FADE], size, edges) ||
        !nb_import_refuse_other(json, found[INVERT], 0, "fog here is inside its shape") ||
        !nb_import_refuse_other(json, found[FALLOFF], 0, "only the linear falloff has a closed form") ||
        !read_distances(json, &found[FADE_START], &volume->cutoff) ||
        !read_blending(json, found[BLENDING], found[PRIORITY], volume) ||
        !nb_key_value_place(json, found[POSITION], transform->position) ||
        !nb_key_value_rotation(json, found[ROTATION], transform->rotation))
        return false;
    mirror(transform->position, transform->rotation);
    set_faded_box(volume, size, edges);
    for (int c = 0; c < 3; c++) volume->extinction[c] = 1 / path;
    fog->causes[0] = (nb_import_causes){
        .extinction = found[PATH], .edge = found[POSITIVE_FADE], .lengths = found[SIZE], .placement = found[SIZE]};
    fog->count = 1;
    return true;
}
