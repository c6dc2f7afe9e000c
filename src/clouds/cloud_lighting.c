/* Clouds at a moment under a sun, and what is kept of them while rays are followed. */
#include "cloud_density.h"
#include "cloud_lighting.h"

#include <math.h>

/* What a view needs that is not in the description as it is. */
static nebel_result check(const nebel_cloud_lighting_desc *desc, nebel_sun *sun, const nb_cloud_kernel **kernel)
{
    if (desc->clouds == NULL)
        return nb_fail(&desc->host.log, NEBEL_ERROR_ARGUMENT, "cloud lighting: clouds: is NULL; make some first");
    if (!nb_air_resolve_sun(&desc->sun, sun))
        return nb_fail(&desc->host.log, NEBEL_ERROR_ARGUMENT, "cloud lighting: %s", nb_air_sun_fault);
    if (!(fabs(desc->time) <= 1e12))
        return nb_fail(&desc->host.log, NEBEL_ERROR_VALUE, "clouds: time is %g; must be within -1e12 and 1e12",
                       desc->time);
    if (!(desc->tolerance >= 0 && desc->tolerance <= 1))
        return nb_fail(&desc->host.log, NEBEL_ERROR_VALUE, "clouds: tolerance is %g; must be within 0 and 1",
                       desc->tolerance);
    *kernel = nb_cloud_kernel_choose(desc->isa);
    if (*kernel == NULL)
        return nb_fail(&desc->host.log, NEBEL_ERROR_UNSUPPORTED, "clouds: instruction set %s: not available here",
                       nebel_isa_name(desc->isa));
    return NEBEL_OK;
}

/* Where layers are at a time, and how low the sun is at most where light is asked for. */
static void place_layers(nebel_cloud_lighting *view, double time)
{
    const nebel_clouds *clouds = view->clouds;
    const double ground = clouds->atmosphere->airs.radius;
    view->low = HUGE_VAL;
    for (int k = 0; k < clouds->layer_count; k++) {
        const nb_cloud_layer *layer = &clouds->layers[k];
        view->poses[k] = nb_cloud_pose_at(layer, time);
        view->low = fmin(view->low, layer->low);
        view->high = fmax(view->high, layer->high);
    }
    if (clouds->layer_count == 0) view->low = view->high = ground;
    const double ratio = fmin(1, ground / view->high);
    view->lowest_sun = -1.05 * sqrt((1 - ratio) * (1 + ratio)) - 0.2;
}

nebel_result nebel_create_cloud_lighting(const nebel_cloud_lighting_desc *desc, nebel_cloud_lighting **view)
{
    nebel_sun sun;
    const nb_cloud_kernel *kernel;
    if (view == NULL) return NEBEL_ERROR_ARGUMENT;
    *view = NULL;
    if (desc == NULL || !nb_allocator_is_valid(&desc->host.allocator)) return NEBEL_ERROR_ARGUMENT;
    nebel_result result = check(desc, &sun, &kernel);
    if (result != NEBEL_OK) return result;
    const nebel_allocator allocator = nb_resolve_allocator(&desc->host.allocator);
    nebel_cloud_lighting *made = nb_allocate_zero(&allocator, 1, sizeof *made);
    if (made == NULL) return nb_fail(&desc->host.log, NEBEL_ERROR_MEMORY, "clouds: out of memory");
    made->allocator = allocator;
    made->log = desc->host.log;
    made->clouds = desc->clouds;
    made->kernel = kernel;
    made->sun = sun;
    made->tolerance = fmax(1e-6, desc->tolerance > 0 ? desc->tolerance : NEBEL_DEFAULT_TOLERANCE);
    place_layers(made, desc->time);
    result = nb_cloud_light_make(made);
    if (result == NEBEL_OK) {
        *view = made;
        return NEBEL_OK;
    }
    nebel_destroy_cloud_lighting(made);
    return nb_fail(&desc->host.log, result, "clouds: out of memory");
}

void nebel_destroy_cloud_lighting(nebel_cloud_lighting *view)
{
    if (view == NULL) return;
    const nebel_allocator allocator = view->allocator;
    nb_release(&allocator, view->lights);
    nb_release(&allocator, view);
}

nebel_result nebel_create_cloud_workspace(const nebel_cloud_lighting *view, nebel_cloud_workspace **workspace)
{
    if (workspace == NULL) return NEBEL_ERROR_ARGUMENT;
    *workspace = NULL;
    if (view == NULL) return NEBEL_ERROR_ARGUMENT;
    nebel_cloud_workspace *made = nb_allocate_zero(&view->allocator, 1, sizeof *made);
    if (made == NULL) return nb_fail(&view->log, NEBEL_ERROR_MEMORY, "clouds: workspace: out of memory");
    made->view = view;
    made->blocks = nb_allocate_zero(&view->allocator, NB_CLOUD_BLOCKS, sizeof *made->blocks);
    made->points = nb_allocate_zero(&view->allocator, NB_CLOUD_POINTS, sizeof *made->points);
    made->patches = nb_allocate_zero(&view->allocator, NB_CLOUD_PATCHES, sizeof *made->patches);
    if (view->clouds->layer_count > 0)
        made->prefilters =
            nb_allocate_zero(&view->allocator, (size_t)view->clouds->layer_count, sizeof *made->prefilters);
    int is_whole = made->blocks != NULL && made->points != NULL && made->patches != NULL &&
                   (made->prefilters != NULL || view->clouds->layer_count == 0);
    for (int i = 0; i < NB_CLOUD_ROOFS + view->clouds->layer_count; i++) {
        nb_cloud_lattice *lattice = &made->lattices[i];
        lattice->nodes = nb_allocate_zero(&view->allocator, NB_CLOUD_NODES, sizeof *lattice->nodes);
        lattice->cells = nb_allocate_zero(&view->allocator, NB_CLOUD_CELLS, sizeof *lattice->cells);
        is_whole = is_whole && lattice->nodes != NULL && lattice->cells != NULL;
    }
    if (is_whole) {
        *workspace = made;
        return NEBEL_OK;
    }
    nebel_destroy_cloud_workspace(made);
    return nb_fail(&view->log, NEBEL_ERROR_MEMORY, "clouds: workspace: out of memory");
}

void nebel_destroy_cloud_workspace(nebel_cloud_workspace *workspace)
{
    if (workspace == NULL) return;
    const nebel_allocator allocator = workspace->view->allocator;
    for (int i = 0; i < NB_CLOUD_WAYS; i++) {
        nb_release(&allocator, workspace->lattices[i].nodes);
        nb_release(&allocator, workspace->lattices[i].cells);
    }
    nb_release(&allocator, workspace->points);
    nb_release(&allocator, workspace->patches);
    nb_release(&allocator, workspace->blocks);
    nb_release(&allocator, workspace->prefilters);
    nb_release(&allocator, workspace);
}
