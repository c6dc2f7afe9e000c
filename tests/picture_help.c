#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "picture_help.h"

/* ---- pictures -------------------------------------------------------------------------------- */

static float *make_plane(const picture_pair *pair, size_t channels)
{
    float *const plane = calloc((size_t)pair->width * pair->height * channels, sizeof *plane);
    assert_non_null(plane);
    return plane;
}

static nebel_frame make_frame(const picture_pair *pair)
{
    return (nebel_frame){.color = make_plane(pair, 3),
                         .transmittance = make_plane(pair, 3),
                         .in_scattering = make_plane(pair, 3),
                         .depth = make_plane(pair, 1),
                         .normal = make_plane(pair, 3)};
}

picture_pair picture_make(uint32_t width, uint32_t height)
{
    picture_pair pair = {.width = width, .height = height, .tolerance = 1e-4};
    pair.cpu = make_frame(&pair);
    pair.gl = make_frame(&pair);
    return pair;
}

static void free_frame(nebel_frame *frame)
{
    free(frame->color);
    free(frame->transmittance);
    free(frame->in_scattering);
    free(frame->depth);
    free(frame->normal);
}

void picture_free(picture_pair *pair)
{
    free_frame(&pair->cpu);
    free_frame(&pair->gl);
}

static void write_message(nebel_log_level level, nebel_result result, const char *message, void *user)
{
    (void)level;
    (void)user;
    print_message("%d: %s\n", (int)result, message);
}

static void count_message(nebel_log_level level, nebel_result result, const char *message, void *user)
{
    (void)level;
    ++*(int *)user;
    write_message(level, result, message, NULL);
}

nebel_lighting *picture_commit_scene(const nebel_scene *scene, int with_particles)
{
    nebel_snapshot *snapshot = NULL;
    nebel_lighting *lighting = NULL;
    assert_int_equal((with_particles ? nebel_commit_scene_fog_at : nebel_commit_scene_volumes_at)(scene, 0, &snapshot),
                     NEBEL_OK);
    assert_int_equal(nebel_create_scene_lighting(scene, snapshot, 0, NULL, &lighting), NEBEL_OK);
    nebel_release_snapshot(snapshot);
    return lighting;
}

static void render_cpu(const nebel_scene_data *scene, nebel_lighting *fog, const nebel_camera *camera, uint32_t samples,
                       picture_pair *pair)
{
    nebel_renderer *renderer = NULL;
    const nebel_cpu_renderer_desc desc = {.host.log = {write_message, NULL}};
    const nebel_frame_desc frame = {.camera = *camera,
                                    .width = pair->width,
                                    .height = pair->height,
                                    .samples = samples,
                                    .tolerance = pair->tolerance,
                                    .time = pair->time};
    assert_int_equal(nebel_create_cpu_renderer(scene, fog, &desc, &renderer), NEBEL_OK);
    assert_int_equal(nebel_render_frame(renderer, &frame, &pair->cpu), NEBEL_OK);
    nebel_destroy_renderer(renderer);
}

static void render_gl(const nebel_scene_data *scene, nebel_lighting *fog, const picture_particles *particles,
                      const nebel_camera *camera, uint32_t samples, picture_pair *pair)
{
    nebel_gl_renderer *renderer = NULL;
    const nebel_gl_renderer_desc desc = {.host.log = {count_message, &pair->messages}};
    const nebel_gl_frame_desc frame = {.camera = *camera,
                                       .width = pair->width,
                                       .height = pair->height,
                                       .samples = samples,
                                       .time = pair->time,
                                       .clouds_by_processor = 1,
                                       .particles_leave_sun = particles != NULL && particles->leave_sun};
    const nebel_gl_planes planes = {pair->gl.color, pair->gl.transmittance, pair->gl.in_scattering, pair->gl.depth,
                                    pair->gl.normal};
    assert_int_equal(nebel_create_gl_renderer(scene, fog, &desc, &renderer), NEBEL_OK);
    if (particles != NULL) {
        assert_int_equal(nebel_set_gl_renderer_particles(renderer, particles->list, particles->count), NEBEL_OK);
        assert_int_equal(nebel_set_gl_renderer_lighting(renderer, particles->others), NEBEL_OK);
    }
    assert_int_equal(nebel_gl_render_frame(renderer, &frame), NEBEL_OK);
    assert_int_equal(nebel_gl_read_planes(renderer, &planes), NEBEL_OK);
    nebel_destroy_gl_renderer(renderer);
}

