/* Very many volumes over each other on one ray, and endless ones: how the cost of a ray grows with them. */
#include "groups.h"
#include "measure.h"

#include <nebel/light.h>

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

enum { RAYS = 16, MOST_ENDLESS = 4 };

typedef struct nb_question {
    nebel_snapshot *fog;
    nebel_precision precision;
    int repetitions; /* in one run, so that it is long enough to be measured */
    int transmittance_only;
    const nebel_lighting *lighting; /* of the fog; NULL: none */
} nb_question;

static double run_rays(void *user)
{
    const nb_question *const question = user;
    const nebel_trace_desc desc = {.lighting = question->lighting,
                                   .precision = question->precision,
                                   .transmittance_only = question->transmittance_only};
    nebel_ray rays[RAYS];
    nebel_transfer transfers[RAYS];
    for (int i = 0; i < RAYS; i++)
        rays[i] = (nebel_ray){{0, 1.7, 0}, {.02 * (i % 4) - .03, .02 * (i / 4) - .03, -1}, HUGE_VAL};
    const double start = nb_clock_cpu();
    for (int i = 0; i < question->repetitions; i++)
        if (nebel_trace(question->fog, &desc, RAYS, rays, sizeof rays[0], transfers, sizeof transfers[0]) != NEBEL_OK)
            return -1;
    return (nb_clock_cpu() - start) / (RAYS * question->repetitions);
}

/* Balls of different sizes and colours that every ray meets, together of optical depth 2 or so; `power` 0: of constant
 * density. */
static nebel_volume_desc ball(int i, int count, int power)
{
    const double share = fmod(.6180339887 * i, 1), amount = .1 / count;
    return (nebel_volume_desc){
        .shape = {.type = NEBEL_SHAPE_SPHERE, .center = {share, 1, -20 - 2 * share}, .radius = 8 + 4 * share},
        .density = {.type = power > 0 ? NEBEL_DENSITY_RADIAL : NEBEL_DENSITY_CONSTANT, .power = power},
        .extinction = {amount, amount, amount * (1 + share)},
        .source = {share, 1 - share, .5}};
}

static nebel_volume_desc endless(int i)
{
    static const double colors[MOST_ENDLESS][3] = {{.7, .7, .8}, {.7, .6, .5}, {.2, .6, .9}, {.3, .3, .3}};
    nebel_volume_desc volume = {.extinction = {.02, .02, .02}, .source = {colors[i][0], colors[i][1], colors[i][2]}};
    if (i % 2 == 1)
        volume.density = (nebel_density){.type = NEBEL_DENSITY_HEIGHT, .base = i - 1, .scale_height = 2 + 2 * i};
    if (i == 2) volume.density = (nebel_density){.type = NEBEL_DENSITY_GAUSSIAN, .center = {0, 1, -10}, .sigma = 5};
    return volume;
}

/* `power` below 0: endless volumes. */
static nebel_snapshot *commit(int count, int power)
{
    nebel_fog *fog = NULL;
    nebel_snapshot *snapshot = NULL;
    nebel_result result = nebel_create_fog(&(nebel_fog_desc){0}, &fog);
    for (int i = 0; i < count && result == NEBEL_OK; i++) {
        const nebel_volume_desc volume = power < 0 ? endless(i) : ball(i, count, power);
        result = nebel_add_volume(fog, &volume, NULL);
    }
    if (result == NEBEL_OK) (void)nebel_commit_fog(fog, &snapshot);
    nebel_destroy_fog(fog);
    return snapshot;
}

/* Balls that sun or point lights light: all over each other, or scattered so that a ray meets some thirty. */
static nebel_volume_desc lit_ball(int i, int count, int is_scattered)
{
    const double x = fmod(.6180339887 * i, 1), y = fmod(.7548776662 * i, 1), z = fmod(.5698402910 * i, 1);
    const double size = is_scattered ? 28 : 10, radius = is_scattered ? size * sqrt(30 / (3.14159265 * count)) : 5;
    const double amount = is_scattered ? .03 : 1. / (5 * count);
    return (nebel_volume_desc){.shape = {.type = NEBEL_SHAPE_SPHERE,
                                         .center = {size * (x - .5), size * (y - .5) + 1.7, size * (z - .5) - 20},
                                         .radius = radius * (.7 + .6 * z)},
                               .extinction = {amount, amount * (.5 + x), amount * (.5 + y)},
                               .albedo = {1, .9, .8}};
}

