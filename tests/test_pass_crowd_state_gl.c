/* Crowds that are drawn in several passes leave the host's state as it was, whatever it is, count without disturbing what
 * the host counts, and leave nothing behind where something fails. */
#include <stdio.h>

#include "crowd_help.h"
#include "odd_state.h"

#include <epoxy/gl.h>

#include "gl_errors.h"

enum { WIDTH = 12, HEIGHT = 8, PIXELS = WIDTH * HEIGHT };

typedef struct stage {
    nb_gl context;
    int desktop;
    nebel_gl *gl;
    nebel_lighting *fog;
    unsigned depth, targets[2];
    int objects;
} stage;

typedef struct outcome {
    float in_scattering[4 * PIXELS], transmittance[4 * PIXELS];
} outcome;

static void open_stage(stage *s, nb_gl_language language)
{
    static crowd c;
    static pass_picture picture;
    messages.count = 0;
    c = (crowd){.count = 0};
    crowd_add_balls(&c, 70, 8);
    crowd_add_hole(&c, NEBEL_OPERATION_EXCLUDE);
    picture = (pass_picture){.view = pass_view(0, (range){-1, 0}, 0, 0), .clip = {-1, 0}};
    picture.view.width = WIDTH;
    picture.view.height = HEIGHT;
    pass_fill(&picture);
    pass_open(&s->context, language);
    s->desktop = language == NB_GL_330;
    s->objects = pass_count_objects();
    s->fog = crowd_commit(&c);
    s->depth = pass_depth_texture(WIDTH, HEIGHT, picture.stored);
    for (int i = 0; i < 2; i++) s->targets[i] = pass_color_texture(WIDTH, HEIGHT, 4, NULL);
    const nebel_gl_desc desc = {.host.log = fog_messages_log(&messages)};
    assert_int_equal(nebel_create_gl(&desc, &s->gl), NEBEL_OK);
    assert_int_equal(nebel_gl_set_fog(s->gl, s->fog, &picture.view), NEBEL_OK);
}

static void close_stage(stage *s)
{
    nebel_destroy_gl(s->gl);
    for (int i = 0; i < 2; i++) pass_delete_texture(s->targets[i]);
    pass_delete_texture(s->depth);
    assert_int_equal(pass_count_objects(), s->objects);
    pass_close(&s->context);
    nebel_release_lighting(s->fog);
}

/* Between two snapshots of all state. `forgiven`: errors that are reported meanwhile. */
static nebel_result draw_and_forgive(const stage *s, int forgiven)
{
    static odd_snapshot before, after;
    const nebel_gl_pass pass = {.output = NEBEL_GL_OUTPUT_SPLIT, .depth_texture = s->depth};
    const unsigned framebuffer = pass_framebuffer(s->targets[0], s->targets[1]);
    odd_take(&before, s->desktop);
    const nebel_result result = nebel_gl_draw_fog(s->gl, &pass);
    if (forgiven > 0) assert_int_equal(pass_take_errors(), forgiven);
    odd_take(&after, s->desktop);
    odd_expect_same(&before, &after);
    pass_delete_framebuffer(framebuffer);
    return result;
}

static nebel_result draw(const stage *s)
{
    return draw_and_forgive(s, 0);
}

static void read_outcome(const stage *s, outcome *out)
{
    pass_read(s->targets[0], WIDTH, HEIGHT, out->in_scattering);
    pass_read(s->targets[1], WIDTH, HEIGHT, out->transmittance);
}

static void draw_well(const stage *s, outcome *out)
{
    assert_int_equal(draw(s), NEBEL_OK);
    read_outcome(s, out);
    assert_int_equal(messages.count, 0);
}

/* Of the crowd: it is one, so that a single pass would not be right. */
static void expect_in_steps(const outcome *out)
{
    float least = 1;
    for (int i = 0; i < PIXELS; i++) least = out->transmittance[4 * i] < least ? out->transmittance[4 * i] : least;
    assert_true(least > 0 && least < .02f);
}

/* ---- state ----------------------------------------------------------------------------------- */

/* Odd state is not taken back: each in a context of its own. */
static void test_state_neither_changes_nor_matters(void **state)
{
    (void)state;
    static stage s;
    static outcome plain, strange;
    for (int language = 0; language < 2; language++) {
        for (int on = -1; on < 2; on++) {
            odd o;
            open_stage(&s, (nb_gl_language)language);
            if (on >= 0) odd_set(&o, s.desktop, on);
            assert_int_equal(draw(&s), NEBEL_OK);
            if (on >= 0) odd_delete(&o);
            if (on >= 0) odd_plain_reading(s.desktop);
            read_outcome(&s, on < 0 ? &plain : &strange);
            if (on < 0) expect_in_steps(&plain);
            if (on >= 0) assert_memory_equal(&plain, &strange, sizeof plain);
            close_stage(&s);
        }
    }
}

/* ---- queries --------------------------------------------------------------------------------- */

