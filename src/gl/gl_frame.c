/* A frame of the scene renderer. Sample after sample, each through other places of the pixels: surfaces with their
 * properties; once, shadow maps around what the first sample sees; the fog up to the surfaces; the light of all that.
 */
#include "triangle_instances.h"
#include "gl_frame.h"
#include "frame_check.h"
#include "fog_context.h"
#include "gl_panorama.h"
#include "gl_pixel_fog.h"
#include "gl_vertex_fog.h"

#include <math.h>

/* ---- what is drawn ---------------------------------------------------------------------------- */

static nebel_result set_method(nb_gl_frame *f)
{
    const nebel_result result = nb_method_set(&f->method, f->desc);
    if (result == NEBEL_OK) return result;
    return nb_fail(&f->renderer->log, result, "frame: what this method needs is missing or not valid");
}

/* Whether models shade fog: that of the pass, or before particles. */
static int find_shafts(nb_gl_frame *f)
{
    const nebel_sun sun = nebel_get_lighting_sun(f->fog);
    memcpy(f->sunlit.direction, sun.direction, sizeof f->sunlit.direction);
    return f->casts && !f->method.replaces_fog &&
           nebel_get_lit_bounds(f->fog, NEBEL_LIGHT_GROUP_SUN, &f->sunlit.bounds);
}

static int is_fog_shaded(const nebel_gl_renderer *r)
{
    return r->daylit.lit != NULL && r->daylit.roof.is_shaded;
}

static nebel_result set_fog(nb_gl_frame *f)
{
    nebel_gl_renderer *const r = f->renderer;
    nebel_cloud_workspace *clouds = NULL;
    nebel_result result = f->clouds != NULL ? nb_gl_frame_set_clouds(f, &clouds) : NEBEL_OK;
    if (result == NEBEL_OK) result = nb_gl_daylit_fog_set(&r->daylit, &r->log, r->scene, clouds, r->fog);
    f->fog = r->daylit.lit != NULL ? r->daylit.lit : r->fog;
    f->even_shade = 1;
    r->cloud_shade.clear_sky = is_fog_shaded(r) ? r->daylit.roof.clear_sky : 0;
    return result;
}

/* Planets end nowhere near. */
static double reach_of(const nb_gl_frame *f)
{
    const nb_meshes *const meshes = &f->renderer->meshes;
    double farthest = 0;
    if (f->planet != NULL || f->layers != NULL) return 1;
    for (int i = 0; i < 3; i++)
        farthest = fmax(farthest, fmax(fabs(meshes->low[i] - f->eye[i]), fabs(meshes->high[i] - f->eye[i])));
    return farthest > 0 && farthest < 1 ? farthest : 1;
}

/* The nearest surface that is seen, of a perspective view: planes of it may cut off nothing that is seen. */
static void set_near_plane(nb_gl_frame *f)
{
    const nb_meshes *const meshes = &f->renderer->meshes;
    double *const near = &f->view.clip_from_eye[14]; /* twice its distance, and less than 0 */
    *near *= f->reach;
    for (size_t i = 0; i < meshes->count; i++) {
        const double distance = nb_meshes_distance(&meshes->list[i], f->eye);
        if (distance > 0) *near = fmax(*near, -distance);
    }
}

static nebel_result set_frame(nb_gl_frame *f)
{
    const nebel_gl_renderer *const r = f->renderer;
    const nebel_gl_frame_desc *const desc = f->desc;
    f->samples = desc->samples != 0 ? desc->samples : 4;
    nebel_result result = nb_gl_frame_check(r, desc, f->samples);
    if (result == NEBEL_OK) result = set_method(f);
    if (result == NEBEL_OK) result = nb_surface_lighting_set(&f->light, r->scene, &r->log);
    if (result == NEBEL_OK) result = nb_camera_look(&desc->camera, desc->width, desc->height, &r->log, &f->view);
    if (result != NEBEL_OK) return result;
    f->panorama = desc->camera.projection == NEBEL_PROJECTION_PANORAMA;
    for (int i = 0; i < 3; i++) f->eye[i] = desc->camera.position[i];
    f->casts = f->light.has_sun && r->meshes.count > 0 && r->meshes.low[0] <= r->meshes.high[0];
    f->planet = nb_gl_planets_planet(r->scene);
    f->layers = nb_gl_textured_planet(r->scene);
    f->clouds = f->planet != NULL ? f->planet->clouds : NULL;
    f->reach = reach_of(f);
    if (f->desc->camera.projection == NEBEL_PROJECTION_PERSPECTIVE) set_near_plane(f);
    result = set_fog(f);
    f->shafts = find_shafts(f);
    return result;
}

/* ---- surfaces -------------------------------------------------------------------------------- */

void nb_gl_frame_set_vector(unsigned program, const char *name, const float v[3])
{
    glUniform3fv(glGetUniformLocation(program, name), 1, v);
}

void nb_gl_frame_set_rays(const nb_gl_frame *f, unsigned program)
{
    float rays[6][3];
    for (int i = 0; i < 6; i++) {
        for (int k = 0; k < 3; k++) rays[i][k] = f->rays.texels[i].v[k];
    }
    glUniform3fv(glGetUniformLocation(program, "scene_rays"), 6, rays[0]);
}

