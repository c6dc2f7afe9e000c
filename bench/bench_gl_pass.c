/* Fog over a picture in OpenGL, against a pass that reads and writes the same and computes nothing. In the current
 * context. Wall clock around glFinish: software drivers put work off, and their timer queries tell stories. */
#include "groups.h"
#include "measure.h"

#include <epoxy/gl.h>
#include <math.h>
#include <nebel/gl.h>
#include <stdio.h>
#include <stdlib.h>

static const char out_of_memory[] = "opengl: out of memory";
static const char failed[] = "opengl: a pass failed";

enum { GRID = 12 }; /* every so many pixels across and up, coverage is counted */

typedef struct nb_gl_bench {
    nebel_gl *gl;
    nebel_view view;
    unsigned depth, color, target, framebuffer, vertex_array, floor_program;
    int repetitions;
    nb_figures *figures;
    double floor; /* seconds */
} nb_gl_bench;

/* ---- the picture ----------------------------------------------------------------------------- */

/* From (0, 16, 62) to (0, 6, 0), 50 degrees wide, as the benchmark scenes; depth from 0.1 m to 1 km. */
static void set_view(nebel_view *view, uint32_t width, uint32_t height)
{
    const double eye[3] = {0, 16, 62}, nod = atan2(10., 62.), c = cos(nod), s = sin(nod);
    const double wide = 1 / tan(25. / 180 * 3.14159265358979323846), near = .1, far = 1000;
    *view = (nebel_view){.width = width, .height = height};
    const double turn[16] = {1, 0, 0, 0, 0, c, s, 0, 0, -s, c, 0, 0, 0, 0, 1};
    for (int i = 0; i < 16; i++) view->eye_from_world[i] = turn[i];
    for (int i = 0; i < 3; i++) {
        for (int k = 0; k < 3; k++) view->eye_from_world[12 + i] -= turn[4 * k + i] * eye[k];
    }
    view->clip_from_eye[0] = wide;
    view->clip_from_eye[5] = wide * width / height;
    view->clip_from_eye[10] = -(far + near) / (far - near);
    view->clip_from_eye[11] = -1;
    view->clip_from_eye[14] = -2 * far * near / (far - near);
}

/* The way from the eye to 1 m along the axis through the middle of a pixel, in the world. */
static void set_way(const nebel_view *view, uint32_t x, uint32_t y, double way[3])
{
    const double in_eye[3] = {(2 * (x + .5) / view->width - 1) / view->clip_from_eye[0],
                              (2 * (y + .5) / view->height - 1) / view->clip_from_eye[5], -1};
    for (int k = 0; k < 3; k++) {
        way[k] = 0;
        for (int i = 0; i < 3; i++) way[k] += view->eye_from_world[4 * k + i] * in_eye[i];
    }
}

/* Hills around y = 0, as far as 400 m; the sky above. */
static void fill_depth(const nebel_view *view, float *depth)
{
    for (uint32_t y = 0; y < view->height; y++) {
        for (uint32_t x = 0; x < view->width; x++) {
            double way[3];
            set_way(view, x, y, way);
            double along = way[1] < 0 ? -16 / way[1] : 1e9;
            along *= 1 - .05 * (1 + sin(way[0] * along * .2));
            const double z = along < 400 ? (view->clip_from_eye[10] * -along + view->clip_from_eye[14]) / along : 1;
            depth[(size_t)y * view->width + x] = (float)(.5 + .5 * z);
        }
    }
}

static unsigned make_texture(const nebel_view *view, GLenum internal, GLenum format, const float *texels)
{
    unsigned name;
    glGenTextures(1, &name);
    glBindTexture(GL_TEXTURE_2D, name);
    glTexImage2D(GL_TEXTURE_2D, 0, (GLint)internal, (GLsizei)view->width, (GLsizei)view->height, 0, format, GL_FLOAT,
                 texels);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_NEAREST);
    glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, GL_NEAREST);
    return name;
}

