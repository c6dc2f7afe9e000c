/* What is missing, wrong or lost is said, with what to do, and nothing is left behind. Where this machine's driver is
 * too good to fail, one of its functions is replaced. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "fog_help.h"
#include "pass_help.h"

#include <nebel/light.h>

#include <epoxy/gl.h>

#include "gl_errors.h"

/* ---- a stage --------------------------------------------------------------------------------- */

typedef struct stage {
    nb_gl context;
    nebel_gl *gl;
    nebel_lighting *fog;
    pass_picture picture;
    unsigned depth, color, target, second, framebuffer;
    int objects;
} stage;

static const range usual = {-1, 0};

static nebel_gl_desc desc_of(fog_memory *memory)
{
    nebel_gl_desc desc = {.host.log = fog_messages_log(&messages)};
    if (memory != NULL) desc.host.allocator = fog_memory_allocator(memory);
    return desc;
}

static void open_stage(stage *s, nb_gl_language language)
{
    const nebel_gl_desc desc = desc_of(NULL);
    messages.count = 0;
    pass_open(&s->context, language);
    s->picture = (pass_picture){.view = pass_view(PERSPECTIVE, usual, .3, -.1), .clip = usual};
    pass_fill(&s->picture);
    s->fog = pass_fog(0);
    s->depth = pass_depth_texture(PASS_WIDTH, PASS_HEIGHT, s->picture.stored);
    s->color = pass_color_texture(PASS_WIDTH, PASS_HEIGHT, 4, NULL);
    s->target = pass_color_texture(PASS_WIDTH, PASS_HEIGHT, 4, NULL);
    s->second = pass_color_texture(PASS_WIDTH, PASS_HEIGHT, 4, NULL);
    s->framebuffer = pass_framebuffer(s->target, 0);
    s->objects = pass_count_objects();
    assert_int_equal(nebel_create_gl(&desc, &s->gl), NEBEL_OK);
    assert_int_equal(nebel_gl_set_fog(s->gl, s->fog, &s->picture.view), NEBEL_OK);
}

static void close_stage(stage *s)
{
    nebel_destroy_gl(s->gl);
    assert_int_equal(pass_count_objects(), s->objects);
    nebel_release_lighting(s->fog);
    pass_close(&s->context);
}

static nebel_gl_pass pass_of(const stage *s)
{
    return (nebel_gl_pass){.depth_texture = s->depth, .color_texture = s->color};
}

static nebel_result draw(const stage *s)
{
    const nebel_gl_pass pass = pass_of(s);
    return nebel_gl_draw_fog(s->gl, &pass);
}

/* ---- contexts -------------------------------------------------------------------------------- */

static void test_no_context_is_said(void **state)
{
    (void)state;
    const nebel_gl_desc desc = desc_of(NULL);
    nebel_gl *gl = (nebel_gl *)&messages;
    expect_message(nebel_create_gl(&desc, &gl), NEBEL_ERROR_UNSUPPORTED, "no context is current");
    assert_null(gl);
    assert_int_equal(nebel_create_gl(NULL, &gl), NEBEL_ERROR_ARGUMENT);
    assert_int_equal(nebel_create_gl(&desc, NULL), NEBEL_ERROR_ARGUMENT);
    nebel_destroy_gl(NULL);
}

static const char *version_text;
static PFNGLGETSTRINGPROC true_get_string;

static const GLubyte *EPOXY_CALLSPEC fake_get_string(GLenum name)
{
    return name == GL_VERSION ? (const GLubyte *)version_text : true_get_string(name);
}

static nebel_result create_with_version(const char *version, const nebel_gl_desc *desc, nebel_gl **gl)
{
    version_text = version;
    true_get_string = epoxy_glGetString;
    epoxy_glGetString = fake_get_string;
    const nebel_result result = nebel_create_gl(desc, gl);
    epoxy_glGetString = true_get_string;
    return result;
}

static void expect_too_old(const char *version, const char *part)
{
    const nebel_gl_desc desc = desc_of(NULL);
    nebel_gl *gl = NULL;
    expect_message(create_with_version(version, &desc, &gl), NEBEL_ERROR_UNSUPPORTED, part);
    assert_null(gl);
}

