#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "classic_help.h"
#include "fog_help.h"

#include <epoxy/gl.h>

void classic_open(nb_gl *context, nb_gl_language language)
{
    if (!nb_gl_open(context, language)) {
        if (getenv("CI") != NULL) fail_msg("%s", context->fault);
        print_message("left out: no such OpenGL: %s\n", context->fault);
        skip();
    }
    nb_gl_close(context);
    pass_open(context, language);
}

/* ---- the target ------------------------------------------------------------------------------ */

classic_target classic_make_target(unsigned internal_format)
{
    classic_target t = {.framebuffer = 0};
    glGenTextures(1, &t.color);
    glBindTexture(GL_TEXTURE_2D, t.color);
    glTexImage2D(GL_TEXTURE_2D, 0, (GLint)internal_format, CLASSIC_SIZE, CLASSIC_SIZE, 0, GL_RGBA,
                 internal_format == GL_RGBA8 ? GL_UNSIGNED_BYTE : GL_FLOAT, NULL);
    glBindTexture(GL_TEXTURE_2D, 0);
    glGenFramebuffers(1, &t.framebuffer); /* without draw buffers, which old contexts lack */
    glBindFramebuffer(GL_FRAMEBUFFER, t.framebuffer);
    glFramebufferTexture2D(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_TEXTURE_2D, t.color, 0);
    glGenRenderbuffers(1, &t.depth);
    glBindRenderbuffer(GL_RENDERBUFFER, t.depth);
    glRenderbufferStorage(GL_RENDERBUFFER, GL_DEPTH_COMPONENT24, CLASSIC_SIZE, CLASSIC_SIZE);
    glFramebufferRenderbuffer(GL_FRAMEBUFFER, GL_DEPTH_ATTACHMENT, GL_RENDERBUFFER, t.depth);
    assert_int_equal(glCheckFramebufferStatus(GL_FRAMEBUFFER), GL_FRAMEBUFFER_COMPLETE);
    glViewport(0, 0, CLASSIC_SIZE, CLASSIC_SIZE);
    glDisable(GL_DITHER);
    glEnable(GL_DEPTH_TEST);
    return t;
}

void classic_delete_target(const classic_target *target)
{
    pass_delete_framebuffer(target->framebuffer);
    pass_delete_texture(target->color);
    glDeleteRenderbuffers(1, &target->depth);
}

void classic_clear(void)
{
    glClearColor(.125f, .25f, .5f, .75f);
    glClear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
}

void classic_read(classic_image *image)
{
    glReadPixels(0, 0, CLASSIC_SIZE, CLASSIC_SIZE, GL_RGBA, GL_FLOAT, image->texels);
}

static double compare(const classic_image *a, const classic_image *b, int first, int count)
{
    double largest = 0;
    for (int i = 0; i < CLASSIC_PIXELS; i++) {
        for (int c = first; c < first + count; c++) {
            const double off = fabs((double)a->texels[i][c] - (double)b->texels[i][c]);
            largest = off <= largest ? largest : off; /* a NaN is largest, and stays */
        }
    }
    return largest;
}

double classic_compare(const classic_image *a, const classic_image *b)
{
    return compare(a, b, 0, 3);
}

double classic_compare_alpha(const classic_image *a, const classic_image *b)
{
    return compare(a, b, 3, 1);
}

/* ---- the mesh -------------------------------------------------------------------------------- */

const double classic_color[3] = {.5, .625, .75};
const float classic_color_float[3] = {.5f, .625f, .75f};

/* Rows go from behind the camera over the ground and up the wall. */
static void place_vertex(classic_vertex *v, int column, int row)
{
    const double s = (double)column / (CLASSIC_COLUMNS - 1), t = (double)row / (CLASSIC_ROWS - 1);
    const double z = t < .75 ? 6 - 50 * t : -31.5 - 4 * (t - .75);
    const double y = t < .75 ? .3 * sin(9 * s) : .3 * sin(9 * s) + 400 * (t - .75);
    const double x = 120 * (s - .5);
    v->place[0] = (float)x;
    v->place[1] = (float)y;
    v->place[2] = (float)z;
    v->normal[1] = t < .75 ? 1 : 0;
    v->normal[2] = t < .75 ? 0 : 1;
    v->uv[0] = (float)(60 * s);
    v->uv[1] = (float)(20 * t);
    for (int c = 0; c < 3; c++) v->color[c] = (float)(.5 + .5 * sin(3 * c + 11 * s + 7 * t));
    v->color[3] = 1;
    memcpy(v->alpha, (const uint8_t[4]){128, 159, 191, 0}, sizeof v->alpha);
}

