/* Paths of light, back from the camera: the reference renderer. docs/reference.md says what it models. */
#ifndef NB_CPU_PATH_TRACER_H
#define NB_CPU_PATH_TRACER_H

#include "embree_scene.h"
#include "hits.h"
#include "cpu_surface.h"
#include "delta_tracking.h"

/* Where a path meets a surface, in the geometry's coordinates. */
typedef struct nb_path_vertex {
    double t; /* m; HUGE_VAL: nothing is met, and the rest means nothing */
    float reflectance[3];
    float normal[3], side[3]; /* of shading and of the triangle, towards where the path came from */
    float start[3];           /* of the rays that go on */
    float cosine;             /* of the angle between shading normal and sun */
    int lit;                  /* whether the surface faces the sun */
    int is_ground;            /* of a planet, and rays go on from `place`, in the scene's coordinates */
    double place[3];
} nb_path_vertex;

/* Room for what one ray meets, shaded as all rays of the renderer are: a batch of one. */
typedef struct nb_single_ray {
    nb_ray_batch rays;
    nb_hits hits;
    nb_surface_batch points;
} nb_single_ray;

/* All that is the same for all paths of a frame. */
typedef struct nb_path_scene {
    nb_media media;
    const nebel_scene_data *scene; /* for its surfaces and point lights */
    const nb_geometry *geometry;
    const nb_srgb_table *table;
    double to_sun[3], sun[3];      /* unit direction; irradiance, 0 without sun */
    double disc;                   /* radians: the radius of the sun, as other planets than that of a place hide it */
    nebel_environment environment; /* ambient light, from beyond all air */
    int has_sun, is_grey;
    uint32_t
        bounces; /* after so many no light is looked for but the sun's, point lights' and the ambient light of the place */
} nb_path_scene;

typedef struct nb_path_light {
    double color[3], in_scattering[3];
    double transmittance[3]; /* 1 where the path came through to what is behind the fog; through air a mean of 1 */
} nb_path_light;

/* The camera's part of a path. */
typedef struct nb_path_eye {
    nebel_ray ray;        /* with t_max where it meets `first` or HUGE_VAL */
    nb_path_vertex first; /* a surface or the ground */
    double background[3]; /* behind everything, seen along it */
} nb_path_eye;

void nb_lone_ray_clear(nb_single_ray *lone);

/* What lane i of a batch met. */
nb_path_vertex nb_meeting_of(const nb_hits *hits, const nb_surface_batch *points, int i);

/* Whether a surface is in the way, within `reach` m. */
int nb_meeting_is_shadowed(const nb_geometry *geometry, const double origin[3], const double direction[3],
                           double reach);

/* Puts the ground of a planet in the place of a meeting behind it. `ray` ends at the meeting. */
void nb_meeting_end_at_ground(const nb_path_scene *world, nebel_ray *ray, nb_path_vertex *meeting);

/* What a ray meets first; the ray ends there. */
nb_path_vertex nb_meeting_find(const nb_path_scene *world, nebel_ray *ray, nb_single_ray *lone);

/* The light of one path. `number` are those of column, row, sample and seed. Errors: UNBOUNDED. */
nebel_result nb_path_trace(const nb_path_scene *world, const nb_path_eye *eye, const uint32_t number[4],
                           nb_single_ray *lone, nb_path_light *light);

#endif
