/* Fog over one picture, from its files to its files. */
#ifndef NB_FOG_WORK_H
#define NB_FOG_WORK_H

#include "fog_call.h"
#include "fog_record.h"
#include "messages.h"

/* What all pictures share. */
typedef struct nb_fog_shared {
    const nb_fog_call *wanted;
    const nebel_scene *scene;             /* NULL: fog of one density, made for each picture */
    const nebel_snapshot *scene_fog;      /* of pictures that have no fog of their own */
    const nebel_lighting *scene_lighting; /* of that fog */
    const nb_fingerprint *start;          /* of the records; NULL: there are none */
    int row_threads;                      /* for the rows of a picture */
    void (*hold)(int is_held);            /* called around writing files */
    void (*answer)(void *user);           /* called now and then */
    void *user;
} nb_fog_shared;

/* What there is to tell of a picture. */
typedef struct nb_fog_tale {
    size_t pixels, unknown, infinite; /* the latter two of the pixels */
    double airlight[3];               /* as the picture stores it */
    int is_kept;                      /* all was there already, and nothing was done */
    int has_replaced;                 /* all was there already, but not made from the same */
    int cannot_write;                 /* why it has failed */
} nb_fog_tale;

/* NB_DONE; or NB_FAILED with the reason in listener->kept, whose mode is KEEP. Any thread. */
int nb_fog_work(const nb_fog_shared *shared, const nb_fog_files *files, nb_report_listener *listener,
                nb_fog_tale *tale);

#endif