/* From positions relative to the eye. Parallel rays have no room for the digits of where they begin: nothing is clipped
 * there, and fragments behind the eye are given up. */
static void set_clip(const nb_gl_frame *f, unsigned program)
{
    const double *const clip = f->sample_view.clip_from_eye, *const eye = f->sample_view.eye_from_world;
    float matrix[16];
    for (int column = 0; column < 4; column++) {
        for (int row = 0; row < 4; row++) {
            double sum = column == 3 ? clip[12 + row] : 0;
            for (int k = 0; k < 3 && column < 3; k++) sum += clip[4 * k + row] * eye[4 * column + k];
            matrix[4 * column + row] = (float)sum;
        }
    }
    for (int column = 0; column < 4 && clip[15] != 0; column++) matrix[4 * column + 2] = 0;
    glUniformMatrix4fv(glGetUniformLocation(program, "scene_clip"), 1, GL_FALSE, matrix);
    glUniform1f(glGetUniformLocation(program, "scene_reach"), (float)f->reach);
}

void nb_gl_frame_bind_texture(GLuint unit, GLenum target, unsigned texture)
{
    glActiveTexture(GL_TEXTURE0 + unit);
    glBindTexture(target, texture);
    glBindSampler(unit, 0);
}

static void draw_meshes(const nb_gl_frame *f, unsigned program)
{
    const nb_meshes *const meshes = &f->renderer->meshes;
    const GLint offset = glGetUniformLocation(program, "scene_offset"),
                color = glGetUniformLocation(program, "scene_color"),
                has_texture = glGetUniformLocation(program, "scene_has_texture"),
                cutoff = glGetUniformLocation(program, "scene_cutoff");
    for (size_t i = 0; i < meshes->count; i++) {
        const nb_mesh *const mesh = &meshes->list[i];
        float from_eye[3];
        nb_camera_subtract(mesh->origin, f->eye, from_eye);
        glUniform3fv(offset, 1, from_eye);
        glUniform3fv(color, 1, mesh->base_color);
        glUniform1i(has_texture, mesh->texture != 0);
        nb_gl_frame_bind_texture(NB_UNIT_REFLECTANCE, GL_TEXTURE_2D, mesh->texture);
        nb_meshes_bind_mask(mesh, cutoff);
        if (f->panorama) {
            nb_triangle_instances_draw(mesh, NB_PANORAMA_STRIP);
        } else {
            glBindVertexArray(mesh->vertex_array);
            glDrawElements(GL_TRIANGLES, mesh->index_count, GL_UNSIGNED_INT, NULL);
        }
    }
}

/* Behind nearer surfaces. */
static void draw_ground(const nb_gl_frame *f)
{
    const nb_scene_programs *const shading = &f->renderer->shading;
    const unsigned program = f->panorama ? shading->round_ground : shading->ground;
    glUseProgram(program);
    nb_gl_frame_set_rays(f, program);
    nb_gl_planets_set_list(&f->renderer->air, program);
    glBindVertexArray(f->renderer->vertex_array);
    glDrawArrays(GL_TRIANGLES, 0, 3);
}

static void draw_surfaces(const nb_gl_frame *f)
{
    static const GLfloat zeros[4] = {0, 0, 0, 0};
    const nebel_gl_renderer *const r = f->renderer;
    const unsigned program = f->panorama ? r->shading.round_surface : r->shading.surface;
    glBindFramebuffer(GL_DRAW_FRAMEBUFFER, r->targets.surface_buffer);
    nb_state_clear(&r->context, 0, 0, r->targets.width, r->targets.height);
    glClearBufferfv(GL_COLOR, 0, zeros); /* the distance; no other is read where that is 0 */
    glClearBufferfv(GL_DEPTH, 0, zeros);
    glEnable(GL_DEPTH_TEST);
    glDepthFunc(GL_GREATER);
    glUseProgram(program);
    nb_gl_frame_set_rays(f, program);
    set_clip(f, program);
    nb_gl_frame_set_vector(program, "scene_sun", f->light.sun);
    draw_meshes(f, program);
    if (f->planet != NULL) draw_ground(f);
    if (f->layers != NULL) nb_gl_frame_draw_shell_ground(f);
}

static int has_lights(const nb_gl_frame *f)
{
    return f->renderer->scene->light_count > 0 && (f->renderer->meshes.count > 0 || f->planet != NULL);
}

/* ---- fog ------------------------------------------------------------------------------------- */

/* Transmittance 1 and no light. */
static void clear_fog(void)
{
    static const GLfloat dark[4] = {0, 0, 0, 1}, clear[4] = {1, 1, 1, 1};
    glClearBufferfv(GL_COLOR, 0, dark);
    glClearBufferfv(GL_COLOR, 1, clear);
}

static nebel_result set_eye_fog(const nb_gl_frame *f)
{
    const nebel_gl_renderer *const r = f->renderer;
    return f->panorama ? nb_gl_set_fog_around(r->eye_fog, f->fog, f->eye, f->view.width, f->view.height)
                       : nebel_gl_set_fog(r->eye_fog, f->fog, &f->view);
}

