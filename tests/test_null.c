/* No public function of the core, of scenes and of the CPU renderer crashes on NULL: each is called with NULL for all of its
 * pointers, and for each in turn while the others are good (null_calls.py). It returns, and says OK or ARGUMENT where it has a
 * result, or FILE where a path is good: there is nothing at it. Each that takes a host says ARGUMENT where its allocator has one
 * function of two. */
#include "scene_help.h"

#include <nebel/classic.h>
#include <nebel/planet.h>
#include <nebel/light.h>
#include <nebel/particles.h>
#include <nebel/photograph.h>
#include <nebel/render.h>
#include <nebel/shader.h>

#include <math.h>

/* ---- good arguments -------------------------------------------------------------------------- */

static const nebel_log good_log = {.write = NULL};
static const nebel_host good_host = {.log.write = NULL};
static const double vector[3] = {0, 1, 0}, places[1][3] = {{0, 1500, 0}};
static const double matrix[16] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1};
static const double numbers[1] = {1}, *const directions[3] = {numbers, numbers, numbers};
static const float floats[16] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1};
static const size_t zero = 0;
static const char path[] = "/nonexistent/test_null.png";

static const nebel_cell good_cell = {.shape = {.type = NEBEL_SHAPE_BOX, .max = {1, 1, 1}}, .density = .1};
static const nebel_cells_desc good_cells_desc = {.cells = &good_cell, .cell_count = 1};
static const nebel_cell_view good_cell_view = {.eye = {.5, .5, .5}, .forward = {0, 0, -1}};
static const nebel_cell_point good_cell_point = {.position = {.5, .5, 0}};
static const nebel_factor_desc good_factor_desc = {.end = 1, .density = 1};
static const nebel_d3d9_fog good_d3d9_fog = {.fog_enable = 1, .fog_end = 1};
static const nebel_d3d9_vertex good_d3d9_vertex = {.position = {0, 0, .5}};
static const nebel_curve good_curve = {.type = NEBEL_CURVE_LINEAR, .scale = 1};
static const nebel_vertex_desc good_vertex_desc = {.channel = 0};
static const nebel_vertices good_vertices = {.positions = floats};
static const uint32_t indices[3] = {0, 1, 2};
static const nebel_tessellation_desc good_tessellation_desc = {.eye = {0, 0, 5}};
static const nebel_triangles good_triangles = {
    .positions = floats, .vertex_count = 3, .indices = indices, .triangle_count = 1};
static const nebel_cloud_layer good_cloud_layer = {.coverage = .5};
static const nebel_diffusion_desc good_diffusion_desc = {.max_cells = 512};
static const nebel_lighting_desc good_lighting_desc = {.light_count = 0};
static const nebel_environment good_environment = {.type = NEBEL_ENVIRONMENT_CONSTANT};
static const float sky[24] = {1};
static const nebel_environment_map_desc good_environment_map_desc = {.width = 4, .height = 2, .pixels = sky};
static const nebel_planet_map_desc good_planet_map_desc = {.width = 2, .height = 1};
static const nebel_planet_map good_planet_map = {.width = 4, .height = 2, .channels = 3, .texels = sky};
static const nebel_textured_planet_desc good_textured_planet_desc = {
    .color_map = {.width = 4, .height = 2, .channels = 3, .texels = sky}};
static const nebel_textured_planet_query good_textured_planet_query = {.pixel_spread = 0};
static const nebel_grid_desc good_grid_desc = {.size = {1, 1, 1}, .voxels = floats};
static const nebel_noise_desc good_noise_desc = {.size = {4, 4, 4}, .frequency = {1, 1, 1}};
static const nebel_droplet_distribution good_droplet_distribution = {1, 1, 1, 1};
static const nebel_fog_desc good_fog_desc = {.max_opacity = 0};
static const nebel_volume_desc good_volume_desc = {
    .shape = {.type = NEBEL_SHAPE_BOX, .max = {1, 1, 1}}, .extinction = {.1, .1, .1}, .source = {1, 1, 1}};
