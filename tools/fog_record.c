#include "fog_record.h"

#include "record.h"

#include <string.h>

static const char maker[] = "fog";

/* Whatever changes a pixel; threads do not. */
static void add_options(const nb_fog_call *wanted, nb_fingerprint *print)
{
    const nebel_intrinsics *const camera = &wanted->intrinsics;
    const uint64_t whole[] = {(uint64_t)wanted->depth.measure,
                              (uint64_t)wanted->has_intrinsics,
                              (uint64_t)(wanted->scene != NULL),
                              (uint64_t)wanted->frame_of_name,
                              wanted->frame,
                              (uint64_t)wanted->has_seed,
                              wanted->seed,
                              (uint64_t)wanted->has_airlight,
                              (uint64_t)wanted->blends_stored,
                              (uint64_t)wanted->unknown};
    const double numbers[] = {wanted->depth.scale, camera->fx,          camera->fy,         camera->cx,
                              camera->cy,          wanted->hfov,        wanted->extinction, wanted->airlight[0],
                              wanted->airlight[1], wanted->airlight[2], wanted->sky};
    for (size_t i = 0; i < sizeof whole / sizeof *whole; i++) nb_fingerprint_add_whole(print, whole[i]);
    for (size_t i = 0; i < sizeof numbers / sizeof *numbers; i++) nb_fingerprint_add_number(print, numbers[i]);
    nb_fingerprint_add_text(print, wanted->depth.format);
    nb_fingerprint_add_text(print, wanted->depth.channel != NULL ? wanted->depth.channel : "");
}

nb_fingerprint nb_fog_record_start(const nb_fog_call *wanted, const nebel_scene_data *contents)
{
    nb_fingerprint print = nb_record_start();
    nb_fingerprint_add_text(&print, "fog");
    add_options(wanted, &print);
    if (contents != NULL) nb_record_add_scene(&print, wanted->scene, contents);
    return print;
}

/* FNV-1a: Fowler, Noll and Vo. */
uint32_t nb_fog_record_seed(const nb_fog_call *wanted, const char *image)
{
    const char *const slash = strrchr(image, '/');
    uint32_t hash = 2166136261u;
    for (const char *at = slash != NULL ? slash + 1 : image; *at != '\0'; at++)
        hash = (hash ^ (unsigned char)*at) * 16777619u;
    return wanted->seed ^ hash;
}

void nb_fog_record_add(nb_fingerprint *print, const nb_fog_call *wanted, const nb_fog_files *files)
{
    nb_record_add_file(print, files->image);
    nb_record_add_file(print, files->depth);
    nb_fingerprint_add_whole(print, files->camera != NULL);
    if (files->camera != NULL) nb_record_add_file(print, files->camera);
    if (wanted->frame_of_name) nb_fingerprint_add_whole(print, files->number);
    if (wanted->has_seed) nb_fingerprint_add_whole(print, nb_fog_record_seed(wanted, files->image));
}

static void write_record(nb_fingerprint print, const char *what, char record[NEBEL_MAX_RECORD + 1])
{
    nb_fingerprint_add_text(&print, what);
    nb_record_write(&print, maker, record);
}

nb_fog_records nb_fog_record_write(const nb_fingerprint *print)
{
    nb_fog_records records;
    write_record(*print, "picture", records.picture);
    write_record(*print, "transmittance", records.transmittance);
    return records;
}

int nb_fog_record_is_in(const char *path)
{
    char record[NEBEL_MAX_RECORD + 1];
    (void)nebel_read_record(path, record);
    return strncmp(record, "nebel ", 6) == 0 && strstr(record, " fog ") != NULL;
}

void nb_fog_record_name_job(const nb_fingerprint *start, const nb_fog_call *wanted, char name[NEBEL_MAX_RECORD + 1])
{
    const nb_fog_patterns *const patterns = &wanted->patterns;
    const char *const names[] = {patterns->depth, patterns->output, patterns->camera, patterns->transmittance};
    nb_fingerprint print = *start;
    nb_fingerprint_add_whole(&print, (uint64_t)wanted->resume);
    for (int i = 0; i < patterns->image_count; i++) nb_fingerprint_add_text(&print, patterns->images[i]);
    for (size_t i = 0; i < sizeof names / sizeof *names; i++)
        nb_fingerprint_add_text(&print, names[i] != NULL ? names[i] : "");
    nb_record_write(&print, maker, name);
}
