/* Fog that is a few boxes: what the stream kernels can do. */
#ifndef NB_TRACE_BOX_FOG_H
#define NB_TRACE_BOX_FOG_H

#include "fog/snapshot.h"

#include "stream/stream_box.h"

/* The fog as at most NB_FOG_BOXES aligned boxes of constant density relative to `origin`; 0 when it is something else,
 * as where distances along the ray count or opacity is limited. */
int nb_boxes_list(const nebel_snapshot *snapshot, const double origin[3], int channel, int ignore_distances,
                  nb_fog_box *boxes);

/* 1 when the fog weakens all colours alike and every volume has the same radiance, so that what it adds is that
 * radiance times what it takes away. */
int nb_boxes_have_one_color(const nebel_lighting *lighting);

/* 1 when the fog is one volume everywhere, of constant density and of one colour in that sense. */
int nb_boxes_are_haze(const nebel_lighting *lighting);

#endif
