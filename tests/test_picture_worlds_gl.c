/* Several planets in OpenGL, with air and without, are those of the CPU, and so are models in their light, by place. With an
 * argument in pictures so many times wider. */
#include "pass_help.h"
#include "picture_help.h"
#include "planet_help.h"
#include "worlds_help.h"

#include <nebel/planet.h>
#include <nebel/light.h>

#include <math.h>
#include <stdlib.h>

static uint32_t scale = 1;

static void compare(const char *name, const picture_pair *pair)
{
    const double shown = picture_shown_apart(pair), fog = picture_fog_apart(pair), depth = picture_depth_apart(pair, 1);
    print_message("%s: of 1000 pixels %.2f are shown 2/255 apart, %.2f have other fog or air, %.2f another depth\n",
                  name, 1e3 * shown, 1e3 * fog, 1e3 * depth);
    assert_true(shown <= 1e-3 && fog <= 1e-3 && depth <= 5e-3);
}

static double largest_color(const picture_pair *pair)
{
    double most = 0;
    for (size_t i = 0; i < 3 * (size_t)pair->width * pair->height; i++) most = fmax(most, (double)pair->cpu.color[i]);
    return most;
}

static void check(const char *name, const nebel_scene_data *scene, nebel_lighting *fog, const nebel_camera *camera)
{
    picture_pair pair = picture_make(96 * scale, 54 * scale);
    if (scene->planets[0].clouds != NULL) pair.tolerance = NEBEL_DEFAULT_TOLERANCE; /* as OpenGL takes */
    const int objects = pass_count_objects();
    picture_render(scene, fog, camera, 1, &pair);
    assert_int_equal(pass_count_objects(), objects);
    assert_true(largest_color(&pair) > .05);
    compare(name, &pair);
    picture_free(&pair);
}

/* ---- planets --------------------------------------------------------------------------------- */

static void views_are_the_same(void **state)
{
    (void)state;
    nb_gl context;
    pass_open(&context, NB_GL_330);
    for (size_t v = 0; v < WORLDS_VIEWS; v++) {
        worlds s;
        worlds_make(worlds_views[v].count, worlds_views[v].bodies, worlds_views[v].sun, worlds_views[v].diameter, &s);
        const nebel_camera camera = planet_camera(worlds_views[v].height, worlds_views[v].pitch);
        check(worlds_views[v].text, &s.scene, NULL, &camera);
        worlds_free(&s);
    }
    pass_close(&context);
}

static void fog_and_panoramas_are_the_same(void **state)
{
    (void)state;
    static const double sun[3] = {.8, .6, .2};
    nb_gl context;
    worlds s;
    worlds_make(3, worlds_near, sun, .53, &s);
    pass_open(&context, NB_GL_300ES);
    nebel_lighting *const fog = planet_fog(s.scene.sun_direction);
    nebel_camera camera = planet_camera(120, .35);
    check("in fog", &s.scene, fog, &camera);
    camera.projection = NEBEL_PROJECTION_PANORAMA;
    check("all around", &s.scene, NULL, &camera);
    pass_close(&context);
    nebel_release_lighting(fog);
    worlds_free(&s);
}

/* ---- models ---------------------------------------------------------------------------------- */

static const uint32_t quad_indices[6] = {0, 1, 2, 0, 2, 3};

static nebel_mesh make_quad(const float corners[4][3])
{
    return (nebel_mesh){.positions = corners[0],
                        .indices = quad_indices,
                        .vertex_count = 4,
                        .triangle_count = 2,
                        .base_color = {1, 1, 1},
                        .texture = -1};
}

/* A wall higher than the weather, 100 km away, before a sun that has set where its foot is: the planet's shadow, red light
 * and white one are on it at once. */
static void high_walls_see_a_sun_that_has_set(void **state)
{
    (void)state;
    static const double sun[3] = {.1, -.08, .99};
    static const float wall[4][3] = {{-9e4f, -1e3f, 0}, {9e4f, -1e3f, 0}, {9e4f, 1.2e5f, 0}, {-9e4f, 1.2e5f, 0}};
    nebel_mesh mesh = make_quad(wall);
    nb_gl context;
    worlds s;
    worlds_make(1, worlds_near, sun, .53, &s);
    mesh.origin[2] = -1e5;
    s.scene.mesh_count = 1;
    s.scene.meshes = &mesh;
    pass_open(&context, NB_GL_330);
    const nebel_camera camera = planet_camera(2, .5);
    check("a high wall", &s.scene, NULL, &camera);
    pass_close(&context);
    worlds_free(&s);
}

