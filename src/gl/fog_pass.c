/* Fog over the host's picture: checks, state, one triangle. */
#include "gl_planets.h"
#include "gl_cloud_shadow.h"
#include "fog_context.h"
#include "shaft_maps.h"
#include "gl_state.h"

typedef struct pass_size {
    GLint width, height, samples;
} pass_size;

/* The host's state is saved around this. */
typedef struct nb_pass_task {
    nebel_gl *gl;
    const nebel_gl_pass *pass;
    const nb_fog_pass_input *picture;
    const nb_program *program;
} nb_pass_task;

static nebel_result fail_pass(const nebel_gl *gl, nebel_result result, const char *what)
{
    return nb_fail(&gl->log, result, "nebel_gl_draw_fog: %s", what);
}

/* ---- what the host gave ---------------------------------------------------------------------- */

static int is_by_sample(const nebel_gl_pass *pass)
{
    return pass->samples > 1 && (pass->output == NEBEL_GL_OUTPUT_BLEND || pass->output == NEBEL_GL_OUTPUT_BLEND_GRAY);
}

static nebel_result check_pass_samples(const nebel_gl *gl, const nebel_gl_pass *pass)
{
    if (pass->samples <= 1) return NEBEL_OK;
    if (gl->context.es) {
        return fail_pass(
            gl, NEBEL_ERROR_UNSUPPORTED,
            "OpenGL ES 3.0 has no multisampled textures; resolve color and depth first (glBlitFramebuffer), "
            "and set samples to 0");
    }
    if (pass->samples > NB_MAX_PASS_SAMPLES) return fail_pass(gl, NEBEL_ERROR_LIMIT, "more than 32 samples");
    return NEBEL_OK;
}

/* What is blended sample by sample needs a target that has them. */
static nebel_result check_target_samples(const nebel_gl *gl, const nebel_gl_pass *pass)
{
    GLint samples = 0;
    if (!is_by_sample(pass)) return NEBEL_OK;
    glGetIntegerv(GL_SAMPLES, &samples);
    if ((uint32_t)samples == pass->samples) return NEBEL_OK;
    return nb_fail(&gl->log, NEBEL_ERROR_ARGUMENT,
                   "nebel_gl_draw_fog: the target has %d samples, not %u: what %u samples see cannot be blended over a "
                   "color that has been resolved without leaving outlines; draw into the multisampled target and "
                   "resolve it afterwards, or use NEBEL_GL_OUTPUT_COMPOSE with the multisampled color texture",
                   (int)samples, (unsigned)pass->samples, (unsigned)pass->samples);
}

static nebel_result check_output(const nebel_gl *gl, const nebel_gl_pass *pass)
{
    if ((unsigned)pass->output >= NEBEL_GL_OUTPUT_COUNT)
        return fail_pass(gl, NEBEL_ERROR_ARGUMENT, "there is no such output");
    if (pass->output == NEBEL_GL_OUTPUT_BLEND && !gl->context.dual_source) {
        return fail_pass(gl, NEBEL_ERROR_UNSUPPORTED,
                         "this context cannot blend each color by its own transmittance (GL_EXT_blend_func_extended is "
                         "missing); use "
                         "NEBEL_GL_OUTPUT_COMPOSE, or NEBEL_GL_OUTPUT_BLEND_GRAY where fog takes all colors alike");
    }
    return check_pass_samples(gl, pass);
}

