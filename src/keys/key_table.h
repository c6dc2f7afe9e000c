/* Which keys of the file hold which numbers of a volume. */
#ifndef NB_KEYS_KEY_TABLE_H
#define NB_KEYS_KEY_TABLE_H

#include "json/json_patch.h"

#include <nebel/scene.h>

typedef struct nb_key_entry {
    const char *key;
    size_t offset, count; /* in its structure; of doubles */
    nb_json_patch_style style;
} nb_key_entry;

/* Tables of places, which end in one without a key; masks say which places a type has, bit i for places[i]. */
extern const nb_key_entry nb_volume_places[], nb_shape_places[], nb_transform_places[], nb_density_places[],
    nb_nebula_places[], nb_generated_places[], nb_cell_places[], nb_model_places[], nb_height_field_places[],
    nb_light_places[];
extern const unsigned nb_shape_masks[NEBEL_SHAPE_COUNT], nb_density_masks[NEBEL_DENSITY_COUNT];
extern const char *const nb_shape_names[NEBEL_SHAPE_COUNT],
    *const nb_density_names[NEBEL_DENSITY_COUNT],
        *const nb_operation_names[NEBEL_OPERATION_COUNT],
            *const nb_below_names[2], *const nb_air_profile_names[NEBEL_COMPONENT_PROFILE_COUNT],
                                          *const nb_profile_names[NEBEL_PARTICLE_PROFILE_COUNT],
                                              *const nb_phase_names[NEBEL_PHASE_COUNT],
                                                  *const nb_cell_model_names[NEBEL_CELL_MODEL_COUNT],
                                                      *const nb_cell_span_names[NEBEL_SPAN_COUNT];

#define NB_ALL_PLACES (~0u)

const double *nb_place_numbers(const void *structure, const nb_key_entry *place);

/* Whether any bit differs: nothing is lost in a comparison. */
bool nb_place_differs(const void *was, const void *now, const nb_key_entry *place);

/* The transform that does nothing. */
extern const nebel_transform nb_plain_transform;

#endif
