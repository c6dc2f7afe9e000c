/* The scene renderer is made, destroyed and read. */
#include "gl_renderer.h"

#include "fog_context.h"

#include <math.h>

enum { USUAL_SHADOW_SIZE = 2048, LEAST_SHADOW_SIZE = 64, MOST_SHADOW_SIZE = 16384 };

static nebel_result check_renderer(const nebel_scene_data *scene, const nebel_gl_renderer_desc *desc)
{
    const nebel_log *const log = &desc->host.log;
    if (scene == NULL) return nb_fail(log, NEBEL_ERROR_ARGUMENT, "OpenGL renderer: scene is NULL");
    if (!nb_allocator_is_valid(&desc->host.allocator)) {
        return nb_fail(log, NEBEL_ERROR_ARGUMENT, "OpenGL renderer: the allocator needs both functions or neither");
    }
    if (desc->shadow_map_size != 0 &&
        (desc->shadow_map_size < LEAST_SHADOW_SIZE || desc->shadow_map_size > MOST_SHADOW_SIZE)) {
        return nb_fail(log, NEBEL_ERROR_ARGUMENT,
                       "OpenGL renderer: shadow_map_size is %u; %d to %d, or 0, are possible",
                       (unsigned)desc->shadow_map_size, LEAST_SHADOW_SIZE, MOST_SHADOW_SIZE);
    }
    return NEBEL_OK;
}

static nebel_result check_context(const nb_context *context, const nebel_log *log)
{
    if (!context->es || context->version >= 32 || epoxy_has_gl_extension("GL_EXT_color_buffer_float")) return NEBEL_OK;
    return nb_fail(log, NEBEL_ERROR_UNSUPPORTED,
                   "OpenGL ES: the driver (%s) does not draw into textures of floats (GL_EXT_color_buffer_float); use "
                   "OpenGL, a newer driver, or the CPU renderer",
                   (const char *)glGetString(GL_RENDERER));
}

/* A vertex array exists once it was bound. */
static nebel_result make_renderer_objects(nebel_gl_renderer *r)
{
    glGenVertexArrays(1, &r->vertex_array);
    glBindVertexArray(r->vertex_array);
    nebel_result result = nb_scene_programs_make(&r->shading, &r->context, &r->log);
    if (result == NEBEL_OK) result = nb_meshes_make(&r->meshes, &r->context, r->scene);
    return result;
}

static nebel_result make_renderer(nebel_gl_renderer *r)
{
    const nebel_gl_desc desc = {.host = {.allocator = r->allocator, .log = r->log}};
    nb_scene_state state;
    nebel_result result = nebel_create_gl(&desc, &r->eye_fog);
    if (result == NEBEL_OK) result = nebel_create_gl(&desc, &r->sun_fog);
    if (result == NEBEL_OK) result = nebel_create_gl(&desc, &r->sun_cloud);
    if (result != NEBEL_OK) return result;
    r->sun_fog->dims_alone = r->sun_cloud->dims_alone = 1;
    r->eye_fog->lender = r->sun_fog;
    nb_scene_state_enter(&r->context, &state);
    result = make_renderer_objects(r);
    nb_scene_state_leave(&r->context, &state);
    return result;
}

nebel_result nebel_create_gl_renderer(const nebel_scene_data *scene, nebel_lighting *lighting,
                                      const nebel_gl_renderer_desc *desc, nebel_gl_renderer **renderer)
{
    nb_context context;
    if (renderer == NULL) return NEBEL_ERROR_ARGUMENT;
    *renderer = NULL;
    if (desc == NULL) return NEBEL_ERROR_ARGUMENT;
    nebel_result result = check_renderer(scene, desc);
    if (result == NEBEL_OK) result = nb_context_read(&desc->host.log, &context);
    if (result == NEBEL_OK) result = check_context(&context, &desc->host.log);
    if (result != NEBEL_OK) return result;
    const nebel_allocator allocator = nb_resolve_allocator(&desc->host.allocator);
    nebel_gl_renderer *const made = nb_allocate_zero(&allocator, 1, sizeof *made);
    if (made == NULL) return nb_fail(&desc->host.log, NEBEL_ERROR_MEMORY, "OpenGL renderer: out of memory");
    made->allocator = made->meshes.allocator = made->clouds.allocator = allocator;
    made->clouds.parallel = made->air.parallel = desc->host.parallel;
    made->log = made->meshes.log = desc->host.log;
    made->scene = scene;
    made->context = context;
    const uint32_t size = desc->shadow_map_size != 0 ? desc->shadow_map_size : USUAL_SHADOW_SIZE;
    made->shadows.size = made->shafts.maps.size = size < context.widest ? size : context.widest;
    made->shadows.count = NB_CASCADES;
    made->shafts.maps.count = NB_MAX_MAPS;
    made->shafts.maps.leaning = 1;
    made->lights.most_face = size / 4;
    made->fog = nebel_retain_lighting(lighting);
    result = make_renderer(made);
    if (result != NEBEL_OK) {
        nebel_destroy_gl_renderer(made);
        return result;
    }
    *renderer = made;
    return NEBEL_OK;
}