void picture_render_particles(const nebel_scene_data *scene, nebel_lighting *fog, const picture_particles *particles,
                              const nebel_camera *camera, uint32_t samples, picture_pair *pair)
{
    render_cpu(scene, fog, camera, samples, pair);
    render_gl(scene, fog, particles, camera, samples, pair);
}

void picture_render(const nebel_scene_data *scene, nebel_lighting *fog, const nebel_camera *camera, uint32_t samples,
                    picture_pair *pair)
{
    picture_render_particles(scene, fog, NULL, camera, samples, pair);
}

/* ---- differences ----------------------------------------------------------------------------- */

/* No number is farther off than any. */
static double worse(double a, double b)
{
    return isnan(a) || isnan(b) ? HUGE_VAL : fmax(a, b);
}

static double vector_difference(const float *a, const float *b, size_t pixel)
{
    double most = 0;
    for (size_t c = 0; c < 3; c++) most = worse(most, fabs((double)a[3 * pixel + c] - (double)b[3 * pixel + c]));
    return most;
}

static double depth_difference(float a, float b)
{
    if (isinf(a) || isinf(b)) return isinf(a) && isinf(b) ? 0 : 1;
    return fabs((double)a - (double)b) / fmax((double)a, (double)b);
}

static double pixel_difference(const picture_pair *pair, size_t pixel, double source)
{
    const double t = vector_difference(pair->cpu.transmittance, pair->gl.transmittance, pixel);
    const double s = vector_difference(pair->cpu.in_scattering, pair->gl.in_scattering, pixel) / source;
    const double d = depth_difference(pair->cpu.depth[pixel], pair->gl.depth[pixel]);
    return worse(worse(t, s), d);
}

/* Whether depth jumps or bends between two opposite neighbours: on a plane its reciprocal is linear in the picture. */
static int bends(const nebel_frame *frame, size_t before, size_t here, size_t behind)
{
    const double a = 1 / (double)frame->depth[before], b = 1 / (double)frame->depth[here],
                 c = 1 / (double)frame->depth[behind]; /* 0 where nothing is hit */
    return fabs(a - 2 * b + c) > 1. / 255 * fmax(b, fmax(a, c));
}

static int is_silhouette(const picture_pair *pair, uint32_t x, uint32_t y)
{
    const size_t width = pair->width, i = y * width + x;
    const size_t left = x > 0 ? i - 1 : i, right = x + 1 < pair->width ? i + 1 : i;
    const size_t above = y > 0 ? i - width : i, below = y + 1 < pair->height ? i + width : i;
    return bends(&pair->cpu, left, i, right) || bends(&pair->cpu, above, i, below);
}

static int is_fogged(const nebel_frame *frame, size_t pixel)
{
    for (size_t c = 0; c < 3; c++) {
        if (frame->transmittance[3 * pixel + c] < 1 || frame->in_scattering[3 * pixel + c] > 0) return 1;
    }
    return 0;
}

picture_difference picture_compare(const picture_pair *pair, double source)
{
    picture_difference all = {.fogged = 0};
    double squares = 0;
    for (uint32_t y = 0; y < pair->height; y++) {
        for (uint32_t x = 0; x < pair->width; x++) {
            const size_t i = (size_t)y * pair->width + x;
            const double d = pixel_difference(pair, i, source);
            const double color = vector_difference(pair->cpu.color, pair->gl.color, i) / source;
            const int fogged = is_fogged(&pair->cpu, i);
            all.fogged += (size_t)fogged;
            all.beyond_step += fogged && d > 1. / 255 ? 1 : 0;
            squares += color * color;
            if (d <= all.largest || is_silhouette(pair, x, y)) continue;
            all.largest = d;
            all.x = x;
            all.y = y;
        }
    }
    all.color = sqrt(squares / ((double)pair->width * pair->height));
    return all;
}

