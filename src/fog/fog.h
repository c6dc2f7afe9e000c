/* The editable fog behind nebel_fog. */
#ifndef NB_FOG_FOG_H
#define NB_FOG_FOG_H

#include "light/sun_lattice.h"
#include "light/point_light.h"
#include "light/environment.h"
#include "medium/volume.h"

#include <nebel/light.h>

typedef struct nb_fog_slot {
    nb_volume volume;
    size_t next_free; /* 1 + slot, 0: none */
    uint32_t generation;
    int used;
    nb_sun_lattice *lattice; /* that the last commit needed, or NULL */
} nb_fog_slot;

struct nebel_fog {
    nebel_allocator allocator;
    nebel_log log;
    nebel_environment sky; /* one owner of its map */
    nebel_sun sun;
    size_t lamp_count;
    nb_light *lamps;
    double max_opacity;
    nebel_diffusion_desc diffusion; /* cells 0: off */
    nb_fog_slot *slots;
    size_t slot_count, slot_capacity, first_free, free_count;
};

#endif
