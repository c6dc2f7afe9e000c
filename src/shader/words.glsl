/* Where OpenGL's dialects read words and indices from, unless the host says. */
#ifndef NEBEL_WORD
#ifdef NEBEL_TEXTURE
uniform highp sampler2D nebel_fog_texture;
#define NEBEL_WORD(i) texelFetch(nebel_fog_texture, ivec2((i) & 1023, (i) >> 10), 0)
#else
layout(std140) uniform nebel_fog_block { vec4 nebel_words[1024]; };
#define NEBEL_WORD(i) nebel_words[i]
#endif
#endif
#if defined(NEBEL_TILES) && !defined(NEBEL_INDEX)
uniform highp usampler2D nebel_tile_texture;
#define NEBEL_INDEX(i) int(texelFetch(nebel_tile_texture, ivec2((i) & 1023, (i) >> 10), 0).x)
#endif
#if defined(NEBEL_VOXELS) && !defined(NEBEL_VOXEL)
uniform highp usampler2D nebel_voxel_texture;
#define NEBEL_VOXEL(i) texelFetch(nebel_voxel_texture, ivec2((i) & 1023, (i) >> 10), 0)
#endif
#if defined(NEBEL_DIFFUSION) && !defined(NEBEL_NODE)
uniform highp sampler2D nebel_node_texture;
#define NEBEL_NODE(i) texelFetch(nebel_node_texture, ivec2((i) & 1023, (i) >> 10), 0)
#endif
#if defined(NEBEL_ENVIRONMENT) && !defined(NEBEL_ENVIRONMENT_WORD)
uniform highp sampler2D nebel_environment_texture;
#define NEBEL_ENVIRONMENT_WORD(i) texelFetch(nebel_environment_texture, ivec2((i) & 1023, (i) >> 10), 0)
#endif
#if defined(NEBEL_AIR) && !defined(NEBEL_AIR_WORD)
uniform highp sampler2D nebel_air_texture;
#define NEBEL_AIR_WORD(i) texelFetch(nebel_air_texture, ivec2((i) & 1023, (i) >> 10), 0)
#endif
#if defined(NEBEL_VIEW) && !defined(NEBEL_RAY)
uniform vec4 nebel_rays[10];
#define NEBEL_RAY(i) nebel_rays[i]
#endif
