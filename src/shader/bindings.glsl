/* Where OpenGL's dialects read words and indices from, unless the host says. */
#ifndef NEBEL_FOG_TEXEL
#ifdef NEBEL_FOG_TEXTURE
uniform highp sampler2D nebel_fog_texture;
#define NEBEL_FOG_TEXEL(i) texelFetch(nebel_fog_texture, ivec2((i) & 1023, (i) >> 10), 0)
#else
layout(std140) uniform nebel_fog_block { vec4 nebel_texels[1024]; };
#define NEBEL_FOG_TEXEL(i) nebel_texels[i]
#endif
#endif
#if defined(NEBEL_TILES) && !defined(NEBEL_TILE_ENTRY)
uniform highp usampler2D nebel_tile_texture;
#define NEBEL_TILE_ENTRY(i) int(texelFetch(nebel_tile_texture, ivec2((i) & 1023, (i) >> 10), 0).x)
#endif
#if defined(NEBEL_VOXELS) && !defined(NEBEL_VOXEL_TEXEL)
uniform highp usampler2D nebel_voxel_texture;
#define NEBEL_VOXEL_TEXEL(i) texelFetch(nebel_voxel_texture, ivec2((i) & 1023, (i) >> 10), 0)
#endif
#if defined(NEBEL_DIFFUSION) && !defined(NEBEL_DIFFUSION_TEXEL)
uniform highp sampler2D nebel_diffusion_texture;
#define NEBEL_DIFFUSION_TEXEL(i) texelFetch(nebel_diffusion_texture, ivec2((i) & 1023, (i) >> 10), 0)
#endif
#if defined(NEBEL_ENVIRONMENT) && !defined(NEBEL_ENVIRONMENT_TEXEL)
uniform highp sampler2D nebel_environment_texture;
#define NEBEL_ENVIRONMENT_TEXEL(i) texelFetch(nebel_environment_texture, ivec2((i) & 1023, (i) >> 10), 0)
#endif
#if defined(NEBEL_SKY_VIEW) && !defined(NEBEL_SKY_VIEW_TEXEL)
uniform highp sampler2D nebel_sky_view_texture;
#define NEBEL_SKY_VIEW_TEXEL(i) texelFetch(nebel_sky_view_texture, ivec2((i) & 1023, (i) >> 10), 0)
#endif
#if defined(NEBEL_VIEW) && !defined(NEBEL_RAY)
uniform vec4 nebel_rays[10];
#define NEBEL_RAY(i) nebel_rays[i]
#endif
