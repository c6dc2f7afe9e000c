/* The planets of a scene: layers; or air, and what that does to the light at the scene's origin. */
#include "scene_data.h"

#include "aerial/eclipse.h"
#include "aerial/fog_shadow.h"
#include "frame/surface_lighting.h"

#include <math.h>
#include <string.h>

/* The sky of the origin as a map: pixels, each the mean of a few directions. */
enum { SKY_WIDTH = 64, SKY_HEIGHT = SKY_WIDTH / 2, WITHIN = 4, LOOKS = SKY_WIDTH * WITHIN * WITHIN };

#define PI 3.14159265358979323846

/* One row of pixels, as nebel_environment_map_desc has them. */
typedef struct nb_sky_row {
    double direction[3][LOOKS];
    float transmittance[3][LOOKS], light[3][LOOKS], distance[LOOKS], normal[3][LOOKS], sun[3][LOOKS], sky[3][LOOKS];
} nb_sky_row;

static void aim(int row, nb_sky_row *looks)
{
    for (int i = 0; i < LOOKS; i++) {
        const int column = i % (SKY_WIDTH * WITHIN), line = row * WITHIN + i / (SKY_WIDTH * WITHIN);
        const double longitude = 2 * PI * ((column + 0.5) / (SKY_WIDTH * WITHIN) - 0.5);
        const double latitude = PI * (0.5 - (line + 0.5) / (SKY_HEIGHT * WITHIN));
        looks->direction[0][i] = cos(latitude) * sin(longitude);
        looks->direction[1][i] = sin(latitude);
        looks->direction[2][i] = -cos(latitude) * cos(longitude);
    }
}

static void look(const nebel_sky_view *view, nb_sky_row *looks)
{
    const double *const direction[3] = {looks->direction[0], looks->direction[1], looks->direction[2]};
    const nebel_transfer_planes transfers = {
        .transmittance = {looks->transmittance[0], looks->transmittance[1], looks->transmittance[2]},
        .in_scattering = {looks->light[0], looks->light[1], looks->light[2]}};
    const nebel_ground_planes ground = {.distance = looks->distance,
                                        .normal = {looks->normal[0], looks->normal[1], looks->normal[2]},
                                        .sun = {looks->sun[0], looks->sun[1], looks->sun[2]},
                                        .sky = {looks->sky[0], looks->sky[1], looks->sky[2]}};
    nebel_trace_sky_view(view, LOOKS, direction, NULL, &transfers);
    nebel_trace_ground(view, LOOKS, direction, &ground);
}

/* Radiance of a look, with Lambert's ground behind the air. */
static double radiance(const nb_sky_row *looks, const nebel_planet *planet, const double sun[3], int i, int c)
{
    double light = (double)looks->light[c][i];
    if (!((double)looks->distance[i] < HUGE_VAL)) return light;
    double cosine = 0;
    for (int k = 0; k < 3; k++) cosine += sun[k] * (double)looks->normal[k][i];
    const double arrives = fmax(0, cosine) * (double)looks->sun[c][i] + (double)looks->sky[c][i];
    return light + (double)looks->transmittance[c][i] * planet->atmosphere_desc.ground_albedo[c] / PI * arrives;
}

static nebel_result make_sky_map(nebel_scene *scene, const nebel_planet *planet, const nebel_sky_view *view,
                                 nebel_environment_map **map)
{
    nebel_result result = NEBEL_ERROR_MEMORY;
    nb_sky_row *looks = nb_allocate(&scene->allocator, 1, sizeof *looks);
    float *pixels = nb_allocate_zero(&scene->allocator, (size_t)SKY_WIDTH * SKY_HEIGHT * 3, sizeof *pixels);
    for (int row = 0; row < SKY_HEIGHT && looks != NULL && pixels != NULL; row++) {
        aim(row, looks);
        look(view, looks);
        for (int i = 0; i < LOOKS; i++)
            for (int c = 0; c < 3; c++)
                pixels[3 * (row * SKY_WIDTH + i % (SKY_WIDTH * WITHIN) / WITHIN) + c] +=
                    (float)(radiance(looks, planet, scene->data.sun_direction, i, c) / (WITHIN * WITHIN));
    }
    const nebel_environment_map_desc desc = {.host = {.allocator = scene->allocator, .log = scene->log},
                                             .width = SKY_WIDTH,
                                             .height = SKY_HEIGHT,
                                             .pixels = pixels};
    if (looks != NULL && pixels != NULL) result = nebel_create_environment_map(&desc, map);
    nb_release(&scene->allocator, looks);
    nb_release(&scene->allocator, pixels);
    return result;
}

