/* A host's own shader with nebel's text, reading what nebel_gl_get_fog_resources hands out, gives the pixels of the pass; and the
 * C words lie as the driver wants them. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "pass_help.h"

#include <epoxy/gl.h>

static const range usual = {-1, 0};

/* ---- the host's program ---------------------------------------------------------------------- */

static unsigned make_program(const nebel_gl_fog_resources *fog, int es)
{
    const char *const version = es ? "#version 300 es\n" : "#version 330 core\n";
    const char *const vertex[] = {version, "void main() { gl_Position = vec4(float(gl_VertexID & 1) * 4.0 - 1.0, "
                                           "float(gl_VertexID >> 1) * 4.0 - 1.0, 0.0, 1.0); }\n"};
    const char *const main_text =
        "uniform highp sampler2D depth;\n"
        "uniform int columns, size;\n"
        "layout(location = 0) out highp vec4 first;\n"
        "layout(location = 1) out highp vec4 second;\n"
        "void main()\n"
        "{\n"
        "    nebel_view_ray s = nebel_make_view_ray(gl_FragCoord.xy, texelFetch(depth, ivec2(gl_FragCoord.xy), 0).x);\n"
        "#ifdef NEBEL_TILES\n"
        "    int tile = int(gl_FragCoord.x) / size + int(gl_FragCoord.y) / size * columns;\n"
        "    nebel_transfer l = nebel_trace_list(s.origin, s.direction, s.t_max, NEBEL_TILE_ENTRY(2 * tile), "
        "NEBEL_TILE_ENTRY(2 "
        "* "
        "tile + 1));\n"
        "#else\n"
        "    nebel_transfer l = nebel_trace(s.origin, s.direction, s.t_max);\n"
        "#endif\n"
        "    first = vec4(l.in_scattering, 1.0);\n"
        "    second = vec4(l.transmittance, 1.0);\n"
        "}\n";
    char defines[256];
    snprintf(defines, sizeof defines, "#define NEBEL_VIEW\n#define NEBEL_FEATURES %u\n%s%s", fog->features,
             fog->texture ? "#define NEBEL_FOG_TEXTURE\n" : "", fog->tiles ? "#define NEBEL_TILES\n" : "");
    const char *const fragment[] = {
        version, defines, nebel_get_shader_source(es ? NEBEL_DIALECT_GLSL_300_ES : NEBEL_DIALECT_GLSL_330), main_text};
    const unsigned program = glCreateProgram();
    pass_attach(program, GL_VERTEX_SHADER, 2, vertex);
    pass_attach(program, GL_FRAGMENT_SHADER, 4, fragment);
    pass_link(program);
    return program;
}

/* ---- the words, as the driver wants them ----------------------------------------------------- */

static void check_block(unsigned program)
{
    const char *const name = "nebel_texels[0]";
    const unsigned block = glGetUniformBlockIndex(program, "nebel_fog_block");
    GLuint index = GL_INVALID_INDEX;
    GLint size = 0, offset = -1, stride = 0, length = 0;
    assert_true(block != GL_INVALID_INDEX);
    glGetUniformIndices(program, 1, &name, &index);
    assert_true(index != GL_INVALID_INDEX);
    glGetActiveUniformBlockiv(program, block, GL_UNIFORM_BLOCK_DATA_SIZE, &size);
    glGetActiveUniformsiv(program, 1, &index, GL_UNIFORM_OFFSET, &offset);
    glGetActiveUniformsiv(program, 1, &index, GL_UNIFORM_ARRAY_STRIDE, &stride);
    glGetActiveUniformsiv(program, 1, &index, GL_UNIFORM_SIZE, &length);
    assert_int_equal(size, NEBEL_BLOCK_TEXELS * sizeof(nebel_texel_f32));
    assert_int_equal(offset, 0);
    assert_int_equal(stride, sizeof(nebel_texel_f32));
    assert_int_equal(length, NEBEL_BLOCK_TEXELS);
    glUniformBlockBinding(program, block, 3);
}

/* ---- drawing --------------------------------------------------------------------------------- */

static float own[2][4 * PASS_PIXELS], theirs[2][4 * PASS_PIXELS];