static const nebel_sun good_sun = {.direction = {0, 1, 0}, .irradiance = {1, 1, 1}};
static const nebel_trace_desc good_trace_desc = {.tolerance = 0};
static const nebel_ray good_ray = {{0, 1, 0}, {0, 1, 0}, 1};
static const nebel_ray_planes good_ray_planes = {.direction = {0, 1, 0}};
static const nebel_segments good_segments = {.from = floats, .to = floats + 3};
static const nebel_transfer good_transfer = {.transmittance = {1, 1, 1}};
static const nebel_nebula_desc good_nebula_desc = {.shape = {.type = NEBEL_SHAPE_BOX, .max = {1, 1, 1}}, .count = 1};
static const nebel_sample_point good_sample_point = {.position = {.5, .5, .5}};
static const nebel_cpu_renderer_desc good_cpu_renderer_desc = {.thread_count = 1};
static const nebel_method_desc good_method_desc = {.factor = &good_factor_desc};
static const nebel_frame_desc good_frame_desc = {
    .camera = {.look_at = {0, 0, -1}, .up = {0, 1, 0}, .vertical_fov = 50}, .width = 1, .height = 1, .samples = 1};
static const nebel_scene_desc good_scene_desc = {.memory = 0};
static const nebel_scene_model good_scene_model = {.model_index = 0};
static const char *const channels[] = {"R", "G", "B"};
static const nebel_image_desc good_image_desc = {
    .width = 1, .height = 1, .channel_count = 3, .channel_names = channels};
static const nebel_movie_desc good_movie_desc = {.quality = 0};
static const nebel_grid_file good_grid_file = {.path = "/nonexistent/test_null.raw", .size = {1, 1, 1}};
static const nebel_view good_view = {.eye_from_world = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1},
                                     .clip_from_eye = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, -1, -1, 0, 0, -2, 0},
                                     .width = 16,
                                     .height = 16};
static const nebel_depth_desc good_depth_desc = {.encoding = NEBEL_DEPTH_ENCODING_WINDOW};

/* What calls write to. */
static struct {
    nebel_cell_fog cell_fog;
    nebel_cell_segment cell_segment;
    nebel_factor_desc factor_desc;
    nebel_d3d9_fog d3d9_fog;
    nebel_curve curve;
    nebel_vertex_desc vertex_desc;
    nebel_cloud_layer cloud_layer;
    nebel_cloud_transfer cloud_transfer;
    nebel_air_shadow air_shadow;
    nebel_fog_shadow fog_shadow;
    nebel_planet_map planet_map;
    nebel_shell_hits shell_hits;
    nebel_droplet_properties droplet_properties;
    size_t count;
    nebel_volume_id volume_id;
    nebel_bounds bounds;
    const nebel_light *lights;
    nebel_transfer transfer;
    nebel_particle particle;
    nebel_medium_properties medium_properties;
    nebel_scatterer scatterer;
    nebel_majorant_segment majorant_segment;
    nebel_atmosphere_desc atmosphere_desc;
    nebel_irradiance irradiance;
    nebel_sun sun;
    nebel_environment environment;
    nebel_scene_noise scene_noise;
    nebel_image image;
    nebel_photograph photograph;
    nebel_intrinsics intrinsics;
    nebel_pixels pixels;
    nebel_depth_map depth_map;
    nebel_rays rays;
    nebel_view_error view_error;
    nebel_texel_f32 texel_f32[64];
    nebel_texel_u32 texel_u32[64];
    uint32_t entries[64];
    double vector[3], number;
    float floats[64];
    char record[NEBEL_MAX_RECORD + 1];
} out;

static const nebel_vertex_output good_vertex_output = {NEBEL_VERTEX_FACTOR, out.floats, 0};
static const nebel_transfer_planes good_transfer_planes = {
    .transmittance = {out.floats, out.floats + 1, out.floats + 2}};
