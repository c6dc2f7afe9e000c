/* A nebula of very many particles in OpenGL, against the same particles as plain sprites: a square with a round falloff
 * each, which adds its light to one target of the same format, in any order. In the current context. */
#include "groups.h"
#include "measure.h"
#include "nebula_scene.h"

#include <epoxy/gl.h>
#include <nebel/gl.h>
#include <stdio.h>
#include <stdlib.h>

static const char out_of_memory[] = "opengl: out of memory for particles";
static const char failed[] = "opengl: a picture of particles failed";

typedef struct nb_sprite {
    float place[4]; /* center, radius */
    float color[4];
} nb_sprite;

typedef struct nb_gl_drawing {
    nb_sky sky;
    nebel_scene_data scene, walled; /* without surfaces; with one across the picture, in the nebula's middle */
    nebel_gl_renderer *renderer, *with_wall;
    unsigned target, framebuffer, vertex_array, buffer, program;
} nb_gl_drawing;

/* ---- sprites --------------------------------------------------------------------------------- */

static const char sprite_vertex[] =
    "#version 330 core\n"
    "layout(location = 0) in vec4 place;\n"
    "layout(location = 1) in vec4 light;\n"
    "uniform mat4 eye_from_world, clip_from_eye;\n"
    "out vec2 corner;\n"
    "flat out vec4 color;\n"
    "void main()\n"
    "{\n"
    "    corner = vec2(float(gl_VertexID & 1), float(gl_VertexID >> 1)) * 2.0 - 1.0;\n"
    "    color = light;\n"
    "    gl_Position = clip_from_eye * (eye_from_world * vec4(place.xyz, 1.0) + vec4(place.w * corner, 0.0, 0.0));\n"
    "}\n";
static const char sprite_fragment[] = "#version 330 core\n"
                                      "in vec2 corner;\n"
                                      "flat in vec4 color;\n"
                                      "out vec4 result;\n"
                                      "void main()\n"
                                      "{\n"
                                      "    float left = max(1.0 - dot(corner, corner), 0.0);\n"
                                      "    result = left * left * color;\n"
                                      "}\n";

static void attach(unsigned program, GLenum kind, const char *text)
{
    const unsigned shader = glCreateShader(kind);
    glShaderSource(shader, 1, &text, NULL);
    glCompileShader(shader);
    glAttachShader(program, shader);
    glDeleteShader(shader);
}

static int make_program(nb_gl_drawing *d)
{
    float matrices[2][16];
    GLint good = 0;
    nebel_view view;
    d->program = glCreateProgram();
    attach(d->program, GL_VERTEX_SHADER, sprite_vertex);
    attach(d->program, GL_FRAGMENT_SHADER, sprite_fragment);
    glLinkProgram(d->program);
    glGetProgramiv(d->program, GL_LINK_STATUS, &good);
    if (!good || nebel_view_from_camera(&d->sky.camera, d->sky.width, d->sky.height, NULL, &view) != NEBEL_OK)
        return -1;
    for (int i = 0; i < 16; i++) {
        matrices[0][i] = (float)view.eye_from_world[i];
        matrices[1][i] = (float)view.clip_from_eye[i];
    }
    glUseProgram(d->program);
    glUniformMatrix4fv(glGetUniformLocation(d->program, "eye_from_world"), 1, GL_FALSE, matrices[0]);
    glUniformMatrix4fv(glGetUniformLocation(d->program, "clip_from_eye"), 1, GL_FALSE, matrices[1]);
    return 0;
}

