/* What every renderer checks of meshes with holes. */
#ifndef NB_FRAME_MESH_CHECK_H
#define NB_FRAME_MESH_CHECK_H

#include "base/base.h"

#include <nebel/scene.h>

/* Errors: VALUE, ARGUMENT. */
static inline nebel_result nb_holes_check(const nebel_scene_data *scene, size_t number, const nebel_log *log)
{
    const nebel_mesh *mesh = &scene->meshes[number];
    if (!(mesh->alpha_cutoff >= 0 && mesh->alpha_cutoff <= 1))
        return nb_fail(log, NEBEL_ERROR_VALUE, "mesh %zu: alpha_cutoff is %g; it must be from 0 to 1", number,
                       (double)mesh->alpha_cutoff);
    if (mesh->alpha_cutoff == 0) return NEBEL_OK;
    if (mesh->mask < 0 || (size_t)mesh->mask >= scene->texture_count)
        return nb_fail(log, NEBEL_ERROR_ARGUMENT, "mesh %zu: it has an alpha_cutoff, but there is no texture %d",
                       number, (int)mesh->mask);
    if (mesh->triangle_count > 0 && mesh->uvs == NULL)
        return nb_fail(log, NEBEL_ERROR_ARGUMENT, "mesh %zu: it has a mask but no uvs to place it", number);
    return NEBEL_OK;
}

#endif
