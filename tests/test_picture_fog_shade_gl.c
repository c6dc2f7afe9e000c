/* In OpenGL fog under clouds has their shade by its own place, as on the CPU: mist and banks of it under broken clouds, from near and
 * far, with shafts, in the planet's own sky, far from the origin. With an argument in pictures so many times wider. */
#include "pass_help.h"
#include "picture_help.h"
#include "planet_help.h"

#include "math/vector.h"

#include <nebel/planet.h>
#include <nebel/light.h>

#include <math.h>
#include <stdlib.h>
#include <string.h>

static uint32_t scale = 1;

static const float wall[4][3] = {{-40, -20, 0}, {40, -20, 0}, {40, 50, 0}, {-40, 50, 0}};
static const uint32_t wall_indices[6] = {0, 1, 2, 0, 2, 3};

typedef struct world {
    nebel_atmosphere *atmosphere;
    nebel_clouds *clouds;
    nebel_environment_map *map;
    nebel_planet planet;
    nebel_mesh mesh;
    nebel_scene_data scene;
} world;

static void make_air(double coverage, world *w)
{
    assert_int_equal(nebel_create_atmosphere(&w->planet.atmosphere_desc, &w->atmosphere), NEBEL_OK);
    const nebel_clouds_desc desc = {.atmosphere = w->atmosphere, .layers = {{.coverage = coverage}}, .layer_count = 1};
    assert_int_equal(nebel_create_clouds(&desc, &w->clouds), NEBEL_OK);
    w->planet.atmosphere = w->atmosphere;
    w->planet.clouds = w->clouds;
}

/* With a sky of its own, which is the same all around. */
static void make_world(double coverage, const double sun[3], world *w)
{
    *w = (world){.planet = {.atmosphere_desc = *nebel_lookup_atmosphere("earth"),
                            .sun_angular_diameter = .53,
                            .cloud_layer_count = 1},
                 .mesh = {.origin = {0, 0, -150},
                          .positions = wall[0],
                          .indices = wall_indices,
                          .vertex_count = 4,
                          .triangle_count = 2,
                          .base_color = {.8f, .8f, .8f},
                          .texture = -1}};
    make_air(coverage, w);
    w->scene = (nebel_scene_data){
        .has_sun = 1, .sun_irradiance = {5, 4, 3}, .planet_count = 1, .planets = &w->planet, .meshes = &w->mesh};
    w->map = planet_even_sky(&w->scene);
    memcpy(w->scene.sun_direction, sun, sizeof w->scene.sun_direction);
    assert_true(nb_vector_make_unit(w->scene.sun_direction));
}

static void free_world(world *w)
{
    nebel_destroy_clouds(w->clouds);
    nebel_release_environment_map(w->map);
    nebel_destroy_atmosphere(w->atmosphere);
}

/* In the light of the origin under these clouds, as programs make it. */
static nebel_lighting *make_fog(const world *w, const nebel_volume_desc *volume)
{
    static const double origin[1][3] = {{0, 0, 0}};
    nebel_cloud_lighting *view;
    nebel_cloud_workspace *workspace;
    nebel_cloud_lighting_desc above = {.clouds = w->clouds, .sun = {.irradiance = {5, 4, 3}}};
    nebel_lighting_desc lights = {.environment = w->scene.environment};
    nebel_irradiance light;
    float sun, sky;
    memcpy(above.sun.direction, w->scene.sun_direction, sizeof above.sun.direction);
    assert_int_equal(nebel_create_cloud_lighting(&above, &view), NEBEL_OK);
    assert_int_equal(nebel_create_cloud_workspace(view, &workspace), NEBEL_OK);
    assert_int_equal(nebel_compute_cloud_sun_transmittance(workspace, 200, 1, origin, 0, &sun), NEBEL_OK);
    assert_int_equal(nebel_compute_cloud_sky_transmittance(workspace, 200, 1, origin, 0, &sky), NEBEL_OK);
    nebel_destroy_cloud_workspace(workspace);
    nebel_destroy_cloud_lighting(view);
    lights.sun = above.sun;
    assert_int_equal(nebel_compute_atmosphere_irradiance(w->atmosphere, &above.sun, 1, origin, 0, &light, 0), NEBEL_OK);
    for (int c = 0; c < 3; c++) lights.sun.irradiance[c] = (double)sun * light.sun[c];
    lights.environment.intensity = (double)sky;
    return fog_light(&lights, volume, 1);
}

