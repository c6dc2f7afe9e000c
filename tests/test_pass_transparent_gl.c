/* Transparent surfaces of every mode, drawn from the back to the front over a fogged frame, against layered transport:
 * light carried from the background to the eye in double, which knows no frame buffer. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "fog_help.h"
#include "pass_help.h"

#include <epoxy/gl.h>

enum { LAYERS = 7, STACKS = 6, MEDIUM = NEBEL_BLEND_COUNT, MODES };

/* How source and factor reach the pixel. */
typedef enum path {
    TWO_OUTPUTS,
    GREY,  /* one output: coloured factors are left out */
    TWICE, /* first the factor, then the source */
    PATHS
} path;

/* All around the eye. MEDIUM: alpha is not read, `light` is added. */
typedef struct surface {
    int mode;
    float color[3], light[3], alpha, distance;
} surface;

/* ---- the truth ------------------------------------------------------------------------------- */

static double cover(const surface *s, int c, double behind)
{
    const double color = (double)s->color[c], alpha = (double)s->alpha;
    switch (s->mode) {
    case NEBEL_BLEND_OVER:
        return alpha * color + (1 - alpha) * behind;
    case NEBEL_BLEND_PREMULTIPLIED:
        return color + (1 - alpha) * behind;
    case NEBEL_BLEND_ADDITIVE:
        return color + behind;
    case NEBEL_BLEND_MULTIPLY:
        return color * behind;
    case NEBEL_BLEND_SCREEN:
        return color + (1 - color) * behind;
    default:
        return (double)s->light[c] + color * behind;
    }
}

static nebel_transfer trace_between(const nebel_lighting *fog, const line *way, double from, double to)
{
    nebel_ray ray = {.t_max = to - from};
    nebel_transfer transfer;
    for (int i = 0; i < 3; i++) {
        ray.direction[i] = (double)way->direction[i];
        ray.origin[i] = (double)way->origin[i] + from * ray.direction[i];
    }
    fog_trace(fog, (nebel_trace_desc){.tolerance = 1e-6}, 1, &ray, &transfer);
    return transfer;
}

/* surfaces[0] is nearest; what is not before `end` is hidden. */
static void carry_light(const nebel_lighting *fog, const line *way, const surface *surfaces, double end,
                        double light[3])
{
    double far = end;
    for (int i = LAYERS; i >= 0; i--) {
        const double near = i > 0 ? (double)surfaces[i - 1].distance : 0;
        if (near >= end) continue;
        const nebel_transfer between = trace_between(fog, way, near, far);
        for (int c = 0; c < 3; c++) {
            light[c] = between.transmittance[c] * light[c] + between.in_scattering[c];
            if (i > 0) light[c] = cover(&surfaces[i - 1], c, light[c]);
        }
        far = near;
    }
}

/* ---- the host -------------------------------------------------------------------------------- */

static const char fragment_text[] =
    "uniform highp sampler2D depth;\n"
    "uniform int mode, stage;\n"
    "uniform highp vec4 surface_color;\n" /* and alpha */
    "uniform highp vec4 surface_light;\n" /* and distance */
    "#if PATH == 0\n"
    "layout(location = 0, index = 0) out vec4 source;\n"
    "layout(location = 0, index = 1) out vec4 factor;\n"
    "#else\n"
    "layout(location = 0) out highp vec4 source;\n"
    "#endif\n"
    "nebel_blend blend_of(nebel_transfer fog)\n"
    "{\n"
    "    vec3 color = surface_color.rgb;\n"
    "    nebel_transfer medium;\n"
    "    medium.transmittance = color;\n"
    "    medium.in_scattering = surface_light.rgb;\n"
    "    if (mode == 0) return nebel_blend_over(color, surface_color.a, fog);\n"
    "    if (mode == 1) return nebel_blend_premultiplied(color, surface_color.a, fog);\n"
    "    if (mode == 2) return nebel_blend_additive(color, fog);\n"
    "    if (mode == 3) return nebel_blend_multiply(color, fog);\n"
    "    if (mode == 4) return nebel_blend_screen(color, fog);\n"
    "    return nebel_blend_medium(medium, fog);\n"
    "}\n"
    "void main()\n"
    "{\n"
    "    nebel_view_ray s = nebel_make_view_ray(gl_FragCoord.xy, texelFetch(depth, ivec2(gl_FragCoord.xy), 0).x);\n"
    "    if (surface_light.a >= s.t_max) discard;\n"
    "    nebel_blend blend = blend_of(nebel_trace(s.origin, s.direction, surface_light.a));\n"
    "#if PATH == 0\n"
    "    source = vec4(blend.source, 0.0);\n"
    "    factor = vec4(blend.factor, 1.0);\n"
    "#elif PATH == 1\n"
    "    source = nebel_blend_gray(blend);\n"
    "#else\n"
    "    source = vec4(stage == 0 ? blend.factor : blend.source, 1.0);\n"
    "#endif\n"
    "}\n";

