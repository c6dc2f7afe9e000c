/* Air and fog along the same rays. */
#ifndef NB_CPU_AERIAL_COMPOSE_H
#define NB_CPU_AERIAL_COMPOSE_H

#include "cpu_renderer.h"

/* Puts the air of a batch before and behind its fog: transmittance, in-scattering and error of scratch->samples, those of
 * the fog along `fog` rays, become those of both; fog NULL: there is none. scratch->distance says where rays end.
 *
 * Both let through less the farther a ray goes and add light all the way, so that between two places
 *     the integral of T_fog dS_air + T_air dS_fog
 * is within what it is with the transmittances of the one place and of the other. The mean of both is taken; what is left is
 * half of the products of their differences, and pieces are halved until all of them are within the tolerance. */
nebel_result nb_aerial_add(const nb_frame *frame, const nebel_ray_planes *fog, const nebel_trace_desc *trace,
                           nb_scratch *scratch);

/* What has been found of rays counts when the same rays are followed to other ends, until it is forgotten. */
void nb_aerial_keep(nb_scratch *scratch);
void nb_aerial_forget(nb_scratch *scratch);

#endif
