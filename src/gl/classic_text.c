#include "classic_text.h"

/* As src/classic/factors.c has them for the stage of pixels. */
const char nb_factor_text[] = "uniform int factor_mode;\n"   /* nebel_factor_mode; below 0: none */
                              "uniform vec3 factor_range;\n" /* start, end, density */
                              "uniform vec3 factor_color;\n"
                              "float fog_factor(float c)\n"
                              "{\n"
                              "    float x = factor_range.z * c;\n"
                              "    if (factor_mode == 0) return exp(-x);\n"
                              "    if (factor_mode == 1) return exp(-x * x);\n"
                              "    if (factor_range.x == factor_range.y) return c < factor_range.x ? 1.0 : 0.0;\n"
                              "    return clamp((factor_range.y - c) / (factor_range.y - factor_range.x), 0.0, 1.0);\n"
                              "}\n";

/* Depth is along the camera's axis; the axis is 0 where the distance counts. */
const char nb_pixel_factor_text[] =
    "uniform highp sampler2D scene_place;\n"
    "uniform vec3 scene_axis;\n"
    "uniform vec2 device_depth;\n" /* the near plane; 1 over the range, 0: depth in meters counts */
    "layout(location = 0) out highp vec4 out_in_scattering;\n"
    "layout(location = 1) out highp vec4 out_transmittance;\n"
    "void main()\n"
    "{\n"
    "    float t = texelFetch(scene_place, ivec2(gl_FragCoord.xy), 0).x;\n"
    "    if (!(t > 0.0)) discard;\n"
    "    vec3 at = ray_origin(gl_FragCoord.xy) + t * ray_direction(gl_FragCoord.xy);\n"
    "    float c = scene_axis == vec3(0.0) ? length(at) : abs(dot(at, scene_axis));\n"
    "    if (device_depth.y > 0.0) c = clamp((c - device_depth.x) * device_depth.y, 0.0, 1.0);\n"
    "    float f = fog_factor(c);\n"
    "    out_in_scattering = vec4((1.0 - f) * factor_color, 1.0);\n"
    "    out_transmittance = vec4(vec3(f), 1.0);\n"
    "}\n";

/* As src/base/device.h has it. What fog does that is stored waits until what is behind it is known; particles lie before both. */
const char nb_device_text[] =
    "uniform bool scene_is_stored;\n"
    "vec3 device_left = vec3(1.0), device_added = vec3(0.0);\n"
    "vec3 device_store(vec3 x)\n"
    "{\n"
    "    x = clamp(x, 0.0, 1.0);\n"
    "    vec3 power = 1.055 * pow(max(x, 0.0031308), vec3(1.0 / 2.4)) - 0.055;\n"
    "    return mix(power, 12.92 * x, lessThanEqual(x, vec3(0.0031308)));\n"
    "}\n"
    "vec3 device_restore(vec3 x)\n"
    "{\n"
    "    x = clamp(x, 0.0, 1.0);\n"
    "    return mix(pow((x + 0.055) / 1.055, vec3(2.4)), x / 12.92, lessThanEqual(x, vec3(0.04045)));\n"
    "}\n"
    "void device_open(inout vec3 transmittance, inout vec3 in_scattering)\n"
    "{\n"
    "    if (!scene_is_stored) return;\n"
    "    device_left = transmittance;\n"
    "    device_added = in_scattering;\n"
    "    transmittance = vec3(1.0);\n"
    "    in_scattering = vec3(0.0);\n"
    "}\n"
    "vec3 device_blend(vec3 surface)\n"
    "{\n"
    "    if (!scene_is_stored) return surface;\n"
    "    return device_restore(device_left * device_store(surface) + device_added);\n"
    "}\n"
    "void device_close(inout vec3 transmittance, inout vec3 in_scattering)\n"
    "{\n"
    "    if (!scene_is_stored) return;\n"
    "    in_scattering += transmittance * device_added;\n"
    "    transmittance *= device_left;\n"
    "}\n";
