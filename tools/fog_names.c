#define _POSIX_C_SOURCE 200809L

#include "fog_names.h"

#include "fog_spare.h"
#include "messages.h"

#include <dirent.h>
#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

enum { MOST_STARS = 8 };

/* What the stars of an operand stand for, in pieces of text that is somewhere else. */
typedef struct parts {
    const char *text[MOST_STARS];
    size_t size[MOST_STARS];
    int count;
} parts;

static int fail_memory(void)
{
    return nb_report_failure("fog: out of memory");
}

static int is_digit(char c)
{
    return c >= '0' && c <= '9';
}

static int count_stars(const char *text)
{
    int count = 0;
    for (; *text != '\0'; text++) count += *text == '*';
    return count;
}

/* ---- names from parts ------------------------------------------------------------------------ */

/* The stars of the pattern replaced; a pattern without any is the name. NULL: memory is out. */
static char *fill_stars(const char *pattern, const parts *of)
{
    size_t size = strlen(pattern) + 1, used = 0;
    int star = 0;
    for (int i = 0; i < of->count; i++) size += of->size[i];
    char *const name = malloc(size);
    for (; name != NULL && *pattern != '\0'; pattern++) {
        if (*pattern != '*') {
            name[used++] = *pattern;
            continue;
        }
        memcpy(name + used, of->text[star], of->size[star]);
        used += of->size[star++];
    }
    if (name != NULL) name[used] = '\0';
    return name;
}

char **nb_fog_names_of(nb_fog_files *files, int i)
{
    char **const names[NB_FOG_NAMES] = {&files->image, &files->depth, &files->output, &files->camera,
                                        &files->transmittance};
    return names[i];
}

void nb_fog_names_free_one(nb_fog_files *files)
{
    for (int i = 0; i < NB_FOG_NAMES; i++) free(*nb_fog_names_of(files, i));
}

int nb_fog_names_are_made(const nb_fog_files *files)
{
    return access(files->output, F_OK) == 0 &&
           (files->transmittance == NULL || access(files->transmittance, F_OK) == 0);
}

void nb_fog_names_free(nb_fog_list *list)
{
    for (size_t i = 0; i < list->count; i++) nb_fog_names_free_one(&list->files[i]);
    free(list->files);
    *list = (nb_fog_list){0};
}

static int grow(nb_fog_list *list)
{
    if (list->count < list->capacity) return 1;
    const size_t capacity = list->capacity > 0 ? 2 * list->capacity : 16;
    nb_fog_files *const files = realloc(list->files, capacity * sizeof *files);
    if (files == NULL) return 0;
    list->files = files;
    list->capacity = capacity;
    return 1;
}

/* The last digits of a text. */
static uint32_t find_number(const char *text, size_t size)
{
    uint32_t number = 0;
    while (size > 0 && !is_digit(text[size - 1])) size--;
    size_t first = size;
    while (first > 0 && is_digit(text[first - 1])) first--;
    if (first == size) return UINT32_MAX;
    for (; first < size && number <= NB_FOG_LAST_FRAME; first++) number = 10 * number + (uint32_t)(text[first] - '0');
    return number;
}

static int add_files(const nb_fog_patterns *patterns, const char *image, const parts *of, nb_fog_list *list)
{
    if (!grow(list)) return fail_memory();
    nb_fog_files files = {
        .image = strdup(image), .depth = fill_stars(patterns->depth, of), .output = fill_stars(patterns->output, of)};
    files.number = find_number(of->text[of->count - 1], of->size[of->count - 1]);
    if (patterns->camera != NULL) files.camera = fill_stars(patterns->camera, of);
    if (patterns->transmittance != NULL) files.transmittance = fill_stars(patterns->transmittance, of);
    const int good = files.image != NULL && files.depth != NULL && files.output != NULL &&
                     (files.camera != NULL) == (patterns->camera != NULL) &&
                     (files.transmittance != NULL) == (patterns->transmittance != NULL);
    if (!good) {
        nb_fog_names_free_one(&files);
        return fail_memory();
    }
    list->files[list->count++] = files;
    return NB_DONE;
}

/* Whether a name's stars are none or as many as the operand's. */
static int check_stars(const char *option, const char *pattern, int stars)
{
    const int count = pattern != NULL ? count_stars(pattern) : 0;
    if (count == 0 || count == stars) return NB_DONE;
    return nb_report_misuse("fog", "fog: --%s: '%s' has %d stars, the pictures have %d; none or as many fit", option,
                            pattern, count, stars);
}

static int check_all_stars(const nb_fog_patterns *patterns, int stars)
{
    int status = check_stars("depth", patterns->depth, stars);
    if (status == NB_DONE) status = check_stars("output", patterns->output, stars);
    if (status == NB_DONE) status = check_stars("camera", patterns->camera, stars);
    return status == NB_DONE ? check_stars("transmittance", patterns->transmittance, stars) : status;
}

/* ---- files that match ------------------------------------------------------------------------ */

/* Whether the name is as the pattern, up to its first slash or end; what its stars stand for, as short as possible, is
 * added. */
static int match(const char *pattern, const char *name, parts *of)
{
    for (; *pattern != '*'; pattern++, name++) {
        if (*pattern == '\0' || *pattern == '/') return *name == '\0';
        if (*pattern != *name) return 0;
    }
    const int star = of->count++;
    of->text[star] = name;
    for (of->size[star] = 0;; of->size[star]++) {
        of->count = star + 1;
        if (match(pattern + 1, name + of->size[star], of)) return 1;
        if (name[of->size[star]] == '\0') return 0;
    }
}

/* A folder's names that match, sorted. */
typedef struct names {
    char **names;
    size_t count, capacity;
} names;

