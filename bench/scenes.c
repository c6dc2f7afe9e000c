#include "scenes.h"

#include "height_map.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

static const double horizontal_fov = 50; /* degrees */
static const double irradiance = 5;
static const double sun_direction[3] = {.48, .6, .64};
static const double background[3] = {.55, .65, .8}, ambient[3] = {.2, .25, .3};
static const double fog_source[3] = {.7, .72, .75};
static const float albedo[3] = {.35f, .40f, .22f};
static const nebel_camera camera = {.position = {0, 16, 62}, .look_at = {0, 6, 0}, .up = {0, 1, 0}};

static double vertical_fov(double aspect)
{
    const double pi = 3.14159265358979323846;
    return 2 * atan(tan(horizontal_fov / 2 * pi / 180) / aspect) * 180 / pi;
}

static const nebel_volume_desc fogs[] = {
    [NB_FOG_BOX] = {.shape = {.type = NEBEL_SHAPE_BOX, .min = {-45, -3, -45}, .max = {45, 3, 45}},
                    .extinction = {.05, .05, .05}},
    [NB_FOG_SPHERE] = {.shape = {.type = NEBEL_SHAPE_SPHERE, .center = {0, 4, 0}, .radius = 18},
                       .extinction = {.08, .08, .08}},
};

int nb_bench_scene_make(uint32_t quads, double aspect, nb_bench_scene *scene)
{
    *scene = (nb_bench_scene){0};
    if (nb_terrain_make(quads, &scene->terrain) != 0) return -1;
    scene->mesh = (nebel_mesh){.positions = scene->terrain.positions,
                               .indices = scene->terrain.indices,
                               .vertex_count = scene->terrain.vertex_count,
                               .triangle_count = scene->terrain.triangle_count,
                               .base_color = {albedo[0], albedo[1], albedo[2]},
                               .texture = -1};
    nebel_scene_data *const data = &scene->data;
    data->camera = camera;
    data->camera.vertical_fov = vertical_fov(aspect);
    data->has_sun = 1;
    data->mesh_count = 1;
    data->meshes = &scene->mesh;
    for (int i = 0; i < 3; i++) {
        data->background[i] = background[i];
        data->ambient[i] = ambient[i];
        data->sun_direction[i] = sun_direction[i];
        data->sun_irradiance[i] = irradiance;
    }
    return 0;
}

void nb_bench_scene_free(nb_bench_scene *scene)
{
    nb_terrain_free(&scene->terrain);
}

nebel_snapshot *nb_bench_fog_commit(nb_bench_fog kind)
{
    nebel_fog *fog = NULL;
    nebel_snapshot *snapshot = NULL;
    if (kind == NB_FOG_NONE || nebel_create_fog(&(nebel_fog_desc){0}, &fog) != NEBEL_OK) return NULL;
    nebel_volume_desc volume = fogs[kind];
    memcpy(volume.source, fog_source, sizeof fog_source);
    if (nebel_add_volume(fog, &volume, NULL) == NEBEL_OK) (void)nebel_commit_fog(fog, &snapshot);
    nebel_destroy_fog(fog);
    return snapshot;
}

/* ---- files ----------------------------------------------------------------------------------- */

static FILE *open_in(const char *folder, const char *name)
{
    char path[4096];
    const int length = snprintf(path, sizeof path, "%s/%s", folder, name);
    return length > 0 && (size_t)length < sizeof path ? fopen(path, "wb") : NULL;
}

/* Returns 0 when everything was written. */
static int close_written(FILE *file)
{
    const int broken = ferror(file);
    return fclose(file) != 0 || broken ? -1 : 0;
}

static void write_vector(FILE *file, const char *key, const double v[3])
{
    (void)fprintf(file, "\"%s\": [%.9g, %.9g, %.9g]", key, v[0], v[1], v[2]);
}

