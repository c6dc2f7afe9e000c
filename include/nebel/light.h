/* Light for fog: sun, point and spot lights, ambient light, light that fog scatters more than once; and the lighting of a
 * snapshot, which has them all. */
#ifndef NEBEL_LIGHT_H
#define NEBEL_LIGHT_H

#include <nebel/nebel.h>

#ifdef __cplusplus
extern "C" {
#endif

/* ==== sun, point and spot lights ================================================================== */

/* Light from one direction, from 1e18 m away. What it brings to a place is what all fog on the way there lets
 * through; light that was scattered once is not scattered again. */
typedef struct nebel_sun {
    double direction[3];  /* towards the sun, any length but 0 where it shines */
    double irradiance[3]; /* 0 to 1e9, on a surface that faces it; all zero: no sun */
} nebel_sun;

typedef enum nebel_light_type {
    NEBEL_LIGHT_POINT = 0, /* shines alike in all directions */
    NEBEL_LIGHT_SPOT       /* shines into a cone */
} nebel_light_type;

/* m. A point light without a radius has this one: what a ray through a point sees has no bound. Nothing nearer gets more
 * light, nor does what is nearer cast a shadow: a light may stand on a surface, or lie in it. */
#define NEBEL_MIN_LIGHT_RADIUS 1e-3

/* A ball that shines. Its light reaches a place through all fog on the straight way there, scattered once, as the
 * sun's. What it brings is the irradiance from all sides of a ball that is equally bright everywhere; phase functions
 * take it for light from the ball's centre, and fog dims it from the ball's surface on, with
 * radius 0 from its centre. */
typedef struct nebel_light {
    nebel_light_type type;
    double position[3];  /* m */
    double intensity[3]; /* W/sr, 0 to 1e9, seen from far away; of a spot along its axis */
    double
        radius; /* m, NEBEL_MIN_LIGHT_RADIUS to 1e6; 0: that. Rays that pass nearer see no more than at its surface */
    double direction[3];             /* spot: where it shines to, any length but 0 */
    double inner_angle, outer_angle; /* spot: degrees from the axis, 0 <= inner <= outer, 0 < outer <= 180: full light
                                        within the inner one, none beyond the outer one, smooth between */
} nebel_light;

/* ==== ambient light by direction ================================================================== */

/* Ambient light that need not be the same from everywhere; up is +y. Fog with an albedo scatters along each ray what its phase
 * function makes of it; transmittance stays as it is. For surfaces there is nebel_evaluate_environment_diffuse, for what is behind
 * everything nebel_evaluate_environment. */

/* Ambient light from a picture of all directions, 360 by 180 degrees, longitude across and latitude down: its middle is
 * what a camera sees that looks along -z, +x is to the right, the top row is up (+y), as in a panorama of nebel/scene.h.
 * Between the middles of pixels it is linear. */
typedef struct nebel_environment_map nebel_environment_map;

#define NEBEL_MAX_ENVIRONMENT_WIDTH 4096

typedef struct nebel_environment_map_desc {
    nebel_host host;
    size_t width, height; /* 2 to NEBEL_MAX_ENVIRONMENT_WIDTH, and half of that */
    const float *pixels;  /* radiance, 0 to 1e9: RGB, width * height of them, the top row first; copied */
} nebel_environment_map_desc;

/* Makes an environment map in *map, with one owner; on an error *map is NULL. Cost: some 0.1 s, 1 s for the largest. Any thread. Errors: ARGUMENT, VALUE (a pixel
 * out of range, another shape), LIMIT, MEMORY. */
NEBEL_API nebel_result nebel_create_environment_map(const nebel_environment_map_desc *desc,
                                                    nebel_environment_map **map);

/* One more owner of the map; any thread. Returns its argument. */
NEBEL_API nebel_environment_map *nebel_retain_environment_map(nebel_environment_map *map);

/* One owner less; the last one frees it. Any thread. NULL is fine. */
NEBEL_API void nebel_release_environment_map(nebel_environment_map *map);

typedef enum nebel_environment_type {
    NEBEL_ENVIRONMENT_CONSTANT = 0, /* radiance */
    NEBEL_ENVIRONMENT_GRADIENT,     /* zenith, horizon, ground */
    NEBEL_ENVIRONMENT_MAP,          /* map, rotation, intensity */
    NEBEL_ENVIRONMENT_COUNT
} nebel_environment_type;

/* Where ambient light comes from. It lights fog with an albedo as if no fog and no surface were in its way: a volume
 * scatters along a ray what its phase function makes of the sky about the ray's direction. */
typedef struct nebel_environment {
    nebel_environment_type type;
    double radiance[3];                      /* constant: from everywhere, 0 to 1e9 */
    double zenith[3], horizon[3], ground[3]; /* gradient: radiance from straight above, level and from straight below, 0
                                                to 1e9; linear in the sine of the elevation between them */
    nebel_environment_map *map;              /* map: not NULL */
    /* map: degrees about +y, within -NEBEL_MAX_ENVIRONMENT_ROTATION and that; > 0 takes what is at -z to -x. */
    double rotation;
    double intensity; /* map: factor of its radiance, > 0, at most 1e9 of both together; 0: 1 */
} nebel_environment;

#define NEBEL_MAX_ENVIRONMENT_ROTATION 1e6

/* Radiance that comes from a direction, of any length. Where it is none, 0 or not finite, a constant environment sends
 * what it always does and others 0. `environment` must be in order. Any thread. */
NEBEL_API void nebel_evaluate_environment(const nebel_environment *environment, const double direction[3],
                                          double radiance[3]);

/* Radiance of a white Lambertian surface of a normal, taken as the direction above, that nothing hides from the sky:
 * irradiance over pi. Of a gradient in closed form, of a map within 1e-3 of the brightest normal's. Any thread. */
NEBEL_API void nebel_evaluate_environment_diffuse(const nebel_environment *environment, const double normal[3],
                                                  double radiance[3]);

/* More phase functions than these cannot scatter an environment that is not constant. */
#define NEBEL_MAX_ENVIRONMENT_PHASES 64

/* What phase functions make of a gradient is within 1e-5 of its largest radiance; of a map within 1e-3 of the brightest
 * direction's. Phase functions that see details of less than 1.1 degrees (from |g| = 0.956 on) see the map blurred, with
 * a standard deviation of up to 1.1 degrees. `error` of queries does not count these. A ray costs some 50 or 90 ns more for
 * each phase function. */

/* ==== light that is scattered more than once ====================================================== */

/* Light that fog scatters more than once, so that white fog is white and smoke is dark: a model, where all else is exact.
 * docs/multiple-scattering.md has the model and its errors. It belongs to a lighting (below) and holds for all of its lights.
 *
 * What is scattered once stays as exact as it is. Ambient light, which without it nothing dims, is dimmed by what fog and ground
 * take from it. Light of point and spot lights is scattered again, and so is what fog emits, which without it nothing scatters.
 * `error` says nothing of this model's own error. Surfaces and their shadows are not known to it.
 *
 * A lighting then costs a march to the sun from each node of a lattice around all fog that is lit, and the solution of one linear
 * equation for each cell (for each channel, where fog or the sky has colour; once more where ambient light is dimmed), in all about
 * a second for 65536 cells; it keeps 36 bytes a node, or 100 where there is colour, and 32 or 96 more where ambient light is
 * dimmed. For point and spot lights and what is emitted there is a second lattice, of 84 or 244 bytes a node, where each light
 * costs what the sun costs. A query asks for the transmittance of each piece of its ray from cell to cell. Same bits for every isa
 * and any number of threads.
 */

typedef struct nebel_diffusion_desc {
    uint32_t max_cells;      /* of its lattice, at most: NEBEL_MIN_DIFFUSION_CELLS to NEBEL_MAX_DIFFUSION_CELLS; 0:
                       NEBEL_DEFAULT_DIFFUSION_CELLS. Thin fog takes less */
    int has_ground;          /* a level one without end: what is below is left out, and light comes back from it */
    double ground_height;    /* m, along y */
    double ground_albedo[3]; /* 0 to 1 */
} nebel_diffusion_desc;

#define NEBEL_MIN_DIFFUSION_CELLS 512
#define NEBEL_MAX_DIFFUSION_CELLS 16777216
#define NEBEL_DEFAULT_DIFFUSION_CELLS 65536

/* ==== the lights of a snapshot ==================================================================== */

/* Fog says what scatters light, a lighting what light there is:
 *
 *     // of the first program in nebel.h, with .albedo = {.9, .9, .9} in place of .source
 *     nebel_lighting *lighting = NULL;
 *     nebel_create_lighting(now, &(nebel_lighting_desc){
 *         .sun = {.direction = {0, 1, 0}, .irradiance = {3, 3, 3}}, .environment = {.radiance = {.2, .3, .4}}}, &lighting);
 *     nebel_trace(now, &(nebel_trace_desc){.lighting = lighting}, 1, &ray, sizeof ray, &transfer, sizeof transfer);
 *     nebel_release_lighting(lighting);
 *
 * A lighting never changes, is an owner of its snapshot, and may be asked by any number of threads. When lights move, the fog
 * need not be committed again: a new lighting of the same snapshot is made.
 */

/* Where the light that fog gives comes from. */
typedef enum nebel_light_group {
    NEBEL_LIGHT_GROUP_SUN = 0,
    NEBEL_LIGHT_GROUP_ENVIRONMENT,
    NEBEL_LIGHT_GROUP_LOCAL, /* point and spot lights; of in-scattering emission and source of fog, too */
    NEBEL_LIGHT_GROUP_COUNT
} nebel_light_group;

typedef struct nebel_lighting_desc {
    nebel_host host;               /* allocator and log all zero: those of the snapshot */
    nebel_sun sun;                 /* all zero: none */
    nebel_environment environment; /* all zero: dark */
    const nebel_light *lights;     /* light_count of them; copied */
    size_t light_count;
    const nebel_diffusion_desc *diffusion; /* NULL: light is scattered once */
    const nebel_lighting *previous; /* NULL, or one whose preparations serve again where they still hold: sunlight in
                                  voxels, and what phase functions make of an environment. Of any snapshot; of another allocator nothing serves */
} nebel_lighting_desc;

/* Prepares lights for the fog of a snapshot, of which the lighting becomes an owner, in *made, with one owner; desc NULL: no
 * lights. On an error *made is NULL. They light volumes with an albedo, whose density and phase functions the snapshot has.
 * The same lights give the same bits in every query.
 *
 * Cost: linear in the volumes and lights, some 30 ns each; for voxels that the sun alone lights one march through them; up to
 * 1 ms for each phase function of a gradient's light, 0.15 s and 6 MB for each that a map meets for the first time (it keeps
 * the last eight); diffusion, see nebel_diffusion_desc. A query costs for each light what it costs for the sun, except for
 * lights too weak or too far away to matter: their light is left out, and counted in `error`. The first query in float under
 * point lights that light voxels finds the depth to each light on a lattice, some 2 us for each of 2^16 nodes at most, 2^20 of all;
 * threads that ask at the same time share that work.
 *
 * Any thread. Errors: ARGUMENT, VALUE, MEMORY; LIMIT, where more than NEBEL_MAX_ENVIRONMENT_PHASES phase functions scatter an
 * environment that is not constant; UNSUPPORTED, where diffusion meets fog with max_opacity, start or cutoff, or lit fog that
 * goes on endlessly along x or z but changes on the way. */
NEBEL_API nebel_result nebel_create_lighting(nebel_snapshot *snapshot, const nebel_lighting_desc *desc,
                                             nebel_lighting **made);

/* One more owner of the lighting; any thread. Returns its argument. */
NEBEL_API nebel_lighting *nebel_retain_lighting(nebel_lighting *lighting);

/* One owner less; the last one frees it. Any thread. NULL is fine. */
NEBEL_API void nebel_release_lighting(nebel_lighting *lighting);

/* The snapshot that it is of, which lives as long as the lighting. Any thread. NULL of NULL. */
NEBEL_API nebel_snapshot *nebel_get_lighting_snapshot(const nebel_lighting *lighting);

/* The sun as it was given, its direction of length 1; all zero where there is none. Any thread. */
NEBEL_API nebel_sun nebel_get_lighting_sun(const nebel_lighting *lighting);

/* The environment as it was given; the lighting is an owner of its map. Any thread. */
NEBEL_API nebel_environment nebel_get_lighting_environment(const nebel_lighting *lighting);

/* How many point and spot lights there are, and themselves in *lights (NULL: not wanted), as they were given, for as long as
 * the lighting lives. Any thread. */
NEBEL_API size_t nebel_get_lighting_lights(const nebel_lighting *lighting, const nebel_light **lights);

/* How light is scattered more than once, for as long as the lighting lives; NULL where it is not. Any thread. */
NEBEL_API const nebel_diffusion_desc *nebel_get_lighting_diffusion(const nebel_lighting *lighting);

/* Writes bounds outside of which no fog is lit by the lights of a group, whatever it emits by itself, and returns 1; or returns
 * 0 where they light none, with *bounds as it was. Cost O(n). Any thread. */
NEBEL_API int nebel_get_lit_bounds(const nebel_lighting *lighting, nebel_light_group group, nebel_bounds *bounds);

#ifdef __cplusplus
}
#endif

#endif