static const nebel_ground_planes good_ground_planes = {.distance = out.floats,
                                                       .normal = {out.floats + 1, out.floats + 2, out.floats + 3},
                                                       .sun = {out.floats + 4, out.floats + 5, out.floats + 6},
                                                       .sky = {out.floats + 7, out.floats + 8, out.floats + 9}};
static const nebel_pixels good_pixels = {.corner = {0, 0, -1},
                                         .step_x = {1, 0, 0},
                                         .step_y = {0, 1, 0},
                                         .width = 1,
                                         .height = 1,
                                         .depth = floats,
                                         .depth_pitch = 4,
                                         .color = (const uint8_t *)floats,
                                         .color_pitch = 4,
                                         .output = (uint8_t *)out.floats,
                                         .output_pitch = 4};
static const nebel_frame good_frame = {.color = out.floats};
static nebel_image good_image = {
    .width = 1, .height = 1, .channel_count = 3, .channel_names = channels, .samples = out.floats};

static const nebel_camera good_camera = {.look_at = {0, 0, -1}, .up = {0, 1, 0}};
static const nebel_photograph good_photograph = {1, 1, NEBEL_PIXEL_RGB8, out.floats};
static const nebel_intrinsics good_intrinsics = {1, 1, 0, 0, 0};
static const nebel_depth_source good_depth_source = {.format = "kitti"};

/* What calls take: made before them, or NULL for them to fill. */
typedef struct objects {
    nebel_cells *cells;
    nebel_fog *fog;
    nebel_volume_id id;
    nebel_snapshot *snapshot;
    nebel_lighting *lighting;
    nebel_environment_map *environment_map;
    nebel_grid *grid;
    nebel_textured_planet *textured_planet;
    nebel_atmosphere *atmosphere;
    nebel_sky_view *sky_view;
    nebel_clouds *clouds;
    nebel_cloud_lighting *cloud_lighting;
    nebel_cloud_workspace *cloud_workspace;
    nebel_scene *scene;
    const nebel_scene_data *contents;
    nebel_renderer *renderer;
    nebel_movie *movie;
    nebel_image_writer *image_writer;
    nebel_particle *particle;
    nebel_tessellation *tessellation;
} objects;
static objects made, fresh;

static nebel_atmosphere_desc good_atmosphere_desc;
static nebel_sky_view_desc good_sky_view_desc;
static nebel_clouds_desc good_clouds_desc;
static nebel_cloud_lighting_desc good_cloud_lighting_desc;
static nebel_scene_noise good_scene_noise;
static nebel_planet good_planet;

static int make_things(void **state)
{
    static const char text[] =
        "{\"nebel\": 1, \"fog\": [{\"shape\": {\"type\": \"box\", \"min\": [0, 0, 0], \"max\": [1, 1, 1]}, "
        "\"extinction\": 0.1}]}";
    (void)state;
    good_atmosphere_desc = *nebel_lookup_atmosphere("toy");
    assert_int_equal(nebel_create_cells(&good_cells_desc, &made.cells), NEBEL_OK);
    assert_int_equal(nebel_create_fog(&good_fog_desc, &made.fog), NEBEL_OK);
    assert_int_equal(nebel_add_volume(made.fog, &good_volume_desc, &made.id), NEBEL_OK);
    assert_int_equal(nebel_commit_fog(made.fog, &made.snapshot), NEBEL_OK);
    assert_int_equal(nebel_create_lighting(made.snapshot, &good_lighting_desc, &made.lighting), NEBEL_OK);
    assert_int_equal(nebel_create_environment_map(&good_environment_map_desc, &made.environment_map), NEBEL_OK);
    assert_int_equal(nebel_create_noise_grid(&good_noise_desc, &made.grid), NEBEL_OK);
    assert_int_equal(nebel_create_textured_planet(&good_textured_planet_desc, &made.textured_planet), NEBEL_OK);
    assert_int_equal(nebel_create_atmosphere(&good_atmosphere_desc, &made.atmosphere), NEBEL_OK);
    good_sky_view_desc = (nebel_sky_view_desc){.atmosphere = made.atmosphere, .sun = good_sun};
    assert_int_equal(nebel_create_sky_view(&good_sky_view_desc, &made.sky_view), NEBEL_OK);
    good_clouds_desc =
        (nebel_clouds_desc){.atmosphere = made.atmosphere, .layers = {good_cloud_layer}, .layer_count = 1};
    assert_int_equal(nebel_create_clouds(&good_clouds_desc, &made.clouds), NEBEL_OK);
    good_cloud_lighting_desc = (nebel_cloud_lighting_desc){.clouds = made.clouds, .sun = good_sun};
    assert_int_equal(nebel_create_cloud_lighting(&good_cloud_lighting_desc, &made.cloud_lighting), NEBEL_OK);
    assert_int_equal(nebel_create_cloud_workspace(made.cloud_lighting, &made.cloud_workspace), NEBEL_OK);
    assert_int_equal(nebel_parse_scene(text, sizeof text - 1, "test_null.json", &good_scene_desc, &made.scene),
                     NEBEL_OK);
    made.contents = nebel_get_scene_data(made.scene);
    assert_int_equal(nebel_create_cpu_renderer(made.contents, made.lighting, &good_cpu_renderer_desc, &made.renderer),
                     NEBEL_OK);
    good_scene_noise.desc = good_noise_desc;
    return 0;
}

