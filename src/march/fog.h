/* The editable fog behind nebel_fog. */
#ifndef NB_MARCH_FOG_H
#define NB_MARCH_FOG_H

#include "media/grid_lattice.h"
#include "media/lamp.h"
#include "media/sky.h"
#include "media/volume.h"

#include <nebel/diffusion.h>

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
