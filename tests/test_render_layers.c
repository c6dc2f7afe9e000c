/* Textured planets in pictures of the CPU: what nebel_trace_textured_planet says, laid over each other through the fog between. */
#include "test_render_scene.h"

enum { WIDTH = 48, HEIGHT = 32, PIXELS = WIDTH * HEIGHT };

typedef struct world {
    nebel_textured_planet *layers;
    nebel_planet planet;
    nebel_scene_data scene;
    nebel_camera camera;
} world;

/* Small maps: those that planets make for themselves take half a second. */
static nebel_planet_map make_map(nebel_planet_map_type kind)
{
    static float texels[NEBEL_PLANET_MAP_TYPE_COUNT][64 * 32 * 3];
    const nebel_planet_map_desc desc = {.type = kind, .width = 64, .height = 32, .coverage = .4, .seed = 3};
    nebel_planet_map map = {.texels = texels[kind]};
    assert_int_equal(nebel_get_planet_map_size(&desc, &map), NEBEL_OK);
    assert_int_equal(nebel_generate_planet_map(&desc, texels[kind]), NEBEL_OK);
    return map;
}

static void make_world(world *w)
{
    const nebel_planet_map clouds = make_map(NEBEL_PLANET_MAP_CLOUDS), detail = make_map(NEBEL_PLANET_MAP_DETAIL);
    *w = (world){.camera = test_camera(1, 3, 9, 0, 0, 0)};
    nebel_textured_planet_desc *desc = &w->planet.textured_desc;
    *desc = (nebel_textured_planet_desc){
        .radius = 2, .rotation_period = 100, .color_map = make_map(NEBEL_PLANET_MAP_GROUND), .cloud_shell_count = 2};
    desc->cloud_shells[0] =
        (nebel_cloud_shell){.height = .1, .rotation_period = 50, .coverage_map = clouds, .detail_map = detail};
    desc->cloud_shells[1] =
        (nebel_cloud_shell){.height = .4, .rotation_period = -70, .gain = .5, .coverage_map = clouds};
    desc->atmosphere = (nebel_atmosphere_shell){.height = .7, .brightness = .4};
    assert_int_equal(nebel_create_textured_planet(desc, &w->layers), NEBEL_OK);
    w->planet.model = NEBEL_PLANET_TEXTURED;
    w->planet.textured = w->layers;
    for (int c = 0; c < 3; c++) w->planet.sun_left[c] = 1;
    w->scene = (nebel_scene_data){.has_sun = 1,
                                  .sun_direction = {.6, .48, .64},
                                  .sun_irradiance = {3, 2.5, 2},
                                  .ambient = {.1, .12, .15},
                                  .background = {.2, .1, .3},
                                  .planet_count = 1,
                                  .planets = &w->planet};
}

static nebel_lighting *make_fog(void)
{
    const nebel_volume_desc volumes[] = {
        {.shape = {.type = NEBEL_SHAPE_SPHERE, .center = {1, 1, 2.2}, .radius = 1},
         .extinction = {.5, .7, 1},
         .source = {1, .5, .2}},
        {.shape = {.type = NEBEL_SHAPE_SPHERE, .radius = 5}, .extinction = {.05, .04, .03}, .source = {.2, .3, .4}}};
    return test_fog(2, volumes);
}

static void render(const world *w, nebel_lighting *fog, int threads, double time, uint32_t samples, float *color,
                   float *depth)
{
    nebel_renderer *renderer = NULL;
    assert_int_equal(
        nebel_create_cpu_renderer(&w->scene, fog, &(nebel_cpu_renderer_desc){.thread_count = threads}, &renderer),
        NEBEL_OK);
    const nebel_frame_desc frame = {
        .camera = w->camera, .width = WIDTH, .height = HEIGHT, .samples = samples, .time = time};
    assert_int_equal(nebel_render_frame(renderer, &frame, &(nebel_frame){.color = color, .depth = depth}), NEBEL_OK);
    nebel_destroy_renderer(renderer);
}

