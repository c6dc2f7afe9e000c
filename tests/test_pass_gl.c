/* The pictures that passes draw, pixel by pixel against nebel_trace in double. */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "pass_help.h"

static const range usual = {-1, 0}, zero_to_one = {0, 0}, reversed = {0, 1};

/* ---- S and T --------------------------------------------------------------------------------- */

typedef struct split {
    float in_scattering[4 * PASS_PIXELS], transmittance[4 * PASS_PIXELS];
} split;

static void draw_split(nebel_gl *gl, nebel_lighting *fog, const pass_picture *picture, split *out)
{
    const int width = (int)picture->view.width, height = (int)picture->view.height;
    const int window = picture->depth.encoding == NEBEL_DEPTH_ENCODING_WINDOW;
    const unsigned depth = window ? pass_depth_texture(width, height, picture->stored)
                                  : pass_color_texture(width, height, 1, picture->stored);
    const unsigned first = pass_color_texture(width, height, 4, NULL),
                   second = pass_color_texture(width, height, 4, NULL);
    const unsigned target = pass_framebuffer(first, second);
    assert_int_equal(nebel_gl_set_fog(gl, fog, &picture->view), NEBEL_OK);
    assert_int_equal(
        nebel_gl_draw_fog(
            gl, &(nebel_gl_pass){.output = NEBEL_GL_OUTPUT_SPLIT, .depth_texture = depth, .depth = picture->depth}),
        NEBEL_OK);
    pass_read(first, width, height, out->in_scattering);
    pass_read(second, width, height, out->transmittance);
    pass_delete_framebuffer(target);
    pass_delete_texture(depth);
    pass_delete_texture(first);
    pass_delete_texture(second);
    pass_expect_no_errors();
}

static void compare_split(const nebel_lighting *fog, const pass_picture *picture, const split *got, const char *name)
{
    pass_difference difference = {0, 0, 0};
    for (int y = 0; y < (int)picture->view.height; y++) {
        for (int x = 0; x < (int)picture->view.width; x++) {
            const size_t at = 4 * ((size_t)y * picture->view.width + (size_t)x);
            const nebel_transfer transfer = pass_trace(fog, picture, x, y);
            const int fogged = transfer.transmittance[2] < 1 - 1e-4;
            pass_note(&difference, got->in_scattering + at, transfer.in_scattering, fogged);
            pass_note(&difference, got->transmittance + at, transfer.transmittance, 0);
            assert_true(got->in_scattering[at + 3] == 1 && got->transmittance[at + 3] == 1);
        }
    }
    print_message("%s: %zu pixels with fog, %zu beyond 1/255, worst %.1e\n", name, difference.fogged,
                  difference.beyond_step, difference.largest);
    assert_true(difference.fogged > PASS_PIXELS / 10);
    assert_true((double)difference.beyond_step <= 1e-3 * (double)difference.fogged);
    assert_true(difference.largest <= 3. / 255);
}

static void check_picture(nebel_gl *gl, nebel_lighting *fog, pass_picture *picture, const char *name)
{
    static split got;
    pass_fill(picture);
    draw_split(gl, fog, picture, &got);
    compare_split(fog, picture, &got, name);
}

/* ---- the stage ------------------------------------------------------------------------------- */

typedef struct stage {
    nb_gl context;
    nebel_gl *gl;
    int objects;
} stage;

static void write_message(nebel_log_level level, nebel_result result, const char *message, void *user)
{
    (void)level;
    (void)user;
    print_message("%d: %s\n", (int)result, message);
}

static stage open_stage(nb_gl_language language)
{
    stage s;
    pass_open(&s.context, language);
    s.objects = pass_count_objects();
    assert_int_equal(nebel_create_gl(&(nebel_gl_desc){.host.log = {write_message, NULL}}, &s.gl), NEBEL_OK);
    return s;
}

static void close_stage(stage *s)
{
    nebel_destroy_gl(s->gl);
    assert_int_equal(pass_count_objects(), s->objects);
    pass_close(&s->context);
}

static const nb_gl_language languages[] = {NB_GL_330, NB_GL_300ES};

/* ---- tests ----------------------------------------------------------------------------------- */

