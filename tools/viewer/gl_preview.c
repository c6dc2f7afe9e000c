#define _POSIX_C_SOURCE 200809L

#include "gl_preview.h"

#include "gl_quad.h"

#include <epoxy/gl.h>
#include <time.h>

/* A movement looks smooth at this rate; where pixels are dear they get fewer, down to one in 64. */
static const double frame_seconds = 0.04;
enum { COARSEST = 8 };

/* Takes one plane of the renderer's picture, before the next frame overwrites it. */
static const char copy_text[] = "uniform sampler2D plane_texture, color_texture;\n"
                                "uniform bool is_depth;\n"
                                "out vec4 picture;\n"
                                "void main()\n"
                                "{\n"
                                "    ivec2 at = ivec2(gl_FragCoord.xy);\n"
                                "    vec4 plane = texelFetch(plane_texture, at, 0);\n"
                                "    float share = texelFetch(color_texture, at, 0).a;\n"
                                "    float depth = share > 0.0 ? plane.a / share : 1e18;\n"
                                "    picture = vec4(is_depth ? vec3(depth) : plane.rgb, 1.0);\n"
                                "}\n";

nebel_result nb_gl_preview_open(const nebel_scene_data *scene, const nebel_log *log, nb_gl_preview *stage)
{
    const nebel_gl_renderer_desc desc = {.host.log = *log};
    nebel_result result = nebel_create_gl_renderer(scene, NULL, &desc, &stage->renderer);
    if (result == NEBEL_OK) result = nb_program_make(copy_text, log, &stage->program);
    if (result != NEBEL_OK) {
        nb_gl_preview_close(stage);
        return result;
    }
    glGenTextures(1, &stage->texture);
    glGenFramebuffers(1, &stage->target);
    glGenVertexArrays(1, &stage->array);
    return NEBEL_OK;
}

void nb_gl_preview_close(nb_gl_preview *stage)
{
    if (stage->renderer == NULL) return;
    nebel_destroy_gl_renderer(stage->renderer);
    glDeleteTextures(1, &stage->texture);
    glDeleteFramebuffers(1, &stage->target);
    glDeleteVertexArrays(1, &stage->array);
    glDeleteProgram(stage->program);
    *stage = (nb_gl_preview){.renderer = NULL};
}

static double now(void)
{
    struct timespec time;
    clock_gettime(CLOCK_MONOTONIC, &time);
    return (double)time.tv_sec + 1e-9 * (double)time.tv_nsec;
}

/* ---- the copy
 * --------------------------------------------------------------------------------------------------------
 */

static void fit_texture(nb_gl_preview *stage, uint32_t width, uint32_t height)
{
    glBindTexture(GL_TEXTURE_2D, stage->texture);
    glBindFramebuffer(GL_DRAW_FRAMEBUFFER, stage->target);
    if (stage->width == width && stage->height == height) return;
    glTexImage2D(GL_TEXTURE_2D, 0, GL_RGBA32F, (GLsizei)width, (GLsizei)height, 0, GL_RGBA, GL_FLOAT, NULL);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAX_LEVEL, 0);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_LINEAR);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_S, GL_CLAMP_TO_EDGE);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_T, GL_CLAMP_TO_EDGE);
    glFramebufferTexture2D(GL_DRAW_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_TEXTURE_2D, stage->texture, 0);
    stage->width = width;
    stage->height = height;
}

static nebel_result copy_plane(nb_gl_preview *stage, nb_display_plane plane)
{
    nebel_gl_textures from;
    const nebel_result result = nebel_gl_get_textures(stage->renderer, &from);
    if (result != NEBEL_OK) return result;
    const unsigned textures[NB_LOOK_PLANES] = {from.color, from.transmittance, from.in_scattering, from.surface};
    fit_texture(stage, from.width, from.height);
    glViewport(0, 0, (GLsizei)from.width, (GLsizei)from.height);
    glUseProgram(stage->program);
    glUniform1i(glGetUniformLocation(stage->program, "is_depth"), plane == NB_LOOK_DEPTH);
    nb_program_bind(stage->program, "plane_texture", 0, textures[plane]);
    nb_program_bind(stage->program, "color_texture", 1, from.color);
    glBindVertexArray(stage->array);
    glDrawArrays(GL_TRIANGLES, 0, 3);
    glBindFramebuffer(GL_DRAW_FRAMEBUFFER, 0);
    stage->plane = plane;
    return NEBEL_OK;
}