static void set_factor_numbers(const nb_gl_frame *f, unsigned program)
{
    float color[3];
    for (int i = 0; i < 3; i++) color[i] = (float)f->method.factor.color[i];
    glUniform1i(glGetUniformLocation(program, "factor_mode"), (GLint)f->method.factor.mode);
    glUniform3f(glGetUniformLocation(program, "factor_range"), (float)f->method.factor.start,
                (float)f->method.factor.end, (float)f->method.factor.density);
    nb_gl_frame_set_vector(program, "factor_color", color);
}

/* Table fog of an orthographic camera goes by device depth. */
static void set_device_depth(const nb_gl_frame *f, unsigned program)
{
    const nb_device_planes *const planes = &f->method.planes;
    const int is_device = f->method.kind == NEBEL_GL_METHOD_D3D9 && f->view.clip_from_eye[15] != 0 && !f->panorama;
    glUniform2f(glGetUniformLocation(program, "device_depth"), is_device ? (float)planes->near : 0,
                is_device ? (float)(1 / (planes->far - planes->near)) : 0);
}

/* The fog that vertices bring. */
static void draw_vertex_fog(const nb_gl_frame *f)
{
    const nebel_gl_renderer *const r = f->renderer;
    const unsigned program = f->panorama ? r->shading.round_vertex_fog : r->shading.vertex_fog;
    clear_fog();
    glUseProgram(program);
    nb_gl_frame_set_rays(f, program);
    set_clip(f, program);
    glUniform1f(glGetUniformLocation(program, "scene_weakening"), f->desc->method != NEBEL_GL_METHOD_ADDITIVE);
    glUniform1i(glGetUniformLocation(program, "factor_mode"), -1);
    if (nb_method_is_by_user(&f->method) && f->method.factor.stage == NEBEL_STAGE_PIXEL) set_factor_numbers(f, program);
    nb_gl_frame_bind_texture(NB_UNIT_PLACE, GL_TEXTURE_2D, r->targets.place);
    draw_meshes(f, program);
}

/* Distance is depth where rays do not part. */
static void set_axis(const nb_gl_frame *f, unsigned program)
{
    const double *const eye = f->view.eye_from_world;
    const int parallel = f->view.clip_from_eye[15] != 0;
    const int has_axis = !f->panorama && (parallel || f->method.factor.coordinate == NEBEL_COORDINATE_PLANE);
    float axis[3];
    for (int i = 0; i < 3; i++) axis[i] = has_axis ? (float)-eye[4 * i + 2] : 0;
    nb_gl_frame_set_vector(program, "scene_axis", axis);
}

static nebel_result draw_factor(const nb_gl_frame *f)
{
    nebel_gl_renderer *const r = f->renderer;
    const nebel_result result = nb_scene_programs_make_factor(&r->shading, &r->context, &r->log, f->panorama);
    if (result != NEBEL_OK) return result;
    const unsigned program = f->panorama ? r->shading.round_factor : r->shading.factor;
    clear_fog();
    glUseProgram(program);
    nb_gl_frame_set_rays(f, program);
    set_axis(f, program);
    set_factor_numbers(f, program);
    set_device_depth(f, program);
    nb_gl_frame_bind_texture(NB_UNIT_PLACE, GL_TEXTURE_2D, r->targets.place);
    glBindVertexArray(r->vertex_array);
    glDrawArrays(GL_TRIANGLES, 0, 3);
    return NEBEL_OK;
}

static void set_lights(const nb_gl_frame *f, unsigned program)
{
    const nb_light_maps *const lights = &f->renderer->lights;
    nb_gl_frame_bind_texture(NB_UNIT_LIGHTS, GL_TEXTURE_2D, lights->words);
    nb_gl_frame_bind_texture(NB_UNIT_LIGHT_MAPS, GL_TEXTURE_2D_ARRAY, lights->maps);
    glUniform1i(glGetUniformLocation(program, "light_count"), (GLint)f->renderer->scene->light_count);
    glUniform1f(glGetUniformLocation(program, "map_face"), (float)lights->face);
    glUniform1f(glGetUniformLocation(program, "map_share"), 1 - 2.f * NB_LIGHT_BORDER / (float)lights->face);
}

/* In the programs of passes, too. */
static void set_light_shade(const void *of, unsigned program)
{
    glUniform1i(glGetUniformLocation(program, "scene_lights"), NB_UNIT_LIGHTS);
    glUniform1i(glGetUniformLocation(program, "light_maps"), NB_UNIT_LIGHT_MAPS);
    set_lights(of, program);
}

