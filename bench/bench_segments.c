/* Transmittance over many segments from one eye, against the same by the magazine's code and against memory. */
#include "box_fog_scene.h"
#include "groups.h"
#include "scalar_baseline.h"
#include "measure.h"
#include "memory_floor.h"
#include "terrain.h"

#include <nebel/nebel.h>

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { LARGE = 64 << 20 };

static const double eye[3] = {0, 16, 62};

/* The kernel is float throughout, the magazine's code too; they round differently. */
static const float largest_difference = 1e-4f;

static const char out_of_memory[] = "segments: out of memory";
static const char failed[] = "segments: a query failed or gave another result than the magazine's code";

/* Points on the terrain, repeated until there are `count`, with every way to fog them. */
typedef struct nb_field {
    size_t count;
    float *points; /* 3 each, relative to the eye */
    float *found;
    nb_old_vertex *vertices;
    nb_boxes boxes;
    nebel_snapshot *fog;
    int rounds; /* in one measurement */
} nb_field;

typedef struct nb_segment_entry {
    const nb_field *field;
    nebel_isa isa;
} nb_segment_entry;

/* ---- what is fogged -------------------------------------------------------------------------- */

static void copy_points(const nb_terrain *terrain, nb_field *field)
{
    for (size_t first = 0; first < field->count; first += terrain->vertex_count) {
        const size_t left = field->count - first, part = left < terrain->vertex_count ? left : terrain->vertex_count;
        memcpy(field->points + 3 * first, terrain->positions, 3 * sizeof(float) * part);
    }
    for (size_t i = 0; i < field->count && field->vertices != NULL; i++) {
        const float *const p = field->points + 3 * i;
        field->vertices[i] = (nb_old_vertex){.position = {p[0], p[1], p[2]}, .normal = {0, 1, 0}};
    }
    for (size_t i = 0; i < 3 * field->count; i++) field->points[i] -= (float)eye[i % 3];
}

static void free_field(nb_field *field)
{
    nebel_release_snapshot(field->fog);
    free(field->points);
    free(field->found);
    free(field->vertices);
}

/* count 0: the terrain once. */
static int make_field(const nb_terrain *terrain, nb_setting setting, size_t count, int with_vertices, nb_field *field)
{
    field->count = count > 0 ? count : terrain->vertex_count;
    field->points = malloc(3 * sizeof(float) * field->count);
    field->found = malloc(sizeof(float) * field->count);
    if (with_vertices) field->vertices = malloc(sizeof(nb_old_vertex) * field->count);
    if (field->points == NULL || field->found == NULL || (with_vertices && field->vertices == NULL)) return -1;
    nb_boxes_set(setting, &field->boxes);
    copy_points(terrain, field);
    field->fog = nb_boxes_commit(&field->boxes);
    return field->fog != NULL ? 0 : -1;
}

/* ---- contestants ----------------------------------------------------------------------------- */

static double run_kernel(void *user)
{
    const nb_segment_entry *const c = user;
    const nebel_segments segments = {.origin = {eye[0], eye[1], eye[2]}, .to = c->field->points};
    const double start = nb_clock_cpu();
    for (int i = 0; i < c->field->rounds; i++) {
        if (nebel_compute_segment_transmittance(c->field->fog, c->isa, 0, c->field->count, &segments, c->field->found,
                                                0) != NEBEL_OK) {
            return -1;
        }
    }
    return nb_clock_cpu() - start;
}

static double run_magazine(void *user)
{
    const nb_segment_entry *const c = user;
    const nb_old_camera camera = {{(float)eye[0], (float)eye[1], (float)eye[2]}};
    const double start = nb_clock_cpu();
    for (int i = 0; i < c->field->rounds; i++) {
        nb_magazine_fog(&camera, c->field->boxes.list, c->field->boxes.count, c->field->vertices, c->field->count);
    }
    return nb_clock_cpu() - start;
}

static double run_stream(void *user)
{
    const nb_segment_entry *const c = user;
    const double start = nb_clock_cpu();
    for (int i = 0; i < c->field->rounds; i++)
        nb_stream_three_to_one(c->field->points, c->field->found, c->field->count);
    return nb_clock_cpu() - start;
}

/* Both did the same work. */
static int agree(const nb_field *field)
{
    for (size_t i = 0; i < field->count; i++) {
        if (!(fabsf(field->found[i] - field->vertices[i].transmittance) <= largest_difference)) return 0;
    }
    return 1;
}

/* ---- figures --------------------------------------------------------------------------------- */

static double million_per_second(const nb_field *field, double seconds)
{
    return 1e-6 * (double)field->count * field->rounds / seconds;
}

