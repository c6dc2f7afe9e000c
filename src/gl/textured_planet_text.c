#include "textured_planet_text.h"

/* What src/planet/textured_planet.c says, in float. The way to a ball: the half chord is of two squares, of which those are taken that
 * are small where they nearly cancel, near the ball the height above it, far from it how far the ray passes its middle.
 * Angles are halved until their series is short: s is the tangent of a quarter of one, at most that of 22.5 degrees, and
 * the first term that is left out 1e-8 of it. */
const char nb_shell_sphere_text[] =
    "uniform vec3 ball_from;\n"    /* the eye, from the planet's middle [m] */
    "uniform float ball_radius;\n" /* m */
    "uniform float ball_square;\n" /* of the eye's distance, less that of the radius */
    "uniform mat3 ball_frame;\n"   /* columns: the planet's axes */
    "uniform float ball_turned;\n" /* turns of the map to the east */
    "uniform float ball_spread;\n" /* width of a pixel per metre of way */
    "uniform vec3 ball_sun;\n"     /* to the sun; 0: there is none */
    "uniform vec3 ball_sunlight;\n"
    "uniform vec3 ball_ambient;\n"
    "struct ball_chord { bool is_met; float near; float far; float half_way; vec3 beside; };\n"
    "ball_chord chord_at(vec2 pixel)\n"
    "{\n"
    "    vec3 origin = ray_origin(pixel), direction = ray_direction(pixel), from = ball_from + origin;\n"
    "    float square = ball_square + dot(origin, 2.0 * ball_from + origin), closest = -dot(from, direction);\n"
    "    ball_chord c;\n"
    "    c.beside = from + closest * direction;\n"
    "    float aside = length(c.beside);\n"
    "    float least = closest * closest < ball_radius * ball_radius ? closest * closest - square\n"
    "                                                               : (ball_radius - aside) * (ball_radius + aside);\n"
    "    c.is_met = least >= 0.0;\n"
    "    c.half_way = sqrt(max(least, 0.0));\n"
    "    c.near = closest > 0.0 ? square / (closest + c.half_way) : closest - c.half_way;\n"
    "    c.far = closest < 0.0 ? square / (closest - c.half_way) : closest + c.half_way;\n"
    "    return c;\n"
    "}\n"
    "float turn_of(float y, float x)\n" /* the angle of (x, y), as a part of a turn */
    "{\n"
    "    float r = length(vec2(x, y)), t = abs(y) / max(r + abs(x), 1e-30), s = t / (1.0 + sqrt(1.0 + t * t)), z = s * "
    "s;\n"
    "    float sum = 0.0;\n"
    "    for (int i = 17; i > 0; i -= 2) sum = 1.0 / float(i) - z * sum;\n"
    "    float part = 0.6366197723675814 * s * sum;\n"
    "    if (x < 0.0) part = 0.5 - part;\n"
    "    return y < 0.0 ? -part : part;\n"
    "}\n"
    "struct ball_spot { vec3 normal; vec2 at; float pole; float sun; float view; float level; };\n"
    "ball_spot spot_at(ball_chord c, vec3 direction, bool is_far)\n"
    "{\n"
    "    ball_spot spot;\n"
    "    spot.normal = normalize(c.beside + (is_far ? c.half_way : -c.half_way) * direction);\n"
    "    vec3 local = spot.normal * ball_frame;\n"
    "    spot.at.x = turn_of(-local.z, local.x) + 0.5 - ball_turned;\n"
    "    spot.at.y = 2.0 * turn_of(length(local.xz), local.y);\n"
    "    spot.pole = clamp(local.y, -1.0, 1.0);\n"
    "    spot.sun = dot(spot.normal, ball_sun);\n"
    "    spot.view = abs(dot(spot.normal, direction));\n"
    "    spot.level = nb_map_spread(ball_spread * (is_far ? c.far : c.near), ball_radius, spot.view);\n"
    "    return spot;\n"
    "}\n"
    "vec3 lit_by_all(float sun) { return max(sun, 0.0) * ball_sunlight + ball_ambient; }\n"
    /* `sizes` are columns, rows and levels of a map that lies as nb_gl_map says. */
    "vec3 read_level(highp sampler2D map, ivec3 sizes, int level, vec2 at, bool repeats)\n"
    "{\n"
    "    ivec2 size = max(sizes.xy >> level, 1), corner = ivec2(0, level > 0 ? sizes.y : 0);\n"
    "    for (int i = 1; i < level; i++) corner.x += max(sizes.x >> i, 1);\n"
    "    vec2 place = vec2(nb_map_around(at.x, float(size.x)), nb_map_within(at.y, float(size.y)));\n"
    "    if (repeats) place.y = nb_map_around(at.y, float(size.y));\n"
    "    vec2 low = floor(place), share = place - low;\n"
    "    ivec2 a = ivec2(low);\n"
    "    if (a.x < 0) a.x = size.x - 1;\n"
    "    if (a.y < 0) a.y = size.y - 1;\n"
    "    a = min(a, size - 1);\n"
    "    ivec2 b = a + 1;\n"
    "    if (b.x == size.x) b.x = 0;\n"
    "    if (b.y == size.y) b.y = repeats ? 0 : a.y;\n"
    "    a += corner;\n"
    "    b += corner;\n"
    "    vec3 above = mix(texelFetch(map, a, 0).rgb, texelFetch(map, ivec2(b.x, a.y), 0).rgb, share.x);\n"
    "    vec3 below = mix(texelFetch(map, ivec2(a.x, b.y), 0).rgb, texelFetch(map, b, 0).rgb, share.x);\n"
    "    return mix(above, below, share.y);\n"
    "}\n"
    "vec3 read_map(highp sampler2D map, ivec3 sizes, ball_spot spot, float wrap, bool repeats)\n"
    "{\n"
    "    float texels = spot.level * abs(wrap) * float(sizes.x);\n"
    "    float level = texels > 1.0 ? min(log2(texels), float(sizes.z - 1)) : 0.0, low = floor(level);\n"
    "    vec3 value = read_level(map, sizes, int(low), wrap * spot.at, repeats);\n"
    "    if (!(level > low)) return value;\n"
    "    return mix(value, read_level(map, sizes, int(low) + 1, wrap * spot.at, repeats), level - low);\n"
    "}\n";

