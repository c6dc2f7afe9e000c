/* Fog that is far from the camera, or narrow: OpenGL shows what the CPU shows, or refuses the view and says how near to go or how wide
 * to look. Over distances, sizes of views, shapes and densities, in views of parallel rays and in perspective. */
#include "fog_help.h"
#include "pass_help.h"
#include "picture_help.h"
#include "test_render_scene.h"

enum { SIDE = 24, SHAPES = 6 };

static const char *const shape_names[SHAPES] = {"sheet", "turned sheet", "box", "ball", "height", "long haze"};
static const double towards[3] = {.36, .48, -.8}; /* from the camera to the fog */

typedef struct tally {
    size_t right, refused, wrong;
    double worst;
} tally;

static const nebel_scene_data empty;
static tally tallies[2][SHAPES];
static fog_messages messages;
static nebel_gl_renderer *opengl;

/* About `size` wide where it is not a sheet of 2 m; of optical depth `depth` across. */
static nebel_lighting *commit_shape(int shape, double size, double depth)
{
    const double wide = shape == 5 ? 1e3 * size : size, half = .4 * wide;
    const double across = shape < 2 ? 2 : shape == 4 ? .1 * size : wide, extinction = depth / across;
    nebel_volume_desc v = {
        .extinction = {fmin(extinction, 1e9), fmin(.8 * extinction, 1e9), fmin(.5 * extinction, 1e9)},
        .source = {.8, .7, .6}};
    v.shape.type = shape == 3 ? NEBEL_SHAPE_SPHERE : NEBEL_SHAPE_BOX;
    v.shape.radius = half;
    for (int k = 0; k < 3; k++) {
        v.shape.max[k] = half * (1 + .1 * k) * (shape < 2 && k == 1 ? 1 / half : 1);
        v.shape.min[k] = -v.shape.max[k];
    }
    if (shape == 1) {
        const double rotation[4] = {.1, .2, .3, .9};
        memcpy(v.shape.transform.rotation, rotation, sizeof rotation);
    }
    if (shape == 4)
        v.shape.min[1] = 0, v.density = (nebel_density){.type = NEBEL_DENSITY_HEIGHT, .scale_height = .1 * size};
    return test_fog(1, &v);
}

/* A pixel as OpenGL has it against those around it on the CPU: what is a pixel beside an outline may be its other side. */
static double apart(const float *cpu, const float *gl, int x, int y, int c)
{
    float low = HUGE_VALF, high = -HUGE_VALF;
    for (int j = y - 1; j <= y + 1; j++)
        for (int i = x - 1; i <= x + 1; i++) {
            low = fminf(low, cpu[3 * (j * SIDE + i) + c]);
            high = fmaxf(high, cpu[3 * (j * SIDE + i) + c]);
        }
    const float is = gl[3 * (y * SIDE + x) + c];
    return isnan(is) ? HUGE_VAL : fmax(0, (double)fmaxf(low - is, is - high));
}

static double worst_pixel(const picture_pair *pair)
{
    double worst = 0;
    for (int y = 1; y + 1 < SIDE; y++)
        for (int x = 1; x + 1 < SIDE; x++)
            for (int c = 0; c < 3; c++) {
                worst = fmax(worst, apart(pair->cpu.transmittance, pair->gl.transmittance, x, y, c));
                worst = fmax(worst, apart(pair->cpu.in_scattering, pair->gl.in_scattering, x, y, c));
            }
    return worst;
}

/* Draws by both, where OpenGL does not refuse. Returns whether both show the same. */
static int is_right(int shape, double size, double depth, const nebel_camera *camera, picture_pair *pair)
{
    const nebel_gl_frame_desc frame = {.camera = *camera, .width = SIDE, .height = SIDE, .samples = 1};
    const nebel_frame_desc as_it_is = {
        .camera = *camera, .width = SIDE, .height = SIDE, .samples = 1, .tolerance = 1e-4};
    const nebel_gl_planes planes = {.transmittance = pair->gl.transmittance, .in_scattering = pair->gl.in_scattering};
    tally *const t = &tallies[camera->projection == NEBEL_PROJECTION_ORTHOGRAPHIC][shape];
    nebel_lighting *const fog = commit_shape(shape, size, depth);
    nebel_renderer *cpu = NULL;
    double worst = 0;
    messages.count = 0;
    assert_int_equal(nebel_set_gl_renderer_lighting(opengl, fog), NEBEL_OK);
    const nebel_result result = nebel_gl_render_frame(opengl, &frame);
    if (result == NEBEL_OK) {
        assert_int_equal(nebel_gl_read_planes(opengl, &planes), NEBEL_OK);
        assert_int_equal(nebel_create_cpu_renderer(&empty, fog, &(nebel_cpu_renderer_desc){0}, &cpu), NEBEL_OK);
        assert_int_equal(nebel_render_frame(cpu, &as_it_is, &pair->cpu), NEBEL_OK);
        nebel_destroy_renderer(cpu);
        worst = worst_pixel(pair);
    } else {
        assert_int_equal(result, NEBEL_ERROR_LIMIT);
        assert_non_null(strstr(messages.text, "camera: "));
        assert_non_null(strstr(messages.text, "or use the CPU's renderer"));
    }
    t->refused += result != NEBEL_OK;
    t->right += result == NEBEL_OK && worst <= 1. / 255;
    t->worst = fmax(t->worst, worst);
    t->wrong += !(worst <= 1. / 255);
    nebel_release_lighting(fog);
    return worst <= 1. / 255;
}

