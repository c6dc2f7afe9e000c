#include "warn_endless_fog.h"

#include "messages.h"

const char nb_endless_advice[] =
    "has no end towards the sun; give it a shape that ends, such as a box, or a density of "
    "type height and a sun above the horizon";

static double dot(const double *a, const double *b)
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static int is_black(const double *color)
{
    return color[0] == 0 && color[1] == 0 && color[2] == 0;
}

/* A half space goes on inwards and level with its face. */
static int has_endless_shape(const nebel_shape *shape, const double *sun)
{
    if (shape->type == NEBEL_SHAPE_HALF_SPACE) return dot(shape->normal, sun) <= 0;
    return shape->type == NEBEL_SHAPE_WORLD;
}

static int has_endless_density(const nebel_density *density, const double *sun)
{
    switch (density->type) {
    case NEBEL_DENSITY_CONSTANT:
    case NEBEL_DENSITY_SOFT_EDGE:
        return 1;
    case NEBEL_DENSITY_HEIGHT:
        return sun[1] <= 0;
    case NEBEL_DENSITY_LINEAR:
        return dot(density->to, sun) > dot(density->from, sun);
    default:
        return 0;
    }
}

static int is_endless(const nebel_volume_desc *volume, const double *sun)
{
    return volume->operation != NEBEL_OPERATION_EXCLUDE && !is_black(volume->extinction) &&
           has_endless_shape(&volume->shape, sun) && has_endless_density(&volume->density, sun);
}

size_t nb_find_endless(const nebel_scene_data *scene)
{
    size_t i = 0;
    if (!scene->has_sun || is_black(scene->sun_irradiance)) return scene->volume_count;
    while (i < scene->volume_count && !is_endless(&scene->volumes[i], scene->sun_direction)) i++;
    return i;
}

int nb_has_ambient(const nebel_scene_data *scene)
{
    const nebel_environment *const environment = &scene->environment;
    if (environment->type == NEBEL_ENVIRONMENT_GRADIENT)
        return !is_black(environment->zenith) || !is_black(environment->horizon) || !is_black(environment->ground);
    return environment->type == NEBEL_ENVIRONMENT_MAP || !is_black(scene->ambient);
}

const char *nb_find_dark_planet(const nebel_scene_data *scene)
{
    if (scene->has_sun && !is_black(scene->sun_irradiance)) return NULL;
    for (size_t i = 0; i < scene->planet_count; i++)
        if (scene->planets[i].model == NEBEL_PLANET_PHYSICAL)
            return "the planet's air is black, as no sun shines on it: give the scene a \"sun\"";
    if (scene->planet_count > 0 && !nb_has_ambient(scene))
        return "the planet is black, as neither sun nor ambient light is on it: give the scene a \"sun\"";
    return NULL;
}

void nb_warn_of_darkness(const nebel_scene_data *scene, const char *path)
{
    const size_t endless = nb_find_endless(scene);
    const char *const dark = nb_find_dark_planet(scene);
    if (dark != NULL) nb_report_message("warning: %s: %s", path, dark);
    if (endless == scene->volume_count) return;
    nb_report_message("warning: %s: no sunlight reaches fog or models: fog[%zu] %s", path, endless, nb_endless_advice);
}
