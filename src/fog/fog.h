/* The editable fog behind nebel_fog. */
#ifndef NB_FOG_FOG_H
#define NB_FOG_FOG_H

#include "medium/volume.h"

typedef struct nb_fog_slot {
    nb_volume volume;
    size_t next_free; /* 1 + slot, 0: none */
    uint32_t generation;
    int used;
} nb_fog_slot;

struct nebel_fog {
    nebel_allocator allocator;
    nebel_log log;
    double max_opacity;
    nb_fog_slot *slots;
    size_t slot_count, slot_capacity, first_free, free_count;
};

#endif
