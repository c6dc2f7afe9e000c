#include "shadows.h"

#include "camera.h"
#include "state.h"

#include <math.h>

/* ---- what is seen
 * ----------------------------------------------------------------------------------------------------
 */

typedef struct rectangle {
    double low[2], high[2];
} rectangle;

/* The surfaces of a picture. */
typedef struct survey {
    const nebel_rays *rays;
    const float *pixels;
    uint32_t width, height;
    double nearest, farthest;
    rectangle seen[NB_CASCADES];
} survey;

static rectangle nothing(void)
{
    return (rectangle){{HUGE_VAL, HUGE_VAL}, {-HUGE_VAL, -HUGE_VAL}};
}

static void include(rectangle *r, const double at[2])
{
    for (int i = 0; i < 2; i++) {
        r->low[i] = fmin(r->low[i], at[i]);
        r->high[i] = fmax(r->high[i], at[i]);
    }
}

void nb_shadows_turn(nb_shadows *shadows, const double sun[3])
{
    double axis[3] = {0, 0, 0};
    int least = 0;
    for (int i = 1; i < 3; i++) {
        if (fabs(sun[i]) < fabs(sun[least])) least = i;
    }
    axis[least] = 1;
    nb_camera_cross(axis, sun, shadows->across[0]);
    (void)nb_camera_normalize(shadows->across[0]);
    nb_camera_cross(shadows->across[0], sun, shadows->across[1]);
    for (int i = 0; i < 3; i++) {
        shadows->light[3 * i] = (float)shadows->across[0][i];
        shadows->light[3 * i + 1] = (float)shadows->across[1][i];
        shadows->light[3 * i + 2] = (float)sun[i];
    }
}

static void find_distances(survey *s)
{
    const size_t count = (size_t)s->width * s->height;
    s->nearest = HUGE_VAL;
    s->farthest = 0;
    for (size_t i = 0; i < count; i++) {
        const double t = (double)s->pixels[4 * i];
        if (!(t > 0)) continue;
        s->nearest = fmin(s->nearest, t);
        s->farthest = fmax(s->farthest, t);
    }
}

/* Distances grow by the same factor from map to map, as texels on the screen shrink. */
static void set_ends(nb_shadows *shadows, const survey *s)
{
    for (int k = 0; k < NB_CASCADES; k++) {
        const double share = (k + 1.) / NB_CASCADES;
        shadows->ends[k] = (float)(s->nearest * pow(s->farthest / s->nearest, share));
    }
    shadows->ends[NB_CASCADES - 1] = HUGE_VALF;
}

static int cascade_of(const nb_shadows *shadows, double t)
{
    int k = 0;
    while (k < NB_CASCADES - 1 && t > (double)shadows->ends[k]) k++;
    return k;
}

/* words + x words + y words */
static void combine(const nebel_word words[3], double x, double y, double v[3])
{
    for (int i = 0; i < 3; i++) v[i] = (double)words[0].v[i] + x * (double)words[1].v[i] + y * (double)words[2].v[i];
}

static void find_rectangles(const nb_shadows *shadows, survey *s)
{
    for (int k = 0; k < NB_CASCADES; k++) s->seen[k] = nothing();
    for (uint32_t y = 0; y < s->height; y++) {
        for (uint32_t x = 0; x < s->width; x++) {
            const double t = (double)s->pixels[4 * ((size_t)y * s->width + x)];
            if (!(t > 0)) continue;
            double origin[3], way[3], at[2] = {0, 0};
            combine(s->rays->words, x + .5, y + .5, origin);
            combine(s->rays->words + 3, x + .5, y + .5, way);
            const double step = t / sqrt(way[0] * way[0] + way[1] * way[1] + way[2] * way[2]);
            for (int i = 0; i < 3; i++) {
                for (int k = 0; k < 2; k++) at[k] += shadows->across[k][i] * (origin[i] + step * way[i]);
            }
            include(&s->seen[cascade_of(shadows, t)], at);
        }
    }
}

/* How wide a pixel is at most: what other samples may see beside the surveyed. */
static double pixel_width(const survey *s, double t)
{
    double width = 0;
    for (int i = 0; i < 3; i++) {
        width = fmax(width, fabs((double)s->rays->words[1].v[i]) + t * fabs((double)s->rays->words[4].v[i]));
        width = fmax(width, fabs((double)s->rays->words[2].v[i]) + t * fabs((double)s->rays->words[5].v[i]));
    }
    return width;
}

