#include "info_scene.h"

#include "warn_atmosphere.h"
#include "warn_endless_fog.h"
#include "load_scene.h"
#include "messages.h"

#include <math.h>
#include <stdio.h>

static const char *const shape_names[NEBEL_SHAPE_COUNT] = {"world",     "half_space", "box",         "sphere",
                                                           "ellipsoid", "cylinder",   "capsule",     "cone",
                                                           "convex",    "union",      "intersection"};
static const char *const density_names[NEBEL_DENSITY_COUNT] = {"constant", "height",    "linear", "radial",
                                                               "gaussian", "soft_edge", "grid",   "altitude"};

enum { X, Y, Z };

static const double degrees = 57.295779513082320877;

/* ---- what it holds --------------------------------------------------------------------------- */

static void print_triple(const char *before, const double *v)
{
    (void)printf("%s%g %g %g", before, v[X], v[Y], v[Z]);
}

static void print_camera(const nebel_scene_data *scene)
{
    const nebel_camera *const camera = &scene->camera;
    (void)printf("camera:");
    print_triple(" at ", camera->position);
    print_triple(", towards ", camera->look_at);
    switch (camera->projection) {
    case NEBEL_PROJECTION_PERSPECTIVE:
        (void)printf(", perspective, vertical field of view %g degrees\n", camera->vertical_fov);
        break;
    case NEBEL_PROJECTION_ORTHOGRAPHIC:
        (void)printf(", orthographic, view height %g m\n", camera->view_height);
        break;
    case NEBEL_PROJECTION_PANORAMA:
        (void)printf(", panorama\n");
        break;
    }
    if (scene->turntable_frames > 0) {
        (void)printf("motion: once around in %u frames\n", (unsigned)scene->turntable_frames);
    } else if (scene->camera_key_count > 0) {
        (void)printf("motion: %zu keys, frames %g to %g\n", scene->camera_key_count, scene->camera_keys[0].frame,
                     scene->camera_keys[scene->camera_key_count - 1].frame);
    }
}

static void print_ambient(const nebel_scene_data *scene)
{
    const nebel_environment *const environment = &scene->environment;
    switch (environment->type) {
    case NEBEL_ENVIRONMENT_GRADIENT:
        print_triple("ambient: gradient, zenith ", environment->zenith);
        print_triple(", horizon ", environment->horizon);
        print_triple(", ground ", environment->ground);
        break;
    case NEBEL_ENVIRONMENT_MAP:
        if (scene->environment_path == NULL) {
            (void)printf("ambient: the sky of the planet");
            break;
        }
        (void)printf("ambient: environment %s, rotation %.4g degrees, intensity %.4g", scene->environment_path,
                     environment->rotation, environment->intensity);
        break;
    default:
        print_triple("ambient: ", scene->ambient);
    }
}

static void print_clouds(const nebel_planet *planet)
{
    for (uint32_t i = 0; i < planet->cloud_layer_count; i++) {
        static const char *const kinds[] = {"cumulus", "stratus", "cirrus"};
        nebel_cloud_layer layer;
        if (nebel_resolve_cloud_layer(planet->atmosphere_desc.thickness, &planet->cloud_layers[i], NULL, &layer) !=
            NEBEL_OK)
            return;
        (void)printf("clouds: %s, %.6g to %.6g m, %.3g of the planet\n", kinds[layer.type], layer.base, layer.top,
                     layer.coverage);
    }
}

/* Straight up from the ground. */
static void print_depth(const nebel_planet *planet)
{
    double depth[3];
    nb_find_air_depth(planet, depth);
    (void)printf("air: optical depth straight up from the ground");
    for (int c = 0; c < 3; c++)
        (void)printf(depth[c] <= NB_MAX_DEPTH ? " %.3g" : " more than %g", fmin(depth[c], NB_MAX_DEPTH));
    (void)printf("\n");
    const char *const deep = nb_find_deep_air(depth);
    if (deep != NULL) (void)printf("warning: %s\n", deep);
}

