#include "key_table.h"

#include <string.h>

#define NAMED(type, key, member, count, style)                                                                         \
    {                                                                                                                  \
        key, offsetof(type, member), count, style                                                                      \
    }
#define PLACE(type, member, count, style) NAMED(type, #member, member, count, style)
#define END                                                                                                            \
    {                                                                                                                  \
        NULL, 0, 0, NB_EDIT_EACH                                                                                       \
    }

const nb_key_entry nb_volume_places[] = {
    PLACE(nebel_volume_desc, source, 3, NB_EDIT_AMOUNT),   PLACE(nebel_volume_desc, albedo, 3, NB_EDIT_AMOUNT),
    PLACE(nebel_volume_desc, emission, 3, NB_EDIT_AMOUNT), PLACE(nebel_volume_desc, start, 1, NB_EDIT_EACH),
    PLACE(nebel_volume_desc, cutoff, 1, NB_EDIT_EACH),     END,
};

enum { MIN = 1, MAX = 2, CENTER = 4, RADIUS = 8, RADII = 16, FROM = 32, TO = 64, RADIUS_FROM = 128, RADIUS_TO = 256 };
enum { POINT = 512, NORMAL = 1024 };

const nb_key_entry nb_shape_places[] = {
    PLACE(nebel_shape, min, 3, NB_EDIT_EACH),       PLACE(nebel_shape, max, 3, NB_EDIT_EACH),
    PLACE(nebel_shape, center, 3, NB_EDIT_EACH),    PLACE(nebel_shape, radius, 1, NB_EDIT_EACH),
    PLACE(nebel_shape, radii, 3, NB_EDIT_EACH),     PLACE(nebel_shape, from, 3, NB_EDIT_EACH),
    PLACE(nebel_shape, to, 3, NB_EDIT_EACH),        PLACE(nebel_shape, radius_from, 1, NB_EDIT_EACH),
    PLACE(nebel_shape, radius_to, 1, NB_EDIT_EACH), PLACE(nebel_shape, point, 3, NB_EDIT_EACH),
    PLACE(nebel_shape, normal, 3, NB_EDIT_EACH),    END,
};

const unsigned nb_shape_masks[NEBEL_SHAPE_COUNT] = {
    [NEBEL_SHAPE_HALF_SPACE] = POINT | NORMAL,
    [NEBEL_SHAPE_BOX] = MIN | MAX,
    [NEBEL_SHAPE_SPHERE] = CENTER | RADIUS,
    [NEBEL_SHAPE_ELLIPSOID] = CENTER | RADII,
    [NEBEL_SHAPE_CYLINDER] = FROM | TO | RADIUS,
    [NEBEL_SHAPE_CAPSULE] = FROM | TO | RADIUS,
    [NEBEL_SHAPE_CONE] = FROM | TO | RADIUS_FROM | RADIUS_TO,
};

const nb_key_entry nb_transform_places[] = {
    PLACE(nebel_transform, position, 3, NB_EDIT_EACH),
    PLACE(nebel_transform, rotation, 4, NB_EDIT_WHOLE),
    PLACE(nebel_transform, scale, 3, NB_EDIT_AMOUNT),
    END,
};

const nebel_transform nb_plain_transform = {.rotation = {0, 0, 0, 1}, .scale = {1, 1, 1}};

const nb_key_entry nb_density_places[] = {
    PLACE(nebel_density, base, 1, NB_EDIT_EACH),
    PLACE(nebel_density, scale_height, 1, NB_EDIT_EACH),
    PLACE(nebel_density, from, 3, NB_EDIT_EACH),
    PLACE(nebel_density, to, 3, NB_EDIT_EACH),
    PLACE(nebel_density, center, 3, NB_EDIT_EACH),
    PLACE(nebel_density, sigma, 1, NB_EDIT_EACH),
    NAMED(nebel_density, "distance", edge_width, 1, NB_EDIT_EACH),
    PLACE(nebel_density, radius, 1, NB_EDIT_EACH),
    END,
};

