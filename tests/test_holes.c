/* Meshes with holes: what is seen through them and lit through them, against alpha that is looked up pixel by pixel; and
 * masks that are none. */
#include "test_render_scene.h"

#include "cpu/alpha_mask.h"
#include "dice.h"

enum { SIZE = 120 };

/* Straight down, 10 m for all pixels. */
static nebel_camera camera_above(void)
{
    nebel_camera camera = test_camera(0, 5, 0, 0, 0, 0);
    camera.projection = NEBEL_PROJECTION_ORTHOGRAPHIC;
    camera.up[1] = 0;
    camera.up[2] = -1;
    camera.view_height = 10;
    return camera;
}

static double at(uint32_t pixel)
{
    return (pixel + .5 - SIZE / 2) * 10 / SIZE;
}

typedef struct tally {
    size_t solid, hole, dark, lit;
} tally;

/* What alpha decides within a hundredth is left out: pixels at edges. */
static void check_pixel(const test_card *card, const test_picture *picture, uint32_t x, uint32_t y, tally *seen)
{
    static const double near = .01;
    const double *sun = card->scene.sun_direction, above = test_card_alpha(card, at(x), at(y));
    if (fabs(above) < near || fabs(fabs(at(x)) - 2) < 1e-6 || fabs(fabs(at(y)) - 2) < 1e-6) return;
    assert_true(fabs((double)test_depth(picture, x, y) - (above > 0 ? 3 : 5)) < 1e-4);
    seen->solid += above > 0;
    seen->hole += above < 0;
    if (above > 0) return;
    const double on_way[2] = {at(x) + 2 * sun[0] / sun[1], at(y) + 2 * sun[2] / sun[1]};
    const double shade = test_card_alpha(card, on_way[0], on_way[1]);
    if (fabs(shade) < near || fabs(fabs(on_way[0]) - 2) < 1e-3 || fabs(fabs(on_way[1]) - 2) < 1e-3) return;
    assert_true((test_color(picture, x, y)[0] == 0) == (shade > 0));
    seen->dark += shade > 0;
    seen->lit += shade < 0;
}

static void holes_are_where_alpha_is_low(void **state)
{
    static const float times[] = {1, 3, -2};
    test_picture picture = test_picture_make(SIZE, SIZE);
    static test_card card;
    (void)state;
    for (size_t i = 0; i < sizeof times / sizeof *times; i++) {
        tally seen = {0, 0, 0, 0};
        const nebel_camera camera = camera_above();
        test_card_make(&card, fabsf(times[i]));
        if (times[i] < 0)
            for (int k = 0; k < 8; k++) card.uvs[k] += -64; /* texture coordinates below 0 repeat as well */
        test_render(&card.scene, NULL, &(nebel_cpu_renderer_desc){0}, &camera, 1, &picture);
        if (times[i] < 0) test_card_make(&card, fabsf(times[i]));
        for (uint32_t y = 0; y < SIZE; y++)
            for (uint32_t x = 0; x < SIZE; x++) check_pixel(&card, &picture, x, y, &seen);
        assert_true(seen.solid > 500 && seen.hole > 500 && seen.dark > 300 && seen.lit > 300);
    }
    test_picture_free(&picture);
}

/* The reference meets and shades the same surfaces: with one bounce and nothing between all paths are alike. */
static void the_reference_has_the_same_holes(void **state)
{
    static test_card card;
    test_picture picture = test_picture_make(SIZE, SIZE), reference = test_picture_make(SIZE, SIZE);
    nebel_renderer *renderer = NULL;
    (void)state;
    test_card_make(&card, 3);
    const nebel_frame_desc frame = {
        .camera = camera_above(), .width = SIZE, .height = SIZE, .samples = 1, .bounces = 1};
    assert_int_equal(nebel_create_cpu_renderer(&card.scene, NULL, &(nebel_cpu_renderer_desc){0}, &renderer), NEBEL_OK);
    assert_int_equal(nebel_render_frame(renderer, &frame, &picture.planes), NEBEL_OK);
    assert_int_equal(nebel_set_renderer_method(renderer, NEBEL_METHOD_PATH, NULL), NEBEL_OK);
    assert_int_equal(nebel_render_frame(renderer, &frame, &reference.planes), NEBEL_OK);
    for (int i = 0; i < SIZE * SIZE; i++) {
        assert_true(picture.planes.depth[i] == reference.planes.depth[i]);
        for (int c = 0; c < 3; c++)
            assert_true(fabsf(picture.planes.color[3 * i + c] - reference.planes.color[3 * i + c]) < 1e-5f);
    }
    nebel_destroy_renderer(renderer);
    test_picture_free(&picture);
    test_picture_free(&reference);
}

