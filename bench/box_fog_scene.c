#include "box_fog_scene.h"

const char *const nb_setting_names[NB_SETTINGS] = {"a fog bank", "fog over all", "16 boxes"};
const double nb_boxes_color[3] = {.7, .7, .5};

void nb_boxes_set(nb_setting setting, nb_boxes *boxes)
{
    const float y = setting == NB_FOG_OVER_ALL ? 13 : 3, size = setting == NB_FOG_OVER_ALL ? 51 : 45;
    boxes->count = setting == NB_FOG_IN_PATCHES ? NB_MAX_BOXES : 1;
    boxes->list[0] = (nb_old_box){{-size, -3, -size}, {size, y, size}, .05f};
    for (size_t i = 0; i < boxes->count && setting == NB_FOG_IN_PATCHES; i++) {
        const float x = (float)(i % 4) * 24 - 46, z = (float)(i / 4) * 24 - 46;
        boxes->list[i] = (nb_old_box){{x, -3, z}, {x + 20, y, z + 20}, .05f};
    }
}

nebel_snapshot *nb_boxes_commit(const nb_boxes *boxes)
{
    nebel_fog *fog = NULL;
    nebel_snapshot *snapshot = NULL;
    nebel_result result = nebel_create_fog(&(nebel_fog_desc){0}, &fog);
    for (size_t i = 0; i < boxes->count && result == NEBEL_OK; i++) {
        const nb_old_box *const box = &boxes->list[i];
        const double e = (double)box->extinction;
        const nebel_volume_desc volume = {
            .shape = {.type = NEBEL_SHAPE_BOX,
                      .min = {(double)box->low.x, (double)box->low.y, (double)box->low.z},
                      .max = {(double)box->high.x, (double)box->high.y, (double)box->high.z}},
            .extinction = {e, e, e},
            .source = {nb_boxes_color[0], nb_boxes_color[1], nb_boxes_color[2]}};
        result = nebel_add_volume(fog, &volume, NULL);
    }
    if (result == NEBEL_OK) result = nebel_commit_fog(fog, &snapshot);
    nebel_destroy_fog(fog);
    return result == NEBEL_OK ? snapshot : NULL;
}
