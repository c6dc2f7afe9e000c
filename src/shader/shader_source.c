#include "shader_source.h"

#include <nebel/shader.h>

const char *nebel_get_shader_source(nebel_shader_dialect dialect)
{
    switch (dialect) {
    case NEBEL_DIALECT_GLSL_330:
        return nb_shader_text_glsl_330;
    case NEBEL_DIALECT_GLSL_300_ES:
        return nb_shader_text_glsl_300_es;
    case NEBEL_DIALECT_GLSL_450:
        return nb_shader_text_glsl_450;
    case NEBEL_DIALECT_HLSL:
        return nb_shader_text_hlsl;
    default:
        return NULL;
    }
}