/* Of each kind that the host may have under way: the picture is the same, and the query still the host's. */
static void test_queries_of_the_host(void **state)
{
    (void)state;
    static const GLenum kinds[] = {GL_ANY_SAMPLES_PASSED, GL_ANY_SAMPLES_PASSED_CONSERVATIVE, GL_SAMPLES_PASSED};
    static stage s;
    static outcome plain, counted;
    for (int language = 0; language < 2; language++) {
        open_stage(&s, (nb_gl_language)language);
        draw_well(&s, &plain);
        for (int i = 0; i < (s.desktop ? 3 : 2); i++) {
            GLuint query, passed = 0;
            GLint current = 0;
            glGenQueries(1, &query);
            glBeginQuery(kinds[i], query);
            draw_well(&s, &counted);
            glGetQueryiv(kinds[i], GL_CURRENT_QUERY, &current);
            glEndQuery(kinds[i]);
            glGetQueryObjectuiv(query, GL_QUERY_RESULT, &passed);
            glDeleteQueries(1, &query);
            pass_expect_no_errors();
            assert_int_equal(current, query);
            assert_true(passed > 0);
            assert_memory_equal(&plain, &counted, sizeof plain);
        }
        draw_well(&s, &counted);
        assert_memory_equal(&plain, &counted, sizeof plain);
        close_stage(&s);
    }
}

/* ---- what fails ------------------------------------------------------------------------------ */

static PFNGLGETERRORPROC true_get_error;
static PFNGLTEXIMAGE3DPROC true_image;
static int is_memory_out;

static void EPOXY_CALLSPEC refuse_image(GLenum target, GLint level, GLint format, GLsizei width, GLsizei height,
                                        GLsizei depth, GLint border, GLenum from, GLenum type, const void *data)
{
    (void)target, (void)level, (void)format, (void)width, (void)height;
    (void)depth, (void)border, (void)from, (void)type, (void)data;
    is_memory_out = 1;
}

static GLenum EPOXY_CALLSPEC tell_memory(void)
{
    const int is = is_memory_out;
    is_memory_out = 0;
    return is ? GL_OUT_OF_MEMORY : true_get_error();
}

static PFNGLCHECKFRAMEBUFFERSTATUSPROC true_status;

/* Those alone that take progress, in four targets. */
static GLenum EPOXY_CALLSPEC refuse_framebuffer(GLenum target)
{
    GLint fourth = GL_NONE;
    glGetIntegerv(GL_DRAW_BUFFER3, &fourth);
    return fourth == GL_NONE ? true_status(target) : GL_FRAMEBUFFER_UNSUPPORTED;
}

static PFNGLSHADERSOURCEPROC true_source;

/* Of the program that counts, or of the one that composes. */
static const char *spoiled;

static void EPOXY_CALLSPEC spoil_source(GLuint shader, GLsizei count, const GLchar *const *texts, const GLint *lengths)
{
    static const GLchar *const wrong = "#version 330 core\nvoid main() { no_such_function(); }\n";
    const int is_meant = strstr(texts[count - 1], spoiled) != NULL &&
                         strstr(texts[count - 1], "pass_progress") != NULL &&
                         strstr(texts[count - 1], "nb_progress_words") == NULL;
    true_source(shader, is_meant ? 1 : count, is_meant ? &wrong : texts, is_meant ? NULL : lengths);
}

/* Functions are loaded when they are first called, and can be replaced from then on. */
static void load_functions(void)
{
    GLuint texture;
    glGenTextures(1, &texture);
    glBindTexture(GL_TEXTURE_2D_ARRAY, texture);
    glTexImage3D(GL_TEXTURE_2D_ARRAY, 0, GL_RGBA32F, 1, 1, 1, 0, GL_RGBA, GL_FLOAT, NULL);
    glDeleteTextures(1, &texture);
    (void)glGetError();
    (void)glCheckFramebufferStatus(GL_FRAMEBUFFER);
    true_image = epoxy_glTexImage3D;
    true_status = epoxy_glCheckFramebufferStatus;
    true_get_error = epoxy_glGetError;
    true_source = epoxy_glShaderSource;
}

static void fail_without_memory(const stage *s)
{
    epoxy_glTexImage3D = refuse_image;
    epoxy_glGetError = tell_memory;
    const nebel_result result = draw(s);
    epoxy_glTexImage3D = true_image;
    epoxy_glGetError = true_get_error;
    expect_message(result, NEBEL_ERROR_MEMORY, "progress of rays");
}

static void fail_to_compile(const stage *s, const char *text)
{
    spoiled = text;
    epoxy_glShaderSource = spoil_source;
    const nebel_result result = draw_and_forgive(s, 1); /* the compiler's own report */
    epoxy_glShaderSource = true_source;
    expect_message(result, NEBEL_ERROR_UNSUPPORTED, "no_such_function");
}

/* Each time it goes on where it failed, and in the end it is drawn. */
static void test_what_fails_leaves_nothing(void **state)
{
    (void)state;
    static stage s;
    static outcome plain, late;
    open_stage(&s, NB_GL_330);
    draw_well(&s, &plain);
    close_stage(&s);
    open_stage(&s, NB_GL_330);
    load_functions();
    fail_to_compile(&s, "discard");
    fail_to_compile(&s, "PASS_COMPOSE");
    fail_without_memory(&s);
    const int objects = pass_count_objects();
    fail_without_memory(&s);
    assert_int_equal(pass_count_objects(), objects);
    epoxy_glCheckFramebufferStatus = refuse_framebuffer;
    const nebel_result result = draw(&s);
    epoxy_glCheckFramebufferStatus = true_status;
    expect_message(result, NEBEL_ERROR_UNSUPPORTED, "layers of floats");
    assert_int_equal(pass_count_objects(), objects);
    draw_well(&s, &late);
    assert_memory_equal(&plain, &late, sizeof plain);
    close_stage(&s);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_state_neither_changes_nor_matters),
        cmocka_unit_test(test_queries_of_the_host),
        cmocka_unit_test(test_what_fails_leaves_nothing),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
