#include "method.h"

int nb_method_takes_cells(nebel_gl_method kind)
{
    return kind == NEBEL_GL_METHOD_CELLS || kind == NEBEL_GL_METHOD_CELLS_PIXEL;
}

int nb_method_is_by_user(const nb_method *m)
{
    return m->has_factor && m->factor.coordinate == NEBEL_COORDINATE_USER;
}

int nb_method_is_by_vertex(const nb_method *m)
{
    switch (m->kind) {
    case NEBEL_GL_METHOD_VERTEX:
    case NEBEL_GL_METHOD_ADDITIVE:
    case NEBEL_GL_METHOD_CELLS:
    case NEBEL_GL_METHOD_FOG_COORD:
    case NEBEL_GL_METHOD_TWO_PASS:
    case NEBEL_GL_METHOD_ALPHA:
        return 1;
    case NEBEL_GL_METHOD_D3D9:
        return !m->has_factor;
    default:
        return m->has_factor && (nb_method_is_by_user(m) || m->factor.stage == NEBEL_STAGE_VERTEX);
    }
}

static nebel_result set_factor_method(nb_method *m, const nebel_gl_frame_desc *desc)
{
    const nebel_gl_method method = m->kind;
    if (desc->factor == NULL) return NEBEL_ERROR_ARGUMENT;
    m->has_factor = 1;
    m->factor = *desc->factor;
    m->factor.mode = method == NEBEL_GL_METHOD_LINEAR ? NEBEL_FACTOR_LINEAR
                     : method == NEBEL_GL_METHOD_EXP  ? NEBEL_FACTOR_EXP
                                                      : NEBEL_FACTOR_EXP2;
    const nebel_result result = nebel_resolve_factor(&m->factor, &m->factor);
    for (int c = 0; c < 3; c++) m->factor.color[c] = nb_device_store(m->factor.color[c]);
    return result;
}

static nebel_result set_look(nb_method *m, const nebel_gl_frame_desc *desc)
{
    const nebel_vertex_desc *const vertex = desc->vertex;
    if (vertex != NULL) {
        m->look = *vertex;
        m->look.isa = NEBEL_ISA_DEFAULT;
        m->look.coordinate_end = 0;
    }
    const int wants_color = m->kind != NEBEL_GL_METHOD_TWO_PASS || m->look.curve != NEBEL_CURVE_PHYSICAL;
    if (wants_color && m->look.color == NULL) return NEBEL_ERROR_ARGUMENT;
    return nebel_resolve_vertex_desc(&m->look, &m->look);
}

static nebel_factor_mode mode_of(uint32_t table_mode)
{
    return table_mode == NEBEL_D3DFOG_EXP    ? NEBEL_FACTOR_EXP
           : table_mode == NEBEL_D3DFOG_EXP2 ? NEBEL_FACTOR_EXP2
                                             : NEBEL_FACTOR_LINEAR;
}

/* Table fog is a factor of pixels. */
static nebel_result set_device_method(nb_method *m, const nebel_gl_frame_desc *desc)
{
    const nebel_d3d9_fog *const d3d9 = desc->d3d9;
    if (d3d9 == NULL || d3d9->fog_table_mode > NEBEL_D3DFOG_LINEAR || d3d9->fog_vertex_mode > NEBEL_D3DFOG_LINEAR)
        return NEBEL_ERROR_ARGUMENT;
    if (nb_device_planes_set(&m->planes, desc->z_near, desc->z_far) != NEBEL_OK) return NEBEL_ERROR_VALUE;
    m->d3d9 = *d3d9;
    m->d3d9.fog_enable = 1;
    m->has_factor = d3d9->fog_table_mode != NEBEL_D3DFOG_NONE;
    m->factor = (nebel_factor_desc){.mode = mode_of(d3d9->fog_table_mode),
                                    .stage = NEBEL_STAGE_PIXEL,
                                    .start = (double)d3d9->fog_start,
                                    .end = (double)d3d9->fog_end,
                                    .density = (double)d3d9->fog_density};
    nebel_get_d3d9_color(d3d9, m->factor.color);
    return NEBEL_OK;
}

static int blends_stored(nebel_gl_method kind)
{
    switch (kind) {
    case NEBEL_GL_METHOD_LINEAR:
    case NEBEL_GL_METHOD_EXP:
    case NEBEL_GL_METHOD_EXP2:
    case NEBEL_GL_METHOD_FOG_COORD:
    case NEBEL_GL_METHOD_TWO_PASS:
    case NEBEL_GL_METHOD_ALPHA:
    case NEBEL_GL_METHOD_D3D9:
        return 1;
    default:
        return 0;
    }
}

nebel_result nb_method_set(nb_method *m, const nebel_gl_frame_desc *desc)
{
    *m = (nb_method){.kind = desc->method, .blends_stored = blends_stored(desc->method)};
    switch (m->kind) {
    case NEBEL_GL_METHOD_LINEAR:
    case NEBEL_GL_METHOD_EXP:
    case NEBEL_GL_METHOD_EXP2:
        m->replaces_fog = 1;
        return set_factor_method(m, desc);
    case NEBEL_GL_METHOD_D3D9:
        m->replaces_fog = 1;
        return set_device_method(m, desc);
    case NEBEL_GL_METHOD_FOG_COORD:
    case NEBEL_GL_METHOD_TWO_PASS:
    case NEBEL_GL_METHOD_ALPHA:
        return set_look(m, desc);
    default:
        return NEBEL_OK;
    }
}

nebel_vertex_format nb_method_format(const nb_method *m)
{
    if (m->kind == NEBEL_GL_METHOD_ALPHA) return NEBEL_VERTEX_ALPHA;
    if (m->kind == NEBEL_GL_METHOD_D3D9) return NEBEL_VERTEX_SPECULAR_ALPHA;
    if (nb_method_is_by_user(m) || m->kind == NEBEL_GL_METHOD_FOG_COORD) return NEBEL_VERTEX_COORDINATE;
    return NEBEL_VERTEX_RGBA_FLOAT;
}
