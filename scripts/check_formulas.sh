#!/bin/bash
# Compiles all formulas in every language they are written for: C in float and double, each instruction set, with both
# compilers, NEON with the cross compiler, GLSL 3.30 and GLSL ES 3.00. In the order of src/formulas/ORDER.
set -euo pipefail
cd "$(dirname "$0")/.."

formulas=src/formulas
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
targets=0

mapfile -t order < <(grep -v '^#' "$formulas/ORDER")
listed=$(printf '%s\n' "${order[@]}" | sort)
present=$(cd "$formulas" && printf '%s\n' *.inc | sort)
if [ "$listed" != "$present" ]; then
    echo "check_formulas: src/formulas/ORDER and the files there differ:"
    diff <(echo "$listed") <(echo "$present") || true
    exit 1
fi

# verdict NAME COMMAND...: one line for each target that fails, beside as many others as there are processors. A warning is a failure.
verdict() {
    local name=$1 output=$work/output_$targets
    shift
    if [ "$(jobs -rp | wc -l)" -ge "$(nproc)" ]; then wait -n; fi
    if "$@" >"$output" 2>&1 && ! grep -q '^WARNING' "$output"; then
        rm "$output"
    else
        echo "check_formulas: $name:"
        head -40 "$output"
    fi &
}

# The files of the next target.
name_files() {
    targets=$((targets + 1))
    object=$work/formulas_$targets.o
    shader=$work/formulas_$targets.frag
}

warnings=(-Wall -Wextra -Wpedantic -Wconversion -Wdouble-promotion -Wshadow -Wstrict-prototypes -Wmissing-prototypes
    -Wno-psabi -Wno-unused-function -Werror)

{
    echo '#include "formulas/prelude.h"'
    printf '#include "formulas/%s"\n' "${order[@]}"
    echo "extern int translation_unit_is_not_empty;"
} >"$work/formulas.c"

# try_c COMPILER NAME FLAGS...: gcc also makes code of functions that nothing calls.
try_c() {
    local compiler=$1 name=$2
    shift 2
    local keep=()
    case $compiler in *gcc) keep=(-fkeep-inline-functions -fkeep-static-functions) ;; esac
    for width in "" -DNB_FAST=1; do
        name_files
        verdict "$compiler, $name $width" "$compiler" -std=c11 -O1 -ffp-contract=off -fno-math-errno "${warnings[@]}" \
            "${keep[@]}" -Isrc -Iinclude "$@" $width -c "$work/formulas.c" -o "$object"
    done
}

# try_glsl VERSION PRELUDE...
try_glsl() {
    local version=$1
    shift
    name_files
    {
        echo "#version $version"
        for file in "$@" prelude_glsl.glsl prelude_shader.glsl; do cat "$formulas/$file"; done
        for file in "${order[@]}"; do cat "$formulas/$file"; done
        echo "out vec4 color;"
        echo "void main() { color = vec4(0.0); }"
    } >"$shader"
    verdict "GLSL $version" glslangValidator -S frag "$shader"
}

for compiler in gcc clang; do
    try_c $compiler scalar
    try_c $compiler double -DNB_DOUBLE=1
    if [ "$(uname -m)" = x86_64 ]; then
        try_c $compiler sse2 -DNB_ISA_SSE2=1 -msse2
        try_c $compiler 'sse2, double' -DNB_DOUBLE=1 -DNB_ISA_SSE2=1 -msse2
        try_c $compiler avx2 -DNB_ISA_AVX2=1 -mavx2 -mfma
        try_c $compiler 'avx2, double' -DNB_DOUBLE=1 -DNB_ISA_AVX2=1 -mavx2 -mfma
        try_c $compiler avx512 -DNB_ISA_AVX512=1 -mavx512f -mavx512dq -mavx512bw -mavx512vl -mfma -mavx2
        try_c $compiler 'avx512, double' -DNB_DOUBLE=1 -DNB_ISA_AVX512=1 -mavx512f -mavx512dq -mavx512bw -mavx512vl -mfma -mavx2
    fi
done
try_c aarch64-linux-gnu-gcc neon -DNB_ISA_NEON=1
try_c aarch64-linux-gnu-gcc 'neon, double' -DNB_DOUBLE=1 -DNB_ISA_NEON=1
try_glsl "330 core"
try_glsl "300 es" prelude_300es.glsl

wait
failed=$(find "$work" -name 'output_*' | wc -l)
echo "check_formulas: ${#order[@]} files, $((targets - failed)) targets passed, $failed failed"
[ "$failed" -eq 0 ]
