/* What the air does along the rays of clouds, which go through the middles of pixels. */
#ifndef NB_CPU_CLOUD_AIR_H
#define NB_CPU_CLOUD_AIR_H

#include "cpu_renderer.h"

/* Without an end. */
nebel_ray nb_cloud_air_ray(const nb_frame *frame, const nb_cloud_scratch *clouds, uint32_t lane);

/* Finds how clouds shade the air of the batch's pixels. */
nebel_result nb_cloud_air_shade(const nb_frame *frame, const nb_batch_place *place, nb_cloud_scratch *clouds);

/* Finds what the air does up to the nodes of all lanes that are asked, to clouds->air. */
nebel_result nb_cloud_air_find(const nb_frame *frame, const int is_asked[NB_BATCH], nb_cloud_scratch *clouds);

#endif
