/* nebel environments: ambient light that is not the same from everywhere.
 *
 *     const nebel_environment dusk = {.type = NEBEL_ENVIRONMENT_GRADIENT,
 *                                     .zenith = {.1, .2, .6}, .horizon = {.9, .6, .4}, .ground = {.05, .05, .05}};
 *     nebel_set_environment(fog, &dusk);
 *
 * Fog with an albedo then scatters along each ray what its phase function makes of that light; transmittance stays as
 * it is. For surfaces there is nebel_evaluate_environment_diffuse, for what is behind everything nebel_evaluate_environment.
 *
 * Link with libnebel. Threads, results and conventions as in nebel/nebel.h; up is +y.
 */
#ifndef NEBEL_ENVIRONMENT_H
#define NEBEL_ENVIRONMENT_H

#include <nebel/nebel.h>

#ifdef __cplusplus
extern "C" {
#endif

/* Ambient light from a picture of all directions, 360 by 180 degrees, longitude across and latitude down: its middle is
 * what a camera sees that looks along -z, +x is to the right, the top row is up (+y), as in a panorama of nebel/scene.h.
 * Between the middles of pixels it is linear. */
typedef struct nebel_environment_map nebel_environment_map;

#define NEBEL_MAX_ENVIRONMENT_WIDTH 4096

typedef struct nebel_environment_map_desc {
    nebel_allocator allocator;
    nebel_log log;
    size_t width, height; /* 2 to NEBEL_MAX_ENVIRONMENT_WIDTH, and half of that */
    const float *pixels;  /* radiance, 0 to 1e9: RGB, width * height of them, the top row first; copied */
} nebel_environment_map_desc;

/* Makes an environment map in *map, with one owner; on an error *map is NULL. The allocator must be usable as long as the map, or
 * a snapshot that it lights, lives. Cost: some 0.1 s, 1 s for the largest. Any thread. Errors: ARGUMENT, VALUE (a pixel
 * out of range, another shape), LIMIT, MEMORY. */
nebel_result nebel_create_environment_map(const nebel_environment_map_desc *desc, nebel_environment_map **map);

/* One more owner of the map; any thread. Returns its argument. */
nebel_environment_map *nebel_retain_environment_map(nebel_environment_map *map);

/* One owner less; the last one frees it. Any thread. NULL is fine. */
void nebel_release_environment_map(nebel_environment_map *map);

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
void nebel_evaluate_environment(const nebel_environment *environment, const double direction[3], double radiance[3]);

/* Radiance of a white Lambertian surface of a normal, taken as the direction above, that nothing hides from the sky:
 * irradiance over pi. Of a gradient in closed form, of a map within 1e-3 of the brightest normal's. Any thread. */
void nebel_evaluate_environment_diffuse(const nebel_environment *environment, const double normal[3],
                                        double radiance[3]);

/* More phase functions than these cannot scatter an environment that is not constant: a commit is LIMIT then. */
#define NEBEL_MAX_ENVIRONMENT_PHASES 64

/* Sets the environment, in place of the ambient radiance or the one before; the fog and its snapshots become owners of
 * a map.
 *
 * What phase functions make of a gradient is within 1e-5 of its largest radiance; of a map within 1e-3 of the brightest
 * direction's. Phase functions that see details of less than 1.1 degrees (from |g| = 0.956 on) see the map blurred, with
 * a standard deviation of up to 1.1 degrees. `error` of queries does not count these.
 *
 * Cost O(1). A commit then takes up to 1 ms for each phase function of a gradient's light, 0.15 s and 6 MB for each that
 * a map meets for the first time (it keeps the last eight); a ray some 50 or 90 ns for each. Errors: ARGUMENT, VALUE; it
 * is then as it was. */
nebel_result nebel_set_environment(nebel_fog *fog, const nebel_environment *environment);

#ifdef __cplusplus
}
#endif
#endif
