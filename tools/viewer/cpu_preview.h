/* The picture of the CPU beside that of OpenGL, made by a thread of its own: a few pixels at once, then more and more.
 */
#ifndef NB_TOOLS_VIEWER_CPU_PREVIEW_H
#define NB_TOOLS_VIEWER_CPU_PREVIEW_H

#include "display.h"

#include <nebel/scene.h>

typedef struct nb_cpu_preview nb_cpu_preview;

/* What should be seen. Copied; the snapshot is retained. */
typedef struct nb_preview_request {
    nebel_camera camera;
    uint32_t width, height;
    double frame; /* of what moves on without keys */
    nb_display_plane plane;
    nebel_method method;
    nebel_factor_desc factor;
    nebel_cells *cells;     /* of the methods of that name; the twin's from then on */
    nebel_light *lights;    /* by malloc; the twin's from then on */
    nebel_scene_data light; /* sun, ambient and background of it, and how many point lights there are */
    nebel_lighting *fog;
} nb_preview_request;

typedef struct nb_preview_image {
    uint32_t width, height;
    float *rgb;     /* top row first; depth is in all three */
    double seconds; /* that it took */
} nb_preview_image;

/* The meshes and textures of `scene` must outlive the twin. NULL where memory or threads are out. */
nb_cpu_preview *nb_cpu_preview_open(const nebel_scene_data *scene);

/* Waits for the thread. NULL is fine. */
void nb_cpu_preview_close(nb_cpu_preview *twin);

/* Forgets what was asked for. Until the next wish the thread does not look at the scene. NULL is fine. */
void nb_cpu_preview_rest(nb_cpu_preview *twin);

/* In place of what was asked for before. */
void nb_cpu_preview_ask(nb_cpu_preview *twin, const nb_preview_request *wish);

/* The latest picture, where there is one that was not taken yet: nonzero. It is good until the next call. */
int nb_cpu_preview_take(nb_cpu_preview *twin, nb_preview_image *picture);

/* Whether nothing better than the last picture will come. */
int nb_cpu_preview_is_done(nb_cpu_preview *twin);

#endif
