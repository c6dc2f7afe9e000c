#include "gl_fixed_function.h"

#include <nebel/gl.h>
#include <nebel/render.h>

#include <epoxy/gl.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* What is hidden of the range of depth is not seen. */
static const double depth_slack = 1.01;

typedef struct nb_fixed_work {
    const nb_gl_fixed_function *fixed;
    const nebel_gl_frame_desc *desc;
    uint32_t side, width, height; /* samples of a pixel either way, and of the picture */
    nebel_view view;
    nebel_gl_classic *classic;
    nebel_vertex_output *streams;                  /* of each mesh */
    float *color, *in_scattering, *depth, *normal; /* of all samples, the top row first */
    float *texels;                                 /* four for each, the lowest row first */
    unsigned textures[2], depth_buffer, target;    /* the light of surfaces, and what is drawn */
} nb_fixed_work;

/* ---- surfaces -------------------------------------------------------------------------------- */

static uint32_t find_side(uint32_t samples)
{
    const uint32_t wanted = samples != 0 ? samples : 4;
    uint32_t side = 1;
    while (side * side < wanted) side++;
    return side;
}

static int allocate(nb_fixed_work *w)
{
    const size_t pixels = (size_t)w->width * w->height;
    w->color = malloc(pixels * 3 * sizeof(float));
    w->in_scattering = malloc(pixels * 3 * sizeof(float));
    w->normal = malloc(pixels * 3 * sizeof(float));
    w->depth = malloc(pixels * sizeof(float));
    w->texels = malloc(pixels * 4 * sizeof(float));
    w->streams = calloc(w->fixed->scene->mesh_count + 1, sizeof *w->streams);
    return w->color != NULL && w->in_scattering != NULL && w->normal != NULL && w->depth != NULL && w->texels != NULL &&
           w->streams != NULL;
}

/* Fog that only adds leaves the light of the surfaces as it is, dimmed by the fog before the sun. */
static nebel_result draw_surfaces(nb_fixed_work *w)
{
    nebel_gl_frame_desc desc = *w->desc;
    const nebel_gl_planes planes = {
        .color = w->color, .in_scattering = w->in_scattering, .depth = w->depth, .normal = w->normal};
    desc.width = w->width;
    desc.height = w->height;
    desc.samples = 1;
    desc.method = NEBEL_GL_METHOD_ADDITIVE;
    desc.progress = NULL;
    const nebel_result result = nebel_gl_render_frame(w->fixed->renderer, &desc);
    return result == NEBEL_OK ? nebel_gl_read_planes(w->fixed->renderer, &planes) : result;
}

/* ---- streams --------------------------------------------------------------------------------- */

static nebel_vertex_format format_of(nebel_gl_classic_kind kind)
{
    switch (kind) {
    case NEBEL_GL_CLASSIC_FOG_COORD:
        return NEBEL_VERTEX_COORDINATE;
    case NEBEL_GL_CLASSIC_ALPHA:
        return NEBEL_VERTEX_ALPHA;
    default:
        return NEBEL_VERTEX_RGBA_FLOAT;
    }
}

/* ---- what is stored: sRGB, at most 1 (IEC 61966-2-1) ------------------------------------------- */

static double store(double linear)
{
    const float light[3] = {(float)linear, (float)linear, (float)linear};
    float stored[3];
    nebel_encode_srgb(1, light, 0, stored);
    return (double)stored[0];
}

static double restore(double stored)
{
    if (!(stored > 0)) return 0;
    if (!(stored < 1)) return 1;
    return stored <= 0.04045 ? stored / 12.92 : pow((stored + 0.055) / 1.055, 2.4);
}

static void fill_colors(unsigned char *bytes, size_t count, const double *color)
{
    for (size_t v = 0; v < count; v++)
        for (size_t c = 0; c < 3; c++) bytes[4 * v + c] = (unsigned char)floor(255 * store(color[c]) + .5);
}

/* Light that fog of an amount adds is as much of a stored color. */
static void store_colors(float (*colors)[4], size_t count)
{
    for (size_t v = 0; v < count; v++)
        for (int c = 0; c < 3; c++) {
            const double amount = (double)colors[v][3], light = (double)colors[v][c];
            colors[v][c] = (float)(amount > 0 ? amount * store(light / amount) : store(light));
        }
}

