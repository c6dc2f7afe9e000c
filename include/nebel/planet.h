/* The air of planets: what it leaves of light, and what it scatters of the sun's, in all orders.
 *
 *     nebel_atmosphere *air = NULL;
 *     nebel_create_atmosphere(&(nebel_atmosphere_desc){0}, &air); // the Earth's
 *
 *     const nebel_sun sun = {.direction = {0.6, 0.3, 0}, .irradiance = {1, 1, 1}};
 *     const nebel_ray ray = {{0, 1.7, 0}, {1, 0.1, 0}, INFINITY};
 *     nebel_transfer transfer;
 *     nebel_trace_atmosphere(air, &sun, 1, &ray, 0, &transfer, 0);       // transfer.in_scattering is the sky
 *
 * The planet is a ball; its air is up to NEBEL_MAX_COMPONENTS kinds of it over each other, each of which thins out with height,
 * or is a layer, and ends where the atmosphere does. Light that was scattered once comes from quadrature with the exact
 * optical depth (formulas/atmosphere.inc) in both directions. What was scattered more often comes from a table over height
 * and the sun's height, made when the atmosphere is: there the light from everywhere is kept by its moments, as much of
 * it as Rayleigh's phase function sees; that is exact for air, and smoothes what dust sends ahead.
 *
 * Places are those of the scene, y up. Units are metres. Nothing here calls a graphics interface.
 *
 * Strides are in bytes; 0: packed.
 */
#ifndef NEBEL_PLANET_H
#define NEBEL_PLANET_H

#include <nebel/light.h>

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

typedef struct nebel_atmosphere_desc {
    nebel_host host;
    double ground_point[3]; /* where the ground is above (y) the planet's centre: m. {0}: the origin */
    double radius;          /* of the ground: m, 1 to 1e12; 0: 6.36e6 */
    double thickness;       /* of the air: m, at most 1e12, at least radius / 1e6; 0: 1e5 */
    nebel_atmosphere_component components[NEBEL_MAX_COMPONENTS];
    uint32_t component_count; /* 0: the Earth's air, see nebel_lookup_atmosphere */
    double ground_albedo[3];  /* what the ground gives back to the air, 0 to 1; {0}: black, presets have their own */
    nebel_atmosphere_quality quality;
} nebel_atmosphere_desc;

/* Known airs: "earth" (constants of the demonstration of Hillaire, A Scalable and Production Ready Sky and Atmosphere
 * Rendering Technique, 2020), "mars", "toy", a ball of 1 km in the Earth's colours, and "moon", which has no air: one
 * kind of it that does nothing to light. NULL where there is none of that name. Any thread. */
NEBEL_API const nebel_atmosphere_desc *nebel_lookup_atmosphere(const char *name);

/* Writes the description with every default in its place. desc may be resolved. Errors: ARGUMENT, VALUE (a number out
 * of range; the description's log says which); *resolved is then untouched. Any thread. */
NEBEL_API nebel_result nebel_resolve_atmosphere(const nebel_atmosphere_desc *desc, nebel_atmosphere_desc *resolved);

/* ---- atmospheres ----------------------------------------------------------------------------- */

typedef struct nebel_atmosphere nebel_atmosphere;

/* Makes an atmosphere that does not change any more, with its table: the same bits however `host.parallel` splits the
 * work. Free it with nebel_destroy_atmosphere. Errors: ARGUMENT (NULL), VALUE (a number out of range; the log says
 * which), MEMORY; *atmosphere is then NULL. Any thread. */
NEBEL_API nebel_result nebel_create_atmosphere(const nebel_atmosphere_desc *desc, nebel_atmosphere **atmosphere);

/* NULL is fine. */
NEBEL_API void nebel_destroy_atmosphere(nebel_atmosphere *atmosphere);

/* What the air does along each of n rays, up to t_max, the ground or the end of the air, whichever comes first. A place
 * below the ground counts as the ground straight above it, the planet's centre as its top (+y): so everywhere in this
 * header. The light of the ground itself is not in it. Strides are in bytes. sun NULL: no light. `error` is what the
 * quality promises: see docs/planet.md. Any thread. Errors: ARGUMENT (NULL, a sun or a ray that is NaN, infinite where
 * it must not be, of no direction, of negative t_max); then no transfers are written. */
