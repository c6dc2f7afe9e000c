/* Changed planets, back into the file: numbers of their air, clouds and shells. */
#include "key_patch.h"

#include <string.h>

#define PLACE(type, key, member, count, style)                                                                         \
    {                                                                                                                  \
        key, offsetof(type, member), count, style                                                                      \
    }
#define NUMBER(type, member) PLACE(type, #member, member, 1, NB_EDIT_EACH)
#define END_OF_KEYS                                                                                                    \
    {                                                                                                                  \
        NULL, 0, 0, NB_EDIT_EACH                                                                                       \
    }

static const nb_key_entry physical_places[] = {
    PLACE(nebel_planet, "ground_albedo", atmosphere_desc.ground_albedo, 3, NB_EDIT_AMOUNT),
    PLACE(nebel_planet, "sun_angular_diameter", sun_angular_diameter, 1, NB_EDIT_EACH),
    END_OF_KEYS,
};

static const nb_key_entry air_places[] = {
    PLACE(nebel_atmosphere_component, "scattering", scattering, 3, NB_EDIT_AMOUNT),
    PLACE(nebel_atmosphere_component, "absorption", absorption, 3, NB_EDIT_AMOUNT),
    NUMBER(nebel_atmosphere_component, scale_height),
    PLACE(nebel_atmosphere_component, "center_height", center_height, 1, NB_EDIT_EACH),
    PLACE(nebel_atmosphere_component, "half_width", half_width, 1, NB_EDIT_EACH),
    END_OF_KEYS,
};

static const unsigned air_masks[NEBEL_COMPONENT_PROFILE_COUNT] = {
    [NEBEL_COMPONENT_EXPONENTIAL] = 1 | 2 | 4,
    [NEBEL_COMPONENT_TENT] = 1 | 2 | 8 | 16,
};

static const nb_key_entry cloud_places[] = {
    NUMBER(nebel_cloud_layer, base),
    NUMBER(nebel_cloud_layer, top),
    NUMBER(nebel_cloud_layer, coverage),
    NUMBER(nebel_cloud_layer, extinction),
    PLACE(nebel_cloud_layer, "cell_size", cell_size, 1, NB_EDIT_EACH),
    PLACE(nebel_cloud_layer, "erosion", erosion, 1, NB_EDIT_EACH),
    PLACE(nebel_cloud_layer, "patchiness", patchiness, 1, NB_EDIT_EACH),
    PLACE(nebel_cloud_layer, "droplet_diameter", droplet_diameter, 1, NB_EDIT_EACH),
    PLACE(nebel_cloud_layer, "wind", wind, 2, NB_EDIT_EACH),
    END_OF_KEYS,
};

static const nb_key_entry layers_places[] = {
    PLACE(nebel_textured_planet_desc, "rotation_period", rotation_period, 1, NB_EDIT_EACH),
    PLACE(nebel_textured_planet_desc, "land_coverage", land_coverage, 1, NB_EDIT_EACH),
    END_OF_KEYS,
};

static const nb_key_entry shell_places[] = {
    NUMBER(nebel_cloud_shell, height),
    PLACE(nebel_cloud_shell, "rotation_period", rotation_period, 1, NB_EDIT_EACH),
    PLACE(nebel_cloud_shell, "color", color, 3, NB_EDIT_AMOUNT),
    PLACE(nebel_cloud_shell, "uv_tiling", uv_tiling, 3, NB_EDIT_EACH),
    NUMBER(nebel_cloud_shell, gain),
    NUMBER(nebel_cloud_shell, coverage),
    END_OF_KEYS,
};

static const nb_key_entry air_shell_places[] = {
    NUMBER(nebel_atmosphere_shell, height),
    NUMBER(nebel_atmosphere_shell, brightness),
    END_OF_KEYS,
};

/* ---- in the file's numbers ------------------------------------------------------------------- */

static void restore_air(const nb_file_units *space, nebel_atmosphere_component *air)
{
    for (int c = 0; c < 3; c++) {
        air->scattering[c] *= space->unit;
        air->absorption[c] *= space->unit;
    }
    air->scale_height /= space->unit;
    air->center_height /= space->unit;
    air->half_width /= space->unit;
}

/* With the numbers of its kind in the place of zeros, which mean others in the file. */
static void restore_cloud(const nb_file_units *space, double thickness, nebel_cloud_layer *layer)
{
    (void)nebel_resolve_cloud_layer(thickness, layer, NULL, layer);
    layer->base /= space->unit;
    layer->top /= space->unit;
    layer->cell_size /= space->unit;
    layer->extinction *= space->unit;
    if (layer->erosion == NEBEL_ZERO) layer->erosion = 0;
    if (layer->patchiness == NEBEL_ZERO) layer->patchiness = 0;
    for (int i = 0; i < 2; i++) layer->wind[i] /= i == 1 && space->z_up ? -space->unit : space->unit;
}