void nebel_destroy_gl_renderer(nebel_gl_renderer *r)
{
    if (r == NULL) return;
    const nebel_log silent = {0};
    const int in_context = r->vertex_array != 0 && nb_context_check(&silent, r->vertex_array) == NEBEL_OK;
    nb_meshes_delete(&r->meshes, in_context);
    if (in_context) {
        nb_scene_programs_delete(&r->shading);
        nb_shadows_delete(&r->shadows);
        nb_shaft_maps_delete(&r->shafts);
        nb_light_maps_delete(&r->lights);
        nb_targets_delete(&r->targets);
        nb_particles_delete(&r->particles);
        nb_environment_delete(&r->environment);
        nb_gl_planets_delete(&r->air);
        nb_gl_textured_delete(&r->shells);
        glDeleteTextures(1, &r->cloud_ends);
        glDeleteTextures(1, &r->cloud_over);
        glDeleteTextures(1, &r->cloud_dimming);
        glDeleteTextures(1, &r->cloud_shade.texture);
        glDeleteVertexArrays(1, &r->vertex_array);
    }
    nebel_destroy_gl(r->eye_fog);
    nebel_destroy_gl(r->sun_fog);
    nebel_destroy_gl(r->sun_cloud);
    nebel_release_lighting(r->cloud);
    nebel_release_lighting(r->environment.of);
    nebel_release_lighting(r->fog);
    nb_gl_daylit_fog_release(&r->daylit);
    nb_release(&r->allocator, r->shading.lights);
    nb_release(&r->allocator, r->shadows.blocks);
    nb_light_maps_release(&r->allocator, &r->lights);
    nb_particles_release(&r->allocator, &r->particles);
    nb_cloud_picture_release(&r->clouds);
    nb_gl_planets_release(&r->air, &r->allocator);
    const nebel_allocator allocator = r->allocator;
    nb_release(&allocator, r);
}

nebel_result nebel_set_gl_renderer_lighting(nebel_gl_renderer *r, nebel_lighting *lighting)
{
    if (r == NULL) return NEBEL_ERROR_ARGUMENT;
    (void)nebel_retain_lighting(lighting);
    nebel_release_lighting(r->fog);
    r->fog = lighting;
    r->has_judged_particles = 0;
    return NEBEL_OK;
}

nebel_result nebel_set_gl_renderer_particles(nebel_gl_renderer *r, const nebel_particle *particles, size_t count)
{
    if (r == NULL) return NEBEL_ERROR_ARGUMENT;
    if (particles == NULL && count > 0) {
        return nb_fail(&r->log, NEBEL_ERROR_ARGUMENT, "nebel_set_gl_renderer_particles: particles is NULL");
    }
    if (count > 0 && r->context.es && !epoxy_has_gl_extension("GL_EXT_float_blend")) {
        return nb_fail(&r->log, NEBEL_ERROR_UNSUPPORTED,
                       "particles: OpenGL ES without GL_EXT_float_blend cannot blend light; use OpenGL");
    }
    r->has_judged_particles = 0;
    const nebel_result result = nb_particles_set(&r->particles, &r->allocator, &r->log, particles, count);
    if (result != NEBEL_OK) return result;
    nebel_release_lighting(r->cloud);
    r->cloud = NULL;
    return result;
}

/* Whether particles should take light of point lights, which reaches surfaces and fog. */
static int dim_lights(const nebel_gl_renderer *r)
{
    static const double any[3] = {0, 1, 0}, low[3] = {-HUGE_VAL, -HUGE_VAL, -HUGE_VAL},
                        high[3] = {HUGE_VAL, HUGE_VAL, HUGE_VAL};
    nebel_bounds lit;
    const int are_lit = r->scene->light_count > 0 || nebel_get_lit_bounds(r->fog, NEBEL_LIGHT_GROUP_LOCAL, &lit);
    return are_lit && nb_particles_shade(&r->particles, any, low, high);
}

static int shade_sunlit_fog(const nebel_gl_renderer *r)
{
    nebel_bounds lit;
    const nebel_sun sun = nebel_get_lighting_sun(r->fog);
    return nebel_get_lit_bounds(r->fog, NEBEL_LIGHT_GROUP_SUN, &lit) &&
           nb_particles_shade(&r->particles, sun.direction, lit.min, lit.max);
}

void nb_renderer_judge_particles(nebel_gl_renderer *r)
{
    if (r->has_judged_particles) return;
    r->has_judged_particles = 1;
    const int lights = dim_lights(r), sun = shade_sunlit_fog(r);
    if (!lights && !sun) return;
    nb_log_message(&r->log, NEBEL_LOG_WARNING, NEBEL_OK,
                   "frame: what is in the shadow of particles is too bright: OpenGL lets them take no light "
                   "%s. The CPU renderer "
                   "(--device cpu) does, and OpenGL where they are volumes among the fog",
                   !lights ? "of the sun from fog"
                   : sun   ? "of lights, nor of the sun from fog"
                           : "of point lights");
}

