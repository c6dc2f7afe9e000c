/* Nothing is packed, listed or handed to OpenGL again that the last call has left there: functions of OpenGL are
 * replaced by ones that count. What is drawn is compared with what a new nebel_gl draws. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "fog_help.h"
#include "pass_help.h"

#include <epoxy/gl.h>
#include <nebel/gl.h>

/* ---- counting -------------------------------------------------------------------------------- */

static PFNGLBUFFERSUBDATAPROC true_buffer;
static PFNGLTEXSUBIMAGE2DPROC true_texture;
static int words, tiles, voxels; /* uploads */

static void EPOXY_CALLSPEC count_buffer(GLenum target, GLintptr offset, GLsizeiptr size, const void *data)
{
    words++;
    true_buffer(target, offset, size, data);
}

static void EPOXY_CALLSPEC count_texture(GLenum target, GLint level, GLint x, GLint y, GLsizei width, GLsizei height,
                                         GLenum format, GLenum type, const void *data)
{
    if (format == GL_RED_INTEGER) {
        tiles++;
    } else if (format == GL_RGBA_INTEGER) {
        voxels++;
    } else {
        words++;
    }
    true_texture(target, level, x, y, width, height, format, type, data);
}

/* Functions are loaded when they are first called, and can be replaced from then on. */
static void load_functions(void)
{
    GLuint buffer, texture;
    const float texel[4] = {0};
    glGenBuffers(1, &buffer);
    glBindBuffer(GL_UNIFORM_BUFFER, buffer);
    glBufferData(GL_UNIFORM_BUFFER, sizeof texel, NULL, GL_STREAM_DRAW);
    glBufferSubData(GL_UNIFORM_BUFFER, 0, sizeof texel, texel);
    glDeleteBuffers(1, &buffer);
    glGenTextures(1, &texture);
    glBindTexture(GL_TEXTURE_2D, texture);
    glTexImage2D(GL_TEXTURE_2D, 0, GL_RGBA32F, 1, 1, 0, GL_RGBA, GL_FLOAT, NULL);
    glTexSubImage2D(GL_TEXTURE_2D, 0, 0, 0, 1, 1, GL_RGBA, GL_FLOAT, texel);
    glDeleteTextures(1, &texture);
}

static void start_counting(void)
{
    load_functions();
    true_buffer = epoxy_glBufferSubData;
    true_texture = epoxy_glTexSubImage2D;
    epoxy_glBufferSubData = count_buffer;
    epoxy_glTexSubImage2D = count_texture;
    words = tiles = voxels = 0;
}

static void stop_counting(void)
{
    epoxy_glBufferSubData = true_buffer;
    epoxy_glTexSubImage2D = true_texture;
}

static void expect_uploads(int of_words, int of_tiles)
{
    assert_int_equal(words, of_words);
    assert_int_equal(tiles, of_tiles);
    words = tiles = 0;
}

/* ---- passes ---------------------------------------------------------------------------------- */

static const range usual = {-1, 0};

static void draw(nebel_gl *gl, float texels[4 * PASS_PIXELS])
{
    static float none[PASS_PIXELS];
    for (int i = 0; i < PASS_PIXELS; i++) none[i] = 1;
    const unsigned depth = pass_depth_texture(PASS_WIDTH, PASS_HEIGHT, none);
    const unsigned target = pass_color_texture(PASS_WIDTH, PASS_HEIGHT, 4, NULL);
    const unsigned second = pass_color_texture(PASS_WIDTH, PASS_HEIGHT, 4, NULL);
    const unsigned framebuffer = pass_framebuffer(target, second);
    const nebel_gl_pass pass = {.output = NEBEL_GL_OUTPUT_SPLIT, .depth_texture = depth};
    assert_int_equal(nebel_gl_draw_fog(gl, &pass), NEBEL_OK);
    pass_read(target, PASS_WIDTH, PASS_HEIGHT, texels);
    pass_delete_framebuffer(framebuffer);
    pass_delete_texture(depth);
    pass_delete_texture(target);
    pass_delete_texture(second);
}

/* Sets the fog, which must take so many uploads and draw what a nebel_gl draws that knows nothing yet. */
static void check(nebel_gl *gl, nebel_lighting *fog, const nebel_view *view, int of_words, int of_tiles)
{
    static float got[4 * PASS_PIXELS], wanted[4 * PASS_PIXELS];
    nebel_gl *fresh = NULL;
    start_counting();
    assert_int_equal(nebel_gl_set_fog(gl, fog, view), NEBEL_OK);
    expect_uploads(of_words, of_tiles);
    stop_counting();
    assert_int_equal(nebel_create_gl(&(nebel_gl_desc){0}, &fresh), NEBEL_OK);
    assert_int_equal(nebel_gl_set_fog(fresh, fog, view), NEBEL_OK);
    draw(gl, got);
    draw(fresh, wanted);
    assert_memory_equal(got, wanted, sizeof got);
    nebel_destroy_gl(fresh);
}