/* ---- light on surfaces ----------------------------------------------------------------------- */

/* What the surface of a pixel reflects; below 0 where there is none, or where fog hides it. */
static void reflected_light(const nebel_frame *frame, size_t pixel, float light[3])
{
    for (size_t c = 0; c < 3; c++) {
        const size_t i = 3 * pixel + c;
        const int shows = isfinite(frame->depth[pixel]) && frame->transmittance[i] > .05f;
        light[c] = shows ? fmaxf((frame->color[i] - frame->in_scattering[i]) / frame->transmittance[i], 0) : -1;
    }
}

static float srgb_of(float x)
{
    return x <= .0031308f ? 12.92f * x : 1.055f * powf(x, 1 / 2.4f) - .055f;
}

/* Those of all pixels, in sRGB. */
static float *make_light(const picture_pair *pair, const nebel_frame *frame, float white)
{
    const size_t count = 3 * (size_t)pair->width * pair->height;
    float *const light = make_plane(pair, 3);
    for (size_t i = 0; i < count; i += 3) reflected_light(frame, i / 3, light + i);
    for (size_t i = 0; i < count; i++) light[i] = light[i] < 0 ? -1 : srgb_of(light[i] / white);
    return light;
}

static float brightest_surface(const picture_pair *pair)
{
    float white = 1e-6f, light[3];
    for (size_t i = 0; i < (size_t)pair->width * pair->height; i++) {
        reflected_light(&pair->cpu, i, light);
        white = fmaxf(white, fmaxf(light[0], fmaxf(light[1], light[2])));
    }
    return white;
}

static int light_bends(const float *light, size_t before, size_t here, size_t behind)
{
    int bends = 0;
    for (size_t c = 0; c < 3; c++) {
        const float bend = light[3 * before + c] - 2 * light[3 * here + c] + light[3 * behind + c];
        bends |= fabsf(bend) > 2.f / 255;
    }
    return bends;
}

/* Of each pixel whether it is one of a border itself. */
static unsigned char *find_borders(const picture_pair *pair, const float *light)
{
    unsigned char *const border = calloc(pair->height, pair->width);
    assert_non_null(border);
    for (uint32_t y = 0; y < pair->height; y++) {
        for (uint32_t x = 0; x < pair->width; x++) {
            const size_t width = pair->width, i = y * width + x;
            const size_t left = x > 0 ? i - 1 : i, right = x + 1 < pair->width ? i + 1 : i;
            const size_t above = y > 0 ? i - width : i, below = y + 1 < pair->height ? i + width : i;
            border[i] =
                is_silhouette(pair, x, y) || light_bends(light, left, i, right) || light_bends(light, above, i, below);
        }
    }
    return border;
}

static int is_near_border(const picture_pair *pair, const unsigned char *border, uint32_t x, uint32_t y)
{
    const uint32_t x_end = x + 3 < pair->width ? x + 3 : pair->width,
                   y_end = y + 3 < pair->height ? y + 3 : pair->height;
    for (uint32_t v = y > 2 ? y - 2 : 0; v < y_end; v++) {
        for (uint32_t u = x > 2 ? x - 2 : 0; u < x_end; u++) {
            if (border[(size_t)v * pair->width + u]) return 1;
        }
    }
    return 0;
}

