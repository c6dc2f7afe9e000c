#include "air_text.h"

#include "base/daylight.h"

#include <stdio.h>

const char *nb_air_head(int worlds, char text[NB_AIR_HEAD])
{
    text[0] = '\0';
    if (worlds > 0)
        (void)snprintf(text, NB_AIR_HEAD,
                       "#define NEBEL_AIR\n#define SCENE_WORLDS %d\n#define NB_DAYLIGHT_HEIGHTS %d.0\n#define "
                       "NB_DAYLIGHT_SUNS %d.0\n#define NB_DAYLIGHT_SKIES %d.0\n#define NB_DAYLIGHT_TWILIGHT %g\n",
                       worlds, NB_DAYLIGHT_HEIGHTS, NB_DAYLIGHT_SUNS, NB_DAYLIGHT_SKIES, NB_DAYLIGHT_TWILIGHT);
    return text;
}

/* The tables of several planets lie in one texture, one behind the other. */
const char nb_air_words_text[] = "uniform highp sampler2D nebel_air_texture;\n"
                                 "highp int air_first = 0;\n" /* of the planet that is asked */
                                 "#define NEBEL_AIR_WORD(i) texelFetch(nebel_air_texture, ivec2((air_first + (i)) & "
                                 "1023, (air_first + (i)) >> 10), 0)\n";

const char nb_air_worlds_text[] =
    "uniform ivec3 world_words[SCENE_WORLDS];\n" /* of its table; from there on of light at places, -1: none; has it air? */
    "uniform vec4 world_eyes[SCENE_WORLDS];\n"  /* up from its centre to the eye; how high that is above the ground */
    "uniform vec2 world_sizes[SCENE_WORLDS];\n" /* radius; how thick the air is */
    "uniform vec3 world_albedos[SCENE_WORLDS];\n"
    "void choose_world(int world) { air_first = world_words[world].x; }\n"
    /* The nearest one; and whose it is. */
    "nebel_ground nearest_ground(vec3 direction, out int world)\n"
    "{\n"
    "    world = 0;\n"
    "    choose_world(0);\n"
    "    nebel_ground nearest = nebel_find_ground(direction);\n"
    "    for (int k = 1; k < SCENE_WORLDS; k++) {\n"
    "        choose_world(k);\n"
    "        nebel_ground ground = nebel_find_ground(direction);\n"
    "        if (ground.distance < nearest.distance) {\n"
    "            nearest = ground;\n"
    "            world = k;\n"
    "        }\n"
    "    }\n"
    "    return nearest;\n"
    "}\n"
    /* In their order, in which rays pass them. */
    "nb_air_ray world_rays[SCENE_WORLDS];\n"
    "void find_airs(vec3 direction, out float begin, out float end)\n"
    "{\n"
    "    begin = 1e18;\n"
    "    end = 0.0;\n"
    "    for (int k = 0; k < SCENE_WORLDS; k++) {\n"
    "        choose_world(k);\n"
    "        world_rays[k] = nb_find_air(direction);\n"
    "        if (world_words[k].z == 0 || !(world_rays[k].span > 0.0)) continue;\n"
    "        begin = min(begin, world_rays[k].begin);\n"
    "        end = max(end, world_rays[k].begin + world_rays[k].span);\n"
    "    }\n"
    "    begin = min(begin, end);\n"
    "}\n"
    "nebel_light airs_up_to(float t)\n"
    "{\n"
    "    nebel_light all;\n"
    "    all.transmittance = vec3(1.0);\n"
    "    all.in_scattering = vec3(0.0);\n"
    "    for (int k = 0; k < SCENE_WORLDS; k++) {\n"
    "        if (world_words[k].z == 0) continue;\n"
    "        choose_world(k);\n"
    "        nebel_light one = nb_air_light(world_rays[k], t);\n"
    "        all.in_scattering += all.transmittance * one.in_scattering;\n"
    "        all.transmittance *= one.transmittance;\n"
    "    }\n"
    "    return all;\n"
    "}\n";

/* Air and fog let through less the farther a ray goes and add light all the way, so that between two places the integral
 * of T_fog dS_air + T_air dS_fog is within what it is with the transmittances of the one place and of the other: the mean
 * is taken, and pieces are shorter where half of the products of differences is more than the tolerance
 * (src/cpu/haze.c). Here they follow each other from where air begins, the first one up to where it begins to count, and
 * the walk through fog goes on from piece to piece: what is in doubt goes with the square of a piece's length, what is
 * wrong with its cube, so that less than a tenth of that is. Before air and behind it is one piece each, without doubt. The
 * last piece is what is left where there are too many, or too many turns of loops. */