/* From the surfaces' distances. */
static nebel_result draw_exact_fog(const nb_gl_frame *f)
{
    const nebel_gl_renderer *const r = f->renderer;
    const nebel_gl_pass pass = {
        .output = NEBEL_GL_OUTPUT_SPLIT, .depth_texture = f->place, .depth = {.encoding = NEBEL_DEPTH_ENCODING_RADIAL}};
    nb_fog_pass_input picture = {.rays = f->rays,
                                 .width = f->view.width,
                                 .height = f->view.height,
                                 .panorama = f->panorama,
                                 .air = f->planet != NULL ? &r->air : NULL,
                                 .daylight = r->daylit.lit != NULL && r->daylit.by_air ? r->scene : NULL,
                                 .even_shade = f->even_shade,
                                 .cloud_shade = f->clouds != NULL ? &r->cloud_shade : NULL,
                                 .is_turned = f->clouds != NULL && f->place == r->cloud_ends,
                                 .shafts = f->shafts ? &r->shafts : NULL};
    nebel_bounds lit;
    if (has_lights(f) && nebel_get_lit_bounds(r->fog, NEBEL_LIGHT_GROUP_LOCAL, &lit))
        picture.shade = (nb_gl_visibility){{nb_light_map_text, nb_light_shade_text}, set_light_shade, f};
    if (!f->panorama && nebel_compute_view_rays(&f->sample_view, &pass.depth, &picture.rays) != NEBEL_OK)
        return NEBEL_ERROR_ARGUMENT;
    return nb_gl_draw_fog(r->eye_fog, &pass, &picture);
}

/* Or air. Cells and factors have no need of the renderer's fog. */
int nb_gl_frame_has_fog(const nb_gl_frame *f)
{
    return f->renderer->fog != NULL || f->planet != NULL || nb_method_takes_cells(f->desc->method) ||
           f->method.replaces_fog;
}

/* A wall may hide a vertex whose triangle is seen beside it. */
static nb_vertex_source find_source(const nb_gl_frame *f)
{
    const nebel_gl_method method = f->desc->method;
    nb_vertex_source source = {.fog = f->renderer->fog,
                               .cells = nb_method_takes_cells(method) ? f->desc->cells : NULL,
                               .factor = f->method.has_factor ? &f->method.factor : NULL,
                               .d3d9 = f->method.kind == NEBEL_GL_METHOD_D3D9 ? &f->method.d3d9 : NULL,
                               .look = &f->method.look,
                               .blends_stored = f->method.blends_stored,
                               .format = nb_method_format(&f->method),
                               .view = {.ignore_walls = method != NEBEL_GL_METHOD_CELLS_PIXEL},
                               .projection = f->desc->camera.projection};
    for (int i = 0; i < 3; i++) {
        source.view.eye[i] = f->eye[i];
        source.view.forward[i] = -f->view.eye_from_world[4 * i + 2];
    }
    return source;
}

static nebel_result draw_pixel_fog(const nb_gl_frame *f)
{
    const nebel_gl_renderer *const r = f->renderer;
    const nb_vertex_source source = find_source(f);
    return nb_pixel_fog_set(&r->targets, &r->allocator, &r->log, &f->rays, &source);
}

int nb_gl_frame_has_particles(const nb_gl_frame *f)
{
    return f->renderer->particles.count > 0 && !f->method.replaces_fog;
}

/* Particles ask for the renderer's fog before them whatever is on surfaces, and point lights for that before surfaces.
 * */
nebel_result nb_gl_frame_draw_fog(const nb_gl_frame *f)
{
    const nebel_gl_renderer *const r = f->renderer;
    if (!nb_gl_frame_has_fog(f)) return NEBEL_OK;
    glBindFramebuffer(GL_DRAW_FRAMEBUFFER, r->targets.fog_buffer);
    nb_state_clear(&r->context, 0, 0, r->targets.width, r->targets.height);
    nebel_result result = NEBEL_OK;
    if (nb_method_is_by_vertex(&f->method))
        draw_vertex_fog(f);
    else if (f->method.has_factor)
        result = draw_factor(f);
    else if (nb_method_takes_cells(f->desc->method))
        result = draw_pixel_fog(f);
    const int is_exact =
        !nb_method_is_by_vertex(&f->method) && !f->method.replaces_fog && !nb_method_takes_cells(f->desc->method);
    const int is_asked = is_exact || nb_gl_frame_has_particles(f) || (has_lights(f) && !f->method.replaces_fog);
    if (result == NEBEL_OK && (r->fog != NULL || f->planet != NULL) && is_asked) result = set_eye_fog(f);
    if (result == NEBEL_OK && nb_gl_frame_has_particles(f) && r->eye_fog->overlaps_much)
        nb_gl_warn_of_turns(r->eye_fog, "particles ask in one pass for what is before them");
    return result == NEBEL_OK && is_exact ? draw_exact_fog(f) : result;
}

/* ---- particles ------------------------------------------------------------------------------- */

nebel_depth_taps nebel_gl_default_taps(void)
{
    return (nebel_depth_taps){
        .offset = .0005, .background_depth = 100000, .edge_threshold = .5, .depth_margin = .125, .brightness = 1};
}

static void set_taps(const nb_gl_frame *f, unsigned program)
{
    const double *const eye = f->view.eye_from_world;
    const nebel_depth_taps taps = f->desc->taps != NULL ? *f->desc->taps : nebel_gl_default_taps();
    glUniform3f(glGetUniformLocation(program, "scene_axis"), (float)-eye[2], (float)-eye[6], (float)-eye[10]);
    glUniform4f(glGetUniformLocation(program, "scene_taps"), (float)taps.offset, (float)taps.background_depth,
                (float)taps.edge_threshold, (float)taps.depth_margin);
    glUniform1f(glGetUniformLocation(program, "scene_brightness"), (float)taps.brightness);
}

