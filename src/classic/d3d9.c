/* The fog of Direct3D 9: its states, and what a device makes of them. Sources: the documentation of fog formulas,
 * vertex fog and pixel fog of Direct3D 9, and what Wine's tests recorded on Windows where it is silent
 * (tests/test_classic_d3d9.c holds them). */
#include "classic/factors.h"

#include <math.h>
#include <stddef.h>
#include <string.h>

void nebel_reset_d3d9_fog(nebel_d3d9_fog *fog)
{
    if (fog == NULL) return;
    *fog = (nebel_d3d9_fog){.fog_end = 1, .fog_density = 1};
}

/* ---- states ---------------------------------------------------------------------------------- */

/* Every state is four bytes. */
static const struct {
    uint32_t state;
    size_t offset;
    int is_mode;
} members[] = {
    {NEBEL_D3DRS_FOGENABLE, offsetof(nebel_d3d9_fog, fog_enable), 0},
    {NEBEL_D3DRS_FOGCOLOR, offsetof(nebel_d3d9_fog, fog_color), 0},
    {NEBEL_D3DRS_FOGTABLEMODE, offsetof(nebel_d3d9_fog, fog_table_mode), 1},
    {NEBEL_D3DRS_FOGSTART, offsetof(nebel_d3d9_fog, fog_start), 0},
    {NEBEL_D3DRS_FOGEND, offsetof(nebel_d3d9_fog, fog_end), 0},
    {NEBEL_D3DRS_FOGDENSITY, offsetof(nebel_d3d9_fog, fog_density), 0},
    {NEBEL_D3DRS_RANGEFOGENABLE, offsetof(nebel_d3d9_fog, range_fog_enable), 0},
    {NEBEL_D3DRS_FOGVERTEXMODE, offsetof(nebel_d3d9_fog, fog_vertex_mode), 1},
};

enum { MEMBERS = sizeof members / sizeof *members };

static size_t find_member(uint32_t state)
{
    size_t i = 0;
    while (i < MEMBERS && members[i].state != state) i++;
    return i;
}

nebel_result nebel_set_d3d9_state(nebel_d3d9_fog *fog, uint32_t state, uint32_t value)
{
    const size_t i = find_member(state);
    if (fog == NULL || i == MEMBERS) return NEBEL_ERROR_ARGUMENT;
    if (members[i].is_mode && value > NEBEL_D3DFOG_LINEAR) return NEBEL_ERROR_VALUE;
    memcpy((char *)fog + members[i].offset, &value, sizeof value);
    return NEBEL_OK;
}

nebel_result nebel_get_d3d9_state(const nebel_d3d9_fog *fog, uint32_t state, uint32_t *value)
{
    const size_t i = find_member(state);
    if (fog == NULL || value == NULL || i == MEMBERS) return NEBEL_ERROR_ARGUMENT;
    memcpy(value, (const char *)fog + members[i].offset, sizeof *value);
    return NEBEL_OK;
}

void nebel_get_d3d9_color(const nebel_d3d9_fog *fog, double rgb[3])
{
    if (rgb == NULL) return;
    for (int c = 0; c < 3; c++) rgb[c] = fog == NULL ? 0 : (fog->fog_color >> (16 - 8 * c) & 0xff) / 255.;
}

/* ---- factors --------------------------------------------------------------------------------- */

static double evaluate(const nebel_d3d9_fog *fog, uint32_t mode, nebel_factor_stage stage, double c)
{
    const nebel_factor_desc desc = {.mode = mode == NEBEL_D3DFOG_EXP    ? NEBEL_FACTOR_EXP
                                            : mode == NEBEL_D3DFOG_EXP2 ? NEBEL_FACTOR_EXP2
                                                                        : NEBEL_FACTOR_LINEAR,
                                    .stage = stage,
                                    .start = (double)fog->fog_start,
                                    .end = (double)fog->fog_end,
                                    .density = (double)fog->fog_density};
    return nb_factor_evaluate(&desc, c);
}

static double clamp_factor(double f)
{
    return isnan(f) ? 1 : fmin(fmax(f, 0), 1);
}

static double fixed_factor(const nebel_d3d9_fog *fog, const nebel_d3d9_vertex *vertex)
{
    if (fog->fog_vertex_mode == NEBEL_D3DFOG_NONE) return clamp_factor(vertex->specular_alpha);
    const nebel_factor_desc range = {.coordinate =
                                         fog->range_fog_enable ? NEBEL_COORDINATE_RADIAL : NEBEL_COORDINATE_PLANE};
    const double c = nebel_compute_fog_coordinate(&range, vertex->position, 0);
    return evaluate(fog, fog->fog_vertex_mode, NEBEL_STAGE_VERTEX, c);
}

double nebel_compute_d3d9_vertex_factor(const nebel_d3d9_fog *fog, const nebel_d3d9_vertex *vertex)
{
    if (fog == NULL || vertex == NULL || !fog->fog_enable) return 1;
    switch (vertex->source) {
    case NEBEL_D3D9_TRANSFORMED:
        return clamp_factor(vertex->specular_alpha);
    case NEBEL_D3D9_SHADER:
        return clamp_factor(vertex->fog_register);
    default:
        return fixed_factor(fog, vertex);
    }
}

double nebel_compute_d3d9_pixel_factor(const nebel_d3d9_fog *fog, double vertex_factor, double depth)
{
    if (fog == NULL || !fog->fog_enable) return 1;
    if (fog->fog_table_mode == NEBEL_D3DFOG_NONE) return clamp_factor(vertex_factor);
    return evaluate(fog, fog->fog_table_mode, NEBEL_STAGE_PIXEL, depth);
}

int nebel_d3d9_uses_w(const float projection[16])
{
    if (projection == NULL) return 0;
    return projection[11] != 0;
}
