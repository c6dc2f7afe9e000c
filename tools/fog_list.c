#define _POSIX_C_SOURCE 200809L
#include "fog_list.h"

#include "fingerprint.h"
#include "folder.h"
#include "messages.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* ---- shards ---------------------------------------------------------------------------------- */

/* Names that count give high halves that lie in few shards, and low halves in others: together they are spread evenly. */
static uint32_t shard_of(const char *name, uint32_t count)
{
    nb_fingerprint print = nb_fingerprint_start();
    nb_fingerprint_add_text(&print, name);
    return (uint32_t)((print.high ^ print.low) % count);
}

void nb_fog_list_keep(nb_fog_list *list, const nb_shard *shard)
{
    size_t kept = 0;
    for (size_t i = 0; i < list->count && shard->count > 0; i++) {
        nb_fog_files *const files = &list->files[i];
        if (shard_of(files->image, shard->count) == shard->number)
            list->files[kept++] = *files;
        else
            nb_fog_names_free_one(files);
    }
    if (shard->count > 0) list->count = kept;
}

/* ---- folders --------------------------------------------------------------------------------- */

static size_t folder_size(const char *path)
{
    const char *const slash = strrchr(path, '/');
    return slash != NULL ? (size_t)(slash - path) : 0;
}

/* Neighbours in the list have mostly one folder, which is not looked at again. */
static int make_folder(const char *path, const char **before)
{
    if (path == NULL) return NB_DONE;
    const size_t size = folder_size(path);
    const int is_same = *before != NULL && folder_size(*before) == size && strncmp(*before, path, size) == 0;
    *before = path;
    return is_same ? NB_DONE : nb_folder_make_for(path);
}

int nb_fog_list_make_folders(const nb_fog_list *list)
{
    const char *output = NULL, *transmittance = NULL;
    int status = NB_DONE;
    for (size_t i = 0; i < list->count && status == NB_DONE; i++) {
        status = make_folder(list->files[i].output, &output);
        if (status == NB_DONE) status = make_folder(list->files[i].transmittance, &transmittance);
    }
    return status;
}

/* ---- as bytes -------------------------------------------------------------------------------- */

/* Each name is a text, of which the first letter says whether there is one. The text behind them says which result is refused, and the
 * number. */
enum { TEXTS = NB_FOG_NAMES + 1, REST_SIZE = 16 };
static const char is_name = '+', is_none = '-', is_output = 'o', is_transmittance = 't';

static void write_rest(const nb_fog_files *files, char text[REST_SIZE])
{
    const char refused = files->refused == files->output ? is_output : is_transmittance;
    (void)snprintf(text, REST_SIZE, "%c%lu", files->refused != NULL ? refused : is_none, (unsigned long)files->number);
}

static void read_rest(const char *text, nb_fog_files *files)
{
    if (*text != is_none) files->refused = *text == is_output ? files->output : files->transmittance;
    files->number = (uint32_t)strtoul(text + 1, NULL, 10);
}

/* At most. */
static size_t count_bytes(const nb_fog_list *list)
{
    size_t size = 0;
    for (size_t i = 0; i < list->count; i++) {
        for (int k = 0; k < NB_FOG_NAMES; k++) {
            const char *const name = *nb_fog_names_of(&list->files[i], k);
            size += 2 + (name != NULL ? strlen(name) : 0);
        }
        size += REST_SIZE;
    }
    return size;
}

static char *add_text(char *at, const char *text)
{
    const size_t size = strlen(text) + 1;
    memcpy(at, text, size);
    return at + size;
}

/* NULL: memory is out. */
static char *pack(const nb_fog_list *list, size_t *size)
{
    char *const bytes = malloc(count_bytes(list) + 1), *at = bytes;
    char rest[REST_SIZE];
    for (size_t i = 0; i < list->count && bytes != NULL; i++) {
        for (int k = 0; k < NB_FOG_NAMES; k++) {
            const char *const name = *nb_fog_names_of(&list->files[i], k);
            *at = name != NULL ? is_name : is_none;
            at = add_text(at + 1, name != NULL ? name : "");
        }
        write_rest(&list->files[i], rest);
        at = add_text(at, rest);
    }
    *size = (size_t)(at - bytes);
    return bytes;
}

static int take_files(const char **at, nb_fog_files *files)
{
    int good = 1;
    for (int k = 0; k < NB_FOG_NAMES; k++) {
        char **const name = nb_fog_names_of(files, k);
        if (**at == is_name) *name = strdup(*at + 1);
        good = good && (*name != NULL) == (**at == is_name);
        *at += strlen(*at) + 1;
    }
    read_rest(*at, files);
    *at += strlen(*at) + 1;
    return good;
}

static int unpack(const char *bytes, size_t size, nb_fog_list *list)
{
    size_t texts = 0;
    for (size_t i = 0; i < size; i++) texts += bytes[i] == '\0';
    list->count = 0;
    list->capacity = texts / TEXTS;
    list->files = calloc(list->capacity + 1, sizeof *list->files);
    int good = list->files != NULL;
    while (good && list->count < list->capacity) good = take_files(&bytes, &list->files[list->count++]);
    return good ? NB_DONE : nb_report_failure("fog: out of memory");
}

int nb_fog_list_copy_first(const nb_jobs *jobs, int status, nb_fog_list *list)
{
    char *bytes = NULL;
    size_t size = 0;
    if (!jobs->is_joined) return status;
    if (jobs->is_chief && status == NB_DONE) {
        bytes = pack(list, &size);
        if (bytes == NULL) status = nb_report_failure("fog: out of memory");
    }
    status = nb_jobs_copy_first(jobs, status, &bytes, &size);
    if (!jobs->is_chief && status == NB_DONE) status = unpack(bytes, size, list);
    free(bytes);
    return status;
}
