#define _POSIX_C_SOURCE 200809L

#include "fog_spare.h"

#include "fog_record.h"
#include "fog_twice.h"
#include "messages.h"

#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

static int fail_memory(void)
{
    return nb_report_failure("fog: out of memory");
}

/* ---- results in the place of what is read ---------------------------------------------------- */

/* Where something is that is read. */
typedef struct place {
    dev_t device;
    ino_t number;
    size_t item; /* whose picture it is; SIZE_MAX: it is none */
} place;

static int compare_places(const void *a, const void *b)
{
    const place *const x = a, *const y = b;
    if (x->device != y->device) return x->device < y->device ? -1 : 1;
    return x->number == y->number ? 0 : x->number < y->number ? -1 : 1;
}

/* Sorted, when all are noted. */
typedef struct places {
    place *places;
    size_t count;
} places;

/* Only files count: several may read /dev/null. */
static int find_place(const char *path, size_t item, place *found)
{
    struct stat status;
    if (path == NULL || stat(path, &status) != 0 || !S_ISREG(status.st_mode)) return 0;
    *found = (place){status.st_dev, status.st_ino, item};
    return 1;
}

static void note_place(const char *path, size_t item, places *all)
{
    all->count += (size_t)find_place(path, item, &all->places[all->count]);
}

static int note_places(const nb_fog_list *list, const char *scene, const nebel_scene_data *contents, places *all)
{
    const size_t scene_files = contents != NULL ? contents->path_count : 0;
    *all = (places){malloc((3 * list->count + scene_files + 1) * sizeof *all->places), 0};
    if (all->places == NULL) return fail_memory();
    note_place(scene, SIZE_MAX, all);
    for (size_t i = 0; i < scene_files; i++) note_place(contents->paths[i], SIZE_MAX, all);
    for (size_t i = 0; i < list->count; i++) {
        note_place(list->files[i].image, i, all);
        note_place(list->files[i].depth, SIZE_MAX, all);
        note_place(list->files[i].camera, SIZE_MAX, all);
    }
    qsort(all->places, all->count, sizeof *all->places, compare_places);
    return NB_DONE;
}

/* Whether nothing else is read from there. */
static int is_alone(const place *at, const places *all)
{
    const place *const last = all->places + all->count - 1;
    return (at == all->places || compare_places(at - 1, at) != 0) && (at == last || compare_places(at, at + 1) != 0);
}

/* Whether a result of item i must not be written. Where it is there already, and among the pictures by the same name, that one is
 * marked. */
static int is_refused(nb_fog_list *list, size_t i, const char *path, const places *all)
{
    place wanted;
    if (!find_place(path, i, &wanted)) return 0;
    const place *const at = bsearch(&wanted, all->places, all->count, sizeof *all->places, compare_places);
    if (at == NULL) return 0;
    if (at->item == SIZE_MAX || at->item == i || !is_alone(at, all)) return 1;
    nb_fog_files *const other = &list->files[at->item];
    other->is_result = strcmp(path, other->image) == 0 && nb_fog_record_is_in(path);
    return !other->is_result;
}

static void refuse(nb_fog_list *list, const places *all)
{
    for (size_t i = 0; i < list->count; i++) {
        nb_fog_files *const files = &list->files[i];
        if (is_refused(list, i, files->transmittance, all)) files->refused = files->transmittance;
        if (is_refused(list, i, files->output, all)) files->refused = files->output;
    }
}

static void remove_results(nb_fog_list *list)
{
    size_t kept = 0;
    for (size_t i = 0; i < list->count; i++) {
        if (list->files[i].is_result)
            nb_fog_names_free_one(&list->files[i]);
        else
            list->files[kept++] = list->files[i];
    }
    list->result_count = list->count - kept;
    list->count = kept;
}

/* One message where all are refused, as by a pattern that is wrong. */
static int check_refused(const nb_fog_list *list)
{
    if (list->count == 0) return nb_report_failure("fog: each picture is the result of another one; name others");
    for (size_t i = 0; i < list->count; i++)
        if (list->files[i].refused == NULL) return NB_DONE;
    return nb_report_failure("fog: " NB_FOG_REFUSAL, list->files[0].refused);
}

int nb_fog_spare(nb_fog_list *list, const char *scene, const nebel_scene_data *contents)
{
    places all;
    int status = note_places(list, scene, contents, &all);
    if (status != NB_DONE) return status;
    refuse(list, &all);
    free(all.places);
    remove_results(list);
    status = nb_fog_check_twice(list);
    return status == NB_DONE ? check_refused(list) : status;
}
