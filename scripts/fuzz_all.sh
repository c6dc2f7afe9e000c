#!/bin/bash
# Fuzzes everything for hours on all cores. BUILD is a build with NEBEL_BUILD_FUZZ (build-asan). Each fuzzer has its share of the time. What is
# found stays in BUILD/fuzz/corpus/NAME, where the next run begins, reduced to what adds coverage; inputs that crash, hang or swell stay in
# BUILD/fuzz/crashes, and are named at the end with how to repeat them.
set -euo pipefail
usage="usage: scripts/fuzz_all.sh HOURS [BUILD] [NAME...]"
hours=${1:?$usage}
build=$(realpath "${2:-build-asan}")
shift $(($# < 2 ? $# : 2))
cd "$(dirname "$0")/.."

names=("$@")
if [ ${#names[@]} = 0 ]; then
    for source in fuzz/fuzz_*.c; do name=$(basename "$source" .c); names+=("${name#fuzz_}"); done
fi
for name in "${names[@]}"; do
    if [ ! -x "$build/fuzz/fuzz_$name" ]; then echo "fuzz_all: $build/fuzz/fuzz_$name is not built; configure with -DNEBEL_BUILD_FUZZ=ON"; exit 2; fi
done
jobs=$(nproc)
if [ ${#names[@]} -lt "$jobs" ]; then jobs=${#names[@]}; fi
seconds=$(awk -v hours="$hours" -v jobs="$jobs" -v count=${#names[@]} 'BEGIN { s = int(hours * 3600 * jobs / count); print s < 1 ? 1 : s }')
crashes=$build/fuzz/crashes
mkdir -p "$crashes"
before=$(find "$crashes" -type f | sort)

# One fuzzer, which goes on after what it finds; then its corpus is merged.
fuzz() {
    local name=$1 program=$build/fuzz/fuzz_$1 kept=$build/fuzz/corpus/$1 words=()
    if [ -e "fuzz/$name.dict" ]; then words=("-dict=fuzz/$name.dict"); fi
    mkdir -p "$kept" "$crashes/$name"
    local seeds=()
    if [ -d "fuzz/corpus/$name" ]; then seeds=("fuzz/corpus/$name"); fi
    "$program" "${words[@]}" -fork=1 -ignore_crashes=1 -ignore_timeouts=1 -ignore_ooms=1 -max_total_time="$seconds" -timeout=60 \
        -rss_limit_mb=2048 -artifact_prefix="$crashes/$name/" "$kept" "${seeds[@]}" >"$build/fuzz/fuzz_$name.log" 2>&1 || true
    rm -rf "$kept.merged"
    mkdir "$kept.merged"
    if "$program" -merge=1 -timeout=60 -rss_limit_mb=2048 -artifact_prefix="$crashes/$name/" "$kept.merged" "$kept" "${seeds[@]}" \
        >>"$build/fuzz/fuzz_$name.log" 2>&1; then
        rm -rf "$kept"
        mv "$kept.merged" "$kept"
    fi
    echo "$name: $seconds s, $(find "$kept" -type f | wc -l) inputs kept"
}
export build crashes seconds
export -f fuzz
printf '%s\n' "${names[@]}" | xargs -P "$jobs" -I{} bash -c 'set -euo pipefail; fuzz {}'

found=$(comm -13 <(echo "$before") <(find "$crashes" -type f | sort))
if [ -z "$found" ]; then echo "fuzz_all: nothing found"; exit 0; fi
while read -r input; do
    name=$(basename "$(dirname "$input")")
    echo "fuzz_all: $name: $build/fuzz/fuzz_$name $input"
done <<<"$found"
exit 1
