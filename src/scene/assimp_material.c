/* Base colour and its texture. */
#include "scene/assimp_load.h"
#include "scene/path.h"

#include <assimp/material.h>

#include <stdlib.h>
#include <string.h>

/* The largest file of a texture. */
#define FILE_LIMIT ((size_t)1 << 30)

/* ---- pictures -------------------------------------------------------------------------------- */

static nebel_result decode(const nb_codec *codec, const nb_bytes *bytes, nebel_texture *texture)
{
    if (nb_png_is(bytes)) return nb_png_read_texture(codec, bytes, texture);
    if (nb_jpeg_is(bytes)) return nb_jpeg_read_texture(codec, bytes, texture);
    return nb_fail(&codec->log, NEBEL_ERROR_FORMAT, "%s: neither a PNG nor a JPEG picture", codec->name);
}

/* Texels come as B, G, R, A. */
static nebel_result copy_texels(const nb_codec *codec, const struct aiTexture *source, nebel_texture *texture)
{
    const nebel_result result = nb_codec_check_size(codec, source->mWidth, source->mHeight, 4);
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
    return decode(codec, &bytes, texture);
}

static nebel_result read_file(const nb_codec *codec, const char *path, nebel_texture *texture)
{
    nb_bytes bytes;
    nebel_result result = nb_file_check(&codec->log, NULL, "texture", path);
    if (result == NEBEL_OK)
        result = nb_file_read(&codec->allocator, &codec->log, NULL, "texture", path, FILE_LIMIT, &bytes);
    if (result != NEBEL_OK) return result;
    result = decode(codec, &bytes, texture);
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

/* Where the named file is not, a file of its name beside the model often is: authors' absolute paths travel badly. */
static const char *find_file(nb_assimp *in, const char *path)
{
    const nebel_log silent = {0};
    const char *joined = nb_path_join(&in->scratch, in->folder, path);
    if (joined == NULL || nb_file_check(&silent, NULL, "texture", joined) == NEBEL_OK) return joined;
    const char *beside = nb_path_join(&in->scratch, in->folder, nb_path_name(path));
    return beside != NULL && nb_file_check(&silent, NULL, "texture", beside) == NEBEL_OK ? beside : joined;
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

/* What a decoder says goes on as a note: the model is good without its texture. */
static nebel_result read_picture(nb_assimp *in, const char *path, nebel_texture *texture)
{
    nb_note note = {""};
    const struct aiTexture *embedded = find_embedded(in->scene, path);
    const char *file = embedded == NULL ? find_file(in, path) : in->load->source->file;
    const nb_codec codec = {.allocator = in->load->allocator, .log = nb_note_log(&note), .name = file};
    if (file == NULL) return nb_model_fail(in->load, NEBEL_ERROR_MEMORY, "out of memory");
    const nebel_result result =
        embedded != NULL ? read_embedded(&codec, embedded, texture) : read_file(&codec, file, texture);
    if (result == NEBEL_ERROR_MEMORY)
        return nb_model_fail(in->load, result, "out of memory for the texture \"%s\"", path);
    if (result != NEBEL_OK) nb_model_fail(in->load, NEBEL_OK, "%s; the plain colour is used instead", note.text);
    return NEBEL_OK;
}

static nebel_result remember(nb_assimp *in, const char *path, bool of_grey, int32_t index)
{
    void *textures = in->textures;
    const char *key = nb_arena_copy_text(&in->scratch, path, strlen(path));
    if (key == NULL || !nb_grow(&in->load->allocator, &textures, sizeof *in->textures, in->loaded_count,
                                &in->loaded_capacity, in->loaded_count + 1))
        return nb_model_fail(in->load, NEBEL_ERROR_MEMORY, "out of memory");
    in->textures = textures;
    in->textures[in->loaded_count++] = (nb_loaded_texture){key, of_grey, index};
    return NEBEL_OK;
}

nebel_result nb_assimp_find_texture(nb_assimp *in, char *path, bool of_grey, int32_t *index)
{
    nebel_texture texture = {0};
    *index = -1;
    for (char *at = path; *at != '\0'; at++)
        if (*at == '\\') *at = '/';
    for (size_t i = 0; i < in->loaded_count; i++)
        if (in->textures[i].of_grey == of_grey && strcmp(in->textures[i].key, path) == 0) {
            *index = in->textures[i].index;
            return NEBEL_OK;
        }
    nebel_result result = read_picture(in, path, &texture);
    if (texture.rgba != NULL && of_grey) set_alpha_of_grey(&texture);
    if (result == NEBEL_OK && texture.rgba != NULL) result = nb_model_add_texture(in->load, &texture, index);
    return result == NEBEL_OK ? remember(in, path, of_grey, *index) : result;
}

/* ---- the surface ----------------------------------------------------------------------------- */

static void read_color(const struct aiMaterial *material, float color[3])
{
    struct aiColor4D found;
    if (aiGetMaterialColor(material, AI_MATKEY_BASE_COLOR, &found) != aiReturn_SUCCESS &&
        aiGetMaterialColor(material, AI_MATKEY_COLOR_DIFFUSE, &found) != aiReturn_SUCCESS)
        return;
    const float values[3] = {found.r, found.g, found.b};
    for (int i = 0; i < 3; i++) color[i] = !(values[i] > 0) ? 0 : values[i] < 1 ? values[i] : 1;
}

static nebel_result read_texture(nb_assimp *in, const struct aiMaterial *material, nb_surface *surface)
{
    static const enum aiTextureType types[] = {aiTextureType_BASE_COLOR, aiTextureType_DIFFUSE};
    for (int i = 0; i < 2; i++) {
        struct aiString path;
        unsigned uv_index = 0;
        if (aiGetMaterialTexture(material, types[i], 0, &path, NULL, &uv_index, NULL, NULL, NULL, NULL) !=
            aiReturn_SUCCESS)
            continue;
        surface->uv_index = uv_index;
        return nb_assimp_find_texture(in, path.data, false, &surface->texture);
    }
    return NEBEL_OK;
}

/* The colour of the scene file replaces the model's own, texture and all, but not its holes. Some exporters leave a
 * textured material black, which would leave its texture black, too. */
static nebel_result read_surface(nb_assimp *in, unsigned material, nb_surface *surface)
{
    const nb_model_source *source = in->load->source;
    *surface = (nb_surface){.known = true, .base_color = {0.5f, 0.5f, 0.5f}, .texture = -1, .mask = -1};
    for (int i = 0; i < 3 && source->has_color; i++) surface->base_color[i] = (float)source->color[i];
    if (material >= in->scene->mNumMaterials) return NEBEL_OK;
    const struct aiMaterial *const found = in->scene->mMaterials[material];
    if (source->has_color) return nb_assimp_find_mask(in, found, surface);
    float *color = surface->base_color;
    read_color(found, color);
    const nebel_result result = read_texture(in, found, surface);
    if (surface->texture >= 0 && color[0] == 0 && color[1] == 0 && color[2] == 0) color[0] = color[1] = color[2] = 1;
    return result == NEBEL_OK ? nb_assimp_find_mask(in, found, surface) : result;
}

nebel_result nb_assimp_find_surface(nb_assimp *in, unsigned material, nb_surface *surface)
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