static void check_projections(nb_gl_language language)
{
    stage s = open_stage(language);
    nebel_lighting *const fog = pass_fog(0);
    for (int kind = 0; kind < PROJECTIONS; kind++) {
        pass_picture picture = {.view = pass_view(kind, usual, .3, -.1), .clip = usual};
        check_picture(s.gl, fog, &picture, projections[kind].name);
        picture =
            (pass_picture){.view = pass_view(kind, reversed, .3, -.1), .clip = reversed, .depth = {.zero_to_one = 1}};
        check_picture(s.gl, fog, &picture, projections[kind].name);
    }
    nebel_release_lighting(fog);
    close_stage(&s);
}

static void test_every_projection_agrees_with_trace(void **state)
{
    (void)state;
    for (int i = 0; i < 2; i++) check_projections(languages[i]);
}

static void test_every_kind_of_depth_agrees_with_trace(void **state)
{
    (void)state;
    const nebel_depth_desc kinds[] = {
        {.range = {.25, .75}, .zero_to_one = 1},
        {.encoding = NEBEL_DEPTH_ENCODING_AXIAL},
        {.encoding = NEBEL_DEPTH_ENCODING_RADIAL},
        {.encoding = NEBEL_DEPTH_ENCODING_LOGARITHMIC, .log_scale = 2, .log_far = 1e6},
    };
    for (int i = 0; i < 2; i++) {
        stage s = open_stage(languages[i]);
        nebel_lighting *const fog = pass_fog(0);
        for (size_t k = 0; k < sizeof kinds / sizeof *kinds; k++) {
            const range clip = kinds[k].zero_to_one ? zero_to_one : usual;
            pass_picture picture = {.view = pass_view(PERSPECTIVE, clip, .3, -.1), .clip = clip, .depth = kinds[k]};
            char name[32];
            snprintf(name, sizeof name, "depth convention %zu", k);
            check_picture(s.gl, fog, &picture, name);
        }
        nebel_release_lighting(fog);
        close_stage(&s);
    }
}

/* Ninety degrees each, along the axes of a camera turned by yaw. */
static nebel_view cube_face(int face, double yaw)
{
    const double quarter = 1.5707963267948966;
    nebel_view view = {.width = PASS_HEIGHT, .height = PASS_HEIGHT};
    const matrix clip = frustum(usual, -1, 1, -1, 1, .1, 1000);
    const matrix eye = look(pass_eye, yaw + (face < 4 ? face : 0) * quarter,
                            face < 4    ? 0
                            : face == 4 ? quarter
                                        : -quarter);
    memcpy(view.clip_from_eye, clip.m, sizeof view.clip_from_eye);
    memcpy(view.eye_from_world, eye.m, sizeof view.eye_from_world);
    return view;
}

static void test_cube_faces_agree_with_trace(void **state)
{
    (void)state;
    stage s = open_stage(NB_GL_330);
    nebel_lighting *const fog = pass_fog(0);
    for (int face = 0; face < 6; face++) {
        pass_picture picture = {.view = cube_face(face, .2), .clip = usual};
        char name[32];
        snprintf(name, sizeof name, "cube face %d", face);
        check_picture(s.gl, fog, &picture, name);
    }
    nebel_release_lighting(fog);
    close_stage(&s);
}

/* The part of a picture of `size` pixels at (x, y), as an off-axis projection of its own. */
static nebel_view tile_of(const nebel_view *whole, uint32_t x, uint32_t y, uint32_t size)
{
    nebel_view tile = *whole;
    const double across = (double)whole->width / size, up = (double)whole->height / size;
    const double right = (whole->width - 2. * x - size) / size, above = (whole->height - 2. * y - size) / size;
    for (int i = 0; i < 16; i += 4) {
        const double *const from = whole->clip_from_eye + i;
        tile.clip_from_eye[i] = across * from[0] + right * from[3];
        tile.clip_from_eye[i + 1] = up * from[1] + above * from[3];
    }
    tile.width = tile.height = size;
    return tile;
}

static double largest_difference(const float *a, const float *b)
{
    double largest = 0;
    for (int c = 0; c < 3; c++) largest = fmax(largest, fabs((double)a[c] - (double)b[c]));
    return largest;
}

/* How the numbers of two renditions of the same pixels differ. */
typedef struct agreement {
    size_t count, beyond; /* 2e-6 */
    double largest;
} agreement;

static void agree(agreement *a, const split *first, size_t i, const split *second, size_t k)
{
    const double off = fmax(largest_difference(first->in_scattering + 4 * i, second->in_scattering + 4 * k),
                            largest_difference(first->transmittance + 4 * i, second->transmittance + 4 * k));
    a->count++;
    a->beyond += !(off <= 2e-6);
    if (!(off <= a->largest)) a->largest = off;
}

