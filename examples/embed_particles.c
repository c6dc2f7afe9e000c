/* A second pass of particles over an opaque picture whose depth is kept in a texture. They are soft where they meet it,
 * because each fragment asks for the piece of its particle before the opaque surface. While the space bar is down: the
 * classic comparison of depth at five places instead. Left and right turn the camera, Escape ends.
 *
 *     cc embed_particles.c $(pkg-config --cflags --libs nebel_gl glfw3 epoxy) -lm */
#include <nebel/gl.h>

#include "engine.h"
#include "host.h"
#include "particles.h"

#include <GLFW/glfw3.h>
#include <string.h>

/* From the back to the front, against the depth texture. The depth buffer is neither read nor written. */
static void draw_particles(unsigned program, const engine *host, const nebel_gl *passes, const nebel_view *view,
                           int classic)
{
    particle particles[PARTICLES];
    nebel_gl_fog_resources fog;
    nebel_rays rays;
    particles_place(particles, host->eye);
    nebel_gl_get_fog_resources(passes, &fog);
    nebel_compute_view_rays(view, NULL, &rays);
    glUseProgram(program);
    engine_set_matrix(program, "eye_from_world", host->eye_from_world);
    engine_set_matrix(program, "clip_from_eye", host->clip_from_eye);
    glUniform4fv(glGetUniformLocation(program, "nebel_rays"), NEBEL_RAY_TEXELS, rays.texels[0].v);
    glUniform4fv(glGetUniformLocation(program, "balls"), PARTICLES, particles[0].center);
    glUniform1i(glGetUniformLocation(program, "classic"), classic);
    glBindBufferBase(GL_UNIFORM_BUFFER, 0, fog.block);
    glBindTexture(GL_TEXTURE_2D, host->depth);
    glDisable(GL_DEPTH_TEST);
    glEnable(GL_BLEND);
    glBlendFuncSeparate(GL_ONE, GL_SRC1_COLOR, GL_ZERO, GL_ONE);
    glDrawArraysInstanced(GL_TRIANGLE_STRIP, 0, 4, PARTICLES);
    glDisable(GL_BLEND);
}

static GLFWwindow *open_window(void)
{
    if (!glfwInit()) return NULL;
    glfwWindowHint(GLFW_CONTEXT_VERSION_MAJOR, 3);
    glfwWindowHint(GLFW_CONTEXT_VERSION_MINOR, 3);
    glfwWindowHint(GLFW_OPENGL_PROFILE, GLFW_OPENGL_CORE_PROFILE);
    glfwWindowHint(GLFW_SRGB_CAPABLE, GLFW_TRUE);
    glfwWindowHint(GLFW_RESIZABLE, GLFW_FALSE);
    GLFWwindow *const window = glfwCreateWindow(WIDTH, HEIGHT, "nebel: soft particles", NULL, NULL);
    if (!window) return NULL;
    glfwMakeContextCurrent(window);
    glfwSetInputMode(window, GLFW_STICKY_KEYS, GLFW_TRUE);
    return window;
}

int main(void)
{
    const nebel_volume_desc mist = {.shape = {.type = NEBEL_SHAPE_WORLD},
                                    .density = {.type = NEBEL_DENSITY_HEIGHT, .scale_height = .6},
                                    .extinction = {.25, .25, .25},
                                    .source = {.5, .6, .7}};
    GLFWwindow *const window = open_window();
    const char *why;
    nebel_fog *fog = NULL;
    nebel_snapshot *snapshot = NULL;
    nebel_lighting *lighting = NULL;
    nebel_gl *passes = NULL;
    if (!window) return glfwGetError(&why), host_refuse("embed_particles", why);
    if (nebel_create_fog(&(nebel_fog_desc){.host.log = host_log}, &fog) != NEBEL_OK ||
        nebel_add_volume(fog, &mist, NULL) != NEBEL_OK || nebel_commit_fog(fog, &snapshot) != NEBEL_OK ||
        nebel_create_lighting(snapshot, NULL, &lighting) != NEBEL_OK ||
        nebel_create_gl(&(nebel_gl_desc){.host.log = host_log}, &passes) != NEBEL_OK)
        return 1;

    host_say_compiling("embed_particles");
    engine host = engine_open_textures();
    const nebel_gl_pass pass = {.color_texture = host.color, .depth_texture = host.depth};
    const unsigned program = particles_open(lighting);
    glEnable(GL_FRAMEBUFFER_SRGB); /* the window shows sRGB */

    nebel_result result = NEBEL_OK;
    for (double angle = 0; result == NEBEL_OK && !glfwWindowShouldClose(window); glfwPollEvents()) {
        angle += .02 * (glfwGetKey(window, GLFW_KEY_RIGHT) - glfwGetKey(window, GLFW_KEY_LEFT));
        engine_turn(&host, angle);
        engine_draw(&host);

        nebel_view view = {.width = WIDTH, .height = HEIGHT};
        memcpy(view.eye_from_world, host.eye_from_world, sizeof view.eye_from_world);
        memcpy(view.clip_from_eye, host.clip_from_eye, sizeof view.clip_from_eye);
        result = nebel_gl_set_fog(passes, lighting, &view);
        glBindFramebuffer(GL_FRAMEBUFFER, 0);
        if (result == NEBEL_OK) result = nebel_gl_draw_fog(passes, &pass);
        draw_particles(program, &host, passes, &view, glfwGetKey(window, GLFW_KEY_SPACE));
        glfwSwapBuffers(window);
        if (glfwGetKey(window, GLFW_KEY_ESCAPE)) glfwSetWindowShouldClose(window, GLFW_TRUE);
    }
    nebel_destroy_gl(passes);
    nebel_release_lighting(lighting);
    nebel_release_snapshot(snapshot);
    nebel_destroy_fog(fog);
    glfwTerminate();
    return result != NEBEL_OK;
}
