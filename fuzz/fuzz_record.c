/* Any bytes as a picture or a film whose record is asked for: a text that is printable or not, but ends, and no more. */
#define _GNU_SOURCE
#include "witness.h"

#include <nebel/scene.h>

#include <stdint.h>
#include <stdio.h>
#include <string.h>
#include <sys/mman.h>
#include <unistd.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size)
{
    static int memory = -1;
    char path[64], record[NEBEL_MAX_RECORD + 1];
    if (memory < 0) memory = memfd_create("picture", MFD_CLOEXEC);
    demand(memory >= 0 && ftruncate(memory, 0) == 0);
    demand(pwrite(memory, data, size, 0) == (ssize_t)size);
    (void)snprintf(path, sizeof path, "/proc/self/fd/%d", memory);
    memset(record, 'x', sizeof record);
    demand(nebel_read_record(path, record) == NEBEL_OK);
    demand(memchr(record, '\0', sizeof record) != NULL);
    return 0;
}