static agreement compare_tiles(nebel_gl *gl, nebel_lighting *fog)
{
    enum { TILE = 16 };
    static split whole, part;
    agreement a = {0, 0, 0};
    pass_picture picture = {.view = pass_view(PERSPECTIVE, usual, .3, -.1), .clip = usual};
    pass_fill(&picture);
    draw_split(gl, fog, &picture, &whole);
    for (uint32_t k = 0; k < PASS_PIXELS / (TILE * TILE); k++) {
        const uint32_t x = k % (PASS_WIDTH / TILE) * TILE, y = k / (PASS_WIDTH / TILE) * TILE;
        pass_picture tile = {.view = tile_of(&picture.view, x, y, TILE), .clip = usual};
        for (uint32_t i = 0; i < TILE * TILE; i++) {
            tile.stored[i] = picture.stored[(y + i / TILE) * PASS_WIDTH + x + i % TILE];
        }
        draw_split(gl, fog, &tile, &part);
        for (uint32_t i = 0; i < TILE * TILE; i++) {
            agree(&a, &whole, (size_t)(y + i / TILE) * PASS_WIDTH + x + i % TILE, &part, i);
        }
    }
    print_message("of %zu pixels %zu differ by more than 2e-6, at most by %.1e\n", a.count, a.beyond, a.largest);
    return a;
}

/* Boxes have a closed form that no ray is delicate for. Where a ray only just touches a ball, a millionth of its
 * direction is a thousandth of its chord; and where light that varies is integrated, one step more or less is within
 * the tolerance. */
static void test_a_pixel_is_the_same_in_a_tile(void **state)
{
    (void)state;
    for (int i = 0; i < 2; i++) {
        stage s = open_stage(languages[i]);
        nebel_lighting *const flat = pass_fog(-1), *const round = pass_fog(0);
        assert_int_equal(compare_tiles(s.gl, flat).beyond, 0);
        const agreement a = compare_tiles(s.gl, round);
        assert_true(a.beyond <= a.count / 500 && a.largest < 1. / 255);
        nebel_release_lighting(flat);
        nebel_release_lighting(round);
        close_stage(&s);
    }
}

/* One pixel that looks at a point, from a camera turned by yaw and pitch. */
static pass_picture aim(double yaw, double pitch, const double point[3])
{
    const matrix eye = look(pass_eye, yaw, pitch);
    double in_eye[3], square = 0;
    pass_picture picture = {.clip = usual, .depth = {.encoding = NEBEL_DEPTH_ENCODING_RADIAL}};
    for (int i = 0; i < 3; i++) {
        in_eye[i] = eye.m[12 + i];
        for (int k = 0; k < 3; k++) in_eye[i] += eye.m[4 * k + i] * point[k];
        square += in_eye[i] * in_eye[i];
    }
    const double x = -in_eye[0] / in_eye[2], y = -in_eye[1] / in_eye[2];
    const matrix clip = frustum(usual, x - 1e-4, x + 1e-4, y - 1e-4, y + 1e-4, .1, 1000);
    memcpy(picture.view.clip_from_eye, clip.m, sizeof clip.m);
    memcpy(picture.view.eye_from_world, eye.m, sizeof eye.m);
    picture.view.width = picture.view.height = 1;
    picture.stored[0] = (float)sqrt(square);
    return picture;
}

static void test_turning_the_camera_changes_no_fog(void **state)
{
    (void)state;
    static split first, turned;
    stage s = open_stage(NB_GL_330);
    nebel_lighting *const fog = pass_fog(-1);
    double largest = 0;
    for (int i = 0; i < 40; i++) {
        const double angle = i * .7, away = 2 + 2.3 * i;
        const double point[3] = {pass_eye[0] + sin(angle) * away, pass_eye[1] + cos(3 * angle) * 2,
                                 pass_eye[2] - cos(angle) * away};
        const pass_picture ahead = aim(angle, 0, point);
        draw_split(s.gl, fog, &ahead, &first);
        for (int k = 0; k < 4; k++) {
            const pass_picture aside = aim(angle + .35 * (k - 1.5), .2 * (k - 1.5), point);
            draw_split(s.gl, fog, &aside, &turned);
            largest = fmax(largest, largest_difference(first.in_scattering, turned.in_scattering));
            largest = fmax(largest, largest_difference(first.transmittance, turned.transmittance));
        }
    }
    print_message("turning changes fog by at most %.1e\n", largest);
    assert_true(largest < 5e-6);
    nebel_release_lighting(fog);
    close_stage(&s);
}