static void test_old_contexts_are_named(void **state)
{
    (void)state;
    static stage s;
    open_stage(&s, NB_GL_330);
    expect_too_old("3.2.1 Old Driver", "OpenGL 3.2");
    close_stage(&s);
    open_stage(&s, NB_GL_300ES);
    expect_too_old("OpenGL ES 2.0 Old Driver", "OpenGL ES 2.0");
    close_stage(&s);
}

static void test_another_context_is_refused(void **state)
{
    (void)state;
    static stage s;
    static nb_gl other;
    open_stage(&s, NB_GL_330);
    pass_open(&other, NB_GL_330);
    expect_message(nebel_gl_set_fog(s.gl, s.fog, &s.picture.view), NEBEL_ERROR_UNSUPPORTED, "not current, or was lost");
    nebel_destroy_gl(s.gl);
    pass_close(&other);
    nb_gl_close(&s.context);
    nebel_release_lighting(s.fog);
}

static void test_a_lost_context_is_survived(void **state)
{
    (void)state;
    static stage s;
    open_stage(&s, NB_GL_330);
    const PFNGLISVERTEXARRAYPROC true_is = epoxy_glIsVertexArray;
    epoxy_glIsVertexArray = is_nothing;
    expect_message(draw(&s), NEBEL_ERROR_UNSUPPORTED, "lost");
    expect_message(nebel_gl_set_fog(s.gl, s.fog, &s.picture.view), NEBEL_ERROR_UNSUPPORTED, "create another");
    nebel_destroy_gl(s.gl);
    epoxy_glIsVertexArray = true_is;
    nebel_release_lighting(s.fog);
    pass_close(&s.context);
}

/* ---- drivers that fail ----------------------------------------------------------------------- */

static PFNGLSHADERSOURCEPROC true_shader_source;

static void EPOXY_CALLSPEC spoil_source(GLuint shader, GLsizei count, const GLchar *const *texts, const GLint *lengths)
{
    const GLchar *const text = "#version 330 core\nvoid main() { no_such_function(); }\n";
    (void)count, (void)texts, (void)lengths;
    true_shader_source(shader, 1, &text, NULL);
}

static void EPOXY_CALLSPEC do_not_link(GLuint program)
{
    (void)program;
}

static void test_shaders_that_the_driver_refuses(void **state)
{
    (void)state;
    static stage s;
    open_stage(&s, NB_GL_330);
    nebel_gl_pass pass = pass_of(&s);
    pass.output = NEBEL_GL_OUTPUT_BLEND_GRAY; /* another program, so that all functions are loaded that are replaced */
    assert_int_equal(nebel_gl_draw_fog(s.gl, &pass), NEBEL_OK);
    const int objects = pass_count_objects();
    true_shader_source = epoxy_glShaderSource;
    epoxy_glShaderSource = spoil_source;
    const nebel_result compiled = draw(&s);
    epoxy_glShaderSource = true_shader_source;
    expect_message(compiled, NEBEL_ERROR_UNSUPPORTED, "no_such_function");
    assert_int_equal(pass_take_errors(), 1); /* the compiler's own report */
    const PFNGLLINKPROGRAMPROC true_link = epoxy_glLinkProgram;
    epoxy_glLinkProgram = do_not_link;
    const nebel_result linked = draw(&s);
    epoxy_glLinkProgram = true_link;
    expect_message(linked, NEBEL_ERROR_UNSUPPORTED, "link");
    assert_int_equal(pass_count_objects(), objects);
    assert_int_equal(draw(&s), NEBEL_OK);
    close_stage(&s);
}

/* One box of `size` voxels along each axis, no two alike. */
static nebel_lighting *fog_of_voxels(size_t size)
{
    const size_t count = size * size * size;
    nebel_grid *grid = NULL;
    float *const voxels = calloc(count, sizeof *voxels);
    assert_non_null(voxels);
    for (size_t i = 0; i < count; i++) voxels[i] = (float)i / (float)count;
    assert_int_equal(nebel_create_grid(&(nebel_grid_desc){.size = {size, size, size}, .voxels = voxels}, &grid),
                     NEBEL_OK);
    const nebel_volume_desc v = {
        .shape = {.type = NEBEL_SHAPE_BOX, .min = {-9, -9, -9}, .max = {9, 9, 9}},
        .density = {.type = NEBEL_DENSITY_GRID, .grid = grid},
        .extinction = {.1, .1, .1},
        .source = {1, 1, 1},
    };
    nebel_lighting *const fog = fog_light(NULL, &v, 1);
    nebel_release_grid(grid);
    free(voxels);
    return fog;
}

