/* Classic fog in OpenGL: the methods against each other, against the formula they stand for, and shaders against the
 * fixed pipeline. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "classic_help.h"

#include <epoxy/gl.h>

static const double step = 1. / 255;
static const double float_tolerance = 1e-5;

static classic_mesh mesh;

/* ---- one pass and two ------------------------------------------------------------------------ */

/* The mesh as ever, without fog. */
static void draw_surface(int rich)
{
    classic_clear();
    classic_set_mesh(&mesh);
    if (rich) classic_draw_rich(&mesh);
    if (!rich) classic_draw_plain(&mesh);
}

/* How many pixels the fog changes by more than a step. */
static int count_fogged(const classic_image *fogged, const classic_image *surface)
{
    int count = 0;
    for (int i = 0; i < CLASSIC_PIXELS; i++) {
        double off = 0;
        for (int c = 0; c < 3; c++) off = fmax(off, fabs((double)(fogged->texels[i][c] - surface->texels[i][c])));
        count += off > step;
    }
    return count;
}

static void compare_passes(unsigned internal_format, nebel_vertex_format format, double tolerance, const char *what)
{
    static classic_image surface, one, two;
    classic_stage stage;
    classic_start(&stage, NB_GL_COMPATIBILITY, internal_format, &mesh);
    draw_surface(1);
    classic_read(&surface);
    classic_draw(NEBEL_GL_CLASSIC_FOG_COORD, &mesh, NEBEL_VERTEX_COORDINATE, 1);
    classic_read(&one);
    classic_draw(NEBEL_GL_CLASSIC_TWO_PASS, &mesh, format, 1);
    classic_read(&two);
    print_message("two passes against one, %s: %.2e, of %d pixels %d in fog\n", what, classic_compare(&one, &two),
                  CLASSIC_PIXELS, count_fogged(&one, &surface));
    assert_true(count_fogged(&one, &surface) > CLASSIC_PIXELS / 3);
    assert_true(classic_compare(&one, &two) <= tolerance);
    assert_true(classic_compare_alpha(&one, &surface) == 0 && classic_compare_alpha(&two, &surface) == 0);
    classic_end(&stage);
}

/* Lit, textured, with holes. Bytes of a vertex are off by half a step, in the light and in the amount. */
static void test_two_passes_draw_what_one_does(void **state)
{
    (void)state;
    compare_passes(GL_RGBA32F, NEBEL_VERTEX_RGBA_FLOAT, float_tolerance, "all in floats");
    compare_passes(GL_RGBA8, NEBEL_VERTEX_RGBA_FLOAT, 2 * step * 1.001, "a target of bytes");
    compare_passes(GL_RGBA32F, NEBEL_VERTEX_RGBA8, step * 1.001, "a stream of bytes");
    compare_passes(GL_RGBA8, NEBEL_VERTEX_RGBA8, 2 * step * 1.001, "both in bytes");
}

/* ---- fog that only adds ---------------------------------------------------------------------- */

/* What the first pass draws where its fog is black. */
static void draw_in_black_fog(int rich)
{
    const float black[3] = {0, 0, 0};
    const nebel_vertex_output stream = classic_stream(&mesh, NEBEL_VERTEX_COORDINATE);
    nebel_gl_classic *const classic = classic_create(NEBEL_GL_CLASSIC_FOG_COORD);
    assert_int_equal(nebel_gl_begin_classic_fog(classic, black), NEBEL_OK);
    assert_int_equal(nebel_gl_bind_classic_stream(classic, &stream, 0), NEBEL_OK);
    draw_surface(rich);
    assert_int_equal(nebel_gl_end_classic_fog(classic), NEBEL_OK);
    nebel_destroy_gl_classic(classic);
}

