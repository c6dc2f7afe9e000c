#include "scenes.h"

#include "noise_cloud.h"

#include "height_map.h"
#include "measure.h"

#include <math.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
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
    [NB_FOG_CLOUD] = {.shape = {.type = NEBEL_SHAPE_BOX, .min = {-18, 12, -18}, .max = {18, 34, 18}},
                      .density = {.type = NEBEL_DENSITY_GRID},
                      .extinction = {.9, .9, .9}},
    [NB_FOG_HEIGHT] = {.density = {.type = NEBEL_DENSITY_HEIGHT, .scale_height = 8}, .extinction = {.05, .05, .05}},
};

/* That is lit where its source is not. */
static nebel_volume_desc volume_of(nb_bench_fog kind)
{
    const int is_lit = kind >= NB_FOG_LIT_BOX;
    nebel_volume_desc volume = fogs[kind == NB_FOG_LIT_BOX      ? NB_FOG_BOX
                                    : kind == NB_FOG_LIT_SPHERE ? NB_FOG_SPHERE
                                                                : kind];
    for (int c = 0; c < 3; c++) {
        volume.source[c] = is_lit ? 0 : fog_source[c];
        volume.albedo[c] = is_lit ? 1 : 0;
    }
    return volume;
}

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

/* ---- pillars --------------------------------------------------------------------------------- */

enum { PILLARS = 10, CORNERS = 8, SIDES = 12 };

static const double low_sun[3] = {-.55, .28, -.79};

/* 2 wide and 18 high, from below the ground. */
static void set_pillar(int number, float *positions, uint32_t first, uint32_t *indices)
{
    static const uint32_t sides[3 * SIDES] = {0, 2, 1, 1, 2, 3, 4, 5, 6, 5, 7, 6, 0, 1, 4, 1, 5, 4,
                                              2, 6, 3, 3, 6, 7, 0, 4, 2, 2, 4, 6, 1, 3, 5, 3, 7, 5};
    const float x = (float)(number % 5 * 9 - 18), z = (float)(number / 5 * 22 - 6 + number % 2 * 5);
    for (int i = 0; i < CORNERS; i++) {
        positions[3 * i] = x + (i & 1 ? 1 : -1);
        positions[3 * i + 1] = i & 2 ? 18 : 0;
        positions[3 * i + 2] = z + (i & 4 ? 1 : -1);
    }
    for (int i = 0; i < 3 * SIDES; i++) indices[i] = first + sides[i];
}

int nb_bench_scene_add_pillars(nb_bench_scene *scene)
{
    nb_terrain *const terrain = &scene->terrain;
    const uint32_t vertices = terrain->vertex_count + PILLARS * CORNERS;
    const uint32_t triangles = terrain->triangle_count + PILLARS * SIDES;
    float *const positions = realloc(terrain->positions, 3 * sizeof(float) * vertices);
    if (positions != NULL) terrain->positions = positions;
    uint32_t *const indices = realloc(terrain->indices, 3 * sizeof(uint32_t) * triangles);
    if (indices != NULL) terrain->indices = indices;
    if (positions == NULL || indices == NULL) return -1;
    for (uint32_t i = 0; i < PILLARS; i++) {
        const uint32_t first = terrain->vertex_count + i * CORNERS;
        set_pillar((int)i, positions + 3 * (size_t)first, first,
                   indices + 3 * (size_t)(terrain->triangle_count + i * SIDES));
    }
    terrain->vertex_count = scene->mesh.vertex_count = vertices;
    terrain->triangle_count = scene->mesh.triangle_count = triangles;
    scene->mesh.positions = positions;
    scene->mesh.indices = indices;
    memcpy(scene->data.sun_direction, low_sun, sizeof low_sun);
    return 0;
}

/* ---- fog ------------------------------------------------------------------------------------- */

/* Counts what is kept. */
typedef union counted {
    size_t size;
    max_align_t any;
} counted;

static void *allocate_counted(size_t size, void *user)
{
    counted *const memory = malloc(sizeof *memory + size);
    if (memory == NULL) return NULL;
    memory->size = size;
    *(size_t *)user += size;
    return memory + 1;
}

static void release_counted(void *block, void *user)
{
    counted *const memory = (counted *)block - 1;
    *(size_t *)user -= memory->size;
    free(memory);
}

static nebel_lighting *light_fog(nb_bench_fog kind, const nebel_scene_data *scene, const nebel_allocator *allocator,
                                 double *seconds)
{
    nebel_fog *fog = NULL;
    nebel_snapshot *snapshot = NULL;
    nebel_lighting *lighting = NULL;
    nebel_lighting_desc desc = {.environment = {.type = NEBEL_ENVIRONMENT_CONSTANT}};
    memcpy(desc.environment.radiance, scene->ambient, sizeof desc.environment.radiance);
    memcpy(desc.sun.direction, scene->sun_direction, sizeof desc.sun.direction);
    memcpy(desc.sun.irradiance, scene->sun_irradiance, sizeof desc.sun.irradiance);
    if (kind == NB_FOG_NONE || nebel_create_fog(&(nebel_fog_desc){.host.allocator = *allocator}, &fog) != NEBEL_OK)
        return NULL;
    nebel_volume_desc volume = volume_of(kind);
    if (kind == NB_FOG_CLOUD) volume.density.grid = nb_cloud_make();
    if (nebel_add_volume(fog, &volume, NULL) == NEBEL_OK) {
        const double start = nb_clock_cpu();
        if (nebel_commit_fog(fog, &snapshot) == NEBEL_OK) (void)nebel_create_lighting(snapshot, &desc, &lighting);
        *seconds = nb_clock_cpu() - start;
    }
    nebel_release_grid(volume.density.grid);
    nebel_release_snapshot(snapshot);
    nebel_destroy_fog(fog);
    return lighting;
}

nebel_lighting *nb_bench_fog_commit(nb_bench_fog kind, const nebel_scene_data *scene)
{
    double seconds;
    return light_fog(kind, scene, &(nebel_allocator){.user = NULL}, &seconds);
}

nebel_lighting *nb_bench_fog_measure(nb_bench_fog kind, const nebel_scene_data *scene, double *seconds, size_t *bytes)
{
    static size_t kept; /* outlives every snapshot */
    const nebel_allocator counting = {allocate_counted, release_counted, &kept};
    const size_t before = kept;
    nebel_lighting *const lighting = light_fog(kind, scene, &counting, seconds);
    *bytes = kept - before;
    return lighting;
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