static int make_textures(nb_gl_bench *b)
{
    float *const depth = malloc(sizeof *depth * b->view.width * b->view.height);
    if (depth == NULL) return -1;
    fill_depth(&b->view, depth);
    b->depth = make_texture(&b->view, GL_DEPTH_COMPONENT32F, GL_DEPTH_COMPONENT, depth);
    b->color = make_texture(&b->view, GL_RGBA16F, GL_RGBA, NULL);
    b->target = make_texture(&b->view, GL_RGBA16F, GL_RGBA, NULL);
    free(depth);
    glGenFramebuffers(1, &b->framebuffer);
    glBindFramebuffer(GL_FRAMEBUFFER, b->framebuffer);
    glFramebufferTexture2D(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_TEXTURE_2D, b->target, 0);
    return glCheckFramebufferStatus(GL_FRAMEBUFFER) == GL_FRAMEBUFFER_COMPLETE ? 0 : -1;
}

/* ---- the floor ------------------------------------------------------------------------------- */

static const char floor_vertex[] = "#version 330 core\n"
                                   "void main() { gl_Position = vec4(float(gl_VertexID & 1) * 4.0 - 1.0, "
                                   "float(gl_VertexID >> 1) * 4.0 - 1.0, 0.0, 1.0); }\n";
static const char floor_fragment[] = "#version 330 core\n"
                                     "uniform sampler2D depth, color;\n"
                                     "out vec4 result;\n"
                                     "void main()\n"
                                     "{\n"
                                     "    ivec2 texel = ivec2(gl_FragCoord.xy);\n"
                                     "    result = texelFetch(color, texel, 0) + texelFetch(depth, texel, 0).x;\n"
                                     "}\n";

static unsigned compile(GLenum kind, const char *text)
{
    const unsigned shader = glCreateShader(kind);
    glShaderSource(shader, 1, &text, NULL);
    glCompileShader(shader);
    return shader;
}

static int make_floor(nb_gl_bench *b)
{
    const unsigned vertex = compile(GL_VERTEX_SHADER, floor_vertex),
                   fragment = compile(GL_FRAGMENT_SHADER, floor_fragment);
    GLint good = 0;
    b->floor_program = glCreateProgram();
    glAttachShader(b->floor_program, vertex);
    glAttachShader(b->floor_program, fragment);
    glLinkProgram(b->floor_program);
    glGetProgramiv(b->floor_program, GL_LINK_STATUS, &good);
    glDeleteShader(vertex);
    glDeleteShader(fragment);
    glUseProgram(b->floor_program);
    glUniform1i(glGetUniformLocation(b->floor_program, "depth"), 0);
    glUniform1i(glGetUniformLocation(b->floor_program, "color"), 1);
    glGenVertexArrays(1, &b->vertex_array);
    glBindVertexArray(b->vertex_array);
    glActiveTexture(GL_TEXTURE0);
    glBindTexture(GL_TEXTURE_2D, b->depth);
    glActiveTexture(GL_TEXTURE1);
    glBindTexture(GL_TEXTURE_2D, b->color);
    glViewport(0, 0, (GLsizei)b->view.width, (GLsizei)b->view.height);
    return good ? 0 : -1;
}

static double run_floor(void *user)
{
    (void)user;
    glFinish();
    const double start = nb_clock_wall();
    glDrawArrays(GL_TRIANGLES, 0, 3);
    glFinish();
    return nb_clock_wall() - start;
}

static double run_fog(void *user)
{
    const nb_gl_bench *const b = user;
    const nebel_gl_pass pass = {.depth_texture = b->depth, .color_texture = b->color};
    glFinish();
    const double start = nb_clock_wall();
    if (nebel_gl_draw_fog(b->gl, &pass) != NEBEL_OK) return -1;
    glFinish();
    return nb_clock_wall() - start;
}

/* ---- fog ------------------------------------------------------------------------------------- */

/* Volumes, and how many of them the ray of a pixel crosses on average, wherever its surface is. */
typedef struct nb_fog_case {
    const char *name;
    size_t count;
    double radius; /* of the balls; 0: one box, which holds the camera where `around` */
    int around;
    double at_most; /* target of the ratio to the floor */
    double seconds, upload, coverage;
} nb_fog_case;

