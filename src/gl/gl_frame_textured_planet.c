/* A textured planet in a frame. Its ground is drawn among the surfaces. Its shells follow each other from the eye on: along a
 * ray sides that it enters come before those that it leaves, the large before the small and then the small before the
 * large. Each is a surface of which a part is seen, with its own fog before it. */
#include "gl_frame.h"
#include "fog_context.h"

#include "math/vector.h"

#include <math.h>

/* ---- balls ----------------------------------------------------------------------------------- */

/* Clouds are counted from 0; as many as there are of them: the air. */
static double radius_of(const nebel_textured_planet_desc *desc, uint32_t shell)
{
    return desc->radius +
           (shell < desc->cloud_shell_count ? desc->cloud_shells[shell].height : desc->atmosphere.height);
}

static double eye_from_middle(const nb_gl_frame *f, double from[3])
{
    const nebel_textured_planet_desc *const desc = nebel_get_textured_planet_desc(f->layers);
    for (int i = 0; i < 3; i++) from[i] = f->eye[i] - desc->center[i];
    return nb_vector_length(from);
}

/* What is left of whole turns. */
static double turns(double day, double time)
{
    return day == 0 ? 0 : fmod(time / day, 1);
}

/* Rays that are parallel do not part. */
static double pixel_spread(const nb_gl_frame *f)
{
    if (f->desc->camera.projection == NEBEL_PROJECTION_ORTHOGRAPHIC) return 0;
    return nb_camera_pixel(&f->view, f->panorama) / sqrt((double)f->samples);
}

static void set_ambient(const nb_gl_frame *f, unsigned program, const char *name)
{
    static const double up[3] = {0, 1, 0};
    double ambient[3];
    nebel_evaluate_environment_diffuse(&f->light.environment, up, ambient);
    const float as_float[3] = {(float)ambient[0], (float)ambient[1], (float)ambient[2]};
    nb_gl_frame_set_vector(program, name, as_float);
}

static void set_ball(const nb_gl_frame *f, unsigned program, double radius, double turned)
{
    const nebel_textured_planet_desc *const desc = nebel_get_textured_planet_desc(f->layers);
    double from[3], axes[3][3];
    float frame[9];
    const double away = eye_from_middle(f, from), above = nb_height_above_sphere(away, radius);
    const float middle[3] = {(float)from[0], (float)from[1], (float)from[2]};
    nb_quaternion_axes(desc->rotation, axes);
    for (int i = 0; i < 9; i++) frame[i] = (float)axes[i / 3][i % 3];
    glUseProgram(program);
    nb_gl_frame_set_rays(f, program);
    nb_gl_frame_set_vector(program, "ball_from", middle);
    nb_gl_frame_set_vector(program, "ball_sun", f->light.sun);
    nb_gl_frame_set_vector(program, "ball_sunlight", f->light.sunlight);
    set_ambient(f, program, "ball_ambient");
    glUniformMatrix3fv(glGetUniformLocation(program, "ball_frame"), 1, GL_FALSE, frame);
    glUniform1f(glGetUniformLocation(program, "ball_radius"), (float)radius);
    glUniform1f(glGetUniformLocation(program, "ball_square"), (float)(above * (away + radius)));
    glUniform1f(glGetUniformLocation(program, "ball_turned"), (float)turned);
    glUniform1f(glGetUniformLocation(program, "ball_spread"), (float)pixel_spread(f));
}

static void set_map(unsigned program, const nb_gl_map *map, GLuint unit, const char *sizes)
{
    nb_gl_frame_bind_texture(unit, GL_TEXTURE_2D, map->name);
    glUniform3i(glGetUniformLocation(program, sizes), map->width, map->height, map->levels);
}

static void draw_whole(const nb_gl_frame *f)
{
    glBindVertexArray(f->renderer->vertex_array);
    glDrawArrays(GL_TRIANGLES, 0, 3);
}

