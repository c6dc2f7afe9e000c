#include "gl_textured_planet.h"

#include "gl_panorama.h"
#include "scene_programs.h"
#include "textured_planet_text.h"
#include "gl_targets.h"

#include <epoxy/gl.h>
#include <nebel/shader.h>

const nebel_textured_planet *nb_gl_textured_planet(const nebel_scene_data *scene)
{
    return scene->planet_count > 0 ? scene->planets[0].textured : NULL;
}

/* ---- maps ------------------------------------------------------------------------------------ */

/* What nb_shell_sphere_text reads. Columns of the levels behind the first are no more than those of the first, but of maps of
 * few columns. */
static void upload_levels(const nebel_textured_planet *layers, const nebel_planet_map *map, GLenum format,
                          nb_gl_map *out)
{
    nebel_planet_map level;
    GLint x = 0;
    for (out->levels = 0; nebel_get_planet_map_mip(layers, map, (uint32_t)out->levels, &level) == NEBEL_OK;
         out->levels++) {
        glTexSubImage2D(GL_TEXTURE_2D, 0, x, out->levels > 0 ? out->height : 0, (GLsizei)level.width,
                        (GLsizei)level.height, format, GL_FLOAT, level.texels);
        if (out->levels > 0) x += (GLint)level.width;
    }
}

static size_t width_of_all(const nebel_textured_planet *layers, const nebel_planet_map *map)
{
    nebel_planet_map level;
    size_t width = 0;
    for (uint32_t i = 1; nebel_get_planet_map_mip(layers, map, i, &level) == NEBEL_OK; i++) width += level.width;
    return width > map->width ? width : map->width;
}

static nebel_result make_map(const nb_context *context, const nebel_log *log, const nebel_textured_planet *layers,
                             const nebel_planet_map *map, nb_gl_map *out)
{
    if (map->texels == NULL) return NEBEL_OK;
    const size_t width = width_of_all(layers, map), height = map->height + map->height / 2 + 1;
    if (width > context->widest || height > context->widest)
        return nb_fail(log, NEBEL_ERROR_LIMIT,
                       "planet: a map of %zu x %zu texels makes a texture of %zu x %zu; this context has at most %u "
                       "either way (GL_MAX_TEXTURE_SIZE); use a smaller one",
                       map->width, map->height, width, height, (unsigned)context->widest);
    const int grey = map->channels == 1;
    out->name = nb_targets_make_texture((uint32_t)width, (uint32_t)height, grey ? GL_R32F : GL_RGB32F,
                                        grey ? GL_RED : GL_RGB, GL_FLOAT);
    out->width = (int)map->width;
    out->height = (int)map->height;
    const nebel_result result = nb_context_check_memory(log, "a map of the planet; use a smaller one");
    if (result == NEBEL_OK) upload_levels(layers, map, grey ? GL_RED : GL_RGB, out);
    return result;
}

static void delete_shell_maps(nb_gl_shells *shells)
{
    glDeleteTextures(1, &shells->ground.name);
    for (int i = 0; i < NEBEL_MAX_CLOUD_SHELLS; i++) {
        glDeleteTextures(1, &shells->clouds[i].name);
        glDeleteTextures(1, &shells->details[i].name);
        shells->clouds[i] = shells->details[i] = (nb_gl_map){0};
    }
    shells->ground = (nb_gl_map){0};
    shells->of = NULL;
}

static nebel_result make_shell_maps(nb_gl_shells *shells, const nb_context *context, const nebel_log *log,
                                    const nebel_textured_planet *layers)
{
    const nebel_textured_planet_desc *const desc = nebel_get_textured_planet_desc(layers);
    nebel_result result = make_map(context, log, layers, &desc->color_map, &shells->ground);
    for (uint32_t i = 0; i < desc->cloud_shell_count && result == NEBEL_OK; i++) {
        result = make_map(context, log, layers, &desc->cloud_shells[i].coverage_map, &shells->clouds[i]);
        if (result == NEBEL_OK)
            result = make_map(context, log, layers, &desc->cloud_shells[i].detail_map, &shells->details[i]);
    }
    return result;
}

static nebel_result fit_maps(nb_gl_shells *shells, const nb_context *context, const nebel_log *log,
                             const nebel_textured_planet *layers)
{
    if (shells->of == layers) return NEBEL_OK;
    delete_shell_maps(shells);
    const nebel_result result = make_shell_maps(shells, context, log, layers);
    if (result == NEBEL_OK)
        shells->of = layers;
    else
        delete_shell_maps(shells);
    return result;
}