static void set_face_tiles(const nb_gl_frame *f, const nebel_gl_fog_resources *fog, unsigned program)
{
    const nebel_gl *const gl = f->renderer->eye_fog;
    glUniform3i(glGetUniformLocation(program, "face_tiling"), (GLint)gl->views[0].width, NB_GL_TILE_SHIFT,
                (GLint)fog->tile_columns);
    glUniform1iv(glGetUniformLocation(program, "face_first"), 6, gl->face_first);
}

static void bind_media(const nebel_gl_fog_resources *fog)
{
    if (fog->texture != 0) nb_gl_frame_bind_texture(NB_UNIT_FOG, GL_TEXTURE_2D, fog->texture);
    if (fog->block != 0) glBindBufferBase(GL_UNIFORM_BUFFER, 0, fog->block);
    if (fog->environment != 0) nb_gl_frame_bind_texture(NB_UNIT_ENVIRONMENT, GL_TEXTURE_2D, fog->environment);
    if (fog->voxels != 0) nb_gl_frame_bind_texture(NB_UNIT_VOXELS, GL_TEXTURE_2D, fog->voxels);
    if (fog->diffusion != 0) nb_gl_frame_bind_texture(NB_UNIT_NODES, GL_TEXTURE_2D, fog->diffusion);
}

static void set_particles(const nb_gl_frame *f, const nebel_gl_fog_resources *fog, unsigned program)
{
    const int parallel = f->view.clip_from_eye[15] != 0;
    const double *const eye = f->view.eye_from_world;
    glUseProgram(program);
    nb_gl_frame_set_rays(f, program);
    set_clip(f, program);
    glUniform3f(glGetUniformLocation(program, "scene_forward"), parallel ? (float)-eye[2] : 0,
                parallel ? (float)-eye[6] : 0, parallel ? (float)-eye[10] : 0);
    glUniform2f(glGetUniformLocation(program, "scene_size"), (float)f->desc->width, (float)f->desc->height);
    const int five_taps = f->desc->method == NEBEL_GL_METHOD_FIVE_TAP;
    if (five_taps) set_taps(f, program);
    nb_gl_frame_bind_texture(NB_UNIT_PLACE, GL_TEXTURE_2D, five_taps ? f->place : f->depth);
    bind_media(fog);
    if (fog->tiles == 0) return;
    nb_gl_frame_bind_texture(NB_UNIT_TILES, GL_TEXTURE_2D, fog->tiles);
    if (f->panorama) {
        set_face_tiles(f, fog, program);
    } else {
        glUniform2i(glGetUniformLocation(program, "tile_grid"), (GLint)fog->tile_size, (GLint)fog->tile_columns);
    }
}

nebel_result nb_gl_frame_find_light(const nb_gl_frame *f, const nebel_gl *passes, nb_composite_key kind,
                                    nebel_gl_fog_resources *fog, unsigned *program)
{
    nebel_gl_renderer *const r = f->renderer;
    *fog = (nebel_gl_fog_resources){0};
    const nebel_result result = passes != NULL ? nebel_gl_get_fog_resources(passes, fog) : NEBEL_OK;
    if (result != NEBEL_OK) return result;
    kind.panorama = f->panorama;
    kind.has_surfaces = r->meshes.count > 0 || f->planet != NULL || f->layers != NULL;
    kind.has_fog = passes != NULL;
    kind.in_texture = fog->texture != 0;
    kind.tiled = fog->tiles != 0 && !kind.air; /* ground reaches beyond all lists along the sun's light */
    const uint32_t lights = NEBEL_FEATURE_LIGHTS | NEBEL_FEATURE_DIFFUSION | NEBEL_FEATURE_ENVIRONMENT;
    kind.features = kind.of_particles ? fog->features : fog->features & ~lights;
    return nb_scene_programs_find_light(&r->shading, &r->context, &r->allocator, &r->log, &kind, program);
}

int nb_gl_frame_count_veil_layers(const nb_gl_frame *f)
{
    return !nb_gl_frame_has_particles(f) ? 0 : f->renderer->particles.is_grey ? 1 : 3;
}

/* Whatever comes to the farthest particle, and what it adds, passes through each. */
nebel_result nb_gl_frame_draw_particles(const nb_gl_frame *f)
{
    static const GLfloat clear[2][4] = {{0, 0, 0, 1}, {0, 1, 0, 0}};
    nebel_gl_renderer *const r = f->renderer;
    nebel_gl_fog_resources fog;
    unsigned program = 0;
    const int layers = nb_gl_frame_count_veil_layers(f);
    if (layers == 0) return NEBEL_OK;
    nb_renderer_judge_particles(r);
    const int has_fog = r->fog != NULL && nb_gl_count_volumes(r->fog) > 0;
    const nb_composite_key kind = {.of_particles = r->particles.profiles,
                                   .five_taps = f->desc->method == NEBEL_GL_METHOD_FIVE_TAP,
                                   .veil_layers = layers,
                                   .shafts = has_fog && f->shafts};
    const nebel_result result = nb_gl_frame_find_light(f, has_fog ? r->eye_fog : NULL, kind, &fog, &program);
    if (result != NEBEL_OK) return result;
    glBindFramebuffer(GL_DRAW_FRAMEBUFFER, r->targets.veil_buffer);
    nb_state_clear(&r->context, 0, 0, r->targets.width, r->targets.height);
    for (int i = 0; i < layers; i++) glClearBufferfv(GL_COLOR, i, clear[layers == 3]);
    nb_state_layer(&r->context, layers);
    set_particles(f, &fog, program);
    if (kind.shafts) nb_shaft_maps_set(&r->shafts, program);
    nb_particles_draw(&r->particles, f->panorama ? NB_PANORAMA_STRIP : 4);
    return NEBEL_OK;
}

