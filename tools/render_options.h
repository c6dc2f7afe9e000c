/* What `nebel render` is told on the command line. */
#ifndef NB_TOOLS_RENDER_OPTIONS_H
#define NB_TOOLS_RENDER_OPTIONS_H

#include "jobs.h"
#include "options.h"

#include <nebel/render.h>

/* What becomes of light that fog has scattered once. */
typedef enum nb_scattering_option {
    NB_SCATTERING_OF_FILE,
    NB_SCATTERING_OFF,
    NB_SCATTERING_DIFFUSION /* as the file says, or by default */
} nb_scattering_option;

typedef struct nb_render_arguments {
    const char *scene, *output;
    nebel_image_format format; /* of pictures; a film has none */
    uint32_t width, height, samples;
    uint32_t bounces, seed; /* of paths; 0 bounces: no limit */
    double exposure, tolerance;
    double shutter;                       /* how long a picture looks, in frames; 0: a moment */
    nebel_tessellation_desc tessellation; /* bound 0: the triangles of the models */
    uint32_t first_frame, last_frame;
    int many_frames, is_film, aov, quiet, gl;
    nb_shard shard;
    int resume;         /* what is there already, made from the same, stays */
    uint32_t band_rows; /* in which pictures are rendered; 0: as the job asks for */
    double fps;         /* of a film, and */
    int quality;        /* NEBEL_DEFAULT_MOVIE_QUALITY */
    nebel_method method;
    nb_scattering_option scattering;
    nebel_cpu_renderer_desc renderer;
} nb_render_arguments;

enum { NB_RENDER_OPTIONS = 26 };

extern const nb_option nb_render_options[NB_RENDER_OPTIONS];

/* Whether a method takes a fog factor; whether it gives one colour to fog. */
int nb_render_takes_factor(nebel_method method);
int nb_render_takes_color(nebel_method method);

/* -1 to go on, or the exit status after messages. */
int nb_render_call_read(nb_arguments *arguments, nb_render_arguments *call);

#endif
