#include "light_maps.h"

#include "gl_camera.h"
#include "scene_programs.h"
#include "gl_state.h"
#include "gl_targets.h"

#include "math/vector.h"

#include <nebel/light.h>
#include <nebel/shader.h>

#include <epoxy/gl.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

#define PI 3.14159265358979323846

/* What maps may take together [texels]: 128 MiB. */
#define MOST_TEXELS ((size_t)1 << 25)

enum { FACES = 6, LEAST_FACE = 64 };

static nebel_result fail_light_memory(const nebel_log *log)
{
    return nb_fail(log, NEBEL_ERROR_MEMORY, "OpenGL renderer: out of memory for point lights");
}

/* ---- words ----------------------------------------------------------------------------------- */

/* As formulas/point_light.inc has it. Without a cone everything is within. */
static void set_cone(const nebel_light *point_light, float *axis, float *rise)
{
    const double edge = cos(point_light->outer_angle * (PI / 180)), inner = cos(point_light->inner_angle * (PI / 180));
    double direction[3] = {point_light->direction[0], point_light->direction[1], point_light->direction[2]};
    const int is_spot = point_light->type == NEBEL_LIGHT_SPOT && nb_vector_make_unit(direction);
    for (int i = 0; i < 3; i++) axis[i] = is_spot ? (float)direction[i] : 0;
    axis[3] = is_spot ? (float)edge : -1;
    *rise = is_spot ? (float)fmin(1 / (inner - edge), 1e30) : 1e30f;
}

static void set_words(const nebel_light *point_light, const double eye[3], int layer, int fog_layer, float *words)
{
    const double radius = fmax(point_light->radius, NEBEL_MIN_LIGHT_RADIUS);
    nb_camera_subtract(point_light->position, eye, words);
    words[3] = (float)layer;
    for (int i = 0; i < 3; i++) words[4 + i] = (float)point_light->intensity[i];
    words[7] = (float)(radius * radius);
    set_cone(point_light, words + 8, words + 12);
    words[13] = (float)point_light->radius;
    words[14] = (float)fog_layer;
    words[15] = 0;
}

/* Whether it is the point light of this number in the fog, too. */
static int is_in_fog(const nebel_light *point_light, const nebel_lighting *fog, size_t number)
{
    const nebel_light *lights;
    if (number >= nebel_get_lighting_lights(fog, &lights)) return 0;
    const double *const place = lights[number].position;
    return place[0] == point_light->position[0] && place[1] == point_light->position[1] &&
           place[2] == point_light->position[2] && lights[number].radius == point_light->radius;
}

static void fill_words(nb_light_maps *point_lights, uint32_t rows)
{
    if (point_lights->words == 0) {
        glGenTextures(1, &point_lights->words);
        point_lights->rows = 0;
    }
    glBindTexture(GL_TEXTURE_2D, point_lights->words);
    if (rows > point_lights->rows) {
        glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_NEAREST);
        glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, GL_NEAREST);
        glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAX_LEVEL, 0);
        glTexImage2D(GL_TEXTURE_2D, 0, GL_RGBA32F, NEBEL_TEXTURE_WIDTH, (GLsizei)rows, 0, GL_RGBA, GL_FLOAT, NULL);
        point_lights->rows = rows;
    }
    glTexSubImage2D(GL_TEXTURE_2D, 0, 0, 0, NEBEL_TEXTURE_WIDTH, (GLsizei)rows, GL_RGBA, GL_FLOAT,
                    point_lights->texels);
}

static int reserve_texels(nb_light_maps *point_lights, const nebel_allocator *allocator, uint32_t rows)
{
    const size_t wanted = (size_t)rows * (NEBEL_TEXTURE_WIDTH / NB_LIGHT_MAP_TEXELS);
    if (wanted <= point_lights->capacity) return 1;
    nb_release(allocator, point_lights->texels);
    nb_release(allocator, point_lights->layers);
    point_lights->texels =
        nb_allocate_zero(allocator, 4 * (size_t)NEBEL_TEXTURE_WIDTH * rows, sizeof *point_lights->texels);
    point_lights->layers = nb_allocate(allocator, wanted, sizeof *point_lights->layers);
    point_lights->capacity = point_lights->texels != NULL && point_lights->layers != NULL ? wanted : 0;
    return point_lights->capacity > 0;
}

