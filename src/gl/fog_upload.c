/* The fog of a frame, packed and handed to OpenGL. */
#include "fog_context.h"
#include "gl_panorama.h"
#include "gl_state.h"
#include "texel_texture.h"

#include <string.h>

enum { TILE_SIZE = 1 << NB_GL_TILE_SHIFT, FEW_VOLUMES = 3 };

/* ---- packing --------------------------------------------------------------------------------- */

/* Whole rows of the texture, so that one call uploads all. What lies behind the last word is never read. */
static size_t whole_rows(size_t count)
{
    return (count + NEBEL_TEXTURE_WIDTH - 1) / NEBEL_TEXTURE_WIDTH * NEBEL_TEXTURE_WIDTH;
}

/* Makes an array of at least `count` elements of what it was, without keeping its contents. 0 on failure. */
static int reserve_array(nebel_gl *gl, void **array, size_t size, size_t count, size_t *capacity)
{
    if (count <= *capacity) return 1;
    const size_t wanted = whole_rows(count + count / 2);
    nb_release(&gl->allocator, *array);
    *array = nb_allocate_zero(&gl->allocator, wanted, size);
    *capacity = *array != NULL ? wanted : 0;
    return *array != NULL;
}

static nebel_result fail_fog_memory(const nebel_gl *gl)
{
    return nb_fail(&gl->log, NEBEL_ERROR_MEMORY, "nebel_gl_set_fog: out of memory");
}

static nebel_result pack_fog(nebel_gl *gl, const nebel_lighting *lighting)
{
    size_t count = 0;
    nebel_result result = nebel_pack_fog(lighting, gl->fog.eye, NULL, 0, &count);
    if (result != NEBEL_OK) {
        return nb_fail(&gl->log, result, "nebel_gl_set_fog: the fog cannot be packed: %s", nebel_result_text(result));
    }
    void *words = gl->words;
    const int room = reserve_array(gl, &words, sizeof *gl->words, count, &gl->word_capacity);
    gl->words = words;
    if (!room) return fail_fog_memory(gl);
    gl->fog.texel_count = count;
    return nebel_pack_fog(lighting, gl->fog.eye, gl->words, gl->word_capacity, &count);
}

/* The lists of one view, behind `before` entries of others. */
static nebel_result list_view(nebel_gl *gl, const nebel_lighting *lighting, int view, size_t before, size_t *count)
{
    uint32_t *const entries = before < gl->entry_capacity ? gl->entries + before : NULL;
    const size_t capacity = entries != NULL ? gl->entry_capacity - before : 0;
    const nebel_result result =
        nebel_bin_volumes(nebel_get_lighting_snapshot(lighting), &gl->views[view], TILE_SIZE, entries, capacity, count);
    if (result == NEBEL_OK || *count > capacity) return NEBEL_OK;
    return nb_fail(&gl->log, result, "nebel_gl_set_fog: the volumes of the tiles cannot be listed: %s",
                   nebel_result_text(result));
}

static size_t tile_count(const nebel_view *view)
{
    const size_t columns = (view->width + TILE_SIZE - 1) / TILE_SIZE;
    return columns * ((view->height + TILE_SIZE - 1) / TILE_SIZE);
}

/* Lists count from the beginning of all. */
static void shift_lists(nebel_gl *gl, int view, size_t before)
{
    const size_t tiles = tile_count(&gl->views[view]);
    for (size_t i = 0; i < tiles && before > 0; i++) gl->entries[before + 2 * i] += (uint32_t)before;
    gl->face_first[view] = (int)before;
}

/* *count may be more than there is room for; then there are no lists. */
static nebel_result list_views(nebel_gl *gl, const nebel_lighting *lighting, size_t *count)
{
    nebel_result result = NEBEL_OK;
    *count = 0;
    for (int i = 0; i < gl->view_count && result == NEBEL_OK; i++) {
        size_t entries = 0;
        result = list_view(gl, lighting, i, *count, &entries);
        if (result == NEBEL_OK && *count + entries <= gl->entry_capacity) shift_lists(gl, i, *count);
        *count += entries;
    }
    return result;
}

