#!/bin/sh
# wine.sh PROGRAM.exe [ARGUMENT...]: runs a Windows program in the Wine prefix NEBEL_WINE_PREFIX, which scripts/check_wine.sh makes.
# Debian has no wine64 in the path. Nothing is written to the desktop's menus, and nobody is asked about Mono and Gecko.
export WINEPREFIX="${NEBEL_WINE_PREFIX:?}" WINEARCH=win64 WINEDEBUG=-all
export WINEDLLOVERRIDES="mscoree,mshtml=;winemenubuilder.exe=d"

# Now and then Wine ends before it has begun the program, without a word. Each of these begins by saying something: one that fails in
# silence has not run.
said=$(mktemp)
trap 'rm -f "$said"' EXIT
for try in 1 2 3; do
    /usr/lib/wine/wine64 "$@" >"$said" 2>&1
    status=$?
    if [ "$status" -eq 0 ] || [ -s "$said" ]; then break; fi
    echo "wine.sh: $1 did not begin (exit status $status, attempt $try of 3)"
done
cat "$said"
exit "$status"