static void restore_layers(const nb_file_units *space, nebel_textured_planet_desc *desc)
{
    nebel_atmosphere_shell *air = &desc->atmosphere;
    for (uint32_t i = 0; i < desc->cloud_shell_count; i++) desc->cloud_shells[i].height /= space->unit;
    air->height /= space->unit;
    if (air->is_disabled)
        air->brightness = 0;
    else if (air->brightness == 0)
        air->brightness = 1;
}

static nebel_planet restore(const nb_file_units *space, const nebel_planet *planet)
{
    nebel_planet own = *planet;
    if (own.model == NEBEL_PLANET_TEXTURED) {
        restore_layers(space, &own.textured_desc);
        return own;
    }
    for (uint32_t i = 0; i < own.atmosphere_desc.component_count; i++)
        restore_air(space, &own.atmosphere_desc.components[i]);
    for (uint32_t i = 0; i < own.cloud_layer_count; i++)
        restore_cloud(space, own.atmosphere_desc.thickness, &own.cloud_layers[i]);
    return own;
}

/* ---- kinds of air ---------------------------------------------------------------------------- */

static bool are_same_airs(const nebel_atmosphere_desc *a, const nebel_atmosphere_desc *b)
{
    for (uint32_t i = 0; i < a->component_count; i++) {
        if (!nb_key_patch_same_phase(&a->components[i].phase, &b->components[i].phase)) return false;
        for (size_t k = 0; air_places[k].key != NULL; k++)
            if (nb_place_differs(&a->components[i], &b->components[i], &air_places[k])) return false;
    }
    return true;
}

static void change_air(nb_key_patch *save, const nb_json *json, const nb_json_node *node,
                       const nebel_atmosphere_component *was, const nebel_atmosphere_component *now)
{
    const nb_json_patch_object air = nb_json_patch_find(json, node);
    const nb_json_node *phase = nb_json_patch_member(json, node, "phase");
    char text[NB_EDIT_NUMBERS];
    nb_key_patch_places(save, json, &air, air_places, air_masks[now->profile], was, now);
    if (nb_key_patch_same_phase(&was->phase, &now->phase)) return;
    nb_key_patch_write_phase(&now->phase, text);
    if (phase != NULL)
        nb_json_patch_replace(&save->edit, phase, text);
    else
        nb_json_patch_add(&save->edit, &air, "phase", text);
}

static void put_air(nb_json_writer *out, const nebel_atmosphere_component *air)
{
    char phase[NB_EDIT_NUMBERS];
    nb_key_patch_write_phase(&air->phase, phase);
    nb_json_writer_put(out, "{ \"type\": ");
    nb_json_writer_put_text(out, nb_air_profile_names[air->profile]);
    nb_json_writer_put(out, ", \"phase\": ");
    nb_json_writer_put(out, phase);
    for (size_t k = 0; air_places[k].key != NULL; k++) {
        if ((air_masks[air->profile] >> k & 1) == 0) continue;
        nb_json_writer_put(out, ", ");
        nb_json_writer_put_text(out, air_places[k].key);
        nb_json_writer_put(out, ": ");
        nb_json_writer_put_numbers(out, air_places[k].count, nb_place_numbers(air, &air_places[k]),
                                   air_places[k].style);
    }
    nb_json_writer_put(out, " }");
}

/* All of a preset's. `array`: the place of an empty one; NULL: there is none. */
static void write_airs(nb_key_patch *save, const nb_json_patch_object *planet, const nb_json_node *array,
                       const nebel_atmosphere_desc *now)
{
    nb_json_writer out = {.save = save};
    nb_json_writer_put(&out, "[");
    for (uint32_t i = 0; i < now->component_count; i++) {
        if (i > 0) nb_json_writer_put(&out, ", ");
        put_air(&out, &now->components[i]);
    }
    nb_json_writer_put(&out, "]");
    const char *words = nb_json_writer_end(&out);
    if (words != NULL && array != NULL)
        nb_json_patch_replace(&save->edit, array, words);
    else if (words != NULL)
        nb_json_patch_add(&save->edit, planet, "components", words);
    nb_release(&save->edit.arena.allocator, out.bytes.data);
}