/* One that scatters a small map sharply. */
static nebel_lighting *fog_under_a_map(void)
{
    static const float pixels[3 * 4 * 2] = {1, 2, 3, 4, 5, 6};
    const nebel_environment_map_desc desc = {.width = 4, .height = 2, .pixels = pixels};
    const nebel_volume_desc v = {
        .extinction = {.1, .1, .1}, .albedo = {1, 1, 1}, .phase = {.type = NEBEL_PHASE_HENYEY_GREENSTEIN, .g = .8}};
    nebel_lighting_desc lights = {.environment = {.type = NEBEL_ENVIRONMENT_MAP}};
    assert_int_equal(nebel_create_environment_map(&desc, &lights.environment.map), NEBEL_OK);
    nebel_lighting *const fog = fog_light(&lights, &v, 1);
    nebel_release_environment_map(lights.environment.map);
    return fog;
}

static void test_more_volumes_than_a_texture_holds(void **state)
{
    (void)state;
    static stage s;
    open_stage(&s, NB_GL_330);
    const nebel_gl_desc desc = desc_of(NULL);
    nebel_gl *narrow = NULL;
    nebel_lighting *const many = pass_fog(1000);
    true_get_integer = epoxy_glGetIntegerv;
    epoxy_glGetIntegerv = narrow_textures;
    assert_int_equal(nebel_create_gl(&desc, &narrow), NEBEL_OK);
    epoxy_glGetIntegerv = true_get_integer;
    expect_message(nebel_gl_set_fog(narrow, many, &s.picture.view), NEBEL_ERROR_LIMIT, "has 3 (GL_MAX_TEXTURE_SIZE)");
    assert_int_equal(nebel_gl_set_fog(narrow, s.fog, &s.picture.view), NEBEL_OK);
    nebel_lighting *const fine = fog_of_voxels(32);
    expect_message(nebel_gl_set_fog(narrow, fine, &s.picture.view), NEBEL_ERROR_LIMIT, "use fewer voxels");
    assert_int_equal(nebel_gl_set_fog(narrow, s.fog, &s.picture.view), NEBEL_OK);
    nebel_release_lighting(fine);
    nebel_lighting *const lit = fog_under_a_map();
    expect_message(nebel_gl_set_fog(narrow, lit, &s.picture.view), NEBEL_ERROR_LIMIT, "fewer phase functions");
    assert_int_equal(nebel_gl_set_fog(narrow, s.fog, &s.picture.view), NEBEL_OK);
    nebel_release_lighting(lit);
    nebel_destroy_gl(narrow);
    nebel_release_lighting(many);
    close_stage(&s);
}

static GLenum EPOXY_CALLSPEC out_of_memory(void)
{
    return GL_OUT_OF_MEMORY;
}

static void test_a_driver_without_memory(void **state)
{
    (void)state;
    static stage s;
    open_stage(&s, NB_GL_330);
    nebel_lighting *const many = pass_fog(1000);
    (void)glGetError();
    const PFNGLGETERRORPROC true_error = epoxy_glGetError;
    epoxy_glGetError = out_of_memory;
    const nebel_result result = nebel_gl_set_fog(s.gl, many, &s.picture.view);
    epoxy_glGetError = true_error;
    expect_message(result, NEBEL_ERROR_MEMORY, "no memory for the texture");
    expect_message(draw(&s), NEBEL_ERROR_ARGUMENT, "nebel_gl_set_fog first");
    assert_int_equal(nebel_gl_set_fog(s.gl, many, &s.picture.view), NEBEL_OK);
    assert_int_equal(draw(&s), NEBEL_OK);
    nebel_lighting *const voxels = fog_of_voxels(12);
    epoxy_glGetError = out_of_memory;
    const nebel_result refused = nebel_gl_set_fog(s.gl, voxels, &s.picture.view);
    epoxy_glGetError = true_error;
    expect_message(refused, NEBEL_ERROR_MEMORY, "no memory for the texture of voxels");
    assert_int_equal(nebel_gl_set_fog(s.gl, voxels, &s.picture.view), NEBEL_OK);
    assert_int_equal(draw(&s), NEBEL_OK);
    nebel_lighting *const lit = fog_under_a_map();
    epoxy_glGetError = out_of_memory;
    const nebel_result dark = nebel_gl_set_fog(s.gl, lit, &s.picture.view);
    epoxy_glGetError = true_error;
    expect_message(dark, NEBEL_ERROR_MEMORY, "no memory for the texture of the environment");
    assert_int_equal(nebel_gl_set_fog(s.gl, lit, &s.picture.view), NEBEL_OK);
    assert_int_equal(draw(&s), NEBEL_OK);
    nebel_release_lighting(lit);
    nebel_release_lighting(voxels);
    nebel_release_lighting(many);
    close_stage(&s);
}

