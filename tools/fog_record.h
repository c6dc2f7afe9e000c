/* What foggy pictures are made from. */
#ifndef NB_FOG_RECORD_H
#define NB_FOG_RECORD_H

#include "fingerprint.h"
#include "fog_call.h"

/* Of all pictures: the options, and the scene with its files (NULL: there is none). */
nb_fingerprint nb_fog_record_start(const nb_fog_call *wanted, const nebel_scene_data *contents);

/* The seed of a picture's noise, where --seed is given: by the name of the picture, without its folder, so that it does not matter
 * where pictures lie. */
uint32_t nb_fog_record_seed(const nb_fog_call *wanted, const char *image);

/* Adds what one picture is made from. */
void nb_fog_record_add(nb_fingerprint *print, const nb_fog_call *wanted, const nb_fog_files *files);

/* The records of its results. */
typedef struct nb_fog_records {
    char picture[NEBEL_MAX_RECORD + 1], transmittance[NEBEL_MAX_RECORD + 1];
} nb_fog_records;
nb_fog_records nb_fog_record_write(const nb_fingerprint *print);

/* Whether a file is a result of nebel fog, of any call. */
int nb_fog_record_is_in(const char *path);

/* What the job is, for all its processes. */
void nb_fog_record_name_job(const nb_fingerprint *start, const nb_fog_call *wanted, char name[NEBEL_MAX_RECORD + 1]);

#endif
