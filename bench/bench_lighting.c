/* Lights beside fog: a moving sun over very many volumes without a commit, and light by groups in one march. */
#include "groups.h"
#include "measure.h"

#include <nebel/light.h>

#include <math.h>
#include <stdio.h>
#include <stdlib.h>

enum { RAYS = 256 };

static const char out_of_memory[] = "lighting: out of memory";
static const char failed[] = "lighting: a query failed";

typedef struct nb_lit_balls {
    nebel_fog *fog;
    nebel_snapshot *snapshot;
    nebel_lighting *lighting;
    double hour; /* of the sun, so that no two lightings are of the same one */
    const nebel_ray_planes *rays;
    const nebel_transfer_planes *transfers;
} nb_lit_balls;

static nebel_fog *make_balls(int count)
{
    nebel_fog *fog = NULL;
    nebel_result result = nebel_create_fog(&(nebel_fog_desc){0}, &fog);
    for (int i = 0; i < count && result == NEBEL_OK; i++) {
        const double x = fmod(.6180339887 * i, 1), y = fmod(.7548776662 * i, 1), z = fmod(.5698402910 * i, 1);
        const nebel_volume_desc ball = {
            .shape = {.type = NEBEL_SHAPE_SPHERE, .center = {100 * x, 100 * y, 100 * z}, .radius = 1 + z},
            .extinction = {.1, .1 + .1 * x, .2},
            .albedo = {1, .9, .8}};
        result = nebel_add_volume(fog, &ball, NULL);
    }
    if (result == NEBEL_OK) return fog;
    nebel_destroy_fog(fog);
    return NULL;
}

static nebel_lighting_desc light_at(double hour, const nebel_lighting *previous)
{
    return (nebel_lighting_desc){.sun = {.direction = {cos(hour), .5, sin(hour)}, .irradiance = {3, 3, 2}},
                                 .environment = {.radiance = {.2, .3, .4}},
                                 .previous = previous};
}

static double run_commit(void *user)
{
    const nb_lit_balls *const balls = user;
    nebel_snapshot *snapshot = NULL;
    const double start = nb_clock_cpu();
    const nebel_result result = nebel_commit_fog(balls->fog, &snapshot);
    const double seconds = nb_clock_cpu() - start;
    nebel_release_snapshot(snapshot);
    return result == NEBEL_OK ? seconds : -1;
}

static double run_sun(void *user)
{
    nb_lit_balls *const balls = user;
    nebel_lighting *next = NULL;
    balls->hour += .01;
    const nebel_lighting_desc desc = light_at(balls->hour, balls->lighting);
    const double start = nb_clock_cpu();
    const nebel_result result = nebel_create_lighting(balls->snapshot, &desc, &next);
    const double seconds = nb_clock_cpu() - start;
    if (result != NEBEL_OK) return -1;
    nebel_release_lighting(balls->lighting);
    balls->lighting = next;
    return seconds;
}

static double run_rays(void *user)
{
    const nb_lit_balls *const balls = user;
    const nebel_trace_desc desc = {.lighting = balls->lighting};
    const double start = nb_clock_cpu();
    const nebel_result result = nebel_trace_planes(balls->snapshot, &desc, RAYS, balls->rays, balls->transfers);
    return result == NEBEL_OK ? nb_clock_cpu() - start : -1;
}

static int open_balls(int count, nb_lit_balls *balls)
{
    *balls = (nb_lit_balls){.fog = make_balls(count)};
    const nebel_lighting_desc desc = light_at(0, NULL);
    return balls->fog != NULL && nebel_commit_fog(balls->fog, &balls->snapshot) == NEBEL_OK &&
           nebel_create_lighting(balls->snapshot, &desc, &balls->lighting) == NEBEL_OK;
}

static void close_balls(const nb_lit_balls *balls)
{
    nebel_release_lighting(balls->lighting);
    nebel_release_snapshot(balls->snapshot);
    nebel_destroy_fog(balls->fog);
}

static const char *move_sun(nb_figures *figures, int quick)
{
    const int count = quick ? 500 : 10000;
    nb_lit_balls balls;
    const char *fault = open_balls(count, &balls) ? NULL : out_of_memory;
    nb_contest contests[2] = {{.run = run_commit, .user = &balls}, {.run = run_sun, .user = &balls}};
    if (fault == NULL && nb_measure(contests, 2, quick ? 1 : 15) != 0) fault = out_of_memory;
    close_balls(&balls);
    if (fault != NULL) return fault;
    nb_figure figure = {.group = "Lights beside fog, one thread, CPU time",
                        .unit = "ms",
                        .value = 1e3 * contests[1].seconds,
                        .floor_name = "committing the fog",
                        .floor = 1e3 * contests[0].seconds,
                        .at_most = .1};
    (void)snprintf(figure.name, sizeof figure.name, "a new sun over %d balls", count);
    nb_figures_add(figures, &figure);
    return NULL;
}

static const char *trace_groups(nb_figures *figures, int quick)
{
    static float plane[4][3][RAYS], direction[3][RAYS];
    const nebel_ray_planes rays = {.origin = {50, 50, 150},
                                   .direction_float = {direction[0], direction[1], direction[2]}};
    nebel_transfer_planes whole = {.in_scattering = {plane[0][0], plane[0][1], plane[0][2]}};
    nebel_transfer_planes parts = whole;
    for (int g = 0; g < NEBEL_TRANSFER_GROUPS; g++)
        parts.group[g] = (nebel_transfer_group){{plane[1 + g][0], plane[1 + g][1], plane[1 + g][2]}};
    for (int i = 0; i < RAYS; i++) {
        direction[0][i] = .02f * (float)(i % 16) - .15f;
        direction[1][i] = .02f * (float)(i / 16) - .15f;
        direction[2][i] = -1;
    }
    nb_lit_balls balls, by_groups;
    const char *fault = open_balls(quick ? 100 : 2000, &balls) ? NULL : out_of_memory;
    balls.rays = &rays;
    balls.transfers = &whole;
    by_groups = balls;
    by_groups.transfers = &parts;
    nb_contest contests[2] = {{.run = run_rays, .user = &balls}, {.run = run_rays, .user = &by_groups}};
    if (fault == NULL && nb_measure(contests, 2, quick ? 1 : 15) != 0) fault = failed;
    close_balls(&balls);
    if (fault != NULL) return fault;
    const nb_figure figure = {.group = "Lights beside fog, one thread, CPU time",
                              .name = "light of rays by groups",
                              .unit = "us a ray",
                              .value = 1e6 * contests[1].seconds / RAYS,
                              .floor_name = "their sum alone",
                              .floor = 1e6 * contests[0].seconds / RAYS,
                              .at_most = 1.05};
    nb_figures_add(figures, &figure);
    return NULL;
}

const char *nb_bench_lighting(const nb_bench_desc *desc, nb_figures *figures)
{
    const char *fault = move_sun(figures, desc->quick);
    return fault == NULL ? trace_groups(figures, desc->quick) : fault;
}
