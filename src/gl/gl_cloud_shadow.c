#include "gl_cloud_shadow.h"

#include "scene_programs.h"

#include <epoxy/gl.h>
#include <string.h>

/* ---- texels ---------------------------------------------------------------------------------- */

static uint32_t bits_of(float number)
{
    uint32_t bits;
    memcpy(&bits, &number, sizeof bits);
    return bits;
}

static uint32_t pack_part(float part, uint32_t most)
{
    return (uint32_t)((float)most * fmaxf(0, fminf(1, part)) + 0.5f);
}

typedef struct shadow_texels {
    uint32_t *words, count;
    size_t stride;
} shadow_texels;

static uint32_t *texel_at(const shadow_texels *t, uint32_t i)
{
    return t->words + NB_CLOUD_SHADE_TEXELS * t->stride * i;
}

static void add(shadow_texels *t, float at, uint32_t light)
{
    uint32_t *const texel = texel_at(t, t->count++);
    texel[0] = bits_of(at);
    texel[1] = light;
}

/* Pieces of the same light are one. */
static void add_fog(shadow_texels *t, uint32_t first, float end, float sun, float sky)
{
    const uint32_t light = pack_part(sun, 65535) | pack_part(sky, 65535) << 16;
    if (t->count > first && texel_at(t, t->count - 1)[1] == light) t->count--;
    add(t, end, light);
}

uint32_t nb_gl_cloud_shade_write(const nb_shadowed_segment *air, uint32_t air_count, const nb_fog_shadow *fog,
                                 uint32_t *words, size_t stride)
{
    shadow_texels t = {words, 1, stride};
    for (uint32_t k = 0; k < air_count; k++)
        add(&t, air[k].t,
            pack_part(air[k].part[0], 2047) | pack_part(air[k].part[1], 2047) << 11 |
                pack_part(air[k].part[2], 1023) << 22);
    const uint32_t first = t.count;
    if (fog != NULL) {
        const nebel_fog_shadow *const p = &fog->pieces;
        for (uint32_t k = 0; k < p->count; k++)
            add_fog(&t, first, p->t[k + 1], p->sun_transmittance[k], p->sky_transmittance[k] / fog->clear_sky);
        if (fog->end > p->t[p->count]) add_fog(&t, first, fog->end, 1, 1);
    }
    words[0] = bits_of(fog != NULL ? fog->pieces.t[0] : 0);
    words[1] = air_count | (t.count - first) << 8;
    return t.count;
}

/* ---- the texture ----------------------------------------------------------------------------- */

nebel_result nb_gl_cloud_shade_upload(nb_gl_cloud_shade *shade, const nebel_log *log, uint32_t width, uint32_t height,
                                      uint32_t layers, const uint32_t *words)
{
    const int is_new = shade->texture == 0;
    if (is_new) glGenTextures(1, &shade->texture);
    glBindTexture(GL_TEXTURE_2D_ARRAY, shade->texture);
    if (is_new) {
        glTexParameteri(GL_TEXTURE_2D_ARRAY, GL_TEXTURE_MIN_FILTER, GL_NEAREST);
        glTexParameteri(GL_TEXTURE_2D_ARRAY, GL_TEXTURE_MAG_FILTER, GL_NEAREST);
        glTexParameteri(GL_TEXTURE_2D_ARRAY, GL_TEXTURE_MAX_LEVEL, 0);
    }
    glTexImage3D(GL_TEXTURE_2D_ARRAY, 0, GL_RG32UI, (GLsizei)width, (GLsizei)height, (GLsizei)layers, 0, GL_RG_INTEGER,
                 GL_UNSIGNED_INT, words);
    return nb_context_check_memory(log, "the shade of clouds; ask for fewer pixels");
}

void nb_gl_cloud_shade_set(const nb_gl_cloud_shade *shade, unsigned program)
{
    glActiveTexture(GL_TEXTURE0 + NB_UNIT_SHADE);
    glBindTexture(GL_TEXTURE_2D_ARRAY, shade->texture);
    glBindSampler(NB_UNIT_SHADE, 0);
    glUniform1i(glGetUniformLocation(program, "shade_texture"), NB_UNIT_SHADE);
    glUniform1f(glGetUniformLocation(program, "shade_clear_sky"), shade->clear_sky);
}

/* ---- texts ----------------------------------------------------------------------------------- */

_Static_assert((int)NB_SHADED_PIECES == 7, "nb_cloud_shade_text has room for so many");

