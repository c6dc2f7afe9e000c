/* Multisampled depth and colour: the mean over the samples of what each sees, at its own place in the pixel; and each
 * sample of a target by itself. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "odd_state.h"
#include "pass_help.h"

#include <epoxy/gl.h>

enum { SAMPLES = 4, ALL = SAMPLES * PASS_PIXELS };

static float places[SAMPLES][2];
static float depths[ALL], colors[4 * ALL]; /* sample by sample, pixel by pixel */

/* ---- multisampled textures, filled sample by sample ------------------------------------------ */

static unsigned make_samples(GLenum format)
{
    unsigned name;
    glGenTextures(1, &name);
    glBindTexture(GL_TEXTURE_2D_MULTISAMPLE, name);
    glTexImage2DMultisample(GL_TEXTURE_2D_MULTISAMPLE, SAMPLES, format, PASS_WIDTH, PASS_HEIGHT, GL_TRUE);
    return name;
}

static unsigned fill_program(void)
{
    const char *const vertex = "#version 400 core\n"
                               "void main() { gl_Position = vec4(float(gl_VertexID & 1) * 4.0 - 1.0, float(gl_VertexID "
                               ">> 1) * 4.0 - 1.0, 0.0, 1.0); }\n";
    const char *const fragment = "#version 400 core\n"
                                 "uniform sampler2D depths, colors;\n"
                                 "out vec4 color;\n"
                                 "void main()\n"
                                 "{\n"
                                 "    ivec2 at = ivec2(int(gl_FragCoord.x) * 4 + gl_SampleID, int(gl_FragCoord.y));\n"
                                 "    gl_FragDepth = texelFetch(depths, at, 0).x;\n"
                                 "    color = texelFetch(colors, at, 0);\n"
                                 "}\n";
    const unsigned program = glCreateProgram();
    pass_attach(program, GL_VERTEX_SHADER, 1, &vertex);
    pass_attach(program, GL_FRAGMENT_SHADER, 1, &fragment);
    pass_link(program);
    glUseProgram(program);
    glUniform1i(glGetUniformLocation(program, "depths"), 0);
    glUniform1i(glGetUniformLocation(program, "colors"), 1);
    return program;
}

static unsigned bind_samples(unsigned depth, unsigned color)
{
    unsigned framebuffer;
    glGenFramebuffers(1, &framebuffer);
    glBindFramebuffer(GL_FRAMEBUFFER, framebuffer);
    glFramebufferTexture(GL_FRAMEBUFFER, GL_DEPTH_ATTACHMENT, depth, 0);
    glFramebufferTexture(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, color, 0);
    assert_int_equal(glCheckFramebufferStatus(GL_FRAMEBUFFER), GL_FRAMEBUFFER_COMPLETE);
    for (GLuint i = 0; i < SAMPLES; i++) glGetMultisamplefv(GL_SAMPLE_POSITION, i, places[i]);
    return framebuffer;
}

/* Draws the samples into the textures that the framebuffer has. */
static void fill_samples(unsigned framebuffer)
{
    const unsigned program = fill_program();
    const unsigned sources[] = {pass_color_texture(SAMPLES * PASS_WIDTH, PASS_HEIGHT, 1, depths),
                                pass_color_texture(SAMPLES * PASS_WIDTH, PASS_HEIGHT, 4, colors)};
    unsigned array;
    glGenVertexArrays(1, &array);
    glBindVertexArray(array);
    for (int i = 0; i < 2; i++) {
        glActiveTexture((GLenum)(GL_TEXTURE0 + i));
        glBindTexture(GL_TEXTURE_2D, sources[i]);
        glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_NEAREST);
    }
    glBindFramebuffer(GL_FRAMEBUFFER, framebuffer);
    glViewport(0, 0, PASS_WIDTH, PASS_HEIGHT);
    glEnable(GL_DEPTH_TEST);
    glDepthFunc(GL_ALWAYS);
    glDrawArrays(GL_TRIANGLES, 0, 3);
    glDisable(GL_DEPTH_TEST);
    for (int i = 0; i < 2; i++) pass_delete_texture(sources[i]);
    glDeleteVertexArrays(1, &array);
    glDeleteProgram(program); /* still current: a state that cannot be given back, and is no error */
}

/* ---- what should come out -------------------------------------------------------------------- */

