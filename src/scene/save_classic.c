/* Changed classic fog, back into the section of that name. */
#include "key_patch.h"

#include <math.h>
#include <string.h>

/* ---- fog factors ----------------------------------------------------------------------------- */

#define FACTOR_PLACE(member, count, style)                                                                             \
    {                                                                                                                  \
#member, offsetof(nebel_factor_desc, member), count, style                                                     \
    }

static const nb_key_entry factor_places[] = {
    FACTOR_PLACE(start, 1, NB_EDIT_EACH),   FACTOR_PLACE(end, 1, NB_EDIT_EACH), FACTOR_PLACE(density, 1, NB_EDIT_EACH),
    FACTOR_PLACE(color, 3, NB_EDIT_AMOUNT), {NULL, 0, 0, NB_EDIT_EACH},
};

static nebel_factor_desc restore_factor(const nb_file_units *space, const nebel_factor_desc *factor)
{
    nebel_factor_desc own = *factor;
    if (own.coordinate == NEBEL_COORDINATE_USER) return own;
    own.start /= space->unit;
    own.end /= space->unit;
    own.density *= space->unit;
    return own;
}

static void save_factor(nb_key_patch *save, const nb_scene_reader *in, const nb_json_patch_object *section)
{
    nebel_factor_desc was = restore_factor(&in->space, save->before->classic);
    const nebel_factor_desc now = restore_factor(&in->space, save->changed->classic);
    /* Numbers with another unit are others, and those that are missing, too. */
    if ((was.coordinate == NEBEL_COORDINATE_USER) != (now.coordinate == NEBEL_COORDINATE_USER))
        was.start = was.end = was.density = HUGE_VAL;
    nb_key_patch_places(save, in->json, section, factor_places, NB_ALL_PLACES, &was, &now);
    if (was.coordinate != now.coordinate)
        nb_json_patch_word(&save->edit, in->json, section, "coordinate", nb_coordinate_names[now.coordinate]);
    if (was.stage != now.stage) nb_json_patch_word(&save->edit, in->json, section, "stage", nb_stage_names[now.stage]);
}

static void put_factor(nb_json_writer *out, const nebel_factor_desc *own)
{
    for (size_t i = 0; factor_places[i].key != NULL; i++) {
        nb_json_writer_put_text(out, factor_places[i].key);
        nb_json_writer_put(out, ": ");
        nb_json_writer_put_numbers(out, factor_places[i].count, nb_place_numbers(own, &factor_places[i]),
                                   factor_places[i].style);
        nb_json_writer_put(out, ", ");
    }
    nb_json_writer_put(out, "\"coordinate\": ");
    nb_json_writer_put_text(out, nb_coordinate_names[own->coordinate]);
    nb_json_writer_put(out, ", \"stage\": ");
    nb_json_writer_put_text(out, nb_stage_names[own->stage]);
}

/* ---- response curves ------------------------------------------------------------------------- */

static void put_table(nb_json_writer *out, const float *table)
{
    for (size_t i = 0; i < NEBEL_CURVE_ENTRIES; i++) {
        const double weight = (double)table[i];
        nb_json_writer_put(out, i == 0 ? "[" : ", ");
        nb_json_writer_put_numbers(out, 1, &weight, NB_EDIT_EACH);
    }
    nb_json_writer_put(out, "]");
}

static int has_same_curve(const nebel_scene_data *a, const nebel_scene_data *b)
{
    return a->classic_curve == b->classic_curve &&
           (a->classic_curve != NEBEL_CURVE_TABLE ||
            memcmp(a->classic_table, b->classic_table, NEBEL_CURVE_ENTRIES * sizeof(float)) == 0);
}

/* ---- Direct3D 9 ------------------------------------------------------------------------------ */

static void put_number(nb_json_writer *out, const char *key, double number)
{
    nb_json_writer_put(out, ", ");
    nb_json_writer_put_text(out, key);
    nb_json_writer_put(out, ": ");
    nb_json_writer_put_numbers(out, 1, &number, NB_EDIT_EACH);
}

static void put_d3d9(nb_json_writer *out, const nb_file_units *space, const nebel_scene_data *scene)
{
    const nebel_d3d9_fog *const d3d9 = scene->classic_d3d9;
    const double unit = nb_device_unit(scene, d3d9, space->unit);
    double color[3];
    nebel_get_d3d9_color(d3d9, color);
    nb_json_writer_put(out, "{ \"fog_vertex_mode\": ");
    nb_json_writer_put_text(out, nb_d3d9_mode_names[d3d9->fog_vertex_mode]);
    nb_json_writer_put(out, ", \"fog_table_mode\": ");
    nb_json_writer_put_text(out, nb_d3d9_mode_names[d3d9->fog_table_mode]);
    put_number(out, "fog_start", (double)d3d9->fog_start / unit);
    put_number(out, "fog_end", (double)d3d9->fog_end / unit);
    put_number(out, "fog_density", (double)d3d9->fog_density * unit);
    nb_json_writer_put(out, ", \"fog_color\": ");
    nb_json_writer_put_numbers(out, 3, color, NB_EDIT_AMOUNT);
    if (scene->classic_z_near != 0 || (scene->classic_z_far != 0 && scene->classic_z_far != 1000)) {
        put_number(out, "z_near", scene->classic_z_near / space->unit);
        put_number(out, "z_far", scene->classic_z_far / space->unit);
    }
    nb_json_writer_put(out, d3d9->range_fog_enable != 0 ? ", \"range_fog_enable\": true }"
                                                        : ", \"range_fog_enable\": false }");
}

