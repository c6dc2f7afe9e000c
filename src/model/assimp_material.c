#define _POSIX_C_SOURCE 200809L
/* Base colour and its texture. */
#include "assimp_load.h"
#include "file/path.h"

#include <assimp/material.h>

#include <errno.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

/* The largest file of a texture. */
#define TEXTURE_FILE_LIMIT ((size_t)1 << 30)

/* ---- pictures -------------------------------------------------------------------------------- */

static nebel_result decode_texture(const nb_codec *codec, const nb_bytes *bytes, nebel_texture *texture)
{
    if (nb_png_is(bytes)) return nb_png_read_texture(codec, bytes, texture);
    if (nb_jpeg_is(bytes)) return nb_jpeg_read_texture(codec, bytes, texture);
    return nb_fail(&codec->log, NEBEL_ERROR_FORMAT, "%s: neither a PNG nor a JPEG picture", codec->name);
}

/* Texels come as B, G, R, A. */
static nebel_result copy_texels(const nb_codec *codec, const struct aiTexture *source, nebel_texture *texture)
{
    nebel_result result = nb_codec_check_size(codec, source->mWidth, source->mHeight, 4);
    if (result == NEBEL_OK) result = nb_codec_check_room(codec, 4 * (uint64_t)source->mWidth * source->mHeight);
    if (result != NEBEL_OK) return result;
    const size_t count = (size_t)source->mWidth * source->mHeight;
    unsigned char *rgba = nb_allocate(&codec->allocator, count, 4);
    if (rgba == NULL) return NEBEL_ERROR_MEMORY;
    for (size_t i = 0; i < count; i++) {
        const struct aiTexel *texel = &source->pcData[i];
        const unsigned char bytes[4] = {texel->r, texel->g, texel->b, texel->a};
        memcpy(rgba + 4 * i, bytes, 4);
    }
    *texture = (nebel_texture){source->mWidth, source->mHeight, rgba};
    return NEBEL_OK;
}

static nebel_result read_embedded(const nb_codec *codec, const struct aiTexture *source, nebel_texture *texture)
{
    if (source->pcData == NULL || source->mWidth == 0)
        return nb_fail(&codec->log, NEBEL_ERROR_FORMAT, "%s: the embedded picture is empty", codec->name);
    if (source->mHeight > 0) return copy_texels(codec, source, texture);
    const nb_bytes bytes = {(unsigned char *)source->pcData, source->mWidth, source->mWidth};
    return decode_texture(codec, &bytes, texture);
}

static nebel_result read_texture_file(const nb_codec *codec, int file, nebel_texture *texture)
{
    nb_bytes bytes;
    nebel_result result = nb_file_read_open(&codec->allocator, &codec->log, NULL, "texture", codec->name, file,
                                            TEXTURE_FILE_LIMIT, &bytes);
    if (result != NEBEL_OK) return result;
    result = decode_texture(codec, &bytes, texture);
    nb_release(&codec->allocator, bytes.data);
    return result;
}

/* ---- which picture --------------------------------------------------------------------------- */

/* "*3" names the third embedded picture; some formats name it by its file. */
static const struct aiTexture *find_embedded(const struct aiScene *scene, const char *path)
{
    if (path[0] == '*') {
        const unsigned long index = strtoul(path + 1, NULL, 10);
        return index < scene->mNumTextures ? scene->mTextures[index] : NULL;
    }
    for (unsigned i = 0; i < scene->mNumTextures; i++) {
        const char *name = scene->mTextures[i]->mFilename.data;
        if (name[0] != '\0' && strcmp(nb_path_name(name), nb_path_name(path)) == 0) return scene->mTextures[i];
    }
    return NULL;
}

/* Where the named file is not, a file of its name beside the model often is: authors' absolute paths travel badly. The
 * descriptor, or -1 with errno set. */
static int open_texture(nb_assimp *in, const char *path)
{
    const int file = nb_model_files_open(&in->files, path);
    const int error = errno;
    if (file >= 0 || strchr(path, '/') == NULL) return file;
    const char *folder = nb_path_folder(&in->scratch, in->files.name);
    const char *beside = folder != NULL ? nb_path_join(&in->scratch, folder, nb_path_name(path)) : NULL;
    const int other = beside != NULL ? nb_model_files_open(&in->files, beside) : -1;
    if (other < 0) errno = error;
    return other;
}

/* How the texture is called in messages: as it would be opened. */
static const char *show_path(nb_assimp *in, const char *path)
{
    const char *folder = nb_path_folder(&in->scratch, in->load->source->file);
    return folder != NULL ? nb_path_join(&in->scratch, folder, path) : NULL;
}