void nb_gl_frame_draw_shell_ground(const nb_gl_frame *f)
{
    const nb_gl_shells *const shells = &f->renderer->shells;
    const nebel_textured_planet_desc *const desc = nebel_get_textured_planet_desc(f->layers);
    const unsigned program = shells->programs[f->panorama][NB_SHELL_GROUND];
    set_ball(f, program, desc->radius, turns(desc->rotation_period, f->desc->time));
    set_map(program, &shells->ground, NB_UNIT_NORMAL, "shell_map_sizes");
    draw_whole(f);
}

/* ---- shells ---------------------------------------------------------------------------------- */

static void set_clouds(const nb_gl_frame *f, uint32_t number, unsigned program)
{
    const nb_gl_shells *const shells = &f->renderer->shells;
    const nebel_textured_planet_desc *const desc = nebel_get_textured_planet_desc(f->layers);
    const nebel_cloud_shell *const shell = &desc->cloud_shells[number];
    const nb_gl_map *const detail =
        shells->details[number].name != 0 ? &shells->details[number] : &shells->clouds[number];
    set_ball(f, program, radius_of(desc, number),
             turns(desc->rotation_period, f->desc->time) + turns(shell->rotation_period, f->desc->time));
    set_map(program, &shells->clouds[number], NB_UNIT_NORMAL, "shell_map_sizes");
    set_map(program, detail, NB_UNIT_REFLECTANCE, "shell_detail_sizes");
    glUniform3f(glGetUniformLocation(program, "shell_wrap"), (float)shell->uv_tiling[0], (float)shell->uv_tiling[1],
                (float)shell->uv_tiling[2]);
    glUniform3f(glGetUniformLocation(program, "shell_color"), (float)shell->color[0], (float)shell->color[1],
                (float)shell->color[2]);
    glUniform1f(glGetUniformLocation(program, "shell_gain"), (float)shell->gain);
}

static void set_air(const nb_gl_frame *f, unsigned program)
{
    const nebel_textured_planet_desc *const desc = nebel_get_textured_planet_desc(f->layers);
    float ramp[NEBEL_MAX_RAMP_COLORS][3] = {{0}};
    for (uint32_t i = 0; i < 3 * desc->atmosphere.ramp_count; i++)
        ramp[i / 3][i % 3] = (float)desc->atmosphere.ramp[i / 3][i % 3];
    set_ball(f, program, radius_of(desc, desc->cloud_shell_count), 0);
    glUniform3fv(glGetUniformLocation(program, "air_ramp"), NEBEL_MAX_RAMP_COLORS, ramp[0]);
    glUniform1i(glGetUniformLocation(program, "air_ramp_count"), (GLint)desc->atmosphere.ramp_count);
    glUniform1f(glGetUniformLocation(program, "air_brightness"), (float)desc->atmosphere.brightness);
}

/* Where one side of a shell is, and what it shows. */
static void draw_side(const nb_gl_frame *f, uint32_t number, int is_far)
{
    const nebel_gl_renderer *const r = f->renderer;
    const int is_air = number == nebel_get_textured_planet_desc(f->layers)->cloud_shell_count;
    const unsigned program = r->shells.programs[f->panorama][is_air ? NB_SHELL_AIR : NB_SHELL_CLOUDS];
    glBindFramebuffer(GL_DRAW_FRAMEBUFFER, r->shells.shell_buffer);
    nb_state_clear(&r->context, 0, 0, r->targets.width, r->targets.height);
    if (is_air)
        set_air(f, program);
    else
        set_clouds(f, number, program);
    glUniform1i(glGetUniformLocation(program, "shell_is_far"), is_far);
    nb_gl_frame_bind_texture(NB_UNIT_PLACE, GL_TEXTURE_2D, r->targets.place);
    draw_whole(f);
}

