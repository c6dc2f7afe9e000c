/* Crowds in a host's own shader: more volumes of different light in one place than NEBEL_MAX_ITERATIONS has turns of loops
 * for. What comes out then is what docs/shaders.md promises. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "fog_help.h"
#include "pass_help.h"

#include <epoxy/gl.h>

enum { MOST = 1000, GAUSSIAN = 0, PARTS = 1, EVEN = 2, HOLED = 3 };

/* Balls of every colour around one place, Gaussian ones; of PARTS half are unions, of EVEN all have a constant density; of
 * HOLED, too, and the last excludes the others. */
static nebel_lighting *make_crowd(int count, int kind)
{
    static nebel_volume_desc volumes[MOST];
    static nebel_shape pieces[MOST][2];
    uint64_t state = 9;
    for (int i = 0; i < count; i++) {
        nebel_volume_desc *const v = &volumes[i];
        *v = (nebel_volume_desc){.density = {.sigma = dice(&state, 1, 2)}};
        v->density.type = kind >= EVEN ? NEBEL_DENSITY_CONSTANT : NEBEL_DENSITY_GAUSSIAN;
        nebel_shape ball = {.type = NEBEL_SHAPE_SPHERE, .radius = dice(&state, 3, 5)};
        for (int k = 0; k < 3; k++) {
            ball.center[k] = pass_eye[k] + (k == 2 ? -12 : 0) + dice(&state, -2, 2);
            v->density.center[k] = ball.center[k];
            v->extinction[k] = dice(&state, .002, .02);
            v->source[k] = dice(&state, 0, 1);
        }
        v->shape = ball;
        if (kind != PARTS || i % 2 == 0) continue;
        pieces[i][0] = pieces[i][1] = ball;
        pieces[i][1].center[0] += 1;
        v->shape = (nebel_shape){.type = NEBEL_SHAPE_UNION, .parts = pieces[i], .part_count = 2};
    }
    if (kind == HOLED) {
        volumes[count - 1].operation = NEBEL_OPERATION_EXCLUDE;
        volumes[count - 1].shape.radius = 1;
    }
    return fog_light(NULL, volumes, (size_t)count);
}

typedef struct split {
    float in_scattering[4 * PASS_PIXELS], transmittance[4 * PASS_PIXELS];
} split;

/* A host's shader that says how many turns there are, as many as nebel/gl.h finds on llvmpipe. */
static unsigned make_program(const nebel_gl_fog_resources *fog)
{
    const char *const vertex = "#version 330 core\n"
                               "void main() { gl_Position = vec4(float(gl_VertexID & 1) * 4.0 - 1.0, "
                               "float(gl_VertexID >> 1) * 4.0 - 1.0, 0.0, 1.0); }\n";
    const char *const main_text =
        "uniform sampler2D depth;\n"
        "layout(location = 0) out vec4 first;\n"
        "layout(location = 1) out vec4 second;\n"
        "void main()\n"
        "{\n"
        "    nebel_view_ray s = nebel_make_view_ray(gl_FragCoord.xy, texelFetch(depth, ivec2(gl_FragCoord.xy), 0).x);\n"
        "    nebel_transfer l = nebel_trace(s.origin, s.direction, s.t_max);\n"
        "    first = vec4(l.in_scattering, 1.0);\n"
        "    second = vec4(l.transmittance, 1.0);\n"
        "}\n";
    char head[256];
    snprintf(head, sizeof head,
             "#version 330 core\n#define NEBEL_VIEW\n#define NEBEL_MAX_ITERATIONS 24000\n#define NEBEL_FOG_TEXTURE\n"
             "#define NEBEL_FEATURES %u\n",
             fog->features);
    const char *const fragment[] = {head, nebel_get_shader_source(NEBEL_DIALECT_GLSL_330), main_text};
    const unsigned program = glCreateProgram();
    pass_attach(program, GL_VERTEX_SHADER, 1, &vertex);
    pass_attach(program, GL_FRAGMENT_SHADER, 3, fragment);
    pass_link(program);
    return program;
}