/* Behind nearer surfaces; alpha 1: it has light of its own. */
const char nb_shell_ground_text[] =
    "uniform highp sampler2D shell_map;\n"
    "uniform ivec3 shell_map_sizes;\n"
    "layout(location = 0) out highp vec4 out_place;\n"
    "layout(location = 1) out highp vec4 out_normal;\n"
    "layout(location = 2) out highp vec4 out_reflectance;\n"
    "void main()\n"
    "{\n"
    "    ball_chord chord = chord_at(gl_FragCoord.xy);\n"
    "    bool is_far = chord.near < 0.0;\n"
    "    float t = is_far ? chord.far : chord.near;\n"
    "    if (!(chord.is_met && t >= 0.0)) discard;\n"
    "    ball_spot spot = spot_at(chord, ray_direction(gl_FragCoord.xy), is_far);\n"
    "    out_place = vec4(max(t, 1e-30), spot.normal);\n"
    "    out_normal = vec4(spot.normal, 0.0);\n"
    "    out_reflectance = vec4(read_map(shell_map, shell_map_sizes, spot, 1.0, false), 1.0);\n"
    "    gl_FragDepth = 1.0 / (1.0 + t);\n"
    "}\n";

/* One side of a shell, before surfaces. Where it is not met rays end at once, and nothing is covered. */
#define SIDE                                                                                                           \
    "uniform bool shell_is_far;\n"                                                                                     \
    "uniform highp sampler2D scene_place;\n"                                                                           \
    "layout(location = 0) out highp vec4 out_place;\n"                                                                 \
    "layout(location = 1) out highp vec4 out_light;\n"                                                                 \
    "layout(location = 2) out highp vec4 out_depth;\n"                                                                 \
    "vec4 shell_light(ball_spot spot);\n"                                                                              \
    "void main()\n"                                                                                                    \
    "{\n"                                                                                                              \
    "    ball_chord chord = chord_at(gl_FragCoord.xy);\n"                                                              \
    "    float t = shell_is_far ? chord.far : chord.near;\n"                                                           \
    "    float end = texelFetch(scene_place, ivec2(gl_FragCoord.xy), 0).x;\n"                                          \
    "    bool is_seen = chord.is_met && t >= 0.0 && shell_is_far == chord.near < 0.0 && !(end > 0.0 && t > end);\n"    \
    "    if (!is_seen) t = 0.0;\n"                                                                                     \
    "    out_place = vec4(max(t, 1e-30));\n"                                                                           \
    "    out_depth = vec4(1.0 / (1.0 + t));\n"                                                                         \
    "    out_light = vec4(0.0);\n"                                                                                     \
    "    if (is_seen) out_light = shell_light(spot_at(chord, ray_direction(gl_FragCoord.xy), shell_is_far));\n"        \
    "}\n"

