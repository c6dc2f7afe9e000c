#include "box_fog.h"

static int is_plain_box(const nb_volume *body)
{
    return !nb_volume_covers(body) && body->density.type == NEBEL_DENSITY_CONSTANT && body->step_count == 1 &&
           body->leaves[0].type == NB_LEAF_BOX && body->leaves[0].aligned;
}

int nb_boxes_list(const nebel_snapshot *snapshot, const double origin[3], int channel, int ignore_distances,
                  nb_fog_box *boxes)
{
    if (snapshot->medium_count > NB_FOG_BOXES) return 0; /* more are better asked through the tree */
    if (snapshot->max_opacity < 1) return 0;
    for (size_t i = 0; i < snapshot->medium_count; i++) {
        const nb_volume *body = &snapshot->media[i].body;
        if (!is_plain_box(body) || (nb_volume_has_distances(body) && !ignore_distances)) return 0;
        const nb_leaf *leaf = &body->leaves[0];
        for (int c = 0; c < 3; c++) {
            boxes[i].low[c] = (float)(leaf->low[c] + (leaf->origin[c] - origin[c]));
            boxes[i].high[c] = (float)(leaf->high[c] + (leaf->origin[c] - origin[c]));
        }
        boxes[i].extinction = (float)body->extinction[channel];
    }
    return 1;
}

int nb_boxes_are_haze(const nebel_lighting *lighting)
{
    const nebel_snapshot *snapshot = lighting->snapshot;
    if (snapshot->medium_count != 1 || snapshot->max_opacity < 1 || !nb_boxes_have_one_color(lighting)) return 0;
    const nb_volume *body = &snapshot->media[0].body;
    return !nb_volume_covers(body) && body->density.type == NEBEL_DENSITY_CONSTANT && body->step_count == 1 &&
           body->leaves[0].type == NB_LEAF_WORLD && !nb_volume_has_distances(body);
}

int nb_boxes_have_one_color(const nebel_lighting *lighting)
{
    const nebel_snapshot *snapshot = lighting->snapshot;
    if (lighting->scatters_sun || lighting->scatters_lights || lighting->diffusion != NULL ||
        lighting->local_diffusion != NULL)
        return 0;
    for (size_t i = 0; i < snapshot->medium_count; i++) {
        const nb_medium *medium = &snapshot->media[i];
        const nb_medium_light *lit = &lighting->media[i];
        const double *extinction = medium->body.extinction;
        if (medium->emits || lit->environment != NULL || extinction[0] != extinction[1] ||
            extinction[1] != extinction[2])
            return 0;
        for (int c = 0; c < 3; c++)
            if (lit->radiance[c] != lighting->media[0].radiance[c]) return 0;
    }
    return 1;
}