/* ---- which point lights have maps ------------------------------------------------------------------- */

typedef struct candidate {
    double light; /* at the eye */
    size_t point_light;
} candidate;

static int compare_candidates(const void *a, const void *b)
{
    const candidate *const p = a, *const q = b;
    if (p->light < q->light || p->light > q->light) return p->light > q->light ? -1 : 1;
    return p->point_light < q->point_light ? -1 : p->point_light > q->point_light;
}

static double light_at(const nebel_light *point_light, const double eye[3])
{
    const double way[3] = {point_light->position[0] - eye[0], point_light->position[1] - eye[1],
                           point_light->position[2] - eye[2]};
    const double most = fmax(fmax(point_light->intensity[0], point_light->intensity[1]), point_light->intensity[2]);
    return most / fmax(nb_vector_dot(way, way), 1);
}

static size_t choose_lights(const nebel_scene_data *scene, const double eye[3], size_t room, candidate *list)
{
    size_t count = 0;
    for (size_t i = 0; i < scene->light_count; i++) {
        const double light = light_at(&scene->lights[i], eye);
        if (light > 0) list[count++] = (candidate){light, i};
    }
    if (count <= room) return count;
    qsort(list, count, sizeof *list, compare_candidates);
    return room;
}

static uint32_t face_for(const nb_light_maps *point_lights, size_t count)
{
    uint32_t face = point_lights->most_face;
    while (face > LEAST_FACE && count * FACES * face * face > MOST_TEXELS) face /= 2;
    return face;
}

static void delete_light_maps(nb_light_maps *point_lights)
{
    glDeleteFramebuffers(1, &point_lights->buffer);
    glDeleteTextures(1, &point_lights->maps);
    point_lights->maps = point_lights->buffer = 0;
}

static int resize(nb_light_maps *point_lights, const nebel_allocator *allocator, size_t count)
{
    const uint32_t face = face_for(point_lights, count);
    if (count == point_lights->layer_count && face == point_lights->face) return 1;
    delete_light_maps(point_lights);
    nb_release(allocator, point_lights->sources);
    point_lights->sources = count > 0 ? nb_allocate_zero(allocator, count, sizeof *point_lights->sources) : NULL;
    point_lights->layer_count = point_lights->sources != NULL ? count : 0;
    point_lights->face = face;
    return point_lights->layer_count == count;
}

static int shows(const nb_light_map_source *source, const nebel_light *point_light)
{
    return source->is_drawn && memcmp(source->place, point_light->position, sizeof source->place) == 0 &&
           memcmp(&source->radius, &point_light->radius, sizeof source->radius) == 0;
}

/* Point lights whose maps are there keep them; others take the layers that are left. */
static void assign_layers(nb_light_maps *point_lights, const nebel_scene_data *scene, const candidate *list)
{
    const size_t count = point_lights->layer_count;
    for (size_t i = 0; i < scene->light_count; i++) point_lights->layers[i] = -1;
    for (size_t k = 0; k < count; k++) {
        int kept = 0;
        for (size_t i = 0; i < count && !kept; i++) {
            const size_t point_light = list[i].point_light;
            kept =
                point_lights->layers[point_light] < 0 && shows(&point_lights->sources[k], &scene->lights[point_light]);
            if (kept) point_lights->layers[point_light] = (int)k;
        }
        if (!kept) point_lights->sources[k].is_drawn = 0;
    }
    size_t next = 0;
    for (size_t i = 0; i < count; i++) {
        const nebel_light *const point_light = &scene->lights[list[i].point_light];
        if (point_lights->layers[list[i].point_light] >= 0) continue;
        while (point_lights->sources[next].is_drawn) next++;
        memcpy(point_lights->sources[next].place, point_light->position, sizeof point_light->position);
        point_lights->sources[next].radius = point_light->radius;
        point_lights->layers[list[i].point_light] = (int)next++;
    }
}

