/* What nebel fog was asked for. */
#ifndef NB_FOG_CALL_H
#define NB_FOG_CALL_H

#include "fog_names.h"
#include "jobs.h"
#include "options.h"

#include <nebel/photograph.h>

enum { NB_FOG_OPTIONS = 24 };

/* What becomes of pixels of unknown depth. */
typedef enum nb_fog_unknown { NB_FOG_FILL = 0, NB_FOG_FAR, NB_FOG_KEEP } nb_fog_unknown;

typedef struct nb_fog_call {
    nb_fog_patterns patterns;
    nebel_depth_source depth; /* without the camera */
    int has_intrinsics;
    nebel_intrinsics intrinsics;
    double hfov;       /* degrees; 0: not given */
    const char *scene; /* NULL: fog of one density everywhere */
    int frame_of_name; /* each picture has the frame that is in its name, in place of `frame` */
    uint32_t frame;    /* of the scene */
    int has_seed;      /* each picture has noise of its own, by this and its name */
    uint32_t seed;
    double extinction;  /* 1/m */
    int has_airlight;   /* 0: it is estimated */
    double airlight[3]; /* as the picture stores it */
    int blends_stored;  /* sRGB as it stands; 0: light */
    nb_fog_unknown unknown;
    double sky; /* m, of pixels where nothing is: INFINITY, or NaN to keep them */
    nb_shard shard;
    int resume; /* results that are there already, made from the same, stay */
    int threads;
    int quiet;
} nb_fog_call;

extern const nb_option nb_fog_options[NB_FOG_OPTIONS];

/* -1 to go on, or the exit status after messages. */
int nb_fog_call_read(nb_arguments *arguments, nb_fog_call *wanted);

#endif
