/* What a scene is inside, and the readers of its sections. */
#ifndef NB_SCENE_SCENE_DATA_H
#define NB_SCENE_SCENE_DATA_H

#include <nebel/scene.h>

#include "math/affine.h"
#include "file/file.h"
#include "keys/file_units.h"
#include "keys/key_value.h"
#include "model/model.h"

/* Of a planet: its ground's, and two of each shell of clouds. */
enum { NB_MAX_MAPS = 1 + 2 * NEBEL_MAX_CLOUD_SHELLS };

/* What has been counted of what a scene takes. */
typedef struct nb_scene_budget {
    uint64_t most;          /* bytes; 0: NEBEL_DEFAULT_SCENE_MEMORY */
    double memory, seconds; /* so far: bytes, of preparation */
    double lattice;         /* cells of multiple scattering, of what is so far */
} nb_scene_budget;

struct nebel_scene {
    nebel_allocator allocator;
    nebel_log log;
    nb_scene_budget budget;
    nb_model_reader reader;
    nebel_parallel parallel;
    nb_arena arena;
    const char *folder;  /* of the file, ending in a slash; "" is the current one */
    nb_file_units space; /* of the file's numbers */
    nebel_scene_data data;
    nebel_diffusion_desc diffusion; /* that of nebel_set_scene_diffusion */

    nebel_volume_desc *volumes;
    const char **volume_names;
    nebel_volume_origin *volume_origins;
    nebel_volume_track *volume_entries;
    size_t volume_capacity, name_capacity, origin_capacity, entry_capacity;

    nebel_nebula_desc *nebulae;
    const char **nebula_names;
    nebel_transform *nebula_places;
    size_t nebula_capacity, nebula_name_capacity, nebula_place_capacity;

    nebel_light *lights;
    const char **light_names;
    size_t light_capacity, light_name_capacity;

    const char **files;
    size_t file_capacity;

    nebel_environment_map *environment_map; /* NULL: none */
    bool has_ambient;                       /* the file says what it is */

    nebel_planet *planets; /* those of the contents; NULL: none */
    nebel_atmosphere *atmospheres[NEBEL_MAX_PLANETS];
    nebel_textured_planet *layers;
    nebel_clouds *clouds;
    nebel_image maps[NB_MAX_MAPS]; /* that the planet's layers were read from */
    size_t map_count;

    nebel_grid **grids;
    size_t grid_count, grid_capacity;

    nb_model_source *models;
    nebel_scene_model *placements; /* of the models, in the words of the public face */
    size_t model_count, model_capacity, placement_capacity;
    nb_model_set loaded;
    bool models_loaded;
};

/* What a node of a model says about fog. */
#define NB_NODE_PREFIX "nebel_"

typedef struct nb_fog_node {
    nb_affine place;    /* in the world */
    const char *name;   /* of the volume, where it has no other */
    const char *prefix; /* of its keys; "": none */
} nb_fog_node;

/* The keys that a scene may have. */
enum { NB_SCENE_SECTIONS = 16 };

/* The longest scene file. */
#define NB_SCENE_TEXT_LIMIT ((size_t)1 << 30)

typedef struct nb_key_patch nb_key_patch;

/* Moments beyond leave no digits of motion. */
#define NB_MAX_FRAME 1e12

/* Whether a frame is a number within that; says what is wrong where it is none. */
bool nb_scene_is_frame(const nebel_scene *scene, double frame);

/* What reading needs beside the scene itself. */
/* The ground of the scene's first planet as the file has it, for fog over it. */
typedef struct nb_ground_sphere {
    double preset_radius;     /* m */
    double radius, center[3]; /* in terms of the file; 0: the preset's */
    bool has_center;
} nb_ground_sphere;

typedef struct nb_scene_reader {
    nb_json *json;
    nebel_scene *scene;
    nb_key_patch *save;  /* what is to be written in the file; NULL: nothing */
    nb_file_units space; /* of the file's numbers */
    nb_ground_sphere ball;
    const nb_fog_node *node;                   /* of a model, whose fog is being read; NULL: the scene's own */
    nebel_fog *trial;                          /* takes every volume once, for the core's own checks */
    char core_message[512];                    /* what the core said about the last one */
    uint32_t seen;                             /* sections */
    size_t section_offsets[NB_SCENE_SECTIONS]; /* of the keys of those seen */
    bool over_budget;                          /* which has been said */
    double imported_opacity;                   /* the largest one, where the file has none of its own; 0: none */
} nb_scene_reader;