/* nb_shadowed_air_light. */
const char nb_cloud_shade_text[] =
    "uniform highp usampler2DArray shade_texture;\n"
    "int shaded_count = 0;\n"
    "float shaded_from[7];\n"
    "vec3 shaded_part[7], shaded_rest[7];\n"
    "uvec2 shade_texel(int i) { return texelFetch(shade_texture, ivec3(ivec2(gl_FragCoord.xy), i), 0).xy; }\n"
    "void pass_open_shade()\n"
    "{\n"
    "    vec3 light = vec3(0.0), before = vec3(0.0), part = vec3(1.0);\n"
    "    shaded_count = int(shade_texel(0).y & 255u);\n"
    "    for (int k = 0; k < shaded_count; k++) {\n"
    "        uvec2 texel = shade_texel(k + 1);\n"
    "        float from = uintBitsToFloat(texel.x);\n"
    "        vec3 clear = airs_up_to(from).in_scattering;\n"
    "        light += part * (clear - before);\n"
    "        part = vec3(uvec3(texel.y, texel.y >> 11, texel.y >> 22) & uvec3(2047u, 2047u, 1023u)) /\n"
    "               vec3(2047.0, 2047.0, 1023.0);\n"
    "        shaded_from[k] = from;\n"
    "        shaded_part[k] = part;\n"
    "        shaded_rest[k] = light - part * clear;\n"
    "        before = clear;\n"
    "    }\n"
    "}\n"
    "nebel_transfer pass_air(float t)\n"
    "{\n"
    "    nebel_transfer air = airs_up_to(t);\n"
    "    for (int k = shaded_count - 1; k >= 0; k--) {\n"
    "        if (!(t > shaded_from[k])) continue;\n"
    "        air.in_scattering = shaded_rest[k] + shaded_part[k] * air.in_scattering;\n"
    "        break;\n"
    "    }\n"
    "    return air;\n"
    "}\n";

/* As src/cpu/cpu_fog_shadow.c has it: fog between two places of a ray counts as spread evenly, and may all be where shade is off most.
 * Pieces that end before the place that the walk has come to are left behind. */
const char nb_fog_shadow_text[] =
    "uniform float shade_clear_sky;\n"
    "struct pass_shade { vec2 mean; vec2 doubt; float cut; };\n" /* of the sun and of the sky; where to cut */
    "int shade_first, shade_last;\n"
    "float shade_begin;\n" /* of the first */
    "void pass_open_fog_shade()\n"
    "{\n"
    "    uvec2 head = shade_texel(0);\n"
    "    shade_begin = uintBitsToFloat(head.x);\n"
    "    shade_first = 1 + int(head.y & 255u);\n"
    "    shade_last = shade_first + int(head.y >> 8) - 1;\n"
    "}\n"
    "void pass_leave_fog_shade(float at)\n"
    "{\n"
    "    for (; shade_first <= shade_last; shade_first++) {\n"
    "        float end = uintBitsToFloat(shade_texel(shade_first).x);\n"
    "        if (end > at) break;\n"
    "        shade_begin = end;\n"
    "    }\n"
    "}\n"
    "pass_shade pass_fog_shade_between(float a, float b)\n"
    "{\n"
    "    pass_shade shade = pass_shade(vec2(1.0), vec2(0.0), 0.0);\n"
    "    vec2 sum = vec2(0.0), low = vec2(1e30), high = vec2(0.0);\n"
    "    float begin = shade_begin, within = 0.0;\n"
    "    int last = begin > a && begin < b ? shade_first - 1 : -1, first = last, i = shade_first;\n"
    "    for (; i <= shade_last && begin < b; i++) {\n"
    "        uvec2 texel = shade_texel(i);\n"
    "        float end = uintBitsToFloat(texel.x), part = min(b, end) - max(a, begin);\n"
    "        vec2 light = vec2(float(texel.y & 65535u), shade_clear_sky * float(texel.y >> 16)) / 65535.0;\n"
    "        if (part > 0.0) {\n"
    "            within += part;\n"
    "            sum += part * light;\n"
    "            low = min(low, light);\n"
    "            high = max(high, light);\n"
    "        }\n"
    "        if (end > a && end < b) {\n"
    "            if (first < 0) first = i;\n"
    "            last = i;\n"
    "        }\n"
    "        begin = end;\n"
    "    }\n"
    "    if (within > 0.0) {\n"
    "        shade.mean = sum / within;\n"
    "        shade.doubt = max(max(high - shade.mean, shade.mean - low), 0.0);\n"
    "    }\n"
    "    if (first >= 0) {\n"
    "        int middle = (first + last) / 2;\n"
    "        shade.cut = middle < shade_first ? shade_begin : uintBitsToFloat(shade_texel(middle).x);\n"
    "    }\n"
    "    return shade;\n"
    "}\n";
