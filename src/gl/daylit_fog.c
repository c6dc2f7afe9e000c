#include "daylit_fog.h"

#include "air.h"

#include "base/daylight.h"

#include <nebel/shader.h>

static int changes(const nebel_scene_data *scene, const nebel_snapshot *fog)
{
    double min[3], max[3];
    return nb_gl_air_planet(scene) != NULL && scene->has_sun && nebel_snapshot_scattering_fog(fog, min, max) &&
           !nb_daylight_is_near(&scene->planets[0], min, max);
}

/* Light that was scattered often comes from more places than one. */
static int is_diffuse(const nebel_log *log, const nebel_snapshot *fog)
{
    if ((nebel_pack_features(fog) & NEBEL_FEATURE_DIFFUSION) == 0) return 0;
    (void)nb_fail(log, NEBEL_OK,
                  "warning: frame: all fog has the sun and the sky of the scene's origin, however far it is: OpenGL "
                  "lights fog by its place where light is scattered once. The CPU renderer (--device cpu) does it with "
                  "\"diffusion\", too");
    return 1;
}

static int is_same(const nb_gl_daylit_fog *daylit, const nebel_snapshot *fog, const nebel_sun *sun)
{
    int same = daylit->of == fog;
    for (int c = 0; c < 3; c++)
        same = same && daylit->sun.direction[c] == sun->direction[c] && daylit->sun.irradiance[c] == sun->irradiance[c];
    return same;
}

nebel_result nb_gl_daylit_fog_set(nb_gl_daylit_fog *daylit, const nebel_log *log, const nebel_scene_data *scene,
                                  nebel_snapshot *fog)
{
    const nebel_sun sun = nb_gl_air_sun(scene);
    nebel_result result = NEBEL_OK;
    if (is_same(daylit, fog, &sun)) return NEBEL_OK;
    nb_gl_daylit_fog_release(daylit);
    if (fog == NULL) return NEBEL_OK;
    if (changes(scene, fog) && !is_diffuse(log, fog)) result = nebel_relight(fog, &sun, &daylit->lit);
    if (result != NEBEL_OK)
        return nb_fail(log, result, "frame: fog in the light of its place: %s", nebel_result_text(result));
    daylit->of = nebel_retain_snapshot(fog); /* so that no other can have its address */
    daylit->sun = sun;
    return NEBEL_OK;
}

void nb_gl_daylit_fog_release(nb_gl_daylit_fog *daylit)
{
    nebel_release_snapshot(daylit->of);
    nebel_release_snapshot(daylit->lit);
    *daylit = (nb_gl_daylit_fog){.of = NULL};
}