/* What the parts of a scene take, measured on one core of a server of 2023. */
#define NB_NOISE_VOXEL_BYTES 2.0
#define NB_NOISE_OCTAVE_SECONDS 2.7e-7 /* of each voxel */
#define NB_PARTICLE_BYTES 3e3
#define NB_PARTICLE_SECONDS 2.2e-5
#define NB_VOLUME_BYTES 2e3
#define NB_VOLUME_SECONDS 5e-6
#define NB_CELL_BYTES                                                                                                  \
    900.0 /* of the lattice of diffusion, with color, a point light, emission and ambient light; without 370 */
#define NB_CELL_SECONDS 1.3e-5
#define NB_PLANET_BYTES 1e7
#define NB_PLANET_SECONDS 0.6
#define NB_PRECISE_PLANET_SECONDS 1.5
#define NB_CLOUDS_BYTES 3e7
#define NB_CLOUDS_SECONDS 0.3

/* Counts what a node of the file is about to take. False, said at the node, where the scene may not take so much. */
bool nb_scene_charge(nb_scene_reader *in, const nb_json_node *node, double bytes, double seconds);
bool nb_scene_charge_noise(nb_scene_reader *in, const nb_json_node *density);
/* The same for the noise of an element of "fog" or "nebula", if any: before the file is read, as noise is made then. */
bool nb_scene_count_noise(nb_scene_reader *in, const nb_json_node *volume);
/* Of the lattice that a description asks for; NULL: 0. */
double nb_diffusion_cells(const nebel_diffusion_desc *desc);
/* Bytes that are left, at least 1. */
uint64_t nb_scene_room(const nebel_scene *scene);
/* The most bytes and seconds there may be. */
double nb_scene_most_memory(const nebel_scene *scene);
double nb_scene_most_seconds(const nebel_scene *scene);

/* nebel_parse_scene; with `save`, notes what is to be changed in the text. */
nebel_result nb_scene_parse(const char *text, size_t size, const char *name, const nebel_scene_desc *desc,
                            nb_key_patch *save, nebel_scene **scene);

bool nb_keys_read_camera(nb_scene_reader *in, const nb_json_node *node);
bool nb_keys_read_background(nb_scene_reader *in, const nb_json_node *node);
bool nb_keys_read_ambient(nb_scene_reader *in, const nb_json_node *node);
/* The light of the planet's air at the scene's origin, for the sun of the contents. Errors: MEMORY. */
nebel_result nb_planet_light(nebel_scene *scene);

/* Without a planet that of the preset `earth`. What is wrong is left for nb_keys_read_planet to say. */
nb_ground_sphere nb_find_sphere(const nb_json *json, const nb_json_node *planet);

bool nb_keys_read_sun(nb_scene_reader *in, const nb_json_node *node);
bool nb_keys_read_light(nb_scene_reader *in, const nb_json_node *node);
bool nb_keys_read_model(nb_scene_reader *in, const nb_json_node *node);
bool nb_keys_read_volume(nb_scene_reader *in, const nb_json_node *node);
bool nb_keys_read_nebula(nb_scene_reader *in, const nb_json_node *node);
bool nb_keys_read_cells(nb_scene_reader *in, const nb_json_node *node);
bool nb_keys_read_classic(nb_scene_reader *in, const nb_json_node *node);

/* How long a unit of the numbers of a device's fog is: 1 where they count in device depth, which has none. */
double nb_device_unit(const nebel_scene_data *scene, const nebel_d3d9_fog *fog, double unit);

/* When camera and classic fog are read: numbers in device depth were taken for lengths. */
void nb_finish_classic(nb_scene_reader *in);
bool nb_keys_read_planet(nb_scene_reader *in, const nb_json_node *node);
bool nb_keys_read_layers(nb_scene_reader *in, const nb_json_node *node, nebel_textured_planet_desc *desc);
bool nb_keys_read_clouds(nb_scene_reader *in, const nb_json_node *node, nebel_planet *planet);

/* A picture as a map of 1 or 3 channels, which the scene owns; and the seed of noise. */
bool nb_keys_read_map(nb_scene_reader *in, const nb_json_node *node, int channels, nebel_planet_map *map);
bool nb_keys_read_seed(nb_scene_reader *in, const nb_json_node *node, uint32_t *seed);
bool nb_keys_read_multiple_scattering(nb_scene_reader *in, const nb_json_node *node);
/* Points, their number and their place, from a model file. NULL: none. */
bool nb_keys_read_points(nb_scene_reader *in, const nb_json_node *node, size_t limit, nebel_nebula_desc *nebula,
                         nebel_transform *place);