/* Whether the eye is the same to the last bit; the way from a turned or widened view to its eye has roundings. */
static int moves(const nebel_view *from, const nebel_view *to)
{
    nebel_rays a, b;
    assert_int_equal(nebel_compute_view_rays(from, NULL, &a), NEBEL_OK);
    assert_int_equal(nebel_compute_view_rays(to, NULL, &b), NEBEL_OK);
    return memcmp(a.eye, b.eye, sizeof a.eye) != 0;
}

/* In the end another lighting of the same fog, which counts as another. */
static void check_fog(nebel_gl *gl, int more, int of_tiles)
{
    const nebel_view first = pass_view(PERSPECTIVE, usual, 0, 0);
    nebel_lighting *fog = pass_fog(more);
    check(gl, fog, &first, 1, of_tiles);
    check(gl, fog, &first, 0, 0);
    nebel_view view = first;
    view.clip_from_eye[0] *= 2;
    assert_false(moves(&first, &view));
    check(gl, fog, &view, 0, of_tiles);
    view.width /= 2;
    check(gl, fog, &view, 0, of_tiles);
    view = pass_view(PERSPECTIVE, usual, .4, -.1);
    check(gl, fog, &view, moves(&first, &view), of_tiles);
    view.eye_from_world[12] += .5;
    check(gl, fog, &view, 1, of_tiles);
    nebel_release_lighting(fog);
    fog = pass_fog(more);
    check(gl, fog, &view, 1, of_tiles);
    nebel_release_lighting(fog);
}

static void test_passes_hand_over_what_is_new(void **state)
{
    (void)state;
    nb_gl context;
    nebel_gl *gl = NULL;
    const nebel_view view = pass_view(PERSPECTIVE, usual, .3, -.1);
    pass_open(&context, NB_GL_330);
    assert_int_equal(nebel_create_gl(&(nebel_gl_desc){0}, &gl), NEBEL_OK);
    check(gl, NULL, &view, 1, 0);
    check(gl, NULL, &view, 0, 0);
    check_fog(gl, -1, 0);
    check_fog(gl, 60, 1);
    nebel_destroy_gl(gl);
    pass_close(&context);
}

/* A box before the eye. */
static nebel_lighting *fog_of_voxels(nebel_grid *grid, double extinction)
{
    const double *const e = pass_eye;
    nebel_volume_desc v = {.shape = {.type = NEBEL_SHAPE_BOX,
                                     .min = {e[0] - 3, e[1] - 3, e[2] - 12},
                                     .max = {e[0] + 3, e[1] + 3, e[2] - 6}},
                           .density = {.type = NEBEL_DENSITY_GRID, .grid = grid},
                           .source = {1, .8, .6}};
    for (int i = 0; i < 3; i++) v.extinction[i] = extinction;
    return fog_light(NULL, &v, 1);
}

/* 10 voxels along each axis, the last of which is `last`. */
static nebel_grid *grid_ending_in(float last)
{
    enum { SIDE = 10 };
    float densities[SIDE * SIDE * SIDE];
    nebel_grid *grid = NULL;
    for (int i = 0; i < SIDE * SIDE * SIDE; i++) densities[i] = (float)(i % 7) / 6;
    densities[SIDE * SIDE * SIDE - 1] = last;
    const nebel_grid_desc desc = {.size = {SIDE, SIDE, SIDE}, .voxels = densities};
    assert_int_equal(nebel_create_grid(&desc, &grid), NEBEL_OK);
    return grid;
}

/* Voxels are handed over when there are others, not when the eye moves or the same ones come back. */
static void test_voxels_stay(void **state)
{
    (void)state;
    nb_gl context;
    nebel_gl *gl = NULL;
    nebel_view view = pass_view(PERSPECTIVE, usual, 0, 0);
    nebel_grid *const grids[] = {grid_ending_in(1), grid_ending_in(1), grid_ending_in(2)};
    nebel_lighting *const fogs[] = {fog_of_voxels(grids[0], .3), fog_of_voxels(grids[1], .4), pass_fog(-1),
                                    fog_of_voxels(grids[0], .5), fog_of_voxels(grids[2], .5)};
    const int uploads[] = {1, 0, 0, 0, 1};
    pass_open(&context, NB_GL_330);
    assert_int_equal(nebel_create_gl(&(nebel_gl_desc){0}, &gl), NEBEL_OK);
    for (int i = 0; i < 5; i++) {
        check(gl, fogs[i], &view, 1, 0);
        assert_int_equal(voxels, uploads[i]);
        view.eye_from_world[12] += .5;
        check(gl, fogs[i], &view, 1, 0);
        assert_int_equal(voxels, 0);
    }
    nebel_destroy_gl(gl);
    for (int i = 0; i < 5; i++) nebel_release_lighting(fogs[i]);
    for (int i = 0; i < 3; i++) nebel_release_grid(grids[i]);
    pass_close(&context);
}

