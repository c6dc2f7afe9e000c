/* Small scenes, the exact method against the reference at one bounce: every block of 16 x 16 pixels. The first
 * argument says how many times more samples than in passing: beyond 4096 as the mean of several pictures. */
#include "test_render_scene.h"

enum {
    WIDTH = 32,
    HEIGHT = 16,
    BLOCK = 16,
    PIXELS = WIDTH * HEIGHT,
    MOST_VOLUMES = 4,
    MOST_MESHES = 3,
    MAX_LIGHTS = 2
};

static uint32_t samples = 128, pictures = 1;

typedef struct trial {
    const char *name;
    nebel_scene_data scene;
    nebel_camera camera;
    size_t volume_count;
    nebel_volume_desc volumes[MOST_VOLUMES];
    nebel_mesh meshes[MOST_MESHES];
    nebel_light lights[MAX_LIGHTS];
} trial;

static void set_rgb(double rgb[3], double r, double g, double b)
{
    rgb[0] = r;
    rgb[1] = g;
    rgb[2] = b;
}

static test_barrel barrel;

static trial start(const char *name)
{
    trial t = {.name = name, .camera = test_camera(0, 2, 12, 0, 1, 0)};
    set_rgb(t.scene.background, .3, .4, .5);
    set_rgb(t.scene.ambient, .2, .25, .3);
    t.scene.has_sun = 1;
    set_rgb(t.scene.sun_direction, .48, .6, .64);
    set_rgb(t.scene.sun_irradiance, 2, 1.9, 1.7);
    return t;
}

static nebel_volume_desc *add(trial *t, double extinction, double albedo)
{
    nebel_volume_desc *v = &t->volumes[t->volume_count++];
    set_rgb(v->extinction, extinction, extinction, extinction);
    set_rgb(v->albedo, albedo, .9 * albedo, .8 * albedo);
    return v;
}

static void add_mesh(trial *t, nebel_mesh mesh)
{
    t->meshes[t->scene.mesh_count++] = mesh;
}

static trial ball_of_fog(void)
{
    trial t = start("ball");
    nebel_volume_desc *v = add(&t, .3, 1);
    v->shape = (nebel_shape){.type = NEBEL_SHAPE_SPHERE, .center = {0, 1, 0}, .radius = 3};
    v->phase = (nebel_phase){.type = NEBEL_PHASE_HENYEY_GREENSTEIN, .g = .6};
    return t;
}

static trial mist_on_the_ground(void)
{
    trial t = start("mist");
    add_mesh(&t, test_ground());
    add(&t, .05, .9)->density = (nebel_density){.type = NEBEL_DENSITY_HEIGHT, .scale_height = 2};
    t.volumes[0].shape = (nebel_shape){.type = NEBEL_SHAPE_HALF_SPACE, .normal = {0, -1, 0}};
    return t;
}

/* What has a source and what is lit, through each other. */
static trial mixture(void)
{
    trial t = start("mixture");
    nebel_volume_desc *haze = add(&t, .03, 0);
    set_rgb(haze->source, .5, .5, .6);
    haze->density = (nebel_density){.type = NEBEL_DENSITY_HEIGHT, .scale_height = 5};
    nebel_volume_desc *cloud = add(&t, .8, .9);
    cloud->shape = (nebel_shape){.type = NEBEL_SHAPE_ELLIPSOID, .center = {1, 1, 0}, .radii = {3, 1, 2}};
    cloud->density = (nebel_density){.type = NEBEL_DENSITY_RADIAL, .power = 2};
    cloud->phase = (nebel_phase){.type = NEBEL_PHASE_RAYLEIGH};
    return t;
}

static trial column_with_shafts(void)
{
    trial t = start("shafts");
    add_mesh(&t, barrel.mesh);
    add_mesh(&t, test_ground());
    add(&t, .1, 1)->shape = (nebel_shape){.type = NEBEL_SHAPE_BOX, .min = {-4, -1, -4}, .max = {4, 4, 4}};
    t.volumes[0].phase = (nebel_phase){.type = NEBEL_PHASE_ISOTROPIC};
    return t;
}

