/* Fog that can be edited: slots for volumes, ids that never come back. */
#include "fog.h"

/* An id is the slot in the low half and the slot's generation in the high half, so that a stale id is recognised. */
static nebel_volume_id id_of(size_t slot, uint32_t generation)
{
    return (nebel_volume_id)generation << 32 | (uint32_t)slot;
}

static nb_fog_slot *slot_of(nebel_fog *fog, nebel_volume_id id)
{
    const size_t slot = (uint32_t)id;
    const uint32_t generation = (uint32_t)(id >> 32);
    if (slot >= fog->slot_count || !fog->slots[slot].used || fog->slots[slot].generation != generation) return NULL;
    return &fog->slots[slot];
}

static nebel_result check_opacity(const nebel_log *log, double max_opacity)
{
    if (max_opacity >= 0 && max_opacity <= 1) return NEBEL_OK;
    return nb_fail(log, NEBEL_ERROR_VALUE, "max_opacity: is %g; must be within 0 and 1", max_opacity);
}

nebel_result nebel_create_fog(const nebel_fog_desc *desc, nebel_fog **fog)
{
    if (fog == NULL) return NEBEL_ERROR_ARGUMENT;
    *fog = NULL;
    if (desc == NULL) return NEBEL_ERROR_ARGUMENT;
    if (!nb_allocator_is_valid(&desc->host.allocator))
        return nb_fail(&desc->host.log, NEBEL_ERROR_ARGUMENT, "allocator: needs allocate and release, or neither");
    const nebel_result result = check_opacity(&desc->host.log, desc->max_opacity);
    if (result != NEBEL_OK) return result;
    const nebel_allocator allocator = nb_resolve_allocator(&desc->host.allocator);
    nebel_fog *made = nb_allocate_zero(&allocator, 1, sizeof *made);
    if (made == NULL) return nb_fail(&desc->host.log, NEBEL_ERROR_MEMORY, "fog: out of memory");
    made->allocator = allocator;
    made->log = desc->host.log;
    made->max_opacity = desc->max_opacity;
    *fog = made;
    return NEBEL_OK;
}

void nebel_destroy_fog(nebel_fog *fog)
{
    if (fog == NULL) return;
    const nebel_allocator allocator = fog->allocator;
    for (size_t i = 0; i < fog->slot_count; i++)
        if (fog->slots[i].used) nb_volume_free(&allocator, &fog->slots[i].volume);
    nb_release(&allocator, fog->slots);
    nb_release(&allocator, fog);
}

/* A free slot, marked by nothing yet; NULL when memory or ids are out. */
static nb_fog_slot *take_slot(nebel_fog *fog)
{
    if (fog->free_count > 0) return &fog->slots[fog->first_free - 1];
    if (fog->slot_count >= UINT32_MAX) return NULL;
    void *slots = fog->slots;
    if (!nb_grow(&fog->allocator, &slots, sizeof *fog->slots, fog->slot_count, &fog->slot_capacity,
                 fog->slot_count + 1))
        return NULL;
    fog->slots = slots;
    fog->slots[fog->slot_count] = (nb_fog_slot){.generation = 1};
    return &fog->slots[fog->slot_count];
}

static void use_slot(nebel_fog *fog, nb_fog_slot *slot, const nb_volume *volume)
{
    if (fog->free_count > 0) {
        fog->free_count--;
        fog->first_free = slot->next_free;
    } else {
        fog->slot_count++;
    }
    slot->used = 1;
    slot->volume = *volume;
}

static nebel_result lacks_description(const nebel_fog *fog)
{
    return nb_fail(&fog->log, NEBEL_ERROR_ARGUMENT, "volume: the description must not be NULL");
}

nebel_result nebel_add_volume(nebel_fog *fog, const nebel_volume_desc *desc, nebel_volume_id *id)
{
    if (fog == NULL) return NEBEL_ERROR_ARGUMENT;
    if (desc == NULL) return lacks_description(fog);
    nb_volume volume;
    const nebel_result result = nb_volume_resolve(&fog->allocator, &fog->log, desc, &volume);
    if (result != NEBEL_OK) return result;
    nb_fog_slot *slot = take_slot(fog);
    if (slot == NULL) {
        nb_volume_free(&fog->allocator, &volume);
        return nb_fail(&fog->log, NEBEL_ERROR_MEMORY, "fog: out of memory for volume %zu", fog->slot_count);
    }
    use_slot(fog, slot, &volume);
    if (id != NULL) *id = id_of((size_t)(slot - fog->slots), slot->generation);
    return NEBEL_OK;
}

nebel_result nebel_update_volume(nebel_fog *fog, nebel_volume_id id, const nebel_volume_desc *desc)
{
    if (fog == NULL) return NEBEL_ERROR_ARGUMENT;
    if (desc == NULL) return lacks_description(fog);
    nb_fog_slot *slot = slot_of(fog, id);
    if (slot == NULL)
        return nb_fail(&fog->log, NEBEL_ERROR_ARGUMENT, "volume id %llu: no such volume", (unsigned long long)id);
    nb_volume volume;
    const nebel_result result = nb_volume_resolve(&fog->allocator, &fog->log, desc, &volume);
    if (result != NEBEL_OK) return result;
    nb_volume_free(&fog->allocator, &slot->volume);
    slot->volume = volume;
    return NEBEL_OK;
}

nebel_result nebel_remove_volume(nebel_fog *fog, nebel_volume_id id)
{
    if (fog == NULL) return NEBEL_ERROR_ARGUMENT;
    nb_fog_slot *slot = slot_of(fog, id);
    if (slot == NULL)
        return nb_fail(&fog->log, NEBEL_ERROR_ARGUMENT, "volume id %llu: no such volume", (unsigned long long)id);
    nb_volume_free(&fog->allocator, &slot->volume);
    slot->used = 0;
    if (++slot->generation == 0) return NEBEL_OK; /* this slot's ids are used up: it is never taken again */
    slot->next_free = fog->first_free;
    fog->first_free = (size_t)(slot - fog->slots) + 1;
    fog->free_count++;
    return NEBEL_OK;
}

nebel_result nebel_set_max_opacity(nebel_fog *fog, double max_opacity)
{
    if (fog == NULL) return NEBEL_ERROR_ARGUMENT;
    const nebel_result result = check_opacity(&fog->log, max_opacity);
    if (result == NEBEL_OK) fog->max_opacity = max_opacity;
    return result;
}