/* The second pass alone, over what is there. */
static void add_fog(nebel_vertex_format format)
{
    const nebel_vertex_output stream = classic_stream(&mesh, format);
    nebel_gl_classic *const classic = classic_create(NEBEL_GL_CLASSIC_ADDITIVE);
    assert_int_equal(nebel_gl_begin_classic_fog(classic, NULL), NEBEL_OK);
    assert_int_equal(nebel_gl_bind_classic_stream(classic, &stream, 0), NEBEL_OK);
    classic_draw_positions(&mesh);
    assert_int_equal(nebel_gl_end_classic_fog(classic), NEBEL_OK);
    nebel_destroy_gl_classic(classic);
}

static double compare_with_black_fog(unsigned internal_format)
{
    static classic_image one, two;
    classic_stage stage;
    classic_start(&stage, NB_GL_COMPATIBILITY, internal_format, &mesh);
    classic_draw(NEBEL_GL_CLASSIC_FOG_COORD, &mesh, NEBEL_VERTEX_COORDINATE, 1);
    classic_read(&one);
    draw_in_black_fog(1);
    add_fog(NEBEL_VERTEX_RGBA_FLOAT);
    classic_read(&two);
    const double largest = classic_compare(&one, &two);
    classic_end(&stage);
    return largest;
}

/* A surface that was fogged to black is weakened, and then adding is all there is to do. */
static void test_black_fog_and_adding_draw_what_one_pass_does(void **state)
{
    (void)state;
    const double floats = compare_with_black_fog(GL_RGBA32F), bytes = compare_with_black_fog(GL_RGBA8);
    print_message("black fog and adding against one pass: %.1e as floats, %.3f steps as bytes\n", floats, 255 * bytes);
    assert_true(floats <= 1e-6);
    assert_true(bytes <= step * 1.001);
}

/* The same with the second pass of a black object in fog of the colour: the same operations, and no bit differs. */
static void test_black_object_in_fog_adds_the_same_bits(void **state)
{
    (void)state;
    static classic_image one, two;
    classic_stage stage;
    classic_start(&stage, NB_GL_COMPATIBILITY, GL_RGBA32F, &mesh);
    const nebel_vertex_output stream = classic_stream(&mesh, NEBEL_VERTEX_COORDINATE);
    classic_draw(NEBEL_GL_CLASSIC_FOG_COORD, &mesh, NEBEL_VERTEX_COORDINATE, 0);
    classic_read(&one);
    draw_in_black_fog(0);
    nebel_gl_classic *const classic = classic_create(NEBEL_GL_CLASSIC_FOG_COORD);
    assert_int_equal(nebel_gl_begin_classic_fog(classic, classic_color_float), NEBEL_OK);
    assert_int_equal(nebel_gl_bind_classic_stream(classic, &stream, 0), NEBEL_OK);
    glEnable(GL_BLEND);
    glBlendFunc(GL_ONE, GL_ONE);
    glDepthFunc(GL_EQUAL);
    glColor4f(0, 0, 0, 0);
    classic_draw_positions(&mesh);
    assert_int_equal(nebel_gl_end_classic_fog(classic), NEBEL_OK);
    nebel_destroy_gl_classic(classic);
    classic_read(&two);
    assert_true(classic_compare(&one, &two) == 0);
    classic_end(&stage);
}

/* As the magazine draws it, the surface is not weakened: each pixel is too bright by the amount of fog times the
 * surface, which is what fog would have taken away. */
static void test_pure_adding_is_too_bright_by_what_fog_hides(void **state)
{
    (void)state;
    static classic_image surface, one, added;
    double largest = 0, off = 0;
    classic_stage stage;
    classic_start(&stage, NB_GL_COMPATIBILITY, GL_RGBA32F, &mesh);
    draw_surface(0);
    classic_read(&surface);
    classic_draw(NEBEL_GL_CLASSIC_FOG_COORD, &mesh, NEBEL_VERTEX_COORDINATE, 0);
    classic_read(&one);
    classic_draw(NEBEL_GL_CLASSIC_ADDITIVE, &mesh, NEBEL_VERTEX_RGBA_FLOAT, 0);
    classic_read(&added);
    for (int i = 0; i < CLASSIC_PIXELS; i++) {
        for (int c = 0; c < 3; c++) {
            const double p = (double)surface.texels[i][c];
            const double amount = ((double)added.texels[i][c] - p) / classic_color[c];
            const double excess = (double)added.texels[i][c] - (double)one.texels[i][c];
            off = fmax(off, fabs(excess - amount * p));
            largest = fmax(largest, excess);
        }
    }
    print_message("pure adding is up to %.0f steps too bright\n", 255 * largest);
    assert_true(off <= float_tolerance && largest > .3);
    assert_true(classic_compare_alpha(&added, &surface) == 0);
    classic_end(&stage);
}