static void bind(unsigned program, const char *name, int unit, unsigned texture)
{
    glUniform1i(glGetUniformLocation(program, name), unit);
    glActiveTexture((GLenum)(GL_TEXTURE0 + unit));
    glBindTexture(GL_TEXTURE_2D, texture);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_NEAREST);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, GL_NEAREST);
}

static void draw_own(const nebel_gl_fog_resources *fog, const nebel_view *view, unsigned depth, int es)
{
    nebel_rays rays;
    unsigned array;
    const unsigned program = make_program(fog, es);
    assert_int_equal(nebel_compute_view_rays(view, NULL, &rays), NEBEL_OK);
    glGenVertexArrays(1, &array);
    glBindVertexArray(array);
    glUseProgram(program);
    glUniform4fv(glGetUniformLocation(program, "nebel_rays"), NEBEL_RAY_TEXELS, rays.texels[0].v);
    glUniform1i(glGetUniformLocation(program, "columns"), (GLint)fog->tile_columns);
    glUniform1i(glGetUniformLocation(program, "size"), (GLint)fog->tile_size);
    bind(program, "depth", 5, depth);
    if (fog->texture != 0) bind(program, "nebel_fog_texture", 6, fog->texture);
    if (fog->tiles != 0) bind(program, "nebel_tile_texture", 7, fog->tiles);
    if (fog->block != 0) {
        check_block(program);
        glBindBufferBase(GL_UNIFORM_BUFFER, 3, fog->block);
    }
    glViewport(0, 0, PASS_WIDTH, PASS_HEIGHT);
    glDrawArrays(GL_TRIANGLES, 0, 3);
    glUseProgram(0);
    glDeleteProgram(program);
    glDeleteVertexArrays(1, &array);
}

static void check(int es, int volumes)
{
    nb_gl context;
    nebel_gl *gl = NULL;
    nebel_gl_fog_resources stored_fog;
    pass_open(&context, es ? NB_GL_300ES : NB_GL_330);
    nebel_lighting *const fog = pass_fog(volumes);
    pass_picture picture = {.view = pass_view(PERSPECTIVE, usual, .3, -.1), .clip = usual};
    pass_fill(&picture);
    const unsigned depth = pass_depth_texture(PASS_WIDTH, PASS_HEIGHT, picture.stored);
    const unsigned targets[] = {pass_color_texture(PASS_WIDTH, PASS_HEIGHT, 4, NULL),
                                pass_color_texture(PASS_WIDTH, PASS_HEIGHT, 4, NULL)};
    (void)pass_framebuffer(targets[0], targets[1]);
    assert_int_equal(nebel_create_gl(&(nebel_gl_desc){0}, &gl), NEBEL_OK);
    assert_int_equal(nebel_gl_set_fog(gl, fog, &picture.view), NEBEL_OK);
    assert_int_equal(nebel_gl_draw_fog(gl, &(nebel_gl_pass){.output = NEBEL_GL_OUTPUT_SPLIT, .depth_texture = depth}),
                     NEBEL_OK);
    for (int i = 0; i < 2; i++) pass_read(targets[i], PASS_WIDTH, PASS_HEIGHT, theirs[i]);
    assert_int_equal(nebel_gl_get_fog_resources(gl, &stored_fog), NEBEL_OK);
    draw_own(&stored_fog, &picture.view, depth, es);
    for (int i = 0; i < 2; i++) pass_read(targets[i], PASS_WIDTH, PASS_HEIGHT, own[i]);
    for (int i = 0; i < 2; i++) {
        for (int k = 0; k < 4 * PASS_PIXELS; k++) assert_true(fabs((double)(own[i][k] - theirs[i][k])) < 2e-6);
    }
    assert_true(theirs[0][0] > 0);
    nebel_destroy_gl(gl);
    nebel_release_lighting(fog);
    pass_close(&context);
}

static void test_a_shader_of_the_host_gives_the_same_fog(void **state)
{
    (void)state;
    for (int es = 0; es < 2; es++) {
        check(es, -1);
        check(es, 0);
        check(es, 200);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_a_shader_of_the_host_gives_the_same_fog),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
