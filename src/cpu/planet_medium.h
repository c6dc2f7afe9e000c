/* The air and clouds of a planet as the reference renderer asks for them: what is at a place, and how much there may be on
 * a piece of a ray. Densities come from the description, those of clouds from nebel_compute_cloud_extinction. */
#ifndef NB_CPU_PLANET_MEDIUM_H
#define NB_CPU_PLANET_MEDIUM_H

#include "aerial/planets.h"

#include <nebel/planet.h>

enum { NB_TURNS = 1024 };

/* A phase function for sampling: between two neighboring cosines all are drawn alike, each pair as often as another. */
typedef struct nb_turns {
    nebel_phase phase;
    const nebel_clouds *clouds; /* NULL: phase; else that of a color of a layer of clouds */
    uint32_t layer;
    int color;
    int is_peaked;                /* light goes on nearly straight far more often than elsewhere */
    double cosines[NB_TURNS + 1]; /* from -1 to 1 */
} nb_turns;

enum {
    NB_SHELLS_PER_AIR = 17,
    NB_MEDIUM_SHELLS = 2 + NEBEL_MAX_COMPONENTS * NB_SHELLS_PER_AIR + 2 * NEBEL_MAX_CLOUD_LAYERS
};

/* Spheres about the planet's center, from the ground to the top of the air. */
typedef struct nb_shells {
    int count;
    double radii[NB_MEDIUM_SHELLS];      /* m, ascending */
    double air[NB_MEDIUM_SHELLS + 1][3]; /* 1/m: most extinction of air below radii[i], above the one before it */
    double clouds[NB_MEDIUM_SHELLS + 1]; /* the same of clouds */
} nb_shells;

typedef struct nb_planet_medium {
    nb_planet world;
    double time; /* of clouds */
    nebel_cloud_layer layers[NEBEL_MAX_CLOUD_LAYERS];
    uint32_t layer_count;
    nb_shells shells, sheets;                                              /* sheets: of clouds alone */
    nb_turns airs[NEBEL_MAX_COMPONENTS], drops[NEBEL_MAX_CLOUD_LAYERS][3]; /* drops: by color */
} nb_planet_medium;

/* What is at a place. All 0 outside the air. */
typedef struct nb_planet_matter {
    const nb_planet_medium *medium;       /* NULL: outside */
    double density[NEBEL_MAX_COMPONENTS]; /* of each kind of air, 1 where its coefficients hold */
    double clouds;                        /* extinction, which is all scattering [1/m] */
    int layer;                            /* of these clouds */
} nb_planet_matter;

/* A walk along a ray from shell to shell, and what the piece that it is in holds at most. */
typedef struct nb_planet_walk {
    const nb_shells *shells;
    double lowest_t, lowest_radius; /* m: where the ray is lowest, along it and from the center */
    int below;                      /* spheres that lie below the piece */
    int is_down;                    /* the lowest place is yet to come */
    double end;                     /* m along the ray; HUGE_VAL: the rest of it is outside */
    double air[3], clouds;          /* 1/m */
} nb_planet_walk;

/* The planet has its atmosphere. */
void nb_planet_medium_set(nb_planet_medium *medium, const nebel_planet *planet, double time);

/* A place below the ground has what is on the ground. Without `with_air` clouds alone. */
nb_planet_matter nb_planet_matter_at(const nb_planet_medium *medium, const double place[3], int with_air);

/* Begins at the start of a ray of unit direction. Without `with_air` of clouds alone. */
void nb_planet_walk_start(const nb_planet_medium *medium, const nebel_ray *ray, int with_air, nb_planet_walk *walk);

/* Goes on to the piece that holds t, which is not before the one that the walk is in. */
void nb_planet_walk_to(nb_planet_walk *walk, double t);

/* Whether clouds scatter all colors alike: those of ice do. */
int nb_planet_medium_is_grey(const nb_planet_medium *medium);

/* The phase function, 1/sr. */
double nb_turns_value(const nb_turns *turns, double cosine);

/* Draws a cosine. */
double nb_turns_draw(const nb_turns *turns, double chance);

/* How densely directions are drawn there, 1/sr. */
double nb_turns_density(const nb_turns *turns, double cosine);

#endif