/* Of a perspective camera: through the middle of a pixel. */
static nebel_ray ray_of(const nebel_camera *camera, uint32_t x, uint32_t y, double *spread)
{
    double forward[3], right[3], up[3], length = 0;
    for (int i = 0; i < 3; i++) {
        forward[i] = camera->look_at[i] - camera->position[i];
        length += forward[i] * forward[i];
    }
    for (int i = 0; i < 3; i++) forward[i] /= sqrt(length);
    const double level = hypot(forward[0], forward[2]);
    right[0] = -forward[2] / level, right[1] = 0, right[2] = forward[0] / level;
    for (int i = 0; i < 3; i++)
        up[i] = right[(i + 1) % 3] * forward[(i + 2) % 3] - right[(i + 2) % 3] * forward[(i + 1) % 3];
    *spread = 2 * tan(.5 * camera->vertical_fov * test_pi / 180) / HEIGHT;
    nebel_ray ray = {.t_max = HUGE_VAL};
    for (int i = 0; i < 3; i++) {
        ray.origin[i] = camera->position[i];
        ray.direction[i] = forward[i] + *spread * ((x + .5 - WIDTH / 2) * right[i] - (y + .5 - HEIGHT / 2) * up[i]);
    }
    return ray;
}

static nebel_transfer fog_up_to(const nebel_lighting *fog, const nebel_ray *ray, double t)
{
    nebel_transfer transfer = {.transmittance = {1, 1, 1}};
    nebel_ray piece = *ray;
    piece.t_max = t;
    if (fog != NULL) fog_trace(fog, (nebel_trace_desc){0}, 1, &piece, &transfer);
    return transfer;
}

/* From behind to the front: each piece of fog takes away from what is behind it and adds its own. */
static void compose(const world *w, const nebel_lighting *fog, const nebel_ray *ray, const nebel_shell_hits *hits,
                    double color[3])
{
    double far = HUGE_VAL;
    const int has_ground = hits->count > 0 && hits->hits[hits->count - 1].is_ground;
    for (int c = 0; c < 3; c++) color[c] = has_ground ? 0 : w->scene.background[c];
    for (uint32_t k = hits->count + 1; k-- > 0;) {
        const double near = k > 0 ? hits->hits[k - 1].t : 0;
        const nebel_transfer before = fog_up_to(fog, ray, near), all = fog_up_to(fog, ray, far);
        const int is_ground_piece = k == hits->count && has_ground;
        for (int c = 0; c < 3; c++) {
            const double left = is_ground_piece ? 1 : all.transmittance[c] / before.transmittance[c];
            const double light =
                is_ground_piece ? 0 : (all.in_scattering[c] - before.in_scattering[c]) / before.transmittance[c];
            color[c] = left * color[c] + light;
            if (k > 0) color[c] = (1 - hits->hits[k - 1].opacity) * color[c] + hits->hits[k - 1].radiance[c];
        }
        far = near;
    }
}

static void check_picture(const world *w, nebel_lighting *fog, double time)
{
    static float color[3 * PIXELS], depth[PIXELS];
    int grounds = 0;
    double worst = 0;
    render(w, fog, 1, time, 1, color, depth);
    for (uint32_t i = 0; i < PIXELS; i++) {
        nebel_textured_planet_query view = {.time = time};
        nebel_shell_hits hits;
        double wanted[3];
        const nebel_ray ray = ray_of(&w->camera, i % WIDTH, i / WIDTH, &view.pixel_spread);
        memcpy(view.sun.direction, w->scene.sun_direction, sizeof view.sun.direction);
        memcpy(view.sun.irradiance, w->scene.sun_irradiance, sizeof view.sun.irradiance);
        memcpy(view.ambient, w->scene.ambient, sizeof view.ambient);
        assert_int_equal(nebel_trace_textured_planet(w->layers, &view, 1, &ray, 0, &hits, 0), NEBEL_OK);
        compose(w, fog, &ray, &hits, wanted);
        for (int c = 0; c < 3; c++) worst = fmax(worst, fabs((double)color[3 * i + (uint32_t)c] - wanted[c]));
        const int has_ground = hits.count > 0 && hits.hits[hits.count - 1].is_ground;
        grounds += has_ground;
        if (has_ground)
            assert_true(fabs((double)depth[i] - hits.hits[hits.count - 1].t) < 1e-5);
        else
            assert_true(isinf(depth[i]));
    }
    print_message("worst %.1e, %d pixels of ground\n", worst, grounds);
    assert_true(worst < 2e-5 && grounds > 100);
}