/* ---- frames
 * ----------------------------------------------------------------------------------------------------------
 */

static int stop(size_t done, size_t total, void *user)
{
    nb_gl_preview *const stage = user;
    stage->was_stopped = done < total && stage->is_needed(stage->user);
    return stage->was_stopped;
}

static nebel_gl_method find_method(const nb_display *look)
{
    switch (look->method) {
    case NEBEL_METHOD_CELLS:
        return NEBEL_GL_METHOD_CELLS;
    case NEBEL_METHOD_LINEAR:
        return NEBEL_GL_METHOD_LINEAR;
    case NEBEL_METHOD_EXP:
        return NEBEL_GL_METHOD_EXP;
    case NEBEL_METHOD_EXP2:
        return NEBEL_GL_METHOD_EXP2;
    case NEBEL_METHOD_VERTEX:
        return NEBEL_GL_METHOD_VERTEX;
    case NEBEL_METHOD_ADDITIVE:
        return NEBEL_GL_METHOD_ADDITIVE;
    default:
        return look->particles == NB_LOOK_AS_DISCS ? NEBEL_GL_METHOD_FIVE_TAP : NEBEL_GL_METHOD_EXACT;
    }
}

/* Many particles take long to dim the sun for an eye that moves. */
static nebel_result draw(nb_gl_preview *stage, const nebel_camera *camera, uint32_t width, uint32_t height,
                         const nb_display *look, uint32_t samples, int quick)
{
    nebel_gl_frame_desc desc = {.camera = *camera,
                                .width = width,
                                .height = height,
                                .samples = samples,
                                .particles_leave_sun = quick,
                                .method = find_method(look),
                                .cells = stage->cells,
                                .factor = stage->factor,
                                .time = stage->time};
    if (samples > 1) {
        desc.progress = stop;
        desc.progress_user = stage;
    }
    const double start = now();
    nebel_result result = nebel_gl_render_frame(stage->renderer, &desc);
    if (result == NEBEL_OK) result = copy_plane(stage, look->plane);
    if (result != NEBEL_OK) return result;
    glFinish();
    stage->seconds = now() - start;
    stage->samples = samples;
    stage->was_quick = quick;
    if (samples == 1 && (quick || stage->pixel_seconds == 0))
        stage->pixel_seconds = stage->seconds / ((double)width * height);
    return NEBEL_OK;
}

/* One pixel stands for so many either way. */
static uint32_t find_coarseness(const nb_gl_preview *stage, uint32_t width, uint32_t height)
{
    uint32_t by = 1;
    while (by < COARSEST && stage->pixel_seconds * width * height > frame_seconds * by * by) by++;
    return by;
}

static uint32_t divide_up(uint32_t a, uint32_t b)
{
    return (a + b - 1) / b;
}

static nebel_result draw_moving(nb_gl_preview *stage, const nebel_camera *camera, uint32_t width, uint32_t height,
                                const nb_display *look)
{
    const uint32_t by = find_coarseness(stage, width, height);
    const nebel_result result = draw(stage, camera, divide_up(width, by), divide_up(height, by), look, 1, 1);
    if (result == NEBEL_OK) stage->state = by > 1 ? NB_STAGE_COARSE : NB_STAGE_WHOLE;
    return result;
}

nebel_result nb_gl_preview_draw(nb_gl_preview *stage, const nebel_camera *camera, uint32_t width, uint32_t height,
                                const nb_display *look, int moving)
{
    if (moving) return draw_moving(stage, camera, width, height, look);
    if (stage->state == NB_STAGE_FINE) return NEBEL_OK;
    const int fine = stage->state == NB_STAGE_WHOLE && !stage->was_quick;
    /* Beside the picture of the CPU one sample is enough: both look through the centres of the pixels then. */
    const uint32_t samples = fine && look->compare == NB_LOOK_GL_ALONE ? (uint32_t)look->samples : 1;
    if (fine && samples == 1) {
        stage->state = NB_STAGE_FINE;
        return NEBEL_OK;
    }
    const nebel_result result = draw(stage, camera, width, height, look, samples, 0);
    if (result == NEBEL_OK) stage->state = fine ? NB_STAGE_FINE : NB_STAGE_WHOLE;
    const int was_stopped = stage->was_stopped;
    stage->was_stopped = 0;
    return was_stopped ? NEBEL_OK : result;
}