static double random_number(uint64_t *state)
{
    *state = *state * 6364136223846793005u + 1442695040888963407u;
    return (double)(*state >> 11) * 0x1p-53;
}

/* Between 30 and 90 m from the eye, all over the picture. */
static void place_ball(const nebel_view *view, uint64_t *dice, double radius, nebel_volume_desc *ball)
{
    double way[3];
    const double x = random_number(dice), y = random_number(dice), away = 30 + 60 * random_number(dice);
    set_way(view, (uint32_t)(x * view->width), (uint32_t)(y * view->height), way);
    *ball = (nebel_volume_desc){.shape = {.type = NEBEL_SHAPE_SPHERE,
                                          .center = {way[0] * away, 16 + way[1] * away, 62 + way[2] * away},
                                          .radius = radius},
                                .extinction = {.02, .02, .02},
                                .source = {.6, .65, .7}};
}

static void place_box(int around, nebel_volume_desc *box)
{
    *box = (nebel_volume_desc){.shape = {.type = NEBEL_SHAPE_BOX, .min = {-45, -3, -45}, .max = {45, 3, 45}},
                               .extinction = {.05, .05, .05},
                               .source = {.6, .65, .7}};
    for (int i = 0; i < 3 && around; i++) {
        box->shape.min[i] = -200;
        box->shape.max[i] = 200;
    }
}

static int crosses(const nebel_volume_desc *ball, const double way[3])
{
    double along = 0, square = 0, size = 0;
    for (int i = 0; i < 3; i++) {
        const double to = ball->shape.center[i] - (i == 1 ? 16 : i == 2 ? 62 : 0);
        along += to * way[i];
        square += to * to;
        size += way[i] * way[i];
    }
    return square - along * along / size < ball->shape.radius * ball->shape.radius;
}

/* Of the centre of every GRID-th pixel. */
static double count_coverage(const nebel_view *view, const nebel_volume_desc *balls, size_t count)
{
    size_t met = 0, pixels = 0;
    for (uint32_t y = GRID / 2; y < view->height; y += GRID) {
        for (uint32_t x = GRID / 2; x < view->width; x += GRID) {
            double way[3];
            set_way(view, x, y, way);
            for (size_t i = 0; i < count; i++) met += (size_t)crosses(&balls[i], way);
            pixels++;
        }
    }
    return (double)met / (double)pixels;
}

static nebel_lighting *commit(const nebel_volume_desc *volumes, size_t count)
{
    nebel_fog *fog = NULL;
    nebel_snapshot *snapshot = NULL;
    nebel_lighting *lighting = NULL;
    nebel_result result = nebel_create_fog(&(nebel_fog_desc){0}, &fog);
    for (size_t i = 0; i < count && result == NEBEL_OK; i++) result = nebel_add_volume(fog, &volumes[i], NULL);
    if (result == NEBEL_OK) result = nebel_commit_fog(fog, &snapshot);
    if (result == NEBEL_OK) (void)nebel_create_lighting(snapshot, NULL, &lighting);
    nebel_release_snapshot(snapshot);
    nebel_destroy_fog(fog);
    return lighting;
}

static nebel_lighting *make_fog(const nb_gl_bench *b, nb_fog_case *c)
{
    uint64_t dice = 1;
    nebel_volume_desc *const volumes = calloc(c->count, sizeof *volumes);
    if (volumes == NULL) return NULL;
    for (size_t i = 0; i < c->count; i++) {
        if (c->radius > 0) {
            place_ball(&b->view, &dice, c->radius, &volumes[i]);
        } else {
            place_box(c->around, &volumes[i]);
        }
    }
    if (c->radius > 0) c->coverage = count_coverage(&b->view, volumes, c->count);
    nebel_lighting *const lighting = commit(volumes, c->count);
    free(volumes);
    return lighting;
}

/* ---- figures --------------------------------------------------------------------------------- */

