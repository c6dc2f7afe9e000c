#include "gl_planets.h"

#include "texel_texture.h"

#include "frame/surface_lighting.h"

#include <epoxy/gl.h>
#include <math.h>
#include <nebel/shader.h>
#include <string.h>

const nebel_planet *nb_gl_planets_planet(const nebel_scene_data *scene)
{
    return scene->planet_count > 0 && scene->planets[0].atmosphere != NULL ? &scene->planets[0] : NULL;
}

/* ---- the tables ------------------------------------------------------------------------------ */

/* Depths, and behind them skies, of nb_irradiance_table. */
enum {
    DEPTHS = NB_IRRADIANCE_HEIGHTS * NB_IRRADIANCE_SUNS,
    SKIES = NB_IRRADIANCE_OF_COUNT * NB_IRRADIANCE_SKIES,
    DAYLIGHT_WORDS = DEPTHS + SKIES
};

static int is_same_air(const nb_gl_air *air, const nebel_sky_view_desc *desc, const nb_planet *worlds, int count,
                       int is_lit)
{
    const nebel_sky_view_desc *const of = &air->of;
    int same = air->count == count && of->has_ray_ends == desc->has_ray_ends && (air->light[0] >= 0) == is_lit;
    for (int i = 0; i < count; i++) same = same && air->made[i] == worlds[i].planet->atmosphere;
    for (int c = 0; c < 3; c++)
        same = same && of->position[c] == desc->position[c] && of->sun.direction[c] == desc->sun.direction[c] &&
               of->sun.irradiance[c] == desc->sun.irradiance[c];
    return same;
}

static void forget_views(nb_gl_air *air)
{
    for (int i = 0; i < air->count; i++) nebel_destroy_sky_view(air->worlds[i].view);
    air->count = 0;
}

static void forget_daylight(nb_gl_air *air, const nebel_allocator *allocator)
{
    for (int i = 0; i < NEBEL_MAX_PLANETS; i++) {
        nb_release(allocator, air->daylight[i]);
        air->daylight[i] = NULL;
    }
}

static nebel_result make_views(nb_gl_air *air, nebel_sky_view_desc desc, int count)
{
    nebel_result result = NEBEL_OK;
    for (int i = 0; i < count && result == NEBEL_OK; i++) {
        desc.atmosphere = air->made[i] = air->worlds[i].planet->atmosphere;
        result = nebel_create_sky_view(&desc, &air->worlds[i].view);
        if (result == NEBEL_OK) air->count = i + 1;
    }
    if (result != NEBEL_ERROR_ARGUMENT) return result;
    return nb_fail(&desc.host.log, NEBEL_ERROR_VALUE,
                   "the planet's air: the camera or the sun is at no place that it knows");
}

/* It does not depend on the eye. */
static nebel_result find_daylight(nb_gl_air *air, const nebel_allocator *allocator, const nebel_log *log,
                                  const nebel_scene_data *scene, const double to_sun[3], nb_planet *world)
{
    nb_irradiance_table **const kept = &air->daylight[world->planet - scene->planets];
    if (*kept == NULL) *kept = nb_allocate_zero(allocator, 1, sizeof **kept);
    if (*kept == NULL)
        return nb_fail(log, NEBEL_ERROR_MEMORY, "OpenGL: out of memory for the light of models on planets");
    world->daylight = *kept;
    if (world->daylight->atmosphere != world->planet->atmosphere ||
        memcmp(world->daylight->sun.direction, to_sun, sizeof world->daylight->sun.direction) != 0)
        nb_irradiance_set(world->daylight, world->planet, &scene->planets[0], to_sun);
    return NEBEL_OK;
}

static nebel_result set_daylights(nb_gl_air *air, const nebel_allocator *allocator, const nebel_log *log,
                                  const nebel_scene_data *scene)
{
    double to_sun[3] = {scene->sun_direction[0], scene->sun_direction[1], scene->sun_direction[2]};
    nebel_result result = NEBEL_OK;
    (void)nb_vector_make_unit(to_sun); /* the views have found it in order */
    if (air->home != scene->planets[0].atmosphere) forget_daylight(air, allocator);
    air->home = scene->planets[0].atmosphere;
    for (int i = 0; i < air->count && result == NEBEL_OK; i++)
        result = find_daylight(air, allocator, log, scene, to_sun, &air->worlds[i]);
    return result;
}