/* ---- alpha ----------------------------------------------------------------------------------- */

/* C = a F + (1 - a) P, F and a as the vertices' bytes have them: one pass with the same amounts as coordinates. */
static void test_alpha_polygons_blend_by_the_formula(void **state)
{
    (void)state;
    static classic_image one, two;
    const GLfloat color[4] = {128 / 255.f, 159 / 255.f, 191 / 255.f, 1};
    classic_stage stage;
    classic_start(&stage, NB_GL_COMPATIBILITY, GL_RGBA32F, &mesh);
    classic_draw(NEBEL_GL_CLASSIC_ALPHA, &mesh, NEBEL_VERTEX_ALPHA, 1);
    classic_read(&two);
    glEnable(GL_FOG);
    glFogi(GL_FOG_MODE, GL_LINEAR);
    glFogf(GL_FOG_END, 255);
    glFogfv(GL_FOG_COLOR, color);
    glFogi(GL_FOG_COORDINATE_SOURCE, GL_FOG_COORDINATE);
    for (int i = 0; i < CLASSIC_VERTICES; i++) mesh.vertices[i].coordinate = mesh.vertices[i].alpha[3];
    glEnableClientState(GL_FOG_COORDINATE_ARRAY);
    glFogCoordPointer(GL_FLOAT, sizeof *mesh.vertices, &mesh.vertices[0].coordinate);
    draw_surface(1);
    classic_read(&one);
    print_message("alpha polygons against the formula: %.1e\n", classic_compare(&one, &two));
    assert_true(classic_compare(&one, &two) <= float_tolerance);
    assert_true(classic_compare_alpha(&one, &two) == 0);
    classic_end(&stage);
}

/* ---- a coordinate is no factor --------------------------------------------------------------- */

/* The coordinate was printed as fog times the red of its colour, for LINEAR fog from 0 to 100: less than a hundredth of
 * the fog is seen. */
static void test_printed_coordinates_show_almost_no_fog(void **state)
{
    (void)state;
    static classic_image surface, right, printed;
    classic_stage stage;
    classic_start(&stage, NB_GL_COMPATIBILITY, GL_RGBA32F, &mesh);
    draw_surface(0);
    classic_read(&surface);
    classic_draw(NEBEL_GL_CLASSIC_FOG_COORD, &mesh, NEBEL_VERTEX_COORDINATE, 0);
    classic_read(&right);
    for (int i = 0; i < CLASSIC_VERTICES; i++)
        mesh.vertices[i].coordinate = mesh.vertices[i].light[3] * classic_color_float[0];
    classic_draw(NEBEL_GL_CLASSIC_FOG_COORD, &mesh, NEBEL_VERTEX_COORDINATE, 0);
    classic_read(&printed);
    assert_true(classic_compare(&right, &surface) > .3);
    assert_true(classic_compare(&printed, &surface) < .01);
    classic_end(&stage);
}

/* ---- Gouraud shading with perspective -------------------------------------------------------- */

/* A quad from 1 m to 40 m before the eye with fog at its far end alone, in white fog over black. The amount is linear
 * in depth, not in the picture. */
