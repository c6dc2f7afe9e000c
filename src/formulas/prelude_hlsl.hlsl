/* Names of HLSL, shader model 5. prelude_shader.glsl follows. */
#define NB_GLOBAL static
#define nb_vec2 float2
#define nb_vec3 float3
#define nb_vec4 float4
#define nb_uvec4 uint4
#define nb_to_bits asint
#define nb_from_bits asfloat
#define nb_round_even round