/* ---- point lights ----------------------------------------------------------------------------------- */

/* Of the whole frame. */
static nebel_result prepare_lights(const nb_gl_frame *f)
{
    nebel_gl_renderer *const r = f->renderer;
    if (!has_lights(f)) return NEBEL_OK;
    glActiveTexture(GL_TEXTURE0 + NB_UNIT_LIGHTS);
    nebel_result result = nb_light_maps_set(&r->lights, &r->allocator, &r->log, r->scene, r->fog, f->eye);
    if (result == NEBEL_OK) result = nb_scene_programs_make_light_map(&r->shading, &r->context, &r->log);
    if (result == NEBEL_OK)
        result = nb_light_maps_draw(&r->lights, &r->context, &r->log, r->shading.light_map, &r->meshes);
    glActiveTexture(GL_TEXTURE0);
    return result;
}

/* ---- light ----------------------------------------------------------------------------------- */

static void bind_fog(const nb_gl_frame *f, const nebel_gl_fog_resources *fog, unsigned program)
{
    bind_media(fog);
    if (fog->tiles != 0 && f->casts && f->planet == NULL) nb_gl_frame_set_tiles(f, fog, program);
}

/* What comes through the particles of the sun's light to each surface. */
static nebel_result draw_dimming(const nb_gl_frame *f)
{
    nebel_gl_renderer *const r = f->renderer;
    nebel_gl_fog_resources fog;
    unsigned program = 0;
    if (!f->dims) return NEBEL_OK;
    const nebel_result result =
        nb_gl_frame_find_light(f, r->sun_cloud, (nb_composite_key){.of_dimming = 1}, &fog, &program);
    if (result != NEBEL_OK) return result;
    glBindFramebuffer(GL_DRAW_FRAMEBUFFER, r->targets.dimming_buffer);
    nb_state_clear(&r->context, 0, 0, r->targets.width, r->targets.height);
    glUseProgram(program);
    nb_gl_frame_set_rays(f, program);
    nb_gl_frame_set_vector(program, "scene_sun", f->light.sun);
    glUniformMatrix3fv(glGetUniformLocation(program, "scene_light"), 1, GL_FALSE, r->shadows.light);
    nb_gl_frame_bind_texture(NB_UNIT_PLACE, GL_TEXTURE_2D, r->targets.place);
    bind_fog(f, &fog, program);
    glBindVertexArray(r->vertex_array);
    glDrawArrays(GL_TRIANGLES, 0, 3);
    return NEBEL_OK;
}

/* Of the whole frame. */
static nebel_result prepare_air(const nb_gl_frame *f)
{
    nebel_gl_renderer *const r = f->renderer;
    const int is_lit = r->scene->has_sun && (r->scene->mesh_count > 0 || r->daylit.by_air);
    const int ends = r->meshes.count > 0 || f->clouds != NULL || (r->fog != NULL && nb_gl_count_volumes(r->fog) > 0);
    if (f->planet == NULL) return NEBEL_OK;
    glActiveTexture(GL_TEXTURE0 + NB_UNIT_AIR);
    nebel_result result =
        nb_gl_planets_set(&r->air, &r->allocator, &r->log, &r->context, r->scene, f->eye, ends, is_lit);
    glActiveTexture(GL_TEXTURE0);
    return result == NEBEL_OK
               ? nb_scene_programs_make_ground(&r->shading, &r->context, &r->log, f->panorama, r->air.count)
               : result;
}

static int has_environment(const nb_gl_frame *f)
{
    return f->light.environment.type != NEBEL_ENVIRONMENT_CONSTANT;
}

/* Of the whole frame. */
static nebel_result prepare_environment(const nb_gl_frame *f)
{
    nebel_gl_renderer *const r = f->renderer;
    if (!has_environment(f)) return NEBEL_OK;
    glActiveTexture(GL_TEXTURE0 + NB_UNIT_ENVIRONMENT);
    const nebel_result result =
        nb_environment_show(&r->environment, &r->allocator, &r->log, &r->context, &f->light.environment);
    glActiveTexture(GL_TEXTURE0);
    return result;
}

