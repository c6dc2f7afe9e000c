#include "fog_program.h"

#include "aerial_text.h"
#include "gl_cloud_shadow.h"
#include "gl_panorama.h"
#include "shaft_maps.h"
#include "fog_multi_pass.h"

#include <epoxy/gl.h>
#include <stdio.h>
#include <string.h>

/* One triangle that covers the picture. The words of the rays go along, the same for all fragments: software drivers
 * read them from there in a third of the time that they need for uniforms. */
static const char vertex_text[] =
    "uniform vec4 nebel_rays[10];\n"
    "flat out vec4 pass_rays[10];\n"
    "void main()\n"
    "{\n"
    "    pass_rays = nebel_rays;\n"
    "    gl_Position = vec4(float(gl_VertexID & 1) * 4.0 - 1.0, float(gl_VertexID >> 1) * 4.0 - 1.0, 0.0, 1.0);\n"
    "}\n";

const char nb_triangle_text[] =
    "void main()\n"
    "{\n"
    "    gl_Position = vec4(float(gl_VertexID & 1) * 4.0 - 1.0, float(gl_VertexID >> 1) * 4.0 - 1.0, 0.0, 1.0);\n"
    "}\n";

/* Behind the shader text. Texels are fetched by number, so that no filter and no coordinate of the host matters. */
static const char fog_fragment_text[] =
    "uniform ivec2 pass_corner;\n"
    "#if defined(NEBEL_TILES) && !defined(PASS_PANORAMA)\n"
    "uniform ivec2 pass_tiling;\n" /* the logarithm of the size, and how many in a row */
    "#endif\n"
    "#ifdef PASS_MULTISAMPLED\n"
    "uniform highp sampler2DMS pass_depth;\n"
    "uniform vec2 pass_sample_places[32];\n"
    "#define PASS_COLOR highp sampler2DMS\n"
    "#else\n"
    "uniform highp sampler2D pass_depth;\n"
    "#define PASS_COLOR highp sampler2D\n"
    "#endif\n"
    "#ifdef PASS_CLOUDS\n"
    "uniform bool pass_is_turned;\n" /* rays go where pass_depth says behind the distance */
    "#endif\n"
    "#ifdef PASS_COMPOSE\n"
    "uniform PASS_COLOR pass_color;\n"
    "#endif\n"
    "#ifndef PASS_STEP\n"
    "layout(location = 0 PASS_FIRST) out highp vec4 pass_first;\n"
    "#endif\n"
    "#ifdef PASS_SECOND\n"
    "layout(location = PASS_SECOND) out highp vec4 pass_second;\n"
    "#endif\n"
    "\n"
    "nebel_view_ray pass_sight(vec2 pixel, float depth)\n"
    "{\n"
    "#ifdef PASS_PANORAMA\n"
    "    nebel_view_ray sight;\n"
    "    sight.origin = vec3(0.0);\n"
    "    sight.direction = ray_direction(pixel);\n"
    "    sight.t_max = depth > 0.0 && depth < 1e18 ? depth : 1e18;\n"
    "    return sight;\n"
    "#else\n"
    "    return nebel_make_view_ray(pixel, depth);\n"
    "#endif\n"
    "}\n"
    "\n"
    "int pass_entry(nebel_view_ray sight, vec2 pixel)\n"
    "{\n"
    "    int entry = 0;\n"
    "#if defined(NEBEL_TILES) && defined(PASS_PANORAMA)\n"
    "    entry = face_entry(sight.direction);\n"
    "#elif defined(NEBEL_TILES)\n"
    "    ivec2 tile = ivec2(pixel) >> pass_tiling.x;\n"
    "    entry = 2 * (tile.x + tile.y * pass_tiling.y);\n"
    "#endif\n"
    "    return entry;\n"
    "}\n";

