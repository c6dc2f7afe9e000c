/* How much memory and time reading a model may take: a base, and more for each byte of the files it consists of, but no more
 * than the base and what the scene may take. */
#ifndef NB_MODEL_MODEL_BUDGET_H
#define NB_MODEL_MODEL_BUDGET_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <sys/stat.h>

/* Sanitizers reserve address space without bounds and slow everything down. */
#if defined(__SANITIZE_ADDRESS__)
#define NB_SANITIZED 1
#elif defined(__has_feature)
#if __has_feature(address_sanitizer)
#define NB_SANITIZED 1
#endif
#endif
#if !defined(NB_SANITIZED)
#define NB_SANITIZED 0
#endif

/* Further files do not count. */
enum { NB_BUDGET_MAX_FILES = 1024 };

typedef struct nb_budget {
    uint64_t most_memory;  /* of the scene; 0: any */
    unsigned most_seconds; /* that are left to the scene; 0: any */
    uint64_t bytes;        /* of all files, each counted once */
    size_t file_count;
    struct nb_budget_file {
        uint64_t device, inode;
    } files[NB_BUDGET_MAX_FILES];
} nb_budget;

/* Counts a regular file, once. Holes in it, and what only pretends to be long, do not count. */
void nb_budget_add(nb_budget *budget, const struct stat *status);

uint64_t nb_budget_memory(const nb_budget *budget);       /* bytes */
uint64_t nb_budget_most_memory(const nb_budget *budget);  /* the same for files of any size */
bool nb_budget_is_cut(const nb_budget *budget);           /* the scene has less time left than the files warrant */
unsigned nb_budget_cpu_seconds(const nb_budget *budget);  /* of processor time */
unsigned nb_budget_wall_seconds(const nb_budget *budget); /* more than of processor time */

/* Seconds of a clock that is never set. */
double nb_budget_now(void);

#endif