NEBEL_API nebel_result nebel_trace_atmosphere(const nebel_atmosphere *atmosphere, const nebel_sun *sun, size_t n,
                                              const nebel_ray *rays, size_t ray_stride, nebel_transfer *transfers,
                                              size_t transfer_stride);

/* Light that arrives at a place. */
typedef struct nebel_irradiance {
    double sun[3]; /* irradiance on a surface that faces the sun; 0 in the planet's shadow */
    double sky[3]; /* irradiance on level ground below the place, of all that the air scatters; above the air, too */
} nebel_irradiance;

/* The light at each of n places; strides in bytes, 0: packed. Nothing tells an error: the sun's part is as exact as the
 * optical depth, the sky's as the table of the quality, both in docs/planet.md, "How far off", whose rays down have
 * this light behind them. Any thread. Errors: ARGUMENT; then no lights are written. */
NEBEL_API nebel_result nebel_compute_atmosphere_irradiance(const nebel_atmosphere *atmosphere, const nebel_sun *sun,
                                                           size_t n, const double (*places)[3], size_t place_stride,
                                                           nebel_irradiance *irradiances, size_t irradiance_stride);

/* ---- many rays from one place ---------------------------------------------------------------- */

/* What the air does to all rays from one place, from a table over their direction and, where they may end within the
 * air, how far they go. The table ends at the horizon on both sides, and keeps phase functions apart, so that neither
 * is smoothed. A ray takes some 0.1 us. */
typedef struct nebel_sky_view nebel_sky_view;

typedef struct nebel_sky_view_desc {
    nebel_host host;
    const nebel_atmosphere *atmosphere; /* must outlive the view */
    nebel_sun sun;
    double position[3]; /* m; below the ground counts as on it */
    int has_ray_ends;   /* 0: rays go to the ground or the end of the air, t_max is not read */
} nebel_sky_view_desc;

/* Makes the table. Errors: ARGUMENT (NULL, a sun or a place that is not in order), MEMORY; *view is then NULL. The same
 * bits however `host.parallel` splits the work. Any thread. */
NEBEL_API nebel_result nebel_create_sky_view(const nebel_sky_view_desc *desc, nebel_sky_view **view);

/* NULL is fine. */
NEBEL_API void nebel_destroy_sky_view(nebel_sky_view *view);

/* What nebel_trace_atmosphere says of n rays from the view's place, from the table. Planes have no gaps, those of three
 * are given all or none, and `group` is not written. t_max NULL: to the ground or the end of the air; one that is NaN
 * or negative counts as 0. A direction may be of any length from 1e-150 to 1e150; those of none meet no air. `error`
 * adds what the table misses, estimated from its own differences, to what nebel_trace_atmosphere tells. Any thread.
 * Errors: ARGUMENT (NULL, a component of the direction too; strides that are neither 0 nor 4). */
NEBEL_API nebel_result nebel_trace_sky_view(const nebel_sky_view *view, size_t n, const double *const direction[3],
                                            const float *t_max, const nebel_transfer_planes *transfers);

/* Where rays meet the ground, and the light there. Planes without gaps; each may be NULL. */
typedef struct nebel_ground_planes {
    float *distance;  /* m; 0 where the view's place is on the ground or below it, INFINITY: the ray does not meet it */
    float *normal[3]; /* the rest means nothing where it does not */
    float *sun[3];    /* irradiance of a surface that faces the sun; 0 in the planet's shadow */
    float *sky[3];    /* irradiance of the ground by all that the air scatters */
} nebel_ground_planes;

/* The ground along n rays from the view's place, as of nebel_trace_sky_view. Any thread. Errors: ARGUMENT (NULL). */
NEBEL_API nebel_result nebel_trace_ground(const nebel_sky_view *view, size_t n, const double *const direction[3],
                                          const nebel_ground_planes *planes);

/* ==== the textured planet ========================================================================= */