/* With the texture bound to the active unit. OpenGL ES 3.0 does not tell sizes. */
static nebel_result check_target_size(const nb_pass_task *t, GLenum target, const char *name)
{
    const nebel_gl *const gl = t->gl;
    const nebel_gl_pass *const pass = t->pass;
    pass_size s = {0, 0, 0};
    if (!gl->context.tells_sizes) return NEBEL_OK;
    glGetTexLevelParameteriv(target, 0, GL_TEXTURE_WIDTH, &s.width);
    glGetTexLevelParameteriv(target, 0, GL_TEXTURE_HEIGHT, &s.height);
    if (target == GL_TEXTURE_2D_MULTISAMPLE) glGetTexLevelParameteriv(target, 0, GL_TEXTURE_SAMPLES, &s.samples);
    if (s.width == 0) {
        (void)glGetError(); /* of a texture of another kind, which could not be bound */
        return nb_fail(&gl->log, NEBEL_ERROR_ARGUMENT,
                       "nebel_gl_draw_fog: the %s texture has no pixels, or is none of %s, as %u samples ask for", name,
                       target == GL_TEXTURE_2D ? "GL_TEXTURE_2D" : "GL_TEXTURE_2D_MULTISAMPLE",
                       (unsigned)pass->samples);
    }
    const uint64_t right = (uint64_t)pass->x + t->picture->width, top = (uint64_t)pass->y + t->picture->height;
    if ((uint64_t)s.width < right || (uint64_t)s.height < top) {
        return nb_fail(&gl->log, NEBEL_ERROR_ARGUMENT,
                       "nebel_gl_draw_fog: the picture reaches to %llu, %llu, the %s texture is only %d x %d",
                       (unsigned long long)right, (unsigned long long)top, name, (int)s.width, (int)s.height);
    }
    if (target == GL_TEXTURE_2D_MULTISAMPLE && (uint32_t)s.samples != pass->samples) {
        return nb_fail(&gl->log, NEBEL_ERROR_ARGUMENT, "nebel_gl_draw_fog: the %s texture has %d samples, not %u", name,
                       (int)s.samples, (unsigned)pass->samples);
    }
    return NEBEL_OK;
}

static nebel_result check_texture(const nebel_gl *gl, unsigned texture, const char *name)
{
    if (glIsTexture(texture)) return NEBEL_OK;
    return nb_fail(&gl->log, NEBEL_ERROR_ARGUMENT, "nebel_gl_draw_fog: %s_texture %u is no texture of this context",
                   name, texture);
}

static GLint draw_buffer(int i)
{
    GLint buffer = GL_NONE;
    glGetIntegerv((GLenum)(GL_DRAW_BUFFER0 + i), &buffer);
    return buffer;
}

/* Draw buffers that no output of the shader goes to would be filled with anything. */
static nebel_result check_draw_buffers(const nebel_gl *gl, const nebel_gl_pass *pass)
{
    const int wanted = pass->output == NEBEL_GL_OUTPUT_SPLIT ? 2 : 1;
    GLint most = 0;
    glGetIntegerv(GL_MAX_DRAW_BUFFERS, &most);
    for (int i = 0; i < most; i++) {
        if ((draw_buffer(i) != GL_NONE) != (i < wanted)) {
            return nb_fail(&gl->log, NEBEL_ERROR_ARGUMENT,
                           "nebel_gl_draw_fog: draw buffer %d is%s GL_NONE, this output writes %d draw buffer%s; see "
                           "glDrawBuffers",
                           i, i < wanted ? "" : " not", wanted, wanted == 1 ? "" : "s");
        }
    }
    return NEBEL_OK;
}

static nebel_result check_feedback(const nebel_gl *gl, const nebel_gl_pass *pass)
{
    GLint type = GL_NONE, name = 0;
    const GLint buffer = draw_buffer(0);
    if (pass->output != NEBEL_GL_OUTPUT_COMPOSE || buffer < GL_COLOR_ATTACHMENT0) return NEBEL_OK;
    glGetFramebufferAttachmentParameteriv(GL_DRAW_FRAMEBUFFER, (GLenum)buffer, GL_FRAMEBUFFER_ATTACHMENT_OBJECT_TYPE,
                                          &type);
    if (type != GL_TEXTURE) return NEBEL_OK;
    glGetFramebufferAttachmentParameteriv(GL_DRAW_FRAMEBUFFER, (GLenum)buffer, GL_FRAMEBUFFER_ATTACHMENT_OBJECT_NAME,
                                          &name);
    if ((unsigned)name != pass->color_texture) return NEBEL_OK;
    return fail_pass(gl, NEBEL_ERROR_ARGUMENT,
                     "the color texture is the target, too; draw into another texture, or use NEBEL_GL_OUTPUT_BLEND");
}

static nebel_result check_framebuffer(const nebel_gl *gl, const nebel_gl_pass *pass)
{
    const GLenum status = glCheckFramebufferStatus(GL_DRAW_FRAMEBUFFER);
    if (status != GL_FRAMEBUFFER_COMPLETE) {
        return nb_fail(&gl->log, NEBEL_ERROR_ARGUMENT,
                       "nebel_gl_draw_fog: the draw framebuffer is not complete (status 0x%x); bind the target first",
                       status);
    }
    nebel_result result = check_target_samples(gl, pass);
    if (result == NEBEL_OK) result = check_draw_buffers(gl, pass);
    return result == NEBEL_OK ? check_feedback(gl, pass) : result;
}