static trial coloured_fog(void)
{
    trial t = start("colours");
    add(&t, .2, 1)->shape =
        (nebel_shape){.type = NEBEL_SHAPE_CAPSULE, .from = {-3, 1, 0}, .to = {3, 2, 0}, .radius = 1.5};
    set_rgb(t.volumes[0].extinction, .1, .3, .6);
    add_mesh(&t, test_ground());
    return t;
}

static trial emission(void)
{
    trial t = start("emission");
    nebel_volume_desc *v = add(&t, 0, 0);
    set_rgb(v->emission, .05, .1, .02);
    v->density = (nebel_density){.type = NEBEL_DENSITY_GAUSSIAN, .center = {0, 1, 0}, .sigma = 1};
    v->shape = (nebel_shape){.type = NEBEL_SHAPE_SPHERE, .center = {0, 1, 0}, .radius = 4};
    add(&t, .1, .5)->shape =
        (nebel_shape){.type = NEBEL_SHAPE_CYLINDER, .from = {-3, 0, 2}, .to = {3, 2, 2}, .radius = 1};
    return t;
}

static trial hollow_and_replaced(void)
{
    trial t = start("priorities");
    add(&t, .15, 1)->shape = (nebel_shape){.type = NEBEL_SHAPE_BOX, .min = {-5, -2, -3}, .max = {5, 4, 3}};
    nebel_volume_desc *hole = add(&t, 0, 0);
    hole->shape = (nebel_shape){.type = NEBEL_SHAPE_SPHERE, .center = {-2, 1, 1}, .radius = 1.5};
    hole->operation = NEBEL_OPERATION_EXCLUDE;
    nebel_volume_desc *core = add(&t, .6, .7);
    core->shape = (nebel_shape){.type = NEBEL_SHAPE_BOX, .min = {1, 0, -1}, .max = {3, 2, 2}};
    core->operation = NEBEL_OPERATION_REPLACE;
    core->priority = 1;
    core->density = (nebel_density){.type = NEBEL_DENSITY_SOFT_EDGE, .edge_width = .4};
    return t;
}

static trial distances(void)
{
    trial t = start("distances");
    nebel_volume_desc *v = add(&t, .08, .8);
    v->start = 9;
    v->cutoff = 14;
    v->density = (nebel_density){.type = NEBEL_DENSITY_LINEAR, .from = {0, 6, 0}, .to = {0, -1, 0}};
    v->shape = (nebel_shape){.type = NEBEL_SHAPE_SPHERE, .radius = 8};
    add_mesh(&t, barrel.mesh);
    return t;
}

/* Droplets look at the sun. */
static trial against_the_sun(void)
{
    trial t = start("droplets");
    set_rgb(t.scene.sun_direction, 0, .28, -.96);
    add(&t, .25, 1)->phase = (nebel_phase){.type = NEBEL_PHASE_DROPLETS, .diameter = 12};
    t.volumes[0].shape = (nebel_shape){.type = NEBEL_SHAPE_CONE, .from = {0, -1, 0}, .to = {0, 5, 0}, .radius_from = 3};
    return t;
}

static trial panorama(void)
{
    trial t = start("panorama");
    t.camera = test_camera(0, 1, 3, 0, 1, 0);
    t.camera.projection = NEBEL_PROJECTION_PANORAMA;
    add_mesh(&t, test_ground());
    add_mesh(&t, barrel.mesh);
    add(&t, .1, 1)->shape = (nebel_shape){.type = NEBEL_SHAPE_SPHERE, .radius = 6};
    t.volumes[0].phase = (nebel_phase){.type = NEBEL_PHASE_CORNETTE_SHANKS, .g = .3};
    return t;
}

