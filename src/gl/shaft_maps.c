#include "shaft_maps.h"

#include "gl_state.h"

#include <math.h>

/* A block of a level is 8 blocks of the level below wide and high. */
enum { LEVELS = 2, LEVEL_SHIFT = 3 };

/* Light coordinates are those of the shadow maps. The ray goes from block to block: where the nearest surface of a block
 * is behind all of the ray above it, the piece is lit; where the farthest is before, it is dark; otherwise the block's
 * own blocks decide, and at last a texel, in which the ray meets its depth. Where nothing is, depth is endless. A larger
 * block is asked again when the ray has left the one that did not know. */
const char nb_shaft_text[] =
    "precision highp float;\n"
    "precision highp int;\n"
    "uniform mat3 shaft_light;\n"
    "uniform highp sampler2DArray shaft_maps, shaft_blocks;\n"
    "uniform float shaft_size, shaft_fine;\n"
    "uniform int shaft_count;\n" /* of maps, the finest first */
    "uniform int shaft_layers[8];\n"
    "uniform vec4 shaft_places[8];\n" /* low corner in light coordinates, texels per metre */
    "uniform vec2 shaft_heights;\n"   /* of depth 0; depth of a metre */
    "int shaft_turns = 0;\n"
    "vec2 shaft_range(int map, ivec2 cell, int level)\n"
    "{\n"
    "    if (level > 0) return texelFetch(shaft_blocks, ivec3(cell, map + (level - 1) * 8), 0).xy;\n"
    "    float depth = texelFetch(shaft_maps, ivec3(cell, map), 0).x;\n"
    "    return vec2(depth < 1.0 ? depth : 1e30);\n"
    "}\n"
    "float shaft_inverse(float x) { return abs(x) < 1e-20 ? (x < 0.0 ? -1e20 : 1e20) : 1.0 / x; }\n"
    /* Whether light or shadow is at t, and how far it reaches, within one map. z is how deep the ray is, and how fast it
       gets deeper. */
    "struct shaft_piece { bool known, dark; float end; };\n"
    "void shaft_walk(inout shaft_piece piece, int map, vec2 at, vec2 rate, vec2 z, float end)\n"
    "{\n"
    "    vec2 inverse = vec2(shaft_inverse(rate.x), shaft_inverse(rate.y));\n"
    "    vec2 low = -at * inverse, high = (shaft_size - at) * inverse;\n"
    "    vec2 inside = vec2(max(min(low.x, high.x), min(low.y, high.y)), min(max(low.x, high.x), max(low.y, "
    "high.y)));\n"
    "    float step = 0.004 / max(max(abs(rate.x), abs(rate.y)), 1e-9);\n"
    "    int level = 2;\n"
    "    ivec2 last = ivec2(0);\n"
    "    while (piece.end < end) {\n"
    "        shaft_turns++;\n"
    "        float t = piece.end;\n"
    "        float next = min(t + max(step, t * 5e-7), 0.5 * (t + end));\n"
    "        if (!(next > t)) next = end;\n"
    "        ivec2 texel = clamp(ivec2(at + rate * next), ivec2(0), ivec2(shaft_size) - 1);\n"
    "        int moved = max(texel.x ^ last.x, texel.y ^ last.y);\n"
    "        level = max(level, moved > 63 ? 2 : moved > 7 ? 1 : 0);\n"
    "        last = texel;\n"
    "        int shift = 3 * level;\n"
    "        ivec2 cell = texel >> shift;\n"
    "        vec2 side = vec2((cell + ivec2(rate.x > 0.0 ? 1 : 0, rate.y > 0.0 ? 1 : 0)) << shift);\n"
    "        vec2 leave = (side - at) * inverse;\n"
    "        float stop = min(max(min(leave.x, leave.y), next), end);\n"
    "        float first = z.x + z.y * next, far = z.x + z.y * stop;\n"
    "        vec2 range = shaft_range(map, cell, level);\n"
    "        bool dark = min(first, far) > range.y;\n"
    "        bool sure = dark || max(first, far) <= range.x;\n"
    "        if (!sure && level == 0) {\n"
    "            float turn = (range.x - z.x) * shaft_inverse(z.y);\n"
    "            sure = true;\n"
    "            dark = turn > next ? first > range.x : far > range.x;\n"
    "            if (turn > next && turn < stop) stop = turn;\n"
    "        }\n"
    "        if (!sure) {\n"
    "            level--;\n"
    "        } else if (piece.known && dark != piece.dark) {\n"
    "            return;\n"
    "        } else {\n"
    "            piece.known = true;\n"
    "            piece.dark = dark;\n"
    "            piece.end = stop;\n"
    "        }\n"
    "    }\n"
    "}\n"
    "vec2 shaft_lit(vec3 origin, vec3 direction, float t, float end)\n"
    "{\n"
    "    vec3 p = shaft_light * origin, d = shaft_light * direction;\n"
    "    vec2 z = vec2(shaft_heights.x - p.z, -d.z) * shaft_heights.y;\n"
    "    shaft_piece piece = shaft_piece(false, false, t);\n"
    "    while (piece.end < end) {\n"
    "        float next = piece.end + max(piece.end * 5e-7, shaft_fine), stop = end;\n"
    "        int map = 0;\n"
    "        for (; map < shaft_count; map++) {\n"
    "            shaft_turns++;\n"
    "            vec4 place = shaft_places[map];\n"
    "            vec2 inverse = vec2(shaft_inverse(d.x), shaft_inverse(d.y));\n"
    "            vec2 low = (place.xy - p.xy) * inverse, high = low + shaft_size / place.zw * inverse;\n"
    "            float enter = max(min(low.x, high.x), min(low.y, high.y));\n"
    "            float leave = min(max(low.x, high.x), max(low.y, high.y));\n"
    "            if (!(enter < leave && leave > next)) continue;\n"
    "            stop = min(stop, enter > next ? enter : leave);\n"
    "            if (enter <= next) break;\n"
    "        }\n"
    "        if (map < shaft_count) {\n"
    "            vec4 place = shaft_places[map];\n"
    "            shaft_walk(piece, shaft_layers[map], (p.xy - place.xy) * place.zw, d.xy * place.zw, z, stop);\n"
    "        } else if (!(piece.known && piece.dark)) {\n"
    "            piece.known = true;\n"
    "            piece.end = stop;\n"
    "        }\n"
    "        if (piece.end < stop) break;\n"
    "    }\n"
    "    return vec2(piece.dark ? 0.0 : 1.0, piece.end);\n"
    "}\n"
    "#define NEBEL_SUN_VISIBILITY(origin, direction, t, end) shaft_lit(origin, direction, t, end)\n"
    "#define NEBEL_SUN_VISIBILITY_ITERATIONS shaft_turns\n";

