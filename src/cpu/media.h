/* All that scatters light in a scene, for the reference renderer: fog, and the air and clouds of planets. */
#ifndef NB_CPU_MEDIA_H
#define NB_CPU_MEDIA_H

#include "planet_medium.h"

#include "base/base.h"

#include <nebel/nebel.h>

typedef struct nb_media {
    const nebel_snapshot *fog;       /* NULL: none */
    const nb_planet_medium *planets; /* whose air does not overlap */
    int planet_count;
} nb_media;

/* Which media count. */
typedef enum nb_media_part { NB_MEDIA_ALL, NB_MEDIA_WITHOUT_AIR } nb_media_part;

/* What is at a place. */
typedef struct nb_matter {
    nebel_medium_properties all; /* of all media together */
    double fog[3];               /* 1/m: what fog scatters */
    nb_planet_matter planet;
} nb_matter;

/* A walk along a ray from piece to piece, for tracking. */
typedef struct nb_media_walk {
    const nb_media *media;
    const nebel_ray *ray;
    int ignore_distances;
    nebel_majorant_segment fog;
    nb_planet_walk planets[NEBEL_MAX_PLANETS];
    double end;           /* m along the ray, of the piece */
    double extinction[3]; /* 1/m: no place of the piece has more */
    double emission[3];   /* as nebel_majorant_segment */
    int is_air;           /* nothing but air is in it */
} nb_media_walk;

/* What scatters at a place, one of several media. */
typedef struct nb_scatterer {
    nebel_phase phase;     /* where there are no turns */
    const nb_turns *turns; /* NULL: directions are drawn by nebel_sample_phase */
    double scattering[3];  /* 1/m */
    double probability;    /* of the choice; 0: nothing scatters there */
} nb_scatterer;

int nb_media_are_empty(const nb_media *media);

/* Whether all channels have the same extinction everywhere. */
int nb_media_are_grey(const nb_media *media);

/* Errors of these: as nebel_sample_medium, nebel_next_majorant and nebel_sample_scatterer. */
nebel_result nb_media_look(const nb_media *media, const nebel_sample_point *place, nb_media_part part,
                           nb_matter *matter);

/* Begins along a ray, which must outlive the walk; no piece is known yet. Then goes on to the piece that holds t, which is no
 * less than before. */
void nb_media_walk_start(const nb_media *media, const nebel_ray *ray, int ignore_distances, nb_media_part part,
                         nb_media_walk *walk);
nebel_result nb_media_walk_to(nb_media_walk *walk, double t);

/* One of the media at a place, the more often the more it scatters of the channel, -1: of all. */
nebel_result nb_media_choose(const nb_media *media, const nebel_sample_point *place, const nb_matter *matter,
                             int channel, double chance, nb_scatterer *scatterer);

/* Its phase function, 1/sr: of the channel by which it was chosen. */
double nb_scatterer_value(const nb_scatterer *scatterer, double cosine);

/* What the air of all planets leaves of light along a ray up to its t_max: the closed form of nebel_trace_atmosphere. */
double nb_media_air_transmittance(const nb_media *media, const nebel_ray *ray, int channel);

/* ---- grounds --------------------------------------------------------------------------------- */

/* Where a ray meets the ground of a planet. */
typedef struct nb_ground_hit {
    const nb_planet *world; /* NULL: it meets none up to its t_max */
    double t;               /* m; 0 from the ground or below it downwards */
    double normal[3];
    double place[3]; /* just above the ground, where rays go on */
} nb_ground_hit;

nb_ground_hit nb_media_find_ground(const nb_media *media, const nebel_ray *ray);

/* What planets leave of the sun at a place: 0 in the shadow of the nearest one, else what others leave of the disc. */
double nb_media_sun_left(const nb_media *media, const double place[3], const double to_sun[3], double disc);

#endif
