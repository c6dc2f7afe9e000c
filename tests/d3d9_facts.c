#include "d3d9_facts.h"

enum { RED = 0xff0000, GREEN = 0x00ff00, BLUE = 0x0000ff, YELLOW = 0xffff00 };

#define FOG(fog_color, table_mode, vertex_mode, start, end, density)                                                   \
    {                                                                                                                  \
        1, fog_color, NEBEL_D3DFOG_##table_mode, NEBEL_D3DFOG_##vertex_mode, start, end, density, 0                    \
    }
#define RANGE_FOG(fog_color, table_mode, vertex_mode, start, end)                                                      \
    {                                                                                                                  \
        1, fog_color, NEBEL_D3DFOG_##table_mode, NEBEL_D3DFOG_##vertex_mode, start, end, 1, 1                          \
    }

/* Level quads, specular alpha ff. */
#define FIXED(at)                                                                                                      \
    {                                                                                                                  \
        .z = {at, at}, .alpha = { 1, 1 }                                                                               \
    }
#define MOVED(at, by_world, by_projection)                                                                             \
    {                                                                                                                  \
        .z = {at, at}, .alpha = {1, 1}, .world = by_world, .projection = by_projection                                 \
    }
#define TRANSFORMED(at, w)                                                                                             \
    {                                                                                                                  \
        .source = NEBEL_D3D9_TRANSFORMED, .z = {at, at}, .alpha = {1, 1}, .rhw = w                                     \
    }

/* z from 0 at the left to 1 at the right; specular alpha too, the other way. */
#define SLOPE                                                                                                          \
    {                                                                                                                  \
        .z = {0, 1}, .alpha = { 1, 1 }                                                                                 \
    }
#define FADING                                                                                                         \
    {                                                                                                                  \
        .z = {0, 1}, .alpha = { 1, 0 }                                                                                 \
    }
#define FADING_FLAT                                                                                                    \
    {                                                                                                                  \
        .z = {0, 1}, .alpha = {1, 0}, .is_flat = 1                                                                     \
    }

#define INTERPOLATION(table, vertex, quad, middle, differs)                                                            \
    {"fog_interpolation", FOG(GREEN, table, vertex, 0, 1, 5), quad, BLUE, 0, BLUE, 2, 0},                              \
        {"fog_interpolation", FOG(GREEN, table, vertex, 0, 1, 5), quad, BLUE, .5, middle, 2, differs},                 \
    {                                                                                                                  \
        "fog_interpolation", FOG(GREEN, table, vertex, 0, 1, 5), quad, BLUE, 1, 0x00fd02, 2, 0                         \
    }

