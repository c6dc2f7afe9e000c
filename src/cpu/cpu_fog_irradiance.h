/* Fog over which daylight changes: whose light is traced by groups, each of which is then as bright as at its place. */
#ifndef NB_CPU_CPU_FOG_IRRADIANCE_H
#define NB_CPU_CPU_FOG_IRRADIANCE_H

#include "cpu_renderer.h"

/* Lights the frame's fog by the sun above the air where it needs that, once air and clouds are set. Errors: those of
 * nebel_create_lighting. */
nebel_result nb_fog_irradiance_set(nb_frame *frame);

static inline int nb_fog_irradiance_is(const nb_air_frame *air)
{
    return air->daylit != NULL;
}

/* nebel_trace_planes, of the frame's fog. Where it is daylit, in-scattering is that of its own light, and the others are in
 * the node. */
nebel_result nb_fog_irradiance_trace(const nb_frame *frame, const nebel_ray_planes *rays, const nebel_trace_desc *trace,
                                     const nebel_transfer_planes *transfers, nb_aerial_batch_nodes *node);

/* What the sun and the sky are at the places of a node; nothing is asked where that is 0. */
void nb_fog_irradiance_light(const nb_frame *frame, const nb_ray_batch *rays, nb_aerial_batch_nodes *node);

/* Where a ray is nearest to the middle of the first planet whose air it passes, and where it enters that; 0: nowhere before
 * it, or at the start. From one to the next daylight changes one way, but in shadows of other planets. */
float nb_fog_irradiance_lowest(const nb_air_frame *air, const nb_ray_batch *rays, int lane);
float nb_fog_irradiance_enters(const nb_air_frame *air, const nb_ray_batch *rays, int lane);

#endif