/* A planet as tutorials draw it: a textured ball, shells of clouds that turn at speeds of their own, a shell of air.
 *
 *     nebel_textured_planet *planet = NULL;
 *     nebel_create_textured_planet(&(nebel_textured_planet_desc){.center = {0, -6.4e6, 0}}, &planet);
 *
 *     const nebel_textured_planet_query view = {.sun = {.direction = {1, 1, 0}, .irradiance = {3, 3, 3}}, .time = 120};
 *     nebel_shell_hits hits;
 *     nebel_trace_textured_planet(planet, &view, 1, &ray, 0, &hits, 0);
 *
 * The look is that of technique E of the OpenGL 3.3 era: cheap, and right only as a picture. The first part of this header has air as it is.
 * What is generated here, clouds, their detail and the ground, is made on the ball in space, so that no map has a seam
 * where its columns meet, nor a star at the poles.
 *
 * Places are those of the scene, y up. Units are metres, degrees, seconds. Nothing here calls a graphics interface.
 */

/* ---- maps ------------------------------------------------------------------------------------ */

#define NEBEL_MAX_PLANET_MAP_SIZE 16384

/* A picture. Around a ball its first row is at the north pole, and its columns go east from longitude -180. Longitude 0
 * is where x is largest, 90 east where z is least. {0}: none. */
typedef struct nebel_planet_map {
    size_t width, height; /* 1 to NEBEL_MAX_PLANET_MAP_SIZE */
    int channels;         /* 1, or 3: linear red, green and blue */
    const float *texels;  /* rows from above, without gaps; 0 to 1 */
} nebel_planet_map;

typedef enum nebel_planet_map_type {
    NEBEL_PLANET_MAP_CLOUDS = 0, /* 1 channel, around a ball */
    NEBEL_PLANET_MAP_DETAIL,     /* 1 channel, a tile that repeats along both axes */
    NEBEL_PLANET_MAP_GROUND,     /* 3 channels, around a ball: seas, land, ice */
    NEBEL_PLANET_MAP_TYPE_COUNT
} nebel_planet_map_type;

typedef struct nebel_planet_map_desc {
    nebel_host host; /* its log alone: the memory is the caller's */
    nebel_planet_map_type type;
    size_t width, height; /* 0: 1024 x 512 */
    uint32_t seed;
    double coverage; /* how much is cloud, or land: 0 to 1; 0: 0.5 */
} nebel_planet_map_desc;

/* The size that such a map has, in map->width, height and channels; map->texels stays. Errors: ARGUMENT, VALUE. */
NEBEL_API nebel_result nebel_get_planet_map_size(const nebel_planet_map_desc *desc, nebel_planet_map *map);

/* Writes width * height * channels floats. The same everywhere for the same description. Errors as nebel_get_planet_map_size's. */
NEBEL_API nebel_result nebel_generate_planet_map(const nebel_planet_map_desc *desc, float *texels);

/* ---- planets --------------------------------------------------------------------------------- */

#define NEBEL_MAX_CLOUD_SHELLS 8
#define NEBEL_MAX_RAMP_COLORS 16

/* A sphere of clouds. With `coverage_map` and `detail_map` read at (u, v) = (columns, rows) from 0 to 1 its opacity is
 * gain * (coverage(u, v) + (1 - |normal.y|) * (detail(uv_tiling[0] * (u, v)) + the same of uv_tiling[1] and [2])). */
typedef struct nebel_cloud_shell {
    double height; /* above the ground: m, more than 0; 0: 1/100 of the radius for the first one, 2/100 ... */
    /* s, of one rotation to the east against the ground, within 1e12; negative: to the west; 0: none. */
    double rotation_period;
    double color[3];               /* 0 to 1; {0}: white */
    nebel_planet_map coverage_map; /* 1 channel; {0}: generated by seed and coverage */
    nebel_planet_map detail_map;   /* 1 channel; {0}: `coverage_map` where one is given, else generated */
    double uv_tiling[3];           /* within 1e3; whole numbers have no seam; {0}: 3, 7, 13 */
    double gain;                   /* to 1e3; 0: 0.6 */
    double coverage;               /* of what is generated, to 1; 0: 0.5 */
    uint32_t seed;
} nebel_cloud_shell;

/* The shell of air adds brightness * S * V * (1 - V) * ramp(1 - V / 2), where S = 3 normal.sun + 3 and
 * V = min(0.9, |normal.view|). */