/* ---- stored fog ------------------------------------------------------------------------------ */

static void test_many_volumes_agree_with_trace(void **state)
{
    (void)state;
    const int counts[] = {-1, 0, 40, 1000}; /* more than the usual four; below 0: two */
    for (int i = 0; i < 2; i++) {
        stage s = open_stage(languages[i]);
        for (size_t k = 0; k < sizeof counts / sizeof *counts; k++) {
            nebel_lighting *const fog = pass_fog(counts[k]);
            pass_picture picture = {
                .view = pass_view(PERSPECTIVE, reversed, .1, 0), .clip = reversed, .depth = {.zero_to_one = 1}};
            nebel_gl_fog_resources stored_fog;
            char name[64];
            snprintf(name, sizeof name, "%d volumes", counts[k] < 0 ? 2 : counts[k] + 4);
            check_picture(s.gl, fog, &picture, name);
            assert_int_equal(nebel_gl_get_fog_resources(s.gl, &stored_fog), NEBEL_OK);
            assert_true((stored_fog.block != 0) == (stored_fog.texel_count <= NEBEL_BLOCK_TEXELS));
            assert_true((stored_fog.texture != 0) == (stored_fog.texel_count > NEBEL_BLOCK_TEXELS));
            assert_true((stored_fog.tiles != 0) == (counts[k] >= 0));
            nebel_release_lighting(fog);
        }
        close_stage(&s);
    }
}

static void test_block_and_texture_give_the_same(void **state)
{
    (void)state;
    static split block, texture;
    stage s = open_stage(NB_GL_330);
    nebel_gl *other = NULL;
    nebel_gl_fog_resources stored_fog;
    nebel_lighting *const fog = pass_fog(0);
    pass_picture picture = {.view = pass_view(PERSPECTIVE, usual, 2, 0), .clip = usual};
    pass_fill(&picture);
    assert_int_equal(nebel_create_gl(&(nebel_gl_desc){.storage = NEBEL_GL_STORAGE_TEXTURE}, &other), NEBEL_OK);
    draw_split(s.gl, fog, &picture, &block);
    draw_split(other, fog, &picture, &texture);
    assert_int_equal(nebel_gl_get_fog_resources(other, &stored_fog), NEBEL_OK);
    assert_true(stored_fog.block == 0 && stored_fog.texture != 0);
    assert_memory_equal(&block, &texture, sizeof block);
    nebel_destroy_gl(other);
    nebel_release_lighting(fog);
    close_stage(&s);
}

static void test_no_fog_is_clear(void **state)
{
    (void)state;
    static split got;
    stage s = open_stage(NB_GL_300ES);
    pass_picture picture = {.view = pass_view(PERSPECTIVE, usual, 2, 0), .clip = usual};
    pass_fill(&picture);
    draw_split(s.gl, NULL, &picture, &got);
    for (int i = 0; i < PASS_PIXELS; i++) {
        for (int c = 0; c < 3; c++) assert_true(got.in_scattering[4 * i + c] == 0 && got.transmittance[4 * i + c] == 1);
    }
    close_stage(&s);
}

/* ---- outputs --------------------------------------------------------------------------------- */

/* Larger than the picture, which lies at (CORNER_X, CORNER_Y). */
enum {
    CORNER_X = 5,
    CORNER_Y = 9,
    SHEET_WIDTH = PASS_WIDTH + 16,
    SHEET_HEIGHT = PASS_HEIGHT + 16,
    SHEET = SHEET_WIDTH * SHEET_HEIGHT
};

static float sheet_color[4 * SHEET], sheet_depth[SHEET], sheet_out[4 * SHEET];

static int sheet_pixel(int x, int y)
{
    return (y + CORNER_Y) * SHEET_WIDTH + x + CORNER_X;
}

static void fill_sheet(const pass_picture *picture)
{
    for (int i = 0; i < SHEET; i++) {
        sheet_depth[i] = .5f;
        for (int c = 0; c < 4; c++) sheet_color[4 * i + c] = (float)(.1 + .05 * ((i * (c + 3)) % 17));
    }
    for (int i = 0; i < PASS_PIXELS; i++) sheet_depth[sheet_pixel(i % PASS_WIDTH, i / PASS_WIDTH)] = picture->stored[i];
}