/* Of pixels the share whose in-scattering is apart by more than 1/255 of the brightest. */
static double light_apart(const picture_pair *pair)
{
    const double most = picture_largest_light(pair) / 255;
    return picture_in_scattering_apart(pair, most);
}

/* How much of the light of fog changes where clouds are not there: less than that of another picture cannot be told. */
static double by_clouds(world *w, nebel_lighting *fog, const nebel_camera *camera, const picture_pair *pair)
{
    nebel_renderer *renderer;
    picture_pair clear = picture_make(pair->width, pair->height);
    double most = 0;
    const nebel_frame_desc frame = {.camera = *camera, .width = pair->width, .height = pair->height, .samples = 1};
    w->planet.clouds = NULL;
    assert_int_equal(nebel_create_cpu_renderer(&w->scene, fog, &(nebel_cpu_renderer_desc){0}, &renderer), NEBEL_OK);
    assert_int_equal(nebel_render_frame(renderer, &frame, &clear.cpu), NEBEL_OK);
    nebel_destroy_renderer(renderer);
    w->planet.clouds = w->clouds;
    for (size_t i = 0; i < 3 * (size_t)pair->width * pair->height; i++)
        most = fmax(most, fabs((double)clear.cpu.in_scattering[i] - (double)pair->gl.in_scattering[i]));
    picture_free(&clear);
    return most / picture_largest_light(pair);
}

static void check(const char *name, world *w, const nebel_volume_desc *volume, const nebel_camera *camera)
{
    picture_pair pair = picture_make(64 * scale, 36 * scale);
    nebel_lighting *const fog = make_fog(w, volume);
    const int objects = pass_count_objects();
    pair.tolerance = NEBEL_DEFAULT_TOLERANCE;
    picture_render(&w->scene, fog, camera, 1, &pair);
    assert_int_equal(pass_count_objects(), objects);
    const double shown = picture_shown_apart(&pair), light = light_apart(&pair),
                 clouds = by_clouds(w, fog, camera, &pair);
    print_message("%s: of 1000 pixels %.2f are shown 2/255 apart, %.2f have other light; clouds change it by %.2f\n",
                  name, 1e3 * shown, 1e3 * light, clouds);
    assert_true(shown <= 1e-3 && light <= 1e-3 && clouds > .05);
    picture_free(&pair);
    nebel_release_lighting(fog);
}

static nebel_volume_desc make_mist(double extinction, double size, double top)
{
    return (nebel_volume_desc){.shape = {.type = NEBEL_SHAPE_BOX, .min = {-size, -5, -size}, .max = {size, top, size}},
                               .extinction = {extinction, extinction, extinction},
                               .albedo = {.97, .97, .97},
                               .phase = {.type = NEBEL_PHASE_HENYEY_GREENSTEIN, .g = .3}};
}

static const double high[3] = {.3, .8, -.2}, low[3] = {.2, .15, -1};

static void mist_has_the_shadows_of_clouds(void **state)
{
    (void)state;
    nb_gl context;
    world w;
    make_world(.5, high, &w);
    nebel_volume_desc mist = make_mist(2e-3, 6000, 60);
    pass_open(&context, NB_GL_330);
    nebel_camera camera = planet_camera(700, -.6);
    check("mist seen from above", &w, &mist, &camera);
    w.scene.mesh_count = 1;
    camera = planet_camera(30, 0);
    check("within it, before a wall that casts shadows", &w, &mist, &camera);
    mist = make_mist(1e-3, 9000, 60);
    w.scene.mesh_count = 0;
    camera = planet_camera(500, -.15);
    check("mist seen from far", &w, &mist, &camera);
    camera = planet_camera(3e5, -1.2);
    camera.vertical_fov = 3;
    check("mist seen from orbit", &w, &mist, &camera);
    mist.shape = (nebel_shape){.type = NEBEL_SHAPE_WORLD};
    mist.density = (nebel_density){.type = NEBEL_DENSITY_HEIGHT, .scale_height = 30};
    camera = planet_camera(300, -.3);
    check("mist without end", &w, &mist, &camera);
    pass_close(&context);
    pass_open(&context, NB_GL_300ES);
    camera = planet_camera(300, 0);
    camera.projection = NEBEL_PROJECTION_PANORAMA;
    mist = make_mist(1e-3, 9000, 60);
    check("all around", &w, &mist, &camera);
    pass_close(&context);
    free_world(&w);
}

