/* The same as test_null.c of the functions that call OpenGL, in a context. */
#include "fog_help.h"
#include "pass_help.h"

#include <nebel/gl.h>

#include <string.h>

/* ---- good arguments -------------------------------------------------------------------------- */

static const float floats[4] = {1, 1, 1, 1};
static const nebel_log good_log = {.write = NULL};
static const nebel_particle good_particle = {.radius = 1};
static const nebel_camera good_camera = {.look_at = {0, 0, -1}, .up = {0, 1, 0}, .vertical_fov = 50};
static const nebel_gl_desc good_gl_desc = {.host.log = {NULL, NULL}};
static const nebel_gl_pass good_gl_pass = {.output = NEBEL_GL_OUTPUT_SPLIT};
static const nebel_gl_classic_desc good_gl_classic_desc = {.kind = NEBEL_GL_CLASSIC_FOG_COORD};
static const nebel_gl_renderer_desc good_gl_renderer_desc = {.host.log = {NULL, NULL}};
static const nebel_gl_frame_desc good_gl_frame_desc = {
    .camera = {.look_at = {0, 0, -1}, .up = {0, 1, 0}, .vertical_fov = 50}, .width = 1, .height = 1, .samples = 1};
static const nebel_view good_view = {.eye_from_world = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1},
                                     .clip_from_eye = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, -1, -1, 0, 0, -2, 0},
                                     .width = 16,
                                     .height = 16};

static struct {
    nebel_gl_fog_resources gl_fog_resources;
    nebel_gl_textures gl_textures;
    nebel_view view;
    float floats[4];
} out;

static const nebel_gl_planes good_gl_planes = {.color = out.floats};
static const nebel_vertex_output good_vertex_output = {NEBEL_VERTEX_COORDINATE, out.floats, 0};
static const nebel_scene_data nothing;

static struct {
    nb_gl context;
    nebel_lighting *lighting;
    const nebel_scene_data *contents;
    nebel_gl *gl;
    nebel_gl_classic *gl_classic;
    nebel_gl_renderer *gl_renderer;
} made;

static struct {
    nebel_gl *gl;
    nebel_gl_classic *gl_classic;
    nebel_gl_renderer *gl_renderer;
} fresh;

static int make_things(void **state)
{
    (void)state;
    pass_open(&made.context, NB_GL_330);
    made.lighting = fog_light(NULL, NULL, 0);
    made.contents = &nothing;
    assert_int_equal(nebel_create_gl(&good_gl_desc, &made.gl), NEBEL_OK);
    assert_int_equal(nebel_create_gl_classic(&good_gl_classic_desc, &made.gl_classic), NEBEL_OK);
    assert_int_equal(nebel_create_gl_renderer(&nothing, made.lighting, &good_gl_renderer_desc, &made.gl_renderer),
                     NEBEL_OK);
    return 0;
}

static int free_things(void **state)
{
    (void)state;
    nebel_destroy_gl_renderer(made.gl_renderer);
    nebel_destroy_gl_classic(made.gl_classic);
    nebel_destroy_gl(made.gl);
    nebel_release_lighting(made.lighting);
    pass_close(&made.context);
    return 0;
}

/* ---- calls ----------------------------------------------------------------------------------- */

static void check(const char *call, nebel_result result)
{
    if (result != NEBEL_OK && result != NEBEL_ERROR_ARGUMENT) fail_msg("%s: %s", call, nebel_result_text(result));
    nebel_destroy_gl_renderer(fresh.gl_renderer);
    nebel_destroy_gl_classic(fresh.gl_classic);
    nebel_destroy_gl(fresh.gl);
    memset(&fresh, 0, sizeof fresh);
    pass_expect_no_errors();
}

#define TRY(call) check(#call, call)
#define RUN(call) ((void)(call))

#include NB_NULL_CALLS_gl

int main(void)
{
    const struct CMUnitTest tests[] = {NULL_TESTS};
    return cmocka_run_group_tests(tests, make_things, free_things);
}
