/* Fog over the picture of an engine in OpenGL 3.3: the engine draws into a colour and a depth texture, nebel_gl puts
 * the fog over both, into the window. Left and right turn the camera, Escape ends.
 *
 *     cc embed_glfw.c $(pkg-config --cflags --libs nebel_gl glfw3 epoxy) -lm */
#include <nebel/gl.h>

#include "engine.h"
#include "fog.h"
#include "host.h"

#include <GLFW/glfw3.h>
#include <string.h>

static GLFWwindow *open_window(void)
{
    if (!glfwInit()) return NULL;
    glfwWindowHint(GLFW_CONTEXT_VERSION_MAJOR, 3);
    glfwWindowHint(GLFW_CONTEXT_VERSION_MINOR, 3);
    glfwWindowHint(GLFW_OPENGL_PROFILE, GLFW_OPENGL_CORE_PROFILE);
    glfwWindowHint(GLFW_SRGB_CAPABLE, GLFW_TRUE);
    glfwWindowHint(GLFW_RESIZABLE, GLFW_FALSE);
    GLFWwindow *const window = glfwCreateWindow(WIDTH, HEIGHT, "nebel: fog over a picture", NULL, NULL);
    if (!window) return NULL;
    glfwMakeContextCurrent(window);
    glfwSetInputMode(window, GLFW_STICKY_KEYS, GLFW_TRUE);
    return window;
}

int main(void)
{
    GLFWwindow *const window = open_window();
    const char *why;
    nebel_fog *fog = NULL;
    nebel_snapshot *const snapshot = make_fog(&fog);
    nebel_lighting *const lighting = light_fog(snapshot);
    nebel_gl *passes = NULL;
    if (!window) return glfwGetError(&why), host_refuse("embed_glfw", why);
    if (!lighting || nebel_create_gl(&(nebel_gl_desc){.host.log = host_log}, &passes) != NEBEL_OK) return 1;

    host_say_compiling("embed_glfw");
    engine host = engine_open_textures();
    const nebel_gl_pass pass = {.color_texture = host.color, .depth_texture = host.depth};
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
