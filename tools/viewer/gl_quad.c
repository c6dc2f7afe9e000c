#include "gl_quad.h"

#include <epoxy/gl.h>
#include <stdio.h>

static const char vertex_text[] = "void main()\n"
                                  "{\n"
                                  "    vec2 corner = vec2(gl_VertexID & 1, gl_VertexID >> 1) * 4.0 - 1.0;\n"
                                  "    gl_Position = vec4(corner, 0.0, 1.0);\n"
                                  "}\n";

static nebel_result fail(const nebel_log *log, const char *words)
{
    char message[600];
    (void)snprintf(message, sizeof message, "the driver does not take a shader of the window: %.500s", words);
    log->write(NEBEL_LOG_ERROR, NEBEL_ERROR_UNSUPPORTED, message, log->user);
    return NEBEL_ERROR_UNSUPPORTED;
}

static nebel_result attach(unsigned program, GLenum kind, const char *text, const nebel_log *log)
{
    const char *const texts[] = {"#version 330 core\n", text};
    const GLuint shader = glCreateShader(kind);
    GLint compiled = 0;
    char words[512] = "";
    glShaderSource(shader, 2, texts, NULL);
    glCompileShader(shader);
    glGetShaderiv(shader, GL_COMPILE_STATUS, &compiled);
    glGetShaderInfoLog(shader, sizeof words, NULL, words);
    glAttachShader(program, shader);
    glDeleteShader(shader);
    return compiled ? NEBEL_OK : fail(log, words);
}

static nebel_result link(unsigned program, const nebel_log *log)
{
    GLint linked = 0;
    char words[512] = "";
    glLinkProgram(program);
    glGetProgramiv(program, GL_LINK_STATUS, &linked);
    glGetProgramInfoLog(program, sizeof words, NULL, words);
    return linked ? NEBEL_OK : fail(log, words);
}

nebel_result nb_program_make(const char *fragment, const nebel_log *log, unsigned *program)
{
    *program = glCreateProgram();
    nebel_result result = attach(*program, GL_VERTEX_SHADER, vertex_text, log);
    if (result == NEBEL_OK) result = attach(*program, GL_FRAGMENT_SHADER, fragment, log);
    if (result == NEBEL_OK) result = link(*program, log);
    if (result == NEBEL_OK) return NEBEL_OK;
    glDeleteProgram(*program);
    *program = 0;
    return result;
}

void nb_program_bind(unsigned program, const char *sampler, int unit, unsigned texture)
{
    glActiveTexture((GLenum)(GL_TEXTURE0 + unit));
    glBindTexture(GL_TEXTURE_2D, texture);
    glUniform1i(glGetUniformLocation(program, sampler), unit);
}