const char nb_shell_clouds_text[] =
    SIDE "uniform highp sampler2D shell_map, shell_detail;\n"
         "uniform ivec3 shell_map_sizes, shell_detail_sizes;\n"
         "uniform vec3 shell_wrap;\n"
         "uniform float shell_gain;\n"
         "uniform vec3 shell_color;\n"
         "vec4 shell_light(ball_spot spot)\n"
         "{\n"
         "    vec3 parts;\n"
         "    for (int i = 0; i < 3; i++)\n"
         "        parts[i] = read_map(shell_detail, shell_detail_sizes, spot, shell_wrap[i], true).x;\n"
         "    float plain = read_map(shell_map, shell_map_sizes, spot, 1.0, false).x;\n"
         "    float cover = nb_cloud_cover(plain, parts.x, parts.y, parts.z, spot.pole, shell_gain);\n"
         "    return vec4(cover * shell_color * lit_by_all(spot.sun), cover);\n"
         "}\n";

const char nb_shell_air_text[] = SIDE
    "uniform vec3 air_ramp[16];\n"
    "uniform int air_ramp_count;\n"
    "uniform float air_brightness;\n"
    "vec4 shell_light(ball_spot spot)\n"
    "{\n"
    "    nb_glow glow = nb_air_glow(spot.sun, spot.view);\n"
    "    float place = glow.place * float(air_ramp_count - 1);\n"
    "    int low = int(place), high = min(low + 1, air_ramp_count - 1);\n"
    "    return vec4(air_brightness * glow.amount * mix(air_ramp[low], air_ramp[high], place - float(low)), 0.0);\n"
    "}\n";

/* A shell covers a part of what is behind it, and all fog there; what it covers shows the fog before it, and itself through
 * that. */
const char nb_shell_over_text[] = "uniform highp sampler2D shell_seen;\n"
                                  "#ifdef SCENE_IN_FOG\n"
                                  "uniform highp sampler2D scene_in_scattering;\n"
                                  "uniform highp sampler2D scene_transmittance;\n"
                                  "#endif\n"
                                  "out highp vec4 out_shells;\n"
                                  "void main()\n"
                                  "{\n"
                                  "    ivec2 texel = ivec2(gl_FragCoord.xy);\n"
                                  "    vec3 transmittance = vec3(1.0), in_scattering = vec3(0.0);\n"
                                  "#ifdef SCENE_IN_FOG\n"
                                  "    transmittance = texelFetch(scene_transmittance, texel, 0).rgb;\n"
                                  "    in_scattering = texelFetch(scene_in_scattering, texel, 0).rgb;\n"
                                  "#endif\n"
                                  "    see_through_veil(texel, transmittance, in_scattering);\n"
                                  "    vec4 seen = texelFetch(shell_seen, texel, 0);\n"
                                  "    out_shells = vec4(seen.a * in_scattering + transmittance * seen.rgb, seen.a);\n"
                                  "}\n";
