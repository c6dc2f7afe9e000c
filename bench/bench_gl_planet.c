/* Frames of planets in OpenGL, against a copy of such a picture: air from the ground, from space, and where the eye moves,
 * so that the table is made anew; layers. In the current context. */
#include "groups.h"
#include "measure.h"
#include "scenes.h"

#include <epoxy/gl.h>
#include <nebel/gl.h>
#include <stdio.h>
#include <string.h>

typedef struct nb_gl_planet_bench {
    nebel_atmosphere *air;
    nebel_textured_planet *layers;
    nebel_planet planet, layered;
    nebel_scene_data scene, layered_scene;
    nebel_gl_renderer *renderer, *layered_renderer;
    unsigned textures[2], framebuffers[2];
    nebel_gl_frame_desc frame;
} nb_gl_planet_bench;

/* ---- the copy -------------------------------------------------------------------------------- */

static int make_copy(nb_gl_planet_bench *b)
{
    int complete = 1;
    glGenTextures(2, b->textures);
    glGenFramebuffers(2, b->framebuffers);
    for (int i = 0; i < 2; i++) {
        glBindTexture(GL_TEXTURE_2D, b->textures[i]);
        glTexImage2D(GL_TEXTURE_2D, 0, GL_RGBA32F, (GLsizei)b->frame.width, (GLsizei)b->frame.height, 0, GL_RGBA,
                     GL_FLOAT, NULL);
        glBindFramebuffer(GL_FRAMEBUFFER, b->framebuffers[i]);
        glFramebufferTexture2D(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_TEXTURE_2D, b->textures[i], 0);
        complete = complete && glCheckFramebufferStatus(GL_FRAMEBUFFER) == GL_FRAMEBUFFER_COMPLETE;
    }
    return complete ? 0 : -1;
}

static double run_copy(void *user)
{
    const nb_gl_planet_bench *const b = user;
    const GLint width = (GLint)b->frame.width, height = (GLint)b->frame.height;
    glFinish();
    const double start = nb_clock_wall();
    glBindFramebuffer(GL_READ_FRAMEBUFFER, b->framebuffers[0]);
    glBindFramebuffer(GL_DRAW_FRAMEBUFFER, b->framebuffers[1]);
    glBlitFramebuffer(0, 0, width, height, 0, 0, width, height, GL_COLOR_BUFFER_BIT, GL_NEAREST);
    glFinish();
    return nb_clock_wall() - start;
}

/* ---- frames ---------------------------------------------------------------------------------- */

static double run_frame(void *user)
{
    const nb_gl_planet_bench *const b = user;
    glFinish();
    const double start = nb_clock_wall();
    if (nebel_gl_render_frame(b->renderer, &b->frame) != NEBEL_OK) return -1;
    glFinish();
    return nb_clock_wall() - start;
}

/* After a frame that is not timed, where the table is the place's. */
static double run_still(void *user)
{
    return run_frame(user) < 0 ? -1 : run_frame(user);
}

static double run_flight(void *user)
{
    nb_gl_planet_bench *const b = user;
    b->frame.camera.position[0] += 1;
    return run_frame(b);
}

/* The Earth with two shells of clouds and its air, as tutorials draw it. */
static int set_up_layers(nb_gl_planet_bench *b)
{
    b->layered = (nebel_planet){
        .model = NEBEL_PLANET_TEXTURED, .textured_desc = {.cloud_shell_count = 2}, .sun_left = {1, 1, 1}};
    if (nebel_create_textured_planet(&b->layered.textured_desc, &b->layers) != NEBEL_OK) return -1;
    b->layered.textured = b->layers;
    b->layered_scene = b->scene;
    b->layered_scene.planets = &b->layered;
    const nebel_gl_renderer_desc usual = {.shadow_map_size = 0};
    return nebel_create_gl_renderer(&b->layered_scene, NULL, &usual, &b->layered_renderer) == NEBEL_OK ? 0 : -1;
}

