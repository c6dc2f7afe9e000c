#!/bin/bash
# Compiles all formulas in every language they are written for: C in float and double, each instruction set, with both
# compilers, NEON with the cross compiler, GLSL 3.30 and GLSL ES 3.00. In the order of src/formulas/ORDER.
set -euo pipefail
cd "$(dirname "$0")/.."

formulas=src/formulas
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
passed=0
failed=0

mapfile -t order < <(grep -v '^#' "$formulas/ORDER")
listed=$(printf '%s\n' "${order[@]}" | sort)
present=$(cd "$formulas" && printf '%s\n' *.inc | sort)
if [ "$listed" != "$present" ]; then
    echo "check_formulas: src/formulas/ORDER and the files there differ:"
    diff <(echo "$listed") <(echo "$present") || true
    exit 1
fi

# verdict NAME COMMAND...: one line for each target; a warning is a failure.
verdict() {
    local name=$1
    shift
    if "$@" >"$work/output" 2>&1 && ! grep -q '^WARNING' "$work/output"; then
        passed=$((passed + 1))
    else
        failed=$((failed + 1))
        echo "check_formulas: $name:"
        head -40 "$work/output"
    fi
}

warnings=(-Wall -Wextra -Wpedantic -Wconversion -Wdouble-promotion -Wshadow -Wstrict-prototypes -Wmissing-prototypes
    -Wno-psabi -Wno-unused-function -Werror)

c_source() {
    echo "#include \"formulas/$1\""
    printf '#include "formulas/%s"\n' "${order[@]}"
    echo "extern int translation_unit_is_not_empty;"
}

# try_c COMPILER LEVEL PRELUDE FLAGS...: gcc also makes code of functions that nothing calls.
try_c() {
    local compiler=$1 level=$2 prelude=$3
    shift 3
    local keep=()
    case $compiler in *gcc) keep=(-fkeep-inline-functions -fkeep-static-functions) ;; esac
    c_source "$prelude" >"$work/formulas.c"
    verdict "$compiler, $level" "$compiler" -std=c11 -O2 -ffp-contract=off -fno-math-errno "${warnings[@]}" "${keep[@]}" \
        -Isrc -Iinclude "-DNB_ISA_${level^^}=1" "-DNB_SUFFIX=$level" "$@" -c "$work/formulas.c" -o "$work/formulas.o"
}

try_glsl() {
    local prelude=$1 version=$2
    {
        grep -q '^#version' "$formulas/$prelude" || echo "#version $version"
        cat "$formulas/$prelude"
        for file in "${order[@]}"; do cat "$formulas/$file"; done
        echo "out vec4 color;"
        echo "void main() { color = vec4(0.0); }"
    } >"$work/formulas.frag"
    verdict "GLSL $version" glslangValidator -S frag "$work/formulas.frag"
}

for compiler in gcc clang; do
    try_c $compiler scalar prelude_c.h
    try_c $compiler double prelude_c.h
    if [ "$(uname -m)" = x86_64 ]; then
        try_c $compiler sse2 prelude_simd.h -msse2
        try_c $compiler avx2 prelude_simd.h -mavx2 -mfma
        try_c $compiler avx512 prelude_simd.h -mavx512f -mavx512dq -mavx512bw -mavx512vl -mfma -mavx2
    fi
done
try_c aarch64-linux-gnu-gcc neon prelude_simd.h
try_glsl prelude_330.glsl "330 core"
try_glsl prelude_300es.glsl "300 es"

echo "check_formulas: ${#order[@]} files, $passed targets passed, $failed failed"
[ "$failed" -eq 0 ]
