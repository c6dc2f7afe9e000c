/* The air of planets: what it leaves of light, and what it scatters of the sun's, in all orders.
 *
 *     nebel_atmosphere *air = NULL;
 *     nebel_create_atmosphere(&(nebel_atmosphere_desc){0}, &air); // the Earth's
 *
 *     const nebel_sun sun = {.direction = {0.6, 0.3, 0}, .irradiance = {1, 1, 1}};
 *     const nebel_ray ray = {{0, 1.7, 0}, {1, 0.1, 0}, INFINITY};
 *     nebel_transfer transfer;
 *     nebel_trace_atmosphere(air, &sun, 1, &ray, 0, &light, 0);          // light.in_scattering is the sky
 *
 * The planet is a ball; its air is up to NEBEL_MAX_COMPONENTS kinds of it over each other, each of which thins out with height,
 * or is a layer, and ends where the atmosphere does. Light that was scattered once comes from quadrature with the exact
 * optical depth (formulas/atmosphere.inc) in both directions. What was scattered more often comes from a table over height
 * and the sun's height, made when the atmosphere is: there the light from everywhere is kept by its moments, as much of
 * it as Rayleigh's phase function sees; that is exact for air, and smoothes what dust sends ahead.
 *
 * Places are those of the scene, y up. Units are metres. Nothing here calls a graphics interface.
 *
 * Strides are in bytes. 0 with n > 1: the same ray or place for all, and of results the same one is written each time.
 */
#ifndef NEBEL_PLANET_H
#define NEBEL_PLANET_H

#include <nebel/nebel.h>