static void make_slope(void)
{
    classic_vertex *const v = mesh.vertices;
    memset(&mesh, 0, sizeof mesh);
    for (int i = 0; i < 4; i++) {
        const float depth = i < 2 ? 1 : 40;
        v[i].place[0] = (i == 1 || i == 2 ? 1.f : -1.f) * 50;
        v[i].place[1] = -.5f;
        v[i].place[2] = -depth;
        v[i].coordinate = i < 2 ? 0 : 100;
        for (int c = 0; c < 4; c++) v[i].light[c] = i < 2 ? 0 : 1, v[i].bytes[c] = i < 2 ? 0 : 255, v[i].alpha[c] = 255;
        if (i < 2) v[i].alpha[3] = 0;
    }
    const uint16_t corners[6] = {0, 1, 2, 0, 2, 3};
    memcpy(mesh.indices, corners, sizeof corners);
    mesh.eye_from_object = look((const double[3]){0, 0, 0}, 0, 0);
    mesh.clip_from_eye = frustum((range){-1, 0}, -1, 1, -1, 1, .5, 200);
}

static double compare_with_slope(const classic_image *image)
{
    double largest = 0;
    int rows = 0;
    for (int y = 0; y < CLASSIC_SIZE; y++) {
        const double depth = -.5 / (2 * (y + .5) / CLASSIC_SIZE - 1);
        if (!(depth > 1.01 && depth < 39)) continue;
        const double wanted = (depth - 1) / 39;
        for (int x = 0; x < CLASSIC_SIZE; x++)
            largest = fmax(largest, fabs((double)image->texels[y * CLASSIC_SIZE + x][0] - wanted));
        rows++;
    }
    assert_true(rows >= 15);
    return largest;
}

static void test_amounts_are_interpolated_with_perspective(void **state)
{
    (void)state;
    static const struct {
        nebel_gl_classic_kind kind;
        nebel_vertex_format format;
    } ways[] = {{NEBEL_GL_CLASSIC_TWO_PASS, NEBEL_VERTEX_RGBA8},
                {NEBEL_GL_CLASSIC_TWO_PASS, NEBEL_VERTEX_RGBA_FLOAT},
                {NEBEL_GL_CLASSIC_ADDITIVE, NEBEL_VERTEX_RGBA8},
                {NEBEL_GL_CLASSIC_ALPHA, NEBEL_VERTEX_ALPHA},
                {NEBEL_GL_CLASSIC_FOG_COORD, NEBEL_VERTEX_COORDINATE}};
    static classic_image image;
    classic_stage stage;
    classic_start(&stage, NB_GL_COMPATIBILITY, GL_RGBA32F, &mesh);
    make_slope();
    for (size_t i = 0; i < sizeof ways / sizeof *ways; i++) {
        const nebel_vertex_output stream = classic_stream(&mesh, ways[i].format);
        const float white[3] = {1, 1, 1};
        nebel_gl_classic *const classic = classic_create(ways[i].kind);
        classic_clear();
        classic_set_mesh(&mesh);
        glColor4f(0, 0, 0, 1);
        if (ways[i].kind != NEBEL_GL_CLASSIC_FOG_COORD) classic_draw_positions(&mesh);
        assert_int_equal(nebel_gl_begin_classic_fog(classic, white), NEBEL_OK);
        assert_int_equal(nebel_gl_bind_classic_stream(classic, &stream, 0), NEBEL_OK);
        classic_draw_positions(&mesh);
        assert_int_equal(nebel_gl_end_classic_fog(classic), NEBEL_OK);
        nebel_destroy_gl_classic(classic);
        classic_read(&image);
        assert_true(compare_with_slope(&image) <= float_tolerance);
    }
    classic_end(&stage);
}

/* ---- shaders --------------------------------------------------------------------------------- */

static const char vertex_text[] = "uniform mat4 clip_from_object;\n"
                                  "in vec3 place;\n"
                                  "in vec4 color, stream;\n"
                                  "in float coordinate;\n"
                                  "out vec4 pass_color, pass_stream;\n"
                                  "out float pass_coordinate;\n"
                                  "invariant gl_Position;\n"
                                  "void main()\n"
                                  "{\n"
                                  "    pass_color = color;\n"
                                  "    pass_stream = stream;\n"
                                  "    pass_coordinate = coordinate;\n"
                                  "    gl_Position = clip_from_object * vec4(place, 1.0);\n"
                                  "}\n";

