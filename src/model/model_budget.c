#define _POSIX_C_SOURCE 200809L
#include "model_budget.h"

#include <time.h>

/* The most that files count together. */
static const uint64_t max_bytes = (uint64_t)1 << 36;

/* Textures are by far what grows most: a flat picture of 8192 x 8192 texels takes 256 MiB of a small file. */
static const uint64_t base_memory = (uint64_t)768 << 20, memory_per_byte = 64;

/* The slowest reader of Assimp takes 0.1 s for a megabyte. */
static const unsigned base_seconds = NB_SANITIZED ? 60 : 5, bytes_per_second = NB_SANITIZED ? 1 << 16 : 1 << 21;

/* For other programs that run at the same time, and for slow disks. */
static const unsigned spare_seconds = NB_SANITIZED ? 60 : 2;

void nb_budget_add(nb_budget *budget, const struct stat *status)
{
    const uint64_t device = (uint64_t)status->st_dev, inode = (uint64_t)status->st_ino;
    if (!S_ISREG(status->st_mode) || status->st_size <= 0 || budget->file_count == NB_BUDGET_MAX_FILES) return;
    for (size_t i = 0; i < budget->file_count; i++)
        if (budget->files[i].device == device && budget->files[i].inode == inode) return;
    budget->files[budget->file_count++] = (struct nb_budget_file){device, inode};
    const uint64_t size = (uint64_t)status->st_size, kept = (uint64_t)status->st_blocks * 512 + 4096;
    budget->bytes += size < kept ? size : kept;
    if (budget->bytes > max_bytes) budget->bytes = max_bytes;
}

uint64_t nb_budget_memory(const nb_budget *budget)
{
    const uint64_t wanted = memory_per_byte * budget->bytes, most = budget->most_memory;
    return base_memory + (most != 0 && most < wanted ? most : wanted);
}

uint64_t nb_budget_most_memory(const nb_budget *budget)
{
    return base_memory + (budget->most_memory != 0 ? budget->most_memory : memory_per_byte * max_bytes);
}

static unsigned wanted_seconds(const nb_budget *budget)
{
    return base_seconds + (unsigned)(budget->bytes / bytes_per_second);
}

bool nb_budget_is_cut(const nb_budget *budget)
{
    return budget->most_seconds != 0 && budget->most_seconds < wanted_seconds(budget);
}

unsigned nb_budget_cpu_seconds(const nb_budget *budget)
{
    return nb_budget_is_cut(budget) ? budget->most_seconds : wanted_seconds(budget);
}

unsigned nb_budget_wall_seconds(const nb_budget *budget)
{
    return nb_budget_cpu_seconds(budget) + spare_seconds;
}

double nb_budget_now(void)
{
    struct timespec time;
    clock_gettime(CLOCK_MONOTONIC, &time);
    return (double)time.tv_sec + 1e-9 * (double)time.tv_nsec;
}
