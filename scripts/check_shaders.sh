#!/bin/bash
# Compiles the shader texts as a host would include them: OpenGL's dialects with every source of words, Vulkan's and HLSL's
# with declarations of their own; and the shader of docs/shaders.md.
set -euo pipefail
cd "$(dirname "$0")/.."

work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
texts=0

# verdict NAME COMMAND...: beside as many others as there are processors. A warning is a failure.
verdict() {
    local name=$1 output=$work/output_$texts
    shift
    if [ "$(jobs -rp | wc -l)" -ge "$(nproc)" ]; then wait -n; fi
    if "$@" >"$output" 2>&1 && ! grep -q '^WARNING' "$output"; then
        rm "$output"
    else
        echo "check_shaders: $name:"
        head -40 "$output"
    fi &
}

# Where the next text goes: $file, but for its ending.
name_file() {
    texts=$((texts + 1))
    file=$work/fog_$texts
}

text() {
    if [ ! -e "$work/text_$1" ]; then cmake -DSOURCE="$PWD" -DDIALECT="$1" -DOUTPUT="$work/text_$1" -P cmake/NebelShaderText.cmake; fi
    cat "$work/text_$1"
}

calls='
    nebel_view_ray sight = nebel_make_view_ray(place.xy, place.z);
    nebel_transfer transfer = nebel_trace(sight.origin, sight.direction, sight.t_max);
    nebel_transfer listed = nebel_trace_list(sight.origin, sight.direction, sight.t_max, 3, 4);
    transfer.transmittance *= nebel_transmit(sight.origin, sight.direction, 2.0);
    transfer.transmittance *= nebel_transmit_list(sight.origin, sight.direction, 3.0, 0, 1);
    transfer.in_scattering += listed.transmittance * listed.in_scattering;
    nebel_blend blend = nebel_blend_over(place, 0.5, transfer);
    blend.source += nebel_blend_premultiplied(place, 0.5, transfer).source + nebel_blend_additive(place, transfer).source;
    blend.factor *= nebel_blend_multiply(place, transfer).factor * nebel_blend_screen(place, transfer).factor;
    float way = nebel_sphere_path_length(sight.origin, sight.direction, sight.t_max, place, 2.0, 3);
    way += nebel_gaussian_path_length(sight.origin, sight.direction, sight.t_max, place, 3.0, 1.0);
    blend.factor *= nebel_blend_medium(nebel_medium_transfer(way, place, place), transfer).factor;
    nebel_transfer air = nebel_trace_atmosphere(sight.direction, sight.t_max);
    nebel_ground ground = nebel_trace_ground(sight.direction);
    transfer.in_scattering += air.transmittance * air.in_scattering + ground.distance * ground.normal + ground.sun + ground.sky;
    transfer.in_scattering += nebel_evaluate_environment(sight.direction) * nebel_evaluate_environment_diffuse(place);
    transfer.in_scattering += nebel_blend_gray(blend).xyz * nebel_five_taps(place.xy, place.z, nebel_default_taps());'

# try_opengl DIALECT VERSION DEFINES
try_opengl() {
    name_file
    {
        printf '#version %s\n#define NEBEL_VIEW\n#define NEBEL_TILES\n#define NEBEL_TRANSPARENT\n#define NEBEL_SKY_VIEW\n%b' "$2" "$3"
        printf 'uniform highp sampler2D opaque;\n#define NEBEL_OPAQUE_DEPTH(at) texture(opaque, at).x\n'
        text "$1"
        printf 'in highp vec3 place; out highp vec4 color;\nvoid main()\n{%s\n' "$calls"
        printf '    color = vec4(transfer.transmittance + transfer.in_scattering, 1.0);\n}\n'
    } >"$file.frag"
    verdict "$1 $3" glslangValidator "$file.frag"
}

# Each feature alone, so that nothing calls what is not declared without another.
alone=()
for ((bit = 0; bit < 25; bit++)); do alone+=("#define NEBEL_FEATURES_LITERAL\n#define NEBEL_FEATURES $((1 << bit))\n"); done
for defines in "${alone[@]}" "" "#define NEBEL_FOG_TEXTURE\n" "#define NEBEL_FEATURES 2\n" "#define NEBEL_FEATURES 2u\n" "#define NEBEL_FEATURES_LITERAL\n#define NEBEL_FEATURES 2\n" "#define NEBEL_VOXELS\n#define NEBEL_DIFFUSION\n#define NEBEL_ENVIRONMENT\n" "uniform highp vec4 w[99];\n#define NEBEL_FOG_TEXEL(i) w[i]\n"; do
    try_opengl glsl_330 "330 core" "$defines"