static const char whole_text[] =
    "nebel_transfer pass_fog(vec2 pixel, vec4 place)\n"
    "{\n"
    "    nebel_view_ray sight = pass_sight(pixel, place.x);\n"
    "#ifdef PASS_CLOUDS\n"
    "    if (pass_is_turned) sight.direction = place.yzw;\n"
    "#endif\n"
    "    int entry = pass_entry(sight, pixel);\n"
    "#ifdef NEBEL_SKY_VIEW\n"
    "    return pass_haze(sight, entry);\n"
    "#elif defined(NEBEL_TILES)\n"
    "    return nebel_trace_list(sight.origin, sight.direction, sight.t_max, NEBEL_TILE_ENTRY(entry), "
    "NEBEL_TILE_ENTRY(entry + "
    "1));\n"
    "#else\n"
    "    return nebel_trace(sight.origin, sight.direction, sight.t_max);\n"
    "#endif\n"
    "}\n"
    "\n"
    "void pass_write(vec3 transmittance, vec3 in_scattering, vec4 composed)\n"
    "{\n"
    "#ifdef PASS_COMPOSE\n"
    "    pass_first = composed;\n"
    "#elif defined(PASS_SECOND)\n"
    "    pass_first = vec4(in_scattering, 1.0);\n"
    "    pass_second = vec4(transmittance, 1.0);\n"
    "#else\n"
    "    pass_first = vec4(in_scattering, dot(transmittance, vec3(1.0 / 3.0)));\n"
    "#endif\n"
    "}\n"
    "\n"
    "vec4 pass_over(nebel_transfer fog, ivec2 texel, int s)\n"
    "{\n"
    "#ifdef PASS_COMPOSE\n"
    "    vec4 color = texelFetch(pass_color, texel, s);\n"
    "    return vec4(fog.transmittance * color.rgb + fog.in_scattering, color.a);\n"
    "#else\n"
    "    return vec4(0.0);\n"
    "#endif\n"
    "}\n"
    "\n"
    "void main()\n"
    "{\n"
    "    ivec2 texel = ivec2(gl_FragCoord.xy);\n"
    "    vec2 low = vec2(texel - pass_corner);\n"
    "#ifdef PASS_MULTISAMPLED\n"
    "    vec3 transmittance = vec3(0.0), in_scattering = vec3(0.0);\n"
    "    vec4 composed = vec4(0.0);\n"
    "    for (int s = pass_sample_range.x; s < pass_sample_range.y; s++) {\n"
    "        nebel_transfer fog = pass_fog(low + pass_sample_places[s], texelFetch(pass_depth, texel, s));\n"
    "        transmittance += fog.transmittance;\n"
    "        in_scattering += fog.in_scattering;\n"
    "        composed += pass_over(fog, texel, s);\n"
    "    }\n"
    "    float share = 1.0 / float(pass_sample_range.y - pass_sample_range.x);\n"
    "    pass_write(share * transmittance, share * in_scattering, share * composed);\n"
    "#else\n"
    "    nebel_transfer fog = pass_fog(low + 0.5, texelFetch(pass_depth, texel, 0));\n"
    "    pass_write(fog.transmittance, fog.in_scattering, pass_over(fog, texel, 0));\n"
    "#endif\n"
    "}\n";

const char *nb_program_version(const nb_context *context)
{
    return context->es ? "#version 300 es\n" : "#version 330 core\n";
}

const char *nb_program_limits(const nb_context *context, const char *shares, char *text, size_t size)
{
    text[0] = '\0';
    if (context->most_turns > 0) {
        (void)snprintf(text, size, "#define NEBEL_MAX_ITERATIONS (%d %s)\n", context->most_turns, shares);
    }
    return text;
}

const char *nb_program_output(nebel_gl_output output)
{
    static const char *const texts[NEBEL_GL_OUTPUT_COUNT] = {
        [NEBEL_GL_OUTPUT_COMPOSE] = "#define PASS_COMPOSE\n#define PASS_FIRST\n",
        [NEBEL_GL_OUTPUT_SPLIT] = "#define PASS_FIRST\n#define PASS_SECOND 1\n",
        [NEBEL_GL_OUTPUT_BLEND] = "#define PASS_FIRST , index = 0\n#define PASS_SECOND 0, index = 1\n",
        [NEBEL_GL_OUTPUT_BLEND_GRAY] = "#define PASS_FIRST\n",
    };
    return texts[output];
}

const char *nb_program_extension(const nb_context *context, nebel_gl_output output)
{
    const int extended = output == NEBEL_GL_OUTPUT_BLEND && context->dual_source == 2;
    return extended ? "#extension GL_EXT_blend_func_extended : require\n" : "";
}

