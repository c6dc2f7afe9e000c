#define _GNU_SOURCE
/* Where a model is read, and which folder its references may not leave. */
#include "model.h"
#include "model_budget.h"
#include "file/path.h"

#include <errno.h>
#include <limits.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

static nebel_result fail_load_memory(const nb_model_load *load)
{
    return nb_model_fail(load, NEBEL_ERROR_MEMORY, "out of memory");
}

static bool find_real_path(const char *folder, char real[PATH_MAX])
{
    return realpath(folder[0] != '\0' ? folder : ".", real) != NULL;
}

/* The file seen from a folder above it. */
static nebel_result find_name(const nb_model_load *load, nb_arena *scratch, const char *own, nb_model_load *placed)
{
    char outer[PATH_MAX], inner[PATH_MAX];
    const char *file = load->source->file, *name = nb_path_name(file);
    if (!find_real_path(load->folder, outer) || !find_real_path(own, inner))
        return nb_model_fail(load, NEBEL_ERROR_FILE, "cannot open the folder \"%s\" of the model \"%s\": %s",
                             load->folder, file, strerror(errno));
    size_t size = strlen(outer);
    while (size > 0 && outer[size - 1] == '/') size--;
    if (strncmp(outer, inner, size) != 0 || (inner[size] != '/' && inner[size] != '\0'))
        return nb_model_fail(load, NEBEL_ERROR_FORMAT,
                             "the folder \"%s\" does not hold the model \"%s\"; name one that does", load->folder,
                             file);
    const char *rest = inner[size] == '/' ? inner + size + 1 : inner + size;
    if (rest[0] == '\0') {
        placed->name = name;
        return NEBEL_OK;
    }
    const size_t length = strlen(rest);
    char *below = nb_arena_allocate(scratch, length + 2, 1);
    if (below == NULL) return fail_load_memory(load);
    memcpy(below, rest, length);
    below[length] = '/';
    placed->name = nb_path_join(scratch, below, name);
    return placed->name != NULL ? NEBEL_OK : fail_load_memory(load);
}

static nebel_result place(nb_model_load *load, nb_arena *scratch)
{
    const char *file = load->source->file, *own = nb_path_folder(scratch, file);
    if (own == NULL) return fail_load_memory(load);
    load->folder = load->source->folder != NULL ? load->source->folder : own;
    load->name = nb_path_name(file);
    return load->source->folder != NULL ? find_name(load, scratch, own, load) : NEBEL_OK;
}

static nebel_result read_model_file(const nb_model_load *load)
{
    nb_arena scratch = {.allocator = load->allocator};
    nb_model_load placed = *load;
    nebel_result result = nb_file_check(&load->log, load->source->where, "model", load->source->file);
    if (result == NEBEL_OK) result = place(&placed, &scratch);
    if (result == NEBEL_OK) result = load->reader.in_process ? nb_assimp_load(&placed) : nb_model_process_read(&placed);
    nb_arena_release(&scratch);
    return result;
}

/* One after the other models could take any time, each within its own limit. */
nebel_result nb_model_read(const nb_model_load *load)
{
    const double begin = nb_budget_now();
    if (load->seconds != NULL && *load->seconds >= load->most_seconds && !NB_SANITIZED)
        return nb_model_fail(
            load, NEBEL_ERROR_LIMIT,
            "the model \"%s\" is not read any more: the scene has taken %.0f s of preparation, the most "
            "with its memory (nebel: --memory)",
            load->source->file, *load->seconds);
    const nebel_result result = load->source->is_heightfield ? nb_heightfield_load(load) : read_model_file(load);
    if (load->seconds != NULL) *load->seconds += nb_budget_now() - begin;
    return result;
}
