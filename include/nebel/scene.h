/* nebel scene files, models and pictures: what stands around the fog.
 *
 *     nebel_scene *scene = NULL;
 *     if (nebel_load_scene("mist.json", &(nebel_scene_desc){0}, &scene) != NEBEL_OK) ...;   // the log said why
 *     nebel_snapshot *snapshot = NULL;
 *     nebel_lighting *lighting = NULL;
 *     nebel_commit_scene_fog(scene, &snapshot);
 *     nebel_create_scene_lighting(scene, snapshot, 0, NULL, &lighting);    // what renderers take
 *     ...
 *     nebel_release_lighting(lighting);
 *     nebel_release_snapshot(snapshot);
 *     nebel_destroy_scene(scene);
 *
 * Reads and checks the JSON of docs/scene-file.md, loads models through Assimp, 16-bit PNG height maps, and reads and
 * writes PNG and OpenEXR pictures. Link with libnebel_scene and libnebel.
 *
 * Threads: a loaded scene is read-only and may be used by many threads; everything else as in nebel/nebel.h.
 */
#ifndef NEBEL_SCENE_H
#define NEBEL_SCENE_H

#include <nebel/classic.h>
#include <nebel/light.h>
#include <nebel/planet.h>
#include <nebel/nebel.h>
#include <nebel/particles.h>