/* A cloud of few voxels, turned, denser than 1 in places. */
static trial cloud_of_voxels(void)
{
    trial t = start("voxels");
    enum { SIDE = 6 };
    float voxels[SIDE * SIDE * SIDE];
    uint64_t numbers = 4;
    for (int i = 0; i < SIDE * SIDE * SIDE; i++) voxels[i] = (float)fmax(0, dice(&numbers, -1, 2));
    const nebel_grid_desc desc = {.size = {SIDE, SIDE, SIDE}, .type = NEBEL_VOXEL_FLOAT, .voxels = voxels};
    nebel_volume_desc *cloud = add(&t, .5, 1);
    cloud->shape = (nebel_shape){.type = NEBEL_SHAPE_BOX,
                                 .transform = {.position = {0, 1, 0}, .rotation = {.1, .2, .3, .9}},
                                 .min = {-3, -2, -2},
                                 .max = {3, 2, 2}};
    cloud->density.type = NEBEL_DENSITY_GRID;
    cloud->phase = (nebel_phase){.type = NEBEL_PHASE_HENYEY_GREENSTEIN, .g = .4};
    assert_int_equal(nebel_create_grid(&desc, &cloud->density.grid), NEBEL_OK);
    add_mesh(&t, test_ground());
    return t;
}

static void add_lights(trial *t)
{
    t->scene.light_count = 2;
    t->lights[0] = (nebel_light){.position = {-1, 1.5, 1}, .intensity = {4, 3, 2}, .radius = .05};
    t->lights[1] = (nebel_light){.type = NEBEL_LIGHT_SPOT,
                                 .position = {2, 4, 0},
                                 .intensity = {5, 10, 15},
                                 .direction = {-1, -3, .5},
                                 .inner_angle = 15,
                                 .outer_angle = 40};
}

/* Two fogs through each other, one of them with a point light within. */
static trial lights_in_fog(void)
{
    trial t = start("point lights");
    add_lights(&t);
    t.scene.has_sun = 0;
    set_rgb(t.scene.sun_irradiance, 0, 0, 0);
    add_mesh(&t, test_ground());
    add(&t, .06, .9)->density = (nebel_density){.type = NEBEL_DENSITY_HEIGHT, .scale_height = 2};
    t.volumes[0].shape = (nebel_shape){.type = NEBEL_SHAPE_HALF_SPACE, .normal = {0, -1, 0}};
    nebel_volume_desc *ball = add(&t, .4, 1);
    ball->shape = (nebel_shape){.type = NEBEL_SHAPE_SPHERE, .center = {-1, 1, 0}, .radius = 2};
    ball->phase = (nebel_phase){.type = NEBEL_PHASE_HENYEY_GREENSTEIN, .g = .6};
    return t;
}

/* The column's shadows are in fog. */
static trial lights_behind_a_column(void)
{
    trial t = lights_in_fog();
    t.name = "column";
    t.lights[0].position[0] = -2;
    add_mesh(&t, barrel.mesh);
    return t;
}

/* Fog takes its colour, and the surfaces their shadows. */
static trial lights_on_surfaces(void)
{
    trial t = start("shadows");
    add_lights(&t);
    t.lights[0].position[0] = -3;
    add_mesh(&t, test_ground());
    add_mesh(&t, barrel.mesh);
    add(&t, .05, 0)->shape = (nebel_shape){.type = NEBEL_SHAPE_SPHERE, .radius = 6};
    set_rgb(t.volumes[0].extinction, .02, .05, .1);
    return t;
}