static void set_light_uniforms(const nb_gl_frame *f, const nebel_gl_fog_resources *fog, unsigned program)
{
    const nebel_gl_renderer *const r = f->renderer;
    const nb_targets *const t = &r->targets;
    glUseProgram(program);
    nb_gl_frame_set_rays(f, program);
    nb_gl_frame_set_vector(program, "scene_background", f->light.background);
    nb_gl_frame_set_vector(program, "scene_ambient", f->light.ambient);
    nb_gl_frame_set_vector(program, "scene_sun", f->light.sun);
    nb_gl_frame_set_vector(program, "scene_sunlight", f->light.sunlight);
    if (f->planet != NULL) nb_gl_planets_set_light(&r->air, program, r->scene);
    glUniform1f(glGetUniformLocation(program, "scene_share"), 1 / (float)f->samples);
    glUniform1f(glGetUniformLocation(program, "scene_ahead"), (float)f->ahead);
    glUniform1i(glGetUniformLocation(program, "scene_is_stored"), f->method.blends_stored);
    if (f->casts) nb_gl_frame_set_shadows(f, program);
    if (has_lights(f)) set_lights(f, program);
    nb_gl_frame_bind_texture(NB_UNIT_PLACE, GL_TEXTURE_2D, t->place);
    nb_gl_frame_bind_texture(NB_UNIT_NORMAL, GL_TEXTURE_2D, t->normal);
    nb_gl_frame_bind_texture(NB_UNIT_REFLECTANCE, GL_TEXTURE_2D, t->reflectance);
    nb_gl_frame_bind_texture(NB_UNIT_IN_SCATTERING, GL_TEXTURE_2D, t->in_scattering);
    nb_gl_frame_bind_texture(NB_UNIT_TRANSMITTANCE, GL_TEXTURE_2D, t->transmittance);
    if (f->dims) nb_gl_frame_bind_texture(NB_UNIT_DIMMING, GL_TEXTURE_2D, t->dimming);
    if (nb_gl_frame_has_particles(f)) nb_gl_frame_bind_texture(NB_UNIT_VEIL, GL_TEXTURE_2D_ARRAY, t->veil);
    bind_fog(f, fog, program);
    if (f->layers != NULL) nb_gl_frame_set_shells(f, program);
    if (f->clouds != NULL) nb_gl_frame_bind_clouds(f);
    glUniform1i(glGetUniformLocation(program, "scene_shows_ambient"), f->light.shows_ambient);
    if (has_environment(f)) nb_gl_frame_bind_texture(NB_UNIT_ENVIRONMENT, GL_TEXTURE_2D, r->environment.name);
}

/* The first sample replaces what was there. */
static void start_picture(const nb_gl_frame *f, uint32_t sample)
{
    const nebel_gl_renderer *const r = f->renderer;
    glBindFramebuffer(GL_DRAW_FRAMEBUFFER, r->targets.picture_buffer);
    nb_state_clear(&r->context, 0, 0, r->targets.width, r->targets.height);
    if (sample > 0) nb_state_add(&r->context);
}

static nebel_result draw_light(const nb_gl_frame *f, uint32_t sample)
{
    nebel_gl_renderer *const r = f->renderer;
    nebel_gl_fog_resources fog;
    unsigned program = 0;
    const int is_lit = f->casts || has_lights(f) || f->planet != NULL, dims = r->fog != NULL && !f->method.replaces_fog,
              along_sun = f->casts && f->planet == NULL;
    const nebel_gl *const passes = !is_lit || !dims ? NULL : along_sun ? r->sun_fog : r->eye_fog;
    const nb_composite_key kind = {.sunlit = f->casts,
                                   .air = f->planet != NULL ? r->air.count : 0,
                                   .shells = f->layers != NULL,
                                   .lights = has_lights(f),
                                   .dimmed = f->dims || f->clouds != NULL,
                                   .clouds = f->clouds != NULL,
                                   .in_fog = nb_gl_frame_has_fog(f),
                                   .environment = has_environment(f),
                                   .veil_layers = nb_gl_frame_count_veil_layers(f)};
    const nebel_result result = nb_gl_frame_find_light(f, passes, kind, &fog, &program);
    if (result != NEBEL_OK) return result;
    start_picture(f, sample);
    set_light_uniforms(f, &fog, program);
    glBindVertexArray(r->vertex_array);
    glDrawArrays(GL_TRIANGLES, 0, 3);
    return NEBEL_OK;
}

/* ---- the frame ------------------------------------------------------------------------------- */

static nebel_result set_sample(nb_gl_frame *f, nb_pixel_position point)
{
    f->point = point;
    if (f->panorama) {
        nb_panorama_rays(&f->view, f->eye, point, &f->rays);
        return NEBEL_OK;
    }
    f->sample_view = nb_camera_move(&f->view, point);
    if (nebel_compute_view_rays(&f->sample_view, NULL, &f->rays) == NEBEL_OK) return NEBEL_OK;
    return nb_fail(&f->renderer->log, NEBEL_ERROR_VALUE,
                   "camera: it is too far out, or its view too narrow, for numbers");
}

/* Fog among them is found along the rays that they are found along. */
static nebel_result trace_clouds(nb_gl_frame *f)
{
    const nb_pixel_position point = f->point;
    nebel_result result = set_sample(f, nb_pixel_sample(0, 1));
    if (result == NEBEL_OK) result = nb_gl_frame_trace_clouds(f);
    return result == NEBEL_OK ? set_sample(f, point) : result;
}