static void print_planet(const nebel_planet *planet)
{
    const nebel_atmosphere_desc *air = &planet->atmosphere_desc;
    if (planet->model == NEBEL_PLANET_TEXTURED)
        (void)printf("planet: radius %.6g m, %u %s of clouds\n", planet->textured_desc.radius,
                     (unsigned)planet->textured_desc.cloud_shell_count,
                     planet->textured_desc.cloud_shell_count == 1 ? "shell" : "shells");
    else if (nb_has_air(planet))
        (void)printf("planet: radius %.6g m, %.6g m of air of %u %s\n", air->radius, air->thickness,
                     (unsigned)air->component_count, air->component_count == 1 ? "kind" : "kinds");
    else
        (void)printf("planet: radius %.6g m, no air\n", air->radius);
    if (planet->atmosphere != NULL && nb_has_air(planet)) print_depth(planet);
    print_clouds(planet);
}

static void print_light(const nebel_scene_data *scene)
{
    if (scene->has_sun) {
        print_triple("sun: irradiance ", scene->sun_irradiance);
        (void)printf(", %.3g degrees above the horizon\n", asin(fmin(fmax(scene->sun_direction[Y], -1), 1)) * degrees);
        if (scene->sun_key_count > 0)
            (void)printf("sun: %zu keys, frames %g to %g\n", scene->sun_key_count, scene->sun_keys[0].frame,
                         scene->sun_keys[scene->sun_key_count - 1].frame);
    }
    if (scene->light_count > 0) (void)printf("lights: %zu\n", scene->light_count);
    print_ambient(scene);
    if (scene->shows_ambient)
        (void)printf("\nbackground: ambient");
    else
        print_triple("\nbackground: ", scene->background);
    (void)printf("\n");
}

typedef struct box {
    double min[3], max[3];
} box;

static void grow_box(box *bounds, const nebel_mesh *mesh)
{
    for (uint32_t v = 0; v < mesh->vertex_count; v++) {
        for (int axis = X; axis <= Z; axis++) {
            const double at = mesh->origin[axis] + (double)mesh->positions[3 * (size_t)v + (size_t)axis];
            bounds->min[axis] = fmin(bounds->min[axis], at);
            bounds->max[axis] = fmax(bounds->max[axis], at);
        }
    }
}

static void print_models(const nebel_scene_data *scene)
{
    const double far = (double)INFINITY;
    box bounds = {{far, far, far}, {-far, -far, -far}};
    size_t triangles = 0, vertices = 0;
    for (size_t i = 0; i < scene->mesh_count; i++) {
        triangles += scene->meshes[i].triangle_count;
        vertices += scene->meshes[i].vertex_count;
        grow_box(&bounds, &scene->meshes[i]);
    }
    (void)printf("models: %zu meshes, %zu triangles, %zu vertices, %zu textures\n", scene->mesh_count, triangles,
                 vertices, scene->texture_count);
    if (vertices == 0) return;
    print_triple("bounds: ", bounds.min);
    print_triple(" to ", bounds.max);
    (void)printf(" (m)\n");
}

/* How many volumes have each shape and density. */
typedef struct nb_scene_counts {
    size_t counts[NEBEL_SHAPE_COUNT][NEBEL_DENSITY_COUNT];
    size_t excluded[NEBEL_SHAPE_COUNT];
} nb_scene_counts;

static nb_scene_counts count_volumes(const nebel_scene_data *scene)
{
    nb_scene_counts all = {0};
    for (size_t i = 0; i < scene->volume_count; i++) {
        const nebel_volume_desc *const volume = &scene->volumes[i];
        if (volume->operation == NEBEL_OPERATION_EXCLUDE) {
            all.excluded[volume->shape.type]++;
        } else {
            all.counts[volume->shape.type][volume->density.type]++;
        }
    }
    return all;
}

static void print_volumes(const nebel_scene_data *scene)
{
    const nb_scene_counts all = count_volumes(scene);
    (void)printf("fog: %zu volume%s\n", scene->volume_count, scene->volume_count == 1 ? "" : "s");
    for (int s = 0; s < NEBEL_SHAPE_COUNT; s++) {
        for (int d = 0; d < NEBEL_DENSITY_COUNT; d++) {
            if (all.counts[s][d] > 0)
                (void)printf("  %zu x %s, %s\n", all.counts[s][d], shape_names[s], density_names[d]);
        }
        if (all.excluded[s] > 0) (void)printf("  %zu x %s, excluded\n", all.excluded[s], shape_names[s]);
    }
}