/* Where a picture has no alpha. */
static void set_alpha_of_grey(nebel_texture *texture)
{
    const size_t count = (size_t)texture->width * texture->height;
    uint8_t *rgba = (uint8_t *)texture->rgba;
    for (size_t i = 0; i < count; i++)
        if (rgba[4 * i + 3] != 255) return;
    for (size_t i = 0; i < count; i++)
        rgba[4 * i + 3] = (uint8_t)((rgba[4 * i] + rgba[4 * i + 1] + rgba[4 * i + 2] + 1) / 3);
}

static nebel_result read_named(nb_assimp *in, const nb_codec *codec, const char *path, nebel_texture *texture)
{
    const nb_refusal before = in->files.refusal;
    in->files.refusal = NB_REFUSAL_NONE;
    const int file = open_texture(in, path);
    const int error = errno;
    const nb_refusal refusal = in->files.refusal;
    in->files.refusal = before;
    if (file >= 0) {
        const nebel_result result = read_texture_file(codec, file, texture);
        close(file);
        return result;
    }
    if (refusal != NB_REFUSAL_NONE)
        return nb_fail(&codec->log, NEBEL_ERROR_FILE, "the texture \"%s\" %s", path,
                       nb_model_files_refusal_text(refusal));
    return nb_fail(&codec->log, NEBEL_ERROR_FILE, "cannot read the texture \"%s\": %s", codec->name, strerror(error));
}

/* What a decoder says goes on as a note: the model is good without its texture. */
static nebel_result read_picture(nb_assimp *in, const char *path, nebel_texture *texture)
{
    nb_note note = {""};
    const struct aiTexture *embedded = find_embedded(in->scene, path);
    const char *name = embedded == NULL ? show_path(in, path) : in->load->source->file;
    bool is_full = false;
    const nb_codec codec = {.allocator = in->load->allocator,
                            .log = nb_note_log(&note),
                            .name = name,
                            .room = nb_model_room(in->load),
                            .is_full = &is_full};
    if (name == NULL) return nb_model_fail(in->load, NEBEL_ERROR_MEMORY, "out of memory");
    const nebel_result result =
        embedded != NULL ? read_embedded(&codec, embedded, texture) : read_named(in, &codec, path, texture);
    if (result == NEBEL_ERROR_MEMORY)
        return nb_model_fail(in->load, result, "out of memory for the texture \"%s\"", path);
    if (is_full) return nb_model_fail(in->load, result, "%s", note.text);
    if (result != NEBEL_OK) nb_model_note(in->load, "%s; the plain colour is used instead", note.text);
    return NEBEL_OK;
}

static nebel_result remember(nb_assimp *in, const char *path, nb_loaded_texture *loaded)
{
    void *textures = in->textures;
    loaded->key = nb_arena_copy_text(&in->scratch, path, strlen(path));
    if (loaded->key == NULL || !nb_grow(&in->load->allocator, &textures, sizeof *in->textures, in->loaded_count,
                                        &in->loaded_capacity, in->loaded_count + 1))
        return nb_model_fail(in->load, NEBEL_ERROR_MEMORY, "out of memory");
    in->textures = textures;
    in->textures[in->loaded_count++] = *loaded;
    return NEBEL_OK;
}

static void find_alphas(const nebel_texture *texture, nb_loaded_texture *loaded)
{
    const size_t count = (size_t)texture->width * texture->height;
    loaded->min_alpha = 255;
    loaded->max_alpha = 0;
    for (size_t i = 0; i < count; i++) {
        const uint8_t alpha = texture->rgba[4 * i + 3];
        loaded->min_alpha = alpha < loaded->min_alpha ? alpha : loaded->min_alpha;
        loaded->max_alpha = alpha > loaded->max_alpha ? alpha : loaded->max_alpha;
    }
}

nebel_result nb_assimp_find_texture(nb_assimp *in, char *path, bool of_grey, nb_loaded_texture *found)
{
    nebel_texture texture = {0};
    for (char *at = path; *at != '\0'; at++)
        if (*at == '\\') *at = '/';
    for (size_t i = 0; i < in->loaded_count; i++)
        if (in->textures[i].of_grey == of_grey && strcmp(in->textures[i].key, path) == 0) {
            *found = in->textures[i];
            return NEBEL_OK;
        }
    *found = (nb_loaded_texture){.of_grey = of_grey, .index = -1};
    nebel_result result = read_picture(in, path, &texture);
    if (texture.rgba != NULL && of_grey) set_alpha_of_grey(&texture);
    if (texture.rgba != NULL) find_alphas(&texture, found);
    if (result == NEBEL_OK && texture.rgba != NULL) result = nb_model_add_texture(in->load, &texture, &found->index);
    return result == NEBEL_OK ? remember(in, path, found) : result;
}

/* ---- coordinates ----------------------------------------------------------------------------- */

