/* Bevy: DistanceFog, FogVolume. Our axes and metres. */
#include "scene/import.h"

static bool check_inscattering(nb_json *json, const nb_json_node *node, const double extinction[3])
{
    double other[3];
    for (int c = 0; c < 3; c++) other[c] = extinction[c];
    if (!nb_key_value_amount(json, node, &nb_range_amount, other)) return false;
    for (int c = 0; c < 3; c++)
        if (other[c] != extinction[c])
            return nb_json_fail(
                json, NEBEL_ERROR_UNSUPPORTED, node,
                "differs from \"extinction\"; light that is gathered at another rate than it is lost is "
                "not the integral of a density");
    return true;
}

bool nb_import_bevy_distance_fog(nb_scene_reader *in, const nb_json_node *node, nb_import *fog)
{
    enum { TYPE, COLOR, DENSITY, EXTINCTION, INSCATTERING, COUNT };
    static const char *const names[] = {"type", "color", "density", "extinction", "inscattering"};
    static const nb_key_set keys = {names, COUNT, NB_BIT(COUNT) - 1, 0, "a bevy_distance_fog"};
    const nb_json_node *found[COUNT];
    nb_json *json = in->json;
    nebel_volume_desc *volume = &fog->volumes[0];
    *volume = nb_import_world(0);
    for (int c = 0; c < 3; c++) volume->source[c] = 1;
    if (!nb_key_value_members(json, node, &keys, found)) return false;
    if ((found[DENSITY] != NULL) == (found[EXTINCTION] != NULL))
        return nb_json_fail(json, NEBEL_ERROR_FORMAT, node,
                            "has \"density\" (Exponential) or \"extinction\" (Atmospheric), one of them; the other "
                            "falloffs are not integrals of a density");
    const nb_json_node *amount = found[DENSITY] != NULL ? found[DENSITY] : found[EXTINCTION];
    fog->count = 1;
    return nb_key_value_color(json, found[COLOR], &nb_range_light, volume->source) &&
           nb_key_value_amount(json, amount, &nb_range_amount, volume->extinction) &&
           check_inscattering(json, found[INSCATTERING], volume->extinction);
}

/* A cube of side 1 before its transform. */
bool nb_import_bevy_fog_volume(nb_scene_reader *in, const nb_json_node *node, nb_import *fog)
{
    enum { TYPE, DENSITY, ABSORPTION, SCATTERING, ASYMMETRY, COLOR, TRANSLATION, ROTATION, SCALE, COUNT };
    static const char *const names[] = {
        "type",      "density_factor", "absorption", "scattering", "scattering_asymmetry",
        "fog_color", "translation",    "rotation",   "scale"};
    static const nb_key_set keys = {names, COUNT, NB_BIT(COUNT) - 1, 0, "a bevy_fog_volume"};
    const nb_json_node *found[COUNT];
    nb_json *json = in->json;
    double density = 0.1, absorption = 0.3, scattering = 0.3, color[3] = {1, 1, 1};
    nebel_volume_desc *volume = &fog->volumes[0];
    *volume = nb_import_world(0);
    nebel_transform *transform = &volume->shape.transform;
    if (!nb_key_value_members(json, node, &keys, found) ||
        !nb_key_value_number(json, found[DENSITY], &nb_range_light, &density) ||
        !nb_key_value_number(json, found[ABSORPTION], &nb_range_amount, &absorption) ||
        !nb_key_value_number(json, found[SCATTERING], &nb_range_amount, &scattering) ||
        !nb_import_phase(json, found[ASYMMETRY], 0.5, &volume->phase) ||
        !nb_key_value_color(json, found[COLOR], &nb_range_fraction, color) ||
        !nb_key_value_place(json, found[TRANSLATION], transform->position) ||
        !nb_key_value_rotation(json, found[ROTATION], transform->rotation) ||
        !nb_key_value_scale(json, found[SCALE], transform->scale))
        return false;
    volume->shape.type = NEBEL_SHAPE_BOX;
    for (int i = 0; i < 3; i++) {
        volume->shape.min[i] = -.5;
        volume->shape.max[i] = .5;
        volume->extinction[i] = density * (absorption + scattering);
        volume->albedo[i] = scattering > 0 ? color[i] * scattering / (absorption + scattering) : 0;
    }
    fog->causes[0].extinction =
        nb_import_either(found[DENSITY], nb_import_either(found[ABSORPTION], found[SCATTERING]));
    fog->count = 1;
    return true;
}
