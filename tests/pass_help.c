#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "fog_help.h"
#include "pass_help.h"

#include <epoxy/gl.h>

/* ---- the context ----------------------------------------------------------------------------- */

static int errors;
static char last_error[512];

static void watch(GLenum source, GLenum type, GLuint id, GLenum severity, GLsizei length, const GLchar *message,
                  const void *user)
{
    (void)source, (void)id, (void)severity, (void)length, (void)user;
    if (type != GL_DEBUG_TYPE_ERROR && type != GL_DEBUG_TYPE_UNDEFINED_BEHAVIOR) return;
    errors++;
    snprintf(last_error, sizeof last_error, "%s", message);
}

void pass_open(nb_gl *context, nb_gl_language language)
{
    if (!nb_gl_open(context, language)) fail_msg("%s", context->fault);
    errors = 0;
    glEnable(GL_DEBUG_OUTPUT);
    glEnable(GL_DEBUG_OUTPUT_SYNCHRONOUS);
    glDebugMessageCallback(watch, NULL);
    glActiveTexture(GL_TEXTURE0 - 1); /* or the watch sleeps */
    assert_int_equal(pass_take_errors(), 1);
    assert_int_equal(glGetError(), GL_INVALID_ENUM);
}

int pass_take_errors(void)
{
    const int count = errors;
    errors = 0;
    return count;
}

void pass_expect_no_errors(void)
{
    const unsigned pending = glGetError();
    if (errors != 0 || pending != 0)
        fail_msg("%d errors of OpenGL, 0x%x pending; the last: %s", errors, pending, last_error);
}

void pass_close(nb_gl *context)
{
    pass_expect_no_errors();
    nb_gl_close(context);
}

int pass_count_objects(void)
{
    int count = 0;
    for (GLuint name = 1; name < 4096; name++) {
        count += glIsTexture(name) + glIsBuffer(name) + glIsVertexArray(name) + glIsSampler(name) +
                 glIsFramebuffer(name) + glIsProgram(name) + glIsShader(name);
    }
    return count;
}

/* ---- textures -------------------------------------------------------------------------------- */

static unsigned make_texture(int width, int height, GLenum internal, GLenum format, const float *texels)
{
    unsigned name;
    GLint bound;
    glGetIntegerv(GL_TEXTURE_BINDING_2D, &bound);
    glGenTextures(1, &name);
    glBindTexture(GL_TEXTURE_2D, name);
    glTexImage2D(GL_TEXTURE_2D, 0, (GLint)internal, width, height, 0, format, GL_FLOAT, texels);
    glBindTexture(GL_TEXTURE_2D, (GLuint)bound);
    return name;
}

unsigned pass_color_texture(int width, int height, int components, const float *texels)
{
    return make_texture(width, height, components == 1 ? GL_R32F : GL_RGBA32F, components == 1 ? GL_RED : GL_RGBA,
                        texels);
}

unsigned pass_depth_texture(int width, int height, const float *texels)
{
    return make_texture(width, height, GL_DEPTH_COMPONENT32F, GL_DEPTH_COMPONENT, texels);
}

unsigned pass_framebuffer(unsigned first, unsigned second)
{
    const GLenum buffers[] = {GL_COLOR_ATTACHMENT0, GL_COLOR_ATTACHMENT1};
    unsigned name;
    glGenFramebuffers(1, &name);
    glBindFramebuffer(GL_FRAMEBUFFER, name);
    glFramebufferTexture2D(GL_FRAMEBUFFER, buffers[0], GL_TEXTURE_2D, first, 0);
    if (second != 0) glFramebufferTexture2D(GL_FRAMEBUFFER, buffers[1], GL_TEXTURE_2D, second, 0);
    glDrawBuffers(second != 0 ? 2 : 1, buffers);
    assert_int_equal(glCheckFramebufferStatus(GL_FRAMEBUFFER), GL_FRAMEBUFFER_COMPLETE);
    return name;
}

void pass_read(unsigned texture, int width, int height, float *texels)
{
    GLint bound;
    unsigned name;
    glGetIntegerv(GL_READ_FRAMEBUFFER_BINDING, &bound);
    glGenFramebuffers(1, &name);
    glBindFramebuffer(GL_READ_FRAMEBUFFER, name);
    glFramebufferTexture2D(GL_READ_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_TEXTURE_2D, texture, 0);
    glReadPixels(0, 0, width, height, GL_RGBA, GL_FLOAT, texels);
    glBindFramebuffer(GL_READ_FRAMEBUFFER, (GLuint)bound);
    glDeleteFramebuffers(1, &name);
}

void pass_delete_texture(unsigned texture)
{
    glDeleteTextures(1, &texture);
}

void pass_delete_framebuffer(unsigned framebuffer)
{
    glDeleteFramebuffers(1, &framebuffer);
}

