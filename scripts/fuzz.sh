#!/bin/bash
# Fuzzes one parser for half a minute. FUZZER is a program of a build with NEBEL_BUILD_FUZZ; what it says is shown where it fails. Reading
# a scene makes the tables of its planets' air, which for a single one may take half a minute, and with sanitizers some times that.
set -euo pipefail
fuzzer=${1:?usage: scripts/fuzz.sh FUZZER}
cd "$(dirname "$0")/.."

name=$(basename "$fuzzer")
name=${name#fuzz_}
log=$fuzzer.log
found=$(mktemp -d)
trap 'rm -rf "$found"' EXIT
words=()
if [ -e "fuzz/$name.dict" ]; then words=("-dict=fuzz/$name.dict"); fi
mkdir -p "fuzz/corpus/$name"
if ! "$fuzzer" "${words[@]}" -max_total_time=30 -timeout=300 -rss_limit_mb=2048 -verbosity=0 -print_final_stats=1 \
    "$found" "fuzz/corpus/$name" >"$log" 2>&1; then
    cat "$log"
    exit 1
fi
echo "$name: $(grep -o 'number_of_executed_units.*' "$log")"