static const char fragment_text[] = "in vec4 pass_color, pass_stream;\n"
                                    "in float pass_coordinate;\n"
                                    "uniform vec3 fog;\n"
                                    "out vec4 fragment;\n"
                                    "void main()\n"
                                    "{\n"
                                    "    fragment = OUTPUT;\n"
                                    "}\n";

/* A program whose fragments are `output`, an expression; it is current. */
static unsigned use_program(int es, const char *output)
{
    const char *const version = es ? "#version 300 es\n" : "#version 330 core\n";
    const unsigned program = glCreateProgram();
    char head[160];
    float matrix_float[16];
    const matrix m = multiply(mesh.clip_from_eye, mesh.eye_from_object);
    snprintf(head, sizeof head, "#define OUTPUT %s\n", output);
    const char *const vertex[] = {version, nebel_gl_classic_shader_source(), vertex_text};
    const char *const fragment[] = {version, head, nebel_gl_classic_shader_source(), fragment_text};
    pass_attach(program, GL_VERTEX_SHADER, 3, vertex);
    pass_attach(program, GL_FRAGMENT_SHADER, 4, fragment);
    glBindAttribLocation(program, 0, "place");
    glBindAttribLocation(program, 1, "color");
    glBindAttribLocation(program, 2, "stream");
    glBindAttribLocation(program, 3, "coordinate");
    glLinkProgram(program);
    for (int i = 0; i < 16; i++) matrix_float[i] = (float)m.m[i];
    glUseProgram(program);
    glUniformMatrix4fv(glGetUniformLocation(program, "clip_from_object"), 1, GL_FALSE, matrix_float);
    glUniform3fv(glGetUniformLocation(program, "fog"), 1, classic_color_float);
    return program;
}

/* The mesh in buffers, its stream as attribute 2. */
static void bind_mesh(unsigned buffers[2], unsigned *array, nebel_vertex_format format)
{
    const GLsizei stride = sizeof *mesh.vertices;
    glGenVertexArrays(1, array);
    glBindVertexArray(*array);
    glGenBuffers(2, buffers);
    glBindBuffer(GL_ARRAY_BUFFER, buffers[0]);
    glBufferData(GL_ARRAY_BUFFER, sizeof mesh.vertices, mesh.vertices, GL_STATIC_DRAW);
    glBindBuffer(GL_ELEMENT_ARRAY_BUFFER, buffers[1]);
    glBufferData(GL_ELEMENT_ARRAY_BUFFER, sizeof mesh.indices, mesh.indices, GL_STATIC_DRAW);
    glVertexAttribPointer(0, 3, GL_FLOAT, GL_FALSE, stride, (const void *)offsetof(classic_vertex, place));
    glVertexAttribPointer(1, 4, GL_FLOAT, GL_FALSE, stride, (const void *)offsetof(classic_vertex, color));
    glVertexAttribPointer(3, 1, GL_FLOAT, GL_FALSE, stride, (const void *)offsetof(classic_vertex, coordinate));
    if (format == NEBEL_VERTEX_ALPHA)
        glVertexAttribPointer(2, 4, GL_UNSIGNED_BYTE, GL_TRUE, stride, (const void *)offsetof(classic_vertex, alpha));
    else
        glVertexAttribPointer(2, 4, GL_FLOAT, GL_FALSE, stride, (const void *)offsetof(classic_vertex, light));
    for (GLuint i = 0; i < 4; i++) glEnableVertexAttribArray(i);
}

static void draw_buffers(void)
{
    glDrawElements(GL_TRIANGLES, CLASSIC_INDICES, GL_UNSIGNED_SHORT, NULL);
}