static unsigned make_program(const nebel_gl *gl, nb_gl_language language, path how)
{
    const int es = language == NB_GL_300ES;
    const char *const version = es ? "#version 300 es\n" : "#version 330 core\n";
    const char *const vertex[] = {version, "void main() { gl_Position = vec4(float(gl_VertexID & 1) * 4.0 - 1.0, "
                                           "float(gl_VertexID >> 1) * 4.0 - 1.0, 0.0, 1.0); }\n"};
    nebel_gl_fog_resources fog;
    char defines[128];
    assert_int_equal(nebel_gl_get_fog_resources(gl, &fog), NEBEL_OK);
    snprintf(defines, sizeof defines,
             "#define NEBEL_VIEW\n#define NEBEL_TRANSPARENT\n#define NEBEL_FEATURES %u\n#define PATH %d\n",
             fog.features, (int)how);
    const char *const fragment[] = {version, defines,
                                    nebel_get_shader_source(es ? NEBEL_DIALECT_GLSL_300_ES : NEBEL_DIALECT_GLSL_330),
                                    fragment_text};
    const unsigned program = glCreateProgram();
    pass_attach(program, GL_VERTEX_SHADER, 2, vertex);
    pass_attach(program, GL_FRAGMENT_SHADER, 4, fragment);
    pass_link(program);
    return program;
}

static void use_program(unsigned program, const nebel_gl *gl, const pass_picture *picture, unsigned depth)
{
    nebel_rays rays;
    nebel_gl_fog_resources fog;
    assert_int_equal(nebel_gl_get_fog_resources(gl, &fog), NEBEL_OK);
    assert_int_equal(nebel_compute_view_rays(&picture->view, &picture->depth, &rays), NEBEL_OK);
    assert_true(fog.block != 0);
    glUseProgram(program);
    glUniformBlockBinding(program, glGetUniformBlockIndex(program, "nebel_fog_block"), 3);
    glBindBufferBase(GL_UNIFORM_BUFFER, 3, fog.block);
    glUniform4fv(glGetUniformLocation(program, "nebel_rays"), NEBEL_RAY_TEXELS, rays.texels[0].v);
    glUniform1i(glGetUniformLocation(program, "depth"), 5);
    glActiveTexture(GL_TEXTURE5);
    glBindTexture(GL_TEXTURE_2D, depth);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_NEAREST);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, GL_NEAREST);
    glEnable(GL_BLEND);
    glViewport(0, 0, PASS_WIDTH, PASS_HEIGHT);
}

static void draw_surface(unsigned program, path how, const surface *s)
{
    const int stage = glGetUniformLocation(program, "stage");
    glUniform1i(glGetUniformLocation(program, "mode"), s->mode);
    glUniform4f(glGetUniformLocation(program, "surface_color"), s->color[0], s->color[1], s->color[2], s->alpha);
    glUniform4f(glGetUniformLocation(program, "surface_light"), s->light[0], s->light[1], s->light[2], s->distance);
    if (how == TWICE) {
        glUniform1i(stage, 0);
        glBlendFunc(GL_ZERO, GL_SRC_COLOR);
        glDrawArrays(GL_TRIANGLES, 0, 3);
        glUniform1i(stage, 1);
        glBlendFunc(GL_ONE, GL_ONE);
    } else {
        glBlendFuncSeparate(GL_ONE, how == GREY ? GL_SRC_ALPHA : GL_SRC1_COLOR, GL_ZERO, GL_ONE);
    }
    glDrawArrays(GL_TRIANGLES, 0, 3);
}

/* ---- one against the other ------------------------------------------------------------------- */

static surface random_surface(uint64_t *state, int mode, path how, double distance)
{
    surface s = {.mode = mode, .alpha = (float)dice(state, 0, 1), .distance = (float)distance};
    const int grey = how == GREY && mode >= NEBEL_BLEND_MULTIPLY;
    for (int c = 0; c < 3; c++) {
        s.color[c] = grey && c > 0 ? s.color[0] : (float)dice(state, 0, 1);
        s.light[c] = (float)dice(state, 0, 1);
    }
    return s;
}