/* ---- results --------------------------------------------------------------------------------- */

static nebel_result check_frame(const nebel_gl_renderer *r, const char *name)
{
    if (r->has_frame) return NEBEL_OK;
    return nb_fail(&r->log, NEBEL_ERROR_ARGUMENT, "%s: no frame was drawn", name);
}

nebel_result nebel_gl_get_textures(const nebel_gl_renderer *r, nebel_gl_textures *textures)
{
    if (r == NULL || textures == NULL) return NEBEL_ERROR_ARGUMENT;
    const nb_targets *const t = &r->targets;
    *textures = (nebel_gl_textures){.color = t->picture[0],
                                    .transmittance = t->picture[1],
                                    .in_scattering = t->picture[2],
                                    .surface = t->picture[3],
                                    .width = t->width,
                                    .height = t->height};
    return check_frame(r, "nebel_gl_get_textures");
}

static void take_rgb(const nb_targets *t, const float *texels, float *plane)
{
    for (uint32_t y = 0; y < t->height; y++) {
        const float *const row = texels + 4 * (size_t)(t->height - 1 - y) * t->width;
        float *const out = plane + 3 * (size_t)y * t->width;
        for (size_t x = 0; x < t->width; x++) {
            for (size_t c = 0; c < 3; c++) out[3 * x + c] = row[4 * x + c];
        }
    }
}

/* The distance is a sum over the samples that hit, times their share. */
static void divide_depth(const nb_targets *t, const float *colors, const float *surfaces, float *depth)
{
    for (uint32_t y = 0; y < t->height; y++) {
        const size_t row = (size_t)(t->height - 1 - y) * t->width;
        for (size_t x = 0; x < t->width; x++) {
            const float share = colors[4 * (row + x) + 3], distance = surfaces[4 * (row + x) + 3];
            depth[(size_t)y * t->width + x] = share > 0 ? distance / share : HUGE_VALF;
        }
    }
}

static void read_picture(const nb_targets *t, int number, float *texels)
{
    glReadBuffer((GLenum)(GL_COLOR_ATTACHMENT0 + number));
    glReadPixels(0, 0, (GLsizei)t->width, (GLsizei)t->height, GL_RGBA, GL_FLOAT, texels);
}

/* The last component of transmittance is the share of the samples that were drawn, 1 of all of them. */
static int has_drawn(const nb_targets *t)
{
    float texel[4] = {0};
    glBindFramebuffer(GL_READ_FRAMEBUFFER, t->picture_buffer);
    glReadBuffer(GL_COLOR_ATTACHMENT1);
    glReadPixels(0, 0, 1, 1, GL_RGBA, GL_FLOAT, texel);
    return texel[3] > 0;
}

static void read_planes(const nb_targets *t, const nebel_gl_planes *planes, float *texels, float *colors)
{
    float *const rgb[4] = {planes->color, planes->transmittance, planes->in_scattering, planes->normal};
    glBindFramebuffer(GL_READ_FRAMEBUFFER, t->picture_buffer);
    for (int i = 0; i < 4; i++) {
        const int last = i == 3 && planes->depth != NULL;
        if (rgb[i] == NULL && !last) continue;
        read_picture(t, i, texels);
        if (rgb[i] != NULL) take_rgb(t, texels, rgb[i]);
    }
    if (planes->depth == NULL) return;
    read_picture(t, 0, colors);
    divide_depth(t, colors, texels, planes->depth);
}

nebel_result nebel_gl_read_planes(nebel_gl_renderer *r, const nebel_gl_planes *planes)
{
    nb_scene_state state;
    if (r == NULL || planes == NULL) return NEBEL_ERROR_ARGUMENT;
    nebel_result result = check_frame(r, "nebel_gl_read_planes");
    if (result == NEBEL_OK) result = nb_context_check(&r->log, r->vertex_array);
    if (result != NEBEL_OK) return result;
    const size_t size = 4 * (size_t)r->targets.width * r->targets.height;
    float *const texels = nb_allocate(&r->allocator, size, sizeof(float));
    float *const colors = planes->depth != NULL ? nb_allocate(&r->allocator, size, sizeof(float)) : NULL;
    if (texels == NULL || (planes->depth != NULL && colors == NULL)) {
        result = nb_fail(&r->log, NEBEL_ERROR_MEMORY, "nebel_gl_read_planes: out of memory");
    } else {
        nb_scene_state_enter(&r->context, &state);
        read_planes(&r->targets, planes, texels, colors);
        const int is_drawn = has_drawn(&r->targets);
        nb_scene_state_leave(&r->context, &state);
        if (!is_drawn)
            result =
                nb_fail(&r->log, NEBEL_ERROR_UNSUPPORTED,
                        "OpenGL: the driver (%s) draws nothing (is GALLIUM_NOOP set?); use another one, or the CPU "
                        "renderer",
                        (const char *)glGetString(GL_RENDERER));
    }
    nb_release(&r->allocator, texels);
    nb_release(&r->allocator, colors);
    return result;
}