/* The lists of the last frame tell how much room this one's need; where it is more they are made once again. */
static nebel_result list_tiles(nebel_gl *gl, const nebel_lighting *lighting, size_t *count)
{
    for (;;) {
        const nebel_result result = list_views(gl, lighting, count);
        if (result != NEBEL_OK || *count <= gl->entry_capacity) return result;
        void *entries = gl->entries;
        const int room = reserve_array(gl, &entries, sizeof *gl->entries, *count, &gl->entry_capacity);
        gl->entries = entries;
        if (!room) return fail_fog_memory(gl);
    }
}

static uint32_t fullest_tile(const nebel_gl *gl)
{
    uint32_t most = 0;
    for (int view = 0; view < gl->view_count; view++) {
        const uint32_t *const heads = gl->entries + gl->face_first[view];
        const size_t tiles = tile_count(&gl->views[view]);
        for (size_t i = 0; i < tiles; i++) most = heads[2 * i + 1] > most ? heads[2 * i + 1] : most;
    }
    return most;
}

/* Of the loops of the fog's text, about, where `listed` volumes of `all` overlap on a ray; each begins and ends. Between
 * two such places all are read some three times where there are more than slots, seven times where their density varies;
 * in sunlight each has as many turns again, and the way to the sun is asked for five times; each point light takes two
 * steps of eight places, at which all that are there are asked, and all there are on the way to it. */
static double most_turns_of(const nebel_gl *gl, double listed, double all, double lights)
{
    const uint32_t features = gl->fog.features;
    const int is_walked = (features & (NEBEL_FEATURE_MIXED | NEBEL_FEATURE_OVERRIDE)) != 0;
    const double walk = is_walked ? 2 * listed * 8 * listed : 0;
    const double sunlight = (features & NEBEL_FEATURE_SUN) != 0 ? 4 * listed * (8 * listed + 14 * all) : 0;
    const double point_light = (features & NEBEL_FEATURE_LIGHTS) != 0 ? lights * 2 * listed * 16 * (listed + all) : 0;
    return walk + sunlight + point_light;
}

/* How many legs a ray in light is cut into is known to the ray alone: uneven profiles make ten of one. The same holds
 * for the cuts of bodies of several leaves. */
static int may_tire(const nebel_gl *gl)
{
    const uint32_t features = gl->fog.features;
    const int is_walked = (features & (NEBEL_FEATURE_MIXED | NEBEL_FEATURE_OVERRIDE)) != 0;
    const int is_lit = (features & (NEBEL_FEATURE_SUN | NEBEL_FEATURE_LIGHTS)) != 0;
    return gl->context.most_turns > 0 && !gl->dims_alone &&
           (is_lit || (is_walked && (features & NEBEL_FEATURE_GROUP) != 0));
}

/* How many cells of voxels a ray passes is not known. */
static int find_overlap(const nebel_gl *gl, const nebel_lighting *lighting)
{
    const uint32_t lit = NEBEL_FEATURE_SUN | NEBEL_FEATURE_LIGHTS | NEBEL_FEATURE_MIXED;
    const double all = (double)nb_gl_count_volumes(lighting);
    const double listed = gl->fog.tiles != 0 ? (double)gl->fog.max_tile_volumes : all;
    if (gl->context.most_turns == 0 || gl->dims_alone) return 0;
    if ((gl->fog.features & NEBEL_FEATURE_GRID) != 0 && (gl->fog.features & lit) != 0) return 1;
    const double lights = (double)nebel_get_lighting_lights(lighting, NULL);
    return most_turns_of(gl, listed, all, lights) > (double)gl->context.most_turns;
}

/* ---- textures -------------------------------------------------------------------------------- */

typedef struct texel_kind {
    GLenum internal, format, type;
    const char *what, *fewer;
} texel_kind;

static const texel_kind word_texels = {GL_RGBA32F, GL_RGBA, GL_FLOAT, "the texture of packed fog", "volumes"};
static const texel_kind entry_texels = {GL_R32UI, GL_RED_INTEGER, GL_UNSIGNED_INT, "the texture of volumes per tile",
                                        "volumes"};

static const texel_kind voxel_texels = {GL_RGBA32UI, GL_RGBA_INTEGER, GL_UNSIGNED_INT, "the texture of voxels",
                                        "voxels"};

static const texel_kind node_texels = {GL_RGBA32F, GL_RGBA, GL_FLOAT, "the texture of multiple scattering", "cells"};

