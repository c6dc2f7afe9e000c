#define _POSIX_C_SOURCE 200809L
#include "reader.h"

#include <stdio.h>
#include <string.h>
#include <unistd.h>

enum { PATH_SIZE = 4096 };

static uint64_t most_memory;

void nb_reader_limit(uint64_t bytes)
{
    most_memory = bytes;
}

uint64_t nb_reader_memory(void)
{
    return most_memory;
}

const char *nb_reader_path(void)
{
    static const char name[] = "nebel-read-model";
    static char path[PATH_SIZE + sizeof name];
    if (path[0] != '\0') return path;
    const ssize_t size = readlink("/proc/self/exe", path, PATH_SIZE);
    if (size >= 0) path[size] = '\0';
    char *const slash = size > 0 && size < PATH_SIZE ? strrchr(path, '/') : NULL;
    if (slash != NULL) (void)snprintf(slash + 1, sizeof name, "%s", name);
    if (slash == NULL || access(path, X_OK) != 0) path[0] = '\0';
    return path[0] != '\0' ? path : NULL;
}