done
for defines in "" "#define NEBEL_FOG_TEXTURE\n" "#define NEBEL_FEATURES 2\n" "#define NEBEL_FEATURES 2u\n" "#define NEBEL_FEATURES_LITERAL\n#define NEBEL_FEATURES 2097154\n" "#define NEBEL_FEATURES_LITERAL\n#define NEBEL_FEATURES 4194306\n" "#define NEBEL_VOXELS\n#define NEBEL_DIFFUSION\n#define NEBEL_ENVIRONMENT\n"; do
    try_opengl glsl_300_es "300 es" "$defines"
done

# try_vulkan DEFINES
try_vulkan() {
    name_file
    {
        cat <<'GLSL'
#version 450
layout(std140, binding = 0) uniform fog { vec4 words[1024]; };
layout(std430, binding = 1) readonly buffer tiles { uint entries[]; };
layout(std140, binding = 2) uniform view { vec4 rays[10]; };
layout(binding = 3) uniform sampler2D opaque;
layout(std430, binding = 4) readonly buffer grids { uvec4 texels[]; };
layout(std430, binding = 5) readonly buffer lattice { vec4 nodes[]; };
layout(std430, binding = 6) readonly buffer sky { vec4 lights[]; };
layout(std430, binding = 7) readonly buffer air { vec4 airs[]; };
layout(location = 0) in vec3 place;
layout(location = 0) out vec4 color;
#define NEBEL_VIEW
#define NEBEL_TRANSPARENT
#define NEBEL_FOG_TEXEL(i) words[i]
#define NEBEL_TILE_ENTRY(i) int(entries[i])
#define NEBEL_VOXEL_TEXEL(i) texels[i]
#define NEBEL_DIFFUSION_TEXEL(i) nodes[i]
#define NEBEL_ENVIRONMENT_TEXEL(i) lights[i]
#define NEBEL_SKY_VIEW_TEXEL(i) airs[i]
#define NEBEL_RAY(i) rays[i]
#define NEBEL_OPAQUE_DEPTH(at) texture(opaque, at).x
GLSL
        printf '%b' "$1"
        text glsl_450
        printf 'void main()\n{%s\n    color = vec4(transfer.transmittance + transfer.in_scattering, 1.0);\n}\n' "$calls"
    } >"$file.frag"
    verdict "glsl_450 $1" glslangValidator -V "$file.frag" -o "$file.spv"
}

# try_hlsl DEFINES
try_hlsl() {
    name_file
    {
        cat <<'HLSL'
cbuffer fog { float4 words[1024]; };
cbuffer view { float4 rays[10]; };
StructuredBuffer<uint> entries;
StructuredBuffer<uint4> texels;
StructuredBuffer<float4> nodes;
StructuredBuffer<float4> lights;
StructuredBuffer<float4> airs;
Texture2D opaque;
SamplerState opaque_sampler;
#define NEBEL_VIEW
#define NEBEL_TRANSPARENT
#define NEBEL_FOG_TEXEL(i) words[i]
#define NEBEL_TILE_ENTRY(i) int(entries[i])
#define NEBEL_VOXEL_TEXEL(i) texels[i]
#define NEBEL_DIFFUSION_TEXEL(i) nodes[i]
#define NEBEL_ENVIRONMENT_TEXEL(i) lights[i]
#define NEBEL_SKY_VIEW_TEXEL(i) airs[i]
#define NEBEL_RAY(i) rays[i]
#define NEBEL_OPAQUE_DEPTH(at) opaque.SampleLevel(opaque_sampler, at, 0.0).x
HLSL
        printf '%b' "$1"
        text hlsl
        printf 'float4 main(float3 place : TEXCOORD0) : SV_Target\n{%s\n' "$calls"
        printf '    return float4(transfer.transmittance + transfer.in_scattering, 1.0);\n}\n'
    } >"$file.hlsl"
    verdict "hlsl $1" glslangValidator -D -S frag -e main -V "$file.hlsl" -o "$file.spv"
}

for defines in "" "#define NEBEL_FEATURES 2u\n" "#define NEBEL_FEATURES_LITERAL\n#define NEBEL_FEATURES 2\n"; do
    try_vulkan "$defines"
    try_hlsl "$defines"
done

name_file
text glsl_330 >"$work/glsl_330"
sed -n '/^```glsl$/,/^```$/p' docs/shaders.md | sed '/^```/d' | sed -e "/^\/\/ here:/r $work/glsl_330" >"$file.frag"
verdict docs/shaders.md glslangValidator "$file.frag"

wait
failed=$(find "$work" -name 'output_*' | wc -l)
echo "check_shaders: $((texts - failed)) texts passed, $failed failed"
[ "$failed" -eq 0 ]
