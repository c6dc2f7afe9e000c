#include "gl_context.h"

#include <epoxy/egl.h>
#include <epoxy/gl.h>
#include <stdio.h>
#include <string.h>

enum { DEVICES_MOST = 16 };

/* What an attempt comes past, one after the other. */
enum { STAGE_NONE, STAGE_DISPLAY, STAGE_CONFIG, STAGE_SURFACE, STAGE_CONTEXT };

/* Of several attempts the one counts that came farthest, and of those the first. */
static int fail(nb_gl_context *gl, int stage, const char *what, EGLint error)
{
    if (stage <= gl->stage) return -1;
    gl->stage = stage;
    (void)snprintf(gl->fault, sizeof gl->fault, "%s (EGL error 0x%x)", what, (unsigned)error);
    return -1;
}

/* ---- displays -------------------------------------------------------------------------------- */

static int client_has(const char *extension)
{
    return epoxy_has_egl_extension(EGL_NO_DISPLAY, extension);
}

static int is_software(EGLDeviceEXT device)
{
    const char *const extensions = eglQueryDeviceStringEXT(device, EGL_EXTENSIONS);
    return extensions == NULL || epoxy_extension_in_string(extensions, "EGL_MESA_device_software");
}

/* A display of every graphics processor, then Mesa without a screen, then the default: the order in which they are
 * tried. */
static int list_displays(EGLDisplay displays[DEVICES_MOST + 2])
{
    EGLDeviceEXT devices[DEVICES_MOST];
    EGLint device_count = 0;
    int count = 0;
    if (client_has("EGL_EXT_platform_device") && client_has("EGL_EXT_device_enumeration") &&
        client_has("EGL_EXT_device_query") && !eglQueryDevicesEXT(DEVICES_MOST, devices, &device_count)) {
        device_count = 0;
    }
    for (EGLint i = 0; i < device_count; i++) {
        if (!is_software(devices[i]))
            displays[count++] = eglGetPlatformDisplayEXT(EGL_PLATFORM_DEVICE_EXT, devices[i], NULL);
    }
    if (client_has("EGL_MESA_platform_surfaceless")) {
        displays[count++] = eglGetPlatformDisplayEXT(EGL_PLATFORM_SURFACELESS_MESA, EGL_DEFAULT_DISPLAY, NULL);
    }
    displays[count++] = eglGetDisplay(EGL_DEFAULT_DISPLAY);
    return count;
}

/* ---- contexts -------------------------------------------------------------------------------- */

static EGLContext make_context(EGLDisplay display, EGLConfig config, nb_gl_api api)
{
    const EGLint profile =
        api == NB_GL_API_FIXED ? EGL_CONTEXT_OPENGL_COMPATIBILITY_PROFILE_BIT : EGL_CONTEXT_OPENGL_CORE_PROFILE_BIT;
    const EGLint desktop[] = {
        EGL_CONTEXT_MAJOR_VERSION, 3, EGL_CONTEXT_MINOR_VERSION, 3, EGL_CONTEXT_OPENGL_PROFILE_MASK, profile, EGL_NONE};
    const EGLint embedded[] = {EGL_CONTEXT_MAJOR_VERSION, 3, EGL_CONTEXT_MINOR_VERSION, 0, EGL_NONE};
    return eglCreateContext(display, config, EGL_NO_CONTEXT, api == NB_GL_API_ES ? embedded : desktop);
}

/* A driver may give another profile than it was asked for. */
static int has_fixed_pipeline(void)
{
    GLint profile = 0;
    glGetIntegerv(GL_CONTEXT_PROFILE_MASK, &profile);
    return (profile & GL_CONTEXT_COMPATIBILITY_PROFILE_BIT) != 0;
}

/* That the wanted context is missing, and what OpenGL there is instead. */
static int fail_context(nb_gl_context *gl, EGLDisplay display, EGLConfig config, nb_gl_api api)
{
    static const EGLint older[] = {EGL_CONTEXT_MAJOR_VERSION, 2, EGL_NONE}, any[] = {EGL_NONE};
    char words[192];
    const EGLint error = eglGetError();
    const char *const wanted = api == NB_GL_API_ES      ? "the driver has no OpenGL ES 3.0"
                               : api == NB_GL_API_FIXED ? "the driver has no compatibility profile of OpenGL 3.3"
                                                        : "the driver has no OpenGL 3.3 core";
    const EGLContext context = eglCreateContext(display, config, EGL_NO_CONTEXT, api == NB_GL_API_ES ? older : any);
    const int found = context != EGL_NO_CONTEXT && eglMakeCurrent(display, gl->surface, gl->surface, context);
    (void)snprintf(words, sizeof words, "%s%s%.120s", wanted, found ? ", but " : "",
                   found ? (const char *)glGetString(GL_VERSION) : "");
    eglMakeCurrent(display, EGL_NO_SURFACE, EGL_NO_SURFACE, EGL_NO_CONTEXT);
    if (context != EGL_NO_CONTEXT) eglDestroyContext(display, context);
    return fail(gl, STAGE_CONTEXT, words, error);
}