/* To be read as a table. */
/* clang-format off */
const d3d9_fact d3d9_facts[] = {
    {"fog", FOG(GREEN, NONE, NONE, 0, 1, 1), FIXED(.1), RED, .5, RED, 0, 0},
    {"fog", FOG(GREEN, NONE, LINEAR, 0, 1, 1), FIXED(1), RED, .5, GREEN, 1, 0},
    {"fog", FOG(GREEN, NONE, LINEAR, 0, 1, 1), TRANSFORMED(1, 1), YELLOW, .5, YELLOW, 0, 0},
    {"fog", FOG(GREEN, LINEAR, LINEAR, 0, 1, 1), TRANSFORMED(1, 1), YELLOW, .5, GREEN, 1, 0},
    {"fog, start = end", FOG(GREEN, NONE, LINEAR, 512, 512, 1), FIXED(.1), RED, .5, GREEN, 1, 0},
    {"fog, start = end", FOG(GREEN, NONE, LINEAR, 512, 512, 1), FIXED(1), RED, .5, GREEN, 1, 0},
    {"fog, start = end", FOG(GREEN, NONE, LINEAR, 512, 512, 1), TRANSFORMED(1, 1), YELLOW, .5, YELLOW, 0, 0},
    {"fog, start > end", FOG(GREEN, NONE, LINEAR, .8f, .2f, 1), FIXED(.1), BLUE, .5, GREEN, 1, 0},
    {"fog, start > end", FOG(GREEN, NONE, LINEAR, .8f, .2f, 1), FIXED(.7), BLUE, .5, 0x002bd4, 2, 0},
    {"fog, start > end", FOG(GREEN, NONE, LINEAR, .8f, .2f, 1), FIXED(.4), BLUE, .5, 0x00aa55, 2, 0},
    {"fog, start > end", FOG(GREEN, NONE, LINEAR, .8f, .2f, 1), FIXED(.9), BLUE, .5, BLUE, 0, 0},
    {"fog, world", FOG(GREEN, LINEAR, NONE, 0, 1, 1), MOVED(.5, -.5, 0), RED, .5, RED, 4, 0},
    {"fog, world", FOG(GREEN, LINEAR, NONE, 0, 1, 1), MOVED(1.5, -.5, 0), RED, .5, GREEN, 1, 0},
    {"fog, projection", FOG(GREEN, LINEAR, NONE, 0, 1, 1), MOVED(.1, 1, -1), RED, .5, 0xe51900, 4, 0},
    {"fog, projection", FOG(GREEN, LINEAR, NONE, 0, 1, 1), MOVED(1, 1, -1), RED, .5, GREEN, 1, 0},
    {"fog, range", RANGE_FOG(GREEN, LINEAR, NONE, .75f, .75001f), FIXED(.5), RED, 0, RED, 0, 0},
    {"fog, range", RANGE_FOG(GREEN, LINEAR, NONE, .75f, .75001f), FIXED(.5), RED, 1, RED, 0, 0},
    {"fog, range", RANGE_FOG(GREEN, NONE, LINEAR, .75f, .75001f), FIXED(.5), RED, 0, GREEN, 1, 0},
    {"fog, range", RANGE_FOG(GREEN, NONE, LINEAR, .75f, .75001f), FIXED(.5), RED, 1, GREEN, 1, 0},
    {"fog_special", FOG(RED, NONE, LINEAR, .5f, .5f, 1), SLOPE, GREEN, .48, RED, 1, 0},
    {"fog_special", FOG(RED, NONE, LINEAR, .5f, .5f, 1), SLOPE, GREEN, .52, RED, 1, 0},
    {"fog_special", FOG(RED, LINEAR, NONE, .5f, .5f, 1), SLOPE, GREEN, .48, GREEN, 1, 0},
    {"fog_special", FOG(RED, LINEAR, NONE, .5f, .5f, 1), SLOPE, GREEN, .52, RED, 1, 0},
    INTERPOLATION(NONE, NONE, FADING, 0x007f80, 0),
    INTERPOLATION(NONE, EXP, FADING, 0x007f80, 1),
    INTERPOLATION(EXP, NONE, FADING, 0x00ea15, 0),
    INTERPOLATION(EXP, EXP, FADING, 0x00ea15, 0),
    INTERPOLATION(NONE, NONE, FADING_FLAT, 0x007f80, 0),
    INTERPOLATION(NONE, EXP, FADING_FLAT, 0x007f80, 1),
    INTERPOLATION(EXP, NONE, FADING_FLAT, 0x00ea15, 0),
    INTERPOLATION(EXP, EXP, FADING_FLAT, 0x00ea15, 0),
    {"negative_fixedfunction_fog", FOG(GREEN, LINEAR, NONE, 0, 1, 1), TRANSFORMED(-.5, 1), RED, .5, RED, 2, 0},
    {"negative_fixedfunction_fog", FOG(GREEN, LINEAR, NONE, -1, 0, 1), TRANSFORMED(-.5, 1), RED, .5, 0x808000, 2, 0},
    {"negative_fixedfunction_fog", FOG(GREEN, NONE, LINEAR, 0, 1, 1), MOVED(-.5, 0, .5), RED, .5, 0x808000, 2, 0},
    {"negative_fixedfunction_fog", FOG(GREEN, NONE, LINEAR, -1, 0, 1), MOVED(-.5, 0, .5), RED, .5, GREEN, 2, 0},
    {"negative_fixedfunction_fog", FOG(GREEN, NONE, EXP, 0, 1, 1), MOVED(-.5, 0, .5), RED, .5, 0x9b6400, 2, 0},
    {"table_fog_zw", FOG(GREEN, LINEAR, NONE, 0, 1, 1), TRANSFORMED(.7, 0), RED, .5, 0x4cb200, 2, 0},
    {"table_fog_zw", FOG(GREEN, LINEAR, NONE, 0, 1, 1), TRANSFORMED(.7, .3), RED, .5, 0x4cb200, 2, 0},
    {"table_fog_zw", FOG(GREEN, LINEAR, NONE, 0, 1, 1), TRANSFORMED(.7, 3), RED, .5, 0x4cb200, 2, 0},
    {"table_fog_zw", FOG(GREEN, LINEAR, NONE, 0, 1, 1), TRANSFORMED(.3, 0), RED, .5, 0xb24c00, 2, 0},
    {"fog_with_shader, no oFog", FOG(GREEN, NONE, NONE, 0, 1, 1), {.source = NEBEL_D3D9_SHADER, .z = {.5, .5}},
     RED, .5, GREEN, 0, 0},
};
/* clang-format on */

const size_t d3d9_fact_count = sizeof d3d9_facts / sizeof *d3d9_facts;

static double vertex_factor(const nebel_d3d9_fog *fog, const d3d9_quad *quad, int side)
{
    const nebel_d3d9_vertex vertex = {.source = quad->source,
                                      .position = {side ? 1 : -1, 1, quad->z[side] + quad->world},
                                      .specular_alpha = quad->alpha[side],
                                      .fog_register = quad->fog_register};
    return nebel_compute_d3d9_vertex_factor(fog, &vertex);
}