/* The picture as one sample of every pixel sees it: its pixels are where that sample is. */
static void shift_picture(pass_picture *picture, const nebel_view *whole, int sample)
{
    picture->view = *whole;
    for (int i = 0; i < 16; i += 4) {
        picture->view.clip_from_eye[i] +=
            (1 - 2 * (double)places[sample][0]) / PASS_WIDTH * whole->clip_from_eye[i + 3];
        picture->view.clip_from_eye[i + 1] +=
            (1 - 2 * (double)places[sample][1]) / PASS_HEIGHT * whole->clip_from_eye[i + 3];
    }
}

static pass_picture pictures[SAMPLES];

static void make_pictures(void)
{
    const range usual = {-1, 0};
    const nebel_view whole = pass_view(PERSPECTIVE, usual, .3, -.1);
    for (int s = 0; s < SAMPLES; s++) {
        pictures[s] = (pass_picture){.clip = usual};
        shift_picture(&pictures[s], &whole, s);
        pass_fill(&pictures[s]);
        for (int i = 0; i < PASS_PIXELS; i++) {
            depths[i * SAMPLES + s] = pictures[s].stored[i];
            for (int c = 0; c < 4; c++)
                colors[4 * (i * SAMPLES + s) + c] = pictures[s].stored[i] < 1 ? (float)(.2 * (c + 1)) : (float)(9 - c);
        }
    }
}

/* Pixels whose samples see different things. */
static int is_silhouette(int i)
{
    for (int s = 1; s < SAMPLES; s++) {
        if (fabs((double)(depths[i * SAMPLES + s] - depths[i * SAMPLES])) > 2e-3) return 1;
    }
    return 0;
}

static void expect(const nebel_lighting *fog, int i, double composed[4], double scattered[3], double through[3])
{
    memset(composed, 0, 4 * sizeof *composed);
    memset(scattered, 0, 3 * sizeof *scattered);
    memset(through, 0, 3 * sizeof *through);
    for (int s = 0; s < SAMPLES; s++) {
        const nebel_transfer transfer = pass_trace(fog, &pictures[s], i % PASS_WIDTH, i / PASS_WIDTH);
        const float *const color = colors + 4 * (i * SAMPLES + s);
        for (int c = 0; c < 3; c++) {
            scattered[c] += transfer.in_scattering[c] / SAMPLES;
            through[c] += transfer.transmittance[c] / SAMPLES;
            composed[c] += (transfer.transmittance[c] * (double)color[c] + transfer.in_scattering[c]) / SAMPLES;
        }
        composed[3] += (double)color[3] / SAMPLES;
    }
}

/* ---- the test -------------------------------------------------------------------------------- */

typedef struct stage {
    nb_gl context;
    nebel_gl *gl;
    nebel_lighting *fog;
    unsigned depth, color, samples;
    nebel_view view;
} stage;

static stage open_stage(void)
{
    stage s;
    pass_open(&s.context, NB_GL_330);
    s.depth = make_samples(GL_DEPTH_COMPONENT32F);
    s.color = make_samples(GL_RGBA32F);
    s.samples = bind_samples(s.depth, s.color);
    s.fog = pass_fog(0);
    s.view = pass_view(PERSPECTIVE, (range){-1, 0}, .3, -.1);
    make_pictures();
    fill_samples(s.samples);
    assert_int_equal(nebel_create_gl(&(nebel_gl_desc){0}, &s.gl), NEBEL_OK);
    assert_int_equal(nebel_gl_set_fog(s.gl, s.fog, &s.view), NEBEL_OK);
    return s;
}

static void close_stage(stage *s)
{
    nebel_destroy_gl(s->gl);
    nebel_release_lighting(s->fog);
    pass_delete_texture(s->depth);
    pass_delete_texture(s->color);
    pass_delete_framebuffer(s->samples);
    pass_close(&s->context);
}

