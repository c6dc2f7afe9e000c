#include "gl_harness.h"

#include <epoxy/egl.h>
#include <epoxy/gl.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <stdint.h>
#include <string.h>

enum { MOST_VECTORS = 16, NAME_SIZE = 16 };

static int fault(nb_gl *gl, const char *format, ...) __attribute__((format(printf, 2, 3)));

static int fault(nb_gl *gl, const char *format, ...)
{
    va_list arguments;
    va_start(arguments, format);
    vsnprintf(gl->fault, sizeof gl->fault, format, arguments);
    va_end(arguments);
    return 0;
}

/* ---- the context ----------------------------------------------------------------------------- */

static int create_context(nb_gl *gl)
{
    const EGLint desktop[] = {
        EGL_CONTEXT_MAJOR_VERSION,           3,       EGL_CONTEXT_MINOR_VERSION, 3, EGL_CONTEXT_OPENGL_PROFILE_MASK,
        EGL_CONTEXT_OPENGL_CORE_PROFILE_BIT, EGL_NONE};
    const EGLint compatible[] = {EGL_NONE}; /* without a version, all that there is */
    const EGLint embedded[] = {EGL_CONTEXT_MAJOR_VERSION, 3, EGL_CONTEXT_MINOR_VERSION, 0, EGL_NONE};
    const EGLint *const lists[] = {desktop, embedded, compatible};
    const EGLenum api = gl->language == NB_GL_300ES ? EGL_OPENGL_ES_API : EGL_OPENGL_API;
    if (!eglBindAPI(api)) return fault(gl, "EGL has no such API");
    gl->context = eglCreateContext(gl->display, EGL_NO_CONFIG_KHR, EGL_NO_CONTEXT, lists[gl->language]);
    if (gl->context == EGL_NO_CONTEXT) return fault(gl, "eglCreateContext: error 0x%x", (unsigned)eglGetError());
    if (!eglMakeCurrent(gl->display, EGL_NO_SURFACE, EGL_NO_SURFACE, gl->context)) {
        eglDestroyContext(gl->display, gl->context);
        return fault(gl, "eglMakeCurrent without a surface: error 0x%x", (unsigned)eglGetError());
    }
    return 1;
}

/* One pixel to draw to: without a window there is no framebuffer, and drawing nothing needs one all the same. */
static void bind_framebuffer(void)
{
    unsigned framebuffer, pixel;
    glGenFramebuffers(1, &framebuffer);
    glGenRenderbuffers(1, &pixel);
    glBindRenderbuffer(GL_RENDERBUFFER, pixel);
    glRenderbufferStorage(GL_RENDERBUFFER, GL_RGBA8, 1, 1);
    glBindFramebuffer(GL_FRAMEBUFFER, framebuffer);
    glFramebufferRenderbuffer(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_RENDERBUFFER, pixel);
}

/* The display belongs to the process and is never terminated: that would unload the driver, and a leak checker would
 * report what the driver allocates once. */
int nb_gl_open(nb_gl *gl, nb_gl_language language)
{
    *gl = (nb_gl){.language = language};
    if (!epoxy_has_egl_extension(EGL_NO_DISPLAY, "EGL_MESA_platform_surfaceless"))
        return fault(gl, "EGL has no surfaceless platform: install Mesa (libegl-mesa0)");
    gl->display = eglGetPlatformDisplayEXT(EGL_PLATFORM_SURFACELESS_MESA, EGL_DEFAULT_DISPLAY, NULL);
    if (gl->display == EGL_NO_DISPLAY || !eglInitialize(gl->display, NULL, NULL))
        return fault(gl, "EGL can not be initialized");
    if (!create_context(gl)) return 0;
    bind_framebuffer();
    return 1;
}

void nb_gl_close(nb_gl *gl)
{
    eglMakeCurrent(gl->display, EGL_NO_SURFACE, EGL_NO_SURFACE, EGL_NO_CONTEXT);
    eglDestroyContext(gl->display, gl->context);
}

void nb_gl_describe(char *text, size_t size)
{
    snprintf(text, size, "%s, %s, %s", (const char *)glGetString(GL_VENDOR), (const char *)glGetString(GL_RENDERER),
             (const char *)glGetString(GL_VERSION));
}

/* ---- the source ------------------------------------------------------------------------------ */

/* A text that grows; `text` is NULL once memory or a file has failed. */
typedef struct source {
    char *text;
    size_t size;
} source;