static void pictures_are_what_rays_say(void **state)
{
    (void)state;
    world w;
    make_world(&w);
    check_picture(&w, NULL, 0);
    check_picture(&w, NULL, 33);
    nebel_lighting *fog = make_fog();
    check_picture(&w, fog, 33);
    nebel_release_lighting(fog);
    nebel_destroy_textured_planet(w.layers);
}

/* A square before the planet hides it, one behind it is hidden, one within the shells is seen through them. */
static void models_stand_before_and_behind(void **state)
{
    (void)state;
    static float with[3 * PIXELS], without[3 * PIXELS], depth[PIXELS];
    world w;
    make_world(&w);
    nebel_mesh square = test_square();
    w.camera = test_camera(0, 9, .001, 0, 0, 0);
    render(&w, NULL, 1, 0, 1, without, depth);
    const size_t middle = PIXELS / 2 + WIDTH / 2;
    w.scene.mesh_count = 1;
    w.scene.meshes = &square;
    square.origin[1] = 4;
    render(&w, NULL, 1, 0, 1, with, depth);
    assert_true(fabs((double)depth[middle] - 5) < 5e-3);
    const double clear = (double)with[3 * middle];
    square.origin[1] = 2.25;
    render(&w, NULL, 1, 0, 1, with, depth);
    assert_true(fabs((double)depth[middle] - 6.75) < 5e-3);
    assert_true(fabs((double)with[3 * middle] - clear) > 1e-3);
    square.origin[1] = -1;
    render(&w, NULL, 1, 0, 1, with, depth);
    assert_memory_equal(with, without, sizeof with);
    nebel_destroy_textured_planet(w.layers);
}

static void bytes_do_not_hang_on_threads(void **state)
{
    (void)state;
    static float one[3 * PIXELS], three[3 * PIXELS];
    world w;
    make_world(&w);
    nebel_lighting *fog = make_fog();
    render(&w, fog, 1, 7, 4, one, NULL);
    render(&w, fog, 3, 7, 4, three, NULL);
    assert_memory_equal(one, three, sizeof one);
    nebel_release_lighting(fog);
    nebel_destroy_textured_planet(w.layers);
}

static void what_cannot_be_drawn_is_refused(void **state)
{
    (void)state;
    world w;
    make_world(&w);
    nebel_renderer *renderer = NULL;
    nebel_frame_desc frame = {.camera = w.camera, .width = WIDTH, .height = HEIGHT, .time = HUGE_VAL};
    assert_int_equal(
        nebel_create_cpu_renderer(&w.scene, NULL, &(nebel_cpu_renderer_desc){.thread_count = 1}, &renderer), NEBEL_OK);
    assert_int_equal(nebel_render_frame(renderer, &frame, &(nebel_frame){.color = NULL}), NEBEL_ERROR_VALUE);
    frame.time = 0;
    assert_int_equal(nebel_set_renderer_method(renderer, NEBEL_METHOD_PATH, NULL), NEBEL_OK);
    assert_int_equal(nebel_render_frame(renderer, &frame, &(nebel_frame){.color = NULL}), NEBEL_ERROR_UNSUPPORTED);
    nebel_destroy_renderer(renderer);
    nebel_destroy_textured_planet(w.layers);
}

int main(void)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(pictures_are_what_rays_say),
        cmocka_unit_test(models_stand_before_and_behind),
        cmocka_unit_test(bytes_do_not_hang_on_threads),
        cmocka_unit_test(what_cannot_be_drawn_is_refused),
    };
    return cmocka_run_group_tests(tests, NULL, NULL);
}