static void draw(stage *s, nebel_gl_output output, float *first, float *second)
{
    const unsigned targets[] = {pass_color_texture(PASS_WIDTH, PASS_HEIGHT, 4, NULL),
                                pass_color_texture(PASS_WIDTH, PASS_HEIGHT, 4, NULL)};
    const unsigned framebuffer = pass_framebuffer(targets[0], second != NULL ? targets[1] : 0);
    const nebel_gl_pass pass = {
        .output = output, .depth_texture = s->depth, .color_texture = s->color, .samples = SAMPLES};
    GLint reading = 0, drawing = 0, unit = 0;
    glBindFramebuffer(GL_READ_FRAMEBUFFER, s->samples);
    assert_int_equal(nebel_gl_draw_fog(s->gl, &pass), NEBEL_OK);
    glGetIntegerv(GL_READ_FRAMEBUFFER_BINDING, &reading);
    glGetIntegerv(GL_DRAW_FRAMEBUFFER_BINDING, &drawing);
    glGetIntegerv(GL_ACTIVE_TEXTURE, &unit);
    assert_true((unsigned)reading == s->samples && (unsigned)drawing == framebuffer && unit == GL_TEXTURE1);
    pass_read(targets[0], PASS_WIDTH, PASS_HEIGHT, first);
    if (second != NULL) pass_read(targets[1], PASS_WIDTH, PASS_HEIGHT, second);
    pass_delete_framebuffer(framebuffer);
    for (int i = 0; i < 2; i++) pass_delete_texture(targets[i]);
    pass_expect_no_errors();
}

static void test_the_mean_of_samples_has_no_outlines(void **state)
{
    (void)state;
    static float composed[4 * PASS_PIXELS], scattered[4 * PASS_PIXELS], through[4 * PASS_PIXELS];
    stage s = open_stage();
    pass_difference everywhere = {0, 0, 0}, edges = {0, 0, 0};
    draw(&s, NEBEL_GL_OUTPUT_COMPOSE, composed, NULL);
    draw(&s, NEBEL_GL_OUTPUT_SPLIT, scattered, through);
    for (int i = 0; i < PASS_PIXELS; i++) {
        double wanted_composed[4], wanted_scattered[3], wanted_through[3];
        expect(s.fog, i, wanted_composed, wanted_scattered, wanted_through);
        pass_note(&everywhere, composed + 4 * i, wanted_composed, 1);
        pass_note(&everywhere, scattered + 4 * i, wanted_scattered, 0);
        pass_note(&everywhere, through + 4 * i, wanted_through, 0);
        assert_true(fabs((double)composed[4 * i + 3] - wanted_composed[3]) < 1e-5);
        if (is_silhouette(i)) pass_note(&edges, composed + 4 * i, wanted_composed, 1);
    }
    print_message("%zu pixels, worst %.1e; %zu of them silhouettes, worst %.1e\n", everywhere.fogged,
                  everywhere.largest, edges.fogged, edges.largest);
    assert_true(edges.fogged > 50);
    assert_int_equal(everywhere.beyond_step, 0);
    close_stage(&s);
}

/* ---- over a target of samples ---------------------------------------------------------------- */

/* A multisampled picture with the colours, to blend over; its framebuffer is bound. */
static unsigned make_target(unsigned *texture)
{
    const unsigned depth = make_samples(GL_DEPTH_COMPONENT32F);
    *texture = make_samples(GL_RGBA32F);
    const unsigned whole = bind_samples(depth, *texture);
    fill_samples(whole);
    pass_delete_framebuffer(whole);
    pass_delete_texture(depth);
    unsigned framebuffer;
    glGenFramebuffers(1, &framebuffer);
    glBindFramebuffer(GL_FRAMEBUFFER, framebuffer);
    glFramebufferTexture(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, *texture, 0);
    return framebuffer;
}

/* The mean of the bound framebuffer's samples. */
static void resolve(unsigned framebuffer, float *texels)
{
    const unsigned mean = pass_color_texture(PASS_WIDTH, PASS_HEIGHT, 4, NULL);
    const unsigned target = pass_framebuffer(mean, 0);
    glBindFramebuffer(GL_READ_FRAMEBUFFER, framebuffer);
    glBlitFramebuffer(0, 0, PASS_WIDTH, PASS_HEIGHT, 0, 0, PASS_WIDTH, PASS_HEIGHT, GL_COLOR_BUFFER_BIT, GL_NEAREST);
    pass_read(mean, PASS_WIDTH, PASS_HEIGHT, texels);
    pass_delete_framebuffer(target);
    pass_delete_texture(mean);
}

