/* Names of GLSL 3.30, GLSL ES 3.00 and GLSL 4.50. prelude_shader.glsl follows. */
#define NB_GLOBAL
#define nb_vec2 vec2
#define nb_vec3 vec3
#define nb_vec4 vec4
#define nb_uvec4 uvec4
#define nb_to_bits floatBitsToInt
#define nb_from_bits intBitsToFloat
#define nb_round_even roundEven