/* ---- targets --------------------------------------------------------------------------------- */

static void delete_targets(nb_gl_shells *shells)
{
    const GLuint textures[] = {shells->place, shells->depth, shells->seen, shells->over};
    const GLuint buffers[] = {shells->shell_buffer, shells->over_buffer};
    glDeleteFramebuffers(2, buffers);
    glDeleteTextures(4, textures);
    shells->place = shells->depth = shells->seen = shells->over = shells->shell_buffer = shells->over_buffer = 0;
    shells->width = shells->height = 0;
}

static nebel_result fit_targets(nb_gl_shells *shells, const nebel_log *log, uint32_t width, uint32_t height)
{
    unsigned *const names[] = {&shells->place, &shells->seen, &shells->depth, &shells->over};
    if (shells->width == width && shells->height == height) return NEBEL_OK;
    delete_targets(shells);
    for (int i = 0; i < 4; i++) *names[i] = nb_targets_make_texture(width, height, GL_RGBA32F, GL_RGBA, GL_FLOAT);
    nebel_result result = nb_context_check_memory(log, "the layers of a planet; ask for fewer pixels");
    const unsigned of_shell[] = {shells->place, shells->seen, shells->depth};
    if (result == NEBEL_OK && !(nb_targets_make_buffer(&shells->shell_buffer, of_shell, 3, 0) &&
                                nb_targets_make_buffer(&shells->over_buffer, &shells->over, 1, 0)))
        result = nb_targets_refuse(log);
    if (result == NEBEL_OK) {
        shells->width = width;
        shells->height = height;
    } else {
        delete_targets(shells);
    }
    return result;
}

/* ---- programs -------------------------------------------------------------------------------- */

static void set_shell_units(unsigned program)
{
    glUseProgram(program);
    glUniform1i(glGetUniformLocation(program, "shell_map"), NB_UNIT_NORMAL);
    glUniform1i(glGetUniformLocation(program, "shell_detail"), NB_UNIT_REFLECTANCE);
    glUniform1i(glGetUniformLocation(program, "scene_place"), NB_UNIT_PLACE);
}

static nebel_result fit_program(const nb_context *context, const nebel_log *log, int panorama, const char *text,
                                unsigned *name)
{
    const char *const version = nb_program_version(context), *const ray = panorama ? nb_panorama_ray_text : nb_ray_text;
    const char *const precision = context->es ? "precision highp float;\nprecision highp int;\n" : "";
    const char *const fog = nebel_get_shader_source(context->es ? NEBEL_DIALECT_GLSL_300_ES : NEBEL_DIALECT_GLSL_330);
    const nb_shader_parts vertex = {{version, nb_whole_vertex_text}, 2};
    const nb_shader_parts fragment = {{version, precision, fog, nb_texel_texture_text, ray, nb_shell_sphere_text, text},
                                      7};
    if (*name != 0) return NEBEL_OK;
    const nebel_result result = nb_program_build(log, &vertex, &fragment, name);
    if (result == NEBEL_OK) set_shell_units(*name);
    return result;
}

nebel_result nb_gl_textured_set(nb_gl_shells *shells, const nb_context *context, const nebel_log *log,
                                const nebel_textured_planet *layers, uint32_t width, uint32_t height, int panorama)
{
    static const char *const texts[NB_SHELL_PROGRAMS] = {[NB_SHELL_GROUND] = nb_shell_ground_text,
                                                         [NB_SHELL_CLOUDS] = nb_shell_clouds_text,
                                                         [NB_SHELL_AIR] = nb_shell_air_text};
    nebel_result result = fit_maps(shells, context, log, layers);
    if (result == NEBEL_OK) result = fit_targets(shells, log, width, height);
    for (int i = 0; i < NB_SHELL_PROGRAMS && result == NEBEL_OK; i++)
        result = fit_program(context, log, panorama, texts[i], &shells->programs[panorama != 0][i]);
    return result;
}

void nb_gl_textured_delete(nb_gl_shells *shells)
{
    delete_shell_maps(shells);
    delete_targets(shells);
    for (int i = 0; i < NB_SHELL_PROGRAMS; i++) {
        glDeleteProgram(shells->programs[0][i]);
        glDeleteProgram(shells->programs[1][i]);
    }
}