/* From an eye that has moved: what the last call left is of no use. */
static nebel_result set_fog_anew(const nb_gl_bench *b, nebel_lighting *fog, double step)
{
    nebel_view view = b->view;
    view.eye_from_world[12] += step;
    return nebel_gl_set_fog(b->gl, fog, &view);
}

/* Makes the fog of a case and hands it over. */
static const char *hand_over(nb_gl_bench *b, nb_fog_case *c)
{
    nebel_lighting *const fog = make_fog(b, c);
    if (fog == NULL) return out_of_memory;
    const double start = nb_clock_wall();
    nebel_result result = NEBEL_OK;
    for (int i = 0; i < 4 && result == NEBEL_OK; i++) result = set_fog_anew(b, fog, 1e-6 * (3 - i));
    c->upload = (nb_clock_wall() - start) / 4;
    nebel_release_lighting(fog);
    return result == NEBEL_OK ? NULL : failed;
}

/* Fog and floor in turn. */
static const char *measure(nb_gl_bench *b, nb_fog_case *c)
{
    nb_contest contests[] = {{.run = run_floor}, {.run = run_fog, .user = b}};
    const char *const fault = hand_over(b, c);
    if (fault != NULL) return fault;
    if (nb_measure(contests, 2, b->repetitions) != 0) return failed;
    b->floor = contests[0].seconds;
    c->seconds = contests[1].seconds;
    return NULL;
}

static void add(const nb_gl_bench *b, nb_figure figure)
{
    figure.group = "Fog over 1920x1080 in OpenGL: 32-bit depth and 16-bit float color in, 16-bit float out";
    nb_figures_add(b->figures, &figure);
}

static const char *measure_case(nb_gl_bench *b, nb_fog_case *c)
{
    nb_figure figure = {.unit = "ms", .floor_name = "reading and writing alone", .at_most = c->at_most};
    const char *const fault = measure(b, c);
    if (fault != NULL) return fault;
    figure.value = 1e3 * c->seconds;
    figure.floor = 1e3 * b->floor;
    if (c->radius > 0) {
        (void)snprintf(figure.name, sizeof figure.name, "%zu balls of %g m, %.2f a pixel", c->count, c->radius,
                       c->coverage);
    } else {
        (void)snprintf(figure.name, sizeof figure.name, "%s", c->name);
    }
    add(b, figure);
    return NULL;
}

/* What one more ball over every pixel costs, and what a pixel costs with none. */
static void add_slope(const nb_gl_bench *b, const nb_fog_case *few, const nb_fog_case *many)
{
    const double pixels = (double)b->view.width * b->view.height;
    const double slope = (many->seconds - few->seconds) / (many->coverage - few->coverage) / pixels;
    nb_figure figure = {.unit = "ns a pixel", .value = 1e9 * (few->seconds - b->floor) / few->coverage / pixels};
    (void)snprintf(figure.name, sizeof figure.name, "a ball over a pixel, %zu balls", few->count);
    add(b, figure);
    figure.value = 1e9 * (many->seconds - b->floor) / many->coverage / pixels;
    (void)snprintf(figure.name, sizeof figure.name, "a ball over a pixel, %zu balls", many->count);
    add(b, figure);
    figure.value = 1e9 * slope;
    (void)snprintf(figure.name, sizeof figure.name, "a further ball over a pixel");
    add(b, figure);
}

/* Radius at which so many balls cover a pixel on average; coverage grows nearly as its square. */
static int fit_coverage(const nb_gl_bench *b, nb_fog_case *c, double wanted)
{
    c->radius = 12;
    for (int i = 0; i < 8; i++) {
        nebel_lighting *const fog = make_fog(b, c);
        if (fog == NULL) return -1;
        nebel_release_lighting(fog);
        if (fabs(c->coverage / wanted - 1) < 1e-3) break;
        c->radius *= sqrt(wanted / c->coverage);
    }
    return 0;
}

enum { GROWTH = 4 };

