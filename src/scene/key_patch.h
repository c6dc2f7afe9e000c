/* What nebel_save_scene does while the file is being read: every value that is not as wanted is put down for a change.
 */
#ifndef NB_SCENE_KEY_PATCH_H
#define NB_SCENE_KEY_PATCH_H

#include "json/json_patch.h"
#include "keys/key_table.h"
#include "scene_data.h"

typedef struct nb_span_list {
    nb_json_patch_span *spans;
    size_t count, capacity;
} nb_span_list;

struct nb_key_patch {
    const nebel_scene_data *before, *changed;
    const size_t *sources; /* of the volumes of `changed`; NULL: the same volumes */
    size_t *targets;       /* where each volume of `before` is in `changed`; NEBEL_NEW_VOLUME: nowhere */
    nb_edit edit;
    nb_json_patch_object root;                      /* with the last section that was read */
    nb_json_patch_span sections[NB_SCENE_SECTIONS]; /* of the root */
    size_t section_count;
    uint32_t done;                /* sections that the file may lack */
    nb_span_list volumes, models; /* entries of the sections "fog" and "models" */
    bool has_added;               /* an entry to an array without any */
};

/* A place in the tables of key_table.h: numbers that differ are put down for a change. */
void nb_key_patch_places(nb_key_patch *save, const nb_json *json, const nb_json_patch_object *object,
                         const nb_key_entry *places, unsigned mask, const void *was, const void *now);

/* The same for an object that may be empty. */
void nb_key_patch_entry(nb_key_patch *save, const nb_json *json, const nb_json_node *node, const nb_key_entry *places,
                        const void *was, const void *now);

/* The same for an object that the file may lack: then it is added, with what has changed. */
void nb_key_patch_object(nb_key_patch *save, const nb_json *json, const nb_json_patch_object *owner, const char *key,
                         const nb_key_entry *places, const void *was, const void *now);

void nb_key_patch_integer(nb_key_patch *save, const nb_json *json, const nb_json_patch_object *object, const char *key,
                          double was, double now);

bool nb_key_patch_same_phase(const nebel_phase *a, const nebel_phase *b);

/* The same for a shape, `was` and `now` in metres, and for the density of a volume or nebula, in the file's numbers. */
void nb_key_patch_shape(nb_key_patch *save, const nb_scene_reader *in, const nb_json_node *node, const nebel_shape *was,
                        const nebel_shape *now);
void nb_key_patch_density(nb_key_patch *save, const nb_json *json, const nb_json_node *node, const nebel_density *was,
                          const nebel_density *now);

/* The same for noise, and for that of two grids, whatever they hold. */
void nb_key_patch_noise(nb_edit *edit, const nb_json *json, const nb_json_patch_object *object,
                        const nebel_scene_noise *was, const nebel_scene_noise *now);
void nb_key_patch_noise_grid(nb_key_patch *save, const nb_json *json, const nb_json_patch_object *object,
                             const nebel_grid *was, const nebel_grid *now);

/* Words to be put together. Once memory is out, which the edit notes, nothing more is added. */
typedef struct nb_json_writer {
    nb_key_patch *save;
    nb_bytes bytes; /* with a zero byte behind them, after nb_json_writer_end */
} nb_json_writer;

void nb_json_writer_put(nb_json_writer *out, const char *words);
void nb_json_writer_put_text(nb_json_writer *out, const char *text); /* in quotes */
void nb_json_writer_put_numbers(nb_json_writer *out, size_t count, const double *numbers, nb_json_patch_style style);

/* NULL when memory is out. Free out->bytes.data with nb_release. */
const char *nb_json_writer_end(nb_json_writer *out);

/* Whether two shapes differ in nothing but numbers. */
bool nb_key_patch_is_same_form(const nebel_shape *a, const nebel_shape *b);

/* Keeps where an entry is, and whether it goes. */
bool nb_key_patch_keep_span(nb_key_patch *save, const nb_scene_reader *in, nb_span_list *list, const nb_json_node *node,
                            bool goes);

/* What goes from an object, by its name. */
typedef struct nb_removed_keys {
    const char *names[8]; /* NULL ends them */
} nb_removed_keys;

void nb_key_patch_lose(nb_removed_keys *lost, const char *key);

/* After a section, an entry of fog, whose volumes begin with number `first` of the scene, a nebula, a model, a point
 * light, the cells or the planets have been read, while the tree is there. */
void nb_key_patch_section(nb_key_patch *save, const nb_scene_reader *in, const nb_json_node *node);
bool nb_key_patch_volume(nb_key_patch *save, nb_scene_reader *in, const nb_json_node *node, size_t first);
bool nb_key_patch_nebula(nb_key_patch *save, nb_scene_reader *in, const nb_json_node *node, size_t index);
bool nb_key_patch_model(nb_key_patch *save, nb_scene_reader *in, const nb_json_node *node, size_t index);
bool nb_key_patch_light(nb_key_patch *save, nb_scene_reader *in, const nb_json_node *node, size_t index);
bool nb_key_patch_cells(nb_key_patch *save, nb_scene_reader *in, const nb_json_node *node);
bool nb_key_patch_planets(nb_key_patch *save, nb_scene_reader *in, const nb_json_node *node);

/* Whether planets differ in nothing but numbers. */
bool nb_key_patch_has_same_planets(const nebel_scene_data *a, const nebel_scene_data *b);

/* The section "classic", in the file or not yet. */
void nb_key_patch_classic(nb_key_patch *save, const nb_scene_reader *in, const nb_json_node *node);
void nb_key_patch_add_classic(nb_key_patch *save, const nb_file_units *space);

/* Ambient light and background; `node` is their section in the file, NULL where it has none. */
void nb_key_patch_ambient(nb_key_patch *save, const nb_scene_reader *in, const nb_json_node *node);
void nb_key_patch_background(nb_key_patch *save, const nb_scene_reader *in, const nb_json_node *node);

/* The camera, in the file or not. */
void nb_key_patch_camera(nb_key_patch *save, const nb_scene_reader *in);

/* After everything. */
bool nb_key_patch_rest(nb_key_patch *save, const nb_scene_reader *in, const nb_json_node *root);

/* After the section "fog": volumes that are new or gone. */
void nb_key_patch_entries(nb_key_patch *save, const nb_scene_reader *in, const nb_json_node *array);

/* Of volumes that go, all do; those that models and other programs bring cannot. */
bool nb_key_patch_check_removed(const nb_key_patch *save, const nb_scene_reader *in, const nb_json_node *root);

/* A volume to be written: in metres, with its entry, whose `own` is not read. */
typedef struct nb_written_volume {
    nebel_volume_desc volume;
    nebel_volume_track entry;
    const char *name;
} nb_written_volume;

/* Writes a whole volume as JSON, with a zero byte behind it. False when memory is out. Free text->data with nb_release.
 */
bool nb_key_patch_write_volume(const nebel_allocator *allocator, const nb_file_units *space,
                               const nb_written_volume *volume, nb_bytes *text);

/* The same for the array of its keys, with `gap` before each but the first. Where kept[i] has bytes they are key i. */
bool nb_key_patch_write_keys(const nebel_allocator *allocator, const nb_file_units *space,
                             const nb_written_volume *volume, const nb_bytes *kept, const char *gap, nb_bytes *text);

/* A phase function as JSON. */
void nb_key_patch_write_phase(const nebel_phase *phase, char text[NB_EDIT_NUMBERS]);

/* Whether some key gives the volume an albedo. */
bool nb_key_patch_has_lit_key(const nebel_volume_track *entry);

#endif