static int free_things(void **state)
{
    (void)state;
    nebel_destroy_renderer(made.renderer);
    nebel_destroy_scene(made.scene);
    nebel_destroy_cloud_workspace(made.cloud_workspace);
    nebel_destroy_cloud_lighting(made.cloud_lighting);
    nebel_destroy_clouds(made.clouds);
    nebel_destroy_sky_view(made.sky_view);
    nebel_destroy_atmosphere(made.atmosphere);
    nebel_destroy_textured_planet(made.textured_planet);
    nebel_release_grid(made.grid);
    nebel_release_environment_map(made.environment_map);
    nebel_release_lighting(made.lighting);
    nebel_release_snapshot(made.snapshot);
    nebel_destroy_fog(made.fog);
    nebel_destroy_cells(made.cells);
    return 0;
}

/* What a call with NULL for what it can do without has made. */
static void free_fresh(void)
{
    nebel_destroy_cells(fresh.cells);
    nebel_destroy_fog(fresh.fog);
    nebel_release_lighting(fresh.lighting);
    nebel_release_snapshot(fresh.snapshot);
    nebel_release_environment_map(fresh.environment_map);
    nebel_release_grid(fresh.grid);
    nebel_destroy_textured_planet(fresh.textured_planet);
    nebel_destroy_sky_view(fresh.sky_view);
    nebel_destroy_atmosphere(fresh.atmosphere);
    nebel_destroy_cloud_workspace(fresh.cloud_workspace);
    nebel_destroy_cloud_lighting(fresh.cloud_lighting);
    nebel_destroy_clouds(fresh.clouds);
    nebel_destroy_scene(fresh.scene);
    nebel_destroy_renderer(fresh.renderer);
    nebel_destroy_movie(fresh.movie);
    nebel_destroy_image_writer(fresh.image_writer);
    nebel_free_scene_particles(made.scene, fresh.particle);
    nebel_destroy_tessellation(fresh.tessellation);
    memset(&fresh, 0, sizeof fresh);
}

static void do_nothing(void *data, size_t i)
{
    (void)data;
    (void)i;
}

/* ---- calls ----------------------------------------------------------------------------------- */

static void check(const char *call, nebel_result result)
{
    if (result != NEBEL_OK && result != NEBEL_ERROR_ARGUMENT && result != NEBEL_ERROR_FILE)
        fail_msg("%s: %s", call, nebel_result_text(result));
    free_fresh();
}

#define TRY(call) check(#call, call)
#define RUN(call) ((void)(call))

#include NB_NULL_CALLS_cpu

int main(void)
{
    const struct CMUnitTest tests[] = {NULL_TESTS};
    return cmocka_run_group_tests(tests, make_things, free_things);
}