static nebel_result check_pass(const nebel_gl *gl, const nebel_gl_pass *pass)
{
    nebel_result result = check_output(gl, pass);
    if (result == NEBEL_OK) result = check_texture(gl, pass->depth_texture, "depth");
    if (result == NEBEL_OK && pass->output == NEBEL_GL_OUTPUT_COMPOSE) {
        result = check_texture(gl, pass->color_texture, "color");
    }
    return result == NEBEL_OK ? check_framebuffer(gl, pass) : result;
}

/* ---- drawing --------------------------------------------------------------------------------- */

static void bind_texture(const nebel_gl *gl, GLuint unit, GLenum target, unsigned texture)
{
    glActiveTexture(GL_TEXTURE0 + unit);
    glBindTexture(target, texture);
    glBindSampler(unit, gl->sampler);
}

/* What cannot be bound leaves nothing, not what another has bound there. */
static void bind_host_texture(const nebel_gl *gl, GLuint unit, GLenum target, unsigned texture)
{
    bind_texture(gl, unit, target, 0);
    glBindTexture(target, texture);
}

static nebel_result bind_textures(const nb_pass_task *t)
{
    const nebel_gl *const gl = t->gl;
    const GLenum target = t->pass->samples > 1 ? GL_TEXTURE_2D_MULTISAMPLE : GL_TEXTURE_2D;
    if (gl->fog.texture != 0) bind_texture(gl, NB_UNIT_FOG, GL_TEXTURE_2D, gl->fog.texture);
    if (gl->fog.block != 0) glBindBufferBase(GL_UNIFORM_BUFFER, 0, gl->fog.block);
    if (gl->fog.voxels != 0) bind_texture(gl, NB_UNIT_VOXELS, GL_TEXTURE_2D, gl->fog.voxels);
    if (gl->fog.diffusion != 0) bind_texture(gl, NB_UNIT_NODES, GL_TEXTURE_2D, gl->fog.diffusion);
    if (gl->fog.environment != 0) bind_texture(gl, NB_UNIT_ENVIRONMENT, GL_TEXTURE_2D, gl->fog.environment);
    if (gl->fog.tiles != 0) bind_texture(gl, NB_UNIT_TILES, GL_TEXTURE_2D, gl->fog.tiles);
    bind_host_texture(gl, NB_UNIT_DEPTH, target, t->pass->depth_texture);
    const nebel_result result = check_target_size(t, target, "depth");
    if (result != NEBEL_OK || t->pass->output != NEBEL_GL_OUTPUT_COMPOSE) return result;
    bind_host_texture(gl, NB_UNIT_COLOR, target, t->pass->color_texture);
    return check_target_size(t, target, "color");
}

/* A framebuffer of nothing, which older OpenGL finds complete only where no buffer is drawn to or read. */
static void make_empty_framebuffer(nebel_gl *gl)
{
    GLint reading = 0;
    glGetIntegerv(GL_READ_FRAMEBUFFER_BINDING, &reading);
    glGenFramebuffers(1, &gl->framebuffer);
    glBindFramebuffer(GL_FRAMEBUFFER, gl->framebuffer);
    glDrawBuffer(GL_NONE);
    glReadBuffer(GL_NONE);
    glBindFramebuffer(GL_READ_FRAMEBUFFER, (GLuint)reading);
}

/* Where in a pixel the samples of the depth texture are. Only the draw framebuffer can be asked. */
static void read_places(nebel_gl *gl, const nebel_gl_pass *pass, GLfloat places[NB_MAX_PASS_SAMPLES][2])
{
    const GLenum attachments[] = {GL_DEPTH_ATTACHMENT, GL_COLOR_ATTACHMENT0};
    int known = 0;
    if (gl->framebuffer == 0) make_empty_framebuffer(gl);
    glBindFramebuffer(GL_DRAW_FRAMEBUFFER, gl->framebuffer);
    for (int kind = 0; kind < 2 && !known; kind++) {
        glFramebufferTexture(GL_DRAW_FRAMEBUFFER, attachments[kind], pass->depth_texture, 0);
        known = glCheckFramebufferStatus(GL_DRAW_FRAMEBUFFER) == GL_FRAMEBUFFER_COMPLETE;
        for (GLuint i = 0; i < pass->samples && known; i++) glGetMultisamplefv(GL_SAMPLE_POSITION, i, places[i]);
        glFramebufferTexture(GL_DRAW_FRAMEBUFFER, attachments[kind], 0, 0);
    }
    for (GLuint i = 0; i < pass->samples && !known; i++) places[i][0] = places[i][1] = .5f;
}