/* Ambient light alone, of a sky that is bright level with the eye and blue above. */
static trial gradient(void)
{
    trial t = start("gradient");
    t.scene.has_sun = 0;
    set_rgb(t.scene.sun_irradiance, 0, 0, 0);
    t.scene.shows_ambient = 1;
    t.scene.environment.type = NEBEL_ENVIRONMENT_GRADIENT;
    set_rgb(t.scene.environment.zenith, .1, .3, 1);
    set_rgb(t.scene.environment.horizon, 1, .8, .5);
    set_rgb(t.scene.environment.ground, .1, .05, 0);
    add_mesh(&t, barrel.mesh);
    add_mesh(&t, test_ground());
    add(&t, .05, 1)->phase = (nebel_phase){.type = NEBEL_PHASE_HENYEY_GREENSTEIN, .g = .8};
    t.volumes[0].density = (nebel_density){.type = NEBEL_DENSITY_HEIGHT, .scale_height = 3};
    t.volumes[0].shape = (nebel_shape){.type = NEBEL_SHAPE_HALF_SPACE, .normal = {0, -1, 0}};
    add(&t, .4, .9)->shape = (nebel_shape){.type = NEBEL_SHAPE_SPHERE, .center = {-2, 2, 0}, .radius = 2};
    return t;
}

/* A picture with a bright corner behind the camera's back and one before it, turned. */
static trial environment(void)
{
    trial t = gradient();
    t.name = "map";
    enum { ROWS = 16 };
    float pixels[ROWS][2 * ROWS][3];
    for (int y = 0; y < ROWS; y++)
        for (int x = 0; x < 2 * ROWS; x++)
            for (int c = 0; c < 3; c++) pixels[y][x][c] = (x / 4 + y / 4 * 3) % 5 == c ? 1.5F : .1F + .02F * (float)y;
    const nebel_environment_map_desc desc = {.width = 2 * ROWS, .height = ROWS, .pixels = pixels[0][0]};
    t.scene.environment = (nebel_environment){.type = NEBEL_ENVIRONMENT_MAP, .rotation = 50};
    assert_int_equal(nebel_create_environment_map(&desc, &t.scene.environment.map), NEBEL_OK);
    return t;
}

/* ---- pictures -------------------------------------------------------------------------------- */

static void take(const trial *t, nebel_method method, uint32_t seed, float *color, float *error)
{
    nebel_lighting_desc lights = {
        .sun.direction = {t->scene.sun_direction[0], t->scene.sun_direction[1], t->scene.sun_direction[2]},
        .environment = t->scene.environment,
        .lights = t->lights,
        .light_count = t->scene.light_count};
    memcpy(lights.sun.irradiance, t->scene.sun_irradiance, sizeof lights.sun.irradiance);
    if (lights.environment.type == NEBEL_ENVIRONMENT_CONSTANT)
        memcpy(lights.environment.radiance, t->scene.ambient, sizeof t->scene.ambient);
    nebel_lighting *fog = fog_commit_lit(&(nebel_fog_desc){0}, t->volumes, t->volume_count, &lights);
    nebel_scene_data scene = t->scene;
    scene.meshes = t->meshes;
    scene.lights = t->lights;
    nebel_renderer *renderer = NULL;
    assert_int_equal(nebel_create_cpu_renderer(&scene, fog, &(nebel_cpu_renderer_desc){.thread_count = 0}, &renderer),
                     NEBEL_OK);
    assert_int_equal(nebel_set_renderer_method(renderer, method, NULL), NEBEL_OK);
    const nebel_frame_desc frame = {
        .camera = t->camera, .width = WIDTH, .height = HEIGHT, .samples = samples, .seed = seed, .bounces = 1};
    assert_int_equal(nebel_render_frame(renderer, &frame, &(nebel_frame){.color = color, .standard_error = error}),
                     NEBEL_OK);
    nebel_destroy_renderer(renderer);
    nebel_release_lighting(fog);
}

/* The mean of the reference's pictures, and its standard error. */
static void take_paths(const trial *t, float *color, float *error)
{
    static float one[3 * PIXELS], its[3 * PIXELS];
    const float part = 1 / (float)pictures;
    for (size_t i = 0; i < 3 * PIXELS; i++) color[i] = error[i] = 0;
    for (uint32_t seed = 0; seed < pictures; seed++) {
        take(t, NEBEL_METHOD_PATH, seed, one, its);
        for (size_t i = 0; i < 3 * PIXELS; i++) {
            color[i] += part * one[i];
            error[i] = hypotf(error[i], part * its[i]);
        }
    }
}