/* Some texels at the borders belong to the filter. */
static void lay_map(nb_shadows *shadows, const survey *s, int map)
{
    enum { BORDER = 4 };
    rectangle r = s->seen[map];
    if (r.low[0] > r.high[0]) {
        shadows->ends[map] = 0;
        return;
    }
    const double pixel = 2 * pixel_width(s, fmin((double)shadows->ends[map], s->farthest));
    for (int i = 0; i < 2; i++) {
        const double margin = pixel + .01 * (r.high[i] - r.low[i]);
        const double extent = r.high[i] - r.low[i] + 2 * margin;
        const double texels = (shadows->size - 2. * BORDER) / extent;
        shadows->places[map][i] = (float)(r.low[i] - margin - BORDER / texels);
        shadows->places[map][2 + i] = (float)texels;
        shadows->seen_low[i] = fmin(shadows->seen_low[i], r.low[i] - margin);
        shadows->seen_high[i] = fmax(shadows->seen_high[i], r.high[i] + margin);
    }
}

/* Heights of all that may cast shadows, and how fine floats are there. */
static void find_heights(nb_shadows *shadows, const double eye[3], const nb_meshes *meshes)
{
    double low = HUGE_VAL, high = -HUGE_VAL, farthest = 0;
    for (int corner = 0; corner < 8; corner++) {
        double height = 0;
        for (int i = 0; i < 3; i++) {
            const double way = (corner >> i & 1 ? meshes->high[i] : meshes->low[i]) - eye[i];
            height += (double)shadows->light[3 * i + 2] * way;
            farthest = fmax(farthest, fabs(way));
        }
        low = fmin(low, height);
        high = fmax(high, height);
    }
    shadows->rounding = (float)(0x1p-20 * farthest);
    shadows->low = (float)low - shadows->rounding;
    shadows->high = (float)high + shadows->rounding;
}

static int read_places(nb_shadows *shadows, const nebel_allocator *allocator, const nb_targets *targets)
{
    const size_t wanted = 4 * (size_t)targets->width * targets->height;
    if (wanted > shadows->capacity) {
        nb_release(allocator, shadows->pixels);
        shadows->pixels = nb_allocate(allocator, wanted, sizeof *shadows->pixels);
        shadows->capacity = shadows->pixels != NULL ? wanted : 0;
    }
    if (shadows->pixels == NULL) return 0;
    glBindFramebuffer(GL_READ_FRAMEBUFFER, targets->surface_buffer);
    glReadPixels(0, 0, (GLsizei)targets->width, (GLsizei)targets->height, GL_RGBA, GL_FLOAT, shadows->pixels);
    return 1;
}

nebel_result nb_shadows_fit(nb_shadows *shadows, const nebel_allocator *allocator, const nebel_log *log,
                            const nb_targets *targets, const nebel_rays *rays, const nb_meshes *meshes)
{
    survey s = {.rays = rays, .width = targets->width, .height = targets->height};
    for (int i = 0; i < 2; i++) {
        shadows->seen_low[i] = HUGE_VAL;
        shadows->seen_high[i] = -HUGE_VAL;
    }
    if (!read_places(shadows, allocator, targets)) {
        return nb_fail(log, NEBEL_ERROR_MEMORY, "OpenGL renderer: out of memory; ask for fewer pixels");
    }
    s.pixels = shadows->pixels;
    find_distances(&s);
    if (!(s.farthest > 0)) return NEBEL_OK;
    set_ends(shadows, &s);
    find_rectangles(shadows, &s);
    for (int k = 0; k < NB_CASCADES; k++) lay_map(shadows, &s, k);
    find_heights(shadows, rays->eye, meshes);
    return NEBEL_OK;
}

/* ---- maps
 * ------------------------------------------------------------------------------------------------------------
 */