/* ---- blocks ---------------------------------------------------------------------------------- */

static const char range_text[] =
    "uniform highp sampler2DArray range_source;\n"
    "uniform ivec3 range_place;\n" /* size of the maps, of a block; layer */
    "out highp vec4 out_range;\n"
    "void main()\n"
    "{\n"
    "    ivec2 first = ivec2(gl_FragCoord.xy) * range_place.y, end = min(first + range_place.y, "
    "ivec2(range_place.x));\n"
    "    vec2 range = vec2(1e30, 0.0);\n"
    "    for (int y = first.y; y < end.y; y++) {\n"
    "        for (int x = first.x; x < end.x; x++) {\n"
    "            float depth = texelFetch(range_source, ivec3(x, y, range_place.z), 0).x;\n"
    "            if (!(depth < 1.0)) depth = 1e30;\n"
    "            range = vec2(min(range.x, depth), max(range.y, depth));\n"
    "        }\n"
    "    }\n"
    "    out_range = vec4(range, 0.0, 1.0);\n"
    "}\n";

static nebel_result make_program(nb_shaft_maps *shafts, const nb_context *context, const nebel_log *log)
{
    const char *const version = nb_program_version(context);
    const char *const precision = context->es ? "precision highp float;\nprecision highp int;\n" : "";
    const nb_shader_parts vertex = {{version, nb_triangle_text}, 2};
    const nb_shader_parts fragment = {{version, precision, range_text}, 3};
    const nebel_result result = nb_program_build(log, &vertex, &fragment, &shafts->program);
    if (result != NEBEL_OK) return result;
    glUseProgram(shafts->program);
    glUniform1i(glGetUniformLocation(shafts->program, "range_source"), NB_UNIT_SHADOWS);
    return NEBEL_OK;
}

static GLsizei level_size(const nb_shaft_maps *shafts, int level)
{
    const uint32_t block = 1U << (LEVEL_SHIFT * level);
    return (GLsizei)((shafts->maps.size + block - 1) / block);
}

static nebel_result make_ranges(nb_shaft_maps *shafts, const nebel_log *log)
{
    const GLsizei size = level_size(shafts, 1);
    glActiveTexture(GL_TEXTURE0 + NB_UNIT_SHADOWS);
    shafts->ranges = nb_targets_make_array();
    glTexImage3D(GL_TEXTURE_2D_ARRAY, 0, GL_RG32F, size, size, LEVELS * NB_MAX_MAPS, 0, GL_RG, GL_FLOAT, NULL);
    glGenFramebuffers(1, &shafts->buffer);
    return nb_context_check_memory(log, "the shadows in fog; ask for smaller shadow maps");
}