static pass_picture picture;
static float background[4 * PASS_PIXELS], drawn[4 * PASS_PIXELS];

static void compare(const nebel_lighting *fog, const surface *surfaces, pass_difference *difference)
{
    for (int i = 0; i < PASS_PIXELS; i += 11) {
        const line way = line_of(&picture.view, i % PASS_WIDTH + .5, i / PASS_WIDTH + .5);
        const double end = picture.stored[i] > 0 ? (double)picture.stored[i] : HUGE_VAL;
        double light[3];
        for (int c = 0; c < 3; c++) light[c] = (double)background[4 * i + c];
        carry_light(fog, &way, surfaces, end, light);
        pass_note(difference, &drawn[4 * i], light, 1);
    }
}

static void draw_stack(nebel_gl *gl, unsigned program, path how, const surface *surfaces)
{
    const unsigned depth = pass_color_texture(PASS_WIDTH, PASS_HEIGHT, 1, picture.stored);
    const unsigned color = pass_color_texture(PASS_WIDTH, PASS_HEIGHT, 4, background);
    const unsigned target = pass_color_texture(PASS_WIDTH, PASS_HEIGHT, 4, NULL);
    const unsigned framebuffer = pass_framebuffer(target, 0);
    const nebel_gl_pass pass = {.depth_texture = depth, .color_texture = color, .depth = picture.depth};
    unsigned array;
    assert_int_equal(nebel_gl_draw_fog(gl, &pass), NEBEL_OK);
    glGenVertexArrays(1, &array);
    glBindVertexArray(array);
    use_program(program, gl, &picture, depth);
    for (int i = LAYERS; i-- > 0;) draw_surface(program, how, &surfaces[i]);
    glDisable(GL_BLEND);
    glUseProgram(0);
    glDeleteVertexArrays(1, &array);
    pass_read(target, PASS_WIDTH, PASS_HEIGHT, drawn);
    pass_delete_framebuffer(framebuffer);
    pass_delete_texture(depth);
    pass_delete_texture(color);
    pass_delete_texture(target);
}

static void try_path(nb_gl_language language, path how)
{
    const range usual = {-1, 0};
    nb_gl context;
    nebel_gl *gl = NULL;
    pass_difference difference = {0};
    uint64_t state = 17;
    pass_open(&context, language);
    nebel_lighting *const fog = pass_fog(0);
    picture = (pass_picture){.view = pass_view(PERSPECTIVE, usual, .3, -.1), .clip = usual};
    picture.depth.encoding = NEBEL_DEPTH_ENCODING_RADIAL;
    pass_fill(&picture);
    for (int i = 0; i < 4 * PASS_PIXELS; i++) background[i] = i % 4 == 3 ? .25f : (float)dice(&state, 0, 2);
    assert_int_equal(nebel_create_gl(&(nebel_gl_desc){0}, &gl), NEBEL_OK);
    assert_int_equal(nebel_gl_set_fog(gl, fog, &picture.view), NEBEL_OK);
    const unsigned program = make_program(gl, language, how);
    for (int n = 0; n < STACKS; n++) {
        surface surfaces[LAYERS];
        for (int i = 0; i < LAYERS; i++)
            surfaces[i] = random_surface(&state, (n + i) % MODES, how, 5 * i + dice(&state, .5, 5));
        draw_stack(gl, program, how, surfaces);
        compare(fog, surfaces, &difference);
        assert_true(how == TWICE || drawn[3] == .25f);
    }
    print_message("path %d: at most %.1e off\n", (int)how, difference.largest);
    assert_true(difference.largest <= 1. / 255);
    glDeleteProgram(program);
    nebel_destroy_gl(gl);
    nebel_release_lighting(fog);
    pass_close(&context);
}

static void test_two_outputs(void **unused)
{
    (void)unused;
    try_path(NB_GL_330, TWO_OUTPUTS);
}

static void test_grey(void **unused)
{
    (void)unused;
    try_path(NB_GL_330, GREY);
    try_path(NB_GL_300ES, GREY);
}

static void test_twice(void **unused)
{
    (void)unused;
    try_path(NB_GL_330, TWICE);
    try_path(NB_GL_300ES, TWICE);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_two_outputs),
        cmocka_unit_test(test_grey),
        cmocka_unit_test(test_twice),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
