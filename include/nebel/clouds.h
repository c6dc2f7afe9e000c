/* Clouds with volume around a planet: shells of drops or ice between two heights, lit by the sun and the sky.
 *
 *     nebel_clouds *clouds = NULL;
 *     nebel_create_clouds(&(nebel_clouds_desc){.atmosphere = air, .layer_count = 1}, &clouds); // cumulus
 *     nebel_create_cloud_lighting(&(nebel_cloud_lighting_desc){.clouds = clouds, .sun = sun}, &view);
 *     nebel_create_cloud_workspace(view, &workspace);                                          // one per thread
 *     nebel_trace_clouds(workspace, 1, &ray, 0, &(double){0.001}, 0, &knots, 0);
 *
 * The extinction of a layer at a place is one formula of the place, the same from everywhere (docs/clouds.md): noise in
 * three dimensions in the planet's axes, so that there is no seam and no pole; who looks from afar gets its mean over
 * what a pixel covers. Transmittance is integrated to a tolerance. Light is first order exact up to the shadow's
 * lattice, and higher orders by a model, a table of even slabs: docs/clouds.md says how far off.
 *
 * Units are metres; places are those of the scene, y up. Nothing here calls a graphics interface.
 *
 * Strides are in bytes. 0 with n > 1: the same ray or place for all, and of results the same one is written each time.
 */
#ifndef NEBEL_CLOUDS_H
#define NEBEL_CLOUDS_H

#include <nebel/layers.h>
#include <nebel/planet.h>

