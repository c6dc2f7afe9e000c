/* The air of planets in pictures: their ground, the haze before surfaces, the sky and the sun behind everything. */
#ifndef NB_CPU_CPU_PLANETS_H
#define NB_CPU_CPU_PLANETS_H

#include "hits.h"
#include "cpu_surface.h"

#include "aerial/fog_shadow.h"
#include "frame/surface_lighting.h"
#include "aerial/planets.h"

#include <nebel/scene.h>

/* Of hits: the ground of a planet, which belongs to no mesh. */
#define NB_GROUND (NB_NONE - 1)

/* All that is the same for the rays of a frame. */
typedef struct nb_air_frame {
    const nebel_allocator *allocator;
    nb_planet worlds[NEBEL_MAX_PLANETS]; /* whatever ray leaves the camera, it passes none after a later one */
    int count;                           /* 0: none, and the rest means nothing */
    double sun_radius, sun_light[3];     /* of its disc: radians, mean radiance above the air */
    double pixel;                        /* radians, in the middle of the picture */
    int ends;                            /* rays may end before the ground */
    int has_fog;
    float tolerance;
    double reach;       /* m, from the camera: no air is beyond */
    int owns_ambient;   /* ambient light is the planet's sky */
    double to_sun[3];   /* of length 1 */
    double position[3]; /* of the camera */
    nebel_lighting
        *daylit; /* fog in the sun above the air; NULL: daylight does not change over it, and the rest means nothing */
    int is_fog_even;   /* daylight is the same all over it: that at the eye, below */
    float cloud_shade; /* part of the sun that clouds leave to fog */
    double sun_at_eye[3], sky_at_eye[3];
    nb_cloud_shadow_extent roof; /* of fog that clouds shade by its place; cloud_shade is then 1 */
} nb_air_frame;

/* Between two places of a ray, of fog that is spread evenly: what there is of the sun and of the sky; by how much either may be
 * off wherever the fog is; and by how much within pieces, which no cut mends. */
typedef struct nb_segment_shadow {
    float sun, sky, sun_doubt, sky_doubt, sun_within, sky_within;
} nb_segment_shadow;

enum { NB_AIR_NODES = 34 };

/* A place on each ray of a batch, with what lies before it. */
typedef struct nb_aerial_batch_nodes {
    float at[NB_BATCH];
    float fog_left[3][NB_BATCH], fog_light[3][NB_BATCH], air_left[3][NB_BATCH], air_light[3][NB_BATCH];
    float air_error[NB_BATCH];
    /* Of daylit fog, whose fog_light is its own: its light in the full light of the sun, in the origin's sky, and what there
     * is of both at the place. */
    float fog_sun[3][NB_BATCH], fog_sky[3][NB_BATCH], sun[3][NB_BATCH], sky[3][NB_BATCH];
    nb_segment_shadow shade[NB_BATCH]; /* of clouds, from the place before, of fog that is shaded by its place */
} nb_aerial_batch_nodes;

/* Ground that rays meet, as nebel_trace_ground says it. */
typedef struct nb_ground_batch {
    float distance[NB_BATCH]; /* INFINITY where none is seen */
    float normal[3][NB_BATCH], sun[3][NB_BATCH], sky[3][NB_BATCH];
} nb_ground_batch;

/* What a thread works in. */
typedef struct nb_cpu_planets_scratch {
    nb_ground_batch ground, next;                        /* the nearest one; that of one planet */
    int world[NB_BATCH];                                 /* whose ground it is */
    float start[3][NB_BATCH];                            /* of rays to lights, relative to the camera */
    float sun_left[3][NB_BATCH], sky_there[3][NB_BATCH]; /* of models: see nb_irradiance_at */
    nb_aerial_batch_nodes nodes[NB_AIR_NODES], fresh;    /* the first where rays end; one that is being found */
    int known[NB_BATCH];                                 /* a ray's nodes */
    uint8_t order[NB_BATCH][NB_AIR_NODES];               /* of those along it up to its end */
    int count[NB_BATCH];
    int is_kept;                       /* nodes but the first are of the rays that are followed next, too */
    nb_fog_shadow fog_shade[NB_BATCH]; /* through the middles of pixels, of fog that is shaded by its place */
} nb_cpu_planets_scratch;