static int make_sprites(nb_gl_drawing *d)
{
    nb_sprite *const sprites = malloc(d->sky.count * sizeof *sprites);
    if (sprites == NULL) return -1;
    for (size_t i = 0; i < d->sky.count; i++) {
        const nebel_particle *const p = &d->sky.particles[i];
        sprites[i] = (nb_sprite){.place[3] = (float)p->radius};
        for (int c = 0; c < 3; c++) {
            sprites[i].place[c] = (float)p->center[c];
            sprites[i].color[c] = (float)(p->emission[c] * p->radius);
        }
    }
    glGenVertexArrays(1, &d->vertex_array);
    glBindVertexArray(d->vertex_array);
    glGenBuffers(1, &d->buffer);
    glBindBuffer(GL_ARRAY_BUFFER, d->buffer);
    glBufferData(GL_ARRAY_BUFFER, (GLsizeiptr)(d->sky.count * sizeof *sprites), sprites, GL_STATIC_DRAW);
    for (GLuint i = 0; i < 2; i++) {
        glEnableVertexAttribArray(i);
        glVertexAttribPointer(i, 4, GL_FLOAT, GL_FALSE, sizeof *sprites, (const void *)(i * 4 * sizeof(float)));
        glVertexAttribDivisor(i, 1);
    }
    free(sprites);
    return 0;
}

static int make_target(nb_gl_drawing *d)
{
    glGenTextures(1, &d->target);
    glBindTexture(GL_TEXTURE_2D, d->target);
    glTexImage2D(GL_TEXTURE_2D, 0, GL_RGBA32F, (GLsizei)d->sky.width, (GLsizei)d->sky.height, 0, GL_RGBA, GL_FLOAT,
                 NULL);
    glGenFramebuffers(1, &d->framebuffer);
    glBindFramebuffer(GL_FRAMEBUFFER, d->framebuffer);
    glFramebufferTexture2D(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_TEXTURE_2D, d->target, 0);
    return glCheckFramebufferStatus(GL_FRAMEBUFFER) == GL_FRAMEBUFFER_COMPLETE ? 0 : -1;
}

static double run_sprites(void *user)
{
    const nb_gl_drawing *const d = user;
    glFinish();
    const double start = nb_clock_wall();
    glBindFramebuffer(GL_FRAMEBUFFER, d->framebuffer);
    glViewport(0, 0, (GLsizei)d->sky.width, (GLsizei)d->sky.height);
    glClear(GL_COLOR_BUFFER_BIT);
    glEnable(GL_BLEND);
    glBlendFunc(GL_ONE, GL_ONE);
    glUseProgram(d->program);
    glBindVertexArray(d->vertex_array);
    glDrawArraysInstanced(GL_TRIANGLE_STRIP, 0, 4, (GLsizei)d->sky.count);
    glFinish();
    return nb_clock_wall() - start;
}

/* ---- particles ------------------------------------------------------------------------------- */

static double run_frame(const nb_gl_drawing *d, nebel_gl_renderer *renderer)
{
    const nebel_gl_frame_desc desc = {
        .camera = d->sky.camera, .width = d->sky.width, .height = d->sky.height, .samples = 1};
    glFinish();
    const double start = nb_clock_wall();
    if (nebel_gl_render_frame(renderer, &desc) != NEBEL_OK) return -1;
    glFinish();
    return nb_clock_wall() - start;
}

static double run_particles(void *user)
{
    const nb_gl_drawing *const d = user;
    return run_frame(d, d->renderer);
}

static double run_with_wall(void *user)
{
    const nb_gl_drawing *const d = user;
    return run_frame(d, d->with_wall);
}

static int set_particles(nb_gl_drawing *d)
{
    const nebel_particle *const particles = d->sky.particles;
    return nebel_set_gl_renderer_particles(d->renderer, particles, d->sky.count) == NEBEL_OK &&
                   nebel_set_gl_renderer_particles(d->with_wall, particles, d->sky.count) == NEBEL_OK
               ? 0
               : -1;
}

static int make_renderers(nb_gl_drawing *d)
{
    static const float corners[] = {-40, -40, 0, 40, -40, 0, 40, 40, 0, -40, 40, 0};
    static const uint32_t indices[] = {0, 1, 2, 0, 2, 3};
    static const nebel_mesh wall = {.positions = corners,
                                    .indices = indices,
                                    .vertex_count = 4,
                                    .triangle_count = 2,
                                    .base_color = {.5f, .5f, .5f},
                                    .texture = -1};
    const nebel_gl_renderer_desc desc = {.shadow_map_size = 0};
    d->scene.camera = d->sky.camera;
    d->walled = d->scene;
    d->walled.meshes = &wall;
    d->walled.mesh_count = 1;
    return nebel_create_gl_renderer(&d->scene, NULL, &desc, &d->renderer) == NEBEL_OK &&
                   nebel_create_gl_renderer(&d->walled, NULL, &desc, &d->with_wall) == NEBEL_OK
               ? 0
               : -1;
}

