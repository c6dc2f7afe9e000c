/* nebel: exact fog for any renderer.
 *
 * nebel answers one question: what does fog do to the light along this piece of a ray?
 *
 *     pixel = transmittance * surface + in_scattering
 *
 * Along origin + t * direction, 0 <= t <= t_max (metres), every volume of fog has an extinction [1/m, RGB]: a shape
 * times a density profile times an amount. Volumes that overlap add. Where a closed form exists the answer is exact;
 * elsewhere it is integrated until its error is below the tolerance, and `error` says what is left.
 *
 * A first program:
 *
 *     nebel_fog *fog = NULL;
 *     nebel_snapshot *now = NULL;
 *     nebel_create_fog(&(nebel_fog_desc){0}, &fog);
 *     nebel_add_volume(fog, &(nebel_volume_desc){
 *         .shape = {.type = NEBEL_SHAPE_SPHERE, .center = {0, 1, -5}, .radius = 2},
 *         .extinction = {.5, .5, .5}, .source = {.7, .7, .8}}, NULL);
 *     nebel_commit_fog(fog, &now);
 *
 *     const nebel_ray ray = {.origin = {0, 1, 0}, .direction = {0, 0, -1}, .t_max = 100};
 *     nebel_transfer transfer;
 *     nebel_trace(now, &(nebel_trace_desc){0}, 1, &ray, sizeof ray, &transfer, sizeof transfer);
 *     // transfer.transmittance = exp(-.5 * 4), transfer.in_scattering = source * (1 - transmittance)
 *
 *     nebel_release_snapshot(now);
 *     nebel_destroy_fog(fog);
 *
 * nebel does NOT open windows, create graphics contexts, decode images, read files, start threads, print, exit or keep
 * global state. Lights are in nebel/light.h; scene files and models in scene.h, renderers in render.h and gl.h.
 *
 * Conventions: metres, right-handed coordinates, linear Rec. 709 RGB. A member of a description that is 0 means the default
 * named beside it (NEBEL_ZERO is 0 where it says so); sizes, counts and pointers without a default must be given. Functions
 * return NEBEL_OK (0) or a negative nebel_result. What went wrong, where and how to mend it goes to the object's log, if it has
 * one. NULL where something is needed gives ARGUMENT alone; functions without a result then do nothing, or return what stands
 * for nothing: 0, "", NULL, a structure of zeros, the default camera, a sun without light, a fog factor of 1, NaN.
 *
 * Threads: different fogs may be used from different threads at once. One fog belongs to one thread at a time. A snapshot
 * never changes and may be queried by any number of threads, each of which may call its host's allocator and log.
 */
#ifndef NEBEL_NEBEL_H
#define NEBEL_NEBEL_H

#include <stddef.h>
#include <stdint.h>

/* Marks what shared libraries give away; all else in them is hidden. */
#if defined(_WIN32) && defined(NEBEL_BUILDING_SHARED)
#define NEBEL_API __attribute__((dllexport))
#elif defined(__GNUC__) && !defined(_WIN32)
#define NEBEL_API __attribute__((visibility("default")))
#else
#define NEBEL_API
#endif