static void append(source *s, const char *text, size_t size)
{
    char *grown = s->text ? realloc(s->text, s->size + size + 1) : NULL;
    if (!grown) {
        free(s->text);
        s->text = NULL;
        return;
    }
    memcpy(grown + s->size, text, size);
    s->text = grown;
    s->size += size;
    s->text[s->size] = '\0';
}

static void append_text(source *s, const char *text)
{
    append(s, text, strlen(text));
}

static void append_file(nb_gl *gl, source *s, const char *name)
{
    char path[4096], block[4096];
    snprintf(path, sizeof path, "%s/src/formulas/%s", NEBEL_SOURCE, name);
    FILE *file = fopen(path, "rb");
    if (!file) {
        fault(gl, "can not read %s", path);
        free(s->text);
        s->text = NULL;
        return;
    }
    for (size_t got; (got = fread(block, 1, sizeof block, file)) > 0;) append(s, block, got);
    fclose(file);
}

static void append_formulas(nb_gl *gl, source *s)
{
    source order = {calloc(1, 1), 0};
    if (gl->language == NB_GL_300ES) append_file(gl, s, "prelude_300es.glsl");
    append_file(gl, s, "prelude_glsl.glsl");
    append_file(gl, s, "prelude_shader.glsl");
    append_file(gl, &order, "ORDER");
    for (char *name = order.text ? strtok(order.text, "\n") : NULL; name; name = strtok(NULL, "\n"))
        if (*name != '#') append_file(gl, s, name);
    free(order.text);
}

static void append_variables(source *s, const char *kind, unsigned count)
{
    char line[64];
    for (unsigned i = 0; i < count; ++i) {
        snprintf(line, sizeof line, "%s vec4 %s%u;\n", kind, kind, i);
        append_text(s, line);
    }
}

/* ---- programs -------------------------------------------------------------------------------- */

static unsigned compile_shader(nb_gl *gl, unsigned kind, const char *text)
{
    GLint good = 0;
    const unsigned shader = glCreateShader(kind);
    glShaderSource(shader, 1, &text, NULL);
    glCompileShader(shader);
    glGetShaderiv(shader, GL_COMPILE_STATUS, &good);
    if (good) return shader;
    glGetShaderInfoLog(shader, sizeof gl->fault, NULL, gl->fault);
    glDeleteShader(shader);
    return 0;
}

static int link_program(nb_gl *gl, unsigned program)
{
    static const char names[MOST_VECTORS][NAME_SIZE] = {"out0",  "out1",  "out2",  "out3", "out4",  "out5",
                                                        "out6",  "out7",  "out8",  "out9", "out10", "out11",
                                                        "out12", "out13", "out14", "out15"};
    const char *list[MOST_VECTORS];
    GLint good = 0;
    for (unsigned i = 0; i < MOST_VECTORS; ++i) list[i] = names[i];
    for (unsigned i = 0; i < gl->program_inputs; ++i) {
        char name[NAME_SIZE];
        snprintf(name, sizeof name, "in%u", i);
        glBindAttribLocation(program, i, name);
    }
    glTransformFeedbackVaryings(program, (GLsizei)gl->program_outputs, list, GL_INTERLEAVED_ATTRIBS);
    glLinkProgram(program);
    glGetProgramiv(program, GL_LINK_STATUS, &good);
    if (!good) glGetProgramInfoLog(program, sizeof gl->fault, NULL, gl->fault);
    return good;
}

/* ES wants a fragment shader in every program. */
static unsigned link_shaders(nb_gl *gl, const char *vertex_text)
{
    const char *fragment_text = gl->language == NB_GL_330
                                    ? "#version 330 core\nout vec4 color;\nvoid main() { color = vec4(0.0); }\n"
                                    : "#version 300 es\nout highp vec4 color;\nvoid main() { color = vec4(0.0); }\n";
    const unsigned vertex = compile_shader(gl, GL_VERTEX_SHADER, vertex_text);
    if (!vertex) return 0;
    const unsigned fragment = compile_shader(gl, GL_FRAGMENT_SHADER, fragment_text);
    unsigned program = fragment ? glCreateProgram() : 0;
    if (program) {
        glAttachShader(program, vertex);
        glAttachShader(program, fragment);
        if (!link_program(gl, program)) {
            glDeleteProgram(program);
            program = 0;
        }
        glDeleteShader(fragment);
    }
    glDeleteShader(vertex);
    return program;
}