static void draw_level(const nb_shaft_maps *shafts, const nb_context *context, int level)
{
    const GLsizei size = level_size(shafts, level);
    const GLint place = glGetUniformLocation(shafts->program, "range_place");
    for (int map = 0; map < shafts->maps.count; map++) {
        const GLint layer = (level - 1) * NB_MAX_MAPS + map;
        if (!(shafts->maps.ends[map] > 0)) continue;
        glFramebufferTextureLayer(GL_DRAW_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, shafts->ranges, 0, layer);
        nb_state_clear(context, 0, 0, (uint32_t)size, (uint32_t)size);
        glUniform3i(place, (GLint)shafts->maps.size, 1 << (LEVEL_SHIFT * level), map);
        glDrawArrays(GL_TRIANGLES, 0, 3);
    }
}

/* ---- all of it ------------------------------------------------------------------------------- */

static nebel_result make_shaft_maps(nb_shaft_maps *shafts, const nb_context *context, const nebel_log *log)
{
    nebel_result result = NEBEL_OK;
    if (shafts->program == 0) result = make_program(shafts, context, log);
    if (result == NEBEL_OK && shafts->buffer == 0) result = make_ranges(shafts, log);
    return result;
}

nebel_result nb_shaft_maps_draw(nb_shaft_maps *shafts, const nb_context *context, const nebel_log *log,
                                unsigned program, unsigned vertex_array, const nb_shadows *surfaces,
                                const nb_targets *targets, const nebel_rays *rays, int panorama,
                                const nb_meshes *meshes, const nb_sunlit_fog *fog)
{
    nebel_result result = make_shaft_maps(shafts, context, log);
    if (result != NEBEL_OK) return result;
    nb_shadows_fit_fog(&shafts->maps, surfaces, targets, rays, panorama, meshes, fog);
    result = nb_shadows_draw(&shafts->maps, context, log, program, meshes, rays->eye);
    if (result != NEBEL_OK) return result;
    glBindFramebuffer(GL_DRAW_FRAMEBUFFER, shafts->buffer);
    glUseProgram(shafts->program);
    glBindVertexArray(vertex_array);
    glActiveTexture(GL_TEXTURE0 + NB_UNIT_SHADOWS);
    glBindTexture(GL_TEXTURE_2D_ARRAY, shafts->maps.texture);
    glBindSampler(NB_UNIT_SHADOWS, 0);
    for (int level = 1; level <= LEVELS; level++) draw_level(shafts, context, level);
    return NEBEL_OK;
}

static void bind(unsigned program, const char *sampler, GLuint unit, unsigned texture)
{
    glUniform1i(glGetUniformLocation(program, sampler), (GLint)unit);
    glActiveTexture(GL_TEXTURE0 + unit);
    glBindTexture(GL_TEXTURE_2D_ARRAY, texture);
    glBindSampler(unit, 0);
}

void nb_shaft_maps_set(const nb_shaft_maps *shafts, unsigned program)
{
    const nb_shadows *const s = &shafts->maps;
    float places[NB_MAX_MAPS][4] = {{0}};
    GLint layers[NB_MAX_MAPS] = {0}, count = 0;
    bind(program, "shaft_maps", NB_UNIT_SHADOWS, s->texture);
    bind(program, "shaft_blocks", NB_UNIT_VEIL, shafts->ranges);
    glUniformMatrix3fv(glGetUniformLocation(program, "shaft_light"), 1, GL_FALSE, s->light);
    glUniform1f(glGetUniformLocation(program, "shaft_size"), (float)s->size);
    for (int map = 0; map < s->count; map++) {
        if (!(s->ends[map] > 0)) continue;
        for (int i = 0; i < 4; i++) places[count][i] = s->places[map][i];
        layers[count++] = map;
    }
    const float finest = count > 0 ? fmaxf(places[0][2], places[0][3]) : 1; /* texels per metre */
    glUniform1f(glGetUniformLocation(program, "shaft_fine"), fminf(1e-6f, 5e-5f / finest));
    glUniform1i(glGetUniformLocation(program, "shaft_count"), count);
    glUniform1iv(glGetUniformLocation(program, "shaft_layers"), NB_MAX_MAPS, layers);
    glUniform4fv(glGetUniformLocation(program, "shaft_places"), NB_MAX_MAPS, places[0]);
    glUniform2f(glGetUniformLocation(program, "shaft_heights"), s->high, 1 / (s->high - s->low));
}

void nb_shaft_maps_delete(const nb_shaft_maps *shafts)
{
    nb_shadows_delete(&shafts->maps);
    glDeleteTextures(1, &shafts->ranges);
    glDeleteFramebuffers(1, &shafts->buffer);
    glDeleteProgram(shafts->program);
}