static void print_nebulae(const nebel_scene_data *scene)
{
    for (size_t i = 0; i < scene->nebula_count; i++) {
        const nebel_nebula_desc *const nebula = &scene->nebulae[i];
        (void)printf("nebula: %zu particles ", nebula->count);
        if (nebula->points != NULL)
            (void)printf("at the vertices of a model\n");
        else
            (void)printf("in a shape of type %s\n", shape_names[nebula->shape.type]);
    }
}

static void print_cells(const nebel_cells_desc *cells)
{
    if (cells == NULL) return;
    size_t fogged = 0;
    for (size_t i = 0; i < cells->cell_count; i++) fogged += cells->cells[i].density > 0;
    (void)printf("cells: %zu, %zu of them with fog, ", cells->cell_count, fogged);
    if (cells->portals != NULL)
        (void)printf("%zu portal%s\n", cells->portal_count, cells->portal_count == 1 ? "" : "s");
    else
        (void)printf("portals wherever they touch\n");
}

/* The part of the light of the green channel that is left. */
#define VISIBLE 0.05

/* What fog and the air of all planets leave up to a distance. */
static double left_at(const nebel_scene_data *scene, const nebel_snapshot *fog, nebel_ray ray, double distance)
{
    nebel_transfer transfer;
    ray.t_max = distance;
    double left = nebel_trace(fog, NULL, 1, &ray, 0, &transfer, 0) == NEBEL_OK ? transfer.transmittance[1] : 0;
    for (size_t i = 0; i < scene->planet_count; i++)
        if (scene->planets[i].atmosphere != NULL &&
            nebel_trace_atmosphere(scene->planets[i].atmosphere, NULL, 1, &ray, 0, &transfer, 0) == NEBEL_OK)
            left *= transfer.transmittance[1];
    return left;
}

/* Nearer than where fog alone leaves as much. It falls all the way, so that halves of the way are told apart, by their logarithms. */
static double visibility_in_air(const nebel_scene_data *scene, const nebel_snapshot *fog, const nebel_ray *ray,
                                double by_fog)
{
    double near = fmin(1e-6, by_fog), far = fmin(1e12, by_fog);
    if (left_at(scene, fog, *ray, far) > VISIBLE) return by_fog;
    for (int i = 0; i < 60; i++) {
        const double middle = sqrt(near * far);
        *(left_at(scene, fog, *ray, middle) > VISIBLE ? &near : &far) = middle;
    }
    return far;
}

/* Where so much is left straight ahead: the meteorological range in uniform fog. NaN: unknown. */
static double visibility_of(const nebel_scene_data *scene, const nebel_snapshot *fog)
{
    const nebel_camera *const camera = &scene->camera;
    nebel_ray ray = {.t_max = (double)INFINITY};
    for (int axis = X; axis <= Z; axis++) {
        ray.origin[axis] = camera->position[axis];
        ray.direction[axis] = camera->look_at[axis] - camera->position[axis];
    }
    double distance;
    const nebel_result result = nebel_invert_transmittance(fog, VISIBLE, 1, 1, &ray, sizeof ray, &distance);
    if (result != NEBEL_OK) return (double)NAN;
    return scene->planet_count > 0 ? visibility_in_air(scene, fog, &ray, distance) : distance;
}

static void print_visibility(double visibility)
{
    if (isinf(visibility)) {
        (void)printf("visibility: no end, straight ahead from the camera (5 %% of green light left)\n");
    } else if (!isnan(visibility)) {
        (void)printf("visibility: %.4g m, straight ahead from the camera (5 %% of green light left)\n", visibility);
    }
}

/* ---- what looks like a mistake --------------------------------------------------------------- */

static int is_black(const double *color)
{
    return color[0] == 0 && color[1] == 0 && color[2] == 0;
}

static int is_lit(const nebel_scene_data *scene)
{
    return (scene->has_sun && !is_black(scene->sun_irradiance)) || nb_has_ambient(scene) || scene->light_count > 0;
}