#ifdef __cplusplus
extern "C" {
#endif

#define NEBEL_MAX_CLOUD_LAYERS 4
#define NEBEL_MAX_CLOUD_NODES 16
#define NEBEL_MAX_AIR_SHADOW_SEGMENTS 6
#define NEBEL_MAX_FOG_SHADOW_SEGMENTS 32
#define NEBEL_MAX_CLOUD_THICKNESS_RATIO 1e6 /* of the air's thickness to a layer's */
#define NEBEL_MAX_CLOUD_CELL_RADII 4.       /* of the planet to a layer's size */
#define NEBEL_CLOUD_NONE (-1.)              /* where 0 would mean the number of the kind */

/* What a layer looks like, and its numbers where none are given. */
typedef enum nebel_cloud_type {
    NEBEL_CLOUD_CUMULUS = 0, /* flat bases, rounded tops: 900 to 2700 m */
    NEBEL_CLOUD_STRATUS,     /* a sheet with gaps: 300 to 800 m */
    NEBEL_CLOUD_CIRRUS,      /* thin wisps of ice, drawn out along the wind: 8000 to 9500 m */
    NEBEL_CLOUD_TYPE_COUNT
} nebel_cloud_type;

/* One layer. 0 stands for the number of its type, but for type and wind. Lengths of a type are those of the Earth: on
 * planets with less than 100 km of air they shrink with it, `cell_size` no further than with the layer's height. */
typedef struct nebel_cloud_layer {
    nebel_cloud_type type;
    double base, top;  /* m above the ground, 0 < base < top, within the air; no top: as high as the type */
    double coverage;   /* part of the planet under clouds, 0 to 1; of cumulus before detail is cut out */
    double extinction; /* 1/m in their middle, to NEBEL_MAX_COMPONENT_EXTINCTION */
    /* m, of the largest cells: half of the distance from one to the next; 1e-3 to 1e9, at most NEBEL_MAX_CLOUD_CELL_RADII
     * of the planet's radius. */
    double cell_size;
    double erosion;          /* how deep Worley noise cuts into them, to 1; NEBEL_CLOUD_NONE: not at all */
    double patchiness;       /* variation of the coverage over ten cells and more, to 1, or NEBEL_CLOUD_NONE */
    double droplet_diameter; /* um, twice the effective radius of the droplets: 4 to 50 */
    uint32_t seed;           /* of the noise */
    /* m per unit of time, within 1e12, along x and z at the point of the ground above the centre: the shell rotates. */
    double wind[2];
    nebel_planet_map weather_map; /* one channel; times the coverage; as maps of layers lie. {0}: 1 everywhere */
} nebel_cloud_layer;

typedef struct nebel_clouds_desc {
    const nebel_atmosphere *atmosphere; /* must outlive the clouds */
    nebel_cloud_layer layers[NEBEL_MAX_CLOUD_LAYERS];
    uint32_t layer_count;
    nebel_allocator allocator; /* {0}: malloc and free */
    nebel_log log;
} nebel_clouds_desc;

typedef struct nebel_clouds nebel_clouds;

/* Writes a layer with every number in its place, for air of that thickness, in m. desc may be resolved. Errors: ARGUMENT,
 * VALUE (a number out of range; the log says which); *resolved is then untouched. Any thread. */
nebel_result nebel_resolve_cloud_layer(double thickness, const nebel_cloud_layer *desc, const nebel_log *log,
                                       nebel_cloud_layer *resolved);

/* Makes clouds that do not change any more. Free them with nebel_destroy_clouds. Errors: ARGUMENT (NULL), VALUE (a number
 * out of range, layers around a planet without air; the log says which), LIMIT (layers), MEMORY; *clouds is then NULL. Any
 * thread. */
nebel_result nebel_create_clouds(const nebel_clouds_desc *desc, nebel_clouds **clouds);

/* NULL is fine. */
void nebel_destroy_clouds(nebel_clouds *clouds);

/* Extinction of all layers at n places, 1/m, as a mean over about `width` metres (0: as it is). Strides in bytes. time:
 * in the units of the wind, within -1e12 and 1e12. Any thread. Errors: ARGUMENT. */
nebel_result nebel_compute_cloud_extinction(const nebel_clouds *clouds, double time, double width, size_t n,
                                            const double (*places)[3], size_t place_stride, float *extinction);

/* The phase function of a layer's droplets, 1/sr for red, green and blue (light of 680, 550 and 440 nm), at n cosines within -1 and 1 of the
 * angle by which light is turned. Cumulus and stratus: Mie's theory for water, sizes of a gamma distribution with an effective
 * variance of 0.1, by a table; cirrus: NEBEL_PHASE_DROPLETS. docs/clouds.md says how far off. Any thread. Errors: ARGUMENT. */
nebel_result nebel_cloud_phase(const nebel_clouds *clouds, uint32_t layer, size_t n, const double *cosines,
                               double (*phases)[3]);

/* ---- light ----------------------------------------------------------------------------------- */

/* Clouds at a moment under a sun. */
typedef struct nebel_cloud_lighting nebel_cloud_lighting;

typedef struct nebel_cloud_lighting_desc {
    const nebel_clouds *clouds; /* must outlive the view */
    nebel_sun sun;              /* irradiance {0}: dark */
    double time;                /* within -1e12 and 1e12 */
    double tolerance;           /* of transmittance, of each piece of a ray; 0: NEBEL_DEFAULT_TOLERANCE */
    nebel_isa isa;              /* the same bits for every one; DEFAULT: the best of this processor */
    nebel_allocator allocator;
    nebel_log log;
} nebel_cloud_lighting_desc;

/* Errors: ARGUMENT, VALUE (time, tolerance), UNSUPPORTED (isa not available), MEMORY; *view is then NULL. Any
 * thread. */
nebel_result nebel_create_cloud_lighting(const nebel_cloud_lighting_desc *desc, nebel_cloud_lighting **view);

/* NULL is fine. */
void nebel_destroy_cloud_lighting(nebel_cloud_lighting *view);

/* What was found so far of shadows in a view, which must outlive it: some 20 MB and 6 for each layer. Results do not hang on it.
 * One thread at a time. */
typedef struct nebel_cloud_workspace nebel_cloud_workspace;

/* With the view's allocator. Errors: ARGUMENT, MEMORY; *workspace is then NULL. */
nebel_result nebel_create_cloud_workspace(const nebel_cloud_lighting *view, nebel_cloud_workspace **workspace);

/* NULL is fine. */
void nebel_destroy_cloud_workspace(nebel_cloud_workspace *workspace);

/* What clouds do along a ray up to some places of it. Between two of them transmittance is in between. Together with the air, which leaves
 * A up to each place and has the light L (nebel_trace_atmosphere to each t): from place to place the light of both grows by the mean of A at
 * both times what in_scattering grows by, and by the mean of transmittance times what L grows by; before the first it is L, behind the
 * last L grows times the last transmittance. */
typedef struct nebel_cloud_transfer {
    uint32_t count;                                /* 0: no cloud; else the first is where they begin */
    float t[NEBEL_MAX_CLOUD_NODES];                /* m, ascending */
    float transmittance[NEBEL_MAX_CLOUD_NODES];    /* of clouds alone, grey */
    float in_scattering[NEBEL_MAX_CLOUD_NODES][3]; /* of clouds alone, as if nothing else were on the way */
    float error;                                   /* of transmittance: what quadrature tells, of all pieces */
    /* How often the density was queried after the ray enters layers; 0: it comes near no cloud. */
    uint32_t density_queries;
} nebel_cloud_transfer;

/* Along n rays up to t_max or the ground. spreads: width of a ray's pixel per metre of the way, 0 to 10: what is narrower is seen as
 * a mean. Strides in bytes; of spreads 0 is one for all rays. Sixteen rays and more at once take half as long as one by one, and
 * have the same bits. One thread per workspace. Errors: ARGUMENT (NULL, a ray or spread not in order); then nothing is written. */
nebel_result nebel_trace_clouds(nebel_cloud_workspace *workspace, size_t n, const nebel_ray *rays, size_t ray_stride,
                                const double *spreads, size_t spread_stride, nebel_cloud_transfer *knots,
                                size_t knot_stride);

/* What part of the sun's light comes through clouds to n places, straight or scattered on the way; width as of
 * nebel_compute_cloud_extinction. Nothing tells an error: of even layers it is within 0.01, but 0.025 where the sun is less than four
 * degrees high (docs/clouds.md, "Light of clouds", has the tables); of cumulus the mean over the ground is within 0.02, and that of
 * one place is not known. Errors: ARGUMENT. */
nebel_result nebel_compute_cloud_sun_transmittance(nebel_cloud_workspace *workspace, double width, size_t n,
                                                   const double (*places)[3], size_t place_stride, float *parts);

/* What part of the sky's light comes through clouds to n places, straight or scattered: that of straight above, as a mean
 * over as wide a place as is far above, or width where that is more. Nothing tells an error: docs/clouds.md, "Clouds in
 * pictures", has how far it is from columns under closed clouds, 4 %; that gaps are seen aslant, too, is left out. Errors: ARGUMENT. */
nebel_result nebel_compute_cloud_sky_transmittance(nebel_cloud_workspace *workspace, double width, size_t n,
                                                   const double (*places)[3], size_t place_stride, float *parts);

/* What part of its light the air has along a ray, under clouds and between them. */
typedef struct nebel_air_shadow {
    uint32_t count; /* of segments; 0: all of its light everywhere */
    /* m, ascending: segment k is from t[k] to t[k + 1]; elsewhere there is no shadow. */
    float t[NEBEL_MAX_AIR_SHADOW_SEGMENTS + 1];
    float transmittance[NEBEL_MAX_AIR_SHADOW_SEGMENTS][3]; /* of what clear air has there, 0 to 1 */
} nebel_air_shadow;

/* Along n rays up to t_max or the ground, as means over pieces: of sunlight what comes through clouds on the way to the sun, of
 * the sky's light what comes through straight from above, by their shares in clear air. Strides in bytes. Nothing tells an error:
 * docs/clouds.md, "Air under clouds", has what closed clouds let through beside what air has before a wall, 0.339 and 0.345,
 * and what is left out. Errors: ARGUMENT. */
nebel_result nebel_trace_cloud_shadow_on_air(nebel_cloud_workspace *workspace, size_t n, const nebel_ray *rays,
                                             size_t ray_stride, nebel_air_shadow *shades, size_t shade_stride);

/* What part of the sun's and of the sky's light fog has along a ray. */
typedef struct nebel_fog_shadow {
    uint32_t count;                             /* of segments; 0: all of it everywhere */
    float t[NEBEL_MAX_FOG_SHADOW_SEGMENTS + 1]; /* m, ascending, as of nebel_air_shadow */
    float sun_transmittance[NEBEL_MAX_FOG_SHADOW_SEGMENTS], sky_transmittance[NEBEL_MAX_FOG_SHADOW_SEGMENTS];
    float error[NEBEL_MAX_FOG_SHADOW_SEGMENTS]; /* of either: what a mean over twice the width differs by */
} nebel_fog_shadow;

/* Along a ray from `begin` on, where fog begins, up to t_max or the ground, as means over pieces, which are longer the farther they
 * are from there and from the end. What comes through is that of nebel_trace_cloud_shadow_on_air. spread as of nebel_trace_clouds. Errors: ARGUMENT. */
nebel_result nebel_trace_cloud_shadow_on_fog(nebel_cloud_workspace *workspace, const nebel_ray *ray, double begin,
                                             double spread, nebel_fog_shadow *shade);

#ifdef __cplusplus
}
#endif

#endif