static nebel_result fog_mesh(const nb_fixed_work *w, const nebel_mesh *mesh, nebel_vertex_output *stream)
{
    const nebel_vertex_format format = format_of(nebel_gl_get_classic_method(w->classic));
    nebel_vertex_desc look = w->desc->vertex != NULL ? *w->desc->vertex : (nebel_vertex_desc){.channel = 0};
    const size_t size = format == NEBEL_VERTEX_RGBA_FLOAT ? 4 * sizeof(float) : sizeof(float);
    nebel_vertices vertices = {.positions = mesh->positions};
    memcpy(vertices.origin, mesh->origin, sizeof vertices.origin);
    memcpy(vertices.eye, w->desc->camera.position, sizeof vertices.eye);
    *stream = (nebel_vertex_output){format, malloc(((size_t)mesh->vertex_count + 1) * size), size};
    if (stream->data == NULL) return NEBEL_ERROR_MEMORY;
    if (format == NEBEL_VERTEX_ALPHA) fill_colors(stream->data, mesh->vertex_count, look.color);
    look.lighting = w->fixed->fog;
    const nebel_result result = nebel_compute_vertex_fog(nebel_get_lighting_snapshot(w->fixed->fog), &look,
                                                         mesh->vertex_count, &vertices, stream, 1);
    if (result == NEBEL_OK && format == NEBEL_VERTEX_RGBA_FLOAT) store_colors(stream->data, mesh->vertex_count);
    return result;
}

static nebel_result fog_meshes(nb_fixed_work *w)
{
    const nebel_scene_data *const scene = w->fixed->scene;
    nebel_result result = NEBEL_OK;
    for (size_t i = 0; i < scene->mesh_count && result == NEBEL_OK; i++)
        result = fog_mesh(w, &scene->meshes[i], &w->streams[i]);
    return result;
}

/* ---- matrices -------------------------------------------------------------------------------- */

/* Column by column; out may be neither. */
static void multiply(const double a[16], const double b[16], double out[16])
{
    for (int column = 0; column < 4; column++)
        for (int row = 0; row < 4; row++) {
            double sum = 0;
            for (int k = 0; k < 4; k++) sum += a[4 * k + row] * b[4 * column + k];
            out[4 * column + row] = sum;
        }
}

/* The view's projection has no end: this one holds what is seen, so that depth has its digits where surfaces are. */
static void set_projection(const nb_fixed_work *w, double projection[16])
{
    const size_t pixels = (size_t)w->width * w->height;
    double nearest = HUGE_VAL, farthest = 0, corner = 1;
    for (size_t i = 0; i < pixels; i++) {
        if (!isfinite(w->depth[i])) continue;
        nearest = fmin(nearest, (double)w->depth[i]);
        farthest = fmax(farthest, (double)w->depth[i]);
    }
    memcpy(projection, w->view.clip_from_eye, 16 * sizeof *projection);
    for (int i = 0; i < 2; i++) corner += 1 / (projection[5 * i] * projection[5 * i]);
    const double from = farthest > 0 ? nearest / sqrt(corner) / depth_slack : 1,
                 to = farthest > 0 ? farthest * depth_slack : 2;
    projection[10] = (to + from) / (from - to);
    projection[14] = 2 * to * from / (from - to);
    projection[11] = -1;
    projection[15] = 0;
}

/* From positions of a mesh; and to the texture of what is seen, from positions, too. */
static void set_matrices(const nb_fixed_work *w, const double projection[16], const nebel_mesh *mesh)
{
    static const double half[16] = {.5, 0, 0, 0, 0, .5, 0, 0, 0, 0, .5, 0, .5, .5, .5, 1};
    double place[16] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1}, eye[16], clip[16], texture[16];
    memcpy(&place[12], mesh->origin, sizeof mesh->origin);
    multiply(w->view.eye_from_world, place, eye);
    multiply(projection, eye, clip);
    multiply(half, clip, texture);
    glMatrixMode(GL_PROJECTION);
    glLoadMatrixd(projection);
    glMatrixMode(GL_TEXTURE);
    glLoadMatrixd(texture);
    glMatrixMode(GL_MODELVIEW);
    glLoadMatrixd(eye);
}

/* ---- passes ---------------------------------------------------------------------------------- */

static void draw_mesh(const nebel_mesh *mesh)
{
    glEnableClientState(GL_VERTEX_ARRAY);
    glVertexPointer(3, GL_FLOAT, 0, mesh->positions);
    glDrawElements(GL_TRIANGLES, (GLsizei)(3 * mesh->triangle_count), GL_UNSIGNED_INT, mesh->indices);
    glDisableClientState(GL_VERTEX_ARRAY);
}

