#define _POSIX_C_SOURCE 200809L
#include "record.h"

#include <nebel/nebel.h>

#include <stdio.h>
#include <string.h>
#include <sys/stat.h>

nb_fingerprint nb_record_start(void)
{
    nb_fingerprint print = nb_fingerprint_start();
    nb_fingerprint_add_text(&print, nebel_version());
    return print;
}

void nb_record_add_file(nb_fingerprint *print, const char *path)
{
    nb_fingerprint_add_whole(print, (uint64_t)nb_fingerprint_add_file(print, path));
}

void nb_record_add_scene(nb_fingerprint *print, const char *path, const nebel_scene_data *contents)
{
    nb_record_add_file(print, path);
    for (size_t i = 0; i < contents->path_count; i++) nb_record_add_file(print, contents->paths[i]);
}

int nb_record_can_add_scene(const char *path)
{
    struct stat status;
    return stat(path, &status) == 0 && S_ISREG(status.st_mode);
}

void nb_record_write(const nb_fingerprint *print, const char *maker, char record[NEBEL_MAX_RECORD + 1])
{
    char digits[NB_FINGERPRINT_TEXT];
    nb_fingerprint_write(print, digits);
    (void)snprintf(record, NEBEL_MAX_RECORD + 1, "nebel %.32s %.32s %s", nebel_version(), maker, digits);
}

int nb_record_is_in(const char *path, const char *record)
{
    char found[NEBEL_MAX_RECORD + 1];
    (void)nebel_read_record(path, found);
    return strcmp(record, found) == 0;
}