static void list_triangles(uint16_t *indices)
{
    for (int row = 0; row + 1 < CLASSIC_ROWS; row++) {
        for (int column = 0; column + 1 < CLASSIC_COLUMNS; column++) {
            const int corner = row * CLASSIC_COLUMNS + column, above = corner + CLASSIC_COLUMNS;
            const int corners[6] = {corner, corner + 1, above, above, corner + 1, above + 1};
            for (int i = 0; i < 6; i++) *indices++ = (uint16_t)corners[i];
        }
    }
}

/* A box, and a ball within and beside it. */
static nebel_snapshot *commit_fog(void)
{
    const nebel_volume_desc volumes[] = {
        {.shape = {.type = NEBEL_SHAPE_BOX, .min = {-14, -1, -40}, .max = {9, 5, -6}}, .extinction = {.06, .06, .06}},
        {.shape = {.type = NEBEL_SHAPE_SPHERE, .center = {8, 2, -18}, .radius = 7}, .extinction = {.2, .2, .2}},
    };
    return fog_commit(&(nebel_fog_desc){0}, volumes, 2);
}

static void fog_mesh(classic_mesh *mesh)
{
    classic_vertex *const v = mesh->vertices;
    nebel_snapshot *const fog = commit_fog();
    nebel_vertices points = {.positions = v[0].place, .position_stride = sizeof *v};
    assert_int_equal(nebel_compute_object_eye(mesh->eye_from_object.m, points.eye), NEBEL_OK);
    const nebel_vertex_output outputs[] = {{NEBEL_VERTEX_COORDINATE, &v[0].coordinate, sizeof *v},
                                           {NEBEL_VERTEX_RGBA_FLOAT, v[0].light, sizeof *v},
                                           {NEBEL_VERTEX_RGBA8, v[0].bytes, sizeof *v},
                                           {NEBEL_VERTEX_ALPHA, v[0].alpha, sizeof *v}};
    assert_int_equal(nebel_compute_vertex_fog(fog, &(nebel_vertex_desc){.color = classic_color}, CLASSIC_VERTICES,
                                              &points, outputs, sizeof outputs / sizeof *outputs),
                     NEBEL_OK);
    nebel_release_snapshot(fog);
}

void classic_make_mesh(classic_mesh *mesh)
{
    memset(mesh, 0, sizeof *mesh);
    for (int i = 0; i < CLASSIC_VERTICES; i++)
        place_vertex(&mesh->vertices[i], i % CLASSIC_COLUMNS, i / CLASSIC_COLUMNS);
    list_triangles(mesh->indices);
    mesh->eye_from_object = look((const double[3]){1, 3, 2}, .2, -.15);
    mesh->clip_from_eye = frustum((range){-1, 0}, -.5, .5, -.5, .5, .5, 200);
    fog_mesh(mesh);
}

void classic_start(classic_stage *stage, nb_gl_language language, unsigned internal_format, classic_mesh *mesh)
{
    classic_open(&stage->context, language);
    stage->target = classic_make_target(internal_format);
    classic_make_mesh(mesh);
}

void classic_end(classic_stage *stage)
{
    classic_delete_target(&stage->target);
    pass_close(&stage->context);
}

/* ---- the fixed pipeline ---------------------------------------------------------------------- */

void classic_set_mesh(const classic_mesh *mesh)
{
    glMatrixMode(GL_PROJECTION);
    glLoadMatrixd(mesh->clip_from_eye.m);
    glMatrixMode(GL_MODELVIEW);
    glLoadMatrixd(mesh->eye_from_object.m);
    glEnableClientState(GL_VERTEX_ARRAY);
    glVertexPointer(3, GL_FLOAT, sizeof *mesh->vertices, mesh->vertices[0].place);
}

