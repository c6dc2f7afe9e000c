/* Where the pictures of `nebel render` go: a file, numbered files, a film; and the parts of those that many processes
 * make together.
 *
 * An item of the job is a frame or, of pictures in bands, a band of rows. Every picture and film carries a record of what
 * it was made from. Parts lie in a folder of their own beside the file, FILE.parts, each with its record. The process that
 * finds all of them there joins them to the file and removes them. */
#ifndef NB_RENDER_OUT_H
#define NB_RENDER_OUT_H

#include "fingerprint.h"
#include "jobs.h"
#include "render_options.h"
#include "messages.h"

typedef struct nb_render_out {
    const nb_render_arguments *wanted;
    nb_report_listener *listener;
    uint32_t band_rows;  /* 0: pictures are rendered as a whole */
    uint32_t part_count; /* of a file; 0: files are written directly */
    nebel_movie *film;   /* that is written directly; NULL: none */
    nb_fingerprint base; /* of what all frames are made from */
    int has_base;
    int is_current; /* the file of `asked` needs no work */
    uint64_t asked; /* the group for which is_current was found out; UINT64_MAX: none */
} nb_render_out;

/* The pixels of an item. */
typedef struct nb_render_item {
    uint64_t number;
    uint32_t frame;
    nebel_window window; /* of the frame */
} nb_render_item;

nb_render_out nb_render_out_of(const nb_render_arguments *wanted, const nb_jobs *jobs, nb_report_listener *listener);

uint64_t nb_render_out_count_items(const nb_render_out *out);
uint64_t nb_render_out_group(const nb_render_out *out); /* items of a file */
nb_render_item nb_render_out_item(const nb_render_out *out, uint64_t number);

/* Before minutes of work: whether everything has a place to go to; folders are made. Messages, and NB_FAILED where not. */
int nb_render_out_check(const nb_render_out *out, const nb_jobs *jobs);

/* The same where the scene is known: nothing takes the place of what it reads. */
int nb_render_out_spare(const nb_render_out *out, const nebel_scene_data *contents);

/* Begins a film that is written directly: it sees whether it can be. */
int nb_render_out_open(nb_render_out *out);

/* Takes down what the pictures are made from, files and options. */
int nb_render_out_sign(nb_render_out *out, const nebel_scene_data *contents);

/* What the job is, for all its processes: a text of a few characters. */
void nb_render_out_name_job(const nb_render_out *out, char name[NEBEL_MAX_RECORD + 1]);

/* Whether an item is there already, made from the same; never without --resume. */
int nb_render_out_has(nb_render_out *out, const nb_render_item *item);

/* Whether something is there by the name of an item or of its file, good or not. */
int nb_render_out_is_made(const nb_render_out *out, uint64_t item);

/* Writes an item. `image` is as large as its window. */
int nb_render_out_write(nb_render_out *out, const nb_render_item *item, const nebel_image *image);

/* Joins the parts of the file of an item, where all of them are there. */
int nb_render_out_join(nb_render_out *out, const nb_render_item *item);

/* Ends a film that is written directly. */
int nb_render_out_finish(nb_render_out *out);

void nb_render_out_free(nb_render_out *out);

#endif