static nebel_result draw_sample(nb_gl_frame *f, uint32_t sample)
{
    nebel_result result = set_sample(f, nb_pixel_sample(sample, f->samples));
    if (result != NEBEL_OK) return result;
    draw_surfaces(f);
    if (sample == 0 && f->casts) result = nb_gl_frame_prepare_sun(f);
    if (result == NEBEL_OK && f->layers != NULL) result = nb_gl_frame_draw_shells(f);
    if (result == NEBEL_OK && sample == 0 && f->clouds != NULL) result = trace_clouds(f);
    f->place = f->renderer->targets.place;
    f->depth = f->renderer->targets.depth;
    if (result == NEBEL_OK) result = nb_gl_frame_draw_fog(f);
    if (result == NEBEL_OK && f->clouds != NULL) result = nb_gl_frame_end_clouds(f);
    if (result == NEBEL_OK) result = nb_gl_frame_draw_particles(f);
    if (result == NEBEL_OK) result = draw_dimming(f);
    return result == NEBEL_OK ? draw_light(f, sample) : result;
}

nebel_result nb_gl_frame_ask(const nb_gl_frame *f)
{
    const nebel_gl_frame_desc *const desc = f->desc;
    if (desc->progress == NULL || desc->progress(f->done, f->samples, desc->progress_user) == 0) return NEBEL_OK;
    return nb_fail(&f->renderer->log, NEBEL_ERROR_CANCELLED, "frame: stopped");
}

/* Waits for the sample first, so that progress is that of the work. */
static nebel_result report(nb_gl_frame *f)
{
    if (f->desc->progress != NULL) glFinish();
    f->done++;
    return nb_gl_frame_ask(f);
}

static nebel_result prepare_particles(const nb_gl_frame *f)
{
    nebel_gl_renderer *const r = f->renderer;
    const double *const eye = f->view.eye_from_world, forward[3] = {-eye[2], -eye[6], -eye[10]};
    const int parallel = f->view.clip_from_eye[15] != 0;
    glActiveTexture(GL_TEXTURE0 + NB_UNIT_VEIL);
    const nebel_result result = nb_targets_fit_veil(&r->targets, &r->log, nb_gl_frame_count_veil_layers(f));
    glActiveTexture(GL_TEXTURE0);
    return result == NEBEL_OK ? nb_particles_sort(&r->particles, &r->log, f->eye, parallel ? forward : NULL) : result;
}

static int has_vertex_fog(const nb_gl_frame *f)
{
    return nb_method_is_by_vertex(&f->method) && nb_gl_frame_has_fog(f);
}

static nebel_result prepare_vertices(const nb_gl_frame *f)
{
    nebel_gl_renderer *const r = f->renderer;
    if (!has_vertex_fog(f)) return NEBEL_OK;
    const nb_vertex_source source = find_source(f);
    const nebel_result result = nb_scene_programs_make_vertex_fog(&r->shading, &r->context, &r->log);
    return result == NEBEL_OK ? nb_vertex_fog_set(&r->meshes, &source) : result;
}

/* Behind the fog of the vertices, which corners take over. */
static nebel_result prepare_panorama(const nb_gl_frame *f)
{
    nebel_gl_renderer *const r = f->renderer;
    nebel_result result =
        nb_scene_programs_make_round(&r->shading, &r->context, &r->log, nb_method_is_by_vertex(&f->method));
    if (result == NEBEL_OK) result = nb_triangle_instances_make(&r->meshes);
    return result == NEBEL_OK && has_vertex_fog(f) ? nb_triangle_instances_set_fog(&r->meshes) : result;
}

static nebel_result draw_samples(nb_gl_frame *f)
{
    nebel_gl_renderer *const r = f->renderer;
    glActiveTexture(GL_TEXTURE0);
    nebel_result result = nb_targets_fit(&r->targets, &r->log, f->desc->width, f->desc->height);
    if (result == NEBEL_OK && nb_gl_frame_has_particles(f)) result = prepare_particles(f);
    if (result == NEBEL_OK) result = prepare_lights(f);
    if (result == NEBEL_OK) result = prepare_environment(f);
    if (result == NEBEL_OK) result = prepare_air(f);
    if (result == NEBEL_OK && f->layers != NULL) result = nb_gl_frame_prepare_shells(f);
    if (result == NEBEL_OK) result = prepare_vertices(f);
    if (result == NEBEL_OK && f->panorama) result = prepare_panorama(f);
    for (uint32_t i = 0; i < f->samples && result == NEBEL_OK; i++) {
        result = draw_sample(f, i);
        if (result == NEBEL_OK) result = report(f);
    }
    return result;
}

nebel_result nebel_gl_render_frame(nebel_gl_renderer *renderer, const nebel_gl_frame_desc *desc)
{
    if (renderer == NULL || desc == NULL) return NEBEL_ERROR_ARGUMENT;
    nebel_gl_frame_desc near = *desc;
    nb_gl_frame f = {.renderer = renderer, .desc = &near, .ahead = nb_gl_frame_go_near(renderer, &near.camera, desc)};
    renderer->has_frame = 0;
    nebel_result result = nb_context_check(&renderer->log, renderer->vertex_array);
    if (result == NEBEL_OK) result = set_frame(&f);
    if (result != NEBEL_OK) return result;
    nb_scene_state state;
    nb_scene_state_enter(&renderer->context, &state);
    result = draw_samples(&f);
    nb_scene_state_leave(&renderer->context, &state);
    renderer->has_frame = result == NEBEL_OK;
    return result;
}