/* What comes before the shader text. */
static void write_fog_head(const nb_context *context, const nb_program_kind *kind, char *text, size_t size)
{
    /* The first sample, and the one behind the last: which ones a fragment walks through is told before the text. */
    const char *const samples = "#define PASS_MULTISAMPLED\nuniform ivec2 pass_sample_range;\n";
    /* Turns that are not known before are counted one by one, so that a walk through cells ends in time; others may be too
       many once: what a driver has not let end is found again in the next step. */
    const int is_counted = (kind->features & NEBEL_FEATURE_GRID) != 0;
    const char *const step = "#define PASS_STEP\n#define NEBEL_RESUMABLE\n";
    char limits[128], air[NB_AIR_HEAD];
    const char *const shares = kind->multisampled ? "/ (pass_sample_range.y - pass_sample_range.x)"
                               : kind->air        ? "* 3 / 4" /* what is left of a ray that was cut is summed twice */
                               : kind->step && !is_counted ? "* 2"
                                                           : "";
    (void)snprintf(text, size,
                   "%s%s%s%s%s%s%s%s%s%s%s%s%s%s%s#define NEBEL_VIEW\n#define NEBEL_DEPTH_ENCODING %d\n#define "
                   "NEBEL_FEATURES_LITERAL\n#define NEBEL_FEATURES %u\n"
                   "flat in highp vec4 pass_rays[10];\n#define NEBEL_RAY(i) pass_rays[i]\n"
                   "#define RAY_WORD(i) pass_rays[i].xyz\n%s",
                   nb_program_version(context), kind->step ? "" : nb_program_extension(context, kind->output),
                   nb_program_limits(context, shares, limits, sizeof limits),
                   kind->in_texture ? "#define NEBEL_FOG_TEXTURE\n" : "", kind->tiled ? "#define NEBEL_TILES\n" : "",
                   (kind->features & NEBEL_FEATURE_GRID) != 0 ? "#define NEBEL_VOXELS\n" : "",
                   (kind->features & NEBEL_FEATURE_DIFFUSION) != 0 ? "#define NEBEL_DIFFUSION\n" : "",
                   (kind->features & NEBEL_FEATURE_ENVIRONMENT) != 0 ? "#define NEBEL_ENVIRONMENT\n" : "",
                   nb_air_head(kind->air, air), kind->daylit ? "#define PASS_DAYLIGHT\n" : "",
                   kind->clouds ? "#define PASS_CLOUDS\n" : "", kind->shaded ? "#define PASS_SHADE\n" : "",
                   kind->multisampled ? samples : "", kind->step ? step : nb_program_output(kind->output),
                   kind->from_eye ? "#define NEBEL_FROM_EYE\n" : "", (int)kind->depth, (unsigned)kind->features,
                   kind->panorama ? "#define PASS_PANORAMA\n" : "");
}

/* A message is one line. */
static void flatten(char *text)
{
    for (; *text != '\0'; text++) {
        if (*text == '\n' || *text == '\r') *text = text[1] != '\0' ? ';' : '\0';
    }
}

static nebel_result refuse_program(const nebel_log *log, const char *what, char *words)
{
    flatten(words);
    return nb_fail(log, NEBEL_ERROR_UNSUPPORTED,
                   "OpenGL: the driver (%s, %s) does not %s; a newer driver may. It says: %s",
                   (const char *)glGetString(GL_RENDERER), (const char *)glGetString(GL_VERSION), what,
                   words[0] != '\0' ? words : "nothing");
}

static nebel_result compile(const nebel_log *log, unsigned kind, const nb_shader_parts *texts, unsigned *shader)
{
    GLint good = 0;
    *shader = glCreateShader(kind);
    glShaderSource(*shader, texts->count, texts->list, NULL);
    glCompileShader(*shader);
    glGetShaderiv(*shader, GL_COMPILE_STATUS, &good);
    if (good) return NEBEL_OK;
    char words[768] = "";
    glGetShaderInfoLog(*shader, sizeof words, NULL, words);
    glDeleteShader(*shader);
    *shader = 0;
    return refuse_program(
        log, kind == GL_VERTEX_SHADER ? "compile nebel's vertex shader" : "compile nebel's fragment shader", words);
}

static nebel_result link(const nebel_log *log, unsigned vertex, unsigned fragment, unsigned *name)
{
    GLint good = 0;
    *name = glCreateProgram();
    glAttachShader(*name, vertex);
    glAttachShader(*name, fragment);
    glLinkProgram(*name);
    glGetProgramiv(*name, GL_LINK_STATUS, &good);
    glDetachShader(*name, vertex);
    glDetachShader(*name, fragment);
    if (good) return NEBEL_OK;
    char words[768] = "";
    glGetProgramInfoLog(*name, sizeof words, NULL, words);
    glDeleteProgram(*name);
    *name = 0;
    return refuse_program(log, "link nebel's shaders", words);
}

nebel_result nb_program_build(const nebel_log *log, const nb_shader_parts *vertex, const nb_shader_parts *fragment,
                              unsigned *name)
{
    unsigned shaders[2] = {0, 0};
    *name = 0;
    nebel_result result = compile(log, GL_VERTEX_SHADER, vertex, &shaders[0]);
    if (result == NEBEL_OK) result = compile(log, GL_FRAGMENT_SHADER, fragment, &shaders[1]);
    if (result == NEBEL_OK) result = link(log, shaders[0], shaders[1], name);
    glDeleteShader(shaders[0]);
    glDeleteShader(shaders[1]);
    return result;
}

