/* Any bytes as a NanoVDB file: voxels or an error with a message, and every byte of memory back. */
#include "witness.h"

#include "grid_file/grid_file.h"

#include <stdint.h>
#include <stdlib.h>

static void make_grid(const nebel_allocator *allocator, const nb_voxels *voxels)
{
    nebel_grid *grid = NULL;
    nebel_grid_desc desc = {.host.allocator = *allocator, .type = voxels->type, .voxels = voxels->data};
    for (int i = 0; i < 3; i++) desc.size[i] = voxels->size[i];
    const nebel_result result = nebel_create_grid(&desc, &grid);
    if (result != NEBEL_OK && result != NEBEL_ERROR_VALUE && result != NEBEL_ERROR_MEMORY) abort();
    nebel_release_grid(grid);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    witness seen = {.max_bytes = (size_t)1 << 24};
    nb_voxels voxels = {.data = NULL};
    const nb_bytes bytes = {(unsigned char *)data, size, size};
    const nb_codec codec = {
        .allocator = {witness_allocate, witness_release, &seen}, .log = {witness_message, &seen}, .name = "fuzz.nvdb"};
    const nebel_result result = nb_nanovdb_read(&codec, &bytes, NULL, &voxels);
    if ((result == NEBEL_OK) != (voxels.data != NULL)) abort();
    if ((result == NEBEL_OK) != (seen.messages == 0)) abort();
    if (result == NEBEL_OK) make_grid(&codec.allocator, &voxels);
    nb_release(&codec.allocator, voxels.data);
    if (seen.allocations != 0) abort();
    return 0;
}
