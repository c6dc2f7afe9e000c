/* What of a scene can be changed: fog, nebulae, cells, models, planets and light, with all their parts, planes, keys and names.
 */
#ifndef NB_TOOLS_VIEWER_DOCUMENT_STATE_H
#define NB_TOOLS_VIEWER_DOCUMENT_STATE_H

#include <nebel/scene.h>

#ifdef __cplusplus
extern "C" {
#endif

typedef struct nb_document_state {
    nebel_volume_desc *volumes; /* their parts and planes are the edition's, too, and may be written to */
    char **names;
    size_t *sources; /* which volume of the file each one is; NEBEL_NEW_VOLUME */
    nebel_volume_track
        *entries; /* their keys are the edition's, too; shapes of keys and `own` have no parts or planes */
    size_t count, capacity;
    nebel_nebula_desc *nebulae;     /* their points are the scene's */
    nebel_transform *nebula_places; /* of the points */
    size_t nebula_count;
    nebel_scene_model *models; /* their file names are those of the file that was read: not to be used */
    size_t model_count;
    nebel_light *lights; /* as many as the file has */
    size_t light_count;
    nebel_planet *planets; /* their maps, and what is made of them, are the scene's: not to be used */
    size_t planet_count;
    nebel_cell *cells;
    nebel_cells_desc cells_desc;   /* of them; its portals are the scene's */
    nebel_camera_key *camera_keys; /* all of one projection */
    size_t camera_key_count;       /* 0: the camera stands still or turns */
    int has_sun, has_classic;
    nebel_factor_desc classic;
    nebel_environment environment; /* in place of ambient, where it is not constant; its map is that of the file */
    int shows_ambient;
    double background[3], ambient[3], sun_direction[3], sun_irradiance[3], max_opacity;
} nb_document_state;

/* All return 0, or -1 where memory is out and nothing has changed. */
int nb_document_state_make(const nebel_scene_data *scene, nb_document_state *edition);
int nb_document_state_copy(const nb_document_state *from, nb_document_state *to);
int nb_document_state_add(nb_document_state *edition, const nebel_volume_desc *volume, const nebel_volume_track *entry,
                          const char *name);
/* All its ambient light, with the map of the file, NULL where that has none. */
nebel_environment nb_document_state_environment(const nb_document_state *edition, nebel_environment_map *map);
/* An entry of a volume without keys, contrast or phase of its own. */
nebel_volume_track nb_document_state_plain_entry(void);

/* As many as wanted; those that come are copies of the last one, or 1. */
int nb_document_state_set_colors(nebel_nebula_desc *nebula, size_t count);

int nb_document_state_rename(nb_document_state *edition, size_t index, const char *name);

void nb_document_state_remove(nb_document_state *edition, size_t index);

/* Fine with zeros. */
void nb_document_state_free(nb_document_state *edition);

int nb_document_state_is_same(const nb_document_state *a, const nb_document_state *b);
int nb_document_state_is_same_volume(const nebel_volume_desc *a, const nebel_volume_desc *b);
int nb_document_state_is_same_entry(const nebel_volume_track *a, const nebel_volume_track *b);

/* Whether both have the same nebulae, cells, volumes of the same sources. */
int nb_document_state_has_same_nebulae(const nb_document_state *a, const nb_document_state *b);
int nb_document_state_has_same_cells(const nb_document_state *a, const nb_document_state *b);
int nb_document_state_has_same_models(const nb_document_state *a, const nb_document_state *b);
int nb_document_state_has_same_lights(const nb_document_state *a, const nb_document_state *b);
int nb_document_state_has_same_planets(const nb_document_state *a, const nb_document_state *b);
int nb_document_state_has_same_camera_keys(const nb_document_state *a, const nb_document_state *b);
int nb_document_state_has_same_light(const nb_document_state *a, const nb_document_state *b);
int nb_document_state_has_same_sources(const nb_document_state *a, const nb_document_state *b);

/* Puts light, point lights, camera keys, volumes, nebulae, cells, models and planets in the place of the scene's,
 * which points to the edition then. */
void nb_document_state_show(nb_document_state *edition, nebel_scene_data *scene);

/* Bytes that it takes, more or less. */
size_t nb_document_state_size(const nb_document_state *edition);

#ifdef __cplusplus
}
#endif
#endif