/* Point lights, too. */
static void lights_shine_through_holes(void **state)
{
    static test_card card;
    const nebel_light light = {.position = {.5, 4, .25}, .intensity = {10, 10, 10}};
    const nebel_camera camera = camera_above();
    test_picture picture = test_picture_make(SIZE, SIZE);
    size_t dark = 0, lit = 0;
    (void)state;
    test_card_make(&card, 1);
    card.scene.has_sun = 0;
    card.scene.light_count = 1;
    card.scene.lights = &light;
    test_render(&card.scene, NULL, &(nebel_cpu_renderer_desc){0}, &camera, 1, &picture);
    for (uint32_t y = 0; y < SIZE; y++)
        for (uint32_t x = 0; x < SIZE; x++) {
            const double middle[2] = {.5 * (at(x) + light.position[0]), .5 * (at(y) + light.position[2])};
            const double shade = test_card_alpha(&card, middle[0], middle[1]);
            if (test_depth(&picture, x, y) < 4 || fabs(shade) < .01 || fabs(fabs(middle[0]) - 2) < 1e-3 ||
                fabs(fabs(middle[1]) - 2) < 1e-3)
                continue;
            assert_true((test_color(&picture, x, y)[0] == 0) == (shade > 0));
            dark += shade > 0;
            lit += shade < 0;
        }
    assert_true(dark > 300 && lit > 300);
    test_picture_free(&picture);
}

/* ---- lines over masks ------------------------------------------------------------------------ */

/* Where the stretches of a packet's lines end. */
typedef struct stretch_ends {
    double at[NB_PACKET][512];
    size_t count[NB_PACKET];
} stretch_ends;

static void take_stretch(const nb_solid *solid, stretch_ends *e)
{
    size_t *count = &e->count[solid->line];
    double *at = e->at[solid->line];
    assert_true(solid->enter >= (*count > 0 ? at[*count - 1] : 0) && solid->leave >= solid->enter && solid->leave <= 1);
    assert_true(*count < 510);
    at[(*count)++] = solid->enter;
    at[(*count)++] = solid->leave;
}

static void walk_lines(const nb_alpha_mask *mask, const nb_alpha_mask_lines *lines, stretch_ends *e)
{
    nb_alpha_mask_walk walk;
    memset(e->count, 0, sizeof e->count);
    nb_alpha_mask_begin(&walk, mask, lines);
    do {
        for (uint32_t i = 0; i < walk.count; i++) take_stretch(&walk.found[i], e);
    } while (nb_alpha_mask_next(&walk));
}

/* How many places of a line its stretches and nb_alpha_mask_is_hole disagree about, but for those near an end. */
static size_t compare_line(const nb_alpha_mask *mask, const nb_alpha_mask_lines *lines, int line, const stretch_ends *e,
                           uint64_t *numbers, size_t *places)
{
    const double *from[2] = {&lines->from[0][line], &lines->from[1][line]};
    const double *to[2] = {&lines->to[0][line], &lines->to[1][line]}, *ends = e->at[line];
    size_t wrong = 0;
    for (int k = 0; k < 50; k++) {
        const double s = dice(numbers, 0, 1), x = *from[0] + s * (*to[0] - *from[0]);
        const double y = *from[1] + s * (*to[1] - *from[1]);
        size_t before = 0;
        int near = 0;
        for (size_t i = 0; i < e->count[line]; i++) {
            before += ends[i] <= s;
            near |= fabs(ends[i] - s) < 1e-5;
        }
        if (near) continue;
        *places += 1;
        wrong += nb_alpha_mask_is_hole(mask, (float)(x / mask->width), (float)(y / mask->height)) != (before % 2 == 0);
    }
    return wrong;
}

/* Of a packet whose second line is not asked for, and whose third is too long. */
static size_t compare_lines(const nb_alpha_mask *mask, uint64_t *numbers, size_t *places)
{
    static stretch_ends e;
    nb_alpha_mask_lines lines;
    size_t wrong = 0;
    for (int line = 0; line < NB_PACKET; line++) {
        lines.is_asked[line] = line != 1;
        for (int i = 0; i < 2; i++) {
            const double from = dice(numbers, -60, 60);
            lines.from[i][line] = from;
            lines.to[i][line] = dice(numbers, 0, 1) < .2 ? from : from + dice(numbers, -40, 40);
        }
    }
    lines.to[0][2] = 1e9;
    walk_lines(mask, &lines, &e);
    assert_true(e.count[1] == 0 && e.count[2] == 2 && e.at[2][0] == 0 && e.at[2][1] == 1);
    for (int line = 0; line < NB_PACKET; line++)
        if (line != 1 && line != 2) wrong += compare_line(mask, &lines, line, &e, numbers, places);
    return wrong;
}