static void set_samples(const nb_pass_task *t, GLuint target_framebuffer)
{
    GLfloat places[NB_MAX_PASS_SAMPLES][2] = {{0}};
    read_places(t->gl, t->pass, places);
    glBindFramebuffer(GL_DRAW_FRAMEBUFFER, target_framebuffer);
    glUniform2i(t->program->sample_range, 0, (GLint)t->pass->samples);
    glUniform2fv(t->program->sample_places, (GLsizei)t->pass->samples, places[0]);
}

static void set_tiling(const nb_pass_task *t)
{
    const nebel_gl *const gl = t->gl;
    const GLint columns = (GLint)gl->fog.tile_columns;
    if (!t->picture->panorama) {
        glUniform2i(t->program->tiling, NB_GL_TILE_SHIFT, columns);
    } else {
        glUniform3i(t->program->tiling, (GLint)gl->views[0].width, NB_GL_TILE_SHIFT, columns);
        glUniform1iv(t->program->face_first, 6, gl->face_first);
    }
}

/* Fog, by clouds and by its place. */
static int is_shaded(const nb_fog_pass_input *picture)
{
    return picture->cloud_shade != NULL && picture->cloud_shade->clear_sky > 0;
}

static void set_pass_uniforms(const nb_pass_task *t, GLuint target_framebuffer)
{
    const nb_program *const p = t->program;
    glUniform4fv(p->rays, NEBEL_RAY_TEXELS, t->picture->rays.texels[0].v);
    glUniform2i(p->corner, (GLint)t->pass->x, (GLint)t->pass->y);
    if (t->gl->fog.tiles != 0) set_tiling(t);
    if (t->pass->samples > 1) set_samples(t, target_framebuffer);
    if (t->picture->shade.set != NULL) t->picture->shade.set(t->picture->shade.of, p->name);
    if (t->picture->air != NULL) nb_gl_planets_set_list(t->picture->air, p->name);
    if (t->picture->daylight != NULL)
        nb_gl_planets_set_irradiance(t->picture->air, p->name, t->picture->daylight, t->picture->even_shade);
    if (is_shaded(t->picture)) nb_gl_planets_set_reach(t->picture->air, p->name);
    if (t->picture->cloud_shade != NULL) {
        nb_gl_cloud_shade_set(t->picture->cloud_shade, p->name);
        glUniform1i(glGetUniformLocation(p->name, "pass_is_turned"), t->picture->is_turned);
    }
    if (t->picture->shafts != NULL) nb_shaft_maps_set(t->picture->shafts, p->name);
}

static void draw_triangles(const nb_pass_task *t)
{
    const uint32_t turns = is_by_sample(t->pass) ? t->pass->samples : 1;
    for (uint32_t i = 0; i < turns; i++) {
        if (is_by_sample(t->pass)) {
            nb_state_choose_sample(i);
            glUniform2i(t->program->sample_range, (GLint)i, (GLint)i + 1);
        }
        glDrawArrays(GL_TRIANGLES, 0, 3);
    }
}

/* What is drawn next goes there. */
static void set_target(const nb_pass_task *t, const nb_pass_band *band)
{
    const nb_context *const context = &t->gl->context;
    nb_state_clear(context, band->x, band->y, band->width, band->height);
    if (t->pass->output == NEBEL_GL_OUTPUT_BLEND) nb_state_blend(context, GL_ONE, GL_SRC1_COLOR);
    if (t->pass->output == NEBEL_GL_OUTPUT_BLEND_GRAY) nb_state_blend(context, GL_ONE, GL_SRC_ALPHA);
}

