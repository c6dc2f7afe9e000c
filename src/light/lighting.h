/* The lights of a snapshot, prepared for queries: all but what is scattered more than once (diffusion/create_lighting.c). */
#ifndef NB_LIGHT_LIGHTING_H
#define NB_LIGHT_LIGHTING_H

#include "fog/snapshot.h"
#include "light/environment.h"
#include "light/point_light.h"
#include "light/sun_lattice.h"

#include <nebel/light.h>

/* Says through the log what is not in order. Errors: ARGUMENT, VALUE. */
nebel_result nb_check_lighting(const nebel_log *log, const nebel_lighting_desc *desc);

/* Of a description that is in order; `previous` may be of any snapshot. Errors: LIMIT, which it explains; MEMORY. */
nebel_result nb_prepare_lighting(nebel_snapshot *snapshot, const nebel_lighting_desc *desc, nebel_lighting **made);

/* Frees what nb_prepare_lighting made. */
void nb_free_lighting(nebel_lighting *lighting);

/* Those of the lighting's voxels and point lights, made when the first asks. NULL where memory is out. Any thread. */
const struct nb_light_lattices *nb_light_lattices_of(const nebel_lighting *lighting);

/* Cells per metre of the way to the sun through the voxels that are the body's density. */
void nb_way_in_cells(const nebel_lighting *lighting, const nb_volume *body, double way[3]);

#endif