typedef struct nebel_atmosphere_shell {
    double height;                         /* above the ground: m; 0: 1/40 of the radius */
    double brightness;                     /* radiance, to 1e6; 0: 1 */
    double ramp[NEBEL_MAX_RAMP_COLORS][3]; /* colours, 0 to 1e6, evenly from 0 to 1 */
    uint32_t ramp_count;                   /* 0: blue in its middle, black at its ends */
    int is_disabled;
} nebel_atmosphere_shell;

typedef struct nebel_textured_planet_desc {
    nebel_host host;
    double center[3];
    double radius;              /* of the ground: m, 1 to 1e12; 0: 6.36e6 */
    double rotation[4];         /* quaternion x y z w of the planet, whose axis is y without; {0}: none */
    double rotation_period;     /* s of a turn of the ground to the east, within 1e12; 0: it stands still */
    nebel_planet_map color_map; /* 3 channels; {0}: generated */
    double land_coverage;       /* land, of a ground that is generated; 0: 0.5 */
    uint32_t seed;
    nebel_cloud_shell cloud_shells[NEBEL_MAX_CLOUD_SHELLS];
    uint32_t cloud_shell_count;
    nebel_atmosphere_shell atmosphere;
} nebel_textured_planet_desc;

typedef struct nebel_textured_planet nebel_textured_planet;

/* Makes a planet that does not change any more; maps are copied. Free it with nebel_destroy_textured_planet. Errors:
 * ARGUMENT (NULL), VALUE (a number out of range; the log says which), MEMORY; *planet is then NULL. Any thread. */
NEBEL_API nebel_result nebel_create_textured_planet(const nebel_textured_planet_desc *desc,
                                                    nebel_textured_planet **planet);

/* NULL is fine. */
NEBEL_API void nebel_destroy_textured_planet(nebel_textured_planet *planet);

/* ---- what a ray meets ------------------------------------------------------------------------ */

typedef struct nebel_textured_planet_query {
    nebel_sun sun;       /* direction {0}: none */
    double ambient[3];   /* radiance from everywhere */
    double time;         /* s, within 1e12 */
    double pixel_spread; /* width of the ray's pixel per metre of way; 0: maps are read without averaging */
} nebel_textured_planet_query;

/* A surface on the way. Behind it, by what it covers, is less to be seen; its own light is added. Ground and clouds
 * reflect as Lambert's; no shell shades another. */
typedef struct nebel_shell_hit {
    double t;           /* m along the ray */
    double radiance[3]; /* with what it covers multiplied in */
    double opacity;     /* 0 to 1 */
    int is_ground;
} nebel_shell_hit;

/* By rising t. Of each shell the side that is met first. */
typedef struct nebel_shell_hits {
    uint32_t count;
    nebel_shell_hit hits[NEBEL_MAX_CLOUD_SHELLS + 2];
} nebel_shell_hits;

/* What each of n rays meets up to its t_max. Strides are in bytes. Any thread. Errors: ARGUMENT (NULL, a query or a ray
 * that is NaN, infinite where it must not be, from more than 1e15 m away, of no direction, of negative t_max). */
NEBEL_API nebel_result nebel_trace_textured_planet(const nebel_textured_planet *planet,
                                                   const nebel_textured_planet_query *query, size_t n,
                                                   const nebel_ray *rays, size_t ray_stride, nebel_shell_hits *hits,
                                                   size_t hit_stride);

/* ---- for those who draw it themselves ---------------------------------------------------------- */

/* What a planet is made of: where the description had zeros stands what they stood for, and the maps are the planet's
 * own, generated ones, too, which live as long as it does. A shell whose detail is {0} takes that from its map. NULL:
 * NULL. */
NEBEL_API const nebel_textured_planet_desc *nebel_get_textured_planet_desc(const nebel_textured_planet *planet);

/* Maps are read between texels and between levels, so that what is small in a picture is averaged. Level 0 is the map;
 * each next one is half as wide and high, rounded down to 1 at the least, and its texels are means of those that they
 * cover. `map` is one of that description. Any thread. Errors: ARGUMENT (NULL, another map, no such level). */
