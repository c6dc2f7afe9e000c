/* Balls of smoke for embed_particles.c: where they are, and the shader that draws them in fog before an opaque picture.
 */
#ifndef PARTICLES_H
#define PARTICLES_H

#include "engine.h"

#include <nebel/shader.h>

#include <stdlib.h>

/* Squares towards the camera, around balls relative to the eye. */
static const char *const particle_vertex_text =
    "#version 330 core\n"
    "uniform mat4 eye_from_world, clip_from_eye;\n"
    "uniform vec4 balls[16];\n"
    "flat out vec4 ball;\n"
    "void main()\n"
    "{\n"
    "    ball = balls[gl_InstanceID];\n"
    "    vec2 corner = vec2(gl_VertexID & 1, gl_VertexID >> 1) * 2.0 - 1.0;\n"
    "    gl_Position = clip_from_eye * vec4(mat3(eye_from_world) * ball.xyz + vec3(1.3 * ball.w * corner, 0.0), 1.0);\n"
    "}\n";
/* Before nebel_get_shader_source: what it should declare, and the depth along the axis of engine.h; below 0 there is nothing.
 */
static const char *const particle_defines =
    "#version 330 core\n"
    "uniform sampler2D depth;\n"
    "float axis_depth(float d) { return d < 1.0 ? 100.0 / (1000.0 - 999.9 * d) : -1.0; }\n"
    "#define NEBEL_VIEW\n"
    "#define NEBEL_TRANSPARENT\n"
    "#define NEBEL_OPAQUE_DEPTH(place) axis_depth(texture(depth, place).x)\n";
/* Behind it. `sight` ends at the opaque surface. */
static const char *const particle_fragment_text =
    "flat in vec4 ball;\n"
    "uniform bool classic;\n"
    "layout(location = 0, index = 0) out vec4 source;\n"
    "layout(location = 0, index = 1) out vec4 factor;\n"
    "void main()\n"
    "{\n"
    "    nebel_view_ray sight = nebel_make_view_ray(gl_FragCoord.xy, texelFetch(depth, ivec2(gl_FragCoord.xy), 0).x);\n"
    "    vec2 place = gl_FragCoord.xy / vec2(textureSize(depth, 0));\n"
    "    float shown = classic ? nebel_five_taps(place, 1.0 / gl_FragCoord.w, nebel_default_taps()) : 1.0;\n"
    "    float end = classic ? 1e18 : sight.t_max;\n"
    "    float way = shown * nebel_sphere_path_length(sight.origin, sight.direction, end, ball.xyz, ball.w, 2);\n"
    "    nebel_transfer smoke = nebel_medium_transfer(way, vec3(2.0, 2.5, 3.0), vec3(1.8, 1.6, 1.4));\n"
    "    nebel_transfer fog = nebel_trace(sight.origin, sight.direction, min(sight.t_max, length(ball.xyz)));\n"
    "    nebel_blend blend = nebel_blend_medium(smoke, fog);\n"
    "    source = vec4(blend.source, 0.0);\n"
    "    factor = vec4(blend.factor, 1.0);\n"
    "}\n";

/* For fog that has no more than this. */
static inline unsigned particles_open(const nebel_lighting *lighting)
{
    char features[40];
    const char *const texts[] = {particle_defines, features, nebel_get_shader_source(NEBEL_DIALECT_GLSL_330),
                                 particle_fragment_text};
    const unsigned program = glCreateProgram();
    snprintf(features, sizeof features, "#define NEBEL_FEATURES %u\n", nebel_pack_features(lighting));
    engine_add_shader(program, GL_VERTEX_SHADER, 1, &particle_vertex_text);
    engine_add_shader(program, GL_FRAGMENT_SHADER, 4, texts);
    glLinkProgram(program);
    return program;
}

enum { PARTICLES = 16 };

/* Relative to the eye. */
typedef struct particle {
    float center[3], radius;
} particle;

static inline float particle_square(const particle *p)
{
    return p->center[0] * p->center[0] + p->center[1] * p->center[1] + p->center[2] * p->center[2];
}

static inline int particle_order(const void *a, const void *b)
{
    const float difference = particle_square(b) - particle_square(a);
    return (difference > 0) - (difference < 0);
}

/* The farthest first. */
static inline void particles_place(particle particles[PARTICLES], const double eye[3])
{
    for (int i = 0; i < PARTICLES; i++) {
        const double angle = 2.4 * i, r = .8 * sqrt(i);
        const double at[3] = {r * cos(angle) - 1, .5 + .3 * sin(1.3 * i), r * sin(angle) + 1.5};
        for (int k = 0; k < 3; k++) particles[i].center[k] = (float)(at[k] - eye[k]);
        particles[i].radius = 1.2f;
    }
    qsort(particles, PARTICLES, sizeof *particles, particle_order);
}

#endif