static nebel_result draw(const nb_pass_task *t, GLuint target_framebuffer)
{
    const nebel_result result = bind_textures(t);
    if (result != NEBEL_OK) return result;
    set_target(t, &(nb_pass_band){t->pass->x, t->pass->y, t->picture->width, t->picture->height});
    glUseProgram(t->program->name);
    glBindVertexArray(t->gl->vertex_array);
    set_pass_uniforms(t, target_framebuffer);
    draw_triangles(t);
    return NEBEL_OK;
}

/* ---- in steps -------------------------------------------------------------------------------- */

/* Samples of a pixel, and pieces of air, share its turns. */
static int is_in_steps(const nb_pass_task *t)
{
    return t->gl->may_tire && t->pass->samples <= 1 && t->picture->air == NULL;
}

void nb_gl_warn_of_turns(nebel_gl *gl, const char *why)
{
    if (gl->has_warned) return;
    gl->has_warned = 1;
    nb_log_message(
        &gl->log, NEBEL_LOG_WARNING, NEBEL_OK,
        "nebel_gl_draw_fog: this driver (%s) ends long loops, and %s: light of what is far behind "
        "others on a ray of up to %u volumes may be summed in coarse steps, in each of which they count as "
        "evenly mixed, and that of point lights left out there. A graphics processor or the CPU renderer has no "
        "such bound",
        (const char *)glGetString(GL_RENDERER), why,
        (unsigned)(gl->fog.tiles != 0 ? gl->fog.max_tile_volumes : nb_gl_count_volumes(gl->packed)));
}

/* Units that have textures of several layers while steps are drawn. */
static const GLenum layered[] = {GL_TEXTURE0 + NB_UNIT_COLOR, GL_TEXTURE0 + NB_UNIT_DEPTH};

static nebel_result fit_steps(const nb_pass_task *t, uint32_t rows)
{
    nebel_gl *const gl = t->gl;
    nb_unpacking unpacking;
    nb_state_save_unpacking(&gl->context, &unpacking);
    glActiveTexture(layered[0]);
    const nebel_result result =
        nb_fog_passes_fit(&gl->steps, &gl->context, &gl->log, t->pass->output, t->picture->width, rows);
    nb_state_restore_unpacking(&gl->context, &unpacking);
    return result;
}

static nebel_result draw_bands(const nb_pass_task *t, GLuint target_framebuffer)
{
    nebel_gl *const gl = t->gl;
    const uint32_t height = t->picture->height, rows = nb_fog_passes_rows(t->picture->width, height);
    int is_cut = 0;
    nebel_result result = fit_steps(t, rows);
    if (result == NEBEL_OK) result = bind_textures(t);
    glBindVertexArray(gl->vertex_array);
    for (uint32_t y = 0; y < height && result == NEBEL_OK; y += rows) {
        const nb_pass_band band = {t->pass->x, t->pass->y + y, t->picture->width,
                                   height - y < rows ? height - y : rows};
        glUseProgram(t->program->name);
        set_pass_uniforms(t, target_framebuffer);
        if (nb_fog_passes_trace(&gl->steps, &gl->context, t->program->name, &band)) is_cut = 1;
        glBindFramebuffer(GL_DRAW_FRAMEBUFFER, target_framebuffer);
        set_target(t, &band);
        nb_fog_passes_compose(&gl->steps, t->pass->output, &band);
    }
    if (is_cut) nb_gl_warn_of_turns(gl, "all passes together did not suffice");
    return result;
}

static nebel_result draw_in_steps(const nb_pass_task *t, GLuint target_framebuffer)
{
    GLint bound[2];
    for (int i = 0; i < 2; i++) {
        glActiveTexture(layered[i]);
        glGetIntegerv(GL_TEXTURE_BINDING_2D_ARRAY, &bound[i]);
    }
    const nebel_result result = draw_bands(t, target_framebuffer);
    for (int i = 0; i < 2; i++) {
        glActiveTexture(layered[i]);
        glBindTexture(GL_TEXTURE_2D_ARRAY, (GLuint)bound[i]);
    }
    return result;
}

