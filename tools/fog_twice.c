#define _XOPEN_SOURCE 700
#include "fog_twice.h"

#include "messages.h"

#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

enum { MAX_LINKS = 8, PATH_SIZE = 4096 };

/* A result and the one name of its place. */
typedef struct result {
    const char *path;
    char *place;
} result;

/* Neighbors in the list have mostly one folder, which is not looked up again. */
typedef struct folder {
    const char *path; /* of a file in it; NULL: none yet */
    size_t size;
    char *place;
} folder;

/* folder/name; NULL: memory is out. */
static char *join(const char *before, const char *name)
{
    const size_t size = strlen(before);
    char *const path = malloc(size + strlen(name) + 2);
    if (path == NULL) return NULL;
    memcpy(path, before, size);
    path[size] = '/';
    (void)strcpy(path + size + 1, name);
    return path;
}

/* Takes the last name off; the name. "" if there is none. */
static char *cut_name(char *path)
{
    size_t size = strlen(path);
    while (size > 1 && path[size - 1] == '/') path[--size] = '\0';
    char *const slash = strrchr(path, '/');
    if (slash == NULL) return path;
    *slash = '\0';
    return slash + 1;
}

/* The one name of a folder, of which the last parts need not be there; changes the text. NULL: memory is out. */
static char *find_folder(char *path)
{
    char *const real = realpath(path[0] != '\0' ? path : ".", NULL);
    if (real != NULL) return real;
    char *const name = cut_name(path);
    if (name == path) { /* it is not there, and has no folder before it */
        char *const here = realpath(".", NULL), *const place = here != NULL ? join(here, name) : NULL;
        free(here);
        return place;
    }
    char *const parent = find_folder(path), *place = parent;
    if (parent != NULL && strcmp(name, "..") == 0) {
        (void)cut_name(parent);
    } else if (parent != NULL && name[0] != '\0' && strcmp(name, ".") != 0) {
        place = join(parent, name);
        free(parent);
    }
    return place;
}

/* The folder of a file, looked up unless it is the last one; NULL: memory is out. */
static const char *folder_of(const char *path, const char *slash, folder *last)
{
    const size_t size = slash == NULL ? 0 : slash == path ? 1 : (size_t)(slash - path);
    if (last->path != NULL && last->size == size && strncmp(last->path, path, size) == 0) return last->place;
    char *const text = strndup(path, size);
    free(last->place);
    *last = (folder){path, size, text != NULL ? find_folder(text) : NULL};
    free(text);
    return last->place;
}

/* What a link says, seen from its own folder; NULL: memory is out, or the link has gone. */
static char *read_link(const char *path, size_t size)
{
    char *const target = calloc(size + 1, 1);
    const char *const slash = strrchr(path, '/');
    if (target == NULL || readlink(path, target, size) <= 0) {
        free(target);
        return NULL;
    }
    if (target[0] == '/' || slash == NULL) return target;
    char *const before = strndup(path, (size_t)(slash - path));
    char *const next = before != NULL ? join(before, target) : NULL;
    free(before);
    free(target);
    return next;
}

static char *find_place(const char *path, int links, folder *last);

static char *follow(const char *path, int links)
{
    folder last = {0};
    char *const place = find_place(path, links, &last);
    free(last.place);
    return place;
}

/* NULL: memory is out. Of links that lead to nothing some are followed. */
static char *find_place(const char *path, int links, folder *last)
{
    struct stat status;
    const char *const slash = strrchr(path, '/');
    if (links > 0 && lstat(path, &status) == 0 && S_ISLNK(status.st_mode)) {
        char *const real = realpath(path, NULL), *const next = real == NULL ? read_link(path, PATH_SIZE) : NULL;
        char *const place = next != NULL ? follow(next, links - 1) : real;
        free(next);
        if (place != NULL) return place;
    }
    const char *const before = folder_of(path, slash, last);
    return before != NULL ? join(before, slash != NULL ? slash + 1 : path) : NULL;
}

static int compare_results(const void *a, const void *b)
{
    return strcmp(((const result *)a)->place, ((const result *)b)->place);
}

static int fail_twice(const result *a, const result *b)
{
    static const char advice[] = "put a * where the pictures' names differ";
    if (strcmp(a->path, b->path) == 0)
        return nb_report_misuse("fog", "fog: --output: '%s' would be written twice; %s", a->path, advice);
    return nb_report_misuse("fog", "fog: --output: '%s' and '%s' are one file, which would be written twice; %s",
                            a->path, b->path, advice);
}

static int compare_all(result *results, size_t count)
{
    qsort(results, count, sizeof *results, compare_results);
    for (size_t i = 1; i < count; i++)
        if (compare_results(&results[i - 1], &results[i]) == 0 && strcmp(results[i].path, "/dev/null") != 0)
            return fail_twice(&results[i - 1], &results[i]);
    return NB_DONE;
}

int nb_fog_check_twice(const nb_fog_list *list)
{
    folder last = {0};
    result *const results = malloc((2 * list->count + 1) * sizeof *results);
    size_t count = 0;
    int good = results != NULL;
    for (size_t i = 0; i < 2 * list->count && good; i++) {
        const nb_fog_files *const files = &list->files[i / 2];
        const char *const path = i % 2 == 0 ? files->output : files->transmittance;
        if (path == NULL) continue;
        results[count] = (result){path, find_place(path, MAX_LINKS, &last)};
        good = results[count++].place != NULL;
    }
    const int status = good ? compare_all(results, count) : nb_report_failure("fog: out of memory");
    for (size_t i = 0; i < count; i++) free(results[i].place);
    free(results);
    free(last.place);
    return status;
}