/* A plate over the Earth, larger than the half shadow that a moon throws on it. */
static void half_shadows_lie_on_models(void **state)
{
    (void)state;
    static const worlds_body bodies[] = {{.name = "earth"}, {.name = "moon", .center = {1.2e6, 1.2e7, 0}}};
    static const double up[3] = {0, 1, 0};
    static const float plate[4][3] = {{-2e6f, 0, -1.5e6f}, {-2e6f, 0, 1.5e6f}, {2e6f, 0, 1.5e6f}, {2e6f, 0, -1.5e6f}};
    nebel_mesh mesh = make_quad(plate);
    nb_gl context;
    worlds s;
    worlds_make(2, bodies, up, 5, &s);
    mesh.origin[1] = 5e5;
    s.scene.mesh_count = 1;
    s.scene.meshes = &mesh;
    pass_open(&context, NB_GL_330);
    const nebel_camera camera = {
        .position = {0, 3.5e6, 0}, .look_at = {0, 5e5, 0}, .up = {0, 0, -1}, .vertical_fov = 60};
    check("a half shadow", &s.scene, NULL, &camera);
    pass_close(&context);
    worlds_free(&s);
}

static void half_shadows_lie_on_clouds(void **state)
{
    (void)state;
    static const worlds_body bodies[] = {{.name = "earth"}, {.name = "moon", .center = {1.2e6, 1.2e7, 0}}};
    static const double up[3] = {0, 1, 0};
    nb_gl context;
    nebel_clouds *clouds;
    worlds s;
    worlds_make(2, bodies, up, 5, &s);
    const nebel_clouds_desc desc = {
        .atmosphere = s.atmospheres[0], .layers = {{.type = NEBEL_CLOUD_STRATUS}}, .layer_count = 1};
    assert_int_equal(nebel_create_clouds(&desc, &clouds), NEBEL_OK);
    s.planets[0].clouds = clouds;
    pass_open(&context, NB_GL_330);
    const nebel_camera camera = {
        .position = {0, 3.5e6, 0}, .look_at = {0, 5e5, 0}, .up = {0, 0, -1}, .vertical_fov = 60};
    check("a half shadow on clouds", &s.scene, NULL, &camera);
    pass_close(&context);
    nebel_destroy_clouds(clouds);
    worlds_free(&s);
}

/* A plate over a small planet, from its day into its night; the ambient light is that of the sky. */
static void models_have_the_sky_of_their_planet(void **state)
{
    (void)state;
    static const worlds_body bodies[] = {{.name = "earth"}, {.name = "earth", .center = {0, 4e6, -1e7}, .radius = 8e5}};
    static const double sun[3] = {.9, .43, .05};
    static const float plate[4][3] = {{-1.5e6f, -1e5f, 0}, {1.5e6f, -1e5f, 0}, {1.5e6f, 1e5f, 0}, {-1.5e6f, 1e5f, 0}};
    static const float sky[2][3] = {{.2f, .3f, .5f}, {.2f, .3f, .5f}};
    const nebel_environment_map_desc desc = {.width = 2, .height = 1, .pixels = sky[0]};
    nebel_mesh mesh = make_quad(plate);
    nb_gl context;
    worlds s;
    worlds_make(2, bodies, sun, .53, &s);
    mesh.origin[1] = 4e6;
    mesh.origin[2] = -1e7 + 1e6;
    s.scene.mesh_count = 1;
    s.scene.meshes = &mesh;
    s.scene.environment.type = NEBEL_ENVIRONMENT_MAP;
    assert_int_equal(nebel_create_environment_map(&desc, &s.scene.environment.map), NEBEL_OK);
    pass_open(&context, NB_GL_330);
    const nebel_camera camera = {
        .position = {0, 4e6, -6e6}, .look_at = {0, 4e6, -1e7}, .up = {0, 1, 0}, .vertical_fov = 40};
    check("another sky", &s.scene, NULL, &camera);
    pass_close(&context);
    nebel_release_environment_map(s.scene.environment.map);
    worlds_free(&s);
}

int main(int argc, char **argv)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(views_are_the_same),
        cmocka_unit_test(fog_and_panoramas_are_the_same),
        cmocka_unit_test(high_walls_see_a_sun_that_has_set),
        cmocka_unit_test(half_shadows_lie_on_models),
        cmocka_unit_test(half_shadows_lie_on_clouds),
        cmocka_unit_test(models_have_the_sky_of_their_planet),
    };
    if (argc > 1) scale = (uint32_t)atoi(argv[1]);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