static void find_uniforms(nb_program *program)
{
    const unsigned name = program->name, block = glGetUniformBlockIndex(name, "nebel_fog_block");
    if (block != GL_INVALID_INDEX) glUniformBlockBinding(name, block, 0);
    program->rays = glGetUniformLocation(name, "nebel_rays");
    program->corner = glGetUniformLocation(name, "pass_corner");
    program->tiling = glGetUniformLocation(name, program->kind.panorama ? "face_tiling" : "pass_tiling");
    program->face_first = glGetUniformLocation(name, "face_first");
    program->sample_range = glGetUniformLocation(name, "pass_sample_range");
    program->sample_places = glGetUniformLocation(name, "pass_sample_places");
    glUseProgram(name);
    glUniform1i(glGetUniformLocation(name, "nebel_fog_texture"), NB_UNIT_FOG);
    glUniform1i(glGetUniformLocation(name, "nebel_tile_texture"), NB_UNIT_TILES);
    glUniform1i(glGetUniformLocation(name, "nebel_voxel_texture"), NB_UNIT_VOXELS);
    glUniform1i(glGetUniformLocation(name, "nebel_diffusion_texture"), NB_UNIT_NODES);
    glUniform1i(glGetUniformLocation(name, "nebel_environment_texture"), NB_UNIT_ENVIRONMENT);
    glUniform1i(glGetUniformLocation(name, "nebel_sky_view_texture"), NB_UNIT_AIR);
    glUniform1i(glGetUniformLocation(name, "pass_depth"), NB_UNIT_DEPTH);
    glUniform1i(glGetUniformLocation(name, program->kind.step ? "pass_progress" : "pass_color"), NB_UNIT_COLOR);
}

/* The fog's text has its own. */
static const char precision_text[] = "#ifdef GL_ES\nprecision highp float;\nprecision highp int;\n#endif\n";

static nebel_result make_fog_program(const nb_context *context, const nebel_log *log, const nb_program_kind *kind,
                                     nb_program *program)
{
    char head[1024];
    write_fog_head(context, kind, head, sizeof head);
    const char *const fog = nebel_get_shader_source(context->es ? NEBEL_DIALECT_GLSL_300_ES : NEBEL_DIALECT_GLSL_330);
    const nb_shader_parts vertex = {{nb_program_version(context), vertex_text}, 2};
    const char *const ray = kind->panorama ? nb_panorama_ray_text : "";
    const char *const tile = kind->panorama && kind->tiled ? nb_panorama_tile_text : "";
    const int is_shaded = kind->shade[0] != NULL;
    const nb_shader_parts fragment = {{head, is_shaded ? precision_text : "", is_shaded ? kind->shade[0] : "",
                                       is_shaded ? kind->shade[1] : "", kind->shafts ? nb_shaft_text : "",
                                       kind->air ? nb_air_words_text : "", fog, ray, tile,
                                       kind->air ? nb_air_planets_text : "", kind->daylit ? nb_air_places_text : "",
                                       kind->clouds ? nb_cloud_shade_text : "", kind->shaded ? nb_fog_shadow_text : "",
                                       kind->air ? nb_air_pieces_text : "", kind->air ? nb_air_aerial_text : "",
                                       fog_fragment_text, kind->step ? nb_step_text : whole_text},
                                      17};
    *program = (nb_program){.kind = *kind};
    const nebel_result result = nb_program_build(log, &vertex, &fragment, &program->name);
    if (result == NEBEL_OK) find_uniforms(program);
    return result;
}

static int is_same_program(const nb_program_kind *a, const nb_program_kind *b)
{
    return a->in_texture == b->in_texture && a->tiled == b->tiled && a->multisampled == b->multisampled &&
           a->output == b->output && a->depth == b->depth && a->from_eye == b->from_eye && a->panorama == b->panorama &&
           a->shafts == b->shafts && a->air == b->air && a->daylit == b->daylit && a->clouds == b->clouds &&
           a->shaded == b->shaded && a->step == b->step && a->features == b->features && a->shade[0] == b->shade[0] &&
           a->shade[1] == b->shade[1];
}

nebel_result nb_programs_find(nb_programs *programs, const nb_context *context, const nebel_allocator *allocator,
                              const nebel_log *log, const nb_program_kind *kind, const nb_program **program)
{
    for (size_t i = 0; i < programs->count; i++) {
        *program = &programs->list[i];
        if (is_same_program(&programs->list[i].kind, kind)) return NEBEL_OK;
    }
    void *list = programs->list;
    if (!nb_grow(allocator, &list, sizeof *programs->list, programs->count, &programs->capacity, programs->count + 1)) {
        return nb_fail(log, NEBEL_ERROR_MEMORY, "nebel_gl_draw_fog: out of memory");
    }
    programs->list = list;
    nb_program *const made = &programs->list[programs->count];
    const nebel_result result = make_fog_program(context, log, kind, made);
    if (result == NEBEL_OK) programs->count++;
    *program = made;
    return result;
}

void nb_programs_delete(const nb_programs *programs)
{
    for (size_t i = 0; i < programs->count; i++) glDeleteProgram(programs->list[i].name);
}
