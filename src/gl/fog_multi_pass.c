#include "fog_multi_pass.h"

#include "gl_state.h"

enum { LAYERS = 4, MOST_STEPS = 256, BAND_PIXELS = 1 << 18 };

const char nb_step_text[] =
    "uniform highp sampler2DArray pass_progress;\n"
    "uniform ivec2 pass_band;\n"
    "uniform bool pass_is_last;\n"
    "layout(location = 0) out highp vec4 pass_word_0;\n"
    "layout(location = 1) out highp vec4 pass_word_1;\n"
    "layout(location = 2) out highp vec4 pass_word_2;\n"
    "layout(location = 3) out highp vec4 pass_word_3;\n"
    "\n"
    "nb_progress_words pass_resume(nb_progress_words words, nebel_view_ray sight, int entry)\n"
    "{\n"
    "#ifdef NEBEL_TILES\n"
    "    nb_media media = nb_media_of(NEBEL_TILE_ENTRY(entry), NEBEL_TILE_ENTRY(entry + 1), true);\n"
    "#else\n"
    "    nb_media media = nb_media_of(0, int(NEBEL_FOG_TEXEL(0).x), false);\n"
    "#endif\n"
    "    return nb_resume(words, sight.origin, sight.direction, sight.t_max, media, pass_is_last);\n"
    "}\n"
    "\n"
    "void main()\n"
    "{\n"
    "    ivec2 place = ivec2(gl_FragCoord.xy), texel = place + pass_band;\n"
    "    vec2 pixel = vec2(texel - pass_corner) + 0.5;\n"
    "    nb_progress_words words;\n"
    "    words.word[0] = texelFetch(pass_progress, ivec3(place, 0), 0);\n"
    "    words.word[1] = texelFetch(pass_progress, ivec3(place, 1), 0);\n"
    "    words.word[2] = texelFetch(pass_progress, ivec3(place, 2), 0);\n"
    "    words.word[3] = texelFetch(pass_progress, ivec3(place, 3), 0);\n"
    "    if (!nb_is_done(words)) {\n"
    "        nebel_view_ray sight = pass_sight(pixel, texelFetch(pass_depth, texel, 0).x);\n"
    "        words = pass_resume(words, sight, pass_entry(sight, pixel));\n"
    "    }\n"
    "    pass_word_0 = words.word[0];\n"
    "    pass_word_1 = words.word[1];\n"
    "    pass_word_2 = words.word[2];\n"
    "    pass_word_3 = words.word[3];\n"
    "}\n";

/* Pixels that are not done are left: 3 is NB_STAGE_DONE. What is written does not count. */
static const char count_text[] = "precision highp float;\n"
                                 "uniform highp sampler2DArray pass_progress;\n"
                                 "void main()\n"
                                 "{\n"
                                 "    if (texelFetch(pass_progress, ivec3(gl_FragCoord.xy, 1), 0).w > 2.5) discard;\n"
                                 "}\n";

static const char compose_text[] = "precision highp float;\n"
                                   "uniform highp sampler2DArray pass_progress;\n"
                                   "uniform highp sampler2D pass_color;\n"
                                   "uniform ivec2 pass_band;\n"
                                   "layout(location = 0 PASS_FIRST) out highp vec4 pass_first;\n"
                                   "#ifdef PASS_SECOND\n"
                                   "layout(location = PASS_SECOND) out highp vec4 pass_second;\n"
                                   "#endif\n"
                                   "void main()\n"
                                   "{\n"
                                   "    ivec2 texel = ivec2(gl_FragCoord.xy), place = texel - pass_band;\n"
                                   "    vec3 in_scattering = texelFetch(pass_progress, ivec3(place, 0), 0).xyz;\n"
                                   "    vec3 transmittance = texelFetch(pass_progress, ivec3(place, 1), 0).xyz;\n"
                                   "#ifdef PASS_COMPOSE\n"
                                   "    vec4 color = texelFetch(pass_color, texel, 0);\n"
                                   "    pass_first = vec4(transmittance * color.rgb + in_scattering, color.a);\n"
                                   "#elif defined(PASS_SECOND)\n"
                                   "    pass_first = vec4(in_scattering, 1.0);\n"
                                   "    pass_second = vec4(transmittance, 1.0);\n"
                                   "#else\n"
                                   "    pass_first = vec4(in_scattering, dot(transmittance, vec3(1.0 / 3.0)));\n"
                                   "#endif\n"
                                   "}\n";