/* A surface of one pixel, because not every driver makes a context current without one. */
static int open_on(nb_gl_context *gl, EGLDisplay display, nb_gl_api api)
{
    const EGLint kinds[] = {EGL_SURFACE_TYPE, EGL_PBUFFER_BIT, EGL_RENDERABLE_TYPE,
                            api == NB_GL_API_ES ? EGL_OPENGL_ES3_BIT : EGL_OPENGL_BIT, EGL_NONE};
    const EGLint pixel[] = {EGL_WIDTH, 1, EGL_HEIGHT, 1, EGL_NONE};
    EGLConfig config;
    EGLint count = 0;
    if (display == EGL_NO_DISPLAY || !eglInitialize(display, NULL, NULL))
        return fail(gl, STAGE_DISPLAY, "no display of EGL starts", eglGetError());
    if (!eglBindAPI(api == NB_GL_API_ES ? EGL_OPENGL_ES_API : EGL_OPENGL_API) ||
        !eglChooseConfig(display, kinds, &config, 1, &count) || count < 1) {
        return fail(gl, STAGE_CONFIG,
                    api == NB_GL_API_ES ? "EGL offers no OpenGL ES 3.0" : "EGL offers no OpenGL but OpenGL ES",
                    eglGetError());
    }
    gl->display = display;
    gl->surface = eglCreatePbufferSurface(display, config, pixel);
    if (gl->surface == EGL_NO_SURFACE)
        return fail(gl, STAGE_SURFACE, "EGL makes no surface off the screen", eglGetError());
    gl->context = make_context(display, config, api);
    if (gl->context != EGL_NO_CONTEXT && eglMakeCurrent(display, gl->surface, gl->surface, gl->context) &&
        (api != NB_GL_API_FIXED || has_fixed_pipeline())) {
        return 0;
    }
    (void)fail_context(gl, display, config, api);
    if (gl->context != EGL_NO_CONTEXT) eglDestroyContext(display, gl->context);
    eglDestroySurface(display, gl->surface);
    return -1;
}

static int open_on_any(nb_gl_context *gl, nb_gl_api api)
{
    EGLDisplay displays[DEVICES_MOST + 2];
    const int count = list_displays(displays);
    for (int i = 0; i < count; i++) {
        if (open_on(gl, displays[i], api) != 0) continue;
        (void)snprintf(gl->renderer, sizeof gl->renderer, "%s, %s", (const char *)glGetString(GL_RENDERER),
                       (const char *)glGetString(GL_VERSION));
        return 0;
    }
    return -1;
}

/* The first of the APIs that can be had. */
static int open_one(nb_gl_context *gl, const nb_gl_api *apis, int count)
{
    *gl = (nb_gl_context){.stage = STAGE_NONE};
    if (!epoxy_has_egl()) {
        (void)snprintf(gl->fault, sizeof gl->fault,
                       "there is no EGL; install a driver, or Mesa's software (Debian: libegl1 libgl1-mesa-dri)");
        return -1;
    }
    for (int i = 0; i < count; i++) {
        if (open_on_any(gl, apis[i]) == 0) return 0;
        (void)snprintf(gl->no_desktop, sizeof gl->no_desktop, "%s", gl->fault);
    }
    const size_t used = strlen(gl->fault);
    (void)snprintf(gl->fault + used, sizeof gl->fault - used,
                   "; update the driver, or install Mesa's software (Debian: libegl1 libgl1-mesa-dri)");
    return -1;
}

int nb_gl_context_open(nb_gl_context *gl, nb_gl_api api)
{
    return open_one(gl, &api, 1);
}

int nb_gl_context_open_any(nb_gl_context *gl)
{
    static const nb_gl_api apis[] = {NB_GL_API_DESKTOP, NB_GL_API_ES};
    return open_one(gl, apis, 2);
}

/* The display stays: to terminate it would unload the driver for everyone else in the process. */
void nb_gl_context_close(nb_gl_context *gl)
{
    eglMakeCurrent(gl->display, EGL_NO_SURFACE, EGL_NO_SURFACE, EGL_NO_CONTEXT);
    eglDestroyContext(gl->display, gl->context);
    eglDestroySurface(gl->display, gl->surface);
}
