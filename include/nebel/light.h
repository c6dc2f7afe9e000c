/* Light in fog beside the sun, which nebel.h has: ambient light by direction, and light that fog scatters more than once. */
#ifndef NEBEL_LIGHT_H
#define NEBEL_LIGHT_H

#include <nebel/nebel.h>

#ifdef __cplusplus
extern "C" {
#endif

/* ==== ambient light by direction ================================================================== */

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

/* ==== light that is scattered more than once ====================================================== */

/* Light that fog scatters more than once, so that white fog is white and smoke is dark: a model, where all else is exact.
 *
 *     nebel_set_diffusion(fog, &(nebel_diffusion_desc){0});
 *     nebel_commit_fog(fog, &now);
 *
 * Queries of that snapshot then have it in their in-scattering. docs/multiple-scattering.md has the model and its errors.
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

/* Makes snapshots from now on hold what becomes of the sun's light after fog has scattered it once, which queries then
 * add to in-scattering; NULL: no longer. What is scattered once stays as exact as it is. Ambient light, which without it
 * nothing dims, is dimmed by what fog and ground take from it. So lamps' light is scattered again, and what fog emits, which
 * without it nothing scatters. `error` says nothing of this model's own error. Surfaces and their shadows are not known to it.
 *
 * A commit then costs a march to the sun from each node of a lattice around all fog that is lit, and the
 * solution of one linear equation for each cell (for each channel, where fog or the sky has colour; once more where ambient
 * light is dimmed), in all about a second for 65536 cells; the snapshot keeps 36 bytes a node, or 100 where there is
 * colour, and 32 or 96 more where ambient light is dimmed. For lamps and what is emitted there is a second lattice, of 84 or 244
 * bytes a node, where each lamp costs what the sun costs. A query asks for the transmittance of each piece of its ray
 * from cell to cell. Same bits for every isa and any number of threads.
 *
 * nebel_commit_fog then refuses (UNSUPPORTED) fog with max_opacity, start or cutoff, and lit fog that goes on
 * endlessly along x or z but changes on the way. Errors: ARGUMENT, VALUE. */
nebel_result nebel_set_diffusion(nebel_fog *fog, const nebel_diffusion_desc *desc);

#ifdef __cplusplus
}
#endif

#endif