/* The fog in the nodes of a glTF model. Sets model->has_fog. */
bool nb_keys_read_nodes(nb_scene_reader *in, const nb_json_node *node, nb_model_source *model);
bool nb_keys_read_shape(nb_scene_reader *in, const nb_json_node *node, nebel_shape *shape);

/* Whether two places, in the file's numbers, lie as far apart as the core wants. `end` is the node of one, `other` the
 * key of the other. */
bool nb_keys_read_check_apart(nb_json *json, const nb_json_node *end, const char *other, const double from[3],
                              const double to[3]);

/* The shape of a node: an object like any other, a name, or NULL, a box. 1 is the size of an empty. */
bool nb_keys_read_node_shape(nb_scene_reader *in, const nb_json_node *node, nebel_shape *shape);

/* Takes a volume from its node's coordinates to the world's. */
bool nb_keys_read_place_volume(nb_scene_reader *in, const nb_json_node *node, nebel_volume_desc *volume);
/* What models name in turn is among the files of the scene `user`, as what they read: nobody writes there. Signature of `opened`. */
void nb_scene_note_file(void *user, const char *path, const struct stat *status);

/* Adds to the files that the scene names; false when memory is out. */
bool nb_scene_keep_file(nebel_scene *scene, const char *file);

/* Three numbers of voxels. */
bool nb_keys_read_grid_size(nb_json *json, const nb_json_node *node, size_t size[3]);

/* The scene becomes the grid's owner, also where it fails. */
bool nb_scene_keep_grid(nb_scene_reader *in, const nb_json_node *node, nebel_grid *grid);

/* What a density of the type "noise" says, with its defaults; allocator, log and name are left alone. */
bool nb_keys_read_noise_numbers(nb_json *json, const nb_json_node *node, nebel_scene_noise *noise);

/* Whether it changes from frame to frame. */
bool nb_noise_moves(const nebel_scene_noise *noise);

/* The words of noise, `words`, with the numbers that are wanted in their places, in the file's own terms: to be released. */
nebel_result nb_noise_words(const nebel_scene *scene, const char *words, const nebel_scene_noise *wanted,
                            nb_bytes *changed);

/* The voxels of a density of the type "noise". */
bool nb_keys_read_noise(nb_scene_reader *in, const nb_json_node *node, nebel_density *density);

/* The voxels of a density of the type "grid". */
bool nb_keys_read_grid(nb_scene_reader *in, const nb_json_node *node, nebel_density *density);
bool nb_keys_read_density(nb_scene_reader *in, const nb_json_node *node, nebel_shape_type shape,
                          nebel_density *density);

/* The numbers that a key of fog gives anew. Numbers it leaves out stay, as do type, planes and parts. */
bool nb_keys_read_shape_key(nb_scene_reader *in, const nb_json_node *node, nebel_shape *shape);
bool nb_keys_read_density_key(nb_scene_reader *in, const nb_json_node *node, nebel_density *density);
bool nb_keys_read_phase(nb_scene_reader *in, const nb_json_node *node, nebel_phase *phase);

/* Shows a volume to the core, which knows more than the file's rules: whether a convex body is empty, for one. Where
 * its message begins with `subject`, which the node's path says already, that is left out. */
bool nb_keys_read_try(nb_scene_reader *in, const nb_json_node *node, const char *subject,
                      const nebel_volume_desc *volume);

/* For logs of the core: keeps the message in the reader, which is `user`. */
void nb_keys_read_keep_message(nebel_log_level level, nebel_result result, const char *message, void *user);

/* Words of the file, in the order of their enumerations. */
extern const char *const nb_projection_names[3], *const nb_coordinate_names[NEBEL_COORDINATE_COUNT],
                                                     *const nb_stage_names[NEBEL_STAGE_COUNT],
                                                         *const nb_curve_names[NEBEL_CURVE_TABLE],
                                                             *const nb_d3d9_mode_names[4];

/* What an entry says that says nothing. */
nebel_volume_track nb_volume_entry_default(void);

nebel_camera nb_camera_default(void);

/* True when position and look_at differ and up is not along the view. */
bool nb_camera_is_apart(const nebel_camera *camera);
bool nb_camera_is_upright(const nebel_camera *camera);

/* The keys "up" and "unit" of a scene or a model. */
bool nb_keys_read_up(nb_json *json, const nb_json_node *node, nb_file_units *space);
bool nb_keys_read_unit(nb_json *json, const nb_json_node *node, nb_file_units *space);

void nb_models_release(nebel_scene *scene);

#endif