/* The sky becomes ambient light where the file has none of its own. */
static nebel_result set_environment(nebel_scene *scene, const nebel_planet *planet, const nebel_sun *sun)
{
    nebel_sky_view *view;
    const nebel_sky_view_desc desc = {
        .atmosphere = planet->atmosphere, .sun = *sun, .host = {scene->allocator, scene->log, scene->parallel}};
    nebel_result result = nebel_create_sky_view(&desc, &view);
    if (result != NEBEL_OK) return result;
    nebel_environment_map *map = NULL;
    result = make_sky_map(scene, planet, view, &map);
    nebel_destroy_sky_view(view);
    if (result != NEBEL_OK) return result;
    nebel_release_environment_map(scene->environment_map);
    scene->environment_map = map;
    scene->data.environment = (nebel_environment){.type = NEBEL_ENVIRONMENT_MAP, .map = map, .intensity = 1};
    return NEBEL_OK;
}

/* What planets but the first leave of the sun at the scene's origin. */
static double uneclipsed(const nebel_scene_data *data, const double to_sun[3])
{
    static const double origin[3] = {0, 0, 0};
    const double sun = 0.5 * data->planets[0].sun_angular_diameter * (PI / 180);
    double left = 1;
    for (size_t i = 1; i < data->planet_count; i++) {
        const nebel_atmosphere_desc *air = &data->planets[i].atmosphere_desc;
        double center[3];
        nb_sphere_center_below(air->ground_point, air->radius, center);
        left *= nb_eclipse_left(origin, center, air->radius, to_sun, sun);
    }
    return left;
}

nebel_result nb_planet_light(nebel_scene *scene)
{
    static const double origin[1][3] = {{0, 0, 0}};
    nebel_planet *planet = scene->planets;
    if (planet == NULL || planet->atmosphere == NULL) return NEBEL_OK;
    const nebel_sun sun = nb_surface_lighting_sun(&scene->data),
                    white = {{sun.direction[0], sun.direction[1], sun.direction[2]}, {1, 1, 1}};
    nebel_irradiance light;
    nebel_result result = nebel_compute_atmosphere_irradiance(planet->atmosphere, &white, 1, origin, 0, &light, 0);
    if (result == NEBEL_OK && !scene->has_ambient) result = set_environment(scene, planet, &sun);
    const double seen = uneclipsed(&scene->data, white.direction);
    for (int c = 0; c < 3 && result == NEBEL_OK; c++) planet->sun_left[c] = seen * light.sun[c];
    return result;
}

static nebel_result set_air(nebel_scene *scene, size_t number)
{
    nebel_planet *planet = &scene->planets[number];
    nebel_atmosphere_desc desc = planet->atmosphere_desc;
    desc.host = (nebel_host){scene->allocator, scene->log, scene->parallel};
    const nebel_result result = nebel_create_atmosphere(&desc, &scene->atmospheres[number]);
    planet->atmosphere = scene->atmospheres[number];
    return result;
}

/* The first planet alone has clouds. */
static nebel_result set_clouds(nebel_scene *scene)
{
    nebel_planet *planet = scene->planets;
    nebel_clouds_desc desc = {.atmosphere = planet->atmosphere,
                              .layer_count = planet->cloud_layer_count,
                              .host = {.allocator = scene->allocator, .log = scene->log}};
    if (planet->cloud_layer_count == 0) return NEBEL_OK;
    memcpy(desc.layers, planet->cloud_layers, sizeof desc.layers);
    const nebel_result result = nebel_create_clouds(&desc, &scene->clouds);
    planet->clouds = scene->clouds;
    return result;
}