/* ---- making ---------------------------------------------------------------------------------- */

uint32_t nb_fog_passes_rows(uint32_t width, uint32_t height)
{
    const uint32_t rows = width < BAND_PIXELS ? BAND_PIXELS / width : 1;
    return rows < height ? rows : height;
}

static nebel_result build(const nb_context *context, const nebel_log *log, const char *extension, const char *output,
                          const char *text, int unit, unsigned *name)
{
    if (*name != 0) return NEBEL_OK;
    const nb_shader_parts vertex = {{nb_program_version(context), nb_triangle_text}, 2};
    const nb_shader_parts fragment = {{nb_program_version(context), extension, output, text}, 4};
    const nebel_result result = nb_program_build(log, &vertex, &fragment, name);
    if (result != NEBEL_OK) return result;
    glUseProgram(*name);
    glUniform1i(glGetUniformLocation(*name, "pass_progress"), unit);
    glUniform1i(glGetUniformLocation(*name, "pass_color"), NB_UNIT_COLOR);
    return NEBEL_OK;
}

static nebel_result build_programs(nb_fog_passes *s, const nb_context *context, const nebel_log *log,
                                   nebel_gl_output output)
{
    const nebel_result result = build(context, log, "", "", count_text, NB_UNIT_COLOR, &s->count_program);
    if (result != NEBEL_OK) return result;
    return build(context, log, nb_program_extension(context, output), nb_program_output(output), compose_text,
                 NB_UNIT_DEPTH, &s->compose_programs[output]);
}

static void delete_progress(nb_fog_passes *s)
{
    glDeleteTextures(2, s->progress);
    glDeleteFramebuffers(2, s->framebuffers);
    s->progress[0] = s->progress[1] = s->framebuffers[0] = s->framebuffers[1] = 0;
    s->width = s->height = 0;
}

static int make_progress_framebuffer(nb_fog_passes *s, int i)
{
    GLenum buffers[LAYERS];
    glGenFramebuffers(1, &s->framebuffers[i]);
    glBindFramebuffer(GL_DRAW_FRAMEBUFFER, s->framebuffers[i]);
    for (int k = 0; k < LAYERS; k++) {
        buffers[k] = (GLenum)(GL_COLOR_ATTACHMENT0 + k);
        glFramebufferTextureLayer(GL_DRAW_FRAMEBUFFER, buffers[k], s->progress[i], 0, k);
    }
    glDrawBuffers(LAYERS, buffers);
    return glCheckFramebufferStatus(GL_DRAW_FRAMEBUFFER) == GL_FRAMEBUFFER_COMPLETE;
}

static void make_progress_texture(nb_fog_passes *s, int i)
{
    glGenTextures(1, &s->progress[i]);
    glBindTexture(GL_TEXTURE_2D_ARRAY, s->progress[i]);
    glTexParameteri(GL_TEXTURE_2D_ARRAY, GL_TEXTURE_MIN_FILTER, GL_NEAREST);
    glTexParameteri(GL_TEXTURE_2D_ARRAY, GL_TEXTURE_MAG_FILTER, GL_NEAREST);
    glTexParameteri(GL_TEXTURE_2D_ARRAY, GL_TEXTURE_MAX_LEVEL, 0);
    glTexImage3D(GL_TEXTURE_2D_ARRAY, 0, GL_RGBA32F, (GLsizei)s->width, (GLsizei)s->height, LAYERS, 0, GL_RGBA,
                 GL_FLOAT, NULL);
}

static nebel_result make_progress(nb_fog_passes *s, const nebel_log *log)
{
    int complete = 1;
    for (int i = 0; i < 2; i++) make_progress_texture(s, i);
    nebel_result result = nb_context_check_memory(log, "the progress of rays; ask for fewer pixels");
    for (int i = 0; i < 2 && result == NEBEL_OK; i++) complete = make_progress_framebuffer(s, i) && complete;
    if (result == NEBEL_OK && !complete) {
        result = nb_fail(log, NEBEL_ERROR_UNSUPPORTED,
                         "OpenGL: the driver (%s) does not draw into layers of floats of 32 bits; update it, or take "
                         "the CPU renderer",
                         (const char *)glGetString(GL_RENDERER));
    }
    if (result != NEBEL_OK) delete_progress(s);
    return result;
}