/* `rows` grows by half at least, so that fog that grows slowly seldom allocates. */
static nebel_result grow_texture(const nebel_gl *gl, const texel_kind *kind, uint32_t needed, uint32_t *rows)
{
    const uint32_t half_more = needed + needed / 2;
    const uint32_t wanted = half_more < gl->context.widest ? half_more : gl->context.widest;
    glTexImage2D(GL_TEXTURE_2D, 0, (GLint)kind->internal, NEBEL_TEXTURE_WIDTH, (GLsizei)wanted, 0, kind->format,
                 kind->type, NULL);
    const nebel_result result = nb_context_check_memory(&gl->log, kind->what);
    *rows = result == NEBEL_OK ? wanted : 0;
    return result;
}

static nebel_result fill_texture(const nebel_gl *gl, const texel_kind *kind, const void *texels, size_t count,
                                 unsigned *name, uint32_t *rows)
{
    const size_t needed = whole_rows(count) / NEBEL_TEXTURE_WIDTH;
    if (needed > gl->context.widest) {
        return nb_fail(&gl->log, NEBEL_ERROR_LIMIT,
                       "nebel_gl_set_fog: %s needs %zu rows, this context has %u (GL_MAX_TEXTURE_SIZE); use fewer %s",
                       kind->what, needed, (unsigned)gl->context.widest, kind->fewer);
    }
    nb_texel_texture_bind(name);
    if (needed > *rows) {
        const nebel_result result = grow_texture(gl, kind, (uint32_t)needed, rows);
        if (result != NEBEL_OK) return result;
    }
    glTexSubImage2D(GL_TEXTURE_2D, 0, 0, 0, NEBEL_TEXTURE_WIDTH, (GLsizei)needed, kind->format, kind->type, texels);
    return NEBEL_OK;
}

/* ---- the frame ------------------------------------------------------------------------------- */

/* Fresh memory each time: the last frame may still be reading the old one. */
static nebel_result fill_block(nebel_gl *gl)
{
    const GLsizeiptr size = NEBEL_BLOCK_TEXELS * sizeof(nebel_texel_f32);
    if (gl->block == 0) glGenBuffers(1, &gl->block);
    glBindBuffer(GL_UNIFORM_BUFFER, gl->block);
    glBufferData(GL_UNIFORM_BUFFER, size, NULL, GL_STREAM_DRAW);
    glBufferSubData(GL_UNIFORM_BUFFER, 0, (GLsizeiptr)(gl->fog.texel_count * sizeof(nebel_texel_f32)), gl->words);
    return NEBEL_OK;
}

static nebel_result upload_words(nebel_gl *gl)
{
    if (gl->storage == NEBEL_GL_STORAGE_BLOCK_OR_TEXTURE && gl->fog.texel_count <= NEBEL_BLOCK_TEXELS) {
        const nebel_result result = fill_block(gl);
        gl->fog.block = gl->block;
        return result;
    }
    const nebel_result result =
        fill_texture(gl, &word_texels, gl->words, gl->fog.texel_count, &gl->texture, &gl->texture_rows);
    gl->fog.texture = gl->texture;
    return result;
}

static nebel_result write_voxels(nebel_gl *gl, const nebel_lighting *lighting, size_t count)
{
    const size_t room = whole_rows(count);
    nebel_texel_u32 *const texels = nb_allocate(&gl->allocator, room, sizeof *texels);
    if (texels == NULL) return fail_fog_memory(gl);
    nebel_result result = nebel_pack_voxels(lighting, texels, count, &count);
    memset(texels + count, 0, (room - count) * sizeof *texels);
    if (result == NEBEL_OK) result = fill_texture(gl, &voxel_texels, texels, count, &gl->voxels, &gl->voxel_rows);
    nb_release(&gl->allocator, texels);
    return result;
}

/* A lighting stays with the gl, so that no other can have its address. */
static void keep(nebel_lighting **kept, nebel_lighting *lighting)
{
    if (lighting != NULL) (void)nebel_retain_lighting(lighting);
    nebel_release_lighting(*kept);
    *kept = lighting;
}

static int is_lent(const nebel_gl *gl, const nebel_lighting *lighting)
{
    return gl->lender != NULL && gl->lender->voxels_of != NULL && nebel_is_same_voxels(gl->lender->voxels_of, lighting);
}

