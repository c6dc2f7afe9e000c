#include "air.h"

#include "words.h"

#include <epoxy/gl.h>
#include <math.h>
#include <nebel/shader.h>
#include <string.h>

static const double pi = 3.14159265358979323846;

const nebel_planet *nb_gl_air_planet(const nebel_scene_data *scene)
{
    return scene->planet_count > 0 && scene->planets[0].atmosphere != NULL ? &scene->planets[0] : NULL;
}

/* ---- the table ------------------------------------------------------------------------------- */

nebel_sun nb_gl_air_sun(const nebel_scene_data *scene)
{
    nebel_sun sun = {.direction = {0, 1, 0}};
    for (int c = 0; c < 3 && scene->has_sun; c++) {
        sun.direction[c] = scene->sun_direction[c];
        sun.irradiance[c] = scene->sun_irradiance[c];
    }
    return sun;
}

static int are_same(const nebel_air_view_desc *a, const nebel_air_view_desc *b)
{
    int same = a->atmosphere == b->atmosphere && a->has_distances == b->has_distances;
    for (int c = 0; c < 3; c++)
        same = same && a->position[c] == b->position[c] && a->sun.direction[c] == b->sun.direction[c] &&
               a->sun.irradiance[c] == b->sun.irradiance[c];
    return same;
}

static nebel_result fill(nb_gl_air *air, const nebel_allocator *allocator, const nebel_log *log,
                         const nb_context *context, const nebel_air_view *view)
{
    size_t count = 0;
    nebel_result result = nebel_pack_air_view(view, NULL, 0, &count);
    if (result != NEBEL_OK) return nb_fail(log, result, "the planet's air: %s", nebel_result_text(result));
    const size_t rows = (count + NEBEL_TEXTURE_WIDTH - 1) / NEBEL_TEXTURE_WIDTH;
    nebel_word *const words = nb_allocate_zero(allocator, rows * NEBEL_TEXTURE_WIDTH, sizeof *words);
    if (words == NULL) return nb_fail(log, NEBEL_ERROR_MEMORY, "OpenGL: out of memory for the planet's air");
    result = nebel_pack_air_view(view, words, count, &count);
    if (result == NEBEL_OK)
        result = nb_words_upload(&air->texture, log, context, words, rows, "the texture of the planet's air", "");
    nb_release(allocator, words);
    return result;
}

nebel_result nb_gl_air_set(nb_gl_air *air, const nebel_allocator *allocator, const nebel_log *log,
                           const nb_context *context, const nebel_scene_data *scene, const double eye[3], int ends)
{
    nebel_air_view_desc desc = {.atmosphere = nb_gl_air_planet(scene)->atmosphere,
                                .sun = nb_gl_air_sun(scene),
                                .position = {eye[0], eye[1], eye[2]},
                                .has_distances = ends,
                                .allocator = *allocator,
                                .log = *log};
    glBindTexture(GL_TEXTURE_2D, air->texture);
    if (are_same(&air->of, &desc)) return NEBEL_OK;
    nb_gl_air_release(air);
    nebel_result result = nebel_create_air_view(&desc, &air->view);
    if (result == NEBEL_ERROR_ARGUMENT)
        result =
            nb_fail(log, NEBEL_ERROR_VALUE, "the planet's air: the camera or the sun is at no place that it knows");
    if (result == NEBEL_OK) result = fill(air, allocator, log, context, air->view);
    if (result == NEBEL_OK) air->of = desc;
    return result;
}

void nb_gl_air_delete(const nb_gl_air *air)
{
    glDeleteTextures(1, &air->texture);
}

void nb_gl_air_release(nb_gl_air *air)
{
    nebel_destroy_air_view(air->view);
    air->view = NULL;
    air->of.atmosphere = NULL;
}

/* ---- the sun --------------------------------------------------------------------------------- */

void nb_gl_air_set_disc(unsigned program, const nebel_scene_data *scene)
{
    const double radius = scene->has_sun ? 0.5 * scene->planets[0].sun_diameter * (pi / 180) : 0;
    float light[3] = {0, 0, 0};
    for (int c = 0; c < 3 && radius > 0; c++) light[c] = (float)(scene->sun_irradiance[c] / (pi * pow(sin(radius), 2)));
    glUniform1f(glGetUniformLocation(program, "disc_radius"), (float)radius);
    glUniform3fv(glGetUniformLocation(program, "disc_light"), 1, light);
}