const char nb_air_haze_text[] =
    "#define PASS_KNOTS 64\n"
    "struct pass_knot { float at; nebel_light fog; nebel_light air; };\n"
    /* Goes on with the fog of a ray, up to t. */
    "nebel_light pass_on(inout nb_progress progress, nebel_sight sight, int entry, float t)\n"
    "{\n"
    "    if (!nb_is_ray(sight.origin, sight.direction, t)) return nb_clear();\n"
    "#ifdef NEBEL_TILES\n"
    "    nb_media media = nb_media_of(NEBEL_INDEX(entry), NEBEL_INDEX(entry + 1), true);\n"
    "#else\n"
    "    nb_media media = nb_media_of(0, int(NEBEL_WORD(0).x), false);\n"
    "#endif\n"
    "    progress.stage = NB_STAGE_WALK;\n"
    "    return nb_trace_further(progress, nb_ray_up_to(sight.origin, sight.direction, t, true), media, true, true);\n"
    "}\n"
    "float pass_largest(vec3 v) { return max(v.x, max(v.y, v.z)); }\n"
    "float pass_doubt(pass_knot a, pass_knot b)\n"
    "{\n"
    "    vec3 fog = (a.fog.transmittance - b.fog.transmittance) * (b.air.in_scattering - a.air.in_scattering);\n"
    "    vec3 air = (a.air.transmittance - b.air.transmittance) * (b.fog.in_scattering - a.fog.in_scattering);\n"
    "    return pass_largest(0.5 * (abs(fog) + abs(air)));\n"
    "}\n"
    "vec3 pass_piece(pass_knot a, pass_knot b)\n"
    "{\n"
    "    return 0.5 * ((a.fog.transmittance + b.fog.transmittance) * (b.air.in_scattering - a.air.in_scattering) +\n"
    "                  (a.air.transmittance + b.air.transmittance) * (b.fog.in_scattering - a.fog.in_scattering));\n"
    "}\n"
    "nebel_light pass_haze(nebel_sight sight, int entry)\n"
    "{\n"
    "    nb_progress progress = nb_open_progress();\n"
    "    pass_knot from, here;\n"
    "    float begin, end;\n"
    "    find_airs(sight.direction, begin, end);\n"
    "    begin = min(begin, sight.t_max);\n"
    "    end = min(end, sight.t_max);\n"
    "    nebel_light air = airs_up_to(end);\n"
    "    float brightest = pass_largest(air.in_scattering);\n"
    "    float counts = max(brightest, pass_largest(1.0 - air.transmittance));\n"
    "    float tolerance = 1e-3 * max(1.0, brightest);\n"
    "    float way = (end - begin) * clamp(tolerance / max(counts, 1e-6), 1e-6, 0.5);\n"
    "    from.at = 0.0;\n"
    "    from.fog = from.air = nb_clear();\n"
    "    vec3 light = vec3(0.0);\n"
    "    bool is_last = false;\n"
    "    for (int i = 0; i < PASS_KNOTS && from.at < sight.t_max && !is_last; i++) {\n"
    "        nb_progress further = progress;\n"
    "        is_last = i + 1 == PASS_KNOTS || nb_is_tired(progress.turns);\n"
    "        here.at = from.at < begin ? begin : from.at < end ? min(from.at + way, end) : sight.t_max;\n"
    "        if (is_last || !(here.at > from.at)) here.at = sight.t_max;\n"
    "        here.fog = pass_on(further, sight, entry, here.at);\n"
    "        here.air = airs_up_to(here.at);\n"
    "        float doubt = pass_doubt(from, here);\n"
    "        if (from.at >= begin) way = (here.at - from.at) * clamp(0.9 * sqrt(tolerance / max(doubt, 1e-9)), 0.1, "
    "4.0);\n"
    "        progress.turns = further.turns;\n"
    "        if (doubt <= tolerance || is_last) {\n"
    "            light += pass_piece(from, here);\n"
    "            from = here;\n"
    "            progress = further;\n"
    "        }\n"
    "    }\n"
    "    nebel_light all;\n"
    "    all.transmittance = from.fog.transmittance * from.air.transmittance;\n"
    "    all.in_scattering = max(light, 0.0);\n"
    "    return all;\n"
    "}\n";

/* Surfaces on the ground touch it: they are seen where they lie this little behind it, which is more than rounding. From
 * on the ground or below it all surfaces are seen before it. */
const char nb_air_ground_text[] =
    "layout(location = 0) out highp vec4 out_place;\n"
    "layout(location = 1) out highp vec4 out_normal;\n"
    "layout(location = 2) out highp vec4 out_reflectance;\n"
    "void main()\n"
    "{\n"
    "    int world;\n"
    "    nebel_ground ground = nearest_ground(ray_direction(gl_FragCoord.xy), world);\n"
    "    if (!(ground.distance < 1e17)) discard;\n"
    "    out_place = vec4(max(ground.distance, 1e-30), ground.normal);\n"
    "    out_normal = vec4(ground.normal, 0.0);\n"
    "    out_reflectance = vec4(world_albedos[world], 1.0);\n"
    "    gl_FragDepth = ground.distance > 0.0 ? 1.0 / (1.001 + 1.00001 * ground.distance) : 1e-30;\n"
    "}\n";

