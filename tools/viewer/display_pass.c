#include "display_pass.h"

#include <nebel/render.h>

#include <epoxy/gl.h>

#include "gl_quad.h"

#include <math.h>

/* The curve is that of nebel_tone_map, none where nebel_encode_srgb takes its place, so that the window shows what `nebel render` writes. Transmittance is shown as
 * it is, depth on a scale that goes from white here to black far away. */
static const char show_text[] =
    "uniform sampler2D drawn_texture, traced_texture;\n"
    "uniform vec2 size;\n"
    "uniform float light, split, gain, range;\n"
    "uniform int plane, compare, stored;\n"
    "out vec4 color;\n"
    "vec3 encode(vec3 x)\n"
    "{\n"
    "    vec3 power = 1.055 * pow(max(x, 0.0031308), vec3(1.0 / 2.4)) - 0.055;\n"
    "    return min(mix(power, 12.92 * x, lessThanEqual(x, vec3(0.0031308))), 1.0);\n"
    "}\n"
    "vec3 show(vec3 value)\n"
    "{\n"
    "    if (plane == 1) return clamp(value, 0.0, 1.0);\n"
    "    if (plane == 3) return vec3(range / (range + max(value, 0.0)));\n"
    "    vec3 x = clamp(value * light, 0.0, 65504.0);\n"
    "    if (stored != 0) return encode(x);\n"
    "    return encode(x * (x + 0.114967742) / (x * (x + 0.394193548) + 0.191612903));\n"
    "}\n"
    /* Pixel for pixel where the picture has as many, so that bright neighbours leave no trace. */
    "vec3 read(sampler2D picture, vec2 at)\n"
    "{\n"
    "    ivec2 have = textureSize(picture, 0);\n"
    "    return have == ivec2(size) ? texelFetch(picture, ivec2(at), 0).rgb : texture(picture, at / size).rgb;\n"
    "}\n"
    /* The ordered dither with which pictures are written (B. Bayer 1973), rows counted from the top as there. */
    "float threshold(ivec2 at)\n"
    "{\n"
    "    int a = at.x ^ at.y, rank = 0;\n"
    "    for (int bit = 0; bit < 3; bit++) rank = rank << 2 | (a >> bit & 1) << 1 | (at.y >> bit & 1);\n"
    "    return (float(rank) + 0.5) / 64.0;\n"
    "}\n"
    "void main()\n"
    "{\n"
    "    vec2 at = gl_FragCoord.xy;\n"
    "    vec3 drawn = show(read(drawn_texture, at));\n"
    "    vec3 traced = show(read(traced_texture, vec2(at.x, size.y - at.y)));\n"
    "    vec3 shown = drawn;\n"
    "    if (compare == 1 && at.x < split * size.x) shown = traced;\n"
    "    if (compare == 1 && abs(at.x - split * size.x) < 1.0) shown = vec3(1.0, 0.75, 0.2);\n"
    "    if (compare == 2) shown = min(abs(drawn - traced) * gain, 1.0);\n"
    "    if (compare == 3) shown = traced;\n"
    "    color = vec4(floor(shown * 255.0 + threshold(ivec2(at.x, size.y - at.y))) / 255.0, 1.0);\n"
    "}\n";

nebel_result nb_screen_open(const nebel_log *log, nb_display_pass *screen)
{
    const nebel_result result = nb_program_make(show_text, log, &screen->program);
    if (result != NEBEL_OK) return result;
    glGenVertexArrays(1, &screen->array);
    glGenTextures(1, &screen->cpu_texture);
    nb_screen_set_cpu(screen, 1, 1, (const float[3]){0, 0, 0});
    return NEBEL_OK;
}

void nb_screen_close(nb_display_pass *screen)
{
    if (screen->program == 0) return;
    glDeleteProgram(screen->program);
    glDeleteVertexArrays(1, &screen->array);
    glDeleteTextures(1, &screen->cpu_texture);
    *screen = (nb_display_pass){0};
}

void nb_screen_set_cpu(nb_display_pass *screen, uint32_t width, uint32_t height, const float *rgb)
{
    glActiveTexture(GL_TEXTURE0);
    glBindTexture(GL_TEXTURE_2D, screen->cpu_texture);
    glPixelStorei(GL_UNPACK_ALIGNMENT, 4);
    glTexImage2D(GL_TEXTURE_2D, 0, GL_RGB32F, (GLsizei)width, (GLsizei)height, 0, GL_RGB, GL_FLOAT, rgb);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAX_LEVEL, 0);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_LINEAR);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_S, GL_CLAMP_TO_EDGE);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_T, GL_CLAMP_TO_EDGE);
}

static void set(const nb_display_pass *screen, const char *name, double value)
{
    glUniform1f(glGetUniformLocation(screen->program, name), (GLfloat)value);
}

void nb_screen_draw(const nb_display_pass *screen, unsigned gl_texture, int has_cpu, const nb_display *look,
                    uint32_t width, uint32_t height)
{
    glBindFramebuffer(GL_FRAMEBUFFER, 0);
    glViewport(0, 0, (GLsizei)width, (GLsizei)height);
    glUseProgram(screen->program);
    glUniform2f(glGetUniformLocation(screen->program, "size"), (GLfloat)width, (GLfloat)height);
    set(screen, "light", exp2(look->exposure));
    set(screen, "split", look->split);
    set(screen, "gain", look->gain);
    set(screen, "range", look->range);
    glUniform1i(glGetUniformLocation(screen->program, "plane"), (GLint)look->plane);
    glUniform1i(glGetUniformLocation(screen->program, "stored"), nebel_method_blends_stored(look->method));
    glUniform1i(glGetUniformLocation(screen->program, "compare"), has_cpu ? (GLint)look->compare : 0);
    nb_program_bind(screen->program, "drawn_texture", 0, gl_texture);
    nb_program_bind(screen->program, "traced_texture", 1, screen->cpu_texture);
    glBindVertexArray(screen->array);
    glDrawArrays(GL_TRIANGLES, 0, 3);
}
