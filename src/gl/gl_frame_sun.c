/* The sun of a frame: shadow maps around what is seen, and what dims its light. */
#include "gl_frame.h"
#include "fog_context.h"

/* A square picture of all that is seen, against the sun's light, from the same eye: light coordinates are its metres.
 */
static void set_sun_view(nb_gl_frame *f)
{
    enum { SUN_VIEW_SIZE = 2048 };
    const nb_shadows *const s = &f->renderer->shadows;
    f->sun_view = (nebel_view){.width = SUN_VIEW_SIZE, .height = SUN_VIEW_SIZE};
    double *const eye = f->sun_view.eye_from_world, *const clip = f->sun_view.clip_from_eye;
    for (int i = 0; i < 3; i++) {
        const double axes[3] = {s->across[0][i], s->across[1][i], -f->light.sun_direction[i]};
        for (int k = 0; k < 3; k++) {
            eye[4 * i + k] = axes[k];
            eye[12 + k] -= axes[k] * f->eye[i];
        }
    }
    for (int i = 0; i < 2; i++) {
        const double extent = s->seen_high[i] - s->seen_low[i];
        clip[5 * i] = 2 / extent;
        clip[12 + i] = -(s->seen_high[i] + s->seen_low[i]) / extent;
    }
    const double reach = 1e9;
    clip[10] = -2 / reach;
    clip[14] = -1;
    eye[15] = clip[15] = 1;
}

/* Lists of volumes along the sun's light are made where the eye has some, too. */
static nebel_result set_sun_fog(nb_gl_frame *f)
{
    nebel_gl_renderer *const r = f->renderer;
    if (r->fog == NULL || f->planet != NULL || f->method.replaces_fog ||
        !(r->shadows.seen_low[0] < r->shadows.seen_high[0]))
        return NEBEL_OK;
    set_sun_view(f);
    return nebel_gl_set_fog(r->sun_fog, r->fog, &f->sun_view);
}

/* The same for particles. */
static nebel_result set_sun_cloud(nb_gl_frame *f)
{
    nebel_gl_renderer *const r = f->renderer;
    nebel_result result = NEBEL_OK;
    f->dims = !f->desc->particles_leave_sun && nb_gl_frame_has_particles(f);
    if (!f->dims) return NEBEL_OK;
    if (r->cloud == NULL) result = nb_particles_commit(&r->particles, &r->allocator, &r->log, &r->cloud);
    if (result != NEBEL_OK) return result;
    set_sun_view(f);
    return nebel_gl_set_fog(r->sun_cloud, r->cloud, &f->sun_view);
}

static nebel_result prepare_shafts(const nb_gl_frame *f)
{
    nebel_gl_renderer *const r = f->renderer;
    nb_shadows_turn_fog(&r->shafts.maps, f->light.sun_direction);
    return nb_shaft_maps_draw(&r->shafts, &r->context, &r->log, r->shading.shadow, r->vertex_array, &r->shadows,
                              &r->targets, &f->rays, f->panorama, &r->meshes, &f->sunlit);
}

nebel_result nb_gl_frame_prepare_sun(nb_gl_frame *f)
{
    nebel_gl_renderer *const r = f->renderer;
    nb_shadows_turn(&r->shadows, f->light.sun_direction);
    r->shadows.sees_ground = f->planet != NULL || f->layers != NULL;
    glBindVertexArray(r->vertex_array);
    nebel_result result = nb_shadows_fit(&r->shadows, &r->context, &r->allocator, &r->log, r->shading.survey,
                                         &r->targets, &f->rays, f->panorama, &r->meshes);
    if (result == NEBEL_OK && f->shafts) result = prepare_shafts(f);
    if (result != NEBEL_OK) return result;
    f->casts = r->shadows.seen_low[0] < r->shadows.seen_high[0];
    if (!f->casts) return NEBEL_OK;
    result = nb_shadows_draw(&r->shadows, &r->context, &r->log, r->shading.shadow, &r->meshes, f->eye);
    if (result == NEBEL_OK) result = set_sun_fog(f);
    return result == NEBEL_OK ? set_sun_cloud(f) : result;
}

void nb_gl_frame_set_shadows(const nb_gl_frame *f, unsigned program)
{
    const nb_shadows *const s = &f->renderer->shadows;
    nb_gl_frame_bind_texture(NB_UNIT_SHADOWS, GL_TEXTURE_2D_ARRAY, s->texture);
    glUniformMatrix3fv(glGetUniformLocation(program, "scene_light"), 1, GL_FALSE, s->light);
    glUniform1f(glGetUniformLocation(program, "map_size"), (float)s->size);
    glUniform4fv(glGetUniformLocation(program, "map_places"), NB_CASCADES, s->places[0]);
    glUniform4fv(glGetUniformLocation(program, "map_ends"), 1, s->ends);
    glUniform3f(glGetUniformLocation(program, "map_heights"), s->low, s->high, s->rounding);
}

void nb_gl_frame_set_tiles(const nb_gl_frame *f, const nebel_gl_fog_resources *fog, unsigned program)
{
    const nb_shadows *const s = &f->renderer->shadows;
    float place[4];
    for (int i = 0; i < 2; i++) {
        place[i] = (float)s->seen_low[i];
        place[2 + i] = (float)(f->sun_view.width / (s->seen_high[i] - s->seen_low[i]));
    }
    nb_gl_frame_bind_texture(NB_UNIT_TILES, GL_TEXTURE_2D, fog->tiles);
    glUniform4fv(glGetUniformLocation(program, "tile_place"), 1, place);
    glUniform4i(glGetUniformLocation(program, "tile_grid"), (GLint)f->sun_view.width, (GLint)f->sun_view.height,
                (GLint)fog->tile_size, (GLint)fog->tile_columns);
}