/* Draws over a sheet that holds the colours already where the output blends, else zeros. */
static void draw_sheet(nebel_gl *gl, nebel_lighting *fog, const pass_picture *picture, nebel_gl_output output)
{
    static const float zeros[4 * SHEET];
    const int blends = output != NEBEL_GL_OUTPUT_COMPOSE;
    const unsigned depth = pass_depth_texture(SHEET_WIDTH, SHEET_HEIGHT, sheet_depth);
    const unsigned color = pass_color_texture(SHEET_WIDTH, SHEET_HEIGHT, 4, sheet_color);
    const unsigned target = pass_color_texture(SHEET_WIDTH, SHEET_HEIGHT, 4, blends ? sheet_color : zeros);
    const unsigned framebuffer = pass_framebuffer(target, 0);
    const nebel_gl_pass pass = {
        .output = output, .depth_texture = depth, .color_texture = blends ? 0 : color, .x = CORNER_X, .y = CORNER_Y};
    assert_int_equal(nebel_gl_set_fog(gl, fog, &picture->view), NEBEL_OK);
    assert_int_equal(nebel_gl_draw_fog(gl, &pass), NEBEL_OK);
    pass_read(target, SHEET_WIDTH, SHEET_HEIGHT, sheet_out);
    pass_delete_framebuffer(framebuffer);
    pass_delete_texture(depth);
    pass_delete_texture(color);
    pass_delete_texture(target);
    pass_expect_no_errors();
}

static void check_sheet(const split *fog, nebel_gl_output output)
{
    int outside = SHEET;
    for (int i = 0; i < PASS_PIXELS; i++) {
        const int at = 4 * sheet_pixel(i % PASS_WIDTH, i / PASS_WIDTH);
        const float *const t = fog->transmittance + 4 * i;
        const double grey = ((double)t[0] + (double)t[1] + (double)t[2]) / 3;
        for (int c = 0; c < 3; c++) {
            const double through = output == NEBEL_GL_OUTPUT_BLEND_GRAY ? grey : (double)t[c];
            const double wanted = through * (double)sheet_color[at + c] + (double)fog->in_scattering[4 * i + c];
            assert_true(fabs((double)sheet_out[at + c] - wanted) < 5e-7);
        }
        assert_true(sheet_out[at + 3] == sheet_color[at + 3]);
        memset(sheet_out + at, 0, 4 * sizeof *sheet_out);
        memset(sheet_color + at, 0, 4 * sizeof *sheet_color);
        outside--;
    }
    assert_int_equal(outside, SHEET - PASS_PIXELS);
    if (output != NEBEL_GL_OUTPUT_COMPOSE) {
        assert_memory_equal(sheet_out, sheet_color, sizeof sheet_out);
        return;
    }
    for (int i = 0; i < 4 * SHEET; i++) assert_true(sheet_out[i] == 0);
}

static void test_every_output_puts_the_same_fog_over_its_pixels(void **state)
{
    (void)state;
    static split fog_of_pixels;
    const nebel_gl_output outputs[] = {NEBEL_GL_OUTPUT_COMPOSE, NEBEL_GL_OUTPUT_BLEND, NEBEL_GL_OUTPUT_BLEND_GRAY};
    for (int i = 0; i < 2; i++) {
        stage s = open_stage(languages[i]);
        nebel_lighting *const fog = pass_fog(0);
        pass_picture picture = {.view = pass_view(PERSPECTIVE, usual, .3, -.1), .clip = usual};
        pass_fill(&picture);
        draw_split(s.gl, fog, &picture, &fog_of_pixels);
        for (int k = 0; k < 3; k++) {
            fill_sheet(&picture);
            draw_sheet(s.gl, fog, &picture, outputs[k]);
            check_sheet(&fog_of_pixels, outputs[k]);
        }
        nebel_release_lighting(fog);
        close_stage(&s);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_every_projection_agrees_with_trace),
        cmocka_unit_test(test_every_kind_of_depth_agrees_with_trace),
        cmocka_unit_test(test_cube_faces_agree_with_trace),
        cmocka_unit_test(test_a_pixel_is_the_same_in_a_tile),
        cmocka_unit_test(test_turning_the_camera_changes_no_fog),
        cmocka_unit_test(test_many_volumes_agree_with_trace),
        cmocka_unit_test(test_block_and_texture_give_the_same),
        cmocka_unit_test(test_no_fog_is_clear),
        cmocka_unit_test(test_every_output_puts_the_same_fog_over_its_pixels),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