static const char *find_mistake(const nebel_scene_data *scene, const nebel_volume_desc *volume)
{
    if (volume->operation == NEBEL_OPERATION_EXCLUDE) return NULL;
    const int glows = !is_black(volume->emission);
    if (is_black(volume->extinction) && !glows) return "has no extinction and no emission: it cannot be seen";
    const int scatters = !is_black(volume->albedo);
    if (scatters && !is_lit(scene)) return "scatters light, but there is none: it only absorbs";
    if (!scatters && !glows && is_black(volume->source)) {
        return "has neither source nor albedo nor emission: it only absorbs";
    }
    return NULL;
}

/* The start of a warning that is about volume i. */
static void name_volume(const char *warning, const nebel_scene_data *scene, size_t i)
{
    char name[256];
    (void)snprintf(name, sizeof name, "%s", scene->volume_names[i]);
    nb_report_mask(name);
    (void)printf("warning: %sfog[%zu]%s%s%s", warning, i, name[0] != '\0' ? " '" : "", name,
                 name[0] != '\0' ? "'" : "");
}

static void warn_of_volumes(const nebel_scene_data *scene)
{
    for (size_t i = 0; i < scene->volume_count; i++) {
        const char *const mistake = find_mistake(scene, &scene->volumes[i]);
        if (mistake == NULL) continue;
        name_volume("", scene, i);
        (void)printf(" %s\n", mistake);
    }
}

static void warn_of_darkness(const nebel_scene_data *scene)
{
    const size_t endless = nb_find_endless(scene);
    if (endless == scene->volume_count) return;
    name_volume("no sunlight reaches fog or models: ", scene, endless);
    (void)printf(" %s\n", nb_endless_advice);
}

/* Less than a metre is none: level scenes stand on the ground. */
static void warn_of_ground(const nebel_scene_data *scene)
{
    for (size_t i = 0; i < scene->planet_count; i++) {
        const nebel_planet *planet = &scene->planets[i];
        const int is_layers = planet->model == NEBEL_PLANET_TEXTURED;
        const double radius = is_layers ? planet->textured_desc.radius : planet->atmosphere_desc.radius;
        double square = 0;
        for (int c = 0; c < 3; c++) {
            const double middle = is_layers ? planet->textured_desc.center[c]
                                            : planet->atmosphere_desc.ground_point[c] - (c == 1 ? radius : 0);
            square += pow(scene->camera.position[c] - middle, 2);
        }
        if (radius - sqrt(square) >= 1)
            (void)printf(
                "warning: the camera is %.6g m below the ground of a planet: it sees what is seen from on it\n",
                radius - sqrt(square));
    }
}

static void warn_of_scene(const nebel_scene_data *scene, double visibility)
{
    size_t volumes = 0;
    for (size_t i = 0; i < scene->volume_count; i++) volumes += scene->volumes[i].operation != NEBEL_OPERATION_EXCLUDE;
    if (volumes == 0 && scene->nebula_count == 0 && scene->cells == NULL && scene->planet_count == 0)
        (void)printf("warning: there is no fog\n");
    if (visibility < 1) (void)printf("warning: the camera is in dense fog: one sees less than 1 m\n");
    warn_of_ground(scene);
    const char *const dark = nb_find_dark_planet(scene);
    if (dark != NULL) (void)printf("warning: %s\n", dark);
    if (scene->mesh_count > 0 && !is_lit(scene))
        (void)printf("warning: no sun, no lights and no ambient light: the models are black\n");
}

int nb_info_print_scene(const char *path)
{
    nb_report_listener listener = {0};
    nb_load_result loaded;
    if (nb_load_scene(path, 1, 0, &listener, &loaded) != NB_DONE) return NB_FAILED;
    const nebel_scene_data *const scene = nebel_get_scene_data(loaded.scene);
    const double visibility = visibility_of(scene, loaded.fog);
    (void)printf("scene: %s\n", path);
    print_camera(scene);
    for (size_t i = 0; i < scene->planet_count; i++) print_planet(&scene->planets[i]);
    print_light(scene);
    print_models(scene);
    print_volumes(scene);
    print_nebulae(scene);
    print_cells(scene->cells);
    print_visibility(visibility);
    warn_of_volumes(scene);
    warn_of_darkness(scene);
    warn_of_scene(scene, visibility);
    nb_load_free(&loaded);
    return NB_DONE;
}
