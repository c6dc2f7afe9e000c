/* Transparent surfaces in fog against layered transport: light carried from the background to the eye, surface by
 * surface and fog by fog, with no knowledge of frame buffers. */
#include <math.h>

#include "fog_help.h"

#include <nebel/classic.h>

enum { LAYERS = 6, STACKS = 20000 };

typedef struct surface {
    nebel_blend_mode mode;
    double color[3], alpha;
    double distance;
} surface;

/* What the surface does to light, by the meaning of its mode. */
static double cover(const surface *s, int c, double behind)
{
    switch (s->mode) {
    case NEBEL_BLEND_OVER:
        return s->alpha * s->color[c] + (1 - s->alpha) * behind;
    case NEBEL_BLEND_PREMULTIPLIED:
        return s->color[c] + (1 - s->alpha) * behind;
    case NEBEL_BLEND_ADDITIVE:
        return s->color[c] + behind;
    case NEBEL_BLEND_MULTIPLY:
        return s->color[c] * behind;
    default:
        return s->color[c] + (1 - s->color[c]) * behind;
    }
}

static surface random_surface(uint64_t *state, double distance)
{
    surface s = {.mode = (nebel_blend_mode)dice_below(state, NEBEL_BLEND_COUNT),
                 .alpha = dice(state, 0, 1),
                 .distance = distance};
    for (int c = 0; c < 3; c++) s.color[c] = dice(state, 0, s.mode == NEBEL_BLEND_ADDITIVE ? 20 : 1);
    return s;
}

static nebel_transfer trace_between(const nebel_snapshot *fog, double from, double to)
{
    const nebel_ray ray = {{0, 0, -from}, {0, 0, -1}, to - from};
    nebel_transfer transfer;
    assert_int_equal(
        nebel_trace(fog, &(nebel_trace_desc){.tolerance = 1e-12}, 1, &ray, sizeof ray, &transfer, sizeof transfer),
        NEBEL_OK);
    return transfer;
}

static nebel_snapshot *random_banks(uint64_t *state)
{
    nebel_volume_desc banks[4] = {0};
    for (int i = 0; i < 4; i++) {
        const double at = dice(state, 0, 90);
        banks[i].shape =
            (nebel_shape){.type = NEBEL_SHAPE_BOX, .min = {-1, -1, -at - dice(state, 1, 40)}, .max = {1, 1, -at}};
        const double densest = dice_below(state, 8) == 0 ? 50 : .2;
        for (int c = 0; c < 3; c++) {
            banks[i].extinction[c] = dice(state, 0, densest);
            banks[i].source[c] = dice(state, 0, 3);
        }
    }
    return fog_commit(&(nebel_fog_desc){0}, banks, 4);
}

/* surfaces[0] is nearest */
static void carry_light(const nebel_snapshot *fog, const surface *surfaces, const double background[3], double pixel[3])
{
    double light[3] = {background[0], background[1], background[2]}, far = 200;
    for (int i = LAYERS; i >= 0; i--) {
        const double near = i > 0 ? surfaces[i - 1].distance : 0;
        const nebel_transfer between = trace_between(fog, near, far);
        for (int c = 0; c < 3; c++) {
            light[c] = between.transmittance[c] * light[c] + between.in_scattering[c];
            if (i > 0) light[c] = cover(&surfaces[i - 1], c, light[c]);
        }
        far = near;
    }
    for (int c = 0; c < 3; c++) pixel[c] = light[c];
}

static void draw(const nebel_snapshot *fog, const surface *surfaces, const double background[3], double pixel[3])
{
    const nebel_transfer whole = trace_between(fog, 0, 200);
    for (int c = 0; c < 3; c++) pixel[c] = whole.transmittance[c] * background[c] + whole.in_scattering[c];
    for (int i = LAYERS; i-- > 0;) {
        const nebel_transfer before = trace_between(fog, 0, surfaces[i].distance);
        const nebel_blend blend = nebel_blend_surface(surfaces[i].mode, surfaces[i].color, surfaces[i].alpha, &before);
        for (int c = 0; c < 3; c++) pixel[c] = blend.source[c] + blend.factor[c] * pixel[c];
    }
}

static void test_drawing_equals_carrying(void **unused)
{
    (void)unused;
    uint64_t state = 7;
    for (int n = 0; n < STACKS; n++) {
        nebel_snapshot *fog = random_banks(&state);
        surface surfaces[LAYERS];
        double background[3], drawn[3], carried[3];
        for (int i = 0; i < LAYERS; i++) surfaces[i] = random_surface(&state, 20 * i + dice(&state, 0, 20));
        for (int c = 0; c < 3; c++) background[c] = dice(&state, 0, 10);
        carry_light(fog, surfaces, background, carried);
        draw(fog, surfaces, background, drawn);
        for (int c = 0; c < 3; c++) assert_true(fabs(drawn[c] - carried[c]) <= 1e-12 * fmax(1, carried[c]));
        nebel_release_snapshot(fog);
    }
}

static void test_no_fog_is_the_mode_itself(void **unused)
{
    (void)unused;
    const nebel_transfer clear = {{1, 1, 1}, {0, 0, 0}, 0};
    uint64_t state = 3;
    for (int n = 0; n < 1000; n++) {
        const surface s = random_surface(&state, 0);
        const nebel_blend blend = nebel_blend_surface(s.mode, s.color, s.alpha, &clear);
        for (int c = 0; c < 3; c++)
            assert_true(fabs(blend.source[c] + blend.factor[c] * .37 - cover(&s, c, .37)) < 1e-14 * 20);
    }
}

/* Behind opaque fog every surface is invisible, whatever its mode, without a division by the transmittance. */
static void test_opaque_fog_hides_all(void **unused)
{
    (void)unused;
    const nebel_transfer opaque = {{0, 0, 0}, {.5, .6, .7}, 0};
    uint64_t state = 5;
    for (int n = 0; n < 1000; n++) {
        const surface s = random_surface(&state, 0);
        const nebel_blend blend = nebel_blend_surface(s.mode, s.color, s.alpha, &opaque);
        for (int c = 0; c < 3; c++) {
            const double pixel = opaque.in_scattering[c];
            assert_true(fabs(blend.source[c] + blend.factor[c] * pixel - pixel) < 1e-15);
        }
    }
}

static void test_an_unknown_mode_draws_nothing(void **unused)
{
    (void)unused;
    const double color[3] = {1, 1, 1};
    const nebel_blend blend =
        nebel_blend_surface(NEBEL_BLEND_COUNT, color, 1, &(nebel_transfer){{1, 1, 1}, {0, 0, 0}, 0});
    for (int c = 0; c < 3; c++) {
        assert_true(blend.source[c] == 0);
        assert_true(blend.factor[c] == 1);
    }
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(test_drawing_equals_carrying),
        cmocka_unit_test(test_no_fog_is_the_mode_itself),
        cmocka_unit_test(test_opaque_fog_hides_all),
        cmocka_unit_test(test_an_unknown_mode_draws_nothing),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