static nebel_result measure(nb_gl_air *air, size_t *total)
{
    nebel_result result = NEBEL_OK;
    *total = 0;
    for (int i = 0; i < air->count && result == NEBEL_OK; i++) {
        const nb_planet *const world = &air->worlds[i];
        size_t count = 0;
        result = nebel_pack_sky_view(world->view, NULL, 0, &count);
        air->first[i] = (int)*total;
        air->light[i] = world->daylight != NULL ? (int)count : -1;
        *total += count + (world->daylight != NULL ? DAYLIGHT_WORDS : 0);
    }
    return result;
}

static void pack_daylight(const nb_irradiance_table *daylight, nebel_texel_f32 *words)
{
    const float *const depth = daylight->depth[0][0], *const sky = daylight->sky[0][0];
    for (int i = 0; i < DEPTHS; i++)
        words[i] = (nebel_texel_f32){{depth[3 * i], depth[3 * i + 1], depth[3 * i + 2], 0}};
    for (int i = 0; i < SKIES; i++)
        words[DEPTHS + i] = (nebel_texel_f32){{sky[3 * i], sky[3 * i + 1], sky[3 * i + 2], 0}};
}

static nebel_result pack_airs(const nb_gl_air *air, nebel_texel_f32 *words, size_t total)
{
    nebel_result result = NEBEL_OK;
    for (int i = 0; i < air->count && result == NEBEL_OK; i++) {
        nebel_texel_f32 *const own = words + air->first[i];
        size_t count = 0;
        result = nebel_pack_sky_view(air->worlds[i].view, own, total - (size_t)air->first[i], &count);
        if (air->light[i] >= 0) pack_daylight(air->worlds[i].daylight, own + air->light[i]);
    }
    return result;
}

static nebel_result fill_air(nb_gl_air *air, const nebel_allocator *allocator, const nebel_log *log,
                             const nb_context *context)
{
    size_t count = 0;
    nebel_result result = measure(air, &count);
    if (result != NEBEL_OK) return nb_fail(log, result, "the planet's air: %s", nebel_result_text(result));
    const size_t rows = (count + NEBEL_TEXTURE_WIDTH - 1) / NEBEL_TEXTURE_WIDTH;
    nebel_texel_f32 *const words = nb_allocate_zero(allocator, rows * NEBEL_TEXTURE_WIDTH, sizeof *words);
    if (words == NULL) return nb_fail(log, NEBEL_ERROR_MEMORY, "OpenGL: out of memory for the planet's air");
    result = pack_airs(air, words, count);
    if (result == NEBEL_OK)
        result =
            nb_texel_texture_upload(&air->texture, log, context, words, rows, "the texture of the planet's air", "");
    nb_release(allocator, words);
    return result;
}

nebel_result nb_gl_planets_set(nb_gl_air *air, const nebel_allocator *allocator, const nebel_log *log,
                               const nb_context *context, const nebel_scene_data *scene, const double eye[3], int ends,
                               int is_lit)
{
    nb_planet worlds[NEBEL_MAX_PLANETS];
    const int count = nb_planets_set(worlds, scene, eye);
    /* The ground of one planet ends the air of others. */
    const nebel_sky_view_desc desc = {.sun = nb_surface_lighting_sun(scene),
                                      .position = {eye[0], eye[1], eye[2]},
                                      .has_ray_ends = ends || count > 1,
                                      .host = {*allocator, *log, air->parallel}};
    glBindTexture(GL_TEXTURE_2D, air->texture);
    if (is_same_air(air, &desc, worlds, count, is_lit)) return NEBEL_OK;
    forget_views(air);
    memcpy(air->worlds, worlds, (size_t)count * sizeof *worlds);
    nebel_result result = make_views(air, desc, count);
    if (result == NEBEL_OK && is_lit) result = set_daylights(air, allocator, log, scene);
    if (result == NEBEL_OK) result = fill_air(air, allocator, log, context);
    if (result != NEBEL_OK) forget_views(air);
    air->of = desc;
    return result;
}