static int set_up(const nb_bench_desc *desc, nb_gl_planet_bench *b)
{
    static const double to_sun[3] = {0.5, 0.75, -0.43};
    const nebel_gl_renderer_desc usual = {.shadow_map_size = 0};
    b->frame = (nebel_gl_frame_desc){
        .camera = {.position = {0, 1.7, 0}, .look_at = {0, 5, -20}, .up = {0, 1, 0}, .vertical_fov = 60},
        .width = desc->quick ? 160 : NB_BENCH_WIDTH,
        .height = desc->quick ? 88 : NB_BENCH_HEIGHT,
        .samples = 1};
    if (nebel_create_atmosphere(nebel_lookup_atmosphere("earth"), &b->air) != NEBEL_OK) return -1;
    b->planet = (nebel_planet){.atmosphere_desc = *nebel_lookup_atmosphere("earth"),
                               .sun_angular_diameter = 0.5334,
                               .atmosphere = b->air,
                               .sun_left = {1, 1, 1}};
    b->scene =
        (nebel_scene_data){.has_sun = 1, .sun_irradiance = {12, 12, 12}, .planet_count = 1, .planets = &b->planet};
    memcpy(b->scene.sun_direction, to_sun, sizeof to_sun);
    if (nebel_create_gl_renderer(&b->scene, NULL, &usual, &b->renderer) != NEBEL_OK) return -1;
    return set_up_layers(b) == 0 ? make_copy(b) : -1;
}

static const char *measure(const nb_bench_desc *desc, nb_gl_planet_bench *b, nb_figures *figures)
{
    enum { COPY, GROUND, SPACE, FLIGHT, LAYERS, CONTESTS };
    static const char *const names[CONTESTS] = {[GROUND] = "sky and ground, 1.7 m above it",
                                                [SPACE] = "the planet from 2,000 km",
                                                [FLIGHT] = "sky and ground, the eye moves: with the table",
                                                [LAYERS] = "a textured planet, two shells of clouds"};
    nb_gl_planet_bench space = *b, flight = *b, layers = *b;
    layers.renderer = b->layered_renderer;
    layers.frame.camera = (nebel_camera){.position = {0, 0, 2.2e7}, .up = {0, 1, 0}, .vertical_fov = 40};
    space.frame.camera = (nebel_camera){
        .position = {0, 2e6, 0}, .look_at = {-0.25e6, -0.15e6, -3e6}, .up = {0, 1, 0}, .vertical_fov = 60};
    nb_contest contests[CONTESTS] = {[COPY] = {.run = run_copy, .user = b},
                                     [GROUND] = {.run = run_still, .user = b},
                                     [SPACE] = {.run = run_still, .user = &space},
                                     [FLIGHT] = {.run = run_flight, .user = &flight},
                                     [LAYERS] = {.run = run_still, .user = &layers}};
    if (nb_measure(contests, CONTESTS, desc->quick ? 1 : 7) != 0) return "opengl: a planet cannot be drawn";
    for (int i = 1; i < CONTESTS; i++) {
        nb_figure figure = {.group = "Planets in OpenGL, one sample: the whole frame",
                            .unit = "ms",
                            .value = 1e3 * contests[i].seconds,
                            .floor_name = "a copy of the picture",
                            .floor = 1e3 * contests[COPY].seconds};
        (void)snprintf(figure.name, sizeof figure.name, "%s", names[i]);
        nb_figures_add(figures, &figure);
    }
    return NULL;
}

const char *nb_bench_opengl_planet(const nb_bench_desc *desc, nb_figures *figures)
{
    nb_gl_planet_bench b = {.air = NULL};
    const char *fault = "opengl: a planet cannot be set up";
    if (set_up(desc, &b) == 0) fault = measure(desc, &b, figures);
    if (fault == NULL) nb_bench_published_planet(figures);
    nebel_destroy_gl_renderer(b.layered_renderer);
    nebel_destroy_gl_renderer(b.renderer);
    nebel_destroy_textured_planet(b.layers);
    nebel_destroy_atmosphere(b.air);
    glDeleteTextures(2, b.textures);
    glDeleteFramebuffers(2, b.framebuffers);
    return fault;
}
