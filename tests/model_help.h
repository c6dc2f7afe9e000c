/* Models in a folder of the test's own, and scenes that load them. */
#ifndef MODEL_HELP_H
#define MODEL_HELP_H

#include "scene_help.h"

#include <ftw.h>
#include <unistd.h>

static char folder[] = "/tmp/nebel_model_XXXXXX";

static inline const char *in_folder(const char *name)
{
    static char path[4][200];
    static int next;
    next = (next + 1) % 4;
    snprintf(path[next], sizeof path[next], "%s/%s", folder, name);
    return path[next];
}

static inline void write_text(const char *name, const char *text)
{
    FILE *file = fopen(in_folder(name), "w");
    fputs(text, file);
    fclose(file);
}

/* A scene with one model of these members, loaded; its result in *result, its last message in *kept. */
static inline nebel_scene *load(const char *members, nebel_result *result, journal *kept)
{
    char text[1000];
    nebel_scene *scene = NULL;
    const nebel_scene_desc desc = {.host.log = {remember, kept}};
    *kept = (journal){0};
    snprintf(text, sizeof text, "{\"nebel\": 1, \"fog\": [], \"models\": [{%s}]}", members);
    if (nebel_parse_scene(text, strlen(text), in_folder("scene.json"), &desc, &scene) != NEBEL_OK)
        fail_msg("%s", kept->last);
    *result = nebel_load_scene_models(scene);
    return scene;
}

/* The scene may have something to say as long as it lives. */
static inline nebel_scene *load_good(const char *members)
{
    static journal kept;
    nebel_result result;
    nebel_scene *scene = load(members, &result, &kept);
    if (result != NEBEL_OK) fail_msg("%s", kept.last);
    return scene;
}

static inline void assert_broken(const char *members, nebel_result wanted, const char *message)
{
    journal kept;
    nebel_result result;
    nebel_scene *scene = load(members, &result, &kept);
    if (result != wanted || strstr(kept.last, message) == NULL) fail_msg("gave %d: %s", result, kept.last);
    assert_non_null(strstr(kept.last, "scene.json:1:"));
    assert_int_equal(nebel_get_scene_data(scene)->mesh_count, 0);
    nebel_destroy_scene(scene);
}

static inline int make_folder(void **state)
{
    (void)state;
    return mkdtemp(folder) == NULL;
}

static inline int remove_one(const char *path, const struct stat *status, int kind, struct FTW *place)
{
    (void)status, (void)kind, (void)place;
    return remove(path);
}

/* With all that is in it. */
static inline int remove_folder_tree(void **state)
{
    (void)state;
    return nftw(folder, remove_one, 8, FTW_DEPTH | FTW_PHYS);
}

#endif