void nb_gl_planets_delete(const nb_gl_air *air)
{
    glDeleteTextures(1, &air->texture);
}

void nb_gl_planets_release(nb_gl_air *air, const nebel_allocator *allocator)
{
    forget_views(air);
    forget_daylight(air, allocator);
}

/* ---- programs -------------------------------------------------------------------------------- */

/* As the eye sees it: the way up from its centre, the height above the ground. */
static void look_from(const nb_gl_air *air, const nb_planet *world, float eye[4])
{
    double from[3];
    for (int c = 0; c < 3; c++) from[c] = air->of.position[c] - world->center[c];
    eye[3] = (float)(nb_vector_length(from) - world->radius);
    if (!nb_vector_make_unit(from)) from[1] = 1;
    for (int c = 0; c < 3; c++) eye[c] = (float)from[c];
}

void nb_gl_planets_set_list(const nb_gl_air *air, unsigned program)
{
    GLint words[NEBEL_MAX_PLANETS][3];
    GLfloat eyes[NEBEL_MAX_PLANETS][4], sizes[NEBEL_MAX_PLANETS][2], albedos[NEBEL_MAX_PLANETS][3];
    for (int i = 0; i < air->count; i++) {
        const nebel_atmosphere_desc *const desc = &air->worlds[i].planet->atmosphere_desc;
        words[i][0] = air->first[i];
        words[i][1] = air->light[i];
        words[i][2] = desc->component_count > 0;
        look_from(air, &air->worlds[i], eyes[i]);
        sizes[i][0] = (float)desc->radius;
        sizes[i][1] = (float)desc->thickness;
        for (int c = 0; c < 3; c++) albedos[i][c] = (float)desc->ground_albedo[c];
    }
    glUniform3iv(glGetUniformLocation(program, "world_words"), air->count, words[0]);
    glUniform4fv(glGetUniformLocation(program, "world_eyes"), air->count, eyes[0]);
    glUniform2fv(glGetUniformLocation(program, "world_sizes"), air->count, sizes[0]);
    glUniform3fv(glGetUniformLocation(program, "world_albedos"), air->count, albedos[0]);
}

void nb_gl_planets_set_light(const nb_gl_air *air, unsigned program, const nebel_scene_data *scene)
{
    const double radius = nb_planets_disc(scene);
    double bright[3];
    float light[3];
    nb_planets_disc_light(scene, radius, bright);
    for (int c = 0; c < 3; c++) light[c] = (float)bright[c];
    nb_gl_planets_set_list(air, program);
    glUniform1f(glGetUniformLocation(program, "disc_radius"), (float)radius);
    glUniform3fv(glGetUniformLocation(program, "disc_light"), 1, light);
    glUniform1i(glGetUniformLocation(program, "sky_is_ambient"), nb_surface_lighting_owns_ambient(scene));
}

void nb_gl_planets_set_reach(const nb_gl_air *air, unsigned program)
{
    glUniform1f(glGetUniformLocation(program, "daylight_reach"),
                (float)nb_planets_reach(air->worlds, air->count, air->of.position));
}

void nb_gl_planets_set_irradiance(const nb_gl_air *air, unsigned program, const nebel_scene_data *scene,
                                  float even_shade)
{
    double to_sun[3] = {scene->sun_direction[0], scene->sun_direction[1], scene->sun_direction[2]};
    (void)nb_vector_make_unit(to_sun);
    nb_gl_planets_set_light(air, program, scene);
    glUniform3f(glGetUniformLocation(program, "scene_sun"), (float)to_sun[0], (float)to_sun[1], (float)to_sun[2]);
    nb_gl_planets_set_reach(air, program);
    glUniform1f(glGetUniformLocation(program, "even_shade"), even_shade);
}