/* ---- memory ---------------------------------------------------------------------------------- */

/* Everything once, with every allocation failing in turn. */
static void test_memory_that_runs_out(void **state)
{
    (void)state;
    static stage s;
    open_stage(&s, NB_GL_330);
    nebel_lighting *const many = pass_fog(60), *const voxels = fog_of_voxels(12), *const lit = fog_under_a_map();
    const nebel_gl_pass pass = pass_of(&s);
    nebel_result result = NEBEL_ERROR_MEMORY;
    size_t fails = 0;
    for (size_t k = 1; result != NEBEL_OK; k++) {
        fog_memory memory = {.fail_first = k, .fail_count = 1};
        const nebel_gl_desc desc = desc_of(&memory);
        const int objects = pass_count_objects();
        nebel_gl *gl = NULL;
        result = nebel_create_gl(&desc, &gl);
        if (result == NEBEL_OK) result = nebel_gl_set_fog(gl, many, &s.picture.view);
        if (result == NEBEL_OK) result = nebel_gl_draw_fog(gl, &pass);
        if (result == NEBEL_OK) result = nebel_gl_set_fog(gl, voxels, &s.picture.view);
        if (result == NEBEL_OK) result = nebel_gl_set_fog(gl, lit, &s.picture.view);
        if (result != NEBEL_OK) expect_message(result, NEBEL_ERROR_MEMORY, "memory");
        fails += result != NEBEL_OK;
        nebel_destroy_gl(gl);
        assert_int_equal(memory.live, 0);
        assert_int_equal(pass_count_objects(), objects);
    }
    assert_true(fails >= 6);
    nebel_release_lighting(many);
    nebel_release_lighting(lit);
    nebel_release_lighting(voxels);
    close_stage(&s);
}

/* ---- arguments ------------------------------------------------------------------------------- */

static void test_views_that_are_none(void **state)
{
    (void)state;
    static stage s;
    nebel_gl_fog_resources fog;
    open_stage(&s, NB_GL_300ES);
    nebel_view view = s.picture.view;
    view.height = 0;
    expect_message(nebel_gl_set_fog(s.gl, s.fog, &view), NEBEL_ERROR_ARGUMENT, "96 x 0 pixels");
    view = s.picture.view;
    view.clip_from_eye[3] = (double)NAN;
    expect_message(nebel_gl_set_fog(s.gl, s.fog, &view), NEBEL_ERROR_ARGUMENT, "clip_from_eye must be a projection");
    view = s.picture.view;
    view.eye_from_world[3] = 1;
    expect_message(nebel_gl_set_fog(s.gl, s.fog, &view), NEBEL_ERROR_ARGUMENT, "eye_from_world must be a rotation");
    expect_message(nebel_gl_set_fog(s.gl, s.fog, NULL), NEBEL_ERROR_ARGUMENT, "view is missing");
    expect_message(nebel_gl_get_fog_resources(s.gl, &fog), NEBEL_ERROR_ARGUMENT, "nebel_gl_set_fog first");
    assert_int_equal(nebel_gl_set_fog(NULL, s.fog, &view), NEBEL_ERROR_ARGUMENT);
    assert_int_equal(nebel_gl_draw_fog(NULL, NULL), NEBEL_ERROR_ARGUMENT);
    close_stage(&s);
}

static void refuse(const stage *s, nebel_gl_pass pass, nebel_result wanted, const char *part)
{
    expect_message(nebel_gl_draw_fog(s->gl, &pass), wanted, part);
    pass_expect_no_errors();
}

/* OpenGL 3.3 tells of what kind a texture is by an error alone, which does not stay. */
static void refuse_texture(const stage *s, nebel_gl_pass pass, const char *part)
{
    expect_message(nebel_gl_draw_fog(s->gl, &pass), NEBEL_ERROR_ARGUMENT, part);
    assert_int_equal(pass_take_errors(), 1);
    pass_expect_no_errors();
}

