/* A small OpenGL 3.3 engine that knows nothing of fog: a sky, the ground, some boxes and a camera that turns around
 * them. It stands for yours in embed_glfw.c, embed_sdl.c and
 * embed_particles.c. */
#ifndef ENGINE_H
#define ENGINE_H

#include <epoxy/gl.h>
#include <math.h>
#include <stdio.h>

enum { WIDTH = 640, HEIGHT = 400 };

typedef struct engine {
    unsigned program, array, framebuffer, color, depth;   /* no framebuffer: it draws into the window */
    double eye[3], eye_from_world[16], clip_from_eye[16]; /* matrices column by column, as OpenGL has them */
} engine;

/* 36 corners a box, without a buffer. `place` is relative to the eye, along the axes of the world. */
static const char *const engine_vertex_text =
    "#version 330 core\n"
    "const vec4 boxes[5] = vec4[](vec4(0, 0, 0, 1e6), vec4(0, -200, 0, 200), vec4(-4, 1.5, 0, 1.5),\n"
    "                             vec4(3, 2, -3, 2), vec4(-9, 6, -22, 6));\n"
    "const vec3 colors[5] = vec3[](vec3(.25, .45, .8), vec3(.12, .2, .06), vec3(.5, .1, .08), vec3(.5, .3, .1),\n"
    "                              vec3(.3, .3, .3));\n"
    "uniform mat4 eye_from_world, clip_from_eye;\n"
    "uniform vec3 eye;\n"
    "flat out vec3 color;\n"
    "out vec3 place;\n"
    "void main()\n"
    "{\n"
    "    int box = gl_InstanceID, axis = gl_VertexID / 6 % 3, corner = int[](0, 1, 2, 2, 1, 3)[gl_VertexID % 6];\n"
    "    vec3 p, normal = vec3(0);\n"
    "    normal[axis] = p[axis] = gl_VertexID < 18 ? 1.0 : -1.0;\n"
    "    p[(axis + 1) % 3] = float(corner & 1) * 2.0 - 1.0;\n"
    "    p[(axis + 2) % 3] = float(corner >> 1) * 2.0 - 1.0;\n"
    "    place = boxes[box].xyz + boxes[box].w * p - eye;\n"
    "    color = colors[box] * (box == 0 ? 1.0 : .6 + dot(normal, vec3(.1, .4, .2)));\n"
    "    gl_Position = clip_from_eye * vec4(mat3(eye_from_world) * place, 1.0);\n"
    "    if (box == 0) gl_Position.z = gl_Position.w;\n" /* the sky is at the far plane */
    "}\n";

static inline void engine_add_shader(unsigned program, GLenum kind, int count, const char *const *texts)
{
    char words[1024];
    GLint good;
    const unsigned shader = glCreateShader(kind);
    glShaderSource(shader, count, texts, NULL);
    glCompileShader(shader);
    glGetShaderiv(shader, GL_COMPILE_STATUS, &good);
    glGetShaderInfoLog(shader, sizeof words, NULL, words);
    if (!good) fprintf(stderr, "%s\n", words);
    glAttachShader(program, shader);
}

/* With the fragment shader made of these texts; it reads `color` and `place`. */
static inline engine engine_open(int count, const char *const *fragment_texts)
{
    engine e = {.program = glCreateProgram()};
    engine_add_shader(e.program, GL_VERTEX_SHADER, 1, &engine_vertex_text);
    engine_add_shader(e.program, GL_FRAGMENT_SHADER, count, fragment_texts);
    glLinkProgram(e.program);
    glGenVertexArrays(1, &e.array);
    glDepthFunc(GL_LEQUAL);
    return e;
}

static inline unsigned engine_attach(GLenum attachment, GLenum format, GLenum components)
{
    unsigned texture;
    glGenTextures(1, &texture);
    glBindTexture(GL_TEXTURE_2D, texture);
    glTexImage2D(GL_TEXTURE_2D, 0, (GLint)format, WIDTH, HEIGHT, 0, components, GL_FLOAT, NULL);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_NEAREST);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, GL_NEAREST);
    glFramebufferTexture2D(GL_FRAMEBUFFER, attachment, GL_TEXTURE_2D, texture, 0);
    return texture;
}

/* With colours as they are, in linear light, into a colour and a depth texture. */
static inline engine engine_open_textures(void)
{
    static const char *const text = "#version 330 core\n"
                                    "flat in vec3 color;\n"
                                    "out vec4 pixel;\n"
                                    "void main() { pixel = vec4(color, 1.0); }\n";
    engine e = engine_open(1, &text);
    glGenFramebuffers(1, &e.framebuffer);
    glBindFramebuffer(GL_FRAMEBUFFER, e.framebuffer);
    e.color = engine_attach(GL_COLOR_ATTACHMENT0, GL_RGBA16F, GL_RGBA);
    e.depth = engine_attach(GL_DEPTH_ATTACHMENT, GL_DEPTH_COMPONENT32F, GL_DEPTH_COMPONENT);
    return e;
}

/* Stands 10 m from the middle, 2 m high, and looks level through it. */
static inline void engine_turn(engine *e, double angle)
{
    const double c = cos(angle), s = sin(angle), near = .1, far = 1000, zoom = 1.5;
    const double eye_from_world[16] = {c, 0, -s, 0, 0, 1, 0, 0, s, 0, c, 0, 0, -2, -10, 1};
    const double clip_from_eye[16] = {
        zoom * HEIGHT / WIDTH,         0, 0, 0, 0, zoom, 0, 0, 0, 0, (near + far) / (near - far), -1, 0, 0,
        2 * near * far / (near - far), 0};
    for (int i = 0; i < 16; i++) e->eye_from_world[i] = eye_from_world[i], e->clip_from_eye[i] = clip_from_eye[i];
    e->eye[0] = -10 * s, e->eye[1] = 2, e->eye[2] = 10 * c;
}

static inline void engine_set_matrix(unsigned program, const char *name, const double m[16])
{
    float narrow[16];
    for (int i = 0; i < 16; i++) narrow[i] = (float)m[i];
    glUniformMatrix4fv(glGetUniformLocation(program, name), 1, GL_FALSE, narrow);
}

static inline void engine_draw(const engine *e)
{
    glBindFramebuffer(GL_FRAMEBUFFER, e->framebuffer);
    glUseProgram(e->program);
    engine_set_matrix(e->program, "eye_from_world", e->eye_from_world);
    engine_set_matrix(e->program, "clip_from_eye", e->clip_from_eye);
    glUniform3f(glGetUniformLocation(e->program, "eye"), (float)e->eye[0], (float)e->eye[1], (float)e->eye[2]);
    glBindVertexArray(e->array);
    glEnable(GL_DEPTH_TEST);
    glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
    glDrawArraysInstanced(GL_TRIANGLES, 0, 36, 5);
}

#endif