/* The disc is darker towards its edge, mu^a (src/cpu/air.c says by whom). Its edge is spread over a pixel, and one of less is
 * widened to that; rings say how much light it would have then. */
const char nb_air_sun_text[] =
    "uniform float disc_radius;\n" /* radians; 0: there is none */
    "uniform vec3 disc_light;\n"   /* mean radiance above the air */
    "uniform bool sky_is_ambient;\n"
    "float pixel_width(vec2 pixel)\n"
    "{\n"
    "#ifdef SCENE_PANORAMA\n"
    "    return 1.5707963267949 * RAY_WORD(1).y;\n"
    "#else\n"
    "    return length(RAY_WORD(5)) / length(RAY_WORD(3) + pixel.x * RAY_WORD(4) + pixel.y * RAY_WORD(5));\n"
    "#endif\n"
    "}\n"
    "vec3 disc_at(float radius, float width, float angle)\n"
    "{\n"
    "    vec3 powers = vec3(-0.023) + 0.292 / vec3(0.68, 0.55, 0.44);\n"
    "    float cover = clamp((radius - angle) / width + 0.5, 0.0, 1.0), part = angle / (radius + 0.5 * width);\n"
    "    float mu = sqrt(max(1.0 - part * part, 1e-12));\n"
    "    return 0.5 * cover * (powers + 2.0) * pow(vec3(mu), powers);\n"
    "}\n"
    /* What of the disc another leaves, as base/eclipse.h has it: both count as flat. */
    "float disc_left(float ball, float apart)\n"
    "{\n"
    "    float sun = disc_radius;\n"
    "    if (!(apart < sun + ball)) return 1.0;\n"
    "    if (apart <= ball - sun) return 0.0;\n"
    "    if (apart <= sun - ball) return 1.0 - ball * ball / (sun * sun);\n"
    "    float across = (apart - ball) * (apart + ball);\n"
    "    float a = acos(clamp((across + sun * sun) / (2.0 * apart * sun), -1.0, 1.0));\n"
    "    float b = acos(clamp((across + 2.0 * ball * ball - sun * sun) / (2.0 * apart * ball), -1.0, 1.0));\n"
    "    float overlap = sun * sun * (a - sin(a) * cos(a)) + ball * ball * (b - sin(b) * cos(b));\n"
    "    return clamp(1.0 - overlap / (3.14159265358979 * sun * sun), 0.0, 1.0);\n"
    "}\n"
    /* What other planets leave of it at a place, from the eye. */
    "float uneclipsed(int world, vec3 at)\n"
    "{\n"
    "    float left = 1.0;\n"
    "    for (int k = 0; k < SCENE_WORLDS; k++) {\n"
    "        float radius = world_sizes[k].x;\n"
    "        vec3 to_ball = -(radius + world_eyes[k].w) * world_eyes[k].xyz - at;\n"
    "        float far = length(to_ball), tangent = sqrt(max((far - radius) * (far + radius), 0.0));\n"
    "        if (k == world) continue;\n"
    "        if (!(far > radius)) return 0.0;\n"
    "        left *= disc_left(atan(radius, tangent),\n"
    "                          atan(length(cross(to_ball, scene_sun)), dot(to_ball, scene_sun)));\n"
    "    }\n"
    "    return left;\n"
    "}\n"
    "vec3 sun_disc(vec3 direction, vec2 pixel)\n"
    "{\n"
    "    float width = pixel_width(pixel), radius = max(disc_radius, 0.5 * width);\n"
    "    float angle = length(direction - scene_sun), far = radius + 0.5 * width, ring = far / 32.0;\n"
    "    int rings = disc_radius > 0.0 && angle < far ? 32 : 0;\n"
    "    vec3 sum = vec3(0.0);\n"
    "    for (int i = 0; i < rings; i++) {\n"
    "        float at = (float(i) + 0.5) * ring;\n"
    "        sum += 2.0 * at * ring * disc_at(radius, width, at);\n"
    "    }\n"
    "    if (rings == 0) return vec3(0.0);\n"
    "    return disc_light * disc_radius * disc_radius / sum * disc_at(radius, width, angle);\n"
    "}\n";

