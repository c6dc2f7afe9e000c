#include "window.h"

#include "../messages.h"

#include <epoxy/gl.h>

#define GLFW_INCLUDE_NONE
#include <GLFW/glfw3.h>

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* Where nothing happens a turn is this long [s]: often enough to see that the file has changed. */
static const double longest_wait = 0.25;

/* Controls need a few turns until they have settled after an event. */
enum { SETTLING = 3 };

static nb_window *find_window(GLFWwindow *handle)
{
    return glfwGetWindowUserPointer(handle);
}

/* ---- events
 * ----------------------------------------------------------------------------------------------------------
 */

static int make_room(nb_window *window)
{
    const int wanted = window->event_capacity > 0 ? 2 * window->event_capacity : 64;
    if (window->event_count < window->event_capacity) return 0;
    nb_window_event *const larger = realloc(window->events, (size_t)wanted * sizeof *larger);
    if (larger == NULL) return -1;
    window->events = larger;
    window->event_capacity = wanted;
    return 0;
}

/* Motions that follow each other are one. Where memory is out the latest events are lost. */
static void add_event(GLFWwindow *handle, nb_window_event event)
{
    nb_window *const window = find_window(handle);
    window->news = 1;
    nb_window_event *const last = window->event_count > 0 ? &window->events[window->event_count - 1] : NULL;
    if (event.kind == NB_WINDOW_MOTION && last != NULL && last->kind == NB_WINDOW_MOTION) {
        *last = event;
    } else if (make_room(window) == 0) {
        window->events[window->event_count++] = event;
    }
}

static void on_key(GLFWwindow *handle, int key, int scancode, int action, int modifiers)
{
    (void)scancode;
    const nb_window_event_kind kind = action == GLFW_RELEASE ? NB_WINDOW_KEY_UP : NB_WINDOW_KEY_DOWN;
    add_event(handle, (nb_window_event){.kind = kind, .code = key, .modifiers = modifiers});
}

static void on_button(GLFWwindow *handle, int button, int action, int modifiers)
{
    const nb_window_event_kind kind = action == GLFW_RELEASE ? NB_WINDOW_BUTTON_UP : NB_WINDOW_BUTTON_DOWN;
    nb_window_event event = {.kind = kind, .code = button, .modifiers = modifiers};
    event.x = find_window(handle)->cursor_x;
    event.y = find_window(handle)->cursor_y;
    add_event(handle, event);
}

static void on_wheel(GLFWwindow *handle, double x, double y)
{
    add_event(handle, (nb_window_event){.kind = NB_WINDOW_WHEEL, .x = x, .y = y});
}

static void on_cursor(GLFWwindow *handle, double x, double y)
{
    find_window(handle)->cursor_x = x;
    find_window(handle)->cursor_y = y;
    add_event(handle, (nb_window_event){.kind = NB_WINDOW_MOTION, .x = x, .y = y});
}

static void on_size(GLFWwindow *handle, int width, int height)
{
    (void)width, (void)height;
    find_window(handle)->news = 1;
}

/* ---- open and close
 * --------------------------------------------------------------------------------------------------
 */

static int fail(const char *what)
{
    const char *words = NULL;
    (void)glfwGetError(&words);
    return nb_report_failure("view: %s%s%s", what, words != NULL ? ": " : "", words != NULL ? words : "");
}

static void read_size(nb_window *window)
{
    int width = 0, height = 0;
    glfwGetFramebufferSize(window->handle, &width, &height);
    glfwGetWindowSize(window->handle, &window->inner_width, &window->inner_height);
    if (window->inner_width < 1 || window->inner_height < 1 || glfwGetWindowAttrib(window->handle, GLFW_ICONIFIED))
        width = height = 0;
    window->was_resized = window->width != (uint32_t)width || window->height != (uint32_t)height;
    window->width = (uint32_t)width;
    window->height = (uint32_t)height;
}

/* Where the system enlarges the whole window nothing is left to be done. */
static void read_scale(nb_window *window)
{
    float x = 1, y = 1;
    int pixels = 1, height = 1;
    glfwGetWindowContentScale(window->handle, &x, &y);
    glfwGetFramebufferSize(window->handle, NULL, &pixels);
    glfwGetWindowSize(window->handle, NULL, &height);
    window->scale = pixels > 0 && height > 0 ? (double)y * height / pixels : (double)y;
}