#ifdef __cplusplus
extern "C" {
#endif

/* ---- describing air -------------------------------------------------------------------------- */

#define NEBEL_MAX_COMPONENTS 4
#define NEBEL_MAX_COMPONENT_EXTINCTION 1e3 /* 1/m */
#define NEBEL_MAX_COMPONENT_RATIO 1000.    /* of the atmosphere's thickness to a scale height or a layer's width */

typedef enum nebel_component_profile {
    NEBEL_COMPONENT_EXPONENTIAL = 0, /* e^(-height / scale_height) */
    NEBEL_COMPONENT_TENT, /* 1 at `center_height`, falling to 0 in straight lines up to `half_width` above and below it */
    NEBEL_COMPONENT_PROFILE_COUNT
} nebel_component_profile;

/* One kind of air. */
typedef struct nebel_atmosphere_component {
    double scattering[3]; /* 1/m where the density is 1, 0 to 1e3 */
    double absorption[3]; /* the same */
    nebel_phase phase;
    nebel_component_profile profile;
    double scale_height;              /* EXPONENTIAL: m, at least thickness / NEBEL_MAX_COMPONENT_RATIO */
    double center_height, half_width; /* TENT: m above the ground, and m, at least as much */
} nebel_atmosphere_component;

/* How much work goes into the table of light that was scattered more than once. */
typedef enum nebel_atmosphere_quality {
    NEBEL_ATMOSPHERE_FAST = 0,
    NEBEL_ATMOSPHERE_PRECISE,
    NEBEL_ATMOSPHERE_QUALITY_COUNT
} nebel_atmosphere_quality;

/* Calls part(data, i) once for each i < parts, in any order and by any threads, and returns when all are done. */
typedef void (*nebel_parallel_for_fn)(size_t parts, void (*part)(void *data, size_t i), void *data, void *user);

typedef struct nebel_atmosphere_desc {
    double ground_point[3]; /* where the ground is above (y) the planet's centre: m. {0}: the origin */
    double radius;          /* of the ground: m, 1 to 1e12; 0: 6.36e6 */
    double thickness;       /* of the air: m, at most 1e12, at least radius / 1e6; 0: 1e5 */
    nebel_atmosphere_component components[NEBEL_MAX_COMPONENTS];
    uint32_t component_count; /* 0: the Earth's air, see nebel_lookup_atmosphere */
    double ground_albedo[3];  /* what the ground gives back to the air, 0 to 1; {0}: black, presets have their own */
    nebel_atmosphere_quality quality;
    nebel_parallel_for_fn run; /* for threads that make the table; NULL: one part after the other */
    void *run_user;
    nebel_allocator allocator; /* {0}: malloc and free */
    nebel_log log;
} nebel_atmosphere_desc;

/* Known airs: "earth" (constants of the demonstration of Hillaire, A Scalable and Production Ready Sky and Atmosphere
 * Rendering Technique, 2020), "mars", "toy", a ball of 1 km in the Earth's colours, and "moon", which has no air: one kind of it that
 * does nothing to light. NULL where there is none of that name. Any thread. */
const nebel_atmosphere_desc *nebel_lookup_atmosphere(const char *name);

/* Writes the description with every default in its place. desc may be resolved. Errors: ARGUMENT, VALUE (a number out of range;
 * the description's log says which); *resolved is then untouched. Any thread. */
nebel_result nebel_resolve_atmosphere(const nebel_atmosphere_desc *desc, nebel_atmosphere_desc *resolved);

/* ---- atmospheres ----------------------------------------------------------------------------- */

typedef struct nebel_atmosphere nebel_atmosphere;

/* Makes an atmosphere that does not change any more, with its table: the same bits however `run` splits the work. Free
 * it with nebel_destroy_atmosphere. Errors: ARGUMENT (NULL), VALUE (a number out of range; the log says which), MEMORY;
 * *atmosphere is then NULL. Any thread. */
nebel_result nebel_create_atmosphere(const nebel_atmosphere_desc *desc, nebel_atmosphere **atmosphere);

/* NULL is fine. */
void nebel_destroy_atmosphere(nebel_atmosphere *atmosphere);

/* What the air does along each of n rays, up to t_max, the ground or the end of the air, whichever comes first. A place
 * below the ground counts as that on it straight above, the centre as that at y, here and below. The light of the ground
 * itself is not in it. Strides are in bytes. sun NULL: no light. `error` is what the quality promises: see
 * docs/planet.md. Any thread. Errors: ARGUMENT (NULL, a sun or a ray that is NaN, infinite where it must not be, of no
 * direction, of negative t_max); then no transfers are written. */
nebel_result nebel_trace_atmosphere(const nebel_atmosphere *atmosphere, const nebel_sun *sun, size_t n,
                                    const nebel_ray *rays, size_t ray_stride, nebel_transfer *transfers,
                                    size_t transfer_stride);

/* Light that arrives at a place. */
typedef struct nebel_irradiance {
    double sun[3]; /* irradiance on a surface that faces the sun; 0 in the planet's shadow */
    double sky[3]; /* irradiance on level ground below the place, of all that the air scatters; above the air, too */
} nebel_irradiance;

/* The light at each of n places; strides in bytes. Nothing tells an error: the sun's part is as exact as the optical depth, the
 * sky's as the table of the quality, both in docs/planet.md, "How far off", whose rays down have this light behind them.
 * Any thread. Errors: ARGUMENT; then no lights are written. */
nebel_result nebel_compute_atmosphere_irradiance(const nebel_atmosphere *atmosphere, const nebel_sun *sun, size_t n,
                                                 const double (*places)[3], size_t place_stride,
                                                 nebel_irradiance *irradiances, size_t irradiance_stride);

/* ---- many rays from one place ---------------------------------------------------------------- */

/* What the air does to all rays from one place, from a table over their direction and, where they may end within the air,
 * how far they go. The table ends at the horizon on both sides, and keeps phase functions apart, so that neither is smoothed.
 * A ray takes some 0.1 us. */
typedef struct nebel_sky_view nebel_sky_view;

typedef struct nebel_sky_view_desc {
    const nebel_atmosphere *atmosphere; /* must outlive the view */
    nebel_sun sun;
    double position[3];        /* m; below the ground counts as on it */
    int has_ray_ends;          /* 0: rays go to the ground or the end of the air, t_max is not read */
    nebel_parallel_for_fn run; /* for threads; NULL: one part after the other */
    void *run_user;
    nebel_allocator allocator;
    nebel_log log;
} nebel_sky_view_desc;

/* Makes the table. Errors: ARGUMENT (NULL, a sun or a place that is not in order), MEMORY; *view is then NULL. The same
 * bits however `run` splits the work. */
nebel_result nebel_create_sky_view(const nebel_sky_view_desc *desc, nebel_sky_view **view);

/* NULL is fine. */
void nebel_destroy_sky_view(nebel_sky_view *view);

/* What nebel_trace_atmosphere says of n rays from the view's place, from the table. Planes have no gaps: strides of `lights` are
 * not read, its planes of three are given all or none. t_max NULL: to the ground or the end of the air; one that is NaN or negative counts as 0. A direction may be of any
 * length from 1e-150 to 1e150; those of none meet no air. `error` adds what the table misses, estimated from its own differences, to what
 * nebel_trace_atmosphere tells. Any thread. Errors: ARGUMENT (NULL, a component of the direction too). */
nebel_result nebel_trace_sky_view(const nebel_sky_view *view, size_t n, const double *const direction[3],
                                  const float *t_max, const nebel_transfer_planes *transfers);

/* Where rays meet the ground, and the light there. Planes without gaps; each may be NULL. */
typedef struct nebel_ground_planes {
    float *distance;  /* m; 0 where the view's place is on the ground or below it, INFINITY: the ray does not meet it */
    float *normal[3]; /* the rest means nothing where it does not */
    float *sun[3];    /* irradiance of a surface that faces the sun; 0 in the planet's shadow */
    float *sky[3];    /* irradiance of the ground by all that the air scatters */
} nebel_ground_planes;

/* The ground along n rays from the view's place, as of nebel_trace_sky_view. Any thread. Errors: ARGUMENT (NULL). */
nebel_result nebel_trace_ground(const nebel_sky_view *view, size_t n, const double *const direction[3],
                                const nebel_ground_planes *planes);

#ifdef __cplusplus
}
#endif

#endif