static void free_names(names *all)
{
    for (size_t i = 0; i < all->count; i++) free(all->names[i]);
    free(all->names);
}

static int add_name(names *all, const char *name)
{
    if (all->count == all->capacity) {
        all->capacity = all->capacity > 0 ? 2 * all->capacity : 64;
        char **const grown = realloc(all->names, all->capacity * sizeof *grown);
        if (grown == NULL) return 0;
        all->names = grown;
    }
    all->names[all->count] = strdup(name);
    return all->names[all->count] != NULL && ++all->count > 0;
}

static int compare_names(const void *a, const void *b)
{
    return strcmp(*(char *const *)a, *(char *const *)b);
}

/* Hidden files match patterns that begin with a point. */
static int read_folder(const char *folder, const char *pattern, names *all)
{
    DIR *const open = opendir(folder[0] != '\0' ? folder : ".");
    if (open == NULL) return nb_report_failure("fog: cannot read the folder \"%s\": %s", folder, strerror(errno));
    int good = 1;
    int error = 0;
    for (;;) {
        parts unused = {.count = 0};
        errno = 0;
        const struct dirent *const entry = good ? readdir(open) : NULL;
        if (entry == NULL) {
            error = errno;
            break;
        }
        if ((entry->d_name[0] != '.' || pattern[0] == '.') && match(pattern, entry->d_name, &unused))
            good = add_name(all, entry->d_name);
    }
    (void)closedir(open);
    if (!good) return fail_memory();
    if (error != 0) return nb_report_failure("fog: cannot read the folder \"%s\": %s", folder, strerror(error));
    if (all->count > 0) qsort(all->names, all->count, sizeof *all->names, compare_names);
    return NB_DONE;
}

static int walk(const nb_fog_patterns *patterns, const char *before, const char *rest, const parts *of,
                nb_fog_list *list);

/* `path` followed by what is behind the first slash of the pattern; a folder when there is such a slash. */
static int enter(const nb_fog_patterns *patterns, const char *path, const char *pattern, const parts *of,
                 nb_fog_list *list)
{
    struct stat status;
    const char *const slash = strchr(pattern, '/');
    if (stat(path, &status) != 0) {
        const int is_there = slash == NULL && lstat(path, &status) == 0; /* a link to nothing: reading it says so */
        return is_there ? add_files(patterns, path, of, list) : NB_DONE;
    }
    if (slash == NULL) return S_ISDIR(status.st_mode) ? NB_DONE : add_files(patterns, path, of, list);
    return S_ISDIR(status.st_mode) ? walk(patterns, path, slash, of, list) : NB_DONE;
}

/* Adds the files that begin with `before` and go on as the pattern `rest`. */
static int walk(const nb_fog_patterns *patterns, const char *before, const char *rest, const parts *of,
                nb_fog_list *list)
{
    size_t plain = strcspn(rest, "*"), size = strlen(before);
    while (plain > 0 && rest[plain] != '\0' && rest[plain - 1] != '/') plain--;
    char *const folder = malloc(size + plain + 1);
    if (folder == NULL) return fail_memory();
    memcpy(folder, before, size);
    memcpy(folder + size, rest, plain);
    folder[size + plain] = '\0';
    if (rest[plain] == '\0') { /* no star is left */
        const int status = enter(patterns, folder, "", of, list);
        free(folder);
        return status;
    }
    names found = {0};
    int status = read_folder(folder, rest + plain, &found);
    for (size_t i = 0; i < found.count && status == NB_DONE; i++) {
        parts now = *of;
        char *const path = malloc(size + plain + strlen(found.names[i]) + 1);
        if (path == NULL || !match(rest + plain, found.names[i], &now)) {
            free(path);
            status = fail_memory();
            break;
        }
        (void)strcpy(strcpy(path, folder) + size + plain, found.names[i]);
        status = enter(patterns, path, rest + plain, &now, list);
        free(path);
    }
    free_names(&found);
    free(folder);
    return status;
}

/* One file; its stem is what a star stands for. */
static int add_one(const nb_fog_patterns *patterns, const char *image, nb_fog_list *list)
{
    const char *const slash = strrchr(image, '/'), *const name = slash != NULL ? slash + 1 : image;
    const char *const point = strrchr(name, '.');
    const parts of = {
        .text = {name}, .size = {point != NULL && point != name ? (size_t)(point - name) : strlen(name)}, .count = 1};
    const int status = check_all_stars(patterns, 1);
    return status == NB_DONE ? add_files(patterns, image, &of, list) : status;
}

static int add_operand(const nb_fog_patterns *patterns, const char *image, nb_fog_list *list)
{
    struct stat status;
    const int stars = count_stars(image);
    const size_t before = list->count;
    if (stars == 0 || stat(image, &status) == 0) return add_one(patterns, image, list);
    if (stars > MOST_STARS) return nb_report_misuse("fog", "fog: '%s' has more than %d stars", image, MOST_STARS);
    int result = check_all_stars(patterns, stars);
    if (result == NB_DONE) result = walk(patterns, "", image, &(parts){.count = 0}, list);
    if (result == NB_DONE && list->count == before) return nb_report_failure("fog: no file matches '%s'", image);
    return result;
}

/* ---- all of it ------------------------------------------------------------------------------- */

int nb_fog_names_list(const nb_fog_patterns *patterns, const char *scene, const nebel_scene_data *contents,
                      nb_fog_list *list)
{
    int status = NB_DONE;
    *list = (nb_fog_list){0};
    for (int i = 0; i < patterns->image_count && status == NB_DONE; i++)
        status = add_operand(patterns, patterns->images[i], list);
    return status == NB_DONE ? nb_fog_spare(list, scene, contents) : status;
}