static GLFWwindow *make_window(const char *title, uint32_t width, uint32_t height)
{
    glfwWindowHint(GLFW_CONTEXT_VERSION_MAJOR, 3);
    glfwWindowHint(GLFW_CONTEXT_VERSION_MINOR, 3);
    glfwWindowHint(GLFW_OPENGL_PROFILE, GLFW_OPENGL_CORE_PROFILE);
    glfwWindowHint(GLFW_OPENGL_FORWARD_COMPAT, GLFW_TRUE);
    glfwWindowHint(GLFW_CONTEXT_ROBUSTNESS, GLFW_LOSE_CONTEXT_ON_RESET);
    return glfwCreateWindow((int)width, (int)height, title, NULL, NULL);
}

/* Says what OpenGL there is instead. */
static int fail_window(void)
{
    char words[512] = "no window with OpenGL 3.3 core opens";
    glfwDefaultWindowHints();
    glfwWindowHint(GLFW_VISIBLE, GLFW_FALSE);
    GLFWwindow *const any = glfwCreateWindow(64, 64, "nebel", NULL, NULL);
    if (any != NULL) {
        glfwMakeContextCurrent(any);
        (void)snprintf(words, sizeof words, "no window with OpenGL 3.3 core opens: the driver has OpenGL %s",
                       (const char *)glGetString(GL_VERSION));
        glfwDestroyWindow(any);
    }
    const size_t used = strlen(words);
    (void)snprintf(words + used, sizeof words - used, "; update the driver, or install Mesa (Debian: libgl1-mesa-dri)");
    return fail(words);
}

static void listen(nb_window *window)
{
    glfwSetWindowUserPointer(window->handle, window);
    (void)glfwSetKeyCallback(window->handle, on_key);
    (void)glfwSetMouseButtonCallback(window->handle, on_button);
    (void)glfwSetScrollCallback(window->handle, on_wheel);
    (void)glfwSetCursorPosCallback(window->handle, on_cursor);
    glfwGetCursorPos(window->handle, &window->cursor_x, &window->cursor_y);
    (void)glfwSetFramebufferSizeCallback(window->handle, on_size);
}

int nb_window_open(nb_window *window, const char *title, uint32_t width, uint32_t height)
{
    char name[512];
    if (!glfwInit()) return fail("there is no screen for a window; 'nebel render' makes pictures without one");
    (void)snprintf(name, sizeof name, "%s - nebel", title);
    window->handle = make_window(name, width, height);
    if (window->handle == NULL) return fail_window();
    glfwMakeContextCurrent(window->handle);
    glfwSwapInterval(1);
    (void)snprintf(window->driver, sizeof window->driver, "%s, %s", (const char *)glGetString(GL_RENDERER),
                   (const char *)glGetString(GL_VERSION));
    window->can_be_lost = epoxy_has_gl_extension("GL_ARB_robustness");
    listen(window);
    read_scale(window);
    read_size(window);
    window->awake = SETTLING;
    return NB_DONE;
}

/* GLFW stays until the program ends: it would unload libraries of X that never give back what they keep per display. */
void nb_window_close(nb_window *window)
{
    if (window->handle == NULL) return;
    glfwDestroyWindow(window->handle);
    free(window->events);
    window->handle = NULL;
    window->events = NULL;
    window->event_count = window->event_capacity = 0;
}

/* ---- turns
 * -----------------------------------------------------------------------------------------------------------
 */

void nb_window_wait(nb_window *window, int busy)
{
    const double before = window->time;
    if (window->news) window->awake = SETTLING;
    if (window->width == 0 || (!busy && window->awake == 0 && !window->news && window->event_count == 0)) {
        glfwWaitEventsTimeout(window->patience > 0 && window->width > 0 ? window->patience : longest_wait);
    } else {
        glfwPollEvents();
    }
    if (window->news) window->awake = SETTLING;
    if (window->awake > 0) window->awake--;
    window->news = 0;
    window->time = glfwGetTime();
    window->elapsed = window->time - before;
    read_size(window);
}

void nb_window_poll(nb_window *window)
{
    (void)window;
    glfwPollEvents();
}

int nb_window_has_news(const nb_window *window)
{
    return window->news;
}

double nb_window_now(void)
{
    return glfwGetTime();
}

void nb_window_show(nb_window *window)
{
    glfwSwapBuffers(window->handle);
}

int nb_window_is_ended(const nb_window *window)
{
    return glfwWindowShouldClose(window->handle);
}

void nb_window_end(nb_window *window)
{
    glfwSetWindowShouldClose(window->handle, GLFW_TRUE);
}

void nb_window_stay(nb_window *window)
{
    glfwSetWindowShouldClose(window->handle, GLFW_FALSE);
}

int nb_window_is_lost(nb_window *window)
{
    if (window->can_be_lost && glGetGraphicsResetStatusARB() != GL_NO_ERROR) window->is_lost = 1;
    return window->is_lost;
}