static nebel_result make_texture(nb_shadows *shadows, const nebel_log *log)
{
    const GLsizei size = (GLsizei)shadows->size;
    glGenTextures(1, &shadows->texture);
    glActiveTexture(GL_TEXTURE0 + NB_UNIT_SHADOWS);
    glBindTexture(GL_TEXTURE_2D_ARRAY, shadows->texture);
    glTexParameteri(GL_TEXTURE_2D_ARRAY, GL_TEXTURE_MIN_FILTER, GL_NEAREST);
    glTexParameteri(GL_TEXTURE_2D_ARRAY, GL_TEXTURE_MAG_FILTER, GL_NEAREST);
    glTexParameteri(GL_TEXTURE_2D_ARRAY, GL_TEXTURE_MAX_LEVEL, 0);
    glTexImage3D(GL_TEXTURE_2D_ARRAY, 0, GL_DEPTH_COMPONENT32F, size, size, NB_CASCADES, 0, GL_DEPTH_COMPONENT,
                 GL_FLOAT, NULL);
    glGenFramebuffers(1, &shadows->buffer);
    glBindFramebuffer(GL_FRAMEBUFFER, shadows->buffer);
    const GLenum none = GL_NONE;
    glDrawBuffers(1, &none);
    glReadBuffer(GL_NONE);
    return nb_context_check_memory(log, "the shadow maps; ask for smaller ones");
}

/* Whether a mesh reaches over the map. */
static int is_in_map(const nb_shadows *shadows, int map, const nb_mesh *mesh, const double eye[3])
{
    rectangle r = nothing();
    for (int corner = 0; corner < 8; corner++) {
        double at[2] = {0, 0};
        for (int i = 0; i < 3; i++) {
            const double p = (double)(corner >> i & 1 ? mesh->high[i] : mesh->low[i]) + (mesh->origin[i] - eye[i]);
            for (int k = 0; k < 2; k++) at[k] += shadows->across[k][i] * p;
        }
        include(&r, at);
    }
    const float *const place = shadows->places[map];
    for (int i = 0; i < 2; i++) {
        const double end = (double)place[i] + shadows->size / (double)place[2 + i];
        if (!(r.high[i] >= (double)place[i] && r.low[i] <= end)) return 0;
    }
    return 1;
}

static void draw_map(const nb_shadows *shadows, int map, unsigned program, const nb_meshes *meshes, const double eye[3])
{
    const float *const place = shadows->places[map], size = (float)shadows->size;
    const GLint offset = glGetUniformLocation(program, "scene_offset");
    glUniform3f(glGetUniformLocation(program, "map_low"), place[0], place[1], shadows->low);
    glUniform3f(glGetUniformLocation(program, "map_scale"), 2 * place[2] / size, 2 * place[3] / size,
                2 / (shadows->high - shadows->low));
    for (size_t i = 0; i < meshes->count; i++) {
        const nb_mesh *const mesh = &meshes->list[i];
        float from_eye[3];
        if (!is_in_map(shadows, map, mesh, eye)) continue;
        nb_camera_subtract(mesh->origin, eye, from_eye);
        glUniform3fv(offset, 1, from_eye);
        glBindVertexArray(mesh->vertex_array);
        glDrawElements(GL_TRIANGLES, mesh->index_count, GL_UNSIGNED_INT, NULL);
    }
}

nebel_result nb_shadows_draw(nb_shadows *shadows, const nb_context *context, const nebel_log *log, unsigned program,
                             const nb_meshes *meshes, const double eye[3])
{
    static const GLfloat empty = 1;
    if (shadows->texture == 0) {
        const nebel_result result = make_texture(shadows, log);
        if (result != NEBEL_OK) return result;
    }
    glBindFramebuffer(GL_FRAMEBUFFER, shadows->buffer);
    nb_state_clear(context, 0, 0, shadows->size, shadows->size);
    glEnable(GL_DEPTH_TEST);
    glDepthFunc(GL_LESS);
    glUseProgram(program);
    glUniformMatrix3fv(glGetUniformLocation(program, "scene_light"), 1, GL_FALSE, shadows->light);
    for (int map = 0; map < NB_CASCADES; map++) {
        glFramebufferTextureLayer(GL_FRAMEBUFFER, GL_DEPTH_ATTACHMENT, shadows->texture, 0, map);
        glClearBufferfv(GL_DEPTH, 0, &empty);
        if (shadows->ends[map] > 0) draw_map(shadows, map, program, meshes, eye);
    }
    return NEBEL_OK;
}

void nb_shadows_delete(const nb_shadows *shadows)
{
    glDeleteFramebuffers(1, &shadows->buffer);
    glDeleteTextures(1, &shadows->texture);
}