/* What is seen, on the surface that is there. */
static void draw_lit_mesh(const nebel_mesh *mesh)
{
    glEnableClientState(GL_TEXTURE_COORD_ARRAY);
    glTexCoordPointer(3, GL_FLOAT, 0, mesh->positions);
    draw_mesh(mesh);
    glDisableClientState(GL_TEXTURE_COORD_ARRAY);
}

/* Where nothing is in front of it: no vertices, no fog. */
static void draw_background(void)
{
    static const float corners[4][2] = {{-1, -1}, {3, -1}, {-1, 3}, {0, 0}},
                       places[4][2] = {{0, 0}, {2, 0}, {0, 2}, {0, 0}};
    const GLenum modes[3] = {GL_PROJECTION, GL_TEXTURE, GL_MODELVIEW};
    for (int i = 0; i < 3; i++) {
        glMatrixMode(modes[i]);
        glLoadIdentity();
    }
    glDisable(GL_DEPTH_TEST);
    glEnableClientState(GL_VERTEX_ARRAY);
    glEnableClientState(GL_TEXTURE_COORD_ARRAY);
    glVertexPointer(2, GL_FLOAT, 0, corners);
    glTexCoordPointer(2, GL_FLOAT, 0, places);
    glDrawArrays(GL_TRIANGLES, 0, 3);
    glDisableClientState(GL_TEXTURE_COORD_ARRAY);
    glDisableClientState(GL_VERTEX_ARRAY);
    glEnable(GL_DEPTH_TEST);
}

static nebel_result draw_fog(const nb_fixed_work *w, const double projection[16])
{
    const nebel_scene_data *const scene = w->fixed->scene;
    const int one_pass = nebel_gl_get_classic_method(w->classic) == NEBEL_GL_CLASSIC_FOG_COORD;
    const double *const opaque = w->desc->vertex->color;
    float color[3] = {0, 0, 0};
    for (int c = 0; c < 3 && opaque != NULL; c++) color[c] = (float)store(opaque[c]);
    nebel_result result = nebel_gl_begin_classic_fog(w->classic, color);
    for (size_t i = 0; i < scene->mesh_count && result == NEBEL_OK; i++) {
        set_matrices(w, projection, &scene->meshes[i]);
        result = nebel_gl_bind_classic_stream(w->classic, &w->streams[i], 0);
        if (result == NEBEL_OK && one_pass) draw_lit_mesh(&scene->meshes[i]);
        if (result == NEBEL_OK && !one_pass) draw_mesh(&scene->meshes[i]);
    }
    const nebel_result ended = nebel_gl_end_classic_fog(w->classic);
    return result == NEBEL_OK ? ended : result;
}

/* The picture of surfaces whose light is in the texture. */
static nebel_result draw_picture(const nb_fixed_work *w)
{
    const nebel_scene_data *const scene = w->fixed->scene;
    double projection[16];
    set_projection(w, projection);
    glViewport(0, 0, (GLsizei)w->width, (GLsizei)w->height);
    glClear(GL_DEPTH_BUFFER_BIT);
    glEnable(GL_TEXTURE_2D);
    glTexEnvi(GL_TEXTURE_ENV, GL_TEXTURE_ENV_MODE, GL_REPLACE);
    draw_background();
    for (size_t i = 0; i < scene->mesh_count; i++) {
        if (nebel_gl_get_classic_method(w->classic) == NEBEL_GL_CLASSIC_FOG_COORD) break;
        set_matrices(w, projection, &scene->meshes[i]);
        draw_lit_mesh(&scene->meshes[i]);
    }
    const nebel_result result = draw_fog(w, projection);
    glDisable(GL_TEXTURE_2D);
    return result;
}

/* ---- pictures -------------------------------------------------------------------------------- */

static void make_texture(const nb_fixed_work *w, unsigned name)
{
    glBindTexture(GL_TEXTURE_2D, name);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_NEAREST);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, GL_NEAREST);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_S, GL_CLAMP_TO_EDGE);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_T, GL_CLAMP_TO_EDGE);
    glTexImage2D(GL_TEXTURE_2D, 0, GL_RGBA32F, (GLsizei)w->width, (GLsizei)w->height, 0, GL_RGBA, GL_FLOAT, NULL);
}

