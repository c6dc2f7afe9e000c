#!/bin/bash
# check_qemu.sh BUILD: the kernels on processors that this machine is not. test_kernels, test_pixels and test_classic_vertices for
# aarch64 (NEON), and of BUILD on x86 models without AVX2, without AVX, and with AVX2; there the dispatcher must pick a level that the model has.
set -euo pipefail

build=$(cd "${1:?usage: check_qemu.sh BUILD}" && pwd)
source=$(cd "$(dirname "$0")/.." && pwd)
cross=$build/aarch64
segments=5000 # emulation is some thirty times slower than the processor, where a million are tried

build_aarch64() {
    cmake -S "$source" -B "$cross" -DCMAKE_SYSTEM_NAME=Linux -DCMAKE_SYSTEM_PROCESSOR=aarch64 \
        -DCMAKE_C_COMPILER=aarch64-linux-gnu-gcc -DNEBEL_WERROR=ON -DNEBEL_BUILD_SCENE=OFF -DNEBEL_BUILD_CPU=OFF \
        -DNEBEL_BUILD_TESTS=OFF >"$build/aarch64.log"
    cmake --build "$cross" -j "$(nproc)" --target nebel >>"$build/aarch64.log"
}

run_aarch64() {
    local name=$1
    aarch64-linux-gnu-gcc -std=c11 -O2 -ffp-contract=off -fno-math-errno -static -DNEBEL_SOURCE="\"$source\"" \
        -I"$source/tests/cross" -I"$source/include" -I"$source/src" \
        "$source/tests/$name.c" "$source/tests/random_fog.c" "$cross/libnebel.a" -lm -o "$cross/$name"
    qemu-aarch64 "$cross/$name" $segments
}

if [ ! -e "$source/tests/test_kernels.c" ]; then
    echo "check_qemu: no kernel tests yet"
    exit 0
fi

if ! build_aarch64; then
    cat "$build/aarch64.log"
    exit 1
fi
models=(aarch64 Conroe Nehalem Haswell)
tests=(test_kernels test_pixels test_pixel_types test_classic_vertices)
declare -A running
for model in "${models[@]}"; do
    for name in "${tests[@]}"; do
        case $model in
        aarch64) run_aarch64 "$name" >"$build/qemu-$model-$name.log" 2>&1 & ;;
        *) qemu-x86_64 -cpu "$model" "$build/tests/nebel_test_core" "$name" $segments >"$build/qemu-$model-$name.log" 2>&1 & ;;
        esac
        running[$model-$name]=$!
    done
done

failed=0
for model in "${models[@]}"; do
    for name in "${tests[@]}"; do
        log=$build/qemu-$model-$name.log
        if wait "${running[$model-$name]}"; then
            echo "check_qemu: $name on $model passed" "$(sed -n 's/^\([a-z0-9]*\): runs$/\1/p' "$log" | xargs)"
        else
            failed=$((failed + 1))
            echo "check_qemu: $name on $model:"
            cat "$log"
        fi
    done
done
echo "check_qemu: $((${#running[@]} - failed)) passed, $failed failed"
[ "$failed" -eq 0 ]