/* Voxels stay where they are while other fog and the eye change. */
static nebel_result upload_voxels(nebel_gl *gl, nebel_lighting *lighting)
{
    size_t count = 0;
    nebel_result result = nebel_pack_voxels(lighting, NULL, 0, &count);
    if (result != NEBEL_OK || count == 0) return result;
    if (is_lent(gl, lighting)) {
        gl->fog.voxels = gl->lender->voxels;
        return NEBEL_OK;
    }
    if (gl->voxels_of == NULL || !nebel_is_same_voxels(gl->voxels_of, lighting)) {
        result = write_voxels(gl, lighting, count);
        keep(&gl->voxels_of, result == NEBEL_OK ? lighting : NULL);
    }
    gl->fog.voxels = gl->voxels;
    return result;
}

/* A lattice belongs to one snapshot. */
static nebel_result write_nodes(nebel_gl *gl, const nebel_lighting *lighting, size_t count)
{
    nebel_texel_f32 *const words = nb_allocate_zero(&gl->allocator, whole_rows(count), sizeof *words);
    if (words == NULL) return fail_fog_memory(gl);
    nebel_result result = nebel_pack_diffusion(lighting, words, count, &count);
    if (result == NEBEL_OK) result = fill_texture(gl, &node_texels, words, count, &gl->nodes, &gl->node_rows);
    nb_release(&gl->allocator, words);
    return result;
}

static nebel_result upload_nodes(nebel_gl *gl, nebel_lighting *lighting)
{
    size_t count = 0;
    nebel_result result = nebel_pack_diffusion(lighting, NULL, 0, &count);
    if (result != NEBEL_OK || count == 0) return result;
    if (gl->nodes_of != lighting) {
        result = write_nodes(gl, lighting, count);
        keep(&gl->nodes_of, result == NEBEL_OK ? lighting : NULL);
    }
    gl->fog.diffusion = gl->nodes;
    return result;
}

static nebel_result upload_environment(nebel_gl *gl, nebel_lighting *lighting)
{
    if ((gl->fog.features & NEBEL_FEATURE_ENVIRONMENT) == 0) return NEBEL_OK;
    const nebel_result result =
        nb_environment_set(&gl->environment, &gl->allocator, &gl->log, &gl->context, lighting, 0);
    gl->fog.environment = gl->environment.name;
    return result;
}

static nebel_result upload_tiles(nebel_gl *gl, size_t count)
{
    const nebel_result result = fill_texture(gl, &entry_texels, gl->entries, count, &gl->tiles, &gl->tile_rows);
    gl->fog.tiles = gl->tiles;
    gl->fog.tile_size = TILE_SIZE;
    gl->fog.tile_columns = (gl->views[0].width + TILE_SIZE - 1) / TILE_SIZE;
    gl->fog.max_tile_volumes = fullest_tile(gl);
    return result;
}

/* The lighting is NULL where words and voxels are there already. */
static nebel_result upload_fog(nebel_gl *gl, nebel_lighting *lighting, size_t entry_count)
{
    nb_unpacking unpacking;
    nebel_result result = NEBEL_OK;
    nb_state_save_unpacking(&gl->context, &unpacking);
    if (lighting != NULL) result = upload_voxels(gl, lighting);
    if (result == NEBEL_OK && lighting != NULL) result = upload_nodes(gl, lighting);
    if (result == NEBEL_OK && lighting != NULL && !gl->dims_alone) result = upload_environment(gl, lighting);
    if (result == NEBEL_OK && lighting != NULL) result = upload_words(gl);
    if (result == NEBEL_OK && entry_count > 0) result = upload_tiles(gl, entry_count);
    nb_state_restore_unpacking(&gl->context, &unpacking);
    return result;
}

static int is_same_view(const nebel_view *a, const nebel_view *b)
{
    return a->width == b->width && a->height == b->height &&
           memcmp(a->eye_from_world, b->eye_from_world, sizeof a->eye_from_world) == 0 &&
           memcmp(a->clip_from_eye, b->clip_from_eye, sizeof a->clip_from_eye) == 0;
}