NEBEL_API nebel_result nebel_get_planet_map_mip(const nebel_textured_planet *planet, const nebel_planet_map *map,
                                                uint32_t level, nebel_planet_map *coarser);

/* ==== clouds with volume ========================================================================== */

/* Clouds with volume around a planet: shells of drops or ice between two heights, lit by the sun and the sky.
 *
 *     nebel_clouds *clouds = NULL;
 *     nebel_cloud_lighting *lighting = NULL;
 *     nebel_cloud_workspace *workspace = NULL;
 *     nebel_cloud_transfer nodes;
 *     nebel_create_clouds(&(nebel_clouds_desc){.atmosphere = air, .layer_count = 1}, &clouds); // cumulus
 *     nebel_create_cloud_lighting(&(nebel_cloud_lighting_desc){.clouds = clouds, .sun = sun}, &lighting);
 *     nebel_create_cloud_workspace(lighting, &workspace);                                      // one per thread
 *     nebel_trace_clouds(workspace, 1, &ray, 0, 0.001, NULL, &nodes, 0);
 *
 * The extinction of a layer at a place is one formula of the place, the same from everywhere (docs/clouds.md): noise in
 * three dimensions in the planet's axes, so that there is no seam and no pole; who looks from afar gets its mean over
 * what a pixel covers. Transmittance is integrated to a tolerance. Light is first order exact up to the shadow's
 * lattice, and higher orders by a model, a table of even slabs: docs/clouds.md says how far off.
 *
 * Units are metres; places are those of the scene, y up. Nothing here calls a graphics interface.
 *
 * Strides are in bytes; 0: packed.
 */

#define NEBEL_MAX_CLOUD_LAYERS 4
#define NEBEL_MAX_CLOUD_NODES 16
#define NEBEL_MAX_AIR_SHADOW_SEGMENTS 6
#define NEBEL_MAX_FOG_SHADOW_SEGMENTS 32
#define NEBEL_MAX_CLOUD_THICKNESS_RATIO 1e6 /* of the air's thickness to a layer's */
#define NEBEL_MAX_CLOUD_CELL_RADII 4.       /* of the planet to a layer's size */

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
    double erosion;          /* how deep Worley noise cuts into them, to 1; NEBEL_ZERO: not at all */
    double patchiness;       /* variation of the coverage over ten cells and more, to 1; NEBEL_ZERO: none */
    double droplet_diameter; /* um, twice the effective radius of the droplets: 4 to 50 */
    uint32_t seed;           /* of the noise */
    /* m per unit of time, within 1e12, along x and z at the point of the ground above the centre: the shell rotates. */
    double wind[2];
    nebel_planet_map weather_map; /* one channel; times the coverage; as maps of layers lie. {0}: 1 everywhere */
} nebel_cloud_layer;

typedef struct nebel_clouds_desc {
    nebel_host host;
    const nebel_atmosphere *atmosphere; /* must outlive the clouds */
    nebel_cloud_layer layers[NEBEL_MAX_CLOUD_LAYERS];
    uint32_t layer_count;
} nebel_clouds_desc;

typedef struct nebel_clouds nebel_clouds;

/* Writes a layer with every number in its place, for air of that thickness, in m. desc may be resolved. Errors:
 * ARGUMENT, VALUE (a number out of range; the log, which may be NULL, says which one of the layer); *resolved is then
 * untouched. Any thread. */
NEBEL_API nebel_result nebel_resolve_cloud_layer(double thickness, const nebel_cloud_layer *desc, const nebel_log *log,
                                                 nebel_cloud_layer *resolved);

/* Makes clouds that do not change any more. Free them with nebel_destroy_clouds. Errors: ARGUMENT (NULL), VALUE (a
 * number out of range, layers around a planet without air; the log says which), LIMIT (layers), MEMORY; *clouds is then
 * NULL. Any thread. */
NEBEL_API nebel_result nebel_create_clouds(const nebel_clouds_desc *desc, nebel_clouds **clouds);

/* NULL is fine. */
NEBEL_API void nebel_destroy_clouds(nebel_clouds *clouds);

/* Extinction of all layers at n places, 1/m, as a mean over about `width` metres (0: as it is). Stride in bytes, 0:
 * packed. time: in the units of the wind, within -1e12 and 1e12. Any thread. Errors: ARGUMENT. */
