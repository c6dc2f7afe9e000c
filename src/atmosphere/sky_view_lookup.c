/* Rays through a table of air, and the ground that they meet. */
#include "sky_view_lookup.h"
#include "sky_view.h"

#include "base/isa.h"
#include "base/isa_list.h"

/* What is told at least, as a part of the brightest light in the table: rays that are short and steep share few rows. */
#define LEAST_OFF 2e-4

#define SKY_VIEW_KERNEL(NAME, suffix) [NEBEL_ISA_##NAME] = &nb_sky_view_kernel_##suffix,
static const nb_sky_view_kernel *const sky_view_kernels[NEBEL_ISA_COUNT + 1] = {NB_ISA_LIST(SKY_VIEW_KERNEL)};

const nb_sky_view_kernel *nb_sky_view_choose(nebel_isa isa)
{
    return sky_view_kernels[nb_isa_select(isa)];
}

static nb_sky_view_table table_of(const nebel_sky_view *view)
{
    const nb_elevation_map *outlook = &view->outlook;
    nb_sky_view_table table = {.radius = outlook->radius,
                               .ground = outlook->ground,
                               .thickness = outlook->thickness,
                               .height = outlook->height,
                               .dip = outlook->dip,
                               .ratio = outlook->ratio,
                               .horizon = outlook->horizon,
                               .half_arc = outlook->half_arc,
                               .sun_cosine = view->sun_slope.cosine,
                               .sun_sine = view->sun_slope.sine,
                               .falling = NB_VIEW_FALLING,
                               .rising = NB_VIEW_RISING,
                               .columns = view->columns,
                               .levels = view->levels,
                               .size = view->size,
                               .suns = NB_VIEW_SUNS,
                               .entries = view->entries,
                               .extinction = (const double(*)[4])view->extinction,
                               .sunlight = view->sunlight,
                               .scatterer_count = view->scatterer_count,
                               .least_off = LEAST_OFF * view->brightest,
                               .scatter = &view->atmosphere->scatter};
    for (int c = 0; c < 3; c++) {
        table.up[c] = view->up[c];
        table.ahead[c] = view->ahead[c];
        table.aside[c] = view->aside[c];
        table.irradiance[c] = view->sun.irradiance[c];
    }
    for (int k = 0; k < view->scatterer_count; k++)
        table.phases[k] = &view->atmosphere->airs.airs[view->scatterers[k]].phase;
    return table;
}

static int has_directions(const double *const direction[3])
{
    return direction != NULL && direction[0] != NULL && direction[1] != NULL && direction[2] != NULL;
}

/* The kernels write whole vectors. */
static int is_packed(const nebel_transfer_planes *planes)
{
    const size_t strides[] = {planes->transmittance_stride, planes->in_scattering_stride, planes->error_stride};
    for (int i = 0; i < 3; i++)
        if (strides[i] != 0 && strides[i] != sizeof(float)) return 0;
    return 1;
}

nebel_result nebel_trace_sky_view(const nebel_sky_view *view, size_t n, const double *const direction[3],
                                  const float *t_max, const nebel_transfer_planes *transfers)
{
    if (view == NULL || !has_directions(direction) || transfers == NULL || !is_packed(transfers))
        return NEBEL_ERROR_ARGUMENT;
    const nb_sky_view_table table = table_of(view);
    const nb_sky_view_job job = {.table = &table,
                                 .count = n,
                                 .direction = {direction[0], direction[1], direction[2]},
                                 .t_max = t_max,
                                 .transfers = *transfers};
    view->look->along(&job);
    return NEBEL_OK;
}

nebel_result nebel_trace_ground(const nebel_sky_view *view, size_t n, const double *const direction[3],
                                const nebel_ground_planes *planes)
{
    if (view == NULL || !has_directions(direction) || planes == NULL) return NEBEL_ERROR_ARGUMENT;
    const nb_sky_view_table table = table_of(view);
    const nb_sky_view_job job = {
        .table = &table, .count = n, .direction = {direction[0], direction[1], direction[2]}, .ground = *planes};
    view->look->down(&job);
    return NEBEL_OK;
}