#ifdef __cplusplus
extern "C" {
#endif

#define NEBEL_VERSION_MAJOR 0
#define NEBEL_VERSION_MINOR 1
#define NEBEL_VERSION_PATCH 0

/* The version as text, "0.1.0". Never NULL; lives for ever; any thread. */
NEBEL_API const char *nebel_version(void);

/* ---- results --------------------------------------------------------------------------------- */

/* One list gives the enumeration and its texts. */
#define NEBEL_RESULTS(X)                                                                                               \
    X(OK, 0, "success")                                                                                                \
    X(ERROR_ARGUMENT, -1, "an argument is not what the function takes")                                                \
    X(ERROR_MEMORY, -2, "out of memory")                                                                               \
    X(ERROR_VALUE, -3, "a value is outside its range")                                                                 \
    X(ERROR_UNBOUNDED, -4, "a ray without end gathers infinite light")                                                 \
    X(ERROR_LIMIT, -5, "a limit is exceeded")                                                                          \
    X(ERROR_FILE, -6, "a file could not be read or written")                                                           \
    X(ERROR_FORMAT, -7, "a file is not what it should be")                                                             \
    X(ERROR_UNSUPPORTED, -8, "this build or this version cannot do that")                                              \
    X(ERROR_CANCELLED, -9, "stopped by the caller")

typedef enum nebel_result {
#define NEBEL_RESULT_ENUM(name, value, text) NEBEL_##name = value,
    NEBEL_RESULTS(NEBEL_RESULT_ENUM)
#undef NEBEL_RESULT_ENUM
} nebel_result;

/* The text of a result, in English. Never NULL, also for numbers that are no result; any thread. */
NEBEL_API const char *nebel_result_text(nebel_result result);

/* ---- memory, messages, processors ------------------------------------------------------------ */

/* Memory. Both functions or neither (NULL: malloc and free). `allocate` returns memory aligned for any object, or NULL;
 * `release` takes what `allocate` gave, never NULL. Both are called from the threads that call nebel or run its parts. */
typedef struct nebel_allocator {
    void *(*allocate)(size_t size, void *user);
    void (*release)(void *memory, void *user);
    void *user;
} nebel_allocator;

typedef enum nebel_log_level {
    NEBEL_LOG_ERROR = 0, /* the call fails with `result` */
    NEBEL_LOG_WARNING,   /* it goes on, but not as well as it should; `result` is NEBEL_OK */
    NEBEL_LOG_INFO       /* nothing is wrong, something is worth knowing; `result` is NEBEL_OK */
} nebel_log_level;

/* Messages to the caller: what, where and how to mend it, one line without a newline, valid during the call only. */
typedef void (*nebel_log_fn)(nebel_log_level level, nebel_result result, const char *message, void *user);

typedef struct nebel_log {
    nebel_log_fn write; /* NULL: silent */
    void *user;
} nebel_log;

/* Calls part(data, i) once for each i < parts, in any order and by any threads, and returns when all are done. */
typedef void (*nebel_parallel_for_fn)(size_t parts, void (*part)(void *data, size_t i), void *data, void *user);

typedef struct nebel_parallel {
    nebel_parallel_for_fn run; /* NULL: one part after the other */
    void *user;
} nebel_parallel;

/* What the program that nebel is part of gives an object: first member of every description of one. All of it must be
 * usable as long as the object, or one that was made from it, lives. Results do not depend on it. */
typedef struct nebel_host {
    nebel_allocator allocator;
    nebel_log log;
    nebel_parallel
        parallel; /* read for air, sky views, scenes and OpenGL renderers; others compute in the calling thread */
} nebel_host;

/* Instruction sets, for float queries. DEFAULT takes the best one this processor has. */
typedef enum nebel_isa {
    NEBEL_ISA_DEFAULT = 0,
    NEBEL_ISA_SCALAR,
    NEBEL_ISA_SSE2,
    NEBEL_ISA_AVX2,   /* with FMA3; results do not use fused operations */
    NEBEL_ISA_AVX512, /* F, DQ, BW, VL */
    NEBEL_ISA_NEON,
    NEBEL_ISA_COUNT
} nebel_isa;

/* 1 when this build and this processor can run `isa`, else 0. Any thread. */
NEBEL_API int nebel_isa_available(nebel_isa isa);

/* "default", "scalar", "sse2", "avx2", "avx512" or "neon"; "unknown" for unknown numbers. Any thread. */
NEBEL_API const char *nebel_isa_name(nebel_isa isa);

/* ---- describing fog -------------------------------------------------------------------------- */

/* The numbers that descriptions may hold: squares of lengths stay finite and normal, and arithmetic in float does. */
#define NEBEL_MIN_LENGTH 1e-15     /* m: of what must be > 0 */
#define NEBEL_MAX_LENGTH 1e15      /* m: of lengths, and on each axis of the distance of places from the origin */
#define NEBEL_MIN_SCALE 1e-9       /* of a transform's factors, whatever their sign */
#define NEBEL_MAX_SCALE 1e9        /* the same */
#define NEBEL_MIN_DIRECTION 1e-150 /* the least length of a normal or quaternion, which need not have length 1 */
#define NEBEL_MAX_DIRECTION 1e150  /* the largest */
#define NEBEL_MAX_AMOUNT 1e9       /* of extinction [1/m], radiance and emission [radiance per metre] */
#define NEBEL_ZERO (-1.)           /* 0, for members of which 0 means a default */

typedef enum nebel_shape_type {
    NEBEL_SHAPE_WORLD = 0,    /* everywhere */
    NEBEL_SHAPE_HALF_SPACE,   /* point, normal (pointing out of the fog; any length but 0) */
    NEBEL_SHAPE_BOX,          /* min < max on every axis */
    NEBEL_SHAPE_SPHERE,       /* center, radius > 0 */
    NEBEL_SHAPE_ELLIPSOID,    /* center, radii > 0 */
    NEBEL_SHAPE_CYLINDER,     /* from, to (apart), radius > 0 */
    NEBEL_SHAPE_CAPSULE,      /* from, to (may coincide: a sphere), radius > 0 */
    NEBEL_SHAPE_CONE,         /* from, to (apart), radius_from, radius_to >= 0, one of them > 0 */
    NEBEL_SHAPE_CONVEX,       /* planes n.x <= d; may be unbounded, must not be empty */
    NEBEL_SHAPE_UNION,        /* parts; where parts overlap the body counts once */
    NEBEL_SHAPE_INTERSECTION, /* parts */
    NEBEL_SHAPE_COUNT
} nebel_shape_type;

/* Applied to the shape: scale first, then rotation, then position. */
typedef struct nebel_transform {
    double position[3]; /* m */
    double rotation[4]; /* quaternion x y z w, normalised here; all zero: none */
    double scale[3];    /* all zero: 1; otherwise 1e-9 to 1e9 in size; negative mirrors */
} nebel_transform;

typedef struct nebel_plane {
    double normal[3]; /* any length but 0 */
    double distance;  /* inside where normal . x <= distance */
} nebel_plane;

/* Only the members named beside the type are read. Arrays are copied by the call that takes the description. */
typedef struct nebel_shape {
    nebel_shape_type type;
    nebel_transform transform;
    double min[3], max[3];         /* box */
    double center[3];              /* sphere, ellipsoid */
    double radius;                 /* sphere, cylinder, capsule */
    double radii[3];               /* ellipsoid */
    double from[3], to[3];         /* cylinder, capsule, cone: the axis */
    double radius_from, radius_to; /* cone */
    double point[3], normal[3];    /* half space */
    const nebel_plane *planes;     /* convex: 1 to NEBEL_MAX_SHAPE_PLANES */
    size_t plane_count;
    /* union, intersection: 1 to NEBEL_MAX_SHAPE_LEAVES leaves in all, NEBEL_MAX_SHAPE_NESTING deep. */
    const struct nebel_shape *parts;
    size_t part_count;
} nebel_shape;

#define NEBEL_MAX_SHAPE_PLANES 1024
#define NEBEL_MAX_SHAPE_LEAVES 1024
#define NEBEL_MAX_SHAPE_NESTING 16

/* Voxels: measured or simulated densities. Immutable, owned by whoever retains it. */
typedef struct nebel_grid nebel_grid;

typedef enum nebel_voxel_type {
    NEBEL_VOXEL_FLOAT = 0,
    NEBEL_VOXEL_UINT8, /* 0 to 255 stand for 0 to 1 */
    NEBEL_VOXEL_UINT16 /* 0 to 65535 stand for 0 to 1 */
} nebel_voxel_type;

typedef enum nebel_grid_filter {
    NEBEL_GRID_FILTER_LINEAR = 0, /* trilinear between the middles of voxels; level beyond the outermost middles */
    NEBEL_GRID_FILTER_NEAREST     /* each voxel is of one density */
} nebel_grid_filter;

#define NEBEL_MAX_GRID_SIZE 4096         /* voxels along an axis */
#define NEBEL_MAX_GRID_VOXELS 1073741824 /* voxels in all */

/* A grid of n voxels along an axis cuts the box of its volume into n equal parts, the first one at the box's `min`: the
 * value of a voxel is that of the middle of its part. A voxel of the index i of OpenVDB, whose value is at i, goes from
 * i - 1/2 to i + 1/2 in index space; that of a 3D texture of size n from i / n to (i + 1) / n. */
typedef struct nebel_grid_desc {
    nebel_host host;
    size_t size[3]; /* voxels along x, y and z of the box, 1 to NEBEL_MAX_GRID_SIZE */
    nebel_voxel_type type;
    const void *voxels; /* size[0] * size[1] * size[2] of them, x fastest, then y; copied */
    double scale;       /* density = offset + scale * voxel, 0 to 1e9 for every voxel; scale 0: 1 */
    double offset;
    nebel_grid_filter filter;
    const char *name; /* what it is called; NULL: nothing; copied. Means nothing to nebel but in nebel/scene.h */
} nebel_grid_desc;

/* Makes a grid in *grid, with one owner; on an error *grid is NULL. Memory: the voxels and 16 bytes for each block of
 * 8 x 8 x 8. Cost: linear in the voxels. Any thread. Errors: ARGUMENT, VALUE (NaN, infinite or negative density), LIMIT, MEMORY. */
NEBEL_API nebel_result nebel_create_grid(const nebel_grid_desc *desc, nebel_grid **grid);

/* Noise: a grid that is made, for wisps and clouds. Simplex noise with `frequency` cells across the box, whose waves are two
 * cells long, in `octaves` each of half the size and `gain` times the weight of the one before; octaves whose cells would be
 * smaller than two voxels are left out. Of the sum, 0 to 1, what is above 1 - coverage is density, again 0 to 1 and in steps
 * of 1 / 65535. The same everywhere for the same numbers. */
typedef struct nebel_noise_desc {
    nebel_host host;
    size_t size[3];      /* voxels, as in nebel_grid_desc */
    double frequency[3]; /* of the first octave along each axis of the box, > 0, of two voxels each at least */
    int octaves;         /* 1 to 16; 0: 1 */
    double gain;         /* 0 to 1; 0: 0.5 */
    double coverage;     /* 0 to 1; 0: 1. The less, the more apart are the wisps */
    double falloff[3]; /* 0 to 0.5: over this part of the box the density rises from 0 on its faces, along each axis */
    double offset[3];  /* in cells of the first octave, within NEBEL_MAX_NOISE_OFFSET: how far the noise has drifted */
    double time;       /* the same: in 1 it has become another; smaller octaves change sooner */
    uint32_t seed;     /* any */
    const char *name;  /* as in nebel_grid_desc */
} nebel_noise_desc;

#define NEBEL_MAX_NOISE_OFFSET 1e9
#define NEBEL_MAX_NOISE_VOXELS 8388608 /* in all */

/* Makes a grid of noise in *grid, with one owner; on an error *grid is NULL. Cost: voxels times octaves. Any thread.
 * Errors: ARGUMENT, VALUE, LIMIT, MEMORY. */
NEBEL_API nebel_result nebel_create_noise_grid(const nebel_noise_desc *desc, nebel_grid **grid);

/* The grid's name, "" where it has none; lives as long as the grid. Any thread. */
NEBEL_API const char *nebel_get_grid_name(const nebel_grid *grid);

/* One more owner of the grid; any thread. Returns its argument. */
NEBEL_API nebel_grid *nebel_retain_grid(nebel_grid *grid);

/* One owner less; the last one frees it. Any thread. NULL is fine. */
NEBEL_API void nebel_release_grid(nebel_grid *grid);

/* What fraction of the stated extinction a place has. Height, linear, gaussian and altitude are in world coordinates;
 * radial, soft edge and grid follow the shape and its transform. */
typedef enum nebel_density_type {
    NEBEL_DENSITY_CONSTANT = 0,
    NEBEL_DENSITY_HEIGHT,    /* exp(-(y - base) / scale_height); `below` says what holds under the base. At most 1e18,
                                as is its integral along a piece of a ray [m] */
    NEBEL_DENSITY_LINEAR,    /* 0 at `from`, 1 at `to`, clamped, level across */
    NEBEL_DENSITY_RADIAL,    /* (1 - r^2)^power, r = 1 on the surface; sphere and ellipsoid only */
    NEBEL_DENSITY_GAUSSIAN,  /* exp(-r^2 / (2 sigma^2)) around center */
    NEBEL_DENSITY_SOFT_EDGE, /* 0 on the surface, 1 from `edge_width` within: see below; not world or groups */
    NEBEL_DENSITY_GRID,      /* voxels that fill a box: see nebel_grid_desc; boxes only */
    NEBEL_DENSITY_ALTITUDE, /* as height, above the ground of a ball: exp(-(|p - center| - radius - base) / scale_height);
                                optical depth within 4e-9 of itself */
    NEBEL_DENSITY_COUNT
} nebel_density_type;

/* NEBEL_DENSITY_SOFT_EDGE, with e = `edge_width` and all lengths in the shape's own coordinates. The density is a
 * polynomial along a ray between kinks, so that integrals are exact; near edges and in tapering bodies it is not quite
 * the distance to the surface.
 *
 * Box: product over the axes of min(1, distance to the nearer face / e).
 *
 * Half space, convex: the least of the faces' min(1, distance to the face / e).
 *
 * Sphere, ellipsoid: min(1, g (1 - r^2)), r the distance from the centre in terms of the surface's in that direction.
 *
 * Capsule: min(1, g (1 - r^2)), r the distance from the axis in terms of the radius.
 *
 * Cylinder, cone: min(1, g (w^2 - r^2)) min(1, distance to the nearer end / e), r the distance from the axis and w the
 * radius there, in terms of the larger radius: a cone's edge is deeper where it is thin, and fades out at an apex.
 *
 * g = 1 / (1 - (1 - f)^2), f = min(1, e / R), R the radius, the larger one of a cone, the least one of an ellipsoid:
 * 1 from e within; where e > R at the centre alone. Where flat faces are nearer to each other than 2 e the density
 * stays below 1. */
typedef enum nebel_below {
    NEBEL_BELOW_GROW = 0, /* the exponential goes on under the base */
    NEBEL_BELOW_CONSTANT  /* 1 under the base */
} nebel_below;

/* The base of an altitude density is at least so many scale heights from the centre: the optical depth of fog on balls
 * that bend more would be off by more. */
#define NEBEL_MIN_ALTITUDE_RATIO 50

typedef struct nebel_density {
    nebel_density_type type;
    nebel_below below;     /* height, altitude */
    double base;           /* height, altitude: m */
    double scale_height;   /* height, altitude: m, > 0 */
    double from[3], to[3]; /* linear: m, apart */
    int power;             /* radial: 1, 2 or 3 */
    double center[3];      /* gaussian, altitude: m */
    double radius;         /* altitude: m, > 0 */
    double sigma;          /* gaussian: m, > 0 */
    double edge_width;     /* soft edge: m in the shape's own coordinates, > 0 */
    nebel_grid *grid;      /* grid: not NULL; a volume becomes one more owner of it */
} nebel_density;

/* Where the light goes that fog scatters. The cosine of the angle by which light is turned
 * is +1 straight on: an eye that looks at the sun through fog sees light at +1. */
typedef enum nebel_phase_type {
    NEBEL_PHASE_ISOTROPIC = 0,     /* into all directions alike */
    NEBEL_PHASE_RAYLEIGH,          /* particles far smaller than the light's waves: air */
    NEBEL_PHASE_HENYEY_GREENSTEIN, /* g: the mean cosine */
    NEBEL_PHASE_CORNETTE_SHANKS,   /* g: not quite the mean cosine; Rayleigh where it is 0 */
    NEBEL_PHASE_DRAINE,            /* g and alpha: HENYEY_GREENSTEIN at alpha 0, CORNETTE_SHANKS at 1 */
    NEBEL_PHASE_DROPLETS,          /* diameter: water droplets of fog and clouds */
    NEBEL_PHASE_COUNT
} nebel_phase_type;

#define NEBEL_MAX_G 0.9999
#define NEBEL_MAX_ALPHA 1e9
#define NEBEL_MAX_DROPLET_DIAMETER 50

typedef struct nebel_phase {
    nebel_phase_type type;
    double g;        /* -NEBEL_MAX_G to NEBEL_MAX_G; < 0: backwards */
    double alpha;    /* 0 to NEBEL_MAX_ALPHA */
    double diameter; /* micrometres, 1e-6 to NEBEL_MAX_DROPLET_DIAMETER */
} nebel_phase;

typedef enum nebel_operation {
    NEBEL_OPERATION_ADD = 0,
    NEBEL_OPERATION_EXCLUDE, /* inside the shape there is no fog of this or a lower priority; no density, colours or
                                amounts are read */
    NEBEL_OPERATION_REPLACE, /* inside the shape this fog is there, and none of a lower priority */
    NEBEL_OPERATION_COUNT
} nebel_operation;

/* One volume of fog. Colours are linear RGB.
 *
 * At each place a volume's fog is there unless one that replaces has a higher priority there, or one that excludes the
 * same or a higher one. What is there adds. */
typedef struct nebel_volume_desc {
    nebel_operation operation;
    int priority; /* any */
    nebel_shape shape;
    nebel_density density;
    double extinction[3]; /* 1/m, 0 to 1e9, where the density is 1 */
    double source[3];     /* radiance of opaque fog, 0 to 1e9: alone it gives source * (1 - transmittance) */
    double albedo[3];     /* 0..1: what part of the light that it takes it scatters; not together with source */
    nebel_phase phase;  /* where light is scattered to; makes no difference to light that is the same from everywhere */
    double emission[3]; /* radiance per metre, 0 to 1e9, where the density is 1 */
    double start, cutoff; /* m along a ray from where it starts, >= 0: the volume acts between them alone, whatever its
                             operation; cutoff 0: no end. No physics: see nebel_trace_desc.ignore_distances */
} nebel_volume_desc;

/* What part of the light goes into a direction, per steradian; over the sphere it is 1. `cosine` as above, -1 to 1.
 * NaN when the phase function or the cosine is out of range. Any thread. Sources: Henyey and Greenstein 1941; Cornette
 * and Shanks 1992; Draine 2003; droplets: Jendersie and d'Eon 2023, a fit of Mie's theory for 5 to 50 micrometres with
 * others below. */
NEBEL_API double nebel_evaluate_phase(const nebel_phase *phase, double cosine);

/* The mean cosine over all scattered light, -1 to 1. NaN when the phase function is out of range. Any thread. */
NEBEL_API double nebel_phase_mean_cosine(const nebel_phase *phase);

/* Sampling: the cosine below which `part`, 0 to 1, of the light is scattered; random parts give random cosines as the
 * phase function has them. NaN when something is out of range. Any thread. */
NEBEL_API double nebel_sample_phase(const nebel_phase *phase, double part);

/* ---- fog as it is measured ------------------------------------------------------------------- */

/* Extinction [1/m] of fog through which contrast falls to `contrast` over `visibility` metres: -ln(contrast) /
 * visibility. contrast 0 means 0.05, the meteorological optical range of the WMO; 0.02 gives Koschmieder's. NaN when
 * visibility is not > 0 or contrast not within (0, 1). Any thread. */
NEBEL_API double nebel_extinction_from_visibility(double visibility, double contrast);

/* The other way round: how far one sees [m] in fog of an extinction [1/m]. NaN when the extinction is not > 0 or the
 * contrast not within (0, 1). Any thread. */
NEBEL_API double nebel_visibility_from_extinction(double extinction, double contrast);

/* Extinction [1/m] of fog that holds so much liquid water [g/m^3], where nothing is known of its droplets, and the other
 * way round: 0.1447 water^0.88. Measured fogs differ from that by a factor of two. NaN when the number is not >= 0. Any
 * thread. Source: Kunkel 1984. */
NEBEL_API double nebel_extinction_from_water(double water);
NEBEL_API double nebel_water_from_extinction(double extinction);

/* The same where the effective radius of the droplets [micrometres] is known: twice their area, 3 water / (2 rho
 * radius). Mie's theory has 3 to 10 % more for droplets of 20 to 3 micrometres. NaN when the water is not >= 0 or the radius not > 0. Any thread. */
NEBEL_API double nebel_extinction_from_droplets(double water, double radius);

/* The radius [micrometres] of `number` droplets to the cm^3 that hold so much water [g/m^3], all of one size. NaN when
 * either is not > 0. Any thread. */
NEBEL_API double nebel_droplet_radius(double water, double number);

/* How many droplets of which size: scale r^power exp(-rate r^exponent) to the cm^3 and micrometre of radius r, a
 * modified gamma distribution (Deirmendjian 1969). */
typedef struct nebel_droplet_distribution {
    double scale, power, rate, exponent; /* > 0, > -1, > 0, > 0 */
} nebel_droplet_distribution;

typedef struct nebel_droplet_properties {
    double number_density;   /* to the cm^3 */
    double effective_radius; /* micrometres: the third moment over the second */
    double water;            /* g/m^3 */
    double extinction;       /* 1/m: twice the area of the droplets */
} nebel_droplet_properties;

/* What all droplets together are, in closed form. Any thread. Errors: ARGUMENT (NULL), VALUE (a number out of range, or
 * sums that are not finite); *sums stays as it is then. */
NEBEL_API nebel_result nebel_compute_droplet_properties(const nebel_droplet_distribution *sizes,
                                                        nebel_droplet_properties *sums);

/* Fog with a name: what a volume takes of it, and its droplets where they are known (else all 0). */
typedef struct nebel_fog_preset {
    const char *name;
    const char *citation; /* where the numbers come from */
    nebel_droplet_distribution droplets;
    double extinction[3]; /* 1/m at 0.65, 0.55 and 0.45 micrometres */
    double albedo[3];
    nebel_phase phase;
} nebel_fog_preset;

/* heavy_advection, moderate_advection, heavy_radiation, moderate_radiation, mist, haze, smoke, black_smoke: all of them
 * in this order, and one by its name; NULL where there is none. They live as long as the program. Any thread. */
NEBEL_API const nebel_fog_preset *nebel_list_fog_presets(size_t *count);
NEBEL_API const nebel_fog_preset *nebel_lookup_fog_preset(const char *name);

/* ---- fog that can be edited ------------------------------------------------------------------ */

typedef struct nebel_fog nebel_fog;
typedef struct nebel_snapshot nebel_snapshot;
typedef struct nebel_lighting nebel_lighting; /* see nebel/light.h */
typedef uint64_t nebel_volume_id;             /* 0 is never one */

typedef struct nebel_fog_desc {
    nebel_host host;
    double max_opacity; /* 0 to 1; 0: 1. See nebel_set_max_opacity */
} nebel_fog_desc;

/* Makes an empty fog in *fog; destroy it with nebel_destroy_fog. On an error *fog is NULL.
 * Errors: ARGUMENT, VALUE, MEMORY. */
NEBEL_API nebel_result nebel_create_fog(const nebel_fog_desc *desc, nebel_fog **fog);

/* Frees a fog; its snapshots live on. NULL is fine. */
NEBEL_API void nebel_destroy_fog(nebel_fog *fog);

/* Adds a volume; its id in *id (NULL: not wanted). The description is copied. Cost: amortised O(1), plus the checks of
 * a convex body (linear in its planes on average). On an error nothing has changed. Errors: ARGUMENT, VALUE, LIMIT,
 * MEMORY. */
NEBEL_API nebel_result nebel_add_volume(nebel_fog *fog, const nebel_volume_desc *desc, nebel_volume_id *id);

/* Replaces the description of a volume, which keeps its id. Cost and errors as nebel_add_volume; unknown id: ARGUMENT. */
NEBEL_API nebel_result nebel_update_volume(nebel_fog *fog, nebel_volume_id id, const nebel_volume_desc *desc);

/* Removes a volume. Cost O(1). An id that is unknown or was removed is ARGUMENT. */
NEBEL_API nebel_result nebel_remove_volume(nebel_fog *fog, nebel_volume_id id);

/* Sets the most that all fog together hides, 0 to 1; 0: no limit, as 1. Where transmittance T of a channel is less than
 * 1 - max_opacity it becomes that, and in-scattering is weakened by as much as opacity is: S max_opacity / (1 - T).
 * Every query answers so. No physics: a ray's fog is no longer that of its parts. Cost O(1). Errors: ARGUMENT, VALUE. */
NEBEL_API nebel_result nebel_set_max_opacity(nebel_fog *fog, double max_opacity);

/* Makes an immutable snapshot of the fog as it is. Cost O(n log n) in the number of volumes. The same volumes give the
 * same bits in every query, in whatever order they were added. Free it with nebel_release_snapshot. Errors: ARGUMENT,
 * MEMORY. */
NEBEL_API nebel_result nebel_commit_fog(nebel_fog *fog, nebel_snapshot **snapshot);

/* One more owner of the snapshot; any thread. Returns its argument. */
NEBEL_API nebel_snapshot *nebel_retain_snapshot(nebel_snapshot *snapshot);

/* One owner less; the last one frees it. Any thread. NULL is fine. */
NEBEL_API void nebel_release_snapshot(nebel_snapshot *snapshot);

/* How many volumes the snapshot holds. Any thread. */
NEBEL_API size_t nebel_get_volume_count(const nebel_snapshot *snapshot);

/* The most that all fog together hides, > 0 to 1; 1: no limit, also of NULL. Any thread. */
NEBEL_API double nebel_get_max_opacity(const nebel_snapshot *snapshot);

/* A box with its sides along the axes. */
typedef struct nebel_bounds {
    double min[3], max[3]; /* m; infinite where it has no end */
} nebel_bounds;

/* Without fog that is level and without end along x or z, which is made for places near the origin: NEBEL_DENSITY_ALTITUDE
 * is for all of a planet. */
#define NEBEL_BOUNDS_WITHOUT_LEVEL_FOG 1u

/* Writes bounds outside of which no fog scatters light, and returns 1; or returns 0 where none does, with *bounds as it
 * was. `flags`: 0, or NEBEL_BOUNDS_WITHOUT_LEVEL_FOG. Cost O(n). Any thread. */
NEBEL_API int nebel_get_scattering_bounds(const nebel_snapshot *snapshot, uint32_t flags, nebel_bounds *bounds);

/* ---- queries --------------------------------------------------------------------------------- */

typedef struct nebel_ray {
    double origin[3];    /* m */
    double direction[3]; /* any length but 0; normalised here */
    double t_max;        /* m, >= 0; INFINITY is legal, and ends at 1e18 m */
} nebel_ray;

typedef struct nebel_transfer {
    double transmittance[3]; /* RGB, 0..1 */
    double in_scattering[3]; /* RGB radiance, >= 0 */
    /* Absolute error of the six numbers: a bound; of light from the sun and other lights an estimate with a margin, which
     * scripts/check_lit_truth.py tries on a million random rays. In double hardly ever more than the tolerance and 1e-8,
     * in float than the tolerance and 1e-4 but for one of a thousand rays of the hardest kind, which touch a surface or run
     * level with one to the last bits; at the silhouette of a body whose optical depth is in the thousands one of fourteen
     * has up to 3e-3. Transmittance below the smallest normal number of the precision is 0, and the error that number at
     * least. 1e30: nothing is known of light from height fog that grows beyond 1e18 times its extinction and lets light
     * through. Voxels that the sun lights: an estimate, which none of 13,700 rays through random voxels exceeded; light that
     * reaches between cells of many optical depths each may escape it. */
    double error;
} nebel_transfer;

typedef enum nebel_precision {
    NEBEL_PRECISION_DOUBLE = 0, /* the reference: 64 bit, one ray after the other */
    NEBEL_PRECISION_FLOAT       /* 32 bit with 64-bit positions, several rays at once */
} nebel_precision;

/* Along which segments each of n rays is visible from a light, as the caller knows who knows the surfaces. A ray starts
 * visible; at each of its boundaries [m from its start] it becomes hidden, or visible again. One that starts hidden has 0 as
 * its first boundary. Boundaries are 0 or more and ascend; INFINITY, those beyond the ray's end and pairs of equal ones are
 * legal and do nothing. */
typedef struct nebel_ray_visibility {
    /* n + 1 numbers that do not descend: those of ray i are boundaries[offsets[i]] up to but not boundaries[offsets[i + 1]]. */
    const uint32_t *offsets;
    const float *boundaries; /* may be NULL where there are none */
} nebel_ray_visibility;

typedef struct nebel_trace_desc {
    const nebel_lighting *lighting; /* of the snapshot that is asked; NULL: its fog gives source and emission alone */
    nebel_precision precision;
    nebel_isa isa;      /* float only */
    double tolerance;   /* > 0: absolute on transmittance; relative to max(1, largest source radiance) on in-scattering.
                           0: 0.002. Closed forms stay exact whatever it is. */
    size_t *failed_ray; /* NULL, or where the index of a ray that is an error is written */
    int transmittance_only; /* nonzero: in-scattering is not asked for and comes back 0; `error` is that of
                             transmittance. Much cheaper where fog of different light varies along the ray; same bits of
                             transmittance. */
    int ignore_max_opacity; /* nonzero: the limit of nebel_set_max_opacity does not hold. For renderers that put pieces of rays
                               together and limit their sum: see nebel_get_max_opacity */
    int ignore_distances; /* nonzero: volumes act wherever their shape is. For rays that do not begin at the eye, as
                             those to a light, since `start` and `cutoff` of a volume count from where a ray starts. */
    /* Of the rays of the call: where surfaces do not hide them from the sun. NULL: visible everywhere. Fog in shadow scatters
     * no sunlight; transmittance stays as it is, to the bit. Boundaries are taken as exact: `error` says nothing of them. */
    const nebel_ray_visibility *sun_visibility;
    /* The same of the other lights, one for each light of the lighting, in their order. */
    const nebel_ray_visibility *light_visibility;
} nebel_trace_desc;

#define NEBEL_DEFAULT_TOLERANCE 0.002

/* What the fog does along each of n rays. `ray_stride` and `transfer_stride` are in bytes, 0: packed; multiples
 * of the alignment of what they part. desc NULL: the same as all
 * zero. rays and transfers must not overlap. A ray with t_max 0 gives transmittance 1, in-scattering 0. Float results are the same bits for every isa and
 * for every way of splitting the rays into calls. Any thread. Errors: ARGUMENT (NULL, an unknown precision, an odd stride, a tolerance or a ray that is NaN,
 * infinite where it must not be, of no direction, of negative t_max; boundaries that descend, are negative or NaN),
 * UNSUPPORTED (isa not available), UNBOUNDED (emission in an endless volume that does not absorb), MEMORY (scratch for
 * very many volumes on one ray). On an error the contents of transfers are undefined.
 *
 * Cost of a ray that meets n of N volumes, at most k of them in one place: O(n + log N) to find them where they lie
 * apart, O(N) where all lie over each other. Then O(n log n), however they overlap, for volumes of constant density
 * that add, are of one priority, neither emit nor are lit by the sun, and are neither union nor intersection, from 64
 * of them on a ray. For other volumes O(n k) in float and O(n^2) in double; where k of them differ in light and their
 * density varies each piece of the ray between two ends is integrated, mostly in one to ten steps of O(k). Lights ask for
 * as much again at each place where they are looked at; where nine volumes or more add, of no voxels, altitudes or parts, for O(N)
 * at once and the j of N in whose shadow it is at each place, of which there are not more for more volumes. */
NEBEL_API nebel_result nebel_trace(const nebel_snapshot *snapshot, const nebel_trace_desc *desc, size_t n,
                                   const nebel_ray *rays, size_t ray_stride, nebel_transfer *transfers,
                                   size_t transfer_stride);

/* Visibility: how far one sees along each ray until the transmittance of `channel` (0 red, 1 green, 2 blue) falls to
 * `transmittance` (0 < transmittance < 1): distances[i] in metres, INFINITY where it does not within t_max. In double
 * precision, to 1e-12 relative where the fog is not vanishing. `start` and `cutoff` of volumes count. Errors as
 * nebel_trace. Any thread. */
NEBEL_API nebel_result nebel_invert_transmittance(const nebel_snapshot *snapshot, double transmittance, int channel,
                                                  size_t n, const nebel_ray *rays, size_t ray_stride,
                                                  double *distances);

/* ---- fog at single places -------------------------------------------------------------------- */

/* For renderers that sample: properties at a place, which volume scatters, and majorants along a ray. */

/* A point in fog. */
typedef struct nebel_sample_point {
    double position[3]; /* m */
    /* m from where its ray starts, >= 0, for `start` and `cutoff` of volumes; < 0: these do not count. */
    double distance;
} nebel_sample_point;

/* What all fog together is at a place. Without `emission` a path of light ends or is scattered there. */
typedef struct nebel_medium_properties {
    double extinction[3]; /* 1/m */
    double scattering[3]; /* 1/m: what of it is scattered, albedo times extinction of volumes that have one */
    double emission[3];   /* radiance per metre: emission, and source times extinction of volumes that have one. The
                             sun and the ambient light are not in it: they are the renderer's to bring there */
} nebel_medium_properties;

/* What fog is at each of n places: shapes, profiles and priorities counted. Strides in bytes, 0: packed. places and matter must
 * not overlap. max_opacity does not count, which is no property of places. Cost for each place O(k + log N), k of N
 * volumes near it. Any thread. Errors: ARGUMENT (NULL, a position that is a NaN or farther than NEBEL_MAX_LENGTH). */
NEBEL_API nebel_result nebel_sample_medium(const nebel_snapshot *snapshot, size_t n, const nebel_sample_point *places,
                                           size_t place_stride, nebel_medium_properties *matter, size_t matter_stride);

/* One of the volumes that scatter at a place. */
typedef struct nebel_scatterer {
    nebel_phase phase;
    double scattering[3]; /* 1/m: this volume's part */
    double probability;   /* of its choice, 0 to 1; 0: nothing scatters there, and the rest means nothing */
} nebel_scatterer;

/* Chooses a volume by a random number, 0 <= chance < 1, the more often the more it scatters of `channel` (0 red, 1 green,
 * 2 blue; -1: of all together), so that the mean over all chances of phase value * scattering / probability is what all
 * volumes scatter of that channel, or of each. Any thread. Errors: ARGUMENT, as nebel_sample_medium; a chance or a channel
 * out of range. */
NEBEL_API nebel_result nebel_sample_scatterer(const nebel_snapshot *snapshot, const nebel_sample_point *place,
                                              int channel, double chance, nebel_scatterer *scatterer);

/* A piece of a ray on which fog is bounded. */
typedef struct nebel_majorant_segment {
    double end;           /* m along the ray: where the piece ends, behind where it begins; INFINITY is legal */
    double extinction[3]; /* 1/m: no place of the piece has more. 0 where there is no fog */
    double emission[3];   /* radiance per metre, with `source` as in nebel_medium_properties: the same */
} nebel_majorant_segment;

/* Cuts a ray, whose t_max is not read, into pieces for delta tracking (Woodcock et al. 1965): the piece that begins
 * `from` metres along it, >= 0. The next begins where this one ends. The bound is the extinction itself in volumes of
 * constant density between their ends; of round bodies it is that of a box around them; where density changes without
 * end (height, linear, gaussian) pieces are so short that it is within a few times of the densest place, or that half an
 * optical depth fits in. On an endless piece the fog either is bounded by 0 or goes on for ever, so that a path ends
 * there. Ends of volumes are found to some 1e-12 of the distances; over so short a piece a bound may count a volume
 * that is not there, never leave one out. Cost O(k + log N), k of N volumes on the rest of the ray. Any thread. Errors:
 * ARGUMENT, as nebel_trace; `from` that is a NaN or below 0. */
NEBEL_API nebel_result nebel_next_majorant(const nebel_snapshot *snapshot, const nebel_ray *ray, int ignore_distances,
                                           double from, nebel_majorant_segment *bound);

/* 1 where every volume takes all channels alike, so that one path of light stands for all three; else 0. What volumes
 * scatter and emit may have colour. Any thread. */
NEBEL_API int nebel_is_extinction_gray(const nebel_snapshot *snapshot);

/* ---- planes of rays in, planes of light out: the hot path of a renderer ---------------------- */

/* n rays in caller memory, a plane for each coordinate. Neighbours in a plane are a stride apart, in bytes, a multiple
 * of the number's size; 0: without gaps. What all rays share costs nothing: those of a camera need no offset, those to
 * the sun no planes of directions. Planes of three are given all or none. */
typedef struct nebel_ray_planes {
    double origin[3];       /* m */
    const float *offset[3]; /* m, from `origin` to where a ray starts; NULL: all start at `origin` */
    size_t offset_stride;
    double direction[3];               /* of all rays, any length but 0; not read where one of the next two is given */
    const float *direction_float[3];   /* of each ray, any length but 0; NULL: see `direction` */
    const double *direction_double[3]; /* the same, for fog so far that a float's rounding of the way there shows */
    size_t direction_stride;
    const float *t_max; /* m, >= 0; INFINITY is legal; NULL: rays without end. 0 masks a ray: nothing is asked, and its
                           other numbers may be anything */
    size_t t_max_stride;
} nebel_ray_planes;

/* A part of in-scattering, by where its light comes from: see nebel_light_group in nebel/light.h. */
typedef struct nebel_transfer_group {
    float *in_scattering[3]; /* RGB radiance, >= 0; with the stride of the whole */
} nebel_transfer_group;

#define NEBEL_TRANSFER_GROUPS 3 /* NEBEL_LIGHT_GROUP_COUNT */

/* Light in caller memory: planes like those of the rays, whose elements beyond n stay as they are. Every plane may be
 * NULL: not wanted. What is not wanted is not computed as far as possible; the error in particular costs more than the
 * light of a box. */
typedef struct nebel_transfer_planes {
    float *transmittance[3]; /* RGB, 0..1 */
    size_t transmittance_stride;
    float *in_scattering[3]; /* RGB radiance, >= 0 */
    size_t in_scattering_stride;
    /* The parts of in-scattering, which add up to it but for rounding; with diffusion the environment's is 0 where fog takes more
     * from its light than is there, and the sum may be larger. Asking for them changes no bit of it; where fog gives light of
     * its own and scatters an environment besides, it costs a second march. */
    nebel_transfer_group group[NEBEL_TRANSFER_GROUPS];
    float *error; /* bound of the absolute error: of all six numbers where a plane of in_scattering is given, else of
                     transmittance */
    size_t error_stride;
} nebel_transfer_planes;

/* What the fog does along each of n rays, as nebel_trace in float does: the same rays give the same bits of
 * transmittance and in-scattering, and with in-scattering wanted the same error. Of desc (NULL: the same as all zero)
 * `lighting`, `isa`, `tolerance`, `failed_ray`, `ignore_max_opacity`, `ignore_distances`, `sun_visibility` and `light_visibility` are read. rays and transfers must not overlap. Same
 * bits for every isa and for every way of splitting the rays into calls; a few hundred rays are enough for a call to be
 * worth it. Any thread. Errors as nebel_trace. */
NEBEL_API nebel_result nebel_trace_planes(const nebel_snapshot *snapshot, const nebel_trace_desc *desc, size_t n,
                                          const nebel_ray_planes *rays, const nebel_transfer_planes *transfers);

/* ---- segments in, transmittances out: the hot path of an engine ------------------------------ */

/* n segments in caller memory, from[i] to to[i], three floats each, relative to `origin` (so that floats suffice far
 * from the world's origin). Strides in bytes, multiples of 4; 0: packed. */
typedef struct nebel_segments {
    double origin[3];
    const float *from; /* NULL: all start at `origin` */
    size_t from_stride;
    const float *to;
    size_t to_stride;     /* 0: 12 */
    int ignore_distances; /* see nebel_trace_desc; 0: `start` and `cutoff` count from where a segment starts */
} nebel_segments;

/* The transmittance of one colour channel over each segment, in float throughout: out[i] within 0..1, out_stride in
 * bytes (0: 4). Boxes of constant density take the shortest way; everything else goes through nebel_trace in float. A
 * segment that holds a NaN gives 1. Same bits for every isa. Any thread. Errors as nebel_trace. */
NEBEL_API nebel_result nebel_compute_segment_transmittance(const nebel_snapshot *snapshot, nebel_isa isa, int channel,
                                                           size_t n, const nebel_segments *segments, float *out,
                                                           size_t out_stride);

/* ---- pixels in, pixels out: fog over a finished picture -------------------------------------- */

typedef enum nebel_pixel_depth {
    NEBEL_PIXEL_DEPTH_AXIAL = 0, /* how many times the pixel's way at depth 1: for a camera, along its axis */
    NEBEL_PIXEL_DEPTH_RADIAL     /* m along the pixel's ray */
} nebel_pixel_depth;

/* What the samples of a picture are. Floats hold light, 1 is white; whole numbers are 0 to 1 as 0 to the largest. Numbers of
 * more than a byte have the byte order and the alignment of the machine. */
typedef enum nebel_pixel_type {
    NEBEL_PIXEL_RGBA8 = 0, /* red, green, blue, alpha */
    NEBEL_PIXEL_RGB8,
    NEBEL_PIXEL_RGBA16,
    NEBEL_PIXEL_RGB16,
    NEBEL_PIXEL_RGBA_HALF, /* IEEE 754 binary16 */
    NEBEL_PIXEL_RGB_HALF,
    NEBEL_PIXEL_RGBA_FLOAT,
    NEBEL_PIXEL_RGB_FLOAT,
    NEBEL_PIXEL_COUNT
} nebel_pixel_type;

/* Bytes of a pixel; 0: no such type. Any thread. */
NEBEL_API size_t nebel_pixel_size(nebel_pixel_type type);

/* A picture in caller memory, its depth, and the rays it was seen along. Rows `pitch` bytes apart, 0: without gaps. */
typedef struct nebel_pixels {
    const nebel_lighting *lighting;        /* of the snapshot; NULL: its fog gives source and emission alone */
    double eye[3];                         /* m, where all rays start */
    float corner[3], step_x[3], step_y[3]; /* the way from the eye to depth 1 through pixel (x, y), x and y counted from
                                              0: corner + x step_x + y step_y */
    nebel_pixel_depth depth_type;
    uint32_t width, height; /* 1 to 65536 */
    const float *depth;     /* one per pixel; INFINITY where nothing is */
    size_t depth_pitch;
    const void *color; /* of the type below */
    size_t color_pitch;
    void *output; /* may be color, with the same pitch */
    size_t output_pitch;
    uint32_t first_row, row_count; /* the rows to be done, for threads that share a picture; row_count 0: to the last */
    nebel_pixel_type type;
    int srgb; /* nonzero: whole numbers are sRGB (IEC 61966-2-1), and fog is added to the light they stand for; 0: to the
                 numbers as they stand. Floats are light already: they must have 0 */
    float *transmittance; /* NULL, or where it goes: red, green and blue of each pixel */
    size_t transmittance_pitch;
} nebel_pixels;

/* out = transmittance * color + in-scattering, alpha as it is, in float throughout. Whole numbers are clamped and rounded
 * to nearest; white and radiance 1 are their largest. Without `srgb` the numbers are blended in whatever encoding
 * the picture has: physics asks for light, old hardware and most data sets of foggy pictures blend sRGB as it stands.
 * With `srgb` bytes are off by at most 0.501 (0.5 is the rounding) if radiance is at most 1, numbers of 16 bits by 0.7.
 *
 * Fog that is one volume everywhere, of constant density, grey and of one source, and in RGBA8 as it stands boxes that take
 * all colours alike and have one source, take the shortest way; everything else goes
 * through nebel_trace_planes with the default tolerance. A pixel whose depth is a NaN or negative stays as it is.
 * Same bits for every isa and for every way of splitting the rows. Any thread. Errors as nebel_trace. */
NEBEL_API nebel_result nebel_apply_fog_to_pixels(const nebel_snapshot *snapshot, nebel_isa isa,
                                                 const nebel_pixels *pixels);

#ifdef __cplusplus
}
#endif
#endif