NEBEL_API nebel_result nebel_compute_cloud_extinction(const nebel_clouds *clouds, double time, double width, size_t n,
                                                      const double (*places)[3], size_t place_stride,
                                                      float *extinction);

/* The phase function of a layer's droplets, 1/sr for red, green and blue (light of 680, 550 and 440 nm), at n cosines
 * within -1 and 1 of the angle by which light is turned. Cumulus and stratus: Mie's theory for water, sizes of a gamma
 * distribution with an effective variance of 0.1, by a table; cirrus: NEBEL_PHASE_DROPLETS. docs/clouds.md says how far
 * off. Any thread. Errors: ARGUMENT. */
NEBEL_API nebel_result nebel_cloud_phase(const nebel_clouds *clouds, uint32_t layer, size_t n, const double *cosines,
                                         double (*phases)[3]);

/* ---- light ----------------------------------------------------------------------------------- */

/* Clouds at a moment under a sun. */
typedef struct nebel_cloud_lighting nebel_cloud_lighting;

typedef struct nebel_cloud_lighting_desc {
    nebel_host host;
    const nebel_clouds *clouds; /* must outlive the lighting */
    nebel_sun sun;              /* irradiance {0}: dark */
    double time;                /* within -1e12 and 1e12 */
    double tolerance;           /* of transmittance, of each piece of a ray; 0: NEBEL_DEFAULT_TOLERANCE */
    nebel_isa isa;              /* the same bits for every one; DEFAULT: the best of this processor */
} nebel_cloud_lighting_desc;

/* Errors: ARGUMENT, VALUE (time, tolerance), UNSUPPORTED (isa not available), MEMORY; *lighting is then NULL. Any
 * thread. */
NEBEL_API nebel_result nebel_create_cloud_lighting(const nebel_cloud_lighting_desc *desc,
                                                   nebel_cloud_lighting **lighting);

/* NULL is fine. */
NEBEL_API void nebel_destroy_cloud_lighting(nebel_cloud_lighting *lighting);

/* What was found so far of shadows in a cloud lighting, which must outlive it: some 20 MB and 6 for each layer. Results
 * do not depend on it. One thread at a time. */
typedef struct nebel_cloud_workspace nebel_cloud_workspace;

/* With the lighting's allocator. Errors: ARGUMENT, MEMORY; *workspace is then NULL. Any thread. */
NEBEL_API nebel_result nebel_create_cloud_workspace(const nebel_cloud_lighting *lighting,
                                                    nebel_cloud_workspace **workspace);

/* NULL is fine. */
NEBEL_API void nebel_destroy_cloud_workspace(nebel_cloud_workspace *workspace);

/* What clouds do along a ray up to some places of it. Between two of them transmittance is in between. Together with
 * the air, which leaves A up to each place and has the light L (nebel_trace_atmosphere to each t): from place to place
 * the light of both grows by the mean of A at both times what in_scattering grows by, and by the mean of transmittance
 * times what L grows by; before the first it is L, behind the last L grows times the last transmittance. */
typedef struct nebel_cloud_transfer {
    uint32_t count;                                /* 0: no cloud; else the first is where they begin */
    float t[NEBEL_MAX_CLOUD_NODES];                /* m, ascending */
    float transmittance[NEBEL_MAX_CLOUD_NODES];    /* of clouds alone, grey */
    float in_scattering[NEBEL_MAX_CLOUD_NODES][3]; /* of clouds alone, as if nothing else were on the way */
    float error;                                   /* of transmittance: what quadrature tells, of all pieces */
    /* How often the density was queried after the ray enters layers; 0: it comes near no cloud. */
    uint32_t density_queries;
} nebel_cloud_transfer;

/* Along n rays up to t_max or the ground. pixel_spread: width of a ray's pixel per metre of the way, 0 to 10: what is
 * narrower is seen as a mean; pixel_spreads: one for each ray instead, NULL: the same for all. Strides in bytes, 0:
 * packed. Sixteen rays and more at once take half as long as one by one, and have the same bits. One thread per
 * workspace. Errors: ARGUMENT (NULL, a ray or spread not in order); then nothing is written. */