/* The same pixels at that distance, whatever the projection. */
static void try_view(int shape, double distance, double size, picture_pair *pair)
{
    nebel_camera camera = {.up = {0, 1, 0}, .view_height = size};
    camera.vertical_fov = 2 * atan(.5 * size / distance) * 180 / test_pi;
    for (int k = 0; k < 3; k++) camera.position[k] = -distance * towards[k];
    for (int depth = 0; depth < 2; depth++)
        for (int parallel = 0; parallel < 2; parallel++) {
            camera.projection = parallel ? NEBEL_PROJECTION_ORTHOGRAPHIC : NEBEL_PROJECTION_PERSPECTIVE;
            if (is_right(shape, size, depth == 0 ? .7 : 50, &camera, pair)) continue;
            print_message("%s, %g m away, %g m high: off\n", shape_names[shape], distance, size);
        }
}

static void test_far_fog_is_right_or_refused(void **state)
{
    (void)state;
    nb_gl context;
    picture_pair pair = picture_make(SIDE, SIDE);
    size_t wrong = 0, right = 0, refused = 0;
    const nebel_gl_renderer_desc desc = {.host.log = fog_messages_log(&messages)};
    pass_open(&context, NB_GL_330);
    assert_int_equal(nebel_create_gl_renderer(&empty, NULL, &desc, &opengl), NEBEL_OK);
    for (int shape = 0; shape < SHAPES; shape++)
        for (int d = 3; d <= 8; d++)
            for (int s = -3; s <= 3; s += 2) try_view(shape, pow(10, d), pow(10, s), &pair);
    for (int i = 0; i < 2 * SHAPES; i++) {
        const tally *const t = &tallies[i / SHAPES][i % SHAPES];
        print_message("%s, %s: %zu right, %zu refused, worst %.1e\n", i < SHAPES ? "perspective" : "parallel rays",
                      shape_names[i % SHAPES], t->right, t->refused, t->worst);
        wrong += t->wrong, right += t->right, refused += t->refused;
    }
    assert_int_equal(wrong, 0);
    assert_true(right >= 100 && refused >= 100);
    nebel_destroy_gl_renderer(opengl);
    picture_free(&pair);
    pass_close(&context);
}

/* From a thousand kilometres behind them it is the picture that the CPU shows from near, where it has more digits itself; but depth, which
 * counts from the camera. */
static void test_parallel_views_of_surfaces_from_afar(void **state)
{
    (void)state;
    static test_ball ball;
    const nebel_volume_desc volume = {.shape = {.type = NEBEL_SHAPE_SPHERE, .center = {1, 0, 1}, .radius = 1.5},
                                      .extinction = {.5, .4, .3},
                                      .albedo = {.9, .9, .9}};
    const double near = 16, far = 1e6;
    nebel_camera camera = {.projection = NEBEL_PROJECTION_ORTHOGRAPHIC, .up = {0, 1, 0}, .view_height = 5};
    nb_gl context;
    picture_pair pair = picture_make(64, 64), from_afar = picture_make(64, 64);
    test_ball_make(&ball, (double[3]){0, 0, 0});
    const nebel_lighting_desc lights = {.sun = {.direction = {.36, .8, .48}, .irradiance = {3, 2.9, 2.7}}};
    nebel_lighting *const fog = fog_light(&lights, &volume, 1);
    pass_open(&context, NB_GL_330);
    for (int k = 0; k < 3; k++) camera.position[k] = near * (k == 0 ? .6 : k == 1 ? .64 : .48);
    picture_render(&ball.scene, fog, &camera, 1, &pair);
    for (int k = 0; k < 3; k++) camera.position[k] *= far / near;
    picture_render(&ball.scene, fog, &camera, 1, &from_afar);
    for (int i = 0; i < 64 * 64; i++) {
        const double depth = (double)from_afar.gl.depth[i] - far + near, is = (double)pair.cpu.depth[i];
        if (isfinite(is) && isfinite(depth)) assert_true(fabs(depth - is) < .2);
        pair.gl.depth[i] = isfinite(depth) ? pair.gl.depth[i] : HUGE_VALF;
    }
    memcpy(pair.gl.transmittance, from_afar.gl.transmittance, sizeof(float[64 * 64 * 3]));
    memcpy(pair.gl.in_scattering, from_afar.gl.in_scattering, sizeof(float[64 * 64 * 3]));
    const picture_difference difference = picture_compare(&pair, 1);
    print_message("%zu pixels with fog, %zu more than 1/255 apart, largest %.2g\n", difference.fogged,
                  difference.beyond_step, difference.largest);
    assert_true(difference.fogged > 1000 && difference.beyond_step <= difference.fogged / 200);
    picture_free(&pair);
    picture_free(&from_afar);
    nebel_release_lighting(fog);
    pass_close(&context);
}

int main(void)
{
    const struct CMUnitTest tests[] = {cmocka_unit_test(test_far_fog_is_right_or_refused),
                                       cmocka_unit_test(test_parallel_views_of_surfaces_from_afar)};
    return cmocka_run_group_tests(tests, NULL, NULL);
}