void classic_draw_positions(const classic_mesh *mesh)
{
    glDrawElements(GL_TRIANGLES, CLASSIC_INDICES, GL_UNSIGNED_SHORT, mesh->indices);
}

void classic_draw_plain(const classic_mesh *mesh)
{
    glEnableClientState(GL_COLOR_ARRAY);
    glColorPointer(4, GL_FLOAT, sizeof *mesh->vertices, mesh->vertices[0].color);
    classic_draw_positions(mesh);
    glDisableClientState(GL_COLOR_ARRAY);
}

static unsigned make_texture(void)
{
    static const uint8_t texels[4][4] = {{255, 200, 150, 255}, {90, 255, 60, 255}, {10, 80, 255, 255}, {0, 0, 0, 0}};
    unsigned name;
    glGenTextures(1, &name);
    glBindTexture(GL_TEXTURE_2D, name);
    glTexImage2D(GL_TEXTURE_2D, 0, GL_RGBA8, 2, 2, 0, GL_RGBA, GL_UNSIGNED_BYTE, texels);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_NEAREST);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, GL_NEAREST);
    return name;
}

/* The holes are a quarter of the texture. */
static void set_rich_state(void)
{
    const GLfloat sun[4] = {.3f, .8f, .5f, 0};
    glEnable(GL_LIGHTING);
    glEnable(GL_LIGHT0);
    glLightfv(GL_LIGHT0, GL_POSITION, sun);
    glEnable(GL_COLOR_MATERIAL);
    glEnable(GL_TEXTURE_2D);
    glEnable(GL_ALPHA_TEST);
    glAlphaFunc(GL_GREATER, .5f);
    glShadeModel(GL_SMOOTH);
}

void classic_draw_rich(const classic_mesh *mesh)
{
    const unsigned texture = make_texture();
    set_rich_state();
    glEnableClientState(GL_NORMAL_ARRAY);
    glNormalPointer(GL_FLOAT, sizeof *mesh->vertices, mesh->vertices[0].normal);
    glEnableClientState(GL_TEXTURE_COORD_ARRAY);
    glTexCoordPointer(2, GL_FLOAT, sizeof *mesh->vertices, mesh->vertices[0].uv);
    classic_draw_plain(mesh);
    glDeleteTextures(1, &texture);
}

nebel_vertex_output classic_stream(classic_mesh *mesh, nebel_vertex_format format)
{
    classic_vertex *const v = mesh->vertices;
    void *const data = format == NEBEL_VERTEX_COORDINATE   ? (void *)&v->coordinate
                       : format == NEBEL_VERTEX_RGBA_FLOAT ? (void *)v->light
                       : format == NEBEL_VERTEX_RGBA8      ? (void *)v->bytes
                                                           : (void *)v->alpha;
    return (nebel_vertex_output){format, data, sizeof *v};
}

nebel_gl_classic *classic_create(nebel_gl_classic_kind kind)
{
    nebel_gl_classic *classic = NULL;
    assert_int_equal(nebel_create_gl_classic(&(nebel_gl_classic_desc){.kind = kind}, &classic), NEBEL_OK);
    return classic;
}

void classic_draw(nebel_gl_classic_kind kind, classic_mesh *mesh, nebel_vertex_format format, int rich)
{
    const nebel_vertex_output stream = classic_stream(mesh, format);
    const int one_pass = kind == NEBEL_GL_CLASSIC_FOG_COORD;
    void (*const draw)(const classic_mesh *) = rich ? classic_draw_rich : classic_draw_plain;
    nebel_gl_classic *const classic = classic_create(kind);
    assert_int_equal(nebel_gl_get_classic_method(classic), kind);
    classic_clear();
    classic_set_mesh(mesh);
    if (!one_pass) draw(mesh);
    assert_int_equal(nebel_gl_begin_classic_fog(classic, classic_color_float), NEBEL_OK);
    assert_int_equal(nebel_gl_bind_classic_stream(classic, &stream, 0), NEBEL_OK);
    if (one_pass) draw(mesh);
    if (!one_pass) classic_draw_positions(mesh);
    assert_int_equal(nebel_gl_end_classic_fog(classic), NEBEL_OK);
    nebel_destroy_gl_classic(classic);
}
