/* Pictures of one scene by both renderers, their differences, and a report of them. */
#ifndef PICTURE_HELP_H
#define PICTURE_HELP_H

#include "unit.h"

#include <nebel/gl.h>
#include <nebel/render.h>

#include <stdio.h>

/* All planes, at the same pixels. */
typedef struct picture_pair {
    uint32_t width, height;
    double time;      /* of both frames; 0 at first */
    double tolerance; /* of the CPU; 1e-4 at first */
    int messages;     /* that OpenGL has logged */
    nebel_frame cpu, gl;
} picture_pair;

picture_pair picture_make(uint32_t width, uint32_t height);
void picture_free(picture_pair *pair);

/* A scene's fog in its lights, at frame 0; with its particles among it, or without them. */
nebel_lighting *picture_commit_scene(const nebel_scene *scene, int with_particles);

/* Particles for OpenGL, which the CPU has in its fog; none at first. */
typedef struct picture_particles {
    const nebel_particle *list;
    size_t count;
    nebel_lighting *others; /* the fog without them */
    int leave_sun;          /* in OpenGL: they do not dim it */
} picture_particles;

/* Renders a scene by both. particles NULL: none. */
void picture_render_particles(const nebel_scene_data *scene, nebel_lighting *fog, const picture_particles *particles,
                              const nebel_camera *camera, uint32_t samples, picture_pair *pair);
void picture_render(const nebel_scene_data *scene, nebel_lighting *fog, const nebel_camera *camera, uint32_t samples,
                    picture_pair *pair);

/* How far OpenGL is from the CPU. A pixel's difference is the largest of its transmittances, of its in-scattering as a
 * share of `source`, and of its depth as a share of the depth. */
typedef struct picture_difference {
    size_t fogged, beyond_step; /* pixels that contain fog, and those of them more than 1/255 apart */
    double largest;             /* of the pixels where no silhouette is near */
    uint32_t x, y;              /* where */
    double color;               /* root of the mean square of the colours' differences, as a share of `source` */
} picture_difference;

picture_difference picture_compare(const picture_pair *pair, double source);

/* How far apart the light is that surfaces reflect, (color - in_scattering) / transmittance, in sRGB of which the
 * brightest on the CPU is white. A border is where depth, or that light on the CPU, jumps or bends within two pixels:
 * silhouettes and edges of shadows, which in OpenGL are texels wide. */
typedef struct picture_light {
    size_t seen, apart;        /* pixels whose surface shows, and those of them more than 2/255 apart */
    size_t inner, inner_apart; /* of those off borders */
    double largest;            /* off borders */
    uint32_t x, y;             /* where */
} picture_light;

picture_light picture_compare_light(const picture_pair *pair);

/* Of pixels the share that is more than 2/255 apart as they are shown. */
double picture_shown_apart(const picture_pair *pair);

/* The largest radiance of air and fog on the CPU. */
double picture_largest_light(const picture_pair *pair);

/* Of pixels the share of which transmittance or, as a share of that radiance, in-scattering is more than 1/255 apart. */
double picture_fog_apart(const picture_pair *pair);

/* Of pixels the share of which in-scattering alone is more than so much apart. */
double picture_in_scattering_apart(const picture_pair *pair, double most);

/* Of pixels the share of which depth is more than a thousandth apart, of at least `least` metres. */
double picture_depth_apart(const picture_pair *pair, double least);

/* ---- the report: an HTML page and its pictures in the folder NEBEL_REPORT; nothing without it ---- */

typedef struct picture_report {
    const char *folder; /* NULL: none is wanted */
    FILE *page;
} picture_report;

picture_report picture_report_open(const char *title);
void picture_report_add(const picture_report *report, const char *name, const picture_pair *pair,
                        const picture_difference *difference);
void picture_report_close(picture_report *report);

#endif