static nebel_result make_target(nb_fixed_work *w)
{
    glGenTextures(2, w->textures);
    for (int i = 0; i < 2; i++) make_texture(w, w->textures[i]);
    glGenRenderbuffers(1, &w->depth_buffer);
    glBindRenderbuffer(GL_RENDERBUFFER, w->depth_buffer);
    glRenderbufferStorage(GL_RENDERBUFFER, GL_DEPTH_COMPONENT32F, (GLsizei)w->width, (GLsizei)w->height);
    glGenFramebuffers(1, &w->target);
    glBindFramebuffer(GL_FRAMEBUFFER, w->target);
    glFramebufferTexture2D(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_TEXTURE_2D, w->textures[1], 0);
    glFramebufferRenderbuffer(GL_FRAMEBUFFER, GL_DEPTH_ATTACHMENT, GL_RENDERBUFFER, w->depth_buffer);
    glBindTexture(GL_TEXTURE_2D, w->textures[0]);
    glClampColor(GL_CLAMP_VERTEX_COLOR, GL_FALSE);
    glClampColor(GL_CLAMP_FRAGMENT_COLOR, GL_FALSE);
    return glCheckFramebufferStatus(GL_FRAMEBUFFER) == GL_FRAMEBUFFER_COMPLETE && glGetError() == GL_NO_ERROR
               ? NEBEL_OK
               : NEBEL_ERROR_UNSUPPORTED;
}

/* Leaves OpenGL as nebel's renderer knows it. */
static void delete_target(const nb_fixed_work *w)
{
    glDisable(GL_DEPTH_TEST);
    glBindFramebuffer(GL_FRAMEBUFFER, 0);
    glBindRenderbuffer(GL_RENDERBUFFER, 0);
    glBindTexture(GL_TEXTURE_2D, 0);
    glDeleteFramebuffers(1, &w->target);
    glDeleteRenderbuffers(1, &w->depth_buffer);
    glDeleteTextures(2, w->textures);
}

static size_t texel_of(const nb_fixed_work *w, size_t pixel)
{
    const size_t x = pixel % w->width, y = pixel / w->width;
    return 4 * ((w->height - 1 - y) * w->width + x);
}

/* Means of the samples of each pixel, of planes whose top row comes first. */
static void reduce(const nb_fixed_work *w, const float *samples, float *plane)
{
    const size_t side = w->side, width = w->desc->width, height = w->desc->height;
    for (size_t i = 0; i < 3 * width * height; i++) {
        const size_t x = i / 3 % width, y = i / 3 / width;
        double sum = 0;
        for (size_t k = 0; k < side * side; k++)
            sum += (double)samples[3 * ((y * side + k / side) * w->width + x * side + k % side) + i % 3];
        plane[i] = (float)(sum / (double)(side * side));
    }
}

/* Of the samples that met a surface. */
static void reduce_depth(const nb_fixed_work *w, float *plane)
{
    const size_t side = w->side, width = w->desc->width, height = w->desc->height;
    for (size_t i = 0; i < width * height; i++) {
        double sum = 0;
        int met = 0;
        for (size_t k = 0; k < side * side; k++) {
            const float t = w->depth[(i / width * side + k / side) * w->width + i % width * side + k % side];
            if (!isfinite(t)) continue;
            sum += (double)t;
            met++;
        }
        plane[i] = met > 0 ? (float)(sum / met) : HUGE_VALF;
    }
}

/* Draws surfaces of this light, and reads what became of it into `out`, which may be the same. */
static nebel_result fog_light(const nb_fixed_work *w, const float *light, float *out)
{
    const size_t pixels = (size_t)w->width * w->height;
    for (size_t i = 0; i < pixels; i++) {
        float *const texel = w->texels + texel_of(w, i);
        for (size_t c = 0; c < 3; c++) texel[c] = light[3 * i + c];
        texel[3] = 1;
    }
    glTexSubImage2D(GL_TEXTURE_2D, 0, 0, 0, (GLsizei)w->width, (GLsizei)w->height, GL_RGBA, GL_FLOAT, w->texels);
    const nebel_result result = draw_picture(w);
    glReadPixels(0, 0, (GLsizei)w->width, (GLsizei)w->height, GL_RGBA, GL_FLOAT, w->texels);
    for (size_t i = 0; i < pixels; i++)
        for (size_t c = 0; c < 3; c++) out[3 * i + c] = w->texels[texel_of(w, i) + c];
    return result;
}