static int choose_layers(nb_light_maps *point_lights, const nebel_allocator *allocator, const nebel_scene_data *scene,
                         const double eye[3])
{
    GLint most = 0;
    glGetIntegerv(GL_MAX_ARRAY_TEXTURE_LAYERS, &most);
    candidate *const list = nb_allocate(allocator, scene->light_count, sizeof *list);
    if (list == NULL) return 0;
    const size_t room = MOST_TEXELS / (FACES * LEAST_FACE * LEAST_FACE);
    const size_t count = choose_lights(scene, eye, (size_t)most < room ? (size_t)most : room, list);
    const int good = resize(point_lights, allocator, count);
    if (good) assign_layers(point_lights, scene, list);
    nb_release(allocator, list);
    return good;
}

nebel_result nb_light_maps_set(nb_light_maps *point_lights, const nebel_allocator *allocator, const nebel_log *log,
                               const nebel_scene_data *scene, const nebel_lighting *fog, const double eye[3])
{
    const uint32_t rows = (uint32_t)(scene->light_count * NB_LIGHT_MAP_TEXELS / NEBEL_TEXTURE_WIDTH + 1);
    if (scene->light_count == 0) return NEBEL_OK;
    if (scene->light_count > NB_MAX_SHADED_LIGHTS) {
        return nb_fail(log, NEBEL_ERROR_LIMIT,
                       "frame: %zu lights; OpenGL lights with at most %d. The CPU renderer has no such bound",
                       scene->light_count, (int)NB_MAX_SHADED_LIGHTS);
    }
    if (!reserve_texels(point_lights, allocator, rows) || !choose_layers(point_lights, allocator, scene, eye))
        return fail_light_memory(log);
    for (size_t i = 0; i < scene->light_count; i++) {
        const nebel_light *const point_light = &scene->lights[i];
        const int layer = point_lights->layers[i];
        set_words(point_light, eye, layer, is_in_fog(point_light, fog, i) ? layer : -1,
                  point_lights->texels + 4 * NB_LIGHT_MAP_TEXELS * i);
    }
    fill_words(point_lights, rows);
    return nb_context_check_memory(log, "the point lights");
}

/* ---- maps ------------------------------------------------------------------------------------ */

static nebel_result make_light_maps(nb_light_maps *point_lights, const nebel_log *log)
{
    const GLenum none = GL_NONE;
    glActiveTexture(GL_TEXTURE0 + NB_UNIT_LIGHT_MAPS);
    point_lights->maps = nb_targets_make_array();
    glTexImage3D(GL_TEXTURE_2D_ARRAY, 0, GL_DEPTH_COMPONENT32F, (GLsizei)(3 * point_lights->face),
                 (GLsizei)(2 * point_lights->face), (GLsizei)point_lights->layer_count, 0, GL_DEPTH_COMPONENT, GL_FLOAT,
                 NULL);
    glGenFramebuffers(1, &point_lights->buffer);
    glBindFramebuffer(GL_FRAMEBUFFER, point_lights->buffer);
    glDrawBuffers(1, &none);
    glReadBuffer(GL_NONE);
    return nb_context_check_memory(log, "the shadow maps of lights; use fewer lights, or smaller maps");
}

/* Of a face, 2 axis + 1 where it looks down that axis. */
static void set_turn(int face, float turn[9])
{
    for (int row = 0; row < 3; row++) {
        for (int column = 0; column < 3; column++) turn[3 * column + row] = (face / 2 + 1 + row) % 3 == column ? 1 : 0;
    }
    if (face % 2 == 1) turn[3 * (face / 2) + 2] = -1;
}

/* Whether a box about the point light reaches into the pyramid of a face, which is `wide` at a distance of 1. */
static int is_in_face(const float low[3], const float high[3], int face, float wide)
{
    const int axis = face / 2;
    const float away = face % 2 == 0 ? high[axis] : -low[axis];
    if (!(away > 0)) return 0;
    for (int k = 1; k < 3; k++) {
        const int i = (axis + k) % 3;
        if (low[i] > wide * away || high[i] < -wide * away) return 0;
    }
    return 1;
}