/* With other shaders than the first pass has: depth must come out the same all the same. */
static void draw_with_shaders(nebel_gl_classic_kind kind, int es)
{
    static const char *const outputs[NEBEL_GL_CLASSIC_COUNT] = {
        [NEBEL_GL_CLASSIC_FOG_COORD] = "nebel_classic_fog_coord(pass_color, pass_coordinate, 100.0, fog)",
        [NEBEL_GL_CLASSIC_TWO_PASS] = "pass_stream",
        [NEBEL_GL_CLASSIC_ADDITIVE] = "pass_stream",
        [NEBEL_GL_CLASSIC_ALPHA] = "nebel_classic_alpha(pass_stream.rgb, pass_stream.a)"};
    unsigned buffers[2], array, first = 0;
    nebel_gl_classic *const classic = classic_create(kind);
    assert_int_equal(nebel_gl_get_classic_method(classic), kind);
    bind_mesh(buffers, &array, kind == NEBEL_GL_CLASSIC_ALPHA ? NEBEL_VERTEX_ALPHA : NEBEL_VERTEX_RGBA_FLOAT);
    classic_clear();
    if (kind != NEBEL_GL_CLASSIC_FOG_COORD) {
        first = use_program(es, "pass_color");
        draw_buffers();
    }
    const unsigned second = use_program(es, outputs[kind]);
    assert_int_equal(nebel_gl_begin_classic_fog(classic, classic_color_float), NEBEL_OK);
    draw_buffers();
    assert_int_equal(nebel_gl_end_classic_fog(classic), NEBEL_OK);
    glUseProgram(0);
    if (first != 0) glDeleteProgram(first);
    glDeleteProgram(second);
    glDeleteBuffers(2, buffers);
    glDeleteVertexArrays(1, &array);
    nebel_destroy_gl_classic(classic);
}

static nebel_vertex_format format_of(nebel_gl_classic_kind kind)
{
    return kind == NEBEL_GL_CLASSIC_FOG_COORD ? NEBEL_VERTEX_COORDINATE
           : kind == NEBEL_GL_CLASSIC_ALPHA   ? NEBEL_VERTEX_ALPHA
                                              : NEBEL_VERTEX_RGBA_FLOAT;
}

static void draw_all(nb_gl_language language, classic_image images[NEBEL_GL_CLASSIC_COUNT])
{
    classic_stage stage;
    classic_start(&stage, language, GL_RGBA32F, &mesh);
    for (int kind = 0; kind < NEBEL_GL_CLASSIC_COUNT; kind++) {
        if (language == NB_GL_COMPATIBILITY)
            classic_draw((nebel_gl_classic_kind)kind, &mesh, format_of((nebel_gl_classic_kind)kind), 0);
        else
            draw_with_shaders((nebel_gl_classic_kind)kind, language == NB_GL_300ES);
        classic_read(&images[kind]);
    }
    classic_end(&stage);
}

static void test_shaders_draw_what_the_fixed_pipeline_does(void **state)
{
    (void)state;
    static classic_image fixed[NEBEL_GL_CLASSIC_COUNT], shaders[NEBEL_GL_CLASSIC_COUNT];
    draw_all(NB_GL_COMPATIBILITY, fixed);
    for (int language = NB_GL_330; language <= NB_GL_300ES; language++) {
        draw_all((nb_gl_language)language, shaders);
        for (int kind = 0; kind < NEBEL_GL_CLASSIC_COUNT; kind++) {
            print_message("language %d, method %d: %.1e\n", language, kind,
                          classic_compare(&fixed[kind], &shaders[kind]));
            assert_true(classic_compare(&fixed[kind], &shaders[kind]) <= float_tolerance);
            assert_true(classic_compare_alpha(&fixed[kind], &shaders[kind]) == 0);
        }
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_two_passes_draw_what_one_does),
        cmocka_unit_test(test_black_fog_and_adding_draw_what_one_pass_does),
        cmocka_unit_test(test_black_object_in_fog_adds_the_same_bits),
        cmocka_unit_test(test_pure_adding_is_too_bright_by_what_fog_hides),
        cmocka_unit_test(test_alpha_polygons_blend_by_the_formula),
        cmocka_unit_test(test_printed_coordinates_show_almost_no_fog),
        cmocka_unit_test(test_amounts_are_interpolated_with_perspective),
        cmocka_unit_test(test_shaders_draw_what_the_fixed_pipeline_does),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