static void add_growth(const nb_gl_bench *b, const nb_fog_case cases[GROWTH])
{
    for (int i = 0; i < GROWTH; i++) {
        nb_figure figure = {.unit = "ms", .value = 1e3 * cases[i].seconds};
        (void)snprintf(figure.name, sizeof figure.name, "%zu balls, %.2f a pixel", cases[i].count, cases[i].coverage);
        if (i > 0) {
            figure.floor_name = "10 balls";
            figure.floor = 1e3 * cases[0].seconds;
            figure.at_most = (double)cases[i].count / (double)cases[0].count;
        }
        add(b, figure);
        figure = (nb_figure){.unit = "ms", .value = 1e3 * cases[i].upload};
        (void)snprintf(figure.name, sizeof figure.name, "handing over %zu balls", cases[i].count);
        add(b, figure);
    }
}

/* Each case has a nebel_gl of its own, so that they can take turns. */
static const char *run_growth(const nb_gl_bench *b, nb_gl_bench benches[GROWTH], nb_fog_case cases[GROWTH])
{
    nb_contest contests[GROWTH] = {{0}};
    for (int i = 0; i < GROWTH; i++) {
        benches[i] = *b;
        benches[i].gl = NULL;
        if (fit_coverage(b, &cases[i], 3.5) != 0) return out_of_memory;
        if (nebel_create_gl(&(nebel_gl_desc){0}, &benches[i].gl) != NEBEL_OK) return failed;
        const char *const fault = hand_over(&benches[i], &cases[i]);
        if (fault != NULL) return fault;
        contests[i] = (nb_contest){.run = run_fog, .user = &benches[i]};
    }
    if (nb_measure(contests, GROWTH, b->repetitions) != 0) return failed;
    for (int i = 0; i < GROWTH; i++) cases[i].seconds = contests[i].seconds;
    return NULL;
}

/* The same coverage by ever more and smaller balls: what grows is the number alone. */
static const char *measure_growth(nb_gl_bench *b)
{
    nb_fog_case cases[GROWTH] = {{.count = 10}, {.count = 100}, {.count = 1000}, {.count = 10000}};
    nb_gl_bench benches[GROWTH] = {{0}};
    const char *const fault = run_growth(b, benches, cases);
    for (int i = 0; i < GROWTH; i++) nebel_destroy_gl(benches[i].gl);
    if (fault == NULL) add_growth(b, cases);
    return fault;
}

static const char *measure_all(nb_gl_bench *b)
{
    nb_fog_case boxes[] = {{.name = "a box of fog in view", .count = 1, .at_most = 3},
                           {.name = "a box of fog around the camera", .count = 1, .around = 1, .at_most = 3}};
    nb_fog_case few = {.count = 16, .radius = 6}, many = {.count = 1000, .radius = 6};
    const char *fault = NULL;
    for (int i = 0; i < 2 && fault == NULL; i++) fault = measure_case(b, &boxes[i]);
    if (fault == NULL) fault = measure_case(b, &few);
    if (fault == NULL) fault = measure_case(b, &many);
    if (fault != NULL) return fault;
    add_slope(b, &few, &many);
    return measure_growth(b);
}

static void delete_all(nb_gl_bench *b)
{
    const GLuint textures[] = {b->depth, b->color, b->target};
    nebel_destroy_gl(b->gl);
    glDeleteTextures(3, textures);
    glDeleteFramebuffers(1, &b->framebuffer);
    glDeleteVertexArrays(1, &b->vertex_array);
    glDeleteProgram(b->floor_program);
}

const char *nb_bench_opengl_pass(const nb_bench_desc *desc, nb_figures *figures)
{
    nb_gl_bench b = {.repetitions = desc->quick ? 1 : 7, .figures = figures};
    const char *fault = failed;
    set_view(&b.view, desc->quick ? 240 : 1920, desc->quick ? 135 : 1080);
    if (nebel_create_gl(&(nebel_gl_desc){0}, &b.gl) == NEBEL_OK && make_textures(&b) == 0 && make_floor(&b) == 0) {
        fault = measure_all(&b);
    }
    delete_all(&b);
    return fault;
}
