/* Any bytes as a file of voxels, of the size and type that the first ones say: a grid or an error with a message, and every byte
 * of memory back. */
#define _GNU_SOURCE
#include "witness.h"

#include <nebel/scene.h>

#include <stdint.h>
#include <stdio.h>
#include <sys/mman.h>
#include <unistd.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    static int memory = -1;
    char path[64];
    witness seen = {0};
    nebel_grid *grid = NULL;
    if (size < 5) return 0;
    if (memory < 0) memory = memfd_create("voxels", MFD_CLOEXEC);
    demand(memory >= 0 && ftruncate(memory, 0) == 0);
    demand(pwrite(memory, data + 5, size - 5, 0) == (ssize_t)(size - 5));
    (void)snprintf(path, sizeof path, "/proc/self/fd/%d", memory);
    const nebel_grid_file file = {.path = path,
                                  .type = (nebel_voxel_type)(data[0] % 3),
                                  .filter = (nebel_grid_filter)(data[1] % 2),
                                  .size = {data[2] % 33, data[3] % 33, data[4] % 33}};
    const nebel_scene_desc desc = {
        .host = {.allocator = {witness_allocate, witness_release, &seen}, .log = {witness_message, &seen}}};
    const nebel_result result = nebel_load_grid(&file, &desc, &grid);
    demand((result == NEBEL_OK) == (grid != NULL) && (result == NEBEL_OK) == (seen.messages == 0));
    nebel_release_grid(grid);
    demand(seen.allocations == 0);
    return 0;
}