static int write_description(const nb_bench_scene *scene, const char *folder, const char *name, const char *model)
{
    FILE *const file = open_in(folder, name);
    if (file == NULL) return -1;
    const nebel_scene_data *const data = &scene->data;
    const nebel_shape *const box = &fogs[NB_FOG_BOX].shape;
    (void)fprintf(file, "{ \"nebel\": 1,\n  \"camera\": { ");
    write_vector(file, "position", data->camera.position);
    (void)fprintf(file, ", ");
    write_vector(file, "look_at", data->camera.look_at);
    (void)fprintf(file, ", \"vertical_fov\": %.9g },\n  ", data->camera.vertical_fov);
    write_vector(file, "background", data->background);
    (void)fprintf(file, ",\n  ");
    write_vector(file, "ambient", data->ambient);
    (void)fprintf(file, ",\n  \"sun\": { ");
    write_vector(file, "direction", data->sun_direction);
    (void)fprintf(file, ", \"irradiance\": %.9g },\n  \"models\": [ { %s, ", data->sun_irradiance[0], model);
    write_vector(file, "color", (const double[]){(double)albedo[0], (double)albedo[1], (double)albedo[2]});
    (void)fprintf(file, " } ],\n  \"fog\": [ { \"shape\": { \"type\": \"box\", ");
    write_vector(file, "min", box->min);
    (void)fprintf(file, ", ");
    write_vector(file, "max", box->max);
    (void)fprintf(file, " }, \"extinction\": %.9g, ", fogs[NB_FOG_BOX].extinction[0]);
    write_vector(file, "source", fog_source);
    (void)fprintf(file, " } ] }\n");
    return close_written(file);
}

/* Binary, as the tools of modellers write it; the byte order is that of this machine. */
static int write_terrain(const nb_terrain *terrain, const char *folder)
{
    const uint16_t probe = 1;
    const char *const order = *(const unsigned char *)&probe == 1 ? "little" : "big";
    FILE *const file = open_in(folder, "terrain.ply");
    if (file == NULL) return -1;
    (void)fprintf(file, "ply\nformat binary_%s_endian 1.0\nelement vertex %u\nproperty float x\nproperty float y\n",
                  order, (unsigned)terrain->vertex_count);
    (void)fprintf(file, "property float z\nelement face %u\nproperty list uchar uint vertex_indices\nend_header\n",
                  (unsigned)terrain->triangle_count);
    (void)fwrite(terrain->positions, 3 * sizeof(float), terrain->vertex_count, file);
    for (uint32_t t = 0; t < terrain->triangle_count; t++) {
        (void)fputc(3, file);
        (void)fwrite(terrain->indices + 3 * (size_t)t, sizeof(uint32_t), 3, file);
    }
    return close_written(file);
}

static int write_height_map(const nb_terrain *terrain, const char *folder)
{
    FILE *const file = open_in(folder, "terrain.png");
    if (file == NULL) return -1;
    const int status = nb_height_map_write(terrain, file);
    return close_written(file) == 0 ? status : -1;
}

int nb_bench_scene_write(const nb_bench_scene *scene, const char *folder)
{
    if (write_description(scene, folder, "mesh.json", "\"file\": \"terrain.ply\"") != 0) return -1;
    if (write_terrain(&scene->terrain, folder) != 0) return -1;
    if (write_description(scene, folder, "map.json",
                          "\"heightfield\": { \"file\": \"terrain.png\", \"size\": [100, 100], \"height\": 14 }, "
                          "\"position\": [0, -2, 0]") != 0) {
        return -1;
    }
    return write_height_map(&scene->terrain, folder);
}

void nb_bench_scene_remove(const char *folder)
{
    static const char *const names[] = {"mesh.json", "map.json", "terrain.ply", "terrain.png"};
    for (size_t i = 0; i < sizeof names / sizeof *names; i++) {
        char path[4352];
        (void)snprintf(path, sizeof path, "%s/%s", folder, names[i]);
        (void)remove(path);
    }
}