static nebel_result shade_origin(const nebel_scene *scene, double frame, float *sun, float *sky)
{
    static const double origin[1][3] = {{0, 0, 0}};
    const nebel_cloud_lighting_desc desc = {.clouds = scene->clouds,
                                            .sun = nb_surface_lighting_sun(&scene->data),
                                            .time = frame,
                                            .host = {.allocator = scene->allocator, .log = scene->log}};
    nebel_cloud_lighting *view;
    nebel_cloud_workspace *workspace = NULL;
    nebel_result result = nebel_create_cloud_lighting(&desc, &view);
    if (result == NEBEL_OK) result = nebel_create_cloud_workspace(view, &workspace);
    if (result == NEBEL_OK)
        result = nebel_compute_cloud_sun_transmittance(workspace, NB_FOG_SHADE_ORIGIN, 1, origin, 0, sun);
    if (result == NEBEL_OK)
        result = nebel_compute_cloud_sky_transmittance(workspace, NB_FOG_SHADE_ORIGIN, 1, origin, 0, sky);
    nebel_destroy_cloud_workspace(workspace);
    nebel_destroy_cloud_lighting(view);
    return result;
}

nebel_result nebel_find_scene_light(const nebel_scene *scene, double frame, nebel_sun *sunlight,
                                    nebel_environment *ambient)
{
    float sun = 1, sky = 1;
    if (scene == NULL || sunlight == NULL || ambient == NULL) return NEBEL_ERROR_ARGUMENT;
    if (!nb_scene_is_frame(scene, frame)) return NEBEL_ERROR_VALUE;
    const nebel_result result = scene->clouds != NULL ? shade_origin(scene, frame, &sun, &sky) : NEBEL_OK;
    if (result != NEBEL_OK) return result;
    *sunlight = nb_surface_lighting_sun(&scene->data);
    *ambient = scene->data.environment;
    for (int c = 0; c < 3 && scene->atmospheres[0] != NULL; c++)
        sunlight->irradiance[c] *= (double)sun * scene->planets->sun_left[c];
    if (!scene->has_ambient) ambient->intensity *= (double)sky;
    return NEBEL_OK;
}

nebel_result nebel_find_scene_sunlight(const nebel_scene *scene, double frame, nebel_sun *sunlight)
{
    nebel_environment ambient;
    return nebel_find_scene_light(scene, frame, sunlight, &ambient);
}

static nebel_result load_layers(nebel_scene *scene)
{
    nebel_textured_planet_desc desc = scene->planets->textured_desc;
    desc.host.allocator = scene->allocator;
    desc.host.log = scene->log;
    if (scene->layers != NULL) return NEBEL_OK;
    const nebel_result result = nebel_create_textured_planet(&desc, &scene->layers);
    scene->planets->textured = scene->layers;
    return result;
}

static void forget_air(nebel_scene *scene)
{
    nebel_destroy_clouds(scene->clouds);
    scene->clouds = NULL;
    scene->planets->clouds = NULL;
    for (size_t i = 0; i < scene->data.planet_count; i++) {
        nebel_destroy_atmosphere(scene->atmospheres[i]);
        scene->atmospheres[i] = NULL;
        scene->planets[i].atmosphere = NULL;
    }
}

/* The light last: where that fails it is what it was. */
static nebel_result load_air(nebel_scene *scene)
{
    nebel_result result = NEBEL_OK;
    for (size_t i = 0; i < scene->data.planet_count && result == NEBEL_OK; i++) result = set_air(scene, i);
    if (result == NEBEL_OK) result = set_clouds(scene);
    if (result == NEBEL_OK) result = nb_planet_light(scene);
    if (result != NEBEL_OK) forget_air(scene);
    return result;
}

nebel_result nebel_load_scene_planets(nebel_scene *scene)
{
    if (scene == NULL) return NEBEL_ERROR_ARGUMENT;
    if (scene->planets != NULL && scene->planets->model == NEBEL_PLANET_TEXTURED) return load_layers(scene);
    if (scene->planets == NULL || scene->planets->atmosphere != NULL) return NEBEL_OK;
    const nebel_result result = load_air(scene);
    if (result == NEBEL_OK) return NEBEL_OK;
    return nb_fail(&scene->log, result, "the air of the scene's planets: %s", nebel_result_text(result));
}

/* ---- other numbers --------------------------------------------------------------------------- */

/* What nebel_load_scene_planets makes, and what it is made of. */
typedef struct nb_made_planets {
    nebel_planet planets[NEBEL_MAX_PLANETS];
    nebel_atmosphere *atmospheres[NEBEL_MAX_PLANETS];
    nebel_clouds *clouds;
    nebel_textured_planet *layers;
} nb_made_planets;

static void keep_made(const nebel_scene *scene, nb_made_planets *kept)
{
    memcpy(kept->planets, scene->planets, scene->data.planet_count * sizeof *kept->planets);
    memcpy(kept->atmospheres, scene->atmospheres, sizeof kept->atmospheres);
    kept->clouds = scene->clouds;
    kept->layers = scene->layers;
}