const unsigned nb_density_masks[NEBEL_DENSITY_COUNT] = {
    [NEBEL_DENSITY_HEIGHT] = 1 | 2,
    [NEBEL_DENSITY_LINEAR] = 4 | 8,
    [NEBEL_DENSITY_GAUSSIAN] = 16 | 32,
    [NEBEL_DENSITY_SOFT_EDGE] = 64,
    [NEBEL_DENSITY_ALTITUDE] = 1 | 2 | 16 | 128,
};

const nb_key_entry nb_nebula_places[] = {
    NAMED(nebel_nebula_desc, "radius_range", radius_range, 2, NB_EDIT_EACH),
    PLACE(nebel_nebula_desc, absorption, 3, NB_EDIT_AMOUNT),
    PLACE(nebel_nebula_desc, emission, 3, NB_EDIT_AMOUNT),
    PLACE(nebel_nebula_desc, turbulence, 1, NB_EDIT_EACH),
    NAMED(nebel_nebula_desc, "turbulence_scale", turbulence_scale, 1, NB_EDIT_EACH),
    END,
};

const nb_key_entry nb_generated_places[] = {
    NAMED(nebel_nebula_desc, "dimming", dimming, 1, NB_EDIT_EACH),
    END,
};

const nb_key_entry nb_cell_places[] = {
    PLACE(nebel_cell, density, 1, NB_EDIT_EACH),
    PLACE(nebel_cell, color, 3, NB_EDIT_AMOUNT),
    END,
};

/* Of models from files; height fields have the first one. */
const nb_key_entry nb_model_places[] = {
    PLACE(nebel_scene_model, position, 3, NB_EDIT_EACH),
    PLACE(nebel_scene_model, rotation, 4, NB_EDIT_WHOLE),
    PLACE(nebel_scene_model, scale, 3, NB_EDIT_AMOUNT),
    END,
};

const nb_key_entry nb_light_places[] = {
    PLACE(nebel_light, position, 3, NB_EDIT_EACH),
    PLACE(nebel_light, intensity, 3, NB_EDIT_AMOUNT),
    PLACE(nebel_light, radius, 1, NB_EDIT_EACH),
    PLACE(nebel_light, direction, 3, NB_EDIT_WHOLE),
    PLACE(nebel_light, inner_angle, 1, NB_EDIT_EACH),
    PLACE(nebel_light, outer_angle, 1, NB_EDIT_EACH),
    END,
};

const nb_key_entry nb_height_field_places[] = {
    PLACE(nebel_scene_model, size, 2, NB_EDIT_EACH),
    PLACE(nebel_scene_model, height, 1, NB_EDIT_EACH),
    END,
};

const char *const nb_shape_names[NEBEL_SHAPE_COUNT] = {"world",     "half_space", "box",         "sphere",
                                                       "ellipsoid", "cylinder",   "capsule",     "cone",
                                                       "convex",    "union",      "intersection"};
const char *const nb_density_names[NEBEL_DENSITY_COUNT] = {"constant", "height",    "linear", "radial",
                                                           "gaussian", "soft_edge", "grid",   "altitude"};
const char *const nb_operation_names[NEBEL_OPERATION_COUNT] = {"add", "exclude", "replace"};
const char *const nb_below_names[2] = {"grow", "constant"};
const char *const nb_profile_names[NEBEL_PARTICLE_PROFILE_COUNT] = {"soft", "gaussian", "uniform"};
const char *const nb_air_profile_names[NEBEL_COMPONENT_PROFILE_COUNT] = {"exponential", "tent"};
/* By nebel_phase_type. */
const char *const nb_phase_names[NEBEL_PHASE_COUNT] = {"isotropic",       "rayleigh", "henyey_greenstein",
                                                       "cornette_shanks", "draine",   "droplets"};
const char *const nb_cell_model_names[NEBEL_CELL_MODEL_COUNT] = {"linear", "exponential"};
const char *const nb_cell_span_names[NEBEL_SPAN_COUNT] = {"ray", "depth", "printed"};

const double *nb_place_numbers(const void *structure, const nb_key_entry *place)
{
    return (const double *)((const char *)structure + place->offset);
}

bool nb_place_differs(const void *was, const void *now, const nb_key_entry *place)
{
    return memcmp(nb_place_numbers(was, place), nb_place_numbers(now, place), place->count * sizeof(double)) != 0;
}