static nebel_lighting *commit_lit(int count, int is_scattered, int lights)
{
    const nebel_light around[2] = {{.position = {3, 5, -18}, .intensity = {40, 40, 30}, .radius = .2},
                                   {.position = {-4, -1, -23}, .intensity = {30, 40, 40}, .radius = .2}};
    nebel_lighting_desc desc = {.sun = {.direction = {.6, .64, .48}}, .lights = around, .light_count = (size_t)lights};
    nebel_fog *fog = NULL;
    nebel_snapshot *snapshot = NULL;
    nebel_lighting *lighting = NULL;
    for (int c = 0; c < 3 && lights == 0; c++) desc.sun.irradiance[c] = 1;
    nebel_result result = nebel_create_fog(&(nebel_fog_desc){0}, &fog);
    for (int i = 0; i < count && result == NEBEL_OK; i++) {
        const nebel_volume_desc volume = lit_ball(i, count, is_scattered);
        result = nebel_add_volume(fog, &volume, NULL);
    }
    if (result == NEBEL_OK) result = nebel_commit_fog(fog, &snapshot);
    if (result == NEBEL_OK) (void)nebel_create_lighting(snapshot, &desc, &lighting);
    nebel_release_snapshot(snapshot);
    nebel_destroy_fog(fog);
    return lighting;
}

/* A lit crowd beside the same rays through it without light. */
static int add_crowd(nb_figures *figures, int count, int is_scattered, int lights, int quick)
{
    nebel_lighting *const lighting = commit_lit(count, is_scattered, lights);
    nb_question lit = {.fog = nebel_get_lighting_snapshot(lighting),
                       .lighting = lighting,
                       .precision = NEBEL_PRECISION_FLOAT,
                       .repetitions = quick ? 1 : 10};
    nb_question dark = lit;
    dark.transmittance_only = 1;
    nb_contest contests[2] = {{.run = run_rays, .user = &dark}, {.run = run_rays, .user = &lit}};
    const int fault = lit.fog == NULL || nb_measure(contests, 2, quick ? 1 : 5) != 0;
    nebel_release_lighting(lighting);
    if (fault) return -1;
    nb_figure figure = {.group = "Overlapping lit balls of constant density on one ray, float, one thread, CPU time",
                        .unit = "us a ray",
                        .value = 1e6 * contests[1].seconds,
                        .floor_name = "transmittance alone",
                        .floor = 1e6 * contests[0].seconds};
    (void)snprintf(figure.name, sizeof figure.name, "%d balls %s, %s", count,
                   is_scattered ? "scattered" : "in one place", lights > 0 ? "two point lights" : "sun");
    nb_figures_add(figures, &figure);
    return 0;
}

static int add_crowds(nb_figures *figures, int quick)
{
    int fault = 0;
    for (int lights = 0; lights <= 2 && fault == 0; lights += 2) {
        for (int n = 10; n <= (quick ? 40 : 320) && fault == 0; n *= 2) fault = add_crowd(figures, n, 0, lights, quick);
        if (fault == 0) fault = add_crowd(figures, quick ? 100 : 1000, 1, lights, quick);
    }
    return fault;
}

/* One line: a ray through `count` volumes. */
static int add_line(nb_figures *figures, const char *what, int count, int power, nebel_precision precision, int quick)
{
    nb_question question = {commit(count, power), precision, quick || count > 100 ? 1 : 100, 0, NULL};
    nb_contest contest = {.run = run_rays, .user = &question};
    const int fault = question.fog == NULL || nb_measure(&contest, 1, quick ? 1 : 5) != 0;
    nebel_release_snapshot(question.fog);
    if (fault) return -1;
    nb_figure figure = {.group = "Volumes over each other on one ray, one thread, CPU time",
                        .unit = "us a ray",
                        .value = 1e6 * contest.seconds};
    (void)snprintf(figure.name, sizeof figure.name, "%d %s, %s", count, what,
                   precision == NEBEL_PRECISION_FLOAT ? "float" : "double");
    nb_figures_add(figures, &figure);
    return 0;
}

const char *nb_bench_overlap(const nb_bench_desc *desc, nb_figures *figures)
{
    int fault = 0;
    for (int precision = NEBEL_PRECISION_DOUBLE; precision <= NEBEL_PRECISION_FLOAT && fault == 0; precision++) {
        const nebel_precision p = (nebel_precision)precision;
        for (int n = 1; n <= MOST_ENDLESS && fault == 0; n++)
            fault = add_line(figures, "endless volumes of different light", n, -1, p, desc->quick);
        for (int n = 10; n <= (desc->quick ? 100 : 10000) && fault == 0; n *= 10)
            fault = add_line(figures, "balls of constant density", n, 0, p, desc->quick);
        for (int n = 10; n <= (desc->quick ? 20 : 40) && fault == 0; n *= 2)
            fault = add_line(figures, "balls of different density", n, 2, p, desc->quick);
    }
    if (fault == 0) fault = add_crowds(figures, desc->quick);
    return fault == 0 ? NULL : "overlap: out of memory";
}