static void save_airs(nb_key_patch *save, const nb_json *json, const nb_json_patch_object *planet,
                      const nebel_atmosphere_desc *was, const nebel_atmosphere_desc *now)
{
    const nb_json_node *array = nb_json_patch_member(json, planet->node, "components");
    if (are_same_airs(was, now)) return;
    if (array == NULL || array->count != now->component_count) {
        write_airs(save, planet, array, now);
        return;
    }
    const nb_json_node *node = nb_json_first(json, array);
    for (uint32_t i = 0; i < now->component_count; i++, node = nb_json_next(json, node))
        change_air(save, json, node, &was->components[i], &now->components[i]);
}

/* ---- clouds and shells ----------------------------------------------------------------------- */

/* Layers of no coverage are in the file alone. */
static const nb_json_node *skip_layers(const nb_json *json, const nb_json_node *node)
{
    for (; node != NULL; node = nb_json_next(json, node)) {
        const nb_json_node *coverage = nb_json_patch_member(json, node, "coverage");
        if (coverage == NULL || coverage->number != 0) break;
    }
    return node;
}

static void save_clouds(nb_key_patch *save, const nb_json *json, const nb_json_node *planet, const nebel_planet *was,
                        const nebel_planet *now)
{
    if (now->cloud_layer_count == 0) return;
    const nb_json_node *node = nb_json_first(json, nb_json_patch_member(json, planet, "clouds"));
    for (uint32_t i = 0; i < now->cloud_layer_count; i++, node = nb_json_next(json, node)) {
        node = skip_layers(json, node);
        nb_key_patch_entry(save, json, node, cloud_places, &was->cloud_layers[i], &now->cloud_layers[i]);
    }
}

static void save_shells(nb_key_patch *save, const nb_json *json, const nb_json_patch_object *planet,
                        const nebel_textured_planet_desc *was, const nebel_textured_planet_desc *now)
{
    nb_key_patch_places(save, json, planet, layers_places, NB_ALL_PLACES, was, now);
    nb_key_patch_object(save, json, planet, "atmosphere", air_shell_places, &was->atmosphere, &now->atmosphere);
    if (now->cloud_shell_count == 0) return;
    const nb_json_node *node = nb_json_first(json, nb_json_patch_member(json, planet->node, "clouds"));
    for (uint32_t i = 0; i < now->cloud_shell_count; i++, node = nb_json_next(json, node))
        nb_key_patch_entry(save, json, node, shell_places, &was->cloud_shells[i], &now->cloud_shells[i]);
}

/* ---- planets --------------------------------------------------------------------------------- */

static bool is_same_form(const nebel_planet *a, const nebel_planet *b)
{
    if (a->model != b->model || a->atmosphere_desc.component_count != b->atmosphere_desc.component_count ||
        a->cloud_layer_count != b->cloud_layer_count ||
        a->textured_desc.cloud_shell_count != b->textured_desc.cloud_shell_count)
        return false;
    for (uint32_t i = 0; i < a->atmosphere_desc.component_count; i++)
        if (a->atmosphere_desc.components[i].profile != b->atmosphere_desc.components[i].profile) return false;
    return true;
}

bool nb_key_patch_has_same_planets(const nebel_scene_data *a, const nebel_scene_data *b)
{
    if (a->planet_count != b->planet_count) return false;
    for (size_t i = 0; i < a->planet_count; i++)
        if (!is_same_form(&a->planets[i], &b->planets[i])) return false;
    return true;
}

static void save_planet(nb_key_patch *save, const nb_scene_reader *in, const nb_json_node *node, size_t index)
{
    const nb_json_patch_object planet = nb_json_patch_find(in->json, node);
    const nebel_planet was = restore(&in->space, &save->before->planets[index]),
                       now = restore(&in->space, &save->changed->planets[index]);
    if (now.model == NEBEL_PLANET_TEXTURED) {
        save_shells(save, in->json, &planet, &was.textured_desc, &now.textured_desc);
        return;
    }
    nb_key_patch_places(save, in->json, &planet, physical_places, NB_ALL_PLACES, &was, &now);
    save_airs(save, in->json, &planet, &was.atmosphere_desc, &now.atmosphere_desc);
    save_clouds(save, in->json, node, &was, &now);
}

bool nb_key_patch_planets(nb_key_patch *save, nb_scene_reader *in, const nb_json_node *node)
{
    if (!nb_key_patch_has_same_planets(save->before, &in->scene->data) ||
        !nb_key_patch_has_same_planets(save->before, save->changed))
        return nb_json_fail(in->json, NEBEL_ERROR_ARGUMENT, node,
                            "has other planets than those to be written; the file has changed, load it again");
    const bool is_array = node->type == NB_JSON_ARRAY;
    const nb_json_node *one = is_array ? nb_json_first(in->json, node) : node;
    for (size_t i = 0; i < save->before->planet_count; i++) {
        save_planet(save, in, one, i);
        if (is_array) one = nb_json_next(in->json, one);
    }
    return true;
}