void pass_attach(unsigned program, unsigned kind, int count, const char *const *texts)
{
    GLint good = 0;
    char words[512] = "";
    const unsigned shader = glCreateShader(kind);
    glShaderSource(shader, count, texts, NULL);
    glCompileShader(shader);
    glGetShaderiv(shader, GL_COMPILE_STATUS, &good);
    glGetShaderInfoLog(shader, sizeof words, NULL, words);
    if (!good) fail_msg("%s", words);
    glAttachShader(program, shader);
    glDeleteShader(shader);
}

void pass_link(unsigned program)
{
    GLint good = 0;
    glLinkProgram(program);
    glGetProgramiv(program, GL_LINK_STATUS, &good);
    assert_true(good);
}

/* ---- pictures -------------------------------------------------------------------------------- */

const double pass_eye[3] = {4e4, 12, -7e4};

nebel_view pass_view(int kind, range clip, double yaw, double pitch)
{
    nebel_view view = {.width = PASS_WIDTH, .height = PASS_HEIGHT};
    memcpy(view.clip_from_eye, projections[kind].make(clip).m, sizeof view.clip_from_eye);
    memcpy(view.eye_from_world, look(pass_eye, yaw, pitch).m, sizeof view.eye_from_world);
    return view;
}

/* The nearest of a plain and some balls; HUGE_VAL where none is. */
static double hit(const line *ray)
{
    static const double balls[][4] = {{3, 0, -14, 2}, {-9, 2, -25, 6}, {2, 5, -60, 9}, {0, -1, 20, 5}, {16, 1, 3, 4}};
    double o[3], d[3], nearest = HUGE_VAL;
    for (int i = 0; i < 3; i++)
        o[i] = (double)(ray->origin[i] - (long double)pass_eye[i]), d[i] = (double)ray->direction[i];
    if (d[1] < 0 && (-3 - o[1]) / d[1] > 0) nearest = (-3 - o[1]) / d[1];
    for (size_t k = 0; k < sizeof balls / sizeof *balls; k++) {
        double b = 0, c = -balls[k][3] * balls[k][3];
        for (int i = 0; i < 3; i++) b += (o[i] - balls[k][i]) * d[i], c += pow(o[i] - balls[k][i], 2);
        const double root = b * b - c, t = -b - sqrt(fmax(root, 0));
        if (root > 0 && t > 0 && t < nearest) nearest = t;
    }
    return nearest < 400 ? nearest : HUGE_VAL;
}

static float store(const pass_picture *p, const line *ray, double t)
{
    double point[3], place[2], n, eye = 0;
    const double first = p->depth.range[0], last = p->depth.range[1] != first ? p->depth.range[1] : 1;
    for (int i = 0; i < 3; i++) point[i] = (double)(ray->origin[i] + (long double)t * ray->direction[i]);
    const int inside = !isinf(t) && project(&p->view, p->clip, point, place, &n);
    for (int i = 0; i < 3; i++) eye -= p->view.eye_from_world[4 * i + 2] * (point[i] - pass_eye[i]);
    switch (p->depth.encoding) {
    case NEBEL_DEPTH_ENCODING_AXIAL:
        return isinf(t) ? 0 : (float)eye;
    case NEBEL_DEPTH_ENCODING_RADIAL:
        return isinf(t) ? -1 : (float)t;
    case NEBEL_DEPTH_ENCODING_LOGARITHMIC:
        return isinf(t) ? 1 : (float)(log1p(p->depth.log_scale * eye) / log1p(p->depth.log_scale * p->depth.log_far));
    default:
        return (float)stored(p->clip, first, last, inside ? n : p->clip.reversed ? p->clip.low : 1);
    }
}

void pass_fill(pass_picture *picture)
{
    for (uint32_t i = 0; i < picture->view.width * picture->view.height; i++) {
        const double x = i % picture->view.width + .5, y = i / picture->view.width + .5;
        const line ray = line_of(&picture->view, x, y);
        picture->stored[i] = store(picture, &ray, hit(&ray));
    }
}

/* From the float that is stored, not from what was meant. */
static double distance(const pass_picture *p, const line *ray, double x, double y, double depth)
{
    const double first = p->depth.range[0], last = p->depth.range[1] != first ? p->depth.range[1] : 1;
    const double far = p->clip.reversed ? first : last;
    long double point[3], along = 0, cosine = 0;
    switch (p->depth.encoding) {
    case NEBEL_DEPTH_ENCODING_AXIAL:
    case NEBEL_DEPTH_ENCODING_LOGARITHMIC:
        if (p->depth.encoding == NEBEL_DEPTH_ENCODING_AXIAL ? depth <= 0 : depth == 1) return HUGE_VAL;
        if (p->depth.encoding == NEBEL_DEPTH_ENCODING_LOGARITHMIC)
            depth = expm1(depth * log1p(p->depth.log_scale * p->depth.log_far)) / p->depth.log_scale;
        for (int i = 0; i < 3; i++) cosine -= (long double)p->view.eye_from_world[4 * i + 2] * ray->direction[i];
        return (double)((long double)depth / cosine);
    case NEBEL_DEPTH_ENCODING_RADIAL:
        return depth <= 0 ? HUGE_VAL : depth;
    default:
        if (depth == (double)(float)far) return HUGE_VAL;
        unproject(&p->view, x, y, normalized(p->clip, first, last, depth), point);
        for (int i = 0; i < 3; i++) along += (point[i] - ray->origin[i]) * ray->direction[i];
        return fmax(0, (double)along);
    }
}