/* KHR_texture_transform: scale, then a turn counter-clockwise as the texture is seen, then an offset. Assimp tells the
 * first two, with the turn negated, and moves the offset so that turns are about the middle and v points up; here
 * that is taken back. */
void nb_assimp_find_uvs(const nb_assimp *in, const struct aiMaterial *material, enum aiTextureType type,
                        unsigned uv_index, nb_assimp_surface *surface)
{
    struct aiUVTransform map;
    surface->uv_index = uv_index;
    surface->has_uv_map = in->files.has_uris &&
                          aiGetMaterialUVTransform(material, AI_MATKEY_UVTRANSFORM(type, 0), &map) == aiReturn_SUCCESS;
    if (!surface->has_uv_map) return;
    const double x = (double)map.mScaling.x, y = (double)map.mScaling.y, turn = -(double)map.mRotation;
    const double c = cos(turn), s = sin(turn);
    const double right = (double)map.mTranslation.x - x / 2 * (s - c + 1);
    const double down = y / 2 * (s + c - 1) + 1 - y - (double)map.mTranslation.y;
    const double rows[2][3] = {{c * x, s * y, right}, {-s * x, c * y, down}};
    memcpy(surface->uv_map, rows, sizeof rows);
}

/* ---- the surface ----------------------------------------------------------------------------- */

/* KHR_materials_pbrSpecularGlossiness: its diffuse color is the base color; that of the other model is a default. */
static bool is_glossy(const nb_assimp *in, const struct aiMaterial *material)
{
    ai_real glossiness = 0;
    return in->files.has_uris &&
           aiGetMaterialFloatArray(material, AI_MATKEY_GLOSSINESS_FACTOR, &glossiness, NULL) == aiReturn_SUCCESS;
}

static void read_color(const nb_assimp *in, const struct aiMaterial *material, float color[3])
{
    struct aiColor4D found;
    if ((is_glossy(in, material) || aiGetMaterialColor(material, AI_MATKEY_BASE_COLOR, &found) != aiReturn_SUCCESS) &&
        aiGetMaterialColor(material, AI_MATKEY_COLOR_DIFFUSE, &found) != aiReturn_SUCCESS)
        return;
    const float values[3] = {found.r, found.g, found.b};
    for (int i = 0; i < 3; i++) color[i] = !(values[i] > 0) ? 0 : values[i] < 1 ? values[i] : 1;
}

static nebel_result read_texture(nb_assimp *in, const struct aiMaterial *material, nb_assimp_surface *surface)
{
    static const enum aiTextureType types[] = {aiTextureType_BASE_COLOR, aiTextureType_DIFFUSE};
    for (int i = is_glossy(in, material) ? 1 : 0; i < 2; i++) {
        struct aiString path;
        nb_loaded_texture found;
        unsigned uv_index = 0;
        if (aiGetMaterialTexture(material, types[i], 0, &path, NULL, &uv_index, NULL, NULL, NULL, NULL) !=
            aiReturn_SUCCESS)
            continue;
        nb_assimp_find_uvs(in, material, types[i], uv_index, surface);
        const nebel_result result = nb_assimp_find_texture(in, path.data, false, &found);
        if (result == NEBEL_OK) surface->texture = found.index;
        return result;
    }
    return NEBEL_OK;
}

/* The colour of the scene file replaces the model's own, texture and all, but not its holes. Some exporters leave a
 * textured material black, which would leave its texture black, too. */
static nebel_result read_surface(nb_assimp *in, unsigned material, nb_assimp_surface *surface)
{
    const nb_model_source *source = in->load->source;
    *surface = (nb_assimp_surface){.known = true, .base_color = {0.5f, 0.5f, 0.5f}, .texture = -1, .mask = -1};
    for (int i = 0; i < 3 && source->has_color; i++) surface->base_color[i] = (float)source->color[i];
    if (material >= in->scene->mNumMaterials) return NEBEL_OK;
    const struct aiMaterial *const found = in->scene->mMaterials[material];
    if (source->has_color) return nb_assimp_find_mask(in, found, surface);
    float *color = surface->base_color;
    read_color(in, found, color);
    const nebel_result result = read_texture(in, found, surface);
    if (surface->texture >= 0 && color[0] == 0 && color[1] == 0 && color[2] == 0) color[0] = color[1] = color[2] = 1;
    return result == NEBEL_OK ? nb_assimp_find_mask(in, found, surface) : result;
}

nebel_result nb_assimp_find_surface(nb_assimp *in, unsigned material, nb_assimp_surface *surface)
{
    const bool exists = material < in->scene->mNumMaterials;
    if (exists && in->surfaces[material].known) {
        *surface = in->surfaces[material];
        return NEBEL_OK;
    }
    const nebel_result result = read_surface(in, material, surface);
    if (exists && result == NEBEL_OK) in->surfaces[material] = *surface;
    return result;
}
