/* Fog in the words of game engines, as volumes of ours: metres, y up. docs/engines.md says what each setting becomes,
 * and from where we know it. */
#ifndef NB_SCENE_IMPORT_H
#define NB_SCENE_IMPORT_H

#include "scene_data.h"

/* The settings that numbers of the volumes were made of, for messages about these; NULL: none in the file. */
typedef struct nb_import_causes {
    const nb_json_node *extinction, *source, *emission, *base, *scale_height, *lengths, *edge, *placement;
} nb_import_causes;

typedef struct nb_import {
    nebel_volume_desc volumes[2]; /* those not 0: `count` of them */
    size_t count;
    double max_opacity; /* of all fog; 0: no limit */
    nb_import_causes causes[2];
} nb_import;

/* One for each type of import; `node` is its object. */
bool nb_import_unreal_height_fog(nb_scene_reader *in, const nb_json_node *node, nb_import *fog);
bool nb_import_unreal_local_fog(nb_scene_reader *in, const nb_json_node *node, nb_import *fog);
bool nb_import_godot_fog(nb_scene_reader *in, const nb_json_node *node, nb_import *fog);
bool nb_import_godot_volumetric_fog(nb_scene_reader *in, const nb_json_node *node, nb_import *fog);
bool nb_import_godot_fog_volume(nb_scene_reader *in, const nb_json_node *node, nb_import *fog);
bool nb_import_hdrp_fog(nb_scene_reader *in, const nb_json_node *node, nb_import *fog);
bool nb_import_hdrp_local_fog(nb_scene_reader *in, const nb_json_node *node, nb_import *fog);
bool nb_import_bevy_distance_fog(nb_scene_reader *in, const nb_json_node *node, nb_import *fog);
bool nb_import_bevy_fog_volume(nb_scene_reader *in, const nb_json_node *node, nb_import *fog);

/* Reads an import of any type. What settings make together is within the limits of the core. */
bool nb_keys_read_import(nb_scene_reader *in, const nb_json_node *node, nb_import *fog);

/* ---- what importers share -------------------------------------------------------------------- */

/* The first of two settings that the file has; NULL: neither. */
const nb_json_node *nb_import_either(const nb_json_node *first, const nb_json_node *second);

/* An endless volume of constant density that takes all colours alike. */
nebel_volume_desc nb_import_world(double extinction);

/* Makes the density exp(-(y - base) / scale_height). */
void nb_import_set_height(nebel_volume_desc *volume, double base, double scale_height, nebel_below below);

/* Henyey and Greenstein's phase function with the g that the settings have, else `usual`; isotropic for 0. */
bool nb_import_phase(nb_json *json, const nb_json_node *node, double usual, nebel_phase *phase);

/* A number for which only `neutral` has a counterpart here; `reason` says why. */
bool nb_import_refuse_other(nb_json *json, const nb_json_node *node, double neutral, const char *reason);

#endif