/* Each message names the field, whatever the others are. */
static void refuse_depths(stage *s)
{
    const struct {
        nebel_depth_desc depth;
        const char *field;
    } cases[] = {
        {{.range = {.5, .5}}, "depth.range must"},
        {{.range = {0, (double)INFINITY}}, "depth.range must"},
        {{.background = (nebel_background_depth)3}, "depth.sky must"},
        {{.ray_start = (nebel_ray_start)2}, "depth.start must"},
        {{.encoding = NEBEL_DEPTH_ENCODING_COUNT}, "depth.kind must"},
        {{.encoding = NEBEL_DEPTH_ENCODING_LOGARITHMIC}, "depth.log_far must"},
        {{.encoding = NEBEL_DEPTH_ENCODING_LOGARITHMIC, .log_scale = -1, .log_far = 9}, "depth.log_scale must"},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        nebel_gl_pass pass = pass_of(s);
        pass.depth = cases[i].depth;
        refuse(s, pass, NEBEL_ERROR_ARGUMENT, cases[i].field);
    }
}

static void test_passes_that_cannot_be_drawn(void **state)
{
    (void)state;
    static stage s;
    open_stage(&s, NB_GL_330);
    nebel_gl_pass pass = pass_of(&s);
    expect_message(nebel_gl_draw_fog(s.gl, NULL), NEBEL_ERROR_ARGUMENT, "pass is missing");
    pass.output = NEBEL_GL_OUTPUT_COUNT;
    refuse(&s, pass, NEBEL_ERROR_ARGUMENT, "no such output");
    pass = pass_of(&s);
    pass.depth_texture = 0;
    refuse(&s, pass, NEBEL_ERROR_ARGUMENT, "depth_texture 0");
    pass = pass_of(&s);
    pass.color_texture = 4711;
    refuse(&s, pass, NEBEL_ERROR_ARGUMENT, "color_texture 4711");
    pass.color_texture = s.target;
    refuse(&s, pass, NEBEL_ERROR_ARGUMENT, "is the target, too");
    pass = pass_of(&s);
    pass.x = 1;
    refuse(&s, pass, NEBEL_ERROR_ARGUMENT, "reaches to 97, 64");
    refuse_depths(&s);
    pass = pass_of(&s);
    pass.samples = 4;
    pass.output = NEBEL_GL_OUTPUT_BLEND;
    refuse(&s, pass, NEBEL_ERROR_ARGUMENT, "the target has 0 samples, not 4");
    pass.output = NEBEL_GL_OUTPUT_COMPOSE;
    refuse_texture(&s, pass, "is none of GL_TEXTURE_2D_MULTISAMPLE");
    pass.samples = 0;
    glGenTextures(1, &pass.depth_texture);
    glBindTexture(GL_TEXTURE_CUBE_MAP, pass.depth_texture);
    glBindTexture(GL_TEXTURE_CUBE_MAP, 0);
    refuse_texture(&s, pass, "is none of GL_TEXTURE_2D,");
    glDeleteTextures(1, &pass.depth_texture);
    pass = pass_of(&s);
    pass.samples = 33;
    refuse(&s, pass, NEBEL_ERROR_LIMIT, "32 samples");
    close_stage(&s);
}

static void test_targets_that_do_not_fit(void **state)
{
    (void)state;
    static stage s;
    open_stage(&s, NB_GL_300ES);
    nebel_gl_pass pass = pass_of(&s);
    pass.output = NEBEL_GL_OUTPUT_SPLIT;
    refuse(&s, pass, NEBEL_ERROR_ARGUMENT, "draw buffer 1 is GL_NONE");
    const unsigned both = pass_framebuffer(s.target, s.second);
    refuse(&s, pass_of(&s), NEBEL_ERROR_ARGUMENT, "draw buffer 1 is not GL_NONE");
    assert_int_equal(nebel_gl_draw_fog(s.gl, &pass), NEBEL_OK);
    pass_delete_framebuffer(both);
    unsigned empty;
    glGenFramebuffers(1, &empty);
    glBindFramebuffer(GL_FRAMEBUFFER, empty);
    refuse(&s, pass_of(&s), NEBEL_ERROR_ARGUMENT, "not complete");
    pass_delete_framebuffer(empty);
    close_stage(&s);
}