static void put_made_back(nebel_scene *scene, const nb_made_planets *kept)
{
    memcpy(scene->planets, kept->planets, scene->data.planet_count * sizeof *kept->planets);
    memcpy(scene->atmospheres, kept->atmospheres, sizeof kept->atmospheres);
    scene->clouds = kept->clouds;
    scene->layers = kept->layers;
}

static void destroy_made(const nb_made_planets *kept)
{
    nebel_destroy_clouds(kept->clouds);
    nebel_destroy_textured_planet(kept->layers);
    for (int i = 0; i < NEBEL_MAX_PLANETS; i++) nebel_destroy_atmosphere(kept->atmospheres[i]);
}

/* As if nothing had been made yet. */
static void detach_made(nebel_scene *scene)
{
    for (size_t i = 0; i < scene->data.planet_count; i++) {
        scene->atmospheres[i] = NULL;
        scene->planets[i].atmosphere = NULL;
        scene->planets[i].clouds = NULL;
        scene->planets[i].textured = NULL;
    }
    scene->clouds = NULL;
    scene->layers = NULL;
}

static void take_airs(const nebel_planet *from, nebel_planet *to)
{
    for (uint32_t i = 0; i < to->atmosphere_desc.component_count; i++) {
        const nebel_component_profile profile = to->atmosphere_desc.components[i].profile;
        to->atmosphere_desc.components[i] = from->atmosphere_desc.components[i];
        to->atmosphere_desc.components[i].profile = profile;
    }
    memcpy(to->atmosphere_desc.ground_albedo, from->atmosphere_desc.ground_albedo,
           sizeof to->atmosphere_desc.ground_albedo);
    to->sun_angular_diameter = from->sun_angular_diameter;
}

static void take_clouds(const nebel_planet *from, nebel_planet *to)
{
    for (uint32_t i = 0; i < to->cloud_layer_count; i++) {
        const nebel_cloud_layer own = to->cloud_layers[i];
        nebel_cloud_layer *layer = &to->cloud_layers[i];
        *layer = from->cloud_layers[i];
        layer->type = own.type;
        layer->seed = own.seed;
        layer->weather_map = own.weather_map;
    }
}

static void take_shells(const nebel_textured_planet_desc *from, nebel_textured_planet_desc *to)
{
    to->rotation_period = from->rotation_period;
    to->land_coverage = from->land_coverage;
    to->atmosphere = from->atmosphere;
    for (uint32_t i = 0; i < to->cloud_shell_count; i++) {
        const nebel_cloud_shell own = to->cloud_shells[i];
        nebel_cloud_shell *shell = &to->cloud_shells[i];
        *shell = from->cloud_shells[i];
        shell->coverage_map = own.coverage_map;
        shell->detail_map = own.detail_map;
        shell->seed = own.seed;
    }
}

static bool has_good_sun(const nebel_planet *planet)
{
    return planet->sun_angular_diameter >= 0 && planet->sun_angular_diameter <= 10;
}

nebel_result nebel_update_scene_planets(nebel_scene *scene, const nebel_planet *planets)
{
    if (scene == NULL || planets == NULL || (scene->atmospheres[0] == NULL && scene->layers == NULL))
        return NEBEL_ERROR_ARGUMENT;
    for (size_t i = 0; i < scene->data.planet_count; i++)
        if (!has_good_sun(&planets[i]))
            return nb_fail(&scene->log, NEBEL_ERROR_VALUE,
                           "planet: sun_angular_diameter: must be within 0 and 10 degrees");
    nb_made_planets kept;
    keep_made(scene, &kept);
    detach_made(scene);
    for (size_t i = 0; i < scene->data.planet_count; i++) {
        take_airs(&planets[i], &scene->planets[i]);
        take_clouds(&planets[i], &scene->planets[i]);
        take_shells(&planets[i].textured_desc, &scene->planets[i].textured_desc);
    }
    const nebel_result result = kept.layers != NULL ? load_layers(scene) : load_air(scene);
    if (result == NEBEL_OK)
        destroy_made(&kept);
    else
        put_made_back(scene, &kept);
    if (result == NEBEL_ERROR_MEMORY) return nb_fail(&scene->log, result, "out of memory for the scene's planets");
    return result;
}