double d3d9_factor_of(const nebel_d3d9_fog *fog, const d3d9_quad *quad, double probe)
{
    const double f = (1 - probe) * vertex_factor(fog, quad, 0) + probe * vertex_factor(fog, quad, 1);
    const double z = (1 - probe) * quad->z[0] + probe * quad->z[1];
    return nebel_compute_d3d9_pixel_factor(fog, f, z + quad->world + quad->projection);
}

int d3d9_color_of(const nebel_d3d9_fog *fog, int object, double f)
{
    double rgb[3];
    float pixel[4] = {(float)(object >> 16 & 255) / 255, (float)(object >> 8 & 255) / 255, (float)(object & 255) / 255,
                      1};
    nebel_get_d3d9_color(fog, rgb);
    nebel_blend_fog_factor(f, pixel, rgb, pixel);
    int color = 0;
    for (int c = 0; c < 3; c++) color = color << 8 | (int)(pixel[c] * 255 + .5f);
    return color;
}

/* ---- along z --------------------------------------------------------------------------------- */

#define LINEAR_STEPS                                                                                                   \
    {                                                                                                                  \
        0xff0000, 0xff0000, 0xdf2000, 0xbf4000, 0x9f6000, 0x7f8000, 0x5fa000, 0x40bf00, 0x20df00, 0x00ff00, 0x00ff00   \
    }
#define EXP_STEPS                                                                                                      \
    {                                                                                                                  \
        0xff0000, 0xe71800, 0xd12e00, 0xbd4200, 0xab5400, 0x9b6400, 0x8d7200, 0x7f8000, 0x738c00, 0x689700, 0x5ea100   \
    }
#define EXP2_STEPS                                                                                                     \
    {                                                                                                                  \
        0xfd0200, 0xf50200, 0xf50a00, 0xe91600, 0xd92600, 0xc73800, 0xb24d00, 0x9c6300, 0x867900, 0x728d00, 0x5ea100   \
    }
#define REGISTER_STEPS                                                                                                 \
    {                                                                                                                  \
        0xff0000, 0xfe0100, 0xde2100, 0xbf4000, 0x9f6000, 0x7f8000, 0x5fa000, 0x3fc000, 0x1fe000, 0x00ff00, 0x00ff00   \
    }

#define ANY_MODE NEBEL_D3DFOG_NONE, NEBEL_D3DFOG_LINEAR

/* clang-format off */
const d3d9_ramp d3d9_ramps[D3D9_RAMP_COUNT] = {
    {NEBEL_D3DFOG_LINEAR, ANY_MODE, NEBEL_D3D9_FIXED, LINEAR_STEPS},
    {NEBEL_D3DFOG_LINEAR, ANY_MODE, NEBEL_D3D9_SHADER, LINEAR_STEPS},
    {NEBEL_D3DFOG_EXP, ANY_MODE, NEBEL_D3D9_FIXED, EXP_STEPS},
    {NEBEL_D3DFOG_EXP, ANY_MODE, NEBEL_D3D9_SHADER, EXP_STEPS},
    {NEBEL_D3DFOG_EXP2, ANY_MODE, NEBEL_D3D9_FIXED, EXP2_STEPS},
    {NEBEL_D3DFOG_EXP2, ANY_MODE, NEBEL_D3D9_SHADER, EXP2_STEPS},
    {NEBEL_D3DFOG_NONE, NEBEL_D3DFOG_LINEAR, NEBEL_D3DFOG_LINEAR, NEBEL_D3D9_FIXED, LINEAR_STEPS},
    {NEBEL_D3DFOG_NONE, ANY_MODE, NEBEL_D3D9_SHADER, REGISTER_STEPS},
};
/* clang-format on */

static double d3d9_ramp_z(int step)
{
    return .001 + step / 10.02;
}

nebel_d3d9_fog d3d9_ramp_fog(const d3d9_ramp *ramp, uint32_t vertex_mode)
{
    return (nebel_d3d9_fog){1, GREEN, ramp->table, vertex_mode, .1f, .9f, 1, 0};
}

d3d9_quad d3d9_ramp_quad(const d3d9_ramp *ramp, int step)
{
    const double z = d3d9_ramp_z(step);
    return (d3d9_quad){.source = ramp->source, .z = {z, z}, .alpha = {1, 1}, .fog_register = (.9 - z) * 1.25};
}

/* ---- one vertex ------------------------------------------------------------------------------ */

const d3d9_vertex_fact d3d9_vertex_facts[D3D9_VERTEX_FACT_COUNT] = {
    {NEBEL_D3DFOG_NONE, 0, 0x80},   {NEBEL_D3DFOG_EXP, 0, 0xaf},   {NEBEL_D3DFOG_EXP2, 0, 0xde},
    {NEBEL_D3DFOG_LINEAR, 0, 0x9f}, {NEBEL_D3DFOG_NONE, 1, 0x80},  {NEBEL_D3DFOG_EXP, 1, 0x88},
    {NEBEL_D3DFOG_EXP2, 1, 0xad},   {NEBEL_D3DFOG_LINEAR, 1, 0x60}};