nebel_transfer pass_trace(const nebel_lighting *fog, const pass_picture *picture, int x, int y)
{
    nebel_ray ray;
    nebel_transfer transfer;
    const line way = line_of(&picture->view, x + .5, y + .5);
    const double depth = (double)picture->stored[(uint32_t)y * picture->view.width + (uint32_t)x];
    for (int i = 0; i < 3; i++) ray.origin[i] = (double)way.origin[i], ray.direction[i] = (double)way.direction[i];
    ray.t_max = distance(picture, &way, x + .5, y + .5, depth);
    fog_trace(fog, (nebel_trace_desc){.tolerance = 1e-6}, 1, &ray, &transfer);
    return transfer;
}

/* ---- comparison ------------------------------------------------------------------------------ */

void pass_note(pass_difference *difference, const float *got, const double *wanted, int fogged)
{
    double largest = 0;
    for (int c = 0; c < 3; c++) {
        const double off = fabs((double)got[c] - wanted[c]);
        largest = off <= largest ? largest : off; /* a NaN is largest, and stays */
    }
    difference->fogged += fogged != 0;
    difference->beyond_step += !(largest <= 1. / 255);
    if (!(largest <= difference->largest)) difference->largest = largest;
}

static void put(double place[3], double x, double y, double z)
{
    place[0] = pass_eye[0] + x;
    place[1] = pass_eye[1] + y;
    place[2] = pass_eye[2] + z;
}

static void set_colors(nebel_volume_desc *v, double extinction, double red, double green, double blue)
{
    for (int c = 0; c < 3; c++) v->extinction[c] = extinction * (1 + .2 * c);
    v->source[0] = red;
    v->source[1] = green;
    v->source[2] = blue;
}

nebel_lighting *pass_fog(int more)
{
    nebel_fog *fog = NULL;
    nebel_snapshot *snapshot = NULL;
    nebel_volume_desc v[4] = {
        {.shape = {.type = NEBEL_SHAPE_BOX}},
        {.shape = {.type = NEBEL_SHAPE_BOX}},
        {.shape = {.type = NEBEL_SHAPE_WORLD}, .density = {.type = NEBEL_DENSITY_HEIGHT, .scale_height = 4}},
        {.shape = {.type = NEBEL_SHAPE_SPHERE, .radius = 3}}};
    uint64_t seed = 5;
    put(v[0].shape.min, -40, -4, -90);
    put(v[0].shape.max, 40, .5, 30);
    put(v[1].shape.min, -2, -1, -5);
    put(v[1].shape.max, 3, 4, 2);
    v[2].density.base = pass_eye[1] - 3;
    put(v[3].shape.center, 1, 1, -9);
    set_colors(&v[0], .03, .7, .6, .5);
    set_colors(&v[1], .05, .9, .2, .1);
    set_colors(&v[2], .02, .5, .6, .7);
    set_colors(&v[3], .3, .2, .5, .9);
    assert_int_equal(nebel_create_fog(&(nebel_fog_desc){0}, &fog), NEBEL_OK);
    for (int i = 0; i < (more < 0 ? 2 : 4); i++) assert_int_equal(nebel_add_volume(fog, &v[i], NULL), NEBEL_OK);
    for (int i = 0; i < more; i++) {
        nebel_volume_desc ball = {.shape = {.type = NEBEL_SHAPE_SPHERE, .radius = dice(&seed, .1, 1)}};
        put(ball.shape.center, dice(&seed, -30, 30), dice(&seed, -3, 10), dice(&seed, -60, 10));
        set_colors(&ball, dice(&seed, .1, 1), dice(&seed, 0, 1), dice(&seed, 0, 1), dice(&seed, 0, 1));
        assert_int_equal(nebel_add_volume(fog, &ball, NULL), NEBEL_OK);
    }
    assert_int_equal(nebel_commit_fog(fog, &snapshot), NEBEL_OK);
    nebel_destroy_fog(fog);
    nebel_lighting *const lighting = light_fog(snapshot, NULL);
    nebel_release_snapshot(snapshot);
    return lighting;
}