/* In units of what it may be: the tolerance, and four standard errors. */
static double compare_block(uint32_t left, size_t channel, const float *exact, const float *paths, const float *errors)
{
    double off = 0, variance = 0;
    for (size_t y = 0; y < HEIGHT; y++) {
        for (size_t x = left; x < left + BLOCK; x++) {
            const size_t i = 3 * (y * WIDTH + x) + channel;
            off += (double)(exact[i] - paths[i]) / (BLOCK * HEIGHT);
            variance += pow((double)errors[i] / (BLOCK * HEIGHT), 2);
        }
    }
    return fabs(off) / (NEBEL_DEFAULT_TOLERANCE + 4 * sqrt(variance));
}

static void compare(trial t)
{
    static float exact[3 * PIXELS], paths[3 * PIXELS], errors[3 * PIXELS];
    take(&t, NEBEL_METHOD_EXACT, 0, exact, NULL);
    take_paths(&t, paths, errors);
    double worst = 0, told = 0;
    for (size_t c = 0; c < 3; c++)
        for (uint32_t left = 0; left < WIDTH; left += BLOCK)
            worst = fmax(worst, compare_block(left, c, exact, paths, errors));
    for (size_t i = 0; i < 3 * PIXELS; i++) told += pow((double)errors[i], 2) / (3 * PIXELS);
    print_message("%-10s off by %.2f of what it may be; standard error of a block %.1e\n", t.name, worst,
                  sqrt(told) / BLOCK);
    for (size_t i = 0; i < t.volume_count; i++) nebel_release_grid(t.volumes[i].density.grid);
    nebel_release_environment_map(t.scene.environment.map);
    assert_true(worst <= 1);
}

#define TRIAL(make)                                                                                                    \
    static void make##_agrees(void **state)                                                                            \
    {                                                                                                                  \
        (void)state;                                                                                                   \
        compare(make());                                                                                               \
    }

TRIAL(ball_of_fog)
TRIAL(mist_on_the_ground)
TRIAL(mixture)
TRIAL(column_with_shafts)
TRIAL(coloured_fog)
TRIAL(emission)
TRIAL(hollow_and_replaced)
TRIAL(distances)
TRIAL(against_the_sun)
TRIAL(panorama)
TRIAL(cloud_of_voxels)
TRIAL(lights_in_fog)
TRIAL(lights_behind_a_column)
TRIAL(lights_on_surfaces)
TRIAL(gradient)
TRIAL(environment)

int main(int count, char **words)
{
    const struct CMUnitTest tests[] = {
        cmocka_unit_test(ball_of_fog_agrees),
        cmocka_unit_test(mist_on_the_ground_agrees),
        cmocka_unit_test(mixture_agrees),
        cmocka_unit_test(column_with_shafts_agrees),
        cmocka_unit_test(coloured_fog_agrees),
        cmocka_unit_test(emission_agrees),
        cmocka_unit_test(hollow_and_replaced_agrees),
        cmocka_unit_test(distances_agrees),
        cmocka_unit_test(against_the_sun_agrees),
        cmocka_unit_test(panorama_agrees),
        cmocka_unit_test(cloud_of_voxels_agrees),
        cmocka_unit_test(lights_in_fog_agrees),
        cmocka_unit_test(lights_behind_a_column_agrees),
        cmocka_unit_test(lights_on_surfaces_agrees),
        cmocka_unit_test(gradient_agrees),
        cmocka_unit_test(environment_agrees),
    };
    const uint32_t effort = count > 1 ? (uint32_t)strtoul(words[1], NULL, 10) : 1;
    pictures = (effort + 31) / 32;
    samples *= effort / pictures;
    test_barrel_make(&barrel);
    return cmocka_run_group_tests(tests, NULL, NULL);
}