static void draw_face(const nb_light_maps *point_lights, const nb_light_map_source *source, int face, unsigned program,
                      const nb_meshes *meshes)
{
    const float share = 1 - 2.f * NB_LIGHT_BORDER / (float)point_lights->face;
    const GLint offset = glGetUniformLocation(program, "scene_offset"),
                cutoff = glGetUniformLocation(program, "scene_cutoff");
    float turn[9];
    set_turn(face, turn);
    glUniformMatrix3fv(glGetUniformLocation(program, "map_turn"), 1, GL_FALSE, turn);
    glUniform1f(glGetUniformLocation(program, "map_share"), share);
    glUniform1f(glGetUniformLocation(program, "map_radius"), (float)fmax(source->radius, NEBEL_MIN_LIGHT_RADIUS));
    glUniform1f(glGetUniformLocation(program, "map_near"), .5f * (float)fmax(source->radius, NEBEL_MIN_LIGHT_RADIUS));
    for (size_t i = 0; i < meshes->count; i++) {
        const nb_mesh *const mesh = &meshes->list[i];
        float from_light[3], low[3], high[3];
        nb_camera_subtract(mesh->origin, source->place, from_light);
        for (int k = 0; k < 3; k++) {
            low[k] = mesh->low[k] + from_light[k];
            high[k] = mesh->high[k] + from_light[k];
        }
        if (!is_in_face(low, high, face, 1 / share)) continue;
        glUniform3fv(offset, 1, from_light);
        nb_meshes_bind_mask(mesh, cutoff);
        glBindVertexArray(mesh->vertex_array);
        glDrawElements(GL_TRIANGLES, mesh->index_count, GL_UNSIGNED_INT, NULL);
    }
}

static void draw_layer(const nb_light_maps *point_lights, const nb_context *context, size_t layer, unsigned program,
                       const nb_meshes *meshes)
{
    static const GLfloat empty = 0;
    const uint32_t size = point_lights->face;
    glFramebufferTextureLayer(GL_FRAMEBUFFER, GL_DEPTH_ATTACHMENT, point_lights->maps, 0, (GLint)layer);
    glClearBufferfv(GL_DEPTH, 0, &empty);
    for (int face = 0; face < FACES; face++) {
        nb_state_clear(context, (uint32_t)(face / 2) * size, (uint32_t)(face % 2) * size, size, size);
        glEnable(GL_DEPTH_TEST);
        draw_face(point_lights, &point_lights->sources[layer], face, program, meshes);
    }
}

nebel_result nb_light_maps_draw(nb_light_maps *point_lights, const nb_context *context, const nebel_log *log,
                                unsigned program, const nb_meshes *meshes)
{
    if (point_lights->layer_count == 0) return NEBEL_OK;
    if (point_lights->maps == 0) {
        const nebel_result result = make_light_maps(point_lights, log);
        if (result != NEBEL_OK) {
            delete_light_maps(point_lights);
            return result;
        }
    }
    glBindFramebuffer(GL_FRAMEBUFFER, point_lights->buffer);
    nb_state_clear(context, 0, 0, 3 * point_lights->face, 2 * point_lights->face);
    glEnable(GL_DEPTH_TEST);
    glDepthFunc(GL_GREATER);
    glUseProgram(program);
    for (size_t i = 0; i < point_lights->layer_count; i++) {
        if (!point_lights->sources[i].is_drawn) draw_layer(point_lights, context, i, program, meshes);
        point_lights->sources[i].is_drawn = 1;
    }
    return NEBEL_OK;
}

void nb_light_maps_delete(const nb_light_maps *point_lights)
{
    glDeleteFramebuffers(1, &point_lights->buffer);
    glDeleteTextures(1, &point_lights->maps);
    glDeleteTextures(1, &point_lights->words);
}

void nb_light_maps_release(const nebel_allocator *allocator, const nb_light_maps *point_lights)
{
    nb_release(allocator, point_lights->sources);
    nb_release(allocator, point_lights->texels);
    nb_release(allocator, point_lights->layers);
}
