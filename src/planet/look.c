/* Rays through a table of air, and the ground that they meet. */
#include "view.h"

#include "base/vector.h"

#include <math.h>

/* What is told at least, as a part of the brightest light in the table: rays that are short and steep share few rows. */
#define LEAST_OFF 2e-4

/* A ray in the terms of the table. */
typedef struct nb_look {
    double along; /* m in the air; 0: none, and the rest means nothing */
    double sun;   /* cosine of the angle to it */
    int row, column, level;
    float row_part, column_part, level_part;
} nb_look;

static float part_of(double place, int count, int *first)
{
    *first = place < count - 2 ? (int)place : count - 2;
    return (float)(place - *first);
}

/* A direction as the view's place has it, of length 1. */
typedef struct nb_bearing {
    double up, ahead, aside, level; /* level: what is not up */
} nb_bearing;

static int find_bearing(const nebel_air_view *view, double x, double y, double z, nb_bearing *bearing)
{
    const double square = x * x + y * y + z * z;
    if (!(square > 0 && square < HUGE_VAL)) return 0;
    const double per = 1 / sqrt(square);
    bearing->up = per * (x * view->up[0] + y * view->up[1] + z * view->up[2]);
    bearing->ahead = per * (x * view->ahead[0] + y * view->ahead[1] + z * view->ahead[2]);
    bearing->aside = per * (x * view->aside[0] + y * view->aside[1] + z * view->aside[2]);
    bearing->level = sqrt(bearing->ahead * bearing->ahead + bearing->aside * bearing->aside);
    return 1;
}

/* The cosine of the angle between a direction and the sun. */
static double sun_along(const nebel_air_view *view, const nb_bearing *bearing)
{
    return nb_larger(-1, nb_smaller(1, bearing->up * view->sun_slope.cosine + bearing->ahead * view->sun_slope.sine));
}

static nb_look look_along(const nebel_air_view *view, double x, double y, double z, double t_max)
{
    nb_look look = {.along = 0};
    nb_bearing bearing;
    if (!find_bearing(view, x, y, z, &bearing)) return look;
    const nb_reach reach = nb_outlook_reach(&view->outlook, (nb_slope){bearing.up, bearing.level});
    /* Distances have float's digits: what they do not tell from the end, such as the ground under thin air, is there. */
    look.along = t_max - reach.begin > reach.span - 0x1p-22 * t_max ? reach.span : t_max - reach.begin;
    if (!(look.along > 0)) return (nb_look){.along = 0};
    look.sun = sun_along(view, &bearing);
    const double half = bearing.level > 0 ? sqrt(nb_larger(0, 0.5 * (1 - bearing.ahead / bearing.level))) : 0;
    const double share = look.along < reach.span ? sqrt(look.along / reach.span) : 1;
    look.row_part = part_of(reach.row * ((reach.falls ? NB_VIEW_FALLING : NB_VIEW_RISING) - 1),
                            reach.falls ? NB_VIEW_FALLING : NB_VIEW_RISING, &look.row);
    if (!reach.falls) look.row += NB_VIEW_FALLING;
    look.column_part = part_of(nb_smaller(1, half) * (view->columns - 1), view->columns, &look.column);
    look.level_part = part_of(share * view->levels, view->levels + 1, &look.level);
    if (look.level == 0 && view->levels > 1) look.level_part *= look.level_part; /* near the eye means are linear */
    return look;
}

enum { MOST_SIZE = 3 * NEBEL_MAX_AIRS + 5 };

/* Adds two neighbours of one level, weighed. */
static void add_pair(const nebel_air_view *view, const float *entry, float near, float far, float *sum)
{
    const float *next = entry + view->size * (view->levels + 1);
    for (int i = 0; i < view->size; i++) sum[i] += near * entry[i] + far * next[i];
}

static void mix_level(const nebel_air_view *view, const nb_look *look, int level, float weight, float *sum)
{
    const float *entry = nb_view_entry(view, look->row, look->column, level);
    const float *below = entry + (size_t)view->size * (size_t)(view->levels + 1) * (size_t)view->columns;
    const float upper = weight * (1 - look->row_part), lower = weight * look->row_part;
    add_pair(view, entry, upper * (1 - look->column_part), upper * look->column_part, sum);
    add_pair(view, below, lower * (1 - look->column_part), lower * look->column_part, sum);
}

static double light_along(const nebel_air_view *view, const nb_look *look, double light[3])
{
    float mean[MOST_SIZE] = {0};
    if (look->level_part < 1) mix_level(view, look, look->level, 1 - look->level_part, mean);
    if (look->level_part > 0) mix_level(view, look, look->level + 1, look->level_part, mean);
    const int often = nb_view_often(view);
    double once[3] = {0, 0, 0}, error = 0, most = 0;
    for (int i = 0; i < view->scatterer_count; i++) {
        const double phase = nb_phase_at(&view->atmosphere->airs.airs[view->scatterers[i]].phase, look->sun);
        for (int c = 0; c < 3; c++) once[c] += phase * (double)mean[3 * i + c];
    }
    for (int c = 0; c < 3; c++) {
        light[c] = look->along * view->sun.irradiance[c] * (once[c] + (double)mean[often + c]);
        error = nb_larger(error, look->along * view->sun.irradiance[c] * NB_ONCE_OFF * once[c]);
        most = nb_larger(most, light[c]);
    }
    return error + look->along * (double)mean[often + 3] + (double)mean[often + 4] * most + LEAST_OFF * view->brightest;
}