picture_light picture_compare_light(const picture_pair *pair)
{
    picture_light all = {.seen = 0};
    const float white = brightest_surface(pair);
    float *const cpu = make_light(pair, &pair->cpu, white), *const gl = make_light(pair, &pair->gl, white);
    unsigned char *const border = find_borders(pair, cpu);
    for (uint32_t y = 0; y < pair->height; y++) {
        for (uint32_t x = 0; x < pair->width; x++) {
            const size_t i = (size_t)y * pair->width + x;
            const double d = vector_difference(cpu, gl, i);
            const int inner = !is_near_border(pair, border, x, y), apart = d > 2. / 255;
            if (fminf(cpu[3 * i], fminf(cpu[3 * i + 1], cpu[3 * i + 2])) < 0) continue;
            all.seen++;
            all.apart += (size_t)apart;
            all.inner += (size_t)inner;
            all.inner_apart += (size_t)(inner && apart);
            if (!inner || d <= all.largest) continue;
            all.largest = d;
            all.x = x;
            all.y = y;
        }
    }
    free(border);
    free(cpu);
    free(gl);
    return all;
}

/* ---- report ---------------------------------------------------------------------------------- */

picture_report picture_report_open(const char *title)
{
    picture_report report = {.folder = getenv("NEBEL_REPORT")};
    char path[1024];
    if (report.folder == NULL) return report;
    snprintf(path, sizeof path, "%s/index.html", report.folder);
    report.page = fopen(path, "w");
    assert_non_null(report.page);
    fprintf(report.page,
            "<!DOCTYPE html>\n<meta charset=\"utf-8\">\n<title>%s</title>\n"
            "<style>body{font:15px sans-serif;margin:2em;background:#222;color:#ddd}td,th{padding:4px;text-align:left;"
            "vertical-align:top}img{display:block;image-rendering:pixelated}</style>\n<h1>%s</h1>\n"
            "<p>Each row: the CPU, OpenGL, and 32 times their difference. Colours are tone mapped; depth d is drawn as "
            "d / (d + 20 m).</p>\n",
            title, title);
    return report;
}

typedef enum report_plane { COLOR, TRANSMITTANCE, IN_SCATTERING, DEPTH, REPORT_PLANES } report_plane;

static const char *const plane_names[REPORT_PLANES] = {"color", "transmittance", "in-scattering", "depth"};

static float report_value(const nebel_frame *frame, report_plane plane, size_t i)
{
    switch (plane) {
    case COLOR:
        return frame->color[i];
    case TRANSMITTANCE:
        return frame->transmittance[i];
    case IN_SCATTERING:
        return frame->in_scattering[i];
    default:
        return isinf(frame->depth[i / 3]) ? 1 : frame->depth[i / 3] / (frame->depth[i / 3] + 20);
    }
}

static void write_picture(const picture_report *report, const picture_pair *pair, const char *file, float *samples)
{
    static const char *const channels[] = {"R", "G", "B"};
    char path[1024];
    const nebel_image image = {pair->width, pair->height, 3, channels, samples};
    const size_t count = 3 * (size_t)pair->width * pair->height;
    for (size_t i = 0; i < count; i++) samples[i] = fminf(fmaxf(samples[i], 0), 1);
    snprintf(path, sizeof path, "%s/%s", report->folder, file);
    assert_int_equal(nebel_write_image(path, &(nebel_host){0}, &image), NEBEL_OK);
    fprintf(report->page, "<td><img src=\"%s\" alt=\"%s\">\n", file, file);
}

static void add_plane(const picture_report *report, const char *name, const picture_pair *pair, report_plane plane)
{
    const size_t pixels = (size_t)pair->width * pair->height;
    const int toned = plane == COLOR || plane == IN_SCATTERING;
    float *const samples = malloc(3 * 3 * pixels * sizeof *samples);
    float *const cpu = samples, *const gl = samples + 3 * pixels, *const difference = samples + 6 * pixels;
    char file[256];
    assert_non_null(samples);
    for (size_t i = 0; i < 3 * pixels; i++) {
        cpu[i] = report_value(&pair->cpu, plane, i);
        gl[i] = report_value(&pair->gl, plane, i);
    }
    if (toned) {
        nebel_tone_map(pixels, cpu, 0, cpu);
        nebel_tone_map(pixels, gl, 0, gl);
    }
    for (size_t i = 0; i < 3 * pixels; i++) difference[i] = 32 * fabsf(cpu[i] - gl[i]);
    fprintf(report->page, "<tr><th>%s\n", plane_names[plane]);
    for (int k = 0; k < 3; k++) {
        snprintf(file, sizeof file, "%s-%s-%d.png", name, plane_names[plane], k);
        write_picture(report, pair, file, samples + 3 * pixels * (size_t)k);
    }
    free(samples);
}

