#!/bin/bash
# check_qemu.sh BUILD: the kernels on processors that this machine is not. Suites of the core for aarch64 (NEON), and those of BUILD on
# x86 models without AVX2, without AVX, and with AVX2; there the dispatcher must pick a level that the model has.
set -euo pipefail

build=$(cd "${1:?usage: check_qemu.sh BUILD}" && pwd)
source=$(cd "$(dirname "$0")/.." && pwd)
cross=$build/aarch64

# A suite and its arguments: emulation is some thirty times slower than the processor, and fewer rays are tried.
calls=("test_kernels 5000" "test_pixels 5000" test_pixel_types test_classic_vertices)
lit="test_lit_truth 1 500"
# Lit fog with AVX2 is left to real processors: qemu 7.2 reads what vpmaskmovd masks, where that instruction must not fault.
pairs=(aarch64 "$lit" Conroe "$lit")

# Only the suites that run are compiled.
build_aarch64() {
    local suites
    suites=$(printf '%s\n' "${calls[@]}" "$lit" | cut -d ' ' -f 1 | paste -s -d '|')
    cmake -S "$source" -B "$cross" -DCMAKE_SYSTEM_NAME=Linux -DCMAKE_SYSTEM_PROCESSOR=aarch64 \
        -DCMAKE_C_COMPILER=aarch64-linux-gnu-gcc -DCMAKE_EXE_LINKER_FLAGS=-static -DNEBEL_WERROR=ON -DNEBEL_BUILD_SCENE=OFF \
        -DNEBEL_BUILD_CPU=OFF -DNEBEL_BUILD_TESTS=ON -DNEBEL_TEST_SUITES="$suites"
    cmake --build "$cross" -j "$(nproc)" --target nebel_test_core
}

# run MODEL CALL: prints its own log where it fails.
run() {
    local model=$1 log passed="check_qemu: $2 on $1 passed"
    read -ra call <<<"$2"
    log=$build/qemu-$model-${call[0]}.log
    if [ "$model" = aarch64 ]; then
        set -- qemu-aarch64 "$cross/tests/nebel_test_core"
    else
        set -- qemu-x86_64 -cpu "$model" "$build/tests/nebel_test_core"
    fi
    if "$@" "${call[@]}" >"$log" 2>&1; then
        echo "$passed" "$(sed -n 's/^\([a-z0-9]*\): runs$/\1/p' "$log" | xargs)"
    else
        echo "check_qemu: ${call[*]} on $model:"
        cat "$log"
        return 1
    fi
}

if ! build_aarch64 >"$build/aarch64.log" 2>&1; then
    cat "$build/aarch64.log"
    exit 1
fi
export -f run
export build cross
for model in aarch64 Conroe Nehalem Haswell; do
    for call in "${calls[@]}"; do pairs+=("$model" "$call"); done
done
printf '%s\0' "${pairs[@]}" | xargs -0 -n 2 -P "$(nproc)" bash -c 'run "$@" || exit 1' run || {
    echo "check_qemu: failed"
    exit 1
}