/* Behind those that were drawn before. */
static nebel_result blend_shells(const nb_gl_frame *f)
{
    const nebel_gl_renderer *const r = f->renderer;
    const nb_composite_key kind = {
        .of_shells = 1, .in_fog = nb_gl_frame_has_fog(f), .veil_layers = nb_gl_frame_count_veil_layers(f)};
    nebel_gl_fog_resources fog;
    unsigned program = 0;
    const nebel_result result = nb_gl_frame_find_light(f, NULL, kind, &fog, &program);
    if (result != NEBEL_OK) return result;
    glBindFramebuffer(GL_DRAW_FRAMEBUFFER, r->shells.over_buffer);
    nb_state_clear(&r->context, 0, 0, r->targets.width, r->targets.height);
    nb_state_lay_under(&r->context);
    glUseProgram(program);
    nb_gl_frame_bind_texture(NB_UNIT_REFLECTANCE, GL_TEXTURE_2D, r->shells.seen);
    nb_gl_frame_bind_texture(NB_UNIT_IN_SCATTERING, GL_TEXTURE_2D, r->targets.in_scattering);
    nb_gl_frame_bind_texture(NB_UNIT_TRANSMITTANCE, GL_TEXTURE_2D, r->targets.transmittance);
    if (kind.veil_layers > 0) nb_gl_frame_bind_texture(NB_UNIT_VEIL, GL_TEXTURE_2D_ARRAY, r->targets.veil);
    draw_whole(f);
    return NEBEL_OK;
}

static nebel_result add_side(nb_gl_frame *f, uint32_t number, int is_far)
{
    f->place = f->renderer->shells.place;
    f->depth = f->renderer->shells.depth;
    draw_side(f, number, is_far);
    nebel_result result = nb_gl_frame_draw_fog(f);
    if (result == NEBEL_OK) result = nb_gl_frame_draw_particles(f);
    return result == NEBEL_OK ? blend_shells(f) : result;
}

/* From the smallest to the largest; of equal ones the first before the second, or behind it. */
static uint32_t sort_shells(const nebel_textured_planet_desc *desc, int first_is_last,
                            uint32_t order[NEBEL_MAX_CLOUD_SHELLS + 1])
{
    const uint32_t count = desc->cloud_shell_count + (desc->atmosphere.is_disabled ? 0 : 1);
    for (uint32_t i = 0; i < count; i++) {
        uint32_t k = i;
        for (; k > 0; k--) {
            const double before = radius_of(desc, order[k - 1]), here = radius_of(desc, i);
            if (before < here || (before == here && !first_is_last)) break;
            order[k] = order[k - 1];
        }
        order[k] = i;
    }
    return count;
}

nebel_result nb_gl_frame_draw_shells(nb_gl_frame *f)
{
    static const GLfloat nothing[4] = {0, 0, 0, 1};
    const nebel_gl_renderer *const r = f->renderer;
    const nebel_textured_planet_desc *const desc = nebel_get_textured_planet_desc(f->layers);
    const int parts = f->desc->camera.projection == NEBEL_PROJECTION_ORTHOGRAPHIC; /* rays begin in several places */
    uint32_t order[NEBEL_MAX_CLOUD_SHELLS + 1];
    double from[3];
    const double away = eye_from_middle(f, from);
    nebel_result result = NEBEL_OK;
    glBindFramebuffer(GL_DRAW_FRAMEBUFFER, r->shells.over_buffer);
    nb_state_clear(&r->context, 0, 0, r->targets.width, r->targets.height);
    glClearBufferfv(GL_COLOR, 0, nothing);
    const uint32_t count = sort_shells(desc, 1, order);
    for (uint32_t i = count; i-- > 0 && result == NEBEL_OK;)
        if (parts || away >= radius_of(desc, order[i])) result = add_side(f, order[i], 0);
    (void)sort_shells(desc, 0, order);
    for (uint32_t i = 0; i < count && result == NEBEL_OK; i++)
        if (parts || away < radius_of(desc, order[i])) result = add_side(f, order[i], 1);
    return result;
}

/* ---- the frame ------------------------------------------------------------------------------- */

nebel_result nb_gl_frame_prepare_shells(const nb_gl_frame *f)
{
    nebel_gl_renderer *const r = f->renderer;
    glActiveTexture(GL_TEXTURE0);
    return nb_gl_textured_set(&r->shells, &r->context, &r->log, f->layers, f->desc->width, f->desc->height,
                              f->panorama);
}

void nb_gl_frame_set_shells(const nb_gl_frame *f, unsigned program)
{
    nb_gl_frame_bind_texture(NB_UNIT_SHELLS, GL_TEXTURE_2D, f->renderer->shells.over);
    set_ambient(f, program, "shell_ambient");
}