static void bind(unsigned program, const char *name, int unit, unsigned texture)
{
    glUniform1i(glGetUniformLocation(program, name), unit);
    glActiveTexture((GLenum)(GL_TEXTURE0 + unit));
    glBindTexture(GL_TEXTURE_2D, texture);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_NEAREST);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, GL_NEAREST);
}

static void draw(nebel_lighting *lighting, const pass_picture *picture, split *out)
{
    nb_gl context;
    nebel_gl *gl = NULL;
    nebel_gl_fog_resources fog;
    nebel_rays rays;
    unsigned array;
    pass_open(&context, NB_GL_330);
    assert_int_equal(nebel_create_gl(&(nebel_gl_desc){.storage = NEBEL_GL_STORAGE_TEXTURE}, &gl), NEBEL_OK);
    const unsigned depth = pass_depth_texture(PASS_WIDTH, PASS_HEIGHT, picture->stored);
    const unsigned targets[] = {pass_color_texture(PASS_WIDTH, PASS_HEIGHT, 4, NULL),
                                pass_color_texture(PASS_WIDTH, PASS_HEIGHT, 4, NULL)};
    const unsigned framebuffer = pass_framebuffer(targets[0], targets[1]);
    assert_int_equal(nebel_gl_set_fog(gl, lighting, &picture->view), NEBEL_OK);
    assert_int_equal(nebel_gl_get_fog_resources(gl, &fog), NEBEL_OK);
    assert_int_equal(nebel_compute_view_rays(&picture->view, NULL, &rays), NEBEL_OK);
    const unsigned program = make_program(&fog);
    glGenVertexArrays(1, &array);
    glBindVertexArray(array);
    glUseProgram(program);
    glUniform4fv(glGetUniformLocation(program, "nebel_rays"), NEBEL_RAY_TEXELS, rays.texels[0].v);
    bind(program, "depth", 0, depth);
    bind(program, "nebel_fog_texture", 1, fog.texture);
    glViewport(0, 0, PASS_WIDTH, PASS_HEIGHT);
    glDrawArrays(GL_TRIANGLES, 0, 3);
    glUseProgram(0);
    glDeleteProgram(program);
    glDeleteVertexArrays(1, &array);
    pass_read(targets[0], PASS_WIDTH, PASS_HEIGHT, out->in_scattering);
    pass_read(targets[1], PASS_WIDTH, PASS_HEIGHT, out->transmittance);
    pass_delete_framebuffer(framebuffer);
    for (int i = 0; i < 2; i++) pass_delete_texture(targets[i]);
    pass_delete_texture(depth);
    nebel_destroy_gl(gl);
    pass_close(&context);
}

/* How far off light may be: `most`. The processor takes N^2 for each ray of N volumes: of many it looks at fewer. */
static void check(int count, int kind, double most)
{
    static split got;
    nebel_lighting *const fog = make_crowd(count, kind);
    pass_picture picture = {.view = pass_view(PERSPECTIVE, (range){-1, 0}, 0, 0), .clip = {-1, 0}};
    double light = 0, transmittance = 0;
    pass_fill(&picture);
    draw(fog, &picture, &got);
    for (int i = 0; i<PASS_PIXELS; i += count> 300 ? 61 : 7) {
        const nebel_transfer wanted = pass_trace(fog, &picture, i % PASS_WIDTH, i / PASS_WIDTH);
        for (int c = 0; c < 3; c++) {
            light = fmax(light, fabs((double)got.in_scattering[4 * i + c] - wanted.in_scattering[c]));
            transmittance = fmax(transmittance, fabs((double)got.transmittance[4 * i + c] - wanted.transmittance[c]));
        }
    }
    print_message("%d volumes: transmittance %.1e off, light %.1e\n", count, transmittance, light);
    assert_true(transmittance < 1e-4);
    assert_true(light < most);
    nebel_release_lighting(fog);
}

static void test_crowds_are_as_promised(void **state)
{
    (void)state;
    check(60, GAUSSIAN, 2e-4);
    check(300, GAUSSIAN, 1e-3);
    check(120, HOLED, .03);
    check(120, PARTS, .02);
    check(120, EVEN, 5e-4);
    check(MOST, EVEN, .01);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_crowds_are_as_promised),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