static nebel_result draw_with_program(nb_pass_task *t, GLuint target_framebuffer)
{
    nebel_gl *const gl = t->gl;
    const int in_steps = is_in_steps(t);
    const nb_program_kind kind = {.in_texture = gl->fog.texture != 0,
                                  .tiled = gl->fog.tiles != 0,
                                  .multisampled = t->pass->samples > 1,
                                  .output = in_steps ? NEBEL_GL_OUTPUT_SPLIT : t->pass->output,
                                  .depth = t->pass->depth.encoding,
                                  .from_eye = t->picture->rays.from_eye,
                                  .panorama = t->picture->panorama,
                                  .shafts = t->picture->shafts != NULL,
                                  .step = in_steps,
                                  .air = t->picture->air != NULL ? t->picture->air->count : 0,
                                  .daylit = t->picture->daylight != NULL,
                                  .clouds = t->picture->cloud_shade != NULL,
                                  .shaded = is_shaded(t->picture),
                                  .features = gl->fog.features,
                                  .shade = {t->picture->shade.texts[0], t->picture->shade.texts[1]}};
    const nebel_result result =
        nb_programs_find(&gl->programs, &gl->context, &gl->allocator, &gl->log, &kind, &t->program);
    if (result != NEBEL_OK) return result;
    if (in_steps) return draw_in_steps(t, target_framebuffer);
    if (gl->overlaps_much)
        nb_gl_warn_of_turns(gl, "several samples of a pixel, or pieces of air, share what it gives to a ray");
    return draw(t, target_framebuffer);
}

/* Says which field of a convention that nebel_compute_view_rays refuses is the first that it refuses by itself. */
static const char *find_depth_fault(const nebel_view *view, const nebel_depth_desc *depth)
{
    const struct {
        nebel_depth_desc alone;
        const char *fault;
    } fields[] = {
        {{.range = {depth->range[0], depth->range[1]}},
         "depth.range must be two different finite numbers, or both 0, which stands for 0 and 1"},
        {{.background = depth->background}, "depth.sky must be NEBEL_BACKGROUND_DEPTH_FAR, VALUE or NONE"},
        {{.ray_start = depth->ray_start}, "depth.start must be NEBEL_RAY_START_EYE or NEAR"},
        {{.encoding = depth->encoding, .log_far = 1},
         "depth.kind must be a nebel_depth_encoding that fits clip_from_eye: LOGARITHM needs rays that meet in a "
         "point, "
         "AXIS a middle ray that is not across the axis"},
        {{.encoding = depth->encoding, .log_far = 1, .log_scale = depth->log_scale},
         "depth.log_scale must be finite and more than 0, or 0, which stands for 1"},
    };
    nebel_rays rays;
    for (size_t i = 0; i < sizeof fields / sizeof *fields; i++) {
        if (nebel_compute_view_rays(view, &fields[i].alone, &rays) != NEBEL_OK) return fields[i].fault;
    }
    return "depth.log_far must be finite and more than 0: the distance that is stored as 1";
}

nebel_result nebel_gl_draw_fog(nebel_gl *gl, const nebel_gl_pass *pass)
{
    if (gl == NULL) return NEBEL_ERROR_ARGUMENT;
    if (pass == NULL) return fail_pass(gl, NEBEL_ERROR_ARGUMENT, "the pass is missing");
    if (!gl->has_fog) return fail_pass(gl, NEBEL_ERROR_ARGUMENT, "call nebel_gl_set_fog first");
    nb_fog_pass_input picture = {.width = gl->views[0].width, .height = gl->views[0].height};
    if (nebel_compute_view_rays(&gl->views[0], &pass->depth, &picture.rays) != NEBEL_OK) {
        return fail_pass(gl, NEBEL_ERROR_ARGUMENT, find_depth_fault(&gl->views[0], &pass->depth));
    }
    return nb_gl_draw_fog(gl, pass, &picture);
}

nebel_result nb_gl_draw_fog(nebel_gl *gl, const nebel_gl_pass *pass, const nb_fog_pass_input *picture)
{
    nebel_result result = nb_context_check(&gl->log, gl->vertex_array);
    if (result == NEBEL_OK) result = check_pass(gl, pass);
    if (result != NEBEL_OK) return result;
    nb_pass_task t = {.gl = gl, .pass = pass, .picture = picture};
    nb_gl_state state;
    nb_state_save(&gl->context, &state);
    result = draw_with_program(&t, (GLuint)state.framebuffer);
    nb_state_restore(&gl->context, &state);
    return result;
}