static int are_same_views(const nebel_gl *gl, const nebel_view *views, int count)
{
    int same = gl->view_count == count;
    for (int i = 0; i < count && same; i++) same = is_same_view(&gl->views[i], &views[i]);
    return same;
}

/* Where neither the fog nor the eye is another one the words stay, and in the same view the tiles, too. */
static nebel_result prepare(nebel_gl *gl, nebel_lighting *lighting, const double eye[3], const nebel_view *views,
                            int view_count)
{
    const int has_voxels = gl->fog.voxels == gl->voxels || gl->fog.voxels == 0 || is_lent(gl, lighting);
    const int has_words = gl->packed == lighting && memcmp(gl->fog.eye, eye, sizeof gl->fog.eye) == 0 && has_voxels;
    size_t entry_count = 0;
    nebel_result result = NEBEL_OK;
    gl->has_fog = has_words && are_same_views(gl, views, view_count);
    if (gl->has_fog) return NEBEL_OK;
    memcpy(gl->views, views, (size_t)view_count * sizeof *views);
    gl->view_count = view_count;
    if (!has_words) {
        gl->fog = (nebel_gl_fog_resources){.eye = {eye[0], eye[1], eye[2]}, .features = nebel_pack_features(lighting)};
        result = pack_fog(gl, lighting);
    }
    if (result == NEBEL_OK && nb_gl_count_volumes(lighting) > FEW_VOLUMES) {
        result = list_tiles(gl, lighting, &entry_count);
    }
    if (result == NEBEL_OK) result = upload_fog(gl, has_words ? NULL : lighting, entry_count);
    keep(&gl->packed, result == NEBEL_OK ? lighting : NULL);
    gl->overlaps_much = result == NEBEL_OK && find_overlap(gl, lighting);
    gl->may_tire = gl->overlaps_much || (result == NEBEL_OK && may_tire(gl));
    gl->has_fog = result == NEBEL_OK;
    return result;
}

/* Says which matrix of a view that nebel_compute_view_rays refuses is the first that it refuses by itself. */
static const char *find_view_fault(const nebel_view *view)
{
    static const double identity[16] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1};
    nebel_view turned = *view;
    nebel_rays rays;
    memcpy(turned.eye_from_world, identity, sizeof identity);
    if (nebel_compute_view_rays(&turned, NULL, &rays) != NEBEL_OK)
        return "clip_from_eye must be a projection: finite numbers, rays that meet in a point or are parallel, and a "
               "depth that changes along them";
    return "eye_from_world must be a rotation and a translation: finite numbers, 0 0 0 1 in the last row";
}

nebel_result nebel_gl_set_fog(nebel_gl *gl, nebel_lighting *lighting, const nebel_view *view)
{
    if (gl == NULL) return NEBEL_ERROR_ARGUMENT;
    gl->has_fog = 0;
    if (view == NULL) return nb_fail(&gl->log, NEBEL_ERROR_ARGUMENT, "nebel_gl_set_fog: the view is missing");
    const nebel_result result = nb_context_check(&gl->log, gl->vertex_array);
    if (result != NEBEL_OK) return result;
    nebel_rays rays;
    if (view->width - 1 > 65535 || view->height - 1 > 65535) {
        return nb_fail(&gl->log, NEBEL_ERROR_ARGUMENT, "nebel_gl_set_fog: the view has %u x %u pixels; 1 to 65536 each",
                       (unsigned)view->width, (unsigned)view->height);
    }
    if (nebel_compute_view_rays(view, NULL, &rays) != NEBEL_OK) {
        return nb_fail(&gl->log, NEBEL_ERROR_ARGUMENT, "nebel_gl_set_fog: %s", find_view_fault(view));
    }
    return prepare(gl, lighting != NULL ? lighting : gl->empty, rays.eye, view, 1);
}

nebel_result nb_gl_set_fog_around(nebel_gl *gl, nebel_lighting *lighting, const double eye[3], uint32_t width,
                                  uint32_t height)
{
    nebel_view faces[6];
    gl->has_fog = 0;
    const nebel_result result = nb_context_check(&gl->log, gl->vertex_array);
    if (result != NEBEL_OK) return result;
    nb_panorama_faces(eye, width, height, faces);
    return prepare(gl, lighting != NULL ? lighting : gl->empty, eye, faces, 6);
}