/* With state of the host that would keep samples away. */
static void blend(stage *s, nebel_gl_output output, float *texels)
{
    unsigned texture;
    GLint mask = 0;
    const unsigned framebuffer = make_target(&texture);
    const nebel_gl_pass pass = {.output = output, .depth_texture = s->depth, .samples = SAMPLES};
    glDisable(GL_MULTISAMPLE);
    glSampleMaski(0, 2);
    assert_int_equal(nebel_gl_draw_fog(s->gl, &pass), NEBEL_OK);
    glGetIntegeri_v(GL_SAMPLE_MASK_VALUE, 0, &mask);
    assert_true(mask == 2 && !glIsEnabled(GL_SAMPLE_MASK) && !glIsEnabled(GL_MULTISAMPLE));
    glEnable(GL_MULTISAMPLE);
    resolve(framebuffer, texels);
    pass_delete_framebuffer(framebuffer);
    pass_delete_texture(texture);
    pass_expect_no_errors();
}

static void expect_blended(const nebel_lighting *fog, int i, int grey, double wanted[3])
{
    memset(wanted, 0, 3 * sizeof *wanted);
    for (int s = 0; s < SAMPLES; s++) {
        const nebel_transfer transfer = pass_trace(fog, &pictures[s], i % PASS_WIDTH, i / PASS_WIDTH);
        const double *const t = transfer.transmittance, mean = (t[0] + t[1] + t[2]) / 3;
        for (int c = 0; c < 3; c++) {
            const double color = (double)colors[4 * (i * SAMPLES + s) + c];
            wanted[c] += ((grey ? mean : t[c]) * color + transfer.in_scattering[c]) / SAMPLES;
        }
    }
}

static void test_each_sample_is_blended_by_itself(void **state)
{
    (void)state;
    static float got[4 * PASS_PIXELS];
    stage s = open_stage();
    for (int grey = 0; grey < 2; grey++) {
        pass_difference everywhere = {0, 0, 0};
        blend(&s, grey ? NEBEL_GL_OUTPUT_BLEND_GRAY : NEBEL_GL_OUTPUT_BLEND, got);
        for (int i = 0; i < PASS_PIXELS; i++) {
            double wanted[3], alpha = 0;
            expect_blended(s.fog, i, grey, wanted);
            pass_note(&everywhere, got + 4 * i, wanted, 1);
            for (int k = 0; k < SAMPLES; k++) alpha += (double)colors[4 * (i * SAMPLES + k) + 3] / SAMPLES;
            assert_true(fabs((double)got[4 * i + 3] - alpha) < 1e-5);
        }
        print_message("%zu pixels, worst %.1e\n", everywhere.fogged, everywhere.largest);
        assert_int_equal(everywhere.beyond_step, 0);
    }
    close_stage(&s);
}

static void draw_into_samples(const stage *s, nebel_gl_output output, int which, const char **name, float *out)
{
    static odd_snapshot before, after;
    const nebel_gl_pass pass = {.output = output, .depth_texture = s->depth, .samples = SAMPLES};
    unsigned texture;
    const unsigned framebuffer = make_target(&texture);
    glUseProgram(0);
    if (which == 0) odd_prepare();
    if (which >= 0) *name = odd_set_alone(which, 1);
    odd_take(&before, 1);
    assert_int_equal(nebel_gl_draw_fog(s->gl, &pass), NEBEL_OK);
    odd_take(&after, 1);
    odd_expect_same(&before, &after);
    if (which >= 0) (void)odd_set_alone(which, 0);
    resolve(framebuffer, out);
    pass_delete_framebuffer(framebuffer);
    pass_delete_texture(texture);
}

/* Masks and coverage of samples are of multisampled targets alone, and some of them of an alpha other than 1. */
static void test_each_odd_thing_alone(void **state)
{
    (void)state;
    static float plain[4 * PASS_PIXELS], strange[4 * PASS_PIXELS];
    for (int grey = 0; grey < 2; grey++) {
        const nebel_gl_output output = grey ? NEBEL_GL_OUTPUT_BLEND_GRAY : NEBEL_GL_OUTPUT_BLEND;
        const char *name = "nothing";
        stage s = open_stage();
        draw_into_samples(&s, output, -1, &name, plain);
        for (int which = 0; name[0] != '\0'; which++) {
            draw_into_samples(&s, output, which, &name, strange);
            if (memcmp(plain, strange, sizeof plain) != 0) fail_msg("%s changes the picture", name);
        }
        close_stage(&s);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_the_mean_of_samples_has_no_outlines),
        cmocka_unit_test(test_each_sample_is_blended_by_itself),
        cmocka_unit_test(test_each_odd_thing_alone),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