static void shadows_are_long_in_a_low_sun(void **state)
{
    (void)state;
    nb_gl context;
    world w;
    make_world(.5, low, &w);
    const nebel_volume_desc mist = make_mist(1e-3, 9000, 100);
    const nebel_camera camera = planet_camera(200, -.1);
    pass_open(&context, NB_GL_330);
    check("mist in a low sun", &w, &mist, &camera);
    pass_close(&context);
    free_world(&w);
}

/* There the air leaves another part of the sun, too. */
static void far_fog_has_both(void **state)
{
    (void)state;
    nb_gl context;
    world w;
    make_world(.6, low, &w);
    const double radius = w.planet.atmosphere_desc.radius, angle = .05, x = radius * sin(angle),
                 y = radius * (cos(angle) - 1);
    nebel_volume_desc mist = make_mist(1e-3, 6000, 0);
    for (int c = 0; c < 3; c++) {
        const double place[3] = {x, y, 0};
        mist.shape.min[c] = place[c] + (c == 1 ? -400 : -6000);
        mist.shape.max[c] = place[c] + (c == 1 ? 400 : 6000);
    }
    nebel_camera camera = planet_camera(0, 0);
    const double eye[3] = {x - 3000, y + 900, 3000}, at[3] = {x, y, 0};
    memcpy(camera.position, eye, sizeof eye);
    memcpy(camera.look_at, at, sizeof at);
    pass_open(&context, NB_GL_330);
    check("mist far from the origin", &w, &mist, &camera);
    pass_close(&context);
    free_world(&w);
}

/* The fog that programs make has no sun, then. Ambient light is no sky, which would be far brighter here than there. */
static void shadows_stand_with_the_origin_by_night(void **state)
{
    (void)state;
    nb_gl context;
    world w;
    make_world(.6, high, &w);
    const double radius = w.planet.atmosphere_desc.radius;
    double *const top = w.planet.atmosphere_desc.ground_point;
    nebel_destroy_clouds(w.clouds);
    nebel_destroy_atmosphere(w.atmosphere);
    for (int c = 0; c < 3; c++) top[c] = radius * (w.scene.sun_direction[c] + (c == 1));
    make_air(.6, &w);
    w.scene.environment = (nebel_environment){.type = NEBEL_ENVIRONMENT_CONSTANT, .radiance = {.1, .15, .2}};
    nebel_volume_desc mist = make_mist(1e-3, 0, 0);
    mist.shape = (nebel_shape){.type = NEBEL_SHAPE_WORLD};
    mist.density = (nebel_density){.type = NEBEL_DENSITY_ALTITUDE,
                                   .scale_height = 60,
                                   .center = {top[0], top[1] - radius, top[2]},
                                   .radius = radius};
    nebel_camera camera = planet_camera(300, -.6);
    for (int c = 0; c < 3; c++) {
        camera.position[c] += top[c];
        camera.look_at[c] += top[c];
    }
    pass_open(&context, NB_GL_330);
    check("mist by day, the origin by night", &w, &mist, &camera);
    pass_close(&context);
    free_world(&w);
}

int main(int argc, char **argv)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(mist_has_the_shadows_of_clouds),
        cmocka_unit_test(shadows_are_long_in_a_low_sun),
        cmocka_unit_test(far_fog_has_both),
        cmocka_unit_test(shadows_stand_with_the_origin_by_night),
    };
    if (argc > 1) scale = (uint32_t)atoi(argv[1]);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
