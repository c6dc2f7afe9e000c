#include "gl_fog_irradiance.h"

#include "gl_planets.h"

#include "frame/surface_lighting.h"
#include "aerial/planets.h"

#include <nebel/shader.h>

/* Of the light of fog by its place. */
typedef struct irradiance_changes {
    int by_air;
    nb_cloud_shadow_extent roof;
} irradiance_changes;

static nebel_result find_changes(const nebel_scene_data *scene, nebel_cloud_workspace *clouds,
                                 const nebel_lighting *fog, irradiance_changes *found)
{
    nebel_bounds bounds;
    const nebel_snapshot *snapshot = nebel_get_lighting_snapshot(fog);
    *found = (irradiance_changes){.by_air = 0};
    if (fog == NULL || nb_gl_planets_planet(scene) == NULL || !scene->has_sun) return NEBEL_OK;
    found->by_air = nebel_get_scattering_bounds(snapshot, NEBEL_BOUNDS_WITHOUT_LEVEL_FOG, &bounds) &&
                    !nb_irradiance_is_near(&scene->planets[0], scene->sun_direction, bounds.min, bounds.max);
    if (clouds == NULL || nebel_get_volume_count(snapshot) == 0) return NEBEL_OK;
    return nb_cloud_shadow_extent_set(clouds, snapshot, nb_surface_lighting_owns_ambient(scene), &found->roof);
}

/* Light that was scattered often comes from more places than one. */
static int is_diffuse(const nebel_log *log, const nebel_lighting *fog)
{
    if ((nebel_pack_features(fog) & NEBEL_FEATURE_DIFFUSION) == 0) return 0;
    nb_log_message(log, NEBEL_LOG_WARNING, NEBEL_OK,
                   "frame: all fog has the sun and the sky of the scene's origin, however far it is and whatever "
                   "clouds are over it: OpenGL lights fog by its place where light is scattered once. The CPU renderer "
                   "(--device cpu) does it with \"diffusion\", too");
    return 1;
}

/* What is left at the origin of it, but for clouds. */
static nebel_sun dim(const nebel_scene_data *scene, nebel_sun sun)
{
    static const double origin[3] = {0, 0, 0};
    nb_planet worlds[NEBEL_MAX_PLANETS] = {{.planet = &scene->planets[0]}};
    double to_sun[3] = {sun.direction[0], sun.direction[1], sun.direction[2]};
    (void)nb_vector_make_unit(to_sun);
    const int count = nb_planets_set(worlds, scene, origin);
    const nebel_irradiance light = nb_planets_light(worlds, count, origin, to_sun, nb_planets_disc(scene));
    for (int c = 0; c < 3; c++) sun.irradiance[c] *= light.sun[c];
    return sun;
}

static int is_same_fog(const nb_gl_daylit_fog *daylit, const nebel_lighting *fog, const nebel_sun *sun,
                       const irradiance_changes *found)
{
    int same = daylit->of == fog && daylit->by_air == found->by_air && daylit->roof.is_shaded == found->roof.is_shaded;
    for (int c = 0; c < 3; c++)
        same = same && daylit->sun.direction[c] == sun->direction[c] && daylit->sun.irradiance[c] == sun->irradiance[c];
    return same;
}

static nebel_result relight(nb_gl_daylit_fog *daylit, const nebel_log *log, const nebel_scene_data *scene,
                            const irradiance_changes *found, nebel_lighting *fog)
{
    nebel_result result = NEBEL_OK;
    nb_gl_daylit_fog_release(daylit);
    if (fog == NULL) return NEBEL_OK;
    const nebel_sun above = nb_surface_lighting_sun(scene);
    if ((found->by_air || found->roof.is_shaded) && !is_diffuse(log, fog)) {
        const nebel_light *lights;
        const size_t light_count = nebel_get_lighting_lights(fog, &lights);
        const nebel_lighting_desc desc = {.sun = found->by_air ? above : dim(scene, above),
                                          .environment = nebel_get_lighting_environment(fog),
                                          .light_count = light_count,
                                          .lights = lights,
                                          .previous = fog};
        result = nebel_create_lighting(nebel_get_lighting_snapshot(fog), &desc, &daylit->lit);
    }
    if (result != NEBEL_OK)
        return nb_fail(log, result, "frame: fog in the light of its place: %s", nebel_result_text(result));
    daylit->of = nebel_retain_lighting(fog); /* so that no other can have its address */
    daylit->sun = above;
    return NEBEL_OK;
}

nebel_result nb_gl_daylit_fog_set(nb_gl_daylit_fog *daylit, const nebel_log *log, const nebel_scene_data *scene,
                                  nebel_cloud_workspace *clouds, nebel_lighting *fog)
{
    const nebel_sun sun = nb_surface_lighting_sun(scene);
    irradiance_changes found;
    nebel_result result = find_changes(scene, clouds, fog, &found);
    if (result == NEBEL_OK && !is_same_fog(daylit, fog, &sun, &found))
        result = relight(daylit, log, scene, &found, fog);
    daylit->by_air = found.by_air;
    daylit->roof = found.roof;
    return result;
}

void nb_gl_daylit_fog_release(nb_gl_daylit_fog *daylit)
{
    nebel_release_lighting(daylit->of);
    nebel_release_lighting(daylit->lit);
    *daylit = (nb_gl_daylit_fog){.of = NULL};
}