static void a_line_is_cut_where_alpha_passes_the_cutoff(void **state)
{
    enum { WIDE = 64, HIGH = 40 };
    static uint8_t texels[WIDE * HIGH][4];
    uint64_t numbers = 3;
    size_t places = 0, wrong = 0;
    (void)state;
    for (int kind = 0; kind < 4; kind++) {
        const uint32_t width = kind == 3 ? 1 : WIDE, height = kind == 2 ? 1 : HIGH;
        const nebel_texture texture = {width, height, texels[0]};
        const nebel_scene_data scene = {.texture_count = 1, .textures = &texture};
        const nebel_allocator allocator = nb_resolve_allocator(&(nebel_allocator){0});
        nb_alpha_mask mask;
        for (int i = 0; i < WIDE * HIGH; i++) {
            const int x = i % WIDE, y = i / WIDE, inside = hypot(x - 20, y - 15) < 11 && hypot(x - 22, y - 17) > 4;
            texels[i][3] = kind == 0 ? (uint8_t)(inside ? 255 : 0) : (uint8_t)dice(&numbers, 0, 256);
        }
        assert_int_equal(nb_alpha_mask_make(&mask, &allocator, &scene, 0, .5f), NEBEL_OK);
        for (int packet = 0; packet < 150; packet++) wrong += compare_lines(&mask, &numbers, &places);
        nb_alpha_mask_free(&mask, &allocator);
    }
    print_message("%zu of %zu places wrong\n", wrong, places);
    assert_true(places > 300000 && wrong <= places / 20000);
}

/* ---- what is no mask ------------------------------------------------------------------------- */

static nebel_result create(const test_card *card)
{
    nebel_renderer *renderer = NULL;
    const nebel_result result = nebel_create_cpu_renderer(&card->scene, NULL, &(nebel_cpu_renderer_desc){0}, &renderer);
    nebel_destroy_renderer(renderer);
    return result;
}

static void odd_masks_are_refused(void **state)
{
    static const float cutoffs[] = {-.1f, 1.1f, NAN, INFINITY};
    static test_card card;
    (void)state;
    for (size_t i = 0; i < sizeof cutoffs / sizeof *cutoffs; i++) {
        test_card_make(&card, 1);
        card.meshes[0].alpha_cutoff = cutoffs[i];
        assert_int_equal(create(&card), NEBEL_ERROR_VALUE);
    }
    for (int i = 0; i < 3; i++) {
        test_card_make(&card, 1);
        if (i == 0) card.meshes[0].mask = 1;
        if (i == 1) card.meshes[0].mask = -1;
        if (i == 2) card.meshes[0].uvs = NULL;
        assert_int_equal(create(&card), NEBEL_ERROR_ARGUMENT);
    }
    test_card_make(&card, 1);
    card.texture.width = 0;
    assert_int_equal(create(&card), NEBEL_ERROR_ARGUMENT);
}

/* Texture coordinates that are no numbers or far too large: there is a picture, and soon, of shafts as well. */
static void odd_coordinates_are_survived(void **state)
{
    static const float odd[] = {NAN, INFINITY, 1e6f, 1e20f, 3e38f};
    static test_card card;
    const nebel_volume_desc volume = {.extinction = {.1, .1, .1}, .albedo = {1, 1, 1}};
    const nebel_lighting_desc lights = {.sun = {.direction = {.3, .9, .2}, .irradiance = {3, 3, 3}}};
    nebel_lighting *fog = fog_commit_lit(&(nebel_fog_desc){0}, &volume, 1, &lights);
    test_picture picture = test_picture_make(8, 8);
    (void)state;
    for (size_t i = 0; i < sizeof odd / sizeof *odd; i++)
        for (int k = 0; k < 8; k++) {
            const nebel_camera camera = test_camera(0, 1, 8, 0, 2, 0);
            test_card_make(&card, 1);
            card.uvs[k] = odd[i];
            test_render(&card.scene, fog, &(nebel_cpu_renderer_desc){0}, &camera, 1, &picture);
            for (int p = 0; p < 3 * 8 * 8; p++) assert_true(isfinite(picture.planes.in_scattering[p]));
        }
    test_picture_free(&picture);
    nebel_release_lighting(fog);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(holes_are_where_alpha_is_low), cmocka_unit_test(the_reference_has_the_same_holes),
        cmocka_unit_test(lights_shine_through_holes),   cmocka_unit_test(a_line_is_cut_where_alpha_passes_the_cutoff),
        cmocka_unit_test(odd_masks_are_refused),        cmocka_unit_test(odd_coordinates_are_survived),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