NEBEL_API nebel_result nebel_trace_clouds(nebel_cloud_workspace *workspace, size_t n, const nebel_ray *rays,
                                          size_t ray_stride, double pixel_spread, const double *pixel_spreads,
                                          nebel_cloud_transfer *nodes, size_t node_stride);

/* What part of the sun's light comes through clouds to n places, straight or scattered on the way; width as of
 * nebel_compute_cloud_extinction. Nothing tells an error: of even layers it is within 0.01, but 0.025 where the sun is
 * less than four degrees high (docs/clouds.md, "Light of clouds", has the tables); of cumulus the mean over the ground
 * is within 0.02, and that of one place is not known. Stride in bytes, 0: packed. One thread per workspace. Errors:
 * ARGUMENT. */
NEBEL_API nebel_result nebel_compute_cloud_sun_transmittance(nebel_cloud_workspace *workspace, double width, size_t n,
                                                             const double (*places)[3], size_t place_stride,
                                                             float *parts);

/* What part of the sky's light comes through clouds to n places, straight or scattered: that of straight above, as a
 * mean over as wide a place as is far above, or width where that is more. Nothing tells an error: docs/clouds.md,
 * "Clouds in pictures", has how far it is from columns under closed clouds, 4 %; that gaps are seen aslant, too, is
 * left out. Stride in bytes, 0: packed. One thread per workspace. Errors: ARGUMENT. */
NEBEL_API nebel_result nebel_compute_cloud_sky_transmittance(nebel_cloud_workspace *workspace, double width, size_t n,
                                                             const double (*places)[3], size_t place_stride,
                                                             float *parts);

/* What part of its light the air has along a ray, under clouds and between them. */
typedef struct nebel_air_shadow {
    uint32_t count; /* of segments; 0: all of its light everywhere */
    /* m, ascending: segment k is from t[k] to t[k + 1]; elsewhere there is no shadow. */
    float t[NEBEL_MAX_AIR_SHADOW_SEGMENTS + 1];
    float transmittance[NEBEL_MAX_AIR_SHADOW_SEGMENTS][3]; /* of what clear air has there, 0 to 1 */
} nebel_air_shadow;

/* Along n rays up to t_max or the ground, as means over pieces: of sunlight what comes through clouds on the way to the
 * sun, of the sky's light what comes through straight from above, by their shares in clear air. Strides in bytes, 0:
 * packed. Nothing tells an error: docs/clouds.md, "Air under clouds", has what closed clouds let through beside what
 * air has before a wall, 0.339 and 0.345, and what is left out. One thread per workspace. Errors: ARGUMENT. */
NEBEL_API nebel_result nebel_trace_cloud_shadow_on_air(nebel_cloud_workspace *workspace, size_t n,
                                                       const nebel_ray *rays, size_t ray_stride,
                                                       nebel_air_shadow *shades, size_t shade_stride);

/* What part of the sun's and of the sky's light fog has along a ray. */
typedef struct nebel_fog_shadow {
    uint32_t count;                             /* of segments; 0: all of it everywhere */
    float t[NEBEL_MAX_FOG_SHADOW_SEGMENTS + 1]; /* m, ascending, as of nebel_air_shadow */
    float sun_transmittance[NEBEL_MAX_FOG_SHADOW_SEGMENTS], sky_transmittance[NEBEL_MAX_FOG_SHADOW_SEGMENTS];
    float error[NEBEL_MAX_FOG_SHADOW_SEGMENTS]; /* of either: what a mean over twice the width differs by */
} nebel_fog_shadow;

/* Along a ray from `begin` on, where fog begins, up to t_max or the ground, as means over pieces, which are longer the
 * farther they are from there and from the end. What comes through is that of nebel_trace_cloud_shadow_on_air. `spread`
 * is the `pixel_spread` of nebel_trace_clouds. One thread per workspace. Errors: ARGUMENT. */
NEBEL_API nebel_result nebel_trace_cloud_shadow_on_fog(nebel_cloud_workspace *workspace, const nebel_ray *ray,
                                                       double begin, double spread, nebel_fog_shadow *shade);

#ifdef __cplusplus
}
#endif

#endif