/* Particles of one colour take all of the light alike: they need one pass. */
static void make_grey(nb_gl_drawing *d)
{
    for (size_t i = 0; i < d->sky.count; i++) {
        double *const extinction = d->sky.particles[i].extinction;
        extinction[0] = extinction[2] = extinction[1];
    }
}

/* ---- figures --------------------------------------------------------------------------------- */

static int count_overlap(const nb_gl_drawing *d, double *overlap)
{
    float *const transmittance = malloc(3 * sizeof(float) * d->sky.width * d->sky.height);
    if (transmittance == NULL) return -1;
    const nebel_gl_planes planes = {.transmittance = transmittance};
    const nebel_result result = nebel_gl_read_planes(d->renderer, &planes);
    *overlap = nb_sky_pixels(&d->sky) / nb_sky_covered(&d->sky, transmittance);
    free(transmittance);
    return result == NEBEL_OK ? 0 : -1;
}

static void add(nb_figures *figures, const nb_gl_drawing *d, const char *what, nb_figure figure)
{
    figure.group = "A nebula of particles in OpenGL, 1280x720, one sample: the whole frame";
    (void)snprintf(figure.name, sizeof figure.name, "%zu %s", d->sky.count, what);
    nb_figures_add(figures, &figure);
}

/* The one with a surface has no target: sprites are not tested against depth, and half of the particles are hidden. */
static const char *measure(nb_gl_drawing *d, const char *what, const char *what_with_wall, int repetitions,
                           nb_figures *figures)
{
    nb_contest contests[] = {
        {.run = run_sprites, .user = d}, {.run = run_particles, .user = d}, {.run = run_with_wall, .user = d}};
    if (set_particles(d) != 0 || nb_measure(contests, 3, repetitions) != 0) return failed;
    add(figures, d, what,
        (nb_figure){.unit = "ms",
                    .value = 1e3 * contests[1].seconds,
                    .floor_name = "additive sprites",
                    .floor = 1e3 * contests[0].seconds,
                    .at_most = 2});
    add(figures, d, what_with_wall,
        (nb_figure){.unit = "ms",
                    .value = 1e3 * contests[2].seconds,
                    .floor_name = "additive sprites without a surface",
                    .floor = 1e3 * contests[0].seconds});
    return NULL;
}

static const char *measure_all(nb_gl_drawing *d, int repetitions, nb_figures *figures)
{
    double overlap = 0;
    const char *fault =
        measure(d, "particles of three colors", "of three colors, a surface among them", repetitions, figures);
    if (fault != NULL) return fault;
    make_grey(d);
    fault = measure(d, "grey particles", "grey, a surface among them", repetitions, figures);
    if (fault != NULL) return fault;
    if (count_overlap(d, &overlap) != 0) return failed;
    add(figures, d, "particles: on a covered pixel", (nb_figure){.unit = "", .value = overlap});
    return NULL;
}

static void delete_all(nb_gl_drawing *d)
{
    nebel_destroy_gl_renderer(d->renderer);
    nebel_destroy_gl_renderer(d->with_wall);
    glDeleteTextures(1, &d->target);
    glDeleteFramebuffers(1, &d->framebuffer);
    glDeleteVertexArrays(1, &d->vertex_array);
    glDeleteBuffers(1, &d->buffer);
    glDeleteProgram(d->program);
    nb_sky_free(&d->sky);
}

const char *nb_bench_opengl_particles(const nb_bench_desc *desc, nb_figures *figures)
{
    nb_gl_drawing d = {0};
    const char *fault = out_of_memory;
    if (nb_sky_make(desc->quick, &d.sky) == 0 && make_sprites(&d) == 0) {
        fault = failed;
        if (make_program(&d) == 0 && make_target(&d) == 0 && make_renderers(&d) == 0)
            fault = measure_all(&d, desc->quick ? 1 : 5, figures);
    }
    delete_all(&d);
    return fault;
}