const char nb_air_light_text[] =
    "void light_ground(vec3 direction, vec3 at, inout vec3 light, inout vec3 shining)\n"
    "{\n"
    "    int world;\n"
    "    nebel_ground ground = nearest_ground(direction, world);\n"
    "    light = 0.31830988618379 * ground.sky;\n"
    "    shining = 0.31830988618379 * uneclipsed(world, at) * ground.sun;\n"
    "}\n"
    /* The square of the tangent from a place to the ball that ends `above` the ground of a planet. */
    "float world_power(int world, vec3 at, float above)\n"
    "{\n"
    "    float radius = world_sizes[world].x, height = world_eyes[world].w;\n"
    "    return (height - above) * (2.0 * radius + height + above) +\n"
    "           2.0 * (radius + height) * dot(world_eyes[world].xyz, at) + dot(at, at);\n"
    "}\n"
    "float height_of(float radius, float power) { return power / (radius + sqrt(max(radius * radius + power, 0.0))); "
    "}\n"
    /* The table of base/daylight.h: of the way to a sun that is not below the level. */
    "vec3 daylight_depth(int first, float height, float cosine)\n"
    "{\n"
    "    vec2 h = nb_air_place(sqrt(clamp(height, 0.0, 1.0)) * (NB_DAYLIGHT_HEIGHTS - 1.0), NB_DAYLIGHT_HEIGHTS);\n"
    "    vec2 s = nb_air_place(sqrt(clamp(cosine, 0.0, 1.0)) * (NB_DAYLIGHT_SUNS - 1.0), NB_DAYLIGHT_SUNS);\n"
    "    int at = first + int(h.x) * int(NB_DAYLIGHT_SUNS) + int(s.x), above = at + int(NB_DAYLIGHT_SUNS);\n"
    "    vec3 low = nb_toward(NEBEL_AIR_WORD(at).xyz, NEBEL_AIR_WORD(at + 1).xyz, s.y);\n"
    "    vec3 high = nb_toward(NEBEL_AIR_WORD(above).xyz, NEBEL_AIR_WORD(above + 1).xyz, s.y);\n"
    "    return nb_toward(low, high, h.y);\n"
    "}\n"
    /* A sun below the level is seen along the whole level ray through the lowest place of the way to it, but for the part
       behind the eye. */
    "vec3 daylight_sun(int world, int first, float power, float rise)\n"
    "{\n"
    "    float radius = world_sizes[world].x, thickness = world_sizes[world].y;\n"
    "    float height = height_of(radius, power), cosine = rise / (radius + height);\n"
    "    vec3 own = vec3(0.0), low = vec3(0.0);\n"
    "    if (height <= thickness) own = daylight_depth(first, height / thickness, abs(cosine));\n"
    "    if (cosine >= 0.0) return exp(-own);\n"
    "    float lowest = height_of(radius, power - rise * rise);\n"
    "    if (!(lowest >= 0.0)) return vec3(0.0);\n"
    "    if (lowest <= thickness) low = daylight_depth(first, lowest / thickness, 0.0);\n"
    "    return exp(min(own - 2.0 * low, 0.0));\n"
    "}\n"
    "vec3 daylight_sky(int first, float cosine)\n"
    "{\n"
    "    float spread = sign(cosine) * log(1.0 + abs(cosine) / NB_DAYLIGHT_TWILIGHT) / log(1.0 + 1.0 / "
    "NB_DAYLIGHT_TWILIGHT);\n"
    "    vec2 s = nb_air_place(0.5 * (spread + 1.0) * (NB_DAYLIGHT_SKIES - 1.0), NB_DAYLIGHT_SKIES);\n"
    "    int at = first + int(NB_DAYLIGHT_HEIGHTS * NB_DAYLIGHT_SUNS) + int(s.x);\n"
    "    return exp(nb_toward(NEBEL_AIR_WORD(at).xyz, NEBEL_AIR_WORD(at + 1).xyz, s.y));\n"
    "}\n"
    /* Models have the sun and the sky of the planet that is nearest by tangents to the balls of air. */
    "void light_model(vec3 at, inout vec3 light, inout vec3 shining)\n"
    "{\n"
    "    int world = 0;\n"
    "    for (int k = 1; k < SCENE_WORLDS; k++)\n"
    "        if (world_power(k, at, world_sizes[k].y) < world_power(world, at, world_sizes[world].y)) world = k;\n"
    "    int first = world_words[world].y;\n"
    "    if (first < 0) return;\n"
    "    float radius = world_sizes[world].x, power = world_power(world, at, 0.0);\n"
    "    float rise = dot((radius + world_eyes[world].w) * world_eyes[world].xyz + at, scene_sun);\n"
    "    choose_world(world);\n"
    "    shining *= uneclipsed(world, at) * daylight_sun(world, first, power, rise);\n"
    "    float far = radius + height_of(radius, power);\n"
    "    if (sky_is_ambient) light *= daylight_sky(first, far > 0.0 ? clamp(rise / far, -1.0, 1.0) : 1.0);\n"
    "}\n";