/* The fourth is what may be wrong with the others. */
static void depth_along(const nebel_air_view *view, const nb_look *look, double depth[4])
{
    const double row = (double)look->row_part, level = (double)look->level_part;
    for (int c = 0; c < 4; c++) {
        const double near = nb_view_extinction(view, look->row, look->level)[c] * (1 - row) +
                            nb_view_extinction(view, look->row + 1, look->level)[c] * row;
        const double far = nb_view_extinction(view, look->row, look->level + 1)[c] * (1 - row) +
                           nb_view_extinction(view, look->row + 1, look->level + 1)[c] * row;
        depth[c] = look->along * (near + level * (far - near));
    }
}

nebel_result nebel_trace_air_view(const nebel_air_view *view, size_t n, const double *const direction[3],
                                  const float *t_max, const nebel_light_planes *lights)
{
    if (view == NULL || direction == NULL || lights == NULL) return NEBEL_ERROR_ARGUMENT;
    for (size_t i = 0; i < n; i++) {
        const double far = t_max != NULL ? (double)t_max[i] : HUGE_VAL;
        const nb_look look = look_along(view, direction[0][i], direction[1][i], direction[2][i], far);
        double light[3] = {0, 0, 0}, depth[4] = {0, 0, 0, 0}, error = 0;
        if (look.along > 0) {
            depth_along(view, &look, depth);
            error = light_along(view, &look, light);
        }
        for (int c = 0; c < 3; c++) {
            const double left = nb_exp(-depth[c]);
            error = nb_larger(error, depth[3] * left);
            if (lights->transmittance[c] != NULL) lights->transmittance[c][i] = (float)left;
            if (lights->in_scattering[c] != NULL) lights->in_scattering[c][i] = (float)light[c];
        }
        if (lights->error != NULL) lights->error[i] = (float)error;
    }
    return NEBEL_OK;
}

/* ---- the ground ------------------------------------------------------------------------------ */

static void sunlight_at(const nebel_air_view *view, double cosine, double light[3])
{
    int first;
    const double part =
        (double)part_of(sqrt(nb_larger(0, nb_smaller(1, cosine))) * (NB_VIEW_SUNS - 1), NB_VIEW_SUNS, &first);
    for (int c = 0; c < 3; c++) {
        const double left = view->sunlight[first][c] + part * (view->sunlight[first + 1][c] - view->sunlight[first][c]);
        light[c] = cosine > 0 ? left * view->sun.irradiance[c] : 0;
    }
}

nebel_result nebel_find_ground(const nebel_air_view *view, size_t n, const double *const direction[3],
                               const nebel_ground_planes *planes)
{
    if (view == NULL || direction == NULL || planes == NULL) return NEBEL_ERROR_ARGUMENT;
    const double r = view->outlook.radius, ground = view->outlook.ground;
    for (size_t i = 0; i < n; i++) {
        nb_bearing bearing;
        double way = HUGE_VAL;
        if (find_bearing(view, direction[0][i], direction[1][i], direction[2][i], &bearing) &&
            nb_outlook_falls(&view->outlook, (nb_slope){bearing.up, bearing.level})) {
            const nb_reach reach = nb_outlook_reach(&view->outlook, (nb_slope){bearing.up, bearing.level});
            way = reach.begin + reach.span;
        }
        if (planes->distance != NULL) planes->distance[i] = (float)way;
        if (!(way < HUGE_VAL)) continue;
        const double up = (r + way * bearing.up) / ground, ahead = way * bearing.ahead / ground,
                     aside = way * bearing.aside / ground;
        const double cosine =
            nb_larger(-1, nb_smaller(1, (r * view->sun_slope.cosine + way * sun_along(view, &bearing)) / ground));
        double sun[3], sky[3];
        sunlight_at(view, cosine, sun);
        nb_scatter_look_up_ground(&view->atmosphere->scatter, cosine, sky);
        for (int c = 0; c < 3; c++) {
            if (planes->normal[c] != NULL)
                planes->normal[c][i] = (float)(up * view->up[c] + ahead * view->ahead[c] + aside * view->aside[c]);
            if (planes->sun[c] != NULL) planes->sun[c][i] = (float)sun[c];
            if (planes->sky[c] != NULL) planes->sky[c][i] = (float)(sky[c] * view->sun.irradiance[c]);
        }
    }
    return NEBEL_OK;
}