#ifdef __cplusplus
extern "C" {
#endif

/* ---- the scene ------------------------------------------------------------------------------- */

typedef enum nebel_projection {
    NEBEL_PROJECTION_PERSPECTIVE = 0,
    NEBEL_PROJECTION_ORTHOGRAPHIC,
    NEBEL_PROJECTION_PANORAMA /* 360 x 180 degrees, equirectangular; the middle of the picture is the view direction */
} nebel_projection;

typedef struct nebel_camera {
    double position[3];  /* m */
    double look_at[3];   /* m, apart from position */
    double up[3];        /* not along the view; any length but 0 */
    double vertical_fov; /* degrees, 0 < fov < 180: perspective */
    double view_height;  /* m, > 0: orthographic, what the picture's height shows */
    nebel_projection projection;
} nebel_camera;

/* A moving camera: a turntable (position turns around look_at about up, once in turntable_frames) or keys; not both. */
typedef struct nebel_camera_key {
    double frame;
    nebel_camera camera;
} nebel_camera_key;

typedef struct nebel_mesh {
    double origin[3];        /* m; positions are relative to it */
    const float *positions;  /* 3 per vertex, m, already rotated and scaled */
    const float *normals;    /* 3 per vertex, unit length; NULL: use the triangles' own */
    const float *uvs;        /* 2 per vertex, v downwards as in the texture's rows; NULL: no texture */
    const uint32_t *indices; /* 3 per triangle, each < vertex_count */
    uint32_t vertex_count;
    uint32_t triangle_count;
    float base_color[3]; /* linear reflectance, 0..1; multiplies the texture */
    int32_t texture;     /* index into textures, or -1 */

    /* Where the alpha of a texture, interpolated between the centres of four texels and from 0 to 1, is below the
     * cutoff the mesh has holes. It takes uvs. */
    float alpha_cutoff; /* 0: no holes; else at most 1 */
    int32_t mask;       /* index into textures; of no meaning without a cutoff */
} nebel_mesh;

typedef struct nebel_texture {
    uint32_t width, height;
    const uint8_t *rgba; /* sRGB and linear alpha, 4 bytes per texel, top row first */
} nebel_texture;

/* What a volume is at a frame. Planes and parts are the same in all keys of a volume. */
typedef struct nebel_volume_key {
    double frame;
    nebel_volume_desc volume; /* whole: what the file's key leaves out is the volume's own */
} nebel_volume_key;

/* What the file says of a volume, beside what it is at one frame. */
typedef struct nebel_volume_track {
    double contrast;               /* that is left at its visibility, 0 < contrast < 1 */
    size_t key_count;              /* 0: it stands still */
    const nebel_volume_key *keys;  /* ascending frames */
    const nebel_volume_desc *base; /* without its keys; NULL where there are none */
} nebel_volume_track;

/* A model as the file places it, in metres with y up. */
typedef struct nebel_scene_model {
    size_t model_index; /* which model of the file it is */
    const char *path;   /* as it is opened */
    int is_heightfield;
    int has_fog; /* its nodes bring some */
    double position[3];
    double rotation[4]; /* quaternion, any length but 0; not of height fields, as scale */
    double scale[3];
    double size[2], height; /* m, > 0: of height fields */
    int has_color;
    double color[3]; /* 0 to 1: in place of its own */
} nebel_scene_model;

typedef enum nebel_planet_model {
    NEBEL_PLANET_PHYSICAL = 0,
    NEBEL_PLANET_TEXTURED,
    NEBEL_PLANET_MODEL_COUNT
} nebel_planet_model;

#define NEBEL_MAX_PLANETS 8

/* One of the section "planet". */
typedef struct nebel_planet {
    nebel_planet_model model;
    nebel_atmosphere_desc atmosphere_desc; /* resolved; its host is not set */
    double sun_angular_diameter;           /* degrees; 0: the sun is not seen */

    const nebel_atmosphere *atmosphere; /* the scene's; NULL until nebel_load_scene_planets */
    double sun_left[3];                 /* of the first one: what planets leave of sunlight at the scene's origin */

    nebel_cloud_layer cloud_layers[NEBEL_MAX_CLOUD_LAYERS]; /* PHYSICAL: wind in m per frame; maps are the scene's */
    uint32_t cloud_layer_count;
    const nebel_clouds *clouds; /* the scene's; NULL until nebel_load_scene_planets, and where there are no layers */

    /* TEXTURED: periods are counted in frames; maps are the scene's; its host is not set. */
    nebel_textured_planet_desc textured_desc;
    const nebel_textured_planet *textured; /* the scene's; NULL until nebel_load_scene_planets */
} nebel_planet;

/* The sun at a frame. */
typedef struct nebel_sun_key {
    double frame;
    nebel_sun sun; /* its direction of unit length */
} nebel_sun_key;

/* Everything the file says, resolved: defaults filled in, directions normalised. Owned by the scene. */
typedef struct nebel_scene_data {
    nebel_camera camera;
    size_t camera_key_count;             /* 0: the camera stands still or turns */
    const nebel_camera_key *camera_keys; /* ascending frames */
    uint32_t turntable_frames;           /* 0: none */

    double background[3]; /* radiance where no surface is, */
    int shows_ambient;    /* or the ambient light from that direction in its place */
    int has_sun;
    double sun_direction[3];       /* towards the sun, unit length */
    double sun_irradiance[3];      /* on a surface that faces it, before any fog */
    size_t sun_key_count;          /* 0: the sun stands still */
    const nebel_sun_key *sun_keys; /* ascending frames; until a frame is lit, the sun above is the section's */
    double ambient[3];             /* radiance, the same from everywhere, */
    nebel_environment environment; /* or where it is not CONSTANT this in its place; a map is the scene's */
    const char *environment_path;  /* of a map, as it is opened; NULL: none */
    size_t light_count;            /* the section "lights" */
    const nebel_light *lights;
    const char *const *light_names; /* UTF-8; "" where the file gives none */
    double max_opacity;             /* of all fog; 0: no limit */

    size_t volume_count; /* the fog, in the order of the file; what moves stands as it is at frame 0 */
    const nebel_volume_desc *volumes;
    const char *const *volume_names; /* UTF-8; "" where the file gives none */

    const nebel_volume_track *volume_tracks; /* of the same volumes */

    size_t animated_volume_count; /* that have keys, or noise that moves; 0: the fog is the same at every frame */
    int has_endless_motion;       /* something moves from frame to frame without end: noise, or a planet that turns */

    size_t nebula_count; /* generated by nebel_generate_scene_particles; their hosts are not set */
    const nebel_nebula_desc *nebulae;
    const char *const *nebula_names;
    const nebel_transform *nebula_transforms; /* where the file puts their points; of no meaning without points */
    size_t particle_count;                    /* of all nebulae */

    const nebel_cells_desc *cells; /* good for nebel_create_cells; its host is not set. NULL: none */
    const char *const *cell_names; /* UTF-8; "" where the file gives none */

    double classic_z_near, classic_z_far; /* of classic_d3d9 [m], as in nebel_method_desc */
    const nebel_factor_desc *classic;     /* numbers of the fog factors; the mode is the method's to set. NULL: none */
    nebel_curve_type classic_curve;       /* and what the same section says of other methods */
    const float *classic_table;           /* of NEBEL_CURVE_ENTRIES, for the curve TABLE */
    const nebel_d3d9_fog *classic_d3d9;   /* switched on. NULL: none */

    size_t planet_count;         /* at most NEBEL_MAX_PLANETS; of the model TEXTURED: 1 */
    const nebel_planet *planets; /* the sky of the first one is that of the scene's origin */

    const nebel_diffusion_desc *diffusion; /* the section "multiple_scattering"; NULL: none */

    size_t path_count; /* that it names, as they are opened; and, once models are loaded, what those name in turn */
    const char *const *paths;

    size_t model_count;
    const nebel_scene_model *models;

    size_t mesh_count; /* 0 until nebel_load_scene_models */
    const nebel_mesh *meshes;
    size_t texture_count;
    const nebel_texture *textures;
} nebel_scene_data;

typedef struct nebel_scene nebel_scene;

/* Errors are logged as "FILE:LINE:COLUMN: key: what is wrong; what is allowed". Threads make the air of planets. */
typedef struct nebel_scene_desc {
    nebel_host host;

    /* Models are read by a program of their own, nebel-read-model, within limits of memory and time: a damaged or hostile
     * file costs an error, not the process. */
    const char *model_reader; /* its path; NULL: bin/nebel-read-model of the prefix that nebel was configured for */
    int models_in_process;    /* nonzero: models are read in this process, without limits; for trusted files alone */

    /* The most bytes that the scene may take for voxels, noise, maps, particles, fog, planets and models; 0:
     * NEBEL_DEFAULT_SCENE_MEMORY. For each 64 MB it may take about a second of preparation. What exceeds either is LIMIT before
     * the work is begun. */
    uint64_t memory;
} nebel_scene_desc;

#define NEBEL_DEFAULT_SCENE_MEMORY ((uint64_t)4 << 30)

/* Reads and checks a scene file: a regular one, or what is open already (/dev/stdin, /dev/fd/3). Models named in it are
 * not loaded yet. "-" is a file name like any other. On an error *scene is NULL. Errors: ARGUMENT, FILE, FORMAT, LIMIT,
 * UNSUPPORTED, MEMORY. */
NEBEL_API nebel_result nebel_load_scene(const char *path, const nebel_scene_desc *desc, nebel_scene **scene);

/* The same from memory. `name` stands for the file in messages; relative paths in the scene start at its folder. The
 * text need not end in a zero byte. */
NEBEL_API nebel_result nebel_parse_scene(const char *text, size_t size, const char *name, const nebel_scene_desc *desc,
                                         nebel_scene **scene);

/* Loads the models and height fields that the scene names. Each model is read by nebel-read-model (nebel_scene_desc),
 * which takes some 5 ms more than reading it here. Idempotent. Not thread safe against readers of the same scene.
 * Errors: FILE, FORMAT, LIMIT, UNSUPPORTED, MEMORY; the scene stays usable without models. */
NEBEL_API nebel_result nebel_load_scene_models(nebel_scene *scene);

/* Makes the scene's planets: textured ones, or their air. Fog of snapshots from now on is lit by what the first one's
 * air, and the shadows of others, leave of the sun at the scene's origin and, where the file has no ambient light, by
 * the first one's sky there: `environment` becomes a map of it. Without this call, and for the light of fog before it,
 * there is no air. Idempotent. Some 0.25 s a planet with air on one thread, 1 s with quality "precise". Not thread safe
 * against readers of the same scene. Errors: MEMORY; there is no air then. */
NEBEL_API nebel_result nebel_load_scene_planets(nebel_scene *scene);

/* Gives planets other numbers, once nebel_load_scene_planets has made them: as many planets as the scene's data have,
 * of which components count but for their profiles, the ground's albedo and the sun's diameter; of layers of clouds all
 * but type, seed and weather_map; of textured planets rotation_period, land_coverage, the shell of air, and shells of
 * clouds but for seeds and maps. All else stays. What was made is made anew, at the same cost, with the light at the
 * scene's origin; the atmospheres, clouds and textured planets of before are gone. On an error all stays as it was. Not
 * thread safe against readers of the same scene, nor while a frame of it is rendered; renderers are to be made anew.
 * Errors: ARGUMENT, VALUE (a number out of range; the log says which), MEMORY. */
NEBEL_API nebel_result nebel_update_scene_planets(nebel_scene *scene, const nebel_planet *planets);

/* Loads models again, placed and coloured as `models` says; those of the file that are not among them are left out. The
 * scene's data have meshes and textures of these then, and what they pointed to before is gone, as nodes with fog are
 * where they were. Where that fails all stays as it was. O(what their files hold). Thread safety and errors: as above;
 * ARGUMENT (a source that the file has not). */
NEBEL_API nebel_result nebel_reload_scene_models(nebel_scene *scene, const nebel_scene_model *models, size_t count);

/* The scene's data; lives as long as the scene (mesh pointers change with nebel_load_scene_models). Never NULL. */
NEBEL_API const nebel_scene_data *nebel_get_scene_data(const nebel_scene *scene);

/* The camera at a frame: standing, turning or between its keys (smooth cubic through the keys, still before the first
 * and after the last). */
NEBEL_API nebel_camera nebel_get_scene_camera(const nebel_scene *scene, double frame);

/* The same of any 1 or more keys. */
NEBEL_API nebel_camera nebel_interpolate_camera(const nebel_camera_key *keys, size_t count, double frame);

/* The sun at a frame: standing, or between its keys, on a cubic through their directions, made unit ones, and within
 * the range of their irradiances; still before the first and after the last. Without a sun one of no light. */
NEBEL_API nebel_sun nebel_get_scene_sun(const nebel_scene *scene, double frame);

/* The same of any 1 or more keys. */
NEBEL_API nebel_sun nebel_interpolate_sun(const nebel_sun_key *keys, size_t count, double frame);

/* Lights the scene by the sun of a frame, where it has keys: the sun of the scene's data becomes that, and what the air
 * of a planet leaves of it at the scene's origin, with the sky there, is made anew (0.1 s), as far as
 * nebel_load_scene_planets has made it before. Frames and snapshots from now on have that light. Not thread safe
 * against readers of the same scene, nor while a frame of it is rendered. Errors: ARGUMENT (NULL), VALUE (a frame
 * beyond 1e12), MEMORY; the sky is then as it was. */
NEBEL_API nebel_result nebel_set_scene_frame(nebel_scene *scene, double frame);

/* The same by any sun, also in a scene without one; NULL: none. Errors: as above; ARGUMENT also for a sun with numbers
 * that are not finite, without a direction, or of less than no light. */
NEBEL_API nebel_result nebel_set_scene_sun(nebel_scene *scene, const nebel_sun *sun);

/* The light of the sun that fog of a snapshot has: of the sun of the scene's data what the planets' air, their shadows
 * and, as the wind has moved them until the frame, their clouds leave at the scene's origin. Without a sun one of no
 * light. Where there are clouds, some 10 ms. Errors: ARGUMENT, MEMORY, VALUE (a frame beyond 1e12); *sunlight is then
 * untouched. */
NEBEL_API nebel_result nebel_find_scene_sunlight(const nebel_scene *scene, double frame, nebel_sun *sunlight);

/* The same, and the ambient light that it has: that of the scene's data, of which clouds dim a planet's own sky by its
 * intensity. On an error both are untouched. */
NEBEL_API nebel_result nebel_find_scene_light(const nebel_scene *scene, double frame, nebel_sun *sunlight,
                                              nebel_environment *ambient);

/* The particles of all nebulae, particle_count of the scene's data, one nebula after the other. Free them before the
 * scene. Errors: ARGUMENT, MEMORY, VALUE (a nebula in whose shape no place is found). */
NEBEL_API nebel_result nebel_generate_scene_particles(const nebel_scene *scene, nebel_particle **particles);
NEBEL_API void nebel_free_scene_particles(const nebel_scene *scene, nebel_particle *particles); /* NULL is fine */

/* A volume at a frame: at its first key before, at its last after, between them on a cubic through the keys on which no
 * number leaves its range. Noise is that of frame 0. Its arrays are the scene's. index < volume_count. */
NEBEL_API nebel_volume_desc nebel_get_scene_volume(const nebel_scene *scene, size_t index, double frame);

/* The same of any 1 or more keys of one volume. */
NEBEL_API nebel_volume_desc nebel_interpolate_volume(const nebel_volume_key *keys, size_t count, double frame);

/* What the grid of a volume is at a frame, with one more owner, who releases it: noise that moves is made anew, at the
 * cost of nebel_create_noise_grid; any other grid is itself. `grid` NULL: NULL. On an error *at is NULL. Errors: LIMIT,
 * VALUE (drifted too far), MEMORY. */
NEBEL_API nebel_result nebel_get_scene_grid(const nebel_scene *scene, nebel_grid *grid, double frame, nebel_grid **at);

/* What a scene file says of noise. */
typedef struct nebel_scene_noise {
    nebel_noise_desc desc;         /* its host, offset, time and name are none */
    double velocity[3], evolution; /* of its offset and its time, per frame */
} nebel_scene_noise;

/* Whether a grid is noise of the scene, or of nebel_update_scene_noise; then *noise is what the file says of it, along
 * our axes (y up) and with the defaults of what it leaves out. Its name tells. 0 also where memory is out. Any thread.
 */
NEBEL_API int nebel_get_scene_noise(const nebel_scene *scene, const nebel_grid *grid, nebel_scene_noise *noise);

/* Such a grid with other numbers, in *changed with one owner; on an error *changed is NULL. Host, offset, time and name
 * of *noise do not count. It moves with nebel_get_scene_grid, and nebel_save_scene writes it. Cost: that of
 * nebel_create_noise_grid. Any thread. Errors: ARGUMENT (no such grid), FORMAT (out of range), VALUE (cells of less
 * than two voxels), LIMIT, MEMORY. */
NEBEL_API nebel_result nebel_update_scene_noise(const nebel_scene *scene, const nebel_grid *grid,
                                                const nebel_scene_noise *noise, nebel_grid **changed);

/* What a volume comes from. */
typedef enum nebel_volume_origin {
    NEBEL_VOLUME_STATIC = 0, /* its numbers stand in the section "fog", and hold at every frame */
    NEBEL_VOLUME_ANIMATED,   /* it has keys */
    NEBEL_VOLUME_IMPORTED,   /* the settings of another program */
    NEBEL_VOLUME_FROM_NODE   /* a node of a model */
} nebel_volume_origin;

/* index < volume_count. */
NEBEL_API nebel_volume_origin nebel_get_volume_origin(const nebel_scene *scene, size_t index);

/* Light that fog scatters more than once, of lightings from now on: what the section "multiple_scattering" says, in
 * place of it. NULL: none; the description is copied. Not thread safe against readers of the same scene. Errors:
 * ARGUMENT; LIMIT where the scene may not take so much, which leaves it as it is. */
NEBEL_API nebel_result nebel_set_scene_diffusion(nebel_scene *scene, const nebel_diffusion_desc *desc);

/* Counts what the host itself is about to take for the scene, such as pictures, as nebel_scene_desc.memory does. `what`
 * begins the message: "--size". Not thread safe against readers of the same scene. Errors: ARGUMENT, LIMIT. */
NEBEL_API nebel_result nebel_charge_scene(nebel_scene *scene, const char *what, uint64_t bytes);

/* A snapshot of the scene's fog at a frame, its nebulae's particles and, as exact fog, its cells among it; release it
 * with nebel_release_snapshot before the scene's allocator goes away. On an error *snapshot is NULL. Errors: ARGUMENT,
 * MEMORY, VALUE, LIMIT. */
NEBEL_API nebel_result nebel_commit_scene_fog_at(const nebel_scene *scene, double frame, nebel_snapshot **snapshot);

/* The same at frame 0. */
NEBEL_API nebel_result nebel_commit_scene_fog(const nebel_scene *scene, nebel_snapshot **snapshot);

/* The same at a frame with other noise: each noise of the scene gets a seed made of `seed` and its own, so that seeds
 * give independent fog and the same seed the same. Makes every noise anew, at the cost of nebel_create_noise_grid. Any
 * thread. */
NEBEL_API nebel_result nebel_commit_scene_fog_anew(const nebel_scene *scene, double frame, uint32_t seed,
                                                   nebel_snapshot **snapshot);

/* The same without the particles, for renderers that draw those in another way. */
NEBEL_API nebel_result nebel_commit_scene_volumes_at(const nebel_scene *scene, double frame, nebel_snapshot **snapshot);

/* The scene's lights at a frame for a snapshot of its fog: the sun and the sky as they are at the scene's origin, under
 * its planet's air and clouds. `previous` as in nebel_lighting_desc. Any thread, as long as nothing changes the scene.
 * On an error *made is NULL. Errors: ARGUMENT, VALUE, and those of nebel_create_lighting. */
NEBEL_API nebel_result nebel_create_scene_lighting(const nebel_scene *scene, nebel_snapshot *snapshot, double frame,
                                                   const nebel_lighting *previous, nebel_lighting **made);

/* NULL is fine. */
NEBEL_API void nebel_destroy_scene(nebel_scene *scene);

/* Writes changes back into a scene file. `before` is what nebel_get_scene_data gave for this file; `changed` is a copy
 * of it with other numbers in the camera and its motion, the background, the sun, the ambient light (of the map that
 * the file names, or of none), max_opacity, the classic fog, noise (by nebel_update_scene_noise), the nebulae (points
 * by their place alone) and their names, the cells with their names, portals, model, span and grouping (as many cells,
 * each of the same kind), the models (fewer may be left, in their order), the point lights (as many, each of the same
 * type), the planets (as far as nebel_update_scene_planets takes them), and with other names, numbers or kinds of
 * volumes of origin STATIC or ANIMATED. The sun and the section "classic" may come and go. Its volumes may be others:
 * sources[i] is the place in `before` of what is changed->volumes[i] now, ascending, or NEBEL_NEW_VOLUME; volumes of
 * `before` that are missing leave the file, as long as they are of origin STATIC or ANIMATED. sources NULL: the same
 * volumes. changed->volume_tracks is as long as changed->volumes; of a volume with keys `base` counts and not what
 * stands in `volumes`. NULL: keys and contrast are as they were.
 *
 * What differs between the two is written in its place, in the file's own unit, axes and words (a visibility stays a
 * visibility, where the fog is not of extinction 0), with 15 digits; a key that is missing is added, one that has
 * become wrong goes. A volume of another operation, shape or density than before is written anew as a whole, new ones
 * stand behind the others. Every other byte stays. The file is replaced as a whole, as by nebel_write_image, or left
 * alone where nothing has changed. On an error it is as it was. Errors: as nebel_load_scene; ARGUMENT (the file has
 * other volumes, nebulae or cells than `before`; a volume that cannot leave); FORMAT also where the new numbers are no
 * valid scene. */
#define NEBEL_NEW_VOLUME SIZE_MAX
NEBEL_API nebel_result nebel_save_scene(const char *path, const nebel_scene_desc *desc, const nebel_scene_data *before,
                                        const nebel_scene_data *changed, const size_t *sources);

/* ---- pictures -------------------------------------------------------------------------------- */

/* A picture of float planes, top row first: samples[(y * width + x) * channel_count + c]. */
typedef struct nebel_image {
    uint32_t width, height;
    uint32_t channel_count;
    const char *const *channel_names; /* "R", "G", "B", "transmittance.R", ... in EXR naming */
    float *samples;
} nebel_image;

/* Reads a PNG (8 or 16 bit; 0..1, values as stored) or EXR (scan lines or tiles, half, float or uint channels, sorted
 * as R, G, B, A, then the others by name). The host must not be NULL, here and below. Free with nebel_free_image and the
 * same allocator. Errors: ARGUMENT, FILE, FORMAT, LIMIT, UNSUPPORTED, MEMORY. */
NEBEL_API nebel_result nebel_read_image(const char *path, const nebel_host *host, nebel_image *image);
NEBEL_API void nebel_free_image(const nebel_host *host, nebel_image *image);

typedef enum nebel_image_format {
    NEBEL_IMAGE_NONE = 0, /* a name of neither ending */
    NEBEL_IMAGE_PNG, /* channels R, G, B in 0..1, already in sRGB: 8 bit with an ordered rounding, the same in every
                        run */
    NEBEL_IMAGE_EXR  /* every channel as 32-bit float, ZIP compressed */
} nebel_image_format;

/* What nebel_write_image writes at `path`: by the ending of the name, .png or .exr in any case. /dev/null and
 * what is open already (/dev/stdout, /dev/fd/3) take PNG where their name has neither. Thread safe. */
NEBEL_API nebel_image_format nebel_get_image_format(const char *path);

/* Regular files are written to a temporary name beside the target and renamed, so that on an error nothing of the
 * target has changed and no temporary file is left. /dev/null is written directly; /dev/stdout, /dev/stderr and
 * /dev/fd/N are written on from where they stand; other devices, pipes and sockets are refused. Where a limit of the
 * size of files may be met, ignore SIGXFSZ. Errors: ARGUMENT, FILE, FORMAT (unknown ending), MEMORY. */
NEBEL_API nebel_result nebel_write_image(const char *path, const nebel_host *host, const nebel_image *image);

/* The same from the top down, a few rows at a time, in memory for those alone; with a record of what the picture was
 * made from, where that is wanted. One thread at a time. */
typedef struct nebel_image_writer nebel_image_writer;

enum { NEBEL_MAX_RECORD = 127 };

typedef struct nebel_image_desc {
    nebel_host host;
    uint32_t width, height, channel_count;
    const char *const *channel_names; /* as in nebel_image; they stay until the writer is destroyed, as does `record` */
    const char *record; /* 1 to NEBEL_MAX_RECORD printable characters of ASCII, kept in the file; NULL: none */
} nebel_image_desc;

/* Makes the temporary file. Errors: as nebel_write_image. */
NEBEL_API nebel_result nebel_create_image_writer(const char *path, const nebel_image_desc *desc,
                                                 nebel_image_writer **writer);

/* The next rows: a multiple of 64 of them, or all that are left. A writer that has failed takes no more. Errors: ARGUMENT, FILE, MEMORY. */
NEBEL_API nebel_result nebel_add_image_rows(nebel_image_writer *writer, uint32_t rows, const float *samples);

/* Gives the file its name, once, when it has all its rows. The bytes are those of nebel_write_image. Errors: ARGUMENT, FILE, MEMORY. */
NEBEL_API nebel_result nebel_finish_image(nebel_image_writer *writer);

/* What was not finished is given up, without a trace. NULL is fine. */
NEBEL_API void nebel_destroy_image_writer(nebel_image_writer *writer);

/* Reads the record of a picture or a film. "" if there is no such file, if it has no record or if it is not whole: it
 * ends before what its headers say, or a checksum is wrong. PNG has checksums of everything, OpenEXR of the pixels that
 * it compresses, WebP has none. Thread safe. Errors: ARGUMENT. */
NEBEL_API nebel_result nebel_read_record(const char *path, char record[NEBEL_MAX_RECORD + 1]);

/* Whether nebel_write_image is likely to succeed at `path`, to be asked before the work: the ending is known, and a
 * temporary file can be made beside the target (it is made, and removed) or the device is open to writing. The target
 * does not change. Thread safe. Errors: ARGUMENT, FILE, FORMAT (unknown ending), MEMORY. */
NEBEL_API nebel_result nebel_check_image_path(const char *path, const nebel_host *host);

/* ---- films ----------------------------------------------------------------------------------- */

/* Pictures one after the other in one file: an animated WebP that begins again at its end. Each is compressed when it
 * is added; what is compressed stays in memory, libwebp's own, until the film is finished. Films are independent of
 * each other; one belongs to one thread at a time. nebel may be built without libwebp: nebel_scene_libraries tells. */
typedef struct nebel_movie nebel_movie;

enum { NEBEL_MAX_MOVIE_RATE = 100, NEBEL_DEFAULT_MOVIE_RATE = 24, NEBEL_DEFAULT_MOVIE_QUALITY = 85 };

typedef struct nebel_movie_desc {
    nebel_host host;
    double frames_per_second; /* 1 to NEBEL_MAX_MOVIE_RATE, 0: 24; each picture begins at the nearest millisecond */
    int quality;              /* 1 to 99: more is larger and better; 100: the bytes of a PNG, without loss; 0: 85 */
} nebel_movie_desc;

/* Whether a name is one of a film: it ends in .webp, in any case. Thread safe. */
NEBEL_API int nebel_is_movie_path(const char *path);

/* Nothing is at `path` before the film is finished, but whether it can be written is tried, as by
 * nebel_check_image_path. Errors: ARGUMENT, VALUE, FORMAT (unknown ending), FILE, MEMORY, UNSUPPORTED (built without).
 */
NEBEL_API nebel_result nebel_create_movie(const char *path, const nebel_movie_desc *desc, nebel_movie **movie);

/* Channels R, G, B in 0..1, already in sRGB, become the bytes that nebel_write_image gives a PNG. All pictures of a
 * film have one size, at most 16383 x 16383. On an error the film is as it was. Errors: ARGUMENT, LIMIT, MEMORY. */
NEBEL_API nebel_result nebel_add_movie_frame(nebel_movie *movie, const nebel_image *image);

/* The record that the file will have, as that of nebel_image_desc; it is copied. Errors: ARGUMENT. */
NEBEL_API nebel_result nebel_set_movie_record(nebel_movie *movie, const char *record);

/* Writes the file, once, as nebel_write_image does: as a whole or not at all. Pictures that follow each other and are
 * equal, or nearly so below a quality of 100, become one that lasts longer. Errors: ARGUMENT (no pictures), FILE,
 * MEMORY. */
NEBEL_API nebel_result nebel_finish_movie(nebel_movie *movie);

/* A film that was not finished is given up, without a trace. NULL is fine. */
NEBEL_API void nebel_destroy_movie(nebel_movie *movie);

/* ---- grids ----------------------------------------------------------------------------------- */

/* Voxels in files. Which kind a file is says its name: .nvdb NanoVDB, .vdb OpenVDB (builds that have it: see
 * nebel_scene_libraries), .png one picture for each slice, anything else numbers one after the other. */
typedef struct nebel_grid_file {
    const char *path; /* PNG: with a run of # in its name, in whose place the number of a slice stands, from 0, as wide
                         as the run */
    nebel_grid_filter filter;
    const char *grid_name; /* NanoVDB, OpenVDB: the name of the grid among those in the file; NULL: the first */
    size_t slice_count;    /* PNG: how many, 1 to NEBEL_MAX_GRID_SIZE; slice k is the k-th layer along z */
    size_t size[3];        /* numbers: voxels along x, y and z; x fastest, least significant byte first */
    nebel_voxel_type type; /* numbers */
    const char *name;      /* nebel_get_grid_name of the grid; NULL: none */
} nebel_grid_file;

/* Reads a grid; release it with nebel_release_grid. On an error *grid is NULL.
 *
 * NanoVDB: grids of version 32 of float, double, Fp4, Fp8, Fp16 and FpN, without compression, by zip or by Blosc; the
 * box of all active voxels with its inactive ones, of value as stored (the file's own transform is left out). Level
 * sets are refused. PNG: grey, 8 or 16 bits, 0 to 1 as stored, the top row at the largest y.
 *
 * Any thread. Errors: ARGUMENT, FILE, FORMAT (among them a file that is cut off, or damaged where it shows), VALUE
 * (NaN, infinite or negative voxels), LIMIT, UNSUPPORTED, MEMORY. */
NEBEL_API nebel_result nebel_load_grid(const nebel_grid_file *file, const nebel_scene_desc *desc, nebel_grid **grid);

/* What this build of libnebel_scene has: "Assimp 5.2.5, libpng 1.6.39, OpenEXR 3.1.5, yajl 2.1.0". Never NULL. Any thread. */
NEBEL_API const char *nebel_scene_libraries(void);

#ifdef __cplusplus
}
#endif
#endif