/* Takes what `s` holds as the functions; frees it. */
static unsigned compile_source(nb_gl *gl, source functions, const char *body, unsigned inputs, unsigned outputs)
{
    source s = {calloc(1, 1), 0};
    if (inputs > MOST_VECTORS || outputs > MOST_VECTORS) fault(gl, "more than %d inputs or outputs", (int)MOST_VECTORS);
    const int fits = inputs <= MOST_VECTORS && outputs <= MOST_VECTORS;
    gl->program_inputs = inputs;
    gl->program_outputs = outputs;
    append_text(&s, gl->language == NB_GL_330 ? "#version 330 core\n" : "#version 300 es\n");
    append_text(&s, functions.text ? functions.text : "");
    append_variables(&s, "in", inputs);
    append_variables(&s, "out", outputs);
    append_text(&s, "\nvoid main()\n{\ngl_Position = vec4(0.0);\n");
    append_text(&s, body);
    append_text(&s, "\n}\n");
    const unsigned program = s.text && functions.text && fits ? link_shaders(gl, s.text) : 0;
    free(s.text);
    free(functions.text);
    return program;
}

unsigned nb_gl_compile(nb_gl *gl, const char *functions, const char *body, unsigned inputs, unsigned outputs)
{
    source s = {calloc(1, 1), 0};
    fault(gl, "out of memory");
    append_formulas(gl, &s);
    append_text(&s, functions);
    return compile_source(gl, s, body, inputs, outputs);
}

unsigned nb_gl_compile_texts(nb_gl *gl, const char *const *texts, const char *body, unsigned inputs, unsigned outputs)
{
    source s = {calloc(1, 1), 0};
    fault(gl, "out of memory");
    for (; *texts; ++texts) append_text(&s, *texts);
    return compile_source(gl, s, body, inputs, outputs);
}

/* ---- evaluation ------------------------------------------------------------------------------ */

static void bind_inputs(unsigned buffer, unsigned inputs, size_t count, const float *values)
{
    const size_t stride = inputs * 4 * sizeof *values;
    glBindBuffer(GL_ARRAY_BUFFER, buffer);
    glBufferData(GL_ARRAY_BUFFER, (GLsizeiptr)(count * stride), values, GL_STATIC_DRAW);
    for (unsigned i = 0; i < inputs; ++i) {
        glEnableVertexAttribArray(i);
        const uintptr_t offset = i * 4 * sizeof *values; /* into the bound buffer, dressed as a pointer */
        glVertexAttribPointer(i, 4, GL_FLOAT, GL_FALSE, (GLsizei)stride, (const void *)offset);
    }
}

static void draw_points(unsigned program, size_t count)
{
    glUseProgram(program);
    glEnable(GL_RASTERIZER_DISCARD);
    glBeginTransformFeedback(GL_POINTS);
    glDrawArrays(GL_POINTS, 0, (GLsizei)count);
    glEndTransformFeedback();
    glDisable(GL_RASTERIZER_DISCARD);
    glFinish();
}

int nb_gl_evaluate(nb_gl *gl, unsigned program, size_t count, const float *inputs, float *outputs)
{
    const size_t size = count * gl->program_outputs * 4 * sizeof *outputs;
    unsigned array, buffers[2];
    glGenVertexArrays(1, &array);
    glGenBuffers(2, buffers);
    glBindVertexArray(array);
    bind_inputs(buffers[0], gl->program_inputs, count, inputs);
    glBindBuffer(GL_TRANSFORM_FEEDBACK_BUFFER, buffers[1]);
    glBufferData(GL_TRANSFORM_FEEDBACK_BUFFER, (GLsizeiptr)size, NULL, GL_STATIC_READ);
    glBindBufferBase(GL_TRANSFORM_FEEDBACK_BUFFER, 0, buffers[1]);
    draw_points(program, count);
    const void *result = glMapBufferRange(GL_TRANSFORM_FEEDBACK_BUFFER, 0, (GLsizeiptr)size, GL_MAP_READ_BIT);
    if (result) {
        memcpy(outputs, result, size);
        glUnmapBuffer(GL_TRANSFORM_FEEDBACK_BUFFER);
    }
    glDeleteBuffers(2, buffers);
    glDeleteVertexArrays(1, &array);
    const unsigned error = glGetError();
    if (error || !result) return fault(gl, "OpenGL error 0x%x", error);
    return 1;
}
