/* Fog in an engine that takes vertex colours and nothing else, as OpenGL 1.1 does: the fog between the eye and each
 * vertex comes from the CPU, and the hardware interpolates. Left and right turn the camera, Escape ends.
 *
 *     cc embed_vertex_colors.c $(pkg-config --cflags --libs nebel glfw3 epoxy) -lm */
#include <nebel/nebel.h>

#include "engine_fixed.h"
#include "fog.h"
#include "host.h"

#include <GLFW/glfw3.h>

/* A ray from the eye to each vertex: colour = transmittance * surface + in-scattering. */
static nebel_result fog_vertices(const nebel_snapshot *fog, engine *host)
{
    static float way[3][MOST_VERTICES], length[MOST_VERTICES], t[3][MOST_VERTICES], s[3][MOST_VERTICES];
    for (size_t i = 0; i < host->count; i++) {
        for (int k = 0; k < 3; k++) way[k][i] = (float)((double)host->vertices[i].place[k] - host->eye[k]);
        length[i] = sqrtf(way[0][i] * way[0][i] + way[1][i] * way[1][i] + way[2][i] * way[2][i]);
    }
    const nebel_ray_planes rays = {.origin = {host->eye[0], host->eye[1], host->eye[2]},
                                   .direction_float = {way[0], way[1], way[2]},
                                   .t_max = length};
    const nebel_transfer_planes transfers = {.transmittance = {t[0], t[1], t[2]}, .in_scattering = {s[0], s[1], s[2]}};
    const nebel_result result = nebel_trace_planes(fog, NULL, host->count, &rays, &transfers);
    for (size_t i = 0; i < host->count; i++) {
        engine_vertex *const v = &host->vertices[i];
        for (int c = 0; c < 3; c++) v->color[c] = t[c][i] * v->surface[c] + s[c][i];
    }
    return result;
}

static GLFWwindow *open_window(void)
{
    if (!glfwInit()) return NULL;
    glfwWindowHint(GLFW_SRGB_CAPABLE, GLFW_TRUE);
    glfwWindowHint(GLFW_RESIZABLE, GLFW_FALSE);
    return glfwCreateWindow(WIDTH, HEIGHT, "nebel: fog in vertex colours", NULL, NULL);
}

int main(void)
{
    static engine host;
    nebel_fog *fog = NULL;
    nebel_snapshot *const snapshot = make_fog(&fog);
    GLFWwindow *const window = open_window();
    const char *why;
    if (!window) return glfwGetError(&why), host_refuse("embed_vertex_colors", why);
    if (!snapshot) return 1;
    glfwMakeContextCurrent(window);
    glfwSetInputMode(window, GLFW_STICKY_KEYS, GLFW_TRUE);
    engine_open(&host);
    glEnable(GL_FRAMEBUFFER_SRGB); /* the window shows sRGB */

    nebel_result result = NEBEL_OK;
    for (double angle = 0; result == NEBEL_OK && !glfwWindowShouldClose(window); glfwPollEvents()) {
        angle += .02 * (glfwGetKey(window, GLFW_KEY_RIGHT) - glfwGetKey(window, GLFW_KEY_LEFT));
        engine_turn(&host, angle);
        result = fog_vertices(snapshot, &host);
        engine_draw(&host);
        glfwSwapBuffers(window);
        if (glfwGetKey(window, GLFW_KEY_ESCAPE)) glfwSetWindowShouldClose(window, GLFW_TRUE);
    }
    nebel_release_snapshot(snapshot);
    nebel_destroy_fog(fog);
    glfwTerminate();
    return result != NEBEL_OK;
}