/* An error forgets what was there. */
static void test_errors_are_not_kept(void **state)
{
    (void)state;
    nb_gl context;
    nebel_gl *gl = NULL;
    nebel_view view = pass_view(PERSPECTIVE, usual, .3, -.1);
    nebel_lighting *const fog = pass_fog(60);
    pass_open(&context, NB_GL_330);
    assert_int_equal(nebel_create_gl(&(nebel_gl_desc){0}, &gl), NEBEL_OK);
    check(gl, fog, &view, 1, 1);
    view.height = 0;
    assert_int_equal(nebel_gl_set_fog(gl, fog, &view), NEBEL_ERROR_ARGUMENT);
    assert_int_equal(nebel_gl_draw_fog(gl, &(nebel_gl_pass){0}), NEBEL_ERROR_ARGUMENT);
    view.height = PASS_HEIGHT;
    check(gl, fog, &view, 0, 0);
    nebel_destroy_gl(gl);
    nebel_release_lighting(fog);
    pass_close(&context);
}

/* ---- the scene renderer ---------------------------------------------------------------------- */

/* All samples of all frames of a camera that stands still. */
static void test_samples_share_the_fog(void **state)
{
    (void)state;
    nb_gl context;
    nebel_gl_renderer *renderer = NULL;
    nebel_lighting *const fog = pass_fog(60);
    const nebel_scene_data scene = {.ambient = {1, 1, 1}};
    nebel_gl_frame_desc frame = {
        .camera = {.look_at = {4e4, 12, -7e4 - 9}, .up = {0, 1, 0}, .vertical_fov = 60}, .width = 64, .height = 48};
    memcpy(frame.camera.position, pass_eye, sizeof frame.camera.position);
    pass_open(&context, NB_GL_330);
    assert_int_equal(nebel_create_gl_renderer(&scene, fog, &(nebel_gl_renderer_desc){0}, &renderer), NEBEL_OK);
    start_counting();
    for (int i = 0; i < 3; i++) assert_int_equal(nebel_gl_render_frame(renderer, &frame), NEBEL_OK);
    expect_uploads(1, 1);
    stop_counting();
    nebel_destroy_gl_renderer(renderer);
    nebel_release_lighting(fog);
    pass_close(&context);
}

/* What the sun passes on its way to a surface, and what the eye sees of it, are the same texels. Each frame has other voxels, or
 * the first again. */
static void test_sun_and_eye_share_voxels(void **state)
{
    (void)state;
    static const float floor[4][3] = {{-9, -2, 9}, {9, -2, 9}, {9, -2, -9}, {-9, -2, -9}};
    static const uint32_t indices[6] = {0, 1, 2, 0, 2, 3};
    const nebel_mesh mesh = {.positions = floor[0],
                             .indices = indices,
                             .vertex_count = 4,
                             .triangle_count = 2,
                             .base_color = {.5f, .5f, .5f},
                             .texture = -1};
    const nebel_scene_data scene = {
        .mesh_count = 1, .meshes = &mesh, .has_sun = 1, .sun_direction = {.1, 1, .2}, .sun_irradiance = {3, 3, 3}};
    const nebel_gl_frame_desc frame = {
        .camera = {.position = {0, 1, 6}, .look_at = {0, -1, 0}, .up = {0, 1, 0}, .vertical_fov = 60},
        .width = 32,
        .height = 24};
    nb_gl context;
    nebel_gl_renderer *renderer = NULL;
    nebel_grid *const grids[] = {grid_ending_in(1), grid_ending_in(2)};
    pass_open(&context, NB_GL_330);
    assert_int_equal(nebel_create_gl_renderer(&scene, NULL, &(nebel_gl_renderer_desc){0}, &renderer), NEBEL_OK);
    start_counting();
    for (int i = 0; i < 3; i++) {
        nebel_lighting *const fog = fog_of_voxels(grids[i % 2], .3);
        assert_int_equal(nebel_set_gl_renderer_lighting(renderer, fog), NEBEL_OK);
        assert_int_equal(nebel_gl_render_frame(renderer, &frame), NEBEL_OK);
        assert_int_equal(voxels, i + 1);
        nebel_release_lighting(fog);
    }
    stop_counting();
    nebel_destroy_gl_renderer(renderer);
    for (int i = 0; i < 2; i++) nebel_release_grid(grids[i]);
    pass_close(&context);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_passes_hand_over_what_is_new), cmocka_unit_test(test_voxels_stay),
        cmocka_unit_test(test_errors_are_not_kept),          cmocka_unit_test(test_samples_share_the_fog),
        cmocka_unit_test(test_sun_and_eye_share_voxels),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
