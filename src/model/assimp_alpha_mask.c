/* Holes in surfaces: glTF's alpha modes, and the opacity maps of other formats. */
#include "assimp_load.h"

#include <assimp/GltfMaterial.h>
#include <assimp/material.h>

#include <math.h>
#include <string.h>

/* Nothing is half transparent here: what is meant to be blended is there from this alpha on. */
static const double half = 0.5;

/* An eighth of a byte's step is for cutoffs that were written in decimals. */
static bool is_hole(unsigned alpha, double cutoff)
{
    return alpha < 255 * cutoff - 0.125;
}

/* Keeps a mask that has both holes and others. */
static void take_mask(const nb_loaded_texture *mask, double cutoff, nb_assimp_surface *surface)
{
    if (mask->index < 0) return;
    surface->is_clear = is_hole(mask->max_alpha, cutoff);
    if (!is_hole(mask->min_alpha, cutoff) || is_hole(mask->max_alpha, cutoff)) return;
    surface->mask = mask->index;
    surface->alpha_cutoff = (float)cutoff;
}

static nebel_result find_in(nb_assimp *in, const struct aiMaterial *material, enum aiTextureType type, bool of_grey,
                            double cutoff, nb_assimp_surface *surface)
{
    struct aiString path;
    unsigned uv_index = 0;
    nb_loaded_texture mask;
    if (aiGetMaterialTexture(material, type, 0, &path, NULL, &uv_index, NULL, NULL, NULL, NULL) != aiReturn_SUCCESS)
        return NEBEL_OK;
    const nebel_result result = nb_assimp_find_texture(in, path.data, of_grey, &mask);
    if (result != NEBEL_OK) return result;
    take_mask(&mask, cutoff, surface);
    if (surface->mask >= 0) nb_assimp_find_uvs(in, material, type, uv_index, surface);
    return NEBEL_OK;
}

/* The alpha of a pixel is that of the texture times a factor, which the cutoff takes into itself. */
static nebel_result find_of_gltf(nb_assimp *in, const struct aiMaterial *material, const char *mode,
                                 nb_assimp_surface *surface)
{
    struct aiColor4D color = {1, 1, 1, 1};
    ai_real cutoff = (ai_real)half;
    if (strcmp(mode, "BLEND") == 0) {
        const nebel_result result = find_in(in, material, aiTextureType_BASE_COLOR, false, half, surface);
        surface->is_clear = false;
        return result;
    }
    if (strcmp(mode, "MASK") != 0) return NEBEL_OK;
    aiGetMaterialFloatArray(material, AI_MATKEY_GLTF_ALPHACUTOFF, &cutoff, NULL);
    aiGetMaterialColor(material, AI_MATKEY_BASE_COLOR, &color);
    if (!(cutoff > 0)) return NEBEL_OK;
    surface->is_clear = !(color.a >= cutoff);
    if (surface->is_clear) return NEBEL_OK;
    return find_in(in, material, aiTextureType_BASE_COLOR, false, (double)cutoff / (double)color.a, surface);
}

static bool takes_alpha(const struct aiMaterial *material)
{
    int flags = 0;
    unsigned count = 1;
    return aiGetMaterialIntegerArray(material, AI_MATKEY_TEXFLAGS(aiTextureType_DIFFUSE, 0), &flags, &count) ==
               aiReturn_SUCCESS &&
           (flags & aiTextureFlags_UseAlpha) != 0;
}

nebel_result nb_assimp_find_mask(nb_assimp *in, const struct aiMaterial *material, nb_assimp_surface *surface)
{
    struct aiString mode;
    if (aiGetMaterialString(material, AI_MATKEY_GLTF_ALPHAMODE, &mode) == aiReturn_SUCCESS)
        return find_of_gltf(in, material, mode.data, surface);
    nebel_result result = find_in(in, material, aiTextureType_OPACITY, true, half, surface);
    if (result == NEBEL_OK && surface->mask < 0 && takes_alpha(material))
        result = find_in(in, material, aiTextureType_DIFFUSE, false, half, surface);
    surface->is_clear = false;
    return result;
}