nebel_result nb_fog_passes_fit(nb_fog_passes *steps, const nb_context *context, const nebel_log *log,
                               nebel_gl_output output, uint32_t width, uint32_t height)
{
    if (steps->query == 0) glGenQueries(1, &steps->query);
    const nebel_result result = build_programs(steps, context, log, output);
    if (result != NEBEL_OK || (width <= steps->width && height <= steps->height)) return result;
    const uint32_t wide = steps->width > width ? steps->width : width;
    delete_progress(steps);
    steps->width = wide;
    steps->height = height;
    return make_progress(steps, log);
}

void nb_fog_passes_delete(nb_fog_passes *steps)
{
    delete_progress(steps);
    glDeleteQueries(1, &steps->query);
    glDeleteProgram(steps->count_program);
    for (int i = 0; i < NEBEL_GL_OUTPUT_COUNT; i++) glDeleteProgram(steps->compose_programs[i]);
    *steps = (nb_fog_passes){0};
}

/* ---- drawing --------------------------------------------------------------------------------- */

static void bind_progress(GLuint unit, unsigned texture)
{
    glActiveTexture(GL_TEXTURE0 + unit);
    glBindTexture(GL_TEXTURE_2D_ARRAY, texture);
}

/* From the progress `source` to the other one, which is returned. */
static int draw_step(const nb_fog_passes *s, unsigned program, int source)
{
    glUseProgram(program);
    bind_progress(NB_UNIT_COLOR, s->progress[source]);
    glBindFramebuffer(GL_DRAW_FRAMEBUFFER, s->framebuffers[1 - source]);
    glDrawArrays(GL_TRIANGLES, 0, 3);
    return 1 - source;
}

/* A query of the host's that is under way, of whatever kind of occlusion, leaves no room for another. */
static int can_count(const nb_context *context)
{
    const int has_conservative = context->es || context->version >= 43;
    GLint any = 0, conservative = 0, samples = 0;
    glGetQueryiv(GL_ANY_SAMPLES_PASSED, GL_CURRENT_QUERY, &any);
    if (has_conservative) glGetQueryiv(GL_ANY_SAMPLES_PASSED_CONSERVATIVE, GL_CURRENT_QUERY, &conservative);
    if (!context->es) glGetQueryiv(GL_SAMPLES_PASSED, GL_CURRENT_QUERY, &samples);
    return any == 0 && conservative == 0 && samples == 0;
}

/* Draws into the other progress, which the next step writes anew. */
static int is_any_left(const nb_fog_passes *s, int source)
{
    GLuint left = 0;
    glBeginQuery(GL_ANY_SAMPLES_PASSED, s->query);
    (void)draw_step(s, s->count_program, source);
    glEndQuery(GL_ANY_SAMPLES_PASSED);
    glGetQueryObjectuiv(s->query, GL_QUERY_RESULT, &left);
    return left != 0;
}

int nb_fog_passes_trace(const nb_fog_passes *s, const nb_context *context, unsigned program, const nb_pass_band *band)
{
    static const GLfloat zeros[4] = {0, 0, 0, 0};
    const GLint is_last = glGetUniformLocation(program, "pass_is_last");
    const int counts = can_count(context);
    int source = 0, left = 1;
    nb_state_clear(context, 0, 0, band->width, band->height);
    glUniform2i(glGetUniformLocation(program, "pass_band"), (GLint)band->x, (GLint)band->y);
    glUniform1i(is_last, 0);
    glBindFramebuffer(GL_DRAW_FRAMEBUFFER, s->framebuffers[0]);
    for (GLint i = 0; i < LAYERS; i++) glClearBufferfv(GL_COLOR, i, zeros);
    for (int i = 0; i < MOST_STEPS && left; i++) {
        source = draw_step(s, program, source);
        if (counts) left = is_any_left(s, source);
    }
    glUseProgram(program);
    glUniform1i(is_last, 1);
    if (left) source = draw_step(s, program, source);
    bind_progress(NB_UNIT_DEPTH, s->progress[source]);
    return counts && left;
}

void nb_fog_passes_compose(const nb_fog_passes *s, nebel_gl_output output, const nb_pass_band *band)
{
    const unsigned program = s->compose_programs[output];
    glUseProgram(program);
    glUniform2i(glGetUniformLocation(program, "pass_band"), (GLint)band->x, (GLint)band->y);
    glDrawArrays(GL_TRIANGLES, 0, 3);
}