static int has_same_d3d9(const nebel_scene_data *a, const nebel_scene_data *b)
{
    const nebel_d3d9_fog *x = a->classic_d3d9, *y = b->classic_d3d9;
    const int same = x == y || (x != NULL && y != NULL && memcmp(x, y, sizeof *x) == 0);
    return same && a->classic_z_near == b->classic_z_near && a->classic_z_far == b->classic_z_far;
}

/* ---- the section ----------------------------------------------------------------------------- */

static void set_member(nb_key_patch *save, const nb_json *json, const nb_json_patch_object *section, const char *key,
                       nb_json_writer *value)
{
    const nb_json_node *node = nb_json_patch_member(json, section->node, key);
    const char *words = nb_json_writer_end(value);
    if (words != NULL && node != NULL) nb_json_patch_replace(&save->edit, node, words);
    if (words != NULL && node == NULL) nb_json_patch_add(&save->edit, section, key, words);
    nb_release(&save->edit.arena.allocator, value->bytes.data);
}

/* A new curve, and whether there is a table, which excludes the other key. */
static void save_curve(nb_key_patch *save, const nb_json *json, const nb_json_patch_object *section,
                       nb_removed_keys *lost)
{
    const nebel_scene_data *now = save->changed;
    nb_json_writer words = {.save = save};
    if (has_same_curve(save->before, now)) return;
    nb_key_patch_lose(lost, now->classic_curve == NEBEL_CURVE_TABLE ? "curve" : "table");
    if (now->classic_curve != NEBEL_CURVE_TABLE) {
        nb_json_patch_word(&save->edit, json, section, "curve", nb_curve_names[now->classic_curve]);
        return;
    }
    put_table(&words, now->classic_table);
    set_member(save, json, section, "table", &words);
}

static void save_d3d9(nb_key_patch *save, const nb_scene_reader *in, const nb_json_patch_object *section,
                      nb_removed_keys *lost)
{
    nb_json_writer words = {.save = save};
    if (has_same_d3d9(save->before, save->changed)) return;
    if (save->changed->classic_d3d9 == NULL) {
        nb_key_patch_lose(lost, "d3d9");
        return;
    }
    put_d3d9(&words, &in->space, save->changed);
    set_member(save, in->json, section, "d3d9", &words);
}

/* All of it, where there was nothing to be changed. */
static void put_section(nb_json_writer *out, const nb_file_units *space, const nebel_scene_data *now)
{
    const nebel_factor_desc own = restore_factor(space, now->classic);
    nb_json_writer_put(out, "{ ");
    put_factor(out, &own);
    if (now->classic_curve == NEBEL_CURVE_TABLE) {
        nb_json_writer_put(out, ", \"table\": ");
        put_table(out, now->classic_table);
    } else if (now->classic_curve != NEBEL_CURVE_PHYSICAL) {
        nb_json_writer_put(out, ", \"curve\": ");
        nb_json_writer_put_text(out, nb_curve_names[now->classic_curve]);
    }
    if (now->classic_d3d9 != NULL) {
        nb_json_writer_put(out, ", \"d3d9\": ");
        put_d3d9(out, space, now);
    }
    nb_json_writer_put(out, " }");
}

void nb_key_patch_classic(nb_key_patch *save, const nb_scene_reader *in, const nb_json_node *node)
{
    const nb_json_patch_object section = nb_json_patch_find(in->json, node);
    nb_removed_keys lost = {{NULL}};
    if (section.last_end == 0) {
        nb_json_writer words = {.save = save};
        put_section(&words, &in->space, save->changed);
        const char *text = nb_json_writer_end(&words);
        if (text != NULL) nb_json_patch_replace(&save->edit, node, text);
        nb_release(&save->edit.arena.allocator, words.bytes.data);
        return;
    }
    save_factor(save, in, &section);
    save_curve(save, in->json, &section, &lost);
    save_d3d9(save, in, &section, &lost);
    nb_json_patch_remove_members(&save->edit, in->json, node, lost.names);
}

void nb_key_patch_add_classic(nb_key_patch *save, const nb_file_units *space)
{
    nb_json_writer words = {.save = save};
    put_section(&words, space, save->changed);
    const char *text = nb_json_writer_end(&words);
    if (text != NULL) nb_json_patch_add(&save->edit, &save->root, "classic", text);
    nb_release(&save->edit.arena.allocator, words.bytes.data);
}
