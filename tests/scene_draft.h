/* What the tests of saving share: a file in a folder of its own, a scene of it that can be changed, and what
 * becomes of it. The program defines _POSIX_C_SOURCE before. */
#ifndef NB_TESTS_SCENE_DRAFT_H
#define NB_TESTS_SCENE_DRAFT_H

#include "scene_help.h"

#include <unistd.h>

static char folder[] = "/tmp/nebel_save_XXXXXX";

static inline const char *file_path(void)
{
    static char path[128];
    snprintf(path, sizeof path, "%s/scene.json", folder);
    return path;
}

static inline void write_file(const char *text)
{
    FILE *file = fopen(file_path(), "wb");
    assert_non_null(file);
    assert_int_equal(fwrite(text, 1, strlen(text), file), strlen(text));
    assert_int_equal(fclose(file), 0);
}

static inline char *read_file(void)
{
    static char text[65536];
    FILE *file = fopen(file_path(), "rb");
    assert_non_null(file);
    text[fread(text, 1, sizeof text - 1, file)] = '\0';
    fclose(file);
    return text;
}

/* A scene with volumes that can be changed. */
typedef struct draft {
    nebel_scene *scene;
    nebel_scene_data data;
    nebel_volume_desc volumes[8];
    const char *names[8];
    nebel_nebula_desc nebulae[4];
    const size_t *sources;
    nebel_volume_track *entries; /* NULL: as they were */
} draft;

static inline draft open_draft(const char *text)
{
    static journal kept; /* as long as the scene lives */
    const nebel_scene_desc desc = {.host.log = {remember, &kept}};
    draft d = {0};
    write_file(text);
    if (nebel_load_scene(file_path(), &desc, &d.scene) != NEBEL_OK) fail_msg("%s", kept.last);
    d.data = *nebel_get_scene_data(d.scene);
    for (size_t i = 0; i < d.data.volume_count; i++) {
        d.volumes[i] = d.data.volumes[i];
        d.names[i] = d.data.volume_names[i];
    }
    for (size_t i = 0; i < d.data.nebula_count; i++) d.nebulae[i] = d.data.nebulae[i];
    return d;
}

static inline nebel_result save(draft *d, journal *kept)
{
    meter m;
    const nebel_scene_desc desc = metered_desc(&m, kept);
    d->data.volumes = d->volumes;
    d->data.volume_names = d->names;
    d->data.nebulae = d->nebulae;
    d->data.volume_tracks = d->entries;
    const nebel_result result =
        nebel_save_scene(file_path(), &desc, nebel_get_scene_data(d->scene), &d->data, d->sources);
    assert_int_equal(m.live, 0);
    nebel_destroy_scene(d->scene);
    return result;
}

static inline void check_saved(draft *d, const char *wanted)
{
    journal kept;
    if (save(d, &kept) != NEBEL_OK) fail_msg("%s", kept.last);
    assert_string_equal(read_file(), wanted);
}

#define SCENE(sections) "{ \"nebel\": 1,\n  " sections "\n}\n"
#define BOX "\"shape\": {\"type\": \"box\", \"min\": [-1, -2, -3], \"max\": [1, 2.50, 3]}"

#define THIN "{" BOX ", \"extinction\": 0.1}"
#define THICK "{" BOX ", \"extinction\": 7}"

static inline int make_folder(void **state)
{
    (void)state;
    return mkdtemp(folder) == NULL;
}

static inline int remove_folder(void **state)
{
    (void)state;
    unlink(file_path());
    return rmdir(folder);
}

#endif