/* Makes the tables for a place to look from, and those of the light on models. `to_sun`: of length 1. `ends`: whether rays
 * may end before the ground. Errors: MEMORY. */
nebel_result nb_cpu_planets_set(nb_air_frame *air, const nebel_scene_data *scene, const nebel_allocator *allocator,
                                const nebel_log *log, const double position[3], const double to_sun[3], int ends,
                                int threads);
void nb_cpu_planets_free(nb_air_frame *air);

/* Makes tables of daylight where there are none. Errors: MEMORY. */
nebel_result nb_cpu_planets_set_irradiances(nb_air_frame *air, const nebel_planet *home, const nebel_log *log);

/* Computes by these the transmittance of sunlight to a point, and the radiance of the sky there over that at the origin, for whom. */
void nb_cpu_planets_light_at(const nb_air_frame *air, nb_irradiance_receiver of, const double place[3], double sun[3],
                             double sky[3]);

/* Without tables: for a sun of irradiance 1. */
nebel_irradiance nb_cpu_planets_ask(const nb_air_frame *air, const double place[3]);

/* nebel_trace_sky_view, through the air of all planets; at most NB_BATCH rays. */
nebel_result nb_cpu_planets_trace(const nb_air_frame *air, size_t n, const double *const direction[3],
                                  const float *t_max, const nebel_transfer_planes *transfers);

/* Where the nearest ground is seen, to scratch->ground; what lies behind it is no hit any more. `advance` as of nb_view. */
void nb_cpu_planets_find_ground(const nb_air_frame *air, double advance, const nb_ray_batch *rays, const int *inside,
                                nb_hits *hits, nb_cpu_planets_scratch *scratch);

int nb_cpu_planets_sees_ground(const nb_cpu_planets_scratch *scratch);

/* Makes hits and points of where the ground is seen, which other planets may hide from the sun. `position` is the camera's,
 * relative to `origin`, that of the geometry. scratch->start has all points relative to the camera: floats that count from
 * a geometry far away, or from the scene's origin where there is none, put the ground metres off. */
void nb_cpu_planets_set_points(const nb_air_frame *air, double advance, const double position[3],
                               const double origin[3], const float sun[3], const nb_ray_batch *rays,
                               nb_cpu_planets_scratch *scratch, nb_hits *hits, nb_surface_batch *points);

/* The light at the places of models. `origin`: of the geometry. */
void nb_cpu_planets_set_irradiance(const nb_air_frame *air, const double origin[3], const nb_hits *hits,
                                   const nb_surface_batch *points, nb_cpu_planets_scratch *scratch);

/* What air leaves of the sun where it is met, times `color`. */
void nb_cpu_planets_dim_sun(const float *sunlight, const nb_hits *hits, const nb_cpu_planets_scratch *scratch,
                            float (*color)[NB_BATCH]);

/* Whether any of the rays sees the disc of the sun, or is within two pixels of it. The middle's pixels are the widest. */
int nb_cpu_planets_sees_sun(const nb_air_frame *air, const nb_surface_lighting *lighting, const nb_ray_batch *rays);

/* Whether any of the rays passes within two pixels of the edge of a planet. */
int nb_cpu_planets_sees_rim(const nb_air_frame *air, const nb_ray_batch *rays);

/* Radiance behind all air and fog in one direction: the scene's background, and the sun. */
void nb_cpu_planets_background(const nb_air_frame *air, const nb_surface_lighting *lighting, const nb_ray_batch *rays,
                               int lane, double light[3]);

#endif