/* Black surfaces show what fog adds, and white ones what else it lets through. */
static nebel_result read_fog(const nb_fixed_work *w, const nebel_gl_planes *planes)
{
    const size_t count = 3 * (size_t)w->width * w->height;
    for (size_t i = 0; i < count; i++) w->in_scattering[i] = 0;
    nebel_result result = fog_light(w, w->in_scattering, w->in_scattering);
    for (size_t i = 0; i < count; i++) w->color[i] = 1;
    if (result == NEBEL_OK) result = fog_light(w, w->color, w->color);
    for (size_t i = 0; i < count; i++) w->color[i] -= w->in_scattering[i];
    if (planes->in_scattering != NULL) reduce(w, w->in_scattering, planes->in_scattering);
    if (planes->transmittance != NULL) reduce(w, w->color, planes->transmittance);
    return result;
}

static nebel_result draw_planes(const nb_fixed_work *w, const nebel_gl_planes *planes)
{
    const size_t count = 3 * (size_t)w->width * w->height;
    for (size_t i = 0; i < count; i++) w->color[i] = (float)store((double)(w->color[i] - w->in_scattering[i]));
    nebel_result result = fog_light(w, w->color, w->color);
    for (size_t i = 0; i < count; i++) w->color[i] = (float)restore((double)w->color[i]);
    if (planes->color != NULL) reduce(w, w->color, planes->color);
    if (planes->normal != NULL) reduce(w, w->normal, planes->normal);
    if (planes->depth != NULL) reduce_depth(w, planes->depth);
    if (result == NEBEL_OK && (planes->transmittance != NULL || planes->in_scattering != NULL))
        result = read_fog(w, planes);
    return result;
}

/* ---- all ------------------------------------------------------------------------------------- */

static nebel_result create_classic(nb_fixed_work *w)
{
    static const nebel_gl_classic_kind kinds[NEBEL_GL_METHOD_COUNT] = {
        [NEBEL_GL_METHOD_FOG_COORD] = NEBEL_GL_CLASSIC_FOG_COORD,
        [NEBEL_GL_METHOD_TWO_PASS] = NEBEL_GL_CLASSIC_TWO_PASS,
        [NEBEL_GL_METHOD_ALPHA] = NEBEL_GL_CLASSIC_ALPHA,
    };
    const nebel_gl_classic_desc desc = {.host.log = w->fixed->log, .kind = kinds[w->desc->method]};
    return nebel_create_gl_classic(&desc, &w->classic);
}

static nebel_result say(const nb_fixed_work *w, nebel_result result, const char *text)
{
    const nebel_log *const log = &w->fixed->log;
    if (log->write != NULL) log->write(NEBEL_LOG_ERROR, result, text, log->user);
    return result;
}

static nebel_result draw(nb_fixed_work *w, const nebel_gl_planes *planes)
{
    if (!allocate(w)) return say(w, NEBEL_ERROR_MEMORY, "frame: out of memory; ask for fewer pixels or samples");
    nebel_result result = draw_surfaces(w);
    if (result == NEBEL_OK)
        result = nebel_view_from_camera(&w->desc->camera, w->width, w->height, &w->fixed->log, &w->view);
    if (result == NEBEL_OK) result = create_classic(w);
    if (result == NEBEL_OK) result = fog_meshes(w);
    if (result != NEBEL_OK) return result;
    result = make_target(w);
    if (result != NEBEL_OK)
        (void)say(w, result, "frame: this OpenGL does not draw so many floats; ask for fewer pixels or samples");
    if (result == NEBEL_OK) result = draw_planes(w, planes);
    delete_target(w);
    return result;
}

nebel_result nb_gl_fixed_draw(const nb_gl_fixed_function *fixed, const nebel_gl_frame_desc *desc,
                              const nebel_gl_planes *planes)
{
    nb_fixed_work w = {.fixed = fixed, .desc = desc, .side = find_side(desc->samples)};
    w.width = desc->width * w.side;
    w.height = desc->height * w.side;
    const nebel_result result = draw(&w, planes);
    for (size_t i = 0; w.streams != NULL && i < fixed->scene->mesh_count; i++) free(w.streams[i].data);
    free(w.streams);
    free(w.color);
    free(w.in_scattering);
    free(w.depth);
    free(w.normal);
    free(w.texels);
    nebel_destroy_gl_classic(w.classic);
    return result;
}
