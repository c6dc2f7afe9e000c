#!/bin/bash
# check_wine.sh BUILD: the core as a Windows library. Builds it and its tests with MinGW in BUILD/windows and runs them in Wine, whose
# prefix (700 MB) is BUILD/wine-prefix; compares the bits of light, static and from a DLL, with those of BUILD/libnebel.a, where that is.
# Builds the library for 32 bits in BUILD/windows-32, and runs its tests where there is a Wine of 32 bits (WINE32; Debian: wine32 of i386). Where
# MinGW or Wine are missing it says so and succeeds, unless CI=true.
set -euo pipefail

build=$(cd "${1:?usage: check_wine.sh BUILD}" && pwd)
source=$(cd "$(dirname "$0")/.." && pwd)
windows=$build/windows
wine=$source/tests/cross/wine.sh
export NEBEL_WINE_PREFIX=$build/wine-prefix
wine32=${WINE32:-$(ls /usr/lib/wine/wine 2>/dev/null || true)}

missing=()
for program in x86_64-w64-mingw32-gcc i686-w64-mingw32-gcc /usr/lib/wine/wine64 /usr/lib/wine/wineserver64 xvfb-run; do
    command -v "$program" >/dev/null || missing+=("$program")
done
if [ ${#missing[@]} -gt 0 ]; then
    echo "check_wine: left out for want of ${missing[*]}; scripts/install_packages.sh windows installs them"
    if [ "${CI:-}" = true ]; then exit 1; fi
    exit 0
fi

# configure FOLDER TOOLCHAIN [OPTION...]
configure() {
    local folder=$1 toolchain=$2
    shift 2
    cmake -S "$source" -B "$build/$folder" --toolchain "$source/cmake/$toolchain.cmake" -DNEBEL_WERROR=ON -DNEBEL_BUILD_SCENE=OFF \
        -DNEBEL_BUILD_CPU=OFF -DNEBEL_BUILD_GL=OFF -DCMAKE_CROSSCOMPILING_EMULATOR="$wine" "$@"
}

build_windows() {
    configure windows mingw-w64
    cmake --build "$windows" -j "$(nproc)"
    # What a DLL exports and the bits of light hang on no optimization, with little of which they are built in half of the time. With
    # none gcc's vector functions are macros, which it warns of.
    local quick=(-DCMAKE_BUILD_TYPE=Debug -DCMAKE_C_FLAGS_DEBUG=-O1)
    configure windows-dll mingw-w64 "${quick[@]}" -DBUILD_SHARED_LIBS=ON -DCMAKE_RUNTIME_OUTPUT_DIRECTORY="$build/windows-dll/bin"
    cmake --build "$build/windows-dll" -j "$(nproc)" --target bits
    if [ -n "$wine32" ]; then quick=(); fi
    configure windows-32 mingw-w64-32 "${quick[@]}"
    cmake --build "$build/windows-32" -j "$(nproc)" --target "$([ -n "$wine32" ] && echo all || echo nebel)"
}

# What the DLL gives away, and what it needs of others.
check_dll() {
    local dll=$build/windows-dll/bin/libnebel.dll described names needed
    described=$(x86_64-w64-mingw32-objdump -p "$dll")
    names=$(sed -n '/Ordinal\/Name/,/^$/p' <<<"$described" | awk '/^\t\[/ { print $NF }')
    needed=$(sed -n 's/.*DLL Name: //p' <<<"$described" | grep -viE '^(kernel32|msvcrt)\.dll$' || true)
    if [ -z "$names" ] || grep -qv '^nebel_' <<<"$names" || [ -n "$needed" ]; then
        echo "check_wine: libnebel.dll exports $(grep -v '^nebel_' <<<"$names" | xargs), needs $needed"
        exit 1
    fi
    echo "check_wine: libnebel.dll exports $(wc -l <<<"$names") functions"
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

# compare_bits WINE PROGRAM
compare_bits() {
    "$1" "$2" 2>/dev/null | tr -d '\r' | grep '^fog' | diff "$build/bits.txt" -
    echo "check_wine: ${2#"$build/"}: the same bits as here, $(wc -l <"$build/bits.txt") times"
}

compare_all_bits() {
    cc -std=c11 -O1 -I"$source/include" "$source/tests/cross/bits.c" "$build/libnebel.a" -lm -o "$build/bits"
    "$build/bits" >"$build/bits.txt"
    compare_bits "$wine" "$windows/tests/bits.exe"
    compare_bits "$wine" "$build/windows-dll/bin/bits.exe"
    if [ -n "$wine32" ]; then compare_bits run_32 "$build/windows-32/tests/bits.exe"; fi
}

# A prefix of its own, because the other has a server of 64 bits.
run_32() {
    WINEPREFIX=$NEBEL_WINE_PREFIX-32 WINEARCH=win32 WINEDEBUG=-all WINEDLLOVERRIDES="mscoree,mshtml=;winemenubuilder.exe=d" "$wine32" "$@"
}

# The tests but those of Direct3D, one after the other.
run_tests_32() {
    local name tests=$build/windows-32/tests
    mkdir -p "$NEBEL_WINE_PREFIX-32"
    while read -r name; do
        (cd "$source/tests" && run_32 "$tests/nebel_test_core.exe" "$name") >"$build/windows-32/$name.log" 2>&1 || { cat "$build/windows-32/$name.log"; exit 1; }
    done < <(sed -n 's/^SUITE.*(\(.*\))$/\1/p' "$tests/suites_core.inc")
    echo "check_wine: the tests pass in 32 bits"
}

if ! build_windows >"$build/windows.log" 2>&1; then
    cat "$build/windows.log"
    exit 1
fi
check_dll
trap stop_wine EXIT
start_wine </dev/null >"$build/wine.log" 2>&1
export NEBEL_TEST_SCALE=0.1
xvfb-run -a -s "-screen 0 640x480x24" ctest --test-dir "$windows" --output-on-failure --no-tests=error -j 2 2>&1
if [ -n "$wine32" ]; then run_tests_32; else echo "check_wine: the library of 32 bits is built, but there is no Wine to run its tests"; fi
if [ -e "$build/libnebel.a" ]; then compare_all_bits; fi