static void add_against_magazine(nb_figures *figures, const nb_segment_entry *entry, const char *setting,
                                 double seconds, double floor)
{
    const nb_field *const field = entry->field;
    nb_figure figure = {.group = "Segments from one eye to the points of a terrain, one thread",
                        .unit = "M segments/s",
                        .value = million_per_second(field, seconds),
                        .floor_name = "the magazine's code",
                        .floor = million_per_second(field, floor)};
    if (entry->isa == NEBEL_ISA_AVX2) figure.at_least = 8;
    (void)snprintf(figure.name, sizeof figure.name, "%s, %s", setting, nebel_isa_name(entry->isa));
    nb_figures_add(figures, &figure);
}

/* The magazine's code and every instruction set in turn. */
static const char *measure_against_magazine(const nb_field *field, const char *setting, int repetitions,
                                            nb_figures *figures)
{
    nb_segment_entry entries[NEBEL_ISA_COUNT];
    nb_contest contests[NEBEL_ISA_COUNT];
    size_t count = 1;
    entries[0] = (nb_segment_entry){.field = field};
    contests[0] = (nb_contest){.run = run_magazine, .user = &entries[0]};
    for (int isa = NEBEL_ISA_SCALAR; isa < NEBEL_ISA_COUNT; isa++) {
        if (!nebel_isa_available((nebel_isa)isa)) continue;
        entries[count] = (nb_segment_entry){field, (nebel_isa)isa};
        contests[count] = (nb_contest){.run = run_kernel, .user = &entries[count]};
        count++;
    }
    if (nb_measure(contests, count, repetitions) != 0 || !agree(field)) return failed;
    for (size_t i = 1; i < count; i++) {
        add_against_magazine(figures, &entries[i], setting, contests[i].seconds, contests[0].seconds);
    }
    return NULL;
}

static void add_against_memory(nb_figures *figures, const nb_segment_entry *entry, const char *name, double seconds,
                               double floor)
{
    const nb_field *const field = entry->field;
    nb_figure figure = {.group = "Segments against memory: 12 bytes in, 4 out, a fog bank, one thread",
                        .unit = "GB/s",
                        .value = 16e-3 * million_per_second(field, seconds),
                        .floor_name = "streaming the bytes",
                        .floor = 16e-3 * million_per_second(field, floor)};
    if (field->count * 3 * sizeof(float) >= LARGE) figure.at_least = .9;
    (void)snprintf(figure.name, sizeof figure.name, "%s, %s", name, nebel_isa_name(entry->isa));
    nb_figures_add(figures, &figure);
}

/* With AVX2 and what is better, where there is either. */
static const char *measure_against_memory(const nb_field *field, int repetitions, nb_figures *figures, const char *name)
{
    nb_segment_entry entries[] = {
        {.field = field}, {field, NEBEL_ISA_AVX2}, {field, NEBEL_ISA_AVX512}, {field, NEBEL_ISA_NEON}};
    nb_contest contests[4] = {{.run = run_stream, .user = &entries[0]}};
    size_t count = 1;
    for (size_t i = 1; i < 4; i++) {
        if (nebel_isa_available(entries[i].isa))
            contests[count++] = (nb_contest){.run = run_kernel, .user = &entries[i]};
    }
    if (nb_measure(contests, count, repetitions) != 0) return failed;
    for (size_t i = 1; i < count; i++) {
        add_against_memory(figures, contests[i].user, name, contests[i].seconds, contests[0].seconds);
    }
    return NULL;
}

static const char *measure_setting(const nb_terrain *terrain, nb_setting setting, const nb_bench_desc *desc,
                                   nb_figures *figures)
{
    nb_field field = {.rounds = desc->quick ? 1 : 8};
    const char *fault = out_of_memory;
    if (make_field(terrain, setting, 0, 1, &field) == 0) {
        fault = measure_against_magazine(&field, nb_setting_names[setting], desc->quick ? 1 : 15, figures);
    }
    free_field(&field);
    return fault;
}

static const char *measure_memory(const nb_terrain *terrain, size_t count, const char *name, const nb_bench_desc *desc,
                                  nb_figures *figures)
{
    nb_field field = {.rounds = desc->quick || count > 0 ? 1 : 16};
    const char *fault = out_of_memory;
    if (make_field(terrain, NB_FOG_BANK, count, 0, &field) == 0) {
        fault = measure_against_memory(&field, desc->quick ? 1 : 15, figures, name);
    }
    free_field(&field);
    return fault;
}

const char *nb_bench_segments(const nb_bench_desc *desc, nb_figures *figures)
{
    nb_terrain terrain;
    if (nb_terrain_make(desc->quick ? 64 : 512, &terrain) != 0) return out_of_memory;
    const char *fault = NULL;
    for (int i = 0; i < NB_SETTINGS && fault == NULL; i++)
        fault = measure_setting(&terrain, (nb_setting)i, desc, figures);
    if (fault == NULL) fault = measure_memory(&terrain, 0, "the terrain's points", desc, figures);
    if (fault == NULL && !desc->quick) {
        fault = measure_memory(&terrain, LARGE / (3 * sizeof(float)) + 1, "64 MiB of points", desc, figures);
    }
    nb_terrain_free(&terrain);
    return fault;
}
