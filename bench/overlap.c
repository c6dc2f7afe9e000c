/* Very many volumes over each other on one ray, and endless ones: how the cost of a ray grows with them. */
#include "groups.h"
#include "measure.h"

#include <nebel/nebel.h>

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

enum { RAYS = 16, MOST_ENDLESS = 4 };

typedef struct nb_question {
    nebel_snapshot *fog;
    nebel_precision precision;
    int repetitions; /* in one run, so that it is long enough to be measured */
} nb_question;

static double run_rays(void *user)
{
    const nb_question *const question = user;
    const nebel_trace_desc desc = {.precision = question->precision};
    nebel_ray rays[RAYS];
    nebel_light lights[RAYS];
    for (int i = 0; i < RAYS; i++)
        rays[i] = (nebel_ray){{0, 1.7, 0}, {.02 * (i % 4) - .03, .02 * (i / 4) - .03, -1}, HUGE_VAL};
    const double start = nb_clock_cpu();
    for (int i = 0; i < question->repetitions; i++)
        if (nebel_trace(question->fog, &desc, RAYS, rays, sizeof rays[0], lights, sizeof lights[0]) != NEBEL_OK)
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

/* One line: a ray through `count` volumes. */
static int add_line(nb_figures *figures, const char *what, int count, int power, nebel_precision precision, int quick)
{
    nb_question question = {commit(count, power), precision, quick || count > 100 ? 1 : 100};
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
    return fault == 0 ? NULL : "overlap: out of memory";
}
