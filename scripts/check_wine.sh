#!/bin/bash
# check_wine.sh BUILD: the core as a Windows library. Builds it and its tests with MinGW in BUILD/windows and runs them in Wine, whose
# prefix (700 MB) is BUILD/wine-prefix; compares the bits of light with those of BUILD/libnebel.a, where that is. Where MinGW or Wine are
# missing it says so and succeeds, unless CI=true.
set -euo pipefail

build=$(cd "${1:?usage: check_wine.sh BUILD}" && pwd)
source=$(cd "$(dirname "$0")/.." && pwd)
windows=$build/windows
wine=$source/tests/cross/wine.sh
export NEBEL_WINE_PREFIX=$build/wine-prefix

missing=()
for program in x86_64-w64-mingw32-gcc /usr/lib/wine/wine64 /usr/lib/wine/wineserver64 xvfb-run; do
    command -v "$program" >/dev/null || missing+=("$program")
done
if [ ${#missing[@]} -gt 0 ]; then
    echo "check_wine: left out for want of ${missing[*]}; scripts/install_packages.sh windows installs them"
    if [ "${CI:-}" = true ]; then exit 1; fi
    exit 0
fi

build_windows() {
    cmake -S "$source" -B "$windows" --toolchain "$source/cmake/mingw-w64.cmake" -DNEBEL_WERROR=ON -DNEBEL_BUILD_SCENE=OFF \
        -DNEBEL_BUILD_CPU=OFF -DNEBEL_BUILD_GL=OFF \
        -DCMAKE_CROSSCOMPILING_EMULATOR="$wine"
    cmake --build "$windows" -j "$(nproc)"
}

wineserver() {
    WINEPREFIX=$NEBEL_WINE_PREFIX /usr/lib/wine/wineserver64 "$@"
}

# The server lives from here to the end and makes the prefix away from the tests: a program that starts it hands it its output,
# and would seem to run for as long as it does.
start_wine() {
    mkdir -p "$NEBEL_WINE_PREFIX"
    wineserver -p
    xvfb-run -a "$wine" wineboot -i
}

stop_wine() {
    wineserver -k || true
    wineserver -w
}

compare_bits() {
    cc -std=c11 -O1 -I"$source/include" "$source/tests/cross/bits.c" "$build/libnebel.a" -lm -o "$build/bits"
    "$build/bits" >"$build/bits.txt"
    "$wine" "$windows/tests/bits.exe" 2>/dev/null | tr -d '\r' | diff "$build/bits.txt" -
    echo "check_wine: the same bits as here, $(wc -l <"$build/bits.txt") times"
}

if ! build_windows >"$build/windows.log" 2>&1; then
    cat "$build/windows.log"
    exit 1
fi
trap stop_wine EXIT
start_wine </dev/null >"$build/wine.log" 2>&1
xvfb-run -a -s "-screen 0 640x480x24" ctest --test-dir "$windows" --output-on-failure --no-tests=error -j 2 2>&1
if [ -e "$build/libnebel.a" ]; then compare_bits; fi