void picture_report_add(const picture_report *report, const char *name, const picture_pair *pair,
                        const picture_difference *difference)
{
    if (report->folder == NULL) return;
    fprintf(report->page,
            "<h2>%s</h2>\n<p>%zu of %zu pixels with fog are more than 1/255 apart; away from silhouettes %.2g/255 at "
            "most, at %u, %u.</p>\n<table>\n",
            name, difference->beyond_step, difference->fogged, 255 * difference->largest, (unsigned)difference->x,
            (unsigned)difference->y);
    for (int plane = 0; plane < REPORT_PLANES; plane++) add_plane(report, name, pair, (report_plane)plane);
    fprintf(report->page, "</table>\n");
}

void picture_report_close(picture_report *report)
{
    if (report->page != NULL) assert_int_equal(fclose(report->page), 0);
    report->page = NULL;
}
double picture_shown_apart(const picture_pair *pair)
{
    const size_t pixels = (size_t)pair->width * pair->height;
    float *const cpu = malloc(3 * pixels * sizeof *cpu), *const gl = malloc(3 * pixels * sizeof *gl);
    size_t apart = 0;
    assert_true(cpu != NULL && gl != NULL);
    nebel_tone_map(pixels, pair->cpu.color, 0, cpu);
    nebel_tone_map(pixels, pair->gl.color, 0, gl);
    for (size_t i = 0; i < pixels; i++) {
        int is = 0;
        for (size_t c = 0; c < 3; c++) is |= !(fabsf(cpu[3 * i + c] - gl[3 * i + c]) <= 2.f / 255);
        apart += (size_t)is;
    }
    free(cpu);
    free(gl);
    return (double)apart / (double)pixels;
}

double picture_largest_light(const picture_pair *pair)
{
    double most = 0;
    for (size_t i = 0; i < 3 * (size_t)pair->width * pair->height; i++)
        most = fmax(most, (double)pair->cpu.in_scattering[i]);
    return most;
}

double picture_fog_apart(const picture_pair *pair)
{
    const double most = picture_largest_light(pair);
    const size_t pixels = (size_t)pair->width * pair->height;
    size_t apart = 0;
    for (size_t i = 0; i < pixels; i++) {
        double is = 0;
        for (size_t c = 3 * i; c < 3 * i + 3; c++)
            is = fmax(is, fmax(fabs((double)pair->cpu.transmittance[c] - (double)pair->gl.transmittance[c]),
                               fabs((double)pair->cpu.in_scattering[c] - (double)pair->gl.in_scattering[c]) / most));
        apart += is > 1. / 255;
    }
    return (double)apart / (double)pixels;
}

double picture_in_scattering_apart(const picture_pair *pair, double most)
{
    const size_t pixels = (size_t)pair->width * pair->height;
    size_t apart = 0;
    for (size_t i = 0; i < pixels; i++) {
        int is = 0;
        for (size_t c = 3 * i; c < 3 * i + 3; c++)
            is |= !(fabs((double)pair->cpu.in_scattering[c] - (double)pair->gl.in_scattering[c]) <= most);
        apart += (size_t)is;
    }
    return (double)apart / (double)pixels;
}

double picture_depth_apart(const picture_pair *pair, double least)
{
    const size_t pixels = (size_t)pair->width * pair->height;
    size_t apart = 0;
    for (size_t i = 0; i < pixels; i++) {
        const double cpu = (double)pair->cpu.depth[i], gl = (double)pair->gl.depth[i];
        apart += isinf(cpu) != isinf(gl) || (!isinf(cpu) && fabs(cpu - gl) > 1e-3 * fmax(cpu, least));
    }
    return (double)apart / (double)pixels;
}