static void EPOXY_CALLSPEC tell_no_size(GLenum target, GLint level, GLenum name, GLint *value)
{
    fail_msg("glGetTexLevelParameteriv(%#x, %d, %#x, %p) in OpenGL ES 3.0", target, (int)level, name, (void *)value);
}

/* OpenGL ES 3.1 tells sizes, OpenGL ES 3.0 has no function that would. */
static void test_textures_too_small_for_embedded_contexts(void **state)
{
    (void)state;
    static stage s;
    open_stage(&s, NB_GL_300ES);
    nebel_gl_pass pass = pass_of(&s);
    pass.x = 1;
    refuse(&s, pass, NEBEL_ERROR_ARGUMENT, "the depth texture is only");
    pass.x = 0;
    pass.color_texture = pass_color_texture(PASS_WIDTH, PASS_HEIGHT - 1, 4, NULL);
    refuse(&s, pass, NEBEL_ERROR_ARGUMENT, "the color texture is only");
    nebel_destroy_gl(s.gl);

    const nebel_gl_desc desc = desc_of(NULL);
    const PFNGLGETTEXLEVELPARAMETERIVPROC true_tell = epoxy_glGetTexLevelParameteriv;
    assert_int_equal(create_with_version("OpenGL ES 3.0 Modest Driver", &desc, &s.gl), NEBEL_OK);
    assert_int_equal(nebel_gl_set_fog(s.gl, s.fog, &s.picture.view), NEBEL_OK);
    epoxy_glGetTexLevelParameteriv = tell_no_size;
    const nebel_result result = nebel_gl_draw_fog(s.gl, &pass);
    epoxy_glGetTexLevelParameteriv = true_tell;
    assert_int_equal(result, NEBEL_OK);
    glDeleteTextures(1, &pass.color_texture);
    close_stage(&s);
}

static PFNGLGETSTRINGIPROC true_get_stringi;

static const GLubyte *EPOXY_CALLSPEC without_dual_source(GLenum name, GLuint index)
{
    const GLubyte *const text = true_get_stringi(name, index);
    return strcmp((const char *)text, "GL_EXT_blend_func_extended") == 0 ? (const GLubyte *)"GL_hidden" : text;
}

static void test_what_embedded_contexts_lack(void **state)
{
    (void)state;
    static stage s;
    open_stage(&s, NB_GL_300ES);
    const nebel_gl_desc desc = desc_of(NULL);
    nebel_gl_pass pass = pass_of(&s);
    pass.samples = 4;
    refuse(&s, pass, NEBEL_ERROR_UNSUPPORTED, "glBlitFramebuffer");
    nebel_destroy_gl(s.gl);
    true_get_stringi = epoxy_glGetStringi;
    epoxy_glGetStringi = without_dual_source;
    assert_int_equal(nebel_create_gl(&desc, &s.gl), NEBEL_OK);
    epoxy_glGetStringi = true_get_stringi;
    assert_int_equal(nebel_gl_set_fog(s.gl, s.fog, &s.picture.view), NEBEL_OK);
    pass = pass_of(&s);
    pass.output = NEBEL_GL_OUTPUT_BLEND;
    refuse(&s, pass, NEBEL_ERROR_UNSUPPORTED, "NEBEL_GL_OUTPUT_BLEND_GRAY");
    pass.output = NEBEL_GL_OUTPUT_BLEND_GRAY;
    assert_int_equal(nebel_gl_draw_fog(s.gl, &pass), NEBEL_OK);
    close_stage(&s);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_no_context_is_said),
        cmocka_unit_test(test_old_contexts_are_named),
        cmocka_unit_test(test_another_context_is_refused),
        cmocka_unit_test(test_a_lost_context_is_survived),
        cmocka_unit_test(test_shaders_that_the_driver_refuses),
        cmocka_unit_test(test_more_volumes_than_a_texture_holds),
        cmocka_unit_test(test_a_driver_without_memory),
        cmocka_unit_test(test_memory_that_runs_out),
        cmocka_unit_test(test_views_that_are_none),
        cmocka_unit_test(test_passes_that_cannot_be_drawn),
        cmocka_unit_test(test_targets_that_do_not_fit),
        cmocka_unit_test(test_textures_too_small_for_embedded_contexts),
        cmocka_unit_test(test_what_embedded_contexts_lack),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
