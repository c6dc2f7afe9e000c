/* Any bytes as depth, as a camera and as a photograph: each is whole or an error with a message, and every byte of memory comes
 * back. The first two bytes choose format and measure of depth. */
#define _GNU_SOURCE
#include "witness.h"

#include <nebel/photograph.h>

#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <sys/mman.h>
#include <unistd.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

static const char *write_input(const uint8_t *data, size_t size)
{
    static int memory = -1;
    static char path[64];
    if (memory < 0) memory = memfd_create("depth", MFD_CLOEXEC);
    demand(memory >= 0 && ftruncate(memory, 0) == 0);
    demand(pwrite(memory, data, size, 0) == (ssize_t)size);
    (void)snprintf(path, sizeof path, "/proc/self/fd/%d", memory);
    return path;
}

static void check_end(const witness *seen, nebel_result result)
{
    demand((result == NEBEL_OK) == (seen->messages == 0));
    demand(seen->allocations == 0);
}

static void try_depth(const char *path, const nebel_depth_source *source)
{
    witness seen = {0};
    nebel_depth_map map;
    const nebel_host host = {.allocator = {witness_allocate, witness_release, &seen}, .log = {witness_message, &seen}};
    const nebel_result result = nebel_read_depth(path, source, &host, &map);
    demand((result == NEBEL_OK) == (map.depth != NULL));
    nebel_fill_depth(&map);
    for (size_t i = 0; result == NEBEL_OK && i < (size_t)map.width * map.height; i++) demand(map.depth[i] >= 0);
    nebel_free_depth(&host, &map);
    check_end(&seen, result);
}

static void try_camera(const char *path)
{
    witness seen = {0};
    nebel_intrinsics camera;
    const nebel_host host = {.allocator = {witness_allocate, witness_release, &seen}, .log = {witness_message, &seen}};
    const nebel_result result = nebel_read_intrinsics(path, &host, &camera);
    demand((result == NEBEL_OK) == (camera.fx > 0));
    demand(isfinite(camera.fx) && isfinite(camera.fy) && isfinite(camera.cx) && isfinite(camera.cy));
    demand(camera.baseline >= 0);
    check_end(&seen, result);
}

static void try_photograph(const char *path)
{
    witness seen = {0};
    double airlight[3] = {0};
    nebel_photograph photograph;
    const nebel_host host = {.allocator = {witness_allocate, witness_release, &seen}, .log = {witness_message, &seen}};
    nebel_result result = nebel_read_photograph(path, &host, &photograph);
    demand((result == NEBEL_OK) == (photograph.pixels != NULL));
    if (result == NEBEL_OK) result = nebel_estimate_airlight(&host, &photograph, airlight);
    for (int c = 0; c < 3; c++) demand(airlight[c] >= 0);
    nebel_free_photograph(&host, &photograph);
    check_end(&seen, result);
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    static const nebel_intrinsics pair = {800, 800, 320, 240, .2};
    if (size < 2) return 0;
    const nebel_depth_format *const format = nebel_depth_format_at(data[0] % 8);
    nebel_depth_source source = {.format = format->name, .camera = &pair};
    if (format->measure != NEBEL_MEASURE_DISPARITY) source.measure = (nebel_depth_measure)(data[1] % 5);
    if (format == nebel_depth_format_at(0)) source.scale = .001;
    const char *const path = write_input(data + 2, size - 2);
    try_depth(path, &source);
    try_camera(path);
    try_photograph(path);
    return 0;
}
